"""Tables as objects, written as booktabs LaTeX (a bare ``tabular``: the paper adds caption and float) or as CSV."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sympy as sp

from asympk.storage.files import csv_text, write_text

_SPECIAL = {"&": r"\&", "%": r"\%", "_": r"\_", "#": r"\#", "$": r"\$", "{": r"\{", "}": r"\}",
            "\\": r"\textbackslash{}", "~": r"\~{}"}
_RELATIONS = {"<=": r"\le ", ">=": r"\ge ", "->": r"\to ", "+-": r"\pm ", "<": "<", ">": ">", "|": "|"}
_PIECE = re.compile(
    rf"""(?P<relation>{"|".join(map(re.escape, _RELATIONS))})
    |(?P<special>[{re.escape("".join(_SPECIAL))}])
    |\b(?P<function>cos|sin|tan|ln|log)\b(?P<square>\^2)?(?P<angle>\ a\b)?
    |(?P<infinity>\boo\b)
    |(?P<sign>(?<![\w)'])-)?(?:
        \b(?P<greek>sigma|mu|beta|alpha|Pi|Gamma|Delta)(?P<index>\d?)\b
        |(?<![\w'.])(?P<factor>\d*)(?P<letter>[xyzsfmklhuvwCFLPROG])(?P<place>\d?)(?P<primes>'*)(?!\w)
        |(?<![\w.])(?P<number>\d+(?:/\d+)?)(?!\.?\w))""",
    re.VERBOSE,
)
_JOINT = re.compile(r"(?<!\\)\$(?! \()([-+=/( ]*)\$")  # joins two formulas with nothing but operators between


@dataclass(frozen=True)
class Cell:
    """The content of a cell in two forms: LaTeX, and plain text."""

    latex: str
    text: str


@dataclass(frozen=True)
class Table:
    """A header and rows of cells; ``align`` is the tabular's column specification.

    A cell is a ``Cell``, a SymPy object, or a string in LaTeX whose formulas stand between dollar signs.
    """

    name: str
    align: str
    header: tuple[Any, ...]
    rows: tuple[tuple[Any, ...], ...]


def latex(table: Table) -> str:
    """Return the table as a booktabs ``tabular``."""
    lines = [rf"\begin{{tabular}}{{{table.align}}}", r"\toprule", _line(table.header), r"\midrule"]
    lines += [_line(row) for row in table.rows]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def plain_rows(table: Table) -> list[list[str]]:
    """Return the header and the rows as lists of plain strings."""
    return [[as_cell(cell).text for cell in row] for row in (table.header, *table.rows)]


def write_table(table: Table, out: Path) -> list[Path]:
    """Write the table into the directory ``out`` as ``name``.tex and ``name``.csv; return the files."""
    forms = {"tex": latex(table), "csv": csv_text(plain_rows(table))}
    return [write_text(out / f"{table.name}.{end}", text) for end, text in forms.items()]


def words(sentence: str) -> Cell:
    """Make a cell of plain words; symbols, relations and numbers in them become formulas in LaTeX."""
    return Cell(_JOINT.sub(r"\1", _PIECE.sub(_typeset, sentence)), sentence)


def _typeset(found):
    if found["special"]:
        return _SPECIAL[found["special"]]
    if found["relation"]:
        return f"${_RELATIONS[found['relation']]}$"
    if found["function"]:
        return rf"$\{found['function']}{found['square'] or ''}" + (r" \alpha$" if found["angle"] else "$")
    if found["infinity"]:
        return r"$\infty$"
    name = rf"\{found['greek']}" if found["greek"] else found["number"] or f"{found['factor']}{found['letter']}"
    index = found["index"] or found["place"]
    return f"${found['sign'] or ''}{name}{f'_{index}' if index else ''}{found['primes'] or ''}$"


def values_of(symbol: sp.Symbol, values: sp.Set) -> Cell:
    """Make a cell that says in which interval, or at which value, a parameter lies."""
    name = sp.latex(symbol)
    if values.is_FiniteSet:
        (value,) = values
        return Cell(f"${name} = {sp.latex(value)}$", f"{symbol} = {value}")
    start, end = ("<" if opened else "<=" for opened in (values.left_open, values.right_open))
    left = (f"{sp.latex(values.start)} {start} ", f"{values.start} {start} ") if values.start.is_finite else ("", "")
    right = (f" {end} {sp.latex(values.end)}", f" {end} {values.end}") if values.end.is_finite else ("", "")
    if not right[0]:
        left, right = ("", ""), (f" > {sp.latex(values.start)}", f" > {values.start}")
    return Cell(f"${left[0]}{name}{right[0]}$".replace("<=", r"\le"), f"{left[1]}{symbol}{right[1]}")


def _line(cells):
    return " & ".join(as_cell(cell).latex for cell in cells) + r" \\"


def as_cell(content: Any) -> Cell:
    """Return the content of a table's cell (a ``Cell``, a SymPy object or a string in LaTeX) as a ``Cell``."""
    if isinstance(content, Cell):
        return content
    if isinstance(content, str):
        return Cell(content, re.sub(r"\\([A-Za-z]+)", r"\1", content).replace("$", ""))
    return Cell(f"${sp.latex(content)}$", str(content))
