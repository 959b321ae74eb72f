r"""The elastic, damped contact: a slow-fast system in the compliance for any number of degrees of freedom.

A spring 1/c beside a damper h/c makes the reaction R = (d + h d')/c of the penetration d = -g. With x = d/c,

    x' = y,    c y' = -(a_N + G_NN R + G_NT F),    z' = a_T + G_NT R + G_TT F,    R = x + h y,

with the sliding velocity z. The velocities are (g', gamma, w) = (-c y, z, w), where w are the rates of the last
coordinates that complete g' and gamma to a basis, at all places if any do. As all coordinates are states, g(q) + c x is
an invariant. With c = eps^2 and h = b eps (b is fixed, and 0 without damping) both x and y = eps x' are
fast, R = x + b y and g' = -eps y. A unilateral contact has R = max(0, x + h y). ``elastic_fields`` derives the fields.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.mechanics.checks import departures, require_continuous
from asympk.mechanics.kinetics import Kinetics, slope_in_powers
from asympk.mechanics.tidy import tidy, vanishes
from asympk.numbers import number, short
from asympk.symbolic.long import replaced
from asympk.symbolic.reading import expression, real_expression
from asympk.symbolic.system import System


def elastic(kinetics: Kinetics, compliance: Any, damping: Any) -> System:
    """Return the ``System`` with the states: coordinates, x, z, the rates that complete a basis, and fast y.

    ``compliance`` is a Symbol c with ``damping`` a time h > 0, or ``eps**2`` with ``damping`` a multiple of eps, 0
    included. A state or force whose name is taken by a coordinate or parameter gets an underscore. Raises
    ``InputError`` for other scalings, ``NotDerivable`` if no rates complete a basis or if the contact's formulas jump.
    """
    scaling = _scaling(compliance, damping)
    used = kinetics.symbols
    if scaling.small.name in map(str, used):
        raise InputError(f"compliance = {compliance}: the mechanism has a {scaling.small} already; take another Symbol")
    if other := {str(s) for s in scaling.ratio.free_symbols - {*used}} & {*map(str, used)}:
        raise InputError(f"damping = {damping}: the mechanism has another {min(other)}; take another Symbol")
    require_continuous(kinetics, (kinetics.gap, kinetics.gap_rate, kinetics.slip), "gap, gap rate or sliding velocity")
    return System.with_friction(**elastic_fields(kinetics, scaling))


@dataclass(frozen=True)
class Scaling:
    """The elastic contact by the small parameter: R = x + ``ratio`` y, g' = -``closing`` y, x' = y / ``clock``."""

    small: sp.Symbol
    ratio: sp.Expr
    closing: sp.Expr
    clock: sp.Expr

    @property
    def fast_reaction(self) -> bool:
        """Whether x is fast, as for a fixed b in h = b eps."""
        return self.clock == self.small


def _scaling(compliance: Any, damping: Any) -> Scaling:
    compliance, damping = expression("compliance", compliance), real_expression("damping", damping)
    if (not damping.is_finite and damping.is_number) or damping.is_negative:
        raise InputError(f"damping = {short(damping)}: it must be zero or positive")
    if isinstance(compliance, sp.Symbol):
        if vanishes(damping) or damping.has(compliance):
            raise InputError(
                f"damping = {damping} with compliance = {compliance}: give a time that does not depend on it, or "
                "compliance=eps**2 with damping=0 or a multiple of eps"
            )
        return Scaling(compliance, damping, compliance, sp.S.One)
    small = compliance.base if compliance.is_Pow and compliance.exp == 2 else None
    if not isinstance(small, sp.Symbol):
        raise InputError(f"compliance = {short(compliance)}: it must be a Symbol or the square of one; put numbers in "
                         "a Scene")  # fmt: skip
    ratio = sp.cancel(damping / small)
    if ratio.has(small):
        raise InputError(f"damping = {damping} with compliance = {compliance}: give 0 or a multiple of {small}")
    return Scaling(small, ratio, small, small)


def elastic_fields(kinetics: Kinetics, scaling: Scaling) -> dict[str, Any]:
    """Return the arguments of ``System.with_friction`` for the elastic contact."""
    x, y, z = state_names(kinetics, scaling.small)
    rest = completing(kinetics)
    rates = velocities(kinetics, rest, -scaling.closing * y, z)
    put = lambda expr: kinetics.tidy_if_short(replaced(expr, rates))  # noqa: E731
    reaction = x + put(scaling.ratio) * y
    normal, force = force_names(kinetics, scaling.small)
    pushed = normal if kinetics.unilateral else reaction
    gap, slip, others = _accelerations(kinetics, rest, pushed, force, put)
    slow = {q: put(u) for q, u in zip(kinetics.coordinates, kinetics.velocities, strict=True)}
    fast = {x: y, y: -gap} if scaling.fast_reaction else {y: -gap}
    slow = slow if scaling.fast_reaction else {**slow, x: y}
    bound, limit = (tidy(part * kinetics.load) for part in (kinetics.friction, kinetics.static))
    found = {"slow": {**slow, **others}, "fast": fast, "velocity": {z: slip}, "force": force, "load": reaction,
             "kinetic": put(bound), "static": put(limit), "small": scaling.small,
             "time": kinetics.time if kinetics.timed or scaling.ratio.has(kinetics.time) else None}  # fmt: skip
    return {**found, "gap": -reaction, "normal": normal} if kinetics.unilateral else found


def pressed(kinetics: Kinetics, system: System, values: dict[sp.Symbol, Any], small: Any) -> dict[sp.Symbol, float]:
    """Return the states x and y of a start off g = g' = 0, from g = -c x and g' = -c y (or g' = -eps y, c = eps^2).

    ``small`` is the value of c or eps. Raises ``InputError`` if ``small`` is missing, and for a start above a
    unilateral contact with a damping time h: such a contact pushes already below the gap h |g'|.
    """
    x, y, _ = state_names(kinetics, system.small)
    if not {x, y} <= {*system.states} or not (off := departures(kinetics, values)):
        return {}
    off_by = ", ".join(f"{name} = {value:g}" for name, value in off.items())
    if kinetics.unilateral and x in system.slow and off.get("g", 0) > 0:
        raise InputError(f"the start is above the contact, {off_by}, where its damper pushes already; start it "
                         "where it touches, or give compliance=eps**2")  # fmt: skip
    if small is None:
        raise InputError(f"the start is off the contact, {off_by}; give {system.small} among the values, from "
                         "which the reaction follows, or coordinates and rates with g = g' = 0")  # fmt: skip
    scale = float(number(str(system.small), small, lambda value: value > 0, "positive"))
    sizes = {"g": (x, scale**2 if x in system.fast else scale), "g'": (y, scale)}
    return {sizes[name][0]: -value / sizes[name][1] for name, value in off.items()}


def state_names(kinetics: Kinetics, small: sp.Symbol) -> tuple[sp.Symbol, ...]:
    """Return the symbols x, y, z of the elastic contact; a name that is taken gets an underscore."""
    return tuple(kinetics.spare(name, small, real=True) for name in "xyz")


def force_names(kinetics: Kinetics, *others: sp.Symbol) -> tuple[sp.Symbol, ...]:
    """Return the symbols N, F of the reaction and of the friction force; a name that is taken gets an underscore."""
    return tuple(kinetics.spare(name, *others, real=True) for name in "NF")


def completing(kinetics: Kinetics) -> tuple[int, ...]:
    """Return the places of the last coordinates whose rates complete (g', gamma) to a basis of the velocities.

    Rates that do so at all times and places come first: the rates of the system have no pole then.
    """
    n, bases, moving = len(kinetics.coordinates), [], (*kinetics.coordinates, kinetics.time)
    for chosen in reversed([*combinations(range(n), n - 2)]):
        determinant = _determinant(kinetics, chosen)
        if not vanishes(determinant):
            bases.append(chosen)
            if all(vanishes(slope_in_powers(determinant, q)) for q in moving):
                return chosen
    if not bases:
        raise NotDerivable("gap rate and sliding velocity depend on each other; no rates complete them to a basis")
    return bases[0]


def _others(kinetics: Kinetics, rest: tuple[int, ...]) -> Iterator[int]:
    """Yield the places of the two coordinates whose rates are not among ``rest``."""
    return (k for k in range(len(kinetics.coordinates)) if k not in rest)


def _determinant(kinetics: Kinetics, rest: tuple[int, ...]) -> sp.Expr:
    """Return the determinant of the basis (g', gamma, rates ``rest``), a minor of (W_N, W_T)."""
    others = [*_others(kinetics, rest)]
    return _parity(others) * kinetics.directions[:, others].det()


def _parity(others: list[int]) -> int:
    """Return the sign of the order in which the two columns ``others`` come before all the rest."""
    return (-1) ** (sum(others) + 1)


def velocities(kinetics: Kinetics, rest: tuple[int, ...], closing: sp.Expr, z: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
    """Return every velocity in terms of g' = ``closing``, z and the rates ``rest``; guides may move with the time."""
    still, others = dict.fromkeys(kinetics.velocities, 0), [*_others(kinetics, rest)]
    gap_drift, slip_drift = (expr.subs(still) for expr in (kinetics.gap_rate, kinetics.slip))
    given = [closing - gap_drift, z - slip_drift, *(kinetics.velocities[k] for k in rest)]
    columns = sp.Matrix.hstack(sp.eye(2), -kinetics.directions[:, list(rest)])
    minors = (_parity(others) * kinetics.directions[:, others].adjugate() * columns).applyfunc(sp.expand)
    parts = [sp.Add(*(a * b for a, b in zip(minors[i, :], given, strict=True))) for i in (0, 1)]
    tidy = kinetics.tidy_if_short
    determinant = tidy(_determinant(kinetics, rest))
    found = {kinetics.velocities[k]: tidy(part / determinant) for k, part in zip(others, parts, strict=True)}
    return {u: found.get(u, u) for u in kinetics.velocities}


def _accelerations(
    kinetics: Kinetics, rest: tuple[int, ...], normal: sp.Expr, force: sp.Symbol, put: Callable[[sp.Expr], sp.Expr]
) -> tuple[sp.Expr, sp.Expr, dict[sp.Symbol, sp.Expr]]:
    """Return g'', z' and the rates of the velocities ``rest`` under the reaction ``normal`` and friction ``force``."""
    G, response = kinetics.delassus, kinetics.response
    rows = [(kinetics.free[i], G[i, 0], G[i, 1]) for i in (0, 1)] + [(response[k, 2], *response[k, :2]) for k in rest]
    gap, slip, *others = (put(free) + by_N * normal + by_T * force for free, by_N, by_T in rows)
    return gap, slip, {kinetics.velocities[k]: rate for k, rate in zip(rest, others, strict=True)}
