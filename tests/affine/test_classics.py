"""Classical oscillators, relays and clutches: numbers that their books give in closed form, from the affine flow."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.affine import run as affine_run
from asympk.errors import Accumulation, OutOfRange

x, v, u, w, F, G, t = sp.symbols("x v u w F G t", real=True)
f, fs, omega, zeta, V = sp.symbols("f f_s omega zeta V", positive=True)
N = sp.Symbol("N", real=True)

COULOMB = ap.System.with_frictions({x: v, v: -x + F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=f)])


def followed(system, values, start, until, **options):
    path = ap.solve(ap.Scene(system=system, values=values, start=start, until=until), **options)
    assert path.model == "exact"
    return path


@pytest.mark.parametrize("x0", ["5.3", "-7.05", "0.2", "20.3"])
def test_coulomb_oscillator_loses_two_f_in_every_half_period_and_rests_in_the_dead_zone(x0):
    """Coulomb friction: turning points x0 - 2 f n at the times n pi, rest where |x| <= f (Den Hartog 1956, 7.3)."""
    path = followed(COULOMB, {f: "0.35"}, {"x": x0, "v": 0}, 100)
    start, turns = abs(float(x0)), 0
    while start - 0.7 * turns > 0.35:
        turns += 1
    rest = np.sign(float(x0)) * (-1) ** turns * (start - 0.7 * turns)
    assert path.modes[-1] == "stick"
    assert [e.t for e in path.events] == pytest.approx([np.pi * n for n in range(1, turns + 1)], rel=1e-14)
    assert path.final == (pytest.approx(rest, abs=2e-14), 0.0)


@pytest.mark.parametrize("digits", [None, 20])
@pytest.mark.parametrize("beyond", ["1e-16", "1e-30"])
def test_a_start_less_than_a_rounding_beyond_the_dead_zone_swings_to_its_other_side_and_rests(beyond, digits):
    """In the working numbers x0 = f + beyond may be f, and the motion x - f = beyond cos t no motion at all."""
    path = followed(COULOMB, {f: 1}, {"x": 1 + Fraction(beyond), "v": 0}, 20, digits=digits)
    assert path.modes == ("slip_opposite", "stick")
    assert float(path.events[0].t) == np.pi
    assert float(path.final[0]) == float(1 - Fraction(beyond))


@pytest.mark.parametrize(("rate", "apart", "until"), [(1, 0, 700), (5, 0, 200), (5, "1e-6", 200), (5, "-2e-15", 200)])
def test_a_critically_damped_block_creeps_for_ever_to_where_friction_balances_the_spring(rate, apart, until):
    """Its velocity is -t e^(-w t)/2 times w^2, or a divided difference near it, and never 0: it has no event."""
    damped = {v: -(rate**2) * x - 2 * rate * (1 + sp.Rational(apart)) * v + F}
    system = ap.System.with_frictions({x: v, **damped}, {}, [ap.Friction(v, F, 1, f)])
    path = followed(system, {f: "1/2"}, {"x": 1, "v": 0}, until)
    assert path.modes == ("slip_opposite",)
    assert path.final == pytest.approx((0.5 / rate**2, 0), abs=1e-15)


@pytest.mark.parametrize("digits", [None, 50])
def test_irrational_frequencies_and_rates_that_are_equal_are_one(digits):
    """Resonance, critical damping, and critical damping under a force of its own rate, from x = 0 at the speed 1."""
    root, k, m = sp.sqrt(omega), *sp.symbols("k m", positive=True)
    cases = [
        ({v: -omega * x + sp.cos(root * t)}, {omega: 2}, lambda w, s: (1 + s / 2) * mpmath.sin(w * s) / w),
        ({v: -k / m * x - 2 * sp.sqrt(k / m) * v}, {k: 6, m: 3}, lambda w, s: s * mpmath.exp(-w * s)),
        ({v: -omega * x - 2 * root * v + sp.exp(-root * t)}, {omega: 2},
         lambda w, s: (s + s**2 / 2) * mpmath.exp(-w * s)),
    ]
    for rates, values, closed in cases:
        system = ap.System.with_frictions({x: v, **rates}, {}, [], time=t)
        path = followed(system, values, {"x": 0, "v": 1}, 5, digits=digits)
        with mpmath.workdps(60):
            assert abs(path.final[0] - closed(mpmath.sqrt(2), 5)) < 10.0 ** -(digits or 15)


@pytest.mark.parametrize(("slow", "fast"), [("2e-9", "1e10"), ("2e-4", "1e18"), ("2", "1e30")])
def test_slow_eigenvalues_are_not_equal_because_an_irrational_one_is_much_faster(slow, fast):
    """Beside an oscillator, which turns by 2, a filter has an irrational rate."""
    slow, fast = Fraction(slow), sp.Integer(Fraction(fast))
    rates = {x: v, v: -sp.Rational(slow) ** 2 * x, w: fast * (x - sp.sqrt(2) * w)}
    system = ap.System.with_frictions(rates, {}, [])
    assert abs(followed(system, {}, {"x": 1, "v": 0, "w": 0}, 2 / slow).final[0] - np.cos(2)) < 1e-15


@pytest.mark.parametrize("digits", [None, 50])
@pytest.mark.parametrize("swift", ["1e13", "1e26", "1e60"])
def test_slow_rates_stay_apart_however_swift_an_irrational_rate_beside_them_is(swift, digits):
    """Rates 0, 1 and 3, and sqrt(2) twice, beside sqrt(2) ``swift``."""
    root = sp.sqrt(omega)
    rates = {w: 1 - root * V * w, u: 1 - u, t: -3 * t, x: v, v: -omega * x - 2 * root * v}
    path = followed(ap.System.with_frictions(rates, {}, []), {omega: 2, V: swift}, (0, 0, 1, 0, 1), 2, digits=digits)
    with mpmath.workdps(60):
        s, e = mpmath.sqrt(2), mpmath.exp
        closed = 1 / (s * mpmath.mpf(swift)), 1 - e(-2), e(-6), 2 * e(-2 * s), (1 - 2 * s) * e(-2 * s)
        assert all(abs(a / b - 1) < 10.0 ** -(digits or 15) * 5 for a, b in zip(path.final, closed, strict=True))


@pytest.mark.parametrize("load", ["0.35", "-0.35"])
def test_a_load_of_either_sign_resists_as_much(load):
    """The turning points are 5.3 - 0.7 n; with a negative load the phase of forward sliding is slip_opposite."""
    block = ap.System.with_frictions({x: v, v: -x + F}, {}, [ap.Friction(velocity=v, force=F, load=N, kinetic=1)])
    path = followed(block, {N: load}, {"x": "5.3", "v": 0}, 7)
    forward, backward = ("slip_same", "slip_opposite")[:: 1 if float(load) > 0 else -1]
    assert path.modes == (backward, forward, backward)
    assert [e.state[0] for e in path.events] == pytest.approx([0.7 - 5.3, 5.3 - 1.4], rel=1e-15)
    starts = {"x": np.linspace(5.3, 6.3, 4), "v": 0}
    many = ap.solve_many(system=block, values={N: load}, start=starts, until=7)
    assert many.final[:, 0] == pytest.approx(path.final, rel=1e-14)
    assert many.alone == 0


@pytest.mark.parametrize("damping", [0, 10**12])
def test_the_size_of_the_states_is_a_matter_of_units(damping):
    """Rates of 1e312, beyond doubles, and a spectrum in which the friction is 1e299 times all else."""
    rates = {x: v, v: -x - damping * v + F}
    block = ap.System.with_frictions(rates, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=f)])
    usual = followed(block, {f: "0.1"}, {"x": 1, "v": 0}, 5).final
    huge = followed(block, {f: "1e299"}, {"x": "1e300", "v": 0}, 5).final
    assert [w / 1e300 for w in huge] == pytest.approx(usual, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize(
    ("push", "kinetic", "static", "load"), [("-1", 0, 1, 1), ("-1", 1, 1, 1), ("-0.3", "0.1", "0.1", 3)]
)
def test_a_block_that_friction_just_holds_stops_for_good_however_often_it_is_asked(push, kinetic, static, load):
    """It stops from the speed 1 at the rate of the push and of kinetic friction, and has no reason to leave."""
    mk, ms = sp.symbols("f_k f_s", nonnegative=True)
    friction = ap.Friction(velocity=v, force=F, load=N, kinetic=mk, static=ms)
    block = ap.System.with_frictions({x: v, v: u + F, u: sp.S.Zero}, {}, (friction,))
    still = ap.System.with_frictions({x: v, v: w + F}, {}, (friction,))
    rate = -sp.Rational(push) + sp.Rational(kinetic) * load
    for system, values, start in ((block, {}, {"u": push}), (still, {w: push}, {})):
        values |= {mk: kinetic, ms: static, N: load}
        for digits in (*(None,) * 6, 25):
            path = followed(system, values, {"x": 0, "v": 1, **start}, 5, digits=digits)
            assert path.modes == ("slip_same", "stick")
            assert float(path.final[0]) == pytest.approx(1 / (2 * rate), rel=1e-15)
        many = ap.solve_many(system=system, values=values, start={"x": 0.0, "v": np.ones(9), **start}, until=5)
        assert (many.final[1] == 0).all()


@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.few(1)
def test_a_block_that_friction_just_holds_for_ever_rests_beside_one_whose_drive_swings(digits):
    """Both drives are at the static bound 2: y stays there, and 2 cos 2t comes back to it at pi / 2 and goes on."""
    x, v, y, w, F, G, t = sp.symbols("x v y w F G t", real=True)
    blocks = [ap.Friction(rate, force, sp.S.One, 1, 2) for rate, force in ((v, F), (w, G))]
    system = ap.System.with_frictions({x: v, y: w, v: 2 * sp.cos(2 * t) + F, w: -2 * y + G}, {}, blocks, time=t)
    path = ap.solve(ap.Scene(system=system, start=(0, 1, 0, 0), until=4), digits=digits)
    assert set(path.modes) == {"stick+stick"}
    assert path.final == (0, 1, 0, 0)


@pytest.mark.parametrize("method", ["exact", "lsoda"])
@pytest.mark.parametrize("load", [N, N * sp.cos(t)])
def test_friction_without_load_is_no_friction(load, method):
    """There are not two motions, one for each sign of a load that has none."""
    friction = ap.Friction(velocity=v, force=F, load=load, kinetic=1)
    block = ap.System.with_frictions({x: v, v: 1 + F}, {}, (friction,), time=t)
    path = ap.solve(ap.Scene(system=block, values={N: 0}, start={"x": 0, "v": -1}, until=3), method=method)
    assert path.modes == ("slip_opposite", "slip_same")
    assert path.final == pytest.approx([1.5, 2], abs=1e-5)


def test_damped_coulomb_oscillator_overshoots_by_the_logarithmic_decrement():
    """x'' + 2 z x' + x = -+ f: |x| + f shrinks by exp(-z pi/sqrt(1 - z^2)) to the next turning point less f."""
    block = ap.System.with_frictions(
        {x: v, v: -x - 2 * zeta * v + F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=f)]
    )
    z, friction, turning = 0.125, 0.25, 4.0
    first = followed(block, {zeta: z, f: friction}, {"x": turning, "v": 0}, 10).events[0]
    decay = np.exp(-z * np.pi / np.sqrt(1 - z * z))
    assert first.t == pytest.approx(np.pi / np.sqrt(1 - z * z), rel=1e-15)
    assert first.state[0] == pytest.approx(friction - (turning - friction) * decay, rel=1e-14)


FORCED = ap.System.with_frictions(
    {x: v, v: -x + u + F, u: -omega * w, w: omega * u}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=f)]
)


@pytest.mark.parametrize(("ratio", "friction"), [("0.6", "0.2"), ("1.5", "0.3"), ("2.5", "0.1")])
def test_den_hartogs_forced_oscillator_repeats_its_non_stop_motion(ratio, friction):
    """Den Hartog (1931): amplitude^2 = V^2 - f^2 U^2, V = 1/(1 - b^2), U = sin(pi/b)/(b (1 + cos(pi/b)))."""
    b, r = float(ratio), float(friction)
    gain, drag = 1 / (1 - b * b), np.sin(np.pi / b) / (b * (1 + np.cos(np.pi / b)))
    amplitude = np.sqrt(gain**2 - (r * drag) ** 2)
    # with x = f + V cos(b t + p) + A cos t + B sin t after a turning point: V cos(p) = amplitude, V sin(p) = -f U
    phase = np.arctan2(-r * drag / gain, amplitude / gain)
    begin = {"x": amplitude, "v": 0, "u": np.cos(phase), "w": np.sin(phase)}
    path = followed(FORCED, {omega: ratio, f: friction}, begin, 2 * np.pi / b)
    assert path.final[0] == pytest.approx(amplitude, rel=1e-12)
    assert path(np.pi / b)[0] == pytest.approx(-amplitude, rel=1e-12)


def test_forced_at_resonance_without_friction_grows_like_t():
    smooth = ap.System.smooth({x: v, v: -x + sp.cos(t)}, {}, None, time=t)
    times = np.array([1.0, 10.0, 77.5, 300.0])
    path = followed(smooth, {}, {"x": 0, "v": 0}, 300)
    assert np.abs(path(times)[0] - times * np.sin(times) / 2).max() < 1e-12


@pytest.mark.parametrize("beside", [1e-3, 1e-12])
@pytest.mark.few(1)
def test_beside_resonance_no_more_digits_and_no_row_alone_are_needed(beside, monkeypatch):
    """It slips and sticks twice in every swing until it swings freely; the truth has forty digits."""
    frictional = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 4), static=sp.Rational(3, 10))
    system = ap.System.with_frictions({x: v, v: -x + F + sp.cos(omega * t)}, {}, [frictional], time=t)
    scene = ap.Scene(system=system, values={omega: 1 + beside}, start={"x": 0.1, "v": 0.3}, until=30)
    precise = ap.solve(scene, digits=40)
    monkeypatch.setattr(affine_run, "_rounded", None)
    path = ap.solve(scene)
    assert path.modes == precise.modes
    assert len(path.events) > 5
    assert [*path.final] == pytest.approx([*map(float, precise.final)], abs=2e-14)
    starts = {"x": np.linspace(0.1, 0.2, 20), "v": 0.3}
    many = ap.solve_many(system=system, values={omega: 1 + beside}, start=starts, until=30)
    assert many.alone == 0
    assert many.final[:, 0] == pytest.approx(path.final, abs=2e-14)


def test_a_state_that_is_small_by_chance_at_the_end_needs_no_more_digits(monkeypatch):
    """Beside resonance x swings beyond 10, and is 0.72 at the end: its error is that of 10."""
    smooth = ap.System.smooth({x: v, v: -x + sp.cos(omega * t)}, {}, None, time=t)
    monkeypatch.setattr(affine_run, "_rounded", None)
    path = followed(smooth, {omega: "1.03"}, {"x": 0, "v": 0}, 31)
    with mpmath.workdps(30):
        turn = mpmath.mpf("1.03")
        true = (mpmath.cos(31 * turn) - mpmath.cos(31)) / (1 - turn**2)
    assert abs(true) < 0.73
    assert np.abs(path(np.linspace(0, 31, 400))[0]).max() > 10
    assert abs(path.final[0] - true) < 5e-14


def test_states_that_are_all_small_at_the_end_of_large_swings_keep_their_digits():
    """Beside resonance x swings up to 95000, and is 1e-5 at the end, where v is -0.53: 1e-10 of v was lost."""
    smooth = ap.System.smooth({x: v, v: -x + 10**4 * sp.cos(omega * t)}, {}, None, time=t)
    path = followed(smooth, {omega: "1.1"}, {"x": 0, "v": 0}, "62.8318")
    with mpmath.workdps(30):
        turn, end = mpmath.mpf("1.1"), mpmath.mpf("62.8318")
        true = 10**4 * (mpmath.sin(end) - turn * mpmath.sin(turn * end)) / (1 - turn**2)
    assert path.error < 5e-14
    assert abs(path.final[1] - true) < 5e-14


@pytest.mark.parametrize("digits", [None, 60])
def test_forced_at_a_natural_frequency_that_is_a_root_it_grows_like_t(digits):
    root = sp.sqrt(f / fs)
    smooth = ap.System.smooth({x: v, v: -f / fs * x + sp.cos(root * t + V)}, {}, None, time=t)
    path = followed(smooth, {f: 3, fs: 2, V: "1/2"}, {"x": 0, "v": 0}, 7, digits=digits)
    with mpmath.workdps(70):
        turn, phase = mpmath.sqrt(mpmath.mpf(3) / 2), mpmath.mpf(1) / 2
        wave, still = mpmath.sin(7 * turn + phase), mpmath.sin(phase) * mpmath.sin(7 * turn)
        assert abs(path.final[0] - (7 * wave / turn - still / turn**2) / 2) < mpmath.mpf(10) ** -(digits or 14)


def test_a_block_on_a_rough_belt_sticks_and_slips_with_the_known_period():
    """Slip lasts 2 pi - 2 atan((f_s - f)/V), stick 2 (f_s - f)/V: the saw-tooth of the belt (Galvanetto, Bishop)."""
    belt = ap.System.with_frictions(
        {x: v, v: -x + F}, {}, [ap.Friction(velocity=v - V, force=F, load=1, kinetic=f, static=fs)]
    )
    slow, static, kinetic = 0.25, 1.5, 1.0
    path = followed(belt, {V: slow, fs: static, f: kinetic}, {"x": 0, "v": slow}, 80)
    onsets = [e.t for e in path.events if e.kind == "slip_onset"]
    lands = [e.t for e in path.events if e.kind == "velocity_zero"]
    slip = 2 * np.pi - 2 * np.arctan((static - kinetic) / slow)
    stick = 2 * (static - kinetic) / slow
    assert onsets[0] == pytest.approx(static / slow, rel=1e-14)
    assert np.diff(onsets) == pytest.approx(slip + stick, rel=1e-12)
    assert np.array(lands[:3]) - np.array(onsets[:3]) == pytest.approx(slip, rel=1e-12)


@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.parametrize("mirror", [1, -1])
def test_a_block_rides_on_a_shaken_table_along_a_rough_wall_that_both_velocities_meet_at_once(digits, mirror):
    """It rests on the table, which stops at every n pi: the wall's friction turns there, and no state can be moved."""
    frictions = ap.Friction(v - mirror * sp.sin(t), F, load=1, kinetic=f), ap.Friction(v / 3, G, load=1, kinetic=fs)
    block = ap.System.with_frictions({x: v, v: F + G}, {}, frictions, time=t)
    path = followed(block, {f: "1.5", fs: "0.4"}, {"x": 0, "v": 0}, 9, digits=digits)
    walls = ("slip_same", "slip_opposite") if mirror > 0 else ("slip_opposite", "slip_same")
    assert path.modes == tuple(f"stick+{walls[k]}" for k in (0, 1, 0))
    assert [(e.kind, e.friction) for e in path.events] == [("velocity_zero", 1)] * 2
    assert [float(e.t) for e in path.events] == pytest.approx([np.pi, 2 * np.pi], rel=1e-15)
    assert [*map(float, path.final)] == pytest.approx([mirror * (1 - np.cos(9)), mirror * np.sin(9)], rel=1e-14)


@pytest.mark.parametrize("digits", [None, 20, 30])
@pytest.mark.few(2)
def test_a_block_that_a_shaken_table_leaves_at_rest_on_a_wall_has_no_velocity_at_all(digits):
    """Table and wall stop at pi/2; from then on the wall's two frictions, 6/5 in all, hold 3/5 and a push below 1/2."""
    frictions = [ap.Friction(v, F, 1, f), ap.Friction(v, G, 1, fs), ap.Friction(v - sp.cos(t), N, 1, zeta)]
    block = ap.System.with_frictions({x: v, v: F + G + N - v / 10 + sp.sin(t) / 2}, {}, frictions, time=t)
    path = followed(block, {f: "0.7", fs: "0.5", zeta: "0.6"}, {"x": 0, "v": 1}, 8, digits=digits)
    turns = [np.pi / 2, 3 * np.pi / 2, 5 * np.pi / 2]
    assert [float(e.t) for e in path.events[1:]] == pytest.approx(turns, rel=1e-15)
    assert path.final == (path.events[1].state[0], 0)


@pytest.mark.parametrize("friction", ["0.3", "1.5"])
@pytest.mark.few(1)
def test_a_box_on_two_rigid_feet_that_a_wave_drives_moves_as_a_block_on_one(friction):
    """At f = 3/2 a foot alone would have no determined reaction, 3 - 2 f = 0; both together have theirs."""
    y, w, a, o, M = sp.symbols("y w a o M", real=True)
    rates = {x: v, v: F + G + sp.cos(t) / 2, y: w, w: N + M - 1, a: o, o: 2 * (F + G + M - N)}
    feet = [
        ap.Friction(v + o, force, n, f, gap=y + side * a, normal=n, constraint=sp.expand(rates[w] + side * rates[o]))
        for force, n, side in ((F, N, -1), (G, M, 1))
    ]
    box = ap.System.with_frictions(rates, {}, feet, time=t)
    block = ap.System.with_frictions({x: v, v: F + sp.cos(t) / 2}, {}, [ap.Friction(v, F, 1, f)], time=t)
    path = followed(box, {f: friction}, dict.fromkeys(map(str, rates), 0), 6)
    expected = followed(block, {f: friction}, {"x": 0, "v": 0}, 6)
    assert path.final == pytest.approx([*expected.final, 0, 0, 0, 0], abs=1e-14)


def test_clutches_in_a_row_lock_when_the_torques_say():
    """Rigid disks, constant torques: the relative speeds fall linearly, each clutch locks at its own time."""
    a, b, c = sp.symbols("a b c", real=True)
    frictions = ap.Friction(velocity=a - b, force=F, load=1, kinetic=f), ap.Friction(b - c, G, load=1, kinetic=fs)
    disks = ap.System.with_frictions({a: F, b: (G - F) / 2, c: -G / 4}, {}, frictions)
    path = followed(disks, {f: 1, fs: "0.5"}, {"a": 10, "b": 4, "c": 0}, 30)
    # before the first lock a' = -1, b' = 1/4, c' = 1/8; a - b = 6 locks at 6/(5/4); then 3 (a, b)' = -1/2
    first = 6 / 1.25
    speeds = 10 - first, 0 + first / 8
    second = first + (speeds[0] - speeds[1]) / (0.5 / 3 + 0.125)
    assert [e.t for e in path.events] == pytest.approx([first, second], rel=1e-14)
    assert path.final == pytest.approx([18 / 7] * 3, rel=1e-14)  # angular momentum


def half_period(matrix, column, row, guess):
    """Return h with ``row (1 + e^{A h})^-1 integral_0^h e^{A s} ds column = 0`` (Aastrom and Haegglund 1984)."""
    mp = mpmath.mp
    with mp.workdps(30):
        a, b, c, unit = mp.matrix(matrix), mp.matrix(column), mp.matrix(row), mp.eye(len(matrix))

        def miss(h):
            e = mp.expm(a * h)
            return (c.T * mp.inverse(unit + e) * mp.inverse(a) * (e - unit) * b)[0]

        return mp.findroot(miss, guess)


RELAYS = {
    "third order lag": ([[-1, 0, 0], [1, -1, 0], [0, 1, -1]], 2.0),
    "unequal lags": ([[-3, 0, 0], [1, -1, 0], [0, 2, -2]], 1.5),
}


@pytest.mark.parametrize("name", RELAYS)
@pytest.mark.few(1)
def test_relay_cycles_have_the_period_of_their_fixed_point_equation(name):
    matrix, guess = RELAYS[name]
    states = sp.symbols("y1:4", real=True)
    rates = [sum(a * s for a, s in zip(row, states, strict=True)) for row in matrix]
    rates[0] += F
    relay = ap.System.with_frictions(
        dict(zip(states, rates, strict=True)), {}, [ap.Friction(velocity=states[2], force=F, load=1, kinetic=1)]
    )
    h = half_period(matrix, [1, 0, 0], [0, 0, 1], guess)
    path = followed(relay, {}, dict(zip(states, (1, 0, -1), strict=True)), 80)
    gaps = np.diff([e.t for e in path.events])
    assert np.abs(gaps[-4:] - float(h)).max() < 1e-11


def test_the_twisting_algorithm_reaches_the_origin_in_the_known_time():
    """x'' = -r sgn x - s sgn x': |x'| at x = 0 shrinks by sqrt((r - s)/(r + s)) each half turn (Levant 1993)."""
    twisting = ap.System.with_frictions(
        {x: v, v: F + G}, {},
        [ap.Friction(velocity=x, force=F, load=1, kinetic=f), ap.Friction(velocity=v, force=G, load=1, kinetic=fs)],
    )
    r, s = 3.0, 1.0
    ratio = np.sqrt((r - s) / (r + s))
    half = 1 / (r + s) + 1 / np.sqrt((r + s) * (r - s))  # from x = 0 with |x'| = 1 to the next x = 0
    scene = ap.Scene(system=twisting, values={f: r, fs: s}, start={"x": 0, "v": 1}, until=50)
    with pytest.raises(Accumulation, match=f"accumulate at t = {half / (1 - ratio):.6g}"):
        ap.solve(scene)


def test_a_first_order_relay_slides_until_the_disturbance_wins():
    """x' = -sgn x + a sin(w t) reaches 0, slides while |a sin(w t)| < 1 and leaves at asin(1/a)/w."""
    amplitude = sp.Symbol("a", positive=True)
    relay = ap.System.with_frictions(
        {x: F + amplitude * sp.sin(omega * t)}, {}, [ap.Friction(velocity=x, force=F, load=1, kinetic=1)], time=t
    )
    path = followed(relay, {amplitude: 2, omega: "0.125"}, {"x": 0}, 10)
    assert path.modes == ("stick", "slip_same")
    assert path.events[0].t == pytest.approx(8 * np.pi / 6, rel=1e-14)
    with mpmath.mp.workdps(30):
        begin, end = 8 * mpmath.pi / 6, mpmath.mpf(10)
        true = 16 * (mpmath.cos(begin / 8) - mpmath.cos(end / 8)) - (end - begin)
    assert path.final[0] == pytest.approx(float(true), rel=1e-12)


def test_a_block_that_a_moving_spring_pulls_waits_for_the_static_bound():
    """x'' = V t - x - f: stick until V t = f_s, forcing polynomial in time."""
    pulled = ap.System.with_frictions(
        {x: v, v: V * t - x + F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=f, static=fs)], time=t
    )
    path = followed(pulled, {V: "0.5", f: "0.75", fs: 1}, {"x": 0, "v": 0}, 3)
    # slip from tau = t - 2: x = 1/4 (1 - cos tau) + (tau - sin tau)/2
    assert path.events[0].t == pytest.approx(2.0, rel=1e-15)
    assert path.final[0] == pytest.approx((1 - np.cos(1)) / 4 + (1 - np.sin(1)) / 2, rel=1e-13)


@pytest.mark.parametrize("digits", [None, 30])
def test_a_block_thrown_on_a_belt_that_speeds_up_evenly_slides_until_they_are_as_fast_and_rides_on(digits):
    """Rough enough to ride, it loses f in speed until 1 - f t = t/2; what the belt does is forcing in slip alone."""
    friction = ap.Friction(velocity=v - t / 2, force=F, load=1, kinetic=f)
    belt = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    path = followed(belt, {f: 1}, {"x": 0, "v": 1}, 2, digits=digits)
    assert path.modes == ("slip_same", "stick")
    assert float(path.events[0].t) == pytest.approx(2 / 3, rel=1e-15)
    assert [*map(float, path.final)] == pytest.approx([4 / 3, 1], rel=1e-15)
    assert float(path.error) < 1e-15


def test_a_sliding_block_stops_after_the_time_and_the_distance_of_the_textbook():
    slide = ap.System.with_frictions({x: v, v: F}, {}, [ap.Friction(velocity=v, force=F, load=1, kinetic=f)])
    path = followed(slide, {f: "0.3"}, {"x": 0, "v": 2}, 100)
    assert path.events[0].t == pytest.approx(2 / 0.3, rel=1e-15)
    assert path.final[0] == pytest.approx(4 / 0.6, rel=1e-15)


def test_two_oscillators_that_turn_at_the_same_instant_are_followed_together():
    y = sp.Symbol("y", real=True)
    frictions = ap.Friction(v, F, load=1, kinetic=f), ap.Friction(w, G, load=1, kinetic=f)
    pair = ap.System.with_frictions({x: v, v: -x + F, y: w, w: -y + G}, {}, frictions)
    path = followed(pair, {f: "0.25"}, {"x": "2.1", "v": 0, "y": "3.1", "w": 0}, 20)
    assert path.events[0].t == pytest.approx(np.pi, rel=1e-15)
    assert path.modes[-1] == "stick+stick"
    assert path.final == pytest.approx((0.1, 0, 0.1, 0), abs=1e-13)


def test_a_smooth_system_is_followed_as_well_the_tenth_time_as_the_first():
    scene = ap.Scene(system=ap.System.smooth({x: -x}, {}, None), values={}, start={"x": 1}, until=2)
    assert [ap.solve(scene).final for _ in range(10)] == [pytest.approx((np.exp(-2),), rel=1e-15)] * 10


@pytest.mark.parametrize("contacts", [1, 3])
@pytest.mark.parametrize("compliance", ["1e-12", "1e-40", "1e-120"])
def test_a_block_slides_on_its_elastic_feet_however_stiff_these_are(contacts, compliance):
    """Feet of the stiffness 1/c push with 1 each and rub a block of the mass 1 with 1/2 each; w is its height."""
    c = sp.Symbol("c", positive=True)
    feet, closing, forces = (sp.symbols(f"{name}0:{contacts}", real=True) for name in ("x", "y", "F"))
    loads = [a + b for a, b in zip(feet, closing, strict=True)]
    fast = {b: 1 - load for b, load in zip(closing, loads, strict=True)}
    rubbing = [ap.Friction(v, *pair, kinetic=sp.S.Half) for pair in zip(forces, loads, strict=True)]
    slow = {x: v, v: sum(forces), w: -c * closing[0], **dict(zip(feet, closing, strict=True))}
    block = ap.System.with_frictions(slow, fast, rubbing, small=c)
    start = {s: {v: contacts, **dict.fromkeys(feet, 1)}.get(s, 0) for s in block.states}
    path = followed(block, {c: compliance}, start, 1)
    assert path.final[:2] == pytest.approx((0.75 * contacts, 0.5 * contacts), abs=1e-14)


def test_a_compliance_below_the_doubles_is_refused_in_a_line():
    c = sp.Symbol("c", positive=True)
    block = ap.System.with_friction({x: u}, {u: 1 - x - u}, {v: F}, force=F, load=x + u, kinetic=1, small=c)
    with pytest.raises(OutOfRange):
        ap.solve(ap.Scene(system=block, values={c: "1e-400"}, start=(1, 0, 1), until="1/2"))


@pytest.mark.parametrize("damping", [2, 3, 20])
def test_a_sliding_block_put_down_on_a_damped_ground_settles_there_from_its_first_touch(damping):
    """The gap x and its rate w vanish at the start; friction takes half of the impulse of the load, which is 1 + w."""
    ground = ap.Friction(velocity=v, force=F, load=-100 * x - damping * w, kinetic=sp.S.Half, gap=x, normal=N)
    block = ap.System.with_frictions({x: w, v: F, w: N - 1}, {}, [ground])
    path = followed(block, {}, {x: 0, v: 1, w: 0}, 1)
    assert path.modes == ("slip_same",)
    assert path.final[1] == pytest.approx((1 - path.final[2]) / 2, abs=1e-14)


@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.parametrize("stiffness", ["1/3", "2"])
def test_critical_damping_by_an_irrational_coefficient_is_that_of_the_closed_form(stiffness, digits):
    """From rest x = (1 - (1 + k t) e^-kt)/k^2, v = t e^-kt, k^2 the stiffness: two eigenvalues -k, of rounded entries.

    To 30 digits the motion rested at (0, 0) with the error 0, as both eigenvalues were one number after rounding.
    """
    b = sp.Symbol("b", positive=True)
    damped = ap.System.smooth({x: v, v: 1 - b * x - 2 * sp.sqrt(b) * v}, {}, None)
    found = ap.solve(ap.Scene(system=damped, values={b: stiffness}, start=(0, 0), until=1), digits=digits).final
    with mpmath.workdps(40):
        k = mpmath.sqrt(mpmath.mpf(Fraction(stiffness).numerator) / Fraction(stiffness).denominator)
        exact = (1 - (1 + k) * mpmath.exp(-k)) / k**2, mpmath.exp(-k)
        assert all(abs(a - b) < mpmath.mpf(10) ** -(digits or 15) for a, b in zip(found, exact, strict=True))
