"""CVODE (BDF) of SUNDIALS through scikit-sundae: its own root finding stops at the guards."""

from time import monotonic

from asympk.automaton.loop import Segment
from asympk.errors import AsympkError
from asympk.integrators.integrate import Work, missing

CALLS_PER_STEP = 4  # the limit on steps is kept by counting calls: CVODE makes one to three for a step


class _Stopped(AsympkError):
    """Raised inside the right-hand side to leave CVODE when a limit is reached."""


def advance(method, mode, t, state, until, rtol, atol, limits, times):
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``, looking in at ``times``."""
    import numpy as np

    last = [0, t, state]
    solver = _solver(method, mode, rtol, atol, limits, last)
    span = np.array([t, *(v for v in times if v < until), until])
    try:
        found = solver.solve(span, np.array(state))
    except _Stopped as stop:
        return Segment(last[1], tuple(last[2]), None, Work(last[0]), str(stop))
    seen = dict(zip(found.t.tolist(), found.y.tolist(), strict=True))
    hit = int(np.flatnonzero(found.i_events[0])[0]) if found.status == 2 else None
    work = Work(int(found.nfev), len(found.t) - 1 if len(span) == 2 else 0, int(found.njev))
    short = "" if found.success else f"stalled ({found.message.rstrip('.').lower()})"
    samples = tuple(tuple(seen[v]) for v in times if v in seen)
    return Segment(float(found.t[-1]), tuple(found.y[-1].tolist()), hit, work, short, samples)


def _solver(method, mode, rtol, atol, limits, last):
    try:
        from sksundae.cvode import CVODE
    except ImportError as error:
        raise missing(method) from error

    def rhs(t, w, dw):
        last[:] = last[0] + 1, t, w.tolist()
        if last[0] > CALLS_PER_STEP * limits.steps:
            raise _Stopped("step limit reached")
        if monotonic() > limits.deadline:
            raise _Stopped("time limit reached")
        dw[:] = mode.rhs(t, last[2])

    def jac(t, w, dw, rows):
        rows[:] = mode.jac(t, w.tolist())

    def guards(t, w, values):
        values[:] = mode.guard_values(t, w.tolist())

    count = len(mode.kinds)
    guards.terminal, guards.direction = [True] * count, [-1] * count
    events = {"eventsfn": guards, "num_events": count} if count else {}
    return CVODE(rhs, jacfn=jac, rtol=rtol, atol=atol, max_num_steps=100_000, **events)
