"""The ladder of models: predictions bound the truth, refusals are named, the choice is the lowest that will do."""

import json
import random
from dataclasses import replace

import numpy as np
import pytest

from asympk.errors import InputError
from asympk.methods import solve
from asympk.output.terminal import ladder_as_text
from asympk.scene import Scene
from asympk.studies.ladder import _least, distance, rungs
from asympk.studies.least import LADDER, atlas, least_model
from asympk.systems import crank_slider

BACKWARD = Scene(sigma=1, mu=1e-4, start=(0, 0.2, -1), until=2)
FORWARD = Scene(sigma=1, mu=1e-4, start=(0, 0.2, 1), until=2)
SHALLOW = Scene(sigma=-1, mu=1e-4, start=(0, 0.2, -1), until=2)


def _random_scenes(seed, count):
    drawn = random.Random(seed)
    for _ in range(count):
        sigma = drawn.choice([drawn.uniform(-1.99, 4), drawn.choice([-1.7, -1.2, -0.5, 0.5, 1.0, 3.0])])
        start = tuple(drawn.uniform(-3, 3) for _ in range(3))
        sigma0 = sigma + drawn.choice([0, 0, drawn.uniform(0, 3)])
        yield Scene(sigma, 10 ** drawn.uniform(-8, -1), start, drawn.uniform(0.1, 5), sigma0)


@pytest.mark.further
def test_every_prediction_bounds_the_measured_error_on_random_scenes():
    applied = 0
    for scene in _random_scenes(seed=1991, count=250):
        for rung in rungs(scene):
            if rung.predicted is not None:
                assert rung.measured <= rung.predicted, (scene, rung)
                applied += 1
    assert applied > 900


@pytest.mark.further
def test_the_prediction_of_an_integrated_motion_bounds_its_error_where_a_looser_tolerance_is_right_by_chance():
    # the slider-crank is wrong by 3e-10 with a tolerance of 1e-8, by 1e-9 with 1e-10, and by 1e-11 with jump of order 2
    (stroke,) = crank_slider.scenes()
    truth, (*_, exact) = solve(stroke, "jump", order=2), rungs(stroke)
    assert truth.error < 1e-11
    assert exact.model == "exact"
    assert distance(solve(stroke).final, truth.final) < exact.predicted


def test_predictions_are_not_idle_the_first_omitted_term_is_nearly_the_error():
    ladder = least_model(BACKWARD)
    for rung in ladder.rungs:
        if rung.model.startswith("jump"):
            assert 0.9 < rung.measured / rung.predicted <= 1


@pytest.mark.parametrize(
    ("scene", "rtol", "model"),
    [
        (BACKWARD, 1e-3, "jump-0"),
        (BACKWARD, 1e-5, "jump-1"),
        (BACKWARD, 1e-9, "exact"),
        (FORWARD, 1e-3, "slow"),
        (SHALLOW, 1e-3, "rigid"),
        (SHALLOW, 1e-7, "slow"),
    ],
)
def test_the_least_model_is_the_lowest_rung_below_the_tolerance(scene, rtol, model):
    ladder = least_model(scene, rtol)
    assert ladder.model == model
    assert ladder.predicted < rtol
    below = [rung for rung in ladder.rungs[: list(LADDER).index(model)] if rung.predicted is not None]
    assert all(rung.predicted >= rtol for rung in below)


def test_where_the_rigid_rod_has_no_motion_or_two_its_rung_says_so():
    rigid = {name: rungs(scene)[0] for name, scene in (("back", BACKWARD), ("forth", FORWARD))}
    assert rigid["back"].reason.startswith("NoMotion: the rigid rod has no motion")
    assert rigid["forth"].reason.startswith("TwoMotions: the rigid rod has two motions")
    assert rigid["back"].predicted is None


def test_the_table_marks_the_chosen_rung_and_the_json_has_every_rung():
    ladder = least_model(BACKWARD, 1e-5)
    assert "-> jump-1" in ladder_as_text(ladder)
    last = ladder_as_text(ladder).splitlines()[-1]
    assert last == "least model, the lowest for an error below 1e-05 at until: jump-1"
    told = json.loads(json.dumps(ladder.as_dict()))
    assert [rung["model"] for rung in told["rungs"]] == list(LADDER)
    assert told["rungs"][-1]["cost"] == 1


def test_the_table_gives_a_reason_once():
    ladder = least_model(BACKWARD)
    rungs = tuple(replace(rung, reason="no slow manifold") if rung.reason else rung for rung in ladder.rungs)
    lines = ladder_as_text(replace(ladder, rungs=rungs)).splitlines()
    assert [line.strip() for line in lines if line.startswith("      ")] == ["no slow manifold", "as rigid"]


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_the_atlas_is_the_least_model_place_by_place(rtol):
    z = np.concatenate([-np.logspace(-3, 1, 5), [0], np.logspace(-3, 1, 5)])
    sigma, mu = np.array([-1.7, -0.5, 0, 0.5, 3]), np.logspace(-7.9, -0.9, 4)
    found = atlas(sigma[:, None, None], mu[:, None], 0.0, 0.2, z, 2.0, rtol)
    for i, j, k in np.ndindex(found.shape):
        scene = Scene(sigma[i], mu[j], (0.0, 0.2, z[k]), 2.0)
        assert found[i, j, k] == _least(scene, rtol)
    assert len(np.unique(found)) == len(LADDER)


def test_the_atlas_takes_static_friction_and_decimals_as_words():
    found = atlas("1/2", "1e-4", 0, "1/5", [-1, 1], 2, sigma0=[["1/2"], ["3"]])
    assert found.tolist() == [[list(LADDER).index("jump-0"), list(LADDER).index("slow")]] * 2
    with pytest.raises(InputError, match="mu"):
        atlas(1, [-1e-3, 1e-3], 0, 0.2, -1, 1)


def test_the_atlas_tells_its_progress():
    shares = []
    atlas(1.0, 1e-3, 0.0, 0.2, np.linspace(-1, -0.5, 3), 1.0, progress=shares.append)
    assert shares[0] == 0


@pytest.mark.parametrize("rtol", [0, -1, 1e-16, float("nan"), float("inf"), "small", None])
def test_a_tolerance_that_is_none_is_refused(rtol):
    with pytest.raises(InputError, match="rtol = "):
        least_model(BACKWARD, rtol)
