"""Section 1, its reports of earlier work: Pfeiffer, Butenin, Le Suan An (C33 to C36)."""

import math
from collections.abc import Iterator
from fractions import Fraction

import sympy as sp

from asympk.ledger import undamped
from asympk.ledger.runs import MUS, M, precise, precise_path, trend
from asympk.ledger.verdicts import Check, claim, left_out, numeric, symbolic
from asympk.methods import solve
from asympk.symbolic.manifold import slow_manifolds
from asympk.systems import bead_rod, painleve_rod
from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod

_SMALLS = tuple(Fraction(1, 10**n) for n in (2, 4, 6))
_COARSE = (Fraction(1, 10), Fraction(1, 20))
_BELOW = (0, 0, -1)


@claim("C33", "1", "Pfeiffer, no damping: as k -> oo, for x1' < 0, R -> oo and the motion stops at once")
def reaction_without_bound() -> Iterator[Check]:
    growing = undamped.fast_eigenvalues("slip_opposite")
    yield symbolic("in z < 0 with R > 0 the load grows at the rate sqrt(sigma)/epsilon",
                   growing == {sp.sqrt(undamped.sigma), -sp.sqrt(undamped.sigma)}, sorted(map(str, growing)))
    stops = {small: undamped.precise_undamped_path(_BELOW, small, _past_the_stop(small)).events[0] for small in _SMALLS}
    loads = trend(lambda small: stops[small].state[0], lambda small: 1 / (2 * precise(small)), _SMALLS)
    yield numeric("load at the stop over sqrt(sigma)/((sigma + 1) epsilon), from v = -1", *loads)
    times = trend(lambda small: stops[small].t, lambda small: undamped.growth_time(small, 1 / precise(small)), _SMALLS)
    yield numeric("time to the stop over epsilon log(2 sigma sqrt(sigma)/((sigma + 1) epsilon))", *times)


def _past_the_stop(small):
    """Return a time shortly after epsilon log(1/epsilon), as a fraction."""
    return (Fraction(round(-math.log(small) * 10), 10) + 1) * small


@claim("C34", "1", "Pfeiffer, no damping: for x1' > 0 one of the limiting motions is unstable and so is not realised",
       "the other is a centre: a deviation from it neither grows nor decays, so that it is not reached either, and "
       "fast and slow motions do not separate")
def one_limit_is_unstable() -> Iterator[Check]:
    saddle, centre = (undamped.fast_eigenvalues(mode) for mode in ("slip_opposite", "slip_same"))
    yield symbolic("a saddle where s v < 0", {sp.sign(root.subs(undamped.sigma, 1)) for root in saddle} == {1, -1})
    tiny = Fraction(1, 10**20)
    left = [undamped.precise_undamped_path((tiny - 1, 0, 1), small, 100 * small).events[0].t for small in _SMALLS]
    expected = [undamped.growth_time(small, 2 * 10**20) for small in _SMALLS]
    near = all(abs(t / time - 1) < M.mpf(10) ** -15 for t, time in zip(left, expected, strict=True))
    yield numeric("from s = -1 + 1e-20, v = 1 the load turns after epsilon log(2e20)", near)
    turning = {sp.re(root.subs(undamped.sigma, 1)) for root in centre} == {0}
    yield left_out.symbolic("a centre where s v > 0", turning, sorted(map(str, centre)))
    kept = undamped.rings_on((Fraction(3, 10), 0, 2), _SMALLS[0])
    yield left_out.numeric("from s = 1/5 + 1/10 the amplitude is 1/10 still after 20 epsilon", kept)


@claim("C35", "1", "Butenin: with the hypothesis of a stop at once the rigid rod has no paradox",
       "the stop of the damped rod is at once; without damping it lasts as long as the rod rings, and the mass does "
       "not go on. It leaves x open, too, which gains -z, and for x1' > 0 the choice of two motions")
def hypothesis_of_a_stop() -> Iterator[Check]:
    counts = [rod.count_motions(velocity, sp.Rational(1, 2)) for velocity in (0, 1)]
    yield symbolic("from rest the steep rigid rod has exactly one motion", counts[0] == 1, counts[0])
    start = (0, Fraction(1, 5), -1)
    found = trend(lambda mu: 5 * precise_path(start, mu).final[2], lambda mu: 1)
    yield numeric("z of the damped rod at t = 1, from z = -1, over that of this motion", *found)
    yield left_out.symbolic("for x1' > 0 two motions remain", counts[1] == 2, counts[1])
    held = [solve(undamped.undamped_scene(_BELOW, small, 1)).events[-1] for small in _COARSE]
    waits = all(event.t > 0.8 and abs(event.state[2]) < 0.1 for event in held)
    yield left_out.numeric("without damping it still sticks and slips near t = 1, epsilon = 1/10 and 1/20", waits)
    gained = [precise_path(start, mu).events[-1].x for mu in MUS]
    yield left_out.numeric("x on leaving tends to 1, from x = 0", all(abs(x - 1) < 0.1 for x in gained))


@claim("C36", "1",
       "Le Suan An: a criterion of the paradoxes for n degrees of freedom; in the example it agrees with the others")
def criterion_for_any_mechanism() -> Iterator[Check]:
    masses = pk.mechanism()
    border = 2 * sp.Abs(sp.cos(rod.alpha)) / sp.sin(rod.alpha)
    found = masses.critical_friction
    yield symbolic("f load |G_NT| = G_NN is the border of (1.4) in the example", sp.cancel(found - border) == 0, found)
    values = {rod.m: 1, rod.P: 1, rod.alpha: sp.Rational(11, 10), rod.f: 4, rod.f0: 4}
    both, none = (_slips(masses, values, velocity) for velocity in (1, -1))
    yield numeric("two motions forward, none backward, for f = 4, a = 11/10", (both, none) == (2, 0), (both, none))
    planes = {plane.name for plane in slow_manifolds(pk.system(), order=0)}
    yield symbolic("as many as the elastic rod has slow planes in z > 0", len(planes) == both, sorted(planes))
    yield numeric("three degrees of freedom: counts on either side of it, for four angles", *_counts_of_a_rod())


def _slips(mechanism, values, velocity):
    """Return the number of motions that slip with the given first velocity, all other velocities being 0."""
    rest = dict.fromkeys((*mechanism.coordinates, *mechanism.velocities), 0)
    return len(mechanism.motions({**rest, mechanism.velocities[0]: velocity, **values}))


def _counts_of_a_rod():
    mechanism, theta, found = bead_rod.mechanism(), painleve_rod.theta, []
    sizes = dict.fromkeys((painleve_rod.m, painleve_rod.l, painleve_rod.g), 1)
    for angle in (sp.Rational(n, 10) for n in (6, 9, 11, 14)):
        critical = float(mechanism.evaluate(mechanism.critical_friction, {**sizes, theta: angle}))
        for share in (sp.Rational(9, 10), sp.Rational(11, 10)):
            friction = sp.Rational(str(round(float(share) * critical, 6)))
            values = {**sizes, theta: angle, mechanism.contact.friction: friction}
            found.append(sorted(_slips(mechanism, values, velocity) for velocity in (1, -1)))
    return found == [[1, 1], [0, 2]] * 4, found
