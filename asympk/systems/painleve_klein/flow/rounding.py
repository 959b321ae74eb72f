r"""The rounding error of a run in doubles: a first-order estimate from the segments of the run itself.

Each closed form is a sum, whose error is the rounding of its largest terms; the rounding of its exponents acts like a
relative error of the time. At an event the error of the quantity that vanishes becomes an error of the time; the final
time ``until`` is exact. The derivative of the final state is carried backwards from the end to the start, so that each
error is weighted by its effect on the end: bounds carried forward would grow without reason over many events.
"""

from collections.abc import Sequence

from asympk.arithmetic import UNIT
from asympk.numbers import Number
from asympk.systems.painleve_klein.flow.fastslow import FastSlowSegment, RodMode
from asympk.systems.painleve_klein.flow.segments import SolvedSegment

CALM_SEGMENTS = 6  # a run with more is never taken as calm


def calm(segments: Sequence[SolvedSegment], until: Number) -> bool:
    """Tell whether nothing in a run can amplify rounding: a quick test that makes ``estimated_error`` unnecessary.

    A calm run has few segments, each of two well separated exponentials; no growing part of it comes from a
    cancellation; it meets events at a speed that is not small; drifts and final rates are in proportion to the path.
    """
    if len(segments) > CALM_SEGMENTS:
        return False
    size = 1.0
    for _, _, segment, kind, span, (x, y, s, z, thrust) in segments:
        if segment.short:
            return False
        mode, size = segment.mode, max(size, x, -x, z, -z)
        if mode.rest * span > 4.0 * size or -mode.rest * span > 4.0 * size:
            return False
        if mode.fast_rate > 0 and not segment.known and 4.0 * abs(segment.fast) < abs(segment.s0) + abs(mode.line):
            return False
        if kind == "velocity_zero":
            if 16.0 * abs(mode.a + mode.fall * s) < 1.0 + abs(s):
                return False
        elif kind and 16.0 * abs(y + thrust / mode.mu) < 1.0 + abs(y):
            return False
    return (abs(y) + abs(mode.a + mode.fall * s)) * until < 4.0 * size


def largest_state(segments: Sequence[SolvedSegment]) -> Number:
    """Return the largest of 1, |x|, |z| at the start, the events and the end."""
    first = segments[0].segment
    size = max(1, abs(first.x0), abs(first.z0))
    for segment in segments:
        x, _, _, z, _ = segment.end
        size = max(size, x, -x, z, -z)
    return size


def rates_at(mode: RodMode, state: tuple[Number, ...]) -> tuple[Number, Number, Number]:
    """Return (x', s', z') at a state."""
    _, y, s, _, thrust = state
    return y, y + thrust / mode.mu, mode.a + mode.fall * s if mode.a else 0.0


def _rounded(segment, t, state):
    """Return the rounding errors of x, s and z that a segment itself adds, and the error of its time."""
    mode = segment.mode
    if type(segment) is FastSlowSegment and t >= segment.short:
        fast_x, fast_z, slow_z, lift, rest, rate = map(
            abs, (mode.fast_x, mode.fast_z, mode.slow_z, mode.lift, mode.rest, mode.fast_rate))
        fast0, slow0, q = abs(segment.fast), abs(segment.slow), min(1.0, t)
        fast = min(1.0, rate * t) * max(fast0, fast0 * mode.m.exp(mode.fast_rate * t))
        lx = abs(state[0]) + abs(segment.x0) + fast_x * fast + (slow0 + rest) * q
        ls = abs(state[2]) + rest + lift * slow0
        lz = abs(segment.z0) + rest * t + fast_z * fast + slow_z * (slow0 + rest) * q
        return UNIT * lx, UNIT * ls, UNIT * lz, UNIT * 2 * t
    rate, g, h, k = map(abs, segment.responses(t))
    x, y, s, beta = abs(segment.x0), abs(segment.y0), abs(segment.s0), abs(mode.beta)
    eh, ek = (h, k) if t < segment.short else ((1 + rate) / beta + g, (t + g) / beta)
    lx = x + (beta * x + mode.load) * (h + eh) + y * g
    ls = s * rate + y * g + mode.load * (g + h + eh)
    lz = abs(segment.z0) + mode.a * t + abs(mode.fall) * (s * g + y * (h + eh) + mode.load * (k + ek))
    return UNIT * lx, UNIT * ls, UNIT * lz, UNIT * 3 * t


def estimated_error(segments: Sequence[SolvedSegment]) -> float:
    """Estimate the error of (x, z) at the end, relative to the largest of 1, |x|, |z|; NaN where doubles overflow."""
    dx, _, dz = rates_at(segments[-1].segment.mode, segments[-1].end)
    of_x, of_z = (_weighed(segments, row) for row in ((1.0, 0.0, 0.0, -dx), (0.0, 0.0, 1.0, -dz)))
    return (max(of_x, of_z) + 0 * (of_x + of_z)) / largest_state(segments)


def _weighed(segments, row):
    px, ps, pz, pt = row
    error = 0.0
    for _, start, segment, kind, span, end in reversed(segments):
        mode = segment.mode
        dx, ds, dz = rates_at(mode, end)
        if kind == "velocity_zero":
            pz = -(px * dx + ps * ds + pt) / dz
        elif kind:
            ps = -(px * dx + pz * dz + pt) / ds
        lx, ls, lz, clock = _rounded(segment, span, end)
        error += abs(px) * lx + abs(ps) * ls + abs(pz) * lz + abs(pt) * (clock + UNIT * (start + span))
        rate, g, h = _derivatives(segment, span)
        px, ps = (px * (1 - mode.beta * h - g) - ps * g - pz * mode.fall * h,
                  px * g + ps * (rate + g) + pz * mode.fall * (g + h))
        error += abs(ps) * _misplaced(segment)
    return error


def _derivatives(segment, t):
    """Return (g', g, h) at t, from which the derivatives of the state by the start follow."""
    mode = segment.mode
    if type(segment) is not FastSlowSegment or t < segment.short:
        return segment.responses(t)[:3]
    fast, slow = mode.m.exp(mode.fast_rate * t), mode.m.exp(mode.slow_rate * t)
    g = (fast - slow) / mode.gap
    rate = (mode.fast_rate * fast - mode.slow_rate * slow) / mode.gap
    return rate, g, (1 - rate) / mode.beta - g


def _misplaced(segment):
    """Return the error of s at the start that is equivalent to rounding the deviation from the slow line."""
    if type(segment) is not FastSlowSegment:
        return UNIT * abs(segment.s0)
    if segment.known:
        return UNIT * abs(segment.fast)
    return UNIT * (abs(segment.s0) + abs(segment.mode.line) + abs(segment.mode.lift * segment.x0))
