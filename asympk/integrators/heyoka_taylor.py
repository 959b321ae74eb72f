"""Heyoka: Taylor series, compiled once per mode and tolerance; zeros of guards are found on its polynomials."""

from functools import cache, lru_cache
from math import inf, isfinite
from time import monotonic

from asympk.automaton.compiled import function, namespace
from asympk.automaton.loop import Segment, lost_with
from asympk.automaton.numericmode import NumericMode
from asympk.errors import InputError
from asympk.integrators.integrate import Settings, Work, missing
from asympk.integrators.stepwise import PARTS, misses_rates

CHUNK = 1000  # steps between two looks at the clock
FINEST = 2.3e-16  # the smallest tolerance that is passed on: about the spacing of doubles
MARGIN = 8 * 2.0**-52  # a guard that starts at 0 counts as lost only below -MARGIN, so that rounding is no event


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    solver = _compiled(settings.method, mode.mode, mode.coefficients, max(min(settings.rtol, settings.atol), FINEST))
    if solver.with_events:
        solver.reset_cooldowns()
    solver.time, solver.state[:] = t, state
    solver.pars[:] = [*mode.p, *(MARGIN * (abs(v) < MARGIN) for v in mode.guard_values(t, state))]
    steps, short, hit, times = 0, "", None, settings.times
    samples, longest, due = list[tuple[float, ...]](), settings.longest, inf
    while hit is None and not short and solver.time < until:
        chunk = min(CHUNK, settings.steps - steps)
        if chunk <= 0 or monotonic() > settings.deadline:
            short = f"{'step' if chunk <= 0 else 'time'} limit reached"
            break
        last = float(solver.time), tuple(solver.state.tolist())
        outcome, *_, made, output, _ = solver.propagate_until(
            min(due, until), max_steps=chunk, max_delta_t=longest, c_output=bool(times))
        steps += made
        hit, short = _reason(int(outcome))
        if hit is not None and (length := _missed(solver, mode, settings)):
            longest = length / (PARTS - 1 / 2)  # so that the event is not between two steps, with one of length 0
            hit, due = None, float(solver.time) + longest
            _go_back(solver, length)
        elif solver.time >= due:
            longest, due = settings.longest, inf
        while len(samples) < len(times) and times[len(samples)] <= solver.time and output is not None:
            samples.append(tuple(output(times[len(samples)]).tolist()))
    end, state = (float(solver.time), tuple(solver.state.tolist())) if isfinite(solver.time) else last
    together = lost_with(mode, hit, end, state)
    return Segment(end, state, hit, Work(steps, steps, 0), short, tuple(samples), together)


def _missed(solver, mode, settings):
    """Return the length of the last step if at the event that ends it, it misses the rates there; otherwise 0."""
    t, state, h = float(solver.time), tuple(solver.state.tolist()), solver.last_h
    return h if h and misses_rates(mode, lambda at: solver.update_d_output(at).copy(), t, state, h, settings) else 0


def _go_back(solver, length):
    """Go back by the length of the last step, to its start."""
    begin = float(solver.time) - length
    state = solver.update_d_output(begin).copy()
    solver.time, solver.state[:] = begin, state
    solver.reset_cooldowns()


def _reason(outcome):
    import heyoka as hy

    if int(hy.taylor_outcome.success) < outcome < 0:  # a terminal event k stops with -k - 1
        return -1 - outcome, ""
    return None, "left the range of floats" if outcome == int(hy.taylor_outcome.err_nf_state) else ""


@lru_cache(maxsize=32)
def _compiled(method, mode, coefficients, tol):
    """Return the compiled integrator of a mode; its parameters are those of the system and a margin for every guard."""
    try:
        import heyoka as hy
    except ImportError as error:
        raise missing(method) from error
    hy.set_logger_level_critical()  # its warnings go to stdout; what they warn of is told by the segment
    system, count = mode.system, len(mode.system.parameters) + len(coefficients)
    states = hy.make_vars(*(f"w{k}" for k in range(len(system.states))))
    states = states if isinstance(states, list) else [states]
    arguments = (hy.time, *states, *(hy.par[k] for k in range(count)))
    try:
        rates, guards = (function(system, outputs, "math", _functions(), (), True, coefficients)(*arguments)
                         for outputs in (mode.rates, mode.guard_values))
    except (AttributeError, TypeError) as reason:
        raise InputError(f"method {method!r}: the system has a function that heyoka lacks ({reason})") from None
    events = [hy.t_event(g + hy.par[count + k], direction=hy.event_direction.negative) for k, g in enumerate(guards)]
    field = list(zip(states, (hy.expression(0.0) + r for r in rates), strict=True))
    pars = [0.0] * (count + len(guards))
    return hy.taylor_adaptive(field, [0.0] * len(states), tol=tol, t_events=events, pars=pars)


@cache
def _functions():
    import math
    import operator

    import heyoka as hy

    names = ("sqrt", "exp", "log", "erf", "sin", "cos", "tan", "asin", "acos", "atan", "atan2",
             "sinh", "cosh", "tanh", "asinh", "acosh", "atanh")
    return namespace(pi=math.pi, e=math.e, pow=operator.pow, **{name: getattr(hy, name) for name in names})
