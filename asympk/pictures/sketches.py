"""A sketch of every system of the catalogue, with its moving parts, its rough surface and its forces."""

from collections.abc import Callable
from functools import partial
from math import cos, pi, sin
from typing import Any, NamedTuple

from asympk.pictures import drawings, pen
from asympk.pictures.pen import GREY, THICK, THIN

WIDTH, HEIGHT = 2.4, 1.8


def sketch(name: str) -> Any:
    """Return the sketch of a system of the catalogue, a ``Figure``; raises ``MissingPackage`` without matplotlib."""
    with pen.canvas(WIDTH, HEIGHT) as (figure, ax):
        SKETCHES[name].draw(ax)
    return figure


def _two_guides(ax: Any, first: float = 0.07, second: float = 0.07) -> tuple[pen.Point, pen.Point]:
    """Draw a rough guide below a smooth one, a mass on each and the pull on the lower; return where the masses are."""
    low, high = (0.9, 0.5), (1.42, 1.35)
    pen.rough(ax, 0.3, 2.1, low[1] - first)
    pen.line(ax, (0.3, high[1] + second), (2.1, high[1] + second), THIN)
    for place, radius in ((low, first), (high, second)):
        pen.mass(ax, place, None, radius=radius)
    pen.arrow(ax, (0.35, low[1]), (low[0] - 0.08, low[1]), "$P$", (0.02, 0.1))
    return low, high


def _unequal(ax: Any) -> None:
    low, high = _two_guides(ax, 0.07, 0.11)
    pen.line(ax, low, high, THICK)
    pen.arrow(ax, (2.05, high[1]), (high[0] + 0.12, high[1]), "$S$", (-0.05, -0.1))
    pen.text(ax, (1.1, 0.53), "$m_1$")
    pen.text(ax, (1.2, 1.3), "$m_2$")
    pen.angle(ax, low, 0.42, 0, 1.02, r"$\alpha$", 0.52)


def _held(ax: Any) -> None:
    low, high = _two_guides(ax)
    pen.line(ax, low, high, THICK)
    pen.spring(ax, (0.3, high[1]), (high[0] - 0.07, high[1]))
    pen.line(ax, (0.3, high[1] - 0.2), (0.3, high[1] + 0.07), THICK)
    pen.text(ax, (0.85, 1.17), r"$\kappa$")
    pen.text(ax, (1.1, 0.58), "$M_1$")
    pen.text(ax, (1.62, 1.28), "$M_2$")


def _butenin(ax: Any) -> None:
    low, high = _two_guides(ax)
    pen.spring(ax, low, high)
    pen.text(ax, (1.42, 0.85), r"$1/\varepsilon^2$")
    pen.text(ax, (1.1, 0.53), "$M_1$")
    pen.text(ax, (1.62, 1.28), "$M_2$")


def _slender(ax: Any) -> pen.Point:
    """Draw a slender rod on its lower end, with weight and angle; return the place of the lower end."""
    end, tilt = (0.75, 0.4), 1.0
    top = (end[0] + 1.35 * cos(tilt), end[1] + 1.35 * sin(tilt))
    middle = ((end[0] + top[0]) / 2, (end[1] + top[1]) / 2)
    pen.line(ax, end, top, 3.0, color=GREY)
    pen.mass(ax, middle, None, radius=0.03)
    pen.arrow(ax, middle, (middle[0], middle[1] - 0.28), None)
    pen.text(ax, (middle[0] + 0.16, middle[1] - 0.2), "$mg$")
    pen.text(ax, (middle[0] - 0.28, middle[1] + 0.05), "$(X, Y)$")
    pen.angle(ax, end, 0.2, 0, tilt, r"$\theta$", 0.29)
    return end


def _rod_on_ground(ax: Any) -> None:
    _slender(ax)
    pen.rough(ax, 0.2, 2.2, 0.38)
    pen.text(ax, (1.95, 0.5), "rough: $f$", fontsize=6)


def _bead(ax: Any) -> None:
    end = _slender(ax)
    pen.line(ax, (0.2, end[1]), (2.2, end[1]), THICK)
    pen.mass(ax, end, None)
    pen.text(ax, (1.85, 0.52), "rough wire: $f$", fontsize=6)


def _shoe(ax: Any) -> None:
    hinge, shoe = (0.9, 1.4), (1.35, 0.42)
    pen.spring(ax, (0.2, hinge[1]), (hinge[0] - 0.18, hinge[1]))
    pen.line(ax, (0.2, 1.2), (0.2, 1.6), THICK)
    for level in (1.3, 1.5):
        pen.line(ax, (0.72, level), (1.08, level), THIN)
    for side in (0.72, 1.08):
        pen.line(ax, (side, 1.3), (side, 1.5), THIN)
    pen.line(ax, hinge, shoe, THICK)
    pen.line(ax, hinge, (hinge[0], 0.7), THIN, dashes=(4, 2))
    pen.mass(ax, shoe, None)
    pen.rough(ax, 0.3, 2.2, 0.35)
    pen.arrow(ax, (0.7, 0.16), (0.35, 0.16), "$v$", (0.1, 0))
    pen.angle(ax, hinge, 0.45, -pi / 2, -pi / 2 + 0.43, r"$\theta$", 0.6)
    for place, name in (((1.2, 1.4), "$M$"), ((1.53, 0.5), "$m$"), ((0.46, 1.58), r"$\kappa$"), ((1.28, 0.95), "$l$")):
        pen.text(ax, place, name)


def _crank(ax: Any) -> None:
    shaft, radius, tilt = (0.5, 0.7), 0.45, 1.0
    pin = (shaft[0] + radius * cos(tilt), shaft[1] + radius * sin(tilt))
    slider = (1.75, shaft[1])
    pen.arc(ax, shaft, radius, 0, 2 * pi, color=GREY)
    pen.line(ax, shaft, pin, THICK)
    pen.line(ax, pin, slider, THICK)
    pen.line(ax, shaft, slider, THIN, dashes=(4, 2))
    for side in (slider[0] - 0.16, slider[0] + 0.16):
        pen.line(ax, (side, 0.6), (side, 0.8), THIN)
    for level in (0.6, 0.8):
        pen.line(ax, (slider[0] - 0.16, level), (slider[0] + 0.16, level), THIN)
    pen.rough(ax, 1.35, 2.2, 0.59)
    pen.line(ax, (1.35, 0.81), (2.2, 0.81), THIN)
    for place in (shaft, pin):
        pen.mass(ax, place, None, radius=0.03)
    pen.angle(ax, shaft, 0.2, 0, tilt, r"$\theta$", 0.29)
    pen.angle(ax, slider, 0.4, pi - 0.36, pi, r"$\varphi$", 0.5)
    for place, name in (((0.52, 0.95), "$r$"), ((1.25, 1.0), "$l$"), ((2.02, 0.7), "$m$"), ((0.36, 0.62), "$J$")):
        pen.text(ax, place, name)


def _arm(ax: Any) -> None:
    shoulder = (0.5, 1.45)
    elbow = pen.points_on_ray(shoulder, -0.35, 0, 0.85)[1]
    hand = (elbow[0] + 0.5, 0.4)
    pen.line(ax, shoulder, elbow, 3.0, color=GREY)
    pen.line(ax, elbow, hand, 3.0, color=GREY)
    for place in (shoulder, elbow):
        pen.mass(ax, place, None, radius=0.06)
        pen.line(ax, place, (place[0], place[1] - 0.6), THIN, dashes=(4, 2))
    pen.rough(ax, 0.2, 2.3, 0.38)
    pen.angle(ax, shoulder, 0.3, -pi / 2, -0.35, "$a$", 0.4)
    pen.angle(ax, elbow, 0.3, -pi / 2, -0.99, "$b$", 0.42)
    pen.text(ax, (0.32, 1.55), "$S$")
    pen.text(ax, (1.45, 1.3), "$E$")


class Sketch(NamedTuple):
    """The title of a system on its page, and the function that draws it on axes in inches."""

    title: str
    draw: Callable[[Any], None]


SKETCHES = {
    "painleve_klein": Sketch("The rod of Painlevé and Klein", partial(drawings.masses, x=0.35, y=0.1)),
    "unequal_masses": Sketch("Unequal masses", _unequal),
    "held_rod": Sketch("A held rod", _held),
    "butenin": Sketch("The rod without damping", _butenin),
    "painleve_rod": Sketch("The rod on the ground", _rod_on_ground),
    "bead_rod": Sketch("The bead on a wire", _bead),
    "brake_shoe": Sketch("A brake shoe", _shoe),
    "crank_slider": Sketch("A slider-crank", _crank),
    "arm": Sketch("A two-link arm", _arm),
    "nonlinear_rod": Sketch("The rod with its geometry kept", partial(drawings.small_turn, x=0.35, y=0.1)),
}
