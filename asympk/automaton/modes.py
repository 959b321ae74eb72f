"""The modes of a system in symbols, with rates, guards and Lie derivatives.

``GuardedMode`` is one mode. Functions that switch (``Piecewise``, ``Max``, ``Abs``) are taken on the ``sides`` of their
phases. The Lie derivatives of a guard g along the field f, g_t + g_w f and so on, decide what follows where g = 0.
``compiled`` makes functions of them.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain, islice

import sympy as sp

from asympk.automaton.compiled import Direction
from asympk.automaton.poles import divisors_of, largest_power
from asympk.errors import InputError
from asympk.formulas import NOT_FINITE
from asympk.symbolic import branches, guards
from asympk.symbolic.branches import Branch, Guard
from asympk.symbolic.coefficients import scattered
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import atoms, is_clearly_nonzero, replaced, symbols_in
from asympk.symbolic.penetration import Penetration, without_penetration
from asympk.symbolic.sides import (
    MOST,
    SWITCHING,
    Sides,
    inside,
    is_switched,
    on_sides,
    phase_of,
    phases,
    sides_of,
    switching_parts,
    system_on_sides,
    with_real_powers,
)
from asympk.symbolic.switches import Middle, Switch, middles_of, switches
from asympk.symbolic.system import Friction, System

RECORD = 300  # most phases of the time, as a record of ground motion has, on whose sides a model may ask for a mode
SWITCH, NO_FRICTION = "switch", -1  # the kind and the friction of the guard at which a side ends


@dataclass(frozen=True)
class GuardedMode:
    """One smooth mode in the symbols of its system: rates in the order of the states, and guards.

    Functions that switch by the state are taken on the ``sides`` of their phases, which end at guards ``switch``.
    """

    system: System
    branch: Branch
    sides: Sides = ()

    @property
    def name(self) -> str:
        """The name of the mode."""
        return branches.mode_name(self.branch)

    @cached_property
    def sided(self) -> System:
        """The system with its sliding velocities, and so the equations of its forces, on the sides of the mode."""
        return system_on_sides(self.system, turning(self.system, self._at_rest_on(self.sides)))

    def _at_rest_on(self, sides: Sides) -> Sides:
        """Return sides with 0 for velocities at rest: a belt has its speed there, whichever side rules a force."""
        at_rest = (self._directed(self.system.frictions[k].velocity) for k in branches.at_rest(self.branch) if sides)
        rest = {phase_of(on_sides(velocity, sides))[0]: 0 for velocity in at_rest}
        return tuple((phase, rest.get(phase, side)) for phase, side in sides)

    @cached_property
    def rates(self) -> tuple[sp.Expr, ...]:
        """The rate of every state, in the order of ``system.states``."""
        return tuple(map(self._placed, self.system.divided(*guards.fields(self.sided, self.branch)).values()))

    @cached_property
    def reactions(self) -> tuple[sp.Expr, ...]:
        """What the reaction of each rigid contact adds to the rates, in the order of the states; () for a stand."""
        solved = {} if branches.stands(self.branch) else guards.forces(self.sided, self.branch)
        normals = [f.normal for f in self.system.frictions if f.rigid and f.normal in solved]
        rates = self.sided.rates.values()
        return tuple(self._placed(slope_by(rate, N) * solved[N]) for N in normals for rate in rates)

    @cached_property
    def is_finite(self) -> bool:
        """Whether all rates and guards have a value on the sides; on the side u = 0, u/|u| has none."""
        return not atoms(sp.Tuple(*self.rates, *self.guard_values), sp.Basic) & {*NOT_FINITE}

    @cached_property
    def units(self) -> tuple[Direction, ...]:
        """The directions in which one state grows while the time and all other states stand still."""
        n = len(self.system.states)
        return tuple((sp.S.Zero, *row) for row in sp.eye(n).tolist())

    @property
    def flow(self) -> Direction:
        """The direction of the motion: the rates of time and states."""
        return (sp.S.One, *self.rates)

    @cached_property
    def guards(self) -> tuple[Guard, ...]:
        """The guards, positive inside the mode."""
        found = guards.guards(self.system, self.branch)
        if self.sided is not self.system:
            own = {guard.key: guard for guard in guards.guards(self.sided, self.branch)}
            found = tuple(own.get(guard.key, guard) for guard in found)  # as many on every side
        ends = (Guard(SWITCH, NO_FRICTION, on_sides(edge, self.sides)) for edge in self.edges)
        placed = (guard._replace(value=self._placed(guard.value)) for guard in found)
        return (*(self._beside_rest(guard) if guard.kind == "velocity_zero" else guard for guard in placed), *ends)

    def _beside_rest(self, guard: Guard) -> Guard:
        """Return the guard of a velocity without the states that velocities at rest give, as multiples of these are 0.

        The digits of a small difference of two velocities are lost where the numbers are subtracted.
        """
        value = guard.value
        for rest in (self.velocities[k] for k in sorted(branches.at_rest(self.branch))):
            slopes = ((slope_by(rest, s), slope_by(value, s)) for s in self.system.states if rest.has_free(s))
            share = next((b / a for a, b in slopes if a.is_number and a != 0), sp.S.Zero)
            left = value - share * rest
            value = left if share.is_number and symbols_in(left) & {*self.system.states} else value
        return guard._replace(value=value)

    def _placed(self, expr: sp.Expr) -> sp.Expr:
        """Return an expression on ``all_sides``; its powers stay real where a step ends shortly beyond the mode."""
        return with_real_powers(on_sides(expr, self.all_sides), self.all_sides)

    @cached_property
    def all_sides(self) -> Sides:
        """The sides of the mode, and those on which it slips."""
        return (*self.sides, *self.slipping)

    @cached_property
    def slipping(self) -> Sides:
        """The signs of the sliding velocities of the mode as sides."""
        sliding = [(f.velocity, phase.velocity) for f, phase in zip(self.system.frictions, self.branch, strict=True)
                   if phase.slips and not phase.either]
        return tuple((phase, factor * sign) for velocity, sign in sliding for phase, factor in [phase_of(velocity)])

    def sides_beyond(self, after: "GuardedMode") -> Sides:
        """Return the sides on which a motion would go on as in this mode: those of ``after``, and edges of rest."""
        still = dict(side for side in self.sides if not inside(*side))
        return tuple({**dict(self.sides), **dict(after.sides), **still}.items())

    @cached_property
    def edges(self) -> tuple[sp.Expr, ...]:
        """The quantities that are positive on the sides of the mode and vary: the values of its last guards.

        Of the quantities that the time alone moves, only those that fall to 0 first are edges. Of multiples of one
        another only the first is one.
        """
        apart = dict[tuple, sp.Expr]()
        for edge in chain.from_iterable(inside(*side) for side in self.sides):
            apart.setdefault(phase_of(edge), edge)
        edges = {edge: _time_of_fall(edge, self.system.time) for edge in apart.values()}
        first = min((t for t in edges.values() if t is not None), default=sp.oo)
        return tuple(edge for edge, t in edges.items() if t == first or (t is None and self.drift(edge) != 0))

    @property
    def moving(self) -> set[sp.Symbol | None]:
        """The states and the time."""
        return {*self.system.states, self.system.time}

    @property
    def closed(self) -> dict[int, Friction]:
        """The frictions that are not open, by their numbers."""
        contacts = enumerate(zip(self.system.frictions, self.branch, strict=True))
        return {k: friction for k, (friction, phase) in contacts if not phase.is_open}

    @property
    def kept_gaps(self) -> dict[int, sp.Expr]:
        """The gaps of closed rigid contacts, which the mode keeps at 0, by the numbers of the frictions."""
        return {k: f.gap for k, f in self.closed.items() if f.unilateral}

    @cached_property
    def open_phases(self) -> tuple[sp.Expr, ...]:
        """The phases of the states and the time that still switch the mode, which is on no side of them.

        They are the phases of rates and guards, and also of idle guards (which stay 0 on their side only), of sliding
        velocities of closed contacts (which may jump, as on a belt), of gaps kept closed (whose ground may jump), and
        of what must stay 0 for a system at rest to stand.
        """
        guards = mode_of(self.system, branches.without_idle(self.branch), self.sides).guard_values
        kept = (*self.velocities.values(), *self.kept_gaps.values(), *self.standing)
        return phases((*self.rates, *guards, *map(self._placed, kept)), self.system.states, self.system.time)

    @property
    def standing(self) -> tuple[sp.Expr, ...]:
        """What must stay 0, as the time goes on, for a system at rest on contacts with undetermined forces to stand."""
        timed = self.system.time is not None and branches.stands(self.branch)
        return guards.unused_rows(self.sided, self.branch)[0] if timed else ()

    @cached_property
    def fixed_phases(self) -> tuple[sp.Expr, ...]:
        """The phases of parameters and time alone that still switch the mode, which is on no side of them."""
        known = {*self.system.parameters, self.system.time} - {None}
        found = phases((*self.rates, *self.guard_values), known, most=RECORD)
        return tuple(phase for phase in found if symbols_in(phase) <= known)

    @cached_property
    def switches(self) -> list[Switch]:
        """The switches of the mode by the time alone, of phases that are linear in the time."""
        return switches((*self.rates, *self.guard_values), self.system.time, self.system.parameters)

    @cached_property
    def fixed_guards(self) -> tuple[Guard, ...]:
        """The guards that neither the state nor the time moves."""
        return guards.fixed_guards(self.system, self.branch)

    @cached_property
    def scattered(self) -> tuple[sp.Expr, ...]:
        """The coefficients that are scattered over sums of the rates and guards."""
        return scattered(self.system, (*self.rates, *self.guard_values))

    @cached_property
    def grounds(self) -> dict[int, tuple[sp.Expr, sp.Expr]]:
        """The gap and gap rate, on the sides of the mode, of closed rigid contacts whose gap switches; by friction."""
        return {k: (on_sides(gap, self.sides), on_sides(branches.rate_along(self.system, gap), self.sides))
                for k, gap in self.kept_gaps.items() if is_switched(gap, self.moving)}

    @cached_property
    def jumping(self) -> dict[int, sp.Expr]:
        """The sliding velocities that switch, on the sides of the mode, by the numbers of the closed rough contacts."""
        rough = {k: velocity for k, velocity in self.velocities.items() if not self.branch[k].smooth}
        return {k: v for k, v in rough.items() if is_switched(self.system.frictions[k].velocity, self.moving)}

    @cached_property
    def velocities(self) -> dict[int, sp.Expr]:
        """The sliding velocities of the closed frictions, by their numbers, with the signs and sides of the mode."""
        sides = self._at_rest_on(self.all_sides)
        return {k: on_sides(self._directed(friction.velocity), sides) for k, friction in self.closed.items()}

    def _directed(self, velocity: sp.Expr) -> sp.Expr:
        return branches.with_signs(self.system, self.branch, velocity)

    @property
    def conditions(self) -> tuple[sp.Expr, ...]:
        """The values of the fixed guards, which must be positive for the mode to be entered at all."""
        return tuple(guard.value for guard in self.fixed_guards)

    @property
    def guard_values(self) -> tuple[sp.Expr, ...]:
        """The expressions of the guards."""
        return tuple(guard.value for guard in self.guards)

    @cached_property
    def poles(self) -> tuple[sp.Expr, ...]:
        """The divisors of the rates that vary and may vanish; their zeros are poles of the rates.

        A square root is never negative where the rates are real, so that 1 + sqrt(x) does not vanish.
        """
        real = {e: replaced(e, {root: sp.Dummy(nonnegative=True) for root in atoms(e, sp.Pow) if root.exp == sp.S.Half})
                for e in self._divisors.values()}
        return tuple(sorted((e for e, form in real.items() if not form.is_nonzero), key=sp.default_sort_key))

    @cached_property
    def removable(self) -> tuple[sp.Expr, ...]:
        """The powers of divisors that may vanish where rates, or guards, have a limit, and rounding is large beside."""
        divisors = chain(self._divisors.items(), divisors_of(self.watched, self.moving).items())
        found = {e for e, pole in divisors if pole != e != self._divisors.get(e)}
        exprs = *self.rates, *self.watched
        return tuple(sorted((largest_power(exprs, e) for e in found), key=sp.default_sort_key))

    @cached_property
    def _divisors(self) -> dict[sp.Expr, sp.Expr]:
        return divisors_of(self.rates, self.moving)

    @cached_property
    def middles(self) -> tuple[Middle, ...]:
        """Where, but at the zeros of guards and poles, a rate or guard may have the middle of a bump."""
        found = middles_of((*self.rates, *self.guard_values), self.system.states, self.system.time)
        ends = {phase_of(value)[0] for value in (*self.guard_values, *self.poles)} if found else ()
        return tuple(middle for middle in found if middle.phase not in ends)

    @cached_property
    def laws(self) -> tuple[sp.Expr, ...]:
        """The kinetic frictions of contacts that slip which may be negative, if they vary with the state or the time.

        Such a law may still be constant on one side of a switch, or in one direction of sliding.
        """
        slipping = (f for f, phase in zip(self.sided.frictions, self.branch, strict=True) if phase.slips)
        vary = (f.kinetic for f in slipping if symbols_in(f.kinetic) & self.moving)
        laws = (self._placed(branches.with_signs(self.sided, self.branch, law)) for law in vary)
        known = {*self.moving, *self.system.parameters}
        return tuple(law for law in laws if symbols_in(law) <= known and not law.is_nonnegative)

    @cached_property
    def watched(self) -> tuple[sp.Expr, ...]:
        """What a motion in the mode keeps above 0: the expressions of the guards and, after them, the ``laws``."""
        return (*self.guard_values, *self.laws)

    @cached_property
    def order_in_time(self) -> int:
        """The largest exponent of a power that the time moves: fewer of its derivatives vanish where the power does."""
        powers = atoms(sp.Tuple(*self.rates, *self.guard_values), sp.Pow)
        moved = (p.exp for p in powers if p.exp.is_real and p.exp.is_number and self.system.time in symbols_in(p.base))
        return max((int(sp.ceiling(exp)) for exp in moved), default=0)

    def lie_derivative(self, expr: sp.Expr) -> sp.Expr:
        """Return the derivative of ``expr`` along the field: its Lie derivative plus its partial time derivative."""
        moved = sum((slope_by(expr, s) * r for s, r in zip(self.system.states, self.rates, strict=True)), sp.S.Zero)
        return moved + (slope_by(expr, self.system.time) if self.system.time else 0)

    @lru_cache(maxsize=512)
    def drift(self, expr: sp.Expr) -> sp.Expr:
        """Return the derivative of ``expr`` along the field, 0 if it or ``expr`` is a multiple of a kept velocity."""
        rate = sp.S.Zero if self._is_kept(expr) else self.lie_derivative(expr)
        return sp.S.Zero if self._is_kept(rate) else rate

    def _is_kept(self, expr: sp.Expr) -> bool:
        return any(_is_multiple(expr, velocity, self.system.states) for velocity in self.kept_velocities)

    @cached_property
    def kept_velocities(self) -> tuple[sp.Expr, ...]:
        """What the mode keeps at 0: sliding velocities at rest, and gap rates of closed rigid contacts."""
        found = [self.velocities[k] for k in sorted(branches.at_rest(self.branch))]
        found += [branches.rate_along(self.system, gap) for gap in self.kept_gaps.values()]
        found += [f.gap_rate for f in self.closed.values() if f.gap_rate is not None]
        return tuple(on_sides(velocity, self.sides) for velocity in found)

    @lru_cache(maxsize=512)
    def derivative(self, guard: int, order: int) -> sp.Expr:
        """Return the derivative of the given order of a guard along the field; order 0 is the guard itself.

        Factors that are powers of the penetration are left out of every derivative (Lemma 11): they are positive in
        the mode, and need not have a Taylor series in t.
        """
        if order == 0:
            return self.guards[guard].value
        return without_penetration(self.lie_derivative(self.derivative(guard, order - 1)))

    @lru_cache(maxsize=512)
    def rates_behind(self, expr: sp.Expr) -> tuple[sp.Expr, ...] | None:
        """Return the rates of all states on which ``expr`` depends, also through rates; None if the time is one."""
        rates = dict(zip(self.system.states, self.rates, strict=True))
        found: dict[sp.Symbol, sp.Expr] = {}
        left = [expr]
        while left:
            states = symbols_in(left.pop()) & rates.keys() - found.keys()
            found |= {s: rates[s] for s in states}
            left += [rates[s] for s in states]
        timed = self.system.time in symbols_in(sp.Tuple(expr, *found.values()))
        return None if timed else tuple(found[s] for s in rates if s in found)

    @lru_cache(maxsize=512)
    def keeps(self, expr: sp.Expr) -> bool:
        """Tell whether no motion leaves the zeros of ``expr``: solved for a state, they make its derivative 0."""
        used = symbols_in(expr)
        slopes = ((s, slope_by(expr, s)) for s in self.system.states if s in used)  # 0 for one that only switches
        even = ((s, slope) for s, slope in slopes if slope != 0 and not symbols_in(slope) & self.moving)
        zeros = ({s: sp.expand(s - expr / slope)} for s, slope in even)
        zero = next(zeros, None)
        return zero is not None and _vanishes(replaced(self.drift(expr), zero))

    @cached_property
    def pressed(self) -> bool:
        """Whether a rate or a guard of the mode contains the penetration of a contact."""
        return bool(atoms(sp.Tuple(*self.rates, *self.guard_values), Penetration))


@lru_cache(maxsize=512)
def mode_of(system: System, branch: Branch, sides: Sides = ()) -> GuardedMode:
    """Return the mode of a branch; the same object each time, so that its derivations are made once."""
    return GuardedMode(system, branch, sides)


@lru_cache(maxsize=256)
def has_switches(system: System) -> bool:
    """Tell whether the state or the time switches an expression of a system."""
    return any(is_switched(expr, (*system.states, system.time)) for expr in system.expressions)


def has_law(system: System, sides: Sides) -> bool:
    """Tell whether a system has a law on the given ``sides``; on one side only, its sliding velocities may depend."""
    with suppress(InputError):
        return bool(system_on_sides(system, sides))
    return False


@lru_cache(maxsize=512)
def turning(system: System, sides: Sides) -> Sides:
    """Return the sides on which sliding velocities and gaps switch, none if a friction ceases to be one there.

    On one side only, velocities may depend on one another.
    """
    turns = phases((e for f in system.frictions for e in (f.velocity, f.gap) if e), system.states, system.time)
    found = tuple(side for side in sides if side[0] in turns)
    return found if has_law(system, found) else ()


@lru_cache(maxsize=256)
def phases_of(system: System) -> tuple[sp.Expr, ...]:
    """Return the phases of the state and the time that switch the modes of a system."""
    if not has_switches(system):
        return ()
    found = {phase for branch in guards.sample_branches(system) for phase in mode_of(system, branch).open_phases}
    return tuple(sorted(found, key=sp.default_sort_key))


@lru_cache(maxsize=256)
def is_nested(system: System) -> bool:
    """Tell whether a phase contains an expression that the state switches, as that of Max(|x| - y, 0) contains |x|."""
    parts = (part for atom in atoms(sp.Tuple(*system.expressions), *SWITCHING) for part in switching_parts(atom))
    return any(is_switched(part, system.states) for part in parts)


def on_all_sides(mode: GuardedMode) -> Iterator[GuardedMode]:
    """Yield a mode on sides of its open phases that show all its laws; the mode itself for none, or too many.

    A law is a sum. Phases in one term are on every choice of sides, at most ``MOST``. What others switch adds to what
    the first ones do, so that the phases of one term after the other leave their first sides.
    """
    moving = [s for s in (*mode.system.states, mode.system.time) if s is not None]
    choices = [[*islice(sides_of(phases, moving), MOST + 1)] for phases in _in_one_term(mode)]
    if not choices or max(map(len, choices)) > MOST:
        yield mode
        return
    first = [own[0] for own in choices]
    for k, own in enumerate(choices):
        for choice in own[k > 0 :]:
            sides = chain(mode.sides, *first[:k], choice, *first[k + 1 :])
            yield from on_all_sides(mode_of(mode.system, mode.branch, tuple(sides)))


def _in_one_term(mode: GuardedMode) -> list[set[sp.Expr]]:
    """Return the open phases of a mode in groups, one for the phases that switch one term of a rate or a guard."""
    groups = [{phase} for phase in mode.open_phases]
    for term in chain.from_iterable(map(_switched_terms, (*mode.rates, *mode.guard_values))):
        own = phases((term,), mode.system.states, mode.system.time)
        groups = [set().union(*(g for g in groups if g & {*own})), *(g for g in groups if not g & {*own})]
    return [group for group in groups if group]


def _switched_terms(expr: sp.Expr) -> Iterator[sp.Expr]:
    """Yield the terms of a sum that switch, those of a sum within a product, too, if no other factor switches."""
    if not (switched := [part for part in expr.args if atoms(part, *SWITCHING)]):
        return
    if expr.is_Add or (expr.is_Mul and len(switched) == 1):
        yield from chain.from_iterable(map(_switched_terms, switched))
    else:
        yield expr


def _time_of_fall(edge: sp.Expr, time: sp.Symbol | None) -> sp.Expr | None:
    """Return the time at which an edge falls through 0, infinity if it rises, or None if it is no line in time."""
    slope = slope_by(edge, time) if edge.free_symbols == {time} and not is_switched(edge, (time,)) else None
    if slope is None or not slope.is_Rational:
        return None
    return -edge.subs(time, 0) / slope if slope < 0 else sp.oo


def _is_multiple(expr: sp.Expr, other: sp.Expr, states: tuple[sp.Symbol, ...]) -> bool:
    ratios = (slope_by(expr, s) / slope_by(other, s) for s in states if other.has_free(s))
    return any(not c.free_symbols & {*states} and _vanishes(expr - c * other) for c in ratios)


def _vanishes(expr: sp.Expr) -> bool:
    """Tell whether ``expr`` expands to 0; numbers tell first of most that it does not."""
    return not is_clearly_nonzero(expr) and sp.expand(expr) == 0
