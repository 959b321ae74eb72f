r"""The ladder of models for the scene of any slow-fast system: slow, jump of orders 0, 1, 2, exact.

``rungs`` predicts, measures and times every model of the ladder; ``predicted`` is the rule of the predictions. A model
of a smooth system predicts its error from the terms that it omits, and so does a model of order 1 or 2 with friction.
The predicted error of the limit with friction is its distance from the jump of order 1 plus the predicted error of this
jump. The model ``"rigid"`` is the limit without a layer; for an elastic contact it is the rigid mechanism.

An exact motion has the error that its path gives. Where its rates have no derivative, the path gives none, and two runs
estimate it: it is the larger of the change that a tolerance a hundred times as large makes, and twice the change that
one a hundred times as small makes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from time import monotonic
from typing import Any

import numpy as np

from asympk.affine.run import scene_obstacle
from asympk.errors import AsympkError, OutOfRange, Undecided, Unfinished
from asympk.integrators.stepped import UNBOUNDED
from asympk.many import require_mappings
from asympk.methods import solve
from asympk.numbers import common_shape, raw_entries
from asympk.scene import Scene
from asympk.studies.bench import median_seconds

JUMPS = {f"jump-{n}": ("jump", {"order": n}) for n in range(3)}
SMOOTH = {"slow": ("slow", {"order": 1}), **JUMPS}
FRICTION = {"rigid": ("slow", {"order": 0}), **SMOOTH}
ROD = {"rigid": ("rigid", {}), **{name: SMOOTH[name] for name in ("slow", "jump-0", "jump-1")}}
CHECKS = ((1e-8, 1), (1e-12, 2))  # tolerances beside the exact motion's, and factors on the changes they make
REFERENCE_DIGITS, OF_ROD = 16, 30
DOUBLES = 2e-15  # error of the exact flow in doubles, relative to the largest of 1 and the states on the path
_REPEATS, _SPAN = 5, 1.0  # runs whose median time is a cost; none begins after so many seconds


@dataclass(frozen=True)
class Rung:
    """One model on the ladder; errors at ``until`` are relative to the largest of 1 and the states (the rod's x and z).

    ``cost`` is the time of the model over that of the exact flow, measured in the same run. Where the model does not
    apply, was not tried or not measured, ``reason`` says why, and the numbers that are missing are None.
    """

    model: str
    predicted: float | None
    measured: float | None = None
    cost: float | None = None
    reason: str = ""

    @property
    def in_words(self) -> str:
        """The rung in words: its errors and its cost, or why it does not apply."""
        if self.predicted is None:
            return self.reason
        numbers = {"predicted": self.predicted, "measured": self.measured}
        words = [f"{name} {value:.1e}" for name, value in numbers.items() if value is not None]
        words += [f"cost {self.cost:.2g}"] if self.cost else []
        return ", ".join([*words, self.reason] if self.reason else words)


def models_below(system: Any) -> dict[str, tuple[str, dict]]:
    """Return the models below the exact one, lowest first: name -> (method, options); None stands for the rod."""
    if system is None:
        return ROD
    if system.small is None:
        return {}
    return FRICTION if system.frictions else SMOOTH


def rungs(scene: Scene, allowed: float = UNBOUNDED) -> tuple[Rung, ...]:
    """Return the rungs of a scene's ladder, lowest first, with predictions, measured errors and costs.

    After ``allowed`` seconds no further rung is tried, and errors are measured only if the reference is complete by
    then: the exact motion to ``OF_ROD`` digits for the rod, else to ``REFERENCE_DIGITS`` digits, by collocation if it
    is not affine. Where the exact motion is ``Undecided`` in doubles, its rung says so, and there are no costs. Raises
    the other errors of ``solve`` where the exact motion itself cannot be followed.
    """
    end, follow, exact, why = monotonic() + allowed, cache(partial(solve, scene)), None, ""
    try:
        exact = follow()
    except Undecided as reason:
        why = f"Undecided: {reason}"
    found = [_rung(follow, name, *of, monotonic() > end) for name, of in models_below(scene.system).items()]
    found.append((Rung("exact", None, reason=why), None) if exact is None else
                 (Rung("exact", _exact_error(scene, exact), cost=seconds(scene, "exact", {})), exact.final))
    reference, missing = _reference(scene, end)
    unit = found[-1][0].cost
    compared = slice(None) if scene.system else slice(None, None, 2)
    found = [(replace(rung, cost=rung.cost and unit and rung.cost / unit), final) for rung, final in found]

    def measured(rung: Rung, final: Any) -> Rung:
        if final is None:
            return rung
        if reference is None:
            return replace(rung, reason=f"not measured: {missing}")
        return replace(rung, measured=distance(final[compared], reference[compared]))

    return tuple(measured(*pair) for pair in found)


def _reference(scene, end):
    """Return the final state of the exact motion in many digits, or None, and why it is missing."""
    closed = scene.system is None or scene_obstacle(scene) is None
    left = {} if closed else {"seconds": max(0.0, end - monotonic())}
    try:
        return solve(scene, digits=OF_ROD if scene.system is None else REFERENCE_DIGITS, **left).final, ""
    except Unfinished:
        return None, "no reference within the time"
    except (OutOfRange, Undecided) as reason:
        return None, f"{type(reason).__name__}: {reason}"


def least_places(
    system: Any, values: Mapping, start: Mapping, until: Any, rtol: float, progress: Callable[[float], None] | None
) -> np.ndarray:
    """Return the index of the least model on the ladder, for values, starts and horizons that broadcast."""
    require_mappings(values=values, start=start)
    named = [*values.items(), *start.items(), ("until", until)]
    columns = [raw_entries(str(name), column) for name, column in named]
    shape = common_shape((name for name, _ in named), columns)
    flat = [np.broadcast_to(column, shape).ravel().tolist() for column in columns]
    found = np.empty(int(np.prod(shape)), dtype=np.int8)
    for i, (*numbers, end) in enumerate(zip(*flat, strict=True)):
        if progress:
            progress(i / found.size)
        first = len(values)
        scene = Scene(system=system, values=dict(zip(values, numbers[:first], strict=True)),
                      start=dict(zip(start, numbers[first:], strict=True)), until=end)
        found[i] = _least(scene, rtol)
    return found.reshape(shape)


def _least(scene, rtol):
    models, follow = models_below(scene.system), cache(partial(solve, scene))
    for i, (method, options) in enumerate(models.values()):
        try:
            if predicted(follow(method, **options), follow) < rtol:
                return i
        except AsympkError:
            continue
    return len(models)


def _rung(follow, name, method, options, late):
    """Return (rung, final state of its model, or None where the model does not apply)."""
    if late:
        return Rung(name, None, reason="not tried: the time was over"), None
    try:
        path = follow(method, **options)
        error = predicted(path, follow)
    except AsympkError as reason:
        return Rung(name, None, reason=f"{type(reason).__name__}: {reason}"), None
    return Rung(name, float(error), cost=seconds(path.scene, method, options)), path.final


def predicted(path: Any, follow: Callable[..., Any]) -> float:
    """Return the error that a path predicts; for the limit with friction, an estimate from the jump of order 1.

    ``follow(method, **options)`` is the path of the same scene by another model.
    """
    if path.error is not None:
        return path.error
    finer = follow("jump", order=1)
    return distance(path.final, finer.final) * (1 + finer.error) + finer.error


def _exact_error(scene, exact):
    if scene.system is None:
        return DOUBLES
    if exact.error is None:
        others = ((solve(scene, "lsoda", rtol=tol, atol=tol).final, times) for tol, times in CHECKS)
        return max(DOUBLES, *(times * distance(exact.final, other) for other, times in others))
    return max(DOUBLES, float(exact.error))


def distance(final: tuple, reference: tuple) -> float:
    """Return the largest error of ``final``, relative to the largest of 1 and the states of ``reference``."""
    off = max(abs(float(a - b)) for a, b in zip(final, reference, strict=True))
    return off / max(1.0, *(abs(float(b)) for b in reference))


def seconds(scene: Scene, method: str, options: dict) -> float:
    """Return the median time of a few runs, of one that takes long."""
    return median_seconds(lambda: solve(scene, method, **options), 1, _SPAN, _REPEATS)
