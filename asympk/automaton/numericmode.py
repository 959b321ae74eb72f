"""A mode in numbers: its rates, Jacobian and guards, its switches by the time, and the zeros its states are moved to.

``NumericMode`` is what integrators and other flows follow, w' = ``rhs(t, w)`` while all ``guard_values(t, w)`` are
positive; ``steps_until`` and ``longest_step`` bound their steps. ``snapped`` and ``settled`` move a state at an event
onto zeros of guards and constraints g, w -> w - g n / (n . grad g), by the hard function ``_projected``.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import methodcaller, sub
from typing import Any

import numpy as np
import sympy as sp

from asympk.automaton.bumps import is_narrow
from asympk.automaton.compiled import function
from asympk.automaton.contacts import clear_sign, is_open, nudges
from asympk.automaton.modes import SWITCH, GuardedMode
from asympk.automaton.poles import as_quotient
from asympk.errors import NegativeFriction, NotDerivable, OutOfRange, Pole
from asympk.symbolic.branches import Branch, at_rest, held, rate_along
from asympk.symbolic.derivatives import is_bent
from asympk.symbolic.guards import NEVER_IDLE
from asympk.symbolic.long import symbols_in
from asympk.symbolic.removable import SMALL, with_more_digits
from asympk.symbolic.sides import on_sides
from asympk.symbolic.switches import Middle, Switch, peaks_of, slopes_and_phases, switches_of

DEPENDENT = 2.0**-60  # part of a gradient's square across earlier gradients below which this part is rounding
FARTHEST = 1e-3  # largest move onto the zero of a guard of forces, by the largest state; beyond, gradients are rounding
ERROR_IN_TIME = 1e-3  # largest relative error in time that explains the value of a guard at its event
LATEST = 1e-9  # relative error of the zero in doubles of a guard of the time in which large terms cancel
NEWTON = 3  # Newton steps from that zero to all digits
DERIVATIVES = 4  # derivatives of a phase that are computed to find the side to which a motion leaves
LOOKS = 256  # least number of steps in a span in which the time drives the motion
LONG = 0.01  # part of the time by then: so long a divisor nearly vanishes where it fades, but not at a pole
NEXT_TO_NOTHING = 1e-8  # part of its first value at which a divisor counts as 0; the base of a square is then 1e-4
FADED = 1e-6  # part of 1 or its first value by which a friction that has come down to 0 may be negative by rounding
BESIDE = 4  # roundings of the time by which smooth stretches keep away from a switch by the time
OF_STATES = ("velocity_zero", "touch_down")  # kinds of guards that never depend on the time alone

State = tuple[Any, ...]
_Exprs = Callable[[GuardedMode], tuple]


def _compiled_of(
    meaning: str, outputs: _Exprs, directions: _Exprs = lambda mode: ()
) -> "cached_property[Callable[..., tuple]]":
    """Return a property: expressions of the mode, or their derivatives along directions, as a function."""
    found = cached_property(lambda self: self._beside_limits(outputs(self.mode), directions(self.mode)))
    found.__doc__ = f"{meaning}, as a function of ``(t, *state, *p)``."
    return found


@dataclass(frozen=True)
class NumericMode:
    """A mode in numbers: ``rhs``, ``jac`` and ``guard_values`` of (t, state); guards are positive inside the mode.

    ``kinds`` gives for every guard the kind of event that its loss is, and the friction. ``field``, ``jacobian``,
    ``guards`` and the like are functions of ``(t, *state, *p)``, as they are compiled. ``p`` are the parameters and the
    values of the ``coefficients``, ``target`` and ``functions`` the numbers, as in
    ``asympk.automaton.compiled.function``.
    """

    mode: GuardedMode
    p: tuple[Any, ...]
    target: str
    functions: Any
    coefficients: tuple[sp.Expr, ...] = ()

    field = _compiled_of("The rates", lambda mode: mode.rates)
    jacobian = _compiled_of("The Jacobian row by row", lambda mode: mode.rates, lambda mode: mode.units)
    guards = _compiled_of("The guards", lambda mode: mode.guard_values)
    guard_slopes = _compiled_of("The derivatives of the guards along the field", lambda mode: mode.guard_values,
                                lambda mode: (mode.flow,))
    reactions = _compiled_of("What each reaction adds to each rate", lambda mode: mode.reactions)
    laws = _compiled_of("The laws of friction that may become negative", lambda mode: mode.laws)
    watched = _compiled_of("The guards and, after them, the laws", lambda mode: mode.watched)
    watched_slopes = _compiled_of("The derivatives of what is watched along the field", lambda mode: mode.watched,
                                  lambda mode: (mode.flow,))

    @property
    def name(self) -> str:
        """The name of the mode."""
        return self.mode.name

    @property
    def branch(self) -> Branch:
        """The phase of every friction in this mode."""
        return self.mode.branch

    @cached_property
    def kinds(self) -> tuple[tuple[str, int], ...]:
        """The kind of event and the friction of every guard."""
        return tuple((guard.kind, guard.friction) for guard in self.mode.guards)

    @cached_property
    def timed(self) -> bool:
        """Whether a guard may vary faster than the state: one depends on the time, or one is not linear.

        Where the rates are not linear, either, only edges and gaps count, as forces that are not linear are in both.
        """
        free = not is_bent(self.mode.rates, self.mode.system.states)
        phases = [guard.value for guard in self.mode.guards if free or guard.kind in (SWITCH, "touch_down")]
        time = self.mode.system.time
        return is_bent(phases, self.mode.system.states) or time in symbols_in(sp.Tuple(*self.mode.guard_values))

    @property
    def peaked(self) -> bool:
        """Whether the steps of the mode end at peaks in the time."""
        return bool(peaks_of(self.mode.system))

    def _beside_limits(self, outputs: tuple, directions: tuple = ()) -> Callable[..., tuple]:
        """Return a function with more digits where a divisor is small at whose zero the rates have a limit."""
        found = self._compiled(outputs, directions)
        if not self.mode.removable or self.target == "numpy":
            return found
        precise = partial(function, self.mode.system, outputs, "mpmath", directions=directions,
                          coefficients=self.coefficients)
        return with_more_digits(found, self._removable, lambda m: precise(functions=m), self.functions)

    @cached_property
    def _removable(self) -> Callable[..., tuple]:
        return self._compiled(self.mode.removable)

    def is_beside_limit(self, t: Any, state: Sequence) -> bool:
        """Tell whether rounding is large in a rate or guard that is 0/0 near (t, state), and has a limit there."""
        return bool(self.mode.removable) and min(map(abs, self._removable(t, *state, *self.p))) < SMALL

    @cached_property
    def divisors(self) -> Callable[..., tuple]:
        """The divisors of the rates as a function of (t, *state, *p)."""
        return self._compiled(self.mode.poles)

    def pole_values(self, t: Any, state: State) -> tuple:
        """Return the values of the divisors of the rates."""
        return self.divisors(t, *state, *self.p) if self.mode.poles else ()

    @cached_property
    def middles(self) -> tuple[Middle, ...]:
        """The middles of bumps that may be narrow with the parameters of the mode."""
        parameters = self.mode.system.parameters
        return tuple(middle for middle in self.mode.middles if not middle.every or any(
            is_narrow(bump, middle.angle, parameters, self.p[: len(parameters)]) for bump in middle.bumps))

    @cached_property
    def _phases_of_middles(self) -> Callable[..., tuple]:
        return self._compiled(tuple(middle.phase for middle in self.middles))

    def middle_values(self, t: Any, state: State) -> tuple:
        """Return the phases of the ``middles``."""
        return self._phases_of_middles(t, *state, *self.p) if self.middles else ()

    def require_one_side(self, before: tuple, t: Any, state: State, since: Any = None, begun: Any = None) -> tuple:
        """Return the divisors of the rates; raises ``Pole`` if one has changed its sign since ``before``.

        One has nearly vanished ``since`` that time, or None: after long, it has come down to the errors of the states,
        and ``OutOfRange`` says so. At an event the time of ``before`` is ``begun``: a divisor that will vanish at once
        is at its pole, too, as errors of the states may hide on which side.
        """
        after = self.pole_values(t, state)
        for divisor, a, b in zip(self.mode.poles, before, after, strict=True):
            if a * b < 0 and since is not None and t - since > LONG * t:
                raise OutOfRange(f"the rates of mode {self.name} are divided by {as_quotient(divisor)!s:.120}, of "
                                 f"which only errors of the states are left by t = {float(t):.8g}; end the run before "
                                 "it, or take the logarithm of a state that dies out, or its ratio to another, for the "
                                 "state")
            at_once = begun not in (None, t) and abs(b) * (t - begun) < NEXT_TO_NOTHING * t * (abs(a) - abs(b))
            if a * b < 0 or at_once:
                passed = "passed before" if a * b < 0 else "reached with an event at"
                raise Pole(f"the rates of mode {self.name} have a pole, which the motion has {passed} t = "
                           f"{float(t):.8g}: {as_quotient(divisor)!s:.120} = 0; end the run before it, or take "
                           "other states", t, state)
        return after

    def ends_at(self, hit: int | None) -> bool:
        """Tell whether ``hit``, of what is ``watched``, is a guard at whose loss a motion ceases to be the only one.

        Where forces cease to be determined the rates have a pole, too, which the loss of the guard explains.
        """
        return hit is not None and any(kind in NEVER_IDLE for kind, _ in self.kinds[hit:hit + 1])

    def vanishing(self, first: tuple, now: tuple) -> sp.Expr | None:
        """Return a divisor of the rates that has nearly vanished relative to its ``first`` value, or None."""
        for divisor, begun, value in zip(self.mode.poles, first, now, strict=True):
            if abs(value) < NEXT_TO_NOTHING * abs(begun):
                return as_quotient(divisor)
        return None

    def faded(self, t: Any, state: State) -> tuple:
        """Return the values down to which the ``laws`` are 0 but for the errors of the states, in a mode begun here.

        These errors are parts of 1, or of the friction where the mode begins.
        """
        return tuple(-FADED * max(1, abs(v)) for v in self.laws(t, *state, *self.p)) if self.mode.laws else ()

    def watched_values(self, faded: tuple, t: Any, state: State) -> tuple:
        """Return the values of the guards and, after them, of the ``laws`` above their ``faded`` values."""
        found = self.watched(t, *state, *self.p)
        return (*found[: -len(faded)], *map(sub, found[-len(faded) :], faded)) if faded else found

    def watched_rates(self, t: Any, state: State) -> tuple:
        """Return the derivatives of what is ``watched`` along the field."""
        return self.watched_slopes(t, *state, *self.p)

    def require_opposing(
        self, begun: tuple[Any, State], reached: Iterable[tuple[Any, State]], end: Any, hit: int | None
    ) -> None:
        """Raise ``NegativeFriction`` if a kinetic friction has become negative.

        It has at the ``end`` of a segment that ``hit`` it, and at a time and state ``reached`` where it is below its
        ``faded`` value.
        """
        if not self.mode.laws:
            return
        faded, laws = self.faded(*begun), self.mode.laws
        below = ((law, t) for t, state in reached
                 for law, value, least in zip(laws, self.laws(t, *state, *self.p), faded, strict=True) if value < least)
        lost = () if hit is None or hit < len(self.kinds) else (laws[hit - len(self.kinds)], end)
        if found := lost or next(below, ()):
            raise NegativeFriction(f"kinetic friction {found[0]!s:.120} of mode {self.name} is negative at t = "
                                   f"{float(found[1]):.8g}; friction opposes the velocity: write a law that does not "
                                   "fall below 0, or end the run before it")

    def steps_until(self, t: Any, until: Any) -> Any:
        """Return the time at which a step must end: just before the next switch or peak by the time, or ``until``."""
        return self._before((*switches_of(self.mode.system), *peaks_of(self.mode.system)), t, until)

    def _before(self, known: tuple[Switch, ...], t: Any, until: Any) -> Any:
        """Return the time just before the next of the ``known`` switches, or ``until``."""
        ends = (switch - width for switch, width in self._switched_near(known, t))
        return min([until, *(end for end in ends if end > t)])

    def require_smooth(self, t: Any, until: Any) -> None:
        """Raise ``NotDerivable`` where the time alone switches the mode before ``until``."""
        if self.mode.switches and (end := self._before(switches_of(self.mode.system), t, until)) < until:
            raise NotDerivable(f"mode {self.name} switches at t = {float(end):.6g}: this model follows no switch; use "
                               "an exact method, or end the run before it")

    def longest_step(self, span: Any) -> Any:
        """Return the longest step within a span; a motion that the time drives may stand still between two pulses."""
        return span / LOOKS if self._driven else math.inf

    @cached_property
    def _driven(self) -> bool:
        """Whether a rate or a guard is not a polynomial in the time, or in a state whose rate is 1."""
        rates = dict(zip(self.mode.system.states, self.mode.rates, strict=True))
        clocks = {s for s, rate in rates.items() if rate == 1} | ({self.mode.system.time} - {None})
        exprs = (*self.mode.rates, *self.mode.guard_values) if clocks else ()
        return not all(expr.is_polynomial(*clocks) for expr in exprs)

    def after_switch(self, t: Any) -> Any:
        """Return the time just after a switch that ``t`` is just before."""
        near = self._switched_near(switches_of(self.mode.system), t)
        return t + 3 * max([self.beside * t, *(width for switch, width in near if abs(switch - t) <= 2 * width)])

    def past_switch(self, t: Any, slack: Any) -> Any:
        """Return the time just after a switch without sides that is within the relative error ``slack``, or None."""
        near = self._switched_near(switches_of(self.mode.system, sideless=True), t)
        ends = (switch + 2 * width for switch, width in near if abs(switch - t) <= max(2 * width, 2 * slack * t))
        return max((t, *found)) if (found := [*ends]) else None

    def moved_on(self, t: Any, state: State, span: Any) -> tuple[Any, State]:
        """Return the time and the state after a span so short that the rates are constant."""
        return t + span, tuple(w + span * rate for w, rate in zip(state, self.rhs(t, state), strict=True))

    def after_start(self, until: Any, roots: bool = True) -> Any:
        """Return the time at which a run to ``until`` starts: 0, or just after 0 if there may be a switch at 0.

        Without ``roots`` their zeros are none.
        """
        near, start = self.beside * until, 0 * until
        known = tuple(s for s in switches_of(self.mode.system, sideless=True) if roots or not s.root)
        found = self._switched_near(known, start)
        return 3 * max((max(near, width) for switch, width in found if abs(switch) <= max(near, width)), default=start)

    @property
    def beside(self) -> Any:
        """The least relative distance in time that smooth stretches keep from a switch."""
        return BESIDE * getattr(self.functions, "eps", 2.0**-52)

    def _switched_near(self, known: tuple[Switch, ...], t: Any) -> list[tuple[Any, Any]]:
        """Return the times next to ``t`` of the ``known`` switches, each with the distance that stretches keep from it.

        The distance is some roundings of the time, or of the phase where that is larger, as in floor(t + 100).
        """
        found: list = []
        if known:
            lines = slopes_and_phases(known, self.mode.system.time)
            values = self.values(lines, t, tuple(t for _ in self.mode.system.states))
            for switch, slope, phase in zip(known, values[::2], values[1::2], strict=True):
                wholes = range(int(phase) - 2, int(phase) + 3) if switch.every else (0,)
                times = ((t + (n - phase) / slope, abs(n / slope)) for n in wholes if slope)
                found += [(at, self.beside * max(abs(at), phase_size)) for at, phase_size in times]
        return found

    def values(self, exprs: tuple[sp.Expr, ...], t: Any, state: State) -> tuple:
        """Return the values of expressions at a time and a state."""
        return self._compiled(exprs)(t, *state, *self.p)

    def signs(self, exprs: tuple[sp.Expr, ...], t: Any, state: State, slack: Any = 0) -> tuple[int, ...]:
        """Return the signs of expressions, or 0 where rounding or a relative error ``slack`` of the place allows 0."""
        rows = (self.values(exprs, *place) for place in ((t, state), *nudges(t, state, max(slack, self.beside))))
        return tuple(map(clear_sign, zip(*rows, strict=True)))

    def departure(self, phase: sp.Expr, t: Any, state: State, slack: Any = 0) -> int:
        """Return the sign of the first nonvanishing derivative of a phase along the field, or 0 if all computed vanish.

        A derivative counts as 0 if rounding or the relative error ``slack`` of the state allows a zero.
        """
        for _ in range(DERIVATIVES):
            phase = self.mode.drift(phase)
            if sign := self.signs((phase,), t, state, slack)[0]:
                return sign
            if phase == 0:
                break
        return 0

    def holds(self, t: Any, state: State, slack: Any = 0) -> bool:
        """Tell whether no guard is negative, none that vanishes falls, and no sliding velocity has leapt away."""
        if self.jumped(t, state, slack):
            return False
        exprs = self.mode.guard_values
        signs = zip(exprs, self.signs(exprs, t, state, slack), strict=True)
        return all((sign or self.departure(expr, t, state, slack)) >= 0 for expr, sign in signs)

    def jumped(self, t: Any, state: State, slack: Any = 0) -> tuple[int, ...]:
        """Return the contacts whose sliding velocity, one that may jump, has another sign than in this mode."""
        jumping = self.mode.jumping
        signs = zip(jumping, self.signs(tuple(jumping.values()), t, state, slack), strict=True) if jumping else ()
        return tuple(k for k, sign in signs if sign and sign != self.branch[k].velocity)

    def leaves(self, phase: sp.Expr, sign: int, t: Any, state: State, slack: Any = 0) -> bool:
        """Tell whether a phase that vanishes takes the ``sign`` along the field; for 0, whether the phase stays 0."""
        if departure := self.departure(phase, t, state, slack):
            return departure == sign
        behind = self.mode.rates_behind(phase)
        stands = self.mode.drift(phase) == 0 or (behind is not None and not any(self.values(behind, t, state)))
        return stands == (sign == 0)

    def rhs(self, t: Any, state: State) -> tuple:
        """Return the rates at a time and a state."""
        return self.field(t, *state, *self.p)

    def on_arrays(self, of: Callable[["NumericMode"], Callable[..., tuple]], t: Any, here: Sequence[Any]) -> np.ndarray:
        """Return the values of a function ``of`` a mode, as its rates: an array (values,) + the shape of the places.

        The places are arrays of times and of ``here``, the states and the parameters. Where arrays give no finite
        value, and beside limits, the values are those of single numbers, or NaN where these have none.
        """
        with np.errstate(all="ignore"):
            values, divisors = of(self._arrays)(t, *here), self._arrays._removable(t, *here)
        found = np.empty((len(values), *np.shape(t)))
        for k, value in enumerate(values):
            found[k] = value
        flat = found.reshape(len(found), -1)
        near = np.min(np.abs(divisors), axis=0, initial=math.inf) < SMALL
        for k in np.flatnonzero(~np.isfinite(flat).all(axis=0) | np.ravel(near)).tolist():
            one = (float(np.broadcast_to(w, np.shape(t)).flat[k]) for w in (t, *here))
            try:
                flat[:, k] = of(self)(*one)
            except (ArithmeticError, ValueError, TypeError):
                flat[:, k] = math.nan
        return found

    @cached_property
    def _arrays(self) -> "NumericMode":
        return replace(self, target="numpy", functions=np)

    def terms(self, t: Any, states: Any, slack: float) -> np.ndarray:
        """Return the size of each rate by its terms, also where they cancel, at arrays of places: (states,) + shape.

        It is the change of the rate by relative changes ``slack`` of time, states and parameters, divided by these, or
        the sum of what the reactions of rigid contacts add, which balance other forces whatever these changes are.
        """
        here, rates = (*states, *self.p), partial(self.on_arrays, lambda mode: mode.field)
        now = rates(t, here)
        found = np.maximum.reduce([np.abs(rates(*place) - now) for place in nudges(t, here, slack)]) / slack
        if not self.mode.reactions:
            return found
        added = np.abs(self.on_arrays(lambda mode: mode.reactions, t, here))
        return np.maximum(found, added.reshape(len(added) // len(found), *found.shape).sum(axis=0))

    def moves(self, t: Any, states: Any) -> np.ndarray:
        """Return by how much rounding, over its relative size, moves each state where what is ``kept`` is set to 0.

        It is the sum of |g_i| sum_j |g_j w_j| / |g|^2 over the gradients g of what is kept, for the states w.
        """
        found = np.zeros_like(states, dtype=float)
        for expr in self.kept:
            gradient = np.abs(self.on_arrays(methodcaller("gradient", expr), t, (*states, *self.p)))
            squares = (gradient**2).sum(axis=0)
            found += gradient * (gradient * np.abs(states)).sum(axis=0) / np.where(squares, squares, 1)
        return found

    def jac(self, t: Any, state: State) -> tuple:
        """Return the rows of the Jacobian at a time and a state."""
        n = len(state)
        flat = self.jacobian(t, *state, *self.p)
        return tuple(flat[k : k + n] for k in range(0, n * n, n))

    def guard_values(self, t: Any, state: State) -> tuple:
        """Return the values of the guards."""
        return self.guards(t, *state, *self.p)

    def guard_rates(self, t: Any, state: State) -> tuple:
        """Return the derivatives of the guards along the field."""
        return self.guard_slopes(t, *state, *self.p)

    def guard_gradient(self, guard: int, t: Any, state: Sequence) -> tuple:
        """Return the derivatives of one guard with respect to the states."""
        return self.gradient(self.mode.guards[guard].value)(t, *state, *self.p)

    def snapped(self, guard: int, t: Any, state: State) -> State:
        """Return ``state`` moved onto the zero of a guard, if the zero is near; otherwise ``settled(t, state)``.

        A guard that the time changes keeps what is rounding: the states would take on that of the time, which the exact
        flow carries beside it. A zero may be far all the same. The velocity of a contact that sticks stays 0, however
        strongly it changes the guard, and a closed rigid contact keeps g = g' = 0.
        """
        if self._timed[guard] and self._is_rounding(guard, t, state):
            return self.settled(t, state)
        moved = self._projected(t, state, guard) if self.kept else self._on_zero(guard, t, state)
        if self.kinds[guard][0] in OF_STATES:
            return moved
        farthest = FARTHEST * max(map(abs, state))
        _, later = self.moved_on(t, state, self.beside * t)  # where all states are 0, an error in time is their error
        near = all(abs(new - old) <= max(farthest, abs(then - old))
                   for new, old, then in zip(moved, state, later, strict=True))
        return moved if near else self.settled(t, state)

    def time_of_fall(self, guard: int, t: Any, state: State, coarse: "NumericMode") -> Any:
        """Return the time near ``t`` at which a guard of the time alone falls through 0; for other guards, ``t``.

        The time is near, or the guard at ``t`` is no larger than its rounding error in the ``coarse`` mode in doubles.
        """
        if any(self.guard_gradient(guard, t, state)):
            return t
        found, value = t, self.guard_values(t, state)[guard]
        for _ in range(NEWTON):
            rate = self.guard_rates(found, state)[guard]
            if not rate < 0:
                return t
            found -= self.guard_values(found, state)[guard] / rate
        rounded = coarse.guard_values(float(t), tuple(map(float, state)))[guard]
        return found if abs(found - t) <= LATEST * t or is_open((value, rounded)) else t

    def _on_zero(self, guard: int, t: Any, state: State) -> State:
        """Return ``state`` after two Newton steps onto the zero of a guard, each of which changes one state.

        The state changed is the one whose motion changes the guard most; if no motion explains its value, the one whose
        size does. The value is due to an error in time, during which the slow states of a layer hardly move.
        """
        moved, rates = list(state), self.rhs(t, state)
        for _ in range(2):
            slopes, value = self.guard_gradient(guard, t, moved), self.guard_values(t, tuple(moved))[guard]
            sizes = zip(slopes, moved, rates, self.movable, strict=True)
            weights = [(abs(slope * rate) * free, abs(slope) * (1 + abs(w)) * free) for slope, w, rate, free in sizes]
            explained = ERROR_IN_TIME * t * max(weights)[0] >= abs(value)
            k = max(range(len(weights)), key=lambda k: weights[k] if explained else weights[k][1:])
            if slopes[k] == 0 or not self.movable[k]:
                break
            moved[k] -= value / slopes[k]
        return tuple(moved)

    @cached_property
    def _timed(self) -> tuple[bool, ...]:
        """Whether the time by itself changes each guard."""
        time, guards = self.mode.system.time, self.mode.guards
        return tuple(guard.kind not in OF_STATES and time in symbols_in(guard.value) for guard in guards)

    def _is_rounding(self, guard: int, t: Any, state: State) -> bool:
        return is_open([self.guard_values(*place)[guard] for place in ((t, state), *nudges(t, state, self.beside))])

    def settled(self, t: Any, state: State) -> State:
        """Return ``state`` moved onto the zeros of all quantities that this mode keeps at 0, as a start has to be."""
        if self.kept:
            return self._projected(t, state)
        return tuple(w if free else w - w for w, free in zip(state, self.movable, strict=True))

    @cached_property
    def movable(self) -> tuple[bool, ...]:
        """Whether a state may be moved: all but the sliding velocities of contacts that stick."""
        resting = held(self.mode.system, self.branch)
        return tuple(s not in resting for s in self.mode.system.states)

    @cached_property
    def kept(self) -> tuple[Any, ...]:
        """The quantities that this mode keeps at 0: gaps of closed rigid contacts, their rates, and velocities at rest.

        Empty if these are all single states, which ``settled`` sets to 0. Not even rounding may change a velocity at
        rest, which decides the mode that follows.
        """
        system = self.mode.system
        closed = tuple(e for gap in self.mode.kept_gaps.values() for e in (gap, rate_along(system, gap)))
        closed += tuple(f.gap_rate for f in system.frictions if f.gap_rate is not None)
        resting = sorted(at_rest(self.branch))
        single = all(system.frictions[k].velocity.is_Symbol for k in resting)
        kept = (*closed, *(self.mode.velocities[k] for k in resting)) if closed or not single else ()
        return tuple(on_sides(expr, self.mode.sides) for expr in kept)

    def _projected(self, t: Any, state: State, guard: int | None = None) -> State:
        """Return ``state`` moved to where the mode's ``kept`` expressions, and a guard, vanish, in two Newton rounds.

        A step is orthogonal to the gradients of all earlier expressions (Gram-Schmidt), so that they stay 0. An
        expression whose gradient depends on the earlier ones vanishes with them and is passed over. A state that
        cancels to rounding is set to 0.
        """
        least = [4 * getattr(self.functions, "eps", 2.0**-52) * abs(w) for w in state]
        expressions = self.kept if guard is None else (*self.kept, self.mode.guards[guard].value)
        for _ in range(2):
            basis: list[list] = []
            for k, expr in enumerate(expressions):
                at = (*self._compiled((expr,))(t, *state, *self.p), *self.gradient(expr)(t, *state, *self.p))
                value, *gradient = map(getattr(self.functions, "mpf", float), at)
                rest = _across(gradient, basis)
                if _dot(rest, rest) <= DEPENDENT * _dot(gradient, gradient):
                    continue
                if value:
                    direction = rest if k < len(self.kept) else self._as_it_moves(rest, basis, t, state)
                    size = _dot(direction, rest)
                    moved = (w - value * a / size if a else w for w, a in zip(state, direction, strict=True))
                    state = tuple(w if abs(w) > small else w - w for w, small in zip(moved, least, strict=True))
                basis.append(rest)
        return state

    def _as_it_moves(self, gradient: list, basis: list[list], t: Any, state: State) -> list:
        """Return a direction across ``basis`` that weights each state by its squared rate, as an error in time does."""
        rates = self.rhs(t, state)
        largest = max(map(abs, rates))
        moved = [a * (rate / largest) ** 2 if largest else a for a, rate in zip(gradient, rates, strict=True)]
        return _across(moved if any(moved) else gradient, basis)

    def gradient(self, expr: sp.Expr) -> Callable[..., tuple]:
        """Return the derivatives of an expression by the states, as a function of ``(t, *state, *p)``."""
        if expr not in self._gradients:  # every search for it by all its directions would hash all their numbers
            self._gradients[expr] = self._compiled((expr,), self.mode.units)
        return self._gradients[expr]

    @cached_property
    def _gradients(self) -> dict[sp.Expr, Callable[..., tuple]]:
        return {}

    def _compiled(self, outputs: tuple, directions: tuple = ()) -> Callable[..., tuple]:
        return function(self.mode.system, outputs, self.target, self.functions, directions,
                        coefficients=self.coefficients)


def on_hermite(share: Any, span: Any, ends: Sequence[Sequence], slopes: Sequence[Sequence]) -> State:
    """Return the state at a share of a span of time, by the cubic with the states and the rates at both its ends.

    At a share of 0 or 1 the state is exactly that of the end.
    """
    left = 1 - share
    rise = share * share * (3 - 2 * share)
    a, b, c, d = 1 - rise, rise, span * share * left * left, -span * share * share * left
    return tuple([a * v + b * w + c * f + d * g for v, w, f, g in zip(*ends, *slopes, strict=True)])


def _across(direction: list, basis: list[list]) -> list:
    """Return the part of a direction that is orthogonal to others, which are orthogonal to one another."""
    for other in basis:
        if along := _dot(direction, other):
            share = along / _dot(other, other)
            direction = [a - share * b for a, b in zip(direction, other, strict=True)]
    return direction


def _dot(a: Sequence, b: Sequence) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True) if x and y)
