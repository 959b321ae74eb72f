r"""Collocation by Radau IIA with seven stages, for flows whose explicit steps would be short.

Where rates lie far apart, slow components last long after fast ones have decayed, and the decayed components would
limit an explicit step but not this one. A step h puts a polynomial through the state w_0 and the stages w_i, where
w_i - w_0 = h sum_j a_ij f(w_j). The last two Legendre coefficients of the polynomial estimate its error throughout the
step. With the eigenvalues l_i of (a_ij), each sweep of Newton's method solves one linear system with the matrix
I - h l_i f_w for each stage (Hairer and Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8).
``stiff_steps`` controls the step length; the hard function is ``_tried``, one step.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import legendre

from asympk import radau

STAGES = 7
IMPLICIT = 10  # the number of explicit steps that take as long as an implicit one
SAFETY, SHRINK, GROW = 0.8, 0.2, 5.0
SWEEPS, ENOUGH = 10, 0.02  # the most sweeps of Newton's method, and the last change in units of the allowed error
ROUNDED = 0.2  # the last change, in the same units, where rounding lets the changes decrease no further
OFF = 1e-30  # the imaginary step for the Jacobian matrix

Slopes = Callable[[tuple], np.ndarray]

_PLACES = radau.places(STAGES)
_INTEGRALS = np.array([legendre.legint(unit, lbnd=-1) / 2 for unit in np.eye(STAGES)]).T
_MATRIX = legendre.legvander(_PLACES, STAGES) @ _INTEGRALS @ np.linalg.inv(legendre.legvander(_PLACES, STAGES - 1))
_EIGENVALUES, _VECTORS = np.linalg.eig(_MATRIX)
_INVERSE = np.linalg.inv(_VECTORS)
_SERIES = np.linalg.inv(legendre.legvander(np.append(-1.0, _PLACES), STAGES))[:, 1:]


@dataclass(frozen=True)
class StiffStep:
    """One accepted step from (t, state) over ``span`` to ``end`` at ``after``; ``stages`` are the rates at its ends."""

    t: float
    span: float
    after: float
    state: tuple
    end: tuple
    stages: tuple = field(repr=False)
    series: np.ndarray = field(repr=False)
    cost: ClassVar[int] = IMPLICIT

    def state_at(self, t: float) -> tuple:
        """Return the state at a time ``t`` within the step."""
        return self.state if t == self.t else self.end if t == self.after else tuple(self(t).tolist())

    def __call__(self, t: Any) -> np.ndarray:
        """Return the states at the array ``t`` of times within the step: (states,) + t.shape."""
        return legendre.legval(2 * (np.asarray(t, dtype=float) - self.t) / self.span - 1, self.series)


def stiff_steps(
    flow: Callable[[tuple], tuple], slopes: Slopes, state: tuple, t: float, until: float, rtol: float, atol: tuple,
    span: float, within: float,
) -> Iterator[StiffStep]:
    """Yield the steps of state' = flow(state) from ``t`` to ``until``.

    The first step is at most ``span``, every step at most ``within``. The error of a step is held below ``atol`` plus
    ``rtol`` times the state. The iterator ends early where the steps become too small or infinite.
    """
    allowed, first, jacobian = np.array(atol), flow(state), slopes(state)
    while t < until:
        span = min(span, until - t, within)
        if span == math.inf or (span <= 16 * math.ulp(t) and until - t > span):
            return
        moved, error = _tried(flow, jacobian, state, span, rtol, allowed)
        factor = max(SHRINK, SAFETY * error ** (-1 / STAGES)) if error > 0 else GROW
        if error < 1:
            end, after = tuple((state + moved[-1]).tolist()), until if span == until - t else t + span
            last, series = flow(end), _SERIES @ moved
            series[0] += state
            yield StiffStep(t, span, after, state, end, (first, last), series)
            t, state, first, jacobian = after, end, last, slopes(end)
        span *= min(factor, GROW if error < 1 else SAFETY)


def succeeds(
    flow: Callable[[tuple], tuple], slopes: Slopes, state: tuple, span: float, rtol: float, atol: tuple
) -> bool:
    """Tell whether one implicit step of length ``span`` is accurate enough; False where it has no finite value."""
    with suppress(ArithmeticError, ValueError):
        return _tried(flow, slopes(state), state, span, rtol, np.array(atol))[1] < 1
    return False


def _tried(flow, jacobian, state, span, rtol, allowed):
    """Return the stages less the state, and the error in units of the allowed one, inf if Newton's method fails."""
    moved, previous = np.zeros((STAGES, len(state))), math.inf
    with suppress(ArithmeticError, ValueError, np.linalg.LinAlgError):
        inverses = np.linalg.inv(np.eye(len(state)) - span * _EIGENVALUES[:, None, None] * jacobian)
        for _ in range(SWEEPS):
            rates = np.array([flow(tuple(w)) for w in (state + moved).tolist()])
            residual = _INVERSE @ (span * _MATRIX @ rates - moved)
            change = (_VECTORS @ (inverses @ residual[:, :, None])[:, :, 0]).real
            moved = moved + change
            bounds = allowed + rtol * np.maximum(np.abs(state), np.abs(state + moved[-1]))
            size = (np.abs(change) / bounds).max()
            if size <= (ENOUGH if size < previous else ROUNDED):
                return moved, float((np.abs(_SERIES[-2:] @ moved) / bounds).max())
            if not size < previous:
                break
            previous = size
    return moved, math.inf


def jacobian(flow: Callable[[tuple], tuple], state: tuple) -> np.ndarray:
    """Return the Jacobian matrix, to rounding, of a flow that takes complex numbers, by complex-step derivatives."""
    columns = []
    for k, w in enumerate(state):
        off = flow((*state[:k], complex(w, OFF), *state[k + 1 :]))
        columns.append([v.imag / OFF for v in off])
    return np.array(columns).T
