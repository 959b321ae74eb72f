"""The map of the least models: its stored rows are what the code computes, on any machine."""

from pathlib import Path

import pytest

from asympk.storage.rows import read_rows
from asympk.studies import leastmap

KEPT = Path(__file__).parents[2] / "paper" / "generated" / "rows"


@pytest.mark.slow
def test_the_stored_map_is_what_the_code_computes():
    assert leastmap.rows() == read_rows(KEPT / "least.csv")
