"""Loads that are powers of the penetration, as that of Hertz: real while a contact is open, and followed through it."""

import math

import mpmath
import pytest
import sympy as sp
from scipy.integrate import quad, solve_ivp

import asympk as ap
from asympk.errors import OutOfRange
from asympk.symbolic.expansion import is_zero
from asympk.symbolic.lowering import lower
from asympk.symbolic.penetration import Penetration, RootSlope, with_finite_powers, with_penetration

x, v, y, place, F, N = sp.symbols("x v y place F N", real=True)
K, p, mu = sp.symbols("K p mu", positive=True)
HERTZ = sp.Rational(3, 2)


def ball(load, gap=x, push=0, static=None):
    """A ball of mass 1 and weight 1 over rough ground, with a tangential velocity y that friction 1/5 turns down."""
    contact = ap.Friction(velocity=y, force=F, load=load, kinetic=sp.Rational(1, 5), static=static, gap=gap, normal=N)
    return ap.System.with_frictions({x: v, v: -1 + N, y: F + push * N}, {}, [contact])


def test_the_most_negative_power_of_a_penetration_is_what_makes_all_of_them_finite():
    depth, other = Penetration(-x), Penetration(-v)
    expr = depth**-HERTZ + 3 / sp.sqrt(depth) + sp.sqrt(other) / depth - depth / other
    expected = other + 3 * depth * other + other**HERTZ * sp.sqrt(depth) - depth ** (1 + HERTZ)
    assert sp.expand(with_finite_powers(expr) - expected) == 0
    assert sp.expand(with_finite_powers(expr / (1 + y**2)) - expected / (1 + y**2)) == 0


SIZES = sp.Max(-x, 0), -sp.Min(x, 0), sp.Abs(x)


@pytest.mark.parametrize(
    "load", [*(size**HERTZ for size in SIZES), (-x) ** HERTZ, (-2 * x) ** HERTZ / 2**HERTZ, -x * sp.sqrt(-x)]
)
def test_one_penetration_is_meant_by_every_way_to_write_it(load):
    assert sp.expand_power_base(with_penetration(load, x), force=True) in (
        Penetration(-x) ** HERTZ, Penetration(-2 * x) ** HERTZ / 2**HERTZ)


def test_what_is_no_multiple_of_the_gap_and_whole_powers_stay():
    k = sp.Symbol("k", real=True)
    others = sp.Max(x, 0), sp.Max(1, -x), sp.Min(-x, 0), sp.Abs(v), sp.Abs(k * x)
    for load in (*others, x**HERTZ, (k * x) ** HERTZ, (1 - x) ** HERTZ, (-x) ** 3, -K * x):
        assert with_penetration(load, x) == load


def test_the_slope_of_a_root_has_its_value_at_numbers_and_is_told_from_zero_by_it():
    half = sp.Rational(1, 2)
    assert RootSlope(sp.sin(1), sp.Integer(2), -half).evalf(30) == (sp.sin(1) / sp.sqrt(2)).evalf(30)
    assert RootSlope(0, 0, -half).evalf() == 0
    slope = RootSlope(sp.sin(x) - v, x**2 + v**2, -half)
    assert not is_zero(slope)
    assert is_zero(slope * sp.sqrt(x**2 + v**2) - sp.sin(x) + v)


@pytest.mark.parametrize("target", ["numpy", "math", "mpmath"])
def test_a_penetration_is_zero_while_the_contact_is_open(target):
    depth = lower((x,), Penetration(-x) ** HERTZ / 2, target)
    assert depth(4) == 0
    assert float(depth(-4)) == 4
    assert "((-x) < 0.0 ? 0.0 : (-x))" in lower((x,), Penetration(-x), "c")


@pytest.mark.parametrize("target", ["numpy", "math", "mpmath"])
def test_an_infinite_slope_of_a_load_is_left_out_at_the_opening(target):
    depth = Penetration(-x)
    load = lower((x,), (depth ** sp.Rational(1, 4), depth.diff(x) / sp.sqrt(depth), depth ** (-p).subs(p, 2)), target)
    assert [float(value) for value in load(-16)] == [2, -0.25, 2**-8]
    assert [float(value) for at in (0, 4) for value in load(at)] == [0] * 6
    assert "(-x > 0 ? " in lower((x,), 1 / sp.sqrt(depth), "c")


@pytest.mark.parametrize("target", ["numpy", "math", "mpmath"])
@pytest.mark.parametrize("power", [HERTZ, sp.Rational(1, 2), -sp.Rational(1, 2)])
def test_a_power_of_a_penetration_that_is_no_number_is_refused(power, target):
    """As 0 it would hide that a state is lost."""
    with pytest.raises(OutOfRange, match="is not a finite real number at x = nan"):
        lower((x,), (Penetration(-x) ** power,), target)(math.nan)


def test_a_gap_beside_the_penetration_leaves_the_slope_of_a_load_finite_at_a_touch_down():
    load = (1 - x) * (5 * sp.sqrt(2 - 2 * x) + 7 * v)
    meant = with_penetration(load, x - 1)
    assert meant.diff(x).subs(x, 1) == -7 * v
    assert sp.simplify((meant - load).subs(x, -3)) == 0


def lift_off():
    """When a ball dropped from 1 leaves again: its contact lasts twice the quadrature of the way down."""
    deepest = float(mpmath.findroot(lambda d: 2 + 2 * d - 800 * d ** mpmath.mpf(2.5), 0.08))
    speed = lambda u: math.sqrt(2 + 2 * deepest * (1 - u * u) - 800 * (deepest * (1 - u * u)) ** 2.5)  # noqa: E731
    return math.sqrt(2) + 2 * quad(lambda u: 2 * deepest * u / speed(u), 0, 1, epsabs=1e-13)[0]


@pytest.mark.parametrize(("how", "tolerance"), [({}, 1e-8), ({"method": "radau"}, 1e-5), ({"digits": 10}, 1e-10)])
@pytest.mark.few(1)
def test_a_ball_on_hertz_s_law_bounces_as_the_quadrature_of_its_energy_says(how, tolerance):
    path = ap.solve(ap.Scene(system=ball(1000 * (-x) ** HERTZ), start={x: 1, v: 0, y: 1}, until=4), **how)
    assert path.modes == ("open", "slip_same", "open")
    fall, leave = (float(event.t) for event in path.events)
    assert (fall, leave) == pytest.approx((math.sqrt(2), lift_off()), abs=tolerance)
    after, (height, speed, slide) = 4 - leave, (float(w) for w in path.final)
    thrown = after * math.sqrt(2) - after**2 / 2, math.sqrt(2) - after
    assert (height, speed) == pytest.approx(thrown, abs=4 * tolerance)
    assert slide == pytest.approx(1 - (2 * math.sqrt(2) + leave - fall) / 5, abs=tolerance)


@pytest.mark.parametrize("method", ["exact", "radau", "lsoda", "digits"])
@pytest.mark.parametrize(("stiff", "power", "damped"), [(1000, 1.5, 0.5), (1000, 1.5, 0.25), (30, 0.5, None)])
@pytest.mark.few(2)
def test_loads_with_an_infinite_slope_at_the_opening_are_followed(method, stiff, power, damped):
    """Kuwabara and Kono's damping, Tsuji's, and a spring that is stiffest at first, against one smooth integration."""
    load = stiff * (-x) ** sp.Rational(power) - (20 * (-x) ** sp.Rational(damped) * v if damped else 0)
    scene = ap.Scene(system=ball(load), start={x: 0, v: -1, y: 2}, until="1/20")
    path = ap.solve(scene, digits=8) if method == "digits" else ap.solve(scene, method)

    def rates(t, state):
        depth, speed = max(0, -state[0]), state[1]
        push = stiff * depth**power - (20 * depth**damped * speed if damped else 0)
        return speed, push - 1, -push / 5

    meant = solve_ivp(rates, (0, 0.05), (0, -1, 2), "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    assert path.modes == ("slip_same",)
    assert [*map(float, path.final)] == pytest.approx(meant, abs=2e-5 if method in ("radau", "lsoda") else 1e-8)


@pytest.mark.parametrize(
    ("push", "after", "gained"),
    [("0", "stick", 0), ("1/10", "stick", 0), ("1/2", "slip_same", 0.3), ("-1/2", "slip_opposite", -0.3)],
)
def test_what_follows_a_touch_down_is_told_though_load_and_push_vanish_there(push, after, gained):
    """The push of half the load is held by friction of a fifth up to three tenths."""
    system = ball(K * (-x) ** p, push=sp.Rational(push))
    path = ap.solve(ap.Scene(system=system, values={K: 1000, p: "3/2"}, start={x: 1, v: 0, y: 0}, until=2))
    assert path.modes == ("open", after, "open")
    landed, left = (float(event.t) for event in path.events)
    impulse = 2 * math.sqrt(2) + left - landed
    assert path.final[2] == pytest.approx(gained * impulse, abs=1e-7)


@pytest.mark.parametrize("start", [pytest.param(0, marks=pytest.mark.further), 1])
def test_a_body_that_lands_at_rest_stays_at_rest_whether_its_friction_falls_with_the_velocity_or_not(start):
    """The body hangs on a slack spring; derivatives of the load that are infinite at touch-down stand over 5 + y^2."""
    load, finals = 1000 * (-x) ** HERTZ * (1 - v / 5), []
    for kinetic in (sp.Rational(1, 5), 1 / (5 + y**2)):
        contact = ap.Friction(velocity=y, force=F, load=load, kinetic=kinetic, gap=x, normal=N)
        system = ap.System.with_frictions({x: v, v: N - 1, place: y, y: F - 4 * place}, {}, [contact])
        path = ap.solve(ap.Scene(system=system, start={x: start, v: 0, place: 0, y: 0}, until=3))
        assert path.modes == (("open", "stick", "open") if start else ("stick",))
        finals.append(path.final)
    assert finals[0] == finals[1]
    assert finals[0][2:] == (0, 0)


def test_a_contact_of_hertz_and_of_a_small_time_has_its_slow_manifold_and_models():
    contact = ap.Friction(velocity=y, force=F, load=(-x) ** HERTZ * (1 - v), kinetic=sp.Rational(1, 5), gap=x, normal=N)
    soft = ap.System.with_frictions({y: F + sp.Rational(1, 10)}, {x: v, v: -1 + N}, [contact], small=mu)
    assert {plane.branch[x] for plane in ap.slow_manifolds(soft)} == {-1}
    scene = ap.Scene(system=soft, values={mu: "1e-3"}, start={x: "-1/2", v: 0, y: 1}, until=5)
    exact, jump = ap.solve(scene), ap.solve(scene, "jump", order=2)
    assert exact.modes == jump.modes
    assert list(jump.final) == pytest.approx(list(exact.final), abs=2 * jump.error)


WAYS = [{}, {"digits": 12}, {"method": "radau"}, {"method": "dop853"}]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("power", ["1/2", "3/2", *(pytest.param(p, marks=pytest.mark.slow) for p in ("1/3", "5/2"))])
@pytest.mark.few(2)
def test_a_spring_of_any_power_keeps_its_energy(power, way):
    power = sp.Rational(power)
    system = ap.System.smooth({x: v, v: -sp.sign(x) * sp.Abs(x) ** power}, {}, None)
    place, speed = map(float, ap.solve(ap.Scene(system=system, start=[1, 0], until=7), **way).final)
    depth = float(power) + 1
    assert speed**2 / 2 + abs(place) ** depth / depth == pytest.approx(1 / depth, abs=1e-4)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("start", "end"), [([0, 0, 1], [math.log(3) / 2, 0, 0]), ([0, 1, 0], [0, 1 / 4, 0]), ([0, 0, 0], [0, 0, 0])]
)
@pytest.mark.few(2)
def test_a_drag_by_the_square_of_the_velocity_ends_at_rest_or_along_its_way(start, end, way):
    """The drag |w| w has the slope 0 at w = 0; the velocity y along a rough guide falls as y' = -y^2 - 1/2."""
    s, speed = sp.Symbol("s", real=True), sp.sqrt(v**2 + y**2)
    rough = ap.Friction(velocity=y, force=F, load=1, kinetic=sp.Rational(1, 2))
    system = ap.System.with_frictions({s: y, v: -speed * v, y: -speed * y + F}, {}, [rough])
    path = ap.solve(ap.Scene(system=system, start=start, until=3), **way)
    assert [float(w) for w in path.final] == pytest.approx(end, abs=1e-5)


@pytest.mark.parametrize("way", WAYS)
def test_a_law_of_bouc_and_wen_begins_at_rest(way):
    """In loading z' = 1 - z^(3/2), so that the time is the integral of its inverse."""
    loading = v - (sp.Abs(v) * sp.sqrt(sp.Abs(y)) * y + v * sp.Abs(y) ** HERTZ) / 2
    system = ap.System.smooth({v: sp.Integer(0), y: loading}, {}, None)
    path = ap.solve(ap.Scene(system=system, start=[1, 0], until=2), **way)
    assert quad(lambda z: 1 / (1 - z**1.5), 0, float(path.final[1]))[0] == pytest.approx(2, abs=1e-4)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.few(1)
def test_a_friction_that_falls_with_the_root_of_the_velocity_ends_where_its_energy_does(way):
    """It slides v dv/dx = -(1 + exp(-sqrt(v)))/2 and stops, its root having no slope there."""
    rough = ap.Friction(velocity=v, force=F, load=1, kinetic=(1 + sp.exp(-sp.sqrt(sp.Abs(v)))) / 2, static=1)
    system = ap.System.with_frictions({x: v, v: F}, {}, [rough])
    path = ap.solve(ap.Scene(system=system, start=[0, 1], until=3), **way)
    assert path.modes == ("slip_same", "stick")
    length, _ = quad(lambda u: 2 * u / (1 + math.exp(-math.sqrt(u))), 0, 1)
    assert float(path.final[0]) == pytest.approx(length, abs=1e-5)


@pytest.mark.parametrize("load", [1000 * (-x) ** HERTZ, 1000 * (-x) ** HERTZ * (1 - v / 5)])
def test_a_ball_that_comes_down_beside_a_spring_without_tension_sticks(load):
    contact = ap.Friction(velocity=y, force=F, load=load, kinetic=sp.Rational(1, 2), gap=x, normal=N)
    s = sp.Symbol("s", real=True)
    held = ap.System.with_frictions({s: y, y: F - s, x: v, v: N - 1}, {}, [contact])
    path = ap.solve(ap.Scene(system=held, start={s: 0, y: 0, x: "1/10", v: 0}, until=1))
    assert path.modes == ("open", "stick", "open")
    assert path.final[:2] == (0, 0)


@pytest.mark.parametrize(
    ("load", "order", "first"),
    [(1000 * (-x) ** HERTZ, 1, "slip_same"), (1000 * (-x) ** HERTZ, 2, "stick"), (1000 * (-x) ** HERTZ, 3, "stick"),
     (10 * (-x) ** sp.Rational(1, 4), 1, "stick"), (1000 * (-x) ** HERTZ - 50 * sp.sqrt(-x) * v, 1, "stick")],
)
@pytest.mark.few(2)
def test_of_a_load_and_a_push_that_grow_from_nothing_the_lower_power_of_the_time_wins(load, order, first):
    """The penetration grows like t, the push like t^order."""
    pushes = sp.symbols(f"q:{order}", real=True)
    rates = dict(zip(pushes, (*pushes[1:], sp.S.One), strict=True))
    contact = ap.Friction(velocity=y, force=F, load=load, kinetic=sp.Rational(1, 2), gap=x, normal=N)
    pushed = ap.System.with_frictions({y: F + pushes[0], x: v, v: N - 1, **rates}, {}, [contact])
    start = {y: 0, x: 0, v: -1, **dict.fromkeys(pushes, 0)}
    assert ap.solve(ap.Scene(system=pushed, start=start, until="1/20")).modes[0] == first
