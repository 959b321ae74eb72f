r"""The coefficients of a system with dry friction whose modes are linear.

The states are one slow x, one fast y and the sliding velocity z. The rates f, g, h of x, mu y, z, the drive and the
load are affine in x and y; g, h and the drive depend on x and y through the load s alone. ``linear`` reads the
coefficients of a ``System`` as expressions, and ``Linear.map`` converts them to exact ratios, numbers or arrays.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import sympy as sp

from asympk.asymptotics.itinerary import EDGES, IN_NUMBERS, LoadLine
from asympk.asymptotics.layers import LinearField
from asympk.errors import NotDerivable
from asympk.formulas import NOT_FINITE
from asympk.numbers import short
from asympk.symbolic.branches import is_pushed
from asympk.symbolic.system import System

SLIP = ("slip_same", "slip_opposite")


@dataclass(frozen=True)
class Linear:
    """The coefficients of 1, x, y in the modes, the load and the drive, which ``static`` friction must hold."""

    states: tuple[sp.Symbol, sp.Symbol, sp.Symbol]
    parameters: tuple[sp.Symbol, ...]
    fields: dict[str, LinearField]
    load: tuple
    drive: tuple
    static: Any

    def map(self, convert: Callable[[Any], Any]) -> "Linear":
        """Apply ``convert`` to every coefficient."""

        def each(coefficients):
            return tuple(map(convert, coefficients))

        fields = {name: LinearField(*map(each, field)) for name, field in self.fields.items()}
        return replace(self, fields=fields, load=each(self.load), drive=each(self.drive), static=convert(self.static))

    @property
    def levels(self) -> dict[str, tuple]:
        """The affine functions (constant, x, y, z) that vanish at events, by name."""
        edges = {
            name: (*(d - k * self.static * l for d, l in zip(self.drive, self.load, strict=True)), 0)
            for name, k in EDGES.items()
        }
        return {"load": (*self.load, 0), "velocity": (0, 0, 0, 1), **edges}

    @property
    def line(self) -> LoadLine:
        """The equations of the load in the layers."""
        return LoadLine(
            fast={n: tuple(self.load[2] * c for c in self.by_load(m.g)) for n, m in self.fields.items()},
            rate={n: self.by_load(m.h) for n, m in self.fields.items()},
            drive=self.by_load(self.drive),
            static=self.static,
        )

    def by_load(self, affine: tuple) -> tuple[Any, Any]:
        """Return (c, k) such that ``affine`` is ``c + k load``."""
        slope = affine[2] / self.load[2]
        return affine[0] - slope * self.load[0], slope

    def fast_state(self, x: Any, load: Any) -> Any:
        """Return y at a slow state and a load."""
        return (load - self.load[0] - self.load[1] * x) / self.load[2]


@lru_cache(maxsize=16)
def linear(system: System) -> Linear:
    """Return the coefficients of a ``System``; raises ``NotDerivable`` unless it is as described above."""
    if not system.frictions:
        raise NotDerivable("the system has no dry friction: its layers do not jump; use slow_manifold")
    if system.friction is None or system.small is None:
        raise NotDerivable(f"{len(system.frictions)} frictions, small parameter {system.small}: a jump is derived for "
                           f"one friction and a small parameter; {IN_NUMBERS}")
    f = system.friction
    law = sp.Tuple(*system.slow.values(), *system.fast.values(), f.velocity, f.load, f.kinetic, f.static)
    if system.time is not None and law.has(system.time):
        raise NotDerivable(f"the time {system.time} is in the system: a jump is derived without; {IN_NUMBERS}")
    z = f.velocity
    if z not in system.slow:
        raise NotDerivable(f"the sliding velocity {z!s:.60} is no slow state of its own: a jump is derived for one; "
                           f"{IN_NUMBERS}")
    slow = [v for v in system.modes[0].slow if v != z]
    fast = list(system.modes[0].fast)
    if len(slow) != 1 or len(fast) != 1:
        raise NotDerivable(f"slow states {slow} and fast states {fast}: a jump is derived for one of each; the limit "
                           f"of an elastic contact is jump_law() of its mechanism, {IN_NUMBERS}")
    if is_pushed(system, 0):
        raise NotDerivable(f"the load {short(f.load)} contains its own force: a jump is derived without; {IN_NUMBERS}")
    if law.has(system.small):
        raise NotDerivable(f"the small parameter {system.small} is in the rates or in the friction: a jump is derived "
                           f"without; {IN_NUMBERS}")
    states = (*slow, *fast, z)
    fields = {
        m.name: LinearField(*(_affine(e, states) for e in (m.slow[states[0]], m.fast[states[1]], m.slow[z])))
        for m in system.modes
    }
    drive = sp.cancel(system.drive / system.coupling)  # what static friction must hold
    parameters = tuple(p for p in system.parameters if p != system.small)
    static = _at_rest(f.static, states)
    found = Linear(states, parameters, fields, _affine(f.load, states), _affine(drive, states), static)
    _require_load(found)
    return found


def _affine(expr, states):
    try:
        poly = sp.Poly(expr, *states)
    except sp.PolynomialError:
        poly = None
    if poly is None or poly.total_degree() > 1 or poly.coeff_monomial(states[2]) != 0:
        raise NotDerivable(f"{short(expr)} is not affine in {states[0]} and {states[1]} alone: a jump is derived where "
                           f"all rates and the load are; {IN_NUMBERS}")
    return tuple(poly.coeff_monomial(m) for m in (1, states[0], states[1]))


def _at_rest(static, states):
    """Return static friction where the velocity is 0."""
    *others, z = states
    rest = static.subs(z, 0)
    if rest.has(*others, *NOT_FINITE) or (static.has(z) and static.has(sp.Piecewise, sp.sign, sp.Heaviside)):
        raise NotDerivable(f"static friction {static!s:.60} changes with the states or the direction, or is not finite "
                           f"at rest: a jump is derived for a constant one; {IN_NUMBERS}")
    return rest


def _require_load(model):
    if model.load[2] == 0 or any(field.f[2] == 0 for field in model.fields.values()):
        raise NotDerivable("the load, and x', must depend on the fast state")
    for name, affine in [("drive", model.drive), *((n, c) for n, m in model.fields.items() for c in (m.g, m.h))]:
        if sp.cancel(affine[1] * model.load[2] - affine[2] * model.load[1]) != 0:
            raise NotDerivable(f"{name}: {affine} is not a function of the load {model.load} alone")
