r"""Slow manifolds: their series in mu, their closed form in a linear mode, and the flow on them.

Where dg/dy is regular on a critical manifold y = h_0(x), a slow manifold y = h_0 + mu h_1 + mu^2 h_2 + ... of
x' = f, mu y' = g continues it (Fenichel), with

    mu h_x f(x, h, mu) = g(x, h, mu)

order by order; ``asympk.symbolic.expansion`` solves this. In a linear mode with one slow and one fast variable the slow
manifold is a line, known in closed form (Lemma 4). ``slow_manifolds`` continues every critical manifold of a system,
``slow_manifold`` a branch that the caller gives; ``reduced_flow`` and ``rest_state`` give the flow on the result.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import sympy as sp
from sympy.integrals.rationaltools import ratint

from asympk.errors import InputError, NotDerivable, NotNormallyHyperbolic, OrderError
from asympk.numbers import known_order
from asympk.shown import Several
from asympk.symbolic import critical, expansion
from asympk.symbolic.critical import CriticalManifold, checked_branch, critical_manifolds, equations
from asympk.symbolic.diffring import DifferentialRing
from asympk.symbolic.expansion import expand, is_implicit, is_zero, limit_of, over_fast, zero_at_places
from asympk.symbolic.long import inverse_of
from asympk.symbolic.reading import unused_symbol
from asympk.symbolic.roots import heights, is_unreadable, solutions_of
from asympk.symbolic.substitutions import fractional_powers
from asympk.symbolic.system import Mode, System, of_system
from asympk.symbolic.values import in_words

LONG = 80  # characters from which on a series is shown term by term
C = sp.Symbol("C", real=True)


@dataclass(frozen=True, repr=False)
class SlowManifold(CriticalManifold):
    """A critical manifold continued to ``order``: ``y = sum(coefficients[k] * mu**k)``, remainder O(mu**(order + 1)).

    With one fast variable a coefficient is an expression, with several a ``Dict`` keyed by fast variable. On an
    implicit branch, ``{y: y}``, the symbol y stands for the branch's value, a root of g(x, y, 0).
    """

    order: int = 0

    @cached_property
    def coefficients(self) -> tuple[sp.Basic, ...]:
        """The coefficients of 1, mu, ..., mu**order; raises ``NotDerivable`` where they are too long."""
        return tuple(self.coefficient(k) for k in range(self.order + 1))

    @cached_property
    def expr(self) -> sp.Basic:
        """The truncated series: an expression with one fast variable, a ``Dict`` by fast variable with several."""
        if len(self.branch) == 1:
            return _polynomial(self.coefficients, self.small)
        return sp.Dict({y: _polynomial([c[y] for c in self.coefficients], self.small) for y in self.branch})

    def _graph(self) -> dict[sp.Symbol, list[tuple[str, sp.Expr]]]:
        try:
            parts = [c if isinstance(c, sp.Dict) else dict.fromkeys(self.branch, c) for c in self.coefficients]
        except NotDerivable as reason:
            return {y: [*terms, (f"+ {self.small} *", str(reason))] for y, terms in super()._graph().items()}
        found: dict[sp.Symbol, list[tuple[str, sp.Expr]]] = {}
        for y in self.branch:
            whole = _polynomial(terms := [part[y] for part in parts], self.small)
            each = [(f"+ {self.small**k} *" if k else "", term) for k, term in enumerate(terms) if term != 0 or k == 0]
            found[y] = each if len(str(whole)) > LONG else [("", whole)]
        return found

    @cached_property
    def closed(self) -> sp.Expr | None:
        """The exact manifold where the mode is linear in one slow and one fast variable, else None.

        The formula holds for mu so small that its square root is real; see ``exact_slow_line``.
        """
        return exact_slow_line(self.dynamics, self.small)

    def coefficient(self, k: int) -> sp.Basic:
        """Return the coefficient of mu**k; raises ``OrderError`` beyond ``order``."""
        k = known_order(k)
        if k > self.order:
            raise OrderError(f"{self.name} is known to order {self.order} in {self.small}, not {k}; ask for order={k}")
        values = self.branch
        if k > 0:
            found = expand(self.dynamics, self.small, self.branch, self.order)
            values = sp.Dict({y: found.expr(height[k]) for y, height in found.height.items()})
        return values if len(values) > 1 else next(iter(values.values()))


@dataclass(frozen=True)
class RestState:
    """A rest state of the flow on a manifold: ``state`` gives the slow variables that determine the flow, and the fast.

    ``drift`` gives the rates at which the other slow variables still change there; ``rate`` is the slow eigenvalue at
    mu = 0 (negative: attracting) where one variable determines the flow, else None.
    """

    state: sp.Dict
    drift: sp.Dict
    rate: sp.Expr | None


@of_system
def slow_manifold(
    system: System, branch: Mapping[sp.Symbol, sp.Expr] | None = None, order: int = 1, mode: str | None = None,
    name: str = "Pi",
) -> SlowManifold:
    r"""Expand ``y = h(x, mu)`` from ``mu h_x x' = g(x, h, mu)``; ``branch`` is {y: h_0}, a root of g(x, y, 0).

    Without ``branch`` the branch stays implicit, {y: y}: the coefficients and the conditions for stability and folds
    are written in x and the branch's value y, or in y alone where g = 0 is a graph x = phi(y). ``mode`` names the mode
    of a system with several. Raises ``OrderError``, ``InputError``, ``BranchError`` when g does not vanish on the
    branch, ``NotNormallyHyperbolic`` when the real part of an eigenvalue of dg/dy does, and ``NotDerivable`` for an
    order above 0 where the rates are too long.
    """
    order = known_order(order)
    dynamics = critical.for_formulas(system, system.mode(mode))
    expansion.require_factored(dynamics, expansion.STEEPEST)  # g may stay implicit
    expansion.require_series(dynamics, system.small, order)
    at = sp.Dict({y: y for y in dynamics.fast}) if branch is None else checked_branch(branch, dynamics, system.small)
    manifold = SlowManifold(name, dynamics, system.small, at, system.assumptions, order)
    if any(p[-1] == 0 for p in manifold.characteristic):
        raise NotNormallyHyperbolic(f"{critical.determinant(at)} vanishes on {critical.branch_in_words(at)}; no slow "
                                    "manifold continues this branch")
    if manifold.exists == sp.false:
        advice = ": give the fast states damping" * (manifold.real != sp.false)
        raise NotNormallyHyperbolic(f"{manifold.degeneracy(at)}; no slow manifold continues this branch{advice}")
    expansion.require_short(dynamics, order, at)
    if order > 0:
        expand(dynamics, system.small, at, order)
    return manifold


@of_system
def slow_manifolds(system: System, order: int = 1) -> Several[SlowManifold]:
    """Continue to ``order`` every critical manifold that can be normally hyperbolic and lies in its mode.

    Raises what ``critical_manifolds`` and ``slow_manifold`` raise: ``NotDerivable``, ``OrderError``.
    """
    order = known_order(order)
    found = []
    for c in critical_manifolds(system):
        if c.exists != sp.false and c.domain != sp.false:
            expansion.require_short(c.dynamics, order, c.branch)
            expansion.require_series(c.dynamics, c.small, order)
            found.append(SlowManifold(c.name, c.dynamics, c.small, c.branch, c.assumptions, order))
            vars(found[-1]).update(vars(c))  # what is known of the branch, which is the same at every order
    return Several(found)


def exact_slow_line(mode: Mode, small: sp.Symbol) -> sp.Expr | None:
    r"""Return the exact slow line of x' = p x + q y + r, mu y' = c x + d y + e, or None for another kind of mode.

    y = y_* + k (x - x_*) through the rest state, with the root of mu q k^2 + (mu p - d) k = c that stays finite as
    mu -> 0, k = 2 c / (B (1 + sqrt(1 + 4 mu q c / B^2))), B = mu p - d: no cancellation, whatever the sign of B.
    """
    active = active_slow(mode)
    if len(active) != 1 or len(mode.fast) != 1:
        return None
    (x,), ((y, g),) = active, mode.fast.items()
    if not (mode.slow[x].is_polynomial(x, y) and g.is_polynomial(x, y)):
        return None
    rates = [sp.Poly(rate, x, y) for rate in (mode.slow[x], g)]
    if max(rate.total_degree() for rate in rates) > 1:
        return None
    (p, q, r), (c, d, e) = ([rate.coeff_monomial(m) for m in (x, y, 1)] for rate in rates)
    b = small * p - d
    k = sp.cancel(2 * c / b) / (1 + sp.sqrt(1 + sp.cancel(4 * small * q * c / b**2)))
    rest = sp.cancel(p * d - q * c)
    if rest == 0:
        return k * x + (e - small * k * r) / (small * k * q - d)
    return sp.cancel((c * r - p * e) / rest) + k * (x - sp.cancel((q * e - d * r) / rest))


def active_slow(mode: Mode) -> tuple[sp.Symbol, ...]:
    """Return the slow variables that determine the flow: those in g, and those in the rates of such variables."""
    active: set[sp.Symbol] = set()
    queue = set().union(*(g.free_symbols for g in mode.fast.values()))
    while new := (queue & {*mode.slow}) - active:
        active |= new
        queue = set().union(*(mode.slow[x].free_symbols for x in new))
    return tuple(x for x in mode.slow if x in active)


def reduced_flow(manifold: SlowManifold) -> sp.Dict:
    """Return {x: x'} on the manifold, truncated to its order in mu, and {y: y'} for the value of an implicit branch."""
    _require_manifold(manifold, "reduced_flow")
    flow = {x: _polynomial(rates, manifold.small) for x, rates in _flow(manifold).items()}
    if is_implicit(manifold.branch):
        flow |= {y: sum(k * flow[x] for x, k in by.items()) for y, by in branch_slopes(manifold).items()}
    return sp.Dict(flow)


def branch_slopes(manifold: SlowManifold) -> dict[sp.Symbol, dict[sp.Symbol, sp.Expr]]:
    """Return the slopes {y: {x: dy/dx}} of the branch, -g_y^-1 g_x at mu = 0, evaluated on the branch."""
    mode, small, over = manifold.dynamics, manifold.small, over_fast(manifold.dynamics, manifold.small, manifold.branch)
    g = sp.Matrix([limit_of(g, small) for g in mode.fast.values()])
    slopes = -(inverse_of(expansion.fast_jacobian(mode, small)) * g.jacobian(list(mode.slow)))
    at = {**manifold.branch, **over}
    return {y: {x: sp.cancel(slopes[i, j].subs(at, simultaneous=True)) for j, x in enumerate(mode.slow)}
            for i, y in enumerate(mode.fast)}


def integral_curves(manifold: SlowManifold) -> sp.Dict:
    r"""Return {z: z(x) + C} on the manifold for every other slow variable z, truncated to its order in mu.

    dz/dx = z'/x' is expanded in mu and integrated; the constant is named C_ if the system has a symbol C. Raises
    ``NotDerivable`` unless one slow variable x determines the flow, or where SymPy has no integral.
    """
    _require_manifold(manifold, "integral_curves")
    name, mode, active = manifold.name, manifold.dynamics, active_slow(manifold.dynamics)
    if is_implicit(manifold.branch):
        raise NotDerivable(f"{name} is implicit; curves are known over an explicit branch, give slow_manifold a branch")
    if len(active) != 1:
        raise NotDerivable(f"{name}: the flow depends on {in_words(active)}; curves are known for one variable")
    (x,) = active
    flow = _flow(manifold)
    run = flow.pop(x)
    if run[0] == 0:
        raise NotDerivable(f"{name}: {x} rests everywhere at {manifold.small} = 0; there are no curves over it")
    if coupled := set().union(*(rate.free_symbols for rates in flow.values() for rate in rates)) & {*flow}:
        raise NotDerivable(f"{name}: rates depend on {in_words(coupled)}; curves are known for rates in {x} alone")
    curves = {z: [_integral(q, x) for q in _quotient(rates, run, x)] for z, rates in flow.items()}
    found = {z: _polynomial(terms, manifold.small) for z, terms in curves.items()}
    constant = unused_symbol(C.name, sp.Tuple(mode.slow, mode.fast, *found.values()).free_symbols, real=True)
    return sp.Dict({z: curve + constant for z, curve in found.items()})


def rest_state(manifold: SlowManifold) -> RestState | None:
    """Return the isolated ``RestState`` on the manifold, within its domain, or None.

    Raises ``NotDerivable`` when there are several, when SymPy cannot solve f = g = 0, or when it depends on the
    parameters whether a solution lies on this manifold or on another one.
    """
    _require_manifold(manifold, "rest_state")
    mode, active = manifold.dynamics, active_slow(manifold.dynamics)
    unknowns = [*active, *mode.fast]
    found = solutions_of([*(mode.slow[x] for x in active), *mode.fast.values()], unknowns)
    if found is None or any(map(is_unreadable, heights(found))):
        raise NotDerivable(f"{manifold.name}: SymPy does not solve f = g = 0 for its rest states in readable formulas")
    lying = [(s, _lies_on(s, manifold)) for s in found if s.keys() == {*unknowns}]
    found = [s for s, on in lying if True in on and sp.And(manifold.domain, manifold.exists).subs(s) != sp.false]
    if partly := [s for s, on in lying if s in found and False in on]:
        raise NotDerivable(f"{manifold.name}: whether {equations(partly[0])} lies on it or on another manifold depends "
                           "on the parameters; give numbers for them, by at()")
    if len(found) > 1:
        raise NotDerivable(f"{manifold.name}: several rest states lie on it: {'; '.join(map(equations, found))}")
    if not found:
        return None
    (state,) = found
    drift = {z: sp.cancel(rate.subs(state, simultaneous=True)) for z, rate in mode.slow.items() if z not in active}
    return RestState(sp.Dict(state), sp.Dict(drift), _rate(manifold, active, state))


def _require_manifold(manifold, verb):
    if not isinstance(manifold, CriticalManifold):
        raise InputError(f"{verb} takes a slow manifold, not {type(manifold).__name__}; take one of "
                         "ap.slow_manifolds(system)")


def _lies_on(state, manifold):
    """Return the answers, at any parameters allowed, to whether a state lies on the manifold: True, False or both."""
    off = [limit_of((y - h).subs(state), manifold.small) for y, h in manifold.branch.items()]
    verdicts = {all(map(is_zero, off))} if all(e.is_rational_function() for e in off) else set()
    return verdicts or {*zero_at_places(off, manifold.assumptions)} or {all(map(is_zero, off))}


def _rate(manifold, active, state):
    if len(active) != 1:
        return None
    (x,), flow = active, _flow(manifold)[active[0]][0]
    slopes = branch_slopes(manifold).items() if is_implicit(manifold.branch) else ()
    rate = flow.diff(x) + sum(flow.diff(y) * by[x] for y, by in slopes)
    at_rest = limit_of(rate.subs(state), manifold.small)
    return sp.cancel(at_rest.xreplace({p: sp.factor(p.base) ** p.exp for p in fractional_powers(at_rest)}))


def _flow(manifold):
    """Return {x: the coefficients of x' on the manifold}."""
    order = manifold.order if isinstance(manifold, SlowManifold) else 0
    found = expand(manifold.dynamics, manifold.small, manifold.branch, order)
    return {x: [found.expr(c) for c in rates] for x, rates in found.flow.items()}


def _quotient(above, below, x):
    """Divide one series in mu by another."""
    ring = DifferentialRing([*above, *below, 1 / below[0]], {x: lambda e: e.diff(x)}, 0)
    rest, inverse = [ring(b) for b in below[1:]], ring(1 / below[0])
    result = []
    for rate in above:
        carried = ring.dot(zip(result, rest[: len(result)][::-1], strict=True))
        result.append(ring.dot([(ring(rate), inverse), (ring.dot([(carried, ring(-1))]), inverse)]))
    return [ring.expr(q) for q in result]


def _integral(integrand, x):
    """Return the integral over x, with logarithms of absolute values and factored coefficients."""
    found = ratint(integrand, x) if integrand.is_rational_function(x) else sp.integrate(integrand, x)
    if found.has(sp.Integral):
        raise NotDerivable(f"SymPy has no integral of {integrand} over {x}")
    real = found.replace(sp.log, lambda argument: sp.log(sp.Abs(sp.numer(sp.together(argument)))))
    sums = sp.collect(sp.expand(real), [x, *real.atoms(sp.log)], sp.factor)
    return sums.replace(sp.Abs, lambda argument: sp.Abs(sp.collect(argument, x)))


def _polynomial(coefficients, small):
    return sp.Add(*(c * small**k for k, c in enumerate(coefficients)))
