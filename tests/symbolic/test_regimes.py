"""The regime table against the exact flow: what it says of Pi2 and of stick is what runs do."""

from fractions import Fraction

import pytest
import sympy as sp

from asympk.methods import solve
from asympk.scene import Scene
from asympk.symbolic.regimes import regimes, thresholds
from asympk.systems import painleve_klein as pk

SYSTEM = pk.system()


def test_the_thresholds_are_minus_three_halves_minus_one_and_zero():
    assert thresholds(SYSTEM) == (sp.Rational(-3, 2), -1, 0)


def test_the_regimes_cover_the_range_of_sigma_once():
    ranges = [regime.values for regime in regimes(SYSTEM)]
    assert sp.Union(*ranges) == sp.Interval.open(-2, sp.oo)
    assert all(a.is_disjoint(b) for n, a in enumerate(ranges) for b in ranges[:n])


def test_pi2_and_its_stability_change_side_together_at_sigma_zero():
    second = {regime.condition: regime.passages[1] for regime in regimes(SYSTEM)}
    steep = second.pop(pk.sigma > 0)
    assert (steep.side, steep.stable, steep.drift) == (1, False, -1)
    at_zero = second.pop(sp.Eq(pk.sigma, 0))
    assert at_zero.side == 0
    assert {(p.side, p.stable, p.drift) for p in second.values()} == {(-1, True, 1)}


@pytest.mark.parametrize("sigma", [Fraction(-19, 10), Fraction(-8, 5), Fraction(-7, 5), Fraction(-1), Fraction(-1, 2)])
def test_runs_along_pi2_meet_the_plane_where_the_table_says(sigma):
    meets = next(r.passages[1].meets for r in regimes(SYSTEM) if sp.Rational(sigma) in r.values)
    path = solve(Scene(sigma=sigma, mu=Fraction(1, 10**6), start=(0, 0, -1), until=10), digits=20)
    after = path.modes[path.modes.index("slip_opposite") + 1]
    assert after == {"stick": "stick", "up": "slip_same"}[meets]


@pytest.mark.parametrize(("x", "after"), [(0, "stick"), (3, "slip_same")])
def test_runs_along_pi2_come_to_the_edge_of_stick_at_minus_three_halves_and_x_decides(x, after):
    # on Pi2 the load is s = 2/3 - (2 mu / 3) (x - 2/3) + O(mu^2), and the edge is s = 2/3
    assert regimes(SYSTEM)[1].passages[1].meets == "edge"
    path = solve(Scene(sigma="-3/2", mu=Fraction(1, 10**6), start=(x, -1, -1), until=2), digits=20)
    assert path.modes[path.modes.index("slip_opposite") + 1] == after


def test_runs_on_the_steep_rod_never_come_back_from_pi1():
    (first, _) = regimes(SYSTEM)[-1].passages
    assert (first.side, first.stable, first.drift, first.meets) == (1, True, 1, None)
    path = solve(Scene(sigma=1, mu=Fraction(1, 1000), start=(1, 1, 1), until=50), digits=20)
    assert path.modes == ("slip_same",)
