"""Numbers for the symbols of a system: by symbol or by name, exact, and within what is assumed of them."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import sympy as sp

from asympk.errors import InputError
from asympk.numbers import number, short
from asympk.symbolic.reading import entries_of, rational

if TYPE_CHECKING:
    from asympk.symbolic.system import System

_DOUBLE = 53  # bits; a number of SymPy with more keeps its digits


def place(system: "System", values: Any, start: Any) -> tuple[tuple, tuple]:
    """Return (values, start) as exact numbers in the order of the system's parameters and states.

    Both are mappings by symbol or name, or sequences in that order. Raises ``InputError``.
    """
    found = _numbers("values", values, system.parameters, "parameter")
    placed = _numbers("start", start, system.states, "state")
    _require_assumed(system, dict(zip(system.parameters, found, strict=True)))
    return found, placed


def _numbers(what: str, given: Any, symbols: tuple[sp.Symbol, ...], kind: str) -> tuple:
    if isinstance(given, Iterable) and not isinstance(given, Mapping | str):
        given = entries_of(what, given, f"one number for each {kind}")
        if len(given) != len(symbols):
            raise InputError(f"{what} has {len(given)} numbers for {len(symbols)}: {_names(symbols)}")
        given = dict(zip(symbols, given, strict=True))
    if not isinstance(given, Mapping):
        raise InputError(f"{what} = {short(given)}: it must map each {kind}, {_names(symbols)}, to a number")
    by_name = {}
    for key, value in given.items():
        name = _known(what, key, symbols, kind)
        if name in by_name:
            raise InputError(f"{what}: {name} is given twice, by symbol and by name")
        by_name[name] = _number(what, name, value)
    if missing := sorted({s.name for s in symbols} - by_name.keys()):
        raise InputError(f"{what}: the {kind} {', '.join(missing)} is missing; give numbers for {_names(symbols)}")
    for symbol in symbols:
        _require_kind(what, symbol, by_name[symbol.name])
    return tuple(by_name[s.name] for s in symbols)


def _known(what: str, key: Any, symbols: tuple[sp.Symbol, ...], kind: str) -> str:
    names = {s.name for s in symbols}
    if isinstance(key, str):
        if key in names:
            return key
    elif key in symbols and sum(s.name == key.name for s in symbols) == 1:
        return key.name
    elif isinstance(key, sp.Symbol) and key.name in names:
        raise InputError(f"{what}: {key} is a Symbol with other assumptions than the {kind} of that name; "
                         f"give it by name, {key.name!r}")  # fmt: skip
    near = get_close_matches(str(key), names, 1)
    hint = f"did you mean {near[0]}? " if near else ""
    raise InputError(f"{what}: {str(key)[:60]} is not a {kind} of this system; {hint}it has {_names(symbols)}")


def _number(what: str, name: str, value: Any) -> Any:
    if isinstance(value, sp.Float) and value._prec <= _DOUBLE:
        value = float(value)
    return number(f"{what}: {name}", value)


def _require_kind(what: str, symbol: sp.Symbol, value: Any) -> None:
    """Hold a number to what its symbol is declared to be."""
    rules = {"positive": value > 0, "negative": value < 0, "nonnegative": value >= 0, "nonpositive": value <= 0,
             "nonzero": value != 0, "integer": value == int(value)}  # fmt: skip
    for word, holds in rules.items():
        if getattr(symbol, f"is_{word}") and not holds:
            raise InputError(f"{what}: {symbol} = {value} is refused; the symbol is declared {word}")


def _require_assumed(system: "System", values: dict[sp.Symbol, Any]) -> None:
    numbers = {s: rational(str(s), v) for s, v in values.items()}
    for assumption in sp.And.make_args(system.assumptions):
        if assumption.subs(numbers) == sp.false:
            given = ", ".join(f"{s} = {values[s]}" for s in sorted(assumption.free_symbols & values.keys(), key=str))
            raise InputError(f"values: {given} is refused; the system assumes {assumption}")
    for friction in system.frictions:
        kinetic, static = (sp.sympify(b, strict=True).subs(numbers) for b in (friction.kinetic, friction.static))
        if kinetic.is_negative:
            raise InputError(f"values: kinetic friction {short(kinetic)} is negative; friction opposes the velocity")
        if (static - kinetic).is_negative:
            raise InputError(
                f"values: static friction {short(static)} is below the kinetic one, {short(kinetic)}; make it at least "
                "that"
            )


def _names(symbols: Iterable[sp.Symbol]) -> str:
    return ", ".join(dict.fromkeys(s.name for s in symbols)) or "none"
