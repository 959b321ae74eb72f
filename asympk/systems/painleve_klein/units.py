r"""Conversion of the rod's physical quantities to nondimensional ones and back, by the groups of section 2.

The quantities are the mass m, the force P, the friction coefficients f and f0, the angle alpha, and the rod's length
l, stiffness k and damping h, in any consistent units (SI: kg, N, 1, 1, rad, m, N, s/m). All formulas come from
``painleve_klein.groups()``, lowered to numbers; none is written a second time here.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, partial
from typing import Any, ClassVar

import sympy as sp

from asympk.errors import InputError
from asympk.multiprecision import private_context
from asympk.numbers import KEPT_DIGITS, Number, number, raw_entries, short
from asympk.path import Path, times_within
from asympk.scene import Scene, triple
from asympk.shown import Card, ShownAsTable, number_as_text
from asympk.symbolic.lowering import lower
from asympk.systems import painleve_klein
from asympk.systems.painleve_klein import rod

STATE = ("R_1", "dR_1", "u", "until")
RESULTS = ("sigma", "mu", "sigma0", "x", "y", "z", "until")
_GROUPS = ("sigma", "mu", "sigma0", "rho", "y", "v", "tau")  # their names in the paper
SI = ("kg", "N", "m", "s")
_PREFIXES = {"": 0, "k": 3, "M": 6, "c": -2, "m": -3, "u": -6, "µ": -6}  # powers of ten
_SIZES = {prefix + name: Fraction(10) ** (power + base) for name, base in (("g", -3), ("N", 0), ("m", 0), ("s", 0))
          for prefix, power in _PREFIXES.items()} | {"t": Fraction(1000)}
# the unit of every quantity that has one, from the units of mass, force, length and time
UNITS = {"m": "{0}", "P": "{1}", "l": "{2}", "k": "{1}", "h": "{3}/{2}", "R_1": "{1}", "dR_1": "{1}/{3}",
         "u": "{2}/{3}", "until": "{3}", "t": "{3}", "R": "{1}"}
# the symbol of every physical quantity by its name in a scene file
SYMBOLS = {"m": rod.m, "P": rod.P, "f": rod.f, "f0": rod.f0, "alpha": rod.alpha, "l": rod.l, "k": rod.k, "h": rod.h,
           "R_1": rod.R1, "dR_1": rod.dR1, "u": rod.u, "until": sp.Symbol("t", real=True)}


@dataclass(frozen=True)
class Degrees:
    """An angle in degrees, exact."""

    value: Fraction

    def radians(self, digits: int) -> Any:
        """Return the angle in radians, an mpf with ``digits``."""
        m = private_context(digits)
        return m.pi * self.value.numerator / (180 * self.value.denominator)

    def __str__(self) -> str:
        return f"{self.value} deg"


@dataclass(frozen=True)
class Units:
    """The nondimensional units of time, reaction and velocity, each as a physical quantity."""

    time: Fraction
    reaction: Fraction
    velocity: Fraction

    def state(self, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number]:
        """Return (R_1, R_1', u) of (x, y, z)."""
        return _times(x, self.reaction), _times(y, self.reaction / self.time), _times(z, self.velocity)

    def moment(self, t: Number) -> Number:
        """Return the physical time of the nondimensional ``t``."""
        return _times(t, self.time)


@dataclass(frozen=True, repr=False)
class RodInUnits(ShownAsTable):
    """A physical rod: its exact ``quantities`` by name, the ``units``, and the nondimensional ``numbers`` they make.

    ``numbers`` are (sigma, mu, sigma0, x, y, z, until); ``words`` name the units of mass, force, length and time.
    """

    quantities: tuple[tuple[str, Any], ...]
    units: Units
    numbers: tuple[Any, ...]
    words: tuple[str, ...] = SI

    @property
    def unit(self) -> dict[str, str]:
        """The names of the units by quantity."""
        return {name: unit.format(*self.words) for name, unit in UNITS.items()}

    @property
    def rows(self) -> tuple[tuple[str, str], ...]:
        """The quantities with their units, for a card."""
        return tuple((name, f"{number_as_text(v)} {self.unit.get(name, '')}".strip()) for name, v in self.quantities)

    def _card(self) -> Card:
        return Card("Rod in physical quantities", self.rows)


@dataclass(frozen=True, repr=False)
class PhysicalScene(ShownAsTable):
    """The scene of a path in physical quantities: start, horizon, and ``delay`` = h l, the unit of time."""

    names: ClassVar[tuple[str, ...]] = STATE[:-1]
    system: ClassVar[None] = None  # as of a ``Scene`` of the rod
    name: str
    start: tuple[Any, ...]
    until: Any
    delay: float
    units: dict[str, str] = field(hash=False)

    @property
    def combinations(self) -> tuple[tuple[str, tuple], ...]:
        """The load R = R_1 + h l R_1' (2.3)."""
        return (("R", (1, self.delay, 0)),)

    def _card(self) -> Card:
        begun = zip(self.names, self.start, strict=True)
        start = ", ".join(f"{name} = {number_as_text(float(value))} {self.units[name]}" for name, value in begun)
        until = f"{number_as_text(float(self.until))} {self.units['t']}"
        title = f"Scene {self.name + ' ' if self.name else ''}in physical quantities"
        return Card(title, (("start", start), ("until", until)))


@cache
def formulas() -> dict[str, sp.Expr]:
    """Return the nondimensional parameters, start and horizon by name, as expressions in ``SYMBOLS``."""
    group, (time, *_) = {g.symbol.name: g.definition for g in painleve_klein.groups()}, scales()
    group["y"] = group["rho"].subs(rod.R1, rod.dR1) * time
    return {result: group[name] for result, name in zip(RESULTS, _GROUPS, strict=True)}


def scales() -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return the physical time, reaction and velocity of one nondimensional unit as expressions."""
    group = {g.symbol.name: g.definition for g in painleve_klein.groups()}
    pairs = (("tau", "until"), ("rho", "R_1"), ("v", "u"))
    return tuple(1 / sp.diff(group[name], SYMBOLS[state]) for name, state in pairs)


def quantity(name: str, value: Any) -> Number:
    """Return a physical quantity as an exact number; an angle may be ``"60 deg"``. Raises ``InputError``."""
    if name == "alpha":
        return _angle(value)
    if name in STATE:
        return number(name, value, None if name != "until" else lambda v: v >= 0, "zero or positive")
    return number(name, value, lambda v: v > 0, "positive")


def _angle(value: Any) -> Number:
    text = value.strip() if isinstance(value, str) else ""
    if text.endswith("deg"):
        bare = text.removesuffix("deg").strip()
        return Degrees(Fraction(number("alpha", bare, lambda v: 0 < v < 90, "between 0 and 90 degrees")))
    if text[-1:].isalpha() or text.endswith("°"):
        raise InputError(f"alpha = {short(value)}: it must be a number of radians, or of degrees, as '60 deg'")
    steepest = Fraction("1.5707963267948966")
    return number("alpha", value, lambda v: 0 < v < steepest, "between 0 and pi/2, or '60 deg'")


def in_radians(name: str, value: Any, digits: int = KEPT_DIGITS) -> Number:
    """Return a physical quantity as ``quantity`` does, an angle in radians right to ``digits``."""
    found = quantity(name, value)
    return number(name, found.radians(digits)) if isinstance(found, Degrees) else found


def nondimensional(quantities: Mapping[str, Number]) -> tuple[dict[str, Number], "Units"]:
    """Return ``RESULTS`` and the ``Units``, as fractions correct to ``KEPT_DIGITS``, from exact quantities by name."""
    exact = (quantities[name] for name in SYMBOLS)
    values = [value.radians(KEPT_DIGITS) if isinstance(value, Degrees) else Fraction(value) for value in exact]
    found = _lowered("mpmath").to_digits(KEPT_DIGITS, *values)
    names = (*(f"nondimensional {name}" for name in RESULTS), "time", "reaction", "velocity")
    found = [number(name, value) for name, value in zip(names, found, strict=True)]
    return dict(zip(RESULTS, found, strict=False)), Units(*found[len(RESULTS):])


def in_arrays(quantities: Iterable[Number]) -> tuple[dict[str, Number], "Units"]:
    """Return ``RESULTS`` and the ``Units`` in doubles, from arrays of the quantities in the order of ``SYMBOLS``."""
    found = _lowered("numpy")(*quantities)
    return dict(zip(RESULTS, found, strict=False)), Units(*found[len(RESULTS):])


@cache
def _lowered(target):
    return lower(SYMBOLS.values(), [*formulas().values(), *scales()], target=target)


def unit_names(words: Any) -> tuple[str, ...]:
    """Return the names of the units of mass, force, length and time.

    Raises ``InputError`` for other than four words, and for units of SI, with prefixes, or tonnes, whose force is not
    mass times length over time squared. Other names are taken as they are.
    """
    if not (isinstance(words, list | tuple) and len(words) == len(SI) and all(isinstance(w, str) and w for w in words)):
        raise InputError(f"units = {short(words)}: name those of mass, force, length and time, as in {[*SI]}")
    if all(word in _SIZES for word in words):
        mass, force, length, time = (_SIZES[word] for word in words)
        if (one := mass * length / time**2) != force:
            raise InputError(f"units = {short(words)}: 1 {words[0]} {words[2]}/{words[3]}^2 is {float(one / force):g} "
                             f"{words[1]}; give all numbers in units of which it is 1, such as {[*SI]}")
    return tuple(words)


def scene(given: dict[str, Any], start: Any, until: Any, name: str = "", words: Any = SI) -> Scene:
    """Return the ``Scene`` of a physical rod; raises ``InputError``."""
    words = unit_names(words)
    given = {**given, **dict(zip(STATE, (*triple(start, "[R_1, R_1', u]"), until), strict=True))}
    quantities = {key: quantity(key, value) for key, value in given.items()}
    number("f0", given["f0"], lambda f0: f0 >= quantities["f"], f"at least f = {number_as_text(quantities['f'])}")
    found, scale = nondimensional(quantities)
    numbers = tuple(found[key] for key in RESULTS)
    sigma, mu, sigma0, x, y, z, horizon = numbers
    rod_in_units = RodInUnits(tuple(quantities.items()), scale, numbers, words)
    return Scene(sigma, mu, (x, y, z), horizon, sigma0, name, rod=rod_in_units)


def scene_in_units(scene: Scene) -> PhysicalScene:
    """Return the scene of a physical rod in its physical units, as a ``PhysicalScene``."""
    quantities, delay = dict(scene.rod.quantities), float(scene.rod.units.time)
    *start, until = (quantities[name] for name in STATE)
    return PhysicalScene(scene.name, tuple(start), until, delay, scene.rod.unit)


def physical(path: Path) -> Path:
    """Return ``path`` in physical quantities: physical times, and (R_1, R_1', u) in place of (x, y, z)."""
    scene = path.scene
    if getattr(scene, "rod", None) is None:
        raise InputError("the path has no physical quantities; give its scene or file in m, P, f, alpha, l, k, h")
    units, physical = scene.rod.units, scene_in_units(scene)
    events = tuple(e._replace(t=units.moment(e.t), state=units.state(*e.state)) for e in path.events)
    reached = {"reached": units.moment(path.info["reached"])} if "reached" in path.info else {}
    return replace(path, scene=physical, final=units.state(*path.final), events=events,
                   at=partial(_states, path, units), info={**path.info, **reached})


def _states(path, units, t):
    """Return (R_1, R_1', u) of a path at physical times, an array of shape ``(3,) + t.shape``."""
    import numpy as np

    times = times_within(t, float(units.moment(path.end)))
    if not hasattr(path.final[0], "_mpf_"):
        return np.stack(units.state(*path(np.minimum(times / float(units.time), float(path.end)))))
    end = number("end", path.end)
    moments = [min(number("t", time) / units.time, end) for time in raw_entries("t", t).ravel()]
    states = [units.state(*state) for state in path(moments).T]
    size = len(path.final)
    return np.array(states, dtype=object).reshape(times.size, size).T.reshape(size, *times.shape)


def _times(value, scale):
    if isinstance(value, int | Fraction):
        return value * scale
    if hasattr(value, "_mpf_"):
        return value * scale.numerator / scale.denominator
    return value * (float(scale) if isinstance(scale, Fraction) else scale)
