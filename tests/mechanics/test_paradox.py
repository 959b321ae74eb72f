"""Where the paradox is: critical friction, its least value, and the configurations that have one."""

import math

import numpy as np
import pytest
import sympy as sp
from mechanisms import THETA, T, X, Y, chain, masses_between_guides, slender_rod
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.errors import InputError, NotDerivable
from asympk.mechanics.paradox import critical_friction


def test_least_critical_friction_of_the_slender_rod_is_4_over_3_at_tan_theta_2():
    """Published many times over: Génot and Brogliato (1999), Leine, Brogliato and Nijmeijer (2002)."""
    least = slender_rod().least_critical_friction("theta")
    assert least.friction == sp.Rational(4, 3)
    assert least.where == sp.Eq(sp.tan(THETA), 2)
    assert slender_rod().least_critical_friction("theta", {"theta": "1.1", "m": 1}) == least  # as at the given numbers


def test_least_critical_friction_of_a_rod_with_any_radius_of_inertia():
    """With 1/kappa the inertia in m l^2: 2 sqrt(1 + kappa) / kappa at tan(theta) = sqrt(1 + kappa) (Or 2014)."""
    X, Y, theta = dynamicsymbols("X Y theta")
    t, kappa = dynamicsymbols._t, sp.Symbol("kappa", positive=True)
    L = (X.diff(t) ** 2 + Y.diff(t) ** 2 + theta.diff(t) ** 2 / kappa) / 2 - Y
    rod = ap.Mechanism.from_lagrangian(
        L, (X, Y, theta), contact=ap.Contact(Y - sp.sin(theta), X - sp.cos(theta), sp.Symbol("f"), unilateral=True)
    )
    least = rod.least_critical_friction(theta)
    assert sp.simplify(least.friction - 2 * sp.sqrt(1 + kappa) / kappa) == 0
    assert least.where == sp.Eq(sp.tan(theta), sp.sqrt(1 + kappa))
    assert rod.least_critical_friction(theta, {"kappa": 3}).friction == sp.Rational(4, 3)


def test_least_critical_friction_of_a_box_on_its_corner_is_that_of_a_rod_as_long_as_its_diagonal():
    """The corner is at (a, b) from the centre: 2 sqrt(J (J + m r^2)) / (m r^2) with r^2 = a^2 + b^2."""
    a, b, J, m = sp.symbols("a b J m", positive=True)
    L = m * (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + J * THETA.diff(T) ** 2 / 2
    s, c = sp.sin(THETA), sp.cos(THETA)
    corner = ap.Contact(gap=Y - a * s - b * c, slip=X - a * c + b * s, friction=sp.Symbol("f"), unilateral=True)
    box = ap.Mechanism.from_lagrangian(L, (X, Y, THETA), contact=corner)
    least, r = box.least_critical_friction(THETA), sp.sqrt(a**2 + b**2)
    assert sp.simplify(least.friction - 2 * sp.sqrt(J * (J + m * r**2)) / (m * r**2)) == 0
    values = {a: 2, b: 3, J: 1, m: 1}
    place = {**values, THETA: sp.atan(least.where.rhs.subs(values))}
    assert box.evaluate(box.critical_friction, place) == pytest.approx(float(least.friction.subs(values)))


def leaning(ratio):
    """Return a mechanism whose G_NT / G_NN is a given function of an angle."""
    X, Y = dynamicsymbols("X Y")
    t = dynamicsymbols._t
    L = (X.diff(t) ** 2 + Y.diff(t) ** 2 + THETA.diff(t) ** 2) / 2
    contact = ap.Contact(gap=Y, slip=X.diff(t) + ratio * Y.diff(t), friction=sp.Symbol("f", positive=True))
    return ap.Mechanism.from_lagrangian(L, (X, Y, THETA), contact=contact)


PRODUCT = sp.sin(THETA) * sp.cos(THETA)
RATIOS = {
    "the least one at a negative angle": PRODUCT / (1 + PRODUCT),
    "stationary at positive angles where it is greatest": 1 / (1 + PRODUCT),
    "the least one where the sine vanishes": sp.cos(THETA) ** 2 / (sp.cos(THETA) ** 2 + 9 * sp.sin(THETA) ** 2),
    "the least one where the cosine vanishes": sp.sin(THETA) ** 2 / (sp.sin(THETA) ** 2 + 9 * sp.cos(THETA) ** 2),
    "a tangent": sp.tan(THETA) / (1 + sp.tan(THETA) ** 2),
}


@pytest.mark.parametrize("name", RATIOS)
@pytest.mark.few(2)
def test_the_least_critical_friction_is_the_least_over_all_angles(name):
    mechanism = leaning(RATIOS[name])
    least = mechanism.least_critical_friction(THETA)
    angles = np.linspace(-np.pi, np.pi, 40_002)
    everywhere = sp.lambdify(THETA, mechanism.critical_friction, "numpy")(angles)
    assert everywhere.min() == pytest.approx(float(least.friction), rel=1e-7)
    place = angles[everywhere.argmin()]
    assert float((least.where.lhs - least.where.rhs).subs(THETA, place)) == pytest.approx(0, abs=1e-3)


def test_a_hoop_with_a_weight_on_its_rim_has_its_least_critical_friction_by_half_its_angle():
    """(M + m - m cos) / (m |sin|) is least where cos = m / (M + m)."""
    M, m, f = sp.symbols("M m f", positive=True)
    rim = X + sp.sin(THETA), Y + sp.cos(THETA)
    energy = (M * (X.diff() ** 2 + Y.diff() ** 2 + THETA.diff() ** 2) + m * sum(part.diff() ** 2 for part in rim)) / 2
    hoop = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=ap.Contact(Y - 1, X - THETA, f, unilateral=True))
    least = hoop.least_critical_friction(THETA)
    assert sp.simplify(least.friction - sp.sqrt(M * (M + 2 * m)) / m) == 0
    assert sp.simplify(least.where.rhs - sp.sqrt(M / (M + 2 * m))) == 0
    assert least.where.lhs == sp.tan(THETA / 2)


@pytest.mark.further
def test_a_least_critical_friction_that_no_radicals_give_is_the_root_of_a_polynomial():
    """A cam with a weight beside its middle; its least critical friction took minutes for want of such a root."""
    weight = X + sp.sin(THETA) / 2, Y + sp.cos(THETA) / 2
    energy = (X.diff() ** 2 + Y.diff() ** 2 + THETA.diff() ** 2 + sum(part.diff() ** 2 for part in weight)) / 2
    gap, slip = Y - 1 - sp.sin(2 * THETA) / 4, X - THETA + sp.sin(THETA)
    cam = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=ap.Contact(gap, slip, 1, unilateral=True))
    least, angles = cam.least_critical_friction(THETA), np.linspace(-np.pi, np.pi, 200001)
    over = np.abs(sp.lambdify(THETA, cam.critical_friction)(angles))
    assert isinstance(least.friction, sp.CRootOf)
    assert float(least.friction) == pytest.approx(over.min(), rel=1e-7)
    assert 2 * math.atan(least.where.rhs) == pytest.approx(angles[over.argmin()], abs=1e-4)


@pytest.mark.slow
def test_the_least_critical_friction_of_an_ellipse_on_the_ground_is_that_of_its_shape_and_a_circle_has_none():
    """By its support h: dh/d theta is the arm of the reaction. Radicals of its sextic in the half-axes took no end."""
    a, b, angles = *sp.symbols("a b", positive=True), np.linspace(0.001, 1.57, 200001)
    h = sp.sqrt(a**2 * sp.sin(THETA) ** 2 + b**2 * sp.cos(THETA) ** 2)
    energy = (X.diff() ** 2 + Y.diff() ** 2) / 2 + (a**2 + b**2) / 8 * THETA.diff() ** 2
    ground = ap.Contact(gap=Y - h, slip=X.diff() + h * THETA.diff(), friction=1, unilateral=True)
    ellipse = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=ground)
    height = np.sqrt(4 * np.sin(angles) ** 2 + np.cos(angles) ** 2)
    arm = 3 * np.sin(angles) * np.cos(angles) / height
    least = ellipse.least_critical_friction(THETA, {a: 2, b: 1}).friction
    assert float(least) == pytest.approx(((5 / 4 + arm**2) / (arm * height)).min(), rel=1e-8)
    for values in ({}, {a: 1}):
        with pytest.raises(NotDerivable, match="depends on parameters; give their values"):
            ellipse.least_critical_friction(THETA, values)
    with pytest.raises(NotDerivable, match="no paradox at any friction"):
        ellipse.least_critical_friction(THETA, {a: 1, b: 1})


@pytest.mark.further
def test_a_least_critical_friction_with_irrational_numbers_that_no_radicals_give_is_refused_by_name():
    gap = Y - sp.cos(THETA) / 3 - sp.sin(2 * THETA) / 4
    energy = (X.diff() ** 2 + Y.diff() ** 2 + sp.sqrt(2) * THETA.diff() ** 2) / 2
    cam = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=ap.Contact(gap, X - THETA, 1, unilateral=True))
    with pytest.raises(NotDerivable, match="polynomial with irrational numbers; give rational ones"):
        cam.least_critical_friction(THETA)


def test_a_critical_friction_without_a_least_value_is_told():
    with pytest.raises(NotDerivable, match=r"is .* at every x1\(t\)"):
        masses_between_guides().least_critical_friction("x1")
    with pytest.raises(NotDerivable, match="no rational function"):
        leaning(1 + THETA**2).least_critical_friction(THETA)
    block = ap.Mechanism.from_lagrangian((X.diff() ** 2 + Y.diff() ** 2) / 2, (X, Y), contact=ap.Contact(Y, X, 1))
    with pytest.raises(NotDerivable, match="no paradox at any friction: a reaction does not change the sliding"):
        block.least_critical_friction("X")
    with pytest.raises(NotDerivable, match="too long to be inverted in symbols"):
        chain(3).least_critical_friction("q1")
    with pytest.raises(NotDerivable, match="comes down to 0"):
        leaning(1 / PRODUCT).least_critical_friction(THETA)
    with pytest.raises(NotDerivable, match="comes down to 0"):
        leaning(1 / (sp.sin(THETA) ** 2 - sp.cos(THETA) ** 2)).least_critical_friction(THETA)


def test_edges_of_the_paradox_are_where_the_friction_is_critical():
    """1 + 3 cos^2 = 3 f sin cos is quadratic in tan(theta): T^2 - 3 f T + 4 = 0."""
    friction = 1.5
    found = slender_rod().paradox_set({"theta": (0, "1.57")}, {"f": friction, "m": 1})
    roots = np.arctan(np.sort(np.roots([1, -3 * friction, 4])))
    ((start, end),) = ((i.start, i.end) for i in found.intervals)
    assert [start, end] == pytest.approx(roots, abs=1e-14)
    assert found.edges == (start, end)


def test_there_is_no_paradox_below_the_least_critical_friction():
    assert slender_rod().paradox_set({"theta": (0, "1.57")}, {"f": "1.333", "m": 1}).intervals == ()
    assert len(slender_rod().paradox_set({"theta": (0, "1.57")}, {"f": "1.334", "m": 1}).intervals) == 1


@pytest.mark.parametrize("friction", ["4/3", 4 / 3])
@pytest.mark.parametrize("ends", [(-4, 4), (0, sp.pi), (sp.atan(2), sp.pi / 2)])
def test_at_the_least_critical_friction_the_paradox_is_touched_and_nowhere_met(friction, ends):
    assert slender_rod().paradox_set({"theta": ends}, {"f": friction, "m": 1}).intervals == ()


def test_an_edge_at_0_is_0_and_not_the_least_number_beside_it():
    """At theta = 0 the gap of a wiper's arm does not change with theta; beside it the critical friction is |tan|."""
    X, t = dynamicsymbols("X"), dynamicsymbols._t
    wiper = ap.Contact(gap=1 - sp.cos(THETA), slip=X + sp.sin(THETA), friction=sp.Rational(1, 2), unilateral=True)
    arm = ap.Mechanism.from_lagrangian((X.diff(t) ** 2 + THETA.diff(t) ** 2) / 2, (X, THETA), contact=wiper)
    first, *zeros, last = arm.paradox_set({"theta": (-1, 1)}).edges
    assert zeros == [0, 0]
    assert np.allclose([-first, last], np.arctan(0.5), rtol=1e-14)


def test_over_two_coordinates_every_row_is_that_of_one():
    found = slender_rod().paradox_set({"theta": (0, "1.57"), "f": (1, 3)}, {"m": 1})
    assert found.over == ("theta", "f")
    some = found.intervals[len(found.intervals) // 2]
    (one,) = slender_rod().paradox_set({"theta": (0, "1.57")}, {"f": some.other, "m": 1}).intervals
    assert (some.start, some.end) == (one.start, one.end)
    assert min(i.other for i in found.intervals) == pytest.approx(4 / 3, abs=0.02)


def test_a_range_of_a_friction_that_is_positive_may_begin_at_0():
    """Only as the first of two: as the second it was refused, as 0 is not positive."""
    found = ap.systems.painleve_rod.mechanism().paradox_set({"theta": (0, "1.57"), "f": (0, 3)}, {"m": 1, "l": 1})
    tangents = [sorted((np.tan(part.start), np.tan(part.end))) for part in found.intervals]
    roots = [np.roots([1, -3 * part.other, 4]) for part in found.intervals]
    assert len(tangents) == 112
    assert np.allclose(tangents, np.sort(roots), rtol=1e-12)


@pytest.mark.further
def test_a_coordinate_that_the_contact_ties_is_given_as_a_function():
    """A slider-crank whose rod is as long as its crank: phi = theta while the slider is in its guide."""
    crank = ap.systems.crank_slider.mechanism()
    values = {"J": 2, "m": 1, "r": 1, "l": 1, "f": 3, "phi": lambda theta: theta}
    found = crank.paradox_set({"theta": ("0.1", "1.5")}, values)
    for edge in found.edges:
        at = {**values, "theta": edge, "phi": edge}
        assert crank.evaluate(crank.critical_friction, at) == pytest.approx(3, rel=1e-10)
    assert found.intervals


def test_an_interval_that_no_sample_meets_is_found_by_the_roots_of_a_polynomial():
    """Just above the least critical friction 4/3 the paradox is a sliver around tan(theta) = 2."""
    found = slender_rod().paradox_set({"theta": (0, "1.57")}, {"f": "1.3333334", "m": 1})
    roots = np.arctan(np.sort(np.roots([1, -3 * 1.3333334, 4])))
    assert found.complete
    assert found.edges == pytest.approx(roots, abs=1e-12)
    assert roots[1] - roots[0] < 1.57 / 2001


def test_over_two_symbols_that_are_not_declared_real_no_interval_is_missing_either():
    """The paradox f |X - a| > 1 + a^2 begins where a is a double root: f = 2 at X = 0."""
    X, Y, U, V, a, f = sp.symbols("X Y U V a f")
    block = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, 0), ap.Contact(Y - a * X, U + X * V, f))
    found = block.paradox_set({a: (-3, "3.01"), X: (-1, 1)}, {f: "2.0000001"})
    roots = [root.real for row in np.linspace(-1, 1, 201) for side in (1, -1)
             for root in np.roots([1, side * 2.0000001, 1 - side * 2.0000001 * row]) if abs(root.imag) < 1e-9]
    assert found.complete
    assert sorted(found.edges) == pytest.approx(sorted(root for root in roots if -3 < root < 3.01), abs=1e-7)


def test_edges_over_several_turns_are_those_of_one_turn_repeated():
    rod, values = slender_rod(), {"f": 2, "m": 1}
    once = rod.paradox_set({"theta": (-2, 2 * np.pi - 2)}, values).edges
    four = rod.paradox_set({"theta": (-2 - 2 * np.pi, 6 * np.pi - 2)}, values).edges
    assert len(four) == 4 * len(once) == 32
    assert np.reshape(four, (4, -1)) - 2 * np.pi * np.arange(-1, 3)[:, None] == pytest.approx(np.tile(once, (4, 1)))


@pytest.mark.slow
def test_an_interval_between_two_samples_is_found_without_a_polynomial_too():
    """The slider-crank's rod angle is tied by an arcsine: a sliver just above the least critical friction."""
    crank = ap.systems.crank_slider
    values = {name: crank.VALUES[name] for name in ("J", "m", "r", "l")}
    values["phi"] = lambda theta: np.arcsin(np.sin(theta) / 1.2)
    at, rod = np.linspace(0.3, 3, 200001), crank.mechanism()
    critical = rod.evaluate(rod.critical_friction, {**values, "theta": at, "phi": values["phi"](at)})
    least, where = critical.min(), at[critical.argmin()]
    found = rod.paradox_set({"theta": (0.3, 3)}, {**values, "f": least + 1e-9})
    assert not found.complete
    ((start, end),) = ((i.start, i.end) for i in found.intervals)
    assert start < where < end
    assert end - start < 2.7 / 2001


def test_a_gap_between_two_samples_is_found_without_a_polynomial_too():
    X, Y, U, V = sp.symbols("X Y U V", real=True)  # the critical friction is 2, and samples are 1/2000 apart
    friction = 1 + sp.cosh(X - sp.Rational(1, 3)) - sp.Rational(1, 10**8)
    block = ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, X, friction))
    low, high = block.paradox_set({"X": (0, 1)}).intervals
    assert (low.start, high.end) == (0, 1)
    assert (low.end, high.start) == pytest.approx([1 / 3 + side * np.arccosh(1 + 1e-8) for side in (-1, 1)], abs=1e-10)


def test_over_a_parameter_the_edge_is_the_critical_friction():
    rod = slender_rod()
    (edge,) = rod.paradox_set({"f": (0, 10)}, {"theta": "1.1", "m": 1}).edges
    assert edge == pytest.approx(float(rod.evaluate(rod.critical_friction, {"theta": 1.1})), rel=1e-15)


@pytest.mark.parametrize(
    ("ranges", "match"),
    [
        ({}, "0 ranges"),
        ({"theta": (1, 0)}, "low < high"),
        ({"theta": 1}, "give \\(low, high\\)"),
        ({"theta": (0, [])}, "two numbers"),
        ({"theta": ([1, 2, 3], 4)}, "two numbers"),
        ({"theta": (0, float("nan"))}, "range of theta"),
        ({"theta": (-1e7, 1e7)}, "range of theta = .* more than 10000 turns; give one"),
        ({"theta": (0, 1), "f": (0, 1), "m": (1, 2)}, "3 ranges"),
    ],
)
def test_ranges_that_are_none_are_refused(ranges, match):
    with pytest.raises(InputError, match=match):
        slender_rod().paradox_set(ranges, {"f": 1, "m": 1})


@pytest.mark.parametrize(("over", "given"), [({"theta": (0, 1)}, {"m": -1}), ({"theta": (0, 1), "m": (-1, 1)}, {}),
                                             ({"m": (-1, 1)}, {"theta": 1})])
def test_no_set_is_given_where_a_mass_is_negative(over, given):
    """The Delassus matrix then is negative, too, and its paradox was everywhere."""
    mass = sp.Symbol("m", real=True)
    kinetic = mass * (X.diff(T) ** 2 + Y.diff(T) ** 2 + THETA.diff(T) ** 2 / 3) / 2
    end = ap.Contact(gap=Y - sp.sin(THETA), slip=X - sp.cos(THETA), friction=1, unilateral=True)
    rod = ap.Mechanism.from_lagrangian(kinetic, (X, Y, THETA), contact=end)
    with pytest.raises(InputError, match="the mass matrix is not positive"):
        rod.paradox_set(over, given)


@pytest.mark.parametrize("more", [{}, {"f": (0.5, 3)}])
@pytest.mark.few(1)
def test_the_set_is_shown_in_a_few_lines_and_drawn_as_far_as_its_edges(tmp_path, more):
    pytest.importorskip("matplotlib")
    fixed = {"f": 2, "l": 1, "m": 1, "g": 1}
    found = ap.systems.painleve_rod.mechanism().paradox_set(
        {"theta": (0.05, 1.5), **more}, {name: value for name, value in fixed.items() if name not in more}
    )
    assert 2 <= repr(found).count("\n") + 1 <= 10
    figure = found.plot(tmp_path / "set.svg")
    assert (tmp_path / "set.svg").read_bytes().startswith(b"<?xml")
    drawn = [path.get_extents() for bars in figure.axes[0].collections for path in bars.get_paths()]
    assert min(box.x0 for box in drawn) == pytest.approx(min(i.start for i in found.intervals), abs=1e-12)
    assert max(box.x1 for box in drawn) == pytest.approx(max(i.end for i in found.intervals), abs=1e-12)
    with pytest.raises(InputError, match=r"a plot is written as one of"):
        found.plot(tmp_path / "set.gif")


@pytest.mark.further
def test_the_critical_friction_leaves_out_what_both_its_fractions_are_divided_by():
    T = dynamicsymbols._t
    phi, Y, xi, alpha = q = dynamicsymbols("phi Y xi alpha")
    p, y, x, a = (coordinate.diff(T) for coordinate in q)
    m0, m1, m2, f = sp.symbols("m0 m1 m2 f", positive=True)
    L = m0 * ((sp.cos(phi) * p + x) ** 2 + p**2) / 2 + m1 * y**2 / 2 + m2 * (sp.sin(phi) ** 2 * p**2 + x**2) / 2
    L += (sp.sin(Y) * y + sp.sin(xi) * x) ** 2 + (2 * y + a) ** 2 / 4
    contact = ap.Contact(gap=phi**2 - xi, slip=alpha + phi, friction=f)
    kinetics = ap.Mechanism.from_lagrangian(L, q, contact=contact).plain
    G, critical = kinetics.delassus, critical_friction(kinetics)
    place = {s: sp.Rational(k + 3, 4) for k, s in enumerate(sorted(G.free_symbols | critical.free_symbols, key=str))}
    assert abs((critical - G[0, 0] / sp.Abs(G[0, 1])).subs(place).evalf(30)) < 1e-25
    assert critical.count_ops() < 200 < G[0, 0].count_ops() + G[0, 1].count_ops()


def test_the_least_friction_of_a_mechanism_with_a_parameter_called_T_is_that_of_any_other_name():
    for name in sp.symbols("T k", real=True):
        least = slender_rod(load=1 + name**2).least_critical_friction(THETA)
        assert sp.simplify(least.friction * (1 + name**2)) == sp.Rational(4, 3)


def test_a_friction_whose_square_no_double_holds_has_a_paradox_set():
    rod = slender_rod()
    found = rod.paradox_set({"theta": (0.05, 1.5)}, {"f": 1e300, "m": 1, "l": 1, "g": 1})
    assert [(span.start, span.end) for span in found.intervals] == [(0.05, 1.5)]


def test_on_a_round_ground_the_critical_friction_is_rational_in_its_place_and_its_paradox_is_searched_for_by_roots():
    """The gap is a root, sqrt(X^2 + Y^2) - r; with the mass matrix (2, 1; 1, 2) G_NN is X^2 - X Y + Y^2 to a factor."""
    x, y, u, v, f, r = sp.symbols("X Y U V f r", real=True)
    distance = sp.sqrt(x**2 + y**2)
    contact = ap.Contact(distance - r, (x * v - y * u) / distance, f, unilateral=True)
    bead = ap.Mechanism((x, y), (u, v), [[2, 1], [1, 2]], (0, -10), contact)
    expected = 2 * (x**2 - x * y + y**2) / (x**2 - y**2)
    assert sp.factor((bead.critical_friction**2 - expected**2).replace(sp.Abs, lambda part: part)) == 0
    found = bead.paradox_set({x: (0.01, 0.9)}, {y: 1, f: 2})
    assert found.complete
    assert found.edges == pytest.approx([0.5])


def elliptic_pendulum():
    """Return Le Suan An's elliptic pendulum: a slider m1 on a rough guide that holds both ways, a pendulum m2 below."""
    x, y, angle = dynamicsymbols("x y theta")
    t, (m1, m2, length, g, f) = dynamicsymbols._t, sp.symbols("m1 m2 l g f", positive=True)
    bob = x + length * sp.sin(angle), y - length * sp.cos(angle)
    kinetic = (m1 * (x.diff(t) ** 2 + y.diff(t) ** 2) + m2 * (bob[0].diff(t) ** 2 + bob[1].diff(t) ** 2)) / 2
    guide = ap.Contact(gap=y, slip=x, friction=f)
    return ap.Mechanism.from_lagrangian(kinetic - g * (m1 * y + m2 * bob[1]), (x, y, angle), contact=guide)


def test_the_elliptic_pendulum_has_a_paradox_above_a_friction_that_is_least_at_an_angle_of_its_masses_alone():
    """(m1 + m2 s^2)/(m2 |s c|) is (m1 + (m1 + m2) T^2)/(m2 T) in T = tan(theta), least at T^2 = m1/(m1 + m2)."""
    pendulum, (m1, m2) = elliptic_pendulum(), sp.symbols("m1 m2", positive=True)
    s, c = sp.sin(pendulum.coordinates[2]), sp.cos(pendulum.coordinates[2])
    assert sp.simplify(pendulum.critical_friction - (m1 + m2 * s**2) / (m2 * sp.Abs(s * c))) == 0
    least = pendulum.least_critical_friction("theta", {"m1": 1, "m2": 3, "l": 1, "g": 1})
    assert (least.friction, least.where.rhs) == (sp.Rational(4, 3), sp.Rational(1, 2))


@pytest.mark.further
def test_the_pull_of_a_swinging_pendulum_turns_the_load_of_its_slider_where_newtons_equations_say():
    pendulum, numbers = elliptic_pendulum(), {"m1": 1, "m2": 3, "l": 1, "g": 1, "f": "6/5"}
    place = {"x": 0, "y": 0, "theta": "0.9", "x'": 1, "y'": 0, "theta'": 3}
    system = pendulum.rigid()
    path = ap.solve(ap.Scene(system=system, values=numbers, start=pendulum.start(system, place | numbers), until=1))

    def forces(w):
        """Return x'', theta'' and the load N of the slider, which is pulled back by 6 N / 5."""
        s, c = np.sin(w[1]), np.cos(w[1])
        rows = [[4, 3 * c, 1.2], [c, 1, 0], [0, 3 * s, -1]]
        return np.linalg.solve(rows, [3 * s * w[3] ** 2, -s, -4 - 3 * c * w[3] ** 2])

    def load(_, w):
        return forces(w)[2]

    load.terminal = True
    found = solve_ivp(lambda _, w: (*w[2:], *forces(w)[:2]), (0, 1), (0, 0.9, 1, 3), events=load, rtol=1e-11, atol=1e-9)
    assert [(e.kind, float(e.t)) for e in path.events] == [("force_zero", pytest.approx(found.t[-1], rel=1e-8))]
    assert path.modes == ("slip_same", "slip_opposite")
    assert [path(found.t[-1])[k] for k in (0, 2, 3, 5)] == pytest.approx(found.y[:, -1], rel=1e-7)
