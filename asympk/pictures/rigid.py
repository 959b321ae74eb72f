"""The map of the rigid motions of a mechanism: how many there are over a coordinate and the friction.

Below the map of a mechanism whose contact has no damping stands its phase plane (R, R').
"""

from collections.abc import Iterable
from pathlib import Path as File
from typing import Any

import numpy as np
import sympy as sp

from asympk.errors import InputError
from asympk.mechanics.described import Described
from asympk.mechanics.paradoxset import ROWS, ParadoxSet
from asympk.pictures import plate, reactions, sheets, style
from asympk.symbolic.reading import as_floats

LOOKS = {0: ("no", "0.25", ""), 1: ("one", "white", ""), 2: ("two", "0.8", "////"), 3: ("three", "0.6", "xx")}


def motion_plot(described: Described) -> style.Figure:
    """Draw the number of rigid motions over ``described.turn`` and the coefficient of friction; return the figure.

    The contact is closed and has the sliding velocity of the example, whose place is marked. Raises ``InputError``
    where friction is not a single parameter, or where the description names no other quantity to draw over.
    """
    if not described.mapped:
        raise InputError("a map needs [over] in the description, as friction one parameter that is not in [over], and "
                         "no rough others that hold both ways")
    rows = 1 if described.undamped is None else 3
    with plate(2.3 if rows == 1 else 6.2, rows) as (figure, axes):
        shown = draw_motions(axes.flat[0], described)
        place = "outside lower center" if rows == 1 else "outside upper center"
        handles = [*motion_handles(shown), *_mark_example(axes.flat[0], described)]
        figure.legend(handles=handles, loc=place, ncols=len(handles) if len(handles) < 4 else 2, columnspacing=1)
        if described.undamped is not None:
            reactions.draw_reactions(axes.flat[1:], described)
    return figure


def draw_motions(ax: style.Axes, described: Described) -> set[int]:
    """Draw the map of a mechanism into ``ax``; return the set of numbers of rigid motions on the map."""
    rod, (name, first, last) = described.mechanism, described.turn or ()
    at = np.linspace(as_floats(name, first), as_floats(name, last), 241)
    most = _most(described, at)
    friction = np.linspace(most / 240, most, 240)
    count = rod.motion_map(described.closed(at[None, :], friction[:, None])).count
    shown = {*count.flat}
    for number in sorted(shown):
        _, colour, hatch = LOOKS[min(number, 3)]
        ax.contourf(at, friction, count == number, levels=[0.5, 1.5], colors=[colour], hatches=[hatch])
    ax.set(xlabel=f"${sp.latex(sp.Symbol(name))}$", ylabel="friction", ylim=(0, most))
    return shown


def _mark_example(ax: style.Axes, described: Described) -> list[Any]:
    """Mark the place of the example on the map ``ax``, unless it has none there; return the entry of a legend."""
    (name, first, last), contact = described.turn or (), described.mechanism.contact.friction
    place = [float(as_floats(key, described.numbers[key])) for key in (name, str(contact)) if key in described.numbers]
    if len(place) < 2 or not as_floats(name, first) <= place[0] <= as_floats(name, last):
        return []
    at, friction = place
    label = f"${sp.latex(sp.Symbol(name))}$ = {at:.4g}, ${sp.latex(contact)}$ = {friction:.4g}"
    return ax.plot(at, friction, "o", color=style.ORANGE, markeredgecolor="white", markersize=5, label=label)


def _most(described: Described, at: np.ndarray) -> float:
    """Return twice the friction of the example, or more so that the least critical friction over ``at`` is shown."""
    rod = described.mechanism
    twice = 2 * (float(rod.evaluate(rod.contact.friction, described.numbers)) or 1.0)
    coupling = np.max(rod.evaluate(1 / rod.critical_friction, described.closed(at, twice)))
    return max(twice, float(1.5 / coupling)) if coupling > 0 else twice


def motion_handles(shown: Iterable[int]) -> list[Any]:
    """Return the entries of a legend for numbers of rigid motions."""
    looks = [(number, *LOOKS[min(number, 3)]) for number in sorted(shown)]
    return [style.patch(colour, f"{word} rigid motion{'s' if number > 1 else ''}", hatch=hatch, edgecolor=style.BLACK,
                        linewidth=0.4) for number, word, colour, hatch in looks]


def paradox_plot(found: ParadoxSet, file: str | File | None = None) -> style.Figure:
    """Draw where a ``ParadoxSet`` has a paradox: bars over one quantity, an area over two; return the figure."""
    sheet = sheets(file)
    area = len(found.over) == 2
    low, high = found.ends[1] if area else (0, 1)
    with plate(2.6 if area else 1.2) as (figure, [[ax]]):
        height = (high - low) / (ROWS - 1) if area else 1.0
        for interval in found.intervals:
            middle = 0.5 if interval.other is None else interval.other
            ax.broken_barh([(interval.start, interval.end - interval.start)], (middle - height / 2, height),
                           facecolors=LOOKS[0][1], linewidth=0)
        ax.set(xlabel=found.over[0], xlim=found.ends[0], ylim=(low, high), ylabel=found.over[1] if area else "")
        ax.set_yticks(ax.get_yticks() if area else [])
        figure.legend(handles=[style.patch(LOOKS[0][1], "paradox")], loc="outside lower center")
    return sheet.kept(figure, file)
