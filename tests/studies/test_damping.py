"""How much damping the resolution needs: the laws of the jam against the exact flow."""

from math import log, pi, sqrt

import pytest

from asympk.errors import InputError
from asympk.methods import solve
from asympk.scene import Scene
from asympk.studies import damping
from asympk.studies.damping import jam_law, jammed, leading_law, loss_per_period, stick_law


@pytest.mark.parametrize("zeta", [1.2, 3, 30])
@pytest.mark.parametrize("sigma", [0.5, 1, 4])
def test_above_critical_damping_the_mass_is_jammed_twice_for_the_time_of_the_law(zeta, sigma):
    epsilon = 1e-12
    _, jam, sticks, _ = jammed(epsilon, 2 * zeta * epsilon, sigma)
    assert sticks == 2
    assert jam == pytest.approx(jam_law(epsilon, 2 * zeta * epsilon, sigma), rel=1e-6)


@pytest.mark.parametrize("sigma", [0.5, 1, 4])
def test_the_single_jump_begins_where_the_cube_of_the_damping_time_is_the_compliance_for_every_sigma(sigma):
    epsilon = 1e-9
    border = epsilon ** (2 / 3)
    assert [jammed(epsilon, share * border, sigma)[2] for share in (0.98, 1.02)] == [2, 1]


@pytest.mark.parametrize("sigma", [0.5, 1, 4])
def test_the_time_of_the_single_jump_is_that_of_its_law(sigma):
    assert jammed(1e-9, 1, sigma)[1] == pytest.approx(jam_law(1e-9, 1, sigma), rel=1e-9)


def test_below_critical_damping_time_and_sticks_tend_to_their_laws():
    away = []
    for epsilon in (1e-4, 1e-8, 1e-16):
        _, jam, sticks, _ = jammed(epsilon, 2 * 0.4 * epsilon)
        half_period = pi / sqrt(1 - 0.4**2)
        assert abs(sticks - stick_law(epsilon, 0.4)) < 2
        away.append(abs(jam / leading_law(epsilon, 0.4) - 1) * log(1 / epsilon) / half_period)
    assert max(away) < 1


def test_the_laws_on_both_sides_agree_to_leading_order_where_they_meet():
    below, above = (leading_law(1e-9, zeta) for zeta in (1 - 1e-9, 1 + 1e-9))
    assert below == pytest.approx(above, rel=1e-3)


def test_doubles_follow_the_jam_as_many_digits_do():
    few, many = jammed(1e-6, 0.8e-6), jammed(1e-6, 0.8e-6, digits=40)
    assert few[2] == many[2]
    assert few[:2] == pytest.approx(many[:2], rel=1e-12)


def test_the_undamped_rod_loses_in_a_period_what_one_slip_down_and_one_up_take():
    lost = [_loss_times_square(epsilon) for epsilon in (0.1, 0.05, 0.025)]
    away = [abs(value / float(loss_per_period(1)) - 1) for value in lost]
    assert away[2] < away[1] < away[0] < 0.3
    assert away[2] < 0.1


def _loss_times_square(epsilon):
    """Return what A^2 loses between two onsets of slip on one side, times A^2 / 2: C in the limit."""
    d = 1e-14 * epsilon
    mu = (epsilon / d) ** 2
    path = solve(Scene(1, mu, (0, 0, -1 / d), 30 * epsilon / d), digits=40)
    tops = [event.x**2 + mu * event.y**2 for event in path.events if event.kind == "slip_onset" and event.x > 0]
    return float((tops[0] - tops[1]) * tops[0] / 2)


@pytest.mark.further
def test_the_undamped_rod_is_jammed_the_longer_the_stiffer_it_is():
    times = [jammed(epsilon, damping.TINY * epsilon)[1] for epsilon in (1 / 2, 1 / 3)]
    assert times[1] > 3 * times[0] > 100


@pytest.mark.parametrize(("epsilon", "d"), [(0, 1), (1.5, 1), (1e-3, 0), (1e-3, -1)])
def test_numbers_without_meaning_are_refused(epsilon, d):
    with pytest.raises(InputError, match="give 0 < epsilon < 1"):
        jammed(epsilon, d)


def test_a_mass_that_is_still_jammed_at_the_end_is_told():
    with pytest.raises(InputError, match="is jammed still at 1"):
        jammed(0.05, 1e-3)
