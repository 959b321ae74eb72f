r"""Certificates for affine systems of any size: each mode's exponential in balls, and proofs of what follows.

``e^{M t}`` is the sum of the residues of ``(z - M)^{-1}``, which ``spectrum`` encloses. Parameters may range over
intervals: the entries of M and of the guards are then rational functions of them, and exact as such. What is not
rational in them, as pi or a root, ranges over its ball like one more parameter.
Which mode begins or follows is proven by the signs of every guard, and of the derivatives of those that vanish, of
every mode that may follow: one holds on all points of the balls and all others fail on all of them. That a quantity
vanishes is never read off a ball: it is exact arithmetic at a start, or its coefficients are a combination of those of
quantities that vanish by the event.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from asympk.affine.form import Form, form_of, is_rational
from asympk.automaton.modes import mode_of
from asympk.certify.balls import Ball, Refused, ball, ball_of, certain_sign, flint, hull
from asympk.certify.enclosure import Budget, first_event
from asympk.certify.spectrum import Spectrum, of_balls, of_exact
from asympk.errors import InputError
from asympk.numbers import Number
from asympk.path import Event
from asympk.scene import Scene
from asympk.symbolic import branches
from asympk.symbolic.branches import OPEN, Branch, Phase, all_phases
from asympk.symbolic.long import replaced
from asympk.symbolic.system import System

MOST_EVENTS = 200


class ExactEntries:
    """The exact entries of modes: Fractions, or rational functions of the parameters that range over intervals.

    Of ``entries``, what is not rational in the parameters ranges over an interval, too.
    """

    def __init__(
        self, system: System, values: tuple[Number, ...], sides: Mapping[str, tuple[Number, Number]],
        entries: Iterable[sp.Expr],
    ):  # fmt: skip
        named = dict(zip(system.parameters, values, strict=True))
        self.numbers = {s: _exact(v) for s, v in named.items() if s.name not in sides}
        self.balls = {s: hull(*sides[s.name]) for s in named if s.name in sides}
        placed = (self._placed(entry) for entry in entries if not is_rational(entry))
        self.ranging = {atom: sp.Dummy() for atom in sorted({a for e in placed for a in _irrational(e)}, key=str)}
        self.balls |= {symbol: ball_of(atom, self.balls) for atom, symbol in self.ranging.items()}
        self.field = sp.QQ.frac_field(*self.balls) if self.balls else None
        self._known: dict[Any, Ball] = {}

    def _placed(self, expr: sp.Expr) -> sp.Expr:
        expr = expr.subs(self.numbers)
        if expr.has(sp.zoo, sp.oo, sp.nan):
            raise Refused("edge: a coefficient or a reaction is not finite at these parameters")
        return expr

    def exact(self, expr: sp.Expr) -> Any:
        """Return an expression in the parameters as an exact entry."""
        expr = replaced(self._placed(expr), self.ranging)
        return self.field.from_sympy(expr) if self.field else Fraction(int(expr.p), int(expr.q))

    def ball(self, entry: Any) -> Ball:
        """Return an exact entry as a ball."""
        if isinstance(entry, int | Fraction):
            return ball(entry)
        if entry not in self._known:
            self._known[entry] = ball_of(entry.as_expr(), self.balls)
        return self._known[entry]

    def placed(self, form: Form) -> tuple[tuple, tuple, tuple[int, ...]]:
        """Return (matrix, guards, which guards move) of a form; raises ``InputError`` for a mode that is not entered.

        Raises ``Refused`` where a guard that depends on the parameters alone has no certain sign, or is 0.
        """
        matrix = self.matrix(form)
        guards = [tuple(map(self.exact, row)) for row in form.guards]
        kept = tuple(k for k, row in enumerate(guards) if any(row[:-1]))
        self.require_positive([row[-1] for k, row in enumerate(guards) if k not in kept])
        return matrix, tuple(guards[k] for k in kept), kept

    def matrix(self, form: Form) -> tuple[tuple, ...]:
        """Return the rows of M of a form, ``(w, 1)' = M (w, 1)``."""
        return *(tuple(map(self.exact, row)) for row in form.matrix), (self.exact(sp.S.Zero),) * (len(form.matrix) + 1)

    def require_positive(self, entries: Iterable[Any]) -> None:
        """Raise ``InputError`` where an entry is negative, ``Refused`` where that is not certain, or it is 0."""
        signs = [(entry, certain_sign(self.ball(entry))) for entry in entries]
        if any(sign < 0 for _, sign in signs):
            raise InputError("a mode is not entered at these parameters")
        for entry, sign in signs:
            if not sign:
                found = "box: it holds in a part of the box only" if entry else "edge: it is met with equality"
                raise Refused(f"{found}, a condition on the parameters of a mode")

    def spectrum(self, matrix: tuple[tuple[Any, ...], ...]) -> Spectrum:
        """Return the roots and residues of a matrix in balls; see ``spectrum``."""
        if not self.field:
            return of_exact(matrix)
        pattern = np.array([[bool(entry) for entry in row] for row in matrix])
        return of_balls(pattern, [[self.ball(entry) for entry in row] for row in matrix])


def _irrational(expr: sp.Expr) -> Iterator[sp.Expr]:
    """Yield the largest parts of an expression that are no rational functions."""
    if expr.is_Add or expr.is_Mul or (expr.is_Pow and expr.exp.is_Integer):
        for part in expr.args:
            yield from _irrational(part)
    elif not is_rational(expr):
        yield expr


class AffineGuard(NamedTuple):
    """A guard of a mode: the event that its loss is, its friction, its row; ``touching``: zero at the start, rising."""

    kind: str
    friction: int
    row: tuple[Any, ...]
    touching: bool = False


class EnclosedState(NamedTuple):
    """Enclosures of (w, 1), the exact coordinates where they are known (else None), and rows that vanish there."""

    balls: Any
    exact: tuple
    field: ExactEntries
    null: tuple = ()


@dataclass(frozen=True)
class EnclosedMode:
    """One mode with exact numbers: its matrix, guards and the residues of its resolvent in balls.

    ``kept`` are the rows that vanish in it: velocities at rest, gaps of closed rigid contacts, and their rates.
    """

    name: str
    branch: Branch
    matrix: tuple[tuple[Any, ...], ...]
    guards: tuple[AffineGuard, ...]
    kept: tuple[tuple[Any, ...], ...]
    field: ExactEntries
    roots: tuple
    residues: tuple


def enclose(
    system: System,
    values: tuple[Number, ...],
    sides: Mapping[str, tuple[Number, Number]],
    start: Sequence[tuple[Ball, Fraction | None]],
    until: Ball,
    finest: float,
    budget: Budget,
) -> tuple[list[str], list[Event], tuple[Ball, ...]]:
    """Return (modes, events, final balls) of a system from enclosures of its start; raises ``Refused``.

    ``sides`` {name: (low, high)} are those of parameters, ``start`` pairs (ball, Fraction or None).
    """
    modes = _Modes(system, values, sides)
    state = modes.begun(start)
    phases = [*map(all_phases, system.frictions)]
    mode, guards = modes.chosen(list(product(*phases)), state, "start")
    t, names, size = ball(0), [mode.name], len(system.states)
    events: list[Event] = []
    while True:
        segment = EnclosedSegment(mode, state.balls)
        left = until - t
        found = first_event(segment, guards, left, finest, budget)
        if found is None:
            return names, events, tuple(segment.at(None, left)[k, 0] for k in range(size))
        guard, dt = found
        if not dt < left:
            raise Refused(f"horizon: {guard.kind} at the end itself, until = {float(until.mid()):.10g}")
        state = _struck(segment.at(guard, dt), guard, mode, state)
        t = t + dt
        phases = [(phase,) for phase in mode.branch]
        phases[guard.friction] = all_phases(system.frictions[guard.friction])
        mode, guards = modes.chosen(list(product(*phases)), state, guard.kind)
        names.append(mode.name)
        events.append(Event(guard.kind, t, tuple(state.balls[k, 0] for k in range(size)), guard.friction))
        if len(events) > MOST_EVENTS:
            raise Refused(f"too many: more than {MOST_EVENTS} events by t = {float(t.mid()):.6g}")


def _struck(balls, guard, mode, before):
    """Return the state at an event: what stands still is as it was, and a single lost state is set, not computed."""
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
    return all(_sign(row := _times(row, mode.matrix), state) == 0 for _ in mode.matrix)


class _Modes:
    """The modes of a system at exact values, made as they are looked at."""

    def __init__(self, system, values, sides):
        self.system, self._known = system, {}
        forms = [form_of(mode_of(system, branch)) for branch in branches.telling(system)]
        self.waves = forms[0].waves
        self.field = ExactEntries(system, values, sides, {e for form in forms for e in form.entries})

    def begun(self, start):
        """Return the ``EnclosedState`` at t = 0: the forcing is exact there."""
        waves = [Fraction(int(wave.power == 0 and not wave.sine)) for wave in self.waves]
        pairs = [*start, *((ball(w), w) for w in (*waves, Fraction(1)))]
        return EnclosedState(flint().arb_mat([[b] for b, _ in pairs]), tuple(e for _, e in pairs), self.field)

    def _form(self, branch: Branch) -> Form:
        form = form_of(mode_of(self.system, branch))
        if form is None:
            raise Refused("not affine: a mode is not linear in the states")
        if form.waves != self.waves:
            raise Refused("forcing: the modes are forced by different functions of time")
        return form

    def of(self, branch):
        """Return the ``EnclosedMode`` of a branch, or None where it is never entered."""
        if branch not in self._known:
            self._known[branch] = self._made(branch)
        return self._known[branch]

    def _made(self, branch):
        mode = mode_of(self.system, branch)
        try:
            self.field.require_positive([self.field.exact(e) for e in mode.conditions])
            matrix, rows, kept = self.field.placed(self._form(branch))
        except InputError:
            return None
        kinds = [(mode.guards[k].kind, mode.guards[k].friction) for k in kept]
        guards = tuple(AffineGuard(*kind, row) for kind, row in zip(kinds, rows, strict=True))
        kept = tuple(self._kept(branch))
        return EnclosedMode(mode.name, branch, matrix, guards, kept, self.field, *self.field.spectrum(matrix))

    def _kept(self, branch):
        """Yield the rows that vanish in a branch: a rigid contact that is closed has neither a gap nor a gap rate."""
        closed = [Phase(1, 1) for _ in self.system.frictions]
        for k, (friction, phase) in enumerate(zip(self.system.frictions, branch, strict=True)):
            if phase.mode == "stick":
                yield self._row(tuple(closed), "velocity_zero", k)
            if friction.constraint is not None and friction.gap is not None and phase != OPEN:
                apart = (*closed[:k], OPEN, *closed[k + 1 :])
                gap = self._row(apart, "touch_down", k)
                yield from (gap, _times(gap, self.field.matrix(self._form(apart))))

    def _row(self, branch, kind, friction):
        """Return the row of a guard of a branch."""
        guards, form = mode_of(self.system, branch).guards, self._form(branch)
        (place,) = (k for k, guard in enumerate(guards) if guard[:2] == (kind, friction))
        return tuple(map(self.field.exact, form.guards[place]))

    def chosen(self, candidates, state, what):
        """Return (mode, its guards from here on) of the one candidate that goes on; at rest stays at rest."""
        holding, open_ones = {}, []
        for branch in candidates:
            verdict, guards = self._verdict(branch, state)
            if verdict > 0:
                holding[branch] = guards
            elif verdict == 0:
                open_ones.append(branch)
        best = branches.most_at_rest(holding)
        if open_ones or len(best) != 1:
            names = ", ".join(sorted({branches.mode_name(b) for b in (*open_ones, *best)})) or "none"
            raise Refused(f"edge: which mode follows after {what} is not certain; candidates: {names}")
        return self.of(best[0]), holding[best[0]]

    def _verdict(self, branch, state):
        """Return (1 where a branch holds, -1 where it does not, 0 if that is open; its guards not 0 for ever)."""
        for row in self._kept(branch):
            if (off := _sign(row, state)) != 0:
                return (-1 if off else 0), ()
        mode, verdict, guards = self.of(branch), 1, []
        if mode is None:
            return -1, ()
        for guard in mode.guards:
            row, found = guard.row, _sign(guard.row, state)
            touching = found == 0
            for _ in mode.matrix:
                if found != 0:
                    break
                row = _times(row, mode.matrix)
                found = _sign(row, state)
            if found is not None and found < 0:
                return -1, ()
            verdict = 0 if found is None else verdict
            if found != 0:
                guards.append(guard._replace(touching=touching))
        return verdict, tuple(guards)


def _exact(value):
    value = Fraction(value)
    return sp.Rational(value.numerator, value.denominator)


def _sign(row, state):
    """Return the sign of ``row . (w, 1)``, 0 only where it vanishes exactly, None where it is not certain."""
    if all(w is not None for c, w in zip(row, state.exact, strict=True) if c):
        value = sum(c * w for c, w in zip(row, state.exact, strict=True) if c)
        if isinstance(value, int | Fraction):
            return (value > 0) - (value < 0)
        return (certain_sign(state.field.ball(value)) or None) if value else 0
    if _spanned(row, state.null):
        return 0
    return certain_sign(sum((state.field.ball(c) * state.balls[k, 0] for k, c in enumerate(row) if c), ball(0))) or None


def _times(row, matrix):
    return tuple(sum(c * m for c, m in zip(row, column, strict=True) if c) for column in zip(*matrix, strict=True))


def _spanned(row, rows):
    """Tell whether a row is a linear combination of others, in exact arithmetic."""
    row, basis = list(row), []
    for other in rows:
        reduced = _reduced(list(other), basis)
        if any(reduced):
            basis.append(reduced)
    return not any(_reduced(row, basis))


def _reduced(row, basis):
    for other in basis:
        place = next(k for k, c in enumerate(other) if c)
        if row[place]:
            factor = row[place] / other[place]
            row = [a - factor * b for a, b in zip(row, other, strict=True)]
    return row


class EnclosedSegment:
    """The motion of one mode from an enclosure of its start, with the methods that ``enclosure.first_event`` asks for.

    Where a part grows like ``e^{a t}`` the jets are divided by it, so that their signs do not drown in its growth.
    """

    unstable = False

    def __init__(self, mode: EnclosedMode, start: Any):
        self.mode, self.start, self.work = mode, start, len(mode.roots)
        acb_mat, acb = flint().acb_mat, flint().acb
        whole = acb_mat([[acb(start[k, 0])] for k in range(start.nrows())])
        self.terms = [[matrix * whole for matrix in part] for part in mode.residues]
        decays = [decay for decay, _, _ in mode.roots]
        self.growth = max([ball(0), *(decay for decay in decays if decay > 0)], key=lambda a: float(a.mid()))
        self._weights: dict[tuple, list] = {}

    def _functions(self, t, growth):
        """Return the complex ``t^k/k! e^{(l - growth) t}`` of every root."""
        found = []
        for decay, turn, many in self.mode.roots:
            size = flint().acb((decay - growth) * t, turn * t).exp()
            powers = [size]
            for k in range(1, many):
                powers.append(powers[-1] * t / k)
            found.append(powers)
        return found

    def at(self, guard: AffineGuard | None, t: Ball) -> Any:
        """Return the state (n + 1, 1) at the time ball t."""
        size = self.start.nrows()
        total = [[flint().arb(0)] for _ in range(size)]
        for (_, turn, _), powers, terms in zip(self.mode.roots, self._functions(t, ball(0)), self.terms, strict=True):
            factor = 2 if turn > 0 else 1
            for power, term in zip(powers, terms, strict=True):
                for k in range(size):
                    total[k][0] = total[k][0] + factor * (power * term[k, 0]).real
        total[-1][0] = flint().arb(1)
        return flint().arb_mat(total)

    def _scalars(self, guard):
        """Return, for the guard and its first two derivatives, the coefficients of every function."""
        if guard.row not in self._weights:
            found = [[[self._applied(guard.row, term) for term in terms] for terms in self.terms]]
            for _ in range(2):
                found.append([*map(_derived, self.mode.roots, found[-1])])
            self._weights[guard.row] = found
        return self._weights[guard.row]

    def _applied(self, row, term):
        weights = ((self.mode.field.ball(c), k) for k, c in enumerate(row) if c)
        return sum((flint().acb(weight) * term[k, 0] for weight, k in weights), flint().acb(0))

    def jet(self, guard: AffineGuard, t: Ball, order: int = 0) -> tuple[Ball, ...]:
        """Return the guard and its first ``order`` derivatives (at most 2) on ``t``, all times one positive factor."""
        functions = self._functions(t, self.growth)
        return tuple(self._sum(weights, functions) for weights in self._scalars(guard)[: order + 1])

    def _sum(self, weights, functions):
        total = flint().arb(0)
        for (_, turn, _), powers, factors in zip(self.mode.roots, functions, weights, strict=True):
            factor = 2 if turn > 0 else 1
            for power, weight in zip(powers, factors, strict=True):
                total = total + factor * (power * weight).real
        return total


def _derived(root, factors):
    """Return the coefficients of ``t^k/k! e^{l t}`` in the derivative of a sum with coefficients ``factors``."""
    value = flint().acb(root[0], root[1])
    return [value * factor + following for factor, following in zip(factors, [*factors[1:], 0], strict=True)]


def start_of(scene: Scene, box: Mapping[str, tuple[Fraction, Fraction]]) -> list[tuple[Ball, Fraction | None]]:
    """Return the starts of a scene as pairs (ball, Fraction or None), ``box`` {state: (low, high)} put in."""
    found = []
    for name, value in zip(scene.names, scene.start, strict=True):
        low, high = box.get(name, (Fraction(value),) * 2)
        found.append((hull(low, high), low if low == high else None))
    return found
