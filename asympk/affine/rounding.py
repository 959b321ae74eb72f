r"""How far rounding carries a run in doubles: a first-order account, carried backward from the end.

A segment is wrong by the rounding of its terms, and its clock in proportion. The derivative of the final state with
respect to a state before is the product of the segments' exponentials and, at each event, of

    1 + (w'_after - w'_before) c / (c.w'_before),

c the gradient of the guard; so every error is weighed by what becomes of it.
"""

import numpy as np

from asympk.affine.functions import bases, functions, tremors
from asympk.flow.arithmetic import Doubles

UNIT = 2.0**-53


def estimate(legs, states):
    """Estimate the error of the first ``states`` of the final state, each relative to its largest value on the path."""
    rows = np.eye(states, legs[-1].segment.start.size)
    error, size, after = np.zeros(states), np.zeros(states), None
    for leg in reversed(legs):
        segment, flow = leg.segment, leg.segment.flow
        values, gained, begun = functions(Doubles, flow.blocks, leg.span)
        values, end = np.array(values), segment.bases[begun] + np.array(gained) @ segment.terms
        size = np.maximum(size, np.maximum(abs(segment.start), abs(end))[:states])
        if after is not None:
            rates = values @ (flow.rate @ segment.terms)
            guard = flow.rows[leg.guard, :-1]
            error += abs(rows @ after.rates(0.0)) * UNIT * (leg.start + leg.span)
            rows = _through(rows, guard, rates, after)
        off, _ = tremors(Doubles, flow.blocks, leg.span)
        mass = flow.matrix_sizes @ abs(segment.whole)
        lost = bases(flow.blocks, mass, abs(segment.start))[begun] + np.array(off) @ mass
        error += abs(rows) @ (UNIT * (abs(end) + lost))
        rows = rows @ np.tensordot(values, flow.matrices[:, :, :-1], 1)
        after = segment
    error += abs(rows) @ (UNIT * abs(after.start))
    return float((error / np.where(size > 0, size, 1.0)).max())


def _through(rows, guard, rates, after):
    """Return the derivatives by the state before an event from those by the state after it."""
    return rows + np.outer(rows @ (after.rates(0.0) - rates), guard / (guard @ rates))
