r"""The rigid motions of a closed contact, counted at numbers and on arrays.

In slip of the direction s = sgn(gamma) with a reaction of the sign r,

    F = -s r friction load R,    R = -a_N / p,    p = G_NN - s r friction load G_NT,

and the motion exists if R has the sign r. At rest, gamma = 0, slip starts in the direction s if gamma' has this sign
both with the kinetic and with the static bound. Stick keeps g'' = gamma' = 0 by (R, F) = -G^-1 (a_N, a_T) and exists if
|F| <= static load |R|. A unilateral contact requires R >= 0, and lifts off if a_N > 0. ``_slip`` and ``_stick`` test
one candidate each.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import sympy as sp

from asympk.errors import InputError, Undecided
from asympk.mechanics.checks import require_positive_mass
from asympk.mechanics.evaluation import ROUNDING, evaluate_ahead
from asympk.mechanics.kinetics import Kinetics
from asympk.naming import named
from asympk.numbers import common_shape
from asympk.symbolic.branches import by_direction, with_direction

MOTIONS = ("slip", "stick", "lift_off")


class Motion(NamedTuple):
    """A rigid motion: ``"slip"``, ``"stick"`` or ``"lift_off"``, and its reaction R.

    Of several closed contacts the name is that of a mode of ``Mechanism.rigid``, with the reactions of all contacts,
    nan where these are not determined.
    """

    name: str
    reaction: float | tuple[float, ...]


@dataclass(frozen=True)
class Branch:
    """One candidate for a motion on arrays: where the candidate exists, and its reaction there (0 elsewhere)."""

    name: str
    exists: Any
    reaction: Any


@dataclass(frozen=True)
class MotionMap:
    """The rigid motions on arrays of one shape."""

    branches: tuple[Branch, ...]

    @property
    def count(self) -> Any:
        """The number of motions, an array of integers."""
        return sum(branch.exists.astype(int) for branch in self.branches)

    def count_of(self, name: str) -> Any:
        """Return the number of motions called ``name``, an array of integers; raises ``UnknownName``."""
        name = named("motion", name, MOTIONS)
        return sum((branch.exists.astype(int) for branch in self.branches if branch.name == name), 0 * self.count)


def motions(kinetics: Kinetics, values: dict[sp.Symbol, Any]) -> tuple[Motion, ...]:
    """Return all rigid motions at numbers as pairs (name, reaction): where there is a paradox, none or several.

    The contact counts as closed, g = g' = 0. ``values`` gives each state and parameter that the contact's equations
    contain; strings are decimals or ratios, and the time is 0 unless it is given. A sliding velocity that is a rounding
    error counts as 0. Raises ``InputError`` for missing values, ``Undecided`` if the reaction is not determined:
    p = a_N = 0, or G is singular.
    """
    found = motion_map(kinetics, values)
    return tuple(Motion(b.name, float(b.reaction)) for b in found.branches if b.exists)


def motion_map(kinetics: Kinetics, values: dict[sp.Symbol, Any]) -> MotionMap:
    """Return the ``MotionMap`` on arrays that broadcast; ``values`` as for ``motions``."""
    terms = _terms(kinetics, {kinetics.time: 0} | values)
    signs = (1,) if kinetics.unilateral else (1, -1)
    stick = _stick(terms, kinetics.unilateral)
    slips = [_slip(terms, direction, sign, stick.exists) for direction in (1, -1) for sign in signs]
    lift_off = [Branch("lift_off", terms.a_N > 0, 0 * terms.a_N)] if kinetics.unilateral else []
    return MotionMap((*slips, stick, *lift_off))


@dataclass(frozen=True)
class _Terms:
    """The terms of the contact's equations as arrays of one shape.

    ``kinetic`` and ``static`` contain the load; both are mappings from the direction of slip, 1 or -1.
    """

    kinetic: dict[int, Any]
    static: dict[int, Any]
    G_NN: Any
    G_NT: Any
    G_TT: Any
    a_N: Any
    a_T: Any
    slip: Any


def _terms(kinetics: Kinetics, values: dict[sp.Symbol, Any]) -> _Terms:
    import numpy as np

    parts = (kinetics.slip.diff(s) * s for s in (*kinetics.coordinates, *kinetics.velocities))
    size = sp.Add(*map(sp.Abs, parts))
    G, slip = kinetics.delassus, kinetics.slip
    laws = (by_direction(slip, law * kinetics.load, part)
            for part, law in (("kinetic", kinetics.friction), ("static", kinetics.static)))
    bounds = (with_direction(slip, law, side) for law in laws for side in (1, -1))
    exprs = (*bounds, G[0, 0], G[0, 1], G[1, 1], *kinetics.free, slip, size)
    require_positive_mass(kinetics, values)  # before its inverse: that may not exist
    found = evaluate_ahead(kinetics, exprs, values)
    shape = common_shape(values, values.values())  # also of values that the equations do not contain
    *arrays, size = (np.array(np.broadcast_to(a, shape), dtype=float) for a in found)
    kinetic, static = (dict(zip((1, -1), pair, strict=True)) for pair in (arrays[:2], arrays[2:4]))
    terms = _Terms(kinetic, static, *arrays[4:])
    if not np.all(terms.G_NN):
        raise InputError("the gap has no slope at these values, G_NN = 0: no reaction of its contact is determined; "
                         "write it as a distance, which grows evenly")
    if (least := min(kinetic[side].min(initial=0) for side in kinetic)) < 0:
        raise InputError(f"friction times its load is {least:g} at these values; it must not be negative")
    if any(np.any(static[side] < kinetic[side]) for side in kinetic):
        raise InputError("static friction is below the kinetic one at these values; make it at least that")
    terms.slip[np.abs(terms.slip) <= ROUNDING * size] = 0.0
    return terms


def _slip(terms: _Terms, direction: int, sign: int, held: Any) -> Branch:
    """Return the branch of slip in one direction with a reaction of one sign; R = 0 counts as positive.

    Where stick exists (``held``), an acceleration within its rounding error starts no slip.
    """
    import numpy as np

    kinetic, static = terms.kinetic[direction], terms.static[direction]
    reaction, exists = _reaction(terms, kinetic, direction, sign)
    static_reaction, onset = _reaction(terms, static, direction, sign)
    for bound, needed in ((kinetic, reaction), (static, static_reaction)):
        onset = onset & _starts(terms, bound, needed, direction, sign, held)
    exists = exists & np.where(terms.slip == 0, onset, np.sign(terms.slip) == direction)
    return Branch("slip", exists, np.where(exists, reaction, 0.0))


def _reaction(terms: _Terms, bound: Any, direction: int, sign: int) -> tuple[Any, Any]:
    import numpy as np

    coupling = bound * terms.G_NT
    p = terms.G_NN - direction * sign * coupling
    p = np.where(abs(p) <= ROUNDING * (terms.G_NN + abs(coupling)), 0.0, p)
    if np.any((p == 0) & (terms.a_N == 0)):
        raise Undecided("a_N = 0 where G_NN = friction load |G_NT|: any reaction would do; move off this point")
    reaction = -terms.a_N / np.where(p == 0, 1.0, p) + 0.0
    positive = (reaction > 0) | (reaction == 0) if sign > 0 else reaction < 0
    return reaction, positive & (p != 0)


def _starts(terms: _Terms, bound: Any, reaction: Any, direction: int, sign: int, held: Any) -> Any:
    rate = direction * (terms.a_T + (terms.G_NT - direction * sign * bound * terms.G_TT) * reaction)
    size = abs(terms.a_T) + (abs(terms.G_NT) + bound * terms.G_TT) * abs(reaction)
    return rate > 2 * ROUNDING * size * held


def _difference(first: Any, second: Any) -> Any:
    """Return first - second, or 0 where the difference is within the rounding of both."""
    import numpy as np

    return np.where(abs(first - second) <= 2 * ROUNDING * (abs(first) + abs(second)), 0.0, first - second)


def _stick(terms: _Terms, unilateral: bool) -> Branch:
    """Return the branch of stick; where G_TT = 0, as at a dead centre, friction has no effect.

    Where G is singular, as for an arm that is stretched out, gap and slip move together, and only R + F G_NT / G_NN has
    an effect. This sum determines R if there is no friction, and also if the sum is 0 and static load |G_NT| < G_NN:
    then R = F = 0. Raises ``Undecided`` where stick otherwise leaves the reaction open.
    """
    import numpy as np

    power = np.frexp(np.maximum(terms.G_NN, terms.G_TT))[1]
    G_NN, G_NT, G_TT = (np.ldexp(G, -power) for G in (terms.G_NN, terms.G_NT, terms.G_TT))  # products keep their range
    coupling = np.maximum(terms.static[1], terms.static[-1]) * abs(G_NT)
    singular, alike = _difference(G_NN * G_TT, G_NT**2) == 0, _difference(G_NN * terms.a_T, G_NT * terms.a_N) == 0
    idle = singular & ((coupling == 0) | ((terms.a_N == 0) & (coupling < G_NN)))
    leaves = unilateral & (terms.a_N > 0) & (coupling <= G_NN)
    if np.any(singular & alike & (terms.slip == 0) & ~idle & np.logical_not(leaves)):
        raise Undecided("gap and slip move as one here, and any reaction would do: move off this point")
    divisor = np.where(idle, G_NN, _difference(G_NN * G_TT, G_NT**2))
    possible = (divisor != 0) & (~idle | alike)
    divisor = np.where(divisor == 0, 1.0, divisor)
    reaction = np.where(idle, -terms.a_N, G_NT * terms.a_T - G_TT * terms.a_N) / divisor + 0.0
    friction = np.where(idle, 0.0, G_NT * terms.a_N - G_NN * terms.a_T) / divisor
    bound = np.where(friction < 0, terms.static[1], terms.static[-1]) * np.abs(reaction)
    size = bound + np.where(idle, 0.0, np.abs(G_NT * terms.a_N) + np.abs(G_NN * terms.a_T)) / abs(divisor)
    exists = possible & (terms.slip == 0) & (np.abs(friction) <= bound + ROUNDING * size)
    if unilateral:
        exists &= reaction >= 0
    return Branch("stick", exists, np.where(exists, np.ldexp(reaction, -power), 0.0))
