r"""The coordinate by which a contact stays closed while another quantity p of its mechanism changes.

    g(q(p), p) = 0,    q(p_0) is next to the place of the mechanism

Newton's method follows the root q(p) from p_0 to both ends of a range, as long as g_q keeps its sign.
"""

from collections.abc import Callable
from typing import Any

import sympy as sp

from asympk.errors import InputError, OutOfRange
from asympk.mechanics.evaluation import ROUNDING, evaluate
from asympk.mechanics.kinetics import Kinetics
from asympk.mechanics.paradox import condition
from asympk.symbolic.long import symbols_in
from asympk.symbolic.reading import as_floats

PLACES = 65  # of p between p_0 and each end of the range
STEPS = 40  # of Newton's method at one place


def closing_coordinate(kinetics: Kinetics, name: str, values: dict[sp.Symbol, Any]) -> sp.Symbol | None:
    """Return the coordinate q that closes the contact while the quantity ``name`` changes; None if none is needed.

    It is one of those along which the gap changes at the place ``values``: the last on which the paradox does not
    depend, or the last of all. None is needed where the gap does not depend on ``name``, or where it lacks a number.
    """
    gap = symbols_in(kinetics.gap)
    if name not in map(str, gap) or any(s not in values for s in gap if str(s) != name):
        return None
    moving = [q for k, q in enumerate(kinetics.coordinates) if q in gap and str(q) != name
              and any(evaluate((kinetics.directions[0, k],), values))]
    matter = symbols_in(condition(kinetics))
    return next(reversed([q for q in moving if q not in matter] or moving), None)


def closed_by(
    kinetics: Kinetics, q: sp.Symbol, over: tuple[sp.Symbol, Any, Any], values: dict[sp.Symbol, Any]
) -> Callable[[Any], Any]:
    """Return q as a function of an array of p, ``over = (p, low, high)``, that closes the contact.

    ``values`` gives the place. The function raises ``InputError`` where no q closes the contact.
    """
    import numpy as np

    p, low, high = over[0], *(float(as_floats(str(over[0]), end)) for end in over[1:])
    begin, first = (float(as_floats(str(s), values[s])) for s in (p, q))
    parts = (kinetics.gap, kinetics.directions[0, kinetics.coordinates.index(q)])
    root = _root(parts, p, q, values)
    start, side = root(np.array([begin]), np.array([first]), 0)
    table = {begin: start[0]}
    for end in (low, high):
        now = start
        for at in np.linspace(begin, end, PLACES)[1:]:
            now, _ = root(np.array([at]), now, side[0])
            table[float(at)] = now[0]
    known = np.array(sorted(table.items())).T

    def follower(at: Any) -> Any:
        places = np.asarray(at, dtype=float)
        return root(places, np.interp(places, *known), side[0])[0]

    return follower


def _root(parts, p, q, values):
    """Return a function of places of p, of guesses of q, and of the sign of g_q or 0: the roots q and the sign."""
    import numpy as np

    def root(at: Any, guess: Any, side: float) -> tuple[Any, Any]:
        now, moved, slope = guess, guess, np.ones_like(at)
        for _ in range(STEPS):
            try:
                gap, slope = evaluate(parts, {**values, p: at, q: now})
            except OutOfRange:
                break
            with np.errstate(divide="ignore", invalid="ignore"):
                moved = np.asarray(gap / slope)
            if not np.isfinite(moved).all():
                break
            now = now - moved
            if (abs(moved) <= ROUNDING * (1 + abs(now))).all():
                break
        far = ~(abs(moved) <= np.sqrt(ROUNDING) * (1 + abs(now))) | (np.sign(slope) * side < 0)
        if far.any():
            raise InputError(f"no {q} closes the contact at {p} = {at[far].flat[0]:g}: give a range of {p} in which "
                             f"it closes, from {q} of the state on")
        return now, np.sign(slope)

    return root
