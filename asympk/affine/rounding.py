r"""The rounding error of a run in doubles, estimated to first order and backward from the end.

Each segment has the rounding error of its terms, and the time of each event has one in proportion to the time. The
derivative of the final state by an earlier state is the product of the exponentials of the segments and, at each event,
of the matrix

    1 + (w'_after - w'_before) c / (c.w'_before),

where c is the gradient of the guard (Lemma 8). ``estimate`` multiplies every error by this derivative. Errors of the
forcing do not accumulate, because the forcing is computed from the time at the start of each segment.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from asympk.affine.functions import functions, initial, tremors
from asympk.arithmetic import UNIT, Doubles

if TYPE_CHECKING:
    from asympk.affine.run import TimedSegment


def estimate(segments: "Sequence[TimedSegment]", states: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the estimated errors of the first ``states`` final states, and the largest modulus of each of them."""
    rows = np.eye(states, segments[-1].segment.start.size)
    error, size, after = np.zeros(states), np.zeros(states), None
    for timed in reversed(segments):
        segment, flow, span = timed.segment, timed.segment.flow, timed.span
        found, gained, begun = functions(Doubles, flow.blocks, span)
        off, _ = tremors(Doubles, flow.blocks, span)
        n, values = segment.functions, np.array(found)
        end = np.array(gained) @ segment.sums[:n] + segment.sums[n + begun]
        lost = np.array(off) @ segment.off.sums[:n] + segment.off.sums[n + begun] + abs(end)
        size = np.maximum(size, np.maximum(abs(segment.start), abs(end))[:states])
        if after is not None:
            rates = values @ flow.rate @ segment.sums[:n]
            guard = flow.rows[timed.guard, :-1]
            error += abs(rows @ after) * (UNIT * (timed.start + span))
            turned = np.multiply.outer(after[:states] - rates[:states], guard / (guard @ rates))
            rows = rows[:, :states] @ (np.eye(states, len(end)) + turned)
        error += abs(rows) @ (UNIT * lost)
        rows = rows @ (values @ flow.flat).reshape(len(end), -1)
        after = np.array(initial(flow.blocks)) @ flow.rate @ segment.sums[:n]
    error += abs(rows) @ (UNIT * abs(segment.start))
    return error, size
