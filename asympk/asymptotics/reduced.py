r"""The reduced flow: x' = F(x, mu) on a slow manifold, integrated as what it is, a flow that is not stiff.

The branch is carried by its value b, with b' = -g_y^-1 g_x x', so no closed form of it is needed. The flow to several
orders is integrated side by side, on the same steps: their differences are the terms that the lower orders omit. It
stops where the manifold is lost: where an eigenvalue of g_y no longer attracts, where g_y changes within its own time,
mu |d log|det g_y| / dt| = |largest real part|, as it does at a distance of mu^(2/3) before a fold, or where fast and
slow rates meet, 4 mu |f_y h_x| = |largest real part|, as where a node turns to a focus.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import DOP853, OdeSolution

from asympk.asymptotics.fibre import Formulas
from asympk.asymptotics.landing import abscissa, text
from asympk.errors import NotNormallyHyperbolic, OutOfRange

STEPS = 20000
FAR = 1e12
MEETING = 4  # mu y' = g and x' = f with constant coefficients have real rates below 4 mu |f_y h_x| = |g_y|


@dataclass(frozen=True)
class Reduced:
    """The flow to the orders ``orders`` of a manifold, side by side: (x, b) of each at the times of ``solution``."""

    formulas: Formulas
    orders: tuple[int, ...]
    slow: int
    mu: float
    values: tuple
    solution: OdeSolution = field(repr=False)

    def states(self, t: Any) -> np.ndarray:
        """Return x and y on the manifold at the array ``t``, for every order: (orders, states) + t.shape."""
        t = np.asarray(t, dtype=float)
        motions = self.solution(t.ravel()).reshape(len(self.orders), -1, t.size)
        found = []
        for order, motion in zip(self.orders, motions, strict=True):
            height = self.formulas.arrays.height[order](*motion, self.mu, *self.values)
            found.append([*motion[: self.slow], *(np.broadcast_to(y, t.size) for y in height)])
        return np.array(found).reshape(len(self.orders), -1, *t.shape)


def follow(
    formulas: Formulas,
    orders: tuple[int, ...],
    starts: list[np.ndarray],
    slow: int,
    mu: float,
    values: tuple,
    until: float,
    rtol: float = 1e-12,
    inside: Callable | None = None,
) -> Reduced:
    """Integrate the flow to every order of ``orders`` from its start (x, b), the first ``slow`` numbers x.

    ``inside`` returns the guards of a mode at (t, x, b); the flow of the first order ends where one becomes negative.
    Raises ``NotNormallyHyperbolic`` where the manifold is lost, ``OutOfRange`` where the flow leaves for infinity; both
    tell the time and the state reached.
    """
    rates = _stacked(formulas, orders, len(starts[0]), mu, values)
    solver = DOP853(rates, 0.0, np.concatenate(starts), until, rtol=rtol, atol=rtol)
    times, pieces = [0.0], []
    _check(solver, None, formulas, starts[0], slow, mu, values)
    while solver.status == "running":
        before = solver.y[: len(starts[0])]
        try:
            message = solver.step()
        except (ArithmeticError, ValueError) as reason:
            message = str(reason)
        if message or len(pieces) == STEPS or not np.abs(solver.y).max() < FAR:
            raise OutOfRange(f"the reduced flow ends at t = {solver.t:.6g} near {text(before)}: "
                             f"{message or 'its states grow beyond bounds'}")  # fmt: skip
        pieces.append(solver.dense_output())
        times.append(solver.t)
        if inside and min(inside(solver.t, solver.y[: len(starts[0])])) < 0:
            times[-1] = _edge(pieces[-1], times[-2], times[-1], len(starts[0]), inside)
            break
        _check(solver, pieces[-1], formulas, solver.y[: len(starts[0])], slow, mu, values)
    if not pieces:
        pieces, times = [lambda t: np.concatenate(starts)[:, None] + 0 * np.asarray(t)], [0.0, 0.0]
    return Reduced(formulas, orders, slow, mu, values, OdeSolution(times, pieces))


def _edge(piece, low, high, size, inside):
    """Return the last time at which every guard is positive, by bisection."""
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (low, middle) if min(inside(middle, piece(middle)[:size])) < 0 else (middle, high)
    return low


def margin(formulas: Formulas, state: np.ndarray, slow: int, mu: float, values: tuple) -> float:
    """Return by how much the fast rate exceeds the slow ones: positive where the manifold attracts."""
    x, b = state[:slow], state[slow:]
    try:
        turning, *coupling = formulas.slow_rates(*x, *b, mu, *values)
        return -abscissa(formulas, x, b, values) - mu * max(abs(turning), MEETING * math.hypot(*coupling))
    except (ArithmeticError, ValueError):
        return -math.inf


def _stacked(formulas, orders, size, mu, values):
    flows = [formulas.flow[m] for m in orders]

    def rates(_, state):
        parts = state.reshape(-1, size).tolist()
        return [v for flow, part in zip(flows, parts, strict=True) for v in flow(*part, mu, *values)]

    return rates


def _check(solver, piece, formulas, state, slow, mu, values):
    """Raise where the manifold is lost, at the time within the last step where it is."""
    if margin(formulas, state, slow, mu, values) > 0:
        return
    t, size = solver.t, len(state)
    if piece is not None:
        low, high = solver.t_old, solver.t
        while high - low > 1e-12 * max(1, high):
            t = (low + high) / 2
            low, high = (t, high) if margin(formulas, piece(t)[:size], slow, mu, values) > 0 else (low, t)
        state = piece(low)[:size]
    where = f"t = {t:.6g}, x = {text(state[:slow])}, y = {text(state[slow:])}"
    largest = abscissa(formulas, state[:slow], state[slow:], values)
    raise NotNormallyHyperbolic(
        f"the slow manifold is lost at {where}, by a fold, a change of stability, or slow motion that is not slow: the "
        f"largest real part of an eigenvalue of g_y is {largest:.6g}; take a smaller until, or a smaller parameter"
    )
