"""Whatever happens to the files of a sweep, it ends in the same values or in one line."""

import errno
import json
import os
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from sweeptext import parse_sweep

from asympk.errors import AsympkError, InputError
from asympk.many import OUTCOMES
from asympk.sweep import MANIFEST, chunks, files, results, run_sweep, stored
from asympk.sweep.directory import _drive
from asympk.sweep.executors import InProcess
from asympk.sweep.summary import summarise

SWEEP = parse_sweep("""
seed = 3
count = 6
chunk = 2
sigma = 1
mu = 1e-3
start = [{ uniform = [-1, 1] }, 0.2, -1]
until = 2
""")
FLIPS = 60  # of every file, at fixed places


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("whole")
    run_sweep(SWEEP, out)
    summarise(out)
    return out


@pytest.fixture
def copy(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "copy")


def _values(out):
    return {name: {key: v.tolist() for key, v in columns.items()} for name, _, columns in results(out)}


def _told(job, out):
    try:
        return job(out)
    except AsympkError as refusal:
        return "refused" if "\n" not in str(refusal) else refusal


@pytest.mark.parametrize("file", [MANIFEST, "summary.json", chunks.file_name(SWEEP, 0), *(
    pytest.param(chunks.file_name(SWEEP, k), marks=pytest.mark.slow) for k in (1, 2))])
@pytest.mark.few(0)
def test_a_flipped_bit_is_an_error_in_a_line_or_changes_nothing(whole, copy, file):
    expected, path = _values(whole), copy / file
    kept = path.read_bytes()
    for bit in np.linspace(0, 8 * len(kept) - 1, FLIPS).astype(int):
        flipped = bytearray(kept)
        flipped[bit // 8] ^= 1 << bit % 8
        path.write_bytes(flipped)
        assert _told(_values, copy) in (expected, "refused")
        _told(lambda out: run_sweep(SWEEP, out), copy)
        if file != MANIFEST:
            assert _values(copy) == expected
        path.write_bytes(kept)


def test_a_full_disk_does_not_stop_a_sweep_that_has_nothing_to_write(copy, monkeypatch):
    def full(handle, text):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    assert run_sweep(SWEEP, copy) == 0


def _changed(path, **columns):
    story, found = chunks.read_chunk(SWEEP, path)
    return stored.content({key: v for key, v in {**found, **columns}.items() if v is not None}, story, "npz")


@pytest.mark.parametrize(
    "columns",
    [{"x": np.float64(1)}, {"x": None}, {"more": np.zeros(2)}, {"x": np.zeros(2, "f4")}, {"x": np.zeros(3)},
     {"x": np.zeros(1)}, {"outcome": np.full(2, len(OUTCOMES), "u1")}, {"itinerary": np.zeros(2, "u8")},
     {"x": np.array(["a", "b"])}],
    ids=["0-d", "missing", "extra", "short floats", "too long", "too short", "outcome", "itinerary", "words"],
)
def test_a_chunk_of_other_columns_is_computed_again(whole, copy, columns):
    path = copy / chunks.file_name(SWEEP, 1)
    path.write_bytes(_changed(path, **columns))
    with pytest.raises(InputError, match="the chunk is damaged"):
        chunks.read_chunk(SWEEP, path)
    assert run_sweep(SWEEP, copy) == 1
    assert _values(copy) == _values(whole)


def test_a_pipe_or_a_directory_in_the_place_of_a_chunk_is_set_aside(whole, copy):
    pipe, folder = (copy / chunks.file_name(SWEEP, k) for k in (0, 2))
    pipe.unlink()
    folder.unlink()
    os.mkfifo(pipe)
    folder.mkdir()
    assert run_sweep(SWEEP, copy) == 2
    assert _values(copy) == _values(whole)
    assert pipe.with_name(f"{pipe.name}.damaged").is_fifo()
    assert folder.with_name(f"{folder.name}.damaged").is_dir()


@pytest.mark.parametrize(
    "change",
    [lambda told: "[" * 200_000, lambda told: json.dumps({**told, "versions": 3}),
     lambda told: json.dumps({**told, "versions": {"asympk": 1, "numpy": 2}}),
     lambda told: json.dumps({**told, "chunks": 10**30}), lambda told: json.dumps({**told, "chunks": "many"}),
     lambda told: json.dumps({**told, "sweep": {**told["sweep"], "format": "../*"}}), lambda told: "3",
     lambda told: json.dumps({**told, "sweep": {**told["sweep"], "axes": {"mu": ["values", "9**9**9"]}}})],
    ids=["deep", "versions", "numbers", "chunks", "words", "format", "3", "formula"],
)
def test_a_damaged_manifest_is_refused_in_a_line(copy, change):
    path = copy / MANIFEST
    path.write_text(change(json.loads(path.read_text())))
    for job in (_values, files, summarise, lambda out: run_sweep(SWEEP, out)):
        with pytest.raises(InputError, match="not the manifest of a sweep, or damaged"):
            job(copy)


def test_a_pipe_in_the_place_of_the_manifest_is_refused(copy):
    (copy / MANIFEST).unlink()
    os.mkfifo(copy / MANIFEST)
    for job in (_values, lambda out: run_sweep(SWEEP, out)):
        with pytest.raises(InputError, match="there is no sweep in it"):
            job(copy)


def test_a_chunk_too_many_is_named(copy):
    shutil.copy(copy / chunks.file_name(SWEEP, 0), copy / "chunk-00000007.npz")
    with pytest.raises(InputError, match=r"chunk-00000007.npz: this sweep has 3 chunks, .* move it away"):
        summarise(copy)


def test_a_chunk_in_the_place_of_another_is_computed_again(whole, copy):
    shutil.copy(copy / chunks.file_name(SWEEP, 0), copy / chunks.file_name(SWEEP, 1))
    with pytest.raises(InputError, match="not of this sweep"):
        _values(copy)
    assert run_sweep(SWEEP, copy) == 1
    assert _values(copy) == _values(whole)


def test_the_users_own_dot_files_stay(copy):
    own = [copy / name for name in (".notes", ".chunk-notes", ".sweep.json.swp", ".chunk-00000001", ".gitignore")]
    for path in own:
        path.write_text("mine")
    ours = copy / f".{MANIFEST}.0123456789abcdef.part"
    ours.write_text("half")
    run_sweep(SWEEP, copy)
    assert all(path.read_text() == "mine" for path in own)
    assert not ours.exists()


def test_the_chunks_of_a_huge_sweep_are_counted_one_at_a_time(tmp_path, monkeypatch):
    huge, taken = iter(range(10**11)), []
    monkeypatch.setattr("asympk.sweep.directory._write", lambda sweep, out, index, *_: taken.append(index))
    monkeypatch.setattr(chunks, "compute", lambda sweep, index: (None, b""))

    def progress(units, fresh):
        if len(taken) == 5:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        _drive(SimpleNamespace(rows=lambda index: (index, index + 1)), tmp_path, huge, InProcess(), progress)
    assert taken == [0, 1, 2, 3, 4]
    assert next(huge) == 5
