r"""The approach to a point where a reaction or a friction force ceases to be determined: p -> 0 in R = -a / p.

That of a rigid contact grows beyond all bounds; friction, between its bounds, becomes 0/0, as at Teixeira's two-fold.

In the time s with dt = p ds the field is smooth and the point is an equilibrium. Towards it p decays exponentially, and
the distances of the states from their limits are powers of p. So the limits follow from the states at three levels of p
in a geometric sequence. In the time t every integrator stalls at the point, and so it is used only up to a first level
of p, before the point. ``approach`` is the hard function.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from itertools import count
from typing import Any

import numpy as np

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.symbolic.guards import NEVER_IDLE

LEVELS = (1e-2, 1e-5, 1e-7, 1e-9)  # levels of p relative to its value at the start
EVALUATIONS = 50_000  # evaluations of the field after which the search for a point is given up


def followed(mode: NumericMode, t: Any, state: tuple, until: Any, advance: Callable[[Any], Segment]) -> Segment:
    """Follow a mode by ``advance(until)``, or to the limit at which its forces cease to be determined before that."""
    kinds = [kind for kind, _ in mode.kinds]
    if "several" in kinds and "unbounded" not in kinds:  # a 0/0 is rare: it is sought only where steps fail
        with suppress(ArithmeticError, TypeError, ValueError):
            segment = advance(until)
            if not segment.short:
                return segment
    guard = next((k for k, kind in enumerate(kinds) if kind in NEVER_IDLE), None)
    met = None if guard is None else approach(mode, guard, float(t), tuple(map(float, state)), float(until))
    if met is None:
        return advance(until)
    near, end, limit = met
    segment = advance(0 * until + near)
    return segment if segment.short or segment.hit is not None else segment._replace(t=end, state=limit, hit=guard)


def approach(mode: NumericMode, guard: int, t: float, state: tuple, until: float) -> tuple | None:
    """Return (t of the first level, t, state) of the zero of the guard p, or None if it is not met first."""
    from scipy.integrate import solve_ivp

    begun = mode.guard_values(t, state)
    first, inside = begun[guard], {k for k, value in enumerate(begun) if value > 0 and k != guard}
    if not first > 0:
        return None

    evaluations = count()

    def field(_, w):
        if next(evaluations) == EVALUATIONS:
            raise ArithmeticError
        at = [*map(float, w)]
        p = mode.guards(*at, *mode.p)[guard]
        return [p, *(p * rate for rate in mode.field(*at, *mode.p))]

    def within(_, w):
        values = mode.guards(*map(float, w), *mode.p)
        inside.update(k for k, value in enumerate(values) if value > 0 and k != guard)  # a contact opens from 0
        return min((values[k] for k in inside), default=1.0)

    def left(_, w):
        return until - w[0]

    levels = [partial(_above, mode, guard, first * part) for part in LEVELS]
    for end in (*levels, within, left):
        vars(end).update(terminal=end not in levels[:-1], direction=-1)
    try:
        with np.errstate(all="ignore"):
            found = solve_ivp(field, (0, 1e6 / first), [t, *state], method="LSODA", rtol=1e-12, atol=1e-14,
                              events=[*levels, within, left])
    except (ArithmeticError, ValueError):
        return None
    near, *last = found.y_events[: len(LEVELS)]
    if not all(map(len, last)):
        return None
    limit = _limit(*(states[-1] for states in last))
    return float(near[-1][0]), limit[0], tuple(limit[1:])


def _above(mode, guard, level, _, w):
    return mode.guards(*map(float, w), *mode.p)[guard] - level


def _limit(first, second, third):
    """Return the limits of the states from three of their values, whose distances from it are nearly geometric."""
    found = []
    for a, b, c in zip(*(map(float, w) for w in (first, second, third)), strict=True):
        bend = (c - b) - (b - a)
        found.append(c - (c - b) ** 2 / bend if abs(c - b) < abs(b - a) and bend else c)
    return found
