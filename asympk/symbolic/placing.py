"""Numbers for the symbols of a system: by symbol or by name, exact, and within the system's assumptions."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import sympy as sp
from sympy.core.function import AppliedUndef
from sympy.printing.codeprinter import PrintMethodNotImplementedError

from asympk.errors import InputError
from asympk.formulas import NOT_FINITE, UNEVALUATED, formula_in_words
from asympk.numbers import FEW, LARGEST, number, reason_of, short
from asympk.symbolic.branches import own_coupling, pushing_on
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import atoms, symbols_in
from asympk.symbolic.printers import printer_of
from asympk.symbolic.reading import entries_of, rational
from asympk.symbolic.values import by_symbol, require_all, require_declared

if TYPE_CHECKING:
    from asympk.symbolic.system import Friction, System

LARGEST_EXPONENT, LARGEST_ANGLE = 30, 2**10
_OF_COMPLEX = (sp.re, sp.im, sp.arg, sp.conjugate)
_DOUBLE = 53  # bits; a SymPy Float of at most this precision is read as a float, a longer one keeps its digits


def place(system: "System", values: Any, start: Any) -> tuple[tuple, tuple]:
    """Return (values, start) as exact numbers in the order of the system's parameters and states.

    Both are mappings by symbol or name, or sequences in that order. Raises ``InputError``.
    """
    _require_formulas(system)
    found = _numbers("values", values, system.parameters, "parameter")
    placed = _numbers("start", start, system.states, "state")
    _require_assumed(system, dict(zip(system.parameters, found, strict=True)))
    return found, placed


def _numbers(what: str, given: Any, symbols: tuple[sp.Symbol, ...], kind: str) -> tuple:
    if isinstance(given, Iterable) and not isinstance(given, Mapping | str | set | frozenset):
        given = entries_of(what, given, f"one number for each {kind}")
        if len(given) != len(symbols):
            raise InputError(f"{what} has {len(given)} numbers for {len(symbols)}: {_names(symbols)}")
        given = dict(zip(symbols, given, strict=True))
    if not isinstance(given, Mapping):
        raise InputError(f"{what} = {short(given)}: it must map each {kind}, {_names(symbols)}, to a number")
    placed = by_symbol(given, symbols, "this system", kind)
    require_all(what, placed, symbols, kind)
    found = {s: _number(what, s.name, placed[s]) for s in symbols}
    for symbol, value in found.items():
        require_declared(symbol, value, f"{what}: ")
    return tuple(found.values())


def _number(what: str, name: str, value: Any) -> Any:
    if isinstance(value, sp.Float) and value._prec <= _DOUBLE:
        value = float(value)
    return number(f"{what}: {name}", value)


def with_numbers_inside(system: "System", values: tuple) -> tuple["System", tuple]:
    """Return the system with numbers for parameters inside of powers and angles, and the values of the others.

    The symbol n hides whether x**n is affine, has a slope or a Taylor series where x = 0, and a value where x < 0.
    A number beyond ``LARGEST_EXPONENT`` stays a parameter, since its power could be multiplied out. In sin(n) a number
    stands if it is beyond ``LARGEST_ANGLE``: its rounding would be one of the angle.
    """
    known = dict(zip(system.parameters, values, strict=True))
    inside = {s for s in _in_exponents(system) if abs(known[s]) <= LARGEST_EXPONENT}
    inside |= {s for angle in _angles(system) for s in angle if any(abs(known[n]) > LARGEST_ANGLE for n in angle)}
    found = {s: rational(s.name, known[s]) for s in inside}
    if not found:
        return system, values
    lowered = _with_numbers(system, sp.Dict(found))
    return lowered, tuple(known[s] for s in lowered.parameters)


@lru_cache(maxsize=64)
def _in_exponents(system: "System") -> frozenset[sp.Symbol]:
    """Return the parameters, but the small one, in exponents of powers of what moves."""
    moving, own = {*system.states, system.time}, {*system.parameters} - {system.small}
    powers = (p for e in named_parts(system).values() for p in atoms(e, sp.Pow) if symbols_in(p.base) & moving)
    return frozenset(own & {s for power in powers for s in symbols_in(power.exp)})


@lru_cache(maxsize=64)
def _angles(system: "System") -> frozenset[frozenset[sp.Symbol]]:
    """Return the parameters of each angle that consists of parameters other than the small one alone."""
    own = {*system.parameters} - {system.small}
    turned = (p for e in named_parts(system).values() for p in atoms(e, sp.sin, sp.cos, sp.tan))
    return frozenset(frozenset(symbols) for p in turned if (symbols := symbols_in(p.args[0])) <= own)


@lru_cache(maxsize=64)
def _with_numbers(system: "System", numbers: sp.Dict) -> "System":
    constants = dict(numbers)
    slow, fast, dependent = (sp.Dict({s: rate.xreplace(constants) for s, rate in of.items()})
                             for of in (system.slow, system.fast, system.dependent))
    frictions = tuple(f.mapped(lambda part: part.xreplace(constants)) for f in system.frictions)
    return replace(system, slow=slow, fast=fast, frictions=frictions, dependent=dependent,
                   assumptions=system.assumptions.xreplace(constants))


@lru_cache(maxsize=64)
def _divided(system: "System") -> tuple[tuple[str, sp.Expr, tuple[sp.Expr, ...]], ...]:
    """Return (name, expression, divisors) of the rates and parts of frictions that divide by parameters alone."""
    found = []
    for name, expr in named_parts(system).items():
        divisors = {power.base for power in atoms(expr, sp.Pow) if power.exp.is_negative}
        if fixed := tuple(d for d in divisors if d.free_symbols and d.free_symbols <= {*system.parameters}):
            found.append((name, expr, fixed))
    return tuple(found)


def named_parts(system: "System") -> dict[str, sp.Expr]:
    """Return the rates and the parts of frictions by the names that messages have for them."""
    rates = {f"{s}'": rate for s, rate in (*system.slow.items(), *system.fast.items())}
    many = len(system.frictions) > 1
    return rates | {f"{name} of friction {k}" if many else name: part
                    for k, f in enumerate(system.frictions, 1) for name, part in f.parts.items()}


@lru_cache(maxsize=64)
def _require_formulas(system: "System") -> None:
    moving = {*system.states, system.time}
    for name, expr in named_parts(system).items():
        if unknown := sorted(map(short, atoms(expr, AppliedUndef))):
            raise InputError(f"{name} = {short(expr)} has no value: {unknown[0]} is a function without a formula; "
                             "write its formula there")
        if parts := sorted(short(e) for e in atoms(expr, *_OF_COMPLEX) if symbols_in(e) & moving):
            raise InputError(f"{name} = {short(expr)}: {parts[0]} is that of a number which may be complex; declare "
                             "its symbols real, as sp.Symbol('x', real=True), or write what is real")
        require_worked_out(name, expr, UNEVALUATED)
        functions = atoms(expr, sp.Function) - atoms(expr, sp.Piecewise, InverseForm, *_OF_COMPLEX)
        if unknown := sorted(short(f) for f in functions if not _is_computed(f.func, len(f.args))):
            raise InputError(f"{name} = {short(expr)}: of {unknown[0]} no numbers can be computed; write its formula")


@lru_cache(maxsize=256)
def _is_computed(function: Any, count: int) -> bool:
    """Tell whether a function of SymPy with this number of arguments has a function of numbers."""
    try:
        printer_of("mpmath").doprint(function(*sp.symbols(f"q:{count}"), evaluate=False))
    except PrintMethodNotImplementedError:
        return False
    except (TypeError, ValueError, RecursionError):  # of a function of other arguments
        pass
    return True


def require_worked_out(name: str, expr: sp.Expr, kinds: tuple[type, ...]) -> None:
    """Raise ``InputError`` for a part of an expression that is one of ``kinds``, such as an integral."""
    if found := sorted(map(short, atoms(expr, *kinds))):
        raise InputError(f"{name} = {short(expr)}: {found[0]} is to be worked out first; give {found[0]}.doit()")


@lru_cache(maxsize=64)
def _towers(system: "System") -> tuple[tuple[str, sp.Expr, sp.Expr], ...]:
    """Return (name, expression, part), inner ones first, of functions in exponents and angles: 2**(2**n)."""
    own, found = {*system.parameters}, set()
    for name, expr in named_parts(system).items():
        inner = (p.args[-1] for p in atoms(expr, sp.Pow, sp.exp, sp.sin, sp.cos, sp.tan))
        steep = (p for p in inner if atoms(p, sp.Function, sp.Pow))
        found |= {(name, expr, p) for p in steep if p.free_symbols and p.free_symbols <= own}
    return tuple(sorted(found, key=lambda place: sp.count_ops(place[2])))


def _require_low_towers(system: "System", values: dict[sp.Symbol, Any], numbers: dict[sp.Symbol, sp.Rational]) -> None:
    """Raise ``InputError`` for an argument beyond doubles, of which all digits would be worked out."""
    for name, expr, part in _towers(system):
        size = abs(part.xreplace({s: sp.Float(numbers[s], FEW) for s in part.free_symbols}).evalf(FEW))
        if size.is_finite and (size > LARGEST) == sp.true:  # one that divides by 0 is told as that
            raise InputError(f"values: {_given(values, part)} is refused; in {name} = {short(expr)}, {short(part)} is "
                             "beyond the range of doubles")


def _require_divisible(system: "System", values: dict[sp.Symbol, Any], numbers: dict[sp.Symbol, sp.Rational]) -> None:
    for name, expr, divisors in _divided(system):
        for divisor in divisors:
            if divisor.xreplace(numbers) == 0 and expr.subs(numbers).has(*NOT_FINITE):
                raise InputError(f"values: {_given(values, divisor)} is refused; {name} = {short(expr)} divides by "
                                 f"{short(divisor)}")


def _require_assumed(system: "System", values: dict[sp.Symbol, Any]) -> None:
    numbers = {s: rational(str(s), v) for s, v in values.items()}
    if system.fast and numbers[system.small] <= 0:
        raise InputError(f"values: {_given(values, system.small)} is refused; the small parameter is positive, as it "
                         "divides the rates of the fast states")
    _require_low_towers(system, values, numbers)
    _require_divisible(system, values, numbers)
    for assumption in sp.ordered(sp.And.make_args(system.assumptions)):
        if assumption.subs(numbers) == sp.false:
            raise InputError(f"values: {_given(values, assumption)} is refused; the system assumes "
                             f"{formula_in_words(assumption)}")
    for friction, coupling in _couplings(system):
        if coupling.xreplace(numbers).is_negative:
            raise InputError(f"values: with {_given(values, coupling)}, {pushing_on(friction)}")
    require_opposing(system, numbers, values)


@lru_cache(maxsize=64)
def _couplings(system: "System") -> tuple[tuple["Friction", sp.Expr], ...]:
    """Return the frictions with the slopes of their velocities' rates by their forces, where parameters give these."""
    moving, found = {*system.states, system.time}, [(f, own_coupling(system, f)) for f in system.frictions]
    return tuple((f, coupling) for f, coupling in found if coupling.free_symbols and not coupling.free_symbols & moving)


def require_opposing(
    system: "System", numbers: dict[sp.Symbol, sp.Expr], values: dict[sp.Symbol, Any] | None = None
) -> None:
    """Raise ``InputError`` where kinetic friction is negative at ``numbers``, or static friction below it.

    ``values`` are the numbers as they were given.
    """
    values = numbers if values is None else values
    for friction in system.frictions:
        bounds = sp.sympify((friction.kinetic, friction.static), strict=True)
        kinetic, static = (_value(bound, numbers, values) for bound in bounds)
        if kinetic.is_negative:
            raise InputError(f"values: kinetic friction {short(bounds[0])} is negative"
                             f"{_given(values, bounds[0], ' at ')}; friction opposes the velocity")
        if (static - kinetic).is_negative:
            raise InputError(f"values: static friction {short(bounds[1])} is below the kinetic one, {short(bounds[0])}"
                             f"{_given(values, bounds, ', at ')}; make it at least that")


def _value(bound: sp.Expr, numbers: dict[sp.Symbol, sp.Expr], values: dict[sp.Symbol, Any]) -> sp.Expr:
    try:
        return bound.subs(numbers)
    except (TypeError, ValueError) as reason:  # of SymPy's functions of integers
        raise InputError(f"values: friction {short(bound)} has no value{_given(values, bound, ' at ')}: "
                         f"{reason_of(reason)}") from None


def _given(values: dict[sp.Symbol, Any], parts: sp.Basic, before: str = "") -> str:
    """Return "symbol = number, ..." of the symbols in ``parts`` that have values, or "" for none."""
    given = ", ".join(f"{s} = {_as_given(values[s])}" for s in sorted(parts.free_symbols & values.keys(), key=str))
    return before + given if given else ""


def _as_given(value: Any) -> str:
    """Return a number without rounding: a Fraction as the decimal that it is, or else as a ratio."""
    if not isinstance(value, Fraction):
        return str(value)
    decimal = Decimal(value.numerator) / value.denominator
    return str(decimal) if Fraction(decimal) == value else short(value)


def _names(symbols: Iterable[sp.Symbol]) -> str:
    return ", ".join(dict.fromkeys(s.name for s in symbols)) or "none"
