"""The automaton of any system: which mode begins, which follows, and where no motion goes on."""

import itertools
import math
import random
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from peers import here
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, lsq_linear

import asympk as ap
from asympk.affine.run import affine, obstacle
from asympk.automaton import contacts
from asympk.automaton.automaton import Automaton
from asympk.automaton.compiled import function
from asympk.automaton.decide import finite
from asympk.automaton.modes import mode_of
from asympk.certify import certify
from asympk.digits import carrier_context
from asympk.errors import (
    Accumulation,
    InputError,
    NoMotion,
    NotDerivable,
    OutOfRange,
    TwoMotions,
    UnboundedReaction,
    Unfinished,
)
from asympk.symbolic.branches import Phase, ambiguous_contacts, with_signs
from asympk.symbolic.guards import named_branches
from asympk.systems import painleve_rod as rod

x, v, u, w, q, t = sp.symbols("x v u w q t", real=True)
F, G, H, N = sp.symbols("F G H N", real=True)
a, c = sp.symbols("a c", positive=True)
eps = sp.Symbol("eps", positive=True)


@pytest.mark.parametrize(("load", "friction"), [("3", "1/10"), ("13/10", "1/3"), ("1.3", "1.1"), ("3", "5/13")])
def test_a_push_that_is_just_what_friction_holds_leaves_a_block_at_rest_though_no_decimals_hold_it(load, friction):
    block = ap.System.with_frictions({x: v, v: a + F}, {}, [ap.Friction(velocity=v, force=F, load=N, kinetic=c)])
    push = Fraction(load) * Fraction(friction)
    assert follow(block, {x: 0, v: 0}, 1, {N: load, c: friction, a: push}).modes == ("stick",)


@pytest.mark.parametrize("belt", [0, sp.Rational(1, 3)])
def test_what_an_event_leaves_of_its_guard_is_an_error_in_time_and_moves_the_fast_states_alone(belt):
    # mu = 1e-7 at t = 2/3, whose last digit is 1e-9 in the fast time
    contact = ap.Friction(velocity=v - belt, force=F, load=x + u, kinetic=3)
    system = ap.System.with_frictions({x: u, v: 1 - (x + u) + F}, {u: 1 - 2 * (x + u) + F}, [contact], small=eps)
    automaton = Automaton(system, (sp.Rational(1, 10**7),))
    stick = automaton.mode(next(b for b in named_branches(system) if mode_of(system, b).name == "stick"))
    state = (0.9, float(belt), -0.65 + 1e-9)
    guard = min(range(2), key=lambda k: abs(stick.guard_values(2 / 3, state)[k]))
    moved = stick.snapped(guard, 2 / 3, state)
    assert moved[:2] == pytest.approx(state[:2], abs=1e-15)
    assert abs(moved[2] - state[2]) == pytest.approx(1e-9, rel=1e-3)
    assert stick.guard_values(2 / 3, moved)[guard] == pytest.approx(0, abs=1e-15)


def test_first_derivatives_of_guards_that_vanish_together_are_those_of_one_function(monkeypatch):
    """Each alone has the rates of all states in it, which took a third of the time of a landing on two legs."""
    real, asked = contacts.function, set()

    def function(system, outputs, target, functions, directions=(), **others):
        asked.add((outputs, directions))
        return real(system, outputs, target, functions, directions, **others)

    monkeypatch.setattr(contacts, "function", function)
    laws = [ap.Friction(force=F, velocity=v, load=1, kinetic=sp.Rational(1, 2), static=1),
            ap.Friction(force=G, velocity=w, load=1, kinetic=1, static=2)]
    pushed = ap.System.with_frictions({v: F + t, w: G - 2 * t}, {}, laws, time=t)
    path = ap.solve(ap.Scene(system=pushed, start={v: 0, w: 0}, until=2))
    assert [(event.kind, event.t) for event in path.events] == [("slip_onset", 1)]
    assert path.final == (1, -2)
    assert [{*outputs} for outputs, directions in asked if directions == ((1, 0, 0),)] == [{1 - t, 2 - 2 * t}]


def test_a_rate_that_is_clearly_no_multiple_of_a_velocity_at_rest_is_not_expanded(monkeypatch):
    block = ap.System.with_frictions({x: v, u: x, v: F - 1}, {}, [ap.Friction(force=F, velocity=v, load=1, kinetic=c)])
    (rest,) = (mode for mode in (mode_of(block, b) for b in named_branches(block)) if mode.name == "stick")
    assert rest.rates == (v, x, 0)
    monkeypatch.setattr(sp, "expand", None)
    assert rest.drift(x + u) == v + x


@pytest.mark.parametrize("name", ["bead_rod", "held_rod"])
@pytest.mark.few(1)
def test_derivatives_through_shared_parts_are_those_of_the_expressions_written_out(name):
    system, numbers, rng = getattr(ap.systems, name).system(), carrier_context(40), random.Random(1)
    for branch in named_branches(system):
        mode = mode_of(system, branch)
        place = [numbers.mpf(rng.uniform(0.3, 1.2)) for _ in range(1 + len(system.states) + len(system.parameters))]
        written_out = (*(rate.diff(s) for rate in mode.rates for s in system.states),
                       *(mode.lie_derivative(value) for value in mode.guard_values))
        jacobian = function(system, mode.rates, "mpmath", numbers, mode.units)(*place)
        guard_rates = function(system, mode.guard_values, "mpmath", numbers, (mode.flow,))(*place)
        expected = function(system, written_out, "mpmath", numbers)(*place)
        for found, value in zip((*jacobian, *guard_rates), expected, strict=True):
            assert abs(found - value) < 1e-38 * (1 + abs(value))


def follow(system, start, until, values=(), **options):
    return ap.solve(ap.Scene(system=system, values=dict(values), start=start, until=until), **options)


def users_rod():
    """Return the rod as a user would write it: other names, and the rough mass a times heavier in its own units."""
    load = x + v
    return ap.System.with_friction(
        slow={x: v}, fast={v: 1 - 2 * load + F}, velocity={q: (1 - load + F) / a}, force=F, load=load,
        kinetic=c, static=sp.Symbol("c0", positive=True), small=eps, assumptions=c > 0,
    )


def test_a_users_rod_under_other_names_has_the_events_and_the_ends_of_the_kernel():
    rng, system = random.Random(5), users_rod()
    for _ in range(60):
        sigma = rng.choice([1.0, rng.uniform(-1.9, 4)])
        sigma0 = sigma + rng.choice([0.0, rng.uniform(0, 2)])
        start = (rng.uniform(-2, 2), rng.uniform(-2, 2), rng.choice([0.0, rng.uniform(-2, 2)]))
        mu, mass = 10 ** rng.uniform(-4, 0), rng.uniform(0.5, 3)
        exact = ap.solve(ap.Scene(sigma, mu, start, 3, sigma0=sigma0))
        values = {"eps": mu, "a": mass, "c": sigma + 2, "c0": sigma0 + 2}
        path = follow(system, (*start[:2], start[2] / mass), 3, values, method="lsoda", rtol=1e-9)
        assert path.modes == exact.modes
        assert [e.kind for e in path.events] == [e.kind for e in exact.events]
        assert np.allclose([e.t for e in path.events], [e.t for e in exact.events], rtol=1e-6, atol=1e-6)
        scale = 1 + max(map(abs, exact.final))
        assert np.allclose((path.final[0], mass * path.final[2]), exact.final[::2], atol=1e-5 * scale)


def test_the_rods_own_system_goes_to_the_rods_kernel():
    pk = ap.systems.painleve_klein.system()
    path = follow(pk, {"x": 0, "y": "0.2", "z": -1}, 5, {"sigma": 1, "sigma0": 1, "mu": "1e-6"})
    plain = ap.solve(ap.Scene(sigma=1, mu="1e-6", start=(0, "0.2", -1), until=5))
    assert (path.final, path.modes, path.names) == (plain.final, plain.modes, ("x", "y", "z"))
    assert path.scene.system is pk


# exact stories


def block(kinetic=1, static=1, stiffness=1):
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=kinetic, static=static)
    return ap.System.with_frictions({x: v, v: -stiffness * x + F}, {}, [friction])


def test_a_block_on_a_spring_loses_twice_the_friction_in_every_half_period_and_then_rests():
    path = follow(block(), {"x": "7.5", "v": 0}, 20)
    assert [e.kind for e in path.events] == ["velocity_zero"] * 4
    assert np.allclose([float(e.t) for e in path.events], [math.pi * k for k in (1, 2, 3, 4)], atol=1e-8)
    assert np.allclose([float(e.state[0]) for e in path.events], [-5.5, 3.5, -1.5, -0.5], atol=1e-8)
    assert path.modes == ("slip_opposite", "slip_same", "slip_opposite", "slip_same", "stick")


def clutches():
    """Return three discs of unit inertia in a row, the last against the ground."""
    half, quarter, tenth = sp.Rational(1, 2), sp.Rational(1, 4), sp.Rational(1, 10)
    frictions = [
        ap.Friction(velocity=u - v, force=F, load=1, kinetic=half, static=sp.Rational(3, 4)),
        ap.Friction(velocity=v - w, force=G, load=1, kinetic=quarter),
        ap.Friction(velocity=w, force=H, load=1, kinetic=tenth, static=2 * tenth),
    ]
    return ap.System.with_frictions({u: F, v: -F + G, w: -G + H}, {}, frictions)


def test_clutches_in_a_row_lock_one_after_the_other_at_the_times_of_their_momentum():
    path = follow(clutches(), {"u": 3, "v": 0, "w": 0}, 60)
    assert [(e.kind, e.friction) for e in path.events] == [("velocity_zero", k) for k in (0, 1, 2)]
    # u' = -1/2, v' = 1/4, w' = 3/20; then (u, v) at -1/8; then all at -1/30
    assert np.allclose([float(e.t) for e in path.events], [4, 60 / 11, 30], rtol=1e-10)
    assert path.modes == ("+".join(["slip_same"] * 3), "stick+slip_same+slip_same", "stick+stick+slip_same",
                          "stick+stick+stick")
    assert np.allclose(np.array(path.final, float), 0, atol=1e-12)


def test_discs_at_rest_stay_at_rest():
    assert follow(clutches(), {"u": 0, "v": 0, "w": 0}, 5).modes == ("stick+stick+stick",)


def test_a_mechanism_without_weight_at_rest_on_an_elastic_contact_stays_at_rest():
    r, phi, r_, phi_ = sp.symbols("r phi r_ phi_")
    forces = (r * phi_**2 + w * sp.cos(phi), -2 * r * r_ * phi_ - w * r * sp.sin(phi))  # on a hoop, w its weight
    bead = ap.Mechanism((r, phi), (r_, phi_), sp.diag(1, r**2), forces, ap.Contact(1 - r, r * phi_, sp.S.Half))
    soft = bead.elastic(compliance=eps, damping=1)
    start = bead.start(soft, {"r": 1, "phi": 1, "r'": 0, "phi'": 0})
    path = ap.solve(ap.Scene(system=soft, values={w: 0, eps: "1e-3"}, start=start, until=1))
    assert path.modes == ("stick",)
    assert path.final == (1, 1, 0, 0, 0, 0, 0)  # r, phi, x, their rates, y, z


@pytest.mark.parametrize("options", [{}, {"digits": 20}, {"method": "radau"}])
@pytest.mark.parametrize("velocity", [0, 1])
def test_a_mechanism_without_weight_slides_on_an_elastic_contact_without_friction(velocity, options):
    """Whether a contact whose load vanishes for ever counts as closed or as open, its motion is one."""
    (X, Y, U, V), (f, c) = sp.symbols("X Y U V"), sp.symbols("f c", positive=True)
    block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (1, 0), ap.Contact(Y, X, f, unilateral=True))
    system = block.elastic(c, 1)
    start = block.start(system, {X: 0, Y: 0, U: velocity, V: 0, f: 1})
    path = ap.solve(ap.Scene(system=system, values={f: 1, c: "1e-3"}, start=start, until=2), **options)
    assert dict(zip(path.names, map(float, path.final), strict=True)) == pytest.approx(
        {"X": 2 + 2 * velocity, "Y": 0, "x": 0, "y": 0, "z": 2 + velocity})


@pytest.mark.slow
def test_what_rounding_makes_of_a_difference_is_known_whichever_states_it_is_of():
    """The load is that of two states which nearly cancel, and falls; the push is all that it holds, but for 6e-16."""
    states = v, *others = sp.symbols("v s0:5", real=True)
    F, load = sp.Symbol("F", real=True), 0.5 - 0.4853
    for a, b, push in itertools.permutations(others, 3):
        rates = {**dict.fromkeys(states, 0), v: push + F, b: -1}
        system = ap.System.with_frictions(rates, {}, [ap.Friction(velocity=v, force=F, load=a + b, kinetic=1)])
        here = tuple({a: 0.5, b: -0.4853, push: load - 6e-16}.get(s, 0.0) for s in states)
        automaton = Automaton(system, ())
        stick = automaton.first((0, *(1,) * 5))
        lost = automaton.mode(stick).kinds.index(("slip_onset", 0))
        after = automaton.next(stick, (lost + 1,), 0.25, here)
        assert automaton.mode(after).name == "slip_same"


def test_a_locked_clutch_slips_again_where_the_torque_exceeds_its_static_bound_and_not_before():
    drive = ap.Friction(velocity=u - v, force=F, load=1, kinetic=1, static=2)
    system = ap.System.with_frictions({u: t + F, v: -F}, {}, [drive], time=t)
    path = follow(system, {"u": 0, "v": 0}, 6)
    (onset,) = path.events  # while locked both gain t/2, held by F = -t/2
    assert (onset.kind, path.modes) == ("slip_onset", ("stick", "slip_same"))
    assert float(onset.t) == pytest.approx(4, rel=1e-10)
    assert np.allclose(np.array(path.final, float), (4 + 10 - 2, 4 + 2), rtol=1e-8)


def test_a_belt_carries_a_block_to_the_edge_of_stick_and_takes_it_up_again():
    """Constant kinetic friction: from v = 1 at the edge x = s the block swings about x = k until v = 1 again."""
    s, k = sp.Rational(3, 2), 1
    belt = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=k, static=s)
    system = ap.System.with_frictions({x: v, v: -x + F}, {}, [belt])
    path = follow(system, {"x": 0, "v": 1}, 7.5)
    slipped = 2 * math.pi - 2 * math.atan2(0.5, 1)
    assert path.modes == ("stick", "slip_opposite", "stick")
    assert np.allclose([float(e.t) for e in path.events], [1.5, 1.5 + slipped], rtol=1e-9)
    assert float(path.events[1].state[0]) == pytest.approx(0.5, abs=1e-8)


def test_friction_that_falls_with_the_velocity_is_that_of_the_relative_one():
    belt = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=1 / (1 + sp.Abs(v - 1)), static=1)
    system = ap.System.with_frictions({v: -sp.Rational(2) + F}, {}, [belt])
    path = follow(system, {"v": 1}, 2)
    assert path.modes == ("slip_opposite",)  # v' = -2 + 1/(2 - v): with d = 1 - v, d - log(...) is linear in t
    d = 1 - float(path.final[0])
    assert d / 2 + math.log(1 + 2 * d) / 4 == pytest.approx(2, rel=1e-8)


def test_a_contact_opens_where_its_load_vanishes_and_closes_where_its_gap_does():
    """A mass on an elastic ground: it leaves at x = 0 and comes back after the time of its flight."""
    contact = ap.Friction(velocity=v, force=F, load=-x, kinetic=1, gap=x, normal=N)
    system = ap.System.with_frictions({x: w, w: -1 + N, v: F}, {}, [contact])
    path = follow(system, {"x": 0, "w": -2, "v": 50}, 14)
    assert [e.kind for e in path.events[:3]] == ["lift_off", "touch_down", "lift_off"]
    first, second = (float(e.t) for e in path.events[:2])
    assert first == pytest.approx(2 * math.pi - 2 * math.atan(2), rel=1e-8)
    assert second - first == pytest.approx(4, rel=1e-8)
    assert path.modes[:3] == ("slip_same", "open", "slip_same")
    lost = 50 - float(path.events[0].state[2])
    assert lost == pytest.approx(first + 4, rel=1e-8)  # the impulse of the ground: w returns from -2 to 2 under gravity


# no motion, several, and events that accumulate


def rigid_rod():
    """Return the rigid Painlevé-Klein rod: the reaction N makes the accelerations of both masses equal."""
    friction = ap.Friction(velocity=v, force=F, load=N, kinetic=c, normal=N, constraint=1 - 2 * N + F)
    return ap.System.with_frictions({v: 1 - N + F}, {}, [friction])


def test_the_rigid_rod_runs_where_it_is_shallow_and_stops_by_name_where_it_is_steep():
    assert follow(rigid_rod(), {"v": 1}, 3, {"c": 1}).final == pytest.approx((2,))
    shallow = follow(rigid_rod(), {"v": -1}, 3, {"c": 1})
    assert shallow.modes == ("slip_opposite", "slip_same")
    assert shallow.final == pytest.approx((2 / 3,))
    with pytest.raises(TwoMotions, match=r"at t = 0, v = 1: slip_opposite .* and slip_same"):
        follow(rigid_rod(), {"v": 1}, 3, {"c": 3})
    with pytest.raises(NoMotion, match="at t = 0, v = -1"):
        follow(rigid_rod(), {"v": -1}, 3, {"c": 3})


def test_a_load_that_rises_with_its_friction_has_a_second_motion_beyond_its_critical_friction_as_soon_as_it_slides():
    """With load 1 + 4/5 F, v > 0: |load| (1 +- 4/5 kinetic) = +- 1, where both signs have a solution from 5/4 on."""
    shoe = ap.Friction(velocity=v, force=F, load=1 + sp.Rational(4, 5) * F, kinetic=c)
    system = ap.System.with_frictions({v: 1 + F}, {}, [shoe])
    assert follow(system, {"v": 0}, 3, {"c": 1}).final == pytest.approx((3 * (1 - 1 / 1.8),))
    with pytest.raises(TwoMotions, match="a second motion of the contact comes up at t = 0, v = 0, in mode slip_same"):
        follow(system, {"v": 0}, 3, {"c": 3})
    with pytest.raises(NoMotion, match="at t = 0, v = -1"):
        follow(system, {"v": -1}, 3, {"c": 3})
    growing = ap.System.with_frictions({v: 1 + F}, {}, [replace(shoe, kinetic=t, static=t)], time=t)
    for method in ("exact", "dop853"):
        with pytest.raises(TwoMotions, match=r"a second motion of the contact comes up at t = 1\.25"):
            follow(growing, {"v": 1}, 3, method=method)
    with pytest.raises(UnboundedReaction, match=r"the reaction of a contact grows .* at t = 1\.25, v = "):
        follow(growing, {"v": -90}, 3)
    other = ap.Friction(velocity=w, force=G, load=4 + F + G / 3, kinetic=t / 5)
    pair = ap.System.with_frictions({v: 1 + F, w: 3 + G}, {}, [replace(shoe, kinetic=t, static=t), other], time=t)
    with pytest.raises(TwoMotions, match=r"several motions go on at t = 1\.25, v = ") as stop:
        follow(pair, {"v": 1, "w": 1}, 3)
    assert stop.value.t == pytest.approx(1.25, rel=1e-6)
    chain = replace(shoe, load=1), replace(other, load=4 + F)
    assert not ambiguous_contacts(ap.System.with_frictions({v: 1 + F, w: 3 + G}, {}, chain, time=t))


def test_a_second_motion_comes_up_also_at_a_contact_that_may_open():
    """Pressed in by 1/100, it is at rest normally; started beyond the critical friction it was refused, as always."""
    gap, rate = sp.symbols("g q", real=True)
    press = -100 * gap - 2 * rate
    shoe = ap.Friction(velocity=v, force=F, load=press + sp.Rational(4, 5) * F, kinetic=t, gap=gap)
    system = ap.System.with_frictions({v: 1 + F, gap: rate, rate: press - 1}, {}, [shoe], time=t)
    with pytest.raises(TwoMotions, match=r"a second motion of the contact comes up at t = 1\.25"):
        follow(system, {"v": 1, "g": "-1/100", "q": 0}, 3)


def test_a_reaction_that_grows_beyond_all_bounds_ends_the_run_by_name():
    friction = ap.Friction(velocity=v, force=F, load=N, kinetic=t, normal=N, constraint=1 - 2 * N + F)
    system = ap.System.with_frictions({v: 1 - N + F}, {}, [friction], time=t)
    with pytest.raises(UnboundedReaction, match=r"t = 2|t = 1\.99999"):
        follow(system, {"v": -90}, 3)


@pytest.mark.further
def test_a_reaction_that_grows_beyond_all_bounds_after_hundreds_of_swings_of_another_body_is_found_by_steps():
    """v' = 1 + (t - 1)/(2 - t): v is log(2/p) - 90 where p = 2 - t has fallen to 2e-8."""
    friction = ap.Friction(velocity=v, force=F, load=N, kinetic=t, normal=N, constraint=1 - 2 * N + F)
    swings = ap.System.with_frictions({v: 1 - N + F, x: w, w: -4_000_000 * x}, {}, [friction], time=t)
    with pytest.raises(UnboundedReaction, match=rf"t = 1\.99999998, v = {math.log(1e8) - 90:.3f}"):
        follow(swings, {"v": -90, "x": 1, "w": 0}, 3, method="dop853", rtol=1e-4)


def test_a_twisting_relay_accumulates_where_its_events_shrink_geometrically_to():
    frictions = [ap.Friction(velocity=s, force=f, load=1, kinetic=k) for s, f, k in ((x, F, 3), (v, G, 1))]
    twisting = ap.System.with_frictions({x: v, v: F + G}, {}, frictions)
    # from rest at |x| = 1 it falls at 3 - 1 for a time 1 and is braked at 3 + 1 for 1/2: the next swing is half as high
    total = 1.5 / (1 - math.sqrt(0.5))
    with pytest.raises(Accumulation, match=r"accumulate at t = 5\.1213203.*; no run passes infinitely many") as caught:
        follow(twisting, {"x": 1, "v": 0}, 60)
    assert follow(twisting, {"x": 0, "v": 0}, 1).modes == ("stick+stick",)  # a mode goes on from there all the same
    assert float(str(caught.value).split("t = ")[1].split(",")[0]) == pytest.approx(total, rel=1e-9)


def test_a_super_twisting_law_accumulates_though_few_events_are_as_far_apart_as_the_error_of_a_step():
    """With r^2 = |x| and dt = r ds, (r sign(x), w) turns by 1/2 and shrinks by e^(-1/2) as s grows by 1."""
    root = 2 * sp.sqrt(sp.Abs(x)) * sp.sign(x)
    law = ap.System.with_frictions({x: w - root, w: F}, {}, [ap.Friction(velocity=x, force=F, load=1, kinetic=1)])
    total = math.sqrt(8) * math.exp(-math.pi / 4) / (1 - math.exp(-math.pi))
    with pytest.raises(Accumulation, match=r"accumulate at t = ") as caught:
        follow(law, {"x": 1, "w": 0}, 3)
    assert float(str(caught.value).split("t = ")[1].split(",")[0]) == pytest.approx(total, rel=1e-5)


@pytest.mark.parametrize("switched", [v, x])
def test_what_rests_stays_at_rest_where_its_force_draws_it_back_whether_or_not_the_force_is_determined(switched):
    """x'' = t - 1 after t = 1, or t + 1 or t - 1 where the force pushes on; rest on x = 0 leaves F to the rate of v."""
    friction = ap.Friction(velocity=switched, force=F, load=1, kinetic=1)
    path = follow(ap.System.with_frictions({x: v, v: F + t}, {}, [friction], time=t), {"x": 0, "v": 0}, 1.5)
    assert (path.modes, path.events[0].kind) == (("stick", "slip_same"), "slip_onset")
    assert path.events[0].t == pytest.approx(1)
    assert path.final == pytest.approx((1 / 48, 1 / 8))
    refused = {v: (ap.errors.InputError, "rate of the velocity v falls with the force F"),
               x: (TwoMotions, r"at t = 0.* \(velocity < 0\) and .* \(velocity > 0\) and stick")}
    error, words = refused[switched]
    with pytest.raises(error, match=words):
        follow(ap.System.with_frictions({x: v, v: t - F}, {}, [friction], time=t), {"x": 0, "v": 0}, 1.5)


@pytest.mark.parametrize("options", [{}, {"method": "radau"}, {"digits": 20}])
def test_a_sliding_motion_ends_where_its_surface_begins_to_repel_from_both_sides(options):
    """w' = x sign(w): |w| grows by (x**2 - c**2)/2 from any x = c > 0 on, or stays 0."""
    fold = ap.System.with_frictions({x: 1, w: -x * F}, {}, [ap.Friction(w, F, 1, 1)])
    with pytest.raises(TwoMotions, match=r"a second motion of the contact comes up at t = 1, .* in mode stick"):
        follow(fold, {"x": -1, "w": 0}, 3, **options)
    with pytest.raises(TwoMotions, match="several motions go on at t = 0, x = 1, w = 0"):
        follow(fold, {"x": 1, "w": 0}, 1, **options)
    assert certify(ap.Scene(system=fold, start={"x": -1, "w": 0}, until="1/2")).modes == ("stick",)
    assert not certify(ap.Scene(system=fold, start={"x": -1, "w": 0}, until=3)).proven
    assert not certify(ap.Scene(system=fold, start={"x": 1, "w": 0}, until=3)).proven


@pytest.mark.parametrize("method", ["radau", "dop853"])
def test_a_sliding_motion_also_ends_where_its_force_is_0_over_0_and_the_surface_begins_to_repel(method):
    """w' = u - x F with u = 3 x/10: F is 3/10 before x = 0, where slip forward, w' = 13 x/10, begins to leave."""
    rates = {x: 1, w: u - x * F, u: sp.Rational(3, 10)}
    fold = ap.System.with_frictions(rates, {}, [ap.Friction(w, F, 1, 1)])
    with pytest.raises(TwoMotions, match=r"a second motion of the contact comes up at t = (1|0\.99999999)"):
        follow(fold, {"x": -1, "u": "-0.3", "w": 0}, 3, method=method)
    path = follow(fold, {"x": -1, "u": "-0.2", "w": 0}, 3, method=method)  # u = (1 + 3 x)/10 is -x at x = -1/13
    assert (path.modes[1], float(path.events[0].t)) == ("slip_same", pytest.approx(12 / 13))


@pytest.mark.parametrize("options", [{}, {"digits": 20}])
@pytest.mark.parametrize(("slopes", "until"), [(("5/2", "5/2"), "4/3"), (("2", "3/4"), "19/2"), (("1", "3/2"), 9)])
@pytest.mark.few(2)
def test_a_sliding_motion_into_a_two_fold_ends_there(slopes, until, options):
    """In the time s, dt = (y + z) ds, the sliding motion is linear, (y, z)' = M (y, z), and 0 a node.

    From (1, 1) it takes the time -(1, 1) M^-1 (1, 1) (Teixeira 1990; Colombo and Jeffrey 2011).
    """
    y, z, p, q = sp.symbols("y z p q", real=True)  # before the fold (y', z') = (1, -p), behind it (-q, 1)
    rates = {w: (z - y) / 2 + (z + y) / 2 * F, y: (1 - q) / 2 - (1 + q) / 2 * F, z: (1 - p) / 2 + (1 + p) / 2 * F}
    two_fold = ap.System.with_frictions(rates, {}, [ap.Friction(w, F, 1, 1)])
    with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as stop:
        follow(two_fold, (0, 1, 1), 10, values=dict(zip((p, q), slopes, strict=True)), **options)
    assert (float(stop.value.t), stop.value.state) == (pytest.approx(float(Fraction(until))), pytest.approx((0,) * 3))



# events that a step could miss


def test_a_guard_that_leaves_and_comes_back_within_a_step_is_an_event():
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=0, static=0)
    bump = sp.Rational(1001, 1000) * sp.exp(-((t - 5) ** 2) * 4)
    system = ap.System.with_frictions({v: -bump.diff(t) + F}, {}, [friction], time=t)
    path = follow(system, {"v": 1}, 10, method="dop853", rtol=1e-3)
    assert [e.kind for e in path.events] == ["velocity_zero"] * 2


def test_a_load_that_swings_while_the_state_rests_ends_stick_at_every_swing():
    friction = ap.Friction(velocity=v, force=F, load=sp.cos(t), kinetic=1)
    system = ap.System.with_frictions({v: sp.Rational(1, 2) + F}, {}, [friction], time=t)
    path = follow(system, {"v": 0}, 4.5, method="lsoda")
    assert path.modes == ("stick", "slip_same", "slip_opposite", "stick", "slip_opposite")
    onset, vanished = path.events[0], path.events[1]
    assert [float(e.t) for e in (onset, vanished)] == pytest.approx([math.pi / 3, math.pi / 2], abs=1e-6)


@pytest.mark.parametrize("method", ["exact", "radau", "lsoda", "dop853"])
@pytest.mark.parametrize("part", [34, 36, 38])
@pytest.mark.few(2)
def test_a_push_in_which_large_terms_cancel_sets_a_block_in_motion(part, method):
    """Doubles take it for the edge of stick a little before or after the time at which it is."""
    t, v, force = sp.symbols("t v F", real=True)
    turn = 3 + sp.Rational(part, 97)
    push = sp.Piecewise((0, t < turn - sp.Rational(1, 200)), (sp.expand(10**6 * (t - turn) ** 3), True))
    contact = ap.Friction(velocity=v, force=force, load=1, kinetic=sp.Rational(1, 5))
    system = ap.System.with_frictions({v: force + push}, {}, [contact], time=t)
    path = ap.solve(ap.Scene(system=system, start={v: 0}, until=turn + sp.Rational(1, 100)), method)
    assert path.modes == ("stick", "slip_same")
    assert path.events[0].t == pytest.approx(float(turn) + 2e-7 ** (1 / 3), abs=1e-9)


@pytest.mark.parametrize("method", ["exact", "radau", "lsoda", "dop853"])
@pytest.mark.parametrize(("at", "lacking"), [(1, -13), ("4/3", -14)])
@pytest.mark.few(2)
def test_a_push_that_leaves_the_edge_of_stick_near_a_triple_root_sets_a_block_in_motion(at, lacking, method):
    """In doubles the margin is 0 for a time of about its rounding by its slope there, far beyond that of the time."""
    t, v, force = sp.symbols("t v F", real=True)
    lack, turn = sp.Rational(10) ** lacking, sp.Rational(at)
    push = 1 - lack + (t - turn) ** 3
    contact = ap.Friction(velocity=v, force=force, load=1, kinetic=1)
    system = ap.System.with_frictions({v: push + force}, {}, [contact], time=t)
    start = -sp.integrate(push + 1, (t, 0, turn))
    path = ap.solve(ap.Scene(system=system, start={v: start}, until=2), method)
    assert path.modes == ("slip_opposite", "stick", "slip_same")
    assert path.events[1].t == pytest.approx(float(turn + lack ** sp.Rational(1, 3)), abs=1e-6)


MODERATE, ICE = sp.Rational(1, 5), sp.Rational(1, 20)
UPHILL = sp.sqrt(sp.Rational(3, 5))  # the velocity from 1 after a way of 1 with friction 1/5


def sliding(kinetic, push=0):
    x, v, force = sp.symbols("x v F", real=True)
    contact = ap.Friction(velocity=v, force=force, load=1, kinetic=kinetic)
    return ap.System.with_frictions({x: v, v: force + push}, {}, [contact])


@pytest.mark.parametrize("how", [{}, *({"method": m} for m in ("radau", "lsoda", "dop853")), {"digits": 12}])
@pytest.mark.parametrize("laws", ["ice", "strip", "push"])
def test_what_jumps_with_the_place_is_met_where_it_does(laws, how):
    """A block that slides on at v with the friction k has v'^2 = v^2 - 2 k d after the way d."""
    x = sp.Symbol("x", real=True)
    end, short = sp.Rational(101, 100), sp.Rational(1, 100)
    within = (x > 1) & (x < end)
    system, drag, width, after = {
        "ice": (sliding(sp.Piecewise((MODERATE, x < 1), (ICE, True))), 0, 0, ICE),
        "strip": (sliding(sp.Piecewise((2, within), (MODERATE, True))), 2, short, MODERATE),
        "push": (sliding(MODERATE, 10 * sp.Piecewise((1, within), (0, True))), MODERATE - 10, short, MODERATE),
    }[laws]
    leaves = sp.sqrt(UPHILL**2 - 2 * drag * width)
    left = 2 - (1 - UPHILL) / MODERATE - ((UPHILL - leaves) / drag if drag else 0)
    path = ap.solve(ap.Scene(system=system, start={"x": 0, "v": 1}, until=2), **how)
    expected = 1 + width + leaves * left - after * left**2 / 2, leaves - after * left
    tolerance = 1e-4 if "method" in how else 1e-8 if not how else 1e-12
    assert [float(w) for w in path.final] == pytest.approx([float(w) for w in expected], abs=tolerance)
    assert path.modes == ("slip_same",)


@pytest.mark.parametrize("how", [{}, {"method": "radau"}, {"digits": 12}])
@pytest.mark.parametrize(("velocity", "end", "last"), [(1, "151/40", "17/20"), (-1, "-11/10", "-2/5"), (0, 1, 0)])
def test_a_start_on_the_edge_of_the_ice_goes_on_upon_its_own_side(velocity, end, last, how):
    x = sp.Symbol("x", real=True)
    system = sliding(sp.Piecewise((MODERATE, x < 1), (ICE, True)))
    path = ap.solve(ap.Scene(system=system, start={"x": 1, "v": velocity}, until=3), **how)
    assert [float(w) for w in path.final] == pytest.approx([float(Fraction(end)), float(Fraction(last))], abs=1e-9)


@pytest.mark.parametrize("how", [{}, {"method": "radau"}, {"digits": 12}])
def test_a_force_of_constant_size_towards_a_point_throws_parabolas(how):
    x, v = sp.symbols("x v", real=True)
    system = ap.System.with_frictions({x: v, v: -sp.sign(x)}, {}, [])
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 1}, until=5), **how)
    assert [float(w) for w in path.final] == pytest.approx([0.5, 0], abs=1e-8)


def test_a_motion_that_stays_where_a_rate_jumps_is_refused_by_name():
    x, v = sp.symbols("x v", real=True)
    system = ap.System.with_frictions({x: v, v: -x - sp.sign(v) / 4}, {}, [])
    with pytest.raises(NotDerivable, match=r"stays on v = 0 .* write what jumps there as a friction"):
        ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=20), "radau")


def test_a_rate_that_jumps_with_a_state_is_affine_where_its_sides_are_and_has_no_one_law():
    x, v = sp.symbols("x v", real=True)
    ice = sliding(sp.Piecewise((MODERATE, x < 1), (ICE, True)))
    assert obstacle(ice) is None
    assert not affine(ice)
    assert "not affine" in obstacle(sliding(MODERATE, sp.Max(x - 1, 0) ** 2))
    assert "not affine" in obstacle(sliding(MODERATE, sp.Abs(x) * sp.Max(v, 0)))


def test_a_rate_that_switches_without_end_in_time_says_what_may_be_given_for_it():
    x, v, t = sp.symbols("x v t", real=True)
    stepped = ap.System.with_frictions({x: v, v: sp.floor(t)}, {}, [], time=t)
    assert obstacle(stepped).endswith("floor(t); it switches at more than 16 times: give a Piecewise with fewer")


@pytest.mark.parametrize(("how", "tolerance"), [({}, 1e-8), ({"method": "radau"}, 1e-5), ({"digits": 15}, 1e-14)])
def test_a_pendulum_whose_time_is_counted_in_half_periods_has_the_square_of_pi_in_its_rate(how, tolerance):
    x, v = sp.symbols("x v", real=True)
    fast, slow = (ap.System.with_frictions({x: v, v: -pace * sp.sin(x)}, {}, []) for pace in (sp.pi**2, 1))
    path = ap.solve(ap.Scene(system=fast, start={x: 1, v: 0}, until=1), **how)
    truth = ap.solve(ap.Scene(system=slow, start={x: 1, v: 0}, until=sp.Rational(str(sp.pi.n(30)))), digits=18).final
    assert [float(w) for w in path.final] == pytest.approx([float(truth[0]), float(truth[1] * sp.pi)], abs=tolerance)


def test_automata_of_one_system_and_one_choice_of_numbers_are_equal():
    system = block()
    assert Automaton(system, ()) == Automaton(block(), ())
    assert hash(Automaton(system, ())) == hash(Automaton(block(), ()))


# wrong input


@pytest.mark.parametrize(("make", "match"), [
    (lambda: ap.Scene(system=block(), values={}, start={"x": 1}, until=1), "the state v is missing"),
    (lambda: ap.Scene(system=block(), values={}, start={}, until=1), "the states v, x are missing"),
    (lambda: ap.Scene(system=block(), values={}, start={"x": 1, "vv": 1}, until=1), "did you mean v"),
    (lambda: ap.Scene(system=block(), values={"k": 1}, start={"x": 1, "v": 1}, until=1), "k is not a parameter"),
    (lambda: ap.Scene(system=block(), values={}, start={10**5000: 1}, until=1), "very many digits. is not a state"),
    (lambda: ap.Scene(system=block(), values={}, start={"x": "y", "v": 1}, until=1), "start: x = 'y'"),
    (lambda: ap.Scene(system=block(), values={}, start={x: 1, "x": 2, v: 1}, until=1), "given twice"),
    (lambda: ap.Scene(system=block(), values={}, start={sp.Symbol("x"): 1, v: 1}, until=1), "by name, 'x'"),
    (lambda: ap.Scene(system=block(), values={}, start=(1, 2, 3), until=1), "3 numbers for 2"),
    (lambda: ap.Scene(system=block(), values={}, start={1, 2}, until=1), "start = {1, 2}: it must map each state"),
    (lambda: ap.Scene(system=block(static=sp.Rational(1, 2)), values={}, start=(1, 0), until=1),
     "static friction 1/2 is below the kinetic one, 1; make"),
    (lambda: ap.Scene(system=block(u), values={"u": -0.1}, start=(1, 0), until=1),
     r"kinetic friction u is negative at u = -0\.1; friction"),
    (lambda: ap.Scene(system=block(u + w, w), values={"u": 0.1, "w": "1/3"}, start=(1, 0), until=1),
     r"static friction w is below the kinetic one, u \+ w, at u = 0\.1, w = 1/3; make"),
    (lambda: ap.Scene(system=block(u, w), values={"u": 0.1 + 0.2, "w": "0.3"}, start=(1, 0), until=1),
     r"static friction w is below the kinetic one, u, at u = 0\.30000000000000004, w = 0\.3; make"),
    (lambda: ap.Scene(system=users_rod(), values={"a": -1, "c": 1, "c0": 1, "eps": 1}, start=(0, 0, 0), until=1),
     "declared positive"),
    (lambda: ap.Scene(system="rod", values={}, start=(0, 0, 0), until=1), "must be a System"),
    (lambda: ap.Scene(system=block(), sigma=1, values={}, start=(1, 0), until=1), "belong to the rod"),
    (lambda: ap.solve("backward"), "takes a Scene, not the name 'backward'"),
    (lambda: ap.solve(None), "takes a Scene, not NoneType"),
    (lambda: ap.solve(block()), r"takes a Scene, not System; build one: ap.Scene\(system=, values="),
    (lambda: ap.solve(rod.mechanism()), r"not Mechanism; build one: ap.Scene\(system=mechanism.rigid\(\), values="),
    (lambda: ap.Scene(system=rod.mechanism(), values={}, start=(0, 0), until=1), r"take the rigid\(\) or elastic\(\)"),
    (lambda: ap.solve_many(system=rod.mechanism(), values={}, start={}, until=1), r"take the rigid\(\) or elastic\(\)"),
    (lambda: block(kinetic=sp.Float(0.3)), "contains a float"),
    (lambda: ap.Friction(velocity=v, force="F", load=1, kinetic=1), "must be a Symbol"),
    (lambda: ap.System.with_frictions({v: 1}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=1)]), "no rate"),
    (lambda: ap.System.with_frictions({v: F}, {}, [ap.Friction(velocity=c, force=F, load=1, kinetic=1)]), "depend on"),
    (lambda: ap.System.with_frictions({v: F}, {}, [F]), "sequence of ap.Friction"),
    (lambda: ap.System.with_frictions({v: F}, {}, [ap.Friction(v**3, F, 1, 1)]), r"v\*\*3 must be linear in what F"),
    (lambda: ap.System.with_frictions({v: F, u: F}, {}, [ap.Friction(sp.sqrt(v**2 + u**2), F, 1, 1)]), "be linear in"),
])
def test_what_is_no_scene_is_refused_in_one_line(make, match):
    with pytest.raises(InputError, match=match) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_a_function_that_sympy_cannot_differentiate_is_refused_by_name():
    x = sp.Symbol("x", real=True)
    for rate, words in ((sp.zeta(x), r"zeta\(x\)"), (x - sp.besselj(2 * x, 1), r"besselj\(2\*x, 1\)"),
                        (sp.factorial2(x), r"factorial2\(x\)")):
        scene = ap.Scene(system=ap.System.smooth({x: rate}, {}, None), values={}, start={x: 2}, until=1)
        with pytest.raises(InputError, match=f"^{words} has no derivative by x"):
            ap.solve(scene)


@pytest.mark.parametrize("options", [{}, {"digits": 20}, {"method": "radau"}])
@pytest.mark.parametrize("kinetic", [1 + t, 1 + x**2 + v])
def test_static_friction_that_falls_below_the_kinetic_one_on_the_way_is_refused_as_that(kinetic, options):
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=kinetic, static=sp.Rational(6, 5))
    system = ap.System.with_frictions({x: v, v: F - sp.Rational(13, 10)}, {}, [contact], time=t)
    scene = ap.Scene(system=system, values={}, start={"x": "4/5", "v": 1}, until=5)
    words = r"at t = 0\.[234].*static friction 1\.2 of friction 1 is below the kinetic one, 1\.\d+; make it"
    with pytest.raises(NoMotion, match=words) as stop:
        ap.solve(scene, **options)
    assert stop.value.state[1] == 0


def test_kinetic_friction_that_is_less_at_rest_is_refused_as_the_friction_that_was_given():
    law = sp.Piecewise((1, sp.Ne(v, 0)), (sp.Rational(1, 4), True))
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=law)
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [contact])
    scene = ap.Scene(system=system, values={}, start={x: "1/2", v: 0}, until=1)
    with pytest.raises(NoMotion, match=r"friction 1, 0\.25 at rest, is 1 in slip; give static friction of at"):
        ap.solve(scene)


@pytest.mark.parametrize("start", [0, 3])
def test_rates_that_hold_a_load_at_0_by_jumps_are_to_be_written_as_a_friction(start):
    contact = ap.Friction(velocity=v, force=F, load=u, kinetic=1)
    system = ap.System.with_frictions({u: -sp.sign(u), x: v, v: F - x}, {}, [contact])
    with pytest.raises(NoMotion, match=r"at t = 1, .* where the load of friction 1 is 0; write what jumps"):
        ap.solve(ap.Scene(system=system, start={"u": 1, "x": start, "v": 0}, until=3))


@pytest.mark.parametrize("verb", [ap.least_model, certify])
@pytest.mark.parametrize(("given", "match"), [("backward", "read it first"), (None, "NoneType"), (block(), "System")])
def test_other_verbs_refuse_what_is_no_scene_as_solve_does(verb, given, match):
    with pytest.raises(InputError, match=match):
        verb(given)
    with pytest.raises(InputError, match="not dict"):
        ap.read_scene({})


@pytest.mark.parametrize("options", [{}, {"digits": 20}, {"method": "lsoda", "rtol": 1e-10}])
def test_of_two_contacts_at_rest_only_that_slips_whose_static_friction_is_used_up(options):
    """Two blocks, one on the other; the upper is drawn by the force t, the ground holds 1, the blocks one another 6/5.

    At t = 1 they start together, v' = (t - 1/5) / 2; the upper alone could start from then on as well.
    """
    v1, v2, F1, F2, t = sp.symbols("v1 v2 F1 F2 t", real=True)
    ground = ap.Friction(velocity=v1, force=F1, load=2, kinetic=sp.Rational(1, 10), static=sp.Rational(1, 2))
    between = ap.Friction(velocity=v2 - v1, force=F2, load=1, kinetic=sp.Rational(1, 10), static=sp.Rational(6, 5))
    blocks = ap.System.with_frictions({v1: F1 - F2, v2: t + F2}, {}, (ground, between), time=t)
    path = ap.solve(ap.Scene(system=blocks, start={"v1": 0, "v2": 0}, until=2), **options)
    assert path.modes == ("stick+stick", "slip_same+stick")
    assert [float(v) for v in path.final] == pytest.approx([0.65, 0.65], abs=1e-9)


@pytest.mark.further
@pytest.mark.parametrize("method", here("kvaerno5"))
@pytest.mark.further
def test_modes_that_differ_in_the_number_of_their_guards_are_compiled_together(method):
    path = follow(block(), {"x": "7.5", "v": 0}, 20, method=method, rtol=1e-9)
    assert path.modes == ("slip_opposite", "slip_same", "slip_opposite", "slip_same", "stick")
    assert path.final == pytest.approx((-0.5, 0), abs=1e-6)


@pytest.mark.parametrize("method", here("kvaerno5"))
@pytest.mark.further
def test_a_load_with_a_root_whose_base_might_vanish_is_compiled(method):
    load = sp.sqrt(1 + x / 4 + x**2)
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v, F, load, kinetic=sp.Rational(1, 5))])
    start = {"x": "3/2", "v": 0}
    expected = follow(system, start, 4).final
    assert follow(system, start, 4, method=method, rtol=1e-9, seconds=500).final == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("method", here("heyoka"))
@pytest.mark.parametrize("power", [3, 4, 11])
def test_a_taylor_series_begins_where_a_power_has_a_base_of_zero(method, power):
    system = ap.System.smooth({x: -v + (v - 2 * x) ** power, v: x}, {}, None)
    start = {"x": "1/10", "v": "1/5"}
    expected = follow(system, start, 3, method="dop853", rtol=1e-11).final
    assert follow(system, start, 3, method=method, rtol=1e-11).final == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("way", [{}, {"digits": 10}, {"method": "radau"}, {"method": "rk45"}])
@pytest.mark.parametrize("level", [sp.floor(x), sp.ceiling(x) - 1, x - sp.frac(x), x - sp.Mod(x, 1)])
def test_a_force_of_steps_along_a_state_is_followed_from_step_to_step(level, way):
    """From the edge at 2 it is thrown up and back with the force 2, falls with the force 1, and is free below 1."""
    path = follow(ap.System.smooth({x: v, v: -level}, {}, None), {"x": 2, "v": 1}, 2, **way)
    assert [float(w) for w in path.final] == pytest.approx([4 - 2 * 3**0.5, -(3**0.5)], abs=1e-6)


@pytest.mark.parametrize("way", [{}, {"digits": 10}, {"method": "radau"}])
def test_a_rate_may_hold_powers_of_a_constant(way):
    """At the amplitude pi/2 a pendulum has the quarter period K(1/2)/pi."""
    pendulum, side = ap.System.smooth({x: v, v: -(sp.pi**2) * sp.sin(x)}, {}, None), "1.570796326794896619231"
    path = follow(pendulum, {"x": side, "v": 0}, 1, **way)
    quarter = 1.8540746773013719 / math.pi
    assert float(path(quarter)[0]) == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize("way", [{}, {"digits": 10}, {"method": "radau"}, {"method": "rk45", "rtol": 1e-8}])
@pytest.mark.few(2)
def test_no_tooth_of_a_sine_is_stepped_over_however_fast_it_is_passed(way):
    """The force jumps between 1/20 and 9/20 at every half, and is constant between: steps see no need to be short."""
    teeth = sp.Rational(1, 4) - sp.sign(sp.sin(2 * sp.pi * x)) / 5
    path = follow(ap.System.smooth({x: v, v: teeth}, {}, None), {"x": 0, "v": 0}, 10, **way)
    place, speed, left = 0, 0, 10
    for force in (0.05, 0.45) * 10:
        span = min(left, (math.sqrt(speed**2 + force) - speed) / force)
        place, speed, left = place + speed * span + force * span**2 / 2, speed + force * span, left - span
    assert [float(w) for w in path.final] == pytest.approx([place, speed], abs=1e-6)


@pytest.mark.parametrize("way", [{}, {"digits": 10}, {"method": "radau"}, {"method": "rk45"}])
def test_all_zeros_of_a_cubic_in_a_state_are_met_in_one_stride(way):
    cubic = sp.sign(sp.expand((x - 1) * (x - 2) * (x - 3)))
    path = follow(ap.System.smooth({x: sp.Integer(1), v: cubic}, {}, None), {"x": 0, "v": 0}, 7, **way)
    assert float(path.final[1]) == pytest.approx(3, abs=1e-6)


@pytest.mark.parametrize("way", [{}, {"digits": 10}, {"method": "radau"}])
def test_a_hysteresis_that_yields_stays_on_its_edge_until_the_velocity_turns(way):
    """The force z of a spring that yields at 1 goes back with x from there: x = 1 - cos(t) has moved by 2 at t = pi."""
    yielding = v * (1 - sp.Heaviside(w - 1) * sp.Heaviside(v) - sp.Heaviside(-w - 1) * sp.Heaviside(-v))
    path = follow(ap.System.smooth({v: sp.cos(t), w: yielding}, {}, None, time=t), {"v": 0, "w": 0}, 6, **way)
    assert float(path(3)[1]) == pytest.approx(1, abs=1e-8)
    assert float(path.final[1]) == pytest.approx(max(-1, 1 - (1 + math.cos(6))), abs=1e-6)


@pytest.mark.parametrize("way", [{}, {"digits": 10}, {"method": "radau"}])
def test_a_block_on_a_ratchet_of_saw_teeth_stops_on_a_tooth(way):
    """On every tooth it loses the work 1/2 + 1/10 of its energy 2, and on the fourth v^2/2 = 1/5 - d^2/2 - d/10."""
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=c)
    system = ap.System.with_frictions({x: v, v: -sp.Mod(x, 1) + F}, {}, [friction])
    path = follow(system, {"x": 0, "v": 2}, 5, {c: "0.1"}, **way)
    turn = path.events[0]
    assert float(turn.state[0]) == pytest.approx(3 - 0.1 + (0.01 + 0.4) ** 0.5, abs=1e-5)


@pytest.mark.further
@pytest.mark.parametrize("method", here("heyoka", "kvaerno5"))
def test_peers_know_inverse_functions_and_powers_of_a_penetration_or_refuse_them_in_one_line(method):
    def block(force):
        rates = {x: v, v: -force + F}
        return ap.System.with_frictions(rates, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=c)])

    start, values = {"x": "1.3", "v": 0}, {c: "0.1"}
    inverse = block(sp.asinh(x) + sp.atanh(x / 4) + sp.acosh(3 + x / 2))
    expected = follow(inverse, start, 2, values, method="dop853", rtol=1e-10).final
    assert follow(inverse, start, 2, values, method=method, rtol=1e-9).final == pytest.approx(expected, abs=1e-6)
    turned = follow(block(x * abs(x)), start, 2, values, method=method, rtol=1e-9).final
    assert turned == pytest.approx(follow(block(x * abs(x)), start, 2, values).final, abs=1e-6)
    contact = ap.Friction(velocity=w, force=F, load=-w * sp.sqrt(-x), kinetic=c, gap=x, normal=N)
    bounce = ap.System.with_frictions({x: v, v: N - 1, w: F}, {}, [contact])
    start = {"x": 1, "v": 0, "w": -1}
    if method == "heyoka":
        with pytest.raises(Unfinished, match=r"left the range of floats at t = 1\.41421;"):  # where the root begins
            follow(bounce, start, 2, values, method=method)
    else:
        expected = follow(bounce, start, 2, values, method="dop853", rtol=1e-10).final
        assert follow(bounce, start, 2, values, method=method, rtol=1e-9).final == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("options", [{}, {"digits": 20}, {"method": "radau"}])
@pytest.mark.parametrize("middle", ["1/3", "7/10", "1/10"])
def test_what_sticks_by_static_friction_sticks_on_where_a_run_goes_on_from_the_end_of_another(middle, options):
    """Its velocity, a sum of states with thirds and sevenths, is not exactly 0 there, and kinetic friction is less."""
    pull, ways = sp.Rational(4, 5), (1, sp.Rational(1, 3), sp.Rational(1, 7))
    places, speeds = sp.symbols("x1:4", real=True), sp.symbols("v1:4", real=True)
    slope = sum(map(sp.Mul, ways, speeds))
    rates = {s: k * (F + pull) - n * s0 for n, k, s, s0 in zip((3, 2, 5), ways, speeds, places, strict=True)}
    blocks = ap.System.with_frictions(
        dict(zip(places, speeds, strict=True)) | rates, {}, [ap.Friction(slope, F, 1, sp.Rational(1, 2), 1)]
    )
    start = dict(zip((*places, *speeds), (0, 0, 0, "1/10", "1/10", "-14/15"), strict=True))
    half, whole = (follow(blocks, start, end, **options) for end in (middle, sp.Rational(middle) + sp.Rational(1, 5)))
    on = follow(blocks, half.final, "1/5", **options)
    assert half.modes == whole.modes == on.modes == ("stick",)
    assert [*map(float, on.final)] == pytest.approx([*map(float, whole.final)], abs=1e-7)


@pytest.mark.parametrize("rigid", [True, False])
def test_no_proof_takes_as_slip_what_runs_take_as_a_velocity_0_by_rounding(rigid):
    contact = {"load": N, "normal": N, "constraint": N - 1} if rigid else {"load": 1}
    friction = ap.Friction(velocity=v - w, force=F, kinetic=sp.Rational(1, 2), static=1, **contact)
    pair = ap.System.with_frictions({v: F + sp.Rational(4, 5), w: -F - sp.Rational(4, 5)}, {}, [friction])
    third = Fraction(1, 3)
    for off, modes in ((0, ("stick",)), (Fraction(1, 10**17), None), (Fraction(1, 10**12), ("slip_same",))):
        scene = ap.Scene(system=pair, start={v: third + off, w: third}, until=1)
        proof = certify(scene)
        assert ap.solve(scene).modes == (modes or ("stick",))
        assert proof.modes == modes if modes else (not proof.proven and "which a run takes as 0" in proof.reason)


@pytest.mark.parametrize("speed", ["1e-17", "1e-30"])
def test_a_sliding_velocity_that_is_one_state_is_as_small_as_it_is_written(speed):
    block = ap.System.with_frictions(
        {x: v, v: F + sp.Rational(4, 5)}, {}, [ap.Friction(v, F, 1, sp.Rational(1, 2), 1)]
    )
    assert follow(block, {x: 1, v: speed}, 1).modes == ("slip_same",)


@pytest.mark.parametrize("step", [
    sp.floor(c), sp.Heaviside(c - 1, 1), sp.Piecewise((1, c >= 1), (0, True)), 1 + sp.sign(c - 1),
])
def test_a_start_above_a_ground_that_steps_with_a_parameter_is_open_at_the_step_itself(step):
    """Six digits of the parameter would change the gap of 1/2 by 1: this is a step, no rounding."""
    ground = ap.Friction(velocity=v, force=F, load=N, kinetic=a, gap=x - step, normal=N, constraint=N - 1)
    body = ap.System.with_frictions({x: u, u: N - 1, v: F}, {}, [ground])
    path = follow(body, {x: "3/2", u: 0, v: 1}, "1/10", {a: "1/5", c: 1})
    assert path.modes == ("open",)
    assert path.final == pytest.approx((1.495, -0.1, 1))


@pytest.mark.parametrize("options", [{}, {"digits": 20}])
@pytest.mark.parametrize("static", [None, 1])
def test_a_crank_at_rest_on_its_dead_centre_where_no_friction_acts_stays_there(static, options):
    q, w, force = sp.symbols("q w F", real=True)
    slider = ap.Friction(velocity=-sp.sin(q) * w, force=force, load=1, kinetic=sp.Rational(1, 2), static=static)
    crank = ap.System.with_frictions({q: w, w: -sp.sin(q) * force}, {}, [slider])
    path = ap.solve(ap.Scene(system=crank, start={q: 0, w: 0}, until=3), **options)
    assert (path.final, path.events) == ((0, 0), ())


def test_a_slip_of_our_own_is_not_told_as_a_rate_that_is_no_finite_real_number():
    with pytest.raises(TypeError, match="NoneType"), finite(lambda: 0):
        _ = None + 1
    for number in (complex(-1), carrier_context(20).sqrt(-1)):
        with pytest.raises(OutOfRange, match="not a finite real number"), finite(lambda: 0):
            _ = number < 0


@pytest.mark.parametrize("way", [{}, {"digits": 20}, {"method": "radau"}])
@pytest.mark.parametrize("rough", [True, False])
@pytest.mark.few(1)
def test_a_load_that_no_equation_determines_is_refused_where_its_friction_moves_the_body(rough, way):
    """What one contact holds at rest keeps the gap of another, sliding one closed, whatever the load of that."""
    exactly = sp.Rational
    places, rates = sp.symbols("q1:4", real=True), sp.symbols("u1:4", real=True)
    rows = [((exactly(5, 13), exactly(12, 13), exactly(25, 13)), (exactly(12, 13), -exactly(5, 13), exactly(71, 52))),
            ((1, 0, 2), (0, -1, -2))]
    bounds = [(exactly(7, 8), exactly(9, 8)), (exactly(5, 8), exactly(5, 8)) if rough else (0, 0)]
    forces = list(zip(sp.symbols("N1:3", real=True), sp.symbols("F1:3", real=True), strict=True))
    pull = [sum(N * n[i] + F * t[i] for (N, F), (n, t) in zip(forces, rows, strict=True)) for i in range(3)]
    given, masses = (-exactly(15, 4), -exactly(31, 4), -3), (1, 1, exactly(5, 8))
    moved = [(force + load) / mass for force, load, mass in zip(pull, given, masses, strict=True)]

    def along(row, values):
        return sp.expand(sum(a * b for a, b in zip(row, values, strict=True)))

    contacts = [ap.Friction(along(t, rates), F, N, *bound, gap=along(n, places), normal=N, constraint=along(n, moved))
                for (n, t), (N, F), bound in zip(rows, forces, bounds, strict=True)]
    body = ap.System.with_frictions(dict(zip((*places, *rates), (*rates, *moved), strict=True)), {}, contacts)
    scene = ap.Scene(system=body, values={}, start=[0, 0, 0, 4, exactly(5, 2), -2], until="1/10")
    if not rough:
        assert ap.solve(scene, **way).modes == ("stick+open",)
        return
    with pytest.raises(UnboundedReaction, match=r"not determined at t = 0.*: stick\+slip_same has more"):
        ap.solve(scene, **way)


@pytest.mark.parametrize("way", [{}, {"method": "radau"}, {"method": "jump", "order": 2}])
@pytest.mark.few(1)
def test_a_load_that_decays_beside_friction_of_the_velocity_loses_no_contact_by_rounding(way):
    stribeck = [1 + 1 / (1 + v**2), 2 + 2 / (1 + (w - x / 4) ** 2)]
    brakes = [ap.Friction(v, F, load=w, kinetic=stribeck[0], static=2),
              ap.Friction(w - x / 4, G, load=w, kinetic=stribeck[1], static=4)]
    system = ap.System.with_frictions(
        {x: v, v: F - x - 2 * w + sp.Rational(3, 2) * (1 - sp.cos(t))}, {w: F + G - (2 + x**2) * w}, brakes,
        small=eps, time=t,
    )
    path = ap.solve(ap.Scene(system=system, values={eps: "1/1000"}, start={x: 0, v: -1, w: -1}, until=1), **way)
    assert [e.kind for e in path.events] == ["velocity_zero", "velocity_zero", "slip_onset"]
    assert path.final == pytest.approx((-0.691161, -0.174826, 0), abs=1e-5)


def blocks(count, coupling):
    """Return blocks of which each has a spring, a friction, and a part ``coupling`` of the friction of the next."""
    places, rates, forces = (sp.symbols(f"{name}:{count}", real=True) for name in "xvF")
    contacts = [ap.Friction(velocity=v, force=F, load=1, kinetic=1, static=2)
                for v, F in zip(rates, forces, strict=True)]
    pulls = [own + coupling * other - x for own, other, x in zip(forces, (*forces[1:], 0), places, strict=True)]
    slow = dict(zip((*places, *rates), (*rates, *pulls), strict=True))
    return ap.System.with_frictions(slow, {}, contacts)


def test_frictions_that_do_not_enter_one_anothers_equations_are_decided_one_by_one():
    """A block at x > 2 slides within half a period to 2 - x and rests there; 3**9 choices would be too many."""
    start = [Fraction(k, 2) for k in range(9)]
    path = ap.solve(ap.Scene(system=blocks(9, 0), values={}, start=[*start, *[0] * 9], until=4), method="lsoda")
    rested = [x if x <= 2 else 2 - x for x in start]
    assert path.final == pytest.approx((*map(float, rested), *[0] * 9), abs=1e-4)
    assert path.modes[-1] == "+".join(["stick"] * 9)


def test_a_relay_keeps_a_motion_to_a_circle_on_which_its_angle_goes_on():
    """Outside z' = -(1 + i) z + i/2, of z = x + i y; on the circle the angle has the rate cos(angle)/2 - 1."""
    x, y, F = sp.symbols("x y F", real=True)
    relay = ap.Friction(velocity=x**2 + y**2 - 1, force=F, load=1, kinetic=1)
    drawn = ap.System.with_frictions({x: y + F * x, y: -x + F * y + sp.Rational(1, 2)}, {}, [relay])
    path = ap.solve(ap.Scene(system=drawn, start={x: 2, y: 0}, until=10))
    outside = lambda t: (rest := 0.5j / (1 + 1j)) + (2 - rest) * np.exp(-(1 + 1j) * t)  # noqa: E731
    met = brentq(lambda t: abs(outside(t)) - 1, 0, 2, xtol=1e-14)
    turning = solve_ivp(lambda t, a: np.cos(a) / 2 - 1, (met, 10), [np.angle(outside(met))], rtol=1e-11, atol=1e-12)
    angle = turning.y[0, -1]
    assert path.modes == ("slip_same", "stick")
    assert path.events[0].t == pytest.approx(met, abs=1e-9)
    assert path.final == pytest.approx((math.cos(angle), math.sin(angle)), abs=1e-8)
    driven = ap.System.with_frictions({x: y - F * x, y: -x - F * y + sp.Rational(1, 2)}, {}, [relay])
    with pytest.raises(TwoMotions):
        ap.solve(ap.Scene(system=driven, start={x: 1, y: 0}, until=1))


def test_signs_are_sought_for_no_velocity_that_an_expression_does_not_have(monkeypatch):
    """Of ten blocks on a belt each law was searched for the signs of all: 5 s of 7 s went into it."""
    system, sought, plainly = blocks(9, 0), [], sp.Basic.subs
    monkeypatch.setattr(sp.Basic, "subs", lambda expr, known: sought.append(known) or plainly(expr, known))
    own = system.frictions[0].velocity
    assert with_signs(system, (Phase(1, -1),) * 9, sp.Abs(own) + 1) == 1 - own
    assert {key.free_symbols == {own} for known in sought for key in known} == {True}


def test_more_frictions_than_can_be_tried_in_all_combinations_are_refused_in_one_line():
    coupled = blocks(9, sp.Rational(1, 2))
    with pytest.raises(InputError, match="9 frictions are undecided at once; combinations are tried for at most 8"):
        ap.solve(ap.Scene(system=coupled, values={}, start=[*[3] * 9, *[0] * 9], until=1))
    held = ap.Scene(system=coupled, values={}, start=[*[1] * 9, *[0] * 9], until=1)
    assert ap.solve(held).modes == ("+".join(["stick"] * 9),)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_stack_of_plates_at_rest_has_the_friction_of_the_least_squares_within_its_bounds(seed):
    """Of 12 plates on one another under random pulls; M^(1/2) times the acceleration is as short as friction allows.

    By Gauss's principle; 3**12 choices of phases would be too many.
    """
    drawn, n = np.random.default_rng(seed), 12
    rates, forces = (sp.symbols(f"{name}:{n}", real=True) for name in "vF")
    masses, pulls, bounds = drawn.integers(1, 5, n), drawn.integers(-9, 10, n), drawn.integers(1, 9, n)
    plates = [ap.Friction(velocity=v - below, force=F, load=int(b), kinetic=sp.Rational(1, 2))
              for v, below, F, b in zip(rates, (*rates[1:], 0), forces, bounds, strict=True)]
    slow = {v: (int(a) + F - above) / sp.Integer(int(m))
            for v, a, F, above, m in zip(rates, pulls, forces, (0, *forces), masses, strict=False)}
    path = ap.solve(ap.Scene(system=ap.System.with_frictions(slow, {}, plates), start=[0] * n, until="1e-3"))
    shares = (np.eye(n) - np.eye(n, k=-1)) / np.sqrt(masses)[:, None]
    least = lsq_linear(shares, -pulls / np.sqrt(masses), (-bounds / 2, bounds / 2), method="bvls").x
    assert path.final == pytest.approx((pulls + np.sqrt(masses) * (shares @ least)) / masses / 1000, abs=1e-10)


@pytest.mark.parametrize("part", ["kinetic", "load", "rate"])
def test_two_blocks_have_several_motions_where_the_direction_of_one_bounds_the_friction_of_the_other(part):
    """Block v slips under F = 3 sign(w)/2 - 2, in any part of the system; then w' = F + H has 3 solutions, |H| <= 1."""
    rates, (F, H), bound = sp.symbols("v w", real=True), sp.symbols("F H"), 2 - sp.Rational(3, 2) * sp.sign(w)
    own, more = {"kinetic": ({"load": 1, "kinetic": bound}, 0), "load": ({"load": bound, "kinetic": 1}, 0),
                 "rate": ({"load": 1, "kinetic": 2}, 2 - bound)}[part]
    slow = {rates[0]: 5 + F, rates[1]: 2 + F + H + more}
    blocks = [ap.Friction(velocity=rates[0], force=F, **own), ap.Friction(velocity=w, force=H, load=1, kinetic=1)]
    with pytest.raises(TwoMotions):
        ap.solve(ap.Scene(system=ap.System.with_frictions(slow, {}, blocks), start=[0, 0], until=1))


def test_the_mode_that_follows_is_decided_by_coefficients_that_cancel_with_their_digits():
    """At p = 1e-9 this friction is 1 - p**2/12, and 0 by its formula in doubles, by which the block slipped forward."""
    x, v, force = sp.symbols("x v F", real=True)
    p = sp.Symbol("p", positive=True)
    friction = 2 * (1 - sp.cos(p)) / p**2
    belt = ap.Friction(velocity=v - 1, force=force, load=1, kinetic=friction / (1 + sp.Abs(v - 1)),
                       static=friction * sp.Rational(5, 4))
    system = ap.System.with_frictions({x: v, v: force - x}, {}, [belt])
    ends = [ap.solve(ap.Scene(system=system, values={p: value}, start={x: 0, v: 1}, until=8)).final
            for value in ("1e-4", "1e-9")]
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)


@pytest.mark.parametrize("options", [{}, {"digits": 20}])
def test_a_state_in_which_stick_has_singular_equations_is_not_told_as_one_without_motion(options):
    """Neighbours stick: |x - u| <= x + u there. Slip has w' = -u for w > 0 and w' = x for w < 0, at -1 away from 0."""
    rate = (x - u + (x + u) * F) / 2
    system = ap.System.with_frictions({x: 1, u: 1, w: rate}, {}, [ap.Friction(velocity=w, force=F, load=1, kinetic=1)])
    with pytest.raises(UnboundedReaction, match=r"t = 0.*: stick .*singular in this state only; move the start"):
        ap.solve(ap.Scene(system=system, start={x: 0, u: 0, w: 0}, until=1), **options)
    for beside in [("1e-9", 0), (0, "1e-9")]:
        path = ap.solve(ap.Scene(system=system, start=dict(zip((x, u, w), (*beside, 0), strict=True)), until=1))
        assert path.modes == ("stick",)
    with pytest.raises(TwoMotions):
        ap.solve(ap.Scene(system=system, start={x: -1, u: -1, w: 0}, until=1), **options)


@pytest.mark.parametrize("way", [{"method": "radau"}, {"method": "dop853", "rtol": 1e-10}, {"digits": 20}])
def test_a_block_leaves_its_belt_where_its_place_is_0_to_rounding(way):
    """The friction needed, 1 + x + sin(x)**2, passes the load 1 + x/4 at x = 0, which a run reaches to 1e-17."""
    contact = ap.Friction(velocity=v - 1, force=F, load=1 + x / 4, kinetic=1)
    belt = ap.System.with_frictions({x: v, v: F - x - v - sp.sin(x) ** 2}, {}, [contact])
    path = ap.solve(ap.Scene(system=belt, start={x: -sp.Rational(1, 2), v: 1}, until=sp.Rational(3, 2)), **way)
    slips = solve_ivp(lambda _, w: (w[1], 1 - 3 * w[0] / 4 - w[1] - math.sin(w[0]) ** 2), (0, 1), (0, 1), "DOP853",
                      rtol=1e-10, atol=1e-12)
    assert [(e.kind, float(e.t)) for e in path.events] == [("slip_onset", pytest.approx(1 / 2, abs=1e-12))]
    assert [*map(float, path.final)] == pytest.approx(slips.y[:, -1], abs=1e-6)


def test_a_layer_from_the_edge_of_stick_at_a_place_that_is_0_to_rounding_ends():
    """v = 1 + (x/4 - x) along the slow slip from x = 0 at t = 1/2, so that x = (4/3)(1 - exp(-3 (t - 1/2)/4))."""
    contact = ap.Friction(velocity=v - 1, force=F, load=1 + x / 4, kinetic=1)
    belt = ap.System.with_frictions({x: v}, {v: F - x - v}, [contact], small=eps)
    scene = ap.Scene(system=belt, values={eps: "1e-4"}, start={x: -sp.Rational(1, 2), v: -1}, until=sp.Rational(3, 2))
    path = ap.solve(scene, method="jump", order=0)
    assert path.modes == ("slip_opposite", "stick", "slip_opposite")
    assert path.final[0] == pytest.approx(4 / 3 * (1 - math.exp(-3 / 4)), abs=1e-3)


@pytest.mark.parametrize("way", [{}, {"digits": 15}, {"method": "dop853"}])
@pytest.mark.parametrize("rigid", [True, False])
@pytest.mark.parametrize(("drag", "end"), [
    (v * abs(v), (math.log(2), 1 / 2)), (sp.sign(v) / 2, (3 / 4, 1 / 2)), (abs(v), (1 - math.exp(-1), math.exp(-1))),
])
def test_a_drag_by_the_sliding_velocity_acts_in_the_air_as_well(drag, end, rigid, way):
    """An open contact has no sign of its velocity: |v| was taken as 0 there, and the drag left out."""
    law = {"load": N, "constraint": N - 1} if rigid else {"load": -1000 * w - 10 * u}
    ground = ap.Friction(velocity=v, force=F, kinetic=a, gap=w, normal=N, **law)
    ball = ap.System.with_frictions({w: u, x: v, u: N - 1, v: F - drag}, {}, [ground])
    path = follow(ball, {w: 1, x: 0, u: 0, v: 1}, 1, {a: "1/5"}, **way)
    assert path.modes == ("open",)
    assert [float(e) for e in path.final] == pytest.approx([1 / 2, end[0], -1, end[1]], abs=1e-6)


@pytest.mark.parametrize("method", ["exact", "rk45"])
def test_friction_whose_law_falls_below_0_on_the_way_is_refused(method):
    x, v, force = sp.symbols("x v F", real=True)
    slide = ap.Friction(velocity=v, force=force, load=1, kinetic=1 - v, static=1)
    system = ap.System.with_frictions({x: v, v: 2 + force}, {}, [slide])
    scene = ap.Scene(system=system, start={"x": 0, "v": "1/2"}, until=2)
    with pytest.raises(OutOfRange, match=r"kinetic friction 1 - v of mode slip_same is negative at t = "):
        ap.solve(scene, method)
    assert ap.solve(ap.Scene(system=system, start={"x": 0, "v": "1/2"}, until="1/4"), method).modes == ("slip_same",)
    many = ap.solve_many(system=system, values={}, start={"x": np.zeros(9), "v": np.full(9, 0.5)}, until=2)
    assert "followed" not in {many.outcomes[k] for k in many.outcome}


@pytest.mark.parametrize("method", ["exact", "digits", "rk45", "radau", *here("heyoka", "cvode")])
@pytest.mark.parametrize(("law", "when"), [
    ("3/5 + cos(t)", math.acos(-3 / 5)), ("999/1000 + cos(t)", math.acos(-0.999)),
    ("(t - 3)^2/9 - 1/1000", 3 - 0.009**0.5), ("1/2 - x*(9 - x)/40", None),
])
def test_friction_that_is_below_0_for_a_while_only_is_refused(method, law, when):
    """At the end of the run it is positive again; its zero is a root of the law alone, or of x = 2 t + t^2/2 in it."""
    kinetic = sp.sympify(law.replace("^", "**"), {"t": t, "x": x})
    slide = ap.Friction(velocity=v, force=F, load=1, kinetic=kinetic, static=2)
    drive = 1 if when else 1 + kinetic
    system = ap.System.with_frictions({x: v, v: drive + F}, {}, [slide], time=t)
    place = sp.nsolve(kinetic.subs(x, 2 * t + t**2 / 2), t, 1) if when is None else when
    scene = ap.Scene(system=system, start={"x": 0, "v": 2}, until=6)
    with pytest.raises(OutOfRange, match=r"kinetic friction .* of mode slip_same is negative at t = ") as found:
        ap.solve(scene, **({"digits": 20} if method == "digits" else {"method": method}))
    assert float(str(found.value).partition("t = ")[2].partition(";")[0]) == pytest.approx(float(place), abs=1e-4)
    if when:
        many = ap.solve_many(system=system, values={}, start={"x": np.zeros(9), "v": np.full(9, 2.0)}, until=6)
        assert "followed" not in {many.outcomes[k] for k in many.outcome.tolist()}


@pytest.mark.parametrize("way", [{}, {"digits": 20}, {"method": "rk45"}])
@pytest.mark.parametrize("law", ["1 - cos(t)", "v/2", "x^2*(2 - v)", "v*(3 - v)"])
def test_friction_that_comes_down_to_0_is_not_refused(way, law):
    kinetic = sp.sympify(law.replace("^", "**"), {"t": t, "x": x, "v": v})
    slide = ap.Friction(velocity=v, force=F, load=1, kinetic=kinetic, static=2)
    system = ap.System.with_frictions({x: v, v: -x + F}, {}, [slide], time=t)
    path = ap.solve(ap.Scene(system=system, start={"x": 0, "v": 1}, until=9), **way)
    assert path.modes[0] == "slip_same"


def test_friction_that_is_negative_at_the_start_is_refused_each_time():
    """From the fifth scene on, tables tell the mode that begins."""
    slide = ap.Friction(velocity=v, force=F, load=1, kinetic=1 - v, static=1)
    system = ap.System.with_frictions({x: v, v: 2 + F}, {}, [slide])
    for k in range(8):
        with pytest.raises(OutOfRange, match=r"kinetic friction 1 - v .*is negative at t = 0"):
            ap.solve(ap.Scene(system=system, start={"x": k, "v": 2}, until=1))


@pytest.mark.parametrize("way", [{}, {"digits": 20}, {"method": "rk45"}])
@pytest.mark.parametrize(("law", "start", "when"), [
    (sp.Piecewise((1, x < 1), (-1, True)), 1, 3**0.5 - 1), (sp.Piecewise((1, t < 1), (-1, t < 2), (1, True)), 1, 1),
    (1 - 2 * sp.Heaviside(x - 1), 1, 3**0.5 - 1), (sp.Rational(1, 2) + sp.sign(v), -1, 0),
])
def test_friction_that_is_a_negative_constant_on_a_side_or_in_a_direction_is_refused(way, law, start, when):
    slide = ap.Friction(velocity=v, force=F, load=1, kinetic=law, static=2)
    system = ap.System.with_frictions({x: v, v: 2 + F}, {}, [slide], time=t)
    scene = ap.Scene(system=system, start={"x": 0, "v": start}, until=3)
    with pytest.raises(OutOfRange, match=r"kinetic friction .* is negative at t = ") as found:
        ap.solve(scene, **way)
    told = str(found.value).partition("t = ")[2].replace(",", ";").partition(";")[0]
    assert float(told) == pytest.approx(when, abs=1e-5)
    if when:
        return
    many = ap.solve_many(system=system, values={}, start={"x": np.zeros(9), "v": np.full(9, -1.0)}, until=3)
    assert "followed" not in {many.outcomes[k] for k in many.outcome.tolist()}
