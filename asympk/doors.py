"""Doors: methods of a class whose code lies in modules that import this class.

Imports go one way, so ``Path`` cannot import the module that draws a path; yet a user expects ``path.plot()``. Such a
method is one line that calls ``through`` with a name of ``DOORS``, and the module is loaded only when the method is
called. The table ``DOORS`` holds all exceptions to the arrow of imports, and a test follows each of them.
"""

from importlib import import_module
from typing import Any

# noun.method -> module of asympk and the function there, whose first argument is the noun (or its class)
DOORS = {
    "Path.plot": ("pictures.paths", "plot"),
    "Path.frame": ("pictures.trace", "frame"),
    "Path.to_csv": ("pictures.trace", "write_csv"),
    "Path.physical": ("systems.painleve_klein.units", "physical"),
    "Path._repr_html_": ("pictures.paths", "html"),
    "Many.plot": ("pictures.crowd", "plot"),
    "ParadoxSet.plot": ("pictures.rigid", "paradox_plot"),
    "Scene.physical": ("systems.painleve_klein.units", "scene"),
}


def through(door: str, *arguments: Any, **options: Any) -> Any:
    """Call the function that ``DOORS`` names for ``door``, such as ``"Path.plot"``, and return its result."""
    module, name = DOORS[door]
    return getattr(import_module(f"asympk.{module}"), name)(*arguments, **options)
