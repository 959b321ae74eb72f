"""The asymptotic model of any system with friction or switching surfaces: layers, and slow motion to order n.

A layer lasts a time O(mu log(1/mu)), and over so short a time its equations are not stiff. ``through_layer`` integrates
the full equations at the given mu, and so all powers of mu and log(1/mu), until the remaining fast motion moves the
slow states by less than the tolerance; an error in time passes its step control, as slow motion hardly feels it.
``slowly`` follows the slow motion on the manifold to order n until a guard of its mode vanishes, where the next layer
begins; ``onward`` alternates the two. The omitted terms are O(mu^(n + 1)): the motion to order n + 1 tells their size,
and that to n + 2 where successive terms fall slowly (``followed_to``, ``decay``). The hard functions are ``_in_mode``,
which integrates a layer through one mode, and ``_over``, which predicts its end.
"""

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from asympk.asymptotics import reduced
from asympk.asymptotics.fibre import Formulas, formulas
from asympk.asymptotics.landing import FINEST, NEAR, OVER, UNBOUNDED, abscissa, attraction, newton, reach, root
from asympk.asymptotics.nonstiff import Step, Trajectory, steps
from asympk.asymptotics.watching import watched
from asympk.automaton.automaton import ROUNDED, Automaton, mode_on_sides
from asympk.automaton.loop import lost_with, mode_after, on_zeros, require_begun
from asympk.automaton.modes import GuardedMode
from asympk.automaton.numericmode import LOOKS, NumericMode
from asympk.errors import NoManifold, NotNormallyHyperbolic, OutOfRange, TooManyEvents
from asympk.numbers import listed
from asympk.path import Event
from asympk.shown import condensed
from asympk.symbolic import guards
from asympk.symbolic.branches import Branch
from asympk.symbolic.coefficients import name_of, with_names
from asympk.symbolic.sides import on_sides
from asympk.symbolic.system import Mode, System

STEPS, FEW_STEPS = 3000, 200
FAR = 1e12
FAR_OFF = 0.5  # the largest Newton step to the manifold, relative to the fast states, at which a layer may soon be over
IN_FAST = 0.01  # mu times the error of a fast state, in units of the tolerance: the slow states feel this product
ROUGHEST = 1e-4  # the largest error of a fast state, and of the fast time, as the guards of a layer depend on them
LATE = 0.01  # the allowed error in time of one step of a layer, in units of the tolerance
GENTLY = 0.01  # the largest fall of a guard in a time mu at which slow motion, not the fast, meets its zero
STRETCHES = 3000
TRIES = 6  # layers, each twice as long as the last, after which slow motion may come back to the edge that it has met


class Unsettled(OutOfRange):
    """A layer does not settle, or fades so slowly beside its fastest rate that it takes too many steps."""


@dataclass(frozen=True)
class Task:
    """How motions are followed: in which automaton, until when, slow motion to which order, with which tolerance.

    With ``whole`` slow motion has all powers of mu that the fast states bring into the rates, beyond the order, too.
    A layer from near a repelling manifold has a tolerance as much smaller, but at least ``least``.
    """

    automaton: Automaton
    until: float
    mu: float
    order: int
    rtol: float
    whole: bool = False
    least: float = FINEST

    @classmethod
    def of(cls, scene: Any, order: int, rtol: float) -> "Task":
        """Return the task of a scene."""
        return cls(Automaton(scene.system, scene.values), float(scene.until), small_number(scene), order, rtol)

    @property
    def time_error(self) -> float:
        """Return the allowed error in time of one step of a layer: slow states change by less than ``rtol`` in it."""
        return min(LATE * self.rtol * min(1.0, self.until), ROUGHEST * self.mu)

    @property
    def fast_error(self) -> float:
        """Return the allowed error of the fast states in one step of a layer."""
        return min(IN_FAST * self.rtol / self.mu, ROUGHEST)


class Stretch(NamedTuple):
    """The motion in one mode from the time ``began`` on; ``states(t)`` takes an array of times since ``began``.

    ``slowly`` is the slow motion, or None for a layer.
    """

    began: float
    mode: NumericMode
    states: Callable
    slowly: reduced.Reduced | None = None


@dataclass(frozen=True)
class MatchedPath:
    """A motion up to the time ``t``: its state and mode at ``t``, and its events, modes and stretches until then."""

    t: float
    state: tuple
    mode: NumericMode
    events: tuple[Event, ...] = ()
    modes: tuple[str, ...] = ()
    stretches: tuple[Stretch, ...] = ()

    def met(
        self, task: Task, guard: int, t: float, state: tuple, stretch: Stretch, place: tuple | None = None
    ) -> "MatchedPath":
        """Return the path continued into the mode that follows when ``guard`` vanishes at (t, state).

        Guards that vanish within ``task.time_error`` of it vanish with it. The mode is that which follows at the time
        and the state ``place``, if given.
        """
        automaton = task.automaton
        if len(self.stretches) == STRETCHES:
            raise TooManyEvents(f"more than {STRETCHES} layers and slow motions by t = {t:.6g}, at "
                                f"{listed(automaton.system.states, state)}", t, state)
        at, seen = place or (t, state)
        hits = (guard, *lost_with(self.mode, guard, at, seen, task.time_error))
        seen = on_zeros(self.mode, hits, at, seen)
        mode, seen, event = mode_after(automaton, self.mode, at, seen, hits, fixed=True)
        require_begun(mode, at, seen)
        state = mode.settled(t, state) if place else seen
        path = replace(self, t=t, state=state, mode=mode, stretches=(*self.stretches, stretch))
        if event is None:
            return path
        return replace(path, events=(*self.events, event._replace(t=t, state=state)), modes=(*self.modes, mode.name))


def entered(automaton: Automaton, branch: Branch, t: float, state: tuple) -> NumericMode:
    """Return the mode of a branch at (t, state), on the sides of the switching surfaces that the motion enters."""
    return mode_on_sides(automaton, branch, None, t, state, automaton.edges_at(t, state, ROUNDED), fixed=True)


@dataclass(frozen=True)
class Slow:
    """The slow motion of one mode in numbers; ``values`` are all parameters, coefficients included, but for mu.

    The mode lists its states as (*slow, *fast), and the time of the system, if any, is one of its slow states.
    ``places[i]`` is the index in that list of state i of the system. ``sources[j]`` is the index of state j of that
    list in (*states of the system, time).
    """

    formulas: Formulas
    values: tuple
    places: tuple[int, ...]
    sources: tuple[int, ...]

    def point(self, t: float, state: tuple) -> tuple[tuple, tuple]:
        """Return (x, y) of the mode."""
        slow, found = len(self.formulas.slow_states), tuple(map((*state, t).__getitem__, self.sources))
        return found[:slow], found[slow:]

    def state(self, order: int, point: Sequence[float], mu: float) -> tuple:
        """Return the state of the system on the manifold to ``order`` at a point (x, b) of the slow motion."""
        whole = (*point[: len(self.formulas.slow_states)], *self.formulas.height(order)(*point, mu, *self.values))
        return tuple(map(whole.__getitem__, self.places))

    def along(self, found: reduced.Reduced) -> Iterator[tuple[float, tuple]]:
        """Yield the times and the states of the system at the ends of the steps of a slow motion."""
        for step in found.trajectory.steps:
            after = min(step.after, found.end)
            yield after, self.state(found.kinds[0][0], step.state_at(after), found.mu)

    def distance(self, order: int, x: tuple, y: tuple, branch: tuple, mu: float) -> float:
        """Return max |y - h(x, mu)| for the manifold to ``order``; ``branch`` is h(x, 0)."""
        height = self.formulas.height(order)(*self.formulas.on_branch(x, branch), mu, *self.values)
        return max(abs(v - h) for v, h in zip(y, height, strict=True))


def slow_of(mode: NumericMode) -> Slow:
    """Return the slow motion of a mode with its formulas."""
    known, kept = _formulas(mode.mode, mode.coefficients)
    return Slow(known, tuple(map(mode.p.__getitem__, kept)), *_places(mode.mode.system, known.mode))


@lru_cache(maxsize=256)
def _formulas(mode: GuardedMode, coefficients: tuple[sp.Expr, ...]) -> tuple[Formulas, tuple[int, ...]]:
    """Return the formulas of a mode, and which of the parameters and ``coefficients`` they take: those without mu."""
    bare, small, parameters = bare_mode(mode), mode.system.small, mode.system.parameters
    kept = tuple(k for k, part in enumerate((*parameters, *coefficients)) if not part.has(small))
    still = tuple(part for part in coefficients if not part.has(small))
    slow, fast = (sp.Dict(dict(zip(rates, with_names(mode.system, (*rates.values(),), still), strict=True)))
                  for rates in (bare.slow, bare.fast))
    names = (*(p for p in parameters if p != small), *map(name_of, still))
    return formulas(replace(bare, slow=slow, fast=fast), small, names), kept


@lru_cache(maxsize=256)
def _places(system: System, mode: Mode) -> tuple[tuple[int, ...], tuple[int, ...]]:
    names, whole = [*mode.slow, *mode.fast], (*system.states, system.time)
    return tuple(map(names.index, system.states)), tuple(map(whole.index, names))


@lru_cache(maxsize=256)
def bare_mode(mode: GuardedMode) -> Mode:
    """Return a mode on its sides, without its condition and with the time as one of its slow states."""
    fields = guards.fields(mode.system, mode.branch)
    slow, fast = (sp.Dict({s: on_sides(rate, mode.all_sides) for s, rate in rates.items()}) for rates in fields)
    return mode.system.autonomous(Mode(mode.name, slow, fast))


def through_layer(task: Task, path: MatchedPath, least: float = 0.0) -> MatchedPath:
    """Follow a path through its layer until only slow motion is left, or to the end.

    Without an event the layer lasts ``least`` at least. Raises ``OutOfRange`` where the fast motion does not settle or
    friction becomes negative, and every error of ``mode_after``.
    """
    while True:
        mode = path.mode
        found, lost = _in_mode(task, mode, slow_of(mode), path, task.fast_error, least)
        if not found:
            return path
        last, size = found[-1], len(path.state)
        stretch = Stretch(path.t, mode, _during(Trajectory(found[0].state, found), size))
        span, guard = lost or (last.after, None)
        t, state = path.t + span, (last.end if guard is None else last.state_at(span))[:size]
        mode.require_opposing((path.t, path.state), [(path.t, path.state)], t, guard)
        require_no_pole(path, [*((step.after, step.end[:size]) for step in found[:-1]), (span, state)])
        if guard is None:
            t = task.until if span == task.until - path.t else t
            return replace(path, t=t, state=state, stretches=(*path.stretches, stretch))
        path, least = path.met(task, guard, t, state, stretch), 0.0


def to_the_end(task: Task, slow: Slow, path: MatchedPath) -> tuple | None:
    """Return the last state of a path that stays in its mode, by at most ``FEW_STEPS`` steps of the full equations.

    None is returned where they are too few, or the rates have no value.
    """
    span, state = 0.0, path.state
    with suppress(ArithmeticError, ValueError):
        for step, _ in islice(_watched_steps(task, path.mode, slow, path, task.rtol), FEW_STEPS):
            span, state = step.after, step.end[: len(path.state)]
    return state if span == task.until - path.t else None


def growing(task: Task, mode: NumericMode, t: float, state: tuple) -> float:
    """Return the distance of the state from a repelling manifold, at most 1, or 1 where the manifold attracts.

    The layer amplifies this distance, so an error of the fast states relative to it is an error in time.
    """
    slow = slow_of(mode)
    x, y = slow.point(t, state)
    if abscissa(slow.formulas, x, y, slow.values) <= 0 or (branch := root(slow.formulas, x, y, slow.values)) is None:
        return 1.0
    return min(1.0, max(task.rtol, slow.distance(task.order, x, y, branch, task.mu)))


def _fastest(slow: Slow, t: float, state: tuple) -> float:
    """Return the largest entry of g_y, at least the smallest normal number."""
    x, y = slow.point(t, state)
    return max(sys.float_info.min, *map(abs, slow.formulas.jacobian(*x, *y, *slow.values)))


def _in_mode(
    task: Task, mode: NumericMode, slow: Slow, path: MatchedPath, off: float, least: float = 0.0
) -> tuple[tuple[Step, ...], tuple[float, int] | None]:
    """Return the steps in one mode, and (time, guard) where a guard ends them, or None: layer over, or the end.

    Times are measured from the start of the layer: the rounding of a later time, over mu, would move the fast states.
    The fast states have errors of ``off``. Where such errors would move the time of an event, as the guard changes
    slowly there, the mode is followed again with errors of ``rtol``.
    """
    ahead, size = _watched_steps(task, mode, slow, path, off), len(path.state)
    remaining, mu, rtol = task.until - path.t, task.mu, task.rtol
    found, span, state, over = list[Any](), 0.0, path.state, math.inf
    far = FAR * reach(slow.formulas, *slow.point(path.t, state), slow.values)
    most = far * max(1.0, _fastest(slow, path.t, state)) / mu  # for y in a jump
    while len(found) < STEPS:
        over = span + _over(task, slow, path.t + span, state, off) if over == math.inf else over
        if span >= min(max(over, least), remaining):
            soon = mode.moved_on(path.t + span, state, mu * OVER / _fastest(slow, path.t + span, state))
            if off > rtol and min(mode.guard_values(*soon), default=0.0) < 0:
                break
            return tuple(found), None
        last, lost = next(ahead, (None, None))
        if last is None or max(map(abs, last.end)) > most:
            raise _unsettled(mode, path.t, path.t + span, state, UNBOUNDED)
        found.append(last)
        span, state = last.after, last.end[:size]
        if lost:
            soon = mode.moved_on(path.t + lost[0], last.state_at(lost[0])[:size], mu)
            if off > rtol and mode.watched_values((), *soon)[lost[1]] > -GENTLY:
                break
            return tuple(found), lost
    else:
        raise _unsettled(mode, path.t, path.t + span, state, f"takes more than {STEPS} steps", Unsettled)
    return _in_mode(task, mode, slow, path, rtol, least)


def _watched_steps(
    task: Task, mode: NumericMode, slow: Slow, path: MatchedPath, off: float
) -> Iterator[tuple[Step, tuple[float, int] | None]]:
    """Return the steps in one mode from the end of a path, each with the first guard or law that it loses, or None."""
    system, flow, now, faded = mode.mode.system, partial(mode.field, 0.0), path.state, mode.faded(path.t, path.state)
    at, rtol = (path.t, path.state), task.rtol
    share, longest = growing(task, mode, *at), task.mu / _fastest(slow, *at)
    atol = tuple(off * share if s in system.fast else rtol for s in system.states)
    if system.time is not None:
        flow, now = _timed(mode), (*path.state, path.t)
    along = steps((flow,), mode.p, now, task.until - path.t, max(task.least, rtol * share), (*atol, rtol)[: len(now)],
                  late=task.time_error, longest=longest, within=mode.longest_step(task.until),
                  slopes=partial(_slopes, mode))
    return watched(along, lambda span, state: mode.watched_values(faded, path.t + span, state), len(atol))


def _unsettled(
    mode: NumericMode, began: float, t: float, state: tuple, words: str, kind: type[OutOfRange] = OutOfRange
) -> OutOfRange:
    """Return the error for a layer that begins at ``began`` and is followed to (t, state)."""
    return kind(f"the layer of {mode.name} from t = {began:.6g} {words}: at t = {t:.6g} it is at "
                f"{listed(mode.mode.system.states, state)}")


def _slopes(mode, now):
    """Return the Jacobian matrix of ``_timed`` with zero derivatives by the time, which cause no stiffness."""
    size = len(mode.mode.system.states)
    found = np.zeros((len(now), len(now)))
    found[:size, :size] = mode.jac(now[-1], now[:size])
    return found


def _during(trajectory, size):
    return lambda t: trajectory(t)[:size]


def _over(task: Task, slow: Slow, t: float, state: tuple, off: float) -> float:
    """Return how long the fast motion still lasts if it is near an attracting manifold, else inf."""
    x, y = slow.point(t, state)
    scale, step = max(1.0, *map(abs, y)), newton(slow.formulas, x, y, slow.values)
    if step is None or max(map(abs, step)) > FAR_OFF * scale:
        return math.inf
    if len(y) == 1 and abscissa(slow.formulas, x, y, slow.values) >= 0:
        return math.inf
    branch = root(slow.formulas, x, y, slow.values)
    if branch is None or not (rate := attraction(slow.formulas, x, branch, slow.values)) > 0:
        return math.inf
    distance = slow.distance(_known(task.order), x, y, branch, task.mu) / scale
    return task.mu * math.log(max(1.0, distance / off)) / rate if distance < NEAR else math.inf


def _timed(mode):
    """Return the rates of a mode as an autonomous field whose last state is the time."""
    size = len(mode.mode.system.states)
    return lambda *arguments: (*mode.field(arguments[size], *arguments[:size], *arguments[size + 1 :]), 1.0)


def slowly(task: Task, path: MatchedPath, limit: bool = False) -> MatchedPath:
    """Follow a path by slow motion from the end of its layer, to the end or into the next mode.

    With ``limit``, for the motion of order 0 whose layers take no time, stick ends where it does to order 0. Raises
    ``NotDerivable`` where a mode has more switches than are followed or the motion stays on a switching surface,
    ``NotNormallyHyperbolic`` where the slow manifold is lost, and ``OutOfRange`` at a pole of the rates or where
    friction becomes negative.
    """
    until, mu, order = task.until, task.mu, task.order
    known = _known(order)
    mode = path.mode
    mode.require_smooth(path.t, until)
    slow = slow_of(mode)
    orders = [0 if limit and kind == "slip_onset" else known for kind, _ in mode.kinds]
    orders += [known for _ in mode.mode.laws]
    guards = partial(_guards, path, slow, orders, mu)
    start, remaining, within = _begin(task, slow, path)
    found = reduced.follow_reduced_flow(
        slow.formulas, order, start, mu, slow.values, remaining, task.rtol, guards, path.t, within, task.whole
    )
    point = found.trajectory.state_at(found.end)
    stretch = Stretch(path.t, mode, lambda u: found.states(u)[0, slow.places], found)
    t, state = path.t + found.end, tuple(stretch.states(found.end).tolist())
    mode.require_opposing((path.t, path.state), [(path.t, path.state)], t, found.guard)
    require_no_pole(path, slow.along(found))
    if found.guard is None:
        return replace(path, t=until, state=state, stretches=(*path.stretches, stretch))
    seen = slow.state(known, point, mu)
    if not max(map(abs, seen)) < FAR * max(1.0, *map(abs, path.state)):
        raise NotNormallyHyperbolic(f"the slow manifold of {mode.name} is lost where it meets its edge at t = {t:.6g}: "
                                    f"its terms of order {known} grow beyond bounds there; use an exact method")
    met = partial(path.met, task, found.guard, t)
    if orders[found.guard] == known:
        return met(seen, stretch)
    span = _until_lost(mode, found.guard, t, seen)
    rates = slow.formulas.flow(order)(*point, mu, *slow.values)
    moved = [w + span * rate for w, rate in zip(point, rates, strict=True)]
    return met(state, stretch, (t + span, slow.state(known, moved, mu)))


def _known(order: int) -> int:
    """Return the order to which slow motion meets guards: the rates of the fast states, which order 0 lacks, count."""
    return max(order, 1)


def _guards(path: MatchedPath, slow: Slow, orders: list[int], mu: float, span: float, at: Sequence[float]) -> list:
    """Return what is watched at the point ``at`` of slow motion, ``span`` after the path, to ``orders``."""
    mode, faded = path.mode, path.mode.faded(path.t, path.state)
    values = {m: mode.watched_values(faded, path.t + span, slow.state(m, at, mu)) for m in {*orders}}
    return [values[m][k] for k, m in enumerate(orders)]


def _until_lost(mode: NumericMode, guard: int, t: float, state: tuple) -> float:
    """Return how long a guard that falls takes to vanish, by its rate: 0 where it does not fall."""
    rate = mode.guard_rates(t, state)[guard]
    return -mode.guard_values(t, state)[guard] / rate if rate < 0 else 0.0


def require_no_pole(path: MatchedPath, along: Iterable[tuple[float, tuple]]) -> None:
    """Raise ``OutOfRange`` where a motion from the end of ``path`` passes a pole.

    ``along`` has the times since then and the states at the ends of the steps of the motion. The integration need not
    notice a pole of the rates, so the signs of their divisors are compared there. A step is assumed to contain at most
    one zero of each divisor.
    """
    mode, since = path.mode, None
    first = values = mode.pole_values(path.t, path.state)
    for span, state in along if values else ():
        t = path.t + span
        values = mode.require_one_side(values, t, state, since)
        since = None if mode.vanishing(first, values) is None else t if since is None else since


def _begin(task: Task, slow: Slow, path: MatchedPath) -> tuple[np.ndarray, float, float]:
    """Return the point (x, b) at which slow motion begins, the time that is left, and the longest step."""
    remaining = task.until - path.t
    start = reduced.branch_at(slow.formulas, *slow.point(path.t, path.state), slow.values)
    return start, remaining, remaining / LOOKS if path.mode.timed else math.inf


def begun(automaton: Automaton, start: tuple) -> MatchedPath:
    """Return the path that begins at ``start``, exact numbers, at t = 0."""
    mode = entered(automaton, automaton.first(start), 0.0, tuple(map(float, start)))
    require_begun(mode, 0.0, tuple(map(float, start)))
    return MatchedPath(0.0, tuple(map(float, start)), mode, modes=(mode.name,))


def onward(task: Task, path: MatchedPath, layer: Callable = through_layer, limit: bool = False) -> MatchedPath:
    """Follow a path from the end of a layer to the end; ``layer(task, path)`` follows each later layer.

    Slow motion may end on an edge from which the full equations lead back into the same mode, as terms that the order
    omits tell the rate of the guard. There these equations are followed until they have left the edge or met it. Raises
    ``OutOfRange`` where they do neither, and in the limit, whose layers take no time.
    """
    at_once, tries = list[NumericMode](), 0  # the modes whose slow motions have ended as they began, one after another
    while path.t < task.until:
        before, path = path, slowly(task, path, limit)
        if path.t == task.until:
            break
        at_once = [*at_once, before.mode] if path.t - before.t <= ROUGHEST * task.mu else []
        back = any(path.mode is mode for mode in at_once)
        turns = limit and sum(before.mode is mode for mode in at_once) > 1
        tries += back
        if turns or (back and (limit or tries > TRIES)):
            small = f"{task.automaton.system.small} = {task.mu:.3g}"
            raise OutOfRange(f"the slow motion in {path.mode.name} goes on from its edge at t = {path.t:.6g} onto the "
                             f"same: rounding, over {small}, decides; use an exact method")
        if back:
            fastest = _fastest(slow_of(path.mode), path.t, path.state)
            path = through_layer(task, path, 2**tries * task.mu * OVER / fastest)
        else:
            path = layer(task, path)
    return path


def followed_to(order: int, task: Task, landed: MatchedPath, path: MatchedPath) -> MatchedPath:
    """Return the whole motion to ``order``; ``path`` continues ``landed`` as ``task`` says.

    Where neither meets a guard after ``landed``, the slow motions to both orders are integrated side by side, and
    their difference is added to the last states of ``path``. The errors of their common steps nearly cancel in the
    difference, so these steps may be long.
    """
    slow, slowly = slow_of(landed.mode), path.stretches[-1].slowly if path.stretches else None
    finely = replace(task, order=order, whole=True)
    if len(path.stretches) != len(landed.stretches) + 1 or slowly is None:
        return onward(finely, landed)
    start, remaining, within = _begin(task, slow, landed)
    found = reduced.side_by_side(slow.formulas, (task.order, order), (start, start), task.mu, slow.values, remaining,
                                 task.rtol, landed.t, within, alone=slowly)
    first, second = found.states(found.end)[:, list(slow.places)]
    state = tuple((np.array(path.state) + second - first).tolist())
    if min(path.mode.guard_values(path.t, state), default=0.0) < 0 or _meets_guard(finely, slow, landed, found):
        return onward(finely, landed)
    return replace(path, state=state)


def _meets_guard(task: Task, slow: Slow, landed: MatchedPath, found: reduced.Reduced) -> bool:
    """Tell whether the last of the slow motions ``found``, which begin where a path has landed, loses a guard."""
    if not (expressions := landed.mode.mode.watched):
        return False
    guards = partial(_guards, landed, slow, [_known(task.order)] * len(expressions), task.mu)
    size = len(found.trajectory.start)
    along = watched(found.trajectory.steps, lambda span, at: guards(span, found.parts(at)[-1]), size)
    return any(lost for _, lost in along)


def decay(task: Task, path: MatchedPath) -> float:
    """Return the second term that the order omits over the first, the largest in slow motions.

    They are looked at where they begin, where they end, and shortly before.
    """
    mu, worst = task.mu, 0.0
    for stretch in path.stretches:
        if (found := stretch.slowly) is None:
            continue
        slow = slow_of(stretch.mode)
        for at in (found.trajectory.start, *found.recent[0][::2]):  # without the middles of intervals
            omitted = slow.formulas.terms(task.order + 2)(*at, mu, *slow.values)[task.order + 1 :]
            first, second = (max(map(abs, terms)) for terms in omitted)
            worst = max(worst, second / first if first > 0 else math.inf if second > 0 else 0.0)
    return worst


def small_number(scene: Any) -> float:
    """Return the value of the small parameter of a scene."""
    return float(dict(zip(scene.system.parameters, scene.values, strict=True))[scene.system.small])


def require_landed(method: str, landed: MatchedPath) -> None:
    """Raise ``NoManifold`` if ``method`` is ``"slow"`` and the first layer meets an event."""
    if method == "slow" and landed.events:
        through, t = condensed(", ".join(landed.modes)).replace(", ", " -> "), landed.events[0].t
        raise NoManifold(f"the fast motion passes {through} from t = {t:.6g}; use method 'jump'")
