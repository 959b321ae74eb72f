r"""How a solution begins: anywhere, on z = 0, on s = 0, on an edge of the static cone, beside a slow line or on it.

Derivatives decide the signs of s and z just after a start on a boundary; where a sum of doubles cannot decide, exact
fractions do.
"""

from fractions import Fraction
from functools import lru_cache, partial
from math import isqrt
from typing import Any, NamedTuple

from asympk.arithmetic import Doubles
from asympk.errors import Undecided
from asympk.numbers import Number, sign_of
from asympk.scene import MANIFOLDS
from asympk.systems.painleve_klein.flow.fastslow import FastSlow
from asympk.systems.painleve_klein.flow.segments import RodFlow, decided
from asympk.systems.painleve_klein.modes import MODES, first_signs


class RodNumbers(NamedTuple):
    """The numbers of a scene, each of them exact; ``near`` is (manifold, offset) for a start beside a slow line."""

    sigma: Any
    sigma0: Any
    mu: Any
    x: Any
    y: Any
    z: Any
    until: Any
    near: tuple | None


def beginning(flow: RodFlow, rod: RodNumbers) -> tuple[tuple[Number, ...], Number | None]:
    """Return ((x, y, s, z, sign of s, sign of z), deviation) just after the start of ``rod``.

    The deviation from the slow line is None where the state gives it accurately. For a ``near`` start the deviation
    comes from the scene, and for a start close to an unstable line from exact arithmetic.
    """
    m = flow.m
    x, y, z = m.number(rod.x), m.number(rod.y), m.number(rod.z)
    if rod.near:
        manifold, offset = rod.near
        return beside_line(flow, manifold, x, z, m.number(offset))
    kinds = {type(rod.x), type(rod.y)}
    if kinds <= {int, Fraction}:  # Python adds these exactly
        s = m.number(rod.x + rod.y)
    else:
        s = x + y if x == rod.x and y == rod.y else m.number(Fraction(rod.x) + Fraction(rod.y))
    s_sign, z_sign = sign_of(s), sign_of(z)
    if not s_sign or not z_sign:
        s_sign, z_sign, on_edge = _signs(flow, rod, s, y, z)
        s = s if z_sign else _beside_edge(flow, s, on_edge)
    deviation = _from_unstable_line(flow, rod, x, s) if s_sign * z_sign < 0 and flow.sigma > 0 else None
    return (x, y, s, z, s_sign, z_sign), deviation


def beside_line(
    flow: RodFlow, manifold: str, x: Number, z: Number, offset: Number
) -> tuple[tuple[Number, ...], Number | None]:
    """Return the start at ``offset`` in s from the slow line of the manifold's mode, and the offset as deviation.

    The deviation is None where the sign of s is not that of the manifold's mode.
    """
    name, _ = MANIFOLDS[manifold]
    line = flow.split(name)
    lifted = line.lift * x
    s = line.line + lifted + offset
    y = line.slow_rate * (x - line.rest) + offset
    s_sign = decided(flow.m, s, abs(line.line) + abs(lifted) + abs(offset)) or sign_of(1 + flow.mu * y)
    z_sign = sign_of(z)
    return (x, y, s, z, s_sign, z_sign), offset if MODES[s_sign * z_sign] == name else None


def _signs(flow, rod, s, y, z):
    """Return the ``first_signs`` by doubles if these decide, else by exact fractions.

    Even then a quantity must be exactly zero, or have a clear sign in the numbers ``m`` that the flow is computed in.
    """
    m = flow.m
    if m is Doubles and (s or not rod.x + rod.y) and (z or not rod.z):
        try:
            return first_signs(partial(decided, m), flow.sigma0, flow.mu, s, y, z)
        except Undecided:
            pass
    sigma0, mu, x, y, z = map(Fraction, (rod.sigma0, rod.mu, rod.x, rod.y, rod.z))
    seen = partial(decided, m)
    return first_signs(lambda v, size: v and seen(m.number(v), m.number(size)), sigma0, mu, x + y, y, z)


def _beside_edge(flow, s, on_edge):
    """Return the nearest edge of the static cone if s is on it, else s, which must clearly differ from the edge."""
    nearest = flow.nearest_edge(sign_of(s), s)
    if on_edge:
        return nearest
    decided(flow.m, s - nearest, abs(nearest))
    return s


def _from_unstable_line(flow, rod, x, s):
    """Return the deviation of a start from the line of slip_opposite, sigma > 0, if s - s_slow(x) would lose digits."""
    m = flow.m
    if m is Doubles and type(flow.mode("slip_opposite")) is not FastSlow:
        return None
    line = flow.split("slip_opposite")
    size = abs(s) + abs(line.line) + abs(line.lift * x)
    if not abs(s - line.line - line.lift * x) <= size / 64:
        return None
    bits = 8 * m.prec
    slope, rest = _unstable_slope(rod.sigma, rod.mu, bits)
    fall = slope * (Fraction(rod.x) - rest)
    deviation = Fraction(rod.y) - fall
    if 0 < abs(deviation) * 2 ** (bits - 2 * m.prec) < abs(fall):
        raise Undecided
    return m.number(deviation)


@lru_cache(maxsize=64)
def _unstable_slope(sigma, mu, bits):
    """Return (slope, x at rest) of ``y = slope (x - rest)``, the slow line of slip_opposite where sigma > 0.

    The slope is a Fraction: exact where it is rational, else dyadic, for speed, and correct to about ``bits`` bits.
    """
    sigma = Fraction(sigma)
    square = 1 + 4 * Fraction(mu) / sigma
    whole = square.numerator * square.denominator << 2 * bits
    digits = isqrt(whole)
    slope = -2 / (1 + Fraction(digits, square.denominator << bits))
    return slope if digits * digits == whole else _dyadic(slope, bits), -1 / sigma


def _dyadic(value, bits):
    """Return the Fraction cut to ``bits`` leading bits."""
    shift = bits + value.denominator.bit_length() - abs(value.numerator).bit_length()
    return Fraction((value.numerator << shift) // value.denominator, 1 << shift) if shift > 0 else Fraction(int(value))
