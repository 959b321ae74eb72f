r"""The first root of any guard, isolated by bounds.

On [lo, hi] of length h let the integral of ``|g''|`` be at most S. Then g stays above ``min(g(lo), g(hi)) - S h/4``,
and ``(g'(lo) + g'(hi) -+ S)/2`` bound its slope from below and above (Lemma 6): the slope of a single exponential has a
known sign however long the interval is. Where g'' keeps its sign, the least value of g decides. So an interval is free
of roots, or the guard falls through zero on it once while the others stay positive, or it is cut: nothing is sampled.
In doubles a mesh that is kept per mode bounds a hundred intervals at once, for digits, too; only those in which
something may happen that it cannot tell are looked at one by one.

A value within its rounding has no sign: cuts avoid such times, and where none is left ``Undecided`` is raised. At
``until`` alone it counts as lost: a motion that ends at an event meets it. Where signs are taken as they are, a guard
whose least value is within its rounding touches zero, and counts as lost, too: what follows may be the same mode.
"""

from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property
from itertools import repeat
from operator import mul
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from asympk.affine.functions import MOST_EXPONENT, areas, functions, initial, sizes, tremors
from asympk.arithmetic import Doubles
from asympk.errors import TooLarge, Undecided
from asympk.numbers import Number

if TYPE_CHECKING:
    from asympk.affine.mesh import Mesh
    from asympk.affine.mode import ClosedSegment

_CUTS = (0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875, 0.03125, 0.96875)
_MOST_STEPS = 200
_FURTHER = 1.375
_NOTHING = 1e-8
_ORDER = 16
_REACH = 16  # times of the fastest part, and less where that is too long
_PATIENCE = 2  # steps before the dearer bounds are taken
_FEW = 0.125  # of the digits in which a derivative is zero where it vanishes with those before it
_SLOW = 0.4  # of the step before, for one of Newton's steps to a root that is not simple
_NARROW = 1e-6  # of the time, for an interval in which a guard may only touch zero


class GuardValues(NamedTuple):
    """All guards at one time: values, slopes, and how far each may be wrong."""

    t: Any
    values: list
    slopes: list
    doubts: list
    slope_doubts: list


class Bending(NamedTuple):
    """How a guard bends on an interval: g'' in its middle, how far it differs from that, the integral of its size."""

    middle: Any
    spread: Any
    area: Any


def first_root(guards: "Guards", until: Number, mesh: "Mesh") -> tuple[Number, tuple[int, ...]] | None:
    """Return (time, indices of the guards) of the first root in (0, until], or None.

    ``guards`` is a ``Guards``. Raises ``Undecided``.
    """
    done = None
    for lo, hi, falling in guards.suspects(mesh, until):
        if done is None or hi > done.t:
            if falling is not None and (done is None or done.t <= lo):
                return guard_root(guards, falling, lo, hi, (lo + hi) / 2), (falling,)
            found, done = _isolated(guards, lo if done is None or lo > done.t else done, hi, until)
            if found:
                return found
    return None


class Guards:
    """The guards of one segment as functions of time, with slopes and bounds of bends; ``every`` are their indices."""

    def __init__(self, segment: "ClosedSegment"):
        self.segment, self.m, self.blocks = segment, segment.m, segment.flow.blocks
        self.every = range(segment.slopes.shape[1])
        self._reaches: dict[int, Number] = {}
        self._dips: dict[int, Number] = {}

    @cached_property
    def lists(self) -> tuple[list, ...]:
        """The weights and sizes as lists, one per guard: of sums, slopes and bends; and the bases, one per number."""
        s, functions = self.segment, self.segment.functions
        columns = [table[:functions].T.tolist() for table in (s.guards, s.off.guards, s.slopes, s.off.slopes)]
        return *columns, abs(s.bends).T.tolist(), s.guards[functions:].tolist(), s.off.guards[functions:].tolist()

    def at(self, t: Number, margin: Number | None = None) -> GuardValues:
        """Return the ``GuardValues`` at t; doubts are the sizes of terms times ``margin``, by default that of signs.

        Those of slopes are never less than rounding: where a guard touches zero its slope is no more than that.
        """
        margin = self.m.margin if margin is None else margin
        found, gained, begun = functions(self.m, self.blocks, t)
        off_gained, off_found = tremors(self.m, self.blocks, t)
        weights, off_weights, slopes, off_slopes, _, bases, off_bases = self.lists
        return GuardValues(
            t,
            [_dot(w, gained) + g for w, g in zip(weights, bases[begun], strict=True)],
            [_dot(w, found) for w in slopes],
            [(_dot(w, off_gained) + g) * margin for w, g in zip(off_weights, off_bases[begun], strict=True)],
            [_dot(w, off_found) * max(margin, self.m.slack) for w in off_slopes],
        )

    def bounds(self, lo: Number, hi: Number) -> list[Number]:
        """Return a bound of the integral of every ``|g''|`` over [lo, hi]."""
        found = areas(self.m, self.blocks, lo, hi)
        return [_dot(w, found) for w in self.lists[4]]

    @cached_property
    def derivatives(self) -> list[list[list[Number]]]:
        """The weights of the guards' derivatives from the second to that of order ``_ORDER``, one list per guard."""
        found = [self.segment.bends]
        while len(found) <= _ORDER - 2:
            found.append(self.segment.flow.rate @ found[-1])
        return [table.T.tolist() for table in found]

    def bending(self, lo: Number, hi: Number) -> list[Bending]:
        """Return the ``Bending`` of every guard on [lo, hi] by the Taylor series of g'' at its middle.

        Where eigenvalues are close, weights are large and cancel: in the derivatives there they do, and in the
        remainder they count little.
        """
        m, half = self.m, (hi - lo) / 2
        found, *_ = functions(m, self.blocks, lo + half)
        most, margin = sizes(m, self.blocks, lo, hi), max(m.margin, m.slack)
        powers = [1 + 0 * half]
        while len(powers) < len(self.derivatives):
            powers.append(powers[-1] * half / len(powers))
        bent = []
        for every in zip(*self.derivatives, strict=True):
            *values, _ = (_dot(weights, found) for weights in every)
            *doubts, rest = (_dot(map(abs, weights), most) for weights in every)
            terms = [*(abs(v) + margin * doubt for v, doubt in zip(values, doubts, strict=True)), rest]
            spread = margin * doubts[0] + _dot(powers[1:], terms[1:])
            area = sum(2 * half * p * term / k for k, (p, term) in enumerate(zip(powers, terms, strict=True), 1))
            bent.append(Bending(values[0], spread, area))
        return bent

    def value(self, guard: int, t: Number) -> tuple[Number, Number]:
        """Return the value and the slope of one guard."""
        found, gained, begun = functions(self.m, self.blocks, t)
        weights, _, slopes, _, _, bases, _ = self.lists
        return bases[begun][guard] + _dot(weights[guard], gained), _dot(slopes[guard], found)

    def dip(self, guard: int, lo: Number, hi: Number) -> Number:
        """Return where a guard that is bent upward on [lo, hi] is least there."""
        known = self._dips.get(guard)
        if known is None or not lo < known < hi:
            known = self._dips[guard] = self.least(guard, (lo + hi) / 2, 0)
        return max(lo, min(known, hi))

    def least(self, guard: int, t: Number, most: int = _ORDER - 2) -> Number:
        """Return where the slope of a guard that is bent upward vanishes, by Newton's method from ``t``.

        Where the bend vanishes with it, as far as some digits tell, the last derivative that does so gives the time,
        of the first ``most`` ones.
        """
        weights = [self.lists[2][guard], *(table[guard] for table in self.derivatives)]
        order, before = 0, float("inf")
        for _ in range(_MOST_STEPS):
            found, *_ = functions(self.m, self.blocks, t)
            slope, bend = (_dot(row, found) for row in weights[order : order + 2])
            size = _dot(map(abs, weights[order + 1]), sizes(self.m, self.blocks, t, t)) if order < most else 0
            if abs(bend) < self.m.slack**_FEW * size:
                order, before = order + 1, float("inf")
                continue
            if not abs(slope) < before * (abs(bend) if order else bend):
                break
            before = abs(slope / bend)
            t = t - slope / bend
        return t

    def suspects(self, mesh: "Mesh", until: Number) -> Iterator[tuple[Number, Number, int | None]]:
        """Yield intervals (lo, hi, guard) of (0, until) in order, outside which no guard has a root.

        The guard, if one is given, falls through zero just once there, and the others stay positive.
        Raises ``TooLarge`` where a part of a guard grows beyond the numbers in use, ``OverflowError`` where only its
        exponential does.
        """
        last = self._last()
        coarse = self._in_doubles
        for window in mesh.windows():
            suspect = coarse._suspects(window) if coarse else zip(range(len(window.h)), repeat(None))
            for k, falling in suspect:
                if window.t[k] >= until or window.t[k + 1] > last:
                    break
                lo, hi = self.m.number(window.t[k]), self.m.number(window.t[k + 1])
                yield (lo, hi, falling if coarse is self else None) if hi <= until else (lo, until, None)
            if window.t[-1] >= min(until, last):
                break
        if until > last:
            self._refuse(last)

    @cached_property
    def _in_doubles(self):
        """The guards in doubles, which rule out intervals for any numbers; None beyond their range."""
        if self.m is Doubles:
            return self
        with suppress(OverflowError):
            return Guards(self.segment.in_doubles())
        return None

    def _last(self):
        """Return the time at which a part of a guard leaves the range of the numbers in use."""
        times = [float("inf")]
        for rate, size in self._growing():
            times.append(MOST_EXPONENT / rate if self.m is Doubles else self.m.log(self.m.largest / size) / rate)
        return min(times)

    def _growing(self):
        """Return (rate, size at the start) of the parts of guards that grow."""
        rates, sizes = self.segment.flow.rate.diagonal(), abs(self.segment.guards[: self.segment.functions])
        return [(rate, max(row)) for rate, row in zip(rates, sizes.tolist(), strict=True) if rate > 0 and any(row)]

    def _refuse(self, last):
        rate, size = max(self._growing())
        if self.m is Doubles and size < _NOTHING:
            raise OverflowError
        raise TooLarge(f"the state grows like exp({float(rate):.6g} t) for a time of {float(last):.6g}, beyond the "
                       "numbers in use: take a smaller until")  # fmt: skip

    @np.errstate(all="ignore")
    def _suspects(self, window):
        """Return (interval, guard that falls there, or None) of a window, by the verdicts of ``_verdict`` on arrays."""
        s, margin = self.segment, self.m.margin
        g, off = window.sums @ s.guards, window.off_sums @ s.off.guards * margin
        low, spare = g - off, window.areas @ abs(s.bends)
        above = np.minimum(low[:-1], low[1:]) > spare * window.h / 4
        left = np.flatnonzero(~above.all(axis=1))
        if not left.size:
            return []
        rise, off_rise = window.values @ s.slopes, window.off_values @ s.off.slopes * margin
        both, off_both = rise[left] + rise[left + 1], spare[left] + off_rise[left] + off_rise[left + 1]
        rising, falling, clear = both > off_both, both < -off_both, low[left] > 0
        if s.zero and window.t[0] == 0:
            clear[left == 0, s.zero] = True
            for guard in s.zero:
                if not (rising | above[left])[left == 0, guard].all():
                    above[:, guard] |= window.t[1:] <= self.reach(guard)
        positive = above[left] | (rising & clear) | (falling & (low[left + 1] > 0))
        falls = falling & (low[left] > 0) & (g[left + 1] + off[left + 1] < 0)
        single = (positive | falls).all(axis=1) & (falls.sum(axis=1) == 1)
        places = np.flatnonzero(~positive.all(axis=1))
        guards = np.where(single, falls.argmax(axis=1), None)
        return zip(left[places].tolist(), guards[places].tolist(), strict=True)

    def reach(self, guard: int) -> Number:
        """Return a time up to which a guard that vanishes at the start is positive."""
        if guard not in self._reaches:
            self._reaches[guard] = _reach(self.segment, guard)
        return self._reaches[guard]


def _reach(segment, guard):
    """Return a time up to which a guard that vanishes at the start is positive.

    Let ``g^(p)(0) = v > 0`` be its first derivative that does not vanish. g is positive up to a time h up to which the
    integral of ``|g^(p+1)|`` is below v. Raises ``Undecided`` where v is negative or none is found.
    """
    m, flow = segment.m, segment.flow
    weights, off = segment.slopes[:, guard], segment.off.slopes[:, guard]
    margin, start, rate_sizes = max(m.margin, m.slack), np.array(initial(flow.blocks)), abs(flow.rate)
    for _ in weights:
        value, doubt = start @ weights, margin * (start @ off)
        if abs(value) > doubt:
            break
        weights, off = flow.rate @ weights, rate_sizes @ off
    if value <= doubt:
        raise Undecided
    bends, fastest = abs(flow.rate @ weights).tolist(), max(rate_sizes.sum(axis=0).tolist())
    h = _REACH / fastest if fastest else m.number(1)
    for _ in range(_MOST_STEPS):
        if _dot(bends, areas(m, flow.blocks, 0 * h, h)) < value - doubt:
            return h
        h = h / 4
    raise Undecided


def _dot(first, second):
    return sum(map(mul, first, second))


def _isolated(guards, lo, hi, until):
    """Return (found, point up to which there is no other root) for an interval that a root may be in.

    ``lo`` is a time or a ``GuardValues``.
    """
    left = lo if isinstance(lo, GuardValues) else guards.at(lo)
    right = _certain(guards, left.t, hi, until)
    done, pieces = right, [right]
    for step in range(_MOST_STEPS):
        right = pieces[-1]
        verdicts = _verdicts(guards, left, right, guards.bounds(left.t, right.t))
        if step > _PATIENCE and "unknown" in verdicts:
            verdicts = _closer_verdicts(guards, left, right)
        fall = [q for q, verdict in zip(guards.every, verdicts, strict=True) if verdict == "falls"]
        if all(verdict == "positive" for verdict in verdicts):
            left = pieces.pop()
            if not pieces:
                return None, done
        elif {*verdicts} <= {"positive", "falls"}:
            return _earliest(guards, fall, left, right), done
        elif (touch := _touch(guards, left, right, verdicts)) is not None:
            return touch, done
        else:
            pieces.append(_cut(guards, left, right, verdicts))
    raise Undecided


def _touch(guards, left, right, verdicts):
    """Return (time, guards) where guards come down to zero and up again, as far as digits tell; or None.

    Others may fall at the same time. Raises ``Undecided`` unless signs are to be taken as they are.
    """
    m, unknown = guards.m, [q for q in guards.every if verdicts[q] != "positive"]
    if right.t - left.t > right.t * _NARROW and "unknown" in verdicts:
        return None
    lows = sorted((_low(guards, q, left.t, right.t, verdicts[q]), q) for q in unknown)
    points = {q: guards.at(t, m.slack) for t, q in lows}
    if any(abs(point.values[q]) > point.doubts[q] for q, point in points.items()):
        return None
    if m.margin:
        raise Undecided
    t, first = lows[0]
    return t, tuple(q for q in points if abs(points[first].values[q]) <= points[first].doubts[q])


def _low(guards, q, lo, hi, verdict):
    """Return where a guard falls through zero, or is least."""
    middle = (lo + hi) / 2
    if verdict == "falls":
        return guard_root(guards, q, lo, hi, middle)
    return guards.dip(q, lo, hi) if verdict == "dips" else max(lo, min(guards.least(q, middle), hi))


def _earliest(guards, fall, left, right):
    """Return (time, guards) of the first of the roots of guards that fall; of several where digits do not part them.

    Doubles leave that to more digits.
    """
    starts = [left.t + (right.t - left.t) * left.values[q] / (left.values[q] - right.values[q]) for q in fall]
    roots = sorted((guard_root(guards, q, left.t, right.t, t), q) for q, t in zip(fall, starts, strict=True))
    t, first = roots[0]
    point = guards.at(t)
    together = [q for _, q in roots[1:] if point.values[q] <= point.doubts[q]]
    if together and guards.m is Doubles:
        raise Undecided
    return t, (first, *together)


def _certain(guards, lo, hi, until):
    """Return the point at hi, or at a later time where every guard has a sign; or at ``until``.

    A guard that is within its rounding at ``until`` counts as lost there.
    """
    for _ in range(_MOST_STEPS):
        point = guards.at(hi, max(guards.m.margin, guards.m.slack) if hi >= until else None)
        if hi >= until or _signs(point):
            return point
        hi = min(lo + (hi - lo) * _FURTHER, until)
    raise Undecided


def _signs(point):
    return all(abs(g) > off for g, off in zip(point.values, point.doubts, strict=True))


def _cut(guards, left, right, verdicts):
    """Return a point between where every guard has a sign: where one is least, if that is known."""
    times = [guards.dip(q, left.t, right.t) for q in guards.every if verdicts[q] == "dips"]
    times += [left.t + (right.t - left.t) * part for part in _CUTS]
    if not left.t:
        times = [reach for q in guards.segment.zero if (reach := guards.reach(q)) < right.t] + times
    for t in times:
        if left.t < t < right.t:
            point = guards.at(t)
            if _signs(point):
                return point
    raise Undecided


def _verdicts(guards, left, right, areas):
    return [_verdict(guards, q, left, right, area) for q, area in zip(guards.every, areas, strict=True)]


def _verdict(guards, q, left, right, area):
    h = right.t - left.t
    (a, off_a), (b, off_b) = ((p.values[q], p.doubts[q]) for p in (left, right))
    if min(a - off_a, b - off_b) > area * h / 4:
        return "positive"
    both = left.slopes[q] + right.slopes[q]
    spare = area + left.slope_doubts[q] + right.slope_doubts[q]
    touching = not left.t and q in guards.segment.zero
    if (both > spare and (touching or a > off_a)) or (touching and h <= guards.reach(q)):
        return "positive"
    if both < -spare and not touching:
        return "positive" if b > off_b else "falls" if a > off_a else "unknown"
    return "unknown"


def _closer_verdicts(guards, left, right):
    """Return the verdicts by the dearer bounds, and by how the guards bend: "dips" is what has one least value."""
    bent = guards.bending(left.t, right.t)
    verdicts = _verdicts(guards, left, right, [bending.area for bending in bent])
    return [_bent_verdict(guards, q, left, right, bent[q]) if verdict == "unknown" else verdict
            for q, verdict in zip(guards.every, verdicts, strict=True)]  # fmt: skip


def _bent_verdict(guards, q, left, right, bending):
    """Return the verdict on a guard whose bend keeps its sign, and that has one at the ends, too."""
    (a, off_a), (b, off_b) = ((p.values[q], p.doubts[q]) for p in (left, right))
    if abs(bending.middle) <= bending.spread or a <= off_a or abs(b) <= off_b:
        return "unknown"
    if b < 0:
        return "unknown" if _is_rounding(guards, q, right.t, b) else "falls"
    if bending.middle < 0 or left.slopes[q] > left.slope_doubts[q] or right.slopes[q] < -right.slope_doubts[q]:
        return "positive"  # it is least at an end
    least = guards.at(guards.dip(q, left.t, right.t), max(guards.m.margin, guards.m.slack))
    below = (abs(least.slopes[q]) + least.slope_doubts[q]) * (right.t - left.t)
    return "positive" if least.values[q] > least.doubts[q] + below else "dips"


def guard_root(guards: Guards, q: int, lo: Number, hi: Number, t: Number) -> Number:
    """Return the root of a guard that falls from plus at ``lo`` to minus at ``hi``, by Newton's method from ``t``.

    Beside a double root, or at a triple one, each step is a part of the one before: the next goes to their limit.
    """
    close, shrunk, before = (hi - lo) * guards.m.root_tol, guards.m.root_tol**0.5, 0 * lo
    for _ in range(_MOST_STEPS):
        value, slope = guards.value(q, t)
        if value > 0:
            lo = t
        else:
            hi = t
        new = t - value / slope if slope < 0 else lo
        step = abs(new - t)
        if slope < 0 and step <= close and (step <= shrunk * before or _is_rounding(guards, q, t, value)):
            value, slope = guards.value(q, new)
            return new - value / slope if slope else new
        if _SLOW * before < step < before:
            new, step = t + (new - t) * before / (before - step), 0 * step
        if not lo < new < hi:
            new = lo + (hi - lo) / 2
            if not lo < new < hi:
                return t
        t, before = new, step
    raise Undecided


def _is_rounding(guards, q, t, value):
    return abs(value) <= guards.at(t, guards.m.slack).doubts[q]
