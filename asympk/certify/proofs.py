r"""Inequalities among the claims, proven in ball arithmetic on boxes of parameters.

Each inequality states the sign of an expression that the package has derived: coefficients of a characteristic
polynomial (Hurwitz), the load on a critical manifold, the rate of the velocity there, the leading coefficient of the
friction cone and the order of its roots. ``inequalities`` lists them. ``prove`` halves a box until the sign is certain
on every piece; then the inequality holds at every point of the box.
"""

from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from asympk.certify.balls import ball_of, certain_sign, hull, precision
from asympk.errors import NotDerivable
from asympk.scene import MANIFOLDS
from asympk.symbolic.manifold import slow_manifolds
from asympk.symbolic.stability import LAMBDA, eigenvalues
from asympk.symbolic.stick import drive_of_load, stick_regions
from asympk.systems.painleve_klein import mu, sigma, sigma0, system

_TINY, _LARGE = Fraction(1, 10**6), Fraction(10**6)
STEEP, SHALLOW, ANY = (_TINY, _LARGE), (-2 + _TINY, -_TINY), (-2 + _TINY, _LARGE)
MU = (Fraction(1, 10**9), Fraction(10**3))
_MOST_PIECES = 4000
_BITS = 128


@dataclass(frozen=True)
class Inequality:
    """The id of a claim, its statement, expressions that must all be positive, and the box of parameters."""

    claim: str
    statement: str
    positive: tuple
    box: dict


@dataclass(frozen=True)
class Proof:
    """Whether an ``Inequality`` is proven on its whole box, and on how many pieces."""

    inequality: Inequality
    proven: bool
    pieces: int


def inequalities() -> tuple[Inequality, ...]:
    """Return the claims that are inequalities in the parameters, as expressions of the derived system."""
    pk = system()
    spectrum = {e.mode: sp.Poly(e.polynomial, LAMBDA).all_coeffs() for e in eigenvalues(pk)}
    load = {m.name: sp.cancel(pk.frictions[0].load.subs(m.branch)) for m in slow_manifolds(pk, order=1)}
    s, _ = drive_of_load(pk)
    rate = {name: sp.cancel(_velocity_rate(pk, mode, s).subs(s, load[name])) for name, (mode, _) in MANIFOLDS.items()}
    inertia, damping, stiffness = spectrum["slip_opposite"]
    leading, low, high = _cone(pk)
    return (
        Inequality("C19", "Pi1 is stable", tuple(spectrum["slip_same"]), {sigma: ANY, mu: MU}),
        Inequality("C22", "Pi2 is a saddle on a steep rod", (inertia, -stiffness), {sigma: STEEP, mu: MU}),
        Inequality("C29", "Pi2 is stable on a shallow rod", (inertia, damping, stiffness), {sigma: SHALLOW, mu: MU}),
        Inequality("C16", "the slow motion of stick is stable", tuple(spectrum["stick"]), {mu: MU}),
        Inequality("C31", "no slow plane in z < 0 on a steep rod: slip_same there needs s < 0, slip_opposite s > 0",
                   (load["Pi1"], -load["Pi2"]), {sigma: STEEP}),
        Inequality("C29", "Pi2 lies in z < 0 on a shallow rod", (load["Pi2"],), {sigma: SHALLOW}),
        Inequality("C27", "on Pi1 the velocity grows", (rate["Pi1"],), {sigma: ANY}),
        Inequality("C30", "on Pi2 the velocity heads for z = 0, from above on a steep rod", (-rate["Pi2"],),
                   {sigma: STEEP}),
        Inequality("C30", "on Pi2 the velocity heads for z = 0, from below on a shallow rod", (rate["Pi2"],),
                   {sigma: SHALLOW}),
        Inequality("C16", "for sigma0 > -1 it sticks outside two edges of opposite sign", (leading, high, -low),
                   {sigma0: (-1 + _TINY, _LARGE)}),
        Inequality("C16", "for sigma0 < -1 it sticks between two positive edges", (-leading, high, low - high),
                   {sigma0: (-2 + _TINY, -1 - _TINY)}),
    )


def _velocity_rate(pk, mode, s):
    """Return z' of a mode in terms of the load s alone."""
    field = pk.mode(mode)
    load = pk.friction.load
    state = min(load.free_symbols, key=str)
    (solved,) = sp.solve(load - s, state)
    return sp.expand(field.slow[pk.friction.velocity].subs(state, solved))


def _cone(pk):
    """Return the leading coefficient of Q(s) = (static s)^2 - drive^2 and its roots; the mass sticks where Q >= 0."""
    load, drive = drive_of_load(pk)
    cone = sp.Poly((pk.friction.static * load) ** 2 - drive**2, load)
    high, low = stick_regions(pk).edges
    rest = sp.cancel(cone.as_expr() - cone.LC() * (load - high) * (load - low))
    if rest != 0:
        raise NotDerivable(f"the edges {high}, {low} are not the roots of the friction cone {cone.as_expr()}")
    return sp.factor(cone.LC()), low, high


def prove(inequality: Inequality) -> Proof:
    """Return the ``Proof`` of an inequality, halving its box into at most ``_MOST_PIECES`` pieces per expression."""
    with precision(_BITS):
        pieces = [_pieces(expr, inequality.box) for expr in inequality.positive]
    return Proof(inequality, None not in pieces, sum(n or _MOST_PIECES for n in pieces))


def _pieces(expr, box):
    """Return the number of pieces of the box on which ``expr`` is proven positive, or None if a piece fails."""
    todo, pieces = [{symbol: ends for symbol, ends in box.items() if symbol in expr.free_symbols}], 0
    while todo:
        piece = todo.pop()
        pieces += 1
        found = certain_sign(ball_of(expr, {symbol: hull(*ends) for symbol, ends in piece.items()}))
        if found < 0 or pieces > _MOST_PIECES or not (found or piece):
            return None
        if not found:
            todo += _halves(piece)
    return pieces


def _halves(box):
    """Halve the side that is longest relative to the sum of its ends' sizes, which suits ranges of many decades."""
    symbol = max(box, key=lambda s: (box[s][1] - box[s][0]) / (abs(box[s][0]) + abs(box[s][1])))
    low, high = box[symbol]
    middle = _middle(low, high)
    return [{**box, symbol: (low, middle)}, {**box, symbol: (middle, high)}]


def _middle(low, high):
    if low > 0 and high > 4 * low:
        return Fraction((float(low) * float(high)) ** 0.5)
    return -_middle(-high, -low) if high < 0 and low < 4 * high else (low + high) / 2
