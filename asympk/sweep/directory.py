r"""The directory of a sweep: which chunks it holds, and how the missing ones are computed.

    DIR/sweep.json          the sweep, and the versions that compute it
    DIR/chunk-00000000.npz  one file per chunk, written whole or not at all
    DIR/summary.json        itineraries, collisions, quantiles of the final state

A run computes the chunks that are missing or damaged and leaves the others alone, so that a run killed at any moment
is resumed by starting it again. The contents of a chunk depend on the sweep alone, and neither on the executor nor on
the time. ``_drive``, the hard function, keeps chunks under way and submits those of dead workers again.
"""

import itertools
import json
import os
import re
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, wait
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from asympk.errors import AsympkError, InputError, WorkersLost
from asympk.numbers import require_callback
from asympk.storage.files import named_file, write_bytes, write_text
from asympk.sweep import chunks
from asympk.sweep.executors import InProcess
from asympk.sweep.lock import locked
from asympk.sweep.sweepfile import Sweep, from_description

MANIFEST, SUMMARY = "sweep.json", "summary.json"
LARGEST = 100_000_000  # bytes of the manifest: seven grids of 10^5 exact values
VERSIONS = ("asympk", "numpy")
_UNFINISHED = re.compile(r"\.(chunk-\d{8,}\.(npz|parquet)|sweep\.json|summary\.json)\.[0-9a-f]{16}\.part", re.ASCII)
_AHEAD = 32  # chunks submitted at once to an executor other than this process
_MOST_LOSSES = 160  # dead workers while no chunk is finished: five times _AHEAD


def run_sweep(
    sweep: Sweep, out: str | Path, executor: Executor | None = None, progress: Callable[[int, bool], None] | None = None
) -> int:
    """Compute the missing or damaged chunks of ``sweep`` into the directory ``out`` and return their number.

    ``executor`` is any ``concurrent.futures.Executor``; by default chunks are computed in this process.
    ``progress(n, fresh)`` is called once for each chunk: n is its number of trajectories, and ``fresh`` is false for a
    chunk that was there already. Raises ``InputError`` if ``out`` holds another sweep, is damaged or in use, and
    ``WorkersLost`` if workers keep dying.
    """
    if not isinstance(sweep, Sweep):
        raise InputError(f"run_sweep takes a Sweep, not {type(sweep).__name__}; read one with read_sweep")
    require_callback("progress", progress)
    out, progress = named_file(out), progress or (lambda units, fresh: None)
    with locked(out):
        _sweep_up(out)
        _declare(sweep, out)
        missing = (index for index in range(sweep.chunks) if not _kept(sweep, out, index, progress))
        return _drive(sweep, out, missing, executor or InProcess(), progress)


def _sweep_up(out):
    """Remove the half-written files that a killed run left, and no others."""
    for path in out.glob(".*"):
        if _UNFINISHED.fullmatch(path.name) and path.is_file():
            path.unlink()


def _declare(sweep, out):
    """Write the manifest, or raise ``InputError`` if the existing manifest is of another sweep or of other versions."""
    path, mine = out / MANIFEST, _manifest_of(sweep)
    if not os.path.lexists(path):
        if next(out.glob("chunk-*"), None) or os.path.lexists(out / SUMMARY):
            raise InputError(f"{out}: there are chunks or a summary but no {MANIFEST}; take another --out")
        write_text(path, json.dumps(mine, indent=1) + "\n")
        return
    _, there = read_manifest(out)
    if there["digest"] != mine["digest"]:
        raise InputError(f"{out}: it holds another sweep; take another --out, or the file that it was begun with")
    if there["versions"] != mine["versions"]:
        raise InputError(f"{out}: it was begun with {_words(there['versions'])}, this is {_words(mine['versions'])}; "
                         "results of two versions are not mixed")


def _manifest_of(sweep):
    """Return the contents of ``sweep.json`` for a sweep that begins with the present versions."""
    written = chunks.chunk_provenance(sweep, 0)
    return {"name": sweep.name, "digest": sweep.digest, "total": sweep.total, "chunks": sweep.chunks,
            "versions": {key: written[key] for key in VERSIONS}, "sweep": sweep.described()}


def _words(versions):
    return ", ".join(f"{key} {value}" for key, value in versions.items())


def _kept(sweep, out, index, progress):
    """Tell whether the file of a chunk is there and whole; a directory or the like in its place is renamed."""
    path, whole = out / chunks.file_name(sweep, index), False
    with suppress(InputError):
        whole = chunks.read_chunk(sweep, path)[0] == chunks.chunk_provenance(sweep, index)
    if whole:
        start, stop = sweep.rows(index)
        progress(stop - start, False)
    elif os.path.lexists(path) and not path.is_file():
        aside = (path.with_name(f"{path.name}.damaged{k or ''}") for k in itertools.count())
        path.rename(next(name for name in aside if not os.path.lexists(name)))
    return whole


def _drive(sweep, out, missing, executor, progress):
    """Keep chunks under way until all are written, and return their number; chunks of dead workers are repeated."""
    under_way, again, losses, done = {}, deque(), 0, 0
    ahead = 1 if isinstance(executor, InProcess) else _AHEAD
    try:
        while True:
            while len(under_way) < ahead and (index := again.popleft() if again else next(missing, None)) is not None:
                under_way[_given_out(executor, sweep, index)] = index
            if not under_way:
                return done
            for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                index = under_way.pop(future)
                if _lost(future):
                    losses += 1
                    if losses > _MOST_LOSSES:
                        raise WorkersLost(_short_of_workers(index))
                    again.append(index)
                    continue
                losses, done = 0, done + 1
                _write(sweep, out, index, *future.result())
                start, stop = sweep.rows(index)
                progress(stop - start, True)
    finally:
        for future in under_way:
            future.cancel()


def _lost(future):
    """Tell whether a chunk was lost with its worker, not by its own error.

    The executor of dask raises various errors of its own where a worker dies: ``KilledWorker``, or a ``ValueError``
    where the result was gathered just before. They are known by the module that raises them.
    """
    if future.cancelled():
        return True
    error = future.exception()
    frames = [frame for frame, _ in traceback.walk_tb(error and error.__traceback__)]
    within = frames[-1].f_globals.get("__name__") if frames else None
    return isinstance(error, BrokenExecutor | CancelledError) or within == "distributed.cfexecutor"


def _given_out(executor, sweep, index):
    try:
        return executor.submit(chunks.compute, sweep, index)
    except BrokenExecutor:
        raise WorkersLost(_short_of_workers(index)) from None


def _short_of_workers(index):
    return f"workers keep dying, last at chunk {index}: is memory short? All that is done is kept; run again to resume"


def _write(sweep, out, index, written, content):
    mine = chunks.chunk_provenance(sweep, index)
    if written != mine:
        theirs, ours = ({key: provenance.get(key) for key in VERSIONS} for provenance in (written, mine))
        raise InputError(f"a worker has {_words(theirs)}, this process has {_words(ours)}: install the same")
    write_bytes(out / chunks.file_name(sweep, index), content)


def results(
    out: str | Path, only: Iterable[str] | None = None
) -> Iterator[tuple[str, dict[str, Any], dict[str, np.ndarray]]]:
    """Yield (file name, provenance, {name: array}) of each chunk in ``out``, all arrays or ``only`` some.

    Raises ``InputError`` for a directory without a sweep, one that is not complete, or a damaged chunk.
    """
    sweep, manifest = read_manifest(out)
    for index, path in enumerate(files(out)):
        written, columns = chunks.read_chunk(sweep, path, only)
        if written != {**chunks.chunk_provenance(sweep, index), **manifest["versions"]}:
            raise InputError(f"{path}: it is not of this sweep; run the sweep again to replace it")
        yield path.name, written, columns


def read_manifest(out: str | Path) -> tuple[Sweep, dict[str, Any]]:
    """Return (the ``Sweep`` in ``out``, the contents of its manifest); raises ``InputError`` unless there is one."""
    path = Path(out) / MANIFEST
    if not path.is_file():
        raise InputError(f"{path.parent}: there is no sweep in it (no readable {path.name})")
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError("too long")
        manifest = json.loads(path.read_text(encoding="utf-8"))
        sweep = from_description(manifest["sweep"])
        versions = {key: manifest["versions"][key] for key in VERSIONS}
        mine = {**_manifest_of(sweep), "name": manifest["name"], "versions": versions}
        if manifest != mine or not all(isinstance(value, str) for value in manifest["versions"].values()):
            raise ValueError("it does not fit together")
    except (ValueError, LookupError, TypeError, ArithmeticError, AttributeError, RecursionError, AsympkError):
        raise InputError(f"{path}: it is not the manifest of a sweep, or damaged; restore it, or take another "
                         "--out") from None
    return sweep, manifest


def files(out: str | Path) -> list[Path]:
    """Return the paths of all chunks of the sweep in ``out``, in order; raises ``InputError`` unless all are there."""
    out = Path(out)
    sweep, _ = read_manifest(out)
    found = {chunks.index_of(path.name): path for path in out.glob(f"chunk-*.{sweep.format}")}
    for index, path in found.items():
        if index is None or index >= sweep.chunks:
            raise InputError(f"{path}: this sweep has {sweep.chunks} chunks, and this is none of them; move it away")
    if len(found) != sweep.chunks:
        raise InputError(f"{out}: {len(found)} of {sweep.chunks} chunks are there; run its sweep again to complete it")
    return [found[index] for index in range(sweep.chunks)]
