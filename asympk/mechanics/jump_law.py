"""The jump through the paradox: its impulses and the velocities after it, as the limit of an elastic contact.

With a fixed damping time h and friction load |G_NT| > G_NN, the fast layer of the elastic contact takes a time
O(c log(1/c)) in the compliance c. It changes no coordinate, brings gamma to 0, and g' = O(c) before and after it. These
two conditions determine the two impulses (Lemma 5), where h (x+ - x) = P_N is the integral of R = x + h x',

    P_N = gamma G_NT / D,    P_T = -gamma G_NN / D,    D = G_NN G_TT - G_NT^2,
    q' -> q' + M^-1 (W_N P_N + W_T P_T),    x -> x + P_N / h.

A unilateral contact with a fixed b = h/sqrt(c) rebounds: ``rebound`` computes its gap rate.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.formulas import NOT_FINITE
from asympk.mechanics import paradox
from asympk.mechanics.checks import require_own_symbols
from asympk.mechanics.kinetics import Kinetics
from asympk.mechanics.stops import Stops
from asympk.numbers import LARGEST, short
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic.long import atoms, modulus
from asympk.symbolic.reading import exact_constant, real_expression
from asympk.symbolic.tidy import collected


@dataclass(frozen=True, repr=False)
class JumpLaw(ShownAsFormulas):
    """The result of the jump: impulses (P_N, P_T), the velocities after it, and the gain ``reaction`` of x.

    The law holds for a closed contact, g = 0, under ``condition``, in which g' = 0 excludes a collision. ``bound`` is
    friction load, the slope of the kinetic cone. ``gap_rate`` is g' after the jump, 0 if the contact stays closed.
    ``joints`` are the impulses of the reactions of the joints in the order of the ``others``.
    """

    impulses: tuple[sp.Expr, sp.Expr]
    velocities: sp.Dict
    reaction: sp.Expr
    condition: sp.Basic
    bound: sp.Expr
    gap_rate: sp.Expr = sp.S.Zero
    joints: tuple[sp.Expr, ...] = ()

    def _card(self) -> Card:
        rows = [*zip(("P_N", "P_T"), self.impulses, strict=True)]
        rows += [(f"joint {k}", impulse) for k, impulse in enumerate(self.joints, 1)]
        rows += [(f"{_name(rate)} after", value) for rate, value in self.velocities.items()]
        return Card("Jump law", (*rows, ("x gains", self.reaction), ("holds where", self.condition)))

    @property
    def cone(self) -> sp.Basic:
        """The condition that the impulses lie in the kinetic cone, |P_T| < friction load |P_N|: that of the paradox."""
        normal, tangential = map(sp.Abs, self.impulses)
        return tangential < self.bound * normal


def _name(rate: sp.Expr) -> str:
    return f"{rate.expr.func}'" if isinstance(rate, sp.Derivative) else str(rate)


def jump_law(
    kinetics: Kinetics, own: Callable[[Any], Any] = lambda expr: expr, ratio: Any = None, damping: Any = None
) -> JumpLaw:
    """Return the ``JumpLaw`` for the damping time ``damping``, by default a symbol h, or for the ratio b = h/sqrt(c).

    The errors are O(c log(1/c)), if g' = O(c) and |gamma| >> c before the jump. With ``ratio`` the contact opens, and
    the errors are O(log(k) / sqrt(k)) in the limit of large stiffness k. Raises ``InputError`` if both are given, or a
    ratio for a bilateral constraint. Raises ``NotDerivable`` for friction by velocities other than the sliding one, or
    without a value at rest, for damping by velocities that change during the jump, and, with a ratio, for friction that
    depends on the velocity.
    """
    if ratio is not None and damping is not None:
        raise InputError("ratio and damping are both given; the damping is either a time h or a ratio b")
    if ratio is not None and not kinetics.unilateral:
        raise InputError("ratio: a two-sided constraint never opens; the rebound needs Contact(unilateral=True)")
    if (stops := _stops(kinetics)) == sp.false:
        raise NotDerivable("friction depends on velocities other than the sliding one, or has no value at rest, and so "
                           "it is not known whether the contact stops; follow the elastic contact")
    condition = sp.And(paradox.condition(kinetics), stops, _rests(kinetics), keeps_gap(kinetics))
    if kinetics.unilateral:
        condition = sp.And(condition, kinetics.slip * kinetics.delassus[0, 1] > 0)
    if ratio is None:
        damping = kinetics.unused_symbol("h", positive=True) if damping is None else real_expression("damping", damping)
        if damping.is_nonpositive or damping.has(*NOT_FINITE):
            raise InputError(f"damping = {damping!s:.60}: it must be a positive time; the law needs some damping")
        _require_steady(kinetics, "damping", damping)
        return _law(kinetics, own, sp.S.Zero, sp.And(condition, damping > 0), damping)
    ratio = _ratio(ratio)
    _require_steady(kinetics, "ratio", ratio)
    opens = sp.S.Zero if condition == sp.false else rebound(kinetics, ratio)  # without a paradox its roots are complex
    return _law(kinetics, own, opens, sp.And(condition, kinetics.free[0] < 0, ratio >= 0), None)


def keeps_gap(kinetics: Kinetics) -> sp.Basic:
    """Return g' = 0, the part of the condition of a law that excludes collisions."""
    return sp.Eq(kinetics.gap_rate, 0, evaluate=False)


def _require_steady(kinetics: Kinetics, name: str, damping: sp.Expr) -> None:
    """Raise ``NotDerivable`` for a damping by a velocity that changes during the jump, as g' does, 0 before and after.

    Raises ``InputError`` for a damping without a value at some places.
    """
    require_own_symbols(name, damping, kinetics.symbols)
    if any(choice.args[-1].cond != sp.true for choice in atoms(damping, sp.Piecewise)):
        raise InputError(f"{name} = {damping!s:.60}: it has no value where no piece of the Piecewise holds; end it "
                         "with one that does")
    for k, u in enumerate(kinetics.velocities):
        if damping.has(u) and any(part != 0 for part in kinetics.response[k, :2]):
            raise NotDerivable(f"{name} = {damping!s:.60}: {u} changes during the jump, and the damping with it. "
                               "jump_law() alone gives the impulses for any damping time; for x, or a rebound, follow "
                               "the elastic contact")


def _stops(kinetics: Kinetics) -> sp.Basic:
    """Return when the contact stops within the jump, or False where this is not known."""
    bound, gamma = kinetics.friction * kinetics.load, sp.Dummy("gamma", real=True)
    if not bound.free_symbols & {*kinetics.velocities}:
        return sp.true
    law = _at_velocity(kinetics, bound, gamma)
    if law.has(*kinetics.velocities) or sp.Tuple(*_at_rest(kinetics, bound)).has(*NOT_FINITE, sp.I):
        return sp.false
    G = kinetics.delassus
    return Stops(sp.Lambda(gamma, law), kinetics.slip, G[0, 0], modulus(G[0, 1]), G[1, 1])


def _rests(kinetics: Kinetics) -> sp.Basic:
    """Return when static friction is not below the kinetic one where the contact has stopped.

    Raises ``NotDerivable`` where static friction has no value there.
    """
    if kinetics.static == kinetics.friction:
        return sp.true
    gained = (gain * -kinetics.slip for gain in kinetics.slip_impact)
    after = {u: u + gain for u, gain in zip(kinetics.velocities, gained, strict=False)}
    static = _at_velocity(kinetics, kinetics.static, sp.S.Zero).subs(after, simultaneous=True)
    if static.has(*NOT_FINITE, sp.I):
        raise NotDerivable(f"static friction {kinetics.static!s:.60} has no value at rest; follow the elastic contact")
    return sp.And(*(sp.Ge(static, kinetic) for kinetic in _at_rest(kinetics, kinetics.friction)))


def _at_rest(kinetics: Kinetics, law: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return what a law of friction tends to as sliding in either direction slows down to rest."""
    speed = sp.Dummy(positive=True)
    one, other = (_at_velocity(kinetics, law, sign * speed).subs(speed, 0) for sign in (1, -1))
    return one, other


def _at_velocity(kinetics: Kinetics, bound: sp.Expr, gamma: sp.Expr) -> sp.Expr:
    """Return a bound of friction at the sliding velocity ``gamma``, however the bound writes that velocity."""
    found = bound.subs(kinetics.slip, gamma)
    if found.has(*kinetics.velocities):
        u, slope = next((u, c) for u, c in zip(kinetics.velocities, kinetics.directions[1, :], strict=True) if c != 0)
        placed = bound.subs(u, (gamma - kinetics.slip.subs(u, 0)) / slope)
        compared = {relation: relation.func(relation.lhs - relation.rhs, 0) for relation in placed.atoms(sp.Rel)}
        found = sp.expand(placed.xreplace(compared))
    return found


def rebound(kinetics: Kinetics, ratio: sp.Expr) -> sp.Expr:
    """Return the gap rate with which a unilateral contact opens after the jump, for h = b sqrt(c), b the ``ratio``.

    This is the impact without collision, regularised as by Hogan and Kristiansen (2017). In slip the penetration grows
    along the positive root l of l^2 + p b l + p = 0, p = G_NN - friction load |G_NT| < 0, until gamma = 0. Then the
    contact sticks, u'' = -p_s (u + b u') from u' = l u on, and opens where its scaled reaction u + b u' is 0, with

        g' = |gamma| r / q  exp(-(2 beta / w) atan(w l / (r + beta l + p))),    r = sqrt(p (p - p_s)),

    p_s = D / G_TT, q = friction load G_TT - |G_NT|, beta = b p_s / 2, w^2 = p_s - beta^2 (for w^2 < 0, atan becomes
    the inverse hyperbolic tangent). Time is in units of 1/sqrt(k), and u is sqrt(k) times the penetration. Joints are
    rigid: elastic ones, as those of ``elastic``, take a part of the energy.

    Raises ``NotDerivable`` for friction that depends on the velocity.
    """
    G, bound = kinetics.delassus, kinetics.friction * kinetics.load
    if bound.free_symbols & {*kinetics.velocities}:
        raise NotDerivable("friction depends on the velocity, and the rebound is known where it does not: follow the "
                           "elastic contact")
    p = G[0, 0] - bound * modulus(G[0, 1])
    p_stick = kinetics.determinant / G[1, 1]
    q = bound * G[1, 1] - modulus(G[0, 1])
    undamped = sp.Abs(kinetics.slip) * _root(p, p_stick) / q
    return undamped if ratio == 0 else undamped * sp.exp(-_decay(p, p_stick, ratio))


def _root(p: sp.Expr, p_stick: sp.Expr) -> sp.Expr:
    """Return sqrt(p (p - p_stick)) for p < 0 as two roots: for a heavy body the product is too small for doubles."""
    return sp.sqrt(-p) * sp.sqrt(p_stick - p)


def _decay(p: sp.Expr, p_stick: sp.Expr, ratio: sp.Expr) -> sp.Expr:
    r"""Return the exponent of the decay from gamma = 0 to R = 0, (2 beta / w) atan(w l / (r + beta l + p))."""
    beta = ratio * p_stick / 2
    growth = (-p * ratio + sp.sqrt(p**2 * ratio**2 - 4 * p)) / 2
    slope, swing = growth / (_root(p, p_stick) + beta * growth + p), p_stick - beta**2
    ringing = sp.atan(sp.sqrt(swing) * slope) / sp.sqrt(swing)
    root = sp.sqrt(-swing)
    creeping = sp.log((1 + root * slope) / (1 - root * slope)) / (2 * root)
    return 2 * beta * sp.Piecewise((ringing, swing > 0), (creeping, swing < 0), (slope, True))


def _ratio(given: Any) -> sp.Expr:
    ratio = real_expression("ratio", given)
    finite = not ratio.has(*NOT_FINITE)
    size = exact_constant("ratio", ratio) if finite and ratio.is_number else 0  # refuses what has no sign in time
    if not finite or ratio.is_negative:
        raise InputError(f"ratio = {short(given)}: it must be a number or an expression, zero or positive")
    if size**2 > LARGEST:
        raise InputError(f"ratio = {short(given)}: doubles do not hold its square, and the rebound goes with the "
                         "inverse of that; give a damping time, damping=, for the law without rebound")
    return ratio


def _law(
    kinetics: Kinetics, own: Callable[[Any], Any], gap_rate: sp.Expr, condition: sp.Basic, damping: sp.Expr | None
) -> JumpLaw:
    gained = -(collected(kinetics.slip) * kinetics.slip_impact)
    if gap_rate != 0:
        gained += gap_rate * kinetics.gap_impact
    n = len(kinetics.velocities)
    velocities = {own(u): own(u + gain) for u, gain in zip(kinetics.velocities, gained[:n], strict=True)}
    *joints, normal, tangential = (-part for part in gained[n:])
    joints = [joint.even * part for joint, part in zip(kinetics.joints, joints, strict=True)]
    reaction = sp.S.Zero if damping is None else normal / damping
    return JumpLaw((own(normal), own(tangential)), sp.Dict(velocities), own(reaction), own(condition),
                   own(kinetics.friction * kinetics.load), own(gap_rate), tuple(map(own, joints)))
