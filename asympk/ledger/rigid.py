"""Section 1: the rigid rod and the paradox (C01 to C06)."""

from collections.abc import Iterator
from itertools import product

import sympy as sp

from asympk.ledger.runs import decimals, negligible, value_at
from asympk.ledger.verdicts import Check, claim, numeric, symbolic
from asympk.symbolic.lowering import lower
from asympk.systems.painleve_klein import rod

_STEEP = sp.Interval.open(-1, 1)
_SHALLOW = sp.Union(sp.Interval.open(-sp.oo, -1), sp.Interval.open(1, sp.oo))
_PHYSICAL = {rod.m: 2, rod.P: 3, rod.f: sp.Rational(3, 2), rod.alpha: sp.Rational(6, 5)}


def _motions(velocity):
    return [motion for motion in rod.rigid_motions() if motion.velocity == velocity]


@claim("C01", "1", "Rigid rod: m x1'' = P - R cos a + mu R sin a, m x2'' = R cos a (1.2)")
def equations_of_motion() -> Iterator[Check]:
    first, second = rod.rigid_equations()
    pushed = rod.P - rod.R * sp.cos(rod.alpha) + rod.kappa * rod.R * sp.sin(rod.alpha)
    yield symbolic("Newton's and Coulomb's laws give (1.2)", sp.expand(rod.m * first - pushed) == 0, first)
    yield symbolic("and the smooth mass's equation", sp.expand(rod.m * second - rod.R * sp.cos(rod.alpha)) == 0, second)
    momentum = sp.expand(rod.m * (first + second) - rod.P - rod.kappa * rod.force_balance(rod.alpha)[rod.N1])
    yield numeric("the momentum of both masses changes by P and friction alone", *negligible(_value(momentum)))


@claim("C02", "1", "The reaction of the rigid rod is R = P / (2 cos a - mu sin a), mu = +-f (1.3)")
def reaction() -> Iterator[Check]:
    found = rod.rigid_reaction()
    expected = rod.P / (2 * sp.cos(rod.alpha) - rod.kappa * sp.sin(rod.alpha))
    yield symbolic("x1'' = x2'' has this one solution", sp.cancel(found - expected) == 0, found)
    first, second = (equation.subs(rod.R, found) for equation in rod.rigid_equations())
    yield numeric("both masses then accelerate alike (f = 3/2, a = 6/5)", *negligible(_value(first) - _value(second)))


@claim("C03", "1", "Shallow rod, |2 cos a| > |mu sin a|: the sign of R does not depend on mu; the motion is unique")
def shallow_rod_moves_uniquely() -> Iterator[Check]:
    signs = {motion.sign: sp.cancel(2 * motion.load / rod.steepness) for motion in _motions(1)}
    same = sp.solveset(sp.cancel(signs[1] * signs[-1]) > 0, rod.steepness, sp.S.Reals)
    yield symbolic("R(f) R(-f) > 0 is |w| > 1, w = 2 cos a / (f sin a)", same == _SHALLOW, same)
    for velocity in (1, -1):
        one, other = (motion.positions for motion in _motions(velocity))
        yield symbolic(f"for sgn x1' = {velocity:+d} exactly one sign of mu satisfies (1.1) on |w| > 1",
                       _SHALLOW.is_subset(one | other) and (one & other & _SHALLOW) is sp.S.EmptySet)
    counts = {rod.count_motions(v, sp.Rational(w, 10)) for v in (1, 0, -1) for w in (-30, -11, 11, 30)}
    yield numeric("one motion at w = +-1.1, +-3, also from rest", counts == {1})


@claim("C04", "1", "Steep rod, (1.4): the sign of R is opposite to that of mu, whatever the sign of cos a")
def steep_rod_turns_the_reaction() -> Iterator[Check]:
    for motion in _motions(1):
        opposite = sp.solveset(motion.sign * sp.cancel(2 * motion.load / rod.steepness) < 0, rod.steepness, sp.S.Reals)
        yield symbolic(f"mu R < 0 on all of |w| < 1 for mu = {motion.sign:+d} f", _STEEP.is_subset(opposite), opposite)
    found = rod.rigid_reaction()
    products = [_value((found * rod.kappa).subs(rod.kappa, sign * 4), angle) for sign in (1, -1)
                for angle in (sp.Rational(6, 5), sp.pi - sp.Rational(6, 5))]
    yield numeric("mu R < 0 at f = 4, a = 6/5 and pi - 6/5", all(p < 0 for p in products), decimals(products))


@claim("C05", "1", "Steep rod: for x1' < 0 no sign of mu satisfies (1.1), for x1' > 0 both do")
def paradox() -> Iterator[Check]:
    forward = sp.Intersection(*(motion.positions for motion in _motions(1)))
    backward = sp.Union(*(motion.positions for motion in _motions(-1)))
    yield symbolic("both signs satisfy (1.1) for x1' > 0 exactly on |w| < 1", forward == _STEEP, forward)
    yield symbolic("no sign satisfies it for x1' < 0 exactly on |w| <= 1", backward == _SHALLOW, backward)
    counts = [rod.count_motions(velocity, sp.Rational(1, 2)) for velocity in (1, -1)]
    yield numeric("two motions forward, none backward at w = 1/2", counts == [2, 0], counts)


@claim("C06", "1", "mu R x1' < 0 (1.1) says that the friction force opposes the velocity")
def friction_opposes() -> Iterator[Check]:
    force = rod.coulomb()
    sine = sp.Symbol("sin", positive=True)
    power = sp.expand(force.subs(sp.sin(rod.alpha), sine) * rod.u / sine)
    yield symbolic("F x1' / sin a is mu R x1', and sin a > 0", power == rod.kappa * rod.R * rod.u, force)
    law = lower((rod.kappa, rod.R, rod.alpha), force, target="math")
    cases = product((1, -1), (2, -2), (3, -3))
    agree = all((kappa * R * u < 0) == (law(kappa, R, 1.2) * u < 0) for kappa, R, u in cases)
    yield numeric("both signs agree for every sign of mu, R and x1'", agree)


def _value(expr, alpha=_PHYSICAL[rod.alpha]):
    return value_at(expr, {**_PHYSICAL, rod.alpha: alpha, rod.R: 5, rod.kappa: sp.Rational(-3, 2), rod.F: 1})
