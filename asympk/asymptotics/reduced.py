r"""The reduced flow: x' = F(x, mu) on a slow manifold, integrated as what it is, a flow that is not stiff.

The branch is carried by its value b, with b' = -g_y^-1 g_x x', so no closed form of it is needed. Where g is affine in
the fast states, b is a function of x and is not carried.

The flow to several orders is integrated side by side, on the same steps: their differences are the terms that the lower
orders omit. It stops where the manifold is lost: where an eigenvalue of g_y no longer attracts, where g_y changes
within its own time, mu |d log|det g_y| / dt| = |largest real part|, as it does at a distance of mu^(2/3) before a fold,
or where fast and slow rates meet, 4 mu |h_x f_y| or mu sqrt(27 |h_x f_x f_y| / 4) = |largest real part|, as where a
node turns to a focus. No units of states are in either: the size of a matrix is sqrt(sum |m_ij m_ji|) here.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from asympk.asymptotics.fibre import Formulas
from asympk.asymptotics.landing import abscissa, listed, root
from asympk.asymptotics.nonstiff import Trajectory, rates, steps
from asympk.asymptotics.stiff import jacobian
from asympk.asymptotics.watching import watched
from asympk.automaton.numericmode import LOOKS
from asympk.errors import NotNormallyHyperbolic, OutOfRange

STEPS = 20000
FAR = 1e12
MEETING = 4  # mu y' = g with constant coefficients and x' = y have real rates below 4 mu |h_x f_y| = |g_y|
AGAIN = math.sqrt(27 / 4)  # and with x'' = y below mu sqrt(27 |h_x f_x f_y| / 4) = |g_y|


@dataclass(frozen=True)
class Reduced:
    """The flow to the orders ``orders`` of a manifold, side by side: (x, b) of each along ``trajectory``.

    ``guard`` is the one that is lost at ``end``, or None.
    """

    formulas: Formulas
    orders: tuple[int, ...]
    slow: int
    mu: float
    values: tuple
    end: float
    guard: int | None
    trajectory: Trajectory = field(repr=False)

    def states(self, t: Any) -> np.ndarray:
        """Return x and y on the manifold at the array ``t``, for every order: (orders, states) + t.shape."""
        t = np.asarray(t, dtype=float)
        motion, known = self.trajectory(t.ravel()), self.formulas.arrays
        spread: Callable = partial(np.broadcast_to, shape=t.size)
        if t.size == 1:
            motion, known, spread = motion[:, 0].tolist(), self.formulas, float
        found, width = [], len(motion) // len(self.orders)
        for k, order in enumerate(self.orders):
            point = motion[k * width : (k + 1) * width]
            found.append([*point[: self.slow], *map(spread, known.height[order](*point, self.mu, *self.values))])
        return np.array(found).reshape(len(found), len(found[0]), *t.shape)


def follow_reduced_flow(
    formulas: Formulas, orders: tuple[int, ...], starts: list[np.ndarray], slow: int, mu: float, values: tuple,
    until: float, rtol: float = 1e-12, guards: Callable | None = None, began: float = 0.0, within: float = math.inf,
) -> Reduced:  # fmt: skip
    """Integrate the flow to every order of ``orders`` from its start, what ``Formulas.on_branch`` returns.

    ``guards`` returns those of a mode at the time and such a point; the flow of the first order ends where one becomes
    negative. Steps are at most ``within``. Raises ``NotNormallyHyperbolic`` where the manifold is lost, ``OutOfRange``
    where the flow leaves for infinity; both tell the time, ``began`` at the start, and the state reached.
    """
    first, size = tuple(float(v) for start in starts for v in start), len(starts[0])
    found, end, guard, far = list[Any](), until, None, FAR * max([1.0, *map(abs, first)])
    check = partial(_check, formulas, slow, mu, values, guards, began)
    check(None, first[:size])
    if not first:  # no slow states, no slow motion
        return Reduced(formulas, orders, slow, mu, values, until, None, Trajectory((), ()))
    flows, slopes = tuple(formulas.flow[m] for m in orders), partial(_slopes, formulas, orders, (mu, *values))
    within = until / LOOKS if any(rate == 1 for rate in formulas.mode.slow.values()) else within  # driven by a clock
    along = steps(flows, (mu, *values), first, until, rtol, (rtol,) * len(first), within=within, slopes=slopes)
    for step, lost in watched(_held(along, check, size), guards, size):
        if len(found) == STEPS or not max(map(abs, step.end)) < far:
            break
        found.append(step)
        if lost:
            end, guard = lost
            break
    if until > 0 and (not found or found[-1].after < end):
        t, last = (found[-1].after, found[-1].end[:size]) if found else (0.0, first[:size])
        if any(orders):  # higher terms grow without bound where a manifold is nearly lost, which order 0 tells
            later = guards and (lambda span, at: guards(t + span, at))
            follow_reduced_flow(formulas, (0,), [np.array(last)], slow, mu, values, until - t, rtol, later, began + t)
        raise _unbounded(formulas, last, mu, values, began + t)
    return Reduced(formulas, orders, slow, mu, values, end, guard, Trajectory(first, tuple(found)))


def _slopes(formulas, orders, parameters, state):
    """Return the Jacobian matrix of the flows to every order, side by side."""
    return jacobian(partial(rates, tuple(formulas.complexes.flow[m] for m in orders), parameters), state)


def _unbounded(formulas, last, mu, values, t):
    where = _place(formulas, last, formulas.height[0](*last, mu, *values), t)
    return OutOfRange(f"the reduced flow ends near {where}: its states grow beyond bounds, or its steps become too "
                      "small")  # fmt: skip


def branch_at(formulas: Formulas, x: Sequence[float], near: Sequence[float], values: tuple) -> np.ndarray:
    """Return the point of the branch at x, its value found from ``near`` where it is carried; raises ``OutOfRange``."""
    b = () if formulas.field.affine else root(formulas, x, near, values)
    if b is None:
        raise OutOfRange(f"the base point {listed(formulas.mode.slow, x)} is off the branch that the layer settles on; "
                         "the small parameter is not small here")  # fmt: skip
    return np.array(formulas.on_branch(x, b))


def margin(formulas: Formulas, state: Sequence[float], slow: int, mu: float, values: tuple) -> float:
    """Return by how much the fast rate exceeds the slow ones: positive where the manifold attracts."""
    try:
        turning, once, twice = formulas.slow_rates(*state, mu, *values)
        _, largest = _attraction(formulas, state, slow, mu, values)
        meeting = max(abs(turning), MEETING * _size(once), AGAIN * math.sqrt(_size(twice)))
        return -largest - mu * meeting
    except (ArithmeticError, ValueError):
        return -math.inf


def _size(entries):
    """Return the size of a square matrix, that of its diagonal where it is a column times a row."""
    matrix = np.array(entries).reshape(math.isqrt(len(entries)), -1)
    return math.sqrt(np.abs(matrix * matrix.T).sum()) if len(entries) > 1 else abs(entries[0])


def _attraction(formulas, state, slow, mu, values):
    """Return y on the branch, and the largest real part of an eigenvalue of g_y there."""
    y = formulas.height[0](*state, mu, *values)
    return y, abscissa(formulas, state[:slow], y, values)


def _held(along, check, size):
    """Yield the steps, each after the check that the manifold is not lost in it before an edge."""
    for step in along:
        check(step, step.end[:size])
        yield step


def _check(formulas, slow, mu, values, guards, began, step, state):
    """Raise where the manifold is lost, at the time within a step to ``state`` where it is, if no guard is before."""
    if margin(formulas, state, slow, mu, values) > 0:
        return
    t, size = 0.0, len(state)
    if step is not None:
        low, high = step.t, step.after
        while high - low > 1e-12 * max(1, high):
            t = (low + high) / 2
            low, high = (t, high) if margin(formulas, step(t)[:size].tolist(), slow, mu, values) > 0 else (low, t)
        state = step(low)[:size].tolist()
        if guards is not None and min(guards(low, state), default=0) < 0:
            return
    y, largest = _attraction(formulas, state, slow, mu, values)
    raise NotNormallyHyperbolic(
        f"the slow manifold is lost at {_place(formulas, state, y, began + t)}, by a fold, a change of stability, or "
        f"slow motion that is not slow: the largest real part of an eigenvalue of g_y is {largest:.6g}; take a smaller "
        "until, or a smaller parameter"
    )


def _place(formulas, state, y, t):
    """Return the time and the states for a message, without what only repeats the time."""
    mode = formulas.mode
    states = zip((*mode.slow.items(), *mode.fast.items()), (*state[: len(mode.slow)], *y), strict=True)
    told = [(s, v) for (s, rate), v in states if rate != 1 or f"{v:.6g}" != f"{t:.6g}"]
    return f"t = {t:.6g}, {listed(*zip(*told, strict=True))}"
