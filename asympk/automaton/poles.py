r"""The poles of the rates of a mode: divisors that the motion may bring to 0, and by which the rates then grow.

A divisor is no pole where all rates have a limit as it vanishes, as sin(x)/x has, and the x/(exp(x) - 1) of ion
channels. Near its zero s = p every divisor that vanishes there is (s - p)^m times a factor with a Taylor series, so
that a rate is a polynomial sum c_k q^k in q = 1/(s - p). The rate has a limit if

    sum over k >= d of c_k^(k - d)(p) / (k - d)! = 0,    d = 1, 2, ...,

and the k-th derivative of every c_k is finite at p: sqrt(1 - x^2)/(1 - x) has none.
"""

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import chain, islice

import sympy as sp

from asympk.formulas import NOT_FINITE
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import atoms, expanded, is_clearly_nonzero, replaced, symbols_in
from asympk.symbolic.removable import MOST

Zero = tuple[sp.Symbol, sp.Expr]  # a symbol, and its value where a divisor vanishes
_TURN = sp.Dummy("k", integer=True)
_PARTS, _OFTEN = 30_000, 100  # of a divisor, and how often symbols that move occur in it, where its limits take no time
_ZEROS = {sp.sin: sp.pi * _TURN, sp.cos: sp.pi * (_TURN + sp.Rational(1, 2)), sp.log: sp.S.One} | dict.fromkeys(
    (sp.sinh, sp.tanh, sp.asin, sp.atan), sp.S.Zero
)
_QUOTIENTS = {
    sp.tan: lambda a: sp.sin(a) / sp.cos(a), sp.cot: lambda a: sp.cos(a) / sp.sin(a), sp.sec: lambda a: 1 / sp.cos(a),
    sp.csc: lambda a: 1 / sp.sin(a), sp.coth: lambda a: sp.cosh(a) / sp.sinh(a), sp.csch: lambda a: 1 / sp.sinh(a),
}


def divisors_of(rates: tuple[sp.Expr, ...], moving: set[sp.Symbol]) -> dict[sp.Expr, sp.Expr]:
    """Return {divisor: what vanishes at its poles} of the divisors of ``rates`` that vary with the symbols ``moving``.

    For a divisor with limits everywhere this is 1. For one with poles at other zeros than that of its argument, as of
    x/sin(x), it is the divisor by the argument; for x^2/(1 - cos(x)) it is sin(x/2)/(x/2), and y for
    (x - 1)/(x y - y).
    """
    rates = tuple(map(_in_quotients, rates))
    powers = {power.base for rate in rates for power in _divided(rate)}
    others = {pivot for rate in rates for form in atoms(rate, InverseForm) for pivot in form.pivots}
    found = {e: _at_poles(rates, e, moving) for e in _varying(powers, moving)}
    return found | {e: e for e in _varying(others, moving)}


def largest_power(rates: tuple[sp.Expr, ...], divisor: sp.Expr) -> sp.Expr:
    """Return the largest power of a divisor by which ``rates`` are divided, or its square, as slopes divide by that."""
    powers = (power for rate in rates for power in _divided(_in_quotients(rate)))
    return divisor ** max(2, *(-power.exp for power in powers if power.base in (divisor, -divisor)))


def as_quotient(divisor: sp.Expr) -> sp.Expr:
    """Return a divisor as a user writes it, with sin(a)/a for sinc(a)."""
    return replaced(divisor, {e: sp.sin(*e.args) / e.args[0] for e in atoms(divisor, sp.sinc)})


def _in_quotients(rate: sp.Expr) -> sp.Expr:
    """Return a rate with tan(a) as sin(a)/cos(a), and with the like of others that have poles of their own."""
    return replaced(rate, {e: _QUOTIENTS[e.func](*e.args) for e in atoms(rate, *_QUOTIENTS)})


def _divided(rate: sp.Expr) -> list[sp.Pow]:
    return [power for power in atoms(rate, sp.Pow) if power.exp.is_negative]


def _varying(factors: Iterable[sp.Expr], moving: set[sp.Symbol]) -> set[sp.Expr]:
    """Return the factors that contain a symbol of ``moving``, each of e and -e as one."""
    return {-e if e.could_extract_minus_sign() else e for e in factors if symbols_in(e) & moving}


def _at_poles(rates: tuple[sp.Expr, ...], divisor: sp.Expr, moving: set[sp.Symbol]) -> sp.Expr:
    """Return what vanishes where a divisor does and a rate has no known limit: 1 if all have limits everywhere.

    Of a divisor in which much moves no limits are looked for, as its derivatives would be too long.
    """
    parts = [*islice(sp.preorder_traversal(divisor), _PARTS)]
    long = len(parts) == _PARTS or sum(part in moving for part in parts) > _OFTEN
    zero = None if long else next(_simple_zeros(divisor, moving), None)
    if zero is None:
        return divisor
    s, place = zero
    rates = tuple(sorted(rates, key=lambda rate: not rate.has(divisor)))  # most have a limit, and these may have none
    first = place.subs(_TURN, 0)
    wave = _wave_to_one(divisor, s)
    if all(_has_limit(rate, s, place) for rate in rates):
        pole = sp.S.One
    elif (divisor.func is sp.sin or wave) and all(_has_limit(rate, s, first) for rate in rates):
        pole = sp.sinc(wave.args[0] / 2 if wave else divisor.args[0])  # 1 - cos(a) = 2 sin(a/2)^2
    else:
        return divisor
    rest = divisor.diff(s, _order(divisor, s, first)).subs(s, first)  # x y - y vanishes at x = 1, and where y does
    return pole * _at_poles(rates, rest, moving) if symbols_in(rest) & moving else pole


def _wave_to_one(divisor: sp.Expr, s: sp.Symbol) -> sp.Expr | None:
    """Return the cosine of a divisor b (1 - cos(a)), or None for another one."""
    waves = [wave for wave in atoms(divisor, sp.cos) if wave.has(s)]
    return waves[0] if len(waves) == 1 and _value_at_zeros(divisor, waves[0], s) == 1 else None


def _value_at_zeros(divisor: sp.Expr, whole: sp.Expr, s: sp.Symbol) -> sp.Expr | None:
    """Return the value v of the part ``whole`` of a divisor b (whole - v) without ``s`` in b and v, or None."""
    part = sp.Dummy(positive=True)
    linear = divisor.xreplace({whole: part})
    return None if linear.has(s) else _root(linear, part)


def _simple_zeros(divisor: sp.Expr, moving: set[sp.Symbol]) -> Iterator[Zero]:
    """Yield symbols and their values where a divisor of a known kind vanishes, as a s + b or sin(a s + b) does."""
    for s in sorted(symbols_in(divisor) & moving, key=str):
        if (place := _root(divisor, s)) is not None:
            yield s, place
            continue
        powers = [part for part in atoms(divisor, sp.exp) if part.has(s)]
        place = None
        if len(powers) == 1:
            value = _value_at_zeros(divisor, powers[0], s)
            if value is not None and value.is_positive:
                place = _root(powers[0].exp - sp.log(value), s)
        elif wave := _wave_to_one(divisor, s):
            place = _root(wave.args[0] - 2 * sp.pi * _TURN, s)
        elif divisor.func in _ZEROS:
            place = _root(divisor.args[0] - _ZEROS[divisor.func], s)
        if place is not None:
            yield s, place


def _root(expr: sp.Expr, s: sp.Symbol) -> sp.Expr | None:
    """Return where an expression a s + b vanishes, or None for another one."""
    slope = expr.diff(s)
    return None if slope == 0 or slope.has(s) else -expr.subs(s, 0) / slope


@lru_cache(maxsize=4096)  # the modes of a system share most rates
def _has_limit(rate: sp.Expr, s: sp.Symbol, place: sp.Expr) -> bool:
    """Tell whether a rate is known to have a limit where ``s`` is at the ``place`` of a zero of a divisor."""
    powers = [power for power in _divided(rate) if s in symbols_in(power)]
    orders = {base: _order(base, s, place) for base in {power.base for power in powers}}
    powers = [power for power in powers if orders[power.base] != 0]
    if not all(power.exp.is_Integer and orders[power.base] <= MOST for power in powers):
        return False
    q = sp.Dummy()
    factors = {power.base: sp.Dummy() for power in powers}
    in_q = replaced(rate, {p: (factors[p.base] * q ** orders[p.base]) ** -p.exp for p in powers})
    degree = _degree(in_q, q) if in_q.is_polynomial(q) else MOST + 1
    if degree > MOST:
        return False
    terms = [in_q.diff(q, k).subs(q, 0) / math.factorial(k) for k in range(degree + 1)]
    units = {factor: _unit(base, orders[base], s, place, degree) for base, factor in factors.items()}
    return _cancel([replaced(term, units) for term in terms], s, place)


def _order(expr: sp.Expr, s: sp.Symbol, place: sp.Expr) -> int:
    """Return the order of the zero of an expression at a place, or one beyond ``MOST`` if that is not clear."""
    for order in range(MOST + 1):
        if (value := expanded(expr.diff(s, order).subs(s, place))) != 0:
            turns = [value.subs(_TURN, k) for k in range(MOST)] if value.has(_TURN) else [value]
            return order if all(turn.is_zero is False or is_clearly_nonzero(turn) for turn in turns) else MOST + 1
    return MOST + 1


def _degree(expr: sp.Expr, q: sp.Symbol) -> int:
    """Return a bound on the degree of a polynomial in ``q`` that is not expanded."""
    if expr.is_Pow and expr.exp.is_Integer:
        return int(expr.exp) * _degree(expr.base, q) if expr.exp > 0 else 0
    if expr.is_Add or expr.is_Mul:
        return (max if expr.is_Add else sum)(_degree(part, q) for part in expr.args)
    return int(expr == q)


def _unit(expr: sp.Expr, order: int, s: sp.Symbol, place: sp.Expr, degree: int) -> sp.Expr:
    """Return the Taylor polynomial of (s - place)^order/expr at a zero of this order."""
    known = [expr.diff(s, order + k).subs(s, place) / math.factorial(order + k) for k in range(degree + 1)]
    found = [1 / known[0]]
    for n in range(1, degree + 1):
        found.append(-sum(known[k] * found[n - k] for k in range(1, n + 1)) / known[0])
    return sp.Add(*(part * (s - place) ** k for k, part in enumerate(found)))


def _cancel(terms: list[sp.Expr], s: sp.Symbol, place: sp.Expr) -> bool:
    """Tell whether the sum of terms, each divided by its power of s - place, is known to have a limit there."""
    parts = [[term.diff(s, j).subs(s, place) / math.factorial(j) for j in range(k + 1)] for k, term in enumerate(terms)]
    if sp.Tuple(*chain(*parts)).has(*NOT_FINITE):
        return False
    sums = (sp.Add(*(part[k - d] for k, part in enumerate(parts) if k >= d)) for d in range(1, len(parts)))
    return all(expanded(total) == 0 for total in sums)
