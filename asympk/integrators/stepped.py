"""``method="exact"`` where no closed form is known: a stiff integrator of small tolerance, or collocation."""

from typing import Any

from asympk.integrators import collocation, integrate
from asympk.path import Path

INTEGRATOR = "lsoda"
TOLERANCE = 1e-10
UNBOUNDED = 1e12  # seconds


def run(
    scene: Any, method: str = "exact", *, digits: int | None = None, events: int = 1000, seconds: float = UNBOUNDED
) -> Path:
    """Follow ``scene`` by LSODA with rtol = atol = 1e-10, or by collocation right to ``digits`` digits.

    ``path.model`` names what was used; ``seconds`` bounds the time. Raises ``Unfinished``, ``Accumulation``,
    ``NoMotion``, ``TwoMotions`` and what ``collocation.run`` raises.
    """
    if digits is not None:
        return collocation.run(scene, digits=digits, events=events, seconds=seconds)
    return integrate.run(scene, INTEGRATOR, rtol=TOLERANCE, seconds=seconds, events=events)
