r"""Where the layer of a smooth slow-fast system lands: the attracting branch, and the base point as a series in mu.

``land`` integrates the series of the layer, whose equations are in ``fibre``, in the fast time tau = t/mu until the
layer is over to the tolerance at tau = T. The slow motion through X(T), a polynomial in tau, is then taken back to
tau = 0, which gives the base point. ``affinelayer`` gives some layers in closed form. The hard function, ``_settled``,
finds the branch and decides when the layer is over. ``OutOfRange`` is raised where no attracting branch is found.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from operator import attrgetter
from typing import Any

import numpy as np

from asympk.asymptotics import affinelayer
from asympk.asymptotics.fibre import Formulas
from asympk.asymptotics.nonstiff import Trajectory, on_cubic, steps
from asympk.asymptotics.stiff import jacobian
from asympk.automaton.exponentials import exponentials
from asympk.errors import OutOfRange
from asympk.numbers import listed
from asympk.symbolic.expansion import is_zero

NEAR = 1e-3  # the Newton step to a root of g, relative to the state, below which a layer is taken to approach the root
OVER = math.log(1e17)  # the time, times the rate of decay, after which a decaying term is rounding
SETTLED = 1e-7  # the largest distance from its branch, relative to the state, at which a layer may be over
STILL = 10  # the same distance in units of the tolerance, if that is more
STEPS, SEARCHING = 20000, 4000  # the most steps of a layer in all, and before it is near one of several branches
FAR = 1e6  # the size of the state, relative to its ``reach``, beyond which a layer counts as unbounded
FINEST = 1e-13  # the least tolerance of an integration, beside the rounding of its states
ROOT = 1e-12  # the error of a root, relative to the state
ROUNDED = 2.0**-51  # the rounding error of g, relative to its terms, and of an eigenvalue, relative to its size
GROWN, LARGEST = 50, 100.0  # the growth of errors from which they are estimated, and the logarithm of the largest one
LOOSEST, ROUGHEST = 1e-3, 1e-8  # the largest tolerances of the terms 1 .. n of a layer, and of its term 0
UNBOUNDED = "grows beyond bounds, or its rates do"


@dataclass(frozen=True)
class Landing:
    """A layer in numbers: by the fast time ``end`` it has settled on ``branch``, a root y of g(x_0, y, 0).

    ``base[k]``, k = 0 .. order, is the coefficient of mu**k in the base point, and ``rest[k]`` in the fast states
    on the slow manifold there. ``during(tau)`` returns the ``corrections`` for tau < ``end``. ``errors(tau)`` returns
    those of the terms, (order + 1, states), or None where errors do not grow along the layer.
    """

    branch: tuple
    end: float
    base: Any
    rest: Any
    during: Callable[[np.ndarray], np.ndarray]
    errors: Callable[[float], np.ndarray] | None = None

    def corrections(self, tau: np.ndarray) -> np.ndarray:
        """Return X_k - S_k and Y_k - H_k at the array ``tau``: (order + 1, states) + tau.shape; 0 from ``end`` on."""
        return np.where(tau < self.end, self.during(np.minimum(tau, self.end)), 0.0)


def land(
    formulas: Formulas, order: int, x: tuple, y: tuple, values: tuple, rtol: float = 1e-12, mu: float = 1.0
) -> Landing:
    """Return the ``Landing`` to ``order`` of the layer from (x, y) with the parameters ``values``.

    The layer is in closed form where ``affinelayer`` has one, and is integrated otherwise. The tolerance of the term k
    is ``rtol`` / mu**k, so that each term has the error ``rtol`` in the sum at ``mu``. Term 0 affects the base point
    through mu alone: its tolerance is ``rtol`` / mu until ``corrections`` are asked for, which repeat the integration.
    Raises ``OutOfRange`` where the layer does not settle on an attracting branch.
    """
    if formulas.affine and not (largest := abscissa(formulas, x, y, values)) < 0:
        raise OutOfRange(f"the branch{_at(formulas, x)} does not attract, so no layer fades there: "
                         f"the largest real part of an eigenvalue of g_y is {largest + 0.0:.6g} for all fast states"
                         f"{_advice(formulas, '')}")
    if len(y) == 1 and affinelayer.is_affine(formulas.mode):
        rate, table = affinelayer.terms(formulas, order).at((*x, *y), values)
        if np.abs(table).max() <= FAR * max(1, *map(abs, (*x, *y, table[0, -1, 0, 0]))):
            return _in_closed_form(rate, table, y)
    fine, coarse = (_tolerances(rtol, mu, order, len(x), len(y), first) for first in (0, 1))
    return _followed(formulas, order, x, y, values, fine, coarse)


def _in_closed_form(rate, table, y):
    order, (branch,) = len(table) - 1, table[0, -1:, 0, 0].tolist()
    extent = max(1.0, abs(y[0] - branch) / max(1.0, abs(branch)))
    fading = table.copy()
    fading[:, :, 0] = 0

    def during(tau):
        p, j = (np.arange(size).reshape(-1, *[1] * tau.ndim) for size in table.shape[2:])
        return np.einsum("ksij,i...,j...->ks...", fading, np.exp(rate * tau * p), tau**j)

    return Landing((branch,), _over(order, extent) / -rate, table[:, :-1, 0, 0], table[:, -1:, 0, 0], during)


def _over(order, extent=1.0, fading=OVER):
    """Return the time, times the rate of decay, after which a layer to ``order`` has decayed by exp(-``fading``)."""
    return fading + math.log(extent) + (order + 1) * math.log1p(fading)


def _followed(formulas, order, x, y, values, fine, coarse):
    first, errors = (*y, *[0.0] * (order * (len(x) + len(y)))), None
    branch, found = _settled(formulas, first, x, y, values, order, coarse)
    if (growth := _growth(formulas, x, values, found)) > GROWN:
        share = max(1 / growth, min(1.0, ROUNDED * max(map(abs, y)) / fine[1][0]))  # no steps resolve rounding
        fine = coarse = fine[0], tuple(off * share for off in fine[1])
        branch, found = _settled(formulas, first, x, y, values, order, fine)
        errors = partial(_errors, *_grown(formulas, order, x, values, found, *fine))
    end, last = found[-1].after, np.array(found[-1].end)
    jets = last[len(y) :].reshape(order, -1)[:, : len(x)].ravel()
    slow = formulas.slow(order)(*x, *branch, *jets, *values)
    count = order + 1
    base = np.array([[np.polyval(c[::-1], -end) for c in level] for level in slow[:count]])
    motion = formulas.slow(order)(*x, *branch, *base[1:].ravel(), *values)  # in powers of tau from the base point
    rest = np.array([[c[0] for c in level] for level in motion[count:]])

    @cache
    def finely():
        return Trajectory(first, _settled(formulas, first, x, y, values, order, fine)[1])

    def during(tau):
        # X_k and Y_k less the slow motion, which decay
        levels = zip(motion[:count], motion[count:], strict=True)
        slowly = np.array([[[*c, *[0.0] * (count - len(c))] for c in (*s, *h)] for s, h in levels])
        at_rest, fine = np.broadcast_to(np.array(x)[:, None], (len(x), tau.size)), finely()
        series = np.concatenate([at_rest, fine(tau.ravel())]).reshape(count, -1, *tau.shape)
        powers = tau ** np.arange(count).reshape(-1, *[1] * tau.ndim)
        return np.where(tau <= fine.steps[-1].after, series - np.tensordot(slowly, powers, 1), 0.0)

    return Landing(branch, end, base, rest, during, errors)


def _growth(formulas, x, values, steps):
    """Return a bound of the growth of errors along term 0 of a layer, exp(int r dtau) where it repels at a rate r."""
    if formulas.affine:
        return 1.0
    *point, spans = np.array([(*x, *step.state[: len(formulas.fast_states)], step.after - step.t) for step in steps]).T
    return math.exp(min(LARGEST, spans @ np.fmax(abscissas(formulas, (*point, *values)), 0.0)))


def _grown(formulas, order, x, values, steps, rtol, atol):
    """Return the ends of the steps of a layer, and the errors there: those of all steps grow by the Jacobian matrix."""
    flow, squares, found = formulas.complexes.layer(order), np.zeros((len(atol),) * 2), list[np.ndarray]()
    slopes = [jacobian(lambda w: flow(*x, *w, *values), on_cubic(step, 0.5)) * (step.after - step.t) for step in steps]
    for part, step in zip(exponentials(np.array(slopes)), steps, strict=True):
        squares = part @ squares @ part.T + np.diag((atol + rtol * np.abs(step.end)) ** 2)
        found.append(np.sqrt(np.diag(squares)))
    at_rest = np.zeros((len(steps), len(x)))
    return [step.after for step in steps], np.hstack([at_rest, found]).reshape(len(steps), order + 1, -1)


def _errors(ends, errors, tau):
    return errors[min(bisect_left(ends, tau), len(ends) - 1)]


def root(formulas: Formulas, x: Sequence, guess: Sequence, values: tuple) -> tuple | None:
    """Return the root b of g(x, b, 0) that Newton's method finds from ``guess``, or None if it does not converge."""
    b, size, scale = tuple(map(float, guess)), math.inf, 1.0
    for k in range(50):
        step = newton(formulas, x, b, values)
        if step is None:
            return None
        b = tuple(v - s for v, s in zip(b, step, strict=True))
        size, scale = max(map(abs, step)), max(1, *map(abs, b))
        if size <= 4e-16 * scale or (k and formulas.affine):  # then the first step is exact, but for rounding
            return b
    return b if size <= 1e-13 * scale else None


def newton(formulas: Formulas, x: Sequence, y: Sequence, values: tuple) -> Sequence[float] | None:
    """Return the Newton step g_y^-1 g, to be subtracted from y, or None where it cannot be computed."""
    try:
        force = formulas.force(*x, *y, *values)
        if len(y) == 1:
            return (force[0] / formulas.jacobian(*x, *y, *values)[0],)
        return np.linalg.solve(_square(formulas.jacobian(*x, *y, *values)), force).tolist()
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return None


def reach(formulas: Formulas, x: tuple, y: tuple, values: tuple) -> float:
    """Return the size of a layer from (x, y): the largest of 1, the states, and the way to the branch by Newton."""
    return max(1.0, *map(abs, (*x, *y, *(newton(formulas, x, y, values) or ()))))


def abscissa(formulas: Formulas, x: Any, y: Any, values: tuple) -> float:
    """Return the largest real part of an eigenvalue of g_y: negative where the branch attracts."""
    return rightmost(formulas.jacobian(*x, *y, *values)).real


def abscissas(formulas: Formulas, point: Sequence) -> np.ndarray:
    """Return the same at states and parameters that are numbers or arrays, and NaN where g_y is not finite."""
    with np.errstate(all="ignore"):
        entries = np.stack(np.broadcast_arrays(*formulas.arrays.jacobian(*point), *point[:1])[:-1], axis=1)
    finite, size = np.isfinite(entries).all(axis=1), math.isqrt(entries.shape[1])
    slopes = np.where(finite[:, None], entries, 0.0).reshape(-1, size, size)
    largest = np.linalg.eigvals(slopes).real.max(axis=1) if size > 1 else slopes[:, 0, 0]
    return np.where(finite, largest, np.nan)


def rightmost(entries: tuple) -> complex:
    """Return the eigenvalue with the largest real part of a matrix by rows; one within its rounding counts as 0."""
    if len(entries) == 1:
        return entries[0]
    found = max(np.linalg.eigvals(_square(entries)).tolist(), key=attrgetter("real"))
    return found if abs(found.real) > ROUNDED * abs(found) else 1j * found.imag


def attraction(formulas: Formulas, x: Sequence, branch: Sequence, values: tuple) -> float:
    """Return the rate at which a branch attracts, or 0 where the error of the root leaves the sign of the rate open.

    The error of the root is the rounding error of g over the rate, and large where the root is nearly double. The rate
    is rejected where it changes by its own size within this error. It is negative where the branch repels.
    """
    rate, off = -abscissa(formulas, x, branch, values), ROOT * max(1, *map(abs, branch))
    with suppress(ArithmeticError, ValueError):  # g at 2 b has the size of the terms of g, which cancel at the root b
        terms = max(map(abs, formulas.force(*x, *(2 * v for v in branch), *values)))
        off = max(off, ROUNDED * terms / abs(rate))
    moved = (-abscissa(formulas, x, [v + d for v in branch], values) for d in (-off, off))
    return rate if all(abs(other - rate) < abs(rate) for other in moved) else 0.0


def _square(entries):
    return np.array(entries, dtype=float).reshape([math.isqrt(len(entries))] * 2)


def _tolerances(rtol, mu, order, slow, fast, first):
    levels = [max(rtol, min(rtol / mu**first, ROUGHEST))] * fast
    for k in range(1, order + 1):
        levels += [rtol / max(mu**k, rtol / LOOSEST)] * (slow + fast)
    return max(rtol, FINEST), tuple(levels)


def _settled(formulas, first, x, y, values, order, tolerances):
    """Integrate the series of the layer until the layer is over; return the value of the branch and the steps."""
    known, until, found, now = None, math.inf, [], y
    settled, over = max(SETTLED, STILL * tolerances[0]), _over(order, fading=-math.log(min(tolerances[1])))
    most = FAR * reach(formulas, x, y, values)
    ahead = steps(
        (partial(formulas.layer(order), *x),), values, first, math.inf, *tolerances,
        slopes=lambda at: jacobian(lambda w: formulas.complexes.layer(order)(*x, *w, *values), at),
    )
    mode, spent, words = formulas.mode, 0, UNBOUNDED
    while spent < (STEPS if known or formulas.affine else SEARCHING):
        scale = max(1, *map(abs, now))
        if scale > most:
            break
        if known is None:
            known, rate = approached(formulas, x, now, scale, values)
            until = _reached(found) + over / rate if known else math.inf
        if _reached(found) >= until:
            if max(abs(v - w) for v, w in zip(now, known, strict=True)) < settled * scale:
                return known, tuple(found)
            known, until = None, math.inf
        if (last := next(ahead, None)) is None:
            break
        found.append(last)
        now, spent = last.end[: len(y)], spent + last.cost
    else:
        words = "does not settle on an attracting branch"
        if goal := known or (formulas.affine and root(formulas, x, now, values)):
            words = (f"takes too many steps to settle on {listed(mode.fast, goal)}: it decays too slowly beside the "
                     "fastest rate in g_y")
    raise OutOfRange(f"the layer from {listed(mode.fast, y)}{_at(formulas, x)} {words}: after {len(found)} steps, "
                     f"at tau = {_reached(found):.6g}, it is at {listed(mode.fast, now)}")


def approached(formulas: Formulas, x: tuple, now: tuple, scale: float, values: tuple) -> tuple[tuple | None, float]:
    """Return the attracting branch that a layer is near at y = ``now``, or None if there is none, and its rate.

    Raises ``OutOfRange`` where ``now`` is on a branch that does not attract.
    """
    step = newton(formulas, x, now, values)
    fold = step is None and _is_at_rest(formulas, x, now, values)
    size = 0.0 if fold else math.inf if step is None else max(map(abs, step))
    branch = now if fold else root(formulas, x, now, values) if size < NEAR * scale else None
    rate = attraction(formulas, x, branch, values) if branch else 0.0
    if branch and size < 1e-14 * scale and rate <= 0:
        raise OutOfRange(f"the start, or where its layer comes to, {listed(formulas.mode.fast, now)}, lies on a branch "
                         "that does not attract: the largest real part of an eigenvalue of g_y is "
                         f"{0.0 - rate:.6g} there{_advice(formulas, '; move it off')}")
    return (branch if rate > 0 else None), rate


def _advice(formulas, otherwise):
    """Return words on a function of the fast states that is conserved where g_y is singular everywhere, or others."""
    if is_zero(formulas.slopes.det(method="berkowitz")):
        return ": g_y is singular everywhere, as a function of the fast states changes slowly; make it a slow state"
    return otherwise


def _is_at_rest(formulas, x, y, values):
    """Tell whether g is 0 to the rounding of its terms."""
    with suppress(ArithmeticError, ValueError):
        force, terms = (formulas.force(*x, *(k * v for v in y), *values) for k in (1, 2))
        return max(map(abs, force)) <= ROUNDED * max(map(abs, terms))
    return False


def _reached(found):
    return found[-1].after if found else 0.0


def _at(formulas, x):
    """Return " at state = number, ..." of the slow states, if there are any."""
    return f" at {listed(formulas.mode.slow, x)}" if x else ""
