"""A mode in numbers: what its functions return, and the cubic between two states with their rates."""

from fractions import Fraction
from math import cos, sin

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.automaton.automaton import Automaton
from asympk.automaton.numericmode import NumericMode, on_hermite
from asympk.errors import OutOfRange
from asympk.symbolic.branches import Phase

x, y, z = sp.symbols("x y z")


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


def test_a_rate_has_the_size_of_the_reactions_that_balance_there_whatever_the_parameters_are():
    """The reaction is the weight: relative changes of states and parameters left the rate at 0."""
    F, N, g = sp.symbols("F N g")
    ground = ap.Friction(x, F, N, sp.Rational(1, 5), normal=N, constraint=N - g)
    mode = Automaton(ap.System.with_frictions({x: F, y: N - g}, {}, [ground]), (10,)).mode((Phase(1, 1),))
    assert tuple(mode.terms(0.0, (1.0, 0.0), 2.0**-48)) == (2, 10)
    assert mode.terms(np.zeros(0), np.zeros((2, 0)), 2.0**-48).shape == (2, 0)  # of a segment without steps


def test_rates_on_arrays_are_those_of_single_numbers_also_at_limits_and_where_parts_overflow():
    rates = {x: (sp.exp(x) - 1) / x, y: 1 / sp.cosh(y) ** 2, z: sp.sqrt(z)}
    for removed in ((), (x,)):
        system = ap.System.with_frictions({s: rate for s, rate in rates.items() if s not in removed}, {}, [])
        mode = Automaton(system, ()).mode(())
        places = [dict(zip((x, y, z), at, strict=True)) for at in ((0.0, 0.5, 2.0), (1e-9, 1e3, 1.0), (2.0, 0.0, 0.0))]
        rows = [tuple(place[s] for s in system.states) for place in places]
        found = mode.on_arrays(lambda mode: mode.field, np.zeros(3), np.array(rows).T)
        assert found.T.tolist() == [pytest.approx(mode.rhs(0.0, row), rel=1e-15) for row in rows]
        assert np.isnan(mode.on_arrays(lambda mode: mode.field, 0.0, (*rows[0][:-1], -1.0))).all()


def test_beside_a_limit_alone_rates_on_arrays_are_computed_one_by_one():
    """A run with sin(x)/x took twice as long as with single numbers."""
    mode, single = Automaton(ap.System.with_frictions({x: sp.sin(x) / x}, {}, []), ()).mode(()), []

    def counted(mode):
        return mode.field if mode.target == "numpy" else lambda *place: single.append(place) or mode.field(*place)

    found = mode.on_arrays(counted, np.zeros(3), [np.array([1e-9, 1.0, 2.0])])
    assert found[0] == pytest.approx([1, sin(1), sin(2) / 2], rel=1e-15)
    assert single == [(0.0, 1e-9)]


def test_a_small_swing_between_belts_keeps_its_digits_however_hard_these_are_pressed_on():
    """Their frictions cancel, and the cube is 10^-12 of the pull; errors were relative to the frictions."""
    belts = [ap.Friction(y - speed, sp.Symbol(f"F{speed}"), load=1000, kinetic=1) for speed in (-3, 3)]
    pull = belts[0].force + belts[1].force - x - x**3
    path = ap.solve(ap.Scene(system=ap.System.with_frictions({x: y, y: pull}, {}, belts),
                             start={x: "1e-6", y: 0}, until=10))
    assert path.final == pytest.approx((1e-6 * cos(10), -1e-6 * sin(10)), abs=1e-13)


def test_a_velocity_that_no_error_in_time_explains_is_set_to_0_by_the_state_that_changes_it_most():
    """z stands still, and y would have to move by 1e-3 to make z - x y vanish."""
    z, F = sp.symbols("z F")
    system = ap.System.with_frictions({x: y, y: sp.Rational(1, 10**8), z: F + 1}, {},
                                      [ap.Friction(z - x * y, F, load=1, kinetic=1)])
    mode = Automaton(system, ()).mode((Phase(1, 1),))
    guard = mode.kinds.index(("velocity_zero", 0))
    moved = mode.snapped(guard, 0.5, (4e-10, -4e-10, 5e-13))
    assert moved[:2] == pytest.approx((4e-10, -4e-10), rel=1e-9)
    assert mode.guard_values(0.5, moved)[guard] == 0


@pytest.mark.parametrize("method", ["dop853", "radau"])
def test_a_load_that_a_wave_in_time_moves_less_than_the_motion_does_changes_its_sign_at_each_zero(method):
    """By the rounding that was left of cos(3 t) + cos(2 t)/30, the load was still positive after its fifth zero."""
    w, v, F, t = sp.symbols("w v F t", real=True)
    load = y + sp.cos(2 * t) / 30
    rough = ap.Friction(v + 2, F, load=load, kinetic=sp.Rational(1, 2))
    system = ap.System.with_frictions({x: v, v: F - x, y: w, w: -9 * y}, {}, [rough], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0, y: 1, w: 0}, until=9), method)
    assert [event.kind for event in path.events] == ["force_zero"] * 9
    assert [cos(3 * event.t) + cos(2 * event.t) / 30 for event in path.events] == pytest.approx([0] * 9, abs=1e-6)


def test_every_compiled_function_says_what_it_returns():
    names = ("field", "jacobian", "guards", "guard_slopes", "laws", "watched", "watched_slopes")
    meanings = {getattr(NumericMode, name).__doc__ for name in names}
    assert len(meanings) == len(names)
    assert all(meaning.endswith(", as a function of ``(t, *state, *p)``.") for meaning in meanings)


@pytest.mark.parametrize("rate", [
    sp.log, lambda k: sp.atanh(1 - k), lambda k: sp.Piecewise((k, k > 3)), lambda k: sp.factorial2(k + sp.S.Half),
])
def test_a_coefficient_that_has_no_value_is_refused(rate):
    """It was taken for 0, and nothing moved."""
    x, k = sp.symbols("x k", real=True)
    scene = ap.Scene(system=ap.System.smooth({x: -rate(k) * x}, {}, None), values={k: 0}, start={x: 1}, until=1)
    with pytest.raises(OutOfRange, match="a coefficient of the system is not a finite number"):
        ap.solve(scene)
