"""The looks at heyoka's steps: rates and guards of which the Taylor series at the start of a step has no trace."""

import mpmath as mp
import pytest
import sympy as sp
from peers import here

import asympk as ap
from asympk.automaton.numericmode import NumericMode
from asympk.errors import OutOfRange, Pole, Unfinished

x, y, v, u, F = sp.symbols("x y v u F", real=True)
HALF = sp.Rational(1, 2)


def _final(rates, start, until, frictions=(), **how):
    system = ap.System.with_frictions(rates, {}, frictions)
    return ap.solve(ap.Scene(system=system, start=start, until=until), **how).final


@pytest.mark.parametrize("method", here("heyoka"))
@pytest.mark.parametrize(("pull", "rtol"), [(sp.cos(x), 1e-6), (x**2 - 1, 1e-9), (x**3 - 1, 1e-8)])
def test_a_motion_from_rest_where_the_last_terms_of_the_series_vanish_is_followed(method, pull, rtol):
    """A pendulum let go from the horizontal fell freely, in one step: there x has terms of t^(4k + 2) alone."""
    found, expected = (_final({x: v, v: -pull}, [0, 0], 2, **how) for how in ({"method": method, "rtol": rtol}, {}))
    assert found == pytest.approx(expected, abs=100 * rtol)


@pytest.mark.parametrize("method", here("heyoka"))
def test_a_slip_from_rest_under_friction_that_rises_with_a_fourth_power_keeps_to_its_largest_velocity(method):
    """Its velocity was 10^6: at rest it has terms of t^(4k + 1), and heyoka saw t^11 and t^12."""
    law = ap.Friction(velocity=v, force=F, load=1, kinetic=HALF + v**4)
    assert _final({x: v, v: 2 + F}, [0, 0], 5, [law], method=method, rtol=1e-9)[1] == pytest.approx(1.5**0.25, abs=1e-7)


@pytest.mark.parametrize("method", here("heyoka"))
@pytest.mark.parametrize("width", ["1/10", "1/30", "1/100"])
def test_a_rise_of_friction_in_the_middle_of_a_step_is_seen(method, width):
    """A block stopped 0.21, 0.07 and 0.02 late: after two steps, at the ends of which the rates knew nothing of it."""
    rise = sp.exp(-(((v - 1) / sp.Rational(width)) ** 2))
    system = ap.System.with_frictions({x: v, v: F}, {}, [ap.Friction(v, F, 1, (1 + rise) / 2)])
    path = ap.solve(ap.Scene(system=system, start=[0, 2], until=7), method=method, rtol=1e-8)
    beside = [1 + k * sp.Rational(width) for k in (-9, -1, 1, 9)]
    expected = mp.quad(sp.lambdify(v, 2 / (1 + rise), "mpmath"), [0, *(at for at in beside if 0 < at < 2), 2])
    assert path.events[0].t == pytest.approx(float(expected), abs=1e-6)


@pytest.mark.parametrize("method", here("heyoka"))
def test_a_bump_of_the_ground_in_the_middle_of_a_step_is_hit(method):
    """A block that flies over even ground was above the bump before it looked, and did not touch it."""
    bump = ap.Friction(v, F, 1, HALF, gap=y - sp.exp(-((10 * (x - 1)) ** 2)))
    system = ap.System.with_frictions({x: v, y: u, v: F, u: sp.S.Zero}, {}, [bump])
    path = ap.solve(ap.Scene(system=system, start=[0, HALF, 1, 0], until=2), method=method)
    assert path.modes == ("open", "slip_same", "open")
    assert path.events[0].t == pytest.approx(1 - float(sp.sqrt(sp.log(2))) / 10, abs=1e-6)


@pytest.mark.parametrize("method", here("heyoka"))
def test_a_state_far_below_the_others_is_as_accurate_as_is_asked_for(method):
    """x' = -10^25 x^2 from 10^-25 halves it; beside states of size 1 heyoka takes it for rounding."""
    found = _final({x: -(10**25) * x**2, y: u, u: -y}, ["1e-25", 0, 1], 1, method=method, rtol=1e-10, atol=1e-40)
    assert found[0] == pytest.approx(5e-26, rel=1e-8, abs=0)


@pytest.mark.parametrize("method", here("heyoka"))
def test_a_divisor_of_the_rates_that_vanishes_twice_within_steps_is_a_pole(method):
    """With x = y = cos t the rate y x'/x has a value between the zeros of x; the run went past these."""
    with pytest.raises(Pole, match=r"passed before t = (1\.[5-9]|2).*: x = 0"):
        _final({x: v, v: -x, y: y * v / x}, [1, 0, 1], 6, method=method)


@pytest.mark.parametrize("method", here("heyoka"))
@pytest.mark.parametrize(("rate", "end"), [(x, 710), (1 + x**2, 1.57)])
def test_a_motion_that_grows_beyond_all_bounds_is_told_up_to_its_last_step(method, rate, end):
    """It ended at a state that is infinite, or nan."""
    with pytest.raises(Unfinished, match="left the range of floats") as short:
        _final({x: rate, v: sp.S.Zero}, [1 if rate == x else 0, 0], 1000, method=method)
    path = short.value.path
    assert path.info["reached"] == pytest.approx(end, rel=1e-2)
    assert 1e15 < path.final[0] < float("inf")


@pytest.mark.parametrize("method", here("heyoka"))
@pytest.mark.parametrize("power", [HALF, sp.Rational(1, 3)])
def test_a_slip_is_followed_under_friction_with_a_root_of_its_speed(method, power):
    """It was refused, as heyoka has no absolute value, though |v| is not 0 in a slip."""
    law = ap.Friction(velocity=v, force=F, load=1, kinetic=(1 + abs(v) ** power) / 2)
    found = _final({x: v, v: F - x}, [0, -3], 1, [law], method=method, rtol=1e-9)
    assert found == pytest.approx(_final({x: v, v: F - x}, [0, -3], 1, [law]), abs=1e-8)


@pytest.mark.parametrize("method", here("heyoka"))
def test_the_looks_at_many_steps_are_evaluated_at_once(method, monkeypatch):
    """A pendulum took 200 times as long as its steps; each look was a call of the rates and one of the guards."""
    calls, rhs = [], NumericMode.rhs
    monkeypatch.setattr(NumericMode, "rhs", lambda *given: calls.append(given) or rhs(*given))
    system = ap.System.with_frictions({x: v, v: -sp.sin(x)}, {}, ())
    path = ap.solve(ap.Scene(system=system, start=[1, 0], until=50), method=method)
    assert len(calls) < path.info["work"]["steps"] / 4


@pytest.mark.parametrize("method", here("heyoka"))
def test_a_load_whose_rounding_hides_its_sign_at_its_zero_is_lost_there(method):
    """The second zero was passed over: the block slid on with the wrong sign of the load to the foot of the dip."""
    t = sp.Symbol("t", real=True)
    load = 1 - sp.Rational(151, 100) * sp.Max(0, 1 - (500 * x - 700) ** 2) ** 2
    pull = -sp.Rational(19, 50) * v - sp.Rational(76, 25) * x + sp.Rational(49, 100) * sp.sin(sp.Rational(31, 20) * t)
    system = ap.System.with_frictions({x: v, v: F + pull}, {}, [ap.Friction(v, F, load, sp.Rational(33, 100))], time=t)
    scene = ap.Scene(system=system, start=[sp.Rational(129, 100), sp.Rational(29, 20)], until="3.28")
    found, expected = (ap.solve(scene, method=own, rtol=1e-10).events for own in (method, "dop853"))
    assert [e.t for e in found] == pytest.approx([e.t for e in expected], abs=1e-8)


@pytest.mark.parametrize("method", here("heyoka"))
def test_friction_that_falls_below_0_within_a_step_is_refused_though_the_rates_have_no_trace_of_it(method):
    law = HALF - sp.exp(-((500 * (x - 1)) ** 2))
    slide = ap.Friction(velocity=v, force=F, load=sp.Rational(1, 10**9), kinetic=law)
    with pytest.raises(OutOfRange, match=r"kinetic friction .* is negative at t = 0\.499167"):
        _final({x: v, v: F}, [0, 2], 1, [slide], method=method)
