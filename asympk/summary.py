"""What a sweep found: counted and ranked chunk by chunk, with memory that does not grow with the sweep."""

import json
from collections import Counter
from pathlib import Path

from asympk.chunks import OUTCOMES, itinerary
from asympk.files import write_text
from asympk.sweep import results

PROBABILITIES = (0, 0.05, 0.25, 0.5, 0.75, 0.95, 1)
_BITS, _LEVELS = 16, 4


def summarise(out):
    """Return the summary of the complete sweep in ``out`` and write it to ``summary.json`` there.

    Quantiles are exact: the ones at p are the elements of rank floor(p (n - 1)) of the final x, y, z.
    """
    out = Path(out)
    counts = {"outcomes": Counter(), "events": Counter(), "collisions": Counter(), "itineraries": Counter()}
    for _, _, columns in results(out):
        _count(columns, counts)
    told = {
        "trajectories": sum(counts["outcomes"].values()),
        "outcomes": {OUTCOMES[k]: n for k, n in sorted(counts["outcomes"].items())},
        "events": {str(k): n for k, n in sorted(counts["events"].items())},
        "collisions": {str(k): n for k, n in sorted(counts["collisions"].items())},
        "itineraries": {itinerary(k): n for k, n in sorted(counts["itineraries"].items(), key=lambda p: (-p[1], p[0]))},
        "probabilities": list(PROBABILITIES),
        "quantiles": quantiles(lambda: _finals(out), PROBABILITIES),
    }
    write_text(out / "summary.json", json.dumps(told, indent=1) + "\n")
    return told


def _count(columns, counts):
    import numpy as np

    good = columns["outcome"] == 0
    names = {"outcomes": "outcome", "events": "n_events", "collisions": "collisions", "itineraries": "itinerary"}
    for name, column in names.items():
        if column in columns:
            values = columns[column] if name == "outcomes" else columns[column][good]
            counts[name].update(dict(zip(*(a.tolist() for a in np.unique(values, return_counts=True)), strict=True)))


def _finals(out):
    for _, _, columns in results(out):
        good = columns["outcome"] == 0
        yield {axis: columns[axis][good] for axis in "xyz"}


def quantiles(parts, probabilities):
    """Return {axis: quantiles} of all that ``parts()`` yields, {axis: array} at a time, in four passes.

    A double is ranked as an unsigned integer of the same order; each pass counts the next 16 bits of those that agree
    with a wanted quantile so far.
    """
    import numpy as np

    ranks, prefixes = {}, {}
    for level in range(_LEVELS):
        counts = {}
        for part in parts():
            for axis, values in part.items():
                _count_digits(_keys(values), level, prefixes.get(axis), counts.setdefault(axis, {}))
        for axis, tables in counts.items():
            if level == 0:
                total = int(tables[0].sum())
                ranks[axis] = [int(p * (total - 1)) for p in probabilities] if total else []
                prefixes[axis] = [0] * len(ranks[axis])
            for k, rank in enumerate(ranks[axis]):
                below = np.cumsum(tables[prefixes[axis][k]])
                digit = int(np.searchsorted(below, rank, side="right"))
                ranks[axis][k] = rank - (int(below[digit - 1]) if digit else 0)
                prefixes[axis][k] = prefixes[axis][k] << _BITS | digit
    return {axis: [_double(prefix) for prefix in found] for axis, found in prefixes.items()}


def _count_digits(keys, level, prefixes, tables):
    """Add to ``tables[prefix]`` how often each value of the next digit occurs among keys that begin so."""
    import numpy as np

    shift = 64 - _BITS * (level + 1)
    for prefix in sorted(set(prefixes)) if level else [0]:
        chosen = keys[keys >> np.uint64(shift + _BITS) == np.uint64(prefix)] if level else keys
        digits = ((chosen >> np.uint64(shift)) & np.uint64(2**_BITS - 1)).astype(np.int64)
        tables[prefix] = tables.get(prefix, 0) + np.bincount(digits, minlength=2**_BITS)


def _keys(values):
    """Return doubles as unsigned integers in the same order."""
    import numpy as np

    bits = (values + 0.0).view(np.uint64)
    top = np.uint64(1 << 63)
    return np.where(bits & top, ~bits, bits | top)


def _double(key):
    import struct

    bits = key ^ (1 << 63) if key >> 63 else ~key & (2**64 - 1)
    return struct.unpack("<d", struct.pack("<Q", bits))[0]


def as_text(told):
    """Return a summary as lines that a person reads."""
    lines = [f"{told['trajectories']:,} trajectories: " + ", ".join(f"{n:,} {w}" for w, n in told["outcomes"].items())]
    lines += [f"{n:>14,}  {words}" for words, n in list(told["itineraries"].items())[:12]]
    if len(told["itineraries"]) > 12:
        lines.append(f"{'':>14}  and {len(told['itineraries']) - 12} itineraries more")
    if told["collisions"]:
        lines.append("collisions: " + ", ".join(f"{k}: {n:,}" for k, n in told["collisions"].items()))
    lines.append("quantiles".ljust(10) + "".join(f"{p:>14g}" for p in told["probabilities"]))
    lines += [f"{axis:>9} " + "".join(f"{q:>14.6g}" for q in found) for axis, found in told["quantiles"].items()]
    return "\n".join(lines)
