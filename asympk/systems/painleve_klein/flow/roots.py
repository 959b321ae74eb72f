r"""Roots that are known to be alone between two times: Newton's method inside a bracket.

The equation of a fast and a slow exponential is solved for the exponent, ``rate t = log(r(t)/fast)``. This form is
nearly linear in t, however small mu is, so that Newton's method converges quadratically from the first steps. For
arrays ``arrays.motions`` takes such steps by masks, which take forty times as long on one number.
"""

from collections.abc import Callable
from math import inf

from asympk.errors import Undecided
from asympk.numbers import Arithmetic, Number

MOST_STEPS = 400
PATIENCE = 24  # steps from which on each must be a quarter of the one before
NOWHERE = -1  # the iterate where Newton's method has none


def bracketed_root(
    m: Arithmetic, step: Callable[[Number], tuple[Number, Number]], lo: Number, hi: Number, sign_hi: Number,
    guess: Number | None = None, first: Number = inf,
) -> Number:
    """Return the root in (lo, hi) of a function that has the sign ``sign_hi`` at ``hi``; raises ``Undecided``.

    ``step(t)`` returns the value at ``t`` and the next iterate of Newton's method, which begins at the ``guess``, or at
    ``lo``. Iterates outside the bracket are replaced by a cut of the bracket, at most ``first`` where ``lo`` is 0.
    """
    t, allowed = guess if guess is not None and lo < guess < hi else lo, hi - lo
    for n in range(MOST_STEPS):
        value, new = step(t)
        if t > lo:
            if value == 0:
                return t
            lo, hi = (lo, t) if (value > 0) == (sign_hi > 0) else (t, hi)
        if abs(new - t) <= m.root_tol * t:
            return new
        if not lo < new < hi or (n > PATIENCE and abs(new - t) > allowed):
            new = _cut(m, lo, hi, first)
            if not lo < new < hi:
                return t
        allowed = abs(new - t) / 4
        t = new
    raise Undecided


def _cut(m, lo, hi, first):
    if not lo:
        return min(hi / 64, first)
    return m.sqrt(lo) * m.sqrt(hi) if 4 * lo < hi else (lo + hi) / 2


def balance_step(m: Arithmetic, terms: tuple[Number, ...], t: Number) -> tuple[Number, Number]:
    r"""Return the value of ``start + k t + fast (e^{rate t} - 1) + slow (e^{slow_rate t} - 1)``, and a next iterate.

    ``terms`` are (start, base, k, fast, rate, slow, slow_rate), with ``base = start - fast``, which may cancel. The
    fast part balances the rest r(t) = -(base + k t + slow (e^{slow_rate t} - 1)). The step is Newton's for ``rate t =
    log(r/fast)`` where the fast part changes by e or more, Newton's for r where r must change its sign first, else
    Newton's for the whole.
    """
    start, base, k, fast, rate, slow, slow_rate = terms
    p, lost = rate * t, slow * m.expm1(slow_rate * t)
    r, dr = -(base + k * t + lost), -(k + slow_rate * (slow + lost))
    f = fast * m.exp(p if p < m.most_exponent else m.most_exponent)
    value = f - r if not -1 < p < 1 else start + k * t + fast * m.expm1(p) + lost
    balances = fast and r and (r > 0) == (fast > 0)
    if balances and abs(f * rate) > abs(dr):
        log_r = m.log(abs(r)) - m.log(abs(fast))
        if log_r and not (-1 < log_r < 1 and -1 < p < 1):
            slope = rate - dr / r
            return value, t + (log_r - p) / slope if slope else NOWHERE
    if not fast or balances or abs(f) <= abs(r):
        slope = f * rate - dr
        return value, t - value / slope if slope else NOWHERE
    return value, t - r / dr if rate < 0 and abs(r) > m.root_tol * t * abs(dr) and dr else NOWHERE
