"""Explicit steps: their ends are finite, errors of a state are seen beside others, and short steps stay explicit."""

import math

import numpy as np
import pytest
import sympy as sp

from asympk.asymptotics import nonstiff
from asympk.symbolic.lowering import lower

x, y = sp.symbols("x y", real=True)


def test_steps_up_to_where_the_states_leave_the_floats_have_finite_ends():
    flow = lower((x, y), (x**40, -y), "math", branching=True).compiled
    blow_up = 30.0**-39 / 39
    ends = [step.end for step in nonstiff.steps((flow,), (), (30.0, 1.0), 2 * blow_up, 1e-8, (1e-8, 1e-8))]
    assert len(ends) > 1
    assert all(math.isfinite(value) for end in ends for value in end)


def test_rates_that_are_no_numbers_give_no_steps():
    assert not [*nonstiff.steps((lambda u, v: (math.nan, -v),), (), (2.0, 1.0), math.inf, 1e-8, (1e-8, 1e-8))]


@pytest.mark.parametrize("degree", [4, 5])
def test_powers_of_the_time_do_not_hide_the_error_of_a_state_that_has_decayed(degree):
    def flow(u, *powers):
        return (-u, 1.0, *powers[:-1])

    along = nonstiff.steps((flow,), (), (1.0, *[0.0] * degree), 60.0, 1e-13, (1e-13,) * (degree + 1))
    assert max(abs(step.end[0] - step.state[0] * math.exp(-step.span)) for step in along) < 2e-13


def test_steps_that_are_kept_short_stay_explicit():
    """The exact motion to t = 2 is cos t; implicit steps of the same length, ten times as dear, came after 100."""
    taken = [*nonstiff.steps((lambda x, v: (v, -x),), (), (1.0, 0.0), 2.0, 1e-12, (1e-12,) * 2, within=0.01,
                             slopes=lambda state: np.array([[0.0, 1.0], [-1.0, 0.0]]))]
    assert {type(step) for step in taken} == {nonstiff.ExplicitStep}
    assert taken[-1].end[0] == pytest.approx(math.cos(2.0), abs=1e-12)
