"""``Path``: the trajectory that every model returns, whether exact, integrated or asymptotic, and its events."""

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from asympk.doors import through
from asympk.errors import InputError
from asympk.numbers import number, numbers, raw_entries
from asympk.shown import Card, ShownAsTable, number_as_text, shortened_rows

if TYPE_CHECKING:
    from pathlib import Path as File

    import numpy as np
    from matplotlib.figure import Figure
    from pandas import DataFrame

MODES = ("slip_same", "slip_opposite", "stick")
KINDS = ("force_zero", "velocity_zero", "slip_onset")  # those of the rod
ASYMPTOTIC = ("rigid", "slow", "jump")  # the models that leave something out
CORRECT = ("exact", "collocation")  # those whose errors lie below the digits that they return


class Event(NamedTuple):
    """A change of mode at time ``t``, with the state there.

    ``kind`` is one of the following. ``force_zero``: the load vanishes (x + y = 0 on the rod). ``velocity_zero``: the
    sliding velocity vanishes (z = 0 on the rod). ``slip_onset``: stick ends. ``lift_off``: a contact opens.
    ``touch_down``: a contact closes. ``friction`` is the index of the friction whose phase changes.
    """

    kind: str
    t: Any
    state: tuple[Any, ...]
    friction: int = 0

    @property
    def x(self) -> Any:
        """The elastic reaction of the rod, the first state."""
        return self.state[0]

    @property
    def y(self) -> Any:
        """The rate of the elastic reaction, the second state."""
        return self.state[1]

    @property
    def z(self) -> Any:
        """The velocity of the rough mass, the third state."""
        return self.state[2]


@dataclass(frozen=True, repr=False)
class Path(ShownAsTable):
    """A trajectory on [0, until]: its events in order of time, and the modes before, between and after the events.

    ``final`` is the state at ``until`` in the order of ``names``, (x, y, z) for the rod. ``modes`` is one longer than
    ``events``. Calling the path at times ``t`` gives an array of shape ``(n,) + t.shape``. ``error`` is an estimate of
    the error of ``final``, relative to the largest of 1 and the states (the rod's x and z), or None if the model gives
    none, as the limit with friction, or a named integrator. ``info`` is a mapping of further results of the model: an
    integrator gives "status", "reached", "work" and "options", and "why" if it replaces the exact flow. Paths are equal
    if their scene, model, ``final``, events, modes and ``error`` are.
    """

    scene: Any
    model: str
    final: tuple[Any, ...]
    events: tuple[Event, ...]
    modes: tuple[str, ...]
    at: Callable[[Any], Any] = field(repr=False, compare=False)
    error: Any = None
    info: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def __call__(self, t: Any) -> Any:
        return self.at(t)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the states, in the order of ``final``."""
        return self.scene.names

    @property
    def end(self) -> Any:
        """The time of ``final``: ``until``, or the time reached by a run that stopped before."""
        return self.info.get("reached", self.scene.until)

    @property
    def spans(self) -> tuple[tuple[str, float, float], ...]:
        """The modes in order, each with the times at which it begins and ends."""
        moments = 0.0, *(float(event.t) for event in self.events), float(self.end)
        return tuple(zip(self.modes, moments, moments[1:], strict=False))

    def plot(self, file: "str | File | None" = None) -> "Figure":
        """Draw every state over time, modes as shades and events as marks; return the matplotlib ``Figure``.

        With a ``file`` that ends in .pdf, .svg or .png, the figure is also written to it. Raises ``InputError`` for
        another kind of file and for a path too short for an axis, ``MissingPackage`` where matplotlib is not installed.
        """
        return through("Path.plot", self, file)

    def frame(self, samples: int | None = None) -> "DataFrame":
        """Return a pandas ``DataFrame`` with the columns t, the states, and the mode; its rows are dense at the events.

        Its numbers are doubles. It has about ``samples`` rows: by default 4000, or 400 if the path was computed with
        ``digits``. Raises ``MissingPackage`` where pandas is not installed.
        """
        return through("Path.frame", self, samples)

    def to_csv(self, file: "str | File", samples: int | None = None) -> "File":
        """Write the rows of ``frame``, in doubles, to a CSV file and return its name; pandas is not needed."""
        return through("Path.to_csv", self, file, samples)

    def physical(self) -> "Path":
        """Return the path in physical quantities, (R_1, R_1', u) over the time, of a scene that has these.

        Its ``error`` remains that of the nondimensional path.
        Raises ``InputError`` where the scene was not given in physical quantities.
        """
        return through("Path.physical", self)

    def _repr_html_(self) -> str:
        return through("Path._repr_html_", self)

    def _card(self) -> Card:
        count = f"{len(self.events)} event{'s' * (len(self.events) != 1)}"
        title = f"Path of {self.scene.name or 'a scene'} by {self.model!r}: {count}"
        begins = [("start", 0), *((event.kind, event.t) for event in self.events)]
        rows = [(f"t = {float(t):.8g}", f"{kind} -> {mode}")
                for (kind, t), mode in zip(begins, self.modes, strict=True)]
        final = [(f"{name}({float(self.end):.6g})", number_as_text(value))
                 for name, value in zip(self.names, self.final, strict=True)]
        why = [("not exact", self.info["why"])] if "why" in self.info else []
        accuracy = [("predicted error", error)] if (error := predicted_error(self)) else []
        rod = getattr(self.scene, "rod", None)
        scaled = [("nondimensional", "path.physical() has the units of the scene")] if rod is not None else []
        return Card(title, (*why, *accuracy, *scaled, *shortened_rows(rows, 5), *shortened_rows(final, 4)))


def predicted_error(path: Path) -> str:
    """Return the error that a path predicts as text, or "" if it predicts none, or only rounding."""
    return "" if path.error is None or path.model in CORRECT else f"{float(path.error):.1e}"


def within(first: Any, last: Any, until: Any) -> bool:
    """Tell whether the times from ``first`` to ``last`` lie in [0, until], with ``until`` exact or as a double."""
    return bool(first >= 0 and (last <= until or last <= float(until)))


def require_within(first: Any, last: Any, until: Any) -> None:
    """Raise ``InputError`` where times from ``first`` to ``last`` leave [0, until]."""
    if not within(first, last, until):
        wrong = float(last if first >= 0 else first)
        raise InputError(f"t = {wrong}: it must be from 0 to until = {float(until)}")


def times_within(t: Any, until: Any) -> "np.ndarray":
    """Return the times ``t`` as an array of doubles; raises ``InputError`` where they leave [0, until]."""
    times = numbers("t", t).astype(float)
    require_within(times.min(initial=0.0), times.max(initial=0.0), until)
    return times


class ClosedForm(ABC):
    """The state of a scene that ``run`` has solved, in the numbers of ``m``, as a function of time.

    Only the scene is pickled, and ``run`` solves it again on loading. A subclass defines ``state_within``, the state at
    a time after the start of one of the ``segments``; ``convert`` makes results of the numbers of ``m``.
    """

    __slots__ = ("convert", "digits", "m", "run", "scene", "segments")

    def __init__(self, run: Any, scene: Any, digits: int | None, segments: Any, convert: Any, m: Any) -> None:
        self.run, self.scene, self.digits, self.segments = run, scene, digits, segments
        self.convert, self.m = convert, m

    def __reduce__(self) -> tuple:
        return _solved, (self.run, self.scene, {"digits": self.digits})

    def __call__(self, t: Any) -> Any:
        """Return the states, an array of shape ``(n,) + t.shape``; with ``digits`` of objects, a tuple for one time."""
        starts = [segment.start for segment in self.segments]
        if self.digits is not None and (isinstance(t, str) or not hasattr(t, "__len__")):
            return self._state(t, starts)
        import numpy as np

        times, size, kind = raw_entries("t", t), len(self.scene.names), float if self.digits is None else object
        states = np.array([self._state(time, starts) for time in times.ravel()], dtype=kind)
        return states.reshape(times.size, size).T.reshape(size, *times.shape)

    def _state(self, t: Any, starts: list) -> tuple[Any, ...]:
        t = number("t", t)
        require_within(t, t, self.scene.until)
        t = self.m.number(t)
        segment = self.segments[bisect_right(starts, t) - 1]
        return tuple(map(self.convert, self.state_within(segment, t - segment.start)))

    @abstractmethod
    def state_within(self, segment: Any, t: Any) -> Any:
        """Return the state at a time ``t`` after the start of a segment."""


@dataclass(frozen=True)
class RecomputedMotion:
    """The motion ``dense`` of the path ``run(scene, **options)``; only the scene is pickled, as of ``ClosedForm``."""

    dense: Callable[[Any], Any]
    run: Any
    scene: Any
    options: Mapping[str, Any]

    def __call__(self, t: Any) -> Any:
        return self.dense(t)

    def __reduce__(self) -> tuple:
        return _solved, (self.run, self.scene, self.options)


def _solved(run: Any, scene: Any, options: Mapping[str, Any]) -> Any:
    return run(scene, **options).at
