"""The kernel of the Painlevé-Klein rod: the modules that follow its scenes faster than the general engine.

``FOR_SCENES`` names the module of a method for one scene, with ``run(scene, method, **options) -> Path``, and
``FOR_ARRAYS`` for arrays, with ``solve_many(*columns, method, **options)``. The general engine runs a method that is
not in the table. A test in ``tests/affine/test_affine_scenes.py`` compares both over random scenes.
"""

from typing import Any

from asympk.path import ASYMPTOTIC
from asympk.scene import Scene

FOR_SCENES = {
    "exact": "systems.painleve_klein.flow.exact",
    **dict.fromkeys(ASYMPTOTIC, "asymptotics.models"),
    "moreau": "integrators.moreau",
}
FOR_ARRAYS = {"exact": "systems.painleve_klein.arrays.ensemble", **dict.fromkeys(ASYMPTOTIC, "asymptotics.arrays")}


def is_rod(system: Any) -> bool:
    """Tell whether a ``System`` is that of the Painlevé-Klein rod."""
    if tuple(s.name for s in system.parameters) != ("mu", "sigma", "sigma0"):
        return False
    from asympk.systems import painleve_klein

    return system == painleve_klein.system()


def kernel_scene(scene: Any) -> Scene | None:
    """Return ``scene`` as a scene of the Painlevé-Klein rod if its system is that of the rod, else None."""
    if scene.system is None:
        return scene
    if not is_rod(scene.system):
        return None
    mu, sigma, sigma0 = scene.values
    return Scene(sigma, mu, scene.start, scene.until, sigma0, scene.name)
