"""Exact coefficients: rational functions whose few denominators stay factored.

A ``Ratio`` is ``numerator * product of unit**k`` with a polynomial numerator and irreducible polynomial units. The
derivations of this package divide by few polynomials (sigma, sigma + 1, z ...). With these kept as factors, trial
division replaces the multivariate gcd of a fraction field, and a ratio is zero if and only if its numerator is.
``_cancel`` is the hard function.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from numbers import Rational
from typing import Any

import sympy as sp

from asympk.errors import NotDerivable
from asympk.numbers import Number, short

PRIME = 2**31 - 1  # the modulus of a cheap test that spares most of the trial divisions
HIGHEST_POWER = 64  # powers of the generators below it are tabulated


@dataclass(frozen=True, eq=False)
class Ratio:
    """``numerator * prod(u**k for u, k in units.items())``, in lowest terms."""

    numerator: Any
    units: dict = field(default_factory=dict)

    @property
    def expr(self) -> sp.Expr:
        """The SymPy expression, denominators factored."""
        return sp.Mul(self.numerator.as_expr(), *(u.as_expr() ** k for u, k in self.units.items()))

    def __str__(self) -> str:
        return str(self.expr)

    def __eq__(self, other: object) -> bool:
        return not (self.numerator if isinstance(other, int) and other == 0 else (self - other).numerator)

    __hash__ = None  # type: ignore[assignment]

    def __neg__(self) -> "Ratio":
        return Ratio(-self.numerator, self.units)

    def __add__(self, other: "Ratio | Number") -> "Ratio":
        other = self._like(other)
        if other is NotImplemented or not other.numerator:
            return NotImplemented if other is NotImplemented else self
        common = {u: min(self.units.get(u, 0), other.units.get(u, 0)) for u in {**self.units, **other.units}}
        return _cancel(self._over(common) + other._over(common), common)

    def __mul__(self, other: "Ratio | Number") -> "Ratio":
        other = self._like(other)
        if other is NotImplemented:
            return NotImplemented
        units = {u: self.units.get(u, 0) + other.units.get(u, 0) for u in {**self.units, **other.units}}
        return _cancel(self.numerator * other.numerator, units)

    __radd__, __rmul__ = __add__, __mul__

    def __sub__(self, other: "Ratio | Number") -> "Ratio":
        return self + -other

    def __rsub__(self, other: "Ratio | Number") -> "Ratio":
        return -self + other

    def __truediv__(self, other: "Ratio | Number") -> "Ratio":
        other = self._like(other)
        return NotImplemented if other is NotImplemented else self * other.inverse()

    def __rtruediv__(self, other: "Ratio | Number") -> "Ratio":
        return self.inverse() * other

    def inverse(self) -> "Ratio":
        """Return the reciprocal, in which the irreducible factors of the numerator become units."""
        constant, factors = self.numerator.factor_list()
        units = {u: -k for u, k in self.units.items()}
        for u, k in factors:
            units[u] = units.get(u, 0) - k
        return Ratio(self.numerator.ring(1 / constant), {u: k for u, k in units.items() if k})

    def _like(self, other):
        if isinstance(other, Ratio):
            return other
        if not isinstance(other, Rational):
            return NotImplemented
        ring = self.numerator.ring
        return Ratio(ring(ring.domain.convert(other)))

    def _over(self, common):
        result = self.numerator
        for u, k in self.units.items():
            result = result * u ** (k - common[u])
        for u in common.keys() - self.units.keys():
            result = result * u ** -common[u]
        return result


class Ratios:
    """The ratios in ``symbols`` and ``logarithms`` further generators, each of which stands for one logarithm.

    ``shown`` are the expressions that replace the symbols in SymPy expressions. These are sorted by powers of all
    symbols but the first ``parameters``, by default none.
    """

    def __init__(
        self, symbols: Sequence[sp.Symbol], logarithms: int = 0, shown: Any = None, parameters: int | None = None
    ):
        self._names = sp.symbols(f"Lambda1:{logarithms + 1}")
        self._ring = sp.polys.rings.PolyRing((*symbols, *self._names), sp.QQ)
        self._shown = (*(shown or symbols), *self._names)
        self._parameters = len(symbols) if parameters is None else parameters
        self._known: list = []

    def __call__(self, expr: sp.Expr) -> Ratio:
        """Return a rational expression as a Ratio; raises ``NotDerivable`` for any other."""
        try:
            above, below = map(self._ring.from_expr, sp.fraction(sp.together(expr)))
        except ValueError:
            raise NotDerivable(f"{short(expr)} is not rational in the parameters: put a parameter of its own for every "
                               "root, function or constant such as pi") from None
        return Ratio(above) / Ratio(below)

    def log(self, ratio: Ratio) -> Ratio:
        """Return the generator that stands for the logarithm of ``ratio``."""
        for name, known in zip(self._names, self._known, strict=False):
            if known == ratio:
                return self(name)
        self._known.append(ratio)
        return self(self._names[len(self._known) - 1])

    def expr(self, ratio: Any) -> sp.Expr:
        """Return the SymPy expression of a ratio: a cancelled coefficient for each product of logarithms and of states.

        Denominators with a state in them are common to the terms of a product of logarithms.
        """
        if not isinstance(ratio, Ratio):
            return sp.sympify(ratio, strict=True)
        logarithms = self._ring.ngens - len(self._names)
        whole = self._sorted(ratio.numerator, logarithms)
        return sp.Add(*(sp.Mul(self._by_states(_cancel(part, ratio.units)), *factors) for factors, part in whole))

    def _by_states(self, ratio):
        plain, common = {}, []
        for u, k in ratio.units.items():
            if any(any(monomial[self._parameters :]) for monomial in u):
                common.append(self._plain(Ratio(u.ring.one, {u: k})))
            else:
                plain[u] = k
        parts = self._sorted(ratio.numerator, self._parameters)
        terms = (sp.Mul(self._plain(_cancel(part, plain)), *factors) for factors, part in parts)
        return sp.Mul(sp.Add(*terms), *common)

    def _sorted(self, numerator, first):
        """Return the products of the generators from ``first`` on, as shown, with the polynomial each multiplies."""
        parts: dict[tuple, Any] = {}
        for monomial, c in numerator.terms():
            part = parts.setdefault(monomial[first:], self._ring.zero)
            part[monomial[:first] + (0,) * len(monomial[first:])] = c
        return [([self._shown_at(first + i) ** k for i, k in enumerate(key) if k], part) for key, part in parts.items()]

    def _plain(self, ratio):
        units = (sp.factor_terms(u.as_expr(*self._shown)) ** k for u, k in ratio.units.items())
        return sp.Mul(ratio.numerator.as_expr(*self._shown), *units)

    def _shown_at(self, i):
        known = i - len(self._shown) + len(self._names)
        return self._shown[i] if known < 0 else sp.log(self._plain(self._known[known]))


def _cancel(numerator, units):
    if not numerator:
        return Ratio(numerator)
    left = {}
    for u, k in units.items():
        while k < 0 and _may_divide(u, numerator):
            quotient, rest = numerator.div(u)
            if rest:
                break
            numerator, k = quotient, k + 1
        if k:
            left[u] = k
    return Ratio(numerator, left)


def _may_divide(unit, numerator):
    # most trial divisions fail; a numerator that does not vanish at a zero of the unit modulo a prime is not divisible
    powers = _powers_of_zero(unit)
    return powers is None or _residue(numerator, powers) == 0


@lru_cache(maxsize=256)
def _powers_of_zero(unit):
    """Return the powers, modulo ``PRIME``, of a zero of the unit, or None if the unit is linear in no generator."""
    for i in range(unit.ring.ngens):
        if unit.degree(i) == 1:
            point = [pow(7, 1 + 3 * j, PRIME) for j in range(unit.ring.ngens)]
            at = [_residue(unit, [*map(_powers, [*point[:i], value, *point[i + 1 :]])]) for value in (0, 1)]
            if (slope := at[1] - at[0]) % PRIME:
                point[i] = -at[0] * pow(slope, -1, PRIME) % PRIME
                return tuple(map(_powers, point))
    return None


def _powers(base):
    return [pow(base, k, PRIME) for k in range(HIGHEST_POWER)]


def _residue(polynomial, powers):
    total = 0
    for monomial, c in polynomial.items():
        term = c.numerator if c.denominator == 1 else c.numerator * pow(c.denominator, -1, PRIME)
        for table, exponent in zip(powers, monomial, strict=True):
            if exponent:
                term = term * (table[exponent] if exponent < HIGHEST_POWER else pow(table[1], exponent, PRIME)) % PRIME
        total += term
    return total % PRIME
