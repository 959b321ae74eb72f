"""A family of scenes, the object of a sweep: the quantities that may vary, and how trajectories are followed."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from asympk.errors import InputError
from asympk.numbers import short
from asympk.sweep.itineraries import Alphabet

if TYPE_CHECKING:
    from asympk.sweep.sweepfile import Axis


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


class Family(Protocol):
    """A family of scenes.

    1. ``fields`` name the quantities that may vary, in order: in a grid the later ones vary faster.
    2. ``states`` name the states whose final values are stored; ``alphabet`` encodes the itineraries.
    3. ``description`` is plain data that distinguishes the family from every other family.
    4. ``given`` returns {field: entry} of a TOML table; ``number`` reads one number of a field.
    5. ``check`` raises ``InputError`` where a range contains values that are not allowed, before anything is computed.
    6. ``chunk`` returns the number of trajectories per chunk, used where the file gives none.
    7. ``follow`` takes {field: number or array}; without ``itineraries`` the last three results may be None.
    """

    @property
    def fields(self) -> tuple[str, ...]: ...
    @property
    def states(self) -> tuple[str, ...]: ...
    @property
    def alphabet(self) -> Alphabet: ...
    @property
    def description(self) -> dict[str, Any]: ...
    def given(self, table: Mapping[str, Any]) -> dict[str, Any]: ...
    def number(self, field: str, value: Any) -> Any: ...
    def check(self, axes: "Mapping[str, Axis]") -> None: ...
    def chunk(self, axes: "Mapping[str, Axis]") -> int: ...
    def follow(self, columns: Mapping[str, Any], size: int, itineraries: bool) -> Followed: ...


def require_time(field: str, axes: "Mapping[str, Axis]") -> None:
    """Raise ``InputError`` where the range of a time contains negative values."""
    if (least := min(axes[field].values)) < 0:
        raise InputError(f"{field} reaches {float(least):g}: it must be zero or positive")


def require_static(static: str, kinetic: str, axes: "Mapping[str, Axis]") -> None:
    """Raise ``InputError`` where the least static friction, if given, is below the largest kinetic friction."""
    if static in axes and min(axes[static].values) < max(axes[kinetic].values):
        raise InputError(f"{static} reaches below the largest {kinetic}: it must be at least {kinetic} everywhere")


def by_state(start: Any, states: tuple[str, ...]) -> dict[str, Any]:
    """Return {state: entry} of a list; raises ``InputError`` unless ``start`` is a list with one entry per state."""
    if not isinstance(start, list) or len(start) != len(states):
        raise InputError(f"start = {short(start)}: it must be a list of {len(states)}: {', '.join(states)}")
    return dict(zip(states, start, strict=True))
