"""Functions of numbers at places where they are 0/0 and have a limit, as sin(x)/x has at 0.

The limit is the number in which the values at places beside it, 10^(-3 d) away in generic directions, agree to d
digits, computed with 29 d digits: a pole of order 8 loses 3 d for each order, its derivatives once more.
"""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

from mpmath.ctx_mp import MPContext

from asympk.multiprecision import in_context, private_context

FLOAT_DIGITS = 16
MOST = 8  # order of a pole up to which a limit is looked for
NEAR = 3  # a place is displaced by 10^(-NEAR digits)
SPARE = NEAR * (MOST + 1) + 2  # times as many digits are taken there: derivatives have a pole of one order more
DIRECTIONS = 4
SMALL = 2.0**-14  # power of a divisor below which the rounding of its quotient is large
LEAST = 2  # a power below 10^(-LEAST digits) counts as 0
BESIDE = 8  # times as many digits for greater ones: as many as two of them lose, and their derivatives

Compiled = Callable[..., tuple]


def limits_on_floats(compiled: Callable[[MPContext], Compiled]) -> Compiled:
    """Return the limits of a function of floats, which is ``compiled`` for numbers of a context."""
    m = private_context(SPARE * FLOAT_DIGITS)
    function = compiled(m)
    return lambda *given: tuple(map(float, _limits(function, m, given)))


def with_more_digits(
    function: Compiled, divisors: Compiled, compiled: Callable[[MPContext], Compiled], m: Any
) -> Compiled:
    """Return a function of floats, or of numbers of a context ``m``, with more digits where a divisor is small.

    ``divisors`` are the powers of divisors by which it divides. Beside 0, (1 - cos(x))/x^2 loses two digits
    for each digit by which x is small.
    """
    digits = getattr(m, "dps", FLOAT_DIGITS)
    wider = cache(lambda times: (context := private_context(times * digits), compiled(context)))

    def found(*given: Any) -> tuple:
        if (least := min(map(abs, divisors(*given)))) >= SMALL:
            return function(*given)
        context, precise = wider(BESIDE)
        if least < context.mpf(10) ** (-LEAST * digits):
            context, precise = wider(SPARE)
            values = _limits(precise, context, given)
        else:
            values = precise(*(in_context(context, v) for v in given))
        return tuple(in_context(m, v) if isinstance(m, MPContext) else float(v) for v in values)

    return found


def with_limits(function: Compiled, compiled: Callable[[MPContext], Compiled], m: MPContext) -> Compiled:
    """Return a function of numbers of ``m`` that has its limits where it divides 0 by 0; see ``limits_on_floats``."""
    wider = cache(lambda digits: (context := private_context(SPARE * digits), compiled(context)))

    def found(*given: Any) -> tuple:
        try:
            return function(*given)
        except ZeroDivisionError:
            context, precise = wider(m.dps)
            return tuple(in_context(m, value) for value in _limits(precise, context, given))

    return found


def _limits(function: Compiled, m: MPContext, given: tuple) -> tuple:
    """Return the values in which a function agrees beside a place; raises ``ZeroDivisionError`` if there are none."""
    digits = m.dps // SPARE
    try:
        rows = [function(*place) for place in _displaced(m, given, digits)]
        return tuple(_agreed(m, values, digits) for values in zip(*rows, strict=True))
    except (TypeError, OverflowError):  # complex numbers, which have no order, and numbers beyond the floats
        raise ZeroDivisionError("a quotient has no limit") from None


def _displaced(m: MPContext, given: tuple, digits: int) -> Iterator[list]:
    """Yield places beside a place, in generic directions."""
    step = m.mpf(10) ** (-NEAR * digits)
    for k in range(DIRECTIONS):
        parts = ((37 * j + 53 * k * j * j + 29 * k) % 101 - m.mpf(101) / 2 for j in range(len(given)))
        yield [in_context(m, v) + step * part for v, part in zip(given, parts, strict=True)]


def _agreed(m: MPContext, values: tuple, digits: int) -> Any:
    """Return the number in which values agree that differ by no more than the places, or than rounding."""
    rounding, largest = m.mpf(10) ** -digits, max(map(abs, values))
    if max(values) - min(values) <= rounding * largest:
        return values[0]
    if largest <= rounding:
        return m.zero
    raise ZeroDivisionError("a quotient has no limit")
