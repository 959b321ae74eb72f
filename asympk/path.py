"""Path: what every model returns, whether exact, integrated or asymptotic."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

MODES = ("slip_same", "slip_opposite", "stick")
KINDS = ("force_zero", "velocity_zero", "slip_onset")  # those of the rod


class Event(NamedTuple):
    """A change of mode at time ``t``, with the state there.

    ``force_zero``: the load vanishes (x + y = 0 on the rod); ``velocity_zero``: the sliding velocity does (z = 0);
    ``slip_onset``: stick ends; ``lift_off`` and ``touch_down``: a contact opens and closes. ``friction`` is the index
    of the friction whose phase changes.
    """

    kind: str
    t: Any
    state: tuple
    friction: int = 0

    @property
    def x(self):
        """The elastic reaction of the rod, the first state."""
        return self.state[0]

    @property
    def y(self):
        """The rate of the elastic reaction, the second state."""
        return self.state[1]

    @property
    def z(self):
        """The velocity of the rough mass, the third state."""
        return self.state[2]


@dataclass(frozen=True)
class Path:
    """A trajectory on [0, until]: events in order of time, and the mode before, between and after them.

    ``final`` is the state at ``until`` in the order of ``names``, (x, y, z) for the rod; ``modes`` is one longer than
    ``events``; calling the path at times ``t`` gives an array of shape ``(n,) + t.shape``. ``error`` is an estimate of
    the error of ``final``, relative to the largest of 1, |x|, |z|, or None when the model makes none.
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

    @property
    def names(self):
        """The names of the states, in the order of ``final``."""
        return self.scene.names
