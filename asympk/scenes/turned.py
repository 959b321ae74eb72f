"""Change numbers of a scene by name: parameters, states of the start, the horizon."""

from collections.abc import Container
from dataclasses import replace
from typing import Any

import sympy as sp

from asympk.errors import UnknownName
from asympk.formulas import read_constant, read_number
from asympk.numbers import short, spells_number
from asympk.scene import Scene
from asympk.symbolic.reading import rational
from asympk.symbolic.system import System
from asympk.symbolic.values import following, with_changes
from asympk.systems.catalogue import is_off_contact, start_at
from asympk.systems.painleve_klein.units import STATE, Degrees, quantity, scene_in_units

_STATIC = {"sigma0": "sigma", "f0": "f"}  # of the rod


def scene_parameters(scene: Scene) -> dict[str, Any]:
    """Return the parameters of a scene by name; for a rod in physical units, its physical quantities."""
    if scene.rod is not None:
        return {name: value for name, value in scene.rod.quantities if name not in STATE}
    return scene.numbers


def static_frictions(system: System | None) -> dict[str, str]:
    """Return the static frictions of a system that follow kinetic ones; None stands for the system of the rod."""
    return _STATIC if system is None else following((f.static, f.kinetic) for f in system.frictions)


def turned(scene: Scene, given: dict[str, Any], start: dict[str, Any], until: Any) -> Scene:
    """Return ``scene`` with the given parameters and states of the start, by name, and with ``until`` if not None.

    Static friction equal to the kinetic one changes with it, unless given. At a start off the elastic contact of a
    mechanism the reaction and the sliding velocity follow from the new numbers, as the ground stays. A start of
    ``Scene.near`` keeps its offset unless y is given, or x or the sign of z changes. States that depend on others
    (``System.dependent``) follow from these unless given. Raises ``InputError``, ``UnknownName``, and ``NoManifold``
    where a scene starts beside a slow line that does not exist at the new parameters.
    """
    shown, own = in_own_units(scene), scene_parameters(scene)
    _require_names(given, own, "parameter", f"; the states of its start are {', '.join(shown.names)}")
    _require_names(start, shown.names, "state of the start")
    read = {name: _read(scene, own[name], name, value) for name, value in given.items()}
    values = with_changes(own, read, static_frictions(scene.system))
    angles = scene.system is not None  # those of the rod are a quantity of their own
    begun = {name: read_number(f"start {name}", value, angles) for name, value in start.items()}
    placed, horizon, origin, follows = scene.start, scene.until, scene.origin, values != own or bool(begun)
    if scene.rod is not None:  # whose start and horizon are kept as they were given, exactly
        placed, horizon = shown.start, shown.until
    if is_off_contact(scene) and not begun.keys() >= {*scene.names}:
        placed, origin = _derived(scene, values, begun)
        follows = origin is None  # else the states that depend on others are derived, too
    begin = tuple(begun.get(name, value) for name, value in zip(shown.names, placed, strict=True))
    if follows:
        begin = _followed(scene, values, begin, begun)
    end = horizon if until is None else read_number("until", until, angles=False)
    return _built(scene, values, begin, end, origin, moved="y" in begun or _moved(scene, begin))


def _read(scene: Scene, own: Any, name: str, value: Any) -> Any:
    """Return the parameter ``name`` in the place of ``own`` as a file has it."""
    if scene.rod is None:
        return read_number(name, value, angles=scene.system is not None)
    return quantity(name, read_constant(name, as_in_file(own, value), angles=False))


def as_in_file(own: Any, value: Any) -> Any:
    """Return a mere number in the place of an angle in degrees as a text in degrees, and any other value as it is.

    A formula such as pi/4 is in radians, as it is in a file.
    """
    mere = not isinstance(value, str) or spells_number(value)
    return f"{value} deg" if isinstance(own, Degrees) and mere else value


def _moved(scene: Scene, start: tuple) -> bool:
    """Return whether x or the side of z = 0 is not that of the scene: its slow line lies in one mode, for every z."""
    return scene.near_to is not None and (start[0] != scene.start[0] or start[2] * scene.start[2] <= 0)


def _derived(scene: Scene, values: dict[str, Any], begun: dict[str, Any]) -> tuple[Any, tuple | None]:
    """Return the start that follows from the origin of a scene after changes, and the new origin if it has one."""
    mechanism, numbers, state, _ = scene.origin
    state = with_changes(state, begun, {})
    start = start_at(mechanism, scene.system, {**numbers, **values}, state)
    origin = (mechanism, numbers, state) if begun.keys() <= state.keys() else None
    return [start[name] for name in scene.names], origin


def _followed(scene: Scene, values: dict[str, Any], start: tuple, given: Container[str]) -> tuple:
    """Return a start with the values of the dependent states that are not ``given``."""
    if scene.system is None or not scene.system.dependent:
        return start
    system, numbers = scene.system, {**values, **dict(zip(scene.names, start, strict=True))}
    at = {s: rational(s.name, numbers[s.name]) for s in (*system.states, *system.parameters)}
    at |= {system.time: sp.S.Zero} if system.time else {}
    found = {s.name: value.subs(at) for s, value in system.dependent.items() if s.name not in given}
    return tuple(found.get(name, value) for name, value in zip(scene.names, start, strict=True))


def _built(scene: Scene, values: dict[str, Any], start: tuple, until: Any, origin: Any, moved: bool) -> Scene:
    if scene.rod is not None:
        spelt = {name: str(value) if isinstance(value, Degrees) else value for name, value in values.items()}
        return Scene.physical(**spelt, start=start, until=until, name=scene.name, units=scene.rod.words)
    if scene.system is not None:
        begin = dict(zip(scene.names, start, strict=True))
        return replace(scene, values=values, start=begin, until=until, origin=origin)
    if scene.near_to and not moved:
        manifold, offset = scene.near_to
        return Scene.near(manifold, x=start[0], offset=offset, z=start[2], until=until, name=scene.name, **values)
    return Scene(**values, start=start, until=until, name=scene.name)


def in_own_units(scene: Scene) -> Any:
    """Return a scene, or for a rod in physical units an object with names, start and horizon in these units."""
    return scene if scene.rod is None else scene_in_units(scene)


def _require_names(given: dict[str, Any], known: Any, what: str, beyond: str = "") -> None:
    for name in given:
        if name not in known:
            choice = f"choose one of {', '.join(known)}" if known else "the scene has none"
            raise UnknownName(f"{short(name)} is no {what}; {choice}{beyond}")
