r"""The modes of the Painlevé-Klein rod in numbers of any kind, floats, mpf and arrays alike.

With s = x + y every mode is ``mu y' = a - b s``, ``z' = a - (b - 1) s`` (2.7)-(2.9). Stick holds on z = 0 where s
lies in the static cone, which ends at the edges 1/(sigma0 + 3) and -1/(sigma0 + 1). The proofs in ``asympk.certify``
have their own text; a test compares both with the ``System`` that is derived from the rod.
"""

from typing import Any


def mode_name(s_sign: int, z_sign: int) -> str:
    """Return the mode in which s and z have these signs; z is 0 in stick."""
    if not z_sign:
        return "stick"
    return "slip_same" if z_sign == s_sign else "slip_opposite"


def coefficients(name: str, sigma: Any) -> tuple[int, Any]:
    """Return (a, b) of ``mu y' = a - b s`` in a mode: (2.7), (2.8) or (2.9)."""
    if name == "stick":
        return 0, 1
    return 1, sigma + 4 if name == "slip_same" else -sigma


def positive_edge(sigma0: Any) -> Any:
    """Return the positive edge of the static cone, 1/(sigma0 + 3), above which a load holds."""
    return 1 / (sigma0 + 3)


def other_edge(sigma0: Any) -> Any:
    """Return the other edge, -1/(sigma0 + 1): of the negative loads for sigma0 > -1, beyond the positive one below."""
    return -1 / (sigma0 + 1)
