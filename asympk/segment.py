r"""The closed form of one mode, free of cancellation: ``mu x'' + b x' + b x = a``, ``s = x + x'``, ``z' = a - (b-1) s``.

Two forms share the work, both exact. ``FastSlow`` sums the two real exponentials; it serves wherever they are well
apart, however small mu is. ``Smooth`` superposes the responses to the initial values and to the load; it serves
where the exponentials are complex, coalesce, or degenerate (b -> 0), where mu is not small against b.

Both measure time from the start of the segment and take their functions (exp, expm1, log ...) from ``m``:
the ``math`` module's or mpmath's.
"""


def segment(m, a, b, mu, x, y, s, z, deviation=None):
    """Return the closed form that starts at ``(x, y, s, z)``; ``deviation`` is that of y from the slow line, if known."""
    if b != 0 and -2 <= mu / b <= 0.125:
        return FastSlow(m, a, b, mu, x, s, z, deviation)
    return Smooth(m, a, b, mu, x, y, s, z)


class FastSlow:
    r"""Fast and slow exponential: ``s = a/b + fast e^{l1 t} + ...`` with ``l1 = -rho b/mu`` and ``l2 = -1/rho``.

    Here ``rho = (1 + sqrt(1 - 4 k))/2``, ``k = mu/b``; then ``1 + l2 = -k/rho^2`` and ``l1 - l2 = -sqrt(1 - 4k)/k``
    have no cancellation. ``fast`` is the deviation of the start from the slow line, in s.
    """

    half_period = None

    def __init__(self, m, a, b, mu, x, s, z, deviation):
        k = mu / b
        root = m.sqrt(1 - 4 * k)
        rho = (1 + root) / 2
        self.m = m
        self.fast_rate = -rho / k
        self.slow_rate = -1 / rho
        gap = -root / k
        lift = -k / (rho * rho)
        self.gap = gap
        self.rest = a / b
        self.drift = a / b
        self.x0, self.z0, self.s0 = x, z, s
        self.fast = (s - self.rest / rho) - lift * x if deviation is None else deviation
        self.in_s = (1 - rho / k) / gap
        self.in_x = 1 / gap
        self.in_y = self.fast_rate / gap
        self.in_z = (1 - b) * rho / gap
        self.slow_x = (x - self.rest) - self.fast / gap
        self.slow_s = lift * self.slow_x
        self.slow_y = self.slow_rate * self.slow_x
        self.slow_z = (1 - b) * k / rho * self.slow_x
        self.a, self.b = a, b

    def horizon(self, until):
        """Return ``until``, or an earlier time by which a growing fast part has outgrown all else."""
        if self.fast_rate <= 0 or self.fast == 0 or self.fast_rate * until < 600:
            return until
        m = self.m
        return min(until, 709 / self.fast_rate, (709 - m.log(abs(self.fast))) / self.fast_rate)

    def turning(self):
        """Return the time of the extremum of s, or None."""
        if self.fast == 0 or self.slow_s == 0:
            return None
        ratio = -(self.slow_s * self.slow_rate) / (self.fast * self.in_s * self.fast_rate)
        if ratio <= 0:
            return None
        t = self.m.log(ratio) / self.gap
        return t if t > 0 else None

    def s_at(self, t):
        m = self.m
        return self.rest + self.in_s * (self.fast * m.exp(self.fast_rate * t)) + self.slow_s * m.exp(self.slow_rate * t)

    def z_at(self, t):
        m = self.m
        return (self.z0 + self.drift * t + self.in_z * (self.fast * m.expm1(self.fast_rate * t))
                + self.slow_z * m.expm1(self.slow_rate * t))

    def state_at(self, t):
        """Return (x, y, s, z)."""
        m = self.m
        return self._state(t, self.fast * m.exp(self.fast_rate * t), self.fast * m.expm1(self.fast_rate * t))

    def _state(self, t, fast, gained):
        m = self.m
        slow, lost = m.exp(self.slow_rate * t), m.expm1(self.slow_rate * t)
        return (
            self.x0 + self.in_x * gained + self.slow_x * lost,
            self.in_y * fast + self.slow_y * slow,
            self.rest + self.in_s * fast + self.slow_s * slow,
            self.z0 + self.drift * t + self.in_z * gained + self.slow_z * lost,
        )

    def s_root(self, level, lo, hi):
        """Return the time in (lo, hi) at which s = level."""
        return self._root(self.rest - level, 0, self.in_s * self.fast, self.slow_s, lo, hi)

    def z_root(self, lo, hi):
        """Return the time in (lo, hi) at which z = 0."""
        fast, slow = self.in_z * self.fast, self.slow_z
        return self._root(self.z0 - fast - slow, self.drift, fast, slow, lo, hi)

    def _root(self, u, k, fast, slow, lo, hi):
        m = self.m
        rate, slow_rate = self.fast_rate, self.slow_rate
        sign_hi = u + k * hi + fast * m.exp(rate * hi) + slow * m.exp(slow_rate * hi) > 0
        t = lo
        for _ in range(300):
            f, g = fast * m.exp(rate * t), slow * m.exp(slow_rate * t)
            r, dr = -(u + k * t + g), -(k + slow_rate * g)
            value = f - r
            if t != lo:
                if (value > 0) == sign_hi:
                    hi = t
                else:
                    lo = t
            if value == 0:
                return t
            step = 0
            if f != 0 and r != 0 and (f > 0) == (r > 0):
                slope = rate - dr / r
                step = -m.log(f / r) / slope if slope else 0
            elif dr != 0:
                step = r / -dr if abs(f) > abs(r) else -value / (rate * f - dr)
            new = t + step
            if not lo < new < hi or step == 0:
                new = m.sqrt(lo * hi) if lo > 0 and hi > 4 * lo else (lo + hi) / 2 if lo > 0 else hi / 1024
                if not lo < new < hi:
                    return new
            elif abs(step) <= m.root_tol * new:
                return new
            t = new
        return t

    def state_on_level(self, level, t):
        m = self.m
        slow = m.exp(self.slow_rate * t)
        direct = self.fast * m.exp(self.fast_rate * t)
        rest = level - self.rest - self.slow_s * slow
        if abs(self.fast_rate * t * direct * self.in_s) > abs(level) + abs(self.rest) + abs(self.slow_s * slow):
            direct = rest / self.in_s
        x, y, _, z = self._state(t, direct, direct - self.fast)
        return x, y, level, z

    def state_on_plane(self, t):
        m = self.m
        lost = m.expm1(self.slow_rate * t)
        fast, gained = self.fast * m.exp(self.fast_rate * t), self.fast * m.expm1(self.fast_rate * t)
        parts = self.z0, self.drift * t, self.slow_z * lost
        if abs(self.fast_rate * t * fast * self.in_z) > sum(map(abs, parts)):
            gained = -sum(parts) / self.in_z
            fast = self.fast + gained
        x, y, s, _ = self._state(t, fast, gained)
        return x, y, s, 0 * x


class Smooth:
    r"""Responses: ``g`` solves the mode with g = 0, g' = 1 at 0; ``h`` and ``H`` are its integrals.

        s = s0 g' + y0 g + (a/mu)(g + h),    x = x0 (1 - (b/mu) h) + y0 g + (a/mu) h,
        z = z0 + a t + (1-b)(s0 g + y0 h + (a/mu)(h + H))
    """

    def __init__(self, m, a, b, mu, x, y, s, z):
        self.m, self.a, self.b, self.mu = m, a, b, mu
        self.x0, self.y0, self.s0, self.z0 = x, y, s, z
        self.beta = b / mu
        self.gamma = self.beta / 2
        square = self.gamma * self.gamma - self.beta
        self.real = square >= 0
        self.omega = m.sqrt(abs(square))
        self.load = (a - b * s) / mu
        self.rate0 = y + self.load
        self.half_period = None if self.real else m.pi / self.omega

    def horizon(self, until):
        rate = self.omega - self.gamma
        if self.beta >= 0 or rate * until < 600:
            return until
        return 600 / rate

    def turning(self):
        m = self.m
        v0, w = self.rate0, self.load - self.gamma * self.rate0
        if not self.real:
            theta = m.atan2(-v0 * self.omega, w)
            return (theta if theta > 0 else theta + m.pi) / self.omega
        if v0 == 0 or w == 0:
            return None
        tau = -v0 / w
        p = self.omega * tau
        if tau <= 0 or p >= 1:
            return None
        return m.log1p(2 * p / (1 - p)) / (2 * self.omega) if self.omega else tau

    def responses(self, t):
        """Return (g', g, h, h + H) at t."""
        if abs(self.beta) * t * (1 + t) < 1:
            return self._series(t)
        m = self.m
        if self.real:
            e = m.exp((self.omega - self.gamma) * t)
            p = 2 * self.omega * t
            g = e * t if p == 0 else e * -m.expm1(-p) / (2 * self.omega)
            c = e * (1 + m.exp(-p)) / 2
        else:
            e = m.exp(-self.gamma * t)
            g = e * m.sin(self.omega * t) / self.omega
            c = e * m.cos(self.omega * t)
        dg = c - self.gamma * g
        h = (1 - dg) / self.beta - g
        return dg, g, h, (t - g) / self.beta

    def _series(self, t):
        d0, d1 = 0 * t, t
        dg, g, h, k = 1 + 0 * t, d1, d1 * t / 2, 0
        hh = d1 * t * t / 6
        n = 1
        b1, b2 = self.beta * t, self.beta * t * t
        while True:
            n += 1
            d0, d1 = d1, -(b1 * d1 + b2 * d0 / (n - 1)) / n
            if n > 3 and abs(d1) * n <= self.m.eps * t / 64 and abs(d0) * n <= self.m.eps * t / 64:
                return dg, g, h, h + hh
            dg += n * d1 / t if t else 0
            g += d1
            h += d1 * t / (n + 1)
            hh += d1 * t * t / ((n + 1) * (n + 2))

    def s_at(self, t):
        return self.state_at(t)[2]

    def z_at(self, t):
        return self.state_at(t)[3]

    def state_at(self, t):
        if t == 0:
            return self.x0, self.y0, self.s0, self.z0
        dg, g, h, k = self.responses(t)
        f = self.a / self.mu
        return (
            self.x0 * (1 - self.beta * h) + self.y0 * g + f * h,
            self.y0 * dg + (f - self.beta * self.x0) * g,
            self.s0 * dg + self.y0 * g + f * (g + h),
            self.z0 + self.a * t + (1 - self.b) * (self.s0 * g + self.y0 * h + f * k),
        )

    def s_root(self, level, lo, hi):
        def value_and_slope(t):
            dg, g, h, k = self.responses(t)
            return (self.s0 * dg + self.y0 * g + self.a / self.mu * (g + h) - level,
                    self.rate0 * dg + self.load * g)
        return _bracketed(self.m, value_and_slope, lo, hi)

    def z_root(self, lo, hi):
        def value_and_slope(t):
            _, _, s, z = self.state_at(t)
            return z, self.a - (self.b - 1) * s
        return _bracketed(self.m, value_and_slope, lo, hi)

    def state_on_level(self, level, t):
        x, y, _, z = self.state_at(t)
        return x, y, level, z

    def state_on_plane(self, t):
        x, y, s, z = self.state_at(t)
        return x, y, s, 0 * z


def _bracketed(m, value_and_slope, lo, hi):
    """Return the one root in (lo, hi) by Newton steps kept inside the bracket."""
    sign_hi = value_and_slope(hi)[0] > 0
    t = hi
    for _ in range(300):
        value, slope = value_and_slope(t)
        if value == 0:
            return t
        if (value > 0) == sign_hi:
            hi = t
        else:
            lo = t
        step = -value / slope if slope else 0
        new = t + step
        if not lo < new < hi or step == 0:
            new = m.sqrt(lo * hi) if lo > 0 and hi > 4 * lo else (lo + hi) / 2
            if not lo < new < hi:
                return new
        elif abs(step) <= m.root_tol * new:
            return new
        t = new
    return t
