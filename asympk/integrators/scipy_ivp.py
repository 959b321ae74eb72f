"""RK45, DOP853, Radau, BDF and LSODA of scipy, stepped one by one: guards are looked at after every step."""

from time import monotonic

from asympk.integrators.integrate import Leg, Work

CLASSES = {"rk45": "RK45", "dop853": "DOP853", "radau": "Radau", "bdf": "BDF", "lsoda": "LSODA"}
EXPLICIT = ("rk45", "dop853")
STEP_LIMIT = "step limit reached"


def advance(method, piece, t, state, until, rtol, atol, limits, times):
    """Follow ``piece`` from (t, state) until a guard is lost or ``until``, looking in at ``times``."""
    solver = _solver(method, piece, t, state, until, rtol, atol)
    before, samples, steps, short, hit = piece.guard_values(state), [], 0, "", None
    start = halfway = t
    while solver.status == "running" and hit is None and not short:
        short = _step(solver, steps, limits)
        steps += not short
        halfway = solver.t if 2 * steps <= limits.steps else halfway
        t, state = solver.t, tuple(solver.y.tolist())
        after = piece.guard_values(state)
        lost = [k for k in (0, 1) if before[k] >= 0 >= after[k] and before[k] != after[k]]
        if lost and not short:
            t, hit = min((_root(piece, solver, k), k) for k in lost)
            state = tuple(solver.dense_output()(t).tolist())
        while len(samples) < len(times) and times[len(samples)] <= t and not short:
            samples.append(tuple(solver.dense_output()(times[len(samples)]).tolist()))
        before = after
    if short == STEP_LIMIT and 10 * (t - halfway) < halfway - start:
        short = f"stalled (the last {steps // 2} steps gained {t - halfway:.1g})"
    return Leg(t, state, hit, Work(int(solver.nfev), steps, int(solver.njev)), short, tuple(samples))


def _solver(method, piece, t, state, until, rtol, atol):
    from scipy import integrate

    jac = {} if method in EXPLICIT else {"jac": lambda t, w: piece.jac(t, w.tolist())}
    make = getattr(integrate, CLASSES[method])
    return make(lambda t, w: piece.rhs(t, w.tolist()), t, state, until, rtol=rtol, atol=atol, **jac)


def _step(solver, steps, limits):
    """Make one step; return what stops the run, or ""."""
    if steps >= limits.steps:
        return STEP_LIMIT
    if monotonic() > limits.deadline:
        return "time limit reached"
    from numpy import errstate

    with errstate(all="ignore"):  # the step control of scipy divides by errors that may be zero
        reason = solver.step()
    if solver.status == "failed":
        return f"stalled ({reason.rstrip('.').lower()})"
    return "" if all(v - v == 0 for v in solver.y.tolist()) else "left the range of floats"


def _root(piece, solver, k):
    from scipy.optimize import brentq

    dense, ends = solver.dense_output(), (solver.t_old, solver.t)
    value = [piece.guard_values(dense(t).tolist())[k] for t in ends]
    if value[0] <= 0 or value[1] >= 0:
        return ends[0] if value[0] <= 0 else ends[1]
    return brentq(lambda t: piece.guard_values(dense(t).tolist())[k], *ends, xtol=4e-16, rtol=9e-16)
