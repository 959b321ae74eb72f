r"""Certificates of affine systems of any size: proofs of which mode follows, at the start and after every event.

``enclose`` follows a system from event to event; ``segments`` encloses the flow of each mode in balls. M and the guards
have exact entries, see ``rows``. On a box of parameters or starts all are families (Lemma 14).

The hard function is ``_Modes.chosen``, which proves the mode at the start and after every event (Lemma 12). A candidate
holds where each of its guards, or the first nonvanishing derivative of the guard, is positive at every point of the
balls. Every other candidate must have a guard for which this sign is negative at every point, or keep a quantity at 0
that is nowhere 0. A law that switches with the state or the time has a mode on each side of the switch, and the edge of
a side is one more guard.

A ball never proves that a quantity vanishes: a quantity vanishes by exact arithmetic at the start, or because its
coefficients are a linear combination of the coefficients of quantities that vanish at the event.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import combinations, islice, product

import sympy as sp

from asympk.automaton.junction import ROUNDING
from asympk.automaton.modes import NO_FRICTION, SWITCH, mode_of, turning
from asympk.certify.balls import Ball, Refused, flint
from asympk.certify.enclosure import Budget, first_event
from asympk.certify.families import stacked
from asympk.certify.rows import (
    EnclosedState,
    ExactEntries,
    affine_form,
    ball_at,
    falls_to_zero,
    forcing,
    leading,
    leading_sign,
    row_of,
    row_rate,
    sign_at,
    spanned,
    value_after,
)
from asympk.certify.segments import AffineGuard, EnclosedMode, EnclosedSegment
from asympk.numbers import Number
from asympk.path import Event
from asympk.symbolic import branches, forces
from asympk.symbolic.branches import OPEN, Phase, all_phases
from asympk.symbolic.guards import NEVER_IDLE, unused_rows
from asympk.symbolic.sides import (
    inside,
    is_switched,
    is_whole,
    measured,
    on_sides,
    phase_of,
    phases,
    system_on_sides,
)
from asympk.symbolic.system import System

MOST_EVENTS, MOST_CORNERS = 200, 200


def enclose(
    system: System,
    values: tuple[Number, ...],
    sides: Mapping[str, tuple[Number, Number]],
    start: Sequence[Fraction | None],
    until: Number,
    finest: float,
    budget: Budget,
) -> tuple[list[str], list[Event], tuple[Ball, ...]]:
    """Return (names of modes, events, final balls) of an affine system.

    ``sides`` {name: (low, high)} are the parameters and states of the start that range over an interval; ``start`` has
    None for such states. Raises ``Refused`` where the sequence of modes is not proven.
    """
    modes = _Modes(system, values, sides, until)
    modes.field.require_least_at_corners(_not_negative(system))
    state = modes.begun(start)
    mode, guards = modes.first(state)
    t, names, size = modes.field.family([[0]]), [mode.mode.name], len(system.states)
    events: list[Event] = []
    while True:
        segment = EnclosedSegment(mode, state)
        left = (modes.field.family([[Fraction(until)]]) - t).tight()
        last = [guard for guard in guards if modes.ends_motion(guard, segment)]
        found = first_event(segment, [g for g in guards if g not in last], left.numbers()[0], finest, budget)
        if not found and not last:
            return names, events, tuple(segment.at(None, left).numbers()[:size])
        guard, dt = (found[0], segment.moment(*found)) if found else (_together(last), left)
        if found and not (left - dt).numbers()[0] > 0:
            raise Refused(f"horizon: {guard.kind} at the end itself, until = {float(until):.10g}")
        time = modes.instant(guard, segment) if found else Fraction(until)
        state, t = modes.struck(segment.at(guard, dt), guard, segment, guards, time), (t + dt).tight()
        mode, guards = modes.next(mode.mode, guard, state)
        if guard := modes.event(segment.mode.mode, mode.mode, guard, state):
            names.append(mode.mode.name)
            events.append(Event(guard.kind, t.numbers()[0], tuple(state.balls[:size]), guard.friction))
        if not found:
            return names, events, tuple(state.balls[:size])
        if len(events) > MOST_EVENTS:
            raise Refused(f"too many: more than {MOST_EVENTS} events by t = {float(events[-1].t.mid()):.6g}")


def _not_negative(system):
    """Return the quantities of the parameters that must not be negative in a system, where this is not plain."""
    found = [_margin(assumed) for assumed in sp.And.make_args(sp.to_nnf(system.assumptions))]
    bounds = (q for friction in system.frictions for q in (friction.kinetic, friction.static - friction.kinetic))
    found += [q for q in bounds if not q.is_nonnegative]
    return [q for q in found if q.free_symbols <= {*system.parameters}]


def _margin(condition):
    """Return a quantity that is negative where a condition does not hold: of alternatives the largest."""
    if isinstance(condition, sp.And | sp.Or):
        return (sp.Min if isinstance(condition, sp.And) else sp.Max)(*map(_margin, condition.args))
    if hasattr(condition, "gts"):
        return condition.gts - condition.lts
    return abs(condition.lhs - condition.rhs) * (-1) ** isinstance(condition, sp.Eq) if condition.args else sp.S.Zero


def _first(names, before, held):
    """Return the branch by which a run names a motion after a branch ``before``: contacts ``held`` go on to rest.

    Each load keeps its sign if it can, the first contact rests rather than the second, and slips rather forward.
    """
    loads = [phase.load for phase in before] or [1] * len(names[0])
    order = {b: [(p == OPEN, p.load != load, abs(p.velocity), -p.velocity) for p, load in zip(b, loads, strict=True)]
             for b in branches.most_at_rest(names, held)}
    return min(order, key=order.get)


def _together(lost):
    """Return the first of the guards that vanish at one time, with the frictions of the others."""
    _, *others = (k for guard in lost for k in (guard.friction, *guard.others))
    return lost[0]._replace(others=tuple(others))


def _after(mode, guard):
    """Return the branches that may follow a mode: any branch at a switch, else any phase of the guard's friction."""
    free = guard.kind == SWITCH or branches.stands(mode.branch)
    lost = range(len(mode.branch)) if free else (guard.friction, *guard.others)
    return product(*(all_phases(mode.system, k) if k in lost else (phase,) for k, phase in enumerate(mode.branch)))


def _own_sides(mode):
    """Return the sides of a mode that its branch does not tell, as the signs of sliding velocities while closed."""
    told = {phase_of(friction.velocity)[0] for friction in mode.closed.values()}
    return tuple(side for side in mode.sides if side[0] not in told)


def _to_place(opened, mode):
    """Return those of some phases of a mode that do not switch themselves; these follow on the sides of the others."""
    return [phase for phase in opened if not is_switched(measured(phase), mode.moving)] or opened


def _carried(system, branch):
    return {k for k in range(len(branch)) if forces.is_carried(system, branch, k)}


def _unit(k, size):
    return tuple(int(i == k) for i in range(size))


def _stands_still(k, mode, state):
    """Tell whether every derivative of a coordinate vanishes exactly."""
    row = _unit(k, len(mode.matrix))
    return all(sign_at(row := row_rate(row, mode.matrix), state) == 0 for _ in mode.matrix)


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


def _undetermined(branch):
    return Refused(f"rest: the forces of {branches.mode_name(branch)} are not determined")


def _determining(rows, laws, branch):
    """Yield every choice of rows of a matrix, of which the first ones are laws, that determines the unknowns.

    Raises ``Refused`` where there are too many, or none.
    """
    if rows.rank() < rows.cols:
        raise _undetermined(branch)
    kept: list[int] = []
    for k in range(laws):
        kept += [k] if rows[[*kept, k], :].rank() > len(kept) else []
    choices = [*islice(combinations(range(laws, rows.rows), rows.cols - len(kept)), MOST_CORNERS + 1)]
    if len(choices) > MOST_CORNERS:
        raise Refused(f"rest: the forces of {branches.mode_name(branch)} have more than {MOST_CORNERS} corners")
    yield from ((*kept, *more) for more in choices if rows[[*kept, *more], :].rank() == rows.cols)


class _Modes:
    """The modes of a system at exact parameters, each made when it is first needed."""

    def __init__(self, system, values, sides, until):
        self.system, self.here, self.until, self._known = system, system, Fraction(until), {}
        self.waves, entries = forcing(system)
        self._plain = mode_of(system, (Phase(1, 1),) * len(system.frictions))
        self.field = ExactEntries(system, values, sides, entries)

    def begun(self, start):
        """Return the ``EnclosedState`` at t = 0, where the values of the forcing are exact."""
        waves = [Fraction(int(wave.power == 0 and not wave.sine)) for wave in self.waves]
        exact = (*start, *waves, Fraction(1))
        found = [self.field.family([[w]]) if w is not None else self.field.side(self.system.states[k].name)
                 for k, w in enumerate(exact)]
        self.start = EnclosedState(stacked(found), exact, self.field, (), Fraction(0))
        return self.start

    def first(self, state):
        """Return (mode, its guards) at the start; raises ``Refused`` where a run rounds its sliding velocity to 0."""
        mode, guards = self.chosen([self.every(state)], state, "start")
        for row in (self._row(mode.mode, velocity) for velocity in mode.mode.velocities.values()):
            terms = [w if w is None else c * w for c, w in zip(row, state.exact, strict=True) if c]
            known = all(isinstance(term, int | Fraction) for term in terms)
            if known and 0 < abs(sum(terms)) <= 4 * ROUNDING * sum(map(abs, terms)):
                raise Refused("edge: a sliding velocity at the start is rounding, which a run takes as 0; start with 0")
        return mode, guards

    def next(self, mode, guard, state):
        """Return (mode, its guards) of what follows a mode at the event of a guard.

        Where a contact slips in name only, the name of any may change.
        """
        held = branches.at_rest(mode.branch) - {guard.friction, *guard.others}
        tiers = [self.every(state)] if _carried(mode.sided, mode.branch) else [_after(mode, guard), self.every(state)]
        return self.chosen(tiers, state, guard.kind, mode.branch, held)

    def ends_motion(self, guard, segment):
        """Tell whether a guard is positive before ``until`` and falls through 0 exactly then (Lemma 16)."""
        since, parts = self._polynomial(guard.row, segment)
        return bool(parts) and falls_to_zero(parts, self.until - since, self.field)

    def instant(self, guard, segment):
        """Return the exact time, the same all over the box, at which a guard linear in the time vanishes; else None.

        None stands for a long number, too.
        """
        since, parts = self._polynomial(guard.row, segment)
        if not parts or any(parts[2:]):
            return None
        found = self.field.expression(since - parts[0] / parts[1])
        return Fraction(found) if found.is_Rational and found.q.bit_length() <= flint().ctx.prec else None

    def _polynomial(self, row, segment):
        """Return (exact time, Taylor coefficients from it) of a row; what the time alone moves is known from 0 on."""
        start = segment.start if any(row[: len(self.system.states)]) else self.start
        return start.time, [] if start.time is None else segment.polynomial(row, start)

    def struck(self, family, guard, segment, guards, time):
        """Return the state at an event; what stands still, is alone in the guard, or a polynomial in time, is exact.

        ``time`` is the exact time of the event, or None.
        """
        mode, before, size = segment.mode, segment.start, len(segment.start.exact)
        exact = [w if w is not None and _stands_still(k, mode, before) else None for k, w in enumerate(before.exact)]
        known = {k: before.family.entry(k) for k, w in enumerate(exact) if w is not None}
        involved = [k for k, c in enumerate(guard.row[:-1]) if c]
        found = {involved[0]: -guard.row[-1] / guard.row[involved[0]]} if len(involved) == 1 else {}
        for k in {*range(size)} - {*known} if time is not None else ():
            since, parts = self._polynomial(_unit(k, size), segment)
            found |= {k: value_after(time - since, parts)} if parts else {}
        for k, value in found.items():
            exact[k], known[k] = value, self.field.family([[value]])
        null = (guard.row, *mode.kept, *(row for other in guards for row in other.null))
        whole = stacked([known.get(k) or family.entry(k) for k in range(size)])
        return EnclosedState(whole, tuple(exact), self.field, null, time)

    def of(self, mode):
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
        edges = tuple(self._row(mode, edge) for side in mode.sides for edge in inside(*side))
        kept = (*self._kept(mode), *self._resting(mode))
        return EnclosedMode(mode, matrix, guards, kept, edges, self.field, self.until, tuple(alone))

    def _resting(self, mode):
        """Return the rows of the phases on whose edge the mode stays, by the law on the edge itself."""
        return [self._row(mode, phase) for phase, side in mode.sides if not inside(phase, side)]

    def _kept(self, mode):
        """Yield the rows that vanish in a mode: velocities of stick, gaps of closed rigid contacts and their rates."""
        for k, (friction, phase) in enumerate(zip(self.system.frictions, mode.branch, strict=True)):
            if phase.mode == "stick":
                yield self._row(mode, mode.velocities[k])
            if friction.constraint is not None and friction.gap is not None and phase != OPEN:
                yield self._row(mode, friction.gap)
                yield self._row(mode, branches.rate_along(self.system, friction.gap))

    def _row(self, mode, expr):
        """Return the row of an expression on the sides of a mode."""
        return tuple(map(self.field.exact, row_of(mode, expr, self.waves)))

    def every(self, state):
        """Yield the branches that the signs of velocities and loads at a state, where certain, do not exclude."""
        yield from product(*(self._phases(k, state) for k in range(len(self.system.frictions))))

    def _phases(self, k, state):
        """Return the phases of contact k that the signs of its velocity and load at a state do not exclude."""
        friction = self.here.frictions[k]
        velocity = self._sign(friction.velocity, state)
        pushed = friction.load.free_symbols & {u for f in self.here.frictions for u in (f.force, f.normal)}
        load = None if pushed else self._sign(friction.load, state)
        return [phase for phase in all_phases(self.system, k) if phase == OPEN or phase.smooth or (
            velocity in (None, 0, phase.velocity) and load in (None, 0, phase.load))]

    def _sign(self, expr, state):
        """Return the sign of an expression at a state, or None where it is not certain, or depends on a switch."""
        with suppress(Refused):
            return sign_at(self._plain_row(expr), state)

    def _plain_row(self, expr):
        """Return the row of an expression of the states alone, which is the same in every mode."""
        return self._row(self._plain, expr)

    def chosen(self, tiers, state, what, before=(), held=frozenset()):
        """Return (mode, its guards from the state on) of the candidate that is proven to follow.

        ``tiers`` are lists of candidates, and the first tier with a candidate that may hold decides. A later tier is
        needed where a force that jumps at one contact releases another, or lets it rest no more than static friction
        would. Of several candidates that hold, the one with the most frictions at rest follows; ``before`` and the
        contacts ``held`` from before the event name a motion that several tell alike. Raises ``Refused`` where the
        verdict on a candidate is not certain, or where no single candidate is left.
        """
        verdicts: dict = {}
        self.here = system_on_sides(self.system, turning(self.system, (*self._sides_of_velocities(state),)))
        for candidates in tiers:
            for branch in sorted(candidates, key=lambda branch: -len(branches.at_rest(branch))):
                verdicts |= self._verdicts(branch, state)
                if any(verdict > 0 and branches.stands(mode.branch) for mode, (verdict, _) in verdicts.items()):
                    break  # no other candidate has more frictions at rest
            holding = {mode: guards for mode, (verdict, guards) in verdicts.items() if verdict > 0}
            best = branches.most_at_rest(m.branch for m in holding)
            if best and self._are_one(best, holding, state):
                best = [before if what == SWITCH and before in best else _first(best, before, held)]
            if verdicts and all(self._slips_freely(b, state) for b in best):
                break
        open_ones = [m for m in verdicts if m not in holding and not self._is_told(m.branch, holding, state)]
        if shared := [m.branch for m in open_ones if self._is_shared(m.branch)]:
            raise _undetermined(shared[0])
        if open_ones or len(best) != 1 or len({*map(_own_sides, holding)}) != 1:
            names = ", ".join(sorted({m.name for m in (*open_ones, *holding)})) or "none"
            raise Refused(f"edge: which mode follows after {what} is not certain; candidates: {names}")
        found = next(mode for mode in holding if mode.branch == best[0])
        self._require_one_way(found.branch, state, what)
        self._require_within_limit(found, holding, state, what)
        return self.of(found), holding[found]

    def _sides_of_velocities(self, state):
        """Yield the sides of switches of sliding velocities that are certain shortly after a state."""
        found = phases((f.velocity for f in self.system.frictions), self.system.states, self.system.time)
        for phase in _to_place(found, self._plain):
            with suppress(Refused):
                sides = self._possible(self._plain, phase, state)
                if len(sides) == 1:
                    yield phase, sides[0]

    def _are_one(self, best, holding, state):
        """Tell whether the motions of branches that hold do not differ."""
        first, *others = [self.of(next(m for m in holding if m.branch == b)).matrix for b in best]
        rows = (pair for other in others for pair in zip(first, other, strict=True))
        apart = (tuple(a - b for a, b in zip(*pair, strict=True)) for pair in rows)
        return all(leading_sign(row, first, state) == 0 for row in apart)

    def _is_shared(self, branch):
        """Tell whether contacts of a branch, one of which may slip, share their forces in ways not determined."""
        return not (branches.stands(branch) or forces.determined(self.here, branch))

    def _is_told(self, branch, holding, state):
        """Tell whether a branch ``_is_shared`` and moves as one that holds, where a force has its bound (Lemma 10)."""
        alike = (m for m in holding if forces.moves_alike(self.here, branch, m.branch))
        return self._is_shared(branch) and any(self._stays_on_sides(mode, state) for mode in alike)

    def _stays_on_sides(self, mode, state):
        """Tell whether on all other sides on which the state may lie a mode crosses an edge at once."""
        others = [self.of(m) for m in self._on_sides(mode_of(self.system, mode.branch), state) if m.sides != mode.sides]
        return all(m and any(leading_sign(edge, m.matrix, state) == -1 for edge in m.edges) for m in others)

    def _slips_freely(self, branch, state):
        """Tell whether no contact slips that static friction would hold if every contact that may rest did."""
        rest = tuple(p._replace(velocity=0) if p.slips and not self._sign(f.velocity, state) else p
                     for f, p in zip(self.system.frictions, branch, strict=True))
        slipping = branches.at_rest(rest) - branches.at_rest(branch)
        if not slipping or len(branches.at_rest(rest)) == 1 or not forces.determined(self.here, rest):
            return True
        found = [self.of(mode) for mode in self._on_sides(mode_of(self.system, rest), state)]
        for mode in filter(None, found):
            mode.require_certain()
        return all(found) and all(slipping <= {
            g.friction for g in mode.guards if g.kind == "slip_onset" and leading_sign(g.row, mode.matrix, state) == -1}
            for mode in found)

    def _require_one_way(self, branch, state, what):
        """Raise ``Refused`` where a contact at rest in a branch may slip either way as well, all else alike."""
        for k in sorted(branches.at_rest(branch)):
            ways = ((*branch[:k], branch[k]._replace(velocity=way), *branch[k + 1 :]) for way in (1, -1))
            if all(self._may_leave_rest(way, k, state) for way in ways):
                raise Refused(f"edge: after {what}, contact {k} may rest and may slip in either direction")

    def _require_within_limit(self, mode, holding, state, what):
        """Raise ``Refused`` where a contact at rest, of a mode at the limit of a condition, slips in another mode."""
        rest, at_limit = branches.at_rest(mode.branch), not all(self.of(mode).conditions)
        if at_limit and any(self._slips(m, k, state) for m in holding for k in rest - branches.at_rest(m.branch)):
            raise Refused(f"edge: after {what}, equality holds in a condition on the parameters of {mode.name}, which "
                          "may slip as well")

    def _may_leave_rest(self, branch, k, state):
        """Tell whether a branch may hold in which contact k slips, and not in name only, as others hold it."""
        found = self._verdicts(branch, state) if forces.determined(self.here, branch) else {}
        return any(verdict >= 0 and self._slips(mode, k, state) for mode, (verdict, _) in found.items())

    def _slips(self, mode, k, state):
        """Tell whether the velocity of contact k does not stay 0 in a mode."""
        velocity = mode.velocities.get(k, self.system.frictions[k].velocity)
        return leading_sign(self._row(mode, velocity), self.of(mode).matrix, state) != 0

    def _verdicts(self, branch, state):
        """Return the verdicts of the modes of a branch that may hold; of corners, one that holds is enough."""
        found: dict = {}
        for met in self._met(branch, state):
            if self._is_shared(met):
                return {mode_of(self.system, met): (0, ())}
            modes = [*self._on_sides(mode_of(self.system, met), state)]
            for mode in modes:
                verdict, guards = self._verdict(mode, state)
                if verdict >= 0 and _carried(mode.sided, branch) != _carried(self.here, branch):
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
        carried = _carried(self.here, branch)
        if forces.determined(self.here, branch):
            if carried and self._moves_otherwise(branch, carried):
                raise _undetermined(branch)
            yield branch
        elif not carried and not self._leaves(branch, state):
            slips = any(phase.slips for phase in branch)
            if slips or self._moves_otherwise(branch):
                if self._has_no_forces(branch, state):
                    return
                if not slips or self._moves_freely(branch):
                    raise _undetermined(branch)
                yield branch
            elif all(phase in self._phases(k, state) for k, phase in enumerate(branch)):
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
            yield tuple(p if p == OPEN else p._replace(still=chosen) for p in branch)

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
            rows = (self._row(mode, value) for value in values)
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
            if phase == OPEN or branches.is_joint(friction, phase):
                continue
            if friction.constraint is not None or (phase.velocity and not branches.lifts(friction)):
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
        row = self._row(mode, measured(phase))
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
        pushes = {u for f in self.system.frictions for u in (f.force, f.normal)}
        changed = rate.free_symbols & pushes or is_switched(rate, self._plain.moving)
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
            rows = (self._row(mode, expr) for expr in (*laws, *(margin.value for margin in margins)))
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

    def event(self, before, after, guard, state):
        """Return the guard of the event between two modes, or None if the motion of no contact changes.

        At a switch it is the sliding velocity that jumps or, unless a contact stops there, what the first mode loses on
        the new side. Of velocities that change together it is the first.
        """
        if forces.moves_alike(after.sided, before.branch, after.branch):
            return None
        if NO_FRICTION in (guard.friction, *guard.others):
            beyond = mode_of(self.system, before.branch, before.sides_beyond(after))
            if jumped := self._jumped(beyond, state):
                return jumped
            if guard.kind != "velocity_zero":
                self._require_no_stop(before, after)
                guard = self._lost(beyond, after, state)
        undetermined = branches.stands(before.branch)
        if guard.kind == "slip_onset" and (undetermined or after.branch[guard.friction].mode == "stick"):
            freed = branches.at_rest(before.branch) - branches.at_rest(after.branch)
            if not freed:  # the load vanishes between both edges of its stick
                return guard._replace(kind="force_zero")
            return guard._replace(friction=min(freed))
        if guard.kind == "velocity_zero":
            pairs = enumerate(zip(before.branch, after.branch, strict=True))
            turned = {k for k, (a, b) in pairs if a.velocity and b != OPEN and a.velocity != b.velocity}
            turned -= _carried(before.sided, before.branch)
            return guard._replace(friction=min(turned, default=guard.friction))
        return guard

    def _jumped(self, beyond, state):
        """Return the guard of a sliding velocity that has jumped away from 0, or to the other sign, or None."""
        for k, velocity in beyond.jumping.items():
            old = beyond.branch[k].velocity
            if (sign_at(self._row(beyond, velocity), state) or old) != old:
                return AffineGuard("velocity_zero" if old else "slip_onset", k, ())
        return None

    def _require_no_stop(self, before, after):
        """Raise ``Refused`` where a contact rests whose sliding velocity has jumped to 0: it might slip on in name."""
        carried = _carried(before.sided, before.branch)
        for k in branches.at_rest(after.branch) - branches.at_rest(before.branch) - carried:
            if before.branch[k].slips:
                raise Refused(f"edge: the sliding velocity of contact {k} jumps to 0")

    def _lost(self, beyond, after, state):
        """Return the guard that a mode, which the parameters may exclude, loses on the sides of another branch."""
        form = affine_form(beyond, self.waves)
        matrix, rows = self.field.matrix(form), (tuple(map(self.field.exact, row)) for row in form.guards)
        guards = (AffineGuard(guard.kind, guard.friction, row) for guard, row in zip(beyond.guards, rows, strict=True))
        lost = (g for g in guards if g.kind != SWITCH and leading_sign(g.row, matrix, state) == -1)
        changed = (k for k, (a, b) in enumerate(zip(beyond.branch, after.branch, strict=True)) if a != b)
        return next(lost, AffineGuard("slip_onset", next(changed), ()))
