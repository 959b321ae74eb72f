"""The numbers in which a flow is computed: doubles, or mpmath numbers of a private context of any precision.

A flow uses the functions and tolerances of an object ``m``: ``Doubles``, or a context of ``flow_context``.
"""

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from asympk.errors import Undecided
from asympk.numbers import Arithmetic, Number

SPARE_DIGITS = 30  # digits of the first run beyond those asked for
LARGEST_DOUBLE = 308  # the power of ten beyond which there are no doubles
DIGITS_OF_DOUBLES = 17  # digits that tell every double from its neighbours
HALVES = 2.0**27 + 1  # a double times this, rounded, parts it into two numbers of at most 26 digits (Veltkamp 1968)
UNIT = 2.0**-53  # unit roundoff: the largest relative error of rounding to a double


class Doubles:
    """Python's floats and ``math`` as the object ``m`` of a flow.

    ``margin`` is the relative size below which a sign is not trusted. ``slack`` is the relative error that rounding may
    cause in a state at an event, ``root_tol`` that at which the search for a root ends. Closed forms that serve arrays,
    too, ask ``choose``, ``least``, ``most`` and ``any`` where others branch.
    """

    exp, expm1, log, log1p, sqrt = math.exp, math.expm1, math.log, math.log1p, math.sqrt
    sin, cos, atan2, pi, fsum = math.sin, math.cos, math.atan2, math.pi, math.fsum
    prec, eps, root_tol, margin, slack, soon = 53, 2.0**-52, 1e-5, 1e-13, 2.0**-48, 0.5
    most_exponent, largest, inf = 700.0, math.inf, math.inf
    number, least, most, any = float, min, max, bool

    @staticmethod
    def choose(condition: bool, yes: Callable, no: Callable, *given: Any) -> Any:
        """Return ``yes(*given)`` if the condition holds, else ``no(*given)``."""
        return yes(*given) if condition else no(*given)

    @staticmethod
    def product(a: float, b: float) -> tuple[float, float]:
        """Return a product and what rounding took from it."""
        return with_rest(math, a, b)

    @staticmethod
    def split(value: Fraction) -> tuple[float, float]:
        """Return a value as the sum of two doubles."""
        return (near := float(value)), float(value - Fraction(near))

    @staticmethod
    def guess(segment: Any, axis: int, *arguments: float) -> None:
        """Return None: a root in doubles is found from the bracket alone."""


def with_rest(m: Any, a: Any, b: Any) -> tuple[Any, Any]:
    """Return a product of doubles, or of arrays, and what rounding took from it (Dekker 1971); ``m`` has ``frexp``."""
    (a, i), (b, j) = m.frexp(a), m.frexp(b)
    (a_high, a_low), (b_high, b_low) = _halved(a), _halved(b)
    rounded = a * b
    rest = a_high * b_high - rounded + a_high * b_low + a_low * b_high + a_low * b_low
    return m.ldexp(rounded, i + j), m.ldexp(rest, i + j)


def _halved(a):
    high = HALVES * a - (HALVES * a - a)
    return high, a - high


def flow_context(largest: int) -> Arithmetic:
    """Return a private mpmath context as the object ``m`` of a flow; the precision of mpmath itself is not changed.

    The flow refuses numbers larger than ten to the power ``largest``.
    """
    from asympk import multiprecision

    m = multiprecision.private_context(largest)
    m.expm1 = lambda p: _expm1(m, p)
    m.guess = lambda segment, axis, *arguments: _guess(m, segment, axis, *arguments)
    m.number = lambda value: multiprecision.in_context(m, value)
    m.split = lambda value: (m.number(value), m.zero)
    m.product = lambda a, b: (a * b, m.zero)
    m.most_exponent = m.inf
    m.least, m.most, m.any, m.choose = min, max, bool, Doubles.choose
    m.soon = m.mpf(2) ** -16
    m.largest = m.mpf(10) ** largest
    return m


def set_digits(m: Arithmetic, digits: int, tie: bool = False) -> None:
    """Set the precision of the context to ``digits`` digits; with ``tie`` the margin is 0: every sign is trusted."""
    m.dps = digits
    m.root_tol = m.mpf(10) ** (-0.35 * digits)
    m.slack = m.mpf(10) ** (-0.8 * digits)
    m.margin = m.zero if tie else m.slack


def agreed(
    follow: Callable[[int, bool], Any], distance: Callable[[Any, Any], Number | None], digits: int, most: int
) -> tuple[Any, Number]:
    """Return (run, error): two runs of different precision agree to ``digits`` digits, and the error is their distance.

    ``follow(working, tie)`` returns the run with ``working`` digits, or raises ``Undecided``. ``distance`` of two runs
    is None if their events differ. The working digits are doubled until the runs agree; from ``most`` on, ``tie`` is
    True, and a sign within the margin of rounding is trusted. Raises ``Undecided`` where no two runs agree, with the
    words of the last run if it gave any.
    """
    working, words = digits + SPARE_DIGITS, ""
    while working < 2 * most:
        try:
            coarse, fine = (follow(n, working >= most) for n in (working, working + 8 + digits // 4))
            error = distance(coarse, fine)
            if error is not None and error * 10**digits < 1:
                return fine, error
            words = ""
        except Undecided as reason:
            words = str(reason)
        working *= 2
    raise Undecided(words or f"the sequence of events is not decided with {working // 2} digits: it depends on a sign "
                    "that is within rounding, or errors grow too large; take a smaller until or another start")


def _expm1(m, p):
    from mpmath.libmp import fone, mpf_exp, mpf_sub

    lost = -m.mag(p) if p else 0
    if lost > m.prec:
        return p
    return m.make_mpf(mpf_sub(mpf_exp(p._mpf_, m.prec + max(0, lost) + 8, "n"), fone, m.prec, "n"))


def _guess(m, segment, axis, *arguments):
    """Return the root that the same motion has in doubles, or None where doubles fail."""
    try:
        return m.mpf(segment.rounded(Doubles).root(axis, *map(float, arguments)))
    except (ArithmeticError, ValueError):
        return None
