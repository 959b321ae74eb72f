"""Every expansion, checked by decreasing mu: the error over the first omitted term tends to 1, and how."""

from itertools import pairwise
from pathlib import Path

import pytest

from asympk.output.rowtables import SHOWN, convergence_table, escape_table
from asympk.output.tabular import plain_rows
from asympk.storage.rows import read_rows
from asympk.studies import convergence, divide
from asympk.studies.convergence import EXPANSIONS, MUS, ORDERS, SIGMAS, by_quantity, monotone_from, rows

KEPT = Path(__file__).parents[2] / "paper" / "generated" / "rows"
BEYOND = "z > 0, s < -1/sigma"
FEW = ("1e-3", "1e-7", "1e-11")


def _possible(name, sigmas=SIGMAS):
    """Beyond the divide the rod is steep; Pi2 attracts where it is shallow; the other expansions always exist."""
    return [s for s in sigmas if name != (BEYOND if s.startswith("-") else "slow, Pi2")]


@pytest.fixture(scope="module")
def kept():
    return read_rows(KEPT / "convergence.csv")


@pytest.fixture(scope="module")
def computed():
    return rows(sigmas=("-1/2", "1/2"), mus=FEW)


@pytest.mark.further
def test_the_kept_rows_are_those_that_the_package_computes(kept, computed):
    chosen = [row for row in kept if row["sigma"] in ("-1/2", "1/2") and row["mu"] in map(float, FEW)]
    assert chosen == computed


def test_every_expansion_order_and_sigma_is_there(kept):
    found = {(row["expansion"], row["order"], row["sigma"]) for row in kept}
    assert found == {(name, n, s) for name in EXPANSIONS for n in ORDERS for s in _possible(name)}
    assert all([row["mu"] for row in group] == list(map(float, MUS)) for group in by_quantity(kept))


def test_an_expansion_exists_for_all_sigma_of_its_signs_also_where_no_rows_are_kept(monkeypatch):
    monkeypatch.setattr(convergence, "_rows", lambda *place: [{"at": place, "order": 0, "quantity": "x", "mu": 1}])
    found = [row["at"] for row in rows(("2", "-1/3"), ("1e-2",))]
    assert found == [(name, s, "1e-2") for name in EXPANSIONS for s in _possible(name, ("2", "-1/3"))]


@pytest.mark.slow
def test_the_error_over_the_first_omitted_term_tends_to_one_monotonically(computed):
    for group in by_quantity(computed):
        sizes = [abs(row["excess"]) for row in group]
        least = 10 if group[0]["expansion"] == BEYOND else 1000
        assert all(b < a / least for a, b in pairwise(sizes)), group[0]
        assert sizes[-1] < 1e-8


def test_it_is_monotone_from_a_thousandth_on_but_beyond_the_divide(kept):
    for group in by_quantity(kept):
        assert abs(group[-1]["excess"]) < 1e-9
        if group[0]["expansion"] != BEYOND:
            assert monotone_from(group) >= 1e-3


def test_where_it_is_not_monotone_the_omitted_terms_say_so(kept):
    broken = 0
    for group in by_quantity(kept):
        for before, after in pairwise(group):
            if abs(after["excess"]) >= abs(before["excess"]):
                broken += 1
                changes = any(before[name] * after[name] < 0 for name in ("expected", "omitted"))
                assert changes or abs(after["expected"]) >= abs(before["expected"])
    assert broken


def test_the_second_omitted_term_over_the_first_is_what_the_quotient_differs_by(kept):
    for row in kept:
        if row["mu"] <= 1e-4 and abs(row["excess"]) < 1e-2:
            # what is neglected is mu L times as large at most, beside terms that may cancel
            assert abs(row["excess"] - row["expected"]) < 0.02 * abs(row["excess"]) + 1e3 * row["mu"] ** 2


def test_the_table_shows_the_largest_of_all_quantities(kept):
    header, *body = plain_rows(convergence_table(kept))
    assert len(body) == sum(len(_possible(name)) for name in EXPANSIONS)
    assert len(header) == 2 + len(ORDERS) * (len(SHOWN) + 1)
    here = [row for row in kept if (row["expansion"], row["sigma"], row["order"]) == ("z < 0, s > 0", "-17/10", 0)]
    assert float(body[0][2]) == pytest.approx(max(abs(r["excess"]) for r in here if r["mu"] == SHOWN[0]), rel=0.5)
    assert body[0][5] == "1e-2"


def test_rows_that_are_not_monotone_show_from_where_on_they_are():
    group = [{"mu": 10.0**-k, "excess": e} for k, e in enumerate((3, 1, -2, 0.1, 0.01))]
    assert monotone_from(group) == 1e-2
    assert monotone_from(group[:2]) == 1


def test_the_kept_escapes_are_those_that_the_package_computes():
    kept = read_rows(KEPT / "escape.csv")
    assert divide.rows(sigmas=("1",)) == [row for row in kept if row["sigma"] == 1]
    body = plain_rows(escape_table(kept))[1:]
    assert len(body) == len(divide.SIGMAS) * len(divide.OFFSETS)
    assert {row[4] for row in body} == {"goes on", "decelerates", "stops at once"}
