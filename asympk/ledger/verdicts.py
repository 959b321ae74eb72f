"""Check, Claim, and the rule that turns checks into a verdict."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache, wraps
from typing import Any

from asympk.shown import Card, ShownAsTable

VERDICTS = ("confirmed", "refined", "corrected")
UNSETTLED = "not settled"


@dataclass(frozen=True)
class Check:
    """One piece of evidence for or against a claim.

    ``role`` is "as written" (the check is of the sentence itself), "left out" (of a condition or a quantity that the
    sentence omits although it matters) or "instead" (of the statement that replaces a false sentence). ``kind`` is
    "symbolic" or "numeric".
    """

    role: str
    kind: str
    what: str
    holds: bool
    value: str = ""


@dataclass(frozen=True, repr=False)
class Claim(ShownAsTable):
    """A sentence of the paper with its verdict: confirmed, refined, corrected, or not settled when checks fail.

    ``finding`` states what the sentence leaves out or what holds instead, and is empty for a confirmed claim.
    """

    id: str
    where: str
    statement: str
    verdict: str
    evidence: tuple[Check, ...]
    finding: str = ""

    def _card(self) -> Card:
        rows = [("says", self.statement), *([("but", self.finding)] if self.finding else [])]
        rows += [(f"{check.role}, {check.kind}", f"{'holds' if check.holds else 'fails'}: {check.what}")
                 for check in self.evidence]
        return Card(f"Claim {self.id} (section {self.where}): {self.verdict}", tuple(rows))

    def as_dict(self) -> dict[str, Any]:
        """Return the claim as plain dictionaries, for JSON."""
        return asdict(self)


class Claims(ShownAsTable, tuple):
    """Claims in their order, shown as the ledger: a line on each."""

    def _card(self) -> Card:
        return Card(f"{len(self)} claims", tuple((one.id, f"{one.verdict}: {one.statement}") for one in self))


def verdict(evidence: Sequence[Check]) -> str:
    """Return the verdict on a claim from its checks.

    Confirmed: all checks "as written" hold, and no check "left out" holds. Refined: all checks "as written" hold, and
    one "left out" does. Corrected: one "as written" fails, and all checks "left out" and "instead" hold, of which at
    least one is "instead". Not settled: anything else, or evidence that is not both symbolic and numeric.
    """
    by_role = {role: [c.holds for c in evidence if c.role == role] for role in ("as written", "left out", "instead")}
    if not {check.kind for check in evidence} >= {"symbolic", "numeric"} or not by_role["as written"]:
        return UNSETTLED
    if all(by_role["as written"]):
        return "refined" if any(by_role["left out"]) else "confirmed"
    replaced = by_role["left out"] + by_role["instead"]
    return "corrected" if by_role["instead"] and all(replaced) else UNSETTLED


def claim(
    identifier: str, where: str, statement: str, finding: str = ""
) -> Callable[[Callable[[], Iterator[Check]]], Callable[[], Claim]]:
    """Return a decorator that turns a function that yields checks into one that returns a judged ``Claim``.

    The checks are run once per process. ``finding`` is the finding of the claim unless the verdict is "confirmed".
    """

    def decorate(checks):
        @cache
        @wraps(checks)
        def judged():
            evidence = tuple(checks())
            judgement = verdict(evidence)
            return Claim(identifier, where, statement, judgement, evidence, "" if judgement == "confirmed" else finding)

        judged.id = identifier
        return judged

    return decorate


@dataclass(frozen=True)
class Role:
    """A role that evidence can have, which makes checks of either kind."""

    name: str

    def symbolic(self, what: str, holds: Any, value: Any = "") -> Check:
        """Return a check in symbols; ``value`` is what was found."""
        return Check(self.name, "symbolic", what, bool(holds), str(value))

    def numeric(self, what: str, holds: Any, value: Any = "") -> Check:
        """Return a check in numbers; ``value`` is what was found."""
        return Check(self.name, "numeric", what, bool(holds), str(value))


symbolic, numeric = Role("as written").symbolic, Role("as written").numeric
left_out, instead = Role("left out"), Role("instead")
