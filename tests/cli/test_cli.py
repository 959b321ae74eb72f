"""The command line: what it prints, and one line with status 2 for anything wrong."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import sympy as sp
from blocks import sliding_blocks, spring_block
from commandline import run

import asympk
from asympk import cli
from asympk.output import terminal
from asympk.systems import held_rod

GOOD = ["solve", "--sigma", "1", "--mu", "1e-6", "--start", "0", "0.2", "-1", "--until", "5"]


def test_every_file_of_the_command_line_is_a_command_or_one_of_the_shared_ones():
    files = {path.stem for path in Path(cli.__file__).parent.glob("*.py")}
    assert files == {*cli.COMMANDS, "__init__", "main", "options", "everything"}


def test_solve_prints_the_path_as_a_table(capsys):
    status, out, err = run(capsys, *GOOD)
    assert status == 0
    assert "asympk:" not in err
    assert "velocity_zero -> stick" in out
    assert out.splitlines()[-1].endswith("until (exact)")


def test_solve_prints_json_with_the_fixed_keys(capsys):
    _, out, _ = run(capsys, *GOOD, "--json")
    told = json.loads(out)
    assert told["modes"] == ["slip_opposite", "stick", "slip_same"]
    assert {"names", "final", "events", "modes", "model"} <= set(told)
    assert told["names"] == ["x", "y", "z"]
    assert set(told["events"][0]) == {"kind", "t", "state"}
    assert told["final"][2] == pytest.approx(1, abs=1e-5)


def test_json_of_a_path_in_physical_quantities_has_the_same_events(capsys):
    plain, told = (json.loads(run(capsys, "solve", "chalk", "--json", *units)[1]) for units in ((), ("--physical",)))
    assert told["names"] == ["R_1", "dR_1", "u"]
    assert told["final"] == list(asympk.solve(asympk.read_scene("chalk")).physical().final)
    assert [event["kind"] for event in told["events"]] == [event["kind"] for event in plain["events"]]


def test_events_of_several_frictions_name_theirs_in_json(capsys, tmp_path):
    (tmp_path / "two.toml").write_text(f"until = 3\n{sliding_blocks(2)}[start]\nv0 = 2\nv1 = 1\n")
    events = json.loads(run(capsys, "solve", str(tmp_path / "two.toml"), "--json")[1])["events"]
    assert [(event["kind"], event["t"], event["friction"]) for event in events] == [
        ("velocity_zero", 1, 1), ("velocity_zero", 2, 0),
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("backward --set sigma=2", ["backward: sigma = 2, mu = 0.000001, sigma0 = 2"]),
        ("held_rod --set f=3", [", f = 3,", "sliding velocity z, load h*y + x"]),
        ("chalk", ["alpha = 70 deg, l = 0.08 m", "t, x, y and z are nondimensional; asympk solve --physical"]),
        ("chalk --physical", ["alpha = 70 deg, l = 0.08 m"]),
    ],
)
def test_above_a_path_are_the_numbers_of_its_scene_and_what_its_states_are(capsys, words, said):
    above, heading, _ = run(capsys, "solve", *words.split())[1].partition("event -> mode")
    assert heading
    assert all(part in above for part in said)
    assert ("nondimensional" in above) == (words == "chalk")


def test_a_number_of_the_start_is_a_number_where_a_file_has_its_name_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "1").touch()
    assert run(capsys, "solve", "--sigma", "1", "--mu", "1e-3", "--until", "5", "--start", "0", "0.2", "1")[0] == 0


@pytest.mark.parametrize("words", ["arm --start {}", "--start {} arm"])
@pytest.mark.few(0)
def test_start_takes_a_number_for_each_state_before_or_after_the_scene(capsys, words):
    names, told = ("a", "b", "x", "a'", "b'", "y", "z"), ("1", "0.9", "0.1", "0", "0", "0", "0")
    given = run(capsys, "solve", *words.format(" ".join(told)).split(), "--until", "1e-3", "--json")[1]
    set_each = [f"--set={name}={value}" for name, value in zip(names, told, strict=True)]
    assert given == run(capsys, "solve", "arm", *set_each, "--until", "1e-3", "--json")[1] != ""


def test_a_number_above_a_path_has_the_name_by_which_set_and_until_change_it(capsys):
    first = run(capsys, "solve", "chalk")[1].splitlines()[0]
    start = ("R_1", "dR_1", "u")
    assert [name for name in (*start, "until") if f"{name} = " not in first] == []
    given = [word for name in start for word in ("--set", f"{name}=1/8")]
    changed = run(capsys, "solve", "chalk", *given, "--until", "1/8")[1].splitlines()[0]
    assert changed.endswith("R_1 = 0.125 N, dR_1 = 0.125 N/s, u = 0.125 m/s, until = 0.125 s")


@pytest.mark.parametrize("command", ["least", "certify"])
def test_a_ladder_and_a_certificate_begin_with_the_numbers_of_their_scene(capsys, command):
    if command == "certify":
        pytest.importorskip("flint")
    first, second = (run(capsys, command, "backward", *more)[1].splitlines()[0] for more in ((), ("--set", "mu=1e-5")))
    assert first == "backward: sigma = 1, mu = 0.000001, sigma0 = 1"
    assert second == "backward: sigma = 1, mu = 0.00001, sigma0 = 1"
    assert "t, x, y and z are nondimensional" in run(capsys, command, "chalk")[1].splitlines()[1]


def test_a_plot_that_cannot_be_written_is_refused_before_the_scene_is_followed(capsys, tmp_path):
    status, out, err = run(capsys, *GOOD, "--csv", str(tmp_path / "a.csv"), "--plot", str(tmp_path / "a.gif"))
    assert (status, out, list(tmp_path.iterdir())) == (2, "", [])
    assert err.endswith("a plot is written as one of .pdf, .svg, .png\n")


def test_solve_with_digits_prints_strings_of_that_many_digits(capsys):
    _, out, _ = run(capsys, *GOOD, "--digits", "40", "--json")
    final = json.loads(out)["final"]
    assert all(isinstance(value, str) for value in final)
    assert len(final[0].lstrip("-0.")) == pytest.approx(40, abs=2)


def test_solve_with_digits_prints_the_final_state_in_full(capsys):
    _, out, _ = run(capsys, *GOOD, "--digits", "40")
    full = json.loads(run(capsys, *GOOD, "--digits", "40", "--json")[1])["final"]
    assert out.splitlines()[-3:] == [f"{axis} = {value}" for axis, value in zip("xyz", full, strict=True)]


def test_what_is_beyond_the_doubles_is_printed_as_what_it_is(capsys):
    _, out, _ = run(capsys, *_with("--mu", "1e-400"), "--digits", "20")
    assert "e+399 " in out
    assert "inf" not in out


def test_the_system_of_a_file_is_exported_and_without_a_file_the_rod(capsys, tmp_path):
    (tmp_path / "own.toml").write_text(
        f"until = 1\nstart = {{ x = 1, v = 0 }}\n{spring_block('1/(2 + abs(v))')}"
    )
    slides = {}
    for given in ([], [str(tmp_path / "own.toml")]):
        assert run(capsys, "export", *given, "--target", "python", "--out", str(tmp_path))[0] == 0
        space = {}
        exec((tmp_path / "model.py").read_text(), space)
        slides[len(given)] = space["slip_opposite"]
    assert slides[1](3, -2) == (-2, -3 + 1 / 4)
    assert len(slides[0](0, 1, 2, 0.5, 1)) == 3


@pytest.mark.parametrize(
    ("option", "method"), [("--rtol=1e-3", "exact"), ("--digits=30", "lsoda"), ("--order=1", "sign")]
)
def test_an_option_that_the_method_does_not_have_is_refused_with_those_it_has(capsys, option, method):
    status, _, err = run(capsys, *GOOD, "--method", method, option)
    assert status == 2
    assert err.startswith(f"asympk: method '{method}' has no option '{option[2:].partition('=')[0]}'; it has ")


@pytest.mark.parametrize(
    ("option", "said"), [("--steps=3", "step limit"), ("--seconds=0", "time limit"), ("--events=0", "limit of 0")]
)
def test_every_bound_that_a_run_is_told_to_raise_is_an_option_of_the_command_line(capsys, option, said):
    status, _, err = run(capsys, *GOOD, "--method", "lsoda", option)
    assert status == 2
    assert said in err
    assert f"allow more {option[2:].partition('=')[0]}" in err


def test_tolerances_and_orders_reach_the_method(capsys):
    finals = [
        json.loads(run(capsys, *GOOD, "--json", "--method", method, *option)[1])["final"][0]
        for method, option in (("lsoda", ["--rtol", "1e-3"]), ("lsoda", ["--rtol", "1e-9"]),
                               ("jump", ["--order", "0"]), ("jump", ["--order", "2"]), ("exact", []))
    ]
    loose, tight, zeroth, second = (abs(final - finals[-1]) for final in finals[:-1])
    assert tight < loose
    assert second < zeroth


def test_a_scene_in_numbers_is_certified(capsys):
    status, out, _ = run(capsys, "certify", *GOOD[1:])
    assert status == 0
    assert "x = [0.20539040887" in out


@pytest.mark.parametrize("scene", ["backward", "held_rod"])
@pytest.mark.few(1)
def test_a_rung_that_does_not_apply_names_a_method_as_python_and_the_command_line_spell_it(capsys, scene):
    out = " ".join(run(capsys, "least", scene)[1].split())
    assert "use method 'jump'" in out
    assert "method=" not in out


def test_a_ball_without_a_certain_digit_is_not_told_as_zero(capsys):
    pytest.importorskip("flint")
    scene = ["--sigma", "2.478", "--mu", "0.0125", "--start", "0", "0", "-0.4167", "--until", "6.67"]
    lines = run(capsys, "certify", *scene, "--box", "mu", "0.012", "0.013", "--pieces", "1")[1].splitlines()
    leaves = next(line for line in lines if line.endswith("slip_onset -> slip_same")).split("  ")[0]
    t = json.loads(run(capsys, "solve", *scene, "--json")[1])["events"][1]["t"]
    assert leaves.startswith("[+/- ")
    assert float(leaves.strip("[]+/- ")) > t > 0.05


def test_negative_numbers_of_every_form_are_values(capsys):
    arguments = [*GOOD[:5], "--start", "-1/2", "-1e-3", "-.5", "--until", "1"]
    assert run(capsys, *arguments)[0] == 0


@pytest.mark.parametrize("words", ["scenes", "claims C11 C23", "mechanism painleve_rod", "solve painleve_rod"])
@pytest.mark.few(1)
def test_no_line_is_longer_than_the_terminal_is_wide_and_no_word_is_lost(capsys, monkeypatch, words):
    texts = {}
    for width in (80, 500):
        monkeypatch.setattr(terminal, "columns", lambda width=width: width)
        texts[width] = run(capsys, *words.split())[1]
    assert max(map(len, texts[80].splitlines())) <= 80 < max(map(len, texts[500].splitlines()))
    narrow, wide = ({*re.findall(r"\w+", texts[width])} for width in (80, 500))
    assert wide - narrow <= {"event", "mode"}  # the heading of a table


def test_an_option_that_takes_a_function_is_told_as_one_of_python(capsys):
    assert run(capsys, *GOOD, "--steps", "5")[2].endswith("it has digits, progress (in Python)\n")


def test_a_bound_on_steps_is_refused_with_digits_which_have_none(capsys):
    status, out, err = run(capsys, "solve", "painleve_rod", "--digits", "20", "--steps", "5")
    assert (status, out, err.startswith("asympk: steps = 5: with digits ")) == (2, "", True)


def test_a_claim_that_is_named_twice_is_printed_once(capsys):
    assert run(capsys, "claims", "C11", "c11")[1] == run(capsys, "claims", "C11")[1]


def test_claims_prints_a_line_each_and_the_evidence_of_one(capsys):
    status, out, _ = run(capsys, "claims", "C16", "C23")
    assert status == 0
    assert "C16 (section 3): refined" in out
    assert "instead, numeric, holds" in out


# the chart

TINY = {"scenes": ("ii",), "mus": ("1e-1",), "kappas": {"1": ("1e-1",)}, "tolerances": (1e-3,), "step_sizes": (1e-1,),
        "offsets": ("1e-2",), "model_mus": ("1e-2",), "model_tolerances": (1e-4, 1e-8), "contact_mus": ("1e-1",),
        "repeats": 1, "steps": 400, "seconds": 5.0}


@pytest.fixture
def tiny(tmp_path, monkeypatch):
    """A checkout with the kept references alone, a plan of a few runs, and peers that all seem to be installed."""
    from asympk.studies import chart

    kept = tmp_path / "paper" / "generated" / "rows"
    kept.mkdir(parents=True)
    (tmp_path / "derivations").mkdir()
    for file in (Path(__file__).parents[2] / "paper" / "generated" / "rows").glob("nonlinear-reference.*"):
        shutil.copy(file, kept)
    monkeypatch.setattr(chart, "QUICK", TINY)
    monkeypatch.setattr(chart, "FULL", TINY)
    monkeypatch.setattr(chart, "EXPLICIT", ("rk45",))
    monkeypatch.setattr(chart, "IMPLICIT", ("lsoda",))
    monkeypatch.setattr(chart, "absent", dict)
    monkeypatch.setattr(chart.modelwork, "SYSTEMS", ("enzyme reaction",))
    return tmp_path


@pytest.mark.further
def test_the_full_chart_writes_the_rows_that_are_kept(tiny, capsys, monkeypatch):
    from asympk.output import paper

    monkeypatch.setattr(paper, "write_figures", lambda *_, **options: [])  # those of the quick chart are drawn
    status, out, _ = run(capsys, "chart", "--root", str(tiny))
    assert status == 0
    assert str(tiny / "paper" / "generated" / "rows" / "work.csv") in out.splitlines()
    assert not (tiny / "paper" / "generated" / "quick").exists()


@pytest.fixture
def without_rk45(tiny, monkeypatch):
    from asympk.studies import chart

    monkeypatch.setattr(chart, "absent", lambda: {"rk45": "some-package"})
    return tiny


@pytest.mark.slow
def test_the_full_chart_without_a_peer_is_refused_in_one_line(without_rk45, capsys):
    status, out, err = run(capsys, "chart", "--root", str(without_rk45))
    assert (status, out, err) == (2, "", "asympk: the full chart runs rk45 too: pip install 'some-package'\n")


@pytest.mark.further
def test_the_quick_chart_does_without_a_peer_prints_its_files_and_leaves_the_kept_rows_alone(without_rk45, capsys):
    from asympk.storage.rows import read_rows

    pytest.importorskip("matplotlib")
    kept = without_rk45 / "paper" / "generated"
    before = {path: path.read_bytes() for path in (kept / "rows").iterdir()}
    status, out, err = run(capsys, "chart", "--quick", "--root", str(without_rk45))
    assert status == 0
    assert "asympk:" not in err
    files = [Path(line) for line in out.splitlines()]
    wanted = {"work.csv", "plane.csv", "nonlinear.csv", "models.csv", "methods.tex", "chart-models.pdf"}
    assert wanted <= {file.name for file in files}
    assert all(file.is_file() and (kept / "quick") in file.parents for file in files)
    assert {path: path.read_bytes() for path in kept.rglob("*.*") if kept / "quick" not in path.parents} == before
    assert "quick/" in (Path(__file__).parents[2] / ".gitignore").read_text()
    ran = {row["method"] for row in read_rows(kept / "quick" / "rows" / "work.csv")}
    assert "lsoda" in ran
    assert "rk45" not in ran


def _with(option, value):
    arguments = list(GOOD)
    arguments[arguments.index(option) + 1] = value
    return arguments


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (_with("--sigma", "-2"), "sigma"),
        (_with("--sigma", "steep"), "sigma"),
        (_with("--mu", "0"), "mu"),
        (_with("--mu", "nan"), "mu"),
        (_with("--until", "-1"), "until"),
        (_with("--until", "inf"), "until"),
        (_with("--start", "1e999999999"), "start"),
        ([*GOOD, "--sigma0", "0"], "sigma0"),
        ([*GOOD, "--method", "euler"], "euler"),
        ([*GOOD, "--digits", "0"], "digits"),
        ([*GOOD, "--digits", "many"], "digits"),
        (["solve", "--sigma", "1"], "required"),
        (["resolve"], "resolve"),
        (["claims", "C99"], "C99"),
        (["derive", "--root", "/nowhere"], "/nowhere has no derivations"),
        (["--root", "/nowhere", "derive"], "/nowhere has no derivations"),
        (["chart", "--quick", "--root", "/nowhere"], "derivations"),
        (["chart", "--slow"], "--slow"),
        (["export", "--target", "fortran", "--out", "x"], "fortran"),
    ],
)
def test_bad_input_is_one_line_on_stderr_and_status_two(capsys, arguments, named):
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert named in err
    assert "Traceback" not in err


def _completed(line, tmp_path):
    told = tmp_path / "told"
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_STDOUT_FILENAME": str(told), "COMP_LINE": line, "_ARGCOMPLETE_IFS": " ",
             "COMP_POINT": str(len(line)), "COMP_TYPE": "9", "_ARGCOMPLETE_SHELL": "bash"}
    run = subprocess.run([sys.executable, "-m", "asympk"], env={**os.environ, **asked}, capture_output=True)
    return run, told.read_text().split() if told.exists() else []


def test_the_shell_completes_commands_and_options(tmp_path):
    pytest.importorskip("argcomplete")
    assert _completed("asympk so", tmp_path)[1] == ["solve"]
    assert {"--method", "--digits"} <= {*_completed("asympk solve --", tmp_path)[1]}


def test_a_shell_that_asks_in_vain_starts_no_work(tmp_path):
    (tmp_path / "argcomplete.py").write_text("raise ImportError")
    line = {"_ARGCOMPLETE": "1", "PYTHONPATH": str(tmp_path)}
    run = subprocess.run([sys.executable, "-m", "asympk"], env={**os.environ, **line}, capture_output=True)
    assert (run.returncode, run.stdout, run.stderr) == (1, b"", b"")


def test_the_commands_that_need_a_checkout_are_those_that_take_its_root(capsys):
    _, _, err = run(capsys, "derive", "--root", "/nowhere")
    taking = {name for name in cli.COMMANDS if "--root" in run(capsys, name, "--help")[1]}
    assert {name for name in cli.COMMANDS if re.search(rf"\b{name}\b", err.partition("only")[2])} == taking


def test_version_is_that_of_the_package(capsys):
    assert run(capsys, "--version") == (0, f"asympk {asympk.__version__}\n", "")


CAM = """
coordinates = ["X", "Y", "theta"]
lagrangian = "(X'^2 + Y'^2 + theta'^2 + (X' + theta'*cos(theta)/2)^2 + (Y' - theta'*sin(theta)/2)^2)/2 - Y"
gap = "Y - 1 - sin(2*theta)/4"
slip = "X - theta + sin(theta)"
friction = "f"
unilateral = true
values = {f = 2}
state = {X = 0, Y = 1, theta = 0, "X'" = -1, "Y'" = 0, "theta'" = 0}
over = {theta = [0.05, 3]}
"""


@pytest.mark.further
def test_a_least_critical_friction_that_no_radicals_give_is_printed_in_decimals(capsys, tmp_path):
    (tmp_path / "cam.toml").write_text(CAM)
    status, out, _ = run(capsys, "mechanism", str(tmp_path / "cam.toml"))
    assert status == 0
    assert re.search(r"least +friction 0\.920379 where tan\(theta/2\) = -20\.8928\n", out)


@pytest.mark.parametrize("arguments", [["solve", "backward", "--method", "LSODA"], ["claims", "c16"],
                                       ["mechanism", "Butenin"]])
def test_names_are_read_in_any_case(capsys, arguments):
    status, _, complaint = run(capsys, *arguments)
    assert (status, complaint) == (0, "")


@pytest.mark.parametrize(("ask", "meant"), [
    (lambda: asympk.solve(asympk.read_scene("backward"), method="lsda"), "'lsoda'"),
    (lambda: asympk.solve_many(1, 1e-3, 0, 0.2, -1, 1, method="Exakt"), "'exact'"),
    (lambda: asympk.solve_many(system=held_rod.system(), method="exat"), "'exact'"),
    (lambda: asympk.lower(sp.symbols("x"), sp.Symbol("x"), target="Numpi"), "'numpy'"),
])
def test_a_name_that_is_none_is_refused_with_the_nearest(ask, meant):
    with pytest.raises(asympk.errors.UnknownName, match=f"did you mean {meant}"):
        ask()


@pytest.mark.further
def test_debug_shows_the_traceback():
    command = [sys.executable, "-m", "asympk", "--debug", "claims", "C99"]
    assert "Traceback" in subprocess.run(command, capture_output=True, text=True).stderr
