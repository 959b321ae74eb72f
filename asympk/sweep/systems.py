"""Sweeps over any system: its parameters, its start, the horizon.

The rod is followed by its own kernel, an affine system in arrays, and any other system one scene at a time.
"""

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from asympk.affine.many import one_by_one, solve_many
from asympk.affine.resting import with_parameter_at_rest
from asympk.affine.run import affine
from asympk.errors import InputError, OutOfRange
from asympk.formulas import read_number
from asympk.many import outcome_of
from asympk.methods import solve
from asympk.numbers import Number
from asympk.scene import Scene
from asympk.scenes.systemfile import cancelled, coordinates_of_start, system_of, without
from asympk.storage.tomlfile import require_keys, table_in
from asympk.sweep.family import DIGITS, Axis, Followed, by_state, require_time
from asympk.sweep.itineraries import Alphabet
from asympk.sweep.rods import RodFamily
from asympk.symbolic.branches import is_smooth
from asympk.symbolic.system import System
from asympk.symbolic.values import by_symbol, require_all
from asympk.systems.catalogue import start_at
from asympk.systems.kernels import is_rod

UNTIL = "until"
COLUMNS = ("n_events", "outcome", "collisions", "itinerary", "provenance")  # of a chunk, beside those of the states
CHUNK, FEW = 8192, 64  # trajectories per chunk, in arrays and one at a time
_MOST_CORNERS = 128


@dataclass(frozen=True)
class SystemFamily:
    """The scenes of a system; ``text`` is JSON of the system's entry in a file and of the names of its parameters.

    Scenes of a mechanism may start from its ``coordinates``: the names of all its coordinates and of their rates.
    """

    text: str
    coordinates: tuple[str, ...] = ()

    @classmethod
    def described(cls, description: Mapping[str, Any]) -> "SystemFamily":
        """Return the family of a ``description``."""
        text = _written(description["system"], description["parameters"])
        return cls(text, tuple(description.get("coordinates", ())))

    @property
    def description(self) -> dict[str, Any]:
        """The system's entry in its file, the names of its parameters, and its coordinates if any."""
        system, parameters = json.loads(self.text)
        coordinates = {"coordinates": [*self.coordinates]} if self.coordinates else {}
        return {"system": system, "parameters": parameters, **coordinates}

    @property
    def system(self) -> System:
        return _system(self.text)[0]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters, also of those on which only a start depends."""
        own = dict.fromkeys(s.name for s in self.system.parameters)
        return (*own, *(name for name in json.loads(self.text)[1] if name in _cancelled(self.text)))

    @property
    def states(self) -> tuple[str, ...]:
        return tuple(s.name for s in self.system.states)

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of the parameters, of the quantities of a start, and of the horizon."""
        return (*self.parameters, *self._begins, UNTIL)

    @property
    def _begins(self):
        return self.coordinates or self.states

    @property
    def alphabet(self) -> Alphabet:
        frictions = self.system.frictions
        more = any(f.gap is not None or is_smooth(self.system, k) for k, f in enumerate(frictions))
        return Alphabet(len(frictions), more)

    def given(self, table: Mapping[str, Any]) -> dict[str, Any]:
        """Return {field: entry} of a table; raises ``InputError`` unless its entries fit the system."""
        require_keys(table, ("start", UNTIL))
        start = table["start"]
        if isinstance(start, list):
            start = by_state(start, self.states)
        values = table.get("values", {})
        tables = {"values": (without(_cancelled(self.text), values), self.system.parameters, "parameter")}
        if not self.coordinates:
            tables["start"] = (start, self.system.states, "state")
        for what, (entries, symbols, kind) in tables.items():
            require_all(what, by_symbol(entries, symbols, "this system", kind), symbols, kind)
        return {**values, **start, UNTIL: table[UNTIL]}

    def number(self, field: str, value: Any) -> Number:
        return read_number(field, value, angles=field != UNTIL, digits=DIGITS)

    def check(self, axes: Mapping[str, Axis]) -> None:
        """Raise ``InputError`` where the system refuses parameters at the ends of their ranges.

        All combinations of ends are tried, or only the lowest and the highest if there are too many.
        """
        require_time(UNTIL, axes)
        ends = [{min(axes[name].values), max(axes[name].values)} for name in self.parameters]
        if math.prod(map(len, ends)) <= _MOST_CORNERS:
            corners = [*product(*map(sorted, ends))]
        else:
            corners = [tuple(map(min, ends)), tuple(map(max, ends))]
        start = {name: axes[name].values[0] for name in self._begins}
        fixed = all(axes[name].kind == "values" and axes[name].points == 1 for name in self._begins)
        for corner in corners:
            values = dict(zip(self.parameters, corner, strict=True))
            begun = self._in_states(values, start) if fixed else dict.fromkeys(self.states, 0)
            self.system.placed(without(_cancelled(self.text), values), begun)

    def chunk(self, axes: Mapping[str, Axis]) -> int:
        """Return the number of trajectories per chunk, smaller where one takes longer."""
        if is_rod(self.system):
            return RodFamily().chunk(axes)
        system, symbols = (self.system if affine(self.system) else None), {s.name: s for s in self.system.parameters}
        for name in (name for name in self.parameters if axes[name].random):
            system = with_parameter_at_rest(system, symbols[name]) if system and name in symbols else None
        return CHUNK if system else FEW

    def follow(self, columns: Mapping[str, Any], size: int, itineraries: bool) -> Followed:
        """Follow ``size`` trajectories by the fastest method for the system."""
        if is_rod(self.system):
            return RodFamily().follow(columns, size, itineraries)
        columns = {name: np.broadcast_to(values, (size,)) for name, values in columns.items()}
        values, start = ({name: columns[name] for name in names} for names in (self.parameters, self._begins))
        if self.coordinates:
            start = self._starts(values, start, size)
        values = without(_cancelled(self.text), values)
        begun = ~np.any([np.isnan(column) for column in start.values()], axis=0)
        values, start = ({name: column[begun] for name, column in part.items()} for part in (values, start))
        found = self._followed(values, start, columns[UNTIL][begun])
        return found if begun.all() else _spread(found, begun)

    def _followed(self, values, start, until):
        """Follow the trajectories of columns without NaN."""
        many = None
        with suppress(InputError):  # refused parameters: scenes are then tried one by one
            many = affine(self.system) and solve_many(system=self.system, values=values, start=start, until=until)
        many = many or one_by_one(solve, self.system, values, start, until)
        events = many.events()
        return Followed(many.final, many.n_events, many.outcome, many.first, events.kind, events.friction)

    def refusal(self, quantities: Mapping[str, Any]) -> str:
        """Return why a trajectory with these quantities, numbers or arrays of one, is refused, or "" if it is not."""
        row = {name: float(np.ravel(value)[0]) for name, value in quantities.items()}
        values, start = ({name: row[name] for name in names} for names in (self.parameters, self._begins))
        try:
            begun, values = self._in_states(values, start), without(_cancelled(self.text), values)
            solve(Scene(system=self.system, values=values, start=begun, until=row[UNTIL]))
        except (InputError, OutOfRange) as error:  # OutOfRange of a start, as in ``_starts``
            return str(error)
        return ""

    def _in_states(self, values, start):
        system, mechanism = _system(self.text)
        return start_at(mechanism, system, values, start) if self.coordinates else start

    def _starts(self, values, start, size):
        """Return the columns of the starting states, NaN in rows whose start the mechanism refuses."""
        found = np.full((len(self.states), size), np.nan)
        for row in range(size):
            with suppress(InputError, OutOfRange):
                found[:, row] = [*self._in_states(_row(values, row), _row(start, row)).values()]
        return dict(zip(self.states, found, strict=True))


def _spread(found, begun):
    """Return the results of the rows ``begun`` with those of the other rows, whose start is refused, between them."""
    size = begun.size
    final, first = np.full((len(found.final), size), np.nan), np.zeros((len(found.first), size), found.first.dtype)
    n_events = np.zeros(size, found.n_events.dtype)
    outcome = np.full(size, outcome_of(InputError()), found.outcome.dtype)
    final[:, begun], first[:, begun] = found.final, found.first
    n_events[begun], outcome[begun] = found.n_events, found.outcome
    return found._replace(final=final, first=first, n_events=n_events, outcome=outcome)


def _row(columns, row):
    return {name: float(column[row]) for name, column in columns.items()}


def family_of_table(table: Mapping[str, Any]) -> SystemFamily:
    """Return the family of a table with a ``system``; raises ``InputError``."""
    require_keys(table, ("system",))
    text, start = _written(table["system"], sorted(table_in(table, "values"))), table.get("start")
    system, mechanism = _system(text)
    own = coordinates_of_start(system, mechanism, start) if mechanism and isinstance(start, dict) else ()
    family = SystemFamily(text, own)
    for name in (*family.states, *family.fields[:-1]):
        if name == UNTIL or (name in COLUMNS and name in family.states):
            raise InputError(f"{name} is a name that a sweep uses itself; give the quantity another name")
    if table.get("itineraries", True):
        family.alphabet.longest  # noqa: B018 - raises where there are too many frictions
    return family


def _written(system, parameters):
    try:
        return json.dumps([system, parameters])
    except (TypeError, ValueError, RecursionError):  # dates, or integers and nests without bounds
        raise InputError("system: it must hold formulas in text, words and numbers") from None


@lru_cache(maxsize=8)
def _system(text):
    return system_of(*json.loads(text))


@lru_cache(maxsize=8)
def _cancelled(text):
    return cancelled(json.loads(text)[0], *_system(text))
