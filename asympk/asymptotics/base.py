r"""The base point of the fast fibre in closed form, where g is affine in the fast states and f a polynomial in them.

The corrections of the layer xi_k = X_k - S_k and eta_k = Y_k - H_k obey, with A = g_y(x_0) and D = d/dtau,

    D eta_0 = A eta_0,    D xi_k = [mu^(k-1)] (f - f on the slow motion),    D eta_k = A eta_k + R_k(tau, eta_0, ...).

Consider the polynomials in tau and the eta_k that vanish where all eta_k do. D maps this space into itself. Where A
attracts, D is one to one: on the monomials of given degrees in every eta_k, D is the linear map that A induces on these
monomials, plus monomials that come later in the order of their degrees. So xi_k is a polynomial. ``antiderivative``,
the hard method, finds it by linear algebra. The base point has the coefficients -xi_k(0) of mu^k, k > 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import sympy as sp

from asympk.asymptotics.fibre import Formulas, formulas
from asympk.asymptotics.landing import land
from asympk.asymptotics.series import Series
from asympk.asymptotics.taylor import Taylor, as_taylor, evaluated
from asympk.errors import NotDerivable, UnknownName
from asympk.numbers import known_order
from asympk.symbolic.expansion import fast_jacobian, is_zero
from asympk.symbolic.placing import place
from asympk.symbolic.system import System

HIGHEST_ORDER = 3
TAU = sp.Dummy("tau")


@dataclass(frozen=True)
class BasePoint:
    """The base point of the fast fibre through (x, y): the start of the slow motion that its layer approaches.

    ``states`` maps every slow state to a series in mu, whose coefficients are expressions in the symbols of the states;
    these stand for the start (x, y). ``states`` is None without a closed form. ``at`` gives numbers in all cases.
    """

    system: System
    order: int
    states: sp.Dict | None

    def __getitem__(self, state: sp.Symbol | str) -> Series:
        """Return the series of a slow state, by symbol or name.

        Raises ``NotDerivable`` where there is no closed form, ``UnknownName`` if ``state`` is no slow state.
        """
        if self.states is None:
            raise NotDerivable("a base point has a closed form where g is affine and f polynomial in the fast states, "
                               "with several of them to order 1; use .at(values, start) for numbers")  # fmt: skip
        found = {s.name: series for s, series in self.states.items()}
        if str(state) not in found:
            raise UnknownName(f"{state!s:.60} is not a slow state; the base point has {', '.join(found)}")
        return found[str(state)]

    def at(self, values: Mapping, start: Mapping, rtol: float = 1e-10) -> dict[str, tuple[float, ...]]:
        """Return {name: (c_0, ..., c_n)}, the coefficients in numbers, by integration along the layer to ``rtol``.

        Raises ``InputError``, and ``OutOfRange`` where the layer settles on no attracting branch.
        """
        placed, begins = place(self.system, {self.system.small: 1, **values}, start)
        numbers = {s: float(v) for s, v in zip(self.system.parameters, placed, strict=True) if s != self.system.small}
        slow = len(self.system.slow)
        known = formulas(self.system.modes[0], self.system.small, tuple(numbers), self.order)
        begin = tuple(map(float, begins))
        base = land(known, self.order, begin[:slow], begin[slow:], tuple(numbers.values()), rtol).base
        return {s.name: tuple(base[:, i].tolist()) for i, s in enumerate(self.system.slow)}


def base_point(system: System, order: int = 1) -> BasePoint:
    """Derive the ``BasePoint`` of a smooth slow-fast ``system`` to ``order``.

    The closed form exists where g is affine and f is a polynomial in the fast states, to order 3 with one fast state
    and to order 1 with several. ``BasePoint.at`` gives numbers to order 3 for any system.
    Raises ``OrderError``, and ``NotDerivable`` for a system that has no fast states, or whose layers do not settle.

    >>> x, y, mu = sp.symbols("x y mu")
    >>> print(base_point(System.smooth(slow={x: -x + y}, fast={y: x - 2*y}, small=mu))[x])
    (x) + (-(x - 2*y)/4) mu + O(mu^2)
    """
    order = known_order(order, HIGHEST_ORDER, "the base point is derived to orders")
    if system.small is None or len(system.modes) > 1 or system.time is not None:
        raise NotDerivable("a base point is that of one smooth mode with fast states and without an explicit time")
    if not _is_closed(system.modes[0], order):
        return BasePoint(system, order, None)
    _require_settling(system.modes[0], system.small)
    found = _Corrections(system.modes[0], system.small, order).base()
    slow = tuple(system.slow)
    states = {
        x: Series({(k, 0): c[i] for k, c in enumerate(found)}, (order + 1, 0), system.small) for i, x in enumerate(slow)
    }
    return BasePoint(system, order, states)


def _require_settling(mode, small):
    """Raise ``NotDerivable`` where no layer settles: an eigenvalue of g_y is 0, or their sum is not negative."""
    slopes = fast_jacobian(mode, small)
    if is_zero(slopes.det()):
        raise NotDerivable("g_y is singular everywhere: no layer settles on a slow manifold; give every fast state a "
                           "rate that depends on it")  # fmt: skip
    if slopes.trace().is_nonnegative:
        raise NotDerivable(f"g_y has the trace {slopes.trace()}: the slow manifold repels, and no layer settles on it")


def _is_closed(mode, order):
    fast = tuple(mode.fast)
    if len(fast) > 1 and order > 1:  # the expressions grow beyond use
        return False
    return all(g.is_polynomial(*fast) and sp.Poly(g, *fast).total_degree() <= 1 for g in mode.fast.values()) and all(
        f.is_polynomial(*fast) for f in mode.slow.values()
    )


class _Symbols:
    """The interface of a ``Tape``, which returns SymPy expressions instead of nodes."""

    def node(self, name):
        return sp.Symbol(name)

    def call(self, name, value):
        return getattr(sp, name)(value)


class _Corrections:
    """The corrections of a layer, polynomials in tau and the eta_k, level by level; ``rates`` is {eta_k: D eta_k}.

    Symbols stand for the slow motion: ``start`` for the terms of its base point, ``branch`` for the branch's value.
    """

    def __init__(self, mode, small, order):
        self.mode, self.small, self.order = mode, small, order
        self.slow, self.fast = tuple(mode.slow), tuple(mode.fast)
        n, m = len(self.slow), len(self.fast)
        self.start = [[sp.Symbol(f"v{i}_{k}") for i in range(n)] for k in range(1, order + 1)]
        self.branch = [sp.Symbol(f"v{n + i}_0") for i in range(m)]
        self.eta = [[sp.Symbol(f"e{i}_{k}") for i in range(m)] for k in range(order)]
        self.xi = [[sp.S.Zero] * n]
        self.motion, self.rates = self._slow_motion(), {}

    def base(self):
        """Return the coefficients of 1, mu, ..., mu^n of the base point, each a list over the slow states."""
        known = dict(zip(self.branch, self._critical(), strict=True))
        at_start, found = {TAU: 0}, [list(self.slow)]
        for k in range(self.order):
            heights = [self.motion[s][k].subs(TAU, 0) for s in self.fast]
            begin = self.fast if k == 0 else [0] * len(heights)
            at_start |= {e: s - c for e, s, c in zip(self.eta[k], begin, heights, strict=True)}
            self.rates |= dict(zip(self.eta[k], self._differences(self.mode.fast, k), strict=True))
            self.xi.append([self.antiderivative(rate) for rate in self._differences(self.mode.slow, k)])
            values = [-xi.subs(at_start, simultaneous=True).subs(known) for xi in self.xi[-1]]
            found.append([sp.factor(v) for v in values])
            known |= dict(zip(self.start[k], found[-1], strict=True))
        return found

    def _critical(self):
        """Return the fast states on the critical manifold."""
        force = sp.Matrix(list(self.mode.fast.values())).subs(self.small, 0)
        rest = force.subs(dict.fromkeys(self.fast, 0))
        return [sp.cancel(-c) for c in force.jacobian(self.fast).LUsolve(rest)]

    def antiderivative(self, expr):
        """Return the polynomial P with D P = ``expr`` in which every monomial contains an eta."""
        names = [e for level in reversed(self.eta) for e in level]
        rest, found = sp.Poly(expr, *names, TAU), sp.S.Zero
        while rest:
            degrees, terms = self._leading(rest)
            part = self._inverted(degrees, terms, names) * TAU ** degrees[-1]
            found += part
            rest = _reduced(rest - sp.Poly(self._derivative(part), *names, TAU))
        return found

    def _leading(self, poly):
        """Return the leading degrees, one for each level of eta and one for tau, and the terms of these degrees."""
        m, by_degrees = len(self.fast), {}
        for monomial, c in poly.terms():
            degrees = (*(sum(monomial[i : i + m]) for i in range(0, len(monomial) - 1, m)), monomial[-1])
            by_degrees.setdefault(degrees, {})[monomial[:-1]] = c
        leading = max(by_degrees)
        return leading, by_degrees[leading]

    def _inverted(self, degrees, terms, names):
        """Return the preimage of ``terms`` under the map that A induces on the monomials of ``degrees``."""
        monomials = [sum(parts, ()) for parts in product(*(_monomials(d, len(self.fast)) for d in degrees[:-1]))]
        exprs = [sp.Mul(*(e**p for e, p in zip(names, monomial, strict=True))) for monomial in monomials]
        columns = []
        for expr in exprs:
            image = sp.Poly(self._linear(expr), *names)
            columns.append([image.coeff_monomial(e) for e in exprs])
        right = sp.Matrix([terms.get(monomial, 0) for monomial in monomials])
        solved = sp.Matrix(columns).T.LUsolve(right)
        return sum(sp.cancel(c) * e for c, e in zip(solved, exprs, strict=True))

    def _linear(self, expr):
        """Return D of a monomial in the eta_k, with A eta_k alone in place of every D eta_k."""
        matrix = sp.Matrix([self.rates[e] for e in self.eta[0]]).jacobian(self.eta[0])
        return sp.expand(sum(
            expr.diff(e) * rate for level in self.eta if level[0] in self.rates
            for e, rate in zip(level, matrix * sp.Matrix(level), strict=True)
        ))  # fmt: skip

    def _derivative(self, expr):
        return sp.expand(expr.diff(TAU) + sum(expr.diff(e) * rate for e, rate in self.rates.items()))

    def _differences(self, rates, k):
        """Return the coefficient of mu^k in the rates on the motion less the same on the slow motion."""
        eta = [self.eta[j] if j < len(self.eta) else [0] * len(self.fast) for j in range(k + 1)]
        added = {s: [xi[i] for xi in self.xi[: k + 1]] for i, s in enumerate(self.slow)}
        added |= {s: [level[i] for level in eta] for i, s in enumerate(self.fast)}
        full = {s: [c + d for c, d in zip(self.motion[s], added[s], strict=False)] for s in added}
        both = [self._along(rates.values(), of, k) for of in (full, self.motion)]
        return [sp.expand(a - b) for a, b in zip(*both, strict=True)]

    def _along(self, exprs, series, k):
        values = {s: Taylor({(j, 0): c for j, c in enumerate(terms[: k + 1])}, k) for s, terms in series.items()}
        values |= {self.small: Taylor({(1, 0): 1} if k else {}, k)} | {p: p for p in self._parameters()}
        return [as_taylor(value, k)[k, 0] for value in evaluated(exprs, values, _Symbols())]

    def _slow_motion(self):
        """Return {state: [S_0, S_1, ...]}, polynomials in tau; for fast states [H_0, H_1, ...]."""
        field = Formulas(self.mode, self.small, (), self.order).field
        begin = [{(0, 0): s} | {(k, 0): v[i] for k, v in enumerate(self.start, 1)} for i, s in enumerate(self.slow)]
        x, y, _ = field.motion(_Symbols(), {p: p for p in self._parameters()}, begin, self.branch, self.order)
        return {
            s: [sum((c[m - j, j] * TAU**j for j in range(m + 1)), sp.S.Zero) for m in range(self.order + 1)]
            for s, c in zip((*self.slow, *self.fast), (*x, *y), strict=True)
        }

    def _parameters(self):
        rates = (*self.mode.slow.values(), *self.mode.fast.values())
        return set().union(*(r.free_symbols for r in rates)) - {*self.slow, *self.fast, self.small}


def _monomials(degree, count):
    """Return the exponents of the monomials of ``degree`` in ``count`` variables."""
    if count == 1:
        return [(degree,)]
    return [(first, *rest) for first in range(degree + 1) for rest in _monomials(degree - first, count - 1)]


def _reduced(poly):
    """Return the polynomial without the terms whose coefficients vanish when cancelled."""
    return sp.Poly.from_dict({m: c for m, c in ((m, sp.cancel(c)) for m, c in poly.terms()) if c != 0}, *poly.gens)
