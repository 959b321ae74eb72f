r"""``method="exact"`` where all modes are affine: in doubles, and on mpmath numbers to any number of digits.

A run in doubles keeps account of its own rounding. Where that may show, or a sign cannot be told, the events are
refined, or the flow followed anew, on mpmath numbers, and the result is rounded from there.
"""

from functools import lru_cache, partial
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np

from asympk.affine import form
from asympk.affine.dense import AffineDense
from asympk.affine.forcing import amplitude, value
from asympk.affine.mode import ClosedSegment, in_digits
from asympk.affine.rounding import estimate
from asympk.affine.swift import Swift
from asympk.arithmetic import Doubles, flow_context, set_digits
from asympk.automaton import loop
from asympk.automaton.automaton import Automaton
from asympk.automaton.modes import mode_of
from asympk.digits import carried, double
from asympk.errors import InputError, OutOfRange, TooLarge, TooManyEvents, Undecided
from asympk.path import Path
from asympk.symbolic import branches
from asympk.symbolic.branches import Branch
from asympk.symbolic.system import System

MOST_DIGITS = 1000
SPARE_DIGITS = 30
MOST_SPARE = 300
DIGITS_OF_DOUBLES = 17
LARGEST_DOUBLE = 308
SHOWN_OF_ERRORS = 3
TRUSTED = 5e-14
TOLD = 1e-8  # an estimated error up to which the order of events in doubles stands
ROUNDED = 2.0**-53


class TimedSegment(NamedTuple):
    """One segment of a run: its start, its closed form, its duration, and the guard that ends it or None."""

    start: Any
    segment: ClosedSegment
    span: Any
    guard: int | None


@lru_cache(maxsize=256)
def obstacle(system: System) -> str | None:
    """Return what keeps a system from the exact flow, or None where all modes are affine and their forcing is carried.

    What one friction does leaves the others' terms as they are: modes that differ from one of them in one phase tell.
    """
    modes = (mode_of(system, branch) for branch in branches.telling(system))
    return next((form.mode_obstacle(mode) for mode in modes if form.form_of(mode) is None), None)


def affine(system: System) -> bool:
    """Tell whether all modes of a system are affine in its states, and their forcing of a kind that can be carried."""
    return obstacle(system) is None


def run(scene: Any, method: str = "exact", *, digits: int | None = None, events: int = 1000) -> Path:
    """Follow ``scene`` in closed form, in doubles, or on mpmath numbers right to ``digits`` digits (1 to 1000).

    ``error`` of the path is an estimate for doubles, and the distance to a run at less precision with ``digits``;
    ``events`` bounds the number of events. Raises ``OutOfRange`` where a rate is not finite, ``TooManyEvents``,
    ``TooLarge``, ``Undecided``, ``Accumulation``, ``NoMotion`` and ``TwoMotions``.
    """
    case = SceneFlows(scene, flows(Automaton(scene.system, scene.values)), events)
    try:
        return _in_doubles(case) if digits is None else _in_digits(case, digits)
    except ZeroDivisionError:
        raise OutOfRange("a rate of the system is not a finite number at these parameters; give others") from None


def _in_digits(case, digits):
    if isinstance(digits, bool) or not isinstance(digits, Integral) or not 1 <= digits <= MOST_DIGITS:
        raise InputError(f"digits = {digits!r}: it must be an integer from 1 to {MOST_DIGITS}")
    digits = int(digits)
    course, error = _certified(case._replace(known=_known(case)), digits)
    return _path(case, digits, course, partial(carried, digits=digits), carried(error, SHOWN_OF_ERRORS))


class SceneFlows(NamedTuple):
    """A scene, the flows of its modes, the number of events allowed, and a course in coarser numbers, if known."""

    scene: Any
    flows: "Flows"
    events: int
    known: Any = None


def _in_doubles(case):
    course, error = _estimated(case)
    if error <= TRUSTED:
        return _path(case, None, course, float, error)
    known = course if error <= TOLD else None
    course, _ = _certified(case._replace(known=known), DIGITS_OF_DOUBLES, LARGEST_DOUBLE)
    return _path(case, None, course, double, ROUNDED)


def _estimated(case):
    """Return (course, error) of a run in doubles; (None, inf) where they cannot follow the scene."""
    try:
        with np.errstate(all="ignore"):
            course = _course(Doubles, case)
        return course, estimate([s.work for s in course.segments], len(case.scene.start))
    except TooLarge:
        raise
    except (Undecided, OverflowError, ZeroDivisionError):
        return None, float("inf")


def _known(case):
    """Return the course in doubles where it can be trusted to have the right events, else None."""
    try:
        course, error = _estimated(case)
    except TooLarge:
        return None
    return course if error <= TOLD else None


@lru_cache(maxsize=256)
def flows(automaton: Automaton) -> "Flows":
    """Return the flows of an automaton, kept for the next scene of the same parameters."""
    return Flows(automaton)


class Flows:
    """The flows of the modes of an automaton, each found when a motion enters its mode."""

    def __init__(self, automaton: Automaton) -> None:
        self.automaton = automaton
        self.swift = Swift(self)
        self._found: dict = {}

    def of(self, m: Any, branch: Branch) -> tuple[Any, tuple, tuple[int, ...]]:
        """Return (flow, waves, indices of the guards that move) of a mode in the numbers of ``m``."""
        key = branch, m.prec
        if key not in self._found:
            affine_form = form.form_of(mode_of(self.automaton.system, branch))
            found = form.placed(affine_form, self.automaton.values, 24 if m is Doubles else m.dps)
            flow = found.mode.in_doubles if m is Doubles else in_digits(m, found.mode)
            waves = [(power, m.number(decay), m.number(turn), sine) for power, decay, turn, sine in found.waves]
            self._found[key] = flow, tuple(waves), found.kept
        return self._found[key]


def _course(m, case):
    """Follow a scene in the numbers of ``m``."""
    scene, automaton = case.scene, case.flows.swift
    until, digits = m.number(scene.until), None if m is Doubles else m.dps
    slack = 2.0**-48 if m is Doubles else max(m.margin, m.eps * 2**10)

    def advance(mode, t, state, segments):
        flow, waves, kept = case.flows.of(m, mode.branch)
        known = [*map(abs, state), *(amplitude(m, *wave, t) for wave in waves)]
        segment = ClosedSegment(flow, (*state, *(value(m, *wave, t) for wave in waves)), known)
        span, hit = _span(case, m, mode, segment, until - t, len(segments))
        found = hit is not None
        end = segment.at_event(span, hit) if found else segment.state(span)
        if (size := max(map(abs, end))) > m.largest:
            raise TooLarge(f"the path reaches 1e{int(m.log(size) / m.log(10))} at t = {float(t + span):.6g}, beyond "
                           "the numbers in use: take a smaller until")  # fmt: skip
        reached, lost = (t + span, kept[hit]) if found else (until, None)
        return loop.Segment(reached, tuple(end[: len(state)]), lost, TimedSegment(t, segment, span, hit))

    start = tuple(map(m.number, scene.start))
    if not until:
        return _standing(automaton, start, advance)
    first = automaton.first(scene.start)
    course = loop.follow(automaton, first, start, until, advance, case.events, digits, slack)
    if course.last.short:
        raise TooManyEvents(f"{course.last.short} at t = {float(course.last.t):.6g} of until = {float(until):.6g}; "
                            "take a smaller until, or allow more with events=")  # fmt: skip
    return course


def _standing(automaton, start, advance):
    """Return the course of a scene that ends at its start."""
    mode = automaton.mode(automaton.first(start))
    segment = advance(mode, 0 * start[0], start, ())
    return loop.Run(segment._replace(state=start, hit=None), (), (mode.name,), (segment._replace(state=start),))


def _span(case, m, mode, segment, left, k):
    """Return (duration, guard lost or None) of the segment number k; from the known course, if there is one."""
    if case.known:
        if k >= len(case.known.modes) or case.known.modes[k] != mode.name:
            raise Undecided
        leg = case.known.segments[k].work
        return (left, None) if leg.guard is None else (segment.refined(m.number(leg.span), leg.guard), leg.guard)
    found = segment.first_event(left)
    return (found[0], found[1][0]) if found else (left, None)


def _certified(case, digits, largest=None):
    """Return (course, error): runs at two precisions agree to ``digits`` digits, and the error is their distance.

    The digits at work are doubled until the runs agree; with the most that may be spent, a sign within the margin of
    rounding is taken as it is.
    """
    most = 4 * digits + MOST_SPARE
    working = digits + SPARE_DIGITS
    while working < 2 * most:
        coarse = _tried(working, working >= most, case, largest or most)
        fine = coarse and _tried(working + 8 + digits // 4, working >= most, case, largest or most)
        error = _distance(coarse, fine) if fine else None
        if error is not None and error * 10**digits < 1:
            return fine, error
        case, working = case._replace(known=None), working * 2
    raise Undecided(f"the course of events cannot be told with {working // 2} digits: it hangs on a sign that they do "
                    "not decide, or grows beyond them; take a smaller until or another start")  # fmt: skip


def _tried(digits, tie, case, largest):
    m = flow_context(largest)
    set_digits(m, digits, tie)
    try:
        return _course(m, case)
    except Undecided:
        return None


def _distance(coarse, fine):
    """Return the distance of the final states, relative to the largest value on the path; None when events differ."""
    if coarse.modes != fine.modes:
        return None
    states = [event.state for event in fine.events] + [fine.last.state, fine.segments[0].work.segment.start]
    size = max(abs(w) for state in states for w in state)
    off = max(abs(a - b) for a, b in zip(coarse.last.state, fine.last.state, strict=True))
    return off / size if size else off


def _path(case, digits, course, convert, error):
    events = tuple(e._replace(t=convert(e.t), state=_converted(e.state, convert)) for e in course.events)
    legs = [segment.work for segment in course.segments]
    dense = AffineDense(run, case.scene, digits, legs, convert)
    return Path(case.scene, "exact", _converted(course.last.state, convert), events, course.modes, dense, error)


def _converted(state, convert):
    return tuple(map(convert, state))
