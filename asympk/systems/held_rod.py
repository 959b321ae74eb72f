r"""The Painlevé-Klein rod with its smooth mass held by a spring of the stiffness kappa.

The paradox is that of the free rod, f tan(alpha) > 2, wherever the masses are; but the spring makes a_N change its
sign with the place, so that the side of rest that has no motion changes along the guide. Source: the rod of F. Klein,
Zu Painlevés Kritik der Coulombschen Reibungsgesetze, Zeitschrift für Mathematik und Physik 58; the spring is an
addition of ours.
"""

from functools import cache

import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

from asympk.mechanics.mechanism import Contact, Mechanism
from asympk.systems.catalogue import f, on_elastic_contact

x1, x2 = dynamicsymbols("x1 x2")
m, alpha, P, kappa = sp.symbols("m alpha P kappa", positive=True)
VALUES = {"m": 1, "alpha": "6/5", "P": 1, "kappa": 1, "f": 2, "c": "1e-6", "h": "1/2"}
STATE = {"x1": 0, "x2": 0, "x1'": -1, "x2'": -1}
TURN = ("alpha", "1/20", "3/2")


@cache
def mechanism(m: sp.Expr = m, alpha: sp.Expr = alpha, P: sp.Expr = P, kappa: sp.Expr = kappa) -> Mechanism:
    """Return the two masses, the smooth one on its spring; numbers may stand for the symbols."""
    t = dynamicsymbols._t
    lagrangian = m * (x1.diff(t) ** 2 + x2.diff(t) ** 2) / 2 - kappa * x2**2 / 2
    rod = Contact(gap=(x2 - x1) * sp.cos(alpha), slip=x1, friction=f, load=sp.sin(alpha))
    return Mechanism.from_lagrangian(lagrangian, (x1, x2), contact=rod, forces={x1: P})


system, scenes = on_elastic_contact(mechanism, VALUES, STATE, 3, "held-rod-jump")
