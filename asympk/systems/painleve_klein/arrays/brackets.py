"""Roots that are known to be alone in their brackets, for arrays: Newton's method, safeguarded by each bracket."""

from collections.abc import Callable

import numpy as np

from asympk.numbers import Number

MOST_STEPS = 400
AT_REST = 1e-5  # relative distance in t from the root of the rest r at which its own step ends


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


def newton_step(value_and_slope: Callable) -> Callable:
    """Return the ``step`` of Newton's method on the function itself."""

    def step(rows, t):
        value, slope = value_and_slope(rows, t)
        return value > 0, np.where(value == 0, t, t - value / slope)

    return step


def balance_step(
    value: Number, u: Number, k: Number, fast: Number, rate: Number, slow: Number, slow_rate: Number
) -> Callable:
    r"""Return the ``step`` for ``value + k t + fast (e^{rate t} - 1) + slow (e^{slow_rate t} - 1)``.

    ``u`` is the constant, value - fast - slow. Where the fast part can balance the rest r(t) = -(u + k t + slow
    e^{slow_rate t}) and is steeper, the step is Newton's for ``rate t = log(r/fast)``. Where r has the wrong sign and
    is smaller than the fast part, r must vanish first: the step is Newton's for r, NaN near it or if rate > 0.
    Otherwise the step is Newton's for the whole. While the fast part has changed little, its change is balanced
    instead of its value, since large terms would cancel.
    """
    side, size = np.sign(fast), np.log(np.abs(fast))

    def step(rows, t):
        share, pace, turn, weight = fast[rows], rate[rows], slow_rate[rows], slow[rows]
        p, lost = pace * t, weight * np.expm1(turn * t)
        way = k[rows] * t + lost
        gain, r, dr = -(value[rows] + way), -(u[rows] + weight + way), -(k[rows] + turn * (weight + lost))
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
