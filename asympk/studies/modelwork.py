"""The time that a model saves over integrators of the same accuracy, on a nonlinear mechanism and a reaction.

The unit of cost is the jump of order 1 on the same scene. Runs of the two are timed in turns, after a first run of the
system, so that derivation and compilation do not count. An integrator follows one mode at a time; its tolerance is
refined until its error is at most that of the jump of order 1. The reference is Radau with the settings ``FINEST``.
"""

from collections.abc import Callable, Iterable
from functools import partial
from itertools import product

from asympk.errors import AsympkError
from asympk.methods import solve
from asympk.storage.rows import Row
from asympk.studies.compare import timed
from asympk.studies.decreasing import five_systems
from asympk.studies.ladder import distance

SYSTEMS = ("nonlinear rod", "enzyme reaction")
MUS = ("1e-2", "1e-3", "1e-4", "1e-5")
TOLERANCES = tuple(10.0**-k for k in range(4, 13))
METHODS = ("lsoda", "cvode", "radau", "bdf")
JUMPS = (0, 1, 2)
FINEST = {"rtol": 1e-13, "atol": 1e-13, "steps": 10**6, "seconds": 600.0}


def rows(
    mus: Iterable[str] = MUS, methods: Iterable[str] = METHODS, tolerances: Iterable[float] = TOLERANCES,
    repeats: int = 5, tell: Callable[[str], None] = lambda line: None,
) -> list[Row]:
    """Return the rows by system, mu and method; the tolerances of an integrator end with the first that suffices.

    A row has the final error of a run, and ``ratio``, its CPU time over that of the jump of order 1. Both are None for
    a run that failed, and ``status`` says why. ``rtol`` is None for the jumps.
    """
    found: list[Row] = []
    for system, mu in product(SYSTEMS, mus):
        tell(f"{system}, mu = {mu}: models beside integrators")
        scene = five_systems()[system].scene(mu)
        measured = partial(_row, system, scene, solve(scene, "radau", **FINEST).final, repeats)
        found += [measured(f"jump {n}", "jump", {"order": n}) for n in JUMPS]
        (enough,) = (row["final_error"] for row in found[-len(JUMPS) :] if row["method"] == "jump 1")
        for method in methods:
            for tolerance in tolerances:
                found.append(measured(method, method, {"rtol": tolerance}))
                error = found[-1]["final_error"]
                if error is not None and error <= (enough or 0):
                    break
    return found


def _row(system, scene, truth, repeats, name, method, options):
    mu = float(scene.values[scene.system.parameters.index(scene.system.small)])
    row = {"system": system, "mu": mu, "method": name, "rtol": options.get("rtol")}
    run, unit = partial(solve, scene, method, **options), partial(solve, scene, "jump", order=1)
    try:
        run()  # derives and compiles
        path, ratio = timed(run, unit, repeats)
    except AsympkError as reason:
        return {**row, "final_error": None, "ratio": None, "status": f"{type(reason).__name__}: {reason}"}
    return {**row, "final_error": distance(path.final, truth), "ratio": ratio, "status": "finished"}


def savings(rows: list[dict]) -> dict[tuple[str, float], dict[str, float | None]]:
    """Return {(system, mu): {integrator: its least ratio with at most the error of the jump of order 1, or None}}."""
    found: dict = {}
    for row in rows:
        mine = [r for r in rows if (r["system"], r["mu"]) == (row["system"], row["mu"])]
        (enough,) = (r["final_error"] for r in mine if r["method"] == "jump 1")
        if row["method"].startswith("jump") or enough is None:
            continue
        costs = [r["ratio"] for r in mine if r["method"] == row["method"] and r["ratio"] and r["final_error"] <= enough]
        found.setdefault((row["system"], row["mu"]), {})[row["method"]] = min(costs, default=None)
    return found
