r"""Switches by the time alone: a ``Piecewise`` pulse, a step, a ramp that ends, a sawtooth, a root.

The rates are not smooth at a switch, and an integrator whose steps have grown since the last one would step over a
pulse. A switch occurs where a phase, linear in the time, passes 0, or any whole number.
"""

from collections.abc import Collection, Iterable, Iterator
from functools import lru_cache
from typing import NamedTuple

import sympy as sp

from asympk.symbolic.derivatives import is_bent
from asympk.symbolic.long import atoms
from asympk.symbolic.sides import SWITCHING, WHOLE, phase_of, phases, switching_parts
from asympk.symbolic.system import System

WIDEST = 2  # power of a wave that is a wave itself
_JUMPING = (*SWITCHING, sp.Pow, sp.core.relational.Relational)


class Switch(NamedTuple):
    """A phase, linear in the time, and whether the rates switch at each of its whole values, or at 0 alone.

    At a ``root`` they do not jump.
    """

    phase: sp.Expr
    every: bool
    root: bool = False


class Middle(NamedTuple):
    """A phase at whose zero a bump may have its middle; of ``bumps`` in a wave, at each of its whole values.

    The phase of a wave counts the quarter turns of its ``angle``; without a wave there is none.
    """

    phase: sp.Expr
    angle: sp.Expr | None = None
    bumps: tuple[sp.Expr, ...] = ()

    @property
    def every(self) -> bool:
        """Whether bumps may have their middles at each whole value of the phase."""
        return self.angle is not None

    @property
    def side(self) -> sp.Expr:
        """The sign of the phase, or its whole part: it differs at the ends of a step that passes a middle."""
        return sp.floor(self.phase) if self.every else sp.sign(self.phase)


@lru_cache(maxsize=256)
def switches_of(system: System, sideless: bool = False) -> tuple[Switch, ...]:
    """Return the switches of a system by the time alone; if ``sideless``, those for whose sides a run has no modes."""
    but = phases(system.expressions, (), system.time) if sideless else ()
    return tuple(switches(system.expressions, system.time, system.parameters, but))


@lru_cache(maxsize=256)
def slopes_and_phases(known: tuple[Switch, ...], time: sp.Symbol) -> tuple[sp.Expr, ...]:
    """Return the slope in time and the phase of every switch, one after the other."""
    return tuple(e for switch in known for e in (switch.phase.diff(time), switch.phase))


@lru_cache(maxsize=256)
def peaks_of(system: System) -> tuple[Switch, ...]:
    """Return the possible middles of smooth bumps in time, which a long step could miss, as ``Switch``.

    A bump such as exp(-100 (t - 5)^2), a resonance or a steep ramp has its middle where an argument linear in the time
    vanishes, or where a square has its vertex.
    """
    known, time = {system.time, *system.parameters}, system.time
    parts = atoms(sp.Tuple(*system.expressions), sp.Pow, sp.Add, sp.Function) if time else ()
    timed = (part for part in parts if time in part.free_symbols <= known and not isinstance(part, sp.sin | sp.cos))
    middles = {part.diff(time) if part.is_Add else part.args[0] for part in timed}
    lines = (e for e in middles if isinstance(e, sp.Expr) and e.has(time) and not e.diff(time).has(time))
    return tuple(sorted((Switch(line, every=False) for line in lines), key=str))


def middles_of(exprs: Iterable[sp.Expr], states: Collection[sp.Symbol], time: sp.Symbol | None) -> tuple[Middle, ...]:
    """Return the possible middles of smooth bumps.

    A bump along a state, such as exp(-100 (x - 5)^2), or a steep ramp, has its middle where an argument vanishes, or
    where a square has its vertex; one in a wave, such as cos(x)^100, at a quarter turn. Those of lines in the time
    alone are ``peaks_of`` the system.
    """
    bumps = [part for part in atoms(sp.Tuple(*exprs), sp.Pow, sp.Function) if _is_bump(part)]
    waves = {bump: {wave.args[0] for wave in atoms(bump, sp.sin, sp.cos)} for bump in bumps}
    moving, found = {*states, time} - {None}, set[Middle]()
    for part in atoms(sp.Tuple(*bumps), sp.Pow, sp.Add, sp.Function):
        moved = sorted(part.free_symbols & moving, key=str)
        middle = part.args[0] if not part.is_Add else part.diff(moved[0]) if len(moved) == 1 else sp.S.Zero
        if not isinstance(middle, sp.Expr) or middle.is_Pow or not middle.free_symbols & moving:
            continue
        bent = is_bent((middle,), tuple(moving))
        if isinstance(part, sp.sin | sp.cos):
            own = tuple(bump for bump in bumps if middle in waves[bump])
            found |= set() if bent else {Middle(2 * middle / sp.pi, middle, own)}
        elif middle.is_polynomial(*moving) and (bent or middle.free_symbols & {*states}):
            found.add(Middle(phase_of(middle)[0]))
    return tuple(sorted(found, key=str))


def _is_bump(part: sp.Expr) -> bool:
    """Tell whether an expression may be that of a narrow bump: no low power, no wave and no switch."""
    if isinstance(part, sp.Pow):
        return not part.exp.is_Integer or bool(part.exp.is_negative) or part.exp > WIDEST
    return not isinstance(part, (sp.sin, sp.cos, sp.Piecewise, *SWITCHING))


def switches(
    exprs: Iterable[sp.Basic], time: sp.Symbol | None, parameters: Iterable[sp.Symbol], but: Collection[sp.Expr] = ()
) -> list[Switch]:
    """Return the switches of expressions whose phases are linear in the time, without the phases ``but``."""
    if time is None:
        return []
    known = {time, *parameters}
    found = [switch for atom in atoms(sp.Tuple(*exprs), *_JUMPING) for switch in _of(atom, but)]
    timed = (switch for switch in found if time in switch.phase.free_symbols <= known)
    return sorted({switch for switch in timed if not switch.phase.diff(time).has(time)}, key=str)


def _of(atom: sp.Basic, but: Collection[sp.Expr]) -> Iterator[Switch]:
    if isinstance(atom, sp.Pow):  # where a root vanishes, its slope is infinite
        root = atom.exp.is_positive and not atom.exp.is_integer
        yield from (_zero(factor)._replace(root=True) for factor in sp.Mul.make_args(atom.base) if root)
        return
    parts = switching_parts(atom)
    if isinstance(atom, WHOLE):
        yield from (Switch(part, every=True) for part in parts)
    else:
        yield from (_zero(part) for part in parts if phase_of(part)[0] not in but)


def _zero(expr: sp.Expr) -> Switch:
    """Return the switch at the zeros of an expression; for a sine or a cosine, at every whole value of a phase."""
    wave = expr.as_independent(sp.sin, sp.cos, as_Add=False)[1]
    if isinstance(wave, sp.sin | sp.cos):
        return Switch(wave.args[0] / sp.pi + sp.Rational(int(isinstance(wave, sp.cos)), 2), every=True)
    return Switch(expr, every=False)
