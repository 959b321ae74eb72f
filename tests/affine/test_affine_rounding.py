"""The estimated rounding error of a run in doubles, against 45 digits."""

from math import ulp

import mpmath
import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.affine import run as affine_run
from asympk.affine.rounding import estimate
from asympk.arithmetic import flow_context, set_digits
from asympk.systems.automata import automaton_of

TIMES_WIDE = 100


def chain_of(blocks, random, until, static=1, damping="1/10"):
    """Return the scene of ``blocks`` on a belt between two walls, joined by springs, from random places."""
    def drawn(lo, hi):
        return sp.Rational(int(random.integers(64 * lo, 64 * hi + 1)), 64)

    x, v, F = (sp.symbols(f"{name}0:{blocks}", real=True) for name in "xvF")
    x_with_walls, v_with_walls = (0, *x, 0), (0, *v, 0)
    springs = [drawn(1, 4) for _ in range(blocks + 1)]
    pulls = [k * (b - a) + sp.Rational(damping) * (d - c) for k, a, b, c, d in zip(
        springs, x_with_walls, x_with_walls[1:], v_with_walls, v_with_walls[1:], strict=False)]
    rates = {**dict(zip(x, v, strict=True)), **{v[i]: pulls[i + 1] - pulls[i] + F[i] for i in range(blocks)}}
    kinetic = [drawn(1, 2) / 2 for _ in x]
    frictions = [ap.Friction(velocity=w - sp.Rational(1, 2), force=f, load=1, kinetic=k, static=static * k)
                 for w, f, k in zip(v, F, kinetic, strict=True)]
    start = {**{s: drawn(-2, 2) for s in x}, **{s: drawn(-1, 1) for s in v}}
    return ap.Scene(system=ap.System.with_frictions(rates, {}, frictions), values={}, start=start, until=until)


def followed_twice(scene):
    """Return (run in doubles, run in 45 digits, the numbers of this run)."""
    case = affine_run.SceneFlows(scene, affine_run.flows(automaton_of(scene)), 1000)
    joined, _, _ = affine_run._estimated(case)
    m = flow_context(400)
    set_digits(m, 45)
    exact = affine_run._followed(m, case._replace(known=joined), [])
    assert exact.modes == joined.modes
    return joined, exact, m


def estimated_and_true(scene):
    """Return (estimated errors, true errors, largest moduli) of the final states of a run in doubles."""
    joined, exact, m = followed_twice(scene)
    true = [abs(m.mpf(a) - b) for a, b in zip(joined.last.state, exact.last.state, strict=True)]
    errors, sizes = estimate([segment.work for segment in joined.segments], len(scene.start))
    return errors, np.array(true, dtype=float), sizes


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_the_error_of_a_chain_is_below_its_estimate_and_not_far_below(seed):
    random = np.random.default_rng(seed)
    blocks = 1 + seed % 5
    estimated, true, sizes = estimated_and_true(chain_of(blocks, random, 24 / blocks, static=1 + seed % 2))
    assert (true <= estimated).all()
    assert max(estimated / sizes) <= TIMES_WIDE * max(*(true / sizes), 2e-16)


@pytest.mark.slow
def test_errors_of_a_motion_that_repeats_itself_are_below_their_estimate():
    scene = chain_of(1, np.random.default_rng(3), 400, static=2, damping=0)
    estimated, true, _ = estimated_and_true(scene)
    assert (true <= estimated).all()


def test_times_of_hundreds_of_events_gather_no_rounding():
    joined, exact, m = followed_twice(chain_of(1, np.random.default_rng(1), 300, static=2, damping=0))
    assert len(joined.events) > 200
    assert all(abs(m.mpf(a.t) - b.t) < 3 * ulp(a.t) for a, b in zip(joined.events, exact.events, strict=True))


def test_the_rounding_of_a_force_that_has_grown_for_long_is_part_of_the_error_of_the_run():
    """The block begins to slip at t0 with exp(k t0 - c) = 1/2; the exponent of 600 is rounded to 1e-13 of the force."""
    v, F, t = sp.symbols("v F t", real=True)
    push = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half)
    system = ap.System.with_frictions({v: F + sp.exp(90 * t - 600)}, {}, [push], time=t)
    path = ap.solve(ap.Scene(system=system, start={v: 0}, until=7))
    m = flow_context(400)
    set_digits(m, 45)
    began = (600 - m.log(2)) / 90
    truth = (m.exp(30) - m.mpf(1) / 2) / 90 - (7 - began) / 2
    assert abs(path.final[0] - truth) <= path.error * truth


def test_chains_of_many_events_are_followed_once_in_doubles(monkeypatch):
    monkeypatch.setattr(affine_run, "_rounded", lambda _: pytest.fail("followed again in digits"))
    path = ap.solve(chain_of(4, np.random.default_rng(1), 15, damping=0))
    assert len(path.events) == 30


def test_no_state_takes_on_the_rounding_of_a_forcing_that_ends_rest_on_a_belt():
    x, v, F, t = sp.symbols("x v F t", real=True)
    forced = F / 2 - 17 * v / 1712 - x / 16 + sp.sin(37 * t / 16)
    belt = ap.Friction(v - sp.Rational(1, 2), F, load=1, kinetic=sp.Rational(19, 16))
    system, starts = ap.System.with_frictions({x: v, v: forced}, {}, [belt], time=t), [-1.5, -0.5, 0.5, 1.5]
    many = ap.solve_many(system=system, start={"x": np.array(starts), "v": 0.3}, until=20)
    for k, begun in enumerate(starts):
        scene = ap.Scene(system=system, start={"x": begun, "v": 0.3}, until=20)
        truth = float(ap.solve(scene, digits=30).final[0])
        assert all(abs(found - truth) <= 4 * ulp(truth) for found in (ap.solve(scene).final[0], many.final[0, k]))


def test_no_neighbour_of_a_block_takes_on_the_rounding_of_the_times_at_which_its_rest_ends():
    x, v, y, w, F, G, t = sp.symbols("x v y w F G t", real=True)
    forced = F - sp.Rational(1525, 144) * x + sp.Rational(325, 36) * y + 2 * sp.sin(5 * sp.sqrt(2) * t / 2 + 1)
    neighbour = sp.Rational(4, 5) * G + sp.Rational(65, 9) * x - sp.Rational(269, 36) * y
    belts = [ap.Friction(v + sp.Rational(5, 8), F, load=1, kinetic=1, static=sp.Rational(11, 8)),
             ap.Friction(w, G, load=1, kinetic=sp.Rational(1, 4))]
    system = ap.System.with_frictions({x: v, v: forced, y: w, w: neighbour}, {}, belts, time=t)
    scene = ap.Scene(system=system, start={x: "9/8", v: "-1/4", y: "1/16", w: "-1/4"}, until=100)
    estimated, true, _ = estimated_and_true(scene)
    assert (true <= estimated).all()


def test_a_parameter_turns_an_angle_by_all_of_its_number_however_large_it_is():
    """x'' = a x - 1/2 from x = 1 at rest, a = -sin(10^300) > 1/2."""
    x, v, F, n = sp.symbols("x v F n", real=True)
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2))
    pushed = ap.System.with_frictions({x: v, v: F - sp.sin(n) * x}, {}, [friction])
    path = ap.solve(ap.Scene(system=pushed, values={n: 10**300}, start={x: 1, v: 0}, until=1))
    with mpmath.workdps(340):
        a = -mpmath.sin(mpmath.mpf(10) ** 300)
        expected = float((1 - 1 / (2 * a)) * mpmath.cosh(mpmath.sqrt(a)) + 1 / (2 * a))
    assert path.final[0] == pytest.approx(expected, abs=1e-14)
