"""The waves of a forcing, and their coefficients."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.affine.forcing import Wave, value, waves_of
from asympk.affine.functions import Arrays
from asympk.arithmetic import UNIT, Doubles

a, b, w, t = sp.symbols("a b w t", real=True)


def test_coefficients_of_waves_are_not_expanded():
    long = (a + b) ** 9 * sp.cos(a) * sp.cos(b) / (a + sp.cos(b) ** 2)
    found = waves_of(long * (1 + sp.sin(w * t)) ** 2, t)
    assert {wave: coefficient for wave, coefficient in found.items() if coefficient != 0} == {
        Wave(0, 0, 0, False): sp.Rational(3, 2) * long,
        Wave(0, 0, w, True): 2 * long,
        Wave(0, 0, 2 * w, False): -long / 2,
    }


def test_one_wave_in_two_forms_is_one_wave():
    force = sp.cos((a + b) * w * t) - sp.cos(a * w * t + b * w * t)
    force += t * sp.exp(-(a + b) * w * t) - t * sp.exp(-a * w * t - b * w * t)
    assert all(coefficient == 0 for coefficient in waves_of(force, t).values())


def test_a_force_that_switches_is_no_sum_of_waves():
    assert waves_of(a + sp.Piecewise((2 - t, t < 2), (a * b, True)), t) is None


@pytest.mark.parametrize("k", [200, 4000])
def test_a_peak_whose_rise_leaves_the_range_of_numbers_only_after_its_switch_pushes_a_block(k):
    """The push k exp(-k |t - 1|) reaches friction where t = 1 - log(2 k)/k; at k = 4000 its rise was refused."""
    v, force = sp.symbols("v force", real=True)
    belt = ap.Friction(velocity=v, force=force, load=1, kinetic=sp.S.Half)
    block = ap.System.with_frictions({v: force + k * sp.exp(-k * sp.Abs(t - 1))}, {}, [belt], time=t)
    path = ap.solve(ap.Scene(system=block, start={v: 0}, until=2))
    onset = 1 - math.log(2 * k) / k
    assert float(path.events[0].t) == pytest.approx(onset, abs=1e-14)
    assert path.final[0] == pytest.approx(2 - 1 / (2 * k) - math.exp(-k) - (2 - onset) / 2, abs=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("shift", [730, 900])
def test_a_push_pushes_though_doubles_do_not_hold_what_it_grows_from_and_by(shift):
    """The bounds in doubles cut exp(100 t) at exp(600), and the block rested where the push was exp(70)."""
    v, force = sp.symbols("v force", real=True)
    push = force + sp.exp(100 * t - shift)
    block = ap.System.with_frictions({v: push}, {}, [ap.Friction(v, force, load=1, kinetic=sp.S.Half)], time=t)
    for more in range(6):  # from the fifth decision of a kind on, a table decides
        path = ap.solve(ap.Scene(system=block, start={v: 0}, until=(shift + 2 * more) / 100), digits=20)
        onset, end = (shift - math.log(2)) / 100, (shift + 2 * more) / 100
        assert float(path.events[0].t) == pytest.approx(onset, abs=1e-14)
        slid = (math.exp(2 * more) - 0.5) / 100 - (end - onset) / 2
        assert float(path.final[0]) == pytest.approx(slid, rel=1e-12)


@pytest.mark.further
@pytest.mark.parametrize(("start", "load", "shift"), [(2, 1, 900), (0, "2e-30", 750)])
def test_a_push_whose_weight_is_below_the_range_of_doubles_pushes_all_the_same(start, load, shift):
    """The weight exp(-shift) was 0 in doubles, and with it the push that they hold, or that began within their cut."""
    v, force = sp.symbols("v force", real=True)
    belt = ap.Friction(velocity=v, force=force, load=sp.Rational(load), kinetic=sp.S.Half)
    block = ap.System.with_frictions({v: force + sp.exp(100 * t - shift)}, {}, [belt], time=t)
    onset = (shift + math.log(float(load) / 2)) / 100
    path = ap.solve(ap.Scene(system=block, start={v: start}, until=onset + 0.01))
    assert (path.events[-1].kind, float(path.events[-1].t)) == ("slip_onset", pytest.approx(onset, abs=1e-14))
    many = ap.solve_many(system=block, values={}, start={"v": [start] * 4}, until=onset + 0.01)
    assert many.final[0] == pytest.approx(path.final[0], rel=1e-12)


@pytest.mark.parametrize("turn", [Fraction(7, 5), Fraction(10**30 // 3, 10**24)])
def test_a_wave_is_right_to_rounding_at_late_times(turn):
    """sin(w t) of the rounded product w t is off by half a unit of w t: of 4e13 nothing is left."""
    times, least = [0.1, 1234.5, 1e8 / 3], UNIT / 2
    waves = [(1, Doubles.split(Fraction(-1, 10**9)), Doubles.split(turn), sine) for sine in (True, False)]
    m = mpmath.mp.clone()
    m.dps = 60
    for wave in waves:
        exact = [t * (1 + m.mpf(least)) for t in times]
        exact = [t * m.exp(-t / 10**9) * (m.sin if wave[3] else m.cos)(t * turn.numerator / turn.denominator)
                 for t in exact]
        alone = [value(Doubles, *wave, t, t * least) for t in times]
        together = value(Arrays, *wave, np.array(times), np.array(times) * least).tolist()
        for found in (alone, together):
            assert all(abs(a - b) <= 6 * UNIT * t for a, b, t in zip(found, exact, times, strict=True))


def test_a_forced_block_is_followed_to_a_late_time_without_digits(monkeypatch):
    """Its run in doubles was done again in digits, since the phase w t was known to the rounding of w t alone."""
    x, v, force = sp.symbols("x v force", real=True)
    belt = ap.Friction(velocity=v - sp.S.Half, force=force, load=1, kinetic=sp.S.Half, static=sp.Rational(3, 4))
    rates = {x: v, v: force - x - v / 20 + 2 * sp.sin(sp.sqrt(2) * t)}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, [belt], time=t), start={x: "1.5", v: 0}, until=150)
    exact = ap.solve(scene, digits=30).final
    monkeypatch.setattr("asympk.affine.run._rounded", None)
    path = ap.solve(scene)
    assert max(abs(a - b) for a, b in zip(path.final, exact, strict=True)) <= path.error < 2e-14


@pytest.mark.parametrize("push", [lambda p: p * sp.cos(2 * t), lambda p: p * t * (1 - sp.exp(-t)) + sp.sin(3 * t) - p])
def test_a_wave_whose_amplitude_is_a_state_at_rest_pushes_as_one_whose_amplitude_is_a_parameter(push):
    x, v, p, F = sp.symbols("x v p F", real=True)
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half)
    paths = []
    for more in ({}, {p: 0}):
        block = ap.System.with_frictions({x: v, v: F - x + push(p), **more}, {}, [friction], time=t)
        start = {x: 1, v: 0, p: "1/3"} if more else {x: 1, v: 0}
        paths.append(ap.solve(ap.Scene(system=block, values={} if more else {p: "1/3"}, start=start, until=7)))
    given, carried = paths
    assert carried.modes == given.modes
    assert carried.model == given.model == "exact"
    assert carried.final == pytest.approx((*given.final, 1 / 3), abs=1e-15)
