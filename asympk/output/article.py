"""The article of ``paper/`` as a page of the site: Pandoc converts its LaTeX to reStructuredText, which Sphinx sets."""

import re
from pathlib import Path

from asympk.errors import InputError
from asympk.storage.files import write_text

_TITLE = re.compile(r"\\title\{(?:\\vspace\{.*?\})?(.*?)\}\n", re.DOTALL)
_ABSTRACT = re.compile(r"\\twocolumn\[\\maketitle\S*\s*(\\begin\{quote\}.*?\\end\{quote\})\S*\]", re.DOTALL)
_FORMULA = re.compile(r"^( *)\.\. math::\n\n((?:\1 +.*\n|\n)+)", re.MULTILINE)
_LABEL = re.compile(r"\\label\{(.+?)\}(?:\\\\)?")


def write_article(root: Path, out: Path, lua: Path) -> list[str]:
    """Write the article in ``root``/paper as ``out``/index.rst, and return the names of its pictures.

    ``lua`` is the file of the Pandoc filter. Raises ``InputError`` where Pandoc cannot read the article.
    """
    import pypandoc

    paper = root / "paper"
    latex = for_pandoc(with_sections((paper / "main.tex").read_text(encoding="utf-8"), paper))
    arguments = ["--citeproc", "--bibliography=refs.bib", "--wrap=none", f"--lua-filter={lua.resolve()}"]
    try:
        found = pypandoc.convert_text(latex, "rst", "latex", extra_args=arguments, cworkdir=str(paper))
    except RuntimeError as error:
        raise InputError(f"{paper / 'main.tex'}: Pandoc cannot read it: {str(error).strip()}") from None
    title = _TITLE.search(latex)[1].replace(r"\\", "").replace("--", "–")  # type: ignore[index]
    write_text(out / "index.rst", f"{title}\n{'#' * len(title)}\n\n{labelled(found)}\n")
    return re.findall(r"^\.\. figure:: (.+)\.svg$", found, re.MULTILINE)


def with_sections(source: str, paper: Path) -> str:
    """Replace the commands that input preamble and sections by their text; sections without stored rows are dropped."""
    if (head := r"\input{preamble}") in source:
        source = source.replace(head, (paper / "preamble.tex").read_text(encoding="utf-8"))

    def section(found: re.Match) -> str:
        rows, name = found.groups()
        return (paper / f"{name}.tex").read_text(encoding="utf-8") if (paper / rows).is_file() else ""

    return re.sub(r"\\IfFileExists\{(.+?)\}\{\\input\{(.+?)\}\}\{\}", section, source)


def for_pandoc(latex: str) -> str:
    """Return the article in a form that Pandoc reads: one column, and SVG pictures in the folder of the page."""
    latex = _ABSTRACT.sub(lambda found: found[1], latex).replace("generated/figures/#1.pdf", "#1.svg")
    latex = re.sub(r"\\everymath\{.*?\}|\\setlength\{.*?\}\{.*?\}", "", latex)
    return re.sub(r"\{(table|figure)\*\}", r"{\1}", latex)


def labelled(rst: str) -> str:
    """Return the page with the labels of displayed formulas in the syntax of Sphinx.

    Sphinx allows one label for each formula, so every labelled row of an ``align`` becomes a formula of its own.
    """

    def formula(found: re.Match) -> str:
        indent, body = found.groups()
        *parts, end = _LABEL.split(body)
        begin, rows = body.partition("\n")[0], parts[::2]
        heads = (f"{indent}.. math::\n{indent}   :label: {label}\n\n" for label in parts[1::2])
        return "".join(head + begin * (row is not rows[0]) + row + end
                       for head, row in zip(heads, rows, strict=True)) or found[0]

    return re.sub(r"<#(\w+):(\w+)>", r"<#\1-\2>", _FORMULA.sub(formula, rst))  # docutils writes - for : in anchors
