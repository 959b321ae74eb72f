r"""One mode in closed form for arrays of starts and parameters: ``fastslow`` and ``superposition``, row by row.

A motion holds arrays of one length in the precision of its numbers; ``state(t)`` is (x, y, s, z) at times of that
length. Masks choose the formula of each row, so that no row depends on the others. ``bracketed_roots``, the hard
function, finds roots that are known to be alone in their brackets, by Newton's method.
"""

from collections.abc import Callable, Sequence

import numpy as np

from asympk.numbers import Number
from asympk.systems.painleve_klein.flow.fastslow import two_exponentials
from asympk.systems.painleve_klein.flow.superposition import superposed, terms_size

MOST_TERMS = 64  # of a Taylor series
MOST_STEPS = 400  # of Newton's method
AT_REST = 1e-5  # relative distance in t from the root of the rest r at which its own step ends
REFINED = 1e-9  # a Newton step, in units of the time scale, beyond which a second one follows


class Segments:
    """The motions from (x0, y0, s0, z0) in the mode ``mu y' = a - b s``: ``a`` is one number, all else arrays."""

    pace: np.ndarray
    horizon: Callable[[np.ndarray], np.ndarray]
    turning: Callable[[], np.ndarray]
    size: Callable[[int, np.ndarray], np.ndarray]
    _state: Callable[[np.ndarray], Sequence[np.ndarray]]

    def __init__(self, a: Number, b: Number, mu: Number, x: Number, y: Number, s: Number, z: Number):
        self.a, self.b, self.mu = a, b, mu
        self.x0, self.y0, self.s0, self.z0 = x, y, s, z
        self.beta, self.load, self.fall = b / mu, a / mu, 1 - b
        short = np.minimum(mu / np.abs(b), np.sqrt(mu / np.abs(b))) * np.where(np.abs(b) < 0.5, 0.5, 0.06)
        self.short = np.where(b == 0, np.inf, short)
        self.most_exponent = np.log(np.finfo(x.dtype).max) - 10

    @property
    def mode(self) -> "Segments":
        """The motions themselves, which hold the parameters of the mode, as ``superposition`` asks for them."""
        return self

    def rows(self, which: np.ndarray) -> "Segments":
        """Return the motions of some rows, in order and each once."""
        if which.dtype == bool:
            which = np.flatnonzero(which)
        if which.size == self.x0.size:
            return self
        part = object.__new__(type(self))
        for name, value in vars(self).items():
            setattr(part, name, value[which] if isinstance(value, np.ndarray) else value)
        return part

    def state(self, t: Number) -> Sequence[np.ndarray]:
        """Return (x, y, s, z) at t."""
        state = self._soon(t, self._state(t))
        begin, start = (self.x0, self.y0, self.s0, self.z0), t == 0
        return tuple(np.where(start, *pair) for pair in zip(begin, state, strict=True)) if start.any() else state

    def on_level(self, level: Number, t: Number) -> Sequence[np.ndarray]:
        """Return the state at the times t at which s is ``level``."""
        x, _, _, z = self.state(t)
        return x, level - x, level, z

    def on_plane(self, t: Number) -> Sequence[np.ndarray]:
        """Return the state at the times t at which z = 0."""
        x, y, s, _ = self.state(t)
        return x, y, s, np.zeros_like(x)

    def refined(self, t: Number, axis: int, level: Number, again: bool = True) -> np.ndarray:
        """Return the times at which s (axis 2) or z (axis 3) is ``level``, by Newton's method from close times t."""
        value, slope = self._off(axis, level, t)
        step = value / slope
        t = t - step
        far = np.flatnonzero(again & (np.abs(step) * self.pace > REFINED))
        if far.size:
            t[far] = self.rows(far).refined(t[far], axis, level[far], again=False)
        return t

    def _off(self, axis, level, t):
        """Return the distance of s (axis 2) or z (axis 3) from ``level`` at t, and its rate."""
        state = self.state(t)
        _, y, s, _ = state
        return state[axis] - level, self.a + self.fall * s if axis == 3 else y + (self.a - self.b * s) / self.mu

    def _soon(self, t, state):
        """Replace the states at short times by those from the Taylor series."""
        soon = np.flatnonzero(t < self.short)
        if soon.size:
            part = self.rows(soon)
            *series, _ = superposed(part, t[soon], short_response_arrays(part.beta, t[soon]))
            for axis, values in zip(state, series, strict=True):
                axis[soon] = values
        return state

    def root(self, axis: int, level: Number, lo: Number, hi: Number, rising: np.ndarray) -> np.ndarray:
        """Return the times in (lo, hi) at which s (axis 2) or z (axis 3) is ``level``; it rises there if ``rising``."""

        def step(rows, t):
            value, slope = self.rows(rows)._off(axis, level[rows], t)
            return value > 0, np.where(value == 0, t, t - value / slope)

        return bracketed_roots(step, lo, hi, rising, (lo + hi) / 2)


class SeparateSegments(Segments):
    """Two well separated real exponentials, as in ``flow.fastslow``."""

    half_period = np.inf

    def __init__(self, a: Number, b: Number, mu: Number, x: Number, y: Number, s: Number, z: Number):
        super().__init__(a, b, mu, x, y, s, z)
        rates, shares = two_exponentials(a, b, mu, np.sqrt)
        self.rest, self.line, self.fast_rate, self.slow_rate, self.gap, self.lift = rates
        self.fast_x, self.fast_y, self.fast_s, self.fast_z, self.slow_z = shares
        self.pace = np.abs(self.fast_rate)
        self.fast = s - self.line - self.lift * x
        self.slow = x - self.rest - self.fast * self.fast_x
        delicate = (np.abs(b) < 0.5) | (np.abs(self.lift * self.slow) >= 1)
        self.short = np.where(delicate, self.short, 0)

    def horizon(self, until: Number) -> np.ndarray:
        """Return ``until``, or the earlier time at which a growing fast part would overflow."""
        grows = (self.fast_rate * until > self.most_exponent) & (self.fast != 0)
        room = self.most_exponent - np.maximum(0, np.log(np.abs(self.fast)))
        return np.where(grows, np.minimum(until, room / self.fast_rate), until)

    def turning(self) -> np.ndarray:
        """Return the times after 0 at which s has its extremum, or inf."""
        ratio = -(self.lift * self.slow_rate * self.slow) / (self.fast_s * self.fast_rate * self.fast)
        t = np.log(ratio) / self.gap
        return np.where((ratio > 0) & (t > 0), t, np.inf)

    def _state(self, t):
        p = self.fast_rate * t
        return self._joined(t, self.fast * np.exp(p), self.fast * np.expm1(p))

    def _joined(self, t, fast, gained):
        p = self.slow_rate * t
        kept, lost = self.slow * np.exp(p), self.slow * np.expm1(p)
        near = np.abs(gained) < np.abs(fast)
        return [
            self.x0 + self.fast_x * gained + lost,
            self.fast_y * fast + self.slow_rate * kept,
            np.where(near, self.s0 + self.fast_s * gained + self.lift * lost,
                     self.rest + self.fast_s * fast + self.lift * kept),
            self.z0 + self.rest * t + self.fast_z * gained + self.slow_z * lost,
        ]

    def size(self, axis: int, t: Number) -> np.ndarray:
        """Bound the terms that make up s (axis 2) or z (axis 3) where it is small."""
        if axis == 2:
            return np.abs(self.rest) + np.abs(self.lift * self.slow)
        return np.abs(self.z0) + np.abs(self.rest * t) + np.abs(self.slow_z * self.slow)

    def root(self, axis: int, level: Number, lo: Number, hi: Number, rising: np.ndarray) -> np.ndarray:
        if axis == 3:
            fast, slow = self.fast_z * self.fast, self.slow_z * self.slow
            value, u, k = self.z0 - level, self.z0 - level - fast - slow, self.rest + np.zeros_like(lo)
        else:
            fast, slow = self.fast_s * self.fast, self.lift * self.slow
            value, u, k = self.s0 - level, self.rest - level, np.zeros_like(lo)
        step = balance_step(value, u, k, fast, self.fast_rate, slow, self.slow_rate)
        start = np.maximum(lo, self.short)
        found = bracketed_roots(step, start, hi, rising, start, 4 / np.abs(self.fast_rate))
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

    def on_level(self, level: Number, t: Number) -> Sequence[np.ndarray]:
        """Return the state at the times t at which s = level.

        A fast part that has changed by orders of magnitude is computed from s = level: its exponent is too inaccurate.
        """
        p = self.fast_rate * t
        fast = self.fast * np.exp(p)
        rest = self.rest + self.lift * self.slow * np.exp(self.slow_rate * t)
        steep = np.abs(p * fast * self.fast_s) > np.abs(level) + np.abs(rest)
        read = (level - rest) / self.fast_s
        gained = np.where(steep, read - self.fast, self.fast * np.expm1(p))
        x, _, _, z = self._soon(t, self._joined(t, np.where(steep, read, fast), gained))
        return x, level - x, level, z

    def on_plane(self, t: Number) -> Sequence[np.ndarray]:
        """Return the state at the times t at which z = 0, with the fast part from z = 0 as in ``on_level``."""
        p = self.fast_rate * t
        fast, gained = self.fast * np.exp(p), self.fast * np.expm1(p)
        drifted, lost = self.rest * t, self.slow_z * self.slow * np.expm1(self.slow_rate * t)
        steep = np.abs(p * fast * self.fast_z) > np.abs(self.z0) + np.abs(drifted) + np.abs(lost)
        read = -(self.z0 + drifted + lost) / self.fast_z
        fast, gained = np.where(steep, self.fast + read, fast), np.where(steep, read, gained)
        x, y, s, _ = self._soon(t, self._joined(t, fast, gained))
        return x, y, s, np.zeros_like(x)


class SmoothSegments(Segments):
    """Superposed responses, as in ``flow.superposition``, where exponentials are complex, coalesce or degenerate."""

    def __init__(self, a: Number, b: Number, mu: Number, x: Number, y: Number, s: Number, z: Number):
        super().__init__(a, b, mu, x, y, s, z)
        self.gamma = self.beta / 2
        square = self.gamma * self.gamma - self.beta
        self.real = square >= 0
        self.omega = np.sqrt(np.abs(square))
        self.pace = np.abs(self.gamma) + self.omega
        falling = -self.beta / (self.gamma + self.omega)
        self.tail = np.where((b > 0) & self.real, falling, self.omega - self.gamma)
        self.half_period = np.where(self.real, np.inf, np.pi / self.omega)

    def horizon(self, until: Number) -> np.ndarray:
        """Return ``until``, or the earlier time at which a growing part would overflow."""
        grows = self.real & (self.tail * until > self.most_exponent - 300)
        return np.where(grows, (self.most_exponent - 300) / self.tail, until)

    def turning(self) -> np.ndarray:
        """Return the times after 0 at which s has its first extremum, or inf."""
        push = self.load - self.beta * self.s0
        slope = self.y0 + push
        w = push - self.gamma * slope
        angle = np.arctan2(-slope * self.omega, w)
        turned = np.where(angle > 0, angle, angle + np.pi) / self.omega
        p = -self.omega * slope / w
        bent = np.where(p > 0, np.log1p(2 * p / (1 - p)) / (2 * self.omega), -slope / w)
        return np.where(self.real, np.where((slope / w < 0) & (p < 1), bent, np.inf), turned)

    def _state(self, t):
        *state, _ = superposed(self, t, self.responses(t))
        return state

    def responses(self, t: Number) -> tuple[np.ndarray, ...]:
        """Return (g', g, h, h + H) at t."""
        real, p = self.real, self.omega * t
        e = np.exp(np.where(real, self.tail, -self.gamma) * t)
        g = e * np.where(real, np.where(p > 0, -np.expm1(-2 * p) / (2 * self.omega), t), np.sin(p) / self.omega)
        rate = e * np.where(real, (1 + np.exp(-2 * p)) / 2, np.cos(p)) - self.gamma * g
        return rate, g, (1 - rate) / self.beta - g, (t - g) / self.beta

    def size(self, axis: int, t: Number) -> np.ndarray:
        """Bound the terms that make up s (axis 2) or z (axis 3)."""
        soon = t < self.short
        pairs = zip(short_response_arrays(self.beta, np.where(soon, t, 0)), self.responses(t), strict=True)
        return terms_size(self, axis, t, tuple(np.where(soon, *pair) for pair in pairs))


def short_response_arrays(beta: Number, t: Number) -> tuple[np.ndarray, ...]:
    """Return (g', g, h, h + H) at short times from the Taylor series of g; each term follows from the two before it."""
    rate, g, h, k = np.ones_like(t), t.copy(), t * t / 2, t * t / 2 + t * t * t / 6
    older, term = np.zeros_like(t), np.ones_like(t)
    least = np.finfo(t.dtype).eps / 64
    for n in range(2, MOST_TERMS):
        older, term = term, -beta * t * (term + older * t / (n - 1)) / n
        rate += n * term
        g += term * t
        h += term * t * t / (n + 1)
        k += term * t * t * (1 + t / (n + 2)) / (n + 1)
        goes_on = n * (np.abs(term) + np.abs(older)) > least
        if not goes_on.any():
            break
        term, older = np.where(goes_on, term, 0), np.where(goes_on, older, 0)
    return rate, g, h, k


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
