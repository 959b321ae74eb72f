"""The forms u' M^-1 v of a matrix that is never inverted in symbols, beside the same forms written out."""

import re

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.symbolic.inverses import InverseForm, product, total
from asympk.symbolic.lowering import Lowered

a, b, c = sp.symbols("a b c", real=True)
MATRIX = sp.Matrix([[3 + sp.cos(a), b, c], [b, 4 + a**2, a * b], [c, a * b, 5 + b**2 + a**2 * c**2]])
LEFT, RIGHT = (1, a, b), (c, sp.sin(b), 1)
FORM = InverseForm.of(LEFT, MATRIX, RIGHT)
WRITTEN_OUT = (sp.Matrix([LEFT]) * MATRIX.adjugate() * sp.Matrix(RIGHT))[0] / MATRIX.det()
PLACE = (0.4, -0.7, 0.9)


@pytest.mark.slow
def test_a_form_has_the_values_and_the_derivatives_of_the_inverse_written_out():
    at = {s: sp.Float(k, 40) / 7 for k, s in enumerate((a, b, c), 1)}
    slopes = [(FORM.diff(s), WRITTEN_OUT.diff(s)) for s in (a, b)]
    bends = [(form.diff(s), written.diff(s)) for form, written in slopes for s in (b, c)]
    for both in ((FORM, WRITTEN_OUT), *slopes, *bends):
        form, written = (e.xreplace(at) for e in both)
        assert abs(form - written) < 1e-28
    assert InverseForm.of((1, 0), sp.Matrix([[2, 1], [1, 3]]), (0, 5)) == -1
    assert InverseForm.of((0, 0, 0), MATRIX, RIGHT) == 0


@pytest.mark.parametrize("target", ["math", "numpy", "mpmath"])
def test_a_form_is_computed_on_every_kind_of_numbers(target):
    nested = InverseForm.of((FORM, 1, 0), MATRIX, (0, c, FORM))
    found = [*map(float, ap.lower((a, b, c), (FORM, nested), target)(*PLACE))]
    A, B, C = PLACE
    M = np.array([[3 + np.cos(A), B, C], [B, 4 + A**2, A * B], [C, A * B, 5 + B**2 + A**2 * C**2]])
    first = np.array([1, A, B]) @ np.linalg.solve(M, [C, np.sin(B), 1])
    second = np.array([first, 1, 0]) @ np.linalg.solve(M, [0, C, first])
    assert found == pytest.approx([first, second], rel=1e-13)


def test_the_derivatives_of_a_form_along_directions_pass_through_its_elimination():
    directions = ((sp.S.One, sp.S.Zero, sp.S.Zero), (a, sp.Integer(2), b * c))
    form, written = (Lowered((a, b, c), (e,), "math", directions=directions)(*PLACE) for e in (FORM, WRITTEN_OUT))
    assert np.allclose(form, written, rtol=1e-13, atol=0)


def test_the_derivative_of_a_form_that_is_one_of_its_entries_is_that_of_the_entry():
    unit, turned = sp.eye(2), sp.Matrix([[1, a], [a, 2]])
    for entry in (a, FORM, InverseForm.of((1, FORM), turned, (b, 0))):
        alike = [InverseForm.of((1, 0), unit, (entry, 0)), InverseForm.of((entry, 0), unit, (1, 0)),
                 InverseForm.of((1, 0), sp.Matrix([[1, entry], [entry, entry**2 + 1]]), (0, -1))]
        for form in alike:
            slopes = (Lowered((a, b, c), (e,), "math", directions=((sp.S.One, a, b),)) for e in (entry, form))
            expected, found = (slope(*PLACE) for slope in slopes)
            assert found == pytest.approx(expected, rel=1e-13)


def test_a_pivot_vanishes_where_the_matrix_is_singular_and_nowhere_else():
    form = InverseForm.of((1, 0), sp.Matrix([[1, sp.sin(a)], [sp.sin(a), 1]]), (b, c))
    near, far = (ap.lower((a, b, c), form.pivots, "math")(at, 1, 1) for at in (np.pi / 2 - 1e-4, 0))
    assert near == pytest.approx((1e-8, 1e-8), rel=1e-6)
    assert far == (1, 1)


def test_a_matrix_of_twelve_rows_is_eliminated_in_some_thousand_operations():
    n = 12
    entries = sp.symbols("q:12", real=True)
    matrix = sp.Matrix(n, n, lambda i, j: sp.cos(entries[i] - entries[j]) + n * (i == j))
    form = InverseForm.of(entries, matrix, [sp.sin(q) for q in entries])
    lowered = ap.lower(entries, (form,), "math")
    assert len(lowered.source.splitlines()) < 500
    place = np.linspace(-1, 1, n)
    M = np.cos(place[:, None] - place) + n * np.eye(n)
    assert lowered(*place)[0] == pytest.approx(place @ np.linalg.solve(M, np.sin(place)), rel=1e-12)


def test_the_derivatives_of_twelve_solutions_have_fewer_steps_than_those_of_the_factors_of_their_matrix():
    n, (every, place) = 12, (sp.symbols("q:12", real=True), np.linspace(-1, 1, 12))
    matrix = sp.Matrix(n, n, lambda i, j: sp.cos(every[i] - every[j]) + n * (i == j))
    forms = tuple(InverseForm.of(row, matrix, [sp.sin(q) for q in every]) for row in sp.eye(n).tolist())
    M, apart = np.cos(place[:, None] - place) + n * np.eye(n), place[:, None] - place
    x = np.linalg.solve(M, np.sin(place))
    turned = np.array([-np.sin(apart) * ((np.arange(n) == k)[:, None] - 1.0 * (np.arange(n) == k)) for k in range(n)])
    slopes = np.array([np.linalg.solve(M, np.cos(place) * (np.arange(n) == k) - turned[k] @ x) for k in range(n)]).T
    for outputs, rows, steps in ((forms, sp.eye(n), 1000), (forms, sp.ones(1, n), 550), (forms[:1], sp.eye(n), 700)):
        lowered = Lowered(every, outputs, "math", directions=tuple(map(tuple, rows.tolist())))
        assert len(lowered.source.splitlines()) < steps
        expected = slopes[: len(outputs)] @ np.array(rows, dtype=float).T
        assert np.allclose(lowered(*place), expected.ravel(), rtol=1e-12, atol=1e-14)


def test_the_derivatives_of_an_elimination_name_no_negated_symbol():
    directions = ((sp.S.One, sp.S.Zero, sp.S.Zero),)
    lines = Lowered((a, b, c), (FORM,), "math", directions=directions).source.splitlines()
    assert not [line for line in lines if line.partition("= -")[2].isidentifier()]


def test_a_form_that_is_one_of_its_entries_is_written_before_what_contains_it():
    """Runs of three cylinders, whose masses couple nowhere, ended in Python's error on a local variable."""
    product = b * InverseForm.of((1, 0), sp.eye(2), (sp.sin(a), 0))
    found = ap.lower((a, b), (product + 1, sp.cos(product)), "math")(*PLACE[:2])
    assert found == pytest.approx((PLACE[1] * np.sin(PLACE[0]) + 1, np.cos(PLACE[1] * np.sin(PLACE[0]))), rel=1e-14)


@pytest.mark.parametrize("directions", [(), ((a, sp.S.One, b),)])
@pytest.mark.parametrize("target", ["c", "math"])
def test_every_step_of_an_elimination_that_is_written_is_read(directions, target):
    """Compilers warned of steps towards components of M^-1 v that no form contains."""
    forms = tuple(InverseForm.of(u, MATRIX, v) for u, v in (((0, 1, 0), RIGHT), ((0, 0, 1), (0, 1, b))))
    source = Lowered((a, b, c), forms, target, directions=directions).source
    steps = re.findall(r"\b(t\d+) = ", source)
    assert len(steps) > 20
    assert not [step for step in steps if len(re.findall(rf"\b{step}\b", source)) < 2]


def test_lambdify_of_sympy_computes_a_form_on_arrays():
    at = np.linspace(0, 1, 3)
    found = sp.lambdify((a, b, c), FORM, "numpy")(at, at + 1, 2.0)
    assert found == pytest.approx([float(FORM.subs({a: t, b: t + 1, c: 2})) for t in at], rel=1e-14)


def test_sums_of_products_that_are_not_searched_for_like_terms_are_those_of_sympy():
    p, q, r = sp.symbols("p q r", real=True)
    factors = (p, q, r, -p, -q, sp.S.Zero, sp.S.One, -sp.S.One, p**2, q + r, 2 * p)
    products = [product(a, b, sign) for a in factors for b in factors for sign in (1, -1)]
    assert products == [sign * a * b for a in factors for b in factors for sign in (1, -1)]
    for terms in ((p * q, -p * q), (p * q, p * q), (p, q, -p * r), (p, 0, 0), (2 * p, 3 * p), (p, 1, q * r, -1), ()):
        assert total(map(sp.sympify, terms)).equals(sum(terms))
        assert total(map(sp.sympify, terms)).count_ops() == sp.Add(*terms).count_ops()
