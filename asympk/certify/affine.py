r"""Certificates of affine systems of any size: proofs of which mode follows, at the start and after every event.

``enclose`` follows a system from event to event; ``segments`` encloses the flow of each mode in balls. M and the guards
have exact entries, see ``rows``. On a box of parameters or starts all are families (Lemma 14).

The hard function is ``_Modes.chosen``, which proves the mode at the start and after every event (Lemma 12). A candidate
holds where each of its guards, or the first nonvanishing derivative of the guard, is positive at every point of the
balls. Every other candidate must have a guard for which this sign is negative at every point, or keep a quantity at 0
that is nowhere 0. Which candidates there are, and what each of them tells, is found in ``candidates``.

A ball never proves that a quantity vanishes: a quantity vanishes by exact arithmetic at the start, or because its
coefficients are a linear combination of the coefficients of quantities that vanish at the event.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from fractions import Fraction

import sympy as sp

from asympk.automaton.contacts import coupled
from asympk.automaton.junction import ROUNDING, which_contact
from asympk.automaton.modes import NO_FRICTION, SWITCH, mode_of
from asympk.certify.balls import Ball, Refused, ball, flint
from asympk.certify.candidates import MOST_CANDIDATES, Candidates, affine_form, in_name_only, not_determined
from asympk.certify.enclosure import Budget, first_event
from asympk.certify.families import constant, stacked
from asympk.certify.rivals import require_one_motion
from asympk.certify.rows import EnclosedState, ball_at, leading_sign, row_rate, sign_at
from asympk.certify.segments import AffineGuard, EnclosedSegment
from asympk.certify.zeros import Zero, derivatives, first_zero, order_at
from asympk.numbers import Number
from asympk.path import Event
from asympk.symbolic import branches, forces
from asympk.symbolic.branches import all_phases, rate_along
from asympk.symbolic.sides import phase_of
from asympk.symbolic.system import System

MOST_EVENTS = 200
_COARSE = 2.0**-8  # of its end is a piece of time that is not short


def enclose(
    system: System, values: tuple[Number, ...], sides: Mapping[str, tuple[Number, Number]],
    start: Sequence[Fraction | None], until: Number, budget: Budget,
) -> tuple[list[str], list[Event], tuple[Ball, ...]]:
    """Return (names of modes, events, final balls) of an affine system.

    ``sides`` {name: (low, high)} are the parameters and states of the start that range over an interval; ``start`` has
    None for such states. Raises ``Refused`` where the sequence of modes is not proven.
    """
    modes = _Modes(system, values, sides, until)
    modes.field.require_least_at_corners(_not_negative(system))
    mode, guards = modes.first(state := modes.begun(start))
    t, size, touched, names, events = modes.field.family([[0]]), len(system.states), 0, [mode.mode.name], list[Event]()
    while max(touched, len(events)) <= MOST_EVENTS:
        modes.past.append(segment := EnclosedSegment(mode, state))
        remaining = (modes.field.family([[Fraction(until)]]) - t).tight()
        zero, groups, found = modes.ahead(guards, segment, remaining, t, budget)
        require_one_motion(modes, segment, guards, found[1] if found else zero.span.numbers()[0], budget)
        if not found and not zero.lost:
            return names, events, tuple(segment.at(None, remaining).numbers()[:size])
        lost, dt = (groups[found[0]], segment.moment(*found)) if found else (zero.lost, zero.span)
        guard = _together(lost)
        if found and not (zero.span - dt).numbers()[0] > 0:
            raise Refused(f"horizon: {guard.kind} at the end itself, until = {float(until):.10g}")
        time, t = (modes.instant(found[0], segment), (t + dt).tight()) if found else (zero.time, zero.at)
        t = t if time is None else modes.field.family([[time]])
        state = modes.state_at_event(segment.at(guard, dt), lost, segment, guards, time)
        mode, guards = modes.next(mode.mode, guard, state)
        if guard := modes.event(segment.mode.mode, mode.mode, lost, state):
            names.append(mode.mode.name)
            events.append(Event(guard.kind, t.numbers()[0], tuple(state.balls[:size]), guard.friction))
        if not found and zero.time == until:
            return names, events, tuple(state.balls[:size])
        touched += not found
    raise Refused(f"too many: over {MOST_EVENTS} events or touches of 0 by t = {float(t.numbers()[0].mid()):.6g}")


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
    order = {b: [(p.is_open, p.load != load, abs(p.velocity), -p.velocity) for p, load in zip(b, loads, strict=True)]
             for b in branches.most_at_rest(names, held)}
    return min(order, key=order.get)


def _together(lost):
    """Return the first of the guards that vanish at one time, with the frictions of the others."""
    _, *others = (k for guard in lost for k in (guard.friction, *guard.others))
    return lost[0]._replace(others=tuple(others))


def _after(mode, guard):
    """Return the phases of each contact that may follow a mode: all at a switch, else any of the guard's friction."""
    free = guard.kind == SWITCH or branches.stands(mode.branch)
    lost = range(len(mode.branch)) if free else (guard.friction, *guard.others)
    return [all_phases(mode.system, k) if k in lost else (phase,) for k, phase in enumerate(mode.branch)]


def _own_sides(mode):
    """Return the sides of a mode that its branch does not tell, as the signs of sliding velocities while closed."""
    velocities = {phase_of(friction.velocity)[0] for friction in mode.closed.values()}
    return tuple(side for side in mode.sides if side[0] not in velocities)


def _unit(k, size):
    return tuple(int(i == k) for i in range(size))


def _stands_still(k, mode, state):
    """Tell whether every derivative of a coordinate vanishes exactly."""
    row = _unit(k, len(mode.matrix))
    return all(sign_at(row := row_rate(row, mode.matrix), state) == 0 for _ in mode.matrix)


class _Modes(Candidates):
    """The modes that follow one another, and the events between them."""

    def begun(self, start):
        """Return the ``EnclosedState`` at t = 0, where the values of the forcing are exact."""
        states, begun = self.system.states, {None: Fraction(1)} | dict(zip(self.system.states, start, strict=True))
        waves = [Fraction(0) if wave.power or wave.sine else begun[wave.amplitude] for wave in self.waves]
        exact, names = (*start, *waves, Fraction(1)), (*states, *(wave.amplitude for wave in self.waves))
        found = [self.field.family([[w]]) if w is not None else self.field.side(names[k].name)
                 for k, w in enumerate(exact)]
        self.past = list[EnclosedSegment]()
        return EnclosedState(stacked(found), exact, self.field, (), Fraction(0))

    def first(self, state):
        """Return (mode, its guards) at the start; raises ``Refused`` where a run rounds a velocity or a gap to 0."""
        self._require_no_rounding(state)
        mode, guards = self.chosen([self.every(state)], state, "start")
        for row in (self.row(mode.mode, velocity) for velocity in mode.mode.velocities.values()):
            if self._is_rounding(row, state):
                raise Refused("edge: a sliding velocity at the start is rounding, which a run takes as 0; start with 0")
        return mode, guards

    def _require_no_rounding(self, state):
        """Raise ``Refused`` for a gap of a rigid contact, or its rate, that is not 0 but may be rounding at a start."""
        for friction in self.system.frictions:
            gap = friction.gap if friction.rigid else None
            for what, expr in (("gap", gap), ("rate of the gap", gap and rate_along(self.system, gap))):
                if expr and self._is_rounding(self.row(self._plain, expr), state):
                    raise Refused(f"edge: the {what} at the start is rounding, which a run takes as 0; start where it "
                                  "is 0 exactly, or take the elastic contact")

    def _is_rounding(self, row, state):
        """Tell whether a row is not exactly 0 at an exact start, but so small that a run takes it as 0."""
        with suppress(Refused):
            terms = [(c, w) for c, w in zip(row, state.exact, strict=True) if c]
            if any(w is None for _, w in terms) or sign_at(row, state) == 0:
                return False
            size = sum(abs(float(self.field.ball(c).mid()) * float(w)) for c, w in terms)
            return abs(float(ball_at(row, state).mid())) <= 4 * ROUNDING * size
        return False

    def next(self, mode, guard, state):
        """Return (mode, its guards) of what follows a mode at the event of a guard.

        Where a contact slips in name only, the name of any may change.
        """
        held = branches.at_rest(mode.branch) - {guard.friction, *guard.others}
        first = [] if in_name_only(mode.sided, mode.branch) else [self.every(state, _after(mode, guard))]
        return self.chosen([*first, self.every(state)], state, guard.kind, mode.branch, held)

    def ahead(self, guards, segment, remaining, since, budget):
        """Return what ``_until`` does.

        A touch of 0 is sought first, unless exact entries are rational functions, whose divisions take time: then only
        where signs on pieces of time that are not short leave the first event open.
        """
        zero = Zero(since + remaining, remaining, Fraction(self.until), [])
        if self.field.field:
            with suppress(Refused):
                return self._until(zero, guards, segment, budget, _COARSE)
        for guard in guards:
            if (found := self._touch(guard, segment, since)) and (zero.span - found.span).numbers()[0] > 0:
                zero = found
        return self._until(zero, guards, segment, budget)

    def _until(self, zero, guards, segment, budget, finest=0.0):
        """Return a ``Zero``, a touch or the end, with all that is lost there, and groups of the guards that are not.

        Of these, each one whose exact time is known stands for all that fall through 0 exactly when it does. Return,
        too, (guard, time ball) of the first event before the zero, or None.
        """
        orders = {guard: self._order(guard, zero.time, segment) for guard in guards}
        lost = [g for guard in guards if guard not in zero.lost for g in derivatives(guard, segment, orders[guard])]
        lost = [*zero.lost, *lost]
        groups, rest = dict[AffineGuard, list[AffineGuard]](), [guard for guard in guards if guard not in lost]
        times = {guard: self.instant(guard, segment) for guard in rest}
        for guard in sorted(rest, key=lambda guard: times[guard] is None):
            if not any(guard in group for group in groups.values()):
                time = times[guard]
                groups[guard] = [g for g in rest if g is guard or self._order(g, time, segment) == 1]
        first = first_event(segment, [*groups], zero.span.numbers()[0], budget, finest)
        return zero._replace(lost=lost), groups, first

    def _touch(self, guard, segment, since):
        """Return the ``Zero`` at which a guard vanishes with its rate before it falls through 0, or None."""
        start = self._source(guard.row)
        begun = since if start is segment.start else self.field.family([[start.time]])
        elapsed = ball(0) if start is segment.start else (since - begun).numbers()[0]
        with suppress(ValueError):
            time, order, exact = first_zero(guard, segment, start, elapsed)
            from_start = constant(flint().acb_mat([[time]]), since.spans)
            at = begun + from_start
            span = from_start if start is segment.start else (at - since).tight()
            exact = None if None in (exact, start.time) else start.time + exact
            return Zero(at, span, exact, derivatives(guard, segment, order)) if order > 1 else None
        return None

    def _order(self, guard, time, segment):
        """Return the order of the zero of a guard at an exact time, 0 unless it is positive before (Lemma 16)."""
        since, parts = self._polynomial(guard.row, segment)
        return order_at(parts, time - since, self.field) if parts and time is not None and time > since else 0

    def instant(self, guard, segment):
        """Return the exact time, the same all over the box, at which a guard linear in the time vanishes; else None.

        None stands for a long number, too.
        """
        since, parts = self._polynomial(guard.row, segment)
        if not parts or not parts[1] or any(parts[2:]):
            return None
        found = self.field.expression(since - parts[0] / parts[1])
        return Fraction(found) if found.is_Rational and found.q.bit_length() <= flint().ctx.prec else None

    def _polynomial(self, row, segment):
        """Return (exact time, Taylor coefficients from it) of a row."""
        start = self._source(row)
        return start.time, [] if start.time is None else segment.polynomial(row, start)

    def _source(self, row):
        """Return the latest state of an exact time, from which on a row has moved by one law, that is exact in it.

        Blocks that have nothing to do with one another stop each at its own time. Without one it is the latest state.
        """
        matrix = self.past[-1].mode.matrix
        for k in (found := [k for k, c in enumerate(row) if c]):
            found += [j for j, c in enumerate(matrix[k]) if c and j not in found]
        for segment in reversed(self.past):
            if any(segment.mode.matrix[k] != matrix[k] for k in found):
                break
            if segment.start.time is not None and all(segment.start.exact[k] is not None for k in found):
                return segment.start
        return self.past[-1].start

    def state_at_event(self, family, lost, segment, guards, time):
        """Return the state at an event; what stands still, is alone in a lost guard, or a polynomial in time, is exact.

        ``time`` is the exact time of the event, or None.
        """
        mode, before, size = segment.mode, segment.start, len(segment.start.exact)
        exact = [w if w is not None and _stands_still(k, mode, before) else None for k, w in enumerate(before.exact)]
        known = {k: before.family.entry(k) for k, w in enumerate(exact) if w is not None}
        alone = (([k for k, c in enumerate(guard.row[:-1]) if c], guard.row) for guard in lost)
        found = {involved[0]: -row[-1] / row[involved[0]] for involved, row in alone if len(involved) == 1}
        for k in {*range(size)} - {*known} if time is not None else ():
            since, parts = self._polynomial(_unit(k, size), segment)
            found |= {k: sum(c * (time - since) ** n for n, c in enumerate(parts))} if parts else {}
        for k, value in found.items():
            exact[k], known[k] = value, self.field.family([[value]])
        null = (*(guard.row for guard in lost), *mode.kept, *(row for other in guards for row in other.null))
        whole = stacked([known.get(k) or family.entry(k) for k in range(size)])
        return EnclosedState(whole, tuple(exact), self.field, null, time)

    def chosen(self, tiers, state, what, before=(), held=frozenset()):
        """Return (mode, its guards from the state on) of the candidate that is proven to follow.

        ``tiers`` are lists of candidates, and the first tier with a candidate that may hold decides. A later tier is
        needed where a force that jumps at one contact releases another, or lets it rest no more than static friction
        would. Of several candidates that hold, the one with the most frictions at rest follows; ``before`` and the
        contacts ``held`` from before the event name a motion that several tell alike. Raises ``Refused`` where the
        verdict on a candidate is not certain, or where no single candidate is left.
        """
        verdicts: dict = {}
        self.look_at(state)
        for candidates in tiers:
            for tried, branch in enumerate(sorted(candidates, key=lambda branch: -len(branches.at_rest(branch)))):
                if tried == MOST_CANDIDATES:
                    raise Refused(f"candidates: over {tried} choices of phases may follow {what}; move the start a "
                                  "little")
                verdicts |= self._verdicts(branch, state)
                if any(verdict > 0 and branches.stands(mode.branch) for mode, (verdict, _) in verdicts.items()):
                    break  # no other candidate has more frictions at rest
            holding = {mode: guards for mode, (verdict, guards) in verdicts.items() if verdict > 0}
            best = branches.most_at_rest(m.branch for m in holding)
            if best and self._are_one(best, holding, state):
                best = [before if what == SWITCH and before in best else _first(best, before, held)]
            best += [m.branch for m in holding if best and all(
                branches.presses_otherwise(self.system, m.branch, other) for other in best)]
            if verdicts and all(self._slips_freely(b, state) for b in best):
                break
        open_ones = [m for m in verdicts if m not in holding and not self._is_covered(m.branch, holding, state)]
        if shared := [m.branch for m in open_ones if self._is_shared(m.branch)]:
            raise not_determined(shared[0])
        if open_ones or len(best) != 1 or len({*map(_own_sides, holding)}) != 1:
            names = ", ".join(sorted({m.name for m in (*open_ones, *holding)})) or "none"
            raise Refused(f"edge: which mode follows after {what} is not certain; candidates: {names}")
        found = next(mode for mode in holding if mode.branch == best[0])
        self._require_one_way(found.branch, state, what)
        self._require_within_limit(found, holding, state, what)
        return self.of(found), holding[found]

    def _are_one(self, best, holding, state):
        """Tell whether the motions of branches that hold do not differ."""
        first, *others = [self.of(next(m for m in holding if m.branch == b)).matrix for b in best]
        rows = (pair for other in others for pair in zip(first, other, strict=True))
        apart = (tuple(a - b for a, b in zip(*pair, strict=True)) for pair in rows)
        return all(leading_sign(row, first, state) == 0 for row in apart)

    def _is_covered(self, branch, holding, state):
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
                raise Refused(f"edge: after {what}, {which_contact(self.system, k)} may rest and may slip in either "
                              "direction")

    def _require_within_limit(self, mode, holding, state, what):
        """Raise ``Refused`` where a contact at rest, of a mode at the limit of a condition, slips in another mode."""
        rest, at_limit = branches.at_rest(mode.branch), not all(self.of(mode).conditions)
        if at_limit and any(self._slips(m, k, state) for m in holding for k in rest - branches.at_rest(m.branch)):
            raise Refused(f"edge: after {what}, equality holds in a condition on the parameters of {mode.name}, which "
                          "may slip as well")

    def _may_leave_rest(self, branch, k, state):
        """Tell whether a branch may hold in which contact k slips, and not in name only, as others hold it."""
        group = next(group for group in coupled(self.here) if k in group)
        signs = self.signs(group, tuple(branch[j] for j in group), state)
        held = -1 in signs.values() or not forces.determined(self.here, branch)
        found = {} if held else self._verdicts(branch, state)
        return any(verdict >= 0 and self._slips(mode, k, state) for mode, (verdict, _) in found.items())

    def _slips(self, mode, k, state):
        """Tell whether the velocity of contact k does not stay 0 in a mode."""
        velocity = mode.velocities.get(k, self.system.frictions[k].velocity)
        return leading_sign(self.row(mode, velocity), self.of(mode).matrix, state) != 0

    def event(self, before, after, lost, state):
        """Return the guard of the event between two modes, or None if the motion of no contact changes.

        Of guards ``lost`` together, one that only touches 0 tells no event of another contact. At a switch it is the
        sliding velocity that jumps or, unless a contact stops there, what the first mode loses on the new side. Which
        friction and kind it has, ``event_between`` says.
        """
        motions = [forces.moving_as(mode.sided, mode.branch) for mode in (before, after)]
        if not (changed := [k for k, (old, new) in enumerate(zip(*motions, strict=True)) if old != new]):
            return None
        if before.branch == after.branch:
            raise Refused(f"edge: {which_contact(self.system, changed[0])}, a slip in name only, begins to slip, or "
                          "ends it, at a switch")
        guard = _together(sorted(lost, key=lambda guard: guard.friction not in (NO_FRICTION, *changed)))
        if NO_FRICTION in (guard.friction, *guard.others):
            beyond = mode_of(self.system, before.branch, before.sides_beyond(after))
            if jumped := self._jumped(beyond, state):
                return jumped
            if guard.kind != "velocity_zero":
                guard = self._halted(after, *motions) or self._lost(beyond, changed[0], state)
        still = in_name_only(before.sided, before.branch)
        kind, friction = branches.event_between(before.branch, after.branch, guard.kind, guard.friction, still)
        return guard._replace(kind=kind, friction=friction)

    def _jumped(self, beyond, state):
        """Return the guard of a sliding velocity that has jumped away from 0, or to the other sign, or None."""
        for k, velocity in beyond.jumping.items():
            old = beyond.branch[k].velocity
            if (sign_at(self.row(beyond, velocity), state) or old) != old:
                return AffineGuard("velocity_zero" if old else "slip_onset", k, ())
        return None

    def _halted(self, after, old, new):
        """Return the guard of a sliding velocity that has jumped to 0 where its contact rests, or None.

        ``old`` and ``new`` are the branches as they move before and after.
        """
        if (k := next((k for k in sorted(branches.at_rest(new)) if old[k].slips), None)) is None:
            return None
        if in_name_only(after.sided, after.branch):
            raise Refused(f"edge: the sliding velocity of {which_contact(self.system, k)} jumps to 0, and it is not "
                          "certain which of the contacts that share it a run names at rest")
        return AffineGuard("velocity_zero", k, ())

    def _lost(self, beyond, changed, state):
        """Return the guard that a mode, which the parameters may exclude, loses on new sides, or one of ``changed``."""
        form = affine_form(beyond, self.waves)
        matrix, rows = self.field.matrix(form), (tuple(map(self.field.exact, row)) for row in form.guards)
        guards = (AffineGuard(guard.kind, guard.friction, row) for guard, row in zip(beyond.guards, rows, strict=True))
        lost = (g for g in guards if g.kind != SWITCH and leading_sign(g.row, matrix, state) == -1)
        return next(lost, AffineGuard("slip_onset", changed, ()))
