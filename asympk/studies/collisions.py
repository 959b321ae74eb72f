"""The number of times at which the rough mass comes to rest, over mu x0 and z0, from starts with y0 = 0."""

import numpy as np

from asympk.storage.rows import StoredRows

SIGMA, MUS, UNTIL = 1, (1e-3, 3.0), 60
EXPONENTS_X, EXPONENTS_Z = (-2.03, 3.03), (-1.03, 2.03)  # no grid point on a border between whole powers
CELLS = (60, 36)


def rows() -> StoredRows:
    """Return the rows of a logarithmic grid in mu x0 and |z0| for every mu and both signs of z0.

    ``count`` is the number of times at which z becomes 0 from x0 = scaled_x / mu, y0 = 0 and z0 = z.
    """
    from asympk.systems.painleve_klein.arrays.ensemble import solve_many

    scaled, height = ([10 ** (low + (high - low) * k / (n - 1)) for k in range(n)]
                      for (low, high), n in zip((EXPONENTS_X, EXPONENTS_Z), CELLS, strict=True))
    places = [(mu, x, z) for mu in MUS for x in scaled for h in height for z in (-h, h)]
    mu, x, z = np.array(places).T
    events = solve_many(SIGMA, mu, x / mu, 0, z, UNTIL, events=True).events()
    stops = events.trajectory[events.kind == "velocity_zero"]
    counts = np.bincount(stops, minlength=len(places))
    found = ({"mu": mu, "scaled_x": x, "z": z, "count": int(count)}
             for (mu, x, z), count in zip(places, counts, strict=True))
    return StoredRows(found, {"sigma": SIGMA, "until": UNTIL, "start": "(x0, 0, z0)", "method": "exact flow"})
