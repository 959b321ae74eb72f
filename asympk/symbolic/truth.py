"""Whether a condition holds: exactly at exact numbers, element by element at arrays of floats."""

from collections.abc import Mapping
from functools import lru_cache
from operator import eq, ge, gt, le, lt, ne
from sys import float_info
from typing import Any

import sympy as sp
from sympy.logic.boolalg import BooleanFunction

from asympk.errors import InputError
from asympk.numbers import common_shape
from asympk.symbolic.long import replaced
from asympk.symbolic.lowering import NoFunction, lower
from asympk.symbolic.reading import as_floats


class Evaluated(BooleanFunction):
    """A condition that no relation writes down: its method ``at`` tells whether the condition holds at numbers."""


_COMPARE = {sp.Ge: ge, sp.Gt: gt, sp.Le: le, sp.Lt: lt, sp.Ne: ne, sp.Eq: eq}


def holds(condition: sp.Basic, numbers: Mapping) -> Any:
    """Tell whether ``condition`` holds at ``numbers``, all exact or all arrays; arrays give an array of booleans.

    Raises ``InputError`` where the condition has no value.
    """
    found = _evaluated(condition, numbers)
    return found if getattr(found, "ndim", 0) else bool(found)


def as_arrays(given: Mapping[sp.Symbol, Any]) -> dict:
    """Return the values as arrays of floats that broadcast; raises ``InputError``."""
    import numpy as np

    found = {symbol: np.asarray(as_floats(str(symbol), value)) for symbol, value in given.items()}
    common_shape(found, found.values())
    return found


def with_default(numbers: Mapping, wanted: set, default: Mapping) -> dict:
    """Add the default of each symbol that is wanted and not given: an expression in the given ones."""
    found = dict(numbers)
    for symbol, expr in default.items():
        if symbol in wanted and symbol not in numbers and expr.free_symbols <= numbers.keys():
            found[symbol] = _value(expr, numbers)
    return found


def require_relations(allowed: sp.Basic, numbers: Mapping) -> None:
    """Raise ``InputError`` for the first relation of ``allowed`` between given symbols that does not hold."""
    import numpy as np

    for relation in sp.ordered(sp.And.make_args(allowed)):
        used = sorted(relation.free_symbols, key=str)
        if not used or not {*used} <= numbers.keys():
            continue
        good = np.asarray(holds(relation, numbers))
        if not good.all():
            shown = {s: _first(numbers[s], good) for s in used}
            raise InputError(f"{_equations(shown)} is outside the range of this system, {relation}")


@lru_cache(maxsize=256)
def array_function(expr: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Any:
    """Return ``expr`` as a function of arrays for ``symbols``, which may have any names, also with a prime."""
    plain = {symbol: sp.Symbol(f"q{k}", real=True) for k, symbol in enumerate(symbols)}
    args, put = tuple(plain.values()), replaced(expr, plain)
    try:
        return lower(args, put, "numpy", branching=True)
    except NoFunction:
        return _by_elements(lower(args, put, "mpmath", branching=True))


def _by_elements(lowered):
    """Return a function of arrays that is called for each element: NumPy has fewer functions than mpmath."""
    import numpy as np

    def at(*numbers):
        found = lowered.to_digits(float_info.dig + 2, *numbers)
        return found[0] if lowered.single else found

    return np.vectorize(at, otypes=[float] * len(lowered.outputs))


def _evaluated(condition, numbers):
    if isinstance(condition, sp.And | sp.Or):
        found, *rest = (_evaluated(part, numbers) for part in condition.args)
        for part in rest:
            found = found & part if isinstance(condition, sp.And) else found | part
        return found
    if isinstance(condition, Evaluated):
        return condition.at(numbers)
    if isinstance(condition, sp.Not):  # of an ``Evaluated`` one: the opposite of a relation is a relation
        return ~_evaluated(condition.args[0], numbers)
    if not isinstance(condition, sp.Rel):
        return condition == sp.true
    sides = [_value(side, numbers) for side in condition.args]
    if not all(isinstance(side, sp.Basic) for side in sides):  # to SymPy, the double 1.0 does not equal the integer 1
        sides = [float(side) if isinstance(side, sp.Basic) else side for side in sides]
    found = _COMPARE[type(condition)](*sides)
    if isinstance(found, sp.Basic) and found not in (sp.true, sp.false):
        raise InputError(f"{condition} has no value at {_equations(numbers)}")
    return found


def _value(expr, numbers):
    """Evaluate an expression at exact numbers or at arrays."""
    used = tuple(sorted(expr.free_symbols, key=str))
    if all(isinstance(numbers[s], sp.Basic) for s in used):
        found = expr.xreplace({s: numbers[s] for s in used})  # one substitution for all: else 0/0 could become 0
        if found.is_extended_real is False or found is sp.nan:
            raise InputError(f"{expr} has no value at {_equations({s: numbers[s] for s in used})}")
        return found
    return array_function(expr, used)(*(numbers[s] for s in used))


def _first(value, good):
    """Return the number, or the first entry of an array at which ``good`` is False."""
    import numpy as np

    return value if isinstance(value, sp.Basic) else np.broadcast_to(value, good.shape)[~good].flat[0]


def _equations(numbers):
    return ", ".join(f"{symbol} = {value}" for symbol, value in sorted(numbers.items(), key=str))
