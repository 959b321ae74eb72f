"""What a sweep runs through: a family of scenes, its quantities, and how its trajectories are followed."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from asympk.errors import InputError
from asympk.numbers import short
from asympk.sweep.itineraries import Alphabet

if TYPE_CHECKING:
    from asympk.sweep.sweepfile import Axis


class Followed(NamedTuple):
    """What becomes of trajectories: ``final`` states (n, size), ``n_events`` and ``outcome`` as in ``Many``.

    ``first`` (frictions, size) tells what every friction does at the start, a place in ``PHASES``, where there is no
    outcome; ``kind`` and ``friction`` are of all events, trajectory by trajectory.
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
    2. ``states`` name the states whose final values are stored; ``alphabet`` has the letters of the itineraries.
    3. ``description`` is plain data that tells the family from every other one.
    4. ``given`` finds the entries of a TOML table by field, ``number`` reads a number of one of them.
    5. ``check`` raises ``InputError`` where ranges reach what is not allowed, before anything is computed.
    6. ``chunk`` says how many trajectories make a chunk where the file does not.
    7. ``follow`` takes {field: number or array}; without ``itineraries`` the last three of what it returns may be None.
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
    """Raise ``InputError`` where a time reaches below zero."""
    if (least := min(axes[field].values)) < 0:
        raise InputError(f"{field} reaches {float(least):g}: it must be zero or positive")


def require_static(static: str, kinetic: str, axes: "Mapping[str, Axis]") -> None:
    """Raise ``InputError`` where a static bound, if there is one, reaches below the kinetic one."""
    if static in axes and min(axes[static].values) < max(axes[kinetic].values):
        raise InputError(f"{static} reaches below the largest {kinetic}: it must be at least {kinetic} everywhere")


def by_state(start: Any, states: tuple[str, ...]) -> dict[str, Any]:
    """Return the entries of a list by state; raises ``InputError`` for what is no list of them."""
    if not isinstance(start, list) or len(start) != len(states):
        raise InputError(f"start = {short(start)}: it must be a list of {len(states)}: {', '.join(states)}")
    return dict(zip(states, start, strict=True))
