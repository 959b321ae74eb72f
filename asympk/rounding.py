r"""How far rounding carries a run in doubles: a first-order account, taken for the worst in every sign.

Each closed form is a sum, and is wrong by the rounding of its largest terms; it also runs on a clock that is wrong in
proportion, because its exponents are rounded. The errors that a segment starts with are carried on by the derivative
of the flow. An event turns the error of what vanishes there into one of the time; at ``until`` time is exact again.
"""

from asympk.fastslow import FastSlowSegment

UNIT = 2.0**-53


def estimate(solution):
    """Estimate the error of (x, z) at the end, relative to the largest of 1, |x|, |z| on the path."""
    ex = es = ez = late = 0.0
    largest = 1.0
    segments, last = solution.segments, len(solution.segments) - 1
    for i, segment in enumerate(segments):
        if i < last:
            after, kind = segments[i + 1], solution.events[i].kind
            state = after.x0, after.y0, after.s0, after.z0
        else:
            kind, state = "", solution.final
        t = solution.spans[i]
        spread = _fast_slow if type(segment) is FastSlowSegment else _smooth
        ex, es, ez, lag = spread(segment, t, kind, state, ex, es, ez)
        late += lag + UNIT * t
        largest = max(largest, abs(segment.x0), abs(segment.z0), abs(state[0]), abs(state[3]))
    _, y, s, _ = state
    mode = segment.mode
    fall = abs(mode.a + (1 - mode.b) * s) if solution.modes[last] != "stick" else 0.0
    return max(ex + abs(y) * late, ez + fall * late) / largest


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
        return (ex + fast_x * gained + slow0 * lag, abs(mode.fast_s) * (gained + ef) + lift * ec, 0.0, lag)
    gained = off + min(1.0, p) * ef + UNIT * min(1.0, p) * max(fast, fast0)
    es = abs(mode.fast_s) * off + lift * ec + UNIT * (abs(mode.rest) + abs(state[2]))
    return _projected(mode, kind, state, ex + fast_x * gained, es, bent + fast_z * gained)


def _smooth(segment, t, kind, state, ex, es, ez):
    mode = segment.mode
    rate, g, h, k = map(abs, segment.responses(t)) if t else (1.0, 0.0, 0.0, 0.0)
    x0, y0, s0, load, beta, bend = map(abs, (
        segment.x0, segment.y0, segment.s0, mode.a / mode.mu, mode.beta, 1 - mode.b))
    eh, ek = UNIT * h, UNIT * k
    if t >= segment.short:
        eh, ek = UNIT * ((1 + rate) / beta + g), UNIT * (t + g) / beta
    _, y, s, _ = state
    clock = 3 * UNIT * t
    x1 = (ex * (1 + beta * h + g) + es * g + UNIT * (x0 * (1 + beta * h) + y0 * g + load * h)
          + (load + beta * x0) * eh + clock * abs(y))
    s1 = es * (rate + g) + ex * g + UNIT * (s0 * rate + y0 * g + load * (g + h)) + load * eh + clock * (
        abs(y) + abs(mode.a - mode.b * s) / mode.mu)
    z1 = (ez + bend * (es * (g + h) + ex * h) + UNIT * (abs(segment.z0) + mode.a * t)
          + bend * (UNIT * (s0 * g + y0 * h + load * k) + y0 * eh + load * ek)
          + clock * abs(mode.a + (1 - mode.b) * s))
    return _projected(mode, kind, state, x1, s1, z1)


def _projected(mode, kind, state, ex, es, ez):
    """Return the errors after the event, and that of its time."""
    _, y, s, _ = state
    fall, drift = abs(mode.a + (1 - mode.b) * s), abs(y + (mode.a - mode.b * s) / mode.mu)
    if kind == "velocity_zero":
        lag = ez / fall
        return ex + abs(y) * lag, es + drift * lag, 0.0, lag
    if kind:
        lag = es / drift
        return ex + abs(y) * lag, 0.0, (ez + fall * lag if kind == "force_zero" else 0.0), lag
    return ex, es, ez, 0.0
