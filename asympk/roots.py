r"""Roots known to be alone between two times: Newton's method inside a bracket.

The equation of a fast and a slow exponential is solved for the exponent, ``rate t = log(r(t)/fast)``: that is nearly
linear in t, however small mu is, so the first steps are quadratic already.
"""

from asympk.errors import Undecided

MOST_STEPS = 400
LAYER_STEPS = 6


def smooth_root(m, value_and_slope, lo, hi, sign_hi, guess=None):
    """Return the root in (lo, hi) of a function that has the sign ``sign_hi`` at ``hi``."""
    if guess is None:
        value, slope = value_and_slope(lo)
        guess = lo - value / slope if slope else lo
    t = guess if lo < guess < hi else _middle(m, lo, hi)
    allowed = hi - lo
    for _ in range(MOST_STEPS):
        value, slope = value_and_slope(t)
        if value == 0:
            return t
        if (value > 0) == (sign_hi > 0):
            hi = t
        else:
            lo = t
        new = t - value / slope if slope else -1
        step = abs(new - t)
        if step <= m.root_tol * t:
            return new
        if not lo < new < hi or step > allowed:
            new = _middle(m, lo, hi)
            if not lo < new < hi:
                return t
        allowed = abs(new - t) / 4
        t = new
    raise Undecided


def fast_slow_root(m, start, base, k, fast, rate, slow, slow_rate, lo, hi, sign_hi, guess=None):
    r"""Return the root in (lo, hi) of ``start + k t + fast (e^{rate t} - 1) + slow (e^{slow_rate t} - 1)``.

    ``base`` is ``start - fast``, known better than both. A root in the fast layer is found at once; for any other, the
    step is Newton's for the fast exponent, for the whole, or for the rest alone where the rest must change its sign.
    """
    t = None if lo or guess is not None else _layer_root(m, base, k, fast, rate, slow, slow_rate, hi)
    if t is not None:
        return t
    positive, rising = fast > 0, sign_hi > 0
    size = m.log(abs(fast)) if fast else -m.most_exponent
    t = guess if guess is not None and lo < guess < hi else lo
    for _ in range(MOST_STEPS):
        p, q = rate * t, slow_rate * t
        lost = slow * m.expm1(q)
        r, dr = -(base + k * t + lost), -(k + slow_rate * (slow + lost))
        f = fast * m.exp(p if p < m.most_exponent else m.most_exponent)
        value = f - r if not -1 < p < 1 else start + k * t + fast * m.expm1(p) + lost
        if t > 0:
            if (value > 0) == rising:
                hi = t
            else:
                lo = t
        new = -1
        log_r = m.log(abs(r)) - size if r and fast and (r > 0) == positive else 0
        if (not -1 < log_r < 1 or not -1 < p < 1) and log_r and abs(f * rate) > abs(dr):
            slope = rate - dr / r
            new = t + (log_r - p) / slope if slope else -1
        elif not fast or (r > 0) == positive or abs(f) <= abs(r):
            slope = f * rate - dr
            new = t - value / slope if slope else -1
        elif rate < 0 and abs(r) > m.root_tol * t * abs(dr):
            new = t - r / dr if dr else -1
        if abs(new - t) <= m.root_tol * t:
            return new
        if not lo < new < hi:
            new = _middle(m, lo, hi) if lo else min(hi / 2, 4 / abs(rate))
            if not lo < new < hi:
                return t
        t = new
    raise Undecided


def _layer_root(m, base, k, fast, rate, slow, slow_rate, hi):
    r"""Return the root in (0, hi) at which the fast part has changed by a factor of e or more, or None.

    It balances the rest r(t) = -(base + k t + slow (e^{slow_rate t} - 1)): ``rate t = log(r/fast)``.
    """
    t, r, dr = 0, -base, -(k + slow_rate * slow)
    for _ in range(LAYER_STEPS):
        ratio = r / fast if fast else 0
        if not ratio > 0:
            return None
        step = (m.log(ratio) - rate * t) / (rate - dr / r)
        if -m.root_tol * t <= step <= m.root_tol * t:
            return t + step
        t = t + step
        if not 0 < t < hi or -1 < rate * t < 1:
            return None
        lost = slow * m.expm1(slow_rate * t)
        r, dr = -(base + k * t + lost), -(k + slow_rate * (slow + lost))
    return None


def _middle(m, lo, hi):
    if not lo:
        return hi / 64
    return m.sqrt(lo) * m.sqrt(hi) if 4 * lo < hi else (lo + hi) / 2
