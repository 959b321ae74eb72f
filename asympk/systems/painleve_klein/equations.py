r"""The Painlevé-Klein example as a slow-fast system: from the elastic rod to (2.7)-(2.9), for general sigma.

    mu rho'' = 1 - 2 s + phi,    v' = 1 - s + phi,    s = R cos(alpha) / P = rho + rho',

with phi = F / P the friction force, |phi| = (sigma + 2) |s| in slip and at most (sigma_0 + 2) |s| in stick. In the
paper's symbols of section 3, x = rho, y = rho', z = v, and a prime is the derivative by tau = t / (h l). Source: N. A.
Fufaev, Dynamics of the system in the Painlevé-Klein example, Mechanics of Solids (1991), in Russian.
"""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import sympy as sp

from asympk.symbolic.system import System
from asympk.systems.painleve_klein import rod

if TYPE_CHECKING:
    from asympk.mechanics.mechanism import Mechanism
    from asympk.scene import Scene

x, y, z = sp.symbols("x y z", real=True)
mu = sp.Symbol("mu", positive=True)
sigma, sigma0 = sp.symbols("sigma sigma0", real=True)
phi = sp.Symbol("phi", real=True)
_LOAD = sp.Symbol("s", real=True)

ASSUMPTIONS = sp.And(sigma > -2, sigma0 >= sigma)


@dataclass(frozen=True)
class Group:
    """A nondimensional quantity of section 2: its symbol, its definition in physical quantities, and its meaning."""

    symbol: sp.Symbol
    definition: sp.Expr
    meaning: str


@cache
def groups(law: sp.Expr | None = None) -> tuple["Group", ...]:
    """Return the nondimensional groups in the order of the paper; t and x_1 are the physical time and position.

    sigma = f tan(alpha) - 2 is the coefficient of the load in mu rho'' where friction acts along P (2.8). Raises
    ``NotDerivable`` when the rod's ``law`` has no canonical scales.
    """
    scales = rod.find_scales(rod.elastic_rod(law))
    t, x1 = sp.symbols("t x_1", real=True)
    per_load = rod.coulomb().subs(rod.kappa, rod.f) / (rod.R * sp.cos(rod.alpha))
    tangent = per_load.subs(sp.sin(rod.alpha), sp.tan(rod.alpha) * sp.cos(rod.alpha))
    sigma_of = sp.diff(_fast(phi=tangent * _LOAD), _LOAD)
    return (
        Group(sp.Symbol("tau"), t / scales.time, "time"),
        Group(sp.Symbol("rho"), rod.R1 / scales.reaction, "elastic reaction"),
        Group(sp.Symbol("xi"), x1 / scales.length, "position of the rough mass"),
        Group(sp.Symbol("v"), rod.u / scales.velocity, "velocity of the rough mass"),
        Group(mu, scales.mu, "compliance of the rod"),
        Group(sigma, sigma_of, "kinetic friction"),
        Group(sigma0, sigma_of.subs(rod.f, rod.f0), "static friction"),
    )


@cache
def system(law: sp.Expr | None = None) -> System:
    r"""Return the ``System`` (2.7)-(2.9), symbolic in mu, sigma and sigma_0, derived from the rod's ``law``.

    ``law`` is R in terms of ``rod.R1`` and ``rod.dR1``, by default the Kelvin-Voigt law (2.3). Raises
    ``NotDerivable`` for a law that has no canonical scales.
    """
    elastic = rod.elastic_rod(law)
    scales = rod.find_scales(elastic)
    state = {rod.R1: scales.reaction * x, rod.dR1: scales.reaction * y / scales.time}
    load = sp.expand(elastic.law.subs(state, simultaneous=True) * sp.cos(rod.alpha) / rod.P)
    drift = sp.expand(_nondimensional(elastic.acceleration, phi) * scales.time / scales.velocity).subs(_LOAD, load)
    return System.with_friction(slow={x: y}, fast={y: _fast(phi, elastic).subs(_LOAD, load)}, velocity={z: drift},
                                force=phi, load=load, kinetic=sigma + 2, static=sigma0 + 2, small=mu,
                                assumptions=ASSUMPTIONS)


VALUES = {"m": 1, "P": 1, "alpha": "6/5", "f": 2, "f_0": 2}
STATE = {"x1": 0, "x2": 0, "x1'": -1, "x2'": -1}
TURN = ("alpha", "1/20", "3/2")


@cache
def mechanism() -> "Mechanism":
    r"""Return the rod in physical quantities as a ``Mechanism``: the gap is the rod's lengthening (2.2).

    Friction acts on the guide of M_1, with the load R sin(alpha); ``elastic(compliance=1/k, damping=h)`` is (2.4).
    """
    from sympy.physics.mechanics import dynamicsymbols

    from asympk.mechanics.mechanism import Contact, Mechanism

    x1, x2 = dynamicsymbols("x1 x2")
    t = dynamicsymbols._t
    lengthening = -rod.small_angle()[0].subs(rod.delta, x1 - x2)
    contact = Contact(gap=lengthening, slip=x1, friction=rod.f, static=rod.f0, load=sp.sin(rod.alpha))
    kinetic = rod.m * (x1.diff(t) ** 2 + x2.diff(t) ** 2) / 2
    return Mechanism.from_lagrangian(kinetic, (x1, x2), contact=contact, forces={x1: rod.P})


def scenes() -> "tuple[Scene, ...]":
    """Return the scenes of section 3: forward from rest, the jump, and the escape from beyond the divide."""
    from asympk.scene import Scene

    values = {sigma: 1, sigma0: 1, mu: "1e-6"}
    starts = {"forward": (0, 0, 1), "backward": (0, "1/5", -1), "escape": (-1, -1, 1)}
    return tuple(Scene(system=system(), values=values, start=start, until=5, name=n) for n, start in starts.items())


def _nondimensional(expr, phi):
    forces = {rod.R: rod.P * _LOAD / sp.cos(rod.alpha), rod.F: rod.P * phi, rod.ddR1: 0}
    return sp.expand(expr.subs(forces, simultaneous=True))


def _fast(phi, elastic=None):
    return sp.expand(-_nondimensional((elastic or rod.elastic_rod()).balance, phi) / rod.P)
