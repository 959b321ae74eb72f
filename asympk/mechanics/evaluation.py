"""Expressions and conditions of a mechanism at numbers or arrays of numbers."""

from contextlib import nullcontext
from fractions import Fraction
from functools import lru_cache
from typing import Any

import sympy as sp

from asympk.errors import InputError, OutOfRange
from asympk.scene import number
from asympk.symbolic.lowering import lower


def evaluate(expressions: tuple[sp.Basic, ...], values: dict[sp.Symbol, Any]) -> tuple[Any, ...]:
    """Return ``expressions`` at ``values``, numbers or arrays by symbol; a condition is True or False.

    Raises ``InputError`` naming the symbols that have no value, the values that are no numbers, and the arrays that
    do not broadcast.
    """
    needed = sorted(set().union(*(e.free_symbols for e in expressions)), key=str)
    missing = [str(symbol) for symbol in needed if symbol not in values]
    if missing:
        raise InputError(f"no value for {', '.join(missing)}; give one for each of {', '.join(map(str, needed))}")
    numbers = _broadcast({symbol: _declared(symbol, as_floats(str(symbol), values[symbol])) for symbol in needed})
    return tuple(_at(e, tuple(needed), numbers) for e in expressions)


def _broadcast(arrays: dict[sp.Symbol, Any]) -> tuple:
    import numpy as np

    try:
        return np.broadcast_arrays(*arrays.values())
    except ValueError:
        raise InputError(f"the arrays given for {', '.join(map(str, arrays))} do not broadcast") from None


def _at(expr: sp.Basic, symbols: tuple[sp.Symbol, ...], numbers: tuple) -> Any:
    """Return one expression, condition, or expression in pieces at arrays of one shape."""
    import numpy as np

    if isinstance(expr, sp.And):
        return np.logical_and.reduce([_at(part, symbols, numbers) for part in expr.args])
    if expr in (sp.true, sp.false):
        return np.full(np.shape(numbers[0]) if numbers else (), expr == sp.true)
    if isinstance(expr, sp.StrictGreaterThan | sp.StrictLessThan):
        return _at(expr.gts - expr.lts, symbols, numbers) > 0
    try:
        with np.errstate(invalid="ignore", divide="ignore") if expr.has(sp.Piecewise) else nullcontext():
            return _function(expr, symbols)(*numbers)
    except OutOfRange:
        told = ", ".join(f"{s} = {value.flat[0]:g}" for s, value in zip(symbols, numbers, strict=True) if value.size)
        raise OutOfRange(f"an equation of the contact is not finite at {told}, or beside it") from None


def _declared(symbol: sp.Symbol, value: Any) -> Any:
    """Hold numbers to the sign that their symbol is declared to have."""
    import numpy as np

    for word, good in (("positive", np.greater), ("negative", np.less), ("nonnegative", np.greater_equal)):
        if getattr(symbol, f"is_{word}") and not np.all(good(value, 0)):
            wrong = np.ravel(value)[~np.ravel(good(value, 0))][0]
            raise InputError(f"{symbol} = {wrong:g}: the symbol is declared {word}")
    return value


@lru_cache(maxsize=256)
def _function(expr: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Any:
    plain = {symbol: sp.Symbol(f"q{k}", real=True) for k, symbol in enumerate(symbols)}
    return lower(tuple(plain.values()), expr.xreplace(plain), "numpy", branching=True)


def exact(name: str, value: Any) -> sp.Expr:
    """Return a number as the rational that it is, an exact SymPy number as it stands; raises ``InputError``."""
    if isinstance(value, sp.Expr) and value.is_number and not value.has(sp.Float):
        return value
    return sp.Rational(*Fraction(number(name, value)).as_integer_ratio())


def as_floats(name: str, value: Any) -> Any:
    """Return a number or an array of numbers in floating point; raises ``InputError`` for anything else."""
    import numpy as np

    if isinstance(value, sp.Expr) and value.is_real and not value.is_Rational:
        value = float(value)
    if not np.ndim(value):
        return float(number(name, value))
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {value!r:.60}: it must be a number or an array of numbers") from None
    if not np.isfinite(found).all():
        raise InputError(f"{name}: every number of the array must be finite")
    return found
