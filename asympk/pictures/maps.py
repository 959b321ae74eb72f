"""Maps over the parameters: regimes over sigma, stick over static friction, collisions, errors over mu."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np
import sympy as sp

from asympk.pictures import plate, style
from asympk.pictures.portraits import HELD, LINEAR, LOADS, SLOW, UNSTABLE, level_formulas
from asympk.storage.rows import Row
from asympk.studies.decreasing import is_limit
from asympk.symbolic.lowering import lower
from asympk.symbolic.regimes import thresholds
from asympk.symbolic.stick import stick_regions
from asympk.systems import painleve_klein as pk

_MARKS = ("o", "s", "^", "D", "v")  # of the systems of ``decreasing``


def regime_map() -> style.Figure:
    """Draw where the slow planes and the edges of the stick region lie over sigma, for sigma0 = sigma."""
    cuts, most = thresholds(pk.system()), 2
    with plate(2.3) as (figure, [[ax]]):
        _load_axis(ax)
        ax.set(xlim=(-2, most), xlabel=r"$\sigma$")
        ticks = sorted({sp.S(-2), *cuts, sp.S.One, sp.S(most)})
        ax.set_xticks([float(tick) for tick in ticks], [f"${tick}$" for tick in ticks])
        for cell in stick_regions(pk.system()).stick.cells:
            _fill(ax, cell, {}, (-2, most), facecolor=HELD, edgecolor=HELD, linewidth=0.3)
        for cut in cuts:
            ax.axvline(float(cut), color="0.5", lw=0.5, ls=":")
        formulas = {name: f.subs(pk.sigma0, pk.sigma) for name, f in level_formulas().items()}
        curves: list[tuple] = [
            ("Pi1", -2, most, SLOW), ("Pi2", -2, 0, SLOW), ("Pi2", 0, most, UNSTABLE),
            ("Gamma1", -2, most, {}), ("Gamma2", -2, -1, {}), ("Gamma2", -1, most, {}),
        ]
        for name, start, end, looks in curves:
            _curve(ax, pk.sigma, formulas[name], start, end, **{"color": "black", "lw": 0.7, **looks})
        for place, words in (((0.6, 0.06), r"$\Pi_1$"), ((-0.62, 4.2), r"$\Pi_2$"), ((0.95, -3.0), r"$\Pi_2$"),
                             ((1.5, 0.42), r"$\Gamma_1$"), ((1.5, -0.25), r"$\Gamma_2$"), ((-1.34, 8), r"$\Gamma_2$"),
                             ((1.3, 4), "stick"), ((-0.5, -9), "stick")):
            ax.text(*place, words, ha="center", va="center")
    return figure


def stick_over_static_friction(sigmas: Sequence[str]) -> style.Figure:
    """Draw the stick region over sigma0, hatched where crossing is consistent, too; a panel for each sigma."""
    regions, most = stick_regions(pk.system()), 4
    with plate(2.2, 1, len(sigmas), sharey=True) as (figure, axes):
        for ax, sigma in zip(axes.flat, sigmas, strict=True):
            _load_axis(ax, label=ax is axes.flat[0])
            least, kinetic = float(Fraction(sigma)), {pk.sigma: sp.Rational(sigma)}
            ax.set(xlim=(least, most), xlabel=r"$\sigma_0$")
            ax.set_title(rf"$\sigma = {sigma}$", pad=3)
            for region, looks in ((regions.stick, {"facecolor": HELD, "edgecolor": HELD, "linewidth": 0.3}),
                                  (regions.ambiguous, {"facecolor": "none", "hatch": "//////", "edgecolor": "0.35",
                                                       "linewidth": 0})):
                for cell in region.cells:
                    if all(value in cell.box.get(p, sp.Reals) for p, value in kinetic.items()):
                        _fill(ax, cell, kinetic, (least, most), **looks)
            for name, start, end in (("Gamma1", least, most), ("Gamma2", max(least, -1), most),
                                     *((("Gamma2", least, -1),) if least < -1 else ())):
                _curve(ax, pk.sigma0, level_formulas()[name], start, end, color="black", lw=0.7)
        handles = [style.patch(HELD, "stick"), style.patch(HELD, "stick, but crossing is consistent", hatch="//////",
                                                           edgecolor="0.35", linewidth=0)]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _load_axis(ax, label=True):
    ax.set_ylim(-30, 30)
    ax.set_yscale("asinh", linear_width=LINEAR)
    ax.set_yticks(LOADS, [f"{load:g}" for load in LOADS])
    ax.minorticks_off()
    ax.grid(visible=False)
    if label:
        ax.set_ylabel("$s$", labelpad=0)


def _span(start, end):
    """Return numbers from start to end, without the ends and dense near them."""
    half = np.geomspace(1e-6, 0.5, 80)
    return start + (end - start) * np.concatenate((half, 1 - half[-2::-1]))


def _curve(ax, parameter, formula, start, end, **looks):
    at = _span(start, end)
    load = np.broadcast_to(lower((parameter,), formula)(at), at.shape)
    seen = abs(load) < ax.get_ylim()[1]
    ax.plot(at[seen], load[seen], **looks)


def _fill(ax, cell, fixed, limits, **looks):
    """Fill a cell's spans over the open range of sigma0 that the cell covers; single values have no area."""
    part = cell.box[pk.sigma0]
    if part.is_FiniteSet:
        return
    start, end = max(float(part.start), limits[0]), min(float(part.end), limits[1])
    if start >= end:
        return
    at = _span(start, end)
    low, high = ax.get_ylim()
    for span in cell.spans:
        ends = [lower((pk.sigma0,), border.subs(fixed))(at) if border.is_finite is not False else float(border)
                for border in (span.start, span.end)]
        ends = [np.clip(np.broadcast_to(border, at.shape), low, high) for border in ends]
        ax.fill_between(at, *ends, **looks)


def convergence(rows: Sequence[Row]) -> style.Figure:
    """Draw the largest |error / first omitted term - 1| of all quantities against mu, from convergence rows.

    One panel: a faint line for each expansion and sigma in the colour of its order, the median of them in marks.
    """
    from statistics import median

    largest: dict[tuple, dict[float, float]] = {}
    for row in rows:
        line = largest.setdefault((row["order"], row["expansion"], row["sigma"]), {})
        line[row["mu"]] = max(abs(row["excess"]), line.get(row["mu"], 0))
    with plate(2.3) as (figure, [[ax]]):
        for order, (ink, mark) in zip(sorted({n for n, *_ in largest}), style.MARKS, strict=True):
            lines = [line for (n, *_), line in largest.items() if n == order]
            for line in lines:
                ax.plot(list(line), list(line.values()), color=ink, lw=0.3, alpha=0.5)
            mus = sorted({mu for line in lines for mu in line})
            ax.plot(mus, [median(line[mu] for line in lines) for mu in mus], mark, color=ink, ms=3,
                    mfc="white", mew=0.7, label=f"order {order}")
        style.logarithmic(ax, xlabel=r"$\mu$", ylabel="|error / first omitted term \u2212 1|")
        ax.legend(loc="lower right")
    return figure


def decreasing(rows: Sequence[Row]) -> style.Figure:
    """Draw errors and their measures against mu: a panel for each order, one for limits with friction.

    Marks are errors. Lines are the first omitted terms; in the panel of the limits with friction, "friction, 0", they
    are mu log(1/mu) times a constant, error/(mu log(1/mu)) at the least mu.
    """
    panels = {_panel(row): None for row in sorted(rows, key=_panel)}
    names = list(dict.fromkeys(row["system"] for row in rows))
    with plate(2.2, 1, len(panels), sharex=True, sharey=True) as (figure, axes):
        for ax, panel in zip(axes.flat, panels, strict=True):
            for name in names:
                here = [row for row in rows if row["system"] == name and _panel(row) == panel]
                _errors(ax, sorted(here, key=lambda row: row["mu"]), _MARKS[names.index(name)], name)
            limit, order = panel
            title = "friction, 0" if limit else f"order {order}"
            style.logarithmic(ax, xlabel=r"$\mu$", title=title)
        axes.flat[0].set_ylabel("error")
        handles = {h.get_label(): h for ax in axes.flat for h in ax.get_legend_handles_labels()[0]}
        figure.legend(handles=[handles[name] for name in names], loc="outside lower center", ncols=2)
    return figure


def _panel(row):
    return is_limit(row), row["order"]


def _errors(ax, rows, mark, name):
    if not rows:
        return
    mus, last = [row["mu"] for row in rows], rows[0]
    factor = last["ratio"] if is_limit(last) else 1
    ax.plot(mus, [abs(factor * row["measure"]) for row in rows], color=style.BLUE, lw=0.6)
    ax.plot(mus, [abs(row["error"]) for row in rows], ls="", marker=mark, ms=3, color=style.BLUE,
            markerfacecolor="white", markeredgewidth=0.6, label=name)


def least_models(rows: Sequence[Row], names: Sequence[str]) -> style.Figure:
    """Draw the least model that suffices over mu and |z0|, from rows of the atlas; ``names`` are the rungs' names.

    There is a panel for each sigma and sign of z0. A model has a grey, and its number stands where its area is widest.
    """
    sigmas = {sigma: rf"$\sigma = {sigma}$" for sigma in dict.fromkeys(row["sigma"] for row in rows)}
    with plate(1.45 * len(sigmas) + 0.55, len(sigmas), 2, sharex=True, sharey=True) as (figure, axes):
        _maps(axes, rows, "sigma", sigmas, "mu", "rung", _shade, r"$\mu$")
        met = sorted({row["rung"] for row in rows})
        handles = [style.patch(_shade(k), f"{k}  {names[k]}", edgecolor="0.4", linewidth=0.3) for k in met]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), columnspacing=0.9,
                      handlelength=1.0, handletextpad=0.4)
    return figure


def _shade(rung):
    return str(1 - 0.17 * rung)


def collisions(rows: Sequence[Row]) -> style.Figure:
    """Draw how often the rough mass comes to rest, over mu |x0| and |z0|, from collision rows.

    There is a panel for each mu and sign of z0. A number stands where the area with this number is widest.
    """
    mus = {mu: rf"$\mu = {mu:g}$" for mu in sorted({row["mu"] for row in rows})}
    with plate(1.45 * len(mus) + 0.3, len(mus), 2, sharex=True, sharey=True) as (figure, axes):
        _maps(axes, rows, "mu", mus, "scaled_x", "count", lambda count: str(round(max(0.2, 1 - 0.075 * count), 3)),
              r"$\mu\,x_0$")
    return figure


def _maps(axes, rows, name, titles, along, what, shade, label):
    """Fill two panels, for z0 < 0 and z0 > 0, for each value of the column ``name``; ``titles`` is {value: title}."""
    for line, (value, title) in zip(axes, titles.items(), strict=True):
        for ax, side in zip(line, (-1, 1), strict=True):
            chosen = [row for row in rows if row[name] == value and row["z"] * side > 0]
            _cells_panel(ax, chosen, along, what, shade)
            ax.set_title(f"{title}, $z_0 {'<' if side < 0 else '>'} 0$", pad=3)
        line[0].set_ylabel("$|z_0|$")
    for ax in axes[-1]:
        ax.set_xlabel(label)


def _cells_panel(ax, rows, along_key, value_key, grey):
    """Draw whole numbers over a logarithmic grid of ``along_key`` and |z|, each as a grey area with its number."""
    along, up = (sorted({abs(row[key]) for row in rows}) for key in (along_key, "z"))
    counts = np.zeros((len(up), len(along)), dtype=int)
    for row in rows:
        counts[up.index(abs(row["z"])), along.index(row[along_key])] = row[value_key]
    across, upward = _borders(along), _borders(up)
    for k, line in enumerate(counts):
        for first, last in pairwise([0, *(np.flatnonzero(np.diff(line)) + 1), len(line)]):
            ax.fill_between((across[first], across[last]), upward[k], upward[k + 1], color=grey(line[first]), lw=0.5)
    ax.set(xlim=(across[0], across[-1]), ylim=(upward[0], upward[-1]))
    style.logarithmic(ax)
    ax.grid(visible=False)
    for value in np.unique(counts):
        place = _inside(counts == value)
        if place:
            ax.text(along[place[1]], up[place[0]], str(value), ha="center", va="center",
                    color="white" if float(grey(value)) < 0.5 else "black")


def _borders(centres):
    """Return the borders of cells around centres in geometric progression."""
    half = (centres[1] / centres[0]) ** 0.5
    return [centres[0] / half, *(centre * half for centre in centres)]


def _inside(mask):
    """Return the cell of ``mask`` farthest from its border, or None when there is no room for a number."""
    from scipy.ndimage import distance_transform_cdt

    depth = distance_transform_cdt(np.pad(mask, 1), metric="chessboard")[1:-1, 1:-1]
    place = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return place if depth[place] > 1 else None
