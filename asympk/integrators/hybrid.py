r"""From a symbolic System with dry friction to a Problem that integrators follow.

The three modes differ by the friction force alone, which enters linearly. With A, B, S the right-hand sides of
slip_same, slip_opposite and stick, every mode is

    (A + B)/2 + a (B - A)/2 + w (S - (A + B)/2),      (a, w) = (-1, 0), (1, 0), (0, 1),

one text with two numbers (a, w) that tell the modes apart: what compiles has to compile it once.
"""

import re
from functools import lru_cache
from types import SimpleNamespace

import mpmath
import sympy as sp

from asympk.errors import InputError
from asympk.integrators.piecewise import Problem
from asympk.symbolic.lowering import lower

_A, _W = sp.symbols("mode_a mode_w", real=True)
_WEIGHTS = {"slip_same": (-1.0, 0.0), "slip_opposite": (1.0, 0.0), "stick": (0.0, 1.0)}
_POWER = re.compile(r"\b([A-Za-z_]\w*)\*\*([2-9])\b")
_ANY_NUMBERS = SimpleNamespace(sqrt=lambda value: value**0.5)  # floats, tracers and expressions alike


def problem(system, values, number=float):
    """Return ``system`` with numbers for its parameters, ``{symbol: number}``, as a ``Problem``.

    The system has one slow state besides the velocity and one fast state, and no function but square roots. With
    ``number=mpmath.mpf`` the problem is one of mpmath numbers at the working precision of every call. Raises
    ``InputError`` for another shape and for missing parameters.
    """
    if system.friction is None or len(system.modes[0].slow) != 2 or len(system.modes[0].fast) != 1:
        raise InputError("an integrator of pieces needs a system with friction, one slow and one fast state")
    parameters = tuple(sorted(values, key=str))
    numbers = tuple(number(values[s]) for s in parameters)
    weights = {mode: (*pair, *numbers) for mode, pair in _WEIGHTS.items()}
    target = "math" if number is float else "mpmath"
    *functions, static = _functions(system, parameters, target)
    return Problem(*functions, lambda phase: weights[phase.mode], static(0, 0, 0, weights["stick"])[0])


@lru_cache(maxsize=16)
def _functions(system, parameters, target):
    """Return (rhs, jac, load, drive) as functions of (x, y, z, p), p being (a, w) and the parameters."""
    states = (*(s for s in system.modes[0].slow if s != system.friction.velocity), *system.modes[0].fast,
              system.friction.velocity)
    slow = {mode.name: {**mode.slow, **{y: g / system.small for y, g in mode.fast.items()}} for mode in system.modes}
    rhs = [_blend(*(slow[name][s] for name in _WEIGHTS)) for s in states]
    jacobian = sp.Matrix(rhs).jacobian(states)
    arguments = (*states, _A, _W, *parameters)
    rows = _compiled(arguments, list(jacobian), target)
    friction = system.friction
    load, drive, static = (_compiled(arguments, [e], target) for e in (friction.load, friction.drive, friction.static))
    return (
        _compiled(arguments, rhs, target),
        lambda x, y, z, p: (lambda v: (v[:3], v[3:6], v[6:]))(rows(x, y, z, p)),
        lambda x, y, z, p: load(x, y, z, p)[0],
        lambda x, y, z, p: drive(x, y, z, p)[0],
        static,
    )


def _blend(same, opposite, stick):
    middle = sp.expand((same + opposite) / 2)
    return middle + _A * sp.expand((opposite - same) / 2) + _W * sp.expand(stick - middle)


def _compiled(arguments, outputs, target):
    """Return ``f(x, y, z, p)``; the text that the ``math`` target emits serves whatever has arithmetic and powers.

    Whole powers of symbols become products: the recurrence that Taylor series use for a power divides by its base.
    """
    lowered = lower(arguments, outputs, target=target)
    space = {"math": _ANY_NUMBERS, "mpmath": mpmath}
    exec(_POWER.sub(lambda found: f"({'*'.join([found[1]] * int(found[2]))})", lowered.source), space)
    function = space[lowered.name]
    return lambda x, y, z, p: function(x, y, z, *p)
