r"""The exact flow of many trajectories: arrays in, arrays out.

    rows of the arguments -> common courses, by branch-free kernels
                          -> the others, by the safeguarded flow over arrays
                          -> what is left, one by one by the scalar flow

Work goes through the rows in chunks, so that beyond the result the memory in use does not grow with their number. What
happens to a trajectory depends on its own numbers alone: results are the same bit for bit however rows are grouped.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from asympk.arrays import careful, courses
from asympk.arrays.columns import ORDER, require, scenes
from asympk.arrays.courses import Setting
from asympk.errors import InputError, TooLarge, TooManyEvents
from asympk.flow import exact
from asympk.flow.legs import MOST_EVENTS
from asympk.many import Many, axes_of
from asympk.path import KINDS
from asympk.scene import Scene

CHUNK = 131072
BATCH = 16384


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
class Ensemble(Many):
    """What became of many trajectories: ``final`` (3, ...) and ``n_events`` of the broadcast shape (...)."""

    final: np.ndarray
    n_events: np.ndarray
    _job: Any = field(repr=False)
    _events: Events | None = field(repr=False)

    def events(self):
        """Return the ``Events``; where they were not kept, the trajectories are followed once more for them.

        Raises ``InputError`` when the arrays given to ``solve_many`` have been changed since.
        """
        if self._events is not None:
            return self._events
        again = _follow(self._job, keep=True, progress=None)
        if not (np.array_equal(again.final, self.final) and np.array_equal(again.n_events, self.n_events)):
            raise InputError("the arrays given to solve_many have changed since: ask for events=True there")
        return again._events

    @property
    def names(self):
        """The names of the states."""
        return ("x", "y", "z")

    def _at_rest(self):
        return self.final[2] == 0

    def _axes(self):
        shape, arguments = self._job
        return axes_of(shape, {name: arguments[name].values for name in ORDER})


def solve_many(sigma, mu, x, y, z, until, sigma0=None, method="exact", *, events=False, progress=None):
    """Follow trajectories from (x, y, z) to ``until``; all arguments broadcast. Results equal those of ``solve``.

    ``events=True`` keeps the events, else ``Ensemble.events`` finds them anew from the arguments, which are not
    copied. ``progress(done, total)`` is called after each chunk. Raises ``InputError``, ``TooManyEvents`` and
    ``TooLarge``.
    """
    return _follow(scenes(sigma, mu, x, y, z, until, sigma0), events, progress)


def _follow(job, keep, progress):
    shape, arguments = job
    size = int(np.prod(shape))
    result = _Result(np.empty((3, size)), np.empty(size, dtype=np.int32), [] if keep else None)
    waiting = np.zeros(0, dtype=np.intp)
    with np.errstate(all="ignore"):
        for start in range(0, size, CHUNK):
            stop = min(start + CHUNK, size)
            waiting = np.concatenate([waiting, _common(arguments, start, stop, result)])
            while waiting.size >= BATCH or (stop == size and waiting.size):
                _uncommon(arguments, waiting[:BATCH], result)
                waiting = waiting[BATCH:]
            if progress:
                progress(stop, size)
    kept = _in_order(result.notes) if keep else None
    return Ensemble(result.final.reshape(3, *shape), result.count.reshape(shape), job, kept)


class _Result(NamedTuple):
    """Where results go, by the flat index of the trajectory; ``notes`` are blocks (trajectory, kind, t, x, y, z)."""

    final: np.ndarray
    count: np.ndarray
    notes: list | None

    def note(self, offset):
        """Return the function that takes note of events of the rows from ``offset`` on, or None."""
        if self.notes is None:
            return None
        return lambda kind, rows, *state: self.notes.append((rows + offset, KINDS.index(kind), *state))


def _common(arguments, start, stop, result):
    """Follow those of the trajectories from ``start`` to ``stop`` that take a common course; return the others."""
    rows = slice(start, stop)
    sigma, sigma0, mu, until = (arguments[name].rows(rows) for name in ("sigma", "sigma0", "mu", "until"))
    x, y, z = (arguments[name].array(rows) for name in "xyz")
    left = courses.follow(Setting(sigma, sigma0, mu), x, y, z, until,
                          result.final[:, rows], result.count[rows], result.note(start))
    return left + start


def _uncommon(arguments, rows, result):
    """Follow trajectories by the safeguarded flow, and those that it leaves in doubt one by one."""
    given = {name: arguments[name].array(rows) for name in ORDER}
    for name in "xyz":
        if not np.isfinite(given[name]).all():
            require(name, arguments[name].values)
    story = careful.certain(*given.values())
    _require_few_events(rows, story)
    final = np.array([v.astype(float) for v in story.final])
    doubtful = story.doubtful | ~np.isfinite(final).all(axis=0)
    result.final[:, rows], result.count[rows] = final, story.count
    if result.notes is not None:
        trajectory, kind, *state = (v[~doubtful[story.events[0]]] for v in story.events)
        result.notes.append((rows[trajectory], kind, *(v.astype(float) for v in state)))
    for row in rows[doubtful].tolist():
        _alone(arguments, row, result)


def _require_few_events(rows, story):
    many = np.flatnonzero((story.count > MOST_EVENTS) & ~story.doubtful)
    if many.size:
        i = many[0]
        t, x, y, z = (float(v[i]) for v in (story.reached, *story.final))
        raise TooManyEvents(f"trajectory {rows[i]}: more than {MOST_EVENTS} events by t = {t:.6g}, where (x, y, z) = "
                            f"({x:.6g}, {y:.6g}, {z:.6g}); take a smaller until")


def _alone(arguments, row, result):
    """Follow one trajectory by the scalar flow."""
    sigma, sigma0, mu, *start, until = (arguments[name].array([row]).item() for name in ORDER)
    try:
        path = exact.run(Scene(sigma, mu, tuple(start), until, sigma0))
    except (TooLarge, TooManyEvents) as error:
        raise type(error)(f"trajectory {row}: {error}") from None
    result.final[:, row] = path.final
    result.count[row] = len(path.events)
    if result.notes is not None and path.events:
        kind, *state = zip(*path.events, strict=True)
        kinds = np.array([KINDS.index(k) for k in kind])
        result.notes.append((np.full(kinds.size, row), kinds, *(np.array(v, dtype=float) for v in state)))


def _in_order(notes):
    """Join blocks of events, in which and from each to the next the time of a trajectory grows."""
    empty = [np.zeros(0, np.intp), np.zeros(0, np.intp), *([np.zeros(0)] * 4)]
    blocks = [empty, *(np.broadcast_arrays(*block) for block in notes)]
    trajectory, kind, *state = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    order = np.argsort(trajectory, kind="stable")
    return Events(trajectory[order], np.array(KINDS)[kind[order]], *(v[order] for v in state))
