r"""Where a branch y = h_0(x) of g = 0 is real: what is positive there, without the ends.

Even roots and logarithms on the branch have positive arguments. The arguments of odd roots are positive, too, and those
of inverse functions, as of tanh, erf and w e^w, also of those in g, lie inside the domains of these. A root in g is
positive by the value that g = 0 gives it: y = x**2 solves x - sqrt(y) = 0 for x > 0 alone. So do inverse functions have
values in their ranges: y = tan(x) solves x - atan(y) = 0 for |x| < pi/2. ``positive_on`` is the entry, and
``_within_ranges`` the hard function.
"""

from collections.abc import Callable, Iterable

import sympy as sp
from sympy.functions.elementary.hyperbolic import HyperbolicFunction

from asympk.symbolic.conditions import declared_sign
from asympk.symbolic.expansion import is_implicit, is_zero, is_zero_somewhere
from asympk.symbolic.long import heavy
from asympk.symbolic.roots import INVERSE, RANGE, solutions_of, value_on
from asympk.symbolic.substitutions import fractional_powers

_POSITIVE: dict[type, Callable] = {
    sp.log: lambda z: z, sp.acosh: lambda z: z - 1, **dict.fromkeys((sp.asin, sp.acos, sp.atanh), lambda z: 1 - z**2),
    sp.asech: lambda z: z * (1 - z), **dict.fromkeys((sp.asec, sp.acsc, sp.acoth), lambda z: z**2 - 1),
    sp.LambertW: lambda z: z + sp.exp(-1), sp.erfinv: lambda z: 1 - z**2, sp.erfcinv: lambda z: z * (2 - z),
}
_RANGE: dict[type, Callable] = {
    **RANGE, sp.LambertW: lambda w: w + 1, **dict.fromkeys((sp.acosh, sp.asech, sp.exp), lambda w: w),
}
_INVERSE: dict[type, Callable] = {  # of functions whose values have one argument each
    **INVERSE, sp.acosh: sp.cosh, sp.LambertW: lambda w: w * sp.exp(w),
    sp.exp: sp.log, sp.log: sp.exp, sp.sinh: sp.asinh, sp.asinh: sp.sinh, sp.tanh: sp.atanh, sp.atanh: sp.tanh,
    sp.asech: sp.sech, sp.acsch: sp.csch, sp.acoth: sp.coth,
}


def positive_on(branch: sp.Dict, limits: Iterable[sp.Expr]) -> set[sp.Expr]:
    """Return what is positive where a branch is real; ``limits`` are the rates g at mu = 0.

    A state that is declared positive or negative is so on the branch.
    """
    found = sp.Tuple(*branch.values())
    inside = {_POSITIVE[type(f)](f.args[0]) for f in found.atoms(*_POSITIVE)}
    inside |= {p.base for p in fractional_powers(found)}
    inside |= {-f.args[0] for f in found.atoms(sp.LambertW) if len(f.args) == 2}
    for g in limits:
        inside |= {_POSITIVE[type(f)](f.args[0]).subs(branch, simultaneous=True) for f in g.atoms(*_POSITIVE)
                   if f.has(*branch)}
        inside |= {*_within_ranges(g, branch), *_within_turn(g, branch)}
    return inside | ({declared_sign(y) * h for y, h in branch.items() if y != h} - {0})


def _within_ranges(g, branch):
    """Yield what is positive where roots and inverse functions in g have the values on a branch that g = 0 gives them.

    Where g is linear in one, as a + b sqrt(P), the branch solves P = (a/b)**2, also where -a/b is negative. By its
    value what lies inside it has one, too: x = sqrt(sqrt(y) - 1) gives sqrt(y) = x**2 + 1. Exponentials of y/2 are
    roots of that of y.
    """
    if heavy(g):
        return
    waves = {f for f in g.atoms(HyperbolicFunction) if f.has(*branch)}
    if any(type(f) not in _INVERSE for f in waves):
        g = g.xreplace({f: f.rewrite(sp.exp) for f in waves})
    if is_implicit(branch):
        yield from {p.base for p in fractional_powers(g) if p.has(*branch)}
        return
    outer = _outermost(g, branch)
    outer = {f for f in outer if not (isinstance(f, sp.exp) and f.exp.could_extract_minus_sign() and 1 / f in outer)}
    roots = outer & fractional_powers(*outer)
    if roots == outer and (values := _values_of_roots(g, roots, branch)):
        yield from values
        return
    for base in {p.base for p in roots}:
        if len(outer) > 1:
            yield base.subs(branch, simultaneous=True)
        yield from _root_within_range(g, base, {p for p in roots if p.base == base}, branch)
    for f in outer - roots:
        yield from _inverse_within_range(g, f, branch)


def _within_turn(g, branch):
    """Yield what is positive where angles atan2(a, b) have the values w on a branch that g = 0, linear in each, gives.

    With |w| < pi, a cos w = b sin w gives the angle or the opposite one, where a sin w + b cos w is negative.
    """
    for f in g.atoms(sp.atan2) if not (heavy(g) or is_implicit(branch)) else ():
        named = g.xreplace({f: (w := sp.Dummy())})
        if f.has(*branch) and (value := value_on(branch, named, w)) is not None:
            a, b = (e.subs(branch, simultaneous=True) for e in f.args)
            yield sp.pi**2 - value**2
            yield sp.trigsimp(a * sp.sin(value) + b * sp.cos(value))


def _outermost(expr, branch):
    """Return the roots and the functions with inverses, of fast states, that lie in no other ones."""
    if not expr.has(*branch):
        return set()
    if (type(expr) in _INVERSE and len(expr.args) == 1) or expr in fractional_powers(expr):
        return {expr}
    return set[sp.Expr]().union(*(_outermost(part, branch) for part in expr.args))


def _root_within_range(g, base, powers, branch):
    """Yield what is positive where a root of ``base`` has the value that g = 0 gives it.

    Terms of g that vanish somewhere on the branch, as those of another factor of g, give no value.
    """
    q, root, parts = sp.ilcm(1, *(p.exp.q for p in powers)), sp.Dummy(positive=True), dict[int, sp.Expr]()
    numerator, _ = sp.fraction(sp.together(named := g.xreplace({p: root ** (q * p.exp) for p in powers})))
    terms = sp.Poly(numerator, root).terms() if numerator.is_polynomial(root) else ()
    for (k,), c in terms:
        parts[k % q] = parts.get(k % q, 0) + c * base ** (k // q)
    if len(terms) == 1 and not is_zero_somewhere(terms[0][1].subs(branch, simultaneous=True)):
        yield sp.S.Zero  # the root itself vanishes, and is real on one side alone
        return
    own, *values = (e.subs(branch, simultaneous=True) for e in (base, *(parts[k] for k in sorted(parts))))
    if len(values) != 2 or is_zero_somewhere(values[1]):
        yield own
        yield from _values(named.xreplace({base: root**q}), root, root**q - own, branch)
        return
    exponent = sp.Rational(max(parts) - min(parts), q)
    yield sp.factor(-values[0] * values[1])
    if exponent.p > 1:
        yield own
    if _outermost(base, branch):
        yield from _within_ranges(base - sp.factor(-values[0] / values[1]) ** (1 / exponent), branch)


def _values_of_roots(g, powers, branch):
    """Return the values on a branch of roots of several bases, or [] where g is not linear in each of them.

    Each is eliminated by its value in turn: sqrt(y + 1) = sqrt(y) - x leaves 2 x sqrt(y) = x**2 - 1.
    """
    bases, given = sorted({p.base for p in powers}, key=sp.default_sort_key), list[tuple[sp.Expr, ...]]()
    degrees = [sp.ilcm(1, *(p.exp.q for p in powers if p.base == base)) for base in bases]
    roots = {base: sp.Dummy(positive=True) for base in bases}
    g = g.xreplace({p: roots[p.base] ** (q * p.exp) for base, q in zip(bases, degrees, strict=True)
                    for p in powers if p.base == base})
    for base, q in zip(bases, degrees, strict=True) if len(bases) > 1 else ():
        numerator, root = sp.fraction(sp.together(g))[0], roots[base]
        rest = numerator.is_polynomial(root) and sp.Poly(numerator, root).rem(sp.Poly(root**q - base, root))
        if _outermost(base, branch) or not rest or rest.degree() != 1:
            return []
        slope, constant = rest.all_coeffs()
        given.append((root, slope, -constant / slope))
        g = base - given[-1][-1] ** q
    known = dict(branch)
    for root, slope, value in reversed(given):
        if is_zero_somewhere(slope.subs(known, simultaneous=True)):
            return []
        known[root] = sp.factor(value.subs(known, simultaneous=True))
    return [known[root] for root, *_ in given]


def _inverse_within_range(g, f, branch):
    """Yield what is positive where an inverse function f of y has the value, inside its range, that g = 0 gives it."""
    w, inside = sp.Dummy(real=True), f.args[0]
    others = {e: e.exp / inside for e in g.atoms(sp.exp)} if isinstance(f, sp.exp) else {f: sp.S.One}
    named = g.xreplace({e: w**power for e, power in others.items() if power.is_Integer})
    value, nested = value_on(branch, named, w), bool(_outermost(inside, branch))
    if value is not None:
        values = [sp.factor(value)]
    elif named.diff(w).has(w) and (nested or (type(f) in _RANGE and not _has_whole_slopes(f, branch))):
        values = _values(named, w, _INVERSE[type(f)](w) - inside.subs(branch, simultaneous=True), branch)
    else:
        return
    for value in values:
        if type(f) in _RANGE:
            yield _RANGE[type(f)](value)
        if nested:
            yield from _within_ranges(inside - _INVERSE[type(f)](value), branch)


def _has_whole_slopes(f, branch):
    """Tell whether f is an exponential of whole multiples of fast states, whose logarithms the branch has itself."""
    return isinstance(f, sp.exp) and all(f.exp.diff(y).is_Integer for y in branch)


def _values(g, w, meaning, branch):
    """Return [value] of the one root w of g on a branch that solves ``meaning`` = 0, too, or [] if several do."""
    if heavy(named := g.subs(branch, simultaneous=True)) or is_zero(named):
        return []
    values = [s[w] for s in solutions_of([named], [w]) or () if w in s]
    found = [value for value in values if is_zero_somewhere(meaning.subs(w, value))]
    return found if len(found) == 1 else []
