"""Reading TOML: decimals stay exact, and unknown keys are refused."""

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

from asympk.errors import InputError
from asympk.naming import nearest
from asympk.numbers import short
from asympk.storage.files import read_bytes

LARGEST = 1_000_000  # bytes of a file


def read_table(path: str | Path) -> dict[str, Any]:
    """Return the table in the file or pipe ``path``; raises ``InputError`` unless it is TOML, ``OSError``."""
    if not isinstance(path, str | Path):
        raise InputError(f"{short(path)} is no name of a file; give a string or a Path")
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: it is a directory; give a TOML file in it")
    if not path.exists():
        raise InputError(f"{path}: there is no such file")
    raw = read_bytes(path, LARGEST + 1)
    if len(raw) > LARGEST:
        raise InputError(f"{path}: it goes on beyond {LARGEST} bytes; a file of settings has at most as many")
    return parse_table(raw, path)


def parse_table(raw: bytes, where: str | Path) -> dict[str, Any]:
    """Return the table in the bytes ``raw``, every decimal a string that spells it, so that 0.2 stays 1/5.

    A byte order mark, which some editors put first, is skipped.
    """
    try:
        return tomllib.loads(raw.decode("utf-8-sig"), parse_float=lambda text: str(Decimal(text)))
    except (ValueError, RecursionError, ArithmeticError) as error:
        reason = "a number has too many digits, or tables stand too deep in one another"
        if isinstance(error, tomllib.TOMLDecodeError | UnicodeDecodeError):
            reason = str(error)[:200]
        if isinstance(error, tomllib.TOMLDecodeError) and "Cannot" not in reason:
            reason += "; text and names with a prime stand in quotes, such as \"75 deg\" and \"x'\""
        raise InputError(f"{where}: not TOML in UTF-8: {reason}") from None


def refuse_unknown(
    table: Mapping[str, Any], known: Iterable[str], where: str | Path, above: Iterable[str] = ()
) -> None:
    """Raise ``InputError`` for the first key of ``table`` that is not ``known``, naming those that may be meant.

    Of a key of ``above`` it tells that it belongs above the head of this table, which is one of several in ``where``.
    """
    for key in table:
        if key not in known:
            if key in above:
                head = str(where).rstrip("[] 0123456789")
                below = f", below [{outer}]" if (outer := head.rpartition(".")[0]) else ""
                raise InputError(f"{where}: {key} is below [[{head}]] and must be above it{below}")
            near = nearest(key.lower(), known)
            meant = f"the nearest known one is {near!r}" if near else f"choose one of {', '.join(known)}"
            raise InputError(f"{where}: key {key!r:.60} is unknown; {meant}")


def require_keys(table: Mapping[str, Any], keys: Iterable[str], where: str | Path = "") -> None:
    """Raise ``InputError`` where keys of ``table`` are missing, and tell if one stands below the head of a table."""
    if missing := [key for key in keys if key not in table]:
        raise InputError(f"{where}{': ' if where else ''}{', '.join(missing)} missing{misplaced(table, missing)}")


def misplaced(table: Mapping[str, Any], keys: Iterable[str]) -> str:
    """Return where the first of ``keys`` that stands only below the head of a table belongs, or "" if none does."""
    below = (f"; {key} is below {head} and must be above the first table"
             for key in keys if key not in table for head, part in _headed(table) if key in part)
    return next(below, "")


def _headed(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the heads of all tables in a table, such as [values] or [[system.frictions]], and these tables."""
    for name, part in table.items():
        several = isinstance(part, list)
        for entry in part if several else [part]:
            if isinstance(entry, dict):
                yield f"[[{above}{name}]]" if several else f"[{above}{name}]", entry
                yield from _headed(entry, f"{above}{name}.")


def word(table: Mapping[str, Any], key: str, default: str = "") -> str:
    """Return the string ``table[key]``; raises ``InputError`` when it is something else."""
    value = table.get(key, default)
    if not isinstance(value, str):
        raise InputError(f"{key} = {value!r:.60}: it must be a string")
    return value


def table_in(table: Mapping[str, Any], key: str, where: str = "") -> dict[str, Any]:
    """Return the table ``table[key]``, {} where it is missing; raises ``InputError`` when it is something else."""
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{where}{key} = {value!r:.60}: it must be a table, [{where}{key}]")
    return value


def tables_in(table: Mapping[str, Any], key: str, where: str = "") -> list[dict[str, Any]]:
    """Return the list of tables ``table[key]``, [] where it is missing; raises ``InputError`` for something else."""
    found = table.get(key, [])
    if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
        raise InputError(f"{where}{key} must be tables, each under [[{where}{key}]]")
    return found
