"""The numbers a flow is computed in: doubles, or mpmath numbers of a private context of any precision."""

import math
from fractions import Fraction


class Undecided(ArithmeticError):
    """A sign on which the course of events hangs is within the rounding errors: more digits must decide."""


class Doubles:
    """Python's floats and ``math``; ``margin`` is the relative size below which a sign is not trusted."""

    exp, expm1, log, log1p, sqrt = math.exp, math.expm1, math.log, math.log1p, math.sqrt
    sin, cos, atan2, pi = math.sin, math.cos, math.atan2, math.pi
    eps, root_tol, margin, most_exponent = 2.0**-52, 1e-9, 1e-13, 700.0
    number = float


def multiprecision(digits, number=None, margin=True):
    """Return a private mpmath context of ``digits`` digits; mpmath's global precision is not touched."""
    import mpmath

    m = mpmath.MPContext()
    m.dps = digits
    m.root_tol = m.mpf(10) ** (-0.6 * digits)
    m.margin = m.mpf(10) ** (-0.6 * digits) if margin else m.zero
    m.most_exponent = m.inf
    m.number = number or (lambda value: exact(m, value))
    return m


def exact(m, value):
    """Return an int, float or Fraction as a number of ``m``."""
    if isinstance(value, Fraction):
        return m.mpf(value.numerator) / value.denominator
    return m.mpf(value)
