r"""Rest on more contacts than determine its forces.

The forces and reactions u of contacts at rest obey E u + e = 0, a row for each sliding velocity and each constraint.
Where E is singular they are not determined, but a system without an explicit time that some u holds at rest rests:

    E u + e = 0,    |F_k| <= static_k N_k,    all rates 0.

If some u do this, then one of finitely many corners does, at which as many of the inequalities are equations as these
leave dimensions open (Lemma 10). The criss-cross method finds one: each inequality is affine in those of a corner, and
the first that does not hold is exchanged for the first of these that can mend it. If none can, there is no such u.

Where a contact slips, too, forces that are not determined may give different rates. Then the motion cannot be told.
"""

from collections.abc import Collection
from functools import lru_cache

import sympy as sp

from asympk.automaton.contacts import (
    ContactPoint,
    Numbers,
    contact_equations,
    contact_formulas,
    gap_row,
    in_forces,
    linear_rows,
    unit_row,
)
from asympk.automaton.junction import Junction
from asympk.symbolic.branches import OPEN, Branch
from asympk.symbolic.system import System

Table = list[tuple]  # rows in the columns 1, u: a row exchanged for a column is the unknown of that


def stands_still(here: Junction, branch: Branch) -> bool:
    """Tell whether forces that contacts at rest can have make all rates of the system 0."""
    zeros = [contact_equations(here.system, branch, p) + r for p, r in zip(here.points, _rates_at(here), strict=True)]
    return _holds_somewhere(zeros, [_cone(here.system, branch, p) for p in here.points], here.numbers)


def has_forces(here: Junction, branch: Branch) -> bool:
    """Tell whether some forces agree with a branch, and are in each of its equations."""
    zeros, cones = _agreeing(here, branch)
    return all(any(row[1:]) for row in zeros[0]) and _holds_somewhere(zeros, cones, here.numbers)


def moves_in_several_ways(here: Junction, branch: Branch) -> bool:
    """Tell whether forces agree with a branch that give the system different rates.

    For one of these, r, is then r (u - w) = 1 with E u + e s = 0 and E w + e s = 0, both in the cones, and s >= 0: u/s
    and w/s are such forces, or u and w directions without end where s = 0.
    """
    if not has_forces(here, branch):
        return False
    zeros, cones = (list(map(_doubled, tables)) for tables in _agreeing(here, branch))
    for rows in zip(*_rates_at(here), strict=True):
        apart = [(-1, 0, *r, *(-a for a in r)) for _, *r in rows]
        if any(apart[0][1:]) and _holds_somewhere([[*z, row] for z, row in zip(zeros, apart, strict=True)],
                                                  [[*c, unit_row(0, len(apart[0]) - 1)] for c in cones], here.numbers):
            return True
    return False


def _doubled(table: Table) -> Table:
    """Return rows in 1, u as rows in 1, s, u, w, once of u and once of w, their constants times s."""
    parts = [(e, row, [0] * len(row)) for e, *row in table]
    return [(0, e, *u, *w) for e, row, none in parts for u, w in ((row, none), (none, row))]


def _agreeing(here: Junction, branch: Branch) -> tuple[list[Table], list[Table]]:
    """Return, at each point, the rows that vanish for forces that agree with a branch, and those not negative."""
    cones = [_cone(here.system, branch, p) + _parting(here, branch, p) for p in here.points]
    return [contact_equations(here.system, branch, p) for p in here.points], cones


def _holds_somewhere(zeros: list[Table], cones: list[Table], numbers: Numbers) -> bool:
    """Tell whether some forces make all rows of the first tables 0 and those of the others not negative."""
    tables = [z + cone for z, cone in zip(zeros, cones, strict=True)]
    equations, cone = range(len(zeros[0])), range(len(zeros[0]), len(tables[0]))
    columns = range(1, len(tables[0][0]))
    tables, solved = _without(tables, equations, columns, numbers)
    free = [row[0] for row in zeros[0]]
    left = [i for i in equations if i not in solved.values()]
    if any(_sign(tables, i, 0, numbers) and not numbers.is_singular(tables[0][i][0], free) for i in left):
        return False
    tables, corner = _without(tables, cone, [j for j in columns if j not in solved], numbers)
    return _has_corner(tables, {i: i for i in cone if i not in corner.values()}, corner, numbers)


def _without(
    tables: list[Table], rows: Collection[int], columns: Collection[int], numbers: Numbers
) -> tuple[list[Table], dict[int, int]]:
    """Return the tables with rows exchanged for columns as far as they depend on these, and which for which."""
    found: dict[int, int] = {}
    for j in columns:
        left = [i for i in rows if i not in found.values()]
        pivot = max(left, key=lambda i: abs(tables[0][i][j]), default=None)
        if pivot is not None and not numbers.is_singular(tables[0][pivot][j], tables[0][pivot][1:]):
            tables, found[j] = [_exchanged(table, pivot, j) for table in tables], pivot
    return tables, found


def _has_corner(tables: list[Table], basic: dict[int, int], corner: dict[int, int], numbers: Numbers) -> bool:
    """Tell whether all inequalities hold somewhere; ``basic`` and ``corner`` number those of the rows and columns."""
    tried: set[frozenset] = set()
    while frozenset(corner.values()) not in tried:
        tried.add(frozenset(corner.values()))
        i = next((i for i in sorted(basic, key=basic.__getitem__) if _sign(tables, i, 0, numbers) < 0), None)
        if i is None:
            return True
        j = next((j for j in sorted(corner, key=corner.__getitem__) if _sign(tables, i, j, numbers) > 0), None)
        if j is None:
            return False
        tables = [_exchanged(table, i, j) for table in tables]
        basic[i], corner[j] = corner[j], basic[i]
    return False


def _sign(tables: list[Table], i: int, j: int, numbers: Numbers) -> int:
    return numbers.decided_sign([table[i][j] for table in tables])


def _exchanged(table: Table, i: int, j: int) -> Table:
    """Return a table whose column j is the value of row i, and whose row i is the unknown that was column j."""
    pivot = table[i][j]
    own = tuple((1 if k == j else -a) / pivot for k, a in enumerate(table[i]))
    rows = ([(m != j) * a + row[j] * b for m, (a, b) in enumerate(zip(row, own, strict=True))] for row in table)
    return [own if k == i else tuple(row) for k, row in enumerate(rows)]


def _cone(system: System, branch: Branch, point: ContactPoint) -> list[tuple]:
    """Return the rows that must not be negative: of closed contacts the load, of those at rest what friction leaves."""
    unknowns, found = contact_formulas(system)[1], []
    for friction, phase, contact in zip(system.frictions, branch, point.contacts, strict=True):
        push = [phase.load * contact.reaction * (u == friction.normal) for u in unknowns]
        load = (phase.load * contact.load, *push)
        found += [load] if phase != OPEN and contact.reaction else []
        if phase.mode == "stick":
            force = (0, *(int(u == friction.force) for u in unknowns))
            pairs = [*zip(load, force, strict=True)]
            found += [tuple(contact.static * a + side * b for a, b in pairs) for side in (1, -1)]
    return found


def _parting(here: Junction, branch: Branch, point: ContactPoint) -> list[tuple]:
    """Return the rows that must not be negative where rest ends: rates of velocities, and g'' of contacts that open."""
    slipping = [k for k, phase in enumerate(branch) if phase.velocity and k in here.resting]
    opening = [k for k, phase in enumerate(branch) if phase == OPEN and k in here.touching]
    rows = [tuple(branch[k].velocity * a for a in point.rows[k]) for k in slipping]
    return rows + [gap_row(here.system, k, point) for k in opening]


def _rates_at(here: Junction) -> list[Table]:
    """Return, at each place, the rows of the system's rates."""
    unknowns = contact_formulas(here.system)[1]
    return [linear_rows(place.values(here.system, _rates(here.system)), unknowns) for place in here.places]


@lru_cache(maxsize=64)
def _rates(system: System) -> tuple[sp.Expr, ...]:
    return in_forces(system, system.rates.values())
