r"""The resolvent of an exact matrix, ``(z - M)^{-1} = adj(z - M) / p(z)``, and the roots of p to any number of digits.

``resolvent`` computes p and the coefficients of ``adj(z - M)`` by one recursion in integers (Faddeev and Le Verrier).
``polynomial_roots`` takes the multiplicities of the roots from the square-free factors of p, so they are exact.
Aberth's iteration (``_simple_roots``, the hard function) finds the roots of a factor from the eigenvalues in doubles.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, reduce
from math import lcm
from operator import add
from typing import Any, NamedTuple

import numpy as np

from asympk.errors import Undecided
from asympk.numbers import Arithmetic, Number

_MOST_ITERATIONS = 100


@dataclass(frozen=True)
class Resolvent:
    """``p(z)`` and ``adj(z - denominator M)``: ``polynomial[k]``, ``adjugate[k]`` are the coefficients of ``z^k``.

    ``estimates`` are the roots of p in doubles, divided by the ``largest`` entry.
    """

    denominator: int
    polynomial: tuple[int, ...]
    adjugate: np.ndarray
    largest: int
    estimates: np.ndarray


class Root(NamedTuple):
    """A real root, or the upper root of a complex pair, and its multiplicity."""

    value: Any
    multiplicity: int
    real: bool


def in_whole_numbers(rows: Sequence[Sequence[Fraction]]) -> tuple[np.ndarray, int]:
    """Return (array, denominator): rows of Fractions over their common denominator."""
    denominator = lcm(*(entry.denominator for row in rows for entry in row))
    whole = [[entry.numerator * (denominator // entry.denominator) for entry in row] for row in rows]
    return np.array(whole, dtype=object), denominator


@lru_cache(maxsize=256)
def resolvent(matrix: tuple[tuple[Fraction, ...], ...]) -> Resolvent:
    """Return the ``Resolvent`` of a square array of Fractions."""
    whole, denominator = in_whole_numbers(matrix)
    size = len(whole)
    unit = np.array(np.eye(size, dtype=int), dtype=object)
    adjugate, polynomial = [unit], [1]
    for k in range(1, size + 1):
        moved = whole @ adjugate[0]
        polynomial.insert(0, -int(np.trace(moved)) // k)
        adjugate.insert(0, moved + polynomial[0] * unit)
    largest = abs(whole).max() or 1
    estimates = np.linalg.eigvals((whole / largest).astype(float))
    return Resolvent(denominator, tuple(polynomial), np.array(adjugate[1:]), largest, estimates)


def polynomial_roots(found: Resolvent, m: Arithmetic) -> list[Root]:
    """Return the roots of ``p``, denominator times eigenvalues, to ``m.prec`` bits less those lost by conditioning."""
    simple = [Root(m.zero, zeros, True)] if (zeros := _order(found.polynomial)) else []
    for factor, multiplicity in _square_free(found.polynomial[zeros:]):
        values = _simple_roots(m, factor, found)
        simple += [Root(value, multiplicity, real) for value, real in _paired(m, values)]
    return simple


def _order(polynomial):
    return next(k for k, coefficient in enumerate(polynomial) if coefficient)


def _square_free(polynomial):
    """Return the square-free factors (coefficients from the lowest) and their multiplicities."""
    import sympy as sp

    if len(polynomial) == 1:
        return []
    whole = sp.Poly(list(reversed(polynomial)), sp.Symbol("z"), domain=sp.ZZ)
    return [(tuple(map(int, reversed(factor.all_coeffs()))), k) for factor, k in whole.sqf_list()[1]]


def _simple_roots(m, factor, found):
    """Return the roots of a square-free polynomial by Aberth's iteration."""
    if len(factor) == 2:
        return [-m.mpf(factor[0]) / factor[1]]
    values = _starts(m, factor, found)
    close = m.ldexp(1, -m.prec * 2 // 5)  # after so small a step one more is exact to rounding: convergence is cubic
    sizes, settled = [abs(c) for c in factor], False
    for _ in range(_MOST_ITERATIONS + m.prec):  # roots near one another are approached by a factor of some 3 a step
        moved = m.zero
        for i, z in enumerate(values):
            value, slope = horner(factor, z)
            if abs(value) <= m.eps * horner(sizes, abs(z))[0]:  # rounding
                continue
            newton = value / slope
            step = newton / (1 - newton * sum(1 / (z - other) for j, other in enumerate(values) if j != i))
            values[i] = z - step
            moved = max(moved, abs(step) / abs(z))
        if settled:
            return values
        settled = moved < close
    raise Undecided("the eigenvalues of a mode do not converge")


def _starts(m, factor, found):
    """Return as many distinct starts as the factor has roots: the estimates with the smallest Newton steps."""
    spread = [(m.mpc(z) * found.largest or m.mpc(1e-12, 1e-12) * found.denominator) * (1 + m.mpc(1e-9, 1e-9) * k)
              for k, z in enumerate(found.estimates)]  # fmt: skip

    def moved(z):
        value, slope = horner(factor, z)
        return abs(value / slope / z) if slope else m.inf

    return sorted(spread, key=moved)[: len(factor) - 1]


def horner(coefficients: Sequence[Number], z: Number) -> tuple[Number, Number]:
    """Return the value and the slope of a polynomial whose ``coefficients`` begin with the lowest."""
    value = slope = 0
    for coefficient in reversed(coefficients):
        slope = slope * z + value
        value = value * z + coefficient
    return value, slope


def taylor(coefficients: Sequence[Any], z: Number, order: int) -> list[Any]:
    """Return the first Taylor coefficients at z of a polynomial in numbers or matrices, by repeated division."""
    found, rest = [], list(coefficients)
    for _ in range(order):
        if not rest:
            found.append(coefficients[0] * 0)
            continue
        for k in range(len(rest) - 2, -1, -1):
            rest[k] = rest[k] + rest[k + 1] * z
        found.append(rest.pop(0))
    return found


def residues_at(polynomial: Sequence[Number], adjugate: Sequence[Any], z: Number) -> Iterator[Any]:
    """Yield the coefficients of ``t^k/k! e^{z t}`` for a root z of p, k below its multiplicity.

    ``adjugate`` holds as many Taylor coefficients of the adjugate at z as the root is multiple.
    """
    many = len(adjugate)
    p = taylor(polynomial, z, 2 * many)[many:]
    series = [1 / p[0]]
    for j in range(1, many):
        series.append(-reduce(add, (p[i] * series[j - i] for i in range(1, j + 1))) / p[0])
    for k in range(many):
        yield reduce(add, (adjugate[i] * series[many - 1 - k - i] for i in range(many - k)))


def _paired(m, values):
    """Yield (root, True) for real roots and (root, False) for the upper roots of complex pairs."""
    for z in values:
        mirror = m.conj(z)
        nearest = min(values, key=lambda other: abs(other - mirror))
        if nearest is z:
            yield m.re(z), True
        elif m.im(z) > 0:
            yield z, False
