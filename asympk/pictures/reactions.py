"""The phase plane (R, R') of a contact without damping, at constant sliding velocity: Butenin's picture.

In the fast time R'' = -a_N - p R, with one constant p for R > 0 and one for R < 0. So R'^2/2 + a_N R + p R^2/2 is
conserved, and its level lines are the motions. They are closed around a centre (p > 0). The reaction runs away on those
beyond the separatrix through a saddle (p < 0), and on all where there is no equilibrium.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from asympk.mechanics.evaluation import evaluate
from asympk.pictures import style
from asympk.pictures.portraits import arrows

_WIDTH = 2.6  # half the width of the window, in units of the largest |a_N/p|, the |R| of an equilibrium


@dataclass(frozen=True)
class ReactionPlane:
    """The fast motion for one direction of sliding: a_N, and p where R > 0 and where R < 0."""

    direction: int
    free: float
    pushing: float
    pulling: float

    @property
    def rests(self) -> tuple[tuple[float, str], ...]:
        """The equilibria as (R, kind), a ``centre`` or a ``saddle``."""
        sides = ((1, self.pushing), (-1, self.pulling))
        found = [(-self.free / p, "centre" if p > 0 else "saddle") for side, p in sides if -self.free * p * side > 0]
        return tuple(found)

    def energy(self, R: Any, rate: Any) -> Any:
        """Return the conserved quantity R'^2/2 + a_N R + p R^2/2."""
        return rate**2 / 2 + self.free * R + (self.pushing * (R > 0) + self.pulling * (R < 0)) * R**2 / 2


def planes(described: Any) -> tuple[ReactionPlane, ReactionPlane]:
    """Return the ``ReactionPlane`` of sliding forward and backward at the example's state and speed, for eps = 0."""
    system = described.undamped
    start = described.mechanism.start(system, described.numbers)
    numbers = {**described.values, **described.state, **start, system.small.name: 0}
    return _plane(system, 1, numbers), _plane(system, -1, numbers)


def _plane(system: Any, direction: int, numbers: dict) -> ReactionPlane:
    slips, sliding = {1: "slip_same", -1: "slip_opposite"}, system.friction.velocity.name
    at = {**numbers, sliding: direction * abs(numbers[sliding])}
    pulling = slips[-direction] if system.friction.gap is None else "open"
    (free, p), (_, q) = (_line(system, mode, at) for mode in (slips[direction], pulling))
    return ReactionPlane(direction, free, p, q)


def _line(system: Any, mode: str, at: dict) -> tuple[float, float]:
    """Return (a_N, p) of one mode, R'' = -a_N - p R."""
    x, y = system.fast
    expr = system.mode(mode).fast[y]
    placed = {s: at[s.name] for s in expr.free_symbols - {x, y}} | {y: 0}
    rest, pushed = (float(evaluate((expr,), {**placed, x: R})[0]) for R in (0, 1))
    return -rest, rest - pushed


def draw_reactions(axes: Any, described: Any) -> None:
    """Draw the planes of both directions on two axes: level lines, separatrix, centre and saddle."""
    drawn = planes(described)
    bounds = [p for plane in drawn for p in (plane.pushing, plane.pulling) if p]
    width = _WIDTH * max(abs(drawn[0].free / p) for p in bounds)
    height = 0.6 * width * max(map(abs, bounds)) ** 0.5
    R, rate = np.meshgrid(np.linspace(-width, width, 401), np.linspace(-height, height, 401))
    for ax, plane in zip(axes, drawn, strict=True):
        energy = plane.energy(R, rate)
        ax.axvline(0, color="0.6", lw=0.5)
        _lines(ax, R, rate, energy, _levels(plane, energy), style.BLUE, 0.7)
        saddles = [plane.energy(np.float64(at), 0.0) for at, kind in plane.rests if kind == "saddle"]
        _lines(ax, R, rate, energy, saddles, style.RED, 1.0)
        for at, kind in plane.rests:
            ax.plot(at, 0, "o" if kind == "centre" else "x", color=style.BLACK, ms=3.5, zorder=6)
            ax.annotate(kind, (at, 0), (0, 5), textcoords="offset points", ha="center", zorder=6,
                        path_effects=style.halo(2))
        found = " and ".join(f"a {kind}" for _, kind in plane.rests) or "no equilibrium, the reaction runs away"
        title = f"sliding {'forward' if plane.direction > 0 else 'backward'}: {found}"
        ax.set(ylabel="$R'$", title=title, xlim=(-width, width), ylim=(-height, height))
        ax.grid(visible=False)
    axes[-1].set_xlabel("$R$")


def _levels(plane: ReactionPlane, energy: Any) -> list[float]:
    """Return levels between centre and saddle, and beyond them to the ends of the window."""
    at = sorted(float(plane.energy(np.float64(R), 0.0)) for R, _ in plane.rests)
    low, high = float(energy.min()), float(energy.max())
    if not at:
        return list(np.linspace(low, high, 14)[1:-1])
    inner = [at[0] + k * (at[-1] - at[0]) for k in (0.1, 0.4, 0.75)] if len(at) > 1 else []
    step = (at[-1] - at[0]) / 1.5 if len(at) > 1 else (high - at[0]) / 8
    return sorted({*inner, *np.arange(at[-1] + step, high, step), *np.arange(at[0] - step, low, -step)})


def _lines(ax: Any, R: Any, rate: Any, energy: Any, levels: list[float], ink: str, width: float) -> None:
    """Draw level lines with arrows in the direction of the motion, to the right where R' > 0."""
    if not levels:
        return
    for lines in ax.contour(R, rate, energy, levels=levels, colors=[ink], linestyles="-", linewidths=width).allsegs:
        for line in lines:
            across, up = line[:-1].T
            u, v = (line if (line[1:, 0] - across) @ up >= 0 else line[::-1]).T
            arrows(ax, u, v, ink, every=1.4)
