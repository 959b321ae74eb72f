"""Unequal masses and a force on the smooth one: how the paradox of the Painlevé-Klein rod changes."""

# %% The contact
import sympy as sp

from asympk.systems import unequal_masses as masses

mechanism = masses.mechanism()

# %% The paradox
# The lighter the smooth mass, the more friction the paradox needs; the force S does not matter for it.
critical = mechanism.critical_friction

# %% Which side has no motion
# Without a paradox sliding backward is braked. With one it has no motion where a_N and G_NT gamma differ in sign: S
# turns the sides round when it outweighs P.
a_N = sp.factor(mechanism.plain.free[0])

RESULTS = {
    "delassus": mechanism.plain.delassus,
    "critical_friction": critical,
    "free_normal_acceleration": a_N,
    "sides_change_at": sp.solve(a_N, masses.S)[0],
}
