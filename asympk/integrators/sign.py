"""The customary crude way: one right-hand side with sign(v) in it, given to a general-purpose solver."""

import sympy as sp

from asympk.integrators.onefield import follow


def run(scene, method="sign", *, rtol=1e-6, atol=None, solver="lsoda", steps=20_000, seconds=60.0):
    """Follow ``scene`` with F = -kinetic |load| sign(v): right until it sticks, where it chatters."""
    return follow(scene, method, sp.sign, solver, rtol, atol, steps, seconds)
