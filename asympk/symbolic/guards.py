r"""The modes of a system with friction: the fields and the guards of a branch, at the forces on it.

``fields``, ``guards`` and ``where`` put the solution of ``asympk.symbolic.forces`` into the rates, the margins of a
branch and its conditions. ``named_branches`` lists the branches; ``_every_guard`` is the hard function.
"""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import sympy as sp

from asympk.symbolic import branches
from asympk.symbolic.branches import OPEN, Branch, Guard, all_phases, one_per_mode, with_direction
from asympk.symbolic.forces import borne, determined, edges_of_stick, force_equations, forces, standing_rows
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import atoms, entries_named, heavy, replaced, symbols_in, tidied
from asympk.symbolic.penetration import without_penetration

if TYPE_CHECKING:
    from asympk.symbolic.system import System

Rates = Mapping[sp.Symbol, sp.Expr]
NEVER_IDLE = ("unbounded", "several")  # kinds of guards at whose loss a motion ceases to be the only one


def named_branches(system: "System") -> Iterator[Branch]:
    """Yield one branch for every name of a mode whose forces are determined.

    A stick is left out, for instance, where the force does not enter the rate of its velocity.
    """
    asked = asks_for_signs(system)
    choices = (one_per_mode(system, k, asked) for k in range(len(system.frictions)))
    return (branch for branch in product(*choices) if determined(system, branch))


def asks_for_signs(system: "System") -> bool:
    """Tell whether a rate, sliding velocity, load or friction bound contains an absolute value or a sign."""
    bounds = (e for f in system.frictions for e in (f.velocity, f.load, f.kinetic, f.static))
    return bool(atoms(sp.Tuple(*system.rates.values(), *bounds), sp.Abs, sp.sign))


def sample_branches(system: "System") -> Iterator[Branch]:
    """Yield branches that show every mode of every contact: one in which all slip, and those with one other phase.

    One phase of a mode suffices unless a formula contains a sign or an absolute value. Where the equations of rigid
    contacts that slip are singular, as at critical friction, these contacts are open or stick, all but one at a time.
    """
    asked = asks_for_signs(system)
    choices = [all_phases(system, k) if asked else one_per_mode(system, k) for k in range(len(system.frictions))]
    first = tuple(choice[0] for choice in choices)
    rigid = [k for k, friction in enumerate(system.frictions) if friction.rigid]
    if rigid and not determined(system, first):
        first = tuple(OPEN if OPEN in c else c[-1 if k in rigid else 0] for k, c in enumerate(choices))
    if not rigid or determined(system, first):
        yield first
    for k, choice in enumerate(choices):
        for phase in choice:
            branch = (*first[:k], phase, *first[k + 1 :])
            if branch != first and determined(system, branch):
                yield branch


def fields(system: "System", branch: Branch) -> tuple[Rates, Rates]:
    """Return the slow field and the fast field of the mode; the fast field is ``small`` times the rates."""
    return _fields(system, branches.without_idle(branch))


@lru_cache(maxsize=256)
def _fields(system: "System", branch: Branch) -> tuple[Rates, Rates]:
    if not branch:
        return system.slow, system.fast
    if branches.stands(branch):
        still = borne(system)
        slow, fast = ({s: sp.S.Zero if s in still else rate for s, rate in rates.items()}
                      for rates in (system.slow, system.fast))
        return slow, fast
    solved = forces(system, branch)
    resting = branches.held(system, branch)
    slow, fast = ({s: sp.S.Zero if s in resting else _put(system, branch, rate, solved) for s, rate in rates.items()}
                  for rates in (system.slow, system.fast))
    return slow, fast


def where(system: "System", branch: Branch) -> sp.Basic:
    """Return the condition on the states under which the mode holds, for both pairs of signs that its name covers.

    The load of a rigid contact is its reaction, by its symbol; forces in other loads are those of the mode.
    """
    conditions = []
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        v, load = friction.velocity, friction.load
        if not friction.rigid and branches.is_pushed(system, k):
            load = _put(system, branch, load, forces(system, branches.without_idle(branch)))
        if phase.is_open:
            conditions.append(friction.gap > 0)
            continue
        conditions += [friction.gap <= 0] if friction.gap is not None else []
        if phase.smooth:
            continue
        if phase.velocity:
            conditions.append(v * load > 0 if phase.mode == "slip_same" else v * load < 0)
        else:
            drive, coupling = branches.drive(system, friction)
            drive = drive.subs({f.force: 0 for f in system.frictions if f is not friction})
            size, slope = (sp.Abs(part, evaluate=not heavy(part)) for part in (drive, coupling))
            up, down = (with_direction(friction.velocity, friction.static * sp.Abs(load), side) for side in (1, -1))
            within = size <= up * slope if up == down else sp.And(drive <= up * slope, -down * slope <= drive)
            conditions.append(sp.And(sp.Eq(v, 0), within))
    return sp.And(*conditions)


def _determinant(matrix: sp.Matrix) -> sp.Expr:
    """Return a determinant, left unsimplified where the entries are too long."""
    if not heavy(sp.Tuple(*matrix)):
        return matrix.det(method="berkowitz")
    names, meaning = entries_named(matrix)
    return replaced(names.det(method="berkowitz"), meaning)


def guards(system: "System", branch: Branch) -> tuple[Guard, ...]:
    """Return the guards of the mode that depend on the states or the time, with the forces substituted."""
    moving = {system.time} if branches.stands(branch) else {*system.states, system.time}
    return tuple(g for g in _placed_guards(system, branch) if symbols_in(g.value) & moving)


def fixed_guards(system: "System", branch: Branch) -> tuple[Guard, ...]:
    """Return the guards that depend on parameters alone; the mode can be entered only where these are positive."""
    moving = {*system.states, system.time}
    return tuple(g for g in _placed_guards(system, branch) if not symbols_in(g.value) & moving)


def _placed_guards(system: "System", branch: Branch) -> list[Guard]:
    found = _every_guard(system, branches.without_idle(branch))
    return [g for g in found if g.kind in NEVER_IDLE or g.kind not in branch[g.friction].idle]


@lru_cache(maxsize=256)
def _every_guard(system: "System", branch: Branch) -> tuple[Guard, ...]:
    if branches.stands(branch):
        gaps = ((k, f.gap) for k, f in enumerate(system.frictions) if branch[k].is_open and f.gap is not None)
        touches = (Guard("touch_down", k, gap) for k, gap in gaps)
        return (*unused_rows(system, branch)[1], *touches) if system.time else ()
    solved, found = forces(system, branch), []
    for k, (friction, phase) in enumerate(zip(system.frictions, branch, strict=True)):
        v, load = friction.velocity, friction.load
        if phase.is_open:
            found += [Guard("touch_down", k, friction.gap)] if friction.gap is not None else []
            continue
        if friction.gap is not None:
            found.append(Guard("lift_off", k, friction.normal if friction.rigid else -friction.gap))
        if phase.smooth:
            continue
        if phase.velocity:
            if not branches.lifts(friction) and not branches.never_negative(system, phase.load * load):
                found.append(Guard("force_zero", k, phase.load * load))
            found.append(Guard("velocity_zero", k, phase.velocity * v))
        else:
            found += edges_of_stick(friction, phase, k)
    found += _unambiguous(system, branch) or _attracting(system, branch, solved)
    return tuple(_divided(g._replace(value=branches.with_powers(_put(system, branch, g.value, solved)))) for g in found)


def unused_rows(system: "System", branch: Branch) -> tuple[tuple[sp.Expr, ...], tuple[Guard, ...]]:
    """Return the ``standing_rows`` of a branch besides those that determine its forces, at these forces."""
    solved, used = forces(system, branch), branches.still_rows(branch)
    zeros, margins = standing_rows(system, branch)
    left = tuple(_put(system, branch, row, solved) for k, row in enumerate(zeros) if k not in used)
    free = (margin for k, margin in enumerate(margins, start=len(zeros)) if k not in used)
    return left, tuple(margin._replace(value=_put(system, branch, margin.value, solved)) for margin in free)


def _divided(guard: Guard) -> Guard:
    """Return a guard without the powers of the penetration in it, which are positive while the contact is closed."""
    value = without_penetration(guard.value)
    return guard if value == guard.value or guard.kind == "lift_off" else guard._replace(value=value, divided=True)


def _unambiguous(system: "System", branch: Branch) -> list[Guard]:
    """Return the guards of sliding contacts with forces in their loads: these stay bounded, without a second motion.

    With one rigid contact the constraint is 0 = a + p N, and the motion is unique while p has the same sign as without
    friction (``unbounded``). A bilateral constraint also needs this of the p for the other sign of N (``several``). So
    does a load N = a + b F of its own force, also where its contact may open.
    A contact slides where any friction does whose load contains its reaction, as in one direction of two. Open contacts
    do not count, nor joints without such a friction. With several contacts p is the determinant of their equations;
    second motions are then sought by ``asympk.automaton.uniqueness``.
    """
    closed = {k: rubs for k, rubs in branches.ambiguous_contacts(system).items() if not branch[k].is_open}
    sliding = [k for k, rubs in closed.items() if any(branch[j].slips for j in rubs)]
    if not sliding:
        return []
    k, *_ = sliding
    found = [Guard("unbounded", k, stiffness(system, branch))]
    contact = system.frictions[k]
    if len(closed) == 1 and (contact.gap is None or not (contact.rigid or branches.lifts(contact))):
        other = tuple(p._replace(load=-p.load) if j in closed[k] else p for j, p in enumerate(branch))
        found.append(Guard("several", k, stiffness(system, other)))
    return found


def _attracting(system: "System", branch: Branch, solved: dict) -> list[Guard]:
    """Return the guard of contacts at rest that no other motion appears: rest attracts while v' grows with the force.

    Where the forces contain a divisor that varies, they grow beyond the edges of stick before the guard vanishes, but
    for motions to a place where the force is 0/0. These are watched where the equations are polynomials, not those of
    a mechanism in angles, whose guard is positive.
    """
    resting, moving = sorted(branches.at_rest(branch)), {*system.states, system.time} - {None}
    values = sp.Tuple(*solved.values())
    divisors = {p.base for p in atoms(values, sp.Pow) if p.exp.is_negative} | atoms(values, InverseForm)
    divided = any(divisor.free_symbols & moving for divisor in divisors)
    entries = force_equations(system, branch)[1] if divided else ()
    if not resting or not all(entry.is_polynomial(*moving) for entry in entries):
        return []
    value = stiffness(system, branch)
    varies = value.free_symbols & moving and not branches.never_negative(system, value)
    return [Guard("several", resting[0], value)] if varies else []


def stiffness(system: "System", branch: Branch) -> sp.Expr:
    """Return the determinant of the equations of the forces, times the same determinant without friction."""
    unknowns, matrix, _ = force_equations(system, branch)
    alone = matrix.as_mutable()
    for friction, phase in zip(system.frictions, branch, strict=True):
        if not phase.is_open:
            row = unknowns.index(friction.force)
            alone[row, :] = sp.eye(len(unknowns))[row, :]
    return sp.Mul(*map(_determinant, (alone, matrix)))


def _put(system: "System", branch: Branch, expr: sp.Expr, solved: dict) -> sp.Expr:
    return tidied(replaced(branches.with_signs(system, branch, expr), solved))
