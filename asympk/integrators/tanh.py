"""The customary smooth way: friction regularised to tanh(z / eps)."""

from math import cosh, tanh

from asympk.errors import InputError
from asympk.integrators.onefield import follow, friction_field
from asympk.numbers import number


def run(scene, method="tanh", *, rtol=1e-6, atol=None, eps=None, solver="radau", steps=20_000, seconds=60.0):
    """Follow ``scene`` with F = -(sigma + 2) |s| tanh(z / eps); ``eps`` is ``rtol`` by default.

    The stick phase becomes a creep with |z| < eps, an error that no tolerance of the solver removes.
    """
    eps = float(number("eps", rtol if eps is None else eps))
    if eps <= 0:
        raise InputError(f"eps = {eps:g}: the width of the regularised friction law must be positive")

    def slope(z):
        return 1 / (eps * cosh(min(abs(z) / eps, 300.0)) ** 2)

    field = friction_field(scene, lambda z: tanh(z / eps), slope)
    return follow(scene, method, field, solver, rtol, atol, steps, seconds, eps=eps)
