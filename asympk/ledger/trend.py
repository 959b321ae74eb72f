"""The tests behind the numeric evidence: whether ratios tend to 1, and whether a residual vanishes."""

from collections.abc import Sequence
from itertools import pairwise

from asympk.numbers import Number

DIGITS = 40


def negligible(residual: Number) -> tuple[bool, str]:
    """Return (whether a residual, computed to more digits, is zero to ``DIGITS`` digits; the words for it)."""
    return bool(abs(residual) < 10**-DIGITS), f"zero to {DIGITS} digits"


def tends_to_one(ratios: Sequence[Number]) -> tuple[bool, str]:
    """Return (whether ratios, for mu falling by a constant factor, tend to 1; the ratios as text).

    Each deviation from 1 must be at most a tenth of the one before, and the first already below 1.
    """
    deviations = [abs(ratio - 1) for ratio in ratios]
    falls = all(10 * later <= earlier for earlier, later in pairwise(deviations))
    return bool(deviations[0] < 1 and falls), ", ".join(f"1{_signed(ratio - 1)}" for ratio in ratios)


def _signed(deviation):
    return f"{float(deviation):+.2e}" if deviation else ""
