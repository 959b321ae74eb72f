"""``method="exact"`` for systems without a closed form: a stiff integrator of small tolerance, or collocation."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from asympk.automaton.numericmode import LONG
from asympk.errors import InputError, OutOfRange, Pole, Unfinished
from asympk.integrators import collocation, growth, integrate
from asympk.numbers import whole
from asympk.path import Path
from asympk.systems.automata import automaton_of

INTEGRATOR = "lsoda"
TOLERANCE = 1e-10
GROWN = 1e-5  # relative error at the end from which a run is repeated with ``LEAST_TOLERANCE``
LEAST_TOLERANCE = 1e-12
SMALL = 1e-4  # ratio of a state's size to its scale below which the run is repeated with a smaller atol
SMALLER = 1 / 2  # the same where the errors would be a noticeable part of the states
NOISE = 1e-7  # ratio of a state's size to that by the terms of its rate below which the state may be rounding
UNBOUNDED = 1e12  # seconds: in effect no limit


def run(
    scene: Any, method: str = "exact", *, digits: int | None = None, steps: int | None = None, events: int = 1000,
    seconds: float = UNBOUNDED,
) -> Path:
    """Follow ``scene`` by LSODA with rtol = atol = 1e-10, or, with ``digits``, by collocation to that accuracy.

    If a state stays small relative to 1, as in too large a unit, the run is repeated with atol relative to its size,
    also if the errors may otherwise have grown too large, and after a pole with atol = 1e-14. If errors may still have
    grown to 1e-5 of the final state, the run is repeated with rtol = 1e-12.
    ``path.error`` is the sum of the errors that the tolerance allows the steps, as they grow to the end; it is None
    where rates have no derivative. ``path.model`` names the integrator; ``steps`` bounds those of LSODA, ``seconds``
    the time. Raises ``InputError`` for ``steps`` with ``digits``, ``Undecided`` where errors may have grown to a
    noticeable part of the final state, or of a state well before the run stops at a pole or beyond all bounds,
    ``Pole``, ``Unfinished``, ``Accumulation``, ``NoMotion``, ``TwoMotions`` and the errors of ``collocation.run``.
    """
    if digits is not None and steps is not None:
        raise InputError(f"steps = {steps}: with digits a run is bounded by seconds and events; leave steps out")
    steps, seconds = integrate.bounds(integrate.STEPS if steps is None else steps, seconds)
    events = whole("events", events, 0, integrate.MOST_STEPS)
    if digits is not None:
        return collocation.run(scene, digits=digits, events=events, seconds=seconds)
    followed = partial(_followed, steps=steps, seconds=seconds, events=events)
    try:
        return followed(scene)
    except (Pole, Unfinished) as stop:
        if (t := _stopped_at(stop)) is not None:
            with suppress(OutOfRange, Unfinished):
                followed(replace(scene, until=(1 - LONG) * t))
        raise


def _stopped_at(stop: Pole | Unfinished) -> Any:
    """Return the time at which the motion itself stopped a run, or None where a limit on the work did."""
    if isinstance(stop, Pole):
        return stop.t
    info = stop.path.info if stop.path else {"status": ""}
    return info["reached"] if info["status"].startswith(("stalled", "left the range")) else None


def _followed(scene: Any, tolerance: float = TOLERANCE, **limits: Any) -> Path:
    """Return the path of a scene; raises ``Undecided`` and ``Unfinished`` as ``run`` does, and ``Pole``."""
    traced = partial(integrate.traced, scene, INTEGRATOR, keep=True, rtol=tolerance, **limits)
    automaton = automaton_of(scene)
    scale = 1.0
    try:
        path, joined = traced(atol=tolerance)
    except OutOfRange:  # errors of a state that dies out may have passed a pole that the motion does not pass
        path, joined = traced(atol=tolerance * (scale := SMALL))
    parts = growth.linearised(automaton, growth.without_rounding(automaton, joined.segments))
    scales, (found, sizes) = (scale,) * len(scene.start), _scales(parts)
    while True:
        fallen = min(new / old for old, new in zip(scales, found, strict=True))
        if fallen >= SMALL:
            grows = growth.growth(parts, scales, tolerance)
            factor = growth.largest_part(grows, sizes)
            if factor * tolerance <= (GROWN if tolerance > LEAST_TOLERANCE else growth.LOST):
                size = max(1.0, *map(abs, path.final))
                return replace(path, error=None if grows is None else tolerance * growth.largest_part(grows, size))
            if fallen >= SMALLER:
                if factor * LEAST_TOLERANCE <= growth.LOST:
                    return _followed(scene, LEAST_TOLERANCE, **limits)
                raise growth.grown(factor, path.info["reached"])
        path, joined = traced(atol=tuple(tolerance * scale for scale in found))
        parts = growth.linearised(automaton, growth.without_rounding(automaton, joined.segments))
        scales, (found, sizes) = found, _scales(parts)


def _scales(parts: Sequence[growth.Linearised]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return two tuples: for each state its scale, at most 1, and the size to which errors at the end are relative.

    The size is the state's largest on the run, and for a state that may be rounding, or that only such states move,
    that by the terms of its rate (``balances``); a state without any has 1. Sizes of errors at the end are at least
    ``NOISE`` times the gain from other states, so that a tiny state does not count as wrong.
    """
    own = np.abs(np.concatenate([part.states for part in parts])).max(axis=0)
    made, gains = growth.balances(parts)
    made = np.maximum(made, gains @ np.where(own <= NOISE * made, made, 0))
    sizes = np.where(own > NOISE * made, own, made)
    sizes[sizes == 0] = 1.0
    return tuple(np.minimum(1.0, sizes).tolist()), tuple(np.maximum(sizes, NOISE * (gains @ sizes)).tolist())
