r"""The ladder of models for the scene of any slow-fast system: slow, jump of orders 0, 1, 2, exact.

A smooth system's models predict their errors from the terms that they omit. With friction the error of the limit is
C mu log(1/mu); C is measured on the same scene at 4 mu and 2 mu, where the exact motion is followed beside the model.
Where the two constants do not agree the order is not seen, and no prediction is made. The error of an exact motion that
is integrated is bounded by what a tolerance a hundred times as large changes.
"""

import math
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from asympk.errors import AsympkError, OutOfRange
from asympk.methods import solve
from asympk.scene import Scene

SMOOTH = {"slow": ("slow", {"order": 1}), **{f"jump-{n}": ("jump", {"order": n}) for n in range(3)}}
FRICTION = {"slow": ("slow", {}), "jump-0": ("jump", {})}
CRUDER = {"method": "lsoda", "rtol": 1e-8, "atol": 1e-8}
REFERENCE_DIGITS = 16
SAFETY = 1.5  # the constant that is taken, over the larger of the two measured
AGREEMENT = 2  # between the two constants
_REPEATS = 5


@dataclass(frozen=True)
class Rung:
    """One model on the ladder; errors at ``until`` are relative to the largest of 1 and the states (the rod's x and z).

    ``cost`` is its time as a multiple of the exact flow's in the same run. Where the model does not apply,
    ``reason`` says why and the numbers are None.
    """

    model: str
    predicted: float | None
    measured: float | None = None
    cost: float | None = None
    reason: str = ""

    @property
    def told(self) -> str:
        """The rung in words: its errors and its cost, or why it does not apply."""
        if self.predicted is None:
            return self.reason
        numbers = {"predicted": self.predicted, "measured": self.measured}
        words = [f"{name} {value:.1e}" for name, value in numbers.items() if value is not None]
        return ", ".join([*words, f"cost {self.cost:.2g}"] if self.cost else words)


def rungs(scene: Scene) -> tuple[Rung, ...]:
    """Return the rungs of a scene's ladder, lowest first, with predictions, measured errors and costs.

    Raises what ``solve`` raises where the exact motion itself cannot be followed.
    """
    exact = solve(scene)
    reference = solve(scene, digits=REFERENCE_DIGITS).final
    models = FRICTION if scene.system.frictions else SMOOTH
    found = [_rung(scene, name, *of, reference) for name, of in models.items() if scene.system.small is not None]
    unit = seconds(scene, "exact", {})
    last = Rung("exact", _exact_error(scene, exact), _distance(exact.final, reference), 1.0)
    return (*(replace(r, cost=r.cost and r.cost / unit) for r in found), last)


def _rung(scene, name, method, options, reference):
    try:
        path = solve(scene, method, **options)
        predicted = path.error if path.error is not None else calibrated_error(scene, method, options)
    except AsympkError as error:
        return Rung(name, None, reason=f"{type(error).__name__}: {error}")
    return Rung(name, float(predicted), _distance(path.final, reference), seconds(scene, method, options))


def calibrated_error(scene: Scene, method: str, options: dict) -> float:
    """Return C mu log(1/mu) with the constant C measured at 4 mu and 2 mu; raises ``OutOfRange`` where they differ."""
    k = scene.system.parameters.index(scene.system.small)
    mu = float(scene.values[k])
    if 4 * mu >= 1 / math.e:
        raise OutOfRange(f"{scene.system.small} = {mu:.3g} is too large to measure the error at four times as much")
    constants = []
    for factor in (4, 2):
        values = (*scene.values[:k], factor * mu, *scene.values[k + 1 :])
        other = replace(scene, values=values)
        off = _distance(solve(other, method, **options).final, solve(other).final)
        constants.append(off / _size(factor * mu))
    if max(constants) > AGREEMENT * min(constants):
        raise OutOfRange(f"the errors at 4 and 2 times {scene.system.small} = {mu:.3g} are {constants[0]:.3g} and "
                         f"{constants[1]:.3g} times their order; they do not show it yet")  # fmt: skip
    return SAFETY * max(constants) * _size(mu)


def _size(mu):
    return mu * math.log(1 / mu)


def _exact_error(scene, exact):
    return max(2e-15, _distance(exact.final, solve(scene, **CRUDER).final))


def _distance(final, reference):
    final, reference = (np.array([float(v) for v in states]) for states in (final, reference))
    return float(np.abs(final - reference).max() / max(1.0, np.abs(reference).max()))


def seconds(scene: Scene, method: str, options: dict) -> float:
    """Return the median time of a few runs, after one to warm up."""
    times = []
    for _ in range(_REPEATS + 1):
        began = perf_counter()
        solve(scene, method, **options)
        times.append(perf_counter() - began)
    return sorted(times[1:])[_REPEATS // 2]
