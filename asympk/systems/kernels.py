"""The kernel of the Painlevé-Klein rod: what follows its scenes faster than the general engine.

One test of ``tests/affine/test_affine_scenes.py`` holds it to the general engine over random scenes. It offers every
method in the first table for one scene, as ``run(scene, method, **options) -> Path``, and every method in the second
for arrays, as ``solve_many(*columns, method, **options)``. A method that it does not offer is the general one.
"""

from dataclasses import replace
from typing import Any

from asympk.scene import Scene

FOR_SCENES = {
    "exact": "systems.painleve_klein.flow.exact",
    "rigid": "asymptotics.models",
    "slow": "asymptotics.models",
    "jump": "asymptotics.models",
    "moreau": "integrators.moreau",
}
FOR_ARRAYS = {
    "exact": "systems.painleve_klein.arrays.ensemble",
    "rigid": "asymptotics.arrays",
    "slow": "asymptotics.arrays",
    "jump": "asymptotics.arrays",
}


def is_rod(system: Any) -> bool:
    """Tell whether a ``System`` is the Painlevé-Klein rod's."""
    if tuple(s.name for s in system.parameters) != ("mu", "sigma", "sigma0"):
        return False
    from asympk.systems import painleve_klein

    return system == painleve_klein.system()


def kernel_scene(scene: Any) -> Scene | None:
    """Return ``scene`` as one of the Painlevé-Klein rod, where its system is the rod's; else None."""
    if scene.system is None:
        return scene
    if not is_rod(scene.system):
        return None
    mu, sigma, sigma0 = scene.values
    return Scene(sigma, mu, scene.start, scene.until, sigma0, scene.name)


def as_asked(path: Any, scene: Any) -> Any:
    """Return a path of a kernel as one of the scene that was asked for."""
    return path if path.scene is scene else replace(path, scene=scene)
