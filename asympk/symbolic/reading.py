"""What a caller gives to a symbolic function: exact numbers and expressions; a string is never read as a formula."""

from collections.abc import Callable, Iterable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import sympy as sp
from sympy.core.function import Application
from sympy.functions.special.bessel import BesselBase

from asympk.errors import InputError
from asympk.formulas import LARGEST_DEGREE, TWO, UNEVALUATED, fractional_part
from asympk.numbers import as_fraction, number, numbers, raw_entries, require_finite, require_sizes, short
from asympk.symbolic.long import DIGITS, parts_of

_PLAIN = (  # a Lambda is a law of friction within the condition of a jump law
    sp.Add, sp.Mul, sp.Pow, Application, sp.Lambda, sp.Symbol, sp.Number, sp.NumberSymbol, type(sp.I), type(sp.zoo),
    *UNEVALUATED, sp.UnevaluatedExpr,
)
DEEPEST = 180  # levels of an expression; SymPy visits them by recursion, several calls of Python for each
MOST_FACTORS = 100  # of a product, whose derivative has as many products
_NOT_BY_ORDER = (sp.Piecewise, sp.Heaviside, BesselBase, *TWO)
WRITTEN_OTHERWISE: dict[type, Callable] = {  # Python's factorial takes no fractions
    sp.frac: fractional_part, sp.factorial: lambda n: sp.gamma(n + 1),
}


def rational(name: str, value: Any) -> sp.Rational:
    """Return a number as the rational that it is exactly; raises ``InputError`` as ``numbers.number`` does."""
    return sp.Rational(Fraction(number(name, value)))


def require_names(symbols: Iterable[sp.Symbol]) -> None:
    """Raise ``InputError`` for the first of ``symbols`` whose name LaTeX cannot set."""
    for name in sorted({*map(str, symbols)}):
        if {*"%#&$"} & {*name} or name.count("{") != name.count("}") or not any(map(str.isalnum, name)):
            raise InputError(f"{short(name)} cannot name a quantity; give letters, digits and underscores")


def unused_symbol(name: str, taken: Iterable[sp.Symbol], **assumptions: bool) -> sp.Symbol:
    """Return a Symbol of this ``name``, with underscores added if a symbol in ``taken`` has the name."""
    names = {*map(str, taken)}
    while name in names:
        name += "_"
    return sp.Symbol(name, **assumptions)


def exact_constant(name: str, value: Any) -> sp.Expr:
    """Return a number as the rational that it is exactly, an exact SymPy constant unchanged; raises ``InputError``.

    A constant that SymPy does not know to be real, as a root by Cardano's formula, is a rational of ``KEPT_DIGITS``.
    """
    if not isinstance(value, sp.Expr) or not value.is_number or value.has(sp.Float, *UNEVALUATED):
        return rational(name, value)
    as_fraction(name, value, DIGITS)  # refuses one beyond doubles, of which is_real would take long
    return value if value.is_real else rational(name, value)


def as_floats(name: str, value: Any) -> Any:
    """Return a number or an array of numbers in floating point; raises ``InputError`` for anything else."""
    if not raw_entries(name, value).ndim:
        return float(number(name, value))
    found = numbers(name, value).astype(float)
    require_finite(name, found)
    return found


def entries_of(name: str, value: Any, entries: str) -> tuple:
    """Return the entries of a sequence or a set; raises ``InputError`` that asks for ``entries`` for anything else."""
    try:
        if isinstance(value, (str, bytes, dict)):
            raise TypeError
        return tuple(value)
    except TypeError:
        raise InputError(f"{name} = {short(value)}: give {entries}") from None


def expression(name: str, value: Any) -> sp.Basic:
    """Return a SymPy object, or a number as one, with other functions for those of ``WRITTEN_OTHERWISE``.

    Raises ``InputError`` for a string or a container, for a unit, a vector, a ``CRootOf``, an entry of a matrix or a
    function of a constant beyond doubles in it, and for what SymPy works on without end or cannot visit.
    """
    if isinstance(value, Decimal):
        number(name, value)  # refuses one of too many digits
    try:
        if isinstance(value, (str, tuple, list, dict, set, frozenset, sp.Lambda)) or getattr(value, "is_Matrix", False):
            raise sp.SympifyError(value)
        found = sp.sympify(value, strict=True)
    except (sp.SympifyError, TypeError, ValueError, NotImplementedError):
        raise InputError(f"{name} = {short(value)}: it must be a SymPy expression or a number") from None
    parts = parts_of(found)
    if found.args and _levels(found) > DEEPEST:
        raise InputError(f"{name}: an expression nested deeper than {DEEPEST}, which SymPy cannot visit; write it as a "
                         "sum of terms, or a Piecewise of many pieces")
    for part in parts:
        if isinstance(part, sp.Expr) and not isinstance(part, _PLAIN):
            raise InputError(f"{name} = {short(value)}: {short(part)} is neither a plain number nor a "
                             "Symbol; write one of these, of a root its .evalf(20)")
        if len(part.args) * part.is_Mul > MOST_FACTORS:
            raise InputError(f"{name} = {short(value)}: {short(part)} has more than {MOST_FACTORS} factors; write it "
                             "with powers, or as a sum of terms")
        if (order := _order(part)) > LARGEST_DEGREE:
            raise InputError(f"{name} = {short(value)}: {short(part)} has the order {short(order)}, beyond "
                             f"{LARGEST_DEGREE}; write it by simpler functions")
        if isinstance(part, sp.Function | sp.Pow) and part.is_number:
            require_sizes(f"{name}: its constant", part)  # SymPy evaluates it to write a sum with it
    for kind, other in WRITTEN_OTHERWISE.items():
        found = found.replace(kind, other) if any(isinstance(part, kind) for part in parts) else found
    return found


def _levels(expr):
    """Return the number of levels of an expression, which is counted to ``DEEPEST`` + 1."""
    level, count = {id(expr): expr}, 0
    while level and count <= DEEPEST:
        level, count = {id(arg): arg for part in level.values() for arg in part.args}, count + 1
    return count


def _order(part):
    """Return the largest integer among the arguments of a function of several, as of a polynomial of Legendre's.

    Bessel functions and others that SymPy does not write out by their order have none.
    """
    several = isinstance(part, sp.Function) and not isinstance(part, _NOT_BY_ORDER) and len(part.args) > 1
    return max((abs(arg) for arg in part.args if arg.is_Integer), default=0) if several else 0


def real_expression(name: str, value: Any) -> sp.Expr:
    """Return an expression or a number that may be real; raises ``InputError`` for what is complex or no quantity."""
    found = expression(name, value)
    if not isinstance(found, sp.Expr) or found.is_extended_real is False:
        raise InputError(f"{name} = {short(value)}: it must be a real expression or number")
    return found
