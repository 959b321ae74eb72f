"""What is looked at within a step: guards that may come to zero there, and no others."""

import math

import pytest
import sympy as sp

import asympk as ap
from asympk.automaton.automaton import Automaton
from asympk.integrators.collocation import _root
from asympk.integrators.stepwise import Watch, bracketed
from asympk.integrators.watch import GuardSample, first_lost
from asympk.symbolic.branches import Phase


def lost(value, rate, low, high, asked=None, touch=0):
    looks = (GuardSample(t, [value(t)], [rate(t)]) for t in (low, high))

    def values(t):
        assert asked is None or asked.append(t) is None
        return [value(t)]

    return first_lost(*looks, values, lambda t: [rate(t)], bracketed,
                      touches=lambda t, k: abs(values(t)[k]) < touch)


@pytest.mark.parametrize("depth", [1e-12, 1e-3, 0.3])
def test_a_guard_that_leaves_and_comes_back_within_a_step_is_lost_where_it_leaves(depth):
    t, guard = lost(lambda t: t * t - depth, lambda t: 2 * t, -1, 1)
    assert (t, guard) == (pytest.approx(-(depth**0.5), rel=1e-12), 0)


@pytest.mark.parametrize("depth", [-1e-13, 0, 1e-13])
def test_a_guard_that_comes_as_near_to_zero_as_its_rounding_is_lost_where_it_turns(depth):
    t, guard = lost(lambda t: (t - 0.3) ** 2 - depth, lambda t: 2 * (t - 0.3), -1, 1, touch=1e-12)
    assert (t, guard) == (pytest.approx(0.3, rel=1e-12), 0)
    assert lost(lambda t: t * t + 1e-11, lambda t: 2 * t, -1, 1, touch=1e-12) is None


def test_a_guard_that_falls_through_a_multiple_root_is_lost_there():
    t, guard = lost(lambda t: math.sin(t) ** 3, lambda t: 3 * math.sin(t) ** 2 * math.cos(t), 1, 4)
    assert (t, guard) == (pytest.approx(math.pi, rel=1e-12), 0)


@pytest.mark.parametrize("root", [bracketed, lambda *given: _root(*given, 1e-15)])
@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-1.0, 0.0)])
@pytest.mark.parametrize("slope", [-1, 1])
def test_a_function_that_vanishes_at_an_end_has_its_root_there(root, low, high, slope):
    assert root(lambda t: slope * t * (1 + t * t), low, high) == 0


def test_a_guard_that_grows_from_zero_is_not_lost_within_a_step_of_the_rounding_of_its_time():
    # steps too short for the time to move have come before: the polynomial begins at another value
    begin, end = 1.0, math.nextafter(1, 2)
    looks = GuardSample(begin, [1e-4], [1e20]), GuardSample(end, [1e4], [1e20])
    assert first_lost(*looks, lambda t: [-3.5 + 1e20 * (t - begin)], lambda t: [1e20], bracketed) is None


def test_a_guard_far_off_its_zero_that_trembles_with_the_steps_is_not_searched_for():
    asked = []
    assert lost(lambda t: 1 + 1e-6 * t * t, lambda t: 2e-6 * t, -1, 1, asked) is None
    assert asked == []


def test_a_guard_that_falls_ten_times_as_fast_within_a_step_as_at_its_ends_is_lost():
    """g = 1.8 - 2 (1 - t^2)^2 (1 + t^2 / 8) - (1 - t^2) / 10 falls by 0.2 at the ends, by 3 between them."""
    def value(t):
        return 1.8 - 2 * (1 - t * t) ** 2 * (1 + t * t / 8) + 0.1 * (t * t - 1)

    def rate(t):
        return 8 * t * (1 - t * t) * (1 + t * t / 8) - t * (1 - t * t) ** 2 / 2 + 0.2 * t

    t, guard = lost(value, rate, -1, 1)
    assert guard == 0
    assert value(t) == pytest.approx(0, abs=1e-12)
    assert t < 0


@pytest.mark.parametrize("low", [-1.0, -0.9, -0.5])
def test_a_guard_that_the_error_of_a_step_left_below_zero_is_lost_where_it_falls(low):
    assert lost(lambda t: 0.25 - t * t, lambda t: -2 * t, low, 1) == (pytest.approx(0.5, rel=1e-12), 0)
    assert lost(lambda t: 0.25 - t * t, lambda t: -2 * t, low, -0.1) is None
    assert lost(lambda t: -1e-11 - t * t, lambda t: -2 * t, low, 1) == (pytest.approx(0, abs=1e-12), 0)


def test_a_guard_that_is_rounding_at_the_start_of_a_mode_counts_as_0():
    """0.1 + 0.2 - 0.3 is 5.6e-17: where its rate is rounding below 0, a slip that grows was lost as it began."""
    u, v, w, force = sp.symbols("u v w F", real=True)
    friction = ap.Friction(velocity=u + v + w, force=force, load=1, kinetic=1)
    system = ap.System.with_frictions({u: force, v: 1, w: -v}, {}, [friction])
    mode = Automaton(system, ()).mode((Phase(1, 1),))
    assert [Watch(mode, 0.0, (0.1, 0.2, third)).last.values for third in (-0.3, -0.5, 0.1)] == [
        [0.0], [0.0], [pytest.approx(0.4)]]


@pytest.mark.parametrize("method", ["exact", "radau"])
@pytest.mark.parametrize("n", ["-3/10", "-1/7", "-1/81"])
@pytest.mark.parametrize("unit", [1, sp.Rational(98765432101, 3)])
def test_a_friction_that_can_just_bear_its_force_as_its_load_turns_goes_on_sticking(method, n, unit):
    """To stick it needs 3/5, and 3/5 (1 + n^2) is at most borne: as n passes 0 it slipped by rounding, in any unit."""
    v, m, p, force = sp.symbols("v m p force", real=True)
    mu = sp.Symbol("mu", positive=True)
    rough = ap.Friction(v - sp.Rational(1, 5), force, unit * (1 + m**2), sp.Rational(2, 5), sp.Rational(3, 5))
    push = force / unit
    belt = ap.System.with_frictions({v: push / 3 - v}, {p: v - p - p**3, m: p * v + push / 5 - 2 * m},
                                    [rough], small=mu)
    start = {v: "1/5", p: "5/18", m: n}
    path = ap.solve(ap.Scene(system=belt, values={mu: "1/1000"}, start=start, until=1), method)
    assert (path.modes, path.final[0]) == (("stick",), 0.2)
