r"""The modes of a system with friction: their fields and guards, for one branch of the friction law at a time.

A branch says of every friction whether it slips, sticks or is open, and which signs its load and velocity have. On a
branch the forces F and the reactions N solve linear equations, with v the sliding velocity,

    slip     F + (sign of the load) (sign of v) kinetic load = 0          stick    v' = 0
    open     F = 0,  N = 0                                                closed   N = load, or constraint = 0

A branch holds while its guards are positive. ``forces`` solves the equations and is the hard function. ``fields``,
``guards`` and ``where`` substitute its solution; ``named_branches`` lists the branches.
"""

from collections.abc import Collection, Iterable, Iterator
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import sympy as sp
from sympy.solvers.solveset import NonlinearError

from asympk.errors import InputError
from asympk.numbers import short
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import (
    LONG,
    ROUGH,
    atoms,
    expanded,
    generic_place,
    heavy,
    is_longer,
    is_regular,
    replaced,
    tidied,
)
from asympk.symbolic.penetration import without_penetration

if TYPE_CHECKING:
    from asympk.symbolic.system import Friction, System


class Phase(NamedTuple):
    """The signs of one friction's load and velocity; velocity 0 is stick, load 0 an open contact.

    With ``either`` both signs may also be the opposite ones: the name of a mode gives only their product. With
    ``still`` the whole system is at rest on sticking contacts that have more forces than equations; ``still`` are then
    the ``standing_rows`` that vanish and determine the forces. ``idle`` are the kinds of guards that stay 0 along the
    motion and are therefore not watched.
    """

    load: int
    velocity: int
    either: bool = False
    still: tuple[int, ...] = ()
    idle: tuple[str, ...] = ()

    @property
    def mode(self) -> str:
        """Return the name of the mode in which these signs hold."""
        if self.load == 0:
            return "open"
        return ("slip_opposite", "stick", "slip_same")[1 + self.load * self.velocity]


OPEN = Phase(0, 0)
NEVER_IDLE = ("unbounded", "several")  # kinds of guards of sliding rigid contacts; these are always watched
Branch = tuple[Phase, ...]


def awake(branch: Branch) -> Branch:
    """Return a branch without its record of idle guards: a guard may be idle on one side of a switch only."""
    return tuple(phase._replace(idle=()) for phase in branch)


def bare(branch: Branch) -> Branch:
    """Return a branch without its records of idle guards and of the rows that determine its forces at rest."""
    return tuple(phase._replace(idle=(), still=()) for phase in branch)


class Guard(NamedTuple):
    """A function that is positive inside a mode; ``kind`` is the event where it vanishes, ``friction`` an index.

    ``upper`` tells the second of the two edges of stick from the first. ``divided`` means that a power of the
    penetration, a positive factor, was cancelled from ``value``. The margin of the contact vanishes with this factor,
    even where ``value`` does not.
    """

    kind: str
    friction: int
    value: sp.Expr
    upper: bool = False
    divided: bool = False

    @property
    def key(self) -> tuple[str, int, bool]:
        """What tells the guard from the others of its mode, the same on all sides."""
        return self.kind, self.friction, self.upper


def mode_name(branch: Branch) -> str:
    """Return the name of the mode: the names for all frictions joined by ``+``, or ``smooth`` without friction."""
    return "+".join(phase.mode for phase in branch) or "smooth"


def at_rest(branch: Branch) -> frozenset[int]:
    """Return the indices of the frictions that stick."""
    return frozenset(k for k, phase in enumerate(branch) if phase.mode == "stick")


def stands(branch: Branch) -> bool:
    """Tell whether the whole system is at rest on contacts whose forces are not determined."""
    return any(phase.still for phase in branch)


def still_rows(branch: Branch) -> tuple[int, ...]:
    """Return the ``standing_rows`` that determine the forces of a branch that stands."""
    return next(phase.still for phase in branch if phase.still)


def most_at_rest(branches: Iterable[Branch], among: Iterable[int] | None = None) -> list[Branch]:
    """Leave out every branch whose sticking frictions are a proper subset of another branch's; only ``among`` count."""
    rest = {b: at_rest(b) if among is None else at_rest(b) & {*among} for b in branches}
    return [b for b in rest if not any(rest[b] < other for other in rest.values())]


def named_branches(system: "System") -> Iterator[Branch]:
    """Yield one branch for every name of a mode whose forces are determined.

    A stick is left out, for instance, where the force does not enter the rate of its velocity.
    """
    asked = _asks_for_signs(system)
    choices = (_choices(friction, asked) for friction in system.frictions)
    return (branch for branch in product(*choices) if determined(system, branch))


def _asks_for_signs(system: "System") -> bool:
    """Tell whether a rate, load or friction bound contains an absolute value or a sign."""
    bounds = (e for f in system.frictions for e in (f.load, f.kinetic, f.static))
    return sp.Tuple(*system.rates.values(), *bounds).has(sp.Abs, sp.sign)


def _load_sign(friction: "Friction") -> int:
    """Return the sign of the load in all states of a closed contact, or 0 where the load may have both signs."""
    if friction.load.is_negative:
        return -1
    return 1 if friction.load.is_positive or lifts(friction) else 0


def telling(system: "System") -> Iterator[Branch]:
    """Yield branches that show every mode of every contact: one in which all slip, and those with one other phase.

    One phase of a mode suffices unless a formula contains a sign or an absolute value. Where several rigid contacts
    that slip have more reactions than equations, the contacts that can open are open, all but one at a time.
    """
    choices = [*map(all_phases if _asks_for_signs(system) else _choices, system.frictions)]
    first = tuple(choice[0] for choice in choices)
    if _is_redundant(system, first):
        first = tuple(OPEN if OPEN in choice else choice[0] for choice in choices)
    if not _is_redundant(system, first):
        yield first
    for k, choice in enumerate(choices):
        for phase in choice:
            branch = (*first[:k], phase, *first[k + 1 :])
            if branch != first and determined(system, branch):
                yield branch


def _is_redundant(system: "System", branch: Branch) -> bool:
    """Tell whether there are several rigid contacts and their equations for the forces are singular, in symbols."""
    return sum(f.constraint is not None for f in system.frictions) > 1 and not determined(system, branch)


def _choices(friction: "Friction", asked: bool = False) -> tuple[Phase, ...]:
    """Return one phase per mode of a contact, ``either`` if signs are ``asked`` and the sign of the load is unknown."""
    known = _load_sign(friction)
    sign = known or 1
    closed = (Phase(sign, velocity, asked and not known) for velocity in (sign, -sign, 0))
    return (*closed, *([OPEN] if friction.gap is not None else []))


def all_phases(friction: "Friction") -> tuple[Phase, ...]:
    """Return every phase of a contact: all signs of load and velocity, velocity 0, and open if the contact has a gap.

    The load of a contact that ``lifts`` has the sign 1 only.
    """
    closed = (Phase(load, velocity) for velocity in (1, -1, 0) for load in ((1,) if lifts(friction) else (1, -1)))
    return (*closed, *([OPEN] if friction.gap is not None else []))


@lru_cache(maxsize=1024)
def determined(system: "System", branch: Branch) -> bool:
    """Tell whether the equations of a branch have one solution for its forces, not everywhere singular."""
    unknowns, matrix, _ = _equations(system, branch)
    return not unknowns or is_regular(matrix) or sp.cancel(matrix.det()) != 0


def fields(system: "System", branch: Branch) -> tuple[sp.Dict, sp.Dict]:
    """Return the slow field and the fast field of the mode; the fast field is ``small`` times the rates."""
    return _fields(system, awake(branch))


@lru_cache(maxsize=256)
def _fields(system: "System", branch: Branch) -> tuple[sp.Dict, sp.Dict]:
    if not branch:
        return system.slow, system.fast
    if stands(branch):
        return sp.Dict(dict.fromkeys(system.slow, 0)), sp.Dict(dict.fromkeys(system.fast, 0))
    solved = forces(system, branch)
    resting = held(system, branch)
    slow, fast = (
        sp.Dict({s: sp.S.Zero if s in resting else _put(system, branch, rate, solved) for s, rate in rates.items()})
        for rates in (system.slow, system.fast)
    )
    return slow, fast


def where(system: "System", branch: Branch) -> sp.Basic:
    """Return the condition on the states under which the mode holds, for both pairs of signs that its name covers."""
    conditions = []
    for friction, phase in zip(system.frictions, branch, strict=True):
        v, load = friction.velocity, friction.load
        if phase == OPEN:
            conditions.append(friction.gap > 0)
            continue
        conditions += [friction.gap <= 0] if friction.gap is not None else []
        if phase.velocity:
            conditions.append(v * load > 0 if phase.mode == "slip_same" else v * load < 0)
        else:
            drive, coupling = _sliding(system, branch, friction)
            size, slope = (sp.Abs(part, evaluate=not heavy(part)) for part in (drive, coupling))
            conditions.append(sp.And(sp.Eq(v, 0), size <= friction.static * sp.Abs(load) * slope))
    return sp.And(*conditions)


def forces(system: "System", branch: Branch) -> dict[sp.Symbol, sp.Expr]:
    """Solve the linear equations of a branch for the forces; raises ``InputError`` where they are singular."""
    return _forces(system, awake(branch))


@lru_cache(maxsize=256)
def _forces(system: "System", branch: Branch) -> dict[sp.Symbol, sp.Expr]:
    unknowns, matrix, right = _equations(system, branch)
    if not unknowns:
        return {}
    if heavy(sp.Tuple(*matrix)):
        return _by_elimination(branch, matrix, right, unknowns)
    if not stands(branch) and sp.cancel(matrix.det()) == 0:
        raise _undetermined(branch)
    if matrix.is_lower:
        return dict(zip(unknowns, map(tidied, matrix.lower_triangular_solve(right)), strict=True))
    solved = _by_elimination(branch, matrix, right, unknowns)
    return {unknown: tidied(value) for unknown, value in solved.items()}


def _undetermined(branch: Branch) -> InputError:
    return InputError(f"mode {mode_name(branch)}: the forces are not determined; each must enter the rate of its "
                      "velocity")  # fmt: skip


def _equations(system: "System", branch: Branch) -> tuple[list[sp.Symbol], sp.Matrix, sp.Matrix]:
    """Return (unknowns, matrix, right side) of the linear equations of a branch."""
    unknowns, equations = [], []
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        unknowns.append(friction.force)
        equations.append(_friction_law(system, branch, k))
        if friction.normal is not None:
            unknowns.append(friction.normal)
            equations.append(_reaction_law(friction, phase))
    if stands(branch):
        laws, margins = standing_rows(system, branch)
        rows = (*laws, *(margin.value for margin in margins))
        equations = [rows[k] for k in still_rows(branch)]
    equations = [_signed(system, branch, e) for e in equations]
    try:
        return unknowns, *(sp.linear_eq_to_matrix(equations, unknowns) if unknowns else (sp.Matrix(), sp.Matrix()))
    except NonlinearError:
        raise InputError(f"mode {mode_name(branch)}: the forces must enter rates, loads and bounds linearly") from None


def _by_elimination(
    branch: Branch, matrix: sp.Matrix, right: sp.Matrix, unknowns: list[sp.Symbol]
) -> dict[sp.Symbol, sp.Expr]:
    """Solve by the adjugate of a matrix of symbols that stand for the coefficients, which may be too long to expand.

    The short laws of slip and of open contacts are eliminated first. The only division is by the determinant: a pivot
    may vanish at parameters at which the forces are determined.
    """
    rows = sp.Matrix.hstack(matrix, right).as_mutable()
    short_laws = _put_in(rows)
    others = [i for i in range(len(unknowns)) if i not in short_laws.values()]
    columns = [j for j in range(len(unknowns)) if j not in short_laws]
    names, meaning = _entries_named(rows[others, columns])
    if (determinant := names.det(method="berkowitz")) == 0:
        raise _undetermined(branch)
    solved = names.adjugate() * rows[others, -1] / determinant
    found = dict(zip(columns, (replaced(value, meaning) for value in solved), strict=True))
    for j, i in short_laws.items():
        found[j] = rows[i, -1] - sum(rows[i, k] * found[k] for k in columns)
    return {u: found[j] for j, u in enumerate(unknowns)}


def _entries_named(matrix: sp.Matrix) -> tuple[sp.Matrix, dict[sp.Symbol, sp.Expr]]:
    """Return a matrix with a symbol for each entry that is not a number, and the mapping from symbols to entries."""
    names = matrix.applyfunc(lambda entry: entry if entry.is_number else sp.Dummy())
    return names, {s: entry for s, entry in zip(names, matrix, strict=True) if not entry.is_number}


def _determinant(matrix: sp.Matrix) -> sp.Expr:
    """Return a determinant, left unsimplified where the entries are too long."""
    if not heavy(sp.Tuple(*matrix)):
        return matrix.det(method="berkowitz")
    names, meaning = _entries_named(matrix)
    return replaced(names.det(method="berkowitz"), meaning)


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


def guards(system: "System", branch: Branch) -> tuple[Guard, ...]:
    """Return the guards of the mode that depend on the states or the time, with the forces substituted."""
    moving = {system.time} if stands(branch) else {*system.states, system.time}
    return tuple(g for g in _placed_guards(system, branch) if g.value.free_symbols & moving)


def fixed_guards(system: "System", branch: Branch) -> tuple[Guard, ...]:
    """Return the guards that depend on parameters alone; the mode can be entered only where these are positive."""
    moving = {*system.states, system.time}
    return tuple(g for g in _placed_guards(system, branch) if not g.value.free_symbols & moving)


def _placed_guards(system: "System", branch: Branch) -> list[Guard]:
    found = _every_guard(system, awake(branch))
    return [g for g in found if g.kind in NEVER_IDLE or g.kind not in branch[g.friction].idle]


@lru_cache(maxsize=256)
def _every_guard(system: "System", branch: Branch) -> tuple[Guard, ...]:
    if stands(branch):
        return unused_rows(system, branch)[1] if system.time else ()
    solved, found = forces(system, branch), []
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        v, load = friction.velocity, friction.load
        if phase == OPEN:
            found.append(Guard("touch_down", k, friction.gap))
            continue
        if friction.gap is not None:
            found.append(Guard("lift_off", k, -friction.gap if friction.constraint is None else friction.normal))
        if phase.velocity:
            if not lifts(friction) and not _never_negative(system, phase.load * load):
                found.append(Guard("force_zero", k, phase.load * load))
            found.append(Guard("velocity_zero", k, phase.velocity * v))
        else:
            found += _edges(friction, phase, k)
    found += _unambiguous(system, branch)
    return tuple(_divided(g._replace(value=_with_powers(_put(system, branch, g.value, solved)))) for g in found)


def _edges(friction: "Friction", phase: Phase, k: int) -> list[Guard]:
    """Return the guards of a contact that sticks, the friction forces left at the two edges of its cone."""
    bound = friction.static * phase.load * friction.load
    return [Guard("slip_onset", k, bound + friction.force), Guard("slip_onset", k, bound - friction.force, True)]


@lru_cache(maxsize=64)
def standing_rows(system: "System", branch: Branch) -> tuple[tuple[sp.Expr, ...], tuple[Guard, ...]]:
    """Return what is 0 where the system rests on the contacts of a branch, and the margins that must not be negative.

    All are linear in the forces. First the rates are 0, then laws of reactions, forces of open contacts, and what the
    time alone adds to sliding velocities. Loads of closed rigid contacts and edges of stick must not be negative.
    """
    zeros, margins = [*system.rates.values()], list[Guard]()
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        zeros += [_reaction_law(friction, phase)] if friction.normal is not None else []
        if phase == OPEN:
            zeros.append(friction.force)
            continue
        zeros += [slope_by(friction.velocity, system.time)] if system.time else []
        if friction.constraint is not None:
            kind = "force_zero" if friction.gap is None else "lift_off"
            margins.append(Guard(kind, k, phase.load * friction.load))
        margins += _edges(friction, phase, k)
    return tuple(zeros), tuple(margins)


def unused_rows(system: "System", branch: Branch) -> tuple[tuple[sp.Expr, ...], tuple[Guard, ...]]:
    """Return the ``standing_rows`` of a branch besides those that determine its forces, at these forces."""
    solved, used = forces(system, branch), still_rows(branch)
    zeros, margins = standing_rows(system, branch)
    left = tuple(_put(system, branch, row, solved) for k, row in enumerate(zeros) if k not in used)
    free = (margin for k, margin in enumerate(margins, start=len(zeros)) if k not in used)
    return left, tuple(margin._replace(value=_put(system, branch, margin.value, solved)) for margin in free)


def _never_negative(system: "System", expr: sp.Expr) -> bool:
    """Tell whether an expression is negative at no real states, as an even power: rounding alone would lose it."""
    real = {s: sp.Dummy(real=True) for s in (*system.states, system.time)}
    return bool(_with_powers(expr).xreplace(real).is_nonnegative)


@lru_cache(maxsize=512)
def _with_powers(expr: sp.Expr) -> sp.Expr:
    """Return a polynomial with its multiple factors as powers: written out, they are rounding near their zeros."""
    squares = any(power.exp.is_Integer and power.exp > 1 for power in atoms(expr, sp.Pow))
    if not (expr.is_Add and squares) or is_longer(expr, LONG) or not expr.is_polynomial():
        return expr
    factor, found = sp.sqf_list(expr)
    return sp.Mul(factor, *(part**k for part, k in found)) if any(k > 1 for _, k in found) else expr


def _divided(guard: Guard) -> Guard:
    """Return a guard without the powers of the penetration in it, which are positive while the contact is closed."""
    value = without_penetration(guard.value)
    return guard if value == guard.value or guard.kind == "lift_off" else guard._replace(value=value, divided=True)


def _unambiguous(system: "System", branch: Branch) -> list[Guard]:
    """Return the guards of sliding rigid contacts: the reactions stay bounded, and no second motion appears.

    With one rigid contact the constraint is 0 = a + p N, and the motion is unique while p has the same sign as without
    friction (``unbounded``). A bilateral constraint also needs this of the p for the other sign of N (``several``).
    With several rigid contacts p is the determinant of their equations, and second motions are sought at events only.
    """
    rigid = [k for k, f in enumerate(system.frictions) if f.constraint is not None]
    sliding = [k for k in rigid if branch[k].velocity]
    if not sliding:
        return []
    k, *_ = sliding
    found = [Guard("unbounded", k, _stiffness(system, branch))]
    if len(rigid) == 1 and system.frictions[k].gap is None:
        other = (*branch[:k], branch[k]._replace(load=-branch[k].load), *branch[k + 1 :])
        found.append(Guard("several", k, _stiffness(system, other)))
    return found


def _stiffness(system: "System", branch: Branch) -> sp.Expr:
    """Return the determinant of the equations of the forces, times the same determinant without sliding friction."""
    unknowns, matrix, _ = _equations(system, branch)
    alone = matrix.as_mutable()
    for friction, phase in zip(system.frictions, branch, strict=True):
        if phase.velocity:
            row = unknowns.index(friction.force)
            alone[row, :] = sp.eye(len(unknowns))[row, :]
    return sp.Mul(*map(_determinant, (alone, matrix)))


def drive(system: "System", friction: "Friction") -> tuple[sp.Expr, sp.Expr]:
    """Return (d, c) in the rate of the sliding velocity, v' = d + c F; a reaction without constraint is the load."""
    rate = velocity_rate(system, friction)
    if friction.normal is not None and friction.constraint is None:
        rate = rate.xreplace({friction.normal: friction.load})
    rate = rate if heavy(rate) else sp.expand(rate)
    return rate.xreplace({friction.force: sp.S.Zero}), rate.diff(friction.force)


def velocity_rate(system: "System", friction: "Friction") -> sp.Expr:
    """Return the rate of the sliding velocity along the field, with the forces as symbols."""
    return rate_along(system, friction.velocity)


def rate_along(system: "System", expr: sp.Expr) -> sp.Expr:
    """Return the rate of an expression in the states along the field, with the forces as symbols."""
    terms = [slope_by(expr, s) * r for s, r in system.rates.items() if expr.has(s)]
    return expanded(sp.Add(*terms, slope_by(expr, system.time) if system.time else 0))


def check_friction(system: "System", friction: "Friction", number: int) -> None:
    """Raise ``InputError`` where a friction is ill-posed: no state in its velocity, its force in no rate, and so on."""
    which = f"friction {number}" if len(system.frictions) > 1 else "the friction"
    v, states = friction.velocity, system.states
    if not v.free_symbols & {*states}:
        raise InputError(f"{which}: the velocity {short(v)} must depend on the states {', '.join(map(str, states))}")
    if friction.force in (*states, system.small, system.time):
        raise InputError(f"{which}: the force {friction.force} is also a state, the small parameter or the time")
    moved = {s: rate for s, rate in system.rates.items() if rate.has(friction.force)}
    if not moved:
        raise InputError(f"{which}: the force {friction.force} enters no rate; write it where it acts")
    if any(r.diff(friction.force, 2) != 0 for r in moved.values()):
        raise InputError(f"{which}: the force {friction.force} must enter the rates linearly")
    if any(sp.expand(slope).free_symbols & moved.keys() for s in moved if (slope := slope_by(v, s)).has(*moved)):
        raise InputError(f"{which}: the velocity {short(v)} must be linear in what {friction.force} moves, "
                         f"{', '.join(map(str, moved))}; give one that passes through 0")  # fmt: skip
    if any(
        e is not None and e.has(sp.Float) for e in (v, friction.load, friction.kinetic, friction.static, friction.gap)
    ):
        raise InputError(f"{which} contains a float; symbols are exact, give sp.Rational(1, 5) for 0.2")


def check_gap_rate(system: "System", friction: "Friction") -> None:
    """Raise ``InputError`` where a constraint is clearly no multiple of the rate of its gap_rate, by values at a place.

    The ratio of a multiple to the rate does not change with the forces.
    """
    if friction.gap_rate is None:
        return
    both = sp.Tuple(friction.constraint, rate_along(system, friction.gap_rate))
    place = {s: v.evalf(30) for s, v in generic_place(both).items()}
    forces = [s for f in system.frictions for s in (f.force, f.normal) if s in place]
    pushed = place | {s: factor * place[s] for factor, s in enumerate(forces, 3)}
    values = [replaced(e, at) for at in (place, pushed) for e in both]
    if not all(v.is_number and v.is_finite and v.is_real for v in values):
        return
    first, second = values[0] * values[3], values[2] * values[1]
    if abs(first - second) > ROUGH * (abs(first) + abs(second)):
        raise InputError(f"friction: the rate of gap_rate = {short(friction.gap_rate)} is {short(both[1])}, and the "
                         f"constraint {short(both[0])}; the constraint must be this rate")  # fmt: skip


def _friction_law(system: "System", branch: Branch, k: int) -> sp.Expr:
    friction, phase = system.frictions[k], branch[k]
    if phase == OPEN:
        return friction.force
    if phase.velocity:
        coefficient = friction.static if rests_in_all_but_name(system, branch, k) else friction.kinetic
        return friction.force + phase.load * phase.velocity * coefficient * friction.load
    return velocity_rate(system, friction)


def rests_in_all_but_name(system: "System", branch: Branch, k: int) -> bool:
    """Tell whether a contact that slips in a branch cannot move there, and static friction exceeds kinetic friction.

    The other contacts at rest hold such a contact, so its force is not determined. The branch gives it the largest
    possible force, its static friction (Lemma 10).
    """
    friction = system.frictions[k]
    return friction.static != friction.kinetic and _is_carried(system, branch, k)


def _is_carried(system: "System", branch: Branch, k: int) -> bool:
    """Tell whether the velocity of a contact that slips in a branch is a combination of velocities that are 0 there."""
    return bool(branch[k].velocity) and k in _dependent(system) and bool(_is_combination(system, at_rest(branch), k))


@lru_cache(maxsize=64)
def _dependent(system: "System") -> frozenset[int]:
    """Return the frictions whose velocity is, or may be, a combination of the velocities of the others."""
    every = frozenset(range(len(system.frictions)))
    return frozenset(k for k in every if _is_combination(system, every - {k}, k) in (True, None))


@lru_cache(maxsize=1024)
def _is_combination(system: "System", some: frozenset[int], k: int) -> bool | None:
    """Tell whether the velocity of friction k is a combination of those of ``some``; None where they are too long."""
    rows = sp.Matrix([_affine_row(system, system.frictions[j].velocity) for j in (*sorted(some), k)])
    if heavy(sp.Tuple(*rows)):
        return None
    ranks = [part.rank(iszerofunc=lambda e: sp.cancel(e) == 0) for part in (rows[:-1, :], rows)]
    return ranks[0] == ranks[1]


def moves_alike(system: "System", one: Branch, other: Branch) -> bool:
    """Tell whether two branches differ at most in their idle guards and in how contacts at rest share their forces."""
    ways = [[phase._replace(velocity=0) if _is_carried(system, branch, k) else phase for k, phase in enumerate(branch)]
            for branch in map(bare, (one, other))]  # fmt: skip
    return ways[0] == ways[1]


def _affine_row(system: "System", velocity: sp.Expr) -> list[sp.Expr]:
    """Return the derivatives of a velocity by all states, and then its remainder after the linear terms."""
    slopes = {s: slope_by(velocity, s) for s in system.states}
    return [*slopes.values(), sp.expand(velocity - sum(s * slope for s, slope in slopes.items()))]


def _reaction_law(friction: "Friction", phase: Phase) -> sp.Expr:
    if phase == OPEN:
        return friction.normal
    return friction.normal - friction.load if friction.constraint is None else friction.constraint


def _sliding(system: "System", branch: Branch, friction: "Friction") -> tuple[sp.Expr, sp.Expr]:
    others = {f.force for f in system.frictions if f is not friction}
    found, coupling = drive(system, friction)
    return (found, coupling) if not others else (found.subs(dict.fromkeys(others, 0)), coupling)


def held(system: "System", branch: Branch) -> set[sp.Symbol]:
    """Return the states that are sliding velocities of sticking contacts: their rates are set to 0 exactly."""
    sticking = (f for f, phase in zip(system.frictions, branch, strict=True) if phase.mode == "stick")
    return {f.velocity for f in sticking if f.velocity.is_Symbol}


def lifts(friction: "Friction") -> bool:
    """Tell whether the contact opens exactly where its load vanishes, so that the load keeps its sign while closed.

    This holds of a rigid contact, and of a load that is a multiple of the gap or of a power of the penetration.
    """
    if friction.gap is None:
        return False
    if friction.constraint is not None:
        return True
    ratio = without_penetration(friction.load)
    ratio = sp.cancel(friction.load / friction.gap) if ratio == friction.load else ratio
    return not ratio.free_symbols & (friction.load.free_symbols & friction.gap.free_symbols)


def _put(system: "System", branch: Branch, expr: sp.Expr, solved: dict) -> sp.Expr:
    return tidied(replaced(_signed(system, branch, expr), solved))


def _signed(system: "System", branch: Branch, expr: sp.Expr) -> sp.Expr:
    """Replace the sign and the absolute value of every sliding velocity and load by those that the branch gives.

    Where only the product of both signs is known, sign(load) becomes sign(velocity) or -sign(velocity).
    """
    if not expr.has(sp.Abs, sp.sign):
        return expr
    known: dict[sp.Basic, sp.Basic] = {}
    for friction, phase in zip(system.frictions, branch, strict=True):
        if not phase.either:
            known |= put_sign(friction.velocity, sp.Integer(phase.velocity))
            known |= put_sign(friction.load, sp.Integer(phase.load))
        elif phase.velocity:
            known |= put_sign(friction.load, phase.load * phase.velocity * sp.sign(friction.velocity))
        else:
            known |= put_sign(friction.velocity, sp.S.Zero)
    return without_squares(expr.subs(known), {sp.sign(f.velocity) for f in system.frictions})


def put_sign(quantity: sp.Expr, sign: sp.Expr) -> dict[sp.Basic, sp.Basic]:
    """Return the substitutions of ``sign`` for sign(quantity), and of ``sign * quantity`` for |quantity|.

    None is needed for a quantity such as 1 + |x|, whose sign SymPy knows: both expressions are then evaluated.
    """
    found = {sp.Abs(quantity): sign * quantity, sp.sign(quantity): sign,
             sp.Abs(-quantity): sign * quantity, sp.sign(-quantity): -sign}  # fmt: skip
    return {key: value for key, value in found.items() if isinstance(key, sp.Abs | sp.sign)}


def without_squares(expr: sp.Expr, signs: Collection[sp.Expr]) -> sp.Expr:
    """Return ``expr`` with 1 for the square of every one of ``signs``."""
    return expr.replace(lambda e: e.is_Pow and e.exp.is_Integer and e.base in signs, lambda e: e.base ** (e.exp % 2))


def of_either_sign(system: "System", branch: Branch) -> tuple[sp.Expr, ...]:
    """Return the quantities of unknown sign that keep it in a mode: velocities in slip, loads in stick."""
    either = ((f, phase) for f, phase in zip(system.frictions, branch, strict=True) if phase.either)
    return tuple(f.velocity if phase.velocity else f.load for f, phase in either)
