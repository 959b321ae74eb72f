r"""What switches by the time alone: a ``Piecewise`` pulse, a step, a ramp that ends, a saw-tooth, a square wave.

A rate is not smooth there, and an integrator whose steps grow in between would step over a pulse. A switch is a phase,
linear in the time, that passes 0, or any whole number.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import sympy as sp

from asympk.symbolic.sides import switching_parts

_WHOLE = (sp.floor, sp.ceiling, sp.frac)
_SWITCHING = (*_WHOLE, sp.Mod, sp.Abs, sp.sign, sp.Heaviside, sp.Max, sp.Min, sp.core.relational.Relational)


class Switch(NamedTuple):
    """A phase, linear in the time, and whether it switches at every whole number, or at 0 alone."""

    phase: sp.Expr
    every: bool


def switches(exprs: Iterable[sp.Basic], time: sp.Symbol | None, parameters: Iterable[sp.Symbol]) -> list[Switch]:
    """Return the switches of expressions, as far as their phases are linear in the time."""
    if time is None:
        return []
    known = {time, *parameters}
    found = [switch for atom in sp.Tuple(*exprs).atoms(*_SWITCHING) for switch in _of(atom)]
    timed = (switch for switch in found if time in switch.phase.free_symbols <= known)
    return sorted({switch for switch in timed if not switch.phase.diff(time).has(time)}, key=str)


def _of(atom: sp.Basic) -> Iterator[Switch]:
    if isinstance(atom, sp.Mod):
        yield Switch(atom.args[0] / atom.args[1], every=True)
    elif isinstance(atom, _WHOLE):
        yield Switch(atom.args[0], every=True)
    else:
        yield from map(_zero, switching_parts(atom))


def _zero(expr: sp.Expr) -> Switch:
    """Return where an expression vanishes; a sine or a cosine does so again and again."""
    wave = expr.as_independent(sp.sin, sp.cos, as_Add=False)[1]
    if isinstance(wave, sp.sin | sp.cos):
        return Switch(wave.args[0] / sp.pi + sp.Rational(int(isinstance(wave, sp.cos)), 2), every=True)
    return Switch(expr, every=False)
