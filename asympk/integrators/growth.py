r"""The growth of errors along a run: how much larger the errors made at its steps are at its end.

Along the motion an error w obeys w' = J w. An event multiplies it by the saltation matrix (Leine and Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7),

    I + (f_after - f_before) (dg/dw)' / g',

with g the guard that is lost. A motion may stay near a repelling set, as in a delayed loss of stability. A comparison
of tolerances does not show the errors of such a motion, because they grow from below the rounding of the numbers.
``growth`` computes the factor; ``balances``, the hard function, estimates the rounding error of each state.
"""

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np

from asympk.automaton.automaton import ROUNDED, Automaton
from asympk.automaton.exponentials import exponentials, running_products
from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.errors import Undecided

LOST = 1e-3  # relative error at the end from which a run is refused
LOOKS = 32  # times at which errors are looked at, the end among them
CARRIED = 1e180  # growth of errors that more digits can compensate


def grown(factor: float, t: Any) -> Undecided:
    """Return the error for a run whose errors have grown by ``factor`` at its end."""
    times, advice = (f"{factor:.0e}-fold", "ask for 20 digits") if factor < CARRIED else (
        "beyond all bounds", "end the run before")
    return Undecided(f"errors of the run grow {times} to its end at t = {float(t):.6g}: the motion keeps to "
                     f"a repelling set, or is chaotic; {advice}")


class Linearised(NamedTuple):
    """A segment with its mode, the ``times`` and ``states`` of its steps, and the Jacobians in the middle of these.

    At the ends of steps a root may vanish. ``slopes`` are NaN where a rate has no derivative.
    """

    segment: Segment
    mode: NumericMode
    times: np.ndarray
    states: np.ndarray
    slopes: np.ndarray


def linearised(automaton: Automaton, segments: Sequence[Segment]) -> list[Linearised]:
    """Return segments with the Jacobians along them."""
    return [_linearised(automaton.mode(segment.branch, sides=segment.sides), segment) for segment in segments]


def _linearised(mode: NumericMode, segment: Segment) -> Linearised:
    at_end = ((segment.t, segment.state),)  # a segment that begins at the end of a run has no steps
    times, states = (np.array(found, dtype=float) for found in zip(*segment.steps or at_end, strict=True))
    slopes = mode.on_arrays(lambda mode: mode.jacobian, _middles(times), (*_middles(states).T, *mode.p))
    return Linearised(segment, mode, times, states, slopes.T.reshape(-1, *states.shape[1:] * 2))


def _middles(ends: np.ndarray) -> np.ndarray:
    return (ends[1:] + ends[:-1]) / 2


def largest_part(errors: np.ndarray | None, sizes: float | Sequence[float]) -> float:
    """Return the largest of the errors as parts of the sizes, 0 if they are not known."""
    with np.errstate(over="ignore"):
        return 0.0 if errors is None else float((errors / np.array(sizes)).max())


def growth(parts: Sequence[Linearised], scales: Sequence[float], tolerance: float) -> np.ndarray | None:
    """Return, for each state, its error at the end of a run over ``tolerance``: the sum of the errors from all steps.

    At its step an error is relative to the state, or to the state's entry of ``scales`` if this is larger. A state that
    is 0 and stays 0 has no error. Errors as large as the states at a time before, one of ``LOOKS``, need not fade as
    linear ones do: an error at that time counts ``LOST`` times. A state of which errors of the relative ``tolerance``
    have become a noticeable part goes on from these errors alone: they count at the time at which they are largest. A
    velocity that an event has set to 0 is none of these, as small as it is from there on. The growth is ``inf`` beyond
    the range of doubles, and None where rates have no derivative.
    """
    end = parts[-1].segment.t
    if any(np.isnan(part.slopes).any() for part in parts):
        return None
    with np.errstate(all="ignore"):
        try:
            passed = [_passed(part, after, np.array(scales)) for part, after in zip_longest(parts, parts[1:])]
        except (ArithmeticError, ValueError, TypeError):  # a rate without a derivative, as a root has where it vanishes
            return None
        transitions, errors, states, times = map(np.concatenate, zip(*passed, strict=True))
        looks = np.unique(np.searchsorted(times, np.arange(1, LOOKS) * end / LOOKS, side="right"))
        onward, most = transitions[:0], [np.zeros(len(scales))]
        for stretch in filter(len, np.split(transitions, looks)):
            within = running_products(stretch[::-1])[::-1]
            onward = np.concatenate([within[0] @ onward, within])
            most.append(np.einsum("kij,kj->i", abs(onward), errors[: len(onward)]))
        right = abs(states) * LOST > tolerance * errors
        left = np.where((_last(right) > _last(states == 0)) & ~right, errors, 0)
        found = np.nan_to_num([*most, _largest(transitions, left)], nan=np.inf, posinf=np.inf)
        return np.max([found[-2], LOST * found[:-1].max(axis=0), found[-1]], axis=0)


def _last(marks: np.ndarray) -> np.ndarray:
    """Return for every entry the row of the last mark in its column up to there, or -1."""
    return np.maximum.accumulate(np.where(marks, np.arange(len(marks))[:, None], -1))


def _largest(transitions: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Return the largest error of each state at any time from ``errors`` that add in squares."""
    first = int(errors.any(axis=1).argmax()) if errors.any() else len(errors)
    steps, added = transitions[first:], errors[first:, :, None] ** 2 * np.eye(errors.shape[1])
    squares = [np.zeros(transitions.shape[1:])]
    for step, turned, new in zip(steps, steps.swapaxes(1, 2), added, strict=True):
        squares.append(step @ (squares[-1] + new) @ turned)
    return np.sqrt(np.abs(np.einsum("kii->ki", squares)).max(axis=0))


def without_rounding(automaton: Automaton, segments: Sequence[Segment]) -> Sequence[Segment]:
    """Return segments in which the states that start at 0, and that no rate moves from there, are 0 at all steps.

    Linear solvers leave rounding in such a state: it is no size of the state, and falls with every tolerance.
    """
    still = np.array(segments[0].steps[0][1] if segments[0].steps else segments[0].state) == 0
    while still.any():
        rates = (automaton.mode(s.branch, sides=s.sides).rhs(t, _with_zeros(still, w))
                 for s in segments for t, w in s.steps)
        try:  # the first steps move most states, which need not be 0 at later ones
            moved = next((moves for rate in rates if (moves := still & np.array(rate, dtype=bool)).any()), None)
        except (ArithmeticError, ValueError, TypeError):  # as in ``growth``
            break
        if moved is None:
            return [s._replace(steps=tuple((t, _with_zeros(still, w)) for t, w in s.steps)) for s in segments]
        still &= ~moved
    return segments


def _with_zeros(still: np.ndarray, state: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(0.0 if zero else value for zero, value in zip(still.tolist(), state, strict=True))


def balances(parts: Sequence[Linearised]) -> tuple[np.ndarray, np.ndarray]:
    """Return (sizes, gains): each state's size by the terms of its rate, and its gain by an error of another state.

    The size holds in any units, and the rounding of the state is relative to it, also where the terms of the rate
    cancel. It is ``NumericMode.moves`` plus ``NumericMode.terms`` times the time 1 / |J_ii| in which the state forgets
    an error, at most that of the run. The gains are |J_ij| times the time until the state forgets the error or swings
    back.
    """
    until, n = float(parts[-1].segment.t), len(parts[-1].segment.state)
    found, gains = np.zeros(n), np.zeros((n, n))
    with np.errstate(all="ignore"):
        for _, mode, times, states, slopes in parts:
            own, swings = (np.abs(np.einsum("kii->ki", part)) for part in (slopes, slopes @ slopes))
            spans = np.minimum(until, 1 / own)
            t, w = _middles(times), _middles(states).T
            made = mode.terms(t, w, ROUNDED).T * spans + mode.moves(t, w).T
            found = np.maximum(found, np.where(np.isfinite(made), made, 0).max(axis=0, initial=0.0))
            gained = np.abs(slopes) * np.minimum(spans, 1 / np.sqrt(swings))[:, :, None]
            gains = np.maximum(gains, np.where(np.isfinite(gained), gained, 0).max(axis=0, initial=0.0))
    return found, gains


def _passed(part: Linearised, after: Linearised | None, scales: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return (transition matrices, sizes of errors, states, times) of the steps of a segment and of its event.

    Errors and states are those at their starts, times those at their ends.
    """
    segment, mode, times, states, slopes = part
    moving, still = np.ones(states.shape, dtype=bool), (states == 0).any(axis=1)
    moving[still] = mode.on_arrays(lambda mode: mode.field, times[still], (*states[still].T, *mode.p)).T != 0
    sizes = np.maximum(scales, np.abs(states)) * ((states != 0) | moving) * mode.movable
    found = exponentials(slopes * np.diff(times)[:, None, None] * np.array(mode.movable))
    if after is None or segment.hit is None or after.mode is mode:
        return found, sizes[:-1], states[:-1], times[1:]
    jump = _saltation(mode, after.mode, segment.hit, *after.segment.steps[0])
    sizes[-1] = 0
    return np.concatenate([found, np.array([jump], dtype=float)]), sizes, states, np.append(times[1:], times[-1])


def _saltation(mode: NumericMode, after: NumericMode, hit: int, t: float, state: tuple) -> np.ndarray:
    gradient, rate = mode.guard_gradient(hit, t, state), mode.guard_rates(t, state)[hit]
    change = np.subtract(after.rhs(t, state), mode.rhs(t, state))
    return np.eye(len(state)) + (np.outer(change, gradient) / rate if change.any() else 0)  # a guard may only touch 0
