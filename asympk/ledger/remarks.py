"""Remarks in sections 2 and 3: on signs, damping, borders, fast motions, and misprints (C37 to C43)."""

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import sympy as sp

from asympk.errors import NotDerivable
from asympk.ledger import undamped
from asympk.ledger.runs import MUS, M, decimals, event_of, negligible, precise, precise_path, trend
from asympk.ledger.verdicts import Check, claim, instead, left_out, numeric, symbolic
from asympk.symbolic.manifold import rest_state, slow_manifolds
from asympk.symbolic.regimes import regimes
from asympk.symbolic.stick import stick_regions
from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod

_S = pk.x + pk.y
_BELOW = (0, Fraction(1, 5), -1)


@claim("C37", "2", "cos a > 0 is no loss of generality",
       "but for cos a = 0: a rod across the guides is not compressed to first order, and mu is infinite")
def sign_of_the_cosine() -> Iterator[Check]:
    balance, acceleration = rod.elastic_rod().slip(1)
    turned = {rod.alpha: sp.pi - rod.alpha, rod.R: -rod.R, rod.ddR1: -rod.ddR1}
    same = all(sp.expand(expr.subs(turned, simultaneous=True) - expr) == 0 for expr in (balance, acceleration))
    yield symbolic("(2.5) does not change with a -> pi - a, R -> -R: the rod pulls where it pushed", same)
    counts = [[rod.count_motions(v, sp.Rational(sign * w, 10)) for v in (1, -1) for w in (5, 15)] for sign in (1, -1)]
    yield numeric("as many rigid motions at -w as at w, w = 1/2 and 3/2", counts[0] == counts[1], counts[0])
    compression = rod.geometry()[0].subs(rod.alpha, sp.pi / 2)
    flat = sp.diff(compression, rod.delta).subs(rod.delta, 0) == 0
    yield left_out.symbolic("at cos a = 0 the rod's length does not change to first order", flat, compression)


@claim("C38", "2", "h is to be held as k -> oo, to keep the dissipation in the rod",
       "it is enough, not necessary: with h falling like the root of 1/k, a fixed damping ratio, the damper takes as "
       "much")
def held_damping() -> Iterator[Check]:
    power = sp.expand(sp.diff(_energy(), pk.x) * pk.y + _power_of_forces())
    yield symbolic("in stick friction does no work and the energy falls by mu y^2", power == -pk.mu * pk.y**2, power)
    found = trend(lambda mu: _lost_in_stick(_BELOW, mu, 1), lambda mu: Fraction(1, 8))
    yield numeric("what one stick takes of z0^2/2 over sigma^2/(sigma + 1)^2, h held", *found)
    shares = [_share_at_fixed_ratio(small) for small in MUS[:3]]
    settles = abs(shares[2] - shares[1]) < abs(shares[1] - shares[0]) / 10 and shares[2] > 0.1
    yield left_out.numeric("its share settles for h ~ k^(-1/2) (damping ratio 1) as well", settles, decimals(shares))


def _energy():
    """The energy of both masses and the rod, with the velocities z and z - mu y, in the paper's units."""
    return (pk.z**2 + (pk.z - pk.mu * pk.y) ** 2 + pk.mu * pk.x**2) / 2


def _power_of_forces():
    """Return the rate of the energy in stick by y and z, less the work of the force P, at z = 0."""
    mode = pk.system().mode("stick")
    rate = sp.diff(_energy(), pk.y) * mode.fast[pk.y] / pk.mu + sp.diff(_energy(), pk.z) * mode.slow[pk.z]
    return sp.expand(rate.subs(pk.z, 0))


def _lost_in_stick(start, mu, until):
    """Return the energy that is lost during the first stick, at sigma = 1."""
    landed, left = precise_path(start, mu, until).events[:2]

    def energy(event):
        return (precise(mu) * event.y) ** 2 / 2 + precise(mu) * event.x**2 / 2

    return energy(landed) - energy(left)


def _share_at_fixed_ratio(small):
    """Return the share of z0^2 that is lost in the first stick at mu = 1/4; k ~ small^-2 makes z0 = -1/small."""
    return _lost_in_stick((0, 0, -1 / small), Fraction(1, 4), 100) * precise(small) ** 2


@claim("C39", "3", "Damping lets fast and slow motions be separated; without it they do not separate")
def separation_needs_damping() -> Iterator[Check]:
    damped = pk.system().mode("slip_same").fast[pk.y]
    decays = sp.diff(damped, pk.y)
    yield symbolic("with it the fast motion towards Pi1 decays, at the rate (sigma + 4)/mu", decays == -pk.sigma - 4)
    roots = undamped.fast_eigenvalues("slip_same")
    turning = {sp.re(root.subs(undamped.sigma, 1)) for root in roots} == {0}
    yield symbolic("without it both eigenvalues are imaginary", turning)
    yield symbolic("and no scales make (2.4) canonical", _has_no_scales())
    start, small = (Fraction(3, 10), 0, 2), Fraction(1, 1000)
    x, y, _ = precise_path(start, small, 20 * small).final
    settled = abs(x + y - M.mpf(1) / 5) < M.mpf(1) / 1000
    yield numeric("from s = 3/10, after 20 epsilon and 20 mu: amplitude kept without, load at 1/5 with it",
                  undamped.rings_on(start, small) and settled)


def _has_no_scales():
    try:
        rod.find_scales(rod.elastic_rod(rod.R1))
    except NotDerivable:
        return True
    return False


@claim("C40", "3", "G is the part of z = 0 that is stable against deviations from it; its border is where z' = 0",
       "for f0 = f alone: between the kinetic and the static edge of f0 > f the mass may rest where deviations run "
       "away")
def stick_region_by_stability() -> Iterator[Check]:
    regions = stick_regions(pk.system())
    rates = {mode.name: mode.slow[pk.z].subs(pk.y, -pk.x + sp.Symbol("s")) for mode in pk.system().modes[:2]}
    zeros = {sp.solve(rate, sp.Symbol("s"))[0] for rate in rates.values()}
    edges = {edge.subs(pk.sigma0, pk.sigma) for edge in regions.edges}
    yield symbolic("z' = 0 in the two slip modes at the edges of the cone", zeros == edges, sorted(map(str, edges)))
    back = [_returns(load) for load in (Fraction(26, 100), -2, Fraction(24, 100), Fraction(-1, 4))]
    yield numeric("from z = +-1e-12 off s = 0.26 and -2 runs come back, off s = 0.24 and -1/4 not",
                  back == [True, True, False, False])
    load = Fraction(1, 5)
    held = regions.ambiguous.contains("1/5", sigma=1, sigma0=3)
    yield left_out.symbolic("at sigma0 = 3 rest is possible at s = 1/5, outside the kinetic cone", held)
    yield left_out.numeric("and a run from z = 1e-12 there moves away", not _returns(load, sigma0=3))


def _returns(load, sigma0=None):
    """Tell whether runs from both sides of z = 0, at this load and sigma = 1, return at once and stick."""
    mu, off = Fraction(1, 1000), Fraction(1, 10**12)
    runs = [precise_path((0, load, side * off), mu, Fraction(1, 10**6), sigma0=sigma0) for side in (1, -1)]
    return all(run.events and run.modes[1] == "stick" for run in runs)


@claim("C41", "3", "Fast motions are essential for sigma > 0 and inessential below",
       "for a fixed sigma < 0 as mu -> 0: for |sigma| of the order of the root of mu the mass stops before Pi2 is "
       "reached")
def fast_motions_below() -> Iterator[Check]:
    attract = all(passage.stable for regime in regimes(pk.system())[:-1] for passage in regime.passages if passage.side)
    yield symbolic("both planes attract for sigma < 0", attract)
    shifts = {sigma: [_shift(sigma, mu) for mu in MUS] for sigma in (1, -1)}
    bounds = [20 * _layer(mu) for mu in MUS]
    gains = [abs(shift - 1) < bound for shift, bound in zip(shifts[1], bounds, strict=True)]
    stays = [abs(shift) < bound for shift, bound in zip(shifts[-1], bounds, strict=True)]
    gained = "at sigma = 1 x gains -z within 10 mu log(1/mu), up to O(mu log(1/mu))"
    yield numeric(gained, all(gains), decimals(shifts[1]))
    yield numeric("at sigma = -1 it stays up to O(mu log(1/mu))", all(stays), decimals(shifts[-1]))
    loads = [_load_at_stop(mu) for mu in MUS]
    yield left_out.numeric("at sigma = -sqrt(mu)/10 the mass stops before the load is half that on Pi2",
                           all(load < 0.5 for load in loads), decimals(loads))


def _layer(mu):
    return precise(mu) * -M.log(precise(mu))


def _shift(sigma, mu):
    """Return the change of x from z = -1 within the time 10 mu log(1/mu)."""
    return precise_path(_BELOW, mu, Fraction(str(float(10 * _layer(mu)))), sigma).final[0]


def _load_at_stop(mu):
    """Return the load at the first stop from z = -1, over the load on Pi2, at sigma = -sqrt(mu)/10."""
    sigma = Fraction(-1, 10 * round(float(mu) ** -0.5))
    stop = event_of(precise_path(_BELOW, mu, 1, sigma), "velocity_zero")
    return (stop.x + stop.y) * -precise(sigma)


@claim("C42", "3", "Shallow rod: motion on Pi1 approaches the line x = 1/5, y = 0 (1/s in the scan)",
       "the line is x = 1/(sigma + 4), y = 0; 1/5 is that of sigma = 1, which is steep: a misprint or a misreading")
def line_of_the_shallow_rod() -> Iterator[Check]:
    at_rest: Any = rest_state(slow_manifolds(pk.system(), order=0)[0])
    rest = at_rest.state[pk.x]
    at = sp.solve(rest - sp.Rational(1, 5), pk.sigma)
    yield symbolic("1/(sigma + 4) = 1/5 for some -2 < sigma < 0", any(-2 < value < 0 for value in at), at)
    ends = {sigma: precise_path((1, 2, 1), MUS[0], 200, sigma).final[0] for sigma in (-1, Fraction(-3, 2))}
    away = {sigma: end - 1 / precise(Fraction(sigma) + 4) for sigma, end in ends.items()}
    near = [abs(end - M.mpf(1) / 5) < 1e-3 for end in ends.values()]
    yield numeric("runs at sigma = -1 and -3/2 end there", all(near))
    yield instead.symbolic("the rest state of Pi1 is x = 1/(sigma + 4)", sp.cancel(rest * (pk.sigma + 4)) == 1, rest)
    yield instead.numeric("where they do end", all(negligible(gap)[0] for gap in away.values()))


@claim("C43", "2", "The task is to solve (2.8)-(2.10) as mu -> 0",
       "a misprint: (2.10)-(2.12) are the modes at sigma = 1; (2.10) beside (2.8) and (2.9) holds for no other sigma")
def equations_to_be_solved() -> Iterator[Check]:
    same = pk.system().mode("slip_same").fast[pk.y]
    written = 1 - 5 * _S
    yield symbolic("(2.10) goes with (2.8), for every sigma", sp.expand(same - written) == 0, same)
    misfit = (same - written).subs({pk.sigma: 2, pk.x: 1, pk.y: 0})
    yield numeric("at sigma = 2, s = 1 as well", misfit == 0, misfit)
    fields = {mode.name: sp.expand(mode.fast[pk.y].subs(pk.sigma, 1)) for mode in pk.system().modes}
    three = {"slip_same": 1 - 5 * _S, "slip_opposite": 1 + _S, "stick": -_S}
    yield instead.symbolic("(2.10)-(2.12) are the three modes at sigma = 1",
                           all(sp.expand(fields[name] - field) == 0 for name, field in three.items()))
    yield instead.numeric("at sigma = 1 both say the same", (same - written).subs({pk.sigma: 1, pk.x: 1, pk.y: 0}) == 0)
