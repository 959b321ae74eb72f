"""``method="slow"`` and ``"jump"`` for the scene of any system: smooth, or with friction."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from asympk.asymptotics.frictional import follow_friction
from asympk.asymptotics.smooth import follow_smooth
from asympk.errors import AsympkError, OutOfRange
from asympk.path import Path


def run(scene: Any, method: str = "jump", *, order: int | None = None) -> Path:
    """Follow ``scene`` by ``"jump"`` or ``"slow"`` to ``order``: by default 1 for a smooth system, 0 with friction.

    Raises what ``follow_smooth`` and ``follow_friction`` raise; ``OutOfRange`` where a value is not finite.
    """
    follow, least = (follow_friction, 0) if scene.system.frictions else (follow_smooth, 1)
    with _refused(scene):
        return follow(scene, method, order=least if order is None else order)


@contextmanager
def _refused(scene: Any) -> Iterator[None]:
    """Refuse by name what leaves the range of the numbers or of a function."""
    try:
        with np.errstate(all="ignore"):
            yield
    except AsympkError:
        raise
    except (ArithmeticError, ValueError) as reason:
        at = ", ".join(f"{name} = {float(v):.6g}" for name, v in zip(scene.names, scene.start, strict=True))
        raise OutOfRange(f"the layer or the slow motion from {at} has no finite value ({reason}); "
                         "use method='exact'") from None  # fmt: skip
