"""Series of motions, and what they decide where formulas of derivatives are too long or too few."""

import math
from itertools import islice

import mpmath
import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.automaton.contacts import DOUBLES, Numbers, Place
from asympk.automaton.modes import mode_of
from asympk.automaton.motionseries import derivatives_along
from asympk.symbolic.branches import mode_name
from asympk.systems.automata import automaton_of

MPMATH = Numbers("mpmath", mpmath, mpmath.mpf, -1.0)


@pytest.mark.parametrize("numbers", [DOUBLES, MPMATH])
def test_derivatives_along_a_motion_are_those_of_its_closed_form(numbers):
    """x = 1/(1 - a t), y = pi sin(t) and z = log(1 + t) from t = 0 on."""
    x, y, z, a, t = sp.symbols("x y z a t", real=True)
    system = ap.System.with_frictions({x: a * x**2, y: sp.pi * sp.cos(t), z: sp.exp(-z)}, {}, [], time=t)
    place = Place(numbers, numbers.convert(0), tuple(map(numbers.convert, (1, 0, 0))), (numbers.convert(2),))
    known = [sp.series(e, t, 0, 9).removeO() for e in (1 / (1 - 2 * t), sp.pi * sp.sin(t), sp.log(1 + t))]
    expected = [float(sum(e.coeff(t, k) for e in known) * sp.factorial(k)) for k in range(9)]
    found = islice(derivatives_along(mode_of(system, ()), place, (x + y + z,)), 9)
    assert [value for (value,) in found] == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("numbers", [DOUBLES, MPMATH])
def test_derivatives_along_a_motion_of_functions_with_constants_or_two_arguments_are_known(numbers):
    """The slope of erf has a pi that the formula has not, and atan2 takes two numbers: both were raw errors."""
    x = sp.Symbol("x", real=True)
    exprs, system = (sp.erf(x), sp.atan2(x, 1 - x)), ap.System.with_frictions({x: 1}, {}, [])
    place = Place(numbers, numbers.convert(0), (numbers.convert(0),), ())
    for k, values in enumerate(islice(derivatives_along(mode_of(system, ()), place, exprs), 8)):
        known = [float(e.diff(x, k).subs(x, 0)) for e in exprs]
        assert list(map(float, values)) == pytest.approx(known, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("numbers", [DOUBLES, MPMATH])
def test_a_series_of_a_motion_ends_before_a_derivative_that_is_not_finite(numbers):
    """The sign of a NaN was taken for -1: friction against s^(17/3) - s^(16/3) had no motion."""
    x = sp.Symbol("x", real=True)
    system = ap.System.with_frictions({x: 1}, {}, [])
    place = Place(numbers, numbers.convert(0), (numbers.convert(0),), ())
    found = derivatives_along(mode_of(system, ()), place, (x ** sp.Rational(17, 3) - x ** sp.Rational(16, 3),))
    with pytest.raises((ArithmeticError, ValueError)):
        assert all(value == 0 for (value,) in islice(found, 9))


@pytest.mark.parametrize("order", [7, 14])
def test_rest_ends_at_whatever_order_a_push_leaves_the_bound_of_friction(order):
    """A push 1 + t^n/n! against friction 1 moves a block by t^(n + 1)/(n + 1)!; from n = 7 on it was refused."""
    x, v, F, *c = sp.symbols(f"x v F c1:{order + 1}", real=True)
    chain = dict(zip(c, (*c[1:], sp.S.One), strict=True))
    system = ap.System.with_frictions({x: v, v: 1 + c[0] + F, **chain}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    path = ap.solve(ap.Scene(system=system, start=[0] * len(system.states), until=1))
    assert path.modes == ("slip_same",)
    assert path.final[1] == pytest.approx(1 / math.factorial(order + 1))


@pytest.mark.further
@pytest.mark.parametrize(("power", "sunk"), [(1, 0), (2, sp.Rational(1, 20000))])
def test_a_table_on_two_elastic_feet_begins_to_slip_on_the_rear_one_at_any_push(power, sunk):
    """Its feet part by the angle times its rate, of order 3 + 2 power in time: no other mode was refuted."""
    X, Y, theta = dynamicsymbols("X Y theta")
    t, eps = dynamicsymbols._t, sp.Symbol("eps", positive=True)
    energy = (X.diff(t) ** 2 + Y.diff(t) ** 2) / 2 + theta.diff(t) ** 2 / 6 - Y
    feet = [ap.Contact(Y + side * sp.sin(theta) - sp.cos(theta) / 2, X + side * sp.cos(theta) + sp.sin(theta) / 2,
                       sp.Rational(2, 5), unilateral=True) for side in (-1, 1)]
    table = ap.Mechanism.from_lagrangian(energy, (X, Y, theta), contact=feet[0], others=feet[1:], forces={X: t**power})
    system = table.elastic(compliance=eps**2, damping=eps / 2)
    at_rest = dict.fromkeys(("X", "theta", "X'", "Y'", "theta'"), 0) | {"Y": sp.Rational(1, 2) - sunk}
    start = table.start(system, at_rest | {"eps": "1/100"})
    scene = ap.Scene(system=system, values={eps: "1/100"}, start=start, until=1)
    assert mode_name(automaton_of(scene).first(scene.start)) == "slip_same+stick"


def test_a_push_that_leaves_the_bound_of_friction_by_two_roots_ends_rest_though_a_derivative_is_oo_minus_oo():
    x, v, F, t = sp.symbols("x v F t", real=True)
    push = 1 + t ** sp.Rational(16, 3) - t ** sp.Rational(17, 3)
    system = ap.System.with_frictions({x: v, v: push + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=1))
    assert path.modes == ("slip_same",)
    assert path.final[1] == pytest.approx(3 / 19 - 3 / 20, abs=1e-9)
