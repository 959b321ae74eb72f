"""Results of many trajectories at once: final states, outcomes and itineraries, whichever engine followed them."""

from abc import abstractmethod
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from asympk import errors
from asympk.doors import through
from asympk.errors import InputError
from asympk.numbers import short
from asympk.path import MODES
from asympk.shown import Card, ShownAsTable

if TYPE_CHECKING:
    from pathlib import Path as File

    from matplotlib.figure import Figure

STICK = "stick"
PHASES = (*MODES, "open", "closed")  # the phases of a friction
# the errors of a flow that does not reach the end of a trajectory, and the words for them
REFUSALS = {
    errors.TooManyEvents: "too many events",
    errors.TooLarge: "beyond the range of doubles",
    errors.Undecided: "undecided",
    errors.Accumulation: "events accumulate",
    errors.NoMotion: "no motion",
    errors.TwoMotions: "two motions",
    errors.UnboundedReaction: "unbounded reaction",
    errors.Unfinished: "unfinished",
    errors.NegativeFriction: "negative friction",
    errors.OutOfRange: "a rate is not finite",
    InputError: "refused",
}
# the outcomes of a trajectory in words; ``outcome`` is an index of this tuple
OUTCOMES = ("followed", *REFUSALS.values())


def outcome_of(reason: Exception) -> int:
    """Return the index in ``OUTCOMES`` of an error that is listed in ``REFUSALS``."""
    return next(k for k, kind in enumerate(REFUSALS, start=1) if isinstance(reason, kind))


class Itineraries(NamedTuple):
    """The ``sequences`` of events that occur, the most frequent first, and the ``index`` of that of each trajectory.

    A sequence consists of kinds of events. It ends with "stick" if the trajectory is at rest at the end. ``index`` has
    the broadcast shape of the arguments.
    """

    sequences: tuple[tuple[str, ...], ...]
    index: Any

    @property
    def counts(self) -> tuple[int, ...]:
        """The number of trajectories with each of the sequences."""
        return tuple(np.bincount(self.index.ravel(), minlength=len(self.sequences)).tolist())


class Many(ShownAsTable):
    """The results of many trajectories: ``names``, ``final`` (n, ...), ``n_events``, ``outcome`` and ``events()``.

    ``n_events`` and ``outcome`` have the broadcast shape (...). ``outcome`` is an index of the words ``outcomes``; 0 is
    "followed". For every other outcome ``final`` is NaN, ``n_events`` is 0 and there are no events.
    """

    outcomes = OUTCOMES

    names: tuple[str, ...]
    final: Any
    n_events: Any
    _omitted: dict[int, int]

    @cached_property
    def outcome(self) -> Any:
        """The outcome of each trajectory, an index of ``outcomes``."""
        found = np.zeros(self.n_events.size, dtype=np.uint8)
        found[list(self._omitted)] = list(self._omitted.values())
        return found.reshape(self.n_events.shape)

    @abstractmethod
    def events(self) -> Any:
        """Return the events: arrays ``trajectory``, ``kind``, ``t``, in order of time per trajectory."""

    def itineraries(self) -> Itineraries:
        """Return the sequences of events that occur, and which of them each trajectory has."""
        flat = self.n_events.ravel()
        kinds = self.events().kind
        ends = np.cumsum(flat)
        rest = self._at_rest().ravel()
        sequences = [(*kinds[end - count : end].tolist(), *[STICK] * bool(still))
                for end, count, still in zip(ends.tolist(), flat.tolist(), rest.tolist(), strict=True)]
        found = Counter(sequences)
        order = sorted(found, key=lambda sequence: (-found[sequence], len(sequence), sequence))
        place = {sequence: k for k, sequence in enumerate(order)}
        index = np.array([place[sequence] for sequence in sequences], dtype=np.intp)
        return Itineraries(tuple(order), index.reshape(self.n_events.shape))

    def plot(self, file: "str | File | None" = None) -> "Figure":
        """Draw the itineraries over two arguments that vary along one axis each, or otherwise the final states.

        Raises ``InputError`` for another kind of file than .pdf, .svg or .png, ``MissingPackage`` without matplotlib.
        """
        return through("Many.plot", self, file)

    def _at_rest(self) -> Any:
        """Return which trajectories are at rest at the end; by default none, as this is not known."""
        return np.zeros(self.n_events.shape, dtype=bool)

    @abstractmethod
    def _axes(self) -> tuple[tuple[str, Any], ...]:
        """Return (name, values) of the argument that varies along each axis, else the count along the axis."""

    def _card(self) -> Card:
        size, outcome = self.n_events.size, self.outcome.ravel()
        rows = [("shape", str(self.n_events.shape))]
        lost = ((word, (outcome == k).sum()) for k, word in enumerate(OUTCOMES) if k)
        rows += [(word, f"{count} of {size}") for word, count in lost if count]
        if (followed := outcome == 0).any():
            events, final = self.n_events.ravel()[followed], self.final.reshape(len(self.names), -1)[:, followed]
            rows += [("events", f"{events.min()} to {events.max()}, {events.sum()} in all")]
            rows += [(name, f"from {values.min():z.6g} to {values.max():z.6g} at the end")
                     for name, values in zip(self.names, final, strict=True)]
        return Card(f"{size} {'trajectory' if size == 1 else 'trajectories'}", tuple(rows))


def by_trajectory(empty: Iterable[Any], blocks: Iterable[Sequence[Any]]) -> list[Any]:
    """Return the arrays of ``blocks`` of events joined to ``empty`` ones and sorted by the first, the trajectory.

    In the blocks the events of each trajectory are in order of time already.
    """
    joined = [np.concatenate(parts, axis=-1) for parts in zip(empty, *blocks, strict=True)]
    order = np.argsort(joined[0], kind="stable")
    return [part[..., order] for part in joined]


def require_mappings(**given: Any) -> None:
    """Raise ``InputError`` for an argument, given by its name, that is no mapping to numbers or arrays."""
    for name, entries in given.items():
        if not hasattr(entries, "items"):
            raise InputError(f"{name} = {short(entries)}: give a mapping from symbols or names to numbers or arrays")


def axes_of(shape: tuple[int, ...], arguments: dict[str, Any]) -> tuple[tuple[str, Any], ...]:
    """Return, for each axis, (name, values) of the first argument that varies along this axis only, or the count."""
    found = []
    for k, size in enumerate(shape):
        wide = tuple(size if axis == k else 1 for axis in range(len(shape)))
        varying = (name for name, values in arguments.items()
                if (1,) * (len(shape) - values.ndim) + values.shape == wide and size > 1)
        name = next(varying, None)
        found.append((name, arguments[name].ravel()) if name else (f"axis {k}", np.arange(size)))
    return tuple(found)
