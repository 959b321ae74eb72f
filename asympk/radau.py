"""The coefficients of Radau IIA: its nodes in doubles, and in any number of digits all that a step needs.

The stages of a step are at the zeros of P_s - P_(s-1) on [-1, 1], P being the Legendre polynomials (Hairer and Wanner,
Solving Ordinary Differential Equations II, section IV.5). The last of them is the end of the step.
"""

from functools import lru_cache
from math import ceil, log2
from typing import Any

import numpy as np
from mpmath.libmp import to_fixed
from numpy.polynomial import legendre

from asympk.digits import GUARD_BITS, FixedPoint, carrier_context, dot, fixed_point

DOUBLE_DIGITS = 7  # digits to which a root found in doubles is certainly right


def places(stages: int) -> list[float]:
    """Return the nodes in (-1, 1], right to about ``DOUBLE_DIGITS`` digits for many stages, to rounding for a few."""
    between = np.eye(stages + 1)[-1] - np.eye(stages + 1)[-2]
    return [*np.sort(legendre.legroots(between).real)[:-1].tolist(), 1.0]


class Tableau:
    """Radau IIA with s stages: nodes, matrix a, and the rows that give Legendre coefficients of stage derivatives."""

    def __init__(self, stages: int, digits: int):
        self.ctx = ctx = carrier_context(digits)
        found = _places_in(ctx, stages)
        self.nodes = [(u + 1) / 2 for u in found]
        columns = [_lagrange(_legendre(u, stages), u) for u in found]
        self.legendre = [fixed_point(ctx, row) for row in zip(*columns, strict=True)]
        inverse = [fixed_point(ctx, column) for column in columns]
        rows = [[dot(ctx, integrals, column) for column in inverse] for integrals in map(self.integrals, self.nodes)]
        self.a, self.floats = [fixed_point(ctx, row) for row in rows], np.array(rows, dtype=float)

    def coefficients(self, slopes: list[FixedPoint]) -> list[FixedPoint]:
        """Return the Legendre coefficients of the polynomials through stage derivatives."""
        return [fixed_point(self.ctx, [dot(self.ctx, row, column) for row in self.legendre]) for column in slopes]

    def values(self, t: Any) -> FixedPoint:
        """Return the Legendre polynomials of [0, 1] at t, whose weights ``coefficients`` are."""
        return FixedPoint(*_legendre_multiples(2 * t - 1, len(self.nodes)))

    def integrals(self, t: Any) -> FixedPoint:
        """Return the integrals from 0 to t of the Legendre polynomials."""
        values, exponent = _legendre_multiples(2 * t - 1, len(self.nodes) + 1)
        first = (values[0] + values[1]) // 2
        return FixedPoint((first, *((after - before) // (2 * (2 * k + 1)) for k, (before, after) in
                                    enumerate(zip(values, values[2:], strict=False), start=1))), exponent)


def _legendre(u: Any, count: int) -> list:
    """Return the Legendre polynomials P_0 .. P_(count - 1) at u."""
    values, exponent = _legendre_multiples(u, count)
    return [u.context.ldexp(value, exponent) for value in values]


def _legendre_multiples(u: Any, count: int) -> FixedPoint:
    """Return P_0(u) .. P_(count - 1)(u), at most 1, in fixed point, which makes their recurrence far faster."""
    bits = u.context.prec + GUARD_BITS
    u = to_fixed(u._mpf_, bits)
    values = [1 << bits, u]
    for k in range(1, count - 1):
        values.append(((2 * k + 1) * (u * values[k] >> bits) - k * values[k - 1]) // (k + 1))
    return FixedPoint(tuple(values), -bits)


def _lagrange(values: list, u: Any) -> list:
    """Return the Legendre coefficients of the Lagrange polynomial of a Radau node u: (2 k + 1) w P_k(u).

    ``values`` are P_k(u), and w = (1 + u)/(2 (s P_(s-1)(u))^2) is the weight of u. The formula holds because the Radau
    quadrature with s nodes is exact to the degree 2 s - 2.
    """
    weight = (1 + u) / (2 * (len(values) * values[-1]) ** 2)
    return [(2 * k + 1) * weight * value for k, value in enumerate(values)]


def _places_in(ctx: Any, stages: int) -> list:
    """Return the nodes in (-1, 1] by Newton's method from doubles."""
    found = [ctx.mpf(u) for u in places(stages)[:-1]]
    for _ in range(ceil(log2(ctx.dps / DOUBLE_DIGITS)) + 1):
        found = [_newton(_legendre(u, stages + 1), u) for u in found]
    return [*found, ctx.mpf(1)]


def _newton(values: list, u: Any) -> Any:
    """Return u after a Newton step to a root of P_s - P_(s-1); (u^2 - 1) P_k' = k (u P_k - P_(k-1))."""
    *_, before, low, high = values
    s = len(values) - 1
    return u - (high - low) * (u * u - 1) / (s * (u * high - low) - (s - 1) * (u * low - before))


tableau_of = lru_cache(maxsize=8)(Tableau)
