r"""Stick and crossing regions of the switching plane z = 0, by solving the inequalities of the friction cone.

On z = 0 a motion may stick while the force it needs is within static friction, |d| <= static |s|, with the drive d
and the load s; where |d| > static |s| it crosses in the direction of d. Where |d| > kinetic |s| as well, the fields
on both sides of z = 0 point the same way; between the two cones sticking and crossing are both consistent.

Along the line of loads a cone changes only at the zeros of d +- friction s. Their order is fixed inside a cell of the
parameters, whose borders are where a zero goes to infinity or two zeros meet, so one exact sample decides each cell;
``_cells`` is the function that does it.
"""

from dataclasses import dataclass
from functools import cache
from itertools import chain, groupby, pairwise, product, zip_longest

import sympy as sp

from asympk.errors import NotDerivable
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic.conditions import assumed_range
from asympk.symbolic.regions import Cell, Region, Span

CONVENTION = (
    "at rest stays at rest: wherever static friction can hold (v = 0 and |d| <= static |s|) the motion sticks, on "
    "arrival too, although kinetic friction alone would let it cross"
)


@dataclass(frozen=True, repr=False)
class StickRegions(ShownAsFormulas):
    """The parts of the plane z = 0: ``stick``, ``up`` and ``down`` cover it; ``ambiguous`` is part of ``stick``.

    ``ambiguous`` is where sticking and crossing are both consistent, between the kinetic and the static cone;
    ``convention`` says what is then done. ``edges`` are the loads at which stick can end, Gamma_1 then Gamma_2.
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
        return Card(f"Stick regions of the switching plane, by the load {self.stick.load}", (*rows, *edges))


@cache
def stick_regions(system):
    """Solve the friction cone of ``system`` for every range of its parameters.

    Raises ``NotDerivable`` when the system has no friction, or its drive is not linear in the load alone.
    """
    load, drive = drive_of_load(system)
    kinetic, static = _parameter(system.friction.kinetic), _parameter(system.friction.static)
    slip, hold = (bound * sp.Abs(load) for bound in (system.friction.kinetic, system.friction.static))
    held, both = {static: system.friction.static}, {kinetic: system.friction.kinetic, static: system.friction.static}
    rules = {
        "stick": (sp.Abs(drive) <= hold, held),
        "up": (drive > hold, held),
        "down": (drive < -hold, held),
        "ambiguous": (sp.And(sp.Abs(drive) <= hold, sp.Abs(drive) > slip), both),
    }
    regions = (
        Region(name, load, kinetic, static, _cells(rule, load, drive, bounds, system.assumptions))
        for name, (rule, bounds) in rules.items()
    )
    return StickRegions(*regions, edges=_zeros(drive, load, system.friction.static))


def drive_of_load(system):
    """Return the load as one symbol s and the drive d(s); raises ``NotDerivable`` as ``stick_regions`` does."""
    friction = system.friction
    if friction is None:
        raise NotDerivable("this system has no friction: build it with System.with_friction to ask for stick regions")
    load = sp.Symbol("s", real=True)
    state = min(friction.load.free_symbols & {*system.modes[0].slow, *system.modes[0].fast}, key=str)
    solutions = sp.solve(friction.load - load, state)
    drive = sp.expand(system.drive.subs(state, solutions[0]))
    if drive.free_symbols != {load} or sp.degree(drive, load) != 1:
        raise NotDerivable(f"the drive {system.drive} is not linear in the load {friction.load} alone")
    return load, drive


def _parameter(bound):
    if len(bound.free_symbols) != 1:
        raise NotDerivable(f"the friction bound {bound} must depend on one parameter")
    (parameter,) = bound.free_symbols
    return parameter


def _zeros(drive, load, bound):
    return tuple(sp.solve(drive - sign * bound * load, load)[0] for sign in (1, -1))


def _cells(rule, load, drive, bounds, assumptions):
    """Cut the parameters into cells and solve ``rule`` for the load at one exact sample of each."""
    axes = [_parts(parameter, drive, load, bound, assumptions) for parameter, bound in bounds.items()]
    zeros = [zero for bound in bounds.values() for zero in _zeros(drive, load, bound)]
    cells = []
    for parts in product(*axes):
        box = dict(zip(bounds, parts, strict=True))
        sample = _sample(box)
        told = [a for a in sp.And.make_args(assumptions) if a.free_symbols <= set(sample)]
        if sp.And(*told).subs(sample) == sp.true:
            cells.append(Cell(sp.Dict(box), _spans(rule.subs(sample), load, zeros, sample)))
    return tuple(cells)


def _parts(parameter, drive, load, bound, assumptions):
    """Cut a parameter's range where a zero of d +- bound s goes to infinity or the two zeros meet."""
    factors = [sp.Poly(drive - sign * bound * load, load) for sign in (1, -1)]
    events = [*(factor.coeff_monomial(load) for factor in factors), sp.resultant(*factors)]
    allowed = _range(parameter, assumptions)
    cuts = sorted({root for event in events for root in sp.solve(event, parameter) if root in allowed})
    gaps = [sp.Interval.open(a, b) for a, b in pairwise([allowed.start, *cuts, allowed.end])]
    points = [sp.FiniteSet(cut) for cut in cuts]
    return [part for part in chain.from_iterable(zip_longest(gaps, points)) if part is not None]


def _range(parameter, assumptions):
    """Return the range of a parameter; with sigma0 >= sigma, sigma0 inherits sigma's lower bound."""
    ordered = [a for a in sp.And.make_args(assumptions) if len(a.free_symbols) == 2 and a.gts == parameter]
    return sp.Intersection(*(assumed_range(p, assumptions) for p in (parameter, *(a.lts for a in ordered))))


def _sample(box):
    """Pick an exact point of a cell, a later parameter above an earlier one where they share an interval."""
    sample = {}
    for rank, (parameter, part) in enumerate(box.items(), start=1):
        if part.is_FiniteSet:
            (sample[parameter],) = part
        elif part.end is sp.oo:
            sample[parameter] = part.start + rank
        else:
            sample[parameter] = part.start + (part.end - part.start) * sp.Rational(rank, len(box) + 1)
    return sample


def _spans(rule, load, ends, sample):
    """Walk along the line of loads, gap, zero, gap, ..., and join the steps on which the rule holds."""
    places = {end.subs(sample): end for end in ends if end.subs(sample).is_finite}
    zeros = sorted(places)
    probes = [zeros[0] - 1, *((a + b) / 2 for a, b in pairwise(zeros)), zeros[-1] + 1]
    walk = [step for step in chain.from_iterable(zip_longest(probes, zeros)) if step is not None]
    borders = [-sp.oo, *(places[zero] for zero in zeros), sp.oo]
    spans = []
    for holds, run in groupby(range(len(walk)), key=lambda step: rule.subs(load, walk[step]) == sp.true):
        if holds:
            steps = [*run]
            spans.append(_span(steps[0], steps[-1], borders))
    return tuple(spans)


def _span(first, last, borders):
    """Return the span from step ``first`` to step ``last`` of a walk; odd steps are the zeros themselves."""
    start, end = borders[(first + 1) // 2], borders[last // 2 + 1]
    return Span(start, end, first % 2 == 1, last % 2 == 1)
