"""A contact beside others that hold both ways: joints, and rough guides whose loads may have either sign."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from mechanisms import chain, energy_of_chain
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.errors import NotDerivable
from asympk.mechanics.evaluation import evaluate

T = dynamicsymbols._t
X, Y, THETA = dynamicsymbols("X Y theta")
m, l, J = sp.symbols("m l J", positive=True)
f, f2 = sp.symbols("f f2", positive=True)


def _ellipsograph(friction, unilateral=False):
    """Return a rod of the length 2 l whose lower end slides on the x axis, the upper one on the y axis."""
    energy = m * (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + J * THETA.diff(T) ** 2 / 2 - 10 * m * Y
    lower = ap.Contact(Y - l * sp.sin(THETA), X - l * sp.cos(THETA), f, unilateral=unilateral)
    upper = ap.Contact(X + l * sp.cos(THETA), Y + l * sp.sin(THETA), friction)
    return ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=lower, others=[upper])


@pytest.mark.slow
def test_an_ellipsograph_has_the_critical_friction_of_the_determinant_of_both_reactions():
    """With k = m l^2/J the determinant is 1 + k + k (p + q) sin(2 theta) + (k - 1) p q, where p = +-f and q = +-f2."""
    k, turn = m * l**2 / J, sp.sin(2 * THETA)
    for mechanism in (_ellipsograph(f2), _ellipsograph(f2, unilateral=True)):
        critical = sp.Min(*((1 + k + k * q * turn) / sp.Abs(k * turn + (k - 1) * q) for q in (f2, -f2)))
        for place in ({m: 2, l: 3, J: 5, f2: sp.Rational(1, 5), THETA: 1}, {m: 1, l: 1, J: 4, f2: 1, THETA: -1}):
            assert float(mechanism.critical_friction.subs(place)) == pytest.approx(float(critical.subs(place)))
            for friction in (0.99, 1.01):
                above = mechanism.evaluate(mechanism.paradox, place | {f: friction * float(critical.subs(place))})
                assert above == (friction > 1)


def test_a_uniform_ellipsograph_with_one_smooth_guide_has_the_least_critical_friction_of_painleves_rod():
    smooth = _ellipsograph(0)
    assert sp.simplify(smooth.critical_friction - (J + m * l**2) / (m * l**2 * sp.Abs(sp.sin(2 * THETA)))) == 0
    least = smooth.least_critical_friction(THETA, {"m": 1, "l": 1, "J": "1/3"})
    assert (least.friction, least.where) == (sp.Rational(4, 3), sp.Eq(sp.tan(THETA), 1))


def test_the_least_critical_friction_beside_a_rough_guide_is_that_for_the_worse_sign_of_its_load():
    """At theta = pi/4 the uniform rod has (4 - 3 f2)/(3 - 2 f2), which is 37/28 for f2 = 1/10; at f2 = 4/3 none."""
    numbers = {"m": 1, "l": 1, "J": "1/3"}
    for unilateral in (False, True):
        least = _ellipsograph(f2, unilateral).least_critical_friction(THETA, numbers | {"f2": "1/10"})
        assert (least.friction, abs(least.where.rhs)) == (sp.Rational(37, 28), 1)
    for given, said in (({}, "give numbers for all"), ({"f2": 2}, "if they have, there is no least critical friction")):
        with pytest.raises(NotDerivable, match=said):
            _ellipsograph(f2).least_critical_friction(THETA, numbers | given)


def test_two_guides_of_one_friction_have_their_paradox_between_the_roots_of_the_determinant():
    """The uniform rod has 4 - 6 f sin(2 theta) + 2 f^2 < 0 between 1.05 and 1.91, and 4 - 2 f^2 < 0 from sqrt(2) on."""
    found = _ellipsograph(f).paradox_set({"f": (0, 3)}, {"m": 1, "l": 1, "J": "1/3", "theta": "0.7"})
    first = (3 * math.sin(1.4) - math.sqrt(9 * math.sin(1.4) ** 2 - 8)) / 2
    assert found.complete
    assert found.edges == pytest.approx([first], rel=1e-12)
    angles = _ellipsograph(f).paradox_set({"theta": (0, "1.57")}, {"m": 1, "l": 1, "J": "1/3", "f": "1.1"})
    assert np.sin(2 * np.array(angles.edges)) == pytest.approx([(2 + 1.1**2) / 3.3] * 2, rel=1e-12)


def _random(seed, size, unilateral=0):
    """Return a mechanism of contacts with random couplings G, random friction, and the free accelerations a.

    The first ``unilateral`` contacts only push.
    """
    rng = np.random.default_rng(seed)
    q, u, a = (sp.symbols(f"{name}:{2 * size}", real=True) for name in "qua")
    root = rng.integers(-4, 5, (2 * size, 2 * size))
    G, bounds = root.T @ root + np.eye(2 * size, dtype=int), [sp.Rational(int(k), 8) for k in rng.integers(1, 9, size)]
    own = sp.Symbol("f", nonnegative=True)
    contacts = [ap.Contact(q[k], u[size + k], bounds[k] if k else own, unilateral=k < unilateral) for k in range(size)]
    yields = sp.Matrix(G).inv()
    return ap.Mechanism(q, u, yields, yields * sp.Matrix(a), contacts[0], others=contacts[1:]), G, bounds, rng


def _counts(G, bounds, sliding, free, unilateral):
    """Return by rows how many reactions solve 0 = a_N + G_NN R - G_NT diag(s f) |R|, or open unilateral contacts."""
    size, found = len(bounds), 0
    for signs in itertools.product((1, -1), repeat=size):
        A = G[:size, :size] - G[:size, size:] * (bounds * sliding * signs)[:, None, :]
        for k in (k for k in range(unilateral) if signs[k] < 0):
            A[:, :, k] = np.eye(size)[k]  # and -R is the acceleration of the gap
        reactions = np.linalg.solve(A, -free[:, :size, None])[..., 0]
        found = found + np.all(np.sign(reactions) == signs, axis=1)
    return found


@pytest.mark.parametrize("unilateral", [False, True])
@pytest.mark.parametrize(("size", "seed"), [(size, seed) for size in (2, 3) for seed in range(40)])
@pytest.mark.few(1)
def test_above_the_critical_friction_beside_rough_contacts_some_forces_leave_no_motion_or_several(
    size, seed, unilateral
):
    """Below it each has one, as ``motions`` finds, too, which tries all modes."""
    mechanism, G, bounds, rng = _random(seed, size, unilateral)
    critical = float(mechanism.critical_friction)
    for friction in [0.95 * critical] * (critical > 0) + [1.05 * max(critical, 0.1)]:
        each = np.array([friction, *map(float, bounds[1:])])
        sliding, free = rng.choice((-1, 1), (4000, size)), rng.normal(size=(4000, 2 * size))
        counts = _counts(G, each, sliding, free, unilateral)
        assert ({*counts} == {1}) == (friction < critical)
        for at in {0, int(np.argmax(counts != 1))}:
            start = dict.fromkeys((*mechanism.coordinates, *mechanism.velocities), 0)
            start |= dict(zip(mechanism.velocities[size:], sliding[at], strict=True)) | {"f": friction}
            start |= {f"a{place}": value for place, value in enumerate(free[at])}
            assert len(mechanism.motions(start)) == counts[at]


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.few(1)
def test_closed_contacts_have_a_paradox_where_some_forces_leave_no_motion_or_several(seed):
    """Two or three contacts slide, of which one or more only push; each has friction up to 4."""
    size = 2 + seed % 2
    mechanism, G, _, rng = _random(seed, size, 1 + seed % size)
    unilateral, frictions = 1 + seed % size, rng.integers(1, 33, size) / 8
    others = (replace(other, friction=sp.Rational(float(part)), static=sp.Rational(float(part)))
              for other, part in zip(mechanism.others, frictions[1:], strict=True))
    mechanism = replace(mechanism, others=(*others,))
    sliding = np.tile(rng.choice((-1, 1), size), (20000, 1))
    free = rng.normal(size=(20000, 2 * size))
    counts = _counts(G, frictions, sliding, free, unilateral)
    start = dict.fromkeys((*mechanism.coordinates, *mechanism.velocities), 0) | {"f": frictions[0]}
    start |= dict(zip(mechanism.velocities[size:], sliding[0], strict=True))
    at = {f"a{place}": value for place, value in enumerate(free[np.argmax(counts != 1)])}
    assert mechanism.has_paradox(start | at) == (counts != 1).any()
    assert len(mechanism.motions(start | at)) == counts[np.argmax(counts != 1)]


def _jumped(c, start, friction, h=0.5):
    """Return rates and impulses of the reactions after the layer of both elastic guides, the upper one smooth."""
    weight, inertia = np.array([0, -10, 0]), np.array([1, 1, 3])  # M^-1 of the uniform rod with m = l = 1

    def rates(w, sticks):
        (sine, cosine), u = (np.sin(w[2]), np.cos(w[2])), w[3:6]
        N, side = np.array([[0, 1, -cosine], [1, 0, -sine]]), np.array([1, 0, sine])
        gaps = np.array([w[1] - sine, w[0] + cosine])
        pushes = -(gaps + h * N @ u) / c
        pushes[0] = max(pushes[0], 0)
        free, bend = weight + inertia * (N.T @ pushes), cosine * u[2] ** 2
        force = -(side @ free + bend) / (side @ (inertia * side)) if sticks else friction * pushes[0]
        return np.array([*u, *(free + inertia * side * force), *pushes])

    stop = lambda t, w: w[3] + np.sin(w[2]) * w[5]  # noqa: E731
    stop.terminal = True
    options = {"method": "Radau", "rtol": 1e-9, "atol": 1e-12}
    slip = solve_ivp(lambda t, w: rates(w, False), (0, 1), [*start, 0, 0], events=stop, **options)
    stick = solve_ivp(lambda t, w: rates(w, True), (0, 40 * c), slip.y[:, -1], **options)
    return stick.y[3:, -1]


@pytest.mark.slow
def test_the_impulse_of_a_joint_in_the_jump_is_that_of_two_elastic_contacts():
    """The rod on ground that only pushes moves into its paradox; Radau follows both elastic contacts by themselves."""
    rod, friction, angle = _ellipsograph(0, unilateral=True), 2, 0.7
    start = {"X": -math.cos(angle), "Y": math.sin(angle), "theta": angle,
             "X'": -math.sin(angle), "Y'": -math.cos(angle), "theta'": -1}
    numbers = start | {"m": 1, "l": 1, "J": "1/3", "f": friction}
    law = rod.jump_law()
    assert rod.evaluate(rod.paradox, numbers)
    assert rod.motion_map(numbers | {"theta": [angle]}).count_of("slip").tolist() == [0]
    parts = (*(law.velocities[u] for u in rod.velocities), law.impulses[0], *law.joints)
    expected = [rod.evaluate(part, numbers) for part in parts]
    near, nearer = (np.abs(_jumped(c, [*start.values()], friction) - expected).max() for c in (1e-5, 1e-6))
    assert 6 < near / nearer < 12
    assert nearer < 1e-3


def _crank(jointed):
    """Return a crank and its slider in a rough guide, with two joints at the end of the crank or in its two angles."""
    angle, length = dynamicsymbols("alpha"), sp.Rational(3, 5)
    end = sp.cos(angle) / 2, sp.sin(angle) / 2
    arm = length / 2 * sp.cos(THETA), length / 2 * sp.sin(THETA)
    x, y = (X, Y) if jointed else (end[0] + arm[0], end[1] + arm[1])
    energy = (angle.diff(T) ** 2 / 10 + x.diff(T) ** 2 + y.diff(T) ** 2 + length**2 * THETA.diff(T) ** 2 / 12) / 2
    gaps = X - arm[0] - end[0], Y - arm[1] - end[1]
    joints = [ap.Contact(gaps[0], gaps[1], 0), ap.Contact(gaps[1], gaps[0], 0)]
    return ap.Mechanism.from_lagrangian(
        energy, (angle, X, Y, THETA) if jointed else (angle, THETA), contact=ap.Contact(y + arm[1], x + arm[0], f),
        others=joints if jointed else (), forces={angle: sp.Rational(1, 2)})


@pytest.mark.further
def test_a_contact_with_joints_held_is_that_in_coordinates_which_hold_them():
    jointed, placed = _crank(True), _crank(False)
    assert jointed.critical_friction == placed.critical_friction
    angles = {"alpha": "2.7", "theta": "-0.37", "alpha'": 1, "theta'": 2}
    rates = {"X'": -math.sin(2.7) / 2 + 0.6 * math.sin(0.37), "Y'": math.cos(2.7) / 2 + 0.6 * math.cos(0.37)}
    parts = [(*rod.delassus, *rod.free, rod.jump_law().velocities[THETA.diff(T)], *rod.jump_law().impulses)
             for rod in (jointed, placed)]
    for own, same in zip(*parts, strict=True):
        assert jointed.evaluate(own, angles | rates) == pytest.approx(placed.evaluate(same, angles), rel=1e-12)
    grid = angles | {"f": np.linspace(0, 3, 50)}
    assert np.array_equal(jointed.motion_map(grid | rates).count, placed.motion_map(grid).count)


@pytest.mark.slow
def test_a_contact_rebounds_as_in_coordinates_that_hold_its_joints_and_less_beside_elastic_ones():
    """Without damping an elastic joint rings on with a part of the energy."""
    eps, half, side = sp.Symbol("eps", positive=True), sp.sqrt(2) / 2, -sp.cos(THETA)
    start, given = {"Y": half, "theta": sp.pi / 4, "Y'": -half, "theta'": -1}, {"X": -half, "X'": -half}
    lower = ap.Contact(Y - sp.sin(THETA), X - sp.cos(THETA), 2, unilateral=True)
    kinetic = lambda x: (x.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + THETA.diff(T) ** 2 / 6 - 10 * Y  # noqa: E731
    joint = ap.Contact(X - side, Y + sp.sin(THETA), 0)
    jointed = ap.Mechanism.from_lagrangian(kinetic(X), (X, Y, THETA), contact=lower, others=[joint])
    placed = ap.Mechanism.from_lagrangian(
        kinetic(side), (Y, THETA), contact=replace(lower, slip=lower.slip.subs(X, side)))
    rates = []
    for rod, numbers in ((jointed, start | given), (placed, start)):
        system = rod.elastic(eps**2, 0)
        scene = ap.Scene(system=system, values={"eps": "1e-4"}, start=rod.start(system, numbers), until="2e-3")
        opened = next(event for event in ap.solve(scene).events if event.kind == "lift_off")
        rates.append(-1e-4 * float(opened.state[scene.names.index("y")]))
        assert rod.evaluate(rod.jump_law(ratio=0).gap_rate, numbers) == pytest.approx(math.sqrt(2) / 3)
    assert rates == pytest.approx([0.134, math.sqrt(2) / 3], rel=0.02)


def test_the_impulses_of_joints_and_contact_change_the_momentum_of_the_rod():
    """The crank takes what the joints do not: M dq' = W' P for all four coordinates."""
    crank, place = _crank(True), {"alpha": "2.7", "theta": "-0.37", "alpha'": 1, "theta'": 2, "X'": 1, "Y'": "1/2"}
    law, given = crank.jump_law(), crank.keyed(place)
    gains = [crank.evaluate(law.velocities[u] - u, place) for u in crank.velocities]
    joints = (joint.directions[0, :] for joint in crank.equations[1:])
    rows = sp.Matrix.vstack(crank.plain.directions, *joints).subs(given)
    pushed = np.array(rows.T, float) @ [crank.evaluate(part, place) for part in (*law.impulses, *law.joints)]
    assert np.array(crank.plain.mass.subs(given), float) @ gains == pytest.approx(pushed, rel=1e-12)
    assert np.array(rows, float)[[0, 2, 3]] @ gains == pytest.approx([0, 0, 0], abs=1e-12)


def test_two_masses_joined_by_a_rod_have_the_critical_friction_of_painleve_and_klein():
    """With the smooth guide f tan(alpha) = 1 + m/M; the friction f2 of the other guide takes from it or adds to it."""
    x2, y2 = dynamicsymbols("x2 y2")
    M, height = sp.symbols("M H", positive=True)
    energy = (m * (X.diff(T) ** 2 + Y.diff(T) ** 2) + M * (x2.diff(T) ** 2 + y2.diff(T) ** 2)) / 2
    rod = sp.sqrt((x2 - X) ** 2 + (y2 - Y) ** 2) - l
    turning = (y2 - Y) * (x2 - X).diff(T) - (x2 - X) * (y2 - Y).diff(T)
    for friction in (0, f2):
        others = [ap.Contact(y2 - height, x2, friction), ap.Contact(rod, turning, 0)]
        masses = ap.Mechanism.from_lagrangian(energy, (X, Y, x2, y2), contact=ap.Contact(Y, X, f), others=others)
        expected = sp.Min(*((M + m) / M / 3 + sign * m * friction / M for sign in (1, -1)))
        place = {X: 0, Y: 0, x2: 1, y2: 3}
        for numbers in ({m: 2, M: 5, f2: sp.Rational(1, 10)}, {m: 1, M: 1, f2: sp.Rational(1, 3)}):
            found = masses.critical_friction.subs(place | numbers)
            assert sp.simplify(found - expected.subs(numbers)) == 0


def test_others_that_leave_the_contact_no_motion_or_are_too_many_are_refused():
    twice, guides = [ap.Contact(X, Y, 0)] * 2, [ap.Contact(X + k * Y, THETA + k * X, f2) for k in range(1, 6)]
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2 + THETA.diff(T) ** 2) / 2
    for others, said in ((twice, "leave gap and slip no motions"), (guides, "5 of the others .* at most 4 may"),
                         (guides[:2], "leave gap and slip no motions")):
        held = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=ap.Contact(Y, THETA, f), others=others)
        with pytest.raises(NotDerivable, match=said):
            held.critical_friction  # noqa: B018


@pytest.mark.parametrize("unilateral", [False, True])
def test_a_rough_other_with_a_singular_matrix_of_reactions_leaves_a_paradox_at_any_friction(unilateral):
    """With s = 1 the determinant is 1 (2 - 1) - 1 = 0, and D_1 = 1: f > 0 makes it negative."""
    G = sp.Matrix([[1, 1, 1, 0], [1, 2, 0, 1], [1, 0, 5, 0], [0, 1, 0, 5]])  # of N, N2, T, T2
    q, u = (sp.symbols(f"{name}:4", real=True) for name in "qu")
    contacts = [ap.Contact(q[0], u[2], f, unilateral=unilateral), ap.Contact(q[1], u[3], 1)]
    held = ap.Mechanism(q, u, G.inv(), sp.zeros(4, 1), contacts[0], others=contacts[1:])
    assert held.critical_friction == 0
    assert held.paradox == sp.true


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0, f2])
def test_a_chain_too_long_for_symbols_has_what_linear_algebra_in_numbers_says_with_a_moving_contact_held(friction):
    angles = dynamicsymbols("q1:6")
    x, y = energy_of_chain(angles[:3])[1]
    side = ap.Contact(x + 2 * y - sp.sin(T), y - 2 * x, friction)
    links = replace(chain(5), others=(side,))
    first, other = links.equations
    values = dict(zip(sorted({*first.symbols, *other.symbols}, key=str), np.linspace(0.2, 1, 40), strict=False))
    read = lambda rows: np.array(evaluate(tuple(sp.Matrix(rows)), values)).reshape(np.shape(rows))  # noqa: E731
    weights, pulls = np.linalg.inv(read(first.mass)), read(first.forces)[:, 0]
    own, held = read(first.directions), read(other.directions)
    rates = read([[first.rate(part)] for part in (first.gap_rate, first.slip, other.gap_rate)])[:, 0]
    by_name = {str(symbol): value for symbol, value in values.items()}
    if friction == 0:
        block = held[:1] @ weights @ held[:1].T
        taken = weights @ held[:1].T / block
        assert np.allclose(read(links.held.delassus), own @ (weights - taken @ held[:1] @ weights) @ own.T, rtol=1e-9)
        pulled = weights @ pulls - taken[:, 0] * (held[0] @ weights @ pulls + rates[2])
        assert evaluate(links.held.free, values) == pytest.approx(own @ pulled + rates[:2], rel=1e-9)
        law, rows = links.jump_law(), np.vstack([own, held[:1]])
        stop = np.linalg.solve(rows @ weights @ rows.T, [0, -evaluate((first.slip,), values)[0], 0])
        assert [links.evaluate(part, by_name) for part in (*law.impulses, *law.joints)] == pytest.approx(stop, rel=1e-9)
    else:
        pressed = [np.vstack([own[:1], held[:1] - sign * values[f2] * held[1:]]) for sign in (1, -1)]
        across = [np.vstack([own[:1], held[:1]]) @ weights @ rows.T for rows in pressed]
        slid = [np.column_stack([np.vstack([own[:1], held[:1]]) @ weights @ own[1], part[:, 1]]) for part in across]
        critical = min(np.linalg.det(part) / abs(np.linalg.det(side)) for part, side in zip(across, slid, strict=True))
        assert links.evaluate(links.critical_friction, by_name) == pytest.approx(critical, rel=1e-9)
