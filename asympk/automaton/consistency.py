"""Test which combinations of phases are consistent at a point where quantities vanish.

With r = +-1 the sign of the load and s = +-1 that of the velocity v, a branch must keep, for each contact,

    slip     s v > 0 (s v' > 0 where v = 0),  r load > 0          stick    static r load +- F > 0
    closed   -gap > 0 (normal > 0 if rigid)                       open     gap > 0 (gap'' > 0 if rigid and touching)

``admissible`` returns the branches in which none of these margins is negative. ``staying`` looks at the derivatives of
those that vanish: the first that is not 0 must be positive. ``decide`` chooses among the branches that pass both.
"""

import math
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache
from itertools import chain, islice, product
from time import monotonic
from typing import Any

import sympy as sp

from asympk.automaton import contacts
from asympk.automaton.contacts import ContactPoint, Place, Solved
from asympk.automaton.junction import Junction
from asympk.automaton.kept import is_kept_gap, vanish_on_plane
from asympk.automaton.modes import GuardedMode, mode_of
from asympk.automaton.motionseries import derivatives_along
from asympk.errors import InputError, Undecided, Unfinished
from asympk.symbolic import branches
from asympk.symbolic.branches import Branch, Guard, Phase
from asympk.symbolic.forces import is_carried
from asympk.symbolic.guards import asks_for_signs
from asympk.symbolic.long import replaced, symbols_in
from asympk.symbolic.penetration import with_finite_powers
from asympk.symbolic.system import System

ORDERS = 5  # least number of derivatives in symbols by which it is decided whether what vanishes stays 0
LONGEST = 5_000  # operations of the longest derivative of a guard that is differentiated once more in symbols
HIGHEST = 16  # order of the last derivative that is computed in numbers
MOST = 8  # largest number of undecided frictions whose combinations of phases are all tried
PIVOTS = 500  # of a group of frictions; about as many as there are frictions lead to the solution
CLEARLY = 1e-6  # least eigenvalue of a symmetric part that counts as positive
Tried = dict[Branch, list[tuple] | None]
Choice = tuple[dict[int, Phase], list[tuple] | None]  # phases of a group, and the keys of guards that vanish
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)


@contextmanager
def decided_by(deadline: float) -> Iterator[None]:
    """Let ``require_time_left`` raise ``Unfinished`` within once ``time.monotonic`` is beyond the ``deadline``."""
    token = _deadline.set(deadline)
    try:
        yield
    finally:
        _deadline.reset(token)


def require_time_left(here: Junction) -> None:
    """Raise ``Unfinished`` after the deadline of ``decided_by``."""
    if monotonic() > _deadline.get():
        raise Unfinished(f"time limit reached where the motion is chosen among many {here.in_words}; allow more "
                         "seconds, or move the start a little, so that fewer quantities are 0 at once")


def admissible(here: Junction) -> Tried:
    """Return the branches in which no guard is negative, with the keys of the guards that vanish.

    A branch has one of the choices of ``_fitting`` for each group of coupled frictions. A branch whose forces are not
    determined is kept, with None in place of the keys.
    """
    fitting = _without_falling(here, [_fitting(here, group) for group in contacts.coupled(here.system)])
    require_few(math.prod(map(len, fitting)), sum(len(choices) > 1 for choices in fitting))
    found: Tried = {}
    for choice in product(*fitting):
        phases = {k: phase for own, _ in choice for k, phase in own.items()}
        keys = [ties for _, ties in choice if ties is not None]
        found[tuple(phases[k] for k in sorted(phases))] = [*chain(*keys)] if len(keys) == len(choice) else None
    return found


def _without_falling(here: Junction, fitting: list[list[Choice]]) -> list[list[Choice]]:
    """Return the choices of groups without those in which a guard falls whatever the other groups choose.

    The choices of one group after the other are then few, where all combinations of them would be many.
    """
    sizes = [len(choices) for choices in fitting if len(choices) > 1]
    determined = all(ties is not None for choices in fitting for _, ties in choices)
    if math.prod(map(len, fitting)) <= sum(sizes) or not determined or asks_for_signs(here.system):
        return fitting
    base = {k: phase for choices in fitting for k, phase in choices[0][0].items()}
    steady = {force for group, choices in zip(contacts.coupled(here.system), fitting, strict=True)
              for force in _steady(here, group, [_with_phases(here, base | own) for own, _ in choices])}
    return [[(own, ties) for own, ties in choices
             if not (ties and len(choices) > 1 and _falls_alone(here, base | own, own.keys(), ties, steady))]
            for choices in fitting]


def _steady(here: Junction, group: tuple[int, ...], choices: list[Branch]) -> Iterator[sp.Symbol]:
    """Yield the forces of a group that are alike, within rounding, in all of its choices."""
    first, *others = ([here.solved(b, group, n) for n in range(len(here.points_in(b)))] for b in choices)
    for force in _forces_of(here.system, group):
        apart = ([a.forces[force] - b.forces[force] for a, b in zip(first, own, strict=True) if a and b]
                 for own in others)
        if not any(map(here.numbers.decided_sign, apart)):
            yield force


def _falls_alone(
    here: Junction, phases: dict[int, Phase], own: Collection[int], ties: list[tuple], steady: set[sp.Symbol]
) -> bool:
    """Tell whether one of the vanishing guards of contacts ``own`` falls whatever the phases of all other contacts.

    Its first derivative that is not 0 may contain derivatives of the own forces alone, and of others only values that
    are ``steady``.
    """
    mode = mode_of(here.system, _with_phases(here, phases))
    with suppress(Undecided):
        if fallen := _ties_that_grow(here, mode, [k for k, guard in enumerate(mode.guards) if guard.key in ties])[1]:
            guard, order = fallen
            symbols = _symbols_of_derivatives(here.system, mode.guards[guard].friction)
            *_, before, last = set[sp.Symbol](), *islice(symbols, order + 1)
            others = {*here.system.pushes} - {*_forces_of(here.system, own)}
            return not (before & others or last & others - steady)
    return False


def _forces_of(system: System, group: Collection[int]) -> list[sp.Symbol]:
    return [force for k in sorted(group) for force in (system.frictions[k].force, system.frictions[k].normal) if force]


def _symbols_of_derivatives(system: System, k: int) -> Iterator[set[sp.Symbol]]:
    """Yield the symbols that may be in a guard of contact k and in its derivatives of order 1, 2, and so on."""
    friction, inside = system.frictions[k], _symbols_of_rates(system)
    found = symbols_in(sp.Tuple(*friction.parts.values(), *_forces_of(system, [k])))
    while True:
        yield found
        found = found.union(*(inside[s] for s in found & inside.keys()))


@lru_cache(maxsize=64)
def _symbols_of_rates(system: System) -> dict[sp.Symbol, set[sp.Symbol]]:
    """Return the symbols that may be in the rate of each state, and in the derivative of each force."""
    found = {s: symbols_in(rate) for s, rate in system.rates.items()}
    for group in contacts.coupled(system):
        frictions = [system.frictions[k] for k in group]
        parts = [e for f in frictions for e in (*f.parts.values(), branches.rate_along(system, f.velocity))]
        found |= dict.fromkeys(_forces_of(system, group), symbols_in(sp.Tuple(*parts)))
    return found


def _fitting(here: Junction, group: tuple[int, ...]) -> list[Choice]:
    """Return the choices of phases of a group in which no guard is negative, and the keys of those that vanish.

    Where all of a group that may rest can, with margins that are positive, static friction holds the group, if it draws
    the velocities to 0. Where friction has one solution, what is not at its bound has one phase (Lemma 19).
    """
    choices = {k: here.phases[k] for k in group}
    undecided = [k for k in group if len(choices[k]) > 1]
    holds = not any(("slip_onset", k) in here.lost or len({p.load for p in here.phases[k]}) > 1 for k in group)
    rest = {k: choice[0] for k, choice in choices.items()}
    if holds and undecided and all(rest[k].mode == "stick" for k in undecided):
        branch = _with_phases(here, rest)
        if _ties(here, branch, group) == [] and _attracts(here, branch, group):
            return [(rest, [])]
    if len(undecided) > 1 and _has_one_solution(here, group, undecided) and (solution := _pivoted(here, group, rest)):
        own, tied = solution
        choices |= {k: [own[k]] for k in undecided if k not in tied}
    open_choices = [choice for choice in choices.values() if len(choice) > 1]
    require_few(3 ** len(open_choices), len(open_choices))
    found = []
    for phases in product(*choices.values()):
        own = dict(zip(group, phases, strict=True))
        branch = _with_phases(here, own)
        ties = _ties(here, branch, group)
        if ties is not None or here.solved(branch, group) is None:
            found.append((own, ties))
    return found


def _with_phases(here: Junction, own: dict[int, Phase]) -> Branch:
    """Return a branch with the phases of a group, and the first ones of all others."""
    return tuple(own.get(k, choice[0]) for k, choice in enumerate(here.phases))


def _has_one_solution(here: Junction, group: tuple[int, ...], undecided: list[int]) -> bool:
    """Tell whether friction at rest has one solution: bounds without forces, and G with a positive symmetric part.

    G are the coefficients of the undecided forces in the rates of their velocities, in units in which its diagonal is 1
    (Lemma 19). Static and kinetic friction are alike, and neither they nor the rates jump with a direction of sliding.
    """
    import numpy as np

    forced = (here.system.frictions[k].rigid or here.points[0].contacts[k].pushed for k in group)
    if any(forced) or contacts.feels_directions(here.system):
        return False
    if any([(p.mode, p.load) for p in here.phases[k][:1]] != [("stick", here.phases[k][-1].load)] for k in undecided):
        return False
    bounds = (point.contacts[k] for point in here.points for k in undecided)
    if any(contact.kinetic < 0 or contact.static != contact.kinetic for contact in bounds):
        return False
    unknowns = here.system.pushes
    places = [1 + unknowns.index(here.system.frictions[k].force) for k in undecided]
    G = np.array([[here.points[0].rows[k][j] for j in places] for k in undecided], dtype=float)
    sizes = np.sqrt(np.abs(G.diagonal()))
    return bool(sizes.all() and np.linalg.eigvalsh((G + G.T) / np.outer(sizes, sizes))[0] > CLEARLY)


def _pivoted(here: Junction, group: tuple[int, ...], own: dict[int, Phase]) -> tuple[dict[int, Phase], set[int]] | None:
    """Return the phases of a group in which no guard is negative, and the frictions of those that vanish; None if lost.

    From rest on, the first friction that has a negative guard changes its phase (Murty 1974).
    """
    for _ in range(PIVOTS):
        margins = _margins(here, _with_phases(here, own), group)
        signs = {key: here.numbers.decided_sign(values) for key, values in (margins or {}).items()}
        wrong = next((key for key, sign in signs.items() if sign < 0), None)
        if wrong is None:
            return (own, {k for (_, k, _), sign in signs.items() if not sign}) if signs else None
        kind, k, backward = wrong
        velocity = 0 if kind == "velocity_zero" else -1 if backward else 1
        own = own | {k: own[k]._replace(velocity=velocity)}
    return None


def _attracts(here: Junction, branch: Branch, group: tuple[int, ...]) -> bool:
    """Tell whether velocities of a group at rest grow with the friction that holds it: else, slip grows as well."""
    solved, smooth = here.solved(branch, group), solved_without_friction(here, branch, group)
    return bool(solved and smooth and solved.determinant * smooth.determinant > 0)


def require_few(combinations: int, undecided: int) -> None:
    """Raise ``InputError`` for too many combinations of the phases of frictions."""
    if combinations > 3**MOST:
        raise InputError(f"{undecided} frictions are undecided at once; combinations are tried for at most {MOST}")


def _unloaded(here: Junction, branch: Branch) -> set[int]:
    """Return the rigid contacts whose reaction has just vanished, each if no other contact changes in ``branch``.

    Their reaction then vanishes in ``branch``, too. It is a force, and moving the state makes it 0 only to rounding. A
    reaction that has jumped away from 0 does not vanish.
    """
    rigid = [k for kind, k in here.lost if kind == "force_zero" and here.system.frictions[k].rigid]
    changed = {k for k, was in enumerate(branches.bare(here.before or ())) if was != branch[k]} if rigid else set[int]()
    return {k for k in rigid if changed <= {k} and not here.has_jumped(k)}


def _ties(here: Junction, branch: Branch, group: tuple[int, ...]) -> list[tuple] | None:
    """Return the keys of a group's guards that vanish; None if one is negative, or forces are not determined."""
    leapt = {k: sign for k, sign in here.jumped(branch).items() if k in group and not branch[k].is_open}
    if any(branch[k].velocity != sign for k, sign in leapt.items()):
        return None
    if (margins := _margins(here, branch, group)) is None:
        return None
    ties, unloaded = [], _unloaded(here, branch)
    for key, values in margins.items():
        vanishes = key[0] == "force_zero" and key[1] in unloaded
        sign = 0 if vanishes else here.numbers.decided_sign(values)
        if sign < 0:
            return None
        if sign == 0:
            ties.append(key)
    return ties


def all_guards(mode: GuardedMode) -> tuple[Guard, ...]:
    """Return the guards of a mode, the fixed ones last."""
    return (*mode.guards, *mode.fixed_guards)


def _margins(here: Junction, branch: Branch, group: tuple[int, ...]) -> dict[tuple, list] | None:
    """Return the margins of a group at all points by ``Guard.key``, or None where its forces are not determined.

    They are not where the rounding of the state could make the determinant of their equations 0, as at a dead centre.
    """
    solutions = []
    points = here.points_in(branch)
    for k in range(len(points)):
        if (own := here.solved(branch, group, k)) is None:
            return None
        solutions.append(own)
    if contacts.is_open([own.determinant for own in solutions]):
        return None
    jumped = here.jumped(branch)
    margins = [_margins_at(here, branch, jumped, group, n, solved) for n, solved in enumerate(solutions)]
    found = {key: [m[key] for m in margins] for key in margins[0]}
    return found | {key: _in_bounds(found, key) for key in found if key[0] == "slip_onset"}


def _in_bounds(margins: dict[tuple, list], key: tuple) -> list:
    """Return a margin of stick over twice the bound of friction: its rounding is that of the bound, in any units."""
    kind, k, _ = key
    size = sum(abs(margins[kind, k, way][0]) for way in (False, True))
    return [value / size for value in margins[key]] if size else margins[key]


def _margins_at(
    here: Junction, branch: Branch, jumped: Collection[int], group: tuple[int, ...], n: int, solved: Solved
) -> dict[tuple, Any]:
    """Return the values of the guards at point ``n`` by ``Guard.key``; for a vanishing velocity it is its rate."""
    point, forces = here.points_in(branch)[n], (1, *solved.forces.values())
    found: dict[tuple[str, int, bool], Any] = {}
    for k in group:
        friction, phase, contact = here.system.frictions[k], branch[k], point.contacts[k]
        if phase.is_open:
            found["touch_down", k, False] = _opening(here, k, point, forces)
            continue
        load = contact.load_under(forces)
        if friction.gap is not None:
            reaction = solved.forces.get(friction.normal)
            found["lift_off", k, False] = reaction if friction.rigid else -contact.gap
        if phase.velocity == 0:
            for side, begun in zip((1, -1), here.beginning(branch, k, n), strict=True):
                bound = begun.static * phase.load * begun.load_under(forces)
                found["slip_onset", k, side < 0] = bound + side * solved.forces[friction.force]
        elif phase.slips:
            if not branches.lifts(friction):
                found["force_zero", k, False] = phase.load * load
            rate = contacts.row_at(point.rows[k], forces)
            vanishes = k in here.resting and k not in jumped
            found["velocity_zero", k, False] = phase.velocity * (rate if vanishes else contact.velocity)
    return found


def margins_at_state(here: Junction, branch: Branch) -> list[Any]:
    """Return the margins of a branch at the state itself, or none where its forces are not determined.

    A load of reactions that are all of open contacts is 0 in the whole branch, and no margin.
    """
    found: list[Any] = []
    for group in contacts.coupled(here.system):
        if (solved := here.solved(branch, group)) is None:
            return []
        margins = _margins_at(here, branch, here.jumped(branch), group, 0, solved)
        found += [margin for (kind, k, _), margin in margins.items()
                  if kind != "force_zero" or not _is_unloaded(here.system, branch, k)]
    return found


def _is_unloaded(system: System, branch: Branch, k: int) -> bool:
    """Tell whether the load of friction k consists of reactions of contacts that are open in a branch."""
    absent = {f.normal: sp.S.Zero for f, phase in zip(system.frictions, branch, strict=True) if phase.is_open}
    return replaced(system.frictions[k].load, absent) == 0


def breaks_loose(here: Junction, branch: Branch) -> bool:
    """Tell whether a contact slips in a branch that static friction would hold if every contact that may rest did.

    A contact held with nothing to spare is not held if rest would go on but for its margin, which falls. None of a
    group is held if then a load would have the other sign, or an open contact would close.
    """
    resting = here.resting - here.jumped(branch).keys()
    rest = tuple(p._replace(velocity=0) if k in resting and not p.is_open else p for k, p in enumerate(branch))
    loose, signs = {k for kind, k in here.lost if kind == "slip_onset"}, dict[tuple, int]()
    for group in contacts.coupled(here.system):
        if (margins := _margins(here, rest, group)) is None:
            loose |= {*group}
        else:
            found = {key: here.numbers.decided_sign(values) for key, values in margins.items()}
            signs |= {key: sign for key, sign in found.items() if key[0] == "slip_onset"}
            if any(sign < 0 for key, sign in found.items() if key[0] != "slip_onset"):
                loose |= {*group}
    breaking = {key for key, sign in signs.items() if sign < 0}
    loose |= {k for _, k, _ in breaking or (key for key, sign in signs.items() if not sign and _falls(here, rest, key))}
    return any(a != b and k not in loose for k, (a, b) in enumerate(zip(branch, rest, strict=True)))


def _falls(here: Junction, branch: Branch, key: tuple) -> bool:
    """Tell whether a guard that vanishes, of a branch whose forces are determined, is negative shortly afterwards."""
    return here.is_determined(branch) and staying(here, mode_of(here.system, branch), [key]) is None


def _opening(here: Junction, k: int, point: ContactPoint, forces: tuple) -> Any:
    """Return the value that must be positive for a contact to be open: its gap, or g'' for a rigid one that touches.

    g'' is taken without the reaction of this contact, but with the forces of the others. Where the reaction has just
    vanished, and has not jumped away from 0, the value is 0, so that ``signs_of_derivatives`` decides by g'''.
    """
    if not here.system.frictions[k].rigid:
        return point.contacts[k].gap
    if k not in here.touching:
        return abs(point.contacts[k].gap)
    if here.touching[k] and not here.has_jumped(k):
        return 0
    return contacts.row_at(contacts.gap_row(here.system, k, point), forces)


def staying(here: Junction, mode: GuardedMode, keys: list[tuple]) -> list[int] | None:
    """Return the vanishing guards, fixed ones included, all of whose computed derivatives vanish, or None if one falls.

    ``keys`` are the keys of the guards that vanish.
    """
    ties = [k for k, guard in enumerate(all_guards(mode)) if guard.key in keys]
    if mode.pressed and any(v < 0 for v in here.at.values(mode.system, mode.conditions)):
        return None  # a condition is a margin divided by the penetration: the margin is negative once there is one
    grown, fallen = _ties_that_grow(here, mode, [k for k in ties if k < len(mode.guards)])
    return None if fallen else [k for k in ties if k not in grown]


def _ties_that_grow(here: Junction, mode: GuardedMode, ties: list[int]) -> tuple[set[int], tuple[int, int] | None]:
    """Return the vanishing guards that grow, and the first one that falls with the order of its derivative, or None."""
    pending, grown, step = _signs_by_guard(here, mode, ties), set[int](), 0
    while pending:  # one derivative of each at a time: those of a guard that stays 0 grow long
        signs = {k: next(growth, None) for k, growth in pending.items()}
        if fallen := [k for k, sign in signs.items() if sign == -1]:
            return grown, (fallen[0], _first_order(here, mode, fallen[0]) + step)
        grown |= {k for k, sign in signs.items() if sign == 1}
        pending, step = {k: growth for k, growth in pending.items() if signs[k] == 0}, step + 1
    return grown, None


def _signs_by_guard(here: Junction, mode: GuardedMode, ties: list[int]) -> dict[int, Iterator[int]]:
    """Return ``signs_of_derivatives`` by guard; one function has all first ones, as each alone has the whole field."""
    joint = () if mode.pressed else tuple(k for k in ties if _first_order(here, mode, k) == 1)
    values = tuple(mode.derivative(k, 0) for k in joint)
    rows = [place.values(mode.system, values, (mode.flow,)) for place in here.places if joint]
    slopes = dict(zip(joint, zip(*rows, strict=True), strict=True))
    return {k: iter(()) if _is_carried(mode, k) else signs_of_derivatives(here, mode, k, slopes.get(k)) for k in ties}


def _first_order(here: Junction, mode: GuardedMode, guard: int) -> int:
    """Return the order of the first derivative that tells: of a contact that touches, g, g' and g'' vanish.

    The rate of a velocity that vanishes has been found to vanish with it, as a margin of its contact (``_margins_at``).
    In another sum, terms that are smaller than all rounding may be left of it.
    """
    kind, friction, _, _, divided = mode.guards[guard]
    if kind == "velocity_zero" and not mode.pressed:
        return 2
    return 3 if kind == "touch_down" and friction in here.touching else 1 - divided


def signs_of_derivatives(here: Junction, mode: GuardedMode, guard: int, slopes: tuple | None = None) -> Iterator[int]:
    """Yield the signs of the derivatives of a vanishing guard along the field, as far as they are computed.

    Powers of the penetration are left out of each derivative (Lemma 11); one with infinite powers is first multiplied
    by a power that makes them finite. ``slopes`` are the first derivatives at all places, where they are known. The
    derivatives after ``ORDERS``, or after a long one, are those of a series. Raises ``Undecided`` if all vanish and
    one is long: that those of a pulse are 0 in numbers does not show that it is none.
    """
    first, system = _first_order(here, mode, guard), mode.system
    last = max(ORDERS, mode.order_in_time) if system.time else min(len(system.states), ORDERS)
    for order in range(first, 2 + last):
        if order > first and _length(mode.derivative(guard, order - (1 if mode.pressed else 2))) > LONGEST:
            yield from _signs_in_series(here, mode, guard, order)
            return
        for values in [slopes] if slopes and order == 1 else _derivatives(here, mode, guard, order):
            if values[0] != values[0]:  # oo - oo, as of roots, has no sign
                raise OverflowError
            yield here.numbers.decided_sign(values)
        if order == first and stays(here, mode, guard):
            return
    with suppress(Undecided):
        yield from _signs_in_series(here, mode, guard, 2 + last)


def _signs_in_series(here: Junction, mode: GuardedMode, guard: int, first: int) -> Iterator[int]:
    """Yield the signs of the derivatives of a guard from the order ``first`` to ``HIGHEST``, from its series.

    One that is 0 as a double has the sign 0. Raises ``Undecided`` at the end, or if there is no series.
    """
    kind, _, value, *_ = mode.guards[guard]
    with suppress(InputError, ArithmeticError, ValueError):
        for (values,) in islice(_along(here, mode, (value,)), first, HIGHEST + 1):
            yield here.numbers.decided_sign(values) if float(values[0]) else 0
    raise Undecided(f"{kind} of {mode.name} vanishes at t = {float(here.at.t):.6g} with its first {first - 1} "
                    "derivatives, or more; move the start a little, as an angle by 1e-6")


def _along(here: Junction, mode: GuardedMode, exprs: tuple[sp.Expr, ...]) -> Iterator[list[tuple]]:
    """Yield the values, at all places, of expressions and of their derivatives along the motion of a mode."""
    series = (derivatives_along(mode, place, exprs) for place in here.places)
    return ([*zip(*rows, strict=True)] for rows in zip(*series, strict=True))


def vanish_along(here: Junction, mode: GuardedMode, exprs: tuple[sp.Expr, ...]) -> bool:
    """Tell whether expressions are 0 on the motion of a mode: on a plane that it keeps, or with all derivatives.

    Derivatives are asked where a contact is rigid: how redundant contacts share a load may not matter to the motion,
    as all of their friction acts along one line. Laws of friction that come to differ may not do so in derivatives.
    """
    if not any(friction.rigid for friction in here.system.frictions):
        return vanish_on_plane(here, mode, exprs)
    if not _have_one_law(here.system):
        return False
    with suppress(InputError, ArithmeticError, ValueError):
        rows = islice(_along(here, mode, exprs), HIGHEST + 1)
        return not any(map(here.numbers.decided_sign, chain.from_iterable(rows)))
    return False


def _have_one_law(system: System) -> bool:
    """Tell whether all kinetic friction is by one formula of the reaction, or by numbers alone."""
    laws = {f.kinetic * replaced(f.load, {f.normal: sp.S.One}) for f in system.frictions} - {sp.S.Zero}
    return len(laws) == 1 or symbols_in(sp.Tuple(*laws)) <= {*system.parameters}


def _derivatives(here: Junction, mode: GuardedMode, guard: int, order: int) -> Iterator[list]:
    """Yield the values, at all places, of a derivative of a guard, first of one with finite powers."""
    asked: list[tuple[tuple, tuple]] = [((mode.derivative(guard, max(order - 1, 0)),), (mode.flow,))]
    if mode.pressed or not order:
        found = mode.derivative(guard, order)
        asked = [((expr,), ()) for expr in dict.fromkeys((with_finite_powers(found), found))]
    for part in asked:
        yield [place.values(mode.system, *part)[0] for place in here.places]


def stands_still(here: Junction, mode: GuardedMode) -> bool:
    """Tell whether all rates of a mode vanish now and later: all modes that stand still have the same motion."""
    return mode.system.time is None and all_vanish(here, mode.rates)


def stays(here: Junction, mode: GuardedMode, guard: int) -> bool:
    """Tell whether a guard that vanishes stays 0: others carry it, all behind it rests, or the mode keeps its zeros."""
    if _is_carried(mode, guard):
        return True
    kind, friction, value, *_ = mode.guards[guard]
    if kind == "touch_down" and friction in here.touching and is_kept_gap(here, mode, value):
        return True
    rates = mode.rates_behind(value)
    still = (rates is not None and all_vanish(here, rates)) or mode.keeps(value)
    return still or vanish_on_plane(here, mode, (value,))


def _is_carried(mode: GuardedMode, guard: int) -> bool:
    """Tell whether a guard is the velocity of a contact that others at rest carry, so that its derivatives are 0."""
    kind, friction, *_ = mode.guards[guard]
    return kind == "velocity_zero" and is_carried(mode.system, branches.bare(mode.branch), friction)


def all_vanish(here: Junction, exprs: tuple[sp.Expr, ...], places: tuple[Place, ...] = ()) -> bool:
    """Tell whether expressions are 0 to rounding at places, those of the junction unless others are given."""
    rows = (place.values(here.system, exprs) for place in places or here.places)
    return not any(map(here.numbers.decided_sign, zip(*rows, strict=True)))


_length = lru_cache(maxsize=256)(sp.count_ops)


def solved_without_friction(here: Junction, branch: Branch, group: Collection[int]) -> Solved | None:
    """Return the reactions of a group at the state itself as if no contact had friction, or None if undetermined."""
    point = here.points_in(branch)[0]
    smooth = point._replace(contacts=tuple(c._replace(kinetic=0, static=0) for c in point.contacts))
    sliding = tuple(phase if phase.is_open else phase._replace(velocity=1) for phase in branch)
    return contacts.solved_forces(here.system, sliding, smooth, here.numbers, group)


def choices(here: Junction) -> Iterator[tuple[Branch, tuple[int, ...]]]:
    """Yield (branch, group) with every choice of phases of each group of coupled frictions; other phases do not matter.

    Raises ``InputError`` for too many.
    """
    for group in contacts.coupled(here.system):
        phases = [here.phases[k] for k in group]
        require_few(math.prod(map(len, phases)), sum(len(choice) > 1 for choice in phases))
        for own in product(*phases):
            yield _with_phases(here, dict(zip(group, own, strict=True))), group


def is_stiff(here: Junction, branch: Branch, group: tuple[int, ...]) -> bool:
    """Tell whether the determinant of a group has the sign that it has without friction, where that determines forces.

    Contacts at rest that share a velocity have the determinant 0.
    """
    own, smooth = here.solved(branch, group), solved_without_friction(here, branch, group)
    if own is None or smooth is None:
        return smooth is None or bool(branches.at_rest(branch) & {*group})
    return own.determinant * smooth.determinant > 0
