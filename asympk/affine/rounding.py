r"""How far rounding carries a run in doubles: a first-order account, carried backward from the end.

A segment is wrong by the rounding of its terms, and its clock in proportion. The derivative of the final state with
respect to a state before is the product of the segments' exponentials and, at each event, of

    1 + (w'_after - w'_before) c / (c.w'_before),

c the gradient of the guard (Lemma 8); so every error is weighed by what becomes of it. The forcing, which is no state,
begins anew with each segment, from its time.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from asympk.affine.functions import functions, initial, tremors
from asympk.arithmetic import UNIT, Doubles

if TYPE_CHECKING:
    from asympk.affine.run import TimedSegment


def estimate(segments: "Sequence[TimedSegment]", states: int) -> float:
    """Estimate the error of the first ``states`` of the final state, each relative to its largest value on the path."""
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
    return float((error / np.where(size > 0, size, 1.0)).max())
