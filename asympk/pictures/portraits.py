"""Portraits of the phase space: computed trajectories over the geometry that the package derives.

A figure takes paths or rows and the parameters they belong to; the geometry (planes, edges, regions, integral curves)
comes from the symbolic side through ``lower``.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import sympy as sp

from asympk.numbers import Number
from asympk.path import Path
from asympk.pictures import plate, style
from asympk.symbolic.lowering import lower
from asympk.symbolic.manifold import C, integral_curves, rest_state, slow_manifolds
from asympk.symbolic.reading import rational
from asympk.symbolic.stick import stick_regions
from asympk.systems import painleve_klein as pk

SLOW, UNSTABLE, HELD = {"color": style.BLACK, "lw": 1.6}, {"color": style.BLACK, "lw": 1.2, "ls": (0, (4, 2))}, "0.82"
LINEAR = 0.1  # loads below it are drawn to scale, larger ones by their logarithm
LOADS = (-10, -1, -0.1, 0, 0.1, 1, 10)
_FLOOR = -0.25  # mu y of the plane on which the shadows of the curves lie, in the picture of the jump
INKS = (style.BLUE, style.RED, style.GREEN, style.PURPLE)


def sampled(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return (t, states) along a path, dense where it jumps: logarithmic from both ends of every mode."""
    steps = np.concatenate(([0], np.geomspace(1e-7, 0.5, 120)))
    times = [a + (b - a) * u for _, a, b in path.spans for u in (steps, 1 - steps[::-1])]
    t = np.unique(np.concatenate(times))
    return t, np.array([path(float(moment)) for moment in t], dtype=float).T


def levels(sigma: Number) -> dict[str, float]:
    """Return the loads of Pi1, Pi2, Gamma1 and Gamma2 at mu = 0 and sigma0 = sigma; those at infinity are left out."""
    value = rational("sigma", sigma)
    found = {name: expr.subs(dict.fromkeys(expr.free_symbols, value)) for name, expr in level_formulas().items()}
    return {name: float(value) for name, value in found.items() if value.is_finite}


@cache
def level_formulas() -> dict[str, sp.Expr]:
    """Return the loads of Pi1, Pi2, Gamma1 and Gamma2 as expressions in sigma and sigma0."""
    planes = {plane.name: sp.cancel(pk.x + plane.coefficient(0)) for plane in slow_manifolds(pk.system(), order=0)}
    return planes | dict(zip(("Gamma1", "Gamma2"), stick_regions(pk.system()).edges, strict=True))


def phase_space(groups: Sequence[tuple[Number, str, Sequence[Path]]]) -> style.Figure:
    """Draw fig. 5: the phase space over s = x + y and z, a panel for each (sigma, title, paths) of ``groups``."""
    with plate(2.25 * len(groups), len(groups), 1) as (figure, axes):
        for ax, (sigma, title, paths) in zip(axes.flat, groups, strict=True):
            ax.set(xlim=(-60, 60), ylim=(-1.35, 1.95), ylabel="$z$")
            ax.set_xscale("asinh", linear_width=LINEAR)
            ax.set_xticks(LOADS, [f"{load:g}" for load in LOADS])
            ax.minorticks_off()
            ax.grid(visible=False)
            ax.set_title(title, pad=3)
            _planes(ax, sigma)
            _octants(ax, sigma)
            for path, ink, name in zip(paths, INKS, "abcd", strict=False):
                _trajectory(ax, path, ink, name)
        axes.flat[-1].set_xlabel("$s = x + y$")
    return figure


def _planes(ax, sigma):
    at = levels(sigma)
    low, high = ax.get_ylim()
    left, right = ax.get_xlim()
    ax.plot((left, right), (0, 0), color="0.5", lw=0.5, zorder=1)
    ax.plot((0, 0), (low, high), color="0.5", lw=0.5, zorder=1)
    for name, start, end in _held(sigma, left, right):
        ax.plot((start, end), (0, 0), color=HELD, lw=5, solid_capstyle="butt", zorder=1.5)
        ax.plot((at[name],), (0,), "o", color="black", ms=3, zorder=5)
        side = 1 if name == "Gamma1" else -1
        ax.annotate(rf"$\Gamma_{name[-1]}$", (at[name], 0), (4 * side, -8), textcoords="offset points", ha="center",
                    va="center")
        far = 4 if side > 0 else -16
        ax.annotate(f"$G_{name[-1]}$", (far, 0), (0, -9), textcoords="offset points", ha="center", va="center")
    ax.plot((at["Pi1"],) * 2, (0, high), **SLOW, zorder=2)
    ax.annotate(r"$\Pi_1$", (at["Pi1"], high), (5, -14), textcoords="offset points", ha="left", va="top")
    stable, ends = sigma < 0, (0, low) if sigma < 0 else (0, high)
    ax.plot((at["Pi2"],) * 2, ends, **(SLOW if stable else UNSTABLE), zorder=2)
    ax.annotate(r"$\Pi_2$", (at["Pi2"], ends[1]), (5, 4 if stable else -14), textcoords="offset points", ha="left",
                va="bottom" if stable else "top")


def _held(sigma, left, right):
    """Yield (edge, start, end) of the stick region's parts within the picture."""
    at = levels(sigma)
    if sigma < -1:
        yield "Gamma1", at["Gamma1"], at["Gamma2"]
        return
    yield "Gamma1", at["Gamma1"], right
    if "Gamma2" in at:
        yield "Gamma2", left, at["Gamma2"]


def _octants(ax, sigma):
    for k, (load, z) in enumerate(((6, 0.75), (-0.07, 1.1), (-18, -0.6), (0.05, -0.6)), start=1):
        ax.text(load, z, f"$O_{k}$", ha="center", va="center", color="0.35")
    if sigma > 0:
        high, split = ax.get_ylim()[1], levels(sigma)["Pi2"]
        for k, (start, end) in ((5, (split, 50)), (6, (split, -50))):
            ax.annotate("", (end, high - 0.12), (start, high - 0.12),
                        arrowprops={"arrowstyle": "->", "lw": 0.5, "color": "0.35", "shrinkA": 3, "shrinkB": 0})
            ax.text(20 if k == 5 else -20, high - 0.3, f"$O_{k}$", ha="center", va="center", color="0.35")


def _trajectory(ax, path, ink, name):
    _, (x, y, z) = sampled(path)
    ax.plot(x + y, z, color=ink, lw=1.0, zorder=4)
    ax.plot(x[0] + y[0], z[0], "o", mfc="white", mec=ink, ms=3.4, zorder=6)
    ax.annotate(name, (x[0] + y[0], z[0]), (0, 7), textcoords="offset points", ha="center", va="center", color=ink)
    arrows(ax, x + y, z, ink)


def arrows(ax: style.Axes, u: np.ndarray, v: np.ndarray, ink: str, every: float = 0.9) -> None:
    """Put an arrowhead on a curve every so many inches of its drawn length."""
    place = ax.transData.transform(np.column_stack((u, v))) / ax.figure.dpi
    length = np.concatenate(([0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))))
    for wanted in np.arange(every / 2, length[-1], every):
        k = int(np.searchsorted(length, wanted))
        ax.annotate("", (u[k], v[k]), (u[k - 1], v[k - 1]), zorder=4,
                    arrowprops={"arrowstyle": "-|>", "color": ink, "lw": 0, "shrinkA": 0, "shrinkB": 0,
                                "mutation_scale": 6})


def jump_beside_the_vertical_one(paths: Sequence[Path], paper: tuple[np.ndarray, np.ndarray]) -> style.Figure:
    """Draw the jump from z < 0 over x, z and mu y: as computed for several mu, and as in the paper, with x constant.

    ``paper`` is the (x, z) of the paper's trajectory: up at constant x, then along Pi1.
    """
    with plate(2.7, subplot_kw={"projection": "3d"}) as (figure, [[ax]]):
        for path, ink, dash in zip(paths, INKS, ((0, (1, 1)), (0, (4, 1.5)), "-"), strict=False):
            _, (x, y, z) = sampled(path)
            mu = float(path.scene.mu)
            ax.plot(x, z, mu * y, color=ink, ls=dash, label=rf"$\mu = {style.power_of_ten(mu)}$")
            ax.plot(x, z, np.full_like(x, _FLOOR), color=ink, ls=dash, lw=0.4, alpha=0.6)
        ax.plot(*paper, np.zeros_like(paper[0]), color="0.45", lw=1.0, ls=(0, (5, 1.5, 1, 1.5)), label="$x$ held")
        ax.set(xlabel="$x$", ylabel="$z$", zlabel=r"$\mu y$", zlim=(_FLOOR, 0.5), xticks=(0, 0.5, 1),
               yticks=(-1, -0.5, 0, 0.5), zticks=(0, 0.25, 0.5))
        ax.view_init(elev=24, azim=-58)
        ax.set_box_aspect((1.2, 1.2, 0.8), zoom=1.0)
        ax.tick_params(pad=-2)
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.labelpad = -7
        figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=4, columnspacing=1.0)
    return figure


def with_x_held(sigma: Number, start: Sequence[Number | str], until: Number) -> tuple[np.ndarray, np.ndarray]:
    """Return (x, z) of the jump in Fufaev's paper: up at constant x to z = 0, then along Pi1 for the time ``until``."""
    plane = next(plane for plane in slow_manifolds(pk.system(), order=0) if plane.name == "Pi1")
    at = {pk.sigma: rational("sigma", sigma), pk.mu: 0, C: 0}
    curve = lower((pk.x,), integral_curves(plane)[pk.z].subs(at))
    at_rest: Any = rest_state(plane)
    rest = float(at_rest.state[pk.x].subs(at))
    x0, _, z0 = map(float, map(Fraction, start))
    x = rest + (x0 - rest) * np.exp(-np.linspace(0, until, 100))
    return np.concatenate(([x0, x0], x)), np.concatenate(([z0, 0], curve(x) - curve(np.array(x0))))
