"""Heyoka: Taylor series, compiled once per problem and tolerance; guards are roots of its polynomials."""

from functools import lru_cache
from time import monotonic

from asympk.integrators.integrate import Leg, Work, missing

CHUNK = 1000  # steps between two looks at the clock
FINEST = 2.3e-16
MARGIN = 8 * 2.0**-52  # a guard that starts on its surface is lost this far below it: rounding is no event


def advance(method, piece, t, state, until, rtol, atol, limits, times):
    """Follow ``piece`` from (t, state) until a guard is lost or ``until``, looking in at ``times``."""
    problem = piece.problem
    tracer = (problem.rhs, problem.load, problem.drive, len(piece.p))
    solver = _compiled(method, tracer, max(min(rtol, atol), FINEST))
    solver.reset_cooldowns()
    solver.time, solver.state[:] = t, state
    margins = [MARGIN * (abs(v) < MARGIN) for v in piece.guard_values(state)]
    solver.pars[:] = [*piece.p, *piece.guards[0], margins[0], *piece.guards[1], margins[1]]
    steps, samples, short, hit = 0, [], "", None
    while hit is None and not short and solver.time < until:
        chunk = min(CHUNK, limits.steps - steps)
        if chunk <= 0 or monotonic() > limits.deadline:
            short = f"{'step' if chunk <= 0 else 'time'} limit reached"
            break
        outcome, *_, made, output, _ = solver.propagate_until(until, max_steps=chunk, c_output=bool(times))
        steps += made
        hit, short = _reason(int(outcome))
        while len(samples) < len(times) and times[len(samples)] <= solver.time and output is not None:
            samples.append(tuple(output(times[len(samples)]).tolist()))
    state = tuple(solver.state.tolist())
    return Leg(float(solver.time), state, hit, Work(steps, steps, 0), short, tuple(samples))


def _reason(outcome):
    import heyoka as hy

    if -3 < outcome < 0:  # a terminal event k stops with -k - 1
        return -1 - outcome, ""
    return None, "left the range of floats" if outcome == int(hy.taylor_outcome.err_nf_state) else ""


@lru_cache(maxsize=32)
def _compiled(method, tracer, tol):
    """Return the integrator of a traced field; its parameters are those of the phase, then two guards."""
    try:
        import heyoka as hy
    except ImportError as error:
        raise missing(method) from error
    rhs, load, drive, count = tracer
    x, y, z = hy.make_vars("x", "y", "z")
    p = [hy.par[k] for k in range(count)]
    measures = (load(x, y, z, p), drive(x, y, z, p), z, 1)
    guards = [sum(hy.par[count + 4 * k + i] * m for i, m in enumerate(measures)) for k in (0, 1)]
    events = [hy.t_event(g, direction=hy.event_direction.negative) for g in guards]
    field = list(zip((x, y, z), rhs(x, y, z, p), strict=True))
    return hy.taylor_adaptive(field, [0.0] * 3, tol=tol, t_events=events, pars=[0.0] * (count + 8))
