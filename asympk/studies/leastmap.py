"""The least model over mu and the starting velocity, for a steep and a shallow rod, as rows."""

from decimal import Decimal
from fractions import Fraction

import numpy as np

from asympk.storage.rows import Row, StoredRows
from asympk.studies.least import LADDER, atlas

SIGMAS, START, UNTIL, RTOL = ("1", "-1/2"), (0.0, 0.5), 3.0, 1e-3  # the load lies on no slow plane
EXPONENTS_MU, EXPONENTS_Z = (-8.03, -0.53), (-3.03, 0.97)
CELLS = (31, 25)


def rows() -> StoredRows:
    """Return the rows of a logarithmic grid in mu and |z0| for every sigma, a string, and both signs of z0.

    ``rung`` is that of the least model from (x, y) = START and z, an index of ``LADDER``, 0 for the rigid rod.
    """
    mus, heights = map(_powers_of_ten, (EXPONENTS_MU, EXPONENTS_Z), CELLS)
    speeds = np.concatenate((-heights[::-1], heights))
    found: list[Row] = []
    for sigma in SIGMAS:
        rungs = atlas(float(Fraction(sigma)), mus[:, None], *START, speeds[None, :], UNTIL, rtol=RTOL)
        found += [{"sigma": sigma, "mu": float(mu), "z": float(z), "rung": int(rungs[i, j])}
                  for i, mu in enumerate(mus) for j, z in enumerate(speeds)]
    return StoredRows(found, {"start": list(START), "until": UNTIL, "rtol": RTOL, "rungs": list(LADDER)})


def _powers_of_ten(exponents: tuple[float, float], count: int) -> np.ndarray:
    # numpy.logspace takes the processor's own power, whose last bit is another on another machine
    return np.array([float(10 ** Decimal(exponent)) for exponent in np.linspace(*exponents, count).tolist()])
