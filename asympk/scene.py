"""Scene: parameters, start and horizon of one trajectory."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Scene:
    """One trajectory to follow, in nondimensional quantities.

    ``start`` is (x, y, z) = (rho, rho', v); numbers are int, float, Fraction, str ("0.2" means 1/5) or mpf.
    ``sigma0 >= sigma`` is the static friction, by default ``sigma``.
    """

    sigma: Any
    mu: Any
    start: tuple
    until: Any
    sigma0: Any = None
    name: str = ""

    def __post_init__(self):
        if self.sigma0 is None:
            object.__setattr__(self, "sigma0", self.sigma)
