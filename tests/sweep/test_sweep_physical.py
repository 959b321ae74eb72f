"""Sweeps in physical quantities: what ``solve`` says of the same scene, told in the same units."""

import numpy as np
import pytest
from sweeptext import parse_sweep

import asympk as ap
from asympk.errors import InputError
from asympk.sweep import chunks, results, run_sweep, summary

TEXT = """
seed = 5
count = 6
m = 0.5
P = { uniform = [10, 30] }
f = [0.8, 1.2]
alpha = { grid = ["60 deg", "75 deg"], points = 2 }
l = 0.3
k = { log_uniform = [1e5, 1e7] }
h = 0.1
start = [0, 0.2, { uniform = [-1, 1] }]
until = 0.2
"""


def _whole(out):
    (_, _, columns), = results(out)
    return columns


def _scene(here):
    start = [here.pop(name) for name in ("R_1", "dR_1", "u")]
    return ap.Scene.physical(**here, start=start)


@pytest.mark.parametrize("more", ["", "f0 = 1.5\n"])
def test_every_row_is_what_solve_says_in_physical_quantities(tmp_path, more):
    sweep = parse_sweep(more + TEXT)
    assert run_sweep(sweep, tmp_path) == 1
    found = _whole(tmp_path)
    columns = {field: np.broadcast_to(values, 24) for field, values in sweep.quantities(0, 24).items()}
    for row in range(24):
        path = ap.solve(_scene({field: float(values[row]) for field, values in columns.items()}))
        expected = path.physical().final
        assert [found[name][row] for name in ("R_1", "dR_1", "u")] == pytest.approx(expected, rel=1e-10, abs=1e-11)
        kinds = [event.kind for event in path.events]
        words = f"{path.modes[0]}: {', '.join(kinds)}" if kinds else path.modes[0]
        assert sweep.family.alphabet.words(found["itinerary"][row]) == words
    assert [*summary.summarise(tmp_path)["quantiles"]] == ["R_1", "dR_1", "u"]


def test_other_consistent_units_change_nothing_but_the_units():
    """Newtons and millinewtons: reactions grow a thousandfold, velocities and itineraries stay."""
    text = TEXT.replace("m = 0.5", "m = 500", 1).replace("[10, 30]", "[1e4, 3e4]").replace("[1e5, 1e7]", "[1e8, 1e10]")
    one, other = (parse_sweep(t.replace("[0, 0.2,", start))
                  for t, start in ((TEXT, "[0, 0.2,"), (text, "[0, 200,")))
    one, other = (chunks.chunk_columns(s.family, s.quantities(0, 24), 24) for s in (one, other))
    assert other["u"] == pytest.approx(one["u"], rel=1e-9, abs=1e-10)
    assert other["R_1"] == pytest.approx(1000 * one["R_1"], rel=1e-9, abs=1e-7)
    assert np.array_equal(one["itinerary"], other["itinerary"])


def test_degrees_are_radians_and_the_sweep_is_told_by_its_manifest(tmp_path):
    fixed = TEXT.replace('{ grid = ["60 deg", "75 deg"], points = 2 }', '["60 deg", "75 deg"]')
    assert parse_sweep(fixed).digest == parse_sweep(TEXT).digest
    values = parse_sweep(TEXT).axes["alpha"].values
    assert [float(v) for v in values] == pytest.approx(np.radians([60, 75]), rel=1e-15)
    run_sweep(parse_sweep(TEXT), tmp_path)
    assert run_sweep(parse_sweep(TEXT), tmp_path) == 0
    with pytest.raises(InputError, match="another sweep"):
        run_sweep(parse_sweep(TEXT.replace("l = 0.3", "l = 0.4")), tmp_path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("m = 0.5", "m = 0"), "m = 0: it must be positive"),
        (("m = 0.5", "m = [1, -1]"), "m = -1: it must be positive"),
        (("[10, 30]", "[-10, 30]"), "P = -10: it must be positive"),
        (("75 deg", "95 deg"), "between 0 and 90 deg"),
        (('["60 deg", "75 deg"]', "[1, 2]"), "between 0 and pi/2"),
        (("until = 0.2", "until = -1"), "until = -1: it must be zero or positive"),
        (("h = 0.1", ""), "h missing"),
        (("h = 0.1", "h = 0.1\nsigma = 1"), "m is physical and sigma is not"),
        (("h = 0.1", "h = 0.1\nf0 = 1"), "f0 reaches below the largest f"),
        (("h = 0.1", "h = 0.1\nf0 = [1, 2]"), "f0 reaches below the largest f"),
        (("[0, 0.2, {", "[0, {"), "list of 3: R_1, dR_1, u"),
        (("0.2, {", "'1e', {"), "dR_1 = '1e'"),
        (("h = 0.1", "h = '9**9**9'"), "h = '9**9**9'"),
    ],
)
def test_what_is_not_a_physical_sweep_is_refused_by_name(change, said):
    with pytest.raises(InputError) as refusal:
        parse_sweep(TEXT.replace(*change))
    assert said in str(refusal.value)
    assert "\n" not in str(refusal.value)
