"""A family of scenes, the object of a sweep: the quantities that may vary, and how trajectories are followed.

The families are ``rods.RodFamily``, ``rods.PhysicalRodFamily`` and ``systems.SystemFamily``.

1. ``fields`` name the quantities that may vary, in order: in a grid the later ones vary faster.
2. ``states`` name the states whose final values are stored; ``alphabet`` encodes the itineraries.
3. ``description`` is plain data that distinguishes the family from every other family.
4. ``given`` returns {field: entry} of a TOML table; ``number`` reads one number of a field; both raise ``InputError``.
5. ``check`` raises ``InputError`` where a range contains values that are not allowed, before anything is computed.
6. ``chunk`` returns the number of trajectories per chunk, used where the file gives none.
7. ``follow`` takes {field: number or array}; without ``itineraries`` the last three results may be None.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from asympk.errors import InputError
from asympk.numbers import short

DIGITS = 100  # of an irrational number: a double has 17, and the manifest lists every value of a grid


@dataclass(frozen=True)
class Axis:
    """How one quantity varies: ``kind`` is "values" (a grid, or one number), "uniform" or "log_uniform"."""

    kind: str
    values: tuple

    @property
    def random(self) -> bool:
        """Whether the quantity is drawn at random."""
        return self.kind != "values"

    @property
    def points(self) -> int:
        """The number of grid points that this quantity contributes."""
        return 1 if self.random else len(self.values)


class Followed(NamedTuple):
    """The results of trajectories: ``final`` states (n, size), ``n_events`` and ``outcome`` as in ``Many``.

    ``first`` (frictions, size) is the phase of every friction at the start, an index in ``PHASES``, valid where the
    outcome is 0. ``kind`` and ``friction`` list the events of all trajectories, one trajectory after the other.
    """

    final: Any
    n_events: Any
    outcome: Any
    first: Any = None
    kind: Any = None
    friction: Any = None


def require_time(field: str, axes: Mapping[str, Axis]) -> None:
    """Raise ``InputError`` where the range of a time contains negative values."""
    if (least := min(axes[field].values)) < 0:
        raise InputError(f"{field} reaches {float(least):g}: it must be zero or positive")


def require_static(static: str, kinetic: str, axes: Mapping[str, Axis]) -> None:
    """Raise ``InputError`` where the least static friction, if given, is below the largest kinetic friction."""
    if static in axes and min(axes[static].values) < max(axes[kinetic].values):
        raise InputError(f"{static} reaches below the largest {kinetic}: it must be at least {kinetic} everywhere")


def by_state(start: Any, states: tuple[str, ...]) -> dict[str, Any]:
    """Return {state: entry} of a list; raises ``InputError`` unless ``start`` is a list with one entry per state."""
    if not isinstance(start, list) or len(start) != len(states):
        raise InputError(f"start = {short(start)}: it must be a list of {len(states)}: {', '.join(states)}")
    return dict(zip(states, start, strict=True))
