r"""The closed form of one mode, free of cancellation: ``mu x'' + b x' + b x = a``, ``s = x + x'``, ``z' = a - (b-1) s``.

Two forms share the work, both exact. ``FastSlow`` sums two real exponentials and serves where they are well apart,
however small mu is. ``Smooth`` superposes the responses to the start and to the load and serves where mu is not small
against b: where the exponentials are complex, coalesce (4 mu = b) or degenerate (b -> 0).

Constants of a mode are made once (``mode``), those of a start once more (``start``). Time is that since the start.
The functions exp, expm1, log ... are those of ``m``: of Python's ``math``, of an mpmath context, or of NumPy.
"""

from asympk.roots import fast_slow_root, smooth_root


def mode(m, a, b, mu, split=False):
    """Return the closed form of ``mu y' = a - b s``; ``split`` asks for the two exponentials wherever they are real."""
    if b and (-2 <= mu / b <= 0.125 or split):
        return FastSlow(m, a, b, mu)
    return Smooth(m, a, b, mu)


class _Mode:
    """What both forms share: the parameters, and the time for which Taylor series of the responses converge fast."""

    __slots__ = ("a", "b", "beta", "m", "mu", "short")

    def __init__(self, m, a, b, mu):
        self.m, self.a, self.b, self.mu = m, a, b, mu
        self.beta = b / mu
        self.short = min(mu / abs(b), m.sqrt(mu / abs(b))) / 2 if b else 1e18


class FastSlow(_Mode):
    r"""Fast and slow exponential: ``l1 = -rho/k`` and ``l2 = -1/rho`` with ``k = mu/b``, ``rho = (1 + sqrt(1-4k))/2``.

    Then ``1 + l2 = -k/rho^2`` and ``l1 - l2 = -sqrt(1-4k)/k`` without cancellation, and with F = s - s_slow(x) at the
    start, its deviation from the slow line ``s = a/(b rho) + (1 + l2) x``,

        x = a/b + F e^{l1 t}/(l1 - l2) + C e^{l2 t},    z = z0 + (a/b) t + k (b-1)(y - y0).
    """

    __slots__ = ("fast_rate", "fast_s", "fast_x", "fast_y", "fast_z", "gap", "lift", "line", "rest", "slow_rate",
                 "slow_z", "turn")

    def __init__(self, m, a, b, mu):
        super().__init__(m, a, b, mu)
        k = mu / b
        root = m.sqrt(1 - 4 * k)
        rho = (1 + root) / 2
        self.fast_rate, self.slow_rate, self.gap = -rho / k, -1 / rho, -root / k
        self.lift = -k / (rho * rho)
        self.rest = a / b
        self.line = a / (b * rho)
        self.fast_x = 1 / self.gap
        self.fast_y = self.fast_rate / self.gap
        self.fast_s = (1 + self.fast_rate) / self.gap
        self.fast_z = (1 - b) * rho / self.gap
        self.slow_z = (1 - b) * k / rho
        self.turn = -(self.lift * self.slow_rate) / (self.fast_s * self.fast_rate)

    def start(self, x, y, s, z, deviation=None):
        return FastSlowSegment(self, x, y, s, z, deviation)


class Smooth(_Mode):
    r"""Responses: g solves ``mu g'' + b g' + b g = 0``, g(0) = 0, g'(0) = 1; h and H are its first and second integral."""

    __slots__ = ("gamma", "half_period", "omega", "real", "tail")

    def __init__(self, m, a, b, mu):
        super().__init__(m, a, b, mu)
        self.gamma = self.beta / 2
        square = self.gamma * self.gamma - self.beta
        self.real = square >= 0
        self.omega = m.sqrt(abs(square))
        self.tail = -self.beta / (self.gamma + self.omega) if b > 0 and self.real else self.omega - self.gamma
        self.half_period = None if self.real else m.pi / self.omega

    def start(self, x, y, s, z, deviation=None):
        return SmoothSegment(self, x, y, s, z)

    def responses(self, t):
        """Return (g', g, h, h + H) at t."""
        m, beta = self.m, self.beta
        if self.real:
            e, p = m.exp(self.tail * t), 2 * self.omega * t
            g = e * (-m.expm1(-p) / (2 * self.omega) if p else t)
            rate = e * (1 + m.exp(-p)) / 2 - self.gamma * g
        else:
            e, p = m.exp(-self.gamma * t), self.omega * t
            g = e * m.sin(p) / self.omega
            rate = e * m.cos(p) - self.gamma * g
        return rate, g, (1 - rate) / beta - g, (t - g) / beta


def short_responses(m, beta, t):
    """Return (g', g, h, h + H) at t from their Taylor series, which converge fast while ``|beta| (t + t^2) < 1``."""
    g = older = term = t
    rate, h, k = 1, t * t / 2, t * t / 2 + t * t * t / 6
    older, n = 0 * t, 1
    while abs(term) * n > m.eps * t / 64 or abs(older) * n > m.eps * t / 64:
        n += 1
        older, term = term, -beta * t * (term + t * older / (n - 1)) / n
        rate += n * term / t
        g += term
        h += term * t / (n + 1)
        k += term * t / (n + 1) * (1 + t / (n + 2))
    return rate, g, h, k


class _Segment:
    """One mode followed from ``(x0, y0, s0, z0)``; ``state(t)`` is (x, y, s, z)."""

    __slots__ = ("mode", "s0", "short", "x0", "y0", "z0")

    def superposed(self, t, responses):
        r"""Return the state from the responses.

            x = x0 (1 - beta h) + y0 g + (a/mu) h,    s = s0 g' + y0 g + (a/mu)(g + h),
            z = z0 + a t + (1-b)(s0 g + y0 h + (a/mu)(h + H))
        """
        mode, y = self.mode, self.y0
        rate, g, h, k = responses
        load, beta = mode.a / mode.mu, mode.beta
        return (
            self.x0 * (1 - beta * h) + y * g + load * h,
            y * rate + (load - beta * self.x0) * g,
            self.s0 * rate + y * g + load * (g + h),
            self.z0 + mode.a * t + (1 - mode.b) * (self.s0 * g + y * h + load * k),
        )

    def s_and_slope(self, level):
        mode = self.mode

        def value_and_slope(t):
            _, y, s, _ = self.state(t)
            return s - level, y + (mode.a - mode.b * s) / mode.mu
        return value_and_slope

    def z_and_slope(self, t):
        _, _, s, z = self.state(t)
        return z, self.mode.a + (1 - self.mode.b) * s


class FastSlowSegment(_Segment):
    __slots__ = ("fast", "known", "slow")

    half_period = None

    def __init__(self, mode, x, y, s, z, deviation=None):
        self.mode, self.x0, self.y0, self.s0, self.z0 = mode, x, y, s, z
        self.short = 0
        self.known = deviation is not None
        self.fast = deviation if self.known else (s - mode.line) - mode.lift * x
        self.slow = (x - mode.rest) - self.fast * mode.fast_x
        if not self.known and (abs(mode.b) < 0.5 or abs(mode.lift * self.slow) > 1):
            self.short = mode.short

    def turning(self):
        """Return the time after 0 at which s has its extremum, or None."""
        if not self.fast:
            return None
        ratio = self.mode.turn * self.slow / self.fast
        if ratio <= 0:
            return None
        t = self.mode.m.log(ratio) / self.mode.gap
        return t if t > 0 else None

    def s_size(self, t):
        """Bound the terms that make up s where s is small."""
        mode = self.mode
        return abs(mode.rest) + abs(mode.lift * self.slow)

    def z_size(self, t):
        """Bound the terms that make up z where z is small."""
        mode = self.mode
        return abs(self.z0) + abs(mode.rest * t) + abs(mode.slow_z * self.slow)

    def horizon(self, until):
        """Return ``until``, or the time at which a growing fast part ends the range of the numbers."""
        m, rate = self.mode.m, self.mode.fast_rate
        if rate * until < m.most_exponent or not self.fast:
            return until
        return min(until, (m.most_exponent - max(0, m.log(abs(self.fast)))) / rate)

    def state(self, t):
        mode = self.mode
        if t < self.short:
            return self.superposed(t, short_responses(mode.m, mode.beta, t)) if t else self._start()
        p = mode.fast_rate * t
        return self._joined(t, self.fast * mode.m.exp(p), self.fast * mode.m.expm1(p))

    def _start(self):
        return self.x0, self.y0, self.s0, self.z0

    def _joined(self, t, fast, gained):
        mode, slow = self.mode, self.slow
        p = mode.slow_rate * t
        kept, lost = slow * mode.m.exp(p), slow * mode.m.expm1(p)
        return (
            self.x0 + mode.fast_x * gained + lost,
            mode.fast_y * fast + mode.slow_rate * kept,
            mode.rest + mode.fast_s * fast + mode.lift * kept,
            self.z0 + mode.rest * t + mode.fast_z * gained + mode.slow_z * lost,
        )

    def s_root(self, level, lo, hi, sign_hi):
        """Return the time in (lo, hi) at which s = level."""
        mode = self.mode
        if lo < self.short:
            if hi <= self.short or (self.state(self.short)[2] - level) * sign_hi > 0:
                return smooth_root(mode.m, self.s_and_slope(level), lo, min(hi, self.short), sign_hi)
            lo = self.short
        return fast_slow_root(mode.m, mode.rest - level, 0, mode.fast_s * self.fast, mode.fast_rate,
                              mode.lift * self.slow, mode.slow_rate, lo, hi, sign_hi)

    def z_root(self, lo, hi, sign_hi):
        """Return the time in (lo, hi) at which z = 0."""
        mode = self.mode
        fast, slow = mode.fast_z * self.fast, mode.slow_z * self.slow
        if lo < self.short:
            if hi <= self.short or self.state(self.short)[3] * sign_hi > 0:
                return smooth_root(mode.m, self.z_and_slope, lo, min(hi, self.short), sign_hi)
            lo = self.short
        return fast_slow_root(mode.m, self.z0 - fast - slow, mode.rest, fast, mode.fast_rate,
                              slow, mode.slow_rate, lo, hi, sign_hi)

    def on_level(self, level, t):
        """Return the state at the root t of s = level; a steep fast part is read off the equation, not off its exponent."""
        mode = self.mode
        if t < self.short:
            x, _, _, z = self.state(t)
            return x, level - x, level, z
        fast = self.fast * mode.m.exp(mode.fast_rate * t)
        rest = mode.rest + mode.lift * self.slow * mode.m.exp(mode.slow_rate * t)
        if abs(mode.fast_rate * t * fast * mode.fast_s) > abs(level) + abs(rest):
            fast = (level - rest) / mode.fast_s
        x, _, _, z = self._joined(t, fast, fast - self.fast)
        return x, level - x, level, z

    def on_plane(self, t):
        """Return the state at the root t of z = 0; a steep fast part is read off the equation, not off its exponent."""
        mode = self.mode
        if t < self.short:
            x, y, s, z = self.state(t)
            return x, y, s, 0 * z
        m, p = mode.m, mode.fast_rate * t
        fast, gained = self.fast * m.exp(p), self.fast * m.expm1(p)
        parts = self.z0, mode.rest * t, mode.slow_z * self.slow * m.expm1(mode.slow_rate * t)
        if abs(p * fast * mode.fast_z) > abs(parts[0]) + abs(parts[1]) + abs(parts[2]):
            gained = -(parts[0] + parts[1] + parts[2]) / mode.fast_z
            fast = self.fast + gained
        x, y, s, z = self._joined(t, fast, gained)
        return x, y, s, 0 * z


class SmoothSegment(_Segment):
    __slots__ = ()

    def __init__(self, mode, x, y, s, z):
        self.mode, self.x0, self.y0, self.s0, self.z0 = mode, x, y, s, z
        self.short = mode.short

    @property
    def half_period(self):
        return self.mode.half_period

    def horizon(self, until):
        return until

    def s_size(self, t):
        mode, (rate, g, h, _) = self.mode, self.responses(t)
        return abs(self.s0 * rate) + abs(self.y0 * g) + abs(mode.a / mode.mu * (g + h))

    def z_size(self, t):
        mode, (_, g, h, k) = self.mode, self.responses(t)
        return abs(self.z0) + abs(mode.a * t) + abs(1 - mode.b) * (
            abs(self.s0 * g) + abs(self.y0 * h) + abs(mode.a / mode.mu * k))

    def responses(self, t):
        mode = self.mode
        return short_responses(mode.m, mode.beta, t) if t < self.short else mode.responses(t)

    def turning(self):
        r"""Return the time after 0 at which s has its first extremum, or None.

        s' = s'(0) g' + ((a - b s0)/mu) g vanishes where tan(omega t)/omega, or tanh, is ``-s'(0)/w``.
        """
        mode = self.mode
        m, omega = mode.m, mode.omega
        load = (mode.a - mode.b * self.s0) / mode.mu
        slope = self.y0 + load
        w = load - mode.gamma * slope
        if not mode.real:
            angle = m.atan2(-slope * omega, w)
            return (angle if angle > 0 else angle + m.pi) / omega
        if not w or not slope:
            return None
        tau = -slope / w
        if tau <= 0 or omega * tau >= 1:
            return None
        return m.log1p(2 * omega * tau / (1 - omega * tau)) / (2 * omega) if omega else tau

    def state(self, t):
        return self.superposed(t, self.responses(t)) if t else (self.x0, self.y0, self.s0, self.z0)

    def s_root(self, level, lo, hi, sign_hi):
        return smooth_root(self.mode.m, self.s_and_slope(level), lo, hi, sign_hi)

    def z_root(self, lo, hi, sign_hi):
        return smooth_root(self.mode.m, self.z_and_slope, lo, hi, sign_hi)

    def on_level(self, level, t):
        x, _, _, z = self.state(t)
        return x, level - x, level, z

    def on_plane(self, t):
        x, y, s, z = self.state(t)
        return x, y, s, 0 * z
