r"""A mesh of times adapted to the spectrum of a mode, with the functions F_r on it: where a search for a root begins.

A part ``e^{l t}`` with Re l < 0 contributes ``|l|^2 e^{Re l t}`` to g'', so an interval may have the length
``1/|l| e^{-Re l t/4}``. Intervals grow as fast parts decay, and their number is O(log(1/mu)). Whether a guard vanishes
on an interval is decided by bounds in ``events``, so the choice of the mesh affects the cost alone.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import count
from typing import NamedTuple

import numpy as np

from asympk.affine.functions import MOST_EXPONENT, Arrays, Block, areas, functions, rounding_sizes

POINTS = 96  # intervals of a window
_PART = 0.4  # the length of an interval, in units of the time of the fastest part left
_KEPT = 64  # windows kept per mode
_SLOWEST = 1e-150  # a smaller speed counts as 0: the times of its intervals would not be finite
_LARGEST = 1e300  # the bound of all functions: it is finite, so that a function of weight 0 contributes 0


class FunctionTable(NamedTuple):
    """Increasing times ``t`` (.., K + 1), and the functions F_r of a mode at these times.

    ``sums`` (.., K + 1, functions + blocks + 1) are the contributions of the functions, with a 1 in the column of the
    base that belongs to them: the product with the weights of a guard is the guard. ``off_sums`` are the sizes to which
    the rounding error of this product is proportional. ``values`` (.., K + 1, functions) are the functions, and
    ``off_values`` the sizes for their rounding errors. ``areas`` (.., K, functions) bound the integrals of ``|F_r|``
    over the intervals, whose lengths are ``h`` (.., K, 1).
    """

    t: np.ndarray
    sums: np.ndarray
    off_sums: np.ndarray
    values: np.ndarray
    off_values: np.ndarray
    areas: np.ndarray
    h: np.ndarray

    def intervals(self, which: np.ndarray) -> "FunctionTable":
        """Return the table whose rows are the intervals of the given numbers, each with its two ends."""
        ends, inside = np.column_stack([which, which + 1]), which[:, None]
        return FunctionTable._make([*(part[ends] for part in self[:-2]), self.areas[inside], self.h[inside]])


def function_table(blocks: Sequence[Block], t: np.ndarray) -> FunctionTable:
    """Return the ``FunctionTable`` of the functions of blocks at an array of times."""
    with np.errstate(all="ignore"):
        values, gained, begun = functions(Arrays, blocks, t)
        off_gained, off_values = rounding_sizes(Arrays, blocks, t)
        swept = areas(Arrays, blocks, t[..., :-1], t[..., 1:])
    base = [begun == k for k in range(len(blocks) + 1)]
    parts = [*gained, *base], [*off_gained, *base], values, off_values
    found = [np.stack(np.broadcast_arrays(*part), axis=-1).astype(float) for part in parts]
    bounds = np.stack(np.broadcast_arrays(*swept, t[..., 1:])[:-1], axis=-1)
    return FunctionTable._make([t, *found, bounds, np.diff(t)[..., None]])


class Mesh:
    """The windows of the mesh of one mode, from t = 0 on, each computed when it is first needed."""

    def __init__(self, blocks: Sequence[Block]):
        self.blocks = blocks
        self._windows: list[FunctionTable] = []
        roots = [complex(block.decay, block.turn) + apart for block in blocks for apart in (0, *block.apart)]
        self._speeds = _leading([(root.real, abs(root)) for root in roots])
        fastest = max((speed for _, speed in self._speeds), default=0.0)
        self._first = _PART / fastest if fastest > _SLOWEST else 1.0

    def windows(self) -> Iterator[FunctionTable]:
        """Yield the windows in order of time, without end."""
        for k in count():
            if k < len(self._windows):
                window = self._windows[k]
            else:
                window = self._window(float(window.t[-1]) if k else 0.0)
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
                       if decay * t < MOST_EXPONENT), default=0.0)
        grown = t + self._first
        return _PART / fastest if fastest * grown > _PART else grown


def _leading(speeds):
    """Return the pairs (decay, speed) for which no other part decays more slowly and is as fast."""
    ordered = sorted(set(speeds), reverse=True)
    return [pair for k, pair in enumerate(ordered) if all(pair[1] > speed for _, speed in ordered[:k])]
