r"""Forms through the inverse of a matrix that is too large to be inverted in symbols, u' M^-1 v with M symmetric.

Written out, such a form has more operations than can be read, and their number grows exponentially with the size of M.
As a function of its entries it stays short, and has derivatives of the same kind, from M^-1 (v' - M' M^-1 v). Where it
is computed, M = L D L' is factorised, once for all forms that share M: a number of operations of order n^3. Masses are
positive, so no pivot vanishes. ``without_inverses`` writes the operations down.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, lru_cache
from itertools import chain, pairwise
from math import isqrt
from typing import Any, NamedTuple

import sympy as sp

from asympk.symbolic.long import atoms, replaced, symbols_in

Parts = list[tuple[sp.Symbol, sp.Expr]]
Less = Callable[[Any, Iterable[tuple[Any, Any]]], Any]


class Solution(NamedTuple):
    """The solution x of M x = v: the rows of M up to its diagonal, v, the factors of M, and x."""

    rows: tuple[tuple, ...]
    right: tuple
    factors: tuple[list[list], list]
    found: list

    def beside(self, right: Sequence[sp.Expr], less: Less) -> list[sp.Expr]:
        """Return M^-1 of another right side."""
        return _solution(self.factors, right, less) if any(right) else [*right]

    def drive(self, rate: Callable[[sp.Expr], sp.Expr], less: Less) -> list[sp.Expr]:
        """Return M x' = v' - M' x, from the ``rate`` of each entry of M and v."""
        moved, places = [[rate(e) for e in row] for row in self.rows], range(len(self.right))
        terms = [[(moved[max(i, j)][min(i, j)], self.found[j]) for j in places] for i in places]
        return [less(rate(e), [pair for pair in row if pair[0] != 0]) for e, row in zip(self.right, terms, strict=True)]


Forms = dict[sp.Symbol, tuple[tuple, Solution]]  # {the symbol of u' x: (u, x)}


class InverseForm(sp.Function):
    """u' M^-1 v, a function of the entries of u, of the rows of M up to its diagonal, and of the entries of v."""

    is_commutative = True
    is_real = True

    @classmethod
    def of(cls, u: Iterable[Any], matrix: sp.Matrix, v: Iterable[Any]) -> sp.Expr:
        """Return u' M^-1 v for a symmetric ``matrix`` M."""
        return cls(*u, *(matrix[i, j] for i in range(matrix.rows) for j in range(i + 1)), *v)

    @classmethod
    def eval(cls, *entries: sp.Expr) -> sp.Expr | None:
        """Return the value for numbers, and 0 where u or v is 0."""
        u, rows, v = _parted(entries)
        if not any(u) or not any(v):
            return sp.S.Zero
        if not all(isinstance(e, sp.Number) for e in entries):
            return None
        return _dot(u, _solution(_factored(rows), v, _less))

    @staticmethod
    def _imp_(*entries: Any) -> Any:
        """Return the value for numbers of any kind; ``sympy.lambdify`` calls this."""
        u, rows, v = _parted(entries)
        return _dot(u, _solution(_factors(rows, _less), v, _less))

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return the derivative by an entry; that by an entry of M stands for two entries off the diagonal."""
        u, rows, v = _parted(self.args)
        n, place = len(u), argindex - 1
        of = lambda left, right: self.func(*left, *sum(rows, ()), *right)  # noqa: E731
        unit = lambda k: tuple(sp.Integer(k == j) for j in range(n))  # noqa: E731
        if place < n:
            return of(unit(place), v)
        if place >= len(self.args) - n:
            return of(u, unit(place - len(self.args) + n))
        i, j = next((i, j) for i in range(n) for j in range(i + 1) if n + i * (i + 1) // 2 + j == place)
        pairs = dict.fromkeys(((i, j), (j, i)))
        return -sp.Add(*(of(u, unit(a)) * of(unit(b), v) for a, b in pairs))

    @cached_property
    def free_symbols(self) -> set[sp.Basic]:
        """The symbols in the entries, which are collected once."""
        return symbols_in(sp.Tuple(*self.args))

    def _eval_evalf(self, prec: int) -> sp.Expr:
        return self.func(*(e._evalf(prec) for e in self.args))

    @property
    def pivots(self) -> tuple[sp.Expr, ...]:
        """The quotients of det M by its minors, 1 / (M^-1)_kk, of which some vanishes where M is singular."""
        _, rows, _ = _parted(self.args)
        units = sp.eye(len(rows)).tolist()
        return tuple(1 / self.func(*unit, *sum(rows, ()), *unit) for unit in units)

    def _sympystr(self, printer: Any) -> str:
        u, rows, v = _parted(self.args)
        return f"InverseForm({', '.join(printer.doprint([*part]) for part in (u, map(list, rows), v))})"


def with_factors(expr: sp.Basic, factors: Iterable[sp.Symbol]) -> sp.Basic:
    """Return ``expr`` with every form whose v is linear in ``factors`` as a sum in which these stand before forms."""
    found = {form: _with_factors(form, form.free_symbols & {*factors}) for form in atoms(expr, InverseForm)}
    return replaced(expr, {form: parted for form, parted in found.items() if parted != form})


def _with_factors(form: InverseForm, factors: set[sp.Symbol]) -> sp.Expr:
    u, rows, v = _parted(form.args)
    others, columns = (*u, *chain(*rows)), {s: [_factor(e, s) for e in v] for s in sorted(factors, key=str)}
    if not factors or symbols_in(sp.Tuple(*others, *chain(*columns.values()))) & factors:
        return form
    still = dict.fromkeys(factors, sp.S.Zero)
    first = form.func(*others, *(replaced(e, still) for e in v))
    return sp.Add(first, *(s * form.func(*others, *column) for s, column in columns.items()))


def _factor(expr: sp.Expr, s: sp.Symbol) -> sp.Expr:
    """Return the derivative of an expression, most of whose terms do not contain ``s``."""
    return sp.Add(*(term.diff(s) for term in sp.Add.make_args(expr) if s in symbols_in(term)))


def without_inverses(
    exprs: Iterable[sp.Expr], unused_symbols: Iterator[sp.Symbol]
) -> tuple[Parts, Parts, list[sp.Expr], Forms]:
    """Return (entries, steps, ``exprs`` with a symbol from ``unused_symbols`` for every ``InverseForm``, forms).

    The entries of the matrices and vectors, and the steps of the eliminations up to the forms, are pairs of a symbol
    and an expression. The forms have u and the solution x for the symbol of every form u' x.
    """
    exprs = list(exprs)
    entries, steps = _Named(unused_symbols), _Named(unused_symbols)
    factors: dict[tuple, Any] = {}
    solutions: dict[tuple, Solution] = {}
    forms: Forms = {}
    known, named = dict[sp.Basic, sp.Basic](), dict[sp.Expr, sp.Expr]()
    for form in _innermost_first(exprs):
        for e in form.args:
            named[e] = named[e] if e in named else entries(replaced(e, known))
        own = [named[e] for e in form.args]
        u, rows, v = _parted(own)
        if rows not in factors:
            factors[rows] = _factors(rows, steps.less)
        if (rows, v) not in solutions and (rows, u) in solutions:
            u, v = v, u
        if (rows, v) not in solutions:
            found = _solution(factors[rows], v, steps.less)
            solutions[rows, v] = Solution(rows, v, factors[rows], found)
        solution = solutions[rows, v]
        known[form] = steps(total(product(a, b) for a, b in zip(u, solution.found, strict=True)))
        if known[form].is_Symbol and known[form] not in own:  # else its rate is that of an entry
            forms.setdefault(known[form], (u, solution))
    return entries.parts, steps.parts, [replaced(e, known) for e in exprs], forms


def in_order(parts: Parts) -> Parts:
    """Return pairs of a symbol and its expression, each after those whose symbols it contains."""
    meaning, found = dict(parts), dict[sp.Symbol, sp.Expr]()

    def put(symbol: sp.Symbol) -> None:
        if symbol in meaning and symbol not in found:
            for needed in sorted(meaning[symbol].free_symbols, key=str):
                put(needed)
            found[symbol] = meaning[symbol]

    for symbol in meaning:
        put(symbol)
    return [*found.items()]


class _Named:
    """Gives every expression that is no atom a symbol, the same one each time."""

    def __init__(self, unused_symbols: Iterator[sp.Symbol]) -> None:
        self.unused_symbols, self.names = unused_symbols, dict[sp.Expr, sp.Symbol]()

    def __call__(self, expr: sp.Expr) -> sp.Expr:
        if expr.is_Atom:
            return expr
        if expr not in self.names:
            self.names[expr] = next(self.unused_symbols)
        return self.names[expr]

    def less(self, value: sp.Expr, pairs: Iterable[tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
        """Return the name of ``value`` less the products of the pairs."""
        return self(less(value, pairs))

    @property
    def parts(self) -> Parts:
        """The pairs of a symbol and its expression, in the order in which they were named."""
        return [(symbol, expr) for expr, symbol in self.names.items()]


def less(value: sp.Expr, pairs: Iterable[tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
    """Return ``value`` less the products of the pairs."""
    return total((value, *(product(a, b, -1) for a, b in pairs)))


def product(a: sp.Expr, b: sp.Expr, sign: int = 1) -> sp.Expr:
    """Return ``sign`` a b; of two symbols as it stands, in which SymPy would look for powers and numbers."""
    first, second = _without_sign(a), _without_sign(b)
    if not (first.is_Symbol and second.is_Symbol) or first == second:
        return sign * a * b
    factors = (first, second) if first.name < second.name else (second, first)
    negative = (sign < 0) ^ (first is not a) ^ (second is not b)
    return sp.Mul._from_args((sp.S.NegativeOne, *factors) if negative else factors)


def total(terms: Iterable[sp.Expr]) -> sp.Expr:
    """Return the sum of ``terms``; of different symbols and products of two as it stands, without SymPy's search."""
    kept = [term for term in terms if term != 0]
    bare = {_without_sign(term) for term in kept}
    plain = all(e.is_Symbol or (e.is_Mul and len(e.args) == 2 and all(f.is_Symbol for f in e.args)) for e in bare)
    return sp.Add._from_args(kept) if plain and len(bare) == len(kept) else sp.Add(*kept)


def _without_sign(term: sp.Expr) -> sp.Expr:
    """Return a product without its first factor, if that is -1; any other term as it is."""
    if not term.is_Mul or term.args[0] is not sp.S.NegativeOne:
        return term
    return term.args[1] if len(term.args) == 2 else term.func._from_args(term.args[1:])


def _less(value: Any, pairs: Iterable[tuple[Any, Any]]) -> Any:
    """Return ``less(value, pairs)`` of numbers of any kind."""
    return value - sum(a * b for a, b in pairs)


def _innermost_first(exprs: Iterable[sp.Basic]) -> list[InverseForm]:
    """Return the forms in expressions, each after those in its entries; each part is visited once."""
    seen: dict[sp.Basic, None] = {}

    def visit(part: sp.Basic) -> None:
        if part.args and part not in seen:
            for arg in part.args:
                visit(arg)
            seen[part] = None

    for expr in exprs:
        visit(expr)
    return [part for part in seen if isinstance(part, InverseForm)]


def _parted(entries: Sequence[sp.Expr]) -> tuple[tuple, tuple[tuple, ...], tuple]:
    """Return u, the rows of M up to the diagonal, and v, from all n (n + 5) / 2 entries in this order."""
    n = (isqrt(25 + 8 * len(entries)) - 5) // 2
    starts = [n + i * (i + 1) // 2 for i in range(n + 1)]
    rows = tuple(tuple(entries[a:b]) for a, b in pairwise(starts))
    return tuple(entries[:n]), rows, tuple(entries[-n:])


def _factors(rows: Sequence[Sequence[sp.Expr]], less: Less) -> tuple[list[list[sp.Expr]], list[sp.Expr]]:
    """Return (L, D^-1) of M = L D L', L below its diagonal of ones; ``less`` makes every entry that is computed."""
    lower, inverted = list[list[sp.Expr]](), list[sp.Expr]()
    for row in rows:
        scaled: list[sp.Expr] = []  # the row of L D
        for entry, above in zip(row, lower, strict=False):
            scaled.append(less(entry, zip(scaled, above, strict=True)))
        lower.append([less(0, ((-s, d),)) for s, d in zip(scaled, inverted, strict=True)])
        pivot = less(row[-1], zip(scaled, lower[-1], strict=True))
        inverted.append(less(1 / pivot, ()))
    return lower, inverted


@lru_cache(maxsize=16)
def _factored(rows: tuple[tuple[sp.Number, ...], ...]) -> tuple[list[list[Any]], list[Any]]:
    """Return (L, D^-1) of a matrix of numbers, which many forms share."""
    return _factors(rows, _less)


def _dot(u: Iterable[Any], x: Iterable[Any]) -> Any:
    return sum(a * b for a, b in zip(u, x, strict=True))


def _solution(factors: tuple[list[list[sp.Expr]], list[sp.Expr]], v: Sequence[sp.Expr], less: Less) -> list[sp.Expr]:
    """Return M^-1 v by forward and backward substitution."""
    lower, inverted = factors
    found: list[sp.Expr] = []
    for row, right in zip(lower, v, strict=True):
        found.append(less(right, zip(row, found, strict=True)))
    found = [less(0, ((-y, d),)) for y, d in zip(found, inverted, strict=True)]
    for i in reversed(range(len(found))):
        found[i] = less(found[i], ((row[i], y) for row, y in zip(lower[i + 1 :], found[i + 1 :], strict=True)))
    return found
