r"""Forms of an equation g(y) = 0 that SymPy solves fast and completely.

Powers become exponentials, several exponentials, roots or logarithms powers of one unknown, waves functions of the
tangent of half an angle, and y beside one exponential or logarithm leads to Lambert's W:

    a + b y + c e^(p + q y) = 0,      y = -a/b - W(q c/b e^(p - q a/b))/q
"""

from collections.abc import Callable, Collection, Iterator
from typing import TypeAlias

import sympy as sp
from sympy.functions.elementary.hyperbolic import HyperbolicFunction
from sympy.functions.elementary.trigonometric import TrigonometricFunction
from sympy.simplify.fu import TR8

from asympk.symbolic.long import common_divisor, heavy

Substitution: TypeAlias = tuple[sp.Expr, sp.Symbol, Callable[[sp.Expr], sp.Expr]]  # (function that is 0, w, y by w)


def fractional_powers(*heights: sp.Expr) -> set[sp.Pow]:
    """Return the roots, powers with a rational and not a whole exponent, in expressions."""
    powers = sp.Tuple(*heights).atoms(sp.Pow)
    return {p for p in powers if p.exp.is_Rational and not p.exp.is_Integer}


def outermost(force: sp.Expr, unknowns: Collection[sp.Symbol]) -> Iterator[sp.Expr]:
    """Yield the functions of unknowns, and powers other than whole ones, in which g is rational with the unknowns."""
    return (part for part in irrational_parts(force) if part.has(*unknowns))


def irrational_parts(force: sp.Expr) -> Iterator[sp.Expr]:
    """Yield the functions, powers other than whole ones, and irrational numbers in which g is rational with symbols."""
    if force.is_Add or force.is_Mul or (force.is_Pow and force.exp.is_Integer):
        for part in force.args:
            yield from irrational_parts(part)
    elif not (force.is_Symbol or force.is_Rational):
        yield force


def waves_in(force: sp.Expr, y: sp.Symbol) -> set[sp.Expr]:
    """Return the trigonometric functions of y in an expression."""
    return {f for f in force.atoms(TrigonometricFunction) if f.has(y)}


def common_turn(force: sp.Expr, y: sp.Symbol) -> sp.Expr | None:
    """Return q where the turns of all waves of y in g, 2 pi/q together, fit each other, else None.

    A tangent has half the turn of a sine.
    """
    return _common_slope([f.args[0].diff(y) * (1 + isinstance(f, sp.tan | sp.cot)) for f in waves_in(force, y)], y)


def _common_slope(slopes, y):
    """Return the largest q of which all slopes are whole multiples, without y, or None where there is none."""
    if not slopes or slopes[0].has(y) or not all((slope / slopes[0]).is_Rational for slope in slopes):
        return None
    return slopes[0] * common_divisor(slope / slopes[0] for slope in slopes)


def whole_turn(force: sp.Expr, y: sp.Symbol) -> sp.Expr | None:
    """Return q where g is a function of waves of y alone whose turns, 2 pi/q together, fit each other, else None."""
    return None if force.xreplace({f: sp.Dummy() for f in waves_in(force, y)}).has(y) else common_turn(force, y)


def in_base_e(force: sp.Expr, y: sp.Symbol) -> sp.Expr:
    """Return g with exponentials in place of powers of other numbers: 4**y is the square of 2**y = e**(y log(2))."""
    powers = (p for p in force.atoms(sp.Pow) if p.exp.has(y) and not p.base.has(y))
    return force.xreplace({p: sp.exp(p.exp * sp.expand_log(sp.log(p.base))) for p in powers})


def from_phase(force: sp.Expr, y: sp.Symbol) -> Substitution | None:
    """Return (g, w, y by w) in w = y - y0, where g is a function of waves of w alone, else None.

    SymPy expands sin(y - 1), and then does not end for sin(y - 1)^2 = x.
    """
    arguments = [wave.args[0] for wave in waves_in(force, y)]
    shifts = {sp.expand(a.subs(y, 0) / a.diff(y)) for a in arguments if not a.diff(y).has(y)}
    if len(shifts) != 1 or shifts == {0} or common_turn(force, y) is None:
        return None
    w, (shift,) = sp.Dummy(real=True), shifts
    shifted = force.xreplace({a: a.diff(y) * w for a in arguments})
    return None if shifted.has(y) else (shifted, w, lambda value: value - shift)


def in_fewer_waves(force: sp.Expr, y: sp.Symbol) -> sp.Expr:
    """Return g with sines and cosines of multiples of y for products of them, where these are fewer, else g."""
    if heavy(force) or len(waves := waves_in(force, y)) < 2:
        return force
    shorter = TR8(force)
    return shorter if len(waves_in(shorter, y)) < len(waves) else force


def in_half_angle(force: sp.Expr, y: sp.Symbol) -> tuple[sp.Expr, sp.Symbol, sp.Expr] | None:
    """Return (numerator of g in t, t, q), t = tan(q y/2), where g is rational in sines and cosines of q y, else None.

    The period of g is 2 pi/q; with tangents alone they are those of q y/2.
    """
    if heavy(force) or not (q := common_turn(force, y)):
        return None
    t, s = sp.symbols("t s", cls=sp.Dummy, real=True)
    sine, cosine = t / sp.sqrt(1 + t**2), 1 / sp.sqrt(1 + t**2)
    known = {sp.sin(s): sine, sp.cos(s): cosine, sp.tan(s): t, sp.cot(s): 1 / t}
    expanded = sp.expand_trig(force.subs(y, 2 * s / q)).xreplace(known)
    numerator = sp.fraction(sp.cancel(expanded))[0]
    return (numerator, t, q) if numerator.is_polynomial(t) and not numerator.has(s) else None


def by_lambert(force: sp.Expr, y: sp.Symbol) -> list[dict[sp.Symbol, sp.Expr]] | None:
    """Return [root] of a + b y + c e^(p + q y), or of its product with an exponential, else None.

    SymPy takes roots of the order of b/c here, which may not end.
    """
    exponentials = [e for e in force.atoms(sp.exp) if e.has(y)]
    if len(exponentials) != 1 or not exponentials[0].exp.is_polynomial(y):
        return None
    power = sp.Dummy()
    named, exponent = sp.expand(force.xreplace({exponentials[0]: power})), sp.Poly(exponentials[0].exp, y)
    if not named.is_polynomial(y, power) or exponent.degree() != 1:
        return None
    terms = dict(sp.Poly(named, y, power).terms())
    for shift, sign in ((0, 1), (1, -1)):
        constant, linear, other = (0, shift), (1, shift), (0, 1 - shift)
        if {linear, other} <= terms.keys() <= {constant, linear, other}:
            a, b, c = (terms.get(index, 0) for index in (constant, linear, other))
            q, p = (sign * k for k in exponent.all_coeffs())
            return [{y: -a / b - sp.LambertW(q * c / b * sp.exp(p - q * a / b)) / q}]
    return None


def by_logarithm(force: sp.Expr, y: sp.Symbol) -> list[dict[sp.Symbol, sp.Expr]] | None:
    """Return [root] of a + b y + c log(p + q y), or of its product with a power of p + q y, else None.

    In w = log(p + q y) the logarithm is linear beside an exponential, which ``by_lambert`` solves for w.
    """
    logarithms = [f for f in force.atoms(sp.log) if f.has(y)]
    if len(logarithms) != 1 or not logarithms[0].args[0].is_polynomial(y):
        return None
    w, inside = sp.Dummy(real=True), sp.Poly(logarithms[0].args[0], y)
    if inside.degree() != 1:
        return None
    height = (sp.exp(w) - inside.nth(0)) / inside.nth(1)
    found = by_lambert(force.xreplace({logarithms[0]: w}).subs(y, height), w)
    return found and [{y: height.subs(root)} for root in found]


def substituted(force: sp.Expr, y: sp.Symbol) -> Substitution | None:
    """Return (numerator, w, y by w): g = 0 where the numerator is 0, which SymPy solves for w; else None."""
    ways = (way(force, y) for way in (_without_logarithms, _in_exponentials, _in_roots))
    return next(filter(None, ways), None)


def _without_logarithms(force, y):
    """Return (numerator of e^(g/q) - 1, y, y by y), where g has rational multiples of several logarithms, else None.

    The q makes whole powers of these. SymPy takes the roots of a cubic for log(y) + log(y + 1) + log(y + 2) = x.
    """
    logarithms = [f for f in outermost(force, [y]) if isinstance(f, sp.log)]
    if len(logarithms) < 2 or heavy(force):
        return None
    names = {f: sp.Dummy() for f in logarithms}
    named = sp.expand(force.xreplace(names))
    slopes = [named.diff(name) for name in names.values()]
    if (q := _common_slope(slopes, y)) is None or q.has(*names.values()):
        return None
    rest = named.xreplace(dict.fromkeys(names.values(), sp.S.Zero))
    powers = sp.Mul(*(f.args[0] ** (slope / q) for f, slope in zip(logarithms, slopes, strict=True)))
    return None if rest.has(y) else (sp.fraction(sp.together(powers - sp.exp(-rest / q)))[0], y, lambda value: value)


def _in_exponentials(force, y):
    """Return (numerator of g in w, w, y by w), w = exp(q y), where g is rational in several powers of it, else None.

    Hyperbolic functions are such powers. For exp(y/2) beside exp(y/3), and tanh(y) beside exp(y), SymPy does not end.
    """
    if heavy(force) or not (powers := exponentials_as_powers(force, y)):
        return None
    named, w, q = powers
    return _in_one_power(named, y, w, lambda value, step: sp.log(sp.together(value)) / (q * step))


def exponentials_as_powers(force: sp.Expr, y: sp.Symbol) -> tuple[sp.Expr, sp.Symbol, sp.Expr] | None:
    """Return (g with powers of w, w, q), w = exp(q y), where g has several exponentials that are such powers."""
    hyperbolic = {f: f.rewrite(sp.exp) for f in force.atoms(HyperbolicFunction) if f.has(y)}
    force = force.xreplace(hyperbolic)
    exponentials = [e for e in force.atoms(sp.exp) if e.has(y)]
    slopes = [e.exp.diff(y) for e in exponentials]
    if len(slopes) + len(hyperbolic) < 2 or (q := _common_slope(slopes, y)) is None:
        return None
    q, w = -q if q.could_extract_minus_sign() else q, sp.Dummy(positive=True)
    powers = {e: w ** (k / q) * sp.exp(e.exp.subs(y, 0)) for e, k in zip(exponentials, slopes, strict=True)}
    return force.xreplace(powers), w, q


def _in_roots(force, y):
    """Return (numerator of g in w, w, y by w), w a root of a + b y, where g is rational in powers of it, else None."""
    roots = {p for p in fractional_powers(force) if p.has(y)} if not heavy(force) else ()
    bases = {p.base for p in roots}
    if len(bases) != 1 or (slope := (base := bases.pop()).diff(y)).has(y):
        return None
    q, w = sp.ilcm(1, *(p.exp.q for p in roots)), sp.Dummy(nonnegative=True)

    def height(value, step=1):
        found = (value ** sp.Rational(q, step) - base.subs(y, 0)) / slope
        return sp.expand(found) if fractional_powers(value) else found

    return _in_one_power(force.xreplace({p: w ** (q * p.exp) for p in roots}).subs(y, height(w)), y, w, height)


def _in_one_power(force, y, w, height):
    """Return (numerator of g in w, w, y by w) with the least powers of w, where g is rational in w alone, else None."""
    numerator = sp.fraction(sp.together(force))[0]
    if not numerator.is_polynomial(w) or numerator.has(y):
        return None
    terms = sp.Poly(numerator, w).terms()
    least = min(k for (k,), _ in terms) if w.is_positive else 0
    step = sp.igcd(0, *(k - least for (k,), _ in terms)) or 1
    return sum(c * w ** ((k - least) // step) for (k,), c in terms), w, lambda value: height(value, step)


def without_roots(force: sp.Expr, y: sp.Symbol) -> sp.Expr:
    """Return a function that vanishes where g = 0, without the roots of functions of y that g contains.

    It is the product of g over all values of each root, a resultant. SymPy takes minutes for quartics with roots in g.
    """
    while not heavy(force) and (roots := {p for p in fractional_powers(force) if p.has(y)}):
        base = max((p.base for p in roots), key=sp.count_ops)
        powers = [p for p in roots if p.base == base]
        w, q = sp.Dummy(), sp.ilcm(1, *(p.exp.q for p in powers))
        named = sp.fraction(sp.together(force.xreplace({p: w ** (q * p.exp) for p in powers})))[0]
        relation = sp.fraction(sp.together(w**q - base))[0]
        if not (named.is_polynomial(w) and relation.is_polynomial(w)):
            return force
        force = sp.resultant(named, relation, w)
    return force
