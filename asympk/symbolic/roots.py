r"""All roots of g(x, y, 0) = 0 in closed form: SymPy's, without false ones and with those that SymPy leaves out.

``_solutions`` is the hard function. Products are split, unknowns that others give are eliminated, and an equation in
one unknown gets a form of ``substitutions``. It answers None where no short formula stands for every root.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import chain, product

import sympy as sp

from asympk.errors import InputError
from asympk.formulas import NOT_FINITE
from asympk.symbolic.expansion import is_zero, is_zero_somewhere
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import (
    CLEAR,
    ROUGH,
    atoms,
    entries_named,
    generic_place,
    has_many_terms,
    heavy,
    named_exponentials,
    numerator_of,
    parts_of,
    pivots,
    replaced,
    valued,
)
from asympk.symbolic.lowering import lower
from asympk.symbolic.substitutions import (
    by_lambert,
    by_logarithm,
    common_turn,
    exponentials_as_powers,
    fractional_powers,
    from_phase,
    in_base_e,
    in_fewer_waves,
    in_half_angle,
    irrational_parts,
    outermost,
    substituted,
    waves_in,
    whole_turn,
    without_roots,
)
from asympk.symbolic.tidy import solved

DEGREE = 20  # above it SymPy may take minutes to factor, and to find roots that are not readable
HALVINGS = 60  # of an interval in which a function changes its sign
RANGE: dict[type, Callable] = {  # what is positive inside the range of an inverse function
    **dict.fromkeys((sp.asin, sp.atan, sp.acsc, sp.acot), lambda w: sp.pi**2 / 4 - w**2),
    **dict.fromkeys((sp.acos, sp.asec), lambda w: w * (sp.pi - w)),
}
INVERSE: dict[type, Callable] = {
    sp.asin: sp.sin, sp.acos: sp.cos, sp.atan: sp.tan, sp.asec: sp.sec, sp.acsc: sp.csc, sp.acot: sp.cot,
}
_REAL = (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh, sp.tanh, sp.atan, sp.asinh, sp.erf, sp.sign, InverseForm)  # at all


def heights(solutions: list[dict[sp.Symbol, sp.Expr]]) -> Iterator[sp.Expr]:
    """Yield the value of every unknown in every solution."""
    return (h for s in solutions for h in s.values())


def real_forms(solution: dict[sp.Symbol, sp.Expr]) -> list[dict[sp.Symbol, sp.Expr]]:
    """Return a solution, and what SymPy leaves out: the lower real branch of Lambert's W, and odd roots below 0."""
    upper = {w for h in solution.values() for w in h.atoms(sp.LambertW) if len(w.args) == 1}
    roots = {p for p in fractional_powers(*solution.values()) if p.exp.q % 2}
    lower = {} if any(w.args[0].is_nonnegative for w in upper) else {w: sp.LambertW(w.args[0], -1) for w in upper}
    below = {p: (-1) ** p.exp.p * (-p.base) ** p.exp for p in roots if not p.base.is_nonnegative}
    forms = [solution]
    for rule in filter(None, (lower, below)):
        forms += [{y: h.xreplace(rule) for y, h in form.items()} for form in forms]
    return forms


def is_unreadable(h: sp.Expr) -> bool:
    """Tell whether a formula has cases, an odd root of a root, as Cardano's, or a root of a modulus or of -1."""
    return h.has(sp.Piecewise) or any(
        p.base.has(sp.Abs) or p.base == -1 or (p.exp.q % 2 and fractional_powers(p.base))
        for p in fractional_powers(h)
    )


def is_complex(h: sp.Expr) -> bool:
    """Tell whether an expression in real symbols that are not 0 has no real value where its even roots are real."""
    if not any(map(_may_be_complex, parts_of(h))):
        return False
    generic = {"real": True, "nonzero": True}
    h = h.xreplace({s: sp.Dummy(**s.assumptions0 | generic) for s in h.free_symbols})
    lower = {w for w in h.atoms(sp.LambertW) if len(w.args) == 2}  # SymPy takes its real values to be complex
    if any(w.args[0].is_nonnegative for w in lower):
        return True
    h = h.xreplace({w: sp.Dummy(**generic) for w in lower})
    positive, bases = dict[sp.Expr, sp.Expr](), dict[sp.Expr, sp.Expr]()
    for p in (p for p in fractional_powers(h) if p.free_symbols):
        if not p.exp.q % 2:
            positive[p] = sp.Dummy(positive=True)
        else:
            positive[p] = bases.setdefault(p.base, sp.Dummy(real=True, nonzero=True)) ** (p.exp * p.exp.q)
    h = h.xreplace(positive)
    if bases and any(part.is_imaginary for part in h.atoms(sp.Pow, type(sp.I))):
        inside = (f.args[0] for f in h.atoms(sp.log, sp.LambertW))
        return any(sp.expand_complex(part).as_real_imag()[1].is_nonzero for part in (*inside, h))
    return h.is_real is False


def _may_be_complex(part):
    """Tell whether a part of an expression need not be real where its own parts are."""
    if part.is_Pow:
        return not part.exp.is_Integer
    return not part.is_real if part.is_number else isinstance(part, sp.Function) and not isinstance(part, _REAL)


def solutions_of(equal_zero: list[sp.Expr], unknowns: list[sp.Symbol]) -> list[dict[sp.Symbol, sp.Expr]] | None:
    """Return the solutions that SymPy finds, or None where SymPy fails, would leave out roots or has no short ones."""
    if {*equal_zero} == {0}:
        return [{}]
    given = (e for e in atoms(sp.Tuple(*equal_zero), sp.exp) if not e.has(*unknowns))
    names, meaning = named_exponentials(sp.Tuple(*given))  # split, 1/(1 + exp(a - x)) would be inf/inf in doubles
    found = _solutions([g.xreplace(names) for g in equal_zero], unknowns)
    return found and [{y: h.xreplace(meaning) for y, h in s.items()} for s in found]


def _solutions(equal_zero, unknowns):
    """Return the solutions of equations that are not all 0, as ``solutions_of`` does."""
    if len(unknowns) > 1 or heavy(*equal_zero) or has_many_terms(numerator_of(*equal_zero)):
        matrix = (force := sp.Matrix(equal_zero)).jacobian(unknowns)
        if not matrix.has(*unknowns):
            return _linear_solution(matrix, force.subs(dict.fromkeys(unknowns, 0)), unknowns)
    own = len(unknowns) > 1 or not equal_zero[0].is_rational_function(*unknowns)
    if len(unknowns) == 1:
        equal_zero = [in_base_e(*equal_zero, *unknowns)]
        if shifted := from_phase(*equal_zero, *unknowns):
            return _by_power(*shifted, *unknowns)
        if own and (factors := factors_of(equal_zero[0], unknowns)) != equal_zero:
            return _with_factors(factors, *equal_zero, *unknowns)
        if closed := by_lambert(*equal_zero, *unknowns) or by_logarithm(*equal_zero, *unknowns):
            return closed
        if powers := substituted(*equal_zero, *unknowns):
            return _by_power(*powers, *unknowns)
        equal_zero = [in_fewer_waves(*equal_zero, *unknowns)]
        if _mixes(*equal_zero, *unknowns):
            return None
    if len(unknowns) > 1 and (factors := [factors_of(g, unknowns) for g in equal_zero]) != [[g] for g in equal_zero]:
        return _joined([solutions_of([*choice], unknowns) for choice in product(*factors)], equal_zero)
    if len(unknowns) > 1 and (given := _values_given(equal_zero, unknowns)):
        return _with_values(given, equal_zero, unknowns)
    if 1 < len(unknowns) == len(equal_zero) and _has_none_at_last(equal_zero, unknowns):
        return None
    turning = in_half_angle(*equal_zero, *unknowns) if len(unknowns) == 1 else None
    eliminants = [turning[:2]] if turning else _eliminants(equal_zero, unknowns)
    if any(_is_beyond_radicals(force, y, len(unknowns)) for force, y in eliminants):
        return None
    if turning and any(wave.args[0].subs(unknowns[0], 0) != 0 for wave in waves_in(*equal_zero, *unknowns)):
        return _in_a_turn([], *turning, *equal_zero, *unknowns)  # of waves of several phases SymPy may not end
    offered = _found_by_sympy(equal_zero, unknowns, own)
    found = offered and [s for s in offered if not own or _solves(s, equal_zero)]
    if turning:
        return _in_a_turn(found or [], *turning, *equal_zero, *unknowns)
    return None if own and found is not None and _leaves_out(found, offered, equal_zero, *unknowns) else found


def _found_by_sympy(equal_zero, unknowns, own):
    """Return SymPy's solutions, or None; ``own`` tells that the check of them is ours."""
    try:
        return sp.solve(equal_zero, unknowns, dict=True, check=not own)
    except NotImplementedError:
        return None


def _by_power(numerator, w, height, y):
    """Return the solutions y = height(w), as y is declared, of the equation that the numerator is 0."""
    if (found := solutions_of([numerator], [w])) == [{}]:
        return found
    own = [{y: h} for h in dict.fromkeys(height(s[w]) for s in found or ())]
    return found and [*filter(_is_as_declared, own)]


def _leaves_out(found, offered, equal_zero, y, *others):
    """Tell whether g changes its sign, at generic numbers for all other symbols, where no solution has its value.

    SymPy finds no root of sqrt(y**2 + 1) + atan(y) - 3*y, and of a product those of the factors that it solves. With
    several unknowns it may find none of equations that are not rational: that there are none is believed if all that it
    has ``offered`` are finite values of every unknown. Roots of a g of waves alone whose turns fit are those in one
    turn.
    """
    if others:
        whole = [len(s) > len(others) and not sp.Tuple(*s.values()).has(*NOT_FINITE) for s in offered]
        rational = all(g.is_rational_function(y, *others) for g in equal_zero)
        return not (found or rational or (whole and all(whole)))
    if heavy(force := equal_zero[0]):
        return False
    turn = whole_turn(force, y)
    heights, place = [form[y] for s in found for form in real_forms(s)], generic_place(force)
    for side in (1, -1):
        at = {s: -number if s.is_nonpositive or (side < 0 and not s.is_nonnegative) else number
              for s, number in place.items() if s != y}
        values = [valued(h, at, 30, real=False) for h in heights]  # nan where there is no value, as of erfinv(2)
        if any(value.has(sp.Function) for value in values):  # SymPy does not compute erfcinv
            continue
        period = abs(float(2 * sp.pi / turn.xreplace(at))) if turn else math.inf
        known = [complex(value) for value in values if value.is_finite]
        if any(all(_apart(value, root, period) for value in known) for root in _sign_changes(force.xreplace(at), y)):
            return True
    return False


def _apart(value, root, period):
    """Tell whether a value is not a real root, nor one some whole periods from it."""
    off = value - root
    if period < math.inf:
        off -= period * round(off.real / period)
    return abs(off) > ROUGH * (1 + abs(root))


def _sign_changes(force, y):
    """Return numbers, near and far, at which a function of y alone passes 0 clearly, not a pole."""
    import numpy as np

    grid = np.sinh(np.linspace(-9.003, 9, 720))
    grid = grid[grid > 0] if y.is_nonnegative else grid[grid < 0] if y.is_nonpositive else grid
    try:
        function = lower((y,), [force], "numpy", branching=True).compiled
    except InputError:  # NumPy lacks a function
        return []
    with np.errstate(all="ignore"):
        (values,) = function(grid)
        clear = np.abs(values) > CLEAR
        k = np.flatnonzero((values[:-1] * values[1:] < 0) & clear[:-1] & clear[1:])
        left, right = grid[k], grid[k + 1]
        for _ in range(HALVINGS):
            middle = (left + right) / 2
            before = function(middle)[0] * values[k] > 0
            left, right = np.where(before, middle, left), np.where(before, right, middle)
        ends = np.minimum(np.abs(values[k]), np.abs(values[k + 1]))
        return left[np.abs(function(left)[0]) < ends].tolist()


def _with_factors(factors, force, y):
    """Return the different roots of all factors of g, or None where a factor has none, or has more in further turns.

    Where g has a turn, which may be several turns of a factor, they are those in a turn of g.
    """
    parts, q = [solutions_of([factor], [y]) for factor in factors], whole_turn(force, y)
    if None in parts or (q is None and any(whole_turn(factor, y) for factor in factors)):
        return None
    if q is None:
        return _joined(parts, [force])
    turns = [abs(common_turn(factor, y) / q) for factor in factors]
    return _different([{y: s[y] + 2 * sp.pi * k / (q * turn)} for turn, found in zip(turns, parts, strict=True)
                       for s in found for k in range(turn)], q, y)


def _different(roots, q, y):
    """Return the roots of which none is another and some turns 2 pi/q."""
    return [s for k, s in enumerate(roots)
            if not any(sp.expand((s[y] - r[y]) * q / (2 * sp.pi)).is_integer for r in roots[:k])]


def _mixes(force, y):
    """Tell whether a factor of g, a polynomial in y and in functions of y, has several of them: SymPy may not end.

    It solves for one of them, also within others, for roots of rational functions and y, for logarithms, and for waves
    whose turns fit; y with one exponential or logarithm may lead to Lambert's W.
    """
    if (powers := exponentials_as_powers(force, y)) and powers[0].is_rational_function(y, powers[1]):
        named, w, _ = powers
        return _has_factor(named, force, y, lambda factor, names: (
            factor.has(y) and len({k for (k,), _ in sp.Poly(factor, w).terms()}) > 2))
    named = {f: sp.Dummy() for f in outermost(force, [y])}
    own = {name: f for f, name in named.items()}

    def several(factor, names):
        inside = {own[name] for name in factor.free_symbols & names}
        if all(f.is_Pow and f.exp.is_Rational and f.base.is_rational_function(y) for f in inside):
            return False
        if len(inside) == 1:
            (f,) = inside
            exponential = isinstance(f, sp.exp) or (f.is_Pow and not f.base.has(y))
            return (factor.has(y) and not exponential and not isinstance(f, sp.log)) or _is_nested(f, y)
        whole, w = factor.xreplace(own), sp.Dummy(real=True)
        if one := next((f for f in inside if not whole.xreplace({f: w}).has(y)), None):
            return _mixes(whole.xreplace({one: w}), w) or _is_nested(one, y)
        fit = all(isinstance(f, sp.log) for f in inside) or (inside <= waves_in(force, y) and common_turn(force, y))
        return factor.has(y) or not fit

    return _has_factor(force.xreplace(named), force, y, several)


def _is_nested(f, y):
    """Tell whether the argument of f has several functions of y, or y and a function of y, or functions in three."""
    inside = [*outermost(f.args[0], [y])]
    return len(inside) > 0 and (_mixes(f.args[0] - sp.Dummy(), y) or any(
        next(outermost(part.args[0], [y]), None) for part in inside))


def _has_factor(named, force, y, test):
    """Tell whether ``named``, g with names for functions of y, has a factor with names that passes ``test``.

    A g that is too long for its factors passes where it has y and names at all.
    """
    named, names = sp.fraction(sp.together(named))[0], named.free_symbols - force.free_symbols
    if not names or not named.is_polynomial(y, *names):
        return False
    if heavy(force):
        return named.has(y)
    return any(factor.has(*names) and test(factor, names) for factor, _ in _factor_list(named, [y, *names]))


def _factor_list(named, symbols):
    """Return the factors of a polynomial with their powers, itself where these would take long to find.

    Where it lacks one of the symbols, SymPy may find none.
    """
    return [(named, 1)] if has_many_terms(named) else sp.factor_list(named, *(s for s in symbols if named.has(s)))[1]


def _has_none_at_last(equal_zero, unknowns):
    """Tell whether no solutions are known of what is left without linear unknowns: an equation, or ``_entangled``."""
    if len(unknowns) == 1:
        numerator = sp.fraction(sp.together(*equal_zero))[0]
        return not numerator.is_rational_function(*unknowns) and solutions_of([numerator], unknowns) is None
    slopes = ((k, y, equal_zero[k].diff(y)) for k in range(len(unknowns)) for y in unknowns)
    if (given := next(((k, y, slope) for k, y, slope in slopes if slope != 0 and not slope.has(y)), None)) is None:
        return _entangled(equal_zero, unknowns)
    k, y, slope = given
    own = -equal_zero[k].subs(y, 0) / slope
    left = [g.subs(y, own) for g in (*equal_zero[:k], *equal_zero[k + 1 :])]
    return _has_none_at_last(left, [other for other in unknowns if other != y])


def _entangled(equal_zero, unknowns):
    """Tell whether every unknown is in two functions of unknowns, or in one and outside: SymPy may not end.

    A function that is alone in an equation is known, and its argument counts; roots of one base count as one function.
    """
    names = {f: sp.Dummy() for g in equal_zero for f in outermost(g, unknowns)}
    named = [g.xreplace(names) for g in equal_zero]
    alone = [f for f, name in names.items()
             if any(g.free_symbols & {name, *unknowns, *names.values()} == {name} for g in named)]
    if alone:
        left = [g.xreplace({f: names[f] for f in alone}) for g in equal_zero]
        return _entangled([*left, *(part for f in alone for part in f.args)], unknowns)
    own = {f.base if f in fractional_powers(f) else f for f in names}
    return len(names) > 0 and all(sp.Tuple(*named).has(y) + sum(f.has(y) for f in own) > 1 for y in unknowns)


def _in_a_turn(found, numerator, t, q, force, y):
    """Return all roots of g in a turn of q y, each once, where SymPy's roots are ``found``.

    SymPy leaves out q y = pi, where t has no value, and some others. Its roots are shorter than 2 atan(t)/q.
    """
    roots = [{y: 2 * sp.atan(h) / q} for s in solutions_of([numerator], [t]) or () for h in s.values()]
    roots += [{y: sp.pi / q}] * is_zero(force.subs(y, sp.pi / q))
    return [*filter(_is_as_declared, max(_different(found, q, y), roots, key=len))]


def _solves(solution, equal_zero):
    """Tell whether g = 0, in numbers, and every unknown may be as it is declared.

    SymPy's own check may take long, or not end; roots of one rational g alone need it, as SymPy shortens them then.
    """
    return _is_as_declared(solution) and all(is_zero_on(g, solution) for g in equal_zero)


def is_zero_on(g: sp.Expr, solution: dict[sp.Symbol, sp.Expr]) -> bool:
    """Tell whether g = 0 on a solution, in numbers at generic points, or where an inverse function has its range.

    The points may be far from where asin(y) = x - 1000 has the root sin(x - 1000).
    """
    if is_zero_somewhere(g.subs(solution, simultaneous=True)):
        return True
    inverse = [f for f in g.atoms(*INVERSE) if f.has(*solution)]
    if len(inverse) != 1:
        return False
    (f,), w = inverse, sp.Dummy()
    named, inside = g.xreplace({f: w}), f.args[0].subs(solution, simultaneous=True)
    value, middle = (value_on(solution, line, w) for line in (named, RANGE[type(f)](w).diff(w)))
    if value is None or named.has(*solution):
        return False
    return is_zero_somewhere(INVERSE[type(f)](value) - inside) and _may_vanish(value - middle)


def value_on(branch: Mapping[sp.Symbol, sp.Expr], g: sp.Expr, w: sp.Symbol) -> sp.Expr | None:
    """Return the value on a branch that g = 0 gives w; None where g is not linear in w, or does not contain it there.

    A slope that vanishes on the branch is that of another factor of g.
    """
    slope = g.diff(w)
    if slope.has(w) or is_zero_somewhere(slope.subs(branch, simultaneous=True)):
        return None
    return (-g.subs(w, 0) / slope).subs(branch, simultaneous=True)


def _may_vanish(expr):
    """Tell whether ``expr`` may vanish at a real value of one of its symbols."""
    found = [solutions_of([expr], [s]) for s in expr.free_symbols]
    return None in found or not all(map(is_complex, heights(chain.from_iterable(found))))


def _is_as_declared(solution):
    """Tell whether every unknown may be as it is declared, and has no number without a value, as erfinv(2)."""
    numbers = (f for f in sp.Tuple(*solution.values()).atoms(sp.Function) if f.is_number)
    valueless = any(valued(f, {}, 15, real=False) is sp.nan for f in numbers)
    return not valueless and all(sp.check_assumptions(h, **y.assumptions0) is not False for y, h in solution.items())


def factors_of(force: sp.Expr, unknowns: Collection[sp.Symbol]) -> list[sp.Expr]:
    """Return the factors of the numerator of g that may vanish, each once, or [g] where g has no others.

    They are polynomials in the unknowns and in functions of these. With products SymPy may not end. A positive state
    does not vanish.
    """
    if heavy(force):
        return [force]
    names = {f: sp.Dummy() for f in outermost(force, unknowns)}
    (named, below), own = sp.fraction(sp.together(force.xreplace(names))), {name: f for f, name in names.items()}
    if not named.is_polynomial(*unknowns, *own) or has_many_terms(named):
        return [force]
    found = _factor_list(named, [*unknowns, *own])
    if sum(power for _, power in found) <= 1 and not below.has(*unknowns, *own):
        return [force]
    return [f for f in (factor.xreplace(own) for factor, _ in found) if not f.is_nonzero]


def _joined(parts, equal_zero):
    """Return all different solutions but the cases of one that leaves states free, or None where a part has None.

    Where a denominator vanishes, too, a root of a factor of g is none of g.
    """
    if None in parts:
        return None
    found = [s for part in parts for s in part if _solves(s, equal_zero)]
    free = [r for r in found if len(r) < max(map(len, found))]
    return [s for k, s in enumerate(found) if s not in found[:k] and not any(_is_case(s, r) for r in free)]


def _is_case(solution, other):
    """Tell whether a solution with more given states is a case of another one."""
    return len(other) < len(solution) and all(is_zero((y - h).subs(solution)) for y, h in other.items())


def _values_given(equal_zero, unknowns):
    """Return (equation, the values [{y: h}] that it gives one unknown by itself), or None.

    A y with a constant rational coefficient has its value in terms of the others; a y without others is preferred, as
    its formula has no root of the others' equations. SymPy takes minutes to solve cubics together with such an
    equation. Else, unless all are rational, an equation in y alone, as exp(-y) = atan(y), is solved before the others.
    """
    slopes = ((g, y, g.diff(y)) for g in equal_zero for y in unknowns)
    found = ((g, y, -g.subs(y, 0) / slope) for g, y, slope in slopes if slope.is_Rational and slope)
    if best := min(found, key=lambda given: given[2].has(*unknowns), default=None):
        return best[0], [{best[1]: best[2]}]
    if all(g.is_rational_function(*unknowns) for g in equal_zero):
        return None
    alone = ((g, [y for y in unknowns if g.has(y)]) for g in equal_zero)
    return next(((g, solutions_of([g], ys)) for g, ys in alone if len(ys) == 1), None)


def _with_values(given, equal_zero, unknowns):
    """Return the solutions of the equations other than that which gives an unknown, each completed by a value of it."""
    (force, values), found = given, []
    for own in values or ():
        left = [g.subs(own) for g in equal_zero if g is not force]
        solutions = solutions_of(left, [y for y in unknowns if y not in own])
        if solutions is None:
            return None
        found += [s | {y: sp.expand(h.subs(s)) for y, h in own.items()} for s in solutions]
    return values and found


def _linear_solution(matrix, rest, unknowns):
    """Return [solution] of matrix y + rest = 0, which leaves unknowns without pivots free, or [] where there is none.

    None where it is not known whether the matrix is singular.
    """
    if (places := pivots(matrix)) is None:
        if is_zero(_adjugate_and_determinant(matrix)[1]):
            return None
        places = [(k, k) for k in range(matrix.rows)]
    if len(places) < matrix.rows and len(places) != len(pivots(sp.Matrix.hstack(matrix, rest)) or ()):
        return []
    rows, columns = sorted(i for i, _ in places), sorted(j for _, j in places)
    own = [unknowns[j] for j in columns]
    right = -(rest + matrix * sp.Matrix([0 if y in own else y for y in unknowns]))[rows, :]
    found = _solved_linear(matrix[rows, columns], right) if own else ()
    return [*filter(_is_as_declared, [dict(zip(own, found, strict=True))])]


def _solved_linear(matrix, right):
    """Return the solution of matrix y = right, a matrix with an inverse."""
    if (found := solved(matrix, right)) is None:
        adjugate, determinant = _adjugate_and_determinant(matrix)
        sign = -1 if determinant.could_extract_minus_sign() else 1
        return (sign * adjugate) * right / (sign * determinant)
    return found


def _adjugate_and_determinant(matrix):
    """Return both, with symbols meanwhile for the entries of a matrix that are too long to be expanded."""
    names, meaning = entries_named(matrix) if heavy(sp.Tuple(*matrix)) else (matrix, {})
    adjugate, determinant = names.adjugate(method="berkowitz"), names.det(method="berkowitz")
    return adjugate.applyfunc(lambda e: replaced(e, meaning)), replaced(determinant, meaning)


def _eliminants(equal_zero, unknowns):
    """Return pairs (function that vanishes where g = 0, the only unknown y in it), with several unknowns for each y.

    With several unknowns g is rational, and the functions hold at generic numbers for all other symbols, and for
    functions of these and irrational numbers.
    """
    if len(unknowns) == 1:
        return [(*equal_zero, *unknowns)]
    named = sp.Tuple(*equal_zero)
    named = named.xreplace({f: sp.Dummy() for g in named for f in irrational_parts(g) if not f.has(*unknowns)})
    place = {s: number for s, number in generic_place(named).items() if s not in unknowns}
    found = [sp.fraction(sp.together(g.subs(place)))[0] for g in named]
    if not all(g.is_polynomial(*unknowns) and sp.Poly(g, *unknowns).domain in (sp.ZZ, sp.QQ) for g in found):
        return []
    bases = [sp.groebner(found, *(s for s in unknowns if s != y), y, order="grevlex") for y in unknowns]
    return [(basis.fglm("lex").exprs[-1], y) for basis, y in zip(bases, unknowns, strict=True)
            if basis.is_zero_dimensional]


def _is_beyond_radicals(force, y, unknowns):
    """Tell whether a polynomial g of y has a factor of degree above 2 without readable roots.

    SymPy takes an odd root of what is negative for complex, and leaves it out. With several unknowns SymPy may take
    minutes to join such roots, readable or not.
    """
    numerator = sp.fraction(sp.together(without_roots(force, y)))[0]
    if not numerator.is_polynomial(y):
        return False
    if has_many_terms(numerator):
        return True
    if (degree := sp.degree(numerator, y)) <= 2:
        return False
    if degree > DEGREE:
        return True
    factors = (f for f, _ in sp.factor_list(numerator, y)[1] if sp.degree(f, y) > 2)
    return any(unknowns > 1 or sum(found.values()) < sp.degree(f, y)
               or any(is_unreadable(root) or _is_odd_below_0(root) for root in found)
               for f in factors for found in [sp.roots(f, y)])


def _is_odd_below_0(root):
    odd = any(p.exp.q % 2 for p in fractional_powers(root))
    return odd and root.is_real is False and not is_complex(root)
