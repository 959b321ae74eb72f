r"""One mode in closed form where mu is small against b: a fast and a slow exponential, however small mu is.

With k = mu/b and ``rho = (1 + sqrt(1 - 4k))/2`` the roots of ``mu l^2 + b l + b = 0`` are ``l1 = -rho/k`` (fast) and
``l2 = -1/rho`` (slow), and ``1 + l2 = -k/rho^2``, ``l1 - l2 = -sqrt(1 - 4k)/k``: nothing cancels. The exact slow line
is ``s = a/(b rho) + (1 + l2) x``. Let F be the deviation of s from this line at the start, and C the rest of x; then

    x = a/b + F e^{l1 t}/(l1 - l2) + C e^{l2 t},    s = a/b + (1 + l1) F e^{l1 t}/(l1 - l2) + (1 + l2) C e^{l2 t},
    z = z0 + (a/b) t + k (b-1)(y - y0).
"""

from collections.abc import Callable
from functools import partial
from math import inf
from typing import Any, TypeAlias

from asympk.numbers import Arithmetic, Number
from asympk.systems.painleve_klein.flow.roots import balance_step, bracketed_root
from asympk.systems.painleve_klein.flow.superposition import SmoothMode, SmoothSegment, short_time, slope

SOON = 2.0**-10


def two_exponentials(a: Any, b: Any, mu: Any, sqrt: Callable) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Return (a/b, a/(b rho), l1, l2, l1 - l2, 1 + l2), and the coefficients of F in x, y, s, z and of C in z."""
    k = mu / b
    root = sqrt(1 - 4 * k)
    rho = (1 + root) / 2
    fast_rate, gap, fall = -rho / k, -root / k, 1 - b
    shares = 1 / gap, fast_rate / gap, (1 + fast_rate) / gap, fall * rho / gap, fall * k / rho
    return (a / b, a / (b * rho), fast_rate, -1 / rho, gap, -k / (rho * rho)), shares


def well_apart(b: Any, mu: Any) -> Any:
    """Tell where two exponentials serve: where mu/b is in [-2, 1/8]."""
    return (8 * mu <= b) | (mu <= -2 * b)


class FastSlow:
    """A mode ``mu y' = a - b s`` in the numbers of ``m``; ``fast_x`` is the coefficient of F in x, and so on."""

    half_period = inf
    __slots__ = ("a", "b", "beta", "delicate", "fall", "fast_rate", "fast_s", "fast_x", "fast_y", "fast_z", "gap",
                 "lift", "line", "load", "m", "mu", "rest", "short", "slight", "slow_rate", "slow_z", "turn")

    def __init__(self, m: Arithmetic, a: Number, b: Number, mu: Number):
        self.m, self.a, self.b, self.mu = m, a, b, mu
        self.beta, self.load, self.fall = b / mu, a / mu, 1 - b
        self.short, self.delicate = short_time(m, b, mu), abs(b) < 0.5
        rates, shares = two_exponentials(a, b, mu, m.sqrt)
        self.rest, self.line, self.fast_rate, self.slow_rate, self.gap, self.lift = rates
        self.fast_x, self.fast_y, self.fast_s, self.fast_z, self.slow_z = shares
        self.slight = abs(self.rest) / 1024
        self.turn = m.log(abs(self.lift * self.slow_rate)) - m.log(abs(self.fast_s * self.fast_rate))

    def start(self, x: Number, y: Number, s: Number, z: Number, deviation: Number | None = None) -> "FastSlowSegment":
        """Return the motion from a state; give its ``deviation`` from the slow line if known better than the state."""
        return FastSlowSegment(self, x, y, s, z, deviation)


class FastSlowSegment(SmoothSegment):
    """The motion in one mode from ``(x0, y0, s0, z0)`` at t = 0; ``fast`` is F and ``slow`` is C.

    At short times, up to ``short``, it is that of the responses.
    """

    __slots__ = ("fast", "known", "slow", "slow_s")
    begin = (*SmoothSegment.begin, "fast")

    def __init__(self, mode: FastSlow, x: Number, y: Number, s: Number, z: Number, deviation: Number | None = None):
        self.mode, self.x0, self.y0, self.s0, self.z0 = mode, x, y, s, z
        self.known = deviation is not None
        self.fast = fast = deviation if self.known else s - mode.line - mode.lift * x
        self.slow = slow = x - mode.rest - fast * mode.fast_x
        self.slow_s = slow_s = mode.lift * slow
        # at short times the two exponentials nearly cancel if a/b or the slow part is large, or s is small
        size = abs(s)
        delicate = mode.delicate | (abs(slow_s) > size + abs(mode.rest)) | (size > 0) & (size < mode.slight)
        self.short = mode.short * (delicate & (not self.known))

    def horizon(self, until: Number) -> Number:
        """Return ``until``, or the earlier time, at least 0, at which a growing fast part would overflow."""
        m, rate, fast = self.mode.m, self.mode.fast_rate, abs(self.fast)
        grows = (rate * until >= m.most_exponent) & (fast > 0)
        return m.choose(grows, lambda: m.least(until, m.most(0, m.most_exponent - m.most(0, m.log(fast))) / rate),
                        lambda: until)

    def turning(self) -> Number:
        """Return the time after 0 at which s has its extremum, or inf where both parts of s' have one sign."""
        fast, slow = self.fast, self.slow
        if not fast or not slow or (fast > 0) != (slow > 0):
            return inf
        t = self.extremum()
        return t if t > 0 else inf

    def extremum(self) -> Number:
        """Return the time, perhaps before 0, at which both parts of s' cancel, for parts of opposite signs."""
        mode, fast = self.mode, self.fast
        m = mode.m
        p = m.log(self.slow / fast) + mode.turn
        near = abs(p) < SOON
        if m.any(near) and not self.known:
            p = m.choose(near, lambda: m.log1p(-slope(self) / (mode.fast_s * mode.fast_rate * fast)), lambda: p)
        return p / mode.gap

    def state(self, t: Number) -> tuple[Number, ...]:
        if t < self.short or not t:
            return super().state(t)
        m, fast = self.mode.m, self.fast
        p = self.mode.fast_rate * t if fast else 0 * t
        return self.joined(t, fast * m.exp(p), fast * m.expm1(p))

    def joined(self, t: Number, fast: Number, gained: Number) -> tuple[Number, ...]:
        """Return (x, y, s, z, mu y') at t from F e^{l1 t} and from F (e^{l1 t} - 1)."""
        mode, q = self.mode, self.mode.slow_rate * t
        m, slow = mode.m, self.slow
        slow, lost = slow * m.exp(q), slow * m.expm1(q)
        off = mode.fast_s * fast + mode.lift * slow
        return (
            self.x0 + mode.fast_x * gained + lost,
            mode.fast_y * fast + mode.slow_rate * slow,
            mode.rest + off,
            self.z0 + mode.rest * t + mode.fast_z * gained + mode.slow_z * lost,
            -mode.b * off,
        )

    def size(self, axis: int, t: Number) -> Number:
        """Bound the terms that make up s (axis 2) or z (axis 3) where it is small."""
        mode = self.mode
        if axis == 2:
            return abs(mode.rest) + abs(self.slow_s)
        return abs(self.z0) + abs(mode.rest * t) + abs(mode.slow_z * self.slow)

    def root(self, axis: int, level: Number, lo: Number, hi: Number, sign_hi: Number) -> Number:
        """Return the time in (lo, hi) at which s (axis 2) or z (axis 3) is ``level``."""
        mode = self.mode
        if lo < self.short:
            if hi <= self.short or (self.state(self.short)[axis] - level) * sign_hi > 0:
                return super().root(axis, level, lo, min(hi, self.short), sign_hi)
            lo = self.short
        guess = mode.m.guess(self, axis, level, lo, hi, sign_hi)
        step = partial(balance_step, mode.m, self.balance(axis, level))
        return bracketed_root(mode.m, step, lo, hi, sign_hi, guess, 4 / abs(mode.fast_rate))

    def balance(self, axis: int, level: Number) -> tuple[Number, ...]:
        """Return the terms of s (axis 2) or z (axis 3) less ``level``, as ``balance_step`` takes them."""
        mode = self.mode
        if axis == 3:
            fast, slow = mode.fast_z * self.fast, mode.slow_z * self.slow
            start, base, drift = self.z0 - level, self.z0 - level - fast, mode.rest
        else:
            fast, slow = mode.fast_s * self.fast, self.slow_s
            start, base, drift = self.s0 - level, mode.rest - level + slow, 0 * mode.rest
        return start, base, drift, fast, mode.fast_rate, slow, mode.slow_rate


RodMode: TypeAlias = FastSlow | SmoothMode
RodSegment: TypeAlias = FastSlowSegment | SmoothSegment
Ended: TypeAlias = tuple[str, Number, tuple[Number, ...]]  # (kind, time, state) of an event, or ("", remaining, state)
