"""The rod with its geometry kept: from mechanics to the chart, by routes that do not share the derivation."""

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.automaton.automaton import Automaton
from asympk.integrators import collocation, integrate
from asympk.studies import chart
from asympk.symbolic.branches import Phase
from asympk.systems import nonlinear_rod as nl
from asympk.systems import painleve_klein as pk
from asympk.systems.automata import automaton_of

PHYSICAL = {"m": 1.3, "P": 2.1, "f": 0.9, "l": 0.7, "k": 55.0, "h": 0.11, "alpha": 1.2}


def newton(delta, rate, u, m, P, f, l, k, h, alpha):
    """Return (delta'', u') of the rod from its length, Kelvin-Voigt's law, Coulomb's law and Newton's, in SI units."""
    gap, height = l * math.cos(alpha) - delta, l * math.sin(alpha)
    length = math.hypot(gap, height)
    reaction = k * (l - length) / l + h * k * gap / length * rate
    friction = -f * abs(reaction * height / length) * math.copysign(1, u)
    first = (P + friction - reaction * gap / length) / m
    return first - reaction * gap / length / m, first


def numbered(system, values):
    """Return the automaton of a system at given numbers."""
    return Automaton(system, tuple(values[s] for s in system.parameters))


@pytest.mark.parametrize("state", [(0.3, 0.4, 1.0), (0.3, 0.4, -1.0), (-2.0, -1.0, 0.5), (-2.0, -1.0, -0.5)])
def test_the_nondimensional_modes_are_newtons_law_for_the_rod_in_physical_units(state):
    q = PHYSICAL
    x, y, z = state
    time, cosine = q["h"] * q["l"], math.cos(q["alpha"])
    length = q["P"] * q["l"] / (q["k"] * cosine**2)  # delta = length x, by Hooke's law and the small angle
    speed = q["P"] * time / q["m"]
    numbers = {
        nl.mu: q["m"] / (q["k"] * q["l"] * (q["h"] * cosine) ** 2), nl.sigma: q["f"] * math.tan(q["alpha"]) - 2,
        nl.sigma0: 0, nl.kappa: q["P"] * q["l"] * q["h"] ** 2 / (q["m"] * cosine), nl.c2: cosine**2,
    }
    relative, first = newton(length * x, length * y / time, speed * z, **q)
    automaton = numbered(nl.system(), numbers)
    mode = automaton.mode(automaton.first(state))
    assert np.allclose(mode.rhs(0, state), (y, relative * time**2 / length, first * time / speed), rtol=1e-12)


def test_the_ratio_of_the_scales_does_not_depend_on_the_stiffness():
    m, P, l, k, h, alpha = sp.symbols("m P l k h alpha", positive=True)
    span, mu = nl.rod.l * sp.cos(nl.rod.alpha), nl.rod.find_scales(nl.rod.elastic_rod()).mu
    found = sp.cancel(nl.displacement() / (span * nl.x * mu))  # kappa mu x is the part of the span
    named = found.subs({s: sp.Symbol(s.name, positive=True) for s in found.free_symbols})
    assert sp.simplify(named - P * l * h**2 / (m * sp.cos(alpha))) == 0
    assert k not in named.free_symbols


def test_without_strain_the_modes_are_those_of_the_small_angle():
    for kept, small in zip(nl.system().modes, pk.system().modes, strict=True):
        assert kept.name == small.name
        for mine, theirs in ((kept.fast, small.fast), (kept.slow, small.slow)):
            assert all(sp.simplify(mine[s].subs(nl.kappa, 0) - theirs[s]) == 0 for s in theirs)


def test_the_fields_do_not_cancel_as_the_strain_vanishes():
    values = {nl.mu: 1e-17, nl.sigma: 1, nl.sigma0: 1, nl.kappa: 1, nl.c2: 0.1}
    kept, small = numbered(nl.system(), values), automaton_of(ap.Scene(1, 1e-17, (0, 0, 1), 1))
    for state in ((0.3, 0.4, 1.0), (1.7, 2.0, 0.1)):
        ours, theirs = (automaton.mode((Phase(1, 1),)).rhs(0, state) for automaton in (kept, small))
        assert np.allclose(ours, theirs, rtol=1e-14)


# integrators


@pytest.mark.parametrize("method", ["lsoda", "radau", "dop853"])
def test_integrators_follow_the_kept_geometry_to_the_reference(method):
    row = stored()[1.0, "1e-2"]
    where, truth = chart._scene_and_truth(row)
    path = integrate.run(chart._with_exact_geometry(1, where), method, rtol=1e-9)
    assert path.info["status"] == integrate.FINISHED
    assert path.modes == truth.modes
    assert np.allclose([float(v) for v in path.final], [float(v) for v in truth.final], atol=1e-7)
    assert np.allclose([e.t for e in path.events], [float(e.t) for e in truth.events], atol=1e-7)


# the reference


def test_collocation_is_the_exact_flow_to_twenty_digits():
    where = ap.Scene(1, "1e-1", (-1, -1, 1), 1)
    found = collocation.run(where, digits=20)
    truth = ap.solve(where, digits=30)
    assert found.modes == truth.modes
    with mpmath.workdps(30):
        assert max(abs(a - b) for a, b in zip(found.final, truth.final, strict=True)) < mpmath.mpf(10) ** -20
        assert max(abs(a.t - b.t) for a, b in zip(found.events, truth.events, strict=True)) < mpmath.mpf(10) ** -20
    assert found.error < mpmath.mpf(10) ** -20


def stored():
    from pathlib import Path

    from asympk.storage.rows import read_rows

    file = Path(__file__).parents[2] / "paper" / "generated" / "rows" / "nonlinear-reference.csv"
    return {(row["kappa"], row["mu"]): row for row in read_rows(file)}


def test_the_kept_references_are_right_to_thirty_digits():
    assert all(row["error"] < 1e-30 for row in stored().values())
    assert {mu for kappa, mu in stored() if kappa == 1} == set(chart.MUS)


def test_the_small_angle_costs_an_error_that_tends_to_a_multiple_of_kappa_mu():
    for kappa in (0.1, 1.0, 10.0):
        mus = sorted((mu for k, mu in stored() if k == kappa), key=float, reverse=True)
        costs = []
        for mu in mus:
            small = ap.solve(ap.Scene(1, mu, (0, "0.2", -1), 5), digits=30).final
            with mpmath.workdps(30):
                truth = [mpmath.mpf(stored()[kappa, mu][name]) for name in "xyz"]
                gap = max(abs(a - b) for a, b in zip(small, truth, strict=True))
            costs.append(float(gap) / (kappa * float(mu)))
        steps = [abs(b - a) for a, b in pairwise(costs)]
        assert 0.1 < costs[-1] < 1
        assert all(b < a for a, b in pairwise(steps))


def test_the_reference_ends_on_the_slow_manifold_of_the_kept_rod_up_to_its_first_omitted_term():
    mode = nl.system().mode("slip_same")
    field = {nl.x: mode.slow[nl.x]}
    numbers = {nl.sigma: 1, nl.kappa: 1, nl.c2: sp.Rational(1, 10)}
    smooth = ap.System.smooth(field, {nl.y: mode.fast[nl.y].subs(numbers)}, nl.mu)
    manifold = ap.slow_manifold(smooth, branch={nl.y: sp.Rational(1, 5) - nl.x}, order=2)
    for order in (0, 1):
        gaps = []
        for mu in chart.MUS:
            row = stored()[1.0, mu]
            with mpmath.workdps(32):
                x, y, small = mpmath.mpf(row["x"]), mpmath.mpf(row["y"]), mpmath.mpf(mu)
                terms = [ap.lower((nl.x,), c, target="mpmath")(x) for c in manifold.coefficients]
                kept = sum(terms[k] * small**k for k in range(order + 1))
                gaps.append(abs((y - kept) / (terms[order + 1] * small ** (order + 1)) - 1))
        assert all(b < a for a, b in pairwise(gaps[1:]))
        assert gaps[-1] < 1e-6
