"""A path of any system as numbers: samples that resolve the fast layers, as a CSV file or a pandas frame."""

import csv
import io
from itertools import islice, pairwise
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

from asympk.errors import MissingPackage
from asympk.numbers import whole
from asympk.path import Path
from asympk.storage.files import write_text

if TYPE_CHECKING:
    from pandas import DataFrame

SAMPLES = 4000
SAMPLES_WITH_DIGITS = 400  # each of which takes a thousand times as long
MOST_SAMPLES = 10**7


def columns(path: Path) -> tuple[str, ...]:
    """Return the names of the columns: t, the states, the linear combinations told beside them, and mode."""
    return "t", *path.names, *(name for name, _ in path.scene.combinations), "mode"


def trace(path: Path, samples: int | None = None) -> list[tuple]:
    """Return rows of ``columns``, some ``samples`` in all, dense where a mode begins and ends.

    An event is there twice, as the end of one mode and the start of the next, with the state the path gives it. Raises
    ``InputError`` for a number of samples that is none.
    """
    if samples is None:
        samples = SAMPLES_WITH_DIGITS if any(hasattr(v, "_mpf_") for v in path.final) else SAMPLES
    samples = whole("samples", samples, 1, MOST_SAMPLES)
    ends = [(0, *path(0.0)), *((event.t, *event.state) for event in path.events), (path.end, *path.final)]
    each = max(6, samples // len(path.modes))
    spans = [_times(float(first[0]), float(last[0]), each) for first, last in pairwise(ends)]
    inner = iter(_states(path, spans))  # in one call: an integrator runs again for each
    rows = []
    for first, last, times, mode in zip(ends, ends[1:], spans, path.modes, strict=False):
        rows += [_row(path, state, mode) for state in (first, *islice(inner, len(times)), last)]
    return rows


def _states(path: Path, spans: list) -> Any:
    import numpy as np

    times = np.concatenate(spans)
    return zip(times, *path(times), strict=True) if times.size else ()


def _times(begin: float, end: float, count: int) -> Any:
    """Return times in (begin, end), a third evenly spaced, a third crowding towards either end."""
    import numpy as np

    part = np.linspace(0, 1, count // 3 + 2)[1:-1]
    close = 10.0 ** (12 * (part - 1))
    found = np.unique(begin + (end - begin) * np.concatenate([part, close, 1 - close]))
    return found[(found > begin) & (found < end)]


def _row(path: Path, state: Any, mode: str) -> tuple:
    t, *values = map(float, state)
    combined = (sum(c * v for c, v in zip(weights, values, strict=True) if c) for _, weights in path.scene.combinations)
    return t, *values, *combined, mode


def write_csv(path: Path, file: str | File, samples: int | None = None) -> File:
    """Write the samples of ``path`` to ``file`` and return its name."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns(path))
    writer.writerows(trace(path, samples))
    return write_text(file, buffer.getvalue())


def frame(path: Path, samples: int | None = None) -> "DataFrame":
    """Return the samples of ``path`` as a pandas ``DataFrame``; raises ``MissingPackage`` where pandas is not."""
    try:
        import pandas as pd
    except ImportError:
        raise MissingPackage("a frame needs pandas: pip install 'asympk[frame]'") from None
    found = pd.DataFrame(trace(path, samples), columns=columns(path))
    return found.astype({"mode": "category"})
