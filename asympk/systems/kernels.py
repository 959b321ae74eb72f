"""Systems with a kernel of their own: which scenes it follows, and what it makes of them."""

from dataclasses import replace
from typing import Any

from asympk.scene import Scene


def kernel_scene(scene: Any) -> Scene | None:
    """Return ``scene`` as one of the Painlevé-Klein rod, where its system is the rod's; else None."""
    from asympk.systems import painleve_klein as pk

    names = ("mu", "sigma", "sigma0")
    if tuple(s.name for s in scene.system.parameters) != names or scene.system != pk.system():
        return None
    mu, sigma, sigma0 = scene.values
    return Scene(sigma, mu, scene.start, scene.until, sigma0, scene.name)


def named(path: Any, scene: Any) -> Any:
    """Return a path of a kernel as one of the scene that was asked for."""
    return replace(path, scene=scene)
