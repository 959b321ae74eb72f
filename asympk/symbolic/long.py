"""Long expressions, which contain the same part many times: each part is visited once, and none is expanded."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from functools import lru_cache, partial, reduce
from itertools import count, islice
from math import comb, lcm, prod
from operator import add, or_
from typing import Any

import sympy as sp
from sympy.core.operations import AssocOp

from asympk.multiprecision import private_context
from asympk.symbolic.diffring import NOT_SMOOTH

PARTS = 4  # a bound on the parts of a tree, without atoms, for one operation: -a/b in a sum has two and two
LONG = 300  # operations; a rational expression divided by a sum is not expanded if it has more
FEW_FUNCTIONS = 4  # functions as generators, such as sines and cosines of two angles, with which SymPy factors fast
DEGREE = 160  # of powers; SymPy factors polynomials of a higher degree for minutes
TERMS = 10_000  # of an expanded product, before like ones are collected; SymPy takes a second for so many
COLLECTED = 128  # once like ones are; SymPy factors so many in seconds, however many there were before
QUOTIENTS = 1000  # terms of a sum of quotients over a common denominator; with more SymPy seeks divisors for minutes
HIGH = 4  # the highest power of an exponential with which SymPy factors fast
ROUGH = 1e-6  # a difference of values, relative to their size, that is not rounding
CLEAR = 1e-9  # size above which a value of DIGITS digits is certainly not 0
DIGITS = 50
SPARE = 10  # digits that the entries of a matrix have beyond those in which it is found singular
_Monomial = frozenset[tuple[sp.Basic, int]]  # of the powers of its parts
_ONE = frozenset({_Monomial()})


def replaced(expr: sp.Basic, rule: Mapping[sp.Basic, sp.Basic]) -> sp.Basic:
    """Return ``expr.xreplace(rule)``; each part is rebuilt once, however often it occurs."""
    found: dict[int, tuple[sp.Basic, sp.Basic]] = {}  # by identity: to compare equal objects takes a visit of each part
    same: dict[sp.Basic, sp.Basic] = {}

    def rebuilt(part: sp.Basic) -> sp.Basic:
        if part in rule:
            return rule[part]
        if id(part) not in found:
            args = [rebuilt(arg) for arg in part.args]
            changed = any(new is not old for new, old in zip(args, part.args, strict=True))
            new = remade(part.func, *args) if changed else part
            found[id(part)] = part, same.setdefault(new, new)
        return found[id(part)][1]

    return rebuilt(expr) if rule else expr


def carried_out(expr: sp.Basic) -> sp.Basic:
    """Return ``expr.doit()``; each part is rebuilt once, however often it occurs."""
    found: dict[sp.Basic, sp.Basic] = {}

    def done(part: sp.Basic) -> sp.Basic:
        if part not in found:
            plain = type(part).doit in (sp.Basic.doit, AssocOp.doit)
            found[part] = remade(part.func, *map(done, part.args)) if part.args and plain else part.doit()
        return found[part]

    return done(expr)


def remade(func: Any, *args: sp.Basic) -> sp.Basic:
    """Return ``func(*args)``; of long ones a minimum as it stands, of which SymPy would compare each two."""
    if func is sp.Abs:
        return modulus(*args)
    if func in (sp.Min, sp.Max) and len({*args}) > 1 and any(is_longer(arg, 60) for arg in args):
        return func(*args, evaluate=False)
    return func(*args)


def modulus(expr: sp.Expr) -> sp.Expr:
    """Return the absolute value of an expression, which SymPy would expand; of a heavy one as it stands."""
    return sp.Abs(expr, evaluate=not heavy(expr))


def atoms(expr: sp.Basic, *types: type) -> set[Any]:
    """Return ``expr.atoms(*types)``; each part is visited once, however often it occurs."""
    return {part for part in parts_of(expr) if isinstance(part, types)}


def parts_of(expr: sp.Basic) -> Collection[sp.Basic]:
    """Return an expression and all parts of it; each is visited once, however often it occurs."""
    seen, left = dict[int, sp.Basic](), [expr]  # by identity, as in ``replaced``
    while left:
        if id(part := left.pop()) not in seen:
            seen[id(part)] = part
            left += part.args
    return seen.values()


def parts_with(expr: sp.Basic, symbol: sp.Symbol) -> set[sp.Basic]:
    """Return the parts of ``expr`` that contain ``symbol``; each part is visited once, however often it occurs."""
    found = {symbol: True}

    def contains(part: sp.Basic) -> bool:
        if part not in found:
            found[part] = any([*map(contains, part.args)])  # visits every argument
        return found[part]

    contains(expr)
    return {part for part, inside in found.items() if inside}


def symbols_in(expr: sp.Basic) -> set[sp.Symbol]:
    """Return the symbols of an expression; each part is visited once, however often it occurs."""
    return atoms(expr, sp.Symbol)


def is_longer(expr: sp.Basic, operations: int) -> bool:
    """Tell whether an expression has more operations than ``operations``, without counting all parts of a long one."""
    parts = (part for part in sp.preorder_traversal(expr) if part.args)
    many = PARTS * operations + 1
    return sum(1 for _ in islice(parts, many)) == many or expr.count_ops() > operations


@lru_cache(maxsize=1024)
def heavy(expr: sp.Basic) -> bool:
    """Tell whether an expression is too long to expand, or would have too many terms.

    Too long are 60 operations, or ``LONG`` in a quotient of polynomials.
    """
    return is_long(expr) or has_many_terms(expr)


def is_long(expr: sp.Basic) -> bool:
    """Tell whether an expression has too many operations to be expanded, whatever the number of its terms."""
    quotient = _is_rational(expr)
    long = bool(not quotient or _divisors(expr)) and is_longer(expr, LONG if quotient else 60)
    return long or is_many_quotients(expr)


def is_many_quotients(expr: sp.Basic) -> bool:
    """Tell whether a part of an expression has too many terms over a common denominator, however few it has itself."""
    return any(below and above > QUOTIENTS for above, below in map(_terms_over, parts_of(expr)))


def has_many_terms(expr: sp.Basic) -> bool:
    """Tell whether an expression, or a part of it, has too many terms to be factored where it is expanded.

    These are more than ``TERMS`` before like ones are collected, and more than ``COLLECTED`` after that.
    """
    return _terms(expr) > TERMS and has_more_terms(expr, COLLECTED)


def has_more_terms(expr: sp.Basic, most: int) -> bool:
    """Tell whether an expression, or a part of it, has more than ``most`` terms once it is expanded."""
    return _terms(expr) > most and _monomials(expr, most) is None


@lru_cache(maxsize=4096)
def _terms(expr: sp.Basic) -> int:
    """Return a bound of the number of terms of an expanded expression, which is counted to ``TERMS`` + 1."""
    parts, found = [_terms(part) for part in expr.args], 1
    if max(parts, default=0) > TERMS:
        return TERMS + 1
    if expr.is_Add or expr.is_Mul:
        found = (sum if expr.is_Add else prod)(parts)
    elif expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive and parts[0] > 1:
        power = min(int(expr.exp), TERMS)
        found = comb(power + parts[0] - 1, power)
    return min(found, TERMS + 1)


@lru_cache(maxsize=4096)
def _terms_over(expr: sp.Basic) -> tuple[int, Counter[sp.Basic]]:
    """Return (a bound of the terms of the numerator, {divisor: power}) over a common denominator, as ``_quotient``."""
    if expr.is_Pow and expr.exp.is_Integer:
        apart = sp.factor_terms(expr.base) if expr.exp.is_negative else expr.base
        if apart.is_Mul:  # divisors that differ by a factor are one
            return _terms_over(sp.Mul(*(factor**expr.exp for factor in apart.args)))
        above, below = _terms_over(expr.base)
        power = min(abs(int(expr.exp)), TERMS)
        raised = Counter({base: power * k for base, k in below.items()})
        if expr.exp.is_negative:
            return _terms_in(raised), Counter({expr.base: power} if above > 1 else {})
        return min(comb(power + above - 1, power), TERMS + 1), raised
    parts = [_terms_over(part) for part in expr.args] if expr.is_Add or expr.is_Mul else []
    if expr.is_Add:
        common = reduce(or_, (below for _, below in parts))
        return min(sum(above * _terms_in(common - below) for above, below in parts), TERMS + 1), common
    return min(prod(above for above, _ in parts), TERMS + 1), reduce(add, (b for _, b in parts), Counter[sp.Basic]())


def _terms_in(powers):
    """Return a bound of the terms of a product of powers of divisors."""
    return prod(min(_terms_over(base)[0], TERMS) ** min(k, DEGREE) for base, k in powers.items())


@lru_cache(maxsize=4096)
def _monomials(expr: sp.Basic, most: int) -> frozenset[_Monomial] | None:
    """Return the monomials of an expanded expression, or None where it or a part of it has more than ``most``."""
    parts = [found for part in expr.args if (found := _monomials(part, most)) is not None]
    if len(parts) < len(expr.args):
        return None
    if expr.is_Add:
        found = frozenset[_Monomial]().union(*parts)
        return found if len(found) <= most else None
    multiplied = partial(_multiplied, most=most)
    if expr.is_Mul:
        return reduce(multiplied, parts)
    if expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive:
        return reduce(lambda found, bit: multiplied(multiplied(found, found), parts[0] if bit == "1" else _ONE),
                      f"{int(expr.exp):b}", _ONE)
    return _ONE if expr.is_number else frozenset({frozenset({(expr, 1)})})


def _multiplied(first, second, most):
    if first is None or second is None:
        return None
    found = frozenset(frozenset((Counter(dict(a)) + Counter(dict(b))).items()) for a in first for b in second)
    return found if len(found) <= most else None


@lru_cache(maxsize=1024)
def expands(expr: sp.Expr) -> bool:
    """Tell whether an expression may be expanded: it is not heavy, and no square of a sum is in a sum that divides it.

    Where 1 + (1000 (x - 2))^2 is least, the terms of its expansion cancel. A divisor that cancels does not count.
    """
    if heavy(expr):
        return False
    within = atoms(sp.Tuple(*_divisors(expr)), sp.Pow)
    squared = any(p.base.is_Add and p.exp.is_Integer and p.exp.is_positive for p in within)
    return not (squared and _divisors(sp.cancel(expr) if _is_rational(expr) else sp.expand(expr)))


def factorises(expr: sp.Expr) -> bool:
    """Tell whether an expression may be factored, which takes SymPy long where it has many functions as generators.

    With at most ``FEW_FUNCTIONS`` it may be if it is rational in these, or not much longer than ``LONG``. With a power
    beyond ``DEGREE``, or many terms where it is expanded, it may not.
    """
    powers = (p for p in atoms(expr, sp.Pow) if p.base.free_symbols)
    if has_many_terms(expr) or is_many_quotients(expr) or any(p.exp.is_Integer and abs(p.exp) > DEGREE for p in powers):
        return False
    plain, functions = functions_named(expr)
    if len(functions) > FEW_FUNCTIONS:
        return not is_longer(expr, LONG)
    return _is_rational(plain) or not is_longer(expr, 2 * LONG)


def _divisors(expr: sp.Expr) -> set[sp.Expr]:
    """Return the sums that divide an expression or a part of it."""
    return {p.base for p in atoms(expr, sp.Pow) if p.exp.is_negative and p.base.is_Add}


def expanded(expr: sp.Expr) -> sp.Expr:
    """Expand an expression that ``expands``, unless it is not rational and grows."""
    if not expands(expr):
        return expr
    found = sp.expand(expr)
    return found if _is_rational(expr) or found.count_ops() <= expr.count_ops() else expr


@lru_cache(maxsize=4096)
def tidied(expr: sp.Expr) -> sp.Expr:
    """Expand an expression that ``expands``; write quotients of polynomials over a common denominator.

    A quotient is not expanded before: that repeats its denominators in every term.
    """
    if not expands(expr) or not (_is_rational(expr) and any(power.exp.is_negative for power in atoms(expr, sp.Pow))):
        return expanded(expr)
    above, below = _quotient(expr) if expr.is_rational_function() else (expr, Counter[sp.Expr]())
    if not any(base.free_symbols for base in below):
        return expanded(expr)
    scale, above, divisor = sp.cancel((above, _product(below)))
    found = scale * above / divisor
    return found if divisor.free_symbols else expanded(found)


@lru_cache(maxsize=4096)
def unnested(expr: sp.Expr) -> sp.Expr:
    """Return an expression in which no sum that divides has a quotient of polynomials in it, unless that is long.

    SymPy does not end with 1/(2 + y/(2 + y/(2 + ...))) twenty levels deep, which is a quotient of short polynomials.
    """
    expr = expr.func(*map(unnested, expr.args)) if _divisors(expr) else expr
    inside = expr.is_Pow and expr.exp.is_Integer and expr.exp.is_negative and _divisors(expr.base)
    if not inside or not _is_rational(expr.base) or heavy(expr.base):
        return expr
    above, below = sp.fraction(sp.cancel(expr.base))
    return (above / below) ** expr.exp


def numerator_of(expr: sp.Expr) -> sp.Expr:
    """Return the numerator of a rational expression over a common denominator, not expanded; another one as it is."""
    return _quotient(expr)[0] if _is_rational(expr) else expr


def _quotient(expr: sp.Expr) -> tuple[sp.Expr, Counter[sp.Expr]]:
    """Return (numerator, {base: power}) of a rational expression over the powers by which its parts are divided.

    Common factors are not sought: in many symbols ``sp.together`` takes most of the time of ``sp.cancel`` for them.
    """
    if expr.is_Pow:
        above, below = _quotient(expr.base)
        power = abs(int(expr.exp))
        raised = Counter({base: power * k for base, k in below.items()})
        return (above**power, raised) if expr.exp > 0 else (_product(raised), Counter({above: power}))
    parts = [_quotient(part) for part in expr.args]
    if expr.is_Mul:
        return sp.Mul(*(above for above, _ in parts)), reduce(add, (below for _, below in parts))
    if expr.is_Add:
        common = reduce(or_, (below for _, below in parts))
        return sp.Add(*(above * _product(common - below) for above, below in parts)), common
    return expr, Counter()


def _product(powers: Counter[sp.Expr]) -> sp.Expr:
    return sp.Mul(*(base**power for base, power in powers.items()))


def in_factors(expr: sp.Expr) -> sp.Expr:
    """Return ``sp.factor(expr)``, with exponentials that would be high powers of one left as they are.

    An expression that may not be factored (``factorises``) is returned as it is.
    """
    return entries_in_factors(sp.Matrix([expr]))[0]


def entries_in_factors(matrix: sp.Matrix) -> sp.Matrix:
    """Return a matrix of entries in factors, as ``in_factors`` has them, with the same exponentials in all entries."""
    names, meaning = named_exponentials(sp.Tuple(*matrix))
    return matrix.xreplace(names).applyfunc(lambda e: sp.factor(e) if factorises(e) else e).xreplace(meaning)


def entries_named(matrix: sp.Matrix) -> tuple[sp.Matrix, dict[sp.Symbol, sp.Expr]]:
    """Return a matrix with a symbol for each entry that is not a number, and the mapping from symbols to entries."""
    names = matrix.applyfunc(lambda entry: entry if entry.is_number else sp.Dummy())
    return names, {s: entry for s, entry in zip(names, matrix, strict=True) if not entry.is_number}


def inverse_of(matrix: sp.Matrix) -> sp.Matrix:
    """Return the inverse of a regular matrix as its adjugate over its determinant, with names for its entries.

    SymPy's own asks whether pivots vanish, in vain for long where they have waves and exponentials.
    """
    names, meaning = entries_named(matrix)
    inverse = names.adjugate(method="berkowitz") / names.det(method="berkowitz")
    return inverse.applyfunc(lambda entry: replaced(entry, meaning))


def functions_named(expr: sp.Basic) -> tuple[sp.Basic, dict[sp.Expr, sp.Expr]]:
    """Return an expression with a name for each of its functions, such as a sine, and {name: function}."""
    names = {f: sp.Dummy() for f in atoms(expr, sp.Function)}
    return replaced(expr, names), {name: f for f, name in names.items()}


def named_exponentials(expr: sp.Basic) -> tuple[dict[sp.Expr, sp.Expr], dict[sp.Expr, sp.Expr]]:
    """Return {exponential: power of a name} and {name: exponential} where SymPy seeks factors or divisors long.

    It does so where exponentials are high powers of one: exp(x/10) and exp(x/18) are w^9 and w^5 for w = exp(x/90), and
    exp(-400 x) is w^400 for w = exp(-x). And it splits exp(x - y). Whole powers of one among them, products and
    quotients have no name of their own: with v = exp(x/10) and w = exp(y), exp(-x/5) is v^-2, and exp(y - x/10) is w/v.
    """
    found = sorted(atoms(expr, sp.exp), key=str)
    exponents = [sp.expand(e.exp) for e in found]
    slopes = [exponent.as_coeff_Add()[1] for exponent in exponents]
    ratios = [sp.cancel(slope / first) for first in [*filter(None, slopes)][:1] for slope in slopes]
    alike = all(ratio.is_Rational for ratio in ratios)
    multiples = [abs(slope.as_coeff_Mul(rational=True)[0]) for slope in slopes]
    common = lcm(*(multiple.q for multiple in multiples))
    if not any(slope.is_Add for slope in slopes) and all(multiple * common <= HIGH for multiple in multiples):
        return {}, {}
    names, bases, meaning = dict[sp.Expr, sp.Expr](), dict[sp.Expr, sp.Expr](), dict[sp.Expr, sp.Expr]()
    sizes = map(abs, ratios) if alike else map(sp.count_ops, exponents)
    for _, e, exponent in sorted(zip(sizes, found, exponents, strict=True), key=lambda part: part[0]):
        powers = ((w, sp.cancel(exponent / base)) for w, base in bases.items())
        known = next((w**k for w, k in powers if k.is_Integer), None) or _as_product(exponent, bases)
        names[e] = known or sp.Dummy(positive=True)
        if known is None:
            bases[names[e]], meaning[names[e]] = exponent, e
    return names, meaning


def _as_product(exponent: sp.Expr, bases: Mapping[sp.Expr, sp.Expr]) -> sp.Expr | None:
    """Return exp(exponent) as a product or quotient of names of exp(base), None if it is none.

    Not with higher powers, which SymPy factors slowly.
    """
    parts = [e.as_coefficients_dict() for e in (*bases.values(), exponent)]
    terms = dict.fromkeys(term for part in parts for term in part)
    reduced, pivots = sp.Matrix([[part[term] for part in parts] for term in terms]).rref()
    powers = [*reduced[: len(pivots), -1]]
    if len(bases) in pivots or not {*powers} <= {-1, 0, 1}:
        return None
    return sp.Mul(*([*bases][column] ** k for column, k in zip(pivots, powers, strict=True)))


def common_divisor(numbers: Iterable[sp.Rational]) -> sp.Rational:
    """Return the largest rational number of which all are whole multiples; ``sp.gcd_list`` stops at a 1 among them."""
    numbers = tuple(numbers)
    return sp.Rational(sp.igcd(0, *(k.p for k in numbers)), sp.ilcm(1, *(k.q for k in numbers)))


def _is_rational(expr: sp.Basic) -> bool:
    return not atoms(expr, sp.Function) and all(power.exp.is_Integer for power in atoms(expr, sp.Pow))


def generic_place(expr: sp.Basic) -> dict[sp.Symbol, sp.Expr]:
    """Return short numbers below 1 for the symbols of an expression: hardly anything vanishes there.

    They are quotients of neighbouring primes: no product of their powers and of numbers without these primes is 1.
    """
    return {s: sp.Rational(sp.prime(k), sp.prime(k + 1))
            for s, k in zip(sorted(symbols_in(expr), key=str), count(5, 2), strict=False)}


def valued(expr: sp.Basic, place: Mapping[sp.Symbol, sp.Expr], digits: int, real: bool = True) -> sp.Basic:
    """Return ``expr`` at a place in floating point; each part is computed once.

    Where a part has no value, or is not real and ``real`` is True, the result is nan. An imaginary part that may be
    rounding is left out.
    """
    found: dict[sp.Basic, sp.Basic] = {s: sp.Float(at, digits) for s, at in place.items()}

    def value(part: sp.Basic) -> sp.Basic:
        if part not in found:
            found[part] = worked_out(part)
        return found[part]

    def worked_out(part: sp.Basic) -> sp.Basic:
        try:
            new = part.func(*map(value, part.args)) if part.args else part
            if not (isinstance(new, sp.Expr) and new.args and new.is_number):
                return new
            number = new.evalf(digits)
        except (TypeError, ValueError):  # of erfinv(2), and where complex numbers are compared
            return sp.nan
        if real or number.is_real is not False:
            return sp.nan if number.is_real is False else number
        level, turned = number.as_real_imag()
        return level if abs(turned) <= abs(level) * sp.Float(10) ** (-digits // 2) else number

    return value(expr)


def is_clearly_nonzero(expr: sp.Expr) -> bool:
    """Tell whether ``expr`` is clearly not 0 at one generic place, in many digits; else it may vanish everywhere."""
    value = valued(expr, generic_place(expr), DIGITS)
    return isinstance(value, sp.Float | sp.Rational) and bool(abs(value) > CLEAR)


def has_no_inverse(matrix: sp.Matrix) -> bool | None:
    """Tell whether a square matrix is singular everywhere, by its ``pivots``; None where these are not known."""
    found = pivots(matrix)
    return None if found is None else len(found) < matrix.rows


def pivots(matrix: sp.Matrix) -> list[tuple[int, int]] | None:
    """Return (row, column) of each pivot of a matrix at one generic place, in many digits.

    They are as many as its rank, whatever its units. Functions with switches, which may be 0 there, count as symbols.
    None where it has no value at this place.
    """
    entries = replaced(sp.Tuple(*matrix), {f: sp.Dummy() for f in atoms(sp.Tuple(*matrix), *NOT_SMOOTH)})
    place = generic_place(entries)
    found = sp.Matrix(*matrix.shape, [valued(entry, place, DIGITS, real=False) for entry in entries])
    if not all(e.is_number and e.is_finite for e in found):
        return None
    m, least = private_context(DIGITS), 10.0 ** (SPARE - DIGITS)
    rows = [[m.convert(e._to_mpmath(m.prec)) for e in row] for row in found.tolist()]
    for _ in range(2):  # the rows, then the columns, are divided by their largest entries
        sizes = [max(map(abs, row)) for row in rows]
        sizes = [size if size > least * max(sizes) else m.one for size in sizes]  # a small one may be rounding
        scaled = [[e / size for e in row] for row, size in zip(rows, sizes, strict=True)]
        rows = [[*column] for column in zip(*scaled, strict=True)]
    return [*_eliminated({i: {j: e for j, e in enumerate(row) if e} for i, row in enumerate(rows)}, least)]


def _eliminated(rows, least):
    """Yield the places of pivots, of which each is the largest entry that is left; zeros are no entries."""
    while entries := [(abs(e), i, j) for i, row in rows.items() for j, e in row.items()]:
        size, i, j = max(entries)
        if size <= least:
            return
        pivot = rows.pop(i)
        first = pivot.pop(j)
        for row in rows.values():
            factor = row.pop(j, 0) / first
            row |= {k: row.get(k, 0) - factor * e for k, e in pivot.items() if factor}
        yield i, j
