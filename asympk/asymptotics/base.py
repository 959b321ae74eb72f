r"""The base point of the fast fibre in closed form, where g is affine in the fast states and f a polynomial in them.

With one fast state it is read off the layer in closed form (``affinelayer``), with SymPy expressions as coefficients.
With several, A = g_y(x_0), D = d/dtau and eta = Y_0 - H_0, the first correction xi = X_1 - S_1 of the layer obeys

    D eta = A eta,    D xi = f(x_0, H_0 + eta) - f(x_0, H_0).

D maps the polynomials in eta that vanish at eta = 0 into themselves. Where A attracts, D is one to one, and so xi is
such a polynomial. ``_correction`` finds it by linear algebra. The base point is x_0 - mu xi at tau = 0.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import sympy as sp

from asympk.asymptotics import affinelayer
from asympk.asymptotics.fibre import Formulas, formulas
from asympk.asymptotics.landing import land
from asympk.asymptotics.ratio import Ratios
from asympk.asymptotics.series import Series
from asympk.errors import AsympkError, NotDerivable, OutOfRange, UnknownName
from asympk.numbers import known_order, listed, number, reason_of, short
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic.expansion import fast_jacobian, is_zero, require_series, require_short, to_degree
from asympk.symbolic.long import atoms
from asympk.symbolic.placing import place, with_numbers_inside
from asympk.symbolic.sides import SWITCHING
from asympk.symbolic.system import System

HIGHEST_ORDER = 3
LEAST, LARGEST = 1e-13, 0.01  # bounds of the tolerance of the coefficients in numbers


@dataclass(frozen=True, repr=False)
class BasePoint(ShownAsFormulas):
    """The base point of the fast fibre through (x, y): the start of the slow motion that its layer approaches.

    ``states`` maps every slow state to a series in mu, whose coefficients are expressions in the symbols of the states;
    these stand for the start (x, y). ``states`` is None without a closed form. ``at`` gives numbers in all cases.
    """

    system: System
    order: int
    states: sp.Dict | None

    def _card(self) -> Card:
        open_form = (("", "no closed form; .at(values, start) gives numbers"),)
        known = open_form if self.states is None else tuple((s.name, series) for s, series in self.states.items())
        return Card(f"Base point to order {self.order} of the fast fibre through a start", known)

    def __getitem__(self, state: sp.Symbol | str) -> Series:
        """Return the series of a slow state, by symbol or name.

        Raises ``NotDerivable`` where there is no closed form, ``UnknownName`` if ``state`` is no slow state.
        """
        if self.states is None:
            raise NotDerivable("a base point has a closed form where g is affine and f polynomial in the fast states, "
                               "with several of them to order 1; use .at(values, start) for numbers")
        found = {s.name: series for s, series in self.states.items()}
        if str(state) not in found:
            raise UnknownName(f"{state!s:.60} is not a slow state; the base point has {', '.join(found)}")
        return found[str(state)]

    def at(self, values: Mapping, start: Mapping, rtol: float = 1e-10) -> dict[str, tuple[float, ...]]:
        """Return {name: (c_0, ..., c_n)}, the coefficients in numbers, by integration along the layer to ``rtol``.

        ``values`` may contain the small parameter, as those of a scene do; the coefficients do not depend on it. Raises
        ``InputError``, also unless ``LEAST`` <= ``rtol`` <= ``LARGEST``, and ``OutOfRange`` where the layer settles on
        no attracting branch or has no finite value.
        """
        small = self.system.small
        lacks_small = isinstance(values, Mapping) and str(small) not in map(str, values)
        placed, begins = place(self.system, {small: 1, **values} if lacks_small else values, start)
        system, others = with_numbers_inside(self.system, placed)
        numbers = {s: float(v) for s, v in zip(system.parameters, others, strict=True) if s != small}
        slow, allowed = len(self.system.slow), f"from {LEAST:g} to {LARGEST:g}"
        tolerance = float(number("rtol", rtol, lambda v: LEAST <= v <= LARGEST, allowed))
        known = formulas(system.modes[0], small, tuple(numbers))
        begin = tuple(map(float, begins))
        try:
            base = land(known, self.order, begin[:slow], begin[slow:], tuple(numbers.values()), tolerance).base
        except AsympkError:
            raise
        except (ArithmeticError, ValueError) as reason:
            raise OutOfRange(f"the layer from {listed((s.name for s in system.states), begins)} has no finite value "
                             f"({reason_of(reason)})") from None
        return {s.name: tuple(base[:, i].tolist()) for i, s in enumerate(self.system.slow)}


def base_point(system: System, order: int = 1) -> BasePoint:
    """Derive the ``BasePoint`` of a smooth slow-fast ``system`` to ``order``.

    The closed form exists where g is affine and f is a polynomial in the fast states, to order 3 with one fast state
    and to order 1 with several. ``BasePoint.at`` gives numbers to order 3 for any system.
    Raises ``OrderError``, and ``NotDerivable`` for a system without fast states, with rates that switch, or with layers
    that do not settle.

    >>> x, y, mu = sp.symbols("x y mu")
    >>> print(base_point(System.smooth(slow={x: -x + y}, fast={y: x - 2*y}, small=mu))[x])
    (x) + (-(x - 2*y)/4) mu + O(mu^2)
    """
    order = known_order(order, HIGHEST_ORDER, "the base point is derived to orders")
    if system.small is None or len(system.modes) > 1 or system.time is not None:
        raise NotDerivable("a base point is that of one smooth mode with fast states and without an explicit time; "
                           "solve(scene, method='jump') follows any slow-fast system")
    if switching := atoms(sp.Tuple(*system.rates.values()), sp.Piecewise, *SWITCHING):
        raise NotDerivable(f"the rates switch, by {short(max(switching, key=str))}: a base point is that of one smooth "
                           "mode; write one side of it, or use solve(scene, method='jump'), which knows all sides")
    require_short(system.modes[0])
    require_series(system.modes[0], system.small, order)
    slow, fast = (to_degree(rates, system.small, order) for rates in (system.modes[0].slow, system.modes[0].fast))
    mode, several = replace(system.modes[0], slow=slow, fast=fast), len(system.fast) > 1
    if (several and order > 1) or not affinelayer.is_affine(mode):  # the expressions grow beyond use
        return BasePoint(system, order, None)
    _require_settling(mode, system.small)
    closed = _of_fast_states if several else _of_one_fast_state
    found = closed(mode, system.small, order).items()
    plain = {x: [sp.factor(c.rewrite(sp.exp, sp.Pow)) for c in (x, *terms)] for x, terms in found}
    return BasePoint(system, order, {
        x: Series({(k, 0): c for k, c in enumerate(terms)}, (order + 1, 0), system.small) for x, terms in plain.items()
    })


def _require_settling(mode, small):
    """Raise ``NotDerivable`` where no layer settles: an eigenvalue of g_y is 0, or their sum is not negative."""
    slopes = fast_jacobian(mode, small)
    if is_zero(slopes.det()):
        raise NotDerivable("g_y is singular everywhere: no layer settles on a slow manifold; give every fast state a "
                           "rate that depends on it")
    if slopes.trace().is_nonnegative:
        raise NotDerivable(f"g_y has the trace {slopes.trace()}, and so an eigenvalue whose real part is not negative: "
                           "no layer settles on the slow manifold")


def _of_one_fast_state(mode, small, order):
    """Return {slow state: the coefficients of mu, ..., mu^order of the base point}.

    The layer depends on the rates by their Taylor coefficients at (x_0, h), h the branch there, which are names until
    the end: with these eta = Y_0 - h is the one term eta_0 E.
    """
    rate, height, named = sp.Dummy("a"), sp.Dummy("h"), dict[sp.Symbol, sp.Expr]()
    ((y, force),), (slope,) = mode.fast.items(), fast_jacobian(mode, small)
    slow, fast = (sp.Dict({s: _expanded(r, height, mode, small, order, named) for s, r in rates.items()})
                  for rates in (mode.slow, mode.fast))
    start = dict.fromkeys((*mode.slow, y), 0)
    fast = sp.Dict({y: fast[y] - fast[y].subs({small: 0, **start})})  # g vanishes on the branch
    known, exact = Formulas(replace(mode, slow=slow, fast=fast), small, ()), Ratios((*named, y, rate))
    found = affinelayer.layer_coefficients(known, (order, order - 1), None, {s: exact(s) for s in named},
                                           start | {y: exact(y)}, exact(rate))
    branch = sp.cancel(-force.subs({small: 0, y: 0}) / slope)
    given = {name: value.xreplace({height: branch}) for name, value in named.items()}
    given |= {rate: slope, y: y - branch}
    return {x: [exact.expr(found[x][k, 0].terms[0, 0]).xreplace(given) for k in range(1, order + 1)] for x in mode.slow}


def _expanded(rate, height, mode, small, order, named):
    """Return the Taylor polynomial of a rate in mu and in the changes of the states, of y from ``height``.

    The changes have the symbols of the states. Of the coefficients, rational numbers stay, and the others become names;
    ``named`` collects what these stand for.
    """
    (y,), at, found = mode.fast, (*mode.slow, small), sp.S.Zero
    for (power,), c in sp.Poly(rate.subs(y, height + y), y).terms():
        for part in sp.itermonomials(at, order):
            powers = [sp.degree(part, s) for s in at]
            value = sp.diff(c, *zip(at, powers, strict=True)).subs(small, 0) / math.prod(map(math.factorial, powers))
            name = value if value.is_Rational else sp.Dummy("c")
            named |= {} if value.is_Rational else {name: value}
            found += name * part * y**power
    return found


def _of_fast_states(mode, small, order):
    """Return the same for several fast states, to ``order`` 0 or 1."""
    fast = tuple(mode.fast)
    force = sp.Matrix(list(mode.fast.values())).subs(small, 0)
    matrix = force.jacobian(fast)
    branch = [sp.cancel(-c) for c in matrix.LUsolve(force.subs(dict.fromkeys(fast, 0)))]
    eta, heights = ([sp.Dummy(f"{name}{i}") for i in range(len(fast))] for name in ("eta", "h"))
    moved = {y: h + e for y, h, e in zip(fast, heights, eta, strict=True)}
    at_start = {e: y - h for y, h, e in zip(fast, heights, eta, strict=True)}
    known = dict(zip(heights, branch, strict=True))
    found = {}
    for x, rate in mode.slow.items():
        rate = sp.Poly(rate.subs(small, 0).subs(moved, simultaneous=True), *eta)
        found[x] = [-_correction(rate, matrix).subs(at_start).subs(known)] * order
    return found


def _correction(rate, matrix):
    """Return the polynomial P in eta, 0 at eta = 0, with D P = ``rate`` less its value at eta = 0."""
    eta, found = rate.gens, sp.S.Zero
    motion = [sp.Poly(r, *eta) for r in matrix * sp.Matrix(eta)]
    for degree in range(1, rate.total_degree() + 1):  # D keeps the degree
        monomials = sorted(sp.itermonomials(eta, degree, degree), key=str)
        images = [sum(sp.Poly(m, *eta).diff(e) * r for e, r in zip(eta, motion, strict=True)) for m in monomials]
        columns = sp.Matrix([[image.coeff_monomial(m) for m in monomials] for image in images])
        solved = columns.T.LUsolve(sp.Matrix([rate.coeff_monomial(m) for m in monomials]))
        found += sum(sp.cancel(c) * m for c, m in zip(solved, monomials, strict=True))
    return found
