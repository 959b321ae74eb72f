"""A scene keeps its numbers exactly and refuses what is not one, in one line."""

import pickle
import re
from dataclasses import FrozenInstanceError, replace
from decimal import Decimal
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.errors import InputError, NoManifold
from asympk.numbers import number


def scene(**changes):
    return ap.Scene(**{"sigma": 1, "mu": 1e-3, "start": (0, 0.2, -1), "until": 5, **changes})


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("0.2", Fraction(1, 5)),
        (" 1/3 ", Fraction(1, 3)),
        ("-2.5e-3", Fraction(-1, 400)),
        ("1e-300", Fraction(1, 10**300)),
        (0.2, 0.2),
        (3, 3),
        (Fraction(2, 7), Fraction(2, 7)),
        (mpmath.mpf("0.25"), Fraction(1, 4)),
        (mpmath.mpf(0), 0),
        (np.float64(0.2), 0.2),
        (np.float32(0.5), 0.5),
        (np.int64(3), 3),
        (np.array(1.5), 1.5),
        (Decimal("0.2"), Fraction(1, 5)),
        (Decimal("-1E-9000"), Fraction(-1, 10**9000)),
    ],
)
def test_a_number_is_kept_exactly(given, kept):
    value = number("x", given)
    assert value == kept
    assert type(value) in (int, float, Fraction)


BY_CARDANO = sp.solve(sp.Symbol("x") ** 3 - 3 * sp.Symbol("x") + 1)  # real roots, written with I


@pytest.mark.parametrize("constant", [
    sp.sqrt(2), sp.pi / 4, sp.exp(-7), sp.Integral(1, (sp.Symbol("x"), 0, 1)).doit(), BY_CARDANO[0],
])
def test_a_sympy_constant_is_kept_right_to_more_digits_than_a_run_may_have(constant):
    kept = scene(sigma=constant).sigma
    assert abs((sp.Rational(kept) - constant).evalf(5, maxn=2000)) < sp.Rational(1, 10**1090)
    assert ap.solve_many(1, 1e-3, [0, constant], 0.2, -1, 5).final[0, 1] == ap.solve_many(
        1, 1e-3, float(kept), 0.2, -1, 5).final[0]


TOWER = sp.exp(sp.exp(sp.exp(100)))


@pytest.mark.parametrize(("constant", "words"), [
    (TOWER, "a number in it is beyond the range of doubles"),
    (1 / TOWER, "a number in it is beyond the range of doubles"),
    (sp.sin(TOWER), "a number in it is beyond the range of doubles"),
    (sp.exp(1000), "it is beyond the range of doubles"),
    (sp.exp(-1000), "it is beyond the range of doubles; write 0 if it is meant"),
    (sp.I * sp.pi, "it must be a finite real number"),
    (sp.oo, "it must be a finite real number"),
    (sp.nan, "it must be a finite real number"),
    (sp.Integral(sp.exp(-sp.Symbol("x")**2), (sp.Symbol("x"), 0, 1)), "work it out first, as .evalf(20) does"),
    (sp.sqrt(2) * sp.Symbol("x"), "it must be a number"),
])
def test_a_sympy_constant_that_no_double_holds_or_that_takes_long_is_refused_at_once(constant, words):
    with pytest.raises(InputError, match=re.escape(f"sigma = {constant}: {words}")):
        scene(sigma=constant)


def test_an_mpf_is_kept_with_all_its_digits():
    with mpmath.workdps(60):
        third = mpmath.mpf(1) / 3
    assert abs(number("x", third) - Fraction(1, 3)) < Fraction(1, 10**59)


BAD = [
    ({"sigma": float("nan")}, "sigma = nan: it must be finite"),
    ({"mu": float("inf")}, "mu = inf: it must be finite"),
    ({"sigma": -2}, "sigma = -2: it must be greater than -2"),
    ({"sigma": "-2"}, "sigma = '-2': it must be greater than -2"),
    ({"mu": 0}, "mu = 0: it must be positive"),
    ({"mu": -1e-3}, "mu = -0.001: it must be positive"),
    ({"sigma0": 0.5}, "sigma0 = 0.5: it must be at least sigma = 1"),
    ({"until": -1}, "until = -1: it must be zero or positive"),
    ({"start": (0, 1)}, "start = (0, 1): it must be three numbers (x, y, z)"),
    ({"start": "abc"}, "start = 'abc': it must be three numbers"),
    ({"start": 3}, "start = 3: it must be three numbers"),
    ({"start": {0, 1, 2}}, "start = {0, 1, 2}: it must be three numbers"),
    ({"start": {"x": 0, "y": 1, "z": 2}}, "start = {'x': 0, 'y': 1, 'z': 2}: it must be three numbers"),
    ({"start": (0, 1, "z")}, "start z = 'z': it must be a decimal"),
    ({"start": (0, 1, float("nan"))}, "start z = nan: it must be finite"),
    ({"sigma": "one"}, "sigma = 'one': it must be a decimal"),
    ({"sigma": "1/0"}, "sigma = '1/0': it must not divide by zero"),
    ({"sigma": True}, "sigma = True: it must be a number"),
    ({"sigma": np.bool_(True)}, "it must be a number"),
    ({"sigma": None}, "sigma = None: it must be a number"),
    ({"sigma": 1j}, "sigma = 1j: it must be a number"),
    ({"sigma": [1, 2]}, "sigma = [1, 2]: it must be a number"),
    ({"sigma": np.array([1.0])}, "it must be a number"),
    ({"sigma": mpmath.mpf("nan")}, "it must be finite"),
    ({"until": mpmath.inf}, "it must be finite"),
    ({"mu": mpmath.mpf(2) ** 10**9}, "it must be finite"),
    ({"mu": "1e999999999"}, "mu = '1e999999999': it must be a decimal"),
    ({"mu": "1e-999999999"}, "mu = '1e-999999999': it must be a decimal"),
    ({"mu": "1" * 5000}, "it must be a decimal"),
    ({"until": "1e400"}, "until = '1e400': it must be finite"),
    ({"until": "1e308"}, "until = '1e308': it must be finite, and its size at most 8.99e+307"),
    ({"until": 10**400}, "it must be finite"),
    ({"mu": "٣"}, "mu = '٣': it must be a decimal"),
    ({"mu": Decimal("nan")}, "mu = Decimal('NaN'): it must be finite"),
    ({"mu": Decimal("-inf")}, "it must be finite"),
    ({"mu": Decimal("1e-999999")}, "mu = Decimal('1E-999999'): it must be finite"),
    ({"until": 1 << 4_000_000}, "until = (int of very many digits): it must be finite"),
    ({"mu": np.ma.masked}, "mu = masked: it must be a number"),
    ({"mu": np.ma.array(1.0, mask=True)}, "it must be a number"),
    ({"sigma": ap.systems.painleve_klein.system()}, "sigma is a System: name it, Scene(system=system"),
    ({"name": 5}, "name = 5: it must be a string"),
    ({"near_to": ("Pi9", 0)}, "manifold = 'Pi9': it must be one of Pi1, Pi2"),
    ({"near_to": ("Pi1", "far")}, "offset = 'far': it must be a decimal"),
    ({"near_to": 5}, "near_to = 5: only ap.Scene.near sets it"),
    ({"rod": 5}, "rod = 5: only ap.Scene.physical sets it"),
    ({"origin": 5}, "origin = 5: only ap.read_scene sets it"),
]


def test_a_physical_rod_too_large_for_its_scaled_equations_is_refused_by_the_scaled_quantity():
    with pytest.raises(InputError, match=r"^nondimensional z = 1\.0e\+308: it must be finite"):
        ap.Scene.physical(m=1, P=1, f=1, alpha=1, l=1, k=1, h="1/2", start=(0, 0, "5e307"), until=1)


@pytest.mark.parametrize(("change", "words"), BAD, ids=[" ".join(c) + f" {k}" for k, (c, _) in enumerate(BAD)])
def test_bad_input_is_refused_in_one_line_that_names_it(change, words):
    with pytest.raises(InputError) as refusal:
        scene(**change)
    message = str(refusal.value)
    assert words in message
    assert "\n" not in message
    assert len(message) < 200
    assert isinstance(refusal.value, ValueError)


def test_a_scene_is_frozen_equal_to_its_likes_and_pickles():
    one = scene(sigma="1/3", name="one")
    assert one == pickle.loads(pickle.dumps(one)) == scene(sigma=Fraction(1, 3), name="one")
    with pytest.raises(FrozenInstanceError):
        one.mu = 1


def test_static_friction_is_kinetic_friction_unless_it_is_given():
    assert scene(sigma="0.2").sigma0 == Fraction(1, 5)
    assert scene(sigma0=3).sigma0 == 3


def near(**changes):
    given = {"manifold": "Pi2", "x": 0.3, "offset": 0, "z": 1, "sigma": 1, "mu": 1e-3, "until": 5}
    return ap.Scene.near(**{**given, **changes})


def test_a_start_near_a_manifold_keeps_the_offset_exactly():
    assert near(offset="1e-300").near_to == ("Pi2", Fraction(1, 10**300))
    assert near(offset=0.1).start[1] == pytest.approx(near().start[1] + 0.1)


@pytest.mark.parametrize("numbers", [{"start": (0.5, -0.2, 1)}, {"start": (*near().start[:2], -1)}, {"sigma": 0},
                                     {"mu": "1e-2"}])
def test_another_number_in_a_scene_beside_a_slow_line_puts_it_where_its_start_says(numbers):
    moved = replace(near(offset="1e-3"), sigma0=2, **numbers)
    assert moved.near_to is None
    assert ap.solve(moved).final == ap.solve(ap.Scene(moved.sigma, moved.mu, moved.start, 5, 2)).final
    assert replace(near(), until=1, sigma0=2, start=near().start).near_to == near().near_to


def test_the_start_shown_lies_on_the_slow_line_to_double_precision():
    x, y, _ = near().start
    slow = (1 - (1 + 4e-3) ** 0.5) / 2e-3
    assert y == pytest.approx(slow * (x + 1), rel=1e-13)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"manifold": "Pi3"}, InputError, "manifold = 'Pi3': it must be one of Pi1, Pi2"),
        ({"sigma": 0}, NoManifold, "Pi2 has no slow line at sigma = 0"),
        ({"sigma": 1e-320}, NoManifold, "no slow line at sigma = 1e-320, mu = 0.001 in doubles: its load 1/b"),
        ({"sigma": Fraction(1, 10**400)}, NoManifold, "in doubles: its load 1/b"),
        ({"sigma": -1, "mu": 0.25, "z": -1}, NoManifold, "with b = 1 it needs 4 mu < b"),
        ({"manifold": "Pi1", "mu": 1.25}, NoManifold, "it needs 4 mu < b"),
        ({"z": -1}, InputError, "Pi2 lies in the mode slip_opposite; with x + y = -0.998703 here, z must be positive"),
        ({"sigma": -1, "z": 1}, InputError, "z must be negative"),
        ({"manifold": "Pi1", "z": 0}, InputError, "z must be positive"),
        ({"offset": float("nan")}, InputError, "offset = nan"),
        ({"x": "x"}, InputError, "x = 'x'"),
    ],
)
def test_a_start_near_a_manifold_is_refused_where_there_is_none(change, error, words):
    with pytest.raises(error, match=re.escape(words)):
        near(**change)


@pytest.mark.parametrize(("push", "law", "told"), [
    ("phi", 1, r"v' = F - phi\(x\) has no value: phi\(x\) is a function without a formula; write its formula there"),
    ("sin", "phi", r"kinetic = phi\(x\) has no value"),
])
def test_a_function_without_a_formula_makes_a_system_but_no_scene(push, law, told):
    x, v, F = sp.symbols("x v F", real=True)
    kinetic = law if law == 1 else sp.Function(law)(x)
    rate = F - (sp.sin(x) if push == "sin" else sp.Function(push)(x))
    block = ap.System.with_frictions({x: v, v: rate}, {}, [ap.Friction(v, F, 1, kinetic=kinetic)])
    with pytest.raises(InputError, match=told):
        ap.Scene(system=block, values={}, start=[1, 0], until=1)


@pytest.mark.parametrize("unevaluated", [sp.Integral, sp.Sum])
def test_what_sympy_has_left_unevaluated_is_refused_by_name_and_its_bound_symbol_is_no_parameter(unevaluated):
    x, s = sp.symbols("x s", real=True)
    given = f"{unevaluated.__name__}(s*x, (s, 0, 2))"
    with pytest.raises(InputError, match=re.escape(f"{given} is to be worked out first; give {given}.doit()")):
        ap.System.smooth({x: -unevaluated(s * x, (s, 0, 2))}, {}, None)


@pytest.mark.parametrize("part", [sp.re, sp.im, sp.arg, sp.conjugate])
def test_a_part_of_a_state_that_is_not_declared_real_is_refused_by_name(part):
    x = sp.Symbol("x")
    decay = ap.System.smooth({x: -x - part(x)}, {}, None)
    with pytest.raises(InputError, match=rf"{part.__name__}\(x\) is that of a number which may be complex; declare"):
        ap.Scene(system=decay, values={}, start=[1], until=1)


@pytest.mark.parametrize("part", [sp.re, sp.im, sp.conjugate])
def test_a_part_of_a_parameter_that_is_not_declared_real_has_its_value(part):
    """The run was refused, although its parameters are numbers."""
    x = sp.Symbol("x")
    decay = ap.System.smooth({x: -x * part(sp.Symbol("k"))}, {}, None)
    path = ap.solve(ap.Scene(system=decay, values={"k": 1}, start=[1], until=1))
    assert path.final[0] == pytest.approx(float(sp.exp(-part(sp.S.One))), abs=1e-15)


def test_a_scene_has_its_numbers_by_name():
    assert scene().numbers == {"sigma": 1, "mu": 1e-3, "sigma0": 1}
    x, k, a = sp.symbols("x k a", real=True)
    system = ap.System.smooth({x: a - k * x}, {}, None)
    found = ap.Scene(system=system, values={k: "1/3", a: 2}, start={x: 0}, until=1).numbers
    assert found == {"a": 2, "k": Fraction(1, 3)}
