"""The bytes of a chunk's file: written, and read back only if the file is undamaged.

The bytes of a .npz file depend on its arrays and its provenance alone, so a file is undamaged exactly if writing its
contents again gives the same bytes. A Parquet file has page checksums, which leave out the headers of its pages, and
therefore a digest of its columns beside the provenance. Ctrl-C waits until an archive is complete, since an
interrupted archive raises a second error when it is closed.
"""

import hashlib
import io
import json
import signal
import threading
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from asympk.errors import MissingPackage

_EPOCH = (1980, 1, 1, 0, 0, 0)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Defer Ctrl-C until the block is done; other threads than the main one never receive Ctrl-C."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) is None:
        yield
        return
    heard: list[tuple[Any, ...]] = []
    before = signal.signal(signal.SIGINT, lambda *signalled: heard.append(signalled))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if heard and callable(before):
            before(*heard[0])


@uninterrupted()
def content(columns: Mapping[str, np.ndarray], provenance: Mapping[str, Any], kind: str) -> bytes:
    """Return {name: array} and their provenance as the bytes of a file of the format ``kind``."""
    return (_as_npz if kind == "npz" else _as_parquet)(columns, provenance)


@uninterrupted()
def load_arrays(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return (provenance, {name: array}) of a file; a damaged file may raise any error."""
    if not path.is_file():
        raise ValueError("it is not a regular file")
    return (_load_npz if path.suffix == ".npz" else _load_parquet)(path.read_bytes())


def _as_npz(columns, provenance):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for key, values in {**columns, "provenance": np.array(json.dumps(provenance, sort_keys=True))}.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, values, version=(1, 0), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{key}.npy", _EPOCH), entry.getbuffer())
    return buffer.getvalue()


def _load_npz(raw):
    with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
        columns = {key: archive[key] for key in archive.files}
    provenance = json.loads(str(columns.pop("provenance")))
    if _as_npz(columns, provenance) != raw:
        raise ValueError("its contents do not give its bytes again")
    return provenance, columns


def _as_parquet(columns, provenance):
    pyarrow, parquet = _pyarrow()
    said = {"asympk": json.dumps(provenance, sort_keys=True), "sha256": _digest(columns)}
    table = pyarrow.table(columns).replace_schema_metadata(said)
    sink = pyarrow.BufferOutputStream()
    parquet.write_table(table, sink, compression="none", write_page_checksum=True)
    return sink.getvalue().to_pybytes()


def _load_parquet(raw):
    pyarrow, parquet = _pyarrow()
    table = parquet.read_table(pyarrow.BufferReader(raw), page_checksum_verification=True)
    columns = {key: table[key].to_numpy() for key in table.column_names}
    if table.schema.metadata[b"sha256"].decode() != _digest(columns):
        raise ValueError("its columns do not have the digest in its metadata")
    return json.loads(table.schema.metadata[b"asympk"]), columns


def _digest(columns):
    found = hashlib.sha256()
    for name, values in columns.items():
        found.update(f"{name} {values.dtype.str} {values.shape}".encode())
        found.update(np.ascontiguousarray(values).tobytes())
    return found.hexdigest()


def _pyarrow():
    try:
        import pyarrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise MissingPackage("Parquet needs pyarrow: pip install 'asympk[sweep]', or take format = \"npz\"") from None
    return pyarrow, parquet
