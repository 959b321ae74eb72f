"""The rigid mechanism as a system: it runs, keeps its constraint, and stops by name where the rigid model ends."""

import math
from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from mechanisms import THETA, T, X, Y, l, masses_between_guides, slender_rod
from peers import here
from scipy.integrate import solve_ivp
from scipy.optimize import linprog
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.automaton.automaton import Automaton
from asympk.automaton.modes import mode_of
from asympk.certify import certify
from asympk.errors import InputError, NoMotion, NotDerivable, TwoMotions, UnboundedReaction, Unfinished
from asympk.integrators.integrate import FAMILIES
from asympk.integrators.singular import approach
from asympk.symbolic.guards import named_branches
from asympk.systems import crank_slider

GROUND = {"m": 1, "l": 1, "g": 1}


def _start(theta, rate, sliding):
    """Return a rod of the half length 1 that touches the ground, its end sliding with the given velocity."""
    s, c = np.sin(theta), np.cos(theta)
    return {"X": 0, "Y": s, "theta": theta, "X'": sliding - s * rate, "Y'": c * rate, "theta'": rate}


def _run(theta, rate, sliding, friction, until=1.0, **options):
    start, values = _start(theta, rate, sliding), {**GROUND, "f": friction}
    return ap.solve(ap.Scene(system=slender_rod().rigid(), values=values, start=start, until=until), **options)


@pytest.mark.parametrize("unit", ["1e-8", "1e9"])
def test_a_sliding_rod_moves_alike_in_every_unit_of_length(unit):
    """Beside the angle lengths of 1e-8 were taken for rounding, and the run was refused, as if errors grew 1e9-fold."""
    scales = np.array([float(unit), float(unit), 1] * 2)
    start = dict(zip(_start(1.1, 0, 0.3), [*_start(1.1, 0, 0.3).values()] * scales, strict=True))
    values = {"m": 1, "l": unit, "g": unit, "f": 0.5}
    path = ap.solve(ap.Scene(system=slender_rod().rigid(), values=values, start=start, until=0.5))
    assert path.final / scales == pytest.approx(_run(1.1, 0, 0.3, 0.5, 0.5).final, abs=1e-8)


def test_states_are_all_coordinates_and_all_velocities():
    rigid = slender_rod().rigid()
    assert [str(s) for s in rigid.states] == ["X", "Y", "theta", "X'", "Y'", "theta'"]
    assert [mode.name for mode in rigid.modes] == ["slip_same", "slip_opposite", "stick", "open"]
    assert [str(p) for p in rigid.parameters] == ["f", "g", "l", "m"]


def test_the_sliding_rod_moves_as_its_own_equation_in_theta_says():
    """theta'' = -3 R (cos(theta) + f sin(theta)) / (m l), R = -a_N / p, for a rod that slides forward."""

    def field(_, w):
        s, c = np.sin(w[0]), np.cos(w[0])
        R = (1 - w[1] ** 2 * s) / (1 + 3 * c * (c + 0.5 * s))
        return [w[1], -3 * R * (c + 0.5 * s)]

    path = _run(1.1, 0.1, 2, 0.5)
    expected = solve_ivp(field, (0, 1), [1.1, 0.1], rtol=1e-11, atol=1e-12).y[:, -1]
    assert path.modes == ("slip_same",)
    assert [path.final[2], path.final[5]] == pytest.approx(expected, abs=1e-8)
    assert path.final[1] == pytest.approx(np.sin(path.final[2]), abs=1e-8)


@pytest.mark.parametrize("height", ["0.8912073", "0.8912074"])
@pytest.mark.parametrize("unilateral", [True, False])
def test_a_rod_by_its_displacement_stands_on_ground_whose_height_is_rounded(height, unilateral):
    """All coordinates are 0 at the start, so that parameters alone round the gap; the angle is 1.1 - theta."""
    end = {"gap": Y - l * sp.sin(sp.Rational(11, 10) - THETA) + sp.Symbol("H"), "slip": X, "unilateral": unilateral}
    rod = slender_rod(**end)
    system, state = rod.rigid(), dict.fromkeys(("X", "Y", "theta", "Y'", "theta'"), 0) | {"X'": 1}
    scenes = []
    for values in ({**GROUND, "f": "1/4", "H": H} for H in (height, math.sin(1.1))):
        known = {name: value for name, value in values.items() if name in map(str, system.parameters)}
        start = rod.start(system, {**values, **state})
        scenes.append(ap.Scene(system=system, values=known, start=start, until="1/10"))
    path, exact = map(ap.solve, scenes)
    assert path.modes == exact.modes == ("slip_same",)
    assert path.final == pytest.approx(exact.final, abs=1e-6)


TILT, END = sp.Rational(11, 10), "X - l*cos(theta)"  # the end of the rod stands on the edge of a patch at 0


def _on_an_edge(friction, sliding, turning=0, **options):
    """Follow the rod from where its friction, written by X and theta, has an edge."""
    rod = slender_rod(friction=sp.sympify(friction, {"X": X, "theta": THETA, "l": l, "t": T}))
    speeds = {"X'": sliding - turning * sp.sin(TILT), "Y'": turning * sp.cos(TILT), "theta'": turning}
    start = {"X": sp.cos(TILT), "Y": sp.sin(TILT), "theta": TILT, **speeds}
    system = rod.rigid()
    return ap.solve(ap.Scene(system=system, values=GROUND, start=rod.start(system, start), until=0.2), **options)


@pytest.mark.parametrize("options", [{}, {"method": "dop853"}, {"digits": 20}])
@pytest.mark.few(1)
def test_a_rod_that_falls_onto_an_edge_beyond_which_there_is_no_motion_has_none(options):
    """Friction 1/5 lets it fall, or slows it, to where friction 2 has no motion while the rod slides back."""
    for behind, turning in (("theta < 11/10", 0), (f"{END} + t < 0", sp.Rational(1, 4))):
        with pytest.raises(NoMotion, match=r"t = 0, .*none of slip_opposite, open is"):
            _on_an_edge(f"Piecewise((2, {behind}), (1/5, True))", -1, turning, **options)


@pytest.mark.parametrize("options", [{}, {"method": "dop853"}, {"digits": 20}])
@pytest.mark.parametrize(("rough", "alike"), [(f"{END} < 0", 2), (f"{END} > 0", "1/5")])
@pytest.mark.few(1)
def test_a_rod_at_rest_on_the_edge_of_a_patch_is_held_if_it_would_slide_onto_it_and_slides_off_else(
    rough, alike, options
):
    patch = f"Piecewise((2, {rough}), (1/5, True))"
    path, uniform = (_on_an_edge(friction, 0, **options) for friction in (patch, alike))
    assert path.modes == uniform.modes
    assert [*map(float, path.final)] == pytest.approx([*map(float, uniform.final)], abs=1e-9)


def test_inconsistent_and_indeterminate_starts_are_named_with_time_and_state():
    with pytest.raises(NoMotion, match=r"at t = 0, .*theta = 1\.1") as none:
        _run(1.1, 0.1, -1, 2)
    with pytest.raises(TwoMotions, match="open and slip_opposite") as two:
        _run(1.1, 4, -1, 2)
    for stop in (none.value, two.value):
        assert stop.t == 0
        assert float(stop.state[2]) == pytest.approx(1.1)


def test_counts_of_motions_agree_with_what_the_system_does():
    rod, rng = slender_rod(), np.random.default_rng(5)
    for _ in range(12):
        theta, rate, friction = rng.uniform([0.2, -3, 0.2], [1.4, 3, 3])
        sliding = rng.choice([-1, 1])
        count = len(rod.motions({**GROUND, "f": friction, **_start(theta, rate, sliding)}))
        with pytest.raises({0: NoMotion, 2: TwoMotions}[count]) if count != 1 else nullcontext():
            _run(theta, rate, sliding, friction, until=0)


def _singular(theta, rate, friction):
    """Return t, theta and theta' where p = a_N = 0: the time is stretched by p, so that the point is an equilibrium."""

    def field(_, w):
        s, c = np.sin(w[0]), np.cos(w[0])
        p, a = 1 + 3 * c * (c - friction * s), w[1] ** 2 * s - 1
        return [p * w[1], 3 * (c - friction * s) * a, p]

    found = solve_ivp(field, (0, 400), [theta, rate, 0.0], method="LSODA", rtol=1e-13, atol=1e-15)
    return found.y[2, -1], found.y[0, -1], found.y[1, -1]


@pytest.mark.parametrize(("theta", "rate", "friction"), [(0.6, 0.1, 1.6), (0.8, 0.6, 1.6), (0.7, 0.3, 1.7)])
def test_the_rod_slides_into_its_singular_point_to_six_digits(theta, rate, friction):
    """Génot and Brogliato (1999): p and a_N vanish together, whatever the start; t, theta, theta' there."""
    with pytest.raises(UnboundedReaction, match="grows beyond all bounds, or is not determined") as stop:
        _run(theta, rate, -5, friction, until=3)
    expected = _singular(theta, rate, friction)
    found = stop.value.t, stop.value.state[2], stop.value.state[5]
    assert found == pytest.approx(expected, rel=1e-6)
    s, c = np.sin(expected[1]), np.cos(expected[1])
    assert 1 + 3 * c * (c - friction * s) == pytest.approx(0, abs=1e-9)
    assert expected[2] ** 2 * s == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("method", [*here(*FAMILIES), None])
def test_every_integrator_stops_at_the_singular_point_by_name(method):
    options = {"method": method} if method else {"digits": 8}
    with pytest.raises(UnboundedReaction) as stop:
        _run(0.6, 0.1, -5, 1.6, until=3, **options)
    expected = _singular(0.6, 0.1, 1.6)
    assert (stop.value.t, stop.value.state[2], stop.value.state[5]) == pytest.approx(expected, rel=1e-6)


def test_a_run_that_ends_before_the_singular_point_is_not_stopped_by_it():
    path = _run(0.6, 0.1, -5, 1.6, until=0.6)
    assert path.modes == ("slip_opposite",)
    assert path.info["reached"] == 0.6


@pytest.mark.further
def test_no_singular_point_is_looked_for_without_end_in_a_motion_that_turns_too_often():
    start, values = _start(1.1, 0, -1), {**GROUND, "g": "1e300", "f": "1/2"}
    with pytest.raises(Unfinished, match="stalled"):
        ap.solve(ap.Scene(system=slender_rod().rigid(), values=values, start=start, until="1/2"))


def test_a_rod_that_falls_on_the_ground_hits_it():
    start = {**_start(1.1, 0, 0), "Y": 1.2}
    scene = ap.Scene(system=slender_rod().rigid(), values={**GROUND, "f": 1}, start=start, until=5)
    with pytest.raises(NoMotion, match="no law of impact") as stop:
        ap.solve(scene)
    assert stop.value.t == pytest.approx(np.sqrt(2 * (1.2 - np.sin(1.1))), rel=1e-8)


def test_a_rod_that_rises_lifts_off_where_its_reaction_vanishes():
    path = _run(0.3, 1.3, -9, 1.6)
    assert path.modes == ("slip_opposite", "open")
    (lift,) = path.events
    assert lift.kind == "lift_off"
    assert lift.state[5] ** 2 * np.sin(lift.state[2]) == pytest.approx(1, abs=1e-8)
    assert path.final[1] > np.sin(path.final[2])


def test_a_rod_that_barely_lifts_off_comes_down_again():
    """The steps that follow it from the ground leave it within their error, on either side: here it begins below."""
    theta, rate = 0.3989730656014805, -1.629363061200547
    with pytest.raises(NoMotion, match="the contact is hit") as stop:
        _run(theta, rate, 0, 1)
    t = float(stop.value.t)
    height = np.sin(theta) + t * np.cos(theta) * rate - t * t / 2
    assert 0.02 < t < 0.03
    assert height == pytest.approx(np.sin(theta + t * rate), abs=1e-9)


def test_errors_do_not_grow_at_a_touch_that_opens_again_at_once():
    """The gap grows with the cube of the time from where the rod lifts off: there the steps find it touching again."""
    theta, rate, t = 0.16567167807565086, 1.3798407308792577, 1.5
    path = _run(theta, rate, 0.14748678012848926, 2.346545724889712, until=t)
    assert path.modes == ("slip_same", "open")
    (lift,) = path.events
    assert path.final[1] == pytest.approx(
        lift.state[1] + (t - lift.t) * lift.state[4] - (t - lift.t) ** 2 / 2, abs=1e-8)


@pytest.mark.parametrize(
    ("theta", "rate", "friction", "modes"),
    [(2.2353619718598337, -0.6426325846760959, 2.5289954360590987, ("stick",)),
     (2.4018907047129474, -1.7890714264937957, 2.9310776552119533, ("open",))],
)
def test_a_sliding_velocity_that_is_the_rounding_of_a_start_is_rest(theta, rate, friction, modes):
    """X' + sin(theta) theta' is some 1e-17 in doubles: a rod that slid would have no motion here, or two."""
    start = {**_start(theta, rate, 0), **GROUND, "f": friction}
    ((name, _),) = slender_rod().motions(start)
    assert name == modes[0].replace("open", "lift_off")
    for digits in (None, 20):
        assert _run(theta, rate, 0, friction, until=0.1, digits=digits).modes == modes


@pytest.mark.parametrize("height", ["0.891207", "0.891208"])
def test_a_rod_whose_numbers_were_rounded_by_hand_starts_on_the_ground(height):
    """sin(1.1) = 0.8912073..."""
    rod = slender_rod().rigid()
    rolls, stands = (ap.solve(ap.Scene(system=rod, values={**GROUND, "f": 1}, start=start, until="0.01"))
                     for start in ({**_start(1.1, 0, -1), "Y": height}, _start(1.1, 0, -1)))
    assert rolls.modes == stands.modes
    assert rolls.final == pytest.approx(stands.final, abs=2e-6)
    with pytest.raises(NoMotion, match="none of slip_opposite, open is consistent"):
        ap.solve(ap.Scene(system=rod, values={**GROUND, "f": 2}, start={**_start(1.1, 0, -1), "Y": height}, until=1))


def test_a_rod_below_the_ground_is_refused():
    start = {**_start(1.1, 0, 0), "Y": 0.5}
    with pytest.raises(InputError, match="of the contact is negative"):
        ap.solve(ap.Scene(system=slender_rod().rigid(), values={**GROUND, "f": 1}, start=start, until=1))


@pytest.mark.parametrize(("tangent", "velocity"), [(1, 1), (1, -1), (5, 1), (5, -1)])
def test_painleve_and_kleins_rigid_rod_stops_where_it_has_a_paradox(tangent, velocity):
    """Steep: two motions forward, none backward; shallow: x1'' = R cos(alpha) / m with R of (1.3)."""
    alpha = np.arctan(tangent)
    values = {"m": 1, "P": 3, "f": 1, "alpha": alpha}
    start = {"x1": 0, "x2": 0, "x1'": velocity, "x2'": velocity}
    scene = ap.Scene(system=masses_between_guides().rigid(), values=values, start=start, until=0.1)
    if tangent == 5:
        with pytest.raises(TwoMotions if velocity > 0 else NoMotion):
            ap.solve(scene)
        return
    R = 3 / (2 * np.cos(alpha) + velocity * np.sin(alpha))
    assert ap.solve(scene).final[2] == pytest.approx(velocity + 0.1 * R * np.cos(alpha), rel=1e-9)


def test_a_slide_into_the_paradox_of_a_guide_stops_where_the_second_motion_comes_up():
    """The slender rod's end on a wire that holds both ways: sliding on is possible, but no longer the only way."""
    rod = slender_rod(unilateral=False)
    scene = ap.Scene(system=rod.rigid(), values={**GROUND, "f": 1.6}, start=_start(1.45, -0.1, 5), until=3)
    with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as stop:
        ap.solve(scene)
    s, c = np.sin(float(stop.value.state[2])), np.cos(float(stop.value.state[2]))
    assert 1 + 3 * c**2 == pytest.approx(4.8 * s * c, abs=1e-8)


@pytest.mark.parametrize(
    ("theta", "rate", "friction", "t"),
    [(1.9132583048038097, 0.7744913388116608, 1.5884991102906318, 0.3614353375),
     (1.8195289525024236, -0.9596102090511072, 2.527650487042656, 0.5922862007)],
)
def test_a_bead_that_begins_to_slide_within_the_paradox_stops_as_it_has_two_motions(theta, rate, friction, t):
    """At rest only one of them exists; the paradox ends later in the first case, and goes on in the second."""
    rod, values = slender_rod(unilateral=False), {**GROUND, "f": friction}
    with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as stop:
        ap.solve(ap.Scene(system=rod.rigid(), values=values, start=_start(theta, rate, 0), until=2))
    state = dict(zip(("X", "Y", "theta", "X'", "Y'", "theta'"), map(float, stop.value.state), strict=True))
    G, a_T = rod.delassus, rod.evaluate(rod.free[1], {**values, **state})
    side = np.sign(a_T - rod.evaluate(G[0, 1] / G[0, 0] * rod.free[0], {**values, **state}))
    assert float(stop.value.t) == pytest.approx(t, abs=1e-8)
    assert len(rod.motions({**values, **state, "X'": state["X'"] + 1e-6 * side})) == 2


def _turning(theta, rate, numbers):
    """theta'' of a crank by the force S in its massless rod, whose share across the guide is the load there."""
    J, m, l, T, f = numbers
    phi, turn = np.arcsin(np.sin(theta) / l), np.cos(theta)
    slope = -np.sin(theta) - turn * np.tan(phi)
    bend = -turn + np.sin(theta) * np.tan(phi) - turn**2 / (l * np.cos(phi) ** 3)
    lever = np.sin(theta + phi)
    for sign in (1, -1):
        along = np.cos(phi) + sign * np.sign(slope * rate) * f * abs(np.sin(phi))
        S = -m * (slope * T / J + bend * rate**2) / (along - m * slope * lever / J)
        if S * sign >= 0:
            return (T - S * lever) / J
    raise AssertionError


@pytest.mark.parametrize(
    ("numbers", "start", "until"),
    [((1.3884, 0.6459, 1.4304, 0.001, 0.7278), (6.159, 1.8466), 0.5),
     ((2.9099884675471634, 1.0787352528264027, 2.264333561607687, 1.777512139872515, 0.8407446654635987),
      (3.8956130895130054, -0.9999266402719549), 2.0),
     ((2.281091964789678, 1.892571396628294, 2.4714851332250576, 1.7283835618892578, 1.308658141988356),
      (3.170039086236588, -0.602016886811747), 0.5),
     ((2, 1, 1.2, 1, 0.2), (1.0, 1.0), 4.0)],
)
@pytest.mark.parametrize("options", [{}, {"method": "radau", "rtol": 1e-9}, {"method": "dop853", "rtol": 1e-9}])
@pytest.mark.few(0)
def test_a_crank_passes_the_dead_centre_of_its_slider(numbers, start, until, options):
    """The slider stops there whatever the friction, its sliding velocity no longer depends on that of the crank.

    Where the load vanished beside it, next to 0 by the rounding of phi, it counted as one that has jumped, for ever.
    """
    (theta, rate), (_, _, l, _, _) = start, numbers
    phi = np.arcsin(np.sin(theta) / l)
    state = {"theta": theta, "phi": phi, "theta'": rate, "phi'": np.cos(theta) * rate / (l * np.cos(phi))}
    values = {"r": 1, **dict(zip(("J", "m", "l", "T", "f"), numbers, strict=True))}
    scene = ap.Scene(system=crank_slider.mechanism().rigid(), values=values, start=state, until=until)
    path = ap.solve(scene, **options)
    truth = solve_ivp(lambda _, w: [w[1], _turning(*w, numbers)], (0, until), start, rtol=1e-9, atol=1e-9)
    assert (path.final[0], path.final[2]) == pytest.approx(tuple(truth.y[:, -1]), abs=1e-6)


@pytest.mark.further
def test_two_references_in_which_the_events_at_a_dead_centre_come_in_another_order_are_the_same_motion():
    """Load and sliding velocity vanish there together; the run was refused, as one that passes different modes."""
    phi = np.arcsin(np.sin(1.0) / 1.2)
    start = {"theta": 1, "phi": phi, "theta'": 1, "phi'": np.cos(1.0) / (1.2 * np.cos(phi))}
    scene = ap.Scene(system=crank_slider.mechanism().rigid(), start=start, until=4,
                     values={"r": 1, "J": 2, "m": 1, "l": 1.2, "T": 1, "f": 0.2})
    coarse, fine = (ap.solve(scene, digits=digits) for digits in (15, 20))
    assert [*map(float, coarse.final)] == pytest.approx([*map(float, fine.final)], abs=1e-14)


@pytest.mark.further
def test_a_crank_and_its_slider_with_the_rod_between_them_as_a_constraint_turn_as_in_the_angle_alone():
    """Y' is the sliding velocity of the rod and the gap rate of the guide: it stays 0, though no expansion shows it."""
    J, M, W, L, friction, until = 2, 1, 10, 1.5, 0.5, 0.5
    m, g, r, f, D = sp.symbols("m g r f D", positive=True)
    x, y = X - r * sp.cos(THETA), Y - r * sp.sin(THETA)
    link = ap.Contact(gap=sp.sqrt(x**2 + y**2) - L, slip=Y, friction=0)
    energy = THETA.diff(T) ** 2 + m * (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - m * g * Y
    guided = {"contact": ap.Contact(Y, X, f), "others": [link], "forces": {THETA: D}}
    crank = ap.Mechanism.from_lagrangian(energy, (THETA, X, Y), **guided).rigid()

    def slope(angle):
        phi = np.arcsin(np.sin(angle) / L)
        return phi, -np.sin(angle) - np.cos(angle) * np.tan(phi)

    def rates(_, w):
        """The rod pushes by S with the lever sin(angle + phi); the guide bears W + S sin(phi), and X falls."""
        (angle, rate), (phi, dX) = w, slope(w[0])
        bend = np.sin(angle) * np.tan(phi) - np.cos(angle) - np.cos(angle) ** 2 / (L * np.cos(phi) ** 3)
        lever = np.sin(angle + phi)
        S = M * (dX / J + bend * rate**2) - friction * W
        S /= np.cos(phi) + friction * np.sin(phi) - M * dX * lever / J
        return rate, (1 + S * lever) / J

    phi, dX = slope(1.0)
    state = {"theta": 1, "X": np.cos(1) + L * np.cos(phi), "Y": 0, "theta'": 1, "X'": dX, "Y'": 0}
    values = {"m": M, "g": W, "f": friction, "r": 1, "D": 1}
    path = ap.solve(ap.Scene(system=crank, values=values, start=state, until=until))
    truth = solve_ivp(rates, (0, until), (1.0, 1.0), rtol=1e-11, atol=1e-11)
    assert (path.final[0], path.final[3]) == pytest.approx(tuple(truth.y[:, -1]), abs=1e-8)


def test_guides_that_share_a_reaction_have_a_second_motion_where_their_frictions_differ_by_two():
    """Masses between two rough guides, by a rod at 45 degrees: 2 N -+ (x - 1/2) |N| = P, the first guide's friction x.

    For N < 0 the loads of both guides turn.
    """
    x, v, w, N, F, G = sp.symbols("x v w N F G", real=True)
    rates = {x: v, v: 1 + N + F, w: -N + G}
    guides = [ap.Friction(v, F, N, x, normal=N, constraint=rates[v] - rates[w], gap_rate=v - w),
              ap.Friction(w, G, N, sp.Rational(1, 2))]
    system = ap.System.with_frictions(rates, {}, guides)
    with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as stop:
        ap.solve(ap.Scene(system=system, start={"x": 1, "v": 5, "w": 5}, until=1))
    assert stop.value.state[0] == pytest.approx(2.5, abs=1e-9)


@pytest.mark.parametrize("order", [1, -1])
def test_a_smooth_guide_whose_reaction_presses_a_rough_one_has_the_second_motion_of_that_one(order):
    """Backwards 2 N - (4 - x) |N| = -1: N = -1/(6 - x) and, below x = 2, N = 1/(2 - x)."""
    x, v, w, N, F, G = sp.symbols("x v w N F G", real=True)
    rates = {x: v, v: 1 + N + F, w: -N + G}
    guides = [ap.Friction(v, F, N, 0, normal=N, constraint=rates[v] - rates[w], gap_rate=v - w),
              ap.Friction(w, G, N, 4 - x)]
    system = ap.System.with_frictions(rates, {}, guides[::order])
    with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as stop:
        ap.solve(ap.Scene(system=system, start={"x": 3, "v": -5, "w": -5}, until=1))
    assert stop.value.state[0] == pytest.approx(2, abs=1e-9)


@pytest.mark.parametrize(("push", "error"), [(1, TwoMotions), (-1, UnboundedReaction)])
def test_a_guide_that_rests_in_one_direction_has_the_paradox_of_its_slip_in_the_other(push, error):
    """push + N - x |N|/2 = 0 in slip: N > 0 agrees with push = 1 beyond x = 2, and grows without bounds of -1."""
    x, v, w, u, N, F, G = sp.symbols("x v w u N F G", real=True)
    rates = {x: w, v: F, w: x * N + G, u: push + N + x * G}
    half = sp.Rational(1, 2)
    guide = [ap.Friction(v, F, N, half, normal=N, constraint=rates[u], gap_rate=u), ap.Friction(w, G, N, half)]
    system = ap.System.with_frictions(rates, {}, guide)
    with pytest.raises(error) as stop:
        ap.solve(ap.Scene(system=system, start={"x": 1, "v": 0, "w": 5, "u": 0}, until=1))
    assert stop.value.state[0] == pytest.approx(2, abs=1e-6)


@pytest.mark.parametrize("friction", [0, sp.Symbol("f")])
def test_a_wall_far_off_does_not_hide_the_second_motion_of_a_guide(friction):
    rod = slender_rod(unilateral=False)
    wall = ap.Contact(100 - rod.coordinates[0], rod.coordinates[1], friction, unilateral=True)
    stops = []
    for mechanism in (rod, replace(rod, others=(wall,))):
        system, values = mechanism.rigid(), {**GROUND, "f": 1.6}
        with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as stop:
            ap.solve(ap.Scene(system=system, values=values, start=_start(1.45, -0.1, 5), until=3))
        stops.append(stop.value.state)
    assert stops[1] == pytest.approx(stops[0], abs=1e-8)


@pytest.mark.parametrize("velocity", [9, "1/10", 0])
def test_a_block_that_slides_beside_it_does_not_hide_the_second_motion_of_a_guide(velocity):
    rod, (w, G) = slender_rod(unilateral=False).rigid(), sp.symbols("w G", real=True)
    block = ap.Friction(velocity=w, force=G, load=sp.S.One, kinetic=sp.S.Half, static=sp.S.Half)
    both = ap.System.with_frictions({**rod.slow, w: G}, {}, (*rod.frictions, block))
    start, values = _start(1.45, -0.1, 5), {**GROUND, "f": 1.6}
    stops = []
    for system, begin in ((rod, start), (both, {**start, "w": velocity})):
        with pytest.raises(TwoMotions, match="a second motion of the contact comes up") as stop:
            ap.solve(ap.Scene(system=system, values=values, start=begin, until=3))
        stops.append(stop.value.state)
    assert stops[1][:6] == pytest.approx(stops[0], abs=1e-8)


@pytest.mark.parametrize("velocity", [1, -1])
@pytest.mark.parametrize("digits", [None, 20])
@pytest.mark.parametrize("unilateral", [True, False])
def test_a_block_whose_weight_a_pull_just_takes_off_has_one_motion_along_the_ground(unilateral, digits, velocity):
    X, Y, U, V, P, f = sp.symbols("X Y U V P f", real=True)
    block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, P - 1), ap.Contact(Y, X, f, unilateral=unilateral))
    start = {"X": 0, "Y": 0, "U": velocity, "V": 0}
    path = ap.solve(ap.Scene(system=block.rigid(), values={"P": 1, "f": "1/2"}, start=start, until=2), digits=digits)
    assert path.events == ()
    assert path.final == pytest.approx((2 * velocity, 0, velocity, 0))


@pytest.mark.parametrize("method", [{}, {"method": "dop853"}, {"method": "radau"}, {"digits": 15}])
@pytest.mark.parametrize("by_time", [True, False])
@pytest.mark.parametrize("kinked", [True, False])
@pytest.mark.few(3)
def test_a_block_flies_off_where_its_ground_falls_away_and_hits_it_where_that_rises(kinked, by_time, method):
    X, Y, U, V, t = sp.symbols("X Y U V t", real=True)
    past = (t if by_time else X) - 1
    change = sp.Max(0, past) if kinked else sp.Piecewise((0, past < 0), (sp.S.Half, True))
    start, met = {"X": "1/2", "Y": 0, "U": 2, "V": 0}, 1 if by_time else 8 - 4 * math.sqrt(3.75)
    for sign in (-1, 1):
        ground = ap.Contact(Y - sign * change, X, sp.Rational(1, 4), unilateral=True)
        block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, -1), ground, time=t).rigid()
        scene = ap.Scene(system=block, values={}, start=start, until="5/4")
        if sign > 0:
            with pytest.raises(NoMotion, match="the contact is hit") as stop:
                ap.solve(scene, **method)
            assert float(stop.value.t) == pytest.approx(met, abs=1e-7)
            continue
        path, speed, left = ap.solve(scene, **method), 2 - met / 4, 1.25 - met
        assert path.modes == ("slip_same", "open")
        flown = (0.5 + 2 * met - met**2 / 8 + speed * left, -(left**2) / 2, speed, -left)
        assert path.final == pytest.approx(flown, abs=1e-6)


def _block_on(height, start, until=1, pull=0, **options):
    """Return the path of a block of the weight 1 and the friction 1/4 on ground of a height over X; pull t pulls it."""
    X, Y, U, V, t = sp.symbols("X Y U V t", real=True)
    ground = ap.Contact(Y - height(X), X, sp.Rational(1, 4), unilateral=True)
    block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (pull * t, -1), ground, time=t).rigid()
    scene = ap.Scene(system=block, values={}, start=dict(zip("XYUV", start, strict=True)), until=until)
    return ap.solve(scene, **options)


@pytest.mark.parametrize("method", [{}, {"method": "dop853"}, {"digits": 15}])
def test_a_block_that_starts_on_a_kink_of_its_ground_hits_the_side_it_moves_to_or_flies_off(method):
    for velocity in (1, -1):
        with pytest.raises(NoMotion, match="the contact is hit at t = 0"):
            _block_on(sp.Abs, (0, 0, velocity, 0), **method)
        path = _block_on(lambda X: -sp.Abs(X), (0, 0, velocity, 0), **method)
        assert path.modes == ("open",)
        assert path.final == pytest.approx((velocity, -0.5, velocity, -1))


@pytest.mark.parametrize("method", [{}, {"method": "dop853"}, {"digits": 15}])
@pytest.mark.few(1)
def test_a_block_rests_at_the_foot_of_a_ramp_until_a_pull_moves_it_on_the_flat_or_up_the_ramp(method):
    """On the flat U' = t - 1/4 follows; on the ramp N = 1 + U' and U' = t - 5 N/4, that is 9 U'/4 = t - 5/4."""
    for pull, onset in ((0, []), (-1, [0.25]), (1, [1.25])):
        path = _block_on(lambda X: sp.Max(0, X), (0, 0, 0, 0), until=2, pull=pull, **method)
        assert [event.t for event in path.events] == pytest.approx(onset)
        assert path.modes == ("stick", *(["slip_same" if pull > 0 else "slip_opposite"] if pull else []))
        left = 2 - sum(onset) if pull else 0
        assert path.final[0] == pytest.approx(pull * left**3 / (6 * (9 / 4 if pull > 0 else 1)))


@pytest.mark.parametrize("method", [{}, {"method": "dop853"}, {"digits": 15}])
@pytest.mark.parametrize("by_time", [True, False])
def test_a_block_that_flies_hits_a_step_of_its_ground_though_it_rises_and_passes_over_a_lower_one(by_time, method):
    def step(X):
        return sp.Piecewise((0, 4 * sp.Symbol("t", real=True) < 1 if by_time else X < 1), (sp.S.Half, True))

    for height, rise in (("1/10", "1/2"), ("1/10", 0), ("1/10", "1/4")):
        with pytest.raises(NoMotion, match=r"the contact is hit at t = 0\.25, X = 1,"):
            _block_on(step, ("1/2", height, 2, rise), until="1/2", **method)
    path = _block_on(step, ("1/2", "51/100", 2, "1/2"), until="1/2", **method)
    assert path.modes == ("open",)
    assert path.final == pytest.approx((1.5, 0.635, 2, 0))


@pytest.mark.parametrize("method", [{}, {"method": "dop853"}, {"digits": 15}])
@pytest.mark.few(2)
def test_a_block_slides_on_where_its_ground_begins_to_rise_smoothly(method):
    X, Y, U, V = sp.symbols("X Y U V", real=True)
    ramp = sp.Max(0, X - 1) ** 2 / 2
    block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, -1), ap.Contact(Y - ramp, X, 0, unilateral=True))
    scene = ap.Scene(system=block.rigid(), values={}, start={"X": 0, "Y": 0, "U": 2, "V": 0}, until=2)
    path = ap.solve(scene, **method)
    x, y, u, v = map(float, path.final)
    assert len(path.modes) == 1
    assert (y, (u**2 + v**2) / 2 + y) == pytest.approx(((x - 1) ** 2 / 2, 2), abs=1e-6)


def test_a_rod_without_a_weight_slides_on_along_the_ground():
    X, Y, theta = dynamicsymbols("X Y theta")
    t, (f, g) = dynamicsymbols._t, sp.symbols("f g", real=True)
    energy = (X.diff(t) ** 2 + Y.diff(t) ** 2) / 2 + theta.diff(t) ** 2 / 24 - g * Y
    ground = ap.Contact(gap=Y - sp.sin(theta) / 2, slip=X - sp.cos(theta) / 2, friction=f, unilateral=True)
    rigid = ap.Mechanism.from_lagrangian(energy, (X, Y, theta), contact=ground).rigid()
    start = {"X": 0, "Y": math.sin(1.1) / 2, "theta": 1.1, "X'": -1, "Y'": 0, "theta'": 0}
    path = ap.solve(ap.Scene(system=rigid, values={"f": 1, "g": 0}, start=start, until=1))
    assert len(path.modes) == 1
    assert path.final == pytest.approx((-1, math.sin(1.1) / 2, 1.1, -1, 0, 0))


def _on_a_belt(belt, thing=None):
    """A rod, or a block, on a belt whose velocity is given in time."""
    X, Y, theta = dynamicsymbols("X Y theta")
    t = dynamicsymbols._t
    angle = sp.S.Zero if thing == "block" else theta
    energy = (X.diff(t) ** 2 + Y.diff(t) ** 2) / 2 + sp.Rational(1, 24) * angle.diff(t) ** 2 - 10 * Y
    ground = ap.Contact(gap=Y - sp.sin(angle) / 2, slip=X.diff(t) + (sp.cos(angle) / 2).diff(t) - belt(t),
                        friction=sp.Rational(3, 10), unilateral=True)
    return ap.Mechanism.from_lagrangian(energy, (X, Y, theta)[: 2 if thing == "block" else 3], contact=ground)


@pytest.mark.parametrize("contact", ["rigid", "elastic"])
def test_a_block_meets_a_belt_whose_velocity_alone_depends_on_time_and_goes_on_with_it(contact):
    """X' = 3 t meets 1 + sin(t) and keeps to it, as |cos(t)| < 3."""
    block = _on_a_belt(lambda t: 1 + sp.sin(t), "block")
    c, h = sp.symbols("c h", positive=True)
    system = block.rigid() if contact == "rigid" else block.elastic(compliance=c, damping=h)
    start = block.start(system, {"X": 0, "Y": 0, "X'": 0, "Y'": 0})
    values = {} if contact == "rigid" else {"c": "1/1000000", "h": 1}
    path = ap.solve(ap.Scene(system=system, values=values, start=start, until=2))
    met = sp.nsolve(3 * sp.Symbol("t") - 1 - sp.sin(sp.Symbol("t")), 0.5)
    travelled = 3 * met**2 / 2 + (2 - met) + sp.cos(met) - sp.cos(2)
    assert path.modes[-2:] == ("slip_opposite", "stick")
    assert path.events[-1].t == pytest.approx(float(met), abs=1e-9 if contact == "rigid" else 1e-4)
    assert path.final[0] == pytest.approx(float(travelled), abs=1e-9 if contact == "rigid" else 1e-4)


@pytest.mark.parametrize("digits", [None, 30])
def test_a_block_slides_on_where_the_table_that_shakes_it_just_takes_its_weight_away(digits):
    """The table rises as sin t, and the load 1 - sin t vanishes at pi/2 and comes back: nothing opens there."""
    X, Y, U, V, f, t = sp.symbols("X Y U V f t", real=True)
    table = ap.Contact(gap=Y - sp.sin(t), slip=U, friction=f, unilateral=True)
    block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, -1), table, t).rigid()
    start = {"X": 0, "Y": 0, "U": 1, "V": 1}
    path = ap.solve(ap.Scene(system=block, values={"f": "1/2"}, start=start, until=3), digits=digits)
    assert path.modes == ("slip_same",)
    assert float(path.final[2]) == pytest.approx(1 - (3 - 1 + np.cos(3)) / 2, rel=1e-14)
    assert float(path.final[1]) == pytest.approx(np.sin(3), rel=1e-14)


def test_the_look_for_a_singular_point_ends_where_the_mode_ends():
    """Past its sliding velocity's zero the slip does not go on; followed there, its angle turns for ever faster."""
    rod = _on_a_belt(lambda t: sp.sin(3 * t))
    height, fall = math.sin(0.3) / 2, -0.2 * math.cos(0.3)
    start = {"X": 0.1, "Y": height, "theta": 0.3, "X'": -0.7, "Y'": fall, "theta'": -0.4}
    system = rod.rigid()
    scene = ap.Scene(system=system, start=rod.start(system, start), until=1)
    automaton = Automaton(system, scene.values)
    mode = automaton.mode(automaton.first(scene.start))
    calls, field = [], mode.field
    vars(mode)["field"] = lambda *at: calls.append(at) or field(*at)
    guard = [kind for kind, _ in mode.kinds].index("unbounded")
    assert approach(mode, guard, 0.0, tuple(map(float, scene.start)), 1.0) is None
    assert max(at[0] for at in calls) < 1.1 * ap.solve(scene).events[0].t


@pytest.mark.parametrize("method", ["exact", *here("lsoda", "radau", "heyoka")])
def test_a_run_begun_anew_from_a_point_of_a_path_goes_on_as_the_path_does(method):
    # off its ground by the error of the integrator the rod was free there, and hit the ground at once
    path = _run(1.1, 0.1, 2, 0.5, method=method)
    middle = path(0.4)
    again = ap.Scene(system=path.scene.system, values={**GROUND, "f": 0.5}, start=middle.tolist(), until="0.6")
    found = ap.solve(again, method)
    assert found.modes == path.modes
    assert found.final == pytest.approx(path.final, abs=5e-10 if method == "exact" else 2e-6)
    for _, y, theta, _, rate, turn in (middle, path.final):
        assert (y, rate) == pytest.approx((np.sin(theta), np.cos(theta) * turn), abs=1e-15)


def test_a_bead_on_a_wire_keeps_its_energy_where_its_spring_has_a_length_at_rest():
    X, Y = dynamicsymbols("X Y")
    U, V = X.diff(), Y.diff()
    kinetic, potential = (U**2 + V**2) / 2, Y + (sp.sqrt((X - 1) ** 2 + (Y - 2) ** 2) - 1) ** 2 / 2
    wire = sp.cos(X) / 3
    along = (U + wire.diff(X) * V) / sp.sqrt(1 + wire.diff(X) ** 2)
    bead = ap.Mechanism.from_lagrangian(kinetic - potential, (X, Y), contact=ap.Contact(Y - wire, along, 0))
    rigid = bead.rigid()
    start = bead.start(rigid, {"X": 0.3, "Y": math.cos(0.3) / 3, "X'": 1, "Y'": -math.sin(0.3) / 3})
    path = ap.solve(ap.Scene(system=rigid, values={}, start=start, until=2))
    energy = sp.lambdify((X, Y, U, V), kinetic + potential)
    assert energy(*path.final) == pytest.approx(energy(*map(float, path.scene.start)), abs=1e-9)


def _ladder():
    """Return a rod of the half length 1 that stands on the ground and leans against a wall, both rough."""
    X, Y, h, U, V, W, N1, N2, F1, F2 = sp.symbols("X Y h U V W N1 N2 F1 F2", real=True)
    rates, (s, c) = {X: U, Y: V, h: W}, (sp.sin(h), sp.cos(h))
    gaps, ends = (Y - s, X - c), (X + c, Y + s)
    turning = 3 * sum(e.diff(h) * r for e, r in zip((*gaps, *ends), (N1, N2, F1, F2), strict=True))
    rates |= {U: N2 + F1, V: N1 + F2 - 1, W: turning}

    def rate(expr):
        return sum(expr.diff(q) * r for q, r in rates.items())

    contacts = [ap.Friction(velocity=rate(end), force=F, load=N, kinetic=f, gap=gap, normal=N,
                            constraint=rate(rate(gap)))
                for end, gap, F, N, f in zip(ends, gaps, (F1, F2), (N1, N2), sp.symbols("f1 f2", positive=True),
                                             strict=True)]
    return ap.System.with_frictions(rates, {}, contacts)


def test_a_sled_with_a_pendulum_takes_few_steps_though_its_height_is_rounding_alone():
    X, Y, theta = dynamicsymbols("X Y theta")
    places = (X, Y, X + sp.sin(theta), Y - sp.cos(theta))
    energy = sum(place.diff(dynamicsymbols._t) ** 2 for place in places) / 2 - 10 * (Y + places[3])
    guide = ap.Contact(gap=Y, slip=X, friction=sp.Rational(1, 10))
    sled = ap.Mechanism.from_lagrangian(energy, (X, Y, theta), contact=guide)
    start = {"X": 0, "Y": 0, "theta": 1, "X'": 2, "Y'": 0, "theta'": 0}
    path = ap.solve(ap.Scene(system=sled.rigid(), values={}, start=start, until=1))
    assert path.info["work"]["steps"] < 500


def test_a_ladder_slides_on_two_contacts_as_its_one_equation_says_until_it_leaves_the_wall():
    """theta'' and both reactions solve three linear equations where both ends slide down."""
    f1, f2, theta, rate = 0.35, 0.09, 0.9, -0.5

    def forces(angle, w):
        s, c = np.sin(angle), np.cos(angle)
        rows = [[-s, f1, -1], [c, -1, -f2], [1 / 3, c - f1 * s, -s - f2 * c]]
        return np.linalg.solve(rows, [c * w * w, s * w * w - 1, 0])

    def leaves(_, w):
        return forces(*w)[2]

    leaves.terminal = True
    truth = solve_ivp(lambda _, w: [w[1], forces(*w)[0]], (0, 1), [theta, rate], rtol=1e-11, atol=1e-12, events=leaves)
    s, c = np.sin(theta), np.cos(theta)
    start = {"X": c, "Y": s, "h": theta, "U": -s * rate, "V": c * rate, "W": rate}
    path = ap.solve(ap.Scene(system=_ladder(), values={"f1": "0.35", "f2": "0.09"}, start=start, until=1))
    (event,) = path.events
    assert path.modes == ("slip_same+slip_opposite", "slip_same+open")
    assert (event.kind, event.friction, event.t) == ("lift_off", 1, pytest.approx(truth.t[-1], abs=1e-8))
    assert (event.state[2], event.state[5]) == pytest.approx(tuple(truth.y[:, -1]), abs=1e-8)


@pytest.mark.further
def test_a_block_on_two_feet_rests_as_long_as_some_forces_hold_it_and_slides_to_rest():
    X, Y, h, U, V, W, N1, N2, F1, F2 = sp.symbols("X Y h U V W N1 N2 F1 F2", real=True)
    f, push = sp.symbols("f P", positive=True)
    rates, (s, c) = {X: U, Y: V, h: W}, (sp.sin(h), sp.cos(h))
    feet = [(X + side * c + s / 2, Y + side * s - c / 2) for side in (1, -1)]
    turning = sum(N * y.diff(h) + F * x.diff(h) for (x, y), N, F in zip(feet, (N1, N2), (F1, F2), strict=True))
    rates |= {U: F1 + F2 + push, V: N1 + N2 - 1, W: turning * sp.Rational(12, 5)}

    def rate(expr):
        return sum(expr.diff(q) * r for q, r in rates.items())

    contacts = [ap.Friction(velocity=rate(x), force=F, load=N, kinetic=f, gap=y, normal=N, constraint=rate(rate(y)))
                for (x, y), N, F in zip(feet, (N1, N2), (F1, F2), strict=True)]
    block, start = ap.System.with_frictions(rates, {}, contacts), {"X": 0, "Y": "1/2", "h": 0, "U": 0, "V": 0, "W": 0}
    path = ap.solve(ap.Scene(system=block, values={"f": "3/5", "P": "9/10"}, start=start, until=1))
    assert path.modes == ("slip_same+slip_same",)
    assert path.final[0] == pytest.approx((0.9 - 0.6) / 2, abs=1e-9)
    for friction, held in (("3/5", "1/2"), ("3/10", "1/7"), ("3/10", "3/10"), ("1/10", "1/10")):
        scene = ap.Scene(system=block, values={"f": friction, "P": held}, start=start, until=1)
        for digits in (None, 25):
            path = ap.solve(scene, digits=digits)
            assert path.modes == ("stick+stick",)
            assert path.final == scene.start
    pushed = ap.Scene(system=block, values={"f": "3/10", "P": "0.300001"}, start=start, until=1)
    assert ap.solve(pushed).modes == ("slip_same+slip_same",)
    thrown = ap.Scene(system=block, values={"f": "3/10", "P": "1/10"}, start={**start, "U": 1}, until=6)
    path = ap.solve(thrown)
    (stop,) = path.events
    assert path.modes == ("slip_same+slip_same", "stick+stick")
    assert (stop.t, path.final[0]) == (pytest.approx(5), pytest.approx(2.5))


def _body(feet, normals, push=None):
    """Return a body whose feet, points of it, stand on planes with these normals, under a weight, a push and a turn."""
    X, Y, h, U, V, W = sp.symbols("X Y h U V W", real=True)
    P, M = sp.symbols("P M", real=True)
    N, F, f = (sp.symbols(f"{name}1:{len(feet) + 1}", real=True) for name in "NFf")
    at = [(X + a * sp.cos(h) - b * sp.sin(h), Y + a * sp.sin(h) + b * sp.cos(h)) for a, b in feet]
    gaps = [(x - a) * n + (y - b) * m for (x, y), (a, b), (n, m) in zip(at, feet, normals, strict=True)]
    ends = [x * m - y * n for (x, y), (n, m) in zip(at, normals, strict=True)]
    pairs = [*zip(gaps, N, strict=True), *zip(ends, F, strict=True)]
    rates = {X: U, Y: V, h: W}
    loads = zip((X, Y, h), (U, V, W), (P if push is None else push, -1, M), strict=True)
    rates |= {v: sum(e.diff(q) * u for e, u in pairs) + load for q, v, load in loads}

    def rate(expr):
        return sum(expr.diff(q) * r for q, r in rates.items())

    contacts = (ap.Friction(rate(e), F, N, f, gap=g, normal=N, constraint=rate(rate(g)))
                for e, g, F, N, f in zip(ends, gaps, F, N, f, strict=True))
    return ap.System.with_frictions(rates, {}, contacts), dict.fromkeys((X, Y, h, U, V, W), 0)


@pytest.mark.parametrize(
    "normals", [[(0, 1)] * 4, [(sp.Rational(3, 5), sp.Rational(4, 5)), (0, 1)] * 2, [(0, 1)] * 5]
)
@pytest.mark.further
def test_a_body_on_many_feet_rests_where_a_linear_program_finds_forces_that_hold_it(normals):
    feet = [(sp.Rational(k), 0) for k in range(len(normals))]
    body, start = _body(feet, normals)
    frictions = [sp.Rational(k % 3 + 1, 4) for k in range(len(feet))]
    rows = np.array([[n for n, _ in normals] + [m for _, m in normals],
                     [m for _, m in normals] + [-n for n, _ in normals],
                     [a * m for (a, _), (_, m) in zip(feet, normals, strict=True)]
                     + [-a * n for (a, _), (n, _) in zip(feet, normals, strict=True)]], float)
    cone = np.vstack([np.hstack([-np.diag([*map(float, frictions)]), s * np.eye(len(feet))]) for s in (1, -1)])
    for push, turn in ((0, 1), (0, 0), ("1/4", 2), ("1/2", 3), ("3/4", 2), (-2, 1), (0, -1)):
        values = {f"f{k + 1}": f for k, f in enumerate(frictions)} | {"P": push, "M": turn}
        load = -np.array([float(sp.Rational(push)), -1, turn])
        bounds = [(0, None)] * len(feet) + [(None, None)] * len(feet)
        rests = linprog([0] * (2 * len(feet)), cone, [0] * len(cone), rows, load, bounds).success
        try:
            path = ap.solve(ap.Scene(system=body, values=values, start=start, until="1/100"))
            assert (path.modes == ("+".join(["stick"] * len(feet)),) and path.final == path.scene.start) is rests
        except UnboundedReaction:
            assert not rests


def _flat_block(pull, others=None):
    """Return a block on feet 1/2 apart, pulled at a height of 1 above them, that turns by small angles only."""
    x, y, h, U, V, W, f = sp.symbols("x y h U V W f", real=True)
    N, F, b = sp.symbols("N1:3", real=True), sp.symbols("F1:3", real=True), sp.Rational(1, 4)
    rates = {x: U, y: V, h: W, U: pull + sum(F), V: sum(N) - 1, W: 2 * (b * (N[1] - N[0]) + sum(F))}
    feet = [ap.Friction(U + W, force, normal, f, gap=y + side * b * h, normal=normal,
                        constraint=rates[V] + side * b * rates[W])
            for side, normal, force in zip((-1, 1), N, F, strict=True)]
    return ap.System.with_frictions(rates | (others or {}), {}, feet, time=sp.Symbol("t", real=True))


@pytest.mark.parametrize("way", [{}, {"digits": 20}, {"method": "lsoda", "rtol": 1e-10}])
@pytest.mark.parametrize(("friction", "event", "final"), [
    ("1/10", ("slip_onset", 0.1), [0.9**3 / 6, 0, 0]),
    ("1/2", ("lift_off", 0.25), [0.75**3 / 6 * 16 / 25, 0.75**3 / 6 * 4 / 25, -(0.75**3) / 6 * 16 / 25])])
@pytest.mark.few(1)
def test_a_block_rests_on_both_feet_under_a_pull_that_grows_until_it_slides_or_tips(friction, event, final, way):
    """About its foot the block has the moment of inertia 1/2 + 1 + 1/16 = 25/16, and tips by the moment t - 1/4."""
    t = sp.Symbol("t", real=True)
    path = ap.solve(ap.Scene(system=_flat_block(t), values={"f": friction}, start=[0] * 6, until=1), **way)
    (told,) = path.events
    assert (told.kind, float(told.t)) == (event[0], pytest.approx(event[1], rel=1e-9))
    assert path.modes[0] == "stick+stick"
    assert [*map(float, path.final[:3])] == pytest.approx(final, abs=1e-8)


@pytest.mark.further
def test_a_block_rests_on_both_feet_whenever_a_pull_that_swings_lets_it():
    """Friction 1/10 holds a pull of sin(t)/10 for ever, and one of sin(t)/5 until its first sixth of a swing."""
    t = sp.Symbol("t", real=True)
    weak, strong = (ap.Scene(system=_flat_block(sp.sin(t) / n), values={"f": "1/10"}, start=[0] * 6, until=until)
                    for n, until in ((10, 7), (5, 1)))
    assert (ap.solve(weak).events, ap.solve(weak).final) == ((), (0,) * 6)
    assert ap.solve(strong).events[0].t == pytest.approx(math.pi / 6, rel=1e-14)
    parabola = sp.Rational(1, 10) - (t - sp.Rational(1, 2)) ** 2
    path = ap.solve(ap.Scene(system=_flat_block(parabola), values={"f": "1/10"}, start=[0] * 6, until=1))
    assert path.modes == ("slip_opposite+slip_opposite", "stick+stick", "slip_opposite+slip_opposite")
    assert path.events[1].t == pytest.approx(0.5 + 0.2**0.5, rel=1e-14)


def test_a_system_is_not_at_rest_where_its_rates_vanish_for_an_instant():
    t, r, s = sp.symbols("t r s", real=True)
    scene = ap.Scene(system=_flat_block(0, {r: s, s: t}), values={"f": "1/10"}, start=[0] * 8, until=1)
    assert ap.solve(scene).final == (0,) * 6 + (pytest.approx(1 / 6), pytest.approx(1 / 2))


@pytest.mark.further
def test_a_ladder_holds_a_climber_up_to_the_height_of_limit_analysis():
    """At the limit W = N + f2 T and f1 N = T; with tan(a) = 4/3 the climber is at s = 2 f1 (4/3 + f2)/(1 + f1 f2)."""
    t, M = sp.symbols("t M", real=True)
    body, start = _body([(sp.Rational(3, 5), -sp.Rational(4, 5)), (-sp.Rational(3, 5), sp.Rational(4, 5))],
                        [(0, 1), (1, 0)], push=0)
    climbed = {M: sp.Rational(3, 5) * (t - 1)}
    contacts = [replace(friction, constraint=friction.constraint.subs(climbed)) for friction in body.frictions]
    ladder = ap.System.with_frictions({s: rate.subs(climbed) for s, rate in body.slow.items()}, {}, contacts, time=t)
    path = ap.solve(ap.Scene(system=ladder, values={"f1": "3/10", "f2": "1/5"}, start=start, until="9/10"))
    assert path.modes == ("stick+stick", "slip_same+slip_same")
    assert path.events[0].t == pytest.approx(46 / 53, rel=1e-14)


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize(("push", "velocity"), [(1, 0), (0, 1)])
@pytest.mark.few(1)
def test_a_body_that_slides_on_three_feet_is_refused_for_the_forces_of_its_slip(push, velocity, two_sided):
    body, _ = _body([(sp.Rational(k), 0) for k in (-1, 0, 1)], [(0, 1)] * 3)
    if two_sided:
        guides = [replace(friction, gap=None) for friction in body.frictions]
        body = ap.System.with_frictions(dict(body.slow), {}, guides)
    values = {"f1": "1/2", "f2": "1/2", "f3": "1/4", "P": push, "M": 0}
    scene = ap.Scene(system=body, values=values, start=[0, 0, 0, velocity, 0, 0], until=1)
    if two_sided and not velocity:  # guides that press against one another hold any push
        assert ap.solve(scene).final == scene.start
        return
    with pytest.raises(UnboundedReaction, match=r"not determined at t = 0.*: slip_same\+slip_same\+slip_same has more"):
        ap.solve(scene)


@pytest.mark.further
def test_an_elevator_that_a_moment_turns_between_four_guides_rubs_on_two_of_them():
    """Loads T and B on top and bottom, 2 apart, at the height 1/2: B - T = 1 and B + T = M + f (B - T) / 2."""
    feet = [(x, side * sp.Rational(1, 2)) for side in (1, -1) for x in (1, -1)]
    cabin, _ = _body(feet, [(0, -1)] * 2 + [(0, 1)] * 2)
    values = {"f1": "1/4", "f2": "1/4", "f3": "1/4", "f4": "1/4", "P": -1, "M": 1}
    path = ap.solve(ap.Scene(system=cabin, values=values, start=[0, 0, 0, -1, 0, 0], until=0.5))
    assert sorted(path.modes[0].split("+")) == ["open", "open", "slip_opposite", "slip_same"]
    assert path.final[0] == pytest.approx(-0.5 - (1 - (1 + 1 / 8) / 4) / 8, abs=1e-9)


def test_feet_that_coincide_bear_what_no_equation_shares_out_and_brake_as_one_if_they_are_alike():
    body, _ = _body([(sp.Rational(0), 0)] * 2, [(0, 1)] * 2)
    values = {"f1": "1/2", "f2": "1/2", "P": 0, "M": 0}
    scene = ap.Scene(system=body, values=values, start=[0, 0, 0, 1, 0, 0], until=1)
    assert ap.solve(scene).final == pytest.approx((3 / 4, 0, 0, 1 / 2, 0, 0))
    with pytest.raises(UnboundedReaction, match=r"not determined at t = 0.*: slip_same\+slip_same has more"):
        ap.solve(replace(scene, values=values | {"f2": "1/4"}))


@pytest.mark.parametrize("method", [{}, {"digits": 20}, {"method": "radau"}, {"method": "lsoda"}])
@pytest.mark.parametrize("half", ["1/2", pytest.param("3/10", marks=pytest.mark.slow)])
@pytest.mark.few(0)
def test_a_block_that_only_just_does_not_tip_slides_to_rest_though_a_foot_bears_nothing(half, method):
    half = sp.Rational(half)
    block, _ = _body([(-half, -1), (half, -1)], [(0, 1)] * 2)
    values = {"f1": half, "f2": half, "P": 0, "M": 0}
    path = ap.solve(ap.Scene(system=block, values=values, start=[0, 0, 0, 1, 0, 0], until=4), **method)
    assert path.modes == ("slip_same+slip_same", "stick+stick")
    assert float(path.final[0]) == pytest.approx(float(1 / half / 2), abs=1e-5)


@pytest.mark.parametrize("method", [{}, {"digits": 15}])
@pytest.mark.few(0)
def test_a_block_that_only_just_does_not_tip_swings_on_a_spring_as_one_that_cannot(method):
    half, X = sp.Rational(1, 10), sp.Symbol("X", real=True)
    block, _ = _body([(-half, -1), (half, -1)], [(0, 1)] * 2, push=-X)
    values = {"f1": half, "f2": half, "M": 0}
    path = ap.solve(ap.Scene(system=block, values=values, start=[2, 0, 0, 0, 0, 0], until=7), **method)
    assert path.modes == ("slip_opposite+slip_opposite", "slip_same+slip_same", "slip_opposite+slip_opposite")
    assert [float(e.state[0]) for e in path.events] == pytest.approx([-1.8, 1.6], abs=1e-8)
    assert float(path.final[0]) == pytest.approx(0.1 + 1.5 * math.cos(7), abs=1e-8)


@pytest.mark.parametrize("friction", [sp.Symbol("f", positive=True), sp.S.One])
@pytest.mark.parametrize("two_sided", [False, True])
def test_critical_friction_may_be_given_as_a_number(two_sided, friction):
    """y'' = N + F - 1: N (1 - f) = 1 has no solution for a velocity above 0; for one below it, N = F = 1/2."""
    X, Y, U, V, N, F = sp.symbols("X Y U V N F", real=True)
    closed = {"gap_rate": V} if two_sided else {"gap": Y}
    guide = ap.Friction(U, F, N, friction, normal=N, constraint=N + F - 1, **closed)
    point = ap.System.with_frictions({X: U, Y: V, U: F, V: N + F - 1}, {}, [guide])
    values = dict.fromkeys(map(str, friction.free_symbols), 1)
    path = ap.solve(ap.Scene(system=point, values=values, start=[0, 0, -1, 0], until=1))
    assert (path.modes, path.final) == (("slip_opposite",), pytest.approx((-3 / 4, 0, -1 / 2, 0)))
    with pytest.raises(NoMotion):
        ap.solve(ap.Scene(system=point, values=values, start=[0, 0, 1, 0], until=1))


def _slide(push, weight, friction):
    """Return a body on two guides that hold both ways, as a system in the time t."""
    X, Y, h, U, V, W, N1, N2, F1, F2, t = sp.symbols("X Y h U V W N1 N2 F1 F2 t", real=True)
    at = [(X + side * sp.cos(h), Y + side * sp.sin(h)) for side in (1, -1)]
    turning = sum(N * y.diff(h) + F * x.diff(h) for (x, y), N, F in zip(at, (N1, N2), (F1, F2), strict=True))
    rates = {X: U, Y: V, h: W, U: F1 + F2 + push, V: N1 + N2 - weight, W: 12 * turning}

    def rate(expr):
        return sum(expr.diff(q) * r for q, r in rates.items())

    guides = [ap.Friction(rate(x), F, N, friction, normal=N, constraint=rate(rate(y)))
              for (x, y), N, F in zip(at, (N1, N2), (F1, F2), strict=True)]
    return ap.System.with_frictions(rates, {}, guides, time=t if sp.sympify(weight).has(t) else None)


def test_a_slide_in_two_guides_slips_as_their_resultant_says():
    slide = _slide(sp.Symbol("P"), 1, sp.S.Half)
    for push, way in (("1/4", 0), ("1/2", 0), ("3/4", 1 / 8)):
        path = ap.solve(ap.Scene(system=slide, values={"P": push}, start=[0] * 6, until=1))
        assert path.final[0] == pytest.approx(way, abs=1e-9)


def test_a_slide_in_two_guides_whose_coefficients_are_whole_numbers_rests_as_long_as_some_forces_hold_it():
    """At rest N2 = -N1 and F1 = N1 - 2, F2 = (7 - t)/2 - N1: these are in both cones for some N1 > 0 until t = 7."""
    X, h, Y, U, V, W, N1, N2, F1, F2, t = sp.symbols("X h Y U V W N1 N2 F1 F2 t", real=True)
    rates = {X: U, h: V, Y: W, U: F1 + F2 + (t - 3) / 2, V: N1 + N2, W: F1 + 3 * N1 + 4 * N2 + 2}
    guides = [ap.Friction(velocity, F, N, friction, static=1, normal=N, constraint=rates[V] + lever * rates[W])
              for velocity, F, N, friction, lever in ((U + W / 2, F1, N1, sp.Rational(3, 4), sp.Rational(3, 2)),
                                                      (U, F2, N2, 1, 2))]
    slide = ap.System.with_frictions(rates, {}, guides, time=t)
    path = ap.solve(ap.Scene(system=slide, start=[0] * 6, until=10))
    assert path.modes == ("stick+stick", "slip_same+slip_opposite")
    assert path.events[0].t == pytest.approx(7)
    assert path.final == pytest.approx((9 / 4, 0, 0, 9 / 4, 0, 0))  # F1 + F2 = -2 in slip, with N1 = 8/7


@pytest.mark.further
def test_a_slide_in_two_guides_comes_to_rest_though_these_keep_its_velocity_across_at_zero_to_rounding_alone():
    """A spring and a swinging weight: the slide turns and stops as one mass with the friction f |weight| does."""
    t, X = sp.symbols("t X", real=True)
    slide = _slide(-X, 2 - sp.sin(2 * t), sp.Rational(2, 5))
    path = ap.solve(ap.Scene(system=slide, values={}, start=[0, 0, 0, 1, 0, 0], until=2))
    assert path.modes == ("slip_same+slip_same", "slip_opposite+slip_opposite", "stick+stick")
    start, state = 0.0, (0.0, 1.0)
    for event, way in zip(path.events, (1, -1), strict=True):
        def mass(t, w, way=way):
            return w[1], -w[0] - 0.4 * way * (2 - np.sin(2 * t))

        run = solve_ivp(mass, (start, event.t), state, rtol=1e-11, atol=1e-12)
        assert (*event.state[:1], 0) == pytest.approx(tuple(run.y[:, -1]), abs=1e-8)
        start, state = event.t, (run.y[0, -1], 0.0)
    assert path.final[0] == pytest.approx(state[0], abs=1e-8)


def test_a_bead_that_comes_to_rest_on_a_wire_stays_where_it_is():
    # by its constraint alone, which is g'' = 0, the bead left the wire at the speed 2e-9 for ever
    wire = ap.Contact(gap=sp.sqrt(X**2 + Y**2) - 1, slip=X * Y.diff(T) - Y * X.diff(T), friction=sp.Rational(1, 20))
    bead = ap.Mechanism.from_lagrangian((X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - 10 * Y, (X, Y), contact=wire).rigid()
    path = ap.solve(ap.Scene(system=bead, values={}, start=["3/5", "-4/5", 0, 0], until=100))
    assert path.modes[-1] == "stick"
    assert path.final == path.events[-1].state
    assert math.hypot(*path.final[:2]) == pytest.approx(1, abs=5e-9)


def _trammel(friction):
    """Return a rod of the length 1 with its ends in two rough slots, a level and an upright one, in a plane."""
    X, Y, h, U, V, W, N1, N2, F1, F2 = sp.symbols("X Y h U V W N1 N2 F1 F2", real=True)
    s, c = sp.sin(h) / 2, sp.cos(h) / 2
    rates = {X: U, Y: V, h: W, U: F1 + N2, V: N1 + F2 - 10, W: 12 * (s * (N2 - F1) + c * (F2 - N1))}

    def rate(expr):
        return sum(expr.diff(q) * r for q, r in rates.items())

    ends = ((rate(X + c), rate(Y - s), F1, N1), (rate(Y + s), rate(X - c), F2, N2))
    return ap.System.with_frictions(rates, {}, [
        ap.Friction(slip, F, N, friction, normal=N, constraint=rate(across), gap_rate=across)
        for slip, across, F, N in ends
    ])


def _turn_in_slots(f, h, w):
    """Return the angular acceleration of the rod in two slots, by the equations of its three accelerations."""
    s, c = np.sin(h) / 2, np.cos(h) / 2
    for r1, r2 in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        k1, k2 = f * r1 * np.sign(s * w), -f * r2 * np.sign(c * w)  # F = k N, as the ends slide at -2 s w and 2 c w
        rows = np.array([[k1, 1, s], [1, k2, -c], [-s * k1 - c, s + c * k2, -1 / 12]])
        N1, N2, turning = np.linalg.solve(rows, [-c * w**2, 10 - s * w**2, 0])
        if r1 * N1 >= 0 and r2 * N2 >= 0:
            return turning
    raise AssertionError("no motion of the rod in its slots")


@pytest.mark.further
def test_a_rod_in_two_slots_passes_its_dead_centre_turns_and_comes_to_rest():
    angle = math.asin(0.6)
    start = {"X": "2/5", "Y": "3/10", "h": str(sp.asin(sp.Rational(3, 5)).evalf(60)), "U": "3/5", "V": "-4/5", "W": -2}
    path = ap.solve(ap.Scene(system=_trammel(sp.Rational(1, 5)), values={}, start=start, until=2))
    assert path.modes[-1] == "stick+stick"
    assert path.final == path.events[-1].state
    peer = solve_ivp(lambda t, w: (w[1], _turn_in_slots(0.2, *w)), (0, 1.5), (angle, -2), rtol=1e-9, atol=1e-9)
    assert path(1.5)[[2, 5]] == pytest.approx(peer.y[:, -1], abs=1e-6)


@pytest.mark.further
def test_a_joint_at_rest_keeps_its_angle_where_the_time_alone_makes_another_contact_slip():
    # a cart on rough ground carries a pendulum with friction in its joint; while both rest the force needed is a cos wt
    X, Y, h, U, V, W, N, F, G = sp.symbols("X Y h U V W N F G", real=True)
    f, f0, q, a, w, t = sp.symbols("f f0 q a w t", positive=True)
    (s, c), m = (sp.sin(h), sp.cos(h)), sp.S.Half
    mass = sp.Matrix([[1 + m, 0, m * c], [0, 1 + m, m * s], [m * c, m * s, m]])
    load = sp.Matrix([a * sp.cos(w * t) + F + m * W**2 * s, N - 1 - m - m * W**2 * c, G - m * s])
    rates = {X: U, Y: V, h: W} | dict(zip((U, V, W), map(sp.expand, sp.simplify(mass.inv()) * load), strict=True))
    ground = ap.Friction(U, F, N, f, f0, gap=Y, normal=N, constraint=rates[V])
    cart = ap.System.with_frictions(rates, {}, [ground, ap.Friction(W, G, 1, q)], time=t)
    values = {"f": "0.56", "f0": "0.66", "q": "0.27", "a": "1.13", "w": "1.9"}
    start = {"X": 0, "Y": 0, "h": "-1.06", "U": "0.79", "V": 0, "W": 0}
    events = ap.solve(ap.Scene(system=cart, values=values, start=start, until="4.7")).events[3:]
    assert [(e.kind, e.friction) for e in events] == [("velocity_zero", 1), ("velocity_zero", 0), ("slip_onset", 0)]
    assert [e.state[2] for e in events] == pytest.approx([0.3629594] * 3, abs=1e-6)
    assert 1.13 * np.cos(1.9 * events[-1].t) == pytest.approx(-0.66 * 1.5, abs=1e-12)


def test_a_ladder_that_slides_jams_where_the_product_of_its_frictions_is_above_one():
    s, c, rate = np.sin(0.64), np.cos(0.64), -0.18
    start = {"X": c, "Y": s, "h": 0.64, "U": -s * rate, "V": c * rate, "W": rate}
    path = ap.solve(ap.Scene(system=_ladder(), values={"f1": "1.39", "f2": "2.85"}, start=start, until=1))
    (stop,) = path.events
    assert path.modes == ("slip_same+slip_opposite", "stick+stick")
    assert stop.t == pytest.approx(0.00410303, abs=1e-8)
    assert path.final == stop.state


def test_rest_elsewhere_does_not_choose_between_a_slide_within_the_paradox_and_lift_off():
    """Lift-off would make the other block slip; for that the slide, whose reaction grows as it yields, was followed."""
    x, y, a, b = dynamicsymbols("x y a b")
    v, w, speed, rise = (q.diff(T) for q in (x, y, a, b))
    energy = (v**2 + w**2 + speed**2 + rise**2) / 2 + sp.Rational(4, 5) * v * w - w * speed / 20
    contacts = [ap.Contact(gap=y, slip=x, friction=2, unilateral=True),
                ap.Contact(gap=b, slip=a, friction=1, unilateral=True)]
    for pull in ("0.98", "0.99"):
        pair = ap.Mechanism.from_lagrangian(energy, (x, y, a, b), contact=contacts[0], others=contacts[1:],
                                            forces=(0, 1, sp.Rational(pull), -1))
        system, rest = pair.rigid(), dict.fromkeys(("x", "y", "a", "b", "y'", "a'", "b'"), 0)
        with pytest.raises(TwoMotions, match=r"open.* and slip_opposite"):
            ap.solve(ap.Scene(system=system, start=pair.start(system, {**rest, "x'": -1}), until="1/10"))


def test_rest_beside_a_slider_that_stops_does_not_choose_whether_the_slider_opens():
    """The integers have three motions: one contact rests as the other opens, or slips with either load as it stays."""
    q, u = sp.symbols("p r x y"), sp.symbols("p' r' x' y'")
    mass = sp.Matrix([[2, 4, -1, -2], [4, 9, -2, -4], [-1, -2, 1, 1], [-2, -4, 1, 4]])
    guide = ap.Contact(gap=q[0], slip=u[2], friction=sp.Rational(5, 2))
    ground = ap.Contact(gap=q[1], slip=u[3], friction=2, unilateral=True)
    system = ap.Mechanism(q, u, mass, (2, 2, -3, 2), guide, others=(ground,)).rigid()
    automaton = Automaton(system, ())
    before = next(b for b in named_branches(system) if mode_of(system, b).name == "stick+slip_same")
    hit = next(k for k, guard in enumerate(mode_of(system, before).guards) if guard.key[:2] == ("velocity_zero", 1))
    with pytest.raises(TwoMotions, match=r"stick\+open are all consistent"):
        automaton.next(before, (hit,), 0.0, (0.0,) * 8)


@pytest.mark.parametrize("way", [{}, {"method": "lsoda", "rtol": 1e-9, "atol": 1e-9}])
def test_a_slider_that_lift_off_would_close_on_its_neighbour_has_a_second_motion_once_the_neighbour_has_opened(way):
    """At first lift-off of the one drives the other down; that is no motion until there is a gap below the other."""
    q, u = sp.symbols("p r x y"), sp.symbols("p' r' x' y'")
    mass = sp.Matrix([[5, 1, 1, -1], [1, 1, 0, 0], [1, 0, 1, 0], [-1, 0, 0, 1]])
    feet = [ap.Contact(gap=q[k], slip=u[k + 2], friction=3 + k, unilateral=True) for k in (0, 1)]
    system = ap.Mechanism(q, u, mass, (-1, 0, 0, 0), feet[0], others=feet[1:]).rigid()
    scene = ap.Scene(system=system, start=dict(zip(system.states, (0, 0, 0, 0, 0, 0, -1, -1), strict=True)), until=0)
    assert ap.solve(scene).modes == ("open+slip_opposite",)
    with pytest.raises(TwoMotions, match=r"open\+open and open\+slip_opposite") as stopped:
        ap.solve(replace(scene, until=Fraction(1, 10)), **way)
    assert 0 < stopped.value.t < 1e-3


@pytest.mark.parametrize("method", [
    "exact", "rk45", *(pytest.param(*one.values, marks=[*one.marks, pytest.mark.slow]) for one in here("heyoka"))])
def test_a_slider_that_a_smooth_contact_keeps_down_has_a_second_motion_once_both_may_lift_off(method):
    """The gaps have g1'' = a - N1/2 + N2/2 and g2'' = b - 2 N1 + N2: N = (b - 2 a, b - 4 a), or 0 where a, b >= 0."""
    q, u, a, t = sp.symbols("s y z"), sp.symbols("s' y' z'"), sp.symbols("a"), sp.Symbol("t")
    yields = sp.Matrix([[40, 3, 5], [3, 2, 1], [5, 1, 2]]) / 2
    feet = [ap.Contact(gap=q[k], slip=u[0], friction=f, unilateral=True) for k, f in ((1, 1), (2, 0))]
    pulls = yields.inv() * sp.Matrix([60, a + 2 * t, 3 + 2 * a + 4 * t])
    system = ap.Mechanism(q, u, yields.inv(), pulls, feet[0], others=feet[1:], time=t).rigid()
    start = dict(zip(system.states, (0, 0, 0, 1, 0, 0), strict=True))
    scene = ap.Scene(system=system, values={"a": -1}, start=start, until="2/5")
    assert ap.solve(scene, method).modes == certify(scene).modes == ("slip_same+closed",)
    assert certify(replace(scene, until=1)).reason.startswith("uniqueness: within slip_same+closed, slip_same+open, as")
    with pytest.raises(TwoMotions, match=r"open\+open and slip_same .*\+closed") as stopped:
        ap.solve(replace(scene, until=1), method)
    assert stopped.value.t == pytest.approx(1 / 2, abs=1e-6)


@pytest.mark.parametrize("method", ["exact", "rk45"])
@pytest.mark.parametrize(("press", "modes"), [(1, ("slip_same",)), (-1, ("slip_same", "open"))])
def test_a_contact_whose_reaction_vanishes_where_its_load_steps_stays_closed_if_the_load_presses(press, modes, method):
    """Up to t = 1 the load is 1 - t; after it a load of 4 - t holds the contact closed, though it falls as well."""
    x, y, u, v, t = sp.symbols("x y u v t")
    floor = ap.Contact(gap=y, slip=u, friction=1, unilateral=True)
    load = sp.Piecewise((1 - t, t < 1), (press * (4 - t), True))
    system = ap.Mechanism((x, y), (u, v), sp.eye(2), (0, -load), floor, time=t).rigid()
    scene = ap.Scene(system=system, start={"x": 0, "y": 0, "u": 9, "v": 0}, until=2)
    assert ap.solve(scene, method).modes == certify(scene).modes == modes


@pytest.mark.further
def test_a_slide_has_a_second_motion_once_two_of_three_smooth_contacts_may_lift_off_together():
    """The smooth ones have g'' = b + B N as the slider presses; each alone holds, but B has -4 in its diagonal."""
    q, u, t = sp.symbols("s y z1:4"), sp.symbols("s' y' z1:4'"), sp.Symbol("t")
    yields = sp.Matrix([[100, 0, -2, -3, -4], [0, 1, 3, -2, -1], [-2, 3, 11, -6, -2], [-3, -2, -6, 5, 2],
                        [-4, -1, -2, 2, 2]])
    pulls = yields.inv() * sp.Matrix([500, -20, t / 5 - sp.Rational(1001, 10), -18, -58])
    feet = [ap.Contact(gap=gap, slip=u[0], friction=int(gap == q[1]), unilateral=True) for gap in q[1:]]
    system = ap.Mechanism(q, u, yields.inv(), pulls, feet[0], others=feet[1:], time=t).rigid()
    scene = ap.Scene(system=system, start=dict.fromkeys(map(str, system.states), 0) | {"s'": 10**4}, until="9/20")
    closed = "slip_same+closed+closed+closed"
    assert certify(scene).modes == (closed,)
    assert certify(replace(scene, until=1)).reason.startswith(f"uniqueness: within {closed}, slip_same+")
    with pytest.raises(TwoMotions, match=r"slip_same .*\+closed\+open\+open and ") as stopped:
        ap.solve(replace(scene, until=1))
    assert stopped.value.t == pytest.approx(1 / 2, abs=1e-5)


@pytest.mark.parametrize(("push", "name"), [(60, "slip_same"), (0, "stick")])
def test_a_contact_that_slides_in_one_of_two_directions_has_a_second_motion_once_it_may_lift_off(push, name):
    """Friction across acts as in the test before, and a second one, along, rests or slides on the same reaction."""
    y, z, u, q, p, v, w, t = sp.symbols("y z u q p v w t")
    along, across, beside, press, other = sp.symbols("F1 F2 F3 N1 N2")
    first = press + other / 2 + 3 * across / 2 + 2 * t - 1
    second = press / 2 + other + 5 * across / 2 + 4 * t + 1
    slide = 20 * across + 3 * press / 2 + 5 * other / 2 + 60
    rates = {y: v, z: w, u: along + push, q: slide, p: beside, v: first, w: second}
    contacts = [ap.Friction(u, along, press, sp.Rational(1, 10), gap=y, normal=press, constraint=first),
                ap.Friction(q, across, press, 1),
                ap.Friction(p, beside, other, 0, gap=z, normal=other, constraint=second)]
    system = ap.System.with_frictions(slow=rates, fast={}, frictions=contacts, time=t)
    start = dict.fromkeys(system.states, 0) | {q: 1}
    assert ap.solve(ap.Scene(system=system, start=start, until="2/5")).modes == (f"{name}+slip_same+closed",)
    with pytest.raises(TwoMotions, match=r"open\+slip_same .*\+open and ") as stopped:
        ap.solve(ap.Scene(system=system, start=start, until=1))
    assert stopped.value.t == pytest.approx(1 / 2, abs=1e-6)


@pytest.mark.slow
def test_a_contact_at_rest_in_one_direction_begins_to_slip_where_it_may_lift_off_in_the_other():
    """The push along, below its static friction, moves the body once there is no reaction: at t = 1/2, not at 21/40."""
    y, z, u, q, p, v, w, t = sp.symbols("y z u q p v w t")
    along, across, beside, press, other = sp.symbols("F1 F2 F3 N1 N2")
    first = press + other / 2 + 3 * across / 2 + 2 * t - 1
    second = press / 2 + other + 5 * across / 2 + 4 * t + 1
    slide = 20 * across + 3 * press / 2 + 5 * other / 2 + 60
    rates = {y: v, z: w, u: along + sp.Rational(1, 100), q: slide, p: beside, v: first, w: second}
    contacts = [ap.Friction(q, across, press, 1, gap=y, normal=press, constraint=first),
                ap.Friction(u, along, press, sp.Rational(1, 10)),
                ap.Friction(p, beside, other, 0, gap=z, normal=other, constraint=second)]
    system = ap.System.with_frictions(slow=rates, fast={}, frictions=contacts, time=t)
    scene = ap.Scene(system=system, start=dict.fromkeys(system.states, 0) | {q: 1}, until=1)
    with pytest.raises(TwoMotions, match=r"open\+slip_same .*\+open and slip_same .*\+stick\+closed") as stopped:
        ap.solve(scene)
    assert stopped.value.t == pytest.approx(1 / 2, abs=1e-6)
    assert not certify(replace(scene, until="51/100")).proven


def test_a_ladder_leans_at_rest_where_static_friction_is_enough():
    # of one friction f on floor and wall (1 - f^2)/(2 f) <= 4/3, the slope: f >= 1/3
    slope = str(sp.asin(sp.Rational(4, 5)).evalf(60))
    start = {"X": "3/5", "Y": "4/5", "h": slope, "U": 0, "V": 0, "W": 0}
    for friction, rests in (("1/3", True), ("0.3334", True), ("2", True), ("0.3333", False)):
        path = ap.solve(ap.Scene(system=_ladder(), values={"f1": friction, "f2": friction}, start=start, until="1/10"))
        assert (path.modes == ("stick+stick",)) is rests


@pytest.mark.further
def test_a_block_between_two_fingers_turns_about_the_rougher_one_until_it_slips_there_too():
    # the numbers are those of an integration in which forces are solved for at every step
    a, b, X, Y, h, *rest = sp.symbols("a b X Y h A B U V W N1:3 F1:3", real=True)
    (A, B, U, V, W), pairs = rest[:5], [*zip(rest[5:7], rest[7:], strict=True)]
    s, c, half = sp.sin(h), sp.cos(h), sp.S.Half
    gaps = ((X - a) * c + Y * s - half, (b - X) * c - Y * s - half)
    ends = (Y * c - (X - a) * s, Y * c + (b - X) * s)
    laws = zip((a, b, X, Y, h), (1, 1, 1, 1, 6), (2, -2, 0, -1, 0), strict=True)
    pushed = [n * (sum(g.diff(q) * N + e.diff(q) * F for g, e, (N, F) in zip(gaps, ends, pairs, strict=True)) + P)
              for q, n, P in laws]
    rates = {a: A, b: B, X: U, Y: V, h: W} | dict(zip((A, B, U, V, W), pushed, strict=True))

    def rate(expr):
        return sum(expr.diff(q) * r for q, r in rates.items())

    fingers = [ap.Friction(rate(e), F, N, f, gap=g, normal=N, constraint=rate(rate(g)))
               for g, e, (N, F), f in zip(gaps, ends, pairs, map(sp.Rational, ("1/5", "1/4")), strict=True)]
    gripped = ap.System.with_frictions(rates, {}, fingers)
    path = ap.solve(ap.Scene(system=gripped, values={}, start=[-half, half, *[0] * 8], until=1))
    (event,) = path.events
    assert (event.kind, event.friction, event.t) == ("slip_onset", 1, pytest.approx(0.2599572237, abs=1e-8))
    assert path.modes[1] == "slip_opposite+slip_opposite"
    assert path.final[3:5] == pytest.approx((-0.05302611, 0.0447361), abs=1e-7)


@pytest.mark.parametrize("how", [{}, {"digits": 15}])
def test_a_nut_that_holds_itself_on_the_thread_of_a_screw_rests_to_the_last_digit(how):
    """Its rates hold cos(a)^2 + sin(a)^2 - 1 at the pitch a = 1/10: rounding is no motion."""
    z, turn, v, w, a, g, J, f = sp.symbols("z phi v w a g J f", real=True)
    thread = ap.Contact(gap=z * sp.cos(a) - turn * sp.sin(a), slip=z * sp.sin(a) + turn * sp.cos(a), friction=f)
    screw = ap.Mechanism((z, turn), (v, w), sp.diag(2, J), (-2 * g, 0), thread).rigid()
    start = dict.fromkeys(screw.states, 0)
    path = ap.solve(ap.Scene(system=screw, values={a: "0.1", g: "9.81", J: 1, f: 3}, start=start, until=2), **how)
    assert path.modes == ("stick",)
    assert path.final == (0, 0, 0, 0)


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("gap", [lambda y: y**2, lambda y: y**3, lambda y: sp.cos(y) - 1, sp.Abs])
@pytest.mark.few(2)
def test_a_gap_that_does_not_slope_where_it_is_closed_is_refused_by_name(gap, unilateral):
    y = dynamicsymbols("Y")
    contact = ap.Contact(gap=gap(y), slip=X, friction=sp.Rational(1, 2), unilateral=unilateral)
    block = ap.Mechanism.from_lagrangian((X.diff(T) ** 2 + y.diff(T) ** 2) / 2 - y, (X, y), contact=contact)
    start = {"X": 0, "Y": 0, "X'": 1, "Y'": 0}
    with pytest.raises(InputError, match="the gap has no slope at these values"):
        block.motions(start)
    jumps = gap is sp.Abs and not unilateral
    error, words = (NotDerivable, "jumps where Y = 0") if jumps else (UnboundedReaction, r"no slope at t = 0, .*Y = 0")
    with pytest.raises(error, match=words):
        ap.solve(ap.Scene(system=block.rigid(), values={}, start=start, until=1))


def test_an_open_contact_moves_freely_past_a_place_at_which_its_gap_has_no_slope():
    x, y, u, v = sp.symbols("x y u v", real=True)
    contact = ap.Contact(gap=1 + y**3, slip=x, friction=sp.Rational(1, 2), unilateral=True)
    thrown = ap.Mechanism((x, y), (u, v), sp.eye(2), (0, -1), contact).rigid()
    path = ap.solve(ap.Scene(system=thrown, values={}, start={x: 0, y: 0, u: 1, v: 1}, until=2.5))
    assert path.modes == ("open",)
    assert path.final == pytest.approx((2.5, 2.5 - 2.5**2 / 2, 1, -1.5), abs=1e-8)


@pytest.mark.parametrize("angle", [math.pi, 2 * math.pi])
def test_a_block_whose_start_is_turned_by_pi_in_doubles_slides_as_if_by_whole_numbers(angle):
    """sin(pi) is 1e-16 in doubles: the block was said to hit its ground, or to be within it."""
    x, y, u, v = sp.symbols("x y u v", real=True)
    contact = ap.Contact(y, x, sp.Rational(1, 5), unilateral=True)
    system = ap.Mechanism((x, y), (u, v), sp.eye(2), (3, -10), contact).rigid()
    start = {x: math.cos(angle), y: math.sin(angle), u: math.cos(angle), v: math.sin(angle)}
    turned, whole = (
        ap.solve(ap.Scene(system=system, values={}, start=given, until=1))
        for given in (start, {s: round(w) for s, w in start.items()})
    )
    assert turned.modes == whole.modes
    assert turned.final == pytest.approx(whole.final, abs=1e-15)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.few(2)
def test_a_rod_whose_two_rates_are_computed_zeros_slides_on_either_of_its_ends(side, unilateral, sign):
    """Y' + theta' was 2e-16: the one end was hit or off its constraint, where its mirror image slid."""
    rod = slender_rod(unilateral, gap=Y + side * l * sp.sin(THETA), slip=X + side * l * sp.cos(THETA))
    rates = {"Y'": sign * math.cos(math.pi / 2), "theta'": sign * math.sin(math.pi)}
    start = rod.start(rod.rigid(), {**GROUND, "X": 0, "Y": 0, "theta": 0, "X'": 1, **rates})
    path = ap.solve(ap.Scene(system=rod.rigid(), values={**GROUND, "f": "1/2"}, start=start, until="1/5"))
    assert path.modes == ("slip_same",)


def test_a_stop_at_which_the_rigid_contact_rests_may_throw_the_elastic_one_back():
    """Rest needs F = -6 R/5, but as the slip ends R is 38/18.3 = 2.08, with which rest would need F = -1.56 R."""
    X, Y, U, V = sp.symbols("X Y U V", real=True)
    mass = (sp.Matrix([[5, 3], [3, 15]]) / 4).inv()
    rough = ap.Contact(Y, X, sp.Rational(11, 10), static=sp.Rational(13, 10), unilateral=True)
    block = ap.Mechanism((X, Y), (U, V), mass, mass * sp.Matrix([sp.Rational(5, 2), -sp.Rational(19, 2)]), rough)
    soft = block.elastic(compliance=sp.Symbol("c", positive=True), damping=sp.Rational(1, 100))
    state, until = {"X": 0, "Y": 0, "U": -sp.Rational(1, 10), "V": 0}, sp.Rational(1, 5)
    rests, returns = (
        ap.solve(ap.Scene(system=system, values=values, start=block.start(system, {**state, **values}), until=until))
        for system, values in ((block.rigid(), {}), (soft, {"c": "1e-8"}))
    )
    assert rests.modes == ("slip_opposite", "stick")
    assert returns.modes == ("slip_opposite", "slip_same")
    stop, back = rests.events[0].t, 2.5 + (0.75 - 1.1 * 1.25) * 9.5 / (3.75 - 1.1 * 0.75)
    assert returns.final[returns.names.index("z")] == pytest.approx(back * (0.2 - stop), rel=1e-4)


def test_a_jam_at_rest_stays_where_it_is_pressed_though_it_may_lift_off_as_well():
    """Of its three motions the rigid contact takes rest, the elastic one rest if pressed, and lift-off if not."""
    eps, pull = sp.Symbol("eps", positive=True), (12 * X + 7 * Y + 6 * THETA) / 8
    jam = ap.Contact(X + Y - 3 * THETA, 5 * Y - 5 * X - 16 * THETA, 2, unilateral=True)
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 6
    wedge = ap.Mechanism.from_lagrangian(energy - pull, (X, Y, THETA), contact=jam)
    rest = dict.fromkeys(("X", "Y", "theta", "X'", "Y'", "theta'"), 0)
    assert [name for name, _ in wedge.motions(rest)] == ["slip", "stick", "lift_off"]
    system, soft = wedge.rigid(), wedge.elastic(eps**2, eps / 2)
    scenes = [ap.Scene(system=system, start=wedge.start(system, rest), until="1/10")]
    for depth in (0, wedge.motions(rest)[1].reaction * 1e-6):
        start = wedge.start(soft, {**rest, "X": -depth, "eps": "1/1000"})
        scenes.append(ap.Scene(system=soft, values={"eps": "1/1000"}, start=start, until="1/10"))
    assert [ap.solve(scene).modes for scene in scenes] == [("stick",), ("open",), ("stick",)]


def test_a_guide_that_begins_to_slide_within_the_paradox_has_two_motions_whatever_moves_its_mass_matrix():
    """Of a constant matrix no guard told it, and the run went on in one of two motions."""
    x, y = dynamicsymbols("x y")
    rates = x.diff(T), y.diff(T)
    for part in (0, sp.sin(x) / 10):
        energy = (rates[0] ** 2 + rates[1] ** 2) / 2 + (sp.Rational(4, 5) + part) * rates[0] * rates[1]
        guide = ap.Mechanism.from_lagrangian(energy, (x, y), contact=ap.Contact(y, x, 2), forces=(T, -1))
        system = guide.rigid()
        start = guide.start(system, {"x": 0, "y": 0, "x'": 0, "y'": 0})
        with pytest.raises(TwoMotions, match="a second motion of the contact comes up at t = 2,"):
            ap.solve(ap.Scene(system=system, start=start, until=5))


@pytest.mark.parametrize("unilateral", [False, True])
def test_a_contact_that_turns_by_an_angle_of_1_brakes_beside_a_vast_length(unilateral):
    """Its rate was said to be 0 to rounding of the length, and it turned for ever in a mode of stick."""
    energy = sum(q.diff(T) ** 2 for q in (X, Y, THETA)) / 2 - Y
    brake = ap.Contact(gap=Y, slip=THETA, friction=sp.S.Half, unilateral=unilateral)
    wheel = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=brake)
    system = wheel.rigid()
    start = wheel.start(system, {"X": 10**17, "Y": 0, "theta": 0, "X'": 0, "Y'": 0, "theta'": 1})
    path = ap.solve(ap.Scene(system=system, start=start, until=3))
    assert path.modes == ("slip_same", "stick")
    assert path.final == pytest.approx((1e17, 0, 1, 0, 0, 0))


def test_a_block_whose_height_is_the_rounding_of_a_metre_in_nanometres_stands_on_the_ground():
    """10^9 sin(pi) = 1.2e-7 was a fall, and the contact was hit 5e-9 later."""
    metre = 10**9
    ground = ap.Contact(gap=Y, slip=X, friction=sp.S.Half, unilateral=True)
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - 9 * metre * Y
    system = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ground).rigid()
    path = ap.solve(ap.Scene(system=system, start=[metre, metre * math.sin(math.pi), metre, 0], until=1))
    assert path.modes == ("slip_same", "stick")
    assert path.final[0] == pytest.approx(metre * 10 / 9)


def test_a_block_slides_down_a_wedge_whose_slope_is_a_number_as_the_equations_of_newton_say():
    """SymPy's error that a polynomial was expected, of a load that is a number, came through."""
    slope, s, c, f = sp.Rational(3, 5), math.sin(0.6), math.cos(0.6), 0.2
    across, along, gap = dynamicsymbols("A D G")
    place = across + along * sp.cos(slope) - gap * sp.sin(slope), along * sp.sin(slope) + gap * sp.cos(slope)
    energy = 3 * across.diff(T) ** 2 / 2 + sum(z.diff(T) ** 2 for z in place) / 2 - 10 * place[1]
    face = ap.Contact(gap, along, sp.Rational(1, 5), unilateral=True)
    block = ap.Mechanism.from_lagrangian(energy, (across, along, gap), contact=face)
    start = {"A": 0, "D": 0, "G": 0, "A'": 0, "D'": -1, "G'": 0}
    ((name, reaction),) = block.motions(start)
    found = ap.solve(ap.Scene(system=block.rigid(), start=start, until=1)).final
    pushed = s - f * c  # what of a unit reaction pushes the block back and the wedge ahead
    away, down, force = np.linalg.solve([[1, c, pushed], [0, s, -c - f * s], [3, 0, -pushed]], [0, -10, 0])
    assert (name, reaction) == ("slip", pytest.approx(force))
    assert found == pytest.approx([away / 2, down / 2 - 1, 0, away, down - 1, 0])
