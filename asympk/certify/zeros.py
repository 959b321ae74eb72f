r"""Zeros of guards that no sign shows: a guard touches 0 and rises again, or is 0 at the very end of a motion.

A zero at an exact end is known where a guard is a polynomial of the time with exact coefficients (Lemma 16). Elsewhere
a guard has zeros of a known order where it is a polynomial of the time, of a wave and its harmonics, or of an
exponential (Lemma 20); ``first_zero`` finds the first of them. ``asympk.certify.affine`` cuts the motion there, and
proves the mode that follows.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import count, zip_longest
from math import comb, factorial, gcd, lcm
from typing import Any, NamedTuple

import numpy as np
from sympy.polys.fields import FracElement

from asympk.certify.balls import Ball, ball, certain_sign, flint
from asympk.certify.families import Family
from asympk.certify.rows import EnclosedState, ExactEntries, exact_value, quotient, row_rate
from asympk.certify.segments import AffineGuard, EnclosedSegment

_HARMONICS, _NEAR = 16, 1e-6
_LONGEST = 24  # terms of a numerator whose divisions take no time


class Zero(NamedTuple):
    """A zero ``at`` a time, its ``span`` from the start of the mode, its exact time or None, and what is ``lost``.

    ``lost`` are the guards that vanish, each followed by those of its derivatives that vanish.
    """

    at: Family
    span: Family
    time: Fraction | None
    lost: list[AffineGuard]


def derivatives(guard: AffineGuard, segment: EnclosedSegment, count: int) -> list[AffineGuard]:
    """Return a guard and its derivatives, ``count`` in all."""
    found = [guard]
    while len(found) < count:
        found.append(found[-1]._replace(row=row_rate(found[-1].row, segment.mode.matrix)))
    return found[:count]


def order_at(coefficients: Sequence[Any], end: Fraction, field: ExactEntries) -> int:
    """Return the order of the zero of a polynomial at ``end``, 0 unless it is positive before, by Bernstein."""
    size = range(len(coefficients))
    parts = [sum(c * end**k * Fraction(comb(j, k), comb(size[-1], k)) for k, c in enumerate(coefficients[: j + 1]))
             for j in size]
    while parts and not parts[-1]:
        parts.pop()
    positive = [not part or certain_sign(field.ball(part)) > 0 for part in parts]
    return len(coefficients) - len(parts) if parts and all(positive) else 0


def first_zero(guard: AffineGuard, segment: EnclosedSegment, start: EnclosedState, since: Ball) -> tuple[Any, ...]:
    """Return (time, order, exact time or None) of the first zero of a guard; raises ``ValueError`` if not known.

    It is the first after ``since`` the segment begins, and all are times from a state ``start`` on, from which the
    guard has moved as in the segment.
    """
    field, vanishes = start.field, guard.touching > 0
    parts, square, size = _in_one_wave(_shape(guard, segment, start), field)
    zeros = [*_zeros(parts, square, size, since, field)]
    later = [zero for zero in zeros if zero[0] > since]
    first = min(later, key=lambda zero: float(zero[0].mid()), default=None)
    near = len(zeros) - len(later) - sum(bool(zero[0] < since) for zero in zeros)
    if not first or near > vanishes or not all(zero is first or zero[0] > first[0] for zero in later):
        raise ValueError
    return first


def _shape(guard, segment, start):
    """Return the derivatives of a guard at a state, twice as many as there are states, in units of the first not 0.

    Raises ``ValueError`` where they are not known, or not the same all over the box.
    """
    row, field, zero, unit, found = guard.row, start.field, (*segment.mode.kept, *start.null), None, list[Any]()
    while len(found) < 2 * len(row):
        value = exact_value(row, start)
        if not unit and (value is None or not _vanishes(value, field)):
            unit = row, value
        if value is None or (unit and unit[1] is None):
            value = quotient(row, unit[0], zero, field)
        elif unit:
            value = value / unit[1]
        if value is None or not field.is_constant(value):
            raise ValueError
        found.append(value)
        row = row_rate(row, segment.mode.matrix)
    return field.in_surds(found)


def _in_one_wave(values, field):
    """Return (P, q, degree n) with ``f = e^{m t} P(s) (1 + q s^2)^{-n/2}``, ``2 s' = 1 + q s^2`` (Lemma 20)."""
    law = _recurrence(values, field)
    mean = law[1] / (1 - len(law)) if len(law) > 1 else 0
    if mean:
        values = [sum(w * comb(k, i) * (-mean) ** (k - i) for i, w in enumerate(values[:k])) + values[k]
                  for k in range(2 * len(law) - 2)]
        law = _recurrence(values, field)
    if len(law) == 1 or not all(_vanishes(c, field) for c in law[1::2]):
        raise ValueError
    squares = _trimmed(law[::2], field)
    harmonics = _harmonics(squares, field)
    size = 2 * max(harmonics, default=0) or len(law) - 2
    if len(squares) != 1 + len(harmonics):
        raise ValueError
    square = squares[1] / sum(h * h for h in harmonics) if harmonics else Fraction(0)
    values = [*values]
    while len(values) < size + len(law):
        values.append(-sum(c * w for c, w in zip(law[1:], values[::-1], strict=False)))
    parts = list[Any]()
    for k, value in enumerate(values[: size + len(law)]):
        off = -_rate(parts, square, size, k) + value  # SymPy takes no 0 from an algebraic number
        if k > size and not _vanishes(off, field):
            raise ValueError
        parts += [off * Fraction(2**k, factorial(k))] if k <= size else []
    return _trimmed(parts, field), square, size


def _recurrence(values, field):
    """Return the shortest c with ``c_0 = 1`` and ``sum_i c_i f_{k-i} = 0`` for all k, by Berlekamp and Massey."""
    law, before, size, shift, last = [Fraction(1)], [Fraction(1)], 0, 1, Fraction(1)
    for n in range(len(values)):
        off = sum(c * values[n - i] for i, c in enumerate(law[: size + 1]))
        if _vanishes(off, field):
            shift += 1
            continue
        new = [*law, *(0,) * (shift + len(before) - len(law))]
        for i, c in enumerate(before):
            new[i + shift] -= off * c / last
        if 2 * size <= n:
            size, before, last, shift = n + 1 - size, law, off, 0
        law, shift = new, shift + 1
    return [*law, *(0,) * size][: size + 1]


def _vanishes(entry, field):
    """Tell whether an exact entry is known to be 0; raises ``ValueError`` for one too long to compute with."""
    if isinstance(entry, FracElement) and max(len(entry.numer), len(entry.denom)) > _LONGEST:
        raise ValueError
    return field.vanishes(entry)


def _harmonics(squares, field):
    """Return the whole numbers h for a polynomial whose roots are the h^2 times one number.

    They are found in doubles, and confirmed by the recurrence. Raises ``ValueError`` where there are none so small.
    """
    known = [field.ball(c) for c in squares]
    if squares[1:] and not certain_sign(known[1]):
        raise ValueError
    roots = np.roots([float((c / known[1] ** k if k else c).mid()) for k, c in enumerate(known)]).astype(complex)
    ratios = [(root / roots[0]) ** 0.5 for root in roots]
    near = {Fraction(ratio.real).limit_denominator(_HARMONICS) for ratio in ratios}
    if 0 in near or any(min(abs(ratio - r) for r in near) > _NEAR for ratio in ratios):
        raise ValueError
    scale = Fraction(lcm(*(r.denominator for r in near)), gcd(*(r.numerator for r in near)) or 1)
    if max(near, default=0) * scale > _HARMONICS:
        raise ValueError
    return [int(r * scale) for r in near]


def _rate(parts, square, size, order):
    """Return the derivative of an order of ``P(s) (1 + q s^2)^{-n/2}`` at s = 0."""
    parts = [0, *parts, *(0,) * (order + 2)]
    for _ in range(order):
        parts = [0, *((k * parts[k + 1] + square * (k - 2 - size) * parts[k - 1]) * Fraction(1, 2)
                      for k in range(1, len(parts) - 1)), 0]
    return parts[1]


def _zeros(parts, square, size, since, field):
    """Yield (time, order, exact time or None) of zeros; where these return without end, of those around ``since``."""
    turn, whole = abs(field.ball(square or 1)).sqrt(), bool(square) and field.ball(square) > 0
    places = [(flint().arb.pi() / turn, size + 1 - len(parts), None)] if whole and len(parts) <= size else []
    for factor, order in _square_free(parts, field):
        exact = [*map(Fraction, _rational_roots(factor))] if not square else []
        for root in _real_roots(factor, field):
            times = [2 * time for time in exact if root.overlaps(ball(time))]
            places += [(time, order, times[0] if times else None) for time in _times(root, turn, square, whole)]
    if not whole:
        yield from places
        return
    for time, order, exact in places:
        period = 2 * flint().arb.pi() / turn
        if (turns := ((since - time) / period).mid().floor().unique_fmpz()) is None:
            raise ValueError
        yield from ((time + (int(turns) + k) * period, order, exact) for k in range(-1, 3))


def _times(root, turn, square, whole):
    """Return the least time at which s is a root, if any."""
    if not square:
        return [2 * root]
    if whole:
        return [2 * (root * turn).atan() / turn]
    if not (known := certain_sign(1 - abs(root * turn))):
        raise ValueError
    return [2 * (root * turn).atanh() / turn] if known > 0 else []


def _real_roots(factor, field):
    """Return the real roots of a polynomial without multiple roots; raises ``ValueError`` where they do not part."""
    fine = flint().arb(2) ** -(flint().ctx.prec * 7 // 8)
    found = flint().acb_poly([field.ball(c) for c in factor]).roots(tol=fine)
    near = [root for root in found if root.imag.contains(0)]
    if any(root is not other and root.conjugate().overlaps(other) for root in near for other in found):
        raise ValueError
    return [root.real for root in near]


def _rational_roots(factor):
    """Return the rational roots of a polynomial with rational coefficients."""
    if not all(isinstance(c, int | Fraction) for c in factor):
        return []
    found = flint().fmpq_poly([flint().fmpq(*Fraction(c).as_integer_ratio()) for c in factor]).roots()
    return [Fraction(int(root.p), int(root.q)) for root, _ in found]


def _square_free(parts, field):
    """Yield (factor, order) of a polynomial, without multiple roots in a factor (Yun)."""
    slope = _slope(parts)
    common = _gcd(parts, slope, field)
    left, rest = _divided(parts, common, field)[0], _divided(slope, common, field)[0]
    for order in count(1):
        rest = _trimmed([a - b for a, b in zip_longest(rest, _slope(left), fillvalue=0)], field)
        if len(left) == 1:
            return
        factor = _gcd(left, rest, field)
        if len(factor) > 1:
            yield factor, order
        left, rest = (_divided(part, factor, field)[0] for part in (left, rest))


def _slope(parts):
    return [k * c for k, c in enumerate(parts)][1:]


def _gcd(first, second, field):
    while second:
        first, second = second, _divided(first, second, field)[1]
    return first


def _divided(parts, divisor, field):
    """Return the quotient and the rest of polynomials, the lowest power first."""
    rest, found = [*parts], [Fraction(0)] * max(0, len(parts) - len(divisor) + 1)
    for k in reversed(range(len(found))):
        found[k] = rest[k + len(divisor) - 1] / divisor[-1] * Fraction(1)
        for i, c in enumerate(divisor):
            rest[k + i] -= found[k] * c
    return found, _trimmed(rest[: len(divisor) - 1], field)


def _trimmed(parts, field):
    """Return a polynomial without its highest powers that vanish."""
    size = next((k for k in reversed(range(len(parts))) if not _vanishes(parts[k], field)), -1) + 1
    return parts[:size]
