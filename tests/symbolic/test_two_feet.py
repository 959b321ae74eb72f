"""A box on two elastic feet: four fast states, with sines and cosines of one angle in every coefficient."""

import random

import numpy as np
import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.output.export import export
from asympk.symbolic.expansion import fast_jacobian, limit_of
from asympk.symbolic.hurwitz import characteristic
from asympk.symbolic.long import heavy
from asympk.symbolic.roots import solutions_of
from asympk.symbolic.tidy import in_lowest_terms, solved

X, Y, THETA = dynamicsymbols("X Y theta")
EPS, F = sp.symbols("epsilon f", positive=True)
STICKING = 2  # the mode in which the left foot slides and the right one sticks


def feet(friction):
    """Return the box on both feet; with c = eps^2 and h = eps, x and y of each foot are fast."""
    t = dynamicsymbols._t
    energy = (X.diff(t) ** 2 + Y.diff(t) ** 2) / 2 + THETA.diff(t) ** 2 / 6 - Y
    left, right = (ap.Contact(Y - sp.cos(THETA) / 3 - sign * sp.sin(THETA) / 2,
                              X + sp.sin(THETA) / 3 - sign * sp.cos(THETA) / 2, friction, unilateral=True)
                   for sign in (1, -1))
    box = ap.Mechanism.from_lagrangian(energy, (X, Y, THETA), contact=left, others=[right])
    return box.elastic(compliance=EPS**2, damping=EPS)


@pytest.mark.slow
def test_reactions_of_two_feet_are_short_fractions_in_the_waves_of_their_angle():
    mode = feet(F).modes[STICKING]
    (found,) = solutions_of([limit_of(g, EPS) for g in mode.fast.values()], [*mode.fast])
    assert max(h.count_ops() for h in found.values()) < 50
    coefficients = characteristic(fast_jacobian(mode, EPS))
    assert max(c.count_ops() for c in coefficients) < 50
    assert len({wave.args[0] for wave in sp.Tuple(*found.values(), *coefficients).atoms(sp.sin, sp.cos)}) == 1


def test_no_determinant_is_written_to_find_a_singular_fast_system(monkeypatch):
    monkeypatch.setattr(sp.matrices.matrixbase.MatrixBase, "det", None)
    x, y, p, q = sp.symbols("x y p q", real=True)
    force = sp.Add(*(sp.sin(k * p) * (x - y - sp.cos(k * q)) for k in range(1, 9)))
    equal_zero = [force, 2 * force + p]
    assert heavy(sp.Tuple(*equal_zero))
    assert solutions_of(equal_zero, [x, y]) == []


def test_long_equations_of_which_one_follows_from_the_others_are_said_to_leave_a_fast_state_free():
    """Of the compressions of three feet under a rigid body one is a combination of the others: no branch was found."""
    x, y, p, q = sp.symbols("x y p q", real=True)
    force = sp.Add(*(sp.sin(k * p) * (x - y - sp.cos(k * q)) for k in range(1, 9)))
    system = ap.System.smooth(slow={p: -p, q: p}, fast={x: force, y: 2 * force}, small=EPS)
    assert heavy(force)
    with pytest.raises(ap.errors.NotNormallyHyperbolic, match="make it a slow state"):
        ap.slow_manifolds(system)


def test_functions_that_are_0_on_one_side_of_a_number_make_no_matrix_singular():
    x, y, a = sp.symbols("x y a", real=True)
    switched = sp.Max(a - 3, 0)
    assert solutions_of([switched * y - x, switched * x - 1], [y, x]) == [{y: switched**-2, x: 1 / switched}]


@pytest.mark.slow
@pytest.mark.parametrize("friction", [sp.Rational(1, 2), F])
def test_manifolds_and_stability_of_two_feet_are_those_of_numbers(friction, tmp_path):
    system, chance = feet(friction), random.Random(1)
    for m in ap.slow_manifolds(system, order=0):
        states, g = [*m.dynamics.fast], sp.Matrix([limit_of(g, EPS) for g in m.dynamics.fast.values()])
        for _ in range(3):
            place = {s: sp.Rational(chance.randint(1, 300), 100) for s in g.free_symbols - {*states}}
            matrix = np.array(g.jacobian(states).subs(place), float)
            rest = np.array(g.subs(dict.fromkeys(states, 0)).subs(place), float).ravel()
            heights = [float(m.branch[y].subs(place)) for y in states]
            assert np.allclose(heights, np.linalg.solve(matrix, -rest), rtol=1e-8)
            real = np.linalg.eigvals(matrix).real
            kind = "stable" if max(real) < 0 else "unstable" if min(real) > 0 else "saddle"
            assert str(sp.sympify(m.stability).subs(place)) == kind or m.domain.subs(place) == sp.false
    assert all(path.exists() for path in export(system, "c", tmp_path, order=1))


def test_no_divisors_are_sought_in_a_matrix_of_six_full_rows(monkeypatch):
    monkeypatch.setattr("sympy.polys.matrices.DomainMatrix.lu_solve", lambda *_: pytest.fail("the field was used"))
    p, q, u = sp.symbols("p q u")
    full = sp.Matrix(6, 6, lambda i, j: sp.prime(6 * i + j + 1) * p + sp.prime(7 * j + i + 2) * q * sp.sin(u))
    assert solved(full, sp.ones(6, 1)) is None


def test_no_normal_form_is_sought_of_a_long_fraction_in_many_functions():
    """Three fast states with ten functions in their rates had no characteristic polynomial within 12 s."""
    x, u = sp.symbols("x u", real=True)
    waves = [f(angle) for f in (sp.sin, sp.cos, sp.exp) for angle in (x, u, x + u)]
    long = sp.expand(sp.Add(*waves) ** 3) / (1 + x * sp.Abs(u))
    assert in_lowest_terms(long) is long


@pytest.mark.parametrize("n", [3, pytest.param(4, marks=pytest.mark.further)])
def test_a_linear_fast_system_of_many_symbols_has_its_manifold(n):
    ys, u = sp.symbols(f"y0:{n}"), sp.Symbol("u")
    slope = sp.Matrix(n, n, lambda i, j: sp.Symbol(f"p{i}{j}") + sp.Symbol(f"q{i}{j}") * sp.sin(u))
    rest = sp.Matrix([sp.cos(u) * k - 1 for k in range(n)])
    (found,) = solutions_of([*(slope * sp.Matrix(ys) + rest)], [*ys])
    place = {s: sp.Rational(k + 2, k * k + 3) for k, s in enumerate(sorted(slope.free_symbols - {u}, key=str))}
    matrix, right = (np.array(part.subs(place).subs(u, 0.3), float) for part in (slope, rest))
    heights = [float(found[y].subs(place).subs(u, 0.3)) for y in ys]
    assert np.allclose(matrix @ heights, -right.ravel(), rtol=1e-8)
