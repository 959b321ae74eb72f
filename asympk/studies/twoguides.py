r"""Two contacts at once: the rod of Painlevé and Klein with both of its guides rough.

With the velocity w = z - mu y of the second mass, s = x + y and a friction on either guide,

    mu y' = 1 - 2 s + phi_1 - phi_2,   z' = 1 - s + phi_1,   |phi_1| <= (sigma + 2) |s|,   |phi_2| <= kappa |s|,

where kappa = f_2 tan(alpha) belongs to the guide of the second mass. Both frictions have the same load s. For
kappa = 0 the system is the rod of ``systems.painleve_klein``.
"""

from functools import cache
from typing import Any

import sympy as sp

from asympk.methods import solve
from asympk.path import Path
from asympk.scene import Scene
from asympk.storage.rows import Row
from asympk.studies.compare import workprec
from asympk.symbolic.system import Friction, System
from asympk.systems import painleve_klein as pk

KAPPA = "1/2"
START, UNTIL = (0, -3, 1), 1  # beyond the divide: both masses stop, and the second one twice
NAME = "two rough guides"
kappa, phi_2 = sp.Symbol("kappa", positive=True), sp.Symbol("phi_2", real=True)


@cache
def system() -> System:
    """Return the ``System`` of the rod between two rough guides, symbolic in mu, sigma, sigma_0 and kappa."""
    rod = pk.system()
    (first,) = rod.frictions
    second = Friction(velocity=pk.z - pk.mu * pk.y, force=phi_2, load=first.load, kinetic=kappa)
    fast = {pk.y: rod.fast[pk.y] - phi_2}
    return System.with_frictions(rod.slow, fast, (first, second), small=pk.mu, assumptions=rod.assumptions)


def scene(mu: Any, second: Any = KAPPA) -> Scene:
    """Return the rod with sigma = sigma_0 = 1 from ``START`` = (x, y, z); ``second`` is kappa."""
    values = {pk.sigma: 1, pk.sigma0: 1, pk.mu: mu, kappa: second}
    return Scene(system=system(), values=values, start=dict(zip("xyz", START, strict=True)), until=UNTIL, name=NAME)


def measure(mu: Any, **options: Any) -> list[Row]:
    """Return the rows of ``compare.workprec`` with its ``options``, the exact path to 30 digits as reference.

    The unit of cost is the exact flow of the rod with one rough guide, from the same start.
    """
    here = scene(mu)
    with_one = Scene(1, mu, START, UNTIL, name=NAME)

    def follow(_: Scene, method: str, **given: Any) -> Path:
        return solve(here, method, **given)

    return workprec(with_one, reference=solve(here, digits=30), follow=follow, **options)
