"""A path as numbers to store and to draw: samples that resolve the fast layers, a CSV file, a figure."""

import csv
import io
from pathlib import Path
from typing import NamedTuple

from asympk.errors import InputError
from asympk.numbers import whole
from asympk.pictures import style
from asympk.storage.files import write_bytes, write_text

SUFFIXES = (".pdf", ".svg", ".png")
SHADES = {"slip_same": "white", "slip_opposite": "0.88", "stick": "0.72"}
_SAMPLES = 4000
MOST_SAMPLES = 10**7


class Frame(NamedTuple):
    """What the columns are called, and the ``delay`` in load = x + delay y: 1, or h l in R = R_1 + h l R_1' (2.3)."""

    columns: tuple = ("t", "x", "y", "z", "s", "mode")
    delay: float = 1.0


NONDIMENSIONAL = Frame()


def frame_of(units=None):
    """Return the frame of a nondimensional path, or of one told in the physical ``units``."""
    return NONDIMENSIONAL if units is None else Frame(("t", "R_1", "dR_1", "u", "R", "mode"), float(units.time))


def trace(path, frame=NONDIMENSIONAL, samples=_SAMPLES):
    """Return rows (t, x, y, z, load, mode) of ``path``, some ``samples`` in all, dense where a mode begins and ends.

    An event is there twice, as the end of one mode and the start of the next, with the state the path gives it.
    """
    samples = whole("samples", samples, 1, MOST_SAMPLES)
    ends = [(0, *path(0.0)), *((event.t, *event.state) for event in path.events), (path.scene.until, *path.final)]
    each = max(6, samples // len(path.modes))
    rows = []
    for first, last, mode in zip(ends, ends[1:], path.modes, strict=False):
        inner = _between(path, float(first[0]), float(last[0]), each)
        rows += [_row(state, frame.delay, mode) for state in (first, *inner, last)]
    return rows


def _between(path, begin, end, count):
    times = _times(begin, end, count)
    return zip(times, *path(times), strict=True) if times.size else ()


def _times(begin, end, count):
    """Return times in (begin, end), a third evenly spaced, a third crowding towards either end."""
    import numpy as np

    part = np.linspace(0, 1, count // 3 + 2)[1:-1]
    close = 10.0 ** (12 * (part - 1))
    found = np.unique(begin + (end - begin) * np.concatenate([part, close, 1 - close]))
    return found[(found > begin) & (found < end)]


def _row(state, delay, mode):
    t, x, y, z = map(float, state)
    return t, x, y, z, x + delay * y, mode


def write_csv(file, path, frame=NONDIMENSIONAL, samples=_SAMPLES):
    """Write the samples of ``path`` to ``file`` and return its name."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(frame.columns)
    writer.writerows(trace(path, frame, samples))
    return write_text(file, buffer.getvalue())


def plot(file, path, frame=NONDIMENSIONAL):
    """Draw x, y, z and the load s against time, the modes as shades, into a .pdf, .svg or .png file; return its name.

    Raises ``InputError`` for another kind of file, ``MissingPackage`` where matplotlib is not installed.
    """
    file = Path(file)
    if file.suffix not in SUFFIXES:
        raise InputError(f"{file}: a plot is written as one of {', '.join(SUFFIXES)}")
    matplotlib = style.matplotlib()
    unsaid = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {"Software": None}}
    buffer = io.BytesIO()
    with matplotlib.rc_context(style.RC):
        drawing = figure(path, frame)
        drawing.savefig(buffer, format=file.suffix[1:], metadata=unsaid[file.suffix], dpi=200)
    return write_bytes(file, buffer.getvalue())


def figure(path, frame=NONDIMENSIONAL):
    """Return the matplotlib ``Figure`` of a path; time is logarithmic from the first event on where that is early."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    columns = list(zip(*trace(path, frame), strict=True))
    drawing = Figure(figsize=(style.COLUMN, 4.6), layout="constrained")
    panels = drawing.subplots(4, 1, sharex=True)
    for axis, values, label in zip(panels, columns[1:5], frame.columns[1:5], strict=True):
        _shade(axis, path)
        axis.plot(columns[0], values, color=style.BLUE)
        _stretch(axis, values)
        axis.set_ylabel(label)
    _time_axis(panels[-1], path)
    panels[-1].set_xlabel(frame.columns[0])
    present = [mode for mode in SHADES if mode in path.modes]
    handles = [Patch(facecolor=SHADES[mode], edgecolor="0.5", linewidth=0.4, label=mode) for mode in present]
    drawing.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    return drawing


def _shade(axis, path):
    moments = [0.0, *(float(event.t) for event in path.events), float(path.scene.until)]
    for begin, end, mode in zip(moments, moments[1:], path.modes, strict=False):
        axis.axvspan(begin, end, facecolor=SHADES[mode], linewidth=0)
    for moment in moments[1:-1]:
        axis.axvline(moment, color="0.5", linewidth=0.4)


def _stretch(axis, values):
    if max(map(abs, values)) > 50:
        axis.set_yscale("symlog", linthresh=1)


def _time_axis(axis, path):
    until = float(path.scene.until)
    first = float(path.events[0].t) if path.events else until
    if 0 < first < until / 50:
        axis.set_xscale("symlog", linthresh=first)
    axis.set_xlim(0, until or 1)
