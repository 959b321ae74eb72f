r"""The approach to a point where the reaction of a rigid contact ceases to be determined: p -> 0 in R = -a / p.

In the time s with dt = p ds the field is smooth and the point an equilibrium, into which p decays like an exponential
and the states like powers of p. So the states at three levels of p in a geometric sequence give their limit. In the
time t every integrator stalls there; it is followed only to a first level, before the point.
"""

from collections.abc import Callable
from itertools import count
from typing import Any

from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode

LEVELS = (1e-2, 1e-5, 1e-7, 1e-9)  # of p, relative to its value at the start
EVALUATIONS = 50_000  # of the field, after which no point is looked for further on


def followed(mode: NumericMode, t: Any, state: tuple, until: Any, advance: Callable[[Any], Segment]) -> Segment:
    """Follow a mode by ``advance(until)``; a reaction that grows beyond all bounds before ends it, at the limit."""
    guard = next((k for k, (kind, _) in enumerate(mode.kinds) if kind == "unbounded"), None)
    met = None if guard is None else approach(mode, guard, float(t), tuple(map(float, state)), float(until))
    if met is None:
        return advance(until)
    near, end, limit = met
    segment = advance(0 * until + near)
    return segment if segment.short or segment.hit is not None else segment._replace(t=end, state=limit, hit=guard)


def approach(mode: NumericMode, guard: int, t: float, state: tuple, until: float) -> tuple | None:
    """Return (t of the first level, t, state) where the guard p of ``mode`` vanishes before all else, else None."""
    import numpy as np
    from scipy.integrate import solve_ivp

    first = mode.guard_values(t, state)[guard]
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
        return min((value for k, value in enumerate(values) if k != guard), default=1.0)

    def left(_, w):
        return until - w[0]

    for end in (within, left):
        vars(end).update(terminal=True, direction=-1)
    levels = [_level(mode, guard, first * part, part == LEVELS[-1]) for part in LEVELS]
    try:
        with np.errstate(all="ignore"):
            found = solve_ivp(field, (0, 1e6 / first), [t, *state], method="LSODA", rtol=1e-12, atol=1e-14,
                              events=[*levels, within, left])  # fmt: skip
    except (ArithmeticError, ValueError):
        return None
    near, *last = found.y_events[: len(LEVELS)]
    if not all(map(len, last)):
        return None
    limit = _limit(*(states[-1] for states in last))
    return float(near[-1][0]), limit[0], tuple(limit[1:])


def _level(mode, guard, value, terminal):
    """Return the event at which the guard has fallen to a value."""

    def reached(_, w):
        return mode.guards(*map(float, w), *mode.p)[guard] - value

    reached.terminal, reached.direction = terminal, -1
    return reached


def _limit(first, second, third):
    """Return the limit of three states whose distance from it is nearly geometric, each by itself."""
    found = []
    for a, b, c in zip(*(map(float, w) for w in (first, second, third)), strict=True):
        bend = (c - b) - (b - a)
        found.append(c - (c - b) ** 2 / bend if abs(c - b) < abs(b - a) and bend else c)
    return found
