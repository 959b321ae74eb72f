r"""Taylor arithmetic in two variables, mu and t: expressions of series, on a tape or in numbers.

A ``Taylor`` is sum c_kj mu^k t^j, k + j <= degree. Coefficients are whole numbers, fractions, and either numbers or
nodes of a ``Tape``, on which every computation becomes straight-line code. A function phi of a series is evaluated by
its derivatives, phi(u_0 + w) = sum phi^(i)(u_0) w^i / i!  (Griewank and Walther, Evaluating Derivatives, chapter 13).
``evaluated`` is the entry, and ``_computed`` treats each kind of expression. A quotient such as u/(exp(u) - 1), which
is 0/0 where u = 0 and loses digits beside it, is evaluated there by its series, if it is made a ``Removable`` before.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial, reduce
from math import factorial, inf, perm
from operator import add, mul
from typing import Any, Self

import sympy as sp

from asympk.errors import InputError
from asympk.formulas import NOT_FINITE
from asympk.symbolic.inverses import in_order, without_inverses
from asympk.symbolic.long import atoms, is_longer
from asympk.symbolic.penetration import Penetration

FUNCTIONS = ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "asin", "acos", "atan", "asinh", "acosh",
             "atanh", "sqrt", "erf", "atan2")
CONSTANTS = (sp.pi, sp.E, sp.GoldenRatio, sp.TribonacciConstant, sp.EulerGamma, sp.Catalan)
_QUOTIENTS = {
    sp.sec: lambda a: 1 / sp.cos(a), sp.csc: lambda a: 1 / sp.sin(a), sp.cot: lambda a: sp.cos(a) / sp.sin(a),
    sp.sech: lambda a: 1 / sp.cosh(a), sp.csch: lambda a: 1 / sp.sinh(a), sp.coth: lambda a: 1 / sp.tanh(a),
}
_TANGENTS = {sp.tan: lambda a: sp.sin(a) / sp.cos(a), sp.tanh: lambda a: sp.sinh(a) / sp.cosh(a)}  # long derivatives
U = sp.Symbol("u", positive=True)
V = sp.Dummy("u", real=True)
A, B = sp.symbols("a b", real=True)
CHOICES: dict[str, Callable[..., Any]] = {  # between a quotient and its series, which stands for it where |u| < end
    "outside": lambda u, end: end if abs(u) < end else u,
    "chosen": lambda u, end, inside, outside: inside if abs(u) < end else outside,
}
LONGEST, HIGHEST_ZERO = 60, 6  # operations of a quotient that is looked at for 0/0, and the order of the zeros
DIGITS = 60  # of the coefficients of its series
DEGREE = 30  # of the polynomial that stands for a quotient beside a place where it is 0/0
WITHIN = 6  # part of the radius of convergence in which it does: it and its derivatives to order 7 are right to 1e-12


@dataclass(frozen=True)
class Polynomial:
    """A polynomial in two variables up to a ``degree``: coefficients by their two powers, and missing ones are zero."""

    terms: dict[tuple[int, int], Any]
    degree: Any = inf

    def of(self, value: Any) -> dict[tuple[int, int], Any]:
        """Return the terms of another polynomial of this class, or of a coefficient."""
        return value.terms if isinstance(value, type(self)) else {(0, 0): value}

    def __add__(self, other: Any) -> Self:
        found = dict(self.terms)
        for index, c in self.of(other).items():
            found[index] = found[index] + c if index in found else c
        return type(self)(found, self.degree)

    def __mul__(self, other: Any) -> Self:
        found: dict[tuple[int, int], Any] = {}
        for (k, j), a in self.terms.items():
            for (m, i), b in self.of(other).items():
                if k + j + m + i <= self.degree:
                    index, product = (k + m, j + i), a * b
                    found[index] = found[index] + product if index in found else product
        return type(self)({index: c for index, c in found.items() if not _is_zero(c)}, self.degree)

    __radd__, __rmul__ = __add__, __mul__


class Taylor(Polynomial):
    """A truncated series: ``terms[k, j]`` is the coefficient of mu**k t**j."""

    def __getitem__(self, index: Any) -> Any:
        return self.terms.get(index, 0)

    def cut(self, degree: int) -> "Taylor":
        """Return the series truncated to ``degree``."""
        return Taylor({index: c for index, c in self.terms.items() if sum(index) <= degree}, degree)

    def inverse(self) -> "Taylor":
        """Return 1/self."""
        first = _reciprocal(self[0, 0])
        rest = _without_first(self) * (-1 * first)
        return _geometric(rest, [1] * (self.degree + 1)) * first


class Removable(sp.Function):
    """A derivative of a quotient of functions of ``V`` that is 0/0 at 0 and has a series there: a class for each."""

    quotient: sp.Expr
    times: int

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return the next derivative."""
        return _removable(self.quotient, self.times + 1)(self.args[0])


@lru_cache(maxsize=256)
def _removable(quotient: sp.Expr, times: int = 0) -> Any:
    return type(f"({quotient}){times * chr(39)}", (Removable,), {"quotient": quotient, "times": times})


@lru_cache(maxsize=256)
def with_removables(expr: sp.Expr, states: tuple[sp.Symbol, ...]) -> sp.Expr:
    """Return an expression in which quotients of one argument that are 0/0 where it is 0 are ``Removable``.

    The argument is linear in one of the ``states``.
    """
    expr = _with_quotients(expr, _QUOTIENTS)
    return expr.xreplace({product: _as_removable(product, states) for product in atoms(expr, sp.Mul)})


def _with_quotients(expr, known):
    return expr.xreplace({f: known[type(f)](*f.args) for f in atoms(expr, *known)})


def _as_removable(product, states):
    """Return a product with its factors in one argument that are 0 or infinite where it is 0 as a ``Removable``.

    The product is returned if they are none. A further factor would lose digits where it is 0 itself.
    """
    divisors = [part.base for part in product.args if part.is_Pow and part.exp.is_negative and part.exp.is_Integer]
    found = {*divisors, *product.args, *(f.args[0] for f in product.atoms(sp.Function))} if divisors else set()
    pairs = [(at, s) for at in found for s in states if _is_linear(at, s)
             and any(base.free_symbols <= at.free_symbols for base in divisors)]
    for at, s in sorted(pairs, key=lambda pair: (pair[0].count_ops(), str(pair))):
        place = {s: sp.expand((V - at.subs(s, 0)) / at.diff(s))}
        inside = {part: sp.expand_mul(part.xreplace(place)) for part in product.args if not is_longer(part, LONGEST)}
        inside = {part: expr for part, expr in inside.items() if expr.subs(V, 0) == 0 or (1 / expr).subs(V, 0) == 0}
        factor, quotient = sp.Mul(*inside.values()).as_independent(V, as_Add=False)
        if quotient.free_symbols == {V} and _series(quotient):
            return sp.Mul(*(part for part in product.args if part not in inside)) * factor * _removable(quotient)(at)
    return product


def _is_linear(at, s):
    """Tell whether an argument is written as a linear function of s."""
    terms = [sp.Mul.make_args(term) for term in sp.Add.make_args(at) if term.has(s)]
    return bool(terms) and all(s in term and sum(factor.has(s) for factor in term) == 1 for term in terms)


@lru_cache(maxsize=256)
def _series(quotient: sp.Expr) -> tuple[Fraction, list[Fraction]] | None:
    """Return the distance from 0 up to which the series of a quotient stands for it, and its coefficients, or None."""
    with suppress(ArithmeticError, InputError):
        sides = sp.fraction(_with_quotients(quotient, _TANGENTS))
        if any(side.subs(V, 0) != 0 for side in sides):
            return None
        above, below = (_from_zero(side, DEGREE + HIGHEST_ZERO) for side in sides)
        first = next((j for j in range(HIGHEST_ZERO + 1) if below[0, j]), 0)
        if first and not any(above[0, j] for j in range(first)):
            above, below = (Taylor({(0, j): side[0, j + first] for j in range(DEGREE + 1)}, DEGREE)
                            for side in (above, below))
            quotients = above * below.inverse()
            found = [float(quotients[0, j]) for j in range(DEGREE + 1)]
            steepest = max(abs(c) ** (1 / j) for j, c in enumerate(found) if j > DEGREE // 2)
            return Fraction(1 / max(1.0, WITHIN * steepest)), [*map(Fraction, found)]
    return None


def _from_zero(expr, degree):
    """Return the series of a function of ``V`` at 0, whose coefficients are fractions, right to ``DIGITS`` digits."""
    return as_taylor(_evaluated(expr, {V: Taylor({(0, 1): 1}, degree)}, _Fractions()), degree)


class _Fractions:
    """Functions of fractions as fractions, where a tape writes them down."""

    def call(self, name: str, *values: Any) -> Fraction:
        return self._of(getattr(sp, name)(*map(sp.Rational, values)))

    def node(self, name: str) -> Fraction:
        return self._of(getattr(sp, name))

    def _of(self, value: sp.Expr) -> Fraction:
        if not value.is_real:
            raise InputError(f"{value} is no real number")
        return Fraction(str(value if value.is_Rational else value.evalf(DIGITS)))


def evaluated(exprs: Iterable[sp.Expr], values: dict, tape: Any) -> list:
    """Return ``exprs`` at ``values``, {symbol: Taylor, node or number}; common subexpressions are evaluated once.

    Forms through an inverse are evaluated by their eliminations.
    Calls of functions are made by ``tape``. Raises ``InputError`` for a function that has no series here.
    """
    known = dict(values)
    parts, plain = _eliminated(tuple(sp.sympify(expr, strict=True) for expr in exprs))
    for symbol, part in parts:
        known[symbol] = _evaluated(part, known, tape)
    return [_evaluated(expr, known, tape) for expr in plain]


@lru_cache(maxsize=64)
def _eliminated(exprs):
    """Return the parts of the eliminations in expressions, in order, and the expressions in terms of these."""
    entries, steps, plain, _ = without_inverses(exprs, sp.numbered_symbols(cls=sp.Dummy))
    return in_order([*entries, *steps]), plain


def _evaluated(expr, known, tape):
    if expr not in known:
        known[expr] = _computed(expr, known, tape)
    return known[expr]


def _computed(expr, values, tape):
    if expr.is_Rational:
        return expr.p if expr.q == 1 else Fraction(int(expr.p), int(expr.q))
    if expr.is_NumberSymbol:
        return tape.node(str(expr))
    if expr.is_Add or expr.is_Mul:
        return reduce(add if expr.is_Add else mul, (_evaluated(a, values, tape) for a in expr.args))
    if isinstance(expr, Penetration):  # max(0, u) has the series of u where the contact is closed
        return _evaluated(expr.args[0], values, tape)
    if type(expr) in _QUOTIENTS:
        return _evaluated(_QUOTIENTS[type(expr)](*expr.args), values, tape)
    if isinstance(expr, sp.atan2):
        return _angle(*(_evaluated(a, values, tape) for a in expr.args), tape)
    if isinstance(expr, Removable):
        return _beside(expr, _evaluated(expr.args[0], values, tape), tape)
    base, exponent = expr.as_base_exp() if expr.is_Pow else (expr, sp.S.One)
    if exponent.is_Integer and expr.is_Pow:
        of = _evaluated(base, values, tape)
        if exponent < 0 and _is_zero(of[0, 0] if isinstance(of, Taylor) else of):
            _require_regular(expr, (1 / U,))
        return _power(of, int(exponent))
    if expr.is_Pow and not exponent.is_Rational:
        return _evaluated(sp.exp(exponent * sp.log(base), evaluate=False), values, tape)
    return _function(expr, values, tape)


def at_number(expr: sp.Expr, value: Any, tape: Any) -> Any:
    """Return a function of ``U`` at a node or number, written on the tape."""
    if expr.is_Function and expr.args == (U,) and type(expr).__name__ in FUNCTIONS:
        return tape.call(type(expr).__name__, value)
    if expr.is_Pow and expr.base == U and expr.exp.is_Rational and not expr.exp.is_Integer:
        if expr.exp.q == 2:
            return _power(tape.call("sqrt", value), int(expr.exp.p))
        return tape.call("exp", tape.call("log", value) * Fraction(int(expr.exp.p), int(expr.exp.q)))
    return _evaluated(expr, {U: value}, tape)


def _function(expr, values, tape):
    if not expr.is_Pow and (len(expr.args) != 1 or type(expr).__name__ not in FUNCTIONS):
        raise InputError(f"{expr!s:.60} has no series here; use powers and {', '.join(FUNCTIONS)}")
    outer, inner = (U**expr.exp, expr.base) if expr.is_Pow else (expr.func(U), expr.args[0])
    at = _evaluated(inner, values, tape)
    if not isinstance(at, Taylor):
        return at_number(outer, at, tape)
    rest = _without_first(at)
    derivatives = _derivatives(outer, at.degree + 1 if rest.terms else 1)
    if _is_zero(at[0, 0]):
        _require_regular(expr, derivatives)
    return _geometric(rest, [at_number(d, at[0, 0], tape) * Fraction(1, factorial(i))
                             for i, d in enumerate(derivatives)])


def _beside(expr, at, tape):
    """Return a derivative of a quotient of functions of ``V``, beside 0 by its series."""
    degree, first = (at.degree, at[0, 0]) if isinstance(at, Taylor) else (0, at)
    times, (end, coefficients) = expr.times, _series(expr.quotient)
    outside, chosen = ((CHOICES[name] if isinstance(first, int | Fraction) else partial(tape.call, name))
                       for name in ("outside", "chosen"))
    here, there = (Taylor({(0, 0): v, (0, 1): 1}, degree + times) for v in (first, outside(first, end)))
    near, far = _geometric(here, coefficients), as_taylor(_evaluated(expr.quotient, {V: there}, tape), degree + times)
    found = [chosen(first, end, near[0, i], far[0, i]) * perm(i, times) for i in range(times, degree + times + 1)]
    return _geometric(_without_first(at), found) if isinstance(at, Taylor) else found[0]


def _without_first(series):
    return Taylor({i: c for i, c in series.terms.items() if i != (0, 0)}, series.degree)


def _angle(y, x, tape):
    """Return atan2(y, x): the angle at the first terms, and the arc tangent of what is added to it."""
    at_y, at_x = (v[0, 0] if isinstance(v, Taylor) else v for v in (y, x))
    angle = tape.call("atan2", at_y, at_x)
    if at_y is y and at_x is x:
        return angle
    values = {A: at_x * y + -1 * at_y * x, B: at_x * x + at_y * y}
    return angle + _evaluated(sp.atan(A / B), values, tape)


def _require_regular(expr, derivatives):
    if any(d.subs(U, 0).has(*NOT_FINITE) for d in derivatives):
        raise InputError(f"{expr!s:.60} has no series in the small parameter, as it is singular where that is 0; make "
                         "it a parameter of its own, of that value")


@lru_cache(maxsize=256)
def _derivatives(outer, count):
    found = [outer]
    while len(found) < count:
        found.append(found[-1].diff(U))
    return found


def _geometric(rest, coefficients):
    """Return sum c_i rest**i by Horner's scheme."""
    *lower, total = coefficients
    total = as_taylor(total, rest.degree)
    for c in reversed(lower):
        total = total * rest + c
    return total


def _power(value, exponent):
    if exponent < 0:
        value, exponent = value.inverse() if isinstance(value, Taylor) else _reciprocal(value), -exponent
    if exponent == 1:
        return value
    half = _power(value, exponent // 2)
    return half * half * value if exponent % 2 else half * half


def as_taylor(value: Any, degree: int) -> Taylor:
    """Return a node or number as a series."""
    return value if isinstance(value, Taylor) else Taylor({(0, 0): value}, degree)


def _reciprocal(c):
    return Fraction(1, c) if isinstance(c, int) else 1 / c


def _is_zero(c):
    return isinstance(c, int | Fraction) and c == 0
