"""The rigid motions of a contact: counted against published examples and against a search through all cases."""

from contextlib import nullcontext
from itertools import product

import numpy as np
import pytest
import sympy as sp
from mechanisms import masses_between_guides, slender_rod
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.errors import InputError, Undecided, UnknownName
from asympk.systems import crank_slider

GROUND = {"m": 1, "l": 1, "g": "9.81"}


def _rod(rod, theta, rate, sliding, friction):
    """Return the motions of a rod of the half length 1 whose end slides with the given velocity."""
    state = {"theta": theta, "theta'": rate, "X'": sliding - np.sin(theta) * rate, "f": friction}
    return rod.motions({**GROUND, **state})


@pytest.mark.parametrize(
    ("rate", "friction", "names"),
    [
        (0.0, 1.0, ["slip"]),  # p > 0, a_N < 0
        (4.0, 1.0, ["lift_off"]),  # p > 0, a_N > 0
        (0.0, 2.0, []),  # p < 0, a_N < 0: inconsistent
        (4.0, 2.0, ["slip", "lift_off"]),  # p < 0, a_N > 0: indeterminate
    ],
)
def test_the_four_cases_of_the_sliding_rod(rate, friction, names):
    """Génot and Brogliato (1999): at tan(theta) = 2 the rod's end, sliding backwards, has its paradox from f = 4/3."""
    found = _rod(slender_rod(), np.arctan(2), rate, -1, friction)
    assert [name for name, _ in found] == names
    assert [name for name, _ in _rod(slender_rod(), np.arctan(2), rate, 1, friction)] == [names[-1] if rate else "slip"]


def test_the_reaction_of_the_sliding_rod_is_minus_a_n_over_p():
    s, c = np.sin(1.1), np.cos(1.1)
    for sliding in (1, -1):
        ((name, reaction),) = _rod(slender_rod(), 1.1, 0.5, sliding, 1.2)
        p = 1 + 3 * c * (c + sliding * 1.2 * s)
        assert name == "slip"
        assert reaction == pytest.approx((9.81 - 0.25 * s) / p, rel=1e-14)


@pytest.mark.parametrize(("tangent", "velocity", "count"), [(1, 1, 1), (1, -1, 1), (5, 1, 2), (5, -1, 0)])
def test_painleve_and_kleins_masses_have_two_motions_forward_and_none_backward(tangent, velocity, count):
    """The paradox for f tan(alpha) > 2, with the reactions R = P / (2 cos(alpha) -+ f sin(alpha)) of (1.3)."""
    alpha = np.arctan(tangent)
    found = masses_between_guides().motions({"x1'": velocity, "alpha": alpha, "f": 1, "m": 1, "P": 3})
    assert len(found) == count
    reactions = {3 / (2 * np.cos(alpha) - sign * np.sin(alpha)) for sign in (1, -1)}
    for _, reaction in found:
        assert min(abs(abs(reaction) - abs(other)) for other in reactions) < 1e-13


def test_painleve_and_kleins_masses_start_from_rest_in_one_way():
    """P drives the rough mass: from rest there is slip forward, with the reaction of (1.3), and no stick."""
    for tangent in (1, 5):
        found = masses_between_guides().motions({"x1'": 0, "alpha": np.arctan(tangent), "f": 1, "m": 1, "P": 3})
        assert [name for name, _ in found] == ["slip"]


def _search(G, a, gamma, friction, static, unilateral):
    """Count the motions case by case from g'' = 0, Coulomb's law and the signs, each 2 x 2 system solved anew."""
    found = []
    for s, r in product((1, -1), (1,) if unilateral else (1, -1)):
        system = np.array([[G[0, 0], G[0, 1]], [s * r * friction, 1.0]])
        R, F = np.linalg.solve(system, [-a[0], 0.0])
        rate = a[1] + G[0, 1] * R + G[1, 1] * F
        if R * r > 0 and (gamma * s > 0 or (gamma == 0 and rate * s > 0)):
            found.append(("slip", R))
    R, F = np.linalg.solve(G, -a)
    if gamma == 0 and abs(F) <= static * abs(R) and (R >= 0 or not unilateral):
        found.append(("stick", R))
    if unilateral and a[0] > 0:
        found.append(("lift_off", 0.0))
    return found


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.few(1)
def test_counts_agree_with_a_search_through_all_cases(unilateral):
    rod, rng, counts = slender_rod(unilateral), np.random.default_rng(7), set()
    for _ in range(120):
        theta, rate, friction = rng.uniform(0.1, 1.5), rng.uniform(-5, 5), rng.uniform(0.2, 4)
        gamma = rng.choice([-1.0, 0.0, 1.0])
        state = {"theta": theta, "theta'": rate, "X'": gamma - rate * np.sin(theta), "f": friction}
        s, c = np.sin(theta), np.cos(theta)
        G = np.array([[1 + 3 * c * c, -3 * s * c], [-3 * s * c, 1 + 3 * s * s]])
        expected = _search(G, np.array([rate**2 * s - 9.81, rate**2 * c]), gamma, friction, friction, unilateral)
        found = rod.motions({**GROUND, **state})
        assert [name for name, _ in found] == [name for name, _ in expected]
        assert [r for _, r in found] == pytest.approx([r for _, r in expected], rel=1e-12)
        counts.add((gamma != 0, len(found)))
    assert {(True, 0), (True, 1), (True, 2)} <= counts


def test_at_rest_the_rod_may_stick_though_sliding_has_a_paradox():
    ((name, reaction),) = _rod(slender_rod(), np.arctan(0.5), 0.0, 0.0, 2)
    assert name == "stick"
    assert reaction > 0


def test_static_friction_holds_what_kinetic_friction_would_let_go():
    import sympy as sp

    from asympk import Contact, Mechanism

    q, u = sp.symbols("X Y"), sp.symbols("U V")
    block = Mechanism(q, u, sp.eye(2), (1, -1), Contact(q[1], q[0], sp.Rational(1, 2), sp.Integer(2), unilateral=True))
    assert block.motions({"U": 0}) == (("stick", 1.0),)
    weak = Mechanism(q, u, sp.eye(2), (1, -1), Contact(q[1], q[0], sp.Rational(1, 2), unilateral=True))
    assert weak.motions({"X'": 0}) == (("slip", 1.0),)
    doubled = Contact(q[1], q[0], sp.Rational(1, 4), sp.Integer(1), load=2, unilateral=True)
    for push, motion in ((sp.Rational(3, 2), "stick"), (sp.Rational(5, 2), "slip")):
        assert Mechanism(q, u, sp.eye(2), (push, -1), doubled).motions({"U": 0}) == ((motion, 1.0),)


@pytest.mark.parametrize(("push", "name"), [("7/10", "stick"), ("4/5", "slip"), ("-1/5", "stick"), ("-3/10", "slip")])
@pytest.mark.parametrize("typed", ["sign", "at least"])
def test_a_block_is_held_by_the_friction_of_the_direction_in_which_it_would_slip(push, name, typed):
    """Friction is 3/4 forward and 1/4 backward; it was taken at the velocity 0: 1/2 or 3/4, either way."""
    (x, y), (u, w), quarter = sp.symbols("X Y"), sp.symbols("U V", real=True), sp.Rational(1, 4)
    stepped = sp.Piecewise((3 * quarter, u >= 0), (quarter, True))
    law = quarter * (2 + sp.sign(u)) if typed == "sign" else stepped
    ground = ap.Contact(y, x, law, unilateral=True)
    assert ap.Mechanism((x, y), (u, w), sp.eye(2), (sp.Rational(push), -1), ground).motions({"U": 0}) == ((name, 1.0),)


@pytest.mark.parametrize("unilateral", [True, False])
def test_a_block_on_an_incline_at_the_angle_of_friction_rests_though_doubles_round_its_pull(unilateral):
    x, y = dynamicsymbols("x y")
    (u, v), angle, f = (q.diff(dynamicsymbols._t) for q in (x, y)), sp.Symbol("angle", real=True), sp.Symbol("f")
    contact = ap.Contact(gap=y, slip=x, friction=f, unilateral=unilateral)
    lagrangian = (u**2 + v**2) / 2 + sp.sin(angle) * x - sp.cos(angle) * y
    block = ap.Mechanism.from_lagrangian(lagrangian, (x, y), contact=contact)
    angles = np.linspace(0.05, 1.5, 400)
    tie, above, below = (
        block.motion_map({"angle": angles, "f": np.tan(angles) * factor, "x'": 0, "y'": 0})
        for factor in (1, 1 - 1e-12, 1 + 1e-12)
    )
    for found, name in ((tie, "stick"), (above, "slip"), (below, "stick")):
        assert np.all(found.count == 1)
        assert np.all(found.count_of(name) == 1)


def test_at_its_critical_friction_no_rounded_stiffness_gives_the_rod_a_huge_reaction():
    assert _rod(slender_rod(), np.arctan(2), 0.0, -1, 4 / 3) == ()


@pytest.mark.parametrize("mass", ["1e-300", "1e300"])
def test_a_block_of_whatever_mass_rests_on_the_ground(mass):
    X, Y, U, V, m, f = sp.symbols("X Y U V m f")
    block = ap.Mechanism((X, Y), (U, V), sp.diag(m, m), (0, -m), ap.Contact(Y, X, f, unilateral=True))
    ((name, reaction),) = block.motions({"m": mass, "f": 1, "U": 0})
    assert (name, reaction) == ("stick", pytest.approx(float(mass)))


def test_a_map_counts_on_arrays_what_numbers_count_one_by_one():
    rod = slender_rod()
    theta, rate = np.linspace(0.1, 1.5, 8)[:, None], np.linspace(-5, 5, 7)
    values = {**GROUND, "theta": theta, "theta'": rate, "X'": -10, "f": 2}
    found = rod.motion_map(values)
    assert found.count.shape == (8, 7)
    assert {0, 1, 2} == set(found.count.flat)
    for i, j in product(range(8), range(7)):
        one = rod.motions({**values, "theta": theta[i, 0], "theta'": rate[j]})
        assert len(one) == found.count[i, j]
        for name in ("slip", "stick", "lift_off"):
            assert sum(motion.name == name for motion in one) == found.count_of(name)[i, j]
    for branch in found.branches:
        assert np.isfinite(branch.reaction).all()
        assert (branch.reaction[~branch.exists] == 0).all()


def test_a_map_counts_no_motions_of_a_name_that_is_none():
    found = slender_rod().motion_map({**GROUND, "theta": 1.1, "theta'": 0, "X'": -1, "f": 1})
    with pytest.raises(UnknownName, match=r"motion 'slide' is unknown.* choose one of slip, stick, lift_off"):
        found.count_of("slide")


@pytest.mark.parametrize("other", ["theta'", "X"])
def test_a_map_refuses_arrays_that_do_not_fit(other):
    values = {**GROUND, "theta": [1.0, 1.1], "theta'": 0.1, "X'": -1, "f": 2, other: [0.0, 0.1, 0.2]}
    with pytest.raises(InputError, match="do not broadcast"):
        slender_rod().motion_map(values)


def test_a_map_has_the_shape_of_all_that_is_given_and_not_of_what_matters_alone():
    values = {**GROUND, "theta": 1.1, "theta'": 0, "X'": -1, "X": np.zeros(3), "f": np.array([[1.0], [2.0]])}
    assert slender_rod().motion_map(values).count.tolist() == [[1, 1, 1], [0, 0, 0]]


@pytest.mark.parametrize(("bounds", "said"), [({"f": -1, "f_s": 2}, "not be negative"), ({"f": 2, "f_s": 1}, "below")])
def test_friction_that_is_none_is_refused_at_numbers_too(bounds, said):
    kinetic, static = sp.symbols("f f_s", real=True)
    rod = slender_rod(friction=kinetic, static=static)
    with pytest.raises(InputError, match=said):
        rod.motions({**GROUND, "theta": 1.1, "theta'": 0, "X'": -1, **bounds})


def test_where_any_reaction_would_do_the_count_is_undecided():
    import sympy as sp

    from asympk import Contact, Mechanism

    q, u = sp.symbols("X Y"), sp.symbols("U V")
    tie = Mechanism(q, u, [[2, 1], [1, 1]], (0, 0), Contact(q[1], q[0], 2))
    with pytest.raises(Undecided, match="any reaction would do"):
        tie.motions({"U": -1})


@pytest.mark.parametrize("angle", np.linspace(-1.5, 1.5, 8))
@pytest.mark.few(0)
def test_an_arm_stretched_out_at_rest_has_any_reaction_along_itself_and_in_motion_no_huge_one(angle):
    a, b = dynamicsymbols("a b")
    (u, v), f = (q.diff(dynamicsymbols._t) for q in (a, b)), sp.Symbol("f")
    links = (4 * u**2 + v**2 + 3 * u * v * sp.cos(a - b)) / 6 + sp.Rational(3, 2) * sp.cos(a) + sp.cos(b) / 2
    tip = ap.Contact(gap=-sp.cos(a) - sp.cos(b), slip=sp.sin(a) + sp.sin(b), friction=f, unilateral=True)
    arm = ap.Mechanism.from_lagrangian(links, (a, b), contact=tip)
    place = {"a": angle, "b": angle, "f": "1/2"}
    with pytest.raises(Undecided, match="any reaction would do"):
        arm.motions({**place, "a'": 0, "b'": 0})
    found = arm.motions({**place, "a'": 1, "b'": -1})
    assert len(found) == 1
    assert 0 <= found[0].reaction < 10


@pytest.mark.parametrize(("angle", "rate"), [(0, 0.25), (sp.pi, -0.25), (-sp.pi, -0.25), (2 * sp.pi, 0.25)])
def test_a_rod_that_lies_and_tips_rests_with_its_end_to_whichever_side_it_lies(angle, rate):
    ((name, reaction),) = slender_rod().motions({**GROUND, "theta": angle, "theta'": rate, "X'": 0, "f": 2})
    assert (name, reaction) == ("stick", pytest.approx(9.81 / 4))


@pytest.mark.parametrize(("rate", "motion"), [(0, "stick"), (1, "slip")])
@pytest.mark.few(0)
def test_at_the_dead_centre_of_a_slider_friction_is_idle_and_there_is_one_motion(rate, motion):
    numbers = {"J": 2, "m": 1, "r": 1, "l": "6/5", "T": 1, "f": 1}
    state = {"theta": 0, "phi": 0, "theta'": rate, "phi'": rate / 1.2}
    assert crank_slider.mechanism().motions({**numbers, **state}) == ((motion, 0.0),)


@pytest.mark.parametrize("place", ["X", "end"])
@pytest.mark.parametrize(("ahead", "behind", "counts"), [(1, 2, [1, 1, 0]), (2, 1, [0, 0, 1])])
@pytest.mark.few(1)
def test_on_the_edge_of_a_rough_patch_the_friction_is_that_of_the_side_the_contact_slides_to(
    place, ahead, behind, counts
):
    """The paradox begins at 1.33; the elastic and the rigid contact slide on where there is none."""
    X, Y, theta = dynamicsymbols("X Y theta")
    energy = (X.diff() ** 2 + Y.diff() ** 2) / 2 + theta.diff() ** 2 / 24 - Y
    end = X - sp.cos(theta) / 2
    rough = sp.Piecewise((ahead, (X if place == "X" else end) < 0), (behind, True))
    ground = ap.Contact(gap=Y - sp.sin(theta) / 2, slip=end, friction=rough, unilateral=True)
    rod = ap.Mechanism.from_lagrangian(energy, (X, Y, theta), contact=ground)
    edge, angle = (0 if place == "X" else sp.cos(1.1) / 2), sp.Rational(11, 10)
    state = {"X": edge, "Y": sp.sin(angle) / 2, "theta": "1.1", "X'": -1, "Y'": 0, "theta'": 0}
    assert len(rod.motions(state)) == counts[1]
    assert rod.evaluate(rod.jump_law().condition, state) == (not counts[1])
    assert rod.motion_map({**state, "X": float(edge) + np.array([-1, 0, 1])}).count.tolist() == counts
    if counts[1]:
        start = {**state, "X": 0 if place == "X" else sp.cos(angle) / 2}
        path = ap.solve(ap.Scene(system=rod.rigid(), start=rod.start(rod.rigid(), start), until="1/100"))
        assert path.modes == ("slip_opposite",)


def _point_of_one_direction(unilateral):
    """Return a point at rest on a ground that it also slides along: y'' = v' = P + R + F at x = 0."""
    x, y, u, v, f, P = sp.symbols("x y u v f P", real=True)
    ground = ap.Contact(y, v + x * u, f, unilateral=unilateral)
    return ap.Mechanism((x, y), (u, v), sp.eye(2), (0, P), ground), {"x": 0, "y": 0, "u": 0, "v": 0}


@pytest.mark.parametrize(("friction", "leaves"), [("1/2", True), (1, True), (2, False)])
def test_where_gap_and_slip_move_as_one_a_pulled_point_leaves_unless_friction_may_hold_it(friction, leaves):
    """R + F = -1 with |F| <= f R has solutions for f > 1 alone: a pull of 1 cannot be held by less."""
    point, place = _point_of_one_direction(unilateral=True)
    with nullcontext() if leaves else pytest.raises(Undecided, match="gap and slip move as one here"):
        assert [name for name, _ in point.motions({**place, "P": 1, "f": friction})] == ["lift_off"]


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize(
    ("push", "friction", "reaction"),
    [(0, 0, 0), (0, "1/2", 0), (0, 2, None), (1, 0, 1), (1, "1/2", None), (1, 2, None)],
)
def test_where_gap_and_slip_move_as_one_a_point_rests_with_the_one_reaction_that_friction_allows(
    unilateral, push, friction, reaction
):
    """R + F = push with |F| <= f |R| has one solution for f = 0, and R = F = 0 for push = 0 and f < 1."""
    point, place = _point_of_one_direction(unilateral)
    values = {**place, "P": -push, "f": friction}
    if reaction is None:
        with pytest.raises(Undecided, match="gap and slip move as one here"):
            point.motions(values)
    else:
        assert point.motions(values) == (("stick", reaction),)


@pytest.mark.parametrize(
    ("declared", "wrong"),
    [("positive", 0), ("negative", 1), ("nonnegative", -1), ("nonpositive", 1), ("nonzero", 0), ("integer", 0.5)],
)
def test_no_motion_is_counted_at_a_number_that_its_symbol_is_declared_not_to_be(declared, wrong):
    X, Y, U, V = sp.symbols("X Y U V", real=True)
    k = sp.Symbol("k", **{declared: True})
    block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, -2 - k / 4), ap.Contact(Y, X, 1, unilateral=True))
    with pytest.raises(InputError, match=f"k = .* is refused; the symbol is declared {declared}"):
        block.motions({"U": 1, "k": wrong})
    right = -1 if declared in ("negative", "nonpositive") else 1
    assert block.motions({"U": 1, "k": right}) == (("slip", 2 + right / 4),)
    assert block.motion_map({"U": 1, "k": [0, right]}).count.tolist() == [1, 1]


def test_motions_on_a_ground_that_moves_are_those_at_the_time_0_unless_another_is_given():
    """On a ground Y = sin(2 t)/10 the reaction of m = 1 is 10 - 0.4 sin(2 t)."""
    T, (X, Y) = dynamicsymbols._t, dynamicsymbols("X Y")
    ground = ap.Contact(gap=Y - sp.sin(2 * T) / 10, slip=X, friction=1, unilateral=True)
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - 10 * Y
    block = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ground)
    sliding = {"X": 0, "Y": 0, "X'": 1, "Y'": "0.2"}
    found = [block.motions(sliding | given) for given in ({}, {"t": 0}, {"t": 1})]
    expected = [10, 10, 10 - 0.4 * np.sin(2)]
    assert [motion.reaction for (motion,) in found] == pytest.approx(expected)
    assert [block.evaluate(-block.free[0], sliding | given) for given in ({}, {"t": 1})] == pytest.approx(expected[1:])


def test_a_paradox_set_on_a_guide_that_turns_is_that_at_the_time_0_unless_another_is_given():
    """For M = (1, q; q, 1) along Y = t X, f = 2: 2 (q + t) > 1 + 2 q t + t^2, so that q > (1 - t)/2."""
    T, (X, Y), q = dynamicsymbols._t, dynamicsymbols("X Y"), sp.Symbol("q")
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + q * X.diff(T) * Y.diff(T)
    guide = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ap.Contact(gap=Y - T * X, slip=X, friction=2))
    edges = [guide.paradox_set({q: (0, "0.9")}, given).edges for given in ({}, {"t": "0.1"})]
    assert edges == [pytest.approx((0.5,)), pytest.approx((0.45,))]
