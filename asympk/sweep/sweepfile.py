r"""The file of a sweep, in TOML: a scene as in ``asympk.scenes.scenefile``, with a grid or a draw for any number.

    seed = 7
    count = 1000000                                   # random draws at every point of the grid
    sigma = [0.5, 1, 2]                               # a grid: these values
    mu = { log_grid = [1e-6, 1e-2], points = 5 }      # or grid = [from, to]
    start = [{ uniform = [-1, 1] }, 0.2, -1]          # x, y, z; or log_uniform = [from, to]
    until = 5

A sweep in physical quantities has m, P, f, alpha, l, k, h in place of sigma and mu; one over any system has
``[system]``, ``[values]`` and ``[start]``; one over a mechanism may be its file, ``asympk.mechanics.described``.

Trajectory i has grid point i // count. A random number depends on the seed, the quantity and i alone: it is the i-th
output of a counter-based generator (Philox) with the key (seed, quantity), whatever the size of the chunks.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from asympk import systems
from asympk.errors import InputError, UnknownName
from asympk.mechanics.described import SWEEP, describes_mechanism, scene_table
from asympk.numbers import number, short, whole
from asympk.scenes.scenefile import NONDIMENSIONAL, PHYSICAL, SYSTEM, UNITS, keys_of, scene_names
from asympk.storage.tomlfile import read_table, refuse_unknown, word
from asympk.sweep.family import Axis
from asympk.sweep.rods import PhysicalRodFamily, RodFamily

if TYPE_CHECKING:
    from asympk.sweep.systems import SystemFamily

Family: TypeAlias = "RodFamily | SystemFamily"
FORMATS = ("npz", "parquet")
_MOST, _MOST_POINTS, _MOST_BITS = 10**12, 10**5, 4000
_SETTINGS = ("name", *SWEEP)
_KEYS = (*_SETTINGS, "about", "sigma", "mu", "sigma0", "start", "until", *PHYSICAL, UNITS, *SYSTEM)
_RANGES = ("grid", "log_grid", "uniform", "log_uniform")


@dataclass(frozen=True)
class Sweep:
    """A sweep: an ``Axis`` per field of a family, draws per grid point, seed, trajectories per chunk, their format."""

    family: Family
    axes: dict
    count: int
    seed: int
    chunk: int
    format: str = "npz"
    itineraries: bool = True
    name: str = ""

    @property
    def total(self) -> int:
        """The number of trajectories."""
        return self.count * math.prod(axis.points for axis in self.axes.values())

    @property
    def chunks(self) -> int:
        """The number of chunks."""
        return -(-self.total // self.chunk)

    def described(self) -> dict[str, Any]:
        """Return all that the results of the sweep depend on, as plain data."""
        axes = {field: [axis.kind, *map(str, axis.values)] for field, axis in self.axes.items()}
        return {**self.family.description, "axes": axes, "count": self.count, "seed": self.seed, "chunk": self.chunk,
                "format": self.format, "itineraries": self.itineraries}

    @property
    def digest(self) -> str:
        """A hash of the description: sweeps whose results could differ have different ones."""
        return hashlib.sha256(json.dumps(self.described(), sort_keys=True).encode()).hexdigest()

    def rows(self, index: int) -> tuple[int, int]:
        """Return (first, last + 1), the range of the trajectories of a chunk."""
        return index * self.chunk, min(self.total, (index + 1) * self.chunk)

    def quantities(self, start: int, stop: int) -> dict[str, Any]:
        """Return {field: number, or array of stop - start numbers} of the trajectories from ``start`` on."""
        columns = {}
        period = self.total  # for how many trajectories in a row a quantity keeps its value: later ones vary faster
        for rank, field in enumerate(self.family.fields):
            if field in self.axes:
                period //= self.axes[field].points
                columns[field] = _column(self.axes[field], start, stop, period, (self.seed, rank))
        return columns


def _column(axis, start, stop, period, key):
    if axis.random:
        return _draws(axis, start, stop, key)
    values = np.array([float(value) for value in axis.values])
    if len(values) == 1:
        return values[0]
    return values[(np.arange(start, stop) // period) % len(values)]


def _draws(axis, start, stop, key):
    """Return the outputs ``start`` to ``stop`` of the stream ``key``, 53 bits each, spread over the range."""
    block = start // 4  # Philox makes four numbers at each value of its counter
    raw = np.random.Philox(key=key, counter=block).random_raw(stop - 4 * block)[start - 4 * block:]
    part = (raw >> np.uint64(11)) * 2.0**-53
    low, high = map(float, axis.values)
    if axis.kind == "uniform":
        return low + (high - low) * part
    return np.exp(math.log(low) + (math.log(high) - math.log(low)) * part)


def from_description(description: Mapping[str, Any]) -> Sweep:
    """Return the ``Sweep`` of a description from ``Sweep.described``; an invalid one raises an error."""
    axes = {field: Axis(kind, tuple(Fraction(number(field, value)) for value in values))
            for field, (kind, *values) in description["axes"].items()}
    settings = (description[key] for key in ("count", "seed", "chunk", "format", "itineraries"))
    sweep = Sweep(_described(description), axes, *settings)
    if sweep.described() != description or sweep.format not in FORMATS or not 1 <= sweep.chunk <= 2**24:
        raise InputError("it does not describe a sweep")
    return sweep


def read_sweep(path: str | Path) -> Sweep:
    """Return the ``Sweep`` in the TOML file ``path``; raises ``InputError`` if the file describes none."""
    if str(path) in (*scene_names(), *systems.__all__) and not Path(path).exists():
        raise InputError(f"{path}: it is one scene; asympk scenes {path} prints its file, in which a list, a grid or a "
                         "random draw in place of a number makes a sweep")
    return sweep_of_table(read_table(path), path)


def sweep_of_table(table: Mapping[str, Any], where: str | Path) -> Sweep:
    """Return the ``Sweep`` in a table of TOML, that of a mechanism that is a scene, too, included."""
    if describes_mechanism(table):
        settings = {key: value for key, value in table.items() if key in _SETTINGS}
        table = scene_table({key: table[key] for key in table.keys() - settings.keys()}, where) | settings
    if "near" in table:
        raise InputError(f"{where}: near is of one scene; a sweep gives its starts by start")
    refuse_unknown(table, _KEYS, where)
    try:
        word(table, "about")
        return _sweep(table)
    except (InputError, UnknownName) as error:
        raise type(error)(f"{where}: {error}") from None


def _sweep(table):
    family = _family(table)
    given = family.given(table)
    axes = {field: _axis(family, field, given[field]) for field in family.fields if field in given}
    family.check(axes)
    sweep = Sweep(family, axes, whole("count", table.get("count", 1), 1, _MOST),
                  whole("seed", table.get("seed", 0), 0, 2**64 - 1),
                  whole("chunk", table.get("chunk", family.chunk(axes)), 1, 2**24), word(table, "format", "npz"),
                  table.get("itineraries", True), word(table, "name"))
    _check(sweep, table)
    return sweep


def _family(table):
    """Return the family that a table of TOML sweeps over; raises ``InputError``."""
    keys = keys_of(table)
    if keys is PHYSICAL:
        return PhysicalRodFamily()
    if keys is NONDIMENSIONAL:
        return RodFamily()
    from asympk.sweep.systems import family_of_table

    return family_of_table(table)


def _described(description):
    """Return the family of a ``description``; an invalid description raises, or yields a family with another one."""
    if "system" in description:
        from asympk.sweep.systems import SystemFamily

        return SystemFamily.described(description)
    return PhysicalRodFamily() if "quantities" in description else RodFamily()


def _check(sweep, table):
    if sweep.format not in FORMATS:
        raise InputError(f"format = {sweep.format!r:.40}: it must be one of {', '.join(FORMATS)}")
    if not isinstance(sweep.itineraries, bool):
        raise InputError(f"itineraries = {sweep.itineraries!r:.40}: it must be true or false")
    drawn = [field for field, axis in sweep.axes.items() if axis.random]
    if drawn and not {"seed", "count"} <= set(table):
        raise InputError(f"{drawn[0]} is random: seed and count must be given")
    if not drawn and sweep.count > 1:
        raise InputError("count is for random quantities, and none is random")
    if sweep.total > _MOST:
        raise InputError(f"{sweep.total} trajectories; at most {_MOST} are swept over")


def _axis(family, field, value):
    if isinstance(value, dict):
        return _range(family, field, value)
    values = value if isinstance(value, list) else [value]
    if not 1 <= len(values) <= _MOST_POINTS:
        raise InputError(f"{field}: a list of values must have from 1 to {_MOST_POINTS}")
    return Axis("values", tuple(_exact(family, field, v) for v in values))


def _range(family, field, table):
    refuse_unknown(table, (*_RANGES, "points"), field)
    kinds = [kind for kind in _RANGES if kind in table]
    ends = table[kinds[0]] if len(kinds) == 1 else None
    if not isinstance(ends, list) or len(ends) != 2:
        raise InputError(f"{field}: it must have one of {', '.join(_RANGES)}, with two ends")
    low, high = (_exact(family, field, end) for end in ends)
    if not low < high or (kinds[0].startswith("log") and low <= 0):
        raise InputError(f"{field} from {float(low):g} to {float(high):g}: the ends must grow, log ones be positive")
    if kinds[0].endswith("uniform"):
        if "points" in table:
            raise InputError(f"{field}: points belong to a grid; count says how many are drawn")
        return Axis(kinds[0], (low, high))
    if "points" not in table:
        raise InputError(f"{field}: a grid needs points")
    return Axis("values", _grid(kinds[0], low, high, whole(f"{field}: points", table["points"], 2, _MOST_POINTS)))


def _exact(family, field, value):
    """Return a number exactly; raises ``InputError`` where no double, in which trajectories are followed, holds it."""
    exact = Fraction(family.number(field, value))
    if exact.denominator.bit_length() > _MOST_BITS:
        raise InputError(f"{field} = {short(value)}: a double must be able to hold it")
    return exact


def _grid(kind, low, high, points):
    if kind == "grid":
        return tuple(low + (high - low) * Fraction(i, points - 1) for i in range(points))
    begin, step = math.log(low), (math.log(high) - math.log(low)) / (points - 1)
    return (low, *(Fraction(math.exp(begin + step * i)) for i in range(1, points - 1)), high)
