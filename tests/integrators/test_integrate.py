"""The peers' driver: one mode logic under every integrator, dense output, status sentences, and no hanging."""

import math
import random
import re
import sys
import tomllib
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from peers import here

import asympk as ap
from asympk.errors import InputError, MissingPackage, OutOfRange, TooLarge, Undecided, Unfinished, UnknownName
from asympk.integrators.integrate import FAMILIES, FINISHED, PEERS, absent
from asympk.symbolic.branches import Phase
from asympk.symbolic.system import Friction
from asympk.systems import arm, crank_slider, painleve_klein
from asympk.systems.automata import automaton_of
from asympk.systems.catalogue import example_scene
from asympk.systems.painleve_klein import modes

SCENES = {"i": (0, 0, 1), "ii": (0, "0.2", -1), "iii": (-1, -1, 1)}
STIFF = ("radau", "bdf", "lsoda", "cvode", "kvaerno5")


def part(where, **options):
    """Return as much of a run as was followed before a limit ended it."""
    with pytest.raises(Unfinished) as stop:
        ap.solve(where, **options)
    return stop.value.path


def scene(name, mu, **other):
    return ap.Scene(1, mu, SCENES[name], 5, **other)


def test_the_rod_as_numbers_has_the_fields_of_the_paper():
    automaton = automaton_of(ap.Scene("1/2", "1/8", (0, 0, 1), 1))
    x, y, z, s = 0.25, -1.5, 0.75, -1.25
    for phase, a, b in (((1, 1), 1, 4.5), ((-1, 1), 1, -0.5), ((1, 0), 0, 1)):
        mode = automaton.mode((Phase(*phase),))
        rate = a - (b - 1) * s if phase[1] else 0
        assert mode.rhs(0, (x, y, z)) == pytest.approx((y, 8 * (a - b * s), rate), rel=1e-15)
        rows = ((0, 1, 0), (-8 * b, -8 * b, 0), (1 - b, 1 - b, 0) if phase[1] else (0, 0, 0))
        assert np.allclose(mode.jac(0, (x, y, z)), rows, rtol=1e-15)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("method", here(*FAMILIES))
@pytest.mark.few(4)
def test_every_integrator_follows_the_modes_of_the_exact_flow(method, name):
    exact = ap.solve(scene(name, 0.05))
    path = ap.solve(scene(name, 0.05), method=method, rtol=1e-9)
    assert path.info["status"] == FINISHED
    assert path.model == method
    assert path.modes == exact.modes
    assert [e.kind for e in path.events] == [e.kind for e in exact.events]
    assert np.allclose([e.t for e in path.events], [e.t for e in exact.events], atol=1e-6)
    assert np.allclose(path.final, exact.final, atol=1e-6)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("method", here(*STIFF))
@pytest.mark.few(2)
def test_careful_stiff_integrators_solve_the_ordinary_scenes_however_stiff(method, name):
    exact = ap.solve(scene(name, 1e-8))
    path = ap.solve(scene(name, 1e-8), method=method, rtol=1e-6)
    assert path.info["status"] == FINISHED
    assert path.modes == exact.modes
    assert np.allclose(path.final, exact.final, atol=1e-4)


@pytest.mark.parametrize("method", here(*FAMILIES, "sign", "tanh", "moreau"))
@pytest.mark.few(2)
def test_dense_output_is_the_run_itself_seen_at_other_times(method):
    where, rtol = scene("i" if method == "sign" else "iii", 0.05), 1e-4 if method == "moreau" else 1e-6
    path = ap.solve(where, method=method, rtol=rtol)
    grid = np.linspace(0, 5, 41).reshape(41, 1)
    seen = path(grid)
    assert seen.shape == (3, 41, 1)
    assert tuple(seen[:, -1, 0]) == pytest.approx(path.final, rel=1e-12)
    assert np.array_equal(seen[:, 0, 0], [float(v) for v in path.scene.start])
    exact = np.array([ap.solve(path.scene).at(float(t)) for t in grid.ravel()]).T
    assert np.abs(seen[:, :, 0] - exact).max() < 0.02
    assert path(2.5).shape == (3,)
    with pytest.raises(OutOfRange, match="outside the run"):
        path(5.5)


@pytest.mark.parametrize("eps", [0, -1])
def test_a_regularised_friction_law_has_a_positive_width(eps):
    with pytest.raises(InputError, match=f"eps = {eps}: the width"):
        ap.solve(scene("i", 0.05), method="tanh", eps=eps)


@pytest.mark.parametrize("method", ["sign", "tanh"])
def test_one_right_hand_side_has_no_contact_that_opens_and_no_load_with_its_own_force(method):
    """Of such a load an argument F was said to be missing."""
    x, v, z, force = sp.symbols("x v z F", real=True)
    contact = ap.Friction(velocity=z, force=force, load=1, kinetic=1, gap=x)
    fed_back = replace(contact, gap=None, load=2 + x * force)
    for told, friction in (("no contacts that open", contact), ("no load that contains its own force", fed_back)):
        system = ap.System.with_frictions({x: v, v: -1, z: force}, {}, [friction])
        with pytest.raises(InputError, match=told):
            ap.solve(ap.Scene(system=system, values={}, start={x: 1, v: 0, z: 1}, until=1), method=method)


def test_a_reference_with_digits_knows_its_end_under_the_double_next_to_it():
    x = sp.Symbol("x", real=True)
    decay = ap.System.smooth({x: -(x**2)}, {}, None)
    path = ap.solve(ap.Scene(system=decay, values={}, start={"x": 1}, until="0.1"), digits=12)
    assert path.model == "collocation"
    assert float(path(0.1)[0]) == pytest.approx(1 / 1.1, rel=1e-11)


def test_the_snapped_states_lie_on_the_surface_they_met():
    path = ap.solve(scene("iii", 1e-5), method="lsoda", rtol=1e-8)
    met, left, turned = path.events
    assert (met.kind, met.z, left.kind, left.z, turned.kind) == (
        "velocity_zero", 0.0, "slip_onset", 0.0, "force_zero")
    assert abs(left.x + left.y + 0.5) < 1e-15 * abs(left.x)
    assert abs(turned.x + turned.y) <= 1e-15 * abs(turned.x)


def test_random_scenes_have_the_exact_modes_from_awkward_starts_too():
    rng = random.Random(20)
    for _ in range(40):
        sigma = rng.choice([1.0, rng.uniform(-1.9, 4)])
        sigma0 = sigma + rng.choice([0.0, rng.uniform(0, 2)])
        x, y, z = (rng.uniform(-2, 2) for _ in range(3))
        x, y, z = rng.choice([(x, y, z), (x, y, 0.0), (x, -x, z), (x, -x, 0.0), (x, 1 / (sigma0 + 3) - x, 0.0)])
        where = ap.Scene(sigma, 10 ** rng.uniform(-4, 0), (x, y, z), 3, sigma0=sigma0)
        assert ap.solve(where, method="lsoda", rtol=1e-10).modes == ap.solve(where).modes, where


def test_static_friction_above_kinetic_moves_the_edge_that_the_integrator_leaves():
    path = ap.solve(ap.Scene(1, 0.01, (0, "0.2", -1), 5, sigma0=3), method="radau", rtol=1e-8)
    onset = path.events[1]
    assert (onset.kind, path.modes[1]) == ("slip_onset", "stick")
    assert onset.x + onset.y == pytest.approx(1 / 6, rel=1e-12)


@pytest.mark.parametrize("method", ["exact", "rk45", "lsoda", "radau"])
def test_a_block_that_stops_where_its_load_steps_is_held_by_its_static_friction(method):
    """Its velocity is 1 - t up to t = 1, where the load falls to 1; the push rises to 3/2, static friction."""
    x, v, force, time = sp.symbols("x v F t", real=True)
    push, load = (sp.Piecewise((before, time < 1), (after, True)) for before, after in ((1, sp.Rational(3, 2)), (2, 1)))
    law = ap.Friction(velocity=v, force=force, load=load, kinetic=1, static=sp.Rational(3, 2))
    block = ap.System.with_frictions({x: v, v: push + force}, {}, [law], time=time)
    path = ap.solve(ap.Scene(system=block, start={"x": 0, "v": 1}, until=3), method)
    assert path.modes == ("slip_same", "stick")
    assert path.events[0].kind == "velocity_zero"
    assert path.final == pytest.approx((1 / 2, 0), abs=1e-5)


@pytest.mark.parametrize("method", ["rk45", "dop853", *here("heyoka", "cvode", "kvaerno5")])
def test_a_budget_of_steps_ends_a_run_with_a_sentence(method):
    path = part(scene("ii", 1e-6), method=method, rtol=1e-9, steps=20)
    assert path.info["status"].startswith("step limit reached at t = ")
    assert 0 < path.info["reached"] < 5


@pytest.mark.parametrize("method", ["rk45", "radau", *here("heyoka", "cvode", "kvaerno5")])
def test_a_budget_of_seconds_ends_a_run_with_a_sentence(method):
    path = part(scene("ii", 1e-8), method=method, rtol=1e-9, seconds=0.0)
    assert path.info["status"].startswith("time limit reached at t = ")


def test_a_budget_of_events_ends_a_run_with_a_sentence():
    path = part(scene("iii", 0.01), method="lsoda", events=1)
    assert path.info["status"].startswith("limit of 1 events reached at t = 0.08")


def test_a_scene_of_no_length_ends_where_it_starts():
    assert ap.solve(ap.Scene(1, 0.1, (0, "0.2", -1), 0), method="lsoda").final == (0.0, 0.2, -1.0)


@pytest.mark.parametrize(("method", "module", "package"), [
    ("heyoka", "heyoka", "heyoka"), ("cvode", "sksundae.cvode", "scikit-sundae"), ("kvaerno5", "jax", "diffrax"),
])
def test_a_missing_peer_is_one_line_with_the_way_to_get_it(monkeypatch, method, module, package):
    for name in [m for m in sys.modules if m.split(".")[0] == module.split(".")[0]]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    if method == "heyoka":
        from asympk.integrators import heyoka_taylor

        heyoka_taylor._compiled.cache_clear()
    with pytest.raises(MissingPackage) as caught:
        ap.solve(scene("i", 0.1), method=method)
    assert str(caught.value).endswith(f"pip install '{package}'")
    assert "\n" not in str(caught.value)


def test_the_extra_peers_has_every_package_that_a_method_may_lack():
    extra = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    named = {re.match(r"[\w-]+", line)[0] for line in extra["optional-dependencies"]["peers"]}
    assert {package for _, package in PEERS.values()} == named
    assert {method for method, (module, _) in PEERS.items() if not find_spec(module)} == set(absent())


@pytest.mark.parametrize("options", [{"rtol": 1e-15}, {"rtol": 2}, {"rtol": float("nan")}, {"atol": 0}])
def test_tolerances_that_doubles_cannot_follow_are_refused(options):
    with pytest.raises(InputError):
        ap.solve(scene("i", 0.1), method="lsoda", **options)


def test_unknown_solvers_and_steps_are_refused_by_name():
    with pytest.raises(InputError, match="'euler'"):
        ap.solve(scene("i", 0.1), method="sign", solver="euler")
    with pytest.raises(InputError, match="step = 0"):
        ap.solve(scene("i", 0.1), method="moreau", step=0)
    with pytest.raises(UnknownName, match="rk46"):
        ap.solve(scene("i", 0.1), method="rk46")


@pytest.mark.parametrize("name", ["slip_same", "slip_opposite", "stick"])
def test_the_modes_of_the_rod_in_numbers_are_those_of_its_derived_system(name):
    system, (sigma, mu) = painleve_klein.system(), sp.symbols("sigma mu", real=True)
    mode, (x, y, z) = system.mode(name), system.states
    named = {s: {"sigma": sigma, "mu": mu}.get(s.name, s) for s in system.parameters}
    a, b = modes.coefficients(name, sigma)
    assert sp.expand(mode.fast[y].subs(named) - (a - b * (x + y))) == 0
    assert sp.expand(mode.slow[z].subs(named) - (a - (b - 1) * (x + y)) * int(name != "stick")) == 0
    assert {load * v: Phase(load, v).mode for load in (1, -1) for v in (0, 1, -1)} == modes.MODES


def test_the_edges_of_stick_in_numbers_are_those_of_the_derived_system():
    sigma0 = next(s for s in painleve_klein.system().parameters if s.name == "sigma0")
    upper, lower = ap.stick_regions(painleve_klein.system()).edges
    assert (sp.expand(1 / lower), 1 / upper) == modes.cone(sigma0)


@pytest.mark.slow
@pytest.mark.parametrize("method", here("heyoka", "kvaerno5"))
def test_a_function_that_a_peer_lacks_is_told_as_that(method):
    """Targets were named, 'numpy' or 'math', and 'mpmath' in place of these."""
    x = sp.Symbol("x", real=True)
    scene = ap.Scene(system=ap.System.smooth({x: -sp.LambertW(x)}, {}, None), start={x: 2}, until=1)
    with pytest.raises(InputError, match=r"has a function that (heyoka|JAX) lacks, LambertW; use method 'exact'$"):
        ap.solve(scene, method=method)


@pytest.mark.parametrize("reach", ["1/300", "1/1000"])
def test_a_block_stops_on_its_belt_though_its_law_is_beyond_all_doubles_a_little_farther(reach):
    """Friction is 1/10 + 8/10 exp(-|w|/reach): continued beyond w = 0 it overflows. LSODA was said to do so, too."""
    x, v, force = sp.symbols("x v F", real=True)
    law = sp.Rational(1, 10) + sp.Rational(8, 10) * sp.exp(-sp.Abs(v - 1) / sp.Rational(reach))
    belt = ap.Friction(velocity=v - 1, force=force, load=1, kinetic=law)
    scene = ap.Scene(system=ap.System.with_frictions({x: v, v: force - x}, {}, [belt]), start={x: 0, v: 1}, until=10)
    path, other = ap.solve(scene), ap.solve(scene, method="dop853", rtol=1e-11, atol=1e-13)
    assert path.modes == other.modes == ("stick", "slip_opposite", "stick", "slip_opposite")
    assert [event.t for event in path.events] == pytest.approx([event.t for event in other.events], abs=1e-6)


@pytest.mark.parametrize("reach", ["1/2000", "1/1000000"])
@pytest.mark.parametrize("method", here("lsoda", "cvode", "kvaerno5"))
def test_a_block_is_followed_to_every_stop_where_its_law_grows_beyond_all_doubles_behind_it(method, reach):
    """CVODE was said to leave the range; in Kvaerno5 the error of an infinite state was nan, or 0."""
    x, v, force = sp.symbols("x v F", real=True)
    law = sp.Rational(1, 10) + sp.Rational(8, 10) * sp.exp(-sp.Abs(v) / sp.Rational(reach))
    ground = ap.Friction(velocity=v, force=force, load=1, kinetic=law)
    scene = ap.Scene(system=ap.System.with_frictions({x: v, v: force - x}, {}, [ground]), start={x: 3, v: 0}, until=20)
    path, other = (ap.solve(scene, method=name, rtol=1e-10, atol=1e-12) for name in (method, "dop853"))
    assert path.modes == other.modes
    assert [event.t for event in path.events] == pytest.approx([event.t for event in other.events], abs=1e-4)


def dipping(load, time=None):
    """Return a system whose load is positive but for a while: u' = 1, and friction slows down v."""
    u, v, force = sp.symbols("u v F", real=True)
    friction = ap.Friction(velocity=v, force=force, load=load(time or u), kinetic=1)
    return ap.System.with_frictions({u: sp.S.One, v: force}, {}, [friction], time=time)


def valley(u):
    """Vanish at u = 0.99 and 1.01: falling before, rising after."""
    return (u - 1) ** 2 - sp.Rational(1, 10**4)


def wave(u):
    """Vanish at 0.52331112 and 0.62975293 alone in u > 0: rising at both ends of a long step."""
    return u**3 - u + sp.Rational(38, 100)


INTEGRATORS = ["rk45", "dop853", "radau", "bdf", "lsoda", *here("heyoka", "cvode", "kvaerno5")]


def loses_its_load(path, *times):
    assert [e.kind for e in path.events] == ["force_zero", "force_zero"]
    assert [float(e.t) for e in path.events] == pytest.approx(times, rel=1e-9)


@pytest.mark.parametrize("method", INTEGRATORS)
def test_a_load_that_vanishes_and_comes_back_within_one_step_is_seen(method):
    where = ap.Scene(system=dipping(valley), values={}, start={"u": 0, "v": 10}, until=3)
    loses_its_load(ap.solve(where, method=method, seconds=600), 0.99, 1.01)


@pytest.mark.parametrize("method", [m for m in INTEGRATORS if "kvaerno5" not in str(m)])
def test_a_load_that_rises_at_both_ends_of_a_step_and_falls_below_zero_within_is_seen(method):
    where = ap.Scene(system=dipping(wave), values={}, start={"u": "-1.1", "v": 10}, until=3)
    low, high = sorted(np.roots([1, 0, -1, 0.38]))[1:]
    loses_its_load(ap.solve(where, method=method), low + 1.1, high + 1.1)


@pytest.mark.parametrize("method", ["rk45", "lsoda", *here("cvode")])
def test_a_load_that_depends_on_the_time_is_followed_as_one_that_depends_on_the_state(method):
    t = sp.Symbol("t", real=True)
    where = ap.Scene(system=dipping(valley, t), values={}, start={"u": 0, "v": 10}, until=3)
    loses_its_load(ap.solve(where, method=method), 0.99, 1.01)


@pytest.mark.parametrize("load", [valley, wave])
def test_references_see_a_load_that_vanishes_for_a_while(load):
    where = ap.Scene(system=dipping(load), values={}, start={"u": "-1.1" if load is wave else 0, "v": 10}, until=3)
    expected = [e.t for e in ap.solve(where, method="dop853", rtol=1e-10).events]
    loses_its_load(ap.solve(where, digits=20), *expected)


def _passing(rate):
    """Return the scene of x' = 1, y' = rate(x) from x = -1/2 to 1/2."""
    x, y = sp.symbols("x y", real=True)
    return ap.Scene(system=ap.System.smooth({x: 1, y: rate(x)}, {}, None), values={}, start=("-1/2", 0), until=1)


@pytest.mark.slow
@pytest.mark.parametrize("method", [*here("exact", *FAMILIES), None])
def test_a_pole_that_a_motion_meets_is_refused_by_every_method(method):
    options = {"method": method} if method else {"digits": 8}
    with pytest.raises((OutOfRange, Unfinished), match=r"= 0\.8333|x - 1/3 = 0"):
        ap.solve(_passing(lambda x: 1 / (x - sp.Rational(1, 3))), **options)


def test_a_pole_of_one_rate_is_none_of_the_limits_of_the_others():
    with pytest.raises(Unfinished, match=r"rates are divided by x, and that is 0 at t = 0\.5"):
        ap.solve(_passing(lambda x: 1 / x), method="rk45")


@pytest.mark.parametrize("method", ["rk45", "lsoda"])
def test_a_divisor_that_has_nearly_vanished_ends_no_run_whose_steps_go_on(method):
    """p = exp(-50 t) is below 1e-8 from t = 0.37 on, and q = log((1 + e)/(p + e))/50."""
    p, q, y, w = sp.symbols("p q y w", real=True)
    beside = ap.System.smooth({p: -50 * p, q: p / (p + sp.Rational(1, 10**9)), y: w, w: -160_000 * y}, {}, None)
    path = ap.solve(ap.Scene(system=beside, start=[1, 0, 1, 0], until=1), method)
    assert path.info["work"]["steps"] > 1500
    assert path.final[1] == pytest.approx(np.log((1 + 1e-9) / (np.exp(-50) + 1e-9)) / 50, rel=1e-8)


def test_a_quotient_that_has_a_limit_where_its_divisor_vanishes_is_followed_through_it():
    path = ap.solve(_passing(lambda x: sp.sin(x) / x))
    assert path.final[1] == pytest.approx(2 * float(sp.Si(sp.Rational(1, 2))), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["exact", "radau", "lsoda"])
def test_an_arm_that_folds_is_followed_past_where_its_links_are_in_line(method):
    """Gap rate and sliding velocity depend on each other there, and no formula of the rates is divided by both."""
    epsilon = sp.Symbol("epsilon", positive=True)
    elastic = arm.mechanism().elastic(compliance=epsilon**2, damping=epsilon / 2)
    values = {"m": 1, "b_0": 1, "S": "1.24", "E": "-2.46", "f": "1.6", "epsilon": "0.0379"}
    state = {"a": 1.0778, "b": 1.0160, "a'": 0.4296, "b'": -0.4452}
    scene = example_scene(arm.mechanism(), elastic, values, state, 1, "folding arm")
    path = ap.solve(scene, method)
    assert path.modes == ("slip_opposite", "open")
    assert path.final[:2] == pytest.approx((1.87137982, -3.12473245), abs=1e-5)  # of Newton's law, friction by tanh
    start = dict(zip(scene.names, scene.start, strict=True)) | {"z": "0.3"}
    with pytest.raises(InputError, match=r"start: z is not a'\*cos\(a\) \+ b'\*cos\(b\) = -?0\.[0-9]+, which follows"):
        ap.solve(replace(scene, start=start), method)


@pytest.mark.parametrize("start", ["6/7", "9/7", "12/7", "15/7"])
def test_an_event_at_a_pole_does_not_hide_it(start):
    """y' = z/x with x' = 1 and z = 0 where x = 0: some starts stalled there, or had a rate that is not finite."""
    x, y, z, F = sp.symbols("x y z F", real=True)
    friction = Friction(z, F, sp.S.One, sp.Rational(1, 2), sp.Rational(1, 2))
    system = ap.System.with_frictions({x: sp.S.One, y: z / x, z: 1 + F}, {}, [friction])
    begun = {"x": -sp.Rational(start), "y": 0, "z": -sp.Rational(start) * 3 / 2}
    for method in ("radau", "lsoda"):
        with pytest.raises(OutOfRange, match=r"have a pole, which the motion has (passed|reached)"):
            ap.solve(ap.Scene(system=system, start=begun, until=5), method)


@pytest.mark.further
def test_a_slider_crank_on_an_elastic_guide_does_not_turn_around_at_its_dead_centre():
    """There slip ends where its velocity and the gap rate are no basis: of these alone no run goes on rightly."""
    eps = sp.Symbol("eps", positive=True)
    elastic = crank_slider.mechanism().elastic(compliance=eps**2, damping=eps)
    values = {"J": 2, "m": 1, "r": 1, "l": "6/5", "T": 1, "f": "1/5", "eps": "1e-3"}
    phi = -np.arcsin(np.sin(0.3) / 1.2)
    state = {"theta": -0.3, "phi": phi, "theta'": 0.3, "phi'": 0.3 * np.cos(0.3) / 1.2 / np.cos(phi)}
    path = ap.solve(example_scene(crank_slider.mechanism(), elastic, values, state, 3, "dead centre"))
    rigid = crank_slider.mechanism().rigid()
    other = ap.solve(example_scene(crank_slider.mechanism(), rigid, values, state, 3, "dead centre"))
    assert path.modes == other.modes
    assert path.final[:2] == pytest.approx(other.final[:2], abs=1e-4)


def _late(mu, until=2, start=1, **options):
    """x' = 1, mu y' = x y - y^2 from x = -1: y leaves the branch y = 0 late, where x has been positive for as long."""
    x, y, small = sp.symbols("x y mu", real=True)
    system = ap.System.smooth({x: 1}, {y: x * y - y**2}, small)
    return ap.solve(ap.Scene(system=system, values={"mu": mu}, start={"x": -1, "y": start}, until=until), **options)


@pytest.mark.further
def test_a_late_loss_of_stability_is_refused_in_doubles_and_followed_by_as_many_more_digits_as_errors_grow():
    """y = E / (1 + int E / mu), E = exp(((t - 1)^2 - 1) / (2 mu)): errors grow by exp(1 / (2 mu)) from t = 1 to 2."""
    with pytest.raises(Undecided, match=r"errors of the run grow 3e\+21-fold .*ask for 20 digits"):
        _late("1/100")
    found = _late("1/100", digits=20).final[1]
    with mp.workdps(40):
        grown = [mp.exp(((t - 1) ** 2 - 1) * 50) for t in (0, 2)]
        area = mp.sqrt(mp.pi / 50) * mp.erfi(mp.sqrt(50)) * mp.exp(-50)
        assert abs(mp.mpf(found) - grown[1] / (1 + 100 * area)) < mp.mpf(10) ** -19


@pytest.mark.parametrize("part", [24, 30])
def test_a_motion_whose_errors_grow_but_not_beyond_those_of_doubles_is_followed_with_smaller_ones(part):
    """Errors grow by exp(part / 2): for 24 the end was wrong by 6e-5 of itself, and for 30 the run was refused."""
    found, mu = _late(f"1/{part}").final[1], mp.mpf(1) / part
    area = mp.quad(lambda t: mp.exp(((t - 1) ** 2 - 1) / (2 * mu)), [0, 0.5, 1, 1.5, 2])
    assert found == pytest.approx(float(1 / (1 + area / mu)), rel=3e-5)


@pytest.mark.parametrize(
    "options", [{}, {"method": "radau"}, {"method": "dop853"}, pytest.param({"digits": 15}, marks=pytest.mark.slow)]
)
def test_a_puck_that_dry_friction_in_a_plane_stops_is_refused_there_by_what_its_rates_are_divided_by(options):
    """A puck on a slope of half its friction, pushed across: it stops at t = v / (f (1 - 1/4)) = 8/3."""
    x, y, u, v = sp.symbols("x y u v", real=True)
    speed = sp.sqrt(u**2 + v**2)
    puck = ap.System.smooth({x: u, y: v, u: -u / speed - sp.Rational(1, 2), v: -v / speed}, {}, None)
    scene = ap.Scene(system=puck, start={x: 0, y: 0, u: 0, v: 2}, until=5)
    with pytest.raises((Unfinished, OutOfRange), match=r"divided by u\*\*2 \+ v\*\*2, and that is 0") as stop:
        ap.solve(scene, **options)
    assert "at t = 2.6" in str(stop.value)


def test_errors_that_grew_before_the_motion_came_back_to_an_attracting_branch_are_refused():
    """Beside many predators a fast prey falls to e**-2300, its growth back takes from t = 3.2 to 8.2.

    Doubles kept the prey at 1e-9, and so brought it back twice by t = 8.
    """
    x, y, small = sp.symbols("x y mu", real=True)
    part = sp.Rational(3, 10)
    system = ap.System.smooth({y: y * (x / (x + part) - part)}, {x: x * (1 - x) - x * y / (x + part)}, small)
    scene = ap.Scene(system=system, values={"mu": "1/1000"}, start={"x": "1/2", "y": "4/5"}, until=8)
    with pytest.raises(Undecided, match="errors of the run grow"):
        ap.solve(scene)


def test_errors_as_large_as_the_states_on_the_way_are_refused_even_where_linear_ones_have_faded():
    """Lorenz's motion is chaotic for a time and then rests where x**2 = 8 (20 - 1) / 3: at which x, errors decide.

    In doubles it ended at x = 7.118, and from a start that is 1e-11 less in x at x = -7.118.
    """
    x, y, z = sp.symbols("x y z", real=True)
    lorenz = ap.System.smooth({x: 10 * (y - x), y: x * (20 - z) - y, z: x * y - 8 * z / sp.Integer(3)}, {}, None)
    with pytest.raises(Undecided, match="errors of the run grow"):
        ap.solve(ap.Scene(system=lorenz, start=(2, 3, 5), until=150))


@pytest.mark.parametrize("part", [80, 100, 120, 500])
def test_a_state_that_comes_back_from_mere_errors_is_refused_even_where_these_have_faded(part):
    """The prey comes back at t = 28.1, and y(20) = 0.41, y(30) = 0.33; doubles brought it back at 11, and y was 0.99.

    While the prey is gone, y' = -y/10 from y(10.7) = 1.03 on.
    """
    x, y, small = sp.symbols("x y mu", real=True)
    system = ap.System.smooth({y: y * x / (1 + x) - y / 10}, {x: x * (1 - x) - x * y / (1 + x)}, small)
    for until in (20, 30, 100):
        scene = ap.Scene(system=system, values={"mu": sp.Rational(1, part)}, start={"x": "1/2", "y": 3}, until=until)
        with pytest.raises(Undecided, match="errors of the run grow"):
            ap.solve(scene)


@pytest.mark.parametrize("part", [40, 60, 120])
def test_a_pole_that_grown_errors_lead_to_is_told_as_the_growth_of_errors(part):
    """The prey x > 0 never reaches the pole x = -1; errors make it negative, and from there it runs to the pole."""
    x, y, small = sp.symbols("x y mu", real=True)
    system = ap.System.smooth({y: y * x / (1 + x) - y / 10}, {x: x * (1 - x) - x * y / (1 + x)}, small)
    scene = ap.Scene(system=system, values={"mu": sp.Rational(1, part)}, start={"x": "1/2", "y": 3}, until=100)
    with pytest.raises(Undecided, match="errors of the run grow"):
        ap.solve(scene)
    with pytest.raises(Unfinished, match="grows beyond bounds"):  # x' = x^3 + 100 x does, and errors with it
        ap.solve(ap.Scene(system=ap.System.smooth({x: x**3 + 100 * x}, {}, None), start={x: 1}, until=1))


@pytest.mark.parametrize("until", [1, 10])
def test_a_state_that_dies_out_passes_no_pole_beside_an_oscillation(until):
    """p' = -p/(p + e), e = 1e-9, is over at t = 1/2; errors of 1e-10 a step took p to -e."""
    x, y, p = sp.symbols("x y p", real=True)
    dying = ap.System.smooth({x: y, y: -x, p: -p / (p + sp.Rational(1, 10**9))}, {}, None)
    path = ap.solve(ap.Scene(system=dying, start={x: 1, y: 0, p: "1/2"}, until=until))
    assert path.final == pytest.approx((math.cos(until), -math.sin(until), 0), abs=1e-8)


def test_more_steps_are_allowed_where_the_refusal_of_an_exact_method_asks_for_them():
    x, y, c, small = sp.symbols("x y c mu", real=True)
    follower = ap.System.smooth({x: y, y: -x}, {c: x - c - c**3}, small)
    scene = ap.Scene(system=follower, values={"mu": "1/1000"}, start={"x": 1, "y": 0, "c": 0}, until=20)
    with pytest.raises(Unfinished, match=r"step limit reached at t = .*; allow more steps"):
        ap.solve(scene, steps=1000)
    assert ap.solve(scene, steps=10_000).final[0] == pytest.approx(math.cos(20), abs=1e-8)


def test_a_state_that_is_large_in_its_units_hides_no_growth_of_the_errors_of_another():
    """Beside z = 1e14 the run ended at y = 0.965; y = 0.330, as above."""
    x, y, z, small = sp.symbols("x y z mu", real=True)
    system = ap.System.smooth({x: 1, z: -z}, {y: x * y - y**2}, small)
    for large in (1, 10**14, 10**21):
        with pytest.raises(Undecided, match="errors of the run grow"):
            ap.solve(ap.Scene(system=system, values={"mu": "1/69"}, start={"x": -1, "y": 1, "z": large}, until=2))


def test_a_state_of_a_small_size_beside_a_motion_of_many_steps_is_followed_to_errors_relative_to_its_size():
    """x moves by 2e-4 at first: errors of 1e-10 in each of 5000 steps of a pendulum were a noticeable part of it."""
    x, y, u, v = sp.symbols("x y u v", real=True)
    system = ap.System.smooth({x: y / 5000, y: -y, u: v, v: -sp.sin(u)}, {}, None)
    end = ap.solve(ap.Scene(system=system, start={"x": 0, "y": 1, "u": 1, "v": 0}, until=200)).final
    assert end[0] == pytest.approx(2e-4, rel=1e-8)
    assert end[3] ** 2 / 2 - math.cos(end[2]) == pytest.approx(-math.cos(1), abs=1e-7)


def test_errors_do_not_grow_by_the_units_of_the_states():
    """Henri's enzyme, also with its complex in units of 1e-21: squaring of exponentials lost its substrate."""
    x, y, small, unit = sp.symbols("x y mu l", positive=True)
    share = y / unit
    enzyme = ap.System.smooth({x: (x + sp.S.Half) * share - x}, {y: (x - (x + 1) * share) * unit}, small)
    ends = []
    for power in (0, 21, -21):
        values, start = {"mu": "1/1000", "l": f"1e{power}"}, {"x": 1, "y": f"2e{power}"}
        ends.append(ap.solve(ap.Scene(system=enzyme, values=values, start=start, until=1)).final[0])
    assert ends == pytest.approx([0.7672698507] * 3, rel=1e-8)


def test_a_velocity_that_is_tiny_because_it_turns_has_lost_no_digits_whatever_its_friction_drives():
    """At the next turn the fast y, which follows the friction force, jumps by 1e9 times the error of the time."""
    (z, y, F, t), mu = sp.symbols("z y F t", real=True), sp.Symbol("mu", positive=True)
    rough = ap.Friction(velocity=z, force=F, load=1, kinetic=sp.S.Half)
    rates = {z: sp.cos(t) - z**3 / 10 + F}
    body = ap.System.with_frictions(rates, {}, [rough], time=t)
    followed = ap.System.with_frictions(rates, {y: F - y}, [rough], small=mu, time=t)
    path = ap.solve(ap.Scene(system=followed, values={mu: "1e-9"}, start={z: 1, y: 0}, until=8))
    alone = ap.solve(ap.Scene(system=body, start={z: 1}, until=8))
    assert path.modes == alone.modes == ("slip_same", "slip_opposite", "slip_same")
    assert path.final == pytest.approx((*alone.final, -0.5), abs=1e-8)


def test_a_growth_of_errors_beyond_all_digits_is_refused_with_digits_too():
    with pytest.raises(Undecided, match=r"grow beyond all bounds to its end .*; end the run before"):
        _late("1/1000", digits=15)


def test_a_motion_that_is_over_before_its_errors_grow_is_followed():
    assert _late("1/1000", until=1).final[1] == pytest.approx(0, abs=1e-10)


def test_a_state_that_is_zero_and_stays_so_makes_no_errors():
    assert _late("1/1000", start=0).final == pytest.approx((1, 0))


def test_what_a_solver_leaves_of_a_block_that_rests_at_0_is_rounding_and_no_size_of_it():
    q, u, y, force, mu = sp.symbols("q u y F mu", real=True)
    slow, fast = {q: u, u: force - q**3 - 2 * q - u / 2}, {y: 3 * force / 4 - 3 * q / 4 - 2 * y - 1}
    block = ap.System.with_frictions(slow, fast, [ap.Friction(u, force, load=y + 1, kinetic=sp.S.Half)], small=mu)
    path = ap.solve(ap.Scene(system=block, values={"mu": "1e-4"}, start={"q": 0, "u": 0, "y": 1}, until=3))
    assert path.modes == ("stick",)
    assert path.final == pytest.approx((0, 0, -0.5), abs=1e-12)


def test_an_event_at_which_both_fields_agree_makes_no_errors_though_its_guard_has_no_rate_there():
    """A block that a hair parts from its undamped elastic ground touches it at once, at rest as far as doubles tell."""
    y, u, v, F, N = sp.symbols("y u v F N", real=True)
    friction = ap.Friction(velocity=v, force=F, load=-100 * y, kinetic=sp.Rational(1, 10), gap=100 * y, normal=N)
    block = ap.System.with_frictions({y: u, u: N - 1, v: F - v**3}, {}, [friction])
    path = ap.solve(ap.Scene(system=block, values={}, start={y: "1e-40", u: 0, v: 1}, until=1))
    assert path.modes == ("open", "slip_same")
    assert path.final[:2] == pytest.approx(((np.cos(10) - 1) / 100, -np.sin(10) / 10), abs=1e-8)


UNITS = [("1e-12", 1), ("1e-6", "1e6"), ("1e-6", "1e3"), ("1e6", "1e-6"), (1, "1e15")]


@pytest.mark.parametrize(("length", "frequency"), UNITS)
def test_a_nonlinear_motion_is_the_same_in_all_units(length, frequency):
    """A block on a hardening spring, in units of the length a and the time 1/omega."""
    x, v, F = sp.symbols("x v F", real=True)
    a, omega = sp.symbols("a omega", positive=True)
    friction = ap.Friction(velocity=v, force=F, load=omega**2 * a, kinetic=1)
    spring = ap.System.with_frictions({x: v, v: F - omega**2 * (x + x**3 / a**2 / 1000)}, {}, [friction])

    def end(a, omega):
        values, start = {"a": a, "omega": omega}, {"x": 5 * float(a), "v": 0}
        path = ap.solve(ap.Scene(system=spring, values=values, start=start, until=10 / float(omega)))
        return path.modes, path.final[0] / float(a)

    (modes, place), (others, there) = end(1, 1), end(length, frequency)
    assert others == modes
    assert there == pytest.approx(place, abs=1e-7)


@pytest.mark.parametrize("unit", ["1e-13", "1e-8", "1e8"])
def test_a_state_in_a_unit_of_its_own_is_as_exact_as_in_that_of_the_others(unit):
    """A pendulum whose brake follows its velocity with a lag, the moment of the brake in any unit."""
    x, v, y = sp.symbols("x v y", real=True)
    k, mu = sp.symbols("k mu", positive=True)
    system = ap.System.smooth({x: v, v: y / k - sp.sin(x)}, {y: -k * v - y}, mu)
    scenes = (ap.Scene(system=system, values={"mu": "1/10", "k": k}, start={x: 2, v: 0, y: 0}, until=5)
              for k in (1, unit))
    (*expected, moment), (*found, measured) = (ap.solve(scene).final for scene in scenes)
    assert found == pytest.approx(expected, abs=1e-8)
    assert measured / float(unit) == pytest.approx(moment, abs=1e-8)


def test_a_stick_whose_rates_do_not_depend_on_the_state_is_followed_to_digits():
    """The block of the page on one's own systems sticks to a belt until its spring draws with the static friction."""
    x, v, F = sp.symbols("x v F", real=True)
    kinetic = sp.Rational(4, 5) / (1 + sp.Abs(v - 1))
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v - 1, F, load=1, kinetic=kinetic, static=1)])
    scene = ap.Scene(system=block, start={"x": 0, "v": 1}, until=3)
    path = ap.solve(scene, digits=15)
    assert path.modes == ("stick", "slip_opposite")
    assert path.events[0].t == 1
    assert [float(w) for w in path.final] == pytest.approx(ap.solve(scene).final, abs=1e-8)


@pytest.mark.parametrize("options", [{"method": "tanh"}, {"method": "lsoda"}, {"digits": 20}])
@pytest.mark.parametrize("rate", ["1/x", "sqrt(x)", "sqrt(x - 1)"])
def test_a_start_without_a_finite_rate_or_slope_is_refused_by_every_method(rate, options):
    x, v, F = sp.symbols("x v F", real=True)
    friction = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=1)
    system = ap.System.with_frictions({x: v, v: F + sp.sympify(rate, {"x": x})}, {}, [friction])
    with pytest.raises((OutOfRange, Unfinished), match=r"range of floats|not a finite real number"):
        ap.solve(ap.Scene(system=system, values={}, start={"x": 0, "v": 1}, until=1), **options)


@pytest.mark.parametrize(
    ("rate", "start", "options", "advice"),
    [("log(x)", 0, {}, "range of floats .* no finite real number; end the run before"),
     ("x**2", 1, {}, "stalled .* grows beyond bounds"),
     ("sin(50*x) + 1", 0, {"steps": 3}, "step limit reached .*; allow more steps, or"),
     ("sin(50*x) + 1", 0, {"seconds": 0}, "time limit reached .*; allow more seconds, or")],
)
def test_a_run_that_stops_short_says_what_helps(rate, start, options, advice):
    x = sp.Symbol("x", real=True)
    system = ap.System.smooth({x: sp.sympify(rate, {"x": x})}, {}, None)
    with pytest.raises(Unfinished, match=advice):
        ap.solve(ap.Scene(system=system, start=[start], until=2), "radau", **options)


@pytest.mark.parametrize("method", ["lsoda", *here("cvode")])
def test_a_run_whose_steps_gain_no_more_time_is_given_up_long_before_all_are_spent(method):
    """x = 1/(1 - t) grows beyond all bounds; these two solvers then step on the spot."""
    x = sp.Symbol("x", real=True)
    with pytest.raises(Unfinished, match=r"stalled \(the last 101 steps gained nothing\)") as caught:
        ap.solve(ap.Scene(system=ap.System.smooth({x: x**2}, {}, None), start=[1], until=2), method)
    assert caught.value.path.info["work"]["steps"] < 2000


@pytest.mark.parametrize("n", [10**9, 1e300, 10**300])
@pytest.mark.parametrize("options", [{"method": "lsoda"}, {}])
def test_a_rate_with_a_power_of_endless_digits_is_refused_at_once_in_one_short_line(n, options):
    """The exponent 10**300 is rounded, and its power differed from that at fewer digits as rounding does."""
    x, v, F, power = sp.symbols("x v F n", real=True)
    block = ap.System.with_frictions({x: v, v: -(2**power) * x + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    with pytest.raises(OutOfRange, match=r"2\*\*n in v' = -2\*\*n\*x \+ F is not a finite real number") as refusal:
        ap.solve(ap.Scene(system=block, values={"n": n}, start=[1, 0], until=1), **options)
    assert len(str(refusal.value)) < 250


@pytest.mark.parametrize("law", [lambda n: 2 ** (2**n), lambda n: sp.sin(sp.exp(n))])
def test_an_exponent_or_an_angle_beyond_doubles_is_refused_before_its_digits_are_worked_out(law):
    x, v, F, n = sp.symbols("x v F n", real=True)
    block = ap.System.with_frictions({x: v, v: -law(n) * x + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    with pytest.raises(InputError, match=r"n = 1000000000 is refused; in v' = .* is beyond the range of doubles"):
        ap.Scene(system=block, values={"n": 10**9}, start=[1, 0], until=1)


def test_the_sine_of_an_angle_of_very_many_turns_is_right():
    """sin(e^200) = -0.82; on fewer digits than e^200 has, it was taken for 0."""
    x, v, F, n = sp.symbols("x v F n", real=True)
    block = ap.System.with_frictions({x: v, v: -sp.sin(sp.exp(n)) * x + F}, {}, [ap.Friction(v, F, load=1, kinetic=0)])
    path = ap.solve(ap.Scene(system=block, values={"n": 200}, start=[1, 0], until=1))
    assert path.final[0] == pytest.approx(np.cosh(np.sqrt(0.815597574752651)), rel=1e-9)


@pytest.mark.parametrize("method", ["rk45", "dop853", "radau", "bdf", "lsoda"])
@pytest.mark.few(1)
def test_a_try_of_a_step_beyond_where_rates_have_values_is_made_shorter(method):
    """y'/100 = x - y^(3/2) begins at y = 0, below which no rate is real."""
    x, y = sp.symbols("x y", real=True)
    scene = ap.Scene(system=ap.System.smooth({x: -x, y: 100 * (x - y ** sp.Rational(3, 2))}, {}, None),
                     values={}, start={x: 1, y: 0}, until=1)
    assert ap.solve(scene, method).final == pytest.approx([*map(float, ap.solve(scene, digits=15).final)], rel=1e-5)


@pytest.mark.parametrize("method", ["rk45", "dop853", "radau"])
def test_a_motion_that_ends_where_rates_have_values_is_followed_to_its_end(method):
    """x' = -2 sqrt(x) from 1: x = (1 - t)^2."""
    x = sp.Symbol("x", real=True)
    scene = ap.Scene(system=ap.System.smooth({x: -2 * sp.sqrt(x)}, {}, None), start=[1], until=2)
    with pytest.raises(Unfinished, match=r"left the range of floats at t = 1(\.00\d+)?;") as short:
        ap.solve(scene, method)
    assert short.value.path.final[0] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("options", [{}, {"method": "radau"}, {"digits": 15}])
@pytest.mark.parametrize(
    ("push", "law", "words"),
    [(0, lambda q, t: sp.sqrt(q - 1), r"t = 1\.7076.* kinetic = sqrt\(q - 1\) is no finite real number"),
     (0, lambda q, t: (q - 1) ** sp.Rational(1, 3), r"t = 1\.6515.* kinetic = \(q - 1\)\*\*\(1/3\) is no finite real"),
     (lambda q, t: sp.log(2 - t), None, r"t = 2\b.* log\(2 - t\) in v' = .* is no finite real number"),
     (0, lambda q, t: sp.sqrt(2 - t), r"kinetic = sqrt\(2 - t\) is not a finite real number at t = 2;")],
)
@pytest.mark.few(4)
def test_a_term_that_ceases_to_be_real_along_a_motion_is_named_with_the_time(options, push, law, words):
    """A run said that a rate or its slope is not real, at t = 0 where the slope of the term is infinite at its end."""
    q, v, F, t = sp.symbols("q v F t", real=True)
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=law(q, t) if law else 1)
    rates = {q: v, v: F - q + (push(q, t) if push else 0)}
    system = ap.System.with_frictions(slow=rates, fast={}, time=t, frictions=(contact,))
    with pytest.raises((Unfinished, OutOfRange), match=words):
        ap.solve(ap.Scene(system=system, start={q: 3, v: 0}, until=5), **options)


@pytest.mark.parametrize("method", here("heyoka"))
def test_a_step_that_leads_nowhere_is_not_made(method):
    scene = ap.Scene(sigma=1, mu="1e-300", start=("1e200", 0, 1), until=5)
    with pytest.raises(Unfinished, match="left the range of floats at t = 0;") as short:
        ap.solve(scene, method)
    assert short.value.path.final == (1e200, 0, 1)


def test_a_state_that_leaves_the_range_between_the_steps_of_a_run_is_refused():
    """Steps went past it, and those that end at the times asked for did not: an error of NumPy came out."""
    far = {"x": "-1e200", "y": "1/5", "z": -1}
    scene = replace(ap.systems.nonlinear_rod.scenes()[0], start=far)
    with pytest.raises(Unfinished, match="left the range of floats") as short:
        ap.solve(scene)
    with pytest.raises(TooLarge, match="before t = 1e-05"):
        short.value.path(1e-5)


def test_an_integrator_that_gives_up_says_why_and_warns_nobody():
    x = sp.Symbol("x", real=True)
    wall = sp.exp(600 * sp.tanh(10**8 * (x - sp.Rational(1, 2))))
    with pytest.raises(Unfinished, match=r"stalled \(repeated convergence failures\) at t = 0.5;"):
        ap.solve(ap.Scene(system=ap.System.smooth({x: 1 - wall}, {}, None), start=[0], until=3), "lsoda")


@pytest.mark.parametrize("method", ["rk45", "dop853", "bdf"])
def test_a_first_step_whose_size_cannot_be_chosen_warns_nobody(method):
    x, v = sp.symbols("x v", real=True)
    huge = ap.Scene(system=ap.System.smooth({x: v, v: -x}, {}, None), start=[1e200, 0], until=1)
    with suppress(Unfinished):
        ap.solve(huge, method)


def test_slopes_that_are_whole_numbers_of_any_size_are_numbers():
    x = sp.Symbol("x", real=True)
    steep = ap.Scene(system=ap.System.smooth({x: 10**20 - 10**20 * x}, {}, None), start=[0], until="1e-18")
    assert [ap.solve(steep, method).final for method in STIFF[:3]] == [pytest.approx((1,))] * 3


def _mirrored(force):
    """Two equal blocks on the ground, and between them a spring, which pulls as hard at both."""
    x, y, v, w, F, G = sp.symbols("x y v w F G", real=True)
    frictions = (ap.Friction(velocity=u, force=f, load=sp.S.One, kinetic=sp.S.Half) for u, f in ((v, F), (w, G)))
    pull = force(x - y)
    return ap.System.with_frictions({x: v, y: w, v: -pull + F, w: pull + G}, {}, tuple(frictions))


@pytest.mark.parametrize("force", [lambda d: d + d**3, sp.sin])
@pytest.mark.parametrize("options", [{}, {"method": "lsoda"}, {"method": "radau", "rtol": 1e-9}])
@pytest.mark.parametrize("start", [(1, -1, 0, 0), (2, -2, 0, 0), (0, 0, 3, -3)])
@pytest.mark.few(3)
def test_blocks_that_mirror_each_other_turn_and_stop_together(force, options, start):
    """Their velocities vanish at once, or an ulp apart."""
    path = ap.solve(ap.Scene(system=_mirrored(force), start=start, until=20), **options)
    assert {"slip_same+slip_opposite", "slip_opposite+slip_same", "stick+stick"}.issuperset(path.modes)
    assert path.final[0] == pytest.approx(-path.final[1], abs=1e-12)


def test_blocks_that_mirror_each_other_stop_together_in_many_digits():
    path = ap.solve(ap.Scene(system=_mirrored(sp.sin), start=(1, -1, 0, 0), until=6), digits=15)
    assert path.modes == ("slip_opposite+slip_same", "slip_same+slip_opposite", "stick+stick")
    assert abs(path.final[0] + path.final[1]) < 1e-14


def _under(load, push, fast, small=None):
    x, v, F = sp.symbols("x v F", real=True)
    return ap.System.with_frictions({x: 1, v: push + F}, fast, [ap.Friction(v, F, load=load, kinetic=1)], small=small)


def test_a_load_whose_slow_motion_touches_zero_where_it_changes_nothing_makes_no_error_grow():
    (x, y), mu = sp.symbols("x y", real=True), sp.Symbol("mu", positive=True)
    system = _under(y, -1, {y: (x - 1) ** 2 + 2 * mu * (x - 1) - y}, small=mu)
    path = ap.solve(ap.Scene(system=system, values={mu: "1/1000"}, start=[0, 5, 1], until=3))
    assert path.events[-1].t == pytest.approx(2.78161805, rel=1e-7)
    assert path.final == pytest.approx((3, 0, 4), abs=1e-7)


@pytest.mark.parametrize("form", [sp.factor, sp.expand])
@pytest.mark.parametrize("options", [{}, {"method": "radau"}, {"digits": 15}])
def test_a_load_that_is_an_even_power_is_never_lost(options, form):
    system = _under(form((sp.Symbol("x", real=True) - 1) ** 6), sp.Rational(1, 2000), {})
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until=3), **options)
    assert [e.kind for e in path.events] == ["slip_onset", "velocity_zero"]
    assert float(path.events[1].t) == pytest.approx(1.42028, rel=1e-4)


@pytest.mark.parametrize(("late", "order"), [(10, 4), (30, 6)])
@pytest.mark.parametrize("method", ["lsoda", "radau", "rk45"])
def test_a_margin_of_stick_that_only_touches_zero_holds_however_late_and_flat_the_touch_is(method, late, order):
    x, v, F, t = sp.symbols("x v F t", real=True)
    system = ap.System.with_frictions({x: v, v: F - 1 + (t / late - 1) ** order}, {}, [ap.Friction(v, F, 1, 1)], time=t)
    assert ap.solve(ap.Scene(system=system, start=[0, 0], until=2 * late - 1), method=method).modes == ("stick",)


def test_a_pull_that_vanishes_with_the_load_is_held_through_the_zero_though_no_state_is_larger_there():
    x = sp.Symbol("x", real=True)
    path = ap.solve(ap.Scene(system=_under(x, x / 2, {}), start=[-1, 0], until=9), method="radau")
    assert path.modes == ("stick", "stick")
    assert [(e.kind, e.t) for e in path.events] == [("force_zero", pytest.approx(1))]


def test_events_that_recur_at_one_time_are_said_to_be_rounding_and_not_to_be_too_many():
    # load p^2 and pull p s / 3 vanish together, and the error of the steps makes the block slip and stick by turns
    x, v, p, q, r, s, F = sp.symbols("x v p q r s F", real=True)
    rates = {x: v, v: F - s * p / 3, p: -q, q: p, r: -2 * s, s: 2 * r}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, [ap.Friction(v, F, p**2, 1)]), start=[0, 0, 1, 0, 1, 0],
                     until=20)
    with pytest.raises(Undecided, match="rounding hides whether there is a velocity_zero"):
        ap.solve(scene, method="lsoda")


@pytest.mark.parametrize(("how", "width"), [
    *(pytest.param({"method": one.values[0], "rtol": 1e-10}, "1/100", marks=one.marks)
      for one in here("lsoda", "radau", "dop853", "bdf", "cvode", "kvaerno5", "heyoka")),
    ({}, "1/100"), ({}, "1/100000"), ({"digits": 15}, "1/100000"),
])
@pytest.mark.parametrize(("push", "speed"), [(0, 3), (2, 0)])
def test_a_narrow_rise_of_friction_is_not_stepped_over_where_slip_ends_or_begins(how, width, push, speed):
    """The time from speed to speed is that of a quadrature; of the width 1/100 a stop came 1/100 late."""
    (x, v, F), width = sp.symbols("x v F", real=True), sp.Rational(width)
    law = (1 + sp.exp(-((v / width) ** 2))) / 2
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=law)
    system = ap.System.with_frictions({x: v, v: push + F}, {}, [contact])
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: speed}, until=3 if push else 7), **how)
    end, begun = (path.final[1], path.end) if push else (speed, path.events[0].t)
    slowness = sp.lambdify(v, 1 / abs(push - law), "mpmath")
    assert float(begun) == pytest.approx(float(mp.quad(slowness, [0, width, 9 * width, 1, end])), abs=1e-7)


def test_a_narrow_rise_of_friction_is_not_stepped_over_by_the_first_step_of_a_mode():
    """After the velocity has turned, a first step of DOP853 left the rise with an error of 1.7e-5."""
    x, v, F = sp.symbols("x v F", real=True)
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=(1 + sp.exp(-((300 * v) ** 2))) / 4)
    system = ap.System.with_frictions({x: v, v: F - 1 - 3 * x}, {}, [contact])
    scene = ap.Scene(system=system, start=[2, 1], until=2)
    found, expected = (ap.solve(scene, method=method, rtol=rtol, atol=rtol).final
                       for method, rtol in (("dop853", 1e-8), ("lsoda", 1e-11)))
    assert found == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("method", ["exact", "rk45", "dop853", "radau", *here("bdf", "heyoka", "cvode")])
def test_a_narrow_rise_of_the_load_in_the_middle_of_a_slip_takes_its_energy(method):
    """A block stops where friction has done the work v^2/2; steps over the rise let it slide on by 0.177."""
    x, v, F = sp.symbols("x v F", real=True)
    contact = ap.Friction(velocity=v, force=F, load=1 + 50 * sp.exp(-((500 * (x - 1)) ** 2)), kinetic=sp.Rational(1, 2))
    scene = ap.Scene(system=ap.System.with_frictions({x: v, v: F}, {}, [contact]), start=[0, 2], until=7)
    path = ap.solve(scene, method=method, **({} if method == "exact" else {"rtol": 1e-8}))
    assert path.final[0] == pytest.approx(4 - math.sqrt(math.pi) / 10, abs=2e-5)


@pytest.mark.parametrize("method", ["exact", "rk45", "bdf"])
def test_a_push_to_and_fro_within_a_short_time_moves_a_block_by_its_moment(method):
    """The push is 0 at its middle, at which steps end; the one after it passed over its second half."""
    x, v, t = sp.symbols("x v t", real=True)
    push = (t - 3) * sp.exp(-((1000 * (t - 3)) ** 2)) * 10**6
    system, how = ap.System.smooth({x: v, v: push}, {}, None, time=t), {} if method == "exact" else {"rtol": 1e-9}
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until=5), method=method, **how)
    assert path.final == pytest.approx([-math.sqrt(math.pi) / 2000, 0], abs=1e-6)


@pytest.mark.parametrize("method", ["exact", "rk45", "dop853", "radau", "lsoda", *here("heyoka", "cvode", "kvaerno5")])
@pytest.mark.parametrize(("push", "way"), [
    (lambda a: sp.exp(-((200 * sp.sin(a)) ** 2)), 3 * math.sqrt(math.pi) / 200),
    (lambda a: 1 / sp.cosh(500 * sp.cos(a)), 3 * math.pi / 500),
    (lambda a: sp.cos(a) ** 1000, 3 * math.sqrt(2 * math.pi / 1000)),
    (lambda a: 10 * sp.exp(-((100 * (a**2 - 16)) ** 2)), math.sqrt(math.pi) / 80),
])
@pytest.mark.few(8)
def test_what_turns_pushes_once_in_each_half_turn_for_however_short_a_while(push, way, method):
    """Steps grow as nothing else bounds them: all methods but DOP853 and heyoka passed over nearly every push."""
    turn, spin, x = sp.symbols("turn spin x", real=True)
    system = ap.System.smooth({turn: spin, spin: sp.S.Zero, x: spin * push(turn)}, {}, None)
    path = ap.solve(ap.Scene(system=system, start=["1/2", 1, 0], until=10), method=method)
    assert path.final[2] == pytest.approx(way, rel=2e-2)


@pytest.mark.parametrize("method", ["lsoda", *here("bdf", "cvode", "heyoka")])
@pytest.mark.parametrize(("push", "begins"), [
    (lambda t: 2 * sp.exp(-((200 * sp.sin(t - 1)) ** 2)), 1 - math.sqrt(math.log(20 / 3)) / 200),
    (lambda t: 2000 * (2 - t) * sp.exp(-((1000 * (t - 2)) ** 2)), 2 - 0.001 * float(mp.findroot(
        lambda u: 2 * u * mp.exp(-u * u) - 0.3, 1.7))),
])
@pytest.mark.few(4)
def test_a_block_is_moved_by_short_pushes_in_a_wave_of_the_time_and_by_one_that_is_odd_in_it(push, begins, method):
    """LSODA, BDF and CVODE passed over those in a wave; heyoka over the first half of the odd one."""
    x, v, F, t = sp.symbols("x v F t", real=True)
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(3, 10))
    system = ap.System.with_frictions({x: v, v: F + push(t)}, {}, [contact], time=t)
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until=3), method=method)
    assert path.events[0].t == pytest.approx(begins, abs=1e-6)


@pytest.mark.parametrize("method", ["exact", "rk45", "dop853", "radau", *here("bdf", "heyoka", "cvode", "kvaerno5")])
def test_a_block_on_a_belt_slips_where_its_load_dips_for_a_while_shorter_than_a_step(method):
    """Carried through the dip, it went on at rest on the belt."""
    x, v, F = sp.symbols("x v F", real=True)
    load, half = 1 - sp.exp(-((200 * x - 100) ** 2)) * sp.Rational(9, 10), sp.Rational(1, 2)
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v - 1, F, load, kinetic=1)])
    path = ap.solve(ap.Scene(system=system, start=[-half, 1], until=sp.Rational(5, 4)), method=method)
    assert path.modes[:2] == ("stick", "slip_opposite")
    slips = mp.findroot(sp.lambdify(x, load - x, "mpmath"), (0.49, 0.5), solver="anderson")
    assert path.events[0].t == pytest.approx(0.5 + float(slips), abs=1e-6)


@pytest.mark.parametrize(("method", "width", "spring", "rtol"), [
    pytest.param(one.values[0], *scene, marks=one.marks)
    for one in here("heyoka") for scene in [("1/20", 3, 1e-8), ("1/10", 1, 1e-8), ("1/5", 3, 1e-12)]
])
def test_no_step_ends_within_a_rise_of_friction_that_it_knows_nothing_of(method, width, spring, rtol):
    """Heyoka stopped 2.0e-4, 5.5e-5 and 5.5e-7 late: its series before the rise had not a trace of exp(-(v/w)**2)."""
    x, v, F = sp.symbols("x v F", real=True)
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=(1 + sp.exp(-((v / sp.Rational(width)) ** 2))) / 5)
    system = ap.System.with_frictions({x: v, v: F - spring * x}, {}, [contact])
    scene = ap.Scene(system=system, start=[0, 2], until=4)
    found, expected = (ap.solve(scene, **how).events for how in (
        {"method": method, "rtol": rtol}, {"method": "dop853", "rtol": 1e-13}))
    assert [event.t for event in found] == pytest.approx([event.t for event in expected], abs=max(rtol, 1e-10))


@pytest.mark.parametrize("method", here("heyoka"))
def test_a_function_of_a_number_is_a_number_in_a_compiled_field_too(method):
    """A rate with exp(-4/5) x was refused as one with a function that heyoka lacks."""
    x = sp.Symbol("x", real=True)
    rate = x * sp.exp(-sp.Rational(4, 5)) - x**2
    scene = ap.Scene(system=ap.System.smooth({x: rate}, {}, None), start=[1], until=1)
    assert ap.solve(scene, method=method).final == pytest.approx(ap.solve(scene).final, abs=1e-5)


@pytest.mark.further
@pytest.mark.parametrize("method", here("kvaerno5"))
def test_the_steps_of_all_modes_are_compiled_once_though_some_are_made_anew(method, monkeypatch):
    """They were compiled up to three times: numbers of Python, of NumPy and of JAX counted as of different types."""
    from asympk.integrators import diffrax_dirk

    diffrax_dirk._compiled.cache_clear()  # another test may have compiled these steps
    attempt, compiled = diffrax_dirk._attempt, []
    monkeypatch.setattr(diffrax_dirk, "_attempt", lambda *given: compiled.append(given) or attempt(*given))
    x, v, F = sp.symbols("x v F", real=True)
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=(1 + sp.exp(-((100 * v) ** 2))) / 2)
    system = ap.System.with_frictions({x: v, v: F}, {}, [contact])
    scene, again, retried = ap.Scene(system=system, start=[0, 3], until=7), diffrax_dirk.KvaernoSteps.again, []
    monkeypatch.setattr(diffrax_dirk.KvaernoSteps, "again", lambda steps: retried.append(steps) or again(steps))
    path = ap.solve(scene, method=method, rtol=1e-10)
    assert path.modes == ap.solve(scene, method="dop853").modes
    assert path(1).shape == (2,)
    assert retried
    assert len(compiled) == 1


@pytest.mark.parametrize("method", here("cvode"))
def test_a_block_at_rest_on_the_edge_of_stick_slips_where_rounding_moves_it_back_at_first(method):
    """The pull is the friction 3/10 at the start, and grows as t^2; after a first step of 10^-9, v was -10^-25."""
    x, y, v, u, F, a, b, c = sp.symbols("x y v u F a b c", real=True)
    rates = {x: v, y: u, v: F + a - b * x - c * (x - y), u: sp.Rational("2.4")}
    system = ap.System.with_frictions(rates, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational("0.3"))])
    values = {"a": "-4.784", "b": "7.8", "c": "5.8"}
    path = ap.solve(ap.Scene(system=system, values=values, start=["0.01", "0.9", 0, 0], until=1), method=method)
    assert path.modes == ("slip_same",)


@pytest.mark.parametrize("how", [{}, {"digits": 15}, *(
    pytest.param({"method": one.values[0]}, marks=one.marks) for one in here("dop853", "rk45", "radau", "cvode"))])
def test_a_block_that_flies_over_waves_touches_down_on_the_first_that_is_high_enough(how):
    """Steps of the flight, whose rates are constant, were as long as some waves, and the block went through two."""
    x, y, v, u, F = sp.symbols("x y v u F", real=True)
    ground = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half, gap=y - sp.cos(10 * x) / 10)
    system = ap.System.with_frictions({x: v, y: u, v: F, u: -sp.Rational(1, 20)}, {}, [ground])
    path = ap.solve(ap.Scene(system=system, start=["0.7", "0.13", "2.5", 0], until=3), **how)
    expected = mp.findroot(lambda t: 0.13 - t**2 / 40 - mp.cos(7 + 25 * t) / 10, (1.21, 1.22), solver="anderson")
    assert float(path.events[0].t) == pytest.approx(float(expected), abs=1e-5)


@pytest.mark.parametrize("method", here("dop853", "rk45", "lsoda", "cvode"))
def test_a_block_slips_at_each_of_many_short_pushes_by_what_moves_past_it(method):
    """Nothing else bounds the steps, as the rates are constant: LSODA passed over 14 of the 19, the others over one."""
    x, y, v, F = sp.symbols("x y v F", real=True)
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half, static=1)
    push = sp.Rational("1.01") * sp.cos(30 * y)
    system = ap.System.with_frictions({x: v, y: sp.S(2), v: F + push}, {}, [contact])
    path = ap.solve(ap.Scene(system=system, start=[0, "1.37", 0], until=1), method=method)
    expected = [(k * math.pi - math.acos(1 / 1.01) - 41.1) / 60 for k in range(14, 33)]
    assert [event.t for event in path.events if event.kind == "slip_onset"] == pytest.approx(expected, abs=1e-5)


def test_a_slip_late_in_a_run_begins_and_ends_as_one_at_once():
    """The slope of a step at an event, taken between two rounded times, missed the rates there at t = 1e6."""
    (x, v, F, t), events = sp.symbols("x v F t", real=True), []
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2))
    for begin in (0, 10**6):
        push = sp.Piecewise((0, t < begin), (2 * sp.sin(3 * (t - begin)), True))
        system = ap.System.with_frictions({x: v, v: push + F}, {}, [contact], time=t)
        scene = ap.Scene(system=system, start={x: 0, v: 0}, until=begin + 2)
        path = ap.solve(scene, method="dop853", rtol=1e-12, steps=1000)
        events.append([event.t - begin for event in path.events])
    assert len(events[0]) == 2
    assert events[1] == pytest.approx(events[0], abs=1e-8)


@pytest.mark.parametrize("method", here("cvode", "kvaerno5", "heyoka", "lsoda"))
def test_pulses_at_even_intervals_each_move_a_block_that_rests_between_them(method):
    """CVODE, Kvaerno5 and heyoka took one step over all pulses after the first."""
    x, v, F, t = sp.symbols("x v F t", real=True)
    system = ap.System.with_frictions({x: v, v: 2 * sp.cos(t) ** 400 + F}, {}, [ap.Friction(v, F, 1, 1)], time=t)
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until=40), method=method, rtol=1e-8)
    begun = [event.t for event in path.events if event.kind == "slip_onset"]
    assert begun == pytest.approx([math.pi * k - math.acos(2 ** (-1 / 400)) for k in range(1, 13)])


@pytest.mark.parametrize("method", ["lsoda", *here("heyoka")])
def test_a_block_that_nothing_moves_and_no_guard_watches_rests_under_a_push_that_is_a_parameter(method):
    """Rates and guards without parameters were none to heyoka, which took no values for them."""
    x, v, F, G, p = sp.symbols("x v F G p", real=True)
    jaws = [ap.Friction(velocity=v, force=force, load=1, kinetic=sp.Rational(1, 2)) for force in (F, G)]
    block = ap.System.with_frictions({x: v, v: F + G - p}, {}, jaws)
    path = ap.solve(ap.Scene(system=block, values={p: "1/2"}, start={x: 1, v: 0}, until=1), method)
    assert (path.final, path.modes) == ((1, 0), ("stick+stick",))


@pytest.mark.parametrize("small", ["1e-7", "1/1000000", "7.076e-7"])
def test_steps_after_an_event_on_a_slow_manifold_do_not_stay_as_short_as_a_layer(small):
    """LSODA kept to explicit steps of order 1, and the run ended after 100 000 of them."""
    x, v, q, u, F, G = sp.symbols("x v q u F G", real=True)
    mu, r = sp.Symbol("mu", positive=True), sp.Rational
    jaws = [ap.Friction(v, F, r(13, 10), kinetic=r(3, 5)), ap.Friction(q - 1, G, r(9, 4), kinetic=r(9, 10))]
    slow = {x: v, v: F - r(19, 5) * u - r(9, 10) * x, q: G + r(7, 4) * u + 4 * v}
    driven = ap.System.with_frictions(slow, {u: -r(11, 4) * u - r(7, 5) * sp.cos(q)}, jaws, small=mu)
    start = {x: "-1.7", v: "-0.9", q: "-1.2", u: "-0.4"}
    scene = ap.Scene(system=driven, values={mu: small}, start=start, until=2)
    path = ap.solve(scene)
    assert path.final == pytest.approx(ap.solve(scene, method="radau", rtol=1e-9, atol=1e-9).final, abs=1e-7)
    assert path.info["work"]["steps"] < 2000
