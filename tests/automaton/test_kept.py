"""Motions on which a symmetry keeps: what vanishes in all symmetric states stays 0, and is no event."""

import math

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.errors import UnboundedReaction

X, Y, theta = dynamicsymbols("X Y theta")
T = dynamicsymbols._t
eps = sp.Symbol("eps", positive=True)
q, w, v, p, s, r, u, F, G = sp.symbols("q w v p s r u F G", real=True)


def turning(second, push=0):
    """Return a body on two frictions whose velocities v + q w and v - q w are equal while it has not turned by q."""
    loads = ((v + q * w, F, 2 + p), (v - q * w, G, second))
    frictions = [ap.Friction(velocity, force, load, sp.Rational(1, 5)) for velocity, force, load in loads]
    rates = {q: w, w: q * (F - G) - q + push, v: F + G, p: s, s: -p, r: u, u: -r}
    system = ap.System.with_frictions(rates, {}, frictions)
    return ap.Scene(system=system, start=dict.fromkeys((q, w, v, p, r), 0) | {s: 1, u: -1}, until=2)


@pytest.mark.parametrize("second", [2 + p, 2 - r])  # r = -p
@pytest.mark.few(1)
def test_two_frictions_whose_shares_nothing_determines_hold_a_body_that_does_not_turn_under_equal_loads(second):
    path = ap.solve(turning(second))
    assert (path.events, path.final[:3]) == ((), (0, 0, 0))
    assert path.final[3:] == pytest.approx([math.sin(2), math.cos(2), -math.sin(2), -math.cos(2)], abs=1e-8)


@pytest.mark.further
@pytest.mark.parametrize(("second", "push", "mode"), [(2 + p, p**5, "slip_same+slip_opposite"),
                                                      (2 - r + p**9, 0, "slip_same+stick")])
def test_a_symmetry_that_a_high_power_breaks_is_not_kept(second, push, mode):
    """Pushed, the body turns, braked by (4 + 2 p)/5 times q; under a larger load of the second friction it rests."""
    path = ap.solve(turning(second, push))
    body = solve_ivp(lambda t, y: [y[1], -y[0] * (9 + 2 * math.sin(t)) / 5 + math.sin(t) ** 5], (0, 2), [0, 0],
                     rtol=1e-11, atol=1e-13)
    assert path.modes == (mode,)
    assert path.final[:3] == pytest.approx([*(body.y[:, -1] * (push != 0)), 0], abs=1e-8)


@pytest.mark.further
def test_a_symmetry_that_is_broken_beyond_all_orders_that_are_computed_is_not_kept():
    """The velocities part with the power 17 of the time."""
    with pytest.raises(UnboundedReaction, match=r"stick\+stick has equations that are singular"):
        ap.solve(turning(2 + p, (p + r) * s + q**2 + p**7))


def block(friction, height):
    """Return a block of mass 1 and moment of inertia 1/12, on legs at its two lower corners on an elastic ground."""
    energy = (X.diff(T) ** 2 + Y.diff(T) ** 2) / 2 + theta.diff(T) ** 2 / 24 - Y
    legs = [ap.Contact(gap=Y - height * sp.cos(theta) + side * sp.sin(theta) / 2, friction=friction, unilateral=True,
                       slip=X + side * sp.cos(theta) / 2 + height * sp.sin(theta)) for side in (1, -1)]
    mechanism = ap.Mechanism.from_lagrangian(energy, (X, Y, theta), contact=legs[0], others=legs[1:])
    return mechanism, mechanism.elastic(compliance=eps**2, damping=2 * eps)


@pytest.mark.parametrize(("friction", "height", "drop"), [
    (sp.Rational(1, 5), sp.Rational(1, 4), 0),
    (0, sp.Rational(1, 4), sp.Rational(1, 20)),
    (sp.Rational(1, 5), sp.Rational(1, 4), sp.Rational(1, 20)),
])
@pytest.mark.further
def test_a_block_on_two_elastic_legs_that_starts_or_lands_flat_stays_flat(friction, height, drop):
    """It is an oscillator, c x'' = 1 - 2 (x + h x'), from where its dampers begin to push, x + h x' = 0."""
    mechanism, system = block(friction, height)
    flat = {"X": 0, "Y": height + drop, "theta": 0, "X'": 0, "Y'": 0, "theta'": 0, "eps": "3/100"}
    path = ap.solve(ap.Scene(system=system, values={"eps": "3/100"}, start=mechanism.start(system, flat), until=1))
    c, h = 0.03**2, 2 * 0.03
    fall = math.sqrt(h**2 + 2 * float(drop)) - h
    x, y = expm(np.array([[0, 1], [-2 / c, -2 * h / c]]) * (1 - fall)) @ [-h * fall / c - 1 / 2, fall / c] + [1 / 2, 0]
    assert [event.kind for event in path.events] == (["touch_down"] if drop else [])
    rate = 0.03 * y  # in the unit of the fast time t/eps
    ends = dict(zip(path.names, path.final, strict=True))
    expected = {"X": 0, "Y": float(height) - c * x, "theta": 0, "x": x, "x2": x, "X'": 0, "Y'": -0.03 * rate,
                "theta'": 0, "y": rate, "y2": rate}
    assert ends == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("how", [{}, {"method": "lsoda"}, {"digits": 12}])
@pytest.mark.few(2)
def test_states_part_where_their_rates_differ_by_a_pulse_that_numbers_nearby_do_not_show(how):
    """1 + exp(-10^4 (t - 1/2)^2)/100 is 1 in doubles far from 1/2; the first block was put beside the other one."""
    t, p, q, u, v, F, G = sp.symbols("t p q u v F G", real=True)
    pulse = sp.exp(-(10**4) * (t - sp.S.Half) ** 2)
    blocks = [ap.Friction(u, F, load=1 + t**2, kinetic=1), ap.Friction(v, G, load=1 + t**2, kinetic=1)]
    system = ap.System.with_frictions({p: 1 + pulse / 100, q: 1, u: F + p, v: G + q}, {}, blocks, time=t)
    path = ap.solve(ap.Scene(system=system, values={}, start={p: 0, q: 0, u: 0, v: 0}, until=1), **how)
    assert path.final[0] - path.final[1] == pytest.approx(math.sqrt(math.pi) / 10**4, rel=0.05)


@pytest.mark.further
@pytest.mark.parametrize("of", [lambda peak: peak, lambda peak: sp.tanh(1 + peak) - sp.tanh(1)])
def test_a_symmetry_that_a_pulse_breaks_elsewhere_is_not_kept(of):
    """Far from t = 1/2 it is below all digits of 1; a velocity was said to stay 0, and friction drove the body."""
    t = sp.Symbol("t", real=True)
    pulse = of(sp.exp(-(10**4) * (t - sp.S.Half) ** 2))
    frictions = [ap.Friction(v + sign * q * w, force, 2 + t**2, sp.Rational(1, 5)) for sign, force in ((1, F), (-1, G))]
    rates = {q: w, w: q * (F - G) - q + 20 * (p - s), v: F + G + sp.S.Half, p: 1 + pulse, s: 1}
    system = ap.System.with_frictions(rates, {}, frictions, time=t)
    with pytest.raises(UnboundedReaction, match=r"stick\+stick has equations that are singular"):
        ap.solve(ap.Scene(system=system, start=dict.fromkeys(rates, 0), until=1), method="radau")


@pytest.mark.slow
def test_a_symmetry_of_parameters_that_agree_in_numbers_alone_is_kept():
    near, wide = sp.symbols("near wide", positive=True)
    frictions = [ap.Friction(v + q * w * near, F, 2 + p, sp.Rational(1, 5)),
                 ap.Friction(v - q * w * (wide - near), G, 2 + p, sp.Rational(1, 5))]
    rates = {q: w, w: q * (F - G) - q + (wide - 2 * near) * p**2, v: F + G, p: s, s: -p}
    system = ap.System.with_frictions(rates, {}, frictions)
    values = {"near": "1/3", "wide": "2/3"}
    path = ap.solve(ap.Scene(system=system, values=values, start={q: 0, w: 0, v: 0, p: 0, s: 1}, until=2))
    assert (path.events, path.final[:3]) == ((), (0, 0, 0))
