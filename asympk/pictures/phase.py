"""The phase picture of any system: a motion over two of its states, and for two states the field around it."""

import math
from pathlib import Path as File
from typing import Any

import numpy as np
import sympy as sp

from asympk.automaton.compiled import by_elements, function
from asympk.errors import InputError, UnknownName
from asympk.integrators.onefield import slipping_rates
from asympk.methods import solve
from asympk.numbers import number, short
from asympk.path import Path
from asympk.pictures import plate, sheets, style
from asympk.pictures.paths import around, label_of
from asympk.pictures.portraits import arrows
from asympk.pictures.trace import column_names, trace
from asympk.scene import Scene
from asympk.symbolic.system import System

GRID = 60  # points of the field along either axis
HEIGHT = 2.8  # inches
WINDOW = ((-2, 2), (-2, 2))


def phase(
    what: Scene | Path | System, x: str | sp.Symbol | None = None, y: str | sp.Symbol | None = None, *,
    values: Any = None, window: tuple[tuple[Any, Any], tuple[Any, Any]] | None = None, file: str | File | None = None,
) -> style.Figure:
    """Draw the motion of a scene or a path over the two states ``x`` and ``y``, symbols or names; the rod's load is s.

    By default these are the first and the last state, and for the rod load and velocity, s and z or R and u. If the
    system has only two states, its field is drawn too, with the lines on which a sliding velocity vanishes; where
    contacts open, or a load contains its own force, these lines alone. Of a ``System`` of two states, only this is
    drawn, with ``values`` for the parameters. ``window`` is ((left, right), (low, high)). Raises ``InputError``,
    ``UnknownName`` for an unknown state, and the errors of ``solve``.
    """
    sheet = sheets(file)
    if not isinstance(what, Scene | Path | System):
        raise InputError(f"phase takes a Scene, a Path or a System, not {type(what).__name__}")
    with plate(HEIGHT) as (drawing, axes):
        axis = axes.flat[0]
        if isinstance(what, System):
            names = tuple(s.name for s in what.states)
            if len(names) != 2:
                raise InputError(f"the field of {len(names)} states cannot be drawn; draw a Scene over two of them")
            numbers, _ = what.placed({} if values is None else values, dict.fromkeys(what.states, 0))  # no start
            _field(axis, what, numbers, _window(window, WINDOW), _pair(names, names, x, y))
        else:
            _motion(axis, what if isinstance(what, Path) else solve(what), x, y, window)
    return sheet.kept(drawing, file)


def _pair(names: tuple[str, ...], states: tuple[str, ...], x: Any, y: Any) -> tuple[str, str]:
    default = states[0] if names == states else names[-1], states[-1]  # a combination of states is last
    given = (getattr(state, "name", state) for state in (x, y))
    chosen = tuple(name if state is None else state for state, name in zip(given, default, strict=True))
    for name in chosen:
        if not isinstance(name, str) or name not in names:
            raise UnknownName(f"{short(name)} is no state; choose two of {', '.join(names)}")
    if chosen[0] == chosen[1]:
        raise InputError(f"x and y are both {chosen[0]}; choose two of {', '.join(names)}")
    return chosen[0], chosen[1]


def _window(given: Any, default: Any) -> Any:
    try:
        (left, right), (low, high) = default if given is None else given
    except (TypeError, ValueError):
        raise InputError(f"window = {short(given)}: it must be ((left, right), (low, high))") from None
    found = [[float(number("window", v)) for v in ends] for ends in ((left, right), (low, high))]
    if not (found[0][0] < found[0][1] and found[1][0] < found[1][1]):
        raise InputError(f"window = {short(given)}: the lower ends must be below the upper ones")
    return found


def _motion(axis: Any, path: Path, x: Any, y: Any, window: Any) -> None:
    """Draw a path with arrows along it: its start as a circle, its events as dots."""
    names = column_names(path)[1:-1]
    pair = _pair(names, path.names, x, y)
    data = dict(zip(column_names(path), zip(*trace(path), strict=True), strict=True))
    u, v = (np.array(data[name], dtype=float) for name in pair)
    ends = _window(window, [around(w) for w in (u, v)])
    system = path.scene.system
    if system is not None and len(system.states) == 2:
        _field(axis, system, path.scene.values, ends, pair)
    axis.set(xlim=ends[0], ylim=ends[1], xlabel=label_of(path, pair[0]), ylabel=label_of(path, pair[1]))
    axis.plot(u, v, color=style.BLUE, lw=1.0, zorder=4)
    at = [data["t"].index(float(event.t)) for event in path.events]
    axis.plot(u[at], v[at], "o", color=style.BLUE, ms=2.4, zorder=5)
    axis.plot(u[:1], v[:1], "o", mfc="white", mec=style.BLUE, ms=3.4, zorder=6)
    arrows(axis, u, v, style.BLUE)


def _field(axis: Any, system: System, parameters: tuple, window: Any, pair: tuple[str, str]) -> None:
    """Draw the field of two states at the time 0, and where a sliding velocity or the rate of a fast state vanishes."""
    across, down = (np.linspace(low, high, GRID) for low, high in window)
    grid = dict(zip(pair, np.meshgrid(across, down), strict=True))
    points = np.stack([grid[s.name] for s in system.states], axis=-1).reshape(-1, len(system.states)).tolist()
    axis.set(xlim=window[0], ylim=window[1], xlabel=pair[0], ylabel=pair[1])
    axis.grid(visible=False)
    axis.set_title(f"the field at {system.time} = 0" if system.time is not None else "")
    velocities = tuple(friction.velocity for friction in system.frictions)
    for values in _evaluated(system, velocities, points, parameters):
        _zeros(axis, across, down, values, style.BLACK, "-")
    try:
        rates = slipping_rates(system, sp.sign)
    except InputError:  # contacts that open, or a load that contains its own force: there is no one field
        return
    flow = dict(zip(system.states, _evaluated(system, rates, points, parameters), strict=True))
    named = {s.name: rate for s, rate in flow.items()}
    axis.streamplot(across, down, named[pair[0]], named[pair[1]], color="0.75", linewidth=0.5, arrowsize=0.5,
                    density=0.9)
    for fast in system.fast:
        _zeros(axis, across, down, flow[fast], style.RED, "--")


def _evaluated(system: System, outputs: tuple, points: list, parameters: tuple) -> Any:
    """Return the values of expressions on the grid, an array for each, masked where not finite."""
    if not outputs:
        return []
    at = by_elements(function(system, outputs, "math", math), len(outputs))
    return np.ma.masked_invalid(np.reshape(at(0.0, *np.transpose(points), *map(float, parameters)), (-1, GRID, GRID)))


def _zeros(axis: Any, across: Any, down: Any, values: Any, ink: str, dash: str) -> None:
    if values.min() < 0 < values.max():
        axis.contour(across, down, values, [0], colors=[ink], linestyles=[dash], linewidths=[0.9], zorder=3)
