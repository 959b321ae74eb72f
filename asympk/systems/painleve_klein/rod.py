r"""The rod of the Painlevé-Klein example in physical quantities, rigid (section 1) and elastic (section 2).

Masses M_1 (rough guide) and M_2 (smooth guide) slide along parallel lines; a massless rod at the angle alpha joins
them; P pushes M_1. The reaction R > 0 means a compressed rod. Everything here follows from Newton's law for the two
masses, Coulomb's law on M_1, the rod's geometry and the rod's law. ``rigid_motions`` decides which motions the rigid
rod has, ``elastic_rod`` derives (2.4), and ``find_scales`` finds its nondimensional form.
"""

from dataclasses import dataclass
from functools import cache

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.symbolic.conditions import assumed_range
from asympk.symbolic.reading import expression

m, P, f, f0, l, k, h = sp.symbols("m P f f_0 l k h", positive=True)
alpha, beta = sp.symbols("alpha beta", real=True)
u = sp.Symbol("u", real=True)
R, F, N1, N2 = sp.symbols("R F N_1 N_2", real=True)
R1, dR1, ddR1 = sp.symbols("R_1 Rdot_1 Rddot_1", real=True)
a1, a2 = sp.symbols("xddot_1 xddot_2", real=True)
kappa = sp.Symbol("kappa", real=True)  # the paper's mu = +-f in section 1, where it is not yet the small parameter
delta = sp.Symbol("delta", real=True)  # x_1 - x_2, the approach of the masses
steepness = sp.Symbol("w", real=True)

MASS, LENGTH, TIME = sp.symbols("M L T", positive=True)
_FORCE = MASS * LENGTH / TIME**2
DIMENSIONS = {
    m: MASS, P: _FORCE, l: LENGTH, k: _FORCE, h: TIME / LENGTH, f: 1, f0: 1, u: LENGTH / TIME,
    R: _FORCE, F: _FORCE, R1: _FORCE, dR1: _FORCE / TIME, ddR1: _FORCE / TIME**2,
    a1: LENGTH / TIME**2, a2: LENGTH / TIME**2, delta: LENGTH, alpha: 1, beta: 1,
}


def dimension(expr: sp.Expr) -> sp.Expr:
    """Return the dimension of ``expr`` as a monomial in M, L, T; raises ``InputError`` when its terms differ.

    >>> dimension(m * l / (k * sp.cos(alpha)) * ddR1)
    L*M/T**2
    """
    unknown = expr.free_symbols - set(DIMENSIONS)
    if unknown:
        raise InputError(f"{expr}: no dimension is known for {', '.join(sorted(map(str, unknown)))}")
    terms = sp.Add.make_args(sp.expand(expr))
    scaled = {symbol: symbol * unit for symbol, unit in DIMENSIONS.items() if unit != 1}
    units = {sp.powsimp(sp.cancel(term.subs(scaled, simultaneous=True) / term)) for term in terms}
    if len(units) > 1:
        raise InputError(f"{expr}: its terms have the dimensions {', '.join(sorted(map(str, units)))}; they must agree")
    return units.pop()


def force_balance(angle: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
    r"""Balance forces on both masses along and across the guides; the rod pushes M_2 by R (cos, sin) and M_1 back.

    Returns ``{x_1'': .., x_2'': .., N_1: .., N_2: ..}`` with the guides' reactions N (1.2), (2.1).
    """
    along, across = sp.cos(angle), sp.sin(angle)
    balances = (
        sp.Eq(m * a1, P + F - R * along),
        sp.Eq(0, N1 - R * across),
        sp.Eq(m * a2, R * along),
        sp.Eq(0, N2 + R * across),
    )
    return sp.solve(balances, (a1, a2, N1, N2), dict=True)[0]


def coulomb(law: dict[sp.Symbol, sp.Expr] | None = None) -> sp.Expr:
    """Return the friction force F = kappa N_1 with kappa = +-f, on the undeformed rod: kappa R sin(alpha)."""
    return kappa * (law or force_balance(alpha))[N1]


def rigid_equations() -> tuple[sp.Expr, sp.Expr]:
    """Return ``(x_1'', x_2'')`` of (1.2), with F = kappa R sin(alpha)."""
    law = force_balance(alpha)
    return tuple(law[a].subs(F, coulomb(law)) for a in (a1, a2))


@cache
def rigid_reaction() -> sp.Expr:
    r"""Solve x_1'' = x_2'' for the reaction: R = P / (2 cos(alpha) - kappa sin(alpha)) (1.3)."""
    first, second = rigid_equations()
    (reaction,) = sp.solve(sp.Eq(first, second), R)
    return sp.cancel(reaction)


@dataclass(frozen=True)
class RigidMotion:
    """A candidate motion of the rigid rod: the sign of u, kappa = sign f, and the rod positions where (1.1) holds.

    ``positions`` is a set of values of w = 2 cos(alpha) / (f sin(alpha)): the rod is steep, (1.4), for |w| < 1
    and shallow for |w| > 1. ``load`` is R cos(alpha) / P. For ``velocity = 0`` the motion starts from rest, its
    acceleration giving the velocity its sign.
    """

    velocity: int
    sign: int
    positions: sp.Set
    load: sp.Expr


@cache
def rigid_motions() -> tuple["RigidMotion", ...]:
    r"""Decide (1.1), kappa R u < 0, for each sign of u and of kappa by solving it for the rod's position w.

    From rest, u takes the sign of the acceleration R cos(alpha) / m. Rest itself is no motion: it needs R = 0, which
    leaves no friction to hold P.
    """
    sine = sp.Symbol("sin", positive=True)
    motions = []
    for sign in (1, -1):
        turned = rigid_reaction().subs({sp.cos(alpha): steepness * f * sine / 2, sp.sin(alpha): sine, kappa: sign * f})
        reaction = sp.factor(sp.cancel(turned * f * sine / P))
        load = sp.cancel(reaction * steepness / 2)
        for velocity in (1, -1, 0):
            motion = velocity or load
            opposes = assumed_range(steepness, sp.cancel(sign * reaction * motion) < 0)
            motions.append(RigidMotion(velocity, sign, opposes, load))
    return tuple(motions)


def count_motions(velocity: int, position: sp.Expr) -> int:
    """Return how many motions the rigid rod has for a sign of u (1, -1, 0) at a rod position w other than 0, 1, -1."""
    return sum(motion.velocity == velocity and position in motion.positions for motion in rigid_motions())


def geometry() -> tuple[sp.Expr, sp.Expr]:
    r"""Return the compression Delta l and the turn beta of the rod for x_1 - x_2 = delta, without approximation."""
    gap, height = l * sp.cos(alpha) - delta, l * sp.sin(alpha)
    return l - sp.sqrt(gap**2 + height**2), sp.atan2(height, gap) - alpha


@cache
def small_angle() -> tuple[sp.Expr, sp.Expr]:
    r"""Return Delta l and beta to first order in delta: Delta l = delta cos(alpha), l beta = delta sin(alpha) (2.2)."""
    compression, turn = geometry()
    first = (sp.diff(part, delta).subs(delta, 0) for part in (compression, turn))
    return tuple(sp.trigsimp(rate) * delta for rate in first)


def kelvin_voigt() -> sp.Expr:
    """Return the reaction of a spring k Delta l / l parallel to a damper h k (Delta l)': R = R_1 + h l R_1' (2.3)."""
    stretch_rate = dR1 * l / k  # of Delta l = l R_1 / k
    return R1 + h * k * stretch_rate


@dataclass(frozen=True)
class ElasticRod:
    """The elastic rod in physical quantities.

    ``law`` is R in terms of R_1 and R_1'; ``balance`` is the left minus the right side of the first equation of (2.4);
    ``acceleration`` is u'. ``dropped`` is the term neglected against 1 in cos(alpha + beta) / cos(alpha), and
    ``dropped_friction`` the term neglected in sin(alpha + beta) / sin(alpha). F is the friction force on M_1.
    """

    law: sp.Expr
    balance: sp.Expr
    acceleration: sp.Expr
    dropped: sp.Expr
    dropped_friction: sp.Expr

    def slip(self, direction: int) -> tuple[sp.Expr, sp.Expr]:
        """Return ``(balance, u')`` of (2.5) with F = -direction f |R| sin(alpha), R left as a symbol."""
        force = -direction * f * sp.Abs(R) * sp.sin(alpha)
        return self.balance.subs(F, force), self.acceleration.subs(F, force)

    def stick(self) -> sp.Expr:
        """Return the left side of (2.6): u = u' = 0 with F eliminated, R left as a symbol."""
        (holding,) = sp.solve(self.acceleration, F)
        return sp.expand(self.balance.subs(F, holding))


def elastic_rod(law: sp.Expr | None = None) -> "ElasticRod":
    r"""Derive (2.4) from Newton's law at alpha + beta, the small angle (2.2) and the rod's ``law`` (default (2.3)).

    With delta = l R_1 / (k cos(alpha)) from Hooke's law, m delta'' = P + F - 2 R cos(alpha + beta), and
    cos(alpha + beta) = cos(alpha) (1 - dropped + ...). Raises ``InputError`` for a law that is not a force, or that
    contains other symbols than R_1, R_1' and constants of known dimension.
    """
    law = kelvin_voigt() if law is None else expression("law", law)
    if dimension(law) != _FORCE or law.has(ddR1, R, F):
        raise InputError(f"the rod's law {law} must be a force in terms of R_1, R_1' and constants")
    return _elastic_rod(law)


@cache
def _elastic_rod(law):
    compression, turn = small_angle()
    (displacement,) = sp.solve(sp.Eq(R1, k * compression / l), delta)
    turned = force_balance(alpha + beta)
    relative = sp.expand(m * (turned[a1] - turned[a2]))
    second_order = m * displacement.subs(R1, ddR1)
    balance = second_order - relative.subs(beta, 0)
    angle = turn.subs(delta, displacement)
    return ElasticRod(law, balance, turned[a1].subs(beta, 0), _tangent(-_relative_change(sp.cos) * angle),
                      _tangent(_relative_change(sp.sin) * angle))


def _relative_change(function):
    return sp.diff(function(alpha + beta), beta).subs(beta, 0) / function(alpha)


def _tangent(expr):
    return sp.cancel(expr.subs(sp.sin(alpha), sp.tan(alpha) * sp.cos(alpha)))


@dataclass(frozen=True)
class Scales:
    """The scales of section 2: t = time tau, R_1 = reaction rho, u = velocity v, x_1 = length xi; and mu."""

    time: sp.Expr
    reaction: sp.Expr
    velocity: sp.Expr
    length: sp.Expr
    mu: sp.Expr


@cache
def find_scales(rod: "ElasticRod") -> "Scales":
    r"""Find the scales that make the equations canonical.

    In canonical form the load R cos(alpha) / P is rho + rho', and the force P contributes 1 to v'; mu is then the
    coefficient of rho''. A law that is not linear has this form near 0. Raises ``NotDerivable`` where no scales give
    this form, as for a law without damping.
    """
    time, reaction, velocity = sp.symbols("T_ R_ V_", positive=True)
    elastic, viscous = (rod.law.diff(rate).subs({R1: 0, dR1: 0}) for rate in (R1, dR1))
    canonical = (
        sp.Eq(elastic * reaction * sp.cos(alpha) / P, 1),
        sp.Eq(viscous * reaction / time * sp.cos(alpha) / P, 1),
        sp.Eq(rod.acceleration.subs({R: 0, F: 0}) * time / velocity, 1),
    )
    if not (solutions := sp.solve(canonical, (time, reaction, velocity), dict=True)):
        raise NotDerivable(
            f"the rod's law R = {rod.law}, with {elastic} R_1 + {viscous} Rdot_1 near 0, has no scales of time and "
            "force that make R cos(alpha)/P = rho + rho'; give a law with an elastic and a viscous part, both "
            "positive, such as R_1 + h l Rdot_1"
        )
    (found,) = solutions
    inertia = sp.diff(rod.balance, ddR1) * found[reaction] / (found[time] ** 2 * P)
    length = sp.cancel(found[velocity] * found[time])
    return Scales(found[time], found[reaction], found[velocity], length, sp.cancel(inertia))
