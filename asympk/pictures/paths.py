"""The picture of a path: every state against time, modes as shades, events as marks."""

from functools import reduce
from math import floor, log, log10, sinh
from pathlib import Path as File
from statistics import median_low
from sys import float_info
from typing import Any

import numpy as np

from asympk.errors import InputError, MissingPackage
from asympk.path import Path
from asympk.pictures import plate, sheets, style
from asympk.pictures.trace import column_names, trace
from asympk.shown import as_html

GREYS = {"slip_same": 1.0, "smooth": 1.0, "one_field": 1.0, "open": 0.95, "slip_opposite": 0.88, "stick": 0.72}
HUES = ((1, 1, 1), (0.62, 0.8, 1), (1, 0.82, 0.55), (0.66, 1, 0.8))  # tints by friction; the first is grey
PANEL, LEGEND, AXIS = 0.95, 0.3, 0.35  # inches
LETTERS = 45  # characters that fit into a row of the legend
MANY = 40  # the most events that are marked by dots on the curves
TICKS = {"x": 6, "y": 5}  # of a logarithmic axis, which gets fewer than twice as many
WHOLE = 12  # decades
DECADES = 6  # the most of an axis of a state
ROOM = 1.5  # decades of its linear part
MARGIN = 0.12  # on each side of a motion, in units of its extent
NOISE = 1e-12  # part of their size by which values vary that are equal but for rounding
SHORTEST = 1e21 * float_info.min  # below it, matplotlib's axes are from -0.05 to 0.05, without a message
ABOVE = 1 + 1e-9  # a threshold of 1000 gets a tick at 100, too: log(1000) / log(10) is below 3 in doubles


def plot(path: Path, file: str | File | None = None) -> Any:
    """Return the matplotlib ``Figure`` of a path, and write it to ``file`` if one is given.

    Where most events are early, time is logarithmic from the power of ten before the first on. A state that is large
    for a short while only is logarithmic above its usual size. Raises ``InputError`` for a file other than .pdf,
    .svg or .png and for a path that is shorter than ``SHORTEST``, ``MissingPackage`` where matplotlib is not installed.
    """
    return sheets(file).kept(figure(path), file)


def html(path: Path) -> str:
    """Return the table of a path as HTML, and its picture below where matplotlib is installed and draws it."""
    from base64 import b64encode

    try:
        drawn = b64encode(sheets().bytes_of(figure(path), ".svg")).decode()
    except (MissingPackage, InputError):
        return as_html(path._card())
    return f'{as_html(path._card())}<img alt="the path over time" src="data:image/svg+xml;base64,{drawn}"/>'


def figure(path: Path) -> Any:
    """Draw a path: a panel for every state and for every linear combination that the scene names."""
    if 0 < path.end < SHORTEST:
        raise InputError(f"until = {float(path.end):.3g}: matplotlib draws no axis below {SHORTEST:.3g}; take another "
                         "unit of time")
    names, data = column_names(path)[1:-1], list(zip(*trace(path), strict=True))
    with plate(LEGEND + AXIS + PANEL * len(names), len(names), sharex=True) as (drawing, panels):
        for axis, values, name in zip(panels.flat, data[1:-1], names, strict=True):
            _shade(axis, path)
            axis.plot(data[0], values, color=style.BLUE)
            _mark(axis, path, data[0], values)
            if limit := logarithmic_from(data[0], values):
                _logarithmic(axis, "y", limit, ROOM)
            elif is_constant(values):
                axis.set_ylim(around(values))
            axis.set_ylabel(style.folded(label_of(path, name), PANEL))
        _time_axis(panels[-1, 0], path)
        panels[-1, 0].set_xlabel(label_of(path, "t"))
        _legend(drawing, path)
    return drawing


def shade(mode: str) -> tuple[float, float, float]:
    """Return the colour of a mode by its name: a grey for the first friction, tinted by the phases of the others."""
    parts = [_tinted(GREYS.get(phase, 1.0), HUES[k % len(HUES)]) for k, phase in enumerate(mode.split("+"))]
    return reduce(lambda a, b: (a[0] * b[0], a[1] * b[1], a[2] * b[2]), parts)


def _tinted(grey: float, hue: tuple) -> tuple[float, float, float]:
    share = (1 - grey) / (1 - GREYS["stick"])
    r, g, b = (grey if c == 1 and hue == HUES[0] else 1 - share * (1 - c) for c in hue)
    return r, g, b


def label_of(path: Path, name: str) -> str:
    """Return the name of a quantity with its unit, if there is one."""
    unit = path.scene.units.get(name)
    return f"{name} ({unit})" if unit else name


def _shade(axis: Any, path: Path) -> None:
    for mode, begin, end in path.spans:
        axis.axvspan(begin, end, facecolor=shade(mode), linewidth=0)
    for event in path.events:
        axis.axvline(float(event.t), color="0.5", linewidth=0.4)


def _mark(axis: Any, path: Path, times: tuple, values: tuple) -> None:
    """Put a dot on a curve at every event, unless there are more than ``MANY`` events, or where it is only a point."""
    if len(path.events) > MANY:
        return
    at = dict(zip(times, values, strict=True))
    marks = [float(event.t) for event in path.events] if path.end else [0.0]
    axis.plot(marks, [at[t] for t in marks], "o", color=style.BLUE, markersize=2.2)


def is_constant(values: Any) -> bool:
    """Return whether values are equal but for rounding."""
    half = np.array(values, dtype=float) / 2  # the extent itself may be no double
    return bool(np.ptp(half) <= NOISE * np.max(np.abs(half)))


def around(values: Any) -> tuple[float, float]:
    """Return the range of values with a margin; that of a constant is about as large as its size."""
    low, high = float(np.min(values)), float(np.max(values))
    beside = MARGIN * max(1.0, abs(low)) if is_constant(values) else MARGIN * high - MARGIN * low
    return low - beside, high + beside


def logarithmic_from(times: Any, values: Any) -> float | None:
    """Return the size above which the axis of a state is logarithmic, or None for a linear axis.

    |state| stays below some value for 95 % of the time. The size is the power of ten above that value, but at most
    ``DECADES`` below the largest |state|; the axis is linear unless |state| exceeds 20 times that value. Only finite
    values count.
    """
    sizes, weights = np.abs(values), np.gradient(np.array(times)) if times[-1] > 0 else np.ones(len(times))
    if not (finite := np.isfinite(sizes)).any():
        return None
    sizes, weights = sizes[finite], weights[finite]
    order = np.argsort(sizes)
    usual = sizes[order][np.searchsorted(np.cumsum(weights[order]), 0.95 * weights.sum())]
    if not sizes.max() / 20 > usual > 0:
        return None
    return float(10.0 ** np.ceil(np.log10(max(usual, sizes.max() / 10.0**DECADES))))


def _time_axis(axis: Any, path: Path) -> None:
    until = float(path.end)
    times = [float(event.t) for event in path.events] or [until]
    first, middle = times[0], median_low(times)  # of an oscillation, whose first event may be early, most are late
    axis.set_xlim(0, until or 1)  # before the scale, whose margins could leave the range of doubles
    if 0 < first <= middle < until / 50:
        begin = floor(log10(first))
        room = max(1, (log10(until) - begin) / WHOLE)  # of the linear part, whose tick stands apart from 0, in decades
        _logarithmic(axis, "x", 10.0**begin, room)


def _logarithmic(panel: Any, which: str, least: float, room: float) -> None:
    """Scale the axis x or y by asinh, which has no corner where logarithms begin; its ticks are 0 and powers of ten.

    The part from 0 to the first power, ``least``, is as long as ``room`` decades.
    """
    from matplotlib.ticker import LogFormatterSciNotation, SymmetricalLogLocator

    getattr(panel, f"set_{which}scale")("function", functions=_stretch(log(least) - log(sinh(room * log(10)))))
    axis = getattr(panel, f"{which}axis")
    axis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=least * ABOVE))
    axis.get_major_locator().set_params(numticks=TICKS[which])
    axis.set_major_formatter(LogFormatterSciNotation())


def _stretch(low: float) -> tuple[Any, Any]:
    """Return asinh(value / width) and its inverse for the width exp(``low``), which may lie below the doubles."""

    def forward(values: Any) -> Any:
        with np.errstate(divide="ignore"):
            power = np.log(np.abs(values)) - low
        return np.sign(values) * np.logaddexp(power, np.logaddexp(0, 2 * power) / 2)

    def inverse(places: Any) -> Any:
        with np.errstate(divide="ignore"):
            return np.sign(places) * np.exp(low + np.abs(places) + np.log(-np.expm1(-2 * np.abs(places)) / 2))

    return forward, inverse


def _legend(drawing: Any, path: Path) -> None:
    present = list(dict.fromkeys(path.modes))
    handles = [style.patch(shade(mode), mode, edgecolor="0.5", linewidth=0.4) for mode in present]
    columns = max(1, min(3, LETTERS // max(map(len, present)), len(present)))
    drawing.legend(handles=handles, loc="outside upper center", ncols=columns)
