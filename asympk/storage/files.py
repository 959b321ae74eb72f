"""Writing files so that a reader never meets half of one."""

import os
import tempfile
from pathlib import Path


def write_text(path, text):
    """Write ``text`` to ``path`` as UTF-8; see ``write_bytes``."""
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path, content):
    """Write ``content`` to ``path`` through a temporary file beside it, making directories; return the path."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
    return path


def _umask():
    current = os.umask(0)
    os.umask(current)
    return current
