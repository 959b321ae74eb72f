r"""The regime table: how the phase space changes with sigma, with static friction equal to kinetic friction.

A threshold is a sigma at which a slow manifold loses normal hyperbolicity, an edge of the stick region goes to
infinity, or a slow manifold meets the plane z = 0 on an edge. Between neighbouring thresholds, and on each, the phase
space does not change, so one exact sample determines its ``Regime``.
"""

from dataclasses import dataclass
from functools import cache
from itertools import chain, pairwise, zip_longest

import sympy as sp

from asympk.errors import NotDerivable
from asympk.symbolic.conditions import as_bound, assumed_range, points_in
from asympk.symbolic.manifold import critical_manifolds
from asympk.symbolic.stick import Span, drive_of_load, stick_regions
from asympk.symbolic.system import System
from asympk.symbolic.values import in_words


@dataclass(frozen=True)
class Passage:
    """A slow manifold in one regime.

    ``side`` is the sign of z on the manifold (0: it does not exist), ``stable`` tells whether the manifold attracts,
    ``drift`` is the sign of z' on it, and ``meets`` is where its motions reach z = 0 in the limit: the region "stick",
    "up" or "down", the "edge" of stick, or None if they move away from z = 0.
    """

    name: str
    side: int
    stable: bool
    drift: int
    meets: str | None


@dataclass(frozen=True)
class Regime:
    """One range of sigma, an interval or a single value: its stick region on z = 0, and its slow manifolds."""

    sigma: sp.Symbol
    values: sp.Set
    stick: tuple[Span, ...]
    passages: tuple[Passage, ...]

    @property
    def condition(self) -> sp.Basic:
        """The range as a relation on sigma."""
        return as_bound(self.sigma, self.values)


def thresholds(system: System) -> tuple[sp.Expr, ...]:
    """Return the values of sigma at which the phase space changes, in order, for sigma0 = sigma."""
    sigma = _parameter(system)
    load, drive = drive_of_load(system)
    kinetic = system.frictions[0].kinetic
    events = [sp.Poly(drive - sign * kinetic * load, load).coeff_monomial(load) for sign in (1, -1)]
    for manifold in _slip_manifolds(system):
        events.append(manifold.jacobian.det())
        level = _load_on(manifold, system)
        events += [drive.subs(load, level) - sign * kinetic * level for sign in (1, -1)]
    zeros = {zero for event in events for zero in sp.solve(sp.numer(sp.together(event)), sigma)}
    allowed = assumed_range(sigma, system.assumptions)
    return tuple(sorted(zero for zero in zeros if zero in allowed))


@cache
def regimes(system: System) -> tuple[Regime, ...]:
    """Return the ``Regime`` of every range of sigma between thresholds, and on each threshold, by rising sigma."""
    sigma = _parameter(system)
    allowed = assumed_range(sigma, system.assumptions)
    cuts = thresholds(system)
    ranges = [sp.Interval.open(a, b) for a, b in pairwise([allowed.start, *cuts, allowed.end])]
    parts = chain.from_iterable(zip_longest(ranges, (sp.FiniteSet(cut) for cut in cuts)))
    return tuple(_regime(part, system) for part in parts if part is not None)


def _regime(part, system):
    at = {(sigma := _parameter(system)): next(points_in(part))}
    passages = tuple(_passage(manifold, system, at) for manifold in _slip_manifolds(system))
    return Regime(sigma, part, stick_regions(system).stick.spans(at), passages)


def _passage(manifold, system, at):
    if manifold.exists.subs(at) == sp.false:
        return Passage(manifold.name, 0, False, 0, None)
    level = _load_on(manifold, system).subs(at)
    side = int(sp.sign(level)) * (1 if manifold.mode == "slip_same" else -1)
    rate = manifold.dynamics.slow[system.friction.velocity].subs(manifold.branch).subs(at)
    drift = int(sp.sign(sp.cancel(rate)))
    stable = manifold.jacobian.det().subs(at) < 0
    return Passage(manifold.name, side, bool(stable), drift, _reached(level, system, at) if side * drift < 0 else None)


def _reached(level, system, at):
    regions = stick_regions(system)
    if level in {edge.subs(regions.stick.plane.default).subs(at) for edge in regions.edges}:
        return "edge"
    return next(name for name in ("stick", "up", "down") if getattr(regions, name).contains(level, at))


def _slip_manifolds(system):
    return [manifold for manifold in critical_manifolds(system) if manifold.mode != "stick"]


def _load_on(manifold, system):
    return sp.cancel(system.friction.load.subs(manifold.branch))


def _parameter(system):
    found = system.friction.kinetic.free_symbols
    if len(found) != 1:
        raise NotDerivable(f"regimes are those of one friction parameter; the kinetic bound has {in_words(found)}")
    return next(iter(found))
