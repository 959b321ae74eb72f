"""The divide through Pi2: where it lies, how long a start near it stays, and which rigid motion follows."""

from itertools import pairwise
from math import comb, log

import pytest
import sympy as sp

from asympk.asymptotics.jump import OFFSET, jump_map
from asympk.errors import InputError, NotDerivable
from asympk.studies.divide import DEPTH, divide, escapes, separatrix
from asympk.systems import painleve_klein as pk

SYSTEM = pk.system()
x, z, sigma, mu = pk.x, pk.z, pk.sigma, SYSTEM.small


def test_the_separatrix_is_the_slow_line_with_catalan_coefficients():
    load = separatrix(SYSTEM, 3)
    for k in range(4):
        # y = -sum C_k (mu/b)^k (x - 1/b) with b = -sigma
        line = -sp.Rational(comb(2 * k, k), k + 1) * (x + 1 / sigma) / (-sigma) ** k
        assert sp.cancel(load.coefficient(k) - line - (x if k == 0 else 0)) == 0


def test_the_separatrix_leaves_pi2_by_mu_over_sigma():
    load = divide(SYSTEM).load
    assert load.coefficient(0) == -1 / sigma
    assert sp.cancel(load.coefficient(1) - (x + 1 / sigma) / sigma) == 0


def test_the_escape_time_is_the_logarithm_of_the_offset_with_its_constant():
    found = divide(SYSTEM)
    assert sp.simplify(found.escape_above.coefficient(1) - sp.log(1 / (sigma * OFFSET)) / sigma) == 0
    assert found.escape_below.coefficient(1, 1) == 1 / sigma
    constant = sp.log(-sigma * z / ((sigma + 1) * OFFSET)) / sigma
    assert sp.simplify(found.escape_below.coefficient(1) - constant) == 0


def test_an_exponentially_small_offset_delays_the_escape_by_a_time_that_does_not_vanish():
    delay = divide(SYSTEM).delay
    assert delay.coefficient(0) == DEPTH / sigma
    assert sp.expand(delay.coefficient(1) - (sp.log(1 / sigma) / sigma - DEPTH / sigma**2)) == 0


def test_the_two_expansions_of_the_escape_time_agree_where_both_hold():
    found = divide(SYSTEM)
    fixed = found.escape_above.truncated(2).expr.subs(OFFSET, sp.exp(-DEPTH / mu))
    difference = sp.expand_log(sp.expand(fixed - found.delay.expr), force=True)
    # what one omits of the other is O(mu^2) and O(mu kappa^2)
    assert sp.expand(difference).coeff(mu, 0) == 0
    assert sp.simplify(sp.expand(difference).coeff(mu, 1)) == 0


def test_the_sides_of_the_divide_go_on_and_stop():
    found = divide(SYSTEM)
    assert found.above.itinerary == ("slip_opposite", "slip_same")
    assert found.below.itinerary == ("slip_opposite", "stick", "slip_opposite", "slip_same")
    assert found.above.x.coefficient(0) == x
    assert sp.expand(found.below.x.coefficient(0) - (x - z)) == 0


@pytest.mark.parametrize("s", ["1/2", "1", "3"])
@pytest.mark.parametrize("offset", ["1/20", "1e-12", "1e-100", "-1/20", "-1e-12", "-1e-100"])
@pytest.mark.few(3)
def test_error_of_the_escape_time_over_its_next_terms_tends_to_one(s, offset):
    closeness = []
    for m in ("1e-3", "1e-4", "1e-6", "1e-8", "1e-10"):
        (row,) = escapes(s, m, "1/3", 1, [offset], digits=60)
        assert row["motion"] == ("stops at once" if offset.startswith("-") else "goes on") or row["depth"] > 0.2
        if row["ratio"] is not None:
            closeness.append(abs(row["ratio"] - 1))
    assert closeness[-1] < 1e-5
    assert all(b < a for a, b in pairwise(closeness[-3:]))


@pytest.mark.parametrize("depth", [0.1, 0.3, 0.6])
def test_a_delayed_escape_happens_when_it_is_expected(depth):
    errors = []
    for k, m in ((250, "4e-3"), (500, "2e-3"), (1000, "1e-3")):
        (row,) = escapes(1, m, "1/3", 1, [f"1e-{round(depth * k / log(10))}"], digits=30)
        assert row["motion"] == "goes on"
        errors.append(abs(row["time"] - row["delayed"]) / row["mu"] ** 2)
    assert max(errors) < 2
    assert max(errors) / min(errors) < 1.3


def test_the_second_rigid_motion_is_realised_only_within_an_exponentially_thin_layer():
    # Pi2 meets z = 0 at the time sigma z; an escape upwards takes kappa/sigma
    s, height, m = 0.5, 0.8, 1e-3
    rows = escapes(s, m, 0, height, [f"1e-{round(part * s**2 * height / m / log(10))}" for part in (0.9, 1.1)], 30)
    assert [row["motion"] for row in rows] == ["goes on", "decelerates"]
    assert rows[1]["time"] == pytest.approx(s * height, abs=5 * m)


def test_on_the_divide_itself_the_velocity_decreases_to_the_end():
    (row,) = escapes(1, "1e-4", "1/3", 1, [0])
    assert row["motion"] == "decelerates"
    assert row["depth"] is row["ratio"] is None
    assert row["time"] == pytest.approx(1, abs=1e-3)


def test_an_offset_beyond_the_layer_or_a_line_that_attracts_is_refused():
    with pytest.raises(InputError):
        escapes(1, "1e-3", 0, 1, [2])
    with pytest.raises(NotDerivable, match="no velocity_zero"):
        _ = jump_map(SYSTEM, 1, {z: 1, OFFSET: -sp.Rational(1, 10)}, near="slip_same").t_hit
