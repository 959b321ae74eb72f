"""A tape replays a derivation on floats, mpmath numbers and symbols; signs and what is trivial cost no line."""

import itertools
import math
from fractions import Fraction

import mpmath
import sympy as sp

from asympk.asymptotics.tape import Tape
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.taylor import CHOICES, Taylor, evaluated, with_removables

THIRD = Fraction(1, 3)


def a_formula(u, v):
    return (-u - v) * (u - v) / -(v - 3) - (2 - u) * THIRD + -v / (1 - -u) - -(THIRD - v) * -1


def test_a_tape_replays_its_formula_on_exact_numbers_whatever_the_signs():
    tape = Tape("u", "v")
    replayed = tape.function((a_formula(tape.node("u"), tape.node("v")),))
    u, v = sp.Rational(5, 7), sp.Rational(-11, 3)
    assert replayed(u, v) == (a_formula(*map(sp.Rational, (u, v))),)
    with mpmath.workdps(40):
        (found,), right = replayed(*(mpmath.mpf(w.p) / w.q for w in (u, v))), a_formula(u, v)
        assert abs(found - mpmath.mpf(right.p) / right.q) < mpmath.mpf(10) ** -38


def test_every_sum_difference_product_and_quotient_of_signed_nodes_is_right():
    numbers = {"u": 7, "v": -3}
    for (p, q), operation in itertools.product(itertools.product((1, -1), repeat=2), "+-*/"):
        tape = Tape("u", "v")
        a, b = (tape.node(name) if sign > 0 else -tape.node(name) for name, sign in (("u", p), ("v", q)))
        (found,) = tape.function((tape.write(operation, a, b),))(**numbers)
        assert found == eval(f"({p} * 7) {operation} ({q} * -3)"), (p, q, operation)


def test_signs_and_trivial_operations_write_no_line():
    tape = Tape("u")
    u = tape.node("u")
    assert (u * 0, 0 * u, 0 / u) == (0, 0, 0)
    for same in (u * 1, 1 * u, u / 1, u + 0, 0 + u, u - 0, -1 * -u, -u / -1, 0 - -u):
        assert (same.name, same.sign) == ("u", 1)
    assert not tape.lines
    assert {(u * 2).name, (-u * 2).name, (u * -2).name} == {"t0"}
    assert len(tape.lines) == 1


def test_functions_of_numbers_are_exact_where_rational_and_stay_where_not():
    tape = Tape("log", "exp", "u")
    assert tape.call("exp", 0) == 1
    assert tape.call("log", 1) == 0
    (found,) = tape.function((tape.call("log", 2) * tape.node("u"),))(math.log, math.exp, 3.0)
    assert found == math.log(2) * 3.0


def test_fractions_are_not_rounded_before_the_numbers_are():
    tape = Tape("u")
    (found,) = tape.function((tape.node("u") * THIRD + THIRD,))(sp.Integer(1))
    assert found == sp.Rational(2, 3)


def test_the_series_of_a_form_through_an_inverse_is_that_of_the_inverse_written_out():
    a, b = sp.symbols("a b", real=True)
    matrix, u, v = sp.Matrix([[3 + sp.cos(a), b], [b, 4 + a**2]]), (1, a), (sp.sin(b), a * b)
    written = (sp.Matrix([u]) * matrix.adjugate() * sp.Matrix(v))[0] / matrix.det()
    tape = Tape("u", "sin", "cos")
    moved = [Taylor({(0, 0): tape.node("u") * k, (1, 0): k, (0, 1): 2, (1, 1): THIRD}, 3) for k in (1, 2)]
    series = evaluated((InverseForm.of(u, matrix, v), written), dict(zip((a, b), moved, strict=True)), tape)
    indices = sorted(series[1].terms)
    values = tape.function(tuple(one[index] for one in series for index in indices))(0.4, math.sin, math.cos)
    assert len(indices) == 10
    assert all(math.isclose(*pair, rel_tol=1e-13, abs_tol=1e-15)
               for pair in zip(values[:10], values[10:], strict=True))


def test_a_quotient_that_is_0_over_0_and_its_derivatives_keep_their_digits_beside_that_place():
    v = sp.Symbol("v", real=True)
    bernoulli = with_removables((v + 2) / (sp.exp((v + 2) / 3) - 1), (v,))
    tape = Tape("v")
    exprs = [bernoulli.diff(v, k) for k in range(4)]
    found = tape.function(tuple(evaluated(exprs, {v: tape.node("v")}, tape)), {"exp": math.exp} | CHOICES)
    for place in (-2.0, -2 + 1e-9, -1.99, -1.0, 1.5, 4.0):
        with mpmath.workdps(60):
            u = (mpmath.mpf(place) + 2) / 3 or mpmath.mpf(10) ** -30
            known = [float(mpmath.diff(lambda w: 3 * w / mpmath.expm1(w), u, k) / 3**k) for k in range(4)]
        assert max(abs(a - b) for a, b in zip(found(place), known, strict=True)) < 1e-14


def test_a_factor_that_is_not_0_beside_the_divisor_stays_apart_and_keeps_its_digits():
    """x (1 - cos(x - 1))/(x - 1)^2 as a function of x - 1 lost the digits of a small x."""
    v = sp.Symbol("v", real=True)
    alone = (1 - sp.cos(v - 1)) / (v - 1) ** 2
    assert with_removables(v * alone, (v,)) == v * with_removables(alone, (v,)) != v * alone
    wave, steep = sp.sin(v) / v, sp.cosh(1000 * v)
    assert with_removables(wave * steep, (v,)) == with_removables(wave, (v,)) * steep


def test_a_pole_and_a_quotient_of_two_arguments_stay_as_they_are():
    u, v = sp.symbols("u v", real=True)
    for quotient in ((sp.exp(v) - 1) / v**2, sp.sin(v) / (v - 1), (sp.exp(v) - sp.exp(u * v)) / v, 1 / v):
        assert with_removables(quotient, (u, v)) == quotient


def test_of_a_product_whose_divisor_is_not_0_no_series_is_sought(monkeypatch):
    """Those of atan and erf to order 36 took 0.6 s."""
    v = sp.Symbol("v", real=True)
    monkeypatch.setattr("asympk.symbolic.taylor._from_zero", None)
    for product in (sp.atan(v) / (1 + v), sp.erf(v) / (2 + v) ** 2):
        assert with_removables(product, (v,)) == product
