r"""Critical manifolds g(x, y, 0) = 0 of every mode: where they lie, and whether they attract.

A branch y = h_0(x) is normally hyperbolic where no eigenvalue of dg/dy on it has real part 0. The signs of the real
parts, found by Hurwitz determinants, separate attracting from repelling directions. ``critical_manifolds`` solves g = 0
for all branches; ``solutions_of`` is the hard function. ``CriticalManifold`` states the conditions on one branch.
Where a root has no readable formula in real numbers, one implicit manifold, ``{y: y}``, stands for all of its mode.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import product
from typing import Any, Self

import sympy as sp
from sympy.functions.elementary.trigonometric import TrigonometricFunction
from sympy.simplify.fu import TR8

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
from asympk.symbolic.forces import entries_named
from asympk.symbolic.hurwitz import Spectra, attracting, off_axis, repelling, spectra, split
from asympk.symbolic.long import generic_place, heavy, replaced
from asympk.symbolic.reading import expression
from asympk.symbolic.sides import Sides, is_switched, measured, on_sides, phases
from asympk.symbolic.signs import conjunction, factored, nonzero
from asympk.symbolic.system import Mode, System, of_system
from asympk.symbolic.values import as_exact, by_symbol, in_words

MOST_SIDES = 8  # switches in the rates of one mode; each doubles the number of its smooth parts
MOST = 8  # functions, such as sines, in an expression that is factored: with more, factoring may not end
_POSITIVE: dict[type, Callable] = {
    sp.log: lambda z: z, sp.acosh: lambda z: z - 1, **dict.fromkeys((sp.asin, sp.acos, sp.atanh), lambda z: 1 - z**2),
    sp.LambertW: lambda z: z + sp.exp(-1), sp.erfinv: lambda z: 1 - z**2, sp.erfcinv: lambda z: z * (2 - z),
}  # fmt: skip
_RANGE: dict[type, Callable] = {  # what is positive inside the range of a function
    **dict.fromkeys((sp.asin, sp.atan), lambda w: sp.pi**2 / 4 - w**2), sp.acos: lambda w: w * (sp.pi - w),
    sp.acosh: lambda w: w, sp.LambertW: lambda w: w + 1,
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
        those in g, lie inside the domains of these. Where g contains one square root, it is positive on the branch:
        y = x**2 solves x - sqrt(y) = 0 for x > 0 alone. So does one inverse function have a value in its range:
        y = tan(x) solves x - atan(y) = 0 for |x| < pi/2. A state that is declared positive or negative is so on the
        branch.
        """
        if any(map(_is_complex, (*self.branch.values(), *self.jacobian))):
            return sp.false
        found = sp.Tuple(*self.branch.values())
        roots = _fractional_powers(found)
        inside = {_POSITIVE[type(f)](f.args[0]) for f in found.atoms(*_POSITIVE)} | {p.base for p in roots}
        inside |= {-f.args[0] for f in found.atoms(sp.LambertW) if len(f.args) == 2}
        limits = [limit_of(g, self.small) for g in self.dynamics.fast.values()]
        inside |= {_POSITIVE[type(f)](f.args[0]).subs(self.branch, simultaneous=True) for g in limits
                   for f in g.atoms(*_POSITIVE) if f.has(*self.branch)}  # fmt: skip
        inside |= {given(g, self.branch) for g in limits for given in (_square_root, _within_range)} - {None}
        inside |= {declared_sign(y) * h for y, h in self.branch.items() if y != h} - {0}
        names = {p: sp.Dummy(positive=True) for p in roots}
        positive = {sp.Gt(expr.xreplace(names), 0).xreplace({v: p for p, v in names.items()}) for expr in inside}
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

    @property
    def _finite(self):
        """The condition under which branch and dg/dy are finite; ``real`` covers roots in denominators."""
        if sp.Tuple(*self.branch.values(), *self.jacobian).has(sp.zoo, sp.nan):
            return sp.false
        if not fast_jacobian(self.dynamics, self.small).has(*self.branch):  # only det dg/dy divides
            return sp.true
        below = (sp.fraction(sp.together(h))[1] for h in self.branch.values())
        factors = (factor for expr in below for factor, _ in factored(expr)[1] if not _fractional_powers(factor))
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
    if not opened or len(sides) == MOST_SIDES or measured(opened[0]) != opened[0]:
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
    complete = [s for s in solutions if not any(map(_is_complex, s.values()))]
    if any(h.has(sp.I) for h in heights(complete)):
        return _by_value(mode, small, equal_zero)
    told = all(g.is_rational_function(*mode.fast) for g in equal_zero)  # SymPy finds false roots of exponentials
    complete = [form for s in complete for form in _real_forms(s)
                if (told and form is s) or all(is_zero_somewhere(g.subs(form, simultaneous=True)) for g in equal_zero)]
    return [sp.Dict({y: by_powers(h, tuple(mode.slow)) for y, h in s.items()}) for s in complete]


def _by_value(mode, small, equal_zero):
    """Return the implicit branch, and before it the closed ones of factors of g, a polynomial of one fast state."""
    factors = []
    if len(equal_zero) == 1 and equal_zero[0].is_polynomial(*mode.fast):
        factors = [factor for factor, _ in sp.factor_list(equal_zero[0], *mode.fast)[1]]
    parts = [replace(mode, fast=sp.Dict(dict.fromkeys(mode.fast, factor))) for factor in factors if len(factors) > 1]
    branches = (branch for part in parts for branch in _branches(part, small))
    return [*(branch for branch in branches if not is_implicit(branch)), sp.Dict({y: y for y in mode.fast})]


def heights(solutions: list[dict[sp.Symbol, sp.Expr]]) -> Iterator[sp.Expr]:
    """Yield the value of every unknown in every solution."""
    return (h for s in solutions for h in s.values())


def _free(branch):
    """Return words on the fast states that g = 0 leaves free on a branch, or "" where there are none."""
    found = {y: h for y, h in branch.items() if y != h}
    left = in_words(y for y in branch if y not in found)
    return f"g = 0 for all {left}{' on ' * bool(found)}{equations(found)}" if len(found) < len(branch) else ""


def _real_forms(solution):
    """Return a solution, and what SymPy leaves out: the lower real branch of Lambert's W, and odd roots below 0."""
    upper = {w for h in solution.values() for w in h.atoms(sp.LambertW) if len(w.args) == 1}
    roots = {p for p in _fractional_powers(*solution.values()) if p.exp.q % 2}
    lower = {} if any(w.args[0].is_nonnegative for w in upper) else {w: sp.LambertW(w.args[0], -1) for w in upper}
    below = {p: (-1) ** p.exp.p * (-p.base) ** p.exp for p in roots if not p.base.is_nonnegative}
    forms = [solution]
    for rule in filter(None, (lower, below)):
        forms += [{y: h.xreplace(rule) for y, h in form.items()} for form in forms]
    return forms


def _fractional_powers(*heights):
    powers = sp.Tuple(*heights).atoms(sp.Pow)
    return {p for p in powers if p.exp.is_Rational and not p.exp.is_Integer}


def _square_root(g, branch):
    """Return a multiple of the square root in g where g = 0, by a positive factor and on a branch, or None.

    The root of one expression P(y) is meant, and g = 0 is linear in it: a + b sqrt(P) = 0 as P = sqrt(P)**2. Where a
    and b vanish on the branch, P is returned.
    """
    roots = {p for p in _fractional_powers(g) if p.base.has(*branch)}
    if heavy(g) or len({p.base for p in roots}) != 1 or any(p.exp.q != 2 for p in roots):
        return None
    root, (base, *_) = sp.Dummy(positive=True), (p.base for p in roots)
    numerator, _ = sp.fraction(sp.together(g.xreplace({p: root ** (2 * p.exp) for p in roots})))
    if not numerator.is_polynomial(root):
        return None
    terms = sp.Poly(numerator, root).terms()
    rest, factor = (sp.Add(*(c * base ** (k // 2) for (k,), c in terms if k % 2 == odd)) for odd in (0, 1))
    told, own = (e.subs(branch, simultaneous=True) for e in (-rest * factor, base))
    return own if is_zero(factor.subs(branch, simultaneous=True)) else sp.factor(told)


def _within_range(g, branch):
    """Return what is positive where g = 0, linear in one inverse function of y, is solved inside its range, or None."""
    found = {f for f in g.atoms(*_RANGE) if f.has(*branch) and len(f.args) == 1}
    if heavy(g) or is_implicit(branch) or len(found) != 1:
        return None
    (f,), value = found, sp.Dummy()
    told = g.xreplace({f: value})
    slope = told.diff(value)
    if slope.has(value) or is_zero(slope.subs(branch, simultaneous=True)):
        return None
    return _RANGE[type(f)](sp.factor((-told.subs(value, 0) / slope).subs(branch, simultaneous=True)))


def is_unreadable(h: sp.Expr) -> bool:
    """Tell whether a formula has cases, an odd root of a root, as Cardano's, or a root of a modulus or of -1."""
    return h.has(sp.Piecewise) or any(
        p.base.has(sp.Abs) or p.base == -1 or (p.exp.q % 2 and _fractional_powers(p.base))
        for p in _fractional_powers(h)
    )


def _is_complex(h):
    """Tell whether an expression in real symbols has no real value where its even roots are real."""
    lower = {w for w in h.atoms(sp.LambertW) if len(w.args) == 2}  # SymPy takes its real values to be complex
    h = h.xreplace({s: sp.Dummy(real=True) for s in h.free_symbols | lower if s in lower or s.is_real is None})
    told, bases = dict[sp.Expr, sp.Expr](), dict[sp.Expr, sp.Expr]()
    for p in (p for p in _fractional_powers(h) if p.free_symbols):
        if not p.exp.q % 2:
            told[p] = sp.Dummy(positive=True)
        else:
            told[p] = bases.setdefault(p.base, sp.Dummy(real=True, nonzero=True)) ** (p.exp * p.exp.q)
    h = h.xreplace(told)
    if bases and any(part.is_imaginary for part in h.atoms(sp.Pow, type(sp.I))):
        inside = (f.args[0] for f in h.atoms(sp.log, sp.LambertW))
        return any(sp.expand_complex(part).as_real_imag()[1].is_nonzero for part in (*inside, h))
    return h.is_real is False


def solutions_of(equal_zero: list[sp.Expr], unknowns: list[sp.Symbol]) -> list[dict[sp.Symbol, sp.Expr]] | None:
    """Return the solutions that SymPy finds, or None where SymPy fails, would leave out roots or has no short ones."""
    if {*equal_zero} == {0}:
        return [{}]
    if heavy(sp.Tuple(*equal_zero)):
        matrix = (force := sp.Matrix(equal_zero)).jacobian(unknowns)
        if not matrix.has(*unknowns):
            return _linear_solution(matrix, force.subs(dict.fromkeys(unknowns, 0)), unknowns)
    if len(unknowns) == 1:
        if own := _by_lambert(*equal_zero, *unknowns) or _by_logarithm(*equal_zero, *unknowns):
            return own
        equal_zero = [_in_fewer_waves(*equal_zero, *unknowns)]
        if _mixes(*equal_zero, *unknowns):
            return None
    if len(unknowns) > 1 and (factors := [_factors(g, unknowns) for g in equal_zero]) != [[g] for g in equal_zero]:
        return _joined([solutions_of([*choice], unknowns) for choice in product(*factors)])
    if len(unknowns) > 1 and (given := _given_by_others(equal_zero, unknowns)):
        return _without(given, equal_zero, unknowns)
    turning = _in_half_angle(*equal_zero, *unknowns) if len(unknowns) == 1 else None
    eliminants = [turning[:2]] if turning else _eliminants(equal_zero, unknowns)
    if any(_is_beyond_radicals(force, y, len(unknowns)) for force, y in eliminants):
        return None
    own = len(unknowns) > 1 or not equal_zero[0].is_rational_function(*unknowns)
    try:
        found = sp.solve(equal_zero, unknowns, dict=True, check=not own)
    except NotImplementedError:
        found = None
    found = found and [s for s in found if not own or _solves(s, equal_zero)]
    return _in_a_turn(found or [], *turning, *equal_zero, *unknowns) if turning else found


def _waves(force, y):
    """Return the trigonometric functions of y in an expression."""
    return {f for f in force.atoms(TrigonometricFunction) if f.has(y)}


def _in_fewer_waves(force, y):
    """Return g with sines and cosines of multiples of y for products of them, where these are fewer, else g."""
    if heavy(force) or len(waves := _waves(force, y)) < 2:
        return force
    told = TR8(force)
    return told if len(_waves(told, y)) < len(waves) else force


def _mixes(force, y):
    """Tell whether a factor of g, a polynomial in y and in waves of y, has both: SymPy seeks roots long, in vain."""
    told = force.xreplace({wave: sp.Dummy() for wave in _waves(force, y)})
    waves = told.free_symbols - force.free_symbols
    if heavy(force) or not waves or not told.is_polynomial(y, *waves):
        return False
    return any(factor.has(y) and factor.has(*waves) for factor, _ in sp.factor_list(told, y, *waves)[1])


def _in_half_angle(force, y):
    """Return (numerator of g in t, t, q), t = tan(q y/2), where g is rational in sines and cosines of q y, else None.

    The period of g is 2 pi/q; with tangents alone they are those of q y/2.
    """
    waves = _waves(force, y)
    slopes = [f.args[0].diff(y) * (1 + isinstance(f, sp.tan | sp.cot)) for f in waves]
    if heavy(force) or not slopes or not all((slope / slopes[0]).is_Rational for slope in slopes):
        return None
    q = slopes[0] * sp.gcd_list([slope / slopes[0] for slope in slopes])
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
    different = [s for k, s in enumerate(found)
                 if not any(sp.expand((s[y] - r[y]) * q / (2 * sp.pi)).is_integer for r in found[:k])]  # fmt: skip
    roots = [{y: 2 * sp.atan(h) / q} for s in solutions_of([numerator], [t]) or () for h in s.values()]
    roots += [{y: sp.pi / q}] * is_zero(force.subs(y, sp.pi / q))
    return max(different, roots, key=len)


def _solves(solution, equal_zero):
    """Tell whether g = 0, in numbers, and every unknown may be as it is declared.

    SymPy's own check may take long, or not end; roots of one rational g alone need it, as SymPy shortens them then.
    """
    declared = (sp.check_assumptions(h, **y.assumptions0) is not False for y, h in solution.items())
    return all(declared) and all(is_zero_somewhere(g.subs(solution, simultaneous=True)) for g in equal_zero)


def _factors(force, unknowns):
    """Return the factors of g that may vanish, where g is a product of polynomials in the unknowns, else [g].

    With products SymPy may not end. A positive state does not vanish.
    """
    if heavy(force) or not force.is_polynomial(*unknowns):
        return [force]
    found = sp.factor_list(force, *unknowns)[1]
    return [factor for factor, _ in found if not factor.is_nonzero] if len(found) > 1 else [force]


def _joined(parts):
    """Return all different solutions but the cases of one that leaves states free, or None where a part has None."""
    if None in parts:
        return None
    found = [s for part in parts for s in part]
    free = [r for r in found if len(r) < max(map(len, found))]
    return [s for k, s in enumerate(found) if s not in found[:k] and not any(_is_case(s, r) for r in free)]


def _is_case(solution, other):
    """Tell whether a solution with more given states is a case of another one."""
    return len(other) < len(solution) and all(is_zero((y - h).subs(solution)) for y, h in other.items())


def _by_lambert(force, y):
    """Return [root] of a + b y + c e^(p + q y), or of its product with an exponential, else None.

    SymPy takes roots of the order of b/c here, which may not end.
    """
    exponentials = [e for e in force.atoms(sp.exp) if e.has(y)]
    if len(exponentials) != 1 or not exponentials[0].exp.is_polynomial(y):
        return None
    power = sp.Dummy()
    told, exponent = sp.expand(force.xreplace({exponentials[0]: power})), sp.Poly(exponentials[0].exp, y)
    if not told.is_polynomial(y, power) or exponent.degree() != 1:
        return None
    terms = dict(sp.Poly(told, y, power).terms())
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


def _given_by_others(equal_zero, unknowns):
    """Return (equation, unknown y, y in terms of the others) for a y with a constant rational coefficient, else None.

    A y without others is preferred: its formula has no root of the others' equations. SymPy takes minutes to solve
    cubics together with such an equation. Linear systems need no such help: None.
    """
    if not sp.Matrix(equal_zero).jacobian(unknowns).has(*unknowns):
        return None
    slopes = ((g, y, g.diff(y)) for g in equal_zero for y in unknowns)
    found = ((g, y, -g.subs(y, 0) / slope) for g, y, slope in slopes if slope.is_Rational and slope)
    return min(found, key=lambda given: given[2].has(*unknowns), default=None)


def _without(given, equal_zero, unknowns):
    """Return the solutions of the equations other than that which gives y = own, each completed by y."""
    force, y, own = given
    left = [g.subs(y, own) for g in equal_zero if g is not force]
    solutions = solutions_of(left, [other for other in unknowns if other != y])
    return solutions and [{**s, y: sp.expand(own.subs(s))} for s in solutions]


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
            if basis.is_zero_dimensional]  # fmt: skip


def _is_beyond_radicals(force, y, unknowns):
    """Tell whether a polynomial g, of y or a root of y, has a factor of degree above 2 without readable roots.

    SymPy takes an odd root of what is negative for complex, and leaves it out. With several unknowns SymPy may take
    minutes to join such roots, readable or not.
    """
    numerator = sp.fraction(sp.together(force))[0]
    if powers := {p for p in _fractional_powers(numerator) if p.base == y}:
        q, w = sp.ilcm(1, *(p.exp.q for p in powers)), sp.Dummy(real=True)
        numerator, y = numerator.xreplace({p: w ** (q * p.exp) for p in powers}).subs(y, w**q), w
    if not numerator.is_polynomial(y):
        return False
    factors = (f for f, _ in sp.factor_list(numerator, y)[1] if sp.degree(f, y) > 2)
    return any(unknowns > 1 or sum(found.values()) < sp.degree(f, y)
               or any(is_unreadable(root) or (root.is_real is False and not _is_complex(root)) for root in found)
               for f in factors for found in [sp.roots(f, y)])  # fmt: skip


def _text(condition):
    parts = sp.And.make_args(condition)
    return " and ".join(f"{p.lhs} != {p.rhs}" if isinstance(p, sp.Ne) else str(p) for p in parts)


def _put(rates, given):
    return sp.Dict({symbol: rate.subs(given) for symbol, rate in rates.items()})
