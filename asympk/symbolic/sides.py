r"""Sides of what switches by the state: a ``Piecewise`` patch, a stop ``Max(x - 1, 0)``, ``Abs``, ``sign``, ``floor``.

A rate has a kink or jumps where a phase, such as x - 1, vanishes. On either side of it the rates are smooth, and those
of a side may be continued beyond it: a step that ends there has one smooth law all along. The phase floor(x) of teeth
along x has a side for every whole number.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations, product

import sympy as sp

from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import atoms, replaced
from asympk.symbolic.penetration import Penetration
from asympk.symbolic.system import System

Sides = tuple[tuple[sp.Expr, int], ...]  # phases, and the sign that each of them has, 0 on it, or its whole part
MOST = 64  # phases of one mode: a long table has kinks so gentle that no step has to end at them
FEW = 16  # phases linear in the time that have sides of their own: a record of the ground's motion has many
_ORDERED = (sp.Lt, sp.Le, sp.Gt, sp.Ge)
_TRUE = {1: (sp.Gt, sp.Ge), 0: (sp.Ge, sp.Le), -1: (sp.Lt, sp.Le)}  # by the sign of what is compared with 0
_SIZES = (sp.Abs, sp.sign, sp.Heaviside)
WHOLE = (sp.floor, sp.ceiling, sp.frac, sp.Mod)
_POLAR = (sp.tan, sp.cot, sp.sec, sp.csc, sp.atan2, sp.acot)
_TWICE = dict.fromkeys((sp.tan, sp.cot), lambda u: sp.sin(2 * u))
_WAVES = {sp.sec: sp.cos, sp.csc: sp.sin, **_TWICE}  # of the same sign where it is finite
SWITCHING = (*_ORDERED, *_SIZES, *WHOLE, sp.Max, sp.Min)


def phases(
    exprs: Iterable[sp.Basic], states: Iterable[sp.Symbol], time: sp.Symbol | None = None, few: int = FEW,
    most: int = MOST,
) -> tuple[sp.Expr, ...]:
    """Return what switches expressions where it vanishes and depends on states, or on the time.

    What does not switch itself is meant, unless by what is linear in the time. Of what is, and is not periodic, at most
    ``few`` are phases: smooth stretches end there already. More than ``most`` in all are none.
    """
    states, found, lines = {*states}, set(), set()
    for atom in atoms(sp.Tuple(*exprs), *SWITCHING):
        for part in switching_parts(atom):
            inners = atoms(part, *SWITCHING)
            if not all(_is_timed(inner, states, time) for inner in inners) or (inners and _stands(part, states, time)):
                continue
            phase = sp.floor(part, evaluate=False) if isinstance(atom, WHOLE) else phase_of(part)[0]
            if part.free_symbols & states or not is_line(part, time):
                found.add(phase)
            elif part.has(time or sp.nan) and not part.has(*_POLAR) and not isinstance(atom, WHOLE):
                lines.add(phase)
    found |= lines if len(lines) <= few else set()
    return tuple(sorted(found, key=sp.default_sort_key)) if len(found) <= most else ()


def is_line(part: sp.Expr, time: sp.Symbol | None) -> bool:
    """Tell whether an expression is linear in the time, or independent of it, or jumps, as at a pole."""
    bent = time is not None and part.has(time) and not part.has(*_POLAR)
    return not (bent and (atoms(part, *SWITCHING) or part.diff(time).has(time)))


def _is_timed(atom: sp.Basic, states: set[sp.Symbol], time: sp.Symbol | None) -> bool:
    return not atom.free_symbols & states and all(is_line(part, time) for part in switching_parts(atom))


def _stands(part: sp.Expr, states: set[sp.Symbol], time: sp.Symbol | None) -> bool:
    """Tell whether an expression changes by jumps of the time alone: no side of it ends between them."""
    return not part.free_symbols & states and (time is None or slope_by(part, time) == 0)


def sides_of(opened: Iterable[sp.Expr], states: Sequence[sp.Symbol]) -> Iterator[Sides]:
    """Yield the sides that phases can be on together: x - 1 is not positive where x - 2 is not negative.

    Phases that differ by numbers lie one after the other; of others all sides are taken.
    """
    lines: dict[sp.Expr, list[tuple[sp.Expr, sp.Expr, int]]] = {}
    for phase in opened:
        slope, direction, offset = _along(phase, states)
        lines.setdefault(direction, []).append((offset, phase, slope))
    for choice in product(*(_in_order(line) for line in lines.values())):
        yield tuple(side for line in choice for side in line)


def _along(phase: sp.Expr, states: Sequence[sp.Symbol]) -> tuple[int, sp.Expr, sp.Expr]:
    """Return (sign, direction, offset) of a phase, which is |number| sign (direction - offset)."""
    offset, moving = phase.as_independent(*states, as_Add=True)
    factor, direction = moving.as_coeff_Mul()
    if not (offset / factor).is_Rational:
        return 1, phase, sp.S.Zero
    sign = -1 if direction.could_extract_minus_sign() else 1
    return int(sp.sign(factor)) * sign, sign * direction, -sign * offset / factor


def _in_order(line: list[tuple[sp.Expr, sp.Expr, int]]) -> Iterator[Sides]:
    """Yield the sides of phases on one line, from below the least offset to beyond the largest."""
    line = sorted(line, key=lambda place: place[0])
    for passed in range(len(line) + 1):
        yield tuple((phase, slope if k < passed else -slope) for k, (_, phase, slope) in enumerate(line))


def is_switched(expr: sp.Expr, symbols: Iterable[sp.Symbol]) -> bool:
    """Tell whether an expression is switched by one of the symbols."""
    symbols = {*symbols}
    return any(atom.free_symbols & symbols for atom in atoms(expr, *SWITCHING))


def inside(phase: sp.Expr, side: int) -> tuple[sp.Expr, ...]:
    """Return what is positive on a side of a phase; nothing where the motion stays on it."""
    number = measured(phase)
    if number != phase:
        return number - side, side + 1 - number
    return (side * phase,) if side else ()


def measured(phase: sp.Expr) -> sp.Expr:
    """Return what moves while a side holds: a phase itself, or that of which it is the whole part."""
    return phase.args[0] if isinstance(phase, sp.floor) else phase


def system_on_sides(system: System, sides: Sides) -> System:
    """Return a system as it is on the ``sides`` of its phases."""
    on = partial(on_sides, sides=sides)
    slow, fast = ({s: on(rate) for s, rate in rates.items()} for rates in (system.slow, system.fast))
    found = [(f, {name: on(part) for name, part in f.parts.items()}) for f in system.frictions]
    contacts = (replace(f, **(parts | {"load": parts["load"] or f.load})) for f, parts in found)  # 0 is no load
    return replace(system, slow=sp.Dict(slow), fast=sp.Dict(fast), frictions=tuple(contacts))


def on_sides(expr: sp.Expr, sides: Sides) -> sp.Expr:
    """Return an expression as it is on the ``sides`` of its phases."""
    signs = dict(sides)
    while sides and (changes := {a: on for a in atoms(expr, *SWITCHING) if (on := _on_side(a, signs)) != a}):
        expr = replaced(expr, changes)
    return expr


def on_side(expr: sp.Expr, quantity: sp.Expr, sign: int) -> sp.Expr:
    """Return an expression as it is where a quantity has a sign."""
    phase, factor = phase_of(quantity)
    return on_sides(expr, ((phase, factor * sign),))


def shortly_after(expr: sp.Basic, rate: Callable[[sp.Expr], sp.Expr | None], rounding: float) -> sp.Basic:
    """Return an expression whose jumps are on the side to which they go: what may be 0 by rounding has its rate's sign.

    ``rate`` gives that of what jumps where it vanishes, or None where that is not known.
    """

    def led(atom: sp.Basic) -> sp.Basic:
        part = switching_parts(atom)[0]
        if (slope := rate(part)) is None:
            return atom
        after = atom.func(slope, *(atom.args[1:] if isinstance(atom, _SIZES) else (0,)))
        apart = sp.Abs(part) > sp.Rational(rounding) * sp.Add(*map(sp.Abs, sp.Add.make_args(part)))
        if isinstance(atom, _ORDERED):
            return sp.Or(sp.And(apart, atom), sp.And(sp.Not(apart), after))
        return sp.Piecewise((atom, apart), (after, True))

    if not isinstance(expr, sp.Expr):
        return expr.func(*(shortly_after(part, rate, rounding) for part in expr.args)) if expr.args else expr
    jumps = atoms(expr, *_ORDERED, sp.sign, sp.Heaviside)
    return expr.xreplace({atom: led(atom) for atom in jumps}) if jumps else expr


def with_real_powers(expr: sp.Expr, sides: Sides) -> sp.Expr:
    """Return an expression whose powers that are not whole have penetrations for what is positive on a side.

    (-x)^(3/2), which is |x|^(3/2) where x < 0, is not real where a step ends shortly beyond.
    """
    if all(power.exp.is_Integer for power in atoms(expr, sp.Pow)):
        return expr
    signs = {phase: factor * side for quantity, side in sides for phase, factor in [phase_of(quantity)]}

    def positive(factor: sp.Expr) -> sp.Expr:
        phase, sign = phase_of(factor)
        sign *= signs.get(phase, 0)
        return sign * Penetration(sign * factor) if sign else factor

    def of_power(power: sp.Expr) -> sp.Expr:
        return sp.Mul(*map(positive, sp.Mul.make_args(power.base))) ** power.exp

    return expr.replace(lambda e: e.is_Pow and not e.exp.is_Integer and not e.base.has(Penetration), of_power)


def switching_parts(atom: sp.Basic) -> list[sp.Expr]:
    """Return what a size, a maximum, a minimum or a relation is switched by where it vanishes, a whole part at each."""
    if isinstance(atom, WHOLE):
        return [-atom.args[0] if isinstance(atom, sp.ceiling) else atom.args[0] / sp.Mul(*atom.args[1:])]
    parts = [atom.args[0]] if isinstance(atom, _SIZES) else [a - b for a, b in combinations(atom.args, 2)]
    return [_WAVES[part.func](part.args[0]) if part.func in _WAVES else part for part in parts]


def phase_of(part: sp.Expr) -> tuple[sp.Expr, int]:
    """Return the phase of which ``part`` is a multiple, and the sign of the factor."""
    _, phase = part.primitive()
    return (-phase, -1) if phase.could_extract_minus_sign() else (phase, 1)


def _on_side(atom: sp.Basic, signs: dict[sp.Expr, int]) -> sp.Basic:
    if isinstance(atom, sp.Max | sp.Min):
        return _largest(atom, signs, 1 if isinstance(atom, sp.Max) else -1)
    if isinstance(atom, WHOLE):
        return _in_whole_parts(atom, signs)
    phase, factor = phase_of(switching_parts(atom)[0])
    if phase not in signs:
        return atom
    sign = factor * signs[phase]
    if isinstance(atom, _ORDERED):
        return sp.true if isinstance(atom, _TRUE[sign]) else sp.false
    if isinstance(atom, sp.Heaviside):
        return sp.Integer(sign > 0) if sign else atom.args[1]
    return sign * atom.args[0] if isinstance(atom, sp.Abs) else sp.Integer(sign)


def _in_whole_parts(atom: sp.Basic, signs: dict[sp.Expr, int]) -> sp.Basic:
    whole = signs.get(sp.floor(switching_parts(atom)[0], evaluate=False))
    if whole is None:
        return atom
    if isinstance(atom, sp.floor | sp.ceiling):
        return sp.Integer(-whole if isinstance(atom, sp.ceiling) else whole)
    return atom.args[0] - whole * sp.Mul(*atom.args[1:])


def _largest(atom: sp.Basic, signs: dict[sp.Expr, int], order: int) -> sp.Basic:
    """Return a maximum, or for ``order`` = -1 a minimum, without the entries that are known not to be it."""
    left = [*atom.args]
    for a, b in combinations(atom.args, 2):
        phase, factor = phase_of(a - b)
        if phase in signs and a in left and b in left:
            left.remove(b if (order * factor * signs[phase] or a.is_number) > 0 else a)  # of equals the number stays
    return atom if len(left) == len(atom.args) else type(atom)(*left)
