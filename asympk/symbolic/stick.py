r"""Stick and crossing regions of the switching plane v = 0, by solving the inequalities of the friction cone.

With v' = d + c F a motion on v = 0 may stick while the force it needs is within static friction, |d| <= hold with
hold = static |c| |s|, where d is the drive, c the coupling and s the load; where |d| > hold it crosses in the direction
of d. Where |d| > slip = kinetic |c| |s| as well, the fields on both sides of v = 0 point the same way; between the two
cones sticking and crossing are both consistent. An open contact has no load, so slip = hold = 0 there.

Where d = d_0 + d_1 s is linear in the load, the answer changes along the line of loads only at the zeros of d -+ hold.
The signs of d_0 and of static |c| -+ d_1 fix the order of these zeros, so one exact sample decides each cell on which
the signs are fixed; ``_cells``, the hard function, returns the cells. d_0, d_1 and c may depend on the other states: in
an elastic mechanism d_0 = a_T, d_1 = G_NT, c = G_TT. For another d the regions are the inequalities themselves.

A ``Region`` of a ``Plane`` has a condition and its cells, each a union of spans of the load.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import chain, groupby, pairwise, product, zip_longest
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.formulas import NOT_FINITE, formula_in_words
from asympk.numbers import short
from asympk.shown import Card, ShownAsFormulas, latex_of
from asympk.symbolic.branches import is_pushed, rate_along, with_direction
from asympk.symbolic.conditions import assumed_range, with_implied_bounds
from asympk.symbolic.long import heavy
from asympk.symbolic.reading import unused_symbol
from asympk.symbolic.sides import on_side
from asympk.symbolic.signs import conjunction, known_sign, nonzero
from asympk.symbolic.system import System, of_system
from asympk.symbolic.truth import as_arrays, holds, require_relations, with_default
from asympk.symbolic.values import as_exact, by_symbol, in_words, is_exact

CONVENTION = (
    "at rest stays at rest: wherever static friction can hold (v = 0 and |d| <= static |s|) the motion sticks, on "
    "arrival too, although kinetic friction alone would let it cross"
)
_STANDING = (*sp.symbols("d_0 d_1", real=True, cls=sp.Dummy), *sp.symbols("slip hold", nonnegative=True, cls=sp.Dummy))
_RULES: dict[str, Callable] = {
    "stick": lambda drive, slip, hold: _size(drive) <= hold,
    "up": lambda drive, slip, hold: drive > hold,
    "down": lambda drive, slip, hold: drive < -hold,
    "ambiguous": lambda drive, slip, hold: sp.And(_size(drive) <= hold, _size(drive) > slip),
}


def _size(expr: sp.Expr) -> sp.Expr:
    """Return the absolute value of a real expression; to SymPy a quotient whose divisor may vanish is not real."""
    if expr.is_extended_real:
        return abs(expr)
    numerator, denominator = sp.fraction(sp.together(expr))
    return abs(numerator) / abs(denominator)


@dataclass(frozen=True)
class Span:
    """An interval of loads with symbolic ends."""

    start: sp.Expr
    end: sp.Expr
    closed_start: bool
    closed_end: bool

    def as_set(self) -> sp.Set:
        """Return the interval as a SymPy set."""
        return sp.Interval(self.start, self.end, not self.closed_start, not self.closed_end)

    @property
    def in_words(self) -> str:
        """The interval as text, such as ``[1/4, oo)``."""
        return f"{'[' if self.closed_start else '('}{self.start}, {self.end}{']' if self.closed_end else ')'}"


@dataclass(frozen=True)
class RegionCell:
    """One cell of the parameters: where ``condition`` holds, the region is the union of ``spans``."""

    condition: sp.Basic
    spans: tuple[Span, ...]

    def put(self, meaning: Mapping) -> "RegionCell":
        """Return the cell with expressions in place of symbols."""
        spans = (replace(s, start=s.start.xreplace(meaning), end=s.end.xreplace(meaning)) for s in self.spans)
        return RegionCell(self.condition.xreplace(meaning), tuple(spans))

    @cached_property
    def box(self) -> sp.Dict:
        """The range of every parameter that a relation of the condition restricts on its own."""
        parts = sp.And.make_args(self.condition)
        alone = {next(iter(p.free_symbols)) for p in parts if len(p.free_symbols) == 1}
        return sp.Dict({parameter: assumed_range(parameter, self.condition) for parameter in sorted(alone, key=str)})


@dataclass(frozen=True)
class Plane:
    """The plane on which the velocity vanishes, and the variables in which its regions are given.

    ``load`` is the load in the states. ``symbol`` stands for the load where the load replaces one of the states, and is
    None otherwise; ``alone`` says that the regions depend on no other state. ``allowed`` is the condition on the
    parameters. ``default`` maps a parameter of static friction to the value at which static equals kinetic friction.
    """

    states: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    load: sp.Expr
    symbol: sp.Symbol | None
    alone: bool
    allowed: sp.Basic
    default: sp.Dict

    def values(self, at: Any, values: Mapping | None, named: dict) -> dict:
        """Return place and parameters as {symbol: value as given}; raises ``InputError`` for an unknown name."""
        given = by_symbol({**(values or {}), **named}, self.parameters, "this system")
        if isinstance(at, Mapping | sp.Dict):
            return given | by_symbol(at, self.states, "this system", "state")
        if not self.alone:
            states = ", ".join(f"{s.name!r}: .." for s in self.states)
            raise InputError(f"{short(at)} is no place: the region depends on more than the load; give {{{states}}}")
        return given | {self.symbol: at}


@dataclass(frozen=True, repr=False)
class Region(ShownAsFormulas):
    """A part of the switching plane: where ``condition`` holds, a relation in load (or states) and parameters.

    Where the drive is linear in the load, ``cells`` give the condition as spans of the load, for each cell of the
    parameters and of the other states; otherwise ``cells`` is empty.
    """

    name: str
    condition: sp.Basic
    plane: Plane = field(repr=False)
    cells: tuple[RegionCell, ...] = field(default=(), repr=False)

    @property
    def load(self) -> sp.Symbol | None:
        """The symbol that stands for the load, or None where the load replaces no state."""
        return self.plane.symbol

    def contains(self, at: Any, values: Mapping | None = None, /, **named: Any) -> Any:
        """Tell whether a place on the plane is in the region: a load, or a mapping of the states; arrays broadcast.

        Parameters are given by name, or in a mapping by name or symbol. Parameters that the region does not depend on
        may be left out; without the parameter of static friction, static equals kinetic friction. Integers, fractions,
        decimals and strings ("1/4") are compared exactly, floats as doubles. Raises ``InputError`` for a value that is
        missing, not a number, or outside the assumptions.

        >>> import asympk as ap
        >>> stick = ap.stick_regions(ap.systems.painleve_klein.system()).stick
        >>> [stick.contains(s, sigma=1) for s in ("1/5", "1/4", 0, "-1/2")]
        [False, True, False, True]
        >>> stick.contains({"x": "1/8", "y": "1/8"}, sigma=1)
        True
        """
        given = self.plane.values(at, values, named)
        needed, default = self.condition.free_symbols, dict(self.plane.default)
        if self.load in needed - given.keys():
            needed = needed - {self.load} | self.plane.load.free_symbols
            default |= {self.load: self.plane.load}
        wanted = self.condition.free_symbols | self.plane.allowed.free_symbols & given.keys()
        if all(is_exact(value) for value in given.values()):
            numbers = {s: as_exact(v, s) for s, v in given.items()}
        else:
            numbers = as_arrays(given)
        known = with_default(numbers, wanted, default)
        require_relations(self.plane.allowed, known)
        if missing := needed - known.keys():
            raise InputError(f"{in_words(missing)} is missing; the region {self.name!r} depends on {in_words(needed)}")
        return holds(self.condition, known)

    def spans(self, values: Mapping | None = None, /, **named: Any) -> tuple[Span, ...]:
        """Return the spans, with symbolic ends, of the cell that holds the parameters, given as in ``contains``.

        Where the cells depend on further states, the values of these are given with the parameters. Raises
        ``NotDerivable`` where the region is no union of spans, ``InputError`` for a missing or forbidden value.
        """
        if not self.cells:
            raise NotDerivable(f"{self.name}: {formula_in_words(self.condition)} is no union of intervals of the load; "
                               "ask contains")
        symbols = self.plane.parameters if self.plane.alone else (*self.plane.parameters, *self.plane.states)
        given = by_symbol({**(values or {}), **named}, symbols, "this system")
        wanted = set().union(*(cell.condition.free_symbols for cell in self.cells))
        known = with_default({s: as_exact(v, s) for s, v in given.items()}, wanted, self.plane.default)
        require_relations(self.plane.allowed, known)
        for cell in self.cells:
            if cell.condition.subs(known) == sp.true:
                return cell.spans
        raise InputError(f"{self.name}: {in_words(wanted - known.keys())} is missing; the spans depend on it")

    @property
    def _shown(self) -> tuple[RegionCell, ...]:
        """The cells if they depend on the parameters alone; otherwise none, as the condition is then easier to read."""
        return self.cells if self.plane.alone else ()

    def latex(self) -> str:
        """Return the region as LaTeX, one line for each cell of the parameters, or as its condition."""
        if not self._shown:
            return latex_of(self.condition)
        lines = [rf"{latex_union(cell.spans)} & {_latex_condition(cell.condition)}" for cell in self._shown]
        return r"\begin{cases} " + r" \\ ".join(lines) + r" \end{cases}"

    def __str__(self) -> str:
        parts = (spans_in_words(cell.spans) + f" for {formula_in_words(cell.condition)}" * (cell.condition != sp.true)
                 for cell in self._shown if cell.spans)
        return "; ".join(parts) or (formula_in_words(self.condition) if not self._shown else "nowhere")

    def _card(self) -> Card:
        rows = [(formula_in_words(cell.condition), spans_in_words(cell.spans)) for cell in self._shown]
        return Card(f"Region {self.name}, load {self.plane.load}", tuple(rows or [("where", self.condition)]))

    def _latex(self, printer: Any, **options: Any) -> str:
        return self.latex()


def spans_in_words(spans: tuple[Span, ...]) -> str:
    """Return a union of spans as text."""
    return " u ".join(span.in_words for span in spans) or "nowhere"


def latex_union(spans: tuple[Span, ...]) -> str:
    """Return a union of spans as LaTeX."""
    return r" \cup ".join(latex_of(span.as_set()) for span in spans) or r"\emptyset"


def _latex_condition(condition):
    relations = sorted(sp.And.make_args(condition), key=sp.default_sort_key)
    return r",\ ".join(latex_of(relation) for relation in relations)


@dataclass(frozen=True, repr=False)
class StickRegions(ShownAsFormulas):
    """The parts of the plane v = 0: ``stick``, ``up`` and ``down`` cover it; ``ambiguous`` is part of ``stick``.

    ``ambiguous`` is where sticking and crossing are both consistent, between the kinetic and the static cone;
    ``convention`` says which of the two the package chooses. ``edges`` are the loads at which stick can end, Gamma_1
    then Gamma_2; they depend on other states where the drive does, and are empty where the drive is not linear in the
    load.
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
    """The friction cone on v = 0: motion can stick where |drive| <= ``hold`` |load|, and must where <= ``slip`` |load|.

    The contact is open where ``gap`` > 0, and its drive is ``opened`` there; ``gap`` is None if it never opens.
    """

    drive: sp.Expr
    load: sp.Expr
    slip: sp.Expr
    hold: sp.Expr
    gap: sp.Expr | None = None
    opened: sp.Expr = sp.S.Zero

    def mapped(self, change: Callable[[sp.Expr], sp.Expr]) -> "Cone":
        """Return the cone with ``change`` applied to every part."""
        return Cone(*(part if part is None else change(part) for part in vars(self).values()))

    def rule(self, name: str) -> sp.Basic:
        """Return the inequalities of the region ``name``, for a closed and for an open contact."""
        closed_rule = _RULES[name](self.drive, self.slip * abs(self.load), self.hold * abs(self.load))
        if self.gap is None:
            return closed_rule
        open_rule = _RULES[name](self.opened, sp.S.Zero, sp.S.Zero)
        return sp.Or(sp.And(-self.gap >= 0, closed_rule), sp.And(-self.gap < 0, open_rule))

    @property
    def line(self) -> tuple[sp.Expr, sp.Expr]:
        """The drive d_0 + d_1 s as (d_0, d_1); the load is the symbol s."""
        return self.drive.subs(self.load, 0), self.drive.diff(self.load)

    @property
    def used(self) -> set[sp.Symbol]:
        """The symbols of all parts but the load."""
        parts = (self.drive, self.slip, self.hold, self.opened)
        return set().union(*(part.free_symbols for part in parts)) - {self.load}


@of_system
@cache
def stick_regions(system: System) -> StickRegions:
    """Return the stick and crossing regions of ``system``, from its friction cone, for every range of the parameters.

    Where the drive is linear in the load s the regions are unions of intervals of s, with ends in the parameters and
    the other states; otherwise the regions are conditions on the states. Raises ``NotDerivable`` unless the system has
    one friction, of a contact that is not rigid and whose load does not contain its force, and its velocity vanishes
    for one value of a state; ``InputError`` where static friction is below kinetic friction for all parameters allowed.
    """
    cone, moving = friction_cone(system), {*system.states, system.time}
    reduced = _in_load(cone, moving, system.assumptions)
    plane = _plane(system, cone, reduced, moving)
    linear = reduced is not None and _linear(reduced)
    shown = cone if reduced is None else reduced
    stick, up, down, ambiguous = (Region(name, shown.rule(name), plane, _cells(name, reduced, plane) if linear else ())
                                  for name in _RULES)
    edges = [_zero(reduced, sign * reduced.hold) for sign in (1, -1)] if linear else []
    return StickRegions(stick, up, down, ambiguous, tuple(edge for edge in edges if edge is not None))


def friction_cone(system: System) -> Cone:
    """Return the cone of the system's friction on v = 0, times mu where v is fast; raises as ``stick_regions`` does."""
    friction = system.friction
    if friction is None:
        count = len(system.frictions)
        raise NotDerivable(
            f"this system has {count} frictions, whose cones depend on one another: regions need a single friction"
            if count else "this system has no friction: build it with System.with_friction to ask for stick regions"
        )
    if friction.rigid:
        raise NotDerivable(
            "the reaction of a rigid contact depends on the mode, so that stick and slip may both or neither be "
            "possible; count them with motions(), or take the elastic contact"
        )
    if is_pushed(system, 0):
        raise NotDerivable(f"the load {short(friction.load)} contains its own force, which depends on the mode: "
                           "regions need a load in states and parameters")
    still = plane_of_rest(system)
    for bound in (friction.kinetic, friction.static):
        if bound.subs(still).has(*NOT_FINITE):
            raise NotDerivable(f"friction {short(bound)} has no finite value at rest, which regions need")
    _require_order(friction, system.assumptions)
    rate = _without_division(rate_along(system, friction.velocity), system.small)
    normal = friction.normal or sp.Dummy()
    free, coupling = rate.subs(friction.force, 0), _size(rate.diff(friction.force))
    drive = free.subs(normal, friction.load)
    holds = [with_direction(friction.velocity, friction.static, side) for side in (1, -1)]
    for part in (free, coupling, friction.load, *holds):
        if len({part.subs(still), *_beside_rest(system, part)}) > 1:
            raise NotDerivable(f"{part!s:.60} jumps where the velocity vanishes, and regions need it continuous; "
                               "write the jump as a friction, or smooth it by tanh")
    pairs = (_beside_rest(system, friction.kinetic), holds)
    slip, hold = (up if up == down else sp.Piecewise((up, drive > 0), (down, True)) for up, down in pairs)
    cone = Cone(drive, friction.load, slip * coupling, hold * coupling, friction.gap, free.subs(normal, 0))
    return cone.mapped(lambda part: part.subs(still))


def _without_division(rate, small):
    """Return a rate times mu if its terms are divided by mu, as of a fast velocity: a factor of the whole cone."""
    terms = sp.Add.make_args(rate)
    divided = small is not None and any(term.as_coeff_exponent(small)[1] == -1 for term in terms)
    return sp.Add(*(small * term for term in terms)) if divided else rate


def _beside_rest(system, expr):
    """Return the limits of an expression where the velocity vanishes, from above and from below."""
    return [on_side(expr, system.friction.velocity, side).subs(plane_of_rest(system)) for side in (1, -1)]


def drive_of_load(system: System) -> tuple[sp.Symbol, sp.Expr]:
    """Return the load as one symbol s and the drive d(s); raises ``NotDerivable`` where d is not linear in s alone."""
    cone, moving = friction_cone(system), {*system.states, system.time}
    reduced = _in_load(cone, moving, system.assumptions)
    if reduced is None or reduced.used & moving or not _linear(reduced):
        raise NotDerivable(f"the drive {cone.drive} is not linear in the load {cone.load} alone")
    return reduced.load, reduced.drive


def plane_of_rest(system: System) -> dict[sp.Symbol, sp.Expr]:
    """Return {state: its value on v = 0} for one state, if possible one in which the velocity v of friction is linear.

    Raises ``NotDerivable`` where v vanishes at no value of the state, or at several.
    """
    velocity = system.frictions[0].velocity
    states = [s for s in reversed(system.states) if velocity.has(s)]
    state = next((s for s in states if not velocity.diff(s).has(s)), states[0])
    zeros = _real_zeros(velocity, state)
    if len(zeros) != 1:
        where = f"vanishes for several values of {state}" if zeros else "vanishes nowhere"
        raise NotDerivable(f"the sliding velocity {velocity!s:.60} {where}: regions need exactly one plane of rest")
    return {state: zeros[0]}


def _real_zeros(velocity, state):
    try:
        found = sp.solve(velocity, state)
    except NotImplementedError:
        raise NotDerivable(f"the sliding velocity {velocity!s:.60} cannot be solved for {state}: regions need the "
                           "plane of rest in symbols") from None
    return [zero for zero in found if zero.is_real is not False]


def _require_order(friction, assumptions):
    """Raise ``InputError`` where the assumptions imply kinetic friction below 0, or static below kinetic friction."""
    kinetic, static = friction.kinetic, friction.static
    for excess, words, needed in ((-kinetic, "kinetic friction is negative", "kinetic >= 0"),
                                  (kinetic - static, "static friction is below the kinetic one", "static >= kinetic")):
        if known_sign(excess, assumptions) > 0 and nonzero(excess, assumptions) == sp.true:
            raise InputError(f"{words}: {excess} > 0 for all parameters allowed; give {needed}")


def _in_load(cone, moving, assumptions):
    """Return the cone with a symbol s for the load in place of one state, or None if the load determines no state.

    A state whose coefficient vanishes at no parameters goes first: by that of another one the cone is divided.
    """
    load = unused_symbol("s", {*cone.used, *cone.load.free_symbols, *moving}, real=True)
    states = sorted(cone.load.free_symbols & moving, key=str)
    given = (s for s in states if cone.load.is_polynomial(s) and _is_determined(s, cone.load, moving))
    state = min(given, key=lambda s: nonzero(cone.load.diff(s), assumptions) != sp.true, default=None)
    if state is None:
        return None
    (solution,) = sp.solve(cone.load - load, state)
    return replace(cone.mapped(lambda part: _with_fewest(part.subs(state, solution), moving)), load=load)


def _is_determined(state, load, moving):
    """Tell whether the load is linear in a state, with a coefficient that vanishes at no other states."""
    slope = load.diff(state)
    return sp.degree(load, state) == 1 and (not slope.free_symbols & moving or nonzero(slope) == sp.true)


def _with_fewest(expr, moving):
    """Return ``expr`` unchanged, expanded or cancelled: the first of these forms that contains the fewest states."""
    states = expr.free_symbols & moving
    if heavy(expr) or not states:
        return sp.expand(expr) if expr.is_rational_function() else expr
    return min((expr, sp.expand(expr), sp.cancel(expr)), key=lambda form: len(form.free_symbols & moving))


def _linear(reduced):
    """Tell whether the drive is linear in the load s, an open contact having s = 0, and the bounds do not contain s."""
    constant, slope = reduced.line
    if any(part.has(reduced.load) for part in (slope, reduced.slip, reduced.hold)):
        return False
    if reduced.gap is None:
        return True
    return reduced.opened == constant and (-reduced.gap / reduced.load).is_positive is True  # closed just where s > 0


def _plane(system, cone, reduced, moving):
    friction = system.friction
    kinetic, static = (bound.subs(plane_of_rest(system)) for bound in (friction.kinetic, friction.static))
    pairs = ((static, kinetic), (kinetic, sp.S.Zero))
    ordered = [sp.Ge(a, b) for a, b in pairs if not (a - b).free_symbols & moving]
    allowed = sp.And(system.assumptions, *(r for r in ordered if r.free_symbols))
    extra = friction.static.free_symbols - friction.kinetic.free_symbols - moving
    default = sp.solve(friction.static - friction.kinetic, *extra) if len(extra) == 1 else []
    states = tuple(s for s in (*system.states, system.time) if s is not None)
    values = dict.fromkeys(extra, default[0]) if len(default) == 1 else {}
    symbol, alone = (None, False) if reduced is None else (reduced.load, not reduced.used & moving)
    return Plane(states, system.parameters, cone.load, symbol, alone, allowed, sp.Dict(values))


def _zero(cone, slope):
    """Return the load at which the drive is ``slope s``, or None."""
    constant, rise = cone.line
    if slope == rise:
        return None
    zero = constant / (slope - rise)
    return zero if heavy(zero) else sp.cancel(zero)


def _cells(name, cone, plane):
    """Return the cells of a region: conditions on the parameters, and on other states too where the drive has them."""
    if plane.alone:
        return _solved(name, cone, with_implied_bounds(plane.allowed))
    given = (*cone.line, cone.slip, cone.hold)
    constant, slope, slip, hold = (name if part != 0 else part for name, part in zip(_STANDING, given, strict=True))
    hold = slip if cone.slip == cone.hold else hold
    meaning = {name: part for name, part in zip(_STANDING, given, strict=True) if part != 0}
    gap = None if cone.gap is None else -cone.load
    named = Cone(constant + slope * cone.load, cone.load, slip, hold, gap, constant)
    return tuple(cell.put(meaning) for cell in _solved(name, named, sp.Ge(hold, slip)))


@cache
def _solved(name, cone, facts):
    """Return the cells on which the signs are fixed, each with the spans of loads found at one exact sample of it."""
    constant, slope = cone.line
    bounds = (cone.slip, cone.hold) if name == "ambiguous" else (cone.hold,)
    events = [constant, *(bound + sign * slope for bound in bounds for sign in (-1, 1))]
    edges = {(k, sign): _zero(cone, sign * bound) for k, bound in enumerate((cone.slip, cone.hold)) for sign in (1, -1)}
    cells = []
    for signs in product(*(_signs(event, facts) for event in events)):
        sample = _sample(signs, _signs(slope, facts))
        condition = conjunction(list(zip(events, signs, strict=True)), facts) if sample else sp.false
        if condition != sp.false:
            cells.append(RegionCell(condition, _spans(name, edges, sample, cone.gap is not None)))
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
    """Return numbers (d_0, d_1, slip, hold) with these signs, hold above slip if possible, or None if none exist."""
    constant, *rest = signs
    for slope in (2 * sp.Integer(sign) for sign in slopes):
        fitting = [[k for k in (*_GRID, sp.S.Zero) if (sp.sign(k - slope), sp.sign(k + slope)) == pair]
                   for pair in zip(rest[::2], rest[1::2], strict=True)]
        pairs = [(a, b) for a in fitting[0] for b in fitting[-1] if a <= b]
        if pairs:
            slip, hold = min(pairs, key=lambda pair: (pair[0] == pair[1] and len(fitting) > 1, pairs.index(pair)))
            return sp.sympify(constant, strict=True), slope, slip, hold
    return None


def _spans(name, edges, sample, opens):
    """Return the spans of loads on which the rule holds, tested at the zeros, in order, and between them."""
    constant, slope, *bounds = sample
    places = {}
    for (k, sign), found in edges.items():
        if sign * bounds[k] != slope:
            places[constant / (sign * bounds[k] - slope)] = found if constant else sp.S.Zero
    if opens:
        places = {sp.S.Zero: sp.S.Zero} | {zero: found for zero, found in places.items() if zero > 0}
    zeros = sorted(places)
    probes = [zeros[0] - 1, *((a + b) / 2 for a, b in pairwise(zeros)), zeros[-1] + 1] if zeros else [sp.S.Zero]
    walk = [step for step in chain.from_iterable(zip_longest(probes, zeros)) if step is not None]
    borders = [-sp.oo, *(places[zero] for zero in zeros), sp.oo]
    spans = []
    loads = [max(load, sp.S.Zero) for load in walk] if opens else walk
    for inside, run in groupby(range(len(walk)), key=lambda k: _holds(name, sample, loads[k])):
        if inside:
            steps = [*run]
            first, last = steps[0], steps[-1]  # odd steps are the zeros
            spans.append(Span(borders[(first + 1) // 2], borders[last // 2 + 1], first % 2 == 1, last % 2 == 1))
    # where static and kinetic friction are equal, the sample has a span between their edges that is in fact empty
    return tuple(s for s in spans if s.start != s.end or (s.closed_start and s.closed_end))


def _holds(name, sample, load):
    constant, slope, slip, hold = sample
    return _RULES[name](constant + slope * load, slip * abs(load), hold * abs(load)) == sp.true
