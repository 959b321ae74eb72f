r"""The Painlevé-Klein rod with unequal masses and a force on the smooth mass too.

Masses m_1 (rough guide) and m_2 (smooth guide) on parallel guides, joined by a rod at the angle alpha; P and S push
them. There is a paradox for f tan(alpha) > (m_1 + m_2) / m_2, and a_N = (S / m_2 - P / m_1) cos(alpha) says on which
side of rest it leaves no motion. Source: P. Painlevé, Leçons sur le frottement, Hermann (1895); F. Klein, Zu Painlevés
Kritik der Coulombschen Reibungsgesetze, Zeitschrift für Mathematik und Physik 58, for equal masses and S = 0.
"""

from functools import cache

import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

from asympk.mechanics.mechanism import Contact, Mechanism
from asympk.systems.catalogue import f, on_elastic_contact

x1, x2 = dynamicsymbols("x1 x2")
m1, m2, alpha, P = sp.symbols("m_1 m_2 alpha P", positive=True)
S = sp.Symbol("S", real=True)
VALUES = {"m_1": 1, "m_2": 2, "alpha": "6/5", "P": 1, "S": "-1/2", "f": 2, "c": "1e-6", "h": "1/2"}
STATE = {"x1": 0, "x2": 0, "x1'": -1, "x2'": -1}
TURN = ("alpha", "1/20", "3/2")


@cache
def mechanism() -> Mechanism:
    """Return the two masses; the gap is the lengthening of the rod, to first order (2.2)."""
    t = dynamicsymbols._t
    kinetic = (m1 * x1.diff(t) ** 2 + m2 * x2.diff(t) ** 2) / 2
    rod = Contact(gap=(x2 - x1) * sp.cos(alpha), slip=x1, friction=f, load=sp.sin(alpha))
    return Mechanism.from_lagrangian(kinetic, (x1, x2), contact=rod, forces={x1: P, x2: S})


system, scenes = on_elastic_contact(mechanism, VALUES, STATE, 3, "unequal-masses-jump")
