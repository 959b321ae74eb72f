"""Exact arithmetic for expansions: a polynomial ring with a few named denominators, closed under d/dx.

Every coefficient of a slow manifold is N / (D_1^e_1 ... D_r^e_r) with the same few denominators D_i, because a
derivative only raises the exponents (Lemma 7):

    d/dx (N / D^e) = (N_x D - e N D_x) / D^(e+1).

So the D_i are found once, from the equations, and trial division by them finds what cancels. Functions that are not
rational (sqrt(x), sin(x), ...) are generators, as are the functions in their derivatives. A numerator is {monomial:
integer}; a monomial is its exponents packed into one integer, so that a product of monomials is a sum of integers, and
the leading one the largest key. The hard function is ``DifferentialRing.__init__``.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import reduce
from heapq import heapify, heappop, heappush
from math import gcd, lcm, prod
from typing import NamedTuple

import sympy as sp
from sympy.polys.fields import FracField

from asympk.errors import InputError, NotDerivable

WIDTH = 32  # bits for one exponent; the highest bit is a guard that shows a borrow
TRIAL = 1000  # larger primes of a denominator are not looked for: factoring a number of 400 digits never ends
WORK = 3_000_000  # products of terms, and trial divisions of terms: they take seconds
WRITTEN = 5_000  # terms of a numerator: SymPy writes them in seconds
SEARCH = 30  # products of terms, as long as the search for common divisors takes for one
TOO_LONG = ("the coefficients are too long to be written in symbols; ask for a lower order, or let export write them, "
            "and solve(scene, method='slow', order=n) use them")
NOT_SMOOTH = (sp.Piecewise, sp.Abs, sp.sign, sp.Max, sp.Min, sp.Heaviside, sp.DiracDelta, sp.floor, sp.ceiling)


class Fraction(NamedTuple):
    """An element of a ``DifferentialRing``: a numerator, and the exponent of each of the ring's denominators."""

    numerator: dict
    exponents: tuple


class DifferentialRing:
    """The ring that contains ``exprs`` and, up to ``depth`` times, their derivatives.

    ``derivations`` maps a name to a function that differentiates an expression; each of ``relations`` is
    ``(generator, degree, value)`` and says generator**degree = value. Raises ``InputError`` for an expression
    that is not smooth or contains a float, and ``NotDerivable`` after more than ``WORK`` in it.
    """

    def __init__(
        self, exprs: Sequence[sp.Expr], derivations: Mapping[str, Callable[[sp.Expr], sp.Expr]], depth: int,
        relations: Sequence[tuple[sp.Expr, int, sp.Expr]] = (),
    ):
        self._work = WORK
        rates = _closure([*exprs, *(value for *_, value in relations)], derivations, depth)
        self.atoms = tuple(sorted(rates, key=_late_first))
        self._field = FracField(self.atoms, sp.ZZ, sp.lex)
        self._generators = dict(zip(self.atoms, self._field.gens, strict=True))
        relations = [*_function_relations(self.atoms), *relations]
        inputs = [*exprs, *(rate for by in rates.values() for rate in by.values()), *(r[2] for r in relations)]
        parts = {part for e in inputs for part in _rational_parts(e)}
        below = [self._rational(p.base) for p in parts if p.is_Pow and p.exp.is_negative]
        contents = (int(side.content()) for d in below for side in (d.numer, d.denom))
        self._integer = prod(sp.factorint(lcm(*contents, *(p.q for p in parts if p.is_Rational)), limit=TRIAL))
        self._bases = _coprime([d.numer for d in below])
        self._powers = [[{0: 1}, {0: self._integer}], *([{0: 1}, _pack(d)] for d in self._bases)]
        self._guard = sum(1 << WIDTH * (i + 1) - 1 for i in range(len(self.atoms)))
        self._relations: tuple[tuple[int, int, Fraction], ...] = ()  # (s, n, v): w**n = v for w at bit s of a monomial
        self._relations = tuple((self._shift(a), degree, self(v)) for a, degree, v in relations)
        self._rates = {name: [(self._shift(a), self(by[name])) for a, by in rates.items() if by.get(name, 0) != 0]
                       for name in derivations}
        bases = [Fraction(powers[1], self.one.exponents) for powers in self._powers]
        self._base_rates: dict[str, list[Fraction]] = {name: [] for name in derivations}
        self._base_rates = {name: [self.diff(base, name) for base in bases] for name in derivations}

    def __call__(self, expr: sp.Expr) -> Fraction:
        """Return ``expr`` as an element; it must be rational in the generators, with the ring's denominators."""
        expr = sp.sympify(expr, strict=True)
        if expr.is_Add:
            return self.dot((self(term), self.one) for term in expr.args)
        if expr.is_Mul:
            return reduce(lambda a, b: self.dot([(a, b)]), map(self, expr.args))
        if expr.is_Pow and expr.exp.is_Integer and expr.exp > 1 and expr not in self._generators:
            return reduce(lambda a, b: self.dot([(a, b)]), [self(expr.base)] * int(expr.exp))
        value = self._rational(expr)
        content, denominator = value.denom.primitive()
        exponents = [0]
        factor = 1
        while factor % int(content):
            factor, exponents[0] = factor * self._integer, exponents[0] + 1
        for base in self._bases:
            exponents.append(0)
            while not (division := divmod(denominator, base))[1]:
                denominator, exponents[-1] = division[0], exponents[-1] + 1
        sign = int(denominator.as_expr())
        return self._sum({tuple(exponents): _pack(value.numer * (sign * factor // int(content)))})

    def dot(self, pairs: Iterable[tuple[Fraction, Fraction]]) -> Fraction:
        """Return the sum of the products of ``pairs``."""
        sums: dict[tuple, dict] = {}
        for a, b in pairs:
            if a.numerator and b.numerator:
                exponents = tuple(map(int.__add__, a.exponents, b.exponents))
                self._add_product(sums.setdefault(exponents, {}), a.numerator, b.numerator)
        return self._sum(sums)

    def diff(self, a: Fraction, name: str) -> Fraction:
        """Return the derivative of ``a`` under the derivation ``name``."""
        n, exponents = a
        pairs = [(Fraction(_partial(n, shift), exponents), rate) for shift, rate in self._rates[name]]
        for i, rate in enumerate(self._base_rates[name]):
            if exponents[i]:
                raised = tuple(e + (i == j) for j, e in enumerate(exponents))
                pairs.append((Fraction({m: -exponents[i] * c for m, c in n.items()}, raised), rate))
        return self.dot(pairs)

    def expr(self, a: Fraction) -> sp.Expr:
        """Return ``a`` as an expression: the product of content, common monomial, expanded rest and denominators.

        Raises ``NotDerivable`` for a numerator of more than ``WRITTEN`` terms.
        """
        if not a.numerator:
            return sp.S.Zero
        if len(a.numerator) > WRITTEN:
            raise NotDerivable(TOO_LONG)
        content = gcd(*a.numerator.values())
        monomials = [_unpack(m, len(self.atoms)) for m in a.numerator]
        common = [min(column) for column in zip(*monomials, strict=True)]
        terms = [sp.Mul(c // content, *self._factors(map(int.__sub__, m, common)))
                 for m, c in zip(monomials, a.numerator.values(), strict=True)]
        outer = sp.Rational(content, self._integer ** a.exponents[0])
        below = [d.as_expr() ** -e for d, e in zip(self._bases, a.exponents[1:], strict=True) if e]
        return sp.Mul(outer, *self._factors(common), sp.Add(*terms), *below)

    @property
    def zero(self) -> Fraction:
        return Fraction({}, (0,) * len(self._powers))

    @property
    def one(self) -> Fraction:
        return Fraction({0: 1}, (0,) * len(self._powers))

    def _rational(self, expr):
        """Return ``expr`` in the field of fractions of the generators."""
        if expr in self._generators:
            return self._generators[expr]
        if expr.is_Rational:
            return self._field(expr.p) / self._field(expr.q)
        if expr.is_Add:
            return reduce(self._added, map(self._rational, expr.args))
        if expr.is_Mul:
            return prod(map(self._rational, expr.args), start=self._field.one)
        base, exponent = expr.as_base_exp()
        whole, part = divmod(int(exponent.p), int(exponent.q))
        root = self._generators[base ** sp.Rational(1, exponent.q)] ** part if part else self._field.one
        return self._rational(base) ** whole * root

    def _added(self, a, b):
        """Return a sum in the field, which takes long where it seeks the divisors of both denominators."""
        if not (a.denom.is_ground or b.denom.is_ground):
            self._spend(SEARCH * (len(a.numer) * len(b.denom) + len(b.numer) * len(a.denom)))
        return a + b

    def _shift(self, atom):
        return WIDTH * (len(self.atoms) - 1 - self.atoms.index(atom))

    def _factors(self, exponents):
        return [a**e for a, e in zip(self.atoms, exponents, strict=True) if e]

    def _power(self, i, e):
        powers = self._powers[i]
        while len(powers) <= e:
            powers.append(self._add_product({}, powers[-1], powers[1]))
        return powers[e]

    def _add_product(self, total, a, b):
        """Add a*b to ``total`` in place, and return it."""
        self._spend(len(a) * len(b))
        get, right = total.get, list(b.items())
        for m, c in a.items():
            for k, d in right:
                total[m + k] = get(m + k, 0) + c * d
        return total

    def _spend(self, work):
        """Raise ``NotDerivable`` where more work than ``WORK`` is done in this ring."""
        self._work -= work
        if self._work < 0:
            raise NotDerivable(TOO_LONG)

    def _sum(self, sums):
        """Return the sum of ``{exponents: numerator}`` over a common denominator, reduced."""
        if not sums:
            return self.zero
        top = tuple(map(max, zip(*sums, strict=True)))
        total = {}
        for exponents, n in sums.items():
            for i, (high, low) in enumerate(zip(top, exponents, strict=True)):
                if high > low:
                    n = self._add_product({}, n, self._power(i, high - low))
            for m, c in n.items():
                total[m] = total.get(m, 0) + c
        total = {m: c for m, c in total.items() if c}
        self._spend(len(total) * len(self._powers))
        for shift, degree, value in self._relations:
            low, high = _split(total, shift, degree)
            if high:
                return self.dot([(Fraction(low, top), self.one), (Fraction(high, top), value)])
        exponents = [*top] if total else [*self.zero.exponents]
        for i, powers in enumerate(self._powers):
            while exponents[i] and (quotient := _quotient(total, powers[1], self._guard)) is not None:
                total, exponents[i] = quotient, exponents[i] - 1
        return Fraction(total, tuple(exponents))


def _rational_parts(expr):
    """Yield the parts of which ``expr`` is a rational function, itself first."""
    yield expr
    if expr.is_Add or expr.is_Mul or (expr.is_Pow and expr.exp.is_Rational):
        for part in expr.args[:1] if expr.is_Pow else expr.args:
            yield from _rational_parts(part)


def _closure(exprs, derivations, depth):
    """Return {generator: {derivation: its rate}} for all generators of ``exprs`` and of the rates, ``depth`` deep."""
    rates = {}
    new = set(derivations).union(*(atoms_of(e) for e in exprs))
    for _ in range(depth + 1):
        for atom in new:
            rates[atom] = {name: sp.sympify(diff(atom), strict=True) for name, diff in derivations.items()}
        new = {a for atom in new for rate in rates[atom].values() for a in atoms_of(rate)} - rates.keys()
    return rates | {atom: {} for atom in new}


def atoms_of(expr: sp.Expr) -> set[sp.Expr]:
    """Return the symbols, roots and other functions of which ``expr`` is a rational function.

    Raises ``InputError`` for an expression that is not smooth or contains a float.
    """
    if expr.has(sp.Float):
        raise InputError(f"{expr} contains a float; give exact numbers, such as sp.Rational(1, 5) for 0.2")
    if expr.has(*NOT_SMOOTH):
        raise InputError(f"{expr} is not smooth; write one side of it, such as z or -z for Abs(z)")
    if expr.is_Rational:
        return set()
    if expr.is_Add or expr.is_Mul:
        return set().union(*map(atoms_of, expr.args))
    base, exponent = expr.as_base_exp()
    if exponent.is_Integer and expr.is_Pow:
        return atoms_of(base)
    if exponent.is_Rational and expr.is_Pow:
        return {base ** sp.Rational(1, exponent.q)} | atoms_of(base)
    return {expr}


def _function_relations(atoms):
    """Yield the algebraic relations of roots, and of sines with cosines."""
    for atom in atoms:
        if atom.is_Pow and atom.exp.is_Rational:
            yield atom, int(atom.exp.q), atom.base
        for odd, even, sign in ((sp.sin, sp.cos, -1), (sp.sinh, sp.cosh, 1)):
            if isinstance(atom, odd) and even(*atom.args) in atoms:
                yield atom, 2, sign * (even(*atom.args) ** 2 - 1)


def _late_first(atom):
    """Return the sort key of a generator: functions before symbols, and a function before those inside it."""
    return atom.is_Symbol, -sp.count_ops(atom), str(atom)


def _coprime(polynomials):
    """Return pairwise coprime square-free polynomials such that each of ``polynomials`` is a product of them."""
    bases = []
    queue = [factor for p in polynomials if not p.is_ground for factor, _ in p.primitive()[1].sqf_list()[1]]
    while queue:
        new = queue.pop()
        for i, old in enumerate(bases):
            common = new.gcd(old)
            if common != 1:
                del bases[i]
                queue += [common, new.exquo(common), old.exquo(common)]
                break
        else:
            if not new.is_ground:
                bases.append(new)
    return sorted(bases, key=lambda p: (len(p), str(p)))


def _pack(polynomial):
    return {sum(e << WIDTH * i for i, e in enumerate(reversed(m))): int(c) for m, c in polynomial.items()}


def _unpack(monomial, length):
    return [monomial >> WIDTH * i & (1 << WIDTH) - 1 for i in reversed(range(length))]


def _partial(n, shift):
    """Return the derivative of ``n`` with respect to the generator at ``shift``."""
    mask = (1 << WIDTH) - 1
    return {m - (1 << shift): c * e for m, c in n.items() if (e := m >> shift & mask)}


def _split(n, shift, degree):
    """Return ``low, high`` with n = low + generator**degree * high and low of smaller degree."""
    mask, low, high = (1 << WIDTH) - 1, {}, {}
    for m, c in n.items():
        if m >> shift & mask >= degree:
            high[m - (degree << shift)] = c
        else:
            low[m] = c
    return low, high


def _quotient(n, d, guard):
    """Return n/d, or None when d does not divide n: division from the leading term, with a heap of the monomials."""
    lead = max(d)
    top, rest = d[lead], [(m, c) for m, c in d.items() if m != lead]
    n, quotient = dict(n), {}
    heap = [-m for m in n]
    heapify(heap)
    while heap:
        m = -heappop(heap)
        c = n.pop(m)
        if not c:
            continue
        if ((m | guard) - lead) & guard != guard or c % top:
            return None
        quotient[m - lead] = c // top
        for k, v in rest:
            k += m - lead
            if k not in n:
                heappush(heap, -k)
                n[k] = 0
            n[k] -= v * (c // top)
    return quotient
