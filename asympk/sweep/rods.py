"""Sweeps over the rod, in nondimensional quantities or in physical ones."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from asympk.errors import InputError
from asympk.formulas import read_constant, read_number
from asympk.many import PHASES
from asympk.numbers import Number, short
from asympk.scenes.scenefile import PHYSICAL, UNITS
from asympk.storage.tomlfile import require_keys
from asympk.sweep.family import DIGITS, Axis, Followed, by_state, require_static, require_time
from asympk.sweep.itineraries import Alphabet


@dataclass(frozen=True)
class RodFamily:
    """The Painlevé-Klein rod in nondimensional quantities."""

    parameters: ClassVar[tuple[str, ...]] = ("sigma", "mu", "sigma0")
    kinetic, static = "sigma", "sigma0"  # the parameters of friction; the static one may be missing
    states: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    alphabet = Alphabet()
    description: ClassVar[dict[str, Any]] = {}  # one that names no family is of the rod

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of the parameters, of the states at the start, and of the horizon."""
        return (*self.parameters, *self.states, "until")

    def given(self, table: Mapping[str, Any]) -> dict[str, Any]:
        require_keys(table, (*(key for key in self.parameters if key != self.static), "start", "until"))
        return {**{key: table[key] for key in (*self.parameters, "until") if key in table},
                **by_state(table["start"], self.states)}

    def number(self, field: str, value: Any) -> Number:
        return read_number(field, value, angles=False, digits=DIGITS)

    def check(self, axes: Mapping[str, Axis]) -> None:
        for field, bound in (("sigma", -2), ("mu", 0)):
            if float(least := min(axes[field].values)) <= bound:
                raise InputError(f"{field} reaches {short(least)}: it must be greater than {bound}, as a double, too")
        require_time("until", axes)
        require_static(self.static, self.kinetic, axes)

    def chunk(self, axes: Mapping[str, Axis]) -> int:
        return 65536

    def follow(self, columns: Mapping[str, Any], size: int, itineraries: bool) -> Followed:
        from asympk.systems.painleve_klein.arrays.ensemble import solve_many

        arrays: dict[str, Any] = {field: np.broadcast_to(values, (size,)) for field, values in columns.items()}
        many = solve_many(**arrays, events=itineraries)
        if not itineraries:
            return Followed(many.final, many.n_events, many.outcome)
        events, followed = many.events(), many.outcome == 0
        first = np.zeros((1, size), dtype=np.uint8)
        first[0, followed] = first_phases({field: values[followed] for field, values in arrays.items()})
        return Followed(many.final, many.n_events, many.outcome, first, events.kind, np.zeros(events.t.size, np.uint8))


@dataclass(frozen=True)
class PhysicalRodFamily(RodFamily):
    """The Painlevé-Klein rod in physical quantities; its final states are physical, too."""

    parameters, kinetic, static = PHYSICAL, "f", "f0"
    states = ("R_1", "dR_1", "u")
    description: ClassVar[dict[str, Any]] = {"quantities": "physical"}

    def given(self, table: Mapping[str, Any]) -> dict[str, Any]:
        """Return the entries of a table by field; raises ``InputError`` for units that are not consistent, too."""
        from asympk.systems.painleve_klein.units import SI, unit_names

        unit_names(table.get(UNITS, SI))
        return super().given(table)

    def number(self, field: str, value: Any) -> Number:
        """Return ``value`` as a number of a field, an angle in radians; raises ``InputError`` if it is not allowed."""
        from asympk.systems.painleve_klein.units import in_radians

        return in_radians(field, read_constant(field, value, angles=False, digits=DIGITS), DIGITS)

    def check(self, axes: Mapping[str, Axis]) -> None:
        """Raise ``InputError`` for static friction below kinetic friction; ``number`` checks all else."""
        require_static(self.static, self.kinetic, axes)

    def follow(self, columns: Mapping[str, Any], size: int, itineraries: bool) -> Followed:
        """Follow ``size`` trajectories in nondimensional quantities; their final states are physical again."""
        from asympk.systems.painleve_klein.units import in_arrays

        quantities = {"f0": columns["f"], **columns}
        numbers, units = in_arrays([np.asarray(quantities[field]) for field in self.fields])
        found = super().follow(numbers, size, itineraries)
        return found._replace(final=np.array(units.state(*found.final)))


def first_phases(part: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the mode of the rod in which each trajectory begins, as an index in ``PHASES``."""
    from asympk.systems.painleve_klein.arrays.safeguarded import starting_signs

    x, y, z = (part[axis] for axis in "xyz")
    s_sign, z_sign, close = starting_signs(part.get("sigma0", part["sigma"]), part["mu"], y, x + y, z)
    modes = np.array([2, 0, 1])[(s_sign * z_sign).astype(int)]  # indexed by the products 0, 1 and -1
    for row in np.flatnonzero(close):
        modes[row] = PHASES.index(_first_mode({field: float(values[row]) for field, values in part.items()}))
    return modes


def _first_mode(one):
    from asympk.methods import solve
    from asympk.scene import Scene

    return solve(Scene(one["sigma"], one["mu"], (one["x"], one["y"], one["z"]), 0, one.get("sigma0"))).modes[0]
