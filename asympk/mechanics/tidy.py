"""Short forms of fractions in sines and cosines, with a normal form that decides whether one vanishes.

In a polynomial in cos(a_i) and sin(a_i) every sin^2 is replaced by 1 - cos^2, or the other way round; sums of angles
are expanded first, so either form is unique and vanishes only with the expression.
"""

from collections.abc import Iterator
from functools import cache, lru_cache, reduce

import sympy as sp
from sympy.polys.matrices import DomainMatrix
from sympy.simplify.fu import TR10i

from asympk.symbolic.long import generic_place, is_longer

LONG = 150  # operations: beyond, a shorter form costs seconds and is not readable either
CLEAR = 1e-9  # a value that fifteen digits tell from 0


@lru_cache(maxsize=4096)
def tidy(expr: sp.Expr) -> sp.Expr:
    """Return the shortest of a few forms of ``expr``: as it stands, factored, or with the squares of one function.

    An expression of more than ``LONG`` operations is returned as it stands.
    """
    if is_longer(expr, LONG):
        return expr
    plain = sp.cancel(sp.together(expr))
    if not plain.has(sp.sin, sp.cos):
        return shortest(expr, sp.factor(plain))
    return shortest(expr, plain, *map(sp.factor, dict.fromkeys(_normal_forms(plain))))


def contracted(expr: sp.Expr) -> sp.Expr:
    """Return ``tidy(expr)``, or, where shorter, its factors with sines and cosines of sums of angles.

    It is for formulas that are read: to tidy what is made of it takes longer.
    """
    if is_longer(expr, LONG):
        return expr
    return shortest(tidy(expr), TR10i(sp.factor(sp.together(expr))))


def expanded_determinant(matrix: sp.Matrix) -> sp.Expr:
    """Return the determinant, expanded: that of a matrix of polynomials in what is no symbol, as sines are not."""
    functions = {f: sp.Dummy() for entry in matrix for f in entry.atoms(sp.Function)}
    polynomials = DomainMatrix.from_Matrix(matrix.xreplace(functions))
    found = polynomials.domain.to_sympy(polynomials.det())
    return sp.expand(found.xreplace({name: f for f, name in functions.items()}))


def cofactors(matrix: sp.Matrix) -> tuple[sp.Matrix, sp.Expr]:
    """Return (adjugate, determinant), minors within minors, which are not expanded: n of them share all the others."""

    @cache
    def minor(rows: tuple[int, ...], columns: tuple[int, ...]) -> sp.Expr:
        if not rows:
            return sp.S.One
        kept = [(k, matrix[rows[0], c]) for k, c in enumerate(columns) if matrix[rows[0], c] != 0]
        return sp.Add(*((-1) ** k * e * minor(rows[1:], columns[:k] + columns[k + 1 :]) for k, e in kept))

    every = tuple(range(matrix.rows))
    but = [every[:k] + every[k + 1 :] for k in every]
    adjugate = sp.Matrix([[(-1) ** (i + j) * minor(but[j], but[i]) for j in every] for i in every])
    return adjugate, minor(every, every)


def vanishes(expr: sp.Expr) -> bool:
    """Tell whether ``expr`` is 0 for all values of its symbols; at one place it mostly shows that it is not."""
    value = expr.evalf(subs=generic_place(expr))
    if isinstance(value, sp.Float) and abs(value) > CLEAR:
        return False
    return tidy(expr) == 0 or sp.simplify(expr) == 0


def shortest(*forms: sp.Expr) -> sp.Expr:
    """Return the form of fewest operations."""
    return min(forms, key=_length)


def _length(form: sp.Expr) -> tuple:
    """Order by operations, then by negative numbers: 1 + 3 cos^2 rather than 4 - 3 sin^2."""
    negative = sum(number.is_negative for number in form.atoms(sp.Number))
    return form.count_ops(), negative, sp.default_sort_key(form)


def _normal_forms(expr: sp.Expr) -> Iterator[sp.Expr]:
    """Yield a cancelled fraction without squares of sines, and without squares of cosines."""
    expanded = sp.expand_trig(expr)
    angles = sorted({part.args[0] for part in expanded.atoms(sp.sin, sp.cos)}, key=sp.default_sort_key)
    names = {angle: (sp.Symbol(f"sine#{k}"), sp.Symbol(f"cosine#{k}")) for k, angle in enumerate(angles)}
    renamed = {f(angle): names[angle][k] for angle in angles for k, f in enumerate((sp.sin, sp.cos))}
    plain = expanded.xreplace(renamed)
    parts = sp.fraction(plain if expanded == expr else sp.cancel(plain))
    back = {name: function for function, name in renamed.items()}
    for square in (0, 1):
        relations = [(pair[square], pair[0] ** 2 + pair[1] ** 2 - 1) for pair in names.values()]
        numerator, denominator = (reduce(_remainder, relations, part) for part in parts)
        yield sp.cancel(numerator / denominator).xreplace(back)


def _remainder(expr: sp.Expr, relation: tuple[sp.Symbol, sp.Expr]) -> sp.Expr:
    name, circle = relation
    squared = any(power.base == name for power in expr.atoms(sp.Pow))
    return sp.rem(expr, circle, name) if squared and expr.is_polynomial(name) else expr
