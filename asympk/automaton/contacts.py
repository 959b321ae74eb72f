r"""The contacts of a system at a point, in numbers: velocities, loads, bounds, and the equations of their forces.

At a point the rates of the sliding velocities and the constraints of rigid contacts are linear in the friction forces
and the reactions; a row is the constant and the coefficients of such an expression. A branch says which equation holds
for each contact: v' = 0 in stick, the law of friction in slip, no force where it is open. ``contact_point`` evaluates
the rows, ``contact_equations`` chooses those of a branch, and ``solved_forces`` solves them.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import chain, cycle, repeat
from operator import mul
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy as sp
from sympy.utilities.iterables import connected_components

from asympk.automaton.compiled import function
from asympk.numbers import sign_of
from asympk.symbolic import branches, forces
from asympk.symbolic.branches import Branch
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import atoms, replaced, symbols_in
from asympk.symbolic.system import System

if TYPE_CHECKING:
    from asympk.automaton.automaton import Automaton

Signs = tuple[int | None, ...]  # of sliding velocities that vanish; None for others, all 0 for the empty tuple
LARGE = 2.0**32  # size of states, as of a metre in nanometres, up to which the zeros of others have their rounding
_NUDGES = ((1, -1, 1, -1, 1, -1, 0, 0), (1, 1, -1, -1, 0, 0, 1, -1))  # no two states move alike in both


class ContactNumbers(NamedTuple):
    """The numbers of one friction at a point; its load is ``load`` and what forces and reactions add to it.

    ``pushed`` are the coefficients of these, which may be those of other contacts, each after its place in a row.
    """

    velocity: Any
    kinetic: Any
    static: Any
    gap: Any
    load: Any
    pushed: tuple[tuple[int, Any], ...]

    def load_under(self, forces: Sequence) -> Any:
        """Return the load; ``forces`` begins with 1, the factor of the constant of a row."""
        return self.load + sum([c * forces[j] for j, c in self.pushed]) if self.pushed else self.load


class ContactPoint(NamedTuple):
    """The contacts at a point, and the rows there: of v' for each friction, then of the equation of each reaction."""

    contacts: tuple[ContactNumbers, ...]
    rows: tuple[tuple, ...]


class Solved(NamedTuple):
    """Forces and reactions at a point, and the determinant of their equations."""

    forces: dict[sp.Symbol, Any]
    determinant: Any


class Numbers(NamedTuple):
    """The numbers on which a decision is made: spelling of functions, namespace of functions, and what counts as clear.

    The sign of a value is clear if the value is larger than ``least``. A pivot is clear if it is larger than
    ``singular``, relative to its row. A sign that the ``coarser`` numbers do not confirm is rounding. No value may be
    above ``largest``: the exponent of 2**1e300 is rounded, and two such values would differ as rounding does.
    """

    target: str
    functions: Any
    convert: Any
    least: float
    singular: float = 0.0
    coarser: "Numbers | None" = None
    largest: Any = math.inf

    @property
    def digits(self) -> int | None:
        """The digits of the numbers, None for doubles."""
        return getattr(self.functions, "dps", None)

    def decided_sign(self, values: Sequence) -> int:
        """Return the sign of the first value, or 0 where it is open; raises ``Unclear`` up to the size ``least``."""
        first = values[0]
        if is_open(values):
            return 0
        if abs(first) <= self.least:
            raise Unclear
        return 1 if first > 0 else -1

    def is_singular(self, pivot: Any, row: Sequence) -> bool:
        """Tell whether a pivot is at most the rounding of the largest entry of its row; raises ``Unclear``."""
        largest = max(map(abs, row))
        if 1e-30 * largest < abs(pivot) <= self.singular * largest:
            raise Unclear
        return abs(pivot) <= 1e-30 * largest


class Place(NamedTuple):
    """A time, a state, the parameters and the values of the ``coefficients`` as numbers of one kind."""

    numbers: Numbers
    t: Any
    state: tuple
    p: tuple
    coefficients: tuple[sp.Expr, ...] = ()

    def values(self, system: System, outputs: tuple, directions: tuple = ()) -> tuple:
        """Return the values of expressions here, or their derivatives along directions; raises ``OverflowError``."""
        formulas = function(system, outputs, self.numbers.target, self.numbers.functions, directions,
                            coefficients=self.coefficients)
        found = formulas(self.t, *self.state, *self.p)
        if self.numbers.largest < math.inf and any(abs(value) > self.numbers.largest for value in found):
            raise OverflowError
        return found

    def later(self, span: Any) -> "Place":
        """Return the place of the same state after a ``span`` of time."""
        return self._replace(t=self.t + self.numbers.convert(span))

    def with_nudged(self, slack: Any, least: Any = 0) -> tuple["Place", ...]:
        """Return this place and others in the ``coarser`` numbers, displaced as by ``nudges``."""
        numbers = self.numbers.coarser or self.numbers
        p = tuple(map(numbers.convert, self.p))
        moved = nudges(self.t, self.state, slack, least)
        return (self, *(Place(numbers, numbers.convert(t), tuple(map(numbers.convert, w)), p, self.coefficients)
                        for t, w in moved))


def place_of(automaton: "Automaton", numbers: Numbers, t: Any, state: tuple) -> Place:
    """Return a time and a state of an automaton as a ``Place``."""
    known = automaton.coefficients(numbers.digits)
    own, p = (tuple(map(numbers.convert, values)) for values in (state, (*automaton.values, *known.values())))
    return Place(numbers, numbers.convert(t), own, p, (*known,))


class Unclear(Exception):
    """Raised where the sign of a value in doubles may be wrong."""


DOUBLES = Numbers("math", math, float, 2.0**-20, 2.0**-36)


def is_open(values: Sequence) -> bool:
    """Tell whether the first value's sign is open: its size is at most four times its distance from another value."""
    first, *others = values
    return abs(first) <= 4 * max([abs(v - first) for v in others])


def clear_sign(values: Sequence) -> int:
    """Return the sign of the first value, or 0 where it is open (see ``is_open``)."""
    return 0 if is_open(values) else sign_of(values[0])


def nudges(t: Any, state: tuple, slack: Any, least: Any = 0) -> Iterator[tuple[Any, tuple]]:
    """Yield times and states, numbers or arrays, displaced by the relative error ``slack``, with two patterns of signs.

    With ``least``, states follow in which one alone is displaced, by this part of the largest: the rounding of a zero.
    Of a largest state beyond ``LARGE`` it is the part of this, as an angle of 1 is no zero beside vast lengths.
    """
    for signs in _NUDGES:
        factors = [1 + sign * slack for sign in signs]
        yield t * factors[-1], tuple(map(mul, state, cycle(factors)))
    if least and (floor := least * min(LARGE, max(map(abs, state), default=0))):
        yield from ((t, (*state[:k], w + floor, *state[k + 1 :])) for k, w in enumerate(state))


@lru_cache(maxsize=64)
def contact_formulas(
    system: System, signs: Signs = ()
) -> tuple[tuple[sp.Expr, ...], tuple[sp.Symbol, ...], tuple[int, ...]]:
    """Return (four numbers of each friction, then rows, in a flat tuple; unknown forces; frictions with a normal).

    The rows are those of the loads, then those of a ``ContactPoint``. Sliding velocities that vanish have the given
    ``signs``, whatever rounding makes of them.
    """
    unknowns, found, loads = system.pushes, [], []
    normals = tuple(k for k, f in enumerate(system.frictions) if f.normal is not None)
    for f, sign in zip(system.frictions, signs or repeat(0), strict=False):
        law = (f.kinetic, f.static, f.load)
        *bounds, load = law if sign is None else (branches.with_direction(f.velocity, e, sign) for e in law)
        found += [f.velocity, *bounds, sp.S.Zero if f.gap is None else f.gap]
        loads.append(load)
    rates = (branches.rate_along(system, f.velocity) for f in system.frictions)
    laws = (forces.reaction_law(system.frictions[k]) for k in normals)
    rows = in_forces(system, (*loads, *rates, *laws), signs)
    return (*_directed(system, found, signs), *rows), unknowns, normals


def in_forces(system: System, exprs: Iterable[sp.Expr], signs: Signs = ()) -> tuple[sp.Expr, ...]:
    """Return the rows of expressions that are linear in the forces, one row after the other in a flat tuple."""
    unknowns = system.pushes
    zero = dict.fromkeys(unknowns, sp.S.Zero)
    rows = ((replaced(row, zero), *(slope_by(row, u) for u in unknowns)) for row in exprs)
    return _directed(system, [*chain(*rows)], signs)


def _directed(system, exprs, signs):
    """Return expressions with the signs of sliding velocities that vanish in them."""
    vanishing = [(f.velocity, s) for f, s in zip(system.frictions, signs or repeat(0), strict=False) if s is not None]
    directions = {e: s for v, sign in vanishing for e, s in ((sp.sign(v), sign), (sp.sign(-v), -sign))}
    return tuple(e.subs(directions) if atoms(e, sp.sign) else e for e in exprs)


def signs_at_rest(system: System, places: Sequence[Place], still: Collection[int]) -> Signs:
    """Return 0 for all sliding velocities that vanish, of ``still`` contacts and others; () if no formula asks."""
    if not feels_directions(system):
        return ()
    rows = (place.values(system, tuple(f.velocity for f in system.frictions)) for place in places)
    clear = map(clear_sign, zip(*rows, strict=True))
    return tuple(None if sign and k not in still else 0 for k, sign in enumerate(clear))


@lru_cache(maxsize=64)
def feels_directions(system: System) -> bool:
    """Tell whether a contact depends on the sign of a sliding velocity."""
    return contact_formulas(system, (None,) * len(system.frictions)) != contact_formulas(system)


@lru_cache(maxsize=64)
def keeps_coefficients(system: System) -> bool:
    """Tell whether neither states nor time move what multiplies the forces in the equations of the contacts."""
    formulas, unknowns, _ = contact_formulas(system)
    count = len(system.frictions)
    bounds = (e for k in range(count) for e in formulas[4 * k + 1 : 4 * k + 3])
    rows = (row for _, *row in linear_rows(formulas[4 * count :], unknowns))
    moving = {*system.states, system.time}
    return not feels_directions(system) and not symbols_in(sp.Tuple(*bounds, *chain(*rows))) & moving


@lru_cache(maxsize=64)
def turned_by_others(system: System) -> frozenset[int]:
    """Return the contacts whose sliding velocity jumps with the direction in which another contact slips."""
    contacts = range(len(system.frictions)) if feels_directions(system) else ()
    return frozenset(k for k in contacts if atoms(system.frictions[k].velocity, sp.sign))


def contact_point(system: System, place: Place, signs: Signs) -> ContactPoint:
    """Return the contacts at a place, in the numbers of this place: later operations then have the same rounding.

    Raises ``OverflowError`` for a bound of friction that is not finite, as of a logarithm at 0.
    """
    formulas, unknowns, _ = contact_formulas(system, signs)
    values = tuple(map(place.numbers.convert, place.values(system, formulas)))
    count = len(system.frictions)
    if any(bound - bound != 0 for k in range(count) for bound in values[4 * k + 1 : 4 * k + 3]):
        raise OverflowError("a bound of friction is not finite")
    rows = linear_rows(values[4 * count :], unknowns)
    loads = ((row[0], tuple((j, c) for j, c in enumerate(row) if j and c)) for row in rows[:count])
    contacts = tuple(ContactNumbers(*(*values[4 * k : 4 * k + 4], *load)) for k, load in enumerate(loads))
    return ContactPoint(contacts, tuple(rows[count:]))


def linear_rows(values: Sequence, unknowns: tuple) -> list[tuple]:
    """Return values in rows: a constant and the coefficients of the unknowns."""
    width = 1 + len(unknowns)
    return [tuple(values[k : k + width]) for k in range(0, len(values), width)]


def gap_row(system: System, k: int, point: ContactPoint) -> tuple:
    """Return the row of the equation of a contact's reaction; for a rigid contact this is the row of g''."""
    return point.rows[len(system.frictions) + contact_formulas(system)[2].index(k)]


@lru_cache(maxsize=64)
def coupled(system: System) -> tuple[tuple[int, ...], ...]:
    """Return the frictions in groups: no equation of one has a force, reaction or direction of sliding of another."""
    count = len(system.frictions)
    formulas, unknowns, normals = contact_formulas(system, (None,) * count)
    owner = {u: k for k, f in enumerate(system.frictions)
             for u in (f.force, f.normal, sp.sign(f.velocity), sp.sign(-f.velocity))}
    rows = [*zip((*range(count), *range(count), *normals), linear_rows(formulas[4 * count :], unknowns), strict=True)]
    pairs = [(k, owner[u]) for k, (_, *row) in rows for u, entry in zip(unknowns, row, strict=True) if entry != 0]
    rows += ((k // 4, (number,)) for k, number in enumerate(formulas[: 4 * count]))
    pairs += [(k, owner[sign]) for k, row in rows for sign in atoms(sp.Tuple(*row), sp.sign) & owner.keys()]
    return tuple(sorted(tuple(sorted(group)) for group in connected_components((range(count), pairs))))


def solved_forces(
    system: System, branch: Branch, point: ContactPoint, numbers: Numbers, group: Collection[int]
) -> Solved | None:
    """Return the forces of a group, and 0 for those of other groups, or None where its equations do not determine them.

    The forces stand in the order of the unknowns of ``contact_formulas``.
    """
    equations, unknowns = contact_equations(system, branch, point, group), system.pushes
    if len(group) == len(branch):
        return eliminated(equations, unknowns, numbers)
    mine = {u for k in group for u in (system.frictions[k].force, system.frictions[k].normal)}
    columns = [0, *(j for j, u in enumerate(unknowns, start=1) if u in mine)]
    own = [tuple(row[j] for j in columns) for row in equations]
    found = eliminated(own, tuple(unknowns[j - 1] for j in columns[1:]), numbers)
    return found and found._replace(forces=dict.fromkeys(unknowns, 0) | found.forces)


def contact_equations(system: System, branch: Branch, point: ContactPoint, group: Collection[int]) -> list[tuple]:
    """Return the rows of a group that are 0 in a branch: each friction's law or v', then each reaction's equation."""
    _, unknowns, normals = contact_formulas(system)
    place = {u: j for j, u in enumerate(unknowns)}
    rows = [_law(system, branch, k, point, place) for k in group]
    for row, k in enumerate(normals, start=len(branch)):
        normal = place[system.frictions[k].normal]
        if k in group:
            rows.append(point.rows[row] if not branch[k].is_open else unit_row(normal, len(unknowns)))
    return rows


def _law(system: System, branch: Branch, k: int, point: ContactPoint, place: dict) -> tuple:
    """Return the row of one friction's equation: v' in stick, else the law of friction."""
    friction, phase, contact = system.frictions[k], branch[k], point.contacts[k]
    if phase.mode == "stick":
        return point.rows[k]
    row = [*unit_row(place[friction.force], len(place))]
    if not phase.is_open:
        resting = forces.rests_in_all_but_name(system, branch, k)
        factor = phase.load * phase.velocity * (contact.static if resting else contact.kinetic)
        row[0] = factor * contact.load
        for j, c in contact.pushed:
            row[j] += factor * c
    return tuple(row)


def unit_row(place: int, size: int) -> tuple:
    """Return the row whose value is the unknown number ``place``."""
    return tuple(int(j == place + 1) for j in range(size + 1))


def eliminated(equations: list[tuple], unknowns: tuple, numbers: Numbers) -> Solved | None:
    """Solve as many linear equations as unknowns by elimination, or return None where they are singular."""
    rows, size, sign = [*equations], len(unknowns), 1
    given = [row[1:] for row in equations]
    for j in range(1, size + 1):
        pivot = max(range(j - 1, size), key=lambda i: abs(rows[i][j]))
        if numbers.is_singular(rows[pivot][j], given[pivot]):
            return None
        sign *= 1 if pivot == j - 1 else -1
        for both in (rows, given):
            both[j - 1], both[pivot] = both[pivot], both[j - 1]
        for i in range(size):
            if i != j - 1 and rows[i][j] != 0:
                rows[i] = plus_multiple(rows[i], -rows[i][j] / rows[j - 1][j], rows[j - 1])
    forces = {u: -rows[j][0] / rows[j][j + 1] for j, u in enumerate(unknowns)}
    return Solved(forces, math.prod((rows[j][j + 1] for j in range(size)), start=sign))


def plus_multiple(row: tuple, factor: Any, other: tuple) -> tuple:
    """Return a row plus a multiple of another; most entries are 0, and the numbers are slow."""
    return tuple(a + factor * b if b else a for a, b in zip(row, other, strict=True))


def row_at(row: tuple, forces: tuple) -> Any:
    """Return the value of a row; ``forces`` begins with 1, the factor of the constant."""
    return sum(a * b for a, b in zip(row, forces, strict=True))
