r"""Derivatives of expressions that share parts, by the chain rule: no part is substituted into another.

A part is a pair (symbol, expression in the arguments and in earlier symbols), as ``sympy.cse`` gives them. Where the
arguments have rates, the part u = e(v_1, v_2, ..) has the rate u' = sum_j (de/dv_j) v_j': forward differentiation.

Derivatives are those between jumps, where signs, steps, whole parts and conditions are constant.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import chain

import sympy as sp
from sympy.core.function import AppliedUndef, ArgumentIndexError

from asympk.errors import InputError
from asympk.symbolic.inverses import Forms, Less, Parts, Solution, less, product, total
from asympk.symbolic.long import parts_with, symbols_in
from asympk.symbolic.penetration import Penetration, RootSlope

_STANDING = (sp.sign, sp.Heaviside, sp.floor, sp.ceiling, sp.logic.boolalg.Boolean)


def directional_derivatives(
    parts: Parts, outputs: Sequence[sp.Expr], directions: Sequence[Mapping[sp.Symbol, sp.Expr]],
    unused_symbols: Iterator[sp.Symbol], steps: Collection[sp.Symbol], forms: Forms,
) -> tuple[Parts, list[sp.Expr]]:
    """Return (parts, the derivatives of every output along every direction, output by output).

    A direction maps the arguments that move to their rates. New parts take their symbols from ``unused_symbols``. The
    ``steps`` of eliminations are not differentiated: the rates of ``forms`` follow from solutions.
    """
    found = [*parts]
    moving = {*(s for rates in directions for s in rates), *forms}
    slopes = {}
    for symbol, expr in parts:
        if symbol not in steps:
            slopes[symbol] = _slopes(expr, moving, found, unused_symbols)
            moving |= {symbol} if slopes[symbol] else set()
    last = [_slopes(output, moving, found, unused_symbols) for output in outputs]

    def step(value: sp.Expr, pairs: Iterable[tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
        return _named(less(value, pairs), found, unused_symbols)

    asked = {*chain(*slopes.values(), *last)}
    weights = _weights([form for symbol, form in forms.items() if symbol in asked], len(directions), step)
    columns = []
    for direction in directions:
        rates = _Rates(direction, forms, weights, step)
        for symbol, partials in slopes.items():
            rates[symbol] = _named(_moved(partials, rates), found, unused_symbols)
        columns.append([_moved(partials, rates) for partials in last])
    return found, [column[k] for k in range(len(outputs)) for column in columns]


class _Rates(dict):
    """The rates of symbols along a direction, 0 for those at rest; that of a form is found when it is asked for.

    The form u' x of a solution M x = v has the rate u'' x + u' x', M x' = v' - M' x, or u'' x + w' (v' - M' x) with
    M w = u if ``weights`` has the w of u. ``less`` makes and names the new parts.
    """

    def __init__(
        self, direction: Mapping[sp.Symbol, sp.Expr], forms: Forms, weights: Mapping[tuple, list], less: Less
    ) -> None:
        super().__init__(direction)
        self.forms, self.weights, self.less = forms, weights, less
        self.drives, self.solved = dict[tuple, list[sp.Expr]](), dict[tuple, list[sp.Expr]]()

    def __missing__(self, symbol: sp.Expr) -> sp.Expr:
        if symbol not in self.forms:
            return sp.S.Zero
        left, solution = self.forms[symbol]
        of, weights = (solution.rows, solution.right), self.weights.get((solution.rows, left))
        if of not in self.drives:
            self.drives[of] = solution.drive(self.__getitem__, self.less)
        if weights is None and of not in self.solved:
            self.solved[of] = solution.beside(self.drives[of], self.less)
        along = (left, self.solved[of]) if weights is None else (weights, self.drives[of])
        still = ((self[u], x) for u, x in zip(left, solution.found, strict=True))
        self[symbol] = self.less(0, [(-a, b) for a, b in (*still, *zip(*along, strict=True))])
        return self[symbol]


def _weights(forms: Iterable[tuple[tuple, Solution]], directions: int, less: Less) -> dict[tuple, list[sp.Expr]]:
    """Return the solutions w of M w = u for the forms u' x, {(rows of M, u): w}.

    Those that are no solutions x are left out if they are more than the directions, which they would serve.
    """
    known = {(s.rows, s.right): s.found for _, s in forms}
    lacking = {(s.rows, u): s for u, s in forms if (s.rows, u) not in known}
    few = len(lacking) <= directions
    return known | {of: s.beside(of[1], less) for of, s in lacking.items() if few}


def _slopes(
    expr: sp.Expr, moving: set[sp.Symbol], found: Parts, unused_symbols: Iterator[sp.Symbol]
) -> dict[sp.Symbol, sp.Expr]:
    """Return the partial derivatives by the ``moving`` symbols, each as a new part in ``found``."""
    slopes: dict[sp.Symbol, list[sp.Expr]] = {}
    for term in sp.Add.make_args(expr):
        for s in term.free_symbols & moving:
            slopes.setdefault(s, []).append(slope_by(term, s))
    return {s: _named(sp.Add(*slopes[s]), found, unused_symbols) for s in sorted(slopes, key=str)}


def slope_by(expr: sp.Expr, s: sp.Symbol) -> sp.Expr:
    """Return the derivative of ``expr`` by ``s`` between jumps; each part is differentiated once, however often."""
    moving, found = parts_with(expr, s), {s: sp.S.One}

    def slope(part: sp.Expr) -> sp.Expr:
        if part not in found:
            rests = part not in moving or isinstance(part, _STANDING)
            found[part] = sp.S.Zero if rests else _slope(part, s, slope, part.is_Pow and part.exp in moving)
        return found[part]

    return slope(expr)


def is_bent(exprs: Iterable[sp.Expr], states: tuple[sp.Symbol, ...]) -> bool:
    """Tell whether the slope of an expression by a state depends on a state."""
    moving = {*states}
    return any(symbols_in(slope_by(expr, s)) & moving for expr in exprs for s in states)


def _slope(expr: sp.Expr, s: sp.Symbol, slope: Callable[[sp.Expr], sp.Expr], towering: bool) -> sp.Expr:
    """Return the derivative of ``expr`` from that of its parts, by SymPy only where simple rules do not do."""
    if expr.is_Add:
        return sp.Add(*map(slope, expr.args))
    if expr.is_Mul:
        slopes = enumerate(map(slope, expr.args))
        return sp.Add(*(sp.Mul(*expr.args[:k], part, *expr.args[k + 1 :]) for k, part in slopes if part != 0))
    if expr.is_Pow and not towering:
        return _slope_of_power(expr.base, expr.exp, slope(expr.base))
    if isinstance(expr, sp.Piecewise):  # SymPy compares all conditions anew, which takes minutes for a table
        pieces = [(slope(piece), condition) for piece, condition in expr.args]
        return sp.Piecewise(*pieces, evaluate=False) if any(part for part, _ in pieces) else sp.S.Zero
    if isinstance(expr, sp.Mod):
        number, divisor = expr.args
        return slope_by(number - divisor * sp.floor(number / divisor), s)
    if isinstance(expr, sp.Function | sp.Max | sp.Min):
        with suppress(ArgumentIndexError):
            found = [(expr.fdiff(k), part) for k, e in enumerate(expr.args, 1) if (part := slope(e)) != 0]
            if isinstance(expr, AppliedUndef) or not any(isinstance(by, sp.Derivative) for by, _ in found):
                return sp.Add(*(by * part for by, part in found))
        raise InputError(f"{expr} has no derivative by {s} that can be written; give another function")
    return expr * slope_by(expr.exp * sp.log(expr.base), s) if expr.is_Pow else expr.diff(s)


def _slope_of_power(base: sp.Expr, exponent: sp.Expr, slope: sp.Expr) -> sp.Expr:
    """Return the derivative of a power; that of a root is 0 where ``slope`` is 0, even if its base vanishes."""
    finite = exponent.is_integer or exponent.is_negative or (exponent - 1).is_nonnegative or base.is_positive
    if finite or isinstance(base, Penetration) or slope == 0:
        return exponent * base ** (exponent - 1) * slope
    return exponent * RootSlope(slope, base, exponent - 1)


def _moved(partials: dict[sp.Symbol, sp.Expr], rates: _Rates) -> sp.Expr:
    return total(product(partial, rates[s]) for s, partial in partials.items() if rates[s] != 0)


def _named(expr: sp.Expr, found: Parts, unused_symbols: Iterator[sp.Symbol]) -> sp.Expr:
    if expr.is_Atom or (expr.is_Mul and (-expr).is_Atom):
        return expr
    symbol = next(unused_symbols)
    found.append((symbol, expr))
    return symbol
