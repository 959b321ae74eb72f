r"""Signs of expressions under assumptions: conditions that keep only the factors whose sign is open.

A sign is told by the symbols' own assumptions, then by the range of a single parameter, then by bounds: with a >= b and
b > -1 the sum a + b + 2 is positive. ``conjunction`` joins several signs; a factor that one of them fixes is known in
the next, so that no condition contradicts itself.
"""

from functools import lru_cache
from itertools import product

import sympy as sp

from asympk.symbolic.conditions import reduce_under


def positive(expr: sp.Expr, assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which ``expr``, which is not 0, is positive; factors of known sign are left out.

    Symbols are taken as real, and so is ``expr``; a root of something is then positive.
    """
    if expr.has(sp.I):
        return _above(expr)
    content, factors = factored(expr)
    rest = sp.sign(content)
    for factor, power in factors:
        if power % 2 == 1:
            rest *= known_sign(factor, assumptions) or factor
    return _relation(rest, assumptions)


def nonzero(expr: sp.Expr, assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which ``expr`` is not 0, factors that never vanish left out."""
    if expr.has(sp.I) or expr == 0:
        return sp.Ne(expr, 0)
    factors = [f for f, _ in factored(expr)[1] if not _never_zero(f, assumptions)]
    return sp.And(*(_reduced(sp.Ne(f, 0), assumptions) for f in factors))


def conjunction(signs: list[tuple[sp.Expr, int]], assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which every expression has the sign (1, -1 or 0) beside it; False if never.

    >>> a, b = sp.symbols("a b", real=True)
    >>> conjunction([(a * b, 1), (a, -1)]), conjunction([(a + b, 1), (-a - b, 1)])
    ((a < 0) & (b < 0), False)
    """
    known: dict[sp.Expr, int] = {}
    conditions = []
    for expr, sign in sorted(signs, key=lambda pair: len(factored(pair[0])[1])):
        rest, unknown = _apart(expr, known, assumptions, even=sign == 0)
        if not unknown:
            if rest != sign:
                return sp.false
            continue
        if len(unknown) == 1:
            known[unknown[0]] = sign * rest
        left = sp.Mul(*unknown)
        conditions.append(sp.Eq(left, 0) if sign == 0 else _above(sign * rest * left))
    return reduce_under(sp.And(*conditions), assumptions)


@lru_cache(maxsize=1024)
def factored(expr: sp.Expr) -> tuple[sp.Expr, list[tuple[sp.Expr, int]]]:
    """Return the content and the factors, with powers, of numerator times denominator: a product of the same sign."""
    if expr.has(sp.I):
        return sp.S.One, [(expr, 1)]
    numerator, denominator = sp.fraction(sp.together(expr))
    return sp.factor_list(numerator * denominator)


@lru_cache(maxsize=1024)
def known_sign(expr: sp.Expr, assumptions: sp.Basic) -> int:
    """Return 1 or -1 where that is the sign of ``expr``, unless it is 0, for all real symbols; 0 where it is open."""
    if expr.has(sp.I):
        return 0
    if known := {sp.true: 1, sp.false: -1}.get(_relation(expr, assumptions)):
        return known
    facts = sp.And.make_args(assumptions)
    return next((sign for sign in (1, -1) if _is_known(sign * expr, facts)), 0)


def follows(relation: sp.Basic, facts: tuple[sp.Basic, ...]) -> bool:
    """Tell whether an inequality follows from bounds on single symbols among ``facts``, put in one for another."""
    if not isinstance(relation, sp.Gt | sp.Lt | sp.Ge | sp.Le):
        return False
    return _is_known(relation.gts - relation.lts, facts)


def _is_known(difference, facts):
    """Tell whether ``difference`` is positive by some choice of one bound for each symbol."""
    for bounds in _bounds(facts):
        moved = difference
        for _ in bounds:  # a bound may name another symbol that has one
            moved = moved.subs(bounds)
        if sp.factor(moved).is_positive:
            return True
    return False


def _bounds(relations):
    """Yield choices of one bound for each symbol, as ``{symbol: bound +- something positive}``."""
    found = {}
    for r in relations:
        if isinstance(r, sp.Ge | sp.Gt | sp.Le | sp.Lt) and r.gts.is_Symbol:
            found.setdefault(r.gts, []).append(r.lts + sp.Dummy(positive=True))
        if isinstance(r, sp.Ge | sp.Gt | sp.Le | sp.Lt) and r.lts.is_Symbol:
            found.setdefault(r.lts, []).append(r.gts - sp.Dummy(positive=True))
    for choice in product(*found.values()):
        yield dict(zip(found, choice, strict=True))


def _above(expr):
    """Return ``expr > 0``; SymPy does not compare what may be complex."""
    return sp.StrictGreaterThan(expr, 0, evaluate=False) if expr.has(sp.I) else expr > 0


def _never_zero(factor, assumptions):
    facts = sp.And.make_args(assumptions)
    signs = (factor, -factor)
    return any(_relation(f, assumptions) == sp.true for f in signs) or any(_is_known(f, facts) for f in signs)


def _apart(expr, known, assumptions, even):
    """Return the product of the known signs of the factors of ``expr``, and the others, squares only if ``even``."""
    content, factors = factored(expr)
    rest, unknown = int(sp.sign(content)), []
    for factor, power in factors:
        sign = known.get(factor, known_sign(factor, assumptions))
        if sign or factor in known:
            rest *= sign**power
        elif even or power % 2 == 1:
            unknown.append(factor)
    return rest, unknown


def _relation(expr, assumptions):
    """Return ``expr > 0``, True or False where that follows from the symbols being real and the assumptions."""
    real = {s: sp.Dummy(real=True) for s in expr.free_symbols if s.is_real is None}
    known = sp.sympify(expr.subs(real) > 0, strict=True)
    return known if known in (sp.true, sp.false) else _reduced(expr > 0, assumptions)


def _reduced(relation, assumptions):
    """Solve a rational relation in one symbol within its assumed range; leave any other as it is."""
    if len(relation.free_symbols) == 1 and all(side.is_rational_function() for side in relation.args):
        return reduce_under(relation, assumptions)
    return relation
