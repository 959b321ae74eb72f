"""The first guard that is lost in one step of an integrator, also if it is negative only between the ends of the step.

Between the ends a guard g is evaluated on the polynomial of the step, at its quarters and where g' vanishes between two
of these. The search is skipped where g(a) + g(b) exceeds (b - a) |g'| at both ends and g does not turn, and so for
nearly every step. ``first_lost`` is the entry, ``near`` the test that skips the search, and ``_falls`` the search.
"""

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any, NamedTuple

PARTS = (0.25, 0.5, 0.75)  # the parts of a step at whose ends guards and rates are evaluated in the search
BESIDE_BUMPS = (0, *(sign * 16.0**-k for k in range(1, 6) for sign in (1, -1)))  # parts of a step; odd bumps are 0 at 0
TURNS = 8  # middles of one wave that are looked at in one step
ROUNDED = 2.0**-30  # part of a step by which rounding may hide that it begins or ends at a middle
DEEP = 2.0**-10  # part of its value at the begin of a step by which a guard must be negative within, not by errors
STEEPER = 16  # largest ratio of a guard's rate within a step to its rates at the ends, if the guard turns within


class GuardSample(NamedTuple):
    """The values of the guards and their rates at one time."""

    t: Any
    values: Any
    rates: Any


def near(before: GuardSample, after: GuardSample, k: int) -> Any:
    """Tell whether guard ``k`` may reach zero between two samples.

    It may if the sum of its two values is below its change over the span at one of its two rates; or, if it falls at
    the first sample and rises at the second, below ``STEEPER`` times such a change.
    """
    start, end, span = before.rates[k], after.rates[k], after.t - before.t
    above, fall, rise = before.values[k] + after.values[k], span * abs(start), span * abs(end)
    crosses, turns = (above < fall) | (above < rise), (start < 0) & (end > 0)
    return crosses | (turns & ((above < STEEPER * fall) | (above < STEEPER * rise)))


def first_lost(
    before: GuardSample, after: GuardSample, values: Callable, rates: Callable, root: Callable,
    parts: Iterable[Any] = PARTS, touches: Callable[[Any, int], bool] = lambda t, k: False,
) -> tuple | None:
    """Return (time, guard) of the first guard lost between two samples, or None.

    ``values(t)`` and ``rates(t)`` are those of the guards on the polynomial of the step, and
    ``root(function, low, high)`` returns where a function changes its sign. A guard that starts at zero, or below zero
    by the error of a step, is lost only where it falls from there, since at the start its sign may be rounding.
    A guard that turns where it ``touches(t, k)`` zero, but for errors, and did not before, is lost where it turns.
    """
    found: list[tuple[Any, int]] = []
    samples: list[GuardSample] = []
    for k in suspects(before, after):
        times = (t for part in parts if before.t < (t := before.t + (after.t - before.t) * part) < after.t)
        samples = samples or [before, *(GuardSample(t, values(t), rates(t)) for t in times), after]
        if (t := _falls(samples, k, values, rates, root, _crosses(before, after, k), touches)) is not None:
            found.append((t, k))
    return min(found, default=None)


def dips(before: Iterable[Any], within: Iterable[Any]) -> bool:
    """Tell whether a guard is clearly negative ``within`` a step and was positive ``before`` it."""
    return any(value < -DEEP * old < 0 for old, value in zip(before, within, strict=True))


def passed_wholes(every: bool, before: Any, after: Any) -> list[int]:
    """Return the whole values that the phase of a middle passes, or begins or ends at while it changes.

    It is 0 alone unless the phase has a middle at ``every`` whole value.
    """
    slack = ROUNDED * (after - before)
    low, high = (before - slack, after + slack) if slack > 0 else (after + slack, before - slack)
    if not every:
        return [0] if low <= 0 <= high and slack else []
    first, last = int(low) + (low > int(low)), int(high) - (high < int(high))
    return [*range(first, min(last, first + TURNS) + 1)] if slack else []


def suspects(before: GuardSample, after: GuardSample) -> list[int]:
    """Return the guards that may be lost between two samples."""
    return [k for k in range(len(after.values))
            if _crosses(before, after, k) or (before.values[k] > 0 and near(before, after, k))]


def _crosses(before: GuardSample, after: GuardSample, k: int) -> bool:
    start, end = before.values[k], after.values[k]
    if start < 0:
        return end <= 0 and before.rates[k] > 0 > after.rates[k]
    return end <= 0 and start != end and (start > 0 or after.rates[k] < 0)


def _falls(
    samples: list[GuardSample], k: int, values: Callable, rates: Callable, root: Callable, crosses: bool,
    touches: Callable[[Any, int], bool],
) -> Any:
    """Return the first time at which guard ``k`` falls through zero between two successive samples, or None."""
    for a, b in pairwise(samples):
        low = root(lambda t: rates(t)[k], a.t, b.t) if a.values[k] <= 0 and a.rates[k] > 0 > b.rates[k] else a.t
        if (b.values[k] < 0 and (a.values[k] > 0 or b.rates[k] < 0)) or (crosses and b is samples[-1]):
            return root(lambda t: values(t)[k], low, b.t)
        if a.values[k] > 0 and a.rates[k] < 0 < b.rates[k]:
            least = root(lambda t: rates(t)[k], a.t, b.t)
            value = values(least)[k]
            if touches(least, k) and not touches(a.t, k):
                return least
            if value < 0:
                return root(lambda t: values(t)[k], a.t, least)
    return None
