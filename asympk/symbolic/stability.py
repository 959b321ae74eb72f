r"""Fast and slow eigenvalues of every mode, normal hyperbolicity, and where node turns to focus.

For x' = f, mu y' = g the characteristic polynomial p(lambda, mu) = det(M - lambda diag(1, mu)), M the Jacobian of
(f, g), stays polynomial in mu. Its roots at mu = 0 are the slow eigenvalues; those of p(nu / mu, mu) that do not
vanish at mu = 0 give the fast ones, lambda = nu / mu.
"""

from dataclasses import dataclass

import sympy as sp

from asympk.errors import InputError, NotDerivable, NotNormallyHyperbolic, OrderError
from asympk.numbers import short
from asympk.symbolic.conditions import reduce_under
from asympk.symbolic.reading import rational

LAMBDA = sp.Symbol("lambda")


@dataclass(frozen=True)
class Eigenvalues:
    r"""The spectrum of one mode: exact slow and fast eigenvalues, and the number of neutral (zero) ones.

    ``polynomial`` is p(lambda, mu) without its neutral factor. ``coalescence`` is the mu at which slow and fast
    eigenvalues meet, node turning to focus; the series in mu of both converge for |mu| < ``radius`` = |coalescence|.
    ``kinds`` are pairs (name, condition on the parameters and mu): stable node, stable focus, saddle, ...;
    ``hyperbolic`` is the condition under which fast and slow separate as mu -> 0.
    """

    mode: str
    small: sp.Symbol
    polynomial: sp.Expr
    slow: sp.Expr
    fast: sp.Expr
    neutral: int
    coalescence: sp.Expr
    radius: sp.Expr
    hyperbolic: sp.Basic
    kinds: tuple[tuple[str, sp.Basic], ...]

    def kind(self, **values):
        """Return the kind at given values of the parameters and mu, by name: ``kind(sigma=1, mu="1/100")``.

        Raises ``InputError`` when a value is missing, or the equilibrium is on a boundary between kinds.
        """
        given = {
            symbol: rational(symbol.name, values[symbol.name])
            for symbol in self._parameters()
            if symbol.name in values
        }
        missing = sorted(symbol.name for symbol in self._parameters() - set(given))
        if missing:
            raise InputError(f"{self.mode}: {', '.join(missing)} not given; the kind depends on it")
        for name, condition in self.kinds:
            if condition.subs(given) == sp.true:
                return name
        raise InputError(f"{self.mode}: {given} lies on a boundary between kinds")

    def _parameters(self):
        return self.polynomial.free_symbols - {LAMBDA}


def eigenvalues(system):
    """Return the ``Eigenvalues`` of every linear mode with one slow and one fast active state, in closed form.

    States that enter no field (the velocity) are neutral. Raises ``NotDerivable`` for a mode whose spectrum depends
    on the state or whose polynomial is not quadratic in lambda.
    """
    return tuple(_spectrum(mode, system) for mode in system.modes)


def characteristic_polynomial(mode, small):
    r"""Return p(lambda, mu) = det(M - lambda diag(1, .., mu, ..)), expanded, neutral factors of lambda included."""
    states = [*mode.slow, *mode.fast]
    rates = [*mode.slow.values(), *mode.fast.values()]
    weights = [1] * len(mode.slow) + [small] * len(mode.fast)
    jacobian = sp.Matrix(rates).jacobian(states)
    return sp.expand((jacobian - LAMBDA * sp.diag(*weights)).det())


def series_in_mu(value, spectrum, order):
    r"""Expand the ``"slow"`` or ``"fast"`` eigenvalue in mu: coefficients c_0.. of lambda, or of mu lambda if fast.

    The coefficients follow from p = 0 one linear equation at a time. Raises ``OrderError`` for an order that is not
    a whole number >= 0.
    """
    if isinstance(order, bool) or not isinstance(order, int) or order < 0:
        raise OrderError(f"order = {short(order)} is not a whole number >= 0")
    small = spectrum.small
    polynomial = {"slow": spectrum.polynomial, "fast": _rescaled(spectrum.polynomial, small)}[value]
    (start,) = (root for root in sp.roots(polynomial.subs(small, 0), LAMBDA) if root != 0 or value == "slow")
    slope = polynomial.diff(LAMBDA).subs({small: 0, LAMBDA: start})
    coefficients = [start]
    for k in range(1, order + 1):
        partial = sum(c * small**j for j, c in enumerate(coefficients))
        residual = sp.expand(polynomial.subs(LAMBDA, partial)).coeff(small, k)
        coefficients.append(sp.factor(-residual / slope))
    return tuple(coefficients)


def _rescaled(polynomial, small):
    return sp.expand(sp.cancel(small * polynomial.subs(LAMBDA, LAMBDA / small)))


def _spectrum(mode, system):
    small = system.small
    full = sp.Poly(characteristic_polynomial(mode, small), LAMBDA)
    if full.free_symbols_in_domain & {*mode.slow, *mode.fast}:
        raise NotDerivable(f"{mode.name}: the eigenvalues depend on the state; the mode is not linear")
    neutral = min(power for (power,), _ in full.terms())
    quadratic = sp.Poly(sp.cancel(full.as_expr() / LAMBDA**neutral), LAMBDA)
    if quadratic.degree() != 2:
        raise NotDerivable(f"{mode.name}: {quadratic.degree()} active eigenvalues; closed forms are given for two")
    sign = sp.sign(quadratic.LC().subs(small, 1))
    inertia, damping, stiffness = (sp.factor(sign * c) for c in quadratic.all_coeffs())
    if damping.subs(small, 0) == 0:
        raise NotNormallyHyperbolic(f"{mode.name}: dg/dy vanishes; fast and slow do not separate")
    root = sp.sqrt(1 - sp.cancel(4 * inertia * stiffness / damping**2))
    (coalescence,) = sp.solve(sp.cancel(damping**2 - 4 * inertia * stiffness) / damping, small)
    return Eigenvalues(
        mode.name,
        small,
        sp.expand(sign * quadratic.as_expr()),
        slow=-2 * sp.cancel(stiffness / damping) / (1 + root),
        fast=-sp.cancel(damping / (2 * inertia)) * (1 + root),
        neutral=neutral,
        coalescence=coalescence,
        radius=sp.Abs(coalescence),
        hyperbolic=reduce_under(sp.Ne(damping, 0), system.assumptions),
        kinds=_kinds(damping, stiffness, small < coalescence, system.assumptions),
    )


def _kinds(damping, stiffness, overdamped, assumptions):
    cases = [("saddle", sp.And(stiffness < 0))]
    for name, sign in (("stable", damping > 0), ("unstable", damping < 0)):
        cases.append((f"{name} node", sp.And(stiffness > 0, sign, overdamped)))
        cases.append((f"{name} focus", sp.And(stiffness > 0, sign, sp.Gt(*overdamped.args))))
    reduced = ((name, reduce_under(condition, assumptions)) for name, condition in cases)
    return tuple((name, condition) for name, condition in reduced if condition != sp.false)
