"""A divisor of the rates is a pole where they grow beyond bounds, and none where they have a limit."""

from dataclasses import replace

import mpmath
import pytest
import sympy as sp
from peers import here

import asympk as ap
from asympk.automaton import poles
from asympk.automaton.poles import divisors_of
from asympk.errors import OutOfRange, Pole, Unfinished
from asympk.systems.automata import automaton_of

x, v = sp.symbols("x v", real=True)
mu = sp.Symbol("mu", positive=True)
HALF = sp.Rational(1, 2)


def poles_of(rates, moving):
    return {*divisors_of(rates, moving).values()} - {1}


@pytest.mark.parametrize(
    "rate",
    [sp.sin(x) / x, sp.sin(x - HALF) / (x - HALF), 2 + sp.sin(x - v) / (v - x), (1 - sp.cos(x)) / x**2,
     x / (sp.exp(x) - 1), (x - HALF) / (1 - sp.exp((1 - 2 * x) / 10)), sp.log(1 + x) / x, (x**2 - v**2) / (x - v),
     v * (x - sp.sin(x)) / x**3, sp.tan(x) * sp.cos(x), sp.sin(2 * x) / sp.sin(x), x / sp.sinh(x), (x - 1) / sp.log(x),
     sp.sin(x) / x**2 - 1 / x, 1 / x - 1 / sp.sinh(x), sp.sin(x - v) / sp.sinh(v - x),
     sp.sin(x) ** 2 / (1 - sp.cos(x)), (1 - sp.cos(2 * x)) / (1 - sp.cos(x)), v * x / (sp.exp(v * x) - 1),
     sp.sin(v * x) / (v * sp.exp(x) - v)],
)
def test_a_divisor_is_no_pole_where_the_rates_have_a_limit(rate):
    assert poles_of((x + rate, 1 - 3 * rate), {x, v}) == set()


def test_a_divisor_is_judged_first_by_the_rates_that_it_divides(monkeypatch):
    """Of the chain of six blocks with friction that falls with the speed, 1800 limits were looked for, now 500."""
    judged, has_limit = [], poles._has_limit
    monkeypatch.setattr(poles, "_has_limit", lambda rate, *zero: judged.append(rate) or has_limit(rate, *zero))
    assert poles_of((*(x * k for k in range(9)), 1 / (v + 2)), {x, v}) == {v + 2}
    assert judged == [1 / (v + 2)]


@pytest.mark.parametrize(
    "rate",
    [1 / x, sp.cos(x) / x, sp.sin(x) / x**2, (1 - sp.cos(x)) / x**3, v * sp.sin(x) / (x - HALF), 1 / (sp.exp(x) - 1),
     sp.cos(1 / x), sp.exp(1 / x), sp.sin(x) / x + sp.log(x) * x / x**2, sp.tan(x), (v - 1) / (x - v), 1 / (x**2 - v),
     (sp.exp(x) - 1) / sp.expand((x - 3) * (sp.exp(x) - 1)), x**2 / (1 - sp.cos(x)), (v - 1) / (x * v - x),
     v / (sp.exp(v * x) - 1), x * sp.cos(x) / sp.sin(v * x) * v,
     (1 + 1 / x) * sp.sin(x) / x, sp.cot(x), sp.sin(x) / x**2 - sp.cot(x) / 2, sp.cos(x) * sp.tan(x / 2),
     sp.sqrt(1 - x**2) / (1 - x), sp.acos(x) / (x - 1), sp.sqrt(abs(x)) / x, abs(x) ** (3 * HALF) / x**2],
)
def test_a_divisor_is_a_pole_where_one_rate_has_no_limit(rate):
    assert poles_of((x + v, rate), {x, v})


def test_a_long_divisor_counts_as_a_pole_without_a_search_for_limits(monkeypatch):
    """That of the reactions of three cylinders in a heap, of a million operations, was differentiated for minutes."""
    long = 1 + x**2
    for _ in range(8):
        long = long * (long + v) + 1
    monkeypatch.setattr(poles, "_simple_zeros", lambda *_: pytest.fail("a limit is looked for"))
    assert divisors_of((1 / long,), {x, v}) == {long: long}


def test_numbers_of_any_length_beside_what_moves_leave_a_limit():
    """A place of 360 operations made a pole of sin(x)/x there."""
    place = sp.Mul(*((p + p**2 + p**3) / (1 + p + p**2) for p in sp.symbols("p:40", positive=True)))
    assert poles_of((sp.sin(x - place) / (x - place),), {x}) == set()


def test_a_divisor_that_moves_nothing_is_no_pole():
    assert poles_of((1 / v,), {x}) == set()


@pytest.mark.parametrize(("method", "options"), [("radau", {}), ("lsoda", {"rtol": 1e-10}), ("slow", {}), ("jump", {})])
def test_a_motion_passes_where_its_rates_have_a_limit(method, options):
    """x' = -1 - (x - a)/(exp(x - a) - 1) is autonomous: the time from 1 to x is an integral."""
    part = (x - HALF) / (sp.exp(x - HALF) - 1)
    system = ap.System.smooth({x: -1 - part}, {v: x - v}, mu)
    path = ap.solve(ap.Scene(system=system, values={"mu": "1e-3"}, start={"x": 1, "v": 1}, until=1), method, **options)
    with mpmath.workdps(30):
        begin, end = mpmath.mpf(1), mpmath.mpf(path.final[0])
        took = mpmath.quad(lambda w: 1 / (1 + (w - 0.5) / mpmath.expm1(w - 0.5)), [end, 0.5, begin])
    assert path.final[0] < 0
    assert float(took) == pytest.approx(1, abs=1e-7)


def test_a_divisor_may_have_a_limit_at_one_of_its_zeros_alone():
    """The rates x/tan(x) and (exp(x) - 1)/sin(x) + sin(x)/x have a limit at 0, and a pole at pi."""
    rates = {x: sp.S.One, v: x / sp.tan(x) + (sp.exp(x) - 1) / sp.sin(x) + sp.sin(x) / x}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, []), start={"x": -1, "v": 0}, until=3)
    with mpmath.workdps(30):
        rise = mpmath.quad(lambda w: w / mpmath.tan(w) + mpmath.expm1(w) / mpmath.sin(w) + mpmath.sinc(w), [-1, 0, 2])
    assert ap.solve(scene).final[1] == pytest.approx(float(rise), abs=1e-8)
    with pytest.raises(Unfinished, match=r"divided by sin\(x\)/x, and that is 0 at t = 4.14159"):
        ap.solve(replace(scene, until=5), "dop853")


@pytest.mark.parametrize("options", [
    {}, {"method": "radau", "rtol": 1e-10}, {"method": "dop853"}, {"digits": 25},
    *(pytest.param({"method": one.values[0], "rtol": 1e-10}, marks=one.marks) for one in here("heyoka", "kvaerno5")),
])
def test_a_motion_starts_where_its_rates_are_0_by_0_and_have_a_limit(options):
    """x' = sin(x)/x has 1 at the start; the time up to x is an integral."""
    rates = {x: sp.sin(x - 1) / (x - 1), v: (1 - sp.cos(x - 1)) / (x - 1) ** 2}
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, []), start={"x": 1, "v": 0}, until=2)
    end, area = ap.solve(scene, **options).final
    with mpmath.workdps(60):
        took = mpmath.quad(lambda w: 1 / mpmath.sinc(w), [0, mpmath.mpf(end) - 1])
        passed = mpmath.quad(lambda w: (1 - mpmath.cos(w)) / (w * mpmath.sin(w)), [0, mpmath.mpf(end) - 1])
    exact = "digits" in options
    assert abs(took - 2) < (1e-24 if exact else 1e-8)
    assert abs(passed - area) < (1e-24 if exact else 1e-8)


@pytest.mark.parametrize("options", [{}, {"method": "radau"}, {"digits": 25}])
def test_a_quotient_that_is_affine_where_it_is_defined_may_be_0_by_0_where_all_states_are_0(options):
    system = ap.System.with_frictions({x: sp.S.One, v: (x**2 - HALF * x) / (2 * x)}, {}, [])
    end = ap.solve(ap.Scene(system=system, start={"x": -1, "v": 0}, until=3), **options).final
    assert end == pytest.approx((2, 0), abs=1e-8)


@pytest.mark.parametrize("options", [{"method": "dop853"}, {"digits": 25}])
def test_rounding_beside_a_limit_is_no_error_of_the_motion(options):
    """A step ends next to 0, where doubles make (x - sin(x))/x^3 any number."""
    system = ap.System.with_frictions({x: sp.S.One, v: (x - sp.sin(x)) / x**3}, {}, [])
    path = ap.solve(ap.Scene(system=system, start={"x": -1, "v": 0}, until=1), **options)
    with mpmath.workdps(60):
        area = mpmath.quad(lambda w: (w - mpmath.sin(w)) / w**3, [0, 1])
    assert abs(path.final[1] - area) < (1e-24 if "digits" in options else 1e-12)


@pytest.mark.parametrize(("start", "options"), [(0, {"digits": 15}), (HALF**6, {"method": "dop853"}),
                                                (sp.Rational(1, 10**80), {"method": "dop853"})])
def test_a_divisor_of_high_order_has_all_digits_at_its_zero_and_beside(start, options):
    """The rate is a series, -1/7! + x^2/9! - ..., of which doubles have no digit at 1/64."""
    rate = (sp.sin(x) - x + x**3 / 6 - x**5 / 120) / x**7 + (1 - sp.cos(x)) / x**2
    system = ap.System.with_frictions({x: sp.S.One, v: rate}, {}, [])
    found = ap.solve(ap.Scene(system=system, start={"x": start, "v": 0}, until=HALF**7), **options).final[1]
    area = sp.integrate(sum((-1) ** k * x ** (2 * k) * (1 / sp.factorial(2 * k + 2) - 1 / sp.factorial(2 * k + 7))
                            for k in range(4)), (x, start, start + HALF**7))
    assert float(found) == pytest.approx(float(area), rel=1e-12)


@pytest.mark.parametrize("method", here("heyoka", "kvaerno5"))
@pytest.mark.parametrize("start", [-1, "1e-3", "1e-5"])
def test_rates_that_are_compiled_as_written_lose_no_digits_beside_a_limit(start, method):
    """From 1e-5 both methods ended wrong by 2e-4, and heyoka stopped at 0."""
    system = ap.System.with_frictions({x: sp.S.One, v: (sp.sin(x) - x + x**3 / 6) / x**5}, {}, [])
    path = ap.solve(ap.Scene(system=system, start={"x": start, "v": 0}, until=2), method, rtol=1e-8)
    series = sum((-1) ** k * x ** (2 * k) / sp.factorial(2 * k + 5) for k in range(10))
    area = sp.integrate(series, (x, sp.Rational(start), sp.Rational(start) + 2))
    assert path.final[1] == pytest.approx(float(area), abs=1e-8)


@pytest.mark.parametrize("method", here("heyoka", "kvaerno5"))
def test_a_step_may_come_to_the_place_itself_where_a_rate_is_0_by_0(method):
    """The next step of heyoka failed there: every motion that starts as far before it as it ends behind was refused."""
    system = ap.System.with_frictions({x: sp.S.One, v: sp.sin(x) / x}, {}, [])
    path = ap.solve(ap.Scene(system=system, start={"x": -1, "v": 0}, until=2), method, rtol=1e-9)
    assert path.final[1] == pytest.approx(float(2 * mpmath.si(1)), abs=1e-8)


@pytest.mark.parametrize("method", [*here("exact", "dop853", "heyoka", "kvaerno5")])
def test_a_load_that_is_0_by_0_and_has_a_limit_of_high_order_holds_a_block_at_rest(method):
    """No rate of a block at rest contains its load, whose rounding let it slip: it ended 0.004 farther, or nowhere."""
    push, way, speed, force = sp.Rational(3, 10), *sp.symbols("u w F", real=True)
    load = 60 * (sp.sin(x) - x + x**3 / 6) / x**5
    block = ap.Friction(velocity=speed, force=force, load=load, kinetic=1)
    system = ap.System.with_frictions({x: sp.S.One, way: speed, speed: force + push}, {}, [block])
    path = ap.solve(ap.Scene(system=system, start={"x": -1, "u": 0, "w": 0}, until=3), method)
    assert path.modes == ("stick",)


@pytest.mark.parametrize("rate", [1 / x, v * x / (v**2 + x**2), sp.sin(1 / x)])
@pytest.mark.parametrize("options", [{}, {"digits": 25}])
def test_a_start_is_refused_where_a_rate_has_no_limit(rate, options):
    scene = ap.Scene(system=ap.System.with_frictions({x: sp.S.One, v: rate}, {}, []), start={"x": 0, "v": 0}, until=1)
    with pytest.raises((Unfinished, OutOfRange, Pole)):
        ap.solve(scene, **options)


def test_the_refusal_at_a_pole_of_a_smooth_system_does_not_speak_of_contacts():
    system = ap.System.smooth({x: sp.S.One}, {v: 1 / (x - 1) - v}, mu)
    with pytest.raises(Pole, match=r"or take other states$"):
        ap.solve(ap.Scene(system=system, values={"mu": "1e-3"}, start={"x": 0, "v": 0}, until=2), "jump")


def test_a_step_of_no_length_leads_to_no_pole():
    """A rigid slider-crank was refused at its dead centres: a divisor of 1 had changed by rounding in no time."""
    system = ap.System.smooth({x: 1 / (2 - x)}, {}, None)
    mode = automaton_of(ap.Scene(system=system, start={x: 0}, until=1)).mode(())
    (divisor,) = mode.pole_values(1.0, (1.0,))
    assert mode.require_one_side((divisor * (1 + 1e-15),), 1.0, (1.0,), begun=1.0) == (divisor,)


def test_the_sum_of_1_and_a_root_is_no_pole():
    system = ap.System.smooth({x: 1 / (1 + sp.sqrt(x)) + 1 / (sp.sqrt(x) - 2)}, {}, None)
    (divisor,) = automaton_of(ap.Scene(system=system, start={x: 1}, until=1)).mode(()).mode.poles
    assert divisor.subs(x, 4) == 0


def test_a_limit_beside_a_divisor_with_a_square_is_found():
    """The divisor 1 + (a - 2)^2 was left as it stands, and what cancels above it was not seen to: a pole was told."""
    a = sp.Symbol("a", real=True)
    rate = (sp.exp(x) * (1 + a) ** 2 - 1 - 2 * a - a**2) / (x * (1 + (a - 2) ** 2) ** 2)
    system = ap.System.smooth({a: sp.S.One, x: -sp.S.One, v: rate}, {}, None)
    path = ap.solve(ap.Scene(system=system, start={a: 0, x: 1, v: 0}, until=2))
    area = mpmath.quad(lambda t: mpmath.expm1(1 - t) / (1 - t) * (1 + t) ** 2 / (1 + (t - 2) ** 2) ** 2, [0, 1, 2])
    assert path.final[2] == pytest.approx(float(area), rel=1e-8)
