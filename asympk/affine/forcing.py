r"""Forcing in time as further states of a mode: sums of ``c t^k e^{a t} cos(w t)`` and ``c t^k e^{a t} sin(w t)``.

With ``c_k = t^k e^{a t} cos(w t)`` and ``s_k = t^k e^{a t} sin(w t)``

    c_k' = k c_{k-1} + a c_k - w s_k,      s_k' = k s_{k-1} + a s_k + w c_k,

so a mode whose rates contain such sums is affine in its own states and the waves ``c_k``, ``s_k``. The products of a
wave and a state at rest, its amplitude, have the same rates, so that a mode may contain these, too.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import sympy as sp
from sympy.simplify.fu import TR8

from asympk.numbers import Arithmetic, Number
from asympk.symbolic.long import parts_with, replaced, symbols_in

Split = tuple[Number, Number]  # a number as the sum of two


class Wave(NamedTuple):
    """``t^power e^{decay t} cos(turn t)``, or with sin; ``decay`` and ``turn`` are expressions in the parameters.

    The wave is multiplied by its ``amplitude``, a state at rest, if it has one.
    """

    power: int
    decay: sp.Expr
    turn: sp.Expr
    sine: bool
    amplitude: sp.Symbol | None = None


CONSTANT = Wave(0, sp.S.Zero, sp.S.Zero, False)


def waves_of(expr: sp.Expr, time: sp.Symbol | None) -> dict[Wave, sp.Expr] | None:
    """Return {Wave: coefficient} of an expression in the time, or None where the expression is no sum of waves."""
    if time is not None and time in symbols_in(expr):
        expr = _sum_of_products(expr, time)
    if time is None or time not in symbols_in(expr):
        return {CONSTANT: expr}
    found: dict[Wave, sp.Expr] = {}
    for term in sp.Add.make_args(expr):
        parts = _waves_of_term(term, time)
        if parts is None:
            return None
        for wave, coefficient in parts:
            found[wave] = found.get(wave, sp.S.Zero) + coefficient
    return found


def _sum_of_products(expr, time):
    """Return an expression in the time expanded, but for its coefficients, which may be long."""
    moving = parts_with(expr, time)
    still = {arg for whole in moving for arg in whole.args} - moving
    names = {part: sp.Dummy() for part in still if part.args and isinstance(part, sp.Expr)}
    named = sp.expand(replaced(expr, names))
    named = sp.expand(TR8(named)) if named.has(sp.cos, sp.sin) else named
    return replaced(named, {name: part for part, name in names.items()})


def _waves_of_term(term, time):
    coefficient, moving = term.as_independent(time, as_Add=False)
    power, decay, angle, sine = 0, sp.S.Zero, None, False
    for factor in sp.Mul.make_args(moving):
        base, exponent = factor.as_base_exp()
        if base == time and exponent.is_Integer and exponent > 0:
            power += int(exponent)
        elif isinstance(factor, sp.exp) and (line := _line(factor.args[0], time)):
            decay, coefficient = decay + line[0], coefficient * sp.exp(line[1])
        elif isinstance(factor, sp.cos | sp.sin) and angle is None and (angle := _line(factor.args[0], time)):
            sine = isinstance(factor, sp.sin)
        elif factor != 1:
            return None
    if angle is None:
        return [(Wave(power, decay, sp.S.Zero, False), coefficient)]
    turn, phase = angle
    if turn.could_extract_minus_sign():  # one wave for both signs: cos(-x) = cos(x), sin(-x) = -sin(x)
        turn, phase, coefficient = -turn, -phase, -coefficient if sine else coefficient
    cosine, sine_of = (Wave(power, decay, turn, which) for which in (False, True))
    if sine:  # sin(wt + p) = sin(wt) cos(p) + cos(wt) sin(p)
        return [(sine_of, coefficient * sp.cos(phase)), (cosine, coefficient * sp.sin(phase))]
    return [(cosine, coefficient * sp.cos(phase)), (sine_of, -coefficient * sp.sin(phase))]


def _line(expr, time):
    """Return (slope, value at 0) of an expression linear in the time, or None."""
    slope = sp.expand(expr.diff(time))
    return None if slope.has(time) else (slope, expr.subs(time, 0))


def with_derivatives(waves: Iterable[Wave]) -> list[Wave]:
    """Return in order the waves whose derivatives are sums of them and that include ``waves``, without the constant."""
    needed = set()
    for wave in waves:
        for power in range(wave.power + 1):
            for sine in (False, True) if wave.turn != 0 else (False,):
                needed.add(wave._replace(power=power, sine=sine))
    return sorted(needed - {CONSTANT}, key=lambda w: (str(w.amplitude), str(w.decay), str(w.turn), w.power, w.sine))


def rate(wave: Wave) -> dict[Wave, sp.Expr]:
    """Return {Wave: coefficient} of the derivative of a wave, also with coefficients 0."""
    lower, turned = wave._replace(power=wave.power - 1), wave._replace(sine=not wave.sine)
    return {lower: sp.Integer(wave.power), wave: wave.decay, turned: wave.turn if wave.sine else -wave.turn}


def value(m: Arithmetic, power: int, decay: Split, turn: Split, sine: bool, t: Number, late: Number = 0.0) -> Number:
    """Return a wave at the time ``t + late``, in the numbers of ``m``; in doubles it is right to rounding at any time.

    ``late`` is less than the rounding of ``t``.
    """
    grown, beside = _phase(m, decay, t, late)
    size = t**power * m.exp(grown) * (1 + beside)
    if not (turn[0] or sine):
        return size
    turned, beside = _phase(m, turn, t, late)
    (a, b), (c, d) = ((m.cos(angle), m.sin(angle)) for angle in (turned, beside))
    return size * (b * c + a * d if sine else a * c - b * d)


def _phase(m, slope, t, late):
    """Return ``slope (t + late)`` as a sum of two numbers."""
    if not slope[0]:
        return slope
    near, rest = m.product(slope[0], t)
    return near, rest + slope[1] * t + slope[0] * late


def with_waves(m: Arithmetic, waves: Iterable[tuple], t: Number, w: Any, late: Number = 0.0) -> list:
    """Return the states ``w`` and the waves at the time ``t + late``; the last item of a wave is a place in ``w``."""
    found = ((value(m, power, decay, turn, sine, t, late), place) for power, decay, turn, sine, place in waves)
    return [*w, *(v if place is None else v * w[place] for v, place in found)]


def rounding_of_waves(m: Arithmetic, waves: Iterable[tuple], t: Number, w: Any, off: Number = 1.0) -> list:
    """Return the sizes to which the rounding errors of the states ``w`` and of the waves at t are proportional.

    That of a wave is its size times 1 + power + ``off`` (|decay t| + |turn t|), where ``off`` is the error of phases in
    units of their rounding.
    """
    sizes, found = [*map(abs, w)], []
    for power, decay, turn, _, place in waves:
        grown = decay[0] * t
        size = abs(t**power * m.exp(grown)) * (1 + power + off * (abs(grown) + abs(turn[0] * t)))
        found.append(size if place is None else size * sizes[place])
    return sizes + found
