r"""Roots known to be alone between two times: Newton's method inside a bracket.

The equation of a fast and a slow exponential is solved for the exponent, ``rate t = log(r(t)/fast)``: that is nearly
linear in t, however small mu is, so the first steps are quadratic already.
"""

MOST_STEPS = 400


def smooth_root(m, value_and_slope, lo, hi, sign_hi, guess=None):
    """Return the root in (lo, hi) of a function that has the sign ``sign_hi`` at ``hi``."""
    t = guess if guess is not None and lo < guess < hi else (lo + hi) / 2
    for _ in range(MOST_STEPS):
        value, slope = value_and_slope(t)
        if value == 0:
            return t
        if (value > 0) == (sign_hi > 0):
            hi = t
        else:
            lo = t
        new = t - value / slope if slope else -1
        if abs(new - t) <= m.root_tol * t:
            return new
        if not lo < new < hi:
            new = m.sqrt(lo) * m.sqrt(hi) if lo > 0 and hi > 4 * lo else (lo + hi) / 2
            if not lo < new < hi:
                break
        t = new
    return t


def fast_slow_root(m, u, k, fast, rate, slow, slow_rate, lo, hi, sign_hi, guess=None):
    r"""Return the root in (lo, hi) of ``u + k t + fast e^{rate t} + slow e^{slow_rate t}``.

    Where the fast part can balance the rest r(t) = -(u + k t + slow e^{slow_rate t}) the step is Newton's for
    ``rate t = log(r/fast)``; where it cannot, the rest itself must vanish; otherwise the step is that of the whole.
    """
    if fast == 0:
        return smooth_root(m, lambda t: _rest(m, u, k, slow, slow_rate, t), lo, hi, sign_hi)
    positive, rising = fast > 0, sign_hi > 0
    size = m.log(abs(fast))
    t = guess if guess is not None and lo < guess < hi else lo
    for _ in range(MOST_STEPS):
        g = slow * m.exp(slow_rate * t) if t else slow
        r, dr = -(u + k * t + g), -(k + slow_rate * g)
        p = size + rate * t
        f = m.exp(p if p < m.most_exponent else m.most_exponent)
        if not positive:
            f = -f
        if t > 0:
            if (f > r) == rising:
                hi = t
            else:
                lo = t
        new = -1
        if r and (r > 0) == positive and abs(f * rate) > abs(dr):
            slope = rate - dr / r
            new = t + (m.log(abs(r)) - p) / slope if slope else -1
        elif (r > 0) == positive or abs(f) <= abs(r):
            slope = f * rate - dr
            new = t + (r - f) / slope if slope else -1
        elif rate < 0 and abs(r) > m.root_tol * t * abs(dr):
            new = t - r / dr if dr else -1
        if abs(new - t) <= m.root_tol * t:
            return new
        if not lo < new < hi:
            new = m.sqrt(lo) * m.sqrt(hi) if lo > 0 and hi > 4 * lo else (lo + hi) / 2 if lo > 0 else min(
                hi / 2, 4 / abs(rate))
            if not lo < new < hi:
                break
        t = new
    return t


def _rest(m, u, k, slow, slow_rate, t):
    g = slow * m.exp(slow_rate * t)
    return u + k * t + g, k + slow_rate * g
