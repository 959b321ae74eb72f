r"""The asymptotic models of a smooth slow-fast system: slow motion from the base point, and its layer composed with it.

``"slow"`` of order n is the motion on the slow manifold to order n from the base point to order n; it holds after the
layer. ``"jump"`` is the uniform composite: layer + slow - common part,

    x = S(t) + sum mu^k (X_k - S_k)(t/mu),    y = h(S(t)) + sum mu^k (Y_k - H_k)(t/mu),    error O(mu^(n+1)).

The error that a path carries is what the next order changes at ``until``, and what the one after that may still add.
Where the terms do not fall, they may be small at ``until`` by chance. By how much a composite misses the start is known
exactly, and tells so.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from asympk.asymptotics import matched, reduced
from asympk.asymptotics.fibre import Formulas
from asympk.asymptotics.landing import Landing, land
from asympk.asymptotics.reduced import Reduced
from asympk.automaton.automaton import Automaton
from asympk.errors import OutOfRange
from asympk.path import Path, times_within

EXTRA = 2  # the orders beyond the one asked for, which tell its error
STEADY, STALLED = 0.1, 0.5  # between them the ratio of omitted terms tells how the series goes on
FINEST, COARSEST = 1e-13, 1e-7
FINER = 1e-5  # how much finer than mu^(n + 1) the integrations are
WATCHED = 1e-9  # the tolerance of the motion that tells whether the sides of a system are left
ROUNDING = 50  # what the integrations lose, in units of their tolerance


@dataclass(frozen=True)
class LayeredMotion:
    """The slow motion and its layer to the orders n, n + 1, n + 2, of the states ``kept``."""

    landing: Landing
    reduced: Reduced
    rtol: float
    kept: tuple[int, ...]

    def states(self, t: Any) -> np.ndarray:
        """Return the states on the slow manifold at the array ``t``, for every order: (orders, states) + t.shape."""
        return self.reduced.states(t)[:, self.kept]

    def layer(self, t: Any) -> np.ndarray:
        """Return what the layer adds at ``t``, for every order."""
        terms = self.landing.corrections(np.asarray(t, dtype=float) / self.reduced.mu)
        return (self._sums @ terms.reshape(len(terms), -1)).reshape(-1, *terms.shape[1:])[:, self.kept]

    def misses(self) -> np.ndarray:
        """Return what the composite of every order misses of the start, in the fast states: (orders, fast states)."""
        return self.reduced.states(0.0)[:, self.reduced.slow :] - self._sums @ self.landing.rest

    @cached_property
    def _sums(self) -> np.ndarray:
        """Return the factors that the terms of a layer have in its sum to every order."""
        powers = np.arange(self.landing.order + 1)
        return self.reduced.mu**powers * (powers <= np.array(self.reduced.orders)[:, None])


def follow_smooth(scene: Any, method: str = "jump", *, order: int = 1) -> Path:
    """Follow the ``scene`` of a smooth slow-fast system by ``"jump"`` or ``"slow"`` to ``order``.

    The motion keeps to one side of what switches. ``path.info["omitted"]`` is the composite's first omitted term at
    ``until``, state by state. Raises ``InputError`` for functions without series, ``OutOfRange`` where the layer
    settles on no attracting branch, the expansion does not hold or a pole of the rates is passed, and
    ``NotNormallyHyperbolic`` where the slow manifold is lost before ``until``.
    """
    mu, until = matched.small_number(scene), float(scene.until)
    begun = matched.begun(Automaton(scene.system, scene.values), scene.start)
    slowly = matched.slow_of(begun.mode, order + EXTRA)
    begin = slowly.point(0.0, begun.state)
    motion = layered_motion(slowly.formulas, order, begin, mu, slowly.values, until, slowly.places)
    matched.require_no_pole(begun, slowly, motion.reduced)
    slow, layer = motion.states(until), motion.layer(until)
    now, next_, _ = slow + layer
    layered = method == "jump"
    error = _expected(motion, layered, slow, layer)
    if error >= 1 > _expected(motion, True, slow, layer):
        raise OutOfRange(f"at t = {until:.6g} the motion is still in its layer, which method 'slow' leaves out: take "
                         "method='jump', or a later until")  # fmt: skip
    if not error < 1:
        raise OutOfRange(f"the terms that order {order} omits amount to {error:.3g} of the states at t = {until:.6g}: "
                         f"{scene.system.small} = {mu:.3g} is not small here; use an exact method")  # fmt: skip
    final = now if layered else slow[0]
    return Path(scene, method, tuple(final.tolist()), (), begun.modes, LayeredDense(motion, layered, until), error,
                {"omitted": tuple((next_ - now).tolist())})  # fmt: skip


def leaves_its_sides(scene: Any, order: int) -> bool:
    """Tell whether the motion of a smooth system leaves the sides, of what switches, on which it begins."""
    until, mu, automaton = float(scene.until), matched.small_number(scene), Automaton(scene.system, scene.values)
    path = matched.begun(automaton, scene.start)
    begun, rest = path.mode, (until, mu, order + EXTRA, WATCHED)
    if not begun.kinds:
        return False
    path = matched.through_layer(automaton, path, *rest)
    while path.mode is begun and path.t < until:
        path = matched.slowly(automaton, path, *rest)
    return any(mode is not begun for mode in (path.mode, *(stretch.mode for stretch in path.stretches)))


def layered_motion(
    known: Formulas, order: int, begin: tuple, mu: float, values: tuple, until: float, kept: tuple[int, ...]
) -> LayeredMotion:
    """Return the ``LayeredMotion`` to ``order`` and the ``EXTRA`` orders beyond it."""
    slow = len(known.mode.slow)
    rtol = tolerance(mu, order)
    landing = land(known, order + EXTRA, begin[:slow], begin[slow:], values, rtol, mu)
    orders = tuple(range(order, order + EXTRA + 1))
    powers = mu ** np.arange(order + EXTRA + 1)
    starts = [reduced.branch_at(known, powers[: m + 1] @ landing.base[: m + 1], landing.branch, values) for m in orders]
    flow = reduced.follow_reduced_flow(known, orders, starts, slow, mu, values, until, rtol)
    return LayeredMotion(landing, flow, rtol, kept)


def expected_error(motion: LayeredMotion, layered: bool, until: float, units: Any = 1.0) -> float:
    """Return the error to expect of a motion, with its layer or without, at ``until``; its states are in ``units``."""
    return _expected(motion, layered, motion.states(until) * units, motion.layer(until) * units, units)


def _expected(motion, layered, slow, layer, units=1.0):
    # a layer that fades no faster than the slow motion moves cancels its terms, but not what they leave out
    first, second = _terms(slow)
    told, misses = [slow + layer, *[slow] * bool(second > STALLED * first)], motion.misses()
    misses = misses * np.broadcast_to(units, len(motion.kept))[len(motion.kept) - misses.shape[1] :]
    left, rounding = (0.0 if layered else layer[0]), motion.rtol * np.max(units)
    return max(predicted_error(terms, left, rounding, misses) for terms in told)


def tolerance(mu: float, order: int, finer: float = FINER) -> float:
    """Return the tolerance of the integrations of a model that is wrong by O(mu^(order + 1))."""
    return min(max(finer * mu ** (order + 1), FINEST), COARSEST)


def predicted_error(
    composites: Sequence[np.ndarray] | np.ndarray, left: Any = 0.0, rtol: float = 0.0, misses: Any = ((0.0,),)
) -> float:
    """Return the error to expect of the first of three composites, relative to the largest of 1 and the states.

    ``left`` is what a motion without its layer lacks, ``rtol`` the tolerance of the integrations, ``misses`` what each
    composite misses of the start.
    """
    first, second = _terms(composites)
    ratio = min(STALLED, max(STEADY, second / first)) if first > 0 else STALLED
    error = (first + 2 * second / (1 - ratio)) / (1 - ratio) + np.abs(left).max()
    error += _beyond(max(first, second), np.asarray(misses))
    scale = max(1.0, np.abs(composites[0]).max() - error)  # of the true states, which the error leaves uncertain
    return float(error / scale + ROUNDING * rtol)


def _terms(motions: Sequence[np.ndarray] | np.ndarray) -> tuple[float, float]:
    """Return the largest parts of the two terms between three motions."""
    now, next_, last = motions
    return np.abs(next_ - now).max(), np.abs(last - next_).max()


def _beyond(omitted: float, misses: np.ndarray) -> float:
    """Return the error of the last composite, which misses the start by ``misses[-1]``.

    It is taken to fade half as fast as the terms that were omitted at the start and are now ``omitted``.
    """
    begun = np.abs(misses[1:] - misses[:-1]).max(initial=0)
    return math.sqrt(min(1.0, omitted / begun) if begun > 0 else 1.0) * np.abs(misses[-1]).max()


@dataclass(frozen=True)
class LayeredDense:
    """The motion to the order asked for at any times in [0, until]: an array of shape ``(states,) + t.shape``."""

    motion: LayeredMotion
    layered: bool
    until: float

    def __call__(self, t: Any) -> Any:
        times = times_within(t, self.until)
        slow = self.motion.states(times)[0]
        return slow + self.motion.layer(times)[0] if self.layered else slow
