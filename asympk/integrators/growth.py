r"""The growth of errors along a run: how much larger the errors made at its steps are at its end.

Along the motion an error w obeys w' = J w. An event multiplies it by the saltation matrix (Leine and Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7),

    I + (f_after - f_before) (dg/dw)' / g',

with g the guard that is lost. A motion may stay near a repelling set, as in a delayed loss of stability. A comparison
of tolerances does not show the errors of such a motion, because they grow from below the rounding of the numbers.
``growth`` computes the factor; ``balances``, the hard function, estimates the rounding error of each state.
"""

from collections.abc import Sequence
from itertools import accumulate, zip_longest
from typing import Any

import numpy as np

from asympk.automaton.automaton import ROUNDED, Automaton
from asympk.automaton.contacts import nudges
from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.errors import Undecided

LOST = 1e-3  # relative error at the end from which a run is refused
LOOKS = 32  # times at which errors are looked at, the end among them
CARRIED = 1e180  # growth of errors that more digits can compensate


def grown(factor: float, t: Any) -> Undecided:
    """Return the error for a run whose errors have grown by ``factor`` at its end."""
    advice = "ask for 20 digits" if factor < CARRIED else "end the run before"
    return Undecided(f"errors of the run grow {factor:.0e}-fold to its end at t = {float(t):.6g}: the motion keeps to "
                     f"a repelling set, or is chaotic; {advice}")  # fmt: skip


def growth(
    automaton: Automaton, segments: Sequence[Segment], scales: Sequence[float], sizes: Sequence[float]
) -> float:
    """Return the growth of errors to the end of a run: the largest sum of the errors of one state from all steps.

    At its step an error is relative to the state, or to the state's entry of ``scales`` if this is larger; at the end
    it is relative to the ``sizes`` of the states. A state that is 0 and stays 0 has no error. Errors as large as the
    states at a time before, one of ``LOOKS``, need not fade as linear ones do: a growth to that time counts ``LOST``
    times. The growth is ``inf`` beyond the range of doubles, and 0 where rates have no derivative.
    """
    factors, end = list[tuple[Any, Any, Any]](), segments[-1].t
    with np.errstate(all="ignore"):
        try:
            for segment, after in zip_longest(segments, segments[1:]):
                factors += _passed(automaton, segment, after, np.array(scales))
        except (ArithmeticError, ValueError, TypeError):  # a rate without a derivative, as a root has where it vanishes
            return 0.0
        if not factors:  # a run that ends at its start
            return 0.0
        transitions, errors, times = map(np.array, zip(*factors, strict=True))
        looks = np.unique(np.searchsorted(times, np.arange(1, LOOKS) * end / LOOKS, side="right"))
        onward, most = transitions[:0], [0.0]
        for part in filter(len, np.split(transitions, looks)):
            within = np.array([*accumulate(part[::-1], np.matmul)])[::-1]
            onward = np.concatenate([within[0] @ onward, within])
            grown = np.einsum("kij,kj->i", abs(onward), errors[: len(onward)]) / sizes
            most.append(float(np.nan_to_num(grown, nan=np.inf).max(initial=0.0)))
        return max(most[-1], LOST * max(most))


def without_rounding(automaton: Automaton, segments: Sequence[Segment]) -> Sequence[Segment]:
    """Return segments in which the states that start at 0, and that no rate moves from there, are 0 at all steps.

    Linear solvers leave rounding in such a state: it is no size of the state, and falls with every tolerance.
    """
    still = np.array(segments[0].steps[0][1] if segments[0].steps else segments[0].state) == 0
    while still.any():
        try:
            cleaned = [s._replace(steps=tuple((t, tuple(np.where(still, 0.0, w).tolist())) for t, w in s.steps))
                       for s in segments]  # fmt: skip
            rates = [automaton.mode(s.branch, sides=s.sides).rhs(*step) for s in cleaned for step in s.steps]
        except (ArithmeticError, ValueError, TypeError):  # as in ``growth``
            break
        moved = still & np.any(rates, axis=0)
        if not moved.any():
            return cleaned
        still &= ~moved
    return segments


def balances(automaton: Automaton, segments: Sequence[Segment]) -> tuple[np.ndarray, np.ndarray]:
    """Return (sizes, gains): each state's size by the terms of its rate, and its gain by an error of another state.

    The size holds in any units, and the rounding of the state is relative to it, also where the terms of the rate
    cancel. It is the change of the rate by relative changes of time, states and parameters, divided by these, times the
    time 1 / |J_ii| in which the state forgets an error, at most that of the run. The gains are |J_ij| times the time
    until the state forgets the error or swings back.
    """
    found, gains = np.zeros(len(segments[-1].state)), np.zeros((len(segments[-1].state),) * 2)
    with np.errstate(all="ignore"):
        for segment in segments:
            try:
                mode, (times, states) = automaton.mode(segment.branch, sides=segment.sides), _halfway(segment)
                slopes = _slopes(mode, times, states)
                own, swings = (np.abs(np.einsum("kii->ki", part)) for part in (slopes, slopes @ slopes))
                spans = np.minimum(float(segments[-1].t), 1 / own)
                at = [(t, (*w, *mode.p)) for t, w in zip(times.tolist(), states.tolist(), strict=True)]
                rates = [[mode.field(s, *w) for s, w in (here, *nudges(*here, ROUNDED))] for here in at]
                now, *nearby = np.array(rates).reshape(-1, 3, len(found)).swapaxes(0, 1)
                made = np.abs(np.subtract(nearby, now)).max(axis=0) / ROUNDED * spans
                made = np.abs(states).max(axis=1, keepdims=True) + made if mode.kept else made
            except (ArithmeticError, ValueError, TypeError):  # as in ``growth``
                continue
            found = np.maximum(found, np.where(np.isfinite(made), made, 0).max(axis=0, initial=0.0))
            gained = np.abs(slopes) * np.minimum(spans, 1 / np.sqrt(swings))[:, :, None]
            gains = np.maximum(gains, np.where(np.isfinite(gained), gained, 0).max(axis=0, initial=0.0))
    return found, gains


def _halfway(segment: Segment) -> tuple[np.ndarray, np.ndarray]:
    """Return the times and states in the middle of the steps of a segment: at the ends a root may vanish."""
    times, states = (np.array(part, dtype=float) for part in zip(*segment.steps, strict=True))
    return (times[1:] + times[:-1]) / 2, (states[1:] + states[:-1]) / 2


def _slopes(mode: NumericMode, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return the Jacobians at times and states."""
    n = states.shape[1]
    rows = [mode.jac(t, tuple(w)) for t, w in zip(times.tolist(), states.tolist(), strict=True)]
    return np.array(rows).reshape(-1, n, n).astype(float)


def _passed(
    automaton: Automaton, segment: Segment, after: Segment | None, scales: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Return (transition matrix, sizes of errors, time) to the end of each step of a segment, and of its event."""
    mode = automaton.mode(segment.branch, sides=segment.sides)
    times, states = (np.array(part, dtype=float) for part in zip(*segment.steps, strict=True))
    at = list(zip(times.tolist(), map(tuple, states.tolist()), strict=True))
    ones = np.ones(len(scales), dtype=bool)
    moving = [np.array(mode.rhs(*here), dtype=float) != 0 if 0 in here[1] else ones for here in at]
    sizes = np.maximum(scales, np.abs(states)) * ((states != 0) | moving) * mode.movable
    means = _slopes(mode, *_halfway(segment)) * np.diff(times)[:, None, None]
    found = list(zip(_exponentials(means * np.array(mode.movable)), sizes[:-1], times[1:], strict=True))
    if after is not None and segment.hit is not None and (after.branch, after.sides) != (segment.branch, segment.sides):
        later = automaton.mode(after.branch, sides=after.sides)
        found.append((_saltation(mode, later, segment.hit, *after.steps[0]), 0 * sizes[-1], times[-1]))
    return found


def _saltation(mode: NumericMode, after: NumericMode, hit: int, t: float, state: tuple) -> np.ndarray:
    gradient, rate = mode.guard_gradient(hit, t, state), mode.guard_rates(t, state)[hit]
    change = np.subtract(after.rhs(t, state), mode.rhs(t, state))
    return np.eye(len(state)) + (np.outer(change, gradient) / rate if change.any() else 0)  # a guard may only touch 0


def _exponentials(matrices: np.ndarray) -> np.ndarray:
    """Return the exponentials of many matrices by scaling and squaring of their Taylor series.

    The matrices are balanced together before: else large entries in one row, as in other units, hide the others.
    """
    from scipy.linalg import matrix_balance

    largest = np.abs(matrices).max(axis=0, initial=0.0)
    if np.isfinite(largest).all():
        _, (units, _) = matrix_balance(largest, permute=False, separate=True)
    else:
        units = np.ones(len(largest))
    matrices = matrices * units / units[:, None]
    size = np.abs(matrices).sum(axis=2).max(initial=0.5)
    halvings = max(0, int(np.ceil(np.log2(size))) + 1) if np.isfinite(size) else 0
    part = matrices / 2.0**halvings
    term = total = np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape)
    for k in range(1, 13):
        term = term @ part / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total * units[:, None] / units
