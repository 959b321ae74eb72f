r"""The affine form of a mode: ``W' = M W`` over its states, its forcing and 1, with entries in the parameters.

``form_of`` finds the form once per mode, in symbols. ``placed`` substitutes exact Fractions for the parameters. An
entry that is no rational function of the parameters is computed to as many digits as the run needs.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain

import sympy as sp

from asympk.affine.forcing import CONSTANT, Wave, rate, waves_of, with_derivatives
from asympk.affine.mode import AffineMode
from asympk.automaton.exact import exact_values
from asympk.automaton.modes import GuardedMode
from asympk.automaton.numericmode import FADED
from asympk.errors import InputError
from asympk.formulas import NOT_FINITE
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import (
    LONG,
    ROUGH,
    atoms,
    generic_place,
    heavy,
    is_longer,
    is_many_quotients,
    replaced,
    symbols_in,
    valued,
)
from asympk.symbolic.sides import FEW, is_switched
from asympk.symbolic.system import System


@dataclass(frozen=True)
class Form:
    """The rows of ``matrix`` and ``guards`` over (states, waves, 1); ``waves`` are the forcing, in this order."""

    system: System
    waves: tuple[Wave, ...]
    matrix: tuple[tuple[sp.Expr, ...], ...]
    guards: tuple[tuple[sp.Expr, ...], ...]

    @cached_property
    def entries(self) -> tuple[sp.Expr, ...]:
        """The distinct entries of the matrix, the guards and the waves."""
        rows = (*self.matrix, *self.guards, *((wave.decay, wave.turn) for wave in self.waves))
        return tuple(dict.fromkeys(chain(*rows)))


@lru_cache(maxsize=512)
def form_of(mode: GuardedMode, others: tuple[Wave, ...] = ()) -> Form | None:
    """Return the affine form of a mode, or None where there is none; its waves include ``others``."""
    affine = all(affine_parts(mode.system, law) is not None for law in mode.laws)
    return _form(mode, mode.guard_values, others) if affine else None


@lru_cache(maxsize=512)
def form_of_laws(mode: GuardedMode) -> Form | None:
    """Return the form of a mode whose guards are its frictions that may be negative, above what counts as 0."""
    varying = (law if symbols_in(law) & mode.moving else sp.S.One for law in mode.laws)
    return _form(mode, tuple(law + sp.Rational(str(FADED)) for law in varying), ())


def _form(mode: GuardedMode, guard_values: tuple[sp.Expr, ...], others: tuple[Wave, ...]) -> Form | None:
    found = []
    for expr in (*mode.rates, *guard_values):
        if (parts := affine_parts(mode.system, expr)) is None:
            return None
        found.append(parts)
    rates, guards = found[: len(mode.rates)], found[len(mode.rates) :]
    needed = with_derivatives({wave for _, forced in (*rates, *guards) for wave in forced} | {*others})
    width = len(mode.system.states)
    rows = [row_over(needed, row, forced) for row, forced in rates]
    rows += [row_over(needed, (sp.S.Zero,) * width, rate(wave)) for wave in needed]
    return Form(mode.system, tuple(needed), tuple(rows), tuple(row_over(needed, *guard) for guard in guards))


def mode_obstacle(mode: GuardedMode) -> str | None:
    """Return words on what is not affine in a mode, with sums of waves as forcing, or None."""
    rates = ((f"the rate of {s}", rate) for s, rate in zip(mode.system.states, mode.rates, strict=True))
    guards = ((f"the guard of {guard.kind}", guard.value) for guard in mode.guards)
    laws = (("the friction", law) for law in mode.laws)
    named = next((named for named in (*rates, *guards, *laws) if affine_parts(mode.system, named[1]) is None), None)
    if named is None:
        return None
    what = "" if is_longer(named[1], LONG) else f": {named[1]!s:.80}"  # to write it takes longer than to find it
    if is_switched(named[1], {mode.system.time}):
        what += f"; it switches at more than {FEW} times: give a Piecewise with fewer"
    return f"in mode {mode.name} {named[0]} is not affine{what}"


@lru_cache(maxsize=4096)  # modes of one system have most rates and guards in common
def affine_parts(system: System, expr: sp.Expr) -> tuple[tuple[sp.Expr, ...], dict[Wave, sp.Expr]] | None:
    """Return (coefficients of the states, {Wave: coefficient}) of an expression affine in the states, or None."""
    states, time = system.states, system.time
    if is_switched(expr, states):
        return None
    slopes, forced = [], dict[Wave, sp.Expr]()
    for s in states:
        slope, moving = slope_by(expr, s), states if system.slow.get(s) == 0 else (*states, time)
        if _varies(slope, moving):
            return None
        slope = sp.cancel(slope) if symbols_in(slope) & {*states} else slope
        waves = None if symbols_in(slope) & {*moving} else waves_of(slope, time)
        if waves is None:
            return None
        slopes.append(waves.pop(CONSTANT, sp.S.Zero))
        forced |= {wave._replace(amplitude=s): coefficient for wave, coefficient in waves.items()}
    at_zero = dict.fromkeys(states, sp.S.Zero)
    rest = replaced(expr, at_zero)
    if atoms(rest, *map(type, NOT_FINITE)):  # (x^2 - y^2)/(x - y) is affine, and 0/0 where all states are 0
        rest = replaced(sp.cancel(expr), at_zero)
    given = waves_of(rest, time)
    return None if given is None else (tuple(slopes), given | forced)


def _varies(slope: sp.Expr, symbols: Iterable[sp.Symbol | None]) -> bool:
    """Tell whether values at two generic places show that a slope depends on ``symbols``; nothing is expanded.

    A slope that would take too long to cancel counts as one that depends on them: a heavy one without values there, and
    one with many quotients.
    """
    place = generic_place(slope)
    if not (moved := {s: 3 * v for s, v in place.items() if s in symbols}):
        return False
    here, there = (valued(slope, at, 15) for at in (place, place | moved))
    known = all(v.is_number and v.is_finite for v in (here, there))
    varies = abs(here - there) > ROUGH * (abs(here) + abs(there)) if known else heavy(slope)
    return bool(varies) or is_many_quotients(slope)


def row_over(waves: Iterable[Wave], slopes: Iterable[sp.Expr], forced: dict[Wave, sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return the row over (states, waves, 1) of an expression from its ``affine_parts``."""
    return (*slopes, *(forced.get(wave, sp.S.Zero) for wave in waves), forced.get(CONSTANT, sp.S.Zero))


@lru_cache(maxsize=1024)
def placed(form: Form, values: tuple, digits: int) -> tuple[AffineMode, tuple[tuple, ...], tuple[int, ...]]:
    """Return a form with numbers for its parameters: (mode, its waves, moving guards).

    A wave is (power, decay, turn, sine, place of its amplitude among the states or None). Entries are exact, or right
    to ``digits`` digits if not rational; the moving guards are the indices of those that are not constant. Raises
    ``InputError`` for a guard that is always negative, ``OutOfRange`` where an entry is not finite.
    """
    numbers = exact_values(form.system, form.entries, values, digits)
    rows, guards = (tuple(tuple(numbers[e] for e in row) for row in part) for part in (form.matrix, form.guards))
    place = {None: None} | {s: k for k, s in enumerate(form.system.states)}
    waves = tuple((wave.power, numbers[wave.decay], numbers[wave.turn], wave.sine, place[wave.amplitude])
                  for wave in form.waves)
    moving = tuple(k for k, row in enumerate(guards) if any(row[:-1]))
    if never := [k for k, row in enumerate(guards) if k not in moving and row[-1] < 0]:
        raise InputError(f"guard {never[0]} is {guards[never[0]][-1]} at these parameters whatever the state and the "
                         "time: its mode is never entered; give other parameters")
    return AffineMode(rows, tuple(guards[k] for k in moving)), waves, moving
