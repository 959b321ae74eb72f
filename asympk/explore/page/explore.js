// The page of asympk explore: it asks the server for a motion and draws the answer. No motion is computed here.

const $ = id => document.getElementById(id);
const GRID = 160; // places along either axis at which slow manifolds and stick regions are asked for
let scenes = [], scene = null;
let given = null; // the numbers that were changed: { parameters, start, until }
let view = null; // what was chosen of the pictures: { across, up, time }
let motion = null, curves = [], axes = null, dragging = false;

// ---- the server -----------------------------------------------------------------------------------------------------

const lanes = {}; // for each question: the request under way, how to drop it, and the last one that waits for its end

// Ask what `question` returns with the numbers of the page, and show the answer, unless another scene was chosen or all
// was reset meanwhile; `fresh` says whether the numbers are still those of the answer.
async function ask(name, question, show) {
  const lane = lanes[name] ??= { busy: false, next: null };
  if (lane.busy) { lane.next = [question, show]; return; }
  lane.busy = true;
  lane.since = performance.now();
  attend();
  lane.drop = new AbortController();
  const { signal } = lane.drop, asked = given, body = () => JSON.stringify({ ...turned(), ...question() }), sent = body();
  const reply = await fetch(name, { method: "POST", body: sent, signal })
    .then(async found => ({ ok: found.ok, answer: await found.json() }))
    .catch(() => ({ ok: false, answer: { error: "The server does not answer any more: start asympk explore again." } }));
  lane.busy = false;
  if (asked === given && !signal.aborted) reply.ok ? show(reply.answer, sent === body()) : refuse(name, reply.answer.error);
  const next = lane.next;
  lane.next = null;
  if (next) ask(name, ...next);
  attend();
}

function attend() {
  document.body.setAttribute("aria-busy", Object.values(lanes).some(lane => lane.busy));
  sayWhatIsComputed(); // at once, so that nothing moves on the page when all is there
}

// Say which answers have been computed for more than half a second, and for how long.
const WORDS = { scenes: "equations of motion", motion: "motion", surroundings: "slow manifolds and stick regions", least: "ladder of models" };
function sayWhatIsComputed() {
  const busy = Object.entries(lanes).filter(([, lane]) => lane.busy && performance.now() - lane.since > 500);
  const told = busy.map(([name, lane]) => `${WORDS[name]} ${((performance.now() - lane.since) / 1000).toFixed(0)} s`);
  $("busy").textContent = told.length ? `computing: ${told.join(", ")}` : "";
  for (const [name, late] of [["motion", "late"], ["surroundings", "late-curves"]]) $("pictures").classList.toggle(late, busy.some(([kind]) => kind === name));
}

const PATIENCE = 5000; // milliseconds after which a computation is ended where its numbers are no longer those of the page
setInterval(() => {
  sayWhatIsComputed();
  for (const lane of Object.values(lanes)) if (lane.next && performance.now() - lane.since > PATIENCE) lane.drop.abort();
}, 250);

const turned = () => ({ scene: scenes.indexOf(scene), ...given });
function refuse(name, words) {
  tell(name === "surroundings" ? said || `${WORDS[name]}: ${words}` : words);
  if (name === "motion") { fade(true); $("model").textContent = ""; }
  if (name === "surroundings" && motion) { curves = []; drawPhase(); }
  if (name === "least") $("verdict").replaceChildren();
}

// Fade pictures that do not show the motion that was asked for.
function fade(on) {
  $("pictures").classList.toggle("stale", on);
  if (motion) $("series").ariaLabel = inWords();
}

let wrong = "", said = ""; // what the address has that the page has not; what is said of the last answer
function tell(words) {
  said = words;
  $("message").textContent = [wrong, said].filter(Boolean).join(" ");
}

function changed() {
  keep();
  refresh();
}

function refresh() {
  $("verdict").classList.add("stale");
  ask("motion", () => ({ draft: dragging }), found => {
    tell(found.stopped);
    if (found.t && !motion && !view.time) $("logarithmic").checked = found.events[(found.events.length - 1) >> 1]?.t < found.t.at(-1) / 50;
    fade(!found.t);
    if (found.t) { motion = found; draw(); showStart(); }
    $("model").textContent = found.t ? `followed by the method ${found.model}, ${found.events.length} event${found.events.length === 1 ? "" : "s"}` : "";
    surround();
  });
}

function surround() {
  if (!axes) return;
  const places = axis => Array.from({ length: GRID }, (_, k) => axis.back(axis.from + (axis.to - axis.from) * k / (GRID - 1)));
  const pair = [$("across").value, $("up").value];
  const question = { pair, across: places(axes.x), up: places(axes.y) };
  ask("surroundings", () => question, found => { if (pair[0] === $("across").value && pair[1] === $("up").value) { curves = found; drawPhase(); } });
}

// ---- axes -----------------------------------------------------------------------------------------------------------

// Where a value stands from `low` on, with 1 at `high`, and its inverse; the difference of the two may be no double.
function between(low, high) {
  const size = Math.max(Math.abs(low), Math.abs(high));
  return [v => (v / size - low / size) / (high / size - low / size), part => low * (1 - part) + high * part];
}

// The scale of a linear axis and its inverse or, with `stretch`, of one that is logarithmic where |value| exceeds
// `stretch`: asinh(value / width), scaled as times in figures, so that the part from 0 to `stretch` is as long as a decade.
// The width and the quotient may lie beyond the doubles.
function scale(stretch) {
  if (!stretch) return [v => v, v => v];
  const width = Math.log(stretch) - Math.log(Math.sinh(Math.log(10))), logarithm = v => Math.log(Math.abs(v)) - width;
  const bent = power => power > 20 ? power + Math.LN2 : Math.asinh(Math.exp(power));
  const straight = place => Math.exp(place + width + Math.log(-Math.expm1(-2 * place) / 2));
  return [v => Math.sign(v) * bent(logarithm(v)), p => Math.sign(p) * straight(Math.abs(p))];
}

function axis(low, high, stretch, from, to) {
  const [bent, straight] = scale(stretch);
  const [part, value] = between(bent(low), bent(high));
  return {
    from, to, low, high,
    at: v => Math.max(-1e5, Math.min(1e5, from + part(bent(v)) * (to - from))),
    back: p => straight(value((p - from) / (to - from))),
    ticks: count => stretch && Math.max(high, -low) > 30 * stretch ? powers(low, high, stretch, count) : steps(low, high, count),
  };
}

// At most count + 1 places and, as each step is at most 5/2 of the one before, two of them at least for a count of 4.
function steps(low, high, count) {
  const power = 10 ** Math.floor(Math.log10(high / count - low / count));
  const step = [1, 2, 5, 10].map(k => k * power).find(s => Math.floor(high / s) - Math.ceil(low / s) <= count) ?? 10 * power;
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
  return found;
}

function powers(low, high, stretch, count) {
  const first = Math.round(Math.log10(stretch)), last = Math.floor(Math.log10(Math.max(high, -low)));
  const by = Math.max(1, Math.ceil((last - first + 1) * (low < 0 && high > 0 ? 2 : 1) / count));
  const found = low <= 0 && high >= 0 ? [0] : [];
  for (let k = first; k <= last; k += by) found.push(10 ** k, -(10 ** k));
  return found.filter(v => v >= low && v <= high);
}

const NOISE = 1e-12; // of values that are equal but for rounding: what varies less is drawn as a constant

// The range of values with a margin, as the axis will show it.
function around(values, stretch) {
  const [bent, straight] = scale(stretch), places = values.filter(v => v !== null).map(bent);
  const low = places.reduce((a, b) => Math.min(a, b), Infinity), high = places.reduce((a, b) => Math.max(a, b), -Infinity);
  const size = Math.max(Math.abs(low), Math.abs(high));
  const beside = 0.12 * (high - low > NOISE * size ? high - low : Math.max(1, size));
  return [Math.max(-Number.MAX_VALUE, low - beside), Math.min(Number.MAX_VALUE, high + beside)].map(straight);
}

// A place of an axis with as many digits as tell it from the others.
function label(v, places) {
  const size = Math.max(...places.map(Math.abs)) || 1, digits = Math.ceil(Math.log10(size / Math.min(...places.flatMap((a, k) => places.slice(k + 1).map(b => Math.abs(a - b))), size))) + 1;
  const text = +v.toPrecision(Math.min(15, Math.max(1, digits)));
  return v !== 0 && (Math.abs(v) >= 1e4 || Math.abs(v) < 1e-3) ? text.toExponential().replace("e+", "e") : String(text);
}
const plain = v => v !== 0 && Math.abs(v) < 1e-3 ? (+v.toPrecision(6)).toExponential() : String(+v.toPrecision(6));
const named = name => scene.units[name] ? `${name} (${scene.units[name]})` : name;

// ---- drawing --------------------------------------------------------------------------------------------------------

function make(kind, attributes = {}, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

// The path through points, with a gap where a number is infinite.
const line = (points, x, y) => points
  .map(([u, v]) => u === null || v === null ? "" : `${x.at(u).toFixed(1)},${y.at(v).toFixed(1)}`)
  .map((p, k, all) => p && (k && all[k - 1] ? "L" : "M") + p).join("");

function clipped(svg, id, x, y) {
  const clip = make("clipPath", { id });
  clip.append(make("rect", { x: x.from, y: y.to, width: x.to - x.from, height: y.from - y.to }));
  svg.append(clip);
  const group = make("g", { "clip-path": `url(#${id})` });
  svg.append(group);
  return group;
}

const RIGHT = 10; // pixels beside an axis

function ruled(svg, x, y, told) {
  const across = apart(x.ticks(5), x, 34), upward = upwards(y);
  for (const v of across) {
    svg.append(make("line", { class: "grid", x1: x.at(v), x2: x.at(v), y1: y.from, y2: y.to }));
    const text = label(v, across), centre = Math.min(x.at(v), x.to + RIGHT - 4 * text.length); // else the last is cut
    if (told.x) svg.append(make("text", { x: centre, y: y.from + 16, "text-anchor": "middle" }, text));
  }
  for (const v of upward) {
    svg.append(make("line", { class: "grid", x1: x.from, x2: x.to, y1: y.at(v), y2: y.at(v) }));
    svg.append(make("text", { x: x.from - 6, y: y.at(v) + 4, "text-anchor": "end" }, label(v, upward)));
  }
  svg.append(make("rect", { class: "frame", x: x.from, y: y.to, width: x.to - x.from, height: y.from - y.to }));
  if (told.x) svg.append(make("text", { class: "name", x: x.to, y: y.from + 32, "text-anchor": "end" }, named(told.x)));
  return make("text", { class: "name", x: x.from + 6, y: y.to + 15 }, named(told.y)); // to be put over the curves
}

const upwards = y => apart(y.ticks(4), y, 13);

// The width in pixels of the labels on the left of upward axes.
const room = axes => Math.max(52, ...axes.flatMap(y => upwards(y).map((v, _, all) => 12 + 7 * label(v, all).length)));

// The values that are at least `pixels` apart on the axis, chosen in the order of their size.
function apart(values, axis, pixels) {
  const kept = [];
  for (const v of [...values].sort((a, b) => Math.abs(a) - Math.abs(b))) if (kept.every(w => Math.abs(axis.at(v) - axis.at(w)) >= pixels)) kept.push(v);
  return kept;
}

const wide = svg => svg.parentElement.clientWidth || 400;

function sized(svg, height) {
  const width = wide(svg);
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("height", height);
  svg.replaceChildren();
  return width;
}

function draw() {
  if (!motion) return;
  drawPhase();
  drawSeries();
}

function drawPhase() {
  const svg = $("phase"), across = $("across").value, up = $("up").value;
  svg.ariaLabel = `phase picture: ${named(up)} over ${named(across)}`;
  const height = Math.min(460, 0.9 * wide(svg), 0.42 * Math.max(window.innerHeight, 700)), width = sized(svg, height);
  const u = motion.states[across], v = motion.states[up];
  if (!dragging || !axes) {
    const y = axis(...around(v, motion.stretch[up]), motion.stretch[up], height - 38, 8);
    axes = { x: axis(...around(u, motion.stretch[across]), motion.stretch[across], room([y]), width - RIGHT), y };
  }
  const { x, y } = axes;
  const name = ruled(svg, x, y, { x: across, y: up });
  const inside = clipped(svg, "within", x, y);
  const seen = curves.filter(({ points }) => points.some((point, k) => k && crosses([points[k - 1], point], [x, y])));
  for (const curve of seen) inside.append(make("path", { class: `curve ${curve.kind}`, d: line(curve.points, x, y) }));
  inside.append(make("path", { class: "path", d: line(u.map((value, k) => [value, v[k]]), x, y) }));
  const [a, b] = [across, up].map(name => scene.quantities.indexOf(name));
  for (const event of marked(200)) inside.append(make("circle", { class: "event", r: 3, cx: x.at(event.state[a]), cy: y.at(event.state[b]) }));
  if (motion.stopped) inside.append(cross(x.at(motion.final[a]), y.at(motion.final[b])));
  const start = { cx: x.at(u[0]), cy: y.at(v[0]) };
  svg.append(name, make("circle", { class: "ring", r: 6, ...start }), make("circle", { class: "handle", id: "handle", r: 22, ...start }));
  const words = { stable: "slow manifold at μ = 0, attracting", unstable: "slow manifold at μ = 0, repelling", stick: "sticks" };
  $("legend").replaceChildren(...Object.keys(words).filter(kind => seen.some(c => c.kind === kind))
    .map(kind => key(kind, words[kind], [...new Set(seen.filter(c => c.kind === kind && kind !== "stick").map(c => c.name.replace("Pi", "Π")))])),
  seen.some(c => c.begun) ? "(all else as at the start)" : "");
}

// Whether a short piece of a curve comes into the picture.
const crosses = (ends, axes) => axes.every(({ low, high }, k) => Math.min(...ends.map(p => p[k])) <= high && Math.max(...ends.map(p => p[k])) >= low);

function key(kind, words, names) {
  const told = document.createElement("span"), mark = document.createElement("i");
  mark.className = kind;
  told.append(mark, [names.join(", "), words].filter(Boolean).join(": "));
  return told;
}

// All events or, where dots for them would run together, none: to mark the first alone would say that no others follow.
const marked = most => motion.events.length > most ? [] : motion.events;

const cross = (x, y) => make("path", { class: "stop", d: `M${x - 5},${y - 5}l10,10m0,-10l-10,10` });

// The motion in words, for those who hear the page.
function inWords() {
  const modes = motion.modes.slice(0, 40).map(mode => `${mode.name} until t = ${plain(mode.to)}`);
  const left = motion.modes.length - modes.length, final = scene.quantities.map((name, k) => `${named(name)} = ${motion.final[k] === null ? "infinite" : plain(motion.final[k])}`);
  const older = $("pictures").classList.contains("stale") ? "of older numbers, " : "";
  return `${older}states over time: ${modes.join(", ")}${left ? `, and ${left} more modes` : ""}; at the end ${final.join(", ")}`;
}

// Give an element the colour of a mode on white paper and, with the lightness inverted, on black.
function coloured(element, shade) {
  const turn = 255 - Math.max(...shade) - Math.min(...shade);
  element.style.setProperty("--light", `rgb(${shade})`);
  element.style.setProperty("--dark", `rgb(${shade.map(part => part + turn)})`);
}

function drawSeries() {
  const svg = $("series"), names = scene.quantities, panel = names.length > 4 ? 92 : 118, gap = 8;
  const width = sized(svg, names.length * (panel + gap) + 42);
  svg.ariaLabel = inWords();
  const end = motion.t.at(-1) || 1, first = motion.events[0]?.t;
  const tops = names.map((_, k) => k * (panel + gap) + 6);
  const upward = names.map((name, k) => axis(...around(motion.states[name], motion.stretch[name]), motion.stretch[name], tops[k] + panel, tops[k]));
  const x = axis(0, end, $("logarithmic").checked ? 10 ** Math.floor(Math.log10(first || end / 1000)) : null, room(upward), width - RIGHT);
  names.forEach((name, k) => {
    const top = tops[k], y = upward[k];
    for (const mode of motion.modes) {
      const shade = make("rect", { class: "shade", x: x.at(mode.from), y: top, width: Math.max(0, x.at(mode.to) - x.at(mode.from)), height: panel });
      shade.append(make("title", {}, mode.name));
      coloured(shade, mode.shade);
      svg.append(shade);
    }
    const written = ruled(svg, x, y, { x: k === names.length - 1 ? "t" : "", y: name });
    const inside = clipped(svg, `panel${k}`, x, y);
    for (const event of motion.events) {
      const moment = make("line", { class: "moment", x1: x.at(event.t), x2: x.at(event.t), y1: top, y2: top + panel });
      moment.append(make("title", {}, `${event.kind} at t = ${event.t}`));
      inside.append(moment);
    }
    inside.append(make("path", { class: "path", d: line(motion.t.map((t, j) => [t, motion.states[name][j]]), x, y) }));
    for (const event of marked(40)) inside.append(make("circle", { class: "event", r: 2.6, cx: x.at(event.t), cy: y.at(event.state[k]) }));
    if (motion.stopped) inside.append(cross(x.at(end), y.at(motion.final[k])));
    svg.append(written);
  });
  const shades = new Map(motion.modes.map(mode => [mode.name, mode.shade]));
  $("modes").replaceChildren(...[...shades].map(([name, shade]) => {
    const told = key("shade", name, []);
    coloured(told.firstChild, shade);
    return told;
  }));
}

// ---- knobs ----------------------------------------------------------------------------------------------------------

const STEPS = 1000; // of a slider

// The number that a decimal or a ratio spells, NaN for any other text.
const worth = text => text.split("/").map(part => part.trim() ? Number(part) : NaN).reduce((a, b) => a / b);

function knob(told, set) {
  const row = document.createElement("div"), slider = document.createElement("input"), box = document.createElement("input");
  const name = document.createElement("span");
  row.className = "knob";
  name.textContent = told.unit ? `${told.name} (${told.unit})` : told.name;
  Object.assign(slider, { type: "range", min: 0, max: STEPS, step: 1, ariaLabel: told.name });
  Object.assign(box, { type: "text", inputMode: "decimal", ariaLabel: `${told.name}, number` });
  slider.dataset.slider = told.name;
  box.dataset.box = told.name;
  const { low, high, log } = told;
  const [linear, back] = between(low, high);
  const value = part => log ? low * (high / low) ** part : back(part);
  const part = v => log ? Math.log(v / low) / Math.log(high / low) : linear(v);
  const write = text => { box.value = slider.ariaValueText = text; };
  const move = text => { const to = part(worth(text.replace(told.unit === "deg" ? /deg\s*$/ : "", ""))); if (!Number.isNaN(to)) slider.value = STEPS * Math.max(0, Math.min(1, to)); };
  const show = v => { move(String(v)); write(typeof v === "number" ? plain(v) : v); };
  slider.oninput = () => { const v = +value(slider.value / STEPS).toPrecision(4); write(plain(v)); set(v); };
  box.onchange = () => { const text = box.value.trim(); move(text); write(text); set(text); };
  show(told.value);
  row.append(name, slider, box);
  row.show = show;
  return row;
}

// Show the numbers of the start that follow from others: those that were given, or are being written, stay.
function showStart() {
  scene.start.forEach(({ name }, k) => {
    const row = $("start").children[k];
    if (!(name in given.start) && !row.contains(document.activeElement)) row.show(motion.states[name][0]);
  });
}

const follows = {}; // rows of the knobs that follow another one until they are turned themselves

function turn(name, v) {
  given.parameters[name] = v;
  follows[name]?.[0].classList.remove("follows");
  delete follows[name];
  for (const [follower, leader] of Object.values(follows)) if (leader === name) follower.show(v);
}

function knobs() {
  for (const name of Object.keys(follows)) delete follows[name];
  $("parameters").replaceChildren(...scene.parameters.map(told => {
    const row = knob(told, v => { turn(told.name, v); changed(); });
    if (told.follows) { follows[told.name] = [row, told.follows]; row.classList.add("follows"); row.title = `as ${told.follows}`; }
    return row;
  }));
  $("start").replaceChildren(...scene.start.map(told => knob(told, v => { given.start[told.name] = v; changed(); })));
  $("until").replaceChildren(knob(scene.until, v => { given.until = v; changed(); }));
  for (const kind of ["parameters", "start"]) scene[kind].forEach(({ name }, k) => {
    if (!Object.hasOwn(given[kind], name)) return;
    $(kind).children[k].show(given[kind][name]);
    if (kind === "parameters") turn(name, given[kind][name]);
  });
  if (given.until !== null) $("until").firstChild.show(given.until);
}

// Show a scene, with numbers and pictures other than its own where they are given.
function choose(k, numbers = { parameters: {}, start: {}, until: null }, seen = {}) {
  scene = scenes[k];
  motion = axes = null;
  for (const lane of Object.values(lanes)) {
    lane.next = null;
    lane.drop?.abort(); // what has been computed for seconds is ended by the server, which sees it
  }
  curves = [];
  for (const id of ["phase", "legend", "modes", "series", "model"]) $(id).replaceChildren();
  given = numbers;
  view = seen;
  $("scene").value = k;
  for (const [menu, chosen] of [["across", scene.pair[0]], ["up", scene.pair[1]]]) {
    $(menu).replaceChildren(...scene.quantities.map(name => new Option(name, name)));
    $(menu).value = view[menu] ?? chosen;
  }
  if (view.time) $("logarithmic").checked = view.time === "logarithmic";
  $("verdict").replaceChildren();
  tell("");
  knobs();
  refresh();
}

// ---- the address ----------------------------------------------------------------------------------------------------

// What was changed stands behind # in the address, so that it can be loaded again and handed on, as in
// #scene=chalk&parameters.alpha=75&start.u=-1/10&until=1&across=R_1&up=u&time=linear; the server never sees it.
function address() {
  const parts = new URLSearchParams({ scene: called(scene) });
  for (const kind of ["parameters", "start"]) for (const [name, v] of Object.entries(given[kind])) parts.set(`${kind}.${name}`, v);
  if (given.until !== null) parts.set("until", given.until);
  for (const [key, chosen] of Object.entries(view)) parts.set(key, chosen);
  return scene === scenes[0] && [...parts].length === 1 ? location.pathname : `#${parts}`;
}

// The name of a scene or, where others have it too, its place.
const called = told => told.name && scenes.filter(({ name }) => name === told.name).length === 1 ? told.name : String(scenes.indexOf(told) + 1);

let writing = null;
function keep() {
  wrong = "";
  clearTimeout(writing);
  writing = setTimeout(() => history.replaceState(null, "", address()), 300); // browsers refuse more than a few a second
}

// Show what the address says; what it has that the page has not is told and left out.
function visit() {
  const parts = new URLSearchParams(location.hash.slice(1)), wanted = parts.get("scene");
  const k = wanted === null ? 0 : scenes.findIndex(told => called(told) === wanted);
  const numbers = { parameters: {}, start: {}, until: null }, seen = {}, unknown = k < 0 ? [`scene=${wanted}`] : [];
  for (const [key, text] of k < 0 ? [] : parts) {
    const [, kind, name] = key.match(/^(parameters|start)\.(.*)$/) ?? [];
    if (kind && scenes[k][kind].some(told => told.name === name)) numbers[kind][name] = text;
    else if (key === "until") numbers.until = text;
    else if (["across", "up"].includes(key) && scenes[k].quantities.includes(text)) seen[key] = text;
    else if (key === "time" && ["linear", "logarithmic"].includes(text)) seen.time = text;
    else if (key !== "scene") unknown.push(`${key}=${text}`);
  }
  clearTimeout(writing);
  wrong = unknown.length ? `The address has ${unknown.join(", ").slice(0, 200)}, which this page has not.` : "";
  choose(Math.max(k, 0), numbers, seen);
}

// ---- the start that is dragged --------------------------------------------------------------------------------------

const weights = name => {
  const k = scene.quantities.indexOf(name);
  return k < scene.start.length ? scene.start.map((_, j) => Number(j === k)) : scene.combinations[k - scene.start.length].weights;
};

// Put the two quantities of the picture at (u, v): each changes its last state that is not itself the other quantity.
function place(u, v) {
  const begun = name => name in given.start ? worth(String(given.start[name])) : NaN; // the motion may be an older one
  const start = scene.start.map(({ name }) => Number.isFinite(begun(name)) ? begun(name) : motion.states[name][0]);
  const goals = [[weights($("across").value), u], [weights($("up").value), v]];
  const own = w => w.flatMap((part, k) => part ? [k] : []);
  goals.sort((a, b) => own(a[0]).length - own(b[0]).length);
  const fixed = [];
  for (const [w, goal] of goals) {
    const k = own(w).filter(j => !fixed.includes(j)).at(-1);
    if (k === undefined) continue;
    start[k] += (goal - w.reduce((sum, part, j) => sum + part * start[j], 0)) / w[k];
    start[k] = +start[k].toPrecision(6);
    given.start[scene.start[k].name] = start[k];
    $("start").children[k].show(start[k]);
    fixed.push(k);
  }
}

$("phase").onpointerdown = event => {
  if (event.target.id !== "handle") return;
  $("phase").setPointerCapture(event.pointerId);
  dragging = true;
};
$("phase").onpointermove = event => {
  if (!dragging) return;
  const box = $("phase").getBoundingClientRect();
  const p = Math.max(axes.x.from, Math.min(axes.x.to, event.clientX - box.left));
  const q = Math.max(axes.y.to, Math.min(axes.y.from, event.clientY - box.top));
  place(axes.x.back(p), axes.y.back(q));
  changed();
};
$("phase").onpointerup = $("phase").onpointercancel = () => { if (dragging) { dragging = false; refresh(); } };

// ---- the least model ------------------------------------------------------------------------------------------------

const few = number => number === null ? "–" : number === 0 ? "0" : number.toExponential(1);

function cell(kind, text) {
  const made = document.createElement(kind);
  made.textContent = text;
  return made;
}

function verdict(ladder, fresh) {
  const table = document.createElement("table");
  const head = table.insertRow();
  head.append(...["", "predicted", "measured", "time / exact"].map(words => cell("th", words)));
  for (const rung of ladder.rungs) {
    const row = table.insertRow();
    row.append(cell("td", rung.model), cell("td", few(rung.predicted)), cell("td", few(rung.measured)), cell("td", rung.cost ? rung.cost.toFixed(1) : "–"));
    if (rung.model === ladder.model) row.className = "chosen";
    if (rung.reason) { const told = table.insertRow().insertCell(); told.colSpan = 4; told.className = "reason"; told.textContent = rung.reason; }
  }
  $("verdict").replaceChildren(cell("p", `${ladder.model} will do`), table);
  $("verdict").classList.toggle("stale", !fresh);
}

$("least").onclick = () => {
  $("verdict").replaceChildren(cell("p", "climbing the ladder of models, for about 15 s at most …"));
  $("verdict").classList.remove("stale");
  ask("least", () => ({ rtol: $("rtol").value.trim() }), verdict);
};
$("rtol").onkeydown = event => { if (event.key === "Enter") $("least").click(); };
$("rtol").oninput = () => $("verdict").classList.add("stale");

// ---- begin ----------------------------------------------------------------------------------------------------------

$("scene").onchange = () => { keep(); choose(Number($("scene").value)); };
$("reset").onclick = () => { keep(); choose(scenes.indexOf(scene)); };
for (const menu of ["across", "up"]) $(menu).onchange = () => { view[menu] = $(menu).value; curves = []; axes = null; keep(); draw(); surround(); };
$("logarithmic").onchange = () => { view.time = $("logarithmic").checked ? "logarithmic" : "linear"; keep(); draw(); };
window.addEventListener("resize", () => { axes = null; draw(); surround(); });

async function begin() {
  lanes.scenes = { busy: true, since: performance.now() };
  const reply = await fetch("scenes");
  const found = await reply.json();
  lanes.scenes.busy = false;
  if (!reply.ok) return tell(found.error);
  scenes = found;
  $("scene").replaceChildren(...scenes.map((told, k) => new Option(told.name || "scene", k)));
  visit();
  window.addEventListener("hashchange", visit);
}

begin().catch(() => tell("The server does not answer any more: the terminal says why."));
