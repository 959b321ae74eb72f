"""Systems of several slow and fast states: spectra and regions against the numbers themselves."""

import random
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.errors import InputError, NotDerivable
from asympk.symbolic.stability import LAMBDA, NU, Eigenvalues

x, y, z, u, w, v, p, q, F = sp.symbols("x y z u w v p q F", real=True)
k, c, m, f, f0, r = sp.symbols("k c m f f0 r", positive=True)
b = sp.Symbol("b", real=True)
mu = sp.Symbol("mu", positive=True)


def guide_and_spring():
    """A mass z on a rough guide, its normal force by an elastic support (x, y), joined to a mass (u, w) on a spring."""
    load = x + y
    return ap.System.with_friction(
        slow={x: y, u: w, w: (-k * u - c * (w - z)) / m}, fast={y: 1 - 2 * load + r * F},
        velocity={z: c * (w - z) + 1 - load + F / 2}, force=F, load=load, kinetic=f, static=f0, small=mu,
        assumptions=f0 >= f,
    )


def pendulum_on_a_guide():
    """A mass on a rough guide that drags a pendulum (p, q): the rates are not linear."""
    load = x + y + sp.cos(p) / 4
    return ap.System.with_friction(
        slow={x: y, p: q, q: -k * sp.sin(p) - z * sp.cos(p)}, fast={y: 1 - 2 * load + F},
        velocity={z: (sp.sin(p) - load + F) / m}, force=F, load=load, kinetic=f, static=f0, small=mu,
        assumptions=f0 >= f,
    )


def two_supports():
    """Two elastic supports, each fast in one state; friction on the first."""
    load = x + y
    return ap.System.with_friction(
        slow={x: y, u: w}, fast={y: 1 - 2 * load - (u + w) / 3 + F, w: 1 - r * load - 3 * (u + w)},
        velocity={z: 1 - load - (u + w) + F}, force=F, load=load, kinetic=f, static=f0, small=mu, assumptions=f0 >= f,
    )


def belt():
    """A block on a belt of speed r, with a damped spring; its load is that of an elastic support."""
    load = x + y
    friction = ap.Friction(velocity=z - r, force=F, load=load, kinetic=f / (1 + k), static=f)
    return ap.System.with_frictions(
        slow={x: y, u: z, z: -k * u - c * z + F}, fast={y: 2 - load - F / 4}, frictions=(friction,), small=mu,
    )


def oscillating_support():
    """A support whose damping is fast, too: x and y are both fast."""
    load = x + b * y
    return ap.System.with_friction(
        slow={u: z}, fast={x: y, y: 1 - x - b * y + F / 3}, velocity={z: -k * u - c * z + 1 - load + F}, force=F,
        load=load, kinetic=f, static=2 * f, small=mu,
    )


SYSTEMS = {s.__name__: s() for s in (guide_and_spring, pendulum_on_a_guide, two_supports, belt, oscillating_support)}


def values(symbols, rng):
    return {s: sp.Rational(rng.randint(1, 40), rng.randint(1, 20)) for s in sorted(symbols, key=str)}


def drawn(system, rng):
    """Return random parameters with static friction above the kinetic one, and random states on the plane v = 0."""
    at = values(system.parameters, rng)
    if f0 in at:
        at[f0] = at[f] + sp.Rational(rng.randint(0, 8), 4)
    place = {s: sp.Rational(rng.randint(-60, 60), 16) for s in system.states}
    place[z] = at[r] if system.friction.velocity == z - r else sp.S.Zero
    return at, place


@pytest.mark.few(0)
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_place_is_in_the_region_that_the_friction_cone_tells_pointwise(name):
    system, rng, seen = SYSTEMS[name], random.Random(3), set()
    regions, friction = ap.stick_regions(SYSTEMS[name]), SYSTEMS[name].friction
    rate = sum(friction.velocity.diff(s) * system.rates[s] for s in system.states)
    for _ in range(25):
        at, place = drawn(system, rng)
        drive, coupled = (sp.expand(rate.subs(at).subs(place)).coeff(F, n) for n in (0, 1))
        load, kinetic, static = (e.subs(at).subs(place) for e in (friction.load, friction.kinetic, friction.static))
        hold, slip = abs(static * load * coupled), abs(kinetic * load * coupled)
        expected = {
            "stick": abs(drive) <= hold, "up": drive > hold, "down": drive < -hold,
            "ambiguous": slip < abs(drive) <= hold,
        }
        told = {region: getattr(regions, region).contains(place, at) for region in expected}
        assert told == {region: bool(inside) for region, inside in expected.items()}
        seen |= {region for region, inside in told.items() if inside}
    assert seen >= {"stick", "up"}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.few(1)
def test_arrays_of_states_and_names_tell_what_single_exact_states_do(name):
    system, rng = SYSTEMS[name], random.Random(4)
    region = ap.stick_regions(system).stick
    at, _ = drawn(system, rng)
    places = [drawn(system, rng)[1] | {z: at.get(r, 0) if name == "belt" else 0} for _ in range(12)]
    table = {s.name: np.array([float(place[s]) for place in places]) for s in system.states}
    together = region.contains(table, **{s.name: float(value) for s, value in at.items()})
    assert together.tolist() == [region.contains(place, at) for place in places]


@pytest.mark.parametrize("name", ["guide_and_spring", "two_supports", "belt", "oscillating_support"])
@pytest.mark.few(1)
def test_the_spectrum_of_a_linear_mode_is_that_of_its_jacobian(name):
    system, rng = SYSTEMS[name], random.Random(5)
    for spectrum, mode in zip(ap.eigenvalues(system), system.modes, strict=True):
        at = values(system.parameters, rng) | {mu: sp.Rational(1, 10**6)}
        exact = matrix(mode, at)
        found = roots(spectrum.polynomial, LAMBDA, at)
        assert spectrum.neutral + len(found) == len(exact)
        assert close([*found, *[0] * spectrum.neutral], exact, 1e-6)
        fast, slow = exact[np.argsort(abs(exact))][-len(mode.fast) :], exact[np.argsort(abs(exact))][: -len(mode.fast)]
        assert close(roots(spectrum.fast_polynomial, NU, at) * 1e6, fast, 1e-3)
        assert close([*roots(spectrum.slow_polynomial, LAMBDA, at), *[0] * spectrum.neutral], slow, 1e-3)
        for rates, poly, s in ((spectrum.fast_rates, spectrum.fast_polynomial, NU),
                               (spectrum.slow_rates, spectrum.slow_polynomial, LAMBDA)):
            if rates:
                assert close([complex(rate.subs(at)) for rate in rates], roots(poly, s, at), 1e-9)


def matrix(mode, at, place=None):
    """Return the eigenvalues of the Jacobian of x' = f, y' = g / mu at numbers."""
    states = [*mode.slow, *mode.fast]
    rates = sp.Matrix([*mode.slow.values(), *(g / mu for g in mode.fast.values())])
    return np.linalg.eigvals(np.array(rates.jacobian(states).subs(place or {}).subs(at), dtype=float))


def roots(poly, symbol, at):
    return np.roots([float(value) for value in sp.Poly(poly.subs(at), symbol).all_coeffs()])


def close(found, expected, tolerance):
    """Tell whether two sets of numbers agree, in units of the largest of each pair or 1."""
    left = [*expected]
    for value in found:
        nearest = min(left, key=lambda e: abs(e - value))
        left.remove(nearest)
        if abs(nearest - value) > tolerance * max(1, abs(nearest)):
            return False
    return not left


@pytest.mark.further
def test_the_kinds_of_a_mode_of_many_states_are_those_of_its_eigenvalues():
    system, rng, seen = SYSTEMS["guide_and_spring"], random.Random(6), set()
    spectra = ap.eigenvalues(system)
    for _ in range(12):
        at = values(system.parameters, rng) | {mu: sp.Rational(1, 100)}
        for spectrum, mode in zip(spectra, system.modes, strict=True):
            parts = sorted(matrix(mode, at), key=abs)[spectrum.neutral :]
            expected = "stable" if max(n.real for n in parts) < 0 else "saddle"
            assert spectrum.kind(at).split()[0] == expected
            seen.add(expected)
    assert seen == {"stable", "saddle"}


@pytest.mark.further
def test_conditions_for_the_kinds_of_three_eigenvalues_hold_where_the_roots_say_so_and_exclude_one_another():
    system, rng, seen = SYSTEMS["oscillating_support"], random.Random(10), set()
    for spectrum in ap.eigenvalues(system):
        for _ in range(8):
            at = values(system.parameters, rng) | {b: sp.Rational(2 * rng.randint(-15, 15) + 1, 7)}
            at[f] += sp.Rational(1, 41)  # off the boundary f = 3
            told = [kind for kind, condition in spectrum.kinds if condition.xreplace(at) == sp.true]
            assert told == [spectrum.kind(at)]
            parts = roots(spectrum.polynomial, LAMBDA, at).real
            assert told[0].split()[0] == ("stable" if max(parts) < 0 else "unstable" if min(parts) > 0 else "saddle")
            seen |= {*told}
    assert len(seen) > 2


def test_without_damping_a_mode_of_many_states_is_a_centre():
    system = ap.System.smooth({u: w, w: -k * u, x: y}, {y: -x - y}, mu)
    (spectrum,) = ap.eigenvalues(system)
    assert dict(spectrum.kinds) == {"centre": sp.true}
    assert (spectrum.kind(k=2, mu=1), spectrum.hyperbolic) == ("centre", sp.true)
    (pair,) = ap.eigenvalues(ap.System.smooth({u: w}, {w: -k * u - b * w}, mu))
    assert dict(pair.kinds)["centre"] == sp.Eq(b, 0)
    assert (pair.kind(b=0, k=1, mu=1), pair.hyperbolic) == ("centre", sp.Ne(b, 0))


@pytest.mark.further
def test_the_spectrum_on_a_branch_is_that_of_the_jacobian_there():
    system, rng = SYSTEMS["pendulum_on_a_guide"], random.Random(7)
    for manifold in ap.slow_manifolds(system, order=0):
        (spectrum,) = ap.eigenvalues(system, on=manifold)
        for _ in range(4):
            at, place = drawn(system, rng)
            at[mu] = sp.Rational(1, 50)
            on = place | {y: manifold.branch[y].subs(place).subs(at)}
            found = roots(spectrum.polynomial.subs(place), LAMBDA, at)
            assert close([*found, *[0] * spectrum.neutral], matrix(manifold.dynamics, at, on), 1e-7)


def test_on_a_slow_manifold_the_jacobian_is_taken_at_the_known_order():
    system = ap.System.smooth({x: y}, {y: (1 - x**2) * y - x}, mu)
    manifold = ap.slow_manifold(system, {y: x / (1 - x**2)}, order=2)
    (first,) = ap.eigenvalues(system, on={y: x / (1 - x**2)})
    (better,) = ap.eigenvalues(system, on=manifold)
    assert sp.expand(first.fast_rates[0] - 1 + x**2) == sp.expand(better.fast_rates[0] - 1 + x**2) == 0
    at = {x: sp.Rational(1, 2), mu: sp.Rational(1, 10)}
    assert close(roots(better.polynomial, LAMBDA, at), matrix(system.modes[0], at, {y: manifold.expr.subs(at)}), 1e-9)


def test_the_spectrum_at_the_rest_states_of_a_nonlinear_system_is_that_of_the_jacobian():
    system = ap.System.smooth({x: y}, {y: (1 - x**2) * y - x}, mu)
    (spectrum,) = ap.eigenvalues(system, at={"x": 0, y: 0})
    assert isinstance(spectrum, Eigenvalues)
    assert spectrum.kind(mu="1/10") == "unstable node"
    assert spectrum.kind(mu=1) == "unstable focus"
    cubic = ap.System.smooth({x: y, u: w - u**3}, {y: x - x**3 - b * y, w: u - 2 * w}, mu)
    for place in ({x: 0, y: 0}, {x: 1, y: 0}):
        (spectrum,) = ap.eigenvalues(cubic, at={**place, u: 0, w: 0})
        at = {b: sp.Rational(3, 2), mu: sp.Rational(1, 7)}
        assert close(roots(spectrum.polynomial, LAMBDA, at), matrix(cubic.modes[0], at, {**place, u: 0, w: 0}), 1e-9)
        assert spectrum.kind(at) == "saddle"
    with pytest.raises(InputError, match=r"x = 1, y = 1 is no rest state: in smooth the rate of x is 1"):
        ap.eigenvalues(system, at={x: 1, y: 1})
    with pytest.raises(InputError, match="u not given; the spectrum depends on it"):
        ap.eigenvalues(cubic, at={x: 0, y: 0})


def test_a_rest_state_on_a_manifold_serves_as_a_place():
    pk = ap.systems.painleve_klein
    planes = ap.slow_manifolds(pk.system())
    spectra = [ap.eigenvalues(pk.system(), at=ap.rest_state(plane), mode=plane.mode)[0] for plane in planes]
    assert spectra == [s for s in ap.eigenvalues(pk.system()) if s.mode != "stick"]


def test_kinds_of_systems_with_several_parameters_exclude_one_another():
    kappa, rho = sp.symbols("kappa rho", real=True)
    load = x + y
    system = ap.System.with_friction(
        slow={x: y}, fast={y: 1 - (1 + rho) * load + F}, velocity={z: 1 - load + F}, force=F, load=load, kinetic=kappa,
        static=kappa, small=mu, assumptions=kappa > 0,
    )
    rng = random.Random(8)
    for spectrum in ap.eigenvalues(system):
        assert not any("unstable" in kind for kind, _ in spectrum.kinds)
        for _ in range(20):
            at = {kappa: sp.Rational(rng.randint(1, 30), 7), rho: sp.Rational(rng.randint(-30, 30), 11), mu: 3}
            told = [kind for kind, condition in spectrum.kinds if condition.xreplace(at) == sp.true]
            assert told == [spectrum.kind(at)]


def test_a_linear_mode_whose_slow_rate_is_its_own_has_two_mu_where_rates_meet():
    system = ap.System.smooth({x: -2 * x + y}, {y: -3 * y - x}, mu)
    (spectrum,) = ap.eigenvalues(system)
    discriminant = sp.discriminant(spectrum.polynomial, LAMBDA)
    assert sp.simplify(discriminant.subs(mu, spectrum.coalescence)) == 0
    assert all(abs(spectrum.coalescence) <= abs(value) + 1e-15 for value in sp.Poly(discriminant, mu).nroots())


@pytest.mark.further
def test_regions_of_one_load_with_symbols_for_coefficients_hold_cell_by_cell():
    d0, d1 = sp.symbols("d0 d1", real=True)
    load = x + y
    system = ap.System.with_friction(
        slow={x: y}, fast={y: 1 - 2 * load + F}, velocity={z: d0 + d1 * load + c * F}, force=F, load=load,
        kinetic=f * m, static=f * m + r, small=mu,
    )
    regions, rng = ap.stick_regions(system), random.Random(9)
    for _ in range(15):
        at = {s: Fraction(rng.randint(1, 4), 2) for s in (c, f, m, r)}
        at |= {d0: rng.randint(-2, 2), d1: rng.randint(-3, 3)}
        for name in ("stick", "up", "down", "ambiguous"):
            region = getattr(regions, name)
            union = sp.Union(*(s.as_set().subs(at) for s in region.spans(at)))
            for s in (Fraction(rng.randint(-24, 24), 6) for _ in range(4)):
                assert region.contains(s, at) == (s in union)


def test_regions_need_no_assumptions_on_symbols():
    load, g = x + y, sp.Symbol("g")
    plain = sp.symbols("X Y Z")
    system = ap.System.with_friction(
        slow={plain[0]: plain[1]}, fast={plain[1]: 1 - sum(plain[:2]) + F}, velocity={plain[2]: g - sum(plain[:2]) + F},
        force=F, load=sum(plain[:2]), kinetic=g**2, static=g**2 + 1, small=mu,
    )
    assert load.free_symbols != set(plain)
    stick = ap.stick_regions(system).stick
    assert [stick.contains(s, g=2) for s in (0, "1/4", "1/3", 2, -3)] == [False, False, True, True, True]


@pytest.mark.parametrize(
    ("place", "named", "match"),
    [
        (1, {}, "1 is no place: the region depends on more than the load"),
        ({"x": 1, "xx": 2}, {}, "xx is not a state of this system; it has .*; did you mean"),
        ({"x": 1}, {"f": 1}, "is missing; the region 'stick' depends on"),
        ({"x": 1}, {"ff": 1}, "ff is not a parameter of this system; it has .*; did you mean f"),
        ({sp.Symbol("x"): 1}, {}, "the Symbol x has other assumptions than the state of this system"),
        ({"x": 1, x: 2}, {}, "x is given twice"),
        ({"x": "one"}, {}, "x = 'one'"),
        ({"x": 1}, {"f": 2, "f0": 1}, "f = 2, f0 = 1 is outside the range of this system, f0 >= f"),
    ],
)
def test_what_is_no_place_or_parameter_is_refused_by_name(place, named, match):
    with pytest.raises(InputError, match=match):
        ap.stick_regions(SYSTEMS["guide_and_spring"]).stick.contains(place, **named)


def test_static_friction_below_the_kinetic_one_is_refused():
    load = x + y
    rates = {"slow": {x: y}, "fast": {y: 1 - load + F}, "velocity": {z: 1 - load + F}}
    parts = {**rates, "force": F, "load": load, "small": mu}
    for kinetic, static, assumed in ((2, 1, sp.true), (f, f / 2, sp.true), (k, c, c < k)):
        with pytest.raises(InputError, match="static friction is below the kinetic one"):
            ap.stick_regions(ap.System.with_friction(**parts, kinetic=kinetic, static=static, assumptions=assumed))
    with pytest.raises(InputError, match=r"kinetic friction is negative: .*; give kinetic >= 0$"):
        ap.stick_regions(ap.System.with_friction(**parts, kinetic=-f, static=f))


@pytest.mark.parametrize("name", ["guide_and_spring", "pendulum_on_a_guide", "two_supports"])
@pytest.mark.few(1)
def test_spans_whose_ends_depend_on_other_states_hold_the_places_that_the_region_contains(name):
    system, rng, met = SYSTEMS[name], random.Random(8), set()
    regions, load = ap.stick_regions(system), system.friction.load
    for _ in range(10):
        at, place = drawn(system, rng)
        for region in ("stick", "up", "down"):
            spans = getattr(regions, region).spans(at | place)
            union = sp.Union(*(span.as_set().subs(at).subs(place) for span in spans))
            inside = getattr(regions, region).contains(place, at)
            assert inside == union.contains(load.subs(place))
            met |= {region} if inside else set()
    assert met >= {"stick", "up"}


def test_a_load_that_is_a_product_of_states_holds_nothing_where_one_of_them_is_0():
    parts = {"slow": {x: y, w: -x, z: x * y + x + F}, "fast": {y: 1 - 2 * y + F}, "small": mu}
    regions = ap.stick_regions(ap.System.with_frictions(**parts, frictions=[ap.Friction(z, F, x * y, sp.S.Half)]))
    for height in ("-1/1000", 0, "1/1000"):
        place = {x: "-29/10", y: height, w: 0, z: 0}
        assert (regions.stick.contains(place), regions.down.contains(place)) == (False, True)


def test_regions_of_several_frictions_and_of_loads_that_are_not_linear_are_refused_by_name():
    G = sp.Symbol("G", real=True)
    two = ap.System.with_frictions(
        slow={z: F + G, w: -F}, fast={}, frictions=(ap.Friction(z - w, F, 1, 1), ap.Friction(z, G, 1, 1))
    )
    with pytest.raises(NotDerivable, match="2 frictions, whose cones depend on one another"):
        ap.stick_regions(two)
    quadratic = ap.System.with_friction({x: y}, {y: 1 - x**2 * y}, {z: 1 - (x + y) ** 2 + F}, F, x + y, f, small=mu)
    with pytest.raises(NotDerivable, match="no union of intervals of the load; ask contains"):
        ap.stick_regions(quadratic).stick.spans()


def test_a_number_of_sympy_keeps_its_digits_in_a_scene():
    x, v, F = sp.symbols("x v F", real=True)
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=1)])
    long, short = (ap.Scene(system=block, values={}, start={x: root, v: 0}, until=1).start[0]
                   for root in (sp.sqrt(2).evalf(50), sp.sqrt(2).evalf()))
    assert abs(sp.Rational(long) - sp.sqrt(2)) < sp.Rational(1, 10**49)
    assert short == 2**0.5


@pytest.mark.further
def test_a_chain_of_quadratic_fast_states_has_the_eigenvalues_on_its_diagonal():
    """With y_0 = x, mu y_k' = y_(k-1) - a_k y_k - y_k^2/10 attracts where a_k + y_k/5 > 0.

    The Hurwitz determinants of all three were conditions on nested roots, and of four did not end.
    """
    states = sp.symbols("y1:4", real=True)
    rates = [1 + sp.Rational(k, 5) for k in range(3)]
    fast = {y: before - a * y - y**2 / 10 for before, a, y in zip((x, *states), rates, states, strict=False)}
    found = ap.slow_manifolds(ap.System.smooth({x: states[-1] - x}, fast, mu), order=0)
    assert [plane.stability for plane in found] == ["saddle", "stable"]
    for plane in found:
        heights = [plane.branch[y].subs(x, 1).evalf() for y in states]
        signs = {bool(a + y / 5 > 0) for a, y in zip(rates, heights, strict=True)}
        assert signs == ({True} if plane.stability == "stable" else {True, False})


@pytest.mark.parametrize(("count", "sign", "branches"), [(5, "positive", 1), (3, "real", 8)])
@pytest.mark.few(1)
def test_the_branches_of_competing_species_are_those_of_every_choice_of_species(count, sign, branches):
    """y_i' = y_i (r_i - (A y)_i): those that live have A y = r; of five together SymPy had found none in a minute."""
    states = sp.symbols(f"y1:{count + 1}", **{sign: True})
    shares = sp.Matrix(count, count, lambda i, j: 1 if i == j else sp.Rational(1, 3 + (i + 2 * j) % 5))
    growth = [1 + x + sp.Rational(i, 7) for i in range(count)]
    fast = {y: y * (r - sum(shares[i, :].multiply_elementwise(sp.Matrix([states]))))
            for i, (y, r) in enumerate(zip(states, growth, strict=True))}
    found = ap.critical_manifolds(ap.System.smooth({x: states[-1] - x}, fast, mu))
    alive = {tuple(i for i, y in enumerate(states) if plane.branch[y] != 0): plane for plane in found}
    assert len(found) == len(alive) == branches
    for some, plane in alive.items():
        expected = shares.extract(some, some).LUsolve(sp.Matrix([growth[i] for i in some])) if some else []
        assert all(sp.expand(plane.branch[states[i]] - h) == 0 for i, h in zip(some, expected, strict=True))
