r"""The closed forms of a mode for arrays of starts and parameters: those of ``flow``, on arrays of one length.

``fastslow`` and ``superposition`` compute with the functions of NumPy, in the precision of the numbers. Masks choose
the formula of each row, so that no row depends on the others. ``bracketed_roots``, the hard function, finds roots that
are known to be alone in their brackets, by Newton's method. ``flow.roots`` does so by branches for one number, on which
masks take forty times as long.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from asympk.numbers import Number
from asympk.systems.painleve_klein.flow.fastslow import FastSlowSegment
from asympk.systems.painleve_klein.flow.superposition import (
    SmoothSegment,
    moved_to_level,
    moved_to_plane,
    short_responses,
    superposed,
)

MOST_STEPS = 400  # of Newton's method
AT_REST = 1e-5  # relative distance in t from the root of the rest r at which its own step ends
REFINED = 1e-9  # a Newton step, in units of the time scale, beyond which a second one follows


class ArrayArithmetic:
    """NumPy as the object ``m`` of a flow, for arrays of one type of numbers."""

    exp, expm1, log, log1p, sqrt = np.exp, np.expm1, np.log, np.log1p, np.sqrt
    sin, cos, atan2, pi, inf = np.sin, np.cos, np.arctan2, np.pi, np.inf
    least, most, any = np.minimum, np.maximum, staticmethod(np.any)
    soon = 0.125

    def __init__(self, dtype: Any):
        self.eps, self.most_exponent = np.finfo(dtype).eps, np.log(np.finfo(dtype).max) - 10

    @staticmethod
    def choose(condition: np.ndarray, yes: Callable, no: Callable, *given: np.ndarray) -> np.ndarray:
        """Return ``yes(*given)`` in the rows where the condition holds, and ``no(*given)`` in the others."""
        return np.where(condition, yes(*given), no(*given))


arithmetic_of = lru_cache(maxsize=4)(ArrayArithmetic)


@lru_cache(maxsize=8)
def _fields(kind):
    return tuple(name for base in kind.__mro__ for name in getattr(base, "__slots__", ()))


def _picked(whole, rows):
    part = object.__new__(type(whole))
    for name in _fields(type(whole)):
        value = getattr(whole, name)
        setattr(part, name, value[rows] if isinstance(value, np.ndarray) else value)
    return part


class Segments(SmoothSegment):
    """The motions from (x0, y0, s0, z0) in a mode whose coefficient ``a`` is one number; all else are arrays."""

    __slots__ = ()

    def rows(self, which: np.ndarray) -> "Segments":
        """Return the motions of some rows, in order and each once."""
        if which.dtype == bool:
            which = np.flatnonzero(which)
        if which.size == self.x0.size:
            return self
        part = _picked(self, which)
        part.mode = _picked(self.mode, which)
        return part

    def on_level(self, level: Number, t: Number) -> tuple[np.ndarray, ...]:
        """Return the state at the times t at which s is ``level``."""
        return moved_to_level(self.mode, self.state(t), level)

    def on_plane(self, t: Number) -> tuple[np.ndarray, ...]:
        """Return the state at the times t at which z = 0."""
        return moved_to_plane(self.mode, self.state(t))

    def refined(self, t: Number, axis: int, level: Number, again: bool = True) -> np.ndarray:
        """Return the times at which s (axis 2) or z (axis 3) is ``level``, by Newton's method from close times t."""
        value, rate = self.off(axis, level, t)
        step, pace = value / rate, np.abs(self.mode.beta)
        t = t - step
        far = np.flatnonzero(again & (np.abs(step) * (pace + np.sqrt(pace)) > REFINED))
        if far.size:
            t[far] = self.rows(far).refined(t[far], axis, level[far], again=False)
        return t

    def root(self, axis: int, level: Number, lo: Number, hi: Number, rising: np.ndarray) -> np.ndarray:
        """Return the times in (lo, hi) at which s (axis 2) or z (axis 3) is ``level``; it rises there if ``rising``."""

        def step(rows, t):
            value, rate = self.rows(rows).off(axis, level[rows], t)
            return value > 0, np.where(value == 0, t, t - value / rate)

        return bracketed_roots(step, lo, hi, rising, (lo + hi) / 2)

    def _soon(self, t):
        """Return the rows at short times, and their responses from the Taylor series."""
        soon = np.flatnonzero((t < self.short) | (t == 0))
        return soon, short_responses(self.mode.m, self.mode.beta[soon], t[soon])


class SeparateSegments(FastSlowSegment, Segments):
    """Two well separated real exponentials, as in ``flow.fastslow``."""

    __slots__ = ()

    def turning(self) -> np.ndarray:
        """Return the times after 0 at which s has its extremum, or inf."""
        t = self.extremum()
        return np.where(t > 0, t, np.inf)

    def state(self, t: Number) -> tuple[np.ndarray, ...]:
        """Return (x, y, s, z, mu y') at t."""
        p = self.mode.fast_rate * t
        state = self.joined(t, self.fast * np.exp(p), self.fast * np.expm1(p))
        soon, responses = self._soon(t)
        if soon.size:
            for values, early in zip(state, superposed(self.rows(soon), t[soon], responses), strict=True):
                values[soon] = early
        return state

    def root(self, axis: int, level: Number, lo: Number, hi: Number, rising: np.ndarray) -> np.ndarray:
        step = balance_steps(*self.balance(axis, level))
        start = np.maximum(lo, self.short)
        found = bracketed_roots(step, start, hi, rising, start, 4 / np.abs(self.mode.fast_rate))
        soon = self._early(axis, level, lo, hi, rising)
        if soon.any():
            ends = np.minimum(hi, self.short)
            found[soon] = Segments.root(self.rows(soon), axis, *(v[soon] for v in (level, lo, ends, rising)))
        return found

    def _early(self, axis, level, lo, hi, rising):
        """Tell where the root is at a short time, at which the exponentials nearly cancel."""
        if not (lo < self.short).any():
            return np.zeros(lo.size, bool)
        return (lo < self.short) & ((hi <= self.short) | ((self.state(self.short)[axis] > level) == rising))


class SmoothSegments(Segments):
    """Superposed responses, as in ``flow.superposition``, where exponentials are complex, coalesce or degenerate."""

    __slots__ = ()

    def horizon(self, until: Number) -> np.ndarray:
        """Return ``until``, or the earlier time at which a growing part would overflow."""
        most, tail = self.mode.m.most_exponent - 300, self.mode.tail
        return np.where(self.mode.real & (tail * until > most), most / tail, until)

    def responses(self, t: Number) -> tuple[np.ndarray, ...]:
        """Return (g', g, h, h + H) at t."""
        found = self.mode.responses(t)
        soon, early = self._soon(t)
        for values, value in zip(found, early, strict=True):
            values[soon] = value
        return found


def bracketed_roots(
    step: Callable, lo: Number, hi: Number, rising: np.ndarray, t: Number, first: Number = np.inf
) -> np.ndarray:
    """Return the root in each (lo, hi) of functions that are positive at ``hi`` where ``rising``, negative elsewhere.

    ``step(rows, t)`` returns, for the functions ``rows``, whether they are positive at ``t``, and the next iterate of
    Newton's method or NaN. An iterate outside the bracket is replaced by a cut of the bracket: the geometric mean of a
    long bracket, the middle of others, and at most ``first`` where ``lo`` is 0. A root that is not found is NaN.
    """
    found = t.copy()
    rows, first = np.arange(t.size), np.broadcast_to(first, t.shape)
    close = np.sqrt(np.finfo(t.dtype).eps) / 16
    for _ in range(MOST_STEPS):
        if not rows.size:
            break
        positive, new = step(rows, t)
        beyond, inside = positive == rising, t > lo
        hi, lo = np.where(beyond & inside, t, hi), np.where(beyond | ~inside, lo, t)
        done = np.abs(new - t) <= close * t
        outside = ~(done | ((lo < new) & (new < hi)))
        if outside.any():
            new = np.where(outside, _cut(lo, hi, first), new)
            stuck = outside & ~((lo < new) & (new < hi))
            new, done = np.where(stuck, t, new), done | stuck
        found[rows], t = new, new
        if done.any():
            on = np.flatnonzero(~done)
            rows, t, lo, hi, rising, first = (v[on] for v in (rows, t, lo, hi, rising, first))
    found[rows] = np.nan
    return found


def _cut(lo, hi, first):
    far = (lo > 0) & (hi > 4 * lo)
    return np.where(far, np.sqrt(lo) * np.sqrt(hi), np.where(lo > 0, (lo + hi) / 2, np.minimum(hi / 2, first)))


def balance_steps(
    start: Number, base: Number, k: Number, fast: Number, rate: Number, slow: Number, slow_rate: Number
) -> Callable:
    r"""Return the ``step`` for ``start + k t + fast (e^{rate t} - 1) + slow (e^{slow_rate t} - 1)``.

    ``base`` is start - fast. Where the fast part can balance the rest r(t) = -(base + k t + slow (e^{slow_rate t} - 1))
    and is steeper, the step is Newton's for ``rate t = log(r/fast)``. Where r has the wrong sign and
    is smaller than the fast part, r must vanish first: the step is Newton's for r, NaN near it or if rate > 0.
    Otherwise the step is Newton's for the whole. While the fast part has changed little, its change is balanced
    instead of its value, since large terms would cancel.
    """
    side, size = np.sign(fast), np.log(np.abs(fast))

    def step(rows, t):
        share, pace, turn, weight = fast[rows], rate[rows], slow_rate[rows], slow[rows]
        p, lost = pace * t, weight * np.expm1(turn * t)
        way = k[rows] * t + lost
        gain, r, dr = -(start[rows] + way), -(base[rows] + way), -(k[rows] + turn * (weight + lost))
        little = np.abs(gain) < 0.6 * np.abs(share)
        f = share * np.exp(p)
        over, log = f - r, np.log(np.abs(r)) - size[rows]
        if little.any():
            r = np.where(little, share + gain, r)
            over = np.where(little, share * np.expm1(p) - gain, over)
            log = np.where(little, np.log1p(gain / share), log)
        new = t + (log - p) / (pace - dr / r)
        can = side[rows] * r > 0
        by_log = can & (np.abs(f * pace) > np.abs(dr))
        if not by_log.all():
            far = (pace < 0) & (np.abs(r) > AT_REST * t * np.abs(dr))
            whole, alone = t - over / (f * pace - dr), np.where(far, t - r / dr, np.nan)
            new = np.where(by_log, new, np.where(can | (np.abs(f) <= np.abs(r)), whole, alone))
        return over > 0, new

    return step
