"""Modes in symbols: their guards beside velocities that rest."""

import sympy as sp

import asympk as ap
from asympk.automaton.modes import GuardedMode
from asympk.symbolic.branches import Phase

x, y, u, w, F, G = sp.symbols("x y u w F G", real=True)


def test_the_guard_of_a_velocity_has_no_state_that_a_velocity_at_rest_gives():
    """In doubles u + w - 2 x w loses its digits where u = -w, and -2 x w does not."""
    feet = [ap.Friction(u + w, F, load=1, kinetic=1), ap.Friction(u + w - 2 * x * w, G, load=1, kinetic=1)]
    system = ap.System.with_frictions({x: w, u: F + G, w: -x}, {}, feet)
    guards = {
        tuple(phase.velocity for phase in branch): {g.key: g.value for g in GuardedMode(system, branch).guards}
        for branch in ((Phase(1, 0), Phase(1, 1)), (Phase(1, 1), Phase(1, 1)))
    }
    assert guards[0, 1]["velocity_zero", 1, False] == -2 * x * w
    assert guards[1, 1]["velocity_zero", 1, False] == u + w - 2 * x * w


def test_the_guard_of_a_velocity_is_finite_beside_one_at_rest_whose_slopes_by_a_state_cancel():
    """u (1 + x) - u x does not depend on x, and 1/0 of the other velocity was subtracted."""
    long = sum(sp.sin(k * y) * sp.cos(y / k + sp.exp(-k * y)) for k in range(1, 9))  # velocities are not expanded
    rest = u * (1 + x) - u * x + w * long
    feet = [ap.Friction(rest, F, load=1, kinetic=1), ap.Friction(rest + w + x, G, load=1, kinetic=1)]
    system = ap.System.with_frictions({x: w, y: 0, u: F + G, w: -x}, {}, feet)
    values = [g.value for g in GuardedMode(system, (Phase(1, 0), Phase(1, 1))).guards if g.kind == "velocity_zero"]
    assert values == [w + x]
