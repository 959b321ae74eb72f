"""The loop over segments: one mode after the other, each followed to the guard that ends it, whatever follows it."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import sympy as sp

from asympk.automaton.automaton import ROUNDED, Automaton, mode_on_sides
from asympk.automaton.contacts import nudges
from asympk.automaton.decide import finite
from asympk.automaton.junction import BY_HAND
from asympk.automaton.modes import SWITCH
from asympk.automaton.numericmode import NumericMode
from asympk.errors import Accumulation, NoMotion, TwoMotions, UnboundedReaction, Undecided
from asympk.path import Event
from asympk.symbolic.branches import OPEN, Branch, at_rest, awake, moves_alike
from asympk.symbolic.sides import Sides, inside

WATCHED = 12  # intervals between events that must shrink in a geometric sequence before they count as accumulating
CROSSINGS = 10_000  # of edges, that are allowed beside as many as events are
SHORTLY = 64  # errors of an event, after which what a side has changed is told from what was before
PARADOX = 2.0**-40  # by which a stiffness to the second motion is below zero, as a part of that to the first


class Segment(NamedTuple):
    """One stretch of one mode: the time and state at its end, the guard lost there or None, and how it was followed.

    ``short`` says why the segment ends early, "" where it does not; ``work`` and ``samples`` are the flow's own.
    ``together`` are other guards lost at the same time. ``steps`` are times and states from its start to its end,
    ``branch`` is what each friction does in its mode, which is on the ``sides`` of what switches by the state.
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


class Run(NamedTuple):
    """A run: its last segment, its events, the names of its modes, and all its segments."""

    last: Segment
    events: tuple[Event, ...]
    modes: tuple[str, ...]
    segments: tuple[Segment, ...]


Advance = Callable[[NumericMode, Any, tuple, list[Segment]], Segment]


def follow(
    automaton: Automaton,
    first: Branch,
    start: tuple,
    until: Any,
    advance: Advance,
    events: int,
    digits: int | None = None,
    slack: Any = ROUNDED,
) -> Run:
    """Follow the automaton from ``start`` in the mode ``first`` to ``until``; ``advance`` follows one mode.

    ``advance(mode, t, state, segments)`` returns the next ``Segment``; ``events`` bounds the number of events. The
    modes are those of doubles, or of mpmath numbers of ``digits`` digits; ``slack`` is the relative error of a state
    at an event. Raises ``NoMotion``, ``TwoMotions``, ``UnboundedReaction``, ``Accumulation`` and ``OutOfRange``.
    """
    segments: list[Segment] = []
    with finite(lambda: segments[-1].t if segments else 0):
        return _follow(automaton, first, start, until, advance, events, digits, slack, segments)


def _follow(
    automaton: Automaton, first: Branch, start: tuple, until: Any, advance: Advance, events: int, digits: int | None,
    slack: Any, segments: list[Segment],
) -> Run:  # fmt: skip
    t, state, mode = _begun(automaton, first, start, until, digits)
    names, marks, ends = [mode.name], list[Event](), list[Any]()
    while t < until or not segments:
        _require_one_motion(mode, t, state)
        segment = advance(mode, t, state, segments) if t < until else Segment(t, state, None)
        segments.append(segment._replace(branch=mode.branch, sides=mode.mode.sides))
        if segment.hit is None or mode.kinds[segment.hit][0] not in _ENDS:
            mode.require_one_side(mode.pole_values(t, state), segment.t, segment.state)
        if segment.short:
            break
        if segment.hit is None and mode.after_switch(segment.t) >= until:
            segments[-1] = segments[-1]._replace(t=until)
            break
        t, state, hits = _left_at(mode, segment)
        if segment.hit is not None and (not ends or t > ends[-1]):
            ends.append(t)
            _require_apart(ends, state, automaton)
        ended, since = mode, segment.t if segment.hit is None else None
        mode, state, event = mode_after(automaton, mode, t, state, hits, digits, slack, since)
        if event is None or _switches(ended, hits):
            _require_progress(segments, ended)
        if event is not None:
            marks.append(event)
            names.append(mode.name)
        if short := _beyond_limits(len(marks), len(ends) - len(marks), events):
            segments[-1] = segments[-1]._replace(short=short, state=state)
            break
    return Run(segments[-1], tuple(marks), tuple(names), tuple(segments))


def _begun(
    automaton: Automaton, first: Branch, start: tuple, until: Any, digits: int | None
) -> tuple[Any, tuple, NumericMode]:
    """Return the time, just after what is singular at the start, the state there, and the mode on its sides."""
    still = automaton.mode(first, digits)
    t, state = still.after_start(until), start
    mode = mode_on_sides(automaton, first, digits, t, state, automaton.edges_at(t, state, still.beside))
    if t:
        mode.rhs(0 * t, state)  # infinite rates would move the state by more than the rounding until then
    return t, state, mode


def _beyond_limits(count: int, crossings: int, events: int) -> str:
    """Return why a run ends, that of more events or crossings of edges than are allowed, or ""."""
    if count > events:
        return f"limit of {events} events reached"
    return f"limit of {CROSSINGS + events} crossings reached" if crossings > CROSSINGS + events else ""


def _left_at(mode: NumericMode, segment: Segment) -> tuple[Any, tuple, tuple[int, ...]]:
    """Return the time and the state at which a mode is left, on the zeros of its guards that are lost, and these."""
    if segment.hit is not None:
        hits = (segment.hit, *segment.together)
        return segment.t, _on_zeros(mode, hits, segment.t, segment.state), hits
    t, state = mode.after_switch(segment.t), segment.state
    return t, state, tuple(k for k, value in enumerate(mode.guard_values(t, state)) if value < 0)


def mode_after(
    automaton: Automaton, mode: NumericMode, t: Any, state: tuple, hits: tuple[int, ...], digits: int | None = None,
    slack: Any = ROUNDED, since: Any = None, fixed: bool = False,
) -> tuple[NumericMode, tuple, Event | None]:  # fmt: skip
    """Return the mode that follows where the guards ``hits`` are lost, the state at rest there, and the event or None.

    What the mode holds vanishes in the state: velocities that rest, gaps that are closed.
    ``since`` is the time at which a mode ended that the time alone has switched by ``t``; ``fixed`` is that of
    ``mode_on_sides``, which raises what this does, as does ``Automaton.next``.
    """
    before, (crossed, left) = mode, _crossed(mode, hits)
    switches, doubt = _switches(mode, hits), slack
    if since is not None:  # the guards of a side that has ended are those of no motion
        crossed, left, doubt = [], left * (not switches), mode.beside
    later, entered = (t, state), tuple[Any, ...]()
    if switches and any(kind == "velocity_zero" for kind, *_ in left):  # what stops on an edge may rest there
        hits = tuple(hit for hit in hits if mode.kinds[hit][0] != SWITCH)
    elif switches:
        mode = mode_on_sides(automaton, awake(mode.branch), digits, t, state, crossed, fixed)
        later = mode.moved_on(t, state, SHORTLY * doubt * t)
        entered = tuple(side for side in mode.mode.sides if {*inside(*side)} & {*crossed})
        hits = _lost_beyond(mode, left, (t, state), later)
    places = (before, t if since is None else since), (mode, t)
    event = _left_by_ground(*places[0], mode, t, state) or _torn(places, state)
    if event is not None:
        branch = automaton.next(None, (), *later, doubt, entered)
    elif hits:
        branch, event = _passed(automaton, mode, hits, *later, doubt, entered)
    else:
        return mode, mode.settled(t, state), None
    crossed = [*crossed, *automaton.edges_at(*later, doubt)]
    after = mode_on_sides(automaton, branch, digits, t, state, crossed, fixed)
    state, alike = after.settled(t, state), moves_alike(automaton.system, branch, mode.branch)
    return after, state, None if alike else event._replace(t=t, state=state)


def _left_by_ground(before: NumericMode, t0: Any, mode: NumericMode, t: Any, state: tuple) -> Event | None:
    """Return the event of a rigid contact whose gap or gap rate has jumped, as where the ground has a step or a kink.

    ``before`` is the mode until the time ``t0``. Raises ``NoMotion`` where the ground meets the contact.
    """
    for k, parts in mode.mode.grounds.items():
        now, then = mode.values(parts, t, state), before.values(before.mode.grounds[k], t0, state)
        least = BY_HAND * max(1, *map(abs, state))
        leap = next((new - old for new, old in zip(now, then, strict=True) if abs(new - old) > least), 0)
        if leap < 0:
            raise NoMotion(f"the contact is hit at t = {float(t):.6g} by a step or a kink of its ground: the rigid "
                           "model has no law of impact, the model needs compliance there", t, state)  # fmt: skip
        if leap > 0:
            return Event("lift_off", t, state, k)
    return None


def _torn(places: tuple[tuple[NumericMode, Any], ...], state: tuple) -> Event | None:
    """Return the event of a sliding velocity that has jumped away from 0, or to its other sign, as a belt may.

    ``places`` are the modes and times before and after. What has a kink differs there by no more than its slopes make.
    """
    _, (mode, t) = places
    for k, velocity in mode.mode.jumping.items():
        sign = mode.signs((velocity,), t, state)[0]
        if sign and sign != mode.branch[k].velocity:
            (old, changes), (new, others) = (_with_change(own, own.mode.jumping[k], at, state) for own, at in places)
            if abs(new - old) > SHORTLY * (changes + others):
                return Event("velocity_zero" if mode.branch[k].velocity else "slip_onset", t, state, k)
    return None


def _with_change(mode: NumericMode, expr: sp.Expr, t: Any, state: tuple) -> tuple[Any, Any]:
    """Return the value of an expression, and its change by half of what smooth stretches keep from a switch."""
    value, *others = (mode.values((expr,), *at)[0] for at in ((t, state), *nudges(t, state, mode.beside / 2)))
    return value, max(abs(other - value) for other in others)


def _switches(mode: NumericMode, hits: tuple[int, ...]) -> bool:
    """Tell whether the state switches a mode where the guards ``hits`` are lost."""
    return any(mode.kinds[hit][0] == SWITCH for hit in hits)


def _crossed(mode: NumericMode, hits: tuple[int, ...]) -> tuple[list[sp.Expr], list[tuple]]:
    """Return the phases, of either sign, at which a mode ends that switches by the state, and its other guards lost."""
    switched = [k for k in hits if mode.kinds[k][0] == SWITCH]
    phases = [sign * mode.mode.edges[k - len(mode.kinds)] for k in switched for sign in (1, -1)]
    return phases, [key for k, key in enumerate(_keys(mode)) if k in hits and k not in switched]


def _keys(mode: NumericMode) -> list[tuple]:
    """Return what tells the guards of a mode, also from those of the mode on another side or with fewer idle ones."""
    return [(*own, own == before) for before, own in pairwise(((), *mode.kinds))]


def _lost_beyond(mode: NumericMode, left: list[tuple], place: tuple, later: tuple) -> tuple[int, ...]:
    """Return the guards ``left`` that are lost with a side, and those that are on that of ``mode``, or fall from 0."""
    values = zip(mode.guard_values(*place), mode.guard_values(*later), _keys(mode), strict=True)
    lost = (key in left or ((value or after) < 0 and key[0] != SWITCH) for value, after, key in values)
    return tuple(k for k, falls in enumerate(lost) if falls)


def _on_zeros(mode: NumericMode, hits: tuple[int, ...], t: Any, state: tuple) -> tuple:
    """Return ``state`` moved onto the zeros of guards that fall; raises where the motion of a rigid contact ends."""
    for hit in hits:
        if mode.kinds[hit][0] in _ENDS:
            raise _ended(mode, hit, t, state)
        state = mode.snapped(hit, t, state)
    return state


def _passed(
    automaton: Automaton, mode: NumericMode, hits: tuple[int, ...], t: Any, state: tuple, slack: Any, sides: Sides
) -> tuple[Branch, Event]:
    """Return what follows guards that are lost, and the event."""
    after = automaton.next(mode.branch, hits, t, state, slack, sides)
    kind, friction = _kind(mode, hits, after)
    return after, Event(kind, t, state, friction)


_ENDS: dict[str, tuple[type[UnboundedReaction] | type[TwoMotions], str]] = {
    "unbounded": (UnboundedReaction, "the reaction of a rigid contact grows beyond all bounds, or is not determined,"),
    "several": (TwoMotions, "a second motion of the rigid contact comes up"),
}


def _require_one_motion(mode: NumericMode, t: Any, state: tuple) -> None:
    """Raise ``TwoMotions`` where a rigid contact that holds both ways begins to slide within the paradox.

    At rest that is one motion, as soon as it slides there are two.
    """
    ends = {kind: k for k, (kind, _) in enumerate(mode.kinds) if kind in _ENDS}
    if "several" in ends:
        values = mode.guard_values(t, state)
        least, largest = sorted(values[k] for k in ends.values())
        if least < -PARADOX * largest:
            raise _ended(mode, ends["several"], t, state)


def _ended(mode: NumericMode, hit: int, t: Any, state: tuple) -> UnboundedReaction | TwoMotions:
    """Return the error for a rigid contact whose motion ceases to be determined."""
    error, words = _ENDS[mode.kinds[hit][0]]
    at = f"at t = {float(t):.10g}, {_state_in_words(mode.mode.system, state)}, in mode {mode.name}"
    return error(f"{words} {at}; the model needs compliance there", t, state)


def _state_in_words(system: Any, state: tuple) -> str:
    return ", ".join(f"{s} = {float(w):.8g}" for s, w in zip(system.states, state, strict=True))


def _kind(mode: NumericMode, hits: tuple[int, ...], after: Branch) -> tuple[str, int]:
    """Return the kind and the friction of an event: of guards lost together the first whose contact changes its phase.

    Of velocities that vanish together it is the least, whichever of them the rounding lets vanish first. A contact
    sticks on at the edge of its cone where the load vanishes at its tip, or where another begins to slip at the same
    time, whose event it is.
    """
    phases = [*zip(awake(mode.branch), awake(after), strict=True)]
    lost = [mode.kinds[hit] for hit in sorted(hits)]
    kind, friction = next((own for own in lost if len({*phases[own[1]]}) > 1), lost[0])
    if kind == "velocity_zero":
        moving = {k for k, phase in enumerate(mode.branch) if phase.velocity and kind not in phase.idle}
        stopped = {k for k in moving if OPEN not in phases[k] and phases[k][0].velocity != phases[k][1].velocity}
        return kind, min(stopped, default=friction)
    if kind != "slip_onset" or after[friction].mode != "stick":
        return kind, friction
    freed = at_rest(mode.branch) - at_rest(after)
    return ("slip_onset", min(freed)) if freed else ("force_zero", friction)


def _require_progress(segments: list[Segment], mode: NumericMode) -> None:
    """Raise ``Undecided`` where the same mode goes on again and again without getting anywhere."""
    last = segments[-WATCHED:]
    hit = last[-1].hit
    if len(last) == WATCHED and hit is not None and all(s.t == last[-1].t and s.hit == hit for s in last):
        kind = mode.kinds[hit][0]
        at = _state_in_words(mode.mode.system, last[-1].state)
        raise Undecided(f"{kind} or not at t = {float(last[-1].t):.12g}, {at}, in mode {mode.name}: rounding hides it; "
                        "ask for digits=, or move the start")  # fmt: skip


def _require_apart(ends: list, state: tuple, automaton: Automaton) -> None:
    """Raise ``Accumulation`` where intervals between ``ends`` of modes shrink geometrically to nothing beside the time.

    The modes of either side of what switches count as much as those that events begin.
    """
    if len(ends) <= WATCHED:
        return
    gaps = [b - a for a, b in pairwise(ends[-WATCHED - 1 :])]
    tiny = gaps[-1] <= abs(ends[-1]) * 2.0**-40
    if tiny and all(later <= before for before, later in zip(gaps, gaps[2:], strict=False)):
        ratio = gaps[-1] / gaps[-3] if gaps[-3] > gaps[-1] else 0
        limit = ends[-1] + (gaps[-1] + gaps[-2]) * ratio / (1 - ratio)
        at = _state_in_words(automaton.system, state)
        raise Accumulation(
            f"events accumulate at t = {float(limit):.12g}, {at}: {len(ends)} so far, the last "
            f"{float(gaps[-1]):.1g} apart; no mode goes on there, end the run before"
        )
