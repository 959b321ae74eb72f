r"""Fast layers of a linear system with dry friction, as series in mu and L = log(1/mu).

In a mode x' = f, mu y' = g, z' = h, affine in x and y, the motion from a start is

    x = x* + A e^(slow t) + B e^(fast t),    y likewise,    z = c + drift t + ... ,

with fast = O(1/mu), slow = O(1). A layer ends where an affine function of (x, y, z) vanishes. With E = e^(fast t) for
unknown, so t = log(E)/fast = O(mu L), that is

    const + rate t + ks e^(slow t) + kf E = 0,

and the last term balances the others: E = -(const + ...)/kf, a contraction by mu, solved by ``series.balance``.
The same text serves coefficients that are symbols, numbers, or arrays of numbers.
"""

from dataclasses import dataclass
from typing import NamedTuple

from asympk.series import Series, balance, series

MU = series({(1, 0): 1})


class Field(NamedTuple):
    """A mode ``x' = f, mu y' = g, z' = h``; each is (constant, coefficient of x, of y)."""

    f: tuple
    g: tuple
    h: tuple


class Step(NamedTuple):
    """A mode, the event that ends it, and the name of the level that is reached there; or no event."""

    mode: str
    event: str | None = None
    level: str | None = None


class Turn(NamedTuple):
    """An event of a layer: its time and state as series, and E there, the growth of the fast part since the last."""

    kind: str
    t: Series
    x: Series
    y: Series
    z: Series
    growth: Series


@dataclass(frozen=True)
class Segment:
    """One mode from the time ``began`` on: each state is (constant, rate, slow part, fast part) in local time."""

    mode: str
    began: Series
    slow: Series
    fast: Series
    x: tuple
    y: tuple
    z: tuple

    def along(self, level):
        """Return const, rate, ks, kf of an affine function of the state."""
        constant, *weights = level
        parts = [sum(w * s[i] for w, s in zip(weights, (self.x, self.y, self.z), strict=True)) for i in range(4)]
        return parts[0] + constant, *parts[1:]


@dataclass(frozen=True)
class Layers:
    """The segments and events of a jump, and the (x, z) at t = 0 of the slow motion that it ends on."""

    segments: tuple[Segment, ...]
    turns: tuple[Turn, ...]
    x: Series
    z: Series


def follow(model, steps, start, order, log):
    """Follow ``steps`` from ``start`` = (x, y, z) to relative order ``order``; ``log`` is that of a coefficient.

    ``model`` gives the ``fields`` by mode and the ``levels`` by name.
    """
    began, state, segments, turns = series(0), tuple(map(series, start)), [], []
    for mode, event, level in steps:
        segments.append(_segment(mode, model.fields[mode], state, began, order))
        if event:
            turns.append(_turn(segments[-1], event, model.levels[level], order, log))
            began, state = turns[-1].t, turns[-1][2:5]
    return Layers(tuple(segments), tuple(turns), *_landing(segments[-1], order))


def on_slow_line(field, x, order):
    """Return y on the slow line of a mode at ``x``."""
    slow, _ = _rates(field, order)
    at_x, at_y = _rest(field)
    return (at_y + _slope(field, slow) * (x - at_x)).cut(order)


def _segment(mode, field, state, began, order):
    slow, fast = _rates(field, order)
    at_x, at_y = _rest(field)
    x, y, z = state
    up, down = _slope(field, fast), _slope(field, slow)
    b = _relative((y - at_y - down * (x - at_x)) / (up - down), order)
    a = (x - at_x - b).cut(order)
    _, hx, hy = field.h
    zs, zf = (hx + hy * down) / slow * a, (hx + hy * up) / fast * b
    drift = series(field.h[0] + hx * at_x + hy * at_y)
    return Segment(
        mode, began, slow, fast,
        x=(series(at_x), series(0), a, b),
        y=(series(at_y), series(0), (down * a).cut(order), _relative(up * b, order)),
        z=((z - zs - zf).cut(order), drift, zs.cut(order), _relative(zf, order)),
    )


def _turn(segment, event, level, order, log):
    const, rate, ks, kf = segment.along(level)
    per = kf.inverse()

    def after(growth):
        return (growth.log(log) / segment.fast).cut(order + 1)

    def step(growth):
        t = after(growth)
        return -(const + rate * t + ks * (segment.slow * t).exp()) * per

    first = -(const + ks) * per
    growth = balance(step, series({first.size: first.leading}), order)
    t = after(growth)
    weights = (series(1), t, (segment.slow * t).exp(), growth)
    x, y, z = (sum(w * part for w, part in zip(weights, s, strict=True)) for s in (segment.x, segment.y, segment.z))
    x, y, z = _pinned(level, x.cut(order), y, z)
    return Turn(event, segment.began + t, x, y.cut(order + min(0, y.size[0])), z, growth)


def _pinned(level, x, y, z):
    constant, in_x, in_y, in_z = level
    if in_z:
        return x, y, series(0)
    return x, -(constant + in_x * x) / in_y, z


def _landing(segment, order):
    past = -segment.began
    decay = (segment.slow * past).exp()
    x, z = (s[0] + s[1] * past + s[2] * decay for s in (segment.x, segment.z))
    return x.cut(order), z.cut(order)


def _rates(field, order):
    """Solve mu k^2 - (mu f_x + g_y) k + f_x g_y - f_y g_x = 0 for its slow and its fast root."""
    (_, fx, fy), (_, gx, gy) = field.f, field.g
    det = fx * gy - fy * gx
    slow = balance(lambda k: (det + MU * k * (k - fx)) / gy, series(det / gy), order)
    fast = balance(lambda m: gy + MU * (fx - det / m), series(gy), order)
    return slow, fast / MU


def _rest(field):
    (f0, fx, fy), (g0, gx, gy) = field.f, field.g
    det = fx * gy - fy * gx
    return (fy * g0 - gy * f0) / det, (gx * f0 - fx * g0) / det


def _slope(field, rate):
    return (rate - field.f[1]) / field.f[2]


def _relative(w, order):
    return w.cut(w.size[0] + order) if w.terms else w
