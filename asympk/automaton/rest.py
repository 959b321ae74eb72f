r"""Rest on more contacts than determine its forces.

The forces and reactions u of contacts at rest obey E u + e = 0, a row for each sliding velocity and each constraint.
Where E is singular they are not determined, but a system without an explicit time that some u holds at rest rests:

    E u + e = 0,    |F_k| <= static_k N_k,    all rates 0.

If some u do this, then one of finitely many corners does, at which as many of the inequalities are equations as E leaves
dimensions open (Lemma 10). They are tried one by one.
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import combinations

import sympy as sp

from asympk.automaton.contacts import (
    ContactPoint,
    Numbers,
    Place,
    contact_equations,
    contact_formulas,
    eliminated,
    in_forces,
    independent,
    linear_rows,
    row_at,
)
from asympk.symbolic.branches import Branch
from asympk.symbolic.system import System


def stands_still(
    system: System, branch: Branch, places: Sequence[Place], points: Sequence[ContactPoint], numbers: Numbers
) -> bool:
    """Tell whether forces that contacts at rest can have make all rates of the system 0.

    The points are those of the places, of which the first is the state itself and the others what rounding makes of it.
    """
    unknowns = contact_formulas(system)[1]
    equations = [contact_equations(system, branch, point) for point in points]
    cones = [_cone(system, branch, point) for point in points]
    rates = [linear_rows(place.values(system, _rates(system)), unknowns) for place in places]
    kept = independent(equations[0], numbers)
    zeros = [[row for k, row in enumerate(e) if k not in kept] + r for e, r in zip(equations, rates, strict=True)]
    for edges in combinations(range(len(cones[0])), len(unknowns) - len(kept)):
        rows = ([e[k] for k in kept] + [c[k] for k in edges] for e, c in zip(equations, cones, strict=True))
        corners = [eliminated(r, unknowns, numbers) for r in rows]
        if None not in corners:
            forces = [(1, *corner.forces.values()) for corner in corners if corner]
            if not any(_signs(zeros, forces, numbers)) and -1 not in _signs(cones, forces, numbers):
                return True
    return False


def _signs(rows: Sequence[Sequence[tuple]], forces: Sequence[tuple], numbers: Numbers) -> Iterable[int]:
    """Yield the signs of rows, which are given for every place, at the forces there."""
    for by_place in zip(*rows, strict=True):
        yield numbers.decided_sign([row_at(row, f) for row, f in zip(by_place, forces, strict=True)])


def _cone(system: System, branch: Branch, point: ContactPoint) -> list[tuple]:
    """Return the rows that must not be negative: of every contact at rest its load, and how far friction is within."""
    unknowns, found = contact_formulas(system)[1], []
    for friction, phase, contact in zip(system.frictions, branch, point.contacts, strict=True):
        if phase.mode == "stick":
            push = [phase.load * contact.reaction * (u == friction.normal) for u in unknowns]
            load = (phase.load * contact.load, *push)
            force = (0, *(int(u == friction.force) for u in unknowns))
            pairs = [*zip(load, force, strict=True)]
            found += [tuple(contact.static * a + side * b for a, b in pairs) for side in (1, -1)]
            found += [load] if contact.reaction else []
    return found


@lru_cache(maxsize=64)
def _rates(system: System) -> tuple[sp.Expr, ...]:
    return in_forces(system, system.rates.values())
