r"""An affine mode in numbers: ``W' = M W`` with W = (w, 1), its exponential and its guards, and a segment from a start.

A guard is a function ``g = c.w + d`` that is positive inside the mode. Its weights ``(c, d) D_r`` are multiplied in
many digits before they are rounded, so a guard that does not feel a fast part says so.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from asympk.affine.events import Guards, first_root
from asympk.affine.exponential import DIGITS_FOR_DOUBLES, exponential
from asympk.affine.functions import bases, functions, rate_of
from asympk.affine.mesh import Mesh
from asympk.errors import InputError
from asympk.flow.arithmetic import Doubles

_LEAST_DIGITS = 40
_ULPS = 64


@dataclass(frozen=True)
class AffineMode:
    """``w' = A w + b`` while all guards ``c.w + d`` are positive; rows of exact numbers (int, float, Fraction)."""

    matrix: tuple[tuple[Fraction, ...], ...]
    vector: tuple[Fraction, ...]
    guards: tuple[tuple[Fraction, ...], ...] = ()

    @classmethod
    def of(cls, matrix, vector, guards=()):
        """Build a mode from ``A`` (n, n), ``b`` (n,) and guards ``(c, d)``; floats are taken for what they are exactly.

        Raises ``InputError`` for shapes that do not fit and for a guard that depends on no state.
        """
        size = len(vector)
        if any(len(row) != size for row in matrix) or len(matrix) != size:
            raise InputError(f"matrix: {len(matrix)} rows for a vector of {size}; A must be square and as long as b")
        rows = tuple(_exact(c, (d,)) for c, d in guards)
        for k, row in enumerate(rows):
            if len(row) != size + 1:
                raise InputError(f"guard {k}: {len(row) - 1} coefficients for {size} states")
            if not any(row[:-1]):
                raise InputError(f"guard {k} = {row[-1]} depends on no state: it never ends the mode; leave it out")
        return cls(tuple(_exact(row) for row in matrix), _exact(vector), rows)

    @cached_property
    def homogeneous(self):
        """The rows of M, ``(w, 1)' = M (w, 1)``."""
        rows = tuple((*row, b) for row, b in zip(self.matrix, self.vector, strict=True))
        return (*rows, (Fraction(0),) * (len(rows) + 1))

    @cached_property
    def in_doubles(self):
        """The ``Flow`` in doubles."""
        return _flow(Doubles, self, exponential(self.homogeneous, DIGITS_FOR_DOUBLES), float)

    @cached_property
    def mesh(self):
        """The ``Mesh`` of the spectrum."""
        return Mesh(self.in_doubles.blocks)


def _exact(*rows):
    return tuple(Fraction(value) for row in rows for value in row)


@dataclass(frozen=True)
class Flow:
    """A mode in the numbers of ``m``.

    ``matrices`` is (functions, n, n + 1), ``weights``, those of the guards, (functions, guards, n + 1); ``rate`` turns
    the weights of a function of time into those of its derivative.
    """

    m: Any
    mode: AffineMode
    blocks: tuple
    matrices: np.ndarray
    weights: np.ndarray
    rows: np.ndarray
    rate: np.ndarray

    @cached_property
    def weight_sizes(self):
        """The sizes of the weights."""
        return abs(self.weights)

    @cached_property
    def row_sizes(self):
        """The sizes of the guards' coefficients."""
        return abs(self.rows)

    @cached_property
    def rate_sizes(self):
        """The sizes of the entries of ``rate``."""
        return abs(self.rate)

    @cached_property
    def matrix_sizes(self):
        """The sizes of the entries of ``matrices``."""
        return abs(self.matrices)


def in_digits(m, mode):
    """Return the ``Flow`` of a mode in the mpmath numbers of the context ``m``, at its present precision."""
    doublings = ((m.dps - 1) // _LEAST_DIGITS).bit_length()  # runs of nearly the same precision share one exponential
    return _flow(m, mode, exponential(mode.homogeneous, _LEAST_DIGITS << doublings), m.mpf)


def _flow(m, mode, exact, number):
    blocks = tuple(block._replace(decay=number(block.decay), turn=number(block.turn)) for block in exact.blocks)
    rows = np.array([[exact.m.number(v) for v in row] for row in mode.guards], dtype=object)
    rows = rows.reshape(len(mode.guards), len(mode.vector) + 1)
    weights = np.stack([rows @ matrix for matrix in exact.matrices])
    kind = float if m is Doubles else object

    def rounded(array):
        return np.array([number(v) for v in array.flat], dtype=kind).reshape(array.shape)

    matrices = rounded(exact.matrices[:, :-1])
    return Flow(m, mode, blocks, matrices, rounded(weights), rounded(rows), rate_of(blocks, kind))


class Segment:
    """The motion of a flow from a start ``w(0)``, and its guards as functions of time.

    ``mass`` are the sizes of the terms that made each weight, on which its rounding depends. A guard whose value at the
    start is within rounding vanishes there: it is set to zero, and its first derivative that does not vanish must be
    positive.
    """

    def __init__(self, flow, start):
        m = self.m = flow.m
        self.flow = flow
        self.whole = np.array([*start, m.number(1)], dtype=flow.matrices.dtype)
        self.start = self.whole[:-1]
        self.terms = flow.matrices @ self.whole
        self.mass = flow.weight_sizes @ abs(self.whole)
        self.weights = flow.weights @ self.whole
        self.slopes = flow.rate @ self.weights
        self.bends = flow.rate @ self.slopes
        self.first, self.first_mass = flow.rows @ self.whole, flow.row_sizes @ abs(self.whole)
        self.zero = np.flatnonzero(abs(self.first) <= max(m.margin, _ULPS * m.eps) * self.first_mass).tolist()
        for guard in self.zero:
            self.first[guard] = self.first_mass[guard] = 0 * self.first[guard]
        self.bases = bases(flow.blocks, self.terms, self.start)

    def state(self, t):
        """Return the state (n,) at the time t."""
        _, gained, begun = functions(self.m, self.flow.blocks, t)
        return self.bases[begun] + np.array(gained) @ self.terms

    def rates(self, t):
        """Return ``w'(t)``."""
        found, _, _ = functions(self.m, self.flow.blocks, t)
        return np.array(found) @ (self.flow.rate @ self.terms)

    def first_event(self, until):
        """Return (time, guards) of the first root of any guard in (0, until], or None; raises ``Undecided``."""
        return first_root(Guards(self), until, self.flow.mode.mesh)

    def at_event(self, t, guard):
        """Return the state at the root of a guard, moved by the step that t is too coarse for."""
        found, gained, begun = functions(self.m, self.flow.blocks, t)
        base = bases(self.flow.blocks, self.weights[:, guard], self.first[guard])[begun]
        value, slope = base + np.array(gained) @ self.weights[:, guard], np.array(found) @ self.slopes[:, guard]
        state = self.bases[begun] + np.array(gained) @ self.terms
        return state - value / slope * (np.array(found) @ (self.flow.rate @ self.terms)) if slope else state
