"""The picture of many trajectories: itineraries as a map over two arguments, or final states as dots, a panel each."""

from pathlib import Path as File
from typing import Any

import numpy as np

from asympk.many import OUTCOMES, Many
from asympk.pictures import plate, sheets, style
from asympk.shown import condensed, cut

INKS = ("#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#F0E442", "#0072B2", "#D55E00", "0.6")
HEIGHT, PANEL, LINE = 2.6, 0.95, 0.16  # inches
LETTERS = 50  # characters that fit into a row of the legend
LOGARITHMS = (-740, 709.7)  # of doubles
WIDE = 100  # quotient of two values of an axis from which on the axis may be logarithmic


def plot(many: Many, file: str | File | None = None) -> Any:
    """Return the matplotlib ``Figure`` of many trajectories, and write it to ``file`` if one is given.

    Axes along which there is one trajectory alone are left out.
    """
    axes = [(name, values) for name, values in many._axes() if values.size > 1] if many.n_events.size else []
    return sheets(file).kept(_map(many, *axes) if len(axes) == 2 else _panels(many, axes), file)


def _map(many: Many, down: tuple[str, Any], across: tuple[str, Any]) -> Any:
    """Draw the itinerary of each trajectory as a colour; itineraries beyond the seven most frequent share one."""
    from matplotlib.colors import ListedColormap

    shown, words, inks = _legend(many)
    (rows, low, up, tall), (columns, left, right, wide) = _cells("axis 0", *down), _cells("axis 1", *across)
    with plate(HEIGHT + LINE * len(words)) as (drawing, axes):
        axis = axes.flat[0]
        cells = shown.reshape(up.size, right.size)[np.ix_(up, right)]
        axis.set(xlabel=columns, ylabel=rows, xscale=wide, yscale=tall)
        axis.pcolormesh(left, low, cells, cmap=ListedColormap(inks), vmin=-0.5, vmax=len(inks) - 0.5, rasterized=True)
        if wide == "linear":
            axis.locator_params(axis="x", nbins=5)  # more ticks would overlap where numbers are long
        axis.minorticks_off()
        axis.grid(visible=False)
        drawing.legend(handles=[*map(style.patch, inks, words)], loc="outside upper left", ncols=1)
    return drawing


def _legend(many: Many) -> tuple[Any, list[str], list[str]]:
    """Return for each trajectory its place in the legend, and the words and colours of the legend."""
    found, lost = many.itineraries(), many.outcome > 0
    kinds, counts = np.unique(found.index[~lost], return_counts=True)
    kinds = kinds[np.argsort(-counts, kind="stable")]
    place = np.zeros(len(found.sequences), dtype=int)
    place[kinds] = np.minimum(np.arange(kinds.size), len(INKS) - 1)
    words = [condensed(", ".join(found.sequences[k])).replace(", ", " → ") or "no event" for k in kinds]
    if len(words) > len(INKS):
        words = [*words[: len(INKS) - 1], f"{len(words) - len(INKS) + 1} others"]
    inks = [*INKS[: len(words)]]
    if lost.any():
        words.append(f"not followed: {', '.join(OUTCOMES[k] for k in np.unique(many.outcome[lost]))}")
        inks.append(style.BLACK)
    return np.where(lost, len(words) - 1, place[found.index]), [cut(word, LETTERS) for word in words], inks


def _cells(count: str, name: str, values: Any) -> tuple[str, Any, Any, str]:
    """Return the name of an axis, the edges of its cells, the order in which its values increase, and its scale.

    Where two values are equal, the axis has the ``count`` of the values instead.
    """
    order = np.argsort(values, kind="stable")
    middles = np.array(values, dtype=float)[order]
    if not (np.diff(middles) > 0).all():
        name, middles, order = count, np.arange(order.size, dtype=float), np.arange(order.size)
    scale = _scale(middles)
    to, back = (np.log, np.exp) if scale == "log" else (np.array, np.array)
    steps = to(middles)
    between = steps[:-1] / 2 + steps[1:] / 2
    ends = steps[[0, -1]] + (steps[[0, -1]] - between[[0, -1]])
    if scale == "log":
        ends = np.clip(ends, *LOGARITHMS)
    return name, back(np.concatenate([ends[:1], between, ends[1:]])), order, scale


def _scale(values: Any) -> str:
    """Return "log" for values that are spaced more evenly by their logarithms and cover decades, else "linear"."""
    ordered = np.sort(np.array(values, dtype=float))
    if not 0 < ordered[0] < ordered[-1] / WIDE:
        return "linear"
    parts = ordered / ordered[-1]  # whose squares are doubles
    even, by_logarithm = (np.std(steps) / np.mean(steps) for steps in map(np.diff, (parts, np.log(ordered))))
    return "log" if by_logarithm <= even else "linear"


def _panels(many: Many, axes: list[tuple[str, Any]]) -> Any:
    name, values = axes[0] if len(axes) == 1 else ("trajectory", np.arange(many.n_events.size))
    followed = many.outcome.ravel() == 0
    rows = [*many.final.reshape(len(many.names), -1), many.n_events.ravel()]
    with plate(0.4 + PANEL * len(rows), len(rows), sharex=True) as (drawing, panels):
        for axis, row, label in zip(panels.flat, rows, (*many.names, "events"), strict=True):
            axis.plot(values[followed], row[followed], ".", color=style.BLUE, markersize=2.4)
            axis.set_ylabel(style.folded(label, PANEL))
        panels[-1, 0].set(xlabel=name, xscale=_scale(values) if axes else "linear")
        panels[-1, 0].locator_params(axis="y", integer=True, min_n_ticks=1)
        if name == "trajectory":
            panels[-1, 0].locator_params(axis="x", integer=True, min_n_ticks=1)
        for axis in panels.flat:
            axis.minorticks_off()
        if not followed.all():
            drawing.suptitle(f"{(~followed).sum()} of {followed.size} not followed", fontsize=style.RC["font.size"])
    return drawing
