"""The knobs of a scene: the numbers that the page lets one change, each with its range."""

from math import ulp
from sys import float_info
from typing import Any

from asympk.errors import InputError
from asympk.scene import Scene
from asympk.scenes.turned import in_own_units, scene_parameters, static_frictions
from asympk.systems.painleve_klein.units import Degrees

DECADES, DECADES_OF_SMALL = 1, 3  # the range on either side of a positive parameter, and of a small parameter
LEAST_DEGREES, MOST_DEGREES = 1, 89
LEAST, MOST = ulp(0.0), float_info.max  # beyond 0 and below infinity, which JSON has not


def knobs_of(scene: Scene) -> dict[str, Any]:
    """Return the knobs of a scene for the page: parameters, start, horizon; and the quantities that can be drawn."""
    shown = in_own_units(scene)
    quantities = [*shown.names, *(name for name, _ in shown.combinations)]
    return {
        "name": scene.name,
        "parameters": [_knob(scene, name, value) for name, value in scene_parameters(scene).items()],
        "start": [{**_linear(name, float(value)), "unit": shown.units.get(name, "")}
                  for name, value in zip(shown.names, shown.start, strict=True)],
        "until": {**_logarithmic("until", float(shown.until) or 1.0, DECADES), "unit": shown.units.get("t", "")},
        "quantities": quantities,
        "combinations": [{"name": name, "weights": [*map(float, w)]} for name, w in shown.combinations],
        "units": {name: shown.units[name] for name in ("t", *quantities) if name in shown.units},
        "pair": _pair(scene, quantities),
    }


def _knob(scene: Scene, name: str, value: Any) -> dict[str, Any]:
    unit = "deg" if isinstance(value, Degrees) else scene.rod.unit.get(name, "") if scene.rod is not None else ""
    follows = static_frictions(scene.system).get(name)
    same = follows is not None and scene_parameters(scene)[follows] == value
    return {**_range(scene, name, value), "unit": unit, "follows": follows if same else None}


def _range(scene: Scene, name: str, value: Any) -> dict[str, Any]:
    if isinstance(value, Degrees):
        given = float(value.value)
        return {**_linear(name, given), "low": min(LEAST_DEGREES, given), "high": max(MOST_DEGREES, given)}
    if scene.system is None and name in ("sigma", "sigma0"):
        return {**_linear(name, float(value)), "low": min(-1.9, (float(value) - 2) / 2)}  # above -2
    symbol = None if scene.system is None else next(s for s in scene.system.parameters if s.name == name)
    if float(value) > 0 and (symbol is None or symbol.is_positive):
        is_small = name in ("mu", "k") if symbol is None else symbol == scene.system.small
        return _logarithmic(name, float(value), DECADES_OF_SMALL if is_small else DECADES)
    found = _linear(name, float(value))
    return {**found, "low": 0.0} if found["low"] < 0 <= float(value) and _refused(scene, name, -LEAST) else found


def _refused(scene: Scene, name: str, value: float) -> bool:
    """Tell whether a system takes no such value, as no negative friction."""
    try:
        scene.system.placed({**scene.numbers, name: value}, scene.start)
    except InputError:
        return True
    return False


def _linear(name: str, value: float) -> dict[str, Any]:
    reach = 3 * max(1.0, abs(value))
    low, high = max(-MOST, value - reach), min(MOST, value + reach)
    return {"name": name, "value": value, "low": low, "high": high, "log": False}


def _logarithmic(name: str, value: float, decades: int) -> dict[str, Any]:
    low, high = max(LEAST, value / 10**decades), min(MOST, value * 10**decades)
    return {"name": name, "value": value, "low": low, "high": high, "log": True}


def _pair(scene: Scene, quantities: list[str]) -> tuple[str, str]:
    """Return the quantities of the first picture: load and velocity, else the state whose rate is fast and the last."""
    if scene.combinations:
        return quantities[-1], quantities[-2]
    ruled = [x for x, rate in scene.system.slow.items() if rate in scene.system.fast]
    return (ruled[0].name if ruled else quantities[0]), quantities[-1]
