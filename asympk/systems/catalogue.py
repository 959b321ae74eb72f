"""The shared part of the mechanisms of the catalogue: their common symbols, and a scene from names and numbers.

A module of the catalogue has ``mechanism()``, ``system()``, ``scenes()``, the numbers of an example, ``VALUES`` and
``STATE``, and ``TURN``, the variable over which its paradox is shown: a coordinate or parameter, and the ends of its
range.
"""

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any

import sympy as sp

from asympk.mechanics.checks import departures
from asympk.mechanics.described import Described
from asympk.mechanics.mechanism import Mechanism
from asympk.naming import named
from asympk.scene import Scene
from asympk.symbolic.system import System
from asympk.systems.kernels import kernel_scene

c, h, eps = sp.symbols("c h eps", positive=True)  # compliance, damping time, square root of the compliance
f, f0 = sp.symbols("f f_0", positive=True)


def example_scene(
    mechanism: Mechanism, system: System, values: Mapping[str, Any], state: Mapping[str, Any], until: Any, name: str
) -> Scene:
    """Return a ``Scene`` of an elastic or rigid ``system`` that starts where the mechanism's ``state`` says."""
    start = start_at(mechanism, system, values, state)
    needed = {s.name for s in system.parameters}
    numbers = {key: value for key, value in values.items() if key in needed}
    origin = (mechanism, {**values}, {**state})
    return Scene(system=system, values=numbers, start=start, until=until, name=name, origin=origin)


def on_elastic_contact(
    mechanism: Callable[[], Mechanism], values: Mapping[str, Any], state: Mapping[str, Any], until: Any, name: str,
    compliance: sp.Expr = c, damping: Any = h,
) -> tuple[Callable[[], System], Callable[[], tuple[Scene, ...]]]:
    """Return the functions ``system`` and ``scenes`` of a module of the catalogue with a single example."""

    @cache
    def system() -> System:
        """Return the mechanism with an elastic, damped contact."""
        return mechanism().elastic(compliance, damping)

    def scenes() -> tuple[Scene, ...]:
        """Return the example of the mechanism."""
        return (example_scene(mechanism(), system(), values, state, until, name),)

    return system, scenes


def start_at(
    mechanism: Mechanism, system: System, values: Mapping[str, Any], state: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the start of an elastic or rigid ``system`` at a ``state``; ``values`` may contain further symbols."""
    own = {str(s) for s in (*mechanism.parameters, *system.parameters)}
    return mechanism.start(system, {**{k: v for k, v in values.items() if k in own}, **state})


def is_off_contact(scene: Scene) -> bool:
    """Tell whether a ``Scene`` of a mechanism starts off the contact: its reaction follows from ``Scene.origin``."""
    if scene.origin is None:
        return False
    slow, fast = scene.system.slow, scene.system.fast
    pressing = {*fast, *(x for x, rate in slow.items() if rate in fast)}
    start = dict(zip(scene.system.states, scene.start, strict=True))
    return any(start[s] for s in pressing)


def strained_gaps(scene: Scene) -> dict[int, float]:
    """Return the gaps by which elastic contacts have a reaction at the start of a ``Scene`` of a mechanism.

    The keys are the numbers of the contacts, from 1 on. A contact that only pushes has no reaction at a gap above 0.
    """
    if scene.origin is None:
        return {}
    mechanism, values, state, _ = scene.origin
    own = {*map(str, mechanism.parameters)}
    given = mechanism.keyed({**{name: value for name, value in values.items() if name in own}, **state})
    gaps = (min(0, gap) if kinetics.unilateral else gap for kinetics in mechanism.equations
            for gap in (departures(kinetics, given).get("g", 0),))
    return {k: gap for k, gap in enumerate(gaps, 1) if gap}


def about_system(name: str) -> str:
    """Return the first line of the module of a system of the catalogue, which describes it."""
    return str(import_module(f"asympk.systems.{name}").__doc__).partition("\n")[0]


def example_scenes(name: str) -> tuple[Scene, ...]:
    """Return the scenes of a system of the catalogue; for the Painlevé-Klein rod, in the form that its kernel takes."""
    return tuple(kernel_scene(scene) or scene for scene in import_module(f"asympk.systems.{name}").scenes())


def described_mechanism(name: str) -> Described:
    """Return a mechanism of the catalogue by its name as a ``Described``; raises ``UnknownName``."""
    from asympk.systems import MECHANISMS

    name = named("mechanism", name, MECHANISMS, beyond=", or a .toml file")
    module = import_module(f"asympk.systems.{name}")
    undamped = module.system() if "eps" in module.VALUES else None
    return Described(name, about_system(name), module.mechanism(), module.VALUES, module.STATE, module.TURN, undamped,
                     followed=True)
