"""The models of five systems for decreasing mu: their error over the first omitted term, or over mu log(1/mu)."""

from itertools import groupby, pairwise
from pathlib import Path

import pytest

from asympk.output.rowtables import decreasing_table
from asympk.output.tabular import plain_rows
from asympk.storage.rows import read_rows
from asympk.studies.decreasing import ORDERS, five_systems, is_limit, rows

KEPT = Path(__file__).parents[2] / "paper" / "generated" / "rows"


@pytest.fixture(scope="module")
def kept():
    return read_rows(KEPT / "decreasing.csv")


def _groups(kept):
    for key, group in groupby(kept, key=lambda row: (row["system"], row["with_friction"], row["order"])):
        yield key, list(group)


def test_every_system_and_order_is_there(kept):
    found = {(name, order) for (name, _, order), _ in _groups(kept)}
    assert found == {(name, order) for name in five_systems() for order in ORDERS}


def test_the_error_over_the_first_omitted_term_tends_to_one(kept):
    for _, group in _groups(kept):
        if not is_limit(group[0]):
            off = [abs(row["ratio"] - 1) for row in group]
            assert off[0] < 0.1
            assert off[-1] < 0.01
            assert all(b < a for a, b in pairwise(off)), group[0]


def test_the_error_of_a_limit_with_friction_over_mu_log_mu_tends_to_a_constant(kept):
    for _, group in _groups(kept):
        if is_limit(group[0]):
            sizes = [row["ratio"] for row in group if row["mu"] <= 0.01]
            steps = [abs(b / a - 1) for a, b in pairwise(sizes)]
            assert steps[-1] < 0.1
            assert all(s * sizes[0] > 0 for s in sizes)


@pytest.mark.further
def test_the_kept_rows_are_those_that_the_package_computes(kept):
    chosen = ["nonlinear layer", "held rod"]
    computed = rows(chosen, ("1/320",))
    stored = [row for row in kept if row["system"] in chosen and row["mu"] == 0.003125]
    assert len(computed) == len(stored) == 6
    for a, b in zip(computed, stored, strict=True):
        assert a["state"] == b["state"]
        assert a["ratio"] == pytest.approx(b["ratio"], rel=1e-3)


def test_the_table_shows_what_is_kept(kept):
    header, *body = plain_rows(decreasing_table(kept))
    assert len(body) == 15
    assert header[-1] == "mu = 1e-4"
