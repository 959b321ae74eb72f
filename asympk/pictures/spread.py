"""The picture of a sweep's summary: how the final states spread, and the most frequent itineraries."""

from pathlib import Path as File
from typing import Any

from asympk.many import OUTCOMES
from asympk.pictures import plate, sheets, style
from asympk.shown import condensed, cut

ROW, MARGIN, SHOWN = 0.32, 0.9, 8  # inches, inches, itineraries
_BARS = ((0, 1, 1), (0.05, 0.95, 4), (0.25, 0.75, 12))  # (lower, upper probability, width in points)


def plot(summary: dict[str, Any], file: str | File | None = None) -> Any:
    """Return the matplotlib ``Figure`` of a summary, and write it to ``file`` if one is given.

    For each state, the thick bar spans half of the final values, the thin bar nine tenths, the line all of them; the
    dot is the median. Below are the numbers of trajectories with each itinerary and, in grey, of those that were not
    followed to their end.
    """
    sheet = sheets(file)
    found = {state: quantiles for state, quantiles in summary["quantiles"].items() if quantiles}
    words = [(itinerary, n, style.BLUE) for itinerary, n in summary["itineraries"].items()][:SHOWN]
    words += [(f"not followed: {outcome}", n, style.BLACK) for outcome, n in summary["outcomes"].items()
              if outcome != OUTCOMES[0]]
    rows = [1.5] * len(found) + ([1 + len(words)] if words else [])
    with plate(MARGIN + ROW * sum(rows), len(rows), height_ratios=rows) as (drawing, panels):
        for panel, (state, quantiles) in zip(panels.flat, found.items(), strict=False):
            _spread(panel, state, dict(zip(summary["probabilities"], quantiles, strict=False)))
        if words:
            _bars(panels[-1, 0], words)
    return sheet.kept(drawing, file)


def _spread(panel: Any, state: str, quantiles: dict[float, float]) -> None:
    for low, high, width in _BARS:
        panel.plot([quantiles[low], quantiles[high]], [0, 0], color=style.BLUE, linewidth=width, alpha=0.5,
                   solid_capstyle="butt")
    panel.plot([quantiles[0.5]], [0], "o", color=style.BLACK, markersize=3)
    panel.set(yticks=[], ylabel=style.folded(state, 1.5 * ROW))
    panel.locator_params(axis="x", nbins=5)  # more ticks would overlap where numbers are long


def _bars(panel: Any, rows: list[tuple[str, int, str]]) -> None:
    shown, counts, inks = zip(*rows, strict=True)
    panel.barh(range(len(rows)), counts, color=inks, alpha=0.3)
    for row, itinerary in enumerate(shown):
        words = cut(condensed(itinerary), 60)
        panel.annotate(words, (0, row), (2, 0), va="center", textcoords="offset points")
    panel.set(yticks=[], ylabel="itineraries", xlabel="trajectories")
    panel.locator_params(axis="x", integer=True)
    panel.invert_yaxis()
