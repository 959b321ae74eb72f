"""Arithmetic in a differential ring is that of the expressions it stands for, and is reduced."""

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy.polys.fields import FracElement

from asympk.errors import InputError
from asympk.symbolic.diffring import DifferentialRing
from asympk.symbolic.manifold import slow_manifold
from asympk.symbolic.system import System

x, a = sp.symbols("x a")
BY_X = {x: lambda e: e.diff(x)}
EXPRESSIONS = {
    "rational": x / ((1 - x**2) ** 2 * (x + a)) - sp.Rational(1, 6),
    "shared denominators": 1 / (x * (x + 1)) + 1 / (x * (x + 2)) ** 2,
    "root": sp.sqrt(1 + x**2) / (x + a) + (1 + x**2) ** sp.Rational(-3, 2),
    "cube root": x ** sp.Rational(2, 3) / (1 + sp.cbrt(x)),
    "trigonometric": sp.sin(x) ** 3 * sp.cos(x) / (2 + sp.sin(x)),
    "exponential": sp.exp(-x) / (1 + sp.exp(x)) + sp.tanh(a * x),
    "nested": sp.log(1 + sp.exp(x)) * sp.sqrt(2),
    "not closed under d/dx": sp.gamma(x) ** 2 / x,
}


@pytest.mark.parametrize("name", EXPRESSIONS)
@pytest.mark.few(2)
def test_an_expression_and_its_derivatives_come_back_unchanged_in_value(name):
    expr = EXPRESSIONS[name]
    ring = DifferentialRing([expr], BY_X, depth=2)
    element = ring(expr)
    point = {x: sp.Rational(3, 7), a: sp.Rational(11, 5)}
    for order in range(3):
        assert abs((ring.expr(element) - expr.diff(x, order)).subs(point).evalf(50)) < 1e-45
        if order < 2:
            element = ring.diff(element, x)


def test_a_denominator_that_cannot_be_factored_is_kept_whole():
    huge = (10**300 + 7) * (3 * 10**250 + 1)
    ring = DifferentialRing([x / (12 * huge), x**2 / huge], BY_X, depth=1)
    assert ring.expr(ring(x / (12 * huge))) == x / (12 * huge)


def test_what_cancels_is_cancelled():
    ring = DifferentialRing([1 / (1 - x**2), 1 / (x + a)], BY_X, depth=1)
    assert ring.expr(ring((x**2 - 1) * (x + a) / (1 - x**2))) == -x - a
    assert ring.expr(ring.dot([(ring(1 / (x + a)), ring(x)), (ring(1 / (x + a)), ring(a))])) == 1
    assert ring.expr(ring.dot([(ring(x), ring(a)), (ring(-a), ring(x))])) == 0


def test_roots_sines_and_integers_obey_their_relations():
    ring = DifferentialRing([sp.sqrt(1 + x), sp.sin(x), sp.cos(x), x / 6], BY_X, depth=1)
    assert ring.expr(ring.dot([(ring(sp.sqrt(1 + x)), ring(sp.sqrt(1 + x)))])) == x + 1
    squares = [(ring(f(x)), ring(f(x))) for f in (sp.sin, sp.cos)]
    assert ring.expr(ring.dot(squares)) == 1
    assert ring.expr(ring.dot([(ring(x / 6), ring(4))])) == 2 * x / 3


@settings(max_examples=30)
@given(*[st.lists(st.integers(-4, 4), min_size=3, max_size=3)] * 2, st.integers(0, 2), st.integers(0, 2))
@pytest.mark.slow
def test_sums_products_and_derivatives_agree_with_sympy(p, q, m, n):
    left = sp.Poly(p, x).as_expr() / (x + a) ** m
    right = sp.Poly(q, x).as_expr() / (1 - 2 * x) ** n
    ring = DifferentialRing([left, right], BY_X, depth=2)
    one = ring.one
    assert sp.cancel(ring.expr(ring.dot([(ring(left), ring(right))])) - left * right) == 0
    assert sp.cancel(ring.expr(ring.dot([(ring(left), one), (ring(right), one)])) - left - right) == 0
    assert sp.cancel(ring.expr(ring.diff(ring(left), x)) - left.diff(x)) == 0


@pytest.mark.parametrize(
    ("expr", "message"),
    [(0.5 * x, "contains a float"), (sp.Abs(x) + 1, "is not smooth"), (sp.Max(x, 0), "is not smooth")],
)
def test_floats_and_kinks_are_refused(expr, message):
    with pytest.raises(InputError, match=message):
        DifferentialRing([expr], BY_X, depth=1)


def test_expressions_put_together_term_by_term_are_those_sympy_makes():
    """Skipping SymPy's flattening must not give an expression that SymPy would hold to be another."""
    x, a, b = sp.symbols("x a b")
    system = System.smooth(slow={x: b * x - a}, fast={b: x + a - (x + a**2 + 3) * b}, small=sp.Symbol("mu"))
    manifold = slow_manifold(system, {b: (x + a) / (x + a**2 + 3)}, order=4)
    for coefficient in manifold.coefficients:
        assert coefficient.func(*coefficient.args) == coefficient
        rebuilt = sp.sympify(str(coefficient), locals={"x": x, "a": a, "b": b})
        assert rebuilt == coefficient


def test_a_sum_of_quotients_is_an_element_without_a_search_for_divisors_in_the_field(monkeypatch):
    added = FracElement.__add__

    def of_polynomials(f, g):
        assert f.denom.is_ground
        assert g.denom.is_ground
        return added(f, g)

    monkeypatch.setattr(FracElement, "__add__", of_polynomials)
    terms = [1 / (k + x * a**k) for k in range(1, 6)]
    ring = DifferentialRing([sp.Add(*terms)], BY_X, 1)
    moved = ring.expr(ring.diff(ring(sp.Add(*terms)), x))
    place = {x: sp.Rational(2, 7), a: sp.Rational(5, 3)}
    assert moved.subs(place) == sp.Add(*terms).diff(x).subs(place)
