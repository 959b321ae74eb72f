r"""The layer in closed form where g is affine in the one fast state y and f is a polynomial in it.

With a = g_y(x_0) every term of the layer's series is a polynomial in the fast time tau and E = e^(a tau),

    X_k = sum c_pj tau^j E^p,    X_k' = [mu^(k-1)] f,    Y_k' = a Y_k + R_k(tau, E),    X_k(0) = Y_k(0) = 0,

with Y_0(0) = y_0. ``terms`` finds them one after the other from the right-hand sides. The terms without E are the slow
motion, and the term with neither tau nor E is the base point. The coefficients are lines of a ``Tape``: they are
derived once for a system, and computed in numbers for every start.
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import sympy as sp

from asympk.asymptotics.fibre import Formulas
from asympk.symbolic.system import Mode
from asympk.symbolic.taylor import Polynomial, Taylor, as_taylor, evaluated


@lru_cache(maxsize=64)
def is_affine(mode: Mode) -> bool:
    """Tell whether g is affine in the fast states of a mode, and f a polynomial in them."""
    slopes = (sp.expand(g.diff(y)) for g in mode.fast.values() for y in mode.fast)
    return not any(s.has(*mode.fast) for s in slopes) and all(f.is_polynomial(*mode.fast) for f in mode.slow.values())


@dataclass(frozen=True)
class Terms:
    """The terms c tau^j E^p of every X_k and Y_k: ``places`` has a row (k, state, p, j) for each coefficient c.

    ``numbers(*x, y, *parameters)`` returns a and then the coefficients, in the order of these rows.
    """

    places: np.ndarray
    numbers: Callable[..., tuple]

    def at(self, start: tuple, values: tuple) -> tuple[float, np.ndarray]:
        """Return a and the coefficients as an array (k, state, power of E, power of tau)."""
        rate, *found = self.numbers(*start, *values)
        table = np.zeros(self.shape)
        table[self.index] = found
        return rate, table

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The shape of the array of coefficients."""
        return tuple((self.places.max(axis=0) + 1).tolist())

    @cached_property
    def index(self) -> tuple[np.ndarray, ...]:
        """The index of the rows in that array."""
        return tuple(self.places.T)


@lru_cache(maxsize=64)
def terms(formulas: Formulas, order: int) -> Terms:
    """Derive the ``Terms`` to ``order``."""
    tape, values = formulas.tape(*(f"v{i}_0" for i in range(len(formulas.states))))
    start = {s: tape.node(f"v{i}_0") for i, s in enumerate(formulas.states)}
    (rate,) = evaluated(formulas.slopes, {**values, **start}, tape)
    found = layer_coefficients(formulas, (order, order), tape, values, start, rate)
    entries = [(k, i, *power, c) for i, s in enumerate(formulas.states) for k in range(order + 1)
               for power, c in _powers(found[s].get((k, 0), 0)).items()]
    places = np.array([entry[:-1] for entry in entries])
    return Terms(places, tape.function((rate, *(entry[-1] for entry in entries)), formulas.functions))


def layer_coefficients(
    formulas: Formulas, orders: tuple[int, int], tape: Any, values: dict, start: dict, rate: Any
) -> dict:
    """Return {state: {(k, 0): X_k or Y_k}}, the slow and the fast states to ``orders``.

    ``values`` are those of the parameters on ``tape``, ``start`` those of the states, and ``rate`` is a.
    """
    slow, (y,) = formulas.slow_states, formulas.fast_states
    known: dict = {s: {(0, 0): start[s]} for s in slow} | {y: {}}
    for k in range(max(orders) + 1):
        if 0 < k <= orders[0]:
            for s, rest in zip(slow, _rests(formulas.drift, formulas, values, known, tape, k - 1), strict=True):
                known[s][k, 0] = _solved(rest, rate, 0, 0)
        if k <= orders[1]:
            (rest,) = _rests(formulas.full_force, formulas, values, known, tape, k)
            known[y][k, 0] = _solved(rest, rate, 1, start[y] if k == 0 else 0)
    return known


def _rests(exprs, formulas, values, found, tape, k):
    """Return the coefficients of mu^k in the rates along the terms found so far, without those of the unknown Y_k."""
    known = {s: Taylor({i: c for i, c in terms.items() if i[0] <= k}, k) for s, terms in found.items()}
    small = Taylor({(1, 0): 1} if k else {}, k)
    known |= values | {formulas.small: small}
    exprs = formulas.to_degree(exprs, k)
    return [LayerPolynomial(_powers(as_taylor(value, k)[k, 0])) for value in evaluated(exprs, known, tape)]


def _powers(value):
    return value.terms if isinstance(value, LayerPolynomial) else {(0, 0): value}


def _solved(rest, rate, own, start):
    """Return the solution of X' = n a X + ``rest``, X(0) = ``start``, where ``rate`` is a, and ``own`` is n, 0 or 1."""
    found = {(own, j + 1): c * Fraction(1, j + 1) for (p, j), c in rest.terms.items() if p == own}
    for p in {p for p, _ in rest.terms} - {own}:
        found |= _particular(rest.terms, p, rate, p - own)
    return LayerPolynomial({**found, (own, 0): start - sum((c for (_, j), c in found.items() if j == 0), 0)})


def _particular(rest, p, rate, times):
    """Return q(tau) E^p with q' + ``times`` a q = r(tau), where r(tau) is the factor of E^p in ``rest``."""
    found, above = {}, 0
    for j in range(max(j for i, j in rest if i == p), -1, -1):
        above = (rest.get((p, j), 0) - above * (j + 1)) * Fraction(1, times) / rate
        found[p, j] = above
    return found


class LayerPolynomial(Polynomial):
    """A polynomial in tau and E as a coefficient: ``terms[p, j]`` multiplies tau^j E^p."""
