"""Which guard is lost first within a step of integration, and when, also if it becomes negative and positive again.

A guard that is positive at both ends of a step may have vanished twice in between. This is examined where it falls at
the beginning and rises at the end, and where its tangents there, a + fall s and b - rise (1 - s), meet sufficiently
low: then its least value is sought. Unlike ``asympk.integrators.watch``, the states within come from a shorter step of
the same method, because dense output is less accurate than a step, for fast states above all. Along slow motion the
slopes of guards are differences, which do not tell, as the rates there do, whether a guard that is 0 first rises.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache

from scipy.optimize import brentq, minimize_scalar

from asympk.asymptotics.nonstiff import Step

Guards = Callable[[float, tuple[float, ...]], Sequence[float]]
NUDGE = 1e-6  # the difference in time, in units of a step, for the slopes of guards at the ends of the step
SOONER = 2.0**-16  # the ratio of the times, from where a guard is 0, by which it is looked for positive values
SHALLOW = 0.5  # where the tangents meet, in units of the lesser end value, above which no dip is sought


def watched(steps: Iterable[Step], guards: Guards | None, size: int) -> Iterator[tuple[Step, tuple[float, int] | None]]:
    """Yield every step together with (time, index) of the guard that first falls through 0 within the step, or None.

    ``guards`` takes the time and the first ``size`` states.
    """
    if guards is None:
        yield from ((step, None) for step in steps)
        return
    after = None
    for step in steps:
        before = after or _end(guards, step.t, step.state[:size], step.stages[0], NUDGE * step.span)
        after = _end(guards, step.after, step.end[:size], step.stages[-1], -NUDGE * step.span)
        yield step, _first_lost(step, guards, size, before, after)


def _end(guards: Guards, t: float, state: tuple, rates: tuple, nudge: float) -> tuple[Sequence[float], list[float]]:
    """Return the values of the guards at one end of a step, and their slopes, by a difference ``nudge`` in time."""
    values = guards(t, state)
    moved = guards(t + nudge, tuple([w + nudge * r for w, r in zip(state, rates, strict=False)]))
    return values, [(b - a) / nudge for a, b in zip(values, moved, strict=True)]


def _first_lost(step: Step, guards: Guards, size: int, before: tuple, after: tuple) -> tuple[float, int] | None:
    hits = []
    for k, (a, b, fall, rise) in enumerate(zip(before[0], after[0], before[1], after[1], strict=True)):
        if b < 0 or (fall < 0 < rise and _may_dip(a, b, fall * step.span, rise * step.span)):
            value = cache(lambda t, k=k: guards(t, step.state_at(t)[:size])[k])
            end = step.after if b < 0 else _dip(value, step)
            if end is not None:
                hits.append((_zero(value, step.t, end), k))
    return min(hits, default=None)


def _may_dip(a: float, b: float, fall: float, rise: float) -> bool:
    """Tell whether a guard with positive values a, b at the ends of a step may be low between them.

    Where the tangents meet in the middle third of the step, the cubic with these values and slopes lies above them.
    """
    share = (a - b + rise) / (rise - fall)
    return min(a, b) > 0 and not (1 / 3 <= share <= 2 / 3 and a + fall * share > SHALLOW * min(a, b))


def _dip(value: Callable, step: Step) -> float | None:
    """Return a time within a step at which a guard is negative, or None."""
    found = minimize_scalar(value, bounds=(step.t, step.after), method="bounded", options={"xatol": 1e-9 * step.span})
    return float(found.x) if found.fun < 0 else None


def _zero(value: Callable, low: float, high: float) -> float:
    """Return the time at which a guard falls through 0; a guard that is 0 at ``low`` was positive just after."""
    if not value(high) < 0:
        return high
    before, after = low, high
    if not value(low) > 0:
        before = low + SOONER * (high - low)
        while low < before < after and not value(before) > 0:
            before, after = low + SOONER * (before - low), before
    if not value(before) > 0:
        return after
    return brentq(value, before, after, xtol=1e-300, rtol=1e-15, maxiter=10_000)  # roots may be multiple
