"""Chunks of a sweep: computed by any worker, stored as bytes that depend on the sweep and its versions, and checked.

A chunk has a column for every final state, for the numbers of events and of collisions (``velocity_zero``), for the
itinerary as a number (``itineraries.Alphabet``), and for the outcome. The outcome is 0, or the index in
``many.OUTCOMES`` of the reason why a trajectory has no result; its states are then NaN and its other columns 0.
``compute`` makes a chunk, and ``read_chunk`` refuses a damaged one.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asympk import __version__
from asympk.errors import InputError, MissingPackage
from asympk.many import OUTCOMES
from asympk.numbers import short
from asympk.sweep import stored
from asympk.sweep.sweepfile import Family, Sweep

_NAME = re.compile(r"chunk-(\d{8,15})\.(?:npz|parquet)", re.ASCII)


def chunk_provenance(sweep: Sweep, index: int) -> dict[str, Any]:
    """Return the provenance of a chunk: its sweep, its trajectories, and the versions that compute it."""
    start, stop = sweep.rows(index)
    return {"sweep": sweep.digest, "chunk": index, "start": start, "stop": stop, "asympk": __version__,
            "numpy": np.__version__}


def compute(sweep: Sweep, index: int) -> tuple[dict[str, Any], bytes]:
    """Follow the trajectories of one chunk and return the chunk as (provenance, bytes of its file)."""
    written = chunk_provenance(sweep, index)
    start, stop = sweep.rows(index)
    columns = chunk_columns(sweep.family, sweep.quantities(start, stop), stop - start, sweep.itineraries)
    return written, stored.content(columns, written, sweep.format)


def chunk_columns(
    family: Family, columns: Mapping[str, Any], size: int, itineraries: bool = True
) -> dict[str, np.ndarray]:
    """Follow ``size`` trajectories of a family from {field: number or array} and return their columns {name: array}."""
    found = family.follow(columns, size, itineraries)
    made = {**dict(zip(family.states, found.final, strict=True)), "n_events": found.n_events, "outcome": found.outcome}
    if itineraries:
        made["collisions"], made["itinerary"] = _coded(family.alphabet, found)
    return {name: made[name].astype(kind) for name, kind in _kinds(family, itineraries).items()}


def _kinds(family, itineraries):
    kinds = {**dict.fromkeys(family.states, "<f8"), "n_events": "<u2", "outcome": "u1"}
    return {**kinds, "collisions": "<u2", "itinerary": "<u8"} if itineraries else kinds


def _coded(alphabet, found):
    """Return the number of collisions, and the itinerary as a number, 0 where the outcome is not 0."""
    count = found.n_events
    trajectory = np.repeat(np.arange(count.size), count)
    hits = np.bincount(trajectory[found.kind == "velocity_zero"], minlength=count.size)
    return hits, np.where(found.outcome == 0, alphabet.codes(found.first, count, found.kind, found.friction), 0)


def file_name(sweep: Sweep, index: int) -> str:
    """Return the file name of a chunk."""
    return f"chunk-{index:08d}.{sweep.format}"


def index_of(file: str) -> int | None:
    """Return the index of the chunk whose file has this name, None for another file."""
    found = _NAME.fullmatch(file)
    return int(found[1]) if found else None


def read_chunk(
    sweep: Sweep, path: str | Path, only: Iterable[str] | None = None
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return (provenance, {name: array}) of a chunk's file, all or ``only`` some; raises ``InputError`` if damaged."""
    path = Path(path)
    try:
        written, columns = stored.load_arrays(path)
        _check(sweep, written, columns)
    except MissingPackage:
        raise
    except Exception as reason:  # a damaged archive makes its reader fail in any way
        raise InputError(f"{path}: the chunk is damaged ({short(str(reason))}); run its sweep again") from None
    return written, columns if only is None else {name: columns[name] for name in only}


def _check(sweep, written, columns):
    """Raise an error unless a chunk has its columns and no others, of the right kinds and lengths, with valid codes."""
    expected = _kinds(sweep.family, sweep.itineraries)
    if {name: values.dtype for name, values in columns.items()} != {k: np.dtype(v) for k, v in expected.items()}:
        raise ValueError(f"its columns are {', '.join(columns)}")
    if any(values.shape != (written["stop"] - written["start"],) for values in columns.values()):
        raise ValueError("its columns are not as long as it says")
    if (columns["outcome"] >= len(OUTCOMES)).any():
        raise ValueError("an outcome does not exist")
    if sweep.itineraries:
        for code in np.unique(columns["itinerary"][columns["outcome"] == 0]):
            sweep.family.alphabet.words(code)
