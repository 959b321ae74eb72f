"""Real parts of the fast rates: conditions on coefficients against the roots themselves."""

import random
from time import process_time

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.errors import NotDerivable, NotNormallyHyperbolic
from asympk.symbolic import signs
from asympk.symbolic.critical import critical_manifolds
from asympk.symbolic.hurwitz import attracting, characteristic, off_axis, repelling, split
from asympk.symbolic.long import LONG, is_longer
from asympk.symbolic.signs import conjunction, known_sign

a, b, c, d = sp.symbols("a b c d", real=True)
u, v, w, p, q = sp.symbols("u v w p q", real=True)
mu = sp.Symbol("mu", positive=True)


def kind(coefficients):
    """Return where the roots of a polynomial lie, from the roots."""
    parts = np.roots([float(k) for k in coefficients]).real
    return "attracting" if max(parts) < 0 else "repelling" if min(parts) > 0 else "split"


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
@pytest.mark.few(1)
def test_conditions_on_symbols_tell_the_sides_of_the_roots_at_random_values(degree):
    rng = random.Random(degree)
    symbols = sp.symbols(f"c0:{degree}", real=True)
    told = {f.__name__: f(((sp.S.One, *symbols),)) for f in (attracting, repelling, split, off_axis)}
    seen = set()
    for k in range(18 if degree < 5 else 3):
        signs = ([1], [-1], [1, -1])[k % 3]
        rates = [sp.Rational(rng.randint(1, 2), rng.randint(1, 3)) * rng.choice(signs) for _ in range(degree)]
        at = dict(zip(symbols, sp.Poly(sp.prod(a + rate for rate in rates), a).all_coeffs()[1:], strict=True))
        expected = kind((1, *at.values()))
        found = {name for name, condition in told.items() if condition.subs(at) == sp.true}
        assert found == {expected, "off_axis"}
        seen.add(expected)
    assert seen >= {"attracting", "repelling"}


def test_pairs_on_the_imaginary_axis_are_found_beside_any_other_roots():
    rng = random.Random(5)
    symbols = sp.symbols("c0:4", real=True)
    condition = off_axis(((sp.S.One, *symbols),))
    for _ in range(30):
        square, sums, product = (sp.Rational(rng.randint(1, 9), rng.randint(1, 4)) for _ in range(3))
        on, off = ((a**2 + s * square) * (a**2 + sums * a + product) for s in (1, -1))
        for poly, expected in ((on, sp.false), (off, sp.true)):
            at = dict(zip(symbols, sp.Poly(poly, a).all_coeffs()[1:], strict=True))
            assert condition.subs(at) == expected


@pytest.mark.slow
def test_pairs_on_the_imaginary_axis_are_found_within_seconds_where_coefficients_are_long():
    begun = process_time()
    c3, c2, c1, c0 = (k + 1 + sum(sp.cos(i * p + k * q) * sp.sin(i * q) * (a + i * b) for i in range(1, 45))
                      for k in range(4))
    condition = off_axis(((1, c3, c2, c1 + c, c0 + d),))
    at = {p: sp.S.Zero, q: sp.pi / 2, a: sp.S.One, b: sp.Integer(2)}
    third, second, first, last = (coefficient.subs(at) for coefficient in (c3, c2, c1, c0))
    for off, expected in ((0, sp.false), (1, sp.true)):  # s^2 + 1 divides s^4 + c3 s^3 + .. where off is 0
        assert condition.xreplace({**at, c: third - first + off, d: second - 1 - last}) == expected
    assert process_time() - begun < 10


def test_two_pairs_of_opposite_real_rates_are_no_centre():
    assert off_axis(((1, 0, -5, 0, 4),)) == sp.true
    assert off_axis(((1, 0, 5, 0, 4),)) == sp.false
    assert off_axis(((1, 0, -1, 0, 4),)) == sp.true  # four complex roots
    assert off_axis(((1, 0, 6, 0, 11, 0, 6),)) == sp.false
    with pytest.raises(NotDerivable, match="put numbers in for b"):
        off_axis(((1, 0, b, 0, 11, 0, 6),))


def two_fast(matrix, **options):
    rates = sp.Matrix(matrix) * sp.Matrix([v, w])
    return ap.System.smooth({u: -u}, {v: rates[0], w: rates[1] + 0 * u}, mu, **options)


def test_a_centre_is_not_normally_hyperbolic_and_no_saddle():
    system = two_fast([[0, 1], [-1, 0]])
    with pytest.raises(NotNormallyHyperbolic, match=r"real part 0 \(a centre\) on v = 0, w = 0; no slow"):
        ap.slow_manifold(system, {v: 0, w: 0})
    (critical,) = critical_manifolds(system)
    assert critical.exists == sp.false
    with pytest.raises(NotNormallyHyperbolic, match="a centre"):
        critical.stability  # noqa: B018
    assert ap.slow_manifolds(system) == ()


def test_damping_makes_of_a_centre_a_stable_or_an_unstable_manifold():
    (critical,) = critical_manifolds(two_fast([[0, 1], [-1, -a]]))
    assert critical.exists == sp.Ne(a, 0)
    assert critical.attracting == (a > 0)
    assert critical.repelling == (a < 0)
    assert critical.saddle == sp.false
    assert critical.at(a=1).stability == "stable"
    assert critical.at(a="-1/7").stability == "unstable"
    with pytest.raises(NotNormallyHyperbolic, match=r"a centre\) .* \(a = 0\); Pi1 exists only for a != 0"):
        critical.at(a=0)


def test_an_undamped_spring_is_a_centre_or_a_saddle_by_the_sign_of_its_stiffness():
    (critical,) = critical_manifolds(two_fast([[0, 1], [-b, 0]]))
    assert critical.exists == critical.saddle == (b < 0)
    assert critical_manifolds(two_fast([[0, 1], [-b, 0]], assumptions=b > 0))[0].exists == sp.false
    assert critical_manifolds(two_fast([[0, 1], [-b, 0]], assumptions=b < 0))[0].stability == "saddle"


def test_three_fast_states_are_told_by_routh_and_hurwitz():
    fast = {v: w, w: p, p: -a * v - b * w - c * p}
    (critical,) = critical_manifolds(ap.System.smooth({u: -u}, fast, mu, sp.And(a > 0, b > 0, c > 0)))
    assert critical.attracting == (-a + b * c > 0)
    assert critical.exists == sp.Ne(a - b * c, 0)
    assert critical.repelling == sp.false
    assert (critical.at(a=5, b=2, c=3).stability, critical.at(a=7, b=2, c=3).stability) == ("stable", "saddle")
    with pytest.raises(NotNormallyHyperbolic, match="a centre"):
        critical.at(a=6, b=2, c=3)


def test_stability_of_random_fast_matrices_is_that_of_their_eigenvalues():
    rng = random.Random(11)
    seen = set()
    for k in range(9):
        shift = (-5, 0, 5)[k % 3]
        matrix = sp.Matrix(3, 3, lambda i, j, shift=shift: sp.Rational(rng.randint(-4, 4), 2) + shift * (i == j))
        rates = dict(zip((v, w, p), matrix * sp.Matrix([v, w, p]), strict=True))
        parts = np.linalg.eigvals(np.array(matrix, dtype=float)).real
        if min(abs(parts)) < 1e-9:
            continue
        expected = "stable" if max(parts) < 0 else "unstable" if min(parts) > 0 else "saddle"
        assert ap.slow_manifold(ap.System.smooth({u: -u}, rates, mu), {v: 0, w: 0, p: 0}).stability == expected
        seen.add(expected)
    assert len(seen) == 3


def test_a_sign_that_bounds_imply_is_known():
    assert known_sign(a + b + 3, sp.And(a > -1, b >= a)) == 1
    assert known_sign(a - b - 1, sp.And(b >= a)) == -1
    assert known_sign(a + b, a > 0) == 0
    assert known_sign(a * b, sp.And(a > 0, b < 0)) == -1


def test_the_sign_of_an_expanded_product_is_that_of_its_factors_however_long_it_is():
    p, q = sp.symbols("p q", positive=True)
    product = sp.expand((p * q + p + 1) ** 5 * (q**2 + p + 2) ** 5 * (p - q))
    assert is_longer(product, LONG)
    assert conjunction([(product, 1)]) == (p - q > 0)


@pytest.mark.parametrize("factor", [a - b, 2 + sp.cos(u)])
def test_a_sign_is_known_however_long_the_product_is_that_has_been_expanded(factor):
    long = sp.expand(factor * (1 + a**2 + b**2 + c**2 + d**2) ** 4)
    assert [known_sign(sign * long, a > b) for sign in (1, -1)] == [1, -1]


def test_no_bounds_are_sought_of_a_long_sum_of_several_waves(monkeypatch):
    monkeypatch.setattr(signs, "_without_waves", lambda expr: pytest.fail("bounds were sought"))
    long = sp.expand((2 * sp.cos(u) + 3 * sp.sin(u) + a + b + c) ** 6)
    assert is_longer(long, LONG)
    assert not signs.follows(long > 0, (a > b,))


def test_products_of_waves_are_bounded_as_sums_of_waves():
    """The sum is that of (a sin u)^2 and (b sin(u + v))^2."""
    squares = sp.sin(u) ** 2 + 2 * sp.sin(u) * sp.sin(v) * sp.cos(u + v) + sp.sin(v) ** 2
    assert [known_sign(sign * (a**2 * sp.sin(u) ** 2 + b**2 * squares), sp.true) for sign in (1, -1)] == [1, -1]


def test_a_coefficient_keeps_its_squares_of_sums_and_its_sums_of_squares():
    below = a**2 * sp.cos(u) ** 2 + b**2 * sp.sin(u) ** 2
    entry = (sp.sin(u) * sp.cos(v) + sp.sin(v) * sp.cos(u)) ** 2 / below
    assert characteristic(sp.Matrix([[-entry]])) == (1, sp.sin(u + v) ** 2 / below)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["brake_shoe", "crank_slider"])
def test_a_contact_that_sticks_is_damped_at_all_angles_and_sizes(name):
    system = getattr(ap.systems, name).system()
    assert [m.stability for m in critical_manifolds(system) if m.mode == "stick"] == ["stable"]


def test_a_conjunction_never_contradicts_itself():
    assert conjunction([(a + b, 1), (-3 * (a + b) * c**2, 1)]) == sp.false
    assert conjunction([(a * b, 1), (a, 1)]) == sp.And(a > 0, b > 0)
    assert conjunction([(a - b, 0), ((a - b) * c, 1)]) == sp.false
    assert conjunction([(sp.S.Zero, 0)]) == sp.true
