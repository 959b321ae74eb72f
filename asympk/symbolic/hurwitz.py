r"""Where the roots of a real polynomial lie in the complex plane, as conditions on its coefficients.

For p = c_n s^n + ... + c_0, c_n > 0, all real parts are negative where the Hurwitz determinants are positive. With
p(i w) = E(u) + i w O(u), u = -w^2, a root lies on the imaginary axis where c_0 = 0 or E and O share a root u < 0. Their
resultant vanishes there, and their lowest subresultant that does not vanish is their greatest common divisor
(Gantmacher, The Theory of Matrices, chapter XV). ``_off_axis`` is the hard function. The conditions are on the
roots of several polynomials, as the eigenvalues of a matrix are those of the blocks on its diagonal (``spectra``).
"""

import sympy as sp

from asympk.errors import NotDerivable
from asympk.symbolic.conditions import reduce_under
from asympk.symbolic.long import (
    entries_named,
    functions_named,
    has_many_terms,
    in_factors,
    is_clearly_nonzero,
    is_many_quotients,
    named_exponentials,
    replaced,
)
from asympk.symbolic.signs import conjunction, nonzero
from asympk.symbolic.tidy import in_lowest_terms, tidy
from asympk.symbolic.values import in_words

Spectra = tuple[tuple[sp.Expr, ...], ...]  # the coefficients of polynomials, each from the highest
_U = sp.Dummy("u", real=True)


def characteristic(matrix: sp.Matrix) -> tuple[sp.Expr, ...]:
    """Return the coefficients of det(s - matrix), from the highest."""
    names, own = named_exponentials(sp.Tuple(*matrix))
    long = {entry: sp.Dummy() for entry in matrix if has_many_terms(entry) or is_many_quotients(entry)}
    named, functions = functions_named(matrix.xreplace(names | long).as_immutable())
    entries = named.to_DM()  # ``Matrix.charpoly`` compares the entries of blocks, and fails at a root
    own |= {name: entry for entry, name in long.items()}
    found = (replaced(replaced(entries.domain.to_sympy(c), functions), own) for c in entries.charpoly_base())
    if entries.domain.is_EXRAW:
        return tuple(map(tidy, found))
    return tuple(map(in_lowest_terms, found) if functions else found)


def spectra(matrix: sp.Matrix) -> Spectra:
    """Return the characteristic polynomials of the blocks on the diagonal of a matrix, whose rows are so ordered."""
    blocks = matrix.strongly_connected_components()
    return tuple(tuple(map(in_factors, characteristic(matrix.extract(block, block)))) for block in blocks)


def attracting(polynomials: Spectra, assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which all roots have negative real parts; coefficients from the highest, c_n > 0."""
    return conjunction([(d, 1) for p in polynomials for d in _determinants(p)], assumptions)


def repelling(polynomials: Spectra, assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which all roots have positive real parts; coefficients from the highest, c_n > 0."""
    return attracting(tuple(tuple((-1) ** k * c for k, c in enumerate(p)) for p in polynomials), assumptions)


def split(polynomials: Spectra, assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which roots lie on both sides of the imaginary axis and none on it."""
    roots = sum(len(p) - 1 for p in polynomials)
    if roots == 1:
        return sp.false
    if roots == 2:
        return conjunction([(sp.Mul(*(p[-1] for p in polynomials)), -1)], assumptions)
    sides = attracting(polynomials, assumptions), repelling(polynomials, assumptions)
    return reduce_under(sp.And(off_axis(polynomials, assumptions), *map(sp.Not, sides)), assumptions)


def off_axis(polynomials: Spectra, assumptions: sp.Basic = sp.true) -> sp.Basic:
    """Return the condition under which no root of the polynomials lies on the imaginary axis, as ``_off_axis`` does."""
    return reduce_under(sp.And(*(_off_axis(p, assumptions) for p in polynomials)), assumptions)


def _off_axis(coefficients, assumptions):
    """Return the condition under which no root lies on the imaginary axis, False where one always does.

    With seven roots or more the condition is False also where E and O share three roots u at the same parameters, even
    if none is negative. Raises ``NotDerivable`` where they always share three roots or more, not all numbers.
    """
    coefficients = sp.Tuple(*coefficients)
    names, own = named_exponentials(coefficients)
    coefficients = coefficients.xreplace(names)
    last = coefficients[-1]
    if last == 0:
        return sp.false
    if len(coefficients) == 2:
        return nonzero(last, assumptions).xreplace(own)
    shared, sequence = _in_names(coefficients) or _subresultants(coefficients)
    conditions = [nonzero(last, assumptions)]
    if shared.degree() > 0:
        conditions.append(_no_negative_root(shared, assumptions))
    if any(r.degree() > 0 for r in sequence):
        conditions.append(_no_common_negative_root(sequence, assumptions))
    return sp.And(*conditions).xreplace(own)


def _subresultants(coefficients):
    """Return (their greatest common divisor, the subresultants without it) of E and O, p(i w) = E(u) + i w O(u)."""
    rising = coefficients[::-1]  # u = -w^2
    even, odd = (sp.Poly(rising[start::2][::-1] or [0], _U) for start in (0, 1))
    if odd.degree() == 0:  # a constant and E share no factor, which SymPy would seek long
        return sp.Poly(1, _U), [even, odd]
    shared = sp.gcd(even, odd)
    return shared, sp.subresultants(*(sp.quo(part, shared) for part in (even, odd)))


def _in_names(coefficients):
    """Return ``_subresultants`` of coefficients, computed with a name for each; () where these may be special.

    They are those of the names where no leading coefficient vanishes at the coefficients.
    """
    names, meaning = entries_named(sp.Matrix([*coefficients]))
    shared, sequence = _subresultants(sp.Tuple(*names))
    found = [[replaced(c, meaning) for c in part.all_coeffs()] for part in sequence]
    if shared.degree() > 0 or not all(is_clearly_nonzero(lead) for lead, *_ in found):
        return ()
    return shared, [sp.Poly(part, _U, domain="EX") for part in found]


def _no_common_negative_root(sequence, assumptions):
    """Return the condition under which E and O, whose subresultants are given, share at most two roots and none < 0."""
    cases = [nonzero(sequence[-1].as_expr(), assumptions)]
    for degree in (1, 2):
        vanish = [sp.Eq(c, 0) for r in sequence if 0 < r.degree() < degree for c in r.all_coeffs()]
        cases += [sp.And(*vanish, _no_negative_root(r, assumptions)) for r in sequence if r.degree() == degree]
    return sp.Or(*cases)


def _no_negative_root(poly, assumptions):
    """Return the condition under which a polynomial in u, not 0 at 0, has no root u < 0."""
    lead, *rest = poly.all_coeffs()
    if len(rest) == 1:
        return conjunction([(-lead * rest[0], 1)], assumptions)
    if len(rest) == 2:
        complex_pair = conjunction([(4 * lead * rest[1] - rest[0] ** 2, 1)], assumptions)
        return sp.Or(complex_pair, conjunction([(lead * rest[1], 1), (-lead * rest[0], 1)], assumptions))
    if not poly.free_symbols_in_domain:
        return sp.sympify(poly.count_roots(None, 0) == 0, strict=True)
    raise NotDerivable(f"{2 * len(rest)} eigenvalues lie in pairs of opposite sign; put numbers in for "
                       f"{in_words(poly.free_symbols_in_domain)} to tell centres from saddles")


def _determinants(coefficients):
    """Return the Hurwitz determinants of orders 1 to n - 1, and c_0 in place of the last."""
    names, meaning = entries_named(sp.Matrix([*coefficients]))
    n, table = len(names) - 1, sp.Matrix(len(names) - 1, len(names) - 1, lambda i, j: (
        names[2 * j - i + 1] if 0 <= 2 * j - i + 1 < len(names) else 0))
    minors = (table[:k, :k].det(method="berkowitz") for k in range(1, n))
    return *(replaced(minor, meaning) for minor in minors), coefficients[-1]
