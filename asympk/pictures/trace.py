"""A path of any system as numbers: samples that resolve the fast layers, as a CSV file or a pandas frame."""

from itertools import pairwise
from math import log10
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

import numpy as np

from asympk.errors import MissingPackage
from asympk.numbers import whole
from asympk.path import Path
from asympk.storage.files import csv_text, write_text

if TYPE_CHECKING:
    from pandas import DataFrame

SAMPLES = 4000
SAMPLES_WITH_DIGITS = 400  # of a path in mpmath numbers, where a sample takes a thousand times as long
MOST_SAMPLES = 10**7
DECADES = 12  # of the times that crowd towards an end of a mode, from its length downwards


def column_names(path: Path) -> tuple[str, ...]:
    """Return the names of the columns: t, the states, the linear combinations that the scene names, and mode."""
    return "t", *path.names, *(name for name, _ in path.scene.combinations), "mode"


def sampled_modes(path: Path, samples: int) -> list[tuple[str, Any]]:
    """Return (mode, array of shape (1 + quantities, m)) for each mode: times, states, and their linear combinations.

    There are about ``samples`` times in all, dense where a mode begins and ends, and no mode has few of them for its
    length. An event occurs twice, as the end of one mode and as the start of the next, both with the state in
    ``path.events``.
    """
    events = [(float(event.t), *map(float, event.state)) for event in path.events]
    ends = np.array([(0.0, *path(0.0)), *events, (float(path.end), *map(float, path.final))], dtype=float).T
    each = max(6, samples // len(path.modes)) // 3
    lengths = np.diff(ends[0]) / (ends[0, -1] or 1)
    spans = [_times(begin, end, int(each + length * samples / 3) // 2, each)
             for (begin, end), length in zip(pairwise(ends[0]), lengths, strict=True)]
    times = np.concatenate(spans)  # the path is called once, as an integrator runs anew in each call
    states = np.asarray(path(times), dtype=float) if times.size else np.empty((len(path.names), 0))
    inner = iter(np.split(np.vstack([times, states]), np.cumsum([*map(len, spans)])[:-1], axis=1))
    weights = np.array([w for _, w in path.scene.combinations], dtype=float).reshape(-1, len(path.names))
    found = []
    for k, mode in enumerate(path.modes):
        piece = np.column_stack([ends[:, k], next(inner), ends[:, k + 1]])
        found.append((mode, np.vstack([piece, weights @ piece[1:]])))
    return found


def trace(path: Path, samples: int | None = None) -> list[tuple]:
    """Return about ``samples`` rows, each with the columns ``column_names``, at the times of ``sampled_modes``.

    Raises ``InputError`` unless ``samples`` is a whole number from 1 to ``MOST_SAMPLES``.
    """
    if samples is None:
        samples = SAMPLES_WITH_DIGITS if any(hasattr(v, "_mpf_") for v in path.final) else SAMPLES
    found = sampled_modes(path, whole("samples", samples, 1, MOST_SAMPLES))
    return [(*row, mode) for mode, piece in found for row in piece.T.tolist()]


def _times(begin: float, end: float, even: int, each: int) -> Any:
    """Return times in (begin, end), some evenly spaced, and ``each`` crowding towards either end.

    Towards ``begin`` they reach down to parts of this time, as it may be shown on a logarithmic axis.
    """
    part, close = (np.linspace(0, 1, count + 2)[1:-1] for count in (even, each))
    early = max(DECADES, 3 + log10(end - begin) - log10(begin)) if 0 < begin < end else DECADES
    parts = np.concatenate([part, 10.0 ** (early * (close - 1)), 1 - 10.0 ** (DECADES * (close - 1))])
    found = np.unique(begin + (end - begin) * parts)
    return found[(found > begin) & (found < end)]


def write_csv(path: Path, file: str | File, samples: int | None = None) -> File:
    """Write the samples of ``path`` to ``file`` and return its name."""
    return write_text(file, csv_text([column_names(path), *trace(path, samples)]))


def frame(path: Path, samples: int | None = None) -> "DataFrame":
    """Return the samples of ``path`` as a pandas ``DataFrame``; raises ``MissingPackage`` without pandas."""
    try:
        import pandas as pd
    except ImportError:
        raise MissingPackage("a frame needs pandas: pip install 'asympk[frame]'") from None
    return pd.DataFrame(trace(path, samples), columns=column_names(path)).astype({"mode": "category"})
