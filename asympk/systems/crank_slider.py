r"""A slider-crank with dry friction in the slider's guide.

A crank of the radius r and the inertia J drives a slider of the mass m through a massless rod of the length l; the
guide holds the slider both ways. Angles: theta of the crank, phi of the rod. Where rod and crank stand so that the rod
pushes the slider steeply into its guide, friction jams it. Source: an example of ours; for such mechanisms, Le Suan An
(Le xuan Anh), Dynamics of Mechanical Systems with Coulomb Friction, Springer (2003).
"""

from functools import cache
from math import asin, cos, sin

import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

from asympk.mechanics.mechanism import Contact, Mechanism
from asympk.systems.catalogue import f, on_elastic_contact

theta, phi = dynamicsymbols("theta phi")
J, m, r, l = sp.symbols("J m r l", positive=True)
T = sp.Symbol("T", real=True)
_PHI = asin(sin(1.0) / 1.2)
VALUES = {"J": 2, "m": 1, "r": 1, "l": "6/5", "T": 1, "f": 3, "c": "1e-6", "h": "1/2"}
STATE = {"theta": 1.0, "phi": _PHI, "theta'": 1.0, "phi'": cos(1.0) / (1.2 * cos(_PHI))}
TURN = ("theta", "1/20", "3")


@cache
def mechanism() -> Mechanism:
    """Return crank, rod and slider; the gap is the slider's height over the axis of its guide."""
    t = dynamicsymbols._t
    along, across = r * sp.cos(theta) + l * sp.cos(phi), r * sp.sin(theta) - l * sp.sin(phi)
    kinetic = (J * theta.diff(t) ** 2 + m * (along.diff(t) ** 2 + across.diff(t) ** 2)) / 2
    guide = Contact(gap=across, slip=along, friction=f)
    return Mechanism.from_lagrangian(kinetic, (theta, phi), contact=guide, forces={theta: T})


system, scenes = on_elastic_contact(mechanism, VALUES, STATE, "1/4", "crank-slider-stroke")
