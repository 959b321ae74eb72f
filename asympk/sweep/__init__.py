r"""Sweeps: more trajectories than fit into memory or into a day, chunk by chunk into a directory.

    DIR/sweep.json          what is swept over, and the versions that do it
    DIR/chunk-00000000.npz  one file per chunk, written whole or not at all
    DIR/summary.json        itineraries, collisions, quantiles of the final state

A run computes the chunks that are missing or damaged and leaves the others alone, so that a run killed at any moment
is resumed by starting it again. What a chunk holds depends on the sweep alone: neither on the executor nor on who
computed it when.
"""

import json
from collections import deque
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, wait
from pathlib import Path

from asympk.errors import InputError, WorkersLost
from asympk.storage.files import write_bytes, write_text
from asympk.sweep import chunks
from asympk.sweep.executors import Here
from asympk.sweep.lock import locked

MANIFEST = "sweep.json"
_AHEAD = 32  # chunks under way at once, whatever the executor
_MOST_LOSSES = 160  # five times all that is under way


def run(sweep, out, executor=None, progress=None):
    """Compute the missing chunks of ``sweep`` into the directory ``out`` and return how many they were.

    ``executor`` is any ``concurrent.futures.Executor``; by default chunks are computed here. ``progress(n, fresh)`` is
    called with the number of trajectories of each chunk, found (``fresh`` false) or done. Raises ``InputError`` when
    ``out`` holds another sweep or is in use, ``WorkersLost`` when workers keep dying.
    """
    out, progress = Path(out), progress or (lambda units, fresh: None)
    with locked(out):
        _sweep_up(out)
        _declare(sweep, out)
        missing = deque(index for index in range(sweep.chunks) if not _kept(sweep, out, index, progress))
        count = len(missing)
        _drive(sweep, out, missing, executor or Here(), progress)
    return count


def _sweep_up(out):
    """Remove what a killed run left half written."""
    for pattern in (".chunk-*", f".{MANIFEST}.*", ".summary.json.*"):
        for path in out.glob(pattern):
            path.unlink()


def manifest(sweep):
    """Return what ``sweep.json`` says."""
    story = chunks.provenance(sweep, 0)
    return {"name": sweep.name, "digest": sweep.digest, "total": sweep.total, "chunks": sweep.chunks,
            "versions": {key: story[key] for key in ("asympk", "numpy")}, "sweep": sweep.described()}  # fmt: skip


def _declare(sweep, out):
    """Write the manifest, or check that the one there is of this sweep and of these versions."""
    path, mine = out / MANIFEST, manifest(sweep)
    if not path.exists():
        if next(out.glob("chunk-*"), None):
            raise InputError(f"{out}: there are chunks but no {MANIFEST}; take another --out")
        write_text(path, json.dumps(mine, indent=1) + "\n")
        return
    try:
        there = json.loads(path.read_text(encoding="utf-8"))
        digest, versions = there["digest"], there["versions"]
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path}: it is not the manifest of a sweep; take another --out") from None
    if digest != mine["digest"]:
        raise InputError(f"{out}: it holds another sweep; take another --out, or the file that it was begun with")
    if versions != mine["versions"]:
        raise InputError(f"{out}: it was begun with {_words(versions)}, this is {_words(mine['versions'])}; results of "
                         "two versions are not mixed")  # fmt: skip


def _words(versions):
    return ", ".join(f"{key} {value}" for key, value in versions.items())


def _kept(sweep, out, index, progress):
    """Tell whether the file of a chunk is there and whole."""
    path = out / chunks.name(sweep, index)
    if not path.exists():
        return False
    start, stop = sweep.rows(index)
    try:
        story, columns = chunks.read(path)
    except InputError:
        return False
    if story != chunks.provenance(sweep, index) or any(len(values) != stop - start for values in columns.values()):
        return False
    progress(stop - start, False)
    return True


def _drive(sweep, out, missing, executor, progress):
    """Keep some chunks under way until all are written; a chunk whose worker died is given out again."""
    under_way, losses = {}, 0
    ahead = 1 if isinstance(executor, Here) else _AHEAD
    try:
        while missing or under_way:
            while missing and len(under_way) < ahead:
                index = missing.popleft()
                under_way[_given_out(executor, sweep, index)] = index
            done, _ = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                index = under_way.pop(future)
                if _lost(future):
                    losses += 1
                    if losses > _MOST_LOSSES:
                        raise WorkersLost(_short_of_workers(index))
                    missing.appendleft(index)
                    continue
                losses = 0
                _write(sweep, out, index, *future.result())
                start, stop = sweep.rows(index)
                progress(stop - start, True)
    finally:
        for future in under_way:
            future.cancel()


def _lost(future):
    """Tell whether the worker is to blame and not the work; a cluster names that error in its own class."""
    if future.cancelled():
        return True
    error = future.exception()
    return isinstance(error, BrokenExecutor | CancelledError) or type(error).__name__ == "KilledWorker"


def _given_out(executor, sweep, index):
    try:
        return executor.submit(chunks.compute, sweep, index)
    except BrokenExecutor:
        raise WorkersLost(_short_of_workers(index)) from None


def _short_of_workers(index):
    return f"workers keep dying, last at chunk {index}: is memory short? All that is done is kept; run again to resume"


def _write(sweep, out, index, story, content):
    mine = chunks.provenance(sweep, index)
    if story != mine:
        theirs, ours = ({key: told.get(key) for key in ("asympk", "numpy")} for told in (story, mine))
        raise InputError(f"a worker has {_words(theirs)}, this process has {_words(ours)}: install the same")
    write_bytes(out / chunks.name(sweep, index), content)


def results(out, only=None):
    """Yield (file name, provenance, {name: array}) of the chunks in ``out``, one at a time, or ``only`` some arrays.

    Raises ``InputError`` for a directory without a sweep, one that is not complete, or a damaged chunk.
    """
    for path in files(out):
        yield (path.name, *chunks.read(path, only))


def files(out):
    """Return the paths of all chunks of the sweep in ``out``; raises ``InputError`` when it is not complete."""
    out = Path(out)
    try:
        told = json.loads((out / MANIFEST).read_text(encoding="utf-8"))
        wanted, suffix = told["chunks"], told["sweep"]["format"]
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(f"{out}: there is no sweep in it (no readable {MANIFEST})") from None
    found = sorted(out.glob(f"chunk-*.{suffix}"))
    if len(found) != wanted:
        raise InputError(f"{out}: {len(found)} of {wanted} chunks are there; run its sweep again to complete it")
    return found
