"""Section 3, how motions run and where they end (C25, C27)."""

import random
from collections.abc import Iterator
from fractions import Fraction

import sympy as sp

from asympk.ledger.runs import MUS, M, listing, modes, precise, precise_path, trend
from asympk.ledger.verdicts import Check, claim, left_out, numeric, symbolic
from asympk.symbolic.manifold import slow_manifolds
from asympk.symbolic.regimes import regimes
from asympk.symbolic.stability import eigenvalues
from asympk.systems import painleve_klein as pk


@claim("C25", "3", "From O5 (x + y > -1, z > 0) it jumps straight to Pi1",
       "from z = O(mu), s < -1/(sigma + 1) the point can first land in G2")
def jump_from_above_the_divide() -> Iterator[Check]:
    stable = [passage.stable for passage in regimes(pk.system())[-1].passages]
    yield symbolic("Pi2 repels and Pi1 attracts, both in z > 0", stable == [True, False])
    sequences = modes((0, Fraction(-1, 2), 1)) + modes((1, 2, 1))
    straight = sequences == [("slip_opposite", "slip_same"), ("slip_same",)]
    yield numeric("runs from s = -1/2 and s = 3 meet no stick and no z < 0", straight, listing(sequences))
    first = _first_term_on_the_first_plane()

    def error(mu):
        return precise_path((1, 2, 1), mu).final[0] - (1 + 4 * M.exp(-1)) / 5

    found = trend(error, lambda mu: precise(mu) * precise(first))
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
