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
    return error if error <= enough else min(error, backward(solution))


def _finite(solution):
    total = 0.0
    for x, y, _, z, _ in solution.ends:
        total += x + y + z
    return total - total == 0


def largest(solution):
    """Return the largest of 1, |x|, |z| at the start, the events and the end."""
    first = solution.segments[0]
    return max(1, abs(first.x0), abs(first.z0), *[abs(end[i]) for end in solution.ends for i in (0, 3)])


def legs(solution):
    """Return (segment, duration, kind of the event that ends it or "", state at its end) in order of time."""
    kinds = [event.kind for event in solution.events]
    return list(zip(solution.segments, solution.spans, [*kinds, ""], solution.ends, strict=True))


def rates(mode, state):
    """Return (x', s', z') at a state."""
    _, y, s, _, thrust = state
    return y, y + thrust / mode.mu, mode.a + mode.fall * s if mode.a else 0.0


def forward(solution):
    """Bound the error at the end by carrying bounds of the errors of x, s, z and of the time."""
    ex = es = ez = late = 0.0
    for segment, t, kind, state in legs(solution):
        spread = _fast_slow if type(segment) is FastSlowSegment else _smooth
        ex, es, ez, lag = spread(segment, t, kind, state, ex, es, ez)
        late += lag + UNIT * t
    dx, _, dz = rates(segment.mode, state)
    return max(ex + abs(dx) * late, ez + abs(dz) * late) / largest(solution)


def _fast_slow(segment, t, kind, state, ex, es, ez):
    mode, fast0, slow0 = segment.mode, abs(segment.fast), abs(segment.slow)
    fast_x, fast_s, fast_z, slow_z, lift, line, rest, rate = _sizes(mode)
    p, q = rate * t, t if t < 1.0 else 1.0
    ef = UNIT * fast0
    if not segment.known:
        ef += es + lift * ex + UNIT * (abs(segment.s0) + line + lift * abs(segment.x0))
    ec = ex + fast_x * ef + UNIT * (abs(segment.x0) + rest)
    growth = mode.m.exp(mode.fast_rate * t)
    fast = fast0 * growth
    off = ef * growth + UNIT * p * fast
    sums = abs(segment.z0) + rest * t + slow_z * slow0 * q
    bent = ez + UNIT * sums + slow_z * ec * q
    ex += ec * q + UNIT * (abs(state[0]) + slow0 * q)
    if kind == "velocity_zero" and p * fast * fast_z > sums:
        lag = off / (fast * rate)
        gained = (bent + (rest + slow_z * slow0) * lag) / fast_z + UNIT * fast
        return ex + fast_x * gained + slow0 * lag, fast_s * (gained + ef) + lift * ec, 0.0, lag
    gained = off + (ef + UNIT * (fast if fast > fast0 else fast0)) * (p if p < 1.0 else 1.0)
    es = fast_s * off + lift * (ec + UNIT * slow0) + UNIT * (rest + abs(state[2]))
    return _projected(mode, kind, state, ex + fast_x * gained, es, bent + fast_z * gained)


def _sizes(mode):
    try:
        return mode.sizes
    except AttributeError:
        mode.sizes = tuple(map(abs, (mode.fast_x, mode.fast_s, mode.fast_z, mode.slow_z, mode.lift, mode.line,
                                     mode.rest, mode.fast_rate)))
        return mode.sizes


def _smooth(segment, t, kind, state, ex, es, ez):
    mode = segment.mode
    rate, g, h, _ = map(abs, segment.responses(t))
    lx, ls, lz, clock = _rounded(segment, t, state)
    dx, ds, dz = map(abs, rates(mode, state))
    x = ex * (1 + abs(mode.beta) * h + g) + es * g + lx + clock * dx
    s = es * (rate + g) + ex * g + ls + clock * ds
    z = ez + abs(mode.fall) * (es * (g + h) + ex * h) + lz + clock * dz
    return _projected(mode, kind, state, x, s, z)


def _projected(mode, kind, state, ex, es, ez):
    """Return the errors of x, s, z after the event, and that of its time."""
    if not kind:
        return ex, es, ez, 0.0
    dx, ds, dz = map(abs, rates(mode, state))
    if kind == "velocity_zero":
        lag = ez / dz
        return ex + dx * lag, es + ds * lag, 0.0, lag
    lag = es / ds
    return ex + dx * lag, 0.0, ez + dz * lag, lag


def _rounded(segment, t, state):
    """Return the rounding errors of x, s, z that a segment makes by itself, and that of its clock."""
    mode = segment.mode
    if type(segment) is FastSlowSegment and t >= segment.short:
        fast_x, _, fast_z, slow_z, lift, _, rest, rate = _sizes(mode)
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


def backward(solution):
    """Bound the error at the end by the derivatives of the final (x, z) with respect to every state before."""
    steps = legs(solution)
    segment, _, _, state = steps[-1]
    dx, _, dz = rates(segment.mode, state)
    rows = (1.0, 0.0, 0.0, -dx), (0.0, 0.0, 1.0, -dz)
    return max(_weighed(steps, solution.starts, row) for row in rows) / largest(solution)


def _weighed(steps, starts, row):
    px, ps, pz, pt = row
    error = 0.0
    for (segment, t, kind, state), start in zip(reversed(steps), reversed(starts), strict=True):
        mode = segment.mode
        dx, ds, dz = rates(mode, state)
        if kind == "velocity_zero":
            pz = -(px * dx + ps * ds + pt) / dz
        elif kind:
            ps = -(px * dx + pz * dz + pt) / ds
        lx, ls, lz, clock = _rounded(segment, t, state)
        error += abs(px) * lx + abs(ps) * ls + abs(pz) * lz + abs(pt) * (clock + UNIT * (start + t))
        rate, g, h = _derivatives(segment, t)
        px, ps = (px * (1 - mode.beta * h - g) - ps * g - pz * mode.fall * h,
                  px * g + ps * (rate + g) + pz * mode.fall * (g + h))
        error += abs(ps) * _misplaced(segment)
    return error


def _derivatives(segment, t):
    """Return (g', g, h) at t: the derivatives of the state by the start are made of them."""
    mode = segment.mode
    if type(segment) is not FastSlowSegment or t < segment.short:
        return segment.responses(t)[:3]
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
    return UNIT * (abs(segment.s0) + abs(segment.mode.line) + abs(segment.mode.lift * segment.x0))
