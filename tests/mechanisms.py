"""Mechanisms that several tests share, each in the form that a mechanician would write down."""

from functools import cache

import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap

T = dynamicsymbols._t
X, Y, THETA = dynamicsymbols("X Y theta")
m, l, g, J, f = sp.symbols("m l g J f", positive=True)

# the slender rod below, as a user writes it in a file
SLENDER_ROD = """\
coordinates = ["X", "Y", "theta"]
lagrangian = "m*(X'^2 + Y'^2)/2 + m*l^2*theta'^2/6 - m*g*Y"
gap = "Y - l*sin(theta)"
slip = "X - l*cos(theta)"
friction = "f"
unilateral = true
"""
FALLING_BALL = """\
coordinates = ["X", "Y"]
lagrangian = "m*(X'^2 + Y'^2)/2 - m*g*Y"
gap = "Y"
slip = "X"
friction = "f"
unilateral = true
until = 2
compliance = "eps^2"
damping = "eps"
values = {m = 1, g = 1, f = 0.3, eps = 0.1}
state = {X = 0, Y = 1, "X'" = 1, "Y'" = 0}
"""
ON_HIGH_GROUND = SLENDER_ROD.replace("m*g*Y", "m*g*(Y - H)").replace("Y - l*sin", "Y - H - l*sin") + """\
compliance = "c"
damping = "h"
[values]
m = 1
l = 1
g = 1
f = 2
c = 0.125
h = 1
H = {height}
[state]
X = 0
Y = {centre}
theta = 0
"X'" = -1
"Y'" = 0
"theta'" = 0
"""  # the slender rod, lying on ground at a height H, which no rate contains


@cache
def slender_rod(unilateral=True, **contact):
    """A uniform rod of the length 2 l whose lower end slides on rough ground, by its centre (X, Y) and its angle."""
    kinetic = m * (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + m * l**2 / 6 * THETA.diff(T) ** 2
    end = {"gap": Y - l * sp.sin(THETA), "slip": X - l * sp.cos(THETA), "friction": f, "unilateral": unilateral}
    return ap.Mechanism.from_lagrangian(kinetic - m * g * Y, (X, Y, THETA), contact=ap.Contact(**{**end, **contact}))


@cache
def masses_between_guides():
    """Painlevé and Klein: two masses on parallel guides, pushed by P; friction on the guide of the first."""
    x1, x2 = dynamicsymbols("x1 x2")
    P, alpha = sp.symbols("P alpha", positive=True)
    kinetic = m * (x1.diff(T) ** 2 + x2.diff(T) ** 2) / 2
    contact = ap.Contact(gap=(x2 - x1) * sp.cos(alpha), slip=x1, friction=f, load=sp.sin(alpha))
    return ap.Mechanism.from_lagrangian(kinetic, (x1, x2), contact=contact, forces={x1: P})


@cache
def chain(n):
    """A chain of n equal links that hangs at the origin, its end on rough ground at the depth H."""
    angles = dynamicsymbols(f"q1:{n + 1}")
    energy, (x, y) = energy_of_chain(angles)
    ground = ap.Contact(gap=y + sp.Symbol("H", positive=True), slip=x, friction=f, unilateral=True)
    return ap.Mechanism.from_lagrangian(energy, angles, contact=ground)


def energy_of_chain(angles):
    """Return the Lagrangian and the end of a chain of equal links that hangs at the origin."""
    x, y, energy = sp.S.Zero, sp.S.Zero, sp.S.Zero
    for q in angles:
        middle, height = x + l * sp.sin(q) / 2, y - l * sp.cos(q) / 2
        energy += m * (middle.diff(T) ** 2 + height.diff(T) ** 2) / 2 + J * q.diff(T) ** 2 / 2 - m * g * height
        x, y = x + l * sp.sin(q), y - l * sp.cos(q)
    return energy, (x, y)


CORNER = sp.Matrix([3, -2, -4]) / 10


def turned(angles):
    """Return the matrix of the rotation by three angles, about z, the new y and the new x."""
    a, b, c = angles
    return sp.rot_ccw_axis3(a) * sp.rot_ccw_axis2(b) * sp.rot_ccw_axis1(c)


@cache
def spatial_body():
    """A body with three moments of inertia A, B, C in Euler angles; one corner slides on the ground along X."""
    places, angles, moments = dynamicsymbols("X Y Z"), dynamicsymbols("a b c"), sp.symbols("A B C", positive=True)
    R = turned(angles)
    W = R.T * R.diff(T)
    spin, corner = (W[2, 1], W[0, 2], W[1, 0]), sp.Matrix(places) + R * CORNER
    kinetic = sum(m * q.diff(T) ** 2 for q in places) + sum(J * w**2 for J, w in zip(moments, spin, strict=True))
    ground = ap.Contact(gap=corner[2], slip=corner[0], friction=f, unilateral=True)
    return ap.Mechanism.from_lagrangian(kinetic / 2 - m * g * places[2], (*places, *angles), contact=ground)


@cache
def crank_with_clearance():
    """A crank of the length r whose pin slides in the bush, wider by e, of a rod by its bush (X, Y) and its angle b."""
    a, b = dynamicsymbols("a b")
    r, e = sp.symbols("r e", positive=True)
    middle = (X + l * sp.cos(b) / 2, Y + l * sp.sin(b) / 2)
    kinetic = J * a.diff(T) ** 2 / 2 + J * b.diff(T) ** 2 / 2 + m * sum(p.diff(T) ** 2 for p in middle) / 2
    x, y = X - r * sp.cos(a), Y - r * sp.sin(a)
    apart = sp.sqrt(x**2 + y**2)
    slip = (x * (Y.diff(T) - r * sp.cos(a) * a.diff(T)) - y * (X.diff(T) + r * sp.sin(a) * a.diff(T))) / apart
    bush = ap.Contact(gap=e - apart, slip=slip, friction=f, unilateral=True)
    return ap.Mechanism.from_lagrangian(kinetic - m * g * middle[1], (a, b, X, Y), contact=bush)
