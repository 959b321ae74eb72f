"""Plain symbols for coordinates and rates, and the keys by which a user may give their values."""

from collections.abc import Iterable
from typing import Any

import sympy as sp
from sympy.concrete.expr_with_limits import ExprWithLimits
from sympy.core.function import AppliedUndef

from asympk.errors import InputError, UnknownName
from asympk.mechanics.kinetics import Kinetics
from asympk.numbers import short
from asympk.symbolic.long import atoms, carried_out, replaced
from asympk.symbolic.values import did_you_mean, in_words


def plain_name(given: Any) -> sp.Symbol:
    """Return the plain symbol of a coordinate or velocity: theta for theta(t), theta' for its Derivative.

    A Symbol is unchanged. Raises ``InputError`` for anything else.
    """
    if isinstance(given, sp.Symbol):
        return given
    if isinstance(given, AppliedUndef):
        return sp.Symbol(given.func.__name__, real=True)
    if isinstance(given, sp.Derivative) and isinstance(given.expr, AppliedUndef) and given.derivative_count == 1:
        return sp.Symbol(given.expr.func.__name__ + "'", real=True)
    raise InputError(f"{given} is neither a Symbol, a dynamicsymbol nor its first Derivative; name it by one")


def plainly(expr: sp.Expr, names: dict[sp.Expr, sp.Symbol], time: sp.Symbol) -> sp.Expr:
    """Return ``expr`` in plain symbols; raises ``InputError`` for functions of time that are no coordinates.

    Such a one is the integral of a coordinate over the time, and the coordinate at another time.
    """
    found = replaced(done := carried_out(expr), names)
    past = (part for part in atoms(done, ExprWithLimits, sp.Subs) if time in part.variables)
    past = (part for part in past if atoms(part, AppliedUndef))
    for rest in (*past, *atoms(found, sp.Derivative), *atoms(found, AppliedUndef)):
        raise InputError(f"{rest} in {expr!s:.60} is no coordinate or velocity; list it, or write it out in {time}")
    return found


def keyed(
    values: Any, kinetics: Kinetics, names: dict[sp.Expr, sp.Symbol], others: Iterable[sp.Symbol] = ()
) -> dict[sp.Symbol, Any]:
    """Return ``values`` by plain symbol; a key is a symbol, a dynamicsymbol, a Derivative, or a name.

    The rate of theta has the name ``theta'``; ``others`` are symbols besides those of the mechanism. Raises
    ``UnknownName`` for other keys, and ``InputError`` if a symbol is given twice or ``values`` is no dict.
    """
    if not isinstance(values, dict):
        raise InputError(f"values = {short(values)}: give a dict such as {{'theta': 1.1, \"theta'\": 0}}")
    rates = zip(kinetics.coordinates, kinetics.velocities, strict=True)
    known = {str(s): s for s in others} | {f"{q}'": u for q, u in rates}
    known |= {str(s): s for s in kinetics.symbols} | {str(own): s for own, s in names.items()}
    found = {}
    for key, value in values.items():
        plain = known.get(str(key))
        if plain is None:
            plainly_named = {name for name in known if "(" not in name}
            spelt = " ".join(str(key).split())
            raise UnknownName(f"{spelt:.60} is no coordinate, rate or parameter; these are {in_words(plainly_named)}"
                              f"{did_you_mean(key, plainly_named)}")
        if plain in found:
            raise InputError(f"{plain} is given twice; give it once")
        found[plain] = value
    return found
