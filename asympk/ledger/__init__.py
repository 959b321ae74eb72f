"""The ledger: what Fufaev's 1991 paper claims, sentence by sentence, and what holds.

A claim is a function that yields checks; its verdict follows from which of them hold. ``verdicts`` has the rule,
``rigid``, ``elastic``, ``geometry``, ``motion`` and ``jumps`` the claims in the paper's order.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module

from asympk.errors import UnknownName
from asympk.ledger.verdicts import Check, Claim, Claims

__all__ = ["Check", "Claim", "claim", "claims", "evaluate"]

_SECTIONS = ("rigid", "elastic", "geometry", "motion", "jumps", "predecessors", "remarks")


def claims(progress: Callable[[str], None] | None = None) -> Claims:
    """Check every claim of the paper and return them in order; ``progress`` is called with each claim's id."""
    found = []
    for identifier in _functions():
        if progress:
            progress(identifier)
        found.append(judged(identifier))
    return Claims(found)


def claim_called(identifier: str) -> Claim:
    """Check one claim; raises ``UnknownName`` for an id that the paper's ledger does not have."""
    identifier = identifier.upper() if isinstance(identifier, str) else identifier
    if identifier not in _functions():
        ids = list(_functions())
        raise UnknownName(f"claim {identifier!r} is unknown; the ledger has {ids[0]} to {ids[-1]}")
    return judged(identifier)


@cache
def judged(identifier: str) -> Claim:
    """Run the checks of one claim, once per process."""
    return _functions()[identifier]()


@cache
def _functions():
    modules = (import_module(f"asympk.ledger.{section}") for section in _SECTIONS)
    found = {f.id: f for module in modules for f in vars(module).values() if hasattr(f, "id") and callable(f)}
    return dict(sorted(found.items()))
