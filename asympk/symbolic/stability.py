r"""Spectra: the fast and slow eigenvalues of a mode, on a branch or at a rest state, and where their kind changes.

For x' = f, mu y' = g the characteristic polynomial p(lambda, mu) = det(M - lambda diag(1, .., mu, ..)), M the Jacobian
of (f, g), stays polynomial in mu. Its roots at mu = 0 are the slow eigenvalues to leading order, those of the reduced
flow; the fast ones are lambda = nu / mu with det(g_y - nu) = 0 to leading order.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable, NotNormallyHyperbolic
from asympk.formulas import NOT_FINITE
from asympk.numbers import known_order, short
from asympk.shown import Card, Several, ShownAsFormulas
from asympk.symbolic.critical import CriticalManifold, checked_branch, equations, with_held_slow
from asympk.symbolic.expansion import is_zero, limit_of
from asympk.symbolic.hurwitz import attracting, characteristic, off_axis, repelling, split
from asympk.symbolic.long import unnested
from asympk.symbolic.manifold import RestState, SlowManifold
from asympk.symbolic.sides import is_whole, on_side, phases
from asympk.symbolic.signs import conjunction, known_sign, nonzero
from asympk.symbolic.system import System, of_system
from asympk.symbolic.values import as_exact, by_symbol, in_words

LAMBDA = sp.Symbol("lambda")
NU = sp.Symbol("nu")


@dataclass(frozen=True, repr=False)
class Spectrum(ShownAsFormulas):
    r"""The spectrum of one mode, without its ``neutral`` zero eigenvalues.

    ``polynomial`` is p(lambda, mu), its first coefficient positive. ``slow_polynomial`` is p(lambda, 0), with the roots
    ``slow_rates``; ``fast_polynomial`` is det(nu - g_y), nu = mu lambda, with the roots ``fast_rates``; ``roots`` are
    the roots of p itself. Each tuple of roots is empty if one of them has no closed form. ``kinds`` are stable node,
    stable focus, saddle, ... for two eigenvalues; for more, stable, unstable, saddle, and centre for an imaginary pair.
    """

    mode: str
    small: Any  # None where the mode has no fast states
    polynomial: sp.Expr
    neutral: int
    slow_polynomial: sp.Expr
    fast_polynomial: sp.Expr
    parameters: tuple[sp.Symbol, ...] = field(repr=False)
    assumptions: sp.Basic = field(repr=False)

    def _card(self) -> Card:
        rows = [("polynomial", self.polynomial), *(("slow", rate) for rate in self.slow_rates)]
        rows += [(f"fast, times {self.small}", rate) for rate in self.fast_rates]
        return Card(f"Spectrum of mode {self.mode}, to leading order", tuple(rows))

    @cached_property
    def slow_rates(self) -> tuple[sp.Expr, ...]:
        """The slow eigenvalues to leading order."""
        return _roots(sp.Poly(self.slow_polynomial, LAMBDA))

    @cached_property
    def fast_rates(self) -> tuple[sp.Expr, ...]:
        """The fast eigenvalues times mu, to leading order."""
        return _roots(sp.Poly(self.fast_polynomial, NU))

    @cached_property
    def roots(self) -> tuple[sp.Expr, ...]:
        """The exact eigenvalues, if there are at most two or the polynomial has no parameters; else ()."""
        poly = sp.Poly(self.polynomial, LAMBDA)
        return _roots(poly) if poly.degree() <= 2 or not poly.free_symbols_in_domain else ()

    @cached_property
    def hyperbolic(self) -> sp.Basic:
        """The condition under which no fast rate has the real part 0, so that fast and slow separate as mu -> 0."""
        coefficients = sp.Poly(self.fast_polynomial, NU).all_coeffs()
        return off_axis((tuple(map(sp.factor, coefficients)),), self.assumptions) if len(coefficients) > 1 else sp.true

    @cached_property
    def kinds(self) -> tuple[tuple[str, sp.Basic], ...]:
        """Pairs (name, condition on the parameters and mu); the conditions exclude one another."""
        return _kinds(sp.Poly(self.polynomial, LAMBDA).all_coeffs(), self.small, self.assumptions)

    def kind(self, values: Mapping | None = None, /, **named: Any) -> str:
        """Return the kind at given values of the parameters and mu, by name: ``kind(sigma=1, mu="1/100")``.

        Values may also come in a mapping by name or symbol. Raises ``InputError`` when a value is missing or unknown,
        or the spectrum is on a boundary between kinds.
        """
        wanted = self.polynomial.free_symbols - {LAMBDA}
        given = by_symbol({**(values or {}), **named}, {*self.parameters} | wanted, "this spectrum")
        given = {s: as_exact(str(v) if isinstance(v, float) else v, s) for s, v in given.items()}
        if missing := wanted - given.keys():
            raise InputError(f"{self.mode}: {in_words(missing)} not given; the kind depends on it")
        numbers = [c.subs(given) for c in sp.Poly(self.polynomial, LAMBDA).all_coeffs()]
        for name, condition in _kinds(numbers, None, sp.true):
            if condition == sp.true:
                return name
        raise InputError(f"{self.mode}: {equations(given)} lies on a boundary between kinds")


@dataclass(frozen=True, repr=False)
class Eigenvalues(Spectrum):
    r"""A spectrum of one slow and one fast eigenvalue, both exact.

    ``coalescence`` is the mu at which both eigenvalues meet and a node becomes a focus; the series in mu of both
    converge for |mu| < ``radius`` = |coalescence|.
    """

    slow: sp.Expr
    fast: sp.Expr
    coalescence: sp.Expr
    radius: sp.Expr

    def _card(self) -> Card:
        rows = [("polynomial", self.polynomial), ("slow", self.slow), ("fast", self.fast)]
        return Card(f"Eigenvalues of mode {self.mode}", (*rows, ("coalescence", self.coalescence)))


@of_system
def eigenvalues(
    system: System, *, on: CriticalManifold | Mapping | None = None, at: RestState | Mapping | None = None,
    mode: str | None = None,
) -> tuple[Spectrum, ...]:
    """Return the ``Spectrum`` of every mode, as ``Eigenvalues`` where one slow and one fast eigenvalue are active.

    ``on`` is a manifold, or a branch {fast state: expression}, on which the Jacobian is taken; ``at`` is a rest state,
    or a mapping from states to values at which their rates vanish; ``mode`` names a single mode. States that enter no
    field are neutral. Raises ``NotDerivable`` for a mode whose spectrum depends on the state unless ``on`` or ``at`` is
    given, ``InputError`` for a wrong branch or rest state, and ``NotNormallyHyperbolic`` where det g_y vanishes
    identically.
    """
    if on is not None and at is not None:
        raise InputError("on= and at= are both given; give a branch or a rest state")
    if on is not None:
        return Several([_on_branch(system, on, mode)])
    modes = system.modes if mode is None else (system.mode(mode),)
    if at is not None:
        return _at_rest(system, modes, at)
    for m in modes:
        if sp.Matrix(_jacobian(m)).free_symbols & {*m.slow, *m.fast, system.time}:
            raise NotDerivable(
                f"{m.name}: the eigenvalues depend on the state; the mode is not linear: give on= a branch or "
                "at= a rest state"
            )
    parted = (with_held_slow(m, system.small) if system.small else m for m in modes)
    return Several(_spectrum(system, m, _jacobian(m)) for m in parted)


def series_in_mu(value: str, spectrum: Eigenvalues, order: int) -> tuple[sp.Expr, ...]:
    r"""Return the coefficients c_0, c_1, ... in mu of the ``"slow"`` eigenvalue, or of mu times the ``"fast"`` one.

    Each coefficient follows from p = 0 by one linear equation. Raises ``OrderError`` for an order that is not a whole
    number >= 0, ``InputError`` for a ``value`` other than these two.
    """
    order = known_order(order)
    if value not in ("slow", "fast") or not isinstance(spectrum, Eigenvalues):
        raise InputError(f"{value!r}: give 'slow' or 'fast', and a spectrum of one slow and one fast eigenvalue")
    small = spectrum.small
    polynomial = spectrum.polynomial
    if value == "fast":
        polynomial = sp.expand(sp.cancel(small * polynomial.subs(LAMBDA, LAMBDA / small)))
    (start,) = (root for root in sp.roots(polynomial.subs(small, 0), LAMBDA) if root != 0 or value == "slow")
    slope = polynomial.diff(LAMBDA).subs({small: 0, LAMBDA: start})
    coefficients = [start]
    for k in range(1, order + 1):
        partial = sum(c * small**j for j, c in enumerate(coefficients))
        residual = sp.expand(polynomial.subs(LAMBDA, partial)).coeff(small, k)
        coefficients.append(sp.factor(-residual / slope))
    return tuple(coefficients)


def _jacobian(mode):
    return sp.Matrix([*map(unnested, (*mode.slow.values(), *mode.fast.values()))]).jacobian([*mode.slow, *mode.fast])


def _on_branch(system, on, mode):
    if isinstance(on, CriticalManifold):
        m, branch = on.dynamics, on.branch
        if isinstance(on, SlowManifold) and on.order:
            branch = on.expr if len(on.branch) > 1 else dict.fromkeys(on.branch, on.expr)
    else:
        m = system.mode(mode)
        branch = checked_branch(on, m, system.small)
    return _spectrum(system, m, _jacobian(m).subs(branch, simultaneous=True))


def _at_rest(system, modes, at):
    place = by_symbol(at.state if isinstance(at, RestState) else at, system.states, "this system", "state")
    place = {s: v if isinstance(v, sp.Expr) and not v.is_number else as_exact(v, s) for s, v in place.items()}
    found, moving = [], ""
    for m in modes:
        if len(modes) > 1 and m.where.subs(place, simultaneous=True) == sp.false:
            moving = moving or f"{m.name} does not hold there"
            continue
        rates = {**m.slow, **m.fast}
        drift = {s: sp.factor(r) for s in place if not is_zero(r := rates[s].subs(place, simultaneous=True))}
        if drift:
            moving = moving or f"in {m.name} {', '.join(f'the rate of {s} is {short(r)}' for s, r in drift.items())}"
            continue
        around = _around([*rates.values()], tuple(rates), place)
        if len(around) != 1:
            raise NotDerivable(f"{m.name}: the rates have a kink or a jump at {equations(place)}, or a sawtooth, and "
                               "so no single Jacobian; write one side of them")
        jacobian = sp.Matrix(around.pop())[:, 1:]
        if missing := jacobian.free_symbols & {*system.states}:
            raise InputError(f"{m.name}: {in_words(missing)} not given; the spectrum depends on it")
        found.append(_spectrum(system, m, jacobian))
    if not found:
        raise InputError(f"{equations(place)} is no rest state: {moving}; give on= a branch for the spectrum elsewhere")
    return Several(found)


def _around(rates, states, place):
    """Return {[rates, Jacobian]} at a place, one matrix for each side of the switches there; empty with sawtooths."""
    opened = phases(rates, states)
    if any(map(is_whole, opened)):
        return set()
    here = next((phase for phase in opened if is_zero(phase.subs(place, simultaneous=True))), None)
    if here is None:
        column = sp.Matrix(rates)
        return {sp.Matrix.hstack(column, column.jacobian(states)).subs(place, simultaneous=True).as_immutable()}
    return set().union(*(_around([on_side(rate, here, sign) for rate in rates], states, place) for sign in (1, -1)))


def _spectrum(system, mode, jacobian):
    small, assumptions = system.small, system.assumptions
    if taken := {LAMBDA, NU} & jacobian.free_symbols:
        raise InputError(f"{min(taken, key=str)} is an eigenvalue here; declare the parameter as real=True")
    weights = sp.diag(*[1] * len(mode.slow), *[small] * len(mode.fast))
    full = sp.Poly(sp.expand((jacobian - LAMBDA * weights).det(method="berkowitz")), LAMBDA)
    neutral = min((power for (power,), _ in full.terms()), default=0)
    sign = (-1) ** full.degree()
    coefficients = [sign * c for c in full.all_coeffs()[: full.degree() - neutral + 1]]
    polynomial = sp.expand(sp.Poly(coefficients, LAMBDA).as_expr())
    n = len(mode.slow)
    fast, slow = jacobian[n:, n:], polynomial
    if mode.fast:
        fast, slow = fast.applyfunc(lambda entry: limit_of(entry, small)), limit_of(slow, small)
    if sp.Tuple(*fast, slow).has(*NOT_FINITE):
        raise InputError(f"{mode.name}: the eigenvalues have no limit as {small} vanishes, in which the rates are "
                         "singular; replace what is singular by a parameter")
    fast = sp.Poly(characteristic(fast) if mode.fast else [1], NU)
    if is_zero(fast.eval(0)):
        raise NotNormallyHyperbolic(f"{mode.name}: dg/dy is singular; fast and slow do not separate")
    found = Spectrum(mode.name, small, polynomial, neutral, slow, fast.as_expr(), system.parameters, assumptions)
    if len(coefficients) == 3 and len(mode.fast) == 1:
        return _pair(found, *map(sp.factor, coefficients))
    return found


def _roots(poly):
    """Return the roots of a polynomial in closed form, with multiplicity, or () if a root has no closed form."""
    found = []
    factors = sp.factor_list(sp.numer(sp.together(poly.as_expr())), *poly.gens)[1]
    for factor, power in (f for f in factors if f[0].has(*poly.gens)):  # others may have powers of 1/2
        part = sp.Poly(factor, *poly.gens)
        if part.degree() > 2 and not (part.domain.is_ZZ or part.domain.is_QQ):
            return ()
        roots = part.all_roots() if part.degree() > 2 else [r for r, k in sp.roots(part).items() for _ in range(k)]
        found += power * roots
    return tuple(found) if len(found) == poly.degree() else ()


def _pair(spectrum, inertia, damping, stiffness):
    """Return ``Eigenvalues``, the slow one in a form without cancellation, or ``spectrum`` if ``_meeting`` is None."""
    root = sp.sqrt(1 - sp.cancel(4 * inertia * stiffness / damping**2))
    meeting = _meeting(sp.cancel(damping**2 - 4 * inertia * stiffness), spectrum.small)
    if meeting is None:
        return spectrum
    return Eigenvalues(**{f.name: getattr(spectrum, f.name) for f in fields(spectrum)},
                       slow=-2 * sp.cancel(stiffness / damping) / (1 + root),
                       fast=-sp.cancel(damping / (2 * inertia)) * (1 + root), coalescence=meeting,
                       radius=sp.Abs(meeting))


def _meeting(discriminant, small):
    """Return the root in mu of the discriminant that is nearest to 0, or None if it is no polynomial of degree 1, 2."""
    if not discriminant.is_polynomial(small):
        return None
    poly = sp.Poly(discriminant, small)
    if poly.degree() == 1:
        return sp.cancel(-poly.nth(0) / poly.nth(1))
    if poly.degree() != 2:
        return None
    a, b, c = poly.all_coeffs()
    return -2 * c / (b + (known_sign(b, sp.true) or sp.sign(b)) * sp.sqrt(sp.factor(b**2 - 4 * a * c)))


def _kinds(coefficients, small, assumptions):
    """Return the kinds and their conditions; with two eigenvalues the kinds distinguish nodes from foci."""
    coefficients = [sp.factor(c) for c in coefficients]
    if len(coefficients) == 3:
        cases = _planar_cases(*coefficients)
        found = [(name, conjunction(signs, assumptions)) for name, signs in cases]
    elif len(coefficients) == 2:
        cases = (("stable node", 1), ("unstable node", -1))
        found = [(name, conjunction([(coefficients[1], sign)], assumptions)) for name, sign in cases]
    else:
        tests = (("stable", attracting), ("unstable", repelling), ("saddle", split), ("centre", _on_axis))
        found = [(name, test((coefficients,), assumptions)) for name, test in tests] if len(coefficients) > 1 else []
    parts = ((name, sp.And.make_args(c)) for name, c in found if c != sp.false)
    return tuple((name, sp.And(*(_bound(part, small, assumptions) for part in every))) for name, every in parts)


def _on_axis(polynomials, assumptions):
    """Return the condition under which a pair of eigenvalues is imaginary, and none is 0."""
    return sp.And(*(nonzero(p[-1], assumptions) for p in polynomials), sp.Not(off_axis(polynomials, assumptions)))


def _planar_cases(inertia, damping, stiffness):
    discriminant = sp.factor(damping**2 - 4 * inertia * stiffness)
    yield "saddle", [(stiffness, -1)]
    for name, sign in (("stable", 1), ("unstable", -1)):
        for shape, real in (("node", 1), ("focus", -1)):
            yield f"{name} {shape}", [(stiffness, 1), (damping, sign), (discriminant, real)]
    yield "centre", [(stiffness, 1), (damping, 0)]


def _bound(part, small, assumptions):
    """Write a relation that is linear in mu as a bound on mu, where the sign of the coefficient of mu is known."""
    if not isinstance(part, sp.Gt | sp.Lt) or small is None or not part.has(small):
        return part
    excess = part.gts - part.lts
    if not excess.is_polynomial(small) or sp.degree(excess, small) != 1:
        return part
    slope = sp.Poly(excess, small).coeff_monomial(small)
    sign = known_sign(slope, assumptions) if nonzero(slope, assumptions) == sp.true else 0
    end = sp.expand(-sp.cancel(excess.subs(small, 0) / slope))
    return {1: small > end, -1: small < end, 0: part}[sign]
