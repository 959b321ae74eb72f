"""Chunks of a sweep: computed anywhere, stored as bytes that depend on the sweep alone, told whole from damaged.

A chunk holds, per trajectory, x, y, z at the end, the number of events and of collisions (``velocity_zero``), the
itinerary as a number (``itinerary``), and an outcome: 0, or why there is no result (``arrays.OUTCOMES``): then x, y, z
are NaN and the others 0.
"""

import re
from pathlib import Path

from asympk import __version__
from asympk.errors import InputError, MissingPackage
from asympk.numbers import short
from asympk.path import KINDS, MODES
from asympk.sweep import stored
from asympk.systems.painleve_klein.arrays import OUTCOMES

_NAME = re.compile(r"chunk-(\d{8,15})\.(?:npz|parquet)", re.ASCII)
_LONGEST = 30  # events that fit into an itinerary, two bits each


def provenance(sweep, index):
    """Return what a chunk says of itself."""
    import numpy as np

    start, stop = sweep.rows(index)
    return {"sweep": sweep.digest, "chunk": index, "start": start, "stop": stop, "asympk": __version__,
            "numpy": np.__version__}  # fmt: skip


def compute(sweep, index):
    """Follow the trajectories of one chunk and return it as (provenance, bytes of its file)."""
    story = provenance(sweep, index)
    columns = follow(sweep.columns(*sweep.rows(index)), story["stop"] - story["start"], sweep.itineraries)
    return story, stored.content(columns, story, sweep.format)


def follow(columns, size, itineraries=True):
    """Return {name: array} of what becomes of ``size`` trajectories."""
    import numpy as np

    from asympk.systems.painleve_klein.arrays.ensemble import solve_many

    arrays = {field: np.broadcast_to(values, (size,)) for field, values in columns.items()}
    many = solve_many(**arrays, events=itineraries)
    found = {**dict(zip("xyz", many.final, strict=True)), "n_events": many.n_events, "outcome": many.outcome}
    if itineraries:
        found["collisions"], found["itinerary"] = _told(arrays, many)
    return {name: found[name].astype(kind) for name, kind in _kinds(itineraries).items()}


def _kinds(itineraries):
    kinds = {"x": "<f8", "y": "<f8", "z": "<f8", "n_events": "<u2", "outcome": "u1"}
    return {**kinds, "collisions": "<u2", "itinerary": "<u8"} if itineraries else kinds


def _told(part, many):
    """Return the number of collisions, and the itinerary as a number: see ``itinerary``."""
    import numpy as np

    events, count = many.events(), many.n_events
    kinds, followed = _numbered(events.kind), many.outcome == 0
    code = np.zeros(count.size, "<u8")
    code[followed] = first_modes({field: values[followed] for field, values in part.items()})
    begin = np.cumsum(count) - count
    for n in range(min(_LONGEST, int(count.max(initial=0)))):
        rows = np.flatnonzero(count > n)
        code[rows] = code[rows] << np.uint64(2) | kinds[begin[rows] + n]
    hits = events.trajectory[kinds == 1 + KINDS.index("velocity_zero")]
    return np.bincount(hits, minlength=count.size), code


def _numbered(kinds):
    """Return 1, 2 or 3 for each kind of event, told apart by its first letter: comparing whole words is slow."""
    import numpy as np

    if not kinds.size:
        return np.zeros(0, dtype=np.uint8)
    letters = np.ascontiguousarray(kinds).view(np.uint32).reshape(kinds.size, -1)[:, 0]
    return sum(((letters == ord(kind[0])) * np.uint8(k) for k, kind in enumerate(KINDS, start=1)), np.uint8(0))


def first_modes(part):
    """Return the mode in which each trajectory begins, 1, 2 or 3 in the order of ``MODES``."""
    import numpy as np

    s, z = part["x"] + part["y"], part["z"]
    static = part.get("sigma0", part["sigma"])
    grip = (static + 2) * np.abs(s) - np.abs(1 - s)
    modes = np.where(s * np.sign(z) > 0, 1, 2)
    modes = np.where((z == 0) & (grip > 0), 3, np.where((z == 0) & (s > 0) & (s < 1), 1, modes))
    close = (s == 0) | ((z == 0) & (np.abs(grip) <= 1e-9 * (1 + np.abs(s))))
    for row in np.flatnonzero(close):
        modes[row] = 1 + MODES.index(_first_mode({field: float(values[row]) for field, values in part.items()}))
    return modes


def _first_mode(one):
    from asympk.methods import solve
    from asympk.scene import Scene

    return solve(Scene(one["sigma"], one["mu"], (one["x"], one["y"], one["z"]), 0, one.get("sigma0"))).modes[0]


def itinerary(code):
    """Return the words of an itinerary: the first mode and the kinds of events, two bits each; 30 events at most."""
    digits, code = [], int(code)
    while code:
        digits.append((code & 3) - 1)
        code >>= 2
    *kinds, first = digits
    words = ", ".join(KINDS[k] for k in reversed(kinds))
    return f"{MODES[first]}: {words}" if words else MODES[first]


def name(sweep, index):
    """Return the file name of a chunk."""
    return f"chunk-{index:08d}.{sweep.format}"


def index_of(file):
    """Return the index of the chunk whose file has this name, None for another file."""
    found = _NAME.fullmatch(file)
    return int(found[1]) if found else None


def read(path, only=None):
    """Return (provenance, {name: array}) of a chunk's file, all or ``only`` some; ``InputError`` when it is damaged."""
    path = Path(path)
    try:
        story, columns = stored.load(path)
        _check(story, columns)
    except MissingPackage:
        raise
    except Exception as reason:  # a damaged archive makes its reader fail in any way
        raise InputError(f"{path}: the chunk is damaged ({short(str(reason))}); run its sweep again") from None
    return story, columns if only is None else {name: columns[name] for name in only}


def _check(story, columns):
    """Require all the columns of a chunk and no other, of their kinds and lengths, with outcomes that exist."""
    import numpy as np

    expected = _kinds("itinerary" in columns)
    if {name: values.dtype for name, values in columns.items()} != {k: np.dtype(v) for k, v in expected.items()}:
        raise ValueError(f"its columns are {', '.join(columns)}")
    if any(values.shape != (story["stop"] - story["start"],) for values in columns.values()):
        raise ValueError("its columns are not as long as it says")
    if (columns["outcome"] >= len(OUTCOMES)).any():
        raise ValueError("an outcome does not exist")
    if "itinerary" in columns:
        for code in np.unique(columns["itinerary"][columns["outcome"] == 0]):
            itinerary(code)
