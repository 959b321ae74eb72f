"""Neimark and Fufaev's brake shoe: the heavier the carriage, the sooner it jams."""

# %% The contact of the shoe on a moving belt
from asympk.systems import brake_shoe

mechanism = brake_shoe.mechanism()

# %% The paradox
# Under a heavy carriage the hinge stands still, and a shoe jams that leans by less than the angle of friction. A light
# carriage gives way, and the critical friction is (1 + m / M) tan(theta).
critical = mechanism.plain.delassus[0, 0] / mechanism.plain.delassus[0, 1]

RESULTS = {
    "delassus": mechanism.plain.delassus,
    "sliding_velocity": mechanism.plain.slip,
    "critical_friction": critical.cancel(),
}
