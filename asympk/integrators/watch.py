"""Guards over one step of an integrator: the first one lost, where it also leaves and comes back within the step.

What a guard does between the ends of a step is looked for on the polynomial of the step. A guard that does not turn and
is far off its zero, against how fast it moves at the ends, is left alone: that spares nearly every step the search.
"""

from collections.abc import Callable, Iterable
from itertools import pairwise
from math import ulp
from typing import Any, NamedTuple

from asympk.automaton.numericmode import NumericMode

PARTS = (0.25, 0.5, 0.75)  # of a step: the times at which the rates are looked at in the search
STEEPER = 16
TOGETHER = 16  # spacings of doubles between the times of events that count as one


class Look(NamedTuple):
    """The guards and their rates at a time."""

    t: Any
    values: Any
    rates: Any


def near(before: Look, after: Look, k: int) -> Any:
    """Tell whether guard ``k`` may come to zero between two looks: the tangents at the two cross zero, or it turns.

    One that turns so gently that it would have to fall ``STEEPER`` times as fast between the looks as at them does not.
    """
    start, end, span = before.rates[k], after.rates[k], after.t - before.t
    above, fall, rise = before.values[k] + after.values[k], span * abs(start), span * abs(end)
    crosses, turns = (above < fall) | (above < rise), (start < 0) & (end > 0)
    return crosses | (turns & ((above < STEEPER * fall) | (above < STEEPER * rise)))


def first_lost(
    before: Look, after: Look, values: Callable, rates: Callable, root: Callable, parts: Iterable[Any] = PARTS,
    touch: Any = 0,
) -> tuple | None:
    """Return (time, guard) of the first guard lost between two looks, or None.

    ``values(t)`` and ``rates(t)`` are the guards on the polynomial of the step, ``root(function, low, high)`` is where
    a function changes its sign. A guard that starts at zero, or below it by the error of a step, is lost only where it
    falls again: it may grow from there by its rounding, and so may the polynomial of a step as short as that of the
    time. One that comes as near to zero as ``touch`` and turns counts as lost where it turns.
    """
    found: list[tuple[Any, int]] = []
    looks: list[Look] = []
    for k in suspects(before, after):
        times = (t for part in parts if before.t < (t := before.t + (after.t - before.t) * part) < after.t)
        looks = looks or [before, *(Look(t, values(t), rates(t)) for t in times), after]
        if (t := _falls(looks, k, values, rates, root, _crosses(before, after, k), touch)) is not None:
            found.append((t, k))
    return min(found, default=None)


def lost_with(mode: NumericMode, hit: int | None, t: Any, state: tuple, near: Any = None) -> tuple[int, ...]:
    """Return the guards that fall through zero within the time ``near`` of the event at which guard ``hit`` is lost.

    It is by default as much as tells times in doubles apart.
    """
    if hit is None:
        return ()
    near, rates = TOGETHER * ulp(t) if near is None else near, mode.guard_rates(t, state)
    return tuple(k for k, value in enumerate(mode.guard_values(t, state)) if k != hit and abs(value) < -near * rates[k])


def suspects(before: Look, after: Look) -> list[int]:
    """Return the guards that may be lost between two looks."""
    return [k for k in range(len(after.values))
            if _crosses(before, after, k) or (before.values[k] > 0 and near(before, after, k))]  # fmt: skip


def _crosses(before: Look, after: Look, k: int) -> bool:
    start, end = before.values[k], after.values[k]
    if start < 0:
        return end <= 0 and before.rates[k] > 0 > after.rates[k]
    return end <= 0 and start != end and (start > 0 or after.rates[k] < 0)


def _falls(
    looks: list[Look], k: int, values: Callable, rates: Callable, root: Callable, crosses: bool, touch: Any
) -> Any:
    """Return the first time at which guard ``k`` falls through zero, piece by piece of a step, or None."""
    for a, b in pairwise(looks):
        low = root(lambda t: rates(t)[k], a.t, b.t) if a.values[k] <= 0 and a.rates[k] > 0 > b.rates[k] else a.t
        if (b.values[k] < 0 and (a.values[k] > 0 or b.rates[k] < 0)) or (crosses and b is looks[-1]):
            return root(lambda t: values(t)[k], low, b.t)
        if a.values[k] > 0 and a.rates[k] < 0 < b.rates[k]:
            least = root(lambda t: rates(t)[k], a.t, b.t)
            value = values(least)[k]
            if abs(value) < touch < a.values[k]:
                return least
            if value < 0:
                return root(lambda t: values(t)[k], a.t, least)
    return None
