"""Numbers of many digits in private mpmath contexts: the precision of mpmath itself belongs to the user.

mpmath stores pi, log 2 and other constants with the most digits asked for so far. A thread that reads a constant while
another thread extends it gets a wrong number. ``extend`` therefore computes them under a lock, with many digits.
"""

from threading import Lock
from typing import TYPE_CHECKING

from asympk.numbers import Number, mantissa_and_exponent

if TYPE_CHECKING:
    import numpy as np
    from mpmath.ctx_mp import MPContext

_EXTENDING = Lock()
_BITS = 12_000  # least number of bits with which the constants are computed
_APART = 1 << 16  # largest difference of the exponents of numbers that are added as integers
_extended = 0


def private_context(digits: int) -> "MPContext":
    """Return a private mpmath context that works with ``digits`` digits."""
    import mpmath

    m = mpmath.MPContext()
    m.dps = digits
    extend(max(_BITS, m.prec + 200))
    return m


def extend(bits: int) -> None:
    """Compute the constants of mpmath to ``bits`` bits before several threads read them."""
    global _extended
    from mpmath.libmp import e_fixed, ln2_fixed, ln10_fixed, pi_fixed

    with _EXTENDING:
        if bits > _extended:
            for constant in (pi_fixed, ln2_fixed, ln10_fixed, e_fixed):
                constant(bits)
            _extended = bits


def in_context(m: "MPContext", value: Number) -> Number:
    """Return an int, float, exact fraction or mpf of any context as a number of ``m``, rounded to its precision."""
    if hasattr(value, "numerator") and not isinstance(value, int):
        return m.mpf(int(value.numerator)) / int(value.denominator)
    return m.mpf(value)


def as_mpf(value: Number) -> Number:
    """Return a number of a private context as an ``mpf`` of ``mpmath.mp``, with all its digits."""
    import mpmath

    return mpmath.mp.make_mpf(value._mpf_)


def whole_product(m: "MPContext", matrix: "np.ndarray", bits: int, vector: "np.ndarray") -> "np.ndarray":
    """Return ``matrix @ vector`` in numbers of the context ``m``, each entry rounded once.

    ``matrix`` (rows, n) is an array of integers in units of 2^-bits, and ``vector`` (n,) an array of numbers of ``m``.
    Entries of the vector smaller than the largest by more than 2^65536 are added separately as numbers of ``m``.
    """
    import numpy as np
    from mpmath.libmp import from_man_exp

    parts = [mantissa_and_exponent(v) for v in vector]
    exponents = [exponent for multiple, exponent in parts if multiple]
    low = min((e for e in exponents if e >= max(exponents) - _APART), default=0)
    whole = np.array([n << (exponent - low) if exponent >= low else 0 for n, exponent in parts], dtype=object)
    products = (matrix @ whole).tolist()
    found = np.array([m.make_mpf(from_man_exp(v, low - bits, m.prec, "n")) for v in products], dtype=object)
    if all(exponent >= low for exponent in exponents):
        return found
    return found + whole_product(m, matrix, bits, np.where(whole.astype(bool), m.zero, vector))
