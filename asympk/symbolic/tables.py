r"""Tables: a ``Piecewise`` of many pieces along one variable, such as a record of the ground's motion.

Testing the conditions in turn takes a time proportional to the number of pieces. In a binary tree, in which every
condition excludes half of the pieces, the time is proportional to the logarithm.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import sympy as sp

from asympk.symbolic.long import atoms

SHORTEST = 8  # pieces of a table that is worth a tree


def without_tables(
    exprs: Iterable[sp.Expr], unused_symbols: Iterator[sp.Symbol]
) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    """Return the tables in ``exprs``, each with a symbol from ``unused_symbols``, and ``exprs`` with these symbols."""
    exprs = list(exprs)
    symbols: dict[sp.Basic, sp.Symbol] = {}
    for expr in exprs:
        for table in _outermost(expr):
            symbols[table] = symbols.get(table) or next(unused_symbols)
    return [(symbol, table) for table, symbol in symbols.items()], [expr.xreplace(symbols) for expr in exprs]


def _outermost(expr: sp.Expr) -> Iterator[sp.Basic]:
    if not atoms(expr, sp.Piecewise):
        return
    walk = sp.preorder_traversal(expr)
    for part in walk:
        if isinstance(part, sp.Piecewise) and is_table(part):
            walk.skip()
            yield part


@lru_cache(maxsize=256)
def is_table(expr: sp.Piecewise) -> bool:
    """Tell whether the pieces of a ``Piecewise`` are many intervals, each beginning before the one before it ends."""
    if len(expr.args) < SHORTEST:
        return False
    bounds = [_bounds(piece.cond) for piece in expr.args]
    known = {end.lhs for pair in bounds for end in pair if end is not None}
    return len(known) == 1 and all(
        end is not None and (begin is None or begin.rhs <= end.rhs) and (last is None or end.rhs < last.rhs)
        for (_, end), (begin, last) in pairwise(bounds)
    )


def _bounds(condition: sp.Basic) -> tuple[Any, Any]:
    """Return the relations ``variable >= number`` and ``variable <= number`` of an interval, or None for each."""
    if isinstance(condition, sp.Or):
        return _joined([_bounds(part) for part in condition.args])
    begin = end = None
    for relation in sp.And.make_args(condition):
        if isinstance(relation, sp.core.relational.Relational) and relation.lhs.is_number:
            relation = relation.reversed
        if isinstance(relation, sp.Lt | sp.Le) and relation.rhs.is_number and relation.lhs.is_Symbol:
            end = relation
        elif isinstance(relation, sp.Gt | sp.Ge) and relation.rhs.is_number and relation.lhs.is_Symbol:
            begin = relation
        elif relation is not sp.true:
            return None, None
    return begin, end


def _joined(sides: list[tuple[Any, Any]]) -> tuple[Any, Any]:
    """Return the bounds of the union of intervals that overlap or touch, or (None, None) for other intervals."""
    if any(end is None for _, end in sides):
        return None, None
    sides = sorted(sides, key=lambda side: (side[1].rhs, str(side)))
    if any(begin is not None and begin.rhs > last.rhs for (_, last), (begin, _) in pairwise(sides)):
        return None, None
    begins = [begin for begin, _ in sides]
    first = None if None in begins else min(begins, key=lambda begin: begin.rhs)
    return first, sides[-1][1]


def as_tree(table: sp.Expr) -> sp.Expr:
    """Return a table as a tree of ``Piecewise`` of two pieces each, with equal values; else return ``table``."""
    if not (isinstance(table, sp.Piecewise) and is_table(table)):
        return table
    begins, ends = zip(*(_bounds(piece.cond) for piece in table.args), strict=True)
    first, last = begins[0], ends[-1]
    leaves = [piece.expr for piece in table.args]
    if last is not None:
        leaves[-1] = sp.Piecewise((leaves[-1], last), evaluate=False)
    tree = _halved(leaves, ends)
    return sp.Piecewise((tree, first), evaluate=False) if first is not None else tree


def _halved(leaves: Sequence[sp.Expr], ends: Sequence[Any]) -> sp.Expr:
    """Return the tree of ``leaves``, each of which holds up to its end."""
    if len(leaves) == 1:
        return leaves[0]
    half = len(leaves) // 2
    left, right = _halved(leaves[:half], ends[:half]), _halved(leaves[half:], ends[half:])
    return sp.Piecewise((left, ends[half - 1]), (right, True), evaluate=False)
