r"""The layers of the Painlevé-Klein system in numbers: derived once per itinerary on a tape and compiled for any start.

``compiled_layers(steps, order, arrival)`` returns one function of (sigma, sigma0, mu, log(1/mu), x, s, z), for floats,
mpmath numbers and arrays. It returns the composite expansion to ``order``, ``order + 1`` and ``order + 2``; their
differences are the first omitted terms. In each segment, with t counted from where it begins,

    x = centre + rate t + slow part e^(slow t) + fast part e^(fast t),    y and z likewise,

holds uniformly, from the start of the segment to its end, where e^(fast t) may be O(1/mu).
"""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import sympy as sp

from asympk.asymptotics.layers import LayerSegment, expand_layers, on_slow_line, slow_motion
from asympk.asymptotics.linear import Linear, linear
from asympk.asymptotics.tape import Tape
from asympk.symbolic.lowering import lower
from asympk.systems import painleve_klein


class EventNumbers(NamedTuple):
    """An event in numbers; ``spread`` is the correction of order mu to the growth of the fast part, relative to it."""

    kind: str
    t: Any
    x: Any
    y: Any
    z: Any
    spread: Any


class LayerNumbers(NamedTuple):
    """The composite expansion of a layer to one order; ``landing`` is its slow motion, extended back to t = 0."""

    segments: tuple[LayerSegment, ...]
    turns: tuple[EventNumbers, ...]
    landing: LayerSegment


@lru_cache(maxsize=1)
def model() -> Linear:
    """Return the coefficients of the Painlevé-Klein system."""
    return linear(painleve_klein.system())


@lru_cache(maxsize=256)
def compiled_layers(steps: tuple, order: int, extra: int, arrival: str | None = None) -> Callable[..., tuple]:
    """Return ``f(sigma, sigma0, mu, large, x, s, z, log)``: the layers to ``order``, ..., ``order + extra``.

    With ``arrival`` the layer begins at z = 0 on the slow line of the mode of that name, and s and z are not used.
    ``large`` is log(1/mu).
    """
    tape = Tape("sigma", "sigma0", "mu", "large", "x", "s", "z", "log")
    sigma, sigma0, mu, large, x, s, z = map(tape.node, tape.inputs[:-1])
    numbers = model().map(lambda c: coefficient(c)(sigma, sigma0)[0])
    y = on_slow_line(numbers.fields[arrival], x, order + extra) if arrival else numbers.fast_state(x, s)
    layers = expand_layers(numbers, steps, (x, y, 0 if arrival else z), order + extra, partial(tape.call, "log"))
    slowly = slow_motion(numbers.fields[steps[-1].mode], layers, order + extra)
    return tape.function(
        tuple(_numbers(layers, slowly, k, lambda w: _value(w, mu, large)) for k in range(order, order + extra + 1))
    )


@lru_cache(maxsize=64)
def coefficient(expr: sp.Expr) -> Callable[..., tuple]:
    """Return a coefficient of the model as a compiled function of (sigma, sigma0)."""
    return lower(model().parameters, expr, "math").compiled


def _numbers(layers, slowly, order, value):
    def relative(w):
        return value(w.cut(w.size[0] + order)) if w.terms else 0

    def absolute(w):
        return value(w.cut(order + min(0, w.size[0]))) if w.terms else 0

    def segment(p):
        states = [(*map(absolute, s[:3]), relative(s[3]), absolute(s[4])) for s in (p.x, p.y, p.z)]
        return LayerSegment(p.mode, relative(p.began), relative(p.slow), relative(p.fast), *states)

    turns = [EventNumbers(t.kind, relative(t.t), *map(absolute, t[2:5]), _spread(t.growth, value))
             for t in layers.turns]
    return LayerNumbers(tuple(map(segment, layers.segments)), tuple(turns), segment(slowly))


def _spread(growth, value):
    p = growth.size[0]
    return value(growth.power(p + 1)) / value(growth.power(p))


def _value(w, mu, large):
    return sum((_power(mu, p) * c * _power(large, q) for (p, q), c in w.terms.items()), 0)


def _power(base, k):
    result = 1
    for _ in range(abs(k)):
        result = result * base if k > 0 else result / base
    return result
