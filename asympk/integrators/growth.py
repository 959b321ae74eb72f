r"""How much an error that is made on the way has grown at the end of a run.

The error of one step is handed on by w' = J w along the motion, and through an event by the saltation matrix
(Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7),

    I + (f_after - f_before) (dg/dw)' / g',

with g the guard that is lost. A motion that keeps to a repelling set, as one that is late to leave a branch that has
lost its stability, hides such errors from every comparison of tolerances: they grow from below what is carried.
"""

from collections.abc import Sequence
from itertools import accumulate, zip_longest
from typing import TYPE_CHECKING, Any

from asympk.automaton.automaton import Automaton
from asympk.automaton.loop import Segment
from asympk.automaton.numericmode import NumericMode
from asympk.errors import Undecided

if TYPE_CHECKING:
    import numpy as np

LOST = 1e-3  # relative error of the end from which a run is refused
CARRIED = 1e180  # growth that digits can make up for


def require_kept(automaton: Automaton, segments: Sequence[Segment], tolerance: float, scales: Sequence[float]) -> None:
    """Raise ``Undecided`` where errors of ``tolerance`` may have grown as large as the end; see ``growth``."""
    factor = growth(automaton, segments, scales)
    if factor * tolerance > LOST:
        raise grown(factor, segments[-1].t)


def grown(factor: float, t: Any) -> Undecided:
    """Return the error for a run whose errors have grown by ``factor`` at its end."""
    advice = "ask for digits=20" if factor < CARRIED else "end the run before"
    return Undecided(f"errors of the run grow {factor:.0e}-fold to its end at t = {float(t):.6g}: the motion keeps to "
                     f"a repelling set, or is chaotic; {advice}")  # fmt: skip


def growth(automaton: Automaton, segments: Sequence[Segment], scales: Sequence[float]) -> float:
    """Return how many times larger an error made on the way is at the end, relative to the largest state there.

    An error is relative to its state, or to what ``scales`` has for the state, if that is larger. A state that is 0 and
    stays so makes none. ``inf`` where the growth is beyond the range of doubles.
    """
    import numpy as np

    factors = list[tuple[Any, Any]]()
    with np.errstate(all="ignore"):
        try:
            for segment, after in zip_longest(segments, segments[1:]):
                factors += _passed(automaton, segment, after, np.array(scales))
        except (ArithmeticError, ValueError, TypeError):  # a rate without a derivative, as a root has where it vanishes
            return 0.0
        if not factors:  # a run that ends at its start
            return 0.0
        transitions, sizes = map(np.array, zip(*reversed(factors), strict=True))
        onward = np.array([*accumulate(transitions, np.matmul)])
        worst = np.nan_to_num(np.einsum("kij,kj->ki", abs(onward), sizes), nan=np.inf).max(initial=0.0)
    return float(worst) / max(*scales, *(abs(float(v)) for v in segments[-1].state))


def _passed(
    automaton: Automaton, segment: Segment, after: Segment | None, scales: "np.ndarray"
) -> "list[tuple[np.ndarray, np.ndarray]]":
    """Return, step by step, what becomes of an error and how large one is; after them the event that ends them."""
    import numpy as np

    mode = automaton.mode(segment.branch, sides=segment.sides)
    times, states = (np.array(part, dtype=float) for part in zip(*segment.steps, strict=True))
    at = list(zip(times.tolist(), map(tuple, states.tolist()), strict=True))
    halfway = ((times[1:] + times[:-1]) / 2).tolist(), ((states[1:] + states[:-1]) / 2).tolist()
    slopes = np.array([mode.jac(t, tuple(w)) for t, w in zip(*halfway, strict=True)])  # ends may be zeros of a root
    ones = np.ones(len(scales), dtype=bool)
    moving = [np.array(mode.rhs(*here), dtype=float) != 0 if 0 in here[1] else ones for here in at]
    sizes = np.maximum(scales, np.abs(states)) * ((states != 0) | moving) * mode.movable
    means = slopes.reshape(-1, len(scales), len(scales)).astype(float) * np.diff(times)[:, None, None]
    found = list(zip(_exponentials(means * np.array(mode.movable)), sizes[:-1], strict=True))
    if after is not None and segment.hit is not None and (after.branch, after.sides) != (segment.branch, segment.sides):
        later = automaton.mode(after.branch, sides=after.sides)
        found.append((_saltation(mode, later, segment.hit, *at[-1]), 0 * sizes[-1]))
    return found


def _saltation(mode: NumericMode, after: NumericMode, hit: int, t: float, state: tuple) -> "np.ndarray":
    import numpy as np

    gradient, rate = mode.guard_gradient(hit, t, state), mode.guard_rates(t, state)[hit]
    change = np.subtract(after.rhs(t, state), mode.rhs(t, state))
    return np.eye(len(state)) + (np.outer(change, gradient) / rate if change.any() else 0)  # a guard may only touch 0


def _exponentials(matrices: "np.ndarray") -> "np.ndarray":
    """Return the exponentials of many matrices, each by its Taylor series at a part of it and by squaring."""
    import numpy as np

    size = np.abs(matrices).sum(axis=2).max(initial=0.5)
    halvings = max(0, int(np.ceil(np.log2(size))) + 1) if np.isfinite(size) else 0
    part = matrices / 2.0**halvings
    term = total = np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape)
    for k in range(1, 13):
        term = term @ part / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total
