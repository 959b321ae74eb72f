"""The elastic, damped contact: a slow-fast system in the compliance for any number of degrees of freedom.

A spring 1/c beside a damper h/c makes the reaction R = (d + h d')/c of the penetration d = -g. With x = d/c,

    x' = y,    c y' = -(a_N + G_NN R + G_NT F),    z' = a_T + G_NT R + G_TT F,    R = x + h y,

with the sliding velocity z; a unilateral contact has R = max(0, x + h y). With c = eps^2 and h = b eps (b is fixed, and
0 without damping) both x and y = eps x' are fast, R = x + b y and g' = -eps y. The velocities are (-c y, z, w), where w
are the rates that complete g' and gamma to a basis (``basis_of``). All coordinates are states: g(q) + c x is constant.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import sympy as sp

from asympk.automaton.junction import BY_HAND
from asympk.errors import InputError, NotDerivable
from asympk.mechanics.checks import departures, require_continuous, require_own_symbols
from asympk.mechanics.evaluation import exactly_at
from asympk.mechanics.kinetics import Kinetics, slope_in_powers
from asympk.numbers import number, short
from asympk.symbolic.long import replaced
from asympk.symbolic.reading import exact_constant, expression, real_expression, unused_symbol
from asympk.symbolic.system import Friction, System
from asympk.symbolic.tidy import multiplied_out, tidy, vanishes


def elastic(contacts: Sequence[Kinetics], compliance: Any, damping: Any) -> System:
    """Return the ``System`` with the states: coordinates, x, the rates w, fast y, and z.

    ``contacts`` are the equations of one mechanism for each of its contacts. Further ones have x2, y2, x3, ..., and
    with these there is no z, nor a y for a gap rate that depends on those before. ``compliance`` is a Symbol c with
    ``damping`` a time h > 0, or ``eps**2`` with ``damping`` a multiple of eps, 0 included. A state or force whose name
    is taken by a coordinate or parameter gets an underscore. Raises ``InputError`` for other scalings, ``NotDerivable``
    if a contact's formulas jump, or if its gap moves with the time while others are held on which it depends.
    """
    law = scaling(compliance, damping)
    used = {s for kinetics in contacts for s in kinetics.symbols}
    if law.small.name in map(str, used):
        raise InputError(f"compliance = {compliance}: the mechanism has a {law.small} already; take another Symbol")
    require_own_symbols("damping", damping, used)
    for kinetics in contacts:
        formulas = (kinetics.gap, kinetics.gap_rate, kinetics.slip)
        require_continuous(kinetics, formulas, "gap, gap rate or sliding velocity")
    return _elastic_system(contacts, law)


@dataclass(frozen=True)
class Scaling:
    """The elastic contact by the small parameter: R = x + ``ratio`` y, g' = -``small`` y, with a slow or ``fast`` x.

    For a fixed b in h = b eps, x is fast, x' = y / eps.
    """

    small: sp.Symbol
    ratio: sp.Expr
    fast: bool


def scaling(compliance: Any, damping: Any) -> Scaling:
    """Return the ``Scaling`` of a contact; raises ``InputError`` for a compliance and a damping without one."""
    compliance, damping = expression("compliance", compliance), real_expression("damping", damping)
    if (not damping.is_finite and damping.is_number) or damping.is_negative:
        raise InputError(f"damping = {short(damping)}: it must be zero or positive")
    if isinstance(compliance, sp.Symbol):
        if vanishes(damping) or damping.has(compliance):
            raise InputError(
                f"damping = {damping} with compliance = {compliance}: give a time that does not depend on it, or "
                "compliance=eps**2 with damping=0 or a multiple of eps"
            )
        return Scaling(compliance, damping, fast=False)
    small = compliance.base if compliance.is_Pow and compliance.exp == 2 else None
    if not isinstance(small, sp.Symbol):
        raise InputError(f"compliance = {short(compliance)}: it must be a Symbol or the square of one, in a file its "
                         "name, such as c; its number stands among the values, in a file under [values]")
    ratio = _multiple(damping, small)
    if ratio.has(small) or ratio.is_negative:
        raise InputError(f"damping = {damping} with compliance = {compliance}: give 0 or a positive multiple of "
                         f"{small}")
    return Scaling(small, ratio, fast=True)


def _multiple(damping: sp.Expr, small: sp.Symbol) -> sp.Expr:
    """Return a damping over the positive ``small``, piece by piece where it is given in pieces or as a largest value.

    The result contains ``small`` unless the damping is a multiple of it.
    """
    unit = sp.Dummy(small.name, positive=True)

    def over(part: sp.Expr) -> sp.Expr:
        if not (whole := sp.cancel(part / unit)).has(unit):
            return whole
        if isinstance(part, sp.Piecewise):
            return sp.Piecewise(*((over(piece), where) for piece, where in part.args))
        if isinstance(part, sp.Add | sp.Max | sp.Min):
            return part.func(*map(over, part.args))
        free, moved = part.as_independent(unit, as_Add=False)
        return whole if free == 1 else free * over(moved)

    return over(damping.subs(small, unit)).subs(unit, small)


def _elastic_system(contacts: Sequence[Kinetics], scaling: Scaling) -> System:
    first, basis, alone = contacts[0], basis_of(contacts), len(contacts) == 1
    taken = (scaling.small, *scaling.ratio.free_symbols)
    states = [names_of_contact("xyz", contacts, k, *taken) for k in range(len(contacts))]
    z = states[0][2]
    closings = _closings(contacts, basis, [y for _, y, _ in states])
    known = [-scaling.small * states[k][1] for k in basis.held] + [z] * alone
    if _lasts(first, basis):
        rates, places, dependent = velocities(first, basis, known), basis.rest, {}
    else:
        rates, places, dependent = {}, tuple(range(len(first.velocities))), {z: first.slip} if alone else {}
        dependent |= {states[k][1]: -contacts[k].gap_rate / scaling.small for k in basis.held}
    put = lambda expr: first.tidy_if_short(replaced(expr, rates))  # noqa: E731
    frictions = []
    for k, (kinetics, (x, _, _), y) in enumerate(zip(contacts, states, closings, strict=True)):
        slip, names = z if alone else put(kinetics.slip), names_of_contact("NF", contacts, k, *taken)
        frictions.append(_friction(kinetics, x + put(scaling.ratio) * y, slip, names, put))
    pushes = [push for f in frictions for push in (f.load if f.normal is None else f.normal, f.force)]
    gaps, slips, others = accelerations(contacts, places, pushes, put)
    slow = {q: put(u) for q, u in zip(first.coordinates, first.velocities, strict=True)}
    pressing = {x: y for (x, _, _), y in zip(states, closings, strict=True)}
    fast = {states[k][1]: -gaps[k] for k in basis.held}
    slow, fast = (slow, pressing | fast) if scaling.fast else (slow | pressing, fast)
    slow, last = slow | others, dict(zip([z] * alone, slips, strict=True))
    timed = any(k.timed for k in contacts) or scaling.ratio.has(first.time)
    found = System.with_frictions(slow | last, fast, frictions, scaling.small, first.time if timed else None)
    return replace(found, states=(*slow, *fast, *last), dependent=sp.Dict(dependent))


def _closings(contacts: Sequence[Kinetics], basis: "Basis", names: Sequence[sp.Symbol]) -> list[sp.Expr]:
    """Return y of each contact: its name, or the sum of others of which its gap rate is the sum."""
    found: list[sp.Expr] = [*names]
    for k in sorted({*range(len(contacts))} - {*basis.held}):
        rates = velocities(contacts[k], basis, [-names[held] for held in basis.held])
        still = dict.fromkeys(contacts[k].velocities, 0)
        found[k] = -tidy(replaced(contacts[k].gap_rate, rates).subs(still))
        if not vanishes(found[k].subs(dict.fromkeys(names, 0))):
            raise NotDerivable(f"the gap of contact {k + 1} depends on the gaps before, and moves with the time while "
                               "these are held: its reaction has no limit as the compliance vanishes")
    return found


def _friction(
    kinetics: Kinetics, reaction: sp.Expr, slip: sp.Expr, names: tuple[sp.Symbol, ...],
    put: Callable[[sp.Expr], sp.Expr],
) -> Friction:
    normal, force = names
    kinetic, static = (put(tidy(part * kinetics.load)) for part in (kinetics.friction, kinetics.static))
    opening = {"gap": -reaction} if kinetics.unilateral else {}
    pushed = {"normal": normal} if opening or kinetic == static == 0 else {}  # which makes the latter ``SMOOTH``
    return Friction(slip, force, reaction, kinetic, static, **opening, **pushed)


def pressed(
    contacts: Sequence[Kinetics], system: System, values: dict[sp.Symbol, Any], small: Any
) -> dict[sp.Symbol, Any]:
    """Return the states x and y of a start off g = g' = 0, from g = -c x and g' = -c y (or g' = -eps y, c = eps^2).

    ``small`` is the value of c or eps; ``values`` give all other states. Raises ``InputError`` if ``small`` is missing,
    and for a start above a unilateral contact that pushes already, with a damping time h below the gap h |g'|.
    """
    found: dict[sp.Symbol, Any] = {}
    above = []
    for k, kinetics in enumerate(contacts):
        x, y = names_of_contact("xy", contacts, k, *system.parameters)
        if x not in system.states or not (off := departures(kinetics, values)):
            continue
        off_by = ", ".join(f"{name} = {value:g}" for name, value in off.items())
        which = f"contact {k + 1}" if k else "the contact"
        if small is None:
            raise InputError(f"the start is off {which}, {off_by}; give {system.small} among the values, from "
                             "which the reaction follows, or coordinates and rates with g = g' = 0")
        c: Any = system.small
        scale = number(str(c), small, lambda value: value > 0, "positive")
        placed = {kinetics.time: 0} | values | {c: scale}
        sizes = {"g": (x, kinetics.gap, 1 + (x in system.fast)), "g'": (y, kinetics.gap_rate, 1)}
        found |= {state: exactly_at(-moved / c**power, placed)
                  for name, (state, moved, power) in sizes.items() if name in off and state in system.states}
        if kinetics.unilateral and x in system.slow and off.get("g", 0) > 0:
            above.append((k, x, f"{which}, {off_by}"))
    exact = {state: exact_constant(str(state), value) for state, value in found.items()}
    for k, x, where in above:
        pushes = exactly_at(replaced(-system.frictions[k].gap, exact), {contacts[k].time: 0} | values)
        if pushes > -BY_HAND * exact[x]:  # where it begins to push is known to six digits
            raise InputError(f"the start is above {where}, where its damper pushes already; start it where it "
                             "touches, or give compliance=eps**2")
    return found


def names_of_contact(letters: str, contacts: Sequence[Kinetics], k: int, *others: sp.Symbol) -> tuple[sp.Symbol, ...]:
    """Return a symbol for each of ``letters``, "xyz" for the states of contact ``k`` and "NF" for its forces.

    Those of the second contact have a 2, and so on; a name that is taken gets an underscore.
    """
    taken = [*others, *(s for kinetics in contacts for s in kinetics.symbols)]
    return tuple(unused_symbol(f"{letter}{k + 1 if k else ''}", taken, real=True) for letter in letters)


@dataclass(frozen=True)
class Basis:
    """Velocities by which all are expressed: some with the slopes ``rows`` by all rates, and the rates ``rest``.

    The former are ``drifts`` where all rates are 0, as guides may move with the time. They are the gap rates
    of the contacts ``held``, and the sliding velocity of a contact alone.
    """

    rows: sp.Matrix
    drifts: tuple[sp.Expr, ...]
    rest: tuple[int, ...]
    held: tuple[int, ...]

    @property
    def others(self) -> list[int]:
        """The places of the coordinates whose rates are not among ``rest``."""
        return [k for k in range(self.rows.cols) if k not in self.rest]

    @property
    def determinant(self) -> sp.Expr:
        """The determinant of the basis, a minor of ``rows``."""
        return self.rows[:, self.others].det()


def basis_of(contacts: Sequence[Kinetics], sliding: bool = False) -> Basis:
    """Return the rates g' of contacts, gamma of a contact alone, and the last coordinates that complete them.

    If ``sliding``, gamma of the first is in the basis beside further contacts, too.

    A g' that is a sum of multiples of others, as at a third support of a beam, is left out: its y is the same sum of
    their y, and no state. A basis at all places comes first. If there is none, as for a slider-crank, whose slider
    stands still at a dead centre, w are all rates, and y and z are ``dependent``.
    """
    first, alone = contacts[0], sliding or len(contacts) == 1
    given = [kinetics.gap_rate for kinetics in contacts] + [first.slip] * alone
    rows = sp.Matrix.vstack(*(k.directions[0, :] for k in contacts), first.directions[1, :])
    drifts = [expr.subs(dict.fromkeys(first.velocities, 0)) for expr in given]

    def bases(held: tuple[int, ...]) -> Iterator[Basis]:
        places = [*held, *[len(contacts)] * alone]
        chosen, moved, n = rows.extract(places, [*range(rows.cols)]), tuple(drifts[k] for k in places), rows.cols
        found = (Basis(chosen, moved, rest, held) for rest in reversed([*combinations(range(n), n - len(places))]))
        return (basis for basis in found if not vanishes(basis.determinant))

    held: tuple[int, ...] = ()
    for k in range(len(contacts)):
        held = (*held, k) if len(held) + alone < rows.cols and any(True for _ in bases((*held, k))) else held
    return next((basis for basis in bases(held) if _lasts(first, basis)), None) or next(bases(held))


def _lasts(kinetics: Kinetics, basis: Basis) -> bool:
    """Tell whether a basis is one at all places and times."""
    return all(vanishes(slope_in_powers(basis.determinant, q)) for q in (*kinetics.coordinates, kinetics.time))


def velocities(kinetics: Kinetics, basis: Basis, known: Sequence[sp.Expr]) -> dict[sp.Symbol, sp.Expr]:
    """Return every velocity in terms of the ``known`` values of the first velocities of a basis and its other rates."""
    size, others = len(known), basis.others
    given = [value - drift for value, drift in zip(known, basis.drifts, strict=True)]
    given += [kinetics.velocities[k] for k in basis.rest]
    columns = sp.Matrix.hstack(sp.eye(size), -basis.rows[:, list(basis.rest)])
    minors = (basis.rows[:, others].adjugate() * columns).applyfunc(multiplied_out)
    parts = [sp.Add(*(a * b for a, b in zip(minors[i, :], given, strict=True))) for i in range(size)]
    tidy = kinetics.tidy_if_short
    determinant = tidy(basis.determinant)
    found = {kinetics.velocities[k]: tidy(part / determinant) for k, part in zip(others, parts, strict=True)}
    return {u: found.get(u, u) for u in kinetics.velocities}


def accelerations(
    contacts: Sequence[Kinetics], places: Iterable[int], pushes: Sequence[sp.Expr], put: Callable[[sp.Expr], sp.Expr]
) -> tuple[list[sp.Expr], list[sp.Expr], dict[sp.Symbol, sp.Expr]]:
    """Return each g'', gamma' of a contact alone, and the rates of the velocities at ``places``, under all forces.

    ``pushes`` are the reaction and the friction force of each contact in turn. ``put`` rewrites what is free of them.
    """
    first = contacts[0]

    def driven(free: sp.Expr, row: Sequence[sp.Expr]) -> sp.Expr:
        return sp.Add(put(free), *(part * push for part, push in zip(row, pushes, strict=True)))

    across = [sp.Matrix.hstack(*(kinetics.coupling(other) for other in contacts)) for kinetics in contacts]
    gaps = [driven(kinetics.free[0], G[0, :]) for kinetics, G in zip(contacts, across, strict=True)]
    slips = [driven(first.free[1], across[0][1, :])] if len(contacts) == 1 else []
    response = sp.Matrix.hstack(*(kinetics.response[:, :2] for kinetics in contacts))
    rates = {first.velocities[k]: driven(first.response[k, 2], response[k, :]) for k in places}
    return gaps, slips, rates
