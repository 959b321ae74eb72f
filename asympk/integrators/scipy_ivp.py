"""RK45, DOP853, Radau, BDF and LSODA of scipy, stepped one by one."""

from functools import cache

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.integrators.integrate import Settings
from asympk.integrators.stepwise import field_and_start, follow_steps

CLASSES = {"rk45": "RK45", "dop853": "DOP853", "radau": "Radau", "bdf": "BDF", "lsoda": "LSODA"}
EXPLICIT = ("rk45", "dop853")


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    return follow_steps(_solver(mode, t, state, until, settings), mode, t, state, settings)


def _solver(mode, t, state, until, settings):
    import numpy as np
    from scipy import integrate

    field, start, jacobian = field_and_start(mode, t, state)
    p, n, jac = mode.p, len(start), {}
    if jacobian and settings.method not in EXPLICIT:
        jac = {"jac": lambda t, w: np.reshape(jacobian(t, *w.tolist(), *p), (n, n))}
    atol = settings.atol
    if isinstance(atol, tuple):  # guards in time are states as well, of an unknown size
        atol = (*atol, *[min(atol)] * (n - len(atol)))
    make = getattr(integrate, CLASSES[settings.method])
    solver = make(lambda t, w: field(t, *w.tolist(), *p), t, start, until, rtol=settings.rtol, atol=atol,
                  max_step=settings.longest, **jac)  # fmt: skip
    solver.made = 1
    if hasattr(solver, "solve_lu"):
        solver.lu, solver.solve_lu = _by_lapack()
    return solver


@cache
def _by_lapack():
    """Return how matrices are factored, and equations solved, by LAPACK itself.

    SciPy's checks take longer than a few states do.
    """
    import numpy as np
    from scipy.linalg import lapack

    routines = {"d": (lapack.dgetrf, lapack.dgetrs), "D": (lapack.zgetrf, lapack.zgetrs)}

    def require_finite(numbers):
        if not np.isfinite(numbers).all():
            raise ValueError("left the range of floats")

    def factored(matrix):
        require_finite(matrix)
        return routines[matrix.dtype.char][0](matrix, overwrite_a=True)[:2]

    def solution(factors, right):
        require_finite(right)
        return routines[right.dtype.char][1](*factors, right, overwrite_b=True)[0]

    return factored, solution
