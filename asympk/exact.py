r"""The exact flow: one closed form per mode, and event times from roots that are bracketed by monotonicity.

In a mode s has one extremum (of relevance), so s is monotone between known times; z' = a - (b-1) s has at most one
zero between them, so z has at most one extremum there. Every event is therefore found from signs at known times,
and none is searched by sampling. One text serves floats and mpmath numbers.
"""

import math
from fractions import Fraction
from types import SimpleNamespace

from asympk.errors import InputError, TooLarge, TooManyEvents
from asympk.path import Event, Path
from asympk.segment import segment

MOST_EVENTS = 1000

DOUBLES = SimpleNamespace(
    exp=math.exp, expm1=math.expm1, log=math.log, log1p=math.log1p, sqrt=math.sqrt, sin=math.sin, cos=math.cos,
    atan2=math.atan2, pi=math.pi, eps=2.0**-52, root_tol=1e-10, number=float,
)


def run(scene, method="exact", *, digits=None):
    """Follow ``scene`` in closed form: in doubles, or on mpmath numbers that are right to ``digits`` digits."""
    if digits is None:
        return Flow(DOUBLES, scene).path()
    if isinstance(digits, bool) or not isinstance(digits, int) or not 1 <= digits <= 1000:
        raise InputError(f"digits = {digits!r}: it must be an integer from 1 to 1000")
    return _certified(scene, digits)


def _multi(digits):
    import mpmath

    ctx = mpmath.MPContext()
    ctx.dps = digits
    ctx.root_tol = ctx.mpf(10) ** (-0.6 * digits)

    def to(value):
        if isinstance(value, Fraction):
            return ctx.mpf(value.numerator) / value.denominator
        return ctx.mpf(value)

    ctx.number = to
    return ctx


def _certified(scene, digits):
    import mpmath

    working = digits + 20
    while True:
        coarse = Flow(_multi(working), scene).path()
        working += digits // 2 + 20
        fine = Flow(_multi(working), scene).path()
        scale = max(1, *(abs(v) for e in fine.events for v in (e.x, e.z)), abs(fine.final[0]), abs(fine.final[2]))
        error = max(abs(p - q) for p, q in zip(coarse.final, fine.final, strict=True)) / scale
        same = coarse.modes == fine.modes
        if same and error < mpmath.mpf(10) ** (-digits):
            make = mpmath.mp.make_mpf
            out = lambda v: make(v._mpf_)  # noqa: E731
            events = tuple(Event(e[0], *map(out, e[1:])) for e in fine.events)
            return Path(scene, "exact", tuple(map(out, fine.final)), events, fine.modes, fine.at, out(error))
        working *= 2


class Flow:
    def __init__(self, m, scene):
        self.m, self.scene = m, scene
        n = m.number
        self.sigma, self.sigma0, self.mu = n(scene.sigma), n(scene.sigma0), n(scene.mu)
        self.until = n(scene.until)
        self.segments = []

    def coefficients(self, mode):
        return {"slip_same": (1, self.sigma + 4), "slip_opposite": (1, -self.sigma), "stick": (0, 1)}[mode]

    def in_static_cone(self, s):
        return abs(1 - s) <= (self.sigma0 + 2) * abs(s)

    def path(self):
        m, scene = self.m, self.scene
        x, y, z = map(m.number, scene.start)
        deviation = None
        if scene.near_to:
            manifold, offset = scene.near_to
            deviation = m.number(offset)
            b = self.sigma + 4 if manifold == "Pi1" else -self.sigma
            y = -2 / (1 + m.sqrt(1 - 4 * self.mu / b)) * (x - 1 / b) + deviation
        s = x + y
        t = 0 * self.until
        events, modes = [], []
        sz, ss = _sign(z), _sign(s) or (_sign(self.mu * y + 1) or 1)
        if sz == 0:
            sz = self.leaving(x, y, s)
        while True:
            mode = "stick" if sz == 0 else "slip_same" if sz == ss else "slip_opposite"
            modes.append(mode)
            a, b = self.coefficients(mode)
            piece = segment(m, a, b, self.mu, x, y, s, z, deviation)
            deviation = None
            self.segments.append((t, piece))
            found = self.stick_exit(piece, ss, self.until - t) if sz == 0 else slip_exit(piece, sz, ss, self.until - t)
            if found is None:
                x, y, s, z = piece.state_at(self.until - t)
                break
            kind, dt, (x, y, s, z) = found
            t = t + dt
            events.append(Event(kind, t, x, y, z))
            if len(events) > MOST_EVENTS:
                raise TooManyEvents(
                    f"more than {MOST_EVENTS} events: reached t = {float(t):.6g} of {float(self.until):.6g} at "
                    f"(x, y, z) = ({float(x):.6g}, {float(y):.6g}, {float(z):.6g}); take a smaller until")
            if kind == "force_zero":
                ss = -ss
            elif kind == "slip_onset":
                sz = _sign(1 - s)
            else:
                sz = 0 if self.in_static_cone(s) else _sign(1 - s)
                ss = _sign(s)
        if sz == 0:
            z = 0 * z
        if not all(abs(v) < float("inf") for v in (x, y, z)):
            raise TooLarge(f"the state at until = {self.until} exceeds the range of doubles; give digits=")
        at = lambda time: self.at(time)  # noqa: E731
        return Path(scene, "exact", (x, y, z), tuple(events), tuple(modes), at)

    def at(self, t):
        for start, piece in reversed(self.segments):
            if t >= start:
                x, y, _, z = piece.state_at(t - start)
                return x, y, z

    def edges(self, s):
        """Return the edges of the static cone's part that holds s, nearest to zero first; None for no edge."""
        if s < 0:
            return -1 / (self.sigma0 + 1), None
        return 1 / (self.sigma0 + 3), (-1 / (self.sigma0 + 1) if self.sigma0 < -1 else None)

    def leaving(self, x, y, s):
        """Return the sign that z takes from a start at z = 0, or 0 to stick."""
        if not self.in_static_cone(s):
            return _sign(1 - s)
        near, far = self.edges(s)
        inward = _sign(self.mu * y - s) or -_sign(s)
        if s == near:
            return 1 if inward * _sign(s) < 0 else 0
        if s == far:
            return -1 if inward > 0 else 0
        return 0

    def stick_exit(self, piece, ss, until):
        near, far = self.edges(ss)
        lo = 0
        turn = piece.turning()
        for hi in _ends(turn, piece.half_period, until):
            s = piece.s_at(hi)
            for edge, gone in ((near, ss * (s - near) < 0), (far, far is not None and s > far)):
                if gone:
                    t = piece.s_root(edge, lo, hi)
                    x, y, s, z = piece.state_on_level(edge, t)
                    return "slip_onset", t, (x, y, s, 0 * z)
            lo = hi
        return None


def slip_exit(piece, sz, ss, until):
    until = piece.horizon(until)
    lo, s_lo = 0 * until, piece.s0
    up_lo = True if piece.z0 == 0 else sz * (piece.a - (piece.b - 1) * s_lo) > 0
    for hi in _ends(piece.turning(), piece.half_period, until):
        _, _, s, z = piece.state_at(hi)
        up_hi = sz * (piece.a - (piece.b - 1) * s) > 0
        t = z_crossing(piece, sz, lo, hi, z, up_lo, up_hi)
        if t is not None:
            at = piece.state_on_plane(t)
            if ss * at[2] > 0:
                return "velocity_zero", t, at
            hi = t
            s = at[2]
        if ss * s < 0:
            t = piece.s_root(0, lo, hi)
            return "force_zero", t, piece.state_on_level(0 * s, t)
        lo, s_lo, up_lo = hi, s, up_hi
    return None


def z_crossing(piece, sz, lo, hi, z_hi, up_lo, up_hi):
    """Return the first time in (lo, hi) at which z leaves the side sz, or None; s is monotone there."""
    if sz * z_hi < 0:
        if up_lo and not up_hi and lo == 0 and piece.z0 == 0:
            lo = piece.s_root(piece.a / (piece.b - 1), lo, hi)
        return piece.z_root(lo, hi)
    if up_lo or not up_hi:
        return None
    least = piece.s_root(piece.a / (piece.b - 1), lo, hi)
    return piece.z_root(lo, least) if sz * piece.z_at(least) < 0 else None


def _ends(turn, half_period, until):
    """Yield the ends of the stretches on which s is monotone, as far as they matter."""
    if turn is not None and turn < until:
        yield turn
        if half_period is not None and turn + half_period < until:
            yield turn + half_period
            if turn + 2 * half_period < until:
                yield turn + 2 * half_period
    yield until


def _sign(v):
    return 1 if v > 0 else -1 if v < 0 else 0
