r"""Roots that are known to be alone between two times: Newton's method inside a bracket.

The equation of a fast and a slow exponential is solved for the exponent, ``rate t = log(r(t)/fast)``. This form is
nearly linear in t, however small mu is, so that Newton's method converges quadratically from the first steps. For
arrays ``arrays.motions`` takes such steps by masks, which take forty times as long on one number.
"""

from collections.abc import Callable

from asympk.errors import Undecided
from asympk.numbers import Arithmetic, Number

MOST_STEPS = 400
PATIENCE = 24  # steps after which a long bracket is cut


def smooth_root(
    m: Arithmetic, value_and_slope: Callable[[Number], tuple[Number, Number]], lo: Number, hi: Number, sign_hi: Number,
    guess: Number | None = None,
) -> Number:
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


def fast_slow_root(
    m: Arithmetic, terms: tuple[Number, ...], lo: Number, hi: Number, sign_hi: Number, guess: Number | None
) -> Number:
    r"""Return the root in (lo, hi) of ``start + k t + fast (e^{rate t} - 1) + slow (e^{slow_rate t} - 1)``.

    ``terms`` are (start, base, k, fast, rate, slow, slow_rate), with ``base = start - fast``, which may cancel. The
    fast part balances the rest r(t) = -(base + k t + slow (e^{slow_rate t} - 1)). The step is Newton's for ``rate t =
    log(r/fast)`` where the fast part changes by e or more, Newton's for r where r must change its sign first, else
    Newton's for the whole. Raises ``Undecided``.
    """
    start, base, k, fast, rate, slow, slow_rate = terms
    size = m.log(abs(fast)) if fast else -m.most_exponent
    t = guess if guess is not None and lo < guess < hi else lo
    for n in range(MOST_STEPS):
        p, lost = rate * t, slow * m.expm1(slow_rate * t)
        r, dr = -(base + k * t + lost), -(k + slow_rate * (slow + lost))
        f = fast * m.exp(p if p < m.most_exponent else m.most_exponent)
        value = f - r if not -1 < p < 1 else start + k * t + fast * m.expm1(p) + lost
        if t > 0:
            lo, hi = (lo, t) if (value > 0) == (sign_hi > 0) else (t, hi)
        new = -1
        log_r = m.log(abs(r)) - size if r and fast and (r > 0) == (fast > 0) else 0
        if (not -1 < log_r < 1 or not -1 < p < 1) and log_r and abs(f * rate) > abs(dr):
            slope = rate - dr / r
            new = t + (log_r - p) / slope if slope else -1
        elif not fast or (r > 0) == (fast > 0) or abs(f) <= abs(r):
            slope = f * rate - dr
            new = t - value / slope if slope else -1
        elif rate < 0 and abs(r) > m.root_tol * t * abs(dr):
            new = t - r / dr if dr else -1
        if abs(new - t) <= m.root_tol * t:
            return new
        if n > PATIENCE and hi > 4 * lo:
            new = _middle(m, lo, hi) if lo else hi / m.number(2) ** (n - PATIENCE) ** 2
        elif not lo < new < hi:
            new = _middle(m, lo, hi) if lo else min(hi / 2, 4 / abs(rate))
            if not lo < new < hi:
                return t
        t = new
    raise Undecided


def _middle(m, lo, hi):
    if not lo:
        return hi / 64
    return m.sqrt(lo) * m.sqrt(hi) if 4 * lo < hi else (lo + hi) / 2
