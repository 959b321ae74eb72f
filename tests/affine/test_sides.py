"""Systems whose modes are affine on each side of what the state switches: stops, dead zones, saturations."""

import math

import pytest
import sympy as sp

import asympk as ap
from asympk.symbolic.sides import sides_of

x, v, t = sp.symbols("x v t", real=True)
F = sp.Symbol("F", real=True)
RUB = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 50))
SPRINGS = {
    "stop": -x - 10 * sp.Max(x - 1, 0),
    "dead zone": -4 * sp.Max(x - 1, 0) + 4 * sp.Max(-x - 1, 0),
    "stop that moves": -x - 10 * sp.Max(x - 1 - t / 20, 0) + sp.cos(t),
    "saturation": -sp.Min(1, sp.Max(-1, 3 * x)) - v / 10,
    "table": -x - sp.Piecewise((0, x < 0), (x, 4 * x < 1), (2 * x - sp.Rational(1, 4), x < 2), (3 * x / 2, True)),
}


def test_an_oscillator_of_two_stiffnesses_returns_after_half_a_period_of_each():
    system = ap.System.with_frictions({x: v, v: -x - 3 * sp.Max(x, 0)}, {}, [])
    until = sp.Rational(str((3 * sp.pi / 2).n(50)))
    path = ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=until))
    assert path.final == pytest.approx([1, 0], abs=1e-15)
    assert path.model == "exact"
    assert "why" not in path.info
    assert path(float(until) / 2)[0] == pytest.approx(-2 * math.sin(math.pi / 2), abs=1e-15)
    exact = ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=until), digits=40)
    assert max(abs(exact.final[0] - 1), abs(exact.final[1])) < 1e-39


@pytest.mark.parametrize("spring", SPRINGS)
@pytest.mark.few(1)
def test_closed_forms_joined_at_the_edges_of_sides_are_what_steps_that_end_there_give(spring):
    system = ap.System.with_frictions({x: v, v: SPRINGS[spring] + F}, {}, [RUB], time=t)
    scene = ap.Scene(system=system, start={x: -3, v: 0}, until=20)
    path, exact = ap.solve(scene), ap.solve(scene, digits=25)
    steps = ap.solve(scene, "dop853", rtol=1e-13, atol=1e-13)
    assert path.final == pytest.approx([*map(float, exact.final)], abs=1e-14)
    assert steps.final == pytest.approx(path.final, abs=2e-11)
    assert path.modes == exact.modes == steps.modes


def test_a_motion_that_only_touches_a_stop_is_not_turned_by_it():
    system = ap.System.with_frictions({x: v, v: -x - 3 * sp.Max(x - 1, 0)}, {}, [])
    path = ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=20))
    assert path.final == pytest.approx([math.cos(20), -math.sin(20)], abs=1e-15)


@pytest.mark.slow
def test_any_number_of_stops_is_followed_in_closed_form_as_each_block_is_alone():
    """Seven stops have 128 choices of sides, and no law feels more than one."""
    blocks = [(*sp.symbols(f"x{k} v{k}", real=True), k) for k in range(1, 8)]
    slow = {q: u for q, u, _ in blocks} | {u: -k * q - 10 * sp.Max(0, q - 1) for q, u, k in blocks}
    system, start = ap.System.with_frictions(slow, {}, []), {s: int(s.name[0] == "v") for s in slow}
    path = ap.solve(ap.Scene(system=system, start=start, until=2))
    assert path.model == "exact"
    for q, u, k in blocks:
        alone = ap.System.with_frictions({q: u, u: slow[u]}, {}, [])
        lone = ap.solve(ap.Scene(system=alone, start={q: 0, u: 1}, until=2))
        assert (path.final[k - 1], path.final[k + 6]) == pytest.approx(lone.final, abs=1e-14)


def test_switches_in_one_term_are_all_tried_together():
    for force, model in ((sp.sign(x) * sp.sign(v), "exact"), (sp.Max(x, 0) * sp.Max(v, 0), "lsoda")):
        system = ap.System.with_frictions({x: v, v: -x - force / 4}, {}, [])
        assert ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=1)).model == model


def test_phases_on_one_line_have_a_side_more_than_they_are_and_others_all_combinations():
    line = [x - 1, 2 * x - 1, 3 - x]
    assert len([*sides_of(line, (x, v))]) == 4
    assert {dict(side)[3 - x] for side in sides_of(line, (x, v)) if dict(side)[x - 1] < 0} == {1}
    a = sp.Symbol("a", positive=True)
    assert len([*sides_of([*line, v, x - a], (x, v))]) == 4 * 2 * 2


@pytest.mark.parametrize("push", [
    sp.Piecewise((1, t < 1), (0, True)), 1 - sp.Heaviside(t - 1), sp.Min(1, sp.Max(0, 1 - sp.Max(0, t - 1) * 10**9)),
])
def test_a_block_that_a_pulse_sets_in_motion_slides_as_far_as_its_parabolas(push):
    """By 2/5 in the pulse, 1 - 1/5 over a second; then by v^2/(2/5), v = 4/5 (Newmark 1965); the ramp lasts 1e-9."""
    block = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 5))
    system = ap.System.with_frictions({x: v, v: push + F}, {}, [block], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=6))
    third, ramp = sp.Rational(1, 3), sp.Rational(1, 10**9) if push.has(sp.Min) else 0
    gained = sp.Rational(4, 5) + ramp * (sp.Rational(1, 2) - sp.Rational(1, 5))
    way = sp.Rational(2, 5) + ramp * sp.Rational(4, 5) + ramp**2 * (third - sp.Rational(1, 10)) + gained**2 * 5 / 2
    assert path.final == pytest.approx([float(way), 0], rel=4e-16, abs=1e-16)
    assert (path.model, path.modes) == ("exact", ("slip_same", "stick"))


def test_a_pulse_whose_exponential_alone_is_beyond_doubles_is_followed():
    """e^(800 t) reaches 1e347, and the run was refused for it; the pulse 800 e^(-800 |t - 1|) has the area 2."""
    pulse = 800 * sp.exp(-sp.Abs(800 * (t - 1)))
    path = ap.solve(ap.Scene(system=ap.System.smooth({x: v, v: pulse}, {}, None, time=t), start={x: 0, v: 0}, until=2))
    assert path.model == "exact"
    assert path.final == pytest.approx((2, 2), abs=1e-14)
    rough = ap.System.with_frictions({v: pulse + F}, {}, [ap.Friction(v, F, sp.Rational(1, 10), kinetic=1)], time=t)
    path = ap.solve(ap.Scene(system=rough, start={v: 0}, until=2))
    onset = 1 - math.log(8000) / 800
    assert path.events[0].t == pytest.approx(onset, abs=1e-15)
    assert path.final[0] == pytest.approx(2 - 1 / 8000 - (2 - onset) / 10, abs=1e-14)


@pytest.mark.parametrize("until", [2, "7/2"])
def test_a_triangular_pulse_on_a_spring_is_exact(until):
    """x'' = -x + s, s = t - 2 up to 3 and then 4 - t: x = s - sin s, and from there on by Duhamel's integral."""
    system = ap.System.with_frictions({x: v, v: -x + sp.Max(0, 1 - sp.Abs(t - 3))}, {}, [], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=until))
    late = max(0.0, float(sp.Rational(until)) - 2)
    after = max(0.0, late - 1)
    expected = (late - math.sin(late)) - 2 * (after - math.sin(after))
    assert path.final[0] == pytest.approx(expected, abs=1e-15)
    assert path.model == "exact"


@pytest.mark.parametrize("static", ["1/5", "1/4"])
def test_frictions_of_one_velocity_hold_a_block_together_until_one_of_them_turns_to_its_neighbour(static):
    """Blocks pushed by t and t/2. Both frictions hold the first until t = 2 static, and one couples them from 1 on."""
    w, G = sp.symbols("w G", real=True)
    turned = sp.Piecewise((v, t < 1), (v - w, True))
    rub, clutch = (ap.Friction(velocity=u, force=force, load=1, kinetic=sp.Rational(1, 5), static=sp.Rational(static))
                   for u, force in ((v, F), (turned, G)))
    rates = {v: t + F + G * turned.diff(v), w: t / 2 + G * turned.diff(w)}
    path = ap.solve(ap.Scene(system=ap.System.with_frictions(rates, {}, [rub, clutch], time=t), start=(0, 0), until=3))
    bound = float(sp.Rational(static))
    speed = 1 / 2 - 2 * bound**2 - 0.4 * (1 - 2 * bound)  # at t = 1, and the other block's is 1/4
    meet, parting = math.sqrt(1.96 + 4 * (0.25 - speed)) - 0.4, 0.4 + 4 * bound  # v - w grows by t/2 + 1/5
    assert [e.t for e in path.events] == pytest.approx([2 * bound, 1, meet, parting], rel=1e-14)
    joined = speed + (meet**2 - 1) / 2 + 3 * (parting**2 - meet**2) / 8 - (parting - meet) / 10
    assert path.final[0] == pytest.approx(joined + (9 - parting**2) / 2 - 0.4 * (3 - parting), rel=1e-14)


@pytest.mark.parametrize("static", ["1/5", "1/4"])
@pytest.mark.few(1)
def test_three_frictions_hold_two_blocks_until_their_bounds_are_used_up_although_one_turns_later(static):
    """The third joins the blocks until t = 1 and then rubs on the second: they rest until 3 t/2 is twice ``static``."""
    w, G, H = sp.symbols("w G H", real=True)
    turned = sp.Piecewise((v - w, t < 1), (w, True))
    rubs = [ap.Friction(velocity=u, force=force, load=1, kinetic=sp.Rational(1, 5), static=sp.Rational(static))
            for u, force in ((v, F), (w, G), (turned, H))]
    rates = {v: t + F + H * turned.diff(v), w: t / 2 + G + H * turned.diff(w)}
    path = ap.solve(ap.Scene(system=ap.System.with_frictions(rates, {}, rubs, time=t), start=(0, 0), until=3))
    bound = float(sp.Rational(static))
    onset, parting = 4 * bound / 3, 4 * bound
    assert [e.t for e in path.events] == pytest.approx([onset, parting], rel=1e-14)
    joined = 3 * (parting**2 - onset**2) / 8 - (parting - onset) / 5
    first = joined + (9 - parting**2) / 2 - 0.4 * (1 - parting) - 0.4
    second = joined + (9 - parting**2) / 4 - 0.8
    assert path.final == pytest.approx([first, second], rel=1e-14)


@pytest.mark.parametrize("power", [12, 13, 14, 20, 24])
@pytest.mark.few(1)
def test_a_push_that_is_a_high_power_of_the_time_is_integrated_exactly(power):
    system = ap.System.with_frictions({x: v, v: t**power}, {}, [], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=2))
    expected = 2.0 ** (power + 2) / ((power + 1) * (power + 2)), 2.0 ** (power + 1) / (power + 1)
    assert path.final == pytest.approx(expected, rel=4e-16)


@pytest.mark.parametrize("options", [{}, {"digits": 25}])
def test_a_push_that_decays_with_the_mass_is_integrated_exactly(options):
    """v' = t e^-t cos(t) - v - 1/4, in resonance: (v e^t)' = t cos(t) - e^t/4."""
    rub = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 4))
    system = ap.System.with_frictions({v: t * sp.exp(-t) * sp.cos(t) - v + F}, {}, [rub], time=t)
    path = ap.solve(ap.Scene(system=system, start={v: 4}, until=2), **options)
    gained = 2 * math.sin(2) + math.cos(2) - 1
    assert float(path.final[0]) == pytest.approx((4 + gained - math.expm1(2) / 4) * math.exp(-2), rel=1e-15)
    assert path.model == ("exact" if not options else path.model)


@pytest.mark.parametrize("start", [2, 1, 0])
@pytest.mark.parametrize("power", [1, 3])
def test_a_scene_that_ends_at_its_start_stays_there_on_every_side_in_doubles_and_in_digits(start, power):
    system = ap.System.with_frictions({x: v, v: -x - 3 * sp.Max(x - 1, 0) ** power}, {}, [])
    scene = ap.Scene(system=system, start={x: start, v: 0}, until=0)
    assert ap.solve(scene).final == ap.solve(scene, digits=20).final == (start, 0)


@pytest.mark.further
def test_a_pulse_long_past_does_not_tell_what_follows_at_the_edge_of_stick():
    """There the rate of the third block is 0 but for 200 e^(-648), and no motion was said to go on, in 20 digits."""
    states, forces = sp.symbols("x:3 v:3", real=True), sp.symbols("F:3", real=True)
    (*places, _, v1, v2), Q = states, sp.Rational
    springs = sp.Matrix([[-204, 33, 0], [99, -347, 59], [0, 94, -177]]) / 100
    rates = dict(zip(states, [*states[3:], *(springs * sp.Matrix(places) + sp.Matrix(forces))], strict=True))
    rates[states[3]] += 10 * sp.exp(-10 * sp.Abs(t - Q(291, 100))) - Q(2, 25) * states[3]
    for velocity, middle in ((v1, Q(82, 25)), (v2, Q(43, 25))):
        rates[velocity] += 200 * sp.exp(-200 * sp.Abs(t - middle))
    bounds = ((Q(37, 100), Q(111, 200)), (Q(13, 25), Q(39, 50)), (Q(47, 100), Q(47, 100)))
    rubs = [ap.Friction(w, F, 1, *both) for w, F, both in zip(states[3:], forces, bounds, strict=True)]
    system = ap.System.with_frictions(rates, {}, rubs, time=t)
    scene = ap.Scene(system=system, start=(Q(-121, 100), Q(-1, 20), Q(1, 4), 0, 0, 0), until=5)
    path, precise = ap.solve(scene), ap.solve(scene, digits=20)
    assert path.modes == precise.modes
    assert precise.modes[-2:] == ("slip_opposite+slip_opposite+stick", "slip_opposite+slip_opposite+slip_opposite")
