"""A flow written out in a step is the flow called, to the last bit; what depends on no state is computed once."""

import math

import numpy as np
import pytest
import sympy as sp

from asympk.asymptotics import nonstiff
from asympk.asymptotics.inlined import inlined
from asympk.symbolic.lowering import lower

x, y, a = sp.symbols("x y a", real=True)
STATE, PARAMETERS = (0.3, -0.7), (2.5,)
FLOWS = {
    "polynomials": (a**2 * y - x**3, -sp.Rational(1, 3) * x + (1 + a) * y),
    "functions": (sp.sin(a) * y + sp.exp(-x), sp.sqrt(1 + a**2) * sp.tanh(x * y) - abs(x - y)),
    "cases": (sp.Max(x, y, a / 3), sp.Piecewise((a * x, x > y), (y, True)) + sp.sign(x) * abs(y) ** sp.Rational(3, 2)),
    "constants": (sp.Integer(1), a),
}


@pytest.mark.parametrize("name", FLOWS)
def test_a_step_written_out_is_the_step_that_calls_its_flow_to_the_last_bit(name):
    flow = lower((x, y, a), FLOWS[name], "math", branching=True).compiled
    first = flow(*STATE, *PARAMETERS)
    step = 0.125, STATE, first, 1e-8, (1e-8, 1e-8), 1e-3
    written, called = (nonstiff._compiled((flow,), 2, (0, 1), True, longest=longest) for longest in (10**6, 0))
    assert written is not called
    assert written(((), PARAMETERS), *step) == called(((), PARAMETERS), *step)


def test_what_depends_on_no_state_is_computed_once_a_step():
    flow = lower((x, y, a), (sp.sin(a) * x + sp.cos(a) * y, y * sp.exp(a)), "math", branching=True).compiled
    text = inlined(flow, "f_", [], ["x", "y"], ["a"])
    assert all(any(word in line for line in text.once) for word in ("sin", "cos", "exp"))
    assert not any(word in line for line in (*text.lines, text.rates) for word in ("sin", "cos", "exp"))


def test_a_flow_without_a_text_or_with_a_long_one_is_called():
    def flow(u, b):
        return (-b * u,)

    assert inlined(flow, "f_", [], ["u"], ["b"]).rates == "f_(u, b)"
    short = lower((x, a), (-a * x,), "math", branching=True).compiled
    assert inlined(short, "f_", [], ["x"], ["a"], longest=3).rates == "f_(x, a)"
    assert "f_(" not in inlined(short, "f_", [], ["x"], ["a"]).rates


def test_a_flow_that_leaves_the_floats_when_written_out_is_called_which_may_go_on():
    def one(u):
        try:
            return (u**200 / u**200,)
        except OverflowError:
            return (1.0,)

    one.text = "def one(u):\n    return (u**200 / u**200,)"
    (end,), *_ = nonstiff._step_of((one,), (), 1)(0.5, (1e10,), (1.0,), 1e-8, (1e-8,), 0.0)
    assert end == 1e10 + 0.5


def test_steps_up_to_where_the_states_leave_the_floats_have_finite_ends():
    flow = lower((x, y), (x**40, -y), "math", branching=True).compiled
    blow_up = 30.0**-39 / 39
    ends = [step.end for step in nonstiff.steps((flow,), (), (30.0, 1.0), 2 * blow_up, 1e-8, (1e-8, 1e-8))]
    assert len(ends) > 1
    assert all(math.isfinite(value) for end in ends for value in end)


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
