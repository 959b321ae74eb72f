"""Stick and crossing regions against the friction cone itself, number by number."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.errors import InputError, NotDerivable
from asympk.formulas import read_formula
from asympk.mechanics.evaluation import evaluate
from asympk.systems import MECHANISMS
from asympk.systems import painleve_klein as pk
from asympk.systems.catalogue import described_mechanism

SIGMAS = [Fraction(n, 4) for n in (-7, -6, -5, -4, -3, -1, 0, 1, 4, 12)]
LOADS = [Fraction(n, 12) for n in range(-40, 41)]


@cache
def regions():
    return ap.stick_regions(pk.system())


@pytest.mark.few(0)
@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("extra", [Fraction(0), Fraction(1, 3), Fraction(3)])
def test_regions_are_where_the_cone_says_for_every_sigma(sigma, extra):
    sigma0 = sigma + extra
    for s in LOADS:
        hold, slip = (sigma0 + 2) * abs(s), (sigma + 2) * abs(s)
        told = {
            name: getattr(regions(), name).contains(s, sigma=sigma, sigma0=sigma0)
            for name in ("stick", "up", "down", "ambiguous")
        }
        assert told == {
            "stick": abs(1 - s) <= hold,
            "up": 1 - s > hold,
            "down": 1 - s < -hold,
            "ambiguous": abs(1 - s) <= hold and abs(1 - s) > slip,
        }


def test_stick_up_and_down_cover_the_plane_once():
    s = np.linspace(-5, 5, 2003)
    for sigma in (-1.7, -1.0, -0.5, 0.0, 2.0):
        parts = [getattr(regions(), name).contains(s, sigma=sigma) for name in ("stick", "up", "down")]
        assert np.array_equal(np.sum(parts, axis=0), np.ones_like(s))


def test_a_root_of_a_polynomial_is_a_parameter_as_it_stands():
    x = sp.Symbol("x")
    root = sp.CRootOf(x**5 - x - 1, 0)  # 1.1673: stick from s = 1/(sigma + 3) on
    assert [regions().stick.contains(s, sigma=root) for s in ("0.2399", "0.24")] == [False, True]


def test_where_static_and_kinetic_friction_are_one_nothing_is_ambiguous():
    x, y, z, force = sp.symbols("x y z F")
    system = ap.System.with_friction({x: y}, {y: 1 - 2 * (x + y) + force}, velocity={z: 1 - (x + y) + force},
                                     force=force, load=x + y, kinetic=3, small=sp.Symbol("mu"))
    regions = ap.stick_regions(system)
    assert not any(cell.spans for cell in regions.ambiguous.cells)
    assert str(regions.ambiguous) == "nowhere"
    assert sum(len(cell.spans) for cell in regions.stick.cells) == 2


def test_at_the_edges_the_force_is_exactly_the_static_one():
    for edge in regions().edges:
        assert sp.cancel((1 - edge) ** 2 - (pk.sigma0 + 2) ** 2 * edge**2) == 0


def test_the_paper_s_half_planes_come_out_at_sigma_one():
    (left, right) = regions().stick.spans(sigma=1)
    at = {pk.sigma0: 1}
    assert left.as_set().subs(at) == sp.Interval(-sp.oo, sp.Rational(-1, 2))
    assert right.as_set().subs(at) == sp.Interval(sp.Rational(1, 4), sp.oo)


def test_below_minus_one_the_second_half_plane_is_gone_and_the_first_is_a_strip():
    (strip,) = regions().stick.spans(sigma="-3/2")
    assert strip.as_set().subs(pk.sigma0, sp.Rational(-3, 2)) == sp.Interval(sp.Rational(2, 3), 2)
    assert regions().down.contains(3, sigma="-3/2")


def test_numbers_and_arrays_agree_and_arrays_of_parameters_broadcast():
    s = np.array([[0.1], [0.4], [-2.0]])
    sigma = np.array([-1.5, -1.0, 1.0])
    table = regions().stick.contains(s, sigma=sigma, sigma0=sigma + 0.5)
    one_by_one = [[regions().stick.contains(float(v), sigma=g, sigma0=g + 0.5) for g in sigma] for v in s[:, 0]]
    assert table.tolist() == one_by_one


def test_the_convention_and_the_latex_say_what_happens():
    assert "at rest stays at rest" in regions().convention
    assert r"\frac{1}{\sigma_{0} + 3}" in regions().stick.latex()
    assert regions().down.latex().count(r"\emptyset") == 2


@pytest.mark.parametrize(
    ("kwargs", "match"),
    [
        ({"sigma": -2}, "sigma = -2"),
        ({"sigma": 1, "sigma0": 0}, "sigma0 = 0"),
        ({"sigma": "steep"}, "sigma = 'steep': it must be a decimal"),
        ({"sigma": float("nan")}, "sigma = nan"),
        ({"sigma": float("inf")}, "must be finite"),
        ({"sigma": [1.0, 2.0], "sigma0": [3.0, 4.0, 5.0]}, "do not broadcast"),
    ],
)
def test_bad_parameters_are_named(kwargs, match):
    with pytest.raises(InputError, match=match):
        regions().stick.contains("1/4", **kwargs)


def test_spans_refuse_the_parameters_that_no_place_may_have():
    for refused, match in (({"sigma": -3}, "sigma = -3"), ({"sigma": 1, "sigma0": 0}, "sigma0 = 0")):
        with pytest.raises(InputError, match=match):
            regions().stick.spans(**refused)


def test_a_system_without_friction_has_no_stick_regions():
    x, y, mu = sp.symbols("x y mu")
    with pytest.raises(NotDerivable, match="no friction"):
        ap.stick_regions(ap.System.smooth(slow={x: y}, fast={y: -y}, small=mu))


def _sliding_rate(kinetics, numbers, q, u, R, F):
    """Return gamma' from M u' = Q + W_N R + W_T F, the sliding velocity differentiated along the motion in numbers."""
    n = len(q)

    def at(parts, q, u, t=0.0):
        states = dict(zip((*kinetics.coordinates, *kinetics.velocities), (*q, *u), strict=True))
        return np.array(evaluate(tuple(parts), {**numbers, **states, kinetics.time: t}))

    M, W = at(kinetics.mass, q, u).reshape(n, n), at(kinetics.directions, q, u).reshape(2, n)
    a, step = np.linalg.solve(M, at(kinetics.forces, q, u) + W.T @ [R, F]), 1e-5
    ahead, behind = (at([kinetics.slip], q + s * u, u + s * a, s)[0] for s in (step, -step))
    return (ahead - behind) / (2 * step)


@pytest.mark.few(0)
@pytest.mark.parametrize("name", [name for name in MECHANISMS if name != "painleve_klein"])
def test_a_place_of_an_elastic_mechanism_sticks_where_friction_can_stop_it_in_both_directions(name):
    """Regions on any number of degrees of freedom against gamma' of Newton's law with the full force of friction."""
    system = getattr(ap.systems, name).system()
    told = described_mechanism(name).changed({str(s): "1/4" for s in system.parameters if str(s) in ("f", "f_0")})
    kinetics, regions, rng = told.mechanism.plain, ap.stick_regions(system), np.random.default_rng(3)
    numbers = {name: float(Fraction(value)) for name, value in told.values.items()} | {"c": 0.02}
    values = {s: numbers[s.name] for s in system.parameters}
    places = {s: float(told.state.get(s.name, 0)) + rng.uniform(-0.1, 0.1, 40) for s in system.states}
    places |= {s: rng.uniform(-2, 2, 40) * (s.name != "z") for s in system.states if s.name in ("x", "y", "z")}
    load, *rates = evaluate((system.friction.load, *(system.slow[q] for q in kinetics.coordinates)), values | places)
    expected = []
    for k, R in enumerate(np.maximum(load, 0) if kinetics.unilateral else load):
        q, u = np.array([places[q][k] for q in kinetics.coordinates]), np.array([rate[k] for rate in rates])
        at = {s: numbers[s.name] for s in kinetics.parameters} | dict(zip(kinetics.coordinates, q, strict=True))
        hold = evaluate((kinetics.static * kinetics.load,), at | {kinetics.time: 0})[0] * abs(R)
        low, high = (_sliding_rate(kinetics, at, q, u, R, F) for F in (-hold, hold))
        expected.append((low <= 0 <= high and R != 0, low > 0, high < 0))
    found = [getattr(regions, region).contains(places, values) for region in ("stick", "up", "down")]
    assert np.array_equal(np.transpose(found), expected)
    assert np.sum(np.any(found, axis=1)) >= 2


def test_edges_of_the_slender_rod_are_the_loads_at_which_the_full_friction_just_stops_its_end():
    system = ap.systems.bead_rod.system()
    cone, edges = ap.stick_regions(system).stick, ap.stick_regions(system).edges
    theta, rate, m, l, f = (sp.Symbol(name, real=True) for name in ("theta", "theta'", "m", "l", "f"))
    plain = {s: sp.Symbol(s.name, real=True) for s in system.parameters}
    free, mixed, tangential = l * rate**2 * sp.cos(theta), 3 * sp.sin(2 * theta) / 2, 1 + 3 * sp.sin(theta) ** 2
    for edge, sign in zip(edges, (1, -1), strict=True):
        needed = free - mixed * edge.subs(plain) / m
        assert sp.simplify(needed - sign * f * tangential * edge.subs(plain) / m) == 0
    assert not cone.plane.alone


def test_a_rigid_contact_has_no_stick_regions():
    with pytest.raises(NotDerivable, match="the reaction of a rigid contact depends on the mode"):
        ap.stick_regions(ap.systems.painleve_rod.mechanism().rigid())


x, v, F = sp.symbols("x v F", real=True)


def _block(kinetic, static=None, rate=-x + F):
    law = ap.Friction(velocity=2 * v - 1, force=F, load=1, kinetic=kinetic, static=static)
    return ap.System.with_frictions({x: v, v: rate}, {}, [law])


def test_friction_that_is_less_one_way_is_ambiguous_where_that_way_crosses():
    less_down = sp.Piecewise((sp.Rational(1, 2), v > sp.Rational(1, 2)), (sp.Rational(1, 4), True))
    regions = ap.stick_regions(_block(less_down, sp.Rational(3, 4), -x / 2 + F / 2))
    told = {place: regions.ambiguous.contains({x: place, v: "1/2"}) for place in ("-3/5", "-2/5", "1/5", "2/5", "3/5")}
    assert told == {"-3/5": True, "-2/5": False, "1/5": False, "2/5": True, "3/5": True}


@pytest.mark.parametrize("law", [sp.Rational(1, 2) + sp.sign(2 * v - 1) / 4,
                                 sp.Rational(1, 2) + sp.sign(v - sp.Rational(1, 2)) / 4,
                                 sp.Piecewise((3, v > sp.Rational(1, 2)), (1, True)) / 4,
                                 sp.Piecewise((6, v > 1), (3, 2 * v >= 1), (1, True)) / 4])
def test_rest_reaches_as_far_as_the_friction_of_the_slip_that_would_follow(law):
    """Friction is 3/4 where the block slips up, and 1/4 where it slips down; x pulls it to 0."""
    regions = ap.stick_regions(_block(law))
    told = {place: [r.contains({x: place, v: "1/2"}) for r in (regions.up, regions.stick, regions.down)]
            for place in ("-4/5", "-7/10", "1/5", "3/10")}
    assert [told[place].index(True) for place in told] == [0, 1, 1, 2]


@pytest.mark.parametrize(
    "block",
    [_block(1, rate=-x - sp.sign(2 * v - 1) + F),
     _block(1, rate=-x + sp.Piecewise((F, v > sp.Rational(1, 2)), (2 * F, True)))],
)
def test_what_jumps_where_the_velocity_vanishes_has_no_stick_regions(block):
    with pytest.raises(NotDerivable, match="jumps where the velocity vanishes"):
        ap.stick_regions(block)


def test_a_load_that_contains_its_own_force_has_no_stick_regions():
    """The edges of stick were told in terms of the force, as |x| <= |F/4 + 1|/2."""
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v, F, 1 + F / 4, sp.Rational(1, 2))])
    with pytest.raises(NotDerivable, match=r"the load F/4 \+ 1 contains its own force"):
        ap.stick_regions(block)


@pytest.mark.parametrize("kinetic", ["1/abs(v)", "Piecewise((1, v > 0), (2, v < 0))"])
def test_friction_without_a_finite_value_at_rest_has_no_regions(kinetic):
    x, v, F = sp.symbols("x v F", real=True)
    law = read_formula(kinetic, {"v": v})
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v, F, 1, law)])
    with pytest.raises(NotDerivable, match="has no finite value at rest, which regions need"):
        ap.stick_regions(block)


def test_the_cone_of_a_fast_velocity_does_not_depend_on_the_small_parameter():
    """A light block between a spring and a belt holds for |x| <= kappa; to say so, the region asked for mu."""
    x, v, force, kappa, mu = *sp.symbols("x v F", real=True), *sp.symbols("kappa mu", positive=True)
    block = ap.System.with_frictions({x: v + 1}, {v: force - x}, [ap.Friction(v, force, 1, kappa)], small=mu)
    stick = ap.stick_regions(block).stick
    assert str(stick) == "Abs(x) <= kappa"
    assert [stick.contains({x: at, v: 0}, kappa=2) for at in (1, 3)] == [True, False]


@pytest.mark.parametrize("stiffness", [0, 0.0, np.array([1, 0.0])])
def test_a_parameter_that_must_not_be_0_is_refused_at_0_in_doubles_too(stiffness):
    x, v, force, k = sp.symbols("x v F k", real=True)
    rates, friction = {x: v, v: force - k * x}, ap.Friction(v, force, 1, 1)
    block = ap.System.with_frictions(rates, {}, [friction], assumptions=sp.Ne(k, 0))
    with pytest.raises(InputError, match=r"k = 0(\.0)? is outside the range of this system, Ne\(k, 0\)"):
        ap.stick_regions(block).stick.contains({x: 1, v: 0}, k=stiffness)


def test_of_several_assumptions_that_fail_the_same_one_is_named_in_every_process():
    """Their order was that of hashes, which differ from one process to the next."""
    x, v, force, *many = sp.symbols("x v F k1:40", real=True)
    rates, friction = {x: v, v: force - sum(many) * x}, ap.Friction(v, force, 1, 1)
    block = ap.System.with_frictions(rates, {}, [friction], assumptions=sp.And(*(k > 0 for k in many)))
    values = dict.fromkeys(many, -1)
    with pytest.raises(InputError, match=r"k1 = -1 is outside the range of this system, k1 > 0"):
        ap.stick_regions(block).stick.contains({x: 1, v: 0}, values)
    with pytest.raises(InputError, match=r"k1 = -1 is refused; the system assumes k1 > 0"):
        ap.Scene(system=block, values=values, start={x: 1, v: 0}, until=1)


def test_a_region_that_is_one_for_all_parameters_is_told_without_a_condition():
    s, v, force = sp.symbols("s v F", real=True)
    block = ap.System.with_friction(slow={s: v}, fast={}, velocity={v: force - 1}, force=force, load=s, kinetic=2)
    assert str(ap.stick_regions(block).stick) == "(-oo, -1/2] u [1/2, oo)"


@pytest.mark.parametrize(("load", "gamma_at", "held"), [
    ("0.36", sp.Rational(1, 2), False), ("0.37", "1/2", True), (0.36, 0.5, False), (np.array([0.37]), 0.5, True),
])
def test_a_place_is_in_the_region_at_numbers_of_a_function_that_numpy_lacks(load, gamma_at, held):
    """Stick at |1 - s| <= gamma(g) |s|, where gamma(1/2)**2 = pi."""
    x, y, z, F, g = sp.symbols("x y z F g", real=True)
    drive = 1 - (x + y) + F
    system = ap.System.with_friction({x: y}, {y: drive}, {z: drive}, F, x + y, sp.gamma(g), small=sp.Symbol("mu"))
    assert bool(ap.stick_regions(system).stick.contains(load, g=gamma_at)) == held


def test_no_modulus_of_a_modulus_is_shown():
    """SymPy makes k Abs(Abs(x)) of Abs(k Abs(x))."""
    x, v, F, k = *sp.symbols("x v F", real=True), sp.Symbol("k", positive=True)
    regions = ap.stick_regions(ap.System.with_friction({x: v}, {}, {v: F - x}, F, k * sp.Abs(x), k))
    assert "Abs(Abs(" not in repr(regions)
    assert r"\left|{\left|" not in regions._repr_latex_()
    assert "stick      Abs(x) <= k**2*Abs(x)" in repr(regions)


def test_the_load_replaces_a_state_whose_coefficient_never_vanishes():
    """It replaced x, divided by a, and at a = 0 the region had no value."""
    w, x, y, a, F = sp.symbols("w x y a F", real=True)
    b, v = sp.Symbol("b", positive=True), sp.Symbol("v", real=True)
    friction = ap.Friction(velocity=v, force=F, load=a * x + b * y, kinetic=1)
    held = ap.stick_regions(ap.System.with_frictions({w: v, v: x - w + F, x: -x, y: -y}, {}, [friction])).stick
    assert [held.contains({"w": 0, "x": 2, "y": y, "v": 0}, a=0, b=1) for y in (1, 2)] == [False, True]
