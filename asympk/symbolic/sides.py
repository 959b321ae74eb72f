r"""Sides of the switches in a rate: a ``Piecewise`` patch, a stop ``Max(x - 1, 0)``, ``Abs``, ``sign``, ``floor``.

A rate has a kink or jumps where a phase, such as x - 1, vanishes. On each side of the phase the rate is smooth, and its
formula can be continued beyond, so that a step across the phase follows one smooth law. The phase floor(x) of a
sawtooth has a side for every whole number. ``phases`` finds the phases, ``sides_of`` their possible sides, and
``on_sides`` writes an expression for chosen sides.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import combinations, product
from typing import NamedTuple

import sympy as sp

from asympk.errors import InputError
from asympk.formulas import NOT_FINITE
from asympk.numbers import sign_of
from asympk.symbolic.branches import with_direction
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import atoms, modulus, replaced, symbols_in
from asympk.symbolic.penetration import Penetration
from asympk.symbolic.system import Friction, System

Sides = tuple[tuple[sp.Expr, int], ...]  # pairs: a phase and its sign, 0 if it vanishes; for floor(u) its value
MOST = 64  # phases of one mode; with more, as in a long table, the kinks are so gentle that steps may cross them
FEW = 16  # phases linear in the time; with more, as in a record of ground motion, none of them gets sides
_ORDERED = (sp.Lt, sp.Le, sp.Gt, sp.Ge)
_TRUE = {1: (sp.Gt, sp.Ge), 0: (sp.Ge, sp.Le), -1: (sp.Lt, sp.Le)}  # the true relations by the sign of left - right
_SIZES = (sp.Abs, sp.sign, sp.Heaviside)
WHOLE = (sp.floor, sp.ceiling, sp.Mod)
_POLAR = (sp.tan, sp.cot, sp.sec, sp.csc, sp.atan2, sp.acot)
_TWICE = dict.fromkeys((sp.tan, sp.cot), lambda u: sp.sin(2 * u))
_WAVES = {sp.sec: sp.cos, sp.csc: sp.sin, **_TWICE}  # a function without poles that has the same sign
SWITCHING = (*_ORDERED, *_SIZES, *WHOLE, sp.Max, sp.Min)


def phases(
    exprs: Iterable[sp.Basic], states: Iterable[sp.Symbol], time: sp.Symbol | None = None, few: int = FEW,
    most: int = MOST,
) -> tuple[sp.Expr, ...]:
    """Return the phases of expressions: quantities in states or the time at whose zeros the expressions switch.

    A quantity that switches itself is no phase, unless its switches are linear in the time. Quantities linear in the
    time are phases if there are at most ``few`` and they are not periodic; integrators stop at ``switches_of`` anyway.
    The result is empty where there are more than ``most`` phases.
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
    """Tell whether an expression is linear in the time or independent of it, or contains a function with poles."""
    bent = time is not None and part.has(time) and not part.has(*_POLAR)
    return not (bent and (atoms(part, *SWITCHING) or part.diff(time).has(time)))


def _is_timed(atom: sp.Basic, states: set[sp.Symbol], time: sp.Symbol | None) -> bool:
    return not symbols_in(atom) & states and all(is_line(part, time) for part in switching_parts(atom))


def _stands(part: sp.Expr, states: set[sp.Symbol], time: sp.Symbol | None) -> bool:
    """Tell whether an expression without states is constant between jumps in time: none of its sides ends there."""
    return not symbols_in(part) & states and (time is None or slope_by(part, time) == 0)


def sides_of(opened: Iterable[sp.Expr], states: Sequence[sp.Symbol]) -> Iterator[Sides]:
    """Yield the sides that phases can be on at the same time: x - 1 is positive where x - 2 is.

    Phases that differ by rational numbers are ordered along one line; phases on different lines combine freely.
    """
    lines: dict[sp.Expr, list[tuple[sp.Expr, sp.Expr, int]]] = {}
    for phase in opened:
        slope, direction, offset = _along(phase, states)
        lines.setdefault(direction, []).append((offset, phase, slope))
    for choice in product(*(_in_order(line) for line in lines.values())):
        yield tuple(side for line in choice for side in line)


def _along(phase: sp.Expr, states: Sequence[sp.Symbol]) -> tuple[int, sp.Expr, sp.Expr]:
    """Return (sign, direction, offset) of a phase, which equals |number| sign (direction - offset)."""
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
    """Tell whether an expression contains a switching function of one of the symbols."""
    return not switching_symbols(expr).isdisjoint(symbols)


def switching_symbols(*expressions: sp.Expr) -> set[sp.Symbol]:
    """Return the symbols in the switching functions of expressions."""
    return set[sp.Symbol]().union(*(symbols_in(atom) for expr in expressions for atom in atoms(expr, *SWITCHING)))


def inside(phase: sp.Expr, side: int) -> tuple[sp.Expr, ...]:
    """Return the expressions that are positive on a side of a phase; none for side 0, where the phase vanishes."""
    if is_whole(phase):
        return measured(phase) - side, side + 1 - measured(phase)
    return (side * phase,) if side else ()


def is_whole(phase: sp.Expr) -> bool:
    """Tell whether a phase is a whole part floor(u), which has an edge wherever u is a whole number."""
    return isinstance(phase, sp.floor)


def measured(phase: sp.Expr) -> sp.Expr:
    """Return the quantity that varies on a side of a phase: u for floor(u), else the phase itself."""
    return phase.args[0] if is_whole(phase) else phase


class Edge(NamedTuple):
    """An edge of a phase, where it vanishes, or where u = ``whole`` for floor(u)."""

    phase: sp.Expr
    whole: int = 0

    @property
    def quantity(self) -> sp.Expr:
        """The quantity that vanishes on the edge."""
        return measured(self.phase) - self.whole

    def side(self, sign: int) -> int:
        """Return the side of the phase on which the quantity has a sign; floor(u) is u on its edge."""
        return self.whole - (sign < 0) if is_whole(self.phase) else sign


@lru_cache(maxsize=512)
def system_on_sides(system: System, sides: Sides) -> System:
    """Return a system with its rates and frictions as on the given ``sides`` of its phases: itself if they are so.

    A law of friction keeps the sign of its own velocity: its branch tells it, and at rest both directions count.
    Raises ``InputError`` where a rate has no value on the sides.
    """
    if not sides:
        return system
    on = partial(on_sides, sides=sides)
    slow, fast = ({s: on(rate) for s, rate in rates.items()} for rates in (system.slow, system.fast))
    if atoms(sp.Tuple(*slow.values(), *fast.values()), sp.Basic) & {*NOT_FINITE}:
        edges = ", ".join(f"{phase} = 0" for phase, _ in sides)
        raise InputError(f"the motion leads to a side of {edges} on which a rate has no value; end its Piecewise with "
                         "a piece that always holds")
    contacts = tuple(_friction_on(f, on) for f in system.frictions)
    sided = replace(system, slow=sp.Dict(slow), fast=sp.Dict(fast), frictions=contacts)
    return system if sided == system else sided  # an equal one would be compared by its formulas, again and again


def _friction_on(friction: Friction, on: Callable[[sp.Expr], sp.Expr]) -> Friction:
    own, velocity = sp.Dummy(), on(friction.velocity)
    laws = {name: friction.parts[name] for name in ("kinetic", "static", "load")}
    directed = {name: on(with_direction(friction.velocity, law, own)) for name, law in laws.items()}
    back = {own: sp.sign(velocity)}
    others = {name: on(part) for name, part in friction.parts.items() if name not in laws}
    return replace(friction, **others, **{name: law.xreplace(back) for name, law in directed.items()})


def on_sides(expr: sp.Expr, sides: Sides) -> sp.Expr:
    """Return an expression as on the given ``sides`` of its phases, without the switches that they decide."""
    signs = dict(sides)
    while sides and (changes := {a: on for a in atoms(expr, *SWITCHING) if (on := _on_side(a, signs)) != a}):
        expr = replaced(expr, changes)
    return expr


def on_side(expr: sp.Expr, quantity: sp.Expr, sign: int) -> sp.Expr:
    """Return an expression as where ``quantity`` has the given sign."""
    phase, factor = phase_of(quantity)
    return on_sides(expr, ((phase, factor * sign),))


def shortly_after(expr: sp.Basic, rate: Callable[[sp.Expr], sp.Expr | None], rounding: float) -> sp.Basic:
    """Return an expression with its values just after jumps: a quantity that is 0 to rounding has its rate's sign.

    ``rate`` maps such a quantity to its rate, or to None if unknown; the jump is then left as it is.
    """

    def led(atom: sp.Basic) -> sp.Basic:
        part = switching_parts(atom)[0]
        if (slope := rate(part)) is None:
            return atom
        after = atom.func(slope, *(atom.args[1:] if isinstance(atom, _SIZES) else (0,)))
        apart = modulus(part) > sp.Rational(rounding) * sp.Add(*map(modulus, sp.Add.make_args(part)))
        if isinstance(atom, _ORDERED):
            return sp.Or(sp.And(apart, atom), sp.And(sp.Not(apart), after))
        return sp.Piecewise((atom, apart), (after, True))

    if not isinstance(expr, sp.Expr):
        return expr.func(*(shortly_after(part, rate, rounding) for part in expr.args)) if expr.args else expr
    jumps = atoms(expr, *_ORDERED, sp.sign, sp.Heaviside)
    return expr.xreplace({atom: led(atom) for atom in jumps}) if jumps else expr


def with_real_powers(expr: sp.Expr, sides: Sides) -> sp.Expr:
    """Return an expression with the penetration for every base of a fractional power that is positive on the sides.

    (-x)^(3/2), which is |x|^(3/2) where x < 0, is not real at the end of a step shortly beyond x = 0.
    """
    roots = [power for power in atoms(expr, sp.Pow) if not power.exp.is_Integer] if sides else []
    if not roots:
        return expr
    signs = {phase: factor * side for quantity, side in sides for phase, factor in [phase_of(quantity)]}

    def positive(factor: sp.Expr) -> sp.Expr:
        phase, sign = phase_of(factor)
        sign *= signs.get(phase, 0)
        return sign * Penetration(sign * factor) if sign else factor

    def of_power(power: sp.Expr) -> sp.Expr:
        return sp.Mul(*map(positive, sp.Mul.make_args(power.base))) ** power.exp

    if all(of_power(power) == power for power in roots if not atoms(power.base, Penetration)):
        return expr
    return expr.replace(lambda e: e.is_Pow and not e.exp.is_Integer and not e.base.has(Penetration), of_power)


def switching_parts(atom: sp.Basic) -> list[sp.Expr]:
    """Return the expressions at whose zeros a function or relation switches, or at whose whole values for ``WHOLE``."""
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
    sign = sign_of(factor * signs[phase])  # the side of a whole part is its value
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
    """Return a maximum, or a minimum for ``order`` = -1, without the entries that the signs exclude."""
    left = [*atom.args]
    for a, b in combinations(atom.args, 2):
        phase, factor = phase_of(a - b)
        if phase in signs and a in left and b in left:
            left.remove(b if (order * factor * signs[phase] or a.is_number) > 0 else a)  # if equal, keep the number
    return atom if len(left) == len(atom.args) else type(atom)(*left)
