"""Dense output of a run in closed form: the state at any time, or at an array of times."""

from typing import Any

import numpy as np

from asympk.affine.functions import Arrays, functions
from asympk.numbers import Number
from asympk.path import ClosedForm, times_within


class AffineDense(ClosedForm):
    """The state of a solved scene as a function of time."""

    __slots__ = ()

    def __call__(self, t: Any) -> Any:
        if self.digits is None and self.convert is float:
            return self._states(times_within(t, self.scene.until))
        return super().__call__(t)

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

    def state_within(self, timed: Any, t: Number) -> np.ndarray:
        return timed.segment.state(t)[: len(self.scene.names)]
