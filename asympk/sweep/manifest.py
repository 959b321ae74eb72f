"""``sweep.json``, the manifest of a directory of chunks: the sweep and its versions; an inconsistent one is refused."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asympk.errors import AsympkError, InputError
from asympk.sweep import chunks
from asympk.sweep.sweepfile import from_description

if TYPE_CHECKING:
    from asympk.sweep.sweepfile import Sweep

LARGEST = 100_000_000  # bytes: seven grids of 10^5 exact values
VERSIONS = ("asympk", "numpy")


def manifest_of(sweep: "Sweep") -> dict[str, Any]:
    """Return the contents of ``sweep.json`` for a sweep that begins with the present versions."""
    written = chunks.chunk_provenance(sweep, 0)
    return {"name": sweep.name, "digest": sweep.digest, "total": sweep.total, "chunks": sweep.chunks,
            "versions": {key: written[key] for key in VERSIONS}, "sweep": sweep.described()}  # fmt: skip


def read_manifest_file(path: Path) -> "tuple[Sweep, dict[str, Any]]":
    """Return (the ``Sweep``, the contents of the file); raises ``InputError`` if the file is missing or damaged."""
    if not path.is_file():
        raise InputError(f"{path.parent}: there is no sweep in it (no readable {path.name})")
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError("too long")
        manifest = json.loads(path.read_text(encoding="utf-8"))
        sweep = from_description(manifest["sweep"])
        versions = {key: manifest["versions"][key] for key in VERSIONS}
        mine = {**manifest_of(sweep), "name": manifest["name"], "versions": versions}
        if manifest != mine or not all(isinstance(value, str) for value in manifest["versions"].values()):
            raise ValueError("it does not fit together")
    except (ValueError, LookupError, TypeError, ArithmeticError, AttributeError, RecursionError, AsympkError):
        raise InputError(f"{path}: it is not the manifest of a sweep, or damaged; restore it, or take another "
                         "--out") from None  # fmt: skip
    return sweep, manifest
