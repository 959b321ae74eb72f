r"""Critical manifolds g(x, y, 0) = 0 of every mode: where they lie, and whether they attract.

A branch y = h_0(x) is normally hyperbolic where no eigenvalue of dg/dy on it has real part 0. The signs of the real
parts, found by Hurwitz determinants, separate attracting from repelling directions. ``critical_manifolds`` solves g = 0
for all branches, by ``roots``. ``CriticalManifold`` states the conditions on one branch. Where a root has no readable
formula in real numbers, one implicit manifold, ``{y: y}``, stands for all of its mode.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Self

import sympy as sp
from sympy.functions.elementary.hyperbolic import HyperbolicFunction

from asympk.errors import BranchError, InputError, NotDerivable, NotNormallyHyperbolic
from asympk.numbers import short
from asympk.shown import Card, Several, ShownAsFormulas
from asympk.symbolic.conditions import declared_sign, reduce_under
from asympk.symbolic.expansion import (
    by_powers,
    fast_jacobian,
    is_implicit,
    is_zero,
    is_zero_somewhere,
    jacobian_on_branch,
    limit_of,
    one_side,
    over_fast,
    require_series,
    require_short,
)
from asympk.symbolic.hurwitz import Spectra, attracting, off_axis, repelling, spectra, split
from asympk.symbolic.long import heavy, replaced
from asympk.symbolic.reading import expression
from asympk.symbolic.roots import fractional_powers, heights, is_complex, is_unreadable, real_forms, solutions_of
from asympk.symbolic.sides import Sides, is_switched, is_whole, on_sides, phases
from asympk.symbolic.signs import above, conjunction, factored, nonzero, with_known_lambert
from asympk.symbolic.system import Mode, System, of_system
from asympk.symbolic.values import as_exact, by_symbol, in_words

MOST_SIDES = 8  # switches in the rates of one mode; each doubles the number of its smooth parts
MOST = 8  # functions, such as sines, in an expression that is factored: with more, factoring may not end
_POSITIVE: dict[type, Callable] = {
    sp.log: lambda z: z, sp.acosh: lambda z: z - 1, **dict.fromkeys((sp.asin, sp.acos, sp.atanh), lambda z: 1 - z**2),
    sp.asech: lambda z: z * (1 - z), **dict.fromkeys((sp.asec, sp.acsc, sp.acoth), lambda z: z**2 - 1),
    sp.LambertW: lambda z: z + sp.exp(-1), sp.erfinv: lambda z: 1 - z**2, sp.erfcinv: lambda z: z * (2 - z),
}  # fmt: skip
_RANGE: dict[type, Callable] = {  # what is positive inside the range of a function
    **dict.fromkeys((sp.asin, sp.atan, sp.acsc, sp.acot), lambda w: sp.pi**2 / 4 - w**2),
    **dict.fromkeys((sp.acos, sp.asec), lambda w: w * (sp.pi - w)), sp.LambertW: lambda w: w + 1,
    **dict.fromkeys((sp.acosh, sp.asech, sp.exp), lambda w: w),
}  # fmt: skip
_INVERSE: dict[type, Callable] = {  # of functions whose values have one argument each
    sp.asin: sp.sin, sp.acos: sp.cos, sp.atan: sp.tan, sp.acosh: sp.cosh, sp.LambertW: lambda w: w * sp.exp(w),
    sp.exp: sp.log, sp.log: sp.exp, sp.sinh: sp.asinh, sp.asinh: sp.sinh, sp.tanh: sp.atanh, sp.atanh: sp.tanh,
    sp.asec: sp.sec, sp.acsc: sp.csc, sp.acot: sp.cot, sp.asech: sp.sech, sp.acsch: sp.csch, sp.acoth: sp.coth,
}  # fmt: skip


@dataclass(frozen=True, repr=False)
class CriticalManifold(ShownAsFormulas):
    """The manifold ``y = branch[y]`` of one mode at mu = 0, under ``assumptions`` on the parameters."""

    name: str
    dynamics: Mode = field(repr=False)
    small: sp.Symbol = field(repr=False)
    branch: sp.Dict
    assumptions: sp.Basic = field(default=sp.true, repr=False)

    @property
    def mode(self) -> str:
        """The name of the mode."""
        return self.dynamics.name

    @cached_property
    def jacobian(self) -> sp.Matrix:
        """The matrix dg/dy on the manifold."""
        at = {**self.branch, **over_fast(self.dynamics, self.small, self.branch)}
        return jacobian_on_branch(self.dynamics, self.small).subs(at, simultaneous=True).applyfunc(sp.factor)

    @cached_property
    def characteristic(self) -> Spectra:
        """The polynomials whose product is det(nu - dg/dy) on the manifold, from the highest coefficient of each."""
        return spectra(self.jacobian)

    @cached_property
    def real(self) -> sp.Basic:
        """The condition under which the branch is real, without its ends: even roots and logs have positive arguments.

        The arguments of odd roots are positive, too, and those of inverse functions, as of tanh, erf and w e^w, also of
        those in g, lie inside the domains of these. A root in g is positive by the value that g = 0 gives it:
        y = x**2 solves x - sqrt(y) = 0 for x > 0 alone. So do inverse functions have values in their ranges:
        y = tan(x) solves x - atan(y) = 0 for |x| < pi/2. A state that is declared positive or negative is so on the
        branch.
        """
        if any(map(is_complex, (*self.branch.values(), *self.jacobian))):
            return sp.false
        found = sp.Tuple(*self.branch.values())
        roots = fractional_powers(found)
        inside = {_POSITIVE[type(f)](f.args[0]) for f in found.atoms(*_POSITIVE)} | {p.base for p in roots}
        inside |= {-f.args[0] for f in found.atoms(sp.LambertW) if len(f.args) == 2}
        limits = [limit_of(g, self.small) for g in self.dynamics.fast.values()]
        inside |= {_POSITIVE[type(f)](f.args[0]).subs(self.branch, simultaneous=True) for g in limits
                   for f in g.atoms(*_POSITIVE) if f.has(*self.branch)}  # fmt: skip
        inside |= {given for g in limits for given in _within_ranges(g, self.branch)}
        inside |= {declared_sign(y) * h for y, h in self.branch.items() if y != h} - {0}
        if any(expr.has(sp.I) or with_known_lambert(expr).is_extended_real is False for expr in inside):
            return sp.false
        roots |= {p for p in fractional_powers(*inside) if p.base in inside}
        names = {p: sp.Dummy(positive=True) for p in roots}
        told = {expr: above(expr.xreplace(names)) for expr in inside}
        positive = {known if known in (sp.true, sp.false) else above(expr) for expr, known in told.items()}
        return sp.And(*(_located(relation, list(self.dynamics.slow), self.assumptions) for relation in positive))

    @property
    def _assumed(self):
        return sp.And(self.assumptions, self.real)

    @cached_property
    def exists(self) -> sp.Basic:
        """The condition under which the branch is real and finite, and no eigenvalue of dg/dy has real part 0."""
        if self._finite == sp.false:
            return sp.false
        return sp.And(off_axis(self.characteristic, self._assumed), self.real, self._finite)

    @cached_property
    def _finite(self):
        """The condition under which branch and dg/dy are finite; ``real`` covers roots in denominators."""
        if sp.Tuple(*self.branch.values(), *self.jacobian).has(sp.zoo, sp.nan):
            return sp.false
        if not fast_jacobian(self.dynamics, self.small).has(*self.branch):  # only det dg/dy divides
            return sp.true
        below = (sp.fraction(sp.together(h))[1] for h in self.branch.values())
        factors = (factor for expr in below for factor, _ in factored(expr)[1] if not fractional_powers(factor))
        return sp.And(*(nonzero(factor, self._assumed) for factor in factors))

    @cached_property
    def attracting(self) -> sp.Basic:
        """The condition under which every eigenvalue of dg/dy has a negative real part."""
        return attracting(self.characteristic, self._assumed)

    @cached_property
    def repelling(self) -> sp.Basic:
        """The condition under which every eigenvalue of dg/dy has a positive real part."""
        return repelling(self.characteristic, self._assumed)

    @cached_property
    def saddle(self) -> sp.Basic:
        """The condition under which dg/dy has eigenvalues on both sides of the imaginary axis and none on it."""
        return split(self.characteristic, self._assumed)

    @cached_property
    def folds(self) -> sp.Basic:
        """The condition under which the manifold folds or meets another manifold: det dg/dy = 0."""
        below = (sp.fraction(sp.together(p[-1]))[0] for p in self.characteristic)
        return sp.to_nnf(sp.Not(sp.And(*(nonzero(determinant, self.assumptions) for determinant in below))))

    @cached_property
    def stability(self) -> str:
        """``"stable"`` (all fast directions attract), ``"unstable"`` (all repel) or ``"saddle"`` (some of each).

        A ``Piecewise`` of these names, as symbols, where it depends on parameters or on the place in ``domain``. Raises
        ``NotNormallyHyperbolic`` where dg/dy has an eigenvalue on the imaginary axis on the whole manifold.
        """
        if self.exists == sp.false:
            raise NotNormallyHyperbolic(self.degeneracy(self.branch))
        kinds = {"stable": self.attracting, "unstable": self.repelling, "saddle": self.saddle}
        inside = {name: reduce_under(condition, self.domain) for name, condition in kinds.items()}
        cases = [(sp.Symbol(name), condition) for name, condition in inside.items() if condition != sp.false]
        return cases[0][0].name if len(cases) == 1 else sp.Piecewise(*cases)  # the only one, wherever it exists

    @cached_property
    def domain(self) -> sp.Basic:
        """The condition on the states under which the mode holds on the manifold, at mu = 0; False if nowhere."""
        states, parts = list(self.dynamics.slow), sp.And.make_args(replaced(self.dynamics.where, self.branch))
        return reduce_under(sp.And(*(_located(part, states, self.assumptions) for part in parts)), self.assumptions)

    def at(self, **values: Any) -> Self:
        """Return the manifold at values of parameters, given by name as exact numbers or strings: ``at(sigma="1/2")``.

        Raises ``NotNormallyHyperbolic`` where the manifold does not exist, ``InputError`` for values outside the
        assumptions, floats and unknown names.
        """
        values = by_symbol(values, self._parameters(), "this manifold")
        given = {symbol: as_exact(value, symbol) for symbol, value in values.items()}
        if self.assumptions.subs(given) == sp.false:
            raise InputError(f"{equations(given)} is outside the range of this system, {self.assumptions}")
        mode = replace(
            self.dynamics,
            where=self.dynamics.where.subs(given),
            slow=_put(self.dynamics.slow, given),
            fast=_put(self.dynamics.fast, given),
        )
        branch, assumptions = _put(self.branch, given), self.assumptions.subs(given)
        found = replace(self, dynamics=mode, branch=branch, assumptions=assumptions)
        if found.exists == sp.false:
            raise NotNormallyHyperbolic(
                f"{found.degeneracy(self.branch)} ({equations(given)}); "
                f"{self.name} exists only for {_text(self.exists)}"
            )
        return found

    def _card(self) -> Card:
        graph = self._graph()
        implicit = is_implicit(self.branch)
        rows = [("0", limit_of(g, self.small)) for g in self.dynamics.fast.values() if implicit]
        rows += [(f"{y} at {self.small}" if implicit else str(y), h) for y, h in graph.items() if h != y]
        rows += [("where", self.domain), ("exists for", self.exists), ("stability", self._kind())]
        return Card(f"{type(self).__name__} {self.name} of mode {self.mode}", tuple(rows))

    def _graph(self) -> dict[sp.Symbol, sp.Expr]:
        """Return the fast states on the manifold."""
        return dict(self.branch)

    def _kind(self) -> Any:
        try:
            return self.stability
        except NotNormallyHyperbolic as reason:
            return str(reason)

    def degeneracy(self, branch: sp.Dict) -> str:
        """Return, in words, why the manifold ``branch`` is not normally hyperbolic, or not real, or not finite."""
        if not is_implicit(branch) and (free := _free(branch)):
            return free
        if self._finite == sp.false:
            why = "a denominator vanishes"
        elif self.real == sp.false:
            why = "a state has not the sign it is declared to have, or a root or a logarithm is of a negative number"
        elif any(p[-1] == 0 for p in self.characteristic):
            why = f"{determinant(self.branch)} vanishes"
        else:
            why = "dg/dy has eigenvalues with real part 0 (a centre)"
        return f"{why} on {branch_in_words(branch)}"

    def _parameters(self):
        parts = [*self.dynamics.slow.values(), *self.dynamics.fast.values(), self.dynamics.where, self.assumptions]
        return set().union(*(p.free_symbols for p in parts)) - {*self.dynamics.slow, *self.dynamics.fast, self.small}


@of_system
@lru_cache(maxsize=64)
def critical_manifolds(system: System) -> Several[CriticalManifold]:
    """Solve g = 0 for the fast variables in every mode.

    Manifolds of modes other than stick are named Pi1, Pi2, ... in order, those of stick Lambda1, ...; a manifold that
    lies nowhere in its mode has ``domain`` False. Where the rates of a mode switch by a state or the time, every side
    of the switch has its own manifolds, each with its domain. Where SymPy gives a root of g = 0 no readable formula in
    real numbers, as for a cubic, one manifold stands for all roots: ``branch[y]`` is y. Those roots of factors of g
    that have one come before it. Where g = 0 leaves a fast state y free on one manifold of several, ``branch[y]`` is y
    there, and ``exists`` is False. A fast state that stick holds is slow in this mode. Raises ``NotDerivable`` where a
    mode has too many sides, ``NotNormallyHyperbolic`` where g = 0 leaves fast states free on all manifolds of a mode,
    ``InputError`` where rates are singular at mu = 0.
    """
    found: list[CriticalManifold] = []
    count: dict[str, int] = {}
    modes = (with_held_slow(system.autonomous(m), system.small) for m in system.modes)
    for mode in (part for m in modes if m.fast for part in _smooth_parts(m, system.assumptions)):
        require_short(mode)
        require_series(mode, system.small)
        letter = "Lambda" if mode.name == "stick" else "Pi"
        for branch in _branches(mode, system.small):
            count[letter] = count.get(letter, 0) + 1
            name = f"{letter}{count[letter]}"
            found.append(CriticalManifold(name, mode, system.small, branch, system.assumptions))
    return Several(found)


def with_held_slow(mode: Mode, small: sp.Symbol) -> Mode:
    """Return a mode in which fast states are slow that stick keeps from moving fast: velocities, also on belts."""
    held = [y for y, g in mode.fast.items() if "stick" in mode.name.split("+") and limit_of(g, small) == 0]
    rates = {y: sp.expand(mode.fast[y] / small) for y in held}
    left = {y: g for y, g in mode.fast.items() if y not in held}
    return replace(mode, slow=sp.Dict({**mode.slow, **rates}), fast=sp.Dict(left)) if held else mode


def _smooth_parts(mode: Mode, assumptions: sp.Basic, sides: Sides = ()) -> list[Mode]:
    """Return the smooth parts of a mode, one on each side of the switches in its rates by a state or the time."""
    if (beyond := conjunction(list(sides), assumptions)) == sp.false:
        return []
    states, signs = (*mode.slow, *mode.fast), {sp.Dummy(real=True): quantity for quantity in mode.signed}
    slow, fast = (sp.Dict({s: on_sides(r, sides) for s, r in rates.items()}) for rates in (mode.slow, mode.fast))
    rates = [*slow.values(), *fast.values()]
    if not any(is_switched(rate, states) for part in (slow, fast) for rate in one_side(part, signs).values()):
        where = sp.And(on_sides(mode.where, sides), beyond)
        return [] if where == sp.false else [replace(mode, slow=slow, fast=fast, where=where)]
    opened = sorted(phases(rates, states), key=lambda phase: phase in mode.signed)
    if not opened or len(sides) == MOST_SIDES or is_whole(opened[0]):
        raise NotDerivable(f"mode {mode.name!r} has too many switches to treat all their sides; write one side of them")
    return [part for sign in (1, -1) for part in _smooth_parts(mode, assumptions, (*sides, (opened[0], sign)))]


def checked_branch(branch: Any, mode: Mode, small: sp.Symbol) -> sp.Dict:
    """Return ``branch`` as a ``Dict`` after checking that it gives every fast variable and solves g = 0."""
    if not isinstance(branch, dict | sp.Dict):
        raise InputError(f"branch = {short(branch)} is not a dict {{fast variable: expression in the slow variables}}")
    branch = sp.Dict({y: expression(f"branch {y}", h) for y, h in branch.items()})
    _same_symbols(branch, mode)
    if {*branch} != {*mode.fast}:
        fast = in_words(mode.fast)
        raise InputError(f"branch gives {in_words(branch)}; the fast variables of {mode.name!r} are {fast}")
    for y, h in branch.items():
        if inside := h.free_symbols & {*mode.fast, small}:
            raise InputError(f"branch {y} = {h} contains {in_words(inside)}; give it in the slow variables alone")
    for y, g in mode.fast.items():
        residual = limit_of(g, small).subs(branch, simultaneous=True)
        if not is_zero(residual):
            raise BranchError(
                f"{equations(branch)} does not solve the critical equation of {mode.name!r}: "
                f"there {small} {y}' = {sp.factor(residual)}, not 0"
            )
    return branch


def _same_symbols(branch, mode):
    rates = [*mode.slow.values(), *mode.fast.values()]
    known = {s.name: s for s in {*mode.slow, *mode.fast}.union(*(r.free_symbols for r in rates))}
    for s in {*branch}.union(*(h.free_symbols for h in branch.values())):
        if known.get(s.name, s) != s:
            raise InputError(f"the branch's {s} and the system's {s} differ in their assumptions; use one Symbol")


def equations(values: Mapping) -> str:
    return ", ".join(f"{symbol} = {short(value)}" for symbol, value in values.items())


def branch_in_words(branch: sp.Dict) -> str:
    """Return the equations of a branch, y = h_0, or g = 0 of an implicit one."""
    return "g = 0" if is_implicit(branch) else equations(branch)


def determinant(branch: Any) -> str:
    return "det dg/dy" if len(branch) > 1 else f"dg/d{next(iter(branch))}"


def _located(part, states, assumptions):
    """Reduce one inequality on the manifold to the cases of signs of its factor in the parameters and of the rest."""
    if not isinstance(part, (sp.StrictGreaterThan, sp.StrictLessThan)):
        return part
    if len((difference := part.gts - part.lts).atoms(sp.Function)) > MOST:
        return part
    parameters, rest = sp.factor(difference).as_independent(*states, as_Add=False)
    cases = (conjunction([(parameters, sign), (rest, sign)], assumptions) for sign in (1, -1))
    return sp.Or(*cases)


def _branches(mode, small):
    equal_zero = [limit_of(g, small) for g in mode.fast.values()]
    solutions = solutions_of(equal_zero, list(mode.fast))
    if solutions is None or any(map(is_unreadable, heights(solutions))):
        return _by_value(mode, small, equal_zero)
    solutions = [{y: y for y in mode.fast} | s for s in solutions]  # a state that g = 0 leaves free stands for itself
    if solutions and all(map(_free, solutions)):
        raise NotNormallyHyperbolic(f"mode {mode.name!r}: {_free(solutions[0])}: a function of the fast states changes "
                                    "slowly; make it a slow state")  # fmt: skip
    complete = [s for s in solutions if not any(map(is_complex, s.values()))]
    if any(h.has(sp.I) for h in heights(complete)):
        return _by_value(mode, small, equal_zero)
    told = all(g.is_rational_function(*mode.fast) for g in equal_zero)  # SymPy finds false roots of exponentials
    complete = [form for s in complete for form in real_forms(s)
                if (told and form is s) or all(is_zero_somewhere(g.subs(form, simultaneous=True)) for g in equal_zero)]
    return [sp.Dict({y: by_powers(h, tuple(mode.slow)) for y, h in s.items()}) for s in complete]


def _by_value(mode, small, equal_zero):
    """Return the closed branches of factors of g, a polynomial of one fast state, and the implicit one of the others.

    Without such factors the implicit branch stands alone.
    """
    implicit, factors = sp.Dict({y: y for y in mode.fast}), []
    if len(equal_zero) == 1 and equal_zero[0].is_polynomial(*mode.fast):
        factors = [factor for factor, _ in sp.factor_list(equal_zero[0], *mode.fast)[1]]
    parts = [replace(mode, fast=sp.Dict(dict.fromkeys(mode.fast, factor))) for factor in factors if len(factors) > 1]
    branches = [branch for part in parts for branch in _branches(part, small)] if parts else [implicit]
    return [*(branch for branch in branches if branch != implicit), *[implicit] * (implicit in branches)]


def _free(branch):
    """Return words on the fast states that g = 0 leaves free on a branch, or "" where there are none."""
    found = {y: h for y, h in branch.items() if y != h}
    left = in_words(y for y in branch if y not in found)
    return f"g = 0 for all {left}{' on ' * bool(found)}{equations(found)}" if len(found) < len(branch) else ""


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
    outer = _outermost(g, branch)
    outer = {f for f in outer if not (isinstance(f, sp.exp) and f.exp.could_extract_minus_sign() and 1 / f in outer)}
    roots = outer & fractional_powers(*outer)
    if roots == outer and not is_implicit(branch) and (values := _values_of_roots(g, roots, branch)):
        yield from values
        return
    for base in {p.base for p in roots}:
        if len(outer) > 1:
            yield base.subs(branch, simultaneous=True)
        yield from _root_within_range(g, base, {p for p in roots if p.base == base}, branch)
    for f in outer - roots if not is_implicit(branch) else ():
        yield from _inverse_within_range(g, f, branch)


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
    numerator, _ = sp.fraction(sp.together(told := g.xreplace({p: root ** (q * p.exp) for p in powers})))
    for (k,), c in sp.Poly(numerator, root).terms() if numerator.is_polynomial(root) else ():
        parts[k % q] = parts.get(k % q, 0) + c * base ** (k // q)
    own, *values = (e.subs(branch, simultaneous=True) for e in (base, *(parts[k] for k in sorted(parts))))
    if len(values) != 2 or is_zero_somewhere(values[1]):
        yield own
        yield from _values(told.xreplace({base: root**q}), root, root**q - own, branch)
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
                    for p in powers if p.base == base})  # fmt: skip
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
    told = g.xreplace({e: w**power for e, power in others.items() if power.is_Integer})
    slope, nested = told.diff(w), bool(_outermost(inside, branch))
    if not slope.has(w) and is_zero_somewhere(slope.subs(branch, simultaneous=True)):
        return
    if not slope.has(w):
        values = [sp.factor((-told.subs(w, 0) / slope).subs(branch, simultaneous=True))]
    elif nested or (type(f) in _RANGE and not _has_whole_slopes(f, branch)):
        values = _values(told, w, _INVERSE[type(f)](w) - inside.subs(branch, simultaneous=True), branch)
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
    if is_implicit(branch) or heavy(told := g.subs(branch, simultaneous=True)) or is_zero(told):
        return []
    values = [s[w] for s in solutions_of([told], [w]) or () if w in s]
    found = [value for value in values if is_zero_somewhere(meaning.subs(w, value))]
    return found if len(found) == 1 else []


def _text(condition):
    parts = sp.And.make_args(condition)
    return " and ".join(f"{p.lhs} != {p.rhs}" if isinstance(p, sp.Ne) else str(p) for p in parts)


def _put(rates, given):
    return sp.Dict({symbol: rate.subs(given) for symbol, rate in rates.items()})
