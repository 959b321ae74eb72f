r"""The classical Painlevé rod: a slender rod whose lower end slides on rough ground.

Under the pressure N the lower end rises with the acceleration p N + a_N, with m p = 1 + 3 cos(theta) (cos(theta) -+
f sin(theta)) and a_N = -g + l theta'^2 sin(theta), l half the length: a paradox for friction above (1 + 3 cos^2)/(3 sin
cos), at least 4/3 where tan(theta) = 2. Source: F. Génot, B. Brogliato, New results on Painlevé paradoxes, European
Journal of Mechanics A/Solids 18 (1999) 653-677.
"""

from functools import cache
from math import cos, sin

import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

from asympk.mechanics.mechanism import Contact, Mechanism
from asympk.scene import Scene
from asympk.systems.catalogue import example_scene, f, on_elastic_contact

X, Y, theta = dynamicsymbols("X Y theta")
m, l, g = sp.symbols("m l g", positive=True)
VALUES = {"m": 1, "l": 1, "g": 1, "f": 2, "c": "1e-6", "h": "1/2"}
STATE = {"X": 0, "Y": sin(1.1), "theta": 1.1, "X'": -1 - 0.2 * sin(1.1), "Y'": 0.2 * cos(1.1), "theta'": 0.2}
TURN = ("theta", "1/20", "3/2")


@cache
def mechanism(unilateral: bool = True) -> Mechanism:
    """Return the rod on the ground; with ``unilateral=False`` its end is a bead on a straight wire."""
    t = dynamicsymbols._t
    lagrangian = m * (X.diff(t) ** 2 + Y.diff(t) ** 2) / 2 + m * l**2 * theta.diff(t) ** 2 / 6 - m * g * Y
    end = Contact(gap=Y - l * sp.sin(theta), slip=X - l * sp.cos(theta), friction=f, unilateral=unilateral)
    return Mechanism.from_lagrangian(lagrangian, (X, Y, theta), contact=end)


system, _jump = on_elastic_contact(mechanism, VALUES, STATE, "1/2", "painleve-rod-jump")


def scenes() -> tuple[Scene, ...]:
    """Return a slide into impact without collision, and a rigid slide into the singular point."""
    slide = {**STATE, "theta": 0.6, "Y": sin(0.6), "theta'": 0.1, "X'": -5 - 0.1 * sin(0.6), "Y'": 0.1 * cos(0.6)}
    return (
        *_jump(),
        example_scene(mechanism(), mechanism().rigid(), {**VALUES, "f": "8/5"}, slide, "1/2", "painleve-rod-rigid"),
    )
