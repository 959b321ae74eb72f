r"""Signs of expressions under assumptions: conditions that keep only the factors whose sign is not known.

A sign follows from the symbols' own assumptions, or from the range of a single parameter, or from bounds: with a >= b
and b > -1 the sum a + b + 2 is positive. ``conjunction``, the hard function, joins several signs; a factor whose sign
one expression fixes is known in the next, so that no condition contradicts itself.
"""

from functools import lru_cache
from itertools import product

import sympy as sp
from sympy.functions.elementary.trigonometric import InverseTrigonometricFunction
from sympy.simplify.fu import TR8

from asympk.symbolic.conditions import reduce_under
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import LONG, atoms, common_divisor, factorises, in_factors, is_longer, named_exponentials

HIGHEST = 24  # the highest degree of a polynomial in the sine and cosine of one angle whose roots are counted
_WAVES = (sp.sin, sp.cos, sp.tanh, sp.sign, sp.erf)  # between -1 and 1


def nonzero(expr: sp.Expr, assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which ``expr`` is not 0, without the factors that never vanish."""
    if expr == 0:
        return sp.false
    return sp.And(*(reduce_under(sp.Ne(f, 0), assumptions) for f, _ in factored(expr)[1] if _vanishes(f, assumptions)))


def conjunction(signs: list[tuple[sp.Expr, int]], assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which every expression has the sign (1, -1 or 0) beside it; False if never.

    >>> a, b = sp.symbols("a b", real=True)
    >>> conjunction([(a * b, 1), (a, -1)]), conjunction([(a + b, 1), (-a - b, 1)])
    ((a < 0) & (b < 0), False)
    >>> conjunction([(a**2 * b, 1)]), conjunction([(a - b, 1)], a >= b)
    ((b > 0) & Ne(a, 0), a - b > 0)
    """
    known: dict[sp.Expr, int] = {}
    conditions: list[sp.Basic] = []
    for expr, sign in sorted(signs, key=lambda pair: len(factored(pair[0])[1])):
        conditions += _of_sign(expr, sign, known, assumptions) if sign else _vanishing(expr, known, assumptions)
    return reduce_under(sp.And(*conditions), assumptions)


def _of_sign(expr, sign, known, assumptions):
    """Return relations under which ``expr`` has a sign, 1 or -1; add the factor whose sign they fix to ``known``."""
    content, factors = factored(expr)
    rest, undecided, conditions = int(sp.sign(content)), [], []
    for factor, power in factors:
        fixed = known.get(factor, known_sign(factor, assumptions))
        if not (fixed or factor in known) and power % 2 == 1:
            undecided.append(factor)
            continue
        rest *= fixed**power if fixed or factor in known else 1
        if factor not in known and _vanishes(factor, assumptions):
            conditions.append(above(fixed * factor) if fixed else sp.Ne(factor, 0))
    if len(undecided) > 1 and (fixed := _sign_by_root(sp.Mul(*undecided), assumptions)):
        conditions += [sp.Ne(factor, 0) for factor in undecided]
        rest, undecided = rest * fixed, []
    if not undecided:
        return conditions if rest == sign else [sp.false]
    if len(undecided) == 1:
        known[undecided[0]] = sign * rest
    return [*conditions, above(sign * rest * sp.Mul(*undecided))]


def _vanishing(expr, known, assumptions):
    """Return the relation under which ``expr`` is 0, and add to ``known`` the factor that must then be 0."""
    factors = [factor for factor, _ in factored(expr)[1]]
    if expr == 0 or any(known.get(factor) == 0 for factor in factors):
        return []
    doubtful = [factor for factor in factors if factor not in known and _vanishes(factor, assumptions)]
    if len(doubtful) == 1:
        known[doubtful[0]] = 0
    return [sp.Eq(sp.Mul(*doubtful), 0) if doubtful else sp.false]


@lru_cache(maxsize=1024)
def factored(expr: sp.Expr) -> tuple[sp.Expr, list[tuple[sp.Expr, int]]]:
    """Return the content and the factors, with powers, of numerator times denominator: the sign is that of ``expr``.

    One that may not be factored (``factorises``) has those of the product as which it is written.
    """
    if expr.has(sp.I):
        return sp.S.One, [(expr, 1)]
    if not factorises(expr):
        content, product = expr.as_coeff_Mul()
        parts = [(part, *part.as_base_exp()) for part in sp.Mul.make_args(product)]
        return content, [(base, abs(k)) if k.is_Integer else (part, 1) for part, base, k in parts]
    names, meaning = named_exponentials(expr)  # before a denominator e^(-y) becomes a factor e^y, which has no name
    numerator, denominator = sp.fraction(sp.together(expr.xreplace(names)))
    powers = (p for p in expr.atoms(sp.Pow) if p.is_positive and p.free_symbols and not p.exp.is_Integer)
    roots = {p: sp.Dummy(positive=True) for p in powers}  # SymPy does not factor roots of positive symbols
    try:
        content, factors = sp.factor_list((numerator * denominator).xreplace(roots))
    except (sp.PolynomialError, TypeError):  # of a power with a state as exponent
        return sp.S.One, [((numerator * denominator).xreplace(meaning), 1)]
    meaning |= {name: p for p, name in roots.items()}
    return content, [(factor.xreplace(meaning), power) for factor, power in factors]


@lru_cache(maxsize=1024)
def known_sign(expr: sp.Expr, assumptions: sp.Basic) -> int:
    """Return 1 if ``expr`` >= 0 for all real symbols within the assumptions, -1 if ``expr`` <= 0, 0 if not known."""
    if expr.has(sp.I):
        return 0
    if known := {sp.true: 1, sp.false: -1}.get(_relation(expr, assumptions)):
        return known
    facts = sp.And.make_args(assumptions)
    found = next((sign for sign in (1, -1) if _is_known(sign * expr, facts)), 0)
    return found or _sign_by_root(expr, assumptions)


def _sign_by_root(expr, assumptions):
    """Return the sign of a + b sqrt(d) where that of a**2 - b**2 d tells which term is larger; else 0."""
    if not (parts := _root_parts(expr)):
        return 0
    a, b, norm = parts
    larger = known_sign(norm, assumptions)
    return larger and known_sign(a if larger > 0 else b, assumptions)


@lru_cache(maxsize=1024)
def _root_parts(expr):
    """Return (a, b, a**2 - b**2 d) of an expression a + b sqrt(d) in one root, or ()."""
    roots = [p for p in expr.atoms(sp.Pow) if p.exp == sp.S.Half and p.free_symbols]
    root = sp.Dummy()
    if len(roots) != 1 or not (named := expr.xreplace({roots[0]: root})).is_polynomial(*named.free_symbols):
        return ()
    found = sp.Poly(named, root).rem(sp.Poly(root**2 - roots[0].base, root))
    a, b = map(found.nth, (0, 1))
    return sp.factor(a), sp.factor(b), sp.factor(a**2 - b**2 * roots[0].base)


def follows(relation: sp.Basic, facts: tuple[sp.Basic, ...]) -> bool:
    """Tell whether an inequality follows from the bounds on single symbols among ``facts``, by substitution."""
    if not isinstance(relation, sp.Gt | sp.Lt | sp.Ge | sp.Le):
        return False
    return _is_known(relation.gts - relation.lts, facts, strict=isinstance(relation, sp.Gt | sp.Lt))


@lru_cache(maxsize=1024)
def _is_known(difference, facts, strict=False):
    """Tell whether ``difference`` is positive, or not negative, by some choice of one bound for each symbol.

    Products of waves also count as sums: sin(a) cos(a) is at most 1/2. Of a difference that may not be factored this is
    not known, nor of a long one with several waves, which bound each other.
    """
    if not factorises(difference) or (is_longer(difference, LONG) and len(atoms(difference, *_WAVES)) > 1):
        return False
    for bounds in _bounds(facts):
        moved = difference
        for _ in bounds:  # a bound may name another symbol that has one
            moved = moved.subs(bounds)
        moved = _factored(_without_waves(moved))
        if moved.is_positive if strict else moved.is_nonnegative:
            return True
    ends = _at_ends(difference, facts)
    if ends and all(_is_known(end, facts, strict) for end in ends):
        return True
    summed = TR8(difference) if difference.has(sp.sin, sp.cos) and not is_longer(difference, LONG) else difference
    return summed != difference and _is_known(summed, facts, strict)


def waves_never_negative(expr: sp.Expr) -> bool:
    """Tell whether an expression in waves is nowhere negative: by the bounds of each, or by all as one polynomial."""
    return bool(_without_waves(expr).is_nonnegative) or _never_negative_in_tangent(expr)


def _never_negative_in_tangent(expr):
    """Tell whether waves of multiples of one angle, with rational numbers, give a number that is nowhere negative.

    It is a quotient of polynomials in the tangent of half that angle. The number has one sign if no real root of the
    numerator has an odd multiplicity.
    """
    waves = [*expr.atoms(sp.sin, sp.cos)]
    ratios = [sp.cancel(wave.args[0] / waves[0].args[0]) for wave in waves]
    others = expr.xreplace(dict.fromkeys(waves, sp.S.One)).free_symbols
    if not waves or others or not all(ratio.is_Rational for ratio in ratios):
        return False
    unit, x = common_divisor(ratios), sp.Dummy(real=True)
    orders = {wave: ratio / unit for wave, ratio in zip(waves, ratios, strict=True)}
    if sum(_degree(part, orders) for part in sp.fraction(sp.together(expr))) > HIGHEST:
        return False
    s, c = 2 * x / (1 + x**2), (1 - x**2) / (1 + x**2)
    found = expr.xreplace({
        wave: sp.chebyshevt(abs(k), c) if wave.func == sp.cos else sp.sign(k) * s * sp.chebyshevu(abs(k) - 1, c)
        for wave, k in orders.items()})
    if not found.is_rational_function(x):
        return False
    above, below = sp.fraction(sp.cancel(sp.together(found)))
    numerator = sp.Poly(above * below, x)
    if not (numerator.domain.is_QQ or numerator.domain.is_ZZ) or sp.Poly(below, x).count_roots():
        return False
    odd = [part for part, power in numerator.sqf_list()[1] if power % 2]
    return bool(numerator.LC() > 0) and not any(part.count_roots() for part in odd)


def _degree(expr, orders):
    """Return a bound of the degree of sums of products of waves, each of which is of the order of its angle."""
    if expr in orders:
        return abs(orders[expr])
    parts = [_degree(part, orders) for part in expr.args]
    if expr.is_Pow and expr.exp.is_Integer:
        return parts[0] * abs(expr.exp)
    return sum(parts) if expr.is_Mul else max(parts, default=0)


def _at_ends(expr, facts):
    """Return ``expr`` at the bounds of a wave in which it is affine, with a slope in symbols of ``facts``, or []."""
    bounded = set().union(*(fact.free_symbols for fact in facts))
    for wave in _waves(expr):
        name = sp.Dummy()
        named = expr.xreplace({wave: name})
        if (slope := slope_by(named, name)).free_symbols and slope.free_symbols <= bounded:
            return [named.xreplace({name: end}) for end in (sp.S.One, sp.S.NegativeOne)]
    return []


def _without_waves(expr):
    """Return a lower bound of ``expr``, from the bounds -1 and 1 of waves, signs and error functions.

    These functions stay where the expression is not affine in them, or a slope has no known sign.
    """
    for wave in _waves(expr):
        name = sp.Dummy()
        named = expr.xreplace({wave: name})
        slope = slope_by(named, name)
        if not slope.has(name) and (slope.is_nonnegative or slope.is_nonpositive):
            expr = named.xreplace({name: sp.S.NegativeOne if slope.is_nonnegative else sp.S.One})
    return expr


def _waves(expr):
    """Return the waves of ``expr`` but those in forms u' M^-1 v, where the slope has no known sign."""
    inside = {wave for form in atoms(expr, InverseForm) for wave in form.atoms(*_WAVES)}
    return sorted(atoms(expr, *_WAVES) - inside, key=sp.default_sort_key)


_factored = lru_cache(maxsize=1024)(in_factors)


@lru_cache(maxsize=256)
def _bounds(relations):
    """Return every choice of one bound for each symbol, as ``{symbol: bound +- a positive or nonnegative symbol}``."""
    found = {}
    for r in relations:
        if isinstance(r, sp.Ge | sp.Gt | sp.Le | sp.Lt):
            beyond = sp.Dummy(positive=True) if isinstance(r, sp.Gt | sp.Lt) else sp.Dummy(nonnegative=True)
            if r.gts.is_Symbol:
                found.setdefault(r.gts, []).append(r.lts + beyond)
            if r.lts.is_Symbol:
                found.setdefault(r.lts, []).append(r.gts - beyond)
    return [dict(zip(found, choice, strict=True)) for choice in product(*found.values())]


def above(expr: sp.Expr) -> sp.Basic:
    """Return ``expr > 0``, unevaluated where SymPy would refuse to compare a number that it takes to be complex."""
    return sp.StrictGreaterThan(expr, 0, evaluate=not expr.has(sp.I) and expr.is_extended_real is not False)


@lru_cache(maxsize=1024)
def _vanishes(factor, assumptions):
    """Tell whether a factor may be 0: its symbols and the assumptions do not exclude it."""
    if factor.has(sp.I):
        return True
    if parts := _root_parts(factor):
        return _vanishes(parts[-1], assumptions)
    facts = sp.And.make_args(assumptions)
    return not any(above(f) in facts or _relation(f, assumptions) == sp.true or _is_known(f, facts, strict=True)
                   for f in (factor, -factor))


def _relation(expr, assumptions):
    """Return ``expr > 0``, or True or False where this follows from the assumptions, with symbols and inverses real."""
    unknown = (*expr.free_symbols, *expr.atoms(InverseTrigonometricFunction, sp.erfinv, sp.erfcinv))
    real = {part: sp.Dummy(real=True) for part in unknown if part.is_real is None}
    known = sp.sympify(with_known_lambert(expr.subs(real)) > 0, strict=True)
    return known if known in (sp.true, sp.false) else reduce_under(above(expr), assumptions)


def with_known_lambert(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` with a symbol of its sign for each value of Lambert's W: the lower branch is below -1 where real.

    SymPy knows no sign of the upper one, and takes real values of the lower one to be complex.
    """
    found = expr.atoms(sp.LambertW)
    below = {w for w in found if len(w.args) == 2 or w.args[0].is_negative}
    signs = {w: sp.Dummy(negative=True) for w in below} | \
            {w: sp.Dummy(positive=True) for w in found - below if w.args[0].is_positive}
    return expr.xreplace(signs)
