"""A guard that comes down to zero and up again, in closed form: what follows there is decided, as at any event."""

import math

import mpmath
import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.affine import mesh
from asympk.affine.events import Guards
from asympk.affine.run import run

x, y, v, w, F, G, t = sp.symbols("x y v w F G t", real=True)


def on_a_belt(static):
    """A block on a spring, on a belt of speed 1: it slips on a circle around x = 1/2 that may touch that speed."""
    friction = ap.Friction(velocity=v - 1, force=F, load=sp.S.One, kinetic=sp.S.Half, static=sp.Rational(static))
    return ap.System.with_frictions({x: v, v: -x + F}, {}, (friction,))


def beside_an_oscillator(load, drive):
    """A block whose load and drive depend on x = cos(t)."""
    friction = ap.Friction(velocity=v, force=F, load=load, kinetic=sp.S.Half)
    return ap.System.with_frictions({x: y, y: -x, v: drive + F}, {}, (friction,))


@pytest.mark.parametrize(("start", "digits"), [((0, 1), None), ((3, 0), 25), ((0, 5), None)])
@pytest.mark.few(1)
def test_a_block_that_has_stuck_to_its_belt_touches_the_speed_of_the_belt_ever_after(start, digits):
    """It leaves at x = 1/2 with the speed 1, and so returns to both, without sticking, after every turn."""
    path = ap.solve(ap.Scene(system=on_a_belt("1/2"), start=start, until=40), digits=digits)
    left = path.events[-1]
    assert path.modes[-2:] == ("stick", "slip_opposite")
    assert left.t < 14
    turn = 40 - float(left.t)
    assert [float(w) for w in path.final] == pytest.approx([0.5 + math.sin(turn), math.cos(turn)], abs=1e-13)
    times = np.linspace(float(left.t), 40, 7)
    assert np.array(path(times)[0], float) == pytest.approx(0.5 + np.sin(times - float(left.t)), abs=1e-13)


@pytest.mark.parametrize("until", [300, 10**9, 10**15])
def test_a_block_that_leaves_its_belt_alone_is_followed_past_any_number_of_touches(until):
    """Each touch took some 30 ms: two runs in ever more digits agreed on it."""
    path = ap.solve(ap.Scene(system=on_a_belt("1/2"), start=(0, 1), until=until))
    turn = mpmath.mpf(until) - 0.5
    assert [float(w) for w in path.final] == pytest.approx([0.5 + mpmath.sin(turn), mpmath.cos(turn)], abs=2e-13)


@pytest.mark.parametrize(("static", "until"), [("1/2", 300), ("1/2", 10**9), ("5/4", 10**9)])
@pytest.mark.few(1)
def test_a_block_driven_by_as_much_as_friction_bears_rests_past_any_number_of_touches(static, until):
    """Each touch took some 20 ms: two runs in ever more digits agreed on it. Only a larger drive moves the block."""
    bound = sp.Rational(static)
    friction, drive = ap.Friction(v, F, 1, sp.S.Half, bound), 3 * sp.cos(2 * t) / 5 - 4 * sp.sin(2 * t) / 5
    for size, moves in ((1, False), (1 + sp.Rational(1, 10**12), True)):
        block = ap.System.with_frictions({x: v, v: bound * size * drive + F}, {}, (friction,), time=t)
        path = ap.solve(ap.Scene(system=block, start=(0, 0), until=4 if moves else until))
        assert (len(path.events) > 0) == moves


def test_waves_whose_frequencies_are_equal_at_the_values_alone_are_one_whose_amplitudes_add():
    """3/5 cos(w t) + 4/5 cos(2 t) is 7/5 cos(2 t) for w = 2: it exceeds the friction, 1, and the block slips."""
    drive = sp.Rational(3, 5) * sp.sin(w * t) + sp.Rational(4, 5) * sp.sin(2 * t)
    friction = ap.Friction(v, F, 1, sp.S.Half, 1)
    runs = []
    for pull, values in ((drive, {w: 2}), (drive.subs(w, 2), {})):
        block = ap.System.with_frictions({x: v, v: pull + F}, {}, (friction,), time=t)
        runs.append(ap.solve(ap.Scene(system=block, values=values, start=(0, 0), until=6)))
    assert len(runs[0].events) > 1
    assert runs[0].modes == runs[1].modes
    assert runs[0].final == pytest.approx(runs[1].final, abs=1e-13)


@pytest.mark.slow
def test_a_block_that_leaves_its_belt_alone_is_followed_beside_one_that_turns_soon_after():
    """The guard of the last counted as one that vanishes, and the slope was asked for of what was left of it."""
    xs, vs, fs = (sp.symbols(f"{name}0:4", real=True) for name in "xvF")
    q = sp.Rational
    rates = {
        vs[0]: fs[0] / 2 - q(295, 288) * xs[0] + q(5, 9) * xs[1] + q(7, 8) * sp.sin(t / 10) * sp.sin(q(13, 10) * t),
        vs[1]: q(4, 7) * fs[1] + q(40, 63) * xs[0] - q(473, 252) * xs[1] + q(40, 63) * xs[2],
        vs[2]: q(4, 5) * fs[2] + q(8, 9) * xs[1] - q(527, 180) * xs[2] + q(8, 9) * xs[3],
        vs[3]: q(2, 3) * fs[3] + q(20, 27) * xs[2] - q(107, 108) * xs[3],
    }
    bounds = [("9/16", "9/16"), ("3/8", "9/8"), ("7/8", "7/8"), ("5/4", "5/4")]
    belts = [q(3, 8), 0, 0, q(-1, 8)]
    frictions = [ap.Friction(u - belt, force, 1, q(kinetic), q(static))
                 for u, belt, force, (kinetic, static) in zip(vs, belts, fs, bounds, strict=True)]
    blocks = ap.System.with_frictions({**dict(zip(xs, vs, strict=True)), **rates}, {}, frictions, time=t)
    start = {
        "x0": 1.91138186504164, "v0": 0.8707652058177495, "x1": -0.9906558307806694,
        "v1": -1.7507215390313626, "x2": 0.5543474396876231, "v2": -1.687001676019121,
        "x3": 1.4081716896452128, "v3": -1.278347426593224,
    }
    path = ap.solve(ap.Scene(system=blocks, start=start, until=14))
    assert path.events[-2][:1] + path.events[-2][3:] == ("slip_onset", 3)
    assert path.final == pytest.approx([*map(float, ap.solve(path.scene, digits=25).final)], abs=1e-13)


def test_a_rigid_contact_that_the_pull_of_its_ground_unloads_for_no_time_stays_closed_without_end():
    """Its reaction is 1 - sin(t), and the block upon it neither slows down nor opens at the touches."""
    ground = ap.Friction(v, F, G, sp.Rational(1, 100), gap=y, normal=G, constraint=G + sp.sin(t) - 1)
    block = ap.System.with_frictions({x: v, v: F, y: w, w: sp.sin(t) - 1 + G}, {}, (ground,), time=t)
    path = ap.solve(ap.Scene(system=block, start={"x": 0, "v": 10, "y": 0, "w": 0}, until=900))
    assert [(event.kind, path.modes[-1]) for event in path.events] == []
    assert path.final[1] == pytest.approx(10 - (900 + math.cos(900) - 1) / 100, abs=1e-13)


@pytest.mark.slow
def test_a_block_that_creeps_to_rest_is_followed_on_when_a_block_beside_it_begins_to_move():
    """Critically damped, it slips at 1e-274 then. Whether this falls to 0 at once no digits showed."""
    friction, beside = ap.Friction(v, F, 1, sp.Rational(1, 3)), ap.Friction(w, G, 1, sp.Rational(1, 5))
    rates = {x: v, v: -(10**6) * x - 2000 * v + y - x + F, y: w, w: x - y - w / 10 + sp.cos(t) + G}
    blocks = ap.System.with_frictions(rates, {}, (friction, beside), time=t)
    path = ap.solve(ap.Scene(system=blocks, start=(1, 0, 1, 0), until=5))
    ways = ("slip_same", "stick", "slip_opposite", "slip_same")
    assert path.modes[:4] == tuple(f"slip_opposite+{way}" for way in ways)
    rough = ap.solve(path.scene, method="lsoda", rtol=1e-10, atol=1e-12)
    assert path.final == pytest.approx([*map(float, rough.final)], abs=1e-7)


def test_a_touch_is_found_at_a_few_times_however_many_digits_decide_it(monkeypatch):
    """Bounds in doubles rule out the times between, and a guard that is bent upward has one least value."""
    looks, at = [], Guards.at
    monkeypatch.setattr(Guards, "at", lambda *arguments: looks.append(1) or at(*arguments))
    scene = ap.Scene(system=on_a_belt("1/2"), start=("3/2", 0), until=40)
    ap.solve(scene)
    touches = 2 * 6  # in two runs that agree
    assert len(looks) < 15 * touches


def test_what_falls_all_the_way_to_a_triple_root_is_least_at_an_end(monkeypatch):
    searches, dip = [], Guards.dip
    monkeypatch.setattr(Guards, "dip", lambda *arguments: searches.append(1) or dip(*arguments))
    friction = ap.Friction(velocity=v, force=F, load=(1 - t) ** 3, kinetic=1)
    block = ap.System.with_frictions({v: F}, {}, (friction,), time=t)
    path = ap.solve(ap.Scene(system=block, start=(5,), until=2))
    assert [(event.kind, float(event.t)) for event in path.events] == [("force_zero", 1)]
    assert float(path.final[0]) == pytest.approx(4.5, abs=1e-15)
    assert len(searches) < 20


def test_at_a_touch_static_friction_above_the_kinetic_one_holds():
    """It sticks from x = 1/2 to x = 3/5."""
    path = ap.solve(ap.Scene(system=on_a_belt("3/5"), start=("3/2", 0), until=10))
    assert path.modes == ("slip_opposite", "stick", "slip_opposite")
    assert [event.t for event in path.events] == pytest.approx([3 * math.pi / 2, 3 * math.pi / 2 + 0.1], abs=1e-14)


def test_a_load_that_touches_zero_keeps_its_sign():
    path = ap.solve(ap.Scene(system=beside_an_oscillator(1 + x, sp.S.Zero), start=(1, 0, 50), until=20))
    assert path.modes == ("slip_same",)
    assert path.final[2] == pytest.approx(50 - (20 + math.sin(20)) / 2, abs=1e-12)


@pytest.mark.parametrize("until", [3, 10])
def test_an_edge_that_is_only_touched_changes_nothing(until):
    """w = sin(t) touches 1, beyond which the rate of y would be another; the rest of a weight there is rounding."""
    system = ap.System.smooth({x: w, w: -x}, {y: sp.Max(0, w - 1) + x - y}, h := sp.Symbol("h", positive=True))
    path = ap.solve(ap.Scene(system=system, values={h: "1/100"}, start=(-1, 0, 0), until=until))
    slow = -(100 * math.cos(until) + math.sin(until)) * 100 / 10001
    assert path.final == pytest.approx((-math.cos(until), math.sin(until), slow), abs=1e-15)


def test_a_velocity_that_touches_zero_where_the_drive_grows_goes_on():
    """v = 1 + sin(t): at the touch the state x, on which the force that is needed depends, is zero but for rounding."""
    path = ap.solve(ap.Scene(system=beside_an_oscillator(sp.S.One, x + sp.S.Half), start=(1, 0, 1), until=20))
    assert path.modes == ("slip_same",)
    assert path.final[2] == pytest.approx(1 + math.sin(20), abs=1e-14)


@pytest.mark.parametrize(
    ("until", "static", "after"), [(1, "1/2", ()), (1, "3/5", ("stick",)), ("1/3", "3/5", ("stick",))]
)
@pytest.mark.few(2)
def test_a_velocity_that_touches_zero_just_where_the_run_ends_is_met(until, static, after):
    """v = (1 - x)^2 at the time x of a clock that the run stops at 1."""
    friction = ap.Friction(velocity=v, force=F, load=sp.S.One, kinetic=sp.S.Half, static=sp.Rational(static))
    system = ap.System.with_frictions({x: sp.S.One, v: sp.S.Half + 2 * (x - 1) + F}, {}, (friction,))
    until = sp.Rational(until)
    start = {"x": str(1 - until), "v": str(until**2)}
    for digits in (None, 25):
        path = ap.solve(ap.Scene(system=system, start=start, until=str(until)), digits=digits)
        assert path.modes == ("slip_same", *after)
        assert [float(w) for w in path.final] == [1, 0]


@pytest.mark.parametrize(("sigma0", "stops"), [(0, ()), ("1/2", ("stick", "slip_opposite"))])
@pytest.mark.few(1)
def test_a_velocity_that_touches_zero_as_a_cubic_goes_on_or_sticks(sigma0, stops):
    start = dict(zip("xyz", ("-1/2", "-1", "1/3"), strict=True))
    rod = ap.systems.painleve_klein.system()
    scene = ap.Scene(system=rod, values={"sigma": 0, "sigma0": sigma0, "mu": 1}, start=start, until=2)
    assert run(scene).modes == run(scene, digits=25).modes == ("slip_opposite", *stops, "slip_same")


@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.few(1)
def test_a_block_rests_on_where_both_edges_of_its_cone_meet_at_the_tip_and_part_again(digits):
    """The load 1 - sin t vanishes at pi/2 and comes back, and with it what friction may hold on either side."""
    x, v, F, t = sp.symbols("x v F t", real=True)
    friction = ap.Friction(velocity=v, force=F, load=1 - sp.sin(t), kinetic=1)
    block = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=block, values={}, start={"x": 1, "v": 0}, until=9), digits=digits)
    assert (path.modes, path.final) == (("stick",), (1, 0))


@pytest.mark.parametrize(
    ("drive", "start", "modes"),
    [(sp.cos(t), (0, 1, 0, 0), {"stick+stick"}), (-y, (0, 2, 0, 0), {"stick+slip_opposite", "stick+stick"})],
)
@pytest.mark.few(1)
def test_two_blocks_are_followed_past_a_time_at_which_the_drive_of_one_touches_its_bound(drive, start, modes):
    """The drive cos(t) comes to -1 at pi, where the other's does so too, or it comes to rest from y = 1 + cos(t)."""
    blocks = [ap.Friction(velocity=rate, force=force, load=sp.S.One, kinetic=1) for rate, force in ((v, F), (w, G))]
    system = ap.System.with_frictions({x: v, y: w, v: sp.cos(t) + F, w: drive + G}, {}, blocks, time=t)
    path = ap.solve(ap.Scene(system=system, start=start, until=4))
    assert set(path.modes) == modes
    assert [event.t for event in path.events] == pytest.approx([math.pi] * (len(modes) - 1), abs=1e-14)
    assert path.final == pytest.approx([0, start[1] * (len(modes) == 1), 0, 0], abs=1e-14)


@pytest.mark.slow
def test_a_touch_is_told_whatever_digits_were_asked_for_before():
    """Runs of 64 digits and of doubles come upon the same precision; signs count as they are in one of them alone."""
    x, v, F, t = sp.symbols("x v F t", real=True)
    friction = ap.Friction(velocity=v, force=F, load=1 - sp.sin(t), kinetic=1)
    block = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    scene = ap.Scene(system=block, values={}, start={"x": 1, "v": 0}, until=8)
    assert [ap.solve(scene, digits=digits).modes for digits in (64, None)] == [("stick",)] * 2


@pytest.mark.parametrize("digits", [None, 30])
def test_a_velocity_that_vanishes_just_where_the_run_ends_is_met_after_the_drive_of_another_block_touched_its_bound(
    digits,
):
    """The drive 2 sin t touches 2 at pi/2; the other block has the velocity 2 t - t^2 / 2, which vanishes at 4."""
    frictions = [ap.Friction(*pair, load=1, kinetic=kinetic) for kinetic, pair in ((2, (v, F)), (1, (w, G)))]
    blocks = ap.System.with_frictions({v: 2 * sp.sin(t) + F, w: 3 - t + G}, {}, frictions, time=t)
    path = ap.solve(ap.Scene(system=blocks, values={}, start=(0, 0), until=4), digits=digits)
    assert path.modes == ("stick+slip_same", "stick+slip_opposite")
    assert [(event.kind, event.friction, float(event.t)) for event in path.events] == [("velocity_zero", 1, 4)]
    assert [*map(float, path.final)] == [0, 0]


def pushed(drive, start=0, static=1, until=5, **options):
    """A block of the weight 1 and the kinetic friction 1 under a drive that depends on the time."""
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=1, static=static)
    system = ap.System.with_frictions({v: drive + F}, {}, [friction], time=t)
    return ap.solve(ap.Scene(system=system, values={}, start=(start,), until=until), **options)


@pytest.mark.parametrize(
    ("drive", "onset", "end"),
    [
        (1 + (t - 1) ** 3, 1, 64),
        (1 + (t - 1) ** 5, 1, 4**6 / 6),
        (1 - sp.sin(t) ** 3, math.pi, math.cos(5) - math.cos(5) ** 3 / 3 + 2 / 3),
    ],
)
@pytest.mark.few(0)
def test_a_block_slips_where_its_drive_passes_the_bound_of_stick_at_a_multiple_root(drive, onset, end):
    path = pushed(drive)
    assert path.modes == ("stick", "slip_same")
    assert (path.events[0].t, path.final[0]) == pytest.approx((onset, end), rel=1e-15)


@pytest.mark.parametrize("power", [3, 4])
@pytest.mark.few(1)
def test_a_velocity_that_vanishes_as_a_power_at_an_irrational_time_is_met_there(power):
    """It is (2 - t^2)^n, and the block sticks until its drive reaches 2 or -2."""
    path = pushed(sp.diff((2 - t**2) ** power, t) + 1, 2**power, 2, 1.5)
    assert path.modes == ("slip_same", "stick")
    assert path.events[0].t == pytest.approx(math.sqrt(2), rel=1e-15)


@pytest.mark.parametrize("way", [{}, {"digits": 20}, {"method": "radau"}])
@pytest.mark.parametrize("power", [3, 5])
def test_a_block_leaves_rest_under_a_drive_that_grows_as_a_power_from_what_friction_holds(power, way):
    path = pushed(1 + t**power, until=2, **way)
    assert path.modes == ("slip_same",)
    assert float(path.final[0]) == pytest.approx(2 ** (power + 1) / (power + 1), rel=1e-9)


@pytest.mark.parametrize("small", ["1/1000", "1/1000000"])
def test_a_margin_that_decays_to_zero_is_positive_at_a_few_looks_however_long(small, monkeypatch):
    looks, at = [], Guards.at
    monkeypatch.setattr(Guards, "at", lambda *arguments: looks.append(1) or at(*arguments))
    mu = sp.Symbol("mu", positive=True)
    held = ap.System.with_frictions({v: F - 1}, {y: -y}, [ap.Friction(v, F, load=1 + y, kinetic=1)], small=mu)
    assert ap.solve(ap.Scene(system=held, values={mu: small}, start=(0, 1), until=50)).modes == ("stick",)
    assert len(looks) < 200


@pytest.mark.parametrize("digits", [None, 20])
def test_what_stops_while_its_pull_touches_the_bound_of_another_block_may_do_both_at_the_very_end(digits):
    # y = -1 + 2 t - t^2/2 is largest, 1, where w = 2 - t ends at t = 2, and the margin of the other block is 1 - y
    contacts = [ap.Friction(v, F, 1, 1, 2), ap.Friction(w, G, 1, 1)]
    system = ap.System.with_frictions({v: F - 1 - y, y: w, w: G}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start={v: 0, y: -1, w: 2}, until=2), digits=digits)
    assert path.modes[0] == "stick+slip_same"
    assert [*map(float, path.final)] == [0, 1, 0]


@pytest.mark.parametrize(("digits", "until"), [(None, 2 * 10**10), (20, 2 * 10**10), (None, 10**30)])
def test_bounds_that_no_part_of_a_motion_reaches_are_left_out_at_a_few_looks_however_long(digits, until, monkeypatch):
    """In 3e9 periods and more a block rests under half of what would move it; an oscillator alone has no bounds."""
    windows, table = iter(range(10)), mesh.function_table
    monkeypatch.setattr(mesh, "function_table", lambda *given: [table(*given), next(windows)][0])
    friction = ap.Friction(v, F, load=1, kinetic=1)
    for rates, frictions in (({}, []), ({v: sp.sin(t) / 4 + x / 4 + F}, [friction])):
        system = ap.System.with_frictions({x: y, y: -x, **rates}, {}, frictions, time=t)
        path = ap.solve(ap.Scene(system=system, start=(1, 0, *(0 for _ in rates)), until=until), digits=digits)
        assert (path.events, path.final[2:]) == ((), (0,) * len(rates))
        assert float(path.final[0]) == pytest.approx(float(sp.cos(until).evalf(20)), abs=1e-15)


@pytest.mark.parametrize(("push", "near"), [
    (t / 1000, 1000), (sp.exp(t / 500) / 100, 2302), (t * sp.exp(-t / 1000) / 300, 489), (t * sp.sin(t) / 1000, 1000),
    (1 - sp.exp(-t / 500) * t / 1000 + t**2 / 10**6, 297),
])
@pytest.mark.few(2)
def test_a_load_that_slow_parts_take_away_after_long_is_lost_then(push, near):
    system = ap.System.with_frictions({x: y, y: -x, v: F}, {}, [ap.Friction(v, F, 1 - push, 0)], time=t)
    onset = float(sp.nsolve(push - 1, near, prec=20))
    first = ap.solve(ap.Scene(system=system, start=(1, 0, 1), until=onset + 1)).events[0]
    assert (first.kind, first.t) == ("force_zero", pytest.approx(onset, rel=1e-14))


@pytest.mark.slow
@pytest.mark.parametrize("digits", [None, 20])
def test_a_weight_laid_on_a_spring_without_damping_stays_in_touch_although_it_comes_back_to_all_zeros(digits):
    """y = (cos(10 t) - 1)/100; where every state is 0 again, no digit of it is right, and the run was refused."""
    N = sp.Symbol("N", real=True)
    spring = ap.Friction(w, F, load=-100 * y, kinetic=sp.S.Half, gap=y, normal=N)
    system = ap.System.with_frictions({y: v, v: N - 1, w: F}, {}, [spring])
    path = ap.solve(ap.Scene(system=system, start={y: 0, v: 0, w: 0}, until=1), digits=digits)
    assert (path.modes, path.events) == (("stick",), ())
    assert [*map(float, path.final)] == pytest.approx(((math.cos(10) - 1) / 100, -math.sin(10) / 10, 0), abs=1e-15)


def test_a_stop_is_found_however_near_two_fast_rates_are():
    """Both are -1/mu but for a part 10^-40 of them; then z = x - v/5, and v' = 1 - 5x/4 + v/20 until v = 0."""
    z, mu = sp.Symbol("z", real=True), sp.Symbol("mu", positive=True)
    friction = ap.Friction(velocity=v, force=F, load=2 - z / 2, kinetic=sp.S.Half)
    block = ap.System.with_frictions({x: v, v: F - x}, {y: -y - x, z: -v / 5 - y - z}, [friction], small=mu)
    path = ap.solve(ap.Scene(system=block, values={"mu": "1e-40"}, start={"x": 2, "v": 0, "y": 1, "z": 0}, until=5))
    stop = math.pi / math.sqrt(5 / 4 - 1 / 1600)
    assert path.modes == ("slip_opposite", "stick")
    assert path.events[0].t == pytest.approx(stop, abs=1e-15)
    assert path.final[0] == pytest.approx(0.8 - 1.2 * math.exp(stop / 40), abs=1e-15)


def test_a_layer_near_the_smallest_double_is_followed_without_a_warning():
    """Products of its rate and later times leave the range of doubles; outside the layer x = 1 + cos(t/sqrt(2))."""
    mu = sp.Symbol("mu", positive=True)
    block = ap.System.with_frictions({x: v, v: F - x + y}, {y: x / 2 - y}, [ap.Friction(v, F, 1, sp.S.Half)], small=mu)
    path = ap.solve(ap.Scene(system=block, values={"mu": "1e-300"}, start={"x": 2, "v": 0, "y": 1}, until=5))
    assert path.modes == ("slip_opposite", "stick")
    assert path.events[0].t == pytest.approx(math.pi * math.sqrt(2), abs=1e-15)
    assert path.final == pytest.approx((0, 0, 0), abs=1e-15)
