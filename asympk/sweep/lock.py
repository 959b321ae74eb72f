"""One writer per directory: a lock that the operating system releases when its holder dies, in whatever way."""

import json
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from asympk.errors import InputError

NAME = ".lock"


@contextmanager
def locked(directory: str | Path) -> Iterator[None]:
    """Hold the lock of ``directory``, made if missing; raises ``InputError`` while another process holds it.

    A lock file left by a dead process does not lock the directory.
    """
    directory = Path(directory)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{directory}: a file stands in its place; give another directory") from None
    path = directory / NAME
    handle = _take(path)
    try:
        with suppress(OSError):  # on a full disk the lock holds without the name of its holder
            os.ftruncate(handle, 0)
            os.write(handle, json.dumps({"pid": os.getpid(), "host": platform.node()}).encode())
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _take(path):
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(handle)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), os.stat(path)):
                    return handle
        except (BlockingIOError, PermissionError):
            holder = _holder(handle)
            os.close(handle)
            raise InputError(f"{path.parent}: {holder} is sweeping into it; wait, or take another --out") from None
        os.close(handle)  # the holder removed the file between our opening and locking it


def _lock(handle):
    try:
        import fcntl
    except ImportError:
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _holder(handle):
    try:
        owner = json.loads(os.read(handle, 1000))
        return f"process {owner['pid']} on {owner['host']}"
    except (ValueError, KeyError, TypeError, OSError):
        return "another process"
