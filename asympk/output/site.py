"""The site of ``asympk report``: the pages of ``docs/``, and pages made from objects and rows, set by Sphinx.

Its pages can be read without a network and without scripts. The same checkout makes the same bytes.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import Future, as_completed
from contextlib import suppress
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path, PurePosixPath

from asympk.errors import InputError, MissingPackage
from asympk.output.arrow import arrow_drawing, parts_in_order
from asympk.output.article import write_article
from asympk.output.paper import draw_pictures
from asympk.output.regenerate import project, silent
from asympk.output.systempages import write_index, write_page
from asympk.pictures.figures import save
from asympk.pictures.sketches import SKETCHES
from asympk.storage.files import write_text
from asympk.sweep.executors import executor

LIST = ".asympk-report.json"  # {file: SHA-256 of what was written}
NEEDED = ("sphinx", "myst_parser", "sphinx_gallery", "furo", "pypandoc", "matplotlib")
FIXED = {"SOURCE_DATE_EPOCH": "0", "PYTHONHASHSEED": "0"}
_HEAD = re.compile(r"^# %% ?(.+)\n", re.MULTILINE)
_MARKS = re.compile(r"([|*\\]|(?<=\w)_(?=\W))")
_COMMENT = re.compile(r"^# (?!%%).*", re.MULTILINE)


def build_site(root: str | Path, out: str | Path, tell: Callable[[str], None] = silent) -> Path:
    """Write the site of the checkout ``root`` into the directory ``out``; return its first page.

    Pages of an earlier report that the site no longer has are removed; other files are left alone. Raises
    ``MissingPackage`` without the extra ``site``, and ``InputError`` where there is no checkout, where ``out`` is a
    file, or where Sphinx warns of anything, such as a link without a target.
    """
    checkout = project(root)
    if missing := [name for name in NEEDED if not find_spec(name)]:
        raise MissingPackage(f"the site needs {missing[0]}: pip install 'asympk[site]'")
    if Path(out).exists() and not Path(out).is_dir():
        raise InputError(f"{out} is a file; give a directory for the site")
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        write_sources(checkout, source, tell)
        tell("setting the pages")
        pages = Path(folder) / "pages"
        set_pages(source, pages, Path(folder) / "doctrees")
        publish(pages, Path(out))
    return Path(out) / "index.html"


def write_sources(root: Path, source: Path, tell: Callable[[str], None]) -> None:
    """Write the input of Sphinx: the pages of ``docs/``, and pages made from scripts, the paper and the catalogue.

    Each system is a task of its own, and the article's pictures are another; the tasks run on all cores.
    """
    shutil.copytree(root / "docs", source)
    write_scripts(root, source / "gallery-source")
    write_arrow(root, source)
    article, systems = source / "article", source / "systems"
    names = write_article(root, article, source / "article.lua")
    write_index(systems)
    with executor(os.cpu_count()) as pool:
        tasks: dict[Future, str] = {pool.submit(draw_pictures, root, names, article): "the pictures of the article"}
        tasks |= {pool.submit(write_page, name, systems): name for name in reversed(SKETCHES)}
        for task in as_completed(tasks):
            task.result()
            tell(f"{tasks[task]} done")


def set_pages(source: Path, out: Path, doctrees: Path) -> None:
    """Run Sphinx from ``source`` into ``out``; raises ``InputError`` with the first warning or error of Sphinx."""
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", doctrees, source, out.resolve()]
    run = subprocess.run(list(map(str, command)), cwd=source, env={**os.environ, **FIXED}, capture_output=True,
                         text=True, errors="replace")
    if run.returncode:
        complaints = [line for line in run.stderr.splitlines() if line.strip()] or ["it says nothing"]
        raise InputError(f"the site does not build: {complaints[0].replace(f'{source.resolve()}/', '')}")


def write_arrow(root: Path, source: Path) -> None:
    """Write the parts of the package as a table, and the drawing of the imports between them."""
    parts = parts_in_order(root)
    rows = "\n".join(f"| `{part}` | {what} |" for part, what in parts.items())
    write_text(source / "arrow-parts.md", f"| under `asympk/` | |\n|---|---|\n{rows}\n")
    save(arrow_drawing(list(parts)), source / "arrow.svg")


def write_scripts(root: Path, out: Path) -> None:
    """Write the derivations as scripts of sphinx-gallery with their stored results, or raise ``InputError``."""
    write_text(out / "GALLERY_HEADER.rst", "Derivations\n===========\n\nThe scripts of ``derivations/`` with what they "
               "derive; ``asympk derive`` runs them.\n\n")
    for script in sorted((root / "derivations").glob("*.py")):
        kept = root / "paper" / "generated" / "derivations" / f"{script.stem}.json"
        if not kept.is_file():
            raise InputError(f"{kept} is not there; asympk derive writes it")
        results = json.loads(kept.read_text(encoding="utf-8"))
        write_text(out / script.name, as_gallery(script.read_text(encoding="utf-8"), results))


def as_gallery(script: str, results: dict[str, dict[str, str]]) -> str:
    """Return a script with title and headings in the syntax of sphinx-gallery, and with its results at the end."""
    about, _, rest = script.removeprefix('"""').removesuffix("\n").partition('"""')
    title, _, summary = about.rstrip().rstrip(".").partition(": ")
    rest = _COMMENT.sub(lambda line: _MARKS.sub(r"\\\1", line[0]), rest)
    rest = _HEAD.sub(lambda found: f"# %%\n# {found[1]}\n# {'-' * len(found[1])}\n#\n", rest)
    shown = [f"# **{name.replace('_', ' ')}**\n#\n# .. math::\n#\n#    {result['latex']}\n#\n"
             for name, result in results.items()]
    top = f'"""\n{title}\n{"=" * len(title)}\n\n{summary[:1].upper()}{summary[1:]}.\n"""'
    return "\n".join([top, rest, "# %%\n# Results\n# -------\n#", "".join(shown)])


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
