r"""Where the rigid contact has a paradox: friction load |G_NT| > G_NN, the critical friction and its least value."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.mechanics.evaluation import as_floats, evaluate, exact
from asympk.mechanics.kinetics import Kinetics
from asympk.mechanics.tidy import shortest, tidy


def critical_friction(kinetics: Kinetics) -> sp.Expr:
    """Return G_NN / (load |G_NT|), oo where G_NT vanishes identically."""
    normal, mixed = _ratio(kinetics)
    return sp.oo if mixed == 0 else normal / (kinetics.load * mixed)


def condition(kinetics: Kinetics) -> sp.Basic:
    """Return friction load |G_NT| > G_NN, the condition for a paradox, without common factors."""
    normal, mixed = _ratio(kinetics)
    return sp.Gt(kinetics.friction * kinetics.load * mixed, normal)


def _ratio(kinetics: Kinetics) -> tuple[sp.Expr, sp.Expr]:
    """Return G_NN and |G_NT| divided by what they have in common."""
    normal, mixed = kinetics.delassus[0, 0], kinetics.delassus[0, 1]
    if mixed == 0:
        return sp.S.One, sp.S.Zero
    ratio = shortest(tidy(normal / mixed), tidy(-normal / mixed))
    return tuple(map(sp.Abs, sp.fraction(ratio)))


@dataclass(frozen=True)
class Interval:
    """A stretch of one coordinate with a paradox; ``other`` is the value of the second coordinate, or None."""

    start: float
    end: float
    other: float | None = None


@dataclass(frozen=True)
class ParadoxSet:
    """Where a mechanism has a paradox over one or two coordinates or parameters, named in ``over``.

    ``intervals`` is the table; ``edges`` are its ends that lie within the range. An interval shorter than the range
    divided by ``samples`` may be missed.
    """

    over: tuple[str, ...]
    ranges: tuple[tuple[float, float], ...]
    intervals: tuple[Interval, ...]
    samples: int

    @property
    def edges(self) -> tuple[float, ...]:
        """The ends of the intervals that are no ends of the range, in order."""
        ends = (end for interval in self.intervals for end in (interval.start, interval.end))
        return tuple(end for end in ends if end not in self.ranges[0])


def paradox_set(
    kinetics: Kinetics, ranges: dict[sp.Symbol, Any], values: dict[sp.Symbol, Any], samples: int = 2001
) -> ParadoxSet:
    """Return the ``ParadoxSet`` over the coordinates or parameters of ``ranges``, ``{name: (low, high)}``, one or two.

    ``values`` gives the others, as numbers or as functions of those of ``ranges``, in their order; the edges over the
    first are refined to rounding. Raises ``InputError`` for ranges that are none and for missing values.
    """
    names = tuple(ranges)
    if not 1 <= len(names) <= 2:
        raise InputError(f"{len(names)} ranges; give one or two coordinates or parameters with their (low, high)")
    ends = tuple(_ends(name, ranges[name]) for name in names)
    import numpy as np

    others = np.linspace(*ends[1], 201) if len(names) == 2 else [None]
    found = []
    for other in others:
        fixed = () if other is None else (other,)
        excess = partial(_excess, kinetics, names, values, fixed)
        found += [Interval(*ends_, *fixed) for ends_ in _positive(excess, np.linspace(*ends[0], samples))]
    return ParadoxSet(tuple(map(str, names)), ends, tuple(found), samples)


def _ends(name: sp.Symbol, given: Any) -> tuple[float, float]:
    low, high = (as_floats(f"range of {name}", end) for end in given)
    if not low < high:
        raise InputError(f"range of {name} = ({low:g}, {high:g}): give (low, high) with low < high")
    return low, high


def _excess(kinetics: Kinetics, names: tuple, values: dict, fixed: tuple, at: Any) -> Any:
    """Return friction load |G_NT| - G_NN on an array of the first coordinate."""
    import numpy as np

    turning = (at, *fixed)
    placed = {key: value(*turning) if callable(value) else value for key, value in values.items()}
    placed |= dict(zip(names, turning, strict=True))
    G = kinetics.delassus
    (found,) = evaluate((kinetics.friction * kinetics.load * sp.Abs(G[0, 1]) - G[0, 0],), placed)
    return np.broadcast_to(found, np.shape(at))


def _positive(function: Callable[[Any], Any], at: Any) -> list[tuple[float, float]]:
    """Return the intervals between the ends of ``at`` where a function of arrays is positive, their ends refined."""
    import numpy as np

    inside = function(at) > 0
    cuts = np.nonzero(inside[1:] != inside[:-1])[0]
    low, high = at[cuts], at[cuts + 1]
    for _ in range(60):
        middle = (low + high) / 2
        same = (function(middle) > 0) == inside[cuts] if len(cuts) else middle
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    ends = [*((at[0],) if inside[0] else ()), *high, *((at[-1],) if inside[-1] else ())]
    return [(float(a), float(b)) for a, b in zip(ends[::2], ends[1::2], strict=True)]


@dataclass(frozen=True)
class LeastFriction:
    """The least critical friction over a coordinate, and the equation that says where it is."""

    friction: sp.Expr
    where: sp.Basic


def least(
    kinetics: Kinetics, coordinate: sp.Symbol, values: dict[sp.Symbol, Any], own: Callable[[Any], Any]
) -> LeastFriction:
    """Return the ``LeastFriction`` over ``coordinate``, exact, where the critical friction is rational in its tangent.

    ``values`` are exact numbers for parameters; those that are left stay symbols. Raises ``NotDerivable`` where the
    critical friction is no such function, has no least value, or its least one depends on signs that are not known.
    """
    ratio = (critical_friction(kinetics)).subs({key: exact(str(key), value) for key, value in values.items()})
    tangent = sp.Symbol("T", positive=True)
    turned = _in_tangent(ratio, coordinate, tangent)
    if turned is None or not turned.has(tangent):
        raise NotDerivable(f"the critical friction {own(ratio)} is no rational function of tan({own(coordinate)})")
    slope = sp.fraction(sp.cancel(sp.together(sp.diff(turned, tangent))))[0]
    places = [root for root in sp.roots(sp.Poly(slope, tangent)) if root.is_positive]
    values_there = {sp.simplify(turned.subs(tangent, root)): root for root in places}
    candidates = [value for value in values_there if value.is_positive]
    if not candidates or (len(candidates) > 1 and not all(value.is_number for value in candidates)):
        name = own(coordinate)
        raise NotDerivable(f"the least critical friction over {name} depends on parameters; give their values")
    best = min(candidates)
    return LeastFriction(best, sp.Eq(sp.tan(own(coordinate)), values_there[best]))


def _in_tangent(ratio: sp.Expr, coordinate: sp.Symbol, tangent: sp.Symbol) -> sp.Expr | None:
    """Return a ratio of even degree in sine and cosine in terms of the tangent, between 0 and a right angle."""
    cosine = sp.Dummy("c", positive=True)
    put = {sp.sin(coordinate): tangent * cosine, sp.cos(coordinate): cosine}
    found = sp.cancel(sp.expand_trig(ratio).subs(put)).subs(cosine**2, 1 / (1 + tangent**2))
    found = sp.cancel(sp.together(found))
    return None if found.has(cosine, coordinate) or not found.is_rational_function(tangent) else found
