"""Chunks of a sweep: computed anywhere, stored as bytes that depend on the sweep alone, told whole from damaged.

A chunk holds, per trajectory, x, y, z at the end, the number of events and of collisions (``velocity_zero``), the
itinerary as a number (``itinerary``), and an outcome: 0, or why there is no result (``arrays.OUTCOMES``): then x, y, z
are NaN and the others 0.
"""

import io
import json
import zipfile

from asympk import __version__
from asympk.errors import InputError, MissingPackage
from asympk.path import KINDS, MODES

_LONGEST = 30  # events that fit into an itinerary, two bits each
_EPOCH = (1980, 1, 1, 0, 0, 0)
_DAMAGED = (zipfile.BadZipFile, OSError, EOFError, KeyError, ValueError, NotImplementedError)


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
    return story, (_as_npz if sweep.format == "npz" else _as_parquet)(columns, story)


def follow(columns, size, itineraries=True):
    """Return {name: array} of what becomes of ``size`` trajectories."""
    import numpy as np

    from asympk.arrays.ensemble import solve_many

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


def _as_npz(columns, story):
    """Return a .npz file whose bytes depend on its arrays alone; every entry has its checksum."""
    import numpy as np

    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for key, values in {**columns, "provenance": _text(story)}.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, values, version=(1, 0), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{key}.npy", _EPOCH), entry.getbuffer())
    return buffer.getvalue()


def _text(story):
    import numpy as np

    return np.array(json.dumps(story, sort_keys=True))


def _as_parquet(columns, story):
    pyarrow, parquet = _pyarrow()
    table = pyarrow.table(columns).replace_schema_metadata({"asympk": json.dumps(story, sort_keys=True)})
    sink = pyarrow.BufferOutputStream()
    parquet.write_table(table, sink, compression="none", write_page_checksum=True)
    return sink.getvalue().to_pybytes()


def _pyarrow():
    try:
        import pyarrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise MissingPackage("Parquet needs pyarrow: pip install 'asympk[sweep]', or take format = \"npz\"") from None
    return pyarrow, parquet


def read(path, only=None):
    """Return (provenance, {name: array}) of a chunk's file, all or ``only`` some; ``InputError`` when it is damaged."""
    try:
        return (_read_npz if path.suffix == ".npz" else _read_parquet)(path, only)
    except _DAMAGED as reason:
        raise InputError(f"{path}: the chunk is damaged ({str(reason)[:100]}); run its sweep again") from None


def _read_npz(path, only):
    import numpy as np

    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        wanted = archive.files if only is None else (*only, "provenance")
        columns = {key: archive[key] for key in wanted}  # reading an entry to its end checks its checksum
    return json.loads(str(columns.pop("provenance"))), columns


def _read_parquet(path, only):
    _, parquet = _pyarrow()
    table = parquet.read_table(path, columns=only and [*only], page_checksum_verification=True)
    columns = {key: table[key].to_numpy() for key in table.column_names}
    return json.loads(table.schema.metadata[b"asympk"]), columns
