"""Doors: what a noun offers as a method although it is built upon the noun.

Imports go one way, so a noun cannot import the pictures of it; yet a person looks for them on the noun, as in
``path.plot()``. Such a method is one line that goes through a door, a name of ``DOORS``, and its home is loaded when it
is called. All doors stand in this table: the arrow of imports has no other exception, and a test follows each one.
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
    """Call the function behind a door, such as ``"Path.plot"``."""
    module, name = DOORS[door]
    return getattr(import_module(f"asympk.{module}"), name)(*arguments, **options)
