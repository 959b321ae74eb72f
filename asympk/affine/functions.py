r"""The functions F_r of an exponential, at one time or on arrays of times, and the weights of a derivative.

With z = u - i v the function ``u e^{a t} cos(w t) + v e^{a t} sin(w t)`` is ``Re z e^{(a + i w) t}``, and its
derivative has ``(a + i w) z`` in place of z. The derivative of ``t^k/k!`` adds its weight to the power k - 1.

Of eigenvalues near one another ``t^k/k! e^{l t}`` becomes the divided difference ``E_k(t)`` of ``e^{z t}`` at the first
k + 1 of them, so that no weight is divided by a difference. With the nodes l_0, l_1, ..

    E_k' = E_{k-1} + l_k E_k,      |E_k| <= t^k/k! e^{max Re l t},

the latter by Hermite and Genocchi; ``_bounds`` has closer ones. A cluster that contains its conjugates begins with a
real node; its functions are Re E_k, and a pair ``a +- i w`` stands side by side:
``(Re E_k)' = E_{k-1} + a Re E_k - w^2 E_{k+1}``.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from asympk.arithmetic import Doubles, with_rest
from asympk.numbers import Arithmetic, Number

MOST_EXPONENT = 600.0
_QUARTER = 1.57  # of a turn
_TERMS, _BITS_A_TERM = 6, 4  # of the series of exp: 14 at arguments of 1/4
_SPARE_BITS = 16


class Block(NamedTuple):
    """The functions of one eigenvalue ``decay + i turn``: ``size`` of them, or ``size`` pairs (cos, sin).

    Of several eigenvalues it is the first, and ``apart`` are the distances of the others from it; else this is empty.
    """

    decay: Any
    turn: Any
    size: int
    apart: tuple = ()

    @property
    def fastest(self) -> Any:
        """A bound of the modulus of the eigenvalues, which is ``|decay| + turn`` of a single one."""
        return abs(self.decay) + self.turn + max(map(abs, self.apart), default=0)


class Arrays:
    """NumPy's functions under the names of ``arithmetic.Doubles``; exponents are cut at ``MOST_EXPONENT``."""

    cos, sin, least, prec, eps = np.cos, np.sin, np.minimum, Doubles.prec, Doubles.eps

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
    for decay, turn, count, apart in blocks:
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
        for other in _divided(m, apart, t) if apart else ():
            waves = [wave * t for wave in waves]
            across = [waves[0] * other.real - waves[-1] * other.imag * bool(turn)]
            across += [waves[0] * other.imag + waves[1] * other.real] if turn else []
            found += across
            gained += across
        for k in range(1, 1 if apart else count):
            waves = [wave * t / k for wave in waves]
            found += waves
            gained += waves
    return found, gained, begun


def _divided(m, apart, t):
    """Return the divided differences of exp at 0 and the first k of ``apart`` times t, k > 0."""
    return _squared(m, apart, t) if m in (Doubles, Arrays) else _tabled(m, [m.zero, *(d * t for d in apart)])


def _tabled(m, nodes):
    """Return divided differences in mpmath numbers, by a table with as many more bits as its divisors take."""
    found = list[Number]()
    for last in range(2, len(nodes) + 1):
        some = sorted(nodes[:last], key=lambda node: (m.re(node), m.im(node)))
        gaps = [[(a, b) for a, b in zip(some, some[k:], strict=False) if a != b] for k in range(1, last)]
        lost = sum(max(0, -min((int(m.mag(b - a)) for a, b in row), default=0)) for row in gaps)
        with m.workprec(m.prec + lost + _SPARE_BITS):
            row = powers = [m.exp(node) for node in some]
            for k in range(1, last):
                row = [(d - c) / (b - a) if a != b else power / math.factorial(k)
                       for a, b, c, d, power in zip(some, some[k:], row, row[1:], powers, strict=False)]
        found.append(+row[0])
    return found


def _squared(m, apart, t):
    """Return divided differences in doubles, on arrays of times, too, by scaling and squaring.

    They are the first row of the exponential of a matrix with these on its diagonal and 1 beside it. An error of
    rounding grows by ``|apart| t``, as that of an exponent does; once no digits are left, t goes no further.
    """
    most = max(map(abs, apart))
    t = m.least(t, 1 / (most * m.eps)) if most else t
    length = math.frexp(float(np.max(most * t, initial=0)))[1]
    halvings = max(0, length + 2)
    nodes, rows = [0 * t, *(d * t * 2.0**-halvings for d in apart)], range(len(apart) + 1)
    found = [[int(i == j) + 0 * t for j in rows[i:]] for i in rows]  # the part above the diagonal
    gains = [*nodes]  # what the diagonal exceeds 1 by, of which 1 would hide the digits of times far before the last
    for k in range(_TERMS + m.prec // (_BITS_A_TERM + halvings - length), 0, -1):
        for i, node in enumerate(nodes):
            later = zip(found[i][1:], found[i + 1] if i < rows[-1] else (), strict=True)
            gains[i] = node * found[i][0] / k
            found[i] = [1 + gains[i], *((node * own + below) / k for own, below in later)]
    for _ in range(halvings):
        gains = [gain * (2 + gain) for gain in gains]
        found = [[1 + gains[i], *(sum(found[i][n] * found[i + n][j - n] for n in range(j + 1)) * 0.5**j
                                  for j in range(1, len(found[i])))] for i in rows]
    return found[0][1:]


def initial(blocks: Sequence[Block]) -> list[int]:
    """Return [F_r(0)]."""
    return [int(place == 0) for _, turn, count, _ in blocks for place in range(count * (2 if turn else 1))]


def sizes(m: Arithmetic, blocks: Sequence[Block], lo: Number, hi: Number) -> list[Number]:
    """Return bounds of |F_r| on [lo, hi]."""
    found: list[Number] = []
    for block in blocks:
        found += _bounds(m, block, m.exp(block.decay * (hi if block.decay > 0 else lo)), hi)
    return found


def areas(m: Arithmetic, blocks: Sequence[Block], lo: Number, hi: Number) -> list[Number]:
    """Return bounds of the integrals of |F_r| over [lo, hi]."""
    found: list[Number] = []
    for block in blocks:
        decay = block.decay
        found += _bounds(m, block, m.exp(decay * lo) * m.expm1(decay * (hi - lo)) / decay if decay else hi - lo, hi)
    return found


def _bounds(m, block, size, t):
    """Return bounds of the functions of a block up to t, where ``size`` bounds the first.

    With g the distance of the first and the last of its nodes, a divided difference is at most 1/g times the sum of
    those without the first and without the last: near eigenvalues beat, and grow with the time until then only.
    """
    _, turn, count, apart = block
    width, gaps, bounds = 2 if turn else 1, _gaps(apart, m.eps) if apart else (), [size] * count
    found = bounds[:1] * width
    for k in range(1, count):
        size = size * t / k
        if gaps:
            pairs = zip(pairwise(bounds), gaps[k - 1], strict=True)
            bounds = [m.least(size, (a + b) / gap) if gap > 0 else size for (a, b), gap in pairs]
        found += [bounds[0] if gaps else size] * width
    return found


@lru_cache(maxsize=1024)
def _gaps(apart, eps):
    """Return lower bounds of ``|l_{i+k} - l_i|``, by k > 0 and i."""
    nodes, doubt = (0, *apart), 4 * eps * max(map(abs, apart))
    return [[abs(b - a) - doubt for a, b in zip(nodes, nodes[k:], strict=False)] for k in range(1, len(nodes))]


def least_at_ends(block: Block, hi: Number) -> list[tuple[bool, ...]]:
    """Return, by function, for which weights, positive (True) or not, it is least at an end of any interval up to hi.

    Of real eigenvalues the k-th function is the convolution of k + 1 exponentials: positive and log-concave. So it has
    one maximum at most, and none where k is 0 or the first does not decay: then it rises. Before a quarter of a turn so
    do pairs, whose parts are ``e^{a t} cos(w t)`` and ``e^{a t} sin(w t)/w``.
    """
    if block.turn or any(abs(apart.imag) * hi > _QUARTER for apart in block.apart):
        return [()] * (2 * block.size if block.turn else block.size)
    return [(True, False) if not k or block.decay >= 0 else (True,) for k in range(block.size)]


def rounding_sizes(m: Arithmetic, blocks: Sequence[Block], t: Number) -> tuple[list[Number], list[Number]]:
    """Return the sizes to which the rounding errors are proportional: of the contribution of F_r at t, and of F_r(t).

    The rounding error of an exponent ``l t`` is proportional to ``|l t|``, which multiplies the size of the function.
    """
    gained: list[Number] = []
    found: list[Number] = []
    for block in blocks:
        size, p = m.exp(block.decay * t), block.fastest * t
        off = size * (1 + p)
        short = p <= 1
        more = short * p * 3 + (1 - short) * off
        bounds, width = _bounds(m, block, off, t), 2 if block.turn else 1
        gained += [more] * width + bounds[width:]
        found += bounds
    return gained, found


def rate_of(blocks: Sequence[Block], unit: Number) -> np.ndarray:
    """Return the matrix that turns the weights of the F_r in a function of time into the weights in its derivative.

    ``unit`` is the whole number that represents 1; distances of eigenvalues are pairs of such.
    """
    widths = [(2 if turn else 1) * count for _, turn, count, _ in blocks]
    rate = np.full((sum(widths), sum(widths)), 0 * unit, dtype=object)
    at = 0
    for (decay, turn, count, apart), width in zip(blocks, widths, strict=True):
        step = width // count
        for k, (other, across) in enumerate(((0, 0), *apart) if apart else [(0, 0)] * count):
            r = at + k * step
            for place in range(r, r + step):
                rate[place, place] = decay + other
                if k + 1 < count:
                    rate[place, place + step] = unit
            if turn:
                rate[r, r + 1], rate[r + 1, r] = turn + across, -turn - across
            elif across > 0:
                rate[r + 1, r] = -across * across // unit
        at += width
    return rate
