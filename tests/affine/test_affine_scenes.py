"""Whole scenes of affine systems with friction, against 70 digits and against the rod's kernel."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.affine import events
from asympk.affine import run as affine_run
from asympk.affine.form import mode_obstacle
from asympk.affine.functions import Block
from asympk.affine.mesh import Mesh
from asympk.affine.mode import AffineMode
from asympk.affine.run import flows, run
from asympk.arithmetic import Doubles, set_digits
from asympk.automaton import decide
from asympk.automaton.automaton import Automaton
from asympk.automaton.modes import mode_of
from asympk.automaton.numericmode import NumericMode
from asympk.errors import AsympkError, InputError, OutOfRange
from asympk.studies.bench import rod_in_general_clothes as rod

flint = pytest.importorskip("flint")

F, G, t = sp.symbols("F G t", real=True)
DIGITS, BITS = 70, 400


def random_scene(random, size, mu, forced):
    """Return a scene of ``size`` states, one of them a sliding velocity, one of them fast and stable."""
    states = sp.symbols(f"y0:{size}", real=True)
    a = random.integers(-8, 9, (size, size)) / 4 - 2 * np.eye(size)
    a[0, 0] = -abs(a[0, 0]) - 0.5
    b, coupling = random.integers(-8, 9, (2, size)) / 4
    coupling[-1] = 1
    wave = (sp.cos(2 * t) + t / 4) * forced
    rates = [
        sum(sp.Rational(c) * s for c, s in zip(row, states, strict=True)) + sp.Rational(d) + sp.Rational(e) * F
        for row, d, e in zip(a, b, coupling, strict=True)
    ]
    rates[1] += wave
    load = 2 + states[0] / 2 + states[1] / 4 if size > 2 else sp.Integer(2)
    small = sp.Symbol("mu", positive=True)
    system = ap.System.with_frictions(
        dict(zip(states[1:], rates[1:], strict=True)), {states[0]: rates[0]},
        [ap.Friction(velocity=states[-1], force=F, load=load, kinetic=sp.Rational(3, 4), static=1)],
        small=small, time=t,
    )
    start = dict(zip(states, (random.integers(-64, 65, size) / 32).tolist(), strict=True))
    return ap.Scene(system=system, values={small: mu}, start=start, until=3)


class Truth:
    """A mode at 70 digits by its matrix exponential in balls; forcing in the symbols of the mode is carried."""

    def __init__(self, system, values, branch):
        mode = mode_of(system, branch)
        put = dict(zip(system.parameters, map(sp.Rational, values), strict=True))
        self.states = (*system.states, *sp.symbols("one tau c s"))
        one, tau, c, s = self.states[-4:]
        carried = {sp.cos(2 * t): c, sp.sin(2 * t): s, t: tau}
        rates = [sp.expand(r.subs(put)).subs(carried) for r in mode.rates] + [0, one, -2 * s, 2 * c]
        self.matrix = mpmath.matrix(self.rows(rates, one))
        self.guards = self.rows([sp.expand(g.subs(put)).subs(carried) for g in mode.guard_values], one)

    def rows(self, expressions, one):
        zero = dict.fromkeys(self.states, 0)
        linear = [sp.expand(e - e.subs(zero) * (1 - one)) for e in map(sp.sympify, expressions)]
        return [[mpmath.mpf(q.p) / q.q for q in map(e.coeff, self.states)] for e in linear]

    def after(self, whole, h):
        with flint.ctx.workprec(BITS):
            flow = flint.arb_mat((self.matrix * h).tolist()).exp()
            ends = (flow * flint.arb_mat([[flint.arb(w)] for w in whole])).entries()
            assert all(end.rad() < flint.arb(10) ** -DIGITS * (1 + abs(end)) for end in ends)
            return mpmath.matrix([mpmath.ldexp(*map(int, end.mid().man_exp())) for end in ends])

    def beside(self, whole, h):
        """Return the state a short time ``h`` later, or earlier, by the series of the state itself."""
        term, terms = whole, 0
        while mpmath.norm(term) > mpmath.eps * mpmath.norm(whole):
            terms += 1
            term = self.matrix * term * (h / terms)
            whole = whole + term
        return whole


def begun(state, t0):
    return mpmath.matrix([*state, 1, t0, mpmath.cos(2 * t0), mpmath.sin(2 * t0)])


def refined(scene, path):
    """Return (times of the events, final state) of the modes of a path, at 70 digits; check guards between them."""
    automaton = Automaton(scene.system, scene.values)
    segments = path.at.segments
    size = len(scene.start)
    branch = automaton.first(scene.start)
    exact = map(Fraction, scene.start)
    state, now, times = [mpmath.mpf(v.numerator) / v.denominator for v in exact], mpmath.mpf(0), []
    for k, leg in enumerate(segments):
        mode = Truth(scene.system, scene.values, branch)
        whole = begun(state, now)
        span = mpmath.mpf(leg.span)
        if leg.guard is None:
            return times, list(mode.after(whole, mpmath.mpf(scene.until) - now)[:size])
        row = mpmath.matrix([mode.guards[_guard(automaton, branch, leg)]])
        there = mode.after(whole, span)
        for _ in range(4):
            step = -(row * there)[0] / (row * (mode.matrix * there))[0]
            span, there = span + step, mode.beside(there, step)
        state, now = list(there[:size]), now + span
        times.append(now)
        if path.events[k].kind == "velocity_zero":
            state[-2] = mpmath.mpf(0)
        branch = automaton.next(branch, (_guard(automaton, branch, leg),), now, tuple(map(float, path.events[k].state)))
    return times, state


def _guard(automaton, branch, leg):
    return flows(automaton).of(Doubles, automaton.mode(branch).mode)[2][leg.guard]


@pytest.mark.few(0)
@pytest.mark.parametrize("mu", [1e-1, 1e-3, 1e-6, 1e-8])
@pytest.mark.parametrize("forced", [0, 1])
def test_random_systems_end_where_seventy_digits_say(mu, forced):
    random = np.random.default_rng(int(-np.log10(mu)) + 10 * forced)
    followed = 0
    for _ in range(4):
        scene = random_scene(random, int(random.integers(4, 7)), mu, forced)
        try:
            path = ap.solve(scene)
        except AsympkError:
            continue
        followed += 1
        assert path.model == "exact"
        with mpmath.workdps(DIGITS):
            times, final = refined(scene, path)
            size = max(abs(float(w)) for state in (final, *(e.state for e in path.events)) for w in state)
            assert max(abs(a - b) for a, b in zip(final, path.final, strict=True)) < 1e-13 * size
            assert all(abs(a - b.t) < 1e-14 * scene.until for a, b in zip(times, path.events, strict=True))
            assert float(path.error) < 2e-13
    assert followed > 1


def random_pair(random, size):
    """Return a scene of ``size`` states with two frictions, a forcing, an oscillation and up to two fast states."""
    states, fast = sp.symbols(f"y0:{size}", real=True), int(random.integers(0, 3))
    a = random.integers(-8, 9, (size, size)) / 4 - 2 * np.eye(size)
    a[:fast, :fast] = -np.diag(1 + random.integers(0, 9, fast) / 4)
    a[-1, -2], a[-2, -1] = -4, 1
    rest, first, second = random.integers(-8, 9, (3, size)) / 4
    first[-2:], second[-2:] = (0, 1), (1, 0)
    forces = zip(*(map(sp.Rational, column) for column in (rest, first, second)), strict=True)
    rates = [sum(map(sp.Mul, map(sp.Rational, row), states)) for row in a]
    rates = [rate + d + e * F + g * G for rate, (d, e, g) in zip(rates, forces, strict=True)]
    rates[2] += 2 * sp.sin(sp.Rational(7, 2) * t + 1)
    frictions = [
        ap.Friction(states[-1] - sp.Rational(1, 2), F, load=2, kinetic=sp.Rational(3, 4), static=1),
        ap.Friction(states[-2], G, load=1, kinetic=sp.Rational(1, 2)),
    ]
    mu = sp.Symbol("mu", positive=True)
    system = ap.System.with_frictions(
        dict(zip(states[fast:], rates[fast:], strict=True)), dict(zip(states[:fast], rates[:fast], strict=True)),
        frictions, small=mu if fast else None, time=t,
    )
    start = dict(zip(map(str, states), (random.integers(-64, 65, size) / 32).tolist(), strict=True))
    values = {mu: 10.0 ** -random.integers(1, 9)} if fast else {}
    return ap.Scene(system=system, values=values, start=start, until=2)


@pytest.mark.few(0)
@pytest.mark.parametrize("size", [4, 5, 6, 7, 8])
def test_two_frictions_do_what_seventy_digits_and_an_integrator_say(size):
    scene = random_pair(np.random.default_rng(40 + size), size)
    path, true = ap.solve(scene), ap.solve(scene, digits=70)
    coarse = ap.solve(scene, method="lsoda", rtol=1e-10, atol=1e-10)
    for other in (true, coarse):
        assert path.modes == other.modes
        assert [e[::3] for e in path.events] == [e[::3] for e in other.events]
    size_of_path = max(abs(float(w)) for state in (true.final, *(e.state for e in true.events)) for w in state)
    assert max(abs(a - b) for a, b in zip(path.final, true.final, strict=True)) < 1e-13 * size_of_path
    assert max(abs(a - b) for a, b in zip(path.final, coarse.final, strict=True)) < 1e-6 * size_of_path


def test_what_sticks_has_the_velocity_zero_exactly_though_its_velocity_moves_the_margin_most():
    y, a, b, v = sp.symbols("y a b v", real=True)
    mu, q = sp.Symbol("mu", positive=True), sp.Rational(1, 4)
    system = ap.System.with_frictions(
        {a: 7 * q * (F + y) - b / 2 + v / 2 + 1, b: -6 * q * (y + b) - a - 2 * v - 2,
         v: F + 5 * q * y - 6 * q * a - 4 * v + 1},
        {y: 2 * F - 15 * q * y - a / 2 + 7 * q * b - 5 * q * v},
        [ap.Friction(velocity=v, force=F, load=2, kinetic=3 * q)], small=mu,
    )
    start = {"y": -0.5, "a": 0.5, "b": -0.5, "v": 0.5}
    scene = ap.Scene(system=system, values={"mu": 1e-4}, start=start, until=2)
    for path in (ap.solve(scene), ap.solve(scene, digits=40)):
        assert path.modes == ("slip_same", "stick", "slip_same")
        assert path.events[-1].state[2] == 0
    many = ap.solve_many(system=system, values={"mu": 1e-4}, start={**start, "v": [0.5] * 5}, until=2)
    assert many.alone == 0
    assert many.final[:, 0] == pytest.approx(ap.solve(scene).final, rel=1e-12)


def test_the_rod_under_other_names_does_what_its_kernel_does():
    random, system = np.random.default_rng(5), rod()
    for _ in range(40):
        sigma = float(random.choice([random.uniform(-1.9, 3), 1.0, -(10 ** random.uniform(-3, 0))]))
        sigma0, mu = sigma + float(random.choice([0, random.uniform(0, 2)])), 10 ** random.uniform(-8, -0.3)
        start, until = random.uniform(-2, 2, 3).tolist(), 10 ** random.uniform(-1, 1)
        known = ap.solve(ap.Scene(sigma=sigma, sigma0=sigma0, mu=mu, start=start, until=until))
        values = {"eps": mu, "k": sigma, "k0": sigma0}
        path = run(ap.Scene(system=system, values=values, start=dict(zip("pqw", start, strict=True)), until=until))
        assert (path.modes, [e.kind for e in path.events]) == (known.modes, [e.kind for e in known.events])
        size = max(1, *(abs(w) for e in known.events for w in (e.x, e.z)), *map(abs, start), abs(known.final[0]))
        assert max(abs(path.final[i] - known.final[i]) for i in (0, 2)) < 1e-13 * size


def test_digits_agree_with_the_kernel_of_the_rod():
    scene = ap.Scene(sigma=1, mu="1/1000", start=(0, "1/5", -1), until=5)
    values = {"eps": "1/1000", "k": 1, "k0": 1}
    other = ap.Scene(system=rod(), values=values, start={"p": 0, "q": "1/5", "w": -1}, until=5)
    for digits in (15, 50, 300):
        known, path = ap.solve(scene, digits=digits), run(other, digits=digits)
        assert all(abs(a - b) < mpmath.mpf(10) ** (2 - digits) for a, b in zip(known.final, path.final, strict=True))
        assert path.error < mpmath.mpf(10) ** -digits


def test_a_path_is_dense_and_continuous_at_its_events():
    system = rod()
    scene = ap.Scene(system=system, values={"eps": 1e-4, "k": 1, "k0": 1}, start={"p": 0, "q": 0.2, "w": -1}, until=5)
    path = run(scene)
    times = np.array([e.t for e in path.events])
    states = np.array([e.state for e in path.events])
    assert np.abs(path(times).T - states).max() < 1e-9
    assert path(np.array([[0.0, 5.0]]))[:, 0, 1] == pytest.approx(path.final, rel=1e-15)
    assert path(0.0) == pytest.approx((0, 0.2, -1))


@pytest.mark.parametrize("options", [{}, {"digits": 20}, {"method": "lsoda"}])
def test_a_path_reads_its_times_as_numbers_and_none_of_them_is_none(options):
    path = spring(1, {"x": 3, "v": -1}, 1, **options)
    assert path([]).shape == (2, 0)
    assert path(np.zeros((2, 0, 3))).shape == (2, 2, 0, 3)
    assert path(["1/4", "1/2"])[:, 0] == pytest.approx(path("0.25"), rel=1e-12)
    for hostile in ([0.5 + 1j], np.ma.array([0.0, 1.0], mask=[True, False]), [[0, 1], [1]], True):
        with pytest.raises(InputError, match="t "):
            path(hostile)


def test_a_system_that_is_nearly_affine_goes_to_an_integrator_and_the_path_says_so():
    x, v = sp.symbols("x v", real=True)
    nearly = ap.System.with_frictions(
        {x: v, v: -x - x**3 / 10**9 + F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 10))]
    )
    path = ap.solve(ap.Scene(system=nearly, values={}, start={"x": 1, "v": 0}, until=1))
    assert path.model == "lsoda"
    assert path.info["why"].startswith("in mode slip_same the rate of v is not affine: ")
    assert "x**3" in repr(path)
    assert "why" not in spring(1, {"x": 3, "v": -1}, 1).info


@pytest.mark.parametrize("nothing", [sp.sin(t) ** 2 + sp.cos(t) ** 2 - 1, (1 + t) ** 2 - t**2 - 2 * t - 1])
def test_forces_that_cancel_at_all_times_leave_a_system_affine(nothing):
    x, v = sp.symbols("x v", real=True)
    oscillator = ap.System.smooth(slow={x: v, v: -x + nothing}, fast={}, small=None, time=t)
    path = ap.solve(ap.Scene(system=oscillator, values={}, start=[1, 0], until=1))
    assert path.model == "exact"
    assert path.final == pytest.approx((np.cos(1), -np.sin(1)), rel=1e-15)


@pytest.mark.parametrize(
    "bend", [lambda x, v: sp.sin(x) * v, lambda x, v: sp.sqrt(x**2 + v**2), lambda x, v: sp.sin(t**2) * x]
)
def test_a_long_rate_that_is_not_affine_is_told_by_numbers_and_not_by_derivatives(bend, monkeypatch):
    x, v = sp.symbols("x v", real=True)
    long = sum(sp.cos(sp.Rational(k, 7)) ** k for k in range(1, 40)) * bend(x, v)
    mode = mode_of(ap.System.smooth({x: v, v: long}, {}, None, time=t), ())
    derived = sp.Expr.diff
    monkeypatch.setattr(sp.Expr, "diff", lambda e, *at: derived(e, *at) if e is not mode.rates[1] else 1 / 0)
    assert mode_obstacle(mode).startswith("in mode smooth the rate of v is not affine: ")


def test_powers_of_parameters_are_not_expanded_to_tell_that_a_rate_is_not_affine(monkeypatch):
    x, p = sp.symbols("x p", real=True)
    steep = (1 + p / 10**4) ** (10**4)
    mode = mode_of(ap.System.smooth({x: -(x**2) * steep}, {}, None), ())
    monkeypatch.setattr(sp, "cancel", lambda e: 1 / 0)  # to expand the power takes hours
    assert mode_obstacle(mode).startswith("in mode smooth the rate of x is not affine: ")


def test_a_long_rate_that_is_affine_is_not_told_to_bend():
    x, v = sp.symbols("x v", real=True)
    long = sum(sp.cos(sp.Rational(k, 7)) ** k for k in range(1, 16)) * (x - v / 2 + sp.cos(t))
    assert mode_obstacle(mode_of(ap.System.smooth({x: v, v: long}, {}, None, time=t), ())) is None


def nearly_defective(x, v, gap):
    """Yield systems whose eigenvalues come within ``gap`` of each other, or of the forcing's."""
    frictions = [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 4))]
    yield {x: v, v: 1 - gap * x + F}, frictions
    yield {x: v, v: -x - (2 - gap) * v + F}, frictions
    yield {x: v, v: -x + 3 * sp.cos((1 + gap) * t) + F}, frictions


@pytest.mark.slow
@pytest.mark.parametrize("gap", ["1/1000", "1/1000000000000"])
def test_eigenvalues_that_nearly_coincide_cost_time_but_no_digits(gap):
    x, v = sp.symbols("x v", real=True)
    for rates, frictions in nearly_defective(x, v, sp.Rational(gap)):
        system = ap.System.with_frictions(rates, {}, frictions, time=t)
        scene = ap.Scene(system=system, values={}, start={"x": 2, "v": -1}, until=8)
        path, true = ap.solve(scene), ap.solve(scene, digits=30)
        assert path.modes == true.modes
        size = max(abs(float(w)) for w in true.final)
        assert max(abs(a - b) for a, b in zip(path.final, true.final, strict=True)) < 1e-14 * size


def test_the_quick_decision_is_the_automatons():
    system, random = rod(), np.random.default_rng(8)
    decided = 0
    for _ in range(6):
        values = (float(10 ** random.uniform(-4, -1)), *sorted(random.uniform(-1.5, 2, 2).tolist()))
        automaton = Automaton(system, values)
        swift = flows(automaton).swift
        for _ in range(30):
            loaded = random.uniform(-2, 2, 2) * random.integers(0, 4)
            start = (*loaded.tolist(), float(random.choice([0, random.uniform(-1, 1)])))
            branch = automaton.first(start)
            assert swift.first(start) == branch
            for hit, (kind, _) in enumerate(automaton.mode(branch).kinds):
                struck = automaton.mode(branch).snapped(hit, 0.0, start)
                try:
                    after = automaton.next(branch, (hit,), 0.0, struck)
                except AsympkError:
                    continue
                assert swift.next(branch, (hit,), 0.0, struck, 2.0**-48) == after, kind
                decided += 1
    assert decided > 100


def test_blocks_that_share_no_force_are_decided_by_products_though_static_friction_is_larger(monkeypatch):
    """Once its decisions are known, a chain of blocks on a belt asks the automaton no more."""
    (a, b, c), (u, v, w) = sp.symbols("a b c", real=True), sp.symbols("u v w", real=True)
    forces, tenth = sp.symbols("F G H", real=True), sp.Rational(1, 10)
    pulls = zip((2 * (b - a) - a, 2 * (a - 2 * b + c), 2 * (b - c)), forces, strict=True)
    rates = {a: u, b: v, c: w} | {s: pull + force for s, (pull, force) in zip((u, v, w), pulls, strict=True)}
    blocks = [ap.Friction(s - tenth, force, load=1, kinetic=sp.S.Half, static=1)
              for s, force in zip((u, v, w), forces, strict=True)]
    scene = ap.Scene(system=ap.System.with_frictions(rates, {}, blocks), start={**dict.fromkeys(rates, 0), b: tenth},
                     until=20)
    known, *_ = [ap.solve(scene) for _ in range(6)]
    monkeypatch.setattr(decide, "follow_on", lambda *_: pytest.fail("the automaton was asked"))
    again = ap.solve(scene)
    assert (again.modes, again.final) == (known.modes, known.final)
    assert len(again.events) > 8


def spring(k, start, until, **options):
    x, v = sp.symbols("x v", real=True)
    stiffness = sp.Symbol("k")
    system = ap.System.with_frictions(
        {x: v, v: -stiffness * x + F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 4))]
    )
    return ap.solve(ap.Scene(system=system, values={"k": k}, start=start, until=until), **options)


def test_all_numbers_of_a_path_in_doubles_are_floats_of_python():
    path = spring(1, {"x": 3, "v": -1}, 9)
    found = [path.error, *path.final, *(w for event in path.events for w in (event.t, *event.state))]
    assert path.events
    assert {*map(type, found)} == {float}


def test_a_scene_of_no_length_ends_where_it_starts():
    assert spring(1, {"x": 3, "v": -1}, 0).final == (3.0, -1.0)
    assert spring(1, {"x": 3, "v": -1}, 0, digits=30).final == (3, -1)


@pytest.mark.parametrize("size", [1e60, 1e200, 1e300])
@pytest.mark.parametrize("options", [{}, {"digits": 20}])
@pytest.mark.few(2)
def test_a_huge_motion_is_a_large_one_in_other_units(size, options):
    x, v = sp.symbols("x v", real=True)
    friction = ap.Friction(velocity=v, force=F, load=2 + x / 4, kinetic=sp.Rational(1, 4))
    system = ap.System.with_frictions({x: v, v: -x + F}, {}, [friction])

    def path(size):
        return ap.solve(ap.Scene(system=system, values={}, start={"x": 1, "v": -size}, until=8), **options)

    large, huge = path(1e15), path(size)
    assert huge.modes == large.modes
    assert len(huge.events) > 5
    assert [float(e.t) for e in huge.events] == pytest.approx([float(e.t) for e in large.events], rel=1e-12, abs=1e-13)
    assert [float(w) / size for w in huge.final] == pytest.approx([float(w) / 1e15 for w in large.final], rel=1e-12)


@pytest.mark.parametrize("rate", [10**5, 10**11])
def test_a_layer_that_died_long_ago_keeps_its_digits_in_digits(rate):
    x, v = sp.symbols("x v", real=True)
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=1)
    system = ap.System.with_frictions({x: -rate * x, v: F}, {}, [friction])
    path = ap.solve(ap.Scene(system=system, values={}, start={"x": 1, "v": 1}, until=2), digits=30)
    assert [(e.kind, e.t) for e in path.events] == [("velocity_zero", 1)]
    with mpmath.workdps(40):
        assert mpmath.log(path.final[0]) == pytest.approx(-2 * rate, rel=1e-28)


def test_what_cannot_be_followed_is_refused_in_one_line():
    with pytest.raises(ValueError, match="from 1 to 1000"):
        spring(1, {"x": 3, "v": -1}, 1, digits=0)
    with pytest.raises(RuntimeError, match="limit of 5 events"):
        spring(1, {"x": 100, "v": 0}, 1000, events=5)
    with pytest.raises(OverflowError, match="take a smaller until"):
        spring(-10**8, {"x": 1, "v": 0}, 5)
    with pytest.raises(ValueError, match="from 0 to until"):
        spring(1, {"x": 3, "v": -1}, 1)(2.0)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "model", "why"), [
    (63, "exact", None), (64, "lsoda", "a mode has 65 states, forcing included: the exact flow takes 64")])
def test_more_states_than_the_exact_flow_takes_go_to_the_integrator_which_says_why(count, model, why):
    decays = {s: -(k + 1) * s / 64 for k, s in enumerate(sp.symbols(f"x0:{count}", real=True))}
    path = ap.solve(ap.Scene(system=ap.System.smooth(decays, {}, None), start=dict.fromkeys(decays, 1), until=1))
    assert (path.model, path.info.get("why")) == (model, why)
    assert [*map(float, path.final)] == pytest.approx([*np.exp(-np.arange(1, count + 1) / 64)], abs=1e-9)


@pytest.mark.parametrize("until", ["0.1", "1/3", "0.7"])
def test_a_path_knows_its_end_under_the_double_next_to_it(until):
    path = spring(1, {"x": 3, "v": -1}, until)
    assert path(float(Fraction(until))) == pytest.approx(path.final, rel=1e-14)
    assert path([0.0, path.end])[:, 1] == pytest.approx(path.final, rel=1e-14)


def test_a_path_survives_pickling():
    import pickle

    path = spring(1, {"x": 5, "v": 0}, 20)
    assert pickle.loads(pickle.dumps(path))(3.0) == pytest.approx(path(3.0), rel=0)


@pytest.mark.parametrize("digits", [None, 20])
def test_a_block_that_stops_exactly_at_the_end_is_followed_to_it(digits):
    """v' = -1 from v = 1."""
    x, v, F = sp.symbols("x v F", real=True)
    block = ap.System.with_frictions({x: v, v: F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=1)])
    path = ap.solve(ap.Scene(system=block, start={"x": 0, "v": 1}, until=1), digits=digits)
    assert path.modes == ("slip_same", "stick")
    assert [float(w) for w in path.final] == [0.5, 0]


@pytest.mark.parametrize("until", [30, 32, 34, 36, 700, 2000])
def test_a_block_that_slows_down_for_ever_does_not_stop_at_the_end(until):
    """Its velocity is e^-t, and within rounding at the end; the pull w, a state, is all that friction bears."""
    x, y, v, w, F = sp.symbols("x y v w F", real=True)
    block = ap.System.with_frictions({x: v, y: 1, v: w - v + F, w: 0}, {},
                                     [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half)])
    path = ap.solve(ap.Scene(system=block, start={"x": 0, "y": 0, "v": 1, "w": "1/2"}, until=until))
    assert path.modes == ("slip_same",)
    assert path.final == pytest.approx((-np.expm1(-until), until, np.exp(-until), 0.5), rel=1e-14)


def test_a_velocity_that_is_below_0_for_a_moment_only_is_not_taken_for_one_that_decays(monkeypatch):
    """The first block turns by 1e-16 only, and its velocity rises again where its fall is shown."""
    x, y, v, w, F, G = sp.symbols("x y v w F G", real=True)
    frictions = [ap.Friction(v, F, load=1, kinetic=sp.S.Half), ap.Friction(w, G, load=1, kinetic=sp.S.Half)]
    chain = ap.System.with_frictions({x: v, v: F - x + y / 2, y: w, w: G - y + x / 2}, {}, frictions)
    working = list[int]()
    monkeypatch.setattr("asympk.affine.run.set_digits", lambda m, n, tie: set_digits(m, n, tie) or working.append(n))
    path = ap.solve(ap.Scene(system=chain, start=(1.2000000000000002, 0, 0.8000000000000003, 0), until=20), digits=20)
    assert max(working) < 100
    assert [event.kind for event in path.events] == ["slip_onset", "velocity_zero", "velocity_zero"]


def test_a_block_that_rests_at_zero_is_followed_in_digits_without_an_error():
    """The errors are relative to the largest state, which is 0."""
    x, v, F = sp.symbols("x v F", real=True)
    block = ap.System.with_frictions({x: v, v: F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=1)])
    path = ap.solve(ap.Scene(system=block, start={"x": 0, "v": 0}, until=1), digits=20)
    assert (path.modes, path.final, path.error) == (("stick",), (0, 0), 0)


@pytest.mark.parametrize("sides", [(1, 1), (1, -1)])
def test_two_blocks_that_move_in_symmetry_stop_together(sides):
    """Both on springs, joined by a spring: each moves as one block does, on a spring of the stiffness 1 or 3."""
    x1, x2, v1, v2, F, G = sp.symbols("x1 x2 v1 v2 F G", real=True)
    frictions = [ap.Friction(velocity=v, force=f, load=1, kinetic=1) for v, f in ((v1, F), (v2, G))]
    pair = ap.System.with_frictions({x1: v1, x2: v2, v1: x2 - 2 * x1 + F, v2: x1 - 2 * x2 + G}, {}, frictions)
    start = {"x1": 5 * sides[0], "x2": 5 * sides[1], "v1": 0, "v2": 0}
    path = ap.solve(ap.Scene(system=pair, start=start, until=4))
    stiffness = 2 - sides[0] * sides[1]
    alone = ap.System.with_frictions({x1: v1, v1: -stiffness * x1 + F}, {}, frictions[:1])
    single = ap.solve(ap.Scene(system=alone, start={"x1": 5 * sides[0], "v1": 0}, until=4))
    assert [event.t for event in path.events] == pytest.approx([event.t for event in single.events])
    x, _, v, _ = path.final
    assert path.final == pytest.approx((x, sides[0] * sides[1] * x, v, sides[0] * sides[1] * v), abs=1e-15)
    assert (x, v) == pytest.approx(single.final)


def test_a_mass_in_two_brakes_rests_up_to_the_sum_of_their_static_bounds_however_often_it_is_asked():
    x, v, F, G = sp.symbols("x v F G", real=True)
    kinetic, bounds = sp.S.Half, ((F, 1), (G, 2))
    pads = [ap.Friction(velocity=v, force=force, load=load, kinetic=kinetic, static=1) for force, load in bounds]
    brake = ap.System.with_frictions({x: v, v: -x + F + G}, {}, pads)
    for place in (0, 1, 2, 3, 3, "5/2", 3):
        path = ap.solve(ap.Scene(system=brake, values={}, start={"x": place, "v": 0}, until=4))
        assert path.modes == ("stick+stick",)
        assert path.final == path.scene.start
    places = np.linspace(-4, 4, 33)
    ends = np.where(abs(places) <= 3, places, 3 * np.sign(places) - places)
    many = ap.solve_many(system=brake, values={}, start={"x": places, "v": 0}, until=4)
    assert many.final[0] == pytest.approx(ends, abs=1e-12)


def test_a_load_that_dies_away_within_a_layer_is_followed_without_a_word():
    """y decays by exp(-(1 + f) t / mu) to 1e-565, and the rounding of the clock is told by no double then."""
    y, v, f = sp.symbols("y v f", real=True)
    mu = sp.Symbol("mu", positive=True)
    layer = ap.System.with_friction({}, {y: F - y}, {v: 1 - y + F}, F, load=y, kinetic=f, small=mu)
    path = ap.solve(ap.Scene(system=layer, values={f: "0.3", mu: "1e-3"}, start={"y": "0.3", "v": "0.3"}, until=2))
    assert path.final == pytest.approx([0, 2.2997], abs=1e-15)


@pytest.mark.slow
def test_modes_that_rounding_alone_makes_consistent_are_told_apart_by_more_digits():
    # the load falls through 0 with a rate of order 1, which is 1/mu times a sum that cancels to 3e-14
    x, u, w, v, y = sp.symbols("x u w v y", real=True)
    mu, q = sp.Symbol("mu", positive=True), sp.Rational
    slow = {x: 17 * u / 100 + y, u: 79 * u / 100 + v + 4 * x / 25, w: 17 * u / 20 - 4 * w / 25,
            v: F - 17 * u / 100 - 11 * w / 100 - x - y + q(117, 100)}
    contact = ap.Friction(velocity=v + q(9, 50), force=F, load=x + y, kinetic=q(16, 5))
    fast = {y: F - 11 * u / 100 - 11 * w / 50 - 2 * x - 2 * y + 1}
    system = ap.System.with_frictions(slow, fast, [contact], small=mu)
    start = {x: q(127, 100), u: q(2, 25), w: q(3, 50), v: q(37, 25), y: q(1, 4)}
    scene = ap.Scene(system=system, values={mu: "7e-14"}, start=start, until="3.7")
    path, fine = ap.solve(scene), ap.solve(scene, digits=40)
    assert path.modes == fine.modes == ("slip_same", "slip_opposite", "stick", "slip_same")
    assert [float(e.t) for e in path.events] == pytest.approx([float(e.t) for e in fine.events], rel=1e-14)


def linear_scene(rows, start, until=1):
    states = sp.symbols(f"y0:{len(rows)}", real=True)
    rates = {s: sum(sp.Rational(c) * w for c, w in zip(row, states, strict=True))
             for s, row in zip(states, rows, strict=True)}
    system = ap.System.with_frictions(rates, {}, [])
    return ap.Scene(system=system, start=dict(zip(states, start, strict=True)), until=until)


@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.parametrize("apart", [Fraction(1, 10**10), Fraction(1, 10**60), Fraction(1, 2**200), Fraction(1, 10**120)])
@pytest.mark.few(2)
def test_eigenvalues_much_nearer_to_one_another_than_the_digits_in_use_lose_nothing(apart, digits):
    # the coefficients are sums of terms of the size 1/apart, which cancel; in powers of two they cancel without a rest
    for rows in ([[-1, 1], [apart**2, -1]], [[-1, 1], [0, -1 - apart]], [[-1, 1], [-(apart**2), -1]]):
        final = ap.solve(linear_scene(rows, (1, 2)), digits=digits).final
        with mpmath.workdps(400):
            d, small = mpmath.mpf(apart.numerator) / apart.denominator, rows[1][0]
            sinh, cosh = (mpmath.sin(d), mpmath.cos(d)) if small < 0 else (mpmath.sinh(d), mpmath.cosh(d))
            true = (cosh + 2 * sinh / d, 2 * cosh + sinh * d * mpmath.sign(small)) if small else (
                1 - 2 * mpmath.expm1(-d) / d, 2 * mpmath.exp(-d))
            true = [w * mpmath.exp(-1) for w in true]
            assert all(abs(a - b) < (1e-15 if digits is None else mpmath.mpf(10) ** -30)
                       for a, b in zip(final, true, strict=True))


def test_eigenvalues_that_no_number_of_bits_in_use_tells_apart_are_refused_by_name(monkeypatch):
    from asympk.affine import exponential

    monkeypatch.setattr(exponential, "_MOST_BITS", 200)
    rows = AffineMode(((-1, 1, 0), (0, -1 - Fraction(1, 10**70), 0))).homogeneous
    scene = linear_scene([[-1, 1], [0, -1 - Fraction(1, 10**71)]], (1, 2))
    for refused in (lambda: exponential.exponential(rows, exponential.DIGITS_FOR_DOUBLES), lambda: ap.solve(scene)):
        with pytest.raises(AsympkError, match="eigenvalues of a mode are too near to one another for 317 bits"):
            refused()


def test_two_real_eigenvalues_are_no_pair_with_no_frequency_however_few_bits_tell_them_apart():
    with mpmath.workdps(400):
        d = mpmath.mpf(10) ** -300
        true = (mpmath.exp(-1) * (1 - 2 * mpmath.expm1(-d) / d), 2 * mpmath.exp(-1 - d))
    final = ap.solve(linear_scene([[-1, 1], [0, -1 - Fraction(1, 10**300)]], (1, 2)), digits=30).final
    assert all(abs(a - b) < mpmath.mpf(10) ** -30 for a, b in zip(final, true, strict=True))


def test_a_table_of_decisions_is_not_made_of_flows_that_doubles_do_not_hold():
    # the eigenvalues of slip are 1e-310 apart, so that the terms of its flow are beyond the range of doubles
    v, w, force = sp.symbols("v w F", real=True)
    apart = sp.Rational(1, 10**310)
    system = ap.System.with_frictions({w: v - w, v: force - (1 + apart) * v}, {}, [ap.Friction(v, force, 1, 1)])
    scene = ap.Scene(system=system, values={}, start=[1, 0], until=2)
    assert {ap.solve(scene).modes for _ in range(8)} == {("stick",)}


p = sp.Symbol("p", positive=True)


@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.parametrize(
    ("coefficient", "value", "limit"),
    [(sp.log(1 + p) / p, "1e-90", 1), (p / sp.log(1 + p), "1e-90", 1), ((1 - sp.cos(p)) / p**2, "1e-40", 0.5),
     ((1 - sp.tanh(p)) * sp.exp(2 * p) / 2, 100, 1)],
)
def test_a_part_of_a_coefficient_that_cancels_to_its_last_digit_counts_where_a_large_part_multiplies_it(
    coefficient, value, limit, digits
):
    system = ap.System.with_frictions({F: -coefficient * F}, {}, [])
    (final,) = ap.solve(ap.Scene(system=system, values={p: value}, start={F: 1}, until=1), digits=digits).final
    assert float(final) == pytest.approx(np.exp(-limit), rel=1e-15)


def test_parts_of_a_coefficient_that_take_too_many_digits_are_refused_by_name():
    system = ap.System.with_frictions({F: -sp.sinh(p) / sp.cosh(p + 1) * F}, {}, [])
    with pytest.raises(AsympkError, match=r"parts so large or small that it takes .* digits"):
        ap.solve(ap.Scene(system=system, values={p: "1e6"}, start={F: 1}, until=1))


def test_rates_too_slow_for_doubles_warn_of_nothing():
    scene = linear_scene([[0, 1], [0, -Fraction(1, 10**320)]], (1, 2))
    assert ap.solve(scene).final == pytest.approx((3, 2), abs=1e-15)
    assert np.isfinite(next(Mesh([Block(-1e-320, 0.0, 1)]).windows()).t).all()


def test_a_coefficient_that_is_complex_at_the_given_numbers_is_refused():
    x, q = sp.symbols("x q", real=True)
    system = ap.System.smooth({x: -x * sp.sqrt(q - 1)}, {}, None)
    with pytest.raises(OutOfRange, match="not a real number at these parameters"):
        ap.solve(ap.Scene(system=system, values={q: 0}, start={x: 1}, until=1))


def test_where_rounding_shows_a_run_whose_order_of_events_is_known_is_followed_in_digits_once(monkeypatch):
    """Friction turns in every half period: of the modes that follow, doubles tell all but the first few."""
    runs, decided, followed, law = [], [], affine_run._followed, Automaton.next
    monkeypatch.setattr(affine_run, "_followed", lambda m, *rest: runs.append(m) or followed(m, *rest))
    monkeypatch.setattr(Automaton, "next", lambda *given: decided.append(given) or law(*given))
    x, v, f, V = sp.symbols("x v f V", real=True)
    belt = ap.System.with_frictions({x: v, v: -x + F}, {}, [ap.Friction(v - V, F, 1, f, 3 * f / 2)])
    scene = ap.Scene(system=belt, values={f: "0.7", V: "0.3"}, start=(0, 0), until=150)
    path = run(scene)
    assert [m is Doubles for m in runs] == [True, False]
    assert len(path.events) > 30 > 20 > len(decided)
    precise = run(scene, digits=40)
    assert path.modes == precise.modes
    assert [e.t for e in path.events] == [float(e.t) for e in precise.events]
    assert path.final == tuple(map(float, precise.final))


def test_weights_of_close_eigenvalues_leave_few_intervals_in_which_a_guard_may_fall(monkeypatch):
    """Those of a relay behind three lags that are nearly the same are some hundred times as large as the guard."""
    looks, isolated = [], events._isolated
    monkeypatch.setattr(events, "_isolated", lambda *given: looks.append(1) or isolated(*given))
    y = sp.symbols("y1:4", real=True)
    rates = {y[0]: F - y[0], y[1]: sp.Rational(11, 10) * (y[0] - y[1]), y[2]: sp.Rational(23, 20) * (y[1] - y[2])}
    relay = ap.System.with_frictions(rates, {}, [ap.Friction(y[2], F, 1, 1)])
    path = ap.solve(ap.Scene(system=relay, start=(1, 0, -1), until=40))
    assert len(looks) < len(path.events) > 10


@pytest.mark.parametrize("digits", [None, 30])
def test_of_a_relay_on_which_no_force_acts_at_once_doubles_tell_the_mode_that_follows(digits, monkeypatch):
    """Its velocity has the same rate in every mode: no rest goes on where this rate is not 0."""
    decided, law = [], Automaton.next
    monkeypatch.setattr(Automaton, "next", lambda *given: decided.append(given) or law(*given))
    x, v, w = sp.symbols("x v w", real=True)
    relay = ap.System.with_frictions({x: v, v: w, w: -w - 3 * v - 2 * x + F}, {}, [ap.Friction(x, F, 1, 1)])
    path = ap.solve(ap.Scene(system=relay, start=("-0.7", 0, "0.2"), until=60), digits=digits)
    assert len(path.events) > 20 > 10 > len(decided)


def test_gradients_of_what_a_mode_keeps_are_looked_up_once_in_all_runs(monkeypatch):
    """Their directions are matrices of numbers, and to hash these at every event took half the time of long chains."""
    x, y, v, w, f, V = sp.symbols("x y v w f V", real=True)
    pair = [ap.Friction(rate - V, force, 1, f) for rate, force in ((v, F), (w, G))]
    chain = ap.System.with_frictions({x: v, y: w, v: y - 2 * x + F, w: x - 2 * y + G}, {}, pair)
    scene = ap.Scene(system=chain, values={f: "0.7", V: "0.3"}, start=("-1.9", "1.8", "0.3", 0), until=40)
    followed, asked, compiled = run(scene), [], NumericMode._compiled
    monkeypatch.setattr(NumericMode, "_compiled", lambda mode, outputs, along=(): (
        asked.extend([1] * (along == mode.mode.units)) or compiled(mode, outputs, along)))
    assert run(scene).events == followed.events
    assert followed.events
    assert not asked
