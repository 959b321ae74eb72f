r"""Branch-free kernels of the exact flow over arrays, for a fast and a slow exponential that are well apart.

The motion in a mode is that of ``flow.fastslow``; its deviation from the slow line is w = y - slow (x - a/b) at t = 0.
So an event is the root of

    F e^{fast t} = R(t),    R(t) = R(0) - drift t - p (e^{slow t} - 1),

and Newton's method for ``fast t = log(R/F)`` is quadratic from its first step: fast is large, log R nearly constant.
The fast exponential at the event is then R/F, without the rounding error of an exponent.

Every element of an array is computed independently of the others, so a trajectory does not depend on its neighbours.
Where a kernel does not apply its result is NaN. ``_time_of_zero`` and ``_time_of_load`` find the times of events.
"""

from typing import Any, NamedTuple

import numpy as np

from asympk.numbers import Number
from asympk.systems.painleve_klein.flow.fastslow import two_exponentials

MOST_STEPS = 9  # of Newton's method for an event by the fast part, after its first
DRIFT_STEPS = 3  # of Newton's method for z = 0 along a slow line
TIME_ERROR = 8e-17  # admissible error of the time of an event
LOG_ERROR = 1e-12  # admissible error of log(R/F)
LONGEST = 40.0  # no event takes longer than (LONGEST - log mu) / |fast|
VANISHED = -746.0  # exp of this is 0 in doubles


class ModeConstants(NamedTuple):
    """Constants of one mode: floats, or arrays of one length."""

    rest: Any
    fast: Any
    slow: Any
    lag: Any
    to_x: Any
    to_s: Any
    to_z: Any
    bend: Any
    doubt: Any
    most_turn: Any
    longest: Any

    def rows(self, rows: slice) -> "ModeConstants":
        """Return the constants of some of the trajectories."""
        return self if isinstance(self.fast, float) else ModeConstants(*pick(rows, *self))


def mode_constants(a: Number, b: Number, mu: Number) -> ModeConstants:
    r"""Return the mode ``mu y' = a - b s``, for mu/b < 1/4.

    ``lag`` is 1 + slow = 1/(1 + fast); ``to_x``, ``to_s``, ``to_z`` take w to the fast parts of x, s, z; ``bend`` is mu
    (b-1)/b in ``z = z0 + (a/b) t + bend (y - y0)``. ``doubt`` is the admissible error of ``fast t - log(R/F)``, which
    shows neither in the state nor in the time; no event takes more time than ``longest``.
    """
    (rest, _, fast, slow, _, lag), (to_x, _, to_s, to_z, _) = two_exponentials(a, b, mu, np.sqrt)
    doubt = np.minimum(TIME_ERROR * np.abs(fast), LOG_ERROR)
    longest = (LONGEST - np.log(mu)) / np.abs(fast)
    constants = rest, fast, slow, lag, to_x, to_s, to_z, mu / b * (b - 1), doubt, np.sqrt(doubt), longest
    return ModeConstants(*(v if isinstance(v, np.ndarray) else float(v) for v in constants))


def deviation(m: ModeConstants, x: Number, y: Number) -> Number:
    """Return w, the deviation of y from the slow line."""
    return y - m.slow * (x - m.rest)


def velocity_zero(m: ModeConstants, x: Number, y: Number, z: Number, w: Number = ()) -> tuple[Number, Number, Number]:
    """Return (t, x, y) where the fast part brings z to 0; ``w`` gives the deviations of the first rows, if known."""
    w, slow_x = _parts(m, x, y, w)
    t = _time_of_zero(m, m.to_z * w, z, slow_x)
    slow_x *= np.expm1(m.slow * t)
    slow_x *= 1 - m.slow / m.fast
    gained = m.rest * t
    gained += z
    slow_x -= gained * (1 / (m.bend * m.fast))
    slow_x += x
    gained *= 1 / m.bend
    return t, slow_x, y - gained


def velocity_zero_slowly(m: ModeConstants, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number]:
    """Return (t, x, y) where a stable mode reaches z = 0 along its slow line, by Newton's method on z itself."""
    w, slow_x = _parts(m, x, y)
    fast_x = m.to_x * w
    t = (m.bend * (y - m.slow * slow_x) - z) / m.rest
    for _ in range(DRIFT_STEPS):
        kept, fading = m.slow * slow_x * np.exp(m.slow * t), m.fast * fast_x * np.exp(m.fast * t)
        speed = m.rest + m.bend * (m.slow * kept + m.fast * fading)
        step = (z + m.rest * t + m.bend * (kept + fading - y)) / speed
        t = t - step
    curve = m.bend * (m.slow * m.slow * kept + m.fast * m.fast * fading)
    t[~((np.abs(curve) * step * step <= TIME_ERROR * np.abs(speed)) & (t > 0))] = np.nan
    kept, fading = slow_x * np.exp(m.slow * t), fast_x * np.exp(m.fast * t)
    return t, m.rest + kept + fading, m.slow * kept + m.fast * fading


def force_zero(m: ModeConstants, x: Number, y: Number, w: Number = ()) -> tuple[Number, Number]:
    """Return (t, x) where the fast part brings s = x + y to 0, so that y = -x; ``w`` is as in ``velocity_zero``."""
    w, slow_x = _parts(m, x, y, w)
    t = _time_of_load(m, m.to_s * w, -m.rest, m.lag * slow_x)
    slow_x *= np.expm1(m.slow * t)
    slow_x *= 1 - m.lag * m.lag
    slow_x += x
    slow_x -= m.lag * (x + y)
    return t, slow_x


def release(m: ModeConstants, x: Number, y: Number, edge: Number) -> tuple[Number, Number]:
    """Return (t, x) where sticking ends, at s = ``edge``; t is negative where it cannot begin."""
    w, slow_x = _parts(m, x, y)
    t = _time_of_load(m, m.to_s * w, edge, m.lag * slow_x)
    slow_x *= np.exp(m.slow * t)
    slow_x *= 1 - m.lag * m.lag
    slow_x += m.lag * edge
    return t, slow_x


def _parts(m, x, y, known=()):
    """Return the deviation w, with the ``known`` values in the first rows, and the slow part of x - a/b."""
    off = x - m.rest
    w = m.slow * off
    np.subtract(y, w, out=w)
    w[: len(known)] = known
    off -= m.to_x * w
    return w, off


def slide(m: ModeConstants, x: Number, y: Number, remaining: Number) -> tuple[Number, Number, Number]:
    """Return (x, y) at the end of the time ``remaining`` in a stable mode, and the change of z until then."""
    off = x - m.rest
    slow_x = off * (1 + m.to_x * m.slow)
    slow_x -= m.to_x * y
    end_y = np.exp(m.slow * remaining)
    end_y *= slow_x
    end_x = end_y + m.rest
    end_y *= m.slow
    exponent = m.fast * remaining
    if not np.max(exponent) <= VANISHED:
        late = np.flatnonzero(np.broadcast_to(exponent > VANISHED, x.shape))
        off, slow_x, fast, exponent = pick(late, off, slow_x, m.fast, exponent)
        fast_x = (off - slow_x) * np.exp(exponent)
        end_x[late] += fast_x
        end_y[late] += fast * fast_x
    gone = end_y - y
    gone *= m.bend
    gone += m.rest * remaining
    return end_x, end_y, gone


def _time_of_zero(m, fast, z, slow_x):
    """Solve z = 0: Newton's step from t = 0, corrected to third order for the change u of log R; more steps if needed.

    The remaining error is of the order of u^4, and of u times the change of the slow part itself.
    """
    rest = fast - z
    falling = (m.bend * m.slow * m.slow) * slow_x
    bent = falling + m.rest
    bent /= rest
    slope = bent + m.fast
    t = rest / fast
    np.log(t, out=t)
    t /= slope
    turn = bent * t
    square = turn * turn
    most = m.doubt / (m.most_turn**0.5 * m.longest) * abs(m.rest)
    late = (square > m.most_turn) | (np.abs(falling) > most)
    turn *= 1 / 3
    turn += 0.5
    turn *= square
    turn /= slope
    t -= turn
    return _better(late, m.fast, m.slow, fast, rest, m.rest, falling * (1 / m.slow), t, m.doubt)


def _time_of_load(m, fast, level, slow):
    """Solve s = a/b + level: Newton's step from t = 0, and more steps where one may not be enough.

    Requires |slow| < |level| / 2. The remaining error comes from the change of log R by the slow part.
    """
    rest = level - slow
    bent = m.slow * slow
    bent /= rest
    t = rest / fast
    np.log(t, out=t)
    bent += m.fast
    t /= bent
    late = np.abs(slow) > m.doubt * 0.5 * abs(level) / m.longest**2
    return _better(late, m.fast, m.slow, fast, rest, None, slow, t, m.doubt)


def _better(late, fast_rate, slow_rate, fast, rest, drift, slow, t, doubt, steps=MOST_STEPS):
    """Return the times, improved by Newton's method in the ``late`` rows; NaN where a row stays late to the end."""
    given = fast_rate, slow_rate, fast, rest, drift, slow, t, doubt
    many = np.count_nonzero(late)
    if many and not steps:
        t[late] = np.nan
    elif 4 * many > 3 * t.size:
        t = _newton(*given, steps) if many == t.size else np.where(late, _newton(*given, steps), t)
    elif many:
        rows = late.nonzero()[0]
        t[rows] = _newton(*pick(rows, *given), steps)
    return t


def _newton(fast_rate, slow_rate, fast, rest, drift, slow, t, doubt, steps):
    kept = np.exp(slow_rate * t)
    kept *= slow
    now = rest + slow
    now -= kept
    bent = slow_rate * kept
    if drift is not None:
        now -= drift * t
        bent += drift
    bent /= now
    now /= fast
    step = fast_rate * t
    step -= np.log(now, out=now)
    step /= fast_rate + bent
    t = t - step
    step *= bent
    step *= step
    return _better(step > doubt, fast_rate, slow_rate, fast, rest, drift, slow, t, doubt, steps - 1)


def pick(rows: np.ndarray | slice, *values: Number) -> list[Number]:
    """Return ``rows``, a slice or indices, of every value that is an array, and all other values unchanged."""
    if isinstance(rows, slice):
        return [value[rows] if isinstance(value, np.ndarray) else value for value in values]
    return [value.take(rows) if isinstance(value, np.ndarray) else value for value in values]
