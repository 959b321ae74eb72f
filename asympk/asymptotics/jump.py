"""The jump map: where the fast layers carry a start, as series in mu and L = log(1/mu).

The motion from a start (x, y, z) off the slow manifolds passes through a few modes within a time O(mu L) and lands on a
slow manifold. Extended back to t = 0, the slow motion there has the (x, z) that the map gives: it is as if the start
jumped at once. One combination of the states changes slowly in every mode and fixes the limit (Lemma 3),

    I = z - mu y - x,    I' = x      (Painlevé-Klein):

as mu -> 0 it does not change over the layer, and mu y returns to 0, so that z -> 0 implies x -> x - z. ``jump_map``
takes a sample point, finds the ``itinerary`` from it, expands the ``layers``, and collects in the domain of the map the
signs on which the itinerary depends.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import sympy as sp

from asympk.asymptotics.base import base_point
from asympk.asymptotics.itinerary import itinerary, require_no_return
from asympk.asymptotics.layers import LayerEvent, expand_layers, on_slow_line
from asympk.asymptotics.linear import Linear, linear
from asympk.asymptotics.ratio import Ratios
from asympk.asymptotics.series import Series
from asympk.errors import InputError, NotDerivable
from asympk.formulas import formula_in_words
from asympk.numbers import known_order
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic.conditions import assumed_range, points_in, reduce_under
from asympk.symbolic.placing import require_opposing
from asympk.symbolic.signs import follows
from asympk.symbolic.system import System, of_system
from asympk.symbolic.truth import require_relations
from asympk.symbolic.values import as_exact, by_symbol

HIGHEST_ORDER = 3
LOAD, OFFSET = sp.Dummy("s", real=True), sp.Symbol("delta", real=True)
SAMPLES = tuple(map(sp.Rational, ("1", "-1/2", "-6/5", "-17/10", "2", "1/2")))  # values tried for missing parameters


@dataclass(frozen=True, repr=False)
class JumpMap(ShownAsFormulas):
    """The slow motion that a layer lands on, ``(x, z)`` at t = 0, as series whose coefficients are expressions.

    The map holds for all starts and parameters that satisfy ``domain``, as mu -> 0. ``sample`` is the point of this
    region that decided the itinerary, and ``chosen`` names those of its values that ``start`` did not give.
    ``events`` are the states at the events within the layer, and ``lands_on`` is the load where the layer ends, in the
    limit. ``order`` counts powers of mu, each with all powers of L: x, z and mu y are known to mu^order, times to
    mu^(order + 1).
    """

    x: Series
    z: Series
    events: tuple[LayerEvent, ...] = field(repr=False)
    itinerary: tuple[str, ...]
    domain: sp.Basic
    order: int
    lands_on: sp.Expr
    sample: sp.Dict = field(repr=False)
    chosen: tuple[str, ...] = ()

    @property
    def region(self) -> str:
        """The region in words: the domain, the values chosen for the sample, and how to choose others."""
        if not self.chosen:
            return f"for {formula_in_words(self.domain)}"
        values = {symbol.name: value for symbol, value in self.sample.items()}
        shown = ", ".join(f"{name} = {values[name]}" for name in self.chosen)
        return f"for {formula_in_words(self.domain)}\n(chosen: {shown}; another region by start={{name: value}})"

    def __str__(self) -> str:
        return "\n".join([self.region, f"x -> {self.x}", f"z -> {self.z}", f"by {' -> '.join(self.itinerary)}"])

    def __repr__(self) -> str:
        limits = f"x -> {self.x.coefficient(0)}, z -> {self.z.coefficient(0)}"
        known = f"as {self.x.small or 'mu'} -> 0, {limits}; known to order {self.order}"
        return f"JumpMap {self.region}\nby {' -> '.join(self.itinerary)}\n{known}"

    @property
    def t_hit(self) -> Series:
        """The time at which the layer meets the switching plane."""
        return self._event("velocity_zero").t

    @property
    def t_leave(self) -> Series:
        """The time at which stick ends."""
        return self._event("slip_onset").t

    def _card(self):
        rows = (("x", self.x), ("z", self.z), ("for", self.domain), ("lands on load", self.lands_on))
        return Card(f"Jump map to order {self.order}: {' -> '.join(self.itinerary)}", rows)

    def _event(self, kind):
        for event in self.events:
            if event.kind == kind:
                return event
        raise NotDerivable(f"the layer {' -> '.join(self.itinerary)} has no {kind}")


@dataclass(frozen=True)
class Integral:
    """A linear combination of the states that changes slowly in every mode: ``expr' = rate``, without fast states."""

    expr: sp.Expr
    rate: sp.Expr


def first_integral(system: System) -> Integral:
    """Find ``z + mu beta y + gamma x`` whose rate is free of y and the same in all modes, or raise ``NotDerivable``."""
    model = linear(system)
    x, y, z = model.states
    beta, gamma = sp.symbols("beta gamma", cls=sp.Dummy)
    rates = [[h + beta * g + gamma * f for f, g, h in zip(*m, strict=True)] for m in model.fields.values()]
    equations = [r[2] for r in rates] + [r[i] - rates[0][i] for r in rates[1:] for i in (0, 1)]
    found = sp.solve(equations, [beta, gamma], dict=True)
    if len(found) != 1:
        raise NotDerivable("no linear combination of the states is free of the fast motion in every mode")
    (solution,) = found
    rate = sum(c.subs(solution) * v for c, v in zip(rates[0], (1, x, 0), strict=True))
    return Integral(z + system.small * solution[beta] * y + solution[gamma] * x, sp.cancel(rate))


@of_system
def jump_map(
    system: System, order: int = 1, start: Mapping | None = None, arrival: str | None = None, near: str | None = None
) -> Any:
    """Derive the jump map of the layer that contains ``start``, to ``order`` in mu with all powers of L.

    ``start`` maps states and parameters, by symbol or name, to the numbers of a sample point inside the layer. Missing
    values are chosen (velocity -1, load 1/5), and the first lines of the printed result name the region of the sample.
    With ``arrival`` the layer begins where the slow motion in that mode reaches z = 0, and the map depends on x alone.
    With ``near`` the load at the start is that of the slow line of that mode plus ``OFFSET``, and the map holds for any
    small offset. Without friction it is ``base_point(system, order)``. Raises ``OrderError``, ``InputError`` for a
    start that is no mapping to numbers, violates the assumptions, or has negative kinetic friction or less static
    friction, ``OutOfRange`` for a sample on the boundary between two itineraries, and ``NotDerivable``.

    >>> from asympk.systems import painleve_klein
    >>> jump = jump_map(painleve_klein.system(), order=0)
    >>> print(jump.x, "for", jump.domain)
    (x - z) + O(mu L) for (sigma > 0) & (z < 0) & (x + y > 0)
    """
    if not system.frictions:
        return base_point(system, order)
    order = known_order(order, HIGHEST_ORDER, "solve(scene, method='jump', order=n) takes higher orders in numbers; "
                        "in symbols the jump map is derived to orders")
    model = linear(system)
    for mode in (mode for mode in (arrival, near) if mode is not None):
        system.mode(mode)
    if near and OFFSET.name in map(str, (*model.states, *model.parameters)):
        raise InputError(f"near: the system has a {OFFSET} already, as the offset is called; give it another name")
    given = _given(model, {} if start is None else start)
    values = _sample(system, model, given, arrival)
    velocity = model.states[2] if values[model.states[2]] != 0 else sp.S.Zero
    begins = Beginning(arrival, near, velocity)
    signs = _Signs({**values, LOAD: _load(model).subs(values)})
    steps = itinerary(model.line, begins.load(model), velocity, signs)
    require_no_return(model.line, steps, velocity, signs)
    x, z, events = _expansion(system, steps, order, begins)
    domain = _domain((*signs.asked, *_opposing(system, model)), system.assumptions).subs(LOAD, _load(model))
    rest = sp.cancel(model.line.rest(steps[-1].mode))
    places = sp.Dict({v: values[v] for v in (*model.parameters, *model.states)})
    chosen = tuple(v.name for v in places if v not in given and domain.has(v))
    return JumpMap(x, z, events, tuple(s.mode for s in steps), domain, order, rest, places, chosen)


class Beginning(NamedTuple):
    """How a layer begins: on the slow line of ``arrival``, near that of ``near``, or at any load; velocity z or 0."""

    arrival: str | None
    near: str | None
    velocity: sp.Expr

    def load(self, model: Linear) -> sp.Expr:
        """Return the load in the limit mu -> 0."""
        if self.near:
            return model.line.rest(self.near) + OFFSET
        return model.line.rest(self.arrival) if self.arrival else LOAD

    def fast(self, numbers: Linear, x: Any, exact: Ratios, order: int) -> Any:
        """Return the fast state to ``order``."""
        on = self.near or self.arrival
        if not on:
            return numbers.fast_state(x, exact(LOAD))
        return on_slow_line(numbers.fields[on], x, order) + (exact(OFFSET) / numbers.load[2] if self.near else 0)


@lru_cache(maxsize=64)
def _expansion(system, steps, order, begins):
    """Return x and z after the layer, and its events, in symbols; they depend on the itinerary alone."""
    model = linear(system)
    x, _, z = model.states
    names = (*model.parameters, x, LOAD, z, OFFSET)
    shown = [_load(model) if v == LOAD else v for v in names]
    exact = Ratios(names, len(steps), shown, len(model.parameters))
    numbers = model.map(exact)
    start = (exact(x), begins.fast(numbers, exact(x), exact, order), exact(begins.velocity))
    layers = expand_layers(numbers, steps, start, order, exact.log)

    def out(series):
        return series.map(exact.expr, system.small)

    events = tuple(LayerEvent(t.kind, *map(out, t[1:])) for t in layers.turns)
    return out(layers.x.truncated(order)), out(layers.z.truncated(order)), events


def _opposing(system, model):
    """Return the relations under which friction opposes the velocity and static friction is not below it."""
    kinetic = sp.sympify(system.friction.kinetic, strict=True)
    return sp.Ge(kinetic, 0), sp.Ge(model.static, kinetic)


def _load(model):
    return sum(c * v for c, v in zip(model.load, (1, *model.states[:2]), strict=True))


def _given(model, start):
    """Return the start as {symbol: Rational}; it may contain ``OFFSET``."""
    values = by_symbol(start, (*model.states, *model.parameters, OFFSET), "start", "state or parameter")
    return {s: as_exact(str(v) if isinstance(v, float | sp.Float) else v, s) for s, v in values.items()}


def _sample(system, model, start, arrival):
    x, y, z = model.states
    known = dict(start)
    require_relations(system.assumptions, start)
    known.setdefault(OFFSET, sp.Rational(1, 10))
    for p in model.parameters:
        if p not in known:
            inside = points_in(assumed_range(p, system.assumptions))
            candidates = [*(known[q] for q in model.parameters if q in known), *SAMPLES, *inside]
            allowed = sp.And.make_args(system.assumptions)
            fitting = (c for c in candidates if all(a.subs({**known, p: c}) != sp.false for a in allowed))
            known[p] = next(fitting, None)
            if known[p] is None:
                raise InputError(f"no value of {p} was found that the assumptions allow; give one, start={{'{p}': ..}}")
    known.setdefault(x, sp.S.Zero)
    known.setdefault(z, sp.S.Zero if arrival else -sp.S.One)
    wanted = model.line.rest(arrival).subs(known) if arrival else sp.Rational(1, 5)
    known.setdefault(y, model.fast_state(x, wanted).subs(known))
    require_opposing(system, {**known, z: sp.S.Zero})
    return known


@lru_cache(maxsize=256)
def _domain(asked, assumptions):
    """Return the conjunction of the relations ``asked``, without those that follow from the others."""
    kept = list(sp.And.make_args(reduce_under(sp.And(*asked), assumptions)))
    for relation in sorted(kept, key=lambda r: (-r.count_ops(), str(r))):
        others = [r for r in kept if r != relation]
        if follows(relation, (*others, *sp.And.make_args(assumptions))):
            kept = others
    return sp.And(*kept)


class _Signs:
    """The sign of an expression at the sample; ``asked`` collects the relations that fix these signs."""

    def __init__(self, values):
        self.values, self.asked = values, []

    def __call__(self, expr):
        expr = sp.sympify(expr, strict=True)
        sign = int(sp.sign(expr.subs(self.values)))
        if expr.free_symbols:
            self.asked.append(sp.Eq(expr, 0) if sign == 0 else sp.expand(sign * expr) > 0)
        return sign
