"""Conditions on parameters, reduced under the assumptions on these (sigma > -2, mu > 0, ...)."""

from collections.abc import Iterator
from functools import lru_cache

import sympy as sp
from sympy.solvers.inequalities import reduce_rational_inequalities

from asympk.symbolic.long import DEGREE, is_longer

SHORT = 16  # operations in a condition that SymPy solves though its coefficients are not rational
_ANYTHING = sp.Dummy(real=True)  # replaces a symbol whose own assumptions would exclude a part of the real line


@lru_cache(maxsize=1024)
def reduce_under(condition: sp.Basic, assumptions: sp.Basic) -> sp.Basic:
    """Simplify a conjunction of conditions, solving those rational in one parameter within its assumed range.

    A condition whose ends would be roots of cubics, or of polynomials of a higher degree, stays as it is.

    >>> sigma, mu = sp.symbols("sigma mu", real=True)
    >>> reduce_under(sp.And(sigma + 4 > 0, -sigma < 0, mu < sigma), sigma > -2)
    (sigma > 0) & (mu < sigma)
    """
    kept: list[sp.Basic] = []
    by_parameter: dict[sp.Symbol, list[sp.Basic]] = {}
    for relation in sp.And.make_args(sp.sympify(condition, strict=True)):
        symbols = tuple(relation.free_symbols)
        if len(symbols) == 1 and _is_rational(relation):
            by_parameter.setdefault(symbols[0], []).append(relation)
        else:
            kept.append(relation)
    reduced = [_within(parameter, relations, assumptions) for parameter, relations in by_parameter.items()]
    return sp.And(*kept, *reduced)


def with_implied_bounds(assumptions: sp.Basic) -> sp.Basic:
    """Return ``assumptions`` with the bounds on single parameters that follow from relations a >= b between two.

    >>> a, b = sp.symbols("a b", real=True)
    >>> with_implied_bounds(sp.And(b > -2, a >= b))
    (a >= b) & (a > -2) & (b > -2)
    """
    found = []
    for relation in sp.And.make_args(assumptions):
        if isinstance(relation, sp.Ge | sp.Gt | sp.Le | sp.Lt) and relation.gts.is_Symbol and relation.lts.is_Symbol:
            above, below = (assumed_range(s, assumptions) for s in (relation.lts, relation.gts))
            strict = isinstance(relation, sp.Gt | sp.Lt)
            found.append(as_bound(relation.gts, sp.Interval(above.inf, sp.oo, strict or above.inf not in above)))
            found.append(as_bound(relation.lts, sp.Interval(-sp.oo, below.sup, True, strict or below.sup not in below)))
    return sp.And(assumptions, *found)


@lru_cache(maxsize=256)
def assumed_range(parameter: sp.Symbol, assumptions: sp.Basic) -> sp.Set:
    """Return the set of values of ``parameter`` that the rational assumptions on ``parameter`` alone allow."""
    alone = [a for a in sp.And.make_args(assumptions) if a.free_symbols == {parameter} and _is_rational(a)]
    solved = [a for a in alone if not _solutions([a], parameter).has(sp.ConditionSet)]
    return sp.Intersection(_declared(parameter), _solutions(solved, parameter))


def points_in(values: sp.Set) -> Iterator[sp.Expr]:
    """Yield the points of a set of reals that stand alone, and one point inside each of its intervals."""
    for part in values.args if isinstance(values, sp.Union) else (values,):
        if isinstance(part, sp.FiniteSet):
            yield from part
        elif isinstance(part, sp.Interval):
            start, end = part.start, part.end
            outer = sp.Min(end - 1, 0) if start.is_infinite else start + 1
            yield outer if start.is_infinite or end.is_infinite else (start + end) / 2


def declared_sign(symbol: sp.Symbol) -> int:
    """Return 1 or -1 for a symbol that is declared not to be negative or not to be positive, else 0."""
    return 1 if symbol.is_nonnegative else -1 if symbol.is_nonpositive else 0


def _declared(parameter):
    """Return the set of values that the symbol's own assumptions allow."""
    if not (sign := declared_sign(parameter)):
        return sp.S.Reals
    return sp.Interval(*((0, sp.oo) if sign > 0 else (-sp.oo, 0)), *[bool(parameter.is_nonzero)] * 2)


def _within(parameter, relations, assumptions):
    allowed = assumed_range(parameter, assumptions)
    try:
        found = _solutions(relations, parameter)
    except TypeError:  # SymPy cannot compare ends such as 2**(sqrt(3)/9)
        return sp.And(*relations)
    if found.has(sp.ConditionSet):
        return sp.And(*(_throughout(relation, parameter, allowed) for relation in relations))
    if allowed.is_subset(found):
        return sp.true
    both = found & allowed
    if both is sp.S.EmptySet:
        return sp.false
    holes = allowed - both
    if holes.is_FiniteSet:
        return sp.And(*(sp.Ne(parameter, hole) for hole in holes))
    return sp.Or(*(as_bound(parameter, span) for span in sp.Union.make_args(both)))


def _throughout(relation, parameter, allowed):
    """Return the truth of a relation between rational functions that have no root or pole in a range, else itself."""
    if not (isinstance(relation, sp.Rel) and isinstance(allowed, sp.Interval)):
        return relation
    ends = [None if end.is_infinite else end for end in (allowed.start, allowed.end)]
    parts = [sp.Poly(part, parameter) for part in sp.fraction(sp.together(relation.lhs - relation.rhs))]
    if any(not (part.domain.is_ZZ or part.domain.is_QQ) or part.count_roots(*ends) for part in parts):
        return relation
    return relation.subs(parameter, next(points_in(allowed)))


def as_bound(parameter: sp.Symbol, span: sp.Set) -> sp.Basic:
    """Write an interval or a single point as a relation, the parameter on the left: ``sigma > -1``."""
    if span.is_FiniteSet:
        return sp.Or(*(sp.Eq(parameter, point) for point in span))
    above = sp.Gt if span.left_open else sp.Ge
    below = sp.Lt if span.right_open else sp.Le
    sides = [above(parameter, span.start)] if span.start.is_finite else []
    sides += [below(parameter, span.end)] if span.end.is_finite else []
    return sp.And(*sides)


def _is_rational(condition):
    """Tell whether every relation in a condition is between rational functions."""
    return all(side.is_rational_function() for relation in condition.atoms(sp.Rel) for side in relation.args)


def _solutions(conditions, parameter):
    """Return the set of reals on which all of the conditions hold."""
    return sp.Intersection(sp.S.Reals, *(_solution(c.subs(parameter, _ANYTHING)) for c in conditions))


@lru_cache(maxsize=1024)
def _solution(condition):
    if isinstance(condition, sp.Not):
        return sp.S.Reals - _solution(condition.args[0])
    if isinstance(condition, sp.And | sp.Or):
        join = sp.Intersection if isinstance(condition, sp.And) else sp.Union
        return join(*map(_solution, condition.args))
    if isinstance(condition, sp.Rel):
        parts = [sp.Poly(part, _ANYTHING) for part in sp.fraction(sp.together(condition.lhs - condition.rhs))]
        exact = all(part.domain.is_ZZ or part.domain.is_QQ for part in parts)
        if not (_has_short_roots(parts) if exact else _is_short(condition, parts)):
            return sp.ConditionSet(_ANYTHING, condition, sp.S.Reals)
        if exact:
            return reduce_rational_inequalities([[condition]], _ANYTHING, relational=False)
    return sp.solveset(condition, _ANYTHING, sp.S.Reals)


def _is_short(condition, parts):
    """Tell whether SymPy solves a condition with other coefficients, as sin(1) and sqrt(2), in about a second."""
    return max(part.degree() for part in parts) <= 2 and not is_longer(condition, SHORT)


def _has_short_roots(parts):
    """Tell whether all real roots of polynomials with rational coefficients are rational or roots of quadratics."""
    simple = [factor for part in parts if part for factor, _ in part.sqf_list()[1]]
    listed = ([(p, 1)] if p.degree() > DEGREE else p.factor_list()[1] for p in simple)
    factors = [factor for factors in listed for factor, _ in factors]
    return all(factor.degree() <= 2 or factor.count_roots() == 0 for factor in factors)
