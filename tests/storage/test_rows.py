import json

import pytest

from asympk.errors import InputError
from asympk.storage.rows import in_kept_digits, provenance, read_rows, write_rows

ROWS = [
    {"name": "a", "count": 2, "share": 1, "right": True, "empty": None},
    {"name": None, "count": None, "share": 0.1, "right": False, "empty": None},
]


def test_rows_that_are_read_equal_the_rows_that_were_written(tmp_path):
    write_rows(tmp_path / "rows.csv", ROWS, {"seed": 3})
    found = read_rows(tmp_path / "rows.csv")
    assert found == ROWS
    assert [type(v) for v in found[0].values()] == [str, int, float, bool, type(None)]
    assert found.provenance["seed"] == 3


def test_the_bytes_of_rows_depend_on_the_rows_alone(tmp_path):
    for name, seed in (("one", 1), ("two", 2)):
        write_rows(tmp_path / f"{name}.csv", ROWS, provenance(seed=seed))
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()
    assert {json.loads((tmp_path / f"{name}.json").read_text())["seed"] for name in ("one", "two")} == {1, 2}


@pytest.mark.parametrize(("rows", "said"), [
    ([{"a": 1}, {"b": 1}], r"row 1 of rows.csv has the columns \['b'\]; the first has \['a'\]"),
    ([{"a": 1}, {"a": "x"}], "column 'a' holds int, str; give one of"),
    ([{"a": [1]}, {"a": [2]}], "column 'a' holds list; give one of"),
    ([{"a": ""}], "a cell is an empty word"),
    ([{"a": float("nan")}], "NaN"),
])
def test_rows_that_would_not_read_back_are_refused_and_nothing_is_written(tmp_path, rows, said):
    with pytest.raises(InputError, match=said):
        write_rows(tmp_path / "rows.csv", rows, {})
    assert not [*tmp_path.iterdir()]


def test_a_row_keeps_six_digits_of_a_number_and_none_of_a_machine():
    assert in_kept_digits({"x": 0.1 + 0.2, "y": None, "z": 123456789}) == {"x": 0.3, "y": None, "z": 123457000.0}
