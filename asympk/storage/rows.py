"""Rows: the stored results of a computation, as CSV beside a JSON file with the provenance of the rows.

A row is a dictionary of numbers, words and truth values; None is an empty cell. The JSON file also has the kind of
every column, so that the rows that are read equal the rows that were written. The bytes of the CSV file depend on the
rows alone.
"""

import csv
import json
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import python_version
from types import MappingProxyType
from typing import Any, TypeAlias

from asympk import __version__
from asympk.errors import InputError
from asympk.storage.files import csv_text, write_text

Row: TypeAlias = dict[str, Any]  # a result: its columns by name
PACKAGES = ("numpy", "scipy", "sympy", "mpmath", "heyoka", "scikit-sundae", "diffrax", "jax")
KEPT = 6  # digits of a number that depends, in further ones, on the machine
_READ: dict[str, Callable] = {"float": float, "int": int, "str": str, "bool": lambda word: word == "true"}


def write_rows(path: str | Path, rows: Iterable[Row], provenance: Mapping[str, Any]) -> None:
    """Write ``rows`` to ``path`` (CSV) and ``provenance`` with the columns' kinds to the JSON file of the same name.

    Raises ``InputError`` for rows whose columns differ, or a column of more than one kind, or a NaN.
    """
    rows = list(rows)
    columns = list(rows[0]) if rows else []
    for k, row in enumerate(rows):
        if list(row) != columns:
            raise InputError(f"row {k} of {Path(path).name} has the columns {list(row)}; the first has {columns}")
    kinds = {name: _kind(name, [row[name] for row in rows]) for name in columns}
    write_text(path, csv_text([columns, *([_cell(row[name], kinds[name]) for name in columns] for row in rows)]))
    described = json.dumps({**provenance, "columns": kinds}, indent=1, sort_keys=True, ensure_ascii=False)
    write_text(Path(path).with_suffix(".json"), described + "\n")


class StoredRows(list[Row]):
    """Rows with their ``provenance``: the settings with which they are computed, or the JSON file beside their file."""

    def __init__(self, rows: Iterable[Row] = (), provenance: Mapping[str, Any] = MappingProxyType({})):
        super().__init__(rows)
        self.provenance = provenance


def read_rows(path: str | Path) -> StoredRows:
    """Return the rows of ``path`` as dicts, every value of the kind with which it was written."""
    described = json.loads(Path(path).with_suffix(".json").read_text(encoding="utf-8"))
    read = {name: _READ[kind] for name, kind in described["columns"].items()}
    with Path(path).open(encoding="utf-8", newline="") as file:
        rows = ({name: None if cell == "" else read[name](cell) for name, cell in row.items()}
                for row in csv.DictReader(file))
        return StoredRows(rows, described)


def provenance(**parameters: Any) -> dict[str, Any]:
    """Return ``parameters`` with the versions of Python, asympk and ``PACKAGES``."""
    versions = {"python": python_version(), "asympk": __version__}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return {**parameters, "versions": versions}


def in_kept_digits(numbers: Row) -> Row:
    """Return numbers with the ``KEPT`` digits that a row keeps of them; None stays None."""
    return {name: None if value is None else float(f"{float(value):.{KEPT}g}") for name, value in numbers.items()}


def _kind(name, values):
    kinds = {type(v).__name__ for v in values if v is not None}
    if kinds == {"int", "float"}:
        return "float"
    if len(kinds) > 1 or not kinds <= set(_READ):
        raise InputError(f"column {name!r} holds {', '.join(sorted(kinds))}; give one of {', '.join(_READ)}")
    return kinds.pop() if kinds else "str"


def _cell(value, kind):
    if value is None:
        return ""
    if value == "":
        raise InputError("a cell is an empty word, which would read back as None; give None")
    if value != value:
        raise InputError("a cell is NaN; leave it empty (None) and say why in a word beside it")
    if kind == "bool":
        return "true" if value else "false"
    return repr(float(value)) if kind == "float" else str(value)
