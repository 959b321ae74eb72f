"""Errors of models against the small parameter, for several systems: marks on the terms that they tend to."""

from typing import Any

from asympk.pictures import style
from asympk.pictures.portraits import plate

MARKS = ("o", "s", "^", "D", "v")


def decreasing(rows: list[dict]) -> Any:
    """Draw errors and their measures against mu: a panel for each order of a composite, one for limits with friction.

    Marks are errors; lines are the first omitted terms, with friction the constant at the least mu times mu log(1/mu).
    """
    panels = {(row["order"], row["with_friction"]): None for row in sorted(rows, key=_panel)}
    names = list(dict.fromkeys(row["system"] for row in rows))
    with plate(2.2, 1, len(panels), sharex=True, sharey=True) as (figure, axes):
        for ax, panel in zip(axes.flat, panels, strict=True):
            for name in names:
                here = [row for row in rows if row["system"] == name and (row["order"], row["with_friction"]) == panel]
                _draw(ax, sorted(here, key=lambda row: row["mu"]), MARKS[names.index(name)], name)
            order, friction = panel
            ax.set(xscale="log", yscale="log", xlabel=r"$\mu$", title="friction" if friction else f"order {order}")
            ax.minorticks_off()
        axes.flat[0].set_ylabel("error")
        handles = {h.get_label(): h for ax in axes.flat for h in ax.get_legend_handles_labels()[0]}
        figure.legend(handles=[handles[name] for name in names], loc="outside lower center", ncols=2)
    return figure


def _panel(row):
    return row["with_friction"], row["order"]


def _draw(ax, rows, mark, name):
    if not rows:
        return
    mus, last = [row["mu"] for row in rows], rows[0]
    factor = last["ratio"] if last["with_friction"] else 1
    ax.plot(mus, [abs(factor * row["measure"]) for row in rows], color=style.BLUE, lw=0.6)
    ax.plot(mus, [abs(row["error"]) for row in rows], ls="", marker=mark, ms=3, color=style.BLUE,
            markerfacecolor="white", markeredgewidth=0.6, label=name)  # fmt: skip
