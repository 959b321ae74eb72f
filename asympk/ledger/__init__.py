"""The ledger: the claims of Fufaev's 1991 paper, sentence by sentence, each with a verdict and its evidence.

A claim is a function that yields checks, and its verdict follows from which checks hold, by the rule in ``verdicts``.
The claims are in ``rigid``, ``elastic``, ``geometry`` and ``jumps``, in the order of the paper, and in
``predecessors`` and ``remarks``. ``runs`` has the numeric evidence.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module

from asympk.errors import UnknownName
from asympk.ledger.verdicts import Claim, Claims
from asympk.numbers import require_callback

_SECTIONS = ("rigid", "elastic", "geometry", "jumps", "predecessors", "remarks")


def claims(progress: Callable[[str], None] | None = None) -> Claims:
    """Check every claim of the paper and return them in order; ``progress`` is called with each claim's id."""
    require_callback("progress", progress, "; of all claims choose one by its .id")
    found = []
    for identifier, judged in _functions().items():
        if progress:
            progress(identifier)
        found.append(judged())
    return Claims(found)


def claim_called(identifier: str) -> Claim:
    """Check one claim; raises ``UnknownName`` for an id that the paper's ledger does not have."""
    identifier = identifier.upper() if isinstance(identifier, str) else identifier
    if identifier not in _functions():
        ids = list(_functions())
        raise UnknownName(f"claim {identifier!r} is unknown; the ledger has {ids[0]} to {ids[-1]}")
    return _functions()[identifier]()


@cache
def _functions():
    modules = (import_module(f"asympk.ledger.{section}") for section in _SECTIONS)
    found = {f.id: f for module in modules for f in vars(module).values() if hasattr(f, "id") and callable(f)}
    return dict(sorted(found.items()))
