"""Copy the pages of a site to its directory, and remove pages of an earlier report that the site no longer has."""

import json
import shutil
from contextlib import suppress
from hashlib import sha256
from pathlib import Path, PurePosixPath

from asympk.errors import InputError
from asympk.storage.files import write_text

LIST = ".asympk-report.json"  # {file: SHA-256 of what was written}


def publish(pages: Path, out: Path) -> None:
    """Copy the files under ``pages`` to ``out``, and remove the files of an earlier report that are not among them.

    The file ``LIST`` in ``out`` names the files of the last report. A file that it does not name, or that has changed
    since, is left alone. Raises ``InputError`` where ``LIST`` is not a list of files in ``out``.
    """
    before = _listed(out / LIST)
    written = {file.relative_to(pages).as_posix(): _digest(file) for file in sorted(pages.rglob("*")) if file.is_file()}
    shutil.copytree(pages, out, dirs_exist_ok=True)
    write_text(out / LIST, json.dumps(written, indent=0) + "\n")
    for name in before.keys() - written.keys():
        file = out / name
        if file.is_file() and _digest(file) == before[name]:
            file.unlink()
            folder = file.parent
            while folder != out and not any(folder.iterdir()):
                folder.rmdir()
                folder = folder.parent


def _listed(file: Path) -> dict[str, str]:
    if not file.is_file():
        return {}
    with suppress(ValueError):
        found = json.loads(file.read_text(encoding="utf-8"))
        if isinstance(found, dict) and all(map(_within, found)):
            return found
    raise InputError(f"{file} is no list of a report's files in its directory; remove it, and the old pages")


def _within(name: str) -> bool:
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts


def _digest(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()
