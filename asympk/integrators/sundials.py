"""CVODE (BDF) of SUNDIALS through scikit-sundae, stepped one by one; its own interpolation is the dense output."""

import os
from collections.abc import Callable
from functools import partial
from math import inf

import numpy as np

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.integrators.integrate import Settings, missing
from asympk.integrators.stepwise import PARTS, field_and_start, follow_steps

os.environ.setdefault("SUNLOGGER_WARNING_FILENAME", os.devnull)  # else stdout; what it warns of is told by the segment
MOST_TRIES = 100_000  # internal steps that CVODE may take for one call


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    return follow_steps(CvodeSteps(mode, t, state, until, settings), mode, t, state, settings)


class CvodeSteps:
    """The steps of CVODE to ``until``, as a solver of ``stepwise``."""

    made = 1

    def __init__(self, mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings):
        try:
            from sksundae.cvode import CVODE
        except ImportError as error:
            raise missing(settings.method) from error
        field, start, jacobian = field_and_start(mode, t, state)
        p, jac = mode.p, {}

        def rhs(t, w, dw):
            dw[:] = field(t, *w.tolist(), *p)

        if jacobian:
            n = len(start)
            jac = {"jacfn": lambda t, w, dw, rows: np.copyto(rows, np.reshape(jacobian(t, *w.tolist(), *p), (n, n)))}
        self.make = partial(CVODE, rhs, rtol=settings.rtol, atol=settings.atol, max_num_steps=MOST_TRIES, **jac)
        self.until, self.nfev, self.njev = until, 0, 0
        self._begin(t, np.array(start, dtype=float))

    def _begin(self, t: float, state: np.ndarray, longest: float = 0, due: float = inf) -> None:
        """Begin at a time and state with steps up to ``longest``, 0 for any, and from the time ``due`` on with any."""
        self.solver, self.due, self.spent = self.make(max_step=longest), due, (self.nfev, self.njev)
        self.solver.init_step(t, state)
        self.t_old, self.t, self.y, self.status = t, t, state, "running"

    def step(self) -> str | None:
        """Make one step; return why it failed, or None."""
        if self.t >= self.due:
            self._begin(self.t, self.y)
        self.before, begin = (self.t, self.y), self.t
        found = self.solver.step(self.until, method="onestep", tstop=self.until)
        if found.success and found.t == begin:  # after a call for dense output, CVODE first returns the last step again
            found = self.solver.step(self.until, method="onestep", tstop=self.until)
        self.t_old, self.t, self.y = begin, float(found.t), found.y
        self.nfev, self.njev = self.spent[0] + found.nfev, self.spent[1] + found.njev
        self.status = "failed" if not found.success else "finished" if self.t >= self.until else "running"
        return None if found.success else found.message

    def again(self) -> None:
        """Go back to before the last step, to make it in eight or more."""
        self._begin(*self.before, longest=(self.t - self.before[0]) / PARTS, due=self.t)

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """Return the state as a function of the time within the last step."""

        def at(t):
            edge = min(max(t, self.t_old), self.t)
            if beyond := t - edge:  # CVODE would fail, or step on
                return 3 * at(edge) - 3 * at(edge - beyond) + at(edge - 2 * beyond)
            return self.y if t == self.t else self.solver.step(t, method="normal").y

        return at
