"""The ledger: every claim is judged, by evidence of both kinds, and the judge can say no."""

import json
import re

import pytest
from precision import precisions_set

from asympk import ledger
from asympk.errors import InputError, UnknownName
from asympk.ledger import verdicts
from asympk.ledger.runs import negligible, tends_to_one
from asympk.output import terminal
from asympk.output.terminal import claims_as_json, exit_status, summary

MOVES = re.compile(r"(from landing .*)?x (grows|falls|moves|gains)")
HELD = "x is then what it was: the jump is along y"
IDENTIFIERS = [f"C{n:02d}" for n in range(1, 44)]


@pytest.fixture(scope="module")
def judged():
    """Judge every claim; return them by name, and what mpmath's own precision was set to meanwhile."""
    with precisions_set() as found:
        return {claim.id: claim for claim in ledger.claims()}, found


@pytest.fixture(scope="module")
def claims(judged):
    return judged[0]


@pytest.mark.further
def test_judging_never_sets_mpmaths_own_precision(judged):
    assert not judged[1]


def test_the_name_of_a_claim_is_no_progress():
    with pytest.raises(InputError, match="progress = 'C23': it must be a function; of all claims choose one by its"):
        ledger.claims("C23")


@pytest.mark.slow
def test_every_claim_has_a_verdict(claims):
    assert list(claims) == IDENTIFIERS
    assert {claim.verdict for claim in claims.values()} == set(verdicts.VERDICTS)


@pytest.mark.slow
def test_every_check_says_in_words_what_it_asks(claims):
    """A check that is given its words for its condition always holds."""
    checks = [check for claim in claims.values() for check in claim.evidence]
    assert [check for check in checks if not (isinstance(check.what, str) and check.what)] == []


def test_every_check_holds_but_those_of_the_sentences_that_are_corrected(claims):
    refined = {9, 16, 18, 24, 25, 28, 30, 32, 34, 35, 37, 38, 40, 41}
    corrected = {"C23": 1, "C26": 1, "C42": 2, "C43": 2}  # sentences that fail
    for n, (name, found) in enumerate(claims.items(), start=1):
        expected = "corrected" if name in corrected else "refined" if n in refined else "confirmed"
        assert found.verdict == expected, name
        fails = [check for check in found.evidence if not check.holds]
        assert len(fails) == corrected.get(name, 0), name
        assert all(check.role == "as written" for check in fails), name


@pytest.mark.parametrize("identifier", IDENTIFIERS)
def test_every_claim_has_a_derivation_and_a_number(claims, identifier):
    evidence = claims[identifier].evidence
    assert {check.kind for check in evidence} == {"symbolic", "numeric"}
    assert claims[identifier].statement
    assert claims[identifier].where in ("1", "2", "3")


@pytest.mark.parametrize(
    ("identifier", "verdict"),
    [("C16", "refined"), ("C18", "refined"), ("C23", "corrected"), ("C24", "refined"), ("C26", "corrected"),
     ("C30", "refined"), ("C32", "refined"), ("C35", "refined"), ("C42", "corrected"), ("C43", "corrected")],
)
def test_claims_that_do_not_hold_as_written_say_what_does(claims, identifier, verdict):
    claim = claims[identifier]
    assert claim.verdict == verdict
    assert any(check.role != "as written" and check.holds for check in claim.evidence)
    assert (verdict == "corrected") == any(not check.holds for check in claim.evidence if check.role == "as written")


def test_one_rule_judges_what_the_jumps_do_to_x(claims):
    along_y = {name for name, claim in claims.items() if any(check.what == HELD for check in claim.evidence)}
    assert along_y == {"C23", "C26"}
    for name in ("C18", "C23", "C24", "C26"):
        assert ("direction" in claims[name].statement) is (name in along_y)
        roles = {check.role for check in claims[name].evidence if MOVES.match(check.what)}
        assert roles >= {"instead" if name in along_y else "left out"}


def _checks(*pairs):
    kinds = ("symbolic", "numeric")
    return tuple(verdicts.Check(role, kinds[n % 2], "", holds) for n, (role, holds) in enumerate(pairs))


@pytest.mark.parametrize(
    ("pairs", "verdict"),
    [
        ([("as written", True), ("as written", True)], "confirmed"),
        ([("as written", True), ("as written", True), ("left out", True)], "refined"),
        ([("as written", True), ("as written", True), ("left out", False)], "confirmed"),
        ([("as written", False), ("as written", True)], "not settled"),
        ([("as written", False), ("instead", True)], "corrected"),
        ([("as written", False), ("instead", True), ("left out", False)], "not settled"),
        ([("as written", False), ("instead", False)], "not settled"),
        ([("as written", True)], "not settled"),
        ([("left out", True), ("left out", True)], "not settled"),
    ],
)
def test_the_verdict_follows_from_the_checks(pairs, verdict):
    assert verdicts.verdict(_checks(*pairs)) == verdict


def test_an_unsettled_claim_makes_the_exit_status_one(claims):
    lost = verdicts.Claim("C99", "3", "a slow plane in z < 0", verdicts.UNSETTLED, _checks(("as written", False)))
    assert exit_status(claims.values()) == 0
    assert exit_status([*claims.values(), lost]) == 1
    told = summary([lost], 0)
    assert "Not settled:\n  C99" in told
    assert "\n  z -> 0 - (sigma + 1)/(sigma*(sigma + 4)) mu L + O(mu)\n" in told


def test_the_first_screen_fits_a_terminal_of_eighty_characters_and_loses_no_word(claims, monkeypatch):
    wide = summary([*claims.values()], 0)
    monkeypatch.setattr(terminal, "columns", lambda: 80)
    narrow = summary([*claims.values()], 0)
    assert max(map(len, narrow.splitlines())) <= 80
    assert {*re.findall(r"[^\s;]+", wide)} - {*re.findall(r"[^\s;]+", narrow)} <= {"sigma"}


def test_a_trend_needs_ever_smaller_deviations_from_one():
    assert tends_to_one([1.1, 1.001, 1.00001])[0]
    assert not tends_to_one([1.1, 1.09, 1.08])[0]
    assert not tends_to_one([2.1, 1.001])[0]
    assert not tends_to_one([1 + 1e-5, 1 + 1e-4])[0]
    assert not negligible(1e-39)[0]


def test_the_json_of_the_ledger_has_the_fixed_keys(claims):
    told = json.loads(claims_as_json(claims.values()))
    assert len(told) == 43
    assert {"id", "where", "statement", "verdict", "evidence"} <= set(told[0])
    assert {"role", "kind", "what", "holds", "value"} == set(told[0]["evidence"][0])


def test_an_unknown_claim_is_named_with_the_range_of_ids():
    with pytest.raises(UnknownName, match=r"'C44' is unknown; the ledger has C01 to C43"):
        ledger.claim_called("C44")
