"""Coefficients: the largest parts of expressions in the parameters alone that contain a sum, such as (1 - cos(p))/p**2.

A sum may cancel, in doubles without a trace, and so may the turns of a large angle, as in sin(exp(p)). A coefficient
therefore gets a name, under which its value, computed once with enough digits, enters the rates. Models, which expand
in powers of the small parameter, take only those without it. Modes are expanded, and then have a x - b x for (a - b) x:
such coefficients, ``scattered`` over a sum, get a name where they cancel.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from functools import lru_cache

import sympy as sp

from asympk.symbolic.long import atoms, heavy, replaced
from asympk.symbolic.system import System

_OF_ANGLES = sp.sin, sp.cos, sp.tan


@lru_cache(maxsize=256)
def coefficients_of(system: System) -> tuple[sp.Expr, ...]:
    """Return the coefficients in the rates and the frictions of a system."""
    found: dict[sp.Expr, None] = {}
    for fixed in _fixed(system):
        _each(sp.Tuple(*system.expressions), fixed, lambda part: found.setdefault(part) or part)
    return tuple(found)


def with_names(system: System, exprs: Sequence[sp.Expr], known: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return expressions with the names of the coefficients ``known``.

    A scattered coefficient may have one of the system for a term, and one of the system may be scattered, too: those
    that are no coefficients of the system get their names first, and all that are still scattered last.
    """
    names, whole = {part: name_of(part) for part in known}, {*coefficients_of(system)}
    *_, still = _fixed(system)
    named = _gathered(exprs, still, {part: name for part, name in names.items() if part not in whole})
    for fixed in _fixed(system) if names else ():
        named = _each(named, fixed, lambda part: names.get(part, part))
    return _gathered(named.args, still, names).args


def scattered(system: System, exprs: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return the coefficients of several terms in the sums of expressions, without the small parameter."""
    *_, still = _fixed(system)
    found = (sp.Add(*parts) for total in _sums(exprs) for parts in _by_motion(total, still).values())
    return tuple(sorted({part for part in found if part.is_Add}, key=sp.default_sort_key))


def _by_motion(total: sp.Add, fixed: Collection[sp.Symbol]) -> dict[sp.Expr, list[sp.Expr]]:
    """Return {moving factor: the factors of symbols in ``fixed`` before it} of the terms of a sum."""
    found: dict[sp.Expr, list[sp.Expr]] = {}
    for term in total.args:
        moving = term.free_symbols - {*fixed}
        still, factor = term.as_independent(*moving, as_Add=False) if moving else (term, sp.S.One)
        found.setdefault(factor, []).append(still)
    return found


def _gathered(exprs: Sequence[sp.Expr], fixed: Collection[sp.Symbol], names: dict[sp.Expr, sp.Symbol]) -> sp.Tuple:
    """Return expressions with names for the coefficients that are scattered over their sums."""
    named = {}
    for total in _sums(exprs) if any(part.is_Add for part in names) else ():
        parts = {factor: sp.Add(*still) for factor, still in _by_motion(total, fixed).items()}
        if any(part in names for part in parts.values()):
            named[total] = sp.Add(*(factor * names.get(part, part) for factor, part in parts.items()))
    return sp.Tuple(*(replaced(expr, named) for expr in exprs))


def _sums(exprs: Iterable[sp.Expr]) -> set[sp.Add]:
    """Return all sums in those expressions that are not too long to be expanded."""
    return set().union(*(atoms(expr, sp.Add) for expr in exprs if not heavy(expr)))


def with_few_parts(expr: sp.Expr, moving: Collection[sp.Symbol]) -> sp.Expr:
    """Return an expression with one symbol for each of its largest sums without the symbols ``moving``."""
    names: dict[sp.Expr, sp.Symbol] = {}
    still = expr.free_symbols - {*moving}
    return _each(expr, still, lambda part: names.setdefault(part, sp.Dummy(real=True)))


@lru_cache(maxsize=512)
def name_of(part: sp.Expr) -> sp.Symbol:
    """Return the symbol that stands for a coefficient."""
    return sp.Dummy(str(part), positive=True) if part.is_positive else sp.Dummy(str(part), real=True)


def _fixed(system: System) -> tuple[set[sp.Symbol], ...]:
    """Return the sets of symbols of which coefficients consist: all parameters, and all but the small one."""
    parameters = {*system.parameters}
    return (parameters, parameters - {system.small}) if system.small else (parameters,)


def _each(expr: sp.Basic, fixed: Collection[sp.Symbol], put: Callable[[sp.Expr], sp.Expr]) -> sp.Basic:
    """Return an expression with ``put(part)`` for each of its coefficients; each part is visited once."""
    seen: dict[sp.Basic, tuple[sp.Basic, bool, bool]] = {}  # part -> its new form, whether it is fixed, and has a sum

    def visited(part: sp.Basic) -> tuple[sp.Basic, bool, bool]:
        if part not in seen:
            seen[part] = parted(part) if part.args else (part, not part.is_Symbol or part in fixed, False)
        return seen[part]

    def parted(part: sp.Basic) -> tuple[sp.Basic, bool, bool]:
        args = [(arg, *visited(arg)[1:]) for arg in part.args]
        still = [arg for arg, is_fixed, _ in args if is_fixed]
        if len(still) == len(args) and isinstance(part, sp.Expr):
            turns = isinstance(part, _OF_ANGLES) and bool(atoms(part.args[0], sp.Function, sp.Pow))
            return part, True, part.is_Add or turns or any(has_sum for *_, has_sum in args)
        if part.is_Add or part.is_Mul:
            joined = part.func(*still)
            args = [(joined, True, visited(joined)[2]), *(a for a in args if not a[1])] if len(still) > 1 else args
        new = [put(arg) if is_fixed and has_sum else visited(arg)[0] for arg, is_fixed, has_sum in args]
        return (part.func(*new) if new != [*part.args] else part), False, False

    return visited(expr)[0]
