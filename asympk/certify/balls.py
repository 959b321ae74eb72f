"""Ball arithmetic (python-flint's ``arb``): numbers and expressions as balls that certainly contain them.

No ball is made from a rounded number: a Fraction becomes a quotient of integers, a float the dyadic rational that the
float is. A comparison of balls is true only if every pair of points of the two balls satisfies it.
"""

import copyreg
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from fractions import Fraction
from math import prod
from threading import RLock
from types import ModuleType
from typing import Any, TypeAlias

import sympy as sp

from asympk.errors import MissingPackage
from asympk.numbers import Number

Ball: TypeAlias = Any  # a flint.arb
_WORKING = RLock()


class Refused(ArithmeticError):
    """Raised where nothing can be proven; the message begins with the name of the obstacle, then says where."""


def flint() -> ModuleType:
    """Return the module ``flint``; raises ``MissingPackage`` where it is not installed."""
    try:
        import flint as module
    except ImportError:
        raise MissingPackage("a certificate needs python-flint: pip install 'asympk[certified]'") from None
    copyreg.pickle(module.arb, _pickled)
    return module


def _pickled(value):
    return _from_pickle, tuple(tuple(map(int, part.man_exp())) for part in (value.mid(), value.rad()))


def _from_pickle(middle, radius):
    """Return the ball of a pickle, whose radius may be rounded up."""
    return flint().arb(middle, radius)


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Compute with balls of ``bits`` bits inside the block, which admits one thread at a time.

    python-flint has one precision for all threads. A certificate changes no other state of the process, and the former
    precision is restored after the block.
    """
    with _WORKING, flint().ctx.workprec(bits):
        yield


def ball(value: Number) -> Ball:
    """Return an int, float or Fraction as a ball, exact up to the working precision."""
    exact = Fraction(value)
    module = flint()
    return module.arb(module.fmpq(exact.numerator, exact.denominator))


def hull(low: Number, high: Number) -> Ball:
    """Return a ball that contains the interval from ``low`` to ``high``, rationals or balls."""
    ends = [end if isinstance(end, flint().arb) else ball(end) for end in (low, high)]
    return ends[0] if low == high else ends[0].union(ends[1])


def certain_sign(value: Ball) -> int:
    """Return 1 if every point of the ball is positive, -1 if every point is negative, and 0 otherwise."""
    return 1 if value > 0 else -1 if value < 0 else 0


def common(first: Ball, second: Ball) -> Ball:
    """Return a ball around the intersection of two enclosures of one number; raises ``Refused`` if disjoint."""
    if not (first.is_finite() and second.is_finite()):
        return second if second.is_finite() else first
    if not first.overlaps(second):
        raise Refused(f"contradiction: {first} and {second} enclose one number but are disjoint")
    return first.intersection(second)


def times(first: Ball, second: Ball) -> Ball:
    """Return the product, of two wide balls from their ends: the product of midpoints and radii may lose its sign."""
    if first.rel_accuracy_bits() > 8 or second.rel_accuracy_bits() > 8:
        return first * second
    if not (signs := certain_sign(first) * certain_sign(second)):
        return first * second
    return signs * (first.abs_lower() * second.abs_lower()).union(first.abs_upper() * second.abs_upper())


def whole_power(base: Ball, exponent: int) -> Ball:
    """Return an integer power, from the ends of the ball: by its midpoint, squares might be negative, or not finite."""
    if exponent < 0:
        return 1 / whole_power(base, -exponent)
    low, high = (base.lower(), base.upper()) if exponent % 2 else (base.abs_lower(), base.abs_upper())
    return (low**exponent).union(high**exponent)


def ball_of(expr: sp.Expr, values: Mapping[sp.Symbol, Ball]) -> Ball:
    """Return a SymPy expression as a ball, ``values`` mapping its symbols to balls.

    Raises ``Refused`` for a function without an enclosure here, and for a float.
    """
    if expr.is_Symbol:
        return values[expr]
    if expr.is_Rational:
        return ball(Fraction(int(expr.p), int(expr.q)))
    if expr in (sp.pi, sp.E):
        return flint().arb.pi() if expr is sp.pi else ball(1).exp()
    parts = [ball_of(argument, values) for argument in expr.args]
    if expr.is_Add:
        return sum(parts[1:], parts[0])
    if expr.is_Mul:
        return prod(parts[1:], start=parts[0])
    if expr.is_Pow and expr.exp.is_Integer:
        return whole_power(parts[0], int(expr.exp))
    if expr.is_Pow and abs(expr.exp) == sp.Rational(1, 2):
        return parts[0].sqrt() if expr.exp > 0 else parts[0].rsqrt()
    if expr.is_Pow:
        return parts[0] ** parts[1]
    if expr.func in (sp.sin, sp.cos, sp.tan, sp.exp, sp.log, sp.sinh, sp.cosh, sp.tanh, sp.atan):
        return getattr(parts[0], expr.func.__name__)()
    if expr.func is sp.Abs:
        return abs(parts[0])
    if expr.func is sp.sign:
        return ball(certain_sign(parts[0])) if certain_sign(parts[0]) else hull(-1, 1)
    if expr.func is sp.DiracDelta:
        if not certain_sign(parts[0]):
            raise Refused(f"irrational: a function that jumps where {expr.args[0]!s:.80} = 0 has no enclosure there")
        return ball(0)
    raise Refused(f"irrational: {expr!s:.80} has no enclosure")
