r"""Neimark and Fufaev's brake shoe: a shoe on an arm, pressed on a belt that runs under it.

The arm of the length l is hinged to a carriage of the mass M on a spring, at the height b over the belt, and leans by
theta from the belt's normal; the shoe, a mass m at its end, is pressed by the moment T. The belt runs with the velocity
v. The paradox needs friction above (1 + m / M) tan(theta), and a belt that runs against the arm.
Source: Ju. I. Neimark, N. A. Fufaev, The Painlevé paradoxes and the dynamics of a brake shoe, Journal of Applied
Mathematics and Mechanics (1995); the carriage, an addition of ours, stands for the compliance of its support.
"""

from functools import cache
from math import cos

import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

from asympk.mechanics.mechanism import Contact, Mechanism
from asympk.systems.catalogue import f, on_elastic_contact

X, theta = dynamicsymbols("X theta")
M, m, l, kappa, T, b = sp.symbols("M m l kappa T b", positive=True)
v = sp.Symbol("v", real=True)
VALUES = {"M": 4, "m": 1, "l": 1, "kappa": 1, "T": 1, "v": -1, "b": cos(0.5), "f": 3, "c": "1e-6", "h": "1/2"}
STATE = {"X": 0, "theta": 0.5, "X'": 0, "theta'": 0}
TURN = ("theta", "1/20", "3/2")


@cache
def mechanism() -> Mechanism:
    """Return carriage, arm and shoe; the hinge is at the height b over the belt."""
    t = dynamicsymbols._t
    place = X + l * sp.sin(theta), b - l * sp.cos(theta)
    kinetic = (M * X.diff(t) ** 2 + m * sum(part.diff(t) ** 2 for part in place)) / 2
    shoe = Contact(gap=place[1], slip=place[0] - v * t, friction=f, unilateral=True)
    return Mechanism.from_lagrangian(kinetic - kappa * X**2 / 2, (X, theta), contact=shoe, forces={theta: -T})


system, scenes = on_elastic_contact(mechanism, VALUES, STATE, "1/2", "brake-shoe-jump")
