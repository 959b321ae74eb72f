r"""The resolvent of an exact matrix, ``(z - M)^{-1} = N(z) / q(z)``, and the roots of q to any number of digits.

q has the square-free factors of the characteristic polynomial to the least powers for which ``q(M) = 0``: an eigenvalue
that only repeats, as of equal blocks, is a simple root. As ``q(z) - q(M)`` is a multiple of ``z - M``, a recursion in
integers gives N and proves ``q(M) = 0`` (``_divided``). Multiplicities are exact.
Aberth's iteration (``_simple_roots``, the hard function) finds the roots of a factor from the eigenvalues in doubles.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, reduce
from math import lcm
from operator import add
from typing import Any

import numpy as np
import sympy as sp
from sympy.polys.matrices import DomainMatrix

from asympk.errors import Undecided
from asympk.numbers import Arithmetic, Number

_MOST_ITERATIONS = 100


@dataclass(frozen=True)
class Resolvent:
    """``q(z)`` and ``N(z) = q(z) / (z - denominator M)``: ``polynomial[k]``, ``adjugate[k]`` stand before ``z^k``.

    ``factors`` are the square-free factors of q, each with its power in q.
    ``estimates`` are the eigenvalues in doubles, divided by the ``largest`` entry.
    """

    denominator: int
    polynomial: tuple[int, ...]
    factors: tuple[tuple[tuple[int, ...], int], ...]
    adjugate: np.ndarray
    largest: int
    estimates: np.ndarray


def in_whole_numbers(rows: Sequence[Sequence[Fraction]]) -> tuple[np.ndarray, int]:
    """Return (array, denominator): rows of Fractions over their common denominator."""
    denominator = lcm(*(entry.denominator for row in rows for entry in row))
    whole = [[entry.numerator * (denominator // entry.denominator) for entry in row] for row in rows]
    return np.array(whole, dtype=object), denominator


@lru_cache(maxsize=256)
def resolvent(matrix: tuple[tuple[Fraction, ...], ...]) -> Resolvent:
    """Return the ``Resolvent`` of a square array of Fractions."""
    whole, denominator = in_whole_numbers(matrix)
    factors = _least_powers(whole, _square_free(eigenvalue_polynomial(whole)))
    polynomial = _product(factors)
    *adjugate, _ = _divided(whole, polynomial)
    largest = abs(whole).max() or 1
    estimates = np.linalg.eigvals((whole / largest).astype(float))
    return Resolvent(denominator, polynomial, factors, np.array(adjugate[::-1]), largest, estimates)


def eigenvalue_polynomial(whole: np.ndarray) -> tuple[int, ...]:
    """Return the coefficients of the characteristic polynomial of whole numbers, from the lowest."""
    return tuple(map(int, reversed(DomainMatrix(sp.ZZ.map(whole.tolist()), whole.shape, sp.ZZ).charpoly())))


def _divided(whole, polynomial):
    """Yield the coefficients of ``(q(z) - q(M)) / (z - M)`` from the highest, and ``q(M)`` at the end."""
    found = np.array(np.eye(len(whole), dtype=int), dtype=object) * polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        yield found
        found = whole @ found
        found.flat[:: len(whole) + 1] += coefficient
    yield found


def _product(powers):
    """Return the product of powers of polynomials."""
    factors = (np.array(factor, dtype=object) for factor, power in powers for _ in range(power))
    return tuple(reduce(np.convolve, factors, np.array([1], dtype=object)))


def _least_powers(whole, factors):
    """Return the factors with the least powers whose product vanishes at the matrix."""

    def vanishes(powers):
        *_, last = _divided(whole, _product(zip((factor for factor, _ in factors), powers, strict=True)))
        return not last.any()

    powers = [most for _, most in factors]
    for i, power in enumerate(powers):
        lower = ([*powers[:i], k, *powers[i + 1 :]] for k in range(1, power))
        powers = next(filter(vanishes, lower), powers)
    return tuple((factor, power) for (factor, _), power in zip(factors, powers, strict=True))


def polynomial_roots(found: Resolvent, m: Arithmetic) -> list[tuple[Any, int]]:
    """Return (root, multiplicity) of the real roots of ``q`` and of the upper roots of its complex pairs.

    A root, denominator times eigenvalue, has ``m.prec`` bits less those lost by conditioning.
    """
    return [(root, power) for factor, power in found.factors for root in _upper(m, _simple_roots(m, factor, found))]


def _square_free(polynomial):
    """Return the square-free factors (coefficients from the lowest) and their multiplicities; z is one of its own."""
    zeros = next(k for k, coefficient in enumerate(polynomial) if coefficient)
    whole = sp.Poly(list(reversed(polynomial[zeros:])), sp.Symbol("z"), domain=sp.ZZ)
    found = [(tuple(map(int, reversed(factor.all_coeffs()))), k) for factor, k in whole.sqf_list()[1]]
    return [((0, 1), zeros)] * (zeros > 0) + found


def _simple_roots(m, factor, found):
    """Return the roots of a square-free polynomial by Aberth's iteration."""
    if len(factor) == 2:
        return [-m.mpf(factor[0]) / factor[1]]
    values = _starts(m, factor, found)
    close = m.ldexp(1, -m.prec * 2 // 5)  # after so small a step one more is exact to rounding: convergence is cubic
    sizes, settled = [abs(c) for c in factor[::-1]], False
    for _ in range(_MOST_ITERATIONS + m.prec):  # roots near one another are approached by a factor of some 3 a step
        moved = m.zero
        for i, z in enumerate(values):
            value, slope = m.polyval(factor[::-1], z, derivative=True)
            if abs(value) <= m.eps * m.polyval(sizes, abs(z)):  # rounding
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
              for k, z in enumerate(found.estimates)]

    def moved(z):
        value, slope = m.polyval(factor[::-1], z, derivative=True)
        return abs(value / slope / z) if slope else m.inf

    return sorted(spread, key=moved)[: len(factor) - 1]


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
    """Yield the coefficients of ``t^k/k! e^{z t}`` for a root z of q, k below its multiplicity.

    ``adjugate`` holds as many Taylor coefficients of N at z as the root is multiple.
    """
    many = len(adjugate)
    p = taylor(polynomial, z, 2 * many)[many:]
    series = [1 / p[0]]
    for j in range(1, many):
        series.append(-reduce(add, (p[i] * series[j - i] for i in range(1, j + 1))) / p[0])
    for k in range(many):
        yield reduce(add, (adjugate[i] * series[many - 1 - k - i] for i in range(many - k)))


def _upper(m, values):
    """Yield the real roots, as real numbers, and the upper roots of complex pairs."""
    for z in values:
        mirror = m.conj(z)
        nearest = min(values, key=lambda other: abs(other - mirror))
        if nearest is z:
            yield m.re(z)
        elif m.im(z) > 0:
            yield z
