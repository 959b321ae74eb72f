r"""Physical quantities of the rod to nondimensional ones and back, by the groups of section 2.

The quantities are the mass m, the force P, the friction coefficients f and f0, the angle alpha, and the rod's length
l, stiffness k and damping h, in any consistent units (SI: kg, N, 1, 1, rad, m, N, s/m). Every formula is that of
``painleve_klein.groups()``, lowered; nothing is typed in here.
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from typing import NamedTuple

import sympy as sp

from asympk.errors import InputError
from asympk.multiprecision import context, times
from asympk.numbers import number
from asympk.path import Event
from asympk.symbolic.lowering import lower
from asympk.systems import painleve_klein, rod

DIGITS = 100
STATE = ("R1", "dR1", "u", "t")
RESULTS = ("sigma", "mu", "sigma0", "x", "y", "z", "until")
_SYMBOLS = {"m": rod.m, "P": rod.P, "f": rod.f, "f0": rod.f0, "alpha": rod.alpha, "l": rod.l, "k": rod.k, "h": rod.h,
            "R1": rod.R1, "dR1": rod.dR1, "u": rod.u, "t": sp.Symbol("t", real=True)}  # fmt: skip


@dataclass(frozen=True)
class Degrees:
    """An angle in degrees, exact."""

    value: Fraction


@dataclass(frozen=True)
class Units:
    """What one nondimensional unit is in physical ones: of time, of reaction and of velocity."""

    time: Fraction
    reaction: Fraction
    velocity: Fraction

    def state(self, x, y, z):
        """Return (R_1, R_1', u) of (x, y, z)."""
        return _times(x, self.reaction), _times(y, self.reaction / self.time), _times(z, self.velocity)

    def moment(self, t):
        """Return the physical time of the nondimensional ``t``."""
        return _times(t, self.time)


class Told(NamedTuple):
    """The start and the horizon of a path told in physical quantities."""

    start: tuple
    until: object


@cache
def formulas():
    """Return the nondimensional parameters, start and horizon as expressions of ``symbols()``, by name."""
    group = {g.symbol.name: g.definition for g in painleve_klein.groups()}
    time = 1 / sp.diff(group["tau"], _SYMBOLS["t"])
    return {
        "sigma": group["sigma"],
        "mu": group["mu"],
        "sigma0": group["sigma0"],
        "x": group["rho"],
        "y": group["rho"].subs(rod.R1, rod.dR1) * time,
        "z": group["v"],
        "until": group["tau"],
    }


@cache
def scales():
    """Return the physical time, reaction and velocity of one nondimensional unit as expressions."""
    group = {g.symbol.name: g.definition for g in painleve_klein.groups()}
    pairs = (("tau", "t"), ("rho", "R1"), ("v", "u"))
    return tuple(1 / sp.diff(group[name], _SYMBOLS[state]) for name, state in pairs)


def symbols():
    """Return the symbol of every physical quantity by its name in a scene file."""
    return dict(_SYMBOLS)


def quantity(name, value):
    """Return a physical quantity as an exact number; an angle may be ``"60 deg"``. Raises ``InputError``."""
    if name == "alpha":
        return _angle(value)
    if name in STATE:
        return number(name, value, None if name != "t" else lambda v: v >= 0, "zero or positive")
    return number(name, value, lambda v: v > 0, "positive")


def _angle(value):
    if isinstance(value, str) and value.strip().endswith("deg"):
        degrees = number("alpha", value.strip().removesuffix("deg").strip())
        if not 0 < degrees < 90:
            raise InputError(f"alpha = {value!r:.60}: it must be between 0 and 90 deg")
        return Degrees(Fraction(degrees))
    return number("alpha", value, lambda v: 0 < v < Fraction("1.5707963267948966"), "between 0 and pi/2, or '60 deg'")


def nondimensional(quantities):
    """Return ``RESULTS`` and the ``Units``, as fractions right to 100 digits, from exact quantities by name."""
    values = [_value(quantities[name]) for name in _SYMBOLS]
    formula = lower(_SYMBOLS.values(), [*formulas().values(), *scales()], target="mpmath")
    found = formula.to_digits(DIGITS, *values)
    found = [number(name, value) for name, value in zip((*RESULTS, "time", "reaction", "velocity"), found, strict=True)]
    return dict(zip(RESULTS, found, strict=False)), Units(*found[len(RESULTS):])


def _value(value):
    if isinstance(value, Degrees):
        m = context(DIGITS)
        return m.pi * value.value.numerator / (180 * value.value.denominator)
    return Fraction(value)


def physical(path, units):
    """Return ``path`` told in physical quantities: times, and (R_1, R_1', u) in place of (x, y, z)."""
    scene = path.scene
    return replace(
        path,
        scene=Told(units.state(*scene.start), units.moment(scene.until)),
        final=units.state(*path.final),
        events=tuple(Event(e.kind, units.moment(e.t), units.state(*e.state)) for e in path.events),
        at=lambda t: _told_at(path, t, units),
    )


def _told_at(path, t, units):
    import numpy as np

    moments = np.minimum(np.asarray(t) / float(units.time), float(path.scene.until))
    return np.stack(units.state(*path(moments)))


def _times(value, scale):
    if isinstance(value, int | Fraction):
        return value * scale
    if hasattr(value, "_mpf_"):
        return times(value, scale, max(53, value._mpf_[1].bit_length()) + 20)
    return value * float(scale)
