"""A mode in numbers: what its functions return, and the cubic between two states with their rates."""

from fractions import Fraction

import sympy as sp

import asympk as ap
from asympk.automaton.automaton import Automaton
from asympk.automaton.numericmode import NumericMode, on_hermite

x, y = sp.symbols("x y")


def test_a_cubic_is_met_by_its_ends_and_their_rates_in_every_share():
    def at(t):
        return 2 - t + 3 * t**2 - Fraction(5, 2) * t**3

    def slope(t):
        return -1 + 6 * t - Fraction(15, 2) * t**2

    start, end = Fraction(1, 3), Fraction(7, 4)
    for k in range(9):
        share = Fraction(k, 8)
        found = on_hermite(share, end - start, ((at(start),), (at(end),)), ((slope(start),), (slope(end),)))
        assert found == (at(start + share * (end - start)),)


def test_the_cubic_ends_in_the_states_themselves():
    ends, slopes = ((0.1, 1e17), (0.3, -7.0)), ((1e30, 3.0), (-2.0, 1.0))
    assert on_hermite(0.0, 0.7, ends, slopes) == ends[0]
    assert on_hermite(1.0, 0.7, ends, slopes) == ends[1]


def test_a_rate_has_the_size_of_its_terms_also_where_they_cancel():
    mode = Automaton(ap.System.with_frictions({x: 30 * x - 20 * y, y: -y}, {}, []), ()).mode(())
    far, near = mode.terms(0.0, (2.0, 3.0), 2.0**-48)
    assert mode.rhs(0.0, (2.0, 3.0)) == (0, -3)
    assert 60 <= far <= 240
    assert 3 <= near <= 6


def test_every_compiled_function_says_what_it_returns():
    names = ("field", "jacobian", "guards", "guard_slopes", "laws", "watched", "watched_slopes")
    meanings = {getattr(NumericMode, name).__doc__ for name in names}
    assert len(meanings) == len(names)
    assert all(meaning.endswith(", as a function of ``(t, *state, *p)``.") for meaning in meanings)
