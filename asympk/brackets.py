"""Roots known to be alone in their brackets, for arrays: Newton's method inside each, for as long as it needs."""

import numpy as np

MOST_STEPS = 400


def roots(step, lo, hi, rising, t, first=np.inf):
    """Return the root in each (lo, hi) of functions that are positive at ``hi`` where ``rising``, negative elsewhere.

    ``step(rows, t)`` tells of some of the functions whether they are positive at ``t``, and where Newton's method
    goes from there, or NaN. A step that leaves its bracket is replaced by a cut of the bracket, geometric where that
    is long; the first cut of a bracket that starts at 0 is not beyond ``first``.
    """
    lo, hi, found = lo.copy(), hi.copy(), t.copy()
    rows = np.arange(t.size)
    close = np.sqrt(np.finfo(t.dtype).eps) / 16
    for _ in range(MOST_STEPS):
        if not rows.size:
            break
        t = found[rows]
        positive, new = step(rows, t)
        _narrow(lo, hi, rows, t, positive == rising[rows])
        done = np.abs(new - t) <= close * t
        low, high = lo[rows], hi[rows]
        outside = ~done & ~((low < new) & (new < high))
        new = np.where(outside, _cut(low, high, first if np.isscalar(first) else first[rows]), new)
        stuck = outside & ~((low < new) & (new < high))
        found[rows] = np.where(stuck, t, new)
        rows = rows[~(done | stuck)]
    return found


def _narrow(lo, hi, rows, t, beyond):
    inside = t > lo[rows]
    hi[rows[beyond & inside]] = t[beyond & inside]
    lo[rows[~beyond & inside]] = t[~beyond & inside]


def _cut(lo, hi, first):
    far = (lo > 0) & (hi > 4 * lo)
    return np.where(far, np.sqrt(lo) * np.sqrt(hi), np.where(lo > 0, (lo + hi) / 2, np.minimum(hi / 2, first)))


def newton(value_and_slope):
    """Return the ``step`` of Newton's method on the function itself."""

    def step(rows, t):
        value, slope = value_and_slope(rows, t)
        return value > 0, np.where(value == 0, t, t - value / slope)

    return step


def balance(value, u, k, fast, rate, slow, slow_rate):
    r"""Return the ``step`` for ``value + k t + fast (e^{rate t} - 1) + slow (e^{slow_rate t} - 1)``; u is its constant.

    Where the fast part can balance the rest r(t) = -(u + k t + slow e^{slow_rate t}), it is Newton's step for
    ``rate t = log(r/fast)``; where it cannot, the rest itself must vanish; otherwise the step is that of the whole. As
    long as the fast part has changed little, what it gains is balanced instead: sums of large terms would cancel.
    """
    side, size = np.sign(fast), np.log(np.abs(fast))

    def step(rows, t):
        share, pace, turn = fast[rows], rate[rows], slow_rate[rows]
        p, lost = pace * t, slow[rows] * np.expm1(turn * t)
        gain = -(value[rows] + k[rows] * t + lost)
        little = np.abs(gain) < 0.6 * np.abs(share)
        r = np.where(little, share + gain, -(u[rows] + k[rows] * t + slow[rows] + lost))
        dr = -(k[rows] + turn * (slow[rows] + lost))
        f = share * np.exp(p)
        over = np.where(little, share * np.expm1(p) - gain, f - r)
        log = np.where(little, np.log1p(gain / share), np.log(np.abs(r)) - size[rows])
        can = side[rows] * r > 0
        by_log = t + (log - p) / (pace - dr / r)
        whole = t - over / (f * pace - dr)
        alone = np.where(pace < 0, t - r / dr, np.nan)
        new = np.where(can & (np.abs(f * pace) > np.abs(dr)), by_log,
                       np.where(can | (np.abs(f) <= np.abs(r)), whole, alone))
        return over > 0, new

    return step
