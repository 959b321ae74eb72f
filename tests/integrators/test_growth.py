"""What is known of the errors of a run from its steps."""

from types import SimpleNamespace

from asympk.automaton.loop import Segment
from asympk.integrators.growth import without_rounding


def test_a_state_that_moves_from_zero_at_once_is_found_from_the_first_step():
    asked = []
    mode = SimpleNamespace(rhs=lambda t, state: asked.append(t) or (1.0,))
    automaton = SimpleNamespace(mode=lambda branch, sides: mode)
    segments = [Segment(1.0, (1.0,), None, steps=tuple((k / 100, (k / 100,)) for k in range(101)))]
    assert without_rounding(automaton, segments) is segments
    assert asked == [0]
