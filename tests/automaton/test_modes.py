"""Modes in symbols: their guards beside velocities that rest."""

import sympy as sp

import asympk as ap
from asympk.automaton.modes import GuardedMode
from asympk.symbolic.branches import Phase

x, u, w, F, G = sp.symbols("x u w F G", real=True)


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
