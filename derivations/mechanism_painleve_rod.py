"""The classical rod on rough ground: where its paradox is, least friction, jump and rebound."""

# %% The contact of a slender rod
import sympy as sp

from asympk.systems import painleve_rod

mechanism = painleve_rod.mechanism()

# %% The paradox
# p = G_NN -+ f G_NT changes its sign at the critical friction; over theta it is least where tan(theta) = 2.
least = mechanism.least_critical_friction("theta")

# %% The jump
# The end stops, and both impulses are multiples of its velocity gamma.
gamma = sp.Symbol("gamma", real=True)
plain = mechanism.plain
impulses = tuple(sp.factor(plain.delassus[0, k] * gamma / plain.determinant) for k in (1, 0))

RESULTS = {
    "delassus": plain.delassus,
    "free_accelerations": plain.free,
    "critical_friction": mechanism.critical_friction.subs(mechanism.coordinates[2], plain.coordinates[2]),
    "least_critical_friction": least.friction,
    "tangent_of_theta_there": least.where.rhs,
    "normal_impulse": impulses[0],
    "tangential_impulse": -impulses[1],
}
