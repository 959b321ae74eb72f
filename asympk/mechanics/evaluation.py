"""Values of the expressions and conditions of a mechanism at numbers or arrays of numbers."""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from itertools import compress
from typing import Any

import sympy as sp

from asympk.automaton.junction import BY_HAND, OF_ZERO
from asympk.errors import InputError, OutOfRange
from asympk.mechanics.kinetics import Kinetics, slope_in_powers
from asympk.numbers import common_shape, short
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import atoms, symbols_in
from asympk.symbolic.reading import as_floats, exact_constant
from asympk.symbolic.sides import shortly_after
from asympk.symbolic.truth import array_function, holds
from asympk.symbolic.values import require_declared, term_without_value

ROUNDING = 8 * 2.0**-52  # part of its terms below which a sum of products may be rounding


def evaluate(expressions: tuple[sp.Basic, ...], values: dict[sp.Symbol, Any]) -> tuple[Any, ...]:
    """Return ``expressions`` at ``values``, numbers or arrays by symbol; a condition is True or False, and oo inf.

    Raises ``InputError`` for symbols without a value, values that are no numbers, and arrays that do not broadcast,
    and ``OutOfRange`` where an expression is not finite.
    """
    import numpy as np

    together = sp.Tuple(*expressions)
    needed = sorted(symbols_in(together) - _arguments_of_functions(together), key=str)
    if missing := [str(symbol) for symbol in needed if symbol not in values]:
        alike = [name for name in missing if name in map(str, values)]
        what = (f"the Symbol {alike[0]} has other assumptions than the mechanism's" if alike
                else f"give one for each of {', '.join(map(str, needed))}")
        raise InputError(f"no value for {', '.join(missing)}; {what}")
    given = {symbol: _declared(symbol, as_floats(str(symbol), values[symbol])) for symbol in needed}
    shape = common_shape(given, given.values())
    given = {symbol: np.broadcast_to(value, shape) for symbol, value in given.items()}
    lowered = [isinstance(e, sp.Expr) and e is not sp.oo for e in expressions]
    plain = sp.Tuple(*compress(expressions, lowered))
    function = array_function(plain, (*needed,))

    def valued(*arrays: Any) -> tuple[Any, ...]:
        found, at = iter(function(*arrays)), dict(zip(needed, arrays, strict=True))
        size = np.broadcast_shapes(*map(np.shape, arrays))
        return tuple(next(found) if low else _constant(e, at, size)
                     for e, low in zip(expressions, lowered, strict=True))

    try:
        return valued(*given.values())
    except OutOfRange:
        k = _first_out_of_range(valued, [value.ravel() for value in given.values()])
        place = ", ".join(f"{symbol} = {value.flat[k]:g}" for symbol, value in given.items())
        at = {symbol: sp.Rational(float(value.flat[k])) for symbol, value in given.items()}
        sides = (side for relation in sorted(atoms(together, sp.Rel), key=str) for side in relation.args)
        term = next(filter(None, (term_without_value(expr, at) for expr in (*plain, *sides))), None)
        named = f", where {short(term)} is no finite real number" if term else ""
        raise OutOfRange(f"an equation of the contact is not finite at {place}, or beside it{named}; give other "
                         "numbers: a mass or a length by which it divides may be 0, or G_NT, by which the critical "
                         "friction divides") from None


def _arguments_of_functions(expr: sp.Basic) -> set[sp.Symbol]:
    """Return the symbols of an expression that only stand for the arguments of a Lambda."""
    return symbols_in(sp.Tuple(*(law.signature for law in atoms(expr, sp.Lambda))))


def _first_out_of_range(function: Callable[..., Any], arrays: Sequence[Any]) -> int:
    """Return the first index into ``arrays`` of one dimension at which a function of them raises ``OutOfRange``."""

    def fails_up_to(k: int) -> bool:
        try:
            function(*(array[: k + 1] for array in arrays))
        except OutOfRange:
            return True
        return False

    return bisect_left(range(next(map(len, arrays), 1) - 1), True, key=fails_up_to)


def exactly_at(expr: sp.Expr, values: dict[sp.Symbol, Any]) -> Any:
    """Return ``expr`` at exact numbers as a SymPy number, at others as a double; raises as ``evaluate`` does."""
    rounded = float(evaluate((expr,), values)[0])
    given = {symbol: values[symbol] for symbol in symbols_in(expr)}
    if any(isinstance(value, float) for value in given.values()):
        return rounded
    found = expr.xreplace({symbol: exact_constant(str(symbol), value) for symbol, value in given.items()})
    return found if found.is_number and found.is_real else rounded


def evaluate_ahead(
    kinetics: Kinetics, expressions: tuple[sp.Basic, ...], values: dict[sp.Symbol, Any]
) -> tuple[Any, ...]:
    """Return ``expressions`` at ``values``; an expression that jumps at this place or time has its value just after."""
    moved = {**dict(zip(kinetics.coordinates, kinetics.velocities, strict=True)), kinetics.time: sp.S.One}

    def rate(part: sp.Expr) -> sp.Expr | None:
        slope = sp.Add(*(slope_by(part, q) * u for q, u in moved.items()))
        known = slope.free_symbols <= values.keys() and not part.free_symbols & {*kinetics.velocities}
        return slope if known else None

    return evaluate(tuple(shortly_after(expr, rate, ROUNDING) for expr in expressions), values)


def _constant(part: sp.Basic, given: dict[sp.Symbol, Any], shape: tuple[int, ...]) -> Any:
    """Return inf for oo, and for a condition whether it holds, with equations and their opposites ``_nearly`` met."""
    import numpy as np

    near = {equation: _nearly(equation) for equation in part.atoms(sp.Eq, sp.Ne)}
    found = float(part) if part is sp.oo else holds(part.xreplace(near), given)
    return np.broadcast_to(found, shape) if shape else found


def _nearly(equation: sp.Eq | sp.Ne) -> sp.Basic:
    """Return the condition that rounding could make an equation hold: of its symbols, to six digits, or of zeros.

    Of the opposite of an equation it is the opposite condition.
    """
    apart = equation.lhs - equation.rhs
    used = sorted(symbols_in(apart), key=str)
    zero = sp.Rational(OF_ZERO) * sp.Add(*map(sp.Abs, used))
    allowed = (sp.Abs(slope_in_powers(apart, s)) * (sp.Rational(BY_HAND) * sp.Abs(s) + zero) for s in used)
    return (sp.Le if isinstance(equation, sp.Eq) else sp.Gt)(sp.Abs(apart), sp.Add(*allowed))


def _declared(symbol: sp.Symbol, value: Any) -> Any:
    """Return a float, or an array; raises ``InputError`` for one that its symbol is declared not to be."""
    ends = [value] if isinstance(value, float) else [value.min(), value.max()] if value.size else []
    for end in ends:
        if end or isinstance(value, float):  # a range may begin at 0
            require_declared(symbol, float(end))
    return value
