r"""The conditions under which a composite expansion holds up to a given time.

``validity_conditions`` yields each condition as a truth value, or as an array of them, with its message.
"""

from collections.abc import Iterator
from typing import Any

from asympk.asymptotics.composite import LayerItineraries, ends, largest, state_of
from asympk.asymptotics.itinerary import LoadLine

SPREAD = 0.5  # the largest ratio of a correction to the term that it corrects
TOO_LARGE = 0.5  # the largest predicted error, relative to the states
APPROACHES = 4  # steps of Newton's method to an extremum of z: its first value is right to O(mu)
SLOWEST = 5  # the least |b|/mu: slow and fast rates meet at 4, and their series in mu/b converge only beyond


def validity_conditions(
    itineraries: LayerItineraries, found: list, error: Any, line: LoadLine, mu: Any, t: Any, m: Any
) -> Iterator[tuple[Any, str]]:
    """Yield (holds, words) for every condition of the expansion up to the time ``t``."""
    now, coarse, fine = (motion for motion, _ in found)
    steps = itineraries.steps + itineraries.then
    for i, (step, segment, end) in enumerate(zip(steps, fine.segments, ends(fine, t, m), strict=True)):
        later, turn = t <= segment.began, fine.turns[i] if i < len(fine.turns) else None
        fast = abs(line.fast[step.mode][1]) > SLOWEST * mu
        yield later | fast, f"the fast rate in {step.mode} is not fast, {SLOWEST} mu >= |b|"
        if i == len(itineraries.steps):
            held = line.margin(segment.x[0] + segment.y[0]) >= 0
            yield later | (held == (step.mode == "stick")), f"{step.mode} does not follow the arrival at z = 0"
        if turn:
            yield later | _apart(segment, step, line), f"the slow line of {step.mode} is far from its limit mu -> 0"
            yield (t <= turn.t) | ((abs(turn.spread) < SPREAD) & (turn.t >= segment.began)), (
                f"{step.mode} does not end with {turn.kind} as in the limit mu -> 0"
            )
            yield (t <= turn.t) | (step.side * turn.z >= 0), f"the motion meets z = 0 before the {turn.kind}"
            if turn.kind == "velocity_zero":
                end = m.where(t < turn.t, end, segment.began)
        rise, bend, of_series = _begun(segment, line.rate[step.mode], line.fast[step.mode], mu)
        if step.side:
            yield later | _leaves(segment, step.side, rise, bend), f"the motion returns to z = 0 in {step.mode} at once"
            clear = _clears(segment, step.side, rise, bend, of_series)
            yield later | clear, f"the motion meets z = 0 in {step.mode} unexpectedly"
        for at in (*_turning(segment, end, m), end) if step.side else ():
            z, rough = (state_of(motion.segments[i], at, m)[2] for motion in (fine, coarse))
            # at z = 0, and where a segment leaves it with a slope that vanishes, omitted terms may change the sign
            near = (segment.z[0] == 0) | (step.event == "velocity_zero" and at is end)
            slack = m.where(near, 2, -1) * abs(z - rough) + 100 * m.eps * (1 + abs(segment.z[0]))
            unsure = m.where(near, 0, 2 * abs(of_series - rise)) * (at - segment.began)
            yield later | (step.side * z >= unsure - slack), f"the motion meets z = 0 in {step.mode} unexpectedly"
        if step.event is None:
            s = sum(centre + slow for _, _, slow, _, centre in (segment.x, segment.y))
            sign = step.side if step.mode == "slip_same" else -step.side
            yield later | (sign * s > 0), f"the slow motion does not lie in {step.mode}"
    final = m.pick(now, t, m)
    scale = largest(1, final[0], final[2], m=m)
    yield error * scale <= TOO_LARGE * largest(scale, final[1], m=m), "the terms left out are as large as those kept"


def _apart(segment, step, line):
    """Tell whether a slow line is near its limit, compared with the distances of start and event from this limit."""
    rest = line.rest(step.mode)
    moved = abs(sum(centre + slow for _, _, slow, _, centre in (segment.x, segment.y)) - rest)
    near = moved <= SPREAD * abs(segment.x[0] + segment.y[0] - rest)
    return near if step.event == "velocity_zero" else near & (moved <= SPREAD * abs(line.load_at(step.level) - rest))


def _begun(segment, rate, fast, mu):
    """Return the exact z' = h0 + h1 s, (h0, h1) = ``rate``, and z'' where a segment begins, and z' of its series."""
    y, load = segment.y[0], segment.x[0] + segment.y[0]
    _, constant, part, of_fast, _ = segment.z
    bend = rate[1] * (y + (fast[0] + fast[1] * load) / mu)
    return rate[0] + rate[1] * load, bend, constant + part * segment.slow + of_fast * segment.fast


def _leaves(segment, side, slope, bend):
    """Tell whether a segment that begins on z = 0 leaves z = 0, by its exact z' and z'' there; true for all others."""
    return (segment.z[0] != 0) | (side * bend >= 0) | (side * 2 * slope * abs(segment.fast) > -side * bend)


def _clears(segment, side, slope, bend, of_series):
    """Tell whether a segment that first approaches z = 0, unlike its series, turns well before; true for all others."""
    return (segment.z[0] == 0) | (side * slope >= 0) | (side * of_series < 0) | (segment.z[0] * bend > slope * slope)


def _turning(segment, end, m):
    """Yield the times in a segment at which its fast and its slow part reverse z, or its beginning where none does."""
    _, rate, part, fast, _ = segment.z
    for top, bottom, speed in (
        (-(rate + part * segment.slow), fast * segment.fast, segment.fast),
        (-rate, part * segment.slow, segment.slow),
    ):
        ratio = top / m.where(bottom == 0, 1, bottom)
        at = segment.began + m.log(m.where(ratio > 0, ratio, 1)) / speed  # right to O(mu)
        at = _at_rest(segment, at, end, m)
        yield m.where((ratio > 0) & (bottom != 0) & (at > segment.began) & (at < end), at, segment.began)


def _at_rest(segment, at, end, m):
    """Return the time nearer to z' = 0 than ``at`` that Newton's method finds in the segment, or else ``at``."""
    slope, bend = _slopes(segment, at, end, m)
    for _ in range(APPROACHES):
        new = at - slope / m.where(bend == 0, 1, bend)
        there = _slopes(segment, new, end, m)
        nearer = (new > segment.began) & (new < end) & (abs(there[0]) < abs(slope))
        at, slope, bend = (m.where(nearer, *pair) for pair in zip((new, *there), (at, slope, bend), strict=True))
    return at


def _slopes(segment, t, end, m):
    """Return z' and z'' at ``t`` in a segment, or where it begins."""
    _, rate, part, fast, _ = segment.z
    local = m.where((t > segment.began) & (t < end), t - segment.began, 0)
    slowly, fastly = (c * k * m.exp(k * local) for c, k in ((part, segment.slow), (fast, segment.fast)))
    return rate + slowly + fastly, segment.slow * slowly + segment.fast * fastly
