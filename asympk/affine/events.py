r"""The first root of any guard, isolated by bounds.

On [lo, hi] of length h let ``|g''| <= B``. Then g stays above ``min(g(lo), g(hi)) - B h^2/8``, and ``(g'(lo) + g'(hi)
-+ B h)/2`` bound its slope from below and above. So an interval is free of roots, or the guard falls through zero on
it just once while the others stay positive, or it is halved: nothing is sampled. In doubles a mesh that is kept per
mode bounds a hundred intervals at once; only those in which something may happen are looked at one by one.

A value within its rounding has no sign: cuts avoid such times, and where none is left ``Undecided`` is raised.
"""

from typing import Any, NamedTuple

import numpy as np

from asympk.affine.functions import MOST_EXPONENT, bases, functions, sizes, tremors
from asympk.errors import Undecided
from asympk.flow.arithmetic import Doubles

_CUTS = (0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875, 0.03125, 0.96875)
_MOST_STEPS = 200
_FURTHER = 1.375


class Point(NamedTuple):
    """All guards at one time: values, slopes, and how far each may be wrong."""

    t: Any
    values: list
    slopes: list
    doubts: list
    slope_doubts: list


def first_root(guards, until, mesh):
    """Return (time, indices of the guards) of the first root in (0, until], or None.

    ``guards`` is a ``Guards``. Several indices stand for roots that the numbers cannot tell apart when margins are
    turned off. Raises ``Undecided``.
    """
    done = 0
    for lo, hi in guards.suspects(mesh, until):
        if hi <= done:
            continue
        found, done = _isolated(guards, max(lo, done), hi, until)
        if found:
            return found
    return None


class Guards:
    """The guards of one segment: ``first + sum_r weights[r] (F_r(t) - F_r(0))`` with slopes and bounds of bends."""

    def __init__(self, segment):
        m, flow = segment.m, segment.flow
        self.m, self.blocks, self.decays = m, flow.blocks, flow.rate.diagonal()
        first = bases(flow.blocks, segment.weights, segment.first)
        first_mass = bases(flow.blocks, segment.mass, segment.first_mass)
        self.arrays = first, segment.weights, segment.slopes, abs(segment.bends)
        self.masses = first_mass, segment.mass, flow.rate_sizes @ segment.mass
        self.first, self.first_mass = first.tolist(), first_mass.tolist()
        self.weights, self.slopes, self.bends = (array.T.tolist() for array in self.arrays[1:])
        self.mass, self.slope_mass = (array.T.tolist() for array in self.masses[1:])
        self.every = range(len(segment.first))
        self.reach = {guard: _reach(segment, guard) for guard in segment.zero}

    def at(self, t):
        """Return the ``Point`` at t."""
        margin = self.m.margin
        found, gained, begun = functions(self.m, self.blocks, t)
        off, slope_off = tremors(self.m, self.blocks, t)
        return Point(
            t,
            [_dot(w, gained) + g for w, g in zip(self.weights, self.first[begun], strict=True)],
            [_dot(w, found) for w in self.slopes],
            [(_dot(w, off) + g) * margin for w, g in zip(self.mass, self.first_mass[begun], strict=True)],
            [_dot(w, slope_off) * margin for w in self.slope_mass],
        )

    def bounds(self, lo, hi):
        """Return a bound of every ``|g''|`` on [lo, hi]."""
        found = sizes(self.m, self.blocks, lo, hi)
        return [_dot(w, found) for w in self.bends]

    def value(self, guard, t):
        """Return the value and the slope of one guard."""
        found, gained, begun = functions(self.m, self.blocks, t)
        return self.first[begun][guard] + _dot(self.weights[guard], gained), _dot(self.slopes[guard], found)

    def suspects(self, mesh, until):
        """Yield intervals (lo, hi) of (0, until) in order, outside which no guard has a root.

        Raises ``OverflowError`` where a part of a guard grows beyond the doubles.
        """
        last = self._last()
        for window in mesh.windows():
            if window.t[-1] > last and until > last:
                raise OverflowError
            suspect = self._suspect(window) if self.m is Doubles else np.ones(len(window.t) - 1, dtype=bool)
            for k in np.flatnonzero(suspect):
                if window.t[k] >= until:
                    return
                yield self.m.number(window.t[k]), min(self.m.number(window.t[k + 1]), until)
            if window.t[-1] >= until:
                return

    def _last(self):
        """Return the time at which a part of a guard leaves the range of the numbers in use."""
        if self.m is not Doubles:
            return self.m.inf
        fastest = self.decays[self.arrays[1].any(axis=1)].max(initial=0.0)
        return MOST_EXPONENT / fastest if fastest else float("inf")

    def _suspect(self, window):
        """Return which intervals of a window may have a root, by the verdicts of ``_verdict`` on arrays."""
        margin = self.m.margin
        (first, weights, slopes, bends), (first_mass, mass, slope_mass) = self.arrays, self.masses
        g = first[window.begun] + window.gained @ weights
        off = (window.tremors @ mass + first_mass[window.begun]) * margin
        rise, rise_off = window.values @ slopes, window.slope_tremors @ slope_mass * margin
        h = np.diff(window.t)[:, None]
        spare = (window.sizes @ bends) * h
        clear = g > off
        above = np.minimum((g - off)[:-1], (g - off)[1:]) > spare * h / 8
        both, both_off = rise[:-1] + rise[1:], spare + rise_off[:-1] + rise_off[1:]
        rising, falling = (both > both_off) & clear[:-1], (both < -both_off) & clear[1:]
        if window.t[0] == 0:
            for guard, reach in self.reach.items():
                rising[0, guard] |= both[0, guard] > both_off[0, guard]
                rising[:, guard] |= window.t[1:] <= reach
        return ~(above | rising | falling).all(axis=1)


def _reach(segment, guard):
    """Return a time up to which a guard that vanishes at the start is positive.

    Let ``g^(p)(0) = v > 0`` be its first derivative that does not vanish and ``|g^(p+1)| <= B`` up to a time h; then
    g is positive up to the smaller of h and v/B. Raises ``Undecided`` where v is negative or none is found.
    """
    m, flow = segment.m, segment.flow
    weights, mass = segment.weights[:, guard], segment.mass[:, guard]
    if not weights.any():
        return float("inf")
    found, _, _ = functions(m, flow.blocks, 0 * segment.mass[0, guard])
    for _ in range(len(weights)):
        weights, mass = flow.rate @ weights, flow.rate_sizes @ mass
        value, off = _dot(found, weights.tolist()), max(m.margin, m.eps) * sum(mass.tolist())
        if abs(value) > off:
            break
    else:
        raise Undecided
    if value < 0:
        raise Undecided
    bends, fastest = abs(flow.rate @ weights).tolist(), max(flow.rate_sizes.sum(axis=0).tolist())
    h = 1 / fastest if fastest else m.number(1)
    for _ in range(_MOST_STEPS):
        if _dot(bends, sizes(m, flow.blocks, 0 * h, h)) * h < value - off:
            return h
        h = h / 4
    raise Undecided


def _dot(first, second):
    return sum(map(_times, first, second))


def _times(a, b):
    return a * b


def _isolated(guards, lo, hi, until):
    """Return (found, time up to which there is no other root) for an interval from which a root may be in."""
    left = guards.at(lo)
    right = _certain(guards, lo, hi, until)
    done, pieces = right.t, [right]
    for _ in range(_MOST_STEPS):
        right = pieces[-1]
        verdicts = [_verdict(guards, q, left, right, bend)
                    for q, bend in zip(guards.every, guards.bounds(left.t, right.t), strict=True)]  # fmt: skip
        fall = [q for q, verdict in zip(guards.every, verdicts, strict=True) if verdict == "falls"]
        if all(verdict == "positive" for verdict in verdicts):
            left = pieces.pop()
            if not pieces:
                return None, done
        elif len(fall) == 1 and "unknown" not in verdicts:
            return (root(guards, fall[0], left, right), tuple(fall)), done
        else:
            pieces.append(_cut(guards, left, right))
    raise Undecided


def _certain(guards, lo, hi, until):
    """Return the point at hi, or at a later time where every guard has a sign; or at ``until``."""
    for _ in range(_MOST_STEPS):
        point = guards.at(hi)
        if _signs(point):
            return point
        if hi >= until:
            raise Undecided
        hi = min(lo + (hi - lo) * _FURTHER, until)
    raise Undecided


def _signs(point):
    return all(abs(g) > off for g, off in zip(point.values, point.doubts, strict=True))


def _cut(guards, left, right):
    """Return a point between where every guard has a sign."""
    times = [left.t + (right.t - left.t) * part for part in _CUTS]
    if not left.t:
        times = [reach for reach in guards.reach.values() if reach < right.t] + times
    for t in times:
        if left.t < t < right.t:
            point = guards.at(t)
            if _signs(point):
                return point
    raise Undecided


def _verdict(guards, q, left, right, bend):
    h = right.t - left.t
    (a, off_a), (b, off_b) = ((p.values[q], p.doubts[q]) for p in (left, right))
    if min(a - off_a, b - off_b) > bend * h * h / 8:
        return "positive"
    both = left.slopes[q] + right.slopes[q]
    spare = bend * h + left.slope_doubts[q] + right.slope_doubts[q]
    touching = not left.t and q in guards.reach
    if touching and right.t <= guards.reach[q]:
        return "positive"
    if both > spare and (touching or a > off_a):
        return "positive"
    if both < -spare and not touching:
        return "positive" if b > off_b else "falls" if a > off_a else "unknown"
    return "unknown"


def root(guards, q, left, right):
    """Return the root of a guard that falls from plus at ``left`` to minus at ``right``, by Newton's method."""
    lo, hi, m = left.t, right.t, guards.m
    close = (hi - lo) * m.root_tol
    t = lo + (hi - lo) * left.values[q] / (left.values[q] - right.values[q])
    for _ in range(_MOST_STEPS):
        value, slope = guards.value(q, t)
        if value > 0:
            lo = t
        else:
            hi = t
        new = t - value / slope if slope < 0 else lo
        if abs(new - t) <= close:
            value, slope = guards.value(q, new)
            return new - value / slope if slope else new
        if not lo < new < hi:
            new = lo + (hi - lo) / 2
            if not lo < new < hi:
                return t
        t = new
    raise Undecided
