"""Collocation: runs whose stages grow with the digits asked for."""

import math

import numpy as np
import pytest
import sympy as sp
from mpmath import mp

import asympk as ap
from asympk.errors import InputError, OutOfRange, Unfinished
from asympk.integrators import collocation
from asympk.integrators.collocation import _solved

x, v, F = sp.symbols("x v F", real=True)


@pytest.mark.parametrize("digits", [20, pytest.param(60, marks=pytest.mark.slow)])
def test_a_pendulum_comes_back_after_its_period_to_all_digits(digits):
    """From rest at 1 rad it takes 4 K(sin(1/2)^2), with the parameter m = k^2."""
    q, p = sp.symbols("q p", real=True)
    pendulum = ap.System.smooth({q: p, p: -sp.sin(q)}, {}, None)
    with mp.workdps(digits + 15):
        period = mp.nstr(4 * mp.ellipk(mp.sin(mp.mpf(1) / 2) ** 2), digits + 12)
    path = ap.solve(ap.Scene(system=pendulum, values={}, start={"q": 1, "p": 0}, until=period), digits=digits)
    with mp.workdps(digits + 15):
        assert max(abs(mp.mpf(path.final[0]) - 1), abs(mp.mpf(path.final[1]))) < mp.mpf(10) ** (1 - digits)


@pytest.mark.parametrize("potential", [sp.gamma(x + 3), sp.besselj(0, x), sp.LambertW(x + 2)])
@pytest.mark.few(1)
def test_a_force_by_a_function_that_mpmath_alone_has_keeps_the_energy_to_the_digits_asked_for(potential):
    system = ap.System.smooth({x: v, v: -potential.diff(x)}, {}, small=None)
    scene = ap.Scene(system=system, start={x: 1, v: 0}, until=1)
    energy = ap.lower((x, v), v**2 / 2 + potential, "mpmath")
    first, in_doubles = energy.to_digits(30, 1, 0)[0], ap.solve(scene, method="dop853", rtol=1e-10)
    assert abs(energy.to_digits(30, *in_doubles.final)[0] - first) < 1e-8
    assert abs(energy.to_digits(30, *ap.solve(scene, digits=20).final)[0] - first) < 1e-19


def test_a_state_that_stays_as_it_is_makes_no_reference_look_better():
    x, y = sp.symbols("x y", real=True)
    alone, beside = (ap.System.smooth({y: -(y**2), **other}, {}, None) for other in ({}, {x: 0}))
    error, with_other = (float(ap.solve(ap.Scene(system=system, start=start, until=1), digits=8).error)
                         for system, start in ((alone, [1]), (beside, [1, 0])))
    assert error > 0
    assert with_other == pytest.approx(error, rel=1 / 4)  # corrections in doubles depend on the machine


@pytest.mark.parametrize("digits", [1, 2, 3])
@pytest.mark.few(2)
def test_a_block_on_a_belt_is_followed_to_one_digit_as_to_many(digits):
    """With one digit carried, two slips seemed possible where it leaves the belt."""
    rough = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=sp.Rational(4, 5) / (1 + sp.Abs(v - 1)), static=1)
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [rough])
    scene = ap.Scene(system=block, start={x: 0, v: 1}, until=3)
    few, many = ap.solve(scene, digits=digits), ap.solve(scene, digits=20)
    assert few.modes == many.modes == ("stick", "slip_opposite")
    assert few.final == pytest.approx(many.final, rel=10.0**-digits)


def test_steps_grow_as_their_last_polynomials_allow_from_a_fast_time_to_a_slow_one():
    """From 1e-12 to 1/4 they grew 56 times by 1.6; by 4 it is 19 times."""
    x, y = sp.symbols("x y", real=True)
    relaxed = ap.System.smooth({x: -y}, {y: x + y - y**3 / 3}, sp.Symbol("mu", positive=True))
    scene = ap.Scene(system=relaxed, values={"mu": "1e-12"}, start={"x": 2, "y": "5/2"}, until="1/4")
    path = ap.solve(scene, digits=15)
    assert len(path.at.joined.segments[0].samples) < 35
    assert path.final == pytest.approx(ap.solve(scene, "jump", order=1).final, abs=1e-11)


@pytest.mark.further
def test_a_pendulum_that_turns_too_often_is_refused_before_all_steps_are_spent():
    q, p = sp.symbols("q p", real=True)
    heavy = ap.System.smooth({q: p, p: -(10**30) * sp.sin(q)}, {}, None)
    with pytest.raises(OutOfRange, match="needs more than 5000 steps"):
        ap.solve(ap.Scene(system=heavy, start={"q": 1, "p": 0}, until=1), digits=20, seconds=30)


@pytest.mark.parametrize(("option", "error"), [({"seconds": "0"}, Unfinished), ({"seconds": "nan"}, InputError),
                                               ({"events": "many"}, InputError)])
def test_bounds_of_a_run_with_many_digits_are_read_as_those_of_any_other(option, error):
    with pytest.raises(error, match=r"time is over|must be a"):
        ap.solve(ap.read_scene("nonlinear_rod"), digits=20, **option)


@pytest.mark.parametrize("static", ["1/2", "3/5"])
@pytest.mark.few(1)
def test_a_block_on_a_stiffening_spring_touches_the_speed_of_its_belt_after_every_turn(static):
    """It leaves with the belt's speed where x + x^3 is the static bound, and keeps its energy while it slips.

    So without more static friction it only just comes back to that speed; with it, it sticks there.
    """
    x, v, F = sp.symbols("x v F", real=True)
    friction = ap.Friction(velocity=v - 1, force=F, load=sp.S.One, kinetic=sp.S.Half, static=sp.Rational(static))
    system = ap.System.with_frictions({x: v, v: -x - x**3 + F}, {}, (friction,))
    path = ap.solve(ap.Scene(system=system, start=(0, 1), until=11), digits=20)
    assert path.modes == ("stick", "slip_opposite") * (1 if static == "1/2" else 3)
    with mp.workdps(40):
        left = mp.findroot(lambda x: x + x**3 - mp.mpf(sp.Rational(static).p) / sp.Rational(static).q, 0.4)
        energies = [(v**2 - x + x**2 + x**4 / 2) / 2 for x, v in (path.final, (left, 1))]
        assert abs(energies[0] - energies[1]) < 1e-18


@pytest.mark.parametrize("size", [1, 31, 32, 33, 140])
def test_elimination_by_blocks_solves_the_equations_of_a_step_whatever_is_left_for_the_last_block(size):
    rng = np.random.default_rng(size)
    matrix, right = np.eye(size) + rng.normal(size=(size, size)) / 20, rng.normal(size=size)
    assert np.allclose(matrix @ _solved(matrix, right), right, rtol=0, atol=1e-12)


def on_a_belt(phase):
    """A block on a spring that a belt of speed 1 takes along, with friction that falls with the sliding velocity."""
    k, push, belt, amplitude = sp.symbols("k B V A", real=True)
    low, high = sp.symbols("m s", nonnegative=True)
    x, v, F, t = sp.symbols("x v F t", real=True)
    kinetic = low + (high - low) * sp.exp(-sp.Abs(v - belt))
    friction = ap.Friction(velocity=v - belt, force=F, load=sp.S.One, kinetic=kinetic, static=high)
    drive = push + amplitude * sp.cos(t)
    block = ap.System.with_frictions({x: v, v: -k * x + drive + F}, {}, (friction,), time=t)
    values = {k: 1, push: -1, belt: 1, amplitude: 0, low: "1/2", high: 1}
    return ap.Scene(system=block, values=values, start=phase, until=10)


@pytest.mark.parametrize(("start", "digits"), [((2, 1), 18), ((3, 0), 10)], ids=["onset at x = 0", "a step too long"])
@pytest.mark.few(1)
def test_a_block_on_a_belt_in_digits_moves_as_in_doubles(start, digits):
    path = ap.solve(on_a_belt(start), digits=digits)
    doubles = ap.solve(on_a_belt(start), "dop853", rtol=1e-11, atol=1e-12)
    assert path.modes == doubles.modes
    assert [float(w) for w in path.final] == pytest.approx(doubles.final, abs=1e-9)


def test_stiff_states_that_grow_large_are_followed_in_long_steps():
    """The sweeps of a step end at the tolerance relative to the states; 1e-20 beside 1e8 was never reached."""
    x, y = sp.symbols("x y", real=True)
    mu = sp.Symbol("mu", positive=True)
    system = ap.System.smooth(slow={x: 5 * x}, fast={y: x**2 - y}, small=mu)
    scene = ap.Scene(system=system, values={mu: "1/1000"}, start={x: 1, y: 0}, until=2)
    path = ap.solve(scene, digits=15, seconds=60)
    # y = (e^{10 t} - e^{-t/mu}) / (1 + 10 mu)
    assert path.final == pytest.approx((math.exp(10), math.exp(20) / 1.01), rel=1e-14)


@pytest.mark.slow
def test_what_sticks_is_not_moved_where_the_time_ends_its_rest():
    """The spring x^3 moves the edge of stick near x = 0 by so little that x was moved by 7e-14 onto it."""
    x, v, t, F = sp.symbols("x v t F", real=True)
    stick = sp.Rational(3, 4)
    rubber = ap.Friction(velocity=v, force=F, load=1, kinetic=stick / (1 + sp.Abs(v)), static=stick)
    block = ap.System.with_frictions({x: v, v: F - x**3 + sp.sin(2 * t)}, {}, [rubber], time=t)
    scene = ap.Scene(system=block, start={x: 0, v: 0}, until=5)
    fewer, more = (ap.solve(scene, digits=digits).final[0] for digits in (14, 20))
    assert abs(fewer - more) < 1e-14


def test_a_mass_that_sticks_beside_a_stiff_state_has_the_velocity_0_in_digits_too():
    """The elimination of the stiff state left 6e-44 of velocity, for good."""
    x, v, w, F = sp.symbols("x v w F", real=True)
    rough = ap.Friction(velocity=v, force=F, load=2, kinetic=sp.S.Half)
    block = ap.System.with_frictions({w: 10**4 * (v - w - w**3), v: w - x + F, x: v}, {}, [rough])
    path = ap.solve(ap.Scene(system=block, start={w: 1, v: 1, x: 0}, until=3), digits=8)
    assert path.modes == ("slip_same", "stick")
    assert path.final[1] == path(1.5)[1] == 0


def test_steps_beyond_the_stop_of_a_puck_are_given_up_after_a_few_sweeps(monkeypatch):
    """Its rates have no value beyond, and Newton's method goes round: some 3000 sweeps in all where each has its 60."""
    sweeps, u, v = [], *sp.symbols("u v", real=True)
    correction = collocation._correction
    monkeypatch.setattr(collocation, "_correction", lambda *given: sweeps.append(1) or correction(*given))
    speed = sp.sqrt(u**2 + v**2)
    puck = ap.System.smooth({u: -u / speed, v: -v / speed}, {}, None)
    with pytest.raises(OutOfRange, match=r"standstill at t = 1\.41421356"):
        ap.solve(ap.Scene(system=puck, start={u: 1, v: 1}, until=3), digits=15)
    assert len(sweeps) < 1500


CANCELLING = {  # coefficients that tend to 1 though their parts cancel at the given p, in doubles to nothing
    "1e-30": lambda p: sp.log(1 + p) / p,
    "1e-40": lambda p: 2 * (1 - sp.cos(p)) / p**2,
    "100": lambda p: (1 - sp.tanh(p)) * sp.exp(2 * p) / 2,
    "1.00000000000000000001": lambda p: (p - 1) * 10**20,
}


@pytest.mark.parametrize("value", CANCELLING)
@pytest.mark.parametrize("options", [{"digits": 12}, {}, {"method": "radau", "rtol": 1e-9}, {"method": "jump"}])
@pytest.mark.few(3)
def test_a_coefficient_whose_parts_cancel_keeps_its_digits_in_every_method(value, options):
    x, y = sp.symbols("x y", real=True)
    p, mu = sp.symbols("p mu", positive=True)
    factor = CANCELLING[value](p)
    system = ap.System.smooth({x: -(x**2) * y}, {y: factor - y}, mu)
    path = ap.solve(ap.Scene(system=system, values={p: value, mu: "1e-9"}, start={x: 1, y: 1}, until=1), **options)
    assert max(abs(path.final[0] - 0.5), abs(path.final[1] - 1)) < 1e-8


@pytest.mark.parametrize("options", [{"digits": 12}, {}, {"method": "radau"}])
def test_a_coefficient_that_vanishes_at_its_numbers_is_0_in_every_method(options):
    """sin(pi (1/2 + 1/2)) is 1.2e-16 in doubles, by which x would move at a rate of 12."""
    x, p, q = sp.symbols("x p q", real=True)
    system = ap.System.smooth({x: 10**17 * sp.sin(sp.pi * (p + q)) * sp.exp(-(x**2) / 100)}, {}, None)
    scene = ap.Scene(system=system, values={p: "0.5", q: "0.5"}, start={x: 1}, until=1)
    assert ap.solve(scene, **options).final == (1,)


@pytest.mark.parametrize("options", [{}, {"method": "radau", "rtol": 1e-9}, {"method": "jump"}])
def test_a_coefficient_in_the_small_parameter_keeps_its_digits_in_every_method(options):
    """At mu = 1e-20 and k = 1e20 the rate is -2 x**2, and by its formula in doubles -x**2."""
    x, y = sp.symbols("x y", real=True)
    k, mu = sp.symbols("k mu", positive=True)
    system = ap.System.smooth({x: -(x**2) * (1 + k * (sp.exp(mu) - 1))}, {y: (k + 1) * x * sp.log(1 + mu) - y}, mu)
    scene = ap.Scene(system=system, values={k: "1e20", mu: "1e-20"}, start={x: 1, y: 0}, until=1)
    x, y = ap.solve(scene, **options).final
    assert max(abs(x - 1 / 3), abs(y - x)) < 1e-8


MODEL = {"method": "jump", "order": 1}


@pytest.mark.parametrize("options", [{"digits": 12}, {}, {"method": "radau", "rtol": 1e-9}, MODEL])
@pytest.mark.few(2)
def test_a_coefficient_that_the_modes_scatter_over_their_terms_keeps_its_digits_in_every_method(options):
    """At p = 1 + 1e-20 the coefficient of x**2 is 1; with the friction put in, its terms are those of p and of 1."""
    x, y, z, F = sp.symbols("x y z F", real=True)
    p, mu = sp.symbols("p mu", positive=True)

    def scene(factor, values):
        system = ap.System.with_friction(slow={x: y}, fast={y: 1 - x - y}, velocity={z: 1 - x**2 * factor - y + F},
                                         force=F, load=x + y, kinetic=sp.Rational(1, 2), small=mu)
        return ap.Scene(system=system, values={mu: "1e-4", **values}, start={x: 0, y: "0.2", z: -1}, until=1)

    cancelling = scene((p - 1) * 10**20, {p: "1.00000000000000000001"})
    found, plain = (ap.solve(one, **options).final for one in (cancelling, scene(1, {})))
    assert max(abs(a - b) for a, b in zip(found, plain, strict=True)) < 1e-8


def test_a_coefficient_without_a_value_on_another_side_of_its_switch_stays_there():
    x, p = sp.symbols("x p", real=True)
    switched = ap.System.smooth({x: -(x**2) * sp.Piecewise((sp.sqrt(p - 1), p > 1), (sp.sqrt(1 - p), True))}, {}, None)
    ends = [ap.solve(ap.Scene(system=switched, values={p: v}, start={x: 1}, until=1)).final[0] for v in (0, 2)]
    assert max(abs(end - 0.5) for end in ends) < 1e-8


def test_a_narrow_bump_along_a_state_adds_its_area():
    """A step passed over it, and both runs agreed that the state it moves stays at 0."""
    steep = 3000
    x, y = sp.symbols("x y", real=True)
    system = ap.System.smooth({x: sp.Integer(2), y: sp.exp(-((steep * (x - 1)) ** 2))}, {}, None)
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until=1), digits=10)
    assert float(path.final[1]) == pytest.approx(math.sqrt(math.pi) / (2 * steep), abs=1e-10)


def test_a_narrow_bump_where_a_square_of_a_state_has_a_value_adds_its_area():
    """Both runs passed over it, and agreed on 0."""
    x, y = sp.symbols("x y", real=True)
    system = ap.System.smooth({x: 1, y: x * sp.exp(-((3000 * (x**2 - 1)) ** 2))}, {}, None)
    path = ap.solve(ap.Scene(system=system, start=[0, 0], until=2), digits=10)
    assert float(path.final[1]) == pytest.approx(math.sqrt(math.pi) / 6000, abs=1e-10)


def test_friction_that_varies_beside_a_narrow_bump_of_the_load_is_followed():
    """The looks at the bump left out the law of friction, and the run was refused as one of infinite rates."""
    x, v, force = sp.symbols("x v F", real=True)
    slide = ap.Friction(v, force, 1 + 50 * sp.exp(-((500 * (x - 1)) ** 2)), kinetic=sp.Rational(1, 2) - x / 10)
    system = ap.System.with_frictions({x: v, v: force}, {}, [slide])
    end = ap.solve(ap.Scene(system=system, start=[0, 2], until=1), digits=10).final
    work = end[0] / 2 - end[0] ** 2 / 20 + 0.4 * math.sqrt(math.pi) / 10
    assert float(2 - end[1] ** 2 / 2) == pytest.approx(float(work), abs=1e-10)


def test_a_narrow_bump_to_and_fro_along_a_state_moves_what_follows():
    """Of the looks beside its middle none was within it, and 10 digits had 8."""
    steep = 5000
    x, y, z = sp.symbols("x y z", real=True)
    system = ap.System.smooth({x: 1, y: 2 * steep * (x - 1) * sp.exp(-((steep * (x - 1)) ** 2)), z: y}, {}, None)
    path = ap.solve(ap.Scene(system=system, start=[0, 0, 0], until="3/2"), digits=10)
    assert float(path.final[2]) == pytest.approx(-math.sqrt(math.pi) / steep**2, abs=1e-10)
