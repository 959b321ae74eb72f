r"""A system described in TOML: rates, frictions and assumptions as formulas in text.

    until = 10                              [[system.frictions]]
                                            velocity = "v - 1"      # a block on a belt
    [system.slow]                           force = "F"
    x = "v"                                 load = 1
    v = "-x + F"                            kinetic = "k / (1 + abs(v - 1))"
                                            static = "k0"
    [values]
    k = 0.8                                 [start]
    k0 = 1                                  x = 0
                                            v = 1

A number may be a formula of numbers, "sqrt(2)/2" or "75 deg". ``[system.fast]`` holds the rates g of fast states, mu y'
= g, and ``small`` the name of mu. ``time`` is the name of an explicit time, ``assumptions`` a list of relations. A
friction may have a ``gap``, a ``normal`` and, if its contact is rigid, a ``constraint``, with a ``gap_rate`` if it
holds both ways.

A ``system`` that is a string names a system of the catalogue, ``asympk.systems``. A ``system`` with a ``mechanism`` (a
name in the catalogue, or a table as in ``asympk.mechanics.described``) is that mechanism with ``contact = "rigid"``, or
with ``contact = "elastic"`` and the formulas ``compliance`` and ``damping``; its ``[start]`` gives the states, or all
coordinates and rates of the mechanism.
"""

from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Any

import sympy as sp

from asympk import systems
from asympk.errors import InputError
from asympk.formulas import names_in, read_constant, read_constants, read_formula, read_relation
from asympk.mechanics.described import CONTACT, constants_in, contact_law, described_by
from asympk.mechanics.mechanism import Mechanism
from asympk.naming import nearest
from asympk.scene import Scene
from asympk.scenes.turned import static_frictions
from asympk.storage.tomlfile import refuse_unknown, require_keys, table_in, tables_in
from asympk.symbolic.system import Friction, System
from asympk.symbolic.values import did_you_mean, in_words, with_changes
from asympk.systems.catalogue import described_mechanism, start_at

KEYS = ("slow", "fast", "small", "time", "frictions", "assumptions")
MECHANISM = ("mechanism", *CONTACT)
FRICTION = ("velocity", "force", "load", "kinetic", "static", "gap", "normal", "constraint", "gap_rate")
_NEEDED = ("velocity", "force", "load", "kinetic")


def read_system_scene(entry: dict[str, Any], changes: Mapping[str, Any]) -> Scene:
    """Return the ``Scene`` of a table with a ``system``, after ``changes`` of numbers; raises ``InputError``."""
    require_keys(entry, ("system", "start", "until"))
    values, start = constants_in(entry, "values"), read_constants("start", entry["start"])
    system, mechanism = system_of(entry["system"], values)
    follows = static_frictions(system)
    values = with_changes(values, changes, follows)
    start = with_changes(start, changes, follows) if isinstance(start, dict) else start
    origin = None
    if isinstance(start, dict) and mechanism and coordinates_of_start(system, mechanism, start):
        origin = (mechanism, values, start)
        start = start_at(mechanism, system, values, start)
    kept = without(cancelled(entry["system"], system, mechanism), values)
    return Scene(system=system, values=kept, start=start, until=read_constant("until", entry["until"], angles=False),
                 name=entry.get("name", ""), origin=origin)


def system_of(entry: Any, parameters: Any) -> tuple[System, Mechanism | None]:
    """Return (system, mechanism) of a name in the catalogue or of a table; the mechanism is None where none is given.

    Formulas may use the names of ``parameters``. Raises ``InputError``.
    """
    if isinstance(entry, str):
        if entry not in systems.__all__:
            near = nearest(entry.lower(), systems.__all__, 0)
            raise InputError(f"system {entry!r:.60} is unknown; the nearest is {near!r}")
        return import_module(f"asympk.systems.{entry}").system(), None
    if isinstance(entry, dict) and "mechanism" in entry:
        refuse_unknown(entry, MECHANISM, "system")
        named = entry["mechanism"]
        found = described_mechanism(named) if isinstance(named, str) else described_by(named, parameters)
        mechanism = found.mechanism
        law = contact_law(entry, mechanism, parameters)
        return mechanism.elastic(*law) if law else mechanism.rigid(), mechanism
    return read_system(entry, parameters), None


def cancelled(entry: Any, system: System, mechanism: Mechanism | None) -> set[str]:
    """Return the names in the formulas of an ``entry`` that no rate has, such as the height of a ground in a gap.

    The system needs no number for them, but the start of its ``mechanism`` may.
    """
    own = {*map(str, mechanism.parameters if mechanism else ())}
    return (names_in(entry) | own) - {*map(str, system.parameters)}


def without(names: set[str], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``values`` without those of ``names``."""
    return {name: value for name, value in values.items() if name not in names}


def coordinates_of_start(system: System, mechanism: Mechanism, start: Iterable[str]) -> tuple[str, ...]:
    """Return all coordinates and rates by name if ``start`` names such alone, or () if it names states of other kinds.

    The first are those of the mechanism, which refuses a start off its constraints. Raises ``InputError`` where some
    coordinates or rates are missing, and for names of no coordinate, rate or state.
    """
    own = tuple(s.name for s in (*mechanism.plain.coordinates, *mechanism.plain.velocities))
    names, states = {*start}, [*map(str, system.states)]
    if (time := str(mechanism.plain.time)) in names:
        raise InputError(f"start: {time} is the time; a scene starts at {time} = 0, and asympk mechanism takes another")
    if unknown := sorted(names - {*own, *states}):
        raise InputError(f"start: {unknown[0]:.60} is no coordinate, rate or state; these are "
                         f"{in_words({*own, *states})}{did_you_mean(unknown[0], {*own, *states})}")
    if not names <= {*own} or (names <= {*states} and not {*own} <= {*states}):
        return ()
    if missing := sorted({*own} - names):
        raise InputError(f"start: no value for {', '.join(missing)}; give all coordinates and rates, or the states "
                         f"{', '.join(states)}")
    return own


def read_system(table: Any, parameters: Any) -> System:
    """Return the ``System`` of a table; formulas may use states, forces and ``parameters``. Raises ``InputError``."""
    table = table_in({"system": table}, "system")
    refuse_unknown(table, KEYS, "system")
    slow, fast = (table_in(table, key, "system.") for key in ("slow", "fast"))
    frictions = tables_in(table, "frictions", "system.")
    symbols = _symbols(table, [*slow, *fast], frictions, parameters)
    slow_rates, fast_rates = ({symbols[s]: read_formula(rate, symbols, f"the rate of {s}") for s, rate in part.items()}
                              for part in (slow, fast))
    small, time = (symbols[table[key]] if key in table else None for key in ("small", "time"))
    if not isinstance(assumptions := table.get("assumptions", []), list):
        raise InputError("system.assumptions must be a list of strings")
    assumed = [read_relation(a, symbols) for a in assumptions]
    found = [_friction(f, symbols, k) for k, f in enumerate(frictions)]
    return System.with_frictions(slow_rates, fast_rates, found, small, time, sp.And(*assumed))


def _symbols(table: dict, states: list[str], frictions: list[dict], parameters: Any) -> dict[str, sp.Symbol]:
    forces = [f[key] for f in frictions for key in ("force", "normal") if key in f]
    others = [table[key] for key in ("small", "time") if key in table]
    named = [*states, *forces, *others]
    for name in [*named, *parameters]:
        if not isinstance(name, str) or not name.rstrip("'").isidentifier():
            raise InputError(f"{name!r:.60} cannot name a quantity; give letters, digits and underscores")
    if twice := sorted({name for name in named if named.count(name) > 1}):
        raise InputError(f"{twice[0]} names two quantities; give one of them another name")
    if moving := [name for name in named if name in parameters and name != table.get("small")]:
        raise InputError(f"values: {moving[0]} is a state, a force or the time; only parameters have a number there")
    symbols = {name: sp.Symbol(name, real=True) for name in [*named, *parameters]}
    if isinstance(table.get("small"), str):
        symbols[table["small"]] = sp.Symbol(table["small"], positive=True)
    return symbols


def _friction(table: dict, symbols: dict[str, sp.Symbol], k: int) -> Friction:
    where = f"system.frictions[{k}]"
    refuse_unknown(table, FRICTION, where, above=KEYS)
    require_keys(table, _NEEDED, where)
    formulas = {key: read_formula(table[key], symbols, f"{where}: {key}")
                for key in FRICTION if key in table and key not in ("force", "normal")}
    return Friction(**formulas, **{key: symbols[table[key]] for key in ("force", "normal") if key in table})
