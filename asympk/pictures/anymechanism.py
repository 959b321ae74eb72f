"""Figures on the jump law of any mechanism: four mechanisms with their rigid motions, errors of the law, rebounds."""

from itertools import groupby
from math import log
from typing import Any

from asympk.pictures import plate, sketches, style
from asympk.pictures.rigid import draw_motions, motion_handles

WIDE = 7.04  # inches: the width of a figure across both columns
NAMES = {
    "painleve_klein": "Painlevé and Klein", "unequal_masses": "unequal masses", "held_rod": "mass on a spring",
    "butenin": "Butenin", "painleve_rod": "slender rod on the ground", "bead_rod": "bead on a rod",
    "brake_shoe": "brake shoe", "crank_slider": "crank and slider", "arm": "two-link arm",
}


def draw_mechanisms(mechanisms: dict[str, Any]) -> Any:
    """Draw up to four mechanisms, {name in the catalogue: mechanism}, each above its map of rigid motions."""
    ratios = (sketches.HEIGHT, 1.7)
    with plate(3.9, 2, len(mechanisms), width=WIDE, height_ratios=ratios) as (figure, axes):
        shown: set[int] = set()
        for column, (name, described) in enumerate(mechanisms.items()):
            sketch, below = axes[:, column]
            sketch.set(xlim=(0.04, sketches.WIDTH - 0.05), ylim=(0, sketches.HEIGHT), aspect="equal")
            sketch.set_axis_off()
            sketch.set_title(f"({'abcd'[column]}) {NAMES[name]}", pad=2)
            sketches.SKETCHES[name].draw(sketch)
            shown |= draw_motions(below, described)
            below.set_ylabel("friction" if column == 0 else "")
        figure.legend(handles=motion_handles(shown), loc="outside lower center", ncols=len(shown))
    return figure


def draw_errors(rows: list[dict]) -> Any:
    """Draw error/(A c log(1/c)) of the jump law over 1/log(1/c), with the line through 1 at 0 and the last two rows.

    A is the limit of error/(c log(1/c)) on that line.
    """
    with plate(1.9) as (figure, [[ax]]):
        by_mechanism = groupby(rows, key=lambda row: row["mechanism"])
        for (name, group), (ink, mark) in zip(by_mechanism, style.MARKS, strict=True):
            several = list(group)
            limit, slope = _line_through(several[-2:])
            at = [_over_log(row) for row in several]
            ax.plot((0, at[0]), (1, 1 + slope * at[0] / limit), color=ink, lw=0.5)
            ax.plot(at, [row["ratio"] / limit for row in several], mark, color=ink, mfc="white", ms=3.4)
            ax.annotate(NAMES[name], (at[0], several[0]["ratio"] / limit), (5, 0), textcoords="offset points",
                        va="center", color=ink)
        ax.axhline(1, color="0.5", lw=0.4)
        ax.set(xlim=(0, 0.23), xlabel=r"$1/\log(1/c)$", ylabel=r"$\mathrm{error}/(A\,c\,\log(1/c))$")
    return figure


def _over_log(row):
    return 1 / log(1 / row["compliance"])


def _line_through(pair):
    """Return the value at 0 and the slope of the line through two rows over 1 / log(1/c)."""
    (x, u), (y, v) = ((_over_log(row), row["ratio"]) for row in pair)
    slope = (v - u) / (y - x)
    return u - slope * x, slope


def limit(rows: list[dict]) -> float:
    """Return the constant A to which error/(c log(1/c)) tends, by the line through the last two rows."""
    return _line_through(rows[-2:])[0]


def draw_rebound(rows: list[dict]) -> Any:
    """Draw the rebound of a unilateral contact over b = h / sqrt(c): formula, motions as marks, two limit laws."""
    with plate(2.1) as (figure, [[ax]]):
        cases = groupby(rows, key=lambda row: (row["theta"], row["friction"]))
        for ((theta, friction), group), (ink, mark) in zip(cases, style.MARKS, strict=True):
            several = list(group)
            ratio = [row["ratio"] for row in several]
            ax.plot(ratio, [row["law"] for row in several], color=ink)
            thick = [row for row in several if row["ratio"] > 1.5]
            ax.plot([r["ratio"] for r in thick], [r["overdamped"] for r in thick], color=ink, lw=0.6, ls=(0, (4, 2)))
            ax.plot(ratio[:14], [row["undamped"] for row in several[:14]], color=ink, lw=0.6, ls=(0, (1, 1)))
            met = [row for row in several if row["followed"] is not None]
            label = rf"$\theta = {theta:g}$, $f = {friction:g}$"
            ax.plot([row["ratio"] for row in met], [row["followed"] for row in met], mark, color=ink, mfc="white", ms=3,
                    label=label)
        style.logarithmic(ax, xlabel=r"$b=h/\sqrt{c}$", ylabel=r"$\dot g^+/|\gamma_0|$", ylim=(2e-5, 1))
        ax.legend(loc="lower left")
    return figure
