"""The jump law of any mechanism: four mechanisms over their maps of rigid motions, its errors, and the rebound."""

from itertools import groupby
from math import cos, log, pi, sin
from typing import Any

from asympk.pictures import drawings, style
from asympk.pictures.drawings import THICK, THIN
from asympk.pictures.motions import draw_motions, motion_handles
from asympk.pictures.portraits import plate

LOOKS = ((style.BLUE, "o"), (style.RED, "s"), (style.GREEN, "^"))
WIDE, SKETCH = 7.04, 1.15  # inches: the page, and the height of a drawing


def mechanisms(told: dict[str, Any]) -> Any:
    """Draw mechanisms of the catalogue by their names in ``SKETCHES``, each over its map of rigid motions."""
    from matplotlib.figure import Figure

    matplotlib = style.matplotlib()
    with matplotlib.rc_context(style.RC):
        figure = Figure(figsize=(WIDE, 3.15), layout="constrained")
        axes = figure.subplots(2, len(told), height_ratios=(SKETCH, 1.6))
        shown: set[int] = set()
        for column, (name, described) in enumerate(told.items()):
            sketch, below = axes[:, column]
            words, draw = SKETCHES[name]
            sketch.set(xlim=(0, 1.7), ylim=(0, SKETCH), aspect="equal")
            sketch.set_axis_off()
            sketch.set_title(f"({'abcd'[column]}) {words}", pad=2)
            draw(sketch)
            shown |= draw_motions(below, described)
            below.set_ylabel("friction" if column == 0 else "")
        figure.legend(handles=motion_handles(shown), loc="outside lower center", ncols=len(shown))
    return figure


def _two_masses(ax):
    low, high, angle = 0.2, 0.95, 1.02
    first, second = (0.5, low), (0.5 + (high - low) * cos(angle) / sin(angle), high)
    drawings.rough(ax, 0.1, 1.6, low - 0.07)
    drawings.line(ax, (0.1, high + 0.07), (1.6, high + 0.07), THIN)
    drawings.line(ax, first, second, THICK)
    drawings.mass(ax, first, None, None)
    drawings.mass(ax, second, None, None)
    drawings.angle_mark(ax, first, 0.28, 0, angle, r"$\alpha$", 0.4)
    drawings.line(ax, first, (first[0] + 0.4, low), 0.35)
    drawings.arrow(ax, (0.1, low), (first[0] - 0.08, low), "$P$", (0.05, 0.1))


def _slender_rod(ax):
    foot, angle = (0.35, 0.15), 0.75
    _ground(ax, 0.15)
    drawings.line(ax, foot, (foot[0] + 1.1 * cos(angle), foot[1] + 1.1 * sin(angle)), 3.0)
    drawings.angle_mark(ax, foot, 0.4, 0, angle, r"$\theta$", 0.52)
    drawings.arrow(ax, (1.45, 0.95), (1.45, 0.6), "$g$", (0.09, -0.15))
    drawings.arrow(ax, (foot[0] + 0.03, 0.3), (foot[0] - 0.3, 0.3), None)


def _crank_and_slider(ax):
    centre, theta, crank, level = (0.35, 0.42), 0.95, 0.42, 0.42
    pin = (centre[0] + crank * cos(theta), centre[1] + crank * sin(theta))
    slider = (pin[0] + 0.62, level)
    drawings.line(ax, centre, pin, THICK)
    drawings.line(ax, pin, slider, THICK)
    drawings.line(ax, centre, slider, 0.35, dashes=(4, 2))
    for place in (centre, pin):
        drawings.mass(ax, place, None, None, 0.035)
    _block(ax, slider, 0.14)
    drawings.rough(ax, 0.95, 1.6, level - 0.14)
    drawings.line(ax, (0.95, level + 0.14), (1.6, level + 0.14), THIN)
    drawings.angle_mark(ax, centre, 0.17, 0, theta, r"$\theta$", 0.28)
    drawings.angle_mark(ax, slider, 0.35, pi - 0.5, pi, r"$\varphi$", 0.46)


def _two_links(ax):
    shoulder, a, b, long = (0.3, 1.0), 1.15, 0.45, 0.62
    elbow = (shoulder[0] + long * sin(a), shoulder[1] - long * cos(a))
    tip = (elbow[0] + long * sin(b), elbow[1] - long * cos(b))
    _ground(ax, tip[1])
    for start, end in ((shoulder, elbow), (elbow, tip)):
        drawings.line(ax, start, end, THICK)
    for place in (shoulder, elbow):
        drawings.mass(ax, place, None, None, 0.035)
        drawings.line(ax, place, (place[0], place[1] - 0.42), 0.35, dashes=(4, 2))
    drawings.angle_mark(ax, shoulder, 0.25, -pi / 2, a - pi / 2, "$a$", 0.36)
    drawings.angle_mark(ax, elbow, 0.25, -pi / 2, b - pi / 2, "$b$", 0.36)


def _ground(ax, level):
    drawings.rough(ax, 0.05, 1.65, level)


def _block(ax, centre, half):
    from matplotlib.patches import Rectangle

    corner = centre[0] - half, centre[1] - half
    ax.add_patch(Rectangle(corner, 2 * half, 2 * half, facecolor="white", edgecolor="black", lw=0.8, zorder=3))


SKETCHES = {
    "painleve_klein": ("Painlev\u00e9 and Klein", _two_masses),
    "painleve_rod": ("slender rod on the ground", _slender_rod),
    "crank_slider": ("crank and slider", _crank_and_slider),
    "arm": ("two-link arm", _two_links),
}


def errors(rows: list[dict], names: dict[str, str]) -> Any:
    """Draw error / (c log(1/c)) of the jump law over 1 / log(1/c), in units of its limit, with straight lines."""
    with plate(1.9) as (figure, axes):
        ax = axes.flat[0]
        for (name, group), (ink, mark) in zip(groupby(rows, key=lambda row: row["mechanism"]), LOOKS, strict=True):
            several = list(group)
            limit, slope = _line_through(several[-2:])
            at = [_over_log(row) for row in several]
            ax.plot((0, at[0]), (1, 1 + slope * at[0] / limit), color=ink, lw=0.5)
            ax.plot(at, [row["ratio"] / limit for row in several], mark, color=ink, mfc="white", ms=3.4)
            ax.annotate(names[name], (at[0], several[0]["ratio"] / limit), (5, 0), textcoords="offset points",
                        va="center", color=ink)  # fmt: skip
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
    """Return the constant A to which error / (c log(1/c)) tends, from the last two rows."""
    return _line_through(rows[-2:])[0]


def rebound(rows: list[dict]) -> Any:
    """Draw the rebound of a one-sided contact over the damping ratio: formula, marks that were followed, two limits."""
    with plate(2.1) as (figure, axes):
        ax = axes.flat[0]
        cases = groupby(rows, key=lambda row: (row["theta"], row["friction"]))
        for ((theta, friction), group), (ink, mark) in zip(cases, LOOKS, strict=True):
            several = list(group)
            ratio = [row["ratio"] for row in several]
            ax.plot(ratio, [row["law"] for row in several], color=ink)
            thick = [row for row in several if row["ratio"] > 1.5]
            ax.plot([r["ratio"] for r in thick], [r["overdamped"] for r in thick], color=ink, lw=0.6, ls=(0, (4, 2)))
            ax.plot(ratio[:14], [row["undamped"] for row in several[:14]], color=ink, lw=0.6, ls=(0, (1, 1)))
            met = [row for row in several if row["followed"] is not None]
            label = rf"$\theta = {theta:g}$, $f = {friction:g}$"
            ax.plot([row["ratio"] for row in met], [row["followed"] for row in met], mark, color=ink, mfc="white", ms=3,
                    label=label)  # fmt: skip
        ax.set(xscale="log", yscale="log", xlabel="damping ratio $b$", ylabel=r"$\dot g^+/|\gamma_0|$", ylim=(2e-5, 1))
        ax.minorticks_off()
        ax.legend(loc="lower left")
    return figure
