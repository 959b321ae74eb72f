"""CVODE (BDF) of SUNDIALS through scikit-sundae, stepped one by one; its own interpolation is the dense output."""

import os
from collections.abc import Callable
from functools import partial
from math import isfinite

import numpy as np

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.integrators.integrate import Settings, missing
from asympk.integrators.scipy_ivp import Rates, ScipySteps
from asympk.integrators.stepwise import field_and_start, follow_steps

os.environ.setdefault("SUNLOGGER_WARNING_FILENAME", os.devnull)  # else stdout; what it warns of is told by the segment
MOST_TRIES = 100_000  # internal steps that CVODE may take for one call


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    try:
        from sksundae.cvode import CVODE
    except ImportError as error:
        raise missing(settings.method) from error
    field, start, jacobian = field_and_start(mode, t, state)
    p, n, jac = mode.p, len(start), {}
    rates = Rates(field, p, t, start, strict=True)

    def rhs(t, w, dw):
        dw[:] = rates(t, w)

    if jacobian:
        jac = {"jacfn": lambda t, w, dw, rows: np.copyto(rows, np.reshape(jacobian(t, *w.tolist(), *p), (n, n)))}
    make = partial(CVODE, rhs, rtol=settings.rtol, atol=settings.atol, max_num_steps=MOST_TRIES, **jac)
    steps = ScipySteps(partial(Cvode, make, until), rates, t, np.array(start, dtype=float), settings.longest)
    return follow_steps(steps, mode, t, state, settings)


class Cvode:
    """CVODE with the interface of SciPy's solvers; ``make`` returns one whose steps are at most ``max_step`` long."""

    def __init__(self, make: Callable, until: float, t0: float, y0: np.ndarray, max_step: float):
        self.solver = make(max_step=max_step if isfinite(max_step) else 0)  # 0 for any
        self.solver.init_step(t0, y0)
        self.t_old, self.t, self.y, self.status = t0, t0, y0, "running"
        self.until, self.nfev, self.njev = until, 0, 0

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

        def at(t):
            edge = min(max(t, self.t_old), self.t)
            if beyond := t - edge:  # CVODE would fail, or step on
                return 3 * at(edge) - 3 * at(edge - beyond) + at(edge - 2 * beyond)
            return self.y if t == self.t else self.solver.step(t, method="normal").y

        return at
