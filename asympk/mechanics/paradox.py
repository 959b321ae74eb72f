r"""The paradox of the rigid contact, friction load |G_NT| > G_NN: its condition, and the least critical friction.

``least``, the hard function, minimises a quotient of polynomials in the tangent of a coordinate, or of half of it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import sympy as sp

from asympk.errors import NotDerivable
from asympk.mechanics.kinetics import Kinetics
from asympk.symbolic.long import remade
from asympk.symbolic.reading import exact_constant
from asympk.symbolic.signs import factored, known_sign
from asympk.symbolic.tidy import shortest, tidy, vanishes

DIGITS = 50  # at which extreme values are told apart
ROUGH = 4  # most others whose friction has signs to choose


def critical_friction(kinetics: Kinetics) -> sp.Expr:
    """Return the least G_NN / (load |G_NT|) of ``ratios``, or oo if G_NT vanishes identically.

    It is 0 where rough contacts have a paradox of their own while this one is open, or cannot slide.
    """
    pairs = ratios(kinetics)
    quotients = [normal / (kinetics.load * mixed) for normal, mixed in pairs if mixed != 0]
    least = remade(sp.Min, *quotients)
    alone = sp.And(*(normal > 0 for normal, mixed in pairs if mixed == 0))
    return least if alone == sp.true else sp.Piecewise((least, alone), (0, True))


def condition(kinetics: Kinetics) -> sp.Basic:
    """Return the condition for a paradox, friction load |G_NT| > G_NN for one of ``ratios``."""
    return sp.Or(*(sp.Gt(kinetics.friction * kinetics.load * mixed, normal) for normal, mixed in ratios(kinetics)))


@lru_cache(maxsize=64)
def pairs(kinetics: Kinetics) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
    """Return (G_NN, G_NT), or for each choice of signs of ``rough`` contacts (D_0, D_1) in their place (Lemma 21).

    Beside a unilateral contact come pairs (D_2, 0), as the rough contacts may have a paradox while it is open. Raises
    ``NotDerivable`` for more than ``ROUGH`` rough contacts, and for those that hold gap or slip of the contact, too.
    """
    if not kinetics.rough:
        return ((kinetics.delassus[0, 0], kinetics.delassus[0, 1]),)
    if (many := len(kinetics.rough)) > ROUGH:
        raise NotDerivable(f"{many} of the others hold both ways and are rough, at most {ROUGH} may: each doubles the "
                           "formulas of critical friction; take motions(), rigid() or elastic()")
    kinetics.require_motion((*kinetics.joints, *kinetics.rough))
    found: list[tuple[sp.Expr, sp.Expr]] = []
    for signs in product((1, -1), repeat=len(kinetics.rough)):
        normal, mixed, alone = kinetics.determinants(signs)
        found += [(normal, mixed), *[(alone, sp.S.Zero)] * kinetics.unilateral]
    return tuple(dict.fromkeys(found))


@lru_cache(maxsize=64)
def ratios(kinetics: Kinetics) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
    """Return the ``pairs`` as (G_NN, |G_NT|) without common factors."""
    return tuple(_reduced(kinetics, *pair) for pair in pairs(kinetics)) if kinetics.rough else (_ratio(kinetics),)


def _reduced(kinetics: Kinetics, normal: sp.Expr, mixed: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return (normal, |mixed|) without their common factors that are known to be positive, as det M is."""
    if kinetics.long:
        return normal, sp.Abs(mixed, evaluate=mixed == 0)
    if normal == 0:
        return normal, sp.Abs(mixed)
    above, below = sp.fraction(tidy(normal / mixed)) if mixed != 0 else (sp.S.One, sp.S.Zero)
    common = _signed(kinetics, tidy(normal / above))
    return common * above, sp.Abs(common * below)


def _signed(kinetics: Kinetics, whole: sp.Expr) -> sp.Expr:
    """Return 1 or -1 times the factors whose sign is not known where the diagonal of the mass matrix is positive."""
    positive = sp.And(*(entry > 0 for entry in kinetics.mass.diagonal()))
    content, factors = factored(whole)
    odd = [factor for factor, power in factors if power % 2]
    signs = [known_sign(factor, positive) for factor in odd]
    return sp.sign(content) * sp.Mul(*(sign or factor for sign, factor in zip(signs, odd, strict=True)))


def _ratio(kinetics: Kinetics) -> tuple[sp.Expr, sp.Expr]:
    """Return G_NN and |G_NT| divided by their common factors, among them 1 / det M."""
    G = kinetics.delassus
    normal, mixed = G[0, :] if kinetics.long else map(tidy, kinetics.undivided[0, :])
    if mixed == 0 or G[0, 1] == 0:
        return sp.S.One, sp.S.Zero
    if kinetics.long:
        return normal, sp.Abs(mixed, evaluate=False)
    return tuple(map(sp.Abs, sp.fraction(shortest(tidy(normal / mixed), tidy(-normal / mixed)))))


@dataclass(frozen=True)
class LeastFriction:
    """The least critical friction over a coordinate, and the equation for the coordinate at which it is attained."""

    friction: sp.Expr
    where: sp.Basic


def least(
    kinetics: Kinetics, coordinate: sp.Symbol, values: dict[sp.Symbol, Any], own: Callable[[Any], Any]
) -> LeastFriction:
    """Return the exact ``LeastFriction`` over ``coordinate``, if the critical friction is rational in sine and cosine.

    ``values`` are exact numbers for parameters; all other parameters stay symbols, and a number of the coordinate is
    ignored. Raises ``NotDerivable`` if the critical friction is no such function, has no least value, or its least
    value depends on signs that are not known or is a root of a polynomial whose coefficients are not rational numbers.
    """
    if kinetics.long:
        raise NotDerivable("the mass matrix is too long to be inverted in symbols, and the critical friction has no "
                           "formula; look for its least value in numbers, by evaluate")
    known = {key: exact_constant(str(key), value) for key, value in values.items() if key != coordinate}
    sides = [(above.subs(known), (kinetics.load * below).subs(known)) for above, below in ratios(kinetics)]
    name, tangent = own(coordinate), sp.Dummy("T", real=True)
    if not (quotients := [above / below for above, below in sides if below != 0]):
        raise NotDerivable("there is no paradox at any friction: a reaction does not change the sliding, G_NT = 0")
    if kinetics.rough and not all(_stays_positive(above, coordinate, tangent) for above, _ in sides):
        raise NotDerivable(f"it is not known whether rough others have a paradox at any friction over {name}: give "
                           "numbers for all parameters; if they have, there is no least critical friction")
    angle, turned = _in_tangents(quotients, coordinate, tangent, name)
    if turned is None:
        raise NotDerivable(f"the critical friction {own(critical_friction(kinetics).subs(known))} is no rational "
                           f"function of tan({name}/2)")
    if not any(quotient.has(tangent) for quotient in turned):
        everywhere = own(sp.Min(*map(sp.Abs, turned)))
        raise NotDerivable(f"the critical friction is {everywhere} at every {name}; take another coordinate")
    found: dict[sp.Expr, sp.Expr] = {}
    for quotient in turned:
        found = (_extremes(quotient, tangent, name) if quotient.has(tangent) else {sp.Abs(quotient): sp.S.Zero}) | found
    if 0 in found:
        raise NotDerivable(f"the critical friction over {name} comes down to 0: there is no least one")
    for value, place in found.items():
        if value.is_positive and all(_is_least(value, other) for other in found):
            return LeastFriction(value, sp.Eq(sp.cos(angle), 0) if place == sp.oo else sp.Eq(sp.tan(angle), place))
    raise NotDerivable(f"the least critical friction over {name} depends on parameters; give their values")


def _in_tangents(
    quotients: list[sp.Expr], coordinate: sp.Symbol, tangent: sp.Symbol, name: sp.Expr
) -> tuple[sp.Expr, list[sp.Expr] | None]:
    """Return an angle, all or half of the coordinate, by whose tangent all quotients can be written, and them so."""
    for part in (sp.S.One, sp.S.Half):
        signed = (quotient.replace(sp.Abs, lambda inside: inside) for quotient in quotients)
        turned = [_in_tangent(each.subs(coordinate, coordinate / part), coordinate, tangent) for each in signed]
        if None not in turned:
            return part * name, turned
    return name, None


def _stays_positive(expr: sp.Expr, coordinate: sp.Symbol, tangent: sp.Symbol) -> bool:
    """Tell whether an expression is known to be positive at all values of the coordinate."""
    turned = _in_tangent(expr.subs(coordinate, 2 * coordinate), coordinate, tangent)
    if expr.is_positive or turned is None:
        return bool(expr.is_positive)
    above, below = (sp.Poly(part, tangent) for part in sp.fraction(turned))
    numbers = all(part.domain.is_ZZ or part.domain.is_QQ for part in (above, below))
    return numbers and above.degree() == below.degree() and not above.count_roots() and turned.subs(tangent, 0) > 0


def _is_least(value: sp.Expr, other: sp.Expr) -> bool:
    """Tell whether a value is known to be no greater than another."""
    known = value == other or sp.Le(value, other) is sp.true  # of roots of polynomials, too, without a long search
    return known or bool(sp.simplify(other - value).is_nonnegative)


def _extremes(turned: sp.Expr, tangent: sp.Symbol, name: Any) -> dict[sp.Expr, sp.Expr]:
    """Return {absolute value: tangent} of a quotient at zeros, stationary points, and the tangent oo if finite."""
    above, below = (sp.Poly(part, tangent) for part in sp.fraction(turned))
    if max(above.degree(), below.degree()) == 2:
        return _of_quadratics(above, below, name)
    slope = above.diff() * below - above * below.diff()
    if all(part.domain.is_ZZ or part.domain.is_QQ for part in (above, below)):
        found = _in_numbers(above, below, slope)
    else:
        roots = sp.roots(slope, cubics=False, quartics=False)  # radicals of parameters have no known sign
        if sum(roots.values()) < slope.degree() or any(root.is_real is None for root in roots):
            why = ("depends on parameters; give their values" if slope.free_symbols_in_domain else
                   "is a root of a polynomial with irrational numbers; give rational ones")
            raise NotDerivable(f"the least critical friction over {name} {why}")
        places = [root for root in (*sp.roots(above), *roots) if root.is_real and below.eval(root) != 0]
        found = {}
        for root in sorted(places, key=lambda root: root.is_positive is not True):
            found.setdefault(sp.simplify(sp.Abs(turned.subs(tangent, root))), root)
    if (degree := below.degree()) >= above.degree():
        found.setdefault(sp.cancel(sp.Abs(above.nth(degree) / below.nth(degree))), sp.oo)
    return found


def _in_numbers(above: sp.Poly, below: sp.Poly, slope: sp.Poly) -> dict[sp.Expr, sp.Expr]:
    """Return {absolute value: tangent} of the zeros and stationary points of a quotient s with rational numbers.

    At a stationary point above - s below has a double root, so that s is a root of its discriminant.
    """
    if zeros := above.real_roots():
        return {sp.S.Zero: zeros[0]}
    s = sp.Dummy("s")
    discriminant = sp.Poly((above.as_expr() - s * below.as_expr()).as_poly(above.gen).discriminant(), s)
    either = discriminant * discriminant.compose(sp.Poly(-s, s))
    values = [value for value in dict.fromkeys(either.real_roots()) if value.is_positive]
    found: dict[sp.Expr, sp.Expr] = {}
    for root in reversed(slope.quo(slope.gcd(below)).real_roots()):
        near = root.evalf(DIGITS)
        size = abs(above.eval(near) / below.eval(near))
        found.setdefault(min(values, key=lambda value: abs(value.evalf(DIGITS) - size)), root)
    return found


def _of_quadratics(above: sp.Poly, below: sp.Poly, name: Any) -> dict[sp.Expr, sp.Expr]:
    """Return {absolute value: tangent} of the zeros and extremes of a quotient s, at which above - s below is a square.

    The root of this square is the tangent, oo at infinity.
    """
    s = sp.Dummy("s")
    last, middle, first = (above.nth(k) - s * below.nth(k) for k in range(3))
    discriminant = sp.Poly(sp.expand(middle**2 - 4 * first * last), s)
    values = sp.roots(sp.Poly([tidy(coefficient) for coefficient in discriminant.all_coeffs()], s))
    if any(value.is_real is None for value in values):
        raise NotDerivable(f"the least critical friction over {name} depends on parameters; give their values")
    places = {root: sp.S.Zero for root in sp.roots(above) if root.is_real and below.eval(root) != 0}
    for value in filter(lambda value: value.is_real, values):
        square, double = first.subs(s, value), -middle.subs(s, value) / 2
        root = sp.oo if vanishes(square) else double / square
        places[shortest(tidy(root), sp.radsimp(root))] = sp.Abs(value)
    found: dict[sp.Expr, sp.Expr] = {}
    for root in sorted(places, key=lambda root: root.is_positive is not True):
        found.setdefault(places[root], root)
    return found


def _in_tangent(critical: sp.Expr, coordinate: sp.Symbol, tangent: sp.Symbol) -> sp.Expr | None:
    """Return a quotient of even degree in sine and cosine by the tangent, or None; the cosine counts as positive."""
    cosine = sp.Dummy("c", positive=True)
    put = {sp.tan(coordinate): tangent, sp.sin(coordinate): tangent * cosine, sp.cos(coordinate): cosine}
    found = sp.cancel(sp.expand_trig(critical).subs(put)).subs(cosine**2, 1 / (1 + tangent**2))
    found = sp.cancel(sp.together(found))
    return None if found.has(cosine, coordinate) or not found.is_rational_function(tangent) else found
