r"""Critical manifolds g(x, y, 0) = 0 of every mode: where they live, and whether they attract.

A branch y = h_0(x) is normally hyperbolic where dg/dy is regular on it; the signs of the real parts of the
eigenvalues of dg/dy, here by the determinants of Hurwitz, tell attracting from repelling directions.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import sympy as sp

from asympk.errors import BranchError, InputError, NotDerivable, NotNormallyHyperbolic
from asympk.symbolic.conditions import reduce_under
from asympk.symbolic.expansion import by_powers, fast_jacobian, vanishes
from asympk.symbolic.reading import exact_value, expression
from asympk.symbolic.system import Mode


@dataclass(frozen=True)
class CriticalManifold:
    """The manifold ``y = branch[y]`` of one mode at mu = 0, under ``assumptions`` on the parameters."""

    name: str
    dynamics: Mode = field(repr=False)
    small: sp.Symbol = field(repr=False)
    branch: sp.Dict
    assumptions: sp.Basic = field(default=sp.true, repr=False)

    @property
    def mode(self):
        """The name of the mode."""
        return self.dynamics.name

    @cached_property
    def jacobian(self):
        """The matrix dg/dy on the manifold."""
        return fast_jacobian(self.dynamics, self.small).subs(self.branch, simultaneous=True).applyfunc(sp.factor)

    @cached_property
    def exists(self):
        """The condition under which the manifold is normally hyperbolic: det dg/dy != 0."""
        return nonzero(self.jacobian.det(), self.assumptions)

    @cached_property
    def stability(self):
        """``"stable"``, ``"unstable"`` (all fast directions attract, repel), ``"saddle"`` (neither), by sign of dg/dy.

        A ``Piecewise`` of these names, as symbols, where it depends on parameters or on the place. Raises
        ``NotNormallyHyperbolic`` where dg/dy is singular on the whole manifold.
        """
        matrix = self.jacobian
        if self.exists == sp.false:
            raise NotNormallyHyperbolic(f"{determinant(self.branch)} vanishes on {equations(self.branch)}")
        cases = {"stable": _hurwitz(matrix), "unstable": _hurwitz(-matrix), "saddle": []}
        if len(self.branch) == 1:
            del cases["saddle"]
        kinds = [(name, sp.And(*(positive(d, self.assumptions) for d in ds))) for name, ds in cases.items()]
        kinds = [(name, condition) for name, condition in kinds if condition != sp.false]
        if kinds and kinds[0][1] == sp.true:
            return kinds[0][0]
        return sp.Piecewise(*((sp.Symbol(name), condition) for name, condition in kinds))

    @cached_property
    def domain(self):
        """The condition on the states under which the mode holds on the manifold, at mu = 0; False if nowhere."""
        states = list(self.dynamics.slow)
        parts = sp.And.make_args(self.dynamics.where.subs(self.branch, simultaneous=True))
        return sp.And(*(_located(part, states, self.assumptions) for part in parts))

    def at(self, **values):
        """Put in values of parameters by name, exact numbers or strings: ``at(sigma="1/2")``.

        Raises ``NotNormallyHyperbolic`` where the manifold does not exist, ``InputError`` for values outside the
        assumptions, floats and unknown names.
        """
        given = _values(values, self._parameters())
        if self.assumptions.subs(given) == sp.false:
            raise InputError(f"{equations(given)} is outside the range of this system, {self.assumptions}")
        if self.exists.subs(given) == sp.false:
            raise NotNormallyHyperbolic(
                f"{determinant(self.branch)} vanishes on {equations(self.branch)} ({equations(given)}); "
                f"{self.name} exists only for {_text(self.exists)}"
            )
        put = {part: sp.Dict(_put(getattr(self.dynamics, part), given)) for part in ("slow", "fast")}
        mode = replace(self.dynamics, where=self.dynamics.where.subs(given), **put)
        branch = sp.Dict(_put(self.branch, given))
        return replace(self, dynamics=mode, branch=branch, assumptions=self.assumptions.subs(given))

    def _parameters(self):
        parts = [*self.dynamics.slow.values(), *self.dynamics.fast.values(), self.dynamics.where, self.assumptions]
        return set().union(*(p.free_symbols for p in parts)) - {*self.dynamics.slow, *self.dynamics.fast, self.small}


def critical_manifolds(system):
    """Solve g = 0 for the fast variables in every mode.

    Manifolds of slip and smooth modes are named Pi1, Pi2, ... in order, those of stick Lambda1, ...; one that
    lies nowhere in its mode has ``domain`` False. Raises ``NotDerivable`` when SymPy cannot solve g = 0.
    """
    found, count = [], {}
    for mode in system.modes:
        letter = "Lambda" if mode.name == "stick" else "Pi"
        for branch in _branches(mode, system.small):
            count[letter] = count.get(letter, 0) + 1
            name = f"{letter}{count[letter]}"
            found.append(CriticalManifold(name, mode, system.small, branch, system.assumptions))
    return tuple(found)


def checked_branch(branch, mode, small):
    """Return ``branch`` as a ``Dict`` after checking that it gives every fast variable and solves g = 0."""
    if not isinstance(branch, dict | sp.Dict):
        raise InputError(f"branch = {branch!r} is not a dict {{fast variable: expression in the slow variables}}")
    branch = sp.Dict({y: expression(f"branch {y}", h) for y, h in branch.items()})
    _same_symbols(branch, mode)
    if {*branch} != {*mode.fast}:
        raise InputError(f"branch gives {names(branch)}; the fast variables of {mode.name!r} are {names(mode.fast)}")
    for y, h in branch.items():
        if inside := h.free_symbols & {*mode.fast, small}:
            raise InputError(f"branch {y} = {h} contains {names(inside)}; give it in the slow variables alone")
    for y, g in mode.fast.items():
        residual = g.subs(small, 0).subs(branch, simultaneous=True)
        if not vanishes(residual):
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


def positive(expr, assumptions=sp.true):
    """Return the condition under which ``expr``, which is not 0, is positive; factors of known sign are left out.

    Symbols are taken as real, and so is ``expr``; a root of something is then positive.
    """
    if expr.has(sp.I):
        return sp.StrictGreaterThan(expr, 0, evaluate=False)
    content, factors = _factors(expr)
    rest = sp.sign(content)
    for factor, power in factors:
        if power % 2 == 1:
            rest *= {sp.true: 1, sp.false: -1}.get(_relation(factor, assumptions), factor)
    return _relation(rest, assumptions)


def nonzero(expr, assumptions=sp.true):
    """Return the condition under which ``expr`` is not 0, factors that never vanish left out."""
    if expr.has(sp.I) or expr == 0:
        return sp.Ne(expr, 0)
    factors = [f for f, _ in _factors(expr)[1] if _relation(f, assumptions) not in (sp.true, sp.false)]
    return sp.And(*(_reduced(sp.Ne(f, 0), assumptions) for f in factors))


def names(symbols):
    return ", ".join(sorted(map(str, symbols))) or "nothing"


def equations(values):
    return ", ".join(f"{symbol} = {value}" for symbol, value in values.items())


def determinant(branch):
    return "det dg/dy" if len(branch) > 1 else f"dg/d{next(iter(branch))}"


def _factors(expr):
    numerator, denominator = sp.fraction(sp.together(expr))
    return sp.factor_list(numerator * denominator)


@lru_cache(maxsize=256)
def _relation(expr, assumptions):
    """Return ``expr > 0``, True or False where that follows from the symbols being real and the assumptions."""
    real = {s: sp.Dummy(real=True) for s in expr.free_symbols if s.is_real is None}
    known = sp.sympify(expr.subs(real) > 0, strict=True)
    return known if known in (sp.true, sp.false) else _reduced(expr > 0, assumptions)


def _reduced(relation, assumptions):
    """Solve a rational relation in one symbol within its assumed range; leave any other as it is."""
    if len(relation.free_symbols) == 1 and all(side.is_rational_function() for side in relation.args):
        return reduce_under(relation, assumptions)
    return relation


def _hurwitz(matrix):
    """Return the determinants that are all positive when every eigenvalue of ``matrix`` has a negative real part."""
    a = matrix.charpoly().all_coeffs()
    n = len(a) - 1
    table = sp.Matrix(n, n, lambda i, j: a[2 * j - i + 1] if 0 <= 2 * j - i + 1 <= n else 0)
    return [table[:k, :k].det() for k in range(1, n + 1)]


def _located(part, states, assumptions):
    """Reduce one condition of a mode on the manifold, the sign of the parameters told from that of the states."""
    if not isinstance(part, (sp.StrictGreaterThan, sp.StrictLessThan)):
        return part
    parameters, rest = sp.factor(part.gts - part.lts).as_independent(*states, as_Add=False)
    above, below = (positive(sign * parameters, assumptions) for sign in (1, -1))
    return sp.Or(sp.And(above, positive(rest, assumptions)), sp.And(below, positive(-rest, assumptions)))


def _branches(mode, small):
    equal_zero = [g.subs(small, 0) for g in mode.fast.values()]
    try:
        solutions = sp.solve(equal_zero, list(mode.fast), dict=True)
    except NotImplementedError:
        raise NotDerivable(f"mode {mode.name!r}: SymPy does not solve g = 0; give slow_manifold a branch") from None
    complete = [s for s in solutions if s.keys() == {*mode.fast} and not any(h.is_real is False for h in s.values())]
    return [sp.Dict({y: by_powers(h, tuple(mode.slow)) for y, h in s.items()}) for s in complete]


def _text(condition):
    parts = sp.And.make_args(condition)
    return " and ".join(f"{p.lhs} != {p.rhs}" if isinstance(p, sp.Ne) else str(p) for p in parts)


def _put(rates, given):
    return {symbol: rate.subs(given) for symbol, rate in rates.items()}


def _values(values, parameters):
    by_name = {p.name: p for p in parameters}
    unknown = values.keys() - by_name.keys()
    if unknown:
        raise InputError(f"{names(unknown)} is not a parameter of this manifold; it has {names(by_name)}")
    return {by_name[name]: exact_value(name, value) for name, value in values.items()}
