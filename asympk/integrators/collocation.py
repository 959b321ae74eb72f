r"""Reference solutions by Radau IIA collocation of high order, in any number of digits, for any System with friction.

A step h with s stages puts polynomials through the stage derivatives K_i = f(w_i), w_i = w_0 + h sum_j a_ij K_j. The
residual is computed in many digits, its correction by the Jacobian in doubles: every sweep gains up to 15 digits, and
no large linear system is solved in many digits. Steps are chosen so that the last Legendre coefficients of K vanish to
the digits asked for; a guard is met by moving the end of the step, so that events have the accuracy of the end point.

Two runs of different order must agree to the digits asked for (Hairer and Wanner, Solving ODEs II, IV.5 and IV.8).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from asympk.errors import OutOfRange
from asympk.integrators import hybrid
from asympk.integrators.piecewise import Piece, first_phase, next_phase, piece_of, snapped
from asympk.path import Event, Path

STEPS = 5000
GROW, SHRINK = 1.6, 0.4


@dataclass(frozen=True)
class Scheme:
    """A piece in many digits and in doubles, the tableau of the collocation, and the tolerance of a step."""

    piece: Piece
    doubles: Piece
    tableau: Any
    tolerance: Any


def reference(scene, system, values, digits=30):
    """Follow ``system`` with the parameters ``{symbol: number}`` from the start of ``scene``, right to ``digits``.

    Returns a ``Path`` without dense output; ``path.error`` is the difference of two runs of different order. Raises
    ``OutOfRange`` when they do not agree.
    """
    import mpmath

    with mpmath.workdps(digits + 10):
        rough, fine = (_follow(scene, system, values, stages, digits + extra) for stages, extra in ((20, 1), (26, 3)))
        scale = max(1, abs(fine[0][0]), abs(fine[0][2]))
        error = max(abs(a - b) for a, b in zip(rough[0], fine[0], strict=True)) / scale
        if error > mpmath.mpf(10) ** -digits or rough[2] != fine[2]:
            raise OutOfRange(f"two references differ by {mpmath.nstr(error, 3)}; ask for fewer than {digits} digits")
        return Path(scene, "collocation", *fine, at=None, error=error)


def _follow(scene, system, values, stages, digits):
    import mpmath

    problem = hybrid.problem(system, values, _number)
    doubles = hybrid.problem(system, values)
    state, until, t = tuple(map(_number, scene.start)), _number(scene.until), mpmath.mpf(0)
    phase = first_phase(problem, state)
    marks, modes = [], [phase.mode]
    tolerance = mpmath.mpf(10) ** -digits
    while True:
        piece = piece_of(problem, phase)
        scheme = Scheme(piece, piece_of(doubles, phase), _tableau(stages, mpmath.mp.dps), tolerance)
        t, state, hit = _piece(scheme, t, state, until)
        if hit is None:
            return state, tuple(marks), tuple(modes)
        state = snapped(piece, hit, state)
        phase = next_phase(problem, phase, hit, state)
        marks.append(Event(piece.kinds[hit], t, *state))
        modes.append(phase.mode)


def _number(value):
    from mpmath import mpf

    return mpf(value.numerator) / value.denominator if hasattr(value, "numerator") else mpf(value)


def _piece(scheme, t, state, until):
    """Follow one smooth piece until a guard is lost or ``until``; return (t, state, guard or None)."""
    piece = scheme.piece
    rate = max(abs(v) for row in piece.jac(0, state) for v in row)
    h = min(until - t, 1 / (1 + rate))
    before = piece.guard_values(state)
    for _ in range(STEPS):
        last = h >= until - t
        h = min(h, until - t)
        slopes = _step(scheme, state, h)
        if slopes is None or _tail(slopes, scheme.tableau, h) > scheme.tolerance * max(1, *map(abs, state)):
            h *= SHRINK
            continue
        end = _end(scheme, state, slopes, h)
        after = piece.guard_values(end)
        lost = [k for k in (0, 1) if before[k] >= 0 > after[k]]
        if lost:
            return min(_meet(scheme, t, state, h, k, before[k], after[k]) for k in lost)
        if last:
            return until, end, None
        t, state, before = t + h, end, after
        h *= GROW
    raise OutOfRange(f"the reference needs more than {STEPS} steps; take a larger mu or a smaller until")


def _meet(scheme, t, state, h, k, before, after):
    """Return (t, state, k) where guard ``k`` is lost within the step ``h``, by Newton kept in a bracket."""
    low, high, value_low, value_high = 0 * h, h, before, after
    at = h * before / (before - after)
    for _ in range(200):
        end = _end(scheme, state, _step(scheme, state, at), at)
        value = scheme.piece.guard_values(end)[k]
        if value >= 0:
            low, value_low = at, value
        else:
            high, value_high = at, value
        slope = _slope(scheme.piece, end, k)
        guess = at - value / slope if slope < 0 else low
        if abs(guess - at) <= scheme.tolerance * h:
            return t + at, end, k
        at = guess if low < guess < high else low + (high - low) * value_low / (value_low - value_high)
        if not low < at < high:
            at = (low + high) / 2
    raise OutOfRange(f"an event near t = {float(t):.6g} is not found to the tolerance; it is a grazing one")


def _slope(piece, state, k):
    """Return the rate of guard ``k`` along the field, by a difference far below the digits of doubles."""
    step = 1e-14 / (1 + max(abs(v) for row in piece.jac(0, state) for v in row))
    moved = tuple(w + step * dw for w, dw in zip(state, piece.rhs(0, state), strict=True))
    return (piece.guard_values(moved)[k] - piece.guard_values(state)[k]) / step


def _step(scheme, state, h):
    """Return the stage derivatives of a step, or None when the sweeps do not converge."""
    import numpy as np

    a, piece = scheme.tableau.a, scheme.piece
    slopes = [piece.rhs(0, state)] * len(a)
    previous = None
    for _ in range(60):
        stages = [_moved(state, row, slopes, h) for row in a]
        residual = [_minus(piece.rhs(0, w), k) for w, k in zip(stages, slopes, strict=True)]
        exponent = max(abs(v) for row in residual for v in row)
        if exponent == 0:
            return slopes
        blocks = np.array([scheme.doubles.jac(0, map(float, w)) for w in stages])
        steps = scheme.tableau.floats * float(h)
        matrix = np.eye(3 * len(a)) - np.einsum("ikl,ij->ikjl", blocks, steps).reshape(2 * (3 * len(a),))
        scaled = np.array([float(v / exponent) for row in residual for v in row])
        change = np.linalg.solve(matrix, scaled).reshape(-1, 3).tolist()
        slopes = [_minus(k, [-exponent * v for v in d]) for k, d in zip(slopes, change, strict=True)]
        size = h * exponent * max(abs(v) for d in change for v in d)
        if size <= scheme.tolerance * 1e-4:
            return slopes
        if not size < (1e30 if previous is None else 2 * previous):
            return None
        previous = size
    return None


def _minus(left, right):
    return tuple(a - b for a, b in zip(left, right, strict=True))


def _moved(state, weights, slopes, h):
    return tuple(w + h * sum(b * k[i] for b, k in zip(weights, slopes, strict=True)) for i, w in enumerate(state))


def _end(scheme, state, slopes, h):
    return _moved(state, scheme.tableau.a[-1], slopes, h)


def _tail(slopes, tableau, h):
    """Return what the last two Legendre coefficients of the derivatives amount to over the step."""
    last = (sum(w * k[i] for w, k in zip(row, slopes, strict=True)) for row in tableau.last for i in range(3))
    return h * max(map(abs, last))


class _Tableau:
    """Radau IIA with s stages: the matrix a, also as floats, and the rows that give the last Legendre coefficients."""

    def __init__(self, stages):
        import mpmath
        import numpy as np

        legendre = lambda k, t: mpmath.legendre(k, 2 * t - 1)  # noqa: E731
        nodes = _nodes(stages)
        basis = mpmath.matrix([[legendre(k, t) for k in range(stages)] for t in nodes])
        inverse = basis**-1
        primitive = mpmath.matrix([[_primitive(legendre, k, t) for k in range(stages)] for t in nodes])
        product = primitive * inverse
        self.a = [[product[i, j] for j in range(stages)] for i in range(stages)]
        self.floats = np.array([[float(v) for v in row] for row in self.a])
        self.last = [[inverse[k, j] for j in range(stages)] for k in (stages - 2, stages - 1)]


def _primitive(legendre, k, t):
    """Return the integral of the shifted Legendre polynomial of degree k from 0 to t."""
    return t if k == 0 else (legendre(k + 1, t) - legendre(k - 1, t)) / (2 * (2 * k + 1))


def _nodes(stages):
    """Return the Radau nodes in (0, 1]: the roots of P_s - P_(s-1) in 2 t - 1."""
    import mpmath
    import numpy as np

    coefficients = np.zeros(stages + 1)
    coefficients[-2:] = -1, 1
    rough = np.sort(np.polynomial.legendre.legroots(coefficients).real)[:-1]
    difference = lambda u: mpmath.legendre(stages, u) - mpmath.legendre(stages - 1, u)  # noqa: E731
    return [(mpmath.findroot(difference, mpmath.mpf(float(u))) + 1) / 2 for u in rough] + [mpmath.mpf(1)]


@lru_cache(maxsize=8)
def _tableau(stages, digits):
    return _Tableau(stages)
