r"""The coordinate by which a contact stays closed while another quantity p of its mechanism changes.

    g(q(p), p) = 0,    q(p_0) is next to the place of the mechanism,    dq/dp = -g_p / g_q

Newton's method follows the root q(p) from p_0 to both ends of a range, as long as g_q keeps its sign. From one place to
the next g_q changes by the factor ``RATIO`` at most, and q about as dq/dp at both tells: so q stays on its branch.
"""

from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable, OutOfRange
from asympk.mechanics.evaluation import ROUNDING, evaluate
from asympk.mechanics.kinetics import Kinetics, slope_in_powers
from asympk.mechanics.paradox import condition
from asympk.mechanics.paradoxset import ends_of
from asympk.symbolic.long import symbols_in
from asympk.symbolic.reading import as_floats

PLACES = 64  # least number of places of p between p_0 and each end of the range
RATIO = 2  # of g_q at two places beside each other, at most
SHARE = 0.75  # part of |dq/dp| dp, a mean of both places, by which dq may differ from dq/dp dp
STEPS = 40  # of Newton's method at one place


def closing_coordinate(kinetics: Kinetics, name: str, values: dict[sp.Symbol, Any]) -> sp.Symbol | None:
    """Return the coordinate q that closes the contact while the quantity ``name`` changes; None if none is needed.

    It is one of those along which the gap changes at the place ``values``: the last on which the paradox does not
    depend, or the last of all. None is needed where the gap does not depend on ``name``, or where it lacks a number,
    nor where a parameter closes the contact on which the paradox does not depend, as the height of a hinge. Raises
    ``InputError`` if nothing but ``name`` closes the contact.
    """
    gap, coordinates = symbols_in(kinetics.gap), kinetics.coordinates
    if name not in map(str, gap) or any(s not in values for s in gap if str(s) != name):
        return None
    moving = [s for s in (*coordinates, *kinetics.parameters) if s in gap and str(s) != name
              and any(evaluate((slope_in_powers(kinetics.gap, s),), values))]
    matter = symbols_in(condition(kinetics))
    if closing := [q for q in moving if q in coordinates]:
        return ([q for q in closing if q not in matter] or closing)[-1]
    if matter.issuperset(moving):
        raise InputError(f"the contact opens where {name} changes, and no other coordinate closes it: name another "
                         "quantity under [over]")
    return None


@dataclass(frozen=True)
class _Place:
    """A place p with its root q, the slope g_q and the rise dq/dp."""

    p: float
    q: float
    slope: float
    rise: float


def closed_by(
    kinetics: Kinetics, q: sp.Symbol, over: tuple[sp.Symbol, Any, Any], values: dict[sp.Symbol, Any]
) -> Callable[[Any], Any]:
    """Return q as a function of an array of p, ``over = (p, low, high)``, that closes the contact.

    ``values`` gives the place. Raises ``NotDerivable``, as does the function, where q of this place cannot be followed.
    """
    import numpy as np

    p, ends = over[0], ends_of(over[0], over[1:])
    begin, first = (float(as_floats(str(s), values[s])) for s in (p, q))
    parts = (kinetics.gap, kinetics.directions[0, kinetics.coordinates.index(q)], slope_in_powers(kinetics.gap, p))
    root, start = _root(parts, p, q, values), _Place(begin, first, np.nan, 0.0)
    start = _placed(root, start, begin)
    if np.isnan(start.q):
        raise _refused(p, q, begin)
    ways = [_followed(root, start, end) for end in ends]
    for way, end in zip(ways, ends, strict=True):
        if not _is_at(way[-1], end, ROUNDING**0.5):
            raise _refused(p, q, way[-1].p)
    places = {place.p: place for way in ways for place in way}
    known = np.array([astuple(places[at]) for at in sorted(places)])

    def follower(at: Any) -> Any:
        wanted = np.asarray(at, dtype=float)
        found, slope, _ = root(wanted, _between(known, wanted))
        far = ~(np.sign(start.slope) * slope >= -np.sqrt(ROUNDING) * abs(start.slope))
        if far.any():
            raise _refused(p, q, wanted[far].flat[0])
        return found

    return follower


def _refused(p: sp.Symbol, q: sp.Symbol, at: float) -> NotDerivable:
    return NotDerivable(f"no {q} closes the contact at {p} = {at:g}: give a range of {p} in which it closes, from {q} "
                        "of the state on")


def _root(
    parts: tuple[sp.Expr, ...], p: sp.Symbol, q: sp.Symbol, values: dict[sp.Symbol, Any]
) -> Callable[[Any, Any], tuple[Any, ...]]:
    """Return a function of arrays of p and of guesses of q: the roots q, g_q and dq/dp, nan where there is no root."""
    import numpy as np

    def root(at: Any, guess: Any) -> tuple[Any, ...]:
        now, near = guess, False
        for _ in range(STEPS):
            try:
                gap, slope, other = evaluate(parts, {**values, p: at, q: now})
            except OutOfRange:
                return (np.full(np.shape(at), np.nan),) * 3
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                moved, rise = np.asarray(gap / slope), -other / slope
            lost = ~np.isfinite(moved)
            now = now - np.where(lost, 0, moved)
            far = ~(abs(moved) <= np.sqrt(ROUNDING) * (1 + abs(now)))
            if near:  # and one step later the root is known to rounding
                break
            near = (lost | ~far).all()
        return tuple(np.where(far, np.nan, part) for part in (now, slope, rise))

    return root


def _placed(root: Callable[..., Any], before: _Place, at: float) -> _Place:
    """Return the place p = ``at`` with the root that continues that of the place before; nan if there is none."""
    import numpy as np

    guess = before.q + before.rise * (at - before.p)
    return _Place(at, *(float(part[0]) for part in root(np.array([at]), np.array([guess]))))


def _followed(root: Callable[..., Any], start: _Place, end: float) -> list[_Place]:
    """Return places from ``start`` to ``end``, or to the last place at which the root can be followed."""
    longest = (end - start.p) / PLACES
    found, step = [start], longest
    while not (_is_at(found[-1], end) or _is_at(found[-1], found[-1].p + step)):
        last = found[-1]
        at = last.p + step if abs(step) < abs(end - last.p) else end
        place = _placed(root, last, at)
        if _continues(place, last):
            found.append(place)
            step = min(2 * step, longest, key=abs)
        else:
            step = (at - last.p) / 2
    return found


def _is_at(place: _Place, p: float, part: float = ROUNDING) -> bool:
    return abs(p - place.p) <= part * (1 + abs(p))


def _continues(place: _Place, before: _Place) -> bool:
    """Tell whether a root continues that of the place before; g_q may change its size at once, as where a cam bends."""
    step, moved = place.p - before.p, place.q - before.q
    mean, most = (place.rise + before.rise) / 2 * step, (abs(place.rise) + abs(before.rise)) / 2 * abs(step)
    near = ROUNDING**0.5 * (1 + abs(place.q))
    if _is_at(before, place.p, ROUNDING**0.5) and abs(moved) <= near:
        return place.slope * before.slope > 0
    even = place.slope * before.slope > 0 and 1 / RATIO <= place.slope / before.slope <= RATIO
    return even and abs(moved - mean) <= SHARE * most + ROUNDING * (1 + abs(place.q))


def _between(known: Any, at: Any) -> Any:
    """Return guesses of q at an array of p: the cubic polynomials through the rows (p, q, g_q, dq/dp) of ``known``."""
    import numpy as np

    p, q, _, rise = known.T
    k = np.clip(np.searchsorted(p, at) - 1, 0, len(p) - 2)
    h = p[k + 1] - p[k]
    s = (at - p[k]) / h
    secant = q[k + 1] - q[k]
    return q[k] + s * secant + s * (1 - s) * ((1 - s) * (h * rise[k] - secant) - s * (h * rise[k + 1] - secant))
