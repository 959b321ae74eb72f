"""``method="exact"`` where no closed form is known: a stiff integrator of small tolerance, or collocation."""

from functools import partial
from typing import Any

from asympk.automaton.automaton import Automaton
from asympk.automaton.loop import Run
from asympk.integrators import collocation, integrate
from asympk.integrators.growth import balances, require_kept
from asympk.numbers import whole
from asympk.path import Path
from asympk.systems.automata import automaton_of

INTEGRATOR = "lsoda"
TOLERANCE = 1e-10
SMALL = 1e-4  # of its scale, a state's size from which on its errors count as large
NOISE = 1e-7  # of what a state's rate is made of, a size of the state that may be rounding
UNBOUNDED = 1e12  # seconds


def run(
    scene: Any, method: str = "exact", *, digits: int | None = None, events: int = 1000, seconds: float = UNBOUNDED
) -> Path:
    """Follow ``scene`` by LSODA with rtol = atol = 1e-10, or by collocation right to ``digits`` digits.

    Where states stay small beside 1, as in units that are too large, the run is repeated with an atol of their size.

    ``path.model`` names what was used; ``seconds`` bounds the time. Raises ``Undecided`` where errors of the run may
    have grown as large as its end, ``Unfinished``, ``Accumulation``, ``NoMotion``, ``TwoMotions`` and what
    ``collocation.run`` raises.
    """
    if digits is not None:
        return collocation.run(scene, digits=digits, events=events, seconds=seconds)
    steps, seconds = integrate.bounds(integrate.STEPS, seconds)
    events = whole("events", events, 0, integrate.MOST_STEPS)
    traced = partial(integrate.traced, scene, INTEGRATOR, keep=True, rtol=TOLERANCE, steps=steps, seconds=seconds,
                     events=events)  # fmt: skip
    automaton = automaton_of(scene)
    path, joined = traced(atol=TOLERANCE)
    scales, (found, sizes) = (1.0,) * len(scene.start), _scales(automaton, joined)
    while any(new < SMALL * old for old, new in zip(scales, found, strict=True)):
        path, joined = traced(atol=tuple(TOLERANCE * scale for scale in found))
        scales, (found, sizes) = found, _scales(automaton, joined)
    require_kept(automaton, joined.segments, TOLERANCE, scales, sizes)
    return path


def _scales(automaton: Automaton, joined: Run) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return every state's largest size on a run, at most 1, and its size by what its rate is made of, if larger.

    For one that may be rounding, or what rounding moves, both are the latter, for one without any they are 1. What is
    next to nothing beside the largest state has the size ``NOISE`` of that: its errors do not count as grown.
    """
    import numpy as np

    states = [state for segment in joined.segments for _, state in segment.steps] or [joined.last.state]
    own = [max(map(abs, column)) for column in zip(*states, strict=True)]
    made, gains = balances(automaton, joined.segments)
    made = np.maximum(made, gains @ np.where(np.array(own) <= NOISE * made, made, 0))
    sizes = [max(pair) or 1.0 for pair in zip(own, made.tolist(), strict=True)]
    kept = (size if size > NOISE * made else made for size, made in zip(own, sizes, strict=True))
    return tuple(min(1.0, size) for size in kept), tuple(max(size, NOISE * max(sizes)) for size in sizes)
