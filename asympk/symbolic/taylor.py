r"""Taylor arithmetic in two variables, mu and t: expressions of series, on a tape or in numbers.

A ``Taylor`` is sum c_kj mu^k t^j, k + j <= degree. Coefficients are whole numbers, fractions, and either numbers or
nodes of a ``Tape``, on which every computation becomes straight-line code. A function phi of a series is evaluated by
its derivatives, phi(u_0 + w) = sum phi^(i)(u_0) w^i / i!  (Griewank and Walther, Evaluating Derivatives, chapter 13).
``evaluated`` is the entry, and ``_computed`` treats each kind of expression.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, reduce
from math import factorial, inf
from operator import add, mul
from typing import Any, Self

import sympy as sp

from asympk.errors import InputError
from asympk.formulas import NOT_FINITE
from asympk.symbolic.inverses import in_order, without_inverses
from asympk.symbolic.penetration import Penetration

FUNCTIONS = ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "asin", "acos", "atan", "asinh", "acosh",
             "atanh", "sqrt", "erf", "atan2")
CONSTANTS = (sp.pi, sp.E, sp.GoldenRatio, sp.TribonacciConstant, sp.EulerGamma, sp.Catalan)
_QUOTIENTS = {
    sp.sec: lambda a: 1 / sp.cos(a), sp.csc: lambda a: 1 / sp.sin(a), sp.cot: lambda a: sp.cos(a) / sp.sin(a),
    sp.sech: lambda a: 1 / sp.cosh(a), sp.csch: lambda a: 1 / sp.sinh(a), sp.coth: lambda a: 1 / sp.tanh(a),
}
U = sp.Symbol("u", positive=True)
A, B = sp.symbols("a b", real=True)


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
        rest = Taylor({i: c for i, c in self.terms.items() if i != (0, 0)}, self.degree) * (-1 * first)
        return _geometric(rest, [1] * (self.degree + 1)) * first


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
    rest = Taylor({i: c for i, c in at.terms.items() if i != (0, 0)}, at.degree)
    derivatives = _derivatives(outer, at.degree + 1 if rest.terms else 1)
    if _is_zero(at[0, 0]):
        _require_regular(expr, derivatives)
    return _geometric(rest, [at_number(d, at[0, 0], tape) * Fraction(1, factorial(i))
                             for i, d in enumerate(derivatives)])


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
