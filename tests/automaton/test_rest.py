"""Rest on contacts whose equations do not determine their forces."""

from fractions import Fraction

import mpmath
import pytest

from asympk.automaton.contacts import Numbers
from asympk.automaton.rest import with_exchanges


@pytest.mark.parametrize(("other", "solved"), [(0, {}), (Fraction(9, 10), {1: 0})])
def test_an_equation_is_not_solved_for_a_force_whose_coefficient_rounding_may_make_0(other, solved):
    """Divided by the coefficient of the displaced place, it was an infinite number, and a run was out of range."""
    numbers = Numbers("mpmath", mpmath, mpmath.mpf, -1.0)
    small = mpmath.mpf("1e-17")
    tables = [[(mpmath.mpf(1), small)], [(mpmath.mpf(1), small * mpmath.mpf(float(other)))]]
    assert with_exchanges(tables, [0], [1], numbers)[1] == solved
