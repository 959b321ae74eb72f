"""The asymptotic models: right to the order they claim, uniformly in time, and silent where they do not hold."""

from functools import cache
from itertools import pairwise

import mpmath
import numpy as np
import pytest

import asympk as ap
from asympk.errors import InputError, NoManifold, NoMotion, OrderError, OutOfRange, TwoMotions, UnknownName

MUS = [f"1e-{k}" for k in (2, 3, 4, 6, 8, 10, 12)]
SIGMAS = ["-17/10", "-6/5", "-1/2", "1/2", "1", "3"]
STARTS = [("0", "1/5", "-1"), ("1/3", "-1", "-3/2"), ("0", "-3", "1"), ("-1/2", "1/7", "3/4")]
UNTIL = 3  # beyond the arrival of the shallow rod at z = 0


@pytest.fixture(autouse=True)
def many_digits():
    with mpmath.workdps(70):
        yield


@cache
def exact(sigma, mu, start):
    return ap.solve(ap.Scene(sigma, mu, start, UNTIL), digits=60)


@cache
def model(sigma, mu, start, order, method="jump"):
    return ap.solve(ap.Scene(sigma, mu, start, UNTIL), method, order=order, digits=60)


def distance(a, b):
    return max(abs(p - q) for p, q in zip(a, b, strict=True))


def relative(a, b):
    return distance(a, b) / max(1, abs(b[0]), abs(b[2]))


# the order of the error


@pytest.mark.few(0)
@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_error_over_first_omitted_terms_tends_to_one(sigma, start, order):
    for k in (0, 2):
        closeness = []
        for mu in MUS:
            now, finer = (model(sigma, mu, start, n).final[k] for n in (order, order + 1))
            closeness.append(abs((exact(sigma, mu, start).final[k] - now) / (finer - now) - 1))
        assert closeness[-1] < 1e-8
        assert all(b < a for a, b in pairwise(closeness[-4:]))


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.few(2)
def test_error_is_bounded_by_powers_of_mu_log(sigma, start, order):
    for mu in MUS[1:]:
        small = mpmath.mpf(mu) * mpmath.log(1 / mpmath.mpf(mu))
        assert relative(model(sigma, mu, start, order).final, exact(sigma, mu, start).final) < 4 * small ** (order + 1)


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("start", STARTS)
def test_order_one_is_right_to_eight_digits_at_a_millionth(sigma, start):
    for until in (1, UNTIL):
        scene = ap.Scene(sigma, "1e-6", start, until)
        assert relative(ap.solve(scene, "jump", order=1).final, ap.solve(scene, digits=30).final) < 1e-8


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.few(4)
def test_modes_and_events_are_those_of_the_exact_flow(sigma, start):
    for mu in MUS[1:5]:
        found, truth = model(sigma, mu, start, 1), exact(sigma, mu, start)
        assert found.modes == truth.modes
        for a, b in zip(found.events, truth.events, strict=True):
            assert a.kind == b.kind
            assert abs(a.t - b.t) < 40 * (mpmath.mpf(mu) * mpmath.log(mpmath.mpf(mu))) ** 2


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.few(6)
def test_the_composite_holds_uniformly_in_time(sigma, start, order):
    scaled = []
    for mu in ("1e-3", "1e-4", "1e-5"):
        small = float(mu) * np.log(1 / float(mu))
        truth, found = exact(sigma, mu, start), ap.solve(ap.Scene(sigma, mu, start, UNTIL), "jump", order=order)
        ends = [0, *(float(e.t) for e in truth.events), UNTIL]
        inner = [u for a, b in pairwise(ends) for u in np.linspace(a + 0.02 * (b - a), b - 0.02 * (b - a), 9)]
        times = np.array([*inner, *(float(mu) * k for k in range(20))])
        states = np.array([truth(t) for t in times], dtype=float).T
        error = abs(found(times) - states) / np.array([[1], [1 + abs(states[1]).max()], [1]])
        scaled.append(error.max() / small ** (order + 1))
    assert max(scaled) < 30


# the predicted error


def random_scenes(count, wild):
    rng = np.random.default_rng(4)
    for _ in range(count):
        sigma = rng.choice([-1.7, -1.2, -0.5, 0.5, 1, 3]) if rng.random() < 0.5 else rng.uniform(-1.9, 5)
        mu, start = 10 ** rng.uniform(-9, -2), rng.uniform(-2, 2, 3)
        until = rng.choice([1, 5, 10 ** rng.uniform(-3, 1)])
        if wild:
            sigma = rng.choice([sigma, 10 ** rng.uniform(-6, 1), -1.9 * 10 ** rng.uniform(-6, 0)])
            mu, start = 10 ** rng.uniform(-10, 0.5), rng.choice([-1, 1], 3) * 10 ** rng.uniform(-6, 4, 3)
            start[2] *= rng.random() > 0.2
        static = sigma + rng.choice([0, rng.uniform(0, 2)])
        yield ap.Scene(float(sigma), float(mu), tuple(map(float, start)), float(until), float(static))


@pytest.mark.parametrize("wild", [False, True])
@pytest.mark.parametrize(
    ("method", "order"), [("jump", 0), ("jump", 1), ("jump", 2), ("slow", 0), ("slow", 1), ("rigid", 0)]
)
@pytest.mark.few(2)
def test_the_predicted_error_bounds_the_measured_one(method, order, wild):
    followed = 0
    for scene in random_scenes(250, wild):
        try:
            path = ap.solve(scene, method, order=order)
        except (OutOfRange, NoManifold, NoMotion, TwoMotions):
            continue
        followed += 1
        assert relative(path.final, ap.solve(scene).final) <= path.error + 2e-15
    assert followed > (40 if wild else 60)


@pytest.mark.parametrize(
    "scene",
    [
        ap.Scene(2.865, 5.7266e-6, (8556.782, -8557.185, 2.4734), 3.468, 4.182),
        ap.Scene(0.007128, 4.34348e-8, (-3730304.81, 3730305.27, -1.808), 1),
        ap.Scene(-0.5, 0.015468453981553568, (-1.1166838128544083, -1.5989040335886555, -2.170133457622422), 16.7),
    ],
    ids=["a coincidence makes the second term small", "large x", "the second term vanishes"],
)
@pytest.mark.parametrize("order", range(5))
@pytest.mark.few(1)
def test_the_prediction_allows_for_series_that_converge_slowly(scene, order):
    path = ap.solve(scene, "jump", order=order)
    assert relative(path.final, ap.solve(scene, digits=30).final) <= path.error + 2e-15


@pytest.mark.parametrize("order", range(5))
@pytest.mark.few(1)
def test_where_the_limit_misleads_the_series_is_refused_to_every_order(order):
    # sigma < 4 mu; and mu/sigma = 0.14, where a series with amplitudes 1/sigma has z' = 104 at the start, not -1/4
    slow = ap.Scene(0.00052, 0.00232, (0.79, -2.8, 0.00049), 0.196)
    start = (0.8547779221390002, -2.1026124665526833, 4.5641247495281463e-07)
    missed = ap.Scene(-0.00018075955636440692, 2.4751133131876675e-05, start, 3.1237600709664004e-05, 1.31)
    # just beyond the edge of the cone, whence mu y carries the load back into it
    held = ap.Scene(3.0870791654617653, 0.27751067150580233, (-0.4932988354789227, 0.657581239697989, 0), 2.53)
    # in stick the load settles on -mu x, near the edge; and beside Pi2 on the separatrix, mu (x + 1/sigma) off Pi2
    settles = ap.Scene(8.941294644370325, 0.030664307591589633, (-2.3374041450707486, 2.447198471059221, 0), 1.91)
    divides = ap.Scene(1, 1.4621e-4, (-1.637977, 0.637884, 0.0028287), 4.75)
    # Pi2 meets z = 0 just below the edge 1/(sigma0 + 3), and for this mu above it
    arrives = ap.Scene(-1.7, 0.04, (-2.3, 0.3, -0.36), 16, -1.374)
    for scene, words in (
        (arrives, "slip_same does not follow the arrival"), (slow, "not fast"),
        (missed, "meets z = 0 in slip_opposite"), (held, "returns to z = 0 in slip_same"),
        (settles, "slow line of stick is far"), (divides, "slow line of slip_opposite is far"),
    ):
        with pytest.raises(OutOfRange, match=words):
            ap.solve(scene, "jump", order=order)


def test_ordinary_scenes_are_hardly_ever_refused():
    found = sum(_follows(scene) for scene in random_scenes(250, False))
    assert found >= 245


def _follows(scene):
    try:
        return bool(ap.solve(scene, "jump"))
    except OutOfRange:
        return False


@pytest.mark.slow
def test_a_higher_order_predicts_and_has_a_smaller_error():
    scene = ap.Scene(1, "1e-4", (0, "1/5", -1), 1)
    truth = ap.solve(scene, digits=40)
    paths = [ap.solve(scene, "jump", order=n, digits=40) for n in range(6)]
    errors = [relative(path.final, truth.final) for path in paths]
    assert all(b < a / 300 for a, b in pairwise(errors))
    assert all(0.3 * path.error < error <= path.error for path, error in zip(paths, errors, strict=True))


# where it fails


@pytest.mark.parametrize(
    ("sigma", "mu", "start", "words"),
    [
        (1, 1e-3, (0, 0.2, -1e-3), "mu/|z| = 1 is not small"),
        (1, 1e-3, (0, -2, -1e-4), "mu/|z| = 10 is not small"),
        (1, 1e-3, (0, -1.0001, 1), "mu |x + 1/sigma|/|1 + sigma s| = 10 is not small"),
        (1, 1e-3, (300, 0.2, -1), "mu (|x| + |y|) = 0.3 is not small"),
        (1, 1e-3, (-400, 0.2, -1), "mu (|x| + |y|) = 0.4 is not small"),
        (1e-3, 1e-4, (0, 0.2, -1), "mu log(1/mu)/|sigma| = 0.921 is not small"),
        (-1e-4, 1e-4, (0, 0.2, -1), "mu log(1/mu)/|sigma| = 9.21 is not small"),
    ],
)
def test_a_refusal_names_the_number_that_is_not_small(sigma, mu, start, words):
    with pytest.raises(OutOfRange) as refusal:
        ap.solve(ap.Scene(sigma, mu, start, 1), "jump")
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "scenes",
    [
        [(1, 1e-6, (0, 0.2, -z)) for z in (1e-3, 1e-4, 1e-5, 1e-6)],
        [(1, 1e-6, (0, -1 + d, 1)) for d in (0.5, 1e-2, 1e-4, 1e-5, 1e-6)],
        [(1, 1e-6, (0, -1 - d, 1)) for d in (0.5, 1e-2, 1e-4, 1e-5, 1e-6)],
        [(1, 1e-6, (-x, 0.2 + x, -1)) for x in (1e2, 1e3, 1e4, 1e5, 1e6)],
        [(s, 1e-6, (0, 0.2, -1)) for s in (1, 1e-1, 1e-3, 1e-4, 1e-6)],
    ],
    ids=["small z", "above the divide", "below the divide", "large x", "small sigma"],
)
def test_towards_the_edge_of_its_range_the_error_grows_as_predicted_until_it_is_refused(scenes):
    predicted = []
    for sigma, mu, start in scenes:
        scene = ap.Scene(sigma, mu, start, 1)
        try:
            path = ap.solve(scene, "jump")
        except OutOfRange:
            predicted.append(np.inf)
            continue
        predicted.append(path.error)
        assert relative(path.final, ap.solve(scene).final) <= path.error + 2e-15
    assert predicted[-1] == np.inf
    assert predicted[0] < 1e-9
    assert all(a < b or a == b == np.inf for a, b in pairwise(predicted))


def test_repeated_collisions_begin_where_mu_x_reaches_one_and_are_never_predicted():
    # on Pi1 the load is (1 - mu x)/(sigma + 4) to first order
    for mu_x, collides in ((0.9, False), (1.1, True)):
        scene = ap.Scene(1, 1e-4, (mu_x * 1e4, 0.2 - mu_x * 1e4, -1), 1)
        assert (len(ap.solve(scene).modes) > 3) == collides
        with pytest.raises(OutOfRange):
            ap.solve(scene, "jump")


def test_stick_lasts_where_mu_x_passes_the_edge_of_the_cone_and_is_never_predicted():
    # in stick the load settles on -mu x to first order, which must lie below the edge 1/(sigma + 3)
    for mu_x, lasts in ((-0.2, False), (-0.3, True)):
        scene = ap.Scene(1, 1e-4, (mu_x * 1e4, 0.2 - mu_x * 1e4, -1), 1)
        hit, leave = ap.solve(scene).events
        assert (leave.t - hit.t > 0.1) == lasts
        with pytest.raises(OutOfRange):
            ap.solve(scene, "jump")


def test_starts_on_the_divide_and_at_sigma_zero_are_refused_by_name():
    with pytest.raises(OutOfRange, match="repelling manifold"):
        ap.solve(ap.Scene(1, 1e-3, (0, -1, 1), 1), "jump")
    with pytest.raises(OutOfRange, match="neither settles nor grows"):
        ap.solve(ap.Scene(0, 1e-3, (0, 1, -1), 1), "jump")


@pytest.mark.parametrize(("method", "order"), [("jump", -1), ("jump", 7), ("jump", 1.5), ("slow", True), ("rigid", 1)])
def test_an_order_that_is_not_known_is_refused(method, order):
    with pytest.raises(OrderError, match="takes whole orders"):
        ap.solve(ap.Scene(1, 1e-3, (0, 1, 1), 1), method, order=order)


# the rigid system


def test_the_steep_rigid_rod_has_no_motion_backwards():
    with pytest.raises(NoMotion, match="stops at once, slip_opposite -> stick -> slip_same"):
        ap.solve(ap.Scene(1, 1e-4, (0, 0.2, -1), 1), "rigid")


@pytest.mark.parametrize(("y", "words"), [(0.2, "the elastic one takes slip_same"), (-2, "stops at once and then")])
def test_the_steep_rigid_rod_has_two_motions_forwards_and_the_elastic_one_selects(y, words):
    with pytest.raises(TwoMotions, match=words):
        ap.solve(ap.Scene(1, 1e-4, (0, y, 1), 1), "rigid")


@pytest.mark.parametrize("sigma", [-1.7, -0.5, -0.01])
@pytest.mark.parametrize("z", [-0.3, 0, 0.3])
def test_the_shallow_rigid_rod_has_one_motion_with_the_accelerations_of_the_limit(sigma, z):
    path = ap.solve(ap.Scene(sigma, 1e-7, (0.3, 0.1, z), 2), "rigid")
    stop = -sigma * 0.3 if z < 0 else 0
    assert path.modes == (("slip_opposite", "slip_same") if z < 0 else ("slip_same",))
    assert path.final[2] == pytest.approx(max(z, 0) + (2 - stop) / (sigma + 4), abs=1e-12)
    assert [e.t for e in path.events] == pytest.approx([stop] if z < 0 else [], abs=1e-12)


def test_at_rest_the_steep_rigid_rod_has_the_one_motion_forwards():
    path = ap.solve(ap.Scene(1, 1e-6, (0, 0.2, 0), 1), "rigid")
    assert path.modes == ("slip_same",)
    assert path.final[2] == pytest.approx(0.2, abs=1e-12)


# slow flow


def test_slow_flow_begins_where_the_fast_fibre_through_the_start_meets_the_manifold():
    scene = ap.Scene(1, "1e-4", ("1/2", 3, 1), 1)
    for order in (0, 1, 2):
        path = ap.solve(scene, "slow", order=order, digits=40)
        assert path.modes == ("slip_same",)
        assert relative(path.final, ap.solve(scene, digits=40).final) < 100 * mpmath.mpf("1e-4") ** (order + 1)
    x, y, _ = path(0)
    assert abs(x + y - mpmath.mpf(1) / 5) < 1e-3
    assert abs(x - mpmath.mpf(1) / 2) < 1e-3


def test_slow_flow_is_refused_where_the_fast_motion_meets_the_plane_first():
    with pytest.raises(NoManifold, match="slip_opposite -> stick -> slip_same"):
        ap.solve(ap.Scene(1, 1e-4, (0, 0.2, -1), 1), "slow")


def test_slow_flow_predicts_how_far_the_first_layer_still_is_from_it():
    scene = ap.Scene(1, 1e-4, (0.5, 3, 1), 1e-4)
    path = ap.solve(scene, "slow")
    assert 1e-3 < relative(path.final, ap.solve(scene).final) <= path.error
    with pytest.raises(OutOfRange, match="left out"):
        ap.solve(ap.Scene(1, 1e-4, (0.5, 3, 1), 1e-5), "slow")


# arrays and numbers


def _path_or_refusal(scene, method, order):
    try:
        return ap.solve(scene, method, order=order), None
    except (OutOfRange, NoManifold, NoMotion, TwoMotions) as refusal:
        return None, type(refusal).__name__


@pytest.mark.parametrize(("method", "order"), [("jump", 0), ("jump", 1), ("jump", 3), ("slow", 0), ("rigid", 0)])
@pytest.mark.few(2)
def test_arrays_agree_with_single_scenes_in_states_errors_and_refusals(method, order):
    listed = [*random_scenes(60, False), *random_scenes(60, True)]
    listed += [ap.Scene(s, 1e-3, start, 1) for s in (0, 1, -1.5, -1) for start in ((0, -1, 1), (0, 0, 0), (1, 2, -1))]
    columns = np.array([(s.sigma, s.mu, *s.start, s.until, s.sigma0) for s in listed], dtype=float).T
    found = ap.solve_many(*columns, method=method, order=order)
    refused = 0
    for k, scene in enumerate(listed):
        path, refusal = _path_or_refusal(scene, method, order)
        if refusal:
            refused += 1
            assert found.reasons[found.reason[k]].startswith(f"{refusal}: ")
            assert np.isinf([found.error[k], *found.final[:, k]]).all()
            continue
        assert found.reason[k] == -1
        assert relative(found.final[:, k], path.final) < 1e-9 * path.error + 1e-13
        assert found.error[k] == pytest.approx(path.error, rel=0.1, abs=1e-13)
    assert 10 < refused < len(listed) - 10


def test_arrays_broadcast_and_every_refusal_has_its_words_in_one_line():
    found = ap.solve_many(1.0, np.array([[1e-3], [1e-6]]), 0, "1/5", np.array([-1, -0.5, -1e-7]), 1.0, method="jump")
    assert found.model == "jump"
    assert found.final.shape == (3, 2, 3)
    assert found.error.shape == found.reason.shape == (2, 3)
    assert (found.reason[:, 2] >= 0).all()
    assert (found.error[1, :2] < found.error[0, :2] / 1e4).all()
    assert all(words and "\n" not in words for words in found.reasons)
    divide = ap.solve_many(1.0, 1e-3, 0.0, -1.0, np.ones(3000), 1.0, method="jump")
    assert divide.reasons == ("OutOfRange: the start lies on the repelling manifold of slip_opposite, whose sides "
                              "differ",)


@pytest.mark.parametrize(("method", "order"), [("jump", 0), ("jump", 1), ("jump", 4), ("slow", 1), ("rigid", 0)])
@pytest.mark.few(1)
def test_the_predicted_error_bounds_the_measured_one_on_ten_thousand_scenes(method, order):
    rng, n = np.random.default_rng(1991), 10000
    x, y, z = rng.choice([-1, 1], (3, n)) * 10 ** rng.uniform(-4, 2, (3, n))
    sigma, mu = rng.uniform(-1.95, 8, n), 10 ** rng.uniform(-10, -0.5, n)
    y = np.where(rng.random(n) < 0.2, -1 / sigma - x + y * mu, y)
    scenes = sigma, mu, x, y, np.where(rng.random(n) < 0.2, z * mu, z), 10 ** rng.uniform(-2, 1.3, n)
    found, exact = ap.solve_many(*scenes, method=method, order=order), ap.solve_many(*scenes)
    error = abs(found.final - exact.final)[::2].max(axis=0) / np.maximum(1, abs(exact.final[::2]).max(axis=0))
    assert (error[found.reason < 0] <= found.error[found.reason < 0] + 1e-13).all()
    assert (found.reason < 0).sum() > 1000


@pytest.mark.parametrize("method", ["jump", "slow", "rigid"])
@pytest.mark.few(1)
def test_no_scene_and_many_scenes_are_as_good_as_one(method):
    assert ap.solve_many(1, 1e-3, 0, np.zeros((0, 4)), 1, 5, method=method).final.shape == (3, 0, 4)
    many = ap.solve_many(-0.5, 1e-4, np.linspace(0, 1, 70000), 0.2, -1.0, 2, method="jump")
    few = ap.solve_many(-0.5, 1e-4, np.linspace(0, 1, 70000)[::9999], 0.2, -1.0, 2, method="jump")
    assert np.array_equal(many.final[:, ::9999], few.final)


def test_bad_arguments_of_arrays_are_refused_by_name():
    with pytest.raises(InputError, match=r"x\[1\] = nan: it must be a finite number"):
        ap.solve_many(1.0, 1e-3, np.array([0, np.nan]), 0.2, -1.0, 1.0, method="jump")
    with pytest.raises(InputError, match="mu = -1"):
        ap.solve_many(1.0, -1, 0, 0.2, -1.0, 1.0, method="slow")
    with pytest.raises(InputError, match="it must be at least sigma"):
        ap.solve_many(1.0, 1e-3, 0, 0.2, -1.0, 1.0, 0.5, "jump")
    with pytest.raises(InputError, match="method 'exact' has no option 'order'; it has events, progress"):
        ap.solve_many(1.0, 1e-3, 0, 0.2, -1.0, 1.0, order=1)
    with pytest.raises(OrderError, match="takes whole orders"):
        ap.solve_many(1.0, 1e-3, 0, 0.2, -1.0, 1.0, method="jump", order=7)
    with pytest.raises(UnknownName, match="'radau' does not follow arrays; choose one of exact, rigid, slow, jump"):
        ap.solve_many(1.0, 1e-3, 0, 0.2, -1.0, 1.0, method="radau")


def test_dense_output_has_the_shape_of_the_times_and_ends_in_the_final_state():
    path = ap.solve(ap.Scene(1, 1e-3, (0, 0.2, -1), 1), "jump")
    times = np.linspace(0, 1, 12).reshape(3, 4)
    assert path(times).shape == (3, 3, 4)
    assert path(0.5).shape == (3,)
    assert np.allclose(path(1.0), path.final, rtol=1e-14)
    with pytest.raises(InputError, match=r"from 0 to until = 1"):
        path(1.5)


def test_more_digits_give_mpf_states_and_events_on_the_plane():
    path = ap.solve(ap.Scene(1, "1e-5", (0, "0.2", -1), 1), "jump", order=4, digits=30)
    assert all(isinstance(v, mpmath.mpf) for v in path.final)
    assert path.events[0].z == 0
    assert abs(path.events[1].x + path.events[1].y - mpmath.mpf(1) / 4) < mpmath.mpf(10) ** -35
    assert path(np.array([0.1, 0.2])).shape == (3, 2)


@pytest.mark.parametrize("digits", [None, 20])
@pytest.mark.parametrize("beyond", [2, [0, 2], -1])
def test_a_model_knows_no_states_outside_its_run(digits, beyond):
    path = ap.solve(ap.Scene(1, "1e-3", (0, "0.2", -1), 1), "jump", digits=digits)
    with pytest.raises(InputError, match=r"t = (2|-1).*: it must be from 0 to until = 1"):
        path(beyond)


def test_a_dip_to_z_zero_that_the_series_does_not_see_is_refused():
    start = (-1.0499066318716528, 0.070714082539439, 5.251864209683939e-06)
    numbers = 0.08375816648488327, 0.01122910310290655, *start, 2.827564024019965
    scene = ap.Scene(*numbers[:2], start, numbers[-1])
    assert ap.solve(scene).modes == ("slip_opposite", "stick", "slip_opposite", "slip_same")
    for order in (0, 1, 2):
        with pytest.raises(OutOfRange, match="meets z = 0 in slip_opposite unexpectedly"):
            ap.solve(scene, method="jump", order=order)
        assert np.isinf(ap.solve_many(*numbers, method="jump", order=order).error)


@pytest.mark.parametrize(("order", "modes", "sigma", "mu", "start", "until"), [
    (1, ("slip_same", "stick", "slip_same"),  # z is least between the reversals by its fast and by its slow part
     0.20263079517743865, 0.25484439656394003, (-1.557439079975939, 6.961207761020373, 1.054629597418609), 93.74),
    (1, ("slip_same", "stick", "slip_same"),  # the least z of the series exceeds 0 by less than the omitted terms
     -1.9194332007574082, 0.15431863702813595, (2.0953400186428466, -0.06186439096993861, 0.04196349010541235), 119.99),
    (2, ("slip_same", "slip_opposite", "stick"),  # the series stops after the end
     2.002773281744515, 0.014608660055185236, (0.000314056504947883, -199.39742926222283, -2.498370445695095), 0.0326),
])
def test_a_stop_that_the_series_does_not_see_is_refused(order, modes, sigma, mu, start, until):
    scene = ap.Scene(sigma, mu, start, until)
    assert ap.solve(scene).modes == modes
    with pytest.raises(OutOfRange, match=r"meets z = 0 in slip_.* unexpectedly"):
        ap.solve(scene, method="jump", order=order)
    assert np.isinf(ap.solve_many(sigma, mu, *start, until, method="jump", order=order).error)


def test_a_model_with_digits_knows_its_end_under_the_double_next_to_it():
    path = ap.solve(ap.Scene(1, "1/1000", (0, "1/5", -1), "0.1"), method="jump", digits=20)
    assert distance(path(0.1), path.final) < 1e-16
