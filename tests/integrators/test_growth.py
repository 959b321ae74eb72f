"""What is known of the errors of a run from its steps."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.automaton.loop import Segment
from asympk.integrators.growth import without_rounding
from asympk.path import predicted_error

x, y, u, v, F = sp.symbols("x y u v F", real=True)


def test_a_state_that_moves_from_zero_at_once_is_found_from_the_first_step():
    asked = []
    mode = SimpleNamespace(rhs=lambda t, state: asked.append(t) or (1.0,))
    automaton = SimpleNamespace(mode=lambda branch, sides: mode)
    segments = [Segment(1.0, (1.0,), None, steps=tuple((k / 100, (k / 100,)) for k in range(101)))]
    assert without_rounding(automaton, segments) is segments
    assert asked == [0]


def _orbits():
    """Return a circular orbit of Kepler, and where it is after three periods."""
    cubed = (x**2 + y**2) ** sp.Rational(3, 2)
    return ap.System.smooth({x: u, y: v, u: -x / cubed, v: -y / cubed}, {}, None), (1, 0, 0, 1), 6 * math.pi


def _belt(speed):
    """Return a block on a belt, on which Stribeck's friction falls from 1/2 as the root of the sliding velocity."""
    kinetic = (3 + 2 * sp.exp(-sp.sqrt(20 * sp.Abs(v - 1)))) / 10
    belt = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=kinetic, static=sp.S.Half)
    return ap.System.with_frictions({x: v, v: F - x}, {}, [belt]), (0, speed), 2


@pytest.mark.parametrize(("scene", "truth"), [(_orbits(), (1, 0, 0, 1)), (_belt(1), None), (_belt(sp.S.Half), None)])
def test_the_error_that_an_integrated_motion_says_bounds_its_true_one_within_two_digits(scene, truth):
    system, start, until = scene
    scene = ap.Scene(system=system, start=start, until=until)
    path = ap.solve(scene)
    wrong = np.abs(np.subtract(path.final, truth or [*map(float, ap.solve(scene, digits=16).final)])).max()
    assert wrong < path.error < 100 * wrong
    assert predicted_error(path) == f"{path.error:.1e}"


@pytest.mark.parametrize("small", ["1e-30", "1e-60"])
def test_errors_of_a_run_do_not_grow_however_fast_its_layers_fade(small):
    """The rounding of fast parts grew: such runs were refused, as if they kept to a repelling set."""
    mu, start = sp.Symbol("mu", positive=True), {x: 1, y: 1, u: 0, v: 0}
    system = ap.System.smooth({x: -x + u, y: -y + u * v}, {u: x - u - u**3 / 3 + v / 5, v: y - 2 * v - u / 3}, mu)
    path, jump = (ap.solve(ap.Scene(system=system, values={mu: small}, start=start, until=1), method)
                  for method in ("exact", "jump"))
    assert np.abs(np.subtract(path.final, jump.final)).max() < path.error < 1e-7
