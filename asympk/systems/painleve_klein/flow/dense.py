"""Dense output: the closed form of a path at any time."""

from bisect import bisect_right
from typing import Any

from asympk.numbers import Number, number, unread
from asympk.path import ClosedForm, require_within


class RodDense(ClosedForm):
    """The state (x, y, z) of a solved scene of the rod as a function of time."""

    __slots__ = ()

    def __call__(self, t: Number) -> Any:
        """Return an array of shape ``(3,) + t.shape``, of objects with digits; for one time and digits, a tuple."""
        starts = [solved.start for solved in self.segments]
        if self.digits is not None and (isinstance(t, str) or not hasattr(t, "__len__")):
            return self._state(t, starts)
        import numpy as np

        times = unread("t", t)
        states = [self._state(time, starts) for time in times.ravel()]
        kind = float if self.digits is None else object
        return np.array(states, dtype=kind).reshape((*times.shape, 3)).transpose(times.ndim, *range(times.ndim))

    def _state(self, t, starts):
        t = number("t", t) if self.digits is not None else float(number("t", t))
        require_within(t, t, self.scene.until)
        t = self.segments[0].segment.mode.m.number(t)
        solved = self.segments[bisect_right(starts, t) - 1]
        x, y, _, z, _ = solved.segment.state(t - solved.start)
        return tuple(map(self.convert, (x, y, z)))
