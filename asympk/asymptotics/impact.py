"""The layers of a system with one friction and one fast state to order 0: their modes, and their impulses.

In a layer the slow states are constant, and mu y' = g_0 + g_1 y in each mode. The state y settles on y = -g_0/g_1,
meets a guard of the mode, or, where g_1 > 0, grows without bound. A growing load makes an impulse J = int |y| dt, with
dx/dJ = sign(y) dx'/dy, and likewise mu y, until sliding stops; in stick J continues until mu y is 0 again:

    velocity -> 0,    mu y -> 0,    x -> x + (impulses),    errors O(mu log(1/mu)),

the jump law of a mechanism with a stiff damped contact. If mu y returns to 0 before the stop, there is no law
(Lemma 18). ``LimitLayers.arrive`` follows a layer; ``_ahead`` decides how a mode ends, ``_stop`` carries the impulse.
"""

import math
import sys
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from asympk.asymptotics.matched import MatchedPath, bare_mode, entered
from asympk.asymptotics.reduced import MEETING
from asympk.automaton.automaton import Automaton
from asympk.automaton.loop import mode_after
from asympk.automaton.modes import SWITCH, GuardedMode
from asympk.automaton.numericmode import NumericMode
from asympk.path import Event
from asympk.symbolic.branches import Phase
from asympk.symbolic.coefficients import with_few_parts
from asympk.symbolic.derivatives import slope_by

PASSAGES = 20  # the most modes of one layer
AT_REST = 1e-9  # the velocity, relative to the state, up to which a contact is at rest
OVER = 36  # the time |q| tau after which a layer is over to rounding, e^-36 = 2e-16
REACH = 1e6  # the largest impulse, in units of that which stops the motion at its first rate


class NoLaw(Exception):
    """A sign to the caller, without words: the layer or the jump must be integrated at the given mu (``matched``)."""


@dataclass(frozen=True)
class LayerVelocity:
    """A velocity V = mu s that leaves 0 in a layer, and may return to 0, as s(tau).

    The rate r of V is affine in y, and y - y_* = (y_0 - y_*) e^(q tau). With r_0 and r_* the rates at y_0 and at the
    rest point y_*, s = s_0 + r_* tau + (r_0 - r_*) (e^(q tau) - 1)/q. The fields are s_0, r_0, r_* and q.
    """

    start: float
    rate: float
    rate_at_rest: float
    growth: float

    def __call__(self, tau: float) -> float:
        fading = (self.rate - self.rate_at_rest) * math.expm1(self.growth * tau) / self.growth
        return self.start + self.rate_at_rest * tau + fading

    def returns(self, end: float) -> float | None:
        """Return the first tau within (0, end] at which the velocity falls to 0, or None.

        The rate of the velocity is monotone and vanishes at most once, at ``turn``, the extremum of the velocity.
        """
        if self.start == 0 and self.rate <= 0:
            return None
        fading = self.rate - self.rate_at_rest
        share = -self.rate_at_rest / fading if fading else 0.0
        turn = math.log(share) / self.growth if share > 0 else 0.0
        low = 0.0
        for high in ([turn] if 0 < turn < end else []) + [end]:
            if self(high) < 0:
                return brentq(self, low, high, xtol=1e-15 * high)
            low = high
        return None


@dataclass(frozen=True)
class LimitLayers:
    """The layers of an automaton with one friction and one fast state for one ``mu``."""

    automaton: Automaton
    mu: float

    @cached_property
    def fast(self) -> int:
        """The index of the fast state."""
        (y,) = self.automaton.system.fast
        return self.automaton.system.states.index(y)

    def arrive(self, path: MatchedPath) -> MatchedPath:
        """Return the path after its layer, which takes no time, with y on the critical manifold; raises ``NoLaw``."""
        t, state, mode, speed = path.t, path.state, path.mode, 0.0
        events, modes = [*path.events], [*path.modes]
        event: Event | None
        for _ in range(PASSAGES):
            target, guard, speed = self._ahead(mode, t, state, speed)
            if guard is None and not math.isinf(target):
                state = self._with(state, target)
                if _edges(*self._guards(mode, t, state), state):
                    raise NoLaw  # terms of order mu tell what follows
                return replace(path, state=state, mode=mode, events=tuple(events), modes=tuple(modes))
            if guard is None:
                mode, state, event = self._stop(mode, t, state, math.copysign(1, target))
            else:
                met = self._with(state, target)
                mode, state, event = mode_after(self.automaton, mode, t, met, (guard,), fixed=True)
            if event is not None:
                events.append(event)
                modes.append(mode.name)
        raise NoLaw

    def _ahead(self, mode: NumericMode, t: float, state: tuple, speed: float) -> tuple[float, int | None, float]:
        """Return the limit of y in a mode and None, or y at the first guard that y meets and this guard.

        The limit is infinite where y grows without bound. ``speed`` is the velocity over mu at the start where the
        velocity is of order mu. The third value is the same at the guard.
        """
        y = state[self.fast]
        _require_affine(mode.mode)
        entries, force = mode.jac(t, state), self.mu * mode.rhs(t, state)[self.fast]
        slope = self.mu * entries[self.fast][self.fast]
        if self._meets(entries) or not _is_fast_in_limit(mode.mode):
            raise NoLaw  # no layer settles or grows there before the slow states move
        rest = y - force / slope
        values, slopes = self._guards(mode, t, state)
        target = rest if slope < 0 else math.copysign(math.inf, self._way(state, rest, values, slopes))
        target, guard = self._first_guard(values, slopes, y, target)
        sliding = self._sliding(mode, values, slopes, state)
        if sliding is None or y == rest:
            return target, guard, 0.0
        at_start, at_rest = (mode.guard_rates(t, self._with(state, v))[sliding] for v in (y, rest))
        end = OVER / abs(slope) if guard is None else math.log((target - rest) / (y - rest)) / slope
        velocity = LayerVelocity(speed, at_start, at_rest, slope)
        if (back := velocity.returns(end)) is None:
            return target, guard, velocity(end)
        return rest + (y - rest) * math.exp(slope * back), sliding, 0.0

    def _meets(self, entries: Any) -> bool:
        """Tell whether the rate of y meets a slow one, as in ``reduced.margin``, by the entries of the Jacobian."""
        fast = self.fast
        feedback = sum(entries[fast][i] * row[fast] for i, row in enumerate(entries) if i != fast)
        return bool(entries[fast][fast] ** 2 <= MEETING * abs(feedback))

    def _way(self, state: tuple, rest: float, values: np.ndarray, slopes: np.ndarray) -> float:
        """Return a number of the sign in which y grows from where it is, away from ``rest``: off an edge, if on one.

        Where slow motion comes to a load of 0, and on a repelling manifold, terms of order mu tell the sides.
        """
        y, edges = state[self.fast], _edges(values, slopes, state)
        if not edges and abs(y - rest) <= 1e-9 * max(1, abs(y), abs(rest)):
            raise NoLaw
        return edges[0] if edges else y - rest

    def _guards(self, mode: Any, t: float, state: tuple) -> tuple[np.ndarray, np.ndarray]:
        """Return the values of the guards and their derivatives by y, in which they are affine."""
        values = np.array(mode.guard_values(t, state))
        return values, np.array(mode.guard_values(t, self._with(state, state[self.fast] + 1))) - values

    def _sliding(self, mode: Any, values: np.ndarray, slopes: np.ndarray, state: tuple) -> int | None:
        """Return the guard of the sliding velocity if the velocity is 0 and does not depend on y, else None."""
        k = _of_velocity(mode)
        return k if k is not None and slopes[k] == 0 and _is_zero(values[k], state) else None

    def _first_guard(self, values: np.ndarray, slopes: np.ndarray, y: float, target: float) -> tuple[float, int | None]:
        direction = math.copysign(1, target - y)
        met = [(abs(v / s), k) for k, (v, s) in enumerate(zip(values, slopes, strict=True))
               if s * direction < 0 and v > 0 and abs(v / s) < abs(target - y)]
        if not met:
            return target, None
        distance, guard = min(met)
        return y + direction * float(distance), guard

    def _stop(self, slip: NumericMode, t: float, state: tuple, side: float) -> tuple[NumericMode, tuple, Event]:
        """Return stick, the state after the impulse of a load that grows with the sign ``side``, and the stop."""
        (phase,) = slip.branch
        if not phase.velocity:
            raise NoLaw  # a load that grows in stick
        sliding = _of_velocity(slip)

        def pressed(_: float, w: Any) -> Any:
            return side * w[-1]

        stopped, large = self._carried(
            slip, t, state, 0.0, side, lambda _, w: slip.guard_values(t, (*w[:-1],))[sliding], pressed
        )
        stopped = slip.snapped(sliding, t, stopped)
        event = Event("velocity_zero", t, self._with(stopped, large / self.mu), 0)
        stick = entered(self.automaton, (Phase(phase.load, 0),), t, stopped)
        after, _ = self._carried(stick, t, stopped, large, side, pressed)
        return stick, self._with(after, self._from_infinity(stick, t, after, side)), event

    def _carried(
        self, mode: NumericMode, t: float, state: tuple, large: float, side: float, level: Any, *others: Any
    ) -> tuple:
        """Return the state and mu y at the impulse J at which ``level(J, (*state, mu y))`` falls to 0.

        Raises ``NoLaw`` where nothing stops the impulse, where one of ``others`` falls to 0 before, where the mode
        reaches a switching surface before, or friction below 0, or where such a surface depends on y.
        """
        edges = [k for k, (kind, _) in enumerate(mode.kinds) if kind == SWITCH]
        edges += range(len(mode.kinds), len(mode.mode.watched))
        _require_affine(mode.mode, 0)

        def rates(_, w):
            column = [side * row[self.fast] for row in mode.jac(t, tuple(w[:-1]))]
            return [*(0.0 if i == self.fast else c for i, c in enumerate(column)), self.mu * column[self.fast]]

        faded = mode.faded(t, state)
        events = [level, *others, *((lambda _, w, k=k: mode.watched_values(faded, t, (*w[:-1],))[k]) for k in edges)]
        for event in events:
            vars(event).update(terminal=True, direction=-1)
        first = np.array([*state, large])
        slopes = np.array(rates(0, first))
        unit = _needed(level, first, slopes)
        least = 1e-12 * np.maximum(np.abs(first), unit * np.abs(slopes)) + sys.float_info.min
        found = solve_ivp(lambda at, w: unit * np.array(rates(at, w)), (0, REACH), first, "DOP853", rtol=1e-11,
                          atol=least, events=events)
        if not found.t_events[0].size:
            raise NoLaw
        end = found.y_events[0][0]
        return tuple(end[:-1].tolist()), float(end[-1])

    def _from_infinity(self, mode: NumericMode, t: float, state: tuple, side: float) -> float:
        """Return a value of y on ``side`` beyond the zeros of all guards, which stands for infinity.

        Raises ``NoLaw`` where static friction does not hold there.
        """
        bound = 1e9 * max(1.0, *map(abs, state))
        values, slopes = self._guards(mode, t, self._with(state, 0.0))
        if (values + side * bound * slopes).min() <= 0:
            raise NoLaw
        roots = [abs(v / s) for v, s in zip(values, slopes, strict=True) if s != 0]
        return side * 2 * (1 + float(max([*roots, *map(abs, state)])))

    def _with(self, state: tuple, y: float) -> tuple:
        return (*state[: self.fast], y, *state[self.fast + 1 :])


@lru_cache(maxsize=256)
def _require_affine(mode: GuardedMode, degree: int = 1) -> None:
    """Raise ``NoLaw`` if a rate is not affine in y in the limit, or a switching function of more than ``degree``.

    It is raised, too, where y may make friction negative.
    """
    (y,), bare = mode.system.fast, bare_mode(mode)
    affine = all(_is_affine_in_limit(rate, y, mode.system.small) for rate in {**bare.slow, **bare.fast}.values())
    bent = any(sp.expand(edge.diff(y, degree + 1)) != 0 for edge in mode.edges)
    if not affine or bent or any(law.has(y) for law in mode.laws):
        raise NoLaw


@lru_cache(maxsize=256)
def _is_fast_in_limit(mode: GuardedMode) -> bool:
    """Tell whether y moves y in the limit mu = 0; in flight it does by the gap rate -mu y alone."""
    (y,) = mode.system.fast
    return bare_mode(mode).fast[y].subs(mode.system.small, 0).has(y)


def _is_affine_in_limit(rate: sp.Expr, y: sp.Symbol, small: sp.Symbol) -> bool:
    """Tell whether in the limit mu = 0 a rate is affine in y, and mu times the rate is affine in mu y.

    The second condition matters in a jump, where mu y is finite. Squares of velocities, which contain (mu y)^2, vanish
    in both limits. Most rates show it with a symbol for each of their sums without y and mu.
    """
    return any(_has_no_bend(form, y, small) for form in (with_few_parts(rate, {y, small}), rate))


def _has_no_bend(rate: sp.Expr, y: sp.Symbol, small: sp.Symbol) -> bool:
    large = sp.Dummy("large")
    limits = ((rate.subs(small, 0), y), (small * rate.subs(y, large / small), large))
    bends = (slope_by(slope_by(limit, s), s) for limit, s in limits)
    return all(sp.expand(bend).subs(small, 0) == 0 for bend in bends)


def _edges(values: np.ndarray, slopes: np.ndarray, state: tuple) -> list[float]:
    """Return the derivatives by y of the guards that are 0 at a state and depend on y."""
    return [s for v, s in zip(values, slopes, strict=True) if s and _is_zero(v, state)]


def _is_zero(value: float, state: tuple) -> bool:
    return abs(value) <= AT_REST * max(1.0, *map(abs, state))


def _needed(level: Any, first: np.ndarray, slopes: np.ndarray) -> float:
    """Return the impulse in which ``level`` falls to 0 at its first rate; if it rises, one as large as the states."""
    size = np.abs(first).max() / (np.abs(slopes).max() or 1)
    value = level(0, first)
    fall = value - level(0, first + size * slopes)
    return float(size * (value / fall if value > 0 and fall > 0 else 1))


def _of_velocity(mode: Any) -> Any:
    """Return the index of the guard on the sliding velocity, or None in a mode that does not slide."""
    return next((k for k, (kind, _) in enumerate(mode.kinds) if kind == "velocity_zero"), None)
