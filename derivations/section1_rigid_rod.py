"""Section 1 of Fufaev (1991): the rigid rod, and the paradox as an inequality."""

# %% Newton's law for the two masses
# The rod pushes M2 along itself by R and M1 back by R. Across the guides nothing moves, so the rough guide
# carries N1 = R sin(alpha), and Coulomb's friction on M1 is kappa N1 with kappa = +-f.
import sympy as sp

from asympk.systems.painleve_klein import rod

forces = rod.force_balance(rod.alpha)
friction = rod.coulomb()
equations = rod.rigid_equations()

# %% The reaction
# A rigid rod keeps x1 - x2; equal accelerations fix R, (1.3).
reaction = rod.rigid_reaction()

# %% Which motions obey (1.1)
# Friction must oppose the velocity, kappa R u < 0. With w = 2 cos(alpha) / (f sin(alpha)) the reaction has the sign
# of 1 / (w - kappa/f), so (1.1) is an inequality in w alone: steep means |w| < 1, shallow |w| > 1.
motions = rod.rigid_motions()
positions = {(motion.velocity, motion.sign): motion.positions for motion in motions}

# %% The paradox
# Steep: both signs of kappa will do forward (u > 0), none backward (u < 0). From rest there is always one motion.
two_forward = sp.Intersection(*(where for (velocity, _), where in positions.items() if velocity == 1))
some_backward = sp.Union(*(where for (velocity, _), where in positions.items() if velocity == -1))

RESULTS = {
    "guide_reaction": sp.Eq(rod.N1, forces[rod.N1]),
    "friction_force": sp.Eq(rod.F, friction),
    "equation_1_2_rough": sp.Eq(rod.a1, equations[0]),
    "equation_1_2_smooth": sp.Eq(rod.a2, equations[1]),
    "equation_1_3": sp.Eq(rod.R, reaction),
    "loads_of_the_motions": tuple(sorted({motion.load for motion in motions}, key=sp.default_sort_key)),
    "two_motions_forward_for_w_in": two_forward,
    "a_motion_backward_for_w_in": some_backward,
}
