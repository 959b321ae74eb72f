"""A slider-crank with friction in its guide: friction jams it where crank and rod push it into the guide."""

# %% The contact
import sympy as sp

from asympk.systems import crank_slider

mechanism = crank_slider.mechanism()

# %% A heavy crank
# With J -> oo only the slider's mass gives way: G tends to that of a point on a rod, and the critical friction to
# |cot(phi)|, the old rule that a rod steeper than the angle of friction locks.
ratio = mechanism.plain.delassus[0, 0] / mechanism.plain.delassus[0, 1]
heavy = sp.limit(sp.cancel(ratio), crank_slider.J, sp.oo)

RESULTS = {"directions": mechanism.plain.directions, "critical_friction": sp.cancel(ratio), "heavy_crank": heavy}
