r"""The exact flow: one closed form per mode, and event times as roots that are alone in their brackets.

The equations are linear in each mode, and the same code follows them in doubles and in mpmath numbers. No event is
searched for by sampling: between the extrema of s, which are known in closed form, signs bracket every event alone
(Lemma 1), and where s oscillates its first three extrema are enough (Lemma 2).

At an event the quantity that vanishes is set, not computed; derivatives decide which mode follows. A sign that the
numbers in use cannot decide raises ``Undecided``, and the caller follows the flow again with more digits.
``follow_rod`` is the loop over segments; ``slip_event``, the hard function, and ``stick_event`` end a segment.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from asympk.arithmetic import Doubles
from asympk.errors import TooLarge, TooManyEvents, Undecided
from asympk.numbers import Arithmetic, Number, sign_of
from asympk.systems.painleve_klein import modes
from asympk.systems.painleve_klein.flow import shortcut
from asympk.systems.painleve_klein.flow.fastslow import Ended, FastSlow, RodMode, RodSegment, well_apart
from asympk.systems.painleve_klein.flow.superposition import SmoothMode, moved_to_level, moved_to_plane, slope

MOST_EVENTS = 1000  # of one run
WIDEST = 1e100  # of mu/|b|, whose square must be a double
MOST_STEPS = 60  # of Newton's method onto an event


class RodFlow:
    """The modes and the static cone at given parameters, in the numbers of ``m``."""

    def __init__(self, m: Arithmetic, sigma: Number, sigma0: Number, mu: Number):
        self.m, self.sigma, self.sigma0, self.mu = m, sigma, sigma0, mu
        self._modes: dict[str, RodMode] = {}
        self._edges: dict[int, tuple[tuple[Number, int], ...]] = {}

    def mode(self, name: str) -> RodMode:
        """Return the closed form of the mode: two exponentials where ``well_apart``, else ``SmoothMode``."""
        if name not in self._modes:
            a, b = modes.coefficients(name, self.sigma)
            form = FastSlow if well_apart(b, self.mu) else SmoothMode
            self._modes[name] = form(self.m, a, b, self.mu)
        return self._modes[name]

    def split(self, name: str) -> FastSlow:
        """Return the closed form by two real exponentials, for starts given relative to the slow line.

        Raises ``Undecided`` where doubles cannot hold the squares of the constants, or the gap between the exponents.
        """
        usual = self.mode(name)
        if type(usual) is FastSlow:
            return usual
        a, b = modes.coefficients(name, self.sigma)
        if self.m is Doubles and (self.mu > WIDEST * abs(b) or 8 * self.mu > b > 0):
            raise Undecided
        return FastSlow(self.m, a, b, self.mu)

    def edges(self, s_sign: int) -> tuple[tuple[Number, int], ...]:
        """Return the edges of the static cone on one side of s = 0, each with the sign of edge - s in the cone."""
        if s_sign not in self._edges:
            ends = zip(modes.inverse_edges(self.sigma0, s_sign), (-s_sign, 1), strict=True)
            self._edges[s_sign] = tuple((1 / end, side) for end, side in ends if end)
        return self._edges[s_sign]

    def nearest_edge(self, s_sign: int, s: Number) -> Number:
        """Return the edge of the static cone on one side of s = 0 that is nearest to s."""
        return min((edge for edge, _ in self.edges(s_sign)), key=lambda edge: abs(edge - s))

    def sticks(self, s: Number, size: Number) -> bool:
        """Tell whether s, a sum of terms up to ``size``, lies in the static cone |1 - s| <= (sigma0 + 2)|s|."""
        edges = self.edges(1 if s > 0 else -1)
        return bool(edges) and all(decided(self.m, side * (edge - s), abs(edge) + size) >= 0 for edge, side in edges)


def decided(m: Arithmetic, value: Number, size: Number) -> int:
    """Return the sign of ``value``; raise ``Undecided`` when it is small against ``size``."""
    if abs(value) <= m.margin * size and m.margin:
        raise Undecided
    return sign_of(value)


def lost(m: Arithmetic, value: Number, size: Number) -> bool:
    """Tell whether a value, positive inside its mode, is negative; False where the value is ``vanishing``."""
    return decided(m, value, size) < 0 and value < -m.slack * size


def vanishing(m: Arithmetic, value: Number, size: Number) -> bool:
    """Tell whether a value is zero to rounding, in numbers ``m`` that take signs as they are (``margin`` 0)."""
    return not m.margin and abs(value) <= m.slack * size


class SolvedSegment(NamedTuple):
    """One segment of a solution: mode, start time, closed form, kind of the event that ends it or "", duration, end."""

    mode: str
    start: Any
    segment: Any
    kind: str
    span: Any
    end: tuple


def follow_rod(
    flow: RodFlow, start: tuple[Number, ...], until: Number, deviation: Number | None = None,
    known: Sequence[SolvedSegment] | None = None, on_event: Callable[[Number], None] | None = None,
) -> list[SolvedSegment]:
    """Follow the flow from ``start = (x, y, s, z, sign of s, sign of z)``, with both signs just after the start.

    Return the segments of the solution; a state is (x, y, s, z, mu y'). ``deviation`` is the start's distance in s from
    the slow line, if known better than the state. ``known`` are the segments of the same motion in coarser numbers,
    which are refined; ``on_event`` is called with the time of every event. Raises ``Undecided``, ``TooManyEvents``,
    and ``TooLarge`` where y exceeds the range of the numbers.
    """
    x, y, s, z, s_sign, z_sign = start
    m, t = flow.m, 0 * until
    done: list[SolvedSegment] = []
    while True:
        name = modes.MODES[s_sign * z_sign]
        if deviation is None:
            segment = flow.mode(name).start(x, y, s, z)
        else:
            segment, deviation = flow.split(name).start(x, y, s, z, deviation), None
        remaining = max(0 * until, until - t)
        if known:
            kind, span, state = refined_event(flow, segment, _counterpart(known, done, name), s_sign, remaining)
        else:
            kind, span, state = _next_event(flow, segment, s_sign, z_sign, remaining)
        done.append(SolvedSegment(name, t, segment, kind, span, state))
        if not kind:
            _require_clear_end(flow, segment, state, s_sign, z_sign, m.margin * until, span if t else None)
            return done
        x, y, s, z, _ = state
        if abs(y) > m.largest:
            power = int(m.log(abs(y)) / m.log(10))
            raise TooLarge(f"y reaches 1e{power} after t = {float(t):.6g}, beyond the numbers in use: take a smaller "
                           "until, or digits= where they are doubles")
        t = t + span
        if on_event:
            on_event(t)
        s, s_sign, z_sign = _after(flow, kind, s_sign, z_sign, s, y, segment.size(2, span))
        if len(done) > MOST_EVENTS:
            raise TooManyEvents(too_many(until, t, x, y, z), t, (x, y, z))


def _after(flow, kind, s_sign, z_sign, s, y, size):
    """Return (s, sign of s, sign of z) just after an event at the load s, a sum of terms up to ``size``."""
    if kind != "velocity_zero":
        return s, *modes.signs_after(kind, s_sign, z_sign, s, False)
    m = flow.m
    s = 0 * s if vanishing(m, s, size) else s
    if not m.margin and (not s or vanishing(m, modes.stick_margin(flow.sigma0, s), 1 + size)):
        s_sign, z_sign, _ = modes.first_signs(partial(_sign, m), flow.sigma0, flow.mu, s, y, 0 * s)
        return s, s_sign, z_sign
    return s, *modes.signs_after(kind, s_sign, z_sign, s, flow.sticks(s, size))


def _sign(m, value, size):
    return 0 if vanishing(m, value, size) else decided(m, value, size)


def _next_event(flow, segment, s_sign, z_sign, remaining):
    """Return (kind, time, state) of the event that ends a segment, in doubles by ``shortcut`` where that gives one."""
    if z_sign:
        quick = flow.m is Doubles and shortcut.slip_end(segment, s_sign, z_sign, remaining)
        return quick or slip_event(flow, segment, s_sign, z_sign, remaining)
    quick = flow.m is Doubles and shortcut.stick_end(segment, flow.edges(s_sign), remaining)
    return quick or stick_event(flow, segment, s_sign, remaining)


def _require_clear_end(flow, segment, state, s_sign, z_sign, late, since):
    """Raise ``Undecided`` if an error ``late`` of the end, a time ``since`` after the last event, may change events."""
    mode, (_, y, s, z, thrust) = segment.mode, state
    moved = late * abs(y + thrust / mode.mu)
    if z_sign:
        clear = moved <= abs(s) and late * abs(mode.a + mode.fall * s) <= abs(z)
    else:
        clear = all(moved <= abs(s - edge) for edge, _ in flow.edges(s_sign))
    if not clear or (since is not None and since < late):
        raise Undecided


def slip_event(flow: RodFlow, segment: RodSegment, s_sign: int, z_sign: int, remaining: Number) -> Ended:
    """Return (kind, time, state) of the event that ends a slip, or ("", remaining, state) when the time ends first.

    A load that only touches zero keeps its sign. A velocity that only touches zero ends the slip if static friction
    exceeds kinetic friction.
    """
    mode = segment.mode
    a, fall = mode.a, mode.fall
    end = segment.horizon(remaining)
    lo, opening = 0, not segment.z0 or _opening(segment, z_sign)
    for hi in stretches(segment, end):
        _, _, s, z, _ = segment.state(hi)
        opens = _side(mode.m, z_sign, a, fall * s) > 0
        if hi < end and not opens and s_sign * s > 0 and _vanishes(segment, hi, z):
            return "velocity_zero", *on_plane(segment, hi)
        event = _slip_event(flow, segment, s_sign, z_sign, lo, hi, s, z, opening, opens)
        if event:
            return event
        lo, opening = hi, opens
    if end < remaining:
        raise Undecided
    return _slip_end(flow, segment, s_sign, z_sign, remaining)


def _slip_end(flow, segment, s_sign, z_sign, remaining):
    """Return the event that a slip meets exactly at the end of the time, or ("", remaining, state)."""
    mode, (x, y, s, z, thrust) = segment.mode, segment.state(remaining)
    if mode.m.margin:
        return "", remaining, (x, y, s, z, thrust)
    if _vanishes(segment, remaining, z) and _side(mode.m, z_sign, mode.a, mode.fall * s) < (flow.sigma0 > flow.sigma):
        return "velocity_zero", *on_plane(segment, remaining)
    if vanishing(mode.m, s, segment.size(2, remaining)) and _side(mode.m, s_sign, y, thrust / mode.mu) < 0:
        return "force_zero", *on_level(segment, 0 * remaining, remaining)
    return "", remaining, (x, y, s, z, thrust)


def _side(m, side, one, other):
    """Return the sign of ``side`` times the sum of two terms, or 0 where the sum is zero to rounding."""
    value = side * (one + other)
    return sign_of(value) * (abs(value) > m.slack * (abs(one) + abs(other)))


def _vanishes(segment, t, z):
    m = segment.mode.m
    return not m.margin and vanishing(m, z, segment.size(3, t))


def _opening(segment, z_sign):
    """Tell whether z moves away from the plane at the start; where z' = 0 and z is off the plane, by z'' or z'''."""
    mode = segment.mode
    pull = mode.fall * segment.s0
    rate, margin = mode.a + pull, mode.m.margin
    if abs(rate) <= margin * (mode.a + abs(pull)):
        if segment.z0 * segment.z0 < margin:
            raise Undecided
        rate = rate or mode.fall * (slope(segment) or mode.load - mode.beta * segment.s0)
    return z_sign * rate > 0


def _slip_event(flow, segment, s_sign, z_sign, lo, hi, s, z, opening, opens):
    """Return the event in (lo, hi], a stretch on which s is monotone, or None.

    ``opening`` and ``opens`` tell whether z moves away from the plane at lo and at hi.
    """
    m, t = segment.mode.m, None
    if lost(m, z_sign * z, segment.size(3, hi)):
        t = segment.root(3, 0, _leaving(segment, z_sign, lo, hi, s) if opening else lo, hi, -z_sign)
    elif opens and not opening:
        t = _dip(flow, segment, z_sign, lo, hi)
    if t is not None:
        t, state = on_plane(segment, t)
        hi, s = t, state[2]
        if not lost(m, s_sign * s, segment.size(2, t)):
            return "velocity_zero", t, state
    if lost(m, s_sign * s, segment.size(2, hi)):
        _require_off(lo or segment.s0)
        return "force_zero", *on_level(segment, 0 * hi, segment.root(2, 0, lo, hi, -s_sign))
    return None


def _require_off(start):
    """Raise ``Undecided`` if a motion that passes a surface started on it, and so begins on the other side."""
    if not start:
        raise Undecided


def _leaving(segment, z_sign, lo, hi, s):
    """Return lo, or for a start on the plane z = 0 a time in (lo, hi) at which z is off it, before its root there."""
    if lo or segment.z0:
        return lo
    t = segment.root(2, segment.mode.a / (segment.mode.b - 1), lo, hi, 1 if s > segment.s0 else -1)
    _require_off(decided(segment.mode.m, z_sign * segment.state(t)[3], segment.size(3, t)) > 0)
    return t


def _dip(flow, segment, z_sign, lo, hi):
    """Return the time in (lo, hi) at which z crosses the plane, to be back at hi, or touches it and sticks; or None."""
    mode = segment.mode
    least = segment.root(2, mode.a / (mode.b - 1), lo, hi, z_sign if mode.b < 1 else -z_sign)
    z = segment.state(least)[3]
    if lost(mode.m, z_sign * z, segment.size(3, least)):
        return segment.root(3, 0, lo, least, -z_sign)
    return least if flow.sigma0 > flow.sigma and _vanishes(segment, least, z) else None


def stick_event(flow: RodFlow, segment: RodSegment, s_sign: int, remaining: Number) -> Ended:
    """Return (kind, time, state) of the slip onset, or ("", remaining, state) when the time ends first."""
    lo = 0
    for hi in stretches(segment, remaining):
        s, size = segment.state(hi)[2], segment.size(2, hi)
        for edge, side in flow.edges(s_sign):
            if lost(flow.m, side * (edge - s), abs(edge) + size):
                _require_off(lo or segment.s0 - edge)
                return "slip_onset", *on_level(segment, edge, segment.root(2, edge, lo, hi, side))
        lo = hi
    return _stick_end(flow, segment, s_sign, remaining)


def _stick_end(flow, segment, s_sign, remaining):
    """Return the slip onset that stick meets exactly at the end of the time, or ("", remaining, state)."""
    mode, (x, y, s, z, thrust) = segment.mode, segment.state(remaining)
    for edge, side in () if mode.m.margin else flow.edges(s_sign):
        met = vanishing(mode.m, s - edge, abs(edge) + segment.size(2, remaining))
        if met and _side(mode.m, side, y, thrust / mode.mu) > 0:
            return "slip_onset", *on_level(segment, edge, remaining)
    return "", remaining, (x, y, s, z, thrust)


def refined_event(flow: RodFlow, segment: RodSegment, known: SolvedSegment, s_sign: int, remaining: Number) -> Ended:
    """Return (kind, time, state) of the event or end of a segment, refined from ``known`` in coarser numbers."""
    if not known.kind:
        return "", remaining, segment.state(remaining)
    t = flow.m.number(known.span)
    if known.kind == "velocity_zero":
        return known.kind, *on_plane(segment, t)
    level = 0 * t if known.kind == "force_zero" else flow.nearest_edge(s_sign, known.end[2])
    return known.kind, *on_level(segment, level, t)


def _counterpart(known, done, name):
    """Return the known segment after those ``done``; raises ``Undecided`` unless its mode is ``name``."""
    if len(done) == len(known) or known[len(done)].mode != name:
        raise Undecided
    return known[len(done)]


def on_plane(segment: RodSegment, t: Number) -> tuple[Number, tuple[Number, ...]]:
    """Return the time and the state where z = 0: from t by Newton's method, the last step taken in the state itself."""
    mode = segment.mode
    for _ in range(MOST_STEPS):
        x, y, s, z, thrust = state = segment.state(t)
        fall = mode.a + mode.fall * s
        if not fall or _vanishes(segment, t, z):
            return t, (x, y, s, z - z, thrust)
        if abs(z) > mode.m.root_tol * t * abs(fall):
            raise Undecided
        step, rate = z / fall, y + thrust / mode.mu
        if abs(mode.fall * rate * step * step) <= mode.m.eps * (abs(segment.z0) + abs(fall) * t):
            return t - step, moved_to_plane(mode, state)
        t = t - step
    raise Undecided


def on_level(segment: RodSegment, level: Number, t: Number) -> tuple[Number, tuple[Number, ...]]:
    """Return the time and the state where s = level, as ``on_plane`` does where z = 0."""
    mode = segment.mode
    for _ in range(MOST_STEPS):
        x, y, s, z, thrust = state = segment.state(t)
        rate, missing = y + thrust / mode.mu, level - s
        if not rate:
            return t, (x, level - x, level, z, thrust)
        if abs(missing) > mode.m.root_tol * t * abs(rate):
            raise Undecided
        step = missing / rate
        if abs((thrust - mode.b * rate) / mode.mu * step * step) <= mode.m.eps * (abs(x) + abs(y)):
            return t + step, moved_to_level(mode, state, level)
        t = t + step
    raise Undecided


def stretches(segment: RodSegment, end: Number) -> tuple[Number, ...]:
    """Return the ends of the stretches of (0, end) on which s is monotone: its first three extrema, and ``end``."""
    turn, half = segment.turning(), segment.mode.half_period
    return *(t for t in (turn, turn + half, turn + 2 * half) if t < end), end


def too_many(until: Number, t: Number, x: Number, y: Number, z: Number) -> str:
    """Return the words on a motion that has more events by the time t than are followed."""
    return (f"more than {MOST_EVENTS} events by t = {float(t):.6g} of until = {float(until):.6g}, where (x, y, z) = "
            f"({float(x):.6g}, {float(y):.6g}, {float(z):.6g}); take a smaller until")
