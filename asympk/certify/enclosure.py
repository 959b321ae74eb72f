r"""One mode in ball arithmetic, and a proof of the event that ends it.

``segment`` chooses the closed form of a mode of the rod, and ``first_event``, the hard function, finds its first event.

A guard is a quantity that is positive while the mode lasts: +-s and +-z in slip, the distances of s from the edges of
the static cone in stick. ``first_event`` cuts the time axis from the left. On each piece a guard is proven positive by
its value or its first derivative, at the start also by its second derivative. Guards that fall strictly from plus to
minus on a piece while the others stay positive have one root each, which the interval Newton method encloses; a root
that is certainly before all others is the first event. Nothing here uses the closed-form roots or extrema of the flow.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from asympk.certify.balls import Ball, Refused, certain_sign, common, flint, times

_CUTS = (0.5, 0.25, 0.75, 0.125, 0.875, 0.0625, 0.9375)
_LARGEST_EXPONENT = 2.0**400  # largest |t rate| in a matrix exponential, which takes one squaring per bit of it
_MATRIX_WORK = 2
_CHEAP_BITS = 768  # up to which a piece of time takes as long as with few bits
_NEWTON_STEPS = 200
_SHORT, _NOISE = 2.0**-10, 2.0**-20  # of a time, and of a radius
_SOONEST = 2.0**-1074  # the smallest double
_FINEST_IN_BOX = 2.0**-16


class RodBalls(NamedTuple):
    """Enclosures of x, y, s = x + y and z."""

    x: Any
    y: Any
    s: Any
    z: Any


class Budget:
    """The work allowed for a certificate, of a point or a ``wide`` box, in pieces of time examined with few bits."""

    def __init__(self, pieces: int, wide: bool):
        self.pieces = self.remaining = pieces
        self.wide = wide

    @property
    def finest(self) -> float:
        """The shortest piece of time, relative to its end: for a point, half of the bits, as far as doubles reach."""
        return _FINEST_IN_BOX if self.wide else 2.0 ** -min(flint().ctx.prec // 2, 1000)

    def spend(self, segment: Any) -> None:
        """Subtract one piece, weighted by the segment's work and the precision; raises ``Refused`` below zero."""
        self.remaining -= segment.work * max(1, flint().ctx.prec / _CHEAP_BITS)
        if self.remaining < 0:
            raise Refused(f"undecided: {self.pieces} pieces of work are spent; take a smaller box, or a smaller until")


class LevelGuard(NamedTuple):
    """A guard ``side * (q - level)``, q = s or z; ``touching``: zero at the start of the mode, not falling."""

    kind: str
    axis: str
    side: int
    level: Any
    touching: bool = False


def segment(
    a: int, b: Ball, mu: Ball, start: RodBalls, until: Ball, deviation: Ball | None = None
) -> "MatrixExponential":
    """Return the closed form of the mode ``mu y' = a - b s`` from a state; ``deviation`` is y less the slow line's.

    Where b is so small that the exponents stay about 1 or less ``until`` the end, parts of x about a/b would cancel.
    """
    slow = abs(b) / mu * (1 + until) ** 2 < 1
    if not b.contains(0) and (deviation is not None or not slow):
        square = 1 - 4 * mu / b
        if square > 0:
            return Exponentials(a, b, mu, start, square.sqrt(), deviation)
        if square < 0:
            return Oscillation(a, b, mu, start)
    return MatrixExponential(a, b, mu, start)


class MatrixExponential:
    """A mode followed by the exponential of its matrix, for balls in which b or 1 - 4 mu/b may vanish.

    The jets of a segment are divided by e^{growth t}, so that the growth of an unstable mode does not hide their signs.
    """

    unstable, work, growth = False, _MATRIX_WORK, 0

    def __init__(self, a: int, b: Ball, mu: Ball, start: RodBalls):
        self.a, self.b, self.mu, self.start = a, b, mu, start

    def state(self, t: Ball) -> RodBalls:
        """Return the state on the time ball ``t``."""
        a, b, mu, start = self.a, self.b, self.mu, self.start
        if not all(abs(t * rate) < _LARGEST_EXPONENT for rate in (1 / mu, b / mu)):
            raise Refused("undecided: the exponent of a matrix is too large; take a smaller until")
        rates = [[0, 1, 0, 0], [-b / mu, -b / mu, 0, a / mu], [1 - b, 1 - b, 0, a], [0, 0, 0, 0]]
        flow = flint().arb_mat([[t * entry for entry in row] for row in rates]).exp()
        x, y, moved = (flow[row, 0] * start.x + flow[row, 1] * start.y + flow[row, 3] for row in range(3))
        return RodBalls(x, y, x + y, start.z + moved)

    def jet(self, guard: LevelGuard, t: Ball, order: int = 0) -> tuple[Ball, ...]:
        """Return the guard and its first ``order`` derivatives (at most 2) on ``t``, all times one positive factor."""
        state = self.state(t)
        drift = (self.a - self.b * state.s) / self.mu
        slope = state.y + drift
        if guard.axis == "s":
            values = state.s - guard.level, slope, drift - self.b / self.mu * slope
        else:
            values = state.z - guard.level, self.a - (self.b - 1) * state.s, (1 - self.b) * slope
        return tuple(guard.side * value for value in values[: order + 1])

    def at(self, guard: LevelGuard, t: Ball) -> RodBalls:
        """Return the state at the root of the guard."""
        return self.state(t)


class Oscillation(MatrixExponential):
    """A mode with complex eigenvalues."""

    work = 1

    def __init__(self, a: int, b: Ball, mu: Ball, start: RodBalls):
        super().__init__(a, b, mu, start)
        self.rest, self.turns = a / b, (b / mu - (b / (2 * mu)) ** 2).sqrt()

    def state(self, t: Ball) -> RodBalls:
        """Return the state on ``t``; z = z0 + (a/b) t + mu (1 - 1/b)(y - y0), from z' = a/b + mu (1 - 1/b) y'."""
        beta, start = self.b / self.mu, self.start
        decay, angle = (-beta * t / 2).exp(), self.turns * t
        g = decay * angle.sin() / self.turns
        rate = decay * angle.cos() - beta * g / 2
        away = start.x - self.rest
        x, y = self.rest + away * (rate + beta * g) + start.y * g, start.y * rate - beta * away * g
        return RodBalls(x, y, x + y, start.z + self.rest * t + self.mu * (1 - 1 / self.b) * (y - start.y))


class Exponentials(MatrixExponential):
    """A mode with real rates: x = a/b + P e^{l1 t} + Q e^{l2 t}, l1 = -rho b/mu, l2 = -1/rho, rho = (1 + root)/2."""

    work = 1

    def __init__(self, a: int, b: Ball, mu: Ball, start: RodBalls, root: Ball, deviation: Ball | None):
        super().__init__(a, b, mu, start)
        k, rho = mu / b, (1 + root) / 2
        self.rest, self.coupling = a / b, mu * (1 - 1 / b)
        self.rates, self.lift = (-rho / k, -1 / rho), -k / (rho * rho)
        fast = (start.s - a / (b * rho)) - self.lift * start.x if deviation is None else deviation
        self.parts = fast * (-k / root), start.x - self.rest + fast * k / root
        self.growth = self.rates[0] if b < 0 else 0
        self.unstable = b < 0 and fast.contains(0)
        self._factors: dict[tuple, tuple] = {}

    def state(self, t: Ball) -> RodBalls:
        (fast, slow), (l1, l2) = self.parts, self.rates
        return self._joined(t, fast * (l1 * t).exp(), slow * (l2 * t).exp())

    def _joined(self, t, p, q):
        (l1, l2), start = self.rates, self.start
        y = l1 * p + l2 * q
        z = start.z + self.rest * t + self.coupling * (y - start.y)
        return RodBalls(self.rest + p + q, y, self.rest + (1 + l1) * p + self.lift * q, z)

    def jet(self, guard: LevelGuard, t: Ball, order: int = 0) -> tuple[Ball, ...]:
        (l1, l2), start, arb = self.rates, self.start, flint().arb
        one, p = ((-l1 * t).exp(), arb(1)) if self.b < 0 else (arb(1), (l1 * t).exp())
        q = (l2 * t).exp()
        still, drift = self.rest - guard.level, 0
        if guard.axis == "z":
            still, drift = start.z - guard.level + self.rest * t - self.coupling * start.y, self.rest
        parts = zip(self._coefficients(guard.axis)[: order + 1], (still, drift, 0), strict=False)
        return tuple(guard.side * (times(fast, p) + one * (times(slow, q) + rest)) for (fast, slow), rest in parts)

    def _coefficients(self, axis):
        """Return the factors of the fast and the slow exponential in s or z, and in its first and second derivative."""
        if axis not in self._factors:
            (l1, l2), k = self.rates, self.coupling
            heads = (1 + l1, self.lift) if axis == "s" else (k * l1, k * l2)
            first = [times(head, part) for head, part in zip(heads, self.parts, strict=True)]
            second = [times(rate, factor) for rate, factor in zip(self.rates, first, strict=True)]
            self._factors[axis] = first, second, [times(r, f) for r, f in zip(self.rates, second, strict=True)]
        return self._factors[axis]

    def at(self, guard: LevelGuard, t: Ball) -> RodBalls:
        """Return the state at the root of the guard, whose equation sharpens the enclosure of the fast part."""
        (fast, slow), (l1, l2), start = self.parts, self.rates, self.start
        q = slow * (l2 * t).exp()
        if guard.axis == "s":
            p = (guard.level - self.rest - self.lift * q) / (1 + l1)
        else:
            p = (start.y - (start.z + self.rest * t) / self.coupling - l2 * q) / l1
        return self._joined(t, common(p, fast * (l1 * t).exp()), q)


def first_event(
    segment: Any, guards: Sequence[Any], remaining: Ball, budget: Budget, finest: float = 0
) -> tuple[Any, Ball] | None:
    """Return (guard, time ball) of the first guard to vanish in (0, upper end of ``remaining``], or None.

    Raises ``Refused`` where a piece of time would have to be shorter than ``finest`` or ``budget.finest`` times its
    end, or to end before the smallest double, where no sign is left, and when the ``budget`` is spent.
    """
    arb, finest = flint().arb, max(finest, budget.finest)
    pieces, lo = [remaining.upper().mid()] if remaining.upper() > 0 else [], arb(0)
    while pieces:
        budget.spend(segment)
        hi = pieces[-1]
        verdicts = [_verdict(segment, guard, lo, hi, finest) for guard in guards]
        unproven = [guard for guard, verdict in zip(guards, verdicts, strict=True) if verdict != "positive"]
        roots = [root_in(segment, guard, lo, hi) for guard in unproven] if {*verdicts} <= {"positive", "falls"} else []
        if not unproven:
            lo = pieces.pop()
        elif roots and (first := _first(roots)) is not None:
            return unproven[first], roots[first]
        elif {*verdicts} <= {"positive", "ends"} or not (hi - lo > hi * finest and hi > _SOONEST) or (
                roots and all(root.rad() < hi * finest for root in roots)) or (
                hi - lo < lo * _SHORT and any(_is_rounding(segment, guard, lo) for guard in unproven)):
            raise _refused(segment, unproven, roots[0].upper() if roots else hi, remaining)
        else:
            pieces.append(_cut(segment, guards, lo, hi))
    return None


def _first(roots):
    """Return the place of the root that is certainly before all others, or None."""
    return next((k for k, root in enumerate(roots) if all(root < other for other in roots if other is not root)), None)


def _verdict(segment, guard, lo, hi, finest):
    """Return whether a guard is positive on a piece or falls through 0 there; ``ends`` if it may do so at the end."""
    touching = lo == 0 and guard.touching
    value, *slopes = segment.jet(guard, lo.union(hi), max(2, guard.touching) if touching else 1)
    if value > 0 or any(slope > 0 for slope in slopes):
        return "positive"
    if slopes[0] < 0 and not touching:
        (end,) = segment.jet(guard, hi)
        found = "positive" if end > 0 else "falls" if end < 0 else ""
        return found or ("ends" if segment.jet(guard, (hi - hi * finest).mid())[0] > 0 else "unknown")
    return "unknown"


def _is_rounding(segment, guard, t):
    """Tell whether a guard and its slope have no signs at a time but by the rounding of radii, which have 30 bits."""
    return not any(abs(found) > found.rad() * _NOISE for found in segment.jet(guard, t, 1))


def _cut(segment, guards, lo, hi):
    """Return a time between ``lo`` and ``hi``, if possible one at which the sign of every guard is certain."""
    for part in _CUTS:
        middle = (lo + (hi - lo) * part).mid()
        if all(certain_sign(segment.jet(guard, middle)[0]) for guard in guards):
            return middle
    return ((lo + hi) / 2).mid()


def root_in(segment: Any, guard: Any, lo: Ball, hi: Ball) -> Ball:
    """Return a ball of the only root of a falling guard in (lo, hi), by Newton's steps and by bisection."""
    found = lo.union(hi)
    for _ in range(_NEWTON_STEPS):
        time = lo.union(hi)
        middle = ((lo + hi) / 2).mid()
        (value,), slope = segment.jet(guard, middle), segment.jet(guard, time, 1)[1]
        step, side = middle - value / slope * (segment.growth * (middle - time)).exp(), certain_sign(value)
        lower, upper = (middle, hi) if side > 0 else (lo, middle) if side < 0 else (lo, hi)
        new = common(lower.union(upper), step) if step.is_finite() else lower.union(upper)
        if not new.rad() < found.rad() * 0.9:
            return new
        found, lo, hi = new, new.lower().mid(), new.upper().mid()
    return found


def _refused(segment, guards, hi, remaining):
    near = float(hi)
    if segment.unstable:
        return Refused(f"unstable plane: the start of this mode cannot be told from Pi2 with {flint().ctx.prec} bits")
    if not hi < remaining.lower():
        return Refused(f"horizon: an event at the end itself, t = {near:.10g} of this mode")
    kinds = " and ".join(sorted(guard.kind for guard in guards))
    when = f"{near:.10g} after this mode began" if hi > _SOONEST else "as soon as this mode begins"
    if len(guards) > 1:
        return Refused(f"simultaneous: {kinds} within the radius, {when}")
    return Refused(f"grazing: {kinds} may or may not happen {when}")
