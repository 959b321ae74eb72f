"""Mechanisms of many coordinates, whose mass matrix is not inverted in symbols, beside Newton's law in numbers."""

import numpy as np
import pytest
import sympy as sp
from mechanisms import CORNER, chain, crank_with_clearance, energy_of_chain, f, spatial_body, turned
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.affine.run import obstacle
from asympk.asymptotics.fibre import Formulas
from asympk.errors import InputError
from asympk.mechanics.evaluation import evaluate
from asympk.mechanics.jump_law import rebound
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import LONG, has_no_inverse

VALUES = {"m": 1, "l": 1, "g": 1, "J": 0.1, "f": 0.3}


def _equations(q, u):
    """Return M, Q, the rows W and the drifts of g'' and gamma' of the chain, by the positions of its links."""
    n = len(q)
    reach = np.tril(np.ones((n, n)), -1) + np.eye(n) / 2  # of the middle of link k along link j
    pairs = reach.T @ reach
    apart = q[:, None] - q
    mass = pairs * np.cos(apart) + VALUES["J"] * np.eye(n)
    forces = -(pairs * np.sin(apart)) @ u**2 - reach.sum(0) * np.sin(q)
    return mass, forces, np.array([np.sin(q), np.cos(q)]), np.array([np.cos(q) @ u**2, -np.sin(q) @ u**2])


def _accelerations(q, u, sign, rubbing=0):
    """Return q'' of the chain that slides with a sliding velocity of the sign ``sign``, and its reaction."""
    mass, forces, W, drifts = _equations(q, u)
    forces = forces - rubbing
    pushed = W[0] - sign * VALUES["f"] * W[1]
    reaction = -(W[0] @ np.linalg.solve(mass, forces) + drifts[0]) / (W[0] @ np.linalg.solve(mass, pushed))
    return np.linalg.solve(mass, forces + pushed * reaction), reaction


def _start(n):
    """Return angles and rates of a chain whose end touches the ground and slides along it."""
    q, u = 0.3 + 0.05 * np.arange(1, n + 1), np.full(n, 0.1)
    u[-1] = -np.sin(q[:-1]) @ u[:-1] / np.sin(q[-1])
    return q, u


@pytest.mark.further
def test_a_joint_of_a_chain_may_have_a_friction_of_its_own_beside_that_of_the_end():
    n, torque, angles = 4, sp.Symbol("torque", real=True), dynamicsymbols("q1:5")
    energy, (x, y) = energy_of_chain(angles)
    ground = ap.Contact(gap=y + sp.Symbol("H", positive=True), slip=x, friction=f, unilateral=True)
    mechanism = ap.Mechanism.from_lagrangian(energy, angles, contact=ground, forces={angles[0]: torque})
    rigid = mechanism.rigid()
    rubbed = ap.Friction(velocity=sp.Symbol("q1'", real=True), force=torque, load=1, kinetic=sp.Rational(1, 20))
    system = ap.System.with_frictions(rigid.slow, {}, (*rigid.frictions, rubbed))
    q, u = _start(n)
    values = {**VALUES, "H": float(np.cos(q).sum())}
    given = {f"q{k}": a for k, a in enumerate(q, 1)} | {f"q{k}'": v for k, v in enumerate(u, 1)}
    start = mechanism.start(rigid, {**given, **values, "torque": 0})
    named = {s.name: values[s.name] for s in system.parameters}
    path = ap.solve(ap.Scene(system=system, values=named, start=start, until=0.2))
    rubbing = np.eye(n)[0] / 20
    rate = lambda t, w: np.concatenate([w[n:], _accelerations(w[:n], w[n:], 1, rubbing)[0]])  # noqa: E731
    expected = solve_ivp(rate, (0, 0.2), [*q, *u], "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert path.modes == ("slip_same+slip_same",)
    assert np.allclose(path.final, expected, rtol=0, atol=1e-9)


def _scene(n, until):
    q, u = _start(n)
    mechanism = chain(n)
    values = {**VALUES, "H": float(np.cos(q).sum())}
    given = {f"q{k}": a for k, a in enumerate(q, 1)} | {f"q{k}'": v for k, v in enumerate(u, 1)}
    system = mechanism.rigid()
    start = mechanism.start(system, {**given, **values})
    named = {s.name: values[s.name] for s in system.parameters}
    return ap.Scene(system=system, values=named, start=start, until=until)


def _followed(n, until):
    """Return the angles and rates of the chain at the end, followed mode by mode with the events of SciPy."""
    q, u = _start(n)
    state, t, sign = np.concatenate([q, u]), 0.0, np.sign(np.cos(q) @ u)
    stops = lambda t, w: np.cos(w[:n]) @ w[n:]  # noqa: E731
    while t < until:
        stops.terminal, stops.direction = True, -sign
        rate = lambda t, w, sign=sign: np.concatenate([w[n:], _accelerations(w[:n], w[n:], sign)[0]])  # noqa: E731
        found = solve_ivp(rate, (t, until), state, "DOP853", rtol=1e-12, atol=1e-13, events=stops)
        t, state, sign = found.t[-1], found.y[:, -1], -sign
    return state


def test_a_scene_of_a_mechanism_whose_mass_matrix_is_not_inverted_in_symbols_has_numbers():
    scene = _scene(4, 0.01)
    assert any(rate.has(InverseForm) for rate in scene.system.rates.values())


@pytest.mark.further
def test_a_chain_of_six_links_slides_and_turns_back_as_by_newtons_law_in_numbers():
    path = ap.solve(_scene(6, 0.5))
    assert path.modes == ("slip_same", "slip_opposite")
    assert np.allclose(path.final, _followed(6, 0.5), rtol=0, atol=1e-9)


def test_a_mass_matrix_of_twelve_coordinates_is_singular_where_many_digits_leave_nothing_of_it_in_any_units():
    a, b = sp.symbols("a b", positive=True)
    moved = sp.Matrix([sp.sin(a), b * sp.cos(a), *(sp.exp(-k * b) for k in range(10))])
    light = sp.diag(1, *[sp.Rational(1, 10**15)] * 11)
    assert has_no_inverse((light * moved * moved.T * light).as_immutable())
    assert not has_no_inverse((light * moved * moved.T * light + light**3).as_immutable())
    assert not has_no_inverse((moved * moved.T + light).as_immutable())


@pytest.mark.further
def test_a_coordinate_that_only_adds_to_another_makes_the_mass_of_ten_links_singular():
    (*angles, last), moved = dynamicsymbols("q1:11"), dynamicsymbols("s")
    ground = ap.Contact(gap=angles[0], slip=angles[1], friction=1)
    with pytest.raises(InputError, match="mass is singular"):
        ap.Mechanism.from_lagrangian(energy_of_chain((*angles, last + moved))[0], (*angles, last, moved),
                                     contact=ground)


@pytest.mark.further
def test_the_motions_of_a_chain_of_eight_links_have_the_reactions_of_newtons_law():
    n = 8
    q, u = _start(n)
    values = {**VALUES, **{f"q{k}": a for k, a in enumerate(q, 1)}, **{f"q{k}'": v for k, v in enumerate(u, 1)}}
    (motion,) = chain(n).motions(values)
    assert motion.name == "slip"
    assert motion.reaction == pytest.approx(_accelerations(q, u, np.sign(np.cos(q) @ u))[1], rel=1e-12)


@pytest.mark.slow
def test_an_impact_on_a_chain_of_eight_links_changes_gap_rate_and_slip_by_what_it_is_to():
    n = 8
    kinetics, (q, u) = chain(n).plain, _start(n)
    mass, _, W, _ = _equations(q, u)
    values = {**VALUES, **{f"q{k}": a for k, a in enumerate(q, 1)}}
    at = {s: values[s.name] for s in (*kinetics.parameters, *kinetics.coordinates) if s.name in values}
    found = np.reshape(evaluate((*kinetics.gap_impact, *kinetics.slip_impact), at), (2, n + 2))
    impulses = np.linalg.inv(W @ np.linalg.solve(mass, W.T))
    expected = np.hstack([impulses @ np.linalg.solve(mass, W.T).T, -impulses])
    assert np.allclose(found, expected, rtol=1e-11, atol=1e-13)


def test_a_chain_of_four_links_rebounds_from_the_paradox_as_the_delassus_matrix_in_numbers_says():
    n, friction = 4, 5.0
    kinetics, (q, u) = chain(n).plain, _start(n)
    mass, _, W, _ = _equations(q, u)
    G = W @ np.linalg.solve(mass, W.T)
    p, stuck, turned = G[0, 0] - friction * abs(G[0, 1]), np.linalg.det(G) / G[1, 1], friction * G[1, 1] - abs(G[0, 1])
    assert p < 0
    assert kinetics.long
    values = {**VALUES, "f": friction, **{f"q{k}": a for k, a in enumerate(q, 1)}}
    values |= {f"q{k}'": v for k, v in enumerate(u, 1)}
    at = {s: values[s.name] for s in kinetics.symbols if s.name in values}
    expected = abs(np.cos(q) @ u) * np.sqrt(p * (p - stuck)) / turned
    assert evaluate((rebound(kinetics, sp.S.Zero),), at)[0] == pytest.approx(expected, rel=1e-11)


def test_the_elastic_contact_of_a_chain_of_eight_links_has_the_accelerations_of_newtons_law():
    n, rng = 8, np.random.default_rng(4)
    mechanism, c, h = chain(n), *sp.symbols("c h", positive=True)
    system = mechanism.elastic(compliance=c, damping=h)
    q, u = _start(n)[0], rng.normal(size=n)
    mass, forces, W, drifts = _equations(q, u)
    reaction, force = 1.7, -0.4
    rates = np.linalg.solve(mass, forces + W.T @ [reaction, force])
    gap, slip = W @ rates + drifts
    values = {**VALUES, "c": 0.01, "h": 0.5, "x": 0.3, "y": -(W[0] @ u) / 0.01, "z": W[1] @ u}
    values |= {"N": reaction, "F": force}
    values |= {f"q{k}": a for k, a in enumerate(q, 1)} | {f"q{k}'": v for k, v in enumerate(u, 1)}
    at = {s: values[s.name] for s in set().union(*(e.free_symbols for e in system.rates.values()))}
    found = dict(zip(map(str, system.states), evaluate((*system.rates.values(),), at), strict=True))
    expected = {f"q{k}": v for k, v in enumerate(u, 1)} | {f"q{k}'": v for k, v in enumerate(rates, 1)}
    expected |= {"x": values["y"], "y": -gap / 0.01, "z": slip}
    assert found == pytest.approx({name: expected[name] for name in found}, rel=1e-10)


def test_a_rate_of_many_coordinates_that_is_not_affine_is_named_and_not_written_out():
    assert obstacle(chain(4).rigid()) == "in mode slip_same the rate of q1' is not affine"


@pytest.mark.further
def test_the_slow_manifolds_of_a_chain_of_four_take_no_long_simplification_and_no_derivative_of_a_form(monkeypatch):
    c, h = sp.symbols("c h", positive=True)
    soft, simplify = chain(4).elastic(compliance=c, damping=h), sp.simplify

    def of_short(expr, **options):
        assert expr.count_ops() <= LONG
        return simplify(expr, **options)

    def of_none(form, place):
        raise AssertionError(f"{form} is differentiated by its entry {place}")

    monkeypatch.setattr(sp, "simplify", of_short)
    monkeypatch.setattr(InverseForm, "fdiff", of_none)
    assert [manifold.name for manifold in ap.slow_manifolds(soft, order=0)] == ["Pi1", "Pi2", "Lambda1"]


def test_the_layer_and_the_slow_motion_of_a_chain_of_four_take_no_derivative_of_a_form(monkeypatch):
    c, h = sp.symbols("c h", positive=True)
    soft = chain(4).elastic(compliance=c, damping=h)

    def of_none(form, place):
        raise AssertionError(f"{form} is differentiated by its entry {place}")

    monkeypatch.setattr(InverseForm, "fdiff", of_none)
    fibre = Formulas(soft.modes[0], c, soft.parameters)
    assert callable(fibre.slow_rates)
    assert callable(fibre.flow(1))


@pytest.mark.slow
def test_the_squares_of_euler_angles_add_up_in_the_inertia_of_a_body_in_space():
    turning, angles = spatial_body().plain.mass[3:, 3:], sp.symbols("a b c", real=True)
    A, B, C = sp.symbols("A B C", positive=True)
    W = sp.Matrix([[-sp.sin(angles[1]), 0, 1], [sp.cos(angles[1]) * sp.sin(angles[2]), sp.cos(angles[2]), 0],
                   [sp.cos(angles[1]) * sp.cos(angles[2]), -sp.sin(angles[2]), 0]])
    assert (turning - W.T * sp.diag(A, B, C) * W).applyfunc(sp.simplify) == sp.zeros(3)
    assert max(entry.count_ops() for entry in turning) < 30


@pytest.mark.slow
def test_a_body_in_space_has_the_reaction_of_newton_and_euler():
    body, angles, u = spatial_body(), sp.symbols("a b c"), np.array([1, 0.1, 0, 0.3, -0.5, 0.7])
    R = turned(angles)
    bodily = [R.T * R.diff(q) for q in angles]  # the angular velocity, and that of the rates, in the axes of the body
    W = sp.Matrix([[w[2, 1], w[0, 2], w[1, 0]] for w in bodily]).T
    drift = sum((W.diff(q) * v for q, v in zip(angles, u[3:], strict=True)), sp.zeros(3)) * sp.Matrix(u[3:])
    arm = R * CORNER
    bent = sum((arm.diff(q).diff(p) * v * w for q, v in zip(angles, u[3:], strict=True)
                for p, w in zip(angles, u[3:], strict=True)), sp.zeros(3, 1))
    at = dict(zip(angles, (0.3, 0.5, -0.4), strict=True))
    W, drift, slopes, bent = (np.array(e.subs(at), dtype=float) for e in (W, drift, arm.jacobian(angles), bent))
    inertia, spin = np.diag([0.1, 0.2, 0.15]), W @ u[3:]
    mass = np.block([[np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), W.T @ inertia @ W]])
    forces = np.concatenate([[0, 0, -9.81], -W.T @ (inertia @ drift[:, 0] + np.cross(spin, inertia @ spin))])
    rows = np.hstack([np.eye(3), slopes])
    u[2] = -slopes[2] @ u[3:]
    pushed = rows[2] - 0.7 * np.sign(rows[0] @ u) * rows[0]
    reaction = -(rows[2] @ np.linalg.solve(mass, forces) + bent[2, 0]) / (rows[2] @ np.linalg.solve(mass, pushed))
    values = {"m": 1, "g": 9.81, "A": 0.1, "B": 0.2, "C": 0.15, "f": 0.7, "X": 0, "Y": 0, "a": 0.3, "b": 0.5, "c": -0.4}
    values["Z"] = -float((R * CORNER)[2].subs(at))
    (motion,) = body.motions(values | {f"{q}'": v for q, v in zip("XYZabc", u, strict=True)})
    assert motion.name == "slip"
    assert motion.reaction == pytest.approx(reaction, rel=1e-12)


def test_a_gap_that_bends_makes_a_pair_of_bodies_too_long_to_be_inverted_and_has_the_reaction_of_newton_and_euler():
    mechanism, r, length, mass, inertia = crank_with_clearance(), 0.5, 1.5, 1, 0.2
    q, u = np.array([0.5, -0.3, 0.5 * np.cos(0.5) - 0.012, 0.5 * np.sin(0.5) - 0.016]), np.array([2, -0.5, 0, 0.8])
    pin, along = r * np.array([np.cos(q[0]), np.sin(q[0])]), length / 2 * np.array([np.cos(q[1]), np.sin(q[1])])
    across = np.array([-along[1], along[0]])
    M = np.diag([inertia, inertia + mass * along @ along, mass, mass])
    M[1, 2:] = M[2:, 1] = mass * across
    forces = mass * np.array([0, across @ np.array([0, -9.81]), *(along * u[1] ** 2 + (0, -9.81))])
    normal = (q[2:] - pin) / 0.02
    tangent, moved = np.array([-normal[1], normal[0]]), u[2:] - u[0] * np.array([-pin[1], pin[0]])
    rows = [[-n @ [-pin[1], pin[0]], 0, *n] for n in (normal, tangent)] * np.array([[-1], [1]])
    drift = -(pin * u[0] ** 2) @ normal - (tangent @ moved) ** 2 / 0.02  # of the gap, which the pin's rates leave
    pushed = rows[0] - 0.2 * np.sign(tangent @ moved) * rows[1]
    reaction = -(rows[0] @ np.linalg.solve(M, forces) + drift) / (rows[0] @ np.linalg.solve(M, pushed))
    values = {"m": mass, "l": length, "g": 9.81, "J": inertia, "f": 0.2, "r": r, "e": 0.02}
    values |= {n: v for k, n in enumerate(("a", "b", "X", "Y")) for n, v in ((n, q[k]), (f"{n}'", u[k]))}
    (motion,) = mechanism.motions(values)
    assert mechanism.plain.long
    assert motion.name == "slip"
    assert motion.reaction == pytest.approx(reaction, rel=1e-11)


@pytest.mark.further
def test_a_closed_chain_in_coordinates_that_are_free_has_the_reaction_of_newtons_law_with_its_bars_as_constraints():
    """A crank, its pin and a sliding block carry two bars of the length 1 that meet in an elbow, a point of mass 1."""
    (a, X, Y), t = dynamicsymbols("a X Y"), dynamicsymbols._t
    pin, block = sp.Matrix([sp.cos(a), sp.sin(a)]), sp.Matrix([X, Y])
    apart = block - pin
    across = sp.Matrix([-apart[1], apart[0]])
    elbow = pin + apart / 2 + sp.sqrt(4 / apart.dot(apart) - 1) / 2 * across
    moved = sp.Matrix([a, X, Y, *elbow]).diff(t)
    ground = ap.Contact(gap=Y, slip=X, friction=f, unilateral=True)
    closed = ap.Mechanism.from_lagrangian(moved.dot(moved) / 2 - elbow[1] - Y, (a, X, Y), contact=ground)
    state = {"a": 0.5, "X": 1.5, "Y": 0, "a'": 0.3, "X'": -0.2, "Y'": 0}
    (motion,) = closed.motions({**state, "f": 0.3})
    at = {"q": [0.5, 1.5, 0, *elbow.subs({a: 0.5, X: 1.5, Y: 0})], "u": [0.3, -0.2, 0]}
    e, (c, s) = np.array(at["q"][3:], dtype=float), (np.cos(0.5), np.sin(0.5))
    first, second = e - [c, s], e - [1.5, 0]
    bars = np.array([[first @ [s, -c], 0, 0, *first], [0, *-second, *second]])  # the halved rates of squared lengths
    rates = np.array([*at["u"], *np.linalg.solve(bars[:, 3:], -bars[:, :3] @ at["u"])])
    relative = rates[3:] - 0.3 * np.array([-s, c]), rates[3:] - rates[1:3]
    drift = np.array([relative[0] @ relative[0] + first @ [c, s] * 0.09, relative[1] @ relative[1]])
    pushed = np.array([0, 0.3, 1, 0, 0])
    left = np.block([[np.eye(5), -bars.T, -pushed[:, None]], [bars, np.zeros((2, 3))], [0, 0, 1, 0, 0, 0, 0, 0]])
    found = np.linalg.solve(left, [0, 0, -1, 0, -1, *-drift, 0])
    assert motion.name == "slip"
    assert motion.reaction == pytest.approx(found[-1], rel=1e-12)


def test_an_arm_on_an_incline_has_the_formulas_that_it_has_in_axes_along_the_incline():
    """Its gap, y cos(1/5) - x sin(1/5), made the bordered mass matrix too long, and all formulas forms through it."""
    a, b, t = *dynamicsymbols("a b"), dynamicsymbols._t
    l1, l2, slope = *sp.symbols("l1 l2", positive=True), sp.Rational(1, 5)
    elbow, reach = (l1 * sp.cos(a), l1 * sp.sin(a)), (l2 * sp.cos(a + b), l2 * sp.sin(a + b))
    x, y = (p + q for p, q in zip(elbow, reach, strict=True))
    masses = sp.symbols("m1 m1 m2 m2", positive=True)
    energy = sum(m * p.diff(t) ** 2 for m, p in zip(masses, (*elbow, x, y), strict=True))
    across = y * sp.cos(slope) - x * sp.sin(slope), x * sp.cos(slope) + y * sp.sin(slope)
    along = [l1 * wave(a - slope) + l2 * wave(a + b - slope) for wave in (sp.sin, sp.cos)]
    arms = [ap.Mechanism.from_lagrangian(energy / 2, (a, b), contact=ap.Contact(*pair, f)) for pair in (across, along)]
    assert arms[0].delassus == arms[1].delassus
    assert not arms[0].delassus.has(InverseForm)
