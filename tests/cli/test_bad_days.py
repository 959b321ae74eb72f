"""Bad days: whatever is typed, whatever the disk does, the answer is a result or one line and status 2."""

import errno
import os
import re
import signal
import subprocess
import sys
import time
import weakref
from contextlib import chdir, redirect_stderr, redirect_stdout
from importlib import import_module
from io import StringIO
from pathlib import Path
from socket import create_server

import pytest
from commandline import run
from hypothesis import given, settings
from hypothesis import strategies as st

import asympk as ap
from asympk.__main__ import main
from asympk.errors import AsympkError
from asympk.scenes import scenefile
from asympk.sweep import sweepfile

ROOT = Path(ap.__file__).parent.parent
SWEEP = "sigma = 1\nmu = 1e-3\nstart = [0, [0, 0.2], -1]\nuntil = 5\n"


def _refusal(function, *arguments):
    """Return the error by which a call is refused, or None."""
    try:
        function(*arguments)
    except AsympkError as refusal:
        return refusal
    return None


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A directory with a good sweep, a bad one, and other things that are no scenes."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.toml").write_text(SWEEP)
    (tmp_path / "typo.toml").write_text("sgima = 1\n" + SWEEP)
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    (tmp_path / "empty.toml").write_text("")
    (tmp_path / "deep.toml").write_text("mu = " + "[" * 3000)
    (tmp_path / "huge.toml").write_text("#" * 1_100_000)
    (tmp_path / "scene.toml").write_text("sigma = 1\nmu = 1e-3\nstart = [0, 0.2, -1]\nuntil = 5\n")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "file").write_text("not a directory")
    return tmp_path


BAD_LINES = [
    ("solve nonsense", "choose one of backward"),
    ("solve typo.toml", "is of a sweep, which asympk sweep follows"),
    ("solve binary.toml", "not TOML"),
    ("solve empty.toml", "missing"),
    ("solve deep.toml", "not TOML"),
    ("solve huge.toml", "at most"),
    ("solve folder.toml", "folder.toml: it is a directory; give a TOML file in it"),
    ("mechanism .", ".: it is a directory"),
    ("sweep . --out o", ".: it is a directory"),
    ("solve absent.toml", "no such file"),
    ("solve backward --mu 0", "positive"),
    ("solve backward --mu 1/0", "divide by zero"),
    ("solve backward --until -1", "until"),
    ("solve backward --start 1 2", "--start has 2 numbers; give all 3, x, y, z, or some by --set"),
    ("solve backward --start 1 2 3 4", "--start has 4 numbers; give all 3, x, y, z, or some by --set"),
    ("solve backward --sigma0 0", "at least sigma"),
    ("solve backward --sigma0 1/2", "sigma0 = 1/2: it must be at least sigma = 1"),
    ("solve backward --digits 0", "digits"),
    ("solve backward --digits 1e3", "invalid int"),
    ("solve backward --method eulre", "unknown"),
    ("solve backward --plot x.gif", ".pdf, .svg, .png"),
    ("solve backward --plot absent/../file/x.png", ""),
    ("solve backward --csv file/x.csv", ""),
    ("solve backward --csv=", "no name"),
    ("solve backward --plot=", "no name"),
    ("solve scene.toml --csv scene.toml", "own file"),
    ("solve backward --physical", "no physical quantities; give its scene or file in m, P, f"),
    ("solve chalk --sigma 1", "'sigma' is no parameter; choose one of m, P"),
    ("solve arm --sigma 1", "'sigma' is no parameter; choose one of E, S"),
    ("solve arm --set until=1", "--set until: the horizon is no parameter; give it by --until 1"),
    ("solve arm --set q=1", "'q' is no parameter; choose one of E, S, c, f, h, m; the states of its start are a, b,"),
    ("solve arm --start 0 1 2", "--start has 3 numbers; give all 7, a, b, x, a', b', y, z, or some by --set"),
    ("solve arm --set f", "write it as NAME=VALUE"),
    ("solve --set f=1", "name the scene"),
    ("solve arm --set f=1 --set f=2", "f is given twice; give it once"),
    ("mechanism arm --set f=1 --set f=2", "f is given twice; give it once"),
    ("solve backward --set mu=1e-4 --mu 1e-3", "mu is given twice; give it once"),
    ("least backward --start 0 0.2 -1 --set z=2", "z is given twice; give it once"),
    ("solve backward extra", "asympk solve: unrecognized arguments: extra; see asympk solve --help"),
    ("scenes nonsense", "choose one of backward"),
    ("scenes absent.toml", "crank_slider, arm\n"),
    ("sweep good.toml", "--out"),
    ("sweep absent.toml --out o", "no such file"),
    ("sweep painleve_rod --out o", "it is one scene; asympk scenes painleve_rod prints its file"),
    ("sweep backward --out o", "it is one scene; asympk scenes backward prints its file"),
    ("sweep typo.toml --out o", "'sgima' is unknown"),
    ("sweep scene.toml --out file", ""),
    ("sweep good.toml --out file/o", ""),
    ("sweep good.toml --out o --workers 0", "workers = 0"),
    ("sweep good.toml --out o --workers two", "invalid int"),
    ("sweep good.toml --out o --workers 2 --dask tcp://x", "either"),
    ("certify", "a scene, or --sigma"),
    ("certify --claims --set f=1", "certify takes either a scene"),
    ("certify nonsense", "choose one of backward"),
    ("certify backward --box mu 0 1", "above 0"),
    ("certify backward --box mu 1", "expected 3 arguments"),
    ("certify backward --box mu 1e-7 1e-6 --box mu 1e-6 2e-6", "given twice"),
    ("certify backward --digits 0", "--digits"),
    ("certify backward --claims", "either a scene"),
    ("certify --claims --json", "either a scene"),
    ("certify backward --pieces 0", "--pieces = 0: it must be a whole number from 1 to 100000"),
    ("sweep good.toml --out=", "--out: it has no name"),
    ("sweep good.toml --out o --plot=", "--plot: it has no name"),
    ("export --target c --out=", "--out: it has no name"),
    ("report --out=", "--out: it has no name"),
    ("tables --root=", "--root: it has no name"),
    ("solve backward --csv -", "--csv: - is no name"),
    ("mechanism arm --plot=", "--plot: it has no name"),
    ("mechanism --set f=2", "name it, or give a TOML file"),
    ("mechanism --plot a.svg", "name it, or give a TOML file"),
    ("unknown", "invalid choice"),
    ("--nonsense", "nonsense"),
]


@pytest.mark.parametrize(("line", "said"), BAD_LINES, ids=[line for line, _ in BAD_LINES])
@pytest.mark.few(6)
def test_a_bad_command_line_is_one_line_and_status_two(place, capsys, line, said):
    status, out, err = run(capsys, *line.split())
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("asympk")
    assert said in err
    assert "Traceback" not in err


def test_debug_shows_where_a_bad_scene_was_found(place):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "asympk", "--debug", "solve", "typo.toml"]
    told = subprocess.run(command, capture_output=True, text=True, cwd=place, env=environment)
    assert told.returncode == 2
    assert "Traceback" in told.stderr
    assert "InputError" in told.stderr


@pytest.mark.slow
def test_whoever_stops_reading_is_not_told_of_it():
    command = f"{sys.executable} -m asympk scenes | head -1"
    told = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert told.stderr == ""
    assert told.stdout.startswith("backward")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is full")
@pytest.mark.slow
def test_a_full_place_of_the_output_is_one_line():
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "asympk", "scenes"]
        told = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert told.returncode == 2
    assert told.stderr == "asympk: the output: No space left on device; give another place\n"


def test_a_port_in_use_is_one_line(capsys):
    with create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        status, out, err = run(capsys, "explore", "--no-browser", "--port", port)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert f"port {port} cannot be used" in err


def test_an_interruption_while_the_command_line_is_loaded_is_one_line(capsys, monkeypatch):
    class Interrupted:
        @property
        def main(self):
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "asympk.cli.main", Interrupted())
    assert run(capsys, "scenes") == (130, "", "asympk: interrupted\n")


class _Gone:
    pass


def _in_a_callback(number):
    """Ctrl-C during ``asympk paper`` was lost in a WeakKeyDictionary, with a traceback."""
    return weakref.ref(_Gone(), lambda _: signal.raise_signal(number))


def _while_a_module_is_loaded(number):
    """Ctrl-C within 0.3 s of the start was lost: mpmath loads gmpy2 so that nothing is raised."""
    Path("ignoring.py").write_text(f"import signal\ntry:\n    signal.raise_signal({int(number)})\nexcept BaseException:"
                                   "\n    pass\n")
    sys.modules.pop("ignoring", None)
    import_module("ignoring")


@pytest.mark.parametrize("ignored", [_in_a_callback, _while_a_module_is_loaded])
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_that_is_ignored_where_it_comes_ends_the_command_nevertheless(
    number, status, ignored, place, capsys, monkeypatch
):
    monkeypatch.syspath_prepend(place)
    monkeypatch.setattr("asympk.cli.scenes.run", lambda _: (ignored(number), time.sleep(10)))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert run(capsys, "scenes") == (status, "", "asympk: interrupted\n")
    finally:
        signal.signal(signal.SIGINT, before)


def _full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    "line", ["sweep good.toml --out o", "solve backward --csv p.csv", "solve backward --plot p.png"]
)
@pytest.mark.few(2)
def test_a_full_disk_is_one_line_and_leaves_nothing_half_written(place, capsys, monkeypatch, line):
    monkeypatch.setattr("asympk.storage.files.os.replace", _full)
    status, out, err = run(capsys, *line.split())
    assert (status, out) == (2, "")
    assert re.search(r" (o/chunk-0+.npz|o/sweep.json|p.csv|p.png): No space left on device; give another place$", err)
    assert err.count("\n") == 1
    written = [path.name for path in place.rglob("*") if path.name.startswith((".", "p.", "chunk"))]
    assert written == []


def test_a_sweep_goes_on_where_a_full_disk_stopped_it(place, capsys, monkeypatch):
    (place / "chunked.toml").write_text(SWEEP.replace("[0, 0.2]", "{grid = [0, 1], points = 9}") + "chunk = 2\n")
    assert run(capsys, "sweep", "chunked.toml", "--out", "whole")[0] == 0
    real, left = os.replace, [4]

    def runs_full(source, target):
        left[0] -= 1
        return _full() if left[0] < 0 else real(source, target)

    with monkeypatch.context() as patch:
        patch.setattr("asympk.storage.files.os.replace", runs_full)
        assert run(capsys, "sweep", "chunked.toml", "--out", "o")[0] == 2
    assert len([*(place / "o").glob("chunk-*")]) == 3
    assert run(capsys, "sweep", "chunked.toml", "--out", "o")[0] == 0
    whole, resumed = ({p.name: p.read_bytes() for p in (place / o).iterdir()} for o in ("whole", "o"))
    assert whole == resumed


def test_a_read_only_place_is_one_line(place, capsys, monkeypatch):
    real = os.open

    def read_only(path, flags, *rest):
        if flags & os.O_CREAT:
            raise OSError(errno.EROFS, "Read-only file system", str(path))
        return real(path, flags, *rest)

    monkeypatch.setattr("asympk.sweep.lock.os.open", read_only)
    status, out, err = run(capsys, "sweep", "good.toml", "--out", "o")
    assert (status, out) == (2, "")
    assert "asympk: o/.lock: Read-only file system; give another place" in err
    assert err.count("\n") == 1


WORDS = st.sampled_from(
    ["solve", "scenes", "certify", "sweep", "backward", "chalk", "escape", "static", "--sigma", "--mu", "--start",
     "--until", "--sigma0", "--digits", "--box", "--pieces", "--json", "--physical", "--method", "exact", "x", "mu",
     "1", "-1", "0.2", "1/3", "1e-6", "1e400", "nan", "-inf", "5", "2", "--", "-", "", "ä", "--out", "o", "good.toml",
     "typo.toml", "--workers=0"]
)


@settings(max_examples=300)
@given(st.sampled_from(["solve", "scenes", "certify", "sweep", "nonsense"]), st.lists(WORDS, max_size=9))
@pytest.mark.further
def test_no_command_line_ends_in_a_traceback(tmp_path_factory, first, rest):
    place = tmp_path_factory.mktemp("fuzz")
    (place / "good.toml").write_text(SWEEP)
    told = StringIO()
    with chdir(place), redirect_stdout(StringIO()), redirect_stderr(told):
        try:
            status = main([first, *rest])
        except SystemExit as stop:
            status = stop.code
    assert status in (0, 1, 2)
    assert status != 2 or told.getvalue().count("\n") == 1


VALUES = st.recursive(
    st.one_of(st.integers(), st.floats(), st.booleans(), st.text(max_size=8),
              st.sampled_from(["1/3", "1e-6", "60 deg", "Pi2", "0"])),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(
        st.sampled_from(["uniform", "grid", "points", "manifold", "x", "offset", "z", "log_grid"]), inner, max_size=4)),
    max_leaves=6,
)
KEYS = st.sampled_from([*scenefile.COMMON, *scenefile.NONDIMENSIONAL, *scenefile.PHYSICAL, *scenefile.SYSTEM,
                        "seed", "count", "chunk"])


@pytest.mark.further
@settings(max_examples=300)
@given(table=st.dictionaries(KEYS, VALUES, max_size=9), good=st.booleans(), kind=st.sampled_from(["scene", "sweep"]))
def test_any_table_is_read_or_refused_in_one_sentence(table, good, kind):
    base = {"sigma": 1, "mu": "1e-3", "start": [0, 0, -1], "until": 5} if good else {}
    read = sweepfile.sweep_of_table if kind == "sweep" else scenefile.scene_of_table
    refusal = _refusal(read, {**base, **table}, "file")
    assert "\n" not in str(refusal)
    assert len(str(refusal)) < 400


SIZES = st.one_of(st.floats(-100, 100), st.floats(-1e30, 1e30), st.sampled_from([0.0, -0.0, 5e-324, -1.0, 1.0]))


@pytest.mark.further
@settings(max_examples=150)
@given(
    sigma=st.one_of(st.floats(-1.999999, 10), st.floats(-2, 1e6, exclude_min=True), st.sampled_from([0, -1])),
    mu=st.one_of(st.floats(1e-8, 10), st.floats(1e-12, 1e6)),
    start=st.tuples(SIZES, SIZES, SIZES),
    until=st.one_of(st.floats(0, 50), st.just(0)),
)
def test_solve_is_finite_or_refuses_over_its_whole_domain(sigma, mu, start, until):
    scene = ap.Scene(sigma, mu, start, until)
    refusal = _refusal(ap.solve, scene)
    if refusal:
        assert len(str(refusal)) < 400
        return
    path = ap.solve(scene)
    assert all(value - value == 0 for value in path.final)
    assert len(path.modes) == len(path.events) + 1
    assert [event.t for event in path.events] == sorted(event.t for event in path.events)
    assert all(0 <= event.t <= until for event in path.events)
