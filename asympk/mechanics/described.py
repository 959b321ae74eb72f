"""A user's mechanism from a TOML file: formulas in plain names, a rate written with a prime, theta'.

    coordinates = ["X", "Y", "theta"]
    lagrangian = "m*(X'^2 + Y'^2)/2 + m*l^2*theta'^2/6 - m*g*Y"
    gap = "Y - l*sin(theta)"
    slip = "X - l*cos(theta)"
    friction = "f"
    unilateral = true
    [forces]        # by coordinate, the generalised forces that are not in the Lagrangian
    [values]        # a number for every parameter; formulas may use these names
    [state]         # coordinates and rates of the example: numbers, or formulas of numbers such as "pi/4" or "75 deg"
    [over]          # theta = [0.05, 1.5]: the range over which the paradox is looked for

With ``until`` the file is also a scene, which starts from ``[state]`` on a rigid or an elastic contact. Then the keys
``contact``, ``compliance`` and ``damping`` stand at the top of the file, with the meaning that they have under
``[system]`` of ``asympk.scenes.systemfile``; ``name`` and ``about`` are those of any scene.

Further contacts are tables under ``[[others]]``, with ``gap``, ``slip``, ``friction`` and the other keys of a contact.
Instead of ``lagrangian`` a file may have ``mass``, rows of formulas; the forces are then the whole right side Q.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.formulas import names_in, read_constant, read_constants, read_formula
from asympk.mechanics.closing import closed_by, closing_coordinate
from asympk.mechanics.elastic import basis_of, scaling, velocities
from asympk.mechanics.evaluation import evaluate
from asympk.mechanics.lagrangian import lagranges_equations
from asympk.mechanics.mechanism import Contact, Mechanism
from asympk.mechanics.paradox import condition
from asympk.numbers import number
from asympk.storage.tomlfile import misplaced, refuse_unknown, require_keys, table_in, tables_in, word
from asympk.symbolic.long import symbols_in
from asympk.symbolic.system import System
from asympk.symbolic.values import did_you_mean, following, with_changes

OF_CONTACT = ("gap", "slip", "friction", "static", "load", "unilateral")
NEEDED = ("coordinates", "gap", "slip", "friction")
KEYS = ("coordinates", "lagrangian", "mass", *OF_CONTACT, "others", "forces")
EXAMPLE = ("name", "about", "values", "state", "over")
CONTACT = ("contact", "compliance", "damping")  # keys of a file that is also a scene
SWEEP = ("seed", "count", "chunk", "format", "itineraries")  # of a sweep's file alone
NUMBERS = {"values", "state", "start"}  # tables
FILE = (*KEYS, *EXAMPLE, *CONTACT, "until")
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)


@dataclass(frozen=True)
class Described:
    """A mechanism with the numbers of an example.

    ``turn`` is None, or (name, low, high) for the coordinate or parameter over which the mechanism is drawn.
    ``undamped`` is the elastic ``System`` without damping if its phase plane (R, R') is to be drawn. ``followed`` tells
    whether ``name`` also is a scene.
    """

    name: str
    about: str
    mechanism: Mechanism
    values: dict[str, Any]
    state: dict[str, Any]
    turn: tuple | None
    undamped: System | None = None
    followed: bool = False

    @property
    def numbers(self) -> dict[str, Any]:
        """The numbers of parameters and states without those of the elastic contact; the time is 0 by default."""
        plain = self.mechanism.plain
        time = {str(plain.time): 0} if plain.timed else {}
        own = {*map(str, (*self.mechanism.parameters, *plain.coordinates, *plain.velocities)), *time}
        return {**time, **{name: value for name, value in self.values.items() if name in own}, **self.state}

    @property
    def mapped(self) -> bool:
        """Whether the motions can be drawn over ``turn`` and friction, another parameter; not beside rough others."""
        friction, rough = self.mechanism.contact.friction, self.mechanism.held.rough
        return self.turn is not None and friction.is_Symbol and str(friction) != self.turn[0] and not rough

    def changed(self, changes: dict[str, Any]) -> "Described":
        """Return the description with other numbers; raises ``UnknownName`` for a name of no value or state.

        The values of the elastic contact may change, too, but the rigid motions and the jump do not depend on them.
        Static friction equal to the kinetic one changes with it, unless given.
        """
        self.mechanism.keyed({name: value for name, value in changes.items() if name not in self.values})
        follows = following((contact.static, contact.friction) for contact in self.mechanism.equations)
        values, state = (with_changes(own, changes, follows) for own in (self.values, self.state))
        added = {name: value for name, value in changes.items() if name not in values and name not in state}
        return replace(self, values={**values, **added}, state=state)

    @cached_property
    def tied(self) -> dict[str, Callable[[Any], Any]]:
        """What changes over ``turn`` with it, as ``{name: function}`` of its arrays; {} without ``turn``.

        It is the coordinate that closes the contact, if one is needed, and the rates with g' = 0 of all contacts that
        hold, with the sliding velocity and the free rates of the example. Raises ``NotDerivable``, as do the functions,
        where a contact does not close.
        """
        if self.turn is None:
            return {}
        moved = {self.turn[0], *self._closing}
        rates = {str(u): lambda at, u=u: self._sliding(at)[str(u)] for u, rate in self._rates.items()
                 if moved & {*map(str, symbols_in(rate))}}
        return {**self._closing, **rates}

    @cached_property
    def _closing(self):
        kinetics, (name, low, high) = self.mechanism.held, self.turn
        numbers = self.mechanism.keyed({name: low, **self.numbers})
        other = closing_coordinate(kinetics, name, numbers)
        (turned,) = self.mechanism.keyed({name: low})
        self._require_others({turned, other}, condition(kinetics))
        return {} if other is None else {str(other): closed_by(kinetics, other, (turned, low, high), numbers)}

    def _require_others(self, moved, *formulas):
        """Raise ``NotDerivable`` if others that hold both ways open, or close by coordinates that formulas contain."""
        held = self.mechanism.held
        for other in (*held.joints, *held.rough):
            follow = symbols_in(other.gap) & {*other.coordinates} - moved
            matter = follow & symbols_in(sp.Tuple(*formulas))
            if symbols_in(other.gap) & moved and (matter or not follow):
                closes = f"and closes by {min(map(str, matter))}, which matters" if matter else "and nothing closes it"
                raise NotDerivable(f"the gap {other.gap!s:.40} of another contact changes with {self.turn[0]}, "
                                   f"{closes}: choose coordinates without it, or name another quantity under [over]")

    @cached_property
    def _rates(self):
        """The rates with g' = 0 and the sliding velocity ``_gamma``."""
        kinetics = self.mechanism.held
        basis = basis_of((kinetics, *kinetics.joints, *kinetics.rough), sliding=True)
        return velocities(kinetics, basis, (*[sp.S.Zero] * len(basis.held), self._gamma))

    @property
    def _gamma(self):
        return self.mechanism.plain.unused_symbol("gamma", real=True)

    def closed(self, at: Any, friction: Any) -> dict[str, Any]:
        """Return the numbers with the contact closed, on arrays of ``turn`` and friction.

        The sliding velocity is that of the example, and all other numbers are those of ``tied`` and of the example.
        """
        if self.turn is None:
            raise InputError("nothing to turn; name a coordinate and its range under [over]")
        self._require_others(set(self.mechanism.keyed({self.turn[0]: 0, **dict.fromkeys(self._closing, 0)})),
                             *self.mechanism.held.delassus, *self.mechanism.held.free)
        return {**self._sliding(at), **self._bounds(friction)}

    def _sliding(self, at):
        """Return numbers with the contact closed, at the sliding velocity of the example, on an array of ``turn``."""
        rod, (name, _, _) = self.mechanism, self.turn
        placed = {**self.numbers, name: at, **{other: rule(at) for other, rule in self._closing.items()}}
        known = {**rod.keyed(placed), self._gamma: rod.evaluate(rod.sliding_velocity, self.numbers)}
        found = evaluate(tuple(self._rates.values()), known)
        return {**placed, **{str(rate): value for rate, value in zip(self._rates, found, strict=True)}}

    def _bounds(self, friction):
        """Return the kinetic friction and, if it is a parameter of its own, the static one, made at least as large."""
        import numpy as np

        contact = self.mechanism.contact
        kinetic, static = str(contact.friction), contact.static
        if not static.is_Symbol or str(static) == kinetic:
            return {kinetic: friction}
        return {kinetic: friction, str(static): np.maximum(self.mechanism.evaluate(static, self.numbers), friction)}


def mechanism_of_table(table: dict[str, Any], where: Any) -> Described:
    """Return the ``Described`` mechanism of the table in a file; raises ``InputError`` if the table describes none."""
    refuse_sweep(table, where)
    if "until" in table and not describes_mechanism(table):
        raise InputError(f"{where}: it is a scene, followed by asympk solve; a mechanism has coordinates")
    refuse_unknown(table, FILE, where)
    found = replace(_described(table, where), followed="until" in table and not table.keys().isdisjoint(CONTACT))
    used = names_in([value for key, value in table.items() if key not in EXAMPLE])
    if idle := [name for name in found.values if not names_in(name) <= used]:
        hint = misplaced(table, [key for key in idle[:1] if key in FILE]) or did_you_mean(idle[0], used)
        raise InputError(f"{where}: values: {idle[0]:.60} is in no formula{hint or '; leave it out'}")
    return found


def refuse_sweep(table: Mapping[str, Any], where: Any, single: Iterable[str] = ("until",)) -> None:
    """Raise ``InputError`` for the table of a sweep: one with a setting of a sweep, or with many numbers for one.

    ``single`` are the keys at its top that have one number.
    """
    parts = [table[key] for key in table if key in NUMBERS and isinstance(table[key], dict)]
    start = table.get("start")
    listed = [("start", entry) for entry in start] if isinstance(start, list) else []
    numbers = [*((key, table[key]) for key in single if key in table), *listed, *(e for p in parts for e in p.items())]
    many = (f"{name} = {value!r:.60}" for name, value in numbers if isinstance(value, list | dict))
    if found := [*(key for key in table if key in SWEEP), *many]:
        raise InputError(f"{where}: {found[0]} is of a sweep, which asympk sweep follows; "
                         "elsewhere each quantity has one number")


def described_by(table: Any, parameters: Any) -> Described:
    """Return the ``Described`` of a table without numbers; formulas may use ``parameters``. Raises ``InputError``."""
    if not isinstance(table, dict) or "values" in table:
        raise InputError("mechanism: it must be a word of the catalogue, or a table whose values stand beside it")
    refuse_unknown(table, KEYS, "mechanism")
    return _described({**table, "values": dict.fromkeys(parameters)}, "mechanism")


def describes_mechanism(table: Mapping[str, Any]) -> bool:
    """Tell whether a table of TOML is that of a mechanism, by one of the keys that no other table has.

    Such a key may also stand by mistake below the head of a table.
    """
    parts = [table, *(part for part in table.values() if isinstance(part, dict))]
    return any(not part.keys().isdisjoint(("coordinates", "lagrangian")) for part in parts)


def scene_table(table: dict[str, Any], where: Any) -> dict[str, Any]:
    """Return the table of the scene in the file of a mechanism; raises ``InputError`` if the file is no scene."""
    refuse_unknown(table, FILE, where)
    require_keys(table, NEEDED, where)
    if "until" not in table:
        raise InputError(f"{where}: it is a mechanism, for asympk mechanism; with until, and compliance and damping "
                         f"of its contact, or contact = \"rigid\", it is also a scene{misplaced(table, ['until'])}")
    if "state" not in table:
        raise InputError(f"{where}: [state] is missing; give the coordinates and rates from which the motion starts")
    mechanism, contact = ({key: table[key] for key in keys if key in table} for keys in (KEYS, CONTACT))
    system = {"mechanism": mechanism, "contact": "elastic", **contact}
    try:
        start = constants_in(table, "state")
        _turn(table)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    kept: dict[str, Any] = {key: table[key] for key in ("name", "about", "until") if key in table}
    return {**kept, "system": system, "values": table.get("values", {}), "start": start}


def contact_law(table: Mapping[str, Any], mechanism: Mechanism, parameters: Iterable[str]) -> tuple[sp.Expr, ...]:
    """Return (compliance, damping) of an elastic contact as formulas, () of a rigid one; raises ``InputError``."""
    contact, law = table.get("contact"), {"compliance", "damping"}
    if contact == "rigid" and law.isdisjoint(table):
        return ()
    if contact != "elastic" or not law <= table.keys():
        raise InputError('contact must be "rigid", or "elastic" with compliance and damping; a rigid one has neither')
    own = {s.name: s for s in mechanism.plain.symbols}
    symbols = {name: sp.Symbol(name, positive=True) for name in parameters} | own
    return tuple(read_formula(table[key], symbols, key) for key in ("compliance", "damping"))


def _check_law(law, values):
    if law:
        scaling(*law)
    for symbol in set().union(*(formula.free_symbols for formula in law)):
        if symbol.is_positive:
            number(f"values: {symbol}", values[symbol.name], lambda v: v > 0, "positive")


def _described(table, where):
    try:
        require_keys(table, NEEDED)
        about, _ = word(table, "about"), word(table, "name")
        values, state = (_numbers(table, key) for key in ("values", "state"))
        until = read_constant("until", table.get("until", 0), angles=False)
        number("until", until, lambda t: t >= 0, "zero or positive")
        mechanism, turn = _mechanism_of(table, values), _turn(table)
        if not table.keys().isdisjoint(CONTACT):
            _check_law(contact_law({"contact": "elastic", **table}, mechanism, values), values)
        return Described(str(where), about, mechanism, values, state, turn)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _coordinates(table):
    names = table.get("coordinates")
    if not names or not isinstance(names, list) or not all(isinstance(n, str) and _NAME.fullmatch(n) for n in names):
        raise InputError("coordinates must be a list of plain names, such as ['X', 'theta']")
    return names


def _mechanism_of(table, values):
    names = _coordinates(table)
    q = tuple(sp.Symbol(n, real=True) for n in names)
    u = tuple(sp.Symbol(f"{n}'", real=True) for n in names)
    t = sp.Symbol("t", real=True)
    known = {s.name: s for s in (*q, t, *u)}
    if taken := sorted({*names, "t"} & values.keys()):
        raise InputError(f"values: {taken[0]} is a coordinate or the time; its number belongs under [state]")
    known |= {name: sp.Symbol(name, real=True) for name in values}
    return _mechanism(table, lambda key, text: read_formula(text, known, key), q, u, t)


def _mechanism(table, formula, q, u, t):
    contact, forces = _contact(table, formula), table_in(table, "forces")
    others = []
    for k, other in enumerate(tables_in(table, "others")):
        refuse_unknown(other, OF_CONTACT, f"others[{k}]", above=FILE)
        try:
            others.append(_contact(other, formula))
        except InputError as error:
            raise InputError(f"others[{k}]: {error}") from None
    if unknown := sorted(forces.keys() - {s.name for s in q}):
        hint = misplaced(table, [key for key in unknown if key in FILE])
        raise InputError(f"forces: {', '.join(unknown)} is no coordinate{hint}")
    applied = [formula(f"forces: {s.name}", forces.get(s.name, 0)) for s in q]
    if ("lagrangian" in table) == ("mass" in table):
        raise InputError("give either lagrangian or mass")
    if "mass" in table:
        rows = [[formula("mass", entry) for entry in row] for row in _rows(table["mass"])]
        return Mechanism(q, u, rows, applied, contact, t, others)
    mass, centrifugal = lagranges_equations(formula("lagrangian", table["lagrangian"]), q, u, t)
    return Mechanism(q, u, mass, [a + b for a, b in zip(applied, centrifugal, strict=True)], contact, t, others)


def _contact(table, formula):
    require_keys(table, ("gap", "slip", "friction"))
    if not isinstance(table.get("unilateral", False), bool):
        raise InputError("unilateral must be true or false")
    given = {key: formula(key, table[key]) for key in OF_CONTACT if key in table and key != "unilateral"}
    return Contact(**given, unilateral=table.get("unilateral", False))


def _rows(mass):
    if not isinstance(mass, list) or not all(isinstance(row, list) for row in mass):
        raise InputError("mass must be a list of rows, such as [['m', '0'], ['0', 'm']]")
    return mass


def _numbers(table, key):
    found = constants_in(table, key)
    for name, value in found.items():
        if value is not None:  # None: the values of a scene stand elsewhere
            number(f"{key}: {name}", value)
    return found


def constants_in(table: Mapping[str, Any], key: str) -> dict[str, Any]:
    """Return the table ``table[key]`` with numbers for formulas of numbers; raises ``InputError``."""
    return read_constants(key, table_in(table, key))


def _turn(table):
    """Return (name, low, high) of the range under [over], None without one; raises ``InputError``."""
    if "over" not in table:
        return None
    over, names = table["over"], {*_coordinates(table), *table_in(table, "values")}
    if not isinstance(over, dict) or len(over) != 1:
        raise InputError("over must name one coordinate or parameter with its range, theta = [0.05, 1.5]")
    ((name, ends),) = over.items()
    if name.rstrip("'") not in {*names, "t"}:
        raise InputError(f"over: {name:.60} is no coordinate and no parameter{did_you_mean(name, names)}")
    if not isinstance(ends, list) or len(ends) != 2:
        raise InputError(f"over: {name} = {ends!r:.60}: give its range, [low, high]")
    low, high = (read_constant(f"over: {name}", end) for end in ends)
    if not number(f"over: {name}", low) < number(f"over: {name}", high):
        raise InputError(f"over: {name} = {ends!r:.60}: give [low, high] with low < high")
    return name, low, high
