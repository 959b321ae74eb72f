"""Short forms of fractions in sines and cosines, and a normal form that decides whether a fraction vanishes.

In a polynomial in cos(a_i) and sin(a_i) every sin^2 is replaced by 1 - cos^2, or every cos^2 by 1 - sin^2. Sums of
angles are expanded first. Either form is therefore unique, and is 0 only if the expression vanishes.
"""

from collections.abc import Callable, Iterator
from functools import cache, lru_cache, reduce

import sympy as sp
from sympy.polys.matrices import DomainMatrix
from sympy.simplify.fu import TR10i

from asympk.symbolic.long import (
    factorises,
    functions_named,
    has_many_terms,
    in_factors,
    is_clearly_nonzero,
    is_longer,
    is_many_quotients,
    named_exponentials,
    replaced,
)

MOST = 12  # symbols and functions in a matrix by which a system is solved in their field; with 20 it may not end
ROWS = 5  # full rows of such a matrix; five take seconds
LONG = 150  # operations beyond which a shorter form costs seconds and would not be readable


@lru_cache(maxsize=4096)
def tidy(expr: sp.Expr) -> sp.Expr:
    """Return the shortest of a few forms of ``expr``: unchanged, factored, or with squares of one function only.

    An expression of more than ``LONG`` operations is returned unchanged. Sines of sums are not expanded where the
    expanded expression would be longer than that. Exponentials that SymPy would split, or take to be high powers of
    one, have names meanwhile (``named_exponentials``).
    """
    if is_longer(expr, LONG):
        return expr
    names, meaning = named_exponentials(expr)
    if names:
        return replaced(tidy(replaced(expr, names)), meaning)
    plain = sp.cancel(sp.together(expr))
    expanded = sp.expand_trig(plain)
    if not plain.has(sp.sin, sp.cos) or (expanded != plain and is_longer(expanded, LONG)):
        return shortest(expr, sp.factor(plain))
    return shortest(expr, plain, *map(sp.factor, dict.fromkeys(_normal_forms(plain, expanded))))


def contracted(expr: sp.Expr) -> sp.Expr:
    """Return ``tidy(expr)`` or, if shorter, its tidy factors with sines and cosines of sums of angles.

    This form is for formulas that a user reads: to tidy expressions made from it takes longer.
    """
    if is_longer(expr, LONG):
        return expr
    powers = (factor.as_base_exp() for factor in sp.Mul.make_args(sp.factor(sp.together(expr))))
    return shortest(tidy(expr), TR10i(sp.Mul(*(tidy(base) ** exponent for base, exponent in powers))))


def in_sums_of_angles(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` or, if shorter, its products with sines and cosines of sums of angles; as it stands if long."""
    return expr if is_longer(expr, LONG) else shortest(expr, TR10i(sp.expand_mul(expr)))


def in_normal_form(expr: sp.Expr) -> sp.Expr:
    """Return the shortest normal form of a polynomial in sines and cosines, however long; any other as it stands."""
    if not is_polynomial(expr):
        return expr
    expanded = multiplied_out(sp.expand_trig(expr))
    return shortest(expr, *map(sp.factor_terms, _normal_forms(expanded, expanded)))


def in_lowest_terms(expr: sp.Expr) -> sp.Expr:
    """Return a fraction in functions, such as sines, in the factors of its shortest normal form.

    If that is shorter, its own factors are brought into shortest forms one by one: the square of a sum, which a normal
    form spreads, and sines of sums of angles. An expression that may not be factored is returned as it is.
    """
    if not factorises(expr):
        return expr
    powers = (factor.as_base_exp() for factor in sp.Mul.make_args(in_factors(expr)))
    each = ((shortest(base, *_normal_forms(base, base)), power) for base, power in powers)
    by_factors = sp.Mul(*(in_sums_of_angles(base) ** power for base, power in each))
    return shortest(in_factors(shortest(*_normal_forms(expr, expr))), by_factors)


def solved(matrix: sp.Matrix, right: sp.Matrix) -> list[sp.Expr] | None:
    """Return the solution of M x = v in lowest terms, in the field of its symbols and functions.

    None beside roots, and where common divisors would be sought for long: in more than ``MOST`` symbols and functions,
    of many terms, or in more than ``ROWS`` rows of several entries.
    """
    plain, meaning = functions_named(sp.Matrix.hstack(matrix, right).as_immutable())
    coupled = sum(sum(entry != 0 for entry in row) > 1 for row in matrix.tolist())
    many = coupled > ROWS or len(plain.free_symbols) > MOST
    if many or has_many_terms(plain) or is_many_quotients(plain):
        return None
    if (entries := plain.to_DM().to_field()).domain.is_EXRAW:
        return None
    found = entries[:, : matrix.cols].lu_solve(entries[:, matrix.cols :]).to_Matrix()
    return [in_lowest_terms(replaced(entry, meaning)) for entry in found]


def is_polynomial(expr: sp.Expr) -> bool:
    """Tell whether ``expr``, as it stands, is a polynomial in its symbols and functions."""
    return bool(functions_named(expr)[0].is_polynomial())


def collected(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` with products expanded and common factors taken out; as it stands if long and no polynomial."""
    return expr if is_longer(expr, LONG) and not is_polynomial(expr) else sp.factor_terms(sp.expand_mul(expr))


def multiplied_out(expr: sp.Expr) -> sp.Expr:
    """Return ``sp.expand(expr)`` with functions as they stand: parts into which it splits exp(-(x - 9)^2) overflow."""
    plain, meaning = functions_named(expr)
    return replaced(sp.expand(plain), meaning)


def expanded_determinant(matrix: sp.Matrix) -> sp.Expr:
    """Return the expanded determinant, computed with a symbol in place of every function, such as a sine."""
    plain, meaning = functions_named(sp.Matrix(matrix).as_immutable())
    polynomials = DomainMatrix.from_Matrix(plain)
    return replaced(sp.expand(polynomials.domain.to_sympy(polynomials.det())), meaning)


def expanded_adjugate(matrix: sp.Matrix) -> sp.Matrix:
    """Return the adjugate with expanded entries, computed with a symbol in place of every function, such as a sine."""
    plain, meaning = functions_named(sp.Matrix(matrix).as_immutable())
    adjugate = DomainMatrix.from_Matrix(plain).adj_det()[0].to_Matrix()
    return adjugate.applyfunc(lambda entry: replaced(sp.expand(entry), meaning))


def cofactors(matrix: sp.Matrix) -> tuple[sp.Matrix, sp.Expr]:
    """Return (adjugate, determinant) by nested minors, which are not expanded and are shared between the cofactors."""
    every, minor = tuple(range(matrix.rows)), _minors(matrix)
    but = [every[:k] + every[k + 1 :] for k in every]
    adjugate = sp.Matrix([[(-1) ** (i + j) * minor(but[j], but[i]) for j in every] for i in every])
    return adjugate, minor(every, every)


def has_long_minors(matrix: sp.Matrix) -> bool:
    """Tell whether the determinant by nested minors has more than ``LONG`` operations, by the first minor that has."""
    every = tuple(range(matrix.rows))
    try:
        _minors(matrix, LONG)(every, every)
    except OverflowError:
        return True
    return False


def _minors(matrix: sp.Matrix, longest: int | None = None) -> Callable[..., sp.Expr]:
    """Return the function of rows and columns that gives their minor; raises ``OverflowError`` if one is longer."""

    @cache
    def minor(rows: tuple[int, ...], columns: tuple[int, ...]) -> sp.Expr:
        if not rows:
            return sp.S.One
        kept = [(k, matrix[rows[0], c]) for k, c in enumerate(columns) if matrix[rows[0], c] != 0]
        below = ((-1) ** k * e * minor(rows[1:], columns[:k] + columns[k + 1 :]) for k, e in kept)
        found = sp.Add(*below)
        if longest is not None and is_longer(found, longest):
            raise OverflowError
        return found

    return minor


def vanishes(expr: sp.Expr) -> bool:
    """Tell whether ``expr`` is 0 for all values of its symbols; its value at one place shows most that are not 0."""
    return not is_clearly_nonzero(expr) and (tidy(expr) == 0 or sp.simplify(expr) == 0)


def shortest(*forms: sp.Expr) -> sp.Expr:
    """Return the form of fewest operations."""
    return min(forms, key=_length)


def _length(form: sp.Expr) -> tuple:
    """Return a key that orders by operations, then by negative numbers: 1 + 3 cos^2 comes before 4 - 3 sin^2."""
    negative = sum(number.is_negative for number in form.atoms(sp.Number))
    return form.count_ops(), negative, sp.default_sort_key(form)


def _normal_forms(expr: sp.Expr, expanded: sp.Expr) -> Iterator[sp.Expr]:
    """Yield a cancelled fraction without squares of sines, and without squares of cosines."""
    angles = sorted({part.args[0] for part in expanded.atoms(sp.sin, sp.cos)}, key=sp.default_sort_key)
    names = {angle: (sp.Symbol(f"sine#{k}"), sp.Symbol(f"cosine#{k}")) for k, angle in enumerate(angles)}
    renamed = {f(angle): names[angle][k] for angle in angles for k, f in enumerate((sp.sin, sp.cos))}
    plain = expanded.xreplace(renamed)
    parts = sp.fraction(plain if expanded == expr else sp.cancel(plain))
    back = {name: function for function, name in renamed.items()}
    for square in (0, 1):
        relations = [(pair[square], 1 - pair[1 - square] ** 2) for pair in names.values()]
        numerator, denominator = (reduce(_remainder, relations, part) for part in parts)
        yield sp.cancel(numerator / denominator).xreplace(back)


def _remainder(expr: sp.Expr, relation: tuple[sp.Symbol, sp.Expr]) -> sp.Expr:
    name, square = relation
    if not (any(power.base == name for power in expr.atoms(sp.Pow)) and expr.is_polynomial(name)):
        return expr
    expanded = multiplied_out(expr)
    powers = (power for power in expanded.atoms(sp.Pow) if power.base == name)
    return expanded.xreplace({p: name ** (p.exp % 2) * square ** (p.exp // 2) for p in powers})
