"""Section 3, the jumps, and where all motions end: x, y and z across the layers (C18, C23 to C27, C30).

One rule, ``_of_x``, judges what a sentence says about x. The paper speaks of "fast motions in the variable y" and
nowhere states that x is constant. A sentence that names a direction in the space (x, y, z), such as "a jump in the
positive direction of the axis y", is read as a statement that x is constant, for this is the meaning of a motion along
y; z is another matter, as the paper says that the point "comes to z = 0 by the equations of z". A sentence that names
only the end of the jump, such as "a jump to the edge", says nothing about x. In all four sentences x changes by an
amount that does not vanish with mu, which corrects a sentence of the first kind and refines one of the second.
"""

import random
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import sympy as sp

from asympk.asymptotics.jump import first_integral, jump_map
from asympk.ledger.runs import MUS, M, approaches, event_of, in_mu, listing, modes, precise, precise_path, trend
from asympk.ledger.verdicts import Check, claim, instead, left_out, numeric, symbolic
from asympk.symbolic.manifold import slow_manifolds
from asympk.symbolic.regimes import regimes
from asympk.symbolic.stability import eigenvalues
from asympk.symbolic.stick import stick_regions
from asympk.systems import painleve_klein as pk

_THIRD = Fraction(1, 3)
_FROM_BELOW = (0, Fraction(1, 5), -1)
_FROM_ABOVE = (0, -3, 1)
_STATES = (pk.x, pk.y, pk.z)


def _jump(start):
    """Return the jump map at sigma = 1 of the layer that holds ``start``, to first order in mu."""
    return jump_map(pk.system(), order=1, start={pk.sigma: 1, **dict(zip(_STATES, start, strict=True))})


def _limit(expansion):
    return sp.cancel(expansion.coefficient(0))


def _over_first_terms(measure, start, expansion):
    """Follow a start for decreasing mu; return (measure - limit) over the terms mu log(1/mu) and mu of an expansion."""
    at = {pk.sigma: 1, pk.sigma0: 1, **dict(zip(_STATES, map(sp.Rational, start), strict=True))}
    limit, *terms = (expansion.coefficient(*powers).subs(at) for powers in ((0, 0), (1, 0), (1, 1)))
    return trend(lambda mu: measure(precise_path(start, mu)) - precise(limit), in_mu(*terms))


def _of_x(along_y, limit, gain, what):
    """Yield the check of x across a jump; ``limit`` is x after the jump, ``gain`` its change, which ``what`` states."""
    moves = sp.cancel(limit - pk.x - gain) == 0 and gain != 0
    if along_y:
        yield symbolic("x is then what it was: the jump is along y", limit == pk.x, limit)
        yield instead.symbolic(what, moves, limit)
    else:
        yield left_out.symbolic(what, moves, limit)


@claim("C18", "3", "A point that enters G1 (G2) makes “a jump to its edge” Gamma1 (Gamma2) and leaves into z > 0",
       "a point that comes with y of the order of 1/mu, as all do that land, leaves with x + mu y in place of x")
def stick_ends_on_the_edge() -> Iterator[Check]:
    regions = stick_regions(pk.system())
    rising = regions.up.spans(sigma=1)
    between = tuple(regions.edges[::-1]) == (rising[0].start, rising[0].end)
    yield symbolic("between Gamma2 and Gamma1 every motion crosses into z > 0", between, rising[0].as_set())
    kind: Any = eigenvalues(pk.system(), mode="stick")[0]
    yield symbolic("in stick s falls to 0 with a stable fast eigenvalue", kind.kinds[0][0] == "stable node", kind.fast)
    for s, edge in ((2, Fraction(1, 4)), (-2, Fraction(-1, 2))):
        start = (_THIRD, s - _THIRD, 0)
        left = [precise_path(start, mu).events[0] for mu in MUS]
        name = "Gamma1" if s > 0 else "Gamma2"
        rises = all(precise_path(start, mu).final[2] > 0 for mu in MUS)
        above = rises and all(event.kind == "slip_onset" for event in left)
        yield numeric(f"runs from s = {s} leave stick at {name} and rise", above)
        times, shifts = _stick_to_edge(start, s, edge)
        yield numeric(f"time to {name} over mu log(s / edge)", *times)
        yield numeric("change of x on the way over mu (s - edge - x log(s / edge))", *shifts)
    jump = _jump(_FROM_BELOW)
    landing, leaving = jump.events
    height = landing.y.coefficient(-1)
    yield from _of_x(False, sp.cancel(_limit(leaving.x) - _limit(landing.x) + pk.x), height, _IN_STICK)
    yield left_out.numeric("from mu y = 1 x gains 1 on the way, over the terms mu log(1/mu) and mu", *_gain_in_stick())


_IN_STICK = "from landing to Gamma1 x gains the limit of mu y on landing"


def _stick_to_edge(start, s, edge):
    """Return the trends of time and of the change of x in stick to their first terms, mu y' = -s and x' = s - x."""
    x, time = precise(start[0]), M.log(precise(s / edge))
    return (trend(lambda mu: precise_path(start, mu).events[0].t, in_mu(time)),
            trend(lambda mu: precise_path(start, mu).events[0].x - x, in_mu(precise(s - edge) - x * time)))


def _gain_in_stick():
    """Compare x on leaving from (1/3, 1/mu, 0), less 4/3, with its terms: x' = y, mu y' = -s, s from 1/mu to 1/4."""
    after = precise(_THIRD + 1)
    predicted = in_mu(after + 1 - M.mpf(1) / 4 - after * M.log(4), -after)
    return trend(lambda mu: precise_path((_THIRD, 1 / mu, 0), mu).events[0].x - after, predicted)


@claim("C23", "3", "From anywhere in z < 0 the point makes “a jump in the positive direction of the axis y” and lands "
       "on z = 0 inside G1",
       "y reaches order 1/mu, so on landing x has grown by -z/(sigma + 1); and from |z| = O(mu), s < 0 the "
       "point can land in G2")
def jump_from_below() -> Iterator[Check]:
    jump = _jump(_FROM_BELOW)
    landing = jump.events[0]
    height = landing.y.coefficient(-1)
    yield symbolic("mu y on landing tends to a positive limit, so the point lands in G1", _positive_below(height),
                   height)
    gained = "x grows by -z/(sigma + 1): y is of order 1/mu for a time of order mu log(1/mu)"
    yield from _of_x(True, _limit(landing.x), -pk.z / (pk.sigma + 1), gained)
    starts = (_FROM_BELOW, (0, -2, -1))
    landed = [event_of(precise_path(start, mu), "velocity_zero") for start in starts for mu in MUS]
    yield numeric("runs from s = 1/5 and -2, z = -1 land at s > 1/4", all(event.x + event.y > 1 for event in landed))
    found = _over_first_terms(lambda path: path.events[0].x, _FROM_BELOW, landing.x)
    yield instead.numeric("x on landing less that, over the terms mu log(1/mu) and mu", *found)
    near = [precise_path((0, -2, -mu / 100), mu).events[0] for mu in MUS]
    outside = all(event.kind == "velocity_zero" and event.x + event.y < -1 for event in near)
    yield left_out.numeric("with |z| = O(mu) and s < 0 it can land at s < 0: from s = -2, z = -mu/100 in G2", outside)


def _positive_below(expr):
    """Tell whether an expression is positive for every sigma > 0 and z < 0."""
    steep, below = sp.symbols("steep below", positive=True)
    return sp.cancel(expr.subs({pk.sigma: steep, pk.z: -below})).is_positive


@claim("C24", "3", "Then it makes “a jump to the edge Gamma1, then a jump to the half-plane Pi1”, where it stays",
       "in all z -> 0 and x -> x - z; where mu |x| is not small the point comes back to z = 0")
def jump_to_the_first_plane() -> Iterator[Check]:
    first = regimes(pk.system())[-1].passages[0]
    yield symbolic("Pi1 attracts and its motions never come back to z = 0", first.stable and first.meets is None)
    jump = _jump(_FROM_BELOW)
    yield symbolic("the layer is slip_opposite, stick, slip_same and ends on Pi1",
                   jump.itinerary[1:] == ("stick", "slip_same"))
    sequences = modes(_FROM_BELOW) + modes((0, -2, -1))
    expected = [jump.itinerary, ("slip_same", *jump.itinerary)]
    yield numeric("runs from s = 1/5 and -2, z = -1 do so", sequences == expected, listing(sequences))
    yield left_out.symbolic("z comes to 0 in the limit", _limit(jump.z) == 0, first_integral(pk.system()).expr)
    yield from _of_x(False, _limit(jump.x), -pk.z, "x moves on by as much as z did: x -> x - z")
    leaves = _over_first_terms(lambda path: event_of(path, "slip_onset").x, _FROM_BELOW, jump.events[1].x)
    yield left_out.numeric("x on leaving Gamma1 less x - z, over the terms mu log(1/mu) and mu", *leaves)
    again = [precise_path((0, Fraction(1, 5), -_FAR / mu), mu, until=9).modes.count("stick") for mu in MUS]
    yield left_out.numeric(f"where mu |x| is not small there are further collisions: from z = -{_FAR}/mu",
                           set(again) == {2}, again)


_FAR = 10


@claim("C25", "3", "From O5 (x + y > -1, z > 0) it jumps straight to Pi1",
       "from z = O(mu), s < -1/(sigma + 1) the point can first land in G2")
def jump_from_above_the_divide() -> Iterator[Check]:
    stable = [passage.stable for passage in regimes(pk.system())[-1].passages]
    yield symbolic("Pi2 repels and Pi1 attracts, both in z > 0", stable == [True, False])
    sequences = modes((0, Fraction(-1, 2), 1)) + modes((1, 2, 1))
    straight = sequences == [("slip_opposite", "slip_same"), ("slip_same",)]
    yield numeric("runs from s = -1/2 and s = 3 meet no stick and no z < 0", straight, listing(sequences))
    end = (1 + 4 * M.exp(-1)) / 5
    found = trend(lambda mu: precise_path((1, 2, 1), mu).final[0] - end, in_mu(_first_term_on_the_first_plane()))
    yield numeric("x at t = 1 less that of the vertical jump from (1, 2, 1), over its first term", *found)
    near = {precise_path((0, Fraction(-3, 4), mu / 100), mu).modes for mu in MUS}
    lands = near == {("slip_opposite", "stick", "slip_opposite", "slip_same")}  # s < 0 before and after stick: in G2
    yield left_out.numeric("with z = O(mu) it can land in G2: from s = -3/4, z = mu/100", lands, listing(near))


def _first_term_on_the_first_plane():
    """The mu term of x(1) from (1, 2) in the mode of Pi1 at sigma = 1, from the exact eigenvalues of its slow part."""
    (spectrum,) = eigenvalues(pk.system(), mode="slip_same")
    slow, scaled = spectrum.slow.subs(pk.sigma, 1), (pk.mu * spectrum.fast).subs(pk.sigma, 1)
    x, y = 1 - sp.Rational(1, 5), 2
    amplitude = (scaled * x - pk.mu * y) / (scaled - pk.mu * slow)
    return sp.diff(amplitude * sp.exp(slow), pk.mu).subs(pk.mu, 0)


@claim("C26", "3", "From O6 (x + y < -1, z > 0) it makes “a jump in the direction of negative values of y” into G2, "
       "“in the positive direction of y” to Gamma2, then to Pi1",
       "x falls by z/(sigma + 1) on landing and by z in all: z -> 0, x -> x - z")
def jump_from_beyond_the_divide() -> Iterator[Check]:
    jump = _jump(_FROM_ABOVE)
    landing = jump.events[0]
    height = landing.y.coefficient(-1)
    falls = sp.cancel(height + pk.sigma * pk.z / (pk.sigma + 1)) == 0
    yield symbolic("mu y on landing tends to -sigma z/(sigma + 1) < 0, so the point lands in G2", falls, height)
    yield from _of_x(True, _limit(landing.x), -pk.z / (pk.sigma + 1), "x falls by z/(sigma + 1) on landing")
    sequences = modes(_FROM_ABOVE)
    yield numeric("runs from s = -3, z = 1 stick in G2, leave at Gamma2 and end on Pi1", sequences == [jump.itinerary],
                  listing(sequences))
    yield instead.symbolic("and by z in all: z -> 0, x -> x - z", (_limit(jump.x), _limit(jump.z)) == (pk.x - pk.z, 0))
    found = _over_first_terms(lambda path: path.events[0].x, _FROM_ABOVE, landing.x)
    yield instead.numeric("x on landing less that, over the terms mu log(1/mu) and mu", *found)
    leaves = _over_first_terms(lambda path: event_of(path, "slip_onset").x, _FROM_ABOVE, jump.events[1].x)
    yield instead.numeric("x on leaving Gamma2 less x - z, over the terms mu log(1/mu) and mu", *leaves)


@claim("C27", "3", "Whatever the start, the system ends in motion with constant acceleration along the force")
def final_motion() -> Iterator[Check]:
    for regime in regimes(pk.system()):
        first, second = regime.passages
        ends = first.side == 1 and first.stable and first.meets is None
        passes = second.side == 0 or second.meets is not None
        yield symbolic(f"{regime.condition}: motions stay on Pi1 only, all others return to z = 0", ends and passes)
    plane = slow_manifolds(pk.system(), order=0)[0]
    rate = sp.cancel(plane.dynamics.slow[pk.z].subs(plane.branch))
    yield symbolic("on Pi1 the acceleration is 1/(sigma + 4) > 0", rate == 1 / (pk.sigma + 4), rate)
    drawn = random.Random(1991)
    worst = max(_distance_from_the_end(drawn) for _ in range(20))
    at_the_end = worst < M.mpf(10) ** -20
    yield numeric("20 runs, sigma in (-2, 4), mu to 1/5, have |x - 1/(sigma + 4)| < 1e-20 at t = 60", at_the_end)


def _distance_from_the_end(drawn):
    sigma = Fraction(drawn.randint(-19, 40), 10)
    mu = Fraction(1, drawn.choice((5, 20, 10**3, 10**6)))
    start = tuple(Fraction(drawn.randint(-30, 30), 10) for _ in range(3))
    path = precise_path(start, mu, until=60, sigma=sigma)
    ended = path.modes[-1] == "slip_same" and path.final[2] > 0
    return abs(path.final[0] - 1 / precise(sigma + 4)) if ended else M.inf


@claim("C30", "3", "Shallow rod: from z < 0 the point jumps to Pi2, moves along it to z = 0, then jumps to Pi1",
       "for -3/2 < sigma < 0 the point sticks for a time mu log((sigma + 3)/(-sigma)) before it jumps to Pi1; below "
       "-3/2 it crosses at once, and at -3/2 it does so where x > 2/3")
def shallow_rod() -> Iterator[Check]:
    shallow = regimes(pk.system())[:-1]
    seconds = {regime.condition: regime.passages[1] for regime in shallow if regime.passages[1].side}
    leads = all(second.stable and second.drift > 0 and second.meets for second in seconds.values())
    yield symbolic("on -2 < sigma < 0 Pi2 attracts, lies in z < 0 and its motions rise to z = 0", leads)
    sequences = modes((0, -1, -4), Fraction(-17, 10), until=9)
    direct = sequences == [("slip_same", "slip_opposite", "slip_same")]
    yield numeric("runs from (0, -1, -4) at sigma = -1.7 do so", direct, listing(sequences))
    second = slow_manifolds(pk.system(), order=1)[1]
    found = approaches(second, -1, lambda mu: event_of(_from_far_below(mu), "velocity_zero").state)
    yield numeric("distance from Pi2 on reaching z = 0 over the slow manifold's first term", *found)
    reached = {str(condition): second.meets for condition, second in seconds.items()}
    yield left_out.symbolic("for -3/2 < sigma < 0 it reaches z = 0 inside G1 and sticks before Pi1; below it crosses "
                            "directly", list(dict.fromkeys(reached.values())) == ["up", "edge", "stick"],
                            ", ".join(f"{condition}: {part}" for condition, part in reached.items()))
    sequences = modes((0, -1, -4), -1, until=6)
    sticks = sequences == [("slip_same", "slip_opposite", "stick", "slip_same")]
    yield left_out.numeric("runs at sigma = -1 stick on the way", sticks, listing(sequences))
    sequences = modes((0, -1, -1), Fraction(-3, 2), until=3) + modes((3, -1, -1), Fraction(-3, 2), until=3)
    parts = ["stick" in sequence for sequence in sequences] == [True, False]
    yield left_out.numeric("runs at sigma = -3/2 stick from x = 0 and cross from x = 3", parts, listing(sequences))
    times = trend(_stick_duration, in_mu(M.log(2)))
    yield left_out.numeric("their time in stick over mu log((sigma + 3)/(-sigma))", *times)


def _from_far_below(mu):
    return precise_path((0, -1, -4), mu, until=6, sigma=-1)


def _stick_duration(mu):
    path = _from_far_below(mu)
    return event_of(path, "slip_onset").t - event_of(path, "velocity_zero").t
