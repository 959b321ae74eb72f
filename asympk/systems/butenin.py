r"""Pfeiffer and Butenin: the Painlevé-Klein rod with an elastic rod that has no damping, compliance eps^2.

On the good side the rod rings, a centre; on the other side of the paradox the equilibrium is a saddle. Both x and
y = eps x' are fast. Source: F. Pfeiffer, Zur Frage der sogenannten Coulombschen Reibungsgesetze, Zeitschrift für
Mathematik und Physik 58; N. V. Butenin, Prikl. Mat. Mekh. 12 (1948), for the jump and the phase plane (R, R').
"""

from functools import cache

from asympk.mechanics.mechanism import Mechanism
from asympk.scene import Scene
from asympk.symbolic.system import System
from asympk.systems import painleve_klein
from asympk.systems.catalogue import Turn, eps, example_scene

VALUES = {"m": 1, "P": 1, "alpha": "6/5", "f": 2, "f_0": 2, "eps": "1e-2"}
STATE = {"x1": 0, "x2": 0, "x1'": -1, "x2'": -1}
TURN: Turn = ("alpha", "1/20", "3/2", {})


def mechanism() -> Mechanism:
    """Return the two masses of Painlevé and Klein."""
    return painleve_klein.mechanism()


@cache
def system() -> System:
    """Return the masses with an elastic rod without damping; the small parameter is the root of its compliance."""
    return mechanism().elastic(compliance=eps**2, damping=0)


def scenes() -> tuple[Scene, ...]:
    """Return the jump of Butenin: from a slide without a rigid motion to rest, the rod ringing."""
    return (example_scene(mechanism(), system(), VALUES, STATE, "1/10", "butenin-jump"),)
