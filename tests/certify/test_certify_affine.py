"""Certificates of affine systems: what is proven holds at seventy digits, and what cannot be proven is refused."""

import math
import re
from dataclasses import replace
from fractions import Fraction
from itertools import product
from time import process_time

import mpmath
import numpy as np
import pytest
import sympy as sp
from blocks import spring_block
from mechanisms import FALLING_BALL

import asympk as ap
from asympk.__main__ import main
from asympk.errors import InputError, TwoMotions, UnboundedReaction
from asympk.scenes.scenefile import changed_scene, read_scene
from asympk.scenes.turned import turned
from asympk.studies.bench import rod_in_general_clothes
from asympk.symbolic import branches, guards
from asympk.symbolic.branches import Phase
from asympk.symbolic.signs import waves_never_negative

pytest.importorskip("flint")

from asympk.certify import certify, cover
from asympk.certify.affine import _Modes
from asympk.certify.balls import hull
from asympk.certify.enclosure import Budget
from asympk.certify.rows import EnclosedState, ExactEntries, sign_at
from asympk.certify.segments import EnclosedSegment
from asympk.certify.zeros import order_at

F, G, H, N, t = sp.symbols("F G H N t", real=True)
x, v, y, w, c = sp.symbols("x v y w c", real=True)
mu, k = sp.symbols("mu k", positive=True)
ROOT = sp.sqrt(2)

CHAIN = ap.System.with_frictions(
    {x: v, v: y - 2 * x + F + sp.cos(2 * t) / 2, w: x - w / 4}, {y: w - y},
    [ap.Friction(velocity=v, force=F, load=2 + x / 4, kinetic=k, static=k + sp.Rational(1, 4))], small=mu, time=t,
)
COULOMB = ap.System.with_frictions({x: v, v: -x + F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=k)])


def holds(ball, value):
    """Tell whether a ball contains a number known to forty digits."""
    return abs(mpmath.mpf(str(ball.mid().str(60, radius=False))) - value) <= float(ball.rad()) * 1.01 + 1e-38


def random_scene(random):
    start = dict(zip(("x", "v", "w", "y"), random.uniform(-2, 2, 4).tolist(), strict=True))
    values = {"mu": 10.0 ** -random.uniform(1, 7), "k": random.uniform(0.25, 1)}
    return ap.Scene(system=CHAIN, values=values, start=start, until=random.uniform(0.5, 4))


def test_what_is_proven_is_what_forty_digits_find():
    random = np.random.default_rng(2)
    for _ in range(5):
        proven_as_followed(random_scene(random))


def proven(proof):
    return proof.proven or pytest.fail(proof.reason)


def proven_as_followed(scene):
    """Return the proof of what a scene does, once forty digits have found the same within its balls."""
    proof, path = certify(scene), ap.solve(scene, digits=40)
    assert proven(proof)
    assert proof.modes == path.modes
    assert [e.kind for e in proof.events] == [e.kind for e in path.events]
    with mpmath.workdps(60):
        assert all(holds(a, b) for a, b in zip(proof.final, path.final, strict=True))
        assert all(holds(a.t, b.t) for a, b in zip(proof.events, path.events, strict=True))
    return proof


def test_the_coulomb_oscillator_is_proven_down_to_its_rest():
    proof = certify(ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "5.3", "v": 0}, until=100))
    assert proven(proof)
    assert proof.modes[-1] == "stick"
    assert len(proof.events) == 8
    assert float(proof.final[0].mid()) == pytest.approx(5.3 - 8 * 0.7)
    assert float(proof.final[0].rad()) < 1e-15
    assert proof.final[1] == 0


def test_a_root_is_enclosed_in_few_steps_however_its_ends_are_rounded(monkeypatch):
    count, jet = [], EnclosedSegment.jet
    monkeypatch.setattr(EnclosedSegment, "jet", lambda *given: count.append(1) or jet(*given))
    proof = certify(ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "5.3", "v": 0}, until=24))
    assert len(proof.events) == 7
    assert len(count) < 400


def test_a_box_of_starts_contains_what_its_points_do():
    scene = ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "2.3", "v": 0}, until=12)
    box = {"x": ("2.299", "2.301"), "v": ("0.1", "0.102")}
    proof = certify(scene, box)
    assert proven(proof)
    for a, b in ((2.2995, 0.1015), (2.301, 0.1)):
        path = ap.solve(ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": a, "v": b}, until=12))
        assert path.modes == proof.modes
        assert inside(proof, path, 1e-15)


def inside(proof, path, rounding=1e-14):
    pairs = zip(proof.final, path.final, strict=True)
    return all(abs(float(ball.mid()) - end) <= float(ball.rad()) + rounding for ball, end in pairs)


@pytest.mark.slow
def test_a_box_of_parameters_contains_what_its_points_do():
    random, half = np.random.default_rng(7), 0.00003
    for _ in range(4):
        values = {"mu": 10.0 ** -random.uniform(1, 4), "k": random.uniform(0.25, 1)}
        start = dict(zip(("x", "v", "w", "y"), random.uniform(-2, 2, 4).tolist(), strict=True))
        scene = ap.Scene(system=CHAIN, values=values, start=start, until=2)
        proof = certify(scene, {name: (v * (1 - half), v * (1 + half)) for name, v in values.items()})
        assert proven(proof)
        assert max(float(ball.rad()) for ball in proof.final) < 0.5
        for _ in range(3):
            near = {name: v * (1 + random.uniform(-half, half)) for name, v in values.items()}
            path = ap.solve(ap.Scene(system=CHAIN, values=near, start=start, until=2))
            assert path.modes == proof.modes
            assert inside(proof, path)


def test_a_box_of_amplitudes_of_a_wave_contains_what_its_points_do():
    push = c * sp.cos(2 * t) + (1 - c) * sp.sin(3 * t)
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half)
    block = ap.System.with_frictions({x: v, v: F - x + push, c: 0}, {}, [friction], time=t)
    scene = ap.Scene(system=block, start={x: 2, v: 0, c: "1/2"}, until=4)
    proof = certify(scene, {"c": ("0.499", "0.501")})
    assert proven(proof)
    for amplitude in ("0.499", "1/2", "0.501"):
        path = ap.solve(ap.Scene(system=block, start={x: 2, v: 0, c: amplitude}, until=4))
        assert path.modes == proof.modes
        assert inside(proof, path)


def in_a_box_of_the_rod(start, until, **box):
    """Return the proof of the rod in general clothes on a box; each of its corners is within the balls."""
    system, values = rod_in_general_clothes(), {"eps": "1e-2", "k": 1, "k0": 1}
    begins = dict(zip("pqw", start, strict=True))
    proof = certify(ap.Scene(system=system, values=values, start=begins, until=until), box)
    assert proven(proof)
    for corner in product(*box.values()):
        at = dict(zip(box, corner, strict=True))
        placed, begun = ({name: at.get(name, value) for name, value in part.items()} for part in (values, begins))
        path = ap.solve(ap.Scene(system=system, values=placed, start=begun, until=until))
        assert path.modes == proof.modes
        assert inside(proof, path)
    return proof


def test_a_compliance_that_divides_a_rate_may_range_over_two_percent():
    proof = in_a_box_of_the_rod((0, "1/5", 1), 1, eps=("99e-4", "101e-4"))
    assert max(float(ball.rad()) for ball in proof.final) < 0.05


@pytest.mark.parametrize("box", [{"q": ("1.9", "2.1")}, {"eps": ("99e-4", "101e-4")}])
def test_states_that_range_keep_the_relation_by_which_a_mode_ended(box):
    # stick ends where p + q = 1/4: w and w' begin with 0, and w'' has a sign by this relation
    assert in_a_box_of_the_rod((0, 2, 0), 3, **box).modes == ("stick", "slip_same")


def test_a_jump_through_the_paradox_is_proven_for_compliances_that_range_over_a_percent():
    # the velocity that vanishes says how far the growing exponential has come, better than a time that ranges does
    proof = in_a_box_of_the_rod((0, "1/5", -1), 3, eps=("1e-2", "101e-4"))
    assert proof.modes == ("slip_opposite", "stick", "slip_same")


def test_what_a_decaying_state_carries_on_grows_with_time_in_a_box_too():
    # x decays to k and w is its integral: the constant drives w through x alone
    system = ap.System.with_frictions({x: k - x, w: x, v: F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    scene = ap.Scene(system=system, values={"k": 2}, start={"x": 1, "w": 0, "v": 1}, until=3)
    proof = certify(scene, {"k": ("1.999999", "2.000001")})
    assert proven(proof)
    assert proof.modes == ("slip_same", "stick")
    assert float(proof.final[1].rad()) < 1e-4
    for level in (1.999999, 2.0, 2.000001):
        away = (level - 1) * math.expm1(-3)
        for ball, end in zip(proof.final, (level - (level - 1) * math.exp(-3), 3 * level + away, 0), strict=True):
            assert abs(float(ball.mid()) - end) <= float(ball.rad()) + 1e-15


def test_friction_and_start_may_range_together_down_to_rest():
    scene = ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "2.3", "v": 0}, until=12)
    proof = certify(scene, {"k": ("0.349", "0.351"), "x": ("2.299", "2.301")})
    assert proven(proof)
    assert proof.final[1] == 0
    for k, at in ((0.349, 2.301), (0.3505, 2.2995)):
        assert inside(proof, ap.solve(ap.Scene(system=COULOMB, values={"k": k}, start={"x": at, "v": 0}, until=12)))
    assert "0.349" in repr(proof) or "349/1000" in repr(proof)
    # with more friction the block rests after the first turn, with less it goes on
    assert certify(scene, {"k": ("0.3", "0.9")}).obstacle == "edge"


@pytest.mark.parametrize("also", [{}, {"x": ("2.2", "2.2001")}])
def test_a_side_of_no_length_is_the_parameter_it_names(also):
    scene = ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "2.2", "v": 0}, until=2)
    proof = certify(scene, {"k": ("0.6", "0.6"), **also})
    assert proven(proof)
    assert inside(proof, ap.solve(ap.Scene(system=COULOMB, values={"k": "0.6"}, start={"x": "2.2", "v": 0}, until=2)))


def test_a_box_outside_the_range_of_a_parameter_is_refused():
    scene = ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "2.2", "v": 0}, until=2)
    for box in ({"k": (-1, -1)}, {"k": (-1, 1)}):
        with pytest.raises(ValueError, match="k = -1 is refused; the symbol is declared positive"):
            certify(scene, box)


def test_a_box_with_static_friction_below_the_kinetic_one_at_a_corner_is_refused():
    system = ap.System.with_frictions({x: v, v: -x + F}, {}, [ap.Friction(v, F, load=1, kinetic=k, static=mu)])
    scene = ap.Scene(system=system, values={"k": 1, "mu": 1}, start={"x": 4, "v": 0}, until=12)
    words = "static friction mu is below the kinetic one, k, at k = 1.001, mu = 0.999"
    with pytest.raises(ValueError, match=words):
        certify(scene, {"k": ("0.999", "1.001"), "mu": ("0.999", "1.001")})


@pytest.mark.parametrize(
    ("kinetic", "static", "assumed", "inner", "outer"),
    [
        (1, c**2 + sp.S.Half, sp.true, (-1, 1), ("3/4", 1)),
        (c**2 - sp.Rational(1, 100), None, sp.true, (-1, "0.11"), ("-0.11", "-0.1")),
        (1 + c**2, None, c**2 > 1, (-2, 2), (-2, "-1.9")),
        (1 + c**2, None, sp.Ne(c, 0), (-1, 1), ("0.1", "0.2")),
        (1 + c**2, None, sp.Eq(c**2, 1), (-1, 1), (1, 1)),
        (c, None, sp.Or(c < 1, c > 2), ("1/2", "5/2"), ("5/2", 3)),
        (c, None, sp.Not((c > 1) & (c < 2)), ("1/2", "5/2"), (0, "1/2")),
    ],
)
def test_a_box_that_only_its_corners_show_to_be_valid_has_no_proof(kinetic, static, assumed, inner, outer):
    friction = ap.Friction(v, F, load=1, kinetic=kinetic, static=static)
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [friction], assumptions=assumed)
    scene = ap.Scene(system=system, values={"c": inner[0]}, start={"x": 9, "v": 0}, until="1/2")
    assert certify(scene, {"c": inner}).obstacle == "box"
    assert proven(certify(scene, {"c": outer}))


@pytest.mark.parametrize("ends", [(0, 1), (-1, 0), (-1, 1)])
@pytest.mark.parametrize("kinetic", [c**2, abs(c), 1 + c**2, sp.Rational(1, 10) + c**4])
@pytest.mark.few(2)
def test_friction_that_vanishes_at_one_point_of_a_box_at_most_is_valid_there(kinetic, ends):
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v, F, 1, kinetic, 2 * kinetic + c**2)])
    scene = ap.Scene(system=system, values={"c": 0}, start={"x": 9, "v": 0}, until="1/2")
    proof = certify(scene, {"c": ends})
    assert proven(proof)
    for c_value in (ends[0], "1/3" if ends[1] else "-1/3", ends[1]):
        final = ap.solve(replace(scene, values={"c": c_value}), digits=30).final
        assert all(holds(a, b) for a, b in zip(proof.final, final, strict=True))


def test_a_box_of_two_parameters_that_only_its_corners_show_to_be_valid_has_no_proof():
    a = sp.Symbol("a", real=True)
    friction = ap.Friction(v, F, load=1, kinetic=(a - c) ** 2 - sp.Rational(1, 100))
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [friction])
    scene = ap.Scene(system=system, values={"a": 0, "c": "1/2"}, start={"x": 9, "v": 0}, until="1/2")
    assert certify(scene, {"a": (0, 1), "c": ("1/2", "3/4")}).obstacle == "box"


@pytest.mark.parametrize(("speed", "modes"), [(0, ("stick",)), (1, ("slip_same", "stick")), (-1, ("slip_opposite",))])
def test_a_push_that_static_friction_just_bears_all_over_a_box_is_borne(speed, modes):
    system = ap.System.with_frictions({x: v, v: F - c}, {}, [ap.Friction(v, F, load=1, kinetic=c)])
    scene = ap.Scene(system=system, values={"c": 1}, start={"x": 0, "v": speed}, until=2)
    assert proven_as_followed(scene).modes == modes
    assert certify(scene, {"c": (1, 2)}).modes == modes


@pytest.mark.parametrize("push", [(2, 2), ("3/2", "5/2"), ("3/2", "4/3")])
def test_a_candidate_that_another_guard_excludes_need_not_obey_conditions_on_the_parameters_for_certain(push):
    """Only with c <= 2 would the first block rest if the second slid forward, which it does not."""
    contacts = [ap.Friction(v, F, load=1, kinetic=1), ap.Friction(w, G, load=1, kinetic=1)]
    system = ap.System.with_frictions({v: F - G - c, w: G - 3}, {}, contacts)
    scene = ap.Scene(system=system, values={"c": 2}, start={"v": 0, "w": 0}, until=2)
    assert proven(certify(scene, {"c": sorted(map(Fraction, push))}))
    assert proven_as_followed(scene).modes == ("slip_opposite+slip_opposite",)


def test_a_box_of_pushes_that_static_friction_bears_at_some_points_only_has_no_proof_of_rest():
    system = ap.System.with_frictions({v: c + F}, {}, [ap.Friction(v, F, load=1, kinetic=1, static=2)])
    scene = ap.Scene(system=system, values={"c": "3/2"}, start={"v": 0}, until=1)
    assert proven_as_followed(scene).modes == ("stick",)
    assert certify(scene, {"c": ("3/2", "5/2")}).obstacle == "box"


def test_a_box_with_0_in_its_middle_is_proven_where_the_parameter_is_squared():
    a = sp.Symbol("a", real=True)
    spring = ap.System.with_frictions({x: v, v: -(1 + a**2) * x + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    scene = ap.Scene(system=spring, values={a: 0}, start={"x": 9, "v": 0}, until=4)
    proof = certify(scene, {"a": ("-1e-3", "1e-3")})
    assert proven(proof)
    assert proof.modes == ap.solve(scene).modes


def test_eigenvalues_may_meet_within_a_box():
    damped = ap.System.with_frictions({x: v, v: -x - 2 * k * v + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    proof = certify(ap.Scene(system=damped, values={"k": 1}, start={"x": 3, "v": 0}, until=1), {"k": ("0.9", "1.1")})
    assert proven(proof)
    for damping in ("0.9", "0.97", 1, "1.000001", "1.1"):
        near = ap.Scene(system=damped, values={"k": damping}, start={"x": 3, "v": 0}, until=1)
        assert inside(proof, ap.solve(near))


def test_an_invariant_keeps_its_eigenvalue_zero_whatever_the_parameters_of_a_box_are():
    # two masses on a spring: their momentum stays, and their centre moves on with it, an eigenvalue 0 twice
    z, pull = sp.Symbol("z", real=True), k * (w - x)
    rates = {x: y, y: pull, w: z, z: -mu * pull, v: F}
    system = ap.System.with_frictions(rates, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    start = {"x": 0, "y": 1, "w": 0, "z": 0, "v": 1}
    scene = ap.Scene(system=system, values={"k": 2, "mu": 3}, start=start, until=2)
    proof = certify(scene, {"k": ("1.9999", "2.0001"), "mu": ("2.9999", "3.0001")})
    assert proven(proof)
    assert max(float(ball.rad()) for ball in proof.final) < 1e-2
    for values in ({"k": 2, "mu": 3}, {"k": 2.0001, "mu": 2.9999}):
        path = ap.solve(ap.Scene(system=system, values=values, start=start, until=2))
        assert inside(proof, path)
        assert float(values["mu"]) * path.final[1] + path.final[3] == pytest.approx(float(values["mu"]))


def test_the_held_rod_is_proven_to_do_what_forty_digits_find():
    assert proven_as_followed(read_scene("held_rod")).modes == ("slip_opposite", "stick", "slip_same")


def test_what_cannot_be_proven_is_refused_by_name():
    # a box across the edge of the dead zone: some of its points rest after the first turn, some go on
    edge = ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "1.05", "v": 0}, until=12)
    assert certify(edge, {"x": ("1.04", "1.06")}).obstacle == "edge"
    # the first turn is at pi, about where the run of these ends
    late = ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": 2, "v": 0}, until="3.1415926")
    assert certify(late).proven
    assert certify(late, {"v": ("-0.01", "0.01")}).obstacle in ("edge", "horizon", "grazing")
    grazing = ap.System.with_frictions({x: v, v: 1 + F}, {}, [ap.Friction(velocity=v, force=F, load=x, kinetic=k)])
    touched = ap.Scene(system=grazing, values={"k": "1/2"}, start={"x": 1, "v": -1}, until=1)
    assert not certify(touched, {"v": (-4, -0.5)}).proven


BLOCK = ap.Mechanism((x, y), (v, w), sp.eye(2), (0, -1), ap.Contact(gap=y, slip=x, friction=k, unilateral=True))


def block(system, until, **start):
    """Return a scene of a block of the weight 1 on rough ground, by default at rest on it."""
    values = {s.name: {"k": "1/2", "mu": "1/1000"}[s.name] for s in system.parameters}
    start = BLOCK.start(system, {"x": 0, "y": 0, "x'": 0, "y'": 0} | start)
    return ap.Scene(system=system, values=values, start=start, until=until)


@pytest.mark.parametrize("start", [{"y": 1}, {"y": 1, "x'": 1}, {"y'": 1}, {"x'": 1, "y'": 1}])
def test_a_rigid_contact_that_is_apart_or_parts_is_proven_to_be_open(start):
    scene = block(BLOCK.rigid(), 1, **start)
    proof, path = certify(scene), ap.solve(scene)
    assert proven(proof)
    assert proof.modes == path.modes == ("open",)
    assert [float(ball) for ball in proof.final] == pytest.approx(path.final, abs=1e-12)


@pytest.mark.parametrize("start", [{"y'": -1}, {"x'": 1, "y'": -1}, {"y": "1/2"}, {"y": "1/2", "x'": 1}])
def test_a_rigid_contact_that_is_hit_has_no_proof(start):
    assert not certify(block(BLOCK.rigid(), 3, **start)).proven


@pytest.mark.parametrize(("start", "what"), [({x: 1, y: sp.sqrt(2), v: 0, w: 0}, "the gap at the start"),
                                             ({x: 0, y: 0, v: 1, w: sp.sqrt(2)}, "the rate of the gap at the start")])
def test_an_irrational_start_on_a_rigid_contact_has_no_proof_and_is_told_what_is_rounding(start, what):
    """On a slope of tan(alpha) = sqrt(2) no start but the origin is both in doubles and on the contact."""
    slope = ap.Contact(gap=y - sp.sqrt(2) * x, slip=x + sp.sqrt(2) * y, friction=k, unilateral=True)
    system = (block := ap.Mechanism((x, y), (v, w), sp.eye(2), (0, -1), slope)).rigid()
    scene = ap.Scene(system=system, values={"k": 1}, start=block.start(system, start), until="1/10")
    assert ap.solve(scene).modes != ("open",)
    assert certify(scene).reason.startswith(f"edge: {what} is rounding, which a run takes as 0")


@pytest.mark.parametrize("system", [BLOCK.rigid(), BLOCK.elastic(compliance=mu, damping=1)], ids=["rigid", "elastic"])
@pytest.mark.parametrize("velocity", [0, 1, -1])
def test_a_block_that_slides_on_ground_that_only_pushes_is_proven_down_to_its_rest(system, velocity):
    assert proven_as_followed(block(system, 3, **{"x'": velocity})).modes[-1] == "stick"


def test_a_reaction_that_is_infinite_at_the_critical_friction_has_no_proof_where_the_contact_slides_that_way():
    """For v > 0 the reaction is 1/(2 + k) = 1/4, for v < 0 it is 1/(2 - k)."""
    pair = ap.Mechanism((x, y), (v, w), sp.eye(2), (1, 0), ap.Contact(gap=y - x, slip=x, friction=k, unilateral=True))
    starts = ({"x": 0, "y": 0, "v": speed, "w": speed} for speed in (-1, 1))
    against, along = (certify(ap.Scene(system=pair.rigid(), values={"k": pair.critical_friction}, start=start, until=1))
                      for start in starts)
    assert not against.proven
    assert [float(ball.mid()) for ball in along.final] == [1.125, 1.125, 1.25, 1.25]


@pytest.mark.parametrize("speed", [1, -1])
def test_of_two_motions_of_a_rigid_contact_none_is_proven(speed):
    """y'' = N + 2 F + 1: for v > 0 the contact opens, or slides under N = 1; for v < 0 it opens."""
    ground = ap.Friction(v, F, G, 1, gap=y, normal=G, constraint=G + 2 * F + 1)
    point = ap.System.with_frictions({x: v, y: w, v: F, w: G + 2 * F + 1}, {}, [ground])
    scene = ap.Scene(system=point, start={"x": 0, "y": 0, "v": speed, "w": 0}, until=1)
    if speed < 0:
        proven_as_followed(scene)
        return
    assert certify(scene).reason.endswith("candidates: open, slip_same")
    with pytest.raises(TwoMotions):
        ap.solve(scene)


@pytest.mark.parametrize("friction", [sp.Rational(2, 5), sp.S.Half, sp.Rational(3, 5)])
def test_a_guide_has_no_proof_from_the_friction_on_at_which_a_reaction_of_the_other_sign_is_not_determined(friction):
    """N + 2 F + 1 = 0: for v > 0, N = -1/(1 + 2 k), and (1 - 2 k) N = -1 for N > 0."""
    guide = ap.Friction(v, F, N, friction, normal=N, constraint=N + 2 * F + 1)
    system = ap.System.with_frictions({v: F}, {}, [guide])
    assert certify(ap.Scene(system=system, start={v: 1}, until=1)).proven == (friction < sp.S.Half)


def test_of_two_motions_of_a_body_in_two_guides_none_is_proven():
    """N1 + N2 = 1/2 and 4 (F1 + F2) + N1 + 3 N2 = 0 for v > 0: N1 = 1/6 or N1 = -1/4, N2 the rest of 1/2."""
    pushes = [sp.symbols(f"F{j} N{j}", real=True) for j in (1, 2)]
    (F1, N1), (F2, N2) = pushes
    rates = {v: F1 + F2, w: N1 + N2 - sp.S.Half, y: 4 * (F1 + F2) / 3 + N1 / 3 + N2}
    guides = [ap.Friction(v + 2 * y, force, N, sp.Rational(k, 4), normal=N, constraint=rates[w] + lever * rates[y])
              for (force, N), k, lever in zip(pushes, (5, 1), (sp.S.Half, sp.Rational(3, 2)), strict=True)]
    body = ap.System.with_frictions(rates, {}, guides)
    scene = ap.Scene(system=body, start={"v": 1, "w": 0, "y": 0}, until=1)
    assert certify(scene).reason.endswith("candidates: slip_opposite+slip_same, slip_same+slip_same")
    with pytest.raises(TwoMotions):
        ap.solve(scene)


def test_rest_that_repels_one_of_its_contacts_either_way_has_no_proof():
    frictions = [ap.Friction(v, F, load=1, kinetic=4), ap.Friction(w, G, load=1, kinetic=2, static=3)]
    pair = ap.System.with_frictions({v: 2 * F - 2 * G - t + 1, w: G / 2 - 2 * F - t}, {}, frictions, time=t)
    scene = ap.Scene(system=pair, values={}, start={"v": 0, "w": 0}, until=2)
    assert certify(scene).reason == "edge: after start, contact 2 may rest and may slip in either direction"
    with pytest.raises(TwoMotions):
        ap.solve(scene)


@pytest.mark.parametrize(
    ("rates", "contacts", "start"),
    [
        (
            {v: 4 * F - 2 * G - 2 * H + v + 2, w: G - 2 * F - 2 * H + y - 2, y: 4 * H - F},
            [ap.Friction(v, F, 1, 2), ap.Friction(w, G, 1, 1, sp.Rational(3, 2)), ap.Friction(y, H, 1, 3)],
            {"v": 0, "w": 0, "y": -2},
        ),
        (
            {v: 5 * F - 2 * G + 2, w: F + 2 * G - N - 1, x: y, y: N - F - G - 4},
            [ap.Friction(v, F, N, 1, gap=x, normal=N, constraint=N - F - G - 4), ap.Friction(w, G, 1, 2)],
            {"v": 0, "w": 0, "x": 0, "y": 0},
        ),
    ],
)
def test_a_slip_whose_forces_are_not_determined_is_excluded_where_no_forces_agree_with_it(rates, contacts, start):
    """stick+stick+slip_opposite of blocks has equations without a solution, slip_opposite+stick none with N >= 0."""
    system = ap.System.with_frictions(rates, {}, contacts)
    proven_as_followed(ap.Scene(system=system, values={}, start=start, until=2))


def test_a_slip_whose_forces_are_not_determined_is_not_excluded_where_some_agree_with_it():
    """The forces on the first two blocks have the sum (1 + c) H, which they bear at rest for c = -1 alone."""
    contacts = [ap.Friction(v, F, 1, 2), ap.Friction(w, G, 1, 2), ap.Friction(y, H, 1, 1)]
    system = ap.System.with_frictions({v: F - G + c * H, w: G - F + H, y: H}, {}, contacts)
    scene = ap.Scene(system=system, values={"c": -1}, start={"v": 0, "w": 0, "y": 2}, until=1)
    assert certify(scene).reason == "rest: the forces of stick+stick+slip_same are not determined"
    proven_as_followed(replace(scene, values={"c": "-0.99"}))


def test_after_an_event_a_contact_that_rested_is_not_proven_to_rest_while_another_slips_that_could_rest():
    """Where w = u = 0 either the second contact rests and the third slips, or the reverse; solve follows the latter."""
    first, second, third = sp.symbols("F1:4", real=True)
    contacts = [ap.Friction(v - w, first, 1, 3), ap.Friction(w - y, second, 1, 3, sp.Rational(9, 2)),
                ap.Friction(y, third, 1, 5, 10)]
    rates = {v: first - 2 * second - v, w: (3 * second - third) / 2 - 3, y: first - second + third - 1}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, contacts), start={"v": 2, "w": 0, "y": 2}, until="1/4")
    assert ap.solve(scene).modes[-1] == "slip_same+slip_opposite+stick"
    reason = "candidates: slip_same+slip_opposite+stick, slip_same+stick+slip_opposite"
    assert certify(scene).reason.endswith(reason)


@pytest.mark.parametrize(
    ("force", "load", "waves"),
    [
        (-sp.sqrt(k) * x, 1, 0),
        (-k * x, sp.pi / 3, 0),
        (-x, 1, sp.cos(2 * t + 1)),
        (-x, 1, sp.cos(sp.pi * t) / 2),
        (-x, 1, sp.cos(t + 1) / 2),  # in resonance
        (-sp.sqrt(k) * x, 1, sp.sin(k) * sp.sin(2 * t)),  # also (cos(k - 2 t) - cos(k + 2 t))/2: one frequency
    ],
)
@pytest.mark.few(2)
def test_what_is_not_rational_in_a_coefficient_ranges_over_its_ball(force, load, waves):
    friction = ap.Friction(v, F, load=load, kinetic=sp.Rational(1, 4))
    system = ap.System.with_frictions({x: v, v: force + waves + F}, {}, [friction], time=t)
    values = {"k": "0.7"} if k in system.parameters else {}
    assert proven_as_followed(ap.Scene(system=system, values=values, start={"x": 3, "v": 0}, until=6)).events


@pytest.mark.parametrize("nothing", [sp.sin(k) ** 2 + sp.cos(k) ** 2 - 1, sp.sqrt(k**2 + 2 * k + 1) - k - 1])
def test_rows_that_a_relation_between_functions_makes_equal_span_no_more_than_one_of_them(nothing):
    """v + 0 x = 0 and v = 0 say nothing of x, which is 2."""
    system = ap.System.with_frictions({x: v, v: nothing * x + F}, {}, [ap.Friction(v, F, load=1, kinetic=k)])
    field = ExactEntries(system, (1,) * len(system.parameters), {s.name: (1, 2) for s in system.parameters}, [nothing])
    zero, one, part = map(field.exact, (sp.S.Zero, sp.S.One, nothing))
    assert part  # as a rational function
    null = (part, one, zero), (zero, one, zero)
    state = EnclosedState(field.family([[2], [0], [1]]), (None, None, 1), field, null)
    assert sign_at((one, zero, zero), state) == 1
    assert sign_at((part, one, zero), state) == 0


def test_a_function_without_an_enclosure_is_refused():
    system = ap.System.with_frictions({x: v, v: F - sp.gamma(k) * x}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    scene = ap.Scene(system=system, values={"k": "1/3"}, start={"x": 3, "v": 0}, until=1)
    assert certify(scene).obstacle == "irrational"


def test_a_parameter_that_ranges_over_a_jump_is_refused_by_its_name():
    system = ap.System.with_frictions({x: v, v: F}, {}, [ap.Friction(v, F, load=1, kinetic=2 + sp.sign(c))])
    scene = ap.Scene(system=system, values={"c": 1}, start={"x": 0, "v": 1}, until="1/10")
    assert certify(scene, {"c": (-1, 1)}).reason == (
        "irrational: a function that jumps where c = 0 has no enclosure there")


@pytest.mark.parametrize(
    "kinetic",
    [
        sp.Heaviside(c - 1, 0) / 2, sp.floor(c) / 4, sp.Piecewise((1, c < 1), (c / 4, True)), sp.Mod(c, 1),
        sp.Min(c, 2), sp.floor(sp.floor(c) / 8 + c) / 4, sp.floor(sp.sqrt(c - 1)) + 1,
    ],
)
def test_a_parameter_may_range_beside_a_jump(kinetic):
    system = ap.System.with_frictions({x: v, v: F}, {}, [ap.Friction(v, F, load=1, kinetic=kinetic)])
    scene, box = ap.Scene(system=system, values={"c": "5/4"}, start={"x": 0, "v": 3}, until=1), {"c": ("5/4", "7/4")}
    proof = certify(scene, box)
    assert proven(proof)
    assert all(inside(proof, ap.solve(replace(scene, values={"c": end}))) for end in box["c"])
    assert certify(scene, {"c": ("5/4", "9/4")}).proven == (not kinetic.has(sp.floor, sp.Mod))


def test_a_box_of_frictions_in_resonance_is_proven():
    friction = ap.Friction(v, F, load=1, kinetic=k)
    system = ap.System.with_frictions({x: v, v: sp.cos(t) - x + F}, {}, [friction], time=t)
    scene = ap.Scene(system=system, values={"k": "0.3"}, start={"x": 2, "v": 0}, until=7)
    proof = certify(scene, {"k": ("0.2999", "0.3001")})
    assert proven(proof)
    for near in ("0.2999", "0.30005"):
        assert inside(proof, ap.solve(ap.Scene(system=system, values={"k": near}, start={"x": 2, "v": 0}, until=7)))


def block_under(force, start, until=12, *, kinetic=k, belt=0, load=1):
    """Return a block on a spring with friction, under a force."""
    friction = ap.Friction(v - belt, F, load=load, kinetic=kinetic)
    system = ap.System.with_frictions({x: v, v: -x + force + F}, {}, [friction], time=t)
    return ap.Scene(system=system, values={"k": "0.35"}, start=start, until=until)


SWITCHED = {
    "a stop": block_under(sp.cos(2 * t) - 8 * sp.Max(0, x - sp.Rational(1, 2)), {"x": 2, "v": 0}),
    "a law that jumps": block_under(-sp.sign(x), {"x": 4, "v": 1}, until=5),
    "a patch": block_under(sp.cos(t), {"x": 2, "v": 0}, kinetic=sp.Piecewise((k, x < 1), (2 * k, True))),
    "a load with a kink": block_under(sp.cos(t), {"x": 2, "v": 0}, load=1 + sp.Abs(x) / 2),
    "a pulse that ends with the motion": block_under(sp.Piecewise((3, t < 2), (0, True)), {"x": 0, "v": 0}, until=2),
    "a record": block_under(sp.Piecewise((t, t < 1), (2 - t, t < 3), (t - 4, t < 4), (0, True)), {"x": 1, "v": 0}),
    "a square wave": block_under(2 * sp.sign(sp.sin(3 * t / 2)), {"x": 1, "v": 0}, until=7),
    "a belt that stops": block_under(0, {"x": 0, "v": "0.5"}, belt=sp.Piecewise((1, t < 3), (0, True)) / 2, until=5),
    "a start on an edge": block_under(-3 * sp.Max(0, x), {"x": 0, "v": 1}),
    "steps": block_under(-sp.floor(x) / 2, {"x": "2.25", "v": 0}, until=3),
    "a start up from a step": block_under(-sp.floor(x) / 2, {"x": 2, "v": 1}, until=2),
    "a start down from a step": block_under(-sp.floor(x) / 2, {"x": -2, "v": -1}, until=1),
    "a push at the end, past a stop": block_under(sp.Piecewise((0, t < 2), (3, True)), {"x": 0, "v": "0.3"}, until=2),
    "a push that begins at rest": block_under(sp.Piecewise((0, t < 1), (-2, True)), {"x": 0, "v": 0}, until=2),
    "rest on the edge of a stop": block_under(sp.cos(t) / 4 - 8 * sp.Max(0, x), {"x": 0, "v": 0}, until=4),
    "rest where the load has a kink": block_under(0, {"x": 0, "v": 0}, until=2, load=1 + sp.Abs(x) / 2),
    "rest where the force jumps": block_under(-2 * sp.sign(x), {"x": 0, "v": 0}, until=2),
    "a push off the edge of a stop": block_under(t / 4 - 8 * sp.Max(0, x), {"x": 0, "v": 0}, until=3),
    "a gentler push off the edge": block_under(k + t**3 - sp.Max(0, x), {"x": 0, "v": 0}, until=1),
    "a load with a gap between two times": block_under(0, {"x": 2, "v": 1}, load=1 + sp.Max(0, sp.Abs(t - 2) - 1)),
    "a load that is reversed": block_under(0, {"x": 2, "v": 1}, until=2, load=sp.Piecewise((2, t < 1), (-1, True)) / 2),
}


@pytest.mark.parametrize("name", SWITCHED)
@pytest.mark.few(2)
def test_what_the_state_or_the_time_switches_is_proven_side_by_side(name):
    proven_as_followed(SWITCHED[name])


def test_a_box_of_starts_beside_a_stop_contains_what_its_points_do():
    scene = SWITCHED["a stop"]
    proof = certify(scene, {"x": ("1.999", "2.001"), "k": ("0.3499", "0.3501")})
    assert proven(proof)
    for start, friction in ((1.9992, "0.35005"), (2.001, "0.3499")):
        near = ap.Scene(system=scene.system, values={"k": friction}, start={"x": start, "v": 0}, until=12)
        path = ap.solve(near)
        assert path.modes == proof.modes
        assert inside(proof, path)


@pytest.mark.parametrize(
    ("law", "start"),
    [(1 - 2 * sp.sign(x), 1), (1 + 2 * sp.sign(x), 0), (1 - sp.sign(x), 0), (sp.sign(x), 0), (x / sp.Abs(x), 0)],
)
def test_an_edge_that_both_sides_lead_to_or_away_from_or_one_side_moves_along_has_no_proof(law, start):
    system = ap.System.smooth({x: law}, {}, None)
    assert certify(ap.Scene(system=system, values={}, start={"x": start}, until=2)).obstacle == "edge"


def test_a_step_at_which_the_law_of_the_lower_side_rests_and_its_own_law_leads_down_has_no_proof():
    scene = ap.Scene(system=ap.System.smooth({x: 1 - sp.floor(x)}, {}, None), start={"x": 2}, until=1)
    assert certify(scene).obstacle == "edge"


def test_a_box_at_whose_middle_alone_the_law_of_an_edge_rests_there_has_no_proof():
    """x' = w on the edge itself, and both sides lead back to it."""
    system = ap.System.smooth({x: w - 2 * sp.sign(x), w: 0}, {}, None)
    scene = ap.Scene(system=system, start={x: 0, w: 0}, until=1)
    assert certify(scene).final[0] == 0
    assert certify(scene, {"w": ("-0.1", "0.1")}).obstacle == "edge"


@pytest.mark.parametrize(
    ("push", "load", "speed", "kind"),
    [
        (sp.Piecewise((0, t < 2), (3, True)), 1, 0, "slip_onset"),
        (t, 2, 0, "slip_onset"),
        (0, 2 - t, 9, "force_zero"),
        (0, 2 - t, 0, "force_zero"),
        (0, 1 - t, 0, "force_zero"),  # both edges of stick vanish, in the midst of the motion
    ],
)
def test_what_the_time_alone_brings_about_happens_at_the_very_end_of_the_motion_too(push, load, speed, kind):
    system = ap.System.with_frictions({x: v, v: push + F}, {}, [ap.Friction(v, F, load=load, kinetic=1)], time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={"x": 0, "v": speed}, until=2))
    assert [event.kind for event in proof.events] == [kind]


def until_two(push, start, load=1, friction=1, **contact):
    """Return a scene of a block with friction under a force and a load, which ends at t = 2."""
    rates = {x: v, v: push + F} | ({y: w, w: contact.pop("lift") + N} if contact else {})
    system = ap.System.with_frictions(rates, {}, [ap.Friction(v, F, load=load, kinetic=k, **contact)], time=t)
    return ap.Scene(system=system, values={"k": friction}, start=start, until=2)


def falling(height, velocity, lift):
    """Return a scene of a body above a soft ground."""
    start = {"x": 0, "v": 0, "y": height, "w": velocity}
    return until_two(0, start, load=-9 * y - w, gap=y, normal=N, lift=lift)


def test_irrational_rates_are_enclosed_to_three_hundred_digits_whose_radii_no_double_holds():
    slider = ap.System.with_frictions({v: sp.sin(sp.sqrt(2) * t) + F}, {}, [ap.Friction(v, F, 1, 1)], time=t)
    (final,) = certify(ap.Scene(system=slider, start=[9], until=3), digits=300).final
    with mpmath.workdps(320):
        off = mpmath.mpf(final.mid().str(320, radius=False)) - 6 - (1 - mpmath.cos(3 * mpmath.sqrt(2))) / mpmath.sqrt(2)
        assert abs(off) < mpmath.mpf(10) ** -299


@pytest.mark.parametrize(
    "scene",
    [
        until_two(0, {"x": 0, "v": "2/3"}, friction="1/3"),
        until_two(sp.Piecewise((2, t < 1), (0, True)), {"x": 0, "v": 0}),  # a second mode, from t = 1 on
        until_two(1 - sp.Heaviside(x - 1, 0), {"x": 0, "v": 1}),  # from t = 1 on by the state
        until_two(sp.Piecewise((sp.sqrt(8), t < 1), (0, True)), {"x": 0, "v": 0}, load=sp.sqrt(2)),
        falling(4, -1, -1),
    ],
)
def test_what_the_state_brings_about_at_the_very_end_is_proven_where_it_moves_as_a_polynomial(scene):
    assert proven_as_followed(scene).events[-1].t == 2


def test_what_happens_at_the_very_end_all_over_a_box_is_proven_after_an_event_whose_time_is_the_same_all_over_it():
    proof = certify(until_two(sp.Piecewise((2 * k, t < 1), (0, True)), {"x": 0, "v": 0}), {"k": (1, 2)})
    assert proof.modes == ("slip_same", "stick")
    assert proof.events[-1].t == 2


def test_what_is_a_polynomial_of_the_time_only_at_the_centre_of_a_box_is_none_on_the_box():
    """x = e^(c t) up to the switch, which is 1 in the middle."""
    system = ap.System.smooth({x: c * x + sp.Heaviside(t - 1, 0)}, {}, None, time=t)
    scene = ap.Scene(system=system, values={"c": 0}, start={"x": 1}, until="5/4")
    proof = certify(scene, {"c": (-1, 1)})
    assert proven(proof)
    assert all(inside(proof, ap.solve(replace(scene, values={"c": end}))) for end in (-1, 1))


def test_an_event_whose_guard_is_no_line_is_given_no_exact_time():
    assert proven_as_followed(until_two(0, {"x": 0, "v": 1}, load=1 + t)).modes == ("slip_same", "stick")


def test_at_the_very_end_nothing_is_proven_where_a_guard_vanishes_at_some_points_of_a_box():
    assert certify(until_two(0, {"x": 0, "v": 2}), {"x": (0, 1)}).proven
    assert certify(until_two(0, {"x": 0, "v": 3})).modes == ("slip_same",)
    assert certify(until_two(0, {"x": 0, "v": 2}), {"k": (1, 2)}).obstacle == "grazing"


def test_a_body_that_comes_down_to_its_ground_with_no_speed_at_the_very_end_is_proven_to_stay_open():
    assert proven_as_followed(falling(2, -2, 1)).modes == ("open",)


def test_a_zero_of_a_polynomial_has_its_order_where_the_polynomial_is_positive_before():
    entries = ExactEntries(COULOMB, (1,), {}, [])
    for factors, end, order in [
        (2 - c, 2, 1), ((2 - c) ** 2, 2, 2), ((2 - c) ** 3, 2, 3), ((2 - c) ** 2 * (c - 3) ** 2, 2, 2), (3 - c, 2, 0),
        ((2 - c) ** 2 * (c - 3) ** 2, 3, 0), (-((2 - c) ** 2), 2, 0), ((c - 1) * (2 - c), 2, 0),
    ]:
        coefficients = [Fraction(int(k)) for k in reversed(sp.Poly(factors, c).all_coeffs())]
        assert order_at([*coefficients, Fraction(0)], Fraction(end), entries) == order, factors


@pytest.mark.parametrize(
    ("push", "load", "kinetic", "static", "belt", "start", "events"),
    [
        (0, (t - 1) ** 2, 1, 1, 0, (0, 0), []),
        ((t - 1) ** 2 / 10, ((t - 1) * (t - 3)) ** 2, 1, 1, 0, (0, 0), ["slip_onset", "velocity_zero"]),
        (sp.Rational(1, 10), (2 - t) ** 3, 1, 1, 0, (0, 0), ["slip_onset", "force_zero", "velocity_zero"]),
        (1 - (t - 1) ** 2, 1, 1, 1, 0, (0, 0), ["slip_onset"]),
        (sp.sin(2 * t), 1, 1, 1, 0, (0, 0), []),
        (3 * sp.sin(t) / 5 + 4 * sp.cos(t) / 5, 1, 1, 1, 0, (0, 0), []),
        (-4 * x, 1, k, k, 1, (0, 1), ["slip_onset"]),
        (-x, 1, k, 2 * k, 1, ("9/10", "4/5"), ["velocity_zero", "slip_onset", "velocity_zero"]),
        (-x, 1, k, k, 1, ("9/10", "4/5"), []),
    ],
)
@pytest.mark.few(3)
def test_a_guard_that_touches_0_is_proven_to_rise_again_or_to_end_its_mode(
    push, load, kinetic, static, belt, start, events
):
    """Loads, pushes at the limit of static friction, and a block that takes the speed of its belt for a moment."""
    block = ap.System.with_frictions({x: v, v: push + F}, {}, [ap.Friction(v - belt, F, load, kinetic, static)], time=t)
    values = {"k": "3/10"} if sp.sympify(kinetic).has(k) else {}
    proof = proven_as_followed(ap.Scene(system=block, values=values, start=start, until=13))
    assert [event.kind for event in proof.events][: len(events)] == events


def test_a_load_that_touches_0_twice_is_proven_to_do_so_though_another_block_stops_in_between():
    frictions = [ap.Friction(v, F, ((t - 1) * (t - 2)) ** 2, 1), ap.Friction(w, G, load=1, kinetic=sp.Rational(1, 4))]
    pair = ap.System.with_frictions({v: F, y: w, w: G - y}, {}, frictions, time=t)
    proof = proven_as_followed(ap.Scene(system=pair, start={"v": 0, "y": 0, "w": 2}, until=3))
    assert [event.friction for event in proof.events] == [1]


def test_what_stops_while_a_push_on_another_block_touches_its_limit_is_the_event():
    frictions = [ap.Friction(v, F, load=1, kinetic=1), ap.Friction(w, G, load=1, kinetic=1)]
    pair = ap.System.with_frictions({v: F + t * (2 - t), w: G}, {}, frictions, time=t)
    proof = proven_as_followed(ap.Scene(system=pair, start={"v": 0, "w": 1}, until=2))
    assert [(event.kind, event.friction) for event in proof.events] == [("velocity_zero", 1)]


def test_a_box_is_proven_all_over_which_a_block_touches_the_speed_of_its_belt():
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v - 1, F, load=1, kinetic=k)])
    scene = ap.Scene(system=block, values={"k": "3/10"}, start=(0, 1), until=20)
    proof = certify(scene, {"k": ("1/5", "2/5")})
    assert proof.modes == ("stick", "slip_opposite")
    assert all(inside(proof, ap.solve(replace(scene, values={"k": end}))) for end in ("1/5", "3/10", "2/5"))


@pytest.mark.parametrize(("push", "most"), [
    (3 * sp.sin(t) + 4 * sp.cos(t), 5), (sp.sin(t) + sp.cos(t), sp.sqrt(2)),
    (sp.cos(sp.sqrt(3) * t) + sp.cos(2 * sp.sqrt(3) * t), 2),
])
def test_a_box_is_proven_all_over_which_a_push_in_two_waves_touches_its_limit(push, most):
    pushed = ap.System.with_frictions({v: F + k * push}, {}, [ap.Friction(v, F, load=k, kinetic=most)], time=t)
    proof = certify(ap.Scene(system=pushed, values={"k": 1}, start={"v": 0}, until=3), {"k": (1, 2)})
    assert proven(proof)
    assert proof.modes == ("stick",)


@pytest.mark.parametrize("edge", [
    1 - sp.cos(2 * t + sp.Rational(1, 3)), 1 - sp.sin(sp.sqrt(2) * t), 1 - sp.sin(sp.pi * t / 3),
    (t**2 - 2) ** 2 / 49, (t**2 - 2) ** 2 * (t - 2) ** 2 / 80, (1 - 2 * sp.exp(-t)) ** 2, (1 - sp.sin(t)) ** 2 / 4,
    (1 - sp.sin(t)) * (2 + sp.cos(2 * t)) / 4, sp.exp(-t / 3) * (1 - sp.sin(t)),
    (sp.sqrt(2) - sp.sin(t) - sp.cos(t)) / 2, (sp.sqrt(5) - sp.sqrt(2) * sp.sin(t) - sp.sqrt(3) * sp.cos(t)) / 4,
    (t - sp.cbrt(2)) ** 2 * (t - sp.sqrt(3)) ** 2 / 90,
])
@pytest.mark.parametrize("below", [0, sp.Rational(1, 10**9)])
@pytest.mark.few(4)
def test_a_push_is_proven_to_touch_its_limit_or_to_exceed_it_after_a_stop_at_an_irrational_time(edge, below):
    """The block w stops at 3 log 2; the push on the block v is 1 at a time that is not rational, or a little more."""
    frictions = [ap.Friction(v, F, load=1, kinetic=1), ap.Friction(w, G, load=1, kinetic=sp.Rational(1, 3))]
    pair = ap.System.with_frictions({v: F + 1 - edge + below, w: G - w / 3}, {}, frictions, time=t)
    proof = certify(ap.Scene(system=pair, start={"v": 0, "w": 1}, until=3))
    assert proven(proof)
    assert [event.kind for event in proof.events if event.friction] == ["velocity_zero"]
    begun = [event.t for event in proof.events if event.kind == "slip_onset"]
    assert bool(begun) == bool(below)
    with mpmath.workdps(60):
        assert all(abs(edge.subs(t, sp.Float(time.mid().str(60, radius=False), 60)) - below) < 1e-15 for time in begun)


@pytest.mark.parametrize("push", [
    sp.sin(ROOT * t + sp.Rational(1, 3)) / 2 + sp.sin(2 * ROOT * t + sp.Rational(1, 4)) / 4,
    1 - (1 - sp.sin(ROOT * t + sp.Rational(1, 3))) * (2 + sp.cos(ROOT * t + sp.Rational(1, 5))) / 4 - sp.S(10) ** -12,
])
def test_waves_of_irrational_phases_are_proven_within_a_limit_also_near_it_in_a_moment(push):
    """Their exact zeros would take minutes, and signs prove that there is none."""
    pushed, since = ap.System.with_frictions({v: F + push}, {}, [ap.Friction(v, F, 1, 1)], time=t), process_time()
    proof = certify(ap.Scene(system=pushed, start={"v": 0}, until=2))
    assert proven(proof)
    assert proof.modes == ("stick",)
    assert process_time() - since < 4


def test_signs_that_are_rounding_of_radii_are_sought_in_no_thousands_of_pieces(monkeypatch):
    """With few bits the second slip has no known slope: its pieces shrank to where its radius had no further bits."""
    spent, spend = [], Budget.spend
    monkeypatch.setattr(Budget, "spend", lambda *arguments: spent.append(1) or spend(*arguments))
    push = (1 + sp.S(10) ** -12) * sp.sin(t)
    pushed = ap.System.with_frictions({v: F + push}, {}, [ap.Friction(v, F, load=1, kinetic=1)], time=t)
    proof = certify(ap.Scene(system=pushed, start={"v": 0}, until=6))
    assert proven(proof)
    assert len(proof.events) == 4
    assert len(spent) < 2000


@pytest.mark.parametrize("push", [sp.sin(t * 10**200) / 2, sp.exp(-t * 10**200)])
def test_a_push_is_proven_whose_rate_has_a_square_beyond_doubles(push):
    pushed = ap.System.with_frictions({v: F + push}, {}, [ap.Friction(v, F, load=1, kinetic=1)], time=t)
    proof = certify(ap.Scene(system=pushed, start={"v": 0}, until=3))
    assert proven(proof)
    assert proof.modes == ("stick",)


def test_what_happens_to_one_block_at_the_very_end_is_proven_though_another_stopped_at_an_irrational_time():
    frictions = [ap.Friction(v, F, load=1, kinetic=1), ap.Friction(w, G, load=1, kinetic=sp.Rational(1, 3))]
    pair = ap.System.with_frictions({v: F, w: G - w / 3}, {}, frictions)
    proof = proven_as_followed(ap.Scene(system=pair, start={"v": 3, "w": 1}, until=3))
    assert [event.friction for event in proof.events] == [1, 0]
    assert proof.events[1].t == 3


@pytest.mark.slow
def test_a_guard_that_touches_0_without_end_is_refused_in_a_moment():
    shaken = ap.System.with_frictions({x: v, v: F + sp.sin(t)}, {}, [ap.Friction(v, F, load=1, kinetic=1)], time=t)
    proof = certify(ap.Scene(system=shaken, start=(0, 0), until=10**6))
    assert (proof.obstacle, proof.bits) == ("too many", 96)  # with more bits there are as many


def test_the_time_is_cut_between_events_whose_wide_balls_on_a_box_overlap_at_first():
    frictions = [ap.Friction(v, F, sp.Rational(1, 1000), 1), ap.Friction(w, G, sp.Rational(1, 1000), 1)]
    system = ap.System.with_frictions({v: t - sp.Rational(14, 5) + F, w: G - sp.Rational(8, 5)}, {}, frictions, time=t)
    proof = certify(ap.Scene(system=system, start={"v": "2.6", "w": "3.5"}, until="2.8"), {"v": ("2.08", "3.12")})
    assert proven(proof)
    assert [event.friction for event in proof.events] == [0, 1]


@pytest.mark.parametrize(
    ("scene", "obstacle"),
    [
        (until_two(0, {"x": 0, "v": 9}, load=(t - 1) * (2 * t - 3) * (2 - t)), "horizon"),
        (until_two((t - 1) ** 2, {"x": 0, "v": 0}, load=1 - t, friction=2), "simultaneous"),  # both edges of stick
    ],
)
def test_events_that_cannot_be_told_apart_are_refused_in_few_pieces_with_any_number_of_bits(
        scene, obstacle, monkeypatch):
    count, jet = [], EnclosedSegment.jet
    monkeypatch.setattr(EnclosedSegment, "jet", lambda *given: count.append(1) or jet(*given))
    assert certify(scene).obstacle == obstacle
    assert len(count) < 3000


@pytest.mark.parametrize("until", [2, 3])
@pytest.mark.parametrize(
    ("push", "speed"),
    [(sp.Piecewise((0, t < 2), (3, True)), 2), (sp.Piecewise((t / 2, t < 2), (0, True)), 0)],
)
def test_no_event_is_told_where_a_switch_lets_a_contact_go_on_that_would_stop_or_slip_just_then(push, speed, until):
    scene = until_two(push, {"x": 0, "v": speed})
    assert proven_as_followed(replace(scene, until=until)).events == ()


@pytest.mark.parametrize("until", [2, 3])
@pytest.mark.parametrize(("slope", "load", "speed"), [(0, sp.Piecewise((2 - t, t < 2), (1, True)), 9), (t / 2, 1, 0)])
def test_the_event_at_a_switch_is_of_what_its_new_side_frees_whatever_else_would_happen_just_then(
        slope, load, speed, until):
    pushed, other = ap.Friction(v, F, load=1, kinetic=1), ap.Friction(w, G, load=load, kinetic=1)
    rates = {x: v, v: sp.Piecewise((0, t < 2), (3, True)) + F, w: slope + G}
    system = ap.System.with_frictions(rates, {}, [pushed, other], time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={"x": 0, "v": 0, "w": speed}, until=until))
    assert [(event.kind, event.friction) for event in proof.events] == [("slip_onset", 0)]


def test_the_time_at_which_a_growing_state_meets_an_edge_is_no_straight_line_over_a_box_of_starts():
    """x' = x up to 1, then x' = 1: x(2) is 3 + log(x(0))."""
    scene = ap.Scene(system=ap.System.smooth({x: sp.Min(x, 1)}, {}, None), start={x: "1/2"}, until=2)
    (final,) = certify(scene, {"x": ("0.45", "0.55")}).final
    assert all(final.lower() < 3 + math.log(start) < final.upper() for start in (0.45, 0.55))


def test_a_body_that_rests_on_rigid_ground_is_proven_to_stay_where_its_weight_is_taken_off_for_good():
    weight = sp.Max(0, 1 - t)
    ground = ap.Friction(v, F, load=N, kinetic=1, gap=y, normal=N, constraint=N - weight)
    system = ap.System.with_frictions({x: v, v: F, y: w, w: N - weight}, {}, [ground], time=t)
    assert proven_as_followed(ap.Scene(system=system, start=dict.fromkeys((x, v, y, w), 0), until=2)).events == ()


def test_the_slip_of_a_body_whose_forces_at_rest_are_not_determined_is_that_of_its_first_contact():
    """The two feet bear any shares of the push; the guard that is lost may be that of either."""
    feet = [ap.Friction(v, F, load=1, kinetic=sp.Rational(1, 4)), ap.Friction(v, G, load=1, kinetic=sp.S.Half)]
    system = ap.System.with_frictions({x: v, v: F + G - 4 * t}, {}, feet, time=t)
    for order in (feet, feet[::-1]):
        scene = ap.Scene(system=replace(system, frictions=tuple(order)), start={x: 0, v: 0}, until=1)
        assert [[(e.kind, e.friction) for e in found(scene).events] for found in (certify, ap.solve)] == [
            [("slip_onset", 0)]] * 2


def test_a_load_whose_formula_is_written_otherwise_in_the_rates_hides_no_proof():
    """The friction is (1 - cos(2 c))/(2 + 2 c^2) in the rates."""
    frictions = [ap.Friction(v, F, load=1, kinetic=1), ap.Friction(w, G, load=sp.sin(c) ** 2, kinetic=1 / (1 + c**2))]
    system = ap.System.with_frictions({v: F, w: G + 2 * t}, {}, frictions, time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={c: 1}, start={v: 1, w: 0}, until="0.7"))
    assert proof.modes == ("slip_same+stick", "slip_same+slip_same")


@pytest.mark.parametrize(("push", "mode"), [("3/16", "stick"), ("1/2", "slip_opposite")])
@pytest.mark.few(1)
def test_what_a_body_at_rest_on_two_rigid_feet_does_is_proven_under_a_push_that_the_state_switches(push, mode):
    lift, turn = N + H - 1, 3 * (N - H)
    quarter = sp.Rational(1, 4)
    feet = [ap.Friction(v, F, load=N, kinetic=quarter, gap=y + c, normal=N, constraint=lift + turn),
            ap.Friction(v, G, load=H, kinetic=quarter, gap=y - c, normal=H, constraint=lift - turn)]
    rates = {x: v, v: F + G - sp.Rational(push) * sp.sign(x + 2), y: w, w: lift, c: V, V: turn}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, feet), start=dict.fromkeys(rates, 0), until=2)
    assert proven_as_followed(scene).modes == (f"{mode}+{mode}",)


def test_that_no_forces_agree_with_a_slip_is_seen_on_all_sides_of_a_switch_on_which_the_state_may_lie():
    """Rest of the first two blocks bears no push upon one of them, which falls on one side of x = 0 alone."""
    contacts = [ap.Friction(v, F, 1, 2), ap.Friction(w, G, 1, 2), ap.Friction(y, H, 1, 1)]
    rates = {v: F - G - H + sp.Heaviside(x, 0), w: G - F + H, y: H, x: -1}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, contacts), start={v: 0, w: 0, y: 2, x: 2}, until=1)
    proven_as_followed(scene)
    assert certify(replace(scene, start={v: 0, w: 0, y: 2, x: 0})).obstacle == "rest"


@pytest.mark.parametrize("law", [sp.sign(x - 1), sp.floor(x)])
def test_a_box_of_starts_across_an_edge_has_no_proof(law):
    scene = block_under(-law, {"x": 1, "v": 1}, until=1)
    assert "the side of" in certify(scene, {"x": ("0.9", "1.1")}).reason


@pytest.mark.parametrize(
    "wave", [lambda t: 1 - sp.cos(t), lambda t: 1 + (3 * sp.sin(t) + 4 * sp.cos(t)) / 5,
             lambda t: sp.Rational(9, 8) + sp.cos(t) + sp.cos(2 * t), lambda t: 1 - sp.cos(t) * sp.cos(2 * t)]
)
def test_a_load_of_waves_that_is_nowhere_negative_is_proven_through_the_times_at_which_it_is_0(wave):
    """It was refused as grazing, after many seconds."""
    t, v, q, G = sp.symbols("t v q G", real=True)
    contact = ap.Friction(velocity=v, force=G, load=wave(t), kinetic=sp.Rational(1, 5))
    system = ap.System.with_frictions(slow={q: v, v: G - q}, fast={}, time=t, frictions=(contact,))
    scene = ap.Scene(system=system, start={q: 3, v: 0}, until=15)
    path, found = ap.solve(scene), certify(scene)
    assert found.proven
    assert found.modes == path.modes
    assert [float(ball.mid()) for ball in found.final] == pytest.approx(path.final, abs=1e-8)


def test_waves_of_a_degree_that_takes_long_are_not_told_to_have_one_sign():
    """The product was expanded for a minute, and the sum for many; both took no time before."""
    t = sp.Symbol("t", real=True)
    product = (1 - sp.cos(t)) ** 9 * (2 + sp.cos(12 * t)) ** 5
    total = sum((sp.cos(k * t) + sp.Rational(1, 3)) ** 6 for k in range(1, 13)) - sp.Rational(1, 10**6)
    assert [*map(waves_never_negative, (product, total))] == [False, False]
    assert waves_never_negative((1 - sp.cos(t)) ** 3 * (2 + sp.cos(12 * t)))


def test_waves_that_are_negative_anywhere_are_not_taken_for_nowhere_negative():
    t, a = sp.Symbol("t", real=True), sp.Symbol("a", positive=True)
    close = sp.Rational(1, 10**9)
    nowhere = (1 - sp.cos(t), a - a * sp.cos(3 * t), sp.Rational(9, 8) - sp.sin(7 * t + 1) - sp.cos(14 * t + 2),
               1 + 2 * sp.sin(t) * sp.cos(t), 1 / (2 - sp.cos(t)) - sp.Rational(1, 3))
    somewhere = (1 - close - sp.cos(t), sp.Rational(9, 8) - close + sp.cos(t) + sp.cos(2 * t), sp.cos(t),
                 sp.cos(t) ** 3, 1 / sp.cos(t), -1 - sp.cos(t), 1 - sp.cos(t) / t, sp.exp(sp.cos(t)) - 1,
                 1 + a - sp.cos(t) - 2 * a * sp.sin(t), sp.Piecewise((sp.cos(t), t > 1), (1, True)))
    assert all(waves_never_negative(wave) is True for wave in nowhere)
    assert all(waves_never_negative(wave) is False for wave in somewhere)


@pytest.mark.parametrize(
    "load",
    [sp.Abs(t - 1), sp.Max(0, 1 - t), sp.Piecewise((sp.S.Half, t < 1), (0, True)), k * sp.Max(0, x - 1)],
)
def test_a_contact_whose_load_is_never_negative_slides_on_as_before_where_it_is_0(load):
    assert proven_as_followed(block_under(0, {"x": 0, "v": 3}, until="1.1", load=load)).modes == ("slip_same",)


@pytest.mark.parametrize(("push", "load", "static"), [(3, 2 - t, 3), (t - 1, sp.Max(0, 1 - t), 2)])
def test_a_law_that_switches_with_the_sliding_velocity_leaves_the_mode_certain_where_rest_begins_or_ends(
        push, load, static):
    """At rest on the edge of the law, v = 0, it also slips, or would on the new side of another switch."""
    friction = ap.Friction(v, F, load=load, kinetic=sp.Rational(3, 2), static=static)
    system = ap.System.with_frictions({x: v, v: push + sp.Max(0, v) / 3 + F}, {}, [friction], time=t)
    proof = proven_as_followed(ap.Scene(system=system, start={"x": 0, "v": 0}, until="5/4"))
    assert [event.kind for event in proof.events] == ["slip_onset"]


def test_of_two_motions_of_an_open_contact_away_from_the_sliding_velocity_0_none_is_proven():
    """Where a contact is open, its branch does not tell the sign of its velocity."""
    ground = ap.Friction(v, F, load=-y, kinetic=1, gap=y)
    system = ap.System.with_frictions({y: w, w: -1, v: 2 * sp.sign(v) - 1 + F}, {}, [ground])
    assert certify(ap.Scene(system=system, start={"y": 1, "w": 0, "v": 0}, until=1)).obstacle == "edge"


def test_what_the_time_alone_moves_is_known_exactly_at_a_switch_after_an_event_at_an_unknown_time():
    """The push grows from the bound of the friction at t = 1, with the second derivative only."""
    push = sp.Piecewise((0, t < 1), (1 + (t - 1) ** 2, True))
    frictions = [ap.Friction(v, F, load=1, kinetic=1), ap.Friction(w, G, load=1, kinetic=1)]
    system = ap.System.with_frictions({x: v, v: push + F, y: w, w: -y + G}, {}, frictions, time=t)
    proof = proven_as_followed(ap.Scene(system=system, start={"x": 0, "v": 0, "y": 0, "w": "1/2"}, until=2))
    assert proof.modes == ("stick+slip_same", "stick+stick", "slip_same+stick")


def test_the_guard_of_a_load_that_is_positive_by_its_form_is_lost_where_the_other_sign_is_assumed():
    slipping = Phase(-1, 1)
    (guard, *_) = guards.guards(SWITCHED["a load with a kink"].system, (slipping,))
    assert guard.value == -1 - sp.Abs(x) / 2


@pytest.mark.parametrize("sign", [sp.sign, lambda u: 2 * sp.Heaviside(u) - 1])
@pytest.mark.few(1)
def test_a_belt_that_another_block_turns_is_proven_to_keep_its_speed_until_then(sign):
    frictions = [ap.Friction(v, F, load=1, kinetic=sp.S.Half), ap.Friction(w - sign(v) / 2, G, load=1, kinetic=k)]
    system = ap.System.with_frictions({x: v, y: w, v: 1 + F, w: G - y}, {}, frictions)
    scene = ap.Scene(system=system, values={"k": "1/4"}, start={"x": 0, "y": 0, "v": -1, "w": "-1/2"}, until=3)
    proof = proven_as_followed(scene)
    assert proof.modes[1:3] == ("slip_opposite+slip_same", "slip_same+slip_opposite")
    assert certify(scene, {"k": ("0.2499", "0.2501")}).modes == proof.modes


def test_a_contact_that_jumps_with_the_belt_of_another_that_stops_gives_the_event_its_name():
    """The velocity of the first block vanishes, and at once that of the second one jumps to the other sign."""
    frictions = [ap.Friction(v - 4 * sp.Heaviside(w), F, load=2, kinetic=sp.S.Half, static=sp.Rational(3, 4)),
                 ap.Friction(w - sp.sign(v) / 2, G, load=1, kinetic=1)]
    system = ap.System.with_frictions({v: F + sp.Rational(3, 4), w: G - sp.S.Half}, {}, frictions)
    proof, path = (f(ap.Scene(system=system, start={v: "-1/2", w: "1/8"}, until=1)) for f in (certify, ap.solve))
    assert [(e.kind, e.friction) for e in proof.events] == [(e.kind, e.friction) for e in path.events]


def test_bad_boxes_are_refused_in_one_line():
    scene = ap.Scene(system=COULOMB, values={"k": 1}, start={"x": 3, "v": 0}, until=1)
    with pytest.raises(ValueError, match="no state"):
        certify(scene, {"q": (0, 1)})
    nonlinear = ap.System.smooth({x: v, v: -(x**3)}, {}, None)
    with pytest.raises(ValueError, match="affine"):
        certify(ap.Scene(system=nonlinear, values={}, start={"x": 1, "v": 0}, until=1))


def test_a_block_at_rest_on_the_very_edge_of_its_friction_is_proven_to_stay_there_through_events_of_others():
    G = sp.Symbol("G", real=True)
    frictions = [ap.Friction(v, F, load=1, kinetic=k), ap.Friction(w, G, load=1, kinetic=sp.Rational(1, 8))]
    system = ap.System.with_frictions({x: v, v: F - x / 4, y: w, w: G - y}, {}, frictions)
    scene = ap.Scene(system=system, values={"k": "1/2"}, start={"x": 2, "v": 0, "y": 1, "w": 0}, until=20)
    proof = certify(scene)
    assert proven(proof)
    assert proof.modes == ap.solve(scene).modes
    assert len(proof.events) == 4
    assert (proof.final[0] - 2, proof.final[1]) == (0, 0)


def test_friction_that_holds_exactly_at_its_limit_for_ever_is_refused():
    # on the belt the load x is just what is needed to hold the block: it may stick, as solve says, and it may slip
    belt = ap.System.with_frictions(
        {x: v, v: F - x}, {}, [ap.Friction(velocity=v - 1, force=F, load=x, kinetic=k, static=1)]
    )
    scene = ap.Scene(system=belt, values={"k": "0.8"}, start={"x": 0, "v": 1}, until=3)
    reason = "edge: after start, equality holds in a condition on the parameters of stick, which may slip as well"
    assert certify(scene).reason == certify(scene, {"k": ("0.8", "0.81")}).reason == reason
    assert ap.solve(scene).modes == ("stick",)


@pytest.mark.parametrize("box", [(), ("--box", "x", "2.2", "2.3")])
def test_the_command_tells_a_proof_of_a_system_by_the_names_of_its_states(box, tmp_path, capsys):
    file = tmp_path / "block.toml"
    numbers = """
[values]
k = 0.35
[start]
x = 2.25
v = 1
"""
    file.write_text(f"until = 3\n{spring_block('k')}{numbers}")
    assert main(["certify", str(file), *box]) == 0
    told = capsys.readouterr().out
    assert re.search(r"\n +t +x +v  event -> mode\n *[\d.]+ +[\d.]+ +[\d.]+  velocity_zero -> ", told)
    assert re.search(r"  final\n    x = \[.*\]\n    v = \[.*\]\n$", told)
    assert main(["certify", str(file), "--box", "v", "-1", "1", "--pieces", "4"]) in (0, 1)
    assert re.search(r"proven pieces\n    x = \[.*\]\n    v = \[.*\]\n(?:more .*\n)?$", capsys.readouterr().out)


V, W, A, B, C = sp.symbols("V W A B C", real=True)


def test_what_the_reversal_of_one_friction_lets_go_of_another_is_proven():
    """A block stops on its way up a spring; its friction turns, and the block on it, which rested there, slips."""
    low = ap.Friction(velocity=V, force=A, load=1, kinetic=2)
    high = ap.Friction(velocity=W - V, force=B, load=1, kinetic=1)
    pair = ap.System.with_frictions({x: V, V: -x + A - B, W: B - sp.Rational(5, 2)}, {}, [low, high])
    scene = ap.Scene(system=pair, values={}, start={"x": "1.4", "V": "0.75", "W": "0.75"}, until="0.4")
    assert proven_as_followed(scene).modes == ("slip_same+stick", "slip_opposite+slip_opposite")


def pair_with_three_frictions(push=0):
    """Return a block on a block, where the lower block also rubs on the ground and the upper on a wall."""
    laws = ((V, A, 1), (W, B, 1), (V - W, C, sp.Rational(1, 2)))
    frictions = [ap.Friction(velocity=rate, force=force, load=1, kinetic=bound) for rate, force, bound in laws]
    return ap.System.with_frictions({V: A + C + push, W: B - C}, {}, frictions, time=t)


def held_by(first, second, push):
    """Return a block that two contacts with two loads hold or brake."""
    frictions = [ap.Friction(v, force, load=load, kinetic=k) for force, load in ((F, first), (G, second))]
    return ap.System.with_frictions({x: v, v: F + G + push}, {}, frictions, time=t)


def held_by_many(count):
    """Return a block that is pushed and that many contacts hold."""
    forces = sp.symbols(f"H1:{count + 1}", real=True)
    frictions = [ap.Friction(v, force, load=1, kinetic=sp.Rational(1, 2)) for force in forces]
    return ap.System.with_frictions({v: sum(forces) + 2 * t - 1}, {}, frictions, time=t)


RESTS = {
    "more contacts than equations": (pair_with_three_frictions(), {V: "1/2", W: 0}),
    "all of them at rest": (pair_with_three_frictions(), {V: 0, W: 0}),
    "stopped together": (pair_with_three_frictions(), {V: "1/2", W: "1/2"}),
    "pushed off": (pair_with_three_frictions(2 * sp.sin(t)), {V: 0, W: 0}),
    "two walls of a groove": (held_by(1, 2, 2 * sp.sin(t)), {x: 0, v: 0}),
    "three contacts of one block": (held_by_many(3), {v: 0}),
    "a load that turns over": (held_by(1 - t, 3, 1), {x: 0, v: 0}),
    "a grasp that loosens": (held_by(2 - t, 2 - t / 2, -1), {x: 0, v: 0}),
}


@pytest.mark.parametrize("name", RESTS)
@pytest.mark.few(1)
def test_rest_on_contacts_whose_forces_are_not_determined_is_proven_for_as_long_as_some_forces_hold_it(name):
    system, start = RESTS[name]
    values = {s.name: "1/2" for s in system.parameters}
    proven_as_followed(ap.Scene(system=system, values=values, start=start, until="7/4"))


def test_a_box_of_frictions_is_proven_to_hold_and_to_let_go():
    system, start = RESTS["a grasp that loosens"]
    scene = ap.Scene(system=system, values={"k": "1/2"}, start=start, until="7/4")
    proof = certify(scene, {"k": ("0.5", "0.51")})
    assert proven(proof)
    assert proof.modes == ("stick+stick", "slip_opposite+slip_opposite")
    for friction in ("0.5", "0.507", "0.51"):
        assert inside(proof, ap.solve(ap.Scene(system=system, values={"k": friction}, start=start, until="7/4")))


@pytest.mark.parametrize("time", [None, t])
def test_a_box_of_pushes_that_two_contacts_bear_at_some_points_only_has_no_proof_of_rest(time):
    """Together they hold 2: a margin of uncertain sign leaves their rest undecided."""
    frictions = [ap.Friction(v, force, load=1, kinetic=1) for force in (F, G)]
    scene = ap.Scene(system=ap.System.with_frictions({x: v, v: F + G + w, w: 0}, {}, frictions, time=time),
                     start={x: 0, v: 0, w: 0}, until=1)
    assert certify(scene, {"w": ("1.8", "1.9")}).modes == ("stick+stick",)
    assert certify(scene, {"w": ("1.9", "2.1")}).obstacle == "edge"


@pytest.mark.parametrize("time", [None, t])
@pytest.mark.parametrize(("rates", "velocities", "start", "until"), [
    ({x: v, v: F + G + 3}, (v, v), (0, 0), 1),  # both contacts together hold 2
    ({x: v, v: F + G - x}, (v, v), (5, 0), 7),  # it turns at 5 and -1, and rests there
    ({x: -F, y: -x}, (y,), (1, 0), 5),  # the force does not enter the rate of the velocity, which moves
])
@pytest.mark.few(2)
def test_a_system_that_does_not_depend_on_the_time_is_not_proven_to_rest_unless_forces_hold_all_of_it(
    rates, velocities, start, until, time
):
    frictions = [ap.Friction(velocity, force, 1, 1) for velocity, force in zip(velocities, (F, G), strict=False)]
    system = ap.System.with_frictions(rates, {}, frictions, time=time)
    proven_as_followed(ap.Scene(system=system, start=start, until=until))


def test_blocks_that_stop_where_a_load_steps_or_a_belt_jumps_are_proven():
    """At t = 1 both stop, as the load of one steps and the belt of the other jumps; this one has its speed at t = 2."""
    steps = sp.Piecewise((2, t < 1), (sp.Rational(3, 2), True)), sp.Piecewise((0, t < 1), (1, t < 2), (0, True))
    frictions = [ap.Friction(v, F, load=steps[0], kinetic=1), ap.Friction(w - steps[1], G, load=1, kinetic=1)]
    blocks = ap.System.with_frictions({v: 1 + F, w: G}, {}, frictions, time=t)
    scene = ap.Scene(system=blocks, start={"v": 1, "w": 1}, until=4)
    proof, path = certify(scene), ap.solve(scene)
    assert proof.modes == path.modes == ("slip_same+slip_same", "stick+slip_opposite", "stick+slip_same", "stick+stick")
    assert [(event.kind, event.friction) for event in proof.events] == [
        (event.kind, event.friction) for event in path.events]
    assert [float(event.t.mid()) for event in proof.events] == [1, 2, 3]


def test_contacts_on_a_belt_that_gets_faster_do_not_rest():
    frictions = [ap.Friction(v - t / 4, force, load=1, kinetic=k) for force in (F, G)]
    carried = ap.System.with_frictions({x: v, v: F + G}, {}, frictions, time=t)
    scene = ap.Scene(system=carried, values={"k": "1/2"}, start={"x": 0, "v": 0}, until=1)
    assert "stick+stick" not in certify(scene).reason


def test_a_slide_is_proven_whose_two_contacts_would_have_other_reactions_under_other_loads():
    q, rates = sp.symbols("p r x y"), sp.symbols("p' r' x' y'")
    mass = sp.Matrix([[1, 0, 0, -1], [0, 1, 0, 1], [0, 0, 2, -3], [-1, 1, -3, 7]])
    guides = [ap.Contact(gap=q[k], slip=rates[2 + k], friction=1 + 2 * k) for k in (0, 1)]
    system = ap.Mechanism(q, rates, mass, (0, -1, 2, -3), guides[0], others=guides[1:]).rigid()
    start = dict(zip(system.states, (0, 0, 0, 0, 0, 0, 1, -1), strict=True))
    scene = ap.Scene(system=system, start=start, until="1/100")
    proof, path = certify(scene), ap.solve(scene)
    assert proof.modes == path.modes == ("slip_opposite+slip_opposite",)
    assert [*map(float, path.final)] == pytest.approx([float(value.mid()) for value in proof.final], abs=1e-14)


@pytest.mark.parametrize(("speed", "reason"), [(0, ""), (1, "slip_same+slip_same+slip_same are not determined")])
def test_a_body_on_three_rigid_feet_is_proven_to_rest_and_has_no_proof_where_it_slides(speed, reason):
    sides, forces, loads, turn = (-1, 0, 1), *(sp.symbols(f"{name}1:4", real=True) for name in "FN"), V
    rates = {v: sum(forces) + sp.Rational(1, 8), w: sum(loads) - 1, turn: loads[2] - loads[0]}
    feet = [ap.Friction(v, force, load, sp.Rational(1, 4), gap=y + side * x, normal=load,
                        constraint=rates[w] + side * rates[turn])
            for side, force, load in zip(sides, forces, loads, strict=True)]
    body = ap.System.with_frictions({**rates, y: w, x: turn}, {}, feet)
    proof = certify(ap.Scene(system=body, start={"v": speed, "w": 0, "V": 0, "y": 0, "x": 0}, until=1))
    assert (proof.proven, proof.reason.removeprefix("rest: the forces of ")) == (not reason, reason)
    assert proof.modes == ("stick+stick+stick",) * proof.proven


def test_a_force_that_rest_leaves_free_and_that_moves_another_body_is_not_proven_to_be_at_its_bound():
    """F2 holds x, and F1 may be anything between -3 and 3."""
    contacts = [ap.Friction(3 * x, F, 2, sp.Rational(3, 2)), ap.Friction(x, G, 1, 1)]
    system = ap.System.with_frictions({x: G - w + 2, w: 5 - F}, {}, contacts)
    scene = ap.Scene(system=system, start={"x": 0, "w": 1}, until=1)
    assert re.search("forces of .* are not determined", certify(scene).reason)
    with pytest.raises(UnboundedReaction):
        ap.solve(scene)


def test_a_force_that_rest_leaves_free_and_that_moves_another_body_is_not_chosen_so_that_this_rests():
    """Any F and G with 7 F + 2 G = 3 w + 2 and bounds 1 and 5/4 hold x: w' = 0 is one of them, w' = -3/2 another."""
    contacts = [ap.Friction(x, F, 2, sp.Rational(1, 2)), ap.Friction(x, G, 1, sp.Rational(5, 4))]
    rates = {x: (7 * F + 2 * G - 3 * w - 2) / 4, w: -(3 * G + 3) / 2}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, contacts), start={"x": 0, "w": "1/2"}, until=1)
    assert re.search("forces of .* are not determined", certify(scene).reason)
    with pytest.raises(UnboundedReaction, match="forces of contacts are not determined at t = 0"):
        ap.solve(scene)


def test_rest_on_very_many_contacts_is_refused_before_all_corners_are_tried():
    found = certify(ap.Scene(system=held_by_many(7), values={}, start={"v": 0}, until=1))
    assert found.reason.startswith("rest: the forces of ")
    assert found.reason.endswith("have more than 200 corners")


@pytest.mark.parametrize("damping", ["1.000001", "1.000000000001"])
def test_a_nearly_critical_damping_hides_no_sign(damping):
    """The weights of its two rates are as large as the rates are close, and cancel."""
    block = ap.System.with_frictions({x: v, v: -x - 2 * k * v + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    scene = ap.Scene(system=block, values={"k": damping}, start={"x": 9, "v": 0}, until=20)
    assert proven_as_followed(scene).bits < 200


def test_a_guard_is_enclosed_over_an_interval_of_time_though_the_weights_of_two_close_rates_cancel():
    """Of x'' = -x - 2 x' + 1 from x = 9 at rest is -x' = 8 t e^-t; the rates differ by 3e-6."""
    damped = ap.System.with_frictions({x: v, v: -x - 2 * k * v + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    modes = _Modes(damped, (1 + Fraction(1, 10**12),), {}, 1)
    state = modes.begun([Fraction(9), Fraction(0)])
    mode, (guard,) = modes.chosen([[(phase,) for phase in branches.all_phases(damped, 0)]], state, "start")
    value, slope = EnclosedSegment(mode, state).jet(guard, hull(Fraction(7, 10), Fraction(13, 10)), 1)
    assert (float(value.rad()) < 0.2, float(slope.rad()) < 1.3) == (True, True)
    for time in (0.7, 0.9, 1.0, 1.2, 1.3):
        assert value.contains(8 * time * math.exp(-time))
        assert slope.contains(8 * (1 - time) * math.exp(-time))


def test_a_box_in_which_a_block_may_stick_and_may_slip_has_no_proof():
    """With the drive x a block at rest may slip above 1, and need not stick above 2."""
    driven = ap.System.with_frictions({x: 0, v: x + F}, {}, [ap.Friction(v, F, load=1, kinetic=1, static=2)])
    scene = ap.Scene(system=driven, values={}, start={"x": 2, "v": 0}, until=1)
    assert certify(scene, {"x": ("1.9", "2.1")}).obstacle == "edge"
    assert [certify(scene, {"x": ends}).modes for ends in (("1.9", "1.99"), ("2.01", "2.1"))] == [
        ("stick",), ("slip_same",)]


@pytest.mark.slow
def test_a_mode_that_lasts_for_thousands_of_near_events_is_proven():
    """The drive of two incommensurable waves comes again and again within 1e-5 of what friction holds."""
    drive = sp.sin(t) + (1 + sp.Rational(1, 10**5)) * sp.cos(sp.sqrt(2) * t)
    block = ap.System.with_frictions({v: drive + F}, {}, [ap.Friction(v, F, load=1, kinetic=2)], time=t)
    proof = proven_as_followed(ap.Scene(system=block, values={}, start={"v": 0}, until=2000))
    assert (proof.modes[0], len(proof.modes)) == ("stick", 5)


def test_two_blocks_under_one_load_are_proven_past_the_time_at_which_it_vanishes():
    frictions = [ap.Friction(velocity, force, load=x, kinetic=k) for velocity, force in ((v, F), (w, G))]
    blocks = ap.System.with_frictions({x: y, y: -x, v: 1 + F, w: G - 1}, {}, frictions)
    start = {"x": 1, "y": 0, "v": 9, "w": -7}
    proof = proven_as_followed(ap.Scene(system=blocks, values={"k": "1/2"}, start=start, until=5))
    assert [event.kind for event in proof.events] == ["force_zero", "force_zero"]


def test_a_contact_off_which_the_force_of_another_takes_load_is_proven_to_slide_back():
    # the load 2 + G = 1 leaves -1/2 of the pull 3/2: from the stop at t = 2/5 on the block is driven back
    contacts = [ap.Friction(v, F, 2 + G, 1), ap.Friction(w, G, 1, 1)]
    system = ap.System.with_frictions({x: v, v: F - sp.Rational(3, 2), y: w, w: G}, {}, contacts)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={x: 0, v: 1, y: 0, w: 3}, until=1))
    assert proof.modes == ("slip_same+slip_same", "slip_opposite+slip_same")


def pair_of_blocks(pulls, second):
    """Return two blocks under pulls and the same friction, which start at rest at 3 and at ``second``."""
    frictions = [ap.Friction(velocity, force, load=1, kinetic=k) for velocity, force in ((v, F), (w, G))]
    system = ap.System.with_frictions({x: v, y: w, v: pulls[0] + F, w: pulls[1] + G}, {}, frictions)
    return ap.Scene(system=system, values={"k": "9/20"}, start={"x": 3, "v": 0, "y": second, "w": 0}, until=7)


def test_two_blocks_that_happen_to_stop_together_are_refused_as_simultaneous_in_a_moment():
    """Each has its own spring; one stops at pi, the other at pi/2 and at pi."""
    found = certify(pair_of_blocks((-x, -4 * y), 3))
    assert found.reason.startswith("simultaneous: velocity_zero and velocity_zero within the radius, 1.57079")


@pytest.mark.parametrize("second", [3, -3])
@pytest.mark.few(0)
def test_two_blocks_that_always_stop_together_by_their_symmetry_are_proven(second):
    scene = pair_of_blocks((y - 2 * x, x - 2 * y), second)
    assert len(proven_as_followed(scene).events) >= 2
    proof = certify(scene, {"k": ("0.45", "0.451")})
    assert proven(proof)
    for friction in ("0.45", "0.4507"):
        near = ap.Scene(system=scene.system, values={"k": friction}, start=scene.start, until=7)
        assert ap.solve(near).modes == proof.modes
        assert inside(proof, ap.solve(near))


def test_twins_whose_starts_range_apart_are_not_taken_for_twins():
    scene = pair_of_blocks((y - 2 * x, x - 2 * y), 3)
    assert certify(scene, {"x": ("2.999", "3.001")}).obstacle == "simultaneous"


def test_eigenvalues_are_enclosed_of_the_modes_that_follow_alone(monkeypatch):
    made, spectrum = [], ExactEntries.spectrum
    monkeypatch.setattr(ExactEntries, "spectrum", lambda *given: made.append(1) or spectrum(*given))
    proof = certify(SWITCHED["a stop"], {"k": ("0.3499", "0.3501")})
    assert proven(proof)
    assert 1 < len(made) <= len(proof.modes)


def test_of_all_modes_of_a_chain_only_those_are_tried_that_the_signs_of_its_velocities_allow():
    """All choices of signs are 6**4."""
    places, rates, forces = (sp.symbols(f"{name}1:5", real=True) for name in ("p", "r", "H"))
    pulls = [before - 2 * p + after for before, p, after in zip((0, *places), places, (*places[1:], 0), strict=False)]
    slow = {**dict(zip(places, rates, strict=True)),
            **{r: pull + force for r, pull, force in zip(rates, pulls, forces, strict=True)}}
    frictions = [ap.Friction(r, force, load=1, kinetic=1) for r, force in zip(rates, forces, strict=True)]
    system, start = ap.System.with_frictions(slow, {}, frictions), [1, 0, -1, 2, 1, "1/2", -2, -1]
    scene = ap.Scene(system=system, values={}, start=start, until=5)
    proof, path = certify(scene), ap.solve(scene)
    assert proven(proof)
    assert proof.modes == path.modes
    assert inside(proof, path)


def blocks_in_line(many, stacked=False):
    """Return blocks at rest that springs join, or that lie on one another, of which cos t moves the last."""
    places, rates, forces = (sp.symbols(f"{name}1:{many + 1}", real=True) for name in ("p", "r", "H"))
    pulls = [before - 2 * p + after for before, p, after in zip((0, *places), places, (*places[1:], 0), strict=False)]
    if stacked:
        pulls = [-H for H in (*forces[1:], 0)]
    pulls[-1] += 2 * sp.cos(t)
    slow = {**dict(zip(places, rates, strict=True)), **{r: a + H for r, a, H in zip(rates, pulls, forces, strict=True)}}
    slips = [r - (before if stacked else 0) for before, r in zip((0, *rates), rates, strict=False)]
    loads = range(many, 0, -1) if stacked else [1] * many
    contacts = [ap.Friction(*contact, kinetic=sp.Rational(1, 2)) for contact in zip(slips, forces, loads, strict=True)]
    system = ap.System.with_frictions(slow, {}, contacts, time=t)
    return ap.Scene(system=system, start=dict.fromkeys(map(str, (*places, *rates)), 0), until=2)


@pytest.mark.parametrize("stacked", [False, True])
def test_of_blocks_at_rest_only_modes_are_tried_that_no_guard_of_coupled_contacts_excludes(stacked):
    """All choices of phases are 3**8; those of blocks that lie on one another are coupled (Lemmas 12 and 19)."""
    scene = blocks_in_line(8, stacked)
    proof, path = certify(scene), ap.solve(scene)
    assert proven(proof)
    assert proof.modes == path.modes
    assert inside(proof, path)


def test_blocks_whose_friction_is_all_used_up_at_the_same_times_are_proven_to_rest():
    """cos t is 1 - t^2/2 + .. at the start, and -1 + .. at pi: beside rest each way of slip is to be excluded."""
    rates, forces = (sp.symbols(f"{name}1:8", real=True) for name in ("r", "H"))
    contacts = [ap.Friction(r, H, load=1, kinetic=1) for r, H in zip(rates, forces, strict=True)]
    slow = {r: sp.cos(t) + H for r, H in zip(rates, forces, strict=True)}
    system = ap.System.with_frictions(slow, {}, contacts, time=t)
    assert proven(certify(ap.Scene(system=system, start=dict.fromkeys(map(str, rates), 0), until=4)))


def test_choices_of_phases_that_guards_exclude_do_not_count_as_many(monkeypatch):
    """Of more than the limit none was excluded: seven blocks with static friction, 3**7 choices, were refused."""
    for module in ("affine", "candidates"):
        monkeypatch.setattr(f"asympk.certify.{module}.MOST_CANDIDATES", 3)
    scene = blocks_in_line(3, stacked=True)
    system = replace(scene.system, frictions=[replace(f, static=1) for f in scene.system.frictions])
    found = certify(ap.Scene(system=system, start=dict(zip(scene.names, scene.start, strict=True)), until=1))
    assert proven(found)


def test_a_load_that_jumps_below_0_when_two_blocks_stop_together_changes_its_sign_in_the_proof():
    """The guard of the load, not of the two, turned negative while their phases were sought: a KeyError."""
    contacts = [ap.Friction(v, F, 1, sp.S.Half), ap.Friction(w, G, 1, sp.S.Half),
                ap.Friction(c, H, sp.Rational(1, 4) - (F + G) / 2, sp.Rational(1, 4))]
    system = ap.System.with_frictions({x: v, y: w, v: y - 2 * x + F, w: x - 2 * y + G, c: H}, {}, contacts)
    start = {x: 0, y: 0, v: Fraction(3, 4), w: Fraction(3, 4), c: 5}
    proof = proven_as_followed(ap.Scene(system=system, start=start, until=1))
    assert proof.modes == ("slip_same+slip_same+slip_same", "stick+stick+slip_opposite")


def test_too_many_choices_of_phases_are_refused_by_name():
    """Where static friction exceeds kinetic friction, coupled contacts may have several motions (Lemma 19)."""
    scene = blocks_in_line(10, stacked=True)
    contacts = [replace(f, static=1) for f in scene.system.frictions]
    system = replace(scene.system, frictions=contacts)
    found = certify(ap.Scene(system=system, start=dict(zip(scene.names, scene.start, strict=True)), until=2))
    assert found.obstacle == "candidates"


SLOPE = """coordinates = ["X", "Y"]
lagrangian = "m*(X'^2 + Y'^2)/2 - m*g*Y"
gap = "Y - a*X"
slip = "X + a*Y"
friction = "f"
unilateral = true
until = 0.5
compliance = "c"
damping = "h"
values = {m = 1, g = 1, f = 0.3, c = 1e-2, h = 1, a = 0.1}
state = {X = 1, Y = 0.1, "X'" = 1, "Y'" = 0.1}
"""


def test_nothing_ranges_from_which_the_reaction_of_a_start_in_coordinates_follows(tmp_path):
    fallen = FALLING_BALL.replace("Y = 1,", "Y = 0,")
    for text, name, ends in ((FALLING_BALL, "eps", ("0.05", "0.1")), (FALLING_BALL, "Y", ("0.9", "1.1")),
                             (SLOPE, "a", ("0.1", "0.11")), (fallen, "Y", (0, "0.1"))):
        (tmp_path / "ball.toml").write_text(text)
        with pytest.raises(InputError, match=f"the reaction or .* of the start follows from {name}; let others"):
            cover(ap.read_scene(tmp_path / "ball.toml"), {name: ends})
    on_ground = certify(ap.read_scene(tmp_path / "ball.toml"), {"f": ("0.3", "0.4"), "X": (0, 1)})
    assert proven(on_ground)
    assert on_ground.modes == ("slip_same",)
    (tmp_path / "ball.toml").write_text(FALLING_BALL)
    scene = ap.read_scene(tmp_path / "ball.toml")
    path = ap.solve(turned(scene, {"f": "0.35"}, {"X": "1/2"}, None))
    proof = certify(scene, {"f": ("0.3", "0.4"), "X": (0, 1)})
    assert proven(proof)
    assert proof.modes == path.modes
    assert inside(proof, path)


def test_the_velocity_of_a_belt_may_range_where_no_sliding_velocity_is_a_state_as_with_a_further_contact(tmp_path):
    belt = SLOPE.replace("Y - a*X", "Y").replace("X + a*Y", "X' - a")
    belt = belt.replace("X = 1, Y = 0.1, \"X'\" = 1, \"Y'\" = 0.1", "X = 1, Y = 0, \"X'\" = 0, \"Y'\" = 0")
    (tmp_path / "belt.toml").write_text(f"{belt}others = [{{gap = 'X - 1', slip = 'Y', friction = 0}}]\n")
    scene = ap.read_scene(tmp_path / "belt.toml")
    proof = certify(scene, {"a": ("0.1", "0.2")})
    assert proven(proof)
    assert inside(proof, ap.solve(turned(scene, {"a": "0.15"}, {}, None)))


@pytest.mark.parametrize(("text", "name", "ends"), [(FALLING_BALL, "f", ("0.299", "0.301")),
                                                    (SLOPE, "c", ("0.01", "0.0101"))])
def test_the_proof_of_a_box_holds_what_the_file_does_with_other_numbers(tmp_path, text, name, ends):
    (tmp_path / "own.toml").write_text(text)
    proof = certify(ap.read_scene(tmp_path / "own.toml"), {name: ends})
    assert proven(proof)
    assert all(inside(proof, ap.solve(changed_scene(str(tmp_path / "own.toml"), {name: end})[0])) for end in ends)


def test_contacts_of_one_velocity_are_proven_where_the_belt_of_one_switches():
    belt = sp.Piecewise((1, t < 1), (0, True))
    on_a_belt = ap.Friction(v - belt, F, load=1, kinetic=sp.Rational(3, 2), static=2)
    on_ground = ap.Friction(v, G, load=2 + x / 4, kinetic=sp.Rational(1, 2))
    system = ap.System.with_frictions({x: v, v: F + G}, {}, [on_a_belt, on_ground], time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={"x": "-1/4", "v": 0}, until=3))
    assert proof.modes[0] == "slip_opposite+slip_same"


def test_a_motion_that_two_signs_of_a_force_tell_alike_is_proven_under_the_name_of_the_run():
    without_load = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v + 1, F, load=x, kinetic=1)])
    proven_as_followed(ap.Scene(system=without_load, values={}, start={"x": 0, "v": 0}, until=3))
    # the first foot holds what the second does not, whatever the sign of that; y pushes nothing
    feet = [ap.Friction(v, F, load=1, kinetic=1, static=2), ap.Friction(v, G, load=x, kinetic=1)]
    system = ap.System.with_frictions({x: v, v: F + G - x, y: w, w: H - y}, {}, [*feet, ap.Friction(w, H, 1, 1)])
    proven_as_followed(ap.Scene(system=system, values={}, start={"x": 1, "v": -1, "y": 2, "w": 0}, until=1))


def test_feet_that_share_their_friction_beside_a_body_that_moves_slip_once_both_have_all_they_can_bear():
    feet = [ap.Friction(v, F, load=1, kinetic=1), ap.Friction(v, G, load=1, kinetic=sp.Rational(1, 2))]
    beside = ap.Friction(w, H, load=1, kinetic=1)
    system = ap.System.with_frictions({x: v, v: F + G - t, y: w, w: H - y}, {}, [*feet, beside], time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={"x": 0, "v": 0, "y": 2, "w": 0}, until=2))
    assert [event.kind for event in proof.events] == ["slip_onset"]
    assert proof.events[0].t.overlaps(hull(Fraction(3, 2), Fraction(3, 2)))


def test_feet_on_belts_that_run_alike_on_these_sides_only_rest_by_static_friction_in_runs_and_proofs():
    on_belts = [ap.Friction(v - sp.Piecewise((-1, x < 0), (1, True)), F, load=1, kinetic=sp.S.Half),
                ap.Friction(v - sp.Piecewise((-1, t < 1), (0, True)), G, load=x - 1, kinetic=1, static=3 * sp.S.Half)]
    system = ap.System.with_frictions({x: v, v: F + G - t - x + 2}, {}, on_belts, time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={"x": "-3/2", "v": -1}, until="0.9"))
    assert not proof.events  # of 7/2 the first can bear 1/2, and the second 15/4 or more
    assert proof.final[1] == -1


@pytest.mark.parametrize("held", [True, False])
def test_a_belt_that_takes_the_speed_of_its_block_at_a_switch_is_proven_to_end_the_slip(held):
    belt, foot = sp.Piecewise((2, t < 1), (0, True)), ap.Friction(v, G, load=1, kinetic=1)
    contacts = [ap.Friction(v - belt, F, load=1, kinetic=sp.S.Half, static=sp.S.Half if held else 1), *[foot] * held]
    system = ap.System.with_frictions({x: v, v: F + (G if held else -sp.Rational(3, 4))}, {}, contacts, time=t)
    start = {"x": 0, "v": 0 if held else "1/4"}
    proof = proven_as_followed(ap.Scene(system=system, values={}, start=start, until=2))
    assert [(event.kind, event.friction) for event in proof.events] == [("velocity_zero", 0)]


@pytest.mark.parametrize("belt", [sp.Max(1 - t, 0), *(sp.Piecewise((1, on < 1), (0, True)) for on in (t, y))])
def test_a_foot_stops_where_its_belt_does_though_its_velocity_is_from_then_on_that_of_a_foot_at_rest(belt):
    feet = [ap.Friction(v, F, load=2, kinetic=1), ap.Friction(v - belt, G, load=1, kinetic=1)]
    system = ap.System.with_frictions({x: v, v: F + G, y: 1}, {}, feet, time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={"x": 0, "v": 0, "y": 0}, until=2))
    assert [(event.kind, event.friction) for event in proof.events] == [("velocity_zero", 1)]
    assert proof.modes[-1] == "stick+stick"


def test_feet_that_share_their_friction_are_proven_where_the_drive_switches_beside_a_body_that_moves():
    feet = [ap.Friction(v, F, load=2, kinetic=sp.Rational(1, 4)), ap.Friction(v, G, load=1, kinetic=1)]
    beside, drive = ap.Friction(w, H, load=1, kinetic=1), sp.Piecewise((1, t < 1), (-2, True))
    system = ap.System.with_frictions({x: v, v: F + G + drive, y: w, w: H - y}, {}, [*feet, beside], time=t)
    proof = proven_as_followed(ap.Scene(system=system, values={}, start={"x": 0, "v": 0, "y": 2, "w": 0}, until=2))
    assert [(event.kind, event.friction) for event in proof.events] == [("slip_onset", 0)]


def test_a_second_event_is_refused_that_only_some_points_of_a_box_have_before_the_end():
    for until, obstacle in (("3.178", ""), ("3.183", "horizon")):
        turns = ap.Scene(system=COULOMB, values={"k": "0.35"}, start={"x": "2.3", "v": "0.1"}, until=until)
        assert certify(turns, {"v": ("0.1", "0.12")}).obstacle == obstacle


@pytest.mark.parametrize(("law", "proven"), [("1 - v", False), ("1 - v/20", True), ("v/2", True), ("1 - t", False)])
def test_a_slide_is_proven_where_its_law_of_friction_is_not_negative(law, proven):
    x, v, force, t = sp.symbols("x v F t", real=True)
    kinetic = sp.sympify(law, {"v": v, "t": t})
    slide = ap.Friction(velocity=v, force=force, load=1, kinetic=kinetic, static=1)
    system = ap.System.with_frictions({x: v, v: 2 + force}, {}, [slide], time=t)
    found = certify(ap.Scene(system=system, start={"x": 0, "v": "1/2"}, until=2))
    assert found.proven == proven
    assert found.reason == ("" if proven else f"friction: within slip_same, {kinetic} may be negative")


@pytest.mark.parametrize(("law", "start", "proven"), [
    ("Piecewise((1, x < 1), (-1, True))", 1, False), ("1/2 + sign(v)", -1, False), ("1/2 + sign(v)", 1, True),
    ("Piecewise((1, x < 1), (0, True))", 1, True),
])
def test_a_slide_is_not_proven_where_its_law_is_a_negative_constant_on_a_side_or_in_a_direction(law, start, proven):
    x, v, force = sp.symbols("x v F", real=True)
    kinetic = sp.sympify(law, {"v": v, "x": x})
    slide = ap.Friction(velocity=v, force=force, load=1, kinetic=kinetic, static=2)
    system = ap.System.with_frictions({x: v, v: 2 + force}, {}, [slide])
    found = certify(ap.Scene(system=system, start={"x": 0, "v": start}, until=2))
    assert found.proven == proven
    assert proven or found.reason.startswith("friction: ")
