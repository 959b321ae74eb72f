r"""Truncated series in a small parameter and its logarithm; the remainder is part of the value.

    sum_{p,q} c_pq mu^p L^q + O(mu^P L^Q),    L = log(1/mu),    p, q integers, q >= 0.

Monomials are ordered by their size as mu -> 0: the lower power of mu is larger, and of equal powers of mu the higher
power of L. A remainder absorbs every monomial that is not larger than the remainder. Coefficients are any objects that
add, multiply and divide: ``Ratio``, ``Fraction``, SymPy expressions, floats, mpmath numbers, arrays.

``balance`` is the hard function: it solves an equation order by order from its dominant terms.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import factorial, log
from typing import Any

import sympy as sp

from asympk.errors import NotDerivable, OrderError
from asympk.numbers import number
from asympk.shown import Card, ShownAsFormulas, cut

LONG = 400  # letters in LaTeX from which on every term has a line of its own


def _rank(monomial):
    return monomial[0], -monomial[1]


def _largest(*monomials):
    known = [m for m in monomials if m is not None]
    return min(known, key=_rank) if known else None


def _times(a, b):
    return None if a is None or b is None else (a[0] + b[0], a[1] + b[1])


def _vanishes(c):
    # an array is never dropped, since some of its entries may be zero and others not
    return (c == 0) is True


@dataclass(frozen=True, repr=False)
class Series(ShownAsFormulas):
    """Terms ``{(p, q): c}`` of ``c mu^p L^q``, and the largest monomial left out (None: the series is exact)."""

    terms: Mapping[tuple[int, int], Any] = field(hash=False)
    remainder: tuple[int, int] | None = None
    small: Any = None

    __array_ufunc__ = None  # an array times a series is a series

    def __post_init__(self) -> None:
        kept = [m for m in self.terms if not _vanishes(self.terms[m]) and self._keeps(m)]
        object.__setattr__(self, "terms", {m: self.terms[m] for m in sorted(kept, key=_rank)})

    def _keeps(self, monomial):
        return self.remainder is None or _rank(monomial) < _rank(self.remainder)

    @property
    def size(self) -> Any:
        """The largest monomial (p, q); the remainder when there is no term, None for an exact zero."""
        return next(iter(self.terms), self.remainder)

    @property
    def leading(self) -> Any:
        """The dominant coefficient; raises ``OrderError`` when the remainder hides it."""
        if not self.terms:
            raise OrderError(f"the dominant term is not known: {self}; expand further")
        return self.terms[self.size]

    def coefficient(self, p: int, q: int = 0) -> Any:
        """Return the coefficient of ``mu^p L^q``; raises ``OrderError`` inside the remainder."""
        if not self._keeps((p, q)):
            raise OrderError(f"the coefficient of {_monomial(p, q, self.small)} is not known: {self._tail} is left out")
        return self.terms.get((p, q), 0)

    def truncated(self, p: int, q: int = 0) -> "Series":
        """Drop the terms smaller than ``mu^p L^q``; raises ``OrderError`` when the series is not known that far."""
        if not self._keeps((p, q)):
            raise OrderError(f"known up to {self._tail}, asked for {_monomial(p, q, self.small)}; expand further")
        dropped = next((m for m in self.terms if _rank(m) > _rank((p, q))), None)
        return Series(self.terms, _largest(dropped, self.remainder), self.small)

    def cut(self, p: int) -> "Series":
        """Drop the terms smaller than ``mu^p``, with all powers of L; a larger remainder is kept."""
        dropped = next((m for m in self.terms if m[0] > p), None)
        return Series(self.terms, _largest(dropped, self.remainder), self.small)

    def power(self, p: int) -> "Series":
        """Return the terms in ``mu^p`` alone, all powers of L, as an exact series."""
        self.coefficient(p)
        return Series({m: c for m, c in self.terms.items() if m[0] == p}, None, self.small)

    def map(self, convert: Callable[[Any], Any], small: Any = None) -> "Series":
        """Apply ``convert`` to every coefficient; ``small`` names the parameter for printing."""
        return Series({m: convert(c) for m, c in self.terms.items()}, self.remainder, small or self.small)

    def __call__(self, mu: Any, log: Callable | None = None) -> Any:
        """Evaluate the terms, without the remainder, at a number ``mu`` > 0, or at any argument of ``log``.

        Raises ``InputError`` where no ``log`` is given and ``mu`` is not a positive number.
        """
        if log is None:
            mu, log = number("mu", mu, lambda v: v > 0, "positive"), _logarithm
        large = -log(mu)
        return sum(c * mu**p * large**q for (p, q), c in self.terms.items())

    @property
    def expr(self) -> Any:
        """The terms as a SymPy expression in ``small``."""
        mu = self.small or sp.Symbol("mu", positive=True)
        large = sp.log(1 / mu, evaluate=False)
        return sp.Add(*(sp.sympify(c, strict=True) * mu**p * large**q for (p, q), c in self.terms.items()))

    def _sympy_(self):
        return self.expr

    def __str__(self) -> str:
        shown = [" ".join(filter(None, (f"({c})", _monomial(*m, self.small) if any(m) else "")))
                 for m, c in self.terms.items()]
        return " + ".join(shown if self.remainder is None else [*shown, self._tail]) or "0"

    def __repr__(self) -> str:
        return cut(str(self), 400)

    def _card(self):
        return Card("Series", (("", self),))

    def _latex(self, printer, **options):
        mu = "\\mu" if self.small is None else printer.parenthesize_super(printer._print(self.small))
        shown = [_product(printer, c, _powers(mu, *m)) for m, c in self.terms.items()]
        if self.remainder is not None:
            shown.append(rf"O\left({_powers(mu, *self.remainder) or 1}\right)")
        between = " + " if sum(map(len, shown)) < LONG else r" \\ & + "
        text = between.join(shown).replace("+ -", "-") or "0"
        return text if between == " + " else rf"\begin{{aligned}} & {text} \end{{aligned}}"

    @property
    def _tail(self):
        return f"O({_monomial(*self.remainder, self.small)})"

    def __add__(self, other: Any) -> "Series":
        other, terms = series(other), dict(self.terms)
        for m, c in other.terms.items():
            terms[m] = terms[m] + c if m in terms else c
        return Series(terms, _largest(self.remainder, other.remainder), self.small or other.small)

    def __neg__(self) -> "Series":
        return self.map(lambda c: -c)

    def __sub__(self, other: Any) -> "Series":
        return self + -series(other)

    def __rsub__(self, other: Any) -> "Series":
        return -self + other

    def __mul__(self, other: Any) -> "Series":
        other = series(other)
        terms: dict[tuple, Any] = {}
        remainder = _largest(_times(self.size, other.remainder), _times(self.remainder, other.size))
        for m, c in self.terms.items():
            for n, d in other.terms.items():
                k = _times(m, n)
                if remainder is None or _rank(k) < _rank(remainder):
                    terms[k] = terms[k] + c * d if k in terms else c * d
        return Series(terms, remainder, self.small or other.small)

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, other: Any) -> "Series":
        if not isinstance(other, Series):
            return self.map(lambda c: _over(c, other))
        return self * other.inverse()

    def __rtruediv__(self, other: Any) -> "Series":
        return self.inverse() * other

    def __pow__(self, k: int) -> "Series":
        base = self if k >= 0 else self.inverse()
        result = series(1)
        for _ in range(abs(k)):
            result = result * base
        return result

    def _split(self):
        """Return the inverse of the dominant term and u, where the series is ``c mu^p L^q (1 + u)``."""
        (p, q), c = self.size, self.leading
        scale = Series({(-p, -q): _over(1, c)}, None, self.small)
        u = self * scale
        return scale, Series({m: d for m, d in u.terms.items() if any(m)}, u.remainder)

    def inverse(self) -> "Series":
        """Return ``1/self`` by the geometric series about the dominant term."""
        scale, u = self._split()
        return scale * _compose(u, lambda power, k: power * (-1) ** k)

    def log(self, log: Callable[[Any], Any]) -> "Series":
        """Return the logarithm of the series; ``log`` takes the logarithm of the dominant coefficient."""
        (p, q), c = self.size, self.leading
        if q:
            raise NotDerivable(f"log of {_monomial(p, q, self.small)} holds log L, which is not a series in "
                               f"{self.small or 'mu'} and L")
        tail = _compose(self._split()[1], lambda power, k: power / ((-1) ** (k + 1) * k))
        return series({(0, 1): -p, (0, 0): log(c)}) + tail - 1

    def exp(self, exp: Callable[[Any], Any] | None = None) -> "Series":
        """Return the exponential, exp(kL) = mu^-k for integers k; ``exp`` takes the constant term.

        Raises ``NotDerivable``, also where there is a constant and no ``exp``.
        """
        k, constant = (self.terms.get(m, 0) for m in ((0, 1), (0, 0)))
        allowed = {(0, 1)} if exp is None else {(0, 1), (0, 0)}
        if any(p <= 0 for p, _ in self.terms.keys() - allowed) or int(k) != k:
            raise NotDerivable(f"exp({self}) is not a series in mu and L")
        small = Series({m: c for m, c in self.terms.items() if m[0] > 0}, self.remainder, self.small)
        return series({(-int(k), 0): exp(constant) if exp and constant else 1}) * _compose(
            small, lambda power, k: power / factorial(k))


def series(value: Any) -> Series:
    """Return ``value`` as a Series: a Series itself, a dictionary of terms, or a constant."""
    if isinstance(value, Series):
        return value
    return Series(value if isinstance(value, dict) else {(0, 0): value})


def O(p: int, q: int = 0) -> Series:  # noqa: E743
    """Return the remainder ``O(mu^p L^q)``, to be added to an exact series."""
    return Series({}, (p, q))


def balance(step: Callable[[Series], Series], dominant: Series, order: int) -> Series:
    """Solve ``w = step(w)`` from its dominant term to relative order ``order``.

    ``step`` must contract differences by a power of mu at least, so that each pass makes one more order exact. Raises
    ``NotDerivable`` when ``step`` changes the size of ``dominant``, which then does not balance the equation.

    >>> mu = series({(1, 0): 1})
    >>> print(balance(lambda w: 1 + mu * w * w, series(1), 3))
    (1) + (1) mu + (2) mu^2 + (5) mu^3 + O(mu^4)
    """
    w = dominant
    p = dominant.size[0]
    for k in range(order + 1):
        w = step(w).cut(p + k) + O(p + k + 1)
        if k == 0 and not (w.size == dominant.size):
            raise NotDerivable(f"{dominant} does not balance the equation: the next iterate is {w}")
    return w


def _compose(u, term):
    """Sum ``1 + term(u, 1) + term(u^2, 2) + ...`` for a small u, as far as the remainder of u allows."""
    if u.size is not None and u.size[0] <= 0:
        raise NotDerivable(f"{u} is not small as mu -> 0")
    if u.terms and u.remainder is None:
        raise OrderError(f"{u} is exact, its function is not: add a remainder O(p, q)")
    rest = Series({}, u.remainder)
    total, power, k = 1 + rest, u, 1
    while power.terms:
        total = total + term(power, k)
        power, k = power * u + rest, k + 1
    return total


def _over(a, b):
    # integers stay exact, and an integer quotient an int: a Fraction would turn an array into one of objects
    if isinstance(a, int) and isinstance(b, int):
        return a // b if a % b == 0 else Fraction(a, b)
    return a / b


def _monomial(p, q, small):
    mu = str(small or "mu")
    parts = [f"{mu}^{p}" if p not in (0, 1) else mu * p, f"L^{q}" if q not in (0, 1) else "L" * q]
    return " ".join(filter(None, parts)) or "1"


def _powers(mu, p, q):
    """Return ``mu^p L^q`` as LaTeX, "" where that is 1."""
    large = rf"\log\frac{{1}}{{{mu}}}"
    parts = [mu if p == 1 else f"{mu}^{{{p}}}"] * bool(p)
    return " ".join([*parts, large if q == 1 else rf"\left({large}\right)^{{{q}}}"] if q else parts)


def _product(printer, c, monomial):
    """Return a coefficient times a monomial as LaTeX."""
    if monomial and c in (1, -1):
        return monomial if c == 1 else f"-{monomial}"
    factor = sp.sympify(c, strict=True)
    text = printer._print(factor)
    bracketed = monomial and (factor.is_Add or " / " in text)  # without brackets a / b mu reads as a / (b mu)
    return rf"\left({text}\right) {monomial}" if bracketed else f"{text} {monomial}".strip()


def _logarithm(mu):
    """Return log(mu) of an int, float or Fraction, however small."""
    return log(mu.numerator) - log(mu.denominator) if isinstance(mu, Fraction) else log(mu)
