"""The pictures of the paper and the page by name: each a thunk that computes its paths or reads its rows, and draws."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from asympk.errors import MissingPackage
from asympk.methods import solve
from asympk.pictures import anymechanism, drawings, maps, portraits
from asympk.pictures import damping as jam
from asympk.pictures.decreasing import decreasing
from asympk.scene import Scene
from asympk.storage.rows import Row, read_rows
from asympk.studies.damping import TINY
from asympk.studies.least import LADDER
from asympk.systems.catalogue import described_mechanism

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHASE_MU, JUMP_MUS, JUMP_START = "1/50", ("1/10", "1/100", "1/1000"), (0, "1/5", -1)
STEEP, SHALLOW = 1, Fraction(-1, 2)
RINGING, RINGS = 0.5, 66  # epsilon of the undamped rod that is drawn, and for how long
STEEP_STARTS = (((0, -2, -1), 5), ((0, -3, "9/10"), 5), ((0, "-3/5", "2/5"), 4))
CHARTS = {
    "chart-workprec-ii": "work.csv", "chart-cost": "work.csv", "chart-cost-ii": "work.csv",
    "chart-few": "work.csv", "chart-failures": "plane.csv", "chart-nonlinear": "nonlinear.csv",
    "chart-nonlinear-work": "nonlinear.csv", "chart-models": "models.csv",
}  # fmt: skip
MECHANISM_NAMES = {
    "painleve_klein": "Painlevé and Klein", "unequal_masses": "unequal masses", "held_rod": "mass on a spring",
    "butenin": "Butenin", "painleve_rod": "slender rod on the ground", "bead_rod": "bead on a rod",
    "brake_shoe": "brake shoe", "crank_slider": "crank and slider", "arm": "two-link arm",
}  # fmt: skip
README = ("phase", "jump", "regimes", "chart-cost-ii")
SHALLOW_STARTS = (((0, -4, -1), 5), ((0, -3, "9/10"), 4))


@dataclass(frozen=True)
class Picture:
    """A figure of the paper: its file name, how to draw it, and the file of rows that it is drawn from, if any."""

    name: str
    draw: Callable[[], "Figure"]
    rows: str = ""


def pictures(root: Path) -> tuple[Picture, ...]:
    """Return the pictures that can be drawn in the checkout ``root``: those from rows need their rows."""
    if not find_spec("matplotlib"):
        raise MissingPackage("figures need matplotlib: pip install 'asympk[plot]'")
    kept = Path(root) / "paper" / "generated" / "rows"
    found = [
        Picture("mechanisms", mechanisms_picture),
        Picture("system", drawings.draw_system),
        Picture("phase", phase_picture),
        Picture("jump", jump_picture),
        Picture("regimes", maps.regime_map),
        Picture("stick", partial(maps.stick_over_static_friction, ("1", "-17/10"))),
        *(Picture(name, partial(_from_rows, draw, kept / f"{name}.csv"), f"{name}.csv")
          for name, draw in (("convergence", maps.convergence), ("collisions", maps.collisions),
                             ("decreasing", decreasing), ("rebound", anymechanism.draw_rebound),
                             ("jumplaw", partial(anymechanism.draw_errors, names=MECHANISM_NAMES)),
                             ("least", partial(maps.least_models, names=list(LADDER))), ("damping", damping_picture))),
    ]  # fmt: skip
    return (*(picture for picture in found if not picture.rows or (kept / picture.rows).is_file()), *_charts(kept))


def _charts(kept):
    """Return the chart's pictures that the paper shows and whose rows are there; they are drawn together, once."""
    from asympk.output import chart

    drawn = cache(partial(chart.chart_figures, kept.parent))
    return [Picture(name, lambda name=name: drawn()[name], rows) for name, rows in CHARTS.items()
            if (kept / rows).is_file()]  # fmt: skip


def _from_rows(draw, file):
    return draw(read_rows(file))


def mechanisms_picture() -> "Figure":
    """Draw four mechanisms of the catalogue over their maps of rigid motions."""
    return anymechanism.draw_mechanisms({name: described_mechanism(name) for name in anymechanism.TITLES})


def phase_picture() -> "Figure":
    """Draw the phase space of the steep and the shallow rod with trajectories of the exact flow."""
    groups = []
    for sigma, words, starts in ((STEEP, "steep", STEEP_STARTS), (SHALLOW, "shallow", SHALLOW_STARTS)):
        paths = [solve(Scene(sigma, PHASE_MU, start, until)) for start, until in starts]
        groups.append((sigma, rf"{words} rod, $\sigma = {sigma}$", paths))
    return portraits.phase_space(groups)


def damping_picture(rows: list[Row]) -> "Figure":
    """Draw the time of the jam over the damping ratio, and the phase plane of the rod without damping."""
    d = TINY * RINGING
    return jam.draw_damping(rows, solve(Scene(STEEP, (RINGING / d) ** 2, (0, 0, -1 / d), RINGS / d)))


def jump_picture(until: float = 3) -> "Figure":
    """Draw the jump from z < 0 for decreasing mu beside one that holds x."""
    paths = [solve(Scene(STEEP, mu, JUMP_START, until)) for mu in JUMP_MUS]
    return portraits.jump_beside_the_vertical_one(paths, portraits.with_x_held(STEEP, JUMP_START, until))
