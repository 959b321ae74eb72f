"""The chart of methods: the cost and the errors of each method, as rows.

``write`` computes the rows: those of the paper by the plan ``FULL``, or fewer, in less time, by the plan ``QUICK``.
"""

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

from asympk.errors import MissingPackage
from asympk.integrators import collocation
from asympk.integrators.integrate import absent, run
from asympk.integrators.stepped import UNBOUNDED
from asympk.methods import solve
from asympk.path import Event
from asympk.path import Path as Trajectory
from asympk.scene import Scene
from asympk.storage.rows import Row, provenance, read_rows, write_rows
from asympk.studies import ladder, modelwork, twoguides
from asympk.studies.compare import workprec
from asympk.systems import nonlinear_rod

SCENES = {"i": (0, 0, 1), "ii": (0, "0.2", -1), "iii": (-1, -1, 1)}
UNTIL = 5
EXPLICIT, IMPLICIT = ("rk45", "dop853", "heyoka"), ("kvaerno5", "radau", "bdf", "lsoda", "cvode")
CRUDE = ("sign", "tanh")
MUS = tuple(f"1e-{k}" for k in range(1, 9))
KAPPAS = {"0.1": MUS[1::2], "1": MUS, "10": MUS[1::2]}  # kappa -> its values of mu
FULL = {
    "scenes": tuple(SCENES), "mus": MUS, "kappas": KAPPAS, "tolerances": (1e-3, 1e-5, 1e-7, 1e-9, 1e-11),
    "step_sizes": (1e-2, 1e-3, 1e-4), "offsets": tuple(f"{s}1e-{k}" for s in ("-", "") for k in range(2, 15, 2)),
    "model_mus": modelwork.MUS, "model_tolerances": modelwork.TOLERANCES, "contact_mus": MUS[1::2],
    "repeats": 5, "steps": 100_000, "seconds": 120.0,
}
QUICK = {
    "scenes": ("ii", "iii"), "mus": ("1e-2", "1e-5"), "kappas": {"1": ("1e-2", "1e-5")}, "tolerances": (1e-3, 1e-7),
    "step_sizes": (1e-2, 1e-3), "offsets": ("-1e-10", "-1e-4", "1e-4", "1e-10"),
    "model_mus": ("1e-2", "1e-4"), "model_tolerances": (1e-5, 1e-8, 1e-11), "contact_mus": (),
    "repeats": 1, "steps": 2_000, "seconds": 10.0,
}
JUST_IN_TIME = ("heyoka", "kvaerno5")  # these compile a system when they first follow it
COMPILED = 100  # factor on the step limit of heyoka, whose compiled steps are cheap
SLOPE = 3  # tan(alpha) of the nonlinear rod; f = 1 makes sigma = 1
PARTS = ("work", "plane", "nonlinear", "models", "contacts")


def write(out: Path, kept: Path, quick: bool, tell: Callable[[str], None]) -> list[Path]:
    """Compute the rows of all ``PARTS`` into ``out``/rows; return the files written.

    ``quick`` computes fewer rows, for the peers that are installed. Reference solutions stored in ``kept`` are used
    again. ``tell`` is called with one line for each step. Raises ``MissingPackage`` if the full run lacks a peer.
    """
    lacking = absent()
    if lacking and not quick:
        packages = " ".join(f"'{package}'" for package in lacking.values())
        raise MissingPackage(f"the full chart runs {', '.join(lacking)} too: pip install {packages}")
    plan: Mapping[str, Any] = QUICK if quick else FULL
    about, files = provenance(plan=plan, quick=quick, digits=30, seed=None), list[Path]()

    def store(name: str, rows: Iterable[Any], reference: str = "exact flow") -> None:
        files.append(out / "rows" / f"{name}.csv")
        write_rows(files[-1], rows, about | {"reference": reference})

    for method, options in _integrators(plan):
        if method in JUST_IN_TIME:  # so that no measured time includes compilation
            tell(f"compiling {method}")
            workprec(Scene(1, "0.1", SCENES["ii"], UNTIL), repeats=1, **options)
    store("work", work_rows(plan, tell))
    store("plane", plane_rows(plan, tell))
    found = nonlinear_references(plan, kept, tell)
    store("nonlinear-reference", found, "collocation")
    store("nonlinear", nonlinear_rows(plan, found, tell), "collocation")
    followers = [m for m in IMPLICIT if m in modelwork.METHODS and m not in lacking]
    found = modelwork.rows(plan["model_mus"], followers, plan["model_tolerances"], plan["repeats"], tell)
    store("models", found, "Radau 1e-13")
    if plan["contact_mus"]:
        store("contacts", contact_rows(plan, tell))
    return files


def work_rows(plan: Mapping[str, Any], tell: Callable[[str], None]) -> list[Row]:
    """Return the rows of every method on every scene and mu of ``plan``."""
    rows: list[Row] = []
    moreau = {"method": "moreau", "tolerances": plan["step_sizes"], "seconds": plan["seconds"]}
    for name in plan["scenes"]:
        for mu in plan["mus"]:
            scene = Scene(1, mu, SCENES[name], UNTIL, name=name)
            for method, options in [*_models(), *_integrators(plan), *_one_field(plan), ("moreau", moreau)]:
                tell(f"scene ({name}), mu = {mu}: {method}")
                rows += workprec(scene, label=method, repeats=plan["repeats"], **options)
    return rows


def _models():
    """Return (name, options of ``workprec``) of the exact flow and the models, which have no tolerance."""
    models = {"exact": ("exact", {}), **ladder.ROD, **ladder.JUMPS}
    return [(name.replace("-", " "), {"method": method, **options, "tolerances": (None,)})
            for name, (method, options) in models.items()]


def _integrators(plan):
    lacking = absent()
    for method in (m for m in (*EXPLICIT, *IMPLICIT) if m not in lacking):
        yield _bounded(method, plan["steps"] * (COMPILED if method == "heyoka" else 1), plan)


def _one_field(plan):
    return [_bounded(method, min(plan["steps"], 20_000), plan) for method in CRUDE]


def _bounded(method, steps, plan):
    seconds, tolerances = plan["seconds"], plan["tolerances"]
    return method, {"method": method, "steps": steps, "seconds": seconds, "tolerances": tolerances}


def plane_rows(plan: Mapping[str, Any], tell: Callable[[str], None]) -> list[Row]:
    """Return rows of starts beside the unstable plane, with the deviation from it as a column ``offset``."""
    rows = []
    for offset in plan["offsets"]:
        scene = Scene.near("Pi2", x=0, offset=offset, z=1, sigma=1, mu="1e-4", until="0.1", name="near Pi2")
        for method, options in [_models()[0], *_integrators(plan)]:
            tell(f"{offset} from Pi2: {method}")
            found = workprec(scene, label=method, repeats=1, **options)
            rows += [{"offset": float(offset), **row} for row in found]
    return rows


def nonlinear_rows(plan: Mapping[str, Any], references: Iterable[Row], tell: Callable[[str], None]) -> list[Row]:
    """Return rows for the rod with exact geometry, with a column ``kappa``; see ``systems.nonlinear_rod``."""
    rows = []
    for found in references:
        scene, truth = _scene_and_truth(found)
        measure = partial(workprec, scene, reference=truth, repeats=plan["repeats"])
        made = [row for method, options in _models() for row in measure(label=method, **options)]
        for method, options in _integrators(plan) if found["kappa"] == 1 else ():
            tell(f"nonlinear rod, mu = {scene.mu}: {method}")
            made += measure(follow=_with_geometry, **options)
        rows += [{"kappa": found["kappa"], **row} for row in made]
    return rows


def _with_geometry(scene, method, **options):
    return run(_with_exact_geometry(1, scene), method, **options)


def _with_exact_geometry(kappa, scene):
    n, square = nonlinear_rod, 1 / Fraction(1 + SLOPE**2)
    values = {n.mu: scene.mu, n.sigma: scene.sigma, n.sigma0: scene.sigma0, n.kappa: kappa, n.c2: square}
    return Scene(system=n.system(), values=values, start=scene.start, until=scene.until, name=scene.name)


def contact_rows(plan: Mapping[str, Any], tell: Callable[[str], None]) -> list[Row]:
    """Return the rows of integrators on the rod between two rough guides; see ``studies.twoguides``."""
    rows, share = [], {**plan, "steps": plan["steps"] * twoguides.UNTIL // UNTIL}  # the same limit per unit of time
    for method in [m for m, _ in _integrators(share) if m in JUST_IN_TIME]:
        tell(f"compiling {method} for two contacts")
        solve(twoguides.scene(plan["contact_mus"][0]), method, seconds=UNBOUNDED)
    for mu in plan["contact_mus"]:
        for method, options in (*_integrators(share), *_one_field(share)):
            tell(f"two contacts, mu = {mu}: {method}")
            rows += twoguides.measure(mu, repeats=1, **options)
    return rows


def nonlinear_references(plan: Mapping[str, Any], kept: Path, tell: Callable[[str], None]) -> list[Row]:
    """Return rows with the reference solutions of scene (ii): final states and events, as decimals.

    Solutions stored in ``kept`` are used again: they do not depend on the plan, and each takes half a minute.
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
    path = collocation.run(_with_exact_geometry(Fraction(kappa), scene), digits=30)
    spelled = {name: nstr(value, 32) for name, value in zip(("x", "y", "z"), path.final, strict=True)}
    events = " ".join(f"{event.kind}:{nstr(event.t, 32)}" for event in path.events)
    return {"kappa": float(kappa), "mu": mu, **spelled, "events": events, "modes": " ".join(path.modes),
            "error": float(path.error)}


def _scene_and_truth(row):
    scene = Scene(1, row["mu"], SCENES["ii"], UNTIL, name="ii")
    marks = [word.split(":") for word in row["events"].split()]
    events = tuple(Event(kind, Fraction(t), ()) for kind, t in marks)
    final = tuple(Fraction(row[name]) for name in ("x", "y", "z"))
    return scene, Trajectory(scene, "collocation", final, events, tuple(row["modes"].split()), at=None)
