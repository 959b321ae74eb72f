"""Conditions on parameters, reduced under what is assumed of them (sigma > -2, mu > 0, ...)."""

import sympy as sp


def reduce_under(condition, assumptions):
    """Simplify a conjunction of relations, solving those in one parameter within that parameter's assumed range.

    >>> sigma, mu = sp.symbols("sigma mu", real=True)
    >>> reduce_under(sp.And(sigma + 4 > 0, -sigma < 0, mu < sigma), sigma > -2)
    (sigma > 0) & (mu < sigma)
    """
    kept, by_parameter = [], {}
    for relation in sp.And.make_args(sp.sympify(condition, strict=True)):
        symbols = relation.free_symbols
        if len(symbols) == 1:
            by_parameter.setdefault(*symbols, []).append(relation)
        else:
            kept.append(relation)
    reduced = [_within(parameter, relations, assumptions) for parameter, relations in by_parameter.items()]
    return sp.And(*kept, *reduced)


def assumed_range(parameter, assumptions):
    """Return the set of reals that the assumptions, those that name only ``parameter``, leave to it."""
    alone = [a for a in sp.And.make_args(assumptions) if a.free_symbols == {parameter}]
    positive = [parameter > 0] if parameter.is_positive else []
    return _solutions(alone + positive, parameter)


def _within(parameter, relations, assumptions):
    allowed = assumed_range(parameter, assumptions)
    found = _solutions(relations, parameter)
    if found.has(sp.ConditionSet):
        return sp.And(*relations)
    if allowed.is_subset(found):
        return sp.true
    both = found & allowed
    if both is sp.S.EmptySet:
        return sp.false
    holes = allowed - both
    if holes.is_FiniteSet:
        return sp.And(*(sp.Ne(parameter, hole) for hole in holes))
    return sp.Or(*(between(parameter, span) for span in sp.Union.make_args(both)))


def between(parameter, span):
    """Write an interval or a single point as a relation, the parameter on the left: ``sigma > -1``."""
    if span.is_FiniteSet:
        return sp.Or(*(sp.Eq(parameter, point) for point in span))
    above = sp.Gt if span.left_open else sp.Ge
    below = sp.Lt if span.right_open else sp.Le
    sides = [above(parameter, span.start)] if span.start.is_finite else []
    sides += [below(parameter, span.end)] if span.end.is_finite else []
    return sp.And(*sides)


def _solutions(relations, parameter):
    anything = sp.Dummy(real=True)  # a Symbol assumed positive would hide the negative half of the line
    sets = [sp.solveset(r.subs(parameter, anything), anything, sp.S.Reals) for r in relations]
    return sp.Intersection(sp.S.Reals, *sets)
