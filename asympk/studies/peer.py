"""The kernel of the rod against its nearest peer: the affine flow, by matrix exponentials, of any affine system.

The affine flow follows the rod under other names, under which the kernel does not apply. Costs are ratios of the median
times of several runs.
"""

from itertools import product

from asympk.storage.rows import StoredRows
from asympk.studies.bench import MUS, SCENES, beside_the_kernel


def rows() -> StoredRows:
    """Return the rows for all scenes and values of mu of ``asympk bench``.

    ``affine`` is the time of the affine flow over that of the kernel, ``lsoda`` that of LSODA at 1e-6 over that of the
    affine flow.
    """
    found = StoredRows(provenance={"until": 5, "sigma": 1})
    for name, mu in product(SCENES, MUS):
        _, affine, kernel, lsoda = beside_the_kernel(name, mu)
        times = {"affine": affine / kernel, "lsoda": lsoda / affine}
        found.append({"scene": name, "mu": mu, **{of: float(f"{ratio:.3g}") for of, ratio in times.items()}})
    return found
