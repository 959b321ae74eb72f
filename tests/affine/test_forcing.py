"""The waves of a forcing, and their coefficients."""

import sympy as sp

from asympk.affine.forcing import Wave, waves_of

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
