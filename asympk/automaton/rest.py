"""Rest on more contacts than determine its forces.

The forces and reactions u of contacts at rest obey E u + e = 0, a row for each sliding velocity and each constraint.
Where E is singular, the equations do not determine u. Yet the system rests if some u satisfies

    E u + e = 0,    |F_k| <= static_k N_k,    all rates 0 but those of states that move by themselves.

Then one exists at one of finitely many corners, where as many of the inequalities are equations as the equations above
leave dimensions free (Lemma 10). The criss-cross method finds it (``_corner``). The equations of the corner determine
u until the next margin vanishes, where another corner is sought, or rest ends. Where a contact slips besides,
undetermined forces may give different rates, and the motion is then not determined.
"""

from collections.abc import Callable, Collection, Iterable
from functools import lru_cache
from itertools import compress
from typing import Any

import sympy as sp

from asympk.automaton import contacts
from asympk.automaton.contacts import ContactNumbers, ContactPoint, Numbers, Place, plus_multiple, unit_row
from asympk.automaton.junction import Junction
from asympk.symbolic.branches import Branch, Guard, is_joint
from asympk.symbolic.forces import determined, standing_rows
from asympk.symbolic.system import System

Growth = Callable[[Branch, Guard], int]  # the sign with which a margin leaves 0 in a branch that stands
Table = list[tuple]  # rows with the columns 1, u; after an exchange a row stands for the unknown of its column


def standing_branch(here: Junction, branch: Branch, growth: Growth) -> Branch | None:
    """Return a branch with the rows of a corner at which its contacts, all at rest, make all rates of the system 0.

    None means that they cannot bear such forces. A margin that vanishes must not fall as the time goes on.
    """
    zeros, margins = standing_rows(here.system, branch)
    tables = _tables(here, _standing_rows(here.system, branch), here.places_of_rest)

    def standing(rows: Iterable[int]) -> Branch:
        return tuple(phase._replace(still=tuple(sorted(rows))) if not phase.is_open else phase for phase in branch)

    parts = ([table[: len(zeros)] for table in tables], [table[len(zeros) :] for table in tables])
    rows = _corner(*parts, here.numbers, len(here.system.states),
                   lambda rows, row: growth(standing(rows), margins[row - len(zeros)]))
    return None if rows is None else standing(rows)


def has_forces(here: Junction, branch: Branch, elsewhere: bool = False) -> bool:
    """Tell whether some forces agree with a branch each of whose equations contains a force, here or ``elsewhere``."""
    zeros, cones = _agreeing(here, branch)
    acting = all(any(row[1:]) for row in zeros[0]) or (elsewhere and determined(here.system, branch))
    return acting and _corner(zeros, cones, here.numbers) is not None


def move_alike(here: Junction, branch: Branch, other: Branch) -> bool:
    """Tell whether all forces that agree with one branch, and all that agree with another, give the same rates."""
    return not (moves_otherwise(here, branch, other) or moves_otherwise(here, other, branch))


def moves_otherwise(here: Junction, branch: Branch, other: Branch) -> bool:
    """Tell whether forces that agree with a branch give some rate a greater value than ones that agree with another.

    Such forces u and w exist exactly if, for the coefficients r of some rate, r (u - w) = 1, E u + e s = 0 and
    D w + d s = 0 have a solution with u and w in the cones and s >= 0. For s > 0 the solutions are u/s and w/s; for
    s = 0 they grow without bound in the directions u and w. Of one branch, two forces differ if one is greater.
    """
    tables = _tables(here, _rates(here.system), here.places)
    known = zip(*(_known(here, each, tables) for each in (branch, other)), strict=True)
    doubtful = [not (own and its) or here.numbers.decided_sign([a - b for a, b in zip(own, its, strict=True)]) > 0
                for own, its in known]
    if not (any(doubtful) and has_forces(here, branch) and has_forces(here, other)):
        return False
    zeros, cones = (list(map(_side_by_side, *both))
                    for both in zip(_agreeing(here, branch), _agreeing(here, other), strict=True))
    for rows in compress(zip(*tables, strict=True), doubtful):
        apart = [(-1, 0, *r, *(-a for a in r)) for _, *r in rows]
        with_apart = [[*z, row] for z, row in zip(zeros, apart, strict=True)]
        with_s = [[*c, unit_row(0, len(apart[0]) - 1)] for c in cones]
        if _corner(with_apart, with_s, here.numbers) is not None:
            return True
    return False


def known_forces(here: Junction, branch: Branch) -> dict[sp.Symbol, Any]:
    """Return the forces that the equations of a branch determine, though they may leave others undetermined."""
    unknowns = contacts.contact_formulas(here.system)[1]
    rows = [unit_row(j, len(unknowns)) for j in range(len(unknowns))]
    found = _known(here, branch, [rows for _ in here.places])
    return {force: values[0] for force, values in zip(unknowns, found, strict=True) if values}


def _known(here: Junction, branch: Branch, rows: list[Table]) -> list[tuple]:
    """Return the values of rows, given at all places, by the equations of a branch; () of one left undetermined.

    After an exchange of as many equations for forces as possible, such a row depends on a force that is left.
    """
    every, columns = range(len(branch)), range(1, len(rows[0][0]))
    laws = [contacts.contact_equations(here.system, branch, point, every) for point in here.points_in(branch)]
    size = len(laws[0])
    tables, found = with_exchanges([law + own for law, own in zip(laws, rows, strict=True)], range(size), columns,
                                   here.numbers)
    free = [j for j in columns if j not in found]
    fixed = (not any(_sign(tables, i, j, here.numbers) for j in free) for i in range(size, len(tables[0])))
    return [tuple(table[i][0] for table in tables) if known else () for i, known in enumerate(fixed, size)]


def _side_by_side(table: Table, other: Table) -> Table:
    """Return the rows in (1, u) of two tables as rows in (1, s, u, w), for u and for w, each constant times s."""
    return [(0, e, *u, *(0 for _ in u)) for e, *u in table] + [(0, e, *(0 for _ in w), *w) for e, *w in other]


def _agreeing(here: Junction, branch: Branch) -> tuple[list[Table], list[Table]]:
    """Return, for each point, the rows that are 0 and the rows that are not negative if forces agree with a branch."""
    points = here.points_in(branch)
    cones = [_cone(here, branch, n) + _parting(here, branch, p) for n, p in enumerate(points)]
    return [contacts.contact_equations(here.system, branch, p, range(len(branch))) for p in points], cones


def _corner(
    zeros: list[Table], cones: list[Table], numbers: Numbers, first: int = 0,
    grown: Callable[[set[int], int], int] = lambda rows, row: 0,
) -> set[int] | None:
    """Return the rows that vanish at a corner at which all rows of ``zeros`` are 0 and no row of ``cones`` negative.

    Rows are counted through both tables; the ``first`` ones are solved before the others. None means that there is no
    such corner. The sign of a row that vanishes besides those of a corner is ``grown(corner, row)``. The first negative
    row is exchanged for the first one of the corner that can restore it (criss-cross).
    """
    tables = [z + cone for z, cone in zip(zeros, cones, strict=True)]
    equations, cone = range(len(zeros[0])), range(len(zeros[0]), len(tables[0]))
    columns, solved = range(1, len(tables[0][0])), dict[int, int]()
    for rows in (equations[:first], equations[first:]):
        tables, found = with_exchanges(tables, rows, [j for j in columns if j not in solved], numbers)
        solved |= found
    free = [row[0] for row in zeros[0]]
    unsolved = [i for i in equations if i not in solved.values()]
    if any(_sign(tables, i, 0, numbers) and not numbers.is_singular(tables[0][i][0], free) for i in unsolved):
        return None
    tables, corner = with_exchanges(tables, cone, [j for j in columns if j not in solved], numbers)
    basic = {i: i for i in cone if i not in corner.values()}  # rows and columns to inequalities, exchanged below
    tried: set[frozenset] = set()
    while frozenset(corner.values()) not in tried:
        tried.add(frozenset(corner.values()))
        at = {*solved.values(), *corner.values()}
        signs = ((i, _sign(tables, i, 0, numbers) or grown(at, basic[i])) for i in sorted(basic, key=basic.__getitem__))
        i = next((i for i, sign in signs if sign < 0), None)
        if i is None:
            return at
        j = next((j for j in sorted(corner, key=corner.__getitem__) if _sign(tables, i, j, numbers) > 0), None)
        if j is None:
            return None
        tables = [_exchanged(table, i, j) for table in tables]
        basic[i], corner[j] = corner[j], basic[i]
    return None


def with_exchanges(
    tables: list[Table], rows: Collection[int], columns: Collection[int], numbers: Numbers
) -> tuple[list[Table], dict[int, int]]:
    """Return the tables with as many rows as possible exchanged for columns, and {column: row} of these exchanges."""
    found: dict[int, int] = {}
    for j in columns:
        free = [i for i in rows if i not in found.values()]
        pivot = max(free, key=lambda i: abs(tables[0][i][j]), default=None)
        if pivot is None or contacts.is_open([table[pivot][j] for table in tables]):
            continue
        if not numbers.is_singular(tables[0][pivot][j], tables[0][pivot][1:]):
            tables, found[j] = [_exchanged(table, pivot, j) for table in tables], pivot
    return tables, found


def _sign(tables: list[Table], i: int, j: int, numbers: Numbers) -> int:
    return numbers.decided_sign([table[i][j] for table in tables])


def _exchanged(table: Table, i: int, j: int) -> Table:
    """Return a table after an exchange: column j now is the value of row i, and row i the unknown of column j."""
    pivot = table[i][j]
    own = tuple((1 if k == j else -a) / pivot for k, a in enumerate(table[i]))

    def moved(row: tuple) -> tuple:
        return plus_multiple((*row[:j], 0, *row[j + 1 :]), row[j], own) if row[j] else row

    return [own if k == i else moved(row) for k, row in enumerate(table)]


def _cone(here: Junction, branch: Branch, n: int) -> list[tuple]:
    """Return the rows that must not be negative: loads of closed contacts that forces change, margins of stick."""
    unknowns, found = contacts.contact_formulas(here.system)[1], []

    def load(contact: ContactNumbers, sign: int) -> tuple:
        push = dict(contact.pushed)
        return (sign * contact.load, *(sign * push.get(j, 0) for j in range(1, 1 + len(unknowns))))

    for k, (phase, contact) in enumerate(zip(branch, here.points_in(branch)[n].contacts, strict=True)):
        free = phase.is_open or is_joint(here.system.frictions[k], phase)
        found += [load(contact, phase.load)] if contact.pushed and not free else []
        if phase.mode == "stick":
            force = unit_row(unknowns.index(here.system.frictions[k].force), len(unknowns))
            for side, begun in zip((1, -1), here.beginning(branch, k, n), strict=True):
                found.append(plus_multiple(tuple(begun.static * a for a in load(begun, phase.load)), side, force))
    return found


def _parting(here: Junction, branch: Branch, point: ContactPoint) -> list[tuple]:
    """Return the rows that must not be negative for rest to end: rates of velocities, and g'' of opening contacts."""
    slipping = [k for k, phase in enumerate(branch) if phase.velocity and k in here.resting]
    opening = [k for k, phase in enumerate(branch) if phase.is_open and k in here.touching]
    rows = [tuple(branch[k].velocity * a for a in point.rows[k]) for k in slipping]
    return rows + [contacts.gap_row(here.system, k, point) for k in opening]


def _tables(here: Junction, rows: tuple[sp.Expr, ...], places: tuple[Place, ...]) -> list[Table]:
    """Return, for each place, the values of rows in the forces, in its numbers: quotients of integers are doubles."""
    unknowns = contacts.contact_formulas(here.system)[1]
    return [contacts.linear_rows([*map(p.numbers.convert, p.values(here.system, rows))], unknowns) for p in places]


@lru_cache(maxsize=64)
def _rates(system: System) -> tuple[sp.Expr, ...]:
    return contacts.in_forces(system, system.rates.values())


@lru_cache(maxsize=64)
def _standing_rows(system: System, branch: Branch) -> tuple[sp.Expr, ...]:
    zeros, margins = standing_rows(system, branch)
    return contacts.in_forces(system, (*zeros, *(margin.value for margin in margins)))
