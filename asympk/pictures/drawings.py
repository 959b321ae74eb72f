"""Drawings of the mechanics, figs. 1-4 of Fufaev 1991 in a design of their own; lengths on the sheet are inches."""

from math import atan2, cos, pi, sin, tan

from asympk.pictures import pen, style
from asympk.pictures.pen import GREY, THICK, THIN

WIDTH, HEIGHT = style.COLUMN, 3.2
STEEP = 1.02  # the angle at which rods are drawn, radians


def draw_system() -> style.Figure:
    """Draw the system in four panels: the masses on their guides, the elastic rod, the small turn, the friction law."""
    with pen.canvas(WIDTH, HEIGHT) as (figure, ax):
        half = WIDTH / 2
        for name, panel, x, y in (
            ("a", masses, 0, 1.62), ("b", rod, half, 1.62), ("c", small_turn, 0, 0), ("d", friction_law, half, 0)
        ):
            panel(ax, x, y)
            ax.text(x + 0.03, y + 1.5, f"({name})", ha="left", va="center")
    return figure


def masses(ax: style.Axes, x: float, y: float) -> None:
    """The two masses on parallel guides, the rod at the angle alpha, and the forces on the rough mass."""
    low, high = y + 0.32, y + 1.3
    first = (x + 0.62, low)
    second = (first[0] + (high - low) / tan(STEEP), high)
    pen.rough(ax, x + 0.1, x + 1.62, low - 0.07)
    pen.line(ax, (x + 0.1, high + 0.07), (x + 1.62, high + 0.07), THIN)
    pen.line(ax, first, second, THICK)
    pen.mass(ax, first, "$M_1$", (-0.12, 0.17))
    pen.mass(ax, second, "$M_2$", (0.2, -0.1))
    pen.angle(ax, first, 0.3, 0, STEEP, r"$\alpha$", 0.4)
    pen.line(ax, first, (first[0] + 0.42, low), 0.35)
    pen.arrow(ax, (x + 0.14, low), (first[0] - 0.08, low), "$P$", (0.02, 0.1))
    pen.arrow(ax, (first[0], low - 0.2), (first[0] - 0.4, low - 0.2), "$F$", (0.1, 0.0))
    beside = (-0.07 * sin(STEEP), 0.07 * cos(STEEP))
    for near, far in ((0.48, 0.2), (0.68, 0.96)):
        start, end = ((px + beside[0], py + beside[1]) for px, py in pen.points_on_ray(first, STEEP, near, far))
        pen.arrow(ax, start, end, "$R$", (-0.1, 0.04) if far > near else (-0.1, 0.0))
    ax.text(x + 1.62, high + 0.14, "smooth", ha="right", va="bottom", fontsize=6)
    ax.text(x + 1.62, low - 0.14, "rough: $f$, $f_0$", ha="right", va="top", fontsize=6)


def rod(ax: style.Axes, x: float, y: float) -> None:
    """The rod as a spring beside a damper (2.3)."""
    left, right, middle = x + 0.3, x + 1.4, y + 0.8
    pen.mass(ax, (left - 0.1, middle), "$M_1$", (-0.02, 0.17))
    pen.mass(ax, (right + 0.1, middle), "$M_2$", (0.02, 0.17))
    a, b = left + 0.12, right - 0.12
    for end, bar in ((left - 0.1, a), (right + 0.1, b)):
        pen.line(ax, (end, middle), (bar, middle), THIN)
        pen.line(ax, (bar, middle - 0.24), (bar, middle + 0.24), THIN)
    pen.spring(ax, (a, middle + 0.24), (b, middle + 0.24))
    pen.damper(ax, a, b, middle - 0.24)
    ax.text(x + 0.85, middle + 0.4, r"$R_1 = (k/l)\,\Delta l$", ha="center", va="bottom")
    damping = r"$R_2 = h\,k\,\mathrm{d}(\Delta l)/\mathrm{d}t = h\,l\,\dot{R}_1$"
    ax.text(x + 0.85, middle - 0.42, damping, ha="center", va="top")


def small_turn(ax: style.Axes, x: float, y: float) -> None:
    """The rod after M_1 has gained on M_2: the rod has become shorter by Delta l and turned by beta (2.2)."""
    angle, length, gain = 0.95, 1.28, 0.3
    foot = (x + 0.22, y + 0.3)
    top = (foot[0] + length * cos(angle), foot[1] + length * sin(angle))
    moved = (foot[0] + gain, foot[1])
    turned = atan2(top[1] - moved[1], top[0] - moved[0])
    pen.line(ax, (x + 0.1, foot[1]), (x + 1.55, foot[1]), THIN, color=GREY)
    pen.line(ax, (x + 0.6, top[1]), (x + 1.55, top[1]), THIN, color=GREY)
    pen.line(ax, foot, top, THIN, dashes=(4, 2))
    pen.line(ax, moved, top, THICK)
    shorter = gain * cos(angle)
    corner = (foot[0] + shorter * cos(angle), foot[1] + shorter * sin(angle))
    pen.line(ax, moved, corner, THIN)
    normal = (-sin(angle) * 0.06, cos(angle) * 0.06)
    ends = [(p[0] + normal[0], p[1] + normal[1]) for p in (foot, corner)]
    both_ways = {"arrowstyle": "<->", "lw": THIN, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 4}
    ax.annotate("", ends[0], ends[1], arrowprops=both_ways)
    ax.text(x + 0.16, y + 0.5, r"$\Delta l$", ha="center", va="center")
    ax.text(x + 0.5, y + 0.92, "$l$", ha="center", va="center")
    for place, name, dx in ((foot, None, 0), (moved, "$M_1$", 0.1), (top, "$M_2$", 0.16)):
        pen.mass(ax, place, name, (dx + 0.05, 0.11 if name == "$M_1$" else -0.1), 0.032)
    ax.annotate("", (foot[0], y + 0.2), (moved[0], y + 0.2), arrowprops=both_ways)
    ax.text((foot[0] + moved[0]) / 2, y + 0.09, r"$x_1 - x_2$", ha="center", va="center")
    pen.arc(ax, top, 0.62, angle + pi, turned + pi)
    ax.text(top[0] - 0.36, top[1] - 0.72, r"$\beta$", ha="center", va="center")
    pen.line(ax, moved, (moved[0] + 0.62, moved[1]), THIN)
    pen.angle(ax, moved, 0.42, 0, turned, r"$\alpha + \beta$", 0.62, lift=-0.05)


def friction_law(ax: style.Axes, x: float, y: float) -> None:
    """Coulomb's law: F against the velocity u, f in slip, up to f_0 at rest."""
    middle, centre, reach = y + 0.78, x + 0.86, 0.62
    kinetic, static = 0.34, 0.5
    pen.arrow(ax, (x + 0.14, middle), (x + 1.62, middle), None)
    pen.arrow(ax, (centre, y + 0.1), (centre, y + 1.46), None)
    ax.text(x + 1.6, middle - 0.1, "$u$", ha="center", va="center")
    ax.text(centre + 0.08, y + 1.42, r"$F\,/\,(|R|\sin\alpha)$", ha="left", va="center")
    pen.line(ax, (centre - reach, middle + kinetic), (centre, middle + kinetic), THICK)
    pen.line(ax, (centre, middle - kinetic), (centre + reach, middle - kinetic), THICK)
    pen.line(ax, (centre, middle - static), (centre, middle + static), THICK)
    hollow, full = {"mfc": "white", "mec": "black", "mew": 0.5}, {"color": "black"}
    for size, raised, name, looks in ((kinetic, 0, "f{}", hollow), (static, 0.02, "f_0", full)):
        for sign, front, at in ((1, "", "left"), (-1, "-", "right")):
            level = middle + sign * size
            ax.plot([centre], [level], "o", ms=2.4, **looks)
            ax.text(centre + sign * 0.07, level + sign * raised, f"${front}{name}$", ha=at, va="center")
