r"""The rod without damping, R = R_1, that Pfeiffer and Butenin followed.

    epsilon^2 s'' = 1 - 2 s + phi,    v' = 1 - s + phi,    s = R cos(alpha) / P,

with w = epsilon s'. In the unit of time the force P gives the mass the unit of velocity. The scales of Fufaev need
damping, and the undamped rod has none of its own: epsilon, its period over 2 pi, is measured in this unit of time.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache

import sympy as sp

from asympk.ledger.runs import M, followed_precisely
from asympk.numbers import Number
from asympk.path import Path
from asympk.scene import Scene
from asympk.symbolic.system import System
from asympk.systems.painleve_klein import rod

s, w, v, phi = sp.symbols("s w v phi", real=True)
epsilon = sp.Symbol("epsilon", positive=True)
sigma = sp.Symbol("sigma", real=True)


@cache
def undamped_system() -> System:
    """Return the ``System`` of the undamped rod, derived from the rod's law R = R_1."""
    elastic = rod.elastic_rod(rod.R1)
    forces = {rod.R: rod.P * s / sp.cos(rod.alpha), rod.F: rod.P * phi, rod.ddR1: 0}
    balance, acceleration = (expr.subs(forces) for expr in (elastic.balance, elastic.acceleration))
    return System.with_friction(slow={}, fast={s: w, w: sp.expand(-balance / rod.P)},
                                velocity={v: sp.expand(rod.m * acceleration / rod.P)}, force=phi, load=s,
                                kinetic=sigma + 2, static=sigma + 2, small=epsilon)


def fast_eigenvalues(mode: str) -> set[sp.Expr]:
    """Return the set of the eigenvalues of one slip mode in the fast time t / epsilon."""
    field = undamped_system().mode(mode).fast
    return set(sp.Matrix([field[s], field[w]]).jacobian([s, w]).eigenvals())


def precise_undamped_path(start: Sequence[Number], small: Number, until: Number) -> Path:
    """Follow (s, w, v) at sigma = 1 to 40 digits; ``small`` and ``until`` are exact numbers."""
    return followed_precisely(undamped_scene(start, small, until))


def rings_on(start: Sequence[Number], small: Fraction) -> bool:
    """Tell whether a motion from s = 1/5 +- 1/10, s' = 0 in s v > 0 has its amplitude still after 20 epsilon."""
    load, rate, _ = precise_undamped_path(start, small, 20 * small).final
    return bool(abs((5 * load - 1) ** 2 + 5 * rate**2 - M.mpf(1) / 4) < M.mpf(10) ** -30)


def undamped_scene(start: Sequence[Number], small: Number, until: Number) -> Scene:
    """Return the ``Scene`` of (s, w, v) at sigma = 1."""
    begin = dict(zip("swv", start, strict=True))
    return Scene(system=undamped_system(), values={"epsilon": small, "sigma": 1}, start=begin, until=until)


def growth_time(small: Fraction, ratio: Number) -> Number:
    """Return epsilon log(ratio), the time in which the growing motion of sigma = 1 gains a factor ``ratio``."""
    return M.mpf(small.numerator) / small.denominator * M.log(ratio)
