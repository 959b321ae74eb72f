"""High-precision event-driven runs for decreasing mu: the numeric side of every claim about the limit."""

from fractions import Fraction

import mpmath

from asympk.methods import solve
from asympk.scene import Scene

DIGITS = 40
MUS = tuple(Fraction(1, 10**n) for n in (3, 5, 7, 9))


def follow(start, mu, until=1, sigma=1, sigma0=None):
    """Solve one scene to 40 digits; numbers are exact (integers, fractions or strings)."""
    return solve(Scene(sigma=sigma, mu=mu, start=start, until=until, sigma0=sigma0), digits=DIGITS)


def escape_time(offset, mu):
    """Return when a run from z = 1, ``offset`` off the unstable plane Pi2 of sigma = 1, meets x + y = 0."""
    scene = Scene.near("Pi2", x=0, offset=offset, z=1, sigma=1, mu=mu, until=1)
    return solve(scene, digits=DIGITS).events[0].t


def ratios(measure, predicted, mus=MUS):
    """Return measure(mu) / predicted(mu) for each mu, computed with ten digits to spare; both return mpf."""
    with mpmath.workdps(DIGITS + 10):
        return [mpmath.mpf(measure(mu)) / number(predicted(mu)) for mu in mus]


def number(value):
    """Return a fraction, a SymPy number or an mpf as an mpf at the working precision."""
    if isinstance(value, Fraction):
        return mpmath.mpf(value.numerator) / value.denominator
    return mpmath.mpf(value.evalf(mpmath.mp.dps)._mpf_) if hasattr(value, "evalf") else mpmath.mpf(value)


def modes(start, sigma=1, mus=MUS, until=1):
    """Return the mode sequences met for decreasing mu, each once, in order of appearance."""
    return list(dict.fromkeys(follow(start, mu, until, sigma).modes for mu in mus))


def told(sequences):
    """Print mode sequences for evidence."""
    return "; ".join(" > ".join(sequence) for sequence in sequences)
