"""The rod of Painlevé and Klein as a mechanism: the paradox from a Lagrangian, and the jump through it."""

# %% What is written down
# Two masses on parallel guides, pushed by P; the rod between them is the contact. Its gap is its lengthening, its
# friction acts on the guide of the rough mass, whose load is the reaction times sin(alpha).
import sympy as sp

from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod

mechanism = pk.mechanism()

# %% The paradox
# f load |G_NT| > G_NN is f tan(alpha) > 2, whatever the state.
critical = mechanism.critical_friction.subs(sp.Abs(sp.cos(rod.alpha)), sp.cos(rod.alpha))

# %% The jump through it
# gamma -> 0 and g' = O(c) fix both impulses; the reaction gains P_N / h, which in Fufaev's scales is x -> x - z.
law = mechanism.jump_law()
v = sp.Symbol("v", real=True)
rate = mechanism.velocities[0]
gain = law.reaction.subs(rate, v)

RESULTS = {
    "delassus": mechanism.plain.delassus,
    "free_accelerations": mechanism.plain.free,
    "critical_friction": critical,
    "normal_impulse": law.impulses[0].subs(rate, v),
    "tangential_impulse": law.impulses[1].subs(rate, v),
    "reaction_gains": gain,
}
