"""The ladder of any scene: the choice changes with the tolerance, and predictions bound what is measured."""

import random

import pytest
import sympy as sp

import asympk as ap
from asympk.errors import AsympkError, InputError
from asympk.studies.general import calibrated_error

x, y, z, F, t = sp.symbols("x y z F t", real=True)
mu, kappa, s = sp.symbols("mu kappa s", positive=True)

ENZYME = ap.System.smooth(slow={x: -x + (x + kappa - s) * y}, fast={y: x - (x + kappa) * y}, small=mu)
CUBIC = ap.System.smooth(slow={x: -x * y + s}, fast={y: x - y - kappa * y**3}, small=mu)
FORCED = ap.System.smooth(slow={x: -x + y * sp.cos(t)}, fast={y: sp.sin(2 * t) + x - kappa * y}, small=mu, time=t)
ROD = ap.System.with_friction(
    slow={x: y}, fast={y: 1 - 2 * (x + y) + F}, velocity={z: 1 - (x + y) + F}, force=F, load=x + y, kinetic=s + 2,
    small=mu,
)  # fmt: skip


def _enzyme(small="1e-3"):
    return ap.Scene(system=ENZYME, values={kappa: 1, s: "1/2", mu: small}, start={x: 1, y: 0}, until=1)


def test_the_least_model_of_a_reaction_changes_with_the_tolerance():
    ladder = ap.least_model(_enzyme(), 1e-2)
    assert [r.model for r in ladder.rungs] == ["slow", "jump-0", "jump-1", "jump-2", "exact"]
    assert all(r.measured <= r.predicted for r in ladder.rungs)
    assert all(r.cost > 0 for r in ladder.rungs)
    assert ladder.model == "slow"
    start = ap.Scene(system=ENZYME, values={kappa: 1, s: "1/2", mu: "1e-3"}, start={x: 1, y: 0}, until="1e-3")
    assert ap.least_model(start, 1e-3).model == "jump-0"
    assert ap.least_model(start, 1e-6).model == "jump-1"
    assert ap.least_model(start, 1e-9).model == "jump-2"


def test_a_tolerance_below_every_prediction_is_refused():
    with pytest.raises(InputError, match="predicts"):
        ap.least_model(_enzyme("1/10"), 1e-12)


@pytest.mark.parametrize("start", [(0, "1/5", -1), ("3/10", -2, "-1/2"), (0, 0, 1)])
def test_the_calibrated_error_of_a_jump_bounds_the_error(start):
    scene = ap.Scene(system=ROD, values={s: 1, mu: "1e-5"}, start=start, until=2)
    truth = ap.solve(ap.Scene(sigma=1, mu="1e-5", start=start, until=2)).final
    off = max(abs(p - q) for p, q in zip(ap.solve(scene, "jump").final, truth, strict=True))
    predicted = calibrated_error(scene, "jump", {})
    assert off <= predicted < 4 * off


def test_the_ladder_of_a_scene_with_friction_has_its_jump_and_the_exact_motion():
    ladder = ap.least_model(ap.Scene(system=ROD, values={s: 1, mu: "1e-5"}, start=(0, "1/5", -1), until=1), 1e-2)
    assert [r.model for r in ladder.rungs] == ["slow", "jump-0", "exact"]
    assert ladder.rungs[0].reason.startswith("NoManifold")
    assert ladder.model == "jump-0"
    assert all(r.measured <= r.predicted for r in ladder.rungs[1:])


@pytest.mark.parametrize("system", [ENZYME, CUBIC, FORCED], ids=["enzyme", "cubic", "forced"])
def test_every_prediction_bounds_the_error_on_random_scenes(system):
    drawn, applied = random.Random(7), 0
    for _ in range(8):
        values = {kappa: f"{drawn.uniform(0.3, 2):.3f}", s: f"{drawn.uniform(0.1, 1):.3f}"}
        values = {k: v for k, v in values.items() if k in system.parameters}
        small = f"{10 ** drawn.uniform(-4, -1):.3e}"
        start = [f"{drawn.uniform(0.1, 2):.3f}" for _ in "xy"]
        until = f"{drawn.uniform(0.01, 2):.3f}"
        scene = ap.Scene(system=system, values={**values, mu: small}, start=start, until=until)
        truth = ap.solve(scene, "radau", rtol=1e-11, atol=1e-12).final
        for method, order in (("slow", 1), ("jump", 0), ("jump", 1), ("jump", 2)):
            try:
                path = ap.solve(scene, method, order=order)
            except AsympkError:
                continue
            scale = max(1, *map(abs, truth))
            error = max(abs(p - q) for p, q in zip(path.final, truth, strict=True)) / scale
            assert error <= path.error + 1e-9, (values, small, start, method, order)
            applied += 1
    assert applied > 24
