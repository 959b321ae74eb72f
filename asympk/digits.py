"""Carriers: numbers that carry their digits. They print, compute and pickle at their own precision in any thread.

An ``mpmath.mpf`` rounds to the precision of the module ``mpmath``, which any thread may change at any time. A carrier
is an ``mpmath.mpf``, too, but its context is private and has a fixed precision. A carrier prints all of its digits, and
arithmetic with a carrier on either side keeps them. ``value.context`` has functions of this precision, such as ``sin``.
"""

from collections.abc import Iterable
from functools import lru_cache
from operator import mul
from typing import Any, NamedTuple

from asympk import multiprecision
from asympk.errors import TooLarge

LEAST = 15  # digits with which a carrier of fewer digits computes
SHOWN_OF_ERRORS = 3  # digits of an error
GUARD_BITS = 16  # bits of a vector in fixed point beyond the precision of its numbers
_REFLECTED = ("__radd__", "__rsub__", "__rmul__", "__rtruediv__", "__rpow__", "__rmod__")


@lru_cache(maxsize=256)
def carrier_context(digits: int) -> Any:
    """Return the mpmath context of carriers of ``digits`` digits; a caller must not change its precision."""
    import mpmath

    found = multiprecision.private_context(max(digits, LEAST))
    members = {"__slots__": (), "context": found, "digits": digits, "__reduce__": _reduce,
            "__repr__": lambda self: f"mpf('{self}')", "__str__": lambda self: self.context.nstr(self, self.digits),
            "__hash__": mpmath.mpf.__hash__}
    carrier: Any = type("mpf", (mpmath.mpf,), members | {name: _reflected(name) for name in _REFLECTED})
    carrier._ctxdata = [carrier, object.__new__, found._prec_rounding]
    found.mpf, found.types = carrier, [carrier, found.mpc, found.constant]
    found.init_builtins()
    return found


def carried(value: Any, digits: int) -> Any:
    """Return a number, an exact fraction or an mpf of any context, as a carrier of ``digits`` digits."""
    return multiprecision.in_context(carrier_context(digits), value)


class FixedPoint(NamedTuple):
    """A vector of numbers as integer ``multiples`` of 2**exponent."""

    multiples: tuple[int, ...]
    exponent: int


def fixed_point(ctx: Any, values: Iterable) -> FixedPoint:
    """Return numbers in fixed point, with ``GUARD_BITS`` more bits than the largest of them has in ``ctx``.

    Raises ``ZeroDivisionError`` for infinite numbers, and ``TypeError`` for complex numbers.
    """
    parts = [_finite(ctx.convert(value)) for value in values]
    lowest = max((exponent + bits for _, mantissa, exponent, bits in parts if mantissa), default=0)
    lowest -= ctx.prec + GUARD_BITS
    return FixedPoint(tuple(-_shifted(m, e - lowest) if sign else _shifted(m, e - lowest) for sign, m, e, _ in parts),
                      lowest)


def dot(ctx: Any, left: FixedPoint, right: FixedPoint) -> Any:
    """Return the scalar product as a carrier of ``ctx``; integers are multiplied far faster than carriers."""
    from mpmath.libmp import from_man_exp

    total = sum(map(mul, left.multiples, right.multiples))
    return ctx.make_mpf(from_man_exp(total, left.exponent + right.exponent, *ctx._prec_rounding))


def _finite(value: Any) -> tuple[int, int, int, int]:
    """Return the sign, the mantissa, the exponent and the bits of an mpf."""
    if not hasattr(value, "_mpf_"):
        raise TypeError(f"{value} is complex")
    if value._mpf_[2] and not value._mpf_[1]:  # the form of an infinity or a NaN in libmp
        raise ZeroDivisionError(f"{value} is not finite")
    return value._mpf_


def _shifted(mantissa: int, places: int) -> int:
    return mantissa << places if places >= 0 else mantissa >> -places


def double(value: Any) -> float:
    """Return an mpf as a double; raises ``TooLarge`` beyond the range of doubles."""
    rounded = float(value)
    if abs(rounded) == float("inf"):
        raise TooLarge(f"the path reaches 1e{int(value.context.log10(abs(value)))}, beyond the range of doubles: "
                       "ask for more digits, or a smaller until")
    return rounded


def _reflected(name: str) -> Any:
    """Return a reflected operator: Python calls it in place of the operator of a plain mpf on the left."""

    def operator(self: Any, other: Any) -> Any:
        return getattr(self.context.mpf.__base__, name)(self, other)

    return operator


def _reduce(self: Any) -> tuple:
    sign, mantissa, exponent, bits = self._mpf_
    return _restored, (self.digits, (int(sign), int(mantissa), int(exponent), int(bits)))


def _restored(digits: int, parts: tuple) -> Any:
    return carrier_context(digits).make_mpf(parts)
