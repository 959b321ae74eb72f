r"""The sensitivity of the choice between the two rigid motions: the separatrix through Pi2 and the time to leave it.

For sigma > 0 the repelling slow line of ``slip_opposite`` divides the plane of fast starts in z > 0. On one side the
motion goes to Pi1; on the other the velocity vanishes within a fast layer. A start at the load s = s_line(x) + delta
stays near the line for the time

    T = (mu/sigma) log(1/(sigma delta)) + ...                          to s = 0,     delta > 0,
    T = (mu/sigma) log(sigma z/((sigma + 1) mu |delta|)) + ...         to z = 0,     delta < 0,

The start follows Pi2, the second of the rigid motions, for a time that does not vanish with mu only if delta is
exponentially small: T is O(1) where mu log(1/delta) is O(1). ``divide`` derives all this, with the help of
``jump_map(near=...)`` and ``series.balance``; ``escapes`` compares it with the exact flow.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp

from asympk.asymptotics.jump import OFFSET, JumpMap, jump_map
from asympk.asymptotics.layers import MU, on_slow_line, rest_of, slope_of, slow_and_fast_rate
from asympk.asymptotics.linear import linear
from asympk.asymptotics.ratio import Ratios
from asympk.asymptotics.series import Series, balance, series
from asympk.methods import solve as follow
from asympk.multiprecision import in_context, private_context
from asympk.numbers import number
from asympk.scene import Scene
from asympk.storage.rows import Row, StoredRows
from asympk.symbolic.lowering import lower
from asympk.symbolic.system import System
from asympk.systems import painleve_klein

DEPTH = sp.Symbol("kappa", positive=True)
_MODE = "slip_opposite"  # that of the separatrix
_HERE = (painleve_klein.sigma, painleve_klein.system().small, painleve_klein.x, painleve_klein.z)

SIGMAS, MUS, START, DIGITS = ("1/2", "1", "3"), ("1e-3", "1e-6"), ("1/3", 1), 60
OFFSETS = ("1e-2", "1e-12", "1e-400", "0", "-1e-12", "-1e-2")


@dataclass(frozen=True)
class Divide:
    """The load on the separatrix, a series in mu whose coefficients depend on x, and the jump maps on its two sides.

    ``delay`` is the time until the load vanishes for an exponentially small offset, ``delta = exp(-kappa/mu)``.
    """

    load: Series
    above: JumpMap
    below: JumpMap
    delay: Series

    @property
    def escape_above(self) -> Series:
        """The time until the load vanishes, for an offset > 0."""
        return self.above.events[0].t

    @property
    def escape_below(self) -> Series:
        """The time until the velocity vanishes, for an offset < 0."""
        return self.below.t_hit


def escapes(sigma: Any, mu: Any, x: Any, z: Any, offsets: Iterable[Any], digits: int = 40) -> list[Row]:
    """Return a row for each offset (numbers or decimal strings) of a start ``(x, s_line(x) + offset, z)``.

    A row has the time at which the start leaves the divide, and the rigid motion that it then follows. ``depth`` is
    mu log(1/|offset|), None on the divide itself. ``motion``: "goes on" along Pi1, "stops at once", or "decelerates"
    along Pi2 to the end. ``time`` is the first event time of the exact flow. ``leading`` and ``next`` are the terms of
    the expansion for a fixed offset, ``ratio`` is (time - leading)/next; ``delayed`` is the expansion for a fixed depth
    (offset > 0). A column that does not apply is None.
    """
    return [_escape(sigma, mu, x, z, offset, digits) for offset in offsets]


def rows(sigmas: Iterable[str] = SIGMAS) -> StoredRows:
    """Return the escapes from (x, z) = START at ``OFFSETS`` from the separatrix, for every sigma and mu."""
    found = (row for sigma in sigmas for mu in MUS for row in escapes(sigma, mu, *START, OFFSETS, DIGITS))
    return StoredRows(found, {"start": list(map(str, START)), "digits": DIGITS, "reference": "exact flow"})


def _escape(sigma, mu, x, z, offset, digits):
    until = 2 * (1 + abs(number("sigma", sigma) * number("z", z)))
    scene = Scene.near("Pi2", x=x, offset=offset, z=z, sigma=sigma, mu=mu, until=until)
    size, here = scene.near_to[1], (scene.sigma, scene.mu, scene.start[0], scene.start[2])
    first = follow(scene, digits=digits).events[0]
    m, motion = private_context(digits), _motion(first, scene.sigma)
    depth = leading = following = ratio = delayed = None
    if size != 0:
        depth = -in_context(m, scene.mu) * m.log(abs(in_context(m, size)))
    if motion != "decelerates":
        leading, following = map(m.mpf, _escape_terms(size > 0).to_digits(digits, *here, size, scene.sigma0))
        ratio = (m.mpf(first.t) - leading) / following
    if motion == "goes on":
        (delayed,) = _delayed().to_digits(digits, *here[:3], depth)
    numbers = {"depth": depth, "time": first.t, "leading": leading, "next": following, "ratio": ratio,
               "delayed": delayed}
    return {**dict(zip(("sigma", "mu", "x", "z"), map(float, here), strict=True)), "offset": str(offset),
            "motion": motion, **{name: None if v is None else float(v) for name, v in numbers.items()}}


def _motion(first, sigma):
    if first.kind == "force_zero":
        return "goes on"
    load = number("x", first.x) + number("y", first.y)
    return "decelerates" if sigma * load > -2 else "stops at once"


@lru_cache(maxsize=2)
def _escape_terms(above):
    found = divide(painleve_klein.system())
    time = found.escape_above if above else found.escape_below
    return lower((*_HERE, OFFSET, painleve_klein.sigma0), [time.truncated(1).expr, time.power(2).expr], "mpmath")


@lru_cache(maxsize=1)
def _delayed():
    return lower((*_HERE[:3], DEPTH), divide(painleve_klein.system()).delay.expr, "mpmath")


def divide(system: System) -> Divide:
    """Derive the ``Divide`` along the slow line of ``slip_opposite`` in z > 0; raises the errors of ``jump_map``."""
    z = linear(system).states[2]
    above, below = (jump_map(system, 1, {z: 1, OFFSET: sp.Rational(k, 10)}, near=_MODE) for k in (1, -1))
    return Divide(separatrix(system, 1), above, below, _delay(system))


def separatrix(system: System, order: int) -> Series:
    """Return the load on the slow line of ``slip_opposite`` as a series whose coefficients depend on x."""
    exact, numbers, x = _exactly(system)
    y = on_slow_line(numbers.fields[_MODE], x, order)
    return (numbers.load[0] + numbers.load[1] * x + numbers.load[2] * y).map(exact.expr, system.small)


def _delay(system):
    # the load vanishes where delta e^(fast T) = -(load at rest + slow part e^(slow T))/(fast part per offset)
    exact, numbers, x = _exactly(system)
    field, (l0, lx, ly) = numbers.fields[_MODE], numbers.load
    slow, fast = slow_and_fast_rate(field, 2)
    up, down, (at_x, at_y) = slope_of(field, fast), slope_of(field, slow), rest_of(field)
    parts = (slow, fast, series(l0 + lx * at_x + ly * at_y), (lx + ly * down) * (x - at_x),
             ly * (up - down) / (lx + ly * up))
    slow, fast, rest, part, share = (part.map(exact.expr) for part in parts)

    def step(time):
        grown = -(rest + part * (slow * time).exp(sp.exp)) * share
        return (grown.log(sp.log) + series({(-1, 0): DEPTH})) / fast

    return balance(step, series(DEPTH / (fast * MU).leading), 1).map(sp.cancel).map(sp.expand_log, system.small)


def _exactly(system):
    model = linear(system)
    exact = Ratios((*model.parameters, model.states[0]))
    return exact, model.map(exact), exact(model.states[0])
