"""Checks of a mechanism: a regular, symmetric mass matrix, a gap in the coordinates, a slip independent of the gap."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import sympy as sp

from asympk.automaton.contacts import is_open, nudges
from asympk.automaton.junction import BY_HAND, OF_ZERO
from asympk.errors import InputError, NotDerivable, OutOfRange
from asympk.formulas import NOT_FINITE
from asympk.mechanics.evaluation import ROUNDING, evaluate
from asympk.mechanics.kinetics import Kinetics
from asympk.numbers import short
from asympk.symbolic.long import has_no_inverse, symbols_in
from asympk.symbolic.reading import as_floats, require_names
from asympk.symbolic.sides import MOST, measured, on_sides, phases, switching_symbols
from asympk.symbolic.tidy import vanishes


def check_mechanism(equations: Sequence[Kinetics], contacts: Sequence[Any]) -> None:
    """Raise ``InputError`` for the first fault of a mechanism; ``equations`` are its equations for each contact."""
    first = equations[0]
    _check_sizes(first)
    require_names((*first.coordinates, *(s for kinetics in equations for s in kinetics.parameters)))
    parameters = {str(s) for kinetics in equations for s in kinetics.parameters}
    if str(first.time) in parameters:
        raise InputError(f"{first.time} in the formulas is not the time {first.time} but another symbol of its name, "
                         "as one declared real is: write the time as sp.Symbol('t') or dynamicsymbols._t, give time=, "
                         "or give a parameter another name")
    for clash in sorted(parameters & {*map(str, (*first.coordinates, *first.velocities))}):
        raise InputError(f"{clash} in the formulas is not the {clash} of the coordinates and velocities but another "
                         "symbol of its name: write that one, or give a parameter another name")
    if symbols_in(first.mass) & {*first.velocities}:
        raise InputError("mass contains a velocity; the terms of inertia in velocities belong to the forces")
    _check_mass(first.mass, first.coordinates)
    for k, (kinetics, contact) in enumerate(zip(equations, contacts, strict=True)):
        try:
            _check_gap(kinetics, contact.gap)
            _check_slip(kinetics, contact)
        except InputError as error:
            raise InputError(f"others[{k - 1}]: {error}" if k else str(error)) from None


def require_closed(kinetics: Kinetics, values: dict[sp.Symbol, Any], which: str = "") -> None:
    """Raise ``InputError`` if g = g' = 0 does not hold at the time 0, as far as ``departures`` tells.

    ``which`` begins the message, where there are several contacts.
    """
    for name, found in departures(kinetics, values).items():
        raise InputError(f"{which}the start is off the constraint: {name} = {found:g}; give coordinates and rates with "
                         "0")


def departures(kinetics: Kinetics, values: dict[sp.Symbol, Any]) -> dict[str, float]:
    """Return {name: value} of those of g and g' that are not 0 at the time 0.

    A value counts as 0 if rounding could have made it nonzero: of states or parameters to six digits, or of a state
    that is a computed zero. Raises ``InputError``, which names the symbols without a value.
    """
    import numpy as np

    placed, both = {kinetics.time: 0} | values, (kinetics.gap, kinetics.gap_rate)
    found: dict[str, list[float]] = {"g": [], "g'": []}
    fixed = switching_symbols(*both)
    smooth = [s for s in kinetics.parameters if s not in fixed]
    for symbols, least in (((*kinetics.coordinates, *kinetics.velocities), OF_ZERO), (smooth, 0)):
        given = [s for s in symbols if s in placed]
        start = tuple(float(as_floats(str(s), placed[s])) for s in given)
        beside = np.array([start, *(moved for _, moved in nudges(0, start, BY_HAND, least))])
        with suppress(*() if least else (InputError, OutOfRange)):  # a parameter may be an end of its range
            rows = evaluate(both, {**placed, **dict(zip(given, beside.T, strict=True))})
            for name, row in zip(found, rows, strict=True):
                found[name] += map(float, np.atleast_1d(row))
    return {name: row[0] for name, row in found.items() if not is_open(row)}


def is_met(kinetics: Kinetics, values: dict[sp.Symbol, Any]) -> bool:
    """Tell whether a contact holds both ways or, at numbers that give all of its gap, neither is open nor opens."""
    given = symbols_in(sp.Tuple(kinetics.gap, kinetics.gap_rate)) <= values.keys()
    return not kinetics.unilateral or (given and next(iter(departures(kinetics, values).values()), 0) <= 0)


def require_positive_mass(kinetics: Kinetics, values: dict[sp.Symbol, Any]) -> None:
    """Raise ``InputError`` where the mass matrix is not positive definite at numbers or arrays that give all of it."""
    import numpy as np

    n = kinetics.mass.rows
    if not symbols_in(kinetics.mass) <= values.keys():
        return
    entries = np.array(np.broadcast_arrays(*evaluate(tuple(kinetics.mass), values)), dtype=float)
    mass = np.moveaxis(entries, 0, -1).reshape(*entries.shape[1:], n, n)
    diagonal = np.abs(np.diagonal(mass, axis1=-2, axis2=-1))
    sizes = np.sqrt(np.where(diagonal == 0, 1, diagonal))[..., None]  # units do not matter
    if (np.linalg.eigvalsh(mass / sizes / sizes.swapaxes(-1, -2)) < -n * ROUNDING).any():
        raise InputError("the mass matrix is not positive at these values: every motion must have a positive kinetic "
                         "energy; mend the signs of masses and moments of inertia")


def require_continuous(kinetics: Kinetics, parts: tuple[sp.Expr, ...], what: str) -> None:
    """Raise ``NotDerivable`` if one of ``parts`` jumps with the coordinates or the time; ``what`` is their name."""
    for expr in parts:
        for phase in phases((expr,), kinetics.coordinates, kinetics.time, few=MOST):
            place = measured(phase)
            upper, lower = (on_sides(expr, ((phase, side),)) for side in ((1, -1) if place == phase else (0, -1)))
            q = next((q for q in sorted(place.free_symbols, key=str) if place.diff(q).is_nonzero), place)
            rise = (upper - lower).subs(q, sp.solve(place, q)[0] if q.is_Symbol else 0)
            if not rise.has(*NOT_FINITE) and not vanishes(rise):  # a motion to a pole ends there
                where = f"{place} = 0" if place == phase else f"{place} is whole"
                raise NotDerivable(f"{what} jumps where {where}, and velocities do not: round it off there")


def require_own_symbols(name: str, value: sp.Expr, symbols: Iterable[sp.Symbol]) -> None:
    """Raise ``InputError`` for an expression with a symbol that has the name of another of the mechanism's."""
    own = {*symbols}
    if other := {str(s) for s in value.free_symbols - own} & {*map(str, own)}:
        raise InputError(f"{name} = {value!s:.60}: the mechanism has another {min(other)}; take another Symbol")


def check_bounds(contact: Any) -> None:
    """Raise ``InputError`` if friction or load is known to be negative, static below kinetic, or the load 0."""
    if contact.friction.is_negative or contact.load.is_nonpositive:
        given = f"friction = {short(contact.friction)}, load = {short(contact.load)}"
        raise InputError(f"contact: {given}: friction must not be negative, its load must be positive")
    if (contact.static - contact.friction).is_negative:
        raise InputError(f"contact: static = {short(contact.static)} is below friction = {short(contact.friction)}")


def _check_sizes(kinetics: Kinetics) -> None:
    symbols = (*kinetics.coordinates, *kinetics.velocities, kinetics.time)
    if len({*map(str, symbols)}) < len(symbols):
        listed = ", ".join(map(str, symbols))
        raise InputError(f"coordinates, velocities and the time ({listed}): a name is given twice; rename one")
    n = len(kinetics.coordinates)
    sizes = {"forces": len(kinetics.forces), "rows of mass": kinetics.mass.rows, "columns of mass": kinetics.mass.cols}
    for name, size in sizes.items():
        if size != n:
            raise InputError(f"{size} {name} for {n} coordinates; give {n}")
    if n < 2:
        raise InputError("one coordinate: a contact needs two or more, to slide and to open; keep the gap among them")


def _check_mass(mass: sp.ImmutableMatrix, coordinates: tuple[sp.Symbol, ...]) -> None:
    for i in range(mass.rows):
        for j in range(i):
            if not vanishes(mass[i, j] - mass[j, i]):
                raise InputError(
                    f"mass is not symmetric: entry ({i + 1}, {j + 1}) is {mass[i, j]!s:.40}, "
                    f"entry ({j + 1}, {i + 1}) is {mass[j, i]!s:.40}"
                )
    if has_no_inverse(mass):
        raise InputError(f"mass is singular, its determinant is 0: {_without_inertia(mass, coordinates)}; give every "
                         "coordinate inertia, or eliminate it")
    diagonal = any(mass[k, k].is_nonpositive for k in range(mass.rows))
    if diagonal or (not symbols_in(mass) and not mass.is_positive_definite):
        raise InputError("mass is not positive definite; every motion must have a positive kinetic energy")


def _without_inertia(mass: sp.ImmutableMatrix, coordinates: tuple[sp.Symbol, ...]) -> str:
    """Return words on the first coordinate that adds no inertia to that of the coordinates before it."""
    k = next((k for k in range(mass.rows) if has_no_inverse(mass[: k + 1, : k + 1])), mass.rows - 1)
    if all(map(vanishes, mass[k, :])):
        return f"{coordinates[k]} has no inertia"
    beside = f" beside {', '.join(map(str, coordinates[:k]))}" if k else ""
    return f"{coordinates[k]} has no inertia of its own{beside}"


def _check_gap(kinetics: Kinetics, gap: sp.Expr) -> None:
    if symbols_in(kinetics.gap) & {*kinetics.velocities}:
        raise InputError(f"gap = {short(gap)} contains a velocity; give it as a position expression")
    if all(vanishes(part) for part in kinetics.directions[0, :]):
        names = ", ".join(map(str, kinetics.coordinates))
        raise InputError(f"gap = {short(gap)} does not depend on the coordinates {names}")


def _check_slip(kinetics: Kinetics, contact: Any) -> None:
    given = f"slip = {short(contact.slip)}"
    row = kinetics.directions[1, :]
    if symbols_in(row) & {*kinetics.velocities}:
        raise InputError(f"{given} is not linear in the velocities; give a sliding velocity, or a position")
    if all(vanishes(part) for part in row):
        raise InputError(f"{given} does not depend on the coordinates; its rate is no sliding velocity")
    minors = [kinetics.directions[:, [i, j]].det() for j in range(row.cols) for i in range(j)]
    if all(map(vanishes, minors)):
        raise InputError(f"{given} is parallel to gap = {short(contact.gap)}; slip must move along the contact")
