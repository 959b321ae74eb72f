r"""Certificates of affine systems of any size: the flow of each mode in balls, and proofs of which mode follows.

``e^{M t}`` is the sum of the residues of ``e^{z t} (z - M)^{-1}``, which ``spectrum`` encloses; M and the guards have
exact entries, see ``rows``. ``enclose`` follows a system from event to event, and ``EnclosedSegment`` is one mode.

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
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from asympk.affine.forcing import Wave
from asympk.automaton.modes import SWITCH, GuardedMode, mode_of
from asympk.certify.balls import Ball, Refused, ball, certain_sign, common, flint, hull
from asympk.certify.enclosure import Budget, first_event
from asympk.certify.rows import (
    EnclosedState,
    ExactEntries,
    Row,
    affine_form,
    ball_at,
    forcing,
    leading,
    leading_sign,
    row_of,
    row_rate,
    sharpened,
    sign_at,
    spanned,
)
from asympk.errors import InputError
from asympk.numbers import Number
from asympk.path import Event
from asympk.scene import Scene
from asympk.symbolic import branches, forces
from asympk.symbolic.branches import OPEN, Phase, all_phases
from asympk.symbolic.sides import inside, measured
from asympk.symbolic.system import System

MOST_EVENTS = 200
_ORDER = 16
TIME = Wave(1, sp.S.Zero, sp.S.Zero, False)


class AffineGuard(NamedTuple):
    """A guard of a mode: the kind of its event, its friction, its row.

    ``touching`` is the number of derivatives, the guard included, that vanish where the mode begins; the next is
    positive.
    """

    kind: str
    friction: int
    row: Row
    touching: int = 0


@dataclass(frozen=True)
class EnclosedMode:
    """One mode at exact parameters: its matrix M, guards, and roots and residues of the resolvent in balls.

    ``kept`` are the rows that vanish throughout the mode: velocities at rest, gaps of closed rigid contacts and their
    rates. ``edges`` are the rows that are positive on the sides of the mode.
    """

    mode: GuardedMode
    matrix: tuple[Row, ...]
    guards: tuple[AffineGuard, ...]
    kept: tuple[Row, ...]
    edges: tuple[Row, ...]
    field: ExactEntries
    roots: tuple
    residues: tuple


def enclose(
    system: System,
    values: tuple[Number, ...],
    sides: Mapping[str, tuple[Number, Number]],
    start: Sequence[tuple[Ball, Fraction | None]],
    until: Number,
    finest: float,
    budget: Budget,
) -> tuple[list[str], list[Event], tuple[Ball, ...]]:
    """Return (names of modes, events, final balls) of an affine system from an enclosure of its start.

    ``sides`` {name: (low, high)} are the parameters that range over an interval. ``start`` has a pair (ball, exact
    Fraction or None) for every state. Raises ``Refused`` where the sequence of modes is not proven.
    """
    modes = _Modes(system, values, sides)
    state = modes.begun(start)
    mode, guards = modes.chosen([modes.every(state)], state, "start")
    t, names, size = ball(0), [mode.mode.name], len(system.states)
    events: list[Event] = []
    while True:
        segment = EnclosedSegment(mode, state)
        left = ball(until) - t
        found = first_event(segment, modes.ending_by(until, guards), left, finest, budget)
        if found is None:
            return names, events, tuple(segment.at(None, left)[k, 0] for k in range(size))
        guard, dt = found
        if not dt < left:
            raise Refused(f"horizon: {guard.kind} at the end itself, until = {float(until):.10g}")
        state = _struck(segment.at(guard, dt), guard, mode, state)
        t = t + dt
        before = mode.mode
        mode, guards = modes.chosen([_after(before, guard), modes.every(state)], state, guard.kind)
        if guard.kind == SWITCH and (guard := modes.lost_beyond(before, mode.mode, state)) is None:
            continue
        names.append(mode.mode.name)
        events.append(Event(guard.kind, t, tuple(state.balls[k, 0] for k in range(size)), guard.friction))
        if len(events) > MOST_EVENTS:
            raise Refused(f"too many: more than {MOST_EVENTS} events by t = {float(t.mid()):.6g}")


def _after(mode, guard):
    """Return the branches that may follow a mode: any branch at a switch, else any phase of the guard's friction."""
    frictions = mode.system.frictions
    lost = range(len(frictions)) if guard.kind == SWITCH else (guard.friction,)
    return product(*(all_phases(frictions[k]) if k in lost else (phase,) for k, phase in enumerate(mode.branch)))


def _struck(balls, guard, mode, before):
    """Return the state at an event; coordinates at rest keep their values, and a guard of one state sets it exactly."""
    still = [w is not None and _stands_still(k, mode, before) for k, w in enumerate(before.exact)]
    exact = [w if stays else None for w, stays in zip(before.exact, still, strict=True)]
    for k in np.flatnonzero(still).tolist():
        balls[k, 0] = before.balls[k, 0]
    involved = [k for k, c in enumerate(guard.row[:-1]) if c]
    if len(involved) == 1:
        exact[involved[0]] = -guard.row[-1] / guard.row[involved[0]]
        balls[involved[0], 0] = mode.field.ball(exact[involved[0]])
    return EnclosedState(balls, tuple(exact), mode.field, (guard.row, *mode.kept))


def _stands_still(k, mode, state):
    """Tell whether every derivative of a coordinate vanishes exactly."""
    row = tuple(int(i == k) for i in range(len(mode.matrix)))
    return all(sign_at(row := row_rate(row, mode.matrix), state) == 0 for _ in mode.matrix)


class _Modes:
    """The modes of a system at exact parameters, each made when it is first needed."""

    def __init__(self, system, values, sides):
        self.system, self._known = system, {}
        self.waves, entries = forcing(system)
        self.field = ExactEntries(system, values, sides, entries)

    def begun(self, start):
        """Return the ``EnclosedState`` at t = 0, where the values of the forcing are exact."""
        waves = [Fraction(int(wave.power == 0 and not wave.sine)) for wave in self.waves]
        pairs = [*start, *((ball(w), w) for w in (*waves, Fraction(1)))]
        return EnclosedState(flint().arb_mat([[b] for b, _ in pairs]), tuple(e for _, e in pairs), self.field)

    def ending_by(self, until, guards):
        """Return the guards without those that depend on the time alone and vanish at ``until``: no mode follows."""
        if TIME not in self.waves:
            return guards
        clock, end = len(self.system.states) + self.waves.index(TIME), self.field.exact(sp.Rational(Fraction(until)))
        return [guard for guard in guards if [k for k, c in enumerate(guard.row[:-1]) if c] != [clock]
                or -guard.row[-1] / guard.row[clock] != end]  # fmt: skip

    def of(self, mode):
        """Return the ``EnclosedMode`` of a mode, or None where the parameters exclude the mode."""
        if mode not in self._known:
            self._known[mode] = self._made(mode)
        return self._known[mode]

    def _made(self, mode):
        try:
            self.field.require_positive([self.field.exact(e) for e in mode.conditions])
            matrix, rows, kept = self.field.placed(affine_form(mode, self.waves))
        except InputError:
            return None
        kinds = [(mode.guards[k].kind, mode.guards[k].friction) for k in kept]
        guards = tuple(AffineGuard(*kind, row) for kind, row in zip(kinds, rows, strict=True))
        edges = tuple(self._row(mode, edge) for side in mode.sides for edge in inside(*side))
        kept = (*self._kept(mode), *self._resting(mode))
        return EnclosedMode(mode, matrix, guards, kept, edges, self.field, *self.field.spectrum(matrix))

    def _resting(self, mode):
        """Return the rows of the phases on whose edge the mode stays, by the law on the edge itself."""
        return [self._row(mode, phase) for phase, side in mode.sides if not inside(phase, side)]

    def _kept(self, mode):
        """Yield the rows that vanish in a mode: velocities of stick, gaps of closed rigid contacts and their rates."""
        closed = [Phase(1, 1) for _ in self.system.frictions]
        for k, (friction, phase) in enumerate(zip(self.system.frictions, mode.branch, strict=True)):
            if phase.mode == "stick":
                yield self._guard(mode_of(self.system, tuple(closed), mode.sides), "velocity_zero", k)
            if friction.constraint is not None and friction.gap is not None and phase != OPEN:
                apart = mode_of(self.system, (*closed[:k], OPEN, *closed[k + 1 :]), mode.sides)
                gap = self._guard(apart, "touch_down", k)
                yield from (gap, row_rate(gap, self.field.matrix(affine_form(apart, self.waves))))

    def _guard(self, mode, kind, friction):
        """Return the row of a guard of a mode."""
        (place,) = (k for k, guard in enumerate(mode.guards) if guard[:2] == (kind, friction))
        return tuple(map(self.field.exact, affine_form(mode, self.waves).guards[place]))

    def _row(self, mode, expr):
        """Return the row of an expression on the sides of a mode."""
        return tuple(map(self.field.exact, row_of(mode, expr, self.waves)))

    def every(self, state):
        """Yield the branches that the signs of velocities and loads at a state, where certain, do not exclude."""
        yield from product(*(self._phases(friction, state) for friction in self.system.frictions))

    def _phases(self, friction, state):
        """Return the phases of a contact that the signs of its velocity and load at a state do not exclude."""
        velocity = self._sign(friction.velocity, state)
        load = None if friction.constraint else self._sign(friction.load, state)
        return [phase for phase in all_phases(friction) if phase == OPEN or (
            velocity in (None, 0, phase.velocity) and load in (None, 0, phase.load))]  # fmt: skip

    def _sign(self, expr, state):
        """Return the sign of an expression at a state, or None where it is not certain, or depends on a switch."""
        with suppress(Refused):
            return sign_at(self._row(mode_of(self.system, (Phase(1, 1),) * len(self.system.frictions)), expr), state)

    def chosen(self, tiers, state, what):
        """Return (mode, its guards from the state on) of the candidate that is proven to follow.

        ``tiers`` are lists of candidates, and the first tier with a candidate that may hold decides. A later tier is
        needed where a force that jumps at one contact releases another. Of several candidates that hold, the one with
        the most frictions at rest follows. Raises ``Refused`` where the verdict on a candidate is not certain, or where
        no single candidate is left.
        """
        verdicts: dict = {}
        for candidates in tiers:
            met = (mode_of(self.system, branch) for branch in candidates if self._met(branch, state))
            sided = (mode for found in met for mode in self._on_sides(found, state))
            verdicts = {mode: found for mode in sided if (found := self._verdict(mode, state))[0] >= 0}
            if verdicts:
                break
        holding = {mode: guards for mode, (verdict, guards) in verdicts.items() if verdict > 0}
        open_ones = [mode for mode in verdicts if mode not in holding]
        best = branches.most_at_rest(m.branch for m in holding)
        if open_ones or len(best) != 1 or len({m.sides for m in holding}) != 1:
            names = ", ".join(sorted({m.name for m in (*open_ones, *holding)})) or "none"
            raise Refused(f"edge: which mode follows after {what} is not certain; candidates: {names}")
        found = next(mode for mode in holding if mode.branch == best[0])
        return self.of(found), holding[found]

    def _met(self, branch, state):
        """Tell whether the forces of a branch are determined; raises ``Refused`` where they are not and it may hold."""
        if forces.determined(self.system, branch):
            return True
        if not any(sign_at(row, state) for row in self._kept(mode_of(self.system, branch))):
            raise Refused(f"rest: the forces of {branches.mode_name(branch)} are not determined")
        return False

    def _on_sides(self, mode, state):
        """Yield a mode on every combination of sides of its switches on which a state may lie."""
        opened = mode.open_phases
        for choice in product(*(self._possible(mode, phase, state) for phase in opened)):
            sided = mode_of(self.system, mode.branch, (*mode.sides, *zip(opened, choice, strict=True)))
            if sided.is_finite or not self._resting(sided):  # on its edge u/|u| has no law
                yield from self._on_sides(sided, state) if opened else (mode,)

    def _possible(self, mode, phase, state):
        """Return the sides of a phase on which a state may lie: where the phase vanishes exactly, both and its edge."""
        row = self._row(mode, measured(phase))
        if measured(phase) == phase:
            sign = sign_at(row, state)
            found = (0, 1, -1) if sign == 0 else sign and (sign,)
        else:
            near = round(float(ball_at(row, state).mid()))
            sign = sign_at((*row[:-1], row[-1] - near), state)
            found = (near, near - 1) if sign == 0 else sign and (near - (sign < 0),)
        if not found:
            raise Refused(f"edge: the side of {phase} = 0 on which the state lies is not certain")
        return found

    def _verdict(self, mode, state):
        """Return (1 if a mode holds at a state, -1 if not, 0 if undecided; its guards).

        A guard that is identically 0 is left out, and a multiple of another guard, which vanishes with it. A motion
        that stays on an edge has the law of the edge, which for floor(u) is that of a side and is left undecided.
        """
        for row in self._kept(mode):
            if (off := sign_at(row, state)) != 0:
                return (-1 if off else 0), ()
        found, verdict, guards = self.of(mode), 1, []
        if found is None:
            return -1, ()
        for guard in found.guards:
            zeros, sign = leading(guard.row, found.matrix, state)
            if sign is not None and sign < 0:
                return -1, ()
            verdict = 0 if sign is None else verdict
            if sign != 0 and not any(spanned(guard.row, (other.row,)) for other in guards):
                guards.append(guard._replace(touching=zeros))
        moved = [leading_sign(row, found.matrix, state) for row in found.edges]
        stays = [leading_sign(row, found.matrix, state) for row in self._resting(mode)]
        if any(stays) or (0 in moved and all(measured(phase) == phase for phase, _ in mode.sides)):
            return -1, ()
        return verdict * (None not in stays and all(moved)), tuple(guards)

    def lost_beyond(self, before, after, state):
        """Return the guard that ``before`` loses on the sides of ``after``; None where both have the same branch."""
        torn = [k for k, (a, b) in enumerate(zip(before.branch, after.branch, strict=True)) if a != b]
        if not torn:
            return None
        beyond = mode_of(self.system, before.branch, after.sides)  # a mode that the parameters may exclude there
        form = affine_form(beyond, self.waves)
        matrix, rows = self.field.matrix(form), (tuple(map(self.field.exact, row)) for row in form.guards)
        guards = (AffineGuard(guard.kind, guard.friction, row) for guard, row in zip(beyond.guards, rows, strict=True))
        lost = (g for g in guards if g.kind != SWITCH and leading_sign(g.row, matrix, state) == -1)
        return next(lost, AffineGuard("slip_onset", torn[0], ()))


class EnclosedSegment:
    """The motion of one mode from an enclosure of its start, with the methods that ``enclosure.first_event`` needs.

    Quantities are sums of functions of time, ``t^k/k! e^{l t}`` for every root l and every k below its multiplicity.
    Where rows vanish at the start, the states that are known least are written in terms of the others (``sharpened``).
    Jets are divided by ``e^{growth t}``, the fastest growth of the mode, so that wide balls do not hide their signs.
    Weights of close roots are large and cancel: where a sign is hidden, a Taylor series at the middle is taken as well.
    """

    unstable = False

    def __init__(self, mode: EnclosedMode, state: EnclosedState):
        acb, acb_mat, places = flint().acb, flint().acb_mat, range(state.balls.nrows())
        self.mode, self.work = mode, len(mode.roots)
        units = [tuple(int(i == k) for i in places) for k in places]
        known = acb_mat([[acb(state.field.ball(c)) for c in sharpened(unit, state)] for unit in units])
        whole = acb_mat([[acb(state.balls[k, 0])] for k in places])
        pairs = zip(mode.roots, mode.residues, strict=True)
        columns = [part * known * whole * acb(2 if turn > 0 else 1) for (_, turn, _), parts in pairs for part in parts]
        self.terms = acb_mat([[column[k, 0] for column in columns] for k in places])
        decays = [decay for decay, _, _ in mode.roots]
        self.growth = max([ball(0), *(decay for decay in decays if decay > 0)], key=lambda a: float(a.mid()))
        self._known: dict[AffineGuard, list] = {}

    @cached_property
    def rate(self) -> Any:
        """The matrix that turns the weights of a quantity, a row, into those of its derivative."""
        places = [(root, k) for root in self.mode.roots for k in range(root[2])]
        found = flint().acb_mat(len(places), len(places))
        for place, ((decay, turn, _), k) in enumerate(places):
            found[place, place] = flint().acb(decay, turn)
            if k:
                found[place, place - 1] = 1
        return found

    def _functions(self, t, growth):
        """Return the functions of time (functions, 1), divided by ``e^{growth t}``."""
        found = []
        for decay, turn, many in self.mode.roots:
            found.append([flint().acb((decay - growth) * t, turn * t).exp()])
            for k in range(1, many):
                found.append([found[-1][0] * t / k])
        return flint().acb_mat(found)

    def at(self, guard: AffineGuard | None, t: Ball) -> Any:
        """Return the state (n + 1, 1) at the time ball t, at which ``guard`` vanishes if given."""
        functions = self._functions(t, ball(0))
        found = (self.terms * functions).real
        if guard:
            sharp = (self._without_widest(guard, functions) * functions).real
            found = flint().arb_mat([[common(found[k, 0], sharp[k, 0])] for k in range(found.nrows())])
        found[found.nrows() - 1, 0] = 1
        return found

    def _without_widest(self, guard, functions):
        """Return the weights of the states where a guard vanishes, without the real function that is known least in it.

        The equation of the guard gives this function, as a rule a fast exponential, by the others.
        """
        turns = [turn for _, turn, many in self.mode.roots for _ in range(many)]
        weights = self._series(guard, 0)[0].tolist()[0]
        shares = [float((w * f).real.rad()) if turn == 0 and not w.contains(0) else 0.0
                  for w, (f,), turn in zip(weights, functions.tolist(), turns, strict=True)]  # fmt: skip
        widest = shares.index(max(shares))
        if not shares[widest] > 0:
            return self.terms
        factors = [0 if k == widest else w / weights[widest] for k, w in enumerate(weights)]
        return flint().acb_mat([[0 if k == widest else c - row[widest] * factors[k] for k, c in enumerate(row)]
                                for row in self.terms.tolist()])  # fmt: skip

    def _series(self, guard, orders):
        """Return the weights of the Taylor coefficients of the jets of a guard, to an order at least: a row per jet."""
        acb, acb_mat = flint().acb, flint().acb_mat
        if guard not in self._known:
            rows = [acb_mat([[acb(self.mode.field.ball(c)) for c in guard.row]]) * self.terms]
            for _ in range(max(2, guard.touching)):
                rows.append(rows[-1] * self.rate)
            self._known[guard] = [acb_mat([row.entries() for row in rows])]
        found = self._known[guard]
        while len(found) <= orders:
            last = found[-1]
            found.append((last * self.rate - last * acb(self.growth)) * acb(ball(Fraction(1, len(found)))))
        return found

    def jet(self, guard: AffineGuard, t: Ball, order: int = 0) -> tuple[Ball, ...]:
        """Return the guard and its first ``order`` derivatives on ``t``, all times one positive factor.

        There are two derivatives, or as many as ``guard.touching``.
        """
        functions = self._functions(t, self.growth)
        found = (self._series(guard, 0)[0] * functions).real.entries()[: order + 1]
        if t.is_exact() or all(map(certain_sign, found)):
            return tuple(found)
        *terms, rest = self._series(guard, _ORDER)
        middle, total = self._functions(t.mid(), self.growth), (rest * functions).real
        for term in reversed(terms):
            total = total * (t - t.mid()) + (term * middle).real
        return tuple(map(common, found, total.entries()))


def start_of(scene: Scene, box: Mapping[str, tuple[Fraction, Fraction]]) -> list[tuple[Ball, Fraction | None]]:
    """Return the start of a scene as pairs (ball, exact Fraction or None), with the intervals of ``box`` in it."""
    found = []
    for name, value in zip(scene.names, scene.start, strict=True):
        low, high = box.get(name, (Fraction(value),) * 2)
        found.append((hull(low, high), low if low == high else None))
    return found
