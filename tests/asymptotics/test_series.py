"""Series in mu and L = log(1/mu): the algebra is exact, and nothing is ever known beyond the remainder."""

from fractions import Fraction
from math import comb, factorial, log

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from asympk.asymptotics.ratio import Ratios
from asympk.asymptotics.series import O, Series, balance, series
from asympk.errors import InputError, NotDerivable, OrderError

MU, L = series({(1, 0): 1}), series({(0, 1): 1})

monomials = st.tuples(st.integers(-2, 3), st.integers(0, 3))
some = st.builds(
    Series, st.dictionaries(monomials, st.integers(-5, 5), max_size=5), st.one_of(st.none(), monomials)
)


def same(a, b):
    return a.terms == b.terms and a.remainder == b.remainder


@settings(max_examples=100)
@given(some, some, some)
@pytest.mark.slow
def test_addition_and_multiplication_are_those_of_a_commutative_ring(a, b, c):
    assert same(a + b, b + a)
    assert same(a * b, b * a)
    assert same((a + b) + c, a + (b + c))
    assert same((a * b) * c, a * (b * c))


def test_a_series_at_a_number_has_the_logarithm_of_its_inverse_and_none_at_0():
    assert (2 * MU * L + 3 * MU**2)(Fraction(1, 4)) == pytest.approx(log(4) / 2 + 3 / 16)
    with pytest.raises(InputError, match="mu = 0: it must be positive"):
        L(0)


@settings(max_examples=100)
@given(some, some, some)
def test_multiplication_distributes_as_far_as_both_sides_are_known(a, b, c):
    difference = a * (b + c) - (a * b + a * c)
    assert not difference.terms


@settings(max_examples=100)
@given(some)
def test_no_term_is_kept_that_the_remainder_absorbs(a):
    for p, q in (a * a).terms:
        assert a.remainder is None or (p, -q) < ((a * a).remainder[0], -(a * a).remainder[1])


def test_of_equal_powers_of_mu_the_higher_power_of_L_is_larger():
    assert list((MU + L * MU + 1 + L * L * MU).terms) == [(0, 0), (1, 2), (1, 1), (1, 0)]
    assert (1 + MU * L + MU + O(1, 0)).terms == {(0, 0): 1, (1, 1): 1}


def test_the_remainder_of_a_product_is_the_larger_of_the_two_it_may_come_from():
    assert ((2 / MU + O(0)) * (MU * L + O(3))).remainder == (1, 1)
    assert ((MU + O(2)) * (MU + O(3, 2))).remainder == (3, 0)
    assert ((MU + O(2)) * (MU * L + O(3, 2))).remainder == (3, 1)


def test_a_series_times_its_inverse_is_one():
    a = 3 * MU + MU**2 * L + Fraction(1, 7) * MU**3 + O(5)
    product = a * a.inverse()
    assert product.terms == {(0, 0): 1}
    assert product.remainder == (4, 0)


def test_the_exponential_of_L_is_one_over_mu_and_its_logarithm_gives_it_back():
    assert (2 * L).exp().terms == {(-2, 0): 1}
    u = MU * L + 2 * MU + O(5)
    assert not (u.exp().log(lambda c: 0) - u).terms
    assert ((L + MU + O(3)).exp() * MU).terms == {(0, 0): 1, (1, 0): 1, (2, 0): Fraction(1, 2)}


def test_coefficients_of_the_exponential_are_reciprocal_factorials():
    assert [(MU + O(6)).exp().coefficient(k) for k in range(6)] == [Fraction(1, factorial(k)) for k in range(6)]


@pytest.mark.parametrize("exponent", [1 + MU + O(2), L**2, 1 / MU, Fraction(1, 2) * L])
def test_the_exponential_of_what_is_not_small_is_a_series_for_whole_multiples_of_L_alone(exponent):
    with pytest.raises(NotDerivable, match="not a series"):
        exponent.exp()


def test_a_constant_term_is_exponentiated_by_the_function_given_for_it():
    assert (2 - L + MU + O(2)).exp(sp.exp).terms == {(1, 0): sp.exp(2), (2, 0): sp.exp(2)}


def test_the_logarithm_of_a_power_of_L_is_refused():
    with pytest.raises(NotDerivable, match="log L"):
        (MU * L).log(sp.log)


def test_an_exact_series_has_no_exact_inverse():
    with pytest.raises(OrderError, match="add a remainder"):
        (1 + MU).inverse()


@pytest.mark.parametrize("ask", [lambda a: a.coefficient(2), lambda a: a.truncated(2), lambda a: a.power(2)])
def test_asking_beyond_the_remainder_is_an_error(ask):
    a = 1 + MU + O(2)
    with pytest.raises(OrderError):
        ask(a)
    assert a.coefficient(1) == 1


def test_a_truncation_says_what_it_left_out():
    a = 1 + MU * L + 5 * MU + MU**2 * L * L + O(3)
    assert a.truncated(1, 1).remainder == (1, 0)
    assert a.truncated(1).remainder == (2, 2)
    assert str(a.truncated(1)) == "(1) + (1) mu L + (5) mu + O(mu^2 L^2)"


def test_a_series_is_written_in_its_small_parameter_as_text_and_as_latex():
    eps = sp.Symbol("eps")
    a = Series({(0, 0): 1, (1, 0): 5, (2, 0): 7}, (3, 1), eps)
    assert str(a) == "(1) + (5) eps + (7) eps^2 + O(eps^3 L)"
    assert "eps^{2}" in sp.latex(a)
    with pytest.raises(OrderError, match=r"of eps\^4 is not known"):
        a.coefficient(4)


def test_the_slow_root_of_the_quadratic_has_catalan_numbers():
    slow = balance(lambda w: MU * w * w - 1, series(-1), 8)
    assert [slow.coefficient(k) for k in range(9)] == [(-1) ** (k + 1) * comb(2 * k, k) // (k + 1) for k in range(9)]


def test_both_dominant_balances_of_a_quadratic_multiply_to_its_last_coefficient():
    slow = balance(lambda w: MU * w * w - 1, series(-1), 5)
    fast = balance(lambda w: (1 + w.inverse()) / MU, 1 / MU, 5)
    assert not (slow * fast + 1 / MU).terms


def test_a_term_that_does_not_balance_is_refused():
    with pytest.raises(NotDerivable, match="does not balance"):
        balance(lambda w: MU * w * w - 1, MU, 3)


def logarithmic(order):
    """Return the root w of w (1 + mu log(w/mu)) = 3."""
    return balance(lambda w: 3 - MU * w * (w / MU).log(sp.log), series(3), order)


def test_an_equation_with_logarithms_is_solved_to_the_order_asked_for():
    found = logarithmic(3)
    residual = (found * (1 + MU * (found / MU).log(sp.log)) - 3).map(sp.cancel)
    assert not residual.terms
    assert residual.remainder == found.remainder == (4, 4)


@pytest.mark.slow
@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_error_over_first_omitted_terms_tends_to_one(order):
    mu, w = sp.symbols("mu w")
    equation, found = w * (1 + mu * sp.log(w / mu)) - 3, logarithmic(order + 1)
    kept, omitted = found.truncated(order), found.power(order + 1)
    closeness = []
    for k in (2, 3, 4):
        at = 10.0**-k
        here = sp.Rational(1, 10**k)
        error = sp.nsolve(equation.subs(mu, here), w, 3, prec=40) - sp.N(kept(here, sp.log), 40)
        closeness.append(abs(float(error / sp.N(omitted(here, sp.log), 40)) - 1))
        assert closeness[-1] < 40 * at * log(1 / at)
    assert closeness[0] > closeness[1] > closeness[2]


def test_balance_gains_a_power_of_mu_in_each_pass():
    found = balance(lambda v: 1 + MU * v * v, series(1), 6)
    assert [found.coefficient(k) for k in range(7)] == [1, 1, 2, 5, 14, 42, 132]
    with pytest.raises(OrderError):
        found.coefficient(7)


def test_arrays_are_coefficients_like_any_other():
    a = np.array([1.0, 2.0]) * MU + 3 + O(4)
    inverse = (a * a.inverse())(1e-3)
    assert np.allclose(inverse, 1, atol=1e-11)
    assert (np.array([1.0, 2.0]) * MU).terms.keys() == {(1, 0)}


def test_ratios_cancel_what_cancels_and_know_zero():
    x, s = sp.symbols("x s")
    ring = Ratios((x, s), 1)
    a = ring((x**2 - s**2) / (x * (x + s)))
    assert a == ring((x - s) / x)
    assert a - ring(1) + ring(s / x) == 0
    assert sp.cancel((1 / a).expr - x / (x - s)) == 0
    assert ring.expr(ring.log(a) * a) == sp.log((-s + x) / x) * (-s + x) / x


@pytest.mark.parametrize("mode", ["plain", "inline", "equation"])
def test_a_series_is_one_formula_in_every_mode_of_the_printer(mode):
    kappa, small = sp.Symbol("kappa", positive=True), sp.Symbol("mu__0", positive=True)
    shown = sp.latex(Series({(1, 0): 1 / kappa, (2, 1): 1 + kappa}, (3, 0), small), mode=mode)
    assert shown.count("$") == 2 * (mode == "inline")
    assert shown.count("equation") == 2 * (mode == "equation")
    assert "^{0}^" not in shown  # TeX refuses a superscript of a superscript
    assert mode != "inline" or r"\left(1 / \kappa\right)" in shown


@pytest.mark.parametrize("hidden", [O(2), MU - MU + O(1)])
def test_a_dominant_term_that_the_remainder_hides_is_not_known(hidden):
    with pytest.raises(OrderError, match="the dominant term is not known"):
        hidden.leading  # noqa: B018 - raises
    with pytest.raises(OrderError, match="the dominant term is not known"):
        hidden.inverse()
