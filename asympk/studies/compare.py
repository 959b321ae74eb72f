r"""Comparison of methods on one scene: errors that remain meaningful across a jump, and costs.

A jump that is late by a small part of mu has a large error in every norm that compares states at equal times, since
y' is of the order 1/mu^2 during a jump. Hence four separate measures against the exact flow at many digits:

    final_error   |x - x*|, |y - y*|, |z - z*| at the end, the largest, relative to max(1, |x*|, |z*|)
    time_error    |t - t*| / mu of the events, the largest, when their kinds are the same
    same_modes    whether the sequence of modes is the same
    path_error    as final_error, over equidistant times outside windows of 4 mu log(1/mu) around start and events
"""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from math import log
from statistics import median
from time import process_time
from typing import Any

from asympk.errors import AsympkError, Unfinished
from asympk.methods import solve
from asympk.path import Path
from asympk.storage.rows import Row

GRID = 64
WRONG = 0.1  # a larger final error means another motion, not an inaccurate one
PATIENCE = 0.3  # CPU seconds; a longer run is repeated at most once
ONE_FIELD = ("one_field",)
MEASURED = ("final_error", "time_error", "path_error", "same_modes", "calls", "steps", "jacobians", "ratio", "status")


def workprec(
    scene: Any, method: str, tolerances: Iterable[float | None], *, reference: Path | None = None, repeats: int = 5,
    label: str | None = None, follow: Callable[..., Path] = solve, **options: Any,
) -> list[Row]:
    """Return rows, one for each tolerance: work against precision of ``method`` on ``scene``.

    A row is of one run; a column of ``MEASURED`` that does not apply is None. ``ratio`` is the CPU time in units of
    that of the exact flow in doubles, measured in the same run. ``status`` is "finished", "events missed" (the modes
    differ, the end is right), "wrong branch" (the end is wrong), or the message of the run or of the model.

    A tolerance is passed to the method as ``rtol``, which is also its default atol; None passes none, for models
    without a tolerance. ``reference`` is the exact path, by default the scene's at 30 digits. ``label`` is the method's
    name in the rows. ``follow(scene, method, **options)`` returns the path; the unit of cost stays the exact flow.
    """
    truth = reference or solve(scene, digits=30)
    place = {"sigma": scene.sigma, "sigma0": scene.sigma0, "mu": scene.mu, **dict(zip("xyz", scene.start, strict=True)),
             "until": scene.until}
    words = " ".join(f"{k}={v}" for k, v in options.items()) or None
    rows: list[Row] = []
    for rtol in tolerances:
        rows.append({"scene": scene.name, **{name: float(value) for name, value in place.items()},
                     "method": label or method, "options": words, "rtol": rtol, **dict.fromkeys(MEASURED)})
        run = partial(_followed, follow, scene, method, options if rtol is None else {**options, "rtol": rtol})
        try:
            path, ratio = timed(run, partial(solve, scene), repeats)
        except AsympkError as error:
            rows[-1]["status"] = f"{type(error).__name__}: {error}"
            continue
        errors = errors_of(path, truth, scene)
        work = {k: v or None for k, v in path.info.get("work", {}).items()}
        rows[-1] |= {**errors, **work, "ratio": ratio, "status": status_of(path, errors)}
    return rows


def _followed(follow, scene, method, options):
    """Return the path of a run, or the part of the path up to the stop of an unfinished run."""
    try:
        return follow(scene, method, **options)
    except Unfinished as stop:
        return stop.path


def errors_of(path: Path, truth: Path, scene: Any) -> dict[str, Any]:
    """Return the four measures of ``path`` against the exact path ``truth``, or {} for a run that did not finish."""
    if path.info.get("status", "finished") != "finished":
        return {}
    kinds = [e.kind for e in path.events] == [e.kind for e in truth.events]
    times = [abs(float(a.t - b.t)) / float(scene.mu) for a, b in zip(path.events, truth.events, strict=False)]
    return {
        "final_error": _distance(path.final, truth.final),
        "time_error": max(times) if kinds and times else None,
        "path_error": path_distance(path, truth, scene),
        "same_modes": None if path.modes == ONE_FIELD else path.modes == truth.modes,
    }


def path_distance(path: Path, truth: Path, scene: Any) -> float | None:
    """Return the largest distance of two paths over equidistant times outside the windows around jumps, or None."""
    times = quiet_times(truth, float(scene.mu), float(scene.until))
    if not times or path.at is None or truth.at is None:
        return None
    states = path(times).T if path.info else map(path, times)  # an integrator runs again for every call
    return max(_distance(state, truth(t)) for state, t in zip(states, times, strict=True))


def quiet_times(truth: Path, mu: float, until: float) -> list[float]:
    """Return the equidistant times in (0, until) outside windows of 4 mu log(1/mu) around the start and the events."""
    width = 4 * mu * max(1.0, log(1 / mu))
    centres = [0.0, *(float(e.t) for e in truth.events)]
    grid = [until * k / GRID for k in range(1, GRID)]
    return [t for t in grid if all(abs(t - c) > width for c in centres)]


def _distance(state, truth):
    x, y, z = (float(v) for v in truth)
    scale = max(1.0, abs(x), abs(z))
    return max(abs(float(a) - b) for a, b in zip(state, (x, y, z), strict=True)) / scale


def status_of(path: Path, errors: Mapping[str, Any]) -> str:
    """Return the status of a run, judged by its errors if the run finished."""
    status = path.info.get("status", "finished")
    if status != "finished" or errors["final_error"] < WRONG:
        return "events missed" if errors.get("same_modes") is False else status
    return "wrong branch"


def timed(run: Callable[[], Path], unit: Callable[[], Any], repeats: int) -> tuple[Path, float]:
    """Return (result of ``run``, its CPU time in units of that of ``unit``): medians of interleaved runs.

    The first run does not count, as it may compile, unless it takes longer than ``PATIENCE``. A long run is repeated
    only once, the shorter of both times counts, and a long run that did not finish is not repeated.
    """
    first, result = _clocked(run)
    unit()
    if first > PATIENCE:
        again = min(first, _clocked(run)[0]) if result.info.get("status", "finished") == "finished" else first
        return result, again / median(_clocked(unit, 20)[0] for _ in range(5))
    pairs = [(_clocked(run)[0], _clocked(unit, 20)[0]) for _ in range(repeats)]
    return result, median(a for a, _ in pairs) / median(b for _, b in pairs)


def _clocked(run, times=1):
    start = process_time()
    for _ in range(times):
        result = run()
    return (process_time() - start) / times, result
