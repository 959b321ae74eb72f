"""The Taylor series of a motion from a place on, in the numbers of this place.

A derivative of high order is a long formula, and its value a short sum of products of earlier ones.
"""

from collections.abc import Iterator
from fractions import Fraction
from itertools import count
from math import factorial
from typing import Any, NamedTuple

import sympy as sp

from asympk.automaton.contacts import Place
from asympk.automaton.modes import GuardedMode
from asympk.symbolic.taylor import CONSTANTS, Taylor, as_taylor, evaluated


class _Functions(NamedTuple):
    """What computes functions of numbers at once, where a tape writes them down."""

    own: Any
    constants: dict[str, Any]

    def call(self, name: str, *values: Any) -> Any:
        """Return a function of numbers."""
        return getattr(self.own, name)(*values)

    def node(self, name: str) -> Any:
        """Return a constant, such as pi."""
        return self.constants[name]


def derivatives_along(mode: GuardedMode, place: Place, exprs: tuple[sp.Expr, ...]) -> Iterator[list[Any]]:
    """Yield expressions, their rates, and their further derivatives by the time, along the motion of a mode.

    Raises ``InputError`` for a function that has no series, and ``ArithmeticError`` or ``ValueError`` where it is
    singular, as s^(16/3) at 0 is in its derivative of order 6.
    """
    system, constants = mode.system, place.values(mode.system, CONSTANTS)
    call = _Functions(place.numbers.functions, dict(zip(map(str, CONSTANTS), constants, strict=True)))
    known = dict(zip(system.parameters, place.p[: len(system.parameters)], strict=True))
    known |= {s: Taylor({(0, 0): w}, 0) for s, w in zip(system.states, place.state, strict=True)}
    for n in count():
        known |= {system.time: Taylor({(0, 0): place.t, (0, 1): 1}, n)} if system.time else {}
        found = [as_taylor(part, n)[0, n] for part in evaluated((*exprs, *mode.rates), known, call)]
        if any(part - part for part in found):  # of what is not finite
            raise OverflowError
        yield [part * factorial(n) for part in found[: len(exprs)]]
        for s, rate in zip(system.states, found[len(exprs) :], strict=True):
            known[s] = Taylor(known[s].terms | {(0, n + 1): rate * Fraction(1, n + 1)}, n + 1)
