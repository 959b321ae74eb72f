"""RK45, DOP853, Radau, BDF and LSODA of SciPy, stepped one by one.

Three things differ from SciPy: rates without a value are nan (``Rates``), LSODA raises its reason instead of printing
it (``Reasons``), and linear systems go to LAPACK without checks.
"""

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.integrators.integrate import Settings
from asympk.integrators.stepwise import field_and_start, follow_steps

CLASSES = {"rk45": "RK45", "dop853": "DOP853", "radau": "Radau", "bdf": "BDF", "lsoda": "LSODA"}
EXPLICIT = ("rk45", "dop853")
RESTARTS = 16  # of LSODA in one mode


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
    rates = Rates(field, p, t, start, told=settings.method == "lsoda")
    options = {"rtol": settings.rtol, "atol": atol, "max_step": settings.longest, **jac}
    solver = getattr(integrate, CLASSES[settings.method])(rates, t, start, until, **options)
    step = solver.step
    if settings.method == "lsoda":
        _with_reasons(solver)
        begin = partial(solver.__init__, rates, t_bound=until, **options)
        step = partial(_restarting, solver, step, begin, rates, [settings.longest])
    solver.step = partial(_stepped, solver, step, rates)
    solver.made = 1
    if hasattr(solver, "solve_lu"):
        solver.lu, solver.solve_lu = _by_lapack()
    return solver


class Rates:
    """The rates of a mode as a function of (t, state), which are nan where their formulas have no real value.

    The solver then tries a shorter step. At the start there is no step to shorten, and LSODA does not notice nan: in
    these two cases an error is raised (``told``: for LSODA). ``left`` records that the rates were nan.
    """

    __slots__ = ("field", "left", "nowhere", "p", "start", "told", "tried")

    def __init__(self, field: Callable[..., tuple], p: tuple, t: float, start: tuple, told: bool):
        self.field, self.p, self.start, self.told = field, p, (t, *start), told
        self.nowhere, self.left, self.tried = (math.nan,) * len(start), False, t

    def __call__(self, t: float, state: np.ndarray) -> tuple:
        """Return the rates, or nan where they are no finite real numbers."""
        self.tried = t
        try:
            return self.field(t, *state.tolist(), *self.p)
        except (ArithmeticError, ValueError):
            if self.told or (t, *state.tolist()) == self.start:
                raise
            self.left = True
            return self.nowhere


def _stepped(solver, step, rates):
    """Make one step; raises ``ValueError`` if the step fails because of nan rates, or ends where the rates are nan."""
    try:
        reason = step()
    except GaveUp as why:
        solver.status, reason = "failed", str(why)
    if rates.left:
        rates.left = False
        if solver.status == "failed" or math.isnan(rates(solver.t, solver.y)[0]):
            raise ValueError(reason)
    return reason


def _restarting(solver, step, begin, rates, longest):
    """Make one step, or begin anew, with steps up to a quarter, where LSODA tries one to where rates are not finite.

    Beyond its guard a mode may grow without bound, as friction with exp(-|v|/c) does. ``longest`` are the longest steps
    so far. Raises if the tried step gains no time, or after ``RESTARTS``.
    """
    try:
        return step()
    except (ArithmeticError, ValueError):
        if len(longest) > RESTARTS or rates.tried <= solver.t:
            raise
    longest.append(min(longest[-1], (rates.tried - solver.t) / 4))
    spent = solver.nfev, solver.njev
    begin(t0=solver.t, y0=solver.y, max_step=longest[-1])
    _with_reasons(solver)
    solver.nfev, solver.njev = (new + old for new, old in zip((solver.nfev, solver.njev), spent, strict=True))
    return _restarting(solver, step, begin, rates, longest)


def _with_reasons(solver):
    integrator = solver._lsoda_solver._integrator
    integrator.messages = Reasons(integrator.messages)


class GaveUp(Exception):
    """LSODA gives up; SciPy would print the reason as a warning."""


class Reasons(dict):
    """SciPy's messages for the failures of LSODA; looking one up, as SciPy does on failure, raises ``GaveUp``."""

    def get(self, number: int, unknown: Any = "") -> Any:
        """Raise ``GaveUp``."""
        raise GaveUp(super().get(number, unknown).partition(" (")[0])


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
