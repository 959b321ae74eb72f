r"""One mode in ball arithmetic, and a proof of what ends it.

A guard is a quantity that is positive while the mode lasts: +-s and +-z in slip, the distances of s from the edges of
the static cone in stick. The time axis is cut from the left until on every piece each guard is proven positive, by
its value, its slope, or at the start its slope's slope; or exactly one guard falls strictly from plus to minus while
the others stay positive, which proves that its root exists, is alone, and is the first event. Newton's interval step
then encloses the root. Nothing here relies on the closed-form roots or the extrema that ``flow`` uses.
"""

from typing import Any, NamedTuple

from asympk.balls import common, flint, sign

_CUTS = (0.5, 0.25, 0.75, 0.125, 0.875, 0.0625, 0.9375)
_MOST_PIECES = 1500
_NEWTON_STEPS = 200


class Refused(ArithmeticError):
    """What cannot be proven, by name; the message says where."""


class State(NamedTuple):
    """Enclosures of x, y, s = x + y and z."""

    x: Any
    y: Any
    s: Any
    z: Any


class Guard(NamedTuple):
    """A quantity ``side * (q - level)``, q = s or z; ``touching``: zero at the start, and not falling there."""

    kind: str
    axis: str
    side: int
    level: Any
    touching: bool = False


class Segment:
    """The closed form of the mode ``mu y' = a - b s`` from a state, ``deviation`` that from its slow line if known."""

    def __init__(self, a, b, mu, start, deviation=None):
        self.a, self.b, self.mu, self.start = a, b, mu, start
        self.form, self.unstable = _generic, False
        if not b.contains(0):
            self.rest = a / b
            square = 1 - 4 * mu / b
            if square > 0:
                self._exponentials(square.sqrt(), deviation)
            elif square < 0:
                self.form, self.turns = _oscillating, (b / mu - (b / (2 * mu)) ** 2).sqrt()

    def _exponentials(self, root, deviation):
        """Split the start into a fast and a slow part; rates l1 = -rho b / mu, l2 = -1/rho with rho = (1 + root)/2."""
        k, rho, start = self.mu / self.b, (1 + root) / 2, self.start
        self.form, self.rates, self.lift = _exponential, (-rho / k, -1 / rho), -k / (rho * rho)
        fast = deviation
        if fast is None:
            fast = (start.s - self.a / (self.b * rho)) - self.lift * start.x
        self.parts = fast * (-k / root), start.x - self.rest + fast * k / root
        self.unstable = sign(self.b) < 0 and fast.contains(0)

    def state(self, t):
        """Return the state on the time ball ``t``."""
        return self.form(self, t)

    def jet(self, guard, t):
        """Return the guard's value, slope and slope's slope on the time ball ``t``."""
        state = self.state(t)
        drift = (self.a - self.b * state.s) / self.mu
        slope = state.y + drift
        if guard.axis == "s":
            values = state.s - guard.level, slope, drift - self.b / self.mu * slope
        else:
            values = state.z - guard.level, self.a - (self.b - 1) * state.s, (1 - self.b) * slope
        return tuple(guard.side * value for value in values)


def _exponential(segment, t):
    (fast, slow), (l1, l2), start = segment.parts, segment.rates, segment.start
    p, q = fast * (l1 * t).exp(), slow * (l2 * t).exp()
    y = l1 * p + l2 * q
    s = segment.rest + (1 + l1) * p + segment.lift * q
    return _joined(segment, t, State(segment.rest + p + q, y, s, start.z))


def _oscillating(segment, t):
    beta, start = segment.b / segment.mu, segment.start
    decay, angle = (-beta * t / 2).exp(), segment.turns * t
    g = decay * angle.sin() / segment.turns
    rate = decay * angle.cos() - beta * g / 2
    away = start.x - segment.rest
    x, y = segment.rest + away * (rate + beta * g) + start.y * g, start.y * rate - beta * away * g
    return _joined(segment, t, State(x, y, x + y, start.z))


def _joined(segment, t, state):
    """Add z = z0 + (a/b) t + (mu/b)(b-1)(y - y0), which follows from the two rates."""
    moved = segment.rest * t + segment.mu * (1 - 1 / segment.b) * (state.y - segment.start.y)
    return state._replace(z=segment.start.z + moved)


def _generic(segment, t):
    """Follow the linear system by the exponential of its matrix, where the closed forms degenerate."""
    a, b, mu, start = segment.a, segment.b, segment.mu, segment.start
    rates = [[0, 1, 0, 0], [-b / mu, -b / mu, 0, a / mu], [1 - b, 1 - b, 0, a], [0, 0, 0, 0]]
    flow = flint().arb_mat([[t * entry for entry in row] for row in rates]).exp()
    x, y, moved = (
        flow[row, 0] * start.x + flow[row, 1] * start.y + flow[row, 3] for row in range(3)
    )
    return State(x, y, x + y, start.z + moved)


def first_event(segment, guards, left):
    """Return (guard, time ball) of the first guard to vanish in (0, upper end of ``left``], or None; or ``Refused``."""
    arb = flint().arb
    pieces, lo = [left.upper().mid()], arb(0)
    for _ in range(_MOST_PIECES):
        if not pieces:
            return None
        hi = pieces[-1]
        verdicts = [_verdict(segment, guard, lo, hi) for guard in guards]
        if all(verdict == "positive" for verdict in verdicts):
            lo = pieces.pop()
        elif verdicts.count("falls") == 1 and "unknown" not in verdicts:
            guard = guards[verdicts.index("falls")]
            return guard, _root(segment, guard, lo, hi)
        else:
            pieces.append(_cut(segment, guards, lo, hi, verdicts, left))
    raise _refused(segment, guards, lo, pieces[-1], left)


def _verdict(segment, guard, lo, hi):
    value, slope, bend = segment.jet(guard, lo.union(hi))
    at_start = lo == 0
    if value > 0 or slope > 0 or (at_start and guard.touching and bend > 0):
        return "positive"
    if slope < 0 and not (at_start and guard.touching):
        end = segment.jet(guard, hi)[0]
        return "positive" if end > 0 else "falls" if end < 0 else "unknown"
    return "unknown"


def _cut(segment, guards, lo, hi, verdicts, left):
    """Return a time between, where if possible the sign of every guard is certain."""
    if not (hi - lo) * 2 ** (flint().ctx.prec // 2) > hi:
        raise _refused(segment, [g for g, v in zip(guards, verdicts, strict=True) if v != "positive"], lo, hi, left)
    for part in _CUTS:
        middle = (lo + (hi - lo) * part).mid()
        if all(sign(segment.jet(guard, middle)[0]) for guard in guards):
            return middle
    return ((lo + hi) / 2).mid()


def _root(segment, guard, lo, hi):
    """Enclose the only root in (lo, hi) of a falling guard: bisect while signs are certain, then Newton's step."""
    for _ in range(_NEWTON_STEPS):
        time = lo.union(hi)
        middle = ((lo + hi) / 2).mid()
        value, slope = segment.jet(guard, middle)[0], segment.jet(guard, time)[1]
        if not slope < 0:
            return time
        lower, upper = (middle, hi) if value > 0 else (lo, middle) if value < 0 else (lo, hi)
        new = common(lower.union(upper), middle - value / slope)
        if not new.rad() < time.rad() * 0.9:
            return new
        lo, hi = new.lower().mid(), new.upper().mid()
    return lo.union(hi)


def _refused(segment, guards, lo, hi, left):
    near = float(hi)
    if segment.unstable:
        return Refused(f"unstable plane: the start of this mode cannot be told from Pi2 with {flint().ctx.prec} bits")
    if not hi < left.lower():
        return Refused(f"horizon: an event at the end itself, t = {near:.10g} of this mode")
    kinds = sorted({guard.kind for guard in guards})
    if len(kinds) > 1:
        return Refused(f"simultaneous: {' and '.join(kinds)} within the radius, {near:.10g} after this mode began")
    return Refused(f"grazing: {kinds[0]} may or may not happen {near:.10g} after this mode began")
