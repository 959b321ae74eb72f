r"""All roots of g(x, y, 0) = 0 in closed form: SymPy's, without false ones and with those that SymPy leaves out.

``_solutions`` is the hard function. It brings equations into forms that SymPy solves fast and completely: products
are split, unknowns that others give are eliminated, sines are put in half angles, and exponentials lead to Lambert's
W. It answers None where no short formula stands for every root.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import chain, product

import sympy as sp
from sympy.functions.elementary.hyperbolic import HyperbolicFunction
from sympy.functions.elementary.trigonometric import TrigonometricFunction
from sympy.simplify.fu import TR8

from asympk.errors import InputError
from asympk.formulas import NOT_FINITE
from asympk.symbolic.expansion import is_zero, is_zero_somewhere
from asympk.symbolic.long import (
    CLEAR,
    ROUGH,
    atoms,
    common_divisor,
    entries_named,
    generic_place,
    has_many_terms,
    heavy,
    named_exponentials,
    numerator_of,
    replaced,
)
from asympk.symbolic.lowering import lower

DEGREE = 20  # above it SymPy may take minutes to factor, and to find roots that are not readable
HALVINGS = 60  # of an interval in which a function changes its sign
RANGE: dict[type, Callable] = {  # what is positive inside the range of an inverse function
    **dict.fromkeys((sp.asin, sp.atan, sp.acsc, sp.acot), lambda w: sp.pi**2 / 4 - w**2),
    **dict.fromkeys((sp.acos, sp.asec), lambda w: w * (sp.pi - w)),
}
INVERSE: dict[type, Callable] = {
    sp.asin: sp.sin, sp.acos: sp.cos, sp.atan: sp.tan, sp.asec: sp.sec, sp.acsc: sp.csc, sp.acot: sp.cot,
}


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


def fractional_powers(*heights: sp.Expr) -> set[sp.Pow]:
    """Return the roots, powers with a rational and not a whole exponent, in expressions."""
    powers = sp.Tuple(*heights).atoms(sp.Pow)
    return {p for p in powers if p.exp.is_Rational and not p.exp.is_Integer}


def is_unreadable(h: sp.Expr) -> bool:
    """Tell whether a formula has cases, an odd root of a root, as Cardano's, or a root of a modulus or of -1."""
    return h.has(sp.Piecewise) or any(
        p.base.has(sp.Abs) or p.base == -1 or (p.exp.q % 2 and fractional_powers(p.base))
        for p in fractional_powers(h)
    )


def is_complex(h: sp.Expr) -> bool:
    """Tell whether an expression in real symbols that are not 0 has no real value where its even roots are real."""
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
    if heavy(sp.Tuple(*equal_zero)) or has_many_terms(sp.Tuple(*map(numerator_of, equal_zero))):
        matrix = (force := sp.Matrix(equal_zero)).jacobian(unknowns)
        if not matrix.has(*unknowns):
            return _linear_solution(matrix, force.subs(dict.fromkeys(unknowns, 0)), unknowns)
    own = len(unknowns) > 1 or not equal_zero[0].is_rational_function(*unknowns)
    if len(unknowns) == 1:
        equal_zero = [_in_base_e(*equal_zero, *unknowns)]
        if shifted := _from_phase(*equal_zero, *unknowns):
            return _by_power(*shifted, *unknowns)
        if own and (factors := factors_of(equal_zero[0], unknowns)) != equal_zero:
            return _with_factors(factors, *equal_zero, *unknowns)
        if closed := _by_lambert(*equal_zero, *unknowns) or _by_logarithm(*equal_zero, *unknowns):
            return closed
        ways = (way(*equal_zero, *unknowns) for way in (_without_logarithms, _in_exponentials, _in_roots))
        if powers := next(filter(None, ways), None):
            return _by_power(*powers, *unknowns)
        equal_zero = [_in_fewer_waves(*equal_zero, *unknowns)]
        if _mixes(*equal_zero, *unknowns):
            return None
    if len(unknowns) > 1 and (factors := [factors_of(g, unknowns) for g in equal_zero]) != [[g] for g in equal_zero]:
        return _joined([solutions_of([*choice], unknowns) for choice in product(*factors)], equal_zero)
    if len(unknowns) > 1 and (given := _values_given(equal_zero, unknowns)):
        return _with_values(given, equal_zero, unknowns)
    if 1 < len(unknowns) == len(equal_zero) and _has_none_at_last(equal_zero, unknowns):
        return None
    turning = _in_half_angle(*equal_zero, *unknowns) if len(unknowns) == 1 else None
    eliminants = [turning[:2]] if turning else _eliminants(equal_zero, unknowns)
    if any(_is_beyond_radicals(force, y, len(unknowns)) for force, y in eliminants):
        return None
    if turning and any(wave.args[0].subs(unknowns[0], 0) != 0 for wave in _waves(*equal_zero, *unknowns)):
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
        values = [h.xreplace(at).evalf() for h in heights]
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


def _waves(force, y):
    """Return the trigonometric functions of y in an expression."""
    return {f for f in force.atoms(TrigonometricFunction) if f.has(y)}


def _turn(force, y):
    """Return q where the turns of all waves of y in g, 2 pi/q together, fit each other, else None.

    A tangent has half the turn of a sine.
    """
    return _common_slope([f.args[0].diff(y) * (1 + isinstance(f, sp.tan | sp.cot)) for f in _waves(force, y)], y)


def _common_slope(slopes, y):
    """Return the largest q of which all slopes are whole multiples, without y, or None where there is none."""
    if not slopes or slopes[0].has(y) or not all((slope / slopes[0]).is_Rational for slope in slopes):
        return None
    return slopes[0] * common_divisor(slope / slopes[0] for slope in slopes)


def _from_phase(force, y):
    """Return (g, w, y by w) in w = y - y0, where g is a function of waves of w alone, else None.

    SymPy expands sin(y - 1), and then does not end for sin(y - 1)^2 = x.
    """
    arguments = [wave.args[0] for wave in _waves(force, y)]
    shifts = {sp.expand(a.subs(y, 0) / a.diff(y)) for a in arguments if not a.diff(y).has(y)}
    if len(shifts) != 1 or shifts == {0} or _turn(force, y) is None:
        return None
    w, (shift,) = sp.Dummy(real=True), shifts
    shifted = force.xreplace({a: a.diff(y) * w for a in arguments})
    return None if shifted.has(y) else (shifted, w, lambda value: value - shift)


def whole_turn(force: sp.Expr, y: sp.Symbol) -> sp.Expr | None:
    """Return q where g is a function of waves of y alone whose turns, 2 pi/q together, fit each other, else None."""
    return None if force.xreplace({f: sp.Dummy() for f in _waves(force, y)}).has(y) else _turn(force, y)


def _with_factors(factors, force, y):
    """Return the different roots of all factors of g, or None where a factor has none, or has more in further turns.

    Where g has a turn, which may be several turns of a factor, they are those in a turn of g.
    """
    parts, q = [solutions_of([factor], [y]) for factor in factors], whole_turn(force, y)
    if None in parts or (q is None and any(whole_turn(factor, y) for factor in factors)):
        return None
    if q is None:
        return _joined(parts, [force])
    turns = [abs(_turn(factor, y) / q) for factor in factors]
    return _different([{y: s[y] + 2 * sp.pi * k / (q * turn)} for turn, found in zip(turns, parts, strict=True)
                       for s in found for k in range(turn)], q, y)


def _different(roots, q, y):
    """Return the roots of which none is another and some turns 2 pi/q."""
    return [s for k, s in enumerate(roots)
            if not any(sp.expand((s[y] - r[y]) * q / (2 * sp.pi)).is_integer for r in roots[:k])]


def _in_fewer_waves(force, y):
    """Return g with sines and cosines of multiples of y for products of them, where these are fewer, else g."""
    if heavy(force) or len(waves := _waves(force, y)) < 2:
        return force
    shorter = TR8(force)
    return shorter if len(_waves(shorter, y)) < len(waves) else force


def _mixes(force, y):
    """Tell whether a factor of g, a polynomial in y and in functions of y, has several of them: SymPy may not end.

    It solves for one of them, also within others, for roots of rational functions and y, for logarithms, and for waves
    whose turns fit; y with one exponential or logarithm may lead to Lambert's W.
    """
    if (powers := _exponentials_as_powers(force, y)) and powers[0].is_rational_function(y, powers[1]):
        named, w, _ = powers
        return _has_factor(named, force, y, lambda factor, names: (
            factor.has(y) and len({k for (k,), _ in sp.Poly(factor, w).terms()}) > 2))
    named = {f: sp.Dummy() for f in _outermost(force, [y])}
    own = {name: f for f, name in named.items()}

    def several(factor, names):
        inside = {own[name] for name in factor.free_symbols & names}
        if all(_is_root_of_rational(f, y) for f in inside):
            return False
        if len(inside) == 1:
            (f,) = inside
            exponential = isinstance(f, sp.exp) or (f.is_Pow and not f.base.has(y))
            return (factor.has(y) and not exponential and not isinstance(f, sp.log)) or _is_nested(f, y)
        whole, w = factor.xreplace(own), sp.Dummy(real=True)
        if one := next((f for f in inside if not whole.xreplace({f: w}).has(y)), None):
            return _mixes(whole.xreplace({one: w}), w) or _is_nested(one, y)
        fit = all(isinstance(f, sp.log) for f in inside) or (inside <= _waves(force, y) and _turn(force, y))
        return factor.has(y) or not fit

    return _has_factor(force.xreplace(named), force, y, several)


def _outermost(force, unknowns):
    """Yield the functions of unknowns, and powers other than whole ones, in which g is rational with the unknowns."""
    if force.is_Add or force.is_Mul or (force.is_Pow and force.exp.is_Integer):
        for part in force.args:
            yield from _outermost(part, unknowns)
    elif force.has(*unknowns) and force not in unknowns:
        yield force


def _is_nested(f, y):
    """Tell whether the argument of f has several functions of y, or y and a function of y, or functions in three."""
    inside = [*_outermost(f.args[0], [y])]
    return len(inside) > 0 and (_mixes(f.args[0] - sp.Dummy(), y) or any(
        next(_outermost(part.args[0], [y]), None) for part in inside))


def _is_root_of_rational(f, y):
    return f.is_Pow and f.exp.is_Rational and f.base.is_rational_function(y)


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
    names = {f: sp.Dummy() for g in equal_zero for f in _outermost(g, unknowns)}
    named = [g.xreplace(names) for g in equal_zero]
    alone = [f for f, name in names.items()
             if any(g.free_symbols & {name, *unknowns, *names.values()} == {name} for g in named)]
    if alone:
        left = [g.xreplace({f: names[f] for f in alone}) for g in equal_zero]
        return _entangled([*left, *(part for f in alone for part in f.args)], unknowns)
    own = {f.base if f in fractional_powers(f) else f for f in names}
    return len(names) > 0 and all(sp.Tuple(*named).has(y) + sum(f.has(y) for f in own) > 1 for y in unknowns)


def _in_half_angle(force, y):
    """Return (numerator of g in t, t, q), t = tan(q y/2), where g is rational in sines and cosines of q y, else None.

    The period of g is 2 pi/q; with tangents alone they are those of q y/2.
    """
    if heavy(force) or not (q := _turn(force, y)):
        return None
    t, s = sp.symbols("t s", cls=sp.Dummy, real=True)
    sine, cosine = t / sp.sqrt(1 + t**2), 1 / sp.sqrt(1 + t**2)
    known = {sp.sin(s): sine, sp.cos(s): cosine, sp.tan(s): t, sp.cot(s): 1 / t}
    expanded = sp.expand_trig(force.subs(y, 2 * s / q)).xreplace(known)
    numerator = sp.fraction(sp.cancel(expanded))[0]
    return (numerator, t, q) if numerator.is_polynomial(t) and not numerator.has(s) else None


def _in_a_turn(found, numerator, t, q, force, y):
    """Return all roots of g in a turn of q y, each once, where SymPy's roots are ``found``.

    SymPy leaves out q y = pi, where t has no value, and some others. Its roots are shorter than 2 atan(t)/q.
    """
    roots = [{y: 2 * sp.atan(h) / q} for s in solutions_of([numerator], [t]) or () for h in s.values()]
    roots += [{y: sp.pi / q}] * is_zero(force.subs(y, sp.pi / q))
    return max(_different(found, q, y), roots, key=len)


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
    """Tell whether every unknown may be as it is declared."""
    return all(sp.check_assumptions(h, **y.assumptions0) is not False for y, h in solution.items())


def factors_of(force: sp.Expr, unknowns: Collection[sp.Symbol]) -> list[sp.Expr]:
    """Return the factors of the numerator of g that may vanish, each once, or [g] where g has no others.

    They are polynomials in the unknowns and in functions of these. With products SymPy may not end. A positive state
    does not vanish.
    """
    if heavy(force):
        return [force]
    names = {f: sp.Dummy() for f in _outermost(force, unknowns)}
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


def _in_base_e(force, y):
    """Return g with exponentials in place of powers of other numbers: 4**y is the square of 2**y = e**(y log(2))."""
    powers = (p for p in force.atoms(sp.Pow) if p.exp.has(y) and not p.base.has(y))
    return force.xreplace({p: sp.exp(p.exp * sp.expand_log(sp.log(p.base))) for p in powers})


def _by_lambert(force, y):
    """Return [root] of a + b y + c e^(p + q y), or of its product with an exponential, else None.

    SymPy takes roots of the order of b/c here, which may not end.
    """
    exponentials = [e for e in force.atoms(sp.exp) if e.has(y)]
    if len(exponentials) != 1 or not exponentials[0].exp.is_polynomial(y):
        return None
    power = sp.Dummy()
    named, exponent = sp.expand(force.xreplace({exponentials[0]: power})), sp.Poly(exponentials[0].exp, y)
    if not named.is_polynomial(y, power) or exponent.degree() != 1:
        return None
    terms = dict(sp.Poly(named, y, power).terms())
    for shift, sign in ((0, 1), (1, -1)):
        constant, linear, other = (0, shift), (1, shift), (0, 1 - shift)
        if {linear, other} <= terms.keys() <= {constant, linear, other}:
            a, b, c = (terms.get(index, 0) for index in (constant, linear, other))
            q, p = (sign * k for k in exponent.all_coeffs())
            return [{y: -a / b - sp.LambertW(q * c / b * sp.exp(p - q * a / b)) / q}]
    return None


def _by_logarithm(force, y):
    """Return [root] of a + b y + c log(p + q y), or of its product with a power of p + q y, else None.

    In w = log(p + q y) the logarithm is linear beside an exponential, which ``_by_lambert`` solves for w.
    """
    logarithms = [f for f in force.atoms(sp.log) if f.has(y)]
    if len(logarithms) != 1 or not logarithms[0].args[0].is_polynomial(y):
        return None
    w, inside = sp.Dummy(real=True), sp.Poly(logarithms[0].args[0], y)
    if inside.degree() != 1:
        return None
    height = (sp.exp(w) - inside.nth(0)) / inside.nth(1)
    found = _by_lambert(force.xreplace({logarithms[0]: w}).subs(y, height), w)
    return found and [{y: height.subs(root)} for root in found]


def _without_logarithms(force, y):
    """Return (numerator of e^(g/q) - 1, y, y by y), where g has rational multiples of several logarithms, else None.

    The q makes whole powers of these. SymPy takes the roots of a cubic for log(y) + log(y + 1) + log(y + 2) = x.
    """
    logarithms = [f for f in _outermost(force, [y]) if isinstance(f, sp.log)]
    if len(logarithms) < 2 or heavy(force):
        return None
    names = {f: sp.Dummy() for f in logarithms}
    named = sp.expand(force.xreplace(names))
    slopes = [named.diff(name) for name in names.values()]
    if (q := _common_slope(slopes, y)) is None or q.has(*names.values()):
        return None
    rest = named.xreplace(dict.fromkeys(names.values(), sp.S.Zero))
    powers = sp.Mul(*(f.args[0] ** (slope / q) for f, slope in zip(logarithms, slopes, strict=True)))
    return None if rest.has(y) else (sp.fraction(sp.together(powers - sp.exp(-rest / q)))[0], y, lambda value: value)


def _in_exponentials(force, y):
    """Return (numerator of g in w, w, y by w), w = exp(q y), where g is rational in several powers of it, else None.

    Hyperbolic functions are such powers. For exp(y/2) beside exp(y/3), and tanh(y) beside exp(y), SymPy does not end.
    """
    if heavy(force) or not (powers := _exponentials_as_powers(force, y)):
        return None
    named, w, q = powers
    return _in_one_power(named, y, w, lambda value, step: sp.log(sp.together(value)) / (q * step))


def _exponentials_as_powers(force, y):
    """Return (g with powers of w, w, q), w = exp(q y), where g has several exponentials that are such powers."""
    hyperbolic = {f: f.rewrite(sp.exp) for f in force.atoms(HyperbolicFunction) if f.has(y)}
    force = force.xreplace(hyperbolic)
    exponentials = [e for e in force.atoms(sp.exp) if e.has(y)]
    slopes = [e.exp.diff(y) for e in exponentials]
    if len(slopes) + len(hyperbolic) < 2 or (q := _common_slope(slopes, y)) is None:
        return None
    q, w = -q if q.could_extract_minus_sign() else q, sp.Dummy(positive=True)
    powers = {e: w ** (k / q) * sp.exp(e.exp.subs(y, 0)) for e, k in zip(exponentials, slopes, strict=True)}
    return force.xreplace(powers), w, q


def _in_roots(force, y):
    """Return (numerator of g in w, w, y by w), w a root of a + b y, where g is rational in powers of it, else None."""
    roots = {p for p in fractional_powers(force) if p.has(y)} if not heavy(force) else ()
    bases = {p.base for p in roots}
    if len(bases) != 1 or (slope := (base := bases.pop()).diff(y)).has(y):
        return None
    q, w = sp.ilcm(1, *(p.exp.q for p in roots)), sp.Dummy(nonnegative=True)

    def height(value, step=1):
        found = (value ** sp.Rational(q, step) - base.subs(y, 0)) / slope
        return sp.expand(found) if fractional_powers(value) else found

    return _in_one_power(force.xreplace({p: w ** (q * p.exp) for p in roots}).subs(y, height(w)), y, w, height)


def _in_one_power(force, y, w, height):
    """Return (numerator of g in w, w, y by w) with the least powers of w, where g is rational in w alone, else None."""
    numerator = sp.fraction(sp.together(force))[0]
    if not numerator.is_polynomial(w) or numerator.has(y):
        return None
    terms = sp.Poly(numerator, w).terms()
    least = min(k for (k,), _ in terms) if w.is_positive else 0
    step = sp.igcd(0, *(k - least for (k,), _ in terms)) or 1
    return sum(c * w ** ((k - least) // step) for (k,), c in terms), w, lambda value: height(value, step)


def _values_given(equal_zero, unknowns):
    """Return (equation, the values [{y: h}] that it gives one unknown by itself), or None.

    A y with a constant rational coefficient has its value in terms of the others; a y without others is preferred, as
    its formula has no root of the others' equations. SymPy takes minutes to solve cubics together with such an
    equation. Else an equation that is not rational, in y alone, as exp(-y) = atan(y), is solved before the others.
    Linear systems need no such help: None.
    """
    if not sp.Matrix(equal_zero).jacobian(unknowns).has(*unknowns):
        return None
    slopes = ((g, y, g.diff(y)) for g in equal_zero for y in unknowns)
    found = ((g, y, -g.subs(y, 0) / slope) for g, y, slope in slopes if slope.is_Rational and slope)
    if best := min(found, key=lambda given: given[2].has(*unknowns), default=None):
        return best[0], [{best[1]: best[2]}]
    alone = ((g, [y for y in unknowns if g.has(y)]) for g in equal_zero)
    own = ((g, ys) for g, ys in alone if len(ys) == 1 and not g.is_rational_function(*ys))
    return next(((g, solutions_of([g], ys)) for g, ys in own), None)


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
    """Return [solution] of matrix y + rest = 0, unsimplified, or [] where the matrix is singular.

    Symbols stand for the entries of a matrix that are too long to be expanded.
    """
    names, meaning = entries_named(matrix) if heavy(sp.Tuple(*matrix)) else (matrix, {})
    if is_zero(determinant := replaced(names.det(method="berkowitz"), meaning)):
        return []
    solved = -names.adjugate(method="berkowitz").applyfunc(lambda e: replaced(e, meaning)) * rest / determinant
    return [dict(zip(unknowns, solved, strict=True))]


def _eliminants(equal_zero, unknowns):
    """Return pairs (function that vanishes where g = 0, the only unknown y in it), with several unknowns for each y.

    With several unknowns g is rational, and the functions hold at generic numbers for all other symbols.
    """
    if len(unknowns) == 1:
        return [(*equal_zero, *unknowns)]
    place = {s: number for s, number in generic_place(sp.Tuple(*equal_zero)).items() if s not in unknowns}
    found = [sp.fraction(sp.together(g.subs(place)))[0] for g in equal_zero]
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
    numerator = sp.fraction(sp.together(_without_roots(force, y)))[0]
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


def _without_roots(force, y):
    """Return a function that vanishes where g = 0, without the roots of functions of y that g contains.

    It is the product of g over all values of each root, a resultant. SymPy takes minutes for quartics with roots in g.
    """
    while not heavy(force) and (roots := {p for p in fractional_powers(force) if p.has(y)}):
        base = max((p.base for p in roots), key=sp.count_ops)
        powers = [p for p in roots if p.base == base]
        w, q = sp.Dummy(), sp.ilcm(1, *(p.exp.q for p in powers))
        named = sp.fraction(sp.together(force.xreplace({p: w ** (q * p.exp) for p in powers})))[0]
        relation = sp.fraction(sp.together(w**q - base))[0]
        if not (named.is_polynomial(w) and relation.is_polynomial(w)):
            return force
        force = sp.resultant(named, relation, w)
    return force
