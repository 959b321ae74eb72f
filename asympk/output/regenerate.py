"""The main job: run the derivations, check the claims, write the tables."""

import json
import runpy
from collections.abc import Callable
from pathlib import Path

import sympy as sp

from asympk.errors import InputError
from asympk.shown import latex_of
from asympk.storage.files import write_text


def project(root: str | Path) -> Path:
    """Return ``root``, the directory of a checkout, as a path; raises ``InputError`` where it has no derivations."""
    root = Path(root)
    if not (root / "derivations").is_dir():
        raise InputError(
            f"{root.resolve()} has no derivations/: run asympk in a checkout of the project, or give --root; "
            "only asympk alone, derive, tables, chart, paper and report need one"
        )
    return root


def silent(words: str) -> None:
    """Ignore ``words``: the default of functions that report the step they are at."""


def derive(root: Path, tell: Callable[[str], None] = silent) -> list[Path]:
    """Run every derivation and write its results as LaTeX, JSON and srepr; return the files written."""
    root = project(root)
    out = root / "paper" / "generated" / "derivations"
    written = []
    for script in sorted((root / "derivations").glob("*.py")):
        tell(f"deriving {script.stem}")
        results = {name: _symbolic(value) for name, value in runpy.run_path(str(script))["RESULTS"].items()}
        written += [write_text(out / f"{script.stem}{suffix}", form) for suffix, form in _by_suffix(results).items()]
    tell("")
    return written


def _by_suffix(results):
    formulas = {name: {"text": str(value), "latex": latex_of(value)} for name, value in results.items()}
    lines = (rf"\[ \text{{{name.replace('_', ' ')}}}\colon\quad {one['latex']} \]" for name, one in formulas.items())
    return {
        ".tex": "".join(f"{line}\n" for line in lines),
        ".json": json.dumps(formulas, indent=1, ensure_ascii=False) + "\n",
        ".srepr": "".join(f"{name} = {sp.srepr(value)}\n" for name, value in results.items()),
    }


def _symbolic(value):
    """Turn a result, which may nest tuples and dictionaries, into one SymPy object."""
    if isinstance(value, dict):
        return sp.Dict({_symbolic(key): _symbolic(item) for key, item in value.items()})
    if isinstance(value, (tuple, list)):
        return sp.Tuple(*map(_symbolic, value))
    return sp.Symbol(value) if isinstance(value, str) else sp.sympify(value, strict=True)


def write_tables(root: Path) -> list[Path]:
    """Write all tables, if their rows are stored, as LaTeX and CSV under paper/generated/tables; return the files."""
    from asympk.output.artefacts import tables
    from asympk.output.tabular import write_table

    generated = project(root) / "paper" / "generated"
    return [file for make in tables(generated / "rows") for file in write_table(make(), generated / "tables")]


def everything(root: Path, tell: Callable[[str], None]) -> int:
    """Regenerate derivations, claims and tables, print a summary, and return 1 when a claim is not settled."""
    from asympk.ledger import claims
    from asympk.output.terminal import claims_as_json, exit_status, summary

    root = project(root)
    written = derive(root, tell)
    found = claims(lambda identifier: tell(f"checking {identifier}"))
    written.append(write_text(root / "paper" / "generated" / "claims.json", claims_as_json(found)))
    written += write_tables(root)
    tell("")
    print(summary(found, len(written)))
    return exit_status(found)
