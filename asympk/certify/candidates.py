"""Candidates for the motion of an affine system after a state: branches on sides of switches, and what excludes them.

A law that switches with the state or the time has a mode on each side of the switch, and the edge of a side is one
more guard. ``Candidates`` makes the mode of a branch on every combination of sides on which a state may lie, and
``_verdict`` tells whether the mode holds from the state on (Lemma 12). The hard function is ``_has_no_forces``: it
excludes a branch whose forces are not determined where every corner of these forces violates a law (Lemma 10).
``forcing`` finds the waves that force any mode, over which all rows are.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import chain, combinations, islice, product
from math import prod

import sympy as sp

from asympk.affine.forcing import CONSTANT, Wave, with_derivatives
from asympk.affine.form import Form, affine_parts, form_of, row_over
from asympk.automaton.contacts import coupled, feels_directions
from asympk.automaton.modes import GuardedMode, mode_of, on_all_sides, turning
from asympk.certify.balls import Refused, flint
from asympk.certify.rows import (
    EnclosedState,
    ExactEntries,
    Row,
    ball_at,
    leading,
    leading_sign,
    row_rate,
    sign_at,
    spanned,
)
from asympk.certify.segments import AffineGuard, EnclosedMode
from asympk.numbers import Number
from asympk.symbolic import branches, forces
from asympk.symbolic.branches import Branch, Phase, all_phases
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.guards import NEVER_IDLE, sample_branches, unused_rows
from asympk.symbolic.long import replaced, symbols_in
from asympk.symbolic.sides import inside, is_switched, is_whole, measured, on_sides, phases, system_on_sides
from asympk.symbolic.system import System

MOST_CORNERS = 200
MOST_CANDIDATES, MOST_LISTED = 3**6, 3**9
MOST_PIVOTS, MOST_ORDERS = 200, 8


@lru_cache(maxsize=64)
def forcing(system: System) -> tuple[tuple[Wave, ...], tuple[sp.Expr, ...]]:
    """Return the waves that force the modes of a system or move edges of sides, and all entries of rows over them."""
    modes = [side for branch in sample_branches(system) for side in on_all_sides(mode_of(system, branch))]
    edges = [(mode, edge) for mode in modes for side in mode.sides for edge in inside(*side)]
    moving = {wave for edge in edges for wave in _affine_parts(*edge)[1]}
    waves = tuple(with_derivatives(moving.union(*(affine_form(mode).waves for mode in modes))))
    forms = chain.from_iterable(affine_form(mode, waves).entries for mode in modes)
    return waves, tuple(dict.fromkeys(chain(forms, *(row_of(*edge, waves) for edge in edges))))


@lru_cache(maxsize=1024)
def row_of(mode: GuardedMode, expr: sp.Expr, waves: tuple[Wave, ...]) -> tuple[sp.Expr, ...]:
    """Return the row of an expression on the sides of a mode; raises ``Refused`` where the expression has none."""
    slopes, forced = _affine_parts(mode, expr)
    if not {*forced} <= {*waves, CONSTANT}:
        raise Refused(f"forcing: {expr!s:.80} depends on functions of time that force no mode")
    return row_over(waves, slopes, forced)


def _affine_parts(mode: GuardedMode, expr: sp.Expr) -> tuple[tuple[sp.Expr, ...], dict[Wave, sp.Expr]]:
    if (found := affine_parts(mode.system, on_sides(expr, mode.sides))) is None:
        raise Refused(f"not affine: {expr!s:.80} is not linear in the states")
    return found


def affine_form(mode: GuardedMode, waves: tuple[Wave, ...] | None = None) -> Form:
    """Return the affine form of a mode over ``waves``, or over the waves it needs; raises ``Refused`` without one."""
    form = form_of(mode, waves or ())
    if form is None:
        raise Refused("not affine: a mode is not linear in the states")
    if waves is not None and form.waves != waves:
        raise Refused("forcing: a mode is forced by functions of time that force no mode of a single contact")
    return form


def _to_place(opened, mode):
    """Return those of some phases of a mode that do not switch themselves; these follow on the sides of the others."""
    return [phase for phase in opened if not is_switched(measured(phase), mode.moving)] or opened


@lru_cache(maxsize=256)
def _alone(system, group):
    """Return a system with some of its frictions alone, without the forces of all others."""
    own = [system.frictions[k] for k in group]
    others = dict.fromkeys({*system.pushes}.difference(*((f.force, f.normal) for f in own)), sp.S.Zero)
    slow, fast = ({s: replaced(rate, others) for s, rate in rates.items()} for rates in (system.slow, system.fast))
    return replace(system, slow=slow, fast=fast, frictions=own) if others else system


def _products(choices):
    """Return the products of some choices of phases; raises ``Refused`` where there are too many."""
    if (found := prod(map(len, choices))) >= MOST_LISTED:
        raise Refused(f"candidates: {found} choices of phases may follow at once; move the start a little")
    return product(*choices)


def in_name_only(system: System, branch: Branch) -> set[int]:
    """Return the contacts that slip in a branch in name only, as others hold them."""
    return {k for k in range(len(branch)) if forces.is_carried(system, branch, k)}


def _note(guards, guard, matrix, state):
    """Add a guard to a list, or its friction to that guard of the list with which it vanishes."""
    for place, other in enumerate(guards):
        apart, rows = tuple(a - b for a, b in zip(guard.row, other.row, strict=True)), []
        if not spanned(guard.row, (other.row,), state.field):
            if leading_sign(apart, matrix, state) != 0:
                continue
            while len(rows) < len(matrix) and not spanned(apart, rows, state.field):
                rows, apart = [*rows, apart], row_rate(apart, matrix)
        guards[place] = other._replace(others=(*other.others, guard.friction), null=(*other.null, *rows))
        return
    guards.append(guard)


def not_determined(branch: Branch) -> Refused:
    """Return the refusal of a branch whose forces are not determined."""
    return Refused(f"rest: the forces of {branches.mode_name(branch)} are not determined")


def _determining(rows, laws, branch):
    """Yield every choice of rows of a matrix, of which the first ones are laws, that determines the unknowns.

    Raises ``Refused`` where there are too many, or none.
    """
    if rows.rank() < rows.cols:
        raise not_determined(branch)
    kept: list[int] = []
    for k in range(laws):
        kept += [k] if rows[[*kept, k], :].rank() > len(kept) else []
    choices = [*islice(combinations(range(laws, rows.rows), rows.cols - len(kept)), MOST_CORNERS + 1)]
    if len(choices) > MOST_CORNERS:
        raise Refused(f"rest: the forces of {branches.mode_name(branch)} have more than {MOST_CORNERS} corners")
    yield from ((*kept, *more) for more in choices if rows[[*kept, *more], :].rank() == rows.cols)


class Candidates:
    """The modes of a system at exact parameters, each made when it is first needed, and which may hold at a state.

    ``here`` is the system on the sides of switches of sliding velocities, where certain, at the state last looked at.
    """

    def __init__(
        self, system: System, values: tuple[Number, ...], sides: Mapping[str, tuple[Number, Number]], until: Number
    ):
        self.system, self.here, self.until = system, system, Fraction(until)
        self._known: dict[GuardedMode, EnclosedMode | None] = {}
        self.waves, entries = forcing(system)
        self._plain = mode_of(system, (Phase(1, 1),) * len(system.frictions))
        self.field = ExactEntries(system, values, sides, entries)

    def look_at(self, state: EnclosedState) -> None:
        """Set ``here`` for a state at which candidates are to be found."""
        self.here = system_on_sides(self.system, turning(self.system, (*self._sides_of_velocities(state),)))

    def of(self, mode: GuardedMode) -> EnclosedMode | None:
        """Return the ``EnclosedMode`` of a mode, or None where the parameters exclude the mode."""
        if mode not in self._known:
            self._known[mode] = self._made(mode)
        return self._known[mode]

    def _made(self, mode):
        form, exact = affine_form(mode, self.waves), self.field.exact
        alone = [exact(guard.value) for guard in mode.fixed_guards if guard.kind not in NEVER_IDLE]
        if self.field.is_negative(alone):
            return None
        matrix = self.field.matrix(form)
        placed = [(guard, tuple(map(exact, row))) for guard, row in zip(mode.guards, form.guards, strict=True)]
        alone += [row[-1] for guard, row in placed if not any(row[:-1]) and guard.kind not in NEVER_IDLE]
        if self.field.is_negative(alone):
            return None
        placed += [(guard, (*matrix[-1][:-1], exact(guard.value))) for guard in mode.fixed_guards]
        placed = [pair for pair in placed if any(pair[1][:-1]) or pair[0].kind in NEVER_IDLE]
        placed.sort(key=lambda pair: pair[0].kind in NEVER_IDLE)
        guards = tuple(AffineGuard(guard.kind, guard.friction, row) for guard, row in placed)
        edges = tuple(self.row(mode, edge) for side in mode.sides for edge in inside(*side))
        kept = (*self._kept(mode), *self._resting(mode))
        return EnclosedMode(mode, matrix, guards, kept, edges, self.field, self.until, tuple(alone))

    def _resting(self, mode):
        """Return the rows of the phases on whose edge the mode stays, by the law on the edge itself."""
        return [self.row(mode, phase) for phase, side in mode.sides if not inside(phase, side)]

    def _kept(self, mode):
        """Yield the rows that vanish in a mode: velocities of stick, gaps of closed rigid contacts and their rates."""
        for k, (friction, phase) in enumerate(zip(self.system.frictions, mode.branch, strict=True)):
            if phase.mode == "stick":
                yield self.row(mode, mode.velocities[k])
            if friction.unilateral and not phase.is_open:
                yield self.row(mode, friction.gap)
                yield self.row(mode, branches.rate_along(self.system, friction.gap))

    def row(self, mode: GuardedMode, expr: sp.Expr) -> Row:
        """Return the row of an expression on the sides of a mode."""
        return tuple(map(self.field.exact, row_of(mode, expr, self.waves)))

    def every(self, state: EnclosedState, among: Sequence[Iterable[Phase]] = ()) -> Iterator[Branch]:
        """Yield the branches that the signs of velocities, loads and guards at a state, where certain, do not exclude.

        ``among`` are the phases of each contact that count, by default all. What excludes phases of coupled contacts
        does so beside any phases of the others. Raises ``Refused`` where too many branches are left.
        """
        among = among or [all_phases(self.system, k) for k in range(len(self.system.frictions))]
        phases, fitting = [self._phases(k, state, found) for k, found in enumerate(among)], []
        for group in coupled(self.here):
            every = _products(self._choices(group, phases, state))
            fitting.append([dict(zip(group, own, strict=True)) for own in every
                            if -1 not in self.signs(group, own, state).values()])
        for choice in _products(fitting):
            own = {k: phase for part in choice for k, phase in part.items()}
            yield tuple(own[k] for k in sorted(own))

    def signs(
        self, group: tuple[int, ...], own: Branch, state: EnclosedState, orders: int = MOST_ORDERS
    ) -> dict[tuple, int | None]:
        """Return the signs of the guards of coupled contacts by their keys; none where forces are not determined.

        A guard that vanishes, and a velocity one order later, has the sign of the first of its rates, up to ``orders``,
        that is not 0. It is 0 or None where this may depend on the phases of other contacts.
        """
        alone = _alone(self.here, group)
        if not forces.determined(alone, own):
            return {}
        mode = mode_of(alone, own)
        guards = (guard for guard in (*mode.guards, *mode.fixed_guards) if guard.kind not in NEVER_IDLE)
        return {guard.key: self._first_sign(mode, guard, state, orders) for guard in guards}

    def _first_sign(self, mode, guard, state, orders):
        others = {*self.here.pushes} - {*mode.system.pushes}
        moved = {s for s, rate in self.here.rates.items() if symbols_in(rate) & others}
        expr, sign = guard.value, self._sign(guard.value, state, mode)
        for _ in range(orders + (guard.kind == "velocity_zero")):
            if sign != 0 or symbols_in(expr) & moved:
                break
            expr = mode.drift(expr)
            sign = self._sign(expr, state, mode)
        return sign

    def _choices(self, group, phases, state):
        """Return the phases of each of some coupled contacts; where friction has one solution, those that it leaves.

        From rest on, the first contact with a negative guard changes its phase (Lemma 19).
        """
        choices, turning = [phases[k] for k in group], {"velocity_zero": (0, 0), "slip_onset": (1, -1)}
        own = [next((p for p in found if p.mode == "stick"), found[0]) for found in choices]
        undecided = [k for k in group if len(phases[k]) > 1]
        if len(undecided) < 2 or not self._has_one_solution(group, undecided, phases, state):
            return choices
        for _ in range(MOST_PIVOTS):
            signs = self.signs(group, (*own,), state, 0)
            kind, k, upper = next((key for key, sign in signs.items() if sign == -1), ("", None, 0))
            if k is None or group[k] not in undecided:
                break
            own[k] = own[k]._replace(velocity=turning[kind][upper])
        tied = {k for (_, k, _), sign in signs.items() if sign == 0}
        known = {*signs.values()} <= {0, 1}
        return [found if k in tied or not known else [own[k]] for k, found in enumerate(choices)]

    def _has_one_solution(self, group, undecided, phases, state):
        """Tell whether the undecided frictions of a group, at velocities that vanish, have one solution (Lemma 19)."""
        resting = [self.system.frictions[k] for k in undecided]
        forced = (self.system.frictions[k].rigid or branches.is_pushed(self.system, k) for k in group)
        if feels_directions(self.system) or any(forced):
            return False
        if any(len({(p.load, p.slips or p.mode == "stick") for p in phases[k]}) > 1 for k in undecided):
            return False
        if any(f.static != f.kinetic or self._sign(f.velocity, state) != 0 for f in resting):
            return False
        rates = [branches.rate_along(self.system, f.velocity) for f in resting]
        with suppress(Refused):
            rows = [[self.field.ball(self.field.exact(slope_by(rate, f.force))) for f in resting] for rate in rates]
            G = flint().arb_mat(rows) + flint().arb_mat(rows).transpose()
            parts = (flint().arb_mat([row[:n] for row in G.tolist()[:n]]) for n in range(1, len(rows) + 1))
            return all(part.det() > 0 for part in parts)
        return False

    def _phases(self, k, state, among):
        """Return those phases of contact k that the signs of its velocity, load and gap at a state do not exclude."""
        friction = self.here.frictions[k]
        velocity = self._sign(friction.velocity, state)
        load = None if branches.is_pushed(self.here, k) else self._sign(friction.load, state)
        gap = 0 if friction.gap is None else self._sign(friction.gap, state)
        apart = gap == 1 or (gap == -1 and friction.rigid)
        return [phase for phase in among if (gap != -1 if phase.is_open else not apart and (
            phase.smooth or (velocity in (None, 0, phase.velocity) and load in (None, 0, phase.load))))]

    def _sign(self, expr, state, mode=None):
        """Return the sign of an expression of a mode, by default of none, at a state, or None.

        It is None where the sign is not certain, or depends on a switch.
        """
        with suppress(Refused):
            return sign_at(self.row(mode or self._plain, expr), state)

    def _sides_of_velocities(self, state):
        """Yield the sides of switches of sliding velocities that are certain shortly after a state."""
        found = phases((f.velocity for f in self.system.frictions), self.system.states, self.system.time)
        for phase in _to_place(found, self._plain):
            with suppress(Refused):
                sides = self._possible(self._plain, phase, state)
                if len(sides) == 1:
                    yield phase, sides[0]

    def _is_shared(self, branch):
        """Tell whether contacts of a branch, one of which may slip, share their forces in ways not determined."""
        return not (branches.stands(branch) or forces.determined(self.here, branch))

    def _verdicts(self, branch, state):
        """Return the verdicts of the modes of a branch that may hold; of corners, one that holds is enough."""
        found: dict = {}
        for met in self._met(branch, state):
            if self._is_shared(met):
                return {mode_of(self.system, met): (0, ())}
            modes = [*self._on_sides(mode_of(self.system, met), state)]
            for mode in modes:
                verdict, guards = self._verdict(mode, state)
                if verdict >= 0 and in_name_only(mode.sided, branch) != in_name_only(self.here, branch):
                    raise Refused("edge: which contacts share a velocity depends on the side of a switch")
                if verdict > found.get(mode.sides, (None, -1))[1]:
                    found[mode.sides] = mode, verdict, guards
            if len(modes) == 1 and verdict > 0:
                break
        return {mode: (verdict, guards) for mode, verdict, guards in found.values()}

    def _met(self, branch, state):
        """Yield a branch whose forces are determined, or change no rate, or the corners of one at rest (Lemma 10).

        Raises ``Refused`` where some forces agree with the branch and are not determined, and a rate depends on them.
        """
        carried = in_name_only(self.here, branch)
        if forces.determined(self.here, branch):
            if carried and self._moves_otherwise(branch, carried):
                raise not_determined(branch)
            yield branch
        elif not carried and not self._leaves(branch, state):
            slips = any(phase.slips for phase in branch)
            if slips or self._moves_otherwise(branch):
                if self._has_no_forces(branch, state):
                    return
                if not slips or self._moves_freely(branch):
                    raise not_determined(branch)
                yield branch
            elif all(self._phases(k, state, [phase]) for k, phase in enumerate(branch)):
                yield from self._corners(branch)

    def _moves_otherwise(self, branch, carried=()):
        """Tell whether forces that rest, also of the contacts ``carried``, leaves free change a rate.

        An equation without forces leaves them to later derivatives, and then no other motion stays at rest.
        """
        rest = tuple(p._replace(velocity=0) if k in carried else p for k, p in enumerate(branch))
        _, matrix, _ = forces.force_equations(self.here, rest)
        without = any(row.is_zero_matrix for row in map(matrix.subs(self.field.numbers).row, range(matrix.rows)))
        return not without and self._moves_freely(rest)

    def _moves_freely(self, branch):
        """Tell whether forces that the equations of a branch leave free change a rate."""
        unknowns, matrix, _ = forces.force_equations(self.here, branch)
        matrix, rates = (m.subs(self.field.numbers) for m in (
            matrix, sp.linear_eq_to_matrix([*self.here.rates.values()], unknowns)[0]))
        return any(not (rates * free).expand().is_zero_matrix for free in matrix.nullspace())

    def _corners(self, branch):
        """Yield a branch at rest with every choice of rows, the laws among them, that determine its forces."""
        unknowns, *_ = forces.force_equations(self.here, branch)
        laws, margins = forces.standing_rows(self.here, branch)
        rows = sp.linear_eq_to_matrix([*laws, *(margin.value for margin in margins)], unknowns)[0]
        for chosen in _determining(rows.subs(self.field.numbers), len(laws), branch):
            yield tuple(p if p.is_open else p._replace(still=chosen) for p in branch)

    def _leaves(self, branch, state):
        """Tell whether what a branch keeps at 0 is not 0, on all sides of switches on which the state may lie."""
        mode = mode_of(self.system, branch)
        kept = (*mode.velocities.values(), *mode.kept_gaps.values())
        return all(any(sign_at(row, state) for row in self._kept(placed)) for placed in self._placed(mode, kept, state))

    def _placed(self, mode, expressions, state):
        """Yield a mode on all sides, of the switches of some expressions, on which a state may lie."""
        found = phases((on_sides(expr, mode.sides) for expr in expressions), self.system.states, self.system.time)
        opened = _to_place(found, mode)
        for sided in self._sided(mode, opened, state):
            yield from self._placed(sided, expressions, state) if opened else (mode,)

    def _has_no_forces(self, branch, state):
        """Tell whether at every corner of the forces of a branch a law or a margin is violated (Lemma 10).

        This must be so on all sides of switches on which the state may lie: at the state, or shortly afterwards where a
        branch that moves alike, with a force at its bound, tells the motion.
        """
        unknowns, laws, right = forces.force_equations(self.here, branch)
        margins = [branches.with_signs(self.here, branch, m) for m in self._margins(branch, state)]
        rows, constants = sp.linear_eq_to_matrix(margins, unknowns)
        rows, right = laws.col_join(rows).subs(self.field.numbers), right.col_join(constants)
        if not all(c.is_Rational for c in rows):
            return False
        chosen = [*_determining(rows, laws.rows, branch)]
        at_corners = [(rows * rows[c, :].inv() * right[c, :] - right).expand() for c in map(list, chosen)]

        alike = None if self._moves_freely(branch) else self._at_bound(branch)
        mode = mode_of(self.system, alike or branch)
        placed = self._on_sides(mode, state) if alike else self._placed(mode, right, state)

        def is_violated(mode, values):
            matrix = self.field.matrix(affine_form(mode, self.waves)) if alike else ()
            rows = (self.row(mode, value) for value in values)
            signs = [leading_sign(row, matrix, state) if alike else sign_at(row, state) for row in rows]
            return any(signs[: laws.rows]) or -1 in signs[laws.rows :]

        return all(is_violated(mode, values) for mode in placed for values in at_corners)

    def _at_bound(self, branch):
        """Return a branch that moves as one ``_is_shared`` does, and whose forces are determined, or None."""
        ways = product(*(all_phases(self.system, k) if p.mode == "stick" else (p,) for k, p in enumerate(branch)))
        return next((way for way in ways if forces.determined(self.here, way)
                     and forces.moves_alike(self.here, branch, way)), None)

    def _margins(self, branch, state):
        """Yield what forces of a branch must not make negative: loads, edges of stick, rates of slip that begins."""
        for k, (friction, phase) in enumerate(zip(self.here.frictions, branch, strict=True)):
            if phase.is_open or branches.is_joint(friction, phase):
                continue
            if friction.rigid or (phase.velocity and not branches.lifts(friction)):
                yield phase.load * friction.load
            if phase.mode == "stick":
                yield from (margin.value for margin in forces.edges_of_stick(friction, phase, k))
            elif phase.slips and self._sign(friction.velocity, state) == 0:
                yield phase.velocity * branches.rate_along(self.here, friction.velocity)

    def _on_sides(self, mode, state):
        """Yield a mode on every combination of sides of its switches on which a state may lie."""
        opened = self._opened(mode)
        for sided in self._sided(mode, opened, state):
            if sided.is_finite or not self._resting(sided):  # on its edge u/|u| has no law
                yield from self._on_sides(sided, state) if opened else (mode,)

    def _sided(self, mode, opened, state):
        """Yield a mode on every combination of sides, of some phases, on which a state may lie."""
        for choice in product(*(self._possible(mode, phase, state) for phase in opened)):
            yield mode_of(self.system, mode.branch, (*mode.sides, *zip(opened, choice, strict=True)))

    def _opened(self, mode):
        """Return the phases of a mode that are to be placed next; where it stands, also of what holds it at rest."""
        laws, margins = unused_rows(mode.sided, mode.branch) if branches.stands(mode.branch) else ((), ())
        held = (on_sides(expr, mode.sides) for expr in (*laws, *(margin.value for margin in margins)))
        return _to_place(mode.open_phases or phases(held, self.system.states, self.system.time), mode)

    def _possible(self, mode, phase, state):
        """Return the sides of a phase on which a state may lie shortly afterwards.

        Where the phase vanishes exactly, these are both sides and the edge, or the side to which it leads by itself.
        """
        row = self.row(mode, measured(phase))
        if not is_whole(phase):
            sign = sign_at(row, state)
            found = (0, 1, -1) if sign == 0 else sign and (sign,)
        else:
            near = round(float(ball_at(row, state).mid()))
            sign = sign_at((*row[:-1], row[-1] - near), state)
            found = (near, near - 1) if sign == 0 else sign and (near - (sign < 0),)
        if not found:
            raise Refused(f"edge: the side of {phase} = 0 on which the state lies is not certain")
        leads = self._leads(phase, state) if len(found) > 1 else None
        return ((max if leads > 0 else min)(found),) if leads else found

    def _leads(self, phase, state):
        """Return the sign of the rate of a phase, or None where it is not certain, or forces or switches change it."""
        rate = branches.rate_along(self.system, measured(phase))
        changed = rate.free_symbols & {*self.system.pushes} or is_switched(rate, self._plain.moving)
        return None if changed else self._sign(rate, state)

    def _verdict(self, mode, state):
        """Return (1 if a mode holds at a state, -1 if not, 0 if undecided; its guards).

        A guard that is identically 0 is left out. A multiple of another guard, and a guard that is equal to another
        throughout the motion, is noted with that guard. A motion that stays on an edge has the law of the edge, which
        for floor(u) is that of a side and is left undecided, as is a slip beside which a rigid contact moves otherwise.
        """
        for row in self._kept(mode):
            if (off := sign_at(row, state)) != 0:
                return (-1 if off else 0), ()
        found, verdict, guards = self.of(mode), 1, []
        if found is None:
            return -1, ()
        if branches.stands(mode.branch):
            laws, margins = unused_rows(mode.sided, mode.branch)
            rows = (self.row(mode, expr) for expr in (*laws, *(margin.value for margin in margins)))
            signs = [leading_sign(row, found.matrix, state) for row in (*self._kept(mode), *rows)]
            if any(signs[: len(signs) - len(margins)]) or -1 in signs:
                return -1, ()
            verdict = 0 if None in signs else verdict
        for guard in found.guards:
            zeros, sign = leading(guard.row, found.matrix, state)
            if sign == -1 and guard.kind not in NEVER_IDLE:
                return -1, ()
            verdict = verdict if sign == 1 or (sign == 0 and guard.kind not in NEVER_IDLE) else 0
            if sign != 0 and any(guard.row[:-1]):
                _note(guards, guard._replace(touching=zeros), found.matrix, state)
        moved = [leading_sign(row, found.matrix, state) for row in found.edges]
        stays = [leading_sign(row, found.matrix, state) for row in self._resting(mode)]
        if any(stays) or (0 in moved and not any(is_whole(phase) for phase, _ in mode.sides)):
            return -1, ()
        found.require_certain()
        return verdict * (None not in stays and all(moved)), tuple(guards)
