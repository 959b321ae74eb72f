r"""Stick and crossing regions of the switching plane v = 0, by solving the inequalities of the friction cone.

With v' = d + c F a motion on v = 0 may stick while the force it needs is within static friction, |d| <= hold with
hold = static |c| |s|, where d is the drive, c the coupling and s the load; where |d| > hold it crosses in the direction
of d. Where |d| > slip = kinetic |c| |s| as well, the fields on both sides of v = 0 point the same way; between the two
cones sticking and crossing are both consistent.

Where d = d_0 + d_1 s depends on the load alone, a cone changes along the line of loads only at the zeros of d -+ hold.
Their order is fixed by the signs of d_0 and of static |c| -+ d_1, so one exact sample decides each cell of the
parameters on which these signs are fixed; ``_cells`` is the function that does it. Where d depends on the states in
another way, the regions are the inequalities themselves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import chain, groupby, pairwise, product, zip_longest

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic.conditions import closed
from asympk.symbolic.regions import Cell, Plane, Region, Span
from asympk.symbolic.signs import conjunction, known_sign, nonzero
from asympk.symbolic.system import System

CONVENTION = (
    "at rest stays at rest: wherever static friction can hold (v = 0 and |d| <= static |s|) the motion sticks, on "
    "arrival too, although kinetic friction alone would let it cross"
)
_RULES: dict[str, Callable] = {
    "stick": lambda drive, slip, hold: abs(drive) <= hold,
    "up": lambda drive, slip, hold: drive > hold,
    "down": lambda drive, slip, hold: drive < -hold,
    "ambiguous": lambda drive, slip, hold: sp.And(abs(drive) <= hold, abs(drive) > slip),
}


@dataclass(frozen=True, repr=False)
class StickRegions(ShownAsFormulas):
    """The parts of the plane v = 0: ``stick``, ``up`` and ``down`` cover it; ``ambiguous`` is part of ``stick``.

    ``ambiguous`` is where sticking and crossing are both consistent, between the kinetic and the static cone;
    ``convention`` says what is then done. ``edges`` are the loads at which stick can end, Gamma_1 then Gamma_2; there
    are none where the drive is not linear in the load alone.
    """

    stick: Region
    up: Region
    down: Region
    ambiguous: Region
    edges: tuple[sp.Expr, ...]
    convention: str = CONVENTION

    def _card(self) -> Card:
        regions = (self.stick, self.up, self.down, self.ambiguous)
        rows = [(region.name, region) for region in regions]
        edges = [(f"edge {k}", edge) for k, edge in enumerate(self.edges, start=1)]
        return Card(f"Stick regions of the switching plane, load {self.stick.plane.load}", (*rows, *edges))


@dataclass(frozen=True)
class Cone:
    """The friction cone on v = 0: ``drive`` and ``load``, and by how much of the load friction slips and holds.

    Where they depend on the load alone, ``load`` is the symbol s and the others are given in it.
    """

    drive: sp.Expr
    load: sp.Expr
    slip: sp.Expr
    hold: sp.Expr

    def subs(self, given: dict) -> "Cone":
        """Put expressions for symbols into all parts."""
        return Cone(*(e.subs(given, simultaneous=True) for e in (self.drive, self.load, self.slip, self.hold)))

    def rule(self, name: str) -> sp.Basic:
        """Return the inequalities of a region."""
        return _RULES[name](self.drive, self.slip * abs(self.load), self.hold * abs(self.load))


@cache
def stick_regions(system: System) -> StickRegions:
    """Solve the friction cone of ``system`` for every range of its parameters.

    Where the drive is linear in the load s alone the regions are unions of intervals of s; elsewhere they are
    conditions on the states. Raises ``NotDerivable`` unless the system has one friction, ``InputError`` where static
    friction is below the kinetic one for all parameters allowed.
    """
    cone = friction_cone(system)
    moving = {*system.states, system.time}
    reduced = _in_load(cone, moving)
    plane = _plane(system, cone, reduced, moving)
    facts = closed(plane.allowed)
    linear = reduced and _linear(reduced)
    shown = reduced or cone
    stick, up, down, ambiguous = (
        Region(name, shown.rule(name), plane, _cells(name, reduced, facts) if linear else ()) for name in _RULES
    )
    return StickRegions(stick, up, down, ambiguous, edges=_zeros(reduced, reduced.hold) if linear else ())


def friction_cone(system: System) -> Cone:
    """Return the cone of the system's friction on v = 0; raises as ``stick_regions`` does."""
    friction = system.friction
    if friction is None:
        count = len(system.frictions)
        raise NotDerivable(
            f"this system has {count} frictions, whose cones depend on one another: regions are those of one friction"
            if count else "this system has no friction: build it with System.with_friction to ask for stick regions"
        )  # fmt: skip
    slip, hold = (bound * abs(system.coupling) for bound in (friction.kinetic, friction.static))
    cone = Cone(system.drive, friction.load, slip, hold).subs(_at_rest(system))
    _require_order(cone, system.assumptions)
    return cone


def drive_of_load(system: System) -> tuple[sp.Symbol, sp.Expr]:
    """Return the load as one symbol s and the drive d(s); raises ``NotDerivable`` where d is not linear in s alone."""
    cone = friction_cone(system)
    reduced = _in_load(cone, {*system.states, system.time})
    if reduced is None or not _linear(reduced):
        raise NotDerivable(f"the drive {cone.drive} is not linear in the load {cone.load} alone")
    return reduced.load, reduced.drive


def _at_rest(system):
    """Return {state: its value on v = 0} for one state of the velocity."""
    velocity = system.friction.velocity
    state = next(s for s in reversed(system.states) if velocity.has(s))
    return {state: sp.solve(velocity, state)[0]}


def _require_order(cone, assumptions):
    """Refuse bounds that no friction has, where that follows from what is assumed."""
    for excess, words in ((-cone.slip, "kinetic friction is negative"),
                          (cone.slip - cone.hold, "static friction is below the kinetic one")):  # fmt: skip
        if known_sign(excess, assumptions) > 0 and nonzero(excess, assumptions) == sp.true:
            raise InputError(f"{words}: {excess} > 0 for all parameters allowed; give static >= kinetic >= 0")


def _in_load(cone, moving):
    """Return the cone in terms of the load's symbol s, or None where it depends on the states in another way."""
    load = sp.Symbol("s", real=True)
    states = sorted(cone.load.free_symbols & moving, key=str)
    state = next((s for s in states if cone.load.is_polynomial(s) and sp.degree(cone.load, s) == 1), None)
    if state is None:
        return None
    (solution,) = sp.solve(cone.load - load, state)
    reduced = cone.subs({state: solution})
    reduced = Cone(sp.expand(reduced.drive), load, reduced.slip, reduced.hold)
    if {load} != (reduced.drive.free_symbols | {load}) & (moving | {load}):
        reduced = Cone(sp.cancel(reduced.drive), load, sp.cancel(reduced.slip), sp.cancel(reduced.hold))
    used = reduced.drive.free_symbols | reduced.slip.free_symbols | reduced.hold.free_symbols
    return None if used & moving else reduced


def _linear(reduced):
    """Tell whether the drive is linear in the load and the bounds are free of it."""
    s = reduced.load
    bounds = reduced.slip + reduced.hold
    return reduced.drive.is_polynomial(s) and sp.degree(reduced.drive, s) <= 1 and not bounds.has(s)


def _plane(system, cone, reduced, moving):
    friction = system.friction
    kinetic, static = (bound.subs(_at_rest(system)) for bound in (friction.kinetic, friction.static))
    pairs = ((static, kinetic), (kinetic, sp.S.Zero))
    ordered = [sp.Ge(a, b) for a, b in pairs if not (a - b).free_symbols & moving]
    allowed = sp.And(system.assumptions, *(r for r in ordered if r.free_symbols))
    extra = friction.static.free_symbols - friction.kinetic.free_symbols - moving
    default = sp.solve(friction.static - friction.kinetic, *extra) if len(extra) == 1 else []
    states = tuple(s for s in (*system.states, system.time) if s is not None)
    symbol = reduced.load if reduced else None
    values = dict.fromkeys(extra, default[0]) if len(default) == 1 else {}
    return Plane(states, system.parameters, cone.load, symbol, allowed, sp.Dict(values))


def _zeros(cone, bound):
    """Return the loads at which the drive is ``bound s`` and ``-bound s``."""
    return tuple(chain.from_iterable(_zero(cone, sign * bound) for sign in (1, -1)))


def _zero(cone, slope):
    return sp.solve(cone.drive - slope * cone.load, cone.load)


def _cells(name, cone, facts):
    """Cut the parameters into cells and walk along the loads at one exact sample of each."""
    line = sp.Poly(cone.drive, cone.load)
    constant, slope = (line.coeff_monomial(m) for m in (1, cone.load))
    bounds = (cone.slip, cone.hold) if name == "ambiguous" else (cone.hold,)
    events = [constant, *(bound + sign * slope for bound in bounds for sign in (-1, 1))]
    edges = {(k, sign): _zero(cone, sign * bound) for k, bound in enumerate((cone.slip, cone.hold)) for sign in (1, -1)}
    cells = []
    for signs in product(*(_signs(event, facts) for event in events)):
        sample = _sample(signs, _signs(slope, facts))
        condition = conjunction(list(zip(events, signs, strict=True)), facts) if sample else sp.false
        if condition != sp.false:
            cells.append(Cell(condition, _spans(name, edges, sample)))
    return tuple(cells)


def _signs(expr, facts):
    """Return the signs that ``expr`` can have, in order."""
    if expr == 0:
        return (0,)
    sign = known_sign(expr, facts)
    if not sign:
        return (-1, 0, 1)
    return (sign,) if nonzero(expr, facts) == sp.true else tuple(sorted((sign, 0)))


_GRID = tuple(map(sp.Rational, ("1/2", "1", "2", "3", "4")))


@cache
def _sample(signs, slopes):
    """Return numbers (d_0, d_1, slip, hold) of these signs, hold above slip if they can be, or None."""
    constant, *rest = signs
    for slope in (2 * sp.Integer(sign) for sign in slopes):
        fitting = [[k for k in (*_GRID, sp.S.Zero) if (sp.sign(k - slope), sp.sign(k + slope)) == pair]
                   for pair in zip(rest[::2], rest[1::2], strict=True)]  # fmt: skip
        pairs = [(a, b) for a in fitting[0] for b in fitting[-1] if a <= b]
        if pairs:
            slip, hold = min(pairs, key=lambda pair: (pair[0] == pair[1] and len(fitting) > 1, pairs.index(pair)))
            return sp.sympify(constant, strict=True), slope, slip, hold
    return None


def _spans(name, edges, sample):
    """Walk along the line of loads, gap, zero, gap, ..., and join the steps on which the rule holds."""
    constant, slope, *bounds = sample
    places = {}
    for (k, sign), found in edges.items():
        if sign * bounds[k] != slope:
            places[constant / (sign * bounds[k] - slope)] = found[0] if constant else sp.S.Zero
    zeros = sorted(places)
    probes = [zeros[0] - 1, *((a + b) / 2 for a, b in pairwise(zeros)), zeros[-1] + 1] if zeros else [sp.S.Zero]
    walk = [step for step in chain.from_iterable(zip_longest(probes, zeros)) if step is not None]
    borders = [-sp.oo, *(places[zero] for zero in zeros), sp.oo]
    spans = []
    for holds, run in groupby(range(len(walk)), key=lambda k: _holds(name, sample, walk[k])):
        if holds:
            steps = [*run]
            spans.append(_span(steps[0], steps[-1], borders))
    return tuple(spans)


def _holds(name, sample, load):
    constant, slope, slip, hold = sample
    return _RULES[name](constant + slope * load, slip * abs(load), hold * abs(load)) == sp.true


def _span(first, last, borders):
    """Return the span from step ``first`` to step ``last`` of a walk; odd steps are the zeros themselves."""
    start, end = borders[(first + 1) // 2], borders[last // 2 + 1]
    return Span(start, end, first % 2 == 1, last % 2 == 1)
