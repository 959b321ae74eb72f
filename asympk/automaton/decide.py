r"""Which mode begins, and which follows: every combination of slip, stick and open that is consistent is found.

At a point where some quantities vanish (a sliding velocity, a load, a gap, a margin of stick) each friction has several
phases that it might go on in. A combination of phases makes the forces the solution of linear equations, and is
consistent when every guard of its mode is positive, or vanishes and has a positive first derivative that does not
vanish, along the field of that mode. A quantity counts as vanishing when an event says so, or when the rounding of the
state could have changed its sign; a snapped quantity is never tested again. Doubles decide where all signs are clear,
mpmath numbers where one is not.

One consistent combination is the motion. Where several are, at rest stays at rest: combinations in which a contact
breaks loose that its static bound would hold if all of them rested are left out; then those in which a contact that
rested before slips and it rests on in another; then those in which any slips that rests in another. None or several
that are left end the motion. First of all, what some forces hold at rest rests, also where they are not determined.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any

import sympy as sp

from asympk.automaton.contacts import (
    DOUBLES,
    ContactNumbers,
    ContactPoint,
    Numbers,
    Place,
    Solved,
    Unclear,
    clear_sign,
    contact_formulas,
    contact_point,
    gap_row,
    row_at,
    solved_forces,
)
from asympk.automaton.modes import GuardedMode, mode_of
from asympk.automaton.rest import has_forces, stands_still
from asympk.digits import carrier_context
from asympk.errors import AsympkError, InputError, NoMotion, OutOfRange, TwoMotions, UnboundedReaction, Undecided
from asympk.multiprecision import in_context
from asympk.symbolic import branches
from asympk.symbolic.branches import OPEN, Branch, Guard, Phase
from asympk.symbolic.penetration import with_finite_powers
from asympk.symbolic.system import Friction, System

if TYPE_CHECKING:
    from asympk.automaton.automaton import Automaton

DIGITS = 60  # of an exact start
EXACT = 45  # digits of an exact start that rounding leaves
ROUNDING = 2.0**-46  # relative, of a start that was computed in doubles
BY_HAND = 2.0**-20  # relative, of a start on a contact whose numbers were written with six digits
WORKING = 40  # digits at which a mode that follows is decided at least, whatever the digits of the state
COARSER = 10  # digits that are left out to see what is rounding
LONGEST = 5_000  # operations of a derivative that is differentiated once more
MOST = 8  # frictions of which all combinations are tried
SAME = 1e-12  # relative, of two bounds that count as equal


def follow_on(automaton: "Automaton", before: Branch | None, hits: tuple, t: Any, state: tuple, slack: Any) -> Branch:
    """Return the one branch that goes on from ``state``; ``before`` ended by the loss of its guards ``hits``."""
    if not automaton.system.frictions:
        return ()
    if isinstance(slack, float):
        with suppress(Unclear, ArithmeticError, ValueError):
            return _follow_on(automaton, before, hits, t, state, slack, DOUBLES)
    digits = max(WORKING, (digits_of(state) or 0) + COARSER)
    numbers = _numbers(digits + COARSER)._replace(coarser=_numbers(digits))
    with finite(lambda: t):
        return _follow_on(automaton, before, hits, t, state, slack, numbers)


@contextmanager
def finite(reached: Callable[[], Any]) -> Iterator[None]:
    """Raise ``OutOfRange`` instead of what numbers raise that are infinite, or complex, which have no sign."""
    try:
        yield
    except AsympkError:
        raise
    except (ArithmeticError, TypeError, ValueError) as error:
        if not is_of_numbers(error):
            raise
        raise OutOfRange("a rate or a bound of the system, or its slope, is not a finite real number at t = "
                         f"{float(reached()):.6g}; start where its formulas hold, or give other parameters") from error


def is_of_numbers(error: Exception) -> bool:
    """Tell whether an error is one of numbers: of all that have a wrong type, complex ones alone, as mpmath's mpc."""
    return not isinstance(error, TypeError) or any(word in str(error) for word in ("complex", "mpc"))


def signs_at(automaton: "Automaton", exprs: tuple, t: Any, state: tuple, slack: Any) -> tuple[int, ...]:
    """Return the signs of expressions at a place, 0 of what vanishes there, or may by ``slack``, its relative error."""
    return tuple(map(clear_sign, _values_near(automaton, exprs, t, state, slack)))


def wholes_at(automaton: "Automaton", exprs: tuple, t: Any, state: tuple, slack: Any) -> tuple[int | None, ...]:
    """Return the whole parts of expressions at a place, None of what is a whole number, or may be by ``slack``."""
    found = _values_near(automaton, exprs, t, state, slack)
    nearest = (round(values[0]) for values in found)
    signs = ((n, clear_sign([value - n for value in values])) for n, values in zip(nearest, found, strict=True))
    return tuple(n - (sign < 0) if sign else None for n, sign in signs)


def _values_near(automaton: "Automaton", exprs: tuple, t: Any, state: tuple, slack: Any) -> list[tuple]:
    """Return the values of every expression at a place, and at those that ``slack`` might have made of it."""
    if not exprs:
        return []
    digits = digits_of(state)
    numbers = _numbers(digits) if digits else DOUBLES
    own, p = (tuple(map(numbers.convert, values)) for values in (state, automaton.values))
    at = Place(numbers, numbers.convert(t), own, p)
    return [*zip(*(place.values(automaton.system, exprs) for place in at.with_nudged(slack)), strict=True)]


def digits_of(state: tuple) -> int | None:
    """Return the digits of the numbers of a state, None for doubles."""
    return max((v.context.dps for v in state if hasattr(v, "context")), default=None)


def _numbers(digits: int) -> Numbers:
    ctx = carrier_context(digits)
    return Numbers("mpmath", ctx, partial(in_context, ctx), -1.0)


def _follow_on(
    automaton: "Automaton", before: Branch | None, hits: tuple, t: Any, state: tuple, slack: Any, numbers: Numbers
) -> Branch:
    system = automaton.system
    t, state = numbers.convert(t), tuple(map(numbers.convert, state))
    at = Place(numbers, t, state, tuple(map(numbers.convert, automaton.values)))
    places = tuple(_settled(automaton, before, hits, place) for place in at.with_nudged(slack))
    points = [contact_point(system, place) for place in places]
    guards = mode_of(system, before).guards if before else ()
    lost = {(guards[k].kind, guards[k].friction) for k in hits}
    lost |= set() if before else _resting_rigid(system, at)
    touching = _touching(system, before, lost, at)
    phases = [_phases(system, k, before, lost, points, numbers, touching) for k in range(len(system.frictions))]
    _require_few(phases)
    resting = {k for k, choice in enumerate(phases) if any(phase.mode == "stick" for phase in choice)}
    tried = [*product(*phases)]
    if standing := _standing(system, tried, lost, places, points, numbers):
        return standing
    try:
        return _going_on(system, before, lost, tried, resting, touching, places, points)
    except (NoMotion, TwoMotions, Undecided):
        _require_determined(system, tried, resting, touching, places[0], points)
        raise


def _settled(automaton: "Automaton", before: Branch | None, hits: tuple, place: Place) -> Place:
    """Return a place moved to where all vanishes that does in the mode before, in its own numbers.

    Rounded as a number of other ones, what only rounding leaves there would count as given. So would what cancels in a
    guard of the time alone: doubles take it for zero some roundings beside the time where it is.
    """
    if not before:
        return place
    digits = getattr(place.numbers.functions, "dps", None)
    mode = automaton.mode(before, digits)
    t = place.t
    for guard in hits if digits else ():
        t = mode.time_of_fall(guard, t, place.state)
    return place._replace(t=t, state=mode.settled(t, place.state))


def _going_on(
    system: System, before: Branch | None, lost: set, tried: list[Branch], resting: set[int], touching: dict,
    places: tuple[Place, ...], points: list[ContactPoint],
) -> Branch:  # fmt: skip
    """Return the one branch of those ``tried`` that goes on; raises ``NoMotion``, ``TwoMotions`` and ``Undecided``."""
    consistent: dict[Branch, list[int]] = {}
    at = places[0]
    for branch in tried:
        ties = _ties(system, branch, resting, points, at.numbers, touching, _unloaded(system, before, branch, lost))
        still = None if ties is None else _still(mode_of(system, branch), ties, places, touching)
        if still is not None:
            consistent[branch] = still
    if len(consistent) > 1:
        onsets = {k for kind, k in lost if kind == "slip_onset"}
        broken = partial(_breaks_loose, system, resting, points[0], at.numbers, touching, onsets)
        consistent = {branch: still for branch, still in consistent.items() if not broken(branch)} or consistent
    held = branches.at_rest(before or ()) - {k for _, k in lost}
    left = branches.most_at_rest(branches.most_at_rest(consistent, held))
    if len(left) > 1 and all(_stands(mode_of(system, branch), places) for branch in left):
        return _idle(mode_of(system, left[0]), consistent[left[0]], places)
    branch = _chosen(system, {branch: consistent[branch] for branch in left}, at.t, at.state, tried)
    _require_shared(system, branch, consistent[branch], points[0], at.t, at.state)
    return _idle(mode_of(system, branch), consistent[branch], places)


# the phases that a friction might go on in


def _phases(
    system: System,
    k: int,
    before: Branch | None,
    lost: set,
    points: list[ContactPoint],
    numbers: Numbers,
    touching: dict,
) -> list[Phase]:
    friction, was = system.frictions[k], before[k] if before else None
    contacts = [point.contacts[k] for point in points]
    if friction.constraint is not None and friction.gap is not None:
        gap = 0 if k in touching else 1
    else:
        gap = _gap_sign(friction, k, lost, contacts, numbers)
    found = [] if gap > 0 else _closed(system, k, was, lost, contacts, numbers)
    return found + ([OPEN] if friction.gap is not None and gap >= 0 else [])


def _gap_sign(friction: Friction, k: int, lost: set, contacts: list[ContactNumbers], numbers: Numbers) -> int:
    if friction.gap is None:
        return -1
    if {("lift_off", k), ("touch_down", k)} & lost:
        return 0
    return numbers.decided_sign([c.gap for c in contacts])


def _touching(system: System, before: Branch | None, lost: set, at: Place) -> dict[int, bool]:
    """Return the rigid contacts that stay closed or may open, and whether their reaction has just vanished.

    Raises ``NoMotion`` where one is hit, by a step of its ground too: a rigid contact has no law of impact. The gap and
    its rate are 0 where the rounding of doubles, or at a start that of six digits, may have made them differ from it.
    """
    found, rounding = {}, BY_HAND if before is None else ROUNDING
    for k, friction in enumerate(system.frictions):
        if friction.constraint is None or friction.gap is None:
            continue
        if before is not None and before[k] != OPEN:
            found[k] = ("lift_off", k) in lost
            continue
        expressions = (friction.gap, branches.rate_along(system, friction.gap))
        gap, rate = _signs(system, expressions, at, rounding, before is not None)
        if gap < 0 and ("touch_down", k) not in lost:
            raise InputError(f"the gap of friction {k} is negative; a rigid contact starts with gap >= 0")
        if ("touch_down", k) in lost or gap == 0:
            if min(gap, rate) < 0:
                raise NoMotion(f"the contact is hit {_place(system, at.t, at.state)}: the rigid model has no law of "
                               "impact, the model needs compliance there", at.t, at.state)  # fmt: skip
            if rate == 0:
                found[k] = False
    return found


def _resting_rigid(system: System, at: Place) -> set[tuple[str, int]]:
    """Return the rigid contacts whose sliding velocity is 0 or may be the rounding of a start, as velocities lost.

    It is a sum of several states as a rule, which doubles can not make vanish, and no state that is given as 0.
    """
    rigid = [k for k, friction in enumerate(system.frictions) if friction.constraint is not None]
    signs = _signs(system, tuple(system.frictions[k].velocity for k in rigid), at, ROUNDING, False)
    return {("velocity_zero", k) for k, sign in zip(rigid, signs, strict=True) if sign == 0}


def _signs(system: System, expressions: tuple, at: Place, rounding: float, timed: bool) -> list[int]:
    """Return the signs of expressions, 0 where ``rounding`` of states (``timed``: of the time too) leaves them open."""
    places = at.with_nudged(rounding)
    places = places if timed else tuple(place._replace(t=place.numbers.convert(at.t)) for place in places)
    rows = [place.values(system, expressions) for place in places]
    return [at.numbers.decided_sign([row[j] for row in rows]) for j in range(len(expressions))]


def _closed(
    system: System, k: int, was: Phase | None, lost: set, contacts: list[ContactNumbers], numbers: Numbers
) -> list[Phase]:
    friction = system.frictions[k]
    resting = (was is not None and was.mode == "stick") or ("velocity_zero", k) in lost
    velocity = 0 if resting else numbers.decided_sign([c.velocity for c in contacts])
    if branches.lifts(friction):
        loads: tuple[int, ...] = (1,)
    elif friction.constraint is not None or ("force_zero", k) in lost:
        loads = (1, -1)
    else:
        load = numbers.decided_sign([c.load for c in contacts])
        loads = (load,) if load else (1, -1) if _loads_move(system)[k] else (1,)
    return [Phase(load, v) for load in loads for v in ((velocity,) if velocity else (0, 1, -1))]


@lru_cache(maxsize=64)
def _loads_move(system: System) -> tuple[bool, ...]:
    """Tell of every friction whether its load depends on more than parameters."""
    return tuple(not friction.load.free_symbols <= {*system.parameters} for friction in system.frictions)


def _require_few(phases: list[list[Phase]]) -> None:
    if sum(len(choice) > 1 for choice in phases) > MOST:
        raise InputError(f"{len(phases)} frictions are undecided at once; combinations are tried for at most {MOST}")


# consistency


def _unloaded(system: System, before: Branch | None, branch: Branch, lost: set[tuple[str, int]]) -> set[int]:
    """Return the rigid contacts whose reaction has just vanished, and does in ``branch``: others go on as before.

    It is a force, which a state that is moved onto its zero meets to rounding only.
    """
    changed = {k for k, was in enumerate(before or ()) if was != branch[k]}
    vanished = {k for kind, k in lost if kind == "force_zero" and system.frictions[k].constraint is not None}
    return {k for k in vanished if changed <= {k}}


def _ties(
    system: System, branch: Branch, resting: set[int], points: list[ContactPoint], numbers: Numbers, touching: dict,
    unloaded: set[int],
) -> list[int] | None:  # fmt: skip
    """Return the guards of the branch that vanish, those that are fixed too, or None where one is lost already.

    Margins are times the determinant of the forces' equations, which have large forces of either sign near its zero.
    """
    margins, sizes = [], []
    for point in points:
        if (solved := solved_forces(system, branch, point, numbers)) is None:
            return None
        margins.append(_margins(system, branch, resting, point, solved, touching))
        sizes.append(solved.determinant)
    ties, largest = [], max(sizes)
    for key in margins[0]:
        vanishes = key[0] == "force_zero" and key[1] in unloaded
        values = [m[key] * size / largest for m, size in zip(margins, sizes, strict=True)]
        sign = 0 if vanishes else numbers.decided_sign(values)
        if sign < 0:
            return None
        if sign == 0:
            ties.append(key)
    guards = _all_guards(mode_of(system, branch))
    return [k for k, guard in enumerate(guards) if (guard.kind, guard.friction, _side(guards, k)) in ties]


def _all_guards(mode: GuardedMode) -> tuple[Guard, ...]:
    return (*mode.guards, *mode.fixed_guards)


def _side(guards: tuple, k: int) -> int:
    """Return 0, or 1 for the second of two guards of one kind and friction (the two edges of stick)."""
    return int(k > 0 and guards[k][:2] == guards[k - 1][:2])


def _margins(
    system: System, branch: Branch, resting: set[int], point: ContactPoint, solved: Solved, touching: dict
) -> dict[tuple, Any]:
    """Return, by (kind, friction, side), what must not be negative; at rest it is the rate of the velocity."""
    forces = (1, *(solved.forces[u] for u in contact_formulas(system)[1]))
    found: dict[tuple[str, int, int], Any] = {}
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        contact = point.contacts[k]
        if phase == OPEN:
            found["touch_down", k, 0] = _opening(system, k, point, forces, touching)
            continue
        load = contact.load + contact.reaction * solved.forces.get(friction.normal, 0)
        if friction.gap is not None:
            found["lift_off", k, 0] = -contact.gap if friction.constraint is None else load
        if phase.velocity == 0:
            bound = contact.static * phase.load * load
            found["slip_onset", k, 0] = bound + solved.forces[friction.force]
            found["slip_onset", k, 1] = bound - solved.forces[friction.force]
        else:
            if not branches.lifts(friction):
                found["force_zero", k, 0] = phase.load * load
            rate = row_at(point.rows[k], forces)
            found["velocity_zero", k, 0] = phase.velocity * (rate if k in resting else contact.velocity)
    return found


def _breaks_loose(
    system: System, resting: set, point: ContactPoint, numbers: Numbers, touching: dict, onsets: set, branch: Branch
) -> bool:
    """Tell whether a contact slips in a branch that static friction would hold if all rested that may."""
    rest = tuple(p._replace(velocity=0) if k in resting and p != OPEN else p for k, p in enumerate(branch))
    if (solved := solved_forces(system, rest, point, numbers)) is None:
        return False
    margins = _margins(system, rest, resting, point, solved, touching)
    over = {k for (kind, k, _), margin in margins.items() if kind == "slip_onset" and margin < 0}
    return any(a != b and k not in over | onsets for k, (a, b) in enumerate(zip(branch, rest, strict=True)))


def _opening(system: System, k: int, point: ContactPoint, forces: tuple, touching: dict) -> Any:
    """Return what must be positive for a contact to open: its gap, or, for a rigid one that touches, g'' without it.

    The forces of the other contacts are in g''. It is 0 where the reaction has just vanished, and g''' is asked next.
    """
    if system.frictions[k].constraint is None:
        return point.contacts[k].gap
    if k not in touching:
        return abs(point.contacts[k].gap)
    return 0 if touching[k] else row_at(gap_row(system, k, point), forces)


def _still(mode: GuardedMode, ties: list[int], places: tuple[Place, ...], touching: dict) -> list[int] | None:
    """Return those of the guards that vanish with all derivatives, or None at the first that falls."""
    if mode.pressed and any(v < 0 for v in places[0].values(mode.system, mode.conditions)):
        return None  # a margin vanishes with the penetration, and is negative as soon as there is one
    still = []
    for k in ties:
        sign = _growth(mode, k, places, touching) if k < len(mode.guards) else 0
        if sign < 0:
            return None
        if sign == 0:
            still.append(k)
    return still


def _growth(mode: GuardedMode, guard: int, places: tuple[Place, ...], touching: dict) -> int:
    """Return the sign of the first derivative along the field, of a guard that vanishes, that does not; else 0.

    Powers of the penetration are left out of each (Lemma 11), infinite ones where what they multiply is not 0.
    """
    kind, friction, _, divided = mode.guards[guard]
    first = 3 if kind == "touch_down" and friction in touching else 1 - divided  # g, g' and g'' vanish there
    moving = 5 if mode.system.time else min(len(mode.system.states), 5)
    for order in range(first, 2 + moving):
        if order > first and _length(mode.derivative(guard, order - (1 if mode.pressed else 2))) > LONGEST:
            raise Undecided(f"{kind} of {mode.name} vanishes at t = {float(places[0].t):.6g} with "
                            f"its first {order - 1} derivatives; start beside this state")  # fmt: skip
        asked: list[tuple[tuple, tuple]] = [((mode.derivative(guard, max(order - 1, 0)),), (mode.flow,))]
        if mode.pressed or not order:
            found = mode.derivative(guard, order)
            asked = [((expr,), ()) for expr in dict.fromkeys((with_finite_powers(found), found))]
        for part in asked:
            values = [place.values(mode.system, *part)[0] for place in places]
            if sign := places[0].numbers.decided_sign(values):
                return sign
        if order == first and _stays(mode, guard, places):
            break
    return 0


def _idle(mode: GuardedMode, still: list[int], places: tuple[Place, ...]) -> Branch:
    """Return the branch of a mode without the guards that stay 0: of these rounding alone would make events."""
    idle = [mode.guards[k] for k in still if k < len(mode.guards) and _stays(mode, k, places)]
    kinds = (tuple(g.kind for g in idle if g.friction == k) for k in range(len(mode.branch)))
    return tuple(phase if phase == OPEN else phase._replace(idle=kind)
                 for phase, kind in zip(mode.branch, kinds, strict=True))  # fmt: skip


def _stands(mode: GuardedMode, places: tuple[Place, ...]) -> bool:
    """Tell whether all rates of a mode vanish, and do so for ever: its motion is that of any other that stands."""
    return mode.system.time is None and _vanish(mode.rates, mode.system, places)


def _stays(mode: GuardedMode, guard: int, places: tuple[Place, ...]) -> bool:
    """Tell whether a guard depends on states alone that stand still, and do so for ever."""
    rates = mode.rates_behind(mode.guards[guard].value)
    return rates is not None and _vanish(rates, mode.system, places)


def _vanish(exprs: tuple[sp.Expr, ...], system: System, places: tuple[Place, ...]) -> bool:
    rows = (place.values(system, exprs) for place in places)
    return not any(map(places[0].numbers.decided_sign, zip(*rows, strict=True)))


@lru_cache(maxsize=256)
def _length(expr: sp.Expr) -> int:
    return sp.count_ops(expr)


# the choice


def _standing(
    system: System, tried: list[Branch], lost: set, places: tuple[Place, ...], points: list[ContactPoint],
    numbers: Numbers,
) -> Branch | None:  # fmt: skip
    """Return a branch in which all stands still on contacts that have more forces than equations, or None."""
    if system.time is not None or any(kind == "slip_onset" for kind, _ in lost):
        return None
    for branch in branches.most_at_rest(b for b in tried if not any(phase.velocity for phase in b)):
        if len(branches.at_rest(branch)) > 1:
            loose = solved_forces(system, branch, points[0], numbers) is None
            if loose and stands_still(system, branch, places, points, numbers):
                return tuple(phase._replace(still=phase != OPEN) for phase in branch)
    return None


def _require_determined(
    system: System, tried: list[Branch], resting: set[int], touching: dict, at: Place, points: list[ContactPoint]
) -> None:
    """Refuse a branch that some forces agree with and no equations determine, so that its motion cannot be told."""
    loose = (branch for branch in tried if solved_forces(system, branch, points[0], at.numbers) is None)
    if branch := next((b for b in loose if has_forces(system, b, resting, touching, points, at.numbers)), None):
        raise UnboundedReaction(f"the forces of contacts are not determined {_place(system, at.t, at.state)}: "
                                f"{branches.mode_name(branch)} has more of them than equations; merge contacts, or put "
                                "compliance between them", at.t, at.state)  # fmt: skip


def _require_shared(
    system: System, branch: Branch, still: list[int], point: ContactPoint, t: Any, state: tuple
) -> None:
    """Refuse a branch in which a contact slips in name alone and could bear more than that.

    It rests because others do, on whose velocities its own depends. Any of them may bear what the rates ask for, and
    one of the branches has all forces that are not determined at their bounds: those of slip, which are less than what
    the contact holds where static friction exceeds the kinetic one.
    """
    guards = _all_guards(mode_of(system, branch)) if still else ()
    for k in (guards[j].friction for j in still if guards[j].kind == "velocity_zero"):
        static, kinetic = point.contacts[k].static, point.contacts[k].kinetic
        if static - kinetic > SAME * static:
            raise UnboundedReaction(
                f"the forces of contacts at rest are not determined {_place(system, t, state)}: friction {k} rests "
                "where others do, and what its static friction adds is not known; merge frictions of the same "
                "velocity, or put compliance between them", t, state)  # fmt: skip


def _chosen(system: System, left: dict[Branch, list[int]], t: Any, state: tuple, tried: list[Branch]) -> Branch:
    if len(left) == 1:
        return next(iter(left))
    distinct = {tuple(mode_of(system, _loaded(system, *item)).rates): item[0] for item in reversed(left.items())}
    if len(distinct) == 1:
        return next(iter(distinct.values()))
    where = _place(system, t, state)
    if not distinct:
        names = ", ".join(dict.fromkeys(map(branches.mode_name, tried)))
        error: type[NoMotion] | type[TwoMotions] = NoMotion
        words = f"no motion goes on {where}: none of {names} is consistent"
    else:
        names = " and ".join(sorted(map(_in_words, distinct.values())))
        error, words = TwoMotions, f"several motions go on {where}: {names} are all consistent"
    raise error(f"{words}; the model needs compliance there", t, state)


def _loaded(system: System, branch: Branch, still: list[int]) -> Branch:
    """Return the branch, open or with a positive load where that vanishes for ever, and no sign can be told."""
    guards, kinds = _all_guards(mode_of(system, branch)), ("lift_off", "force_zero")
    open_, idle = ({guards[k].friction for k in still if guards[k].kind == kind} for kind in kinds)
    return tuple(OPEN if k in open_ else phase._replace(load=1) if k in idle else phase
                 for k, phase in enumerate(branch))  # fmt: skip


def _place(system: System, t: Any, state: tuple) -> str:
    values = ", ".join(f"{s} = {float(w):.6g}" for s, w in zip(system.states, state, strict=True))
    return f"at t = {float(t):.6g}, {values}"


def _in_words(branch: Branch) -> str:
    signs = {1: "velocity > 0", -1: "velocity < 0"}
    return "+".join(f"{p.mode} ({signs[p.velocity]})" if p.velocity else p.mode for p in branch)
