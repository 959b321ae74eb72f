"""The elastic contact as a system: its invariant, its rigid limit, its three dampings, contacts that open and close."""

import math
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from contactmodel import Model, follow
from mechanisms import T, X, Y, masses_between_guides, slender_rod
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols
from test_jump_law import EACH, MECHANISMS, bead_rod

import asympk as ap
from asympk.errors import InputError, NotDerivable, NotNormallyHyperbolic
from asympk.mechanics.evaluation import evaluate
from asympk.symbolic.long import symbols_in
from asympk.systems import MECHANISMS as MECHANISM_NAMES

c, eps, h = sp.symbols("c eps h", positive=True)
SCALINGS = [(c, h), (eps**2, sp.Rational(1, 2) * eps), (eps**2, sp.S.Zero)]


def _terms_of_rate(expr, system):
    moved = {**system.rates} | ({system.time: sp.S.One} if system.time else {})
    return [expr.diff(s) * rate for s, rate in moved.items()]


def _kept(invariant, system):
    """Return the terms of d/dt of g + c x, or, where y is dependent, of g' + c y."""
    terms = _terms_of_rate(invariant, system)
    return _terms_of_rate(sum(terms), system) if system.dependent else terms


@pytest.mark.few(0)
@pytest.mark.parametrize(("compliance", "damping"), SCALINGS)
@pytest.mark.parametrize("make", EACH)
def test_gap_plus_compliance_times_reaction_is_an_invariant(make, compliance, damping):
    """d/dt (g(q) + c x), or d/dt (g' + c y), is 0 in every state: no coordinate was eliminated, and none need be."""
    rod = make()[0]
    system = rod.elastic(compliance=compliance, damping=damping)
    x = next(s for s in system.states if s.name == "x")
    rate = sum(_kept(rod.plain.gap + compliance * x, system))
    rng = np.random.default_rng(2)
    for _ in range(3):
        at = {s: sp.Rational(int(rng.integers(1, 50)), 60) for s in sorted(rate.free_symbols, key=str)}
        assert abs(rate.subs(at).evalf(30)) < 1e-25


def test_the_end_of_a_chain_on_a_wavy_wire_has_an_elastic_contact_though_the_wave_of_a_sum_of_sines_is_long():
    """Expanded, cos(2 X) of X = sin a + ... + sin d has thousands of terms, over which normal forms took for ever."""
    angles = dynamicsymbols("a:4")
    x, y = sum(map(sp.sin, angles)) + sp.sin(T) / 4, -sum(map(sp.cos, angles))
    kinetic = sum(q.diff(T) ** 2 for q in angles) / 2
    wire = ap.Contact(gap=y - sp.cos(2 * x) / 4, slip=x, friction=1)
    chain = ap.Mechanism.from_lagrangian(kinetic, angles, contact=wire)
    system = chain.elastic(compliance=c, damping=h)
    invariant = chain.plain.gap_rate + c * next(s for s in system.states if s.name == "y")
    rate = invariant.diff(system.time) + sum(invariant.diff(s) * system.rates[s] for s in system.states)
    at = {s: sp.Rational(k + 1, 20) for k, s in enumerate(sorted(symbols_in(rate), key=str))}
    assert abs(evaluate((rate,), at)[0]) < 1e-12


@pytest.mark.parametrize("make", EACH)
def test_the_sliding_velocity_is_a_state_with_the_rate_of_its_own_definition(make):
    rod = make()[0]
    system = rod.elastic(compliance=c, damping=h)
    z = next(s for s in system.states if s.name == "z")
    moved = {u: system.slow[q] for q, u in zip(rod.plain.coordinates, rod.plain.velocities, strict=True)}
    apart = rod.plain.slip.subs(moved, simultaneous=True) - z  # 0 in all states, or along a motion
    rate = sum(apart.diff(s) * system.rates[s] for s in system.states)
    rng = np.random.default_rng(2)
    at = {s: sp.Rational(int(rng.integers(1, 50)), 60) for s in sorted((apart + rate).free_symbols, key=str)}
    assert abs(rate.subs(at).evalf(30)) < 1e-25
    assert system.dependent or abs(apart.subs(at).evalf(30)) < 1e-25


def test_states_are_named_and_ordered():
    system = slender_rod().elastic(compliance=c, damping=h)
    assert {str(s) for s in system.states} == {"X", "Y", "theta", "x", "z", "theta'", "y"}
    assert [str(s) for s in system.fast] == ["y"]
    assert [str(s) for s in slender_rod().elastic(compliance=eps**2, damping=0).fast] == ["x", "y"]
    assert system.small == c


@pytest.mark.parametrize("key", ["X'", X, X.diff(T)])
def test_a_start_in_coordinates_and_rates_is_pointed_to_what_completes_it(key):
    soft = slender_rod().elastic(compliance=c, damping=sp.Rational(1, 2))
    with pytest.raises(InputError, match=r"is not a state of this system; .*mechanism.start\(system, "):
        ap.Scene(system=soft, values=dict.fromkeys("cfglm", 1), start={key: 1}, until=1)


def test_a_coordinate_called_x_keeps_its_name():
    q, u = sp.symbols("x y"), sp.symbols("u v")
    block = ap.Mechanism(q, u, sp.eye(2), (0, -1), ap.Contact(q[1], q[0], 1, unilateral=True))
    assert {str(s) for s in block.elastic(compliance=c, damping=h).states} == {"x", "y", "x_", "y_", "z"}


@pytest.mark.parametrize("make", EACH)
@pytest.mark.few(1)
def test_the_system_follows_the_contact_as_newtons_law_in_numbers_does(make):
    rod, parameters, terms, friction, (q, u) = make()
    stiffness, until = 1e3, 0.02
    model = Model(terms, friction, stiffness, 0.5)
    _, at, _ = follow(model, np.array([*q.values()]), np.array([*u.values()]), until)
    system = rod.elastic(compliance=c, damping=sp.Rational(1, 2))
    sliding = rod.evaluate(rod.sliding_velocity, {**parameters, **q, **u})
    start = {**q, **{s.name: u[s.name] for s in system.states if s.name in u}, "x": 0, "y": 0, "z": sliding}
    path = ap.solve(ap.Scene(system=system, values={**parameters, "c": "1e-3"}, start=start, until=until))
    found = dict(zip(map(str, path.names), path.final, strict=True))
    assert path.modes[:2] == ("slip_opposite", "stick")
    assert [found[name] for name in q] == pytest.approx(at, abs=1e-7)


def test_painleve_and_klein_come_out_in_fufaevs_scales():
    """tau = t / h, x = rho: mu = c m / (2 h^2 cos(alpha)^2) .. and both masses' equations become (2.7)-(2.9)."""
    rod = masses_between_guides()
    system = rod.elastic(compliance=c, damping=h)
    m, P, alpha, f = (next(s for s in system.parameters if s.name == name) for name in ("m", "P", "alpha", "f"))
    x, y, z = (next(s for s in system.states if s.name == name) for name in "xyz")
    pk = ap.systems.painleve_klein
    reaction = P / sp.cos(alpha)
    scaled = {x: reaction * pk.x, y: reaction * pk.y / h, z: P * h / m * pk.z}
    for name in ("slip_same", "slip_opposite", "stick"):
        fast = system.mode(name).fast[y].subs(scaled, simultaneous=True) * m / (P * sp.cos(alpha))
        drift = system.mode(name).slow[z].subs(scaled, simultaneous=True) * m / P
        turned = {pk.sigma: f * sp.tan(alpha) - 2, pk.sigma0: f * sp.tan(alpha) - 2}
        expected = ap.systems.painleve_klein.system().mode(name)
        assert sp.simplify(fast - expected.fast[pk.y].subs(turned)) == 0
        assert sp.simplify(drift - expected.slow[pk.z].subs(turned)) == 0


def test_a_block_that_bounces_opens_and_closes_its_contact():
    """A sliding block that bounces on a damped support: lift_off, touch_down, and less at each bounce."""
    q, u = sp.symbols("X Y"), sp.symbols("U V")
    contact = ap.Contact(q[1], q[0], sp.Rational(1, 100), unilateral=True)
    block = ap.Mechanism(q, u, sp.eye(2), (0, -1), contact)
    system = block.elastic(compliance=eps**2, damping=eps / 5)
    start = {"X": 0, "Y": 0, "x": 0, "y": 100, "z": 1}
    path = ap.solve(ap.Scene(system=system, values={"eps": "1/100"}, start=start, until=4))
    kinds = [event.kind for event in path.events if event.kind in ("lift_off", "touch_down")]
    assert kinds[:3] == ["lift_off", "touch_down", "lift_off"]
    rates = [-event.state[path.names.index("y")] / 100 for event in path.events if event.kind == "lift_off"]
    assert 0 < rates[1] < rates[0] < 1
    assert rates[0] == pytest.approx(_rebound(0.2), abs=2e-3)


def _rebound(b):
    """Return u' where u + b u' = 0 again, of u'' = -(u + b u') from u = 0, u' = -1 in penetration."""
    w = np.sqrt(1 - b * b / 4)
    tau = np.linspace(0, np.pi / w, 200001)
    value = np.exp(-b * tau / 2) * np.sin(w * tau) / w
    rate = np.exp(-b * tau / 2) * (np.cos(w * tau) - b / 2 * np.sin(w * tau) / w)
    end = np.nonzero((value + b * rate) < 0)[0][0]
    return -rate[end]


@pytest.mark.parametrize(
    ("compliance", "damping", "match"),
    [
        (c, 0, "give a time that does not depend on it"),
        (c, c * h, "give a time that does not depend on it"),
        (eps**2, 1, "give 0 or a positive multiple of eps"),
        (sp.Symbol("e") ** 2, -sp.Symbol("e"), "give 0 or a positive multiple of e"),
        (sp.Rational(1, 1000), h, "must be a Symbol or the square of one"),
        (eps**3, h, "must be a Symbol or the square of one"),
        (c, -1, "damping = -1: it must be zero or positive"),
        (sp.Symbol("m"), h, "the mechanism has a m already"),
        (sp.Symbol("X"), h, "the mechanism has a X already"),
        (c, h * sp.Symbol("m"), "the mechanism has another m"),
    ],
)
def test_scalings_without_a_limit_are_refused(compliance, damping, match):
    with pytest.raises(InputError, match=match):
        slender_rod().elastic(compliance=compliance, damping=damping)


U, z, b = sp.Symbol("U", real=True), sp.Symbol("z", real=True), sp.Symbol("b", positive=True)
PIECES = [
    (sp.Piecewise((eps / 2, U > 1), (b * eps, True)), sp.Piecewise((sp.S.Half, z > 1), (b, True))),
    (sp.Max(eps / 2, eps * (1 + U)), sp.Max(sp.S.Half, z + 1)),
    (b * sp.Piecewise((0, U > 1), (eps + b * eps, True)), b * sp.Piecewise((0, z > 1), (1 + b, True))),
    (eps + sp.Abs(eps * U), 1 + sp.Abs(z)),
]


@pytest.mark.parametrize(("damping", "ratio"), PIECES)
@pytest.mark.parametrize("positive", [True, None])
def test_a_damping_each_piece_of_which_is_a_multiple_of_the_small_parameter_is_one(damping, ratio, positive):
    """A Piecewise of eps/2 and b eps was told to be no multiple of eps."""
    V, x, y = sp.symbols("V x y", real=True)
    small = sp.Symbol("eps", positive=positive)
    block = ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, X, 3))
    load = block.elastic(compliance=small**2, damping=damping.subs(eps, small)).friction.load
    assert [sp.simplify((load - x - ratio * y).subs(z, value)) for value in (-1, 2)] == [0, 0]


def test_a_damping_one_piece_of_which_is_no_multiple_of_the_small_parameter_is_refused():
    for damping in (sp.Piecewise((eps, U > 1), (1, True)), sp.Piecewise((eps, eps < U), (2 * eps, True))):
        with pytest.raises(InputError, match="give 0 or a positive multiple of eps"):
            slender_rod().elastic(compliance=eps**2, damping=damping)


def test_a_float_of_the_damping_is_the_number_that_it_is_as_in_all_else_of_a_mechanism():
    """It was refused as a float that "the friction" contains."""
    exact, given = (slender_rod().elastic(compliance=eps**2, damping=d * eps) for d in (sp.Rational(3, 4), 0.75))
    assert given == exact


@pytest.mark.parametrize("contact", ["rigid", "elastic"])
@pytest.mark.parametrize("name", ["F", "N", "x", "x_", "z"])
@pytest.mark.few(2)
def test_a_parameter_may_have_the_name_of_a_force_or_a_state_of_the_contact(name, contact):
    final = {}
    for called in (name, "P"):
        push = sp.Symbol(called, real=True)
        ground = ap.Contact(gap=Y, slip=X, friction=sp.Rational(1, 5), unilateral=True)
        energy = X.diff(T) ** 2 + X.diff(T) * Y.diff(T) + Y.diff(T) ** 2
        block = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ground, forces={X: push, Y: -1})
        system = block.rigid() if contact == "rigid" else block.elastic(compliance=c, damping=h)
        values = {called: 3} if contact == "rigid" else {called: 3, "c": "1/100", "h": 1}
        start = block.start(system, {"X": 0, "Y": 0, "X'": 1, "Y'": 0})
        final[called] = ap.solve(ap.Scene(system=system, values=values, start=start, until=1)).final
    assert final[name] == pytest.approx(final["P"], rel=1e-12)
    assert final["P"][0] > 1.5


def test_the_undamped_good_side_is_a_centre_and_the_other_side_a_saddle():
    """Butenin: eigenvalues +-sqrt(-p) of the fast field, imaginary without a paradox, +-real with one."""
    found = {m.mode: m for m in ap.critical_manifolds(ap.systems.butenin.system())}
    steep, shallow = ({"alpha": "1", "f": f, "m": "1", "P": "1"} for f in ("3", "1/10"))
    assert found["slip_opposite"].at(**steep).stability == "saddle"
    for mode, values in (("slip_same", steep), ("slip_same", shallow), ("slip_opposite", shallow)):
        with pytest.raises(NotNormallyHyperbolic, match="a centre"):
            _ = found[mode].at(**values).stability


def test_impact_without_collision_comes_out_of_the_system():
    """The bead's rod on the ground: slip, stick and lift_off, with the gap rate of the law as eps -> 0."""
    _, _, _, _, (q, u) = bead_rod()
    rod, values = slender_rod(), {"m": 1, "l": 1, "g": 1, "f": 2}
    expected = rod.evaluate(rod.jump_law(ratio=1).gap_rate, {**values, **q, **u})
    system, errors = rod.elastic(compliance=eps**2, damping=eps), []
    for small in (1e-3, 1e-4):
        start = {**q, "theta'": u["theta'"], "x": 0, "y": 0, "z": -1}
        path = ap.solve(ap.Scene(system=system, values={**values, "eps": small}, start=start, until=40 * small))
        assert path.modes[0] == "slip_opposite"
        (lift,) = (event for event in path.events if event.kind == "lift_off")
        errors.append(abs(-small * lift.state[path.names.index("y")] - expected))
    assert errors[1] < 0.2 * errors[0]


@pytest.mark.few(0)
@pytest.mark.parametrize("name", MECHANISM_NAMES)
def test_gap_plus_compliance_times_reaction_is_an_invariant_of_every_mechanism_of_the_catalogue(name):
    """d/dt (g(q, t) + c x), or d/dt (g' + c y), is 0 at random states to rounding, whatever the forces."""
    module = getattr(ap.systems, name)
    kinetics, rng = module.mechanism().plain, np.random.default_rng(6)
    dimensional = name == "painleve_klein"
    system = module.mechanism().elastic(compliance=c, damping=h) if dimensional else module.system()
    x = next(s for s in system.states if s.name.rstrip("_") == "x" and s not in kinetics.coordinates)
    terms = _kept(kinetics.gap + system.small ** (2 if x in system.fast else 1) * x, system)
    at = {s: rng.uniform(0.2, 1.2, 20) for s in sorted(sp.Tuple(*terms).free_symbols, key=str)}
    parts = evaluate(tuple(terms), at)
    assert np.all(np.abs(sum(parts)) < 1e-12 * sum(map(np.abs, parts)))


@pytest.mark.further
def test_the_condition_of_the_jump_law_is_that_of_the_paradox_of_a_closed_contact_in_symbols():
    """|P_T| < friction load |P_N| is friction load |G_NT| > G_NN: the impulses' ratio is G_NN / |G_NT| identically."""
    for make in MECHANISMS:
        rod = make()[0]
        law, G = rod.jump_law(), rod.delassus
        closed = rod.own(sp.Eq(rod.plain.gap_rate, 0))
        assert law.condition == sp.And(rod.paradox, closed)
        normal, tangential = law.impulses
        assert sp.simplify(tangential * G[0, 1] + normal * G[0, 0]) == 0


def test_the_undamped_rod_of_the_claims_is_that_of_butenin_in_its_own_scales():
    """R cos(alpha) = P s, epsilon cos(alpha) = eps for m = 1, velocities in the unit of P, sigma = f tan(alpha) - 2."""
    from asympk.ledger import undamped

    system, claimed = ap.systems.butenin.system(), undamped.undamped_system()
    named = {s.name: s for s in (*system.states, *system.parameters)}
    m, P, alpha, f, f0 = (named[name] for name in ("m", "P", "alpha", "f", "f_0"))
    x, y, z = (named[name] for name in "xyz")
    scaled = {x: P * undamped.s / sp.cos(alpha), z: undamped.v, f0: f}
    for mode in claimed.modes:
        found = system.mode(mode.name)
        push = found.fast[y].subs(scaled) * m / (P * sp.cos(alpha)) - mode.fast[undamped.w]
        drift = found.slow[z].subs(scaled) * m / P - mode.slow[undamped.v]
        for difference in (push, drift):
            assert sp.simplify(difference.subs(undamped.sigma, f * sp.tan(alpha) - 2)) == 0


@pytest.mark.parametrize("given", [{}, {"compliance": c}, {"damping": h}])
def test_an_elastic_contact_without_its_two_numbers_says_which_they_are(given):
    with pytest.raises(InputError, match="needs compliance= and damping="):
        slender_rod().elastic(**given)


@pytest.mark.parametrize(
    ("ground", "where"),
    [
        (lambda x, t: sp.Max(0, x - 1), "x - 1 = 0"), (lambda x, t: sp.Abs(sp.sin(x)), r"sin\(x\) = 0"),
        (lambda x, t: sp.Piecewise((0, t < 2), (1, True)), "t - 2 = 0"),
        (lambda x, t: sp.Piecewise((0, t <= 2), (1, True)), "t - 2 = 0"), (lambda x, t: sp.Mod(x, 3), "x/3 is whole"),
        (lambda x, t: sp.Max(0, x - 1) ** 2 + sp.Max(0, sp.sin(t)) ** 2, None),
    ],
)
@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.few(2)
def test_ground_with_steps_and_kinks_is_refused_where_the_reaction_or_the_constraint_would_jump(
    unilateral, ground, where
):
    x, y, u, v, t = sp.symbols("x y u v t", real=True)
    contact = ap.Contact(y - ground(x, t), x, sp.Rational(1, 4), unilateral=unilateral)
    block = ap.Mechanism((x, y), (u, v), sp.eye(2), (0, -1), contact, time=t)
    with pytest.raises(NotDerivable, match=where) if where else nullcontext():
        block.elastic(compliance=sp.Symbol("c", positive=True), damping=1)
    with pytest.raises(NotDerivable, match=where) if where and not unilateral else nullcontext():
        block.rigid()


def test_a_gap_with_a_real_cube_root_is_followed_beside_its_pole():
    """Its slope is infinite at 0, where the gap was said to jump."""
    x, y, u, v = sp.symbols("x y u v", real=True)
    start, paths = {x: 1, y: sp.Rational(1, 10), u: 1, v: sp.Rational(1, 30)}, []
    for height in (sp.sign(x) * sp.cbrt(sp.Abs(x)), sp.cbrt(x)):
        ground = ap.Contact(y - height / 10, x, sp.Rational(3, 10), unilateral=True)
        block = ap.Mechanism((x, y), (u, v), sp.eye(2), (0, -10), ground)
        soft = block.elastic(compliance=c, damping=sp.Rational(1, 2))
        scene = ap.Scene(system=soft, values={c: "1e-2"}, start=block.start(soft, start), until="1/2")
        paths.append(ap.solve(scene))
    assert paths[0].modes == paths[1].modes == ("slip_same", "stick")
    assert paths[0].final == pytest.approx(paths[1].final, abs=1e-6)


def test_a_belt_whose_velocity_jumps_is_refused_as_the_sliding_velocity_would_not():
    x, y, u, v, t = sp.symbols("x y u v t", real=True)
    belt = sp.Piecewise((1, t < 1), (2, True))
    block = ap.Mechanism((x, y), (u, v), sp.eye(2), (0, -1), ap.Contact(y, u - belt, 1, unilateral=True), time=t)
    with pytest.raises(NotDerivable, match="sliding velocity jumps where t - 1 = 0"):
        block.elastic(compliance=sp.Symbol("c", positive=True), damping=1)


@pytest.mark.parametrize("damping", [1 + X**2, 1 + T, 1 + X.diff(T) ** 2], ids=str)
def test_a_damping_may_change_with_the_place_the_time_and_the_rates(damping):
    """A block pressed on its ground by 1 has Y'' = R - 1, X'' = -R/2 with R = -(Y + h Y')/c, h the damping time."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y
    block = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ap.Contact(Y, X, sp.Rational(1, 2), unilateral=True))
    values, until = {"X": 0, "Y": 0, "X'": 2, "Y'": 0}, 0.5
    soft = block.elastic(compliance=c, damping=damping)
    path = ap.solve(ap.Scene(system=soft, values={c: "1/10"}, start=block.start(soft, values), until=until))
    time = sp.lambdify((T, X, X.diff(T)), damping)

    def rates(t, w):
        reaction = -10 * (w[1] + time(t, w[0], w[2]) * w[3])
        return [w[2], w[3], -reaction / 2, reaction - 1]

    expected = solve_ivp(rates, (0, until), [0, 0, 2, 0], method="Radau", rtol=1e-9, atol=1e-11).y[:, -1]
    assert [path.final[path.names.index(name)] for name in ("X", "Y", "z")] == pytest.approx(expected[:3], abs=1e-8)


def test_a_start_off_the_elastic_contact_has_the_reaction_of_its_gap_and_its_rate():
    """A body of the mass 1 comes down on its spring with the velocity 1: half a swing, pi eps, brings it up again."""
    X, Y, U, V = sp.symbols("X Y U V", real=True)
    body = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, 0), ap.Contact(Y, X, sp.Rational(1, 2), unilateral=True))
    bouncy, soft = body.elastic(compliance=eps**2, damping=0), body.elastic(compliance=c, damping=1)
    down = {"X": 0, "Y": 0, "U": 9, "V": -1}
    start = body.start(bouncy, {**down, "Y": "1/10", "eps": "1/100"})
    assert (start["x"], start["y"]) == pytest.approx((-1000, 100))
    path = ap.solve(ap.Scene(system=bouncy, values={"eps": "1/100"}, start=start, until="1/5"))
    assert [float(event.t) for event in path.events] == pytest.approx([0.1, 0.1 + np.pi / 100])
    assert path.final[1] == pytest.approx(0.1 - np.pi / 100)
    assert path.final[-1] == pytest.approx(9 - 1)  # friction takes half of the impulse 2
    assert body.start(soft, {**down, c: "1/4"})["y"] == 4
    damped = body.elastic(compliance=c, damping=h)
    assert body.start(damped, {**down, c: "1/4", h: 1})["y"] == 4  # the parameters of the contact as well
    with pytest.raises(InputError, match="off the contact, g' = -1; give c"):
        body.start(soft, down)
    with pytest.raises(InputError, match=r"above the contact, g = 0\.1, g' = -1, where its damper"):
        body.start(soft, {**down, "Y": "1/10", c: "1/4"})


def test_a_start_above_a_ground_that_steps_with_a_parameter_is_off_the_contact_at_the_step_itself():
    """Six digits of h would change its gap of 1/2 by 1: this is a step, no rounding."""
    X, Y, U, V, f = sp.symbols("X Y U V f", real=True)
    body = ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, 0), ap.Contact(Y - sp.floor(h), X, f, unilateral=True))
    with pytest.raises(InputError, match=r"above the contact, g = 0\.5, g' = -1, where its damper"):
        body.start(body.elastic(compliance=c, damping=1), {"X": 0, "Y": "3/2", "U": 1, "V": -1, f: 1, h: 1, c: 1})


@pytest.mark.parametrize(("compliance", "damping", "value"), [(c, 1, "1e-8"), (eps**2, 0, "1e-4")])
def test_a_body_that_presses_its_stiff_spring_in_by_its_weight_starts_at_rest_in_whatever_unit(
    compliance, damping, value
):
    """The weight 10 presses a spring of the compliance 1e-8 in by 1e-7: as a length by hand this would pass for 0."""
    X, Y, U, V = sp.symbols("X Y U V", real=True)
    ground = ap.Contact(Y, X, sp.Rational(1, 2), unilateral=True)
    soft = (body := ap.Mechanism((X, Y), (U, V), sp.eye(2), (0, -10), ground)).elastic(compliance, damping)
    start = body.start(soft, {"X": 0, "Y": "-1e-7", "U": 0, "V": 0, str(soft.small): value})
    assert start["x"] == pytest.approx(10)
    path = ap.solve(ap.Scene(system=soft, values={str(soft.small): value}, start=start, until=1))
    assert path.final[1] == pytest.approx(-1e-7)
    assert body.start(soft, {"X": 1, "Y": math.sin(math.pi), "U": 0, "V": 0})["x"] == 0


def _turned_past_a_right_angle(slip, *order):
    """Return the system of a body in three coordinates, in an order, and p at the end, which began as 1/2."""
    rates = {s: sp.Symbol(f"{s}'", real=True) for s in order}
    x, y, p = sorted(order, key=str)
    body = ap.Mechanism(order, [*rates.values()], sp.eye(3), [-1 if q == y else 0 for q in order],
                        ap.Contact(y, slip(rates[x], p, rates[p]), sp.Rational(1, 10), unilateral=True))
    system = body.elastic(compliance=c, damping=1)
    start = body.start(system, {"X": 0, "Y": 0, "p": "1/2", "X'": 1, "Y'": 0, "p'": 2})
    path = ap.solve(ap.Scene(system=system, values={"c": "1/100"}, start=start, until=1))
    return system, dict(zip(path.names, path.final, strict=True))["p"]


def test_a_motion_past_a_place_where_the_rates_are_no_basis_is_followed_with_the_coordinates_in_any_order():
    """g' = Y' and z = cos(p) X' + sin(p) p' are no basis with p' where p = pi/2, and with X' where p = 0."""
    x, y, p = sp.symbols("X Y p", real=True)
    slip = lambda u, p, w: sp.cos(p) * u + sp.sin(p) * w  # noqa: E731
    ends = [_turned_past_a_right_angle(slip, *order)[1] for order in ((x, y, p), (p, y, x))]
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)
    assert ends[0] > np.pi / 2


def test_rates_that_complete_a_basis_everywhere_are_taken_before_those_of_later_coordinates():
    """With z = cos(p) X' + p' the rate p' completes a basis where cos(p) is not 0, and X' everywhere."""
    x, y, p = sp.symbols("X Y p", real=True)
    ways = [_turned_past_a_right_angle(lambda u, p, w: sp.cos(p) * u + w, *order) for order in ((x, y, p), (p, y, x))]
    assert all("X'" in map(str, system.states) for system, _ in ways)
    assert ways[0][1] == pytest.approx(ways[1][1], abs=1e-8)
    assert ways[0][1] > np.pi / 2


@pytest.mark.further
def test_a_slider_crank_passes_its_dead_centre_with_and_without_a_further_contact_that_stays_open():
    """Slip ends at the dead centre whatever the crank does: z and the gap rate are no basis of the rates there."""
    a, b, u, w = sp.symbols("a b a' b'", real=True)
    across, along = sp.sin(a) - 3 * sp.sin(b) / 2, sp.cos(a) + 3 * sp.cos(b) / 2
    rod = sp.Matrix([across, along]).jacobian([a, b])
    pulls = sp.Matrix([1, 0]) - rod.T * (rod.diff(a) * u + rod.diff(b) * w) * sp.Matrix([u, w])
    guide = ap.Contact(across, along, sp.Rational(3, 10))
    far = ap.Contact(100 - a, b, 0, unilateral=True)
    begin = {"a": 3, "b": math.asin(math.sin(3) / 1.5), "a'": 1, "b'": math.cos(3) / math.sqrt(2.25 - math.sin(3) ** 2)}
    soft = [(crank.elastic(compliance=c, damping=1), crank)
            for crank in (ap.Mechanism((a, b), (u, w), rod.T * rod + sp.diag(2, 0), pulls, guide, others=others)
                          for others in ((), [far]))]
    alone, both = (ap.Scene(system=system, values={"c": "1e-3"}, start=crank.start(system, {**begin, "c": "1e-3"}),
                            until="1/4") for system, crank in soft)
    path = ap.solve(alone)
    assert path.final[:2] == pytest.approx(ap.solve(both).final[:2], abs=1e-8)
    assert path.modes[:2] == ("slip_opposite", "slip_same")
    assert path.final[0] > np.pi
    assert path.final[1] == pytest.approx(math.asin(math.sin(path.final[0]) / 1.5), abs=1e-5)


@pytest.mark.parametrize(("root", "digits"), [("6e-4", None), ("1e-5", 30)])
def test_a_drill_that_sticks_starts_again_however_far_its_contact_has_come_to_rest(root, digits):
    """The rate y of the reaction has decayed to 1e-129 of it or less: as the only term left it stopped the bit."""
    angle, bit, depth = dynamicsymbols("angle bit depth")
    rates = [q.diff(T) for q in (angle, bit, depth)]
    energy = rates[0] ** 2 + rates[1] ** 2 / 20 + rates[2] ** 2 / 2 - 5 * (angle - bit) ** 2 / 2 - 10 * depth
    rock = ap.Contact(gap=depth, slip=bit / 2, friction=sp.S.Half, unilateral=True)
    drill = ap.Mechanism.from_lagrangian(energy, (angle, bit, depth), contact=rock)
    system = drill.elastic(compliance=eps**2, damping=eps)
    turning = {"angle": 0, "bit": 0, "depth": 0, "angle'": 1, "bit'": 1, "depth'": 0}
    scene = ap.Scene(system=system, values={"eps": root}, start=drill.start(system, turning), until=1)
    path = ap.solve(scene, digits=digits)
    assert path.modes == ("slip_same", "stick", "slip_same")
    rest = path.events[0].state
    held, rate = float(5 * (rest[0] - rest[1])), float(rest[path.names.index("angle'")])  # angle'' = -5 (angle - bit)/2
    swing = solve_ivp(lambda _, w: [w[1], -2.5 * w[0]], (0, 1), [held / 5, rate], rtol=1e-10, atol=1e-12,
                      events=lambda _, w: 5 * w[0] - 2.5)  # until the spring overcomes f N/2
    assert float(path.events[1].t) == pytest.approx(float(path.events[0].t) + swing.t_events[0][0], abs=1e-8)


@pytest.mark.further
def test_the_rigid_limit_of_an_elastic_slider_crank_starts_from_its_dead_centre_in_units_of_its_own():
    """Rates that follow from each other do in any units; in those of the limit one was not known."""
    a, b = dynamicsymbols("a b")
    turning = (sp.sin(a) * a.diff(T) + 3 * sp.sin(b) * b.diff(T)) ** 2 + a.diff(T) ** 2 + b.diff(T) ** 2
    across, along = sp.sin(a) - 3 * sp.sin(b), sp.cos(a) + 3 * sp.cos(b)
    guide = ap.Contact(across, along, sp.Rational(3, 10))
    crank = ap.Mechanism.from_lagrangian(turning / 2 + 5 * a, (a, b), contact=guide)
    system = crank.elastic(compliance=eps**2, damping=eps)
    start = crank.start(system, {"a": 0, "b": 0, "a'": 0, "b'": 0})
    scene = ap.Scene(system=system, values={"eps": "1e-4"}, start=start, until=sp.S.Half)
    exact = ap.solve(scene).final
    assert exact[0] > 0.5
    assert ap.solve(scene, "slow", order=0).final[:2] == pytest.approx(exact[:2], abs=1e-4)


def test_the_speed_of_a_belt_is_a_parameter_of_an_elastic_contact_where_z_alone_depends_on_it():
    """With all rates for states no rate of the shoe contains v, but what z is at a start does."""
    scene = ap.systems.brake_shoe.scenes()[0]
    assert "v" in map(str, scene.system.parameters)
    assert ap.solve(replace(scene, until="1e-6")).modes == ("slip_same",)
    moved = {s: value + (s.name == "z") for s, value in zip(scene.system.states, scene.start, strict=True)}
    with pytest.raises(InputError, match="which follows from the other states"):
        ap.solve(replace(scene, start=moved))


@pytest.mark.parametrize("damping", [eps / 2, 0])
def test_an_elastic_guide_without_friction_is_closed_whatever_the_signs_of_its_load_and_slip(damping):
    """Zeros of the load, of x + y/2 without a force by it, were events, and so were those of the slip."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2
    block = ap.Mechanism.from_lagrangian(energy, (X, Y), contact=ap.Contact(Y, X, 0), forces={X: -X, Y: sp.sin(9 * T)})
    system = block.elastic(compliance=eps**2, damping=damping)
    start = block.start(system, {"X": 0, "Y": 0, "X'": 1, "Y'": 0})
    path = ap.solve(ap.Scene(system=system, values={"eps": "1/10"}, start=start, until=4))
    assert (path.modes, path.events) == (("closed",), ())
    assert path.final[0] == pytest.approx(math.sin(4))


@pytest.mark.parametrize("power", ["3/2", "7/2", "16/3"])
@pytest.mark.parametrize("method", ["exact", "radau"])
def test_an_unloaded_elastic_contact_holds_a_block_whose_push_grows_by_a_root_and_more_slowly_than_its_load(
    power, method
):
    """The load grows as t, and the push was decided on shortly after t = 0, where it stood against no load yet."""
    push = T ** sp.Rational(power)
    block = ap.Mechanism.from_lagrangian((X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 - Y, (X, Y), forces={X: push},
                                         contact=ap.Contact(Y, X, sp.Rational(2, 5), unilateral=True))
    system = block.elastic(compliance=eps**2, damping=eps)
    start = block.start(system, dict.fromkeys(("X", "Y", "X'", "Y'"), 0))
    path = ap.solve(ap.Scene(system=system, values={"eps": "1/10"}, start=start, until="1/2"), method)
    decay, swing = math.exp(-2.5), 5 * math.sqrt(3) / 2
    height = 1 - decay * (math.cos(swing) + math.sin(swing) / math.sqrt(3))
    assert (path.modes, path.final[0]) == (("stick",), 0)
    assert path.final[path.names.index("x")] == pytest.approx(height, abs=1e-8)
