r"""The modes of the Painlevé-Klein rod in numbers of any kind: floats, mpf and arrays.

With s = x + y every mode is ``mu y' = a - b s``, ``z' = a - (b - 1) s`` (2.7)-(2.9). Stick holds on z = 0 where s
lies in the static cone |1 - s| <= (sigma0 + 2)|s|, which is an interval of 1/s. The proofs in ``asympk.certify`` have
code of their own; a test compares both with the ``System`` that is derived from the rod.
"""

from collections.abc import Callable
from typing import Any

from asympk.numbers import sign_of

# the mode by the product of the signs of s and z
MODES = {1: "slip_same", 0: "stick", -1: "slip_opposite"}


def coefficients(name: str, sigma: Any) -> tuple[int, Any]:
    """Return (a, b) of ``mu y' = a - b s`` in a mode: (2.7), (2.8) or (2.9)."""
    if name == "stick":
        return 0, 1
    return 1, sigma + 4 if name == "slip_same" else -sigma


def cone(sigma0: Any) -> tuple[Any, Any]:
    """Return the ends of the static cone as an interval of 1/s, -(sigma0 + 1) and sigma0 + 3: inverses of its edges."""
    return -(sigma0 + 1), sigma0 + 3


def inverse_edges(sigma0: Any, s: Any) -> tuple[Any, Any]:
    """Return the inverses of the cone's edges (near zero, far from zero) on the side of s, with 0 for no edge."""
    low, high = cone(sigma0)
    return low * (low < 0) * (s < 0) + high * (s >= 0), low * (low > 0) * (s > 0)


def stick_margin(sigma0: Any, s: Any) -> Any:
    """Return ``(sigma0 + 2)|s| - |1 - s|``, the largest static friction less the friction needed; > 0 in the cone."""
    return (sigma0 + 2) * abs(s) - abs(1 - s)


def leaving(s: Any) -> Any:
    """Return the sign of z just after z = 0 outside the static cone: the sign of 1 - s, which exceeds the friction."""
    return 2 * (s < 1) - 1


def signs_after(kind: str, s_sign: Any, z_sign: Any, s: Any, sticks: Any) -> tuple[Any, Any]:
    """Return the signs of s and z after an event at the load s; ``sticks`` tells whether z = 0 was met in the cone."""
    if kind == "force_zero":
        return -s_sign, z_sign
    return s_sign, leaving(s) if kind == "slip_onset" else z_sign * (sticks - 1)


def first_signs(sign: Callable[[Any, Any], int], sigma0: Any, mu: Any, s: Any, y: Any, z: Any) -> tuple[int, int, bool]:
    r"""Return the signs of s and z just after a state, and whether the state sticks on an edge of the static cone.

    ``sign(value, size)`` returns the sign of a sum of terms up to ``size``. At s = 0 the sign of s is that of
    s' = y + 1/mu, then that of s'' = 1/mu. At z = 0 the static cone decides; on its edge the rate in stick decides,
    s' = y - s/mu, and then s'' = -s/mu.
    """
    s_sign = sign_of(s) or sign(1 + mu * y, 1) or 1
    if z:
        return s_sign, sign_of(z), False
    held = sign(stick_margin(sigma0, s), 1 + abs(s))
    if held:
        return s_sign, leaving(s) if held < 0 else 0, False
    widening = (sigma0 + 2) * s_sign + leaving(s)
    if widening * (sign(mu * y - s, abs(s)) or -s_sign) > 0:
        return s_sign, 0, True
    return s_sign, leaving(s), False
