"""Writing files so that a reader never finds a partly written one."""

import csv
import io
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from asympk.errors import InputError
from asympk.numbers import short


def named_file(file: Any) -> Path:
    """Return the ``Path`` of a file's name; raises ``InputError`` for anything that is not a name."""
    try:
        if b"\0" not in os.fsencode(path := Path(file)):
            return path
    except (TypeError, UnicodeEncodeError):  # lone surrogates, which no system spells
        pass
    raise InputError(f"file = {short(file)}: it must be the name of a file")


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Return rows of cells as CSV."""
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    return buffer.getvalue()


def write_text(path: str | Path, text: str) -> Path:
    """Write ``text`` to ``path`` as UTF-8; see ``write_bytes``."""
    return write_bytes(path, text.encode("utf-8"))


def read_bytes(path: Path, most: int) -> bytes:
    """Return the first ``most`` bytes of a file or a pipe, all if there are fewer; an ``OSError`` names the file."""
    try:
        with os.fdopen(_opened(path, os.O_RDONLY), "rb") as stream:
            return stream.read(most)
    except OSError as reason:
        raise OSError(reason.errno, reason.strerror, str(path)) from None


def write_bytes(path: str | Path, content: bytes) -> Path:
    """Write ``content`` to ``path``, making directories, and return the path.

    A regular file, or the target of a link, is replaced by a complete new file. A terminal, a pipe or a device such as
    /dev/null is written to directly. Raises ``InputError`` for a directory, and any ``OSError`` of the system.
    """
    path = named_file(path)
    if path.is_dir():
        raise InputError(f"{path}: it is a directory; give the name of a file")
    try:
        if path.exists() and not path.is_file():
            with os.fdopen(_opened(path, os.O_WRONLY), "wb") as stream:
                stream.write(content)
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            _replace(Path(os.path.realpath(path)), content)
    except OSError as reason:  # which names the temporary file
        raise OSError(reason.errno, reason.strerror or str(reason), str(path)) from None
    return path


def _replace(path, content):
    """Write a temporary file next to ``path`` and rename it to ``path``; an interruption removes the temporary file."""
    temporary = path.with_name(f".{path.name}.{os.urandom(8).hex()}.part")
    try:
        with open(temporary, "xb") as stream:
            stream.write(content)
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _opened(path, access):
    """Open a file, a pipe or a device; a pipe without another end is empty, or raises an error, but does not block."""
    handle = os.open(path, access | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    os.set_blocking(handle, True)
    return handle
