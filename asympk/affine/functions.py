r"""The functions F_r of an exponential, at one time or on arrays of times, and the weights of a derivative.

With z = u - i v the function ``u e^{a t} cos(w t) + v e^{a t} sin(w t)`` is ``Re z e^{(a + i w) t}``, and its
derivative has ``(a + i w) z`` in place of z. The derivative of ``t^k/k!`` adds its weight to the power k - 1.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from asympk.arithmetic import with_rest
from asympk.numbers import Arithmetic, Number

MOST_EXPONENT = 600.0


class Block(NamedTuple):
    """The functions of one eigenvalue ``decay + i turn``: ``size`` of them, or ``size`` pairs (cos, sin)."""

    decay: Any
    turn: Any
    size: int


class Arrays:
    """NumPy's functions under the names of ``arithmetic.Doubles``; exponents are cut at ``MOST_EXPONENT``."""

    cos, sin = np.cos, np.sin

    @staticmethod
    def product(a: Any, b: Any) -> tuple[Any, Any]:
        return with_rest(np, a, b)

    @staticmethod
    def exp(p: np.ndarray) -> np.ndarray:
        return np.exp(np.minimum(p, MOST_EXPONENT))

    @staticmethod
    def expm1(p: np.ndarray) -> np.ndarray:
        return np.expm1(np.minimum(p, MOST_EXPONENT))


def functions(m: Arithmetic, blocks: Sequence[Block], t: Number) -> tuple[list[Number], list[Number], Number]:
    """Return ([F_r(t)], [the contribution of F_r to a sum at t], the number of blocks that have started).

    A block has started where its exponent exceeds 1. Before, F_r contributes ``F_r(t) - F_r(0)``, which is exact to
    rounding for any t, and the base of the sum contains ``F_r(0)``. Afterwards F_r contributes ``F_r(t)`` and the base
    lacks ``F_r(0)``, so that decayed functions leave no rounding error. The blocks are sorted, the fastest first.
    """
    found: list[Number] = []
    gained: list[Number] = []
    begun = 0
    for decay, turn, count in blocks:
        p = decay * t
        size, more = m.exp(p), m.expm1(p)
        started = (abs(decay) + turn) * t > 1
        begun = begun + started
        if turn:
            half = m.sin(turn * t / 2)
            waves = [size * m.cos(turn * t), size * m.sin(turn * t)]
            gained += (started * waves[0] + (1 - started) * (more - 2 * size * half * half), waves[1])
        else:
            waves = [size]
            gained.append(started * size + (1 - started) * more)
        found += waves
        for k in range(1, count):
            waves = [wave * t / k for wave in waves]
            found += waves
            gained += waves
    return found, gained, begun


def initial(blocks: Sequence[Block]) -> list[int]:
    """Return [F_r(0)]."""
    return [int(place == 0) for _, turn, count in blocks for place in range(count * (2 if turn else 1))]


def sizes(m: Arithmetic, blocks: Sequence[Block], lo: Number, hi: Number) -> list[Number]:
    """Return bounds of |F_r| on [lo, hi]."""
    found: list[Number] = []
    for decay, turn, count in blocks:
        size = m.exp(decay * (hi if decay > 0 else lo))
        for k in range(count):
            found += (size, size) if turn else (size,)
            size = size * hi / (k + 1)
    return found


def areas(m: Arithmetic, blocks: Sequence[Block], lo: Number, hi: Number) -> list[Number]:
    """Return bounds of the integrals of |F_r| over [lo, hi]."""
    found: list[Number] = []
    for decay, turn, count in blocks:
        area = m.exp(decay * lo) * m.expm1(decay * (hi - lo)) / decay if decay else hi - lo
        for k in range(count):
            found += (area, area) if turn else (area,)
            area = area * hi / (k + 1)
    return found


def rounding_sizes(m: Arithmetic, blocks: Sequence[Block], t: Number) -> tuple[list[Number], list[Number]]:
    """Return the sizes to which the rounding errors are proportional: of the contribution of F_r at t, and of F_r(t).

    The rounding error of an exponent ``l t`` is proportional to ``|l t|``, which multiplies the size of the function.
    """
    gained: list[Number] = []
    found: list[Number] = []
    for decay, turn, count in blocks:
        size, p = m.exp(decay * t), (abs(decay) + turn) * t
        off = size * (1 + p)
        short = p <= 1
        more = short * p * 3 + (1 - short) * off
        for k in range(count):
            gained += (more, more) if turn else (more,)
            found += (off, off) if turn else (off,)
            off = off * t / (k + 1)
            more = off
    return gained, found


def rate_of(blocks: Sequence[Block], unit: Number) -> np.ndarray:
    """Return the matrix that turns the weights of the F_r in a function of time into the weights in its derivative.

    ``unit`` is the number that represents 1.
    """
    widths = [(2 if turn else 1) * count for _, turn, count in blocks]
    rate = np.full((sum(widths), sum(widths)), 0 * unit, dtype=object)
    at = 0
    for (decay, turn, count), width in zip(blocks, widths, strict=True):
        for r in range(at, at + width):
            rate[r, r] = decay
            if r + width // count < at + width:
                rate[r, r + width // count] = unit
        if turn:
            for r in range(at, at + width, 2):
                rate[r, r + 1], rate[r + 1, r] = turn, -turn
        at += width
    return rate
