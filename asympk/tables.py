"""Tables: rows of symbols and words, set in booktabs LaTeX (the tabular only) or written as CSV."""

import csv
import io
from dataclasses import dataclass
from typing import Any

import sympy as sp

from asympk.ledger import claims
from asympk.manifold import rest_state, slow_manifolds
from asympk.regimes import regimes
from asympk.stability import eigenvalues
from asympk.systems import painleve_klein as pk

_SPECIAL = {"&": r"\&", "%": r"\%", "_": r"\_", "#": r"\#", "$": r"\$", "{": r"\{", "}": r"\}"}
_SPECIAL |= {"<": r"\textless{}", ">": r"\textgreater{}", "^": r"\^{}", "~": r"\~{}", "\\": r"\textbackslash{}"}
_MODE = {
    "slip_same": "slip, $s z > 0$ (2.7)",
    "slip_opposite": "slip, $s z < 0$ (2.8)",
    "stick": "stick, $z = 0$ (2.9)",
}
_S = sp.Symbol("s", real=True)


@dataclass(frozen=True)
class Math:
    """A cell that is a formula: its LaTeX, and the same in plain characters."""

    latex: str
    text: str


@dataclass(frozen=True)
class Table:
    """A header and rows; cells are words (which may hold ``$..$``), SymPy objects or ``Math``.

    ``align`` is the tabular's column specification.
    """

    name: str
    align: str
    header: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


def latex(table):
    """Return the table as a booktabs ``tabular``; the caption and the float are the paper's."""
    lines = [rf"\begin{{tabular}}{{{table.align}}}", r"\toprule", _line(table.header), r"\midrule"]
    lines += [_line(map(_cell, row)) for row in table.rows]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def text(table):
    """Return the table as CSV with plain formulas."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(table.header)
    writer.writerows([_plain(cell) for cell in row] for row in table.rows)
    return buffer.getvalue()


def escape(words):
    """Escape what LaTeX would read as commands in plain words."""
    return "".join(_SPECIAL.get(character, character) for character in words)


def _line(cells):
    return " & ".join(cells) + r" \\"


def _cell(cell):
    if isinstance(cell, str):
        return cell
    return f"${cell.latex if isinstance(cell, Math) else sp.latex(cell)}$"


def _plain(cell):
    return cell.text if isinstance(cell, Math) else str(cell).replace("$", "")


def groups_table():
    """Nondimensional groups of section 2 with their definitions in physical quantities."""
    rows = tuple((group.meaning, group.symbol, group.definition) for group in pk.groups())
    return Table("groups", "lcl", ("quantity", "symbol", "definition"), rows)


def modes_table():
    r"""The right-hand sides mu y' and z' of every mode in terms of s = x + y; x' = y in all."""
    rows = tuple(
        (_MODE[mode.name], _of_load(mode.fast[pk.y]), _of_load(mode.slow[pk.z])) for mode in pk.system().modes
    )
    return Table("modes", "lll", ("mode", r"$\mu y'$", "$z'$"), rows)


def _of_load(expr):
    return sp.collect(sp.expand(expr.subs(pk.y, _S - pk.x)), _S)


def manifolds_table():
    """Slow manifolds: where they live, whether they attract, their first term in mu, rest state and drift."""
    rows = []
    for manifold in slow_manifolds(pk.system(), order=1):
        rest = rest_state(manifold)
        rows.append((
            Math(rf"\Pi_{manifold.name[-1]}", manifold.name),
            sp.Eq(_S, sp.cancel(pk.x + manifold.coefficient(0))),
            sp.factor(manifold.coefficient(1)),
            manifold.domain,
            manifold.stability,
            rest.drift[pk.z],
        ))
    header = ("plane", r"at $\mu = 0$", r"$\mu$ term of $y$", "lives in", "attracts", "$z'$ at rest")
    return Table("manifolds", "llllll", header, tuple(rows))


def eigenvalues_table():
    """Exact slow and fast eigenvalues of every mode, and the mu at which node turns to focus."""
    rows = tuple((_MODE[s.mode], s.slow, s.fast, s.coalescence) for s in eigenvalues(pk.system()))
    header = ("mode", "slow eigenvalue", "fast eigenvalue", r"node to focus at $\mu$")
    return Table("eigenvalues", "llll", header, rows)


def regimes_table():
    """The ranges of sigma between thresholds: stick region, and what Pi2 is and where its motions meet z = 0."""
    rows = []
    for regime in regimes(pk.system()):
        second = regime.passages[1]
        rows.append((
            regime.condition,
            sp.Union(*(span.as_set().subs(pk.sigma0, pk.sigma) for span in regime.stick), evaluate=False),
            _side(second),
            _meeting(second),
        ))
    header = (r"$\sigma$", "stick on $z = 0$, $s$ in", r"$\Pi_2$", r"$\Pi_2$ meets $z = 0$ in")
    return Table("regimes", "llll", header, tuple(rows))


def _side(passage):
    if not passage.side:
        return "does not exist"
    return f"$z {'>' if passage.side > 0 else '<'} 0$, {'attracts' if passage.stable else 'repels'}"


def _meeting(passage):
    words = {"stick": "the stick region", "up": "upward crossing", "down": "downward crossing", None: "--"}
    return words[passage.meets]


def claims_table():
    """The ledger: every claim of the paper with its verdict."""
    rows = tuple((c.id, c.where, escape(c.statement), c.verdict) for c in claims())
    return Table("claims", r"llp{0.68\linewidth}l", ("claim", "sec.", "statement", "verdict"), rows)


TABLES = (groups_table, modes_table, manifolds_table, eigenvalues_table, regimes_table, claims_table)
