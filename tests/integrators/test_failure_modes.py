"""Where methods fail: each test shows the failure of a customary way, and that the exact flow does not share it."""

import math
import random
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import sympy as sp
from peers import here
from scipy.integrate import solve_ivp

import asympk as ap
from asympk.errors import Unfinished
from asympk.integrators.moreau import _solutions
from asympk.systems.automata import automaton_of

SCENES = {"i": (0, 0, 1), "ii": (0, "0.2", -1), "iii": (-1, -1, 1)}
WRONG = 0.1


def scene(name, mu, until=5, **other):
    return ap.Scene(1, mu, SCENES[name], until, **other)


def error(path, truth):
    return max(abs(float(a) - float(b)) for a, b in zip(path.final, truth.final, strict=True))


def right(path, tolerance=1e-12):
    """Whether an exact path agrees with its own text on 30 digits."""
    truth = ap.solve(path.scene, digits=30)
    scale = max(1, *(abs(float(v)) for v in truth.final))
    return path.modes == truth.modes and error(path, truth) <= tolerance * scale


# the driver of the peers, taken apart


def driver(where, solver, directed=True, snap=True, most=40):
    """Follow ``where`` with ``solve_ivp`` and the automaton, leaving out one of its two cares."""
    automaton, until, t = automaton_of(where), float(where.until), 0.0
    state = tuple(float(v) for v in where.start)
    branch = automaton.first(where.start)
    modes = [automaton.mode(branch).name]
    while len(modes) <= most:
        mode = automaton.mode(branch)
        guards = [_guard(mode, k, directed) for k in (0, 1)]
        run = solve_ivp(mode.rhs, (t, until), state, solver, events=guards, rtol=1e-6, atol=1e-6,
                        jac=lambda t, w, mode=mode: np.array(mode.jac(t, w)))
        t, state = float(run.t[-1]), tuple(run.y[:, -1].tolist())
        if run.status != 1:
            break
        hit = 0 if len(run.t_events[0]) else 1
        state = mode.snapped(hit, t, state) if snap else state
        branch = automaton.next(branch, (hit,), t, state) if snap else automaton.first(state)
        modes.append(automaton.mode(branch).name)
    return state, tuple(modes)


def _guard(mode, k, directed):
    def guard(t, state):
        return mode.guard_values(t, state)[k]

    guard.terminal, guard.direction = True, -1 if directed else 0
    return guard


def successes(directed, snap, names):
    found = 0
    for name in names:
        for mu in ("1e-2", "1e-4", "1e-6"):
            for solver in ("LSODA", "Radau"):
                exact = ap.solve(scene(name, mu))
                try:
                    state, modes = driver(exact.scene, solver, directed, snap)
                except ValueError:  # brentq finds no change of sign where the event has just been
                    continue
                found += modes == exact.modes and np.allclose(state, exact.final, atol=1e-3)
    return found


def test_with_both_cares_a_stiff_solver_follows_every_scene():
    assert successes(directed=True, snap=True, names=SCENES) == 18


@pytest.mark.further
def test_events_without_direction_chatter_in_every_scene_and_we_do_not():
    assert successes(directed=False, snap=True, names=SCENES) == 0
    assert all(right(ap.solve(scene(name, mu))) for name in SCENES for mu in ("1e-2", "1e-4", "1e-6"))


@pytest.mark.slow
def test_directed_events_without_snapped_states_fail_wherever_there_is_stick_and_we_do_not():
    assert successes(directed=True, snap=False, names=("ii", "iii")) == 0
    assert all(right(ap.solve(scene(name, mu))) for name in ("ii", "iii") for mu in ("1e-2", "1e-4", "1e-6"))


# one right-hand side


@pytest.mark.parametrize("mu", ["1e-1", "1e-2", "1e-4", "1e-6"])
@pytest.mark.parametrize(("solver", "steps"), [("rk45", 3000), ("lsoda", 4000), ("radau", 500), ("bdf", 3000)])
@pytest.mark.few(3)
def test_one_field_with_a_sign_stalls_where_the_motion_sticks_and_we_do_not(solver, steps, mu):
    exact = ap.solve(scene("ii", mu))
    with pytest.raises(Unfinished) as stop:
        ap.solve(exact.scene, method="sign", solver=solver, steps=steps)
    path = stop.value.path
    assert path.info["status"].startswith("stalled")
    onset, leaving = (float(event.t) for event in exact.events)
    assert onset - 1e-5 < path.info["reached"] < leaving
    assert right(exact)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ii", "iii"])
def test_a_regularised_sign_has_an_error_floor_proportional_to_its_width_and_we_have_none(name):
    exact = ap.solve(scene(name, "1e-2"))
    floors = [error(ap.solve(exact.scene, method="tanh", eps=eps, rtol=1e-9), exact) for eps in (1e-3, 1e-4, 1e-5)]
    looser = error(ap.solve(exact.scene, method="tanh", eps=1e-3, rtol=1e-7), exact)
    assert looser == pytest.approx(floors[0], rel=0.01)
    assert all(5 < coarse / fine < 13 for coarse, fine in pairwise(floors))
    assert right(exact)


@pytest.mark.parametrize("options", [{"method": "sign", "steps": 50}, {"method": "tanh", "eps": 0.01}])
def test_a_field_without_events_is_derived_once_for_all_scenes_of_a_system(options, monkeypatch):
    first, second = scene("i", "1e-1"), scene("iii", "1e-2")
    for one in (first, second):
        with suppress(Unfinished):
            ap.solve(one, **options)
        monkeypatch.setattr(sp.Expr, "diff", None)


# time stepping


def test_a_moreau_step_longer_than_the_instability_has_three_solutions_and_a_shorter_one_has_one():
    mu, start = 1e-4, (-1.0, -1.0, 1.0)
    assert {phase.mode for phase, _ in _solutions(1.0, 1.0, mu, *start, 10 * mu)} == {
        "slip_same", "slip_opposite", "stick"}
    assert [phase.mode for phase, _ in _solutions(1.0, 1.0, mu, *start, mu / 2)] == ["slip_opposite"]


def _loads_of_slip_opposite(sigma, mu, x, y, z, h):
    steps = (state for phase, state in _solutions(sigma, sigma, mu, x, y, z, h) if phase.mode == "slip_opposite")
    return [state[0] + state[1] for state in steps]


def test_an_implicit_step_slips_backward_against_the_force_only_from_a_load_that_falls_below_zero():
    """Lemma 9: for h (1 + h) > mu / sigma the sign of s+ is that of -(mu (s + h y) + h (1 + h))."""
    rng = np.random.default_rng(9)
    for _ in range(300):
        sigma, mu, h = rng.uniform(0.1, 3), 10 ** rng.uniform(-4, 0), 10 ** rng.uniform(-2, 1)
        if h * (1 + h) <= mu / sigma:
            continue
        x, y, z = rng.uniform(-5, 5), rng.uniform(-5, 5), rng.uniform(-1e3, -1)
        falls = mu * (x + y + h * y) + h * (1 + h) < 0
        assert all((s > 0) == falls for s in _loads_of_slip_opposite(sigma, mu, x, y, z, h))
    assert _loads_of_slip_opposite(1, 0.5, 1000.0, -999.0, -1000.0, 1)[0] > 0


def test_short_moreau_steps_meet_every_kind_of_event_of_the_exact_flow_at_most_two_steps_late():
    step = 1e-3
    exact = ap.solve(ap.Scene("-1/2", "1/20", (-1, 0, "-0.3"), "1/2"))
    stepped = ap.solve(exact.scene, method="moreau", step=step)
    assert [event.kind for event in stepped.events] == ["force_zero", "velocity_zero", "slip_onset"]
    assert (stepped.modes, len(exact.events)) == (exact.modes, 3)
    assert all(0 < late.t - event.t < 2 * step for late, event in zip(stepped.events, exact.events, strict=True))


def test_moreau_steps_bring_the_paradox_back_and_take_a_wrong_branch_and_we_do_not():
    exact = ap.solve(scene("iii", "1e-4"))
    stepped = ap.solve(exact.scene, method="moreau", step="1e-3")
    assert stepped.info["status"] == "finished"
    assert stepped.info["steps with three solutions"] > 4000
    assert "stick" not in stepped.modes
    assert "stick" in exact.modes
    assert error(stepped, exact) > WRONG
    assert right(exact)


def test_preferring_stick_does_not_save_the_moreau_steps():
    exact = ap.solve(scene("ii", "1e-4"))
    assert error(ap.solve(exact.scene, method="moreau", step="1e-3", prefer="stick"), exact) > WRONG


def test_moreau_steps_far_longer_than_mu_are_right_in_the_impact_scene():
    """Fairness: where the first step leads into stick, large implicit steps do the impact without collision."""
    exact = ap.solve(scene("ii", "1e-6"))
    assert error(ap.solve(exact.scene, method="moreau", step="1e-3"), exact) < 1e-3


# the unstable plane


def beside(offset):
    return ap.Scene.near("Pi2", x=0, offset=offset, z=1, sigma=1, mu="1e-4", until="0.1")


@pytest.mark.parametrize("method", here("radau", "kvaerno5"))
@pytest.mark.parametrize("offset", ["1e-6", "-1e-6", "1e-10", "-1e-10"])
def test_implicit_one_step_methods_stay_on_the_unstable_plane_and_we_do_not(method, offset):
    exact = ap.solve(beside(offset))
    path = ap.solve(exact.scene, method=method, rtol=1e-6)
    assert path.info["status"] == "finished"
    assert path.modes == ("slip_opposite",)
    assert error(path, exact) > WRONG
    assert len(exact.modes) > 1
    assert right(exact)


@pytest.mark.parametrize("method", here("bdf", "cvode"))
def test_backward_differences_leave_the_unstable_plane_on_the_wrong_side_or_never_and_we_do_not(method):
    offsets = [f"{sign}1e-{k}" for k in (6, 8, 10) for sign in ("", "-")]
    exact = [ap.solve(beside(offset)) for offset in offsets]
    paths = [ap.solve(path.scene, method=method, rtol=1e-6) for path in exact]
    assert any(p.modes != e.modes and error(p, e) > WRONG for p, e in zip(paths, exact, strict=True))
    assert all(map(right, exact))


@pytest.mark.parametrize("method", here("lsoda", "heyoka"))
@pytest.mark.parametrize("offset", ["1e-6", "-1e-6", "1e-10", "-1e-10"])
def test_methods_that_start_explicitly_leave_the_unstable_plane_as_we_do(method, offset):
    """Fairness: small explicit first steps keep the deviation and let it grow at its own rate."""
    exact = ap.solve(beside(offset))
    assert ap.solve(exact.scene, method=method, rtol=1e-6).modes == exact.modes


# stiffness


@pytest.mark.parametrize("method", here("rk45", "dop853", "heyoka"))
@pytest.mark.few(1)
def test_explicit_methods_are_right_at_a_cost_that_grows_as_one_over_mu_and_ours_does_not(method):
    steps = []
    for mu in ("1e-2", "1e-3"):
        exact = ap.solve(scene("ii", mu))
        path = ap.solve(exact.scene, method=method, rtol=1e-6, steps=10**6)
        assert path.modes == exact.modes
        assert error(path, exact) < 1e-4
        steps.append(path.info["work"]["steps"])
    assert 8 < steps[1] / steps[0] < 12
    pieces = {len(ap.solve(scene("ii", mu)).modes) for mu in ("1e-2", "1e-5", "1e-8")}
    assert pieces == {3}


# formulas


def textbook(a, b, mu, start, t, root=math.sqrt, exp=math.exp):
    """One mode by partial fractions with the eigenvalues of the textbook; x and y at time ``t``."""
    x, y, _ = start
    fast, slow = ((-b + k * root(b * b - 4 * mu * b)) / (2 * mu) for k in (-1, 1))
    rest = a / b
    along = (y - fast * (x - rest)) / (slow - fast)
    across = x - rest - along
    return (rest + along * exp(slow * t) + across * exp(fast * t),
            along * slow * exp(slow * t) + across * fast * exp(fast * t))


def test_the_textbook_slow_eigenvalue_loses_digits_as_mu_falls_and_ours_does_not():
    losses = []
    for mu in ("1e-4", "1e-8", "1e-12"):
        path = ap.solve(scene("i", mu, until=1))
        x, _ = textbook(1, 5, float(mu), SCENES["i"], 1.0)
        losses.append(abs(x - float(ap.solve(path.scene, digits=30).final[0])))
        assert right(path, 1e-15)
    assert losses[0] < losses[1] < losses[2]
    assert losses[2] > 1e-8


def test_the_textbook_eigenvalue_takes_a_wrong_branch_near_the_unstable_plane_and_ours_does_not():
    mu = 1e-8
    sides = set()
    for offset in ("1e-10", "-1e-10"):
        near = ap.Scene.near("Pi2", x="0.3", offset=offset, z=1, sigma=1, mu="1e-8", until="1e-6")
        assert right(ap.solve(near))
        fast, slow = ((1 + k * math.sqrt(1 + 4 * mu)) / (2 * mu) for k in (1, -1))
        x, y = near.start[:2]
        sides.add((y - slow * (x + 1) > 0, float(offset) > 0, fast > 0))
    assert any(leaves_up != above for leaves_up, above, _ in sides)


def test_exponentials_lose_the_limit_of_no_friction_excess_and_ours_do_not():
    losses = []
    for sigma in ("1e-4", "1e-8", "1e-12"):
        path = ap.solve(ap.Scene(sigma, "0.1", (0, "0.2", -1), 5))
        event = ap.solve(path.scene, digits=30).events[0]
        x, _ = textbook(1, -float(sigma), 0.1, (0.0, 0.2, -1.0), float(event.t))
        losses.append(abs(x - float(event.x)))
        assert abs(path.events[0].x - float(event.x)) < 1e-15
        assert right(path)
    assert losses[0] < 1e-10 < losses[1] < 1e-6 < losses[2]


def test_partial_fractions_break_down_where_node_turns_to_focus_and_ours_do_not():
    start = ("0.5", "0.5", 0)
    with pytest.raises(ZeroDivisionError):
        textbook(0, 1, 0.25, (0.5, 0.5, 0.0), 0.1)
    beside = float(Fraction(1, 4) * (1 - Fraction(1, 10**13)))
    truth = ap.solve(ap.Scene(1, beside, start, "0.1"), digits=30)
    assert truth.modes == ("stick",)
    x, _ = textbook(0, 1, beside, (0.5, 0.5, 0.0), 0.1)
    assert abs(x - float(truth.final[0])) > 1e-12
    for mu in ("1/4", beside, float(Fraction(1, 4) * (1 + Fraction(1, 10**13)))):
        assert right(ap.solve(ap.Scene(1, mu, start, 1)), 1e-15)


# events


def test_a_search_by_sampling_misses_a_double_crossing_that_ours_brackets():
    start = (-4.645303596781149, -4.391482433311355, 3.406240353653226)
    path = ap.solve(ap.Scene(16.48116775916368, 0.6013074263183269, start, 3))
    samples = [float(path(float(t))[2]) for t in np.linspace(0, 3, 31)]
    assert all(z == 0 for z in samples[1:])
    assert path.modes == ("slip_opposite", "stick", "slip_opposite", "slip_same", "stick")
    assert path.events[3].t - path.events[1].t < 0.05
    assert right(path)


@pytest.mark.further
def test_the_sum_of_snapped_coordinates_is_off_the_edge_and_ours_does_not_chatter_there():
    rng = random.Random(7)
    still_held = 0
    for _ in range(200):
        sigma, mu, x, z = rng.uniform(0, 5), rng.uniform(1e-4, 0.5), rng.uniform(-3, 3), rng.uniform(-3, 0)
        path = ap.solve(ap.Scene(sigma, mu, (x, 1 - x, z), 3))
        for event in path.events:
            if event.kind == "slip_onset":
                edge = 1 / (sigma + 3) if event.x + event.y > 0 else -1 / (sigma + 1)
                s = event.x + (edge - event.x)
                still_held += abs(1 - s) < (sigma + 2) * abs(s)
        assert path.modes == ap.solve(path.scene, digits=20).modes
    assert still_held > 20


def test_the_literal_half_planes_hold_every_state_for_shallow_rods_and_ours_do_not():
    sigma = Fraction(-3, 2)
    lower, upper = 1 / (sigma + 3), -1 / (sigma + 1)
    loads = [Fraction(k, 7) for k in range(-70, 70)]
    assert all(s >= lower or s <= upper for s in loads)
    held = [s for s in loads if abs(1 - s) <= (sigma + 2) * abs(s)]
    assert held == [s for s in loads if lower <= s <= upper]
    for s in (Fraction(3), Fraction(-1)):
        path = ap.solve(ap.Scene(sigma, "1e-2", (0, s, 0), 5))
        assert path.modes[0] != "stick"
        assert right(path)
    region = ap.stick_regions(ap.systems.painleve_klein.system()).stick
    assert [bool(region.contains(s, sigma=sigma, sigma0=sigma)) for s in (3, -1, 1)] == [False, False, True]


# what the paper writes


@pytest.mark.parametrize("mu", ["1e-3", "1e-5", "1e-7"])
def test_freezing_x_in_the_jump_is_wrong_at_every_mu_and_our_jump_is_not(mu):
    exact = ap.solve(scene("ii", mu, until="0.5"))
    frozen = 1 / 5 + (0 - 1 / 5) * math.exp(-0.5)
    assert abs(float(exact.final[0]) - frozen) > 0.5
    assert error(ap.solve(exact.scene, method="jump", order=0), exact) < 20 * float(Fraction(mu)) * 16
    assert right(exact)


# symbols and numbers


def test_lambdify_puts_a_double_into_exact_arithmetic_and_lower_does_not():
    x = sp.Symbol("x")
    third = sp.lambdify(x, sp.Rational(1, 3) + x, modules="math")
    with mpmath.workdps(40):
        assert abs(third(mpmath.mpf(0)) - mpmath.mpf(1) / 3) > mpmath.mpf("1e-18")
        assert ap.lower((x,), sp.Rational(1, 3) + x, target="mpmath")(0) == mpmath.mpf(1) / 3


def test_a_naive_recurrence_for_a_slow_manifold_swells_and_ours_stays_in_its_ring():
    x, y, mu, k, lam = sp.symbols("x y mu kappa lambda", positive=True)
    field, fast, first = -x + (x + k - lam) * y, x - (x + k) * y, x / (x + k)
    swollen = [first]
    for order in range(1, 4):
        transport = sum(sp.diff(swollen[j], x) * (field.subs(y, swollen[order - 1 - j]) if order - 1 - j == 0
                        else (x + k - lam) * swollen[order - 1 - j]) for j in range(order))
        swollen.append(transport / sp.diff(fast, y))
    system = ap.System.smooth(slow={x: field}, fast={y: fast}, small=mu)
    ours = ap.slow_manifold(system, branch={y: first}, order=3)
    assert all(sp.cancel(a - b) == 0 for a, b in zip(swollen, ours.coefficients, strict=True))
    assert sp.count_ops(swollen[3]) > 10 * sp.count_ops(ours.coefficients[3])


def test_a_double_for_two_tenths_is_not_two_tenths_and_a_word_is():
    with mpmath.workdps(30):
        assert mpmath.mpf(0.2) != mpmath.mpf(1) / 5
    told, typed = (ap.solve(ap.Scene(1, "1e-2", (0, v, -1), 5), digits=30).final for v in ("0.2", 0.2))
    assert ap.Scene(1, "1e-2", (0, "0.2", -1), 5).start[1] == Fraction(1, 5)
    assert max(abs(a - b) for a, b in zip(told, typed, strict=True)) > 1e-21
