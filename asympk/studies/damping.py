"""The damping that resolves the paradox: one family of rods from Butenin's undamped rod to Fufaev's.

The rod with the compliance epsilon^2 and the damping time d is the exact flow at mu = (epsilon/d)^2 with z/d and t/d;
its damping ratio is zeta = d/(2 epsilon). From z0 < 0 with sigma > 0 the mass first stops at T_1, and leaves z = 0 for
good at T (``jammed``). To leading order in L = log(|z0|/epsilon), for a fixed zeta in the first two lines,

    T_1 = epsilon L / (sigma zeta + sqrt(sigma^2 zeta^2 + sigma)),
    T - T_1 = epsilon L / zeta  for zeta < 1,    epsilon L / (zeta - sqrt(zeta^2 - 1))  for zeta > 1,
    T = (epsilon^2/d) (1 + 1/sigma) log(d |z0| / epsilon^2)  for d^3 > epsilon^2 |z0|, in one stick: Fufaev's jump.
"""

from cmath import sqrt as complex_sqrt
from collections.abc import Mapping
from math import log, pi, sqrt
from typing import Any

import sympy as sp

from asympk.errors import InputError
from asympk.methods import solve
from asympk.scene import Scene
from asympk.storage.rows import StoredRows
from asympk.symbolic.reading import rational
from asympk.systems.painleve_klein.flow.fastslow import two_exponentials
from asympk.systems.painleve_klein.modes import cone

SIGMA, UNTIL = 1, 1.0
EPSILONS = (1e-3, 1e-6, 1e-12)
RATIOS = tuple(10 ** (k / 16) for k in range(-13, 65, 2))  # not 1, where the roots of stick coincide
BORDER = (0.9, 0.99, 1.01, 1.1)
UNDAMPED = (1 / 2, 1 / 3, 1 / 4)
TINY = 1e-13  # d/epsilon that stands for no damping: the damper takes less than 1e-8 of the energy
PIECE = 150  # length, in epsilon, of the parts of an undamped run, since the number of events of a run is bounded


def rows() -> StoredRows:
    """Return the rows over epsilon and the damping ratio, at the border of the single jump, and without damping.

    A row is of the run from (0, 0, -1) of the rod with compliance ``epsilon``^2 and damping time ``damping``, at
    sigma = SIGMA. ``part`` is "ratio" (zeta on a grid), "border" (d^3 near epsilon^2) or "undamped". ``stop`` is the
    time of the first stop, ``jam`` the time at which the mass leaves for good, and ``sticks`` the number of stops.
    ``amplitude`` is the amplitude of the load at the first stop, and ``law`` the value of ``jam`` by the formulas of
    this module.
    """
    found = [_row("ratio", epsilon, 2 * zeta * epsilon) for epsilon in EPSILONS for zeta in RATIOS]
    found += [_row("border", epsilon, share * epsilon ** (2 / 3)) for epsilon in EPSILONS for share in BORDER]
    found += [_row("undamped", epsilon, TINY * epsilon) for epsilon in UNDAMPED]
    return StoredRows(found, {"sigma": SIGMA, "start": "(0, 0, -1)", "tiny": TINY, "method": "exact flow"})


def _row(part, epsilon, damping):
    stop, jam, sticks, amplitude = jammed(epsilon, damping)
    law = undamped_time(epsilon, amplitude) if part == "undamped" else jam_law(epsilon, damping)
    return {"part": part, "epsilon": epsilon, "damping": damping, "zeta": damping / (2 * epsilon), "stop": stop,
            "jam": jam, "sticks": sticks, "amplitude": amplitude, "law": law}


def jammed(
    epsilon: float, damping: float, sigma: Any = SIGMA, digits: int | None = None
) -> tuple[float, float, int, float]:
    """Return (time of the first stop, time of leaving for good, number of stops, amplitude of the load at the first).

    The start is (0, 0, -1), in the unit of time of ``epsilon`` and ``damping``. Raises ``InputError`` for numbers out
    of range, and where a damped mass is still jammed at UNTIL.
    """
    if not (0 < epsilon < 1 and damping > 0 and sigma > 0):
        given = f"epsilon = {epsilon}, damping = {damping}, sigma = {sigma}"
        raise InputError(f"{given}: give 0 < epsilon < 1 and positive numbers for both others")
    mu, undamped = (epsilon / damping) ** 2, damping <= TINY * epsilon
    until = (PIECE * epsilon if undamped else UNTIL) / damping
    options: dict[str, Any] = {"digits": digits} if digits else {}
    state: tuple = (0, 0, -1 / damping)
    began, met = 0.0, list[Any]()
    while True:
        path = solve(Scene(sigma, mu, state, until), **options)
        met += [(event, began + event.t) for event in path.events]
        if not (undamped and any(event.kind == "slip_onset" for event in path.events)):
            break
        state, began = path.final, began + until
    if path.modes[-1] == "stick":
        raise InputError(f"epsilon = {epsilon}, damping = {damping}: the mass is jammed still at {UNTIL}")
    stops, leaves = ([(event, t) for event, t in met if event.kind == kind] for kind in ("velocity_zero", "slip_onset"))
    first, t = stops[0]
    # of an undamped rod s is x, and epsilon ds/dt is sqrt(mu) y
    amplitude = sqrt(float(first.x) ** 2 + mu * float(first.y) ** 2)
    return float(t * damping), float(leaves[-1][1] * damping), len(stops), amplitude


def is_single(row: Mapping) -> bool:
    """Tell whether a row's damping is beyond the border of the single jump, d^3 = epsilon^2.

    In stick, once the fast motion has decayed, the load is -mu x with x = |z0|/d. Since s' = (1 - mu x)/mu at s = 0,
    the mass slides on where mu x < 1 and returns to rest where mu x > 1, for every sigma.
    """
    return row["damping"] ** 3 > row["epsilon"] ** 2


def jam_law(epsilon: float, damping: float, sigma: Any = SIGMA) -> float:
    """Return T for z0 = -1 with its constants, by the formula for this zeta and this side of d^3 = epsilon^2.

    Let l > 0 > k be the roots of mu l^2 = sigma (1 + l), r < q < 0 those of stick, mu r^2 + r + 1 = 0. The growing
    motion meets z = 0 with x = X, y = l X, X = l |z0| / (d (sigma + 1)(1 + l)), after (d/l) log(sigma X (k - l)/k).
    Stick ends where its load has fallen to 1/(sigma + 3) at the rate -r (one stick), where the slow part of the load,
    (1 + q)(l - r)/(q - r) X exp(q t), has risen to -1/(sigma + 1) (two), or where the envelope of the ringing load has
    fallen to 1/(sigma + 1) (zeta < 1, up to half a period).
    """
    mu, (low, high) = (epsilon / damping) ** 2, cone(sigma)
    (_, _, growing, shrinking, *_), _ = two_exponentials(1, -sigma, mu, sqrt)
    landing = growing / (damping * (sigma + 1) * (1 + growing))
    first = log(sigma * landing * (shrinking - growing) / shrinking) / growing
    (_, _, fast, slow, *_), _ = two_exponentials(0, 1, mu, complex_sqrt)
    if damping**3 > epsilon**2:
        return damping * (first - log(high * (1 + growing) * landing) / fast.real)
    part = mu * slow**2 * (growing - fast) / (slow - fast) * landing
    size = 2 * abs(part) if mu > 1 / 4 else abs(part)
    return damping * (first - log(-low * size) / slow.real)


def leading_law(epsilon: float, zeta: float) -> float:
    """Return T to leading order in log(1/epsilon) for a fixed damping ratio and z0 = -1."""
    first = 1 / (SIGMA * zeta + sqrt(SIGMA**2 * zeta**2 + SIGMA))
    slow = zeta if zeta < 1 else zeta - sqrt(zeta**2 - 1)
    return epsilon * log(1 / epsilon) * (first + 1 / slow)


def stick_law(epsilon: float, zeta: float) -> float:
    """Return the number of stops of the mass for zeta < 1 to leading order, sqrt(1 - zeta^2) L / (pi zeta)."""
    return sqrt(1 - zeta**2) * log(1 / epsilon) / (pi * zeta)


def undamped_time(epsilon: float, amplitude: float) -> float:
    """Return how long the undamped rod rings from the ``amplitude`` A of its load: pi epsilon A^4 / (2 C).

    Each crossing of the gap between the edges of stick is a slip too short to stop the ringing. In one period the
    energy epsilon^2 A^2/2 falls by C epsilon^2/A^2, from A^2 -> sigma z0^2 / ((sigma + 1) epsilon^2) on.
    """
    return pi * epsilon * amplitude**4 / (2 * float(loss_per_period(SIGMA)))


def undamped_factor(sigma: Any = SIGMA) -> float:
    """Return the limit of epsilon^3 T without damping, from z0 = -1: pi sigma^2 / (2 (sigma + 1)^2 C)."""
    return pi * sigma**2 / (2 * (sigma + 1) ** 2 * float(loss_per_period(sigma)))


def loss_per_period(sigma: Any) -> sp.Expr:
    r"""Return C exactly: minus the work on the mass during two slips, with the load falling and rising through the gap.

    The load s crosses the gap between the edges of stick at the constant rate A/epsilon, downwards from 1/(sigma + 3)
    and upwards from -1/(sigma + 1). The velocity is v = (epsilon/A) V with dV = v' ds, until V is 0 again. The work of
    P and friction is (epsilon/A)^2 times the integral of V (1 - (sigma + 2)|s|).
    """
    sigma = rational("sigma", sigma)
    low, high = cone(sigma)
    return -sp.simplify(_work(high, -low, sigma) + _work(-low, high, sigma))


def _work(first, second, sigma):
    """Integrate V (1 - (sigma + 2) u) over u = |s| to s = 0 with v' = 1 - first u, and beyond with 1 - second u."""
    u = sp.Symbol("u", positive=True)
    start = 1 / first
    before = first * (start - u) ** 2 / 2
    middle = before.subs(u, 0)
    after = middle + u - second * u**2 / 2
    end = (1 + sp.sqrt(1 + 2 * second * middle)) / second
    power = 1 - (sigma + 2) * u
    return sp.integrate(sp.expand(before * power), (u, 0, start)) + sp.integrate(sp.expand(after * power), (u, 0, end))
