"""Path: what every model returns, whether exact, integrated or asymptotic."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

MODES = ("slip_same", "slip_opposite", "stick")
KINDS = ("force_zero", "velocity_zero", "slip_onset")


class Event(NamedTuple):
    """A change of mode: ``force_zero`` (x + y = 0), ``velocity_zero`` (z = 0) or ``slip_onset`` (leaving stick)."""

    kind: str
    t: Any
    x: Any
    y: Any
    z: Any


@dataclass(frozen=True)
class Path:
    """A trajectory on [0, until]: events in order of time, and the mode before, between and after them.

    ``final`` is (x, y, z) at ``until``; ``modes`` is one longer than ``events``; calling the path at times ``t``
    gives an array of shape ``(3,) + t.shape`` (nondimensional). ``error`` is an estimate of the error of
    ``final``, relative to the largest of 1, |x|, |z|, or None when the model makes none.
    ``info`` is what the model tells of its own run; an integrator gives "status", "reached", "work" and "options".
    """

    scene: Any
    model: str
    final: tuple
    events: tuple[Event, ...]
    modes: tuple[str, ...]
    at: Callable = field(repr=False)
    error: Any = None
    info: Mapping = field(default_factory=dict)

    def __call__(self, t):
        return self.at(t)
