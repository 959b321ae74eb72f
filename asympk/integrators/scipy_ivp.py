"""RK45, DOP853, Radau, BDF and LSODA of scipy, stepped one by one."""

from collections.abc import Sequence

from asympk.automaton.automaton import NumericMode
from asympk.automaton.loop import Segment
from asympk.integrators.integrate import Limits
from asympk.integrators.stepwise import field_and_start, follow_steps

CLASSES = {"rk45": "RK45", "dop853": "DOP853", "radau": "Radau", "bdf": "BDF", "lsoda": "LSODA"}
EXPLICIT = ("rk45", "dop853")


def advance(
    method: str,
    mode: NumericMode,
    t: float,
    state: tuple[float, ...],
    until: float,
    rtol: float,
    atol: float,
    limits: Limits,
    times: Sequence[float],
) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``, looking in at ``times``."""
    return follow_steps(_solver(method, mode, t, state, until, rtol, atol), mode, t, state, limits, times)


def _solver(method, mode, t, state, until, rtol, atol):
    import numpy as np
    from scipy import integrate

    field, start, jacobian = field_and_start(mode, t, state)
    p, n, jac = mode.p, len(start), {}
    if jacobian and method not in EXPLICIT:
        jac = {"jac": lambda t, w: np.reshape(jacobian(t, *w.tolist(), *p), (n, n))}
    make = getattr(integrate, CLASSES[method])
    solver = make(lambda t, w: field(t, *w.tolist(), *p), t, start, until, rtol=rtol, atol=atol, **jac)
    solver.made = 1
    return solver
