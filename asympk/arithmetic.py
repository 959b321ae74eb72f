"""The numbers a flow is computed in: doubles, or mpmath numbers of a private context of any precision."""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from asympk.errors import Undecided
from asympk.numbers import Arithmetic, Number

SPARE_DIGITS = 30  # beyond those asked for, of the first run
MOST_DIGITS = 1000  # that may be asked of a closed form
LARGEST_DOUBLE = 308  # a power of ten
UNIT = 2.0**-53  # by which rounding makes a double wrong at most, relative to it


class Doubles:
    """Python's floats and ``math``; ``margin`` is the relative size below which a sign is not trusted.

    ``slack`` is what rounding may have made of a state at an event, relative to it.
    """

    exp, expm1, log, log1p, sqrt = math.exp, math.expm1, math.log, math.log1p, math.sqrt
    sin, cos, atan2, pi = math.sin, math.cos, math.atan2, math.pi
    prec, eps, root_tol, margin, slack, soon = 53, 2.0**-52, 1e-5, 1e-13, 2.0**-48, 0.5
    most_exponent, largest = 700.0, math.inf
    number = float

    @staticmethod
    def guess(segment: Any, find: str, *arguments: float) -> None:
        """Return None: a root in doubles is found from the bracket alone."""


def flow_context(largest: int) -> Arithmetic:
    """Return a private mpmath context that can serve as ``m``; mpmath's own precision is not touched.

    Numbers beyond ``largest`` (a power of ten) are refused by the flow.
    """
    from asympk import multiprecision

    m = multiprecision.private_context(largest)
    m.expm1 = lambda p: _expm1(m, p)
    m.guess = lambda segment, find, *arguments: _guess(m, segment, find, *arguments)
    m.number = lambda value: multiprecision.in_context(m, value)
    m.most_exponent = m.inf
    m.soon = m.mpf(2) ** -16
    m.largest = m.mpf(10) ** largest
    return m


def set_digits(m: Arithmetic, digits: int, tie: bool = False) -> None:
    """Let the context work with ``digits`` digits from now on; with ``tie`` every sign counts as it is."""
    m.dps = digits
    m.root_tol = m.mpf(10) ** (-0.35 * digits)
    m.slack = m.mpf(10) ** (-0.8 * digits)
    m.margin = m.zero if tie else m.slack


def agreed(
    follow: Callable[[int, bool], Any], distance: Callable[[Any, Any], Number | None], digits: int, most: int
) -> tuple[Any, Number]:
    """Return (run, error): runs at two precisions agree to ``digits`` digits, and the error is their distance.

    ``follow(working, tie)`` runs with so many digits, or raises ``Undecided``; ``distance`` of two runs is None where
    their events differ. The digits at work are doubled until the runs agree; with ``most`` of them or more, ``tie``
    takes a sign within the margin of rounding as it is. Raises ``Undecided`` where no runs agree.
    """
    working = digits + SPARE_DIGITS
    while working < 2 * most:
        with suppress(Undecided):
            coarse, fine = (follow(n, working >= most) for n in (working, working + 8 + digits // 4))
            error = distance(coarse, fine)
            if error is not None and error * 10**digits < 1:
                return fine, error
        working *= 2
    raise Undecided(f"the course of events cannot be told with {working // 2} digits: it hangs on a sign that they do "
                    "not decide, or grows beyond them; take a smaller until or another start")  # fmt: skip


def _expm1(m, p):
    from mpmath.libmp import fone, mpf_exp, mpf_sub

    lost = -m.mag(p) if p else 0
    if lost > m.prec:
        return p
    return m.make_mpf(mpf_sub(mpf_exp(p._mpf_, m.prec + max(0, lost) + 8, "n"), fone, m.prec, "n"))


def _guess(m, segment, find, *arguments):
    """Return the root that doubles find for the same motion, or None where they cannot."""
    try:
        shadow = segment.rounded(Doubles)
        return m.mpf(getattr(shadow, find)(*map(float, arguments)))
    except (ArithmeticError, ValueError):
        return None
