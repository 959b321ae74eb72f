"""Stick and crossing regions against the friction cone itself, number by number."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.errors import InputError, NotDerivable
from asympk.systems import painleve_klein as pk

REGIONS = ap.stick_regions(pk.system())
SIGMAS = [Fraction(n, 4) for n in (-7, -6, -5, -4, -3, -1, 0, 1, 4, 12)]
LOADS = [Fraction(n, 12) for n in range(-40, 41)]


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("extra", [Fraction(0), Fraction(1, 3), Fraction(3)])
def test_regions_are_where_the_cone_says_for_every_sigma(sigma, extra):
    sigma0 = sigma + extra
    for s in LOADS:
        hold, slip = (sigma0 + 2) * abs(s), (sigma + 2) * abs(s)
        told = {
            name: getattr(REGIONS, name).contains(s, sigma=sigma, sigma0=sigma0)
            for name in ("stick", "up", "down", "ambiguous")
        }
        assert told == {
            "stick": abs(1 - s) <= hold,
            "up": 1 - s > hold,
            "down": 1 - s < -hold,
            "ambiguous": abs(1 - s) <= hold and abs(1 - s) > slip,
        }


def test_stick_up_and_down_cover_the_plane_once():
    s = np.linspace(-5, 5, 2003)
    for sigma in (-1.7, -1.0, -0.5, 0.0, 2.0):
        parts = [getattr(REGIONS, name).contains(s, sigma=sigma) for name in ("stick", "up", "down")]
        assert np.array_equal(np.sum(parts, axis=0), np.ones_like(s))


def test_at_the_edges_the_force_is_exactly_the_static_one():
    for edge in REGIONS.edges:
        assert sp.cancel((1 - edge) ** 2 - (pk.sigma0 + 2) ** 2 * edge**2) == 0


def test_the_paper_s_half_planes_come_out_at_sigma_one():
    (left, right) = REGIONS.stick.spans(sigma=1)
    at = {pk.sigma0: 1}
    assert left.as_set().subs(at) == sp.Interval(-sp.oo, sp.Rational(-1, 2))
    assert right.as_set().subs(at) == sp.Interval(sp.Rational(1, 4), sp.oo)


def test_below_minus_one_the_second_half_plane_is_gone_and_the_first_is_a_strip():
    (strip,) = REGIONS.stick.spans(sigma="-3/2")
    assert strip.as_set().subs(pk.sigma0, sp.Rational(-3, 2)) == sp.Interval(sp.Rational(2, 3), 2)
    assert REGIONS.down.contains(3, sigma="-3/2")


def test_numbers_and_arrays_agree_and_arrays_of_parameters_broadcast():
    s = np.array([[0.1], [0.4], [-2.0]])
    sigma = np.array([-1.5, -1.0, 1.0])
    table = REGIONS.stick.contains(s, sigma=sigma, sigma0=sigma + 0.5)
    one_by_one = [[REGIONS.stick.contains(float(v), sigma=g, sigma0=g + 0.5) for g in sigma] for v in s[:, 0]]
    assert table.tolist() == one_by_one


def test_the_convention_and_the_latex_say_what_happens():
    assert "at rest stays at rest" in REGIONS.convention
    assert r"\frac{1}{\sigma_{0} + 3}" in REGIONS.stick.latex()
    assert REGIONS.down.latex().count(r"\varnothing") == 2


@pytest.mark.parametrize(
    ("kwargs", "match"),
    [
        ({"sigma": -2}, "sigma = -2"),
        ({"sigma": 1, "sigma0": 0}, "sigma0 = 0"),
        ({"sigma": "steep"}, "sigma = 'steep': it must be a decimal"),
        ({"sigma": float("nan")}, "sigma = nan"),
        ({"sigma": float("inf")}, "must be finite"),
        ({"sigma": [1.0, 2.0], "sigma0": [3.0, 4.0, 5.0]}, "do not broadcast"),
    ],
)
def test_bad_parameters_are_named(kwargs, match):
    with pytest.raises(InputError, match=match):
        REGIONS.stick.contains("1/4", **kwargs)


def test_a_system_without_friction_has_no_stick_regions():
    x, y, mu = sp.symbols("x y mu")
    with pytest.raises(NotDerivable, match="no friction"):
        ap.stick_regions(ap.System.smooth(slow={x: y}, fast={y: -y}, small=mu))
