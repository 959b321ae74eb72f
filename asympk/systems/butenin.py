r"""Pfeiffer and Butenin: the Painlevé-Klein rod with an elastic rod that has no damping, compliance eps^2.

On the good side the rod rings, a centre; on the other side of the paradox the equilibrium is a saddle. Both x and
y = eps x' are fast. Source: F. Pfeiffer, Zur Frage der sogenannten Coulombschen Reibungsgesetze, Zeitschrift für
Mathematik und Physik 58; N. V. Butenin, Prikl. Mat. Mekh. 12 (1948), for the jump and the phase plane (R, R').
"""

from asympk.systems.catalogue import Turn, eps, on_elastic_contact
from asympk.systems.painleve_klein.equations import mechanism

VALUES = {"m": 1, "P": 1, "alpha": "6/5", "f": 2, "f_0": 2, "eps": "1e-2"}
STATE = {"x1": 0, "x2": 0, "x1'": -1, "x2'": -1}
TURN: Turn = ("alpha", "1/20", "3/2", {})

system, scenes = on_elastic_contact(mechanism, VALUES, STATE, "1/10", "butenin-jump", eps**2, 0)
