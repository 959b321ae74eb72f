r"""The usual segment in doubles: an event in the fast layer of two well separated exponentials, or no event.

This is a shortcut for speed: it finds the same event as ``segments``, and returns None in every unusual case, which
``segments`` then treats. An event is a root of ``rate t = log(r/fast)``, where the fast part balances the rest
r(t) = -(base + k t + slow (e^{slow_rate t} - 1)); so r gives the fast part at the event without an exponential. The
root is the first event if s is monotone before it, z moves towards the plane there, and the quantity that does not
vanish has kept its sign.
"""

from math import expm1, log

from asympk.numbers import Number
from asympk.systems.painleve_klein.flow.fastslow import Ended, RodSegment

MARGIN = 1e-13  # relative size below which a sign is not trusted
SMALL = 1e-8  # a Newton step whose square is below rounding
STEPS = 5  # of Newton's method
LEAST = 0.05  # change of the fast exponent until the event


def slip_end(segment: RodSegment, s_sign: int, z_sign: int, remaining: Number) -> Ended | None:
    """Return (kind, time, state) as ``slip_event`` does, or None."""
    if segment.short or not segment.fast:
        return None
    mode, turn = segment.mode, segment.turning()
    end = remaining if turn > remaining else turn
    opening = not segment.z0
    if not opening:
        leaving = z_sign * (1.0 + mode.fall * segment.s0)
        if -MARGIN < leaving < MARGIN:
            return None
        opening = leaving > 0
    if not opening and (ended := _landing(segment, end)):
        _, (_, _, s, _, _) = ended
        if s_sign * s > MARGIN * segment.size(2, end) and z_sign * (1.0 + mode.fall * s) < -MARGIN:
            return "velocity_zero", *ended
    ended = _level(segment, 0.0, end)
    if ended:
        z = z_sign * ended[1][3]
        return ("force_zero", *ended) if z > MARGIN * segment.size(3, end) and (opening or z_sign < 0) else None
    return _nothing(segment, s_sign, z_sign, turn if end is turn else None, remaining, opening)


def stick_end(segment: RodSegment, edges: tuple[tuple[Number, int], ...], remaining: Number) -> Ended | None:
    """Return (kind, time, state) as ``stick_event`` does where the cone has one edge on this side, or None."""
    edge, side = edges[0]
    if len(edges) > 1 or segment.short or not segment.fast or not side * (edge - segment.s0) > 0:
        return None
    turn = segment.turning()
    ended = _level(segment, edge, remaining if turn > remaining else turn)
    return ("slip_onset", *ended) if ended else None


def _nothing(segment, s_sign, z_sign, turn, remaining, opening):
    mode = segment.mode
    if mode.fast_rate * remaining > 600:
        return None
    for t in (remaining,) if turn is None else (turn, remaining):
        state = segment.state(t)
        _, _, s, z, _ = state
        opens = z_sign * (1.0 + mode.fall * s) > 0
        clear = s_sign * s > MARGIN * segment.size(2, t) and z_sign * z > MARGIN * segment.size(3, t)
        if not clear or (opens and not opening and not _above(segment, z_sign)):
            return None
        opening = opens
    return "", remaining, state


def _above(segment, z_sign):
    """Tell whether z cannot reach the plane: its decaying parts are too small, and its drift leads away."""
    mode = segment.mode
    reach = abs(mode.fast_z * segment.fast) + abs(mode.slow_z * segment.slow)
    return mode.fast_rate < 0 < z_sign * mode.rest and z_sign * segment.z0 > 1.01 * reach


def _landing(segment, end):
    """Return the time and the state where z = 0, or None."""
    mode, fast = segment.mode, segment.fast
    if -0.1 < mode.fall < 0.1:
        return None
    share, slow_z = mode.fast_z, mode.slow_z * segment.slow
    found = _balance(segment.z0 - share * fast, mode.rest, share * fast, mode.fast_rate, slow_z, mode.slow_rate, end)
    if not found:
        return None
    t, r, lost = found
    left = r / share
    lost, kept = segment.slow * lost, segment.slow * (1.0 + lost)
    off = mode.fast_s * left + mode.lift * kept
    x = segment.x0 - (segment.z0 + mode.rest * t + mode.slow_z * lost) * (mode.fast_x / mode.fast_z) + lost
    return t, (x, mode.fast_y * left + mode.slow_rate * kept, mode.rest + off, 0.0, -mode.b * off)


def _level(segment, level, end):
    """Return the time and the state where s = level, or None."""
    mode, fast, slow_s, share = segment.mode, segment.fast, segment.slow_s, segment.mode.fast_s
    found = _balance(mode.rest - level + slow_s, 0.0, share * fast, mode.fast_rate, slow_s, mode.slow_rate, end)
    if not found:
        return None
    t, r, lost = found
    gained, lost = r / share - fast, segment.slow * lost
    x = segment.x0 + (level - segment.s0 - mode.lift * lost) * (mode.fast_x / mode.fast_s) + lost
    z = segment.z0 + mode.rest * t + mode.fast_z * gained + mode.slow_z * lost
    return t, (x, level - x, level, z, mode.a - mode.b * level)


def _balance(base, k, fast, rate, slow, slow_rate, end):
    """Return (t, r, e^{slow_rate t} - 1) at the root, or None unless it is in (0, end) and past ``LEAST``."""
    t, r, dr, lost = 0.0, -base, -(k + slow_rate * slow), 0.0
    for _ in range(STEPS):
        if not fast or r / fast <= 0.0:  # as a quotient below the range of doubles is
            return None
        step = (log(r / fast) - rate * t) / (rate - dr / r)
        t += step
        if not 0.0 < t < end or -LEAST < rate * t < LEAST:
            return None
        if -SMALL < step < SMALL and -SMALL < step * dr / r < SMALL:
            return t, r + dr * step, lost + slow_rate * (1.0 + lost) * step
        lost = expm1(slow_rate * t)
        r, dr = -(base + k * t + slow * lost), -(k + slow_rate * slow * (1.0 + lost))
    return None
