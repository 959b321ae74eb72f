r"""Times that suit a spectrum, and the functions F_r there, kept per mode: where a search for a root begins.

A part ``e^{l t}`` with Re l < 0 bends a guard by ``|l|^2 e^{Re l t}``, so an interval may be as long as
``1/|l| e^{-Re l t/4}``: intervals grow as fast parts vanish, and their number is O(log(1/mu)). What is on an interval
is then decided by bounds, in ``events``; the mesh decides nothing.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import count
from typing import NamedTuple

import numpy as np

from asympk.affine.exponential import Block
from asympk.affine.functions import MOST_EXPONENT, Arrays, areas, functions, tremors

POINTS = 96
_PART = 0.4
_KEPT = 64
_LARGEST = 1e300  # so that a part of no weight is 0 however far it has grown


class FunctionTable(NamedTuple):
    """Times (.., K + 1), the last axis in order, and what is known there.

    ``sums`` (.., K + 1, functions + blocks + 1) are what the functions add and, 1 in the column of the base that it is
    added to, so that a product with a segment's weights is the guard; ``off_sums`` are the sizes that its rounding goes
    with. ``values`` (.., K + 1, functions) are the functions, ``off_values`` their sizes. ``areas`` (.., K, functions)
    bound the integrals of their sizes over the intervals, whose lengths are ``h`` (.., K, 1).
    """

    t: np.ndarray
    sums: np.ndarray
    off_sums: np.ndarray
    values: np.ndarray
    off_values: np.ndarray
    areas: np.ndarray
    h: np.ndarray


def function_table(blocks: Sequence[Block], t: np.ndarray) -> FunctionTable:
    """Return the ``FunctionTable`` of the functions of blocks at an array of times."""
    with np.errstate(all="ignore"):
        values, gained, begun = functions(Arrays, blocks, t)
        off_gained, off_values = tremors(Arrays, blocks, t)
        swept = areas(Arrays, blocks, t[..., :-1], t[..., 1:])
    base = [begun == k for k in range(len(blocks) + 1)]
    parts = [*gained, *base], [*off_gained, *base], values, off_values
    found = [np.stack(np.broadcast_arrays(*part), axis=-1).astype(float) for part in parts]
    bounds = np.stack(np.broadcast_arrays(*swept, t[..., 1:])[:-1], axis=-1)
    return FunctionTable._make([t, *found, bounds, np.diff(t)[..., None]])


class Mesh:
    """The windows of a mode's spectrum, from 0 on, made as they are asked for."""

    def __init__(self, blocks: Sequence[Block]):
        self.blocks = blocks
        self._windows: list[FunctionTable] = []
        self._speeds = _leading([(decay, abs(complex(decay, turn))) for decay, turn, _ in blocks])
        fastest = max((speed for _, speed in self._speeds), default=0.0)
        self._first = _PART / fastest if fastest else 1.0

    def windows(self) -> Iterator[FunctionTable]:
        """Yield the windows in order of time, without end."""
        for k in count():
            if k < len(self._windows):
                window = self._windows[k]
            else:
                window = self._window(window.t[-1] if k else 0.0)
                if k < _KEPT:
                    self._windows.append(window)
            yield window

    def _window(self, t):
        times = [t]
        for _ in range(POINTS):
            times.append(times[-1] + self._step(times[-1]))
        known = function_table(self.blocks, np.array(times))
        return FunctionTable(*(np.clip(part, -_LARGEST, _LARGEST) for part in known))

    def _step(self, t):
        fastest = max((speed * math.exp(min(decay * t / 4, 0.0)) for decay, speed in self._speeds
                       if decay * t < MOST_EXPONENT), default=0.0)  # fmt: skip
        grown = t + self._first
        return _PART / fastest if fastest * grown > _PART else grown


def _leading(speeds):
    """Return the (decay, speed) that no other one, as fast, outlasts."""
    ordered = sorted(set(speeds), reverse=True)
    return [pair for k, pair in enumerate(ordered) if all(pair[1] > speed for _, speed in ordered[:k])]
