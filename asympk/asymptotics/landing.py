r"""Where the layer carries a start of a smooth slow-fast system: the attracting branch, and the base point as a series.

The layer is followed in tau = t/mu until it is over to rounding, and its series X(T) carried back along the slow motion
to tau = 0 (``fibre``). A start whose layer does not settle on an attracting branch is refused.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import DOP853, solve_ivp

from asympk.asymptotics.fibre import Formulas
from asympk.errors import OutOfRange

NEAR = 1e-3  # a Newton step to a root of g, relative to the state, from which on the layer is taken to approach it
OVER = math.log(1e17)
STEPS = 3000
FAR = 1e6
LOOSEST = 1e-3


@dataclass(frozen=True)
class Landing:
    """A layer in numbers: it is over at the fast time ``end``, when the fast states have come to ``branch`` at x_0.

    ``base[k]`` multiplies mu**k in the base point, for k = 0 .. order.
    """

    formulas: Formulas
    order: int
    x: tuple
    y: tuple
    values: tuple
    branch: tuple
    end: float
    base: Any
    tolerances: dict

    @cached_property
    def _slow(self):
        """The coefficients of tau**j in S_k and H_k: an array (order + 1, states, order + 1)."""
        jets = self.base[1:].ravel()
        found = self.formulas.slow(*self.x, *self.branch, *jets, *self.values)
        count = self.order + 1
        levels = zip(found[:count], found[count:], strict=True)
        return np.array([[_padded(c, count) for c in (*s, *h)] for s, h in levels])

    @cached_property
    def _layer(self):
        series = _first(self.formulas, self.x, self.y, self.order)
        rates = _rates(self.formulas, self.x, self.values)
        return solve_ivp(rates, (0, self.end), series, "DOP853", **self.tolerances, dense_output=True).sol

    def corrections(self, tau: Any) -> np.ndarray:
        """Return X_k - S_k and Y_k - H_k at the array ``tau``: (order + 1, states) + tau.shape; 0 after the layer."""
        tau = np.asarray(tau, dtype=float)
        count, n = self.order + 1, len(self.x)
        if (tau >= self.end).all():
            return np.zeros((count, n + len(self.y), *tau.shape))
        inside = np.minimum(tau, self.end)
        x = np.broadcast_to(np.array(self.x)[:, None], (n, inside.size))
        series = np.concatenate([x, self._layer(inside.ravel())]).reshape(count, -1, *tau.shape)
        powers = inside ** np.arange(count).reshape(-1, *[1] * tau.ndim)
        return np.where(tau < self.end, series - np.tensordot(self._slow, powers, 1), 0.0)


def land(
    formulas: Formulas, order: int, x: tuple, y: tuple, values: tuple, rtol: float = 1e-12, mu: float = 1.0
) -> Landing:
    """Follow the layer from (x, y) with the parameters ``values``, and return the ``Landing`` to ``order``.

    The term k is right to ``rtol`` / mu**k: to ``rtol`` each, or as much of their sum at ``mu``.

    Raises ``OutOfRange`` where the layer does not settle on an attracting branch.
    """
    tolerances = _tolerances(rtol, mu, order, len(x), len(y))
    solver = DOP853(_rates(formulas, x, values), 0, _first(formulas, x, y, order), np.inf, **tolerances)
    branch, end = _settled(solver, formulas, x, y, values, order)
    last = solver.y.reshape(-1)
    jets = _series(last, len(x), len(y), order)
    polynomials = formulas.slow(*x, *branch, *jets.ravel(), *values)[: order + 1]
    base = np.array([[_horner(c, -end) for c in level] for level in polynomials])
    return Landing(formulas, order, x, y, values, branch, end, base, tolerances)


def root(formulas: Formulas, x: tuple, guess: tuple, values: tuple) -> tuple | None:
    """Return the root b of g(x, b, 0) that Newton's method finds from ``guess``, or None."""
    b = np.array(guess, dtype=float)
    for _ in range(50):
        step = newton(formulas, x, b, values)
        if step is None:
            return None
        b = b - step
        if np.abs(step).max() <= 4e-16 * max(1, np.abs(b).max()):
            return tuple(b.tolist())
    return tuple(b.tolist()) if np.abs(step).max() <= 1e-13 * max(1, np.abs(b).max()) else None


def newton(formulas: Formulas, x: tuple, y: Any, values: tuple) -> Any:
    """Return g_y^-1 g, or None where g_y is singular."""
    try:
        force = formulas.force(*x, *y, *values)
        if len(y) == 1:
            return np.array(force) / formulas.jacobian(*x, *y, *values)[0]
        return np.linalg.solve(_square(formulas, x, y, values), force)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return None


def abscissa(formulas: Formulas, x: Any, y: Any, values: tuple) -> float:
    """Return the largest real part of an eigenvalue of g_y: negative where the branch attracts."""
    if len(y) == 1:
        return formulas.jacobian(*x, *y, *values)[0]
    return float(np.linalg.eigvals(_square(formulas, x, y, values)).real.max())


def _square(formulas, x, y, values):
    return np.array(formulas.jacobian(*x, *y, *values), dtype=float).reshape(len(y), len(y))


def _rates(formulas, x, values):
    layer = formulas.layer
    return lambda _, series: layer(*x, *series.tolist(), *values)


def _tolerances(rtol, mu, order, slow, fast):
    levels = [rtol] * fast
    for k in range(1, order + 1):
        levels += [rtol / max(mu**k, rtol / LOOSEST)] * (slow + fast)
    return {"rtol": max(rtol, 1e-13), "atol": np.array(levels)}


def _first(formulas, x, y, order):
    return np.array([*y, *[0.0] * (order * (len(x) + len(y)))])


def _series(state, slow, fast, order):
    """Return X_1, ..., X_n."""
    return state[fast:].reshape(order, slow + fast)[:, :slow]


def _settled(solver, formulas, x, y, values, order):
    """Step until the layer is over; return the branch's value and the time."""
    known, until = None, math.inf
    for _ in range(STEPS):
        now = solver.y[: len(y)]
        step = newton(formulas, x, now, values)
        scale = max(1, np.abs(now).max())
        if scale > FAR * max(1, *map(abs, y)):
            break
        if known is None and step is not None and np.abs(step).max() < NEAR * scale:
            known = root(formulas, x, now, values)
            rate = -abscissa(formulas, x, known, values) if known else 0
            if known and np.abs(step).max() < 1e-14 * scale and rate <= 0:
                raise OutOfRange(f"the start y = {text(y)} lies on a branch that does not attract: the largest real "
                                 f"part of an eigenvalue of g_y is {-rate:.6g} there; move it off")  # fmt: skip
            known = known if rate > 0 else None
            until = solver.t + (OVER + (order + 1) * math.log1p(OVER)) / rate if known else math.inf
            solver.t_bound = until
        if solver.t >= until:
            if np.abs(now - known).max() < 1e-9 * scale:
                return known, solver.t
            known, until, solver.t_bound = None, math.inf, math.inf
            solver.status = "running"
        if solver.status != "running":
            break
        solver.step()
    raise OutOfRange(f"the layer from y = {text(y)} at x = {text(x)} does not settle on an attracting branch: after at "
                     f"most {STEPS} steps, at tau = {solver.t:.6g}, y = {text(solver.y[: len(y)])}")  # fmt: skip


def text(numbers: Iterable[float]) -> str:
    """Return numbers for a message."""
    return ", ".join(f"{v:.6g}" for v in numbers)


def _horner(coefficients, t):
    total = 0.0
    for c in reversed(coefficients):
        total = total * t + c
    return total


def _padded(coefficients, count):
    return [*coefficients, *[0.0] * (count - len(coefficients))]
