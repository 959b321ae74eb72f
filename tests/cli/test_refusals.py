"""What was once a traceback or a long wait is one line, and work is done also where nobody hears of it."""

import os
import re
import subprocess
import sys
import time

import mpmath
import numpy as np
import pytest
import sympy as sp
from mechanisms import SLENDER_ROD
from peers import here

import asympk as ap
from asympk.__main__ import main
from asympk.errors import InputError, UnknownName

SCENE = ap.Scene(sigma=1, mu="1e-3", start=(0, "0.2", -1), until=2)
TINY = ap.Scene(sigma=1, mu="1e-400", start=(0, "0.2", -1), until=2)
LINE = ["solve", "--sigma", "1", "--mu", "1e-3", "--start", "0", "0.2", "-1", "--until", "2"]
NEAR = 'sigma = 1\nmu = 1e-3\nuntil = 1\nnear = {manifold = ["Pi2"], x = 0, offset = 0, z = 1}'
SWEEP = "seed = 1\ncount = 6\nchunk = 2\nsigma = 1\nmu = 1e-3\nstart = [{uniform = [-1, 1]}, 0.2, -1]\nuntil = 1\n"


def _asympk(*arguments, **options):
    command = [sys.executable, "-m", "asympk", *arguments]
    return subprocess.run(command, text=True, timeout=100, check=False, **{"capture_output": True, **options})


@pytest.mark.parametrize("method", here("heyoka", "cvode"))
@pytest.mark.few(0)
def test_what_a_solver_prints_itself_is_not_in_the_output(method):
    beyond = "--sigma", "1", "--mu", "1e-300", "--start", "1e200", "0", "1", "--until", "5"
    run = _asympk("solve", *beyond, "--method", method)
    assert (run.returncode, run.stdout) == (2, "")


@pytest.mark.further
def test_without_docstrings_a_command_does_its_work_or_names_the_option():
    without = {**os.environ, "PYTHONOPTIMIZE": "2"}
    assert "slip_same" in _asympk(*LINE, env=without).stdout
    assert "python -OO drops the docstrings" in _in_one_line(_asympk("mechanism", "arm", env=without))


def _in_one_line(run):
    assert run.returncode == 2
    assert run.stderr.startswith("asympk")
    assert run.stderr.count("\n") == 1
    assert len(run.stderr) < 300
    return run.stderr


@pytest.mark.parametrize("method", ["jump", "slow", "rigid", "exact"])
@pytest.mark.parametrize("digits", [-5, 0, 1.5, True, "30", 10**6, 10**30, [30]])
def test_digits_of_any_kind_are_a_whole_number_or_refused(method, digits):
    with pytest.raises(InputError, match=r"digits = .*: it must be a whole number from 1 to 1000"):
        ap.solve(SCENE, method, digits=digits)


@pytest.mark.parametrize("method", ["exact", "jump", "rk45", "lsoda", "tanh", "sign", "moreau"])
def test_a_mu_below_the_doubles_is_refused_by_every_method_in_doubles(method):
    with pytest.raises(InputError, match="mu"):
        ap.solve(TINY, method)
    with pytest.raises(InputError, match="mu"):
        ap.least_model(TINY)


@pytest.mark.parametrize("until", ["1e-300", "1e-400"])
def test_an_end_too_near_for_the_steps_of_integrators_is_refused_as_that_and_followed_in_digits(until):
    x = sp.Symbol("x", real=True)
    bent = ap.Scene(system=ap.System.smooth({x: sp.cos(x)}, {}, None), values={}, start={x: 0}, until=until)
    for method in ("exact", "lsoda", "radau"):
        with pytest.raises(InputError, match=rf"until = 1\.0{until[1:]}: integrators square their steps"):
            ap.solve(bent, method)
    assert float(ap.solve(bent, digits=20).final[0] / mpmath.mpf(until)) == pytest.approx(1)


@pytest.mark.parametrize("method", [[], {}, None, 3, ["exact"]])
def test_a_method_is_a_name(method):
    with pytest.raises(UnknownName, match="method"):
        ap.solve(SCENE, method)
    with pytest.raises(UnknownName, match="method"):
        ap.solve_many(1, 1e-3, 0, 0.2, -1, 2, method=method)


@pytest.mark.parametrize("method", ["exact", "jump", "rk45", "moreau"])
@pytest.mark.parametrize("t", [1j, [1j], [[1], [1, 2]], "one", None, np.ma.array([0.0, 1.0], mask=[0, 1])], ids=repr)
@pytest.mark.few(4)
def test_a_path_at_what_is_no_time_is_refused(method, t):
    with pytest.raises(InputError, match=r"^t"):
        ap.solve(SCENE, method)(t)


@pytest.mark.parametrize("method", ["exact", "jump"])
def test_masks_lists_in_themselves_and_too_many_dimensions_are_refused(method):
    for x in (np.ma.array([0.0, 1.0], mask=[0, 1]), [np.ma.array([0.0, 1.0], mask=[0, 1])]):
        with pytest.raises(InputError, match="x is masked"):
            ap.solve_many(1, 1e-3, x, 0.2, -1, 2, method=method)
    (endless := [1]).append(endless)
    with pytest.raises(InputError, match=r"x = \[1, \[\.\.\.\]\]: it must be a number"):
        ap.solve_many(1, 1e-3, endless, 0.2, -1, 2, method=method)
    with pytest.raises(InputError, match="x has 64 dimensions; give an array of at most 30"):
        ap.solve_many(1, 1e-3, np.zeros((1,) * 64), 0.2, -1, 2, method=method)
    assert ap.solve_many(1, 1e-3, np.zeros((1,) * 30), 0.2, -1, 2, method=method).final.shape == (3,) + (1,) * 30


def test_an_array_with_nothing_masked_is_taken():
    x = np.ma.array([0.0, 1.0], mask=[0, 0])
    assert (ap.solve_many(1, 1e-3, x, 0.2, -1, 2).final == ap.solve_many(1, 1e-3, x.data, 0.2, -1, 2).final).all()


def test_numbers_of_a_million_digits_are_refused_in_a_line(tmp_path):
    for name in ("sigma", "mu", "until"):
        with pytest.raises(InputError, match=r"\(int of very many digits\): it must be finite"):
            ap.Scene(**{"sigma": 1, "mu": 1, "start": (0, 0, 1), "until": 1, name: 1 << 4_000_000})
    assert "it must be a whole number" in _in_one_line(_asympk(*LINE, "--digits", "9" * 100_000))


@pytest.mark.further
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_scene_is_read_from_a_pipe_and_none_from_one_that_nobody_writes_to(tmp_path):
    text = "sigma = 1\nmu = 1e-3\nstart = [0, 0.2, -1]\nuntil = 2\n"
    assert "slip_same" in _asympk("solve", "/dev/stdin", input=text).stdout
    assert "it is a scene, followed by asympk solve" in _in_one_line(_asympk("mechanism", "/dev/stdin", input=text))
    os.mkfifo(tmp_path / "pipe")
    assert "missing" in _in_one_line(_asympk("solve", str(tmp_path / "pipe")))
    assert "beyond 1000000 bytes" in _in_one_line(_asympk("solve", "/dev/zero"))
    assert "/proc/self/mem: Input/output error" in _in_one_line(_asympk("solve", "/proc/self/mem"))


def test_a_start_beside_a_list_of_planes_is_refused(tmp_path):
    (tmp_path / "near.toml").write_text(NEAR)
    with pytest.raises(InputError, match=r"manifold = \['Pi2'\]: it must be one of Pi1, Pi2"):
        ap.read_scene(tmp_path / "near.toml")


@pytest.mark.slow
def test_a_backend_that_matplotlib_does_not_know_is_one_line(tmp_path):
    run = _asympk(*LINE, "--plot", str(tmp_path / "a.png"), env={**os.environ, "MPLBACKEND": "nonsense"})
    assert "unset MPLBACKEND" in _in_one_line(run)


def test_help_prints_in_any_character_set():
    plain = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    run = _asympk("--help", env=plain)
    assert run.returncode == 0
    assert "Klein" in run.stdout


@pytest.mark.parametrize("closed", ["2>&-", "2>/dev/full"])
@pytest.mark.further
def test_the_work_is_done_and_the_status_right_where_stderr_takes_nothing(tmp_path, closed):
    (tmp_path / "sweep.toml").write_text(SWEEP)
    for line, status in ((" ".join(LINE), 0), (" ".join(LINE) + " --mu -1", 2), ("solve --nope", 2),
                         ("sweep sweep.toml --out out", 0)):
        run = subprocess.run(f"{sys.executable} -m asympk {line} {closed}", shell=True, cwd=tmp_path,
                             capture_output=True, timeout=100, check=False)
        assert run.returncode == status
    assert len([*(tmp_path / "out").glob("chunk-*")]) == 3


@pytest.mark.parametrize("address", ["nope", "http://x", "", "tcp://127.0.0.1:1", "nope:99999"])
@pytest.mark.few(0)
def test_a_scheduler_that_is_not_there_is_one_line_at_once(tmp_path, address):
    """At once is less than the 30 seconds that a dask client waits; a busy machine takes 5 for the imports alone."""
    pytest.importorskip("distributed")
    (tmp_path / "sweep.toml").write_text(SWEEP)
    begun = time.monotonic()
    run = _asympk("sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out"), "--dask", address)
    assert "--dask" in _in_one_line(run)
    assert time.monotonic() - begun < 20


@pytest.mark.parametrize(
    ("rate", "advice"),
    [
        ("-x + sin(t) + F", 'the name t is unknown; a system that depends on the time says so by time = "t"'),
        ("-x' + F", "the name x' is unknown"),
        ("-lambda*x + F", "the name lambda is unknown"),
    ],
)
def test_what_is_mistyped_in_a_system_is_told_as_it_was_written(tmp_path, rate, advice):
    friction = '[[system.frictions]]\nvelocity = "v"\nforce = "F"\nload = 1\nkinetic = 1\n'
    text = f'until = 1\n[system.slow]\nx = "v"\nv = "{rate}"\n{friction}[start]\nx = 2\nv = "1/2"\n'
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match=re.escape(advice)):
        ap.solve(ap.read_scene(tmp_path / "mine.toml"), method="lsoda")


BLOCK = """until = 3
[system.slow]
x = "v"
v = "-x + F"
[[system.frictions]]
velocity = "v"
force = "F"
load = 1
kinetic = "%s"
[start]
x = 1
v = %s
"""


@pytest.mark.parametrize(
    ("kinetic", "v", "said"),
    [
        ("sqrt(v)", "1", "kinetic = sqrt(v) is not real in every mode; write it so that it is, as sqrt(abs(v)) is"),
        ("sqrt(v)", "-1", "kinetic = sqrt(v) is not a finite real number at t = 0"),
        ("1/(v - 1)", "1", "kinetic = 1/(v - 1) is not a finite real number at t = 0"),
        ("1 - abs(v)", "2", "kinetic friction 1 - Abs(v) is negative at t = 0, x = 1, v = 2; friction opposes"),
        ("5 + log(abs(v))", "0", "log(Abs(v)) in kinetic = log(Abs(v)) + 5 is not a finite real number at t = 0"),
        ("5 - log(abs(v))", "0", "log(Abs(v)) in kinetic = 5 - log(Abs(v)) is not a finite real number at t = 0"),
        ("1 + v*log(abs(v))", "0", "log(Abs(v)) in kinetic = v*log(Abs(v)) + 1 is not a finite real number at t = 0"),
    ],
)
def test_a_motion_that_cannot_be_followed_is_told_by_the_file_and_the_formula(tmp_path, capsys, kinetic, v, said):
    (tmp_path / "block.toml").write_text(BLOCK % (kinetic, v))
    assert main(["solve", str(tmp_path / "block.toml")]) == 2
    assert f"asympk: {tmp_path / 'block.toml'}: {said}" in capsys.readouterr().err


def test_a_start_inside_a_rigid_ground_is_told_by_the_file_and_the_gap(tmp_path, capsys):
    state = "[state]\nX = 0\nY = 0.4\ntheta = 1\n\"X'\" = 0\n\"Y'\" = 0\n\"theta'\" = 0\n"
    values = "[values]\nm = 1\nl = 1\ng = 1\nf = 2\n"
    (file := tmp_path / "rod.toml").write_text(f'{SLENDER_ROD}contact = "rigid"\nuntil = 1\n{values}{state}')
    assert main(["solve", str(file)]) == 2
    said = rf"asympk: {re.escape(str(file))}: start: the gap .* of the contact is negative, -0\.441471; a rigid"
    assert re.search(said, capsys.readouterr().err)


def test_a_method_or_a_number_of_digits_that_does_not_exist_is_not_laid_to_the_file(tmp_path, capsys):
    (tmp_path / "block.toml").write_text(BLOCK % ("1/2", "1"))
    for option in (["--digits", "0"], ["--method", "eulre"]):
        assert main(["solve", str(tmp_path / "block.toml"), *option]) == 2
        assert "block.toml" not in capsys.readouterr().err


AT_REST = "[state]\n\"X'\" = 0\ntheta = 1\n\"theta'\" = 0\n"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("m = 1", 'm = "one"'), "values: m = 'one': it must be"),
        (("m = 1", "m = 1\nk = 2"), "values: k is in no formula; leave it out"),
        (("m = 1", "m = 1\nuntil = 2"), "values: until is in no formula; until is below [values] and must be above"),
        (("f = 2", 'f = 2\n[state]\ntheta = 1\nXd = 2'), "Xd is no coordinate, rate or parameter"),
        (("[values]", 'damping = 1\ncompliance = "q"\n[values]'), "compliance = 'q': the name q is unknown"),
        (("[values]", 'damping = -1\ncompliance = "c"\n[values]\nc = 1'), "damping = -1: it must be zero or positive"),
        (("[values]", 'damping = 1\ncompliance = "c"\n[values]\nc = -1'), "values: c = -1: it must be positive"),
        (("[values]", 'compliance = "c"\n[values]\nc = 1'), "contact must be"),
        (("[values]", 'contact = "rigit"\n[values]'), "contact must be"),
        (("[values]", 'until = "soon"\n[values]'), "until = 'soon'"),
        (("[values]", "until = -1\n[values]"), "until = -1: it must be zero or positive"),
        (("[values]\nm = 1", f"{AT_REST}[values]\nm = 0"), "an equation of the contact is not finite"),
        (("[values]", 'damping = 1\ncompliance = "c^3"\n[values]\nc = 1'), "compliance = c**3: it must be a Symbol"),
        (("[values]", '[over]\ntheta = [0, "pi/"]\n[values]'), "over: theta = 'pi/': it must be a number, such as 0.2"),
        (("coordinates", "[over]\ncoordinates"), "coordinates, gap, slip, friction missing; coordinates is below"),
        (("m = 1", "m = 1"), "no value for X', theta, theta'; give each a number under [state]"),
    ],
)
def test_what_is_wrong_in_the_file_of_a_mechanism_is_told_with_the_name_of_the_file(tmp_path, capsys, change, told):
    file = tmp_path / "rod.toml"
    file.write_text(f"{SLENDER_ROD}[values]\nm = 1\nl = 1\ng = 1\nf = 2\n".replace(*change))
    assert main(["mechanism", str(file)]) == 2
    assert f"{file}: {told}" in capsys.readouterr().err


@pytest.mark.parametrize("line", [
    ["solve", "backward", "--method", "lsoda", "--rtol", "10^-8", "--atol", "sqrt(2)/10^9", "--seconds", "2*30"],
    ["least", "backward", "--rtol", "10^-3", "--seconds", "2*30"],
    ["certify", "backward", "--box", "mu", "10^-6", "1.1*10^-6"],
])
def test_limits_and_boxes_may_be_formulas_of_numbers_as_other_numbers_are(line):
    assert main(line) == 0


@pytest.mark.parametrize(("line", "said"), [
    (["solve", "backward", "--method", "lsoda", "--rtol", "-sqrt(2)"], "rtol = -1.41421"),
    (["least", "backward", "--seconds", "-sqrt(2)"], "seconds = -1.414213562"),
    (["certify", "backward", "--box", "mu", "-sqrt(2)", "1"], "it starts at -1.414213562\n"),
    (["certify", "backward", "--box", "sigma0", "sqrt(2)/3", "1"], "it is 0.4714045208 where"),
])
def test_an_irrational_limit_or_end_of_a_box_is_shown_in_few_digits(capsys, line, said):
    """The end of a box was shown as a ratio of a thousand digits."""
    assert main(line) == 2
    assert said in capsys.readouterr().err
