"""Arguments that broadcast: they are read, checked, and given out a few rows at a time, without a full copy."""

from dataclasses import dataclass
from math import prod

import numpy as np

from asympk.errors import InputError
from asympk.numbers import Number, common_shape, entry_name, first_place, numbers, require_finite
from asympk.scene import LIMITS

ORDER = ("sigma", "sigma0", "mu", "x", "y", "z", "until")


@dataclass(frozen=True)
class Column:
    """One argument of a computation over the flat rows of the broadcast ``shape``."""

    values: np.ndarray
    shape: tuple

    def rows(self, which: np.ndarray | slice) -> Number:
        """Return the rows of a slice or of indices as contiguous doubles, or one double if ``values`` has one entry."""
        if self.values.size == 1:
            return np.float64(self.values.reshape(-1)[0])
        if self.values.shape == self.shape and self.values.flags.c_contiguous:
            found = self.values.reshape(-1)[which]
        else:
            found = np.broadcast_to(self.values, self.shape).flat[which]
        return np.ascontiguousarray(found, dtype=float)

    def array(self, which: np.ndarray | slice) -> np.ndarray:
        """Return the rows as an array, also where ``values`` has one entry."""
        found = self.rows(which)
        if isinstance(found, float):
            size = len(range(*which.indices(prod(self.shape)))) if isinstance(which, slice) else len(which)
            return np.full(size, found)
        return found


def scene_columns(
    sigma: Number, mu: Number, x: Number, y: Number, z: Number, until: Number, sigma0: Number | None = None
) -> tuple[tuple[int, ...], dict[str, Column]]:
    """Return (shape, {name: Column}) of many scenes; the values of x, y, z are not checked. Raises ``InputError``."""
    given = {"sigma": sigma, "mu": mu, "x": x, "y": y, "z": z, "until": until}
    given |= {} if sigma0 is None else {"sigma0": sigma0}
    read = {name: numbers(name, value) for name, value in given.items()}
    for name, values in read.items():
        if name not in {*"xyz"}:
            require_finite(name, values, *LIMITS.get(name, ()))
    shape = common_shape(read, read.values())
    found = {name: Column(values, shape) for name, values in read.items()}
    if sigma0 is None:
        found["sigma0"] = found["sigma"]
    else:
        _require_order(found["sigma0"], found["sigma"])
    return shape, found


def _require_order(sigma0, sigma):
    """Raise ``InputError`` unless sigma0 >= sigma, for the rows to which these two alone broadcast."""
    above, below = np.broadcast_arrays(sigma0.values, sigma.values)
    if (above < below).any():
        at = first_place(above < below)
        raise InputError(f"{entry_name('sigma0', at)} = {above[at]}: it must be at least sigma = {below[at]}")
