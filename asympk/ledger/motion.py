"""Section 3, how motions run and where they end (C18, C25, C27)."""

import random
from fractions import Fraction

import sympy as sp

from asympk.ledger.nouns import (
    claim,
    numeric,
    symbolic,
)
from asympk.ledger.runs import MUS, M, follow, modes, number, ratios, told
from asympk.ledger.trend import tends_to_one
from asympk.symbolic.manifold import slow_manifolds
from asympk.symbolic.regimes import regimes
from asympk.symbolic.stability import eigenvalues
from asympk.symbolic.stick import stick_regions
from asympk.systems import painleve_klein as pk

_THIRD = Fraction(1, 3)


@claim("C18", "3", "A point that enters G1 (G2) jumps to its edge Gamma1 (Gamma2) and leaves into z > 0")
def stick_ends_on_the_edge():
    regions = stick_regions(pk.system())
    rising = regions.up.spans(sigma=1)
    between = tuple(regions.edges[::-1]) == (rising[0].start, rising[0].end)
    yield symbolic("between Gamma2 and Gamma1 every motion crosses into z > 0", between, rising[0].as_set())
    kind = next(spectrum for spectrum in eigenvalues(pk.system()) if spectrum.mode == "stick")
    yield symbolic("in stick s falls to 0 with a stable fast eigenvalue", kind.kinds[0][0] == "stable node", kind.fast)
    for s, edge in ((2, Fraction(1, 4)), (-2, Fraction(-1, 2))):
        start = (_THIRD, s - _THIRD, 0)
        left = [follow(start, mu).events[0] for mu in MUS]
        name = "Gamma1" if s > 0 else "Gamma2"
        above = all(event.kind == "slip_onset" for event in left) and all(follow(start, mu).final[2] > 0 for mu in MUS)
        yield numeric(f"runs from s = {s} leave stick at {name} and rise", above)
        times, shifts = _stick_to_edge(start, s, edge)
        yield numeric(f"time to {name} over mu log(s / edge)", *tends_to_one(times))
        yield numeric("change of x on the way over mu (s - edge - x log(s / edge))", *tends_to_one(shifts))


def _stick_to_edge(start, s, edge):
    """Return the ratios of time and of the change of x in stick to their first terms, mu y' = -s and x' = s - x."""

    def time(mu):
        return number(mu) * M.log(number(s / edge))

    def shift(mu):
        return number(mu * (s - edge)) - number(start[0]) * time(mu)

    return (
        ratios(lambda mu: follow(start, mu).events[0].t, time),
        ratios(lambda mu: follow(start, mu).events[0].x - number(start[0]), shift),
    )


@claim("C25", "3", "From O5 (x + y > -1, z > 0) it jumps straight to Pi1")
def jump_from_above_the_divide():
    steep = next(regime for regime in regimes(pk.system()) if regime.condition == (pk.sigma > 0))
    yield symbolic("Pi2 repels and Pi1 attracts, both in z > 0", [p.stable for p in steep.passages] == [True, False])
    sequences = modes((0, Fraction(-1, 2), 1)) + modes((1, 2, 1))
    straight = sequences == [("slip_opposite", "slip_same"), ("slip_same",)]
    yield numeric("runs from s = -1/2 and s = 3 meet no stick and no z < 0", straight, told(sequences))
    first = _first_term_on_the_first_plane()

    def error(mu):
        return follow((1, 2, 1), mu).final[0] - (1 + 4 * M.exp(-1)) / 5

    found = ratios(error, lambda mu: number(mu) * number(first))
    yield numeric("x at t = 1 less that of the vertical jump from (1, 2, 1), over its first term", *tends_to_one(found))


def _first_term_on_the_first_plane(start=(1, 2), t=1):
    """The mu term of x(t) in the mode of Pi1 at sigma = 1, from the exact eigenvalues, without the fast part."""
    spectrum = next(s for s in eigenvalues(pk.system()) if s.mode == "slip_same")
    slow, scaled = spectrum.slow.subs(pk.sigma, 1), (pk.mu * spectrum.fast).subs(pk.sigma, 1)
    x, y = start[0] - sp.Rational(1, 5), start[1]
    amplitude = (scaled * x - pk.mu * y) / (scaled - pk.mu * slow)
    return sp.diff(amplitude * sp.exp(slow * t), pk.mu).subs(pk.mu, 0)


@claim("C27", "3", "Whatever the start, the system ends in motion with constant acceleration along the force")
def final_motion():
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
    path = follow(start, mu, until=60, sigma=sigma)
    ended = path.modes[-1] == "slip_same" and path.final[2] > 0
    return abs(path.final[0] - 1 / number(sigma + 4)) if ended else M.inf
