"""Fast layers of a linear system with dry friction, as series in mu and L = log(1/mu).

In a mode x' = f, mu y' = g, z' = h, affine in x and y, the motion from a start is

    x = x* + A e^(slow t) + B e^(fast t),    y likewise,    z = c + rate t + ... ,

with fast = O(1/mu), slow = O(1). Where slow = 0 there is no equilibrium x*, and x and y have constant rates, too. A
mode ends where an affine function of (x, y, z) vanishes: in E = e^(fast t), with t = log(E)/fast = O(mu L), where

    c + rate t + ks e^(slow t) + kf E = 0,    or    E = -(c + rate t + ks e^(slow t))/kf,

whose right side contracts by mu, so that ``balance`` iterates it. ``_turn``, the hard function, does this;
``expand_layers`` follows an itinerary. Coefficients are symbols, numbers, or arrays of numbers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from asympk.asymptotics.series import Series, balance, series

MU = series({(1, 0): 1})


class LinearField(NamedTuple):
    """A mode ``x' = f, mu y' = g, z' = h``; each is (constant, coefficient of x, of y)."""

    f: tuple
    g: tuple
    h: tuple


class ItineraryStep(NamedTuple):
    """A mode, the sign of the velocity, the event that ends the mode, if any, and the level that vanishes there."""

    mode: str
    side: int
    event: str | None = None
    level: str | None = None


class LayerEvent(NamedTuple):
    """An event of a layer: its time and state as series, and ``growth``, the value of E at the end of the mode."""

    kind: str
    t: Series
    x: Series
    y: Series
    z: Series
    growth: Series


class LayerSegment(NamedTuple):
    """One mode from the time ``began`` on; each state is (start, rate, slow part, fast part, centre) in local time t.

    Rates, parts and centres are series, or numbers. The state is
    ``centre + rate t + slow part e^(slow t) + fast part e^(fast t)``, which equals
    ``start + rate t + slow part (e^(slow t) - 1) + fast part (e^(fast t) - 1)``.
    """

    mode: str
    began: Any
    slow: Any
    fast: Any
    x: tuple
    y: tuple
    z: tuple

    def coefficients_of(self, level: tuple) -> tuple:
        """Return the rate, the slow part, the fast part and the centre of an affine function of the state."""
        constant, *weights = level
        parts = [sum(w * s[i] for w, s in zip(weights, (self.x, self.y, self.z), strict=True)) for i in range(1, 5)]
        return *parts[:3], parts[3] + constant


@dataclass(frozen=True)
class LayerSeries:
    """The segments and events of a jump, and the (x, z) at t = 0 of the slow motion that it lands on."""

    segments: tuple[LayerSegment, ...]
    turns: tuple[LayerEvent, ...]
    x: Series
    z: Series


def expand_layers(model: Any, steps: tuple[ItineraryStep, ...], start: tuple, order: int, log: Callable) -> LayerSeries:
    """Follow ``steps`` from ``start`` = (x, y, z) to relative order ``order``; ``log`` takes a coefficient's logarithm.

    ``model.fields`` gives the ``LinearField`` of each mode, ``model.levels`` the affine function of each level.
    """
    began, state, segments, turns = series(0), tuple(map(series, start)), [], []
    for mode, _, event, level in steps:
        segments.append(_segment(mode, model.fields[mode], state, began, order))
        if event:
            turns.append(_turn(segments[-1], event, model.levels[level], order, log))
            began, state = turns[-1].t, turns[-1][2:5]
    past = -began
    fade = (segments[-1].slow * past).exp()
    x, z = ((c + r * past + a * fade).cut(order) for _, r, a, _, c in (segments[-1].x, segments[-1].z))
    return LayerSeries(tuple(segments), tuple(turns), x, z)


def on_slow_line(field: LinearField, x: Any, order: int) -> Series:
    """Return y on the slow line of a mode at ``x``."""
    slow, fast = slow_and_fast_rate(field, order)
    at_x, at_y, _ = _centre(field, slow, fast, x, 0)
    return (at_y + slope_of(field, slow) * (x - at_x)).cut(order)


def slow_motion(field: LinearField, layers: LayerSeries, order: int) -> LayerSegment:
    """Return the slow motion on which the layers land, extended back to t = 0, as a segment."""
    mode, x = layers.segments[-1].mode, layers.x
    return _segment(mode, field, (x, on_slow_line(field, x, order), layers.z), series(0), order, series(0))


def _segment(mode, field, state, began, order, b=None):
    slow, fast = slow_and_fast_rate(field, order)
    x, y, z = state
    at_x, at_y, rate = _centre(field, slow, fast, x, y)
    up, down = slope_of(field, fast), slope_of(field, slow)
    if b is None:
        b = _relative((y - at_y - down * (x - at_x)) / (up - down), order)
    a = (x - at_x - b).cut(order)
    h0, hx, hy = field.h
    za = (hx + hy * down) / slow * a if slow.terms else slow  # h changes with g alone: not on a slow line with rate 0
    zb = _relative((hx + hy * up) / fast * b, order)
    return LayerSegment(
        mode, began, slow, fast,
        x=(x, rate, a, b, at_x),
        y=(y, down * rate, (down * a).cut(order), _relative(up * b, order), at_y),
        z=(z, h0 + hx * at_x + hy * at_y, za.cut(order), zb, (z - za - zb).cut(order)),
    )


def _turn(segment, event, level, order, log):
    rate, ks, kf, centre = segment.coefficients_of(level)
    per = kf.inverse()

    def after(growth):
        return (growth.log(log) / segment.fast).cut(order + 1)

    def step(growth):
        t = after(growth)
        return -(centre + rate * t + ks * (segment.slow * t).exp()) * per

    first = -(centre + ks) * per
    growth = balance(step, series({first.size: first.leading}), order)
    t = after(growth)
    fade = (segment.slow * t).exp()
    x, y, z = (c + r * t + a * fade + b * growth for _, r, a, b, c in (segment.x, segment.y, segment.z))
    x, (constant, in_x, in_y, in_z) = x.cut(order), level  # which vanishes
    y, z = (y, series(0)) if in_z else (-(constant + in_x * x) / in_y, z)
    return LayerEvent(event, segment.began + t, x, y.cut(min([0, *(p for p, _ in y.terms)]) + order), z, growth)


def slow_and_fast_rate(field: LinearField, order: int) -> tuple[Series, Series]:
    """Return the slow and the fast root k of mu k^2 - (mu f_x + g_y) k + f_x g_y - f_y g_x = 0."""
    (_, fx, fy), (_, gx, gy) = field.f, field.g
    det = fx * gy - fy * gx
    slow = series(det / gy)
    if slow.terms:  # otherwise it is 0
        slow = balance(lambda k: (det + MU * k * (k - fx)) / gy, slow, order)
    fast = balance(lambda m: gy + MU * (fx - det / m), series(gy), order)
    return slow, fast / MU


def _centre(field, slow, fast, x, y):
    """Return a point of the slow line, and the rate of x there: the equilibrium, or where the fast motion leads to."""
    if slow.terms:
        return *map(series, rest_of(field)), series(0)
    (f0, fx, fy), (g0, _, gy) = field.f, field.g
    rate = (gy * f0 - fy * g0) / (MU * fast)
    at_x = x - (f0 + fx * x + fy * y - rate) / fast
    return at_x, (rate - f0 - fx * at_x) / fy, rate


def rest_of(field: LinearField) -> tuple[Any, Any]:
    """Return the equilibrium (x, y) of a mode."""
    (f0, fx, fy), (g0, gx, gy) = field.f, field.g
    det = fx * gy - fy * gx
    return (fy * g0 - gy * f0) / det, (gx * f0 - fx * g0) / det


def slope_of(field: LinearField, rate: Any) -> Any:
    """Return dy/dx along the eigenvector of ``rate``, the slow or the fast one."""
    return (rate - field.f[1]) / field.f[2]


def _relative(w, order):
    return w.cut(w.size[0] + order) if w.terms else w
