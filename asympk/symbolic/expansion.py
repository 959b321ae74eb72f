r"""Coefficients of a slow manifold, order by order, from its invariance equation.

For x' = f(x, y, mu), mu y' = g(x, y, mu) and y = h_0 + delta, delta = mu h_1 + mu^2 h_2 + ..., the coefficient of
mu^k in mu h_x f = g is linear in h_k:

    g_y h_k = [mu^(k-1)] h_x f - [mu^k] (g - g_y delta),

and the right-hand side is known from h_0 .. h_(k-1). The coefficients of f and g, as Taylor polynomials in delta and
mu, are functions of x in one ``DifferentialRing``. A branch that is rational in x and in the functions of f and g is
substituted. Any other (a root, an inverse function) is a generator y of the ring, with dy/dx = -g_y^-1 g_x, which
``Expansion.expr`` replaces by its formula; of an implicit branch, ``{y: y}``, the generator stays, and is alone where
g = 0 is x = phi(y). ``expand`` is the entry, ``_Recurrence`` the hard part.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import comb, factorial, prod
from random import Random

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.formulas import NOT_FINITE
from asympk.numbers import short
from asympk.symbolic.branches import put_sign, without_squares
from asympk.symbolic.diffring import DifferentialRing, Fraction, atoms_of
from asympk.symbolic.long import (
    DEGREE,
    atoms,
    functions_named,
    has_many_terms,
    has_more_terms,
    heavy,
    inverse_of,
    is_long,
    is_longer,
    is_many_quotients,
    named_exponentials,
    numerator_of,
    replaced,
    valued,
)
from asympk.symbolic.system import Mode

_TINY = sp.Rational(1, 10**30)
PLACES = 128  # at which an expression with roots is looked at
FURTHEST = 10**6  # the largest number of which coordinates of places are ratios; of small ones some hit isolated zeros
EXPANDED = 20_000  # terms of a power of a sum, times its exponent: with 10000 formulas take seconds, with 90000 minutes
LARGEST = 10**308  # of numbers; SymPy factors larger ones for minutes
STEEPEST = 1000  # degree of what is not factored; at numbers larger powers have more digits than Python spells
SUBSTITUTED = 2000  # terms that are expanded, but not factored, times the order squared: these take five seconds
LONG = 200  # operations; from longer rates that are not rational come coefficients of a hundred thousand operations
MANY = 8  # different exponentials in the rates, times the most fast states coupled; with more, formulas take minutes


@dataclass(frozen=True, eq=False)
class Expansion:
    """``height[y][k]`` and ``flow[x][k]`` multiply mu**k in y = h(x, mu) and in x' on the manifold."""

    ring: DifferentialRing
    height: dict[sp.Symbol, list[Fraction]]
    flow: dict[sp.Symbol, list[Fraction]]
    branch: dict
    signs: dict

    def expr(self, element: Fraction) -> sp.Expr:
        """Return an element of the ring as an expression in the slow variables."""
        expr = self.ring.expr(element)
        if not self.branch:
            return _signed(by_powers(expr, tuple(self.flow)), self.signs)
        return _signed(expr, self.signs).subs(self.branch, simultaneous=True)


def is_implicit(branch: sp.Dict) -> bool:
    """Tell whether ``branch`` is ``{y: y}``: y stands for the value of the branch."""
    return all(y == h for y, h in branch.items())


def require_short(mode: Mode, order: int = 0, branch: sp.Dict | None = None) -> None:
    """Raise ``NotDerivable`` where no formulas can be written.

    This is where a power of a sum has too many terms, and, if ``order`` is above 0, where the rates are too long, or
    h_x x' on the ``branch`` y = h has too many terms, or many different exponentials are in those of several fast
    states on an implicit ``branch``, for the number of fast states that are coupled.
    """
    rates = sp.Tuple(*mode.slow.values(), *mode.fast.values())
    for power in sorted(atoms(rates, sp.Pow), key=str):
        if power.base.is_Add and power.exp.is_Integer and _size_expanded(power) > EXPANDED:
            raise NotDerivable(f"the rates of {mode.name} have the power {short(power)}, which has too many terms for "
                               "formulas: put a parameter for it, or an exponential; solve follows it")
    if order == 0:
        return
    long = (is_long(rates) and is_longer(rates, LONG)) or has_long_coefficients(mode, branch or sp.Dict(), order)
    implicit = branch is not None and len(branch) > 1 and is_implicit(branch)
    if long or (implicit and _coupled(mode) * len(named_exponentials(rates)[1]) > MANY):
        much = "are too long" if long else "have too many exponentials"
        raise NotDerivable(f"the rates of {mode.name} {much} for coefficients in symbols beyond order 0; export writes "
                           "them, and solve(scene, method='slow', order=n) uses them")


def has_long_coefficients(mode: Mode, branch: sp.Dict, order: int) -> bool:
    """Tell whether the rates, g_y, or h_x x' on a branch y = h have too many terms for coefficients in symbols."""
    flows = [replaced(f, {**branch}) for f in mode.slow.values()]
    moved, _ = functions_named(sp.Tuple(*(sp.Mul(h, f, evaluate=False) for h in branch.values() for f in flows)))
    slopes = sp.Matrix([*mode.fast.values()]).jacobian([*mode.fast])
    most = SUBSTITUTED // max(order, 1) ** 2
    rates = (*mode.slow.values(), *mode.fast.values())
    if has_many_terms(sp.Tuple(*slopes)) or is_many_quotients(sp.Tuple(*slopes, *rates)):
        return True
    return has_more_terms(sp.Tuple(*rates, *map(numerator_of, moved)), most)


def require_factored(mode: Mode, degree: int = DEGREE) -> None:
    """Raise ``NotDerivable`` where a power, or a number, is too large to be factored or spelled.

    The fast rates may have powers of fast states up to ``degree``; all other powers may go up to ``STEEPEST``.
    """
    slow, fast = (sp.Tuple(*rates.values()) for rates in (mode.slow, mode.fast))
    numbers = (n for n in atoms(sp.Tuple(slow, fast), sp.Rational) if max(abs(n.p), n.q) > LARGEST)
    powers = (p for rates, most in ((slow, STEEPEST), (fast, degree)) for p in atoms(rates, sp.Pow)
              if abs(p.exp.as_coeff_Mul(rational=True)[0]) > (most if p.base.has(*mode.fast) else STEEPEST))
    if large := min(map(short, (*numbers, *powers)), default=None):
        raise NotDerivable(f"the rates of {mode.name} have {large}, which is too large for formulas: put a parameter "
                           "for the number")


def _coupled(mode):
    """Return the largest number of fast states that depend on each other, at least 2."""
    blocks = sp.Matrix(list(mode.fast.values())).jacobian(list(mode.fast)).strongly_connected_components()
    return max(2, *map(len, blocks))


def _size_expanded(power):
    """Return the number of terms of a power of a sum, times the exponent, which the lengths of their numbers follow."""
    times, parts = abs(int(power.exp)), len(power.base.args)
    return comb(times + parts - 1, parts - 1) * times


def require_series(mode: Mode, small: sp.Symbol | None, order: int = 0) -> None:
    """Raise ``InputError`` if a rate or one of its first ``order`` derivatives by mu is singular where mu = 0."""
    if small is None:
        return
    for state, rate in {**to_degree(mode.slow, small, order), **to_degree(mode.fast, small, order)}.items():
        if any(rate.diff(small, k).subs(small, 0).has(*NOT_FINITE) for k in range(order + 1)):
            meant = f"fast = {{{state}: g}} means {small} {state}' = g; " if state in mode.fast else ""
            raise InputError(f"the rate of {state} has no series in {small}: in mode {mode.name} it is singular where "
                             f"that is 0; {meant}use an exact method, or replace what is singular by a parameter")


def regular(expr: sp.Expr, small: sp.Symbol, degree: int) -> sp.Expr:
    """Return an expression with Taylor polynomials in mu for quotients that are singular by their form alone.

    Such is sin(mu)/mu, also as sinc(mu). Parts that have no series stay.
    """
    if not is_singular(expr, small):
        return expr
    parts = [regular(part, small, degree) for part in expr.args]
    apart = expr.func(*parts)
    if not any(is_singular(part, small) for part in (apart, *parts)):  # what is divided by mu needs higher degrees
        return apart
    fixed, moving = expr.as_independent(small, as_Add=expr.is_Add)
    return (sp.Add if expr.is_Add else sp.Mul)(fixed, _polynomial(moving, small, degree))


def to_degree(rates: Mapping, small: sp.Symbol, degree: int) -> sp.Dict:
    """Return rates with Taylor polynomials in mu, of a degree, for quotients that are singular by their form alone."""
    return sp.Dict({s: regular(rate, small, degree) for s, rate in rates.items()})


def limit_of(expr: sp.Expr, small: sp.Symbol) -> sp.Expr:
    """Return an expression at mu = 0, also where quotients are singular by their form alone."""
    return regular(expr, small, 0).subs(small, 0)


def is_singular(expr: sp.Expr, small: sp.Symbol) -> bool:
    """Tell whether an expression has a quotient that is singular by its form where mu = 0, or is infinite."""
    if expr == small or not expr.has(small, *NOT_FINITE):
        return False
    at = expr.subs(small, 0)
    return at.has(*NOT_FINITE) or any(s.args[0].subs(small, 0) == 0 for s in expr.atoms(sp.sinc))


def _polynomial(quotient: sp.Expr, small: sp.Symbol, degree: int) -> sp.Expr:
    """Return the Taylor polynomial of n/d by the series of n and d, or n/d itself where it has none."""
    found, known, k = list[sp.Expr](), list[sp.Expr](), 0
    quotient = quotient.replace(sp.sinc, lambda z: sp.sin(z) / z)
    sides = (quotient, sp.S.Zero) if heavy(quotient) else sp.fraction(sp.together(quotient))
    while len(found) <= degree and not is_zero(sides[1]):
        above, below = (side.diff(small, k).subs(small, 0) / factorial(k) for side in sides)
        begun = bool(known) or not is_zero(below)  # before, the terms of n must vanish, too
        if sp.Tuple(above, below).has(*NOT_FINITE) or not (begun or is_zero(above)):
            return quotient
        if begun:
            known.append(below)
            lower = sp.Add(*(c * d for c, d in zip(found, known[:0:-1], strict=True)))
            found.append(sp.cancel((above - lower) / known[0]))
        k += 1
    return sp.Add(*(c * small**j for j, c in enumerate(found))) if found else quotient


def over_fast(mode: Mode, small: sp.Symbol, branch: sp.Dict) -> dict[sp.Symbol, sp.Expr]:
    """Return {x: phi(y)} where an implicit branch with one fast state y is a graph x = phi(y), else {}."""
    if len(branch) > 1 or not is_implicit(branch):
        return {}
    g = limit_of(next(iter(mode.fast.values())), small)
    for x in mode.slow:
        slope = g.diff(x) if heavy(g) else sp.cancel(g.diff(x))
        if slope != 0 and not slope.has(*mode.slow, *mode.fast):
            return {x: sp.cancel(-g.subs(x, 0) / slope)}
    return {}


@lru_cache(maxsize=64)
def expand(mode: Mode, small: sp.Symbol, branch: sp.Dict, order: int) -> Expansion:
    """Expand the slow manifold of ``mode`` to ``order``; ``branch`` must solve g = 0, with a regular g_y on it."""
    signs = {sp.Dummy("s"): quantity for quantity in mode.signed}
    slow, fast = (to_degree(one_side(rates, signs), small, order) for rates in (mode.slow, mode.fast))
    mode = replace(mode, slow=slow, fast=fast)
    slow, fast = tuple(mode.slow), tuple(mode.fast)
    on_branch = {s: q.subs(branch) for s, q in signs.items()}
    branch = dict(one_side(branch, signs))
    implicit = is_implicit(branch)
    named = implicit or not _atoms(branch.values()) <= _atoms([*mode.slow.values(), *mode.fast.values(), *slow])
    over = over_fast(mode, small, branch)
    value = over if named else branch
    ties = _ties(mode, small, branch) if named and not implicit else []
    inverse = _inverse(jacobian_on_branch(mode, small).subs(value, simultaneous=True), ties)
    derivations = {x: _derivation(x, mode, small, inverse if named else None, value) for x in slow}
    at = {small: 0, **value}
    flow, force = (_taylor(rates.values(), fast, small, order, at) for rates in (mode.slow, mode.fast))
    coefficients = sp.Tuple(*inverse, *(c for series in flow + force for c in series.values()))
    moduli = sorted(atoms(coefficients, sp.Abs), key=str)  # roots of squares on the branch
    roots = {sp.Dummy("s"): size.args[0] for size in moduli}
    sizes = _in_signs(roots)
    inverse = inverse.subs(sizes)
    flow, force = ([{a: c.subs(sizes) for a, c in series.items()} for series in both] for both in (flow, force))
    on_branch |= roots
    start = [value.get(y, y) for y in fast]
    free = (x for x in slow if x not in over)
    inputs = [*free, *start, *inverse, *(c for series in flow + force for c in series.values())]
    ring = DifferentialRing(inputs, derivations, order + 1, ties)
    flow, force = ([{a: ring(c) for a, c in series.items()} for series in both] for both in (flow, force))
    inverse = [[ring(c) for c in row] for row in inverse.tolist()]
    recurrence = _Recurrence(ring, slow, [ring(h) for h in start], inverse, flow, force)
    for k in range(1, order + 1):
        recurrence.advance(k)
    height, flow = (dict(zip(*both, strict=True)) for both in ((fast, recurrence.heights), (slow, recurrence.flows)))
    return Expansion(ring, height, flow, branch if named else {}, on_branch)


def one_side(rates: Mapping, signs: Mapping[sp.Symbol, sp.Expr]) -> sp.Dict:
    """Return rates with s q for |q| and s for sign(q): an expansion with s constant holds on both sides of q = 0."""
    known = _in_signs(signs)
    return sp.Dict({x: sp.sympify(rate, strict=True).subs(known) for x, rate in rates.items()})


def _in_signs(signs):
    """Return {|q|: s q, sign(q): s} for all {s: q}."""
    return {k: v for s, q in signs.items() for k, v in put_sign(q, s).items()}


def _signed(expr, signs):
    """Replace s by |q|/q."""
    return without_squares(expr, signs).subs({s: sp.Abs(q) / q for s, q in signs.items()}) if signs else expr


@lru_cache(maxsize=64)
def fast_jacobian(mode: Mode, small: sp.Symbol) -> sp.Matrix:
    """Return dg/dy at mu = 0, a matrix of functions of the states."""
    return sp.Matrix([limit_of(g, small) for g in mode.fast.values()]).jacobian([*mode.fast]).as_immutable()


def jacobian_on_branch(mode: Mode, small: sp.Symbol) -> sp.Matrix:
    """Return dg/dy at mu = 0 where g = 0: a quotient P/Q of polynomials that vanishes has the derivative P_y/Q."""
    found = fast_jacobian(mode, small).as_mutable()
    for k, g in enumerate(limit_of(g, small) for g in mode.fast.values()):
        if g.is_rational_function(*mode.fast) and not g.is_polynomial(*mode.fast) and not heavy(g):
            numerator, denominator = sp.fraction(sp.together(g))
            found[k, :] = sp.Matrix([[numerator.diff(y) / denominator for y in mode.fast]])
    return found


def by_powers(expr: sp.Expr, slow: tuple[sp.Symbol, ...]) -> sp.Expr:
    """Collect powers of the slow variables that are in no denominator and no function: 1/(sigma + 4) - x."""
    long = is_longer(expr, LONG) and (heavy(expr) or not expr.is_rational_function(*slow))
    if long or is_many_quotients(expr):
        return expr
    names, meaning = named_exponentials(expr)
    numerator, denominator = sp.fraction(sp.together(expr.xreplace(names)))
    powers = [x for x in slow if numerator.is_polynomial(x) and not denominator.has(x)]
    if denominator.is_Rational or not powers:
        return expr
    terms = sp.Poly(numerator, *powers).terms()
    found = (sp.factor(c / denominator) * sp.Poly.from_dict({m: 1}, *powers).as_expr() for m, c in terms)
    return sp.Add(*found).xreplace(meaning)


def is_zero(expr: sp.Expr) -> bool:
    """Tell whether ``expr`` is identically zero: by algebra if it is rational, else in 50 digits at generic points."""
    reduced = expr if heavy(expr) else sp.cancel(expr)
    if reduced == 0 or (not reduced.has(sp.Abs) and all(a.is_Symbol for a in atoms_of(reduced))):
        return reduced == 0
    values = (_value(reduced, k) for k in range(1, 5))
    small = {bool(abs(value) < _TINY) for value in values if value.is_number and value.is_finite}
    return False not in small if small else sp.simplify(reduced) == 0


def is_zero_somewhere(expr: sp.Expr) -> bool:
    """Tell whether ``expr`` is zero in 50 digits at one of a few generic points, near and far, of either sign.

    Far off, all digits must cancel: what is small there may only have decayed, as exp(-x) has.
    """
    near, far = (_around(expr, powers) for powers in ((0, -1), (-2, 2, -3, 3, -4, 4)))
    return any(map(_is_tiny, near)) or any(_is_tiny(v) and abs(v)._prec <= 1 for v in far)  # 1: no digit is left


def zero_at_places(exprs: Sequence[sp.Expr], assumed: sp.Basic) -> Iterator[bool]:
    """Yield whether expressions all vanish, as found in many digits, at places in all of the range that is ``assumed``.

    Both answers are found where a root of a square is that of either sign. Places where a part is not real are left
    out.
    """
    chance = Random(0)
    symbols = sorted(sp.Tuple(*exprs, assumed).free_symbols, key=str)
    for _ in range(PLACES if symbols else 1):
        signs = [-1 if s.is_negative else 1 if s.is_nonnegative else chance.choice((1, -1)) for s in symbols]
        sizes = [sp.Rational(chance.randint(1, FURTHEST), chance.randint(1, FURTHEST)) for _ in symbols]
        place = {s: sign * size for s, sign, size in zip(symbols, signs, sizes, strict=True)}
        values = [valued(e, place, digits) for e in exprs for digits in (50, 100)]
        computed = all(v.is_number and v.is_finite and not v.has(sp.Function) for v in values)
        if computed and assumed.subs(place) != sp.false:  # what is rounding shrinks with more digits
            pairs = zip(values[::2], values[1::2], strict=True)
            yield all(rough == 0 or abs(fine / rough) < sp.Rational(1, 10**25) for rough, fine in pairs)


def _around(expr, powers):
    return (_value(expr, k, sign * sp.Integer(5) ** p) for k in (1, 2) for p in powers for sign in (1, -1))


def _is_tiny(value):
    worked_out = value.is_number and value.is_finite and not value.has(sp.Function)  # SymPy does not compute erfcinv
    return worked_out and bool(abs(value) < _TINY)


def _value(expr, k, scale=1):
    """Evaluate at the k-th of a few points times ``scale``, each symbol at a rational of its own sign.

    The rationals are primes over one number: where they rose in equal steps, determinants of symbols in order vanished.
    Each part of a heavy expression is computed once, with 50 digits to lose by cancelling.
    """
    points = {}
    for i, s in enumerate(sorted(expr.free_symbols, key=str)):
        sign = -1 if s.is_negative else 1 if s.is_positive else sp.sign(scale)
        points[s] = sign * abs(scale) * sp.Rational(sp.prime(i + 5 * k), 11 + 3 * k)
    found = valued(expr, points, 2 * 50, real=False) if heavy(expr) else sp.nan
    if found.is_finite:
        return found
    try:
        return replaced(expr, points).evalf(50)
    except (TypeError, AttributeError, ValueError):  # SymPy cannot compare exp(9375) with pi, nor compute erfinv(2)
        return sp.nan


class _Recurrence:
    """The series so far: ``powers[a][k]`` multiplies mu**k in delta**a, ``slopes[j][i]`` is dh_j/dx_i."""

    def __init__(self, ring, slow, start, inverse, flow, force):
        self.ring, self.slow, self.inverse, self.flow, self.force = ring, slow, inverse, flow, force
        self.units = [tuple(int(i == j) for i in range(len(start))) for j in range(len(start))]
        self.powers = {(0,) * len(start): [ring.one]}
        self.powers |= {a: [ring.zero] for a in _with_parents({a[:-1] for f in flow + force for a in f}, self.units)}
        self.heights = [[h] for h in start]
        self.slopes = [[[ring.diff(h, x)] for x in slow] for h in start]
        self.flows = [[self._coefficient(f, 0)] for f in flow]

    def advance(self, k):
        """Append the coefficients of mu**k to every series."""
        for a, power in self.powers.items():
            if sum(a) > 1:
                power.append(self._product(a, k))
        sides = [self._side(j, k) for j in range(len(self.heights))]
        for j, row in enumerate(self.inverse):
            h = self.ring.dot(zip(row, sides, strict=True))
            self.heights[j].append(h)
            self.powers[self.units[j]].append(h)
            for x, slope in zip(self.slow, self.slopes[j], strict=True):
                slope.append(self.ring.diff(h, x))
        for series, flow in zip(self.flow, self.flows, strict=True):
            flow.append(self._coefficient(series, k))

    def _product(self, a, k):
        unit, rest = _split(a)
        return self.ring.dot((self.powers[unit][i], self.powers[rest][k - i]) for i in range(1, k))

    def _side(self, j, k):
        """Return [mu^(k-1)] h_x f - [mu^k] g, without the term of the unknown h_k in g."""
        known = self._coefficient(self.force[j], k)
        moved = [(s[i], f[k - 1 - i]) for s, f in zip(self.slopes[j], self.flows, strict=True) for i in range(k)]
        return self.ring.dot([*moved, (known, self.ring(-1))])

    def _coefficient(self, series, k):
        """Return the coefficient of mu**k in a Taylor polynomial, as far as the powers of delta are known."""
        known = ((c, self.powers[a[:-1]], k - a[-1]) for a, c in series.items())
        return self.ring.dot((c, power[i]) for c, power, i in known if 0 <= i < len(power))


def _split(a):
    """Split the multi-index ``a`` into a unit and the rest."""
    j = next(j for j, n in enumerate(a) if n)
    return tuple(int(i == j) for i in range(len(a))), tuple(n - (i == j) for i, n in enumerate(a))


def _with_parents(indices, units):
    """Return the multi-indices, the units, and all rests that ``_split`` gives, in order of their degree."""
    closed, queue = set(units), [a for a in indices if sum(a) > 1]
    while queue:
        a = queue.pop()
        closed.add(a)
        rest = _split(a)[1]
        if rest not in closed:
            queue.append(rest)
    return sorted(closed, key=lambda a: (sum(a), a))


def _taylor(rates, fast, small, order, at):
    """Return for every rate {(a, m): the coefficient of delta**a mu**m, as an expression on the branch}."""
    names = (*fast, small)
    ring = DifferentialRing(list(rates), {v: lambda e, v=v: e.diff(v) for v in names}, order)
    return [_derivatives(ring, ring(rate), names, order, at) for rate in rates]


def _derivatives(ring, start, names, order, at):
    found = {}
    level = {(0,) * len(names): start}
    for degree in range(order + 1):
        for a, element in level.items():
            found[a] = ring.expr(element).subs(at, simultaneous=True) / prod(map(factorial, a))
        level = {tuple(n + (i == j) for i, n in enumerate(a)): ring.diff(element, name) for a, element in level.items()
                 for j, name in enumerate(names) if degree < order and not any(a[j + 1 :])}
        level = {a: element for a, element in level.items() if element.numerator}
    return found


def _derivation(x, mode, small, inverse, value):
    """Return d/dx: along the branch, dy/dx = -g_y^-1 g_x, when the branch is a generator, else partial."""
    if inverse is None:
        return lambda e: e.diff(x)
    fast = sp.Matrix(list(mode.fast))
    force = sp.Matrix([g.subs(small, 0) for g in mode.fast.values()]).diff(x)
    tangent = -inverse * force.subs(value, simultaneous=True)
    return lambda e: e.diff(x) + sum(e.diff(y) * slope for y, slope in zip(fast, tangent, strict=True))


def _inverse(jacobian, ties):
    """Return the inverse matrix; over an algebraic branch, with a denominator free of the generator y."""
    if ties:
        ((y, degree, value),) = ties
        numerator, denominator = sp.fraction(sp.cancel(jacobian[0]))
        return sp.Matrix([[denominator * sp.invert(numerator, y**degree - value, y)]])
    names, own = named_exponentials(sp.Tuple(*jacobian))
    inverse = inverse_of(jacobian.xreplace(names))
    return inverse.applyfunc(lambda e: e if is_many_quotients(e) else sp.cancel(e)).xreplace(own)


def _ties(mode, small, branch):
    """Return y**degree = value from g(x, y, 0) = 0, when that is a polynomial in the only fast variable."""
    if len(branch) > 1:
        return []
    ((y, h),) = branch.items()
    numerator = sp.fraction(sp.cancel(mode.fast[y].subs(small, 0)))[0]
    if any(a != y and a.has(y) for a in atoms_of(numerator)):
        return []
    factors = [f for f, _ in sp.factor_list(numerator, y)[1] if f.has(y)]
    factor = sp.Poly(next(f for f in factors if len(factors) == 1 or is_zero(f.subs(y, h))), y)
    value = -(factor.as_expr() - factor.LC() * y ** factor.degree()) / factor.LC()
    return [(y, factor.degree(), value)]


def _atoms(exprs):
    return set().union(*(atoms_of(sp.sympify(expr, strict=True)) for expr in exprs))
