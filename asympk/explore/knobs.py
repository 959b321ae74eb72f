"""What of a scene can be turned, over which ranges, and the scene that is turned so."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

from asympk.errors import InputError, UnknownName
from asympk.numbers import number, short
from asympk.scene import Scene
from asympk.systems.painleve_klein.units import SI, STATE, Degrees

ROD = ("sigma", "mu", "sigma0")
STATIC = {"sigma0": "sigma", "f0": "f"}  # follow the kinetic friction until they are turned themselves
DECADES, DECADES_OF_SMALL = 1, 3  # to either side of a positive parameter
MOST_DEGREES = 89


def knobs_of(scene: Scene) -> dict[str, Any]:
    """Return the knobs of a scene for the page: parameters, start and horizon, and the names of what is drawn."""
    shown = _in_own_units(scene)
    quantities = [*shown.names, *(name for name, _ in shown.combinations)]
    return {
        "name": scene.name,
        "parameters": [_knob(scene, name, value) for name, value in scene_parameters(scene).items()],
        "start": [_linear(name, float(value)) for name, value in zip(shown.names, shown.start, strict=True)],
        "until": _logarithmic("until", float(shown.until) or 1.0, DECADES),
        "quantities": quantities,
        "combinations": [{"name": name, "weights": [*map(float, w)]} for name, w in shown.combinations],
        "units": {name: shown.units[name] for name in ("t", *quantities) if name in shown.units},
        "pair": _pair(scene, quantities),
    }


def scene_parameters(scene: Scene) -> dict[str, Any]:
    """Return the parameters of a scene by name: the physical quantities of a rod that is told in them."""
    if scene.rod is not None:
        return {name: value for name, value in scene.rod.quantities if name not in STATE}
    if scene.system is None:
        return {name: getattr(scene, name) for name in ROD}
    return {s.name: value for s, value in zip(scene.system.parameters, scene.values, strict=True)}


def turned(scene: Scene, given: dict[str, Any], start: dict[str, Any], until: Any) -> Scene:
    """Return ``scene`` with other parameters, states of the start and horizon, by name; None is the scene's own.

    Static friction that equals the kinetic one follows it until it is given itself. Raises ``InputError``,
    ``UnknownName``, and ``NoManifold`` where a scene beside a slow line loses it.
    """
    shown, own = _in_own_units(scene), scene_parameters(scene)
    _require_names(given, own, "parameter")
    _require_names(start, shown.names, "state of the start")
    values = {name: _read(name, given[name], own[name]) if name in given else v for name, v in own.items()}
    for static, kinetic in STATIC.items():
        if static in own and static not in given and own[static] == own[kinetic]:
            values[static] = values[kinetic]
    placed, horizon = _given(scene)
    begin = tuple(number(f"start {name}", start[name]) if name in start else value
                  for name, value in zip(shown.names, placed, strict=True))  # fmt: skip
    end = horizon if until is None else number("until", until)
    return _built(scene, values, begin, end, moved=bool(start))


def _built(scene: Scene, values: dict[str, Any], start: tuple, until: Any, moved: bool) -> Scene:
    if scene.rod is not None:
        return Scene.physical(**{**values, "alpha": _spelt(values["alpha"])}, start=start, until=until, name=scene.name)
    if scene.system is not None:
        return replace(scene, values=values, start=dict(zip(scene.names, start, strict=True)), until=until)
    if scene.near_to and not moved:
        manifold, offset = scene.near_to
        return Scene.near(manifold, x=start[0], offset=offset, z=start[2], until=until, name=scene.name, **values)
    return Scene(**values, start=start, until=until, name=scene.name)


def _in_own_units(scene: Scene) -> Any:
    """Return what has the names, the start and the horizon that a person sees: a physical rod in its own units."""
    if scene.rod is None:
        return scene
    from asympk.systems.painleve_klein.units import scene_in_units

    return scene_in_units(scene)


def _given(scene: Scene) -> tuple[tuple, Any]:
    """Return start and horizon as they were given, exactly."""
    if scene.rod is None:
        return scene.start, scene.until
    quantities = dict(scene.rod.quantities)
    *start, until = (quantities[name] for name in STATE)
    return tuple(start), until


def _require_names(given: dict[str, Any], known: Any, what: str) -> None:
    for name in given:
        if name not in known:
            raise UnknownName(f"{short(name)} is no {what}; choose of {', '.join(known)}")


def _read(name: str, value: Any, own: Any) -> Any:
    found = number(name, value)
    if not isinstance(own, Degrees):
        return found
    if not 0 < found < 90:
        raise InputError(f"{name} = {short(value)}: it must be between 0 and 90 degrees")
    return Degrees(Fraction(found))


def _spelt(angle: Any) -> Any:
    return str(angle) if isinstance(angle, Degrees) else angle


def _knob(scene: Scene, name: str, value: Any) -> dict[str, Any]:
    unit = "deg" if isinstance(value, Degrees) else SI.get(name, "") if scene.rod is not None else ""
    follows = STATIC.get(name) if scene.system is None else None
    same = follows is not None and scene_parameters(scene)[follows] == value
    return {**_range(scene, name, value), "unit": unit, "follows": follows if same else None}


def _range(scene: Scene, name: str, value: Any) -> dict[str, Any]:
    if isinstance(value, Degrees):
        return {**_linear(name, float(value.value)), "low": 1, "high": MOST_DEGREES}
    if scene.system is None and name in ("sigma", "sigma0"):
        return {**_linear(name, float(value)), "low": -1.9}
    small = scene.system.small if scene.system is not None else None
    symbols = {s.name: s for s in scene.system.parameters} if scene.system is not None else {}
    if float(value) > 0 and (scene.system is None or symbols[name].is_positive):
        is_small = name in ("mu", "k") if scene.system is None else symbols[name] == small
        return _logarithmic(name, float(value), DECADES_OF_SMALL if is_small else DECADES)
    return _linear(name, float(value))


def _linear(name: str, value: float) -> dict[str, Any]:
    reach = 3 * max(1.0, abs(value))
    return {"name": name, "value": value, "low": value - reach, "high": value + reach, "log": False}


def _logarithmic(name: str, value: float, decades: int) -> dict[str, Any]:
    return {"name": name, "value": value, "low": value / 10**decades, "high": value * 10**decades, "log": True}


def _pair(scene: Scene, quantities: list[str]) -> tuple[str, str]:
    """Return what the phase picture shows at first: the load, or the state of which the fast one is the rate."""
    if scene.combinations:
        return quantities[-1], quantities[-2]
    ruled = [x for x, rate in scene.system.slow.items() if rate in scene.system.fast]
    return (ruled[0].name if ruled else quantities[0]), quantities[-1]
