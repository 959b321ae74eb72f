"""The explorer: what is turned is what is followed, strangers and nonsense are refused, and the page moves."""

import json
import math
import os
import re
import signal
import subprocess
import time
import warnings
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import replace
from http.client import HTTPConnection
from pathlib import Path
from socket import SHUT_WR, create_connection
from threading import Thread

import numpy as np
import pytest
import sympy as sp
from blocks import spring_block
from browser import PRESENT, browser
from interrupt import hearing
from mechanisms import FALLING_BALL, SLENDER_ROD

import asympk as ap
from asympk.errors import InputError, TooManyEvents, UnknownName
from asympk.explore import questions
from asympk.explore.choice import chosen_scenes
from asympk.explore.knobs import knobs_of
from asympk.explore.motion import motion
from asympk.explore.server import LARGEST, Server
from asympk.explore.surroundings import surroundings
from asympk.explore.worker import Broken, TimedOut, Worker
from asympk.scenes.scenefile import changed_scene
from asympk.scenes.turned import turned

ROD = ap.read_scene("backward")
START = 120  # seconds that a process may take to start, also on a busy machine
BLOCK = "until = 8\n" + spring_block("k / (1 + (v - 1)^2)", "v - 1") + """static = 1
[values]
k = 0.8
[start]
x = 0
v = 1
"""
PUSHED = """until = 20
[system]
time = "t"
[system.slow]
c = "0"
x = "v"
v = "a*cos(7*t/10) - x + F"
[[system.frictions]]
velocity = "v"
force = "F"
load = 1
kinetic = "3/10"
[values]
a = 1.5
[start]
x = 0
v = 0
c = 0.3
"""
MECHANISM = f"""{SLENDER_ROD}[values]
m = 1
l = 1
g = 10
f = 2
[state]
X = 0
Y = 0.7833269
theta = 0.9
"X'" = -2
"Y'" = 0
"theta'" = 0
"""


# ---- what is turned -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", chosen_scenes(None)(), ids=lambda scene: scene.name)
def test_a_scene_of_which_nothing_is_turned_is_the_scene_itself(scene):
    assert turned(scene, {}, {}, None) == scene


def test_what_is_turned_is_what_is_followed():
    scene = turned(ROD, {"sigma": "1/2", "mu": 1e-3}, {"z": "-0.5"}, 2)
    assert scene == ap.Scene(sigma="1/2", mu=1e-3, start=(0, "0.2", "-0.5"), until=2, name="backward")
    path, found = ap.solve(scene), motion(scene)
    assert found["final"][:3] == [*path.final]
    assert [mode["name"] for mode in found["modes"]] == [*path.modes]
    assert [event["t"] for event in found["events"]] == [event.t for event in path.events]


@pytest.mark.slow
def test_states_that_depend_on_others_follow_a_change_of_these():
    (scene,) = chosen_scenes("arm")()
    moved = turned(scene, {}, {"b'": "0.2"}, None)
    at = dict(zip(moved.names, map(float, moved.start), strict=True))
    assert at["z"] == pytest.approx(at["a'"] * math.cos(at["a"]) + 0.2 * math.cos(at["b"]), rel=1e-14)
    assert ap.solve(moved).modes
    with pytest.raises(InputError, match="start: z is not a"):
        ap.solve(turned(scene, {}, {"z": 1}, None))


@pytest.mark.further
def test_a_drag_moves_no_state_that_depends_on_others():
    scenes = chosen_scenes("arm")()
    z = float(scenes[0].start[-1])
    found = json.loads(questions.QUESTIONS["motion"](scenes, {"start": {"x": 1.25, "z": z + 1}}))
    assert (found["states"]["x"][0], found["states"]["z"][0]) == (1.25, pytest.approx(z, rel=1e-14))


def test_an_unknown_key_of_a_question_is_refused_with_the_nearest():
    with pytest.raises(InputError, match="question: key 'strat' is unknown; the nearest known one is 'start'"):
        questions.QUESTIONS["motion"]((), {"strat": {}})


def test_static_friction_follows_the_kinetic_one_until_it_is_turned_itself():
    assert turned(ROD, {"sigma": 3}, {}, None).sigma0 == 3
    assert turned(ROD, {"sigma": 3, "sigma0": 4}, {}, None).sigma0 == 4
    with pytest.raises(InputError):
        turned(ROD, {"sigma": 3, "sigma0": 2}, {}, None)
    followed = {scene: knobs_of(scene)["parameters"][2]["follows"] for scene in (ROD, ap.read_scene("static"))}
    assert [*followed.values()] == ["sigma", None]  # in the second they differ from the outset


def test_a_physical_rod_is_turned_and_drawn_in_its_own_units():
    chalk = ap.read_scene("chalk")
    told = knobs_of(chalk)
    assert [knob["name"] for knob in told["parameters"]] == ["m", "P", "f", "f0", "alpha", "l", "k", "h"]
    assert told["quantities"] == ["R_1", "dR_1", "u", "R"]
    assert [knob["unit"] for knob in (*told["start"], told["until"])] == ["N", "N/s", "m/s", "s"]
    found = motion(turned(chalk, {"alpha": 65}, {"u": "-0.01"}, None))
    given = {"m": "0.01", "P": 1, "f": "1.5", "f0": "1.8", "alpha": "65 deg", "l": "0.08", "k": 50000, "h": "0.05"}
    own = ap.solve(ap.Scene.physical(**given, start=(0, 0, "-0.01"), until="0.05")).physical()
    assert found["final"][:3] == pytest.approx([*map(float, own.final)], rel=1e-12)


def test_the_knob_of_a_friction_ends_at_0_and_that_of_a_force_does_not():
    x, v, F, k, P = sp.symbols("x v F k P", real=True)
    block = ap.System.with_frictions({x: v, v: P - x + F}, {}, [ap.Friction(v, F, 1, k / 2)],
                                       assumptions=P > -1)  # which holds at some negative ones
    scene = ap.Scene(system=block, values={k: 1, P: 1}, start={x: 0, v: 1}, until=1)
    assert {knob["name"]: knob["low"] for knob in knobs_of(scene)["parameters"]} == {"k": 0, "P": -2}


def test_an_angle_is_turned_in_the_spelling_of_files_too():
    chalk = ap.read_scene("chalk")
    assert len({turned(chalk, {"alpha": angle}, {}, None) for angle in (75, "75", "75 deg", " 75deg ")}) == 1
    for wrong in ("75 deg deg", "deg", "90 deg", "1 rad"):
        with pytest.raises(InputError, match="alpha = "):
            turned(chalk, {"alpha": wrong}, {}, None)
    given = {"m": 1, "P": 1, "f": 1, "l": 1, "k": 1, "h": 1, "start": (0, 0, -1), "until": 1}
    assert turned(ap.Scene.physical(**given, alpha=1), {"alpha": "75 deg"}, {}, None) \
        == ap.Scene.physical(**given, alpha="75 deg")


@pytest.mark.parametrize("given", [
    {"sigma": "-1.95", "mu": 1e307, "start": (1e307, 0, -1), "until": 1e-308}, {"sigma": -1.9999999, "sigma0": 1e307},
    {"alpha": "89.5 deg", "k": 1e300}, {"alpha": "1/2 deg"},
])
def test_a_knob_holds_the_number_that_it_starts_from_and_is_finite(given):
    """The angle 89.5 deg and sigma = -1.95 were beyond the ends, and a number of 1e307 left the page without knobs."""
    rod = {"m": 1, "P": 1, "f": 3, "l": 1, "k": 1, "h": 1, "start": (0, 0, -1), "until": 1}
    plain = {"sigma": 1, "mu": 1, "start": (0, 0, -1), "until": 1}
    scene = ap.Scene.physical(**{**rod, **given}) if "alpha" in given else ap.Scene(**{**plain, **given})
    told = json.loads(questions.as_json(knobs_of(scene)))
    for knob in (*told["parameters"], *told["start"], told["until"]):
        assert knob["low"] <= knob["value"] <= knob["high"]
        assert knob["name"] != "sigma" or knob["low"] > -2


def test_a_start_beside_a_slow_line_stays_beside_it_while_parameters_turn():
    near = ap.Scene.near("Pi2", sigma=1, mu="1e-3", x=0, offset="1e-300", z=1, until=2)
    assert turned(near, {"sigma": 2}, {}, None).near_to == near.near_to
    assert turned(near, {}, {"x": "0.1"}, None).near_to is None


def test_a_velocity_that_is_turned_leaves_a_start_beside_its_slow_line_as_far_as_it_is_in_the_mode_of_the_line():
    near = ap.Scene.near("Pi2", sigma=1, mu="1e-3", x=0, offset="1e-300", z=1, until=2)
    assert turned(near, {}, {"z": 1}, None) == turned(near, {}, {"x": 0}, None) == near
    half = turned(near, {}, {"z": "1/2"}, None)
    assert half.near_to == near.near_to
    event = ap.solve(half).events[0]  # on the slow line until it stops
    assert (event.kind, event.t) == ("velocity_zero", pytest.approx(0.5008, rel=1e-3))
    other = turned(near, {}, {"z": -1}, None)
    assert (other.near_to, other.start[2]) == (None, -1)
    assert turned(near, {}, {"y": near.start[1]}, None).near_to is None


@pytest.mark.parametrize(("given", "start"), [
    ({"eps": "1/20", "m": 2}, {}), ({}, {"Y": 2}), ({"eps": "1/20"}, {"Y": "1/2", "X": 3}),
])
def test_a_ground_stays_where_it_is_while_numbers_of_a_start_off_the_contact_turn(tmp_path, given, start):
    file = tmp_path / "ball.toml"
    file.write_text(FALLING_BALL)
    scene = ap.read_scene(file)
    found = turned(scene, given, start, None)
    again, left = changed_scene(str(file), {**given, **start})
    assert (found, left) == (again, {})
    assert turned(turned(scene, given, {}, None), {}, start, None) == again
    assert ap.solve(found).events[0].kind == "touch_down"
    assert turned(scene, given, {**start, "z": 2}, None).start == (*again.start[:-1], 2)
    assert turned(turned(scene, {}, {"x": -50}, None), given, start, None).start[2] == -50


@pytest.mark.parametrize(("text", "quantities"), [(BLOCK, ["x", "v"]), (MECHANISM, ["X", "Y", "theta", "x"])])
def test_files_of_ones_own_are_explored_too(tmp_path, text, quantities):
    file = tmp_path / "own.toml"
    file.write_text(text)
    scene = chosen_scenes(str(file))()[0]
    assert knobs_of(scene)["quantities"][: len(quantities)] == quantities
    assert motion(turned(scene, {}, {}, "1/2"))["t"][-1] == 0.5


@pytest.mark.parametrize(("rate", "names"), [(0, ["elastic contact", "rigid"]), (-1, ["rigid"])])
def test_a_body_that_comes_down_within_the_reach_of_its_damper_has_the_rigid_contact_alone(tmp_path, rate, names):
    file = tmp_path / "own.toml"
    file.write_text(MECHANISM.replace("0.7833269", "0.8").replace("\"Y'\" = 0", f"\"Y'\" = {rate}"))
    assert [scene.name for scene in chosen_scenes(str(file))()] == names


def test_a_mechanism_that_can_be_followed_with_no_contact_is_refused(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(MECHANISM.replace("theta = 0.9\n", ""))
    with pytest.raises(InputError, match="no value for theta"):
        chosen_scenes(str(file))()


def test_the_compliance_leaves_its_name_to_a_parameter_of_a_further_contact(tmp_path):
    file, wall = tmp_path / "own.toml", "others = [{gap = '-X', slip = 'Y', friction = 'c', unilateral = true}]\n"
    file.write_text(wall + MECHANISM.replace("f = 2", "f = 2\nc = 1"))
    elastic, rigid = chosen_scenes(str(file))()
    assert {"c", "c_"} <= {*map(str, elastic.system.parameters)}
    assert elastic.system.small.name == "c_"
    assert "c_" not in map(str, rigid.system.parameters)


@pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="a pipe has no name")
@pytest.mark.parametrize(("text", "names"), [(BLOCK, 1), (MECHANISM, 2)])
def test_a_scene_is_explored_from_a_pipe(text, names):
    end, other = os.pipe()
    os.write(other, text.encode())
    os.close(other)
    try:
        assert len(chosen_scenes(f"/dev/fd/{end}")()) == names
    finally:
        os.close(end)


def test_a_motion_that_stops_shows_what_was_followed_and_says_why(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(MECHANISM)
    rigid = chosen_scenes(str(file))()[1]
    scene = turned(rigid, {"f": 1}, {"Y": "0.9"}, 3)
    with pytest.raises(ap.AsympkError) as stopped:
        ap.solve(scene)
    found = motion(scene)
    assert found["stopped"] == f"{type(stopped.value).__name__}: {stopped.value}"
    assert found["t"][-1] == pytest.approx(stopped.value.t)


def test_a_motion_that_takes_too_long_is_shown_as_far_as_it_was_followed(monkeypatch):
    monkeypatch.setattr("asympk.explore.motion.LONGEST", 1e-9)
    found = motion(ap.systems.nonlinear_rod.scenes()[0])
    assert "time limit reached" in found["stopped"]
    assert found["t"][0] == 0


def test_a_motion_that_is_affine_on_each_side_of_a_switch_is_followed_in_closed_form():
    x, v = sp.symbols("x v", real=True)
    scene = ap.Scene(system=ap.System.with_frictions({x: v, v: -x - sp.sign(v) / 10}, {}, []), start=(1, 0), until=3)
    assert motion(scene)["model"] == "exact"


@pytest.mark.parametrize("name", ["backward", "chalk"])
def test_a_motion_of_too_many_events_is_shown_up_to_the_last(monkeypatch, name):
    scene = ap.read_scene(name)
    whole = ap.solve(scene)
    monkeypatch.setattr("asympk.systems.painleve_klein.flow.segments.MOST_EVENTS", 1)
    with pytest.raises(TooManyEvents) as stopped:
        ap.solve(scene)
    assert (stopped.value.t, *stopped.value.state) == pytest.approx((whole.events[1].t, *whole.events[1].state))
    found, own = motion(scene), whole.physical() if scene.rod else whole
    assert found["stopped"].startswith("TooManyEvents: more than 1 events by t = ")
    assert (len(found["events"]), found["t"][-1]) == (1, pytest.approx(own.events[1].t))
    assert found["final"][:3] == pytest.approx([*own.events[1].state], abs=1e-9)


@pytest.mark.further
def test_a_motion_whose_events_accumulate_is_shown_up_to_the_last_that_was_found():
    x, v, F, G = sp.symbols("x v F G", real=True)
    frictions = [ap.Friction(velocity=s, force=f, load=1, kinetic=k) for s, f, k in ((x, F, 3), (v, G, 1))]
    twisting = ap.System.with_frictions({x: v, v: F + G}, {}, frictions)
    found = motion(ap.Scene(system=twisting, start={"x": 1, "v": 0}, until=60))
    assert found["stopped"].startswith("Accumulation: events accumulate at t = 5.1213203")
    assert found["t"][-1] == pytest.approx(1.5 / (1 - math.sqrt(0.5)), abs=1e-6)
    assert len(found["events"]) > 20


def test_why_a_physical_rod_stops_is_not_taken_for_its_own_units(monkeypatch):
    def solve(scene, *options, **more):
        raise TooManyEvents("more than 1000 events by t = 2e11")

    monkeypatch.setattr("asympk.explore.motion.solve", solve)
    said = {name: motion(ap.read_scene(name))["stopped"] for name in ("backward", "chalk")}
    assert said["chalk"] == said["backward"] + " (these numbers are nondimensional)"


def test_a_file_of_no_scene_is_refused_before_there_is_a_page(tmp_path):
    (tmp_path / "empty.toml").write_text("")
    with pytest.raises(InputError, match=r"empty.toml: sigma, mu, start, until missing"):
        chosen_scenes(str(tmp_path / "empty.toml"))


def test_the_file_of_a_mechanism_with_a_horizon_is_explored_as_the_scene_that_it_is(tmp_path):
    file = tmp_path / "ball.toml"
    file.write_text(FALLING_BALL)
    assert chosen_scenes(str(file))() == (ap.read_scene(file),)


@pytest.mark.parametrize(("scene", "model"), [
    (ROD, "exact"), (ap.systems.nonlinear_rod.scenes()[0], "lsoda"),
])
def test_a_draft_is_in_closed_form_where_there_is_one(scene, model):
    assert motion(turned(scene, {}, {}, "1/10"), draft=True)["model"] == model


def test_what_is_no_draft_is_followed_as_closely_as_the_scene_is_by_itself(tmp_path):
    (tmp_path / "block.toml").write_text(BLOCK)
    scene = turned(ap.read_scene(tmp_path / "block.toml"), {}, {}, 1)
    assert motion(scene)["final"] == [*ap.solve(scene).final]


def test_the_line_through_the_samples_is_the_motion_to_the_eye():
    """Over thirty periods the line was off by 3 % of the height of the picture."""
    x, v = sp.symbols("x v", real=True)
    swinging = ap.Scene(system=ap.System.smooth({x: v, v: -x}, {}, None), start={x: 1, v: 0}, until=200)
    found, dense = motion(swinging), np.linspace(0, 200, 20001)
    assert np.interp(dense, found["t"], found["states"]["x"]) == pytest.approx(np.cos(dense), abs=0.006)
    assert len(found["t"]) > 2 * len(motion(replace(swinging, until=2))["t"])  # where few suffice, few are sent


def test_an_unknown_scene_is_refused_with_the_nearest():
    with pytest.raises(UnknownName, match="'backward'"):
        chosen_scenes("bakward")


# ---- what stands around ---------------------------------------------------------------------------------------------


def test_the_slow_planes_and_the_stick_regions_are_drawn_where_the_paper_has_them():
    places = [k / 50 - 2.003 for k in range(201)]  # no edge of a region among them
    curves = surroundings(ROD, ["s", "z"], places, places)
    assert not any(c["begun"] for c in curves)
    planes = {(c["name"], c["kind"]): c["points"] for c in curves if c["kind"] != "stick"}
    assert set(planes) == {("Pi1", "stable"), ("Pi2", "unstable")}
    assert {round(s, 12) for s, z in planes["Pi1", "stable"]} == {0.2}
    assert {round(s, 12) for s, z in planes["Pi2", "unstable"]} == {-1}
    assert all(z > 0 for points in planes.values() for s, z in points)
    regions = ap.stick_regions(ap.systems.painleve_klein.system())
    drawn = {round(s, 12) for c in curves if c["kind"] == "stick" for s, z in c["points"]}
    assert drawn == {round(s, 12) for s in places if regions.stick.contains(s, sigma=1, sigma0=1)}


@pytest.mark.parametrize("sigma", [0, 1e-320])
def test_without_friction_the_one_slow_plane_that_is_left_is_drawn(sigma):
    """At sigma = 0 the quotient by it was an error in place of all curves."""
    places = [k / 10 for k in range(-20, 21)]
    with warnings.catch_warnings(action="error"):  # a warning would stand in the terminal of the server
        curves = surroundings(turned(ROD, {"sigma": sigma, "mu": "1e-3"}, {}, None), ["s", "z"], places, places)
    assert {(curve["name"], s) for curve in curves if curve["kind"] != "stick" for s, z in curve["points"]} \
        == {("Pi1", 0.25)}


@pytest.mark.parametrize("pair", [("x", "y"), ("y", "x"), ("x", "s"), ("s", "x"), ("y", "s"), ("s", "y")])
def test_a_slow_plane_lies_at_its_load_in_a_picture_over_the_reaction(pair):
    places = [k / 10 for k in range(-10, 11)]
    curves = surroundings(turned(ROD, {}, {"z": 1}, None), pair, places, places)
    assert {curve["name"] for curve in curves} == {"Pi1", "Pi2"}
    assert all(curve["begun"] for curve in curves)  # there is none where z, which is not in the picture, is negative
    for curve in curves:
        points = [dict(zip(pair, point, strict=True)) for point in curve["points"]]
        load = {"Pi1": 1 / 5, "Pi2": -1.0}[curve["name"]]  # 1/(sigma + 4) and -1/sigma
        assert {round(at["s"] if "s" in at else at["x"] + at["y"], 12) for at in points} == {load}
        ends = [min(column) <= -1 and max(column) >= 1 for column in zip(*curve["points"], strict=True)]
        assert any(ends)  # from one side of the picture to the other


def test_a_physical_rod_has_its_slow_planes_in_newtons():
    chalk = ap.read_scene("chalk")
    places = [k / 20 - 1 for k in range(41)]
    (plane,) = (c for c in surroundings(chalk, ["R", "u"], places, places) if c["name"] == "Pi1")
    sigma, unit = float(chalk.sigma), float(chalk.rod.units.reaction)
    assert {round(R, 9) for R, u in plane["points"]} == {round(unit / (sigma + 4), 9)}


def test_a_cubic_manifold_is_drawn_over_its_fast_state_with_its_folds_as_ends():
    x, y, mu = sp.symbols("x y mu", real=True)
    system = ap.System.smooth({x: -y}, {y: x + y - y**3 / 3}, mu)
    scene = ap.Scene(system=system, values={"mu": "1/100"}, start={"x": 1, "y": 2}, until=1)
    places = [k / 10 - 2.05 for k in range(41)]
    curves = surroundings(scene, ["x", "y"], places, places)
    assert [curve["kind"] for curve in curves] == ["stable", "unstable", "stable"]
    points = [point for curve in curves for point in curve["points"]]
    assert [v for u, v in points] == pytest.approx(places)
    assert [u for u, v in points] == pytest.approx([v**3 / 3 - v for v in places])


def test_a_slow_manifold_is_drawn_where_it_has_a_height_alone():
    x, y, mu = sp.symbols("x y mu", real=True)
    system = ap.System.smooth({x: 1}, {y: sp.log(x) - y}, mu)
    scene = ap.Scene(system=system, values={"mu": "1/100"}, start={"x": 1, "y": 0}, until=1)
    (curve,) = surroundings(scene, ["x", "y"], [-1, 0, 1, 2], [-1, 1])
    assert curve["points"] == [[1, 0], [2, math.log(2)]]


def test_a_slow_manifold_is_drawn_whose_function_numpy_lacks():
    """A refusal of the target 'numpy' stood in place of the curves."""
    x, y, mu = sp.symbols("x y mu", real=True)
    system = ap.System.smooth({x: -y}, {y: sp.gamma(x + 2) - y}, mu)
    scene = ap.Scene(system=system, values={"mu": "1/100"}, start={"x": 1, "y": 0}, until=1)
    (curve,) = surroundings(scene, ["x", "y"], [0, 1, 2], [-1, 1])
    assert curve["points"] == [[0, 1], [1, 2], [2, 6]]


def test_a_slow_manifold_is_drawn_where_the_load_contains_its_own_force():
    """An argument F of the condition of its mode was said to be missing."""
    x, y, v, force = sp.symbols("x y v F", real=True)
    contact = ap.Friction(velocity=v, force=force, load=x + y + force / 8, kinetic=sp.S.Half)
    rates = {x: y, v: 1 - x - y + force}
    system = ap.System.with_frictions(rates, {y: 1 - 2 * (x + y) + force}, [contact], sp.Symbol("mu", positive=True))
    scene = ap.Scene(system=system, values={"mu": "1/100"}, start={"x": 0, "y": 0, "v": 1}, until=1)
    (curve,) = surroundings(scene, ["x", "y"], [-1, 0, 1], [-1, 1])
    assert curve["points"] == [[u, pytest.approx(17 / 42 - u)] for u in (-1, 0, 1)]


@pytest.mark.parametrize("velocity_first", [False, True])
def test_the_part_that_sticks_lies_on_the_switching_surface_whatever_the_order_of_the_states(velocity_first):
    """With the velocity first the surface was drawn where a velocity linear in the position would vanish."""
    x, v, force = sp.symbols("x v F", real=True)
    rough = ap.Friction(velocity=v - x**2, force=force, load=1, kinetic=sp.S.Half)
    rates = {x: v, v: force - x}
    system = ap.System.with_frictions({s: rates[s] for s in ((v, x) if velocity_first else (x, v))}, {}, [rough])
    scene = ap.Scene(system=system, start={"x": 0.3, "v": 1}, until=3)
    places = [k / 100 for k in range(-100, 101)]
    (curve,) = surroundings(scene, ["x", "v"], places, places)
    assert [v for x, v in curve["points"]] == pytest.approx([x**2 for x, v in curve["points"]])
    assert [x for x, v in curve["points"]] == pytest.approx([k for k in places if abs(2 * k**3 + k) <= 0.5])


def test_around_a_rigid_contact_stands_nothing():
    """What each mode rests on is not known, and a refusal stood in place of why the motion ends."""
    rigid = ap.systems.painleve_rod.scenes()[-1]
    assert rigid.system.friction.constraint is not None
    assert surroundings(rigid, knobs_of(rigid)["pair"], [0, 1], [0, 1]) == []


def test_around_a_single_state_stands_nothing():
    x = ap.systems.painleve_klein.x
    scene = ap.Scene(system=ap.System.smooth({x: -x}, {}, None), values={}, start={"x": 1}, until=1)
    assert surroundings(scene, knobs_of(scene)["pair"], [0, 1], [0, 1]) == []


# ---- the process that answers ---------------------------------------------------------------------------------------


def _slow_answer(given, question):
    time.sleep(question)
    return given


def _wrong_answer(given, question):
    raise question


def _known(given):
    future = Future()
    future.set_result(given)
    return future


@pytest.mark.further
def test_an_answer_that_takes_too_long_is_ended_and_the_next_question_is_answered():
    worker = Worker(_slow_answer, _known("given"), seconds=START)
    try:
        assert worker.ask(0) == "given"
        worker._seconds = 0.2
        with pytest.raises(TimedOut, match="ended"):
            worker.ask(60)
        worker._seconds = START
        assert worker.ask(0) == "given"
    finally:
        worker.close()


@pytest.mark.further
def test_a_question_that_nobody_waits_for_any_more_is_dropped_and_the_next_one_is_answered(monkeypatch):
    monkeypatch.setattr("asympk.explore.worker.PATIENCE", 0.1)
    worker = Worker(_slow_answer, _known("given"), seconds=START)
    try:
        assert worker.ask(0) == "given"
        began, turns = time.monotonic(), iter((True, False))
        with pytest.raises(TimedOut, match="nobody waits"):
            worker.ask(START, lambda: next(turns))
        assert time.monotonic() - began < START / 4
        assert worker.ask(0) == "given"
    finally:
        worker.close()


@pytest.mark.further
def test_an_error_of_the_process_comes_back_as_one_line():
    worker = Worker(_wrong_answer, _known(None), seconds=START)
    try:
        with pytest.raises(InputError, match="x = 1"):
            worker.ask(InputError("x = 1"))
        with pytest.raises(Broken, match="ZeroDivisionError: by zero"):
            worker.ask(ZeroDivisionError("by zero"))
    finally:
        worker.close()


# ---- the server -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    file, ball, pushed = (tmp_path_factory.mktemp("own") / name for name in ("block.toml", "ball.toml", "pushed.toml"))
    file.write_text(BLOCK)
    ball.write_text(FALLING_BALL)
    pushed.write_text(PUSHED)
    with Server() as running:
        Thread(target=running.serve_forever, daemon=True).start()
        running.show(lambda: (ROD, *chosen_scenes(str(file))(), ap.read_scene(ball), ap.read_scene(pushed)))
        yield running
        running.shutdown()


def _reply(server, method, name, body=None, host=None, token=None, **headers):
    connection = HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    path = f"/{server.token if token is None else token}/{name}"
    sent = {"Host": host or f"127.0.0.1:{server.server_port}", **headers}
    connection.request(method, path, body, sent)
    reply = connection.getresponse()
    text = reply.read().decode()
    connection.close()
    assert "Traceback" not in text
    return reply.status, text


def _refused(server, status, *arguments, **options):
    found, text = _reply(server, *arguments, **options)
    assert found == status
    line = json.loads(text)["error"]
    assert line
    assert "\n" not in line
    return line


def test_the_server_listens_on_this_machine_alone(server):
    assert server.server_address[0] == "127.0.0.1"


def test_many_tabs_may_load_at_once():
    with Server() as waiting, ExitStack() as tabs:
        for _ in range(40):
            tabs.enter_context(create_connection(("127.0.0.1", waiting.server_port), timeout=0.9))


@pytest.mark.parametrize("token", ["", "wrong", "é", "x" * 3000, ".."])
def test_without_the_token_nothing_is_answered(server, token):
    token = token.encode("latin-1").decode("latin-1").replace("é", "%C3%A9")
    _refused(server, 403, "GET", "", token=token)
    _refused(server, 403, "POST", "motion", b"{}", token=token)


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "evil.example:80@127.0.0.1"])
def test_a_page_of_another_name_that_points_here_is_refused(server, host):
    _refused(server, 421, "GET", "", host=host)


@pytest.mark.parametrize("name", ["no", "page/index.html", "../../etc/passwd", "..%2f..%2fpyproject.toml", "explore.py",
                                  "motion/", "?"])
def test_nothing_but_the_page_and_its_questions_is_there(server, name):
    _refused(server, 404, "GET", name)
    _refused(server, 404, "POST", name, b"{}")


def test_an_address_is_asked_in_its_own_way(server):
    _refused(server, 405, "GET", "motion")
    _refused(server, 405, "POST", "explore.js", b"{}")
    for method in ("DELETE", "PUT", "OPTIONS", "TRACE"):
        assert _reply(server, method, "motion")[0] == 405


def test_a_question_too_long_or_of_no_length_is_refused_unread(server):
    _refused(server, 413, "POST", "motion", b" " * (LARGEST + 1))
    _refused(server, 413, "POST", "motion", b"", **{"Content-Length": "9" * 400})
    _refused(server, 411, "POST", "motion", b"", **{"Content-Length": "-1"})
    _refused(server, 411, "POST", "motion", iter([b"{}"]), **{"Transfer-Encoding": "chunked"})


@pytest.mark.parametrize("body", [b"", b"{", b"\xff\xfe", b"NaN", b'{"until": Infinity}', b"[" * 60000, b"9" * 60000])
def test_what_is_not_json_is_refused(server, body):
    _refused(server, 400, "POST", "motion", body)


@pytest.mark.parametrize("question", [
    [], 1, None, "x", {"x": 1}, {"scene": 99}, {"scene": -1}, {"scene": "0"}, {"scene": True}, {"parameters": [1]},
    {"parameters": {"sigma": "__import__('os')"}}, {"parameters": {"sigma": -2}}, {"parameters": {"sgma": 1}},
    {"parameters": {"sigma": [1]}}, {"parameters": {"sigma": None}}, {"parameters": {"sigma": True}},
    {"parameters": {"mu": "1e-99999"}}, {"parameters": {"mu": 0}}, {"start": {"x": "<script>"}}, {"start": {"w": 1}},
    {"until": -1}, {"until": "9" * 5000}, {"until": {}}, {"scene": 1, "parameters": {"k": "1/0"}},
    {"until": "\r\nSet-Cookie: a=b"}, {"start": {"x": "1\n2"}},
])
@pytest.mark.few(5)
def test_hostile_and_mistaken_questions_are_refused_in_one_line(server, question):
    _refused(server, 400, "POST", "motion", json.dumps(question))


def _raw(server, data, ends=False):
    """Send bytes and return the answer; a page that ``ends`` its side of the connection does not wait for long."""
    with create_connection(("127.0.0.1", server.server_port), timeout=60) as connection:
        connection.sendall(data)
        if ends:
            connection.shutdown(SHUT_WR)
        return b"".join(iter(lambda: connection.recv(65536), b""))


def test_a_question_shorter_than_it_says_is_refused(server):
    begun = f"POST /{server.token}/motion HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\n"
    reply = _raw(server, f"{begun}Content-Length: 100\r\n\r\n{{}}".encode(), ends=True).decode()
    assert "400" in reply.partition("\r\n")[0]


def test_the_server_sees_whether_a_page_still_waits(server, monkeypatch):
    page, seen = create_connection(("127.0.0.1", server.server_port)), Future()

    def ask(question, wanted):
        before = wanted()
        page.close()
        end = time.monotonic() + START
        while wanted() and time.monotonic() < end:
            time.sleep(0.01)
        seen.set_result((before, wanted()))
        return b""

    monkeypatch.setattr(server.workers["least"], "ask", ask)
    host = f"127.0.0.1:{server.server_port}"
    page.sendall(f"POST /{server.token}/least HTTP/1.1\r\nHost: {host}\r\nContent-Length: 2\r\n\r\n{{}}".encode())
    assert seen.result(START) == (True, False)


@pytest.mark.parametrize(("status", "request_line", "headers", "body"), [
    (411, "{post}", "Host: {host}\r\nContent-Length: +2\r\n", "{}"),
    (421, "GET /{token}/ HTTP/1.1", "", ""),
    (403, "GET http://{host}/{token}/ HTTP/1.1", "Host: {host}\r\n", ""),
    (403, "GET /%2e%2e/{token}/ HTTP/1.1", "Host: {host}\r\n", ""),
    (404, "GET /{token}/scenes?x=1 HTTP/1.1", "Host: {host}\r\n", ""),
    (404, "GET /{token} HTTP/1.1", "Host: {host}\r\n", ""),  # relative to which the parts of the page are not found
    (414, "GET /" + "a" * 70000 + " HTTP/1.1", "Host: {host}\r\n", ""),
    (431, "GET /{token}/ HTTP/1.1", "".join(f"X{k}: 1\r\n" for k in range(300)), ""),
    (400, "\x16\x03\x01\x02 \x01 \x01 \x03", "", ""),  # a browser that speaks TLS
    (400, "{post}", "Host: {host}\r\nContent-Length: 11\r\n", '{"draft":1}'),
    (400, "{post}", "Host: {host}\r\nContent-Length: 15\r\n", '{"until":1e400}'),
    (400, "{post}", "Host: {host}\r\nContent-Length: 24\r\n", '{"start":{"x":"\\ud800"}}'),
])
def test_requests_that_no_page_would_make_are_refused(server, status, request_line, headers, body):
    known = {"{token}": server.token, "{host}": f"127.0.0.1:{server.server_port}",
             "{post}": f"POST /{server.token}/motion HTTP/1.1"}
    text = f"{request_line}\r\n{headers}Connection: close\r\n\r\n"
    for name, value in known.items():
        text = text.replace(name, value)
    reply = _raw(server, (text + body).encode("latin-1")).decode()
    assert str(status) in reply.partition("\r\n")[0]
    assert "Traceback" not in reply


@pytest.mark.parametrize("question", [{}, {"pair": ["s", "s", "z"]}, {"pair": "sz"}, {"pair": ["s", "w"]},
                                      {"pair": ["s", "z"], "across": "x"}, {"pair": ["s", "z"], "across": [0] * 2000},
                                      {"pair": ["s", "z"], "across": [{}], "up": [1]}, {"pair": ["s", "z"], "up": []}])
@pytest.mark.few(2)
def test_a_picture_that_is_none_is_refused(server, question):
    grids = {"across": [0, 1], "up": [0, 1]}
    _refused(server, 400, "POST", "surroundings", json.dumps({**grids, **question} if question else question))


def test_a_picture_of_one_quantity_twice_has_nothing_around_it(server):
    question = {"pair": ["s", "s"], "across": [0, 1], "up": [0, 1]}
    assert _reply(server, "POST", "surroundings", json.dumps(question)) == (200, "[]")


def test_the_least_model_of_the_page_is_that_of_python(server):
    status, text = _reply(server, "POST", "least", json.dumps({"parameters": {"mu": "1e-4"}, "rtol": "1e-2"}))
    scene = ap.Scene(sigma=1, mu="1e-4", start=(0, "0.2", -1), until=5)
    assert (status, json.loads(text)["model"]) == (200, ap.least_model(scene, "1e-2").model)
    _refused(server, 400, "POST", "least", json.dumps({"rtol": "small"}))


def test_the_page_is_self_contained_and_may_load_from_nowhere_else(server):
    for name in ("", "explore.css", "explore.js", "scenes"):
        status, text = _reply(server, "GET", name)
        assert status == 200
        assert "//" not in text.replace("http://www.w3.org/2000/svg", "").replace("// ", "")
    connection = HTTPConnection("127.0.0.1", server.server_port)
    connection.request("GET", f"/{server.token}/")
    assert "default-src 'none'" in connection.getresponse().headers["Content-Security-Policy"]
    connection.close()


def _lightness(colour):
    full = colour[1:] if len(colour) == 7 else "".join(2 * digit for digit in colour[1:])
    parts = [int(full[k : k + 2], 16) / 255 for k in (0, 2, 4)]
    return sum(w * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4)
               for w, c in zip((0.2126, 0.7152, 0.0722), parts, strict=True))


@pytest.mark.parametrize(("scheme", "least"), [("light", 4.5), ("dark", 6)])
def test_every_text_and_curve_of_the_page_stands_out_in_a_light_and_in_a_dark_scheme(server, scheme, least):
    """A browser that is set to dark showed the page in light colours."""
    sheet = _reply(server, "GET", "explore.css")[1]
    light, dark = (dict(re.findall(r"--(\w+): (#\w+)", part)) for part in sheet.split("dark) {\n  :root", 1))
    dark = {name: dark[name] for name in light if name in dark}
    colours = light if scheme == "light" else {**light, **dark}
    assert ("color-scheme: light dark" in sheet, _lightness(colours["paper"]) > 0.5) == (True, scheme == "light")
    for name in ("ink", "quiet", "path", "stable", "unstable"):
        bright, dim = sorted(map(_lightness, (colours["paper"], colours[name])), reverse=True)
        assert (bright + 0.05) / (dim + 0.05) > least, name
    rules = re.sub(r"--\w+: #\w+", "", sheet)
    assert not re.findall(r"#[0-9a-f]{3,6};", rules), "a colour that does not follow the scheme"


def _ask(server, connection, question):
    connection.request("POST", f"/{server.token}/motion", json.dumps(question))
    reply = connection.getresponse()
    return reply.status, reply.read()


def test_the_motion_of_the_rod_feels_instant(server):
    connection = HTTPConnection("127.0.0.1", server.server_port)
    times = []
    for k in range(30):
        begin = time.perf_counter()
        assert _ask(server, connection, {"start": {"z": -1 - k / 100}})[0] == 200
        times.append(time.perf_counter() - begin)
    connection.close()
    assert min(times) < 0.05  # some 7 ms where nothing else runs


def test_the_page_opens_before_its_scenes_are_derived_and_tells_why_there_are_none(tmp_path):
    def derived():
        assert _reply(running, "GET", "")[0] == 200
        raise InputError("no such mechanism")

    with Server() as running:
        Thread(target=running.serve_forever, daemon=True).start()
        with pytest.raises(InputError):
            running.show(derived)
        assert _refused(running, 400, "GET", "scenes") == "no such mechanism"
        assert _refused(running, 400, "POST", "motion", "{}") == "no such mechanism"
        running.shutdown()


@pytest.mark.further
def test_a_mechanism_of_ones_own_is_explored_with_an_elastic_and_with_a_rigid_contact(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(MECHANISM.replace("f = 2", "f = 1"))  # no paradox yet
    with Server() as running:
        Thread(target=running.serve_forever, daemon=True).start()
        running.show(chosen_scenes(str(file)))
        told = json.loads(_reply(running, "GET", "scenes")[1])
        assert [scene["name"] for scene in told] == ["elastic contact", "rigid"]
        for number, scene in enumerate(told):
            assert {"m", "l", "g", "f"} <= {knob["name"] for knob in scene["parameters"]}
            status, text = _reply(running, "POST", "motion", json.dumps({"scene": number, "until": "1/20"}))
            assert (status, json.loads(text)["t"][-1]) == (200, 0.05)
            _refused(running, 400, "POST", "motion", json.dumps({"scene": number, "parameters": {"mass": 1}}))
        running.shutdown()


def test_a_mechanism_with_a_c_and_an_h_of_its_own_keeps_them_beside_those_of_the_contact(tmp_path):
    file = tmp_path / "own.toml"
    named = MECHANISM.replace("l*sin(theta)", "h*sin(theta)").replace('friction = "f"', 'friction = "c"')
    file.write_text(named.replace("f = 2", "h = 3\nc = 2"))
    elastic, rigid = (dict(zip(map(str, scene.system.parameters), scene.values, strict=True))
                      for scene in chosen_scenes(str(file))())
    assert {"h", "h_", "c", "c_"} <= elastic.keys()
    assert elastic["h"] == rigid["h"] == 3


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is sent otherwise there")
@pytest.mark.parametrize("sent", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.further)])
def test_an_interruption_ends_the_command_cleanly(sent):
    command = hearing("explore", "backward", "--no-browser")
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout.readline().startswith("http://127.0.0.1:")
        assert running.stdout.readline() == "Ctrl-C ends it.\n"
        running.send_signal(sent)
        try:
            _, complaint = running.communicate(timeout=60)
        finally:
            running.kill()
    assert (running.returncode, complaint) == (0, "")


# ---- the page -------------------------------------------------------------------------------------------------------

PATH = "document.querySelector('#phase .path')?.getAttribute('d')"
RING = "(() => { const b = document.querySelector('#phase .ring').getBoundingClientRect(); " \
       "return [b.x + b.width / 2, b.y + b.height / 2]; })()"


@pytest.fixture(scope="module")
def window(server):
    if not PRESENT:
        pytest.skip("needs chromium and chromedriver")
    with browser() as found:
        yield found


def _drag_ring(window, before, tries=3):
    """Drag the ring until the path is no longer ``before``: a picture that is drawn meanwhile takes the press away."""
    x, y = window.run(f"return {RING}")
    window.drag((x, y), (x + 40, y - 30))
    try:
        window.wait(f"{PATH} !== {json.dumps(before)}", seconds=START)
    except TimeoutError:
        if tries == 1:
            raise
        _drag_ring(window, before, tries - 1)


@pytest.mark.parametrize("width", [1280, 390])
def test_a_slider_moves_the_picture_and_a_drag_moves_the_start(server, window, width):
    window.open(server.address, width)
    window.wait(f"{PATH} && document.querySelector('#phase .stick')")
    assert window.run("return document.documentElement.scrollWidth") <= width
    before = window.run(f"return {PATH}")
    window.set("[data-slider=sigma]", 900, "input")
    window.wait(f"{PATH} !== {json.dumps(before)}")
    window.wait("document.body.getAttribute('aria-busy') === 'false'")  # a later answer draws the ring anew
    turned = window.run(f"return {PATH}")
    assert window.run("return document.querySelector('[data-box=sigma0]').value") \
        == window.run("return document.querySelector('[data-box=sigma]').value")
    _drag_ring(window, turned)
    assert float(window.run("return document.querySelector('[data-box=z]').value")) > -1
    assert window.complaints() == []


@pytest.mark.slow
def test_the_page_shows_what_a_parameter_changes_of_the_start_but_not_what_was_given(server, window):
    window.open(server.address)
    window.wait(PATH)
    window.set("#scene", 2, "change")
    window.wait("document.querySelector('[data-box=eps]') && document.querySelector('#series .path')")
    window.set("[data-box=z]", "1/2", "change")
    window.set("[data-box=eps]", "0.05", "change")
    window.wait("document.querySelector('[data-box=x]').value === '-400'")
    assert window.run("return document.querySelector('[data-box=z]').value") == "1/2"
    assert window.complaints() == []


@pytest.mark.slow
def test_logarithmic_axes_of_the_page_and_of_times_in_figures_begin_a_decade_from_0(server, window):
    window.open(server.address)
    script = Path(questions.__file__).with_name("page").joinpath("explore.js").read_text(encoding="utf-8")
    powers = (-3e4, 0, 1e-3, 3, 30, 3e5)
    scale = re.search("function scale.*?^}", script, re.M | re.S)[0]
    page = window.run(f"{scale} return {list(powers)}.map(scale(3)[0])")
    assert page[3] == pytest.approx(math.log(10))
    times = ap.solve(ap.Scene(1, "1e-6", (0, "0.2", -1), 5)).plot().axes[1].xaxis.get_transform()  # from 1e-5 on
    assert page == pytest.approx(times.transform(1e-5 * np.array(powers) / 3), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("given", [
    "until=5e-324", "until=1e-320&time=logarithmic", "until=1e307", "start.x=-8e307&start.y=8e307&until=1e-5",
])
def test_every_motion_of_doubles_has_a_picture(server, window, given):
    window.open("about:blank")
    window.open(f"{server.address}#{given}")
    window.wait(f"{PATH} && {IDLE}")
    inside = window.run("""const boxes = k => [...document.querySelectorAll(`#series ${k}`)].map(e => e.getBBox());
        const [frame] = boxes(".frame"), ends = box => [box.x, box.x + box.width];
        const near = (a, b) => ends(a).every((x, k) => Math.abs(x - ends(b)[k]) < 0.1);
        const width = document.getElementById("series").clientWidth;
        return [boxes(".path").every(box => near(box, frame)), boxes("text").every(box => ends(box)[1] <= width)];""")
    assert inside == [True, True]
    assert window.complaints() == []


@pytest.mark.slow
def test_the_page_says_what_is_wrong_and_keeps_the_last_picture(server, window):
    window.open(server.address)
    before = window.wait(PATH)
    window.set("[data-box=mu]", "<b>", "change")
    said = window.wait("document.getElementById('message').textContent")
    assert "mu = '<b>'" in said
    assert window.run(f"return {PATH}") == before
    heard = "document.getElementById('series').getAttribute('aria-label')"
    assert window.run(f"return {heard}").startswith("of older numbers, states over time")
    window.set("[data-box=mu]", "1e-6", "change")
    window.wait(f"{heard}.startsWith('states over time')")
    (refused,) = window.complaints()
    assert "400" in refused


# Answers of one kind wait in ``held`` until they are let go; ``made``, where given, takes the place of the server's.
HOLD = """const [kind, made] = arguments, real = window.fetch, reply = (body, status) => new Response(body, { status });
window.held = [];
window.fetch = async (name, asked) => {
  const answer = name === kind && made ? reply(JSON.stringify(made), made.error ? 503 : 200) : await real(name, asked);
  return name === kind ? new Promise(go => window.held.push(() => go(answer))) : answer;
};"""
IDLE = "document.body.getAttribute('aria-busy') === 'false'"


def _let_go(window):
    window.wait("window.held.length")
    window.run("window.held.splice(0).forEach(go => go())")


# A quantity of the motion is given the values of ``values`` in turn.
NOISE = """const [name, values] = arguments, real = window.fetch;
window.fetch = async (...asked) => {
  const reply = await real(...asked), found = await reply.json();
  if (found.states?.[name]) found.states[name] = found.states[name].map((_, k) => values[k % values.length]);
  return new Response(JSON.stringify(found), { status: reply.status });
};"""


@pytest.mark.slow
def test_every_axis_has_two_places_or_more_and_what_varies_by_rounding_alone_is_drawn_as_constant(server, window):
    """An axis about 0 had the place 0 alone, whose label was an error; a constant with rounding was an endless axis."""
    window.open(server.address)
    window.wait(PATH)
    window.run(NOISE, "c", [0.3, 0.1 + 0.2])
    window.set("#scene", 3, "change")
    window.wait(f"{PATH} && {IDLE}")
    places = window.run("""return [...document.querySelectorAll('#series text[text-anchor=end]:not(.name)')]
        .map(text => Number(text.textContent))""")
    assert [places.count(v) for v in (-4, 0.3, 4)] == [2, 1, 2]
    assert window.complaints() == []


@pytest.mark.slow
def test_curves_that_move_with_the_motion_are_said_to_be_those_at_the_start(server, window):
    legend = "document.getElementById('legend').textContent"
    for number, pair, told in ((3, "across=x", True), (0, "", False), (0, "across=x", True)):
        window.open("about:blank")
        window.open(f"{server.address}#scene={('backward', 'block', 'ball', 'pushed')[number]}&{pair}")
        said = window.wait(f"{legend}.includes('sticks') && {legend}")
        assert said.endswith("(all else as at the start)") == told


@pytest.mark.slow
def test_the_legend_has_the_curves_of_the_picture_alone(server, window):
    window.open(server.address)
    legend = "document.getElementById('legend').textContent"
    window.wait(f"{legend} && {IDLE}")
    assert "Π2" not in window.run(f"return {legend}")  # at s = -1, on the left of the picture
    window.set("[data-box=x]", "-2", "change")
    window.wait(f"{legend}.includes('Π2')")
    assert window.run("return document.querySelectorAll('#phase .unstable').length") == 1


@pytest.mark.slow
def test_the_logarithm_of_the_time_can_be_chosen_before_there_is_a_motion(server, window):
    window.open(server.address)
    window.wait(f"{PATH} && {IDLE}")
    window.run(HOLD, "motion", None)
    window.set("#scene", 1, "change")
    window.run("document.getElementById('logarithmic').click()")
    _let_go(window)
    window.wait(f"{PATH} && {IDLE}")
    assert window.complaints() == []


@pytest.mark.slow
def test_a_verdict_on_older_numbers_is_faded(server, window):
    window.open(server.address)
    window.wait(PATH)
    window.run(HOLD, "least", {"model": "jump-0", "rungs": []})
    window.run("document.getElementById('least').click()")
    before = window.run(f"return {PATH}")
    window.set("[data-box=mu]", "1/2", "change")
    window.wait(f"{PATH} !== {json.dumps(before)}")
    faded = "document.getElementById('verdict').classList.contains('stale')"
    for older in (True, False):
        _let_go(window)
        window.wait(f"document.querySelector('#verdict p').textContent === 'jump-0 will do' && {IDLE}")
        assert window.run(f"return {faded}") == older
        window.run("document.getElementById('least').click()")
    _let_go(window)
    window.wait(IDLE)
    window.set("#rtol", "1e-9", "input")
    assert window.run(f"return {faded}")


@pytest.mark.slow
def test_a_motion_of_older_numbers_is_faded_while_it_is_waited_for_and_not_shown_after_a_reset(server, window):
    window.open(server.address)
    before = window.wait(f"{IDLE} && {PATH}")
    window.run(HOLD, "motion", None)
    window.set("[data-box=mu]", "1/2", "change")
    window.wait("document.getElementById('pictures').classList.contains('late')")
    window.run("document.getElementById('reset').click()")
    shown = "['legend', 'modes', 'model'].map(id => document.getElementById(id).textContent).join('')"
    assert window.run(f"return {shown}") == ""
    _let_go(window)
    window.wait("window.held.length")
    assert window.run(f"return {PATH}") is None
    _let_go(window)
    assert window.wait(f"{IDLE} && {PATH}") == before
    assert window.run("return document.getElementById('logarithmic').checked")
    assert not window.wait("[document.getElementById('pictures').classList.contains('late')]")[0]


@pytest.mark.further
def test_a_motion_that_takes_long_is_dropped_for_that_of_newer_numbers(server, window):
    """A horizon by mistake kept the page waiting until the server gave up, for a minute."""
    window.open(server.address)
    before = window.wait(f"{IDLE} && {PATH}")
    window.run("""const real = window.fetch;
    window.fetch = (name, asked) => {
      if (name !== 'motion') return real(name, asked);
      window.fetch = real;
      return new Promise((_, no) => asked.signal.addEventListener('abort', () => no(asked.signal.reason)));
    };""")
    window.set("[data-box=until]", "1e9", "change")
    window.set("[data-box=until]", "4", "change")
    window.wait(f"{IDLE} && {PATH} !== {json.dumps(before)}")
    assert window.run("return document.getElementById('message').textContent") == ""


@pytest.mark.slow
def test_curves_that_cannot_be_computed_are_not_those_of_older_numbers(server, window):
    window.open(server.address)
    window.wait(f"document.querySelector('#phase .curve') && {IDLE}")
    window.run(HOLD, "surroundings", {"error": "no answer"})
    window.set("[data-box=sigma]", "2", "change")
    window.wait("getComputedStyle(document.querySelector('#phase .curve')).opacity === '0.45'")  # faded until then
    _let_go(window)
    window.wait("!document.querySelector('#phase .curve')")
    assert window.run("return document.getElementById('message').textContent") \
        == "slow manifolds and stick regions: no answer"


@pytest.mark.slow
def test_the_address_shows_what_was_changed_again(server, window):
    window.open(server.address)
    window.wait(f"{PATH} && {IDLE}")
    for box, text in (("sigma", "1.5"), ("sigma0", "7/4"), ("z", "-1/2"), ("until", "3")):
        window.set(f"[data-box={box}]", text, "change")
    window.set("#across", "x", "change")
    window.set("#up", "y", "change")
    window.run("document.getElementById('logarithmic').click()")
    numbers = "parameters.sigma=1.5&parameters.sigma0=7%2F4&start.z=-1%2F2&until=3"
    parts = f"scene=backward&{numbers}&across=x&up=y&time=linear"
    window.wait(f"location.hash === '#{parts}' && {IDLE}")
    shown = f"""return [...document.querySelectorAll('[data-box], #across, #up, [data-slider]')]
        .map(knob => knob.value).concat(document.getElementById('logarithmic').checked, {PATH})"""
    before = window.run(shown)
    window.run("location.reload()")
    window.wait(f"{PATH} && {IDLE}")
    assert window.run(shown) == before
    window.run("document.getElementById('reset').click()")
    window.wait(f"location.hash === '' && {IDLE}")
    assert window.run("return document.querySelector('[data-box=sigma0]').value") == "1"
    window.run(f"location.hash = '{parts}'")
    window.wait(f"document.querySelector('[data-box=until]').value === '3' && {PATH} && {IDLE}")
    assert window.run(shown) == before
    window.set("#scene", 1, "change")
    window.wait("location.hash === '#scene=block'")
    assert window.complaints() == []


@pytest.mark.slow
@pytest.mark.parametrize(("parts", "said"), [
    ("parameters.mu=1e-3&parameters.nu=2&start.constructor=1&across=q&time=now&__proto__=1",
     "The address has parameters.nu=2, start.constructor=1, across=q, time=now, __proto__=1, which this page has not."),
    ("scene=nowhere&parameters.mu=<b>", "The address has scene=nowhere, which this page has not."),
    ("parameters.mu=1e999", "mu = '1e999': "), ("start.z=%00%ff%", "start z = '"), ("until=" + "9" * 70000, "at most"),
])
def test_what_an_address_has_wrong_is_told_and_the_page_goes_on(server, window, parts, said):
    window.open("about:blank")
    window.open(f"{server.address}#{parts}")
    message = "document.getElementById('message').textContent"
    assert said in window.wait(f"{IDLE} && {message}")
    assert bool(window.run(f"return {PATH}")) == said.startswith("The address")
    window.set("[data-box=z]", "-1", "change")
    for box, text in (("mu", "1e-3"), ("until", "1")):
        window.set(f"[data-box={box}]", text, "change")
    window.wait(f"{PATH} && {IDLE} && {message} === ''")
    assert all("status of 4" in said for said in window.complaints())


@pytest.mark.slow
def test_a_slider_stands_at_the_number_of_its_box_and_says_it(server, window):
    window.open(server.address)
    window.wait(PATH)
    for written, place in (("1/1000000", "500"), ("1/100000000", "167"), ("0", "0"), ("-1", "0"), ("1e999", "1000")):
        window.set("[data-box=mu]", written, "change")
        slider = "document.querySelector('[data-slider=mu]')"
        assert window.run(f"return [{slider}.value, {slider}.getAttribute('aria-valuetext')]") == [place, written]
    window.set("[data-slider=mu]", 500, "input")
    assert window.run(f"return {slider}.getAttribute('aria-valuetext')") == "1e-6"
    window.wait(IDLE)
    assert all("400" in said for said in window.complaints())


@pytest.mark.slow
def test_the_pictures_say_the_motion_in_words(server, window):
    window.open(server.address)
    window.wait(f"{PATH} && {IDLE}")
    small = window.run("return document.getElementById('series').getAttribute('aria-label')")
    assert max(map(len, re.findall(r"[-0-9.e]+", small))) <= len("-1.23456e-10")
    window.set("[data-box=mu]", "0.01", "change")
    window.wait(f"document.querySelector('[data-slider=mu]').value === '1000' && {IDLE}")
    phase, said = (window.run(f"return document.getElementById('{name}').getAttribute('aria-label')")
                   for name in ("phase", "series"))
    path = ap.solve(turned(ROD, {"mu": "0.01"}, {}, None))
    assert phase == "phase picture: z over s"
    modes, final = said.removeprefix("states over time: ").split("; at the end ")
    until = [float(event.t) for event in path.events] + [5]
    assert [words.split(" until t = ")[0] for words in modes.split(", ")] == [*path.modes]
    assert [float(words.split(" = ")[1]) for words in modes.split(", ")] == pytest.approx(until, rel=1e-5)
    assert [float(words.split(" = ")[1]) for words in final.split(", ")][:3] == pytest.approx(path.final, rel=1e-5)


@pytest.mark.slow
def test_dots_mark_all_events_or_none(server, window, tmp_path):
    (tmp_path / "pushed.toml").write_text(PUSHED)
    pushed = ap.read_scene(tmp_path / "pushed.toml")
    window.open(server.address)
    window.wait(f"{PATH} && {IDLE}")
    window.set("#scene", 3, "change")
    for until, dots in (("20", True), ("400", False)):
        window.set("[data-box=until]", until, "change")
        events = len(ap.solve(turned(pushed, {}, {}, until)).events)
        window.wait(f"document.getElementById('model').textContent.endsWith(', {events} events') && {IDLE}")
        marked, moments = (window.run(f"return document.querySelectorAll('#series {kind}').length")
                           for kind in (".event", ".moment"))
        assert (marked, moments) == (3 * events * dots, 3 * events)


@pytest.mark.slow
def test_enter_in_the_bound_of_the_error_finds_the_least_model(server, window):
    window.open(server.address)
    window.wait(PATH)
    window.run(HOLD, "least", {"model": "jump-0", "rungs": []})
    pressed = "dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter' }))"
    window.run(f"document.getElementById('rtol').{pressed}")
    _let_go(window)
    window.wait("document.querySelector('#verdict p').textContent === 'jump-0 will do'")


@pytest.mark.further
def test_the_page_shows_the_verdict_of_the_ladder_and_another_scene(server, window):
    window.open(server.address)
    window.wait(PATH)
    window.run("document.getElementById('least').click()")
    assert "will do" in window.wait("document.querySelector('#verdict table')?.parentElement.textContent")
    window.set("#scene", 1, "change")
    window.wait("document.querySelector('[data-slider=k]') && document.querySelector('#series .path')")
    assert window.run("return document.querySelectorAll('#series .path').length") == 2
    assert window.complaints() == []


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), [(390, 844), (390, 640), (740, 360)])
def test_every_knob_can_be_reached_on_a_small_screen(server, window, width, height):
    window.open(server.address, width, height)
    window.wait(f"{PATH} && {IDLE}")
    covered = window.run("""const knobs = [...document.querySelectorAll('#controls input, #controls button')];
    return [...knobs, ...knobs.reverse()].filter(knob => {
      knob.focus();
      const box = knob.getBoundingClientRect();
      return document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2) !== knob;
    }).map(knob => knob.dataset.slider || knob.dataset.box || knob.id)""")
    assert covered == []
