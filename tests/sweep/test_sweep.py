"""Sweeps: the same bits whatever cuts, computes, kills or resumes them; summaries that are exact."""

import json
import os
import signal
import subprocess
import threading
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from interrupt import hearing
from sweeptext import parse_sweep

import asympk as ap
from asympk.__main__ import main
from asympk.errors import InputError, TooLarge, TooManyEvents, Undecided, WorkersLost
from asympk.many import PHASES
from asympk.output.terminal import sweep_as_text
from asympk.path import MODES
from asympk.sweep import chunks, directory, files, results, rods, run_sweep, summary
from asympk.sweep.executors import InProcess, Processes
from asympk.sweep.lock import locked
from asympk.sweep.rods import RodFamily, first_phases

ROD = RodFamily()
TEXT = """
seed = 11
count = {count}
chunk = {chunk}
sigma = [0.5, 1]
mu = {{ log_uniform = [1e-5, 1e-3] }}
start = [{{ uniform = [-1, 1] }}, {{ uniform = [-1, 1] }}, {{ uniform = [-2, 2] }}]
until = 5
"""


def _sweep(count=600, chunk=100, **more):
    extra = "".join(f"{key} = {value}\n" for key, value in more.items())
    return parse_sweep(extra + TEXT.format(count=count, chunk=chunk))


def _bytes(out):
    return {path.name: path.read_bytes() for path in Path(out).iterdir() if path.name != "summary.json"}


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The files of an uninterrupted sweep in one process."""
    out = tmp_path_factory.mktemp("plain")
    assert run_sweep(_sweep(), out) == 12
    return _bytes(out)


def test_every_row_is_what_solve_says():
    sweep = _sweep(count=40, chunk=80)
    columns = sweep.quantities(0, 80)
    story, _ = chunks.compute(sweep, 0)
    found = chunks.chunk_columns(ROD, columns, 80)
    assert (story["start"], story["stop"]) == (0, 80)
    arrays = {field: np.broadcast_to(values, 80) for field, values in columns.items()}
    for row in range(80):
        one = {field: float(values[row]) for field, values in arrays.items()}
        path = ap.solve(ap.Scene(one["sigma"], one["mu"], (one["x"], one["y"], one["z"]), one["until"]))
        assert tuple(found[axis][row] for axis in "xyz") == pytest.approx(path.final, rel=1e-12, abs=1e-13)
        _agrees(found, row, path)


def _agrees(found, row, path):
    kinds = [event.kind for event in path.events]
    words = f"{path.modes[0]}: {', '.join(kinds)}" if kinds else path.modes[0]
    assert ROD.alphabet.words(found["itinerary"][row]) == words
    assert found["n_events"][row] == len(kinds)
    assert found["collisions"][row] == kinds.count("velocity_zero")


@pytest.mark.slow
def test_starts_on_the_planes_and_on_edges_begin_in_the_mode_that_solve_finds():
    axes = {"sigma": (-1.5, -1.0, 1.0), "x": (-1.0, -0.75, 0.0, 0.25, 0.5, 3.0), "y": (-100.0, -1.0, 0.0, 0.5),
            "z": (-1.0, 0.0, 1.0)}
    rows = np.array([*product(*axes.values())]).T
    fixed = {"mu": np.full(rows.shape[1], 0.01), "until": np.zeros(rows.shape[1])}
    modes = first_phases({**dict(zip(axes, rows, strict=True)), **fixed})
    for mode, (sigma, x, y, z) in zip(modes, rows.T.tolist(), strict=True):
        assert MODES[mode] == ap.solve(ap.Scene(sigma, 0.01, (x, y, z), 0)).modes[0]


def test_a_load_that_is_zero_at_the_start_is_decided_in_arrays(monkeypatch):
    mu, y, z = (a.ravel() for a in np.meshgrid([0.01, 0.5, 3.0], [-150.0, -2.5, -0.1, 0.0, 2.0], [-1.0, 0.0, 1.0]))
    part = {"sigma": np.full(mu.shape, 0.5), "mu": mu, "x": -y, "y": y, "z": z}
    names = [ap.solve(ap.Scene(0.5, m, (-b, b, c), 0)).modes[0] for m, b, c in zip(mu, y, z, strict=True)]
    monkeypatch.setattr(rods, "_first_mode", lambda one: pytest.fail("one by one"))
    assert [PHASES[k] for k in first_phases(part)] == names


def test_a_start_beside_the_edge_of_stick_by_less_than_rounding_begins_in_the_mode_that_solve_finds():
    """0.5 - 0.1 in doubles is on the edge 1/(sigma + 3) = 0.4; the exact sum of the two doubles is below it."""
    part = {"sigma": -0.5, "mu": 0.01, "x": 0.5, "y": -0.1, "z": 0.0}
    [mode] = first_phases({axis: np.array([value]) for axis, value in part.items()})
    assert PHASES[mode] == ap.solve(ap.Scene(-0.5, 0.01, (0.5, -0.1, 0), 0)).modes[0] == "slip_same"


def test_a_grid_runs_through_all_combinations_and_its_decimals_are_exact():
    sweep = parse_sweep("sigma = [1, 2]\nmu = {log_grid = [1e-4, 1e-2], points = 3}\nstart = [0, [0.1, 0.2], -1]\n"
                        "until = {grid = [0, 1], points = 5}\n")
    assert (sweep.total, sweep.chunks) == (60, 1)
    assert sweep.axes["until"].values == tuple(Fraction(i, 4) for i in range(5))
    columns = {field: np.broadcast_to(values, 60) for field, values in sweep.quantities(0, 60).items()}
    rows = {tuple(float(columns[f][i]) for f in ("sigma", "mu", "y", "until")) for i in range(60)}
    mus = sorted({row[1] for row in rows})
    assert mus == pytest.approx([1e-4, 1e-3, 1e-2], rel=1e-15)
    assert rows == {*product((1, 2), mus, (0.1, 0.2), (0, 0.25, 0.5, 0.75, 1))}


def test_random_numbers_depend_on_the_row_alone():
    sweep = _sweep(count=1000)
    whole = sweep.quantities(0, 2000)
    for start, stop in ((0, 1), (3, 8), (999, 1001), (1234, 2000)):
        part = sweep.quantities(start, stop)
        assert all(np.array_equal(part[f], whole[f][start:stop]) for f in part if np.ndim(part[f]))
    other = parse_sweep(TEXT.format(count=1000, chunk=100).replace("seed = 11", "seed = 12")).quantities(0, 2000)
    assert not np.array_equal(whole["x"], whole["y"])
    assert not np.array_equal(whole["x"], other["x"])


def test_random_numbers_fill_their_range_evenly():
    columns = _sweep(count=20000).quantities(0, 40000)
    for field, low, high in (("x", -1, 1), ("z", -2, 2)):
        counted = np.histogram(columns[field], 10, (low, high))[0]
        assert counted.sum() == 40000
        assert abs(counted - 4000).max() < 5 * 4000**0.5
    decades = np.log10(columns["mu"])
    assert abs(np.histogram(decades, 10, (-5, -3))[0] - 4000).max() < 5 * 4000**0.5
    assert abs(np.corrcoef(columns["x"], columns["y"])[0, 1]) < 5 / 200


def test_results_do_not_depend_on_the_size_of_chunks(tmp_path):
    for chunk in (37, 1200):
        run_sweep(_sweep(chunk=chunk), tmp_path / str(chunk))
    small, large = ([columns for _, _, columns in results(tmp_path / str(chunk))] for chunk in (37, 1200))
    assert len(small) == 33
    for name, values in large[0].items():
        assert np.array_equal(np.concatenate([columns[name] for columns in small]), values)


class LateFirst(Executor):
    """Compute in threads, earlier chunks later, and remember how many were under way at most."""

    def __init__(self):
        self._pool, self._lock, self.open, self.most = ThreadPoolExecutor(4), threading.Lock(), 0, 0

    def submit(self, function, /, sweep, index):
        with self._lock:
            self.open += 1
            self.most = max(self.most, self.open)
        return self._pool.submit(self._late, function, sweep, index)

    def _late(self, function, sweep, index):
        time.sleep(0.002 * ((7 - index) % 5))
        try:
            return function(sweep, index)
        finally:
            with self._lock:
                self.open -= 1


def test_results_do_not_depend_on_the_order_or_the_executor(plain, tmp_path):
    executor = LateFirst()
    assert run_sweep(_sweep(), tmp_path, executor) == 12
    assert _bytes(tmp_path) == plain


def test_no_more_than_a_few_chunks_are_held_at_once(tmp_path):
    executor = LateFirst()
    run_sweep(_sweep(count=600, chunk=10), tmp_path, executor)
    assert executor.most <= 32


@pytest.mark.further
def test_a_killed_worker_process_loses_nothing(plain, tmp_path):
    pool, killed = Processes(2), []

    def kill_one(rows, fresh):
        if not killed:
            killed.append(next(iter(pool._pool._processes)))
            os.kill(killed[0], signal.SIGKILL)

    try:
        assert run_sweep(_sweep(), tmp_path, pool, kill_one) == 12
    finally:
        pool.shutdown()
    assert killed
    assert _bytes(tmp_path) == plain


class FirstAlone(Executor):
    """An executor of which the first chunk is done at once, and no other ever begins."""

    def __init__(self):
        self.given_out = []

    def submit(self, function, /, *arguments):
        self.given_out.append(Future() if self.given_out else InProcess().submit(function, *arguments))
        return self.given_out[-1]


def test_chunks_that_wait_in_an_executor_are_called_off_when_a_sweep_is_interrupted(tmp_path):
    executor = FirstAlone()

    def interrupt(units, fresh):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(_sweep(), tmp_path, executor, interrupt)
    first, *waiting = executor.given_out
    assert first.done()
    assert waiting
    assert all(future.cancelled() for future in waiting)


class Hopeless(Executor):
    """An executor whose workers always die."""

    def submit(self, function, /, *arguments):
        future = Future()
        future.set_exception(BrokenExecutor("dead"))
        return future


def test_workers_that_keep_dying_are_given_up(tmp_path):
    with pytest.raises(WorkersLost, match="run again to resume"):
        run_sweep(_sweep(), tmp_path, Hopeless())


class LosesEach(InProcess):
    """An executor whose worker dies once at every chunk."""

    def __init__(self):
        self.begun = set()

    def submit(self, function, /, sweep, index):
        if index in self.begun:
            return super().submit(function, sweep, index)
        self.begun.add(index)
        return Hopeless().submit(function)


def test_workers_that_die_between_chunks_are_not_given_up(plain, tmp_path, monkeypatch):
    monkeypatch.setattr(directory, "_MOST_LOSSES", 1)
    assert run_sweep(_sweep(), tmp_path, LosesEach()) == 12
    assert _bytes(tmp_path) == plain


class DaskFuture:
    """A future of dask: what its ``_result`` returns, and its status after that."""

    def __init__(self, result, status):
        self.result, self.status = result, status

    async def _result(self, raiseit):
        return self.result


class LosesOne(InProcess):
    """The first result is gathered while its worker dies: dask takes it for an error, and raises one of its own."""

    lost = 0

    def submit(self, function, /, *arguments):
        from distributed.cfexecutor import _cascade_future
        from tornado.ioloop import IOLoop

        future = super().submit(function, *arguments)
        if self.lost:
            return future
        self.lost, gathered = 1, Future()
        IOLoop(make_current=False).run_sync(lambda: _cascade_future(DaskFuture(future.result(), "lost"), gathered))
        return gathered


@pytest.mark.filterwarnings("ignore")
def test_a_chunk_whose_dask_worker_dies_while_it_is_gathered_is_computed_again(plain, tmp_path):
    pytest.importorskip("distributed")
    assert run_sweep(_sweep(), tmp_path, LosesOne()) == 12
    assert _bytes(tmp_path) == plain


@pytest.mark.further
@pytest.mark.filterwarnings("ignore")
def test_a_dask_worker_killed_midway_loses_nothing(plain, tmp_path, capsys):
    distributed = pytest.importorskip("distributed")
    done = []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:

        def kill_one(rows, fresh):
            done.append(rows)
            if len(done) == 2:
                os.kill(cluster.workers[0].pid, signal.SIGKILL)

        with distributed.Client(cluster, set_as_default=False) as client:
            assert run_sweep(_sweep(), tmp_path / "a", client.get_executor(pure=False), kill_one) == 12
        assert len(done) == 12
        assert _bytes(tmp_path / "a") == plain
        (tmp_path / "sweep.toml").write_text(TEXT.format(count=600, chunk=100))
        assert main(["sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "b"), "--dask",
                     cluster.scheduler_address]) == 0
    assert "1,200 trajectories" in capsys.readouterr().out
    assert _bytes(tmp_path / "b") == plain


def _command(tmp_path, out, *more):
    (tmp_path / "long.toml").write_text(TEXT.format(count=20000, chunk=200))
    return hearing("sweep", tmp_path / "long.toml", "--out", out, *more)


def _wait_for(out, count):
    for _ in range(2000):
        if len([*out.glob("chunk-*")]) >= count:
            return
        time.sleep(0.01)
    raise AssertionError(f"no {count} chunks within 20 s")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The directory of a long sweep that nothing interrupts."""
    folder = tmp_path_factory.mktemp("long")
    assert subprocess.run(_command(folder, folder / "whole"), capture_output=True).returncode == 0
    return folder / "whole"


@pytest.mark.slow
def test_workers_are_not_waited_for_when_a_sweep_is_interrupted():
    begun = time.monotonic()

    def interrupted():
        with Processes(1) as workers:
            assert workers.submit(abs, -1).result() == 1
            workers.submit(time.sleep, 60)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert time.monotonic() - begun < 30


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="there are no masks of signals")
@pytest.mark.slow
def test_a_worker_does_not_hear_ctrl_c_even_before_it_can_ignore_it():
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    workers = Processes(1)
    try:
        masked = workers.submit(signal.pthread_sigmask, signal.SIG_BLOCK, ()).result()
    finally:
        workers.shutdown()
    assert signal.SIGINT in masked
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before


@pytest.mark.further
@pytest.mark.parametrize("workers", [(), ("--workers", "2")])
def test_killed_three_times_and_resumed_equals_the_uninterrupted_sweep(tmp_path, whole, workers):
    out = tmp_path / "killed"
    for count in (5, 25, 45):
        command = _command(tmp_path, out, *workers)
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _wait_for(out, count)
        process.kill()
        process.wait()
        assert len([*out.glob("chunk-*")]) < 200
    assert subprocess.run(_command(tmp_path, out, *workers), capture_output=True).returncode == 0
    assert _bytes(out) == _bytes(whole)
    assert (out / "summary.json").read_bytes() == (whole / "summary.json").read_bytes()


@pytest.mark.further
@pytest.mark.parametrize("workers", [(), ("--workers", "2")])
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_is_one_line_and_leaves_a_resumable_directory(tmp_path, sent, workers):
    out, command = tmp_path / "out", _command(tmp_path, tmp_path / "out", *workers)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    _wait_for(out, 5)
    process.send_signal(sent)
    printed, complained = process.communicate()
    assert (process.returncode, printed) == (128 + sent, "")
    assert complained.startswith("asympk: interrupted")
    assert complained.count("\n") == 1
    done = len([*out.glob("chunk-*")])
    assert not [*out.glob(".*")]
    assert subprocess.run(_command(tmp_path, out), capture_output=True).returncode == 0
    assert 5 <= done < len(files(out)) == 200


def test_nothing_that_is_there_is_computed_again(tmp_path, monkeypatch):
    run_sweep(_sweep(), tmp_path)
    monkeypatch.setattr(chunks, "compute", None)
    told = []
    assert run_sweep(_sweep(), tmp_path, progress=lambda rows, fresh: told.append((rows, fresh))) == 0
    assert told == [(100, False)] * 12


@pytest.mark.parametrize("keep", [0, 1, 100, 2000, -1])
def test_a_truncated_chunk_is_computed_again(plain, tmp_path, keep):
    run_sweep(_sweep(), tmp_path)
    damaged = tmp_path / "chunk-00000003.npz"
    damaged.write_bytes(damaged.read_bytes()[:keep])
    with pytest.raises(InputError, match="damaged"):
        chunks.read_chunk(_sweep(), damaged)
    assert run_sweep(_sweep(), tmp_path) == 1
    assert _bytes(tmp_path) == plain


def test_a_flipped_bit_anywhere_is_found_or_harmless(plain, tmp_path):
    whole = plain["chunk-00000003.npz"]
    path = tmp_path / "chunk.npz"
    path.write_bytes(whole)
    story, columns = chunks.read_chunk(_sweep(), path)
    for place in range(0, len(whole), 61):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 16]) + whole[place + 1:])
        try:
            again, values = chunks.read_chunk(_sweep(), path)
        except InputError:
            continue
        assert again == story
        assert all(np.array_equal(values[name], columns[name]) for name in columns)


def test_chunks_are_read_by_numpy_alone_and_carry_their_story(plain, tmp_path):
    (tmp_path / "chunk.npz").write_bytes(plain["chunk-00000003.npz"])
    with np.load(tmp_path / "chunk.npz", allow_pickle=False) as archive:
        assert {"x", "y", "z", "n_events", "collisions", "itinerary", "outcome", "provenance"} == set(archive.files)
        story = json.loads(str(archive["provenance"]))
    assert (story["chunk"], story["start"], story["stop"]) == (3, 300, 400)
    assert story["sweep"] == _sweep().digest
    assert story["asympk"] == ap.__version__


def test_parquet_chunks_hold_the_same_and_are_checked_too(plain, tmp_path):
    pytest.importorskip("pyarrow")
    sweep = _sweep(format='"parquet"')
    assert run_sweep(sweep, tmp_path / "p") == 12
    run_sweep(_sweep(), tmp_path / "n")
    for (_, _, columns), (_, _, others) in zip(results(tmp_path / "p"), results(tmp_path / "n"), strict=True):
        assert all(np.array_equal(columns[name], others[name]) for name in others)
    first = _bytes(tmp_path / "p")
    damaged = tmp_path / "p" / "chunk-00000003.parquet"
    content = bytearray(damaged.read_bytes())
    content[300] ^= 4
    damaged.write_bytes(content)
    (tmp_path / "p" / "chunk-00000004.parquet").write_bytes(first["chunk-00000004.parquet"][:-9])
    assert run_sweep(sweep, tmp_path / "p") == 2
    assert _bytes(tmp_path / "p") == first
    summary.summarise(tmp_path / "p")
    assert [*tmp_path.glob("p/summary.json")]


def test_a_trajectory_without_a_result_costs_no_other_its_own(monkeypatch):
    from asympk.systems.painleve_klein.flow import exact

    real = exact.followed_in_doubles

    def refusing(case):
        for reason, bad in ((TooManyEvents, 7.0), (TooLarge, 9.0), (Undecided, 11.0)):
            if case.z == bad:
                raise reason("no")
        return real(case)

    monkeypatch.setattr(exact, "followed_in_doubles", refusing)
    x, y, z, bad = np.linspace(-1, 1, 64), np.zeros(64), -np.ones(64), [5, 40, 41]
    fair = chunks.chunk_columns(ROD, {"sigma": 1.0, "mu": 1e-3, "x": x, "y": y, "z": z, "until": 5.0}, 64)
    x[bad], y[bad], z[bad] = 1000, -1000, (7, 9, 11)  # on s = 0 without a rate: followed one by one
    found = chunks.chunk_columns(ROD, {"sigma": 1.0, "mu": 1e-3, "x": x, "y": y, "z": z, "until": 5.0}, 64)
    assert found["outcome"][bad].tolist() == [1, 2, 3]
    rest = np.delete(np.arange(64), bad)
    assert all(np.array_equal(found[name][rest], fair[name][rest]) for name in fair)
    assert all(np.isnan(found[axis][bad]).all() for axis in "xyz")
    assert not any(found[name][bad].any() for name in ("n_events", "collisions", "itinerary"))


def test_summaries_are_those_of_all_data_at_once(tmp_path):
    run_sweep(_sweep(), tmp_path)
    told = summary.summarise(tmp_path)
    whole = {name: np.concatenate([c[name] for _, _, c in results(tmp_path)]) for name in (*"xyz", "itinerary")}
    for axis in "xyz":
        assert told["quantiles"][axis] == np.quantile(whole[axis], told["probabilities"], method="lower").tolist()
    assert told["trajectories"] == sum(told["itineraries"].values()) == 1200
    codes, counts = np.unique(whole["itinerary"], return_counts=True)
    expected = {ROD.alphabet.words(code): n for code, n in zip(codes.tolist(), counts.tolist(), strict=True)}
    assert told["itineraries"] == expected
    assert json.loads((tmp_path / "summary.json").read_text()) == told


@pytest.mark.parametrize("gathered", [4_000_000, 50])
def test_streamed_quantiles_are_order_statistics(monkeypatch, gathered):
    monkeypatch.setattr(summary, "_GATHERED", gathered)
    rng = np.random.default_rng(0)
    cases = [rng.normal(size=10001), np.zeros(50), np.array([5.0]), 0.2 + 1e-13 * rng.normal(size=3000),
             np.repeat([1.5, -2.0, 1e-310, -1e300, 1e308], 500), np.array([])]
    for data in cases:
        parts = [{"x": part} for part in np.array_split(data, 7)]
        found = summary.quantiles(lambda first, parts=parts: parts, (0, 0.3, 1))
        ranked = np.sort(data)
        assert found["x"] == [ranked[int(p * (len(ranked) - 1))] for p in (0, 0.3, 1) if data.size]


def test_summaries_want_a_whole_sweep(tmp_path):
    with pytest.raises(InputError, match="there is no sweep in it"):
        summary.summarise(tmp_path)
    run_sweep(_sweep(), tmp_path)
    (tmp_path / "chunk-00000003.npz").unlink()
    with pytest.raises(InputError, match="11 of 12 chunks are there"):
        summary.summarise(tmp_path)


def test_without_itineraries_the_rest_is_the_same(tmp_path):
    run_sweep(_sweep(itineraries="false"), tmp_path / "a")
    run_sweep(_sweep(), tmp_path / "b")
    for (_, _, less), (_, _, more) in zip(results(tmp_path / "a"), results(tmp_path / "b"), strict=True):
        assert set(more) - set(less) == {"collisions", "itinerary"}
        assert all(np.array_equal(less[name], more[name]) for name in less)
    assert summary.summarise(tmp_path / "a")["itineraries"] == {}
    assert "quantile" in sweep_as_text(summary.summarise(tmp_path / "a"))


def test_two_sweeps_into_one_directory_are_refused(tmp_path):
    with locked(tmp_path), pytest.raises(InputError, match=f"process {os.getpid()} on .* is sweeping into it"):
        run_sweep(_sweep(), tmp_path)
    assert run_sweep(_sweep(), tmp_path) == 12


@pytest.mark.parametrize("below", ["", "deep"])
def test_a_file_in_the_place_of_the_directory_is_named(tmp_path, below):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(InputError, match="a file stands in its place"):
        run_sweep(_sweep(), tmp_path / "out" / below)
    assert (tmp_path / "out").read_text() == "mine"


def test_a_lock_left_by_a_dead_process_holds_nobody_up(tmp_path):
    for left in ('{"pid": 999999999, "host": "gone"}', "", "\x00garbage"):
        (tmp_path / ".lock").write_text(left)
        run_sweep(_sweep(count=100), tmp_path)
        assert not (tmp_path / ".lock").exists()


def test_a_directory_of_another_sweep_or_version_is_refused(tmp_path):
    run_sweep(_sweep(), tmp_path)
    with pytest.raises(InputError, match="another sweep"):
        run_sweep(_sweep(count=601), tmp_path)
    manifest = tmp_path / "sweep.json"
    manifest.write_text(manifest.read_text().replace(f'"asympk": "{ap.__version__}"', '"asympk": "0.0.1"'))
    with pytest.raises(InputError, match=r"begun with asympk 0\.0\.1"):
        run_sweep(_sweep(), tmp_path)
    manifest.write_text("{}")
    with pytest.raises(InputError, match="not the manifest"):
        run_sweep(_sweep(), tmp_path)
    manifest.unlink()
    with pytest.raises(InputError, match="chunks or a summary but no"):
        run_sweep(_sweep(), tmp_path)


def test_a_summary_that_is_of_no_sweep_is_not_overwritten(tmp_path):
    (tmp_path / "summary.json").write_text("mine")
    with pytest.raises(InputError, match=r"chunks or a summary but no sweep\.json"):
        run_sweep(_sweep(), tmp_path)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("summary.json", "mine")]


def test_what_a_killed_run_left_half_written_is_swept_up(tmp_path):
    (tmp_path / ".chunk-00000000.npz.0123456789abcdef.part").write_text("half")
    run_sweep(_sweep(), tmp_path)
    assert not [*tmp_path.glob(".*")]


def test_a_worker_of_another_version_is_refused(tmp_path):
    class Elsewhere(Executor):
        def submit(self, function, /, *arguments):
            from concurrent.futures import Future

            story, content = function(*arguments)
            future = Future()
            future.set_result(({**story, "numpy": "1.0"}, content))
            return future

    with pytest.raises(InputError, match=r"a worker has asympk .*, numpy 1\.0"):
        run_sweep(_sweep(), tmp_path, Elsewhere())


GOOD = {"sigma": "1", "mu": "1e-3", "start": "[0, 0, -1]", "until": "5"}


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"mus": "1"}, "the nearest known one is 'mu'"),
        ({"start": "1"}, "list of 3"),
        ({"start": "[0, 0]"}, "list of 3"),
        ({"mu": "{uniform = [1e-3, 1e-2]}"}, "seed and count must be given"),
        ({"count": "5"}, "none is random"),
        ({"mu": "{uniform = [0, 1]}", "seed": "1", "count": "1"}, "mu reaches 0"),
        ({"mu": "{log_uniform = [0, 1]}"}, "log ones be positive"),
        ({"mu": "{uniform = [2, 1]}"}, "must grow"),
        ({"mu": "{grid = [1, 2]}"}, "needs points"),
        ({"mu": "{grid = [1, 2], points = 1}"}, "points = 1"),
        ({"mu": "{grid = [1, 2], log_grid = [1, 2], points = 3}"}, "one of grid"),
        ({"mu": "{uniform = [1, 2], points = 3}"}, "points belong to a grid"),
        ({"mu": "{unifrom = [1, 2]}"}, "the nearest known one is 'uniform'"),
        ({"mu": "[]"}, "from 1 to 100000"),
        ({"mu": "['a']"}, "mu = 'a'"),
        ({"sigma": "[-2, 1]"}, "sigma reaches -2"),
        ({"sigma0": "[0, 2]"}, "below the largest sigma"),
        ({"until": "-1"}, "until reaches -1"),
        ({"mu": "1e-400"}, "mu reaches 1e-400: it must be greater than 0, as a double, too"),
        ({"near": "{x = 0}"}, "near is of one scene"),
        ({"about": "[1]"}, "it must be a string"),
        ({"format": "'csv'"}, "one of npz, parquet"),
        ({"itineraries": "1"}, "true or false"),
        ({"format": "3"}, "format = 3: it must be a string"),
        ({"chunk": "0"}, "chunk = 0"),
        ({"seed": "-1"}, "seed = -1"),
        ({"seed": "true"}, "seed = True"),
        ({"mu": "{uniform = [1, 2]}", "seed": "1", "count": "1000000000000", "sigma": "[1, 2]"}, "at most"),
    ],
)
def test_what_is_not_a_sweep_is_refused_by_name(entries, said):
    with pytest.raises(InputError) as caught:
        parse_sweep("".join(f"{key} = {value}\n" for key, value in {**GOOD, **entries}.items()))
    assert said in str(caught.value)
    assert str(caught.value).count("sweep: ") == 1
