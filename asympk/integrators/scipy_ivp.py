"""RK45, DOP853, Radau, BDF and LSODA of scipy, stepped one by one: guards are looked at after every step.

A guard that falls and rises again between the ends of a step shows in its rate, which changes its sign there: its least
value is then found on the dense output of the step.
"""

from time import monotonic

from asympk.automaton.loop import Segment
from asympk.integrators.integrate import Work

CLASSES = {"rk45": "RK45", "dop853": "DOP853", "radau": "Radau", "bdf": "BDF", "lsoda": "LSODA"}
EXPLICIT = ("rk45", "dop853")
STEP_LIMIT = "step limit reached"
IDLE = 100  # steps without any gain in time after which a run is given up
UNBOUNDED = 1e-8  # part of its first inverse at which a reaction counts as infinite: no step reaches the singular point


def advance(method, mode, t, state, until, rtol, atol, limits, times):
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``, looking in at ``times``."""
    solver = _solver(method, mode, t, state, until, rtol, atol)
    watch, n = Watch(mode, t, state), len(state)
    samples, steps, idle, short, hit = [], 0, 0, "", None
    start = halfway = t
    while solver.status == "running" and hit is None and not short:
        short = _step(solver, steps, limits)
        steps += not short
        halfway = solver.t if 2 * steps <= limits.steps else halfway
        t, state = solver.t, tuple(solver.y[:n].tolist())
        idle = idle + 1 if not short and t - solver.t_old <= 4e-16 * abs(t) else 0
        if idle > IDLE:
            short = f"stalled (the last {idle} steps gained nothing)"
        if not short and (met := watch.lost(solver, t, state)):
            t, hit = met
            state = tuple(solver.dense_output()(t)[:n].tolist())
        while len(samples) < len(times) and times[len(samples)] <= t and not short:
            samples.append(tuple(solver.dense_output()(times[len(samples)])[:n].tolist()))
    if short == STEP_LIMIT and 10 * (t - halfway) < halfway - start:
        short = f"stalled (the last {steps // 2} steps gained {t - halfway:.1g})"
    return Segment(t, state, hit, Work(int(solver.nfev), steps, int(solver.njev)), short, tuple(samples))


class Watch:
    """The guards of a mode and their rates at the end of the last step; none starts outside its mode.

    A guard that starts at zero is lost only where it falls: it may grow from there by less than its rounding.
    """

    def __init__(self, mode, t, state):
        self.mode, self.size = mode, len(state)
        values = [max(v, 0.0) for v in mode.guard_values(t, state)]
        self.floors = [v * UNBOUNDED * (kind == "unbounded") for v, (kind, _) in zip(values, mode.kinds, strict=True)]
        self.values = self._above(values)
        self.rates = mode.guard_rates(t, state)

    def lost(self, solver, t, state):
        """Return (time, guard) of the first guard lost in the step that ends at (t, state), or None."""
        before, falling = self.values, self.rates
        self.values, self.rates = self._above(self.mode.guard_values(t, state)), self.mode.guard_rates(t, state)
        found = []
        for k, (start, end) in enumerate(zip(before, self.values, strict=True)):
            if start >= 0 >= end and start != end and (start > 0 or self.rates[k] < 0):
                found.append((self._root(solver, k, start, falling[k], solver.t), k))
            elif start > 0 and falling[k] < 0 < self.rates[k]:
                least = _bracketed(lambda at, k=k: self._at(solver, at, rate=True)[k], solver.t_old, solver.t)
                if self._at(solver, least)[k] < 0:
                    found.append((self._root(solver, k, start, falling[k], least), k))
        return min(found, default=None)

    def _root(self, solver, k, start, rate, end):
        """Return where guard ``k`` falls through zero before ``end``; one that starts at zero rises first."""
        begin = solver.t_old
        if start == 0 and rate > 0:
            begin = _bracketed(lambda at: self._at(solver, at, rate=True)[k], begin, end)
        return _bracketed(lambda at: self._at(solver, at)[k], begin, end)

    def _at(self, solver, t, rate=False):
        state = solver.dense_output()(t)[: self.size].tolist()
        return self.mode.guard_rates(t, state) if rate else self._above(self.mode.guard_values(t, state))

    def _above(self, values):
        return [v - floor for v, floor in zip(values, self.floors, strict=True)]


def _bracketed(function, low, high):
    """Return the root of a function between two ends, or the end nearer to one where its sign does not change."""
    from scipy.optimize import brentq

    ends = function(low), function(high)
    if ends[0] * ends[1] >= 0:
        return low if abs(ends[0]) <= abs(ends[1]) else high
    return brentq(function, low, high, xtol=4e-16, rtol=9e-16)


def _solver(method, mode, t, state, until, rtol, atol):
    import numpy as np
    from scipy import integrate

    field, p, n = _field(mode, len(state)), mode.p, len(state)
    jac = {} if method in EXPLICIT else {"jac": lambda t, w: np.reshape(mode.jacobian(t, *w.tolist(), *p), (n, n))}
    if mode.timed:
        state, jac = (*state, *mode.guard_values(t, state)), {}
    make = getattr(integrate, CLASSES[method])
    return make(lambda t, w: field(t, *w.tolist(), *p), t, state, until, rtol=rtol, atol=atol, **jac)


def _field(mode, n):
    """Return the field; guards that depend on the time become states, so that the steps resolve them too."""
    if not mode.timed:
        return mode.field
    field, slopes, guards = mode.field, mode.guard_slopes, len(mode.kinds)

    def extended(t, *arguments):
        state, p = arguments[:n], arguments[n + guards :]
        return (*field(t, *state, *p), *slopes(t, *state, *p))

    return extended


def _step(solver, steps, limits):
    """Make one step; return what stops the run, or ""."""
    if steps >= limits.steps:
        return STEP_LIMIT
    if monotonic() > limits.deadline:
        return "time limit reached"
    from numpy import errstate

    try:
        with errstate(all="ignore"):  # the step control of scipy divides by errors that may be zero
            reason = solver.step()
    except (ArithmeticError, ValueError):
        return "left the range of floats"
    if solver.status == "failed":
        return f"stalled ({reason.rstrip('.').lower()})"
    return "" if all(v - v == 0 for v in solver.y.tolist()) else "left the range of floats"
