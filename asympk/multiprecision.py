"""Numbers of many digits, in mpmath contexts of their own: mpmath's own precision belongs to the user.

mpmath keeps pi, log 2 and their like at the most digits asked for so far, and a thread that reads them while another
extends them gets a wrong number. They are therefore extended at once, under a lock, beyond what is usual here.
"""

from fractions import Fraction
from threading import Lock

_EXTENDING = Lock()
_BITS = 12_000  # of the constants, from the start
_extended = 0


def context(digits: int):
    """Return a private mpmath context that works with ``digits`` digits."""
    import mpmath

    m = mpmath.MPContext()
    m.dps = digits
    extend(max(_BITS, m.prec + 200))
    return m


def extend(bits: int):
    """Let mpmath know its constants to ``bits`` bits, before several threads ask for them."""
    global _extended
    from mpmath.libmp import e_fixed, ln2_fixed, ln10_fixed, pi_fixed

    with _EXTENDING:
        if bits > _extended:
            for constant in (pi_fixed, ln2_fixed, ln10_fixed, e_fixed):
                constant(bits)
            _extended = bits


def in_context(m, value):
    """Return an int, float, Fraction or mpf as a number of the context ``m``, a Fraction to its precision."""
    if isinstance(value, Fraction):
        return m.mpf(value.numerator) / value.denominator
    return m.mpf(value)


def as_mpf(value):
    """Return a number of a private context as one of mpmath's own, with all its digits."""
    import mpmath

    return mpmath.mp.make_mpf(value._mpf_)
