"""``method="exact"`` where no closed form is known: a stiff integrator of small tolerance, or collocation."""

from typing import Any

from asympk.integrators import collocation, integrate
from asympk.integrators.growth import require_kept
from asympk.numbers import whole
from asympk.path import Path
from asympk.systems.automata import automaton_of

INTEGRATOR = "lsoda"
TOLERANCE = 1e-10
STEPS = 100_000
UNBOUNDED = 1e12  # seconds


def run(
    scene: Any, method: str = "exact", *, digits: int | None = None, events: int = 1000, seconds: float = UNBOUNDED
) -> Path:
    """Follow ``scene`` by LSODA with rtol = atol = 1e-10, or by collocation right to ``digits`` digits.

    ``path.model`` names what was used; ``seconds`` bounds the time. Raises ``Undecided`` where errors of the run may
    have grown as large as its end, ``Unfinished``, ``Accumulation``, ``NoMotion``, ``TwoMotions`` and what
    ``collocation.run`` raises.
    """
    if digits is not None:
        return collocation.run(scene, digits=digits, events=events, seconds=seconds)
    steps, seconds = integrate.bounds(STEPS, seconds)
    events = whole("events", events, 0, integrate.MOST_STEPS)
    path, joined = integrate.traced(scene, INTEGRATOR, rtol=TOLERANCE, atol=TOLERANCE, steps=steps, seconds=seconds,
                                    events=events)  # fmt: skip
    require_kept(automaton_of(scene), joined.segments, TOLERANCE)
    return path
