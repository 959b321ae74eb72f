"""The loop over segments: it follows one mode after the other, each to the guard that ends this mode.

``follow`` is the loop. Its argument ``advance`` follows one mode, in closed form or by an integrator, and returns a
``Segment``. ``mode_after``, the hard function, returns the mode that follows a lost guard or a switch by the time.
"""

from collections.abc import Callable, Iterable
from itertools import pairwise
from math import ulp
from typing import Any, NamedTuple

import sympy as sp

from asympk.automaton.automaton import ROUNDED, Automaton, mode_on_sides, no_side_entered
from asympk.automaton.contacts import nudges
from asympk.automaton.decide import finite, without_value_soon
from asympk.automaton.junction import BY_HAND, which_contact
from asympk.automaton.modes import NO_FRICTION, SWITCH
from asympk.automaton.numericmode import NumericMode
from asympk.automaton.uniqueness import require_alone
from asympk.errors import Accumulation, NoMotion, TwoMotions, UnboundedReaction, Undecided
from asympk.numbers import listed
from asympk.path import Event
from asympk.symbolic.branches import Branch, at_rest, bare, event_between, stands, without_idle
from asympk.symbolic.forces import moving_as
from asympk.symbolic.guards import NEVER_IDLE
from asympk.symbolic.sides import Sides, inside, phase_of
from asympk.symbolic.system import System

WATCHED = 12  # intervals between events that must shrink in a geometric sequence before they count as accumulating
FEW = WATCHED // 3  # guards of which such a number of losses at one time is rounding
CROSSINGS = 10_000  # crossings of edges that are allowed in addition to the allowed number of events
MANY = 100  # crossings by which it is seen how frequent they are: each into a mode new among as many, or all in one
HOPELESS = 1e6  # multiple of their limit that crossings as frequent would reach, beyond which a run ends
EVEN = 1.005  # ratio of the mean interval between ends to that of the first half, beyond which crossings become rarer
TOGETHER = 16  # spacings of doubles between the times of events that count as one
SHORTLY = 64  # multiple of the error of an event beyond which a change is due to a new side, not to this error
RAISED = 1e-6  # part of what a guard falls by in the time so far, by its rate, beyond which it rises in a jump
PARADOX = 2.0**-40  # part of the first motion's stiffness by which that of the second must be negative in a paradox


class Segment(NamedTuple):
    """One stretch of one mode: the time and state at its end, the guard lost there or None, and how it was followed.

    A number ``hit`` beyond those of the guards is that of a law of friction which becomes negative. ``short`` is
    the reason why the segment ends early, or "". ``work`` and ``samples`` belong to the flow that made the segment.
    ``together`` are other guards lost at the same time. ``steps`` are times and states from the start of the
    segment to its end. ``branch`` and ``sides`` are those of the mode. ``within`` may be the state by the time; a
    run does not keep it.
    """

    t: Any
    state: tuple
    hit: int | None
    work: Any = None
    short: str = ""
    samples: tuple = ()
    together: tuple[int, ...] = ()
    steps: tuple = ()
    branch: Branch = ()
    sides: Sides = ()
    within: Callable[[Any], tuple] | None = None


class Run(NamedTuple):
    """A run: its last segment, its events, the names of its modes, and all its segments."""

    last: Segment
    events: tuple[Event, ...]
    modes: tuple[str, ...]
    segments: tuple[Segment, ...]


Advance = Callable[[NumericMode, Any, tuple, list[Segment]], Segment]


def follow(
    automaton: Automaton, first: Branch, start: tuple, until: Any, advance: Advance, events: int,
    digits: int | None = None, slack: Any = ROUNDED,
) -> Run:
    """Follow the automaton from ``start`` in the mode ``first`` to ``until``; ``advance`` follows one mode.

    ``advance(mode, t, state, segments)`` returns the next ``Segment``; ``events`` bounds the number of events. The
    modes are those of doubles, or of mpmath numbers of ``digits`` digits; ``slack`` is the relative error of a state
    at an event. Raises ``NoMotion``, ``TwoMotions``, ``UnboundedReaction``, ``Accumulation`` and ``OutOfRange``.
    """
    segments: list[Segment] = []
    with finite(lambda: segments[-1].t if segments else 0, lambda: without_value_after(automaton, *segments[-1:])):
        t, state, mode = _begun(automaton, first, start, until, digits)
        names, marks, ends = [mode.name], list[Event](), list[Any]()
        while t < until or not segments:
            require_begun(mode, t, state)
            segment = advance(mode, t, state, segments) if t < until else Segment(t, state, None)
            segments.append(segment._replace(branch=mode.branch, sides=mode.mode.sides, within=None))
            _require_lawful(automaton, mode, (t, state), segment, slack)
            if segment.short:
                break
            if segment.hit is None and mode.after_switch(segment.t) >= until:
                segments[-1] = segments[-1]._replace(t=until)
                break
            t, state, hits, since = _left_at(mode, segment, until, slack)
            if segment.hit is not None and (not ends or segment.t > ends[-1]):
                ends.append(segment.t)
                _require_apart(ends, state, automaton.system)
            ended = mode
            mode, state, event = mode_after(automaton, mode, t, state, hits, digits, slack, since)
            _require_progress(segments, ended, ends)
            if event is not None:
                marks.append(event)
                names.append(mode.name)
            if short := _beyond_limits(len(marks), ends, segments, until, events):
                segments[-1] = segments[-1]._replace(short=short, state=state)
                break
        return Run(segments[-1], tuple(marks), tuple(names), tuple(segments))


def _require_lawful(
    automaton: Automaton, mode: NumericMode, begun: tuple[Any, tuple], segment: Segment, slack: Any
) -> None:
    """Raise an error where, in a segment, friction turned negative, another motion came up, or a pole was passed."""
    mode.require_opposing(begun, (*segment.steps, (segment.t, segment.state)), segment.t, segment.hit)
    require_alone(automaton, mode, begun[0], segment, slack)
    if not mode.ends_at(segment.hit):
        mode.require_one_side(mode.pole_values(*begun), segment.t, segment.state)


def _begun(
    automaton: Automaton, first: Branch, start: tuple, until: Any, digits: int | None
) -> tuple[Any, tuple, NumericMode]:
    """Return the time, just after a switch at the start if there is one, the state there, and the mode on its sides."""
    still = automaton.mode(first, digits)
    t, state = still.after_start(until), start
    edges = automaton.edges_at(t, state, still.beside)
    mode = mode_on_sides(automaton, first, digits, t, state, edges)
    if mode.jumped(0 * t, state):
        raise no_side_entered(edges, t)
    if t:
        mode.rhs(0 * t, state)  # infinite rates would move the state by more than the rounding until then
    return t, state, mode


def _beyond_limits(count: int, ends: list, segments: list[Segment], until: Any, events: int) -> str:
    """Return the reason why a run ends that has more events or crossings of edges than are allowed, or ""."""
    crossings, limit, half = len(ends) - count, CROSSINGS + events, len(ends) // 2
    if count > events:
        return f"limit of {events} events reached"
    frequent = crossings >= MANY and until * crossings > HOPELESS * limit * ends[-1]
    even = frequent and half * ends[-1] < EVEN * len(ends) * ends[half - 1]
    if even and len({(segment.branch, segment.sides) for segment in segments[-MANY:]}) in (1, MANY):
        return f"limit of {limit} crossings comes long before until, {crossings} reached"
    return f"limit of {limit} crossings reached" if crossings > limit else ""


def _left_at(mode: NumericMode, segment: Segment, until: Any, slack: Any) -> tuple[Any, tuple, tuple[int, ...], Any]:
    """Return the time and state at which a mode is left, its lost guards, and the time before a switch there or None.

    The state is on the zeros of these guards. What follows an event at a switch is decided just after the switch, where
    the edges of the time that the mode has lost are those of no motion.
    """
    hits = _lost_at_switch(mode, segment, slack) if segment.hit is None else (segment.hit, *segment.together)
    state = on_zeros(mode, hits, segment.t, segment.state)
    t = mode.past_switch(segment.t, slack) if hits else mode.after_switch(segment.t)
    if hits and (t is None or t >= until):
        return segment.t, state, hits, None
    if hits and (fallen := _not_raised(mode, hits, (segment.t, state), (t, state))):
        return t, state, tuple(hit for hit in fallen if mode.kinds[hit][0] != SWITCH) or fallen, segment.t
    lost = tuple(k for k, value in enumerate(mode.guard_values(t, state)) if value < 0)
    return t, state, lost, segment.t


def _lost_at_switch(mode: NumericMode, segment: Segment, slack: Any) -> tuple[int, ...]:
    """Return the guards that fall through zero at a switch, within rounding, if one of these is of a contact."""
    t, state, after = segment.t, segment.state, mode.after_switch(segment.t)
    hits = lost_with(mode, NO_FRICTION, t, state, max(slack * t, after - t))
    hits = _not_raised(mode, hits, (t, state), (after, state)) if hits else ()
    return hits if any(mode.kinds[hit][0] not in (*NEVER_IDLE, SWITCH) for hit in hits) else ()


def _not_raised(mode: NumericMode, hits: tuple[int, ...], before: tuple, after: tuple) -> tuple[int, ...]:
    """Return the guards that a switch does not raise clear of zero, as it does the slip on a belt that jumps back.

    Such a guard does not fall through zero, though it would have without the switch.
    """
    rates = mode.guard_rates(*before)
    values = zip(mode.guard_values(*before), mode.guard_values(*after), strict=True)
    rises = [then - now for now, then in values]
    return tuple(hit for hit in hits if rises[hit] <= RAISED * abs(rates[hit]) * before[0])


def lost_with(mode: NumericMode, hit: int | None, t: Any, state: tuple, near: Any = None) -> tuple[int, ...]:
    """Return the other guards that fall through zero within the time ``near`` of the event at which ``hit`` is lost.

    By default ``near`` is ``TOGETHER`` spacings of doubles.
    """
    if hit is None:
        return ()
    near, rates = TOGETHER * ulp(t) if near is None else near, mode.guard_rates(t, state)
    return tuple(k for k, value in enumerate(mode.guard_values(t, state)) if k != hit and abs(value) < -near * rates[k])


def mode_after(
    automaton: Automaton, mode: NumericMode, t: Any, state: tuple, hits: tuple[int, ...], digits: int | None = None,
    slack: Any = ROUNDED, since: Any = None, fixed: bool = False,
) -> tuple[NumericMode, tuple, Event | None]:
    """Return the mode that follows the loss of the guards ``hits``, the state at its start, and the event or None.

    In this state velocities at rest and gaps of closed rigid contacts vanish. The event is None if the motion of no
    contact changes. ``since`` is None, or the time at which ``mode`` ended just before a switch by the time, with ``t``
    just after this switch. ``fixed`` and the errors are those of ``mode_on_sides``; ``Automaton.next`` raises, too.
    """
    before, leaping, halted, (crossed, lost) = mode, set[tuple](), list[tuple](), _crossed(mode, hits)
    switches, doubt, start = bool(crossed), slack, t if since is None else since
    if since is not None:  # the guards of a side that has ended are those of no motion
        crossed, lost, doubt = [*automaton.edges_at(t, state, mode.beside)], [] if switches else lost, mode.beside
    later, entered, stops = (t, state), tuple[Any, ...](), _stops(lost)
    if switches and (mode.mode.jumping or not stops):
        mode = mode_on_sides(automaton, without_idle(mode.branch), digits, t, state, crossed, fixed)
        leaping = {("velocity_zero", k) for k in mode.mode.jumping if _leaps(k, ((before, start), (mode, t)), state)}
        lost, stops = [key for key in lost if key[:2] not in leaping], stops and _may_rest(mode, lost, leaping, crossed)
    if switches and stops:  # what stops or lands on an edge may rest there
        mode, hits = before, tuple(hit for hit in hits if before.kinds[hit][0] != SWITCH)
    elif switches:
        later = mode.moved_on(t, state, SHORTLY * doubt * t)
        entered = tuple(side for side in mode.mode.sides if {phase_of(edge)[0] for edge in inside(*side)} & {*crossed})
        halted = _halted(mode, leaping, t, state, doubt)
        hits = _lost_beyond(mode, [*lost, *halted], (t, state), later)
    event = _left_by_ground(before, start, mode, t, state) or _velocity_jump(((before, start), (mode, t)), state)
    if event is None and (switches or not hits):  # a velocity at rest whose slope jumps is 0 on the new side, too
        state = mode.settled(t, state)
    if event is not None:
        branch = automaton.next(None, (), t, state, doubt, entered)
    elif hits or (stands(mode.branch) and (switches or since is not None)):  # what stood may move on the new side
        branch, event = _passed(automaton, mode, hits, *((t, state) if halted else later), doubt, entered, bool(halted))
    else:
        return mode, state, None
    after = _following(automaton, mode, branch, digits, t, state, [*crossed, *automaton.edges_at(*later, doubt)], fixed)
    if leaping and stops:
        event = _velocity_jump(((before, start), (_beyond(automaton, before, after, digits), t)), state) or event
    state = after.settled(t, state)
    return after, state, None if _move_alike(before, after) else event._replace(t=t, state=state)


def _move_alike(before: NumericMode, after: NumericMode) -> bool:
    """Tell whether the motion of no contact changes, by the belts on the sides of each mode."""
    ways = [moving_as(mode.mode.sided, mode.branch) for mode in (before, after)]
    return ways[0] == ways[1]


def _beyond(automaton: Automaton, before: NumericMode, after: NumericMode, digits: int | None) -> NumericMode:
    return automaton.mode(before.branch, digits, before.mode.sides_beyond(after.mode))


def _stops(lost: Iterable[tuple]) -> bool:
    return any(kind in ("velocity_zero", "touch_down") for kind, *_ in lost)


def _may_rest(mode: NumericMode, lost: list[tuple], leaping: set[tuple], crossed: list[sp.Expr]) -> bool:
    """Tell whether what stops or lands may rest on an edge, also where sliding velocities would leap beyond it.

    An edge of the time alone is crossed whatever stops.
    """
    stops = _stops(key for key in lost if key[:2] not in leaping)
    return not leaping or (stops and any(phase.free_symbols & {*mode.mode.system.states} for phase in crossed))


def _following(
    automaton: Automaton, mode: NumericMode, branch: Branch, digits: int | None, t: Any, state: tuple,
    crossed: list[sp.Expr], fixed: bool,
) -> NumericMode:
    """Return the mode of the branch that follows; raises ``NotDerivable`` where a sliding velocity jumps back there."""
    after = mode_on_sides(automaton, branch, digits, t, state, crossed, fixed)
    if _velocity_jump(((mode, t), (after, t)), state):
        raise no_side_entered(crossed, t)
    return after


def _left_by_ground(before: NumericMode, t0: Any, mode: NumericMode, t: Any, state: tuple) -> Event | None:
    """Return the event of a rigid contact that opens because its gap or gap rate jumps (a step or kink of the ground).

    ``before`` is the mode until the time ``t0``. Raises ``NoMotion`` where the jump closes the gap.
    """
    for k, parts in mode.mode.grounds.items():
        now, then = mode.values(parts, t, state), before.values(before.mode.grounds[k], t0, state)
        least = BY_HAND * max(1, *map(abs, state))
        leap = next((new - old for new, old in zip(now, then, strict=True) if abs(new - old) > least), 0)
        if leap < 0:
            raise NoMotion(f"{which_contact(mode.mode.system, k)} is hit at t = {float(t):.6g} by a step or a kink of "
                           "its ground: the rigid model has no law of impact, the model needs compliance there", t,
                           state)
        if leap > 0:
            return Event("lift_off", t, state, k)
    return None


def _halted(mode: NumericMode, leaping: set[tuple], t: Any, state: tuple, slack: Any) -> list[tuple]:
    """Return the keys of the guards of sliding velocities that have jumped to 0, among the ``leaping`` ones."""
    signs = mode.signs(tuple(mode.mode.jumping[k] for _, k in leaping), t, state, slack) if leaping else ()
    return [(*key, False) for key, sign in zip(leaping, signs, strict=True) if not sign]


def _velocity_jump(places: tuple[tuple[NumericMode, Any], ...], state: tuple) -> Event | None:
    """Return the event of a sliding velocity that has jumped away from 0 or to the other sign, or None.

    The velocity of a belt may jump so; a kink changes it by no more than its slopes allow and is no event. ``places``
    are the modes and times before and after.
    """
    _, (mode, t) = places
    for k in mode.jumped(t, state):
        if _leaps(k, places, state):
            return Event("velocity_zero" if mode.branch[k].velocity else "slip_onset", t, state, k)
    return None


def _leaps(k: int, places: tuple[tuple[NumericMode, Any], ...], state: tuple) -> bool:
    """Tell whether a sliding velocity jumps, by more than its slopes allow, between two modes and times."""
    (old, changes), (new, others) = (_with_change(own, own.mode.jumping[k], at, state) for own, at in places)
    return bool(abs(new - old) > SHORTLY * (changes + others))


def _with_change(mode: NumericMode, expr: sp.Expr, t: Any, state: tuple) -> tuple[Any, Any]:
    """Return an expression's value, and its change by half the distance that smooth stretches keep from a switch."""
    value, *others = (mode.values((expr,), *at)[0] for at in ((t, state), *nudges(t, state, mode.beside / 2)))
    return value, max(abs(other - value) for other in others)


def _crossed(mode: NumericMode, hits: tuple[int, ...]) -> tuple[list[sp.Expr], list[tuple]]:
    """Return the phases of the edges among the lost guards ``hits``, and the keys of the other lost guards."""
    switched = [k for k in hits if mode.kinds[k][0] == SWITCH]
    phases = [phase_of(mode.mode.edges[k - len(mode.kinds)])[0] for k in switched]
    return phases, [guard.key for k, guard in enumerate(mode.mode.guards) if k in hits and k not in switched]


def _lost_beyond(mode: NumericMode, keys: list[tuple], place: tuple, later: tuple) -> tuple[int, ...]:
    """Return the lost guards of ``mode`` on its new side: those of ``keys``, from the old one, and those that fall."""
    values = zip(mode.guard_values(*place), mode.guard_values(*later), mode.mode.guards, strict=True)
    lost = (guard.key in keys or ((value or after) < 0 and guard.kind != SWITCH) for value, after, guard in values)
    return tuple(k for k, falls in enumerate(lost) if falls)


def on_zeros(mode: NumericMode, hits: tuple[int, ...], t: Any, state: tuple) -> tuple:
    """Return ``state`` moved onto the zeros of guards that fall; raises where the motion of a rigid contact ends."""
    for hit in hits:
        if mode.ends_at(hit):
            raise _ended(mode, mode.kinds[hit][0], t, state)
        state = mode.snapped(hit, t, state)
    return state


def _passed(
    automaton: Automaton, mode: NumericMode, hits: tuple[int, ...], t: Any, state: tuple, slack: Any, sides: Sides,
    anew: bool,
) -> tuple[Branch, Event]:
    """Return the branch that follows the loss of the guards ``hits``, ``anew`` as at a start, and the event."""
    after = automaton.next(None if anew else mode.branch, () if anew else hits, t, state, slack, sides)
    kind, friction = _kind(mode, hits, after)
    return after, Event(kind, t, state, friction)


_ENDS: dict[str, tuple[type[UnboundedReaction] | type[TwoMotions], str]] = {
    "unbounded": (UnboundedReaction, "the reaction of a contact grows beyond all bounds, or is not determined,"),
    "several": (TwoMotions, "a second motion of the contact comes up"),
}


def without_value_after(automaton: Automaton, last: Segment | None = None) -> str:
    """Return what has no finite real value at the end of the last segment, or shortly after, or ""."""
    if last is None or not last.branch:
        return ""
    mode = automaton.mode(last.branch, sides=last.sides)
    return without_value_soon(mode, float(last.t), tuple(map(float, last.state)))


def require_begun(mode: NumericMode, t: Any, state: tuple) -> None:
    """Raise ``TwoMotions`` where a bilateral rigid contact begins to slide within the paradox.

    At rest such a contact has one motion; as soon as it slides, it has two. Neither states nor time need move what
    tells this. Raises ``NegativeFriction`` where kinetic friction is negative from the start of the mode on, as it may
    be on one side of a switch.
    """
    mode.require_opposing((t, state), [(t, state)], t, None)
    fixed = tuple(guard.value for guard in mode.mode.fixed_guards if guard.kind in NEVER_IDLE)
    moving = [k for k in range(len(mode.kinds)) if mode.ends_at(k)]
    if len(fixed) + len(moving) == len(NEVER_IDLE):
        values = mode.guard_values(t, state) if moving else ()
        least, largest = sorted([*mode.values(fixed, t, state), *(values[k] for k in moving)])
        if least < -PARADOX * largest:
            raise _ended(mode, "several", t, state)


def _ended(mode: NumericMode, kind: str, t: Any, state: tuple) -> UnboundedReaction | TwoMotions:
    """Return the error for a rigid contact whose motion ceases to be determined."""
    error, words = _ENDS[kind]
    at = f"at t = {float(t):.10g}, {listed(mode.mode.system.states, state, 8)}, in mode {mode.name}"
    return error(f"{words} {at}; the model needs compliance there", t, state)


def _kind(mode: NumericMode, hits: tuple[int, ...], after: Branch) -> tuple[str, int]:
    """Return ``event_between`` for, of guards lost together, the first whose contact changes its phase."""
    changed = [old != new for old, new in zip(bare(mode.branch), bare(after), strict=True)]
    freed = at_rest(mode.branch) - at_rest(after)
    lost = [mode.kinds[hit] for hit in sorted(hits)] or [("slip_onset", min(freed, default=0))]
    kind, friction = next((own for own in lost if changed[own[1]]), lost[0])
    still = {k for k, phase in enumerate(mode.branch) if kind in phase.idle}
    return event_between(mode.branch, after, kind, friction, still)


def _require_progress(segments: list[Segment], mode: NumericMode, ends: list) -> None:
    """Raise ``Undecided``, or ``Accumulation``, where few guards are lost again and again at the same time.

    Events accumulate there if the intervals before shrank by half or more from one to the next.
    """
    last = segments[-WATCHED:]
    hit = last[-1].hit
    at_once = len(last) == WATCHED and last[0].t == last[-1].t
    if at_once and hit is not None and len({(s.branch, s.hit) for s in last}) <= FEW:
        gaps = [b - a for a, b in pairwise(ends[-FEW:])]
        if len(gaps) == FEW - 1 and all(2 * later <= before for before, later in pairwise(gaps)):
            raise _accumulation(ends[-1], ends, last[-1].state, mode.mode.system)
        kind = mode.kinds[hit][0]
        at = listed(mode.mode.system.states, last[-1].state, 8)
        raise Undecided(f"rounding hides whether there is a {kind} at t = {float(last[-1].t):.12g}, {at}, in mode "
                        f"{mode.name}; ask for more digits, or move the start")


def _require_apart(ends: list, state: tuple, system: System) -> None:
    """Raise ``Accumulation`` where intervals between ``ends`` of modes shrink geometrically to rounding of the time.

    A mode may have ended by an event or by crossing an edge; both count alike.
    """
    if len(ends) <= WATCHED:
        return
    gaps = [b - a for a, b in pairwise(ends[-WATCHED - 1 :])]
    tiny = gaps[-1] <= abs(ends[-1]) * 2.0**-40
    if tiny and all(later <= before for before, later in zip(gaps, gaps[2:], strict=False)):
        ratio = gaps[-1] / gaps[-3] if gaps[-3] > gaps[-1] else 0
        limit = ends[-1] + (gaps[-1] + gaps[-2]) * ratio / (1 - ratio)
        raise _accumulation(limit, ends, state, system)


def _accumulation(limit: Any, ends: list, state: tuple, system: System) -> Accumulation:
    at, gap = listed(system.states, state, 8), ends[-1] - ends[-2]
    return Accumulation(f"events accumulate at t = {float(limit):.12g}, {at}: {len(ends)} so far, the last "
                        f"{float(gap):.1g} apart; no run passes infinitely many, end it before", ends[-1], state)
