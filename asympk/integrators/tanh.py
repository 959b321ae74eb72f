"""The customary smooth way: friction regularised to tanh(v / eps)."""

from functools import partial

import sympy as sp

from asympk.errors import InputError
from asympk.integrators.onefield import follow
from asympk.numbers import number
from asympk.symbolic.reading import exact


def run(
    scene, method="tanh", *, rtol=1e-6, atol=None, eps=None, solver="radau", steps=20_000, seconds=60.0
):
    """Follow ``scene`` with F = -kinetic |load| tanh(v / eps); ``eps`` is ``rtol`` by default.

    The stick phase becomes a creep with |v| < eps, an error that no tolerance of the solver removes.
    """
    eps = float(number("eps", rtol if eps is None else eps))
    if eps <= 0:
        raise InputError(f"eps = {eps:g}: the width of the regularised friction law must be positive")
    return follow(scene, method, partial(_direction, eps), solver, rtol, atol, steps, seconds, eps=eps)


def _direction(eps, velocity):
    return sp.tanh(velocity / exact("eps", eps))
