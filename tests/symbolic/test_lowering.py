"""Every target computes the expression, exactly where it can, and refuses what has no number."""

import ctypes
import math
import os
import pickle
import shutil
import subprocess
import sys
from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import asympk as ap
from asympk.errors import InputError, OutOfRange, UnknownName
from asympk.symbolic.lowering import lower
from asympk.symbolic.penetration import Penetration
from asympk.symbolic.printers import printer_of

x, mu, sigma = sp.symbols("x mu sigma")
EXPR = sp.Rational(1, 3) * x**2 / mu + sp.exp(-x) / sigma**3 + sp.pi * sp.sqrt(x)
TARGETS = ["numpy", "math", "mpmath"]


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_remainder_in_c_has_the_sign_of_the_divisor_where_their_product_underflows(tmp_path):
    (remainder,) = compiled_c([sp.Mod(x, -sp.Rational(1, 10**200))], tmp_path)
    assert [remainder(at * 1e-200) for at in (0.75, -0.25, 1.0)] == [-0.25e-200, -0.25e-200, 0]


@pytest.mark.parametrize("target", TARGETS)
def test_a_quotient_of_integers_of_thousands_of_digits_is_a_number_in_every_target(target):
    third = sp.Rational(10**5000 + 1, 3 * 10**5000)
    assert float(lower((x,), third * x, target)(1)) == pytest.approx(1 / 3, rel=1e-15)


@pytest.mark.parametrize("target", TARGETS)
def test_targets_agree_with_sympy(target):
    f = lower((x, mu, sigma), EXPR, target)
    exact = EXPR.subs({x: 2, mu: sp.Rational(1, 4), sigma: 3}).evalf(30)
    assert abs(sp.Float(str(f(2, 0.25, 3)), 30) - exact) < 1e-14 * exact


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("choice", [sp.frac(x), sp.Mod(x, 1), sp.Mod(x, mu), sp.Max(x, mu, 1), sp.Min(x, mu, 1)])
@pytest.mark.parametrize("term", [lambda e: 2 * e, lambda e: 1 - 2 * e, lambda e: e**2 / 3])
def test_what_branches_is_a_factor_in_every_target(target, choice, term):
    f = lower((x, mu), term(choice), target, branching=True)
    exact = term(choice).subs({x: sp.Rational(17, 10), mu: sp.Rational(3, 4)})
    assert float(f("1.7", 0.75) if target == "mpmath" else f(1.7, 0.75)) == pytest.approx(float(exact), abs=1e-15)


@pytest.mark.parametrize("target", TARGETS)
def test_a_piecewise_within_a_condition_chooses_between_conditions_in_every_target(target):
    """On arrays the choice was a number, which is no condition."""
    inner = sp.Piecewise((x - 1, mu > 1), (-x, True))
    f = lower((x, mu), sp.Piecewise((x, inner > 0), (7, True)), target, branching=True)
    assert [float(f(*at)) for at in ((2, 2), (0.5, 2), (2, 0.5), (-2, 0.5))] == [2, 7, 7, -2]


@pytest.mark.slow
@settings(max_examples=50)
@given(st.fractions(max_denominator=10**12).filter(lambda q: abs(q) < 10**12), st.integers(15, 120))
def test_a_rational_constant_has_the_precision_of_the_call(q, digits):
    f = lower((x,), sp.Rational(q.numerator, q.denominator) * x, "mpmath")
    with mpmath.workdps(digits):
        assert abs(f(3) - mpmath.mpf(3 * q.numerator) / q.denominator) <= abs(f(3)) * mpmath.mpf(10) ** (1 - digits)


def test_a_decimal_string_is_the_rational_it_spells():
    f = lower((x,), 5 * x, "mpmath")
    with mpmath.workdps(60):
        assert f("0.2") == f(Fraction(1, 5)) == 1
        assert f(0.2) != 1


def test_constants_of_the_float_targets_are_rounded_once():
    q = sp.Rational(10**20 + 1, 3 * 10**20 + 7)
    assert lower((x,), q, "math")(0) == (10**20 + 1) / (3 * 10**20 + 7)
    assert repr((10**20 + 1) / (3 * 10**20 + 7)) in lower((x,), q * x, "c")


@pytest.mark.parametrize("name", ["erf", "erfc"])
def test_error_functions_have_on_arrays_the_values_that_they_have_on_floats(name):
    values = [-30.0, -0.5, 0.0, 2.0]
    assert lower((x,), getattr(sp, name)(x))(values).tolist() == [getattr(math, name)(value) for value in values]


@pytest.mark.parametrize("target", ["numpy", "math"])
def test_a_whole_number_of_any_length_has_a_logarithm(target):
    """NumPy has none of an integer beyond 64 bits: a run with (10^30)^x in a rate ended in a traceback."""
    power = sp.Integer(10**30) ** x
    values = lower((x,), [power.diff(x), power + 2**64], target=target)(0.5)
    assert values == pytest.approx((1e15 * math.log(1e30), 1e15 + 2.0**64), rel=1e-14)


def test_arrays_broadcast_and_constants_take_their_shape():
    f = lower((x, mu), [x + mu, 7])
    total, seven = f(np.ones((2, 1)), [1, 2, 3])
    assert total.shape == seven.shape == (2, 3)
    assert seven.dtype == float
    assert f(1, 2) == (3.0, 7.0)
    assert isinstance(f(1, 2)[0], float)


def test_integers_are_taken_as_reals():
    assert lower((x,), x**-2)(np.array([1, 2])).tolist() == [1.0, 0.25]


def test_the_shape_of_the_result_is_that_of_the_expression():
    assert lower((x,), x, "math")(2) == 2.0
    assert lower((x,), [x], "math")(2) == (2.0,)
    assert lower((x,), sp.Dict({x: 2 * x, mu: 3}), "math")(2) == {"x": 4.0, "mu": 3.0}
    assert lower((), sp.Rational(1, 2), "math")() == 0.5


def test_a_set_of_arguments_is_sorted_by_name():
    assert lower({x, sigma, mu}, EXPR).args == (mu, sigma, x)


@pytest.mark.parametrize("target", TARGETS)
def test_lowered_functions_pickle_and_are_equal_when_their_expressions_are(target):
    f = lower((x, mu, sigma), [EXPR, x], target)
    f(1, 1, 1)
    again = pickle.loads(pickle.dumps(f))
    assert again == f
    assert again(2, 0.5, 3) == f(2, 0.5, 3)
    assert lower((x, mu, sigma), [EXPR, x], target).compiled is f.compiled


@pytest.mark.further
def test_sources_are_the_same_under_every_hash_seed():
    code = (
        "import sympy as sp; from asympk.symbolic.lowering import lower; a, b, c = sp.symbols('a b c')\n"
        "e = [sp.exp(a + b) * sp.sqrt(c) + (a + b)**3 / c, sp.sqrt(c) * (a + b), sp.sin(a * c) / (a + b)]\n"
        "print(lower({a, b, c}, e, 'c'), lower({a, b, c}, e).source)"
    )
    runs = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
            text=True,
        ).stdout
        for seed in ("0", "1", "7")
    }
    assert len(runs) == 1


def test_c_source_returns_one_value_and_writes_several():
    assert lower((x, mu), x**2 / 3, "c", name="g") == (
        "double g(double x, double mu)\n{\n    (void)mu;\n    return (0.3333333333333333)*(x*x);\n}\n"
    )
    assert lower((x,), [x, 2], "c") == "void f(double x, double out[2])\n{\n    out[0] = x;\n    out[1] = 2.0;\n}\n"


def test_names_that_a_language_reserves_are_changed():
    for_lambda, out = sp.symbols("lambda out")
    assert lower((for_lambda,), for_lambda**2, "math")(3) == 9.0
    assert "double out_, double out[2]" in lower((out,), [out, 1], "c")
    macro, word, compliance = sp.symbols("INFINITY class c")
    assert "(double INFINITY_, double class_, double c)" in lower((macro, word, compliance), macro * word, "c")
    assert lower((sp.Symbol("math"),), sp.exp(sp.Symbol("math")), "math")(0) == 1.0


@pytest.mark.parametrize(
    ("target", "name"),
    [("math", "lambda"), ("math", "math"), ("numpy", "numpy"), ("math", "abs"), ("c", "double"), ("c", "sin")],
)
def test_a_function_takes_no_name_that_its_source_uses(target, name):
    with pytest.raises(InputError, match=f"{name!r} has a meaning in the source"):
        lower((x,), abs(x), target, name=name)


C99 = [sp.Mod(x, 3), sp.sqrt(2) * x + sp.pi**2, sp.Mod(x, -3), sp.Piecewise((x, x > -1), (x**2, x < -1)), sp.log(2) * x]


def compiled_c(exprs, folder):
    """Return functions of x that a strict C99 compiler makes of expressions."""
    source = [lower((x,), expr, "c", name=f"f{k}", branching=True) for k, expr in enumerate(exprs)]
    (folder / "f.c").write_text("#include <math.h>\n" + "\n".join(source))
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wno-missing-prototypes", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["cc", *strict, "-o", folder / "f.so", folder / "f.c", "-lm"], check=True)
    library = ctypes.CDLL(str(folder / "f.so"))
    found = [library[f"f{k}"] for k in range(len(exprs))]
    for function in found:
        function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
    return found


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_quotient_of_signs_in_c_is_nan_or_infinite_where_its_divisor_is_0(tmp_path):
    """A quotient of integers would kill the process there."""
    assert "((x) > 0.0 ? 1.0" in lower((x,), sp.sign(x), "c", branching=True)  # before the process is risked
    quotient, sign = compiled_c([sp.sign(x + 1) / sp.sign(x), sp.sign(x)], tmp_path)
    assert [quotient(value) for value in (-3.0, -0.5, 2.0, 0.0)] == [1, -1, 1, math.inf]
    assert [sign(value) for value in (-3.0, 0.0, 2.0)] == [-1, 0, 1]
    assert all(math.isnan(function(math.nan)) for function in (quotient, sign))


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_hyperbolic_functions_and_their_inverses_have_no_differences_of_exponentials_or_logarithms(tmp_path):
    """As those, coth(1e-8) had 8 digits, and coth(1e-300), coth(800) in C and acsch(-1e9) none."""
    exprs = (sp.coth(x), sp.csch(x), sp.acsch(x), sp.acoth(x))
    exact = (mpmath.coth, mpmath.csch, mpmath.acsch, mpmath.acoth)
    targets = {target: [lower((x,), expr, target) for expr in exprs] for target in ("numpy", "math", "mpmath")}
    for functions in (*targets.values(), compiled_c(exprs, tmp_path)):
        for k, value in product(range(4), (1e-300, -1e-8, 0.3, 1.5, 700.0, 800.0, -1e9)):
            if k < 3 or abs(value) > 1:
                found, wanted = functions[k](value), exact[k](value)
                assert abs(found - wanted) <= abs(wanted) * 1e-14 + mpmath.mpf(2) ** -1074, (k, value)


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_largest_or_smallest_of_arguments_in_c_is_nan_where_one_of_them_is(tmp_path):
    depth, hardening = Penetration(x), 1 / sp.sqrt(Penetration(x))
    exprs = [sp.Max(0, x), sp.Min(x**2, 2), sp.Max(sp.log(x), -x, sp.sin(x)), depth, depth**2, hardening]
    functions = compiled_c(exprs, tmp_path)
    assert all(math.isnan(function(math.nan)) for function in functions)
    assert [function(-0.5) for function in (functions[0], functions[1], *functions[3:])] == [0, 0.25, 0, 0, 0]
    assert [function(4.0) for function in functions] == [4, 2, math.log(4), 4, 16, 0.5]
    assert math.isnan(functions[2](-2.0))  # of the logarithm alone


def test_conditions_of_numbers_beside_arrays_hold_element_by_element():
    """A condition that numbers alone decide, joined to one of arrays, ended in a ValueError of NumPy."""
    t, x = sp.symbols("t x")
    for condition in (sp.And(t > 0, x > 1), sp.Or(t < 0, x > 1)):
        chosen = lower((t, x), sp.Piecewise((1, condition), (0, True)), "numpy", branching=True)
        assert chosen(0.5, np.array([1.0, 2.0])).tolist() == [0, 1]


@pytest.mark.parametrize("target", ["numpy", "math", "mpmath"])
def test_a_largest_or_smallest_of_arguments_is_no_number_where_one_of_them_is_none(target):
    y, z = sp.symbols("y z", real=True)
    for expr in (sp.Max(x, y), sp.Min(x, y, 2), sp.Max(0, y), sp.Min(sp.Max(x, y), z), sp.Max(sp.Min(x, y), z)):
        function = lower((x, y, z), expr, target, branching=True)
        for at in product((-1.0, 0.5, 3.0), repeat=3):
            assert function(*at) == float(expr.subs(dict(zip((x, y, z), at, strict=True))))
        with pytest.raises(OutOfRange):
            function(1.0, math.nan, 4.0)


@pytest.mark.parametrize("target", ["numpy", "math", "mpmath"])
def test_the_sign_of_no_number_is_no_number(target):
    for expr in (sp.sign(x), sp.sign(x - 1) * x**2 + sp.sign(mu)):
        function = lower((x, mu), expr, target, branching=True)
        assert [function(at, 1) for at in (-2, 1, 3)] == [float(expr.subs({x: at, mu: 1})) for at in (-2, 1, 3)]
        with pytest.raises(OutOfRange):
            function(math.nan, 1)


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_c_source_is_c99_and_computes_what_mpmath_does(tmp_path):
    for expr, found in zip(C99, compiled_c(C99, tmp_path), strict=True):
        for value in (-4.25, -3.0, -0.5, 2.75):
            assert found(value) == pytest.approx(float(lower((x,), expr, "mpmath", branching=True)(value)), rel=1e-15)
        assert math.isnan(found(-1.0)) == isinstance(expr, sp.Piecewise)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize(("expr", "value"), [(sp.sqrt(x), -1), (1 / x, 0), (sp.log(x), 0), (sp.cbrt(x), -8)])
def test_a_value_that_is_not_finite_and_real_is_an_error_that_says_where(target, expr, value):
    with pytest.raises(OutOfRange, match=f"is not a finite real number at x = {value}"):
        lower((x,), expr, target)(value)


def test_the_source_for_floats_has_no_complex_values():
    """A power by ** would have one."""
    space = {"math": math}
    exec(lower((x,), sp.cbrt(x) + 1, "math").source, space)
    assert space["f"](8.0) == 3
    with pytest.raises(ValueError, match="math domain error"):
        space["f"](-8.0)


def test_arrays_have_a_value_where_an_exponential_in_it_overflows_as_numbers_have():
    """1/cosh(x) is 0 far away, and so is every coefficient of a slow manifold y = 1/cosh(x); it was refused."""
    for expr in (sp.exp(x) / (sp.exp(x) + 1), x * sp.exp(x) / (sp.exp(x) + 1) ** 2, -x * sp.sinh(x) / sp.cosh(x) ** 2):
        array, number = lower([x], expr, "numpy"), lower([x], expr, "math")
        assert array([2000, 1, -2000]) == pytest.approx([number(2000.0), number(1.0), number(-2000.0)], abs=1e-300)


def test_in_an_array_the_first_bad_place_is_named():
    with pytest.raises(OutOfRange, match=r"1/x is not a finite real number at x = 0\.0, mu = 5\.0"):
        lower((x, mu), [1 / x, mu])([[1], [0]], [5, 6])


@pytest.mark.parametrize("changed", [lambda e: e + mu, lambda e: 0.5 * e, lambda e: sp.I * e, lambda e: e > 1])
def test_a_formula_that_is_refused_is_written_in_few_characters(changed):
    with pytest.raises(InputError) as caught:
        lower((x,), changed(sum(sp.sin(k * x) for k in range(99))))
    assert len(str(caught.value)) < 160


@pytest.mark.parametrize(
    ("args", "expr", "message"),
    [
        ((x,), x + mu, r"mu in mu \+ x missing from the arguments \(x\)"),
        ((x,), sp.Piecewise((x, x > 0), (0, True)), "branches; lower each smooth mode"),
        ((x,), sp.sign(x), "branches"),
        ((x,), 0.1 * x, "contains a float"),
        ((x,), sp.oo * x, "not a finite number"),
        ((x,), sp.nan, "not a finite number"),
        ((x,), sp.I * x, "is complex"),
        ((x,), x > 1, "is not an expression"),
        ((x,), sp.Function("phi")(x), "has no phi"),
        ((x,), sp.gamma(x), "would need math"),
        ((x,), sp.Mod(x, 3), "branches"),
        ((x,), sp.Sum(x, (mu, 1, 3)), r"worked out first; give Sum\(x, \(mu, 1, 3\)\)\.doit"),
        ((x,), sp.Derivative(x**2, x), "worked out first"),
        ((x,), 10**400 * x, "beyond all doubles"),
        ((x, sp.Symbol("x", real=True)), x, "contain one name twice"),
        ((sp.Symbol("x y'"),), sp.S.One, "cannot name a variable"),
        ((sp.Symbol("\u5b57"),), sp.S.One, "cannot name a variable"),
        (("x",), x, "cannot name a variable"),
    ],
)
def test_what_cannot_be_a_function_of_numbers_is_refused(args, expr, message):
    with pytest.raises(InputError, match=message):
        lower(args, expr)


def test_a_function_that_mpmath_lacks_is_refused_without_the_advice_to_take_mpmath():
    with pytest.raises(InputError, match=r"target 'mpmath' has no Ei$"):
        lower((x,), sp.Ei(x), target="mpmath")


def test_a_rate_and_a_greek_letter_are_arguments_by_names_in_plain_letters():
    turned, taken = sp.symbols("\u03b8' theta_rate")
    args, expr = (turned, taken), turned - 2 * taken
    source = "double turn(double theta_rate_, double theta_rate)\n{\n    return -2.0*theta_rate + theta_rate_;\n}\n"
    assert lower(args, expr, "c", name="turn") == source
    assert [lower(args, expr, target)(7, 2) for target in ("numpy", "math", "mpmath")] == [3, 3, 3]


def test_the_wrong_number_of_values_and_unknown_targets_are_refused():
    with pytest.raises(InputError, match=r"2 values given; the arguments are \(x\)"):
        lower((x,), x)(1, 2)
    with pytest.raises(UnknownName, match="choose one of numpy, math, mpmath, c"):
        lower((x,), x, "fortran")
    with pytest.raises(InputError, match="cannot name a function"):
        lower((x,), x, name="2f")


def test_the_slow_manifold_loses_no_digit_where_the_textbook_root_loses_half():
    pk = ap.systems.painleve_klein.system()
    plane = ap.slow_manifolds(pk)[0]
    args = sorted(plane.closed.free_symbols, key=str)
    assert [a.name for a in args] == ["mu", "sigma", "x"]
    with mpmath.workdps(50):
        exact = lower(args, plane.closed, "mpmath")("1e-12", 1, 2)
    assert math.isclose(lower(args, plane.closed, "math")(1e-12, 1, 2), exact, rel_tol=4e-16)


A, B = sp.symbols("A B")
WRONG = [[(A, B + 1), (B, x)], {A: x}, "q", 5, [(A,)], [(1, x)], [("A", x)], [(A, A)], [(A, 0.5)]]


@pytest.mark.parametrize("wrong", WRONG)
def test_definitions_that_are_no_pairs_or_look_ahead_are_refused(wrong):
    assert lower((x,), A + 1, "math", definitions=[(B, x), (A, B + 1)])(2) == 4
    with pytest.raises(InputError):
        lower((x,), A + 1, "c", definitions=wrong)


@pytest.mark.parametrize(("expr", "limit"), [
    (4 / sp.cosh(x) ** 2, 0), (1 / (1 + sp.exp(x)), 0), (sp.exp(x) / (1 + sp.exp(x)), 1), (sp.log(1 + sp.exp(x)), 1000),
])
def test_what_is_finite_in_the_end_may_overflow_on_the_way(expr, limit):
    assert lower((x,), expr, "math")(1000) == limit
    slope = lower((x,), sp.diff(expr, x), "math")
    assert slope(1000) == pytest.approx(int(limit == 1000), abs=1e-15)


@pytest.mark.parametrize("expr", [sp.exp(x), sp.exp(sp.exp(x)), sp.sin(sp.exp(x)), 1 / sp.cosh(sp.sinh(x))])
def test_what_is_no_float_or_would_take_for_ever_to_tell_is_refused_at_once(expr):
    with pytest.raises(OutOfRange):
        lower((x,), expr, "math")(1e9)


def test_the_functions_of_several_targets_share_one_search_for_common_parts(monkeypatch):
    searched, cse = [], sp.cse
    monkeypatch.setattr(sp, "cse", lambda *given, **options: searched.append(given) or cse(*given, **options))
    common = sp.sin(x + 17) ** 2 + sp.exp(sp.sin(x + 17))
    found = [lower((x,), common, target)(0.5) for target in ("math", "mpmath", "numpy")]
    assert found == pytest.approx([math.sin(17.5) ** 2 + math.exp(math.sin(17.5))] * 3, rel=1e-14)
    assert len(searched) == 1


@pytest.mark.parametrize("target", TARGETS)
def test_a_sum_of_any_number_of_terms_has_a_value(target):
    """Python compiles no sum of 3000 terms in a row, as the third term of a slow manifold over a root may have."""
    many = sp.symbols("x:4000")
    text = printer_of(target, order="none").doprint(sp.Add(*many, evaluate=False))
    assert eval(text, {s.name: 1 for s in many}) == len(many)
