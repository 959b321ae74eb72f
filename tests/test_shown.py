"""What a person meets first: how nouns show themselves, a path's picture, frame and file, and how all of it is kept."""

import pickle
import re
import subprocess
import sys
import threading
from fractions import Fraction
from functools import cache
from shutil import which

import mpmath
import numpy as np
import pytest
import sympy as sp
from matplotlib.collections import LineCollection

import asympk as ap
from asympk.certify import certify
from asympk.digits import carried
from asympk.doors import DOORS
from asympk.errors import InputError, MissingPackage, Unfinished
from asympk.explore.knobs import knobs_of
from asympk.formulas import formula_in_words
from asympk.many import Many
from asympk.mechanics.paradoxset import ParadoxSet
from asympk.output.terminal import path_as_text
from asympk.pictures.paths import shade
from asympk.pictures.trace import trace
from asympk.scenes.scenefile import shipped
from asympk.scenes.turned import turned
from asympk.shown import Card, as_html, as_latex, ball_as_text, number_as_text
from asympk.sweep.sweepfile import read_sweep

x, v, F = sp.symbols("x v F", real=True)
BLOCK = ap.System.with_frictions(
    slow={x: v, v: -4 * x + F}, fast={}, frictions=(ap.Friction(velocity=v, force=F, load=1, kinetic=1),)
)
ROD = ap.Scene(sigma=1, mu="1e-3", start=(0, "0.2", -1), until=2)
SPRING = ap.Scene(system=BLOCK, values={}, start={"x": 3, "v": 0}, until=5)
MU = sp.Symbol("mu", positive=True)
LAYER = ap.Scene(system=ap.System.smooth({x: v - x}, {v: x - v - v**3}, MU), values={MU: "1e-3"},
                 start={"x": 1, "v": 0}, until=2)
CHALK = {"m": "0.01", "P": 1, "f": "3/2", "alpha": "70 deg", "l": "0.08", "k": 50000, "h": "0.05",
         "start": (0, 0, "-0.02"), "until": "0.05"}
WAYS = [
    (ROD, {}),
    (ROD, {"digits": 50}),
    (ROD, {"method": "jump"}),
    (ROD, {"method": "jump", "digits": 30}),
    (ROD, {"method": "lsoda"}),
    (ROD, {"method": "sign"}),
    (ROD, {"method": "tanh", "eps": 1e-2}),
    (ROD, {"method": "moreau"}),
    (SPRING, {}),
    (SPRING, {"digits": 20}),
    (ap.systems.bead_rod.scenes()[0], {}),
    (ap.systems.bead_rod.scenes()[0], {"method": "jump"}),
    (LAYER, {"method": "slow"}),
    (ap.Scene(np.float64(1), np.float32(0.25), (np.int64(0), np.float64(0.2), np.float32(-1)), np.int32(2)), {}),
]


@cache
def _path(k):
    scene, options = WAYS[k]
    try:
        return ap.solve(scene, **options)
    except Unfinished as short:
        return short.path


@pytest.fixture(params=range(len(WAYS)), ids=lambda k: f"{WAYS[k][0].names[-1]}-{WAYS[k][1]}")
def path(request):
    return _path(request.param)


@pytest.mark.few(3)
def test_a_path_of_any_method_survives_pickling_with_its_dense_output(path):
    again = pickle.loads(pickle.dumps(path))
    times = [0, float(path.end) / 3, float(path.end)]
    assert again == path
    assert hash(again) == hash(path)
    assert np.all(again(times) == path(times))


def test_the_spans_of_the_modes_follow_one_another_from_0_to_the_end(path):
    modes, begins, ends = zip(*path.spans, strict=True)
    assert modes == path.modes
    assert begins == (0, *(float(event.t) for event in path.events))
    assert ends == (*begins[1:], float(path.end))


@pytest.mark.few(1)
def test_a_path_tells_itself_in_a_few_lines(path):
    lines = repr(path).splitlines()
    assert repr(path.model) in lines[0]
    assert len(repr(path)) < 1200
    assert max(map(len, lines)) <= 100
    assert "<table>" in path._repr_html_()


@pytest.mark.parametrize(("options", "told"), [({"method": "jump"}, True), ({"method": "exact"}, False)])
def test_an_asymptotic_model_shows_the_error_that_it_predicts(options, told):
    path = ap.solve(ROD, **options)
    words = f"predicted error {float(path.error):.1e}" if told else "predicted error"
    for text in (path_as_text(path, None), " ".join(repr(path).split())):
        assert (words in text) is told


def test_a_scene_of_many_parameters_shows_its_start_and_its_horizon():
    many = sp.symbols("p0:12")
    system = ap.System.smooth(slow={x: sum(many)}, fast={v: -v}, small=sp.Symbol("mu", positive=True))
    told = repr(ap.Scene(system=system, values=range(1, 14), start=(7, 8), until=9))
    assert "start  x = 7, v = 8" in told
    assert "until  9" in told


@pytest.mark.parametrize(("scene", "options"), [(ROD, {}), (ROD, {"digits": 40}), (SPRING, {"digits": 15})])
def test_equal_scenes_solved_equally_are_equal_paths_and_others_are_not(scene, options):
    first, second = ap.solve(scene, **options), ap.solve(scene, **options)
    assert first == second
    assert len({first, second, ap.solve(ap.Scene(1, "1e-3", (0, "0.2", -1), 3))}) == 2


def test_certificates_and_jump_maps_may_be_members_of_sets():
    pytest.importorskip("flint")
    rod = ap.systems.painleve_klein.system()
    assert len({certify(ROD), certify(ROD, {"x": (0, "1e-6")})}) == 2
    assert len({ap.jump_map(rod, order=0), ap.jump_map(rod, order=0), ap.jump_map(rod)}) == 2


@pytest.mark.parametrize("digits", [1, 15, 50, 200])
def test_a_result_prints_the_digits_asked_for(digits):
    value = ap.solve(ROD, digits=digits).final[0]
    with mpmath.workdps(3):
        assert len(str(value).lstrip("0.")) in range(digits - 3, digits + 1)
        assert str(value) in repr(value)


def test_arithmetic_with_a_result_keeps_its_digits_in_a_thread_that_spoils_the_precision():
    value = ap.solve(ROD, digits=50).final[0]
    found = []

    def spoil():
        with mpmath.workdps(5):
            found.extend([value * 3 / 3, 1 + value - 1, mpmath.mpf(2) * value / 2, value.context.sqrt(value) ** 2])

    thread = threading.Thread(target=spoil)
    thread.start()
    thread.join()
    assert len(found) == 4
    assert all(abs(w - value) < abs(value) * mpmath.mpf(10) ** -49 for w in found)


def test_a_number_that_carries_its_digits_is_an_mpf_that_sympy_reads_and_pickle_keeps():
    third = carried(Fraction(1, 3), 60)
    assert isinstance(third, mpmath.mpf)
    assert str(sp.sympify(third)) == str(third) == "0." + 60 * "3"
    assert pickle.loads(pickle.dumps(third)) == third
    assert str(pickle.loads(pickle.dumps(third))) == str(third)
    assert hash(carried(Fraction(1, 4), 60)) == hash(0.25)


def test_every_door_leads_to_a_documented_function_that_takes_the_noun():
    from importlib import import_module

    for door, (module, name) in DOORS.items():
        noun, method = door.split(".")
        assert getattr(import_module(f"asympk.{module}"), name).__doc__
        assert hasattr({"Many": Many, "ParadoxSet": ParadoxSet}.get(noun) or getattr(ap, noun), method)


@pytest.mark.few(3)
def test_a_plot_has_a_panel_for_every_state_and_a_mark_for_every_event(path):
    figure = path.plot()
    combinations = path.scene.combinations
    assert len(figure.axes) == len(path.names) + len(combinations)
    for axis, name in zip(figure.axes, (*path.names, *(name for name, _ in combinations)), strict=True):
        assert axis.get_ylabel() == name
        assert list(axis.lines[-1].get_xdata()) == [float(event.t) for event in path.events]


def test_shades_tell_combinations_of_modes_apart_and_depend_on_the_name_alone():
    phases = ("slip_same", "slip_opposite", "stick")
    names = [*phases, *(f"{a}+{b}" for a in phases for b in phases)]
    assert len({shade(name) for name in names[3:]}) == 9
    assert shade("slip_same+slip_same") == shade("slip_same") == (1, 1, 1)


@pytest.mark.few(2)
def test_a_frame_has_the_states_by_name_and_passes_through_the_events(path):
    frame = path.frame()
    assert list(frame.columns) == ["t", *path.names, *(name for name, _ in path.scene.combinations), "mode"]
    assert {float(event.t) for event in path.events} <= set(frame["t"])
    assert list(frame.iloc[-1][list(path.names)]) == [float(w) for w in path.final]
    assert set(frame["mode"]) == set(path.modes)


def test_a_file_holds_what_the_frame_holds(tmp_path):
    import pandas as pd

    path = ap.solve(SPRING)
    read = pd.read_csv(path.to_csv(tmp_path / "block.csv"), dtype=str)  # text, as some of its parsers round
    assert read.drop(columns="mode").astype(float).equals(path.frame().drop(columns="mode"))


def test_without_pandas_the_error_gives_the_pip_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingPackage, match=r"pip install 'asympk\[frame\]'"):
        ap.solve(ROD).frame()


@pytest.mark.parametrize("samples", [0, -1, 2.5, "many", True, 10**12])
def test_a_number_of_samples_that_is_none_is_refused(samples):
    with pytest.raises(InputError, match="samples"):
        ap.solve(ROD).frame(samples)


def test_a_physical_scene_is_told_the_same_in_python_as_in_a_file():
    scene, file = ap.Scene.physical(**CHALK, f0="1.8", name="chalk"), ap.read_scene("chalk")
    assert scene == file
    assert scene.rod.quantities == file.rod.quantities
    scaled = ap.solve(scene)
    path = scaled.physical()
    assert path.names == ("R_1", "dR_1", "u")
    assert "nondimensional    path.physical() has the units" in repr(scaled)
    assert "nondimensional" not in repr(path)
    assert float(path.scene.until) == pytest.approx(0.05, rel=1e-15)
    assert np.allclose(path(0.05), path.final, rtol=1e-12)
    assert pickle.loads(pickle.dumps(path)) == path


def test_no_number_is_shown_as_minus_0():
    path = ap.solve(ap.Scene(system=BLOCK, start={"x": -0.0, "v": -0.0}, until=1))
    many = ap.solve_many(system=BLOCK, values={}, start={"x": np.array([-0.0, 0.5]), "v": -0.0}, until=0)
    for text in (number_as_text(-0.0), path_as_text(path, None), repr(path), repr(many)):
        assert not re.search(r"-0(?![.\d])", text)


def test_a_plot_may_be_named_in_capitals(tmp_path):
    ap.solve(ROD).plot(tmp_path / "MOTION.PNG")
    assert (tmp_path / "MOTION.PNG").read_bytes().startswith(b"\x89PNG")


def test_axes_of_a_physical_path_have_units():
    figure = ap.solve(ap.Scene.physical(**CHALK)).physical().plot()
    assert [axis.get_ylabel() for axis in figure.axes] == ["R_1 (N)", "dR_1 (N/s)", "u (m/s)", "R (N)"]
    assert figure.axes[-1].get_xlabel() == "t (s)"


def test_labels_name_the_units_of_the_scene_also_after_another_number(tmp_path):
    file = _written(tmp_path / "mm.toml", 'units = ["t", "N", "mm", "s"]')
    read = turned(ap.read_scene(file), {"m": "1/2"}, {}, None)
    told = {"m": "0.5 t", "l": "0.08 mm", "h": "0.05 s/mm", "u": "-0.02 mm/s"}
    assert told.items() <= dict(read.rod.rows).items()
    assert ap.solve(read).physical().plot().axes[2].get_ylabel() == "u (mm/s)"
    knobs = knobs_of(read)
    assert knobs["units"]["u"] == "mm/s"
    assert knobs["parameters"][0]["unit"] == "t"


@pytest.mark.parametrize("wrong", ['"SI"', '["kg"]', '["kg", "N", "m", 1]', '["kg", "N", "m", ""]'])
def test_units_are_four_words(tmp_path, wrong):
    with pytest.raises(InputError, match="name those of mass, force, length and time"):
        ap.read_scene(_written(tmp_path / "wrong.toml", f"units = {wrong}"))


@pytest.mark.parametrize(("given", "said"), [
    ("kg N mm s", "1 kg mm/s^2 is 0.001 N"), ("t kN m ms", "1 t m/ms^2 is 1e+06 kN"), ("g N cm s", "is 1e-05 N"),
])
def test_units_whose_force_is_not_mass_times_acceleration_are_refused_in_scenes_and_sweeps(tmp_path, given, said):
    file = _written(tmp_path / "wrong.toml", f"units = {given.split()}")
    for read in (ap.read_scene, read_sweep):
        with pytest.raises(InputError, match=re.escape(said)):
            read(file)


@pytest.mark.parametrize("words", ["t N mm s", "t kN m s", "g N km s", "kg kN mm ms", "g MN mm us", "slug lbf ft s"])
def test_units_are_taken_where_they_are_consistent_or_unknown(tmp_path, words):
    assert ap.read_scene(_written(tmp_path / "some.toml", f"units = {words.split()}")).rod.words == (*words.split(),)


def _written(file, line):
    file.write_text(shipped("chalk") + f"\n{line}\n", encoding="utf-8")
    return file


def test_the_scene_of_a_physical_path_shows_its_start_and_horizon_with_their_units():
    scene = ap.Scene.physical(**CHALK)
    assert "  alpha  70 deg\n" in repr(scene.rod)
    shown = repr(ap.solve(scene).physical().scene).splitlines()
    assert shown[1:] == ["  start  R_1 = 0 N, dR_1 = 0 N/s, u = -0.02 m/s", "  until  0.05 s"]


def test_a_physical_scene_with_another_number_is_no_longer_physical():
    from dataclasses import replace

    scene = ap.Scene.physical(**CHALK)
    assert replace(scene, name="other").rod
    assert replace(scene, until=3).rod is None
    with pytest.raises(InputError, match="no physical quantities"):
        ap.solve(replace(scene, until=3)).physical()


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"m": 0}, "m = 0"), ({"alpha": "95 deg"}, "between 0 and 90"), ({"start": 1}, "three numbers"),
     ({"start": (1, 2)}, "three numbers"), ({"until": -1}, "until = -1"), ({"k": "stiff"}, "k = 'stiff'")],
)
def test_what_is_no_physical_scene_is_refused_by_name(wrong, said):
    with pytest.raises(InputError, match=said):
        ap.Scene.physical(**{**CHALK, **wrong})


def test_samples_end_where_a_run_stopped():
    short = _path(WAYS.index((ROD, {"method": "sign"})))
    assert trace(short)[-1][0] == short.info["reached"] < 2


ROD_SYSTEM = ap.systems.painleve_klein.system()
NOUNS = 24  # a case for each of those that ``_nouns`` makes
VAN_DER_POL = ap.System.smooth(slow={x: v}, fast={v: (1 - x**2) * v - x}, small=sp.Symbol("mu", positive=True))


def test_conditions_are_written_as_sentences():
    s, c, k = sp.symbols("s c k", real=True)
    enzyme = ap.System.smooth(slow={s: -s + s * c}, fast={c: s - (s + k) * c}, small=sp.Symbol("mu", positive=True))
    (branch,) = ap.slow_manifolds(enzyme, order=0)
    assert repr(branch).splitlines()[2:] == [
        "  where       everywhere",
        "  exists for  k + s != 0",
        "  stability   stable where k + s > 0, unstable where k + s < 0",
    ]
    x_or_y = sp.Or(sp.Eq(x, 1), sp.And(x < 0, sp.Ne(v, 0)), evaluate=False)
    assert formula_in_words(x_or_y) == "x = 1 or (x < 0 and v != 0)"
    assert formula_in_words(sp.Not(x_or_y, evaluate=False)) == "not (x = 1 or (x < 0 and v != 0))"
    assert formula_in_words(sp.Piecewise((x**2, x > 0), (v, True))) == "Piecewise((x**2, x > 0), (v, True))"
    assert formula_in_words(k * sp.Piecewise((x, x > 0), (v, True))) == "k*Piecewise((x, x > 0), (v, True))"


def _two_frictions():
    u, w, G, k = *sp.symbols("u w G", real=True), sp.Symbol("k", positive=True)
    belt, pair = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=k), ap.Friction(w - v, G, load=1, kinetic=k)
    rates = {x: v, u: w, v: -x + F - G, w: -u + G}
    return ap.System.with_frictions(slow=rates, fast={}, frictions=(belt, pair))


def _nouns():
    yield from (ROD_SYSTEM, BLOCK, VAN_DER_POL, ROD_SYSTEM.mode("stick"), ROD_SYSTEM.friction)
    yield from ap.slow_manifolds(ROD_SYSTEM, order=2)
    yield ap.stick_regions(ROD_SYSTEM)
    yield ap.stick_regions(ROD_SYSTEM).stick
    yield from (ap.eigenvalues(ROD_SYSTEM)[0], ap.eigenvalues(VAN_DER_POL, on={v: x / (1 - x**2)})[0])
    yield ap.systems.painleve_klein.mechanism().jump_law()
    yield from (ap.slow_manifolds(ROD_SYSTEM), ap.eigenvalues(ROD_SYSTEM))
    shoe = ap.systems.brake_shoe
    yield from (shoe.mechanism(), shoe.mechanism().contact, shoe.system(), shoe.mechanism().jump_law())
    yield from (ap.lower([x, v], x + v), ap.lower([x, v], {"a": x, "b": v}), _two_frictions())
    yield ap.lower(sp.symbols("w:5"), [sp.sympify(f"sin(w{k % 5})**{k}") for k in range(400)])
    yield from (ap.jump_map(ROD_SYSTEM, order=1), ap.jump_map(ROD_SYSTEM, order=1).x)


@pytest.fixture(scope="module")
def nouns():
    return [*_nouns()]


@pytest.mark.slow
def test_every_noun_of_formulas_is_tried(nouns):
    assert len(nouns) == NOUNS


@pytest.mark.parametrize("k", range(NOUNS))
@pytest.mark.few(3)
def test_a_noun_of_formulas_tells_itself_briefly_and_as_latex(nouns, k):
    noun = nouns[k]
    assert len(repr(noun)) < 1200
    latex = noun._repr_latex_()
    assert latex[0] == latex[-1] == "$"
    assert sp.latex(noun)
    assert latex.count("{") == latex.count("}")
    assert pickle.loads(pickle.dumps(noun)) == noun


@pytest.mark.skipif(not which("pdflatex"), reason="TeX is not installed")
def test_the_nouns_of_formulas_are_set_by_latex_with_amsmath_alone_and_in_its_text_font(nouns, tmp_path):
    shown = [noun._repr_latex_() for noun in nouns]
    assert not [text for latex in shown for text in re.findall(r"\\text{([^}]*)}", latex) if {*text} & {*"<>|"}]
    page = r"\documentclass{article}\usepackage{amsmath}\begin{document}" + "\n\n".join(shown) + r"\end{document}"
    (tmp_path / "page.tex").write_text(page)
    run = subprocess.run(["pdflatex", "-interaction=nonstopmode", "page"], capture_output=True, cwd=tmp_path)
    assert re.findall(rb"^! .*", run.stdout, re.MULTILINE) == []


def test_a_formula_of_metres_is_cut_in_a_notebook_and_a_formula_of_a_page_is_not():
    few, many = (sp.Add(*sp.symbols(f"a:{count}")) for count in (100, 1000))
    assert as_latex(Card("sum", (("of", few),))).count("a_{") == 100
    assert len(as_latex(Card("sum", (("of", many),)))) < 300
    assert len(as_html(Card("sum", (("of", many),)))) < 500


def test_a_formula_in_a_table_is_no_markup():
    shown = as_html(Card("", (("bound", sp.Symbol("<b>") < 1),)))
    assert "$\\displaystyle &lt;b&gt; &lt; 1$" in shown


@pytest.mark.parametrize(("value", "told"), [
    (Fraction(1, 5), "0.2"), (Fraction(1, 10**7), "1e-7"), (10**9, "1000000000"), (0, "0"), (-50000, "-50000"),
    (Fraction(1, 3), "1/3"), (Fraction(10**400, 3), "3.333333333e+399"), (0.1, "0.1"),
])
def test_a_number_is_told_as_the_decimal_that_it_is_whatever_its_size(value, told):
    assert number_as_text(value) == told


def test_words_with_an_underscore_are_set_by_latex_and_mathjax_alike():
    manifold = ap.slow_manifolds(ROD_SYSTEM)[0]
    assert r"\text{SlowManifold Pi1 of mode slip}\_\text{same}" in sp.latex(manifold)


def test_latex_of_a_series_has_its_terms_and_its_remainder():
    from asympk.asymptotics.series import O, series

    told = sp.latex(series({(0, 0): x, (1, 1): -1, (1, 0): x + 1, (2, 0): sp.Rational(1, 2)}) + O(2, 1))
    assert told == r"x -\mu \log\frac{1}{\mu} + \left(x + 1\right) \mu + O\left(\mu^{2} \log\frac{1}{\mu}\right)"


def test_a_certificate_shows_a_side_of_its_box_as_it_was_given():
    box = repr(certify(ROD, {"x": (0, 1e-6), "y": ("1/5", "0.2000001"), "z": (-1, -0.999)}))
    assert [" ".join(line.split()) for line in box.splitlines() if " .. " in line] == [
        "x 0 .. 1e-06", "y 1/5 .. 2000001/10000000", "z -1 .. -0.999"]


def test_the_ladder_the_claims_and_the_certificates_are_tables():
    from asympk.certify import certify
    from asympk.ledger.verdicts import Check, Claim, Claims

    claim = Claim("C0", "1", "It holds <always>.", "confirmed", (Check("as written", "symbolic", "it does", True),))
    for noun in (ap.least_model(ROD), claim, Claims([claim] * 30), certify(ROD)):
        assert len(repr(noun)) < 1200
        assert noun._repr_html_().startswith("<table>")
    assert "&lt;always&gt;" in claim._repr_html_()
    assert pickle.loads(pickle.dumps(Claims([claim]))) == (claim,)


def test_itineraries_of_an_array_are_those_of_its_scenes_one_by_one():
    starts = np.linspace(-1, 1, 7)
    many = ap.solve_many(1, 1e-2, 0, starts, -1, [[0.001], [2]])
    found = many.itineraries()
    assert found.index.shape == (2, 7)
    assert sum(found.counts) == 14
    for (i, j), index in np.ndenumerate(found.index):
        path = ap.solve(ap.Scene(1, 1e-2, (0, starts[j], -1), [0.001, 2][i]))
        told = [event.kind for event in path.events] + ["stick"] * (path.modes[-1] == "stick")
        assert list(found.sequences[index]) == told


@pytest.mark.parametrize("shape", [(), (5,), (3, 4), (2, 3, 2), (0,)])
@pytest.mark.few(1)
def test_arrays_of_any_shape_tell_and_draw_themselves(shape, tmp_path):
    many = ap.solve_many(1, 1e-2, 0, np.full(shape, 0.2), -1, 1)
    assert len(repr(many)) < 1200
    many.plot(tmp_path / "many.svg")
    assert (tmp_path / "many.svg").stat().st_size > 3000


def test_one_trajectory_is_told_as_one_and_numbers_of_trajectories_and_events_are_whole():
    many = ap.solve_many(1, 1e-2, 0, 0.2, -1, 1)
    assert repr(many).startswith("1 trajectory\n")
    counted = many.plot().axes[-1]
    ticks = [*counted.get_xticks(), *counted.get_yticks()]
    assert ticks == [round(tick) for tick in ticks]


def test_a_path_that_is_only_a_point_is_drawn_as_a_dot():
    panels = ap.solve(ap.Scene(sigma=1, mu=1e-2, start=(0, 0.2, -1), until=0)).plot().axes
    dots = [line.get_xydata().tolist() for panel in panels for line in panel.lines if line.get_marker() == "o"]
    assert dots == [[[0.0, value]] for value in (0, 0.2, -1, 0.2)]


def test_the_panels_of_many_paths_are_over_the_one_argument_that_varies():
    rates = np.linspace(-1, 1, 5)
    counted = ap.solve_many(1, 1e-2, 0, rates, -1, 2).plot().axes[-1]
    assert counted.get_xlabel() == "y"
    assert counted.lines[0].get_xdata() == pytest.approx(rates)


def test_a_map_of_itineraries_names_the_arguments_that_vary():
    many = ap.solve_many(np.linspace(0.5, 2, 4)[:, None], 1e-2, 0, np.linspace(-1, 1, 5), -1, 2)
    (axis,) = many.plot().axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("y", "sigma")


def test_a_map_of_itineraries_shows_every_trajectory_at_its_arguments_in_whatever_order():
    mus, rates = np.array([1e-2, 1e-6, 1e-4]), np.array([-1, -3, 1, 0, 2])
    drawing = ap.solve_many(1, mus[:, None], 0, rates, -1, 2).plot()
    (axis,), (legend,) = drawing.axes, drawing.legends
    (mesh,) = axis.collections
    assert (axis.get_xscale(), axis.get_yscale()) == ("linear", "log")
    assert mesh.get_coordinates()[0, :, 0].tolist() == pytest.approx([-4, -2, -0.5, 0.5, 1.5, 2.5])
    assert mesh.get_coordinates()[:, 0, 1].tolist() == pytest.approx([1e-7, 1e-5, 1e-3, 1e-1])
    words = [text.get_text() for text in legend.get_texts()]
    assert [words[k] for k in mesh.get_array()[0]] == [
        *["force_zero → velocity_zero → slip_onset"] * 2, *["velocity_zero → slip_onset"] * 3]


def test_long_itineraries_that_differ_have_different_names_in_a_map():
    """A block on a spring stops 2 to 15 times; the names of all its colours were cut to the same three events."""
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v, F, 1, sp.Symbol("k"))])
    starts = {"x": np.linspace(1, 5, 6)[:, None], "v": 0}
    drawing = ap.solve_many(system=system, values={"k": [0.1, 0.2]}, start=starts, until=50).plot()
    words = [text.get_text() for text in drawing.legends[0].get_texts()]
    assert len(words) == len({*words}) > 5
    assert "6 x velocity_zero" in words


@pytest.mark.parametrize(("rates", "name"), [((1, 5), "y"), ((5, 1), "y"), ((1, 1), "trajectory")])
def test_a_row_of_trajectories_is_drawn_over_its_argument_and_not_as_a_map_without_width(rates, name):
    rates = np.linspace(-1, 1, max(rates)).reshape(rates)
    last = ap.solve_many(np.ones((1, 1)), 1e-2, 0, rates, -1, 2).plot().axes[-1]
    assert (last.get_xlabel(), len(last.lines[0].get_xdata())) == (name, rates.size)


def test_trajectories_that_are_not_followed_are_not_drawn_as_those_without_events():
    rates, starts = np.array([0.2, 8e307]), np.array([1, 2])
    drawing = ap.solve_many(1, 10, 0, rates, starts[:, None], 5).plot()
    (mesh,) = drawing.axes[0].collections
    words = [text.get_text() for text in drawing.legends[0].get_texts()]
    assert [[words[k] for k in row] for row in mesh.get_array()] == [
        [itinerary, "not followed: beyond the range of doubles"]
        for itinerary in ("velocity_zero → slip_onset", "no event")]
    drawing = ap.solve_many(1, 10, 0, rates, 1, 5).plot()
    assert [len(line.get_xdata()) for axis in drawing.axes for line in axis.lines] == [1] * 4
    assert drawing.get_suptitle() == "1 of 2 not followed"


@pytest.mark.parametrize(
    ("what", "options", "labels"),
    [(SPRING, {}, ("x", "v")), (SPRING, {"x": v, "y": x}, ("v", "x")), (ROD, {}, ("s", "z")),
     (ROD, {"x": "x", "y": "y"}, ("x", "y")),
     (VAN_DER_POL, {"values": {"mu": "0.1"}}, ("x", "v")),
     (ap.solve(ap.read_scene("chalk")).physical(), {}, ("R (N)", "u (m/s)"))],
)
@pytest.mark.few(2)
def test_a_phase_picture_is_over_the_states_that_are_chosen(what, options, labels, tmp_path):
    (axis,) = ap.phase(what, **options, file=tmp_path / "phase.svg").axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == labels
    assert (tmp_path / "phase.svg").stat().st_size > 3000


@pytest.mark.parametrize(
    ("what", "options", "said"),
    [(3, {}, "not int"), (SPRING, {"x": "q"}, "'q' is no state"), (SPRING, {"y": np.zeros(2)}, "is no state"),
     (SPRING, {"y": "x"}, "x and y are both x; choose two of x, v"),
     (SPRING, {"window": 3}, "window = 3"),
     (SPRING, {"window": ((1, 0), (0, 1))}, "lower ends"), (VAN_DER_POL, {}, "mu is missing"),
     (ROD_SYSTEM, {"values": {"mu": 1, "sigma": 1, "sigma0": 1}}, "3 states"), (SPRING, {"file": "a.gif"}, "one of")],
)
def test_what_is_no_phase_picture_is_refused_by_name(what, options, said):
    with pytest.raises(ap.AsympkError, match=said):
        ap.phase(what, **options)


def test_a_phase_picture_of_forces_in_time_names_the_time_of_its_field():
    t = sp.Symbol("tau", real=True)
    driven = ap.System.smooth({x: v, v: sp.cos(t) - x}, {}, None, time=t)
    (axis,) = ap.phase(driven).axes
    assert axis.get_title() == "the field at tau = 0"
    assert ap.phase(SPRING).axes[0].get_title() == ""


@pytest.mark.parametrize(("load", "streamed"), [(1, True), (1 + F / 4, False)])
def test_a_phase_picture_has_no_field_of_a_load_that_contains_its_own_force(load, streamed):
    guide = ap.Friction(velocity=v, force=F, load=load, kinetic=sp.Rational(1, 2))
    block = ap.System.with_frictions({x: v, v: -x + F}, {}, [guide])
    (axis,) = ap.phase(ap.Scene(system=block, start={x: 3, v: 0}, until=5)).axes
    assert any(isinstance(part, LineCollection) for part in axis.collections) == streamed


def test_a_rate_is_set_as_its_greek_letter_with_a_prime():
    rod = ap.systems.painleve_rod.system()
    for shown in (rod._repr_latex_(), ap.stick_regions(rod).stick.latex()):
        assert r"\theta'" in shown
        assert re.search(r"[^\\{]theta'", shown) is None


def test_one_interval_is_told_as_one():
    rod = ap.systems.painleve_rod.mechanism()
    found = (rod.paradox_set({"theta": ends}, {"f": 2, "m": 1}) for ends in ((0, 1.5), (0, 3), (0, 0.1)))
    told = [repr(one).splitlines()[0] for one in found]
    assert told == [f"Paradox over theta: {words}" for words in ("1 interval", "2 intervals", "0 intervals")]


def test_an_exact_number_of_thousands_of_digits_is_shown_with_ten():
    system = ap.System.smooth({x: -(sp.Integer(10) ** 5000) * x + sp.Rational(10**200 + 1, 3 * 10**200)}, {}, None)
    assert "x'  0.3333333333 - 1.0e+5000*x" in repr(system)
    assert r"10^{5000} x" in system._repr_latex_()


def test_the_text_of_a_ball_encloses_it_in_hardly_more():
    arb = pytest.importorskip("flint").arb
    rng = np.random.default_rng(1)
    shares = zip(rng.normal(size=300) * 10 ** rng.uniform(-9, 9, 300), 10 ** rng.uniform(-16, -0.1, 300), strict=True)
    for middle, share in shares:
        ball = arb(float(middle), float(abs(middle) * share))
        read = arb(ball_as_text(ball, 25))
        assert read.contains(ball)
        assert read.rad() < 1.25 * ball.rad()
    assert ball_as_text(arb(-2.573, 0.07), 17) == "[-2.573 +/- 0.0701]"
    assert [ball_as_text(arb(n), 17) for n in (0, 0.5)] == ["0", "0.50000000000000000"]
    assert ball_as_text(arb(1e-20, 0.01), 17) == "[+/- 0.0101]"
