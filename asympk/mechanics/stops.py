r"""Whether friction that depends on the sliding velocity lasts until the contact stops within a jump (Lemma 18).

Let m = |G_NT|, and let B be the bound of friction at the speed w. As gamma falls in the jump, the contact is pressed in
at the rate u = -g', which is 0 at the start,

    du/dw = -(B m - G_NN) / (B G_TT - m).

The contact stops if B G_TT > m and u > 0 at all speeds below that of the start. It slides on where u returns to 0.
"""

from collections.abc import Mapping
from typing import Any

import sympy as sp

from asympk.symbolic.long import atoms, symbols_in
from asympk.symbolic.truth import Evaluated, array_function

RTOL = 1e-10  # the tolerance of u
STEPS = 64  # the fewest steps down to rest, so that none passes a narrow dip of B unseen
NEAREST = 1e-12  # the least velocity, relative to gamma: at rest B may have another value
STEEPEST = 1e-9  # the least fall of gamma, relative to its terms, which stands for none


class Stops(Evaluated):
    """The condition that a contact stops, of B as a Lambda of gamma, and of gamma, G_NN, |G_NT| and G_TT."""

    def at(self, numbers: Mapping[sp.Symbol, Any]) -> Any:
        """Tell whether the contact stops at numbers or arrays; arrays give an array of booleans."""
        import numpy as np

        law, *rest = self.args
        used = tuple(sorted(self.free_symbols, key=str))
        (gamma,) = law.variables
        bound = array_function(law.expr, (gamma, *used))
        places = [np.asarray(numbers[s], dtype=float) for s in used]
        values = np.broadcast_arrays(*array_function(sp.Tuple(*rest), used)(*places), *places)
        found = [_stops(bound, *place) for place in zip(*(value.ravel().tolist() for value in values), strict=True)]
        return np.array(found).reshape(values[0].shape)


def bound_symbols(expr: sp.Basic) -> set[sp.Symbol]:
    """Return the symbols of an expression that only stand for the arguments of a Lambda."""
    return symbols_in(sp.Tuple(*(law.signature for law in atoms(expr, sp.Lambda))))


def _stops(bound: Any, slip: float, normal: float, mixed: float, tangential: float, *place: float) -> bool:
    """Tell whether u stays positive from ``slip`` to rest, by the share of the velocity that is lost."""
    from scipy.integrate import solve_ivp

    def rate(lost: float, _: Any) -> list[float]:
        B = float(bound(slip * max(1 - lost, NEAREST), *place))
        return [(B * mixed - normal) / max(B * tangential - mixed, STEEPEST * mixed)]

    def pressed(_: float, u: Any) -> float:
        return u[0]

    pressed.terminal, pressed.direction = True, -1  # type: ignore[attr-defined]
    if mixed == 0 or slip == 0 or not (first := rate(0, None)[0]) > 0:
        return False
    found = solve_ivp(rate, (0, 1), [0.0], "DOP853", events=pressed, rtol=RTOL, atol=RTOL * first, max_step=1 / STEPS)
    return bool(found.status == 0)
