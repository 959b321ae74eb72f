"""Numbers with digits of their own: scalar products in fixed point."""

import random
from fractions import Fraction

import pytest

from asympk.digits import GUARD_BITS, carrier_context, dot, fixed_point


def _exact(value):
    sign, mantissa, exponent, _ = value._mpf_
    return (-1) ** sign * int(mantissa) * Fraction(2) ** exponent


@pytest.mark.parametrize("digits", [15, 40, 200])
def test_a_scalar_product_is_right_to_the_digits_of_the_largest_numbers(digits):
    rng, ctx = random.Random(1), carrier_context(digits)
    for _ in range(50):
        left, right = ([ctx.mpf(rng.uniform(-1, 1)) / 3 * ctx.mpf(10) ** rng.randint(-60, 60) for _ in range(9)]
                       for _ in range(2))
        exact = sum(_exact(a) * _exact(b) for a, b in zip(left, right, strict=True))
        found = _exact(dot(ctx, fixed_point(ctx, left), fixed_point(ctx, right)))
        largest = max(abs(_exact(a)) for a in left) * max(abs(_exact(b)) for b in right)
        rounded = abs(exact) / 2**ctx.prec
        assert abs(found - exact) <= rounded + 9 * largest / Fraction(2) ** (ctx.prec + GUARD_BITS - 3)


def test_numbers_that_vanish_and_whole_ones_have_a_fixed_point():
    ctx = carrier_context(30)
    assert dot(ctx, fixed_point(ctx, [0, 0]), fixed_point(ctx, [1, ctx.mpf(3)])) == 0
    assert dot(ctx, fixed_point(ctx, [2, -5]), fixed_point(ctx, [1, ctx.mpf(3)])) == -13


@pytest.mark.parametrize(("value", "kind"), [("inf", ZeroDivisionError), ("nan", ZeroDivisionError), (1j, TypeError)])
def test_what_is_infinite_or_complex_has_no_fixed_point(value, kind):
    ctx = carrier_context(30)
    with pytest.raises(kind):
        fixed_point(ctx, [ctx.mpf(1), ctx.mpf(value) if isinstance(value, str) else value])
