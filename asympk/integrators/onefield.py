"""One right-hand side for the whole motion, as customary ways have it: no modes, no guards, no events."""

from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

from asympk.errors import InputError
from asympk.integrators import scipy_ivp
from asympk.integrators.integrate import Limits, bounds, dense, endpoints, report, tolerances
from asympk.numbers import short
from asympk.path import Path
from asympk.scene import in_doubles


@dataclass(frozen=True)
class Field:
    """A field (x', y', z') and its Jacobian as functions of (t, state), with guards that are never lost."""

    rhs: Callable
    jac: Callable

    def guard_values(self, state):
        """Return values that stay positive."""
        return (1.0, 1.0)


def follow(scene, method, field, solver, rtol, atol, steps, seconds, **options):
    """Follow ``scene`` along ``field`` with one of scipy's solvers; the ``Path`` has one nameless mode."""
    if not isinstance(solver, str) or solver not in scipy_ivp.CLASSES:
        raise InputError(f"solver {short(solver)} is unknown; choose one of {', '.join(scipy_ivp.CLASSES)}")
    start, until = endpoints(scene)
    rtol, atol = tolerances(rtol, atol)
    steps, seconds = bounds(steps, seconds)

    def trace(times=()):
        limits = Limits(steps, float("inf") if times else monotonic() + seconds)
        return scipy_ivp.advance(solver, field, 0.0, start, until, rtol, atol, limits, times)

    leg = trace()
    options = {"solver": solver, "rtol": rtol, "atol": atol, "steps": steps, "seconds": seconds, **options}
    at = dense(start, leg.t, lambda times: trace(times).samples)
    return Path(scene, method, leg.state, (), ("one_field",), at, None, report(leg, leg.work, options))


def friction_field(scene, direction, slope):
    """Return the field with F = -(sigma + 2) |s| direction(z), where ``slope`` is direction'(z)."""
    sigma, _, mu = in_doubles(scene)
    bound = sigma + 2

    def rhs(t, state):
        x, y, z = state
        s = x + y
        force = -bound * abs(s) * direction(z)
        return y, (1 - 2 * s + force) / mu, 1 - s + force

    def jac(t, state):
        x, y, z = state
        s = x + y
        by_s = -bound * direction(z) * (1 if s >= 0 else -1)
        by_z = -bound * abs(s) * slope(z)
        row = (by_s - 2) / mu
        return (0.0, 1.0, 0.0), (row, row, by_z / mu), (by_s - 1, by_s - 1, by_z)

    return Field(rhs, jac)
