"""Expressions of a system as functions of ``(t, *state, *p)`` with the parameters p, which serve all its scenes.

The text of a ``function`` has only arithmetic and functions: given a namespace of functions, it runs on numbers of any
kind, and tracers.
"""

import ast
import math
import re
from collections.abc import Callable
from functools import lru_cache, partial, reduce
from itertools import chain
from types import ModuleType
from typing import Any

import numpy as np
import sympy as sp
from mpmath.ctx_mp import MPContext

from asympk.errors import OutOfRange
from asympk.numbers import short
from asympk.symbolic.coefficients import name_of, with_names
from asympk.symbolic.long import atoms, replaced
from asympk.symbolic.lowering import WIDE, Lowered, NoFunction, is_tower, lower, on_floats, without_overflow
from asympk.symbolic.placing import named_parts
from asympk.symbolic.removable import with_limits
from asympk.symbolic.system import System

Direction = tuple[sp.Expr, ...]  # the rates of the time and of every state
FACTORS = 64  # the largest power that is written out as a product
_POWER = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\*\*([2-9])\b")


def by_elements(single: Callable[..., tuple], count: int) -> Callable[..., tuple]:
    """Return a function of floats with ``count`` results as one of arrays that broadcast, NaN where it has no value."""
    def tried(given: tuple) -> tuple:
        try:
            return single(*given)
        except (ArithmeticError, ValueError):
            return (math.nan,) * count

    def found(*given: Any) -> tuple:
        arrays = np.broadcast_arrays(*given)
        rows = [tried(row) for row in zip(*(array.ravel().tolist() for array in arrays), strict=True)]
        return (*np.array(rows, dtype=float).T.reshape(count, *arrays[0].shape),)

    return found


@lru_cache(maxsize=1024)
def function(
    system: System, outputs: tuple[sp.Expr, ...], target: str, functions: Any, directions: tuple[Direction, ...] = (),
    products: bool = False, coefficients: tuple[sp.Expr, ...] = (),
) -> Callable[..., tuple]:
    """Return ``f(t, *state, *p)``, which returns the tuple of ``outputs`` on the numbers of ``functions``.

    The parameters p are followed by the values of the ``coefficients``.

    ``target`` is the spelling of the text: in ``"math"`` rational constants are rounded once, in ``"mpmath"`` they are
    divided at the working precision. With ``directions`` the function returns the derivatives of the outputs along each
    direction, output by output. With ``products`` integer powers of any base are written as products.
    """
    exprs = (*outputs, *chain(*directions))
    wide = partial(function, system, outputs, "mpmath", directions=directions, coefficients=coefficients)
    try:
        text = source(system, outputs, target, directions, coefficients)
    except NoFunction:
        if functions is math and not is_tower(exprs):
            return on_floats(wide(functions=WIDE))
        if functions is np:  # NumPy lacks a function that ``math`` has
            single = function(system, outputs, "math", math, directions, products, coefficients)
            return by_elements(single, len(outputs) * max(1, len(directions)))
        raise
    if functions is math:
        return without_overflow(text, exprs, lambda numbers: wide(functions=numbers))
    found = _executed(ast.unparse(_Products().visit(ast.parse(text))) if products else text, target, functions)
    if not isinstance(functions, MPContext) or is_tower(exprs):
        return found
    return with_limits(found, partial(_executed, text, target), functions)


def _executed(text: str, target: str, functions: Any) -> Callable[..., tuple]:
    space: dict[str, Any] = {target: functions, "abs": getattr(functions, "abs", abs)}
    exec(text, space)
    return space["f"]


@lru_cache(maxsize=1024)
def source(
    system: System, outputs: tuple[sp.Expr, ...], target: str, directions: tuple[Direction, ...] = (),
    coefficients: tuple[sp.Expr, ...] = (),
) -> str:
    """Return the text of ``f(t, *state, *p)``; for ``"math"``, integer powers of symbols are written as products."""
    plain, time = _plain(system, coefficients)
    fixed = (*system.parameters, *map(name_of, coefficients))
    arguments = (time, *(plain[s] for s in (*system.states, *fixed)))
    values, *rows = (_in_plain_symbols(system, exprs, coefficients) for exprs in (outputs, *directions))
    if sp.I in atoms(sp.Tuple(*values), sp.Basic):
        raise OutOfRange(f"{_not_real(system)} is not real in every mode; write it so that it is, as sqrt(abs(v)) "
                         "is for a velocity v")
    if directions:
        rates = tuple((*row, *(sp.S.Zero for _ in fixed)) for row in rows)
        text = Lowered(arguments, values, target, directions=rates).source
    else:
        text = lower(arguments, values, target=target, branching=True).source
    return _POWER.sub(lambda found: f"({'*'.join([found[1]] * int(found[2]))})", text) if target == "math" else text


def _not_real(system: System) -> str:
    """Return "name = formula" of the first formula that is not real for one sign of a sliding velocity."""
    size = sp.Dummy(positive=True)
    for name, expr in named_parts(system).items():
        sides = (expr.subs(f.velocity, sign * size) for f in system.frictions for sign in (-1, 1))
        if any(sp.I in atoms(side, sp.Basic) for side in sides):
            return f"{name} = {short(expr)}"
    return "a rate or a part of a friction"


class _Products(ast.NodeTransformer):
    """Writes integer powers as products: the Taylor series of a power divides by its base, which may be 0."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        match node:
            case ast.BinOp(base, ast.Pow(), ast.Constant(int(power))) if 2 < power <= FACTORS:
                return reduce(lambda product, factor: ast.BinOp(product, ast.Mult(), factor), [base] * power)
        return node


@lru_cache(maxsize=512)
def _in_plain_symbols(
    system: System, exprs: tuple[sp.Expr, ...], coefficients: tuple[sp.Expr, ...]
) -> tuple[sp.Expr, ...]:
    """Return expressions in plain symbols; the rates of a mode are asked for with every derivative along its field."""
    plain, _ = _plain(system, coefficients)
    changed = {s: name for s, name in plain.items() if s != name}
    return tuple(replaced(sp.Tuple(*with_names(system, exprs, coefficients)), changed))


@lru_cache(maxsize=64)
def _plain(system: System, coefficients: tuple[sp.Expr, ...]) -> tuple[dict[sp.Symbol, sp.Symbol], sp.Symbol]:
    """Return plain symbols for all symbols, whose names may be ``theta'`` or ``lambda``, and the symbol of the time."""
    time = sp.Symbol("t", real=True)
    named = (("w", system.states), ("p", system.parameters), ("c", map(name_of, coefficients)))
    plain = {s: sp.Symbol(f"{letter}{k}", real=True) for letter, symbols in named for k, s in enumerate(symbols)}
    return plain | ({system.time: time} if system.time else {}), time


def namespace(**functions: Any) -> ModuleType:
    """Return a module of the ``functions`` on which emitted text runs."""
    found = ModuleType("functions")
    vars(found).update(functions)
    return found
