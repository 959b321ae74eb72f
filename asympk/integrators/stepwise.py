"""The loop over the steps of any integrator: after every step it checks guards, poles of the rates, and the limits.

``follow_steps`` is the loop; ``Solver`` is the interface of an integrator, ``Watch`` finds the first guard lost,
``Divisors`` the first pole.
"""

from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from math import isfinite
from operator import sub
from time import monotonic
from typing import Protocol

import numpy as np

from asympk.automaton.contacts import clear_sign, is_open, nudges
from asympk.automaton.loop import Segment, lost_with
from asympk.automaton.numericmode import LONG, NumericMode
from asympk.errors import AsympkError
from asympk.integrators.integrate import COMPILED, LEFT, Settings, Work
from asympk.integrators.watch import BESIDE_BUMPS, ROUNDED, GuardSample, dips, first_lost, passed_wholes, suspects

STEP_LIMIT = "step limit reached"
PATIENCE = 500  # steps near a zero of a divisor after which a run that has gained no time of ``LONG`` is given up
IDLE = 100  # steps without any gain in time after which a run is given up
COARSE = 1000  # multiple of its allowed error by which a step may miss the rates at an event
PARTS = 8  # the least number of steps into which one is divided
TRUSTED = 15  # times that a middle is passed unseen before it is looked at again: its bump may depend on other states
BESIDE = 2.0**-13  # part of a step to each side of an event within which its slope there is taken
UNBOUNDED = 1e-8  # part of the first value of p in R = -a / p at which R counts as infinite: no step reaches p = 0


class Solver(Protocol):
    """The interface that the loop requires of an integrator: that of SciPy's solvers, and ``made``.

    The last step, or the last of ``made`` steps, went from ``t_old`` to ``t``, where the state is ``y``. ``status`` is
    "running", "finished" or "failed"; ``nfev`` and ``njev`` count the calls of the field and of its Jacobian so far.
    """

    t_old: float
    t: float
    y: np.ndarray
    status: str
    made: int
    nfev: int
    njev: int

    def step(self) -> str | None:
        """Make one step or several; return what stops it, or None."""

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """Return the state as a function of the time within the last step."""

    def again(self) -> None:
        """Go back to before the last step, to make it in ``PARTS`` or more."""


@np.errstate(all="ignore")  # the step control of scipy divides by errors that may be zero
def follow_steps(solver: Solver, mode: NumericMode, t: float, state: tuple[float, ...], settings: Settings) -> Segment:
    """Follow ``mode`` by the steps of ``solver`` until a guard is lost or the solver is at its end."""
    watch, n, times = Watch(mode, t, state), len(state), settings.times
    steps, idle, short, hit = 0, 0, "", None
    samples, passed = list[tuple[float, ...]](), [(t, state)] * settings.keep
    start, halfway, divisors = t, t, Divisors(mode, t, state)
    compiled = settings.method in COMPILED
    while solver.status == "running" and hit is None and not (short or (compiled and mode.is_beside_limit(t, state))):
        short = _step(solver, steps, settings)
        steps += solver.made * (not short)
        halfway = solver.t if 2 * steps <= settings.steps else halfway
        t, state = solver.t, tuple(solver.y[:n].tolist())
        idle = idle + 1 if not short and t - solver.t_old <= 4e-16 * abs(t) else 0
        if idle > IDLE:
            short = f"stalled (the last {idle} steps gained nothing)"
        met, short = (None, short) if short else _met(watch, solver, t, state)
        if not short and watch.has_passed_over(solver, t, state, met, settings):
            watch.back()
            solver.again()
            continue
        if met:
            (t, hit), state = met, tuple(solver.dense_output()(met[0])[:n].tolist())
        if not short and not mode.ends_at(hit):
            short = divisors.passed(t, state, None if hit is None else solver.t_old)
        elif solver.status == "failed":
            short = divisors.vanished(t, state) or short
        passed += [(t, state)] * settings.keep
        while len(samples) < len(times) and times[len(samples)] <= t and not short:
            samples.append(tuple(solver.dense_output()(times[len(samples)])[:n].tolist()))
    if short == STEP_LIMIT and 10 * (t - halfway) < halfway - start:
        short = f"stalled (the last {steps // 2} steps gained {t - halfway:.1g})"
    work, together = Work(int(solver.nfev), steps, int(solver.njev)), lost_with(mode, hit, t, state)
    return Segment(t, state, hit, work, short, tuple(samples), together, tuple(passed))


def _met(watch: "Watch", solver: Solver, t: float, state: tuple[float, ...]) -> tuple[tuple[float, int] | None, str]:
    """Return when a step to (t, state) loses a guard, and which, or None; and the reason that stops the run, or ""."""
    try:
        return watch.lost(solver, t, state), ""
    except AsympkError:
        raise
    except (ArithmeticError, ValueError):
        return None, LEFT


class Divisors:
    """The divisors of the rates of a mode along its steps, none of which may change its sign."""

    def __init__(self, mode: NumericMode, t: float, state: tuple[float, ...]):
        self.mode = mode
        self.first = self.last = mode.pole_values(t, state)
        self.near: list[float] = []  # the times of consecutive steps at which a divisor has nearly vanished

    def passed(self, t: float, state: tuple[float, ...], begun: float | None = None) -> str:
        """Return why a run stops after a step to (t, state), or ""; ``begun`` as in ``require_one_side``."""
        if not self.first:
            return ""
        self.last = self.mode.require_one_side(self.last, t, state, self.near[0] if self.near else None, begun)
        reason = self._reason(self.last)
        self.near = [*self.near[-PATIENCE:], t] if reason else []
        return reason if len(self.near) > PATIENCE and t - self.near[0] <= LONG * t else ""

    def vanished(self, t: float, state: tuple[float, ...]) -> str:
        """Return "stalled" with the divisor that nearly vanishes at (t, state), or ""."""
        return self._reason(self.mode.pole_values(t, state))

    def _reason(self, now):
        divisor = self.mode.vanishing(self.first, now) if self.first else None
        return "" if divisor is None else f"stalled: rates are divided by {divisor!s:.120}, and that is 0"


class Watch:
    """The guards of a mode, and its laws of friction, at the end of the last step.

    At the start one that is negative or rounding counts as 0.
    """

    def __init__(self, mode: NumericMode, t: float, state: tuple[float, ...]):
        self.mode, self.size, self.faded = mode, len(state), mode.faded(t, state)
        found = mode.watched_values(self.faded, t, state)
        guards = len(found) - len(self.faded)
        signs = mode.signs(mode.mode.guard_values, t, state) if guards else ()
        values = [v if sign > 0 else 0.0 for v, sign in zip(found, signs, strict=False)]
        self.floors = [v * UNBOUNDED * (kind == "unbounded") for v, (kind, _) in zip(values, mode.kinds, strict=True)]
        self.floored = any(self.floors)
        values += [max(v, 0.0) for v in found[guards:]]
        self.before = self.last = GuardSample(t, self._above(values), mode.watched_rates(t, state))
        self.start, self.phases = t, mode.middle_values(t, state)
        self.earlier = self.phases  # before the last step
        # the longest way past, from or to a middle, of a wave by the quarter of its turn, and how often trusted
        self.looked_at = defaultdict[tuple[int, int, float], tuple[float, int]](lambda: (0.0, 0))

    def lost(self, solver: Solver, t: float, state: tuple[float, ...]) -> tuple[float, int] | None:
        """Return (time, guard) of the first guard lost in the step that ends at (t, state), or None."""
        if not self.last.values:
            return None
        self.before = before = self.last
        begin = solver.t_old
        now = self._without_rounding(self._values(t, state), t, state)
        self.last = GuardSample(t, now, self.mode.watched_rates(t, state))
        one_step = before.t == begin
        if one_step and not suspects(before, self.last):
            return None
        within = cache(solver.dense_output)

        def values(at):
            return self._values(at, within()(at)[: self.size].tolist())

        def rates(at):
            return self.mode.watched_rates(at, within()(at)[: self.size].tolist())

        def touches(at, k):
            state = within()(at)[: self.size].tolist()
            return is_open([self._values(*place)[k] for place in ((at, state), *nudges(at, state, self.mode.beside))])

        if not one_step:
            before = GuardSample(begin, values(begin), rates(begin))
        return first_lost(before, self.last, values, rates, bracketed, touches=touches)

    def back(self) -> None:
        """Go back to before the last step."""
        self.last, self.phases = self.before, self.earlier

    def has_passed_over(
        self, solver: Solver, t: float, state: tuple[float, ...], met: tuple | None, settings: Settings
    ) -> bool:
        """Tell whether the step that ends at (t, state) misses the rates or a dip of a guard where these may vary fast.

        That is at the event ``met``, in the middle of the first step of a mode, and about the middles of bumps, also if
        a mode begins or ends there; steps begin and end at those of bumps in time.
        """
        first, last = solver.t_old == self.start, solver.status == "finished"
        passed = self._middles_passed(solver, t, state) if self.phases else {}
        if not (met or first or passed or (last and self.mode.peaked)):
            return False
        begin, end, h = solver.t_old, met[0] if met else t, t - solver.t_old
        times = [end] if met else [(begin + t) / 2] if first else []
        bumps = [time for time, there in ((begin, first), (t, last)) if there and self.mode.peaked]
        within = solver.dense_output()

        def at(time):
            return tuple(within(time)[: self.size].tolist())

        def from_middle(k, whole, time):
            return self.mode.middle_values(time, at(time))[k] - whole

        bumps += [bracketed(partial(from_middle, k, whole), begin, t) for k, whole, _ in passed]
        beside = (middle + part * h for middle in bumps for part in BESIDE_BUMPS)
        times += [time for time in beside if begin < time < end]
        places = [(time, at(time)) for time in times]
        if any(misses_rates(self.mode, within, *place, h, settings) for place in places) or any(
                dips(self.before.values, self._values(*place)) for place in places if bumps):
            return True
        self.looked_at |= {(k, whole % 4, end): (way, 0) for (k, whole, end), way in passed.items()}
        return False

    def _middles_passed(
        self, solver: Solver, t: float, state: tuple[float, ...]
    ) -> dict[tuple[int, int, float], float]:
        """Return the middles of bumps, by whole values, that the step to (t, state) has passed and that are to be seen.

        A step on whose begin or end a middle is, within rounding, has passed one half of its bump: the middle counts
        with this end, 0 or 1, else with 1/2. For each it gives the longest way past it. What a step has passed without
        a bump is passed by shorter ones unseen, but not by more than ``TRUSTED``.
        """
        begin = None if solver.made == 1 else tuple(solver.dense_output()(solver.t_old)[: self.size].tolist())
        self.earlier = self.mode.middle_values(solver.t_old, begin) if begin else self.phases
        self.phases = self.mode.middle_values(t, state)
        passed = {}
        for k, (middle, before, after) in enumerate(zip(self.mode.middles, self.earlier, self.phases, strict=True)):
            for whole in passed_wholes(middle.every, before, after):
                part, way = (whole - before) / (after - before), abs(after - before)
                end = round(part) if abs(part - round(part)) <= ROUNDED else 0.5
                longest, times = self.looked_at[k, whole % 4, end]
                if times == TRUSTED or way > longest:
                    passed[k, whole, end] = max(longest, way)
                else:
                    self.looked_at[k, whole % 4, end] = longest, times + 1
        return passed

    def _without_rounding(self, values, t, state):
        """Return the values of the guards, 0 for each that was 0 before and is negative, but does not clearly fall."""
        below = [k for k, (old, new) in enumerate(zip(self.before.values, values, strict=True)) if old == 0 > new]
        if not below:
            return values
        places = (t, state), *nudges(t, state, self.mode.beside)
        signs = [*map(clear_sign, zip(*(self.mode.watched_rates(*place) for place in places), strict=True))]
        return [0.0 if k in below and signs[k] >= 0 else value for k, value in enumerate(values)]

    def _values(self, t, state):
        return self._above(self.mode.watched_values(self.faded, t, state))

    def _above(self, values):
        if not self.floored:
            return values
        n = len(self.floors)
        return [*map(sub, values[:n], self.floors), *values[n:]]


def bracketed(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the root of a function between two ends, or the end of the smaller value if the signs do not differ."""
    from scipy.optimize import brentq

    ends = function(low), function(high)
    if ends[0] * ends[1] >= 0:
        return low if abs(ends[0]) <= abs(ends[1]) else high
    return brentq(function, low, high, xtol=1e-300, rtol=9e-16, maxiter=10_000)  # roots may be multiple


@np.errstate(all="ignore")  # of a short step late in a run, the two rounded times may be one
def misses_rates(
    mode: NumericMode, within: Callable[[float], np.ndarray], t: float, state: tuple[float, ...], h: float,
    settings: Settings,
) -> bool:
    """Tell whether the slope of a step of length h, ``within(t)``, is not that of the rates at ``t``.

    ``t`` is a time at which the rates may change fast.
    """
    with suppress(ArithmeticError, ValueError):
        sides = t - BESIDE * h, t + BESIDE * h  # late in a run, rounding moves them by a part of their distance
        slope = (within(sides[1]) - within(sides[0]))[: len(state)] / np.subtract(sides[1], sides[0])
        allowed = COARSE * allowed_error(np.array(state), settings)
        return is_missed(mode, h * (slope - np.array(mode.rhs(t, state))), allowed, t, state, h)
    return False


def is_missed(
    mode: NumericMode, missed: np.ndarray, allowed: np.ndarray, t: float, state: tuple[float, ...], h: float
) -> bool:
    """Tell whether a step of length h is wrong whose slope at (t, state) differs by ``missed`` / h from the rates.

    The step has then passed over what changes the rates there, such as friction that rises within a narrow range of
    velocities. Errors that a stiff mode damps do not count.
    """
    if not (abs(missed) > allowed).any():
        return False
    damped = np.eye(len(state)) - h * np.array(mode.jac(t, state))
    return bool((abs(np.linalg.solve(damped, missed)) > allowed).any())


def allowed_error(states: np.ndarray, settings: Settings) -> np.ndarray:
    """Return the error that the settings allow a step to make in ``states``."""
    return np.array(settings.atol) + settings.rtol * abs(states)


def field_and_start(
    mode: NumericMode, t: float, state: tuple[float, ...]
) -> tuple[Callable[..., tuple], tuple[float, ...], Callable[..., tuple] | None]:
    """Return (field, start, Jacobian or None) of a mode as functions of ``(t, *w, *p)``.

    Guards that may vary faster than the states become further states, so that steps resolve them; no Jacobian then.
    """
    if not mode.timed:
        return mode.field, state, mode.jacobian
    field, slopes, guards, n = mode.field, mode.guard_slopes, len(mode.kinds), len(state)

    def extended(t, *arguments):
        state, p = arguments[:n], arguments[n + guards :]
        return (*field(t, *state, *p), *slopes(t, *state, *p))

    return extended, (*state, *mode.guard_values(t, state)), None


def _step(solver, steps, settings):
    """Make one step; return the reason that stops the run, or ""."""
    if steps >= settings.steps:
        return STEP_LIMIT
    if monotonic() > settings.deadline:
        return "time limit reached"
    try:
        reason = solver.step()
    except (ArithmeticError, ValueError):
        return LEFT
    if solver.status == "failed":
        return f"stalled ({reason.rstrip('.').lower()})"
    return "" if all(map(isfinite, solver.y.tolist())) else LEFT
