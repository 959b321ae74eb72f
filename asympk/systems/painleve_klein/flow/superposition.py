r"""One mode in closed form where mu is not small against b: the sum of responses to the start and to the load.

A mode is ``mu x'' + b x' + b x = a`` with ``s = x + x'`` and ``z' = a - (b-1) s``. Let g solve the homogeneous
equation with g = 0, g' = 1 at t = 0, and let h and H be its first and second integrals, beta = b/mu. Then

    x = x0 (1 - beta h) + y0 g + (a/mu) h,    s = s0 g' + y0 g + (a/mu)(g + h),
    z = z0 + a t + (1-b)(s0 g + y0 h + (a/mu)(h + H)),

whatever the characteristic roots: real, complex, coalescing at 4 mu = b, or all zero at b = 0. For short times Taylor
series give g, h and H without cancellation, for other times exponentials or sines. Where mu is small against b,
``fastslow`` is used instead.
"""

from typing import Any, ClassVar

from asympk.numbers import Arithmetic, Number
from asympk.systems.painleve_klein.flow.roots import NOWHERE, bracketed_root


class SmoothMode:
    """A mode ``mu y' = a - b s`` in the numbers of ``m``; up to the time ``short`` the Taylor series converge fast."""

    __slots__ = ("a", "b", "beta", "fall", "gamma", "half_period", "load", "m", "mu", "omega", "real", "short", "tail")

    def __init__(self, m: Arithmetic, a: Number, b: Number, mu: Number):
        self.m, self.a, self.b, self.mu = m, a, b, mu
        self.beta, self.load, self.fall = b / mu, a / mu, 1 - b
        self.short = short_time(m, b, mu)
        self.gamma = gamma = self.beta / 2
        square = gamma * gamma - self.beta
        self.real = square >= 0
        self.omega = omega = m.sqrt(abs(square)) + m.eps**2 * (square == 0)  # not 0, which divides
        falls = self.real & (b > 0)
        self.tail = m.choose(falls, lambda: -self.beta / (gamma + omega), lambda: omega * self.real - gamma)
        self.half_period = m.choose(self.real, lambda: m.inf, lambda: m.pi / omega)

    def start(self, x: Number, y: Number, s: Number, z: Number) -> "SmoothSegment":
        """Return the motion that starts at a state."""
        return SmoothSegment(self, x, y, s, z)

    def responses(self, t: Number) -> tuple[Number, ...]:
        """Return (g', g, h, h + H) at t, for times that are not short."""
        m, omega, beta = self.m, self.omega, self.beta
        e, p = m.exp(self.tail * t), omega * t
        cosine, sine = m.choose(self.real, _hyperbolic, _circular, m, p)
        g = e * sine / omega
        rate = e * cosine - self.gamma * g
        return rate, g, (1 - rate) / beta - g, (t - g) / beta


def _hyperbolic(m, p):
    """Return cosh p and sinh p, both times e^{-p}."""
    lost = m.expm1(-2 * p)
    return 1 + lost / 2, -lost / 2


def _circular(m, p):
    return m.cos(p), m.sin(p)


def short_time(m: Arithmetic, b: Number, mu: Number) -> Number:
    """Return the time up to which ``|beta| (t + t^2)`` is small enough for the series."""
    return m.choose(b != 0, lambda: m.least(mu / abs(b), m.sqrt(mu / abs(b))) * m.soon, lambda: m.eps**-2)


def short_responses(m: Arithmetic, beta: Number, t: Number) -> tuple[Number, ...]:
    """Return (g', g, h, h + H) at t from the Taylor series of g; each term follows from the two before it."""
    rate, g, h, k = 1, 0 + t, t * t / 2, t * t / 2 + t * t * t / 6
    older, term, n, least = 0, t, 1, m.eps * t / 64
    # terms below ``least`` round to nothing: a row of an array does not depend on the terms that others need
    while m.any(n * (abs(term) + abs(older)) > least):
        n += 1
        bend = -beta * (term + t * older / (n - 1))
        older, term = term, bend * t / n
        more = term * t / (n + 1)
        rate += bend
        g += term
        h += more
        k += more * (1 + t / (n + 2))
    return rate, g, h, k


def slope(segment: "SmoothSegment") -> Number:
    """Return the rate of s at the start of a segment, or zero where the rate is within the rounding of its terms."""
    mode, y = segment.mode, segment.y0
    pull = mode.beta * segment.s0
    rate = y + mode.load - pull
    return rate * (abs(rate) > 4 * mode.m.eps * (abs(y) + abs(pull)))


def superposed(segment: Any, t: Any, responses: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the state (x, y, s, z, mu y') at t from the responses there, numbers or arrays."""
    mode, x, y, s = segment.mode, segment.x0, segment.y0, segment.s0
    rate, g, h, k = responses
    load, beta = mode.load, mode.beta
    s1 = s * rate + y * g + load * (g + h)
    return (
        x * (1 - beta * h) + y * g + load * h,
        y * rate + (load - beta * x) * g,
        s1,
        segment.z0 + mode.a * t + mode.fall * (s * g + y * h + load * k),
        mode.a - mode.b * s1,
    )


def terms_size(segment: Any, axis: int, t: Any, responses: tuple[Any, ...]) -> Any:
    """Bound the terms that make up s (axis 2) or z (axis 3) at t, numbers or arrays."""
    mode, (rate, g, h, k) = segment.mode, responses
    if axis == 2:
        return abs(segment.s0 * rate) + abs(segment.y0 * g) + abs(mode.load * (g + h))
    sizes = abs(segment.s0 * g) + abs(segment.y0 * h) + abs(mode.load * k)
    return abs(segment.z0) + abs(mode.a * t) + abs(mode.fall) * sizes


def moved_to_plane(mode: Any, state: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the state where z = 0 from a state close to it, by Newton's step, numbers or arrays."""
    x, y, s, z, thrust = state
    fall = mode.a + mode.fall * s
    dx, dy = z * (y / fall), z / mode.mu * (thrust / fall)
    return x - dx, y - dy, s - dx - dy, z - z, thrust


def moved_to_level(mode: Any, state: tuple[Any, ...], level: Any) -> tuple[Any, ...]:
    """Return the state where s = level, as ``moved_to_plane`` does where z = 0."""
    x, y, s, z, thrust = state
    rate, missing = y + thrust / mode.mu, level - s
    x, fall = x + missing * (y / rate), mode.a + mode.fall * s if mode.a else 0
    return x, level - x, level, z + missing * (fall / rate), thrust


class SmoothSegment:
    """The motion in one smooth mode from ``(x0, y0, s0, z0)`` at t = 0."""

    __slots__ = ("mode", "s0", "short", "x0", "y0", "z0")
    mode: Any
    fast: Number = 0  # this form has no separate fast part
    begin: ClassVar[tuple[str, ...]] = ("x0", "y0", "s0", "z0")  # by which the motion is made

    def __init__(self, mode: SmoothMode, x: Number, y: Number, s: Number, z: Number):
        self.mode, self.x0, self.y0, self.s0, self.z0 = mode, x, y, s, z
        self.short = mode.short

    def rounded(self, m: Arithmetic) -> "SmoothSegment":
        """Return the same motion in the numbers of ``m``."""
        mode, number = self.mode, m.number
        begin = (number(getattr(self, name)) for name in self.begin)
        return type(mode)(m, mode.a, number(mode.b), number(mode.mu)).start(*begin)

    def horizon(self, until: Number) -> Number:
        return until

    def turning(self) -> Number:
        r"""Return the time after 0 at which s has its first extremum, or inf.

        s' = s'(0) g' + ((a - b s0)/mu) g vanishes where tan(omega t)/omega, or tanh, equals ``-s'(0)/w``.
        """
        mode, rate = self.mode, slope(self)
        w = mode.load - mode.beta * self.s0 - mode.gamma * rate
        return mode.m.choose(mode.real, _real_turning, _complex_turning, mode, rate, w)

    def state(self, t: Number) -> tuple[Number, ...]:
        """Return (x, y, s, z, mu y') at t."""
        return superposed(self, t, self.responses(t))

    def responses(self, t: Number) -> tuple[Number, ...]:
        """Return (g', g, h, h + H) at t."""
        mode = self.mode
        return short_responses(mode.m, mode.beta, t) if t < self.short or not t else mode.responses(t)

    def size(self, axis: int, t: Number) -> Number:
        """Bound the terms that make up s (axis 2) or z (axis 3)."""
        return terms_size(self, axis, t, self.responses(t))

    def off(self, axis: int, level: Number, t: Number) -> tuple[Number, Number]:
        """Return the distance of s (axis 2) or z (axis 3) from ``level`` at t, and its rate."""
        mode, state = self.mode, self.state(t)
        _, y, s, _, thrust = state
        return state[axis] - level, mode.a + mode.fall * s if axis == 3 else y + thrust / mode.mu

    def root(self, axis: int, level: Number, lo: Number, hi: Number, sign_hi: Number) -> Number:
        """Return the time in (lo, hi) at which s (axis 2) or z (axis 3) is ``level``, by Newton's method."""
        m = self.mode.m

        def step(t):
            value, rate = self.off(axis, level, t)
            return value, t - value / rate if rate else NOWHERE

        return bracketed_root(m, step, lo, hi, sign_hi, m.guess(self, axis, level, lo, hi, sign_hi))


def _complex_turning(mode, rate, w):
    side = 1 - 2 * (rate <= 0)
    turned = mode.m.atan2(abs(rate) * mode.omega, -side * w) / mode.omega
    return mode.m.choose(rate != 0, lambda: turned, lambda: mode.half_period)


def _real_turning(mode, rate, w):
    m, omega = mode.m, mode.omega
    reach, size = omega * abs(rate), abs(w)
    meets = ((rate < 0) & (w > 0) | (rate > 0) & (w < 0)) & (reach < size)
    return m.choose(meets, lambda: m.log1p(2 * reach / (size - reach)) / (2 * omega), lambda: m.inf)
