r"""A slender rod whose end is a bead on a rough straight wire, a constraint that holds both ways.

The wire can push and pull, so sliding has one motion below the critical friction of the rod on the ground, and two or
none above. Source: an example of ours; for constraints that hold both ways, Le Suan An (Le xuan Anh), Dynamics of
Mechanical Systems with Coulomb Friction, Springer (2003).
"""

from functools import cache

from asympk.mechanics.mechanism import Mechanism
from asympk.systems import painleve_rod
from asympk.systems.catalogue import on_elastic_contact

VALUES, STATE, TURN = painleve_rod.VALUES, painleve_rod.STATE, painleve_rod.TURN


@cache
def mechanism() -> Mechanism:
    """Return the rod with its bead on the wire."""
    return painleve_rod.mechanism(unilateral=False)


system, scenes = on_elastic_contact(mechanism, VALUES, STATE, "1/2", "bead-rod-jump")
