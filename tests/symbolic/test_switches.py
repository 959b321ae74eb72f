import itertools
import math

import pytest
import sympy as sp

import asympk as ap
from asympk.symbolic.switches import switches

x, v, F, t, a = sp.symbols("x v F t a", real=True)
PULSE = sp.Piecewise((1, (t > 5) & (t < sp.Rational(26, 5))), (0, True))
METHODS = [{}, {"method": "radau"}, {"method": "lsoda"}, {"digits": 12}]


@pytest.fixture(params=METHODS)
def method(request):
    return request.param


def _block(push):
    rubbing = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(3, 10))
    return ap.System.with_frictions({x: v, v: push + F}, {}, [rubbing], time=t)


def test_a_block_at_rest_is_moved_by_a_pulse_however_short_it_is_beside_the_rest(method):
    path = ap.solve(ap.Scene(system=_block(PULSE), start=[0, 0], until=10), **method)
    assert path.modes == ("stick", "slip_same", "stick")
    assert [float(e.t) for e in path.events] == pytest.approx([5, 5 + 2 / 3], abs=1e-5)
    assert float(path.final[0]) == pytest.approx(7 / 150, abs=1e-5)  # 0.7 (0.2)^2 / 2 and (0.14)^2 / 0.6


def test_an_oscillator_at_rest_swings_after_a_pulse_and_is_read_where_it_begins(method):
    system = ap.System.smooth(slow={x: v, v: PULSE - x}, fast={}, small=None, time=t)
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until=10), **method)
    assert float(path.final[0]) == pytest.approx(math.cos(4.8) - math.cos(5), abs=3e-5)
    assert [float(w) for w in path([5, 5.2, 7])[0]] == pytest.approx(
        [0, 1 - math.cos(0.2), math.cos(1.8) - math.cos(2)], abs=3e-5
    )


@pytest.mark.few(1)
def test_a_ramp_that_ends_before_the_steps_look_again_moves_a_block(method):
    path = ap.solve(ap.Scene(system=_block(sp.Max(0, 1 - abs(t - 5))), start=[0, 0], until=10), **method)
    assert float(path.events[0].t) == pytest.approx(4.3, abs=1e-6)
    assert float(path.final[0]) == pytest.approx(0.81554166667, abs=1e-4)


def test_an_oscillator_under_a_saw_tooth_is_that_of_its_steps(method):
    system = ap.System.smooth(slow={x: v, v: sp.Mod(t, sp.Rational(1, 2)) - x}, fast={}, small=None, time=t)
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until="9/4"), **method)
    steps = sum(math.cos((9 - 2 * k) / 4) - 1 for k in range(1, 5)) / 2
    assert float(path.final[0]) == pytest.approx(9 / 4 - math.sin(9 / 4) + steps, abs=1e-5)


@pytest.mark.parametrize(("push", "place"), [
    (2 * sp.Heaviside(t), 7.65),
    (2 * sp.Heaviside(t - 1), 3.4),
    (sp.Piecewise((0, t <= 0), (2, True)), 7.65),
    (sp.floor(t), 1.9),
    (sp.sign(sp.sin(sp.pi * t)), 0.62141206540),
    (sp.sqrt(t), 2.83367893811),
    (sp.floor(sp.sqrt(t)), 1.4),
    (sp.sign(sp.sqrt(t) - 1), 0.2091715976),
])
@pytest.mark.few(2)
def test_a_block_at_rest_feels_a_push_that_jumps_at_once(push, place, method):
    path = ap.solve(ap.Scene(system=_block(push), start=[0, 0], until=3), **method)
    assert float(path.final[0]) == pytest.approx(place, abs=1e-5)


@pytest.mark.parametrize("while_it_lasts", [
    sp.sin(t) > sp.Rational(1, 2),
    sp.sin(t) - sp.sqrt(3) * sp.cos(t) + sp.sqrt(3) * sp.cos(t) > sp.Rational(1, 2),
    sp.Abs(t - sp.pi / 2) < sp.pi / 3,
    (6 * t - sp.pi) * (5 * sp.pi - 6 * t) > 0,
    sp.Max(sp.pi / 6 - t, t - 5 * sp.pi / 6) < 0,
    sp.Mod(t - sp.pi / 6, 2 * sp.pi) < 2 * sp.pi / 3,
])
@pytest.mark.few(4)
def test_a_block_at_rest_is_moved_while_a_push_lasts_however_its_times_are_written(while_it_lasts, method):
    push = sp.Piecewise((2, while_it_lasts), (0, True))
    path = ap.solve(ap.Scene(system=_block(push), start=[0, 0], until=6), **method)
    lasts, left = 2 * math.pi / 3, 6 - 5 * math.pi / 6
    assert path.modes == ("stick", "slip_same")
    assert float(path.events[0].t) == pytest.approx(math.pi / 6, abs=1e-8)
    assert float(path.final[0]) == pytest.approx(0.85 * lasts**2 + 1.7 * lasts * left - 0.15 * left**2, abs=1e-5)


@pytest.mark.parametrize("method", [{"method": "lsoda"}, {"digits": 12}])
def test_a_sine_that_turns_ever_faster_switches_at_the_roots_of_whole_numbers(method):
    system = ap.System.smooth({x: sp.sign(sp.sin(sp.pi * t**2))}, {}, None, time=t)
    path = ap.solve(ap.Scene(system=system, start=[0], until=4), **method)
    ends = [math.sqrt(k) for k in range(17)]
    ways = sum((-1) ** k * (b - a) for k, (a, b) in enumerate(itertools.pairwise(ends)))
    assert float(path.final[0]) == pytest.approx(ways, abs=1e-8)


@pytest.mark.parametrize(("wave", "way"), [(sp.tan, 4 - math.pi), (sp.cot, 4 - math.pi), (sp.sec, math.pi - 4)])
def test_the_sign_of_a_tangent_jumps_at_its_poles_and_is_no_pole(wave, way, method):
    system = ap.System.smooth({x: sp.sign(wave(t))}, {}, None, time=t)
    path = ap.solve(ap.Scene(system=system, start=[0], until=4), **method)
    assert float(path.final[0]) == pytest.approx(way, abs=1e-12)


@pytest.mark.parametrize(
    ("steps", "ways"),
    [
        (sp.Mod(sp.floor(t), 2), [0, 1, 0, 1]),
        (sp.Mod(sp.ceiling(t), 3), [1, 2, 0, 1]),
        (sp.sign(sp.floor(t) - sp.Rational(3, 2)), [-1, -1, 1, 1]),
        (sp.Abs(sp.floor(t) - 2), [2, 1, 0, 1]),
    ],
)
@pytest.mark.few(3)
def test_what_stands_still_between_steps_of_the_time_is_new_at_each_of_them(steps, ways, method):
    system = ap.System.smooth({x: steps}, {}, None, time=t)
    path = ap.solve(ap.Scene(system=system, start=[0], until=4), **method)
    assert float(path.final[0]) == pytest.approx(sum(ways), abs=1e-12)


WAVE = sp.cos(sp.pi * t / 6)
STAIRS = sp.floor(2 / sp.sqrt(3) * sp.sin(sp.pi * t / 6))  # 0, 1, 0, -1, -2, -1 for two units of time each


@pytest.mark.parametrize(
    ("steps", "way"),
    [
        (sp.floor(sp.Mod(t, 2)), 6),
        (sp.floor(3 * sp.frac(t)), 12),
        (sp.floor(sp.Mod(t + 300 - sp.Rational(1, 4), 3) / 2), 4),
        (sp.Abs(STAIRS), 10),
        (sp.sign(STAIRS), -4),
        (sp.Max(WAVE, -5 * sp.floor(2 * WAVE) / 4), 12 / math.pi + 25 / 2),  # both parts switch where the wave is 0
        (5 * sp.Max(STAIRS, 4 * sp.frac(t) / 5), 30),
    ],
)
@pytest.mark.few(1)
def test_a_switch_within_a_switch_goes_its_own_way(steps, way, method):
    system = ap.System.smooth({x: steps}, {}, None, time=t)
    path = ap.solve(ap.Scene(system=system, start=[0], until=12), **method)
    assert float(path.final[0]) == pytest.approx(way, abs=1e-3)  # a switch that is missed costs 1 at least


def test_a_square_wave_is_followed_in_closed_form():
    path = ap.solve(ap.Scene(system=_block(sp.sign(2 * sp.sin(t) - 1)), start=[0, 0], until=1), digits=30)
    back = math.pi / 6
    turned = back * (1 + 0.7 / 1.3)
    assert path.model == "exact"
    assert float(path.final[0]) == pytest.approx(-0.35 * back**2 - (0.7 * back) ** 2 / 2.6 + 0.35 * (1 - turned) ** 2)


def test_a_block_at_rest_is_pushed_once_another_passes_a_place(method):
    contacts = [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(3, 10))]
    y = sp.Symbol("y", real=True)
    system = ap.System.with_frictions({x: v, v: 2 * sp.Heaviside(y - 1) + F, y: 1}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start=[0, 0, 0], until=3), **method)
    assert path.modes == ("stick", "slip_same")
    assert float(path.final[0]) == pytest.approx(1.7 * 2, abs=1e-5)


BUMPS = {  # of area sqrt(pi) / 100, or pi / 100
    sp.exp(-(10**4) * (t - 5) ** 2): math.sqrt(math.pi),
    sp.exp(-(10**4) * t**2 + 10**5 * t - 250_000): math.sqrt(math.pi),
    1 / (1 + 10**4 * (t - 5) ** 2): 2 * math.atan(500),
}
first_bump, *other_bumps = BUMPS


@pytest.mark.parametrize("method", [*METHODS, {"method": "rk45"}])
@pytest.mark.parametrize("bump", [first_bump, *(pytest.param(bump, marks=pytest.mark.slow) for bump in other_bumps)])
@pytest.mark.few(1)
def test_a_smooth_bump_after_a_long_calm_is_not_stepped_over(bump, method):
    path = ap.solve(ap.Scene(system=ap.System.smooth({x: bump}, {}, None, time=t), start=[0], until=10), **method)
    assert float(path.final[0]) == pytest.approx(BUMPS[bump] / 100, abs=1e-4)
    struck = ap.solve(ap.Scene(system=_block(4 * bump), start=[0, 0], until=10), **method)
    assert struck.modes == ("stick", "slip_same", "stick")


def test_a_saw_tooth_switches_at_whole_periods_and_a_square_wave_at_the_zeros_of_its_sine():
    phases = {s.phase: s.every for s in switches([sp.Mod(t, a), sp.sign(3 * sp.cos(t)), sp.Abs(t)], t, [a])}
    assert phases == {t / a: True, t / sp.pi + sp.Rational(1, 2): True, t: False}


def test_what_depends_on_a_state_or_on_no_time_is_no_switch():
    assert switches([sp.Max(x, t), abs(a - 1), sp.sign(t**2 - 1)], t, [a]) == []


@pytest.mark.few(1)
def test_a_run_that_ends_on_a_switch_sees_what_comes_just_before_it(method):
    """A push t^16 falls back to 0 at t = 1, and friction has held it up to 3/10."""
    path = ap.solve(ap.Scene(system=_block(sp.Piecewise((t**16, t < 1), (0, True))), start=[0, 0], until=1), **method)
    onset = 0.3 ** (1 / 16)
    assert path.modes == ("stick", "slip_same")
    assert float(path.events[0].t) == pytest.approx(onset, abs=1e-9)
    assert float(path.final[1]) == pytest.approx((1 - onset**17) / 17 - 0.3 * (1 - onset), abs=1e-5)
    assert [float(w) for w in path(1)] == pytest.approx([float(w) for w in path.final], abs=1e-14)
    assert path.end == 1


@pytest.mark.parametrize("method", [{}, {"digits": 12}, {"method": "radau"}, {"method": "dop853"}])
@pytest.mark.parametrize("steep", [400, 10_000])
@pytest.mark.few(2)
def test_what_is_at_rest_is_moved_by_a_smooth_pulse_between_two_steps_of_the_rest(method, steep):
    pulse = 5 * sp.exp(-steep * (t - 1) ** 2)
    held = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2))
    block = ap.System.with_frictions({x: v, v: F + pulse}, {}, [held], time=t)
    path = ap.solve(ap.Scene(system=block, start={x: 0, v: 0}, until=2), **method)
    assert path.modes == ("stick", "slip_same", "stick")
    assert float(path.events[0].t) == pytest.approx(1 - math.sqrt(math.log(10) / steep), rel=1e-6)
    swing = ap.System.smooth({x: v, v: pulse - x}, {}, None, time=t)
    end = ap.solve(ap.Scene(system=swing, start={x: 0, v: 0}, until=2), **method).final
    gained = 5 * math.sqrt(math.pi / steep) * math.exp(-1 / (4 * steep))
    assert [float(w) for w in end] == pytest.approx([gained * math.sin(1), gained * math.cos(1)], rel=1e-4)


@pytest.mark.parametrize("push", [
    sp.floor(sp.sqrt(x)), sp.floor(sp.log(t)), sp.Max(1 / t, 1), 1 / sp.sqrt(t) + sp.sqrt(t), 1 / t + sp.sqrt(t),
])
def test_what_has_an_infinite_rate_or_slope_at_the_start_is_refused_by_name(push, method):
    with pytest.raises(ap.AsympkError, match=r"not a finite|no finite"):
        ap.solve(ap.Scene(system=_block(push), start=[0, 0], until=3), **method)


@pytest.mark.parametrize(("push", "place"), [
    (4 / sp.cosh(100 * (t - 5)) ** 2, 0.0086798648), (1 / (1 + sp.exp(-100 * (t - 5))), 17.107324),
])
@pytest.mark.few(1)
def test_a_pulse_and_a_step_whose_exponentials_overflow_far_from_them_move_a_block(push, place, method):
    path = ap.solve(ap.Scene(system=_block(push), start=[0, 0], until=12), **method)
    assert float(path.final[0]) == pytest.approx(place, abs=3e-4)
