r"""The rod of (2.1) with its geometry kept: Fufaev's system before the small-angle step (2.2).

With delta = x_1 - x_2 = l cos(alpha) g x, by which the span of the rod is shorter, the length of the rod is
l q with q^2 = 1 - cos(alpha)^2 (2 g x - g^2 x^2), and

    r = R cos(alpha) / P = (2 x - g x^2) / (1 + q) + C y,    C = cos(alpha + beta) / cos(alpha) = (1 - g x) / q,
    mu y' = 1 - 2 C r + phi,    z' = 1 - C r + phi,    |phi| <= (sigma + 2) |r| / q.

The states and scales are those of (2.7): delta is Hooke's law (2.2) for the elastic reaction x = rho. g = kappa mu with
kappa = P l h^2 / (m cos(alpha)), which does not depend on the stiffness: the terms that (2.2) drops are of the order
kappa mu, the same order in mu as the first corrections by mu itself.
"""

from functools import cache

import sympy as sp

from asympk.scene import Scene
from asympk.symbolic.system import System
from asympk.systems.painleve_klein import ASSUMPTIONS, mu, phi, rod, sigma, sigma0, x, y, z

kappa = sp.Symbol("kappa", nonnegative=True)
c2 = sp.Symbol("c2", positive=True)  # cos(alpha)^2
_COSINE, _SHORTER, _LENGTH = sp.symbols("c g q", positive=True)


@cache
def displacement() -> sp.Expr:
    """Return delta for R_1 = scale x by Hooke's law and the small angle (2.2), which define x."""
    compression, _ = rod.small_angle()
    elastic = rod.find_scales(rod.elastic_rod()).reaction * x
    return sp.solve(sp.Eq(elastic, rod.k * compression / rod.l), rod.delta)[0]


@cache
def system() -> System:
    """Return the ``System``, symbolic in mu, sigma, sigma_0, kappa and c2 = cos(alpha)^2."""
    scales = rod.find_scales(rod.elastic_rod())
    load, along, across = sp.symbols("r C S")
    angle = rod.alpha + rod.beta
    turned = {rod.R: rod.P * load / _COSINE, sp.cos(angle): _COSINE * along, sp.sin(angle): sp.sin(rod.alpha) * across}
    force = {rod.F: rod.P * phi, sp.tan(rod.alpha): sp.sin(rod.alpha) / _COSINE}
    motion = {name: value.subs(turned) for name, value in rod.force_balance(angle).items()}
    fast = rod.m * (motion[rod.a1] - motion[rod.a2]) / rod.P
    drift = motion[rod.a1] * scales.time / scales.velocity
    bound = motion[rod.N1] / (rod.P * sp.tan(rod.alpha))
    exact = dict(zip((load, along, across), exact_reaction(), strict=True))
    fast, drift, bound = (sp.expand(e.subs(force)).subs(exact) for e in (fast, drift, bound))
    return System.with_friction(slow={x: y}, fast={y: fast}, velocity={z: drift}, force=phi, load=bound,
                                kinetic=sigma + 2, static=sigma0 + 2, small=mu,
                                assumptions=sp.And(*ASSUMPTIONS.args, sp.Ge(kappa, 0), c2 < 1))


def scenes() -> tuple[Scene, ...]:
    """Return the jump of a steep rod that is soft enough for its turn to show."""
    values = {"sigma": 1, "sigma0": 1, "mu": "1e-3", "kappa": "1/2", "c2": "1/4"}
    return (Scene(system=system(), values=values, start=(0, "1/5", -1), until=3, name="nonlinear-rod-jump"),)


@cache
def exact_reaction() -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return r = R cos(alpha) / P, cos(alpha + beta) / cos(alpha) and sin(alpha + beta) / sin(alpha)."""
    compression, turn = rod.geometry()
    rate = displacement().subs(x, y) / rod.find_scales(rod.elastic_rod()).time
    law = rod.k * compression / rod.l + rod.h * rod.k * sp.diff(compression, rod.delta) * rate
    angle = rod.alpha + turn
    wanted = law * sp.cos(rod.alpha) / rod.P, sp.cos(angle) / sp.cos(rod.alpha), sp.sin(angle) / sp.sin(rod.alpha)
    return tuple(map(_nondimensional, wanted))


def _nondimensional(expr):
    """Substitute the length l q and scales; 1 - q becomes (1 - q^2) / (1 + q), which does not cancel for small g."""
    shorter = rod.l * _COSINE * _SHORTER * x
    stiffness = sp.solve(sp.Eq(displacement().subs(sp.cos(rod.alpha), _COSINE), shorter), rod.k)[0]
    expr = expr.replace(lambda e: e.is_Pow and abs(e.exp) == sp.S.Half,
                        lambda root: (rod.l * _LENGTH) ** (2 * root.exp))
    expr = sp.expand(expr.subs({rod.delta: shorter, sp.cos(rod.alpha): _COSINE}).subs(rod.k, stiffness))
    singular = sp.cancel(sp.expand(expr * _SHORTER).subs(_SHORTER, 0) / (1 - _LENGTH))
    regular = sp.factor(sp.expand(expr - singular * (1 - _LENGTH) / _SHORTER))
    square = 1 - _COSINE**2 * (2 * _SHORTER * x - _SHORTER**2 * x**2)
    shortened = sp.cancel(singular * (1 - square) / _SHORTER) / (1 + _LENGTH) + regular
    return shortened.subs(_LENGTH, sp.sqrt(square)).subs({_COSINE: sp.sqrt(c2), _SHORTER: kappa * mu})
