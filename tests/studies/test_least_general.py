"""The ladder of any scene: the choice changes with the tolerance, and predictions bound what is measured."""

import math
import random
from functools import partial
from itertools import count

import pytest
import sympy as sp

import asympk as ap
from asympk.errors import AsympkError, InputError, OutOfRange
from asympk.integrators import collocation
from asympk.studies.ladder import predicted

x, y, z, F, t = sp.symbols("x y z F t", real=True)
mu, kappa, s = sp.symbols("mu kappa s", positive=True)

ENZYME = ap.System.smooth(slow={x: -x + (x + kappa - s) * y}, fast={y: x - (x + kappa) * y}, small=mu)
CUBIC = ap.System.smooth(slow={x: -x * y + s}, fast={y: x - y - kappa * y**3}, small=mu)
FORCED = ap.System.smooth(slow={x: -x + y * sp.cos(t)}, fast={y: sp.sin(2 * t) + x - kappa * y}, small=mu, time=t)
ROD = ap.System.with_friction(
    slow={x: y}, fast={y: 1 - 2 * (x + y) + F}, velocity={z: 1 - (x + y) + F}, force=F, load=x + y, kinetic=s + 2,
    small=mu,
)


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
    with pytest.raises(InputError, match=r"no model is so accurate \(exact: predicted"):
        ap.least_model(_enzyme("1/10"), 1e-12)


@pytest.mark.slow
def test_where_doubles_do_not_hold_the_exact_motion_its_rung_says_so_and_another_model_is_the_least():
    """A block stops at 2.4889184921, and its load jumps within mu: in doubles the stop is 2e-9 beside."""
    load, v = sp.symbols("N v", real=True)
    block = ap.System.with_friction(
        slow={x: v}, fast={load: 1 + x**2 / 2 - load + s * F}, velocity={v: F - x}, force=F, load=load,
        kinetic=sp.S.Half, static=sp.Rational(4, 5), small=mu)
    scene = ap.Scene(system=block, values={s: "0.139", mu: "1.56e-8"}, start={x: "-1.12", load: "1.98", v: "0.586"},
                     until="2.4889185")
    ladder = ap.least_model(scene, 1e-5)
    assert ladder.rungs[-1].reason.startswith("Undecided: errors of the run grow")
    assert (ladder.model, ladder.rungs[-1].predicted) == ("slow", None)
    assert all(rung.measured <= rung.predicted and rung.cost is None for rung in ladder.rungs if rung.predicted)
    with pytest.raises(InputError, match=r"no model is so accurate \(exact: Undecided"):
        ap.least_model(scene, 1e-9)


def test_where_no_model_follows_a_motion_no_larger_tolerance_is_advised():
    """A pendulum stands 9e-11 beside its highest position: an error of 1e-16 is 1 after 37 units of time."""
    system = ap.System.smooth({x: y, y: -sp.sin(x)}, {s: x - s}, mu)
    scene = ap.Scene(system=system, values={mu: "1e-4"}, start={x: "3.1415926535", y: 0, s: 1}, until=40)
    with pytest.raises(InputError, match=r"exact: Undecided.*\); solve\(scene, digits=n\) may follow it"):
        ap.least_model(scene, seconds=1)


def test_a_ladder_whose_time_is_over_says_which_rungs_were_not_tried_and_which_not_measured(monkeypatch):
    ladder = ap.least_model(_enzyme(), 1e-2, seconds=1e-9)
    assert [r.reason for r in ladder.rungs] == 4 * ["not tried: the time was over"] + \
        ["not measured: no reference within the time"]
    assert (ladder.model, ladder.rungs[-1].measured) == ("exact", None)
    monkeypatch.setattr(collocation, "monotonic", count(step=10).__next__)
    ladder = ap.least_model(_enzyme(), 1e-2, seconds=5)
    assert ladder.model == "slow"
    assert all(r.measured is None and r.cost > 0 and "not measured" in r.in_words for r in ladder.rungs)
    with pytest.raises(InputError, match="seconds"):
        ap.least_model(_enzyme(), 1e-2, seconds=0)


def test_a_ladder_whose_reference_is_out_of_range_says_so(monkeypatch):
    def apart(*_, **__):
        raise OutOfRange("two references differ by 1")
    monkeypatch.setattr(collocation, "_references", apart)
    ladder = ap.least_model(_enzyme(), 1e-2)
    assert {r.reason for r in ladder.rungs} == {"not measured: OutOfRange: two references differ by 1"}


@pytest.mark.parametrize("start", [(0, "1/5", -1), ("3/10", -2, "-1/2"), (0, 0, 1)])
def test_the_limit_with_friction_is_wrong_by_what_its_distance_from_the_next_order_predicts(start):
    scene = ap.Scene(system=ROD, values={s: 1, mu: "1e-5"}, start=start, until=2)
    truth = ap.solve(ap.Scene(sigma=1, mu="1e-5", start=start, until=2)).final
    path = ap.solve(scene, "jump")
    off = max(abs(p - q) for p, q in zip(path.final, truth, strict=True))
    assert off / max(1, *map(abs, truth)) <= predicted(path, partial(ap.solve, scene)) < 1.01 * off


def test_the_ladder_of_a_scene_with_friction_has_its_jumps_and_the_exact_motion():
    scene = ap.Scene(system=ROD, values={s: 1, mu: "1e-5"}, start=(0, "1/5", -1), until=1)
    ladder = ap.least_model(scene, 1e-2)
    assert [r.model for r in ladder.rungs] == ["rigid", "slow", "jump-0", "jump-1", "jump-2", "exact"]
    assert all(rung.reason.startswith("NoManifold") for rung in ladder.rungs[:2])
    assert ladder.model == "jump-0"
    assert all(r.measured <= r.predicted for r in ladder.rungs[2:])
    assert ap.least_model(scene, 1e-6).model == "jump-1"
    assert ap.least_model(ap.Scene(system=ROD, values={s: 1, mu: "1e-5"}, start=(0, 0, 1), until=1)).model == "rigid"


@pytest.mark.parametrize(("small", "start"), [("1/10", (0, 1, 1)), ("1e-12", (0, "1/5", -1))])
def test_an_exact_motion_in_closed_form_is_as_wrong_as_its_own_account_of_rounding_says(small, start):
    """In the jump of the second y is of order 1/mu, and its errors decay after it."""
    ladder = ap.least_model(ap.Scene(system=ROD, values={s: 1, mu: small}, start=start, until=1), 1e-12)
    assert (ladder.model, ladder.rungs[-1].predicted) == ("exact", pytest.approx(3e-15, abs=2e-15))
    assert ladder.rungs[-1].measured <= ladder.rungs[-1].predicted


def test_an_exact_motion_whose_rates_have_no_derivative_is_compared_with_other_tolerances():
    """The drained tank stays empty, x = 0, and the root of its rate has no slope there."""
    x, v, level = sp.symbols("x v level", real=True)
    tank = ap.System.smooth(slow={x: v, v: -sp.sqrt(level) - x, level: -level}, fast={}, small=None)
    exact = ap.least_model(ap.Scene(system=tank, start={x: 1, v: 0, level: 0}, until=1)).rungs[-1]
    wrong = abs(ap.solve(ap.Scene(system=tank, start={x: 1, v: 0, level: 0}, until=1)).final[0] - math.cos(1))
    assert wrong < exact.predicted < 1e-6


def test_the_rigid_rung_of_an_elastic_contact_is_the_rigid_mechanism():
    mechanism, numbers = ap.systems.held_rod.mechanism(), {"m": 1, "alpha": "6/5", "P": 1, "kappa": 1, "f": "1/2"}
    system = mechanism.elastic(mu, sp.Rational(1, 2))
    start = {"x1": 0, "x2": 0, "x": "1/4", "y": 0, "z": 1}
    scene = ap.Scene(system=system, values={**numbers, mu: "1e-8"}, start=start, until="1/2")
    rigid = ap.Scene(system=mechanism.rigid(), values=numbers, until="1/2",
                     start={"x1": 0, "x2": 0, "x1'": 1, "x2'": 1})
    rung = dict(zip(scene.names, ap.solve(scene, "slow", order=0).final, strict=True))
    truth = dict(zip(rigid.names, ap.solve(rigid).final, strict=True))
    assert (rung["x1"], rung["x2"], rung["z"]) == pytest.approx((truth["x1"], truth["x2"], truth["x1'"]), abs=1e-7)
    with pytest.raises(InputError, match="the rigid limit is method 'slow' with order = 0"):
        ap.solve(scene, "rigid")


@pytest.mark.parametrize(("values", "start", "message"), [
    ({kappa: 1, s: "1/2", mu: [1e-3, 1e-4, 1e-5]}, {x: [1, 2], y: 0}, "the arrays do not broadcast"),
    (1e-3, {x: 1, y: 0}, "values = 0.001: give a mapping"),
])
def test_the_atlas_of_a_system_refuses_what_is_no_array_for_each_name(values, start, message):
    with pytest.raises(InputError, match=message):
        ap.atlas(system=ENZYME, values=values, start=start, until=1)


def test_the_atlas_of_a_reaction_needs_more_of_a_model_as_its_parameter_grows():
    found = ap.atlas(system=ENZYME, values={kappa: 1, s: "1/2", mu: ["1e-5", "1e-3", "1e-2", "1/5"]},
                     start={x: 1, y: 0}, until=1, rtol=1e-4)
    assert found.tolist() == sorted(found.tolist())
    assert found[0] < found[-1]
    scene = ap.Scene(system=ENZYME, values={kappa: 1, s: "1/2", mu: "1e-2"}, start={x: 1, y: 0}, until=1)
    assert [r.model for r in ap.least_model(scene, 1e-4).rungs][found[2]] == ap.least_model(scene, 1e-4).model


@pytest.mark.further
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
