r"""``method="exact"`` where all modes are affine: in doubles, and on mpmath numbers to any number of digits.

``run`` first follows a scene in doubles and estimates the rounding error (``rounding``). Where this error may show in
the result, or a sign is undecided, the events of this run are refined in mpmath numbers or the scene is followed again
in them, and the result is rounded to doubles. ``_followed`` is the hard function: its ``advance`` follows one mode.
"""

import math
from contextlib import suppress
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from asympk import arithmetic
from asympk.affine import form
from asympk.affine.exponential import DIGITS_FOR_DOUBLES, states_beyond
from asympk.affine.forcing import rounding_of_waves, with_waves
from asympk.affine.mode import ClosedSegment, in_digits
from asympk.affine.rounding import estimate
from asympk.affine.swift import Swift
from asympk.arithmetic import LARGEST_DOUBLE, UNIT, Doubles, agreed, flow_context, set_digits
from asympk.automaton import loop
from asympk.automaton.automaton import Automaton
from asympk.automaton.modes import GuardedMode, mode_of, on_all_sides, phases_of
from asympk.digits import SHOWN_OF_ERRORS, carried, double
from asympk.errors import NegativeFriction, NoMotion, OutOfRange, TooLarge, TooManyEvents, TwoMotions, Undecided
from asympk.numbers import MOST_DIGITS, Number, whole
from asympk.path import ClosedForm, Path, times_within
from asympk.symbolic import guards
from asympk.symbolic.system import System
from asympk.systems.automata import automaton_of

MOST_SPARE = 300  # digits beyond four times those asked for, up to which a run is repeated
_TOUCHED = "slip_onset", "lift_off", "force_zero"  # a mode goes on where one of these guards only touches 0
_FADED = 3  # times the digits of a run: a velocity of which less is left counts as 0 where a mode begins
TRUSTED = 5e-14  # the largest estimated error of a run in doubles that is returned as it is
TRUSTED_EVENTS = 1e-8  # the largest estimated error of a run in doubles whose sequence of events is trusted
_WITHIN = np.arange(1, 17) / 16  # parts of a segment at which its states are looked at


class TimedSegment(NamedTuple):
    """One segment of a run: its starting time, its closed form, its duration, and the guard that ends it or None.

    ``late`` is what rounding took from the time at its end.
    """

    start: Any
    segment: ClosedSegment
    span: Any
    guard: int | None
    late: Any = 0


class AffineDense(ClosedForm):
    """The state of a solved scene as a function of time."""

    __slots__ = ()

    def __call__(self, t: Any) -> Any:
        if self.digits is None and self.convert is float:
            return self._states(times_within(t, self.scene.until))
        return super().__call__(t)

    def _states(self, times):
        flat, size = times.ravel(), len(self.scene.names)
        found = np.empty((size, flat.size))
        which = np.searchsorted([timed.start for timed in self.segments], flat, side="right") - 1
        for k in np.unique(which):
            timed, mine = self.segments[k], which == k
            found[:, mine] = timed.segment.states(flat[mine] - timed.start)[:size]
        return found.reshape(size, *times.shape)

    def state_within(self, timed: Any, t: Number) -> np.ndarray:
        return timed.segment.state(t)[: len(self.scene.names)]


@lru_cache(maxsize=256)
def obstacle(system: System) -> str | None:
    """Return words on what is not affine in a system, or None where the exact flow takes it.

    All modes must be affine with sums of waves as forcing, and a mode that the state or the time switches must be so on
    each side. The phase of one friction does not change the terms of the others, so the modes of
    ``guards.sample_branches``, which differ from one mode in one phase, decide for all.
    """
    modes = (side for branch in guards.sample_branches(system) for side in on_all_sides(mode_of(system, branch)))
    return next(filter(None, map(_mode_obstacle, modes)), None)


def _mode_obstacle(mode: GuardedMode) -> str | None:
    found = form.form_of(mode)
    return form.mode_obstacle(mode) if found is None else states_beyond(len(found.matrix) + 1)


def scene_obstacle(scene: Any) -> str | None:
    """Return ``obstacle`` of the system of a scene with the scene's numbers in exponents."""
    return obstacle(automaton_of(scene).system)


def affine(system: System) -> bool:
    """Tell whether all modes of a system are affine, with sums of waves as forcing, and without switching surfaces."""
    return not phases_of(system) and obstacle(system) is None


def run(scene: Any, method: str = "exact", *, digits: int | None = None, events: int = 1000) -> Path:
    """Follow ``scene`` in closed form, in doubles, or on mpmath numbers right to ``digits`` digits (1 to 1000).

    ``error`` of the path is an estimate in doubles, relative to the largest of 1 and the final states, and with
    ``digits`` the distance from a run at lower precision. ``events`` bounds the number of events. Raises
    ``OutOfRange`` where a rate is not finite, ``TooManyEvents``, ``TooLarge``, ``Undecided``, ``Accumulation``,
    ``NoMotion`` and ``TwoMotions``.
    """
    task = SceneFlows(scene, flows(automaton_of(scene)), events)
    try:
        if digits is None:
            return _in_doubles(task)
        digits = whole("digits", digits, 1, MOST_DIGITS)
        joined, error = _certified(task._replace(known=_known(task)), digits)
        return _path(task, digits, joined, partial(carried, digits=digits), carried(error, SHOWN_OF_ERRORS))
    except TooLarge:
        raise
    except (OverflowError, ZeroDivisionError):
        raise OutOfRange("a rate of the system is not a finite number at these parameters; give others") from None


class SceneFlows(NamedTuple):
    """A scene, the flows of its modes, the most events allowed, and ``known``, a run in coarser numbers, or None."""

    scene: Any
    flows: "Flows"
    events: int
    known: Any = None


def _in_doubles(task):
    try:
        joined, worst, error = _estimated(task)
    except (NoMotion, TwoMotions) as stopped:
        if not stopped.t:  # at the start, which is exact, more digits find the same
            raise
        with suppress(NoMotion, TwoMotions):  # in doubles rounding may hide which modes are consistent
            return _rounded(task)
        raise
    if worst <= TRUSTED:
        return _path(task, None, joined, float, error)
    return _rounded(task._replace(known=joined if worst <= TRUSTED_EVENTS else None))


def _rounded(task):
    """Return the path that is computed in more digits than doubles have, and rounded to doubles.

    Runs amplify their rounding errors alike (Lemma 8). A known run in doubles is off by at most ``TRUSTED_EVENTS``, and
    one of 30 digits more, in which no sign is undecided, by less than any double shows: no other needs to agree.
    """
    if task.known:
        with suppress(Undecided):
            joined = _with_digits(task, DIGITS_FOR_DOUBLES, LARGEST_DOUBLE)
            apart = _distance(task.known, joined)
            if apart is not None and apart <= TRUSTED_EVENTS:
                return _path(task, None, joined, double, UNIT)
    joined, _ = _certified(task._replace(known=None), arithmetic.DIGITS_OF_DOUBLES, LARGEST_DOUBLE)
    return _path(task, None, joined, double, UNIT)


def _estimated(task):
    """Return a run in doubles and its estimated error, or (None, inf, inf) where doubles cannot follow the scene.

    The error is given twice: the largest of a state relative to its own largest value on the path, which tells whether
    doubles serve, and the largest relative to the largest of 1 and the final states.
    """
    done = list[TimedSegment]()
    try:
        with np.errstate(all="ignore"):
            joined = _followed(Doubles, task, done)
            worst, error = _errors([s.work for s in joined.segments], task)
    except TooLarge:
        raise
    except (Undecided, OutOfRange, OverflowError, ZeroDivisionError) as reason:
        if isinstance(reason, NegativeFriction) and done and _errors(done, task)[0] <= TRUSTED:
            raise
        return None, math.inf, math.inf
    return joined, worst, float(error / max(1.0, *map(abs, joined.last.state)))


def _errors(done, task):
    """Return the largest estimated error of a state relative to its own largest value on a path, and without that.

    Within segments a value counts as at most the largest of 1 and the final states, to which ``error`` is relative.
    """
    with np.errstate(all="ignore"):
        errors, sizes = estimate(done, len(task.scene.start))
        if not (errors <= TRUSTED * sizes).all():  # where segments end, a state may be small by chance
            within = np.hstack([abs(timed.segment.states(timed.span * _WITHIN))[: len(sizes)] for timed in done])
            sizes = np.maximum(sizes, np.minimum(within.max(axis=1), max(1.0, within[:, -1].max())))
    return float((errors / np.where(sizes > 0, sizes, 1.0)).max()), float(errors.max())


def _known(task):
    """Return the run in doubles if its sequence of events is trusted, else None."""
    try:
        joined, worst, _ = _estimated(task)
    except (TooLarge, NegativeFriction, NoMotion, TwoMotions):
        return None
    return joined if worst <= TRUSTED_EVENTS else None


class Flows:
    """The flows of the modes of an automaton, each computed when a motion first enters its mode."""

    def __init__(self, automaton: Automaton) -> None:
        self.automaton = automaton
        self.swift = Swift(self)
        self._found: dict = {}

    def of(self, m: Any, mode: GuardedMode, form_of: Any = form.form_of) -> tuple[Any, tuple, tuple[int, ...]]:
        """Return (flow, waves, indices of the guards that move) of a mode, by its form, in the numbers of ``m``."""
        # signs at one precision differ by the margin, too
        key = mode.branch, mode.sides, form_of, m.prec, m.margin, m.largest
        if key not in self._found:
            digits = DIGITS_FOR_DOUBLES if m is Doubles else m.dps
            found, waves, moving = form.placed(form_of(mode), self.automaton.values, digits)
            waves = tuple((power, m.split(decay), m.split(turn), *kind) for power, decay, turn, *kind in waves)
            self._found[key] = found.in_doubles if m is Doubles else in_digits(m, found), waves, moving
        return self._found[key]


flows = lru_cache(maxsize=256)(Flows)  # further scenes may have the same parameters


def _followed(m, task, done):
    """Follow a scene in the numbers of ``m``; ``done`` gets the segments, also those before an error."""
    scene, automaton = task.scene, task.flows.swift
    until, digits = m.number(scene.until), None if m is Doubles else m.dps

    def advance(mode, t, state, segments):
        flow, waves, kept = task.flows.of(m, mode.mode)
        late = segments[-1].work.late if segments and segments[-1].t == t else m.number(0)
        start, known = _with_waves(m, waves, t, late, state)
        vanishing = _vanishing(mode, t, state, segments)
        zeros = [q for q, guard in enumerate(kept) if guard in vanishing or (
            done and mode.kinds[guard][0] == "velocity_zero" and _has_faded(m, flow.rows[q], start, done[-1].segment))]
        segment = ClosedSegment(flow, start, known, zeros=zeros, level=zeros if _begins_to_slip(mode, segments) else (),
                                touching=_touching(mode, flow.mode, waves, kept, state, segments))
        if segment.held and m.margin:  # what stays 0 is idle: rounding has taken the motion out of the start
            raise Undecided
        span, hits = _span(task, m, mode, segment, until - t - late, len(segments))
        if mode.mode.laws and (pushed := _pushed_on(task, m, mode, (t, late, state), span)):
            done.append(TimedSegment(t, segment, pushed[0], None))
            return loop.Segment(t + pushed[0], state, pushed[1])
        found, hit = bool(hits), hits[0] if hits else None
        end = segment.at_event(span, hit) if found else segment.state(span)
        end = end if m.margin else segment.without_rounding(span, end)
        if digits and not task.known:
            segment.require_digits(span, end)
        if (size := max(map(abs, end[: len(state)]))) > m.largest:  # waves may be larger
            raise TooLarge(f"the path reaches 1e{int(m.log(size) / m.log(10))} at t = {float(t + span):.6g}, beyond "
                           "the numbers in use: take a smaller until")
        reached, lost = (min(m.fsum((t, late, span)), until), kept[hit]) if found else (until, None)
        done.append(timed := TimedSegment(t, segment, span, hit, m.fsum((t, late, span, -reached))))
        return loop.Segment(reached, tuple(end[: len(state)]), lost, timed, together=tuple(kept[q] for q in hits[1:]),
                            within=lambda at: tuple(segment.state(at - t)[: len(state)]))

    start = tuple(map(m.number, scene.start))
    first = automaton.first(scene.start, digits)
    joined = loop.follow(automaton, first, start, until, advance, task.events, digits, m.slack)
    if joined.last.short:
        raise TooManyEvents(f"{joined.last.short} at t = {float(joined.last.t):.6g} of until = {float(until):.6g}; "
                            "take a smaller until, or allow more events", joined.last.t, joined.last.state)
    return joined if until else _standing(joined, automaton, digits, advance)


def _with_waves(m, waves, t, late, state):
    """Return the state with the waves at t + late, and the sizes to which the errors of these are proportional."""
    off = UNIT if m is Doubles else 1
    return with_waves(m, waves, t, state, late), rounding_of_waves(m, waves, t, state, off)


def _pushed_on(task, m, mode, begun, span):
    """Return the time in a segment at which friction becomes negative, and its number after the guards, or None."""
    flow, waves, kept = task.flows.of(m, mode.mode, form.form_of_laws)
    found = ClosedSegment(flow, *_with_waves(m, waves, *begun)).first_event(span)
    return found and (found[0], len(mode.kinds) + kept[found[1][0]])


def _vanishing(mode, t, state, segments):
    """Return the guards that are exactly 0 where a mode begins: velocities of frictions that have changed their phase.

    Rounding may hide these zeros, and where several guards vanish together, no state may be movable onto all of them:
    the sliding velocity of a body at rest on a shaken table depends on the time alone.
    """
    before, jumping = segments[-1].branch if segments else mode.branch, mode.mode.jumping
    turned = {k for k, (was, now) in enumerate(zip(before, mode.branch, strict=True))
              if not (was.is_open or now.is_open) and was.velocity != now.velocity
              and not (k in jumping and mode.signs((jumping[k],), t, state)[0])}
    return [k for k, (kind, friction) in enumerate(mode.kinds) if kind == "velocity_zero" and friction in turned]


def _has_faded(m, row, start, before):
    """Tell whether a velocity is nothing beside what the segment ``before`` had begun with: it creeps to rest."""
    sizes = zip(row[:-1], before.start, strict=False)
    value = abs(sum(c * w for c, w in zip(row, [*start, 1], strict=True)))
    return 0 < value <= m.eps**_FADED * sum(abs(c * w) for c, w in sizes)


def _touching(mode, affine_mode, waves, kept, state, segments):
    """Return the guards that touch 0 and never fall, as the edge of stick under a drive as large as friction.

    The states that stay 0 are those at rest and, from an exact start, those that only such states move.
    """
    found = [q for q, guard in enumerate(kept) if waves and mode.kinds[guard][0] in _TOUCHED]
    moves = {k: {j for j, c in enumerate(affine_mode.rows[k]) if c} for k, w in enumerate(state) if found and not w}
    zeros = {k for k in moves if not (segments and moves[k])}
    while driven := {k for k in zeros if moves[k] - zeros}:
        zeros -= driven
    return [q for q in found if affine_mode.touches(q, waves, zeros)]


def _begins_to_slip(mode, segments):
    """Tell whether a mode begins as one contact, and nothing else, leaves rest with its static friction as the kinetic.

    Its forces are those at rest then, and its acceleration is 0.
    """
    last = segments[-1] if segments else None
    if last is None or last.together or last.sides != mode.mode.sides or mode.mode.jumping:
        return False
    pairs = enumerate(zip(last.branch, mode.branch, strict=True))
    changed = [(k, was, now) for k, (was, now) in pairs if was[:2] != now[:2]]
    if len(changed) != 1:
        return False
    k, was, now = changed[0]
    friction = mode.mode.system.frictions[k]
    return was.mode == "stick" and was.load == now.load and friction.static == friction.kinetic


def _standing(joined, automaton, digits, advance):
    """Return the run of a scene with ``until`` = 0 with the closed form of its segment, which has no length."""
    last = joined.last
    only = last._replace(work=advance(automaton.mode(last.branch, digits, last.sides), last.t, last.state, ()).work)
    return joined._replace(last=only, segments=(only,))


def _span(task, m, mode, segment, remaining, k):
    """Return (duration, guards lost together) of segment number k, refined from the known run if there is one."""
    if task.known:
        if k >= len(task.known.segments):
            return remaining, ()
        known = task.known.segments[k]
        if (known.branch, known.sides) != (mode.branch, mode.mode.sides):
            raise Undecided
        timed = known.work
        if timed.guard is None:
            return remaining, ()
        span = segment.refined(m.number(timed.span), timed.guard)
        if span > remaining * (1 + m.root_tol):
            raise Undecided
        return span, (timed.guard,)
    return segment.first_event(remaining) or (remaining, ())


def _certified(task, digits, largest=None):
    """Return (run, error) right to ``digits`` digits; the first trial alone uses the known run."""
    most = 4 * digits + MOST_SPARE

    def follow(working, tie):
        first = working < 2 * (digits + arithmetic.SPARE_DIGITS)
        return _with_digits(task if first else task._replace(known=None), working, largest or most, tie)

    return agreed(follow, _distance, digits, most)


def _with_digits(task, working, largest, tie=False):
    """Return the run in mpmath numbers of ``working`` digits up to ten to the power ``largest``."""
    m = flow_context(largest)
    set_digits(m, working, tie)
    return _followed(m, task, [])


def _distance(coarse, fine):
    """Return the distance of the final states, relative to the largest state of ``fine``; None where modes differ."""
    if coarse.modes != fine.modes:
        return None
    states = [event.state for event in fine.events] + [fine.last.state, fine.segments[0].work.segment.start]
    size = max(abs(w) for state in states for w in state)
    off = max(abs(a - b) for a, b in zip(coarse.last.state, fine.last.state, strict=True))
    return off / size if size else off


def _path(task, digits, joined, convert, error):
    events = tuple(e._replace(t=convert(e.t), state=tuple(map(convert, e.state))) for e in joined.events)
    segments = [segment.work for segment in joined.segments]
    dense = AffineDense(run, task.scene, digits, segments, convert, segments[0].segment.m)
    return Path(task.scene, "exact", tuple(map(convert, joined.last.state)), events, joined.modes, dense, error)
