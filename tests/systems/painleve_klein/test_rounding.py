"""The account that a run in doubles gives of its own rounding: never far below the truth, seldom far above it."""

from contextlib import suppress

import numpy as np
import pytest

from asympk.arithmetic import Doubles, flow_context, set_digits
from asympk.errors import Undecided
from asympk.systems.painleve_klein.flow.exact import TRUSTED, RodNumbers, segments_of
from asympk.systems.painleve_klein.flow.rounding import calm, estimated_error, largest_state


def digits(n):
    m = flow_context(400)
    set_digits(m, n)
    return m


def account(case):
    """Return (estimated error, true error) of a run in doubles; None when it gives up by itself."""
    try:
        rough = segments_of(Doubles, case)
        estimated = estimated_error(rough)
    except (Undecided, OverflowError, ZeroDivisionError):
        return None
    true = segments_of(digits(60), case)
    if [leg.mode for leg in rough] != [leg.mode for leg in true]:
        return estimated, float("inf")
    return estimated, float(max(abs(rough[-1].end[i] - true[-1].end[i]) for i in (0, 3)) / largest_state(true))


def cases(n, seed, widest=12):
    random = np.random.default_rng(seed)
    for _ in range(n):
        sigma = random.choice([random.uniform(-1.99, 3), 10 ** random.uniform(-9, 6), -(10 ** random.uniform(-9, 0.2))])
        sizes = 10 ** random.uniform(-widest, widest, 3) * random.choice([-1, 1], 3)
        yield RodNumbers(sigma, sigma, 10 ** random.uniform(-12, 3), *sizes, 10 ** random.uniform(-6, 4), None)


@pytest.mark.further
def test_what_is_trusted_is_right():
    accounts = [found for found in map(account, cases(250, 1)) if found and found[0] <= TRUSTED]
    assert len(accounts) > 200
    assert max(true for _, true in accounts) <= TRUSTED


@pytest.mark.further
def test_an_estimate_is_seldom_below_the_error_and_never_far():
    pairs = [found for found in (account(case) for case in cases(200, 2, widest=2)) if found]
    assert all(true <= 3 * estimated + 2.0**-52 for estimated, true in pairs if true < float("inf"))
    assert sum(true <= estimated for estimated, true in pairs) > 0.9 * len(pairs)


def test_errors_weighed_by_what_becomes_of_them_stay_small_over_many_events():
    case = RodNumbers(2.44, 2.44, 1.25, 67778551.48489238, 3.1267737337909384e-09, -17375861.02658052, 1000.0, None)
    assert len(segments_of(Doubles, case)) > 30
    estimated, true = account(case)
    assert true < 1e-15
    assert estimated < TRUSTED


def test_a_start_that_amplifies_the_rounding_of_its_deviation_is_not_trusted_without_it(monkeypatch):
    monkeypatch.setattr("asympk.systems.painleve_klein.flow.starts._from_unstable_line", lambda *_: None)
    estimated, true = account(RodNumbers(1.0, 1.0, 1e-3, 0.3, -1.2987025935171457 + 1e-12, 1.0, 5.0, None))
    assert true > 1e-9
    assert estimated > 1e-9


def test_an_end_inside_a_fast_layer_is_not_trusted():
    case = RodNumbers(1.0, 1.0, 1e-9, 1.0, 0.2, -1.0, 1.0, None)
    event = segments_of(digits(60), case)[1].start
    late = case._replace(x=1.0, until=float(event) * (1 + 1e-12))
    found = account(late)
    assert found is None or found[0] >= found[1] / 3


def test_a_run_that_a_long_drift_brings_close_to_zero_is_not_calm():
    """A slip from z = -8.48 with the drift 2 t ends at z = 0 and x = 2: large terms cancel in z."""
    case = RodNumbers(-0.5, -0.5, 0.006572435679772362, 1.2710901079857857, 0.9087873855242155, -8.482941070364724,
                      5.0, None)
    solved = segments_of(Doubles, case)
    assert solved[0].segment.mode.rest * solved[0].span > 4 * solved[0].end[0] > 7
    assert not calm(solved, case.until)


def test_a_run_out_of_range_is_not_trusted():
    case = RodNumbers(1.0, 1.0, 1e-300, 0.0, 0.0, -1e12, 1.0, None)
    with suppress(Undecided, OverflowError, ZeroDivisionError):
        assert not estimated_error(segments_of(Doubles, case)) <= TRUSTED
