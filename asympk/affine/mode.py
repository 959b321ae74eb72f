r"""An affine mode in numbers: ``W' = M W`` with W = (w, 1), its exponential and its guards, and a segment from a start.

A guard is a function ``g = c.w + d`` that is positive inside the mode. Its weights ``(c, d) D_r`` are computed in many
digits before they are rounded, so that the weight of a fast part which does not affect the guard is exactly 0.
``AffineMode`` holds exact data, ``AffineFlow`` the tables of one arithmetic, ``ClosedSegment`` the motion from a start.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from sys import float_info
from typing import Any, NamedTuple

import numpy as np

from asympk.affine.events import Guards, first_root
from asympk.affine.exponential import DIGITS_FOR_DOUBLES, Exponential, exponential
from asympk.affine.functions import Arrays, Block, functions, initial, rate_of, rounding_sizes
from asympk.affine.mesh import Mesh
from asympk.affine.polynomial import in_whole_numbers
from asympk.arithmetic import Doubles
from asympk.errors import Undecided
from asympk.multiprecision import whole_product
from asympk.numbers import Arithmetic, Number

_LOST_BITS = 64
_NEAR = 1e-6
_WAVE = 0, 0, 0, None  # the power, the decay and the amplitude of a wave alone


@dataclass(frozen=True)
class AffineMode:
    """``w' = A w + b`` while all guards ``c.w + d`` are positive: the ``rows`` (A, b), and ``guards`` (c, d)."""

    rows: tuple[tuple[Fraction, ...], ...]
    guards: tuple[tuple[Fraction, ...], ...] = ()

    @property
    def homogeneous(self) -> tuple[tuple[Fraction, ...], ...]:
        """The rows of M in ``(w, 1)' = M (w, 1)``."""
        return (*self.rows, (Fraction(0),) * (len(self.rows) + 1))

    def touches(self, guard: int, waves: Sequence[tuple], zeros: Collection[int]) -> bool:
        """Tell whether a guard is ``c + a cos(w t) + b sin(w t)`` with c^2 = a^2 + b^2, c > 0: it never falls below 0.

        It is so while the states ``zeros`` stay 0; the ``waves`` are those of ``forcing.with_waves``.
        """
        row, states = self.guards[guard], len(self.rows) - len(waves)
        forced = [(c, wave) for c, wave in zip(row[states:], waves, strict=False) if c]
        kinds = {(power, *decay, place, turn) for _, (power, decay, turn, _, place) in forced}
        alone = all(k in zeros for k, c in enumerate(row[:states]) if c) and [kind[:4] for kind in kinds] == [_WAVE]
        sizes = (sum(c for c, wave in forced if wave[3] == sine) for sine in (False, True))
        return alone and row[-1] > 0 and sum(size * size for size in sizes) == row[-1] ** 2

    def exponential(self, digits: int) -> Exponential:
        """Return ``e^{M t}`` to ``digits`` digits, and to more where a coefficient of a guard has many zeros.

        An exponential has half as many digits to spare, so that most modes of one matrix share it.
        """
        least = min((abs(c) for row in self.guards for c in row if c), default=Fraction(1))
        zeros = (least.denominator.bit_length() - least.numerator.bit_length()) // 3
        return exponential(self.homogeneous, max(digits, digits // 2 + zeros))

    @cached_property
    def in_doubles(self) -> "AffineFlow":
        """The ``AffineFlow`` in doubles; raises ``OverflowError`` where they do not hold it."""
        return _flow(Doubles, self, self.exponential(DIGITS_FOR_DOUBLES))

    @cached_property
    def mesh(self) -> Mesh:
        """The ``Mesh`` of the spectrum."""
        return Mesh(_blocks(Doubles, self.exponential(DIGITS_FOR_DOUBLES)))


@dataclass(frozen=True)
class AffineFlow:
    """A mode in the numbers of ``m``: the product of ``tables`` and a start (w, 1) gives all ``Parts`` of a segment.

    ``matrices`` (functions, n, n + 1) are the D_r, and ``rows`` the coefficients of the guards. ``rate`` turns the
    weights of a function of time into those of its derivative. In doubles ``tables`` and ``matrices`` are floats; for
    mpmath numbers they are whole numbers in units of 2^-bits, so that a product is exact until it is rounded.
    """

    m: Any
    mode: AffineMode
    blocks: tuple
    matrices: np.ndarray
    tables: np.ndarray
    bits: int
    rows: np.ndarray
    rate: np.ndarray

    def times(self, tables: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Return ``tables @ vector``, where ``tables`` may also be their sizes."""
        return tables @ vector if self.m is Doubles else whole_product(self.m, tables, self.bits, vector)

    @cached_property
    def table_sizes(self) -> np.ndarray:
        """The sizes of the entries of ``tables``, to which rounding errors are proportional."""
        return abs(self.tables)

    @cached_property
    def flat(self) -> np.ndarray:
        """The matrices without their last column, one row per function."""
        return self.matrices[:, :, :-1].reshape(len(self.matrices), -1)

    @cached_property
    def shapes(self) -> tuple[tuple[int, int], ...]:
        """The shapes of the parts of a product with ``tables``: sums for states and guards, slopes, bends."""
        functions, states, guards = len(self.rate), self.matrices.shape[1], len(self.rows)
        wide = functions + len(self.blocks) + 1
        return (wide, states), (wide, guards), (functions, guards), (functions, guards)

    def parts(self, product: np.ndarray) -> "Parts":
        """Return the ``Parts`` of products (.., size) of ``tables``."""
        found, at = [], 0
        for rows, columns in self.shapes:
            found.append(product[..., at : at + rows * columns].reshape(*product.shape[:-1], rows, columns))
            at += rows * columns
        return Parts(*found)


def in_digits(m: Arithmetic, mode: AffineMode) -> AffineFlow:
    """Return the ``AffineFlow`` of a mode in the mpmath numbers of the context ``m``, at its present precision."""
    doublings = ((m.dps - 1) // DIGITS_FOR_DOUBLES).bit_length()  # runs of nearly one precision share an exponential
    return _flow(m, mode, mode.exponential(DIGITS_FOR_DOUBLES << doublings))


def _flow(m, mode, exact):
    """Return the ``AffineFlow`` of a mode; all products are computed in whole numbers and rounded at the end."""
    unit, width = 1 << exact.bits, len(mode.rows) + 1
    rows, denominator = in_whole_numbers(mode.guards or [(Fraction(0),) * width])
    rows = rows[: len(mode.guards)]
    states = exact.matrices[:, :-1]
    guards = np.stack([_weights(rows, matrix, exact.bits) for matrix in exact.matrices]) // denominator
    rate = rate_of(exact.blocks, unit)
    growing = guards[rate.diagonal() > 0]
    if m is Doubles and ((growing != 0) & (abs(growing / unit).astype(float) < float_info.min)).any():
        raise OverflowError
    slopes = _derived(rate, guards, exact.bits)
    start = np.array(np.eye(width - 1, width, dtype=int), dtype=object) * unit
    sums = *_summed(exact.blocks, states, start), *_summed(exact.blocks, guards, rows * unit // denominator)
    tables = *sums, slopes, _derived(rate, slopes, exact.bits)
    tables = np.concatenate([table.reshape(-1, width) for table in tables])
    if m is Doubles:
        tables, states = (_rounded(m, table, exact.bits) for table in (tables, states))
    rows = np.array([[m.number(v) for v in row] for row in mode.guards], dtype=tables.dtype).reshape(-1, width)
    return AffineFlow(m, mode, _blocks(m, exact), states, tables, exact.bits, rows, _rounded(m, rate, exact.bits))


def _blocks(m, exact):
    def complex_of(parts):
        real, imaginary = (_number(m, part, exact.bits) for part in parts)
        return real + imaginary * 1j if imaginary else real

    return tuple(Block(*(_number(m, part, exact.bits) for part in block[:2]), block.size,
                       tuple(map(complex_of, block.apart))) for block in exact.blocks)


def _weights(rows, matrix, bits):
    """Return ``rows @ matrix``, with 0 for entries whose terms cancel up to rounding."""
    weights = rows @ matrix
    return np.where(abs(weights) > (abs(rows) @ abs(matrix)) >> (bits - _LOST_BITS), weights, 0)


def _rounded(m, array, bits):
    """Return an array of whole numbers in units of 2^-bits as numbers of ``m``."""
    if m is Doubles:
        return (array / (1 << bits)).astype(float)
    return np.array([_number(m, v, bits) for v in array.flat], dtype=object).reshape(array.shape)


def _number(m, value, bits):
    return value / (1 << bits) if m is Doubles else m.ldexp(m.mpf(value), -bits)


def _derived(rate, weights, bits):
    return _weights(rate, weights.reshape(len(rate), -1), bits).reshape(weights.shape) >> bits


def _summed(blocks, weights, whole):
    """Return ``weights``, and the bases: ``sum F_r(0) weights[r]`` over the blocks from the k-th on, for every k."""
    sums = np.cumsum((np.array(initial(blocks)) * weights.T).T[::-1], axis=0)[::-1]
    later = [sums[place] for place in np.cumsum([block.size * (2 if block.turn else 1) for block in blocks])[:-1]]
    return weights, np.stack([whole, *later, 0 * whole])


class Parts(NamedTuple):
    """The weights of the functions F_r in the states and guards of a segment.

    ``sums`` are the weights in the states and, in further rows, the bases: the sums at t = 0 of the blocks that have
    not started, one row for each number of started blocks. ``guards`` are the same for the guards. ``slopes`` and
    ``bends`` are the weights in the first and second derivatives of the guards.
    """

    sums: np.ndarray
    guards: np.ndarray
    slopes: np.ndarray
    bends: np.ndarray


class ClosedSegment:
    """The motion of a flow from a start ``w(0)``, and its guards as functions of time.

    ``sizes``, by default ``|start|``, are the sizes to which the errors of the start are proportional. A guard that is
    0 at the start within rounding, or is one of ``zeros``, is set to 0 there. If its slope is 0 at all times, the guard
    vanishes identically and is set to 1, so that it is never lost. So is one of those ``zeros`` that are ``level``,
    whose slopes vanish at the start, if it returns to 0 without end (Lemma 20), and so are the ``touching`` ones. With
    ``snapped=False`` no other guard is changed.
    """

    def __init__(
        self, flow: AffineFlow, start: Sequence[Number] | np.ndarray,
        sizes: Sequence[Number] | np.ndarray | None = None, snapped: bool = True, zeros: Sequence[int] = (),
        level: Sequence[int] = (), touching: Sequence[int] = (),
    ):
        m = self.m = flow.m
        self.flow, self.functions = flow, len(flow.rate)
        whole = np.array([*start, m.number(1)], dtype=flow.tables.dtype)
        self.size = abs(whole) if sizes is None else np.array([*sizes, m.number(1)], dtype=whole.dtype)
        self.start = whole[:-1]
        self.sums, self.guards, self.slopes, self.bends = flow.parts(flow.times(flow.tables, whole))
        first, off = self.guards[self.functions], abs(flow.rows) @ self.size
        vanishing, moves = abs(first) <= off * max(m.margin, m.slack), self.slopes.any(axis=0)
        vanishing[[*zeros]] = True
        self.returning = [*filter(self._returns, level), *touching]
        vanishing[self.returning] = False
        self.zero, self.held = (np.flatnonzero(vanishing & snapped & some).tolist() for some in (moves, ~moves))
        first[self.zero] = m.number(0)
        for weights in (self.guards, self.slopes, self.bends):
            weights[:, self.returning] = m.number(0)
        self.guards[self.functions :, [*self.held, *self.returning]] = m.number(1)

    def _returns(self, guard):
        """Tell whether a guard that vanishes with its slope is ``c (1 - cos(w t))`` with c > 0."""
        at, waves = 0, list[int]()
        for decay, turn, count, _ in self.flow.blocks:
            start, at = at, at + count * (2 if turn else 1)
            if self.slopes[start:at, guard].any():
                waves.append(start if turn and not decay and count == 1 else -1)
        return len(waves) == 1 and waves[0] >= 0 and self.bends[waves[0], guard] > 0

    @cached_property
    def term_sizes(self) -> Parts:
        """The ``Parts`` of the sizes of the terms, to which rounding errors are proportional."""
        found = self.flow.parts(self.flow.times(self.flow.table_sizes, self.size))
        found.guards[self.functions][self.zero] = self.m.number(0)
        found.guards[:, [*self.held, *self.returning]] = self.m.number(0)
        return found

    def in_doubles(self) -> "ClosedSegment":
        """Return the motion in doubles, with ``snapped=False``; raises ``OverflowError`` beyond their range."""
        start, size = (np.array([*map(float, values[: len(self.start)])]) for values in (self.start, self.size))
        if not np.isfinite(size).all():
            raise OverflowError
        return ClosedSegment(self.flow.mode.in_doubles, start, size, snapped=False, touching=self.returning)

    def state(self, t: Number) -> np.ndarray:
        """Return the state (n,) at the time t."""
        _, gained, begun = functions(self.m, self.flow.blocks, t)
        return self._sum(self.sums, gained, begun)

    def states(self, times: np.ndarray) -> np.ndarray:
        """Return the states (n, times) in doubles."""
        _, gained, begun = functions(Arrays, self.flow.blocks, times)
        return self._sum(self.sums, np.stack(np.broadcast_arrays(*gained), axis=-1), begun).T

    def _sum(self, weights, gained, begun):
        return np.array(gained) @ weights[: self.functions] + weights[self.functions + begun]

    def first_event(self, until: Number) -> tuple[Number, tuple[int, ...]] | None:
        """Return (time, guards) of the first root of any guard in (0, until], or None; raises ``Undecided``."""
        return first_root(Guards(self), until, self.flow.mode.mesh)

    def refined(self, guess: Number, guard: int) -> Number:
        """Return the root of a guard near ``guess``, a root in coarser numbers; raises ``Undecided`` without one."""
        weights, slopes, t, step = self.guards[:, guard], self.slopes[:, guard], guess, self.m.inf
        while abs(step) > self.m.root_tol * guess:
            found, gained, begun = functions(self.m, self.flow.blocks, t)
            slope, before = np.array(found) @ slopes, step
            step = self._sum(weights, gained, begun) / slope if slope < 0 else self.m.inf
            if not abs(step) < min(_NEAR * guess, abs(before)):
                raise Undecided
            t = t - step
        return t

    def at_event(self, t: Number, guard: int) -> np.ndarray:
        """Return the state at the root of a guard near t, by a Newton step that moves the state: t is too coarse.

        No step is made where the guard only touches zero, because its slope is rounding there.
        """
        values, gained, begun = functions(self.m, self.flow.blocks, t)
        found, state = np.array(values), self._sum(self.sums, gained, begun)
        value, slope = self._sum(self.guards[:, guard], gained, begun), found @ self.slopes[:, guard]
        if not slope or (not self.m.margin and abs(slope) <= Guards(self).at(t, self.m.slack).slope_doubts[guard]):
            return state
        return state - found @ self.flow.rate @ self.sums[: self.functions] * (value / slope)

    def without_rounding(self, t: Number, state: np.ndarray) -> np.ndarray:
        """Return the state at t, with components within the rounding error of their terms set to zero."""
        return np.where(abs(state) > self._terms(t) * self.m.slack, state, self.m.number(0))

    def require_digits(self, t: Number, state: np.ndarray) -> None:
        """Raise ``Undecided`` where the terms of the state at t cancel so far that two runs may agree by chance.

        A motion from 0 that comes back to 0, where signs within rounding are trusted, has no digits to lose.
        """
        size = max(map(abs, (*self.start, *state)))
        if size and self.m.eps * max(self._terms(t)) > self.m.root_tol * size:
            raise Undecided

    def _terms(self, t):
        """Return the sizes of the terms of the states at t, to which rounding errors are proportional."""
        gained, _ = rounding_sizes(self.m, self.flow.blocks, t)
        return self._sum(self.term_sizes.sums, gained, functions(self.m, self.flow.blocks, t)[2])
