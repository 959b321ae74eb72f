"""The poles of the rates of a mode: divisors that the motion may bring to 0, and by which the rates then grow.

A divisor e is no pole where all rates have a limit as e -> 0, as sin(x)/x has, and the x/(exp(x) - 1) of ion channels.
With q for 1/e, a rate is a polynomial sum c_k q^k. It has a limit at a simple zero of e if every c_k vanishes there
together with its first k - 1 derivatives, and its k-th one is finite: sqrt(1 - x^2)/(1 - x) has none.
"""

import math
from collections.abc import Iterable

import sympy as sp

from asympk.formulas import NOT_FINITE
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import atoms, expanded, replaced, symbols_in


def poles_of(rates: tuple[sp.Expr, ...], moving: set[sp.Symbol]) -> tuple[sp.Expr, ...]:
    """Return the divisors of the ``rates`` that vary with the symbols ``moving`` and whose zeros are poles."""
    powers = {power.base for rate in rates for power in _divided(rate)}
    others = {sp.cos(e.args[0]) for rate in rates for e in atoms(rate, sp.tan)}
    others |= {pivot for rate in rates for form in atoms(rate, InverseForm) for pivot in form.pivots}
    found = {e for e in _varying(powers, moving) if not _has_limits(rates, e, moving)} | _varying(others, moving)
    return tuple(sorted((e for e in found if not e.is_nonzero), key=sp.default_sort_key))


def _divided(rate: sp.Expr) -> list[sp.Pow]:
    return [power for power in atoms(rate, sp.Pow) if power.exp.is_negative]


def _varying(factors: Iterable[sp.Expr], moving: set[sp.Symbol]) -> set[sp.Expr]:
    """Return the factors that contain a symbol of ``moving``, each of e and -e as one."""
    return {-e if e.could_extract_minus_sign() else e for e in factors if symbols_in(e) & moving}


def _has_limits(rates: tuple[sp.Expr, ...], divisor: sp.Expr, moving: set[sp.Symbol]) -> bool:
    """Tell whether all rates are known to have a limit where a divisor vanishes."""
    zero = _simple_zero(divisor, moving)
    return zero is not None and all(_has_limit(rate, divisor, *zero) for rate in rates)


def _simple_zero(divisor: sp.Expr, moving: set[sp.Symbol]) -> tuple[sp.Symbol, sp.Expr] | None:
    """Return a symbol and its value where a divisor a s + b or a exp(b s + c) + d vanishes, or None for another one."""
    for s in sorted(symbols_in(divisor) & moving, key=str):
        if (place := _root(divisor, s)) is not None:
            return s, place
        powers = [part for part in atoms(divisor, sp.exp) if part.has(s)]
        if len(powers) == 1:
            part, whole = sp.Dummy(positive=True), powers[0]
            value = _root(divisor.xreplace({whole: part}), part)
            if value is not None and value.is_positive and not value.has(s):
                return None if (place := _root(whole.exp - sp.log(value), s)) is None else (s, place)
    return None


def _root(expr: sp.Expr, s: sp.Symbol) -> sp.Expr | None:
    """Return where an expression a s + b vanishes, or None for another one."""
    slope = expr.diff(s)
    return None if slope == 0 or slope.has(s) else -expr.subs(s, 0) / slope


def _has_limit(rate: sp.Expr, divisor: sp.Expr, s: sp.Symbol, place: sp.Expr) -> bool:
    """Tell whether a rate is known to have a limit where ``s`` is at the ``place`` of the simple zero of a divisor."""
    powers = [power for power in _divided(rate) if power.base in (divisor, -divisor)]
    if not all(power.exp.is_Integer for power in powers):
        return False
    q = sp.Dummy()
    signs = {power: 1 if power.base == divisor else (-1) ** int(power.exp) for power in powers}
    told = replaced(rate, {power: signs[power] * q ** -power.exp for power in powers})
    if not told.is_polynomial(q):
        return False
    degree = max((-int(power.exp) for power in powers), default=0)
    terms = [told.diff(q, k).subs(q, 0) / math.factorial(k) for k in range(degree + 1)]
    return all(_vanishes(term, k, s, place) for k, term in enumerate(terms))


def _vanishes(term: sp.Expr, order: int, s: sp.Symbol, place: sp.Expr) -> bool:
    """Tell whether a term is known to vanish at a place like a power of this order: the next derivative is finite."""
    below = (term.diff(s, j).subs(s, place) for j in range(order))
    return all(expanded(value) == 0 for value in below) and not term.diff(s, order).subs(s, place).has(*NOT_FINITE)
