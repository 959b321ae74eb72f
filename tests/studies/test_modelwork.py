"""What a model saves: the cost of integrators at the error of the jump of order 1."""


import pytest

from asympk.studies import modelwork
from asympk.studies.modelwork import savings


def _row(method, error, ratio, mu=0.01):
    return {"system": "s", "mu": mu, "method": method, "final_error": error, "ratio": ratio}


def test_savings_are_the_cheapest_runs_at_the_error_of_the_jump():
    found = savings([_row("jump 1", 1e-5, 1.0), _row("lsoda", 1e-4, 2.0), _row("lsoda", 1e-6, 7.0),
                     _row("lsoda", 1e-7, 6.0), _row("bdf", 1e-4, 3.0), _row("cvode", None, None)])
    assert found == {("s", 0.01): {"lsoda": 6.0, "bdf": None, "cvode": None}}


@pytest.mark.further
def test_an_integrator_is_refined_until_it_reaches_the_error_and_no_further():
    rows = modelwork.rows(("1e-2",), ("lsoda",), (1e-1, 1e-4, 1e-8, 1e-10), 1)
    for system in modelwork.SYSTEMS:
        mine = [row for row in rows if row["system"] == system]
        (enough,) = (row["final_error"] for row in mine if row["method"] == "jump 1")
        errors = [row["final_error"] for row in mine if row["method"] == "lsoda"]
        assert len(mine) > len(modelwork.JUMPS)
        assert errors[-1] <= enough
        assert all(error > enough for error in errors[:-1])


@pytest.mark.further
def test_a_jump_costs_about_itself():
    rows = modelwork.rows(("1e-2",), (), (), 3)
    assert all(0.3 < row["ratio"] < 3 for row in rows if row["method"] == "jump 1")


@pytest.mark.parametrize("rows", [[], [_row("jump 1", None, None), _row("lsoda", 1e-4, 2.0)]])
def test_without_a_jump_there_is_nothing_to_save(rows):
    assert savings(rows) == {}
