"""CVODE (BDF) of SUNDIALS through scikit-sundae, stepped one by one; its own interpolation is the dense output."""

import os
from collections.abc import Callable

import numpy as np

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.integrators.integrate import Settings, missing
from asympk.integrators.stepwise import field_and_start, follow_steps

os.environ.setdefault("SUNLOGGER_WARNING_FILENAME", os.devnull)  # else stdout; what it warns of is told by the segment
MOST_TRIES = 100_000  # internal steps that CVODE may take for one call


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    return follow_steps(CvodeSteps(mode, t, state, until, settings), mode, t, state, settings)


class CvodeSteps:
    """The steps of CVODE to ``until``, as a solver of ``stepwise``."""

    made, again = 1, None

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
        self.solver = CVODE(rhs, rtol=settings.rtol, atol=settings.atol, max_num_steps=MOST_TRIES, **jac)
        self.solver.init_step(t, np.array(start, dtype=float))
        self.t_old = self.t = t
        self.until, self.y, self.status, self.nfev, self.njev = until, np.array(start), "running", 0, 0

    def step(self) -> str | None:
        """Make one step; return why it failed, or None."""
        begin = self.t
        found = self.solver.step(self.until, method="onestep", tstop=self.until)
        if found.success and found.t == begin:  # after a call for dense output, CVODE first returns the last step again
            found = self.solver.step(self.until, method="onestep", tstop=self.until)
        self.t_old, self.t, self.y = begin, float(found.t), found.y
        self.nfev, self.njev = found.nfev, found.njev
        self.status = "failed" if not found.success else "finished" if self.t >= self.until else "running"
        return None if found.success else found.message

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """Return the state as a function of the time within the last step."""
        return lambda t: self.y if t == self.t else self.solver.step(t, method="normal").y
