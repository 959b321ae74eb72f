"""The figure on damping: time of the jam and number of sticks over the damping ratio, and the rod without damping."""

from collections.abc import Sequence

import numpy as np

from asympk.path import Path
from asympk.pictures import plate, style
from asympk.storage.rows import Row
from asympk.studies.damping import leading_law, stick_law, undamped_factor

SLIPS = {"slip_opposite": style.RED, "slip_same": style.BLUE, "stick": "0.6"}


def draw_damping(rows: Sequence[Row], path: Path) -> style.Figure:
    """Draw jam time and sticks over the damping ratio, the phase plane of an undamped ``path``, and its jam time."""
    with plate(3.9, 2, 2) as (figure, axes):
        over_ratio = [row for row in rows if row["part"] == "ratio"]
        _times(axes[0, 0], over_ratio)
        _sticks(axes[0, 1], over_ratio)
        _phase_plane(axes[1, 0], path)
        _undamped(axes[1, 1], [row for row in rows if row["part"] == "undamped"])
        for ax, name in zip(axes.flat, "abcd", strict=True):
            ax.set_title(f"({name})", loc="left", pad=3)
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4, columnspacing=0.8,
                      handlelength=1.6, handletextpad=0.3)
    return figure


def _times(ax, rows):
    for epsilon, (ink, mark), here in _by_epsilon(rows):
        unit = leading_law(epsilon, 1)
        ratios = [row["zeta"] for row in here]
        ax.plot(ratios, [row["jam"] / unit for row in here], mark, color=ink, ms=2.2, mfc="white", mew=0.5,
                label=rf"$\varepsilon = {style.power_of_ten(epsilon)}$")
        ax.plot(ratios, [row["law"] / unit for row in here], color=ink, lw=0.5)
    ratios = sorted({row["zeta"] for row in rows if row["zeta"] < 30})
    ax.plot(ratios, [leading_law(0.5, zeta) / leading_law(0.5, 1) for zeta in ratios], color="black", lw=1.0,
            ls=(0, (4, 2)), label="leading order")
    style.logarithmic(ax, xlabel=r"$\zeta = d/2\varepsilon$", ylabel=r"$T/T(\zeta = 1)$", ylim=(1e-4, 1e5))


def _sticks(ax, rows):
    for epsilon, (ink, mark), here in _by_epsilon(rows):
        ax.plot([row["zeta"] for row in here], [row["sticks"] for row in here], mark, color=ink, ms=2.2, mfc="white",
                mew=0.5)
        below = [row["zeta"] for row in here if row["zeta"] < 1]
        ax.plot(below, [stick_law(epsilon, zeta) for zeta in below], color=ink, lw=0.5)
        ax.plot((epsilon ** (-1 / 3) / 2,) * 2, (0.8, 3), color=ink, lw=0.6, ls=":")
    style.logarithmic(ax, xlabel=r"$\zeta = d/2\varepsilon$", ylabel="times at rest", ylim=(0.8, 80))
    ax.set_yticks([1, 2, 5, 10, 50], ["1", "2", "5", "10", "50"])


def _by_epsilon(rows):
    """Yield (epsilon, (colour, mark), rows) from the largest epsilon down."""
    epsilons = sorted({row["epsilon"] for row in rows}, reverse=True)
    for epsilon, looks in zip(epsilons, style.MARKS, strict=True):
        yield epsilon, looks, [row for row in rows if row["epsilon"] == epsilon]


def _phase_plane(ax, path):
    root = float(path.scene.mu) ** 0.5
    for mode, start, end in path.spans:
        states = np.array([path(float(t)) for t in np.linspace(start, end, 40)], dtype=float)
        x, y, _ = states.T
        ax.plot(x + y, root * y, color=SLIPS[mode], lw=0.4 if mode == "stick" else 0.8)
    ax.set(xlabel=r"$R\cos\alpha/P$", ylabel=r"$\varepsilon\dot R\cos\alpha/P$", aspect="equal")


def _undamped(ax, rows):
    epsilons = [row["epsilon"] for row in rows]
    ax.plot(epsilons, [row["jam"] for row in rows], "o", color=style.BLUE, mfc="white", label="exact flow")
    ax.plot(epsilons, [row["law"] for row in rows], color=style.BLUE, lw=0.6, label=r"$\pi\varepsilon A^4/2C$")
    fine = [1 / 8, max(epsilons)]
    ax.plot(fine, [undamped_factor() / epsilon**3 for epsilon in fine], color="black", ls=(0, (4, 2)),
            label=r"$\propto \varepsilon^{-3}$")
    style.logarithmic(ax, xlabel=r"$\varepsilon$", ylabel="$T$, no damping", ylim=(30, 3e4))
    ax.set_xticks(epsilons, [f"1/{round(1 / epsilon)}" for epsilon in epsilons])
    ax.legend(loc="upper right")
