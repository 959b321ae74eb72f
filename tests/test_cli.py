"""The command line: what it prints, and one line with status 2 for anything wrong."""

import json
import subprocess
import sys

import pytest

from asympk.__main__ import main

GOOD = ["solve", "--sigma", "1", "--mu", "1e-6", "--start", "0", "0.2", "-1", "--until", "5"]


def _run(capsys, *arguments):
    try:
        status = main([*arguments])
    except SystemExit as stop:
        status = stop.code
    out, err = capsys.readouterr()
    return status, out, err


def test_solve_prints_the_path_as_a_table(capsys):
    status, out, err = _run(capsys, *GOOD)
    assert (status, err) == (0, "")
    assert "velocity_zero -> stick" in out
    assert out.splitlines()[-1].endswith("until (exact)")


def test_solve_prints_json_with_the_fixed_keys(capsys):
    _, out, _ = _run(capsys, *GOOD, "--json")
    told = json.loads(out)
    assert told["modes"] == ["slip_opposite", "stick", "slip_same"]
    assert {"final", "events", "modes", "model"} <= set(told)
    assert set(told["events"][0]) == {"kind", "t", "state"}
    assert told["final"][2] == pytest.approx(1, abs=1e-5)


def test_solve_with_digits_prints_strings_of_that_many_digits(capsys):
    _, out, _ = _run(capsys, *GOOD, "--digits", "40", "--json")
    final = json.loads(out)["final"]
    assert all(isinstance(value, str) for value in final)
    assert len(final[0].lstrip("-0.")) == pytest.approx(40, abs=2)


def test_negative_numbers_of_every_form_are_values(capsys):
    arguments = [*GOOD[:5], "--start", "-1/2", "-1e-3", "-.5", "--until", "1"]
    assert _run(capsys, *arguments)[0] == 0


def test_claims_prints_a_line_each_and_the_evidence_of_one(capsys):
    status, out, _ = _run(capsys, "claims", "C16", "C23")
    assert status == 0
    assert "C16 (section 3): refined" in out
    assert "instead, numeric, holds" in out


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
        (["derive", "--root", "/nowhere"], "derivations"),
        (["export", "--target", "fortran", "--out", "x"], "fortran"),
    ],
)
def test_bad_input_is_one_line_on_stderr_and_status_two(capsys, arguments, named):
    status, out, err = _run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert named in err
    assert "Traceback" not in err


def test_debug_shows_the_traceback():
    command = [sys.executable, "-m", "asympk", "--debug", "claims", "C99"]
    assert "Traceback" in subprocess.run(command, capture_output=True, text=True).stderr
