"""Tables, a Piecewise of many intervals: the same values, asked for in as many steps as their number has digits."""

from fractions import Fraction
from itertools import pairwise
from math import ceil, log2
from random import Random

import pytest
import sympy as sp

import asympk as ap
from asympk.symbolic.lowering import SHORTEST, as_tree, is_table, lower

t, v, F = sp.symbols("t v F", real=True)
KNOTS = [sp.Rational(k, 3) for k in range(21)]
VALUES = [sp.Integer(k * k % 11) for k in range(21)]
LINES = [a + (b - a) * (t - knot) * 3 for knot, (a, b) in zip(KNOTS, pairwise(VALUES), strict=False)]
PIECES = [*zip(LINES, KNOTS[1:], strict=True)]
TABLES = {
    "up to each end": sp.Piecewise(*((line, t < end) for line, end in PIECES), (VALUES[-1], True)),
    "to the last end": sp.Piecewise(*((line, t <= end) for line, end in PIECES)),
    "the end before the time": sp.Piecewise(*((line, end >= t) for line, end in PIECES), (7, True)),
    "a spline": sp.interpolating_spline(1, t, KNOTS, VALUES),
    "of pieces that are one": sp.Piecewise(*((k // 2, t <= k) for k in range(1, 21)), (t, True)),
    "beside a gap of a point": sp.Piecewise(*((t**k, (k < t) & (t < k + 1)) for k in range(9))),
}


def depth(expr):
    return 1 + max(map(depth, [piece.expr for piece in expr.args])) if isinstance(expr, sp.Piecewise) else 0


@pytest.mark.parametrize("spelled", TABLES)
@pytest.mark.few(2)
def test_the_tree_of_a_table_has_its_values_wherever_it_has_one(spelled):
    table = TABLES[spelled]
    tree = as_tree(table)
    assert depth(tree) <= ceil(log2(len(table.args))) + 2
    times = [sp.Rational(k, 6) for k in range(-2, 44)]
    known = [at for at in times if not table.subs(t, at).has(sp.nan)]
    assert len(known) >= 17
    assert [tree.subs(t, at) for at in known] == [table.subs(t, at) for at in known]


@pytest.mark.parametrize("target", ["math", "mpmath", "numpy"])
@pytest.mark.parametrize("spelled", TABLES)
def test_a_table_and_its_slope_are_lowered(spelled, target):
    table = TABLES[spelled]
    value = lower((t,), table**2, target, branching=True)
    middles = [Fraction(2 * k + 1, 12) for k in range(2, 17)]
    assert [float(value(at)) for at in middles] == pytest.approx([float(table.subs(t, at) ** 2) for at in middles])


def test_what_is_no_table_stays():
    a = sp.Symbol("a", real=True)
    short = sp.Piecewise(*((t**k, t < k) for k in range(1, SHORTEST)))
    apart = sp.Piecewise(*((t**k, (2 * k < t) & (t < 2 * k + 1)) for k in range(9)))
    unknown = sp.Piecewise(*((t**k, t < a + k) for k in range(9)))
    two = sp.Piecewise(*((t**k, t < k) for k in range(1, 9)), (1, v < 9), (0, True))
    for expr in (short, apart, unknown, two, t**2):
        assert as_tree(expr) == expr
        assert not (isinstance(expr, sp.Piecewise) and is_table(expr))


@pytest.mark.parametrize("how", [{}, {"method": "radau"}, {"digits": 20}])
@pytest.mark.few(1)
def test_a_block_slides_on_ground_that_moves_by_a_record(how):
    """Its velocity is the integral of what is recorded, straight lines between readings, less that of friction."""
    step = sp.Rational(1, 20)
    record = [sp.Rational(k, 100) for k in Random(2).choices(range(-50, 50), k=61)]
    lines = (a + (b - a) * (t - k * step) / step for k, (a, b) in enumerate(pairwise(record)))
    ground = sp.Piecewise(*((line, t < (k + 1) * step) for k, line in enumerate(lines)), (0, True))
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 5))
    block = ap.System.with_frictions({v: F - ground}, {}, [contact], time=t)
    path = ap.solve(ap.Scene(system=block, values={}, start={v: 3}, until=3), **how)
    moved = sum((a + b) / 2 * step for a, b in pairwise(record))
    tolerance = 1e-19 if "digits" in how else 1e-8
    assert abs(path.final[0] - (3 - sp.Rational(3, 5) - moved)) < tolerance
    assert path.modes == ("slip_same",)
