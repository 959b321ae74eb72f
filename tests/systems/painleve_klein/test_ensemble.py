"""Ensembles: the same flow as ``solve`` on every trajectory, whatever its neighbours, in bounded memory."""

import tracemalloc

import mpmath
import numpy as np
import pytest

import asympk as ap
from asympk.errors import InputError, TooLarge, TooManyEvents, Undecided
from asympk.path import KINDS
from asympk.systems.painleve_klein.arrays import branchfree, ensemble, inputs, itineraries, safeguarded
from asympk.systems.painleve_klein.flow import segments

PARAMETERS = [
    (1, 1, 1e-3), (1, 1, 1e-6), (1, 1.5, 1e-2), (0.3, 0.3, 1e-3), (20, 25, 1e-4), (1, 1, 0.2), (1, 1, 1.5),
    (1e-3, 1e-3, 0.1), (0, 0, 0.1), (-0.01, 0.5, 0.1), (-0.5, -0.5, 1e-3), (-1, -1, 1e-2), (-1.5, -1.5, 1e-4),
    (-1.7, -1.2, 0.3), (-1.9, -1.9, 10), (5, 5, 10), (1e6, 1e6, 1e-9), (1, 1, 1e-300),
]


def starts(seed, n, reach=2.0):
    return np.random.default_rng(seed).uniform(-reach, reach, (3, n))


def scale(path):
    x, _, z = path.final
    return max(1, abs(x), abs(z), *(abs(v) for v in path.scene.start[::2]),
               *(abs(v) for e in path.events for v in (e.x, e.z)))


def events_of(events, trajectory):
    rows = events.trajectory == trajectory
    return list(zip(*(v[rows] for v in events[1:]), strict=True))


def assert_same_as_solve(sigma, sigma0, mu, x, y, z, until, tolerance=2e-15):
    many = ap.solve_many(sigma, mu, x, y, z, until, sigma0, events=True)
    given = np.broadcast_arrays(sigma, sigma0, mu, x, y, z, until)
    for i, (sigma_, sigma0_, mu_, *start, end) in enumerate(zip(*(v.ravel().tolist() for v in given), strict=True)):
        path = ap.solve(ap.Scene(sigma_, mu_, tuple(start), end, sigma0_))
        found, size = events_of(many.events(), i), scale(path)
        assert [e[0] for e in found] == [e.kind for e in path.events]
        assert many.n_events.ravel()[i] == len(path.events)
        assert np.abs(many.final.reshape(3, -1)[::2, i] - path.final[::2]).max() <= tolerance * size
        for (_, t, x_, _, z_), e in zip(found, path.events, strict=True):
            assert abs(x_ - e.x) <= 1e-12 * size
            assert abs(z_ - e.z) <= 1e-12 * size
            assert abs(t - e.t) <= 1e-12 * (end + e.t)


@pytest.mark.parametrize(("sigma", "sigma0", "mu"), PARAMETERS)
def test_ensembles_tell_the_same_as_solve_of_random_starts(sigma, sigma0, mu):
    assert_same_as_solve(sigma, sigma0, mu, *starts(1, 25), 5.0)


def test_ensembles_tell_the_same_as_solve_over_the_whole_domain():
    rng, n = np.random.default_rng(7), 150
    sigma = np.where(rng.random(n) < 0.5, rng.uniform(-2, 3, n), 10 ** rng.uniform(-3, 6, n))
    start = 10 ** rng.uniform(-12, 12, (3, n)) * rng.choice([-1, 1], (3, n))
    assert_same_as_solve(sigma, sigma + rng.choice([0, 0.3], n), 10 ** rng.uniform(-300, 3, n), *start,
                         10 ** rng.uniform(-6, 2, n))


def test_ensembles_tell_the_same_as_solve_near_what_is_singular():
    rng, n = np.random.default_rng(3), 150
    nudge = np.array([0, 0, 2**-52, -(2**-52), 1e-12, -1e-8, 1e-5])
    sigma = rng.choice([0, -1, -1.5, 1, 4, -0.5], n) * (1 + rng.choice(nudge, n)) + rng.choice([0, 1e-300, 1e-16], n)
    mu = rng.choice([0.25, 0.5, 1.25, 1e-3, 1e-6], n) * (1 + rng.choice(nudge, n))
    s = rng.choice([0.25, -0.5, 0.5, 1, -1, 0.2, 2], n) + rng.choice([1e-10, -1e-8, 0.1, -0.3], n)
    x = rng.choice([0, 0.2, 1, -1, 3], n) + rng.choice([0, 1e-8, 0.1], n)
    assert_same_as_solve(sigma, sigma, mu, x, s - x, rng.choice([0, 1, -1, 1e-10, -1e-8, 0.01], n), 5.0)


@pytest.mark.further
def test_ensembles_tell_the_same_as_solve_where_mu_is_not_small():
    rng, n = np.random.default_rng(3), 1500
    sigma = np.where(rng.random(n) < 0.5, rng.uniform(-1.99, 4, n), 10 ** rng.uniform(-2, 3, n))
    mu = 10 ** rng.uniform(-2, 3, n)
    x, y, z = rng.normal(size=(3, n)) * 10 ** rng.uniform(-3, 0, (3, n))
    assert_same_as_solve(sigma, sigma, mu, x, y, z, 10 ** rng.uniform(0, 2, n), 4e-15)


def test_ensembles_tell_the_same_as_solve_where_sigma_is_small():
    rng, n = np.random.default_rng(4), 400
    sigma = 10 ** rng.uniform(-14, -2, n)
    mu, z = sigma * 10 ** rng.uniform(-4, -1.3, n), 10 ** rng.uniform(-2, 1.5, n) * rng.choice([-1, 1], n)
    assert_same_as_solve(sigma, sigma, mu, *rng.uniform(-2, 2, (2, n)), z, 5.0, 4e-15)


def test_a_root_is_not_taken_for_found_where_the_fast_part_has_nothing_to_balance():
    start = (-1.0916013630004633, 2.901339201997149, 0.22440329176185003)
    scene = ap.Scene(-1.0086437016452257, 0.3136444386387876, start, 46)
    assert ap.solve(scene, digits=30).modes == ("slip_same", "stick", "slip_same")
    assert_same_as_solve(scene.sigma, scene.sigma, scene.mu, *start, 46.0)


@pytest.mark.parametrize("offset", [1e-3, -1e-6, 1e-9, -1e-12])
@pytest.mark.parametrize("mu", [1e-1, 1e-3, 1e-6])
def test_starts_beside_the_unstable_plane_leave_it_as_they_should(mu, offset):
    x = np.array([0.3, -1.2, 1.7])
    slow = -2 / (1 + np.sqrt(1 + 4 * mu))
    assert_same_as_solve(1.0, 1.0, mu, x, slow * (x + 1) + offset, 1.0, 2.0)


def test_starts_on_the_planes_themselves_go_the_way_of_solve():
    x, s, z = (v.ravel() for v in np.meshgrid([0.5, -1.0], [0.0, 0.3, -0.7, 0.1, 1.5], [0.0, 1.0, -1.0]))
    keep = (s == 0) | (z == 0)
    assert_same_as_solve(1.0, 1.0, 1e-2, x[keep], (s - x)[keep], z[keep], 3.0)


def test_a_start_on_z_zero_that_comes_back_to_it_is_seen_to_have_left():
    sigma, mu, x, y = np.array([
        (-1.4114967573549437, 0.042409261429850305, 1.345358026028027, 7.095009933787297),
        (-1.6750595050180381, 0.025234181960177317, -2.0142243485572475, 4.578400470894158),
        (5.560197186437012, 0.21802571218836672, -5.501655487874494, 5.524231688664511),
        (-1.2560640578221732, 0.032579829574497864, 3.5200488407711585, 7.958140095643861),
        (4.866505825027094, 1.0382806924165449, -2.209024135810246, 2.2753564420952355),
        (-1.136511305706879, 0.05313228385360657, 6.36569479211226, 7.76851084053582),
    ]).T
    assert_same_as_solve(sigma, sigma, mu, x, y, 0.0, 20.0)


@pytest.mark.parametrize("mu", [1e-2, 1e-4])
def test_starts_within_mu_of_z_zero_go_the_way_of_solve(mu):
    rng, n = np.random.default_rng(17), 120
    x, s, z = rng.uniform(-1, 1, n), rng.uniform(-1.2, 1.2, n), mu * rng.uniform(-2, 2, n)
    assert_same_as_solve(1.0, 1.0, mu, x, s - x, z, 2.0)


@pytest.mark.parametrize(("sigma", "mu", "x", "y", "z"), [
    (2.9154, 9.8962e-07, 0.08544, 0.76423, -7.1276e-4), (2.1736, 6.9737e-07, 0.80297, 0.93763, -8.9979e-4),
])
def test_the_time_of_a_stop_is_right_to_the_admissible_error_where_the_slow_part_bends_the_fast(sigma, mu, x, y, z):
    kind, t = ap.solve(ap.Scene(sigma, mu, (x, y, z), 1), digits=30).events[0][:2]
    found = ap.solve_many(sigma, mu, x, y, z, 1, events=True).events()
    assert kind == found.kind[0] == "velocity_zero"
    assert abs(t - found.t[0]) < branchfree.TIME_ERROR + 2.0**-53 * t  # 2.2e-16 without the correction of third order


@pytest.mark.parametrize("mu", [1e-6, 1e-3, 1e-2])
def test_final_states_are_right_to_forty_digits_of_the_flow(mu):
    x, y, z = starts(11, 8)
    many = ap.solve_many(1, mu, x, y, z, 5)
    for i in range(x.size):
        path = ap.solve(ap.Scene(1, mu, (x[i], y[i], z[i]), 5), digits=40)
        size = float(scale(path))
        assert all(abs(mpmath.mpf(many.final[j, i]) - path.final[j]) <= 1e-15 * size for j in (0, 2))


def spread(seed, n):
    """Parameters and starts of all sizes for which courses are defined, on both sides of sigma = 0."""
    rng = np.random.default_rng(seed)
    sigma = np.where(rng.random(n) < 0.5, 10 ** rng.uniform(-2, 6, n), rng.uniform(-2, 0, n))
    mu = np.minimum(np.abs(sigma), 1) * 10 ** rng.uniform(-12, -1.3, n)
    x, y, z = rng.uniform(-1, 1, (3, n)) * 10 ** rng.uniform(-1, 3, n)
    y = np.where(rng.random(n) < 0.3, 0.01 * y / mu, y)
    sigma0 = sigma + rng.choice([0, 0, 0.01, 1], n)
    return sigma, sigma0, mu, x, y, z, 10 ** rng.uniform(-3, 1, n)


def both_ways(sigma, sigma0, mu, x, y, z, until):
    """Follow by courses and by the safeguarded flow; return (common rows, final, count, events) and the story."""
    final, count, notes = np.empty((3, x.size)), np.zeros(x.size, dtype=int), []
    with np.errstate(all="ignore"):
        others = itineraries.follow_itineraries(itineraries.Setting(sigma, sigma0, mu), x, y, z, until, final, count,
                                lambda kind, rows, *state: notes.append((rows, KINDS.index(kind), *state)))
        full = [np.broadcast_to(v, x.shape).astype(float) for v in (sigma, sigma0, mu, x, y, z, until)]
        story = safeguarded.certain(*full)
    common = ~story.doubtful
    common[np.concatenate(others)] = False
    return common, final, count, ensemble._in_order(notes), story


def assert_both_ways_agree(common, final, count, found, story, size):
    assert np.array_equal(count[common], story.n_events[common])
    for axis in (0, 2):
        assert (np.abs(final[axis] - story.final[axis]) / size)[common].max() <= 2e-15
    found, told = ([v[common[events[0]]] for v in events] for events in (found, story.events))
    assert np.array_equal(found[1], np.array(KINDS)[told[1]])
    assert np.abs(found[2] / told[2] - 1).max() <= 1e-8
    assert (np.abs(found[3] - told[3]) / size[told[0]]).max() <= 3e-15
    assert (np.abs(found[5] - told[5]) / size[told[0]]).max() <= 3e-15


@pytest.mark.parametrize(("sigma", "mu"), [
    (1, 1e-6), (1, 1e-3), (1, 1e-2), (0.2, 1e-4), (30, 1e-3), (1e3, 1e-12),
    (-0.5, 1e-3), (-0.3, 1e-4), (-1, 1e-6), (-1.4, 1e-3), (-1.7, 1e-4), (-1.95, 1e-9),
])
def test_courses_and_the_safeguarded_flow_agree_and_courses_are_common(sigma, mu):
    start = starts(5, 4000)
    common, *found = both_ways(float(sigma), float(sigma), mu, *start, 5.0)
    assert common.mean() > 0.95
    assert_both_ways_agree(common, *found, np.full(4000, 4.0))


def test_courses_and_the_safeguarded_flow_agree_for_parameters_of_all_sizes():
    given = spread(1, 6000)
    common, *found = both_ways(*given)
    size = np.maximum(1, np.maximum(np.abs(given[3]), np.abs(given[5])))
    events = found[-1].events
    for values in (events[3], events[5]):
        np.maximum.at(size, events[0], np.abs(values).astype(float))
    assert common.mean() > 0.5
    assert_both_ways_agree(common, *found, size)


def test_following_to_t1_and_on_to_t2_is_following_to_t2():
    x, y, z = starts(2, 500)
    sigma, mu = np.repeat([1.0, -0.7], 250), 10 ** np.random.default_rng(2).uniform(-6, -2, 500)
    whole = ap.solve_many(sigma, mu, x, y, z, 3.0)
    half = ap.solve_many(sigma, mu, x, y, z, 1.2)
    rest = ap.solve_many(sigma, mu, *half.final, 1.8)
    quiet = np.abs(half.final[2]) > 1e-3
    assert quiet.mean() > 0.9
    assert np.abs(rest.final - whole.final)[::2, quiet].max() < 1e-14
    assert np.array_equal((half.n_events + rest.n_events)[quiet], whole.n_events[quiet])


def mixed(n=900):
    """Starts and parameters of which some take common courses, some do not, and few need the scalar flow."""
    sigma, _, mu, x, y, z, until = spread(4, n)
    rng = np.random.default_rng(4)
    sigma[::2], mu[::2] = rng.choice([1.0, 0.4, -0.6], n // 2), rng.choice([1e-6, 1e-3, 1e-2, 0.4], n // 2)
    x[::97], y[::97], z[::97] = 0.5, -1.5 + 1e-14, 1.0
    return sigma, mu, x, y, z, until


def same_bits(a, b):
    return np.array_equal(np.asarray(a).view(np.int64), np.asarray(b).view(np.int64))


def test_a_trajectory_alone_has_the_same_bits_as_among_others():
    given = mixed()
    many = ap.solve_many(*given, events=True)
    for i in range(0, given[0].size, 29):
        one = ap.solve_many(*(v[i] for v in given), events=True)
        assert same_bits(one.final, many.final[:, i])
        assert one.n_events == many.n_events[i]
        assert events_of(one.events(), 0) == events_of(many.events(), i)


@pytest.mark.slow
@pytest.mark.parametrize(("chunk", "block"), [(7, 3), (64, 64), (333, 10), (10**6, 10**6)])
def test_results_do_not_depend_on_where_chunks_end(monkeypatch, chunk, block):
    given = mixed()
    usual = ap.solve_many(*given, events=True)
    monkeypatch.setattr(ensemble, "CHUNK", chunk)
    monkeypatch.setattr(ensemble, "BATCH", chunk // 2)
    monkeypatch.setattr(itineraries, "BLOCK", block)
    other = ap.solve_many(*given, events=True)
    assert same_bits(other.final, usual.final)
    assert all(np.array_equal(a, b) for a, b in zip(other.events(), usual.events(), strict=True))


def test_results_permute_with_the_trajectories():
    given = mixed()
    order = np.random.default_rng(8).permutation(given[0].size)
    many, other = ap.solve_many(*given), ap.solve_many(*(v[order] for v in given))
    assert same_bits(other.final, np.ascontiguousarray(many.final[:, order]))
    assert np.array_equal(other.n_events, many.n_events[order])


def test_a_parameter_may_be_a_number_or_an_array_of_it():
    x, y, z = starts(6, 300)
    numbers = ap.solve_many(1, 1e-3, x, y, z, 5)
    arrays = ap.solve_many(np.full(300, 1), np.full(300, 1e-3), x, y, z, np.full(300, 5.0), np.full(300, 1.0))
    assert same_bits(numbers.final, arrays.final)


@pytest.mark.parametrize("name", ["exp", "expm1", "log", "log1p", "sin", "cos", "arctan2"])
def test_functions_of_numpy_do_not_depend_on_the_place_in_an_array(name):
    function, v = getattr(np, name), np.random.default_rng(0).uniform(0.1, 9, 1031)
    more = (v[::-1].copy(),) if name == "arctan2" else ()
    whole = function(v, *more)
    for i in range(0, 1031, 13):
        assert function(v[i : i + 1].copy(), *(m[i : i + 1].copy() for m in more))[0] == whole[i]
        assert np.array_equal(function(v[i:].copy(), *(m[i:].copy() for m in more)), whole[i:])


def test_arguments_broadcast_and_results_have_their_shape():
    sigma, mu = np.array([1.0, -0.5, 2.0])[:, None, None], np.array([1e-3, 1e-2])[:, None]
    many = ap.solve_many(sigma, mu, [0, 0.5, 1, -1], 0.2, -1.0, 5)
    assert many.final.shape == (3, 3, 2, 4)
    assert many.n_events.shape == (3, 2, 4)
    assert many.n_events.dtype.kind == "i"
    one = ap.solve_many(-0.5, 1e-2, 1, 0.2, -1.0, 5)
    assert one.final.shape == (3,)
    assert one.n_events.shape == ()
    assert same_bits(one.final, np.ascontiguousarray(many.final[:, 1, 1, 2]))


def test_arguments_of_any_order_in_memory_and_of_any_numbers_are_read_alike():
    x, y, z = starts(9, 600).reshape(3, 20, 30)
    plain = ap.solve_many(1, 1e-3, x, y, z, 5)
    other = ap.solve_many("1", "1/1000", np.asfortranarray(x), y[:, ::-1][:, ::-1], z.tolist(), np.float32(5))
    assert same_bits(plain.final, other.final)


def test_no_trajectories_have_no_events():
    none = ap.solve_many(1, 1e-3, np.zeros((0, 4)), 0.2, -1, 5)
    assert none.final.shape == (3, 0, 4)
    assert none.events().t.size == 0


def test_events_are_ragged_in_order_of_time_and_snapped():
    sigma, mu, x, y, z, until = mixed()
    many = ap.solve_many(sigma, mu, x, y, z, until)
    events = many.events()
    assert np.array_equal(np.bincount(events.trajectory, minlength=until.size), many.n_events)
    assert (np.diff(events.trajectory) >= 0).all()
    assert (np.diff(events.t)[np.diff(events.trajectory) == 0] >= 0).all()
    assert ((events.t >= 0) & (events.t <= until[events.trajectory])).all()
    assert (events.z[events.kind != "force_zero"] == 0).all()
    assert (events.y[events.kind == "force_zero"] == -events.x[events.kind == "force_zero"]).all()
    onset = events.kind == "slip_onset"
    edges = [1 / (sigma + 3), -1 / (sigma + 1)]
    off = [np.abs((events.x + events.y)[onset] - edge[events.trajectory[onset]]) for edge in edges]
    assert (np.minimum(*off) <= 1e-14 * (1 + np.abs(events.x[onset]))).all()


def test_events_found_on_request_are_those_kept():
    given = mixed()
    kept, found = ap.solve_many(*given, events=True).events(), ap.solve_many(*given).events()
    assert all(np.array_equal(a, b) for a, b in zip(kept, found, strict=True))


def test_events_are_refused_when_the_arguments_have_changed_since():
    x, y, z = starts(3, 50)
    many = ap.solve_many(1, 1e-3, x, y, z, 5)
    x[7] += 0.1
    with pytest.raises(InputError, match="changed"):
        many.events()


def test_progress_is_told_after_each_chunk(monkeypatch):
    monkeypatch.setattr(ensemble, "CHUNK", 40)
    told = []
    ap.solve_many(1, 1e-3, *starts(3, 100), 5, progress=lambda *now: told.append(now))
    assert told == [(40, 100), (80, 100), (100, 100)]


@pytest.mark.parametrize(("sigma", "few"), [(1.0, 20000), (-0.5, 5000)])
def test_memory_beyond_the_result_does_not_grow_with_the_number_of_trajectories(monkeypatch, sigma, few):
    monkeypatch.setattr(ensemble, "CHUNK", 1024)
    monkeypatch.setattr(ensemble, "BATCH", 1024)
    monkeypatch.setattr(itineraries, "BLOCK", 512)
    peaks = []
    for n in (few, 4 * few):
        x, y, z = starts(3, n)
        tracemalloc.start()
        many = ap.solve_many(sigma, 1e-6, x, y, z, 5)
        peaks.append(tracemalloc.get_traced_memory()[1] - many.final.nbytes - many.n_events.nbytes)
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


BAD = {
    "sigma": [(-2, "greater than -2"), (np.nan, "finite"), ([1, np.inf], r"sigma\[1\] = inf: .*finite"), ("x", "'x'")],
    "mu": [(0, "positive"), ([[1, -1e-300]], r"mu\[0, 1\] = -1e-300: .*positive"), (None, "None"), (1j, "1j")],
    "x": [([0, 1, np.nan], r"x\[2\] = nan"), ([True], "True"), ([[1], [1, 2]], "number"), (object(), "object")],
    "z": [(10**400, "finite"), ("1/0", "zero"), (np.array(["a"]), r"z\[0\] = 'a'")],
    "until": [(-1e-9, "zero or positive"), (np.inf, "finite")],
    "sigma0": [(0.5, r"sigma0 = 0.5: it must be at least sigma = 1"), ([1, 2, 0.9], r"sigma0\[2\] = 0.9")],
}


@pytest.mark.parametrize(("name", "value", "words"), [(n, v, w) for n, some in BAD.items() for v, w in some])
def test_bad_arguments_are_refused_in_one_line_that_names_them(name, value, words):
    good = {"sigma": 1, "mu": 1e-3, "x": 0, "y": 0.2, "z": -1, "until": 5}
    with pytest.raises(InputError, match=words) as caught:
        ap.solve_many(**{**good, name: value})
    assert str(caught.value).startswith(name)
    assert "\n" not in str(caught.value)


def test_shapes_that_do_not_broadcast_are_refused_by_name():
    with pytest.raises(InputError, match=r"do not broadcast; .* x \(2,\), y \(3,\), z "):
        ap.solve_many(1, 1e-3, [0, 1], [0, 1, 2], -1, 5)


def test_too_many_events_name_the_trajectory_and_the_state(monkeypatch):
    for module in (safeguarded, ensemble, segments):
        monkeypatch.setattr(module, "MOST_EVENTS", 20)
    with pytest.raises(TooManyEvents, match=r"trajectory 2: more than 20 events by t = .* where \(x, y, z\) = \("):
        ap.solve_many(5, 10, [0, 0.1, 1e3], 0, -1, 1e3, strict=True)


def test_states_beyond_the_range_of_doubles_are_refused_by_name():
    with pytest.raises(TooLarge, match="trajectory 1"):
        ap.solve_many(1, 10, 0, [0.2, 8e307], 1, 5, strict=True)


def test_a_trajectory_that_is_not_followed_has_an_outcome_and_costs_no_other_its_own(monkeypatch):
    for module in (safeguarded, ensemble, segments):
        monkeypatch.setattr(module, "MOST_EVENTS", 20)
    sigma, mu = np.array([5, 5, 5, 1, 1]), np.array([10, 10, 10, 10, 1e-3])
    x, y, until = np.array([0, 0.1, 1e3, 0, 0]), np.array([0, 0, 0, 8e307, 0.2]), np.array([1e3, 1e3, 1e3, 5, 5])
    many = ap.solve_many(sigma, mu, x, y, -1.0, until)
    words = [many.outcomes[k] for k in many.outcome]
    assert words == ["followed", "followed", "too many events", "beyond the range of doubles", "followed"]
    good = many.outcome == 0
    assert np.isnan(many.final[:, ~good]).all()
    assert (many.n_events[~good] == 0).all()
    fair = ap.solve_many(sigma[good], mu[good], x[good], y[good], -1.0, until[good], strict=True)
    assert same_bits(np.ascontiguousarray(many.final[:, good]), fair.final)
    assert np.array_equal(np.bincount(many.events().trajectory, minlength=5), many.n_events)


def test_an_undecided_trajectory_is_told_by_its_outcome(monkeypatch):
    real = ensemble.exact.followed_in_doubles

    def undecided(case):
        if case.z == 1:
            raise Undecided("no")
        return real(case)

    monkeypatch.setattr(ensemble.exact, "followed_in_doubles", undecided)
    given = 1, 1e-3, 1000.0, -1000.0, np.array([-1.0, 1.0, -0.5]), 2
    many = ap.solve_many(*given)
    assert [many.outcomes[k] for k in many.outcome] == ["followed", "undecided", "followed"]
    with pytest.raises(Undecided, match="trajectory 1: no"):
        ap.solve_many(*given, strict=True)


@pytest.mark.slow
@pytest.mark.parametrize("keep", [True, False])
def test_events_in_chunks_are_the_events(keep):
    given = mixed(300)
    many, whole = ap.solve_many(*given, events=keep), ap.solve_many(*given, events=True).events()
    for rows in (1, 7, 64, 10**6):
        parts = zip(*many.events_in_chunks(rows), strict=True)
        assert all(np.array_equal(np.concatenate(some), all_) for some, all_ in zip(parts, whole, strict=True))
    for rows in (0, -1, 2.5, True, "7"):
        with pytest.raises(InputError, match="rows"):
            next(many.events_in_chunks(rows))


def test_events_take_memory_as_they_are_many(monkeypatch):
    monkeypatch.setattr(ensemble, "CHUNK", 1024)
    monkeypatch.setattr(ensemble, "BATCH", 1024)
    many = ap.solve_many(1, 1e-6, *starts(3, 20000), 5)
    tracemalloc.start()
    events = many.events()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.5 * sum(values.nbytes for values in events)


def test_extended_precision_is_not_needed_for_being_right(monkeypatch):
    x, y, z = starts(12, 6)
    usual = ap.solve_many(-0.5, 1e-2, x, y, z, 5)
    monkeypatch.setattr(safeguarded, "EXTENDED", None)
    other = ap.solve_many(-0.5, 1e-2, x, y, z, 5)
    assert np.array_equal(usual.n_events, other.n_events)
    assert np.abs(usual.final - other.final)[::2].max() < 3e-15


def test_the_textbook_slow_root_would_lose_digits(monkeypatch):
    x, y, z = starts(13, 100)
    right = ap.solve_many(1, 1e-8, x, y, z, 5)
    exact = branchfree.mode_constants

    def textbook(a, b, mu):
        slow = (-b + np.sign(b) * np.sqrt(b * b - 4 * mu * b)) / (2 * mu)
        return exact(a, b, mu)._replace(slow=slow, lag=1 + slow)

    monkeypatch.setattr(itineraries, "mode_constants", textbook)
    wrong = ap.solve_many(1, 1e-8, x, y, z, 5)
    assert np.abs(wrong.final - right.final).max() > 1e-10


def test_rows_of_a_column_are_those_of_the_broadcast_array():
    shape, found = inputs.scene_columns(np.arange(3.0)[:, None], 1, np.arange(4), 0, 0, 2)
    assert shape == (3, 4)
    assert found["sigma"].rows(slice(2, 7)).tolist() == [0, 0, 1, 1, 1]
    assert found["x"].rows(np.array([0, 5, 11])).tolist() == [0, 1, 3]
    assert found["until"].rows(slice(0, 2)) == 2.0
    assert found["until"].array(slice(1, 3)).tolist() == [2.0, 2.0]
