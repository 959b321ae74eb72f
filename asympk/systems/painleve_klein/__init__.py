"""The Painlevé-Klein rod: two masses on parallel guides, one of them rough, joined by a rod at the angle alpha.

P pushes the rough mass. There is a paradox for f tan(alpha) > 2: the rigid rod has no motion backward, and two forward.
The elastic, damped rod has the scaled reaction x, its rate y and the velocity z of the rough mass, (2.7)-(2.9).
Source: N. A. Fufaev, Dynamics of the system in the Painlevé-Klein example, Mechanics of Solids (1991), in Russian.
"""

# rod -> equations -> units in symbols, modes -> flow -> arrays in numbers: the kernel that systems.kernels plugs in
# the names of equations are loaded at their first use, since the kernel follows a scene without symbols

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from asympk.systems.painleve_klein.equations import *  # noqa: F403


def _load(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(f"module 'asympk.systems.painleve_klein' has no attribute {name!r}")
    return getattr(import_module("asympk.systems.painleve_klein.equations"), name)


if not TYPE_CHECKING:
    __getattr__ = _load
