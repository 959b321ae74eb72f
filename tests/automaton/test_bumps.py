"""Bumps in waves: which are narrow, with the parameters of a scene; a start and an end on the middle of a bump."""

import math

import pytest
import sympy as sp

import asympk as ap
from asympk.integrators.integrate import traced
from asympk.systems.automata import automaton_of

a, b, w, v = sp.symbols("a b w v", real=True)
k = sp.Symbol("k", positive=True)


def _middles(push, width):
    system = ap.System.smooth({a: w, b: v, w: push, v: sp.S.Zero}, {}, None)
    scene = ap.Scene(system=system, values={k: width} if push.has(k) else {}, start=[1, 1, 1, 1], until=1)
    return automaton_of(scene).mode(()).middles


@pytest.mark.parametrize(("push", "wide", "narrow"), [
    (1 / (1 + k * sp.cos(a) ** 2), 3, 100),
    (1 / (1 + k * sp.sin(a - b) ** 2), 3, 100),
    (sp.exp(-((k * sp.sin(a)) ** 2)), 2, 200),
    (1 + sp.tanh(k * sp.sin(a)), 2, 200),
    (sp.cos(a) ** 4 + sp.exp(-k * sp.cos(a)), 1, 1000),
    (1 / (1 + 1 / k - sp.cos(a) * sp.cos(b)), 1, 1000),
])
def test_a_bump_is_watched_if_it_is_narrow_beside_the_way_between_middles(push, wide, narrow):
    """The inverse mass matrix of an arm is such a bump, as wide as the wave: LSODA took 1.3 times as long."""
    assert not _middles(push, wide)
    assert _middles(push, narrow)


@pytest.mark.parametrize("push", [
    1 / (2 + w**2 + sp.cos(a)), 1 / (6 + sp.cos(a) + sp.cos(b) + sp.cos(a - b) + sp.cos(a + b)), 1 / sp.cos(a) ** 2,
    sp.gamma(2 + sp.sin(a)),
])
def test_a_bump_is_watched_if_its_width_is_not_known(push):
    """It depends on what is no angle, on many angles, is not finite everywhere, or is no function of NumPy."""
    assert any(middle.every for middle in _middles(push, 1))


@pytest.mark.parametrize("method", ["rk45", "dop853", "lsoda"])
def test_a_push_that_a_start_on_its_middle_does_not_yet_feel_adds_its_area(method):
    """The rates at the start were 0, the first step was long, and the push was lost."""
    push = 10**10 * (a - 1) * sp.exp(-((10**5 * (a - 1)) ** 2))
    system = ap.System.smooth(slow={a: sp.S.One, v: push}, fast={}, small=None)
    path = ap.solve(ap.Scene(system=system, start={"a": 1, "v": 0}, until=1), method=method)
    assert path.final[1] == pytest.approx(0.5, rel=1e-4)


@pytest.mark.parametrize("method", ["rk45", "lsoda"])
def test_a_push_on_whose_middle_a_run_ends_adds_the_area_before_it(method):
    """Rounding hid that a = 1 is reached at the end, where the rates are 0 again, and the push was lost."""
    push = 10**10 * (a - 1) * sp.exp(-((10**5 * (a - 1)) ** 2))
    system = ap.System.smooth(slow={a: sp.S.One, v: push}, fast={}, small=None)
    path = ap.solve(ap.Scene(system=system, start={"a": 0, "v": 0}, until=1), method=method)
    assert path.final[1] == pytest.approx(-0.5, rel=1e-4)


@pytest.mark.parametrize("method", ["radau", "rk45", "lsoda"])
@pytest.mark.few(1)
def test_a_push_whose_middle_is_within_rounding_of_the_end_of_a_step_adds_both_halves(method):
    """The step before it passed no middle, the step after it saw its own half alone, and v ended 1/2 beside."""
    push = 10**6 * (a - k) * sp.exp(-((1000 * (a - k)) ** 2))
    system = ap.System.smooth(slow={a: sp.S.One, v: push, w: 1000 * v}, fast={}, small=None)

    def scene(middle):
        return ap.Scene(system=system, values={k: middle}, start={a: 0, v: 0, w: 0}, until=1)

    options = {"rtol": 1e-6, "atol": 1e-6, "steps": 10**5, "seconds": 60, "events": 0}
    _, far = traced(scene(100), method, keep=True, **options)
    end = min(state[0] for _, state in far.segments[0].steps if state[0] > 0.3)
    for beside in (-1, 0, 1, 3):
        path = ap.solve(scene(end + beside * math.ulp(end)), method)
        assert path.final[1:] == pytest.approx((0, -math.sqrt(math.pi) / 2), abs=0.01)


def test_a_narrow_push_by_a_quotient_adds_its_area_to_a_block_with_friction():
    """Its divisor, a sum of squares, was expanded: its terms cancel where it is least, and the run was refused."""
    force = sp.Symbol("force")
    friction = ap.Friction(velocity=v, force=force, load=sp.Rational(1, 10), kinetic=1)
    push = 10 / (1 + (1000 * (w - 2)) ** 2) ** 2
    system = ap.System.with_frictions(slow={a: v, w: sp.S.One, v: push + force}, fast={}, frictions=(friction,))
    path = ap.solve(ap.Scene(system=system, start={"a": 0, "w": 0, "v": 1}, until=5))
    assert path.final[path.names.index("v")] == pytest.approx(0.5 + math.pi / 200, abs=1e-7)
