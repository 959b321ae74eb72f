"""Values of symbols as a user gives them: by symbol or by name, exact where they are spelt exactly."""

from collections.abc import Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from numbers import Integral
from typing import Any

import sympy as sp

from asympk.errors import InputError
from asympk.naming import nearest
from asympk.numbers import LARGEST, short
from asympk.symbolic.long import atoms, replaced
from asympk.symbolic.reading import exact_constant

_MOST_DIGITS = 10_000  # of a power of numbers that is worked out


def by_symbol(values: Mapping, symbols: Iterable[sp.Symbol], owner: str, kind: str = "parameter") -> dict:
    """Return ``values`` keyed by symbol; a name as key stands for every symbol of that name.

    Raises ``InputError`` for a key that is not in ``symbols``, with the nearest name, and for a symbol given twice.

    >>> by_symbol({"a": 1}, sp.symbols("a b"), "this system")
    {a: 1}
    """
    symbols = sorted(symbols, key=str)
    if not isinstance(values, Mapping | sp.Dict):
        example = f"{{{symbols[0].name!r}: 1}}" if symbols else "{}"
        raise InputError(f"{short(values)} is not a mapping from each {kind} of {owner} to its value, such as "
                         f"{example}")
    named: dict[Any, list[sp.Symbol]] = {}
    for s in symbols:
        named.setdefault(s.name, []).append(s)
    named |= {s: [s] for s in symbols}
    found: dict[sp.Symbol, Any] = {}
    for key, value in values.items():
        if not (meant := named.get(key)):
            raise InputError(_unknown(key, symbols, owner, kind))
        if twice := found.keys() & {*meant}:
            raise InputError(f"{in_words(twice)} is given twice, by symbol and by name; give it once")
        found |= dict.fromkeys(meant, value)
    return found


def require_all(what: str, placed: Mapping, symbols: Iterable[sp.Symbol], kind: str) -> None:
    """Raise ``InputError`` where one of ``symbols`` is not among the keys of ``placed``."""
    if missing := sorted({s.name for s in symbols if s not in placed}):
        words = f"the {kind} {missing[0]} is" if len(missing) == 1 else f"the {kind}s {', '.join(missing)} are"
        raise InputError(f"{what}: {words} missing; give numbers for {', '.join(dict.fromkeys(map(str, symbols)))}")


def as_exact(value: Any, name: Any) -> sp.Expr:
    """Return a number as SymPy's: an int, a Fraction, a Decimal, a string such as "1/4", or a constant without floats.

    Raises ``InputError`` for anything else, and for a number that ``name``, if a symbol, is declared not to be; a float
    is refused since it is not the decimal that it shows.
    """
    if isinstance(value, float) or (isinstance(value, sp.Expr) and value.has(sp.Float)):
        raise InputError(f"{name} = {short(value)} is a float; give it exactly, as a string or a Rational")
    found = exact_constant(str(name), value)
    require_declared(name, found)
    return found


def require_declared(symbol: Any, value: Any, what: str = "") -> None:
    """Raise ``InputError`` for a number that contradicts the declaration of its symbol, such as positive."""
    rules = {"positive": value > 0, "negative": value < 0, "nonnegative": value >= 0, "nonpositive": value <= 0,
             "nonzero": value != 0, "integer": value == int(value)}
    for word, holds in rules.items():
        if getattr(symbol, f"is_{word}", False) and not holds:
            other = {"positive": "nonnegative", "negative": "nonpositive"}.get(word, "") if value == 0 else ""
            advice = f"; if its formulas hold at 0, declare it {other}" if other and what == "start: " else ""
            raise InputError(f"{what}{symbol} = {short(value)} is refused; the symbol is declared {word}{advice}")


def following(bounds: Iterable[tuple[sp.Expr, sp.Expr]]) -> dict[str, str]:
    """Return {static friction: kinetic friction}, by name, of pairs (static, kinetic) that differ by these alone."""
    return {s.name: k.name for static, kinetic in bounds for s in static.free_symbols for k in kinetic.free_symbols
            if s != k and static.xreplace({s: k}) == kinetic}


def with_changes(own: dict[str, Any], given: Mapping[str, Any], follows: dict[str, str]) -> dict[str, Any]:
    """Return the numbers ``own`` with those of ``given`` that they name.

    A static friction that equals the kinetic one, by ``follows``, changes with it, unless given.
    """
    changed = {name: value for name, value in given.items() if name in own}
    for static, kinetic in follows.items():
        if static in own and kinetic in changed and own[static] == own[kinetic]:
            changed.setdefault(static, changed[kinetic])
    return {**own, **changed}


def is_exact(value: Any) -> bool:
    """Tell whether ``value`` is a single number that is spelt exactly, rather than a float or an array."""
    return isinstance(value, int | str | Fraction | Decimal | Integral | sp.Expr) and not isinstance(value, sp.Float)


def in_words(symbols: Iterable) -> str:
    """Return the names in order, joined by commas, or ``nothing``."""
    return ", ".join(sorted(map(str, symbols))) or "nothing"


def did_you_mean(word: Any, known: Iterable) -> str:
    """Return ``; did you mean ...?`` with the entry of ``known`` spelt most like ``word``, or an empty string."""
    close = nearest(str(word), map(str, known))
    return f"; did you mean {close}?" if close else ""


def _unknown(key, symbols, owner, kind):
    if isinstance(key, sp.Symbol) and key.name in {s.name for s in symbols}:
        return f"the Symbol {key} has other assumptions than the {kind} of {owner}; give it by name, {key.name!r}"
    known, word = {s.name for s in symbols}, key if isinstance(key, str) else short(key)
    rate = word.endswith("'") or isinstance(key, sp.Function | sp.Derivative)
    hint = "; mechanism.start(system, {...}) makes a start of coordinates and rates" if rate and kind == "state" else ""
    hint = hint or did_you_mean(word, known) or "; leave it out"
    return f"{word:.60} is not a {kind} of {owner}; it has {in_words(known)}{hint}"


def term_without_value(expr: sp.Expr, at: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr | None:
    """Return the first innermost term of an expression that has no finite real value at numbers, or None."""
    if not _is_unreal(expr, at):
        return None
    inner = (term_without_value(part, at) for part in expr.args if isinstance(part, sp.Expr))
    return next(filter(None, inner), expr)


def _is_unreal(expr: sp.Expr, at: Mapping[sp.Symbol, sp.Expr]) -> bool:
    try:
        value = replaced(_without_vast_powers(expr, at), at)
    except (ArithmeticError, TypeError, ValueError):  # as of a comparison with an infinite part
        return True
    return value is sp.nan or value.is_finite is False or value.is_real is False


def _without_vast_powers(expr: sp.Expr, at: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """Return an expression with rounded values, or oo, of powers such as 2**n at n = 10**9, whose digits are many."""
    for power in sorted(atoms(expr, sp.Pow), key=sp.count_ops):  # inner ones first
        base, exponent = (replaced(part, at) for part in power.args)
        if base.is_Rational and exponent.is_Rational and abs(exponent) * len(str(base)) > _MOST_DIGITS:
            value = sp.Pow(base, exponent, evaluate=False).evalf()
            return _without_vast_powers(expr.xreplace({power: sp.oo if abs(value) > LARGEST else value}), at)
    return expr
