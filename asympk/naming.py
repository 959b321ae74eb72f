"""The reader of a name from a list of known names (methods, targets, mechanisms, claims), in upper or lower case."""

from collections.abc import Collection
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
    from difflib import get_close_matches

    near = get_close_matches(str(word)[:60].lower(), folded, 1)
    hint = f"did you mean {folded[near[0]]!r}? " if near else ""
    raise UnknownName(f"{kind} {short(word)} is unknown; {hint}choose one of {', '.join(known)}{beyond}")
