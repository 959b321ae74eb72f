"""The chart of methods: what each costs and what it gets wrong, from the rows to the figures.

The full run makes the rows that the paper keeps; ``quick`` makes fewer, beside them. Figures are drawn from rows alone.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asympk.errors import MissingPackage
from asympk.integrators import collocation
from asympk.integrators.integrate import absent, run
from asympk.integrators.stepped import UNBOUNDED
from asympk.methods import METHODS, solve
from asympk.output.tabular import Cell, Table, write_table
from asympk.path import Event
from asympk.path import Path as Trajectory
from asympk.pictures import figures, style
from asympk.scene import Scene
from asympk.storage.rows import Row, provenance, read_provenance, read_rows, write_rows
from asympk.studies import contacts, modelwork
from asympk.studies.compare import workprec
from asympk.systems import nonlinear_rod

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCENES = {"i": (0, 0, 1), "ii": (0, "0.2", -1), "iii": (-1, -1, 1)}
UNTIL = 5
SHOWN = "ii"  # the scene whose costs have a figure of their own, for the README
FEW = ("exact", "kvaerno5", "lsoda", "rk45")  # the methods that the paper compares in its text
FAILING = "iii"  # the scene on which the most runs fail
MODELS = {
    "rigid": {"method": "rigid"},
    "slow": {"method": "slow", "order": 1},
    "jump 0": {"method": "jump", "order": 0},
    "jump 1": {"method": "jump", "order": 1},
    "jump 2": {"method": "jump", "order": 2},
}
EXPLICIT, IMPLICIT = ("rk45", "dop853", "heyoka"), ("kvaerno5", "radau", "bdf", "lsoda", "cvode")
CRUDE = ("sign", "tanh")
MUS = tuple(f"1e-{k}" for k in range(1, 9))
KAPPAS = {"0.1": MUS[1::2], "1": MUS, "10": MUS[1::2]}  # kappa -> its values of mu
FULL = {
    "scenes": tuple(SCENES), "mus": MUS, "kappas": KAPPAS, "tolerances": (1e-3, 1e-5, 1e-7, 1e-9, 1e-11),
    "step_sizes": (1e-2, 1e-3, 1e-4), "offsets": tuple(f"{s}1e-{k}" for s in ("-", "") for k in range(2, 15, 2)),
    "model_mus": modelwork.MUS, "model_tolerances": modelwork.TOLERANCES, "contact_mus": MUS[1::2],
    "repeats": 5, "steps": 100_000, "seconds": 120.0,
}  # fmt: skip
QUICK = {
    "scenes": ("ii", "iii"), "mus": ("1e-2", "1e-5"), "kappas": {"1": ("1e-2", "1e-5")}, "tolerances": (1e-3, 1e-7),
    "step_sizes": (1e-2, 1e-3), "offsets": ("-1e-10", "-1e-4", "1e-4", "1e-10"),
    "model_mus": ("1e-2", "1e-4"), "model_tolerances": (1e-5, 1e-8, 1e-11), "contact_mus": (),
    "repeats": 1, "steps": 2_000, "seconds": 10.0,
}  # fmt: skip
JUST_IN_TIME = ("heyoka", "kvaerno5")  # compiled for a system when it is first followed
COMPILED = 100  # a compiled step of heyoka is so much cheaper that it may make this many times more of them
SLOPE = 3  # tan(alpha) of the nonlinear rod; f = 1 makes sigma = 1
CAREFUL = (
    "All integrators: one smooth piece at a time, directed events, snapped states, atol = rtol. Radau, BDF, LSODA "
    "(scipy) and CVODE (SUNDIALS, BDF) have the analytic Jacobian; heyoka (Taylor, tol = rtol) and Kvaerno5 (diffrax, "
    "default root finder and controller, 64 bit) are compiled, and compiling is not counted; the others call Python, "
    "as the exact flow does. At most {steps} steps (heyoka {compiled} times as many) and {seconds:g} s."
)
CARELESS = (
    " sign: LSODA. tanh: Radau, ε = rtol. Moreau-Jean: implicit Euler, fixed steps of {longest:g} to {shortest:g}, "
    "the present mode where a step has several solutions."
)
PARTS = ("work", "plane", "nonlinear", "models", "contacts")


def main(
    quick: bool = False,
    out: str | Path = "paper/generated",
    progress: Callable[[str], None] | None = None,
    parts: Sequence[str] = PARTS,
) -> list[Path]:
    """Compute the rows of ``parts``, draw all figures, and return the files written, rows first.

    ``quick`` computes fewer rows, of the peers that are there, into ``out``/quick and leaves the kept ones alone.
    ``progress`` is called with one line for each step. Raises ``MissingPackage`` where the full run lacks a peer.
    """
    lacking = absent()
    if lacking and not quick:
        raise MissingPackage(f"the full chart runs {', '.join(lacking)} too: pip install {_quoted(lacking)}")
    plan = QUICK if quick else FULL
    kept, tell = Path(out), progress or (lambda line: None)
    out = kept / "quick" if quick else kept
    story = provenance(plan=plan, quick=quick, digits=30, seed=None, reference="exact flow")
    files = []
    if {*parts} - {"models"}:
        _warm(plan, tell)
    if "work" in parts:
        files += _store(out, "work", work_rows(plan, tell), story)
    if "plane" in parts:
        files += _store(out, "plane", plane_rows(plan, tell), story)
    if "nonlinear" in parts:
        found = nonlinear_references(plan, kept, tell)
        story |= {"reference": "collocation"}
        files += _store(out, "nonlinear-reference", found, story)
        files += _store(out, "nonlinear", nonlinear_rows(plan, found, tell), story)
    if "models" in parts:
        files += _store(out, "models", model_rows(plan, tell), story | {"reference": "Radau 1e-13"})
    if "contacts" in parts and plan["contact_mus"]:
        files += _store(out, "contacts", contact_rows(plan, tell), story | {"reference": "exact flow"})
    return files + draw_chart(out, tell)


def _quoted(packages):
    return " ".join(f"'{package}'" for package in packages.values())


def _store(out, name, rows, story):
    path = out / "rows" / f"{name}.csv"
    write_rows(path, rows, story)
    return [path]


def work_rows(plan: Mapping[str, Any], tell: Callable[[str], None]) -> list[Row]:
    """Return the rows of every method on every scene and mu of ``plan``."""
    rows: list[Row] = []
    for name in plan["scenes"]:
        for mu in plan["mus"]:
            scene = Scene(1, mu, SCENES[name], UNTIL, name=name)
            for method, options, tolerances in [*_models(), *_integrators(plan), *_crude(plan)]:
                tell(f"scene ({name}), mu = {mu}: {method}")
                rows += map(asdict, workprec(scene, label=method, repeats=plan["repeats"], **options)(tolerances))
    return rows


def _models():
    """Yield (name, options with the method, tolerances) of what has no tolerance."""
    yield "exact", {"method": "exact"}, (None,)
    for name, options in MODELS.items():
        if options["method"] in METHODS:
            yield name, options, (None,)


def _integrators(plan):
    lacking = absent()
    for method in (m for m in (*EXPLICIT, *IMPLICIT) if m not in lacking):
        steps = plan["steps"] * (COMPILED if method == "heyoka" else 1)
        yield method, {"method": method, "steps": steps, "seconds": plan["seconds"]}, plan["tolerances"]


def _crude(plan):
    yield from _one_field(plan)
    yield "moreau", {"method": "moreau", "seconds": plan["seconds"]}, plan["step_sizes"]


def _one_field(plan):
    for method in CRUDE:
        steps = min(plan["steps"], 20_000)
        yield method, {"method": method, "steps": steps, "seconds": plan["seconds"]}, plan["tolerances"]


def _warm(plan, tell):
    """Compile what is compiled, so that no run is charged with it."""
    for method, options, tolerances in _integrators(plan):
        if method in JUST_IN_TIME:
            tell(f"compiling {method}")
            workprec(Scene(1, "0.1", SCENES["ii"], UNTIL), repeats=1, **options)(tolerances)


def plane_rows(plan: Mapping[str, Any], tell: Callable[[str], None]) -> list[Row]:
    """Return rows of starts beside the unstable plane, with the deviation from it as a column ``offset``."""
    rows = []
    for offset in plan["offsets"]:
        scene = Scene.near("Pi2", x=0, offset=offset, z=1, sigma=1, mu="1e-4", until="0.1", name="near Pi2")
        for method, options, tolerances in [("exact", {"method": "exact"}, (None,)), *_integrators(plan)]:
            tell(f"{offset} from Pi2: {method}")
            found = workprec(scene, label=method, repeats=1, **options)(tolerances)
            rows += [{"offset": float(offset), **asdict(row)} for row in found]
    return rows


def nonlinear_rows(plan: Mapping[str, Any], references: Iterable[Row], tell: Callable[[str], None]) -> list[Row]:
    """Return rows for the rod whose geometry is kept, with the column ``kappa``; see ``systems.nonlinear_rod``."""
    rows = []
    for found in references:
        scene, truth = _truth(found)
        for method, options, tolerances in _models():
            made = workprec(scene, label=method, reference=truth, repeats=plan["repeats"], **options)(tolerances)
            rows += [{"kappa": found["kappa"], **asdict(row)} for row in made]
        if found["kappa"] != 1:
            continue
        for method, options, tolerances in _integrators(plan):
            tell(f"nonlinear rod, mu = {scene.mu}: {method}")
            made = workprec(
                scene, label=method, reference=truth, repeats=plan["repeats"],
                follow=lambda scene, method, **options: _nonlinear(1, scene, method, **options), **options,
            )(tolerances)  # fmt: skip
            rows += [{"kappa": found["kappa"], **asdict(row)} for row in made]
    return rows


def _nonlinear(kappa, scene, method, **options):
    return run(_kept(kappa, scene), method, **options)


def _kept(kappa, scene):
    """Return a scene of the rod as one of the rod whose geometry is kept."""
    n, square = nonlinear_rod, 1 / Fraction(1 + SLOPE**2)
    values = {n.mu: scene.mu, n.sigma: scene.sigma, n.sigma0: scene.sigma0, n.kappa: kappa, n.c2: square}
    return Scene(system=n.system(), values=values, start=scene.start, until=scene.until, name=scene.name)


def model_rows(plan: Mapping[str, Any], tell: Callable[[str], None]) -> list[modelwork.SavingRow]:
    """Return the rows of models beside integrators on a nonlinear mechanism and on a reaction."""
    return modelwork.rows(plan["model_mus"], [m for m in IMPLICIT if m in modelwork.METHODS and m not in absent()],
                          plan["model_tolerances"], plan["repeats"], tell)  # fmt: skip


def contact_rows(plan: Mapping[str, Any], tell: Callable[[str], None]) -> list[Any]:
    """Return the rows of integrators on the rod between two rough guides; see ``studies.contacts``."""
    rows, share = [], {**plan, "steps": plan["steps"] * contacts.UNTIL // UNTIL}  # as many steps a unit of time
    for method in [m for m, *_ in _integrators(share) if m in JUST_IN_TIME]:
        tell(f"compiling {method} for two contacts")
        solve(contacts.scene(plan["contact_mus"][0]), method, seconds=UNBOUNDED)
    for mu in plan["contact_mus"]:
        for method, options, tolerances in (*_integrators(share), *_one_field(share)):
            tell(f"two contacts, mu = {mu}: {method}")
            rows += contacts.measure(mu, tolerances=tolerances, repeats=1, **options)
    return rows


def nonlinear_references(plan: Mapping[str, Any], kept: Path, tell: Callable[[str], None]) -> list[Row]:
    """Return rows with the reference solutions of scene (ii), final state and events as decimals.

    Those of ``kept`` are used again: they do not depend on the plan, and take half a minute each.
    """
    known = kept / "rows" / "nonlinear-reference.csv"
    stored = {(row["kappa"], row["mu"]): row for row in read_rows(known)} if known.exists() else {}
    rows = []
    for kappa, mus in plan["kappas"].items():
        for mu in mus:
            tell(f"nonlinear rod, kappa = {kappa}, mu = {mu}: reference")
            rows.append(stored.get((float(kappa), mu)) or _reference_row(kappa, mu))
    return rows


def _reference_row(kappa, mu):
    from mpmath import nstr

    scene = Scene(1, mu, SCENES["ii"], UNTIL, name="ii")
    path = collocation.run(_kept(Fraction(kappa), scene), digits=30)
    spelled = {name: nstr(value, 32) for name, value in zip(("x", "y", "z"), path.final, strict=True)}
    events = " ".join(f"{event.kind}:{nstr(event.t, 32)}" for event in path.events)
    return {"kappa": float(kappa), "mu": mu, **spelled, "events": events, "modes": " ".join(path.modes),
            "error": float(path.error)}  # fmt: skip


def _truth(row):
    """Return (scene, reference path) of a stored row."""
    scene = Scene(1, row["mu"], SCENES["ii"], UNTIL, name="ii")
    marks = [word.split(":") for word in row["events"].split()]
    events = tuple(Event(kind, Fraction(t), ()) for kind, t in marks)
    final = tuple(Fraction(row[name]) for name in ("x", "y", "z"))
    return scene, Trajectory(scene, "collocation", final, events, tuple(row["modes"].split()), at=None)


def method_table(rows: Sequence[Row], accuracy: float = 1e-5) -> Table:
    """Count what became of every method's runs; the least cost of an error below ``accuracy``, over scenes and mu."""
    body = []
    for method in (*style.METHODS, *style.MODELS):
        mine = [row for row in rows if row["method"] == method]
        counts = [sum(figures.outcome(row["status"]) == key for row in mine) for key in figures.OUTCOMES]
        places = {(row["scene"], row["mu"]) for row in mine}
        costs = [cost for scene in {s for s, _ in places}
                 for cost in figures.cheapest([r for r in mine if r["scene"] == scene], accuracy).values() if cost]
        span = f"{_rounded(min(costs))} to {_rounded(max(costs))}" if costs else "--"
        if mine:
            name = style.curve(method)["label"]
            dressed = Cell(name.replace("z/ε", r"$z/\varepsilon$").replace("(z)", "($z$)"), name)
            body.append((dressed, *map(str, counts), f"{len(costs)} of {len(places)}", span))
    header = ("method", "right", "modes missed", "wrong end", "stalled", "budget spent", "refused",
              f"error below ${figures.power_of_ten(accuracy)}$", "CPU time / exact flow")
    return Table("methods", "lrrrrrrrl", header, tuple(body))


def _rounded(ratio):
    return f"{ratio:.1f}" if ratio < 10 else f"{float(f'{ratio:.2g}'):.0f}"


def draw_chart(out: Path, tell: Callable[[str], None] = lambda line: None) -> list[Path]:
    """Draw all figures and the table from the rows under ``out``/rows, and return their files."""
    out, tables = Path(out), []
    tell("drawing")
    if (out / "rows" / "work.csv").exists():
        table = method_table(read_rows(out / "rows" / "work.csv"))
        tables = write_table(table, out / "tables")
    drawn = chart_figures(out).items()
    return [figures.save(figure, out / "figures" / f"{name}.pdf") for name, figure in drawn] + tables


def chart_figures(out: Path) -> "dict[str, Figure]":
    """Return the figures that the rows under ``out``/rows give, by name."""
    found: dict[str, Figure] = {}
    if (out / "rows" / "work.csv").exists():
        found |= _drawn_work(out / "rows" / "work.csv")
    if (out / "rows" / "plane.csv").exists():
        parts = _failure_parts(out / "rows")
        found |= {"failures": figures.failures(parts)} if parts else {}
    if (out / "rows" / "nonlinear.csv").exists():
        rows = read_rows(out / "rows" / "nonlinear.csv")
        found["nonlinear"] = figures.nonlinear(rows)
        kept = [row for row in rows if row["kappa"] == 1]
        found["nonlinear-work"] = figures.work_precision(kept, SHOWN, _two(sorted({row["mu"] for row in kept})))
    if (out / "rows" / "models.csv").exists() and (saved := modelwork.savings(read_rows(out / "rows" / "models.csv"))):
        found["models"] = figures.savings(saved)
    return {f"chart-{name}": figure for name, figure in found.items()}


def _two(mus):
    """Return a moderate value of mu and the least."""
    return [mus[-1 - len(mus) // 3], mus[0]]


def _drawn_work(path):
    rows, note = read_rows(path), _note(path)
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    mus = sorted({row["mu"] for row in rows}, reverse=True)
    panels = mus if len(mus) < 5 else [mus[k] for k in (0, 2, 4, -1)]
    drawn = {f"workprec-{s}": figures.work_precision(rows, s, panels) for s in scenes}
    here = [row for row in rows if row["scene"] == SHOWN]
    drawn |= {"few": figures.few_costs(here, FEW, 1e-5)} if {row["method"] for row in here} >= {*FEW} else {}
    drawn |= {f"cost-{s}": figures.cost_against_mu(rows, [s], 1e-5, note) for s in scenes if s == SHOWN}
    return drawn | {"cost": figures.cost_against_mu(rows, scenes, 1e-5, note)}


def _failure_parts(folder):
    """Return what the map of failures is made of: the scene with the most of them over mu, starts beside Pi_2."""
    parts = [(r"deviation from $\Pi_2$", read_rows(folder / "plane.csv"), "offset")]
    if (folder / "work.csv").exists():
        rows = [row for row in read_rows(folder / "work.csv") if row["scene"] == FAILING]
        parts.insert(0, (r"scene (iii), $\mu$", rows, "mu"))
    if (folder / "contacts.csv").exists():
        parts.append(("two\ncontacts, $\\mu$", read_rows(folder / "contacts.csv"), "mu"))
    found = [(words, [row for row in rows if row["method"] != "exact"], along) for words, rows, along in parts]
    return [part for part in found if part[1]]


def _note(path):
    """Return the options of all peers in words, as the figure prints them."""
    plan = read_provenance(path)["plan"]
    steps = plan["step_sizes"]
    return (CAREFUL + CARELESS).format(**plan, compiled=COMPILED, longest=max(steps), shortest=min(steps))
