"""Heyoka: Taylor series, compiled once per mode and tolerance; zeros of guards are found on its polynomials."""

from bisect import bisect
from contextlib import suppress
from functools import cache, lru_cache, partial
from itertools import pairwise
from math import inf, isfinite
from time import monotonic
from typing import NamedTuple

import numpy as np
import sympy as sp

from asympk.automaton.compiled import function, namespace
from asympk.automaton.loop import Segment, lost_with
from asympk.automaton.numericmode import NumericMode
from asympk.integrators.integrate import Settings, Work, lacking, missing
from asympk.integrators.stepwise import PARTS, Divisors, allowed_error, is_missed
from asympk.integrators.watch import BESIDE_BUMPS
from asympk.symbolic.derivatives import is_bent
from asympk.symbolic.long import symbols_in
from asympk.symbolic.lowering import NoFunction
from asympk.symbolic.removable import SMALL

COARSE = 100  # multiple of its allowed error by which a step may miss the rates
CHUNK = 4000  # steps between two looks at the clock
FEW = 100  # the same where each step is looked at
FINEST = 2.3e-16  # the smallest tolerance that is passed on: about the spacing of doubles
LOOKS = 8  # times within a step, the end among them, at which its series is compared with the rates
ROUNDS = 4  # of regula falsi between two looks, each about a hundred times as exact as the last
ROUNDED = 2.0**-46  # part of a state and of its change in a step that is rounding
SHORTEST = 2.0**-44  # part of the time up to which steps are not divided: they are at a pole
MARGIN = 8 * 2.0**-52  # a guard that starts at 0 counts as lost only below -MARGIN, so that rounding is no event


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    solver = _compiled(settings.method, mode.mode, mode.coefficients, max(min(settings.rtol, settings.atol), FINEST))
    given, faded = [*mode.p, *(MARGIN * (abs(v) < MARGIN) for v in mode.guard_values(t, state))], mode.faded(t, state)
    given += [-least for least in faded]
    solver.pars[:] = given[: len(solver.pars)]  # it has none beyond the last one in rates and guards
    _place(solver, t, state)
    taylor, divisors, times = _Taylor(solver, mode, settings, faded), Divisors(mode, t, state), settings.times
    steps, short, hit, samples, followed = 0, "", None, list[tuple[float, ...]](), list[_Steps]()
    while hit is None and not short and solver.time < until and not mode.is_beside_limit(solver.time, solver.state):
        chunk = min(FEW if taylor.kept else CHUNK, settings.steps - steps)
        if chunk <= 0 or monotonic() > settings.deadline:
            short = f"{'step' if chunk <= 0 else 'time'} limit reached"
            break
        last = float(solver.time), tuple(solver.state.tolist())
        hit, short, made, found = taylor.steps(until, chunk)
        steps += made
        if found is not None:
            last = found.finite_end()
            short = _passed(divisors, found, hit) or short
            followed += [found] * settings.keep
            samples += [found.at(at) for at in times[len(samples) :] if at <= solver.time]
    end, state = (float(solver.time), tuple(solver.state.tolist())) if np.isfinite(solver.state).all() else last
    within = partial(_within, followed) if followed else None
    together = lost_with(mode, hit, end, state)
    return Segment(end, state, hit, Work(steps, steps, 0), short, tuple(samples), together, within=within)


class _Steps(NamedTuple):
    """The times between steps, and in each step the Taylor coefficients of the states."""

    times: list[float]
    series: np.ndarray

    def at(self, t: float) -> tuple[float, ...]:
        """Return the state at a time."""
        k = min(max(bisect(self.times, t) - 1, 0), len(self.series) - 1)
        return tuple(_summed(self.series[k], t - self.times[k])[0].tolist())

    def finite_end(self) -> tuple[float, tuple[float, ...]]:
        """Return the time and state at the end of the last step, or at its begin if it leads nowhere."""
        end = self.at(self.times[-1])
        return (self.times[-1], end) if all(map(isfinite, end)) else (self.times[-2], self.at(self.times[-2]))


class _Taylor:
    """The steps of a solver in a mode, those that miss something made again in ``PARTS``; ``kept`` where returned."""

    def __init__(self, solver, mode, settings, faded):
        self.solver, self.mode, self.settings, self.faded = solver, mode, settings, faded
        self.looked = not _has_fixed_slopes(mode.mode)
        self.kept = self.looked or settings.keep or bool(settings.times)
        self.longest, self.due = settings.longest, inf

    def steps(self, until, most):
        """Make steps; return (guard lost or None, what stops them or "", their number, those to go by or None)."""
        solver, end, start = self.solver, min(self.due, until), (self.solver.time, self.solver.state.copy())
        hit, short, made, found = _propagated(solver, end, most, self.longest, self.kept)
        if short and not self.kept:  # the steps tell where
            _place(solver, *start)
            hit, short, made, found = _propagated(solver, end, most, self.longest, True)
        if found is not None and (cut := self._before_rounding(found, short)):
            hit, short, made, found = None, "", len(cut.series), cut
        missed, lost = None, None
        if self.looked and found is not None:
            missed, lost = _first_missed(found, self.mode, self.settings, self.faded, hit)
        if lost is not None:
            found = _Steps(found.times[: missed + 2], found.series[: missed + 1])
            _place(solver, found.times[-1], found.at(found.times[-1]))
            return lost, "", missed + 1, found
        if missed is None:
            if solver.time >= self.due:
                self.longest, self.due = self.settings.longest, inf
            return hit, short, made, found
        begin, end = found.times[missed : missed + 2]
        self.longest = (end - begin) / (PARTS - 1 / 2)  # so that no event is between two steps, with one of length 0
        self.due = end + self.longest
        _place(solver, begin, found.series[missed, :, 0])
        kept = _Steps(found.times[: missed + 1], found.series[:missed]) if missed else None
        return None, "", missed + 1, kept

    def _before_rounding(self, found, short):
        """Return the steps up to the first that ends where rates are rounding, and that a further one follows, or None.

        One that has failed follows the last if ``short`` is not "".
        """
        if self.mode.mode.removable:
            for k, t in enumerate(found.times[1:] if short else found.times[1:-1], start=1):
                if self.mode.is_beside_limit(t, state := found.at(t)):
                    _place(self.solver, t, state)
                    return _Steps(found.times[: k + 1], found.series[:k])
        return None


def _passed(divisors, found, hit):
    """Return why a run stops at a divisor of the rates that one of the steps has come to, or ""."""
    if not divisors.first:
        return ""
    states = (*map(tuple, found.series[1:, :, 0].tolist()), found.at(found.times[-1]))
    reasons = (divisors.passed(t, state, begun if t == found.times[-1] and hit is not None else None)
               for (begun, t), state in zip(pairwise(found.times), states, strict=True))
    return next(filter(None, reasons), "")


def _within(followed, t):
    """Return the state at a time from the steps of a segment, given in parts."""
    return next((found for found in followed if t <= found.times[-1]), followed[-1]).at(t)


def _summed(series, at):
    """Return Taylor series of the last axis, and their slopes, at distances from their centres."""
    found = slopes = 0.0
    for k in range(series.shape[-1] - 1, -1, -1):
        slopes, found = slopes * at + found, found * at + series[..., k]
    return found, slopes


def _propagated(solver, end, most, longest, keep):
    """Propagate a solver; return (guard lost or None, what stops it or "", number of steps, the steps or None).

    With ``keep`` it keeps the steps: heyoka's own output of them is compiled anew each time.
    """
    times, series = [float(solver.time)], []

    def kept(_=None):
        times.append(float(solver.time))
        series.append(solver.tc.copy())
        return True

    looks = {"callback": kept, "write_tc": True} if keep else {}
    outcome, *_, made, _, _ = solver.propagate_until(end, max_steps=most, max_delta_t=longest, **looks)
    if keep and made > len(series):  # none is told of a step that ends at an event
        kept()
    steps = _Steps(times, np.array(series)) if series else None
    return *_reason(int(outcome)), len(series) if keep else made, steps


def _place(solver, t, state):
    """Let a solver go on from a time and a state, where any event may happen at once."""
    if solver.with_events:
        solver.reset_cooldowns()
    solver.time, solver.state[:] = t, state


@lru_cache(maxsize=256)
def _has_fixed_slopes(mode):
    """Tell whether rates, guards and laws of friction are linear in the states, without the time.

    If the last terms of their Taylor series vanish, by which heyoka chooses a step, so do all that follow. Those of
    other rates may vanish where more follow, as those of x'' = -cos x do at rest at x = 0, and exp(-100 v**2) at v = 2.
    """
    outputs = (*mode.rates, *mode.watched)
    return mode.system.time not in symbols_in(sp.Tuple(*outputs)) and not is_bent(outputs, mode.system.states)


@np.errstate(all="ignore")  # the last series may have overflowed
def _first_missed(found, mode, settings, faded, hit):
    """Return the first step that misses the rates or the loss of a guard at one of its looks, by its index, or None.

    The second entry is None, or the guard if the step is too short to be divided: it is lost at the end of the step.
    ``hit`` is the guard lost at the end of the last step, or None; the rates may have no values there.
    """
    times, lengths = np.array(found.times), np.diff(found.times)[:, None]
    at = lengths * (np.arange(LOOKS + 1) / LOOKS)
    looks, states, slopes = _looks(found, at)
    if beside := _beside_bumps(found, mode, looks, states):
        looks, states, slopes = _looks(found, _with_further(at, beside))
    rates, guards = (_values(mode, outputs, looks, states) for outputs in (mode.mode.rates, mode.mode.watched))
    guards[..., guards.shape[-1] - len(faded) :] -= faded
    missed, change = lengths[:, :, None] * (slopes - rates), lengths[:, :, None] * rates
    allowed = COARSE * allowed_error(states, settings) + ROUNDED * (abs(states) + abs(change))
    wrong = ~(abs(missed) <= allowed).all(axis=2)
    if mode.mode.removable:  # beside 0/0 the rates are rounding
        wrong &= (abs(_values(mode, mode.mode.removable, looks, states)) >= SMALL).all(axis=2)
    if hit is not None:
        wrong[-1, -1] &= np.isfinite(missed[-1, -1]).all()
        guards[-1, -1] = guards[-1, -2]
    lost, long = _lost_within(guards), lengths[:, 0] > SHORTEST * times[1:]
    for k in np.flatnonzero(lost.any(axis=1) | (wrong.any(axis=1) & long)).tolist():
        if lost[k].any():
            return k, None if long[k] else int(lost[k].argmax())
        if any(_is_wrong(mode, missed[k, i], allowed[k, i], float(looks[k, i]), tuple(states[k, i].tolist()),
                         float(lengths[k, 0])) for i in np.flatnonzero(wrong[k])):
            return k, None
    return None, None


def _looks(found, at):
    """Return the times, states and slopes at times ``at`` of looks from the begin of each step on."""
    return np.array(found.times)[:-1, None] + at, *_summed(found.series[:, None], at[:, :, None])


def _beside_bumps(found, mode, looks, states):
    """Return for each step the times, from its begin on, beside the middles of bumps; [] if no look passes a middle.

    Steps begin and end at those of bumps in time.
    """
    lengths, beside = looks[:, -1] - looks[:, 0], [list[float]() for _ in looks]
    if mode.peaked:
        beside[0] += [part * lengths[0] for part in BESIDE_BUMPS]
        beside[-1] += [lengths[-1] + part * lengths[-1] for part in BESIDE_BUMPS]
    if mode.middles:
        for step, at in _middles(found, mode, looks, states):
            beside[step] += [at + part * lengths[step] for part in BESIDE_BUMPS]
    return beside if any(beside) else []


def _middles(found, mode, looks, states):
    """Return pairs (step, time from its begin on) of the middles of bumps along states that looks pass."""
    phases, every = zip(*((middle.phase, middle.every) for middle in mode.middles), strict=True)
    values = _values(mode, phases, looks, states)
    ends = np.minimum(values[:, :-1], values[:, 1:]), np.maximum(values[:, :-1], values[:, 1:])
    wholes = np.where(every, np.floor(ends[1]), 0)
    k, i, m = np.nonzero((ends[0] < wholes) & (wholes <= ends[1]))
    low, high, begins, series = looks[k, i], looks[k, i + 1], looks[k, 0], found.series[k]
    before, after = (v[k, i, m] - wholes[k, i, m] for v in (values[:, :-1], values[:, 1:]))
    middle = low
    for _ in range(ROUNDS if k.size else 0):
        middle = low + (high - low) * before / np.where(before == after, 1, before - after)
        there = _summed(series, (middle - begins)[:, None])[0]
        now = _values(mode, phases, middle, there)[np.arange(k.size), m] - wholes[k, i, m]
        left = before * now > 0
        low, before = np.where(left, middle, low), np.where(left, now, before)
        high, after = np.where(left, high, middle), np.where(left, after, now)
    return zip(k.tolist(), (middle - begins).tolist(), strict=True)


def _with_further(at, further):
    """Return the times ``at`` of looks with further ones in each step, in their order."""
    most = max(map(len, further))
    rows = [row + [0.0] * (most - len(row)) for row in further]
    return np.sort(np.hstack([at, np.clip(np.reshape(rows, (len(at), most)), 0, at[:, -1:])]))


def _is_wrong(mode, missed, allowed, *at):
    """Tell whether a step misses the rates at a look by more than is allowed, or these have no values there."""
    if not np.isfinite(missed).all():
        return True
    with suppress(ArithmeticError, ValueError):  # a look beside which the rates have no slope tells nothing
        return is_missed(mode, missed, allowed, *at)
    return False


def _lost_within(guards):
    """Tell for each step and guard whether it is lost between two looks; at the end of a step no or another one is."""
    least = -MARGIN * np.maximum(1, abs(guards).max(axis=1, keepdims=True))
    return ((guards[:, :-1] > 0) & (guards[:, 1:] < least)).any(axis=1)


def _values(mode, outputs, looks, states):
    """Return the ``outputs`` of a mode at all looks, not finite where they have no value."""
    compiled = function(mode.mode.system, outputs, "numpy", np, coefficients=mode.coefficients)
    found = compiled(looks, *np.moveaxis(states, -1, 0), *mode.p)
    return np.stack(np.broadcast_arrays(looks, *found), axis=-1)[..., 1:]


def _reason(outcome):
    import heyoka as hy

    if int(hy.taylor_outcome.success) < outcome < 0:  # a terminal event k stops with -k - 1
        return -1 - outcome, ""
    return None, "left the range of floats" if outcome == int(hy.taylor_outcome.err_nf_state) else ""


@lru_cache(maxsize=32)
def _compiled(method, mode, coefficients, tol):
    """Return a mode's compiled integrator, with margins for guards and laws of friction as further parameters."""
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
                         for outputs in (mode.rates, mode.watched))
    except (AttributeError, TypeError, NoFunction) as reason:
        raise lacking(method, "heyoka", reason) from None
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
    lifted = {name: _lifted(getattr(hy, name)) for name in names}
    return namespace(pi=math.pi, e=math.e, pow=operator.pow, abs=lambda v: lifted["sqrt"](v * v), **lifted)


def _lifted(found):
    """Return a function of heyoka's expressions, of numbers, too."""
    import heyoka as hy

    return lambda *given: found(*(hy.expression(float(v)) if isinstance(v, int | float) else v for v in given))
