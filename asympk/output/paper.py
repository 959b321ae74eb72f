"""From symbols to a finished PDF: rows, figures, tables and numbers under paper/generated, then latexmk."""

import logging
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

from asympk.errors import InputError, UnknownName
from asympk.output import numbers
from asympk.output.gallery import README, pictures
from asympk.output.regenerate import project, write_tables
from asympk.pictures.figures import save
from asympk.storage.files import write_text
from asympk.studies import anymechanism, collisions, convergence, damping, decreasing, divide, leastmap, peer

PACKAGES = "latexmk texlive-latex-recommended texlive-pictures texlive-science lmodern"
ROWS = {"mechanisms": anymechanism.write_formulas, "jumplaw": anymechanism.write_errors,
        "rebound": anymechanism.write_rebounds, "convergence": convergence.write, "escape": divide.write,
        "collisions": collisions.write, "least": leastmap.write, "decreasing": decreasing.write, "peer": peer.write,
        "damping": damping.write}  # fmt: skip
LATEXMK = ("latexmk", "-pdf", "-interaction=nonstopmode", "-halt-on-error", "-outdir=build")
DOCUMENTS = ("main", "supplement")
MOST_RUNS = 6


def build(root: Path, progress: Callable[[str], None] | None = None) -> list[str]:
    """Write all that the paper is made of, and the PDF where latexmk is installed; return a line for each outcome.

    Rows that exist are kept. Raises ``InputError`` with the first complaint of TeX when the paper does not compile.
    """
    root, tell = project(root), progress or (lambda message: None)
    generated = root / "paper" / "generated"
    made = [*write_paper_rows(generated / "rows", tell), *write_figures(root, tell), *write_tables(root)]
    tell("writing numbers")
    made.append(write_text(generated / "numbers.tex", numbers.macro_definitions(numbers.macros(root))))
    lines = [f"wrote {len(made)} files under {generated}"]
    if not shutil.which("latexmk"):
        return [*lines, f"no PDF, for latexmk is not installed: apt-get install --no-install-recommends {PACKAGES}"]
    tell("running latexmk")
    return [*lines, *(f"wrote {typeset_pdf(root / 'paper', name)}" for name in DOCUMENTS)]


def draw_picture(root: Path, name: str) -> list[Path]:
    """Draw one picture as PDF and SVG under paper/generated/figures; return the files.

    Raises ``UnknownName`` for a picture that does not exist or whose rows are not there.
    """
    found = {picture.name: picture for picture in pictures(project(root))}
    if name not in found:
        raise UnknownName(f"picture {name!r} is unknown; choose one of {', '.join(found)}")
    out = project(root) / "paper" / "generated" / "figures"
    figure = found[name].draw()
    return [save(figure, out / f"{name}.{kind}") for kind in ("pdf", "svg")]


def write_paper_rows(out: Path, tell: Callable[[str], None]) -> list[Path]:
    """Compute the rows that the paper's own figures need and that are not there; return the files written."""
    written = []
    for name, write in ROWS.items():
        if not (out / f"{name}.csv").is_file():
            tell(f"computing {name}")
            written.append(write(out))
    return written


def write_figures(root: Path, tell: Callable[[str], None]) -> list[Path]:
    """Draw every picture as PDF for the paper, those of the README as SVG as well; return the files."""
    logging.getLogger("fontTools").setLevel(logging.ERROR)  # it remarks on the age of matplotlib's fonts
    out, written = root / "paper" / "generated" / "figures", []
    for picture in pictures(root):
        tell(f"drawing {picture.name}")
        figure = picture.draw()
        kinds = ("pdf", "svg") if picture.name in README else ("pdf",)
        written += [save(figure, out / f"{picture.name}.{kind}") for kind in kinds]
    return written


def typeset_pdf(paper: Path, name: str = "main") -> Path:
    """Run latexmk in ``paper`` on ``name``.tex and return the PDF, whose bytes depend on what it is made of alone.

    Latexmk knows files by their size and second: it misses labels that change within one. So it runs again while the
    log asks for it. Raises ``InputError`` where TeX complains, and where the labels do not settle.
    """
    fixed = {"SOURCE_DATE_EPOCH": "0", "FORCE_SOURCE_DATE": "1", "TZ": "UTC"}
    source, log = Path(paper) / f"{name}.tex", Path(paper) / "build" / f"{name}.log"
    for again in range(MOST_RUNS):
        command = [*LATEXMK, *["-g"] * (again > 0), source.name]
        run = subprocess.run(command, cwd=paper, env={**os.environ, **fixed}, capture_output=True, text=True,
                             errors="replace")  # fmt: skip
        if run.returncode:
            raise InputError(f"{source} does not compile: {first_complaint(run.stdout)}; see {log}")
        if not asks_to_run_again(log.read_text(encoding="utf-8", errors="replace")):
            return log.with_suffix(".pdf")
    raise InputError(f"{source}: labels still change after {MOST_RUNS} runs; see {log}")


def asks_to_run_again(log: str) -> bool:
    """Return whether LaTeX or a package says in ``log`` that what it wrote differs from what it read."""
    return bool(re.search(r"Warning:.*\n?.*Rerun to get", log))


def first_complaint(log: str) -> str:
    """Return TeX's first error with the line it names, or the last line of the log."""
    found = re.search(r"^! (.+?)$(?:.*?^(l\.\d+.*?)$)?", log, re.MULTILINE | re.DOTALL)
    lines = [part.strip() for part in found.groups() if part] if found else log.strip().splitlines()[-1:]
    return " at ".join(lines) or "latexmk says nothing"
