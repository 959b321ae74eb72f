"""What drawings of mechanisms are made with: lines, masses, guides, springs, forces and angles; lengths are inches."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import cos, pi, sin
from typing import Any

from asympk.pictures import sheets

Point = tuple[float, float]
THICK, THIN = 1.1, 0.6
GREY = "0.55"


@contextmanager
def canvas(width: float, height: float) -> Iterator[tuple[Any, Any]]:
    """Yield a figure of ``width`` x ``height`` inches and its axes, whose unit is the inch, in the common style."""
    sheet = sheets()
    with sheet.in_style():
        figure = sheet.Sheet(figsize=(width, height))
        ax = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(0, height))
        ax.set_axis_off()
        yield figure, ax


def text(ax: Any, place: Point, words: str, **options: Any) -> None:
    """Write words with their middle at a place."""
    ax.text(*place, words, **{"ha": "center", "va": "center", **options})


def line(ax: Any, start: Point, end: Point, width: float, color: str = "black", dashes: Any = None) -> None:
    """Draw a straight line."""
    style_of = {"dashes": dashes} if dashes else {}
    ax.plot(*zip(start, end, strict=True), color=color, lw=width, solid_capstyle="round", **style_of)


def mass(ax: Any, place: Point, name: str | None, offset: Point = (0, 0), radius: float = 0.07) -> None:
    """Draw a mass as a circle, filled where it is small, and its name at ``offset`` from it."""
    from matplotlib.patches import Circle

    ax.add_patch(Circle(place, radius, facecolor="white" if radius > 0.05 else "black", edgecolor="black", lw=0.8,
                        zorder=3))
    if name:
        text(ax, (place[0] + offset[0], place[1] + offset[1]), name)


def rough(ax: Any, left: float, right: float, level: float) -> None:
    """Draw a rough guide or the ground: a line that is hatched below."""
    line(ax, (left, level), (right, level), THIN)
    step = 0.07
    for k in range(1, int((right - left) / step)):
        line(ax, (left + k * step, level), (left + k * step - 0.05, level - 0.05), 0.35)


def arrow(ax: Any, start: Point, end: Point, name: str | None, offset: Point = (0, 0)) -> None:
    """Draw a force or an axis, with its name at ``offset`` from the start."""
    look = {"arrowstyle": "-|>", "lw": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6, "color": "black"}
    ax.annotate("", end, start, zorder=4, arrowprops=look)
    if name:
        text(ax, (start[0] + offset[0], start[1] + offset[1]), name)


def points_on_ray(place: Point, direction: float, near: float, far: float) -> tuple[Point, Point]:
    """Return the points at two distances from a place in a direction."""
    near_end, far_end = ((place[0] + d * cos(direction), place[1] + d * sin(direction)) for d in (near, far))
    return near_end, far_end


def arc(ax: Any, centre: Point, radius: float, start: float, end: float, color: str = "black") -> None:
    """Draw an arc between two angles in radians."""
    from matplotlib.patches import Arc

    ax.add_patch(Arc(centre, 2 * radius, 2 * radius, theta1=start * 180 / pi, theta2=end * 180 / pi, lw=THIN,
                     color=color))


def angle(
    ax: Any, centre: Point, radius: float, start: float, end: float, name: str, reach: float, lift: float = 0.0
) -> None:
    """Draw an angle and its name, which is ``reach`` away from the vertex."""
    arc(ax, centre, radius, start, end)
    middle = (start + end) / 2
    text(ax, (centre[0] + reach * cos(middle), centre[1] + reach * sin(middle) + lift), name)


def spring(ax: Any, left: Point, right: Point) -> None:
    """Draw a spring between two points."""
    turns, lead = 7, 0.12
    length = ((right[0] - left[0]) ** 2 + (right[1] - left[1]) ** 2) ** 0.5
    c, s = (right[0] - left[0]) / length, (right[1] - left[1]) / length
    width = (length - 2 * lead) / turns
    places: list[Point] = [(0, 0), (lead, 0)]
    places += [(lead + (k + part) * width, side) for k in range(turns) for part, side in ((0.25, 0.07), (0.75, -0.07))]
    places += [(length - lead, 0), (length, 0)]
    ax.plot([left[0] + u * c - v * s for u, v in places], [left[1] + u * s + v * c for u, v in places],
            color="black", lw=0.8, solid_joinstyle="round")


def damper(ax: Any, left: float, right: float, level: float) -> None:
    """Draw a horizontal damper."""
    middle = (left + right) / 2
    line(ax, (left, level), (middle - 0.14, level), THIN)
    ax.plot([middle + 0.14, middle - 0.14, middle - 0.14, middle + 0.14], [level + 0.08, level + 0.08, level - 0.08,
            level - 0.08], color="black", lw=0.8)
    line(ax, (middle + 0.02, level - 0.055), (middle + 0.02, level + 0.055), THICK)
    line(ax, (middle + 0.02, level), (right, level), THIN)
