"""A mode on numbers: its rates, Jacobian and guards, where it switches by the time, and what it snaps to."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp

from asympk.automaton.contacts import clear_sign, nudges
from asympk.automaton.modes import SWITCH, GuardedMode, function
from asympk.errors import NotDerivable, OutOfRange
from asympk.symbolic.branches import Branch, held, rate_along
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.sides import on_sides
from asympk.symbolic.switches import Switch, peaks_of, sideless_of, slopes_and_phases, switches_of

DEPENDENT = 2.0**-60  # of a gradient's square: what is left of it across those before, where rounding is all that is
FARTHEST = 1e-3  # of the largest state, that a guard of forces moves one; beyond it the guard's gradient is rounding
LATEST = 1e-9  # of a time, by which doubles miss the zero of a guard of the time in which large terms cancel
NEWTON = 3  # steps from there to all digits
DERIVATIVES = 4  # that tell on which side of a phase a motion begins
LOOKS = 256  # steps at least of a stretch that the time drives
NEXT_TO_NOTHING = 1e-8  # of a divisor's first value: of a square, the root of that
BESIDE = 4  # roundings of a time, by which smooth stretches keep away from what switches by the time
OF_STATES = ("velocity_zero", "touch_down")  # kinds of guards that no time alone decides

State = tuple[Any, ...]


@dataclass(frozen=True)
class NumericMode:
    """A mode on numbers: ``rhs``, ``jac`` and ``guard_values`` of (t, state); guards are positive inside it.

    ``kinds`` says of every guard which event its loss is, and of which friction. The functions without checks, of
    ``(t, *state, *p)``, are ``field``, ``jacobian`` and ``guards``.
    """

    mode: GuardedMode
    p: tuple[Any, ...]
    target: str
    functions: Any

    @property
    def name(self) -> str:
        """The name of the mode."""
        return self.mode.name

    @property
    def branch(self) -> Branch:
        """What every friction does in this mode."""
        return self.mode.branch

    @cached_property
    def kinds(self) -> tuple[tuple[str, int], ...]:
        """The kind of event and the friction of every guard."""
        return tuple((guard.kind, guard.friction) for guard in self.mode.guards)

    @cached_property
    def timed(self) -> bool:
        """Whether a guard may vary more than the state: it depends on the time itself, or switches and is bent."""
        time, states = self.mode.system.time, {*self.mode.system.states}
        phases = [guard.value for guard in self.mode.guards if guard.kind == SWITCH]
        bent = any(slope_by(phase, s).free_symbols & states for phase in phases for s in phase.free_symbols & states)
        return bent or any(value.has(time or sp.nan) for value in self.mode.guard_values)

    @cached_property
    def field(self) -> Callable[..., tuple]:
        """The rates as a function of (t, *state, *p)."""
        return self._compiled(self.mode.rates)

    @cached_property
    def jacobian(self) -> Callable[..., tuple]:
        """The derivatives of the rates, row by row, as a function of (t, *state, *p)."""
        return self._compiled(self.mode.rates, self.mode.units)

    @cached_property
    def guards(self) -> Callable[..., tuple]:
        """The guards as a function of (t, *state, *p)."""
        return self._compiled(self.mode.guard_values)

    @cached_property
    def guard_slopes(self) -> Callable[..., tuple]:
        """The rates of the guards along the field as a function of (t, *state, *p)."""
        return self._compiled(self.mode.guard_values, (self.mode.flow,))

    @cached_property
    def poles(self) -> Callable[..., tuple]:
        """What the rates are divided by as a function of (t, *state, *p)."""
        return self._compiled(self.mode.poles)

    def pole_values(self, t: Any, state: State) -> tuple:
        """Return the values of what the rates are divided by."""
        return self.poles(t, *state, *self.p) if self.mode.poles else ()

    def require_one_side(self, before: tuple, t: Any, state: State) -> tuple:
        """Return the values of what the rates are divided by; raises ``OutOfRange`` where one has changed its sign."""
        after = self.pole_values(t, state)
        for expr, a, b in zip(self.mode.poles, before, after, strict=True):
            if a * b < 0:
                raise OutOfRange(f"the rates of mode {self.name} have a pole, which the motion has passed before t = "
                                 f"{float(t):.8g}: {expr!s:.120} = 0; end the run before it")  # fmt: skip
        return after

    def vanishing(self, first: tuple, t: Any, state: State) -> sp.Expr | None:
        """Return what the rates are divided by that is next to nothing beside its ``first`` value, or None."""
        values = zip(self.mode.poles, first, self.pole_values(t, state), strict=True)
        return next((expr for expr, begun, value in values if abs(value) < NEXT_TO_NOTHING * abs(begun)), None)

    def smooth_until(self, t: Any, until: Any) -> Any:
        """Return the time just before the next at which the mode switches by the time alone, or ``until``."""
        return self._before(switches_of(self.mode.system), t, until)

    def steps_until(self, t: Any, until: Any) -> Any:
        """Return that time, or that of the next peak of what moves by the time alone: a step is to end there."""
        return self._before((*switches_of(self.mode.system), *peaks_of(self.mode.system)), t, until)

    def _before(self, known: tuple[Switch, ...], t: Any, until: Any) -> Any:
        ends = (switch * (1 - self.beside) for switch in self._switched_near(known, t))
        return min([until, *(end for end in ends if end > t)])

    def require_smooth(self, t: Any, until: Any) -> None:
        """Raise ``NotDerivable`` where the mode is switched by the state, or by the time before ``until``."""
        switched, otherwise = [f"{phase} = 0" for phase in self.mode.bent_phases], ""
        if not switched and t < until and self.mode.switches and (end := self.smooth_until(t, until)) < until:
            switched, otherwise = [f"t = {float(end):.6g}"], ", or end the run before it"
        if switched:
            raise NotDerivable(f"mode {self.name} switches at {', '.join(switched)}: this model follows no switch; use "
                               f"an exact method{otherwise}")  # fmt: skip

    def longest_step(self, span: Any) -> Any:
        """Return the longest step within a span: a motion that a clock drives may stand still between two pulses."""
        return span / LOOKS if self._driven else math.inf

    @cached_property
    def _driven(self) -> bool:
        """Whether the time, or a state that goes like it, stands in a rate or a guard otherwise than in a power."""
        rates = dict(zip(self.mode.system.states, self.mode.rates, strict=True))
        clocks = {s for s, rate in rates.items() if rate == 1} | ({self.mode.system.time} - {None})
        exprs = (*self.mode.rates, *self.mode.guard_values) if clocks else ()
        return not all(expr.is_polynomial(*clocks) for expr in exprs)

    def after_switch(self, t: Any) -> Any:
        """Return the time just after a switch that ``t`` is just before."""
        return t * (1 + 3 * self.beside)

    def moved_on(self, t: Any, state: State, span: Any) -> tuple[Any, State]:
        """Return the time and the state after a span so short that the rates stand still."""
        return t + span, tuple(w + span * rate for w, rate in zip(state, self.rhs(t, state), strict=True))

    def after_start(self, until: Any) -> Any:
        """Return the time 0 at which a run to ``until`` starts, or that just after it where a switch may be there."""
        near = self.beside * until
        system, start = self.mode.system, 0 * until
        return 3 * near if any(abs(t) <= near for t in self._switched_near(sideless_of(system), start)) else start

    @property
    def beside(self) -> Any:
        """The relative distance in time that smooth stretches keep from a switch."""
        return BESIDE * getattr(self.functions, "eps", 2.0**-52)

    def _switched_near(self, known: tuple[Switch, ...], t: Any) -> list:
        """Return the times next to ``t`` at which something switches by the time alone."""
        found: list = []
        if known:
            lines = slopes_and_phases(known, self.mode.system.time)
            values = self.values(lines, t, tuple(t for _ in self.mode.system.states))
            for switch, slope, phase in zip(known, values[::2], values[1::2], strict=True):
                wholes = range(int(phase) - 2, int(phase) + 3) if switch.every else (0,)
                found += [t + (n - phase) / slope for n in wholes] if slope else []
        return found

    def values(self, exprs: tuple[sp.Expr, ...], t: Any, state: State) -> tuple:
        """Return the values of expressions at a time and a state."""
        return self._compiled(exprs)(t, *state, *self.p)

    def signs(self, exprs: tuple[sp.Expr, ...], t: Any, state: State, slack: Any = 0) -> tuple[int, ...]:
        """Return the signs of expressions, 0 of what rounding, or a relative error ``slack``, may have made 0."""
        rows = (self.values(exprs, *place) for place in ((t, state), *nudges(t, state, max(slack, self.beside))))
        return tuple(map(clear_sign, zip(*rows, strict=True)))

    def departure(self, phase: sp.Expr, t: Any, state: State, slack: Any = 0) -> int:
        """Return the sign of the first derivative of a phase along the field that does not vanish; 0 of none.

        What the rounding of the state, or its relative error ``slack``, might have made of 0 vanishes.
        """
        for _ in range(DERIVATIVES):
            phase = self.mode.drift(phase)
            if sign := self.signs((phase,), t, state, slack)[0]:
                return sign
            if phase == 0:
                break
        return 0

    def holds(self, t: Any, state: State) -> bool:
        """Tell whether no guard is negative, and none that vanishes falls."""
        exprs = self.mode.guard_values
        told = zip(exprs, self.signs(exprs, t, state), strict=True)
        return all((sign or self.departure(expr, t, state)) >= 0 for expr, sign in told)

    def leaves(self, phase: sp.Expr, sign: int, t: Any, state: State, slack: Any = 0) -> bool:
        """Tell whether a phase that vanishes becomes of a sign along the field, or for 0 stays as it is."""
        if departure := self.departure(phase, t, state, slack):
            return departure == sign
        behind = self.mode.rates_behind(phase)
        stands = self.mode.drift(phase) == 0 or (behind is not None and not any(self.values(behind, t, state)))
        return stands == (sign == 0)

    def rhs(self, t: Any, state: State) -> tuple:
        """Return the rates at a time and a state."""
        return self.field(t, *state, *self.p)

    def jac(self, t: Any, state: State) -> tuple:
        """Return the rows of the Jacobian at a time and a state."""
        n = len(state)
        flat = self.jacobian(t, *state, *self.p)
        return tuple(flat[k : k + n] for k in range(0, n * n, n))

    def guard_values(self, t: Any, state: State) -> tuple:
        """Return the values of the guards."""
        return self.guards(t, *state, *self.p)

    def guard_rates(self, t: Any, state: State) -> tuple:
        """Return the rates of the guards along the field."""
        return self.guard_slopes(t, *state, *self.p)

    def guard_gradient(self, guard: int, t: Any, state: Sequence) -> tuple:
        """Return the derivatives of one guard by the states."""
        return self._gradient(self.mode.guards[guard].value)(t, *state, *self.p)

    def snapped(self, guard: int, t: Any, state: State) -> State:
        """Return ``state`` moved onto the zero of a guard, where that is near: one of forces may depend on time alone.

        A contact that sticks stays at rest, however much its velocity moves the guard, and a rigid contact that is
        closed stays so, g = g' = 0.
        """
        expressions = (*self.kept, self.mode.guards[guard].value)
        moved = self._projected(expressions, t, state) if self.kept else self._on_zero(guard, t, state)
        if self.kinds[guard][0] in OF_STATES:
            return moved
        farthest = FARTHEST * max(map(abs, state))
        near = all(abs(new - old) <= farthest for new, old in zip(moved, state, strict=True))
        return moved if near else self.settled(t, state)

    def time_of_fall(self, guard: int, t: Any, state: State) -> Any:
        """Return the time at which a guard that no state moves falls through 0, where that is near."""
        if any(self.guard_gradient(guard, t, state)):
            return t
        found = t
        for _ in range(NEWTON):
            rate = self.guard_rates(found, state)[guard]
            if not rate < 0:
                return t
            found -= self.guard_values(found, state)[guard] / rate
        return found if abs(found - t) <= LATEST * t else t

    def _on_zero(self, guard: int, t: Any, state: State) -> State:
        """Return ``state`` after two Newton steps along the state whose motion, else whose size, moves a guard most.

        What is left of the guard is an error in time: in a layer the slow states do nothing meanwhile. Where the time
        moves it while all stands still, no state is moved.
        """
        moved, rates, timed = list(state), self.rhs(t, state), self.mode.system.time is not None
        for _ in range(2):
            slopes = self.guard_gradient(guard, t, moved)
            sizes = zip(slopes, moved, rates, self.movable, strict=True)
            weights = [(abs(slope * rate) * free, abs(slope) * (1 + abs(w)) * free) for slope, w, rate, free in sizes]
            k = weights.index(max(weights))
            still = timed and self.kinds[guard][0] not in OF_STATES and not weights[k][0]
            if slopes[k] == 0 or not self.movable[k] or still:
                break
            moved[k] -= self.guard_values(t, tuple(moved))[guard] / slopes[k]
        return tuple(moved)

    def settled(self, t: Any, state: State) -> State:
        """Return ``state`` moved to where all vanishes that does in this mode: a path may be begun anew from there."""
        if self.kept:
            return self._projected(self.kept, t, state)
        return tuple(w if free else w - w for w, free in zip(state, self.movable, strict=True))

    @cached_property
    def movable(self) -> tuple[bool, ...]:
        """Whether a state may be moved: all but the sliding velocities of contacts that stick."""
        resting = held(self.mode.system, self.branch)
        return tuple(s not in resting for s in self.mode.system.states)

    @cached_property
    def kept(self) -> tuple[Any, ...]:
        """What vanishes in this mode: gaps of rigid contacts, their rates, velocities at rest. () where all are states.

        What follows is decided by velocities that rest, so that not even rounding may move them.
        """
        system = self.mode.system
        closed = tuple(e for gap in self.mode.kept_gaps.values() for e in (gap, rate_along(system, gap)))
        phases = zip(system.frictions, self.branch, strict=True)
        resting = tuple(f.velocity for f, phase in phases if phase.mode == "stick")
        kept = (*closed, *resting) if closed or not all(v.is_Symbol for v in resting) else ()
        return tuple(on_sides(expr, self.mode.sides) for expr in kept)

    def _projected(self, expressions: tuple, t: Any, state: State) -> State:
        """Return ``state`` moved to where all ``expressions`` vanish; each step leaves those before it at 0.

        One that depends on those before it is 0 with them, and is passed over. What cancels to rounding is 0.
        """
        rounding = 4 * getattr(self.functions, "eps", 2.0**-52)
        least = [rounding * abs(w) for w in state]
        for _ in range(2):
            basis: list[list] = []
            for expr in expressions:
                at = (*self._compiled((expr,))(t, *state, *self.p), *self._gradient(expr)(t, *state, *self.p))
                value, *gradient = map(getattr(self.functions, "mpf", float), at)
                direction = gradient
                for other in basis:
                    share = _dot(direction, other) / _dot(other, other)
                    direction = [a - share * b for a, b in zip(direction, other, strict=True)]
                size, whole = _dot(direction, direction), _dot(gradient, gradient)
                if size <= DEPENDENT * whole:
                    continue
                basis.append(direction)
                moved = (w - value * a / size for w, a in zip(state, direction, strict=True))
                state = tuple(w if abs(w) > small else w - w for w, small in zip(moved, least, strict=True))
        return state

    def _gradient(self, expr: sp.Expr) -> Callable[..., tuple]:
        return self._compiled((expr,), self.mode.units)

    def _compiled(self, outputs: tuple, directions: tuple = ()) -> Callable[..., tuple]:
        return function(self.mode.system, outputs, self.target, self.functions, directions)


def _dot(a: list, b: list) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))
