"""The Painlevé-Klein rod: its mechanics, its equations (2.7)-(2.9), its units, and a flow in closed form of its own.

    rod -> equations -> units        in symbols, from first principles
    modes -> flow -> arrays          in numbers: the kernel that ``systems.kernels`` plugs in

The package offers the names of ``equations``, and loads that module at their first use, since the kernel follows a
scene without symbols. Source: N. A. Fufaev, Dynamics of the system in the Painlevé-Klein example, Mechanics of Solids
(1991), in Russian.
"""

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
