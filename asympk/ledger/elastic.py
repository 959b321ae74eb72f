"""Section 2: the elastic rod, its scales and its equations (C07 to C14)."""

from collections.abc import Iterator

import sympy as sp

from asympk.ledger.runs import negligible, tends_to_one, value_at
from asympk.ledger.verdicts import Check, claim, left_out, numeric, symbolic
from asympk.symbolic.regimes import thresholds
from asympk.symbolic.stability import eigenvalues
from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod

_NUMBERS = {
    rod.m: sp.Rational(3, 2), rod.P: 7, rod.f: 3, rod.l: 2, rod.k: 1000, rod.h: sp.Rational(1, 5),
    rod.alpha: sp.Rational(9, 10),
}
_TINY = [sp.Rational(1, 10**n) for n in (2, 4, 6, 8)]


@claim("C07", "2", "Kinematics for a small turn: l beta = (x1 - x2) sin a, Delta l = (x1 - x2) cos a (2.2)")
def kinematics() -> Iterator[Check]:
    names = ("Delta l", "beta")
    for name, exact, first in zip(names, rod.geometry(), rod.small_angle(), strict=True):
        slope = sp.trigsimp(sp.diff(exact - first, rod.delta).subs(rod.delta, 0))
        yield symbolic(f"{name} is this to first order in x1 - x2", slope == 0, first)
        second = sp.diff(exact, rod.delta, 2).subs(rod.delta, 0) / 2 * rod.delta**2
        ratios = [value_at((exact - first) / second, {**_NUMBERS, rod.delta: tiny}) for tiny in _TINY]
        yield numeric(f"error of {name} over its second-order term tends to 1", *tends_to_one(ratios))


@claim("C08", "2", "Kelvin-Voigt rod: R = R1 + h l R1' with R1 = k Delta l / l, R2 = h k d(Delta l)/dt (2.3)")
def rod_law() -> Iterator[Check]:
    t = sp.Symbol("t")
    compression = sp.Function("q")(t)
    spring = rod.k * compression / rod.l
    damper = rod.h * rod.k * sp.diff(compression, t)
    law = rod.kelvin_voigt().subs({rod.R1: spring, rod.dR1: sp.diff(spring, t)})
    yield symbolic("spring and damper side by side give it", sp.expand(law - spring - damper) == 0, rod.kelvin_voigt())
    yield symbolic("each of its terms is a force", rod.dimension(rod.kelvin_voigt()) == rod.dimension(rod.P))
    motion = sp.sin(3 * t) / 50
    at = {**_NUMBERS, t: sp.Rational(2, 7)}
    residual = value_at((law - spring - damper).subs(compression, motion).doit(), at)
    yield numeric("for Delta l = sin(3 t)/50 at t = 2/7", *negligible(residual))


@claim("C09", "2", "(2.4) holds with R1 tan^2 a / k dropped beside 1 as k -> oo",
       "the dropped term is of order mu itself, and friction in (2.5) drops R1 / k too: corrections of order"
       " mu within this model are as large as what the small angle costs")
def dropped_term() -> Iterator[Check]:
    elastic = rod.elastic_rod()
    written = rod.m * rod.l / (rod.k * sp.cos(rod.alpha)) * rod.ddR1 - rod.P - rod.F + 2 * rod.R * sp.cos(rod.alpha)
    yield symbolic("subtracting the two equations (2.1) leaves (2.4)", sp.expand(elastic.balance - written) == 0)
    stated = rod.R1 * sp.tan(rod.alpha) ** 2 / rod.k
    yield symbolic("the dropped term is the one stated", sp.cancel(elastic.dropped - stated) == 0, elastic.dropped)
    turned = 1 - sp.cos(rod.alpha + rod.R1 * sp.tan(rod.alpha) / rod.k) / sp.cos(rod.alpha)
    at = [{rod.k: 1000 / tiny, rod.R1: 4} for tiny in _TINY]
    ratios = [value_at(turned / elastic.dropped, {**_NUMBERS, **values}) for values in at]
    yield numeric("what is dropped over that term tends to 1 as k -> oo", *tends_to_one(ratios))
    groups = {group.symbol: group.definition for group in pk.groups()}
    share = sp.cancel(elastic.dropped.subs(rod.R1, rod.P * pk.x / sp.cos(rod.alpha)) / groups[pk.mu])
    yield left_out.symbolic("its ratio to mu does not depend on k: it is of the order of the terms of order mu that "
                            "are kept", not share.has(rod.k) and share != 0, share)
    yield left_out.symbolic("in (2.5) friction loses a term of that order too, sin(a + beta) = sin a (1 + R1 / k)",
                            sp.cancel(elastic.dropped_friction - rod.R1 / rod.k) == 0, elastic.dropped_friction)


@claim("C10", "2", "(2.5) for u > 0; for u < 0 replace f by -f")
def slip_equations() -> Iterator[Check]:
    elastic = rod.elastic_rod()
    friction = rod.f * sp.Abs(rod.R) * sp.sin(rod.alpha)
    inertia = rod.m * rod.l / (rod.k * sp.cos(rod.alpha)) * rod.ddR1
    balance, acceleration = elastic.slip(1)
    yield symbolic("F = -f |R| sin a in (2.4) gives the first equation",
                   sp.expand(balance - (inertia + friction + 2 * rod.R * sp.cos(rod.alpha) - rod.P)) == 0, balance)
    yield symbolic("and the second",
                   sp.expand(rod.m * acceleration - (rod.P - friction - rod.R * sp.cos(rod.alpha))) == 0, acceleration)
    turned = [expr.subs(rod.f, -rod.f) for expr in elastic.slip(1)]
    yield symbolic("u < 0 is f -> -f",
                   all(sp.expand(a - b) == 0 for a, b in zip(turned, elastic.slip(-1), strict=True)))
    work = [(-direction * friction * direction, {**_NUMBERS, rod.R: R}) for direction in (1, -1) for R in (2, -2)]
    power = [value_at(*pair) for pair in work]
    yield numeric("friction takes energy for both signs of u and of R", all(p < 0 for p in power))


@claim("C11", "2", "On u = 0: m l R1'' / (k cos a) + R cos a = 0 (2.6), from u = u' = 0 with F eliminated")
def stick_equation() -> Iterator[Check]:
    elastic = rod.elastic_rod()
    written = rod.m * rod.l / (rod.k * sp.cos(rod.alpha)) * rod.ddR1 + rod.R * sp.cos(rod.alpha)
    yield symbolic("eliminating F from (2.4) with u' = 0 gives (2.6)", sp.expand(elastic.stick() - written) == 0,
                   written)
    (holding,) = sp.solve(elastic.acceleration, rod.F)
    at = {**_NUMBERS, rod.R: 2, rod.ddR1: -3}
    residual = value_at(elastic.balance.subs(rod.F, holding) - written, at)
    yield numeric("both agree at numbers", *negligible(residual))


_SCALES = {
    "tau": sp.Symbol("t", real=True) / (rod.h * rod.l),
    "rho": rod.R1 * sp.cos(rod.alpha) / rod.P,
    "xi": rod.m * sp.Symbol("x_1", real=True) / (rod.P * (rod.h * rod.l) ** 2),
    "v": rod.m * rod.u / (rod.P * rod.h * rod.l),
    "mu": rod.m / (rod.k * rod.l * (rod.h * sp.cos(rod.alpha)) ** 2),
    "sigma": rod.f * sp.tan(rod.alpha) - 2,
}
_S = pk.x + pk.y
_MODES = {
    "slip_same": (1 - (pk.sigma + 4) * _S, 1 - (pk.sigma + 3) * _S),
    "slip_opposite": (1 + pk.sigma * _S, 1 + (pk.sigma + 1) * _S),
    "stick": (-_S, sp.Integer(0)),
}


@claim("C12", "2", "The scales, and in them the nondimensional equations (2.7)-(2.9) for general sigma")
def nondimensional_equations() -> Iterator[Check]:
    groups = {group.symbol.name: group.definition for group in pk.groups()}
    same = all(sp.cancel(groups[name] - written) == 0 for name, written in _SCALES.items())
    yield symbolic("the scales that make the coefficients canonical are those of the paper", same)
    clock = {sp.Symbol("t", real=True): rod.h * rod.l, sp.Symbol("x_1", real=True): rod.l}
    units = {rod.dimension(definition.subs(clock)) for definition in groups.values()}
    yield symbolic("every group is a pure number", units == {1})
    for mode in pk.system().modes:
        fast, velocity = _MODES[mode.name]
        agrees = sp.expand(mode.fast[pk.y] - fast) == 0 and sp.expand(mode.slow[pk.z] - velocity) == 0
        yield symbolic(f"{mode.name} is the paper's", agrees, mode.fast[pk.y])
    yield numeric("(2.7) is (2.5) at numbers", *_same_acceleration(groups))


def _same_acceleration(groups):
    """Compare v' of (2.7) with u' of (2.5), carried by the scales, at one set of physical numbers."""
    rho, rate = sp.Rational(1, 3), sp.Rational(1, 7)
    reaction = rod.P * (rho + rate) / sp.cos(rod.alpha)
    physical = rod.elastic_rod().slip(1)[1].subs(rod.R, reaction) * rod.m / rod.P
    scaled = pk.system().mode("slip_same").slow[pk.z].subs({pk.x: rho, pk.y: rate, pk.sigma: groups["sigma"]})
    return negligible(value_at(physical - scaled, _NUMBERS))


@claim("C13", "2", "The value of sigma > 0 does not change the qualitative behaviour")
def sigma_only_scales() -> Iterator[Check]:
    found = thresholds(pk.system())
    yield symbolic("the phase space changes at no sigma > 0", all(value <= 0 for value in found), found)
    spectra = eigenvalues(pk.system())
    at = [[spectrum.kind(sigma=sigma, mu="1/1000") for spectrum in spectra] for sigma in ("1/50", 1, 30, 10**6)]
    same = all(kinds == at[0] for kinds in at)
    yield numeric("equilibria of the same kinds at sigma = 1/50, 1, 30, 1e6 (mu = 1/1000)", same, ", ".join(at[0]))


@claim("C14", "2", "sigma = 1 gives (2.10)-(2.12)")
def sigma_one() -> Iterator[Check]:
    fields = {mode.name: (mode.fast[pk.y], mode.slow[pk.z]) for mode in pk.system().modes}
    at = {name: [sp.expand(expr.subs(pk.sigma, 1)) for expr in pair] for name, pair in fields.items()}
    written = {
        "slip_same": (1 - 5 * pk.x - 5 * pk.y, 1 - 4 * pk.x - 4 * pk.y),
        "slip_opposite": (1 + pk.x + pk.y, 1 + 2 * pk.x + 2 * pk.y),
        "stick": (-pk.x - pk.y, sp.Integer(0)),
    }
    for name, pair in written.items():
        yield symbolic(f"{name}: mu y', z' are the paper's", list(pair) == at[name], at[name])
    values = {name: [expr.subs({pk.x: 2, pk.y: -1}) for expr in pair] for name, pair in at.items()}
    expected = {"slip_same": [-4, -3], "slip_opposite": [2, 3], "stick": [-1, 0]}
    yield numeric("mu y' and z' at x = 2, y = -1", values == expected, values)
