"""Radau IIA: the coefficients of any number of stages, in doubles and in many digits."""

from itertools import chain

import pytest

from asympk.radau import Tableau, places


@pytest.mark.parametrize(("stages", "digits"), [(3, 30), (20, 33), (26, 60), (60, 90)])
def test_the_rows_of_the_tableau_integrate_polynomials_up_to_their_degree(stages, digits):
    tableau = Tableau(stages, digits)
    ctx = tableau.ctx
    for place, row in zip(tableau.nodes, tableau.a, strict=True):
        weights = [ctx.mpf(m) * ctx.mpf(2) ** row.exponent for m in row.multiples]
        for power in chain(range(0, stages, 7), [stages - 1]):
            found = sum(w * t**power for w, t in zip(weights, tableau.nodes, strict=True))
            assert abs(found - place ** (power + 1) / (power + 1)) < ctx.mpf(10) ** (2 - digits)
    assert tableau.nodes[-1] == 1


@pytest.mark.parametrize("stages", [3, 7, 20])
def test_the_nodes_in_doubles_are_those_of_the_tableau(stages):
    nodes = [float(c) for c in Tableau(stages, 30).nodes]
    assert [(u + 1) / 2 for u in places(stages)] == pytest.approx(nodes, abs=1e-15)
