"""A junction: where one mode ends and the next begins, and the phases in which each friction may continue there.

A quantity q counts as vanishing in two cases: an event is its zero, or the rounding of the state could have changed its
sign, |q| <= 4 max |q(displaced) - q|. One whose zero is the event is set to 0 and never tested again. ``junction_at``
makes the ``Junction``.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

from asympk.automaton import contacts
from asympk.automaton.contacts import ContactNumbers, ContactPoint, Numbers, Place, Signs, Solved, solved_forces
from asympk.automaton.modes import mode_of
from asympk.errors import InputError, NoMotion, UnboundedReaction
from asympk.numbers import listed, short
from asympk.symbolic import branches, sides
from asympk.symbolic.branches import OPEN, Branch, Phase
from asympk.symbolic.system import System

if TYPE_CHECKING:
    from asympk.automaton.automaton import Automaton

ROUNDING = 2.0**-46  # relative error that a start computed in doubles may have
BY_HAND = 2.0**-20  # relative error, about 1e-6, of a start on a contact that was written by hand with six digits
OF_ZERO = 2.0**-52  # part of the largest state that a computed zero of a start, as sin(pi), may be


@dataclass(frozen=True)
class Junction:
    """Where one mode ends and another is to follow, or where a run begins.

    ``lost`` are the guards that the mode ``before`` lost, by kind and friction. The first of the ``places`` is the
    state itself, the others are displaced by its rounding error; ``points`` are the contacts there, with the ``signs``
    of sliding velocities that vanish. ``touching`` are the rigid contacts that stay closed or may open, and whether
    their reaction has just vanished. ``slack`` is the relative error of the state.
    """

    system: System
    before: Branch | None
    lost: set[tuple[str, int]]
    places: tuple[Place, ...]
    points: list[ContactPoint]
    signs: Signs
    touching: dict[int, bool]
    slack: Any

    @cached_property
    def places_of_rest(self) -> tuple[Place, ...]:
        """The places at which rest is decided: also such in which one state moves by the rounding of the largest.

        A velocity that a rigid contact keeps at 0 is 0 to rounding alone if neither its gap nor its rate is known.
        """
        known = all(f.unilateral or f.gap_rate is not None for f in self.system.frictions if f.rigid)
        return self.places if known else self.at.with_nudged(self.slack, self.slack)

    @property
    def at(self) -> Place:
        """The place of the state itself."""
        return self.places[0]

    @cached_property
    def numbers(self) -> Numbers:
        """The numbers on which all signs at this junction are decided."""
        return self.at.numbers

    @cached_property
    def phases(self) -> list[list[Phase]]:
        """The phases in which each friction may continue, friction by friction."""
        return [_phases(self, k) for k in range(len(self.system.frictions))]

    @cached_property
    def resting(self) -> set[int]:
        """The frictions that might rest: their velocities vanish."""
        return {k for k, choice in enumerate(self.phases) if any(phase.mode == "stick" for phase in choice)}

    @cached_property
    def _known(self) -> dict[tuple, Solved | None]:
        return {}

    def points_in(self, branch: Branch) -> list[ContactPoint]:
        """Return the contacts at all places; sliding velocities that vanish have their signs in a branch."""
        if not self.signs:
            return self.points
        signs = self._signs_in(branch)
        if signs not in self._directed:
            self._directed[signs] = [contacts.contact_point(self.system, place, signs) for place in self.places]
        return self._directed[signs]

    def _signs_in(self, branch: Branch) -> Signs:
        return tuple(s if s is None else phase.velocity for s, phase in zip(self.signs, branch, strict=False))

    def beginning(self, branch: Branch, k: int, point: int) -> tuple[ContactNumbers, ContactNumbers]:
        """Return contact k, at rest in a branch, as where it is about to slip forward and backward."""
        ways = [(*branch[:k], branch[k]._replace(velocity=side), *branch[k + 1 :])
                for side in (1, -1)] if self.signs else [branch, branch]
        forward, backward = (self.points_in(way)[point].contacts[k] for way in ways)
        return forward, backward

    def jumped(self, branch: Branch) -> dict[int, int]:
        """Return the signs of sliding velocities that, in a branch, other contacts have made jump from 0 by turning."""
        turned = self.resting & contacts.turned_by_others(self.system)
        points = self.points_in(branch) if turned else []
        signs = {k: self.numbers.decided_sign([point.contacts[k].velocity for point in points]) for k in turned}
        return {k: sign for k, sign in signs.items() if sign}

    @cached_property
    def _directed(self) -> dict[Signs, list[ContactPoint]]:
        return {self.signs: self.points}

    def solved(self, branch: Branch, group: tuple[int, ...], point: int = 0) -> Solved | None:
        """Return the forces of a group in a branch at one of the ``points``, or None where they are not determined."""
        key = group, tuple(branch[k] for k in group), point
        if key not in self._known:
            self._known[key] = solved_forces(self.system, branch, self.points_in(branch)[point], self.numbers, group)
        return self._known[key]

    def has_jumped(self, k: int) -> bool:
        """Tell whether the reaction of contact k, if it keeps its branch, has clearly jumped away from 0 at an edge.

        The largest state rounds the others: one that vanishes with the reaction is known to no part of itself.
        """
        if not self.before:
            return False
        group = next(group for group in contacts.coupled(self.system) if k in group)
        points = (contacts.contact_point(self.system, place, self._signs_in(self.before))
                  for place in self.at.with_nudged(self.slack, self.slack))
        found = [solved_forces(self.system, self.before, point, self.numbers, group) for point in points]
        normal = self.system.frictions[k].normal
        return all(found) and contacts.clear_sign([own.forces[normal] for own in found if own]) != 0

    def is_determined(self, branch: Branch) -> bool:
        """Tell whether the equations of a branch determine its forces."""
        return all(self.solved(branch, group) is not None for group in contacts.coupled(self.system))

    def forces(self, branch: Branch) -> dict[Any, Any]:
        """Return all forces of a branch whose equations determine them."""
        found = [own.forces for group in contacts.coupled(self.system) if (own := self.solved(branch, group))]
        return {force: sum(own[force] for own in found) for force in found[0]}

    @property
    def in_words(self) -> str:
        """The time and the state as words for a message."""
        return _place_in_words(self.system, self.at)


def junction_at(
    automaton: "Automaton", before: Branch | None, hits: tuple, t: Any, state: tuple, slack: Any, numbers: Numbers
) -> Junction:
    """Return the ``Junction`` where the branch ``before``, or None at a start, has lost its guards ``hits``."""
    system = automaton.system
    at = contacts.place_of(automaton, numbers, t, state)
    places = tuple(_settled(automaton, before, hits, place, slack) for place in at.with_nudged(slack))
    guards = mode_of(system, before).guards if before else ()
    lost = {(guards[k].kind, guards[k].friction) for k in hits}
    if not before:
        _require_kept(system, at)
        lost |= _resting(system, at)
    still = branches.at_rest(before or ()) | {k for kind, k in lost if kind == "velocity_zero"}
    signs = contacts.signs_at_rest(system, places, still)
    points = [contacts.contact_point(system, place, signs) for place in places]
    touching = _touching(system, before, lost, at)
    _require_directions(system, touching, points, at)
    return Junction(system, before, lost, places, points, signs, touching, slack)


def _require_directions(system: System, touching: dict[int, bool], points: list[ContactPoint], at: Place) -> None:
    """Raise ``UnboundedReaction`` if no force moves the gap of a rigid contact: its reaction is not determined."""
    for k, friction in enumerate(system.frictions):
        if not friction.rigid or (friction.unilateral and k not in touching):
            continue
        _, *columns = zip(*(contacts.gap_row(system, k, point) for point in points), strict=True)
        if all(map(contacts.is_open, columns)):
            raise UnboundedReaction(f"the gap of {which_contact(system, k)} has no slope {_place_in_words(system, at)},"
                                    " so that no reaction of its contact is determined; write it as a distance, which "
                                    "grows evenly", at.t, at.state)


def _settled(automaton: "Automaton", before: Branch | None, hits: tuple, place: Place, slack: Any) -> Place:
    """Return a place moved, in its own numbers, onto the zeros of all quantities that the mode ``before`` keeps at 0.

    Small values that rounding in doubles has left would count as exact in mpmath numbers. The time is moved, too: in
    doubles, a guard of the time alone in which large terms cancel is 0 some roundings beside its zero. The state is
    moved onto a lost edge of stick within the rounding ``slack``: where a state is next to 0 there, its own relative
    error does not tell which side of the edge it is on.
    """
    if not before:
        return place
    digits, t, state = place.numbers.digits, place.t, place.state
    mode = automaton.mode(before, digits)
    for guard in hits if digits else ():
        t = mode.time_of_fall(guard, t, place.state, automaton.mode(before))
        if mode.kinds[guard][0] == "slip_onset":
            moved, least = mode.snapped(guard, t, state), slack * max(map(abs, state))
            state = moved if all(abs(a - b) <= least for a, b in zip(moved, state, strict=True)) else state
    return place._replace(t=t, state=mode.settled(t, state))


def _phases(here: Junction, k: int) -> list[Phase]:
    friction = here.system.frictions[k]
    gap = _gap_sign(here, k)
    found = [] if gap > 0 else _closed(here, k)
    return found + ([OPEN] if friction.gap is not None and gap >= 0 else [])


def _gap_sign(here: Junction, k: int) -> int:
    friction = here.system.frictions[k]
    if friction.unilateral:
        return 0 if k in here.touching else 1
    if friction.gap is None:
        return -1
    if {("lift_off", k), ("touch_down", k)} & here.lost:
        return 0
    return here.numbers.decided_sign([point.contacts[k].gap for point in here.points])


def _touching(system: System, before: Branch | None, lost: set, at: Place) -> dict[int, bool]:
    """Return the rigid contacts that stay closed or may open, and whether their reaction has just vanished.

    Raises ``NoMotion`` where such a contact is hit, also by a step of its ground: a rigid contact has no law of impact.
    A gap or gap rate counts as 0 if the rounding of doubles could have made it nonzero, or at a start the rounding of
    states and parameters to six digits. Raises ``InputError`` where the gap is negative.
    """
    found, rounding = {}, BY_HAND if before is None else ROUNDING
    for k, friction in enumerate(system.frictions):
        if not friction.unilateral:
            continue
        if before is not None and not before[k].is_open:
            found[k] = ("lift_off", k) in lost
            continue
        expressions = (friction.gap, branches.rate_along(system, friction.gap))
        gap, rate = _signs(system, expressions, at, rounding, OF_ZERO if before is None else None)
        if gap < 0 and ("touch_down", k) not in lost:
            depth = float(at.values(system, (friction.gap,))[0])
            raise InputError(f"start: the gap {short(friction.gap)} of {which_contact(system, k)} is negative, "
                             f"{depth:.6g}; a rigid one starts where its gap is 0 or positive")
        if ("touch_down", k) in lost or gap == 0:
            if min(gap, rate) < 0:
                raise NoMotion(f"{which_contact(system, k)} is hit {_place_in_words(system, at)}: the rigid model has "
                               "no law of impact, the model needs compliance there", at.t, at.state)
            if rate == 0:
                found[k] = False
    return found


def which_contact(system: System, k: int) -> str:
    """Return words for a contact: its number, from 1 as in N_2 and F_2 of the second, where there are several."""
    return f"contact {k + 1}" if len(system.frictions) > 1 else "the contact"


def _require_kept(system: System, at: Place) -> None:
    """Raise ``InputError`` where a run starts off what its motions keep.

    This is 0 for the gap rate of a rigid contact that holds both ways, and for a dependent state its value.
    """
    kept = {k: friction.gap_rate for k, friction in enumerate(system.frictions) if friction.gap_rate is not None}
    for k, sign in zip(kept, _signs(system, (*kept.values(),), at, BY_HAND, OF_ZERO), strict=True):
        if sign:
            raise InputError(f"start: the gap rate {short(kept[k])} of {which_contact(system, k)} is not 0; one that "
                             "holds both ways starts with 0")
    apart = tuple(s - value for s, value in system.dependent.items())
    for s, sign in zip(system.dependent, _signs(system, apart, at, BY_HAND, OF_ZERO), strict=True):
        if sign:
            value = float(at.values(system, (system.dependent[s],))[0])
            raise InputError(f"start: {s} is not {short(system.dependent[s])} = {value:.7g}, which follows from the "
                             "other states; change these, or give it this value")


def _resting(system: System, at: Place) -> set[tuple[str, int]]:
    """Return the guards ``velocity_zero`` of contacts whose sliding velocity is 0 within the rounding of a start.

    Where this velocity is a sum of several states, in doubles the sum is hardly ever exactly 0. That of a rigid contact
    is one also where its state is not; elsewhere a single state is as exact as it was written.
    """
    velocities, found = dict(enumerate(friction.velocity for friction in system.frictions)), set()
    rigid = {k: v for k, v in velocities.items() if system.frictions[k].rigid}
    sums = {k: v for k, v in velocities.items() if k not in rigid and not v.is_Symbol}
    for some, least in ((rigid, OF_ZERO), (sums, 0)):
        signs = _signs(system, (*some.values(),), at, ROUNDING, least)
        found |= {("velocity_zero", k) for k, sign in zip(some, signs, strict=True) if sign == 0}
    return found


def _signs(system: System, expressions: tuple, at: Place, rounding: float, least: float | None) -> list[int]:
    """Return the signs of expressions, 0 where ``rounding`` of states may change them.

    Where ``least`` is None, the time is rounded, too. At a start, where it is not, a state may be off by the part
    ``least`` of the largest, as a computed zero is, and the parameters are rounded: a place that is 0 by the choice of
    coordinates has the rounding of lengths and angles. A parameter that switches an expression is not: a step is none.
    """
    if not expressions:
        return []
    places, timed = at.with_nudged(rounding, least or 0), least is None
    places = places if timed else tuple(place._replace(t=place.numbers.convert(at.t)) for place in places)
    rows = [place.values(system, expressions) for place in places]
    signs = [*map(at.numbers.decided_sign, zip(*rows, strict=True))]
    if timed or not any(signs):
        return signs
    plain = at._replace(p=at.p[: len(system.parameters)], coefficients=())
    fixed = sides.switching_symbols(*expressions)
    for _, moved in contacts.nudges(at.t, plain.p, rounding):
        rounded = zip(system.parameters, plain.p, moved, strict=True)
        p = tuple(value if symbol in fixed else near for symbol, value, near in rounded)
        rows.append(plain._replace(p=p).values(system, expressions))
    return [*map(at.numbers.decided_sign, zip(*rows, strict=True))]


def _closed(here: Junction, k: int) -> list[Phase]:
    if branches.is_smooth(here.system, k):
        return [branches.SMOOTH]
    was = here.before[k] if here.before else None
    own = [point.contacts[k] for point in here.points]
    turned = k in contacts.turned_by_others(here.system)
    kept = was is not None and (was.mode == "stick" or "velocity_zero" in was.idle)
    resting = turned or kept or ("velocity_zero", k) in here.lost
    velocity = 0 if resting else here.numbers.decided_sign([c.velocity for c in own])
    sign = (was.load if was else 0) or 1  # where both signs of the load go on alike, the first is taken
    loads: tuple[int, ...] = (sign, -sign)
    if len(signs := branches.signs_of_load(here.system, k)) == 1:
        loads = signs
    elif ("force_zero", k) not in here.lost and not own[0].pushed:
        load = here.numbers.decided_sign([c.load for c in own])
        loads = (load,) if load else loads if _loads_move(here.system)[k] else (1,)
    return [Phase(load, v) for load in loads for v in ((velocity,) if velocity else (0, 1, -1))]


@lru_cache(maxsize=64)
def _loads_move(system: System) -> tuple[bool, ...]:
    """Return for every friction whether its load depends on more than the parameters."""
    return tuple(not friction.load.free_symbols <= {*system.parameters} for friction in system.frictions)


def _place_in_words(system: System, at: Place) -> str:
    return f"at t = {float(at.t):.6g}, {listed(system.states, at.state)}"
