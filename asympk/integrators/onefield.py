"""Two crude but common methods: one right-hand side, without modes, guards or events.

    F = -kinetic |load| sign(v)    or    F = -kinetic |load| tanh(v / eps)
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from time import monotonic

import sympy as sp

from asympk.automaton.compiled import function
from asympk.automaton.numericmode import NumericMode
from asympk.errors import InputError
from asympk.integrators import scipy_ivp
from asympk.integrators.integrate import Settings, bounds, endpoints, finished, in_range, tolerances
from asympk.numbers import number, short
from asympk.path import Path
from asympk.scene import Scene
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import symbols_in
from asympk.symbolic.reading import exact_constant
from asympk.symbolic.system import System
from asympk.systems.automata import automaton_of


@dataclass(frozen=True)
class OneField:
    """A field and its Jacobian as functions of (t, *state, *p), without guards."""

    field: Callable
    jacobian: Callable
    p: tuple
    kinds: tuple = ()
    timed: bool = False
    peaked: bool = False

    def guard_values(self, t: float, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the values of the guards: there are none."""
        return ()

    def watched_values(self, faded: tuple[float, ...], t: float, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return nothing, as ``guard_values`` does."""
        return faded

    guard_rates = watched_rates = pole_values = middle_values = faded = guard_values
    rhs, jac, ends_at = NumericMode.rhs, NumericMode.jac, NumericMode.ends_at


def sign(
    scene: Scene, method: str = "sign", *, rtol: float = 1e-6, atol: float | None = None, solver: str = "lsoda",
    steps: int = 20_000, seconds: float = 60.0,
) -> Path:
    """Follow ``scene`` with F = -kinetic |load| sign(v), which is right until stick begins, where the sign chatters."""
    return _follow(scene, method, None, solver, rtol, atol, steps, seconds)


def tanh(
    scene: Scene, method: str = "tanh", *, rtol: float = 1e-6, atol: float | None = None, eps: float | None = None,
    solver: str = "radau", steps: int = 20_000, seconds: float = 60.0,
) -> Path:
    """Follow ``scene`` with F = -kinetic |load| tanh(v / eps); ``eps`` is ``rtol`` by default.

    Stick becomes a creep with |v| < eps, an error that no tolerance of the solver removes.
    """
    eps = float(number("eps", rtol if eps is None else eps))
    if eps <= 0:
        raise InputError(f"eps = {eps:g}: the width of the regularised friction law must be positive")
    return _follow(scene, method, eps, solver, rtol, atol, steps, seconds, eps=eps)


def _follow(scene, method, width, solver, rtol, atol, steps, seconds, **options):
    """Follow ``scene`` by one of scipy's solvers with sign(v), or tanh(v / width); the ``Path`` has one mode."""
    if not isinstance(solver, str) or solver not in scipy_ivp.CLASSES:
        raise InputError(f"solver {short(solver)} is unknown; choose one of {', '.join(scipy_ivp.CLASSES)}")
    rtol, atol = tolerances(rtol, atol)
    steps, seconds = bounds(steps, seconds)
    settings = Settings(solver, rtol, atol, steps, monotonic() + seconds)
    last = _trace(scene, width, settings)
    options = {"solver": solver, "rtol": rtol, "atol": atol, "steps": steps, "seconds": seconds, **options}
    return finished(scene, method, last, (), ("one_field",), partial(_samples, scene, width, settings), options)


def _trace(scene, width, settings):
    start, until = endpoints(scene)
    automaton = automaton_of(scene)
    field = OneField(*_functions(automaton.system, width), tuple(map(float, automaton.values)))
    return in_range(0.0, start, lambda: scipy_ivp.advance(field, 0.0, start, until, settings))


def _samples(scene, width, settings, times):
    return _trace(scene, width, settings._replace(deadline=float("inf"), times=times)).samples


@lru_cache(maxsize=64)
def _functions(system, width):
    """Return the field and its Jacobian with the forces substituted; raises ``InputError`` as ``slipping_rates``."""
    def direction(velocity):
        return sp.sign(velocity) if width is None else sp.tanh(velocity / exact_constant("eps", width))

    rates = slipping_rates(system, direction)
    jacobian = tuple(slope_by(rate, s) for rate in rates for s in system.states)
    return function(system, rates, "math", math), function(system, jacobian, "math", math)


def slipping_rates(system: System, direction: Callable[[sp.Expr], sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return the rates of a system with F = -kinetic |load| direction(v), and the loads for reactions.

    Raises ``InputError`` for contacts that open or are rigid, and where a load contains its own force.
    """
    if not all(friction.permanent for friction in system.frictions):
        raise InputError("one right-hand side has no contacts that open; use a method with events, such as 'lsoda'")
    forces = {f.force: -f.kinetic * sp.Abs(f.load) * direction(f.velocity) for f in system.frictions}
    forces |= {f.normal: f.load for f in system.frictions if f.normal is not None}
    rates = tuple(rate.subs(forces) for rate in system.rates.values())
    if unknown := sorted(map(str, symbols_in(sp.Tuple(*rates)) & forces.keys())):
        raise InputError(f"one right-hand side has no load that contains its own force, here {', '.join(unknown)}; "
                         "use a method with events, such as 'lsoda'")
    return rates
