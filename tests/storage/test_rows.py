"""Rows read back as they were written, or are refused."""

import pytest

import asympk as ap
from asympk.errors import InputError
from asympk.storage import rows
from asympk.studies import chart
from asympk.studies.compare import workprec

SAMPLE = [
    {"name": "a, b", "mu": 1e-8, "steps": 3, "same": True, "error": None},
    {"name": "c", "mu": 0.1, "steps": None, "same": None, "error": 1.5e-300},
    {"name": "d", "mu": 1, "steps": 0, "same": False, "error": 0.0},
]


def test_rows_read_back_as_they_were_written(tmp_path):
    rows.write_rows(tmp_path / "sample.csv", SAMPLE, rows.provenance(digits=30, seed=None))
    assert rows.read_rows(tmp_path / "sample.csv") == SAMPLE
    story = rows.read_rows(tmp_path / "sample.csv").provenance
    assert (story["digits"], story["seed"], story["versions"]["asympk"]) == (30, None, ap.__version__)
    found = workprec(ap.Scene(1, "1e-1", chart.SCENES["iii"], 5, name="iii"), "lsoda", (1e-3,), repeats=1)
    rows.write_rows(tmp_path / "row.csv", found, {})
    assert rows.read_rows(tmp_path / "row.csv") == found


def test_the_bytes_of_rows_depend_on_the_rows_alone(tmp_path):
    for name in ("one", "two"):
        rows.write_rows(tmp_path / f"{name}.csv", SAMPLE, {"b": 1, "a": 2})
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()


@pytest.mark.parametrize(("wrong", "words"), [
    ([{"a": float("nan")}], "NaN"),
    ([{"a": 1}, {"b": 1}], "the first has"),
    ([{"a": 1}, {"a": "x"}], "int, str"),
    ([{"a": [1]}], "list"),
    ([{"a": ""}], "empty word"),
])
def test_rows_that_would_not_read_back_are_refused(tmp_path, wrong, words):
    with pytest.raises(InputError, match=words):
        rows.write_rows(tmp_path / "wrong.csv", wrong, {})
    assert not (tmp_path / "wrong.csv").exists()
