r"""Branch-free kernels of the exact flow over arrays, for a fast and a slow exponential that are well apart.

In the mode ``mu y' = a - b s``, with k = mu/b, rho = (1 + sqrt(1-4k))/2, fast = -rho/k, slow = -1/rho,

    x = a/b + A e^{slow t} + (w/(fast - slow)) e^{fast t},    w = y - slow (x - a/b) at t = 0,

and s and z are sums of the same exponentials. So an event is the root of

    F e^{fast t} = R(t),    R(t) = R(0) - drift t - p (e^{slow t} - 1),

and Newton's method for ``fast t = log(R/F)`` is quadratic from its first step: fast is large, log R nearly constant.
The fast exponential is then R/F, which no rounding of an exponent can spoil.

No element of an array has a say in what is done with another, so a trajectory does not depend on its neighbours.
Where a kernel does not apply it gives NaN.
"""

from typing import Any, NamedTuple

import numpy as np

MOST_STEPS = 8
TIME_ERROR = 8e-17
LOG_ERROR = 1e-13
VANISHED = -746.0


class Mode(NamedTuple):
    """Constants of one mode: floats, or arrays of one length."""

    rest: Any
    fast: Any
    slow: Any
    lag: Any
    to_x: Any
    to_s: Any
    to_z: Any
    bend: Any


def mode(a, b, mu):
    r"""Return the mode ``mu y' = a - b s``, for mu/b < 1/4.

    ``lag`` is 1 + slow = 1/(1 + fast); ``to_x``, ``to_s``, ``to_z`` take w to the fast parts of x, s, z; ``bend`` is
    mu (b-1)/b, which makes ``z = z0 + (a/b) t + bend (y - y0)``.
    """
    k = mu / b
    root = np.sqrt(1 - 4 * k)
    rho = (1 + root) / 2
    lag = -k / (rho * rho)
    to_x = -k / root
    return Mode(a / b, -rho / k, -1 / rho, lag, to_x, to_x / lag, (b - 1) * (rho * k / root), k * (b - 1))


def deviation(m, x, y):
    """Return w, by which y is off the slow line."""
    return y - m.slow * (x - m.rest)


def velocity_zero(m, x, y, z):
    """Return (t, x, y) where z = 0 is reached by the fast part."""
    off = x - m.rest
    w = y - m.slow * off
    slow_x = off - m.to_x * w
    t = _time_of_zero(m, m.to_z * w, z, slow_x)
    gained = (z + m.rest * t) * (1 / m.bend)
    lost = slow_x * np.expm1(m.slow * t)
    return t, x + lost * (1 - m.slow / m.fast) - gained * (1 / m.fast), y - gained


def force_zero(m, x, y, s):
    """Return (t, x) where s = x + y = 0 is reached by the fast part; there y = -x."""
    off = x - m.rest
    w = y - m.slow * off
    slow_x = off - m.to_x * w
    t = _time_of_load(m, m.to_s * w, -m.rest, m.lag * slow_x)
    return t, x + slow_x * np.expm1(m.slow * t) * (1 - m.lag * m.lag) - s * m.lag


def release(m, x, y, edge):
    """Return (t, x) where sticking ends, at s = ``edge``."""
    w = y - m.slow * x
    slow_x = x - m.to_x * w
    t = _time_of_load(m, m.to_s * w, edge, m.lag * slow_x)
    return t, m.lag * edge + (1 - m.lag * m.lag) * (slow_x * np.exp(m.slow * t))


def slide(m, x, y, slow_x, left):
    """Return (x, y) at the end of the time ``left`` in a stable mode, and the way that z has come."""
    end = slow_x * np.exp(m.slow * left)
    end_x, end_y = m.rest + end, m.slow * end
    decay = m.fast * left
    if np.any(decay > VANISHED):
        fast_x = (x - m.rest - slow_x) * np.exp(decay)
        end_x, end_y = end_x + fast_x, end_y + m.fast * fast_x
    return end_x, end_y, m.rest * left + m.bend * (end_y - y)


def slow_part(m, x, s):
    """Return the slow part of x - a/b where x + y is the number ``s``."""
    return x * (1 + m.to_x * m.lag) - (m.rest + m.to_x * (s + m.slow * m.rest))


def _time_of_zero(m, fast, z, slow_x):
    """Solve z = 0: Newton's step from t = 0, corrected for the turn u of log R to third order; more steps if need be.

    What is left is of the order of u^4, and of the slow part's own turn.
    """
    rest = fast - z
    falling = (m.bend * m.slow * m.slow) * slow_x
    bent = (m.rest + falling) / rest
    slope = m.fast + bent
    t = np.log(rest / fast) / slope
    turn = bent * t
    square = turn * turn
    doubt = _doubt(m)
    late = np.flatnonzero((square > np.sqrt(doubt)) | (np.abs(turn * falling * t) > doubt * np.abs(m.rest)))
    t = t - square * (0.5 + turn * (1 / 3)) / slope
    if late.size:
        t[late] = _newton(*pick(late, m.fast, m.slow, fast, rest, m.rest, falling * (1 / m.slow), t, doubt))
    return t


def _time_of_load(m, fast, level, slow):
    """Solve s = a/b + level: Newton's step from t = 0, and more steps where it may not do."""
    rest = level - slow
    bent = m.slow * slow / rest
    t = np.log(rest / fast) / (m.fast + bent)
    doubt = _doubt(m)
    late = np.flatnonzero(np.abs(bent * t * t) > doubt)
    if late.size:
        t[late] = _newton(*pick(late, m.fast, m.slow, fast, rest, None, slow, t, doubt))
    return t


def _doubt(m):
    """Return by how much ``fast t - log(R/F)`` may be off: as much as shows neither in the state nor in the time."""
    return np.minimum(TIME_ERROR * np.abs(m.fast), LOG_ERROR)


def _newton(fast_rate, slow_rate, fast, rest, drift, slow, t, doubt, steps=MOST_STEPS):
    kept = slow * np.exp(slow_rate * t)
    now, falling = (rest + slow) - kept, slow_rate * kept
    if drift is not None:
        now, falling = now - drift * t, falling + drift
    bent = falling / now
    step = (fast_rate * t - np.log(now / fast)) / (fast_rate + bent)
    t = t - step
    step *= bent
    late = np.flatnonzero(step * step > doubt)
    if late.size:
        again = pick(late, fast_rate, slow_rate, fast, rest, drift, slow, t, doubt)
        t[late] = _newton(*again, steps - 1) if steps else np.nan
    return t


def pick(rows, *values):
    """Return the rows of those of the values that are arrays, the others as they are."""
    return [value[rows] if isinstance(value, np.ndarray) else value for value in values]
