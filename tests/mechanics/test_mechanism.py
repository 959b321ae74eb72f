"""Mechanism and Contact: the same contact from every way to write it down, and one line for what is none."""

import math
import time
import tomllib
from fractions import Fraction

import mpmath
import pytest
import sympy as sp
from mechanisms import SLENDER_ROD, THETA, T, X, Y, f, g, l, m, masses_between_guides, slender_rod
from sympy.physics.mechanics import KanesMethod, LagrangesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import asympk as ap
from asympk.errors import InputError, OutOfRange, UnknownName
from asympk.mechanics.described import mechanism_of_table
from asympk.mechanics.evaluation import evaluate
from asympk.symbolic.tidy import cofactors, expanded_determinant, tidy

FREE = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2
U, V = dynamicsymbols("U V")


def _same(left, right):
    return all(sp.simplify(a - b) == 0 for a, b in zip(left, right, strict=True))


def test_slender_rod_has_the_published_contact():
    """m p = 1 + 3 cos(theta)(cos(theta) -+ f sin(theta)), a_N = -g + l theta'^2 sin(theta) (Génot, Brogliato 1999)."""
    rod = slender_rod()
    s, c = sp.sin(THETA), sp.cos(THETA)
    assert _same(rod.delassus, sp.Matrix([[1 + 3 * c**2, -3 * s * c], [-3 * s * c, 1 + 3 * s**2]]) / m)
    assert _same(rod.free, (-g + l * s * THETA.diff(T) ** 2, l * c * THETA.diff(T) ** 2))
    assert sp.simplify(rod.critical_friction - (1 + 3 * c**2) / (3 * sp.Abs(s * c))) == 0


def test_the_critical_friction_on_a_narrow_bump_of_the_ground_is_that_of_its_slope():
    """n = (-h', 1, cos(theta)) and t = (1, 0, -sin(theta)) of a rod's tip on Y = h(X); SymPy splits the exponential."""
    ground = sp.exp(-4000 * (X - sp.S.Half) ** 2) / 100
    tip = ap.Contact(Y + sp.sin(THETA) - ground, X + sp.cos(THETA), friction=f, unilateral=True)
    rod = ap.Mechanism.from_lagrangian(FREE + THETA.diff(T) ** 2 / 6 - Y, (X, Y, THETA), contact=tip)
    slope, lean = -0.8 * math.exp(-0.4), 0.3
    normal = slope**2 + 1 + 3 * math.cos(lean) ** 2
    tangential = -slope - 3 * math.sin(lean) * math.cos(lean)
    found = rod.evaluate(rod.critical_friction, {"X": 0.51, "theta": lean})
    assert found == pytest.approx(normal / abs(tangential), rel=1e-13)


def test_an_exponential_of_a_high_multiple_is_tidied_as_it_stands():
    """SymPy takes it to be a power of degree 4000, and seeks factors of polynomials of that degree."""
    x, y = sp.symbols("x y", real=True)
    pulse = (x - 1) * sp.exp(4000 * x) * sp.exp(-4000 * x**2)
    assert tidy(pulse + y) == pulse + y


def _file(change, more):
    return mechanism_of_table(tomllib.loads(SLENDER_ROD.replace(*change) + more), "rod.toml").mechanism


def test_a_file_with_the_mass_and_all_forces_describes_what_a_lagrangian_does():
    numbers = "[values]\nm = 1\nl = 1\ng = 1\nf = 2\n"
    lagrangian = next(line for line in SLENDER_ROD.splitlines() if line.startswith("lagrangian"))
    rows = 'mass = [["m", 0, "0"], ["0", "m", "0"], ["0", "0", "m*l^2/3"]]'
    derived, given = _file(("", ""), numbers), _file((lagrangian, rows), f'[forces]\nY = "-m*g"\n{numbers}')
    assert _same(derived.delassus, given.delassus)
    assert _same(derived.free, given.free)


@pytest.mark.parametrize(
    ("change", "more", "match"),
    [
        (("lagrangian", "mass = [['m']]\nlagrangian"), "", "give either lagrangian or mass"),
        (("lagrangian", "about"), "", "give either lagrangian or mass"),
        (("lagrangian", "mass"), "", "mass must be a list of rows"),
        (("", ""), "[forces]\nZ = 1", "forces: Z is no coordinate"),
        (("", ""), "[forces]\nuntil = 1", r"until is no coordinate; until is below \[forces\] and must be"),
        (("unilateral = true", "forces = 1"), "", r"forces = 1: it must be a table, \[forces\]"),
        (("true", '"yes"'), "", "unilateral must be true or false"),
        (("", ""), "[over]\ntheta = 1", r"over: theta = 1: give its range, \[low, high\]"),
        (("", ""), "over = 1", "over must name one coordinate or parameter"),
        (("", ""), "[over]\nthet = [0, 1]", "over: thet is no coordinate and no parameter; did you mean theta"),
    ],
)
def test_a_file_that_describes_no_mechanism_is_refused_in_one_line(change, more, match):
    with pytest.raises(InputError, match=match):
        _file(change, f"{more}\n[values]\nm = 1\nl = 1\ng = 1\nf = 2\n")


def test_painleve_klein_has_its_paradox_for_f_tan_alpha_above_2():
    rod = masses_between_guides()
    alpha = sp.Symbol("alpha", positive=True)
    assert sp.simplify(rod.critical_friction.subs(alpha, sp.pi / 3) - 2 / sp.tan(sp.pi / 3)) == 0
    assert sp.simplify(rod.delassus[0, 0] - 2 * sp.cos(alpha) ** 2 / m) == 0


def test_plain_symbols_give_what_the_lagrangian_gives():
    q = sp.symbols("X Y theta", real=True)
    u = sp.symbols("X' Y' theta'", real=True)
    contact = ap.Contact(gap=q[1] - l * sp.sin(q[2]), slip=u[0] + l * sp.sin(q[2]) * u[2], friction=f, unilateral=True)
    plain = ap.Mechanism(q, u, sp.diag(m, m, m * l**2 / 3), (0, -m * g, 0), contact)
    own = dict(zip((*q, *u), (X, Y, THETA, X.diff(T), Y.diff(T), THETA.diff(T)), strict=True))
    rod = slender_rod()
    assert _same(plain.delassus.xreplace(own), rod.delassus)
    assert _same([part.xreplace(own) for part in plain.free], rod.free)
    assert plain.sliding_velocity == contact.slip


@pytest.mark.parametrize(
    ("potential", "force"),
    [(sp.Abs(X), -sp.sign(X)), (5 * sp.Max(X - 1, 0) ** 2, -10 * sp.Max(X - 1, 0) * sp.Heaviside(X - 1))],
)
def test_coordinates_are_real_where_a_potential_has_a_kink(potential, force):
    kinetic = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2
    block = ap.Mechanism.from_lagrangian(kinetic - potential, (X, Y), contact=ap.Contact(gap=Y, slip=X, friction=f))
    x = sp.Symbol("X", real=True)
    assert block.plain.forces == sp.Matrix([force.subs(X, x), 0])


def test_a_method_of_lagrange_and_one_of_kane_give_the_same_mechanism():
    """A particle on a pendulum of variable length, with a speed that is no rate: u = r theta'."""
    r, a, v, w = dynamicsymbols("r a v w")
    contact = ap.Contact(gap=r * sp.cos(a) + 1, slip=r * sp.sin(a), friction=f)
    lagrangian = m * (r.diff(T) ** 2 + r**2 * a.diff(T) ** 2) / 2 + m * g * r * sp.cos(a)
    direct = ap.Mechanism.from_lagrangian(lagrangian, (r, a), contact=contact)
    lagrange = ap.Mechanism.from_lagrangian(LagrangesMethod(lagrangian, [r, a]), contact=contact)
    kane = ap.Mechanism.from_lagrangian(_pendulum_of_kane(r, a, v, w), contact=contact)
    for other in (lagrange, kane):
        assert _same(direct.delassus, other.delassus)
        assert _same(direct.free, other.free)


def _pendulum_of_kane(r, a, v, w):
    N = ReferenceFrame("N")
    B = N.orientnew("B", "Axis", (a, N.z))
    B.set_ang_vel(N, w / r * N.z)
    origin = Point("O")
    origin.set_vel(N, 0)
    mass = origin.locatenew("P", -r * B.y)
    mass.set_vel(N, -v * B.y + w * B.x)
    method = KanesMethod(N, q_ind=[r, a], u_ind=[v, w], kd_eqs=[r.diff(T) - v, r * a.diff(T) - w])
    method.kanes_equations([Particle("p", mass, m)], [(mass, -m * g * N.y)])
    return method


def test_delassus_matrix_is_that_of_unit_forces_in_newtons_law():
    """Solve M a = W_N and M a = W_T for numbers and project: no symbolic inverse, no simplification."""
    a, b = dynamicsymbols("a b")
    L = (3 * a.diff(T) ** 2 + 2 * a.diff(T) * b.diff(T) * sp.cos(a - b) + b.diff(T) ** 2) / 2
    reach = ap.Contact(gap=2 * sp.sin(a) + sp.sin(b), slip=2 * sp.cos(a) + sp.cos(b), friction=f)
    arm = ap.Mechanism.from_lagrangian(L, (a, b), contact=reach)
    at = {a: 0.7, b: -0.4}
    mass = sp.Matrix([[3, sp.cos(1.1)], [sp.cos(1.1), 1]])
    W = sp.Matrix([[2 * sp.cos(0.7), sp.cos(-0.4)], [-2 * sp.sin(0.7), -sp.sin(-0.4)]])
    expected = W * mass.inv() * W.T
    assert all(abs(part) < 1e-13 for part in arm.delassus.subs(at).evalf() - expected)


def test_free_accelerations_hold_the_second_derivative_of_gap_and_slip_along_a_free_motion():
    """Differentiate g(q(t), t) and gamma along q(t) twice as functions of time, with q'' from Newton's law."""
    a, b = dynamicsymbols("a b")
    guide = sp.sin(2 * T)
    contact = ap.Contact(gap=b**2 + a - guide, slip=a * b + T**2, friction=f)
    push = sp.cos(T)
    L = a.diff(T) ** 2 / 2 + b.diff(T) ** 2 - b**2
    moving = ap.Mechanism.from_lagrangian(L, (a, b), contact=contact, forces=(push, 0))
    free = {a.diff(T, 2): push, b.diff(T, 2): -b}
    for found, position in zip(moving.free, (contact.gap, contact.slip), strict=True):
        assert sp.simplify(found - position.diff(T, 2).subs(free)) == 0


def test_a_slip_given_as_a_velocity_is_the_rate_of_the_slip_given_as_a_position():
    by_position, by_velocity = slender_rod(), slender_rod(slip=X.diff(T) + l * sp.sin(THETA) * THETA.diff(T))
    assert by_position.sliding_velocity == by_velocity.sliding_velocity
    assert by_position.delassus == by_velocity.delassus


def _broken(**changes):
    q, u = sp.symbols("q1:3"), sp.symbols("u1:3")
    parts = {"coordinates": q, "velocities": u, "mass": sp.eye(2), "forces": (0, -1)}
    contact = {"gap": q[1], "slip": q[0], "friction": f}
    parts.update({key: value for key, value in changes.items() if key in parts})
    contact.update({key: value for key, value in changes.items() if key not in parts})
    return ap.Mechanism(**parts, contact=ap.Contact(**contact))


q1, q2, u1, u2 = sp.symbols("q1 q2 u1 u2")


def test_the_first_coordinate_without_inertia_of_its_own_is_named_alone():
    with pytest.raises(InputError, match="q1 has no inertia of its own; give every coordinate inertia"):
        _broken(coordinates=sp.symbols("q1:4"), velocities=sp.symbols("u1:4"), forces=(0, 0, 0),
                mass=[[0, 1, 1], [1, 1, 1], [1, 1, 1]])


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"mass": [[1, 2], [2, 4]]}, "mass is singular"),
        ({"mass": [[sp.cos(q1) ** 2, sp.cos(q1)], [sp.cos(q1), 1]]}, "mass is singular"),
        ({"mass": [[1, 2], [3, 4]]}, r"mass is not symmetric: entry \(2, 1\) is 3, entry \(1, 2\) is 2"),
        ({"mass": [[1, 0, 0], [0, 1, 0]]}, "3 columns of mass for 2 coordinates"),
        ({"mass": "heavy"}, "must be a square matrix"),
        ({"gap": sp.Symbol("a")}, "gap = a does not depend on the coordinates q1, q2"),
        ({"gap": q2 + u1}, "contains a velocity"),
        ({"slip": 2 * q2}, r"slip = 2\*q2 is parallel to gap = q2"),
        ({"slip": sp.Symbol("a")}, "slip = a does not depend on the coordinates"),
        ({"slip": u1**2}, "not linear in the velocities"),
        ({"slip": "q1"}, "must be a SymPy expression"),
        ({"friction": None}, "must be a SymPy expression"),
        ({"friction": -1}, "friction must not be negative"),
        ({"friction": float("nan")}, "friction = nan: it must be finite and real"),
        ({"load": 0}, "its load must be positive"),
        ({"load": sp.oo}, "load = oo: it must be finite and real"),
        ({"load": sp.Symbol("nu", nonpositive=True)}, "its load must be positive"),
        ({"friction": 2, "static": 1}, "static = 1 is below friction = 2"),
        ({"gap": q2 + sp.I}, "it must be finite and real"),
        ({"gap": q2 > 0}, "must be an expression in symbols"),
        ({"unilateral": "yes"}, "unilateral = 'yes': it must be True or False"),
        ({"mass": [[1, sp.nan], [0, 1]]}, "mass = nan: it must be finite and real"),
        ({"mass": [[1, 0], [0, -1]]}, "mass is not positive definite"),
        ({"mass": [[1, 2], [2, 1]]}, "mass is not positive definite"),
        ({"mass": [[1 + u1**2, 0], [0, 1]]}, "mass contains a velocity"),
        ({"mass": [[1], [1, 2]]}, "its rows differ in length"),
        ({"velocities": (u1,)}, "1 velocities for 2 coordinates"),
        ({"mass": [["m", 0], [0, 1]]}, "mass = 'm': it must be a SymPy expression"),
        ({"forces": (0, sp.zoo)}, "forces = zoo: it must be finite and real"),
        ({"forces": (0,)}, "1 forces for 2 coordinates"),
        ({"coordinates": (q1, q1)}, "a name is given twice"),
        ({"coordinates": (q1, sp.Symbol("t", real=True)), "gap": sp.Symbol("t", real=True)}, "a name is given twice"),
        ({"gap": q2 + dynamicsymbols("w")}, "is no coordinate or velocity"),
        ({"coordinates": (q1,), "velocities": (u1,), "mass": [[1]], "forces": (0,), "gap": q1}, "one coordinate"),
    ],
)
def test_what_is_no_mechanism_is_refused_in_one_line(changes, match):
    with pytest.raises(InputError, match=match) as caught:
        _broken(**changes)
    assert "\n" not in str(caught.value)


def test_a_mass_matrix_without_a_value_at_the_place_of_the_check_is_taken_and_has_one_where_it_is_asked_for():
    high = sp.Piecewise((2, q1 > 1000))
    block = _broken(mass=[[high, 0], [0, 1]])
    assert block.evaluate(block.delassus[1, 1], {"q1": 2000}) == 0.5


def test_a_switch_by_a_rate_has_its_own_value_where_the_acceleration_that_leads_it_on_is_not_known():
    block = _broken()
    assert block.evaluate(sp.Piecewise((1, u1 - q1 < 0), (2, True)), {"q1": 0, "u1": 0, "u2": 0}) == 2
    assert block.evaluate(sp.Piecewise((1, -q1 < 0), (2, True)), {"q1": 0, "u1": 1, "u2": 0}) == 1


def test_a_mass_matrix_of_nine_coordinates_is_regular_if_it_is_so_at_one_place():
    angles = sp.symbols("q:9")
    mass = [[(9 - max(i, k)) * sp.cos(p - q) for k, q in enumerate(angles)] for i, p in enumerate(angles)]
    ground = ap.Contact(gap=sum(map(sp.cos, angles)), slip=sum(map(sp.sin, angles)), friction=f)
    begin = time.process_time()  # its determinant has 9! products
    ap.Mechanism(angles, sp.symbols("u:9"), mass, [0] * 9, ground)
    assert time.process_time() - begin < 5


def _kane(coordinates, speeds, **dependent):
    kinematics = [X.diff(T) - U, Y.diff(T) - V]
    return KanesMethod(ReferenceFrame("N"), q_ind=coordinates, u_ind=speeds, kd_eqs=kinematics, **dependent)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, contact=c), "coordinates are missing"),
        (lambda c: ap.Mechanism.from_lagrangian("T - V", (X, Y), contact=c), "give an expression"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, sp.symbols("X Y"), contact=c), "not a dynamicsymbol"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, (X, Y), contact=c), "mass is singular"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, (X, Y), contact=c, forces=(1,)), "1 forces for 2"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, (X, Y), contact=c, forces=(1, 2, 3)), "3 forces for 2"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, (X, Y), contact=c, forces=3), "forces = 3: give one"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, (X, Y), contact=c, forces="PQ"), "forces = 'PQ': give"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, (X, Y), contact=c, forces={THETA: 1}), "no coordinate"),
        (lambda c: ap.Mechanism.from_lagrangian(FREE, (X, Y), contact=c, forces={"X": 1}), r"'X' is .* X\(t\), Y\(t\)"),
        (lambda c: ap.Mechanism.from_lagrangian(X.diff(T) ** 2, (X, Y), contact="ground"), "must be an ap.Contact"),
        (lambda c: ap.Mechanism.from_lagrangian(FREE + X.diff(T, 2) ** 2, (X, Y), contact=c), "integrate by parts"),
        (lambda c: ap.Mechanism.from_lagrangian(FREE + X * X.diff(T, 2), (X, Y), contact=c), "first derivatives alone"),
        (lambda c: ap.Mechanism.from_lagrangian(FREE + Y * X.diff(T, 3), (X, Y), contact=c), "first derivatives alone"),
        (lambda c: ap.Mechanism.from_lagrangian(LagrangesMethod(FREE + X.diff(T, 2) ** 2, (X, Y)), contact=c), "parts"),
        (lambda c: ap.Mechanism.from_lagrangian(LagrangesMethod(FREE, (X, Y)), (X, Y), contact=c), "own coordinates"),
        (lambda c: ap.Mechanism.from_lagrangian(LagrangesMethod(FREE, (X, Y)), contact=c, forces=(1, 0)), "and forces"),
        (lambda c: ap.Mechanism.from_lagrangian(LagrangesMethod(FREE, (X, Y), hol_coneqs=[X - Y]), contact=c), "const"),
        (lambda c: ap.Mechanism.from_lagrangian(_kane((X, Y), (U, V)), contact=c), "no equations yet"),
        (lambda c: ap.Mechanism.from_lagrangian(_kane((X, Y), (U,), u_dependent=[V], velocity_constraints=[U - V]),
                                                contact=c), "dependent coordinates or speeds"),
        (lambda c: ap.Mechanism.from_lagrangian(_kane((X,), (U, V), q_dependent=[Y], configuration_constraints=[Y]),
                                                contact=c), "dependent coordinates or speeds"),
        (lambda c: ap.Mechanism.from_lagrangian(FREE + X.subs(T, T - 1), (X, Y), contact=c), r"X\(t - 1\) in the Lag"),
        (lambda c: ap.Mechanism.from_lagrangian(FREE + THETA.diff(T), (X, Y), contact=c), "no coordinate or velocity"),
        (lambda c: ap.Mechanism.from_lagrangian(FREE + sp.Abs(X.diff(T)), (X, Y), contact=c),
         r"^Abs\(Derivative\(X\(t\), t\)\) in the Lagrangian is not quadratic in the rates"),
    ],
)
def test_what_is_no_lagrangian_is_refused_in_one_line(make, match):
    with pytest.raises(InputError, match=match) as caught:
        make(ap.Contact(gap=Y, slip=X, friction=f))
    assert "\n" not in str(caught.value)


def test_a_rate_that_is_not_written_out_has_its_inertia():
    contact = ap.Contact(gap=Y, slip=X, friction=f)
    masses = (ap.Mechanism.from_lagrangian(FREE + rate**2, (X, Y), contact=contact).mass
              for rate in (sp.Derivative(sp.sin(X), T), sp.sin(X).diff(T)))
    assert _same(*masses)


@pytest.mark.parametrize(
    ("values", "error", "match"),
    [
        ({"theta": 1}, InputError, "no value for X', f, g, l, m, theta'"),
        ({"thta": 1}, UnknownName, "thta is no coordinate, rate or parameter; .* theta'; did you mean theta.$"),
        ({"z": 1}, UnknownName, "z is no coordinate, rate or parameter; .* l, m, t, theta, theta'$"),
        ({"theta": 1, THETA: 1}, InputError, "theta is given twice"),
        ((1, 2), InputError, "give a dict"),
        ({"theta": "steep", "theta'": 0, "X'": 1, "f": 1, "g": 1, "l": 1, "m": 1}, InputError, "theta = 'steep'"),
        ({"theta": [1, 2], "theta'": 0, "X'": 1, "f": 1, "g": 1, "l": 1, "m": 1}, InputError, "theta is an array"),
        ({"theta": 1, "theta'": 0, "X'": float("nan"), "f": 1, "g": 1, "l": 1, "m": 1}, InputError, "X' = nan"),
    ],
)
def test_values_that_are_missing_or_wrong_are_named(values, error, match):
    with pytest.raises(error, match=match) as caught:
        slender_rod().motions(values)
    assert "\n" not in str(caught.value)


def test_a_symbol_that_has_only_the_name_of_a_parameter_is_told_from_it():
    with pytest.raises(InputError, match="the Symbol f has other assumptions than the mechanism's"):
        slender_rod().evaluate(sp.Symbol("f"), {"f": 1})


def test_the_first_of_many_places_at_which_a_value_is_not_finite_is_told():
    at = [[k / 8, k / 4] for k in range(-16, 17)]
    assert slender_rod().evaluate(1 / THETA, {"theta": at[17:]})[0, 1] == 4
    for expr, place in ((1 / THETA, "0"), (1 / (THETA**2 - 1), "-1"), (1 / (4 * THETA + m), "-0.25")):
        with pytest.raises(OutOfRange, match=f"not finite at (m = 1, )?theta = {place}, or beside it"):
            slender_rod().evaluate(expr, {"theta": at, "m": 1})
    with pytest.raises(OutOfRange, match="not finite"):
        slender_rod().evaluate(sp.exp(1000), {})
    with pytest.raises(OutOfRange, match=r"at theta = 0, .* or G_NT, by which the critical friction divides"):
        slender_rod().evaluate(slender_rod().critical_friction, {"theta": 0})


@pytest.mark.parametrize("place", [sp.Rational(11, 10), 1.1, 1.1 + 1e-9])
def test_an_equation_and_its_opposite_do_not_both_hold(place):
    at = {"theta": [1.1, 1.2]}
    equal, other = (slender_rod().evaluate(relation(THETA, place), at).tolist() for relation in (sp.Eq, sp.Ne))
    assert (equal, other) == ([True, False], [False, True])


def test_a_mechanism_of_three_freedoms_typed_in_by_a_new_user_is_followed_through_its_paradox():
    """A ladder: a slender rod, its foot on a rough floor, by its foot (x, y) and its lean; pushed by P at its foot."""
    x, y, lean = dynamicsymbols("x y lean")
    rough, P = sp.symbols("f P", positive=True)
    centre = x + sp.sin(lean), y + sp.cos(lean)
    kinetic = (centre[0].diff(T) ** 2 + centre[1].diff(T) ** 2 + lean.diff(T) ** 2 / 3) / 2
    floor = ap.Contact(gap=y, slip=x, friction=rough, unilateral=True)
    ladder = ap.Mechanism.from_lagrangian(kinetic - centre[1], (x, y, lean), contact=floor, forces={x: P})
    assert ladder.least_critical_friction("lean").friction == sp.Rational(4, 3)
    start = {"x": 0, "y": 0, "lean": "0.46", "x'": -1, "y'": 0, "lean'": 0, "f": 2, "P": "1/10"}
    assert ladder.motions(start) == ()
    c = sp.Symbol("c", positive=True)
    system = ladder.elastic(compliance=c, damping=sp.Rational(1, 2))
    values = {"f": 2, "P": "1/10", "c": "1e-6"}
    path = ap.solve(ap.Scene(system=system, values=values, start=ladder.start(system, start), until="1e-3"))
    assert path.modes[:2] == ("slip_opposite", "stick")
    law = ladder.jump_law(damping=sp.Rational(1, 2))
    after = dict(zip(map(str, path.names), map(float, path.final), strict=True))
    assert after["lean'"] == pytest.approx(float(ladder.evaluate(law.velocities[lean.diff(T)], start)), abs=5e-3)
    assert after["x_"] == pytest.approx(float(ladder.evaluate(law.reaction, start)), abs=5e-3)


def test_a_start_at_a_constant_of_sympy_is_one_that_a_scene_takes():
    rod, c = slender_rod(), sp.Symbol("c", positive=True)
    system, values = rod.elastic(compliance=c, damping=sp.Rational(1, 2)), {"m": 1, "l": 1, "g": 1, "f": 2}
    at = {"X": 0, "Y": sp.sin(1), "theta": 1, "X'": -1, "Y'": sp.cos(1) / 3, "theta'": sp.Rational(1, 3), **values}
    scene = ap.Scene(system=system, values={**values, "c": "1e-3"}, start=rod.start(system, at), until=1)
    start = dict(zip(scene.names, scene.start, strict=True))
    assert abs(sp.Rational(start["Y"]) - sp.sin(1)) < sp.Rational(1, 10**49)
    assert start["theta'"] == Fraction(1, 3)


def test_slip_may_be_given_in_the_speeds_of_kanes_method():
    from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame

    u, v = dynamicsymbols("u v")
    frame, point = ReferenceFrame("N"), Point("P")
    point.set_vel(frame, u * frame.x + v * frame.y)
    kane = KanesMethod(frame, [X, Y], [u, v], kd_eqs=[X.diff(T) - u, Y.diff(T) - v])
    kane.kanes_equations([Particle("B", point, m)], [(point, -m * frame.y)])
    block = ap.Mechanism.from_lagrangian(kane, contact=ap.Contact(gap=Y, slip=2 * u, friction=f, unilateral=True))
    assert block.sliding_velocity == 2 * X.diff(T)


def test_a_rigid_start_off_a_constraint_that_holds_both_ways_is_refused():
    block = _broken()
    assert block.start(block.rigid(), {"q1": 0, "q2": 0, "u1": 1, "u2": 0})["u1"] == 1
    with pytest.raises(InputError, match="the start is off the constraint: g' = 1"):
        block.start(block.rigid(), {"q1": 0, "q2": 0, "u1": 1, "u2": 1})
    with pytest.raises(InputError, match="the start is off the constraint: g = 1"):
        block.start(block.rigid(), {"q1": 0, "q2": 1, "u1": 1, "u2": 0})


@pytest.mark.parametrize("name", ["X", "theta", "theta'"])
def test_a_start_at_a_constant_that_takes_long_to_work_out_is_refused_at_once(name):
    numbers = {"X": 0, "Y": 0, "theta": 1, "X'": 0, "Y'": 0, "theta'": 0, name: sp.sin(sp.exp(sp.exp(sp.exp(100))))}
    rod = slender_rod()
    with pytest.raises(InputError, match="a number in it is beyond the range of doubles"):
        rod.start(rod.rigid(), numbers)


TOWER, LONG = sp.sin(sp.exp(sp.exp(sp.exp(100)))), sp.Pow(2, 10**9, evaluate=False)


@pytest.mark.parametrize("derive", [
    lambda: ap.Contact(gap=Y, slip=X, friction=TOWER),
    lambda: ap.Contact(gap=Y, slip=X, friction=LONG),
    lambda: ap.Contact(gap=Y, slip=X + TOWER, friction=f),
    lambda: slender_rod().elastic(compliance=sp.Symbol("c"), damping=1 / TOWER),
    lambda: slender_rod().elastic(compliance=sp.Symbol("c"), damping=LONG),
    lambda: slender_rod().jump_law(damping=TOWER),
    lambda: ap.System.smooth({l: TOWER * l}, {}, sp.Symbol("mu")),
    lambda: ap.slow_manifold(ap.System.smooth({l: -l}, {g: l - g}, sp.Symbol("mu")), branch={g: TOWER}),
    lambda: ap.slow_manifold(ap.System.smooth({l: -l}, {g: l - g}, sp.Symbol("mu")), branch={g: LONG}),
    lambda: ap.Contact(gap=Y, slip=X, friction=sp.Pow(sp.pi, 10**9, evaluate=False)),
    lambda: ap.Contact(gap=Y, slip=X, friction=sp.exp(10**8)),
    lambda: ap.System.smooth({l: sp.factorial(10**8, evaluate=False) * l}, {}, sp.Symbol("mu")),
])
def test_a_constant_in_a_formula_that_takes_long_to_work_out_is_refused_at_once(derive):
    with pytest.raises(InputError, match=r"its constant = .*: a number in it (is beyond|has very many digits)"):
        derive()


def test_a_start_of_the_system_of_another_mechanism_is_refused():
    with pytest.raises(InputError, match=r"q1 is no state of .*; give the mechanism's elastic\(\) or rigid\(\)"):
        _broken().start(ap.systems.painleve_klein.system(), {"q1": 0, "q2": 0, "u1": 1, "u2": 0})


@pytest.mark.parametrize("changes", [{"theta": [1, 2]}, {"m": [1, 2]}, {"theta": (1,)}])
def test_a_start_at_several_numbers_is_refused(changes):
    rod, values = slender_rod(), {"m": 1, "l": 1, "g": 1, "f": 2}
    at = {"X": 0, "Y": 1, "theta": 1, "X'": -1, "Y'": 0, "theta'": 0, **values, **changes}
    for system in (rod.rigid(), rod.elastic(compliance=sp.Symbol("eps", positive=True) ** 2, damping=0)):
        with pytest.raises(InputError, match=f"{min(changes)} = .*: it must be a number"):
            rod.start(system, at)


def test_a_determinant_of_polynomials_in_sines_is_that_of_the_symbols_written_out():
    a, b, c = sp.symbols("a b c", positive=True)
    border = sp.Matrix([[a + sp.sin(b) ** 2, sp.cos(b) / a, sp.sqrt(c)],
                        [sp.cos(b) / a, 1 / (a + c), sp.exp(b) * sp.sin(2 * a)],
                        [sp.sqrt(c), sp.exp(b) * sp.sin(2 * a), 0]])
    assert sp.simplify(expanded_determinant(border) - border.det()) == 0


def test_cofactors_over_the_determinant_invert_a_matrix_with_zeros():
    a, b, c = sp.symbols("a b c")
    matrix = sp.Matrix([[a, b, 0, 1], [2, c, a, 0], [0, 1, b, c], [a + b, 0, 3, 1]])
    adjugate, determinant = cofactors(matrix)
    assert (adjugate * matrix - determinant * sp.eye(4)).applyfunc(sp.expand) == sp.zeros(4)


@pytest.mark.slow
def test_the_delassus_matrix_of_a_chain_of_four_links_is_that_of_its_mass_matrix_in_numbers():
    chain = _chain(4)
    parts = (chain.plain.mass, chain.plain.directions, chain.plain.delassus, chain.plain.determinant)
    numbers = sp.lambdify(chain.plain.coordinates, parts, "mpmath", cse=True)
    with mpmath.workdps(30):
        mass, directions, found, determinant = numbers(*(mpmath.mpf(k) / 5 for k in range(1, 5)))
        expected = directions * mass**-1 * directions.T
        assert mpmath.norm(found - expected, mpmath.inf) < 1e-20
        assert abs(determinant - mpmath.det(expected)) < 1e-20


@pytest.mark.slow
def test_the_response_of_a_chain_of_five_links_is_not_written_out():
    assert max(part.count_ops() for part in _chain(5).plain.response) < 10_000


def test_the_critical_friction_of_a_chain_of_four_links_is_that_of_its_delassus_matrix_in_numbers():
    chain = _chain(4)
    at = {f"q{k}": k / 5 + 0.2 for k in range(4)}
    critical, normal, mixed = (chain.evaluate(e, at) for e in (chain.critical_friction, *chain.delassus[0, :]))
    assert critical == pytest.approx(normal / abs(mixed), rel=1e-12)


def test_the_modes_of_an_elastic_chain_of_three_links_are_written_without_its_products():
    c = sp.Symbol("c", positive=True)
    system = _chain(3).elastic(compliance=c, damping=1)
    friction = system.friction
    (bound,) = (e for e in system.mode("stick").where.args if isinstance(e, sp.LessThan))
    at = {s: k / 7 + 0.4 for k, s in enumerate((*system.states, friction.force, c))}
    rate, drive, coupling, load, room = evaluate(
        (system.rates[friction.velocity], system.drive, system.coupling, friction.load, bound.gts - bound.lts), at
    )
    assert rate == pytest.approx(drive + coupling * at[friction.force], rel=1e-9)
    assert room == pytest.approx(abs(coupling * load) - abs(drive), rel=1e-9)


def _chain(links):
    angles, t = dynamicsymbols(f"q:{links}"), dynamicsymbols._t
    place, energy = sp.zeros(2, 1), 0
    for q in angles:
        link = sp.Matrix([sp.sin(q), -sp.cos(q)])
        middle, place = place + link / 2, place + link
        energy += (middle.diff(t).dot(middle.diff(t)) + q.diff(t) ** 2 / 12) / 2
    return ap.Mechanism.from_lagrangian(energy, angles, contact=ap.Contact(gap=place[1], slip=place[0], friction=1))


@pytest.mark.parametrize("declared", ["real", "positive"])
def test_a_symbol_of_the_name_of_the_time_that_is_another_one_is_refused(declared):
    """A force sin(t) of a real t stood still at a value of a parameter t."""
    t, (u, v, U, V) = sp.Symbol("t", **{declared: True}), sp.symbols("u v U V")
    ground = ap.Contact(v, u, sp.Rational(1, 10), unilateral=True)
    with pytest.raises(InputError, match="t in the formulas is not the time t but another symbol of its name"):
        ap.Mechanism((u, v), (U, V), sp.eye(2), (sp.sin(t), -1), ground)
    assert ap.Mechanism((u, v), (U, V), sp.eye(2), (sp.sin(t), -1), ground, time=t).rigid().time == t
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y
    with pytest.raises(InputError, match="write the time as"):
        ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ap.Contact(Y, X, 1), forces={X: sp.sin(t)})


def test_a_symbol_of_the_name_of_a_coordinate_or_rate_that_is_another_one_is_refused():
    """A gap that falls with the Symbol X, beside a coordinate X(t), was one with a parameter X and no paradox."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y
    for gap in (Y + sp.Symbol("X") / 3, Y + sp.Symbol("X'") * X):
        with pytest.raises(InputError, match=r"in the formulas is not the X'? of the coordinates and velocities"):
            ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ap.Contact(gap, X, 1))


@pytest.mark.parametrize("past", [sp.Integral(X, T), sp.Integral(X, (T, 0, T)), sp.Subs(X.diff(T), T, 0)])
def test_the_past_of_a_coordinate_is_refused_as_it_is_no_function_of_the_state(past):
    """An integral over the time was taken as that of a constant, and a rate at the time 0 as that of now."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y
    with pytest.raises(InputError, match="is no coordinate or velocity; list it"):
        ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ap.Contact(Y - past, X, 1))
    with pytest.raises(InputError, match="is no coordinate or velocity; list it"):
        ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ap.Contact(Y, X, 1), forces={X: -past})
