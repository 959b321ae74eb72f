r"""Zeros of guards that no sign shows: a guard touches 0 and rises again, or is 0 at the very end of a motion.

They are known where a guard is a polynomial of the time with exact coefficients (Lemma 16), or a wave
``c - c cos(w t + p)`` (Lemma 20). ``asympk.certify.affine`` cuts the motion there, and proves the mode that follows.
"""

from collections.abc import Sequence
from fractions import Fraction
from math import comb
from typing import Any, NamedTuple

from asympk.certify.balls import Ball, ball, certain_sign, flint
from asympk.certify.families import Family
from asympk.certify.rows import ExactEntries, exact_value, quotient, row_rate
from asympk.certify.segments import AffineGuard, EnclosedSegment


class Zero(NamedTuple):
    """The ``span`` from the start of a mode to a zero of guards, its exact time or None, and what is ``lost`` there.

    ``lost`` are the guards that vanish, each followed by those of its derivatives that vanish.
    """

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


def multiple_roots(coefficients: Sequence[Any]) -> list[Fraction]:
    """Return the rational roots of a polynomial at which its derivative vanishes, too."""
    if not all(isinstance(c, int | Fraction) for c in coefficients):
        return []
    fmpq = flint().fmpq
    found = flint().fmpq_poly([fmpq(*Fraction(c).as_integer_ratio()) for c in coefficients]).roots()
    return [Fraction(int(root.p), int(root.q)) for root, order in found if order > 1]


def span_of_wave(guard: AffineGuard, segment: EnclosedSegment) -> Ball | None:
    """Return the span from the start of a mode to the first zero of a guard ``c - c cos(w t + p)``, or None.

    The sine and the cosine of the phase are as ``w g'`` to ``g''`` at the start.
    """
    start, field = segment.start, segment.start.field
    rows = [g.row for g in derivatives(guard, segment, 4)]
    square = _rational(quotient(rows[3], rows[1], segment.mode.kept, field), field)
    value, rate, bend = (_rational(exact_value(row, start), field) for row in rows[:3])
    if square is None or not square < 0 or value is None or rate is None:
        return None
    turn, around = ball(-square).sqrt(), 2 * flint().arb.pi()
    if not (value or rate):
        return around / turn if guard.touching == 2 else None
    if bend is None or value * (2 * bend - square * value) != rate**2 or not bend > square * value:
        return None
    phase = flint().arb.atan2(ball(rate) * turn, ball(bend))
    return (-phase if rate < 0 else around - phase) / turn


def _rational(entry: Any, field: ExactEntries) -> Fraction | None:
    """Return an exact entry that is the same all over the box, else None."""
    found = None if entry is None else field.expression(entry)
    return Fraction(found) if found is not None and found.is_Rational else None
