"""The kernel of the rod against its nearest peer: the affine flow, by matrix exponentials, of any affine system.

The affine flow follows the rod under other names, under which the kernel does not apply. Costs are ratios of the median
times of several runs.
"""

from dataclasses import dataclass
from itertools import product

from asympk.storage.rows import Stored
from asympk.studies.bench import MUS, SCENES, beside_the_kernel


@dataclass(frozen=True)
class PeerRow:
    """Time of the affine flow on a scene over that of the kernel, and of LSODA at 1e-6 over that of the affine flow."""

    scene: str
    mu: float
    affine: float
    lsoda: float


def rows() -> list[PeerRow]:
    """Return the rows for all scenes and values of mu of ``asympk bench``."""
    found = []
    for name, mu in product(SCENES, MUS):
        _, affine, kernel, lsoda = beside_the_kernel(name, mu)
        found.append(PeerRow(name, mu, *(float(f"{ratio:.3g}") for ratio in (affine / kernel, lsoda / affine))))
    return found


def stored() -> Stored:
    """Return all rows, and the settings with which they were computed."""
    return rows(), {"until": 5, "sigma": 1}
