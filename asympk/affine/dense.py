"""Dense output of a run in closed form: the state at any time, on arrays of times at once."""

from bisect import bisect_right
from typing import Any

import numpy as np

from asympk.affine.functions import Arrays, functions
from asympk.numbers import Number, number, unread
from asympk.path import ClosedForm, require_within, times_within


class AffineDense(ClosedForm):
    """The state of a solved scene as a function of time."""

    __slots__ = ()

    def __call__(self, t: Any) -> np.ndarray | tuple[Number, ...]:
        """Return an array of shape ``(n,) + t.shape``, of objects with digits; for one time and digits, a tuple."""
        one = isinstance(t, str) or not hasattr(t, "__len__")
        if self.digits is not None and one:
            return self._state(t)
        if self.digits is None and self.convert is float:
            return self._states(times_within(t, self.scene.until))
        times, size, kind = unread("t", t), len(self.scene.names), float if self.digits is None else object
        states = np.array([self._state(time) for time in times.ravel()], dtype=kind)
        return states.reshape(times.size, size).T.reshape(size, *times.shape)

    def _states(self, times):
        flat, size = times.ravel(), len(self.scene.names)
        found = np.empty((size, flat.size))
        which = np.searchsorted([timed.start for timed in self.segments], flat, side="right") - 1
        for k in np.unique(which):
            timed, mine = self.segments[k], which == k
            _, gained, begun = functions(Arrays, timed.segment.flow.blocks, flat[mine] - timed.start)
            sums, n = timed.segment.sums[:, :size], timed.segment.functions
            gained = np.stack([np.broadcast_to(part, mine.sum()) for part in gained], axis=-1)
            found[:, mine] = (gained @ sums[:n] + sums[n + begun]).T
        return found.reshape(size, *times.shape)

    def _state(self, t):
        t = number("t", t)
        require_within(t, t, self.scene.until)
        t = self.segments[0].segment.m.number(t)
        timed = self.segments[bisect_right([timed.start for timed in self.segments], t) - 1]
        return tuple(map(self.convert, timed.segment.state(t - timed.start)[: len(self.scene.names)]))
