r"""The models of five systems checked for decreasing mu: a reaction, several states, a nonlinear layer, two mechanisms.

The error of order n over its first omitted term must tend to 1 as mu -> 0. For the limit (order 0) of a system with
friction the first omitted term is not known, and the error over mu log(1/mu) must tend to a constant. A row whose
measure is too small for the accuracy of the reference is left out.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

from asympk import systems
from asympk.methods import solve
from asympk.scene import Scene
from asympk.storage.rows import KEPT, StoredRows, in_kept_digits
from asympk.symbolic.system import System

MUS = ("1/32", "1/100", "1/320", "1/1000", "1/3200", "1/10000")
ORDERS = (0, 1, 2)
DIGITS = 18  # of the reference
LEAST = 1e-11  # rows with a smaller measure are left out

x, y, u, v, w = sp.symbols("x y u v w", real=True)
mu = sp.Symbol("mu", positive=True)
kappa, lambda_ = sp.symbols("kappa lambda", positive=True)


@dataclass(frozen=True)
class SceneFamily:
    """A system, the values of its parameters except the small one, a start, and a horizon."""

    system: System
    values: dict
    start: Any
    until: str

    def scene(self, small: str) -> Scene:
        """Return the scene for one value of the small parameter."""
        return Scene(system=self.system, values={**self.values, self.system.small: small}, start=self.start,
                     until=self.until)


@cache
def five_systems() -> dict[str, SceneFamily]:
    """Return the five systems by name."""
    reaction = System.smooth({x: -x + (x + kappa - lambda_) * y}, {y: x - (x + kappa) * y}, mu)
    several = System.smooth({x: -x + u * v, w: x - w * u}, {u: -2 * u + v + x + u * v / 4, v: -u - 3 * v + w**2}, mu)
    cubic = System.smooth({x: -x * y}, {y: x - y - y**3}, mu)
    rod = {"sigma": 1, "sigma0": 1, "kappa": 1, "c2": "1/2"}
    held = {"x1": 0, "x2": 0, "x": 0, "y": 0, "z": -1}
    return {
        "enzyme reaction": SceneFamily(reaction, {kappa: 1, lambda_: "1/2"}, (1, 0), "1"),
        "two slow, two fast states": SceneFamily(several, {}, (1, "1/2", -1, 1), "1"),
        "nonlinear layer": SceneFamily(cubic, {}, (1, 2), "1"),
        "held rod": SceneFamily(held_rod(), {"f": 2}, held, "1/2"),
        "nonlinear rod": SceneFamily(systems.nonlinear_rod.system(), rod, (0, "1/5", -1), "2"),
    }


@cache
def held_rod() -> System:
    """Return the elastic rod with friction f, of unit masses, pull and stiffness of the spring, at tan(alpha) = 4/3."""
    return systems.held_rod.mechanism(1, sp.atan(sp.Rational(4, 3)), 1, 1).elastic(mu, sp.Rational(1, 2))


def rows(names: Collection[str] | None = None, mus: Iterable[str] = MUS) -> StoredRows:
    """Return the rows by system, order and state, in order of decreasing mu.

    A row has the error of one state at one order, and its ``measure``: the first omitted term, or mu log(1/mu).
    """
    about = {name: {"start": str(family.start), "until": family.until} for name, family in five_systems().items()}
    settings = {"cases": about, "digits": DIGITS, "kept": KEPT, "reference": "collocation, exact flow"}
    found = StoredRows(provenance=settings)
    for name, family in five_systems().items():
        if names is None or name in names:
            found += sorted(_rows(name, family, mus), key=lambda row: (row["order"], row["state"], -row["mu"]))
    return found


def is_limit(row: Mapping) -> bool:
    """Tell whether a row is of a limit with friction, where the measure is mu log(1/mu)."""
    return row["with_friction"] and row["order"] == 0


def _rows(name, family, mus):
    friction = bool(family.system.frictions)
    for small in mus:
        scene, number = family.scene(small), float(sp.Rational(small))
        truth = solve(scene, digits=DIGITS).final
        for order in ORDERS:
            path = solve(scene, "jump", order=order)
            errors = [float(a) - float(b) for a, b in zip(truth, path.final, strict=True)]
            of_terms = "omitted" in path.info
            measures = path.info.get("omitted") or [number * float(sp.log(1 / number))] * len(errors)
            k = max(range(len(errors)), key=lambda i: abs(measures[i] if of_terms else errors[i]))
            if abs(measures[k]) > LEAST:
                found = {"error": errors[k], "measure": measures[k], "ratio": errors[k] / measures[k]}
                yield {"system": name, "with_friction": friction, "order": order, "state": path.names[k], "mu": number,
                       **in_kept_digits(found)}
