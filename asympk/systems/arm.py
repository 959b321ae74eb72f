r"""A two-link arm that pushes on a rough surface: a robot's hand, or a finger that wipes.

Two slender links of the length 1 and the mass m, shoulder at the height b_0 over the surface, angles a and b of
the links from the vertical. The frame turns the upper link with the moment S and, by a belt over the shoulder, the
lower one with the moment E. Source: an example of ours; for arms that jam, P. E. Dupont, S. P. Yamajako, Jamming and
wedging in constrained rigid-body dynamics, IEEE Conference on Robotics and Automation (1994).
"""

from functools import cache
from math import acos, cos, sin

import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

from asympk.mechanics.mechanism import Contact, Mechanism
from asympk.systems.catalogue import f, on_elastic_contact

a, b = dynamicsymbols("a b")
m, height = sp.symbols("m b_0", positive=True)
S, E = sp.symbols("S E", real=True)
_TILT = acos(1 - cos(1.25))
VALUES = {"m": 1, "b_0": 1, "S": "-3", "E": "-1", "f": 2, "c": "1e-6", "h": "1/2"}
STATE = {"a": 1.25, "b": _TILT, "a'": -0.2, "b'": 0.2 * sin(1.25) / sin(_TILT)}
TURN = ("a", "1/20", "3/2")


@cache
def mechanism() -> Mechanism:
    """Return the arm; its tip is at the depth cos(a) + cos(b) below the shoulder."""
    t = dynamicsymbols._t
    turning = 4 * a.diff(t) ** 2 + b.diff(t) ** 2 + 3 * a.diff(t) * b.diff(t) * sp.cos(a - b)
    tip = Contact(gap=height - sp.cos(a) - sp.cos(b), slip=sp.sin(a) + sp.sin(b), friction=f, unilateral=True)
    return Mechanism.from_lagrangian(m * turning / 6, (a, b), contact=tip, forces={a: S, b: E})


system, scenes = on_elastic_contact(mechanism, VALUES, STATE, "1/5", "arm-wipe")
