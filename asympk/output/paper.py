"""From symbols to a finished PDF: rows, figures, tables and numbers under paper/generated, then latexmk."""

import logging
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Collection, Iterable
from pathlib import Path

from asympk.errors import InputError, UnknownName
from asympk.output import artefacts, macros
from asympk.output.artefacts import ARTEFACTS, README, Artefact, pictures
from asympk.output.regenerate import project, silent, write_tables
from asympk.output.tabular import write_table
from asympk.pictures.figures import save
from asympk.storage.files import write_text
from asympk.storage.rows import provenance, write_rows

PACKAGES = "latexmk texlive-latex-recommended texlive-pictures texlive-science lmodern"
LATEXMK = ("latexmk", "-pdf", "-interaction=nonstopmode", "-halt-on-error", "-outdir=build")
DOCUMENTS = ("main", "supplement")
MOST_RUNS = 6


def build(root: Path, tell: Callable[[str], None] = silent) -> list[str]:
    """Write rows, figures, tables and numbers of the paper, and its PDF where latexmk is installed.

    Return a line for each outcome. Rows that are stored are not computed again. Raises ``InputError`` with the first
    error of TeX when the paper does not compile.
    """
    root = project(root)
    generated = root / "paper" / "generated"
    made = [*write_paper_rows(generated / "rows", tell), *write_figures(generated, tell), *write_tables(root)]
    tell("writing numbers")
    found = artefacts.all_macros(generated / "rows")
    made.append(write_text(generated / "numbers.tex", macros.macro_definitions(found)))
    lines = [f"wrote {len(made)} files under {generated}"]
    if not shutil.which("latexmk"):
        return [*lines, f"no PDF, for latexmk is not installed: apt-get install --no-install-recommends {PACKAGES}"]
    tell("running latexmk")
    return [*lines, *(f"wrote {typeset_pdf(root / 'paper', name)}" for name in DOCUMENTS)]


def draw_pictures(root: Path, names: Iterable[str], out: Path, kinds: Iterable[str] = ("svg",)) -> list[Path]:
    """Draw pictures of the paper into ``out`` in files of each of ``kinds``, pdf and svg; return the files.

    Raises ``UnknownName`` for a picture that does not exist or whose rows are not there.
    """
    found, written = pictures(root / "paper" / "generated" / "rows"), list[Path]()
    for name in names:
        if name not in found or not (figure := found[name]()):
            raise UnknownName(f"picture {name!r} is unknown; choose one of {', '.join(found)}")
        written += [save(figure, out / f"{name}.{kind}") for kind in kinds]
    return written


def write_paper_rows(out: Path, tell: Callable[[str], None]) -> list[Path]:
    """Compute the rows of ``ARTEFACTS`` that are not stored yet, except the chart's; return the files written."""
    written = []
    for artefact in ARTEFACTS:
        file = out / f"{artefact.name}.csv"
        if artefact.compute and not file.is_file():
            tell(f"computing {artefact.name}")
            rows = artefact.compute()
            write_rows(file, rows, provenance(**rows.provenance))
            written.append(file)
    return written


def write_figures(
    out: Path, tell: Callable[[str], None], among: Iterable[Artefact] = ARTEFACTS, svg: Collection[str] = README
) -> list[Path]:
    """Draw every picture into ``out``/figures as PDF, those in ``svg`` also as SVG; return the files.

    Pictures of rows are drawn if ``out``/rows has their rows.
    """
    logging.getLogger("fontTools").setLevel(logging.ERROR)  # it warns of old time stamps in matplotlib's fonts
    written = []
    for name, draw in pictures(out / "rows", among).items():
        tell(f"drawing {name}")
        if figure := draw():
            kinds = ("pdf", "svg") if name in svg else ("pdf",)
            written += [save(figure, out / "figures" / f"{name}.{kind}") for kind in kinds]
    return written


def write_chart(out: Path, tell: Callable[[str], None]) -> list[Path]:
    """Draw and tabulate the rows of ``asympk chart`` in ``out``/rows; return the files written."""
    measured = [artefact for artefact in ARTEFACTS if artefact.measured]
    made = [make() for make in artefacts.tables(out / "rows", measured)]
    drawn = write_figures(out, tell, measured, svg=())
    return [*drawn, *(file for table in made for file in write_table(table, out / "tables"))]


def typeset_pdf(paper: Path, name: str = "main") -> Path:
    """Run latexmk in ``paper`` on ``name``.tex and return the PDF, whose bytes depend on its sources alone.

    Latexmk compares files by size and by time in whole seconds, so it misses labels that change within a second.
    Therefore it is run again while the log asks for another run. Raises ``InputError`` where TeX reports an error, and
    where labels still change after ``MOST_RUNS`` runs.
    """
    fixed = {"SOURCE_DATE_EPOCH": "0", "FORCE_SOURCE_DATE": "1", "TZ": "UTC"}
    source, log = Path(paper) / f"{name}.tex", Path(paper) / "build" / f"{name}.log"
    for again in range(MOST_RUNS):
        command = [*LATEXMK, *(["-g"] if again else []), source.name]
        run = subprocess.run(command, cwd=paper, env={**os.environ, **fixed}, capture_output=True, text=True,
                             errors="replace")
        if run.returncode:
            raise InputError(f"{source} does not compile: {first_complaint(run.stdout)}; see {log}")
        if not asks_to_run_again(log.read_text(encoding="utf-8", errors="replace")):
            return log.with_suffix(".pdf")
    raise InputError(f"{source}: labels still change after {MOST_RUNS} runs; see {log}")


def asks_to_run_again(log: str) -> bool:
    """Return whether a warning of LaTeX or a package in ``log`` asks for another run."""
    return bool(re.search(r"Warning:.*\n?.*Rerun to get", log))


def first_complaint(log: str) -> str:
    """Return TeX's first error with the line it names, or the last line of the log."""
    found = re.search(r"^! (.+?)$(?:.*?^(l\.\d+.*?)$)?", log, re.MULTILINE | re.DOTALL)
    lines = [part.strip() for part in found.groups() if part] if found else log.strip().splitlines()[-1:]
    return " at ".join(lines) or "latexmk says nothing"
