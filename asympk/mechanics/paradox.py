r"""Where the rigid contact has a paradox: friction load |G_NT| > G_NN, the critical friction and its least value."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import sympy as sp

from asympk.errors import NotDerivable
from asympk.mechanics.kinetics import Kinetics
from asympk.mechanics.tidy import shortest, tidy
from asympk.symbolic.reading import exact_constant


def critical_friction(kinetics: Kinetics) -> sp.Expr:
    """Return G_NN / (load |G_NT|), oo where G_NT vanishes identically."""
    normal, mixed = ratio(kinetics)
    return sp.oo if mixed == 0 else normal / (kinetics.load * mixed)


def condition(kinetics: Kinetics) -> sp.Basic:
    """Return friction load |G_NT| > G_NN, the condition for a paradox, without common factors."""
    normal, mixed = ratio(kinetics)
    return sp.Gt(kinetics.friction * kinetics.load * mixed, normal)


def ratio(kinetics: Kinetics) -> tuple[sp.Expr, sp.Expr]:
    """Return G_NN and |G_NT| divided by what they have in common."""
    normal, mixed = kinetics.delassus[0, 0], kinetics.delassus[0, 1]
    if mixed == 0:
        return sp.S.One, sp.S.Zero
    quotient = shortest(tidy(normal / mixed), tidy(-normal / mixed))
    return tuple(map(sp.Abs, sp.fraction(quotient)))


@dataclass(frozen=True)
class LeastFriction:
    """The least critical friction over a coordinate, and the equation that says where it is."""

    friction: sp.Expr
    where: sp.Basic


def least(
    kinetics: Kinetics, coordinate: sp.Symbol, values: dict[sp.Symbol, Any], own: Callable[[Any], Any]
) -> LeastFriction:
    """Return the ``LeastFriction`` over ``coordinate``, exact, where the critical friction is rational in its tangent.

    ``values`` are exact numbers for parameters; those that are left stay symbols. Raises ``NotDerivable`` where the
    critical friction is no such function, has no least value, or its least one depends on signs that are not known.
    """
    critical = critical_friction(kinetics).subs({key: exact_constant(str(key), value) for key, value in values.items()})
    tangent = sp.Symbol("T", positive=True)
    turned = _in_tangent(critical, coordinate, tangent)
    if turned is None or not turned.has(tangent):
        raise NotDerivable(f"the critical friction {own(critical)} is no rational function of tan({own(coordinate)})")
    slope = sp.fraction(sp.cancel(sp.together(sp.diff(turned, tangent))))[0]
    places = [root for root in sp.roots(sp.Poly(slope, tangent)) if root.is_positive]
    values_there = {sp.simplify(turned.subs(tangent, root)): root for root in places}
    candidates = [value for value in values_there if value.is_positive]
    if not candidates or (len(candidates) > 1 and not all(value.is_number for value in candidates)):
        name = own(coordinate)
        raise NotDerivable(f"the least critical friction over {name} depends on parameters; give their values")
    best = min(candidates)
    return LeastFriction(best, sp.Eq(sp.tan(own(coordinate)), values_there[best]))


def _in_tangent(critical: sp.Expr, coordinate: sp.Symbol, tangent: sp.Symbol) -> sp.Expr | None:
    """Return a quotient of even degree in sine and cosine in terms of the tangent, between 0 and a right angle."""
    cosine = sp.Dummy("c", positive=True)
    put = {sp.sin(coordinate): tangent * cosine, sp.cos(coordinate): cosine}
    found = sp.cancel(sp.expand_trig(critical).subs(put)).subs(cosine**2, 1 / (1 + tangent**2))
    found = sp.cancel(sp.together(found))
    return None if found.has(cosine, coordinate) or not found.is_rational_function(tangent) else found
