r"""The reduced flow x' = F(x, mu) on a slow manifold, a flow that is not stiff.

``follow_reduced_flow`` integrates x together with the value b of the branch, where b' = -g_y^-1 g_x x', so that no
closed form of b is needed. Where g is affine in the fast states, b is a function of x and is not integrated.
``side_by_side`` integrates the flows to several orders: their differences are the terms that the lower orders omit.

The manifold is lost where ``margin`` <= 0. With r the largest real part of an eigenvalue of g_y, this is where

    r >= 0,    mu |d log|det g_y| / dt| >= |r|,    4 mu |h_x f_y| >= |r|    or    mu sqrt(27 |h_x f_x f_y| / 4) >= |r|.

The first is a loss of attraction. In the second g_y changes within its own relaxation time, as at a distance of order
mu^(2/3) before a fold. In the last two fast and slow rates meet, as where a node turns into a focus. The size of a
matrix is sqrt(sum |m_ij m_ji|), so that no condition depends on the units of the states.
"""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial, reduce
from itertools import starmap
from typing import Any, NamedTuple

import numpy as np

from asympk.asymptotics.fibre import Formulas
from asympk.asymptotics.landing import ROOT, abscissas, newton, rightmost, root
from asympk.asymptotics.nonstiff import EXPONENT, Trajectory, on_cubic, rates, steps
from asympk.asymptotics.stiff import jacobian
from asympk.asymptotics.watching import watched
from asympk.automaton.exponentials import exponentials, running_products
from asympk.automaton.numericmode import LOOKS, on_hermite
from asympk.errors import NotNormallyHyperbolic, OutOfRange
from asympk.numbers import listed

STEPS = 20000  # the most steps of a slow motion, in explicit ones
MORE, FEWEST = 10, 50  # the most steps of flows side by side over those of one alone, of which so many count at least
FAR = 1e12
ROUNDING = 50  # the error of the integrations in units of their tolerance, where errors do not grow
SIDE_BY_SIDE = 1e-6  # the least tolerance of slow motions to several orders in common steps
MEETING = 4  # mu y' = g, linear, and x' = y have real eigenvalues as long as 4 mu |h_x f_y| < |g_y|
FORGOTTEN = 1e-6  # the share of a term, as the error that it is at a later time, that counts as 0
AT_ONCE = 7  # the number of intervals of time after which, as a rule, the rest is forgotten
LONG = 1 / 32  # the share of a run beyond which the manifold is looked at within a step
SHARES = np.arange(1, 64) / 64  # of such a step, at which it is looked at there
_UNITS = ((1, 0, 0, 0), (0, 1, 0, 0)), ((0, 0, 1, 0), (0, 0, 0, 1))
CUBIC = np.array(on_hermite(SHARES, 1.0, *_UNITS))  # what the states and the rates at its ends count for there
LOST = 0.5  # the error relative to a state from which it does not fade as a small one does
NOISE = 1e-12  # the size of a state, relative to that by the terms of its rate, below which it is rounding
WITHIN = 65  # the number of times at which the attraction beside a layer is looked at
TWICE = 2 ** (-1 / EXPONENT)  # the ratio of the errors of steps twice as long
AGAIN = math.sqrt(27 / 4)  # with x'' = y, as long as mu sqrt(27 |h_x f_x f_y| / 4) < |g_y|


class ErrorGrowth(NamedTuple):
    """The errors of a motion whose start and steps are wrong by the largest moduli of the states, ``sizes``.

    ``kept`` is the matrix by which an error of x at the start grows to the end, ``made`` has the errors there, and
    ``most`` is the largest one at any time, in units of ``sizes``.
    """

    kept: np.ndarray
    made: np.ndarray
    most: float
    sizes: np.ndarray


@dataclass(frozen=True)
class Reduced:
    """The reduced flows of all ``kinds``: ``trajectory`` holds the points (x, b) of each, one after the other.

    A kind is (order, whole): if ``whole``, a motion has all powers of mu that the fast states bring into the rates.
    ``guard`` is the index of the guard that is lost at the time ``end``, or None. ``least`` is the least ``margin``
    that was looked at.
    """

    formulas: Formulas
    kinds: tuple[tuple[int, bool], ...]
    mu: float
    values: tuple
    end: float
    guard: int | None
    trajectory: Trajectory = field(repr=False)
    least: float = math.inf

    def states(self, t: Any) -> np.ndarray:
        """Return x and y on the manifold at the array ``t`` of times for every order: (orders, states) + t.shape."""
        t = np.asarray(t, dtype=float)
        motion: Any
        spread: Callable
        if t.size == 1:
            motion, known, spread = self.trajectory.state_at(t.item()), self.formulas, float
        else:
            motion, known = self.trajectory(t.ravel()), self.formulas.arrays
            spread = partial(np.broadcast_to, shape=t.size)
        slow = len(self.formulas.slow_states)
        found = [[*point[:slow], *map(spread, known.height(*kind)(*point, self.mu, *self.values))]
                 for kind, point in zip(self.kinds, self.parts(motion), strict=True)]
        return np.array(found).reshape(len(found), len(found[0]), *t.shape)

    def fading(self, t: float) -> np.ndarray:
        """Return the matrix that takes small departures from the manifold at the start to those at ``t``.

        It is the product of exp(int D dt / mu) over short times beside the last of the motions, D the matrix by which a
        departure changes. What mu adds to D counts: over a time of order 1 it changes a layer by a factor.
        """
        times, size = np.linspace(0, t, WITHIN), len(self.formulas.fast_states)
        points = np.array([self.parts(self.trajectory.state_at(at))[-1] for at in times.tolist()]).T
        with np.errstate(all="ignore"):
            entries = self.formulas.arrays.departure(*points, self.mu, *self.values)
        found = np.stack(np.broadcast_arrays(*entries, times)[:-1], axis=1).reshape(-1, size, size)
        found = np.where(np.isfinite(found), found, 0.0) * (times[1] / self.mu)
        parts = exponentials((found[:-2:2] + 4 * found[1:-1:2] + found[2::2]) / 3)  # by Simpson's rule
        return reduce(lambda kept, part: part @ kept, parts)

    @cached_property
    def recent(self) -> tuple[list[tuple], np.ndarray]:
        """The ``memory`` at the end."""
        return self.memory(self.end)

    def memory(self, t: float) -> tuple[list[tuple], np.ndarray]:
        """Return points (x, b) of a single motion at ``t`` and before, and the shares of y between them left in y(t).

        With A = g_y the error e of y, and the first term T that y omits, obey mu e' = A (e - T), so that at t

            e = int T(s) dK(s) = T(t) + int (T(s) - T(t)) dK(s),    K(s) = exp(int_s^t A / mu).

        A share is |K(b) - K(a)|, entry by entry, over an interval from a to b. Its points are those of the ends of the
        interval. The intervals are the halves of those that end 1, 2, 3, 5, 8, ... relaxation times before t, until
        less than ``FORGOTTEN`` is left of K, or at the start: what is left there is the last share. The shares are an
        array (intervals times fast states, fast states).
        """
        points, times, end, further = [self.trajectory.state_at(t)], [t], 1, 2
        slopes, p, size = self.formulas.attraction, (self.mu, *self.values), len(self.formulas.fast_states)
        rates, kept = [slopes(*points[0], *p)], np.eye(size)[None]
        pace, left = self.mu / rightmost(rates[0]).real, 1.0
        while times[-1] > 0 and left > FORGOTTEN:
            times = times[-1:]
            while times[-1] > 0 and len(times) <= 2 * AT_ONCE:
                before = max(0.0, t + end * pace)
                times += [(before + times[-1]) / 2, before]
                end, further = further, end + further
            points += map(self.trajectory.near, times[1:])
            rates = [*rates[-1:], *(slopes(*at, *p) for at in points[1 - len(times) :])]
            halves = self._attraction_over(times, np.array(rates).reshape(-1, size, size))
            kept = np.concatenate([kept[:-1], running_products(np.concatenate([kept[-1:], exponentials(halves)]))])
            left = np.maximum.reduce(np.abs(kept[-1]), axis=None)
        kept = np.concatenate([kept, np.zeros_like(kept[:1])])
        return [*points, points[-1]], np.abs(kept[1:] - kept[:-1]).transpose(0, 2, 1).reshape(-1, size)

    def _attraction_over(self, times: list[float], found: np.ndarray) -> np.ndarray:
        """Return the integrals of g_y/mu over the halves of intervals: (halves, fast states, fast states).

        The ``times``, and the matrices ``found`` there, alternate between ends and middles of the intervals, backward
        in time. In an interval g_y is taken as a parabola.
        """
        after, middle, before = found[:-2:2], found[1:-1:2], found[2::2]
        ends, halves = np.array(times[::2]), np.empty((len(middle), 2, *found.shape[1:]))
        halves[:, 0], halves[:, 1] = 5 * after + 8 * middle - before, 5 * before + 8 * middle - after
        halves *= ((ends[:-1] - ends[1:]) / (24 * self.mu))[:, None, None, None]
        return halves.reshape(-1, *found.shape[1:])

    def remembered(self, t: float, orders: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return the first term of y that each order omits at ``t``, and what the error there remembers of its changes.

        Both are moduli: (orders, fast states). The orders are successive. Over an interval the change until ``t``
        counts as the larger one of its ends.
        """
        (points, shares), p = self.recent if t == self.end else self.memory(t), (self.mu, *self.values)
        first, known = orders[0] + 1, self.formulas.terms(orders[-1] + 1)
        found = np.array([known(*at, *p)[first:] for at in points])[:, :, : shares.shape[1]]
        changes = np.abs(found - found[0])
        largest = np.maximum(changes[:-1], changes[1:]).transpose(1, 0, 2)
        return np.abs(found[0]), largest.reshape(len(orders), -1) @ shares

    def errors(self, rtol: float) -> np.ndarray:
        """Return the errors of x and y at the end of a single motion whose start and steps are right to ``rtol``.

        They are 0 where errors never grow to more than ``ROUNDING`` times those of a step.
        """
        if self.grown.most <= ROUNDING:
            return np.zeros(len(self.formulas.states))
        return self.spread(self.made(rtol))

    def made(self, rtol: float) -> np.ndarray:
        """Return the errors of the point (x, b) at the end of a single motion whose start and steps are to ``rtol``.

        Errors that were as large as the states at a time before need not fade as small ones do. Those of many steps
        that err alike, as the phase of an oscillation drifts, are told by a motion of steps twice as long.
        """
        _, made, most, sizes = self.grown
        drift = self._drift(rtol) if most > ROUNDING else 0.0
        return rtol * np.maximum(made, most * sizes if rtol * most > LOST else 0.0) + drift

    def spread(self, off: np.ndarray) -> np.ndarray:
        """Return the errors of x and y at the end of a single motion where those of the point (x, b) are ``off``."""
        at, p = self.trajectory.state_at(self.end), (self.mu, *self.values)
        height, slow = self.formulas.height(0), len(self.formulas.slow_states)
        try:
            y = height(*at, *p)
            moved = [height(*at[:k], at[k] + w, *at[k + 1 :], *p) for k, w in enumerate(off.tolist())]
        except (ArithmeticError, ValueError):
            return np.full(len(self.formulas.states), math.inf)
        found = np.array([*off[:slow], *(sum(abs(v[i] - w) for v in moved) for i, w in enumerate(y))])
        return np.nan_to_num(found, nan=math.inf)

    def _drift(self, rtol: float) -> np.ndarray:
        """Return the change of the end of a single motion by steps twice as long, over the ratio of both errors.

        It is 0 where these do not reach the end.
        """
        at, within = self.trajectory.state_at(self.end), 2 * max(step.after - step.t for step in self.trajectory.steps)
        start, rough = self.trajectory.start, rtol * TWICE
        found = [*_steps(self.formulas, self.kinds, start, self.mu, self.values, self.end, rough, within)]
        reached = found[-1].end if found and found[-1].after >= self.end else at
        return np.abs(np.subtract(reached, at)) / TWICE

    @cached_property
    def grown(self) -> "ErrorGrowth":
        """The growth of the errors of the point (x, b) along a single motion.

        An error e obeys e' = J e, with J the Jacobian matrix of the flow: over a step h it grows by exp(J h), J in the
        middle, and that of a single state as its rate, as long as each step moves it by more than its errors. Errors
        of several steps add in squares.
        """
        steps = self.trajectory.steps
        sizes = np.abs([self.trajectory.start, *(step.end for step in steps)]).max(axis=0)
        if len(sizes) == 1 and _moves(steps):
            return _grown_singly(steps, sizes)
        moved = self._moved()
        terms = np.abs(moved).sum(axis=0) @ sizes  # of a rate, which may cancel: then the size of the state is rounding
        sizes = np.where((sizes > 0) & (sizes < NOISE * terms), terms, sizes)
        kept, squares = self._on_branch(), [made := np.diag(sizes**2)]
        with np.errstate(all="ignore"):
            for part in exponentials(moved) if moved.size else moved:
                kept = part @ kept
                squares.append(part @ squares[-1] @ part.T + made)
            errors = np.sqrt(np.diagonal(squares, axis1=1, axis2=2))
            most = float(np.fmax.reduce(errors / sizes, axis=None, initial=1.0, where=sizes > 0))
        return ErrorGrowth(kept, errors[-1], most, sizes)

    def _on_branch(self):
        """Return the derivatives of the point (x, b) by x at the start, on the branch: 1 and -g_y^-1 g_x."""
        slow, first = len(self.formulas.slow_states), self.trajectory.start
        found = np.eye(len(first), slow)
        with suppress(ArithmeticError, ValueError):
            if len(first) > slow:
                slopes = jacobian(lambda w: self.formulas.complexes.force(*w, *self.values), first)
                found[slow:] = -np.linalg.solve(slopes[:, slow:], slopes[:, :slow])
        return found

    def _moved(self):
        """Return J h for every step, or 0 where a rate has no derivative."""
        flow, p = self.formulas.complexes.flow(*self.kinds[0]), (self.mu, *self.values)
        steps, width = self.trajectory.steps, len(self.trajectory.start)
        moved = np.zeros((len(steps), width, width))
        with suppress(ArithmeticError, ValueError):
            for k, step in enumerate(steps):
                moved[k] = (min(step.after, self.end) - step.t) * jacobian(lambda w: flow(*w, *p), on_cubic(step, 0.5))
        return moved

    def parts(self, motion: Any) -> list[Any]:
        """Return the points (x, b) of the motions to every order, of which ``motion`` consists."""
        width = len(motion) // len(self.kinds)
        return [motion[k * width : (k + 1) * width] for k in range(len(self.kinds))]


def _moves(steps):
    """Tell whether every step moves a single state by more than its errors."""
    return all(abs(step.end[0] - step.state[0]) > steps[0].rtol * (1 + abs(step.end[0])) for step in steps)


def _grown_singly(steps, sizes):
    """Return the growth of errors of a single state, which grow as its rate."""
    kept = made = most = 1.0
    for step in steps:
        part = abs(step.stages[-1][0] / step.stages[0][0])
        kept, made = kept * part, math.hypot(made * part, 1.0)
        most = max(most, made)
    return ErrorGrowth(np.array([[kept]]), made * sizes, most, sizes)


def follow_reduced_flow(
    formulas: Formulas, order: int, start: np.ndarray, mu: float, values: tuple, until: float, rtol: float = 1e-12,
    guards: Callable | None = None, began: float = 0.0, within: float = math.inf, whole: bool = False,
) -> Reduced:
    """Integrate the flow to ``order`` from ``start``, the point (x, b) of ``Formulas.on_branch``.

    ``guards(t, point)`` returns the guards of a mode at a point (x, b); the integration ends where a guard becomes
    negative. No step is longer than ``within``. Raises ``NotNormallyHyperbolic`` where the manifold is lost and
    ``OutOfRange`` where the states grow beyond bounds; both name the state reached and the time since ``began``.
    """
    first, found, end, guard = tuple(map(float, start)), list[Any](), until, None
    left: list[float] = []
    check = partial(_check, formulas, mu, values, guards, began, left)
    check(None, 0.0, first)
    kinds = ((order, whole),)
    along = _steps(formulas, kinds, first, mu, values, until, rtol, within)
    for step, lost in watched(_held(along, check), guards, len(first)):
        found.append(step)
        if lost:
            end, guard = lost
            break
    _look_within(formulas, mu, values, found, end, check)
    if first:
        _require_reached(formulas, order, first, found, mu, values, end, rtol, guards, began)
    return Reduced(formulas, kinds, mu, values, end, guard, Trajectory(first, tuple(found)), min(left))


def side_by_side(
    formulas: Formulas, orders: tuple[int, ...], starts: Sequence[np.ndarray], mu: float, values: tuple, until: float,
    rtol: float, began: float = 0.0, within: float = math.inf, span: float | None = None, *, alone: Reduced,
) -> Reduced:
    """Integrate the flows to several orders in common steps, each from its point of ``starts``.

    ``alone`` is the flow to the first order, which is not watched again; ``span`` is a length of its steps to ``rtol``.
    The errors of the steps nearly cancel in the differences of the flows, so that ``SIDE_BY_SIDE`` over the growth of
    errors bounds the tolerance from below. Steps to this tolerance do not see the differences fade with a state that
    comes to rest: then the flows are integrated again to ``rtol``. The last flow has all powers of mu. Raises
    ``OutOfRange`` where the states grow beyond bounds, or take many more steps than to the first order.
    """
    first, size = tuple(float(v) for start in starts for v in start), len(starts[0])
    kinds = (*((order, False) for order in orders[:-1]), (orders[-1], True))
    rough = max(rtol, SIDE_BY_SIDE / max(1.0, alone.grown.most / ROUNDING))
    most = MORE * (FEWEST + sum(step.cost for step in alone.trajectory.steps))
    for fine in dict.fromkeys((rough, rtol)):
        longer = span and span * (rtol / fine) ** EXPONENT
        found = [*_steps(formulas, kinds, first, mu, values, until, fine, within, longer, most)]
        if not _comes_to_rest(found, size, fine, until):
            break
    if first:
        _require_reached(formulas, orders[0], first[:size], found, mu, values, until, fine, None, began)
    return Reduced(formulas, kinds, mu, values, until, None, Trajectory(first, tuple(found)))


def _comes_to_rest(steps, size, rtol, until):
    """Tell whether one of the first ``size`` states moves in the last step by no more than errors, but did before.

    No step that ends before ``until`` tells of rest: it is short.
    """
    if not steps or steps[-1].after < until:
        return False
    begun, before, last = (state[:size] for state in (steps[0].state, steps[-1].state, steps[-1].end))
    least = [ROUNDING * rtol * (1 + abs(v)) for v in last]
    return any(abs(v - w) <= off < abs(v - u) for u, w, v, off in zip(begun, before, last, least, strict=True))


def _steps(formulas, kinds, first, mu, values, until, rtol, within, span=None, most=STEPS):
    """Yield the steps of the flows of all ``kinds``, side by side, ``most`` of them, as long as they are bounded."""
    if not first:  # no slow states, no slow motion
        return
    flows, parameters = tuple(starmap(formulas.flow, kinds)), (mu, *values)

    def slopes(at):
        return jacobian(partial(rates, tuple(starmap(formulas.complexes.flow, kinds)), parameters), at)

    within = until / LOOKS if formulas.clocked else within
    far = FAR * max(1.0, *map(abs, first))
    atol, left = (rtol,) * len(first), min(most, STEPS)
    along = steps(flows, parameters, first, until, rtol, atol, within=within, slopes=slopes, span=span)
    for step in along:
        if not max(map(abs, step.end)) < far or (left := left - step.cost) < 0:
            return
        yield step


def _require_reached(formulas, order, first, found, mu, values, end, rtol, guards, began):
    """Raise ``OutOfRange`` if the steps ``found`` end before ``end``. The flow to ``order`` starts at ``first``."""
    t, last = (found[-1].after, found[-1].end[: len(first)]) if found else (0.0, first)
    if t >= end:
        return
    if order:  # near the loss of a manifold higher terms are unbounded, and order 0 raises the error
        later = guards and (lambda span, at: guards(t + span, at))
        follow_reduced_flow(formulas, 0, np.array(last), mu, values, end - t, rtol, later, began + t)
    where = _place(formulas, last, formulas.height(0)(*last, mu, *values), began + t)
    raise OutOfRange(f"the reduced flow ends near {where}: its states grow beyond bounds, its steps become too small, "
                     "or it takes too many of them")


def branch_at(
    formulas: Formulas, x: Sequence[float], near: Sequence[float], values: tuple, begun: Sequence[float] | None = None
) -> np.ndarray:
    """Return (x, b), b a root of g found from ``near``, or x where b is not integrated; raises ``OutOfRange``.

    If ``begun`` is given, ``near`` is the branch's value there, and b its value at x.
    """
    b: Sequence[float] | None = ()
    if not formulas.affine:
        b = root(formulas, x, near, values) if begun is None else _carried(formulas, begun, x, near, values)
    if b is None:
        raise OutOfRange(f"the base point {listed(formulas.mode.slow, x)} is off the branch that the layer settles on; "
                         "the small parameter is not small here")
    return np.array(formulas.on_branch(x, b))


def _carried(formulas, begun, x, b, values):
    """Return the value at x of the branch with the value b at ``begun``, or None where the branch ends between.

    The branch is followed in parts so short that the second step of Newton's method is at most half of the first: from
    there the method leads to no other branch.
    """
    done, part = 0.0, 1.0
    while b is not None and done < 1:
        at = [w + min(1.0, done + part) * (v - w) for v, w in zip(x, begun, strict=True)]
        if _contracts(formulas, at, b, values):
            b, done, part = root(formulas, at, b, values), done + part, 2 * part
        elif (part := part / 2) < ROOT:
            return None
    return b


def _contracts(formulas, x, b, values):
    """Tell whether the second step of Newton's method from b is at most half of the first, or mere rounding."""
    first = newton(formulas, x, b, values)
    second = first and newton(formulas, x, [v - s for v, s in zip(b, first, strict=True)], values)
    return bool(second) and math.hypot(*second) <= max(math.hypot(*first) / 2, ROOT * max(1.0, *map(abs, b)))


def margin(formulas: Formulas, state: Sequence[float], mu: float, values: tuple) -> float:
    """Return the rate of attraction of the manifold less its least admissible value, or -inf if undefined."""
    try:
        if formulas.bounded:
            formulas.height(0)(*state, mu, *values)
        turning, once, twice = formulas.slow_rates(*state, mu, *values)
        largest = rightmost(formulas.attraction(*state, mu, *values))
        meeting = max(abs(turning), MEETING * _size(once), AGAIN * math.sqrt(_size(twice)))
        return -largest.real - mu * meeting
    except (ArithmeticError, ValueError):
        return -math.inf


def _size(entries):
    """Return sqrt(sum |m_ij m_ji|) of a square matrix, which is sum |m_ii| for a column times a row."""
    size = math.isqrt(len(entries))
    meeting = (abs(v * entries[size * (k % size) + k // size]) for k, v in enumerate(entries))
    return math.sqrt(sum(meeting)) if size > 1 else abs(entries[0])


def _held(along, check):
    """Yield each step after the check that the manifold is not lost in it, unless a guard is lost before."""
    for step in along:
        check(step, step.after, step.end)
        yield step


def _look_within(formulas, mu, values, steps, end, check):
    """Check the manifold within steps, which may be longer than it repels, or has no value, where none feels this."""
    looks = formulas.turning or formulas.bounded
    long = [step for step in steps if step.after - step.t > LONG * end] if looks else ()
    if not long:
        return
    ends = np.array([(step.state, step.end, step.stages[0], step.stages[-1]) for step in long]).transpose(2, 0, 1)
    ends[:, :, 2:] *= np.array([step.after - step.t for step in long])[:, None]
    point = (ends @ CUBIC).reshape(len(ends), -1)
    unseen = [0.0] * len(formulas.fast_states) if formulas.affine else ()  # g_y does not contain y
    with np.errstate(all="ignore"):
        held = abscissas(formulas, (*point, *unseen, *values)) < 0
        if formulas.bounded:
            y = formulas.arrays.height(0)(*point, mu, *values)
            held = held & np.isfinite(np.broadcast_arrays(*y, point[0])).all(axis=0)
    for k in np.flatnonzero(~held).tolist():
        step, share = long[k // len(SHARES)], SHARES[k % len(SHARES)].item()
        if (t := step.t + share * (step.after - step.t)) < end:
            check(step, t, step.state_at(t))


def _check(formulas, mu, values, guards, began, left, step, high, state):
    """Raise ``NotNormallyHyperbolic`` if the manifold is lost in ``step``, by ``state`` at ``high``, before a guard.

    The margin at ``state`` is added to the list ``left``.
    """
    left.append(margin(formulas, state, mu, values))
    if left[-1] > 0:
        return
    t = 0.0
    if step is not None:
        low = step.t
        while high - low > 1e-12 * max(1, high):
            t = (low + high) / 2
            low, high = (t, high) if margin(formulas, step(t).tolist(), mu, values) > 0 else (low, t)
        state = step(low).tolist()
        if guards is not None and min(guards(low, state), default=0) < 0:
            return
    p = (mu, *values)
    y, largest = formulas.height(0)(*state, *p), rightmost(formulas.attraction(*state, *p))
    small, turns = formulas.small, "a Hopf point" if largest.imag else "a fold"
    why = (f"it attracts at the rate {-largest.real / mu:.6g}, and changes, or the motion on it does, about as fast, "
           f"as before {turns}, or where {small} is not small")
    why = f"{why if largest.real < 0 else 'it does not attract'}; take a smaller until, or a smaller {small}"
    why = "it has no value beyond; take a smaller until" if left[-1] == -math.inf else why
    raise NotNormallyHyperbolic(f"the slow manifold is lost at {_place(formulas, state, y, began + t)}: {why}")


def _place(formulas, state, y, t):
    """Return the time and the states for a message, without those states that equal the time."""
    mode = formulas.mode
    states = zip((*mode.slow.items(), *mode.fast.items()), (*state[: len(mode.slow)], *y), strict=True)
    shown = [(s, v) for (s, rate), v in states if rate != 1 or f"{v:.6g}" != f"{t:.6g}"]
    return f"t = {t:.6g}, {listed(*zip(*shown, strict=True))}"
