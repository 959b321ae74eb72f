"""The automaton of a scene: a parameter in an exponent counts as the number that the scene has for it."""

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.certify import certify
from asympk.errors import InputError
from asympk.symbolic.placing import with_numbers_inside

x, v, F, a, n = sp.symbols("x v F a n", real=True)
X, V = sp.symbols("X V")
mu = sp.Symbol("mu", positive=True)


def _stribeck(power):
    """A spring drags a block from rest on a belt, with Stribeck's friction."""
    kinetic = (3 + 2 * sp.exp(-((20 * sp.Abs(v - 1)) ** power))) / 10
    belt = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=kinetic, static=sp.S.Half)
    return ap.System.with_frictions({x: v, v: F - x}, {}, [belt])


def _hertz(power):
    return ap.System.with_frictions({x: v, v: -sp.sign(x) * sp.Abs(x) ** power - v / 10}, {}, [])


def _hill(power):
    return ap.System.with_frictions({X: 1 - X + 2 * V**power / (1 + V**power), V: X - V}, {}, [])


def _power(power):
    return ap.System.with_frictions({X: X**power - V, V: X}, {}, [])


def _spring(power):
    slide = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=sp.S.Half)
    return ap.System.with_frictions({x: v, v: F - a * x**power}, {}, [slide])


CASES = [
    *((_stribeck, (0, 1), power) for power in ("1/2", "3/2", 1, 2)),
    *((_hertz, (1, 0), power) for power in ("3/2", "1/2", 1, 2)),
    *((_hill, (0, 0), power) for power in ("1/2", "5/2", 2, 3)),
    *((_power, start, power) for start, power in ((("-1/2", 0), 1), (("-1/2", 0), 2), (("-1/2", 0), 3), ((1, 0), -1))),
]


@pytest.mark.parametrize("method", ["exact", "lsoda"])
@pytest.mark.parametrize(("law", "start", "power"), CASES)
def test_a_parameter_in_an_exponent_is_followed_as_its_number(law, start, power, method):
    given, known = (ap.solve(ap.Scene(system=law(p), values=values, start=start, until=2), method)
                    for p, values in ((n, {n: power}), (sp.Rational(power), {})))
    assert (given.final, given.model, given.modes) == (known.final, known.model, known.modes)


@pytest.mark.further
@pytest.mark.parametrize(("law", "start", "power"), [CASES[i] for i in (0, 1, 4, 5, 6, 12, 13)])
def test_a_parameter_in_an_exponent_is_followed_in_digits_as_its_number(law, start, power):
    given, known = (ap.solve(ap.Scene(system=law(p), values=values, start=start, until=2), digits=20).final
                    for p, values in ((n, {n: power}), (sp.Rational(power), {})))
    assert given == known


def test_models_take_a_fraction_in_an_exponent():
    """V**n has no Taylor series where V = 0, but V**(5/2) has the terms that the first order needs."""
    paths = [ap.solve(ap.Scene(system=ap.System.smooth({X: 2 * V**power / (1 + V**power) - X}, {V: X - V}, mu),
                               values={mu: "1/1000", **values}, start=(1, 0), until=1), "jump", order=1)
             for power, values in ((n, {n: "5/2"}), (sp.Rational(5, 2), {}))]
    assert paths[0].final == paths[1].final


def test_arrays_and_certificates_take_an_exponent_that_makes_a_system_affine():
    starts = np.linspace(0, 1, 5)
    finals = [ap.solve_many(system=system, values={a: 1, **values}, start={x: starts, v: 0}, until=3).final
              for system, values in ((_spring(n), {n: 1}), (_spring(1), {}))]
    np.testing.assert_array_equal(*finals)
    with pytest.raises(InputError, match="systems whose modes are all affine"):
        ap.solve_many(system=_spring(n), values={a: 1, n: [1, 2]}, start={x: 0, v: 0}, until=3)
    scene = ap.Scene(system=_spring(n), values={a: 1, n: 1}, start=(0, 0), until=3)
    assert certify(scene, {"a": ("0.99", "1.01")}).proven
    for ends in ((1, 2), (2, 2)):
        with pytest.raises(InputError, match="the rate of v is not affine"):
            certify(scene, {"n": ends})


def test_a_number_too_large_for_a_power_to_be_multiplied_out_stays_a_parameter():
    system = _hill(n)
    assert with_numbers_inside(system, (10**6,)) == (system, (10**6,))
    assert with_numbers_inside(system, (30,)) == (_hill(30), ())
