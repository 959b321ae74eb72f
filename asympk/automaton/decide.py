"""Decide which mode begins at a start or follows an event, from all consistent combinations of slip, stick and open.

A branch is one phase for each friction, and makes the forces the solution of linear equations. A branch is consistent
when no guard of its mode is negative, and when for each guard that vanishes the first nonvanishing derivative along the
field is positive (``consistency``). A single consistent branch is the motion. Of several, contacts prefer rest:

1. A branch is left out if a contact slips in it that static friction would hold (``breaks_loose``).
2. A branch is left out if another keeps at rest what it does and more: first of what rested before, then of all.
3. A branch is taken back in which a load has another sign, or none, than where its contact does not rest.

The motion ends with an error if no branch is left, or several with different rates, or if a contact at rest may slip in
either direction as well: such rest repels. Before all this the system rests if some forces, determined or not, hold all
of it (``rest``). ``follow_on`` is the entry, ``_going_on`` the rules; doubles decide where all signs are clear.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import sympy as sp

from asympk.automaton import consistency
from asympk.automaton.consistency import Tried, all_guards, all_vanish, solved_without_friction, staying, stays
from asympk.automaton.contacts import DOUBLES, Numbers, Unclear, clear_sign, place_of
from asympk.automaton.exact import MOST_WORKING
from asympk.automaton.junction import Junction, junction_at
from asympk.automaton.modes import GuardedMode, mode_of
from asympk.automaton.rest import has_forces, known_forces, move_alike, moves_otherwise, standing_branch
from asympk.digits import carrier_context
from asympk.errors import AsympkError, NegativeFriction, NoMotion, OutOfRange, TwoMotions, UnboundedReaction, Undecided
from asympk.multiprecision import in_context
from asympk.numbers import short
from asympk.symbolic import branches, forces, sides
from asympk.symbolic.branches import OPEN, Branch, Guard
from asympk.symbolic.placing import named_parts
from asympk.symbolic.system import System
from asympk.symbolic.values import term_without_value

if TYPE_CHECKING:
    from asympk.automaton.automaton import Automaton
    from asympk.automaton.numericmode import NumericMode

DIGITS = 60  # digits to which an exact start is converted
EXACT = 45  # digits of an exact start that count as correct; the other 15 are left to rounding
WORKING = 40  # least number of digits on which the following mode is decided, whatever the digits of the state
COARSER = 10  # digits by which a second, coarser evaluation is shorter; a sign on which the two differ is rounding
LATER = Fraction(5, 7)  # a generic span of time: after it a smooth force that is 0 now shows whether it stays 0
RANGE = 700  # more digits than lie between the least and the largest double
SOON = 17  # spans from rounding to 1e-6, each four times as long as the one before
MOST_OPEN = 256  # branches that may have open forces: to compare 195 takes five seconds, 931 half a minute
SAME = 1e-12  # relative difference below which static and kinetic friction count as equal


def follow_on(automaton: "Automaton", before: Branch | None, hits: tuple, t: Any, state: tuple, slack: Any) -> Branch:
    """Return the one branch that follows at ``state``, where the branch ``before`` has lost its guards ``hits``.

    At a start ``before`` is None. ``slack`` is the relative error of the state. Raises ``NoMotion``, ``TwoMotions``,
    ``Undecided``, ``UnboundedReaction``, ``OutOfRange`` and ``InputError``.
    """
    if not automaton.system.frictions:
        return ()
    if isinstance(slack, float):
        with suppress(Unclear, ArithmeticError, ValueError):
            return _follow_on(automaton, before, hits, t, state, slack, DOUBLES)
    state, numbers = _in_digits(state)
    with finite(lambda: t, lambda: without_value(automaton.system, automaton.values, t, state)):
        return _follow_on(automaton, before, hits, t, state, slack, numbers)


def all_motions(automaton: "Automaton", t: Any, state: tuple, slack: Any) -> dict[Branch, dict[sp.Symbol, Any]]:
    """Return every branch that may begin at ``state``, no two of the same rates, and its forces.

    None is preferred for its rest. A contact begins to slip if it does so with its static friction, too. Where the
    system rests on contacts whose equations leave forces open, only the others are given. Raises ``UnboundedReaction``
    where such forces may move it, or are those of over ``MOST_OPEN`` branches, ``Undecided``, ``OutOfRange`` and
    ``InputError``.
    """
    state, numbers = _in_digits(state)
    with finite(lambda: t, lambda: without_value(automaton.system, automaton.values, t, state)):
        points = _beginnings(automaton, t, state, slack, numbers)
        here, there = points[0], points[-1]
        tried = consistency.admissible(here)
        if sum(keys is None for keys in tried.values()) > MOST_OPEN:
            _require_determined(here, tried)
        standing = branches.bare(_standing(here, tried) or ())
        shared = _shared(here, tried, standing)
        rests = {branch for branch, keys in tried.items()
                 if standing and keys is not None and move_alike(here, branch, standing)}
        lasting = rests if here.system.time is None else set[Branch]()  # without a time what rests now rests on
        consistent, doubts = _consistent(here, {b: keys for b, keys in tried.items() if b not in lasting})
        onsets = consistent if there is here else _consistent(there, consistency.admissible(there))[0]
        for doubtful, doubt in doubts.items():
            if doubtful not in rests:  # else it rests, too, as far as computed
                raise next((_undetermined(here, branch) for branch, others in shared.items() if others), doubt)
        begun = {branch: still for branch, still in consistent.items()
                 if branch in onsets
                 and not here.resting & (_named(here, branch, still) | _named(there, branch, onsets[branch]))}
        if rests & begun.keys():  # alike for now
            raise _undetermined(here, standing)
        found = {branch: here.forces(branch) for branch in _distinct(begun, _modes(here, begun)).values()}
        return found | _with_open_forces(here, shared, {*consistent}, {*begun})


def has_paradox(automaton: "Automaton", t: Any, state: tuple, slack: Any) -> bool:
    """Tell whether some loads leave the contacts that are closed at ``state`` no motion or several (Lemmas 17 and 21).

    A contact that might rest counts with its static friction, too. Raises ``InputError`` for too many contacts, and
    ``UnboundedReaction`` where forces that are not determined in some choice of phases leave it open.
    """
    state, numbers = _in_digits(state)
    with finite(lambda: t, lambda: without_value(automaton.system, automaton.values, t, state)):
        points = _beginnings(automaton, t, state, slack, numbers)
        found = [(point, *choice) for point in points for choice in consistency.choices(point)]
        if not all(consistency.is_stiff(*each) for each in found):
            return True
        for point, branch, group in found:
            if point.solved(branch, group) is None:
                raise _undetermined(point, branch)
        return False


def _beginnings(automaton: "Automaton", t: Any, state: tuple, slack: Any, numbers: Numbers) -> list[Junction]:
    """Return the junction of a start and, if it differs, that with static friction where contacts might rest."""
    here = junction_at(automaton, None, (), t, state, slack, numbers)
    held = _with_static(automaton, here.resting)
    return [here] if held == automaton else [here, junction_at(held, None, (), t, state, slack, numbers)]


def _with_static(automaton: "Automaton", resting: set[int]) -> "Automaton":
    """Return the automaton as if static friction were the kinetic one of the contacts that might rest."""
    frictions = (replace(friction, kinetic=friction.static) if k in resting else friction
                 for k, friction in enumerate(automaton.system.frictions))
    return automaton.of(replace(automaton.system, frictions=(*frictions,)))


def _in_digits(state: tuple) -> tuple[tuple, Numbers]:
    """Return a state without parts that no digits hold beside the largest, and the numbers to decide on."""
    digits = max(WORKING, (digits_of(state) or 0) + COARSER)
    if any(state) and min(filter(None, map(abs, state))) < _part(digits, state):  # no sum with the largest contains it
        digits += RANGE
        state = tuple(w if abs(w) >= _part(RANGE, state) else 0 * w for w in state)
    return state, _numbers(digits + COARSER)._replace(coarser=_numbers(digits))


def _part(digits: int, state: tuple) -> Any:
    """Return the size of the largest state times 10^-``digits``."""
    return max(map(abs, state)) * _numbers(digits).functions.mpf(10) ** -digits


@contextmanager
def finite(reached: Callable[[], Any], named: Callable[[], str] = str) -> Iterator[None]:
    """Raise ``OutOfRange`` in place of the errors of infinite or complex numbers.

    ``reached`` gives the time, and ``named`` what has no value there, or "" where that is not known.
    """
    try:
        yield
    except AsympkError:
        raise
    except (ArithmeticError, TypeError, ValueError) as error:
        if not is_of_numbers(error):
            raise
        what = named() or "a rate or a bound of the system, or its slope,"
        raise OutOfRange(f"{what} is not a finite real number at t = {float(reached()):.6g}; start where its formulas "
                         "hold, or give other parameters") from error


def without_value(system: System, values: tuple, t: Any, state: tuple) -> str:
    """Return the first term that has no finite real value, and the rate or part of a friction it is in, or ""."""
    symbols = (*system.parameters, *system.states, *([system.time] if system.time else ()))
    given = (*values, *state, t)
    at = {s: sp.Rational(float(value)) for s, value in zip(symbols, given, strict=False)}
    at |= dict.fromkeys(system.pushes, sp.S.Zero)
    for name, expr in named_parts(system).items():
        if term := term_without_value(expr, at):
            return f"{short(term)} in {name} = {short(expr)}" if term != expr else f"{name} = {short(expr)}"
    return ""


def without_value_soon(mode: "NumericMode", t: float, state: tuple[float, ...]) -> str:
    """Return what has no finite real value at a state of a mode or shortly after, as ``without_value`` does.

    The place is sought along the rates, at spans that grow from rounding on.
    """
    system, span = mode.mode.system, 2.0**-52 * max(1.0, abs(t))
    values = mode.p[: len(system.parameters)]
    with suppress(ArithmeticError, TypeError, ValueError):
        slope = mode.rhs(t, state)
        for _ in range(SOON):
            later = tuple(w + span * rate for w, rate in zip(state, slope, strict=True))
            if found := without_value(system, values, t + span, later):
                return found
            span *= 4
    return without_value(system, values, t, state)


def is_of_numbers(error: Exception) -> bool:
    """Tell whether an error is one of numbers; a ``TypeError`` is if it names complex numbers, as mpmath's ``mpc``."""
    return not isinstance(error, TypeError) or any(word in str(error) for word in ("complex", "mpc"))


def signs_at(automaton: "Automaton", exprs: tuple, t: Any, state: tuple, slack: Any) -> tuple[int, ...]:
    """Return the signs of expressions at ``t`` and ``state``, or 0 where the relative error ``slack`` allows a zero."""
    return tuple(map(clear_sign, _values_near(automaton, exprs, t, state, slack)))


def nearest_edges(
    automaton: "Automaton", phases: tuple, t: Any, state: tuple, slack: Any
) -> tuple[tuple[sides.Edge, int], ...]:
    """Return the nearest edge of each phase, and the sign of its quantity, 0 within the relative error ``slack``."""
    found = _values_near(automaton, tuple(map(sides.measured, phases)), t, state, slack)
    wholes = (round(v[0]) if sides.is_whole(p) else 0 for p, v in zip(phases, found, strict=True))
    return tuple((sides.Edge(p, n), clear_sign([value - n for value in values]))
                 for p, n, values in zip(phases, wholes, found, strict=True))


def _values_near(automaton: "Automaton", exprs: tuple, t: Any, state: tuple, slack: Any) -> list[tuple]:
    """Return the values of each expression: first at the state, then at states displaced by its error ``slack``."""
    if not exprs:
        return []
    digits = digits_of(state)
    numbers = _numbers(digits) if digits else DOUBLES
    at = place_of(automaton, numbers, t, state)
    return [*zip(*(place.values(automaton.system, exprs) for place in at.with_nudged(slack)), strict=True)]


def digits_of(state: tuple) -> int | None:
    """Return the digits of the numbers of a state, None for doubles."""
    return max((v.context.dps for v in state if hasattr(v, "context")), default=None)


def _numbers(digits: int) -> Numbers:
    ctx = carrier_context(digits)
    return Numbers("mpmath", ctx, partial(in_context, ctx), -1.0, largest=ctx.mpf(10) ** MOST_WORKING)


def _follow_on(
    automaton: "Automaton", before: Branch | None, hits: tuple, t: Any, state: tuple, slack: Any, numbers: Numbers
) -> Branch:
    here = junction_at(automaton, before, hits, t, state, slack, numbers)
    tried = consistency.admissible(here)
    if standing := _standing(here, tried):
        _require_one_way(here, branches.bare(standing), tried)
        return standing
    try:
        return _going_on(here, tried)
    except (NoMotion, TwoMotions, Undecided):
        _require_determined(here, tried)
        raise


def _going_on(here: Junction, tried: Tried) -> Branch:
    """Return the one branch that follows; raises ``NoMotion``, ``TwoMotions``, ``Undecided``, ``UnboundedReaction``."""
    consistent, doubts = _consistent(here, tried)
    firm = [b for b in consistent if len(consistent) == 1 or not consistency.breaks_loose(here, b)] or [*consistent]
    held = branches.at_rest(here.before or ()) - {k for _, k in here.lost}
    preferred = branches.most_at_rest(branches.most_at_rest([*firm, *doubts], held))
    for branch, doubt in doubts.items():
        if branch in preferred or _presses_otherwise(here, branch, preferred):
            raise doubt
    if len(preferred) > 1 and all(consistency.stands_still(here, mode_of(here.system, branch)) for branch in preferred):
        return _idle(here, preferred[0], consistent[preferred[0]])
    others = [branch for branch in firm if _presses_otherwise(here, branch, preferred)]
    branch = _chosen(here, {branch: consistent[branch] for branch in [*preferred, *others]})
    _require_one_way(here, branch, tried)
    _require_shared(here, branch, consistent[branch])
    _require_uncritical(here, branch, tried)
    _require_opposing(here, branch)
    return _idle(here, branch, consistent[branch])


def _consistent(here: Junction, tried: Tried) -> tuple[dict[Branch, list[int]], dict[Branch, Undecided]]:
    """Return the consistent branches with their guards that stay 0, and those for which that is undecided."""
    consistent, doubts = dict[Branch, list[int]](), dict[Branch, Undecided]()
    for n, (branch, keys) in enumerate(tried.items()):
        if n and keys:
            consistency.require_time_left(here)
        try:
            still = None if keys is None else staying(here, mode_of(here.system, branch), keys)
        except Undecided as error:
            doubts[branch], still = error, None
        if still is not None:
            consistent[branch] = still
    return consistent, doubts


def _presses_otherwise(here: Junction, branch: Branch, preferred: list[Branch]) -> bool:
    return all(branches.presses_otherwise(here.system, branch, other) for other in preferred)


def _idle(here: Junction, branch: Branch, still: list[int]) -> Branch:
    """Return a branch in which the guards that stay 0 are idle: rounding alone would make events of these guards."""
    mode = mode_of(here.system, branch)
    idle = [mode.guards[k] for k in still if k < len(mode.guards) and stays(here, mode, k)]
    kinds = (tuple(g.kind for g in idle if g.friction == k) for k in range(len(branch)))
    return tuple(phase._replace(idle=kind) for phase, kind in zip(branch, kinds, strict=True))


def _standing(here: Junction, tried: Tried) -> Branch | None:
    """Return a branch in which the system rests on contacts whose equations do not determine their forces, or None."""
    if not branches.stands(here.before or ()) and any(kind == "slip_onset" for kind, _ in here.lost):
        return None
    for branch in branches.most_at_rest(b for b in tried if not any(phase.slips for phase in b)):
        loose = not here.is_determined(branch)
        standing = standing_branch(here, branch, partial(_margin_growth, here)) if loose else None
        if standing and (here.system.time is None or _lasts(here, standing)):
            if moves_otherwise(here, branch, branch):
                raise _undetermined(here, branch)
            return standing
    return None


def _margin_growth(here: Junction, branch: Branch, margin: Guard) -> int:
    """Return the sign with which a margin of a branch that stands leaves 0, or 0 if the margin stays 0."""
    mode = mode_of(here.system, branch)
    guard = next((k for k, guard in enumerate(mode.guards) if guard.key == margin.key), None)
    return 0 if guard is None else next(filter(None, consistency.signs_of_derivatives(here, mode, guard)), 0)


def _lasts(here: Junction, branch: Branch) -> bool:
    """Tell whether what is 0 in a branch that stands stays 0 as the time goes on, as far as computed.

    The states stand still, so that a smooth force which is 0 at all times is 0, and finite, at any later one, too.
    """
    mode, time = mode_of(here.system, branch), here.system.time
    rows = tuple(row for row in mode.standing if row.has(time))
    smooth = tuple(row for row in rows if not sides.is_switched(row, (time,)))
    for _ in range(consistency.ORDERS):
        rows = tuple(map(mode.drift, rows))
        if not all_vanish(here, rows):
            return False
    later = tuple(place.later(LATER) for place in here.places)
    with suppress(OutOfRange), finite(lambda: later[0].t):
        return all_vanish(here, smooth, later)
    return False


def _require_determined(here: Junction, tried: Tried) -> None:
    """Raise ``UnboundedReaction`` if some forces agree with a branch whose equations do not determine them."""
    for branch in _open(here, tried):
        raise _undetermined(here, branch)


def _open(here: Junction, tried: Tried) -> Iterator[Branch]:
    """Yield the branches with which some forces agree that their equations do not determine."""
    return (branch for branch, keys in tried.items() if keys is None and has_forces(here, branch, elsewhere=True))


def _shared(here: Junction, tried: Tried, standing: Branch) -> dict[Branch, list[Branch]]:
    """Return the branches with open forces, the most at rest first, and those with determined forces and their rates.

    A branch that is ``standing`` has no others, and stands for all with open forces that let the system rest. Raises
    ``UnboundedReaction`` if the rates of a branch depend on its open forces, or are those of no other.
    """
    determined = [branch for branch, keys in tried.items() if keys is not None]
    found: dict[Branch, list[Branch]] = {standing: []} if standing else {}
    for branch in sorted(_open(here, tried), key=lambda branch: -len(branches.at_rest(branch))):
        if standing and has_forces(here, branch) and move_alike(here, branch, standing):
            continue
        found[branch] = [other for other in determined if move_alike(here, branch, other)]
        if not (found[branch] and has_forces(here, branch)):
            raise _undetermined(here, branch)
    return found


def _with_open_forces(
    here: Junction, shared: dict[Branch, list[Branch]], consistent: set[Branch], begun: set[Branch]
) -> dict[Branch, dict[sp.Symbol, Any]]:
    """Return the motions of ``shared`` branches, with the forces that are known.

    It goes on if its contacts at rest slip, in name only, in a consistent branch; one that is ``begun`` is refused.
    """
    found, taken = {}, set[Branch]()
    for branch, others in shared.items():
        if others and (begun.intersection(others) or not consistent.intersection(others)):
            raise _undetermined(here, branch)
        if not taken.intersection(others):
            found[branch] = known_forces(here, branch)
        taken |= {*others}
    return found


def _require_uncritical(here: Junction, chosen: Branch, tried: Tried) -> None:
    """Raise ``UnboundedReaction`` if friction leaves a branch undetermined that may move the system in several ways.

    A branch is examined if every contact at rest in ``chosen`` rests in it, too. It passes if its reactions are not
    determined even without friction: contacts that press on one another by normals alone bear no more than they must.
    """
    for branch, keys in tried.items():
        rests = keys is None and branches.at_rest(branch) >= branches.at_rest(chosen)
        bears = rests and solved_without_friction(here, branch, range(len(branch)))
        if bears and moves_otherwise(here, branch, branch):
            raise _undetermined(here, branch)


def _undetermined(here: Junction, branch: Branch) -> UnboundedReaction:
    why = "has equations that are singular in this state only; move the start a little, as an angle by 1e-6"
    if not forces.determined(here.system, branch):
        known = known_forces(here, branch)
        names = ", ".join(str(force) for force in here.system.pushes if force not in known)
        why = f"has more of them than equations, which leave {names} open; merge contacts, or add compliance to them"
    return UnboundedReaction(f"the forces of contacts are not determined {here.in_words}: "
                             f"{branches.mode_name(branch)} {why}", here.at.t, here.at.state)


def _require_opposing(here: Junction, chosen: Branch) -> None:
    """Raise ``NegativeFriction`` if the friction of a contact that slips is negative, by a law of the state."""
    for k, phase in enumerate(chosen):
        if phase.slips and all(point.contacts[k].kinetic < 0 for point in here.points_in(chosen)):
            raise NegativeFriction(f"kinetic friction {short(here.system.frictions[k].kinetic)} is negative "
                                   f"{here.in_words}; friction opposes the velocity: write a law that does not fall "
                                   "below 0")


def _require_one_way(here: Junction, branch: Branch, tried: Tried) -> None:
    """Raise ``TwoMotions`` if a contact at rest in a branch may as well slip in either direction, all else alike."""
    for k in branches.at_rest(branch):
        ways = {b[k].velocity: b for b, keys in tried.items() if keys is not None and b[k].velocity
                and b[:k] + b[k + 1 :] == branch[:k] + branch[k + 1 :]}
        if len(ways) > 1 and all(_leaves_rest(here, b, tried[b], k) for b in ways.values()):
            raise _several(here, (branch, *ways.values()))


def _leaves_rest(here: Junction, branch: Branch, keys: list[tuple] | None, k: int) -> bool:
    """Tell whether a branch whose guards ``keys`` vanish is consistent, and contact k slips in it not in name only.

    A branch whose consistency is undecided is not said to leave.
    """
    still = None
    with suppress(Undecided):
        still = staying(here, mode_of(here.system, branch), keys or [])
    return still is not None and k not in _named(here, branch, still)


def _require_shared(here: Junction, branch: Branch, still: list[int]) -> None:
    """Raise ``UnboundedReaction`` if a contact slips in name only and static friction would let it bear more.

    Its velocity stays 0 because other contacts rest, and how all of these share the force that the rates require is not
    determined. One consistent branch has every undetermined force at its bound (Lemma 10). Unless the velocity is a
    combination of velocities at rest, this bound is kinetic friction: too small if static friction is larger.
    """
    for k in (k for k in _named(here, branch, still) if not forces.rests_in_all_but_name(here.system, branch, k)):
        _, kinetic, static, *_ = here.points_in(branch)[0].contacts[k]
        if static - kinetic > SAME * static:
            raise UnboundedReaction(
                f"the forces of contacts at rest are not determined {here.in_words}: friction {k + 1} rests where "
                "others do, and what its static friction adds is not known; merge frictions of the same velocity, or "
                "put compliance between them", here.at.t, here.at.state)


def _named(here: Junction, branch: Branch, still: list[int]) -> set[int]:
    """Return the contacts that slip in name only, as their velocities are among the guards that stay 0."""
    guards = all_guards(mode_of(here.system, branch)) if still else ()
    return {guards[j].friction for j in still if guards[j].kind == "velocity_zero"}


def _chosen(here: Junction, consistent: dict[Branch, list[int]]) -> Branch:
    if len(consistent) == 1:
        return next(iter(consistent))
    modes = _modes(here, consistent)
    distinct = _distinct(consistent, modes)
    apart = tuple(a - b for rates in distinct for a, b in zip(modes[0].rates, rates, strict=True))
    if len(distinct) == 1 or (distinct and consistency.vanish_along(here, modes[0], apart)):
        return next(iter(consistent))
    if not distinct:
        raise NoMotion(f"no motion goes on {here.in_words}: {_why_none(here)}", here.at.t, here.at.state)
    raise _several(here, distinct.values())


def _modes(here: Junction, consistent: dict[Branch, list[int]]) -> list[GuardedMode]:
    return [mode_of(here.system, _loaded(here.system, *item)) for item in consistent.items()]


def _distinct(consistent: Iterable[Branch], modes: list[GuardedMode]) -> dict[tuple, Branch]:
    """Return the first of the branches of each motion, by the rates of its mode."""
    return {mode.rates: branch for mode, branch in reversed([*zip(modes, consistent, strict=True)])}


def _several(here: Junction, consistent: Iterable[Branch]) -> TwoMotions:
    names = " and ".join(sorted({*map(_in_words, consistent)}))
    return TwoMotions(f"several motions go on {here.in_words}: {names} are all consistent; the model needs compliance "
                      "there", here.at.t, here.at.state)


def _why_none(here: Junction) -> str:
    """Return why no motion follows: a contact whose static friction is below the kinetic may neither hold nor slip."""
    ways = [*product(*here.phases)]
    for k in sorted(here.resting):
        contacts = [here.points_in(way)[0].contacts[k] for way in ways]  # both may differ by the direction
        kinetic, static = max(((c.kinetic, c.static) for c in contacts), key=lambda pair: pair[0] - pair[1])
        if kinetic - static > SAME * kinetic:
            friction = here.system.frictions[k]
            if friction.static == branches.with_direction(friction.velocity, friction.kinetic, 0):
                return (f"friction {k + 1}, {float(static):.6g} at rest, is {float(kinetic):.6g} in slip; give static "
                        "friction of at least that")
            return (f"static friction {float(static):.6g} of friction {k + 1} is below the kinetic one, "
                    f"{float(kinetic):.6g}; make it at least that")
    jumps = sides.phases(here.system.rates.values(), here.system.states, here.system.time)
    for k, (friction, choice) in enumerate(zip(here.system.frictions, here.phases, strict=True)):
        for name in ("load", "velocity"):
            if {1, -1} <= {getattr(p, name) for p in choice} and sides.phase_of(getattr(friction, name))[0] in jumps:
                return (f"rates jump where the {name} of friction {k + 1} is 0; write what jumps there as its own "
                        "friction")
    names = ", ".join(dict.fromkeys(map(branches.mode_name, ways)))
    return f"none of {names} is consistent; the model needs compliance there"


def _loaded(system: System, branch: Branch, still: list[int]) -> Branch:
    """Return the branch with a contact open if its ``lift_off`` stays 0, and with its load positive if this stays 0."""
    guards, kinds = all_guards(mode_of(system, branch)), ("lift_off", "force_zero")
    open_, idle = ({guards[k].friction for k in still if guards[k].kind == kind} for kind in kinds)
    return tuple(OPEN if k in open_ else phase._replace(load=1) if k in idle else phase
                 for k, phase in enumerate(branch))


def _in_words(branch: Branch) -> str:
    signs = {1: "velocity > 0", -1: "velocity < 0"}
    return "+".join(f"{p.mode} ({signs[p.velocity]})" if p.slips else p.mode for p in branch)
