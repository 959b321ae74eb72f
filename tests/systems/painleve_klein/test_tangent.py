"""Starts of which a sign hangs on the last bits: no event is told that more digits do not tell."""

import mpmath
import pytest
from tangent import FAMILIES, differences, draws, scene_of

import asympk as ap
from asympk.arithmetic import Doubles
from asympk.errors import Undecided
from asympk.systems.painleve_klein.flow.exact import RodNumbers, segments_of


@pytest.fixture(scope="module")
def scenes():
    return list(draws(20 * len(FAMILIES), seed=1))


@pytest.mark.few(0)
@pytest.mark.parametrize("family", [family.__name__ for family in FAMILIES])
def test_starts_that_touch_go_as_forty_digits_tell(scenes, family):
    for name, numbers in scenes:
        if name == family:
            assert differences(numbers) == [], numbers


@pytest.mark.parametrize("k", range(1, 400, 7))
@pytest.mark.few(6)
def test_a_start_on_s_zero_without_a_rate_but_for_rounding_returns_through_it(k):
    mu = k / 1000
    assert differences((1.0, 1.0, mu, 1 / mu, -1 / mu, -1.0, 2.0)) == []


def test_a_rate_that_doubles_cannot_tell_is_not_told_by_them():
    with pytest.raises(Undecided):
        segments_of(Doubles, RodNumbers(1.0, 1.0, 1e-3, 1000.0, -1000.0, -1.0, 2.0, None))


def test_a_rate_that_is_zero_in_fractions_is_zero_whatever_its_double():
    scene = ap.Scene(1, "1e-3", (1000, -1000, -1), 2)
    assert ap.solve(scene).modes == ap.solve(scene, digits=40).modes == ("slip_opposite", "stick", "slip_same")


def test_a_load_that_doubles_round_to_zero_keeps_its_sign():
    scene = ap.Scene(1, 1e-3, ("1.00000000000000000001", -1, 1), 1e-22)  # s = 1e-20, falling
    assert ap.solve(scene).modes == ap.solve(scene, digits=40).modes


def test_an_end_within_rounding_of_an_event_is_told_by_more_digits():
    start = (-0.03575986079681304, -1.7701921652864194, 1.6482398299690568)
    assert differences((1.0, 1.0, 0.1, *start, 0.5720662734562217)) == []


def test_a_nearly_double_root_is_followed_to_its_end():
    start = (11.957055698092665, -11.906772062215515, -1.3091624350074809)
    scene = ap.Scene(3.069125726511012, 0.1, start, 1.1790697894573565)
    path, true = ap.solve(scene), ap.solve(scene, digits=40)
    assert abs(path.events[0].t - true.events[0].t) < 1e-9
    assert abs(path.final[0] - true.final[0]) < 1e-14


@pytest.mark.parametrize("power", [20, 100, 150, 300])
def test_an_offset_from_an_edge_of_any_size_is_decided(power):
    path = ap.solve(ap.Scene(-1.25, 1e-6, (4, f"1e-{power}", 0), 1))
    assert path.modes == ("slip_opposite", "stick", "slip_same")
    assert path.events[0].t == pytest.approx(5 * 10.0 ** -(power + 7), rel=1e-12)


def test_the_smallest_double_off_the_unstable_rest_point_escapes_at_its_own_time():
    assert differences((0.5, 0.5, 0.0007730396242810785, -2.0, 1.5e-323, 1.0, 2.4897100770813796)) == []


def test_a_start_whose_digits_cancel_beyond_those_of_its_slow_line_asks_for_more():
    with mpmath.workdps(300):
        slope = -2 / (1 + mpmath.sqrt(mpmath.mpf("1.02")))
        y = str(slope * mpmath.mpf("1.5") + mpmath.mpf("1e-180"))
    scene = ap.Scene(2, "1/100", (1, y, 1), 5)
    path, true = ap.solve(scene), ap.solve(scene, digits=40)
    assert path.modes == true.modes
    assert abs(path.final[0] - true.final[0]) <= path.error * max(1, abs(true.final[2]))


@pytest.mark.parametrize("numbers", [
    (7.0, 7.273013282106533, 2.749999999999991, -1.8291807979899797, 0.0, 0.1, 2.7335125568715495, "Pi1"),
    (-0.8861918317014701, -0.6361918317014701, 0.7784520420746324, 1.9052022964180626, 1e-69, -0.1, 3.4, "Pi1"),
])
def test_beside_a_slow_line_whose_roots_nearly_coalesce_the_error_is_what_it_says(numbers):
    assert differences(numbers) == []


def test_a_start_beside_a_slow_line_that_rounds_to_the_other_side_of_s_zero_is_followed_from_there():
    given = 2.407468841314608, 2.407468841314608, 0.05, 1.3585335452302543, 0.37998746490157714, -1.0, 2.0, "Pi2"
    assert differences(given) == []
    assert ap.solve(scene_of(given)).modes[0] == "slip_same"
