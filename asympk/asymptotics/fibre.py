r"""The fast fibre of a smooth slow-fast system, compiled: its layer, and the slow motion from its base point.

In the fast time tau = t/mu the motion from (x_0, y_0) is X_0 + mu X_1 + ..., Y_0 + mu Y_1 + ... with X_0 = x_0 and

    Y_0' = g(x_0, Y_0, 0),    X_k' = [mu^(k-1)] f(X, Y, mu),    Y_k' = [mu^k] g(X, Y, mu).

Where Y_0 tends to an attracting branch b = h_0(x_0), X_k and Y_k tend to polynomials S_k and H_k in tau. S_k and H_k
are the coefficients of the slow motion x' = F(x, mu), y = h(x, mu) in powers of mu at fixed tau. The base point of the
fibre is S(0). The slow motion is the Taylor series in mu and t that solves x' = f, mu y' = g term by term,

    (j + 1) x_(k,j+1) = f_kj,    (j + 1) y_(k-1,j+1) = g_kj,    S_m = sum_(k+j=m) x_kj tau^j.

The second equation is linear in y_kj and gives it, so that no derivative of h is needed. ``Formulas``
derives each compiled function once, on a ``Tape``; its hard method is ``_motion``, this recursion.
"""

import cmath
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache, cached_property, lru_cache
from importlib import import_module
from itertools import chain, product
from typing import Any

import numpy as np
import sympy as sp

from asympk.asymptotics.tape import Tape
from asympk.errors import InputError
from asympk.symbolic.expansion import fast_jacobian, is_singular, regular, require_series
from asympk.symbolic.long import atoms
from asympk.symbolic.sides import SWITCHING
from asympk.symbolic.system import Mode
from asympk.symbolic.taylor import CHOICES, CONSTANTS, FUNCTIONS, Taylor, as_taylor, evaluated, with_removables

BOUNDED = (sp.log, sp.asin, sp.acos, sp.acosh, sp.atanh)  # besides powers, what is real on a part of the line alone


class Formulas:
    """One smooth mode as compiled functions: x the slow states, y the fast ones, b the branch's value.

    Every argument is one number: x, y, b and the parameters p stand for as many arguments as they have components. A
    series to order n is X_0, Y_0, X_1, Y_1, ..., X_n, Y_n, state by state.

    1. ``layer(n)(series, p)`` returns the derivatives of the series by tau, without X_0', which is 0.
    2. ``slow(n)(x, b, X_1, ..., X_n, p)`` returns S_0, ..., S_n, H_0, ..., H_n, each as (state, power of tau).
    3. ``flow(n)(x, b, mu, p)`` returns x' and b' on the manifold to order n; ``height(n)`` of the same returns y. With
       ``whole`` these are f and the root of g near that y, with all powers of mu: terms beyond mu^n change as well.
       Quotients such as sin(mu)/mu, which are singular at mu = 0 by their form alone, are still expanded.
       ``terms(n)`` of the same returns what mu^0, ..., mu^n each add to y, x' and b'.
    4. ``slow_rates(x, b, mu, p)`` returns d log|det g_y| / dt on the manifold to order 0, and the matrices -h_x f_y and
       -h_x f_x f_y by columns. ``departure`` of the same returns the matrix D = g_y - mu h_x f_y on the manifold to
       order 1, by rows: a small departure from the manifold changes by mu (y - h)' = D (y - h).
    5. ``force(x, y, p)`` returns g at mu = 0, and ``jacobian(x, y, p)`` returns g_y at mu = 0 by rows; ``attraction``
       of the arguments of 3 returns g_y there on the manifold to order 0.
    6. ``series(n)`` is (definitions, coefficients): auxiliary symbols, each defined by those before it, and in them the
       coefficients of 1, mu, ..., mu^n of y on the manifold, order by order. The symbols of fast states stand for b.

    Functions 3, 4 and 6 do without b and b' where g is affine in y at mu = 0: there b = -g_y^-1 g(x, 0, 0).
    ``on_branch`` gives the arguments (x, b), or x alone, accordingly.

    ``arrays`` holds the same functions for arrays that broadcast, ``complexes`` for complex numbers. ``InputError`` is
    raised for a function that has no series here.
    """

    def __init__(self, mode: Mode, small: sp.Symbol, parameters: tuple[sp.Symbol, ...], target: str = "math"):
        self.mode, self.small, self.parameters = mode, small, parameters
        self.slow_states, self.fast_states, self.states = tuple(mode.slow), tuple(mode.fast), (*mode.slow, *mode.fast)
        self.drift, self.full_force = ([with_removables(rate, self.states) for rate in rates.values()]
                                       for rates in (mode.slow, mode.fast))
        for state, rate in (*mode.slow.items(), *mode.fast.items()):
            if switching := rate.atoms(sp.Piecewise, *SWITCHING):
                raise InputError(f"the rate of {state} switches too often, by {max(switching, key=str)!s:.60}, to "
                                 "have a series on every side; use an exact method")
        self.formal = {rate for rate in (*self.drift, *self.full_force) if is_singular(rate, small)}
        drift, force = (self.to_degree(rates, 0) for rates in (self.drift, self.full_force))
        slow, fast = (sp.Dict(dict(zip(*both, strict=True))) for both in ((mode.slow, drift), (mode.fast, force)))
        limit = replace(mode, slow=slow, fast=fast)
        require_series(limit, small)
        self.limit_drift, self.limit = ([f.subs(small, 0) for f in rates] for rates in (drift, force))
        self.slopes = fast_jacobian(limit, small)
        self.affine = not any(e.has(*self.fast_states) for e in self.slopes)
        self.turning = any(e.has(*self.states) for e in self.slopes)
        bounded = {f for e in self.limit for f in atoms(e, sp.Pow, *BOUNDED)
                   if f.has(*self.states) and not (f.is_Pow and (f.exp.is_integer or f.base.is_positive))}
        self.bounded = self.affine and bool(bounded)  # the branch may end, of which slow motion need not feel anything
        self.clocked = any(rate == 1 for rate in self.drift)  # a state that is a clock may drive the motion
        self.names = {p: f"p{i}" for i, p in enumerate(parameters)}
        self.functions = _functions(target)
        self.layer, self.slow, self.series, self.terms = map(
            cache, (self._layer, self._slow, self._series, self._terms))
        manifold = cache(self._manifold)
        self.flow, self.height = (cache(lambda n, whole=False, k=k: manifold(n, whole)[k]) for k in (0, 1))

    @cached_property
    def arrays(self) -> "Formulas":
        return formulas(self.mode, self.small, self.parameters, "numpy")

    @cached_property
    def complexes(self) -> "Formulas":
        return formulas(self.mode, self.small, self.parameters, "cmath")

    @cached_property
    def force(self) -> Callable[..., tuple]:
        return self._at_point(self.limit)

    @cached_property
    def jacobian(self) -> Callable[..., tuple]:
        return self._at_point(self.slopes)

    def on_branch(self, x: Sequence[float], b: Sequence[float]) -> tuple[float, ...]:
        """Return the arguments x, and b where needed, of ``flow``, ``height``, ``slow_rates`` and ``departure``."""
        return (*x,) if self.affine else (*x, *b)

    def tape(self, *inputs: str) -> tuple[Tape, dict[sp.Symbol, Any]]:
        """Return a tape with ``inputs`` and the parameters as inputs, and {parameter: node}."""
        tape = Tape(*inputs, *self.names.values())
        return tape, {p: tape.node(name) for p, name in self.names.items()}

    def to_degree(self, exprs: Iterable[sp.Expr], degree: int) -> list[sp.Expr]:
        """Return rates with Taylor polynomials in mu for quotients such as sin(mu)/mu; other expressions unchanged."""
        return [regular(e, self.small, degree) if e in self.formal else e for e in exprs]

    def _layer(self, order):
        names = [[f"v{i}_{k}" for i in range(len(self.states))] for k in range(order + 1)]
        tape, values = self.tape(*(name for level in names for name in level))
        for i, s in enumerate(self.states):
            values[s] = Taylor({(k, 0): tape.node(level[i]) for k, level in enumerate(names)}, order)
        values[self.small] = _small(order)
        drift, force = (self._along(rates, values, tape, order) for rates in (self.drift, self.full_force))
        rates = [g[0, 0] for g in force]
        for k in range(1, order + 1):
            rates += [*(f[k - 1, 0] for f in drift), *(g[k, 0] for g in force)]
        return tape.function(tuple(rates), self.functions)

    def _slow(self, order):
        n = len(self.slow_states)
        inputs = [f"v{i}_0" for i in range(len(self.states))]
        inputs += [f"v{i}_{k}" for k in range(1, order + 1) for i in range(n)]
        tape, values = self.tape(*inputs)
        start = [{(k, 0): tape.node(f"v{i}_{k}") for k in range(order + 1)} for i in range(n)]
        branch = [tape.node(f"v{n + i}_0") for i in range(len(self.fast_states))]
        *motion, _ = self._motion(tape, values, start, branch, order)
        levels = (([c[m - j, j] for j in range(m + 1)] for c in series) for series in motion for m in range(order + 1))
        return tape.function(tuple(tuple(map(tuple, level)) for level in levels), self.functions)

    def _manifold(self, order, whole):
        """Compile two functions on the manifold to ``order``: the rates of x and of the branch's value, and y."""
        tape, values, drift, y = self._at_rest(order)
        height, rates = ([_polynomial(c, order, tape) for c in series] for series in (y, drift))
        if whole:
            point = _first(values) | {self.small: tape.node("mu")} | dict(zip(self.fast_states, height, strict=True))
            moved = (Taylor({(k + 1, 0): -1 * c[k, 1] for k in range(order)}, order) for c in y)
            on_branch = evaluated(self.limit, _first(values), tape)  # 0 but for an error of b, which stays as it is
            force = zip(self._along(self.full_force, point, tape, order, 2 * order), moved, on_branch, strict=True)
            off = _product(self._inverse(values, tape), [_polynomial(g + m, order, tape) - c for g, m, c in force])
            height = [h - d for h, d in zip(height, off, strict=True)]
            point |= dict(zip(self.fast_states, height, strict=True))
            drift = self._along(self.drift, point, tape, order, 2 * order)
            rates = [_polynomial(f, order, tape) for f in drift]
        if not self.affine:
            rates += self._followed(rates, values, tape)
        return [tape.function(tuple(result), self.functions) for result in (rates, height)]

    def _terms(self, order):
        tape, values, drift, y = self._at_rest(order)
        found, power = [], 1
        for k in range(order + 1):
            rates = [f[k, 0] for f in drift]
            if not self.affine:
                rates += self._followed(rates, values, tape)
            found.append(tuple(power * c for c in (*(c[k, 0] for c in y), *rates)))
            power = power * tape.node("mu")
        return tape.function(tuple(found), self.functions)

    def _series(self, order):
        """Return the definitions of auxiliary symbols, and the coefficients of the manifold in them."""
        tape, _, _, y = self._at_rest(order)
        functions = {f: getattr(sp, f) for f in (*FUNCTIONS, *map(str, CONSTANTS))}
        functions |= {"outside": lambda u, _: u, "chosen": lambda *given: given[-1]}  # the quotient itself
        states = self.slow_states if self.affine else self.states
        inputs = (*states, self.small, *self.names)
        return tape.definitions(tuple(c[k, 0] for k in range(order + 1) for c in y), functions, inputs)

    @cached_property
    def slow_rates(self) -> Callable[..., tuple]:
        """Compile the logarithmic rate of det g_y along the slow motion at mu = 0, -h_x f_y and -h_x f_x f_y."""
        tape, values, _, _ = self._at_rest(1)
        turned = [c[0, 1] for c in self._along(self.slopes.T, values, tape, 1)]
        point, inverse = _first(values), self._inverse(values, tape)
        pushes = self._pushes(point, tape)
        again = [self._moved(self.limit_drift, point, push, tape) for push in pushes]
        once, twice = (self._across(columns, values, tape) for columns in (pushes, again))
        turning = sum(a * b for a, b in zip(chain(*inverse), turned, strict=True))  # the trace of g_y^-1 d(g_y)/dt
        return tape.function((turning, tuple(chain(*once)), tuple(chain(*twice))), self.functions)

    @cached_property
    def attraction(self) -> Callable[..., tuple]:
        tape, values, _, _ = self._at_rest(0)
        return tape.function(tuple(evaluated(self.slopes, _first(values), tape)), self.functions)

    @cached_property
    def departure(self) -> Callable[..., tuple]:
        """Compile g_y - mu h_x f_y on the manifold to order 1."""
        tape, values, _, _ = self._at_rest(1)
        slopes = sp.Matrix(self.to_degree(self.full_force, 1)).jacobian(self.fast_states)
        entries = [_polynomial(c, 1, tape) for c in self._along(slopes, values, tape, 1)]
        columns = self._across(self._pushes(_first(values), tape), values, tape)
        moved = (tape.node("mu") * c for c in chain(*zip(*columns, strict=True)))
        return tape.function(tuple(a + b for a, b in zip(entries, moved, strict=True)), self.functions)

    def _pushes(self, point, tape):
        """Return f_y at mu = 0 by columns."""
        return [evaluated([f.diff(y) for f in self.limit_drift], point, tape) for y in self.fast_states]

    def _across(self, columns, values, tape):
        """Return -h_x c at mu = 0 for columns c."""
        point, inverse = _first(values), self._inverse(values, tape)
        return [_product(inverse, self._moved(self.limit, point, column, tape)) for column in columns]

    def _followed(self, rates, values, tape):
        """Return the rates of the branch's value for ``rates`` of the slow states."""
        return [-1 * c for column in self._across([rates], values, tape) for c in column]

    def _at_point(self, exprs):
        tape, values = self.tape(*(f"v{i}_0" for i in range(len(self.states))))
        values |= {s: tape.node(f"v{i}_0") for i, s in enumerate(self.states)}
        return tape.function(tuple(evaluated(exprs, values, tape)), self.functions)

    def _at_rest(self, order):
        """Return a tape for (x, b, mu), {symbol: value on the tape}, and x' and y of the slow motion as series."""
        n, carried = len(self.slow_states), 0 if self.affine else len(self.fast_states)
        names = [f"v{i}_0" for i in range(n + carried)]
        tape, values = self.tape(*names, "mu")
        x = [tape.node(name) for name in names[:n]]
        branch = [tape.node(name) for name in names[n:]] or self._branch(tape, values, x)
        _, y, drift = self._motion(tape, values, [{(0, 0): node} for node in x], branch, order)
        return tape, values, drift, y

    def _branch(self, tape, values, x):
        """Return the branch's value at x where g is affine in the fast states."""
        point = values | dict(zip(self.slow_states, x, strict=True)) | dict.fromkeys(self.fast_states, 0)
        force = evaluated(self.limit, point, tape)
        return [-1 * c for c in _product(self._inverse(point, tape), force)]

    def _motion(self, tape, values, start, branch, order):
        """Return x, y and x' of the slow motion as series in mu and t; ``start`` gives the terms of x at t = 0."""
        x = [{index: c for index, c in terms.items() if sum(index) <= order} for terms in start]
        y = [{(0, 0): c} for c in branch]
        self._put(values, x, y, order)
        inverse = self._inverse(values, tape)
        for degree in range(1, order + 1):
            for terms, f in zip(x, self._along(self.drift, values, tape, degree - 1), strict=True):
                terms |= {(degree - j, j): f[degree - j, j - 1] * Fraction(1, j) for j in range(1, degree + 1)}
            self._put(values, x, y, order)
            force = self._along(self.full_force, values, tape, degree)  # the unknown y of this degree left out
            for k in range(degree + 1):
                rates = [c.get((k - 1, degree - k + 1), 0) * (degree - k + 1) for c in y]
                rest = [rate - g[k, degree - k] for rate, g in zip(rates, force, strict=True)]
                for terms, c in zip(y, _product(inverse, rest), strict=True):
                    terms[k, degree - k] = c
            self._put(values, x, y, order)
        drift = self._along(self.drift, values, tape, order)
        return [Taylor(c, order) for c in x], [Taylor(c, order) for c in y], drift

    def _put(self, values, x, y, order):
        values |= {s: Taylor(dict(c), order) for s, c in zip(self.states, [*x, *y], strict=True)}
        values[self.small] = _small(order)

    def _along(self, exprs, values, tape, degree, formal=None):
        """Return the series of expressions to a degree; quotients that are singular by their form are to ``formal``."""
        cut = {s: v.cut(degree) if isinstance(v, Taylor) else v for s, v in values.items()}
        return [as_taylor(value, degree) for value in evaluated(self.to_degree(exprs, formal or degree), cut, tape)]

    def _moved(self, exprs, point, rates, tape):
        """Return the rates of expressions at a point whose slow states have ``rates``."""
        moved = {s: Taylor({(0, 0): point[s], (0, 1): c}, 1) for s, c in zip(self.slow_states, rates, strict=True)}
        return [f[0, 1] for f in self._along(exprs, point | moved, tape, 1)]

    def _inverse(self, values, tape):
        """Return g_y^-1 at the start, by cofactors: pivoting would compare numbers, which a tape cannot."""
        found, size = evaluated(self.slopes, _first(values), tape), self.slopes.cols
        entries = [found[k : k + size] for k in range(0, len(found), size)]
        minors = _minors(entries)
        adjugate = [[minor * (-1) ** (i + j) for i, minor in enumerate(column)] for j, column in enumerate(minors)]
        determinant = sum(c * row[0] for c, row in zip(entries[0], adjugate, strict=True))
        return [[c * (Fraction(1) / determinant) for c in row] for row in adjugate]


def _functions(target):
    """Return {name: function or constant} of ``"math"``, ``"cmath"`` or ``"numpy"``."""
    module = import_module(target)
    known = {f: getattr(module, f, _OTHERWISE.get(f)) for f in FUNCTIONS} | {str(c): float(c) for c in CONSTANTS}
    return known | (_CHOICES_OF_ARRAYS if target == "numpy" else CHOICES)


def _erf(value):
    from scipy.special import erf

    return erf(value)


_CHOICES_OF_ARRAYS = {
    "outside": lambda u, end: np.where(np.abs(u) < end, end, u),
    "chosen": lambda u, end, inside, outside: np.where(np.abs(u) < end, inside, outside),
}
_OTHERWISE = {"erf": _erf, "atan2": lambda y, x: -1j * cmath.log((x + 1j * y) / cmath.sqrt(x * x + y * y))}


def _first(values):
    """Return the values, series among them, at mu = 0 and t = 0."""
    return {s: v[0, 0] if isinstance(v, Taylor) else v for s, v in values.items()}


def _small(order):
    return Taylor({(1, 0): 1} if order else {}, order)


def _polynomial(series, order, tape):
    """Return the sum of the coefficients of mu**k times mu**k, by Horner's scheme."""
    total = series[order, 0]
    for k in reversed(range(order)):
        total = total * tape.node("mu") + series[k, 0]
    return total


def _minors(matrix):
    """Return the minors of a square matrix without row i and column j: for each j a list over i.

    The rows are taken one after the other, with the minors of all that were taken, by their columns, in one table.
    """
    size = len(matrix)
    found = [[0] * size for _ in matrix]
    for i in range(size):
        table: dict[tuple, Any] = {(): 1}
        for row in (*matrix[:i], *matrix[i + 1 :]):
            longer: dict[tuple, Any] = {}
            for (columns, minor), (j, c) in product(table.items(), enumerate(row)):
                if j not in columns and not (isinstance(c, int) and c == 0):
                    key = tuple(sorted((*columns, j)))
                    longer[key] = longer.get(key, 0) + minor * c * (-1) ** sum(k > j for k in columns)
            table = longer
        for columns, minor in table.items():
            found[sum(range(size)) - sum(columns)][i] = minor
    return found


def _product(matrix, vector):
    return [sum((a * b for a, b in zip(row, vector, strict=True)), 0) for row in matrix]


formulas = lru_cache(maxsize=64)(Formulas)
