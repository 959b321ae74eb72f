"""The summary of a sweep: counts and exact quantiles, chunk by chunk, in memory that does not grow with the sweep.

``quantiles`` is the hard function: it selects ranks by the leading bits of doubles, a few bits in each pass.
"""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from asympk.many import OUTCOMES
from asympk.storage.files import write_text
from asympk.sweep import read_manifest, results
from asympk.sweep.directory import SUMMARY
from asympk.sweep.systems import SystemFamily

PROBABILITIES = (0, 0.05, 0.25, 0.5, 0.75, 0.95, 1)
_WIDTHS = (20, 16, 14, 14)  # bits of a double that each pass finds; 64 in all
_GATHERED = 4_000_000  # doubles that may be held at once
_REFUSED = OUTCOMES.index("refused")
_COLUMNS = {"outcomes": "outcome", "events": "n_events", "collisions": "collisions", "itineraries": "itinerary"}


def summarise(out: str | Path) -> dict[str, Any]:
    """Return the summary of the complete sweep in ``out`` and write it to ``SUMMARY`` there.

    ``refused`` says why the first trajectory that is refused is so.
    Quantiles are exact: the quantile of a state at p is the element of rank floor(p (n - 1)) of its n final values.
    """
    out = Path(out)
    sweep = read_manifest(out)[0]
    counts: dict[str, Counter] = {name: Counter() for name in _COLUMNS}
    found = quantiles(lambda first: _final_states(out, sweep.family.states, counts if first else None), PROBABILITIES)
    summary = {
        "trajectories": sum(counts["outcomes"].values()),
        "outcomes": {OUTCOMES[k]: n for k, n in sorted(counts["outcomes"].items())},
        "refused": _first_refusal(out, sweep) if _REFUSED in counts["outcomes"] else "",
        "events": {str(k): n for k, n in sorted(counts["events"].items())},
        "collisions": {str(k): n for k, n in sorted(counts["collisions"].items())},
        "itineraries": {sweep.family.alphabet.words(k): n
                        for k, n in sorted(counts["itineraries"].items(), key=lambda p: (-p[1], p[0]))},
        "probabilities": list(PROBABILITIES),
        "quantiles": found,
    }
    write_text(out / SUMMARY, json.dumps(summary, indent=1) + "\n")
    return summary


def _first_refusal(out, sweep):
    """Return why the first trajectory that is refused is so, or "" where its family does not tell."""
    chunks = ((chunk["start"], columns["outcome"] == _REFUSED) for _, chunk, columns in results(out, ("outcome",)))
    k = next(start + int(refused.argmax()) for start, refused in chunks if refused.any())
    words = isinstance(sweep.family, SystemFamily) and sweep.family.refusal(sweep.quantities(k, k + 1))
    return f"trajectory {k}: {words}" if words else ""


def _final_states(out, states, counts):
    """Yield {state: final values} of every chunk, adding its other columns to ``counts`` if given."""
    for _, _, columns in results(out, None if counts else (*states, "outcome")):
        good = columns["outcome"] == 0
        for name, column in _COLUMNS.items() if counts else ():
            if column in columns:
                values = columns[column] if name == "outcomes" else columns[column][good]
                found, times = np.unique(values, return_counts=True)
                counts[name].update(dict(zip(found.tolist(), times.tolist(), strict=True)))
        yield {state: columns[state][good] for state in states}


def quantiles(
    parts: Callable[[bool], Iterable[dict[str, np.ndarray]]], probabilities: Sequence[float]
) -> dict[str, list[float]]:
    """Return {axis: quantiles} of all arrays that ``parts(first)`` yields as {axis: array}, in at most four passes.

    Doubles are ranked as integers of the same order. A pass counts the next bits of the integers that share the known
    leading bits of a wanted quantile; once such integers are few, a pass gathers and sorts them. ``first`` is true in
    the first pass alone.
    """
    searches: dict[str, _Search] = {}
    shift = 64
    for width in _WIDTHS:
        first, shift = shift == 64, shift - width
        for part in parts(first):
            for axis, values in part.items():
                searches.setdefault(axis, _Search(probabilities)).look(_keys(values), shift, width)
        for search in searches.values():
            search.narrow(shift, width)
        if not any(search.wanted for search in searches.values()):
            break
    return {axis: [_double(key) for key in search.found] for axis, search in searches.items()}


class _Search:
    """The keys of one axis that are wanted: the known leading bits of each, and its rank among keys with these bits."""

    def __init__(self, probabilities):
        self.probabilities, self.wanted, self.found = probabilities, [(0, 0)], []
        self.few, self.tables, self.gathered = False, {}, {}

    def look(self, keys, shift, width):
        """Count, or gather, the ``keys`` that begin with wanted bits."""
        for prefix in {prefix for prefix, _ in self.wanted}:
            chosen = keys if shift + width == 64 else keys[keys >> shift + width == prefix]
            if self.few:
                self.gathered.setdefault(prefix, []).append(chosen)
            elif chosen.size:
                digits = ((chosen >> shift) - (prefix << width)).view(np.int64)
                least = int(digits.min())
                counted = np.bincount(digits - least)
                if prefix not in self.tables:
                    self.tables[prefix] = np.zeros(1 << width, dtype=np.int64)
                self.tables[prefix][least:least + counted.size] += counted

    def narrow(self, shift, width):
        """Find the next bits of every wanted key from the counts, or all its bits from the gathered keys."""
        if self.few:
            pools = {prefix: np.sort(np.concatenate(pieces)) for prefix, pieces in self.gathered.items()}
            self.found, self.wanted = [int(pools[p][rank]) for p, rank in self.wanted], []
            return
        if shift + width == 64:
            total = int(sum(table.sum() for table in self.tables.values()))
            self.wanted = [(0, int(p * (total - 1))) for p in self.probabilities] if total else []
        sizes, longer = {}, []
        for prefix, rank in self.wanted:
            table = self.tables[prefix]
            below = np.cumsum(table)
            digit = int(np.searchsorted(below, rank, side="right"))
            longer.append(((prefix << width) + digit, rank - int(below[digit - 1]) if digit else rank))
            sizes[longer[-1][0]] = int(table[digit])
        self.wanted, self.tables, self.few = longer, {}, sum(sizes.values()) <= _GATHERED
        if not shift:
            self.found, self.wanted = [key for key, _ in longer], []


def _keys(values):
    """Return doubles as unsigned integers in the same order; -0.0 counts as 0.0."""
    bits = (values + 0.0).view(np.int64)
    return (bits ^ (bits >> 63 | -(2**63))).view(np.uint64)


def _double(key):
    return float(np.uint64(key ^ (2**63 if key >> 63 else 2**64 - 1)).view(np.float64))
