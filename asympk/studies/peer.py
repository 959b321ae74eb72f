"""The nearest peer of the rod's kernel: matrix exponentials with located events, for any system of affine modes.

The affine flow is such a peer. It follows the rod under other names, which no kernel knows; times are medians of runs
of each, as ratios.
"""

from dataclasses import dataclass

import asympk as ap
from asympk.storage.rows import Stored
from asympk.studies.bench import MUS, SCENES, median_seconds, rod_in_general_clothes

WARMING = 6  # runs after which the tables of what follows are made


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
    start = dict(zip("pqw", SCENES[name], strict=True))
    scene = ap.Scene(system=rod_in_general_clothes(), values={"eps": mu, "k": 1, "k0": 1}, start=start, until=5)
    for _ in range(WARMING):
        ap.solve(scene)
    kernel = median_seconds(lambda: ap.solve(ap.Scene(1, mu, SCENES[name], 5)))
    affine = median_seconds(lambda: ap.solve(scene))
    lsoda = median_seconds(lambda: ap.solve(scene, method="lsoda", rtol=1e-6, atol=1e-6))
    return PeerRow(name, mu, *(float(f"{ratio:.3g}") for ratio in (affine / kernel, lsoda / affine)))


def stored() -> Stored:
    """Return all rows, and what they were computed with."""
    return rows(), {"until": 5, "sigma": 1}
