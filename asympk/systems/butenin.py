r"""Pfeiffer and Butenin: the Painlevé-Klein rod with an elastic rod that has no damping, compliance eps^2.

On the good side the rod rings, a centre; on the other side of the paradox the equilibrium is a saddle. Both x and
y = eps x' are fast. Source: F. Pfeiffer, Zur Frage der sogenannten Coulombschen Reibungsgesetze, Zeitschrift für
Mathematik und Physik 58; N. V. Butenin, Prikl. Mat. Mekh. 12 (1948), for the jump and the phase plane (R, R').
"""

from asympk.systems.catalogue import eps, on_elastic_contact
from asympk.systems.painleve_klein import equations

VALUES, STATE, TURN = {**equations.VALUES, "eps": "1e-2"}, equations.STATE, equations.TURN
mechanism = equations.mechanism

system, scenes = on_elastic_contact(mechanism, VALUES, STATE, "1/10", "butenin-jump", eps**2, 0)
