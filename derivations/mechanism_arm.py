"""A two-link arm pushing on a surface: the configurations in which it jams."""

# %% The contact
from asympk.systems import arm

mechanism = arm.mechanism()

RESULTS = {"directions": mechanism.plain.directions, "delassus": mechanism.plain.delassus}
