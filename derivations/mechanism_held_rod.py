"""The Painlevé-Klein rod with its smooth mass on a spring: the sides of the paradox change with the place."""

# %% The contact
import sympy as sp

from asympk.systems import held_rod

mechanism = held_rod.mechanism()

# %% The paradox is that of the free rod; where a_N changes its sign is not
a_N = sp.factor(mechanism.plain.free[0])
place = mechanism.plain.coordinates[1]

RESULTS = {
    "critical_friction": mechanism.critical_friction,
    "free_normal_acceleration": a_N,
    "sides_change_at": sp.solve(a_N, place)[0],
}
