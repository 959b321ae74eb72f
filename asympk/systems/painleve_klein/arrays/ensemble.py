r"""The exact flow of many trajectories: arrays in, arrays out.

    rows of the arguments -> common itineraries, by branch-free kernels (``itineraries``)
                          -> the others, by the exact flow over arrays (``safeguarded``)
                          -> doubtful ones, one by one by the scalar flow (``flow.exact``)

The rows are followed in chunks, so that the memory in use, apart from the result, does not grow with their number. The
result of a trajectory depends on its own numbers alone: it is the same bit for bit however rows are grouped. A
trajectory that no flow can follow to its end is left out, and its ``outcome`` says why.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from math import prod
from typing import Any, NamedTuple

import numpy as np

from asympk.errors import InputError, TooLarge, TooManyEvents, Undecided
from asympk.many import Many, axes_of, by_trajectory, outcome_of
from asympk.numbers import Number, require_finite
from asympk.path import KINDS
from asympk.systems.painleve_klein.arrays import itineraries, safeguarded
from asympk.systems.painleve_klein.arrays.branchfree import pick
from asympk.systems.painleve_klein.arrays.inputs import ORDER, scene_columns
from asympk.systems.painleve_klein.arrays.itineraries import Setting
from asympk.systems.painleve_klein.flow import exact
from asympk.systems.painleve_klein.flow.segments import MOST_EVENTS, too_many

CHUNK = 131072  # rows that are read and sorted by itinerary together
BATCH = 16384  # rows that the safeguarded flow follows together
_KINDS = np.array(KINDS)
np.empty(2**21)  # once allocated and freed, blocks of this size are reused by the C library, not mapped anew


class Events(NamedTuple):
    """Events of many trajectories, one after the other: arrays of one length, in order of time per trajectory.

    ``trajectory`` counts the trajectories in the order of ``final.reshape(3, -1)``; ``kind`` is as in ``Path``.
    """

    trajectory: np.ndarray
    kind: np.ndarray
    t: np.ndarray
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray


@dataclass(frozen=True, repr=False, eq=False)
class RodEnsemble(Many):
    """The results of many trajectories of the rod; ``Many`` describes them."""

    final: np.ndarray
    n_events: np.ndarray
    _omitted: dict = field(repr=False)
    _arguments: Any = field(repr=False)
    _events: Events | None = field(repr=False)
    names: tuple[str, ...] = ("x", "y", "z")

    def events(self) -> Events:
        """Return the ``Events``; if they were not kept, the trajectories are followed again to find them.

        Raises ``InputError`` when the arrays given to ``solve_many`` have been changed since.
        """
        if self._events is not None:
            return self._events
        total, done = int(self.n_events.sum(dtype=np.int64)), 0
        found = Events(np.empty(total, np.intp), np.empty(total, _KINDS.dtype), *(np.empty(total) for _ in "txyz"))
        for part in self.events_in_chunks(CHUNK):
            for whole, some in zip(found, part, strict=True):
                whole[done:done + some.size] = some
            done += part.t.size
        return found

    def events_in_chunks(self, rows: int = CHUNK) -> Iterator[Events]:
        """Yield the ``Events`` of ``rows`` trajectories at a time; the memory in use does not grow with their number.

        Raises ``InputError`` as ``events`` does, and for ``rows`` that are not a positive number.
        """
        if isinstance(rows, bool) or not isinstance(rows, int) or rows < 1:
            raise InputError(f"rows = {rows!r:.40}: it must be a positive whole number")
        for start in range(0, self.n_events.size, rows):
            yield self._events_of(start, min(start + rows, self.n_events.size))

    def _events_of(self, start, stop):
        if self._events is not None:
            ends = np.searchsorted(self._events.trajectory, (start, stop))
            return Events(*(values[slice(*ends)] for values in self._events))
        again = _follow(self._arguments[1], start, stop, [])
        there = self.final.reshape(3, -1)[:, start:stop], self.n_events.reshape(-1)[start:stop]
        if not all(map(partial(np.array_equal, equal_nan=True), (again.final, again.n_events), there)):
            raise InputError("the arrays given to solve_many have changed since: ask for events=True there")
        return _in_order(again.notes)

    def _at_rest(self):
        return self.final[2] == 0

    def _axes(self):
        shape, arguments = self._arguments
        return axes_of(shape, {name: arguments[name].values for name in ORDER})


def solve_many(
    sigma: Number, mu: Number, x: Number, y: Number, z: Number, until: Number, sigma0: Number | None = None,
    method: str = "exact", *, events: bool = False, progress: Callable[[int, int], None] | None = None,
    strict: bool = False,
) -> RodEnsemble:
    """Follow trajectories as ``asympk.solve_many`` does; raises ``InputError``.

    Without ``events=True``, ``RodEnsemble.events`` finds them again from the arguments, which are not copied. With
    ``strict=True``, ``TooManyEvents``, ``TooLarge`` or ``Undecided`` is raised.
    """
    shape, arguments = scene_columns(sigma, mu, x, y, z, until, sigma0)
    found = _follow(arguments, 0, prod(shape), [] if events else None, strict, progress)
    kept = _in_order(found.notes) if events else None
    final, n_events = found.final.reshape(3, *shape), found.n_events.reshape(shape)
    return RodEnsemble(final, n_events, found.omitted, (shape, arguments), kept)


def _follow(arguments, first, last, notes, strict=False, progress=None):
    size = last - first
    result = _Result(first, np.empty((3, size)), np.empty(size, dtype=np.int32), {}, notes, strict)
    waiting = np.zeros(0, dtype=np.intp)
    with np.errstate(all="ignore"):
        for start in range(first, last, CHUNK):
            stop = min(start + CHUNK, last)
            waiting = np.concatenate([waiting, _common(arguments, start, stop, result)])
            while waiting.size >= BATCH or (stop == last and waiting.size):
                _uncommon(arguments, waiting[:BATCH], result)
                waiting = waiting[BATCH:]
            if progress:
                progress(stop, last)
    return result


class _Result(NamedTuple):
    """The arrays of results, by flat index less ``first``; ``notes`` are blocks (trajectory, kind, t, x, y, z) or None.

    ``omitted`` maps the trajectories that are left out to their outcomes.
    """

    first: int
    final: np.ndarray
    n_events: np.ndarray
    omitted: dict
    notes: list | None
    strict: bool

    def note(self, offset):
        """Return the function that appends the events of rows counted from ``offset`` to ``notes``, or None."""
        if self.notes is None:
            return None
        return lambda kind, rows, *state: self.notes.append((rows + offset, KINDS.index(kind), *state))

    def put(self, rows, final, count):
        """Store the final states and the numbers of events of ``rows``."""
        rows = rows - self.first
        self.final[:, rows], self.n_events[rows] = final, count

    def leave(self, row, reason):
        """Leave out a trajectory for a reason, or raise the reason if ``strict``."""
        if self.strict:
            raise type(reason)(f"trajectory {row}: {reason}") from None
        self.put(row, np.nan, 0)
        self.omitted[row] = outcome_of(reason)


def _common(arguments, start, stop, result):
    """Follow the trajectories from ``start`` to ``stop`` on common itineraries; return the rows of the others."""
    rows = slice(start, stop)
    own = slice(start - result.first, stop - result.first)
    sigma, sigma0, mu, until = (arguments[name].rows(rows) for name in ("sigma", "sigma0", "mu", "until"))
    x, y, z = (arguments[name].array(rows) for name in "xyz")
    setting = Setting(sigma, sigma0, mu)
    others, misfits = itineraries.follow_itineraries(
        setting, x, y, z, until, result.final[:, own], result.n_events[own], result.note(start))
    alone = np.full(misfits.shape, *pick(misfits, setting.has_rare_misfits))
    _one_by_one(arguments, misfits[alone] + start, result)
    return np.concatenate([others, misfits[~alone]]) + start


def _uncommon(arguments, rows, result):
    """Follow trajectories by the safeguarded flow, and its doubtful ones by the scalar flow."""
    given = {name: arguments[name].array(rows) for name in ORDER}
    for name in "xyz":
        if not np.isfinite(given[name]).all():
            require_finite(name, arguments[name].values)
    followed = safeguarded.certain(*given.values())
    final = np.array([v.astype(float) for v in followed.final])
    doubtful = followed.doubtful | ~np.isfinite(final).all(axis=0)
    endless = ~doubtful & (followed.n_events > MOST_EVENTS)
    result.put(rows, final, followed.n_events)
    for i in np.flatnonzero(endless).tolist():
        message = too_many(given["until"][i], followed.reached[i], *(v[i] for v in followed.final))
        result.leave(int(rows[i]), TooManyEvents(message))
    if result.notes is not None:
        known = ~(doubtful | endless)[followed.events[0]]
        trajectory, kind, *state = (v[known] for v in followed.events)
        result.notes.append((rows[trajectory], kind, *(v.astype(float) for v in state)))
    _one_by_one(arguments, rows[doubtful], result)


def _one_by_one(arguments, rows, result):
    """Follow trajectories by the scalar flow of ``flow.exact``."""
    if not rows.size:
        return
    columns = (arguments[name].array(rows).tolist() for name in ORDER)
    for row, *numbers in zip(rows.tolist(), *columns, strict=True):
        try:
            segments, *_ = exact.followed_in_doubles(exact.RodNumbers(*numbers, None))
        except (TooManyEvents, TooLarge, Undecided) as reason:
            result.leave(row, reason)
        else:
            _put(segments, row, result)


def _put(segments, row, result):
    x, y, _, z, _ = segments[-1].end
    result.put(row, (x, y, z), len(segments) - 1)
    if result.notes is not None and len(segments) > 1:
        kinds = np.array([KINDS.index(segment.kind) for segment in segments[:-1]])
        events = ((after.start, *segment.end) for segment, after in pairwise(segments))
        t, x, y, _, z, _ = map(np.array, zip(*events, strict=True))
        result.notes.append((np.full(kinds.size, row), kinds, t, x, y, z))


def _in_order(notes):
    """Return the ``Events`` from blocks that already have the events of each trajectory in order of time."""
    empty = [np.zeros(0, np.intp), np.zeros(0, np.intp), *([np.zeros(0)] * 4)]
    trajectory, kind, *state = by_trajectory(empty, (np.broadcast_arrays(*block) for block in notes))
    return Events(trajectory, _KINDS[kind], *state)
