"""``method="slow"`` and ``"jump"`` for the scene of any system: smooth, or with friction."""

from typing import Any

from asympk.asymptotics import frictional, smooth
from asympk.path import Path


def run(scene: Any, method: str = "jump", *, order: int | None = None) -> Path:
    """Follow ``scene`` by ``"jump"`` or ``"slow"`` to ``order``: by default 1 for a smooth system, 0 with friction.

    Raises what ``smooth.run`` and ``frictional.run`` raise.
    """
    model, least = (frictional, 0) if scene.system.frictions else (smooth, 1)
    return model.run(scene, method, order=least if order is None else order)
