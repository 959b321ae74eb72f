"""Errors of models against the small parameter, for several systems: marks, and lines to which the marks tend."""

from typing import Any

from asympk.pictures import plate, style
from asympk.studies.decreasing import is_limit

MARKS = ("o", "s", "^", "D", "v")


def decreasing(rows: list[dict]) -> Any:
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
                _draw(ax, sorted(here, key=lambda row: row["mu"]), MARKS[names.index(name)], name)
            limit, order = panel
            title = "friction, 0" if limit else f"order {order}"
            style.logarithmic(ax, xlabel=r"$\mu$", title=title)
        axes.flat[0].set_ylabel("error")
        handles = {h.get_label(): h for ax in axes.flat for h in ax.get_legend_handles_labels()[0]}
        figure.legend(handles=[handles[name] for name in names], loc="outside lower center", ncols=2)
    return figure


def _panel(row):
    return is_limit(row), row["order"]


def _draw(ax, rows, mark, name):
    if not rows:
        return
    mus, last = [row["mu"] for row in rows], rows[0]
    factor = last["ratio"] if is_limit(last) else 1
    ax.plot(mus, [abs(factor * row["measure"]) for row in rows], color=style.BLUE, lw=0.6)
    ax.plot(mus, [abs(row["error"]) for row in rows], ls="", marker=mark, ms=3, color=style.BLUE,
            markerfacecolor="white", markeredgewidth=0.6, label=name)
