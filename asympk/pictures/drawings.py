"""Drawings of the mechanics, figs. 1-4 of Fufaev 1991 in a design of their own; lengths on the sheet are inches."""

from math import atan2, cos, pi, sin

from asympk.pictures import style

WIDTH, HEIGHT = style.COLUMN, 3.2
STEEP = 1.02  # the angle at which rods are drawn, radians
THICK, THIN = 1.1, 0.6
GREY = "0.55"


def system():
    """Draw the system in four panels: the masses on their guides, the elastic rod, the small turn, the friction law."""
    matplotlib = style.matplotlib()

    with matplotlib.rc_context(style.RC):
        figure, ax = canvas(WIDTH, HEIGHT)
        half = WIDTH / 2
        for name, panel, x, y in (
            ("a", masses, 0, 1.62), ("b", rod, half, 1.62), ("c", small_turn, 0, 0), ("d", friction_law, half, 0)
        ):  # fmt: skip
            panel(ax, x, y)
            ax.text(x + 0.03, y + 1.5, f"({name})", ha="left", va="center")
    return figure


def canvas(width, height):
    """Return a figure of ``width`` x ``height`` inches and its axes, whose unit is the inch."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    ax = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(0, height))
    ax.set_axis_off()
    return figure, ax


def masses(ax, x, y):
    """The two masses on parallel guides, the rod at the angle alpha, and the forces on the rough mass."""
    low, high = y + 0.32, y + 1.3
    first = (x + 0.62, low)
    second = (first[0] + (high - low) / _tan(STEEP), high)
    rough(ax, x + 0.1, x + 1.62, low - 0.07)
    line(ax, (x + 0.1, high + 0.07), (x + 1.62, high + 0.07), THIN)
    line(ax, first, second, THICK)
    mass(ax, first, "$M_1$", (-0.12, 0.17))
    mass(ax, second, "$M_2$", (0.2, -0.1))
    angle_mark(ax, first, 0.3, 0, STEEP, r"$\alpha$", 0.4)
    line(ax, first, (first[0] + 0.42, low), 0.35)
    arrow(ax, (x + 0.14, low), (first[0] - 0.08, low), "$P$", (0.02, 0.1))
    arrow(ax, (first[0], low - 0.2), (first[0] - 0.4, low - 0.2), "$F$", (0.1, 0.0))
    beside = (-0.07 * sin(STEEP), 0.07 * cos(STEEP))
    for near, far in ((0.48, 0.2), (0.68, 0.96)):
        ends = [(px + beside[0], py + beside[1]) for px, py in _along(first, STEEP, near, far)]
        arrow(ax, *ends, "$R$", (-0.1, 0.04) if far > near else (-0.1, 0.0))
    ax.text(x + 1.62, high + 0.14, "smooth", ha="right", va="bottom", fontsize=6)
    ax.text(x + 1.62, low + 0.0, "rough: $f$, $f_0$", ha="right", va="bottom", fontsize=6)


def rod(ax, x, y):
    """The rod as a spring beside a damper (2.3)."""
    left, right, middle = x + 0.3, x + 1.4, y + 0.8
    mass(ax, (left - 0.1, middle), "$M_1$", (-0.02, 0.17))
    mass(ax, (right + 0.1, middle), "$M_2$", (0.02, 0.17))
    a, b = left + 0.12, right - 0.12
    for end, bar in ((left - 0.1, a), (right + 0.1, b)):
        line(ax, (end, middle), (bar, middle), THIN)
        line(ax, (bar, middle - 0.24), (bar, middle + 0.24), THIN)
    _spring(ax, a, b, middle + 0.24)
    _damper(ax, a, b, middle - 0.24)
    ax.text(x + 0.85, middle + 0.4, r"$R_1 = (k/l)\,\Delta l$", ha="center", va="bottom")
    damping = r"$R_2 = h\,k\,\mathrm{d}(\Delta l)/\mathrm{d}t = h\,l\,\dot{R}_1$"
    ax.text(x + 0.85, middle - 0.42, damping, ha="center", va="top")


def small_turn(ax, x, y):
    """What a gain of M_1 on M_2 does to the rod: it shortens by Delta l and turns by beta (2.2)."""
    angle, length, gain = 0.95, 1.28, 0.3
    foot = (x + 0.22, y + 0.3)
    top = (foot[0] + length * cos(angle), foot[1] + length * sin(angle))
    moved = (foot[0] + gain, foot[1])
    turned = atan2(top[1] - moved[1], top[0] - moved[0])
    line(ax, (x + 0.1, foot[1]), (x + 1.55, foot[1]), THIN, color=GREY)
    line(ax, (x + 0.6, top[1]), (x + 1.55, top[1]), THIN, color=GREY)
    line(ax, foot, top, THIN, dashes=(4, 2))
    line(ax, moved, top, THICK)
    shorter = gain * cos(angle)
    corner = (foot[0] + shorter * cos(angle), foot[1] + shorter * sin(angle))
    line(ax, moved, corner, THIN)
    normal = (-sin(angle) * 0.06, cos(angle) * 0.06)
    ends = [(p[0] + normal[0], p[1] + normal[1]) for p in (foot, corner)]
    ax.annotate("", ends[0], ends[1], arrowprops={"arrowstyle": "<->", "lw": THIN, "shrinkA": 0, "shrinkB": 0,
                                                  "mutation_scale": 4})
    ax.text(x + 0.16, y + 0.5, r"$\Delta l$", ha="center", va="center")
    ax.text(x + 0.5, y + 0.92, "$l$", ha="center", va="center")
    for place, name, dx in ((foot, None, 0), (moved, "$M_1$", 0.1), (top, "$M_2$", 0.16)):
        mass(ax, place, name, (dx + 0.05, 0.11 if name == "$M_1$" else -0.1), 0.032)
    ax.annotate("", (foot[0], y + 0.2), (moved[0], y + 0.2),
                arrowprops={"arrowstyle": "<->", "lw": THIN, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 4})
    ax.text((foot[0] + moved[0]) / 2, y + 0.09, r"$x_1 - x_2$", ha="center", va="center")
    _arc(ax, top, 0.62, angle + pi, turned + pi)
    ax.text(top[0] - 0.36, top[1] - 0.72, r"$\beta$", ha="center", va="center")
    line(ax, moved, (moved[0] + 0.62, moved[1]), THIN)
    angle_mark(ax, moved, 0.42, 0, turned, r"$\alpha + \beta$", 0.62, lift=-0.05)


def friction_law(ax, x, y):
    """Coulomb's law: F against the velocity u, f in slip, up to f_0 at rest."""
    middle, centre, reach = y + 0.78, x + 0.86, 0.62
    kinetic, static = 0.34, 0.5
    arrow(ax, (x + 0.14, middle), (x + 1.62, middle), None)
    arrow(ax, (centre, y + 0.1), (centre, y + 1.46), None)
    ax.text(x + 1.6, middle - 0.1, "$u$", ha="center", va="center")
    ax.text(centre + 0.08, y + 1.42, r"$F\,/\,(|R|\sin\alpha)$", ha="left", va="center")
    line(ax, (centre - reach, middle + kinetic), (centre, middle + kinetic), THICK)
    line(ax, (centre, middle - kinetic), (centre + reach, middle - kinetic), THICK)
    line(ax, (centre, middle - static), (centre, middle + static), THICK)
    for sign, side, name in ((1, 1, "$f{}$"), (-1, -1, "$-f{}$")):
        level = middle + sign * kinetic
        ax.plot([centre], [level], "o", ms=2.4, mfc="white", mec="black", mew=0.5)
        ax.text(centre + side * 0.07, level, name, ha="left" if side > 0 else "right", va="center")
    for sign, side, name in ((1, 1, "$f_0$"), (-1, -1, "$-f_0$")):
        level = middle + sign * static
        ax.plot([centre], [level], "o", ms=2.4, color="black")
        ax.text(centre + side * 0.07, level + sign * 0.02, name, ha="left" if side > 0 else "right", va="center")


def _tan(angle):
    return sin(angle) / cos(angle)


def line(ax, start, end, width, color="black", dashes=None):
    style_of = {"dashes": dashes} if dashes else {}
    ax.plot(*zip(start, end, strict=True), color=color, lw=width, solid_capstyle="round", **style_of)


def mass(ax, place, name, offset, radius=0.07):
    from matplotlib.patches import Circle

    ax.add_patch(Circle(place, radius, facecolor="white" if radius > 0.05 else "black", edgecolor="black", lw=0.8,
                        zorder=3))
    if name:
        ax.text(place[0] + offset[0], place[1] + offset[1], name, ha="center", va="center")


def rough(ax, left, right, level):
    line(ax, (left, level), (right, level), THIN)
    step = 0.07
    for k in range(1, int((right - left) / step)):
        line(ax, (left + k * step, level), (left + k * step - 0.05, level - 0.05), 0.35)


def arrow(ax, start, end, name, offset=(0, 0)):
    ax.annotate("", end, start, zorder=4,
                arrowprops={"arrowstyle": "-|>", "lw": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6,
                            "color": "black"})
    if name:
        ax.text(start[0] + offset[0], start[1] + offset[1], name, ha="center", va="center")


def _along(place, angle, near, far):
    return tuple((place[0] + d * cos(angle), place[1] + d * sin(angle)) for d in (near, far))


def _arc(ax, centre, radius, start, end, color="black"):
    from matplotlib.patches import Arc

    ax.add_patch(Arc(centre, 2 * radius, 2 * radius, theta1=start * 180 / pi, theta2=end * 180 / pi, lw=THIN,
                     color=color))


def angle_mark(ax, centre, radius, start, end, name, reach, lift=0.0):
    _arc(ax, centre, radius, start, end)
    middle = (start + end) / 2
    ax.text(centre[0] + reach * cos(middle), centre[1] + reach * sin(middle) + lift, name, ha="center", va="center")


def _spring(ax, left, right, level):
    turns, lead = 7, 0.12
    xs, ys = [left, left + lead], [level, level]
    width = (right - left - 2 * lead) / turns
    for k in range(turns):
        xs += [left + lead + (k + 0.25) * width, left + lead + (k + 0.75) * width]
        ys += [level + 0.07, level - 0.07]
    ax.plot([*xs, right - lead, right], [*ys, level, level], color="black", lw=0.8, solid_joinstyle="round")


def _damper(ax, left, right, level):
    middle = (left + right) / 2
    line(ax, (left, level), (middle - 0.14, level), THIN)
    ax.plot([middle + 0.14, middle - 0.14, middle - 0.14, middle + 0.14], [level + 0.08, level + 0.08, level - 0.08,
            level - 0.08], color="black", lw=0.8)
    line(ax, (middle + 0.02, level - 0.055), (middle + 0.02, level + 0.055), THICK)
    line(ax, (middle + 0.02, level), (right, level), THIN)
