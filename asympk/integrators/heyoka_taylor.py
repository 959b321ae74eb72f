"""Heyoka: Taylor series, compiled once per mode and tolerance; zeros of guards are found on its polynomials."""

from contextlib import suppress
from functools import cache, lru_cache
from math import inf, isfinite
from time import monotonic
from typing import NamedTuple

import numpy as np
import sympy as sp

from asympk.automaton.compiled import function, namespace
from asympk.automaton.loop import Segment, lost_with
from asympk.automaton.numericmode import NumericMode
from asympk.errors import InputError
from asympk.integrators.integrate import Settings, Work, missing
from asympk.integrators.stepwise import PARTS, allowed_error, is_missed
from asympk.symbolic.long import atoms, symbols_in

COARSE = 100  # multiple of its allowed error by which a step may miss the rates at its end
CHUNK = 4000  # steps between two looks at the clock
FEW = 100  # steps that are made one by one where each is looked at
FINEST = 2.3e-16  # the smallest tolerance that is passed on: about the spacing of doubles
LOW = (2, 3, 4)  # powers whose rise no step passes over
SHORTEST = 2.0**-44  # part of the time up to which steps are not divided: they are at a pole
MARGIN = 8 * 2.0**-52  # a guard that starts at 0 counts as lost only below -MARGIN, so that rounding is no event


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    solver = _compiled(settings.method, mode.mode, mode.coefficients, max(min(settings.rtol, settings.atol), FINEST))
    given = [*mode.p, *(MARGIN * (abs(v) < MARGIN) for v in mode.guard_values(t, state))]
    solver.pars[:] = given[: len(solver.pars)]  # it has none beyond the last one in rates and guards
    _place(solver, t, state)
    steps, short, hit, times, looked = 0, "", None, settings.times, _may_hide_rises(mode.mode)
    samples, longest, due = list[tuple[float, ...]](), settings.longest, inf
    while hit is None and not short and solver.time < until:
        propagate = _one_by_one if looked and not times and steps < FEW else _at_once
        chunk = min(FEW if propagate is _one_by_one else CHUNK, settings.steps - steps)
        if chunk <= 0 or monotonic() > settings.deadline:
            short = f"{'step' if chunk <= 0 else 'time'} limit reached"
            break
        last = float(solver.time), tuple(solver.state.tolist())
        hit, short, made, found = propagate(solver, min(due, until), chunk, longest, looked or bool(times))
        if looked and found is not None and (missed := _first_missed(found, solver, mode, settings)) is not None:
            made, begin, length = missed + 1, found.times[missed], found.times[missed + 1] - found.times[missed]
            longest = length / (PARTS - 1 / 2)  # so that an event is not between two steps, with one of length 0
            hit, short, due = None, "", begin + length + longest
            _place(solver, begin, found.tcs[missed, :, 0])
        elif solver.time >= due:
            longest, due = settings.longest, inf
        steps += made
        while len(samples) < len(times) and times[len(samples)] <= solver.time and found is not None:
            samples.append(tuple(found(times[len(samples)]).tolist()))
    end, state = (float(solver.time), tuple(solver.state.tolist())) if isfinite(solver.time) else last
    together = lost_with(mode, hit, end, state)
    return Segment(end, state, hit, Work(steps, steps, 0), short, tuple(samples), together)


def _at_once(solver, end, most, longest, keep):
    """Propagate a solver; return (guard lost or None, what stops it or "", number of steps, their output or None)."""
    outcome, *_, made, output, _ = solver.propagate_until(end, max_steps=most, max_delta_t=longest, c_output=keep)
    return *_reason(int(outcome)), made, output


class _Steps(NamedTuple):
    """The times between steps, and the Taylor coefficients of the states in each, as in heyoka's own output."""

    times: list[float]
    tcs: np.ndarray


def _one_by_one(solver, end, most, longest, _):
    """Do the same for a few steps, of which heyoka's own output takes longer: it is compiled anew each time."""
    times, series, hit, short = [float(solver.time)], [], None, ""
    while len(series) < most and hit is None and not short and times[-1] < end:
        outcome, *_, made, _, _ = solver.propagate_until(end, max_steps=1, max_delta_t=longest, write_tc=True)
        hit, short = _reason(int(outcome))
        if made:
            times.append(float(solver.time))
            series.append(solver.tc.copy())
    return hit, short, len(series), _Steps(times, np.array(series)) if series else None


def _place(solver, t, state):
    """Let a solver go on from a time and a state, where any event may happen at once."""
    if solver.with_events:
        solver.reset_cooldowns()
    solver.time, solver.state[:] = t, state


@lru_cache(maxsize=256)
def _may_hide_rises(mode):
    """Tell whether a Taylor series of the rates may be blind to a rise nearby, as that of exp(-100 v**2) at v = 2 is.

    Those of low powers, sines and cosines are not.
    """
    moving = {*mode.system.states, mode.system.time}
    parts = atoms(sp.Tuple(*mode.rates), sp.Function, sp.Pow)
    return any(symbols_in(part) & moving for part in parts
               if not (isinstance(part, sp.sin | sp.cos) or (part.is_Pow and part.exp in LOW)))


@np.errstate(all="ignore")  # the last series may have overflowed
def _first_missed(found, solver, mode, settings):
    """Return the index of the first step whose series has another slope at its end than the rates there, or None.

    At the end of all steps but the last, these are the first coefficients of the next series.
    """
    times, series = np.array(found.times), found.tcs
    lengths, slopes = np.diff(times)[:, None], 0.0
    for k in range(series.shape[2] - 1, 0, -1):
        slopes = slopes * lengths + k * series[:, :, k]
    ends, last = np.vstack([series[1:, :, 0], solver.state]), slopes[-1]
    with suppress(ArithmeticError, ValueError):
        last = mode.rhs(times[-1], solver.state.tolist())
    missed, allowed = lengths * (slopes - np.vstack([series[1:, :, 1], last])), COARSE * allowed_error(ends, settings)
    divisible = lengths[:, 0] > SHORTEST * times[1:]
    for k in np.flatnonzero(divisible & (abs(missed) > allowed).any(axis=1)).tolist():
        with suppress(ArithmeticError, ValueError):  # a step beside which the rates have no slope tells nothing
            if is_missed(mode, missed[k], allowed[k], float(times[k + 1]), tuple(ends[k]), float(lengths[k, 0])):
                return k
    return None


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
    return hy.taylor_adaptive(field, [0.0] * len(states), tol=tol, t_events=events)


@cache
def _functions():
    import math
    import operator

    import heyoka as hy

    names = ("sqrt", "exp", "log", "erf", "sin", "cos", "tan", "asin", "acos", "atan", "atan2",
             "sinh", "cosh", "tanh", "asinh", "acosh", "atanh")
    return namespace(pi=math.pi, e=math.e, pow=operator.pow, **{name: _lifted(getattr(hy, name)) for name in names})


def _lifted(found):
    """Return a function of heyoka's expressions, of numbers, too."""
    import heyoka as hy

    return lambda *given: found(*(hy.expression(float(v)) if isinstance(v, int | float) else v for v in given))
