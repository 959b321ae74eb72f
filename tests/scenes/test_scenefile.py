"""Scenes in TOML: exact decimals, physical quantities through the derived groups, and the scenes that ship."""

import csv
import json
import math
import re
import sys
from dataclasses import replace
from fractions import Fraction
from importlib import import_module

import mpmath
import numpy as np
import pytest
import sympy as sp
from blocks import spring_block
from mechanisms import FALLING_BALL, ON_HIGH_GROUND, SLENDER_ROD
from sweeptext import parse_sweep

import asympk as ap
from asympk.__main__ import main
from asympk.errors import InputError, MissingPackage, UnknownName
from asympk.formulas import read_constant, read_formula, read_relation
from asympk.numbers import number
from asympk.output.mechanisms import load_mechanism
from asympk.pictures.trace import trace
from asympk.scenes import scenefile
from asympk.scenes.scenefile import changed_scene, scene_text
from asympk.scenes.turned import turned
from asympk.sweep.sweepfile import read_sweep
from asympk.systems import brake_shoe
from asympk.systems.catalogue import example_scene

ROD = {"m": 2, "P": 10, "f": "3", "f0": '"7/2"', "alpha": '"60 deg"', "l": "0.5", "k": "1e5", "h": "0.02",
       "start": "[1, -3, -0.1]", "until": "0.03"}
PLAIN = {"sigma": 1, "mu": "1e-3", "start": "[0, 0.2, -1]", "until": 5}


def _file(tmp_path, entries, name="scene.toml"):
    path = tmp_path / name
    path.write_text("".join(f"{key} = {value}\n" for key, value in entries.items()), encoding="utf-8")
    return path


def test_a_formula_of_an_end_stop_takes_the_larger_of_two():
    x = sp.Symbol("x", real=True)
    assert read_formula("x + 100*max(x - 1, 0) - min(x, -x)", {"x": x}) == x + 100 * sp.Max(x - 1, 0) - sp.Min(x, -x)
    with pytest.raises(InputError, match="max takes two arguments"):
        read_formula("max(x)", {"x": x})


@pytest.mark.slow
def test_a_sum_is_read_however_many_terms_it_has_and_a_product_up_to_a_degree():
    x = sp.Symbol("x", real=True)
    waves = read_formula(" - ".join(f"sin({k}*x)/{k}^2" for k in range(1, 200)), {"x": x})
    assert waves == 2 * sp.sin(x) - sp.Add(*(sp.sin(k * x) / k**2 for k in range(1, 200)))
    assert read_formula("2*x^32*(x + 1)^32/3", {"x": x}) == 2 * x**32 * (x + 1) ** 32 / 3
    with pytest.raises(InputError, match="a degree beyond 64"):
        read_formula("*".join(["(x + 1)^64"] * 300), {"x": x})
    with pytest.raises(InputError, match="nested deeper than 60"):
        read_formula("sin(" * 61 + "x" + ")" * 61, {"x": x})
    with pytest.raises(InputError, match=r"'floor\(exp\(10\^6\)\)': a number in it is beyond the range of doubles"):
        read_formula("floor(exp(10^6))", {})


@pytest.mark.parametrize(("text", "meant"), [
    ("Piecewise((2, x < 1), (x, True))", lambda x, y: 2 if x < 1 else x),
    ("Piecewise((1, (x < 1) & (y > 2)), (2, x >= 1 or y < 0), (3, not x > 5))",
     lambda x, y: 1 if x < 1 and y > 2 else 2 if x >= 1 or y < 0 else 3),
    ("Heaviside(x - 1) + atan2(y, x)", lambda x, y: (x > 1) + math.atan2(y, x)),
    ("floor(x) + 10*ceiling(y) + 100*frac(x) + mod(y, 2)",
     lambda x, y: math.floor(x) + 10 * math.ceil(y) + 100 * (x % 1) + y % 2),
    ("asinh(x) + erf(y)", lambda x, y: math.asinh(x) + math.erf(y)),
    ("ln(x^2) + cot(x) + 10*sec(y) + 100*csc(y)",
     lambda x, y: 2 * math.log(abs(x)) + 1 / math.tan(x) + 10 / math.cos(y) + 100 / math.sin(y)),
    ("cbrt(x) + 10*cbrt(x^2) + cbrt(-8)", lambda x, y: math.cbrt(x) + 10 * math.cbrt(x**2) - 2),
])
@pytest.mark.parametrize("place", [(0.3, 2.5), (1.7, -0.4), (-0.6, 1.2)])
def test_a_formula_that_switches_is_that_of_its_pieces(text, meant, place):
    names = {name: sp.Symbol(name, real=True) for name in ("x", "y")}
    value = ap.lower([*names.values()], read_formula(text, names), "math", branching=True)(*place)
    assert value == pytest.approx(meant(*place), abs=1e-12)


@pytest.mark.parametrize("wrong", ["Piecewise()", "Piecewise(x, x < 1)", "Piecewise((1, x))", "Piecewise((x<1, True))",
                                   "Piecewise((1, x < 1), evaluate=0)", "mod(x, 0)", "atan2(x)"])
def test_a_formula_that_switches_by_no_relation_is_refused_in_one_line(wrong):
    with pytest.raises(InputError, match=r"^formula = [^\n]+$"):
        read_formula(wrong, {"x": sp.Symbol("x", real=True)})


@pytest.mark.parametrize(("text", "said"), [("x − 1", "the sign − is not read; write -"), ("2·x", "write [*]"),
                                            ("x²", r"write \^2"), ("x ≤ 1", "write <="), ("π*x", "did you mean pi"),
                                            ("x·x", "the sign · is not read; write [*]"),
                                            ("x #c", "it is not a formula")])
def test_a_sign_that_only_documents_have_is_named_with_what_to_write(text, said):
    with pytest.raises(InputError, match=said):
        read_formula(text, {"x": sp.Symbol("x", real=True)})


@pytest.mark.parametrize(("text", "said"), [
    *((text, "'x + 2*y', with each * written and each bracket closed") for text in ("2x", "2 x", "sin x", "2*(x + 1")),
    ("2(x + 1)", "'2' is no function; write the * of a product"), ("x(x + 1)", "'x' is no function; write the *"),
    ("(x + 1)(x - 1)", "'x + 1' is no function; write the * of a product"),
    ("sin^2(x)", "sin is a function; write sin(x), and a power of it sin(x)^2"),
    ("Piecewise((1, And(x > 0, x < 1)), (0, True))", "such as x < 1, or several with and, or, not between"),
])
def test_a_formula_as_on_paper_is_refused_with_what_to_write(text, said):
    with pytest.raises(InputError, match=re.escape(said)):
        read_formula(text, {"x": sp.Symbol("x", real=True)})


def test_a_compliance_left_in_the_file_of_a_rigid_contact_is_to_be_left_out(tmp_path):
    (file := tmp_path / "rod.toml").write_text((LEANING % ("pi/3", "sqrt(3)/4")).replace("[values]", "[values]\nc = 1"))
    with pytest.raises(InputError, match="c is not a parameter of this system; it has f; leave it out"):
        ap.read_scene(file)


def test_a_sign_that_only_documents_have_is_named_in_a_number_too():
    for text, said in (("−1", "write -"), ("60°", "write deg"), ("π/4", "did you mean pi")):
        with pytest.raises(InputError, match=said):
            read_constant("alpha", text)


def test_names_of_a_formula_stand_for_their_own_symbols_however_they_are_spelt():
    names = ("X", "X'", "X_prime", "lambda", "lambda_", "\N{MICRO SIGN}")
    symbols = {name: sp.Symbol(name) for name in names}
    assert read_formula(" + ".join(names), symbols) == sp.Add(*symbols.values())
    with pytest.raises(InputError, match=r"the name Y'' is unknown; it has X, X', X_prime, lambda, lambda_, "):
        read_formula("Y''", symbols)
    with pytest.raises(InputError, match="cannot tell \N{MICRO SIGN} from \N{GREEK SMALL LETTER MU}, which"):
        read_formula("X", {**symbols, "\N{GREEK SMALL LETTER MU}": sp.Symbol("m")})


@pytest.mark.parametrize("name", ["and", "or", "not", "if", "else", "True", "False"])
def test_a_word_of_conditions_names_no_quantity(name):
    with pytest.raises(InputError, match=f"^names: {name} is reserved for conditions, as in .*; rename it"):
        read_formula("3*x", {"x": sp.Symbol("x"), name: sp.Symbol("p")}, "gap")  # which does not contain it


def test_a_byte_order_mark_is_passed_over(tmp_path):
    path = _file(tmp_path, {**PLAIN, "start": "[0, 0.2, -1]"})
    plain = ap.read_scene(path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert ap.read_scene(path) == plain


def test_a_decimal_in_a_file_is_the_number_it_spells(tmp_path):
    scene = ap.read_scene(_file(tmp_path, {**PLAIN, "start": '[1_0.1, "1/3", -1]'}))
    assert scene.start == (Fraction(101, 10), Fraction(1, 3), -1)
    assert scene.mu == Fraction(1, 1000)
    assert scene == ap.Scene(1, "1e-3", ("10.1", "1/3", -1), 5, name="scene")


def test_physical_quantities_become_the_groups_of_section_two(tmp_path):
    scene = ap.read_scene(_file(tmp_path, ROD))
    m, P, f, f0, l, k, h = 2, 10, 3, 3.5, 0.5, 1e5, 0.02
    a = math.pi / 3
    expected = {
        "sigma": f * math.tan(a) - 2,
        "mu": m / (k * h**2 * l * math.cos(a) ** 2),
        "sigma0": f0 * math.tan(a) - 2,
        "until": 0.03 / (h * l),
    }
    assert {name: float(getattr(scene, name)) for name in expected} == pytest.approx(expected, rel=1e-15)
    state = (math.cos(a) / P, -3 * h * l * math.cos(a) / P, -0.1 * m / (P * h * l))
    assert [float(v) for v in scene.start] == pytest.approx(state, rel=1e-15)


def test_conversion_keeps_a_hundred_digits(tmp_path):
    scene = ap.read_scene(_file(tmp_path, ROD))
    with mpmath.workdps(120):
        wanted = 3 * mpmath.sqrt(3) - 2
        assert abs(mpmath.mpf(scene.sigma.numerator) / scene.sigma.denominator - wanted) < mpmath.mpf(10) ** -97


def test_converting_there_and_back_returns_the_start(tmp_path):
    found = scenefile.read_scene(_file(tmp_path, ROD))
    given = (*found.rod.units.state(*found.start), found.rod.units.moment(found.until))
    assert [float(v) for v in given] == pytest.approx([1, -3, -0.1, 0.03], rel=1e-15)


def test_velocity_comes_back_in_units_of_the_force_acting_for_one_unit_of_time(tmp_path):
    found = scenefile.read_scene(_file(tmp_path, {**ROD, "start": "[0, 0, 1]"}))
    path = ap.solve(found)
    told = path.physical()
    assert float(told.final[2]) == pytest.approx(path.final[2] * 10 * (0.02 * 0.5) / 2, rel=1e-15)
    assert float(told.scene.until) == pytest.approx(0.03, rel=1e-15)


def test_physical_digits_survive_the_way_back(tmp_path):
    found = scenefile.read_scene(_file(tmp_path, ROD))
    coarse, fine = (ap.solve(found, digits=d).physical().final[0] for d in (40, 60))
    assert 0 <= abs(coarse - fine) < abs(fine) * mpmath.mpf(10) ** -38


@pytest.mark.parametrize("digits", [None, 30])
def test_a_physical_path_is_that_of_its_scene_at_every_time_and_ends_where_it_ends(tmp_path, digits):
    """Beyond its end it had the state at the end, and with digits between events those of doubles alone."""
    found = scenefile.read_scene(_file(tmp_path, ROD))
    path = ap.solve(found, digits=digits)
    told, units = path.physical(), found.rod.units
    assert (told.end, told.scene.start) == (Fraction("0.03"), (1, -3, Fraction("-0.1")))
    for t in (0, Fraction(1, 70), "0.02", "3/100"):
        wanted = units.state(*(Fraction(number("state", v)) for v in path(min(Fraction(t) / units.time, found.until))))
        for value, exact in zip(told(t), wanted, strict=True):
            assert abs(Fraction(number("state", value)) - exact) <= abs(exact) / 10 ** ((digits or 15) - 2)
    assert told([[0, "0.02"]]).shape == (3, 1, 2)
    assert told([]).shape == (3, 0)
    assert hash(told) == hash(ap.solve(found, digits=digits).physical())
    for beyond in (0.030001, 5, math.inf, math.nan, -1):
        with pytest.raises(InputError, match=r"it must be from 0 to until = 0\.03$"):
            told(beyond)
    with pytest.raises(InputError, match=r"it must be from 0 to until = 3\.0$"):
        path(-1)


@pytest.mark.parametrize("name", scenefile.scene_names())
def test_every_scene_that_ships_runs_and_says_what_it_shows(name):
    scene = ap.read_scene(name)
    assert scene.name == name
    assert 30 < len(scenefile.about(name)) < 125
    assert ap.solve(scene).final


@pytest.mark.parametrize(
    ("name", "modes"),
    [
        ("backward", ["slip_opposite", "stick", "slip_same"]),
        ("forward", ["slip_same"]),
        ("wrong-side", ["slip_opposite", "stick", "slip_opposite", "slip_same"]),
        ("shallow", ["slip_opposite", "stick", "slip_same"]),
        ("shallow-crossing", ["slip_opposite", "slip_same"]),
    ],
)
def test_named_scenes_do_what_their_line_says(name, modes):
    assert list(ap.solve(ap.read_scene(name)).modes) == modes


def test_an_angle_below_one_degree_is_as_good_as_its_radians(tmp_path):
    degrees = ap.read_scene(_file(tmp_path, {**ROD, "alpha": '"1/2 deg"'}))
    radians = ap.read_scene(_file(tmp_path, {**ROD, "alpha": "0.0087266462599716478846"}))
    assert degrees.sigma == pytest.approx(3 * math.tan(math.pi / 360) - 2)
    assert float(degrees.mu) == pytest.approx(float(radians.mu), rel=1e-15)


def test_repeated_collisions_are_repeated():
    kinds = [event.kind for event in ap.solve(ap.read_scene("collisions")).events]
    assert kinds.count("velocity_zero") == 2


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({**PLAIN, "sgima": 1}, "'sgima' is unknown; the nearest known one is 'sigma'"),
        ({**PLAIN, "seed": 1}, "seed is of a sweep, which asympk sweep follows"),
        ({**PLAIN, "Start": 1}, "'Start' is unknown; the nearest known one is 'start'"),
        ({**PLAIN, "m": 1}, "m is physical and sigma is not"),
        ({"sigma": 1}, "mu, start, until missing"),
        ({k: v for k, v in ROD.items() if k != "k"}, "k missing"),
        ({**ROD, "alpha": '"95 deg"'}, "between 0 and 90 deg"),
        ({**ROD, "alpha": "1.6"}, "between 0 and pi/2"),
        ({**ROD, "alpha": '"60 dgr"'}, "alpha = '60 dgr': it must be a number, such as 0.2, or one in quotes"),
        ({**ROD, "f": '"60 deg"'}, "f = '60 deg': it must be a decimal"),
        ({**ROD, "f": '"sqr(9)"'}, "f = 'sqr(9)': the function sqr is unknown; did you mean sqrt"),
        ({**ROD, "m": "-1"}, "m = -1: it must be positive"),
        ({**ROD, "f0": "1"}, "f0 = 1: it must be at least f = 3"),
        ({**ROD, "until": "-1"}, "until = -1"),
        ({**ROD, "start": "[1, 2]"}, "three numbers"),
        ({**PLAIN, "start": '"abc"'}, "three numbers"),
        ({**PLAIN, "mu": "true"}, "mu = True"),
        ({**PLAIN, "mu": "nan"}, "mu"),
        ({**PLAIN, "mu": "1e999999999"}, "mu"),
        ({**PLAIN, "mu": "1979-05-27"}, "mu"),
        ({**PLAIN, "name": "3"}, "name = 3: it must be a string"),
        ({**PLAIN, "mu": "[[["}, "not TOML"),
        ({**PLAIN, "mu": "[" * 5000}, "too deep"),
        ({**PLAIN, "mu": "9" * 5000}, "too many digits"),
        ({**PLAIN, "mu": "1e" + "9" * 20}, "too many digits"),
        ({**PLAIN, "start": "[[0.5], 0, 1]"}, "start = ['0.5'] is of a sweep"),
        ({**PLAIN, "near": "{x = 1}"}, "in place of start"),
        ({"sigma": 1, "mu": 1, "until": 1, "near": "{manifold = 'Pi3', x = 0, offset = 0, z = 1}"}, "manifold"),
        ({"sigma": 1, "mu": 1, "near": "{manifold = 'Pi1', x = 0, offset = 0, z = 1}"}, "until missing"),
        ({**PLAIN, "start": "5"}, "start = 5: it must be three numbers"),
    ],
)
def test_what_is_not_a_scene_is_refused_by_name(tmp_path, entries, said):
    file = _file(tmp_path, entries)
    for read in (ap.read_scene, lambda where: changed_scene(str(where), {"sigma": "2"})):
        with pytest.raises(InputError) as caught:
            read(file)
        assert said in str(caught.value)
        assert "scene.toml" in str(caught.value)


BELT = f"""until = 1
{spring_block("k", "v - 1")}
[values]
k = 0.8
[start]
x = 0
v = 1
"""
LEANING = """coordinates = ["X", "Y", "theta"]
lagrangian = "(X'^2 + Y'^2)/2 + theta'^2/24 - Y"
gap = "Y - sin(theta)/2"
slip = "X - cos(theta)/2"
friction = "f"
unilateral = true
contact = "rigid"
until = 0.01
[values]
f = "2^3/10"
[state]
X = 0
theta = "%s"
Y = "%s"
"X'" = -1
"Y'" = 0
"theta'" = 0
"""
ON_GROUND = """until = 1
[system]
contact = "rigid"
mechanism = "painleve_rod"
[values]
[start]
"""


@pytest.mark.parametrize(
    ("text", "old", "new", "said"),
    [
        (BELT, "load", "laod = 1\nload", "system.frictions[0]: key 'laod' is unknown; the nearest known one is 'load'"),
        (BELT, "load = 1\n", "", "system.frictions[0]: load missing"),
        (BELT, "load", "small = 'mu'\nload", "system.frictions[0]: small is below [[system.frictions]] and must"),
        (BELT, "load = 1\n", 'load = "abs(F)"\n', "mode slip_same: the forces must enter rates, loads"),
        (BELT, "[system.slow]", "[system]\nsmal = 'mu'\n[system.slow]", "system: key 'smal' is unknown"),
        (BELT, "[[system.frictions]]", "[system.frictions]", "system.frictions must be tables"),
        (BELT, "until = 1\n", "", "until missing"),
        (BELT, 'x = "v"', 'x = "v"\nF = "x"', "F names two quantities"),
        (BELT, "[values]", "[values]\nx = 1", "values: x is a state, a force or the time; only parameters have a num"),
        (BELT, "until = 1", "until = 1\nf = 1", "f is the rod's; parameters of a system stand in [values]"),
        (BELT, "until = 1", "until = 1\nmu = 1", "mu is the rod's; parameters of a system stand in [values]"),
        (ON_GROUND, "contact", "contcat = 1\ncontact", "system: key 'contcat' is unknown"),
        (ON_GROUND, "rigid", "soft", "contact must be"),
        (ON_GROUND, "painleve_rod", "painleve_rot", "mechanism 'painleve_rot' is unknown; did you mean 'painleve_rod'"),
        (BELT, "[system.slow]", "[system]\nassumptions = ['1 > 2']\n[system.slow]", "assumption = '1 > 2': it never"),
        (ON_GROUND, '"rigid"', '"rigid"\ndamping = "f"',
         'contact must be "rigid", or "elastic" with compliance and damping; a rigid one has neither'),
        ("[values]\nuntil = 1", "", "", "system, start, until missing; until is below [values]"),
        (f"{BELT}until = 1", "until = 1\n", "", "until missing; until is below [start] and must be above"),
        (BELT.replace("until = 1\n", ""), "load", "until = 1\nload",
         "until missing; until is below [[system.frictions]] and must be above the first table"),
        ("sigma = 1\nmu = 1\nuntil = 1\nnear = {x = 0, z = 1, offset = 0}", "z = 1, ", "", "manifold, z missing"),
    ],
)
def test_what_is_not_a_system_is_refused_by_the_table_and_the_key(tmp_path, text, old, new, said):
    (tmp_path / "belt.toml").write_text(text.replace(old, new, 1))
    with pytest.raises((InputError, UnknownName)) as caught:
        ap.read_scene(tmp_path / "belt.toml")
    assert str(caught.value).startswith(f"{tmp_path / 'belt.toml'}: {said}")


@pytest.mark.parametrize(("angle", "height"), [("pi/3", "sqrt(3)/4"), ("60 deg", "sin(pi/3)/2")])
def test_numbers_of_a_mechanism_may_be_formulas_and_its_contact_is_closed_to_all_digits(tmp_path, angle, height):
    """A rod of length 1 touches the ground where Y = sin(theta)/2."""
    (tmp_path / "rod.toml").write_text(LEANING % (angle, height))
    scene = ap.read_scene(tmp_path / "rod.toml")
    start = dict(zip(scene.names, scene.start, strict=True))
    with mpmath.workdps(1000):
        theta, height = (mpmath.mpf(start[q].numerator) / start[q].denominator for q in ("theta", "Y"))
        assert abs(theta - mpmath.pi / 3) < mpmath.mpf(10) ** -998
        assert abs(height - mpmath.sqrt(3) / 4) < mpmath.mpf(10) ** -998
    assert dict(zip(map(str, scene.system.parameters), scene.values, strict=True))["f"] == Fraction(4, 5)
    assert ap.solve(scene).modes == ("slip_opposite",)


@pytest.mark.parametrize(("wrong", "said"), [
    *((word, "it must be a number, such as 0.2") for word in ("theta", "one", "60 degrees", "pi/")),
    *((text, "degrees are a decimal or a ratio") for text in ("pi/4 deg", "pi/4 + 30 deg", "1 + sqrt(2) deg")),
    ("sqrt(-2)", "it is not a finite real expression"), ("1/(2-2)", "it divides by zero"),
    *((text, "it is not a finite real expression") for text in ("asin(2)", "(-8)^(1/3)")),
    ("sine(1)", "the function sine is unknown; did you mean sin?"),
    ("Pi/4", "the name Pi is unknown; did you mean pi?"),
])
def test_a_number_that_is_no_formula_of_numbers_is_refused_with_its_fault_its_table_and_its_name(tmp_path, wrong, said):
    file = tmp_path / "rod.toml"
    file.write_text(LEANING % ("pi/3", wrong))
    for read in (ap.read_scene, load_mechanism):
        with pytest.raises(InputError, match=re.escape(f"{file}: state: Y = {wrong!r}: {said}")):
            read(file)
    for command in ("solve", "mechanism"):
        file.write_text(LEANING % ("pi/3", "sqrt(3)/4"))
        assert main([command, str(file), "--set", f"Y={wrong}"]) == 2


@pytest.mark.parametrize(("angle", "height"), [("pi/6", "1/4"), ("30 deg", "sin(pi/6)/2"), ("atan(1)", "sqrt(2)/4")])
def test_a_number_that_is_set_means_what_it_means_in_the_file(tmp_path, capsys, angle, height):
    shown = {}
    for file, numbers in (("own", (angle, height)), ("set", ("pi/3", "sqrt(3)/4"))):
        place = tmp_path / f"{file}.toml"
        place.write_text(LEANING % numbers)
        changes = ["--set", f"theta={angle}", "--set", f"Y = {height}"] if file == "set" else []
        assert main(["solve", str(place), "--json", *changes]) == 0
        assert main(["mechanism", str(place), *changes]) == 0
        told, _, _ = capsys.readouterr().out.partition("asympk mechanism")  # the commands to go on with name the file
        shown[file] = told.replace(str(place), "")
    assert shown["own"] == shown["set"]


def test_numbers_of_the_rod_may_be_formulas_in_its_file_its_options_and_its_sweep(tmp_path, capsys):
    file = _file(tmp_path, {**PLAIN, "sigma": '"sqrt(2)/2"', "start": '["1/3", "2^-2", "-sin(1)"]', "until": '"pi"'})
    given = ap.read_scene(file)
    assert [given.sigma, *given.start, given.until] == pytest.approx([2**-0.5, 1 / 3, 0.25, -math.sin(1), math.pi])
    start, until = ("--start", "1/3", "2^-2", "-sin(1)"), ("--until", "-(1 - 2)*pi")
    finals = []
    for told in ([file], ["--sigma", "sqrt(2)/2", "--mu", "10^-3", *start, *until],
                 ["backward", "--mu", "1e-3", "--set", "sigma=sqrt(2)/2", *start, *until]):
        assert main(["solve", *map(str, told), "--json"]) == 0
        finals.append(json.loads(capsys.readouterr().out)["final"])
    assert finals[0] == finals[1] == finals[2]
    sweep = parse_sweep('sigma = "sqrt(2)/2"\nmu = ["10^-3"]\nstart = ["1/3", "2^-2", "-sin(1)"]\nuntil = "pi"\n')
    assert sweep.quantities(0, 1)["sigma"] == 2**-0.5


def test_a_formula_for_an_angle_in_degrees_is_in_radians_as_it_is_in_a_file(tmp_path):
    radians = ap.read_scene(_file(tmp_path, {**ROD, "alpha": '"pi/4"'}))
    assert radians == turned(ap.read_scene(_file(tmp_path, ROD)), {"alpha": "pi/4"}, {}, None)
    assert float(radians.sigma) == pytest.approx(3 * math.tan(math.pi / 4) - 2)


OSCILLATOR = 'until = 1\n[system.slow]\nx = "v"\nv = "-k*x"\n[values]\nk = "pi/4"\n[start]\nx = 1\nv = 0\n'


@pytest.mark.parametrize("digits", [60, 1000])
def test_an_irrational_number_has_the_digits_that_are_asked_for(tmp_path, digits):
    """The oscillator x'' = -k x from x = 1 ends at cos(sqrt(k)); k = pi/4 had 50 digits, and so had the end."""
    (tmp_path / "oscillator.toml").write_text(OSCILLATOR)
    (end, _) = ap.solve(ap.read_scene(tmp_path / "oscillator.toml"), digits=digits).final
    with mpmath.workdps(digits + 20):
        assert abs(end - mpmath.cos(mpmath.sqrt(mpmath.pi) / 2)) < mpmath.mpf(10) ** (1 - digits)


def test_a_start_in_a_list_may_have_formulas_of_numbers(tmp_path):
    text = OSCILLATOR.partition("[start]")[0]
    (tmp_path / "oscillator.toml").write_text(f'start = ["2^-2", "30 deg"]\n{text}')
    assert [float(v) for v in ap.read_scene(tmp_path / "oscillator.toml").start] == pytest.approx([0.25, math.pi / 6])


def test_a_rod_at_an_angle_has_the_digits_that_are_asked_for(tmp_path):
    """The group sigma = f tan(alpha) - 2 of a rod in physical units had 100 digits."""
    sigma = ap.read_scene(_file(tmp_path, ROD)).sigma
    with mpmath.workdps(1010):
        exact = 3 * mpmath.tan(mpmath.pi / 3) - 2
        assert abs(mpmath.mpf(sigma.numerator) / sigma.denominator - exact) < mpmath.mpf(10) ** -1000


def test_a_power_of_numbers_is_no_degree():
    assert read_constant("m", "2^100/4^40") == 2**20
    assert float(read_constant("m", "pi^90/pi^89")) == math.pi
    for text, said in (("10^400", "beyond the range of doubles"), ("10^10^10", "a number of more than 1000 digits"),
                       ("sqrt(2)^(10^9)", "a number of more than 1000 digits")):
        with pytest.raises(InputError, match=said):
            read_constant("m", text)


@pytest.mark.parametrize(("wrong", "said"), [
    ("sigma=-pi", "sigma = -3.141592654: it must be greater than -2"),
    ("mu=1-2^(1/2)", "mu = -0.4142135624: it must be positive"),
    ("sigma0=sqrt(2)-1/2", "sigma0 = 0.9142135624: it must be at least sigma = 1"),
    ("x=1,5", "x = '1,5': it must be a number, such as 0.2"),
    ("x=10^400", "a number in it is beyond the range of doubles"),
    ("x=(sqrt(2)+sqrt(3))^2-5-2*sqrt(6)", "beyond the range of doubles; write 0 if it is meant"),
])
def test_a_number_that_is_refused_is_shown_in_few_digits(capsys, wrong, said):
    """An irrational number was shown as the first sixty digits of a ratio."""
    assert main(["solve", "backward", "--set", wrong]) == 2
    assert said in capsys.readouterr().err


def test_a_horizon_is_no_angle(tmp_path):
    for text in (BELT, LEANING % ("pi/3", "sqrt(3)/4")):
        (tmp_path / "scene.toml").write_text(re.sub(r"until = \S+", 'until = "30 deg"', text, count=1))
        with pytest.raises(InputError, match="until = '30 deg': it must be a decimal"):
            ap.read_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize("beyond", ["exp(exp(20))", "-exp(1e300)", "exp(-exp(20))"])
def test_a_formula_of_a_number_beyond_the_range_of_doubles_is_refused_at_once(tmp_path, beyond):
    (tmp_path / "rod.toml").write_text(LEANING % ("pi/3", beyond))
    with pytest.raises(InputError, match=re.escape(f"Y = {beyond!r}: a number in it is beyond the range of doubles")):
        ap.read_scene(tmp_path / "rod.toml")
    with pytest.raises(InputError, match=r"law = .*: a number in it is beyond the range of doubles"):
        read_formula(f"f*({beyond} + f)", {"f": sp.Symbol("f")}, "law")  # a polynomial of a degree beyond all bounds


@pytest.mark.parametrize(("text", "said"), [
    ("cos(exp(exp(20)))", "a number in it is beyond the range of doubles"),
    ("mod(exp(exp(20)), 1)", "a number in it is beyond the range of doubles"),
    ("mod(7, exp(-exp(20)))", "a number in it is beyond the range of doubles"),
    ("abs(log(-1))", "a number in it is not real"),
])
def test_a_function_of_a_number_beyond_the_range_of_doubles_is_refused_at_once(text, said):
    """The cosine was sought with as many digits as exp(exp(20)) has before its point, 2*10^8."""
    with pytest.raises(InputError, match=said):
        read_constant("k", text)


@pytest.mark.parametrize("text", ["x > sqrt(-1)", "asin(2) < x", "not x < log(-2)"])
def test_a_relation_to_what_is_no_real_number_is_refused_with_its_text(text):
    """SymPy's TypeError came through; alone, asin(2) was read as a formula."""
    x = sp.Symbol("x", real=True)
    for given, read in ((text, read_relation), (f"Piecewise((1, {text}), (0, True))", read_formula)):
        with pytest.raises(InputError, match=re.escape(f" = {given!r}: a side of a relation is not a finite real")):
            read(given, {"x": x})
    with pytest.raises(InputError, match=r"'x\*asin\(2\)': it is not a finite real expression"):
        read_formula("x*asin(2)", {"x": x})


def test_relations_joined_by_and_or_and_not_are_an_assumption():
    """In a Piecewise they were read, as an assumption they were taken for a formula with a wrong sign."""
    x, y = sp.symbols("x y", real=True)
    texts = {"x > y and y > 0": sp.And(x > y, y > 0), "x < 1 or x > 2": sp.Or(x < 1, x > 2), "not x > 1": x <= 1,
             "(x > y) & (y > 0)": sp.And(x > y, y > 0), "(x < 1) | ~(x <= 2)": sp.Or(x < 1, x > 2)}
    assert {text: read_relation(text, {"x": x, "y": y}) for text in texts} == texts
    with pytest.raises(InputError, match="'x or y': a condition is a relation, such as x < 1"):
        read_relation("x or y", {"x": x, "y": y})


def test_a_number_that_a_double_holds_is_read():
    assert [read_constant("k", text) for text in ("10^305", "-10^-305")] == [10**305, -Fraction(1, 10**305)]
    with mpmath.workdps(400):
        assert float(read_constant("k", "sin(10^305)")) == float(mpmath.sin(mpmath.mpf(10) ** 305))


@pytest.mark.parametrize(("over", "said"), [
    ("theta = [0.05]", r"give its range, \[low, high\]"), ("phi = [0, 1]", "phi is no coordinate and no parameter"),
    ("theta = ['80 deg', 'pi/6']", "with low < high"), ("theta = ['a', 1]", "theta = 'a': it must be a number"),
])
def test_a_range_in_the_file_of_a_mechanism_is_read_by_its_scene_and_its_sweep_too(tmp_path, over, said):
    """Only ``asympk mechanism`` looked at it."""
    where = tmp_path / "scene.toml"
    where.write_text(LEANING % ("pi/3", "sqrt(3)/4") + f"[over]\n{over}\n")
    for read in (ap.read_scene, read_sweep, load_mechanism):
        with pytest.raises(InputError, match=said):
            read(where)


def test_a_coordinate_that_is_no_name_is_refused_before_the_range_over_it(tmp_path):
    where = tmp_path / "scene.toml"
    where.write_text(LEANING.replace('"theta"]', '"1t"]') % ("1", "1") + "[over]\ntheta = [0, 1]\n")
    with pytest.raises(InputError, match="coordinates must be a list of plain names"):
        ap.read_scene(where)


@pytest.mark.parametrize("change", ["sigma = {grid = [1, 2], points = 3}", "until = [1, 2]",
                                    "start = [{uniform = [0, 1]}, 0, 1]"])
def test_a_range_in_the_file_of_a_rod_is_said_to_be_of_a_sweep(tmp_path, change):
    """It was said to be no number."""
    key, entry = change.split(" = ", 1)
    entries = {"sigma": "1", "mu": "1e-3", "start": "[0, 0, 1]", "until": "1"} | {key: entry}
    with pytest.raises(InputError, match=f"{key} = .* is of a sweep, which asympk sweep follows"):
        ap.read_scene(_file(tmp_path, entries))


@pytest.mark.parametrize("name", ["class", "in", "from", "None"])
def test_a_word_of_python_may_name_a_quantity(name):
    """It was said to be no formula."""
    symbol = sp.Symbol(name, real=True)
    assert read_formula(f"2*{name} + {name}^2", {name: symbol}) == 2 * symbol + symbol**2


def test_the_horizon_of_a_system_may_be_a_formula_of_numbers_as_in_a_sweep(tmp_path):
    (tmp_path / "belt.toml").write_text(BELT.replace("until = 1", 'until = "2^3/5"', 1))
    assert ap.read_scene(tmp_path / "belt.toml").until == Fraction(8, 5)
    (tmp_path / "rod.toml").write_text((LEANING % ("pi/3", "sqrt(3)/4")).replace("0.01", '"1/2^7"', 1))
    assert ap.read_scene(tmp_path / "rod.toml").until == Fraction(1, 128)
    assert load_mechanism(tmp_path / "rod.toml").followed


@pytest.mark.parametrize(("old", "new", "said"), [
    ("coordinates", "name = 3\ncoordinates", "name = 3: it must be a string"),
    ('contact = "rigid"', "compliance = 1e-6\ndamping = 1", "in a file its name, such as c"),
])
def test_a_name_or_a_compliance_of_another_kind_is_refused_in_a_scene_and_in_a_mechanism(tmp_path, old, new, said):
    """The name was refused in the scene alone, and the words on the compliance were for Python."""
    (tmp_path / "rod.toml").write_text((LEANING % (1, "sin(1)/2")).replace(old, new, 1))
    for read in (ap.read_scene, load_mechanism):
        with pytest.raises(InputError, match=said):
            read(tmp_path / "rod.toml")


def test_the_scene_of_a_system_has_the_name_in_its_file_or_of_its_file(tmp_path):
    (tmp_path / "belt.toml").write_text(BELT)
    assert ap.read_scene(tmp_path / "belt.toml").name == "belt"
    for text in (BELT, LEANING % (1, "sin(1)/2")):
        (tmp_path / "belt.toml").write_text(f'name = "block"\n{text}')
        assert ap.read_scene(tmp_path / "belt.toml").name == "block"


def test_a_text_in_place_of_its_file_is_an_unknown_name_however_long_it_is():
    with pytest.raises(UnknownName, match="is unknown; choose one of backward"):
        ap.read_scene("sigma = 1\nmu = 1e-3\nstart = [0, 0, -1]\nuntil = 1\n" + "# for the test\n" * 300)


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(UnknownName, match="did you mean 'backward'"):
        ap.read_scene("backwards")


def test_options_replace_numbers_of_any_scene_by_the_names_that_it_has(capsys):
    assert main(["solve", "backward", "--sigma", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["final"] == list(ap.solve(ap.Scene(2, "1e-6", (0, "0.2", -1), 5)).final)
    assert main(["solve", "chalk", "--set", "f=1", "--set", "u=-0.1", "--until", "0.01", "--json"]) == 0
    chalk = turned(ap.read_scene("chalk"), {"f": 1}, {"u": "-0.1"}, "0.01")
    assert json.loads(capsys.readouterr().out)["final"] == list(ap.solve(chalk).final)
    assert main(["solve", "arm", "--set", "f=1/2", "--set", "x=1/5", "--until", "0.01", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["modes"] == ["slip_same"]
    assert main(["solve", "chalk", "--mu", "1e-3"]) == 2
    assert "'mu' is no parameter; choose one of m, P, f" in capsys.readouterr().err


def test_an_angle_that_a_file_gives_in_degrees_is_set_with_and_without_its_unit(capsys):
    for setting in ("alpha=80", "alpha=80 deg"):
        assert main(["solve", "chalk", "--set", setting]) == 0
        assert "alpha = 80 deg" in capsys.readouterr().out
    assert main(["solve", "chalk", "--set", "f=1 deg"]) == 2
    assert "f = '1 deg': it must be a decimal" in capsys.readouterr().err


def test_a_parameter_of_a_scene_without_any_is_refused_by_saying_so():
    x = sp.Symbol("x", real=True)
    scene = ap.Scene(system=ap.System.smooth({x: -x}, {}, None), start=[1], until=1)
    with pytest.raises(ap.errors.UnknownName, match="'until' is no parameter; the scene has none"):
        turned(scene, {"until": 6}, {}, None)


def test_solve_tells_physical_units_on_request(capsys):
    assert main(["solve", "chalk", "--physical"]) == 0
    out = capsys.readouterr().out
    assert out.splitlines()[-5].split()[:4] == ["t", "R_1", "dR_1", "u"]
    assert out.splitlines()[-1].split()[0] == "0.05"
    assert main(["solve", "backward", "--physical"]) == 2
    assert "no physical quantities" in capsys.readouterr().err


def test_scenes_are_listed_and_printed_as_files(capsys, tmp_path):
    assert main(["scenes"]) == 0
    listed = {line.partition(" ")[0] for line in capsys.readouterr().out.splitlines()}
    assert {*scenefile.scene_names(), *ap.systems.__all__} < listed
    assert main(["scenes", "static"]) == 0
    (tmp_path / "copy.toml").write_text(capsys.readouterr().out)
    assert ap.read_scene(tmp_path / "copy.toml").sigma0 == 2


def test_the_csv_file_follows_the_path_and_passes_through_its_events(tmp_path):
    target = tmp_path / "path.csv"
    assert main(["solve", "wrong-side", "--csv", str(target)]) == 0
    path = ap.solve(ap.read_scene("wrong-side"))
    with target.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    times = [float(row["t"]) for row in rows]
    assert times == sorted(times)
    assert {float(event.t) for event in path.events} <= set(times)
    assert [float(rows[-1][axis]) for axis in "xyz"] == list(path.final)
    for row in rows[5::97]:
        assert [float(row[axis]) for axis in "xyz"] == [float(v) for v in path(float(row["t"]))]
        assert float(row["s"]) == float(row["x"]) + float(row["y"])


def test_physical_csv_has_the_rod_force_as_load(tmp_path):
    target = tmp_path / "path.csv"
    assert main(["solve", "chalk", "--physical", "--csv", str(target)]) == 0
    with target.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    last = rows[-1]
    assert float(last["R"]) == pytest.approx(float(last["R_1"]) + 0.05 * 0.08 * float(last["dR_1"]), rel=1e-14)
    assert float(last["t"]) == 0.05


def test_samples_resolve_every_layer():
    path = ap.solve(ap.read_scene("wrong-side"))
    inside = [row for row in trace(path) if row[0] < path.events[-1].t]
    assert len(inside) > 1000
    assert len(trace(path)) < 5000


def test_samples_follow_a_long_mode_beside_short_ones():
    """Each mode had as many samples, and the line through those of a long one was off by 0.6."""
    x, v, u, F, t = sp.symbols("x v u F t", real=True)
    pushed = ap.Friction(velocity=u, force=F, load=1, kinetic=sp.Rational(1, 2))
    push = sp.Piecewise((sp.cos(100 * t), t < 1), (0, True))
    system = ap.System.with_frictions({x: v, v: -x, u: push + F}, {}, [pushed], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 1, v: 0, u: 0}, until=30))
    assert len(path.modes) > 30
    times, heights = np.array([row[:2] for row in trace(path, 1200)]).T
    dense = np.linspace(0, 30, 3001)
    assert np.interp(dense, times, heights) == pytest.approx(np.cos(dense), abs=0.01)


def _drawn(path, file):
    path.plot(file)
    return file.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_plot_is_the_same_bytes_every_time(tmp_path, suffix):
    path = ap.solve(ap.read_scene("collisions"))
    first, second = (_drawn(path, tmp_path / f"{n}{suffix}") for n in "ab")
    assert first == second
    assert len(first) > 5000


def test_a_plot_of_another_kind_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"one of \.pdf, \.svg, \.png"):
        ap.solve(ap.read_scene("forward")).plot(tmp_path / "a.gif")


def test_without_matplotlib_the_error_gives_the_pip_line(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingPackage, match=r"pip install 'asympk\[plot\]'"):
        ap.solve(ap.read_scene("forward")).plot(tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_the_damping_of_a_mechanism_in_a_scene_may_use_its_parameters_coordinates_rates_and_time(tmp_path):
    file = tmp_path / "rod.toml"
    state = "X = 0\nY = 1\ntheta = 1\nx = 0\ny = 0\nz = 1\n\"theta'\" = 0\n"
    system = '[system]\ncontact = "elastic"\ncompliance = "c"\ndamping = "h*m + X^2 + X\'^2 + t^2"\n'
    file.write_text(f"until = 1\n{system}[system.mechanism]\n{SLENDER_ROD}"
                    f"[values]\nm = 2\nl = 1\ng = 1\nf = 1\nc = 1e-3\nh = 1\n[start]\n{state}")
    scene = ap.read_scene(file)
    assert [str(s) for s in scene.system.parameters] == ["c", "f", "g", "h", "l", "m"]
    assert str(scene.system.time) == "t"


ELASTIC = """\
until = 1
system = {mechanism = "painleve_rod", contact = "elastic", compliance = "c", damping = "h"}
values = {m = 2, l = 1, g = 1, f = 1, c = 1e-3, h = 1}
start = {X = 0, Y = 0, theta = 0, "X'" = 3, "Y'" = -1, "theta'" = -1}
"""


def test_an_elastic_mechanism_in_a_scene_starts_from_its_coordinates_and_rates(tmp_path):
    """At theta = 0 and l = 1 the gap is Y, its rate Y' - theta', and the sliding velocity X'."""
    file = tmp_path / "rod.toml"
    file.write_text(ELASTIC)
    scene = ap.read_scene(file)
    told = {"X": 0, "Y": 0, "theta": 0, "x": 0, "theta'": -1, "y": 0, "z": 3}
    assert dict(zip(scene.names, scene.start, strict=True)) == told
    file.write_text(above := ELASTIC.replace("Y = 0", "Y = 1"))
    scene = ap.read_scene(file)
    assert dict(zip(scene.names, scene.start, strict=True)) == {**told, "Y": 1, "x": -1000}
    file.write_text(above.replace("\"Y'\" = -1", "\"Y'\" = -3"))
    with pytest.raises(InputError, match="above the contact, g = 1, g' = -2, where its damper pushes already"):
        ap.read_scene(file)
    file.write_text(ELASTIC.replace("\"X'\" = 3, ", ""))
    with pytest.raises(InputError, match="no value for X'; give all coordinates and rates, or the states X, Y"):
        ap.read_scene(file)
    file.write_text(ELASTIC.replace("theta'", "thta'"))
    with pytest.raises(InputError, match=r"start: thta' is no coordinate, rate or state; these are .*mean theta'"):
        ap.read_scene(file)
    file.write_text(ELASTIC.replace("start = {", "start = {t = 2, "))
    with pytest.raises(InputError, match="start: t is the time; a scene starts at t = 0"):
        ap.read_scene(file)


def test_a_start_above_a_contact_in_a_file_is_judged_by_the_damping_in_it(tmp_path):
    """At theta = theta' = 0 the gap is Y = 1/2; a contact pushes below h |Y'|."""
    file = tmp_path / "rod.toml"
    file.write_text(ELASTIC.replace("Y = 0", "Y = 0.5").replace("\"theta'\" = -1", "\"theta'\" = 0"))
    with pytest.raises(InputError, match=r"above the contact, g = 0\.5, g' = -1, where its damper pushes already"):
        ap.read_scene(file)
    scene, _ = changed_scene(str(file), {"h": "0.4"})
    assert (_begun(scene)["x"], _begun(scene)["y"]) == (-500, 1000)
    with pytest.raises(InputError, match="where its damper pushes already"):
        turned(scene, {"h": "0.6"}, {}, None)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if name in ("crank_slider", "brake_shoe")
                                  else name for name in ap.systems.__all__])
def test_the_file_that_is_printed_for_a_system_of_the_catalogue_holds_its_example(tmp_path, name):
    file = tmp_path / f"{name}.toml"
    file.write_text(scene_text(name), encoding="utf-8")
    printed, example = ap.read_scene(file), import_module(f"asympk.systems.{name}").scenes()[0]
    assert (printed.system, printed.values, printed.until) == (example.system, example.values, example.until)
    assert [*map(float, printed.start)] == pytest.approx([*map(float, example.start)], rel=2**-52, abs=0)
    read, meant = ([{key: float(Fraction(value)) for key, value in numbers.items()}
                    for numbers in (scene.origin or ())[1:3]] for scene in (printed, example))
    assert read == meant


def test_a_scene_is_known_by_the_name_of_its_system_in_any_case():
    assert ap.read_scene("Arm") == ap.systems.arm.scenes()[0]
    with pytest.raises(UnknownName, match="did you mean 'arm'"):
        ap.read_scene("amr")


def _high(tmp_path, height, centre):
    file = tmp_path / f"high-{height}.toml"
    file.write_text("until = 0.1\n" + ON_HIGH_GROUND.format(height=height, centre=centre))
    return file


def _begun(scene):
    return dict(zip(scene.names, scene.start, strict=True))


def test_only_the_start_depends_on_the_height_of_the_ground(tmp_path):
    low, high = (ap.read_scene(_high(tmp_path, height, height)) for height in (0, 2))
    assert (low.system, low.values) == (high.system, high.values)
    assert _begun(high) == _begun(low) | {"Y": 2}
    assert _begun(ap.read_scene(_high(tmp_path, 1, "0.875")))["x"] == 1
    file = _high(tmp_path, 3, 3)
    for unknown in ("U", "gap"):
        text = file.read_text()
        file.write_text(text.replace("H = 3", f"H = 3\n{unknown} = 1"))
        with pytest.raises(InputError, match=f"{unknown} is not a parameter of this system"):
            ap.read_scene(file)
        file.write_text(text)


def test_a_number_with_the_name_of_a_function_that_is_called_is_no_parameter(tmp_path):
    file = _high(tmp_path, 0, 0)
    file.write_text(file.read_text().replace("H = 0", "H = 0\ncos = 1"))
    with pytest.raises(InputError, match="cos is not a parameter of this system"):
        ap.read_scene(file)


def test_numbers_of_a_mechanism_are_changed_before_its_start_is_derived(tmp_path):
    """At theta = 0 the sliding velocity is X', and x = -g/c with the gap g = Y - H."""
    file = str(_high(tmp_path, 0, 0))
    scene, left = changed_scene(file, {"X'": "-2", "Y": "0.875", "H": "1", "c": "0.25", "x": "3"})
    assert left == {"x": "3"}
    assert _begun(scene) == {"X": 0, "Y": Fraction("0.875"), "theta": 0, "x": 0.5, "theta'": 0, "y": 0, "z": -2}
    assert dict(zip(scene.system.parameters, scene.values, strict=True))[scene.system.small] == Fraction("0.25")


@pytest.mark.parametrize("printed", [False, True])
def test_numbers_of_a_mechanism_of_the_catalogue_are_changed_before_its_start_is_derived(tmp_path, printed):
    """The reaction x of the rod is -g/c with the gap g = Y - l sin(theta), and z is its sliding velocity."""
    (file := tmp_path / "printed.toml").write_text(scene_text("painleve_rod"), encoding="utf-8")
    where = str(file) if printed else "painleve_rod"
    scene, left = changed_scene(where, {"theta": "1.2", "l": 2, "X'": "-2", "c": "1e-3", "x": "3"})
    begun, before, turning = _begun(scene), 1.1, 0.2
    assert left == {"x": "3"}
    assert begun["x"] == pytest.approx((2 * math.sin(1.2) - math.sin(before)) * 1e3)
    assert begun["z"] == pytest.approx(-2 + turning * 2 * math.sin(1.2))


def test_a_setting_changes_coordinates_and_rates_in_a_file(tmp_path, capsys):
    file = str(_high(tmp_path, 0, 0))
    assert main(["solve", file, "--set", "X'=-2", "--set", "H=1", "--set", "Y=1", "--until", "0", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert dict(zip(told["names"], told["final"], strict=True)) == {
        "X": 0, "Y": 1, "theta": 0, "x": 0, "theta'": 0, "y": 0, "z": -2}


def test_a_rigid_contact_of_a_system_in_a_file_has_its_constraint(tmp_path):
    """The load 1 - t slows a block from 1 to 1/2 over the way 2/3; from t = 1 on the block is lifted by (t - 1)^3/6."""
    file = tmp_path / "lifted.toml"
    file.write_text("until = 2\n[system]\ntime = \"t\"\n[system.slow]\nx = \"u\"\ny = \"v\"\nu = \"F\"\n"
                    "v = \"N + t - 1\"\n[[system.frictions]]\nvelocity = \"u\"\nforce = \"F\"\nnormal = \"N\"\n"
                    "load = \"N\"\nkinetic = \"f\"\ngap = \"y\"\nconstraint = \"N + t - 1\"\n"
                    "[values]\nf = 1\n[start]\nx = 0\ny = 0\nu = 1\nv = 0\n")
    path = ap.solve(ap.read_scene(file))
    assert path.modes == ("slip_same", "open")
    assert path.events[0].t == pytest.approx(1)
    assert path.final == pytest.approx((2 / 3 + 1 / 2, 1 / 6, 1 / 2, 1 / 2))
    text = file.read_text()
    file.write_text(text.replace("constraint = \"N + t - 1\"", "constraint = \"N - 1\""))
    with pytest.raises(ap.AsympkError, match=r"the second rate of gap = y is N \+ t - 1, and the constraint N - 1"):
        ap.read_scene(file)
    file.write_text(text.replace("gap = \"y\"", "gap_rate = \"v\""))
    held = ap.solve(ap.read_scene(file))  # by the load |1 - t|
    assert held.modes[:2] == ("slip_same", "slip_opposite")
    assert held.final == pytest.approx((1, 0, 0, 0), abs=1e-9)
    file.write_text(file.read_text().replace("gap_rate = \"v\"", "gap_rate = \"u\""))
    with pytest.raises(ap.AsympkError, match="the rate of gap_rate = u is F, and the constraint N"):
        ap.read_scene(file)
    file.write_text(file.read_text().replace("gap_rate", "gap = \"y\"\ngap_rate"))
    with pytest.raises(ap.AsympkError, match="gap_rate= is for a constraint without gap="):
        ap.read_scene(file)


@pytest.mark.parametrize(("old", "new", "said"), [("0.75", "0.76", "g' = 0.008"), ("0.8", "0.7", "g = -0.075")])
def test_a_rigid_bar_starts_with_its_length(tmp_path, old, new, said):
    """The ends of a bar of the length 1 slide on two guides at right angles."""
    file = tmp_path / "bar.toml"
    text = ("coordinates = [\"u\", \"v\"]\nlagrangian = \"(u'^2 + v'^2)/2\"\ngap = \"(u^2 + v^2 - 1)/2\"\n"
            "slip = \"u\"\nfriction = 0\ncontact = \"rigid\"\nuntil = 0.1\n"
            "[state]\nu = 0.6\nv = 0.8\n\"u'\" = -1\n\"v'\" = 0.75\n")
    file.write_text(text)
    scene = ap.read_scene(file)
    assert sum(q**2 for q in ap.solve(scene).final[:2]) == pytest.approx(1)
    with pytest.raises(InputError, match=r"the gap rate .* of the contact is not 0; one that holds both ways"):
        ap.solve(replace(scene, start=(*scene.start[:3], "0.76")))
    file.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=f"the start is off the constraint: {said}"):
        ap.read_scene(file)


def test_static_friction_in_a_file_follows_the_kinetic_friction_that_it_equals(tmp_path):
    file = tmp_path / "belt.toml"
    file.write_text("until = 1\n[system.slow]\nx = \"v\"\nv = \"F - x\"\n[[system.frictions]]\nvelocity = \"v\"\n"
                    "force = \"F\"\nload = 1\nkinetic = \"f\"\nstatic = \"f0\"\n"
                    "[values]\nf = 1\nf0 = 1\n[start]\nx = 0\nv = 0\n")
    assert changed_scene(str(file), {"f": "2"})[0].values == (2, 2)


@pytest.mark.parametrize("static", ["f0 + cos(x)/8", "f0"])
def test_a_static_friction_follows_by_its_place_in_the_law_and_not_by_its_name(tmp_path, static):
    file = tmp_path / "belt.toml"
    file.write_text("until = 1\n[system.slow]\nx = \"v\"\nv = \"F - x\"\n[[system.frictions]]\nvelocity = \"v\"\n"
                    f"force = \"F\"\nload = 1\nkinetic = \"{static.replace('f0', 'a')}\"\nstatic = \"{static}\"\n"
                    "[values]\na = 1\nf0 = 1\n[start]\nx = 0\nv = 0\n")
    scene, left = changed_scene(str(file), {"a": "2"})
    assert scene.values == turned(ap.read_scene(file), {"a": 2}, {}, None).values == (2, 2)
    assert not left
    file.write_text("until = 1\n[system.slow]\nx = \"v\"\nv = \"f - f0*x\"\n[values]\nf = 1\nf0 = 1\n"
                    "[start]\nx = 0\nv = 0\n")  # a force and a stiffness
    assert changed_scene(str(file), {"f": "2"})[0].values == (2, 1)
    assert turned(ap.read_scene(file), {"f": 2}, {}, None).values == (2, 1)


def test_a_start_keeps_its_origin_until_another_replaces_it(tmp_path):
    (tmp_path / "ball.toml").write_text(FALLING_BALL)
    scene = ap.read_scene(tmp_path / "ball.toml")
    assert replace(scene, until=1, start=scene.start).origin[:3] == scene.origin[:3]
    moved = replace(scene, start=(0, 2, -200, 0, 1))
    assert moved.origin is None
    assert turned(moved, {"f": 1}, {}, None).start == moved.start


@pytest.mark.parametrize("gap", [1, "1.01"])  # on the contact, and off it
def test_a_dependent_state_of_a_turned_scene_is_as_exact_as_that_of_the_scene_anew(gap):
    def scene(speed):
        numbers = {**brake_shoe.VALUES, "b": gap, "v": speed, "c": "1/100"}
        start = {"X": 0, "theta": 0, "X'": "1/3", "theta'": 0}
        return example_scene(brake_shoe.mechanism(), brake_shoe.system(), numbers, start, 1, "shoe")

    assert turned(scene("-1/3"), {"v": "-1/7"}, {}, None).start == scene("-1/7").start
    assert scene("-1/7").start[-1] == Fraction(10, 21)


def test_a_start_in_exact_coordinates_is_exact_in_reaction_and_sliding_velocity(tmp_path):
    file = tmp_path / "ball.toml"
    file.write_text(FALLING_BALL)
    scene = ap.read_scene(file)
    assert scene.start == (0, 1, -100, 0, 1)
    final = dict(zip(scene.names, ap.solve(scene, digits=30).final, strict=True))
    assert abs(final["Y"] + final["x"] / 100) < mpmath.mpf("1e-30")  # g + c x is an invariant
    file.write_text(FALLING_BALL.replace('slip = "X"', 'slip = "X + sin(Y)"').replace("\"Y'\" = 0", "\"Y'\" = 0.1"))
    with mpmath.workdps(60):
        z = 1 + mpmath.cos(1) / 10
        found = ap.read_scene(file).start[-1]
        assert abs(mpmath.mpf(found.numerator) / found.denominator - z) < mpmath.mpf("1e-49")
