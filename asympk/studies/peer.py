"""The nearest peer of the rod's kernel: matrix exponentials with located events, for any system of affine modes.

The affine flow is such a peer. It follows the rod under other names, which no kernel knows; times are medians of runs
of each, as ratios.
"""

from dataclasses import dataclass

from asympk.storage.rows import Stored
from asympk.studies.bench import MUS, SCENES, beside_the_kernel


@dataclass(frozen=True)
class PeerRow:
    """What the affine flow costs on a scene in units of the kernel, and LSODA at 1e-6 in units of the affine flow."""

    scene: str
    mu: float
    affine: float
    lsoda: float


def rows() -> list[PeerRow]:
    """Return the rows of all scenes and values of mu that ``asympk bench`` has."""
    return [_row(name, mu) for name in SCENES for mu in MUS]


def _row(name, mu):
    _, affine, kernel, lsoda = beside_the_kernel(name, mu)
    return PeerRow(name, mu, *(float(f"{ratio:.3g}") for ratio in (affine / kernel, lsoda / affine)))


def stored() -> Stored:
    """Return all rows, and what they were computed with."""
    return rows(), {"until": 5, "sigma": 1}
