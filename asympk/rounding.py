r"""How far rounding carries a run in doubles: a first-order account that a run gives of itself.

Each closed form is a sum, and is wrong by the rounding of its largest terms; it also runs on a clock that is wrong in
proportion, because its exponents are rounded. An event turns the error of what vanishes there into one of the time;
at ``until`` time is exact again. ``forward`` carries bounds from event to event, all signs taken for the worst: quick,
and tight for a few events. Over many events such bounds grow without reason, and ``backward`` carries the derivative
of the final state instead, from the end to the start, so that each error is weighed by what becomes of it.
"""

from asympk.fastslow import FastSlowSegment

UNIT = 2.0**-53


def estimate(solution, enough):
    """Estimate the error of (x, z) at the end, relative to the largest of 1, |x|, |z|, no better than ``enough``."""
    if not _finite(solution):
        return float("inf")
    error = forward(solution)
    return error if error <= enough else backward(solution)


def _finite(solution):
    total = sum(solution.final)
    for segment in solution.segments:
        total += segment.x0 + segment.y0 + segment.z0
    return total - total == 0


def legs(solution):
    """Return (segment, duration, kind of the event that ends it or "", state (x, y, s, z) there) in order of time."""
    segments = solution.segments
    ends = [(after.x0, after.y0, after.s0, after.z0) for after in segments[1:]]
    kinds = [event.kind for event in solution.events]
    return list(zip(segments, solution.spans, [*kinds, ""], [*ends, solution.final], strict=True))


def largest(solution):
    """Return the largest of 1, |x|, |z| at the start, the events and the end."""
    x, _, _, z = solution.final
    return max(1, abs(x), abs(z), *[max(abs(leg.x0), abs(leg.z0)) for leg in solution.segments])


def rates(segment, t, state):
    """Return (x', s', z') at t."""
    mode, (_, y, s, _) = segment.mode, state
    return y, y + segment.thrust(t, s) / mode.mu, mode.a + mode.fall * s if mode.a else 0.0


def forward(solution):
    """Bound the error at the end by carrying bounds of the errors of x, s, z and of the time."""
    ex = es = ez = late = 0.0
    for segment, t, kind, state in legs(solution):
        spread = _fast_slow if type(segment) is FastSlowSegment else _smooth
        ex, es, ez, lag = spread(segment, t, kind, state, ex, es, ez)
        late += lag + UNIT * t
    dx, _, dz = rates(segment, t, state)
    return max(ex + abs(dx) * late, ez + abs(dz) * late) / largest(solution)


def _fast_slow(segment, t, kind, state, ex, es, ez):
    mode = segment.mode
    fast0, slow0 = abs(segment.fast), abs(segment.slow)
    fast_x, fast_z, slow_z, lift = abs(mode.fast_x), abs(mode.fast_z), abs(mode.slow_z), abs(mode.lift)
    p, q = abs(mode.fast_rate * t), min(1.0, abs(mode.slow_rate * t))
    ef = UNIT * fast0
    if not segment.known:
        ef += es + lift * ex + UNIT * (abs(segment.s0) + abs(mode.line) + lift * abs(segment.x0))
    ec = ex + fast_x * ef + UNIT * (abs(segment.x0) + abs(mode.rest))
    growth = abs(mode.m.exp(mode.fast_rate * t))
    fast = fast0 * growth
    off = ef * growth + UNIT * p * fast
    sums = abs(segment.z0) + abs(mode.rest) * t + slow_z * slow0 * q
    bent = ez + UNIT * sums + slow_z * ec * q
    ex += ec * q + UNIT * (abs(state[0]) + slow0 * q)
    if kind == "velocity_zero" and p * fast * fast_z > sums:
        lag = off / (fast * abs(mode.fast_rate))
        gained = (bent + (abs(mode.rest) + slow_z * slow0) * lag) / fast_z + UNIT * fast
        return ex + fast_x * gained + slow0 * lag, abs(mode.fast_s) * (gained + ef) + lift * ec, 0.0, lag
    gained = off + min(1.0, p) * (ef + UNIT * max(fast, fast0))
    es = abs(mode.fast_s) * off + lift * ec + UNIT * (abs(mode.rest) + lift * slow0 + abs(state[2]))
    return _projected(segment, t, kind, state, ex + fast_x * gained, es, bent + fast_z * gained)


def _smooth(segment, t, kind, state, ex, es, ez):
    rate, g, h, _ = map(abs, segment.responses(t) if t else (1.0, 0.0, 0.0, 0.0))
    lx, ls, lz, clock = _rounded(segment, t, state)
    dx, ds, dz = map(abs, rates(segment, t, state))
    mode = segment.mode
    x = ex * (1 + abs(mode.beta) * h + g) + es * g + lx + clock * dx
    s = es * (rate + g) + ex * g + ls + clock * ds
    z = ez + abs(mode.fall) * (es * (g + h) + ex * h) + lz + clock * dz
    return _projected(segment, t, kind, state, x, s, z)


def _projected(segment, t, kind, state, ex, es, ez):
    """Return the errors of x, s, z after the event, and that of its time."""
    if not kind:
        return ex, es, ez, 0.0
    dx, ds, dz = map(abs, rates(segment, t, state))
    if kind == "velocity_zero":
        lag = ez / dz
        return ex + dx * lag, es + ds * lag, 0.0, lag
    lag = es / ds
    return ex + dx * lag, 0.0, ez + dz * lag, lag


def _rounded(segment, t, state):
    """Return the rounding errors of x, s, z that a segment makes by itself, and that of its clock."""
    mode = segment.mode
    x, _, s, _ = map(abs, state)
    if type(segment) is FastSlowSegment and t >= segment.short:
        fast0, slow0, rest = abs(segment.fast), abs(segment.slow), abs(mode.rest)
        p, q = abs(mode.fast_rate * t), min(1.0, abs(mode.slow_rate) * t)
        fast = min(1.0, p) * max(fast0, fast0 * mode.m.exp(mode.fast_rate * t))
        lx = x + abs(segment.x0) + abs(mode.fast_x) * fast + (slow0 + rest) * q
        ls = s + rest + abs(mode.lift) * slow0
        lz = abs(segment.z0) + rest * t + abs(mode.fast_z) * fast + abs(mode.slow_z) * (slow0 + rest) * q
        return UNIT * lx, UNIT * ls, UNIT * lz, UNIT * 2 * t
    rate, g, h, k = map(abs, segment.responses(t) if t else (1.0, 0.0, 0.0, 0.0))
    x, y, s, beta = abs(segment.x0), abs(segment.y0), abs(segment.s0), abs(mode.beta)
    eh, ek = (h, k) if t < segment.short else ((1 + rate) / beta + g, (t + g) / beta)
    lx = x + (beta * x + mode.load) * (h + eh) + y * g
    ls = s * rate + y * g + mode.load * (g + h + eh)
    lz = abs(segment.z0) + mode.a * t + abs(mode.fall) * (s * g + y * (h + eh) + mode.load * (k + ek))
    return UNIT * lx, UNIT * ls, UNIT * lz, UNIT * 3 * t


def backward(solution):
    """Bound the error at the end by the derivatives of the final (x, z) with respect to every state before."""
    steps = legs(solution)
    clocks = []
    time = 0.0
    for _, t, _, _ in steps:
        time += t
        clocks.append(UNIT * time)
    segment, t, _, state = steps[-1]
    dx, _, dz = rates(segment, t, state)
    total = 0.0
    for row in ((1.0, 0.0, 0.0, -dx), (0.0, 0.0, 1.0, -dz)):
        total = max(total, _weighed(steps, clocks, row))
    return total / largest(solution)


def _weighed(steps, clocks, row):
    px, ps, pz, pt = row
    error = 0.0
    for (segment, t, kind, state), late in zip(reversed(steps), reversed(clocks), strict=True):
        dx, ds, dz = rates(segment, t, state)
        if kind == "velocity_zero":
            pz = -(px * dx + ps * ds + pt) / dz
        elif kind:
            ps = -(px * dx + pz * dz + pt) / ds
        lx, ls, lz, clock = _rounded(segment, t, state)
        error += abs(px) * lx + abs(ps) * ls + abs(pz) * lz + abs(pt) * (clock + late)
        mode = segment.mode
        rate, g, h = _derivatives(segment, t)
        px, ps = (px * (1 - mode.beta * h - g) - ps * g - pz * mode.fall * h,
                  px * g + ps * (rate + g) + pz * mode.fall * (g + h))
        error += abs(ps) * _misplaced(segment)
    return error


def _derivatives(segment, t):
    """Return (g', g, h) at t: the derivatives of the state by the start are made of them."""
    mode = segment.mode
    if type(segment) is not FastSlowSegment or t < segment.short:
        return segment.responses(t)[:3] if t else (1.0, 0.0, 0.0)
    fast, slow = mode.m.exp(mode.fast_rate * t), mode.m.exp(mode.slow_rate * t)
    g = (fast - slow) / mode.gap
    rate = (mode.fast_rate * fast - mode.slow_rate * slow) / mode.gap
    return rate, g, (1 - rate) / mode.beta - g


def _misplaced(segment):
    """Return the error of s at the start that rounding the deviation from the slow line amounts to."""
    if type(segment) is not FastSlowSegment:
        return UNIT * abs(segment.s0)
    if segment.known:
        return UNIT * abs(segment.fast)
    mode = segment.mode
    return UNIT * (abs(segment.s0) + abs(mode.line) + abs(mode.lift * segment.x0))
