"""RK45, DOP853, Radau, BDF and LSODA of SciPy, stepped one by one.

Five things differ from SciPy: rates without a value are nan (``Rates``), LSODA raises its reason instead of printing
it (``Reasons``) and begins anew where it gets stuck, linear systems go to LAPACK without checks, and a step may be made
again (``ScipySteps``).
"""

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.integrators.integrate import Settings
from asympk.integrators.stepwise import PARTS, field_and_start, follow_steps

CLASSES = {"rk45": "RK45", "dop853": "DOP853", "radau": "Radau", "bdf": "BDF", "lsoda": "LSODA"}
EXPLICIT = ("rk45", "dop853")
RESTARTS = 16  # in one mode, of a method for which rates without a value are errors
STUCK = 100  # explicit steps of order 1 in a row, from which on LSODA begins anew


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    return follow_steps(_solver(mode, t, state, until, settings), mode, t, state, settings)


@np.errstate(all="ignore")  # SciPy chooses the first step by norms that may be infinite
def _solver(mode, t, state, until, settings):
    from scipy import integrate

    field, start, jacobian = field_and_start(mode, t, state)
    p, n, jac = mode.p, len(start), {}
    if jacobian and settings.method not in EXPLICIT:
        jac = {"jac": lambda t, w: np.array(jacobian(t, *w.tolist(), *p), dtype=float).reshape(n, n)}
    atol = settings.atol
    if isinstance(atol, tuple):  # guards that depend on the time are states as well, of an unknown size
        atol = (*atol, *[min(atol)] * (n - len(atol)))
    rates = Rates(field, p, t, start, strict=settings.method == "lsoda")
    options = {"rtol": settings.rtol, "atol": atol, **jac}
    begin = partial(getattr(integrate, CLASSES[settings.method]), rates, t_bound=until, **options)
    return ScipySteps(begin, rates, t, np.array(start, dtype=float), settings.longest)


class Rates:
    """The rates of a mode as a function of (t, state), which are nan where their formulas have no real value.

    The solver then tries a shorter step. At the start there is no step to shorten, and LSODA and CVODE do not notice
    nan: in these two cases an error is raised (``strict``: for such a method). ``undefined``: rates were nan.
    """

    __slots__ = ("field", "nowhere", "p", "start", "strict", "tried", "undefined")

    def __init__(self, field: Callable[..., tuple], p: tuple, t: float, start: tuple, strict: bool):
        self.field, self.p, self.start, self.strict = field, p, (t, *start), strict
        self.nowhere, self.undefined, self.tried = (math.nan,) * len(start), False, t

    def __call__(self, t: float, state: np.ndarray) -> tuple:
        """Return the rates, or nan where they are no finite real numbers."""
        self.tried = t
        try:
            return self.field(t, *state.tolist(), *self.p)
        except (ArithmeticError, ValueError):
            if self.strict or (t, *state.tolist()) == self.start:
                raise
            self.undefined = True
            return self.nowhere


class ScipySteps:
    """The steps of a solver with SciPy's interface, for ``stepwise``; they begin anew where shorter ones are needed."""

    made, nfev, njev = 1, 0, 0

    def __init__(self, begin: Callable, rates: Rates, t: float, start: np.ndarray, longest: float):
        self.make, self.rates, self.longest, self.restarts = begin, rates, longest, 0
        self._begin(t, start, longest)

    def _begin(self, t: float, state: np.ndarray, longest: float, due: float = math.inf) -> None:
        """Begin at a time and state with steps up to ``longest``, and from the time ``due`` on with longer ones."""
        self.solver, self.due, self.spent = self.make(t0=t, y0=state, max_step=longest), due, (self.nfev, self.njev)
        self.lowest = 0
        if hasattr(self.solver, "_lsoda_solver"):
            integrator = self.solver._lsoda_solver._integrator
            integrator.messages = Reasons(integrator.messages)
        if hasattr(self.solver, "solve_lu"):
            self.solver.lu, self.solver.solve_lu = _by_lapack()
        self.dense_output = self.solver.dense_output
        self._update()

    def _update(self) -> None:
        solver = self.solver
        self.t_old, self.t, self.y, self.status = solver.t_old, solver.t, solver.y, solver.status
        self.nfev, self.njev = self.spent[0] + solver.nfev, self.spent[1] + solver.njev

    def step(self) -> str | None:
        """Make one step; raises ``ValueError`` if the step fails because of nan rates, or ends where these are nan.

        From a slow manifold LSODA may keep to explicit steps of order 1 about as long as a layer: rounding makes up
        their estimated errors, and then it does not ask whether implicit steps would be longer.
        """
        if self.t >= self.due or self.lowest == STUCK:
            self._begin(self.t, self.y, self.longest)
        self.before, rates = (self.t, self.y.copy()), self.rates
        reason = self._made()
        self.lowest = self.lowest + 1 if _is_lowest(self.solver) else 0
        self._update()
        if rates.undefined:
            rates.undefined = False
            if self.status == "failed" or math.isnan(rates(self.t, self.y)[0]):
                raise ValueError(reason)
        return reason

    def _made(self) -> str | None:
        """Make one step, or begin anew, with steps up to a quarter, where one is tried to where rates raise an error.

        Beyond its guard a mode may grow without bound, as friction with exp(-|v|/c) does. Raises if the tried step
        gains no time, or after ``RESTARTS``.
        """
        try:
            return self.solver.step()
        except StepFailure as why:
            self.solver.status = "failed"
            return str(why)
        except (ArithmeticError, ValueError):
            ahead = self.rates.tried - self.t
            if not self.rates.strict or self.restarts == RESTARTS or ahead <= 0:
                raise
        self._update()
        self.restarts, self.longest = self.restarts + 1, min(self.longest, ahead / 4)
        self._begin(self.t, self.y, self.longest)
        return self._made()

    def again(self) -> None:
        """Go back to before the last step, to make it in eight or more."""
        self._begin(*self.before, longest=(self.t - self.before[0]) / PARTS, due=self.t)


def _is_lowest(solver):
    """Tell whether the last step was an explicit one of LSODA of order 1."""
    if not hasattr(solver, "_lsoda_solver"):
        return False
    work = solver._lsoda_solver._integrator.iwork
    return work[13] == work[18] == 1  # the order, and 1 for an explicit method


class StepFailure(Exception):
    """LSODA gives up; SciPy would print the reason as a warning."""


class Reasons(dict):
    """SciPy's messages for the failures of LSODA; looking one up, as SciPy does on failure, raises ``StepFailure``."""

    def get(self, number: int, unknown: Any = "") -> Any:
        """Raise ``StepFailure``."""
        raise StepFailure(super().get(number, unknown).partition(" (")[0])


@cache
def _by_lapack():
    """Return the functions (factor a matrix, solve equations), which call LAPACK itself.

    For few states SciPy's checks take longer. A right side that is not finite gives inf, and so a shorter step.
    """
    from scipy.linalg import lapack

    routines = {"d": (lapack.dgetrf, lapack.dgetrs), "D": (lapack.zgetrf, lapack.zgetrs)}

    def factored(matrix):
        if not np.isfinite(matrix).all():
            raise ValueError("left the range of floats")
        return routines[matrix.dtype.char][0](matrix, overwrite_a=True)[:2]

    def solution(factors, right):
        if not np.isfinite(right).all():
            return np.full_like(right, np.inf)
        return routines[right.dtype.char][1](*factors, right, overwrite_b=True)[0]

    return factored, solution
