"""Figures: rows in, a matplotlib ``Figure`` out; no row is computed here, and only ``save`` writes files."""

from bisect import bisect
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from math import log10
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from asympk.pictures import plate, sheets, style
from asympk.storage.rows import Row
from asympk.studies.modelwork import savings

OUTCOMES = ("finished", "events missed", "wrong branch", "stalled", "limit", "other")  # "other" is a refusal
FAILURES = {  # key -> (colour of a cell, ink on it, words)
    "events missed": ("0.9", "black", "modes missed"), "stalled": (style.SKY, "black", "stalled"),
    "limit": (style.ORANGE, "black", "budget spent"), "wrong branch": ("0.25", "white", "wrong end"),
}
LIMITS = ("step", "time", "limit")
REFUSED, NO_END = 0.4, 1e3  # the cost at which models that refuse are drawn; the error at which runs without an end are
SPACING = 3.4  # ratio of cost between two levels of the band "not reached"
NOTE_SIZE, NOTE_WIDTH, NOTE_LINE, LEGEND_LINE = 6.0, 76, 0.1, 0.125  # points, characters, inches, inches
ALONGSIDE = 1e-5  # tolerance of the integrators that are drawn beside the models
ALONGSIDE_METHODS = {"lsoda": 2, "kvaerno5": -2}  # by how many points their names are raised
GLYPH, NEAR = 3.6, (0.07, 0.06)  # width of a model's mark in points; distance of marks that touch, as part of each axis


def save(figure: style.Figure, path: str | Path) -> Path:
    """Write ``figure`` to ``path``; the bytes depend on the figure alone, not on the day or the machine."""
    sheets(path).kept(figure, path, dpi=300)
    return Path(path)


@contextmanager
def sheet(
    body: float, rows: int = 1, columns: int = 1, *, entries: int = 0, per_line: int = 3, note: str = "", **options: Any
) -> Iterator[tuple[style.Figure, np.ndarray]]:
    """Yield (figure, axes), a column wide: ``body`` inches of axes above a legend of ``entries`` entries and a note."""
    words = fill(note, NOTE_WIDTH)
    note_height = NOTE_LINE * (words.count("\n") + 1) + 0.05 if words else 0.0
    foot = note_height + LEGEND_LINE * -(-entries // per_line) + 0.05
    height = body + foot
    with plate(height, rows, columns, **options) as (figure, axes):
        rect = 0, foot / height, 1, body / height
        figure.set_layout_engine("constrained", rect=rect, w_pad=0.02, h_pad=0.02)
        yield figure, axes
        figure.text(0.01, 0.02 / height, words, fontsize=NOTE_SIZE, va="bottom", ha="left", in_layout=False)
        handles = axes.flat[0].get_legend_handles_labels()[0]
        legend = figure.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, note_height / height),
                               ncols=per_line, columnspacing=1.0, borderpad=0.1, labelspacing=0.25)
        legend.set_in_layout(False)


def outcome(status: str) -> str:
    """Return the key of ``OUTCOMES`` for a status sentence."""
    word = status.split()[0]
    if status in OUTCOMES:
        return status
    return "limit" if word in LIMITS else "stalled" if word == "stalled" else "other"


def work_precision(rows: Sequence[Row], scene: str, mus: Sequence[float]) -> style.Figure:
    """Work against precision on ``scene``, one panel for each of ``mus``.

    Runs that do not reach the end are drawn in the strip "no end"; models that refuse the scene, at its foot.
    """
    rows = [row for row in rows if row["scene"] == scene]
    methods, lines = _methods(rows), (len(mus) + 1) // 2
    with sheet(1.5 * lines, lines, 2, entries=len(methods), sharex=True, sharey=True) as (figure, axes):
        for ax, mu in zip(axes.flat, mus, strict=False):
            _precision_panel(ax, [row for row in rows if row["mu"] == mu], methods)
            ax.set_title(rf"$\mu = {style.power_of_ten(mu)}$", pad=2)
        for ax in axes.flat[len(mus):]:
            ax.set_visible(False)
        for ax in axes[:, 0]:
            ax.set_ylabel("CPU time / exact flow")
        for ax in axes[-1]:
            ax.set_xlabel("error of the final state")
        axes.flat[0].set_ylim(0.15, 3 * max(row["ratio"] or 0 for row in rows))
    return figure


def _precision_panel(ax, rows, methods):
    style.logarithmic(ax, xlim=(1e-18, 1e5))
    for left, right, grey, words, height, end in (
            (0.1, 10, "0.95", "wrong", 0.97, "top"), (10, 1e5, "0.89", "no end", 0.2, "bottom")):
        ax.axvspan(left, right, color=grey, lw=0)
        ax.text((left * right) ** 0.5, height, words, rotation=90, ha="center", va=end, fontsize=6,
                transform=ax.get_xaxis_transform())
    ax.set_xticks([1e-15, 1e-10, 1e-5])
    glyphs = []
    for method in methods:
        good = sorted((r for r in rows if r["method"] == method and r["final_error"] is not None),
                      key=lambda r: -(r["rtol"] or 0))
        places = [(max(r["final_error"], 1e-17), r["ratio"]) for r in good]
        glyphs += _drawn_or_glyphs(ax, method, places, style.curve(method))
    lost = [r for r in rows if r["final_error"] is None]
    glyphs += [(NO_END, REFUSED, {**style.curve(r["method"]), "label": None}) for r in lost if not r["ratio"]]
    _side_by_side(ax, glyphs)
    names = [m for m in methods if any(r["method"] == m and r["ratio"] for r in lost)]
    for k, method in enumerate(names):
        costs = [r["ratio"] for r in lost if r["method"] == method and r["ratio"]]
        place = NO_END * 1e4 ** ((k + 0.5) / len(names) - 0.5)
        ax.plot([place] * len(costs), costs, **{**style.curve(method), "linestyle": "none", "label": None})


def cost_against_mu(rows: Sequence[Row], scenes: Sequence[str], accuracy: float, note: str = "") -> style.Figure:
    """The least cost of an error below ``accuracy`` against mu; methods without such a run are in the band."""
    methods = _methods(rows)
    with sheet(1.5 * len(scenes) + 0.6, len(scenes), entries=len(methods), note=note, sharex=True) as (figure, axes):
        for ax, scene in zip(axes.flat, scenes, strict=True):
            _cost_panel(ax, [row for row in rows if row["scene"] == scene], methods, accuracy)
            ax.set(ylabel="CPU time / exact flow")
            ax.set_title(f"scene ({scene}), error below ${style.power_of_ten(accuracy)}$", pad=2)
        axes.flat[-1].set_xlabel(r"$\mu$")
        axes.flat[-1].margins(x=0.07)
        axes.flat[-1].invert_xaxis()
    return figure


def _cost_panel(ax, rows, methods, accuracy):
    style.logarithmic(ax)
    curves = cheapest_by_method(rows, methods, accuracy)
    top = 3 * max(cost for curve in curves.values() for cost in curve.values() if cost)
    never = [m for m in methods if not any(curves[m].values())]
    lost = [m for m in methods if None in curves[m].values() and m not in never]
    kinds = list(dict.fromkeys("model" if m in style.MODELS else m for m in lost))  # a level each
    names = ", ".join(style.SHORT.get(m, style.curve(m)["label"]) for m in never)
    words = fill(f"never: {names}", 58) if never else ""
    ceiling = top * SPACING ** (len(kinds) + 1.5 + words.count("\n"))
    ax.annotate(words, (0, 1), (3, -2), xycoords="axes fraction", textcoords="offset points", fontsize=6, va="top")
    ax.set_ylim(0.4, ceiling)
    ax.axhspan(top, ceiling, color="0.93", lw=0)
    ax.set_yticks([10.0**k for k in range(int(log10(top)) + 1)])
    ax.annotate("not reached", (1, 1), (-2, -2), xycoords="axes fraction", textcoords="offset points", fontsize=6,
                rotation=90, ha="right", va="top")
    glyphs = []
    for method in methods:
        looks = style.curve(method)
        reached = [(mu, cost) for mu, cost in curves[method].items() if cost]
        looks["linestyle"] = "-" if method == "exact" else looks["linestyle"]
        glyphs += _drawn_or_glyphs(ax, method, reached, looks)
        if method in lost:
            missed = [mu for mu, cost in curves[method].items() if not cost]
            level = top * SPACING ** (kinds.index("model" if method in style.MODELS else method) + 0.5)
            apart = {**looks, "linestyle": "none", "label": None}
            glyphs += _drawn_or_glyphs(ax, method, [(mu, level) for mu in missed], apart)
    _side_by_side(ax, glyphs)


def _drawn_or_glyphs(ax, method, places, looks):
    """Draw the curve of an integrator or of the exact flow; for another model return its marks as (x, y, looks)."""
    if method not in style.MODELS or method == "exact":
        ax.plot([x for x, _ in places], [y for _, y in places], **looks)
        return []
    ax.plot([], [], **looks)
    return [(x, y, {**looks, "label": None}) for x, y in places]


def _side_by_side(ax, glyphs, begin=None):
    """Draw the marks of models, in a row where they would overlap; both axes are logarithmic.

    The row is centred at the place of the mark, or begins ``begin`` marks to the right of it.
    """
    from matplotlib.transforms import ScaledTranslation

    scale = [log10(high / low) for low, high in (sorted(ax.get_xlim()), sorted(ax.get_ylim()))]
    groups = []
    for glyph in sorted(glyphs, key=lambda glyph: glyph[:1]):
        near = [group for group in groups if any(_touch(glyph, other, scale) for other in group)]
        groups = [group for group in groups if group not in near] + [[g for group in near for g in group] + [glyph]]
    for group in groups:
        for k, (x, y, looks) in enumerate(group):
            aside = k - (len(group) - 1) / 2 if begin is None else k + begin
            shift = ScaledTranslation(aside * GLYPH / 72, 0, ax.figure.dpi_scale_trans)
            ax.plot([x], [y], transform=ax.transData + shift, path_effects=style.halo(1.2), **looks)


def _touch(one, other, scale):
    return all(abs(log10(a / b)) < near * span
               for a, b, near, span in zip(one[:2], other[:2], NEAR, scale, strict=True))


def cheapest(rows: Iterable[Row], accuracy: float) -> dict[float, Any]:
    """Return {mu: least ratio among the runs with an error below ``accuracy``, or None}."""
    found = {}
    for mu, group in groupby(sorted(rows, key=lambda r: r["mu"]), key=lambda r: r["mu"]):
        costs = [r["ratio"] for r in group if r["final_error"] is not None and r["final_error"] <= accuracy]
        found[mu] = min(costs, default=None)
    return found


def cheapest_by_method(rows: Sequence[Row], methods: Iterable[str], accuracy: float) -> dict[str, dict[float, Any]]:
    """Return ``cheapest`` for the rows of every method."""
    return {method: cheapest([row for row in rows if row["method"] == method], accuracy) for method in methods}


def nonlinear(rows: Sequence[Row]) -> style.Figure:
    """Draw the errors of small-angle models of the geometrically nonlinear rod over mu, for every kappa.

    A digit n marks the jump map of order n, at kappa = 1 only; there, two integrators of the nonlinear rod are drawn.
    """
    with plate(2.0) as (figure, [[ax]]):
        glyphs = []
        style.logarithmic(ax, xlabel=r"$\mu$", ylabel="error of the final state")
        for kappa in sorted({row["kappa"] for row in rows}):
            exact = _errors([row for row in rows if row["kappa"] == kappa], "exact")
            ax.plot(*zip(*exact, strict=True), **{**style.curve("exact"), "linestyle": "-", "linewidth": 0.6})
            ax.annotate(rf"$\kappa = {kappa:g}$", exact[0], (5 + 4 * GLYPH * (kappa == 1), 0),
                        textcoords="offset points", fontsize=6, va="center")
        here = [row for row in rows if row["kappa"] == 1]
        for method, raised in ALONGSIDE_METHODS.items():
            if points := _errors(here, method):
                ax.plot(*zip(*points, strict=True), **style.curve(method))
                ax.annotate(style.curve(method)["label"], points[0], (5, raised), textcoords="offset points",
                            color=style.curve(method)["color"], va="center")
        for method in [m for m in style.MODELS if m != "exact"]:
            glyphs += _drawn_or_glyphs(ax, method, _errors(here, method), style.curve(method))
        low, high = ax.get_xlim()
        ax.set_xlim(high, low / 50)
        _side_by_side(ax, glyphs, begin=1.4)  # beside the stars of the exact flow, which are not moved
    return figure


def _errors(rows, method):
    """Return the pairs (mu, error) of a method; of an integrator, only those at the tolerance ``ALONGSIDE``."""
    return sorted((row["mu"], row["final_error"]) for row in rows if row["method"] == method
                  and row["final_error"] is not None and (row["rtol"] or ALONGSIDE) == ALONGSIDE)


def model_savings(rows: list[Row]) -> style.Figure | None:
    """The cost of integrators at the error of ``jump 1``, in units of the cost of ``jump 1``: a panel for each system.

    Integrators that never reach this error are in the band. None where no integrator has a row.
    """
    if not (found := savings(rows)):
        return None
    systems = list(dict.fromkeys(system for system, _ in found))
    methods = [m for m in style.METHODS if any(m in of for of in found.values())]
    top = 3 * max(cost or 1 for of in found.values() for cost in of.values())
    with sheet(1.5, 1, len(systems), entries=len(methods), per_line=4, sharey=True) as (figure, axes):
        for ax, system in zip(axes.flat, systems, strict=True):
            style.logarithmic(ax, xlabel=r"$\mu$", title=system, ylim=(0.2, 3 * top))
            ax.axhspan(top, 3 * top, color="0.93", lw=0)
            ax.axhline(1, color="black", lw=0.8)
            for k, method in enumerate(methods):
                places = [(mu, of[method]) for (name, mu), of in found.items() if name == system and method in of]
                ax.plot(*zip(*((mu, c) for mu, c in places if c), strict=True), **style.curve(method))
                lost = [mu for mu, c in places if not c]
                level = top * 3 ** ((k + 0.5) / len(methods))
                ax.plot(lost, [level] * len(lost), **{**style.curve(method), "linestyle": "none", "label": None})
            ax.margins(x=0.1)
            ax.invert_xaxis()
        axes[0, 0].set_ylabel("CPU time / jump 1")
        axes[0, 0].annotate("not reached", (0, 1), (3, -2), xycoords="axes fraction", textcoords="offset points",
                            fontsize=6, va="top")
    return figure


def few_costs(rows: Sequence[Row], methods: Sequence[str], accuracy: float) -> style.Figure:
    """The least cost of an error below ``accuracy`` against mu for a few ``methods``, with names at the curves."""
    with plate(2.0) as (figure, [[ax]]):
        style.logarithmic(ax, xlabel=r"$\mu$", ylabel="CPU time / exact flow")
        found = cheapest_by_method(rows, methods, accuracy).items()
        curves = {m: [(mu, cost) for mu, cost in costs.items() if cost] for m, costs in found if any(costs.values())}
        for method, curve in curves.items():
            ax.plot(*zip(*curve, strict=True), **{**style.curve(method), "linestyle": "-"})
            (mu, cost), ink = curve[0], style.curve(method)["color"]
            crowded = any(cost < other[0][1] < 5 * cost and other[0][0] == mu for other in curves.values())
            ax.annotate(style.curve(method)["label"], (mu, cost), (0, -5 if crowded else 5), textcoords="offset points",
                        color=ink, ha="center", va="top" if crowded else "bottom")
        ax.invert_xaxis()
        ax.margins(x=0.12, y=0.18)
    return figure


def failures(parts: Sequence[tuple[str, Sequence[Row], str]]) -> style.Figure:
    """Map of the outcomes of all runs: a line for each method, a block for each part (label, rows, column of abscissa).

    A cell holds the runs of all tolerances. A cell without failed runs is white; otherwise its number counts the failed
    runs, and its colour shows the most frequent of ``FAILURES`` among them.
    """
    methods = [m for m in style.METHODS if any(row["method"] == m for _, rows, _ in parts for row in rows)]
    widths = [len({row[along] for row in rows}) for _, rows, along in parts]
    with plate(0.17 * len(methods) + 0.6, 1, len(parts), sharey=True, width_ratios=widths) as (figure, axes):
        for ax, (words, rows, along) in zip(axes.flat, parts, strict=True):
            _failure_block(ax, rows, along, methods)
            ax.set_xlabel(words)
        axes.flat[0].set_yticks(range(len(methods)), [style.SHORT.get(m, style.curve(m)["label"]) for m in methods])
        axes.flat[0].set_ylim(len(methods) - 0.5, -0.5)
        handles = [style.patch(colour, words, edgecolor="0.5", linewidth=0.4) for colour, _, words in FAILURES.values()]
        figure.legend(handles=handles, loc="outside lower center", ncols=4, columnspacing=0.8, handlelength=1.2)
    return figure


def _failure_block(ax, rows, along, methods):
    from matplotlib.patches import Rectangle

    places = sorted({row[along] for row in rows})
    for j, method in enumerate(methods):
        for i, place in enumerate(places):
            runs = [outcome(row["status"]) for row in rows if row["method"] == method and row[along] == place]
            if not runs:
                continue
            lost = [key for key in runs if key in FAILURES]
            kind = max(FAILURES, key=lost.count) if lost else None
            colour = FAILURES[kind][0] if kind else "white"
            ax.add_patch(Rectangle((i - 0.5, j - 0.5), 1, 1, facecolor=colour, edgecolor="0.85", linewidth=0.4))
            if lost:
                ax.text(i, j, str(len(lost)), ha="center", va="center", fontsize=6, color=FAILURES[kind][1])
    ax.set_xlim(-0.5, len(places) - 0.5)
    ax.grid(visible=False)
    ax.tick_params(length=0)
    ends = {0: f"${style.power_of_ten(places[0])}$", len(places) - 1: f"${style.power_of_ten(places[-1])}$"}
    if places[0] < 0 < places[-1]:
        ends[bisect(places, 0) - 0.5] = "0"
    ax.set_xticks([*ends], [*ends.values()])


def _methods(rows):
    present = {row["method"] for row in rows}
    return [method for method in (*style.METHODS, *style.MODELS) if method in present]
