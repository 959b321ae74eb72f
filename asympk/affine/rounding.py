"""The rounding error of a run in doubles, estimated to first order and backward from the end.

Each segment has the rounding error of its terms, and its duration one in proportion to itself. The derivative of the
final state by an earlier state is the product of the exponentials of the segments and, at each event, of the matrix

    1 + (w'_after - w'_before) c / (c.w'_before),

where c is the gradient of the guard (Lemma 8); ``estimate`` multiplies every error by this derivative. Errors of the
forcing do not accumulate, as it is computed from the time at the start of each segment, nor do those of the times
(``TimedSegment.late``). Of independent errors the squares add up. Segments of one mode that end at one guard, and
rounded exponents that modes share, may have equal errors, which add up with their signs: the largest sum counts.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from asympk.affine.functions import functions, initial, rounding_sizes
from asympk.arithmetic import UNIT, Doubles

if TYPE_CHECKING:
    from asympk.affine.run import TimedSegment

_SAFE = 3  # the estimate in units of the root of the sum of squares: of some hundred runs none was above 0.7 of it


def estimate(segments: "Sequence[TimedSegment]", states: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the estimated errors of the first ``states`` final states, and the largest modulus of each of them."""
    rows = np.eye(states, segments[-1].segment.start.size)
    size, after = np.zeros(states), None
    sums: tuple[dict[Any, np.ndarray], ...] = ({}, {}, {})
    for timed in reversed(segments):
        segment, flow = timed.segment, timed.segment.flow
        found, gained, begun = functions(Doubles, flow.blocks, timed.span)
        n, values, timing = segment.functions, np.array(found), np.zeros((states, 1))
        end = np.array(gained) @ segment.sums[:n] + segment.sums[n + begun]
        size = np.maximum(size, np.maximum(abs(segment.start), abs(end))[:states])
        if after is not None:
            rates = values @ flow.rate @ segment.sums[:n]
            guard = flow.rows[timed.guard, :-1]
            timing[:, 0] = rows[:, :states] @ after[:states] * timed.span
            turned = np.multiply.outer(after[:states] - rates[:states], guard / (guard @ rates))
            rows = rows[:, :states] @ (np.eye(states, len(end)) + turned)
        errors = np.hstack([rows * _rounding(timed, gained, begun, end), timing])
        for alike, key in zip(sums, (id(timed), (id(flow), timed.guard), (flow.blocks, errors.shape)), strict=True):
            alike[key] = alike.get(key, 0) + errors
        rows = rows @ (values @ flow.flat).reshape(len(end), -1)
        after = np.array(initial(flow.blocks)) @ flow.rate @ segment.sums[:n]
    found = np.max([_root([*alike.values(), rows * segment.start]) for alike in sums], axis=0)
    return _SAFE * UNIT * found, size


def _rounding(timed, gained, begun, end):
    """Return the errors (n,) of the state at the end of a segment, in units of ``UNIT``.

    The weight of a function has the error of its own sum, and the function one in proportion to its exponent.
    """
    segment, n = timed.segment, timed.segment.functions
    off, _ = rounding_sizes(Doubles, segment.flow.blocks, timed.span)
    parts = segment.term_sizes.sums[:n].T * gained, segment.sums[:n].T * off
    return _root([*parts, segment.term_sizes.sums[n + begun, :, None], end[:, None]])


def _root(parts):
    """Return the roots of the sums of the squares in the rows of arrays; the squares may leave the range of doubles."""
    return np.hypot.reduce(np.hstack(parts), axis=1)
