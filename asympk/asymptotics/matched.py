r"""The asymptotic model of order n >= 1 of any system with friction: layers in their fast time, slow motion to order n.

A layer takes a time O(mu log(1/mu)), in which it is no longer stiff: its modes are followed in the time t/mu, at the
value of mu that is asked for, until what is left of the fast motion is below the tolerance. Nothing is omitted there:
all powers of mu and log(1/mu) are included. The slow motion goes on from where the layer ends, on the manifold to order
n, until a guard of its mode vanishes; there the next layer begins. What is omitted is O(mu^(n + 1)), and the run to the
order n + 1 tells how much.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from asympk.asymptotics import reduced
from asympk.asymptotics.fibre import Formulas, formulas
from asympk.asymptotics.landing import abscissa, approached, text
from asympk.asymptotics.nonstiff import Trajectory, steps
from asympk.automaton.automaton import Automaton, NumericMode
from asympk.errors import NoManifold, OutOfRange, TooManyEvents
from asympk.path import Event
from asympk.symbolic import branches
from asympk.symbolic.branches import Branch
from asympk.symbolic.system import Mode, System

STEPS = 3000
FAR = 1e12
IN_FAST = 0.01  # a fast state changes the slow ones through mu alone, but decides when a layer ends
EVENTS = 1000


class Stretch(NamedTuple):
    """Motion in one mode from the time ``began`` on; ``states(t)`` takes an array of times since then."""

    began: float
    mode: str
    states: Callable


@dataclass(frozen=True)
class Course:
    """A motion so far: its time, its state, the branch that it is in, and what led there."""

    t: float
    state: tuple
    branch: Branch
    events: tuple[Event, ...] = ()
    modes: tuple[str, ...] = ()
    stretches: tuple[Stretch, ...] = ()

    def met(self, automaton: Automaton, guard: int, t: float, state: tuple, stretch: Stretch) -> "Course":
        """Return the course beyond a guard that vanishes at (t, state)."""
        mode = automaton.mode(self.branch)
        state = mode.snapped(guard, t, state)
        kind, friction = mode.kinds[guard]
        branch = automaton.next(self.branch, (guard,), t, state)
        event = Event(kind, t, state, friction)
        if len(self.events) == EVENTS:
            raise TooManyEvents(f"more than {EVENTS} events by t = {t:.6g}, at {automaton.system.states} = {state}")
        return Course(t, state, branch, (*self.events, event), (*self.modes, branches.name(branch)),
                      (*self.stretches, stretch))  # fmt: skip


@dataclass(frozen=True)
class Slow:
    """The slow motion of one branch in numbers: ``places`` are the states of the system among those of the mode."""

    formulas: Formulas
    slow: int
    values: tuple
    places: tuple[int, ...]
    timed: bool

    def point(self, t: float, state: tuple) -> tuple:
        """Return (x, y) of the mode."""
        inside = dict(zip(self.places, state, strict=True)) | ({self.slow - 1: t} if self.timed else {})
        return tuple(inside[k] for k in range(len(inside)))


def slow_of(automaton: Automaton, branch: Branch, order: int) -> Slow:
    """Return the slow motion of a branch, its formulas to ``order``."""
    system = automaton.system
    given = dict(zip(system.parameters, map(float, automaton.values), strict=True))
    mode = _mode(system, branch)
    names, parameters = [*mode.slow, *mode.fast], tuple(p for p in given if p != system.small)
    return Slow(formulas(mode, system.small, parameters, order), len(mode.slow), tuple(given[p] for p in parameters),
                tuple(names.index(s) for s in system.states), system.time is not None)  # fmt: skip


@lru_cache(maxsize=256)
def _mode(system: System, branch: Branch) -> Mode:
    slow, fast = branches.fields(system, branch)
    mode = Mode(branches.name(branch), slow, fast)
    return mode if system.time is None else replace(mode, slow=sp.Dict({**slow, system.time: 1}))


def through_layer(automaton: Automaton, course: Course, until: float, mu: float, order: int, rtol: float) -> Course:
    """Follow a course through its layer, to where only slow motion is left, or to ``until``.

    Raises ``OutOfRange`` where the fast motion does not settle, and what the next mode of the automaton raises.
    """
    while True:
        slow, mode = slow_of(automaton, course.branch, order), automaton.mode(course.branch)
        found, guard = _in_mode(mode, slow, course, until, mu, rtol)
        if not found:
            return course
        last, size = found[-1], len(course.state)
        stretch = Stretch(course.t, mode.name, _during(Trajectory(found[0].state, found), course.t, size))
        if guard is None:
            return replace(course, t=last.after, state=last.end[:size], stretches=(*course.stretches, stretch))
        t = _lost(mode, guard, last, size)
        course = course.met(automaton, guard, t, last.shortened(t - last.t)[:size], stretch)


def _in_mode(mode: NumericMode, slow: Slow, course: Course, until: float, mu: float, rtol: float) -> tuple:
    """Return the steps in one mode and the guard lost in the last, or None where the fast motion is over."""
    system = mode.mode.system
    fast = {system.states.index(s) for s in system.fast}
    atol = tuple(IN_FAST * rtol / mu if k in fast else rtol for k in range(len(course.state)))
    flow, now = partial(mode.field, 0.0), course.state
    if system.time is not None:
        flow, now = _timed(mode), (*course.state, course.t)
    ahead = steps((flow,), mode.p, now, until, rtol, (*atol, rtol)[: len(now)], course.t)
    found, t, over = list[Any](), course.t, math.inf
    while len(found) < STEPS:
        state = now[: len(atol)]
        over = _over(slow, t, state, mu, rtol) if over == math.inf else over
        if t >= min(over, until):
            return tuple(found), None
        if (last := next(ahead, None)) is None or max(map(abs, last.end)) > FAR:
            break
        found.append(last)
        t, now = last.after, last.end
        values = mode.guard_values(t, now[: len(atol)])
        if values and min(values) < 0:
            return tuple(found), values.index(min(values))
    raise OutOfRange(f"the layer of {mode.name} from t = {course.t:.6g} does not settle: at t = {t:.6g} it is at "
                     f"{text(now)}")  # fmt: skip


def _during(trajectory, began, size):
    return lambda t: trajectory(began + t)[:size]


def _over(slow: Slow, t: float, state: tuple, mu: float, rtol: float) -> float:
    """Return the time at which the fast motion is over, once it is near an attracting manifold."""
    point = slow.point(t, state)
    x, y = point[: slow.slow], point[slow.slow :]
    if len(y) == 1 and abscissa(slow.formulas, x, y, slow.values) >= 0:
        return math.inf
    scale = max(1.0, *map(abs, y))
    branch, rate = approached(slow.formulas, x, y, scale, slow.values)
    return t + mu * math.log(scale / rtol) / rate if branch else math.inf


@lru_cache(maxsize=256)
def _timed(mode):
    """Return a field as that of an autonomous flow, the time its last state."""
    size = len(mode.mode.system.states)
    return lambda *arguments: (*mode.field(arguments[size], *arguments[:size], *arguments[size + 1 :]), 1.0)


def _lost(mode, guard, step, size):
    """Return the time within a step at which a guard vanishes."""

    def value(t):
        return mode.guard_values(t, step(t)[:size].tolist())[guard]

    low, high = step.t, step.after
    return brentq(value, low, high, xtol=1e-300, rtol=1e-15) if value(low) > 0 > value(high) else high


def slowly(automaton: Automaton, course: Course, until: float, mu: float, order: int, rtol: float) -> Course:
    """Follow a course by slow motion to ``order`` from where its layer ends, to ``until`` or through the next edge.

    Raises ``NotNormallyHyperbolic`` and ``OutOfRange``.
    """
    slow, mode = slow_of(automaton, course.branch, order), automaton.mode(course.branch)
    point = slow.point(course.t, course.state)
    branch = reduced.branch_at(slow.formulas, point[: slow.slow], point[slow.slow :], slow.values)
    height = slow.formulas.height[order]

    def inside(span, at):
        whole = (*at[: slow.slow], *height(*at, mu, *slow.values))
        return mode.guard_values(course.t + span, tuple(whole[k] for k in slow.places)) or (1.0,)

    left = until - course.t
    found = reduced.follow(slow.formulas, (order,), [branch], slow.slow, mu, slow.values, left, rtol, inside)
    places = list(slow.places)
    stretch = Stretch(course.t, mode.name, lambda u: found.states(u)[0][places])
    t, state = course.t + found.end, tuple(stretch.states(found.end).tolist())
    if found.end >= left:
        return replace(course, t=until, state=state, stretches=(*course.stretches, stretch))
    guard = int(np.argmin(mode.guard_values(t, state)))
    return course.met(automaton, guard, t, state, stretch)


def courses(scene: Any, method: str, orders: tuple[int, ...], rtol: float) -> list[Course]:
    """Return the course of a scene to every order: the first layer once, then slow motions and later layers.

    ``"slow"`` raises ``NoManifold`` where the first layer meets an event.
    """
    automaton, until = Automaton(scene.system, scene.values), float(scene.until)
    mu = float(dict(zip(scene.system.parameters, scene.values, strict=True))[scene.system.small])
    branch = automaton.first(scene.start)
    begin = Course(0.0, tuple(map(float, scene.start)), branch, modes=(branches.name(branch),))
    landed = through_layer(automaton, begin, until, mu, orders[-1], rtol)
    if method == "slow" and landed.events:
        raise NoManifold(f"the fast motion passes {' -> '.join(landed.modes)} at t = 0; use method='jump'")
    return [_onward(automaton, landed, until, mu, order, rtol) for order in orders]


def _onward(automaton, course, until, mu, order, rtol):
    while course.t < until:
        course = slowly(automaton, course, until, mu, order, rtol)
        if course.t < until:
            course = through_layer(automaton, course, until, mu, order, rtol)
    return course
