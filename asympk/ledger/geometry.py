"""Section 3, the geometry of the phase space: fields, stick regions, slow planes (C15 to C17, C19 to C22, C28, C29,
C31, C32)."""

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

import sympy as sp

from asympk.ledger.runs import (
    MUS,
    M,
    approaches,
    escape_time,
    in_mu,
    listing,
    modes,
    precise,
    precise_path,
    trend,
    value_at,
)
from asympk.ledger.verdicts import Check, claim, left_out, numeric, symbolic
from asympk.symbolic.manifold import integral_curves, reduced_flow, rest_state, slow_manifolds
from asympk.symbolic.regimes import regimes
from asympk.symbolic.stability import eigenvalues
from asympk.symbolic.stick import drive_of_load, stick_regions
from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod


def _planes(order=1):
    return {manifold.name: manifold for manifold in slow_manifolds(pk.system(), order=order)}


@claim("C15", "3", "(2.10) holds in O1 (s > 0, z > 0) and O3 (s < 0, z < 0), (2.11) in O2 (s < 0, z > 0) and O4")
def quadrants() -> Iterator[Check]:
    where = {mode.name: mode.where for mode in pk.system().modes}
    octants = {"O1": (1, 1), "O2": (-1, 1), "O3": (-1, -1), "O4": (1, -1)}
    found = {name: _mode_at(where, load, velocity) for name, (load, velocity) in octants.items()}
    expected = {"O1": "slip_same", "O2": "slip_opposite", "O3": "slip_same", "O4": "slip_opposite"}
    yield symbolic("the sign of friction, -sgn z |s|, decides the mode so", found == expected, found)
    first = [precise_path((load, 0, velocity), Fraction(1, 100), Fraction(1, 10**6)).modes[0]
             for load, velocity in octants.values()]
    yield numeric("runs from (s, z) = (+-1, +-1) begin in it", first == list(expected.values()), ", ".join(first))


def _mode_at(where, load, velocity):
    at = {pk.x: load, pk.y: 0, pk.z: velocity}
    return next(name for name, condition in where.items() if condition.subs(at) == sp.true)


@claim("C16", "3", "G1: x + y > 1/4, G2: x + y < -1/2 (sigma = 1); for general sigma, and with f0",
       "exact at every mu; in general s >= 1/(sigma0 + 3) or s <= -1/(sigma0 + 1) for sigma0 > -1, s >= 1/2 "
       "at -1, and one strip 1/(sigma0 + 3) <= s <= -1/(sigma0 + 1) below")
def stick_half_planes() -> Iterator[Check]:
    regions = stick_regions(pk.system())
    found = sp.Union(*(span.as_set().subs(pk.sigma0, 1) for span in regions.stick.spans(sigma=1)))
    written = sp.Union(sp.Interval.open(-sp.oo, sp.Rational(-1, 2)), sp.Interval.open(sp.Rational(1, 4), sp.oo))
    yield symbolic("the friction cone at sigma = 1 has this interior", found.interior == written, found)
    yield numeric("runs from the edges +- 1e-30 stick or not as it says, at every mu", *_edges_decide())
    yield left_out.symbolic("the cone does not depend on mu: the half-planes are exact, not a limit",
                            not drive_of_load(pk.system())[1].has(pk.mu), f"edges {', '.join(map(str, regions.edges))}")
    counts = {value: len(regions.stick.spans(sigma=value)) for value in ("1", "-1", "-3/2")}
    yield left_out.symbolic("G2 exists for sigma0 > -1 only; below, G1 is a bounded strip",
                            counts == {"1": 2, "-1": 1, "-3/2": 1} and regions.down.contains(3, sigma="-3/2"),
                            regions.stick.spans(sigma="-3/2")[0].as_set())


def _edges_decide():
    tiny = Fraction(1, 10**30)
    starts = {Fraction(1, 4) + tiny: True, Fraction(1, 4) - tiny: False}
    starts |= {Fraction(-1, 2) - tiny: True, Fraction(-1, 2) + tiny: False}
    for mu in (Fraction(1, 10), *MUS):
        for s, sticks in starts.items():
            if (precise_path((s, 0, 0), mu, mu).modes[0] == "stick") != sticks:
                return False, f"not at s = {s}, mu = {mu}"
    return True, f"mu = 1/10 to {MUS[-1]}"


@claim("C17", "3", "On z = 0 the only slow motions are on x + y = 0, which lies outside G1 and G2")
def slow_line_of_stick() -> Iterator[Check]:
    stick = pk.system().mode("stick")
    line = sp.solve(stick.fast[pk.y].subs(pk.mu, 0), pk.y)
    yield symbolic("mu y' = 0 in stick is x + y = 0", line == [-pk.x], stick.fast[pk.y])
    load, drive = drive_of_load(pk.system())
    yield symbolic("there the drive is 1 and no friction holds it", drive.subs(load, 0) == 1, drive)
    third = Fraction(1, 3)
    sequences = modes((third, -third, 0))
    yield numeric("runs from (1/3, -1/3, 0) leave upwards at once", sequences == [("slip_same",)], listing(sequences))


@claim("C19", "3", "Pi1: 5x + 5y = 1, z > 0 is a stable plane of slow motions")
def first_plane() -> Iterator[Check]:
    plane = _planes()["Pi1"]
    level = sp.cancel(pk.x + plane.coefficient(0))
    yield symbolic("the critical manifold is x + y = 1/(sigma + 4)", level == 1 / (pk.sigma + 4), level)
    yield symbolic("it lies in z > 0", plane.domain == (pk.z > 0), plane.domain)
    yield symbolic("it attracts for every sigma", str(plane.stability) == "stable", plane.jacobian[0])
    found = approaches(plane, 1, lambda mu: precise_path((1, 2, 1), mu).final)
    yield numeric("its distance from a run at t = 1 over the first term of the slow manifold", *found)


@claim("C20", "3", "Trajectories on Pi1: z = -(1/5) ln|1 - 5x| + C, and the half-line x = 1/5, y = 0, z > 0")
def curves_on_the_first_plane() -> Iterator[Check]:
    plane = _planes()["Pi1"]
    curve = integral_curves(_planes(0)["Pi1"])[pk.z]
    written = -sp.log(sp.Abs(1 - (pk.sigma + 4) * pk.x)) / (pk.sigma + 4)
    slope = sp.cancel(sp.diff((curve - written).replace(sp.Abs, lambda argument: argument), pk.x))
    yield symbolic("dz/dx integrates to it for every sigma, 5 being sigma + 4", slope == 0, curve)
    rest: Any = rest_state(plane)
    yield symbolic("and x = 1/(sigma + 4), y = 0 is the rest state", rest.state[pk.x] == 1 / (pk.sigma + 4), rest.state)
    yield numeric("change of C from t = 1 to 2 over its first term", *_drift_of_constant(plane))


def _drift_of_constant(plane):
    """Follow C = z + (1/5) ln|1 - 5x| along runs and compare with the curve's term of order mu."""
    first = integral_curves(plane)[pk.z].coeff(pk.mu, 1).subs(pk.sigma, 1)

    def change_of(quantity, mu):
        path = precise_path((1, 2, 1), mu, until=2)
        return quantity(path.final) - quantity(path(1))

    def constant(state):
        return state[2] + M.log(abs(1 - 5 * state[0])) / 5

    def term(state):
        return value_at(first, {pk.x: state[0]})

    return trend(partial(change_of, constant), lambda mu: precise(mu) * change_of(term, mu))


@claim("C21", "3", "Motion on Pi1 approaches that half-line")
def approach_to_the_half_line() -> Iterator[Check]:
    rest: Any = rest_state(_planes(0)["Pi1"])
    yield symbolic("the rest state attracts at rate -1, for every sigma", rest.rate == -1, rest.rate)
    yield symbolic("while z grows at the rate 1/(sigma + 4)", rest.drift[pk.z] == 1 / (pk.sigma + 4), rest.drift)

    def rate(mu):
        path = precise_path((1, 2, 1), mu, until=3)
        before, after = (state[0] - M.mpf(1) / 5 for state in (path(2), path.final))
        return M.log(after / before) + 1

    yield numeric("the measured rate plus 1 over -mu/5, the slow eigenvalue's next term",
                  *trend(rate, in_mu(Fraction(-1, 5))))


@claim("C22", "3", "Pi2: x + y = -1, z > 0 is unstable and only divides the fast motions by direction")
def second_plane() -> Iterator[Check]:
    plane = _planes()["Pi2"]
    level = sp.cancel(pk.x + plane.coefficient(0))
    yield symbolic("the critical manifold is x + y = -1/sigma", level == -1 / pk.sigma, level)
    kind: Any = eigenvalues(pk.system(), mode=plane.mode)[0]
    yield symbolic("for sigma > 0 one eigenvalue is positive", dict(kind.kinds)["saddle"] == (pk.sigma > 0), kind.fast)
    tenth = Fraction(1, 10)
    up, down = (modes((0, -1 + side * tenth, 1)) for side in (1, -1))
    divided = {s[1] for s in up} == {"slip_same"} and {s[1] for s in down} == {"stick"}
    yield numeric("runs from either side part, up to Pi1 and down to z = 0", divided, listing(up + down))

    tiny = Fraction(1, 10**20)
    found = trend(lambda mu: escape_time(tiny, mu), in_mu(20 * M.log(10)))
    yield numeric("escape from 1e-20 off the plane over mu log(1e20)", *found)


@claim("C28", "3", "f0 > f: only Gamma1, Gamma2 shift; the strip between G1 and G2 narrows; nothing else changes",
       "between the kinetic and the static edges resting and crossing are both motions of the model (here: "
       "at rest stays at rest), and on leaving the edge the acceleration jumps")
def static_friction() -> Iterator[Check]:
    regions = stick_regions(pk.system())
    upper, lower = regions.edges
    width = sp.factor(sp.diff(upper - lower, pk.sigma0))
    narrows = sp.solveset(width.subs(pk.sigma0, sp.Dummy("q", real=True)) < 0, domain=sp.Interval.open(-1, sp.oo))
    yield symbolic("the width of the strip falls with sigma0", narrows == sp.Interval.open(-1, sp.oo), width)
    fields = [rate for mode in pk.system().modes for rate in (*mode.slow.values(), *mode.fast.values())]
    yield symbolic("no field contains sigma0", not any(rate.has(pk.sigma0) for rate in fields))
    start = (0, Fraction(1, 5), -1)
    same = [precise_path(start, mu).modes == precise_path(start, mu, sigma0=3).modes for mu in MUS]
    yield numeric("runs with sigma0 = 3 and 1 have the same modes", all(same))
    yield left_out.symbolic("between the cones the elastic model has two motions, resting and crossing: a convention "
                            "must choose", regions.ambiguous.contains("1/5", sigma=1, sigma0=3), regions.convention)
    jump = sp.cancel(pk.system().mode("slip_same").slow[pk.z].subs(pk.y, upper - pk.x))
    yield left_out.symbolic("leaving Gamma1 the acceleration then jumps from 0", jump != 0, jump)


@claim("C29", "3", "Shallow rod, -2 < sigma < 0: Pi2 lies in z < 0 and is stable")
def shallow_second_plane() -> Iterator[Check]:
    shallow = [regime.passages[1] for regime in regimes(pk.system())[:-1]]
    alive = [passage for passage in shallow if passage.side]
    yield symbolic("on every range below sigma = 0 it has z < 0 and attracts",
                   all(p.side < 0 and p.stable for p in alive))
    yield symbolic("at sigma = 0 it does not exist", len(alive) == len(shallow) - 1)
    found = approaches(_planes()["Pi2"], -1, lambda mu: precise_path((0, 0, -4), mu, sigma=-1).final)
    yield numeric("a run's distance from it at sigma = -1, t = 1, over the slow manifold's first term", *found)


@claim("C31", "3", "Cause of the paradoxes: for sigma > 0, z > 0 holds a stable and an unstable slow plane, z < 0 none")
def cause_of_the_paradoxes() -> Iterator[Check]:
    sides = {passage.name: (passage.side, passage.stable) for passage in regimes(pk.system())[-1].passages}
    yield symbolic("Pi1 stable and Pi2 unstable, both in z > 0", sides == {"Pi1": (1, True), "Pi2": (1, False)}, sides)
    counts = [_planes_by_side(sigma) for sigma in (Fraction(1, 50), 1, 30, 10**6)]
    yield numeric("two planes in z > 0, none in z < 0 at sigma = 1/50, 1, 30, 1e6", set(counts) == {(2, 0)}, counts)


def _planes_by_side(sigma):
    """Return the numbers of slow planes in z > 0 and in z < 0: the sign of the load on a plane decides its side."""
    loads = {"slip_same": Fraction(1) / (sigma + 4), "slip_opposite": Fraction(-1) / sigma}
    sides = [load > 0 if mode == "slip_same" else load < 0 for mode, load in loads.items()]
    return sum(sides), len(sides) - sum(sides)


@claim("C32", "3",
       "The slow planes are the phase space of the rigid system: rigid motions and planes correspond one to one",
       "a plane carries x and z, the rigid rod z alone: x decays to the load in the time h l, a memory of what it was")
def planes_and_rigid_motions() -> Iterator[Check]:
    position = 2 / (pk.sigma + 2)  # w, as f sin a = (sigma + 2) cos a
    planes = _planes(0)
    loads = {name: sp.cancel(pk.x + plane.coefficient(0)) for name, plane in planes.items()}
    rigid_loads = {sp.cancel(motion.load.subs(rod.steepness, position)) for motion in rod.rigid_motions()}
    yield symbolic("the two rigid loads R cos a / P are x + y on the two planes", {*loads.values()} == rigid_loads,
                   "1/(sigma + 4), -1/sigma")
    for regime in regimes(pk.system()):
        sample = _inside(regime.condition)
        at = position.subs(pk.sigma, sample)
        rigid = {(motion.velocity, motion.load.subs(rod.steepness, at)) for motion in rod.rigid_motions()
                 if motion.velocity and at in motion.positions}
        elastic = {(p.side, loads[p.name].subs(pk.sigma, sample)) for p in regime.passages if p.side}
        yield symbolic(f"same side of z = 0 and same load for {regime.condition}", rigid == elastic,
                       sorted(map(str, elastic)))
    rates = {name: plane.dynamics.slow[pk.z].subs(plane.branch) for name, plane in planes.items()}
    same = all(sp.cancel(rates[name] - loads[name]) == 0 for name in planes)
    yield symbolic("z' on a plane is the rigid acceleration R cos a / P", same, rates)

    def acceleration(mu):
        path = precise_path((1, 2, 1), mu, until=3)
        return path.final[2] - path(2)[2] - M.mpf(1) / 5

    first = sp.diff(reduced_flow(_planes()["Pi1"])[pk.z].subs(pk.sigma, 1), pk.mu).subs(pk.mu, 0)
    predicted = in_mu(value_at(first, {pk.x: 1}) * (M.exp(-2) - M.exp(-3)))
    yield numeric("gain of z on Pi1 less 1/5 over its first term", *trend(acceleration, predicted))
    second = {name: sp.cancel(plane.dynamics.slow[pk.x].subs(plane.branch)) for name, plane in planes.items()}
    remembers = all(sp.cancel(rate - loads[name] + pk.x) == 0 for name, rate in second.items())
    yield left_out.symbolic("x is a second state on both planes: x' = load - x in units of h l", remembers, second)


def _inside(condition):
    candidates = (sp.Rational(n, 4) for n in (-7, -6, -5, -4, -2, 0, 4))
    return next(value for value in candidates if condition.subs(pk.sigma, value) == sp.true)
