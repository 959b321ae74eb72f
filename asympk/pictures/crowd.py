"""The picture of many trajectories: itineraries as a map over two arguments, or final states as dots, a panel each."""

from pathlib import Path as File
from typing import Any

import numpy as np

from asympk.many import Many
from asympk.pictures import plate, sheets, style

INKS = ("#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#F0E442", "#0072B2", "#D55E00", "0.6")
HEIGHT, PANEL, LINE = 2.6, 0.95, 0.16  # inches


def plot(many: Many, file: str | File | None = None) -> Any:
    """Return the matplotlib ``Figure`` of many trajectories, and write it to ``file`` if one is given."""
    draw = _map if many.n_events.ndim == 2 and many.n_events.size else _panels
    return sheets(file).kept(draw(many), file)


def _map(many: Many) -> Any:
    """Draw the itinerary of each trajectory as a colour; itineraries beyond the seven most frequent share one."""
    from matplotlib.colors import ListedColormap

    found = many.itineraries()
    shown = np.minimum(found.index, len(INKS) - 1)
    (rows, down), (columns, across) = many._axes()
    with plate(HEIGHT + LINE * min(len(found.sequences), len(INKS))) as (drawing, axes):
        axis, inks = axes.flat[0], ListedColormap(INKS)
        axis.pcolormesh(across, down, shown, cmap=inks, vmin=-0.5, vmax=len(INKS) - 0.5, rasterized=True)
        axis.set(xlabel=columns, ylabel=rows)
        axis.grid(visible=False)
        words = [" → ".join(sequence) or "no event" for sequence in found.sequences]
        if len(words) > len(INKS):
            words = [*words[: len(INKS) - 1], f"{len(words) - len(INKS) + 1} others"]
        drawing.legend(handles=[*map(style.patch, INKS, words)], loc="outside upper left", ncols=1)
    return drawing


def _panels(many: Many) -> Any:
    axes = many._axes()
    name, values = axes[0] if len(axes) == 1 else ("trajectory", np.arange(many.n_events.size))
    rows = [*many.final.reshape(len(many.names), -1), many.n_events.ravel()]
    with plate(0.4 + PANEL * len(rows), len(rows), sharex=True) as (drawing, panels):
        for axis, row, label in zip(panels.flat, rows, (*many.names, "events"), strict=True):
            axis.plot(values, row, ".", color=style.BLUE, markersize=2.4)
            axis.set_ylabel(style.folded(label, PANEL))
        panels[-1, 0].locator_params(axis="y", integer=True, min_n_ticks=1)
        if name == "trajectory":
            panels[-1, 0].locator_params(axis="x", integer=True, min_n_ticks=1)
        panels[-1, 0].set_xlabel(name)
    return drawing
