"""Blocks stacked on one another: several frictions that hold each other, and which of them gives way."""

import math

import pytest
import sympy as sp
from peers import here
from scipy.integrate import solve_ivp

import asympk as ap
from asympk.errors import UnboundedReaction

t = sp.Symbol("t", real=True)
WAYS = [{}, {"digits": 30}, {"method": "radau"}, {"method": "lsoda", "rtol": 1e-10}]
exactly = sp.Rational


def stack(masses, kinetic, static, until, loads=None, forces=None, springs=None, start=None):
    """Block i slides on block i - 1, the first on the ground; ``forces`` act on them, by default t on the top one."""
    n = len(masses)
    places, velocities, frictions = (sp.symbols(f"{name}0:{n}", real=True) for name in ("x", "v", "F"))
    forces = forces or [*[0] * (n - 1), t]
    rates = dict(zip(places, velocities, strict=True)) if springs else {}
    for i, v in enumerate(velocities):
        below, above = frictions[i], frictions[i + 1] if i + 1 < n else 0
        pull = forces[i] - (exactly(springs[i]) * places[i] if springs else 0)
        rates[v] = (below - above + pull) / exactly(masses[i])
    contacts = [
        ap.Friction(velocity=v - (velocities[i - 1] if i else 0), force=frictions[i], load=loads[i] if loads else 1,
                    kinetic=exactly(kinetic[i]), static=exactly(static[i]))
        for i, v in enumerate(velocities)
    ]
    system = ap.System.with_frictions(rates, {}, contacts, None, t)
    return ap.Scene(system=system, values={}, start=start or [0] * len(rates), until=until)


def told(path):
    return [(event.kind, event.friction) for event in path.events]


@pytest.mark.parametrize("way", WAYS)
def test_a_contact_that_static_friction_still_holds_does_not_slip_in_place_of_the_one_that_gave_way(way):
    # at t = 2 the ground gives way; the upper contact bears 2, more than its kinetic friction and less than its static
    path = ap.solve(stack([1, 1], [1, 1], [2, 3], 6), **way)
    assert told(path) == [("slip_onset", 0), ("slip_onset", 1)]
    assert [float(event.t) for event in path.events] == pytest.approx([2, 5], abs=1e-8)
    assert [*map(float, path.final)] == pytest.approx([15 / 4, 33 / 4], abs=1e-8)


@pytest.mark.parametrize("masses", [[1, "1/2", 1], ["1/2", 1, 1]])
@pytest.mark.parametrize("way", WAYS)
def test_three_blocks_begin_to_slide_together_and_then_lose_the_top_one(masses, way):
    path = ap.solve(stack(masses, [2, 3, 3], [2, 3, 3], 6), **way)
    assert told(path) == [("slip_onset", 0), ("slip_onset", 2)]
    assert [float(event.t) for event in path.events] == pytest.approx([2, 11 / 3], abs=1e-8)
    assert [*map(float, path.final)] == pytest.approx([19 / 9, 19 / 9, 29 / 6], abs=1e-8)


@pytest.mark.parametrize("way", WAYS)
def test_of_two_contacts_that_reach_their_bounds_at_once_the_event_is_that_of_the_one_that_slips(way):
    path = ap.solve(stack([1, 1, "1/3"], [2, 3, 4], [2, 3, 4], 6), **way)
    assert told(path) == [("slip_onset", 0), ("slip_onset", 2)]
    assert float(path.events[1].t) == pytest.approx(13 / 3, abs=1e-8)


@pytest.mark.parametrize("until", [2, "13/3"])
@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.few(2)
def test_an_event_at_the_very_end_is_met_and_one_a_little_later_is_not(digits, until):
    masses, bounds = ([1, 1], [2, 9]) if until == 2 else ([1, 1, "1/3"], [2, 9, 4])
    path = ap.solve(stack(masses, bounds, bounds, exactly(until)), digits=digits)
    assert path.events[-1].kind == "slip_onset"
    assert float(path.events[-1].t) == pytest.approx(float(exactly(until)), abs=1e-15)
    before = ap.solve(stack(masses, bounds, bounds, exactly(until) - exactly(1, 10**20)), digits=30)
    assert len(before.events) == len(path.events) - 1


def test_blocks_that_come_to_rest_on_one_another_rest_exactly_and_are_followed_to_the_end():
    # times and places of an explicit integrator at 1e-12, one smooth stretch at a time, written without the package
    kinetic, pulls = ["0.315", "0.245", "0.686"], [("3.44", "2.81"), ("0.889", "3.6"), ("2.46", "2.89")]
    forces = [exactly(size) * sp.cos(exactly(turn) * t) for size, turn in pulls]
    start = ["0.578", "-0.942", "0.983", "-1.77", "0.133", "1.17"]
    loads, springs = (36, 18, exactly("4.5")), ("1.14", "0.76", "1.93")
    scene = stack([2, "3/2", "1/2"], kinetic, kinetic, 6, loads, forces, springs, start)
    times = [0.18163755, 0.19139125, 0.27677377, 0.67856662, 1.74416786, 3.13737577, 3.50378925, 5.31966545, 5.66246371]
    for path in (ap.solve(scene), ap.solve(scene, digits=20)):
        assert told(path) == [("velocity_zero", k) for k in (2, 0, 1)] + [("slip_onset", 2), ("velocity_zero", 2)] * 3
        assert [float(event.t) for event in path.events] == pytest.approx(times, abs=2e-8)
        assert [*map(float, path.final)] == pytest.approx([0.40906975, -0.90737176, 0.38753066, 0, 0, 0], abs=2e-8)
        assert path.final[3] == path.final[4] == path.final[5] == 0


def test_what_follows_does_not_depend_on_how_often_it_was_asked():
    # static friction exceeds the kinetic one, so that two contacts might give way where one comes to rest
    start = ["1.66", "-2.15", "-0.586", "1.04", "-1.09", "-0.282"]
    scene = stack([2, 1, "1/2"], [1, 1, "1/2"], [2, "3/2", 1], 4, (1, 1, 1), (0, 0, 0), (2, 1, 2), start)
    paths = [ap.solve(scene) for _ in range(8)]
    assert len({(path.modes, path.final) for path in paths}) == 1
    assert paths[0].final == pytest.approx(ap.solve(scene, "radau").final, abs=1e-5)
    states = {s.name: float(w) for s, w in zip(scene.system.states, scene.start, strict=True)}
    many = ap.solve_many(system=scene.system, values={}, start={name: [w, w] for name, w in states.items()}, until=4)
    assert many.final[:, 0] == pytest.approx(paths[0].final, abs=1e-12)


@pytest.mark.parametrize("way", [{}, {"digits": 20}, {"method": "radau"}])
def test_a_contact_that_rested_before_rests_on_where_another_comes_to_rest(way):
    # both blocks turn back together, a mass of 2 on a spring of 4: if both rested static friction would hold neither;
    # of the motions in which one of them gives way it is the one in which the upper block rests on that goes on
    scene = stack([1, 1], [1, 1], ["7/2", "3/2"], 2.5, (1, 1), (0, 0), (2, 2), ["3/2", "3/2", -1, -1])
    path = ap.solve(scene, **way)
    assert told(path)[0] == ("velocity_zero", 0)
    turn = (sp.pi - sp.atan2(1 / sp.sqrt(2), exactly(5, 4))) / sp.sqrt(2)
    assert float(path.events[0].t) == pytest.approx(float(turn), abs=1e-7)
    assert path.modes[:2] == ("slip_opposite+stick", "slip_same+stick")


@pytest.mark.parametrize("method", ["exact", "radau", "lsoda", "dop853", *here("heyoka")])
@pytest.mark.few(2)
def test_of_velocities_that_vanish_together_the_event_is_that_of_the_first_whatever_the_numbers(method):
    v, w, one, other = sp.symbols("v w F_1 F_2", real=True)
    digits = [{}, *({"digits": digits} for digits in (20, 40, 150))] if method == "exact" else [{}]
    for bounds in (("3/7", "5/11"), ("2/13", "9/7"), ("1/3", "1/3"), ("97/53", "12/11")):
        first, second = map(exactly, bounds)
        contacts = [ap.Friction(v, one, 1, first), ap.Friction(w, other, 1, second)]
        system = ap.System.with_frictions({v: one, w: other}, {}, contacts)
        for stop in (exactly(1, 3), exactly(29, 17), exactly(99, 40)):
            scene = ap.Scene(system=system, values={}, start={v: first * stop, w: -second * stop}, until=3)
            assert {tuple(told(ap.solve(scene, method, **way))) for way in digits} == {(("velocity_zero", 0),)}


def pads(static):
    """A block between two pads, held back by t/10: two frictions of one velocity, each with kinetic friction 1."""
    x, v, upper, lower = sp.symbols("x v F_1 F_2", real=True)
    contacts = [ap.Friction(velocity=v, force=force, load=1, kinetic=1, static=static) for force in (upper, lower)]
    system = ap.System.with_frictions({x: v, v: -t / 10 + upper + lower}, {}, contacts, None, t)
    return ap.Scene(system=system, values={}, start=[0, 0], until=41)


@pytest.mark.parametrize("static", [1, 2])
@pytest.mark.parametrize("way", WAYS)
def test_two_pads_hold_what_their_static_bounds_add_up_to(way, static):
    path = ap.solve(pads(static), **way)
    assert [float(event.t) for event in path.events] == pytest.approx([20 * static])


@pytest.mark.parametrize("digits", [None, 20])
@pytest.mark.parametrize("factor", [1, -2, exactly(1, 2)])
@pytest.mark.few(1)
def test_frictions_whose_velocities_are_multiples_are_one_of_the_sum_of_their_bounds(factor, digits):
    x, v, one, other = sp.symbols("x v F_1 F_2", real=True)
    slip, first, second = v - exactly(1, 5), (exactly(1, 2), exactly(4, 5)), (exactly(1, 4), exactly(3, 4))
    alone = [ap.Friction(slip, one, 1, *(a + abs(factor) * b for a, b in zip(first, second, strict=True)))]
    both = [ap.Friction(slip, one, 1, *first), ap.Friction(factor * slip, other, 1, *second)]
    paths = []
    for frictions, force in ((alone, one), (both, one + factor * other)):
        system = ap.System.with_frictions({x: v, v: 3 * sp.sin(t) - x / 2 + force}, {}, frictions, time=t)
        paths.append(ap.solve(ap.Scene(system=system, values={}, start=[0, 0], until=20), digits=digits))
    assert [*map(float, paths[1].final)] == pytest.approx([*map(float, paths[0].final)], rel=1e-14)
    times = [[float(event.t) for event in path.events] for path in paths]
    assert times[1] == pytest.approx(times[0], rel=1e-14)
    assert any(event.kind == "slip_onset" for event in paths[0].events)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1, "sqrt(25 + cos(a)**2) + a*b/3"])
def test_frictions_along_one_direction_that_turns_by_long_rates_are_one_of_the_sum_of_their_bounds(scale):
    a, b, u, v, one, other = sp.symbols("a b u v F_1 F_2", real=True)
    slip = (u * sp.cos(a) + v * sp.sin(a)) / sp.sympify(scale, locals={"a": a, "b": b})
    load = 2 + sp.sin(a * b) * sp.exp(u) / (3 + v**2 + u * v)
    rates = {
        a: b,
        b: sp.cos(u * v) * sp.sin(a * b) / (2 + sp.cos(a + b)),
        u: sp.cos(3 * a) - b**2 * sp.sin(b) * sp.cos(u * v) / (1 + a**2),
        v: sp.exp(-a) + sp.sin(u + b) * sp.exp(u * v),
    }
    ends = []
    for force, bounds in ((one, {one: load + 1 + b**2}), (one + other, {one: load, other: 1 + b**2})):
        pushed = rates | {u: rates[u] + force * sp.cos(a), v: rates[v] + force * sp.sin(a)}
        system = ap.System.with_frictions(pushed, {}, [ap.Friction(slip, f, bound, 1) for f, bound in bounds.items()])
        ends.append(ap.solve(ap.Scene(system=system, values={}, start=["1/2", "1/5", "-3/10", 0], until="1/2")))
    assert [path.modes[-1] for path in ends] == ["stick", "stick+slip_same"]
    assert ends[1].final == pytest.approx(ends[0].final, rel=1e-12)


@pytest.mark.parametrize("way", [{}, {"digits": 20}, {"method": "radau"}])
@pytest.mark.parametrize("bounds", [("7/10", "1/2"), ("1/2", "7/10")])
@pytest.mark.few(2)
def test_contacts_at_rest_that_share_a_force_anew_make_no_event(bounds, way):
    v, one, other = sp.symbols("v F_1 F_2", real=True)
    contacts = [ap.Friction(v, force, 1, exactly(bound)) for force, bound in zip((one, other), bounds, strict=True)]
    system = ap.System.with_frictions({v: sp.sin(t) / 2 + one + other}, {}, contacts, time=t)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0], until=20), **way)
    assert (path.events, path.final) == ((), (0,))


def test_contacts_whose_velocities_are_multiples_by_the_state_hold_what_their_static_bounds_add_up_to():
    x, v, one, other = sp.symbols("x v F_1 F_2", real=True)
    contacts = [ap.Friction(v, one, 1, 1, 2), ap.Friction(v * sp.cos(x), other, 1, exactly(1, 2), 1)]
    system = ap.System.with_frictions({x: v, v: t / 2 + one + other * sp.cos(x)}, {}, contacts, time=t)
    path = ap.solve(ap.Scene(system=system, values={}, start=["1/2", 0], until=6))
    assert [event.t for event in path.events] == pytest.approx([2 * (2 + math.cos(0.5))], rel=1e-14)
    assert path.modes == ("stick+stick", "slip_same+slip_same")


def test_what_a_contact_at_rest_bears_is_refused_where_its_velocity_is_a_multiple_by_a_state_that_moves():
    x, v, y, one, other = sp.symbols("x v y F_1 F_2", real=True)
    contacts = [ap.Friction(v, one, 1, 1, 2), ap.Friction(v * sp.cos(y), other, 1, exactly(1, 2), 1)]
    rates = {x: v, y: sp.S.One, v: t / 2 + one + other * sp.cos(y)}
    system = ap.System.with_frictions(rates, {}, contacts, time=t)
    with pytest.raises(UnboundedReaction, match=r"at t = 0.* friction 2 rests where others do, and what its static"):
        ap.solve(ap.Scene(system=system, values={}, start=[0, "1/2", 0], until=2))


def test_contacts_at_rest_in_a_ring_share_their_forces_as_the_limit_of_steep_smooth_friction_does():
    x, y, v, w, between, on_y, on_x = sp.symbols("x y v w F_1:4", real=True)
    contacts = [
        ap.Friction(velocity=velocity, force=force, load=1, kinetic=kinetic)
        for velocity, force, kinetic in zip((v - w, w, v), (between, on_y, on_x), (1, 1, exactly(3, 10)), strict=True)
    ]
    rates = {x: v, y: w, v: 2 * sp.cos(t) - x / 10 + between + on_x, w: -between + on_y}
    system = ap.System.with_frictions(rates, {}, contacts, None, t)
    scene = ap.Scene(system=system, values={}, start=["1/10", 0, 1, -1], until=12)
    path = ap.solve(scene, "lsoda", rtol=1e-10)
    for width in (1e-3, 1e-4, 1e-5):
        assert path.final == pytest.approx(smoothed(system, width, path), abs=3 * width ** (2 / 3))


def smoothed(system, width, path):
    """Return the end of a motion under frictions -kinetic v / sqrt(v^2 + width^2)."""
    laws = {f.force: -f.kinetic * f.velocity / sp.sqrt(f.velocity**2 + width**2) for f in system.frictions}
    rates = sp.lambdify((t, [*system.states]), [rate.subs(laws) for rate in system.rates.values()])
    start = [float(value) for value in path.scene.start]
    run = solve_ivp(rates, (0, float(path.scene.until)), start, method="LSODA", rtol=1e-9, atol=1e-12)
    return tuple(run.y[:, -1])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("way", WAYS)
def test_a_pull_that_grows_as_the_load_falls_moves_a_block_though_one_edge_of_its_cone_stands_still(way, sign):
    # the margins of rest are 2 - 2 t and 2, so that for t > 1 the velocity is the integral of t - (2 - t)
    x, v, force = sp.symbols("x v F", real=True)
    system = ap.System.with_frictions({x: v, v: sign * t + force}, {}, [ap.Friction(v, force, 2 - t, 1)], None, t)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0, 0], until="3/2"), **way)
    assert told(path) == [("slip_onset", 0)]
    assert [*map(float, path.final)] == pytest.approx([sign / 24, sign / 4], abs=1e-8)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.few(2)
def test_a_block_slips_from_between_a_wall_and_a_finger_once_their_grip_is_too_weak_for_its_weight(way):
    # the reactions of both are the thrust 4 - t of the finger, and both bounds add up to the weight 3 at t = 1
    x, y, z, u, v, w, left, right, *forces = sp.symbols("x y z u v w N_1 N_2 F_1 F_2", real=True)
    rates = {x: u, u: left - right, y: v, v: sum(forces) - 3, z: w, w: right - (4 - t)}
    parts = zip((x, z - x), (rates[u], rates[w] - rates[u]), (left, right), forces, strict=True)
    sides = [ap.Friction(v, force, normal, sp.Rational(1, 2), gap=gap, normal=normal, constraint=moved)
             for gap, moved, normal, force in parts]
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, sides, None, t), values={}, start=[0] * 6, until=2)
    path = ap.solve(scene, **way)
    assert told(path) == [("slip_onset", 0)]
    assert [*map(float, path.final)] == pytest.approx([0, 0, -1 / 6, -1 / 2, 0, 0], abs=1e-8)


@pytest.mark.parametrize("way", WAYS)
def test_a_force_that_takes_load_off_another_contact_lets_that_one_slide_back_after_its_stop(way):
    # the load 2 + G is 1 as long as u > 0, too little to hold the pull 3/2; of itself the load 2 would hold it
    x, q, v, u, force, other = sp.symbols("x q v u F G", real=True)
    contacts = [ap.Friction(v, force, 2 + other, 1), ap.Friction(u, other, 1, 1)]
    system = ap.System.with_frictions({x: v, q: u, v: force - exactly(3, 2), u: other}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0, 0, 1, 3], until=1), **way)
    assert path.modes == ("slip_same+slip_same", "slip_opposite+slip_same")
    assert [*map(float, path.final)] == pytest.approx([11 / 100, 5 / 2, -3 / 10, 2], abs=1e-8)


@pytest.mark.parametrize("way", WAYS)
def test_two_directions_of_sliding_at_one_contact_share_its_reaction_until_it_opens(way):
    # the reaction is 1 - t; v' = 1 - (1 - t)/2 and u' = 1 - (1 - t) until t = 1, then both are 1, and y = (t - 1)^3/6
    x, y, q, v, w, u, force, other, normal = sp.symbols("x y q v w u F G N", real=True)
    rates = {x: v, y: w, q: u, v: force + 1, w: normal + t - 1, u: other + 1}
    contacts = [ap.Friction(v, force, normal, exactly(1, 2), gap=y, normal=normal, constraint=rates[w]),
                ap.Friction(u, other, normal, 1)]
    system = ap.System.with_frictions(rates, {}, contacts, None, t)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0] * 6, until=2), **way)
    assert told(path) == [("lift_off", 0)]
    expected = [19 / 12, 1 / 6, 7 / 6, 7 / 4, 1 / 2, 3 / 2]
    assert [*map(float, path.final)] == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(("spare", "events", "slowed"), [
    (1, [("lift_off", 0)], exactly(3, 4)),
    (-exactly(1, 2), [("force_zero", 0), ("lift_off", 0)], exactly(1, 8)),
])
def test_a_contact_whose_load_is_more_or_less_than_its_reaction_opens_where_the_reaction_vanishes(
    spare, events, slowed, way
):
    # the reaction is 1 - t; half of the integral of |1 - t + spare| over (0, 1) is lost of the velocity
    x, y, v, w, force, normal = sp.symbols("x y v w F N", real=True)
    rates = {x: v, y: w, v: force, w: normal + t - 1}
    contact = ap.Friction(v, force, normal + spare, exactly(1, 2), gap=y, normal=normal, constraint=rates[w])
    system = ap.System.with_frictions(rates, {}, [contact], None, t)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0, 0, 1, 0], until=2), **way)
    assert told(path) == events
    assert [*map(float, path.final[1:])] == pytest.approx([1 / 6, float(1 - slowed), 1 / 2], abs=1e-8)


@pytest.mark.parametrize("unit", [1, exactly(10, 3)])
def test_a_contact_that_static_friction_holds_with_nothing_to_spare_is_held_in_all_units(unit):
    # the load of the other contact rises from 0: this one is pulled by 3 units / 2, and by 2 if both were to rest
    x, y, v, w, upper, lower = sp.symbols("x y v w F G", real=True)
    rates = {x: v, v: unit - y + x - upper, y: w, w: unit + y + upper + lower}
    contacts = [ap.Friction(w - v + unit, upper, x, 1), ap.Friction(w, lower, unit, 1, 2)]
    start = {x: 0, v: unit, y: unit / 2, w: 0}
    path = ap.solve(ap.Scene(system=ap.System.with_frictions(rates, {}, contacts), start=start, until=exactly(1, 2)))
    assert told(path) == [("slip_onset", 1)]
    assert path.events[0].t == pytest.approx(6**0.5 - 2, rel=1e-12)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(("pull", "loads", "friction", "velocity"), [
    (0, (1, exactly(1, 2)), 0, 1),  # the belt, from t = 1 on at t - 1, slips below it: v' = 1 - 1/2
    (exactly(1, 2), (1, exactly(1, 2)), 1, 2),  # it moves with the belt: v' = 1/2 + 1 - 1/2
    (0, (exactly(1, 2), 1), 0, 0),  # the ground holds it
])
@pytest.mark.few(2)
def test_a_body_that_stands_on_ground_and_belt_is_decided_anew_when_the_belt_starts(
    pull, loads, friction, velocity, way
):
    v, force, other = sp.symbols("v F G", real=True)
    contacts = [ap.Friction(v - sp.Max(0, t - 1), force, loads[0], 1), ap.Friction(v, other, loads[1], 1)]
    system = ap.System.with_frictions({v: pull + force + other}, {}, contacts, None, t)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0], until=3), **way)
    assert told(path) == [("slip_onset", friction)]
    assert (float(path.events[0].t), float(path.final[0])) == pytest.approx((1, velocity), abs=1e-8)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(("push", "speed"), [(sp.Max(0, t - 1), 1 / 2), (sp.Piecewise((0, t < 1), (1, True)), 1),
                                             (sp.floor(t), 1), (t**6, 128 / 7)])
@pytest.mark.few(3)
def test_a_ball_is_pushed_away_while_a_body_beside_it_stands_on_undetermined_forces(push, speed, way):
    v, w, force, other = sp.symbols("v w F G", real=True)
    contacts = [ap.Friction(v, s, 1, 1) for s in (force, other)]
    system = ap.System.with_frictions({v: force + other, w: push}, {}, contacts, None, t)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0, 0], until=2), **way)
    assert (path.events, [*map(float, path.final)]) == ((), pytest.approx([0, speed], abs=1e-8))


@pytest.mark.parametrize("way", WAYS)
def test_what_rests_by_undetermined_forces_rests_beside_an_oscillator_that_it_does_not_feel(way):
    """Of x'' = F + G the relay F = -3 sign x lets both forces free at rest; y turns, also where x would push it."""
    x, v, y, w, force, other = sp.symbols("x v y w F G", real=True)
    contacts = [ap.Friction(x, force, 1, 3), ap.Friction(v, other, 1, 1)]
    for pushed in (0, x):
        rates = {x: v, v: force + other, y: w, w: pushed - y}
        scene = ap.Scene(system=ap.System.with_frictions(rates, {}, contacts), start=[0, 0, 1, 0], until=3)
        path = ap.solve(scene, **way)
        assert (path.modes, path.final[:2]) == (("stick+stick",), (0, 0))
        assert [*map(float, path.final[2:])] == pytest.approx([math.cos(3), -math.sin(3)], abs=1e-4)


def test_a_body_on_three_supports_stays_on_all_of_them_beside_a_pendulum():
    h, u, angle, turn, x, v, y, w = sp.symbols("h u phi omega x v y w", real=True)
    normals, forces = sp.symbols("N1:4", real=True), sp.symbols("F1:4", real=True)
    lift, moment = sum(normals) - 1, normals[2] - normals[0]
    contacts = [ap.Friction(v, F, N, exactly(1, 5), gap=h + a * angle, normal=N, constraint=lift + a * moment)
                for a, F, N in zip((-1, 0, 1), forces, normals, strict=True)]
    rates = {h: u, angle: turn, u: lift, turn: moment, x: v, v: sum(forces) + exactly(1, 10), y: w, w: -sp.sin(y)}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, contacts), start=[0] * 6 + [1, 0], until=1)
    path = ap.solve(scene)
    assert (path.modes, path.final[:6]) == (("stick+stick+stick",), (0,) * 6)
    assert path.final[7] ** 2 / 2 - math.cos(path.final[6]) == pytest.approx(-math.cos(1), abs=1e-8)


@pytest.mark.parametrize("push", [t / (7 * t - 5), t * sp.sqrt(1 - 2 * t), t**7 * sp.sqrt(1 - 2 * t)])
def test_a_force_that_is_not_finite_later_does_not_stay_0(push):
    # beside what stands on undetermined forces; these are no numbers 5/7 later, where a force is looked at again
    v, w, force, other = sp.symbols("v w F G", real=True)
    contacts = [ap.Friction(v, s, 1, 1) for s in (force, other)]
    system = ap.System.with_frictions({v: force + other, w: push}, {}, contacts, None, t)
    path = ap.solve(ap.Scene(system=system, values={}, start=[0, 0], until="2/5"))
    assert path.final[1] == pytest.approx(float(sp.Integral(push, (t, 0, sp.Rational(2, 5))).evalf()), abs=1e-9)


@pytest.mark.parametrize("power", [6, 7, 20])
@pytest.mark.few(2)
def test_a_body_on_the_ground_stays_there_under_a_belt_that_starts_at_any_power_of_the_time(power):
    v, F, G = sp.symbols("v F G", real=True)
    velocities = ((v, F), (v - t**power, G))
    rubs = [ap.Friction(velocity=u, force=force, load=1, kinetic=exactly(1, 5)) for u, force in velocities]
    path = ap.solve(ap.Scene(system=ap.System.with_frictions({v: F + G}, {}, rubs, time=t), start={v: 0}, until=2))
    assert path.modes == ("stick+slip_opposite",)
    assert path.final == (0,)
