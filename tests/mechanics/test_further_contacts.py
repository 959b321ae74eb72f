"""Rigid mechanisms with more than one contact, beside statics, an integral of motion and Newton's law in numbers."""

import itertools
import math
import tomllib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp
from mechanisms import chain, energy_of_chain
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.automaton import consistency, decide
from asympk.certify import certify
from asympk.errors import InputError, NoMotion, NotDerivable, TwoMotions, UnboundedReaction, Undecided
from asympk.mechanics.described import mechanism_of_table
from asympk.mechanics.elastic import basis_of, velocities
from asympk.mechanics.evaluation import evaluate
from asympk.output.mechanisms import mechanism_as_text
from asympk.symbolic.branches import OPEN, Phase
from asympk.symbolic.expansion import require_series
from asympk.symbolic.forces import moves_alike
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import generic_place, heavy, replaced, valued

T = dynamicsymbols._t
f = sp.Symbol("f", nonnegative=True)
X, Y, THETA = dynamicsymbols("X Y theta")
LEANING = sp.Rational(6, 5)
FLOOR = ap.Contact(Y - sp.sin(THETA) / 2, X - sp.cos(THETA) / 2, f, unilateral=True)
WALL = ap.Contact(-X - sp.cos(THETA) / 2, Y + sp.sin(THETA) / 2, f, unilateral=True)


def _ladder(*others):
    """Return a uniform ladder of length 1 whose lower end stands on the floor, with further contacts."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 24 - Y
    return ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=FLOOR, others=others)


LEANT = {"X": -sp.cos(LEANING) / 2, "Y": sp.sin(LEANING) / 2, "theta": LEANING, "X'": 0, "Y'": 0, "theta'": 0}


def _leant(friction, until):
    """Return the path of the ladder from rest against the wall X = 0, at the angle ``LEANING``."""
    ladder = _ladder(WALL)
    system = ladder.rigid()
    start = ladder.start(system, {**LEANT, "f": friction})
    return ap.solve(ap.Scene(system=system, values={"f": friction}, start=start, until=until))


@pytest.mark.slow
def test_a_smooth_ladder_leaves_the_wall_where_its_top_has_fallen_by_a_third():
    """With both ends held, energy gives theta'^2 = 3 (s0 - s), and the wall pushes with -X'' = 0 at s = 2/3 s0."""
    path = _leant(0, "3/2")
    (leaves,) = path.events
    assert (leaves.kind, leaves.friction) == ("lift_off", 1)
    theta, rate = (leaves.state[path.names.index(name)] for name in ("theta", "theta'"))
    assert math.sin(theta) == pytest.approx(2 / 3 * math.sin(1.2), abs=1e-8)
    assert rate**2 == pytest.approx(math.sin(1.2), abs=1e-8)


@pytest.mark.parametrize(("off", "mode"), [(1e-6, "stick+stick"), (-1e-6, "slip_opposite+slip_opposite")])
@pytest.mark.few(1)
def test_a_ladder_rests_on_as_much_friction_as_statics_says(off, mode):
    """Floor and wall hold it if tan(theta) >= (1 - f^2) / (2 f), so if f >= tan(pi/4 - theta/2)."""
    assert _leant(math.tan(math.pi / 4 - 0.6) + off, "1/100").modes == (mode,)


def _elastic_ladder(compliance):
    """Return the scene of ``_leant`` with f = 1/10 on elastic contacts of the damping time 1."""
    ladder = _ladder(WALL)
    system = ladder.elastic(compliance=sp.Symbol("c", positive=True), damping=1)
    values = {"f": "1/10", "c": compliance}
    return ap.Scene(system=system, values=values, start=ladder.start(system, LEANT), until="2/5")


@pytest.mark.further
def test_an_elastic_ladder_differs_from_the_rigid_one_by_its_compliance_times_a_constant():
    rigid, found = _leant("1/10", "2/5"), []
    for compliance in ("1/10000", "1/100000"):
        path = ap.solve(_elastic_ladder(compliance), "radau", rtol=1e-11)
        by_name = dict(zip(path.names, path.final, strict=True))
        apart = [by_name[name] - value for name, value in zip(rigid.names, rigid.final, strict=True) if name in by_name]
        found.append(np.array(apart) / float(sp.Rational(compliance)))
        x, y, theta, pressed, against = path.final[:5]
        gaps = y - math.sin(theta) / 2, -x - math.cos(theta) / 2
        invariants = np.array(gaps) + float(sp.Rational(compliance)) * np.array([pressed, against])
        assert np.allclose(invariants, 0, rtol=0, atol=1e-10)
    assert np.allclose(*found, rtol=1e-3)
    assert np.abs(found[1]).min() > 0.01  # none of them is 0


@pytest.mark.further
def test_jumps_onto_two_contacts_at_once_have_errors_of_the_next_order():
    """Order 1 errs by c^2 times a constant, order 2 by c^3."""
    scenes = [_elastic_ladder(compliance) for compliance in ("1/1000", "1/2000")]
    exact = [np.array(ap.solve(scene, "radau", rtol=1e-12).final) for scene in scenes]
    for order in (1, 2):
        first, second = (np.abs(ap.solve(scene, "jump", order=order).final - end).max()
                         for scene, end in zip(scenes, exact, strict=True))
        assert first / second == pytest.approx(2 ** (order + 1), rel=0.05)


def test_a_start_beside_the_wall_presses_no_wall_until_it_touches():
    """With c = eps^2 the reaction of a wall is -g/c; a point of the speed 1 meets a wall 1/100 away at t = 1/100."""
    eps = sp.Symbol("eps", positive=True)
    point = ap.Mechanism((X, Y), (X.diff(T), Y.diff(T)), sp.eye(2), (0, -1), ap.Contact(Y, X, f, unilateral=True),
                         others=(ap.Contact(1 - X, Y, f, unilateral=True),))
    system = point.elastic(compliance=eps**2, damping=0)
    start = point.start(system, {"X": "0.99", "Y": 0, "X'": 1, "Y'": 0, "eps": "1/1000"})
    assert (start["x"], start["x2"]) == (0, pytest.approx(-1e4))
    path = ap.solve(ap.Scene(system=system, values={"f": 0, "eps": "1/1000"}, start=start, until="1/20"))
    (touch,) = (event for event in path.events if (event.kind, event.friction) == ("touch_down", 1))
    assert touch.t == pytest.approx(0.01, abs=1e-12)
    damped = point.elastic(compliance=eps, damping=1)
    with pytest.raises(InputError, match=r"the start is above contact 2, g = 0\.01"):
        point.start(damped, {"X": "0.99", "Y": 0, "X'": 1, "Y'": 0, "eps": "1/1000"})


def test_a_start_above_a_damped_contact_is_taken_where_its_damper_does_not_push_yet():
    """A point of the speed 2 that starts 1/2 before the wall meets it at the gap 2 h = 1/5, so at t = 3/20."""
    c, h = sp.symbols("c h", positive=True)
    point = ap.Mechanism((X, Y), (X.diff(T), Y.diff(T)), sp.eye(2), (0, -1), ap.Contact(Y, X, f, unilateral=True),
                         others=(ap.Contact(1 - X, Y, f, unilateral=True),))
    system, numbers = point.elastic(compliance=c, damping=h), {"f": 0, "c": "1e-3", "h": "1/10"}
    start = point.start(system, {**numbers, "X": "1/2", "Y": 0, "X'": 2, "Y'": 0})
    path = ap.solve(ap.Scene(system=system, values=numbers, start=start, until="1/5"))
    touch = path.events[0]
    assert (touch.kind, touch.friction, touch.t) == ("touch_down", 1, pytest.approx(0.15, abs=1e-12))
    midway = dict(zip(path.names, map(float, path(0.1)), strict=True))
    rates = {"X'": midway["y2"] / 1e3, "Y'": -midway["y"] / 1e3}
    again = point.start(system, {**numbers, "X": midway["X"], "Y": midway["Y"], **rates})
    assert [again[name] for name in path.names] == pytest.approx([midway[name] for name in path.names], rel=1e-9)
    with pytest.raises(InputError, match=r"above contact 2, g = 0\.19, g' = -2, where its damper pushes already"):
        point.start(system, {**numbers, "X": "81/100", "Y": 0, "X'": 2, "Y'": 0})


@pytest.mark.parametrize("height", ["1.61", "1.99"])
def test_a_motion_goes_on_from_where_a_damped_contact_begins_to_push(height):
    """There the gap is h |g'| but for rounding."""
    c = sp.Symbol("c", positive=True)
    point = ap.Mechanism((X, Y), (X.diff(T), Y.diff(T)), sp.eye(2), (0, -1), ap.Contact(Y, X, f, unilateral=True))
    system, numbers = point.elastic(compliance=c, damping=sp.Rational(1, 7)), {"f": "0.3", "c": "1e-3"}
    start = point.start(system, {**numbers, "X": 0, "Y": height, "X'": 1, "Y'": "-0.7"})
    path = ap.solve(ap.Scene(system=system, values=numbers, start=start, until=2))
    touch = path.events[0]
    at = dict(zip(path.names, map(float, path(touch.t)), strict=True))
    again = point.start(system, {**numbers, "X": at["X"], "Y": at["Y"], "X'": at["z"], "Y'": -at["y"] / 1e3})
    onward = ap.solve(ap.Scene(system=system, values=numbers, start=again, until=2 - touch.t))
    assert touch.kind == "touch_down"
    assert onward.final == pytest.approx(path.final, rel=1e-9)


def test_a_parameter_of_a_further_gap_alone_is_given_to_its_start_and_to_the_motions_with_it_open():
    """An elastic contact with c = eps^2 = 1/16 that is open by w starts with the reaction -w/c."""
    eps, w = sp.symbols("eps w", positive=True)
    ladder = _ladder(replace(WALL, gap=w + WALL.gap))
    values = {**LEANT, "f": "1/10", "w": "1/2"}
    start = ladder.start(ladder.elastic(compliance=eps**2, damping=0), {**values, "eps": "1/4"})
    assert (start["x"], start["x2"]) == (0, pytest.approx(-8))
    assert ladder.motions(values) == _ladder().motions({**LEANT, "f": "1/10"})
    assert ladder.evaluate(w, values) == 0.5


@pytest.mark.parametrize(("friction", "tips"), [(0.49, False), (0.51, True)])
@pytest.mark.few(1)
def test_a_sliding_block_on_two_legs_tips_if_its_friction_exceeds_half_its_width_over_its_height(friction, tips):
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 5 - Y
    rear, front = (
        ap.Contact(Y + (side * sp.sin(THETA) - 2 * sp.cos(THETA)) / 2,
                   X + (side * sp.cos(THETA) + 2 * sp.sin(THETA)) / 2, f, unilateral=True) for side in (-1, 1)
    )
    block = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=rear, others=[front])
    system = block.rigid()
    start = block.start(system, {"X": 0, "Y": 1, "theta": 0, "X'": 1, "Y'": 0, "theta'": 0})
    path = ap.solve(ap.Scene(system=system, values={"f": friction}, start=start, until="1/10"))
    assert path.modes == (("open+slip_same",) if tips else ("slip_same+slip_same",))


@pytest.mark.parametrize("n", [2, 5])
@pytest.mark.further
def test_rates_and_constraints_of_two_contacts_are_those_of_newtons_law_in_numbers(n):
    """M q'' = Q + sum W p over both contacts, and g'' is the rate of g' along q' and q''."""
    angles = dynamicsymbols(f"q1:{n + 1}")
    (x, y), (knee_x, knee_y) = energy_of_chain(angles)[1], energy_of_chain(angles[:-1])[1]
    mechanism, side = chain(n), ap.Contact(x + 2 * knee_y, y - knee_x, 1)
    system = replace(mechanism, others=(side,)).rigid()
    contacts = (mechanism.plain, replace(mechanism, contact=side).plain)
    assert any(rate.has(InverseForm) for rate in system.slow.values()) is (n == 5)
    q, u, forces = contacts[0].coordinates, contacts[0].velocities, sp.symbols("N F N2 F2", real=True)
    drawn = {*contacts[0].symbols, *contacts[1].symbols, *forces} - {contacts[0].time}
    values = dict(zip(sorted(drawn, key=str), np.random.default_rng(1).uniform(0.2, 1, len(drawn)), strict=True))
    read = lambda rows: np.array(evaluate(tuple(sp.Matrix(rows)), values)).reshape(np.shape(rows))  # noqa: E731
    W = read([[part.diff(v) for v in u] for k in contacts for part in (k.gap_rate, k.slip)])
    right = read(contacts[0].forces)[:, 0] + W.T @ read(forces)
    accelerations = np.linalg.solve(read(contacts[0].mass), right)
    assert np.allclose(read([system.slow[v] for v in u]), accelerations, rtol=1e-11)
    turning = read([[k.gap_rate.diff(place) for place in q] for k in contacts]) @ read(u)
    expected = W[::2] @ accelerations + turning
    assert np.allclose(read([friction.constraint for friction in system.frictions]), expected, rtol=1e-11)


@cache
def _on_tip_and_knee():
    """Return the elastic system of three links whose end and second joint touch the ground, each at its depth."""
    x, y = energy_of_chain(dynamicsymbols("q1:3"))[1]
    knee = ap.Contact(y + sp.Symbol("K", positive=True), x, f, unilateral=True)
    return replace(chain(3), others=(knee,)).elastic(sp.Symbol("c", positive=True), sp.Symbol("h", positive=True))


@pytest.mark.further
def test_rates_stay_finite_as_the_compliance_vanishes_where_two_penetrations_move_a_slip():
    """The slip of a joint contains c y and c y2, whose rates are of order 1: of c y' in v' = 0 nothing is divided."""
    for mode in _on_tip_and_knee().modes:
        require_series(mode, _on_tip_and_knee().small)


@pytest.mark.further
def test_three_links_on_two_elastic_contacts_have_a_slow_manifold_unless_one_opens_or_both_stick():
    """Two contacts that stick leave three links one way to move, so both gap rates depend on each other."""
    found = ap.critical_manifolds(_on_tip_and_knee())
    closed = {m.name for m in _on_tip_and_knee().modes if "open" not in m.name}
    assert {manifold.dynamics.name for manifold in found} == closed - {"stick+stick"}
    for manifold in found:
        left = [replaced(g, {manifold.small: sp.S.Zero, **manifold.branch}) for g in manifold.dynamics.fast.values()]
        place = generic_place(sp.Tuple(*left))
        assert all(abs(valued(g, place, 50)) < 1e-40 for g in left)


@pytest.mark.parametrize(("place", "said"), [({"X'": 1}, "g' = 1"), ({"Y": 1}, "g = ")])
def test_a_start_that_breaks_a_further_constraint_is_refused(place, said):
    ladder = _ladder(ap.Contact(X + Y - sp.sin(LEANING) / 2, X - Y, f))
    still = {"X": 0, "Y": sp.sin(LEANING) / 2, "theta": LEANING, "X'": 0, "Y'": 0, "theta'": 0}
    assert ladder.start(ladder.rigid(), still)["X"] == 0
    with pytest.raises(InputError, match=rf"^others\[0\]: the start is off the constraint: {said}"):
        ladder.start(ladder.rigid(), {**still, **place})


def test_one_contact_has_a_critical_friction_but_no_jump_law_beside_a_rough_one_that_never_opens():
    """The upper end of the ladder runs in a guide, not on a wall: with the guide left out it would have one slip."""
    sliding = {**LEANT, "X'": -sp.Rational(1, 2), "Y'": 0, "f": 2}  # off the wall, not onto it
    assert _ladder(WALL).motions(sliding) == _ladder().motions(sliding)
    held = _ladder(WALL, replace(WALL, unilateral=False))
    assert held.critical_friction == _ladder(replace(WALL, unilateral=False)).critical_friction
    for question in (lambda: held.motion_map(sliding), lambda: held.jump_law()):
        with pytest.raises(NotDerivable, match=r"others\[1\] holds both ways, is rough, and"):
            question()
    with pytest.raises(InputError, match=r"others\[1\]: the start is off the constraint: g' = 0.5"):
        held.motions(sliding)


def test_two_contacts_are_told_where_the_second_belongs():
    with pytest.raises(InputError, match="further ones are others="):
        replace(_ladder(), contact=(FLOOR, WALL))
    alike = ap.Contact(1 - X, 2 * X, f)
    refused = {"others = 'wall'": "wall", "others = Contact": WALL, r"others\[0\] = 'wall'": ["wall"],
               r"others\[1\]: slip = 2\*X\(t\) is parallel": [WALL, alike]}
    for said, others in refused.items():
        with pytest.raises(InputError, match=said):
            replace(_ladder(), others=others)


def _beam():
    """Return a beam on three supports, one more than its height and its angle need, with its weight off its middle."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 6 - Y - THETA / 5
    first, *others = (ap.Contact(Y + place * THETA, X, f, unilateral=True) for place in (-1, sp.Rational(1, 3), 1))
    return ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=first, others=others)


@pytest.mark.further
def test_slips_on_three_grounds_of_any_slope_are_compared_without_being_expanded():
    """Written out, the velocity of one of them has thousands of terms, whose expansion took minutes at each event."""
    contacts = []
    for k in range(3):
        a, b, slope = (sp.Symbol(f"{name}{k}", real=True) for name in ("a", "b", "s"))
        x, y = X + a * sp.cos(THETA) - b * sp.sin(THETA), Y + a * sp.sin(THETA) + b * sp.cos(THETA)
        gap, slip = y * sp.cos(slope) - x * sp.sin(slope), x * sp.cos(slope) + y * sp.sin(slope)
        contacts.append(ap.Contact(gap, slip, f, unilateral=True))
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 24 - Y
    body = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=contacts[0], others=contacts[1:])
    system = body.elastic(compliance=sp.Symbol("eps", positive=True) ** 2, damping=0)
    written = velocities(body.plain, basis_of(body.equations), [y for y in system.fast if y.name[0] == "y"])
    frictions = [replace(own, velocity=own.velocity.subs(written, simultaneous=True)) for own in system.frictions]
    system = replace(system, frictions=tuple(frictions))
    assert all(heavy(friction.velocity) for friction in system.frictions)
    slips, open_ = (Phase(1, 1),) * 3, (OPEN,) * 3
    assert not moves_alike(system, slips, open_)
    assert moves_alike(system, slips, slips)


FLAT = {"X": 0, "Y": 0, "theta": 0, "X'": 1, "Y'": 0, "theta'": 0}


def test_elastic_supports_of_a_beam_share_its_weight_by_their_stiffness():
    """Equal springs under a rigid beam carry 2/7, 12/35 and 13/35, which statics alone does not tell."""
    eps, beam = sp.Symbol("eps", positive=True), _beam()
    system = beam.elastic(compliance=eps**2, damping=eps)
    start = beam.start(system, FLAT)
    path = ap.solve(ap.Scene(system=system, values={"f": "1/10", "eps": "1/20"}, start=start, until=3))
    final = dict(zip(path.names, path.final, strict=True))
    loads = [final[name] for name in ("x", "x2", "x3")]
    assert np.allclose(loads, [2 / 7, 12 / 35, 13 / 35], rtol=0, atol=1e-10)
    assert final["X'"] == pytest.approx(0.7)


@pytest.mark.further
def test_jumps_onto_more_supports_than_degrees_of_freedom_have_errors_of_the_next_order():
    beam = _beam()
    system = beam.elastic(compliance=sp.Symbol("c", positive=True), damping=1)
    for order in (0, 1, 2):
        errors = []
        for c in ("1/1000", "1/2000"):
            scene = ap.Scene(system=system, values={"f": "1/10", "c": c}, start=beam.start(system, FLAT), until=2)
            found, exact = ap.solve(scene, "jump", order=order).final, ap.solve(scene).final
            errors.append(np.abs(np.array(found) - exact).max())
        assert errors[0] / errors[1] == pytest.approx(2 ** (order + 1), rel=0.05)


def test_a_ball_in_a_shaft_with_play_bounces_between_walls_whose_gaps_are_one_number():
    """Without damping and friction it keeps its speed: it crosses a play of 1 and dwells pi eps in each wall."""
    eps = sp.Symbol("eps", positive=True)
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2
    lower, upper = (ap.Contact(gap, X, f, unilateral=True) for gap in (Y, 1 - Y))
    ball = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=lower, others=[upper])
    system = ball.elastic(compliance=eps**2, damping=0)
    start = ball.start(system, {"X": 0, "X'": 0, "Y": "1/2", "Y'": 1, "eps": "1/100"})
    path = ap.solve(ap.Scene(system=system, values={"f": 0, "eps": "1/100"}, start=start, until=2))
    met = [(event.friction, event.t) for event in path.events if event.kind == "touch_down"]
    assert [friction for friction, _ in met] == [1, 0]
    assert [t for _, t in met] == pytest.approx([0.5, 1.5 + math.pi / 100], abs=1e-9)


def test_a_wall_that_moves_against_another_has_no_limit_of_small_compliance():
    eps, energy = sp.Symbol("eps", positive=True), (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2
    for wall, apart in ((1 - Y + sp.sin(T), True), (1 - Y, False)):
        lower = ap.Contact(Y, X, f, unilateral=True)
        shaft = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=lower, others=[ap.Contact(wall, X, f)])
        if apart:
            with pytest.raises(NotDerivable, match="the gap of contact 2 depends on the gaps before, and moves"):
                shaft.elastic(compliance=eps**2, damping=0)
        else:
            assert sp.Symbol("y2", real=True) not in shaft.elastic(compliance=eps**2, damping=0).states


def test_states_and_forces_leave_their_names_to_the_symbols_of_the_damping():
    """The motion is that with damping times of other names."""
    beam, c, ends = _beam(), sp.Symbol("c", positive=True), []
    for names in ("h", "k"), ("y2", "N3"):
        system = beam.elastic(compliance=c, damping=sp.Add(*(sp.Symbol(name, positive=True) for name in names)))
        values = {"f": "1/10", "c": "1/1000"} | dict.fromkeys(names, 1)
        start = beam.start(system, FLAT | {"Y": "-1/10000", "c": "1/1000"})
        ends.append(ap.solve(ap.Scene(system=system, values=values, start=start, until=1)).final)
    assert ends[0] == ends[1]
    assert {"y", "y2_", "x3"} <= {str(s) for s in system.states}


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_a_wall_that_moves_meets_a_body_at_rest_on_more_contacts_than_determine_its_forces(method):
    floor, ledge = (ap.Contact(gap, X, f, unilateral=True) for gap in (Y, 2 * Y))
    energy, wall = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y, ap.Contact(1 - T - X, Y, f, unilateral=True)
    body = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=floor, others=[ledge, wall])
    system = body.rigid()
    start = body.start(system, {"X": 0, "Y": 0, "X'": 0, "Y'": 0})
    scene = ap.Scene(system=system, values={"f": "1/10"}, start=start, until=2)
    with pytest.raises(NoMotion, match="contact 3 is hit at t = 1, "):
        ap.solve(scene, method)


def test_a_push_that_grows_beyond_static_friction_ends_in_the_sharing_of_kinetic_friction():
    """Two supports of one body, the second of twice the reach, carry any shares: they brake with 1/20 to 1/10.

    The push t/5 reaches 1/10, all that they can hold, at t = 1/2, where one of them alone is at the edge of its cone.
    """
    energy, (floor, ledge) = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y, (
        ap.Contact(gap, X, f, unilateral=True) for gap in (Y, 2 * Y))
    body = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=floor, others=[ledge], forces={X: T / 5})
    system = body.rigid()
    start = body.start(system, {"X": 0, "Y": 0, "X'": 0, "Y'": 0})
    with pytest.raises(UnboundedReaction, match=r"not determined at t = 0\.5, "):
        ap.solve(ap.Scene(system=system, values={"f": "1/10"}, start=start, until=1))


@cache
def _crank(jointed):
    """Return a crank and its slider with a heavy rod, held by constraints at its ends, or placed by the two angles."""
    angle, l = dynamicsymbols("alpha"), sp.Rational(3, 5)
    end = sp.cos(angle) / 2 + l / 2 * sp.cos(THETA), sp.sin(angle) / 2 + l / 2 * sp.sin(THETA)
    x, y = (X, Y) if jointed else end
    guide = ap.Contact(y + l / 2 * sp.sin(THETA), x + l / 2 * sp.cos(THETA), f)
    joints = [ap.Contact(X - end[0], Y - end[1], 0), ap.Contact(Y - end[1], X - end[0], 0)]
    energy = (angle.diff(T) ** 2 / 10 + x.diff(T) ** 2 + y.diff(T) ** 2 + l**2 * THETA.diff(T) ** 2 / 12) / 2
    own = {"coordinates": (angle, X, Y, THETA), "others": joints} if jointed else {"coordinates": (angle, THETA)}
    return ap.Mechanism.from_lagrangian(energy, contact=guide, forces={angle: sp.Rational(1, 2)}, **own)


def _turned(jointed, angle, rate, friction):
    """Return the path of the crank from an angle and its rate on, or the path that an error leaves."""
    crank, theta = _crank(jointed), -math.asin(math.sin(angle) / 1.2)
    turning = -math.cos(angle) * rate / (1.2 * math.cos(theta))
    start = {"alpha": angle, "theta": theta, "alpha'": rate, "theta'": turning}
    if jointed:
        start |= {"X": math.cos(angle) / 2 + 0.3 * math.cos(theta), "Y": math.sin(angle) / 2 + 0.3 * math.sin(theta)}
        start |= {"X'": -math.sin(angle) / 2 * rate - 0.3 * math.sin(theta) * turning,
                  "Y'": math.cos(angle) / 2 * rate + 0.3 * math.cos(theta) * turning}
    system = crank.rigid()
    return ap.Scene(system=system, values={"f": friction}, start=crank.start(system, start), until=1)


@pytest.mark.further
@pytest.mark.parametrize(("angle", "rate", "friction"), [(2.7, 2, 1.2), (0.3, -2, 1.2)])
def test_a_crank_with_joints_for_constraints_turns_as_in_its_two_angles(angle, rate, friction):
    """Without friction a joint neither slips nor sticks: the two that hold each other's slip at 0 made a false stop."""
    jointed, placed = (ap.solve(_turned(own, angle, rate, friction)) for own in (True, False))
    assert jointed.modes == tuple(f"{mode}+closed+closed" for mode in placed.modes)
    assert [event.t for event in jointed.events] == pytest.approx([event.t for event in placed.events], abs=1e-8)
    assert jointed.final[0] == pytest.approx(placed.final[0], abs=1e-8)


@pytest.mark.further
def test_joints_do_not_hide_that_a_second_motion_of_a_guide_comes_up():
    times = []
    for jointed in (True, False):
        with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as refused:
            ap.solve(_turned(jointed, 2.7, -2, 1.2))
        times.append(refused.value.t)
    assert times[0] == pytest.approx(times[1], abs=1e-8)


@pytest.mark.parametrize("two_sided", [False, True])
def test_a_table_without_friction_slides_on_three_feet_whose_reactions_no_equation_shares_out(two_sided):
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 6 - Y
    feet = [ap.Contact(Y + place * THETA, X, 0, unilateral=not two_sided) for place in (-1, 0, 1)]
    table = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=feet[0], others=feet[1:])
    system = table.rigid()
    for velocity in (0, 1):
        start = table.start(system, FLAT | {"Y": 0, "X'": velocity})
        path = ap.solve(ap.Scene(system=system, start=start, until=2))
        assert path.modes == ("closed+closed+closed",)
        assert path.final == pytest.approx((2 * velocity, 0, 0, velocity, 0, 0))


def _on_feet(places, frictions, push=0, torque=0, rises=(0, 0, 0, 0)):
    """Return a table on rough feet, its middle at half its half width above them; the ground ``rises`` under each."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 6 - Y
    feet = [ap.Contact(Y + place * sp.sin(THETA) - sp.cos(THETA) / 2 - rise,
                       X + place * sp.cos(THETA) + sp.sin(THETA) / 2, sp.sympify(share), unilateral=True)
            for place, share, rise in zip(places, frictions, rises, strict=False)]
    forces = {X: push, THETA: torque}
    return ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=feet[0], others=feet[1:], forces=forces)


@pytest.mark.slow
def test_motions_on_redundant_feet_have_no_determined_reactions_where_it_is_open_too_which_foot_lifts():
    """With friction by the speed the derivatives of the gap of a foot are long, and all that are computed vanish."""
    table = _on_feet((-1, 0, 1), [sp.Rational(2, 5) + X.diff(T) / 10] * 3)
    with pytest.raises(UnboundedReaction, match="leave F, N, F2, N2, F3, N3 open"):
        table.motions(FLAT | {"Y": "1/2"})


@pytest.mark.further
@pytest.mark.parametrize("places", [(-1, 0, 1), (-1, -1, 1, 1)])
def test_a_table_slides_on_feet_of_one_friction_however_these_share_its_weight(places):
    """It stops at v/f = 5/2, after v^2/(2 f); a push t/2 sets it off at t = 4/5, and moves it by (t - 4/5)^3/12."""
    many = len(places)
    for velocity, until, push, event, end in ((1, 3, 0, 2.5, 1.25), (0, 1, T / 2, 0.8, 0.2**3 / 12)):
        table = _on_feet(places, ["2/5"] * many, push)
        start = table.start(table.rigid(), FLAT | {"Y": "1/2", "X'": velocity})
        path = ap.solve(ap.Scene(system=table.rigid(), start=start, until=until))
        assert "+".join(["stick"] * many) in path.modes
        assert [event.t for event in path.events] == pytest.approx([event])
        assert path.final[:3] == pytest.approx((end, 0.5, 0), abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "torque", "stop", "path"), [
    (sp.Rational(2, 5) + X.diff(T) / 10, 0, 10 * math.log(5 / 4), 10 - 40 * math.log(5 / 4)),
    (sp.Rational(2, 5), T / 10, 5 / 2, 5 / 4),
])
def test_a_table_slides_on_three_feet_if_friction_or_a_torque_varies_as_two_feet_keep_the_third_on_the_ground(
    friction, torque, stop, path
):
    """v' = -(2/5 + v/10) from v = 1; the long derivatives of a gap that stays 0 did not show that it does."""
    table = _on_feet((-1, 0, 1), [friction] * 3, torque=torque)
    start = table.start(table.rigid(), FLAT | {"Y": "1/2", "X'": 1})
    found = ap.solve(ap.Scene(system=table.rigid(), start=start, until=3))
    assert found.modes[-1] == "stick+stick+stick"
    assert [event.t for event in found.events] == pytest.approx([stop])
    assert found.final[:3] == pytest.approx((path, 0.5, 0), abs=1e-8)


@pytest.mark.further
def test_a_table_set_off_by_a_push_slides_on_two_feet_whose_reactions_leave_rounding_in_what_stays_0():
    """v' = t - 2/(5 (1 + v^2)) from t = 2/5 on; errors relative to 1e-17 in y' and theta' were asked for."""
    table = _on_feet((-1, 1), [sp.Rational(2, 5) / (1 + X.diff(T) ** 2)] * 2, T)
    start = table.start(table.rigid(), FLAT | {"Y": "1/2", "X'": 0})
    path = ap.solve(ap.Scene(system=table.rigid(), start=start, until=1))
    truth = solve_ivp(lambda t, w: (w[1], t - 0.4 / (1 + w[1] ** 2)), (0.4, 1), (0, 0), rtol=1e-12, atol=1e-13)
    assert path.modes == ("stick+stick", "slip_same+slip_same")
    assert path.final == pytest.approx((truth.y[0, -1], 0.5, 0, truth.y[1, -1], 0, 0), abs=1e-8)


@pytest.mark.further
@pytest.mark.parametrize(("rise", "mode"), [(-1, "slip_same+slip_same+open"), (1, "open+slip_same+slip_same")])
def test_a_foot_over_a_hollow_that_begins_flat_opens_and_one_on_a_hump_bears(rise, mode):
    """Friction pitches the table forward, onto the hump and the front foot."""
    table = _on_feet((-1, 1, 0), ["2/5"] * 3, rises=(0, 0, rise * X**3 / 10))
    start = table.start(table.rigid(), FLAT | {"Y": "1/2", "X'": 1})
    assert ap.solve(ap.Scene(system=table.rigid(), start=start, until="1/2")).modes == (mode,)


@pytest.mark.further
def test_feet_whose_friction_comes_to_differ_share_no_load_at_will_where_it_does_not_yet():
    """Under the middle foot the ground becomes rougher, which no derivative that is computed shows at the start."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2 + THETA.diff(T) ** 2) / 2 - Y
    feet = [ap.Contact(Y + place * THETA, X + THETA / 2, sp.Rational(1, 4) + share, unilateral=True)
            for place, share in ((-1, 0), (0, X**17), (1, 0))]
    table = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=feet[0], others=feet[1:])
    start = table.start(table.rigid(), FLAT)
    with pytest.raises(UnboundedReaction, match="leave F, N, F2, N2, F3, N3 open"):
        ap.solve(ap.Scene(system=table.rigid(), start=start, until=1))


def test_forces_that_no_equation_shares_out_are_named_where_the_motion_depends_on_them():
    table = _on_feet((-1, 0, 1), ["2/5", "1/5", "2/5"])
    start = table.start(table.rigid(), FLAT | {"Y": "1/2"})
    with pytest.raises(UnboundedReaction, match="which leave F, N, F2, N2, F3, N3 open; merge contacts"):
        ap.solve(ap.Scene(system=table.rigid(), start=start, until=1))


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_a_weight_that_the_pull_takes_off_a_smooth_floor_lifts_off_and_its_motion_is_proven(method):
    """Pulled by t against the weight 1, it leaves at t = 1 and has then risen by (t - 1)^3 / 6."""
    block = ap.Mechanism.from_lagrangian((X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y, (X, Y), forces={Y: T},
                                         contact=ap.Contact(Y, X, 0, unilateral=True))
    system = block.rigid()
    scene = ap.Scene(system=system, start=block.start(system, {"X": 0, "Y": 0, "X'": -1, "Y'": 0}), until=2)
    path = ap.solve(scene, method)
    assert (path.modes, [event.kind for event in path.events]) == (("closed", "open"), ["lift_off"])
    assert path.final == pytest.approx((-2, 1 / 6, -1, 1 / 2), abs=1e-8)
    assert certify(scene).modes == path.modes


def test_a_rest_that_would_turn_the_load_of_another_contact_chooses_no_slip():
    """The second slider begins to slip forward, with a reaction of either sign; none holds it that keeps the first."""
    q, u, slide = sp.symbols("g1 g2 s1 s2"), sp.symbols("n1 n2 v1 v2"), sp.Rational(7, 2)
    yields = sp.Matrix([[31, -14, 6, -25], [-14, 11, -4, 14], [6, -4, 2, -5], [-25, 14, -5, 23]]) / 2
    free = sp.Matrix([-1, 3, -1, 2])
    for sign in (1, -1):  # of the second reaction; friction is slide R1 on the first and -2 |R2| on the second
        pressed = yields[:, :2] + yields[:, 2:] * sp.diag(-slide, -2 * sign)
        first, second = -pressed[:2, :].inv() * free[:2, :]
        assert first < 0 < sign * second
        assert (pressed * sp.Matrix([first, second]) + free)[3] > 0
    first, second = (ap.Contact(gap=q[k], slip=u[2 + k], friction=f) for k, f in enumerate((slide, 2)))
    pair = ap.Mechanism(q, u, yields.inv(), yields.inv() * free, first, others=[second])
    with pytest.raises(TwoMotions, match=r"slip_same.*\+slip_opposite.* and slip_same.*\+slip_same"):
        ap.solve(ap.Scene(system=pair.rigid(), start={**dict.fromkeys((*q, *u), 0), u[2]: -1}, until=1))


@pytest.mark.further
def test_a_bipod_that_brakes_on_elastic_feet_rocks_on_with_its_feet_slipping_in_turn_until_rounding_hides_them():
    """A foot slips by its angle times its rate, which is lost where the velocities of both are subtracted."""
    feet = [ap.Contact(Y + side * sp.sin(THETA) - sp.cos(THETA), X + side * sp.cos(THETA) + sp.sin(THETA), f,
                       unilateral=True) for side in (-1, 1)]
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 4 - 10 * Y
    bipod = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=feet[0], others=feet[1:])
    eps = sp.Symbol("eps", positive=True)
    system = bipod.elastic(compliance=eps**2, damping=eps)
    start = bipod.start(system, FLAT | {"Y": 1})
    scene = ap.Scene(system=system, values={"f": "0.3", "eps": "1e-3"}, start=start, until=1)
    coarse, fine = (ap.solve(replace(scene, until="0.356"), digits=digits) for digits in (None, 15))
    assert float(fine.events[0].t) == pytest.approx(1 / 3, abs=1e-6)
    assert abs(fine.final[2]) < 1e-11
    assert coarse.modes == fine.modes
    assert [event.t for event in coarse.events] == pytest.approx([float(event.t) for event in fine.events], abs=1e-5)
    with pytest.raises(Undecided):
        ap.solve(scene)


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, {"method": "radau"}, {"digits": 12}])
def test_a_wheel_that_jams_while_another_opens_is_told_as_one_that_jams_alone(how):
    """Braked at 1.3, it pitches about the front wheel until its critical friction, 1.55 at first, is down to 1.3.

    The rear wheel opens from a gap of 0, and the jam was told as a pole of the rates.
    """
    front, rear = (ap.Contact(Y + side * sp.sin(THETA) - sp.cos(THETA), X + side * sp.cos(THETA) + sp.sin(THETA), f,
                              unilateral=True) for side in (sp.Rational(7, 6), -sp.Rational(7, 6)))
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + sp.Rational(2, 9) * THETA.diff(T) ** 2 - 10 * Y
    stops = []
    for others in ((), (rear,)):
        wheels = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=front, others=others)
        system = wheels.rigid()
        start = wheels.start(system, FLAT | {"Y": 1, "X'": 20})
        with pytest.raises(UnboundedReaction, match="grows beyond all bounds") as stop:
            ap.solve(ap.Scene(system=system, values={"f": "1.3"}, start=start, until=1), **how)
        stops.append((float(stop.value.t), *map(float, stop.value.state)))
    assert stops[1] == pytest.approx(stops[0], rel=1e-8, abs=1e-8)
    angle = stops[0][1 + [*map(str, system.states)].index("theta")]
    lever, height = 7 / 6 * math.cos(angle) + math.sin(angle), math.cos(angle) - 7 / 6 * math.sin(angle)
    assert (4 / 9 + lever**2) / (lever * height) == pytest.approx(1.3, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("places", "depth", "how"), [
    ((-1, 1), "1/1000", {}), ((-1, 1), "1/2000", {"digits": 12}), ((-1, 0, 1), "1/3000", {}),
    ((-1, 0, 1), "1/3000", {"method": "lsoda"}),
])
def test_a_table_on_elastic_feet_that_turn_stays_upright_and_slips_on_all_feet_at_once(places, depth, how):
    """A push 2 t moves it at t = 3/2, by (t - 3/2)^3 / 3; errors of the flow made its feet slip in turn."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 6 - 10 * Y + 2 * T * X
    feet = [ap.Contact(Y + p * sp.sin(THETA), X + p * (sp.cos(THETA) - 1), f, unilateral=True) for p in places]
    table = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=feet[0], others=feet[1:])
    eps = sp.Symbol("eps", positive=True)
    system, values = table.elastic(compliance=eps**2, damping=eps), {"f": "0.3", "eps": "1e-2"}
    start = table.start(system, {**FLAT, "X'": 0, "Y": f"-{depth}", **values})
    path = ap.solve(ap.Scene(system=system, values=values, start=start, until=2), **how)
    final = dict(zip(path.names, map(float, path.final), strict=True))
    assert path.modes[-1] == "+".join(["slip_same"] * len(places))
    assert [event.t for event in path.events if event.kind == "slip_onset"] == pytest.approx([1.5], abs=1e-6)
    assert (final["X"], final["X'"]) == pytest.approx((1 / 24, 1 / 4), abs=1e-5)
    assert final["theta"] == final["theta'"] == 0


@pytest.mark.slow
@pytest.mark.parametrize(("pull", "kind", "friction", "mode"), [
    ((0, 1), "slip_onset", 1, "open+slip_same"), ((1, 1), "lift_off", 0, "open+open"),
])
def test_a_block_pulled_out_of_a_corner_slips_on_the_wall_or_lifts_off_and_the_event_is_of_what_happens(
    pull, kind, friction, mode
):
    """Pressed by 1 to the floor and the wall, it was said to begin to slip on the floor that it leaves."""
    floor, wall = ap.Contact(Y, X, f, unilateral=True), ap.Contact(X, Y, f, unilateral=True)
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - X - Y + T * (pull[0] * X + pull[1] * Y)
    system = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=floor, others=[wall]).rigid()
    path = ap.solve(ap.Scene(system=system, values={"f": "0.3"}, start=dict.fromkeys(system.states, 0), until=2))
    assert path.modes == ("stick+stick", mode)
    assert [(event.kind, event.friction) for event in path.events] == [(kind, friction)]
    assert path.events[0].t == pytest.approx(1.3 - 0.3 * pull[0])


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, {"method": "radau"}])
def test_an_elastic_wheel_without_friction_is_closed_whichever_way_it_slips(how):
    """At rest with the cart its velocity is rounding, whose zeros were events, and to Radau an accumulation of them."""
    height = sp.Rational(3, 5)
    braked, free = (
        ap.Contact(Y - height * sp.cos(THETA) + side * sp.sin(THETA), X + height * sp.sin(THETA) + side * sp.cos(THETA),
                   friction, unilateral=True) for side, friction in ((1, f), (-1, 0)))
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 4 - 9 * Y
    cart = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=braked, others=[free])
    eps = sp.Symbol("eps", positive=True)
    system = cart.elastic(compliance=eps**2, damping=eps)
    start = cart.start(system, FLAT | {"Y": height, "X'": 5})
    path = ap.solve(ap.Scene(system=system, values={"f": "0.8", "eps": "1e-3"}, start=start, until="1.2"), **how)
    assert path.modes == ("slip_same+closed", "stick+closed")
    assert [(event.kind, event.friction) for event in path.events] == [("velocity_zero", 0)]
    assert path.final[0] == pytest.approx(25 / 2 / (0.8 * 9 / 1.52), abs=1e-4)


@pytest.mark.parametrize(("place", "found"), [
    ({"Y": 1}, "open+slip_opposite"), ({"Y'": 1}, "open+slip_same"),
    ({"Y'": -1}, NoMotion), ({"X'": -1}, NoMotion), ({"X": -1}, InputError), ({"Y": None}, InputError),
])
def test_motions_at_a_wall_are_those_of_the_wall_where_the_floor_is_open_and_none_where_either_is_hit(place, found):
    """The floor was counted alone, as if it were closed and the wall open."""
    floor, wall = (ap.Contact(*pair, sp.Rational(2, 5), unilateral=True) for pair in ((Y, X), (X, Y)))
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - X - Y
    block = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=floor, others=[wall])
    values = {k: v for k, v in ({"X": 0, "Y": 0, "X'": 0, "Y'": 0} | place).items() if v is not None}
    if isinstance(found, str):
        assert block.motions(values) == ((found, (0, 1)),)
    else:
        with pytest.raises(found):
            block.motions(values)


BOX = """
coordinates = ["X", "Y", "theta"]
lagrangian = "(X'^2 + Y'^2)/2 + J*theta'^2/2 - 10*Y"
gap = "Y - h*cos(theta) - b*sin(theta)"     # of the rear foot
slip = "X + h*sin(theta) - b*cos(theta)"
friction = "f"
unilateral = true
[[others]]
gap = "Y - h*cos(theta) + b*sin(theta)"
slip = "X + h*sin(theta) + b*cos(theta)"
friction = "f"
unilateral = true
[values]
J = "1/3"
h = 2
b = "1/2"
f = 0
[state]
X = 0
Y = 2
theta = 0
"X'" = 1
"Y'" = 0
"theta'" = 0
"""


@pytest.mark.slow
def test_a_box_has_the_paradox_of_the_foot_that_leads_though_the_other_has_none_in_this_direction():
    """The determinant of both feet, 4 b^2/(m J), knows no friction; that of a foot ends at f = (J/m + b^2)/(b h)."""
    box = mechanism_of_table(tomllib.loads(BOX), "box")
    critical = sp.Rational(7, 12)
    assert box.mechanism.evaluate(box.mechanism.critical_friction, box.numbers) == pytest.approx(float(critical))
    for sliding, part, found in ((1, "99/100", False), (-1, 1, True), (1, "101/100", True)):
        here = box.changed({"X'": sliding, "f": sp.Rational(part) * critical})
        assert box.mechanism.has_paradox(here.numbers) == found
    assert not box.mechanism.has_paradox(here.numbers | {"Y": "201/100"})
    alone, together = mechanism_as_text(here).split("paradox         ")
    assert "a paradox for slip of the sign of G_NT" in alone
    assert together.startswith("some forces leave the closed contacts no motion or several")


def test_a_ladder_at_rest_has_a_paradox_by_slip_or_its_forces_that_are_not_determined_leave_it_open():
    """Such a body may rest and, under the same forces, slip or lift off though all determinants are positive."""
    assert _ladder(WALL).has_paradox({**LEANT, "f": 2})
    with pytest.raises(UnboundedReaction, match="not determined"):
        _ladder(WALL).has_paradox({**LEANT, "f": "1/4"})


def test_the_paradox_of_bodies_apart_takes_the_phases_of_each_alone(monkeypatch):
    """Of eleven blocks the phases of all had two thousand combinations, each with a determinant."""
    stiff, asked = consistency.is_stiff, []
    monkeypatch.setattr(consistency, "is_stiff", lambda *each: asked.append(each) or stiff(*each))
    x, y, u, v = (sp.symbols(f"{name}:4", real=True) for name in "xyuv")
    first, *others = (ap.Contact(y[k], x[k], 1, unilateral=True) for k in range(4))
    blocks = ap.Mechanism(x + y, u + v, sp.eye(8), (0,) * 8, first, others=others)
    assert not blocks.has_paradox(dict.fromkeys(x + y + v, 0) | dict.fromkeys(u, 1))
    assert len(asked) == 4 * 2


@pytest.mark.slow
def test_feet_that_are_closed_are_told_by_their_numbers():
    middle = {"gap": "Y - h*cos(theta)", "slip": "X + h*sin(theta)", "friction": "f", "unilateral": True}
    box = tomllib.loads(BOX)
    told = mechanism_as_text(mechanism_of_table(box | {"others": [*box["others"], middle]}, "box"))
    assert "contacts 2, 3 are closed here, too" in told
    assert "jump            of contact 1 alone: " in told


def _drawer():
    """Return a drawer between two guides at y = -a and y = a that is pulled by P beside its middle, at y = e."""
    a, e, P = sp.symbols("a e P", positive=True)
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2 + THETA.diff(T) ** 2) / 2
    lower, upper = (ap.Contact(Y + side * a * sp.sin(THETA), X - side * sp.sin(THETA), f) for side in (1, -1))
    pull = {X: P, THETA: P * e}
    return ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=lower, others=[upper], forces=pull)


PULLED = {"X": 0, "Y": 0, "theta": 0, "X'": 1, "Y'": 0, "theta'": 0, "a": 2, "e": "1/2", "P": 1, "f": 3}


@pytest.mark.parametrize("sliding", [1, -1])
def test_a_drawer_that_slides_presses_on_both_guides_by_the_couple_of_its_pull(sliding):
    """The guides bear P e = 2 a R at any friction, as friction on either side has opposite couples."""
    found = _drawer().motions({**PULLED, "X'": sliding})
    name = "slip_opposite+slip_same" if sliding > 0 else "slip_same+slip_opposite"
    assert found == ((name, (pytest.approx(-1 / 8), pytest.approx(1 / 8))),)


def test_a_jammed_drawer_rests_though_its_reactions_are_not_determined_as_its_run_does():
    drawer, jammed = _drawer(), {**PULLED, "X'": 0, "f": 5}
    ((name, reactions),) = drawer.motions(jammed)
    system, values = drawer.rigid(), {name: jammed[name] for name in ("a", "e", "P", "f")}
    path = ap.solve(ap.Scene(system=system, values=values, start=drawer.start(system, jammed), until=1))
    assert path.modes == (name,) == ("stick+stick",)
    assert all(map(math.isnan, reactions))


def test_motions_at_rest_with_open_forces_of_many_branches_are_refused(monkeypatch):
    """To compare those of a body on six feet in pairs took minutes."""
    monkeypatch.setattr(decide, "MOST_OPEN", 1)
    with pytest.raises(UnboundedReaction, match=r"stick\+stick has more of them than equations"):
        _drawer().motions({**PULLED, "X'": 0, "f": 5})


@pytest.mark.parametrize("friction", ["0.18", "0.2", 2])
def test_a_ladder_at_rest_moves_as_it_runs(friction):
    """By statics it rests if tan(theta) is at least (1 - f^2)/(2 f), so from f = 0.188 on."""
    ladder = _ladder(WALL)
    ((name, _),) = ladder.motions({**LEANT, "f": friction})
    system = ladder.rigid()
    start = ladder.start(system, LEANT)
    assert ap.solve(ap.Scene(system=system, values={"f": friction}, start=start, until="1/100")).modes == (name,)
    assert (name == "stick+stick") == (friction != "0.18")


def test_a_box_rests_on_a_slope_beside_a_block_that_slides_and_its_feet_bear_what_its_couple_asks_of_them():
    """The slope pulls with 2, half a length below the middle: N - N2 = 2 and N + N2 = 10."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 12 - 10 * Y + 2 * X
    u, w = dynamicsymbols("u w")
    energy += (u.diff(T) ** 2 + w.diff(T) ** 2) / 2 - 10 * w
    feet = [ap.Contact(Y + (side * sp.sin(THETA) - sp.cos(THETA)) / 2, X + (side * sp.cos(THETA) + sp.sin(THETA)) / 2,
                       sp.Rational(1, 2), unilateral=True) for side in (1, -1)]
    block = ap.Contact(w, u, sp.Rational(1, 10), unilateral=True)
    both = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA, u, w), contact=feet[0], others=[feet[1], block])
    at = dict.fromkeys(("X", "Y", "theta", "u", "w", "X'", "Y'", "theta'", "w'"), 0) | {"Y": "1/2", "u'": 1}
    assert both.motions(at) == (("stick+stick+slip_same", (6, 4, 10)),)


@pytest.mark.slow
@pytest.mark.further
def test_a_box_between_a_floor_and_a_wall_rests_as_its_run_does_while_a_pull_grows():
    """A foot that slips in name only was undecided, as all derivatives of its guards vanish."""
    half = sp.Rational(1, 2)
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 12 - 2 * Y + T * X / 10
    feet = [ap.Contact(Y + side * sp.sin(THETA) - sp.cos(THETA), X + side * sp.cos(THETA) + sp.sin(THETA), friction,
                       unilateral=True) for side, friction in ((3 * half, half / 5), (0, half))]
    wall = ap.Contact(2 - X - 2 * sp.cos(THETA), Y + 2 * sp.sin(THETA), 0, unilateral=True)
    box = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=feet[0], others=[feet[1], wall])
    at = dict.fromkeys(("X", "theta", "X'", "Y'", "theta'"), 0) | {"Y": 1}
    ((name, reactions),) = box.motions(at)
    system = box.rigid()
    path = ap.solve(ap.Scene(system=system, start=box.start(system, at), until="1/100"))
    assert path.modes == (name,) == ("stick+stick+closed",)
    assert all(map(math.isnan, reactions))


def test_motions_have_all_contacts_only_where_these_are_closed():
    """On the wall the ladder slides on both ends, beside it on the floor alone."""
    values = {**LEANT, "f": "1/10"}
    (held,) = _ladder(WALL).motions(values)
    path = _leant("1/10", "1/100")
    assert (held.name,) == path.modes
    floor, wall = held.reaction
    assert 0 < wall < floor < 1
    assert [name for name, _ in _ladder(WALL).motions({**values, "X": -1})] == ["slip"]


def _reactions(choice, G, free, kinetic, static, resting):
    """Return the reactions of one choice of (sign of the reaction, sign of sliding) by contact, None if it fails.

    ``G`` and ``free`` are those of the gap and the slip of every contact in turn. An open contact has the signs 0, one
    at rest the second sign 0. A contact may slip from rest with the bound ``kinetic``.
    """
    rows, right = np.array(G), -np.array(free)
    for k, (sign, sliding) in enumerate(choice):
        if not sign:
            rows[2 * k : 2 * k + 2], right[2 * k : 2 * k + 2] = np.eye(4)[2 * k : 2 * k + 2], 0
        elif sliding:
            rows[2 * k + 1], right[2 * k + 1] = np.eye(4)[2 * k + 1] + sliding * sign * kinetic[k] * np.eye(4)[2 * k], 0
    forces = np.linalg.solve(rows, right)
    rates = G @ forces + free
    for k, (sign, sliding) in enumerate(choice):
        reaction, friction = forces[2 * k : 2 * k + 2]
        pushes = sign * reaction > 0 if sign else rates[2 * k] > 0
        moves = not sliding or k not in resting or sliding * rates[2 * k + 1] > 0
        if not (pushes and moves and (sliding or abs(friction) <= static[k] * abs(reaction) + 1e-12)):
            return None
    return tuple(forces[::2])


def _choices(sliding, unilateral, rests):
    signs = (1,) if unilateral else (1, -1)
    return [*itertools.product(signs, (1, -1, 0) if rests else (sliding,)), *[(0, 0)] * int(unilateral)]


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.slow
def test_motions_of_two_contacts_are_the_choices_of_signs_that_hold_and_begin_with_static_friction(seed):
    """Every choice of open contacts, of contacts at rest, and of signs of reactions and of sliding is tried."""
    rng = np.random.default_rng(seed)
    root, W, forces = (np.round(8 * rng.normal(size=shape)) / 8 for shape in ((5, 5), (4, 5), 5))
    M, kinetic, unilateral = root @ root.T + np.eye(5), 1 / 8 + rng.integers(0, 16, 2) / 8, rng.random(2) < 1 / 2
    static, resting = kinetic + rng.integers(0, 4, 2) / 8, [0] * (seed % 2)
    directions = sp.Matrix(W).applyfunc(sp.nsimplify)
    kept = directions.extract([0, 2, *(1 for _ in resting)], range(5)).nullspace()
    velocity = sum((k * part for k, part in enumerate(kept, 1)), sp.zeros(5, 1))
    gamma = np.sign(np.array(directions @ velocity, dtype=float).ravel()[1::2])
    q, u = sp.symbols("q1:6"), sp.symbols("u1:6")
    gaps = directions @ sp.Matrix(q)
    bounds = [map(sp.Rational, map(float, pair)) for pair in zip(kinetic, static, strict=True)]
    contacts = [ap.Contact(gaps[2 * k], gaps[2 * k + 1], *bounds[k], unilateral=bool(unilateral[k])) for k in (0, 1)]
    body = ap.Mechanism(q, u, M, forces, contacts[0], others=contacts[1:])
    found = body.motions(dict.fromkeys(q, 0) | dict(zip(u, velocity, strict=True)))
    G, free = W @ np.linalg.solve(M, W.T), W @ np.linalg.solve(M, forces)
    at_onset = [static[k] if k in resting else kinetic[k] for k in (0, 1)]
    expected = []
    for choice in itertools.product(*(_choices(gamma[k], unilateral[k], k in resting) for k in (0, 1))):
        motion, onset = (_reactions(choice, G, free, bound, static, resting) for bound in (kinetic, at_onset))
        expected += [motion] if motion and onset else []
    assert np.allclose(sorted(motion.reaction for motion in found), sorted(expected))


WAYS = sp.sign(X.diff(T)) / 10


@pytest.mark.parametrize(("push", "load", "kinetic", "static", "rate"), [
    (1, 1, sp.Rational(4, 5), 1, 0),
    (sp.Rational(19, 20), 1, WAYS + sp.Rational(4, 5), WAYS + 1, 0),
    (sp.Rational(-4, 5), 1, WAYS + sp.Rational(4, 5), WAYS + 1, 0),
    (2, 1 + sp.Heaviside(X), 1, 1, -1),
    (2, 1 + sp.Heaviside(X), 1, 1, 1),
    (2, 1 + sp.Heaviside(T), 1, 1, 1),
])
def test_motions_of_a_contact_are_as_if_alone_beside_a_closed_one_apart_from_it(push, load, kinetic, static, rate):
    """A push may be as strong as static friction, and a place or a time that of an edge."""
    z, w, P = *dynamicsymbols("z w"), sp.Symbol("P")
    energy = sum(q.diff(T) ** 2 for q in (X, Y, z, w)) / 2
    own, other = ap.Contact(Y, X, kinetic, static, unilateral=True), ap.Contact(w, z, 1, unilateral=True)
    block = ap.Mechanism.from_lagrangian(energy, (X, Y, z, w), contact=own, forces={X: P, Y: -load, w: -1})
    values = {"X": 0, "Y": 0, "z": 0, "w": 0, "X'": rate, "Y'": 0, "z'": 1, "w'": 0, "P": push}
    alone = [(name.split("_")[0], reaction) for name, reaction in block.motions(values)]
    both = replace(block, others=(other,)).motions(values)
    assert [(name.replace("+", "_").split("_")[0], reaction) for name, (reaction, _) in both] == alone


def test_motions_of_several_contacts_miss_no_coordinate_that_does_not_matter_and_refuse_arrays():
    """A drawer may be anywhere along its guides."""
    moving = {**PULLED, "f": 3}
    anywhere = {name: value for name, value in moving.items() if name != "X"}
    assert _drawer().motions(anywhere) == _drawer().motions(moving)
    with pytest.raises(InputError, match="no value for theta'"):
        _drawer().motions({name: value for name, value in moving.items() if name != "theta'"})
    with pytest.raises(InputError, match="Y is an array; motion_map counts"):
        _ladder(WALL).motions({**LEANT, "Y": [0, 1], "f": 1})
