"""The exact flow by theorem: what must hold of every path, whatever the scene."""

import math
import pickle
from fractions import Fraction
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import asympk as ap
from asympk.affine.run import run as general
from asympk.arithmetic import Doubles
from asympk.errors import InputError, TooLarge, TooManyEvents, Undecided
from asympk.systems.painleve_klein.flow.exact import RodNumbers, segments_of

BOUND = 2e-15
theorem = settings(max_examples=60, phases=[Phase.explicit, Phase.generate])

unit = st.floats(-2, 2)
starts = st.tuples(unit, unit, unit)
sigmas = st.one_of(
    st.floats(-1.99, 5),
    st.sampled_from([0.0, -1.0, -1.5, 1.0]),
    st.builds(math.nextafter, st.sampled_from([0.0, -1.0, -1.5]), st.sampled_from([-9.0, 9.0])),
    st.floats(-9, 6).map(lambda p: 10.0**p),
)
mus = st.one_of(st.floats(-10, 0.5), st.floats(-300, 3)).map(lambda p: 10.0**p)
horizons = st.floats(-2, 1.5).map(lambda p: 10.0**p)
statics = st.one_of(st.none(), st.floats(0, 3))
sizes = st.one_of(st.just(0.0), st.builds(lambda sign, p: sign * 10.0**p, st.sampled_from([-1, 1]), st.floats(-12, 12)))


def solved(*args, **options):
    """Solve, or let go of a scene that is refused by name."""
    try:
        return ap.solve(*args, **options)
    except (TooLarge, TooManyEvents):
        assume(False)


def scene_of(sigma, mu, start, until, more=None):
    return ap.Scene(sigma, mu, start, until, sigma0=None if more is None else Fraction(sigma) + Fraction(more))


def distance(path, true):
    """Return the distance of the final (x, z), relative to the largest of 1, |x|, |z| on the path."""
    states = [path.scene.start, path.final, *(event.state for event in path.events)]
    largest = max(1, *(abs(float(state[i])) for state in states for i in (0, 2)))
    return float(max(abs(path.final[i] - true.final[i]) for i in (0, 2)) / largest)


def in_doubles_and(digits, scene, solve=ap.solve):
    """Return the path in doubles and that of many digits, once they have been found to be one."""
    path, true = solve(scene), solve(scene, digits=digits)
    assert path.modes == true.modes
    assert [event.kind for event in path.events] == [event.kind for event in true.events]
    assert distance(path, true) <= BOUND
    return path, true


@theorem
@given(sigmas, mus, starts, horizons, statics)
@pytest.mark.further
def test_doubles_agree_with_forty_digits(sigma, mu, start, until, more):
    in_doubles_and(40, scene_of(sigma, mu, start, until, more), solved)


@theorem
@given(sigmas, mus, st.tuples(sizes, sizes, sizes), st.floats(-6, 6).map(lambda p: 10.0**p), statics)
@pytest.mark.further
def test_doubles_agree_with_forty_digits_over_the_whole_domain(sigma, mu, start, until, more):
    assume(mu > 1e-280)  # below, y may leave the range of doubles
    in_doubles_and(40, scene_of(sigma, mu, start, until, more), solved)


@theorem
@given(
    sigma=st.one_of(st.just(1.0), st.floats(0.05, 20)),
    mu=st.floats(-6, -1).map(lambda p: 10.0**p),
    x=unit,
    z=st.floats(0.1, 2),
    deviation=st.builds(lambda sign, p: sign * 10.0**p, st.sampled_from([-1, 1]), st.floats(-12, -1)),
)
def test_the_escape_from_the_unstable_line_is_right_for_the_double_that_is_given(sigma, mu, x, z, deviation):
    slow = ap.Scene.near("Pi2", x=x, offset=0, z=z, sigma=sigma, mu=mu, until=5).start[1]
    in_doubles_and(40, ap.Scene(sigma, mu, (x, slow + deviation, z), 5))


@settings(theorem, max_examples=12)
@given(sigmas, st.floats(-2, 0.5).map(lambda p: 10.0**p), starts, st.floats(0.1, 5), statics)
def test_the_rate_of_z_minus_mu_y_minus_x_is_x_along_the_whole_path(sigma, mu, start, until, more):
    path = solved(scene_of(sigma, mu, start, until, more), digits=20)
    times = [mpmath.mpf(0), *(event.t for event in path.events), mpmath.mpf(until)]

    def balance(t):
        x, y, z = path(t)
        return z - mpmath.mpf(mu) * y - x

    with mpmath.workdps(30):
        for begin, end in pairwise(times):
            cut = [begin + (end - begin) * k / 4 for k in range(5)]
            with mpmath.workdps(15):
                integral = mpmath.quad(lambda t: path(t)[0], cut, maxdegree=5)
            change = balance(end * (1 - mpmath.mpf(10) ** -28)) - balance(begin)
            assert abs(change - integral) < 1e-9 * (1 + abs(integral) + max(map(abs, start)))


@pytest.mark.further
@theorem
@given(sigmas, mus, starts, st.floats(0.05, 3), st.floats(0.1, 0.9), statics)
def test_solving_on_from_a_later_time_is_solving_at_once(sigma, mu, start, until, share, more):
    until, static = Fraction(until), None if more is None else Fraction(sigma) + Fraction(more)
    stop = until * Fraction(share)
    whole = solved(ap.Scene(sigma, mu, start, until, sigma0=static), digits=30)
    first = solved(ap.Scene(sigma, mu, start, stop, sigma0=static), digits=600)
    then = solved(ap.Scene(sigma, mu, first.final, until - stop, sigma0=static), digits=30)
    assert len(first.events) + len(then.events) == len(whole.events)
    assert first.modes + then.modes[1:] == whole.modes
    assert distance(then, whole) < 1e-25


@theorem
@given(sigmas, mus, starts, horizons, statics)
def test_a_path_is_continuous_at_its_events_where_one_quantity_vanishes(sigma, mu, start, until, more):
    scene = scene_of(sigma, mu, start, until, more)
    path = solved(scene, digits=30)
    with mpmath.workdps(60):
        times = [0, *(event.t for event in path.events)]
        for previous, event, before in zip(times, path.events, path.modes, strict=False):
            if event.t - previous < 1e-20 * event.t:
                continue
            state = path(event.t - (event.t - previous) * mpmath.mpf(10) ** -30)
            size = 1 + max(map(abs, event.state))
            rate = 1 + abs(event.y) + (1 + abs(event.x + event.y)) * (1 / mpmath.mpf(mu) + sigma + 4)
            jump = max(abs(p - q) for p, q in zip(state, event.state, strict=True))
            assert jump < 1e-27 * (size + event.t * rate)
            if event.kind == "velocity_zero" or before == "stick":
                assert event.z == 0
            if event.kind == "force_zero":
                assert event.x + event.y == 0


@theorem
@given(sigmas, mus, starts, statics)
def test_a_slip_begins_exactly_on_an_edge_of_the_static_cone(sigma, mu, start, more):
    path = solved(scene_of(sigma, mu, start, 5.0, more))
    sigma0 = float(path.scene.sigma0)
    edges = [1 / (sigma0 + 3)] + ([-1 / (sigma0 + 1)] if sigma0 != -1 else [])
    for event in path.events:
        if event.kind == "slip_onset":
            s, size = event.x + event.y, max(abs(event.x), abs(event.y))
            assert min(abs(s - edge) for edge in edges) <= 2.0**-52 * size


def test_modes_change_as_the_events_say():
    after = {
        ("slip_same", "force_zero"): {"slip_opposite"},
        ("slip_opposite", "force_zero"): {"slip_same"},
        ("slip_same", "velocity_zero"): {"slip_opposite", "stick"},
        ("slip_opposite", "velocity_zero"): {"slip_same", "stick"},
        ("stick", "slip_onset"): {"slip_same", "slip_opposite"},
    }
    random = np.random.default_rng(7)
    for _ in range(300):
        sigma, mu = random.uniform(-1.9, 3), 10 ** random.uniform(-6, 1)
        path = ap.solve(ap.Scene(sigma, mu, tuple(random.uniform(-2, 2, 3)), 20))
        assert len(path.modes) == len(path.events) + 1
        for (before, then), event in zip(pairwise(path.modes), path.events, strict=True):
            assert then in after[before, event.kind]
        times = [event.t for event in path.events]
        assert times == sorted(times)


def test_no_path_of_small_mu_chatters():
    random = np.random.default_rng(8)
    for _ in range(500):
        scene = ap.Scene(1, 10 ** random.uniform(-9, -3), tuple(random.uniform(-2, 2, 3)), 5)
        path = ap.solve(scene)
        assert len(path.events) <= 4
        assert path.modes[-1] == "slip_same"


# --- digits -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("digits", [1, 15, 50, 200, 1000])
def test_digits_are_as_many_as_asked_for(digits):
    scene = ap.Scene(sigma="1/3", mu="1/100", start=("0.1", "0.2", -1), until=5)
    path, more = ap.solve(scene, digits=digits), ap.solve(scene, digits=digits + 30 if digits < 900 else 970)
    with mpmath.workdps(1100):
        error = max(abs(p - q) for p, q in zip(path.final, more.final, strict=True))
        assert error < mpmath.mpf(10) ** -min(digits, 960)
        assert path.error < mpmath.mpf(10) ** -digits


def test_results_are_mpf_and_the_global_precision_stays_as_it_is():
    before = mpmath.mp.prec
    path = ap.solve(ap.Scene(1, "1e-3", (0, "0.2", -1), 5), digits=60)
    assert mpmath.mp.prec == before
    event = path.events[0]
    told = (*path.final, event.t, *event.state, path.error, *path(1))
    assert all(isinstance(value, mpmath.mpf) for value in told)


def test_an_exact_parameter_is_not_its_nearest_double():
    exact = ap.solve(ap.Scene("0.2", "0.1", (0, "0.2", -1), 5), digits=40)
    double = ap.solve(ap.Scene(0.2, 0.1, (0, 0.2, -1), 5), digits=40)
    assert 1e-20 < abs(exact.final[2] - double.final[2]) < 1e-14
    in_doubles = [ap.solve(ap.Scene(*given, 5)) for given in (("0.2", "0.1", (0, "0.2", -1)), (0.2, 0.1, (0, 0.2, -1)))]
    assert in_doubles[0].final == in_doubles[1].final


@pytest.mark.parametrize("digits", [0, -3, 1001, 2.5, "50", True, [50]])
def test_digits_that_are_none_are_refused(digits):
    with pytest.raises(InputError, match=r"digits = .*: it must be a whole number from 1 to 1000"):
        ap.solve(ap.Scene(1, 1e-3, (0, 0.2, -1), 5), digits=digits)


# --- starts relative to a manifold ------------------------------------------------------------------------


def near(offset, **changes):
    given = {"x": 0.3, "z": 1, "sigma": 1, "mu": 1e-3, "until": 0.9, "offset": offset}
    return ap.Scene.near("Pi2", **{**given, **changes})


def test_on_the_unstable_line_a_path_stays_until_the_plane_ends_it():
    path = ap.solve(near(0))
    assert path.events == ()
    x, y, _ = path.final
    slow = -2 / (1 + math.sqrt(1 + 4e-3))
    assert x == pytest.approx(-1 + 1.3 * math.exp(slow * 0.9), rel=1e-15)
    assert y == pytest.approx(slow * (x + 1), rel=1e-15)
    later = ap.solve(near(0, until=3))
    assert later.modes[:2] == ("slip_opposite", "stick")
    assert later.events[0].t == pytest.approx(1, rel=1e-2)


@pytest.mark.parametrize("offset", ["1e-12", "1e-100", "1e-300", "-1e-300", "1e-500"])
def test_off_the_unstable_line_a_path_leaves_at_its_own_time(offset):
    path = ap.solve(near(offset, mu=1e-4), digits=30)
    size = mpmath.mpf(offset)
    rate = 2 / (math.sqrt(1 + 4e-4) - 1)
    assert path.events[0].kind == ("force_zero" if size > 0 else "velocity_zero")
    reached = abs(size) * mpmath.exp(path.events[0].t * rate)
    assert 0.5 < reached < 3 / 1e-4
    if abs(size) > 1e-307:
        double = ap.solve(near(offset, mu=1e-4))
        assert double.modes == path.modes
        assert distance(double, path) <= BOUND


def test_on_the_stable_line_nothing_ends():
    path = ap.solve(ap.Scene.near("Pi1", x=2, offset=0, z=1, sigma=1, mu=1e-3, until=10))
    x, y, z = path.final
    assert path.modes == ("slip_same",)
    assert x + y == pytest.approx(0.2, abs=1e-6)
    assert z == pytest.approx(1 + 10 / 5 + 1e-3 * 4 / 5 * (y + 1.8), abs=1e-5)


def test_a_start_that_happens_to_be_on_the_unstable_line_is_known_to_be():
    on_line = ap.solve(ap.Scene(1, 2, (1, -1, 1), 0.9))  # slow root -1/2: y = -(x + 1)/2
    assert on_line.events == ()
    assert on_line.final[0] == pytest.approx(-1 + 2 * math.exp(-0.45), rel=1e-15)
    at_rest = ap.solve(ap.Scene(0.25, 1e-3, (-4, 0, 1), 0.2))
    assert at_rest.final == (-4, 0, pytest.approx(0.2, abs=1e-15))
    assert ap.solve(ap.Scene(1, 3, (-1, 0, 1), 0.5)).final == (-1, 0, pytest.approx(0.5, abs=1e-15))


# --- starts on the boundaries of the modes ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "sigma", "sigma0", "modes"),
    [
        ((0, 0, 0), 1, None, ("slip_same",)),  # s = z = 0: z' = 1, s' = 1/mu
        ((1, -1, 0), 1, None, ("slip_same",)),
        ((2000, -2000, 1), 1, None, ("slip_opposite",)),  # s' = -2000 + 1024 < 0
        ((2000, -2000, 0), 1, None, ("slip_opposite",)),
        ((1024, -1024, 1), 1, None, ("slip_same",)),  # s = s' = 0, s'' > 0
        ((0, 1, 0), 1, None, ("stick", "slip_same")),
        ((0, "0.25", 0), 1, None, ("slip_same",)),  # on the edge of the cone, moving out
        ((-300, "300.25", 0), 1, None, ("stick",)),  # on the edge, moving in
        ((0, "-0.5", 0), 1, None, ("slip_opposite", "slip_same")),
        ((600, "-600.5", 0), 1, None, ("stick",)),
        ((0, "0.24", 0), 1, None, ("slip_same",)),
        ((0, "-0.4", 0), 1, None, ("slip_opposite", "slip_same")),
        ((0, "0.22", 0), 1, 2, ("stick", "slip_same")),
        ((0, "0.22", 0), 1, 1, ("slip_same",)),
        ((0, 3, 0), "-1.5", None, ("slip_opposite", "stick")),  # above the strip 2/3 <= s <= 2
        ((0, 1, 0), "-1.5", None, ("stick", "slip_same")),
    ],
)
def test_a_start_on_a_boundary_goes_where_the_derivatives_point(start, sigma, sigma0, modes):
    scene = ap.Scene(sigma, "1/1024", start, "0.05", sigma0=sigma0)
    path, _ = in_doubles_and(30, scene)
    assert path.modes[: len(modes)] == modes


def test_an_edge_that_doubles_miss_by_an_ulp_is_told_by_exact_arithmetic():
    edge = 1 / 3.2
    for start, mode in ((math.nextafter(edge, 0), "slip_same"), (edge, None), (math.nextafter(edge, 1), "stick")):
        scene = ap.Scene(0.2, 1e-3, (0, start, 0), 1)
        path, true = ap.solve(scene), ap.solve(scene, digits=60)
        assert path.modes == true.modes
        assert mode is None or path.modes[0] == mode


def test_sticking_ends_through_the_upper_edge_where_sigma_is_below_minus_one():
    path = ap.solve(ap.Scene(-1.5, 0.5, (-5, 6.5, 0), 5))
    assert path.modes[:2] == ("stick", "slip_opposite")
    assert path.events[0].x + path.events[0].y == 2
    assert path(path.events[0].t * (1 + 1e-3))[2] < 0


def test_static_friction_above_kinetic_holds_what_comes_to_rest():
    free = ap.solve(ap.Scene(1, 1e-3, (0, 0.2, -1e-4), 1))
    held = ap.solve(ap.Scene(1, 1e-3, (0, 0.2, -1e-4), 1, sigma0=10))
    assert held.modes[1] == "stick"
    (onset,) = (event for event in held.events if event.kind == "slip_onset")
    assert onset.x + onset.y == pytest.approx(1 / 13, rel=1e-15)
    assert free.events[-1].x + free.events[-1].y == pytest.approx(1 / 4, rel=1e-15)


def test_a_crossing_that_sampling_misses_is_found():
    start = (-4.645303596781149, -4.391482433311355, 3.406240353653226)
    scene = ap.Scene(16.48116775916368, 0.6013074263183269, start, 5)
    modes = ("slip_opposite", "stick", "slip_opposite", "slip_same", "stick", "slip_same")
    assert ap.solve(scene).modes == ap.solve(scene, digits=40).modes == modes


def test_no_event_is_missed_between_the_times_of_a_fine_grid():
    random = np.random.default_rng(9)
    for _ in range(60):
        sigma, mu = random.uniform(-1.9, 3), 10 ** random.uniform(-3, 1.5)
        path = ap.solve(ap.Scene(sigma, mu, tuple(random.uniform(-3, 3, 3)), 10))
        times = [0, *(event.t for event in path.events), 10]
        for (begin, end), mode in zip(pairwise(times), path.modes, strict=True):
            inside = begin + (end - begin) * (np.arange(1, 40) / 40)
            x, y, z = path(inside)
            side = np.sign(np.round(z, 12)) * np.sign(np.round(x + y, 12))
            wanted = {"slip_same": 1, "slip_opposite": -1, "stick": 0}[mode]
            assert np.all((side == wanted) | (side == 0))
            if mode == "stick":
                assert np.all(z == 0)


# --- the ends of the domain -------------------------------------------------------------------------------


def oscillating(n):
    """Yield starts in slip_same with a complex pair, s on its way to a first minimum and z near 0."""
    random = np.random.default_rng(7)
    for _ in range(n):
        b = 10 ** random.uniform(0.33, 3)
        mu = float(min(1000, b * 10 ** random.uniform(0, 2)))
        omega = math.sqrt(b / mu - (b / mu / 2) ** 2)
        s = random.uniform(0, 1) / b * random.choice([1, 0.1, 0.01])
        y = (b * s - 1) / mu - abs(random.normal()) * omega / b * random.choice([1, 0.1, 0.01, 0])
        z = 10 ** random.uniform(-5, -0.5)
        yield float(b - 4), mu, (float(s - y), float(y), float(z)), float(random.uniform(3, 60) / omega)


def slipping(sigma, mu, start, times):
    """(x, y, z) in slip_same at equal steps of time, by powers of the propagator of one step; shape (3, n)."""
    b = sigma + 4
    rates = [[0, 1, 0, 0], [-b / mu, -b / mu, 0, 1 / mu], [1 - b, 1 - b, 0, 1], [0, 0, 0, 0]]
    power, states = expm(np.array(rates) * times[1]), np.array([[*start, 1]]).T
    while states.shape[1] < len(times):
        states, power = np.hstack([states, power @ states]), power @ power
    return states[:3, : len(times)]


@pytest.mark.slow
def test_no_stop_is_missed_after_the_second_extremum_of_the_load():
    stops = 0
    for sigma, mu, start, until in oscillating(150):
        path = ap.solve(ap.Scene(sigma, mu, start, until))
        many = ap.solve_many(sigma, mu, *start, until)
        times = np.linspace(0, float(path.events[0].t) if path.events else until, 2000)
        x, y, z = slipping(sigma, mu, start, times)[:, 1:-1]
        assert path(times[1000]) == pytest.approx([x[999], y[999], z[999]], rel=1e-9, abs=1e-12)
        assert z.min() > 0
        assert (x + y).min() > 0
        assert many.n_events == len(path.events)
        stops += path.events[:1] != () and path.events[0].kind == "velocity_zero"
    assert stops > 10


@pytest.mark.parametrize(
    ("sigma", "mu", "start", "until"),
    [
        (45.0, 1000.0, (0.00103, -0.001, 0.013), 272.0),
        (44.7, 1000.0, (0.0135, -0.00043, 0.0508), 145.7),
    ],
)
def test_a_stop_in_the_third_stretch_is_that_of_an_integrator(sigma, mu, start, until):
    scene = ap.Scene(sigma, mu, start, until)
    found, other = ap.solve(scene).events, ap.solve(scene, method="dop853", rtol=1e-11, atol=1e-13).events
    assert [event.kind for event in found] == [event.kind for event in other] == ["velocity_zero", "slip_onset"]
    assert [event.t for event in found] == pytest.approx([event.t for event in other], rel=1e-8)


@pytest.mark.parametrize(
    ("sigma", "mu", "start", "until"),
    [
        (5.0, 2.0, (0.062499999999999986, 0.06250000000000001, 0.0), 3.0),  # into the cone for 1e-16 only
        (-1.0, 2.0**-22, (-2097151.5, 2097152.0, 0.0), 3.0),  # on its edge with s' = 0, and so z' = z'' = 0
        (1.0, 2.0**-8, (-63.75, 64.0, 0.0), 5.0),
        (3.0, 0.25, (0.75, -1.0, 0.5), 0.1),  # z' = z'' = 0 off the plane
        (-1.0, 2.0**-28, (-134217727.5, 134217728.0, 0.5), 20.0),
    ],
)
def test_a_start_where_several_derivatives_vanish_is_followed_alike_in_all_numbers(sigma, mu, start, until):
    scene = ap.Scene(sigma, mu, start, until)
    _, true = in_doubles_and(40, scene)
    assert ap.solve_many(sigma, mu, *start, until).n_events == len(true.events)


@pytest.mark.further
def test_starts_on_the_edges_and_levels_go_as_more_digits_tell():
    random = np.random.default_rng(5)
    for _ in range(400):
        sigma = float(random.choice([1, 0, -1, -1.5, -0.5, 3, -1.75, 5]))
        mu = 2.0 ** -random.integers(-3, 20)
        s = float(random.choice([1 / (sigma + 3), 1 / (sigma + 4), 0, 1, *([-1 / (sigma + 1)] if sigma != -1 else [])]))
        rates = 0, s / mu, s / mu * (1 + 2.0**-52), -1 / mu, random.normal(), ((sigma + 4) * s - 1) / mu
        y = float(random.choice(rates))
        in_doubles_and(40, ap.Scene(sigma, mu, (s - y, y, random.choice([0, 0, 0.5, -0.5, 1e-8])), 3.0))


def test_no_time_is_no_motion():
    for start in ((0, 0.2, -1), (0, 0, 0), (1, 2, 0)):
        path = ap.solve(ap.Scene(1, 1e-3, start, 0))
        assert path.final == start
        assert path.events == ()
        assert tuple(path(0)) == start


def test_the_smallest_mu_jumps_as_the_limit_says():
    path = ap.solve(ap.Scene(1, 1e-300, (0, 0.2, -1), 5))
    assert path.modes == ("slip_opposite", "stick", "slip_same")
    assert path.events[0].y == pytest.approx(5e299, rel=1e-15)
    assert path.events[1].x == 1.0
    assert path.final[0] == pytest.approx(0.2 + 0.8 * math.exp(-5), rel=1e-15)


def test_an_overflow_is_refused_by_name_and_solved_with_digits():
    scene = ap.Scene(1, 1e-300, (0, 0, -1e12), 1)
    with pytest.raises(TooLarge, match=r"y reaches 1e311 after t = 0, beyond the numbers in use"):
        ap.solve(scene)
    path = ap.solve(scene, digits=20)
    assert abs(path.events[0].y / mpmath.mpf("5e311") - 1) < 1e-15


@pytest.mark.further
def test_too_many_events_are_refused_with_the_state_reached():
    with pytest.raises(TooManyEvents, match=r"more than 1000 events by t = .* of until = 1e\+06, where \(x, y, z\) = "):
        ap.solve(ap.Scene(1, 1000, (1e12, 0, 1), 1e6))


def test_a_parameter_that_no_double_holds_is_refused_without_digits():
    tiny = ap.Scene(1, "1e-400", (0, "0.2", -1), 1)
    with pytest.raises(InputError, match="ask for more digits"):
        ap.solve(tiny)
    assert ap.solve(tiny, digits=20).modes == ("slip_opposite", "stick", "slip_same")


def test_an_event_that_rounding_cannot_tell_is_told_by_digits():
    touching = ap.Scene(0, "1/2", (5, -4, -100), 3)  # s = (t - 1)^2 touches zero and does not cross it
    assert ap.solve(touching).modes == ("slip_opposite",)
    just = ap.Scene(0, "1/2", (5, Fraction(-4) - Fraction(1, 10**12), -100), 3)
    assert ap.solve(just).modes == ("slip_opposite", "slip_same", "slip_opposite")


# --- dense output -----------------------------------------------------------------------------------------


def test_dense_output_has_the_shape_of_its_times():
    path = ap.solve(ap.Scene(1, 1e-2, (0, 0.2, -1), 5))
    assert path(1).shape == (3,)
    assert path([0, 1, 2]).shape == (3, 3)
    assert path(np.zeros((2, 4))).shape == (3, 2, 4)
    assert path([]).shape == (3, 0)
    assert path(np.linspace(0, 5, 6).reshape(2, 3))[:, 1, 2] == pytest.approx(path.final, abs=0)
    assert path(2).dtype == float


def test_dense_output_with_digits_is_as_exact():
    path = ap.solve(ap.Scene(1, "1e-2", (0, "0.2", -1), 5), digits=30)
    assert path(5) == path.final
    assert path("1/3") == path(Fraction(1, 3))
    many = path([Fraction(1, 3), 5])
    assert many.shape == (3, 2)
    assert tuple(many[:, 1]) == path.final
    assert tuple(many[:, 0]) == path("1/3")


@pytest.mark.parametrize("digits", [None, 20])
@pytest.mark.parametrize("t", [-1e-9, 5.001, float("nan"), [0, 6], "x", None])
def test_dense_output_outside_the_path_is_refused(t, digits):
    path = ap.solve(ap.Scene(1, 1e-2, (0, 0.2, -1), 5), digits=digits)
    with pytest.raises(InputError, match="t = "):
        path(t)


@pytest.mark.parametrize("digits", [None, 25])
def test_a_path_pickles_with_its_dense_output(digits):
    path = ap.solve(ap.Scene(1, 1e-2, (0, 0.2, -1), 5), digits=digits)
    copy = pickle.loads(pickle.dumps(path))
    assert (copy.final, copy.events, copy.modes, copy.error) == (path.final, path.events, path.modes, path.error)
    assert tuple(copy(0.7)) == tuple(path(0.7))


def test_progress_with_digits_is_told_after_every_event_and_may_end_the_run():
    told, scene = [], ap.Scene(1, 1e-3, (0, 0.2, -1), 5)
    path = ap.solve(scene, digits=30, progress=lambda *now: told.append(now))
    times = [float(event.t) for event in path.events]
    assert [t for t, _, _ in told] == pytest.approx(2 * times)
    assert {until for _, until, _ in told} == {5.0}
    assert sorted({working for _, _, working in told}) == [60, 75]

    def stop(*now):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ap.solve(scene, digits=30, progress=stop)


def test_a_start_at_rest_on_the_unstable_plane_is_followed_in_doubles():
    beside = {"x": 0.5, "offset": 0, "z": 1, "sigma": 1, "mu": 1e-3, "until": 9}
    for scene in (ap.Scene(1, 1e-3, (-1, 0, 1), 2), ap.Scene.near("Pi2", **beside)):
        path, _ = in_doubles_and(30, scene)
        assert path.error > 2.0**-53  # no more digits were asked for


def test_a_run_in_doubles_needs_more_digits_only_rarely():
    random = np.random.default_rng(11)
    asked = 0
    for _ in range(300):
        scene = ap.Scene(1, 10 ** random.uniform(-8, -1), tuple(random.uniform(-2, 2, 3)), 5)
        asked += ap.solve(scene).error == 2.0**-53
    assert asked <= 3


def test_where_rounding_may_show_the_result_is_that_of_more_digits_rounded():
    random = np.random.default_rng(12)
    refined = 0
    for _ in range(60):
        scene = ap.Scene(1, 3, tuple(random.uniform(-2, 2, 3)), 5)
        path, true = in_doubles_and(40, scene)
        if path.error == 2.0**-53:
            refined += 1
            assert path.final == tuple(map(float, true.final))
            for found, event in zip(path.events, true.events, strict=True):
                assert (found.t, *found.state) == tuple(map(float, (event.t, *event.state)))
    assert refined > 20


def test_a_course_that_more_digits_do_not_share_is_not_refined():
    case = RodNumbers(1.0, 1.0, 3.0, 0.3, 0.2, -1.0, 5.0, None)
    other = segments_of(Doubles, case._replace(z=1.0))
    with pytest.raises(Undecided):
        segments_of(Doubles, case, other)


def test_doubles_alone_follow_an_ordinary_scene():
    case = RodNumbers(1.0, 1.0, 1e-3, 0.0, 0.2, -1.0, 5.0, None)
    assert [leg.mode for leg in segments_of(Doubles, case)] == ["slip_opposite", "stick", "slip_same"]


@pytest.mark.parametrize("until", [0, 1e-310, 1, 5])
def test_the_smallest_parameters_have_dense_output_from_the_start_on(until, tmp_path):
    given = -1e-300, 2.5e-301, (0, 0.2, -1), until
    path = ap.solve(ap.Scene(*given))
    assert path(0).tolist() == [0, 0.2, -1]
    assert np.isfinite(path(np.linspace(0, until, 9))).all()
    assert tuple(path(until)) == pytest.approx(path.final, abs=1e-15)
    assert "nan" not in path.to_csv(tmp_path / "a.csv").read_text()


@pytest.mark.parametrize(
    ("start", "stop"), [(("1/2", "1/2", "-1/2"), 0.5), (("1/2", "0", "-1"), 1), (("-1", "2", "-1/2"), 0.5)]
)
def test_a_velocity_that_vanishes_just_where_the_reaction_turns_stops_there(start, stop):
    """z' = 1 for sigma = -1, and at mu = 1/4 the load has a double root: both times are the same number."""
    scene = ap.Scene(sigma=-1, mu="1/4", start=start, until=2)
    path = ap.solve(scene)
    assert path.modes == ("slip_opposite", "stick", "slip_same")
    assert path.events[0].t == stop
    assert path.final == pytest.approx(ap.solve(scene, "lsoda", rtol=1e-11).final, abs=1e-8)


def polynomial(time, load, rate=0, velocity=0):
    """Return the start of a slip at sigma = 0, mu = 1/3 that has these s, y and z at ``time``."""
    t, y = Fraction(time), Fraction(rate) - 3 * Fraction(time)
    s = Fraction(load) - (y + 3) * t - 3 * t * t / 2
    return s - y, y, Fraction(velocity) - t - s * t - (y + 3) * t * t / 2 - t**3 / 2


@pytest.mark.parametrize("until", ["1/7", 2])
@pytest.mark.parametrize(
    ("sigma0", "start", "modes"),
    [
        (0, polynomial("1/7", 0, -3, -9), ()),
        (0, polynomial("1/7", -1), ()),
        ("1/2", polynomial("1/7", -1), ("stick",)),
        (0, polynomial("1/7", 0, -5, -9), ("slip_same",)),
        (0, polynomial("1/7", 1), ("stick",)),
        (0, polynomial("1/7", "1/3", -5), ("slip_same",)),
        (0, polynomial("1/7", 0, -5), ("slip_opposite",)),
    ],
    ids=["load touches", "velocity touches", "and sticks", "load", "velocity", "on the edge", "both"],
)
@pytest.mark.few(3)
def test_what_vanishes_at_a_round_time_is_met_there_whatever_rounding_says(until, sigma0, start, modes):
    """The general engine, which knows nothing of the rod, meets the same."""
    scene = ap.Scene(0, "1/3", start, until, sigma0)
    values = {"sigma": 0, "sigma0": sigma0, "mu": "1/3"}
    rod = ap.systems.painleve_klein.system()
    other = general(ap.Scene(system=rod, values=values, start=dict(zip("xyz", start, strict=True)), until=until))
    for path in (ap.solve(scene), ap.solve(scene, digits=30)):
        assert path.modes == other.modes
        assert path.modes[1 : len(modes) + 1] == modes
        assert [float(w) for w in path.final] == pytest.approx(other.final, abs=1e-14)


def test_a_slip_that_begins_just_at_the_end_is_an_event():
    """From s = 1 at rest the rod sticks until s = 1/4; the end is this time to 2000 digits, more than a run has."""
    with mpmath.workdps(2000):
        fast, slow = (-50 * (1 + sign * mpmath.sqrt("0.96")) for sign in (1, -1))
        share = (1 - slow) / (2 * (fast - slow))  # x = y = 1/2 at the start
        onset = mpmath.findroot(lambda t: (1 + fast) * share * mpmath.exp(fast * t)
                                + (1 + slow) * (0.5 - share) * mpmath.exp(slow * t) - 0.25, 0.014, maxsteps=99)
        until = mpmath.nstr(onset, 2000)
    for end, kinds in ((until, ["slip_onset"]), (until[:900], [])):
        path = ap.solve(ap.Scene(1, "1/100", ("1/2", "1/2", 0), end), digits=1)
        assert [event.kind for event in path.events] == kinds


@pytest.mark.slow
def test_a_start_next_to_the_largest_double_is_followed_as_a_smaller_one():
    """P does not count beside such reactions, so that x(5) is in proportion to x(0)."""
    ends = [ap.solve(ap.Scene(1, "1e-6", (x, "1/5", -1), 5)).final[0] / x for x in (1e200, 1e305, -1e307)]
    assert ends == pytest.approx([ends[0]] * 3, rel=1e-12)


def test_a_load_whose_share_in_its_fast_part_is_below_the_range_of_doubles_does_not_vanish():
    """The compliance and its quotient with the start, 1/8e307, meet in a logarithm."""
    scene = ap.Scene(sigma="-1.9", mu="1e-300", start=(1e300, 8e307, 0), until=1)
    assert ap.solve(scene).final == pytest.approx([float(w) for w in ap.solve(scene, digits=350).final], rel=1e-12)
