"""The reader of a name from a list of known names (methods, targets, mechanisms, claims), in upper or lower case."""

from collections.abc import Collection, Iterable
from typing import Any

from asympk.errors import UnknownName
from asympk.numbers import short


def named(kind: str, word: Any, known: Collection[str], beyond: str = "") -> str:
    """Return the name of ``known`` that ``word`` spells, in upper or lower case.

    Raises ``UnknownName``, which names the nearest name and all known ones; ``beyond`` is appended to its message.

    >>> named("method", "LSODA", ("exact", "lsoda"))
    'lsoda'
    """
    if isinstance(word, str) and word in known:
        return word
    folded = {name.lower(): name for name in known}
    if isinstance(word, str) and word.lower() in folded:
        return folded[word.lower()]
    near = nearest(word.lower(), folded) if isinstance(word, str) else ""
    hint = f"did you mean {folded[near]!r}? " if near else ""
    raise UnknownName(f"{kind} {short(word)} is unknown; {hint}choose one of {', '.join(known)}{beyond}")


def nearest(word: str, known: Iterable[str], alike: float = 0.6) -> str:
    """Return the one of ``known`` that is spelt most like ``word``, or "" where none is ``alike``, from 0 to 1."""
    from difflib import get_close_matches

    return next(iter(get_close_matches(word[:60], known, 1, alike)), "")
