r"""How far rounding carries a run in doubles: a first-order account, carried backward from the end.

A segment is wrong by the rounding of its terms, and its clock in proportion. The derivative of the final state with
respect to a state before is the product of the segments' exponentials and, at each event, of

    1 + (w'_after - w'_before) c / (c.w'_before),

c the gradient of the guard; so every error is weighed by what becomes of it.
"""

import numpy as np

from asympk.affine.functions import functions, tremors
from asympk.flow.arithmetic import Doubles

UNIT = 2.0**-53


def estimate(legs, states):
    """Estimate the error of the first ``states`` of the final state, relative to the largest of all on the path."""
    rows = np.eye(states, legs[-1].segment.start.size)
    error, size, after = np.zeros(states), 0.0, None
    for leg in reversed(legs):
        segment, flow = leg.segment, leg.segment.flow
        values, gained = (np.array(found) for found in functions(Doubles, flow.blocks, leg.span))
        end = segment.start + gained @ segment.terms
        size = max(size, abs(segment.start[:states]).max(), abs(end[:states]).max())
        if after is not None:
            rates = values @ (flow.rate @ segment.terms)
            guard = flow.rows[leg.guard, :-1]
            error += abs(rows @ after.rates(0.0)) * UNIT * (leg.start + leg.span)
            rows = _through(rows, guard, rates, after)
        off, _ = tremors(Doubles, flow.blocks, leg.span)
        error += abs(rows) @ (UNIT * (abs(end) + np.array(off) @ (flow.matrix_sizes @ abs(segment.whole))))
        rows = rows @ np.tensordot(values, flow.matrices[:, :, :-1], 1)
        after = segment
    error += abs(rows) @ (UNIT * abs(after.start))
    return float(error.max() / size) if size else float(error.max())


def _through(rows, guard, rates, after):
    """Return the derivatives by the state before an event from those by the state after it."""
    return rows + np.outer(rows @ (after.rates(0.0) - rates), guard / (guard @ rates))
