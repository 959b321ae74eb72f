"""The customary crude way: one right-hand side with sign(z) in it, given to a general-purpose solver."""

from asympk.integrators.onefield import follow, friction_field
from asympk.integrators.piecewise import sign


def run(scene, method="sign", *, rtol=1e-6, atol=None, solver="lsoda", steps=20_000, seconds=60.0):
    """Follow ``scene`` with F = -(sigma + 2) |s| sign(z): right until it sticks, where it chatters."""
    field = friction_field(scene, sign, lambda z: 0.0)
    return follow(scene, method, field, solver, rtol, atol, steps, seconds)
