"""The jump through the paradox: its law against the elastic contact, followed from Newton's law in numbers."""

import math
from importlib import import_module

import numpy as np
import pytest
import sympy as sp
from contactmodel import Model, follow
from mechanisms import slender_rod
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.errors import InputError, NotDerivable, OutOfRange, UnknownName
from asympk.mechanics import stops

T = dynamicsymbols._t


def bead_rod():
    """A slender rod of the half length 1 and mass 1, its end a bead on a rough straight wire; two-sided."""
    rod = slender_rod(unilateral=False)

    def terms(q, u):
        s, c = np.sin(q[2]), np.cos(q[2])
        W = np.array([[0.0, 1.0, -c], [1.0, 0.0, s]])
        turning = np.array([s, c]) * u[2] ** 2
        return np.diag([1.0, 1.0, 1 / 3]), np.array([0.0, -1.0, 0.0]), W, turning, q[1] - s, 1.0

    rates = {"X'": -1.0 - 0.3 * np.sin(1.1), "Y'": 0.3 * np.cos(1.1), "theta'": 0.3}
    state = {"X": 0.0, "Y": np.sin(1.1), "theta": 1.1}, rates
    return rod, {"m": 1, "l": 1, "g": 1, "f": 2}, terms, 2.0, state


def masses_on_a_parabola():
    """A mass on a rough straight guide joined by a damped rod to one on a smooth parabola; the rod is the contact."""
    a, b = dynamicsymbols("a b")
    f, P = sp.symbols("f P", positive=True)
    height = 1 + b**2 / 4
    length = sp.sqrt((b - a) ** 2 + height**2)
    kinetic = (a.diff(T) ** 2 + b.diff(T) ** 2 + height.diff(T) ** 2) / 2
    contact = ap.Contact(gap=length - sp.sqrt(2), slip=a, friction=f, load=height / length)
    rod = ap.Mechanism.from_lagrangian(kinetic, (a, b), contact=contact, forces={a: P})

    def terms(q, u):
        h, rise = 1 + q[1] ** 2 / 4, q[1] / 2
        along = np.array([q[0] - q[1], q[1] - q[0] + h * rise])
        r = np.hypot(q[1] - q[0], h)
        second = np.array([[1.0, -1.0], [-1.0, 1.0 + rise**2 + h / 2]])
        bend = u @ second @ u / r - (along @ u) ** 2 / r**3
        W = np.array([along / r, [1.0, 0.0]])
        M = np.diag([1.0, 1.0 + rise**2])
        return M, np.array([1.0, -rise * u[1] ** 2 / 2]), W, np.array([bend, 0.0]), r - np.sqrt(2), h / r

    rate = terms(np.array([-1.0, 0.0]), np.zeros(2))[2][0]
    state = {"a": -1.0, "b": 0.0}, {"a'": -1.0, "b'": rate[0] / rate[1]}
    return rod, {"f": 5, "P": 1}, terms, 5.0, state


def arm_along_a_wall():
    """A two-link arm, its tip in a rough slot along a wall: no cyclic coordinate, a mass matrix that turns."""
    a, b = dynamicsymbols("a b")
    f, P = sp.symbols("f P", positive=True)
    kinetic = sp.Rational(2, 3) * a.diff(T) ** 2 + b.diff(T) ** 2 / 6 + a.diff(T) * b.diff(T) * sp.cos(a - b) / 2
    contact = ap.Contact(gap=sp.cos(a) + sp.cos(b) - 1, slip=sp.sin(a) + sp.sin(b), friction=f)
    arm = ap.Mechanism.from_lagrangian(kinetic, (a, b), contact=contact, forces={a: P})

    def terms(q, u):
        s, c, turn = np.sin(q), np.cos(q), np.sin(q[0] - q[1]) / 2
        M = np.array([[4 / 3, np.cos(q[0] - q[1]) / 2], [np.cos(q[0] - q[1]) / 2, 1 / 3]])
        Q = np.array([1.0 - turn * u[1] ** 2, turn * u[0] ** 2])
        return M, Q, np.array([-s, c]), np.array([-c, -s]) @ u**2, c.sum() - 1, 1.0

    tilt = np.arccos(1 - np.cos(1.25))
    state = {"a": 1.25, "b": tilt}, {"a'": 1.0, "b'": -np.sin(1.25) / np.sin(tilt)}
    return arm, {"f": 2, "P": 1}, terms, 2.0, state


MECHANISMS = (bead_rod, masses_on_a_parabola, arm_along_a_wall)
EACH = [*MECHANISMS[:2], pytest.param(arm_along_a_wall, marks=pytest.mark.slow)]
h = 0.5


def _end(terms, friction, state, c):
    """Return q and u of the elastic contact a few layers after the start, and the elastic reaction x there."""
    q, u = (np.array([*part.values()]) for part in state)
    model = Model(terms, friction, 1 / c, h)
    until = 8 * c * np.log(1 / c)
    _, q, u = follow(model, q, u, until)
    return q, u, -terms(q, u)[4] / c


def _errors(make, c):
    """Return the errors of the jump law, coordinates, velocities and x, divided by c log(1/c)."""
    rod, parameters, terms, friction, state = make()
    values = {**parameters, **state[0], **state[1]}
    law = rod.jump_law(damping=sp.Rational(1, 2))
    after = [rod.evaluate(law.velocities[rate], values) for rate in rod.velocities]
    q, u, x = _end(terms, friction, state, c)
    start = np.array([*state[0].values()])
    return np.array([*(q - start), *(u - after), x - rod.evaluate(law.reaction, values)]) / (c * np.log(1 / c))


@pytest.mark.parametrize("make", EACH)
@pytest.mark.few(1)
def test_errors_of_the_jump_law_over_c_log_c_tend_to_constants(make):
    """Coordinates, every velocity and x: error = c (A log(1/c) + B + ..), so error / (c log(1/c)) settles as 1/log."""
    rod, parameters, _, _, (q, u) = make()
    assert rod.motions({**parameters, **q, **u}) == ()
    first, second, third = (_errors(make, c) for c in (1e-5, 1e-6, 1e-7))
    assert np.abs(third).max() < 40
    for early, late, last in zip(first, second, third, strict=True):
        assert abs(last - late) < 0.8 * abs(late - early) + 1e-4
        assert abs(last - late) < 0.2 * abs(last)


@pytest.mark.parametrize("make", EACH)
@pytest.mark.few(1)
def test_impulses_lie_in_the_cone_exactly_where_there_is_a_paradox(make):
    rod, parameters, _, _, (q, u) = make()
    law, rng = rod.jump_law(), np.random.default_rng(3)
    for friction in rng.uniform(0.1, 4, 30):
        values = {**parameters, **q, **u, "f": friction}
        paradox = friction > rod.evaluate(rod.critical_friction, values)
        for condition in (law.cone, law.condition, rod.paradox):
            assert rod.evaluate(condition, values) == paradox


def test_after_the_jump_the_contact_neither_slides_nor_opens():
    """W' q' = 0 for the velocities after, identically in every symbol: the two conditions that fix the impulses."""
    rod = slender_rod(unilateral=False)
    law = rod.jump_law()
    for rate, expected in ((rod.contact.gap.diff(T), 0), (rod.contact.slip.diff(T), 0)):
        gained = rate.subs(law.velocities, simultaneous=True) - expected
        before = rate if rate == rod.contact.gap.diff(T) else 0
        assert sp.simplify(gained - before) == 0


def test_painleve_and_kleins_jump_is_z_to_0_and_x_to_x_minus_z():
    """In the scales of section 2, time h, reaction P / cos(alpha), velocity P h / m: x -> x - z."""
    from mechanisms import masses_between_guides

    rod = masses_between_guides()
    m, P, alpha, h_ = (sp.Symbol(name, positive=True) for name in ("m", "P", "alpha", "h"))
    law, z = rod.jump_law(), sp.Symbol("z")
    x1 = rod.coordinates[0]
    gain = law.reaction.subs(x1.diff(T), z * P * h_ / m) / (P / sp.cos(alpha))
    assert sp.simplify(gain + z) == 0
    assert sp.simplify(law.velocities[x1.diff(T)]) == 0


@pytest.mark.parametrize("unilateral", [True, False])
def test_the_law_holds_where_the_gap_rests_to_six_digits_and_not_for_a_collision(unilateral):
    """A start that collides was promised the jump of a closed contact, though it takes g' with it."""
    rod = slender_rod(unilateral)
    at = {"m": 1, "l": 1, "g": 1, "f": 2, "theta": "1.1", "X'": -1, "theta'": "0.3"}
    rates = (0.3 * np.cos(1.1), "0.136079", "0.1361", 0, 1)
    assert [rod.evaluate(rod.jump_law().condition, {**at, "Y'": rate}) for rate in rates] == [True, True] + 3 * [False]


def test_no_jump_where_slip_and_gap_do_not_couple():
    a, b = dynamicsymbols("a b")
    contact = ap.Contact(gap=b, slip=a, friction=2)
    block = ap.Mechanism.from_lagrangian((a.diff(T) ** 2 + b.diff(T) ** 2) / 2, (a, b), contact=contact)
    assert (block.critical_friction, block.evaluate(block.critical_friction, {})) == (sp.oo, math.inf)
    assert block.paradox == sp.false
    assert block.jump_law().condition == sp.false


def _rod_on_the_ground(theta, friction, rate=0.2):
    """The slender rod, its end sliding backwards with unit speed on ground that only pushes."""
    _, _, terms, _, _ = bead_rod()
    q = {"X": 0.0, "Y": np.sin(theta), "theta": theta}
    u = {"X'": -1.0 - rate * np.sin(theta), "Y'": rate * np.cos(theta), "theta'": rate}
    return terms, q, u, {"m": 1, "l": 1, "g": 1, "f": friction, **q, **u}


@pytest.mark.parametrize(("theta", "friction", "ratio"), [(1.1, 2.0, 1), (0.9, 3.0, 0), (1.2, 1.8, 4)])
@pytest.mark.few(1)
def test_impact_without_collision_rebounds_as_the_law_says(theta, friction, ratio):
    """The gap rate and the change of theta' of the stiff contact tend to the law's like 1/kappa."""
    terms, q, u, values = _rod_on_the_ground(theta, friction)
    rod = slender_rod()
    law = rod.jump_law(ratio=ratio)
    expected = [rod.evaluate(law.gap_rate, values), rod.evaluate(law.velocities[rod.velocities[2]], values)]
    errors = []
    for kappa in (1e3, 1e4, 1e5):
        model = Model(terms, friction, kappa**2, ratio / kappa, unilateral=True)
        opened = lambda q, u, k=kappa: -terms(q, u)[4] * k - ratio * terms(q, u)[2][0] @ u  # noqa: E731
        at, rates = np.array([*q.values()]), np.array([*u.values()])
        _, at, rates = follow(model, at, rates, 200 / kappa * np.log(kappa), opened)
        errors.append(np.abs([terms(at, rates)[2][0] @ rates - expected[0], rates[2] - expected[1]]))
    assert np.all(errors[1] < 0.3 * errors[0])
    assert np.all(errors[2] < 0.3 * errors[1])


def test_rebound_tends_to_the_undamped_and_to_the_overdamped_limit():
    """b -> 0: sqrt(p (p - p_s)) / |q|; b -> oo: |G_NT| / (D b^2), whatever the friction."""
    values = _rod_on_the_ground(1.1, 2.0)[3]
    rod = slender_rod()
    G = [[rod.evaluate(rod.delassus[i, j], values) for j in (0, 1)] for i in (0, 1)]
    D = G[0][0] * G[1][1] - G[0][1] ** 2
    p, stick, mixed = G[0][0] - 2 * abs(G[0][1]), D / G[1][1], G[0][1] + 2 * G[1][1]
    rate = lambda ratio: rod.evaluate(rod.jump_law(ratio=ratio).gap_rate, values)  # noqa: E731
    assert rate(0) == pytest.approx(np.sqrt(p * (p - stick)) / abs(mixed), rel=1e-13)
    assert rate(sp.Rational(1, 10**6)) == pytest.approx(rate(0), rel=1e-5)
    assert rate(10**4) * 1e8 == pytest.approx(abs(G[0][1]) / D, rel=1e-6)


def test_a_rod_however_heavy_rebounds_as_a_light_one_without_damping():
    rod, values = slender_rod(), _rod_on_the_ground(1.1, 2.0)[3]
    rate = rod.jump_law(ratio=0).gap_rate
    light, heavy = (rod.evaluate(rate, values | {"m": mass}) for mass in ("1", "1e300"))
    assert heavy == pytest.approx(light, rel=1e-13)
    assert light > 0


def test_rebound_is_continuous_where_stick_is_critically_damped():
    values = _rod_on_the_ground(1.1, 2.0)[3]
    rod = slender_rod()
    critical = 2 / np.sqrt(4 / rod.evaluate(rod.delassus[1, 1], values))
    near = [sp.Rational(round(critical * 10**9) + k, 10**9) for k in (-1000, 1000)]
    low, high = (rod.evaluate(rod.jump_law(ratio=b).gap_rate, values) for b in near)
    assert low > high > 0
    assert low == pytest.approx(high, rel=1e-5)


def test_a_decimal_as_damping_or_ratio_is_the_rational_of_its_value():
    """A ratio of 0.5 was refused; with a damping time of 0.5 a law was returned that could not be evaluated."""
    values, rod = _rod_on_the_ground(1.1, 2.0)[3], slender_rod()
    laws = [(rod.jump_law(ratio=half).gap_rate, rod.jump_law(damping=half).reaction, half * rod.contact.gap)
            for half in (0.5, sp.Rational(1, 2))]
    decimal, exact = ([rod.evaluate(part, values) for part in law] for law in laws)
    assert decimal == exact


def test_a_ratio_of_pieces_rebounds_as_that_of_the_piece_that_holds():
    values, rod, b = _rod_on_the_ground(1.1, 2.0)[3], slender_rod(), sp.Symbol("b", positive=True)
    rate = rod.jump_law(ratio=sp.Piecewise((1, b < 2), (4, True))).gap_rate
    found = rod.evaluate(rate, {**values, "b": np.array([1, 3])})
    assert found == pytest.approx([rod.evaluate(rod.jump_law(ratio=k).gap_rate, values) for k in (1, 4)], rel=1e-13)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: slender_rod(unilateral=False).jump_law(ratio=1), "a two-sided constraint never opens"),
        (lambda: slender_rod().jump_law(ratio=-1), "zero or positive"),
        (lambda: slender_rod().jump_law(ratio=-sp.oo), "zero or positive"),
        (lambda: slender_rod().jump_law(ratio=1e160), r"\.\.\.: doubles do not hold its square"),
        (lambda: slender_rod().jump_law(ratio=sp.exp(sp.exp(sp.exp(100)))), "a number in it is beyond the range of"),
        (lambda: slender_rod().jump_law(ratio=1, damping=1), "both given"),
        (lambda: slender_rod().jump_law(ratio=sp.Piecewise((1, sp.Symbol("b") < 2))), "end it with one that does"),
        *((lambda damping=damping: slender_rod().jump_law(damping=damping), "it must be a positive time")
          for damping in (0, -1, sp.oo, -sp.oo, sp.nan)),
    ],
)
def test_a_law_that_is_none_is_refused(make, match):
    with pytest.raises(InputError, match=match):
        make()


LONG = ("arm", "crank_slider")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in ap.systems.MECHANISMS]
)
@pytest.mark.few(2)
def test_an_impact_balances_momentum_and_is_written_without_the_fractions_of_the_delassus_matrix(name):
    kinetics = import_module(f"asympk.systems.{name}").mechanism().plain
    W, n = kinetics.directions, len(kinetics.velocities)
    impact = kinetics.gap_impact.row_join(kinetics.slip_impact)
    gains, impulses = impact[:n, :], -impact[n:, :]
    assert (kinetics.mass * gains - W.T * impulses).applyfunc(sp.simplify) == sp.zeros(n, 2)
    assert (W * gains).applyfunc(sp.simplify) == sp.eye(2)
    assert max(part.count_ops() for part in impact) < 50


@pytest.mark.further
def test_the_squares_of_sine_and_cosine_in_a_factor_of_a_law_add_up_to_1():
    X, Y, phi = dynamicsymbols("X Y phi")
    a, b, m, f = sp.symbols("a b m f", positive=True)
    kinetic = m * (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + m * (a**2 + b**2) / 6 * phi.diff(T) ** 2
    edge = ap.Contact(gap=Y - b * sp.cos(phi) - a * sp.sin(phi), slip=X + a * sp.cos(phi) - b * sp.sin(phi), friction=f)
    law = ap.Mechanism.from_lagrangian(kinetic, (X, Y, phi), contact=edge).jump_law()
    gains = (after - before for before, after in law.velocities.items())
    assert {sp.denom(part) for part in (*law.impulses, *gains)} == {4 * (a**2 + b**2)}


@pytest.mark.parametrize("ratio", [0, 1, 2])
def test_a_block_which_has_no_paradox_has_a_law_that_holds_nowhere_and_no_rebound(ratio):
    """At h = 2 sqrt(c) its contact is damped critically, and the formula of a rebound would divide by 0."""
    x, y = dynamicsymbols("x y")
    ground = ap.Contact(gap=y, slip=x, friction=1, unilateral=True)
    block = ap.Mechanism.from_lagrangian((x.diff(T) ** 2 + y.diff(T) ** 2) / 2 - y, (x, y), contact=ground)
    law = block.jump_law(ratio=ratio)
    assert (law.condition, law.gap_rate) == (sp.false, 0)


def test_impulses_are_written_as_multiples_of_the_sliding_velocity_and_not_of_its_opposite():
    rod = slender_rod()
    assert all(rod.sliding_velocity in sp.Mul.make_args(impulse) for impulse in rod.jump_law().impulses)


@pytest.mark.further
def test_the_determinant_of_long_fractions_is_short_and_that_of_the_delassus_matrix():
    a, u, _ = q = dynamicsymbols("phi u_a theta")
    p, v, w = (coordinate.diff(T) for coordinate in q)
    m, n, f = sp.symbols("m0 m2 f", positive=True)
    L = m * p**2 / 2 + n * (4 * p**2 + w**2) / 2 + (3 * u * v / 2 + w / 5) ** 2 / 4 + (w - p) ** 2 / 10
    L += (17 * sp.cos(u) * v / 10 + 6 * p / 5) ** 2 / 5 + p**2 + 7 * v**2 / 5
    contact = ap.Contact(gap=-sp.cos(a), slip=v - p - 9 * w / 10, friction=f)
    kinetics = ap.Mechanism.from_lagrangian(L, q, contact=contact).plain
    place = {s: sp.Rational(k + 3, 4) for k, s in enumerate(sorted(kinetics.delassus.free_symbols, key=str))}
    G = kinetics.delassus.subs(place).evalf(30)
    assert abs(kinetics.determinant.subs(place).evalf(30) - (G[0, 0] * G[1, 1] - G[0, 1] ** 2)) < 1e-25
    assert kinetics.determinant.count_ops() < 100


def test_the_damping_of_the_law_is_not_a_parameter_of_the_same_name():
    X, Y = sp.symbols("X Y")
    height = sp.Symbol("h", positive=True)
    block = ap.Mechanism((X, Y), sp.symbols("U V"), [[height, 1], [1, 1]], (0, -1), ap.Contact(Y, X, 2))
    law = block.jump_law()
    (damping,) = (law.reaction / law.impulses[0]).cancel().free_symbols
    assert damping.name == "h_"


w, P = sp.symbols("speed P", positive=True)
LOWER_WHEN_SLOW = sp.Piecewise((1, w < sp.Rational(1, 2)), (2, True))


def _leaning(law, load=1):
    """A slender rod that leans into its motion, with friction by the speed of its end, and where it is."""
    X, Y, theta = dynamicsymbols("X Y theta")
    slip = X - sp.cos(theta) / 2
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + theta.diff(T) ** 2 / 24 - Y
    friction = law.subs(w, sp.Abs(slip.diff(T)))
    contact = ap.Contact(gap=Y - sp.sin(theta) / 2, slip=slip, friction=friction, load=load, unilateral=True)
    rod = ap.Mechanism.from_lagrangian(energy, (X, Y, theta), contact=contact)
    return rod, {"X": 0, "Y": sp.sin(sp.Rational(11, 10)) / 2, "theta": "1.1", "X'": -1, "Y'": 0, "theta'": 0}


LINEAR, STRIBECK = sp.Rational(9, 10) + w, sp.Rational(2, 5) * (2 + sp.exp(-w) + w)
DIP = 3 - sp.Rational(14, 5) * sp.exp(-(10 * (w - 2) / 3) ** 2)


@pytest.mark.parametrize(
    ("law", "slides_on", "stops"),
    [(1 + w, "0.765", "0.767"), (LOWER_WHEN_SLOW, "1", "1.2"), (LINEAR, "1", "1.2"), (STRIBECK, "1.2", "3"),
     (DIP, "3", "1.5"), (sp.Rational(1, 2) + w, "3", None), (1 + sp.exp(-w), None, "1")],
)
@pytest.mark.few(2)
def test_friction_that_falls_below_the_critical_one_stops_a_contact_that_is_still_pressed_in_and_no_other(
    law, slides_on, stops
):
    """For a + w and a law with a jump the condition was sufficient alone, or there was none; the critical one is 1.33.

    For 1 + w the speeds between are those at which log(1 + v/0.6415) = v/0.975.
    """
    rod, start = _leaning(law)
    c, stiff, found = sp.Symbol("c", positive=True), 1e-8, rod.jump_law()
    soft = rod.elastic(compliance=c, damping=sp.Rational(1, 2))
    for speed in filter(None, (slides_on, stops)):
        at = {**start, "X'": f"-{speed}"}
        start_of_run, until = rod.start(soft, at), 40 * stiff * np.log(1 / stiff)
        path = ap.solve(ap.Scene(system=soft, values={c: stiff}, start=start_of_run, until=until))
        assert ("stick" in path.modes) == rod.evaluate(found.condition, at) == (speed == stops)
        if speed == stops:
            after = {str(rate): rod.evaluate(value, at) for rate, value in found.velocities.items()}
            assert path.final[path.names.index("theta'")] == pytest.approx(after["Derivative(theta(t), t)"], abs=1e-3)


def test_the_condition_of_a_law_by_the_speed_is_told_for_arrays_of_speeds_and_parameters():
    f, k = sp.symbols("f k", positive=True)
    rod, start = _leaning(f + k * w)
    law = rod.jump_law()
    speeds = {**start, "f": 1, "X'": np.array([-0.5, -0.765, -0.767, -2.0])}
    assert rod.evaluate(law.condition, {**speeds, "k": 1}).tolist() == [False, False, True, True]
    assert rod.evaluate(law.condition, {**start, "f": np.array([0.9, 1.4]), "k": np.array([[0.1], [2]])}).tolist() == [
        [False, True], [True, True]]
    assert rod.evaluate(sp.Not(law.condition), {**speeds, "k": 1}).tolist() == [True, True, False, False]
    assert not rod.evaluate(sp.Not(law.condition), {**start, "f": 1, "k": 1})
    assert "Stops" in str(law.condition)
    assert law.velocities == _leaning(sp.Integer(2))[0].jump_law().velocities


def test_the_condition_at_many_speeds_is_that_in_closed_form_and_takes_few_calls(monkeypatch):
    """Each speed was followed by itself, in 70 ms: 1000 of them took over a minute."""
    calls, k, gain = [], sp.Symbol("k", positive=True), stops._gains
    monkeypatch.setattr(stops, "_gains", lambda *of: (calls.append(1), gain(*of))[1])
    rod, start = _leaning(1 + k * w)
    v, k_0 = np.linspace(0.4, 4, 1000), 1.3
    holds = rod.evaluate(rod.jump_law().condition, {**start, "X'": -v, "k": k_0})
    normal, mixed, tangential = (float(rod.evaluate(part, start)) for part in (rod.delassus[0], abs(rod.delassus[1]),
                                                                               rod.delassus[3]))
    lost = normal * tangential - mixed**2
    closed = lost * np.log(((1 + k_0 * v) * tangential - mixed) / (tangential - mixed)) < k_0 * tangential * mixed * v
    assert 0 < closed.sum() < 1000
    assert holds.tolist() == closed.tolist()
    assert len(calls) < 200
    assert rod.evaluate(rod.jump_law().condition, {**start, "X'": np.array([]), "k": 1}).shape == (0,)


def test_a_friction_that_changes_too_often_with_the_speed_is_refused_at_once():
    rod, start = _leaning(2 + sp.sin(10**7 * w))
    with pytest.raises(NotDerivable, match="friction changes too often as the contact slows down"):
        rod.evaluate(rod.jump_law().condition, start)


@pytest.mark.parametrize("law", [2 + w + 1 / w, 2 + w * sp.log(w), 2 + sp.sqrt(w - sp.Rational(1, 2))])
def test_friction_without_a_value_at_rest_has_no_law_and_a_rebound_needs_friction_without_the_speed(law):
    with pytest.raises(NotDerivable, match="has no value at rest"):
        _leaning(law)[0].jump_law()
    with pytest.raises(NotDerivable, match="rebound is known where it does not"):
        _leaning(1 + w)[0].jump_law(ratio=1)


@pytest.mark.parametrize("given", ["damping", "ratio"])
def test_a_damping_by_a_velocity_that_jumps_has_no_law_and_one_by_another_has(given):
    """With h = (1 + U^2)/2 x gained 1.0 by the law, and 1 + pi/4 by Newton's."""
    X, Y, _, U, V, W = q = sp.symbols("X Y Z U V W", real=True)
    contact = ap.Contact(Y, X, 3, unilateral=True)
    block = ap.Mechanism(q[:3], q[3:], [[2, 1, 0], [1, 1, 0], [0, 0, 1]], (0, -1, 0), contact)
    for damping in (1 + U**2, 1 + (V - X) ** 2, sp.Piecewise((1, U < -1), (2, True))):
        with pytest.raises(NotDerivable, match=r"[UV] changes during the jump, and the damping"):
            block.jump_law(**{given: damping})
    for damping in (1 + W**2, 1 + X**2):
        assert block.jump_law(**{given: damping}).condition != sp.false
    with pytest.raises(InputError, match="the mechanism has another U"):
        block.jump_law(**{given: sp.Symbol("U", positive=True)})


@pytest.mark.parametrize("given", ["damping", "ratio"])
def test_a_law_does_not_hold_where_its_damping_is_negative(given):
    """At X = 2 the law with h = 1 - X^2 held, and x gained -1/3."""
    X, Y, U, V = sp.symbols("X Y U V", real=True)
    block = ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, X, 3, unilateral=True))
    condition = block.jump_law(**{given: 1 - X**2}).condition
    assert [block.evaluate(condition, {X: at, Y: 0, U: -1, V: 0}) for at in (0, 2)] == [True, False]


def test_a_damping_without_a_value_at_some_places_is_refused():
    """It was taken for positive where it has no value, and the law held there."""
    rod = slender_rod()
    with pytest.raises(InputError, match="no value where no piece"):
        rod.jump_law(damping=sp.Piecewise((1, rod.coordinates[0] > 0)))


def test_a_damping_by_a_rate_that_jumps_is_recognised_by_the_rate_of_a_dynamicsymbol():
    rod = slender_rod()
    with pytest.raises(NotDerivable, match="theta' changes during the jump"):
        rod.jump_law(damping=1 + rod.velocities[2] ** 2)
    assert rod.jump_law(damping=1 + rod.coordinates[2] ** 2).reaction.has(rod.coordinates[2])


def test_a_law_does_not_hold_where_static_friction_is_below_the_kinetic_one_at_rest():
    """The condition did not contain static friction, and held for a negative one."""
    X, Y, U, V, f, f_s = sp.symbols("X Y U V f f_s", real=True)
    laws = [(f, f_s), (f + sp.Abs(U), f_s), (f, f_s - sp.Abs(V - U)), (f, f_s + sp.sign(U))]
    for kinetic, static in laws:
        block = ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, X, kinetic, static=static))
        at = {X: 0, Y: 0, U: -1, V: 0, f: 3}
        holds = [block.evaluate(block.jump_law().condition, {**at, f_s: value}) for value in ("7/2", "14/5", -3)]
        assert holds == [True, False, False]
    for static in (1 / U, 3 + sp.sqrt(U**2 - 1)):  # of the second a TypeError told of a number that is not real
        with pytest.raises(NotDerivable, match="has no value at rest"):
            ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, X, f, static=static)).jump_law()


@pytest.mark.parametrize("way", [1, -1])
def test_friction_that_falls_below_the_critical_one_as_sliding_one_way_slows_down_has_a_law_of_that_way(way):
    X, Y, U, V = sp.symbols("X Y U V")
    law = sp.Rational(1, 2) + sp.exp(way * U)
    block = ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, X, law))
    holds = [block.evaluate(block.jump_law().condition, {X: 0, Y: 0, U: U_0, V: 0}) for U_0 in (1, -1)]
    assert holds == [way * U_0 > 0 for U_0 in (1, -1)]


def test_an_elastic_contact_with_a_dip_of_friction_of_any_rational_width_is_derived_at_once():
    """Its exponential was split into one for each term of the exponent, powers of one of a degree of thousands."""
    dip = sp.exp(-((sp.Rational(100, 37) * w - sp.Rational(41, 37)) ** 2))
    rod, _ = _leaning(sp.Rational(79, 50) - sp.Rational(67, 50) * dip)
    assert rod.elastic(compliance=sp.Symbol("c", positive=True), damping=1).friction.kinetic.has(sp.exp)


def test_a_term_of_a_contact_that_is_not_real_at_a_place_is_named():
    X, Y, U, V = sp.symbols("X Y U V", real=True)
    block = ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, X, 3 + sp.sqrt(1 - X**2)))
    at = {X: 2, Y: 0, U: -1, V: 0}
    law = block.jump_law()
    for ask in (block.motions, lambda at: block.evaluate(law.condition, at),
                lambda at: block.evaluate(law.condition, {**at, X: [0, 2, 0.5]})):  # the last place was named
        with pytest.raises(OutOfRange, match=r"X = 2, or beside it, where sqrt\(1 - X\*\*2\) is no finite real number"):
            ask(at)


def test_friction_that_acts_one_way_alone_has_its_law():
    """0 / 0 was compared with 0."""
    X, Y, U, V, f, v = sp.symbols("X Y U V f v")
    ways = [sp.Piecewise(pair, (0, True)) for pair in ((f, v < U), (f, U - v > 0))]
    blocks = [ap.Mechanism((X, Y), (U, V), [[2, 1], [1, 1]], (0, -1), ap.Contact(Y, U - v, way)) for way in ways]
    assert [block.jump_law().impulses for block in blocks] == 2 * [(v - U, 2 * v - 2 * U)]
    at = {"f": 3, "v": 1, "U": 2, "V": 0}
    assert all(block.evaluate(block.jump_law().condition, at) for block in blocks)
    assert not any(block.evaluate(block.jump_law().condition, {**at, "U": 0}) for block in blocks)


def test_a_factor_of_friction_whose_sign_is_not_told_does_not_hide_that_it_falls_with_the_speed():
    rod, _ = _leaning(sp.Symbol("f") * (1 + sp.exp(-w)))
    assert rod.jump_law().velocities == _leaning(sp.Integer(2))[0].jump_law().velocities


def test_a_law_is_evaluated_at_a_value_of_its_damping_which_the_mechanism_does_not_contain():
    rod, ratio = slender_rod(), sp.Symbol("b", positive=True)
    at = {"m": 1, "l": 1, "g": 1, "f": 2, "theta": "1.1", "X": 0, "Y": 1, "X'": -1, "Y'": 0, "theta'": 0}
    damped, rebounding = rod.jump_law(), rod.jump_law(ratio=ratio)
    impulse = rod.evaluate(damped.impulses[0], at)
    assert rod.evaluate(damped.reaction, {**at, "h": "1/4"}) == pytest.approx(4 * impulse)
    expected = rod.evaluate(rod.jump_law(ratio=sp.Rational(1, 2)).gap_rate, at)
    assert rod.evaluate(rebounding.gap_rate, {**at, ratio: "1/2"}) == pytest.approx(expected)
    with pytest.raises(UnknownName, match="k is no coordinate"):
        rod.evaluate(damped.reaction, {**at, "h": 1, "k": 1})
