"""Long expressions, which contain the same part many times: each part is visited once, and none is expanded."""

from collections.abc import Mapping
from functools import lru_cache
from itertools import islice
from typing import Any

import sympy as sp

PARTS = 4  # a bound on the parts of a tree, without atoms, for one operation: -a/b in a sum has two and two
LONG = 300  # operations; a rational expression divided by a sum is not expanded if it has more
ROUGH = 1e-6  # a difference of values, relative to their size, that is not rounding
CLEAR = 1e-9  # size above which a value of DIGITS digits is certainly not 0
DIGITS = 50
REGULAR = 1e9  # a condition number clearly below that of a singular matrix in fifteen digits


def replaced(expr: sp.Basic, rule: Mapping[sp.Basic, sp.Basic]) -> sp.Basic:
    """Return ``expr.xreplace(rule)``; each part is rebuilt once, however often it occurs."""
    found = dict(rule)

    def rebuilt(part: sp.Basic) -> sp.Basic:
        if part not in found:
            args = [rebuilt(arg) for arg in part.args]
            changed = any(new is not old for new, old in zip(args, part.args, strict=True))
            found[part] = (modulus if part.func is sp.Abs else part.func)(*args) if changed else part
        return found[part]

    return rebuilt(expr) if rule else expr


def modulus(expr: sp.Expr) -> sp.Expr:
    """Return the absolute value of an expression, which SymPy would expand; of a heavy one as it stands."""
    return sp.Abs(expr, evaluate=not heavy(expr))


def atoms(expr: sp.Basic, *types: type) -> set[Any]:
    """Return ``expr.atoms(*types)``; each part is visited once, however often it occurs."""
    seen, left = set[sp.Basic](), [expr]
    while left:
        if (part := left.pop()) not in seen:
            seen.add(part)
            left += part.args
    return {part for part in seen if isinstance(part, types)}


def is_longer(expr: sp.Basic, operations: int) -> bool:
    """Tell whether an expression has more operations than ``operations``, without counting all parts of a long one."""
    parts = (part for part in sp.preorder_traversal(expr) if part.args)
    many = PARTS * operations + 1
    return sum(1 for _ in islice(parts, many)) == many or expr.count_ops() > operations


@lru_cache(maxsize=1024)
def heavy(expr: sp.Basic) -> bool:
    """Tell whether an expression is too long to expand: 60 operations, or ``LONG`` in a quotient of polynomials."""
    if not _is_rational(expr):
        return is_longer(expr, 60)
    return any(p.exp.is_negative and p.base.is_Add for p in atoms(expr, sp.Pow)) and is_longer(expr, LONG)


def expanded(expr: sp.Expr) -> sp.Expr:
    """Expand an expression, unless it is heavy, or is not rational and grows."""
    if heavy(expr):
        return expr
    found = sp.expand(expr)
    return found if _is_rational(expr) or found.count_ops() <= expr.count_ops() else expr


def tidied(expr: sp.Expr) -> sp.Expr:
    """Expand an expression unless it is heavy; write quotients of polynomials over a common denominator."""
    found = expanded(expr)
    divided = any(power.exp.is_negative for power in atoms(found, sp.Pow))
    if divided and _is_rational(expr) and found.is_rational_function():
        return sp.cancel(found) if sp.denom(sp.together(found)).free_symbols else found
    return found


def _is_rational(expr: sp.Basic) -> bool:
    return not expr.has(sp.Function) and all(power.exp.is_Integer for power in atoms(expr, sp.Pow))


def generic_place(expr: Any) -> dict[sp.Symbol, sp.Expr]:
    """Return generic rational numbers for the symbols of an expression or matrix: hardly anything vanishes there."""
    return {s: sp.Rational(2 * k + 5, k + 7) for k, s in enumerate(sorted(expr.free_symbols, key=str))}


def is_clearly_nonzero(expr: sp.Expr) -> bool:
    """Tell whether ``expr`` is clearly not 0 at one generic place, in many digits; else it may vanish everywhere."""
    value = replaced(expr, {s: sp.Float(at, DIGITS) for s, at in generic_place(expr).items()}).evalf()
    return isinstance(value, sp.Float) and abs(value) > CLEAR


def is_regular(matrix: sp.Matrix) -> bool:
    """Tell whether a matrix is clearly regular at one generic place, in fifteen digits; else it may be singular."""
    import numpy as np

    found = matrix.evalf(subs=generic_place(matrix))
    known = all(e.is_Number and e.is_finite for e in found)
    return known and bool(np.linalg.cond(np.array(found, dtype=float)) < REGULAR)
