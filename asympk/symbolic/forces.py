r"""The forces on one branch of the friction law, from linear equations.

On a branch the forces F and the reactions N solve, with v the sliding velocity,

    slip     F + (sign of the load) (sign of v) kinetic load = 0          stick    v' = 0
    open     F = 0,  N = 0                                                closed   N = load, or constraint = 0

``forces`` solves the equations; ``_by_elimination`` is the hard function. A system at rest on more contacts than
equations has the rows of ``standing_rows`` instead.
"""

from functools import lru_cache
from typing import TYPE_CHECKING

import sympy as sp

from asympk.errors import InputError
from asympk.symbolic import branches
from asympk.symbolic.branches import Branch, Guard, Phase, mode_name, with_direction
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import entries_named, has_no_inverse, heavy, is_clearly_nonzero, replaced, symbols_in, tidied

if TYPE_CHECKING:
    from asympk.symbolic.system import Friction, System


def forces(system: "System", branch: Branch) -> dict[sp.Symbol, sp.Expr]:
    """Solve the linear equations of a branch for the forces; raises ``InputError`` where they are singular."""
    return _forces(system, branches.without_idle(branch))


@lru_cache(maxsize=256)
def _forces(system: "System", branch: Branch) -> dict[sp.Symbol, sp.Expr]:
    unknowns, matrix, right = force_equations(system, branch)
    if not unknowns:
        return {}
    if heavy(sp.Tuple(*matrix)):
        return _by_elimination(branch, matrix, right, unknowns)
    if not (branches.stands(branch) or determined(system, branch)):
        raise _undetermined(branch)
    if matrix.is_lower:
        return dict(zip(unknowns, map(tidied, matrix.lower_triangular_solve(right)), strict=True))
    solved = _by_elimination(branch, matrix, right, unknowns)
    return {unknown: tidied(value) for unknown, value in solved.items()}


@lru_cache(maxsize=1024)
def determined(system: "System", branch: Branch) -> bool:
    """Tell whether the equations of a branch have one solution for its forces, not everywhere singular."""
    unknowns, matrix, _ = force_equations(system, branch)
    return not unknowns or not _is_singular(matrix)


def _is_singular(matrix: sp.Matrix) -> bool:
    found = has_no_inverse(matrix)
    return bool(found) if heavy(sp.Tuple(*matrix)) else found is not False and sp.cancel(matrix.det()) == 0


def _undetermined(branch: Branch) -> InputError:
    return InputError(f"mode {mode_name(branch)}: the forces are not determined; each must enter the rate of its "
                      "velocity")


@lru_cache(maxsize=256)
def force_equations(
    system: "System", branch: Branch
) -> tuple[tuple[sp.Symbol, ...], sp.ImmutableMatrix, sp.ImmutableMatrix]:
    """Return (unknowns, matrix, right side) of the linear equations of a branch."""
    unknowns, equations = [], []
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        unknowns.append(friction.force)
        equations.append(_friction_law(system, branch, k))
        if friction.normal is not None:
            unknowns.append(friction.normal)
            equations.append(friction.normal if phase.is_open else reaction_law(friction))
    if branches.stands(branch):
        laws, margins = standing_rows(system, branch)
        rows = (*laws, *(margin.value for margin in margins))
        equations = [rows[k] for k in branches.still_rows(branch)]
    equations = [branches.with_signs(system, branch, e) for e in equations]
    pairs = [(e, symbols_in(e)) for e in equations]
    slopes = [slope_by(e, u) if u in used else sp.S.Zero for e, used in pairs for u in unknowns]
    matrix = sp.ImmutableMatrix(len(equations), len(unknowns), slopes)
    if found := symbols_in(matrix) & {*unknowns}:
        raise InputError(f"mode {mode_name(branch)}: the forces must enter rates, loads and bounds linearly, and "
                         f"{min(map(str, found))} does not; write that rate, load or bound without it")
    zero = dict.fromkeys(unknowns, sp.S.Zero)
    return (*unknowns,), matrix, sp.ImmutableMatrix([-replaced(e, zero) for e in equations])


def _friction_law(system: "System", branch: Branch, k: int) -> sp.Expr:
    friction, phase = system.frictions[k], branch[k]
    if phase.is_open:
        return friction.force
    if phase.velocity:
        coefficient = friction.static if rests_in_all_but_name(system, branch, k) else friction.kinetic
        bound = coefficient * friction.load
        bound = bound if phase.either else with_direction(friction.velocity, bound, phase.velocity)
        return friction.force + phase.load * phase.velocity * bound
    return branches.rate_along(system, friction.velocity)


def reaction_law(friction: "Friction") -> sp.Expr:
    """Return what is 0 for the reaction of a closed contact: its difference from the load, or the constraint."""
    return friction.constraint if friction.rigid else friction.normal - friction.load


def _by_elimination(
    branch: Branch, matrix: sp.Matrix, right: sp.Matrix, unknowns: tuple[sp.Symbol, ...]
) -> dict[sp.Symbol, sp.Expr]:
    """Solve by the adjugate of a matrix of symbols that stand for the coefficients, which may be too long to expand.

    The short laws of slip and of open contacts are eliminated first. The only division is by the determinant: a pivot
    may vanish at parameters at which the forces are determined. A matrix of numbers is inverted, which is quicker.
    """
    rows = sp.Matrix.hstack(matrix, right).as_mutable()
    short_laws = _put_in(rows)
    others = [i for i in range(len(unknowns)) if i not in short_laws.values()]
    columns = [j for j in range(len(unknowns)) if j not in short_laws]
    names, meaning = entries_named(rows[others, [*columns, len(unknowns)]])
    names, known = names[:, :-1], names[:, -1]
    if (determinant := names.det(method="berkowitz")) == 0:
        raise _undetermined(branch)
    if all(entry.is_Rational for entry in names):
        solved = names.to_DM().to_field().inv().to_Matrix() * known
    else:
        solved = names.adjugate() * known / determinant
    found = dict(zip(columns, (replaced(value, meaning) for value in solved), strict=True))
    for j, i in short_laws.items():
        found[j] = rows[i, -1] - sum(rows[i, k] * found[k] for k in columns if rows[i, k] != 0)  # 0 times long is slow
    return {u: found[j] for j, u in enumerate(unknowns)}


def _put_in(rows: sp.Matrix) -> dict[int, int]:
    """Eliminate, in place, an unknown with a numeric coefficient from each row of one or two; return {unknown: row}."""
    found: dict[int, int] = {}
    for i in range(rows.rows):
        entries = {j: rows[i, j] for j in range(rows.cols - 1) if rows[i, j] != 0}
        j = next((j for j, entry in entries.items() if entry.is_number), None)
        if j is None or len(entries) > 2:
            continue
        rows[i, :] /= entries[j]
        for k in range(rows.rows):
            if k != i and rows[k, j] != 0:
                rows[k, :] -= rows[k, j] * rows[i, :]
        found[j] = i
    return found


@lru_cache(maxsize=64)
def standing_rows(system: "System", branch: Branch) -> tuple[tuple[sp.Expr, ...], tuple[Guard, ...]]:
    """Return what is 0 where the system rests on the contacts of a branch, and the margins that must not be negative.

    All are linear in the forces. First the rates of the ``borne`` states are 0, then laws of reactions, forces of open
    contacts, and what the time alone adds to sliding velocities. Loads of closed rigid contacts and edges of stick must
    not be negative.
    """
    still = borne(system)  # other states keep their rows, as on a side of a switch fewer may be borne
    zeros, margins = [rate if s in still else sp.S.Zero for s, rate in system.rates.items()], list[Guard]()
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        if phase.is_open:
            zeros += [s for s in (friction.normal, friction.force) if s is not None]
            continue
        zeros += [reaction_law(friction)] if friction.normal is not None else []
        zeros += [slope_by(friction.velocity, system.time)] if system.time else []
        if friction.rigid and not branches.is_joint(friction, phase):
            kind = "force_zero" if friction.gap is None else "lift_off"
            margins.append(Guard(kind, k, phase.load * friction.load))
        margins += edges_of_stick(friction, phase, k)
    return tuple(zeros), tuple(margins)


@lru_cache(maxsize=64)
def borne(system: "System") -> tuple[sp.Symbol, ...]:
    """Return the states that stand still where the system rests: all but those that move by themselves.

    No force moves those others, and neither contacts nor the borne states depend on them.
    """
    moved = {s for s, rate in system.rates.items() if symbols_in(rate) & {*system.pushes}}
    found = moved | symbols_in(sp.Tuple(*(part for f in system.frictions for part in f.parts.values())))
    while more := symbols_in(sp.Tuple(*(system.rates[s] for s in found & system.rates.keys()))) - found:
        found |= more
    return tuple(s for s in system.states if s in found)


def edges_of_stick(friction: "Friction", phase: Phase, k: int) -> list[Guard]:
    """Return the guards of a contact that sticks, the friction forces left at the two edges of its cone."""
    bound = friction.static * phase.load * friction.load
    margins = (with_direction(friction.velocity, bound, side) + side * friction.force for side in (1, -1))
    return [Guard("slip_onset", k, margin, upper) for margin, upper in zip(margins, (False, True), strict=True)]


def rests_in_all_but_name(system: "System", branch: Branch, k: int) -> bool:
    """Tell whether a contact that slips in a branch cannot move there, and static friction exceeds kinetic friction.

    The other contacts at rest hold such a contact, so its force is not determined. The branch gives it the largest
    possible force, its static friction (Lemma 10).
    """
    friction = system.frictions[k]
    return friction.static != friction.kinetic and is_carried(system, branch, k)


def moving_as(system: "System", branch: Branch) -> Branch:
    """Return a branch without idle guards, in which contacts that others hold are at rest, whatever its name says."""
    own = branches.bare(branch)
    return tuple(phase._replace(velocity=0) if is_carried(system, own, k) else phase for k, phase in enumerate(own))


def moves_alike(system: "System", one: Branch, other: Branch) -> bool:
    """Tell whether two branches differ at most in their idle guards and in how contacts at rest share their forces."""
    return moving_as(system, one) == moving_as(system, other)


def is_carried(system: "System", branch: Branch, k: int) -> bool:
    """Tell whether the velocity of a contact that slips in a branch is a combination of velocities that are 0 there."""
    return branch[k].slips and k in _dependent(system) and bool(_is_combination(system, branches.at_rest(branch), k))


@lru_cache(maxsize=64)
def _dependent(system: "System") -> frozenset[int]:
    """Return the frictions whose velocity is, or may be, a combination of the velocities of the others."""
    every = frozenset(range(len(system.frictions)))
    return frozenset(k for k in every if _is_combination(system, every - {k}, k) in (True, None))


@lru_cache(maxsize=1024)
def _is_combination(system: "System", some: frozenset[int], k: int) -> bool | None:
    """Tell whether the velocity of friction k is a combination of those of ``some``; None where they are too long."""
    *others, own = velocities = [system.frictions[j].velocity for j in (*sorted(some), k)]
    if any((own / other).is_number for other in others):
        return True
    known = symbols_in(sp.Tuple(*others))
    if any(is_clearly_nonzero(slope_by(own, s)) for s in system.states if s in symbols_in(own) - known):
        return False
    if any(map(heavy, velocities)):  # before they are expanded
        return None
    rows = sp.Matrix([_affine_row(system, velocity) for velocity in velocities])
    if heavy(sp.Tuple(*rows)):
        return None
    ranks = [part.rank(iszerofunc=lambda e: sp.cancel(e) == 0) for part in (rows[:-1, :], rows)]
    return ranks[0] == ranks[1]


def _affine_row(system: "System", velocity: sp.Expr) -> list[sp.Expr]:
    """Return the derivatives of a velocity by all states, and then its remainder after the linear terms."""
    slopes = {s: slope_by(velocity, s) for s in system.states}
    return [*slopes.values(), sp.expand(velocity - sum(s * slope for s, slope in slopes.items()))]
