"""One self-contained HTML page: the paper's abstract, jump law, figures and tables, with nothing to load and no script.

Captions and their order are read from paper/main.tex, so that paper and page say the same.
"""

import re
import tempfile
from dataclasses import dataclass
from html import escape
from pathlib import Path

from asympk.errors import InputError
from asympk.output import numbers
from asympk.output.gallery import pictures
from asympk.output.mathml import mathml
from asympk.output.regenerate import project
from asympk.output.rowtables import tables_from_rows
from asympk.output.tables import TABLES
from asympk.output.tabular import as_cell
from asympk.pictures.figures import save
from asympk.storage.files import write_text

STYLE = """
body { font: 1rem/1.5 Georgia, serif; max-width: 46rem; margin: 2rem auto; padding: 0 1rem; color: #111; }
h1, h2 { line-height: 1.2; font-weight: 600; } h2 { margin-top: 2.5rem; }
figure { margin: 2rem 0; } figure svg { display: block; width: 100%; max-width: 32rem; height: auto; margin: 0 auto; }
figcaption, caption { font-size: .9rem; color: #333; text-align: left; padding: .5rem 0; caption-side: top; }
.wide { overflow-x: auto; margin: 2rem 0; } table { border-collapse: collapse; font-size: .9rem; }
td { white-space: nowrap; } td.long { white-space: normal; min-width: 13rem; }
caption div { max-width: min(46rem, 100vw - 3.5rem); position: sticky; left: 0; }
th, td { text-align: left; padding: .3rem .7rem .3rem 0; vertical-align: top; }
thead th { border-bottom: 1px solid #111; vertical-align: bottom; } td math { math-style: normal; }
tbody tr { border-bottom: 1px solid #ddd; } math { font-size: 1.05em; } .law { overflow-x: auto; overflow-y: hidden; }
@media (max-width: 40rem) { .law math { font-size: .85em; } }
"""
LAW = (
    r"z \to 0, \quad x \to \jumpX",
    r"x^+ = \jumpX + \mu L \left(\jumpXLog\right) + \mu \xi + O(\mu^2 L^2)",
    r"z^+ = \mu L \left(\jumpZLog\right) + \mu \zeta + O(\mu^2 L)",
    r"\xi = \jumpXRestLogs + \jumpXRest",
    r"\zeta = \jumpZRestLogs \jumpZRest",
    r"\Lambda_1 = \firstLog, \quad \Lambda_2 = \secondLog",
)
LONG = 50  # characters of a cell beyond which it may break into lines
_FLOAT = re.compile(r"\\begin\{(figure|table)\*?\}(.*?)\\end\{\1\*?\}", re.DOTALL)
_MACRO = re.compile(r"\\([A-Za-z]+)(?:\{\})?")


def write_page(root, out, progress=None):
    """Write ``out``/index.html for the checkout ``root`` and return its path."""
    root, tell = project(root), progress or (lambda message: None)
    source = with_sections((root / "paper" / "main.tex").read_text(encoding="utf-8"), root / "paper")
    tell("computing numbers")
    found = numbers.macros(root)
    reader = Reader(found, works((root / "paper" / "refs.bib").read_text(encoding="utf-8")))
    drawn = {picture.name: picture for picture in pictures(root)}
    made = {make.__name__.removesuffix("_table"): make for make in TABLES}
    made |= tables_from_rows(root)
    parts = []
    for kind, body in _FLOAT.findall(source):
        caption = reader.html(argument(body, "caption"))
        if kind == "table":
            (name,) = re.findall(r"\\tab(?:\[.*?\])?\{([\w-]+)\}", body)
            parts.append(table_html(made[name](), caption, reader))
            continue
        for name in re.findall(r"\\pic\{([\w-]+)\}", body):
            tell(f"drawing {name}")
            parts.append(figure_html(drawn[name], caption))
    title = reader.html(argument(source, "title").replace(r"\\", "").replace(r"\vspace{-2ex}", ""))
    abstract = reader.html(source.split(r"\begin{quote}\small")[1].split(r"\end{quote}")[0])
    law = "\n".join(f'<p class="law">{mathml(reader.expanded(line), block=True)}</p>' for line in LAW)
    return write_text(Path(out) / "index.html", PAGE.format(title=title, abstract=abstract, law=law, style=STYLE,
                                                            parts="\n".join(parts)))


PAGE = """<!DOCTYPE html>
<html lang="en-GB">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<h1>{title}</h1>
<p>{abstract}</p>
<h2>The jump of the steep rod</h2>
<p>From a start with the load s = x + y, with L = log(1/μ) and σ<sub>0</sub> = σ, the slow motion on which the jump ends
has at t = 0:</p>
{law}
<h2>Figures and tables</h2>
{parts}
</body>
</html>
"""


def with_sections(source, paper):
    """Put the sections that exist only with their rows in the place of their conditional inputs."""

    def section(found):
        rows, name = found.groups()
        return (paper / f"{name}.tex").read_text(encoding="utf-8") if (paper / rows).is_file() else ""

    return re.sub(r"\\IfFileExists\{(.+?)\}\{\\input\{(.+?)\}\}\{\}", section, source)


def argument(source, command):
    """Return the argument of the first ``command`` in ``source``, braces inside it included."""
    start = source.index(rf"\{command}{{") + len(command) + 2
    depth, end = 1, start
    while depth:
        depth += {"{": 1, "}": -1}.get(source[end], 0)
        end += 1
    return source[start : end - 1]


@dataclass(frozen=True)
class Reader:
    """Turns the LaTeX of captions and cells into HTML; ``works`` says what a reference is called in the text."""

    macros: dict
    works: dict

    def expanded(self, latex):
        """Return ``latex`` with the paper's macros replaced by what they stand for."""
        return _MACRO.sub(lambda f: f"{{{self.macros[f[1]]}}}" if f[1] in self.macros else f[0], latex)

    def html(self, latex):
        """Return words with formulas between dollar signs as HTML."""
        pieces = re.split(r"(?<!\\)\$(.+?)(?<!\\)\$", re.sub(r"\s+", " ", latex.strip()))
        return "".join(mathml(self.expanded(p)) if k % 2 else self._words(p) for k, p in enumerate(pieces))

    def _words(self, latex):
        latex = re.sub(r"\\citet\{(\w+)\}", lambda found: self.works[found[1]], latex)
        latex = self.expanded(latex)
        while r"\ensuremath{" in latex:
            formula = argument(latex, "ensuremath")
            latex = latex.replace(rf"\ensuremath{{{formula}}}", mathml(formula), 1)
        latex = re.sub(r"\\fuf\{([\d.]+)\}", r"(\1)", latex)
        latex = re.sub(r"\\emph\{(.*?)\}", r"<em>\1</em>", latex)
        latex = latex.replace("--", "–").replace("~", " ").replace(r"\_", "_").replace(r"\&", "&amp;")
        latex = re.sub(r"\{([^{}\\]*)\}", r"\1", latex)
        if left := re.search(r"\\[A-Za-z]+", latex):
            raise InputError(f"{left[0]} in a caption or cell has no HTML here; add it to page.py: {latex}")
        return latex


def works(bibliography):
    """Return {key: "Author (year)"} of a BibTeX file."""
    entries = re.findall(r"@\w+\{(\w+),(.*?)\n\}", bibliography, re.DOTALL)
    return {key: _authors(entry) for key, entry in entries}


def _authors(entry):
    names = re.search(r"author = \{(.+?)\},\n", entry)[1].split(" and ")
    year = re.search(r"year = \{(\d+)\}", entry)[1]
    return f"{' and '.join(_plain(name.strip('{}').split(',')[0]) for name in names)} ({year})"


def _plain(name):
    return name.replace(r"{\'e}", "é").replace(r"{\'a}", "á")


def table_html(table, caption, reader):
    """Return a table as HTML, formulas as MathML."""
    head = "".join(f"<th>{reader.html(as_cell(c).latex)}</th>" for c in table.header)
    rows = "\n".join(f"<tr>{''.join(_cell(c, reader) for c in row)}</tr>" for row in table.rows)
    top = f"<caption><div>{caption}</div></caption>\n<thead><tr>{head}</tr></thead>"
    return f'<div class="wide"><table>{top}\n<tbody>\n{rows}\n</tbody></table></div>'


def _cell(content, reader):
    latex = as_cell(content).latex
    emphasised = re.fullmatch(r"\\emph\{(.*)\}", latex, re.DOTALL)
    inside = f"<em>{reader.html(emphasised[1])}</em>" if emphasised else reader.html(latex)
    return f'<td class="long">{inside}</td>' if len(as_cell(content).text) > LONG else f"<td>{inside}</td>"


def figure_html(picture, caption):
    """Return a picture as inline SVG with its caption; ids are prefixed with the picture's name."""
    with tempfile.TemporaryDirectory() as folder:
        svg = save(picture.draw(), Path(folder) / "picture.svg").read_text(encoding="utf-8")
    words = escape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", "", caption)), quote=True)
    return f"<figure>\n{inline(svg, picture.name, words)}\n<figcaption>{caption}</figcaption>\n</figure>"


def inline(svg, name, words):
    """Return the ``svg`` element of a file, without metadata and fixed size, its ids made unique on the page."""
    svg = svg[svg.index("<svg") :].strip()
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\b(id=")|(xlink:href="#)|(url\(#)', lambda f: (f[0].replace("xlink:", "") + f"{name}-"), svg)
    box = re.search(r'viewBox="[^"]+"', svg)[0]
    return re.sub(r"<svg[^>]*>", f'<svg {box} role="img" aria-label="{words}">', svg, count=1)
