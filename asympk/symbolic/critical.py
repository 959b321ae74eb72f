r"""Critical manifolds g(x, y, 0) = 0 of every mode: where they lie, and whether they attract.

A branch y = h_0(x) is normally hyperbolic where no eigenvalue of dg/dy on it has real part 0. The signs of the real
parts, found by Hurwitz determinants, separate attracting from repelling directions. ``critical_manifolds`` solves g = 0
for all branches, by ``roots``. ``CriticalManifold`` states the conditions on one branch. Where a root has no readable
formula in real numbers, one implicit manifold, ``{y: y}``, stands for all of its mode.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import product
from typing import Any, Self

import sympy as sp

from asympk.errors import BranchError, InputError, NotDerivable, NotNormallyHyperbolic
from asympk.formulas import NOT_FINITE, formula_in_words
from asympk.numbers import short
from asympk.shown import Card, Several, ShownAsFormulas
from asympk.symbolic import expansion, roots
from asympk.symbolic.conditions import declared_sign, reduce_under
from asympk.symbolic.domains import positive_on
from asympk.symbolic.expansion import by_powers, is_implicit, is_zero, limit_of, one_side, zero_at_places
from asympk.symbolic.hurwitz import Spectra, attracting, off_axis, repelling, spectra, split
from asympk.symbolic.long import atoms, entries_in_factors, factorises, in_factors, replaced, tidied, unnested
from asympk.symbolic.reading import real_expression
from asympk.symbolic.roots import factors_of, is_complex, is_zero_on, solutions_of
from asympk.symbolic.sides import Sides, is_switched, is_whole, on_sides, phases
from asympk.symbolic.signs import above, conjunction, factored, nonzero, with_known_lambert
from asympk.symbolic.substitutions import fractional_powers, whole_turn
from asympk.symbolic.system import Mode, System, of_system
from asympk.symbolic.values import as_exact, by_symbol, in_words

MOST_SIDES = 8  # switches in the rates of one mode; each doubles the number of its smooth parts
MOST = 8  # functions, such as sines, in an expression that is factored: with more, factoring may not end


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
        at = {**self.branch, **expansion.over_fast(self.dynamics, self.small, self.branch)}
        return entries_in_factors(expansion.jacobian_on_branch(self.dynamics, self.small).subs(at, simultaneous=True))

    @cached_property
    def characteristic(self) -> Spectra:
        """The polynomials whose product is det(nu - dg/dy) on the manifold, from the highest coefficient of each."""
        return tuple((*p[:-1], sp.S.Zero if self._vanishes(p[-1]) else p[-1]) for p in spectra(self.jacobian))

    def _vanishes(self, determinant):
        """Tell whether a determinant is 0 on all of the manifold, as dg/dy is where all roots of g are multiple."""
        if not is_implicit(self.branch):
            zero = iter(()) if determinant.is_rational_function() else zero_at_places([determinant], self._assumed)
            return next(zero, False) and all(zero)
        known = {f for f, _ in factored(determinant)[1]}
        forces = (limit_of(g, self.small) for g in self.dynamics.fast.values())
        vanishing = ({f for f, _ in factored(g)[1] if nonzero(f, self.assumptions) != sp.true} for g in forces)
        return any(factors and factors <= known for factors in vanishing)

    @cached_property
    def real(self) -> sp.Basic:
        """The condition under which the branch is real, without its ends: even roots and logs have positive arguments.

        Roots and inverse functions, also those in g, have values in their ranges: y = x**2 solves x - sqrt(y) = 0 for
        x > 0 alone. A state that is declared positive or negative is so on the branch.
        """
        inside = self._inside
        if self._has_no_value or any(map(is_complex, (*self.branch.values(), *self.jacobian))):
            return sp.false
        if any(expr.has(sp.I) or with_known_lambert(expr).is_extended_real is False for expr in inside):
            return sp.false
        roots = fractional_powers(*self.branch.values())
        roots |= {p for p in fractional_powers(*inside) if p.base in inside}
        names = {p: sp.Dummy(positive=True) for p in roots}
        conditions = {expr: above(expr.xreplace(names)) for expr in inside}
        positive = {known if known in (sp.true, sp.false) else above(expr) for expr, known in conditions.items()}
        return sp.And(*(_located(relation, list(self.dynamics.slow), self.assumptions) for relation in positive))

    @cached_property
    def _inside(self):
        """What is positive where the branch is real, of its roots, logarithms and inverse functions, and those in g."""
        return positive_on(self.branch, [limit_of(g, self.small) for g in self.dynamics.fast.values()])

    @property
    def _has_no_value(self):
        return any(expr.is_negative for expr in self._inside)

    @property
    def _assumed(self):
        return sp.And(self.assumptions, self.real)

    @cached_property
    def exists(self) -> sp.Basic:
        """The condition under which the branch is real and finite, and no eigenvalue of dg/dy has real part 0."""
        if self._has_no_value or self._finite == sp.false:
            return sp.false
        return sp.And(off_axis(self.characteristic, self._assumed), self.real, self._finite)

    @cached_property
    def _finite(self):
        """The condition under which branch and dg/dy are finite; ``real`` covers roots in denominators."""
        if sp.Tuple(*self.branch.values(), *self.jacobian).has(*NOT_FINITE):
            return sp.false
        if not expansion.fast_jacobian(self.dynamics, self.small).has(*self.branch):  # only det dg/dy divides
            return sp.true
        below = (sp.fraction(sp.together(h))[1] for h in self.branch.values())
        factors = (factor for expr in below for factor, _ in factored(expr)[1] if not fractional_powers(factor))
        return sp.And(*(nonzero(factor, self._assumed) for factor in factors))

    @cached_property
    def attracting(self) -> sp.Basic:
        """The condition under which every eigenvalue of dg/dy has a negative real part."""
        return self._of_kind(attracting)

    @cached_property
    def repelling(self) -> sp.Basic:
        """The condition under which every eigenvalue of dg/dy has a positive real part."""
        return self._of_kind(repelling)

    @cached_property
    def saddle(self) -> sp.Basic:
        """The condition under which dg/dy has eigenvalues on both sides of the imaginary axis and none on it."""
        return self._of_kind(split)

    def _of_kind(self, kind):
        return sp.false if self.exists == sp.false else kind(self.characteristic, self._assumed)

    @cached_property
    def folds(self) -> sp.Basic:
        """The condition under which the manifold folds or meets another manifold: det dg/dy = 0."""
        below = (sp.fraction(sp.together(p[-1]))[0] for p in self.characteristic)
        return sp.to_nnf(sp.Not(sp.And(*(nonzero(determinant, self.assumptions) for determinant in below))))

    @cached_property
    def stability(self) -> str:
        """``"stable"`` (all fast directions attract), ``"unstable"`` (all repel) or ``"saddle"`` (some of each).

        A ``Piecewise`` of these names, as symbols, where it depends on parameters or on the place in ``domain``. Raises
        ``NotNormallyHyperbolic`` where the manifold exists nowhere, as with an imaginary eigenvalue on all of it.
        """
        if self.exists == sp.false:
            raise NotNormallyHyperbolic(self.degeneracy(self.branch))
        kinds = {"stable": self.attracting, "unstable": self.repelling, "saddle": self.saddle}
        inside = {name: reduce_under(condition, self.domain) for name, condition in kinds.items()}
        cases = [(sp.Symbol(name), condition) for name, condition in inside.items() if condition != sp.false]
        if not cases:
            raise NotNormallyHyperbolic(f"{self.name} exists nowhere: {formula_in_words(self.exists)} never holds")
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
            raise InputError(f"{equations(given)} is outside the range of this system, "
                             f"{formula_in_words(self.assumptions)}")
        mode = replace(self.dynamics, where=self.dynamics.where.subs(given), slow=_put(self.dynamics.slow, given),
                       fast=_put(self.dynamics.fast, given))
        branch, assumptions = _put(self.branch, given), self.assumptions.subs(given)
        found = replace(self, dynamics=mode, branch=branch, assumptions=assumptions)
        if found.exists == sp.false:
            raise NotNormallyHyperbolic(f"{found.degeneracy(self.branch)} ({equations(given)}); "
                                        f"{self.name} exists only for {formula_in_words(self.exists)}")
        return found

    def _card(self) -> Card:
        implicit = is_implicit(self.branch)
        rows: list[tuple[str, Any]] = [("0", limit_of(g, self.small)) for g in self.dynamics.fast.values() if implicit]
        for y, terms in self._graph().items():
            if terms != [("", y)]:
                (_, first), *others = terms
                rows += [(f"{y} at {self.small}" if implicit else str(y), first), *others]
        rows += [("where", "everywhere" if self.domain == sp.true else self.domain)]
        rows += [("exists for", "all values" if self.exists == sp.true else self.exists), ("stability", self._kind())]
        return Card(f"{type(self).__name__} {self.name} of mode {self.mode}", tuple(rows))

    def _graph(self) -> dict[sp.Symbol, list[tuple[str, sp.Expr]]]:
        """Return the terms of each fast state on the manifold, with what stands before each but the first."""
        return {y: [("", h)] for y, h in self.branch.items()}

    def _kind(self) -> Any:
        try:
            return self.stability
        except NotNormallyHyperbolic as reason:
            return str(reason)

    def degeneracy(self, branch: sp.Dict) -> str:
        """Return, in words, why the manifold ``branch`` is not normally hyperbolic, or not real, or not finite."""
        if not is_implicit(branch) and (free := _free(branch)):
            return free
        if not self._has_no_value and self._finite == sp.false:
            why = "a denominator vanishes"
        elif self.real == sp.false:
            why = "a state has not the sign it is declared to have, or a root or a logarithm is of no positive number"
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
    of the switch has its own manifolds, each with its domain. Where SymPy leaves out a root of g = 0, or gives it no
    readable formula in real numbers, as for a cubic, one manifold stands for all roots: ``branch[y]`` is y. Those roots
    of factors of g that have one come before it; of a factor such as sin(y) they are those in one turn. Where g = 0
    leaves a fast state y free on one manifold of several, ``branch[y]`` is y there, and ``exists`` is False. A fast
    state that stick holds is slow in this mode. Raises ``NotDerivable`` where a mode has too many sides,
    ``NotNormallyHyperbolic`` where g = 0 leaves fast states free on all manifolds of a mode, ``InputError`` where rates
    are singular at mu = 0.
    """
    found: list[CriticalManifold] = []
    count: dict[str, int] = {}
    modes = (with_held_slow(for_formulas(system, m), system.small) for m in system.modes)
    for mode in (part for m in modes if m.fast for part in _smooth_parts(m, system.assumptions)):
        expansion.require_short(mode)
        expansion.require_factored(mode)
        expansion.require_series(mode, system.small)
        letter = "Lambda" if mode.name == "stick" else "Pi"
        for branch in _branches(mode, system.small):
            count[letter] = count.get(letter, 0) + 1
            name = f"{letter}{count[letter]}"
            found.append(CriticalManifold(name, mode, system.small, branch, system.assumptions))
    return Several(found)


def for_formulas(system: System, mode: Mode) -> Mode:
    """Return a mode with the time as a slow state, and without quotients in the divisors of its rates."""
    timed = system.autonomous(mode)
    slow, fast = (sp.Dict({s: unnested(r) for s, r in rates.items()}) for rates in (timed.slow, timed.fast))
    return replace(timed, slow=slow, fast=fast)


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
        steps = sorted({short(atom) for atom in atoms(sp.Tuple(*rates), sp.floor, sp.ceiling, sp.Mod)})
        among = f", those of {', '.join(steps)} among them" if steps else ""
        raise NotDerivable(f"mode {mode.name!r} has too many switches to treat all their sides{among}; write one side "
                           "of them")
    return [part for sign in (1, -1) for part in _smooth_parts(mode, assumptions, (*sides, (opened[0], sign)))]


def checked_branch(branch: Any, mode: Mode, small: sp.Symbol) -> sp.Dict:
    """Return ``branch`` as a ``Dict`` after checking that it gives every fast variable and solves g = 0."""
    if not isinstance(branch, dict | sp.Dict):
        raise InputError(f"branch = {short(branch)} is not a dict {{fast variable: expression in the slow variables}}")
    branch = sp.Dict({y: real_expression(f"branch {y}", h) for y, h in branch.items()})
    _same_symbols(branch, mode)
    if {*branch} != {*mode.fast}:
        fast = in_words(mode.fast)
        raise InputError(f"branch gives {in_words(branch)}; the fast variables of {mode.name!r} are {fast}")
    for y, h in branch.items():
        if inside := h.free_symbols & {*mode.fast, small}:
            raise InputError(f"branch {equations({y: h})} contains {in_words(inside)}; give it in the slow "
                             "variables alone")
    for y, g in mode.fast.items():
        residual = limit_of(g, small).subs(branch, simultaneous=True)
        if not is_zero(residual):
            raise BranchError(f"{equations(branch)} does not solve the critical equation of {mode.name!r}: "
                              f"there {small} {y}' = {short(tidied(residual))}, not 0")
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
    if len(atoms(difference := part.gts - part.lts, sp.Function)) > MOST or not factorises(difference):
        return part
    parameters, rest = in_factors(difference).as_independent(*states, as_Add=False)
    return sp.Or(*(conjunction([(parameters, sign), (rest, sign)], assumptions) for sign in (1, -1)))


def _branches(mode, small):
    equal_zero = [limit_of(g, small) for g in mode.fast.values()]
    solutions = solutions_of(equal_zero, list(mode.fast))
    if solutions is None or any(map(roots.is_unreadable, roots.heights(solutions))):
        return _by_value(mode, small, equal_zero)
    solutions = [{y: y for y in mode.fast} | s for s in solutions]  # a state that g = 0 leaves free stands for itself
    if solutions and all(map(_free, solutions)):
        raise NotNormallyHyperbolic(f"mode {mode.name!r}: {_free(solutions[0])}: a function of the fast states changes "
                                    "slowly; make it a slow state")
    complete = [s for s in solutions if not any(map(is_complex, s.values()))]
    if any(h.has(sp.I) for h in roots.heights(complete)):
        return _by_value(mode, small, equal_zero)
    rational = all(g.is_rational_function(*mode.fast) for g in equal_zero)  # SymPy finds false roots of exponentials
    complete = [form for s in complete for form in roots.real_forms(s)
                if (rational and form is s) or all(is_zero_on(g, form) for g in equal_zero)]
    branches = [sp.Dict({y: by_powers(h, tuple(mode.slow)) for y, h in s.items()}) for s in complete]
    return [*branches, _implicit(mode)] if _has_further_turns(mode, equal_zero) else branches


def _implicit(mode):
    return sp.Dict({y: y for y in mode.fast})


def _has_further_turns(mode, equal_zero):
    """Tell whether a factor of g has other branches in further turns of y: g has none, or some y are not in the mode.

    A y that is declared positive may have its roots in one turn in the next.
    """
    factors = (factor for g in equal_zero for factor in factors_of(g, mode.fast))
    turning = {y for factor in factors for y in mode.fast if whole_turn(factor, y) is not None}
    ending = any(mode.where.has(y) or declared_sign(y) for y in turning)
    return ending or any(g.has(y) and whole_turn(g, y) is None for g in equal_zero for y in turning)


def _by_value(mode, small, equal_zero):
    """Return the closed branches of factors of g, and the implicit one of the others, which may stand alone.

    The others are also the roots in all turns of a factor where g has no turn.
    """
    implicit = _implicit(mode)
    choices = [*product(*(factors_of(g, mode.fast) for g in equal_zero))]
    parts = (replace(mode, fast=sp.Dict(dict(zip(mode.fast, choice, strict=True)))) for choice in choices)
    alone = choices == [tuple(equal_zero)]
    found = [implicit] if alone else [branch for part in parts for branch in _branches(part, small)]
    closed = [b for b in dict.fromkeys(found) if b != implicit and all(is_zero_on(g, b) for g in equal_zero)]
    return [*closed, implicit] if implicit in found or _has_further_turns(mode, equal_zero) else closed


def _free(branch):
    """Return words on the fast states that g = 0 leaves free on a branch, or "" where there are none."""
    found = {y: h for y, h in branch.items() if y != h}
    left = in_words(y for y in branch if y not in found)
    return f"g = 0 for all {left}{' on ' if found else ''}{equations(found)}" if len(found) < len(branch) else ""


def _put(rates, given):
    return sp.Dict({symbol: rate.subs(given) for symbol, rate in rates.items()})
