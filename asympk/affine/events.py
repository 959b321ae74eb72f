"""The first root of any guard of an affine mode, isolated by bounds (Lemma 6): no guard is sampled.

On [lo, hi] of length h let the integral of ``|g''|`` be at most S. Then g stays above ``min(g(lo), g(hi)) - S h/4``,
and its slope lies between ``(g'(lo) + g'(hi) -+ S)/2``. Where g'' keeps its sign, the least value of g decides. So an
interval has no root, or one guard falls through zero once while the others stay positive, or the interval is cut.
``Guards.suspects`` bounds the guards in doubles on a mesh kept per mode, and yields the intervals that may have a root;
``_isolated``, the hard function, cuts them. The mesh is left where the sizes of all parts exclude later roots.

A value within its rounding error has no sign. Cuts avoid times with such values; ``Undecided`` is raised where no other
time is left. At ``until`` a guard with such a value is lost, as a motion that ends at an event meets it, unless it
falls so slowly that it would be 0 much later only. Where ``m.margin`` is 0, a guard whose least value is within its
rounding error touches zero and is lost, too; the same mode may follow.
"""

from collections.abc import Iterator
from contextlib import suppress
from functools import cache, cached_property, partial
from itertools import repeat
from operator import mul
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from asympk.affine.functions import (
    MOST_EXPONENT,
    Arrays,
    areas,
    functions,
    initial,
    least_at_ends,
    rounding_sizes,
    sizes,
)
from asympk.arithmetic import Doubles
from asympk.errors import TooLarge, Undecided
from asympk.numbers import Number

if TYPE_CHECKING:
    from asympk.affine.mesh import FunctionTable, Mesh
    from asympk.affine.mode import ClosedSegment, Parts

_CUTS = (0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875, 0.03125, 0.96875)
_MOST_STEPS = 200
_FURTHER = 1.375
_NOTHING = 1e-8
_ORDER = 16
_REACH = 16  # the first trial of ``_reach``, in units of the time of the fastest part
_PATIENCE = 2  # the number of steps, and of open intervals, before the costlier bounds are used
_FEW = 0.125  # the part of the digits to which g'' must be 0 to count as 0 where g' is; higher derivatives alike
_SLOW = 0.4  # the ratio of successive Newton steps beyond which the root is taken not to be simple
_NARROW = 1e-6  # the length of an interval, relative to the time, up to which an undecided guard may touch zero


class GuardValues(NamedTuple):
    """All guards at one time: their values and slopes, and bounds of the errors of both, the doubts."""

    t: Any
    values: list
    slopes: list
    doubts: list
    slope_doubts: list


class Verdicts(NamedTuple):
    """Whether each guard is positive, and whether it falls through zero just once: (.., intervals, guards)."""

    positive: np.ndarray
    falls: np.ndarray

    @property
    def clear(self) -> np.ndarray:
        """Whether all guards are positive, by interval."""
        return np.logical_and.reduce(self.positive, axis=-1)

    @property
    def single(self) -> np.ndarray:
        """Whether one guard falls and the others are positive, by interval."""
        return (self.falls.sum(axis=-1) == 1) & np.logical_and.reduce(self.positive | self.falls, axis=-1)


def judge(
    known: "FunctionTable", parts: "Parts | ClosedSegment", term_sizes: "Parts", margin: float, touching: np.ndarray,
    areas: np.ndarray | None = None,
) -> Verdicts:
    """Return the ``Verdicts`` on the intervals of a table, by the rules of ``_verdict`` on arrays.

    ``term_sizes`` are the sizes of ``parts``; both may have an axis of rows before their others. ``touching`` marks the
    guards that vanish at the beginning of an interval. ``areas`` may be closer bounds of the integrals of ``|g''|``.
    """
    g, doubt = _on(known.sums, parts.guards), _on(known.off_sums, term_sizes.guards) * margin
    low, high, bending = g - doubt, g + doubt, _on(known.areas, abs(parts.bends)) if areas is None else areas
    above = np.minimum(low[..., :-1, :], low[..., 1:, :]) > bending * known.h / 4
    if above.all():
        return Verdicts(above, ~above)
    rise, doubt = _on(known.values, parts.slopes), _on(known.off_values, term_sizes.slopes) * margin
    both, doubt = rise[..., :-1, :] + rise[..., 1:, :], bending + doubt[..., :-1, :] + doubt[..., 1:, :]
    clear, falling = low[..., :-1, :] > 0, (both < -doubt) & ~touching
    positive = above | ((both > doubt) & (clear | touching)) | (falling & (low[..., 1:, :] > 0))
    return Verdicts(positive, falling & clear & (high[..., 1:, :] < 0))


def _on(known, weights):
    """Return products (.., times, guards) of a table, (times, r) for all rows or (rows, times, r), with weights."""
    if known.ndim > 2 or weights.ndim == 2:
        return known @ weights
    rows, size, guards = weights.shape
    product = known @ weights.transpose(1, 0, 2).reshape(size, rows * guards)
    return product.reshape(-1, rows, guards).transpose(1, 0, 2)


class Bending(NamedTuple):
    """The second derivatives of guards on an interval: g'' at the middle, bounds of its change and of its integral."""

    middle: Any
    spread: Any
    area: Any


def first_root(guards: "Guards", until: Number, mesh: "Mesh") -> tuple[Number, tuple[int, ...]] | None:
    """Return (time, indices of the guards) of the first root in (0, until], or None; raises ``Undecided``."""
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
    """The guards of one segment as functions of time, with bounds of their derivatives; ``every`` are their indices."""

    def __init__(self, segment: "ClosedSegment"):
        self.segment, self.m, self.blocks = segment, segment.m, segment.flow.blocks
        self.every = range(segment.slopes.shape[1])
        self.reach = cache(partial(_reach, segment))

    @cached_property
    def lists(self) -> tuple[list, ...]:
        """Weights and sizes as lists: per guard for sums, slopes and bends, per number of started blocks for bases."""
        s, doubts, functions = self.segment, self.segment.term_sizes, self.segment.functions
        columns = [table[:functions].T.tolist() for table in (s.guards, doubts.guards, s.slopes, doubts.slopes)]
        return *columns, abs(s.bends).T.tolist(), s.guards[functions:].tolist(), doubts.guards[functions:].tolist()

    def at(self, t: Number, margin: Number | None = None) -> GuardValues:
        """Return the ``GuardValues`` at t; doubts are the sizes of the terms times ``margin``, by default ``m.margin``.

        The doubts of slopes are at least the rounding error: where a guard touches zero, its slope is no larger.
        """
        margin = self.m.margin if margin is None else margin
        found, gained, begun = functions(self.m, self.blocks, t)
        off_gained, off_found = rounding_sizes(self.m, self.blocks, t)
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

    def floors(self, lo: Number, hi: Number) -> list[Number]:
        """Return a lower bound of every guard on [lo, hi], term by term; see ``least_at_ends``."""
        m, blocks = self.m, self.blocks
        (first, begun), (last, later) = (functions(m, blocks, t)[1:] for t in (lo, hi))
        if begun != later:
            return [float("-inf") for _ in self.every]
        signs = [signs for block in blocks for signs in least_at_ends(block, hi)]
        low, high = (rounding_sizes(m, blocks, t)[0] for t in (lo, hi))
        ends = (first, low, last, high, sizes(m, blocks, lo, hi), signs)
        weights, off_weights, _, _, _, bases, off_bases = self.lists
        found = [base - m.margin * off for base, off in zip(bases[begun], off_bases[begun], strict=True)]
        for q in self.every:
            for w, off, a, off_a, b, off_b, size, least_at_end in zip(weights[q], off_weights[q], *ends, strict=True):
                low = min(w * a - m.margin * off * off_a, w * b - m.margin * off * off_b)
                found[q] += low if (w > 0) in least_at_end else -2 * off * size
        return found

    @cached_property
    def derivatives(self) -> np.ndarray:
        """The weights of the guards' derivatives from the second to that of order ``_ORDER``: (orders, guards, r)."""
        found = [self.segment.bends]
        while len(found) <= _ORDER - 2:
            found.append(self.segment.flow.rate @ found[-1])
        return np.stack(found).transpose(0, 2, 1)

    def bending(self, lo: Any, hi: Any) -> Bending:
        """Return the ``Bending`` of all guards on [lo, hi], or on arrays of intervals: (guards, ..).

        It comes from the Taylor series of g'' at the middle. Large weights of close eigenvalues cancel in the
        derivatives at the middle and matter little in the remainder.
        """
        m, half = Arrays if isinstance(lo, np.ndarray) else self.m, (hi - lo) / 2
        margin = max(self.m.margin, self.m.slack)
        values = self.derivatives @ np.array(functions(m, self.blocks, lo + half)[0])
        doubts = abs(self.derivatives) @ np.array(sizes(m, self.blocks, lo, hi))
        terms = [*(abs(values) + doubts * margin)[:-1], doubts[-1]]
        powers = [1 + 0 * half]
        while len(powers) < len(terms):
            powers.append(powers[-1] * half / len(powers))
        area = sum(term * (2 * half * p / k) for k, (p, term) in enumerate(zip(powers, terms, strict=True), 1))
        return Bending(values[0], doubts[0] * margin + _dot(terms[1:], powers[1:]), area)

    def value(self, guard: int, t: Number) -> tuple[Number, Number]:
        """Return the value and the slope of one guard."""
        found, gained, begun = functions(self.m, self.blocks, t)
        weights, _, slopes, _, _, bases, _ = self.lists
        return bases[begun][guard] + _dot(weights[guard], gained), _dot(slopes[guard], found)

    def dip(self, guard: int, lo: Number, hi: Number, most: int = 0) -> Number:
        """Return the time in [lo, hi] at which a convex guard is least, by Newton's method from the middle.

        Its slope vanishes there. Where g'' vanishes at the same time, to part of the digits, the zero of the highest
        derivative that vanishes there is taken instead, up to ``most`` orders beyond the first.
        """
        weights = [self.lists[2][guard], *self.derivatives[:, guard].tolist()]
        order, before, t = 0, float("inf"), (lo + hi) / 2
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
        return max(lo, min(t, hi))

    def suspects(self, mesh: "Mesh", until: Number) -> Iterator[tuple[Number, Number, int | None]]:
        """Yield intervals (lo, hi, guard) of (0, until) in order, outside which no guard has a root.

        If ``guard`` is given, it falls through zero exactly once in the interval, and the others stay positive.
        Raises ``TooLarge`` where a part of a guard exceeds the range of the numbers, and ``OverflowError`` where the
        exponential exceeds this range while its weight is negligible at the start.
        """
        last, cut, coarse = self._last(), self._cut(), self._in_doubles
        end = self.m.number(last) if last < until else until
        for number, window in enumerate(mesh.windows(), 1):
            seen = coarse and (coarse is self or window.t[-1] <= cut)
            suspect = coarse._suspects(window) if seen else zip(range(len(window.h)), repeat(None))
            for k, falling in suspect:
                if window.t[k] >= end:
                    break
                lo, hi = self.m.number(window.t[k]), self.m.number(window.t[k + 1])
                yield (lo, hi, falling if coarse is self else None) if hi <= end else (lo, end, None)
            left = window.t[-1], float(end)
            if left[0] >= left[1] or (seen and end <= cut and number.bit_count() == 1 and coarse._is_clear(*left)):
                break
        if until > last:
            self._refuse(last)

    @np.errstate(all="ignore")
    def _is_clear(self, lo, hi):
        """Tell whether all guards are positive on [lo, hi], however long, as the sizes of their parts show.

        A pair is at least minus its amplitude; see ``least_at_ends``.
        """
        weights, off, margin = self.segment.guards, self.segment.term_sizes.guards, self.m.margin
        ends = [functions(Arrays, self.blocks, t)[0] for t in (lo, hi)]
        most, least, at = sizes(Arrays, self.blocks, lo, hi), weights[-1] - margin * off[-1], 0
        for block in self.blocks:
            for signs in least_at_ends(block, hi)[:: 2 if block.turn else 1]:
                part = slice(at, at := at + (2 if block.turn else 1))
                low = np.outer([end[part][0] for end in ends], weights[part][0]).min(axis=0)
                amplitude = np.hypot.reduce(weights[part]) * most[part][0]
                doubt = margin * (1 + (block.fastest - block.turn) * hi) * off[part].sum(axis=0) * most[part][0]
                least = least + np.where(np.isin(weights[part][0] > 0, signs), low, -amplitude) - doubt
        return (least > 0).all()

    @cached_property
    def _in_doubles(self):
        """The guards in doubles, whose bounds exclude intervals also for mpmath numbers; None beyond their range."""
        if self.m is Doubles:
            return self
        with suppress(OverflowError):
            return Guards(self.segment.in_doubles())
        return None

    def _last(self):
        """Return the time at which a part of a guard leaves the range of the numbers in use."""
        if self.m is Doubles:
            return self._cut()
        return min((self.m.log(self.m.largest / size) / rate for rate, size in self._growing()), default=float("inf"))

    def _cut(self):
        """Return the time at which the exponent of a part of a guard is cut on the mesh, whatever its weight is."""
        return min((MOST_EXPONENT / rate for rate, _ in self._growing()), default=float("inf"))

    def _growing(self):
        """Return (rate, size at the start) of the parts of guards that grow."""
        rates, sizes = self.segment.flow.rate.diagonal(), abs(self.segment.guards[: self.segment.functions])
        return [(rate, max(row)) for rate, row in zip(rates, sizes.tolist(), strict=True) if rate > 0 and any(row)]

    def _refuse(self, last):
        rate, size = max(self._growing())
        if self.m is Doubles and size < _NOTHING:
            raise OverflowError
        raise TooLarge(f"the state grows like exp({float(rate):.6g} t) for a time of {float(last):.6g}, beyond the "
                       "numbers in use: take a smaller until")

    @np.errstate(all="ignore")
    def _suspects(self, window):
        """Return the (interval, guard that falls there or None) of a window."""
        s, starts = self.segment, not window.t[0]
        touching = np.zeros((len(window.h), len(self.every)), dtype=bool)
        touching[0, s.zero] = starts
        verdicts = judge(window, s, s.term_sizes, self.m.margin, touching)
        for guard in s.zero if starts else ():
            if not verdicts.positive[0, guard]:
                verdicts.positive[:, guard] |= window.t[1:] <= self.reach(guard)
        self._look_closer(window, verdicts, touching)
        places = np.flatnonzero(~verdicts.clear)
        if not places.size:
            return []
        guards = np.where(verdicts.single[places], verdicts.falls[places].argmax(axis=1), None)
        return zip(places.tolist(), guards.tolist(), strict=True)

    def _look_closer(self, window, verdicts, touching):
        """Change the verdicts on many open intervals before the first fall to those by the bounds of ``bending``.

        Functions that leave the range of doubles are cut, and have no such bounds.
        """
        s, fallen = self.segment, (window.sums[1:] @ self.segment.guards < 0).any(axis=1)
        before = min(fallen.argmax() + 1 if fallen.any() else len(fallen), (window.t[1:] <= self._last()).sum())
        open_ = np.flatnonzero(~(verdicts.clear | verdicts.single)[:before])
        if open_.size > _PATIENCE:
            bent = self.bending(window.t[open_], window.t[open_ + 1]).area.T[:, None]
            closer = judge(window.intervals(open_), s, s.term_sizes, self.m.margin, touching[open_, None], bent)
            for known, found in zip(verdicts, closer, strict=True):
                known[open_] |= found[:, 0]


def _reach(segment, guard):
    """Return a time up to which a guard that vanishes at the start is positive.

    Let ``g^(p)(0) = v > 0`` be the first nonvanishing derivative. Then g is positive up to h if the integral of
    ``|g^(p+1)|`` up to h is below v. Raises ``Undecided`` where v is negative or no such derivative or h is found.
    """
    m, flow = segment.m, segment.flow
    weights, off = segment.slopes[:, guard], segment.term_sizes.slopes[:, guard]
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
    """Return (first root in an interval or None, the ``GuardValues`` at the end of the searched part).

    ``lo`` is a time or a ``GuardValues``.
    """
    left = lo if isinstance(lo, GuardValues) else guards.at(lo)
    right = _certain(guards, left.t, hi, until)
    done, pieces = right, [right]
    for step in range(_MOST_STEPS):
        right = pieces[-1]
        verdicts = [_verdict(guards, q, left, right, area) for q, area in enumerate(guards.bounds(left.t, right.t))]
        if "unknown" in verdicts:
            floors = guards.floors(left.t, right.t)
            verdicts = ["positive" if low > 0 else verdict for verdict, low in zip(verdicts, floors, strict=True)]
        if step > _PATIENCE and "unknown" in verdicts:
            verdicts = _closer_verdicts(guards, left, right)
        fall = [q for q, verdict in enumerate(verdicts) if verdict == "falls" and not _decays(guards, q, right)]
        verdicts = ["positive" if verdict == "falls" and q not in fall else verdict
                    for q, verdict in enumerate(verdicts)]
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


def _decays(guards, q, right):
    """Tell whether a guard that is within its rounding error at ``until`` falls so slowly that it is 0 much later only.

    Raises ``Undecided`` instead unless ``m.margin`` is 0, where signs within rounding are trusted.
    """
    slow = right.values[q] > max(0, -right.slopes[q] * right.t * _NARROW)
    if slow and guards.m.margin:
        raise Undecided
    return slow and right.slopes[q] < -right.slope_doubts[q]


def _touch(guards, left, right, verdicts):
    """Return (time, guards) where guards touch zero within rounding, or None; others may fall at the same time.

    Raises ``Undecided`` instead of returning a time unless ``m.margin`` is 0.
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
    """Return the time at which a guard falls through zero, or else the time at which it is least."""
    if verdict == "falls":
        return guard_root(guards, q, lo, hi, (lo + hi) / 2)
    return guards.dip(q, lo, hi, 0 if verdict == "dips" else _ORDER - 2)


def _earliest(guards, fall, left, right):
    """Return (time, guards) of the first root of the guards ``fall``; several where the digits do not separate them.

    In doubles, ``Undecided`` is raised instead of returning several.
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
    """Return the ``GuardValues`` at hi, or at a later time at which every guard has a sign, or at ``until``.

    At ``until`` the doubts are at least the rounding error.
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
    """Return the ``GuardValues`` at a time between at which every guard has a sign, preferably the minimum of one."""
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


def _verdict(guards, q, left, right, area):
    h = right.t - left.t
    (a, off_a), (b, off_b) = ((p.values[q], p.doubts[q]) for p in (left, right))
    if min(a - off_a, b - off_b) > area * h / 4:
        return "positive"
    both = left.slopes[q] + right.slopes[q]
    slack = area + left.slope_doubts[q] + right.slope_doubts[q]
    touching = not left.t and q in guards.segment.zero
    if (both > slack and (touching or a > off_a)) or (touching and h <= guards.reach(q)):
        return "positive"
    if both < -slack and not touching:
        return "positive" if b > off_b else "falls" if a > off_a else "unknown"
    return "unknown"


def _closer_verdicts(guards, left, right):
    """Return the verdicts by the bounds of ``bending``; a guard that "dips" is convex and may be negative inside."""
    bent = guards.bending(left.t, right.t)
    verdicts = (_verdict(guards, q, left, right, area) for q, area in enumerate(bent.area))
    return [_bent_verdict(guards, q, left, right, bent) if verdict == "unknown" else verdict
            for q, verdict in enumerate(verdicts)]


def _bent_verdict(guards, q, left, right, bending):
    """Return the verdict on a guard that has a sign at both ends and whose g'' has one on the interval."""
    (a, off_a), (b, off_b) = ((p.values[q], p.doubts[q]) for p in (left, right))
    if abs(bending.middle[q]) <= bending.spread[q] or a <= off_a or abs(b) <= off_b:
        return "unknown"
    if b < 0:
        return "unknown" if _is_rounding(guards, q, right.t, b) else "falls"
    if bending.middle[q] < 0 or left.slopes[q] > left.slope_doubts[q] or right.slopes[q] < -right.slope_doubts[q]:
        return "positive"  # the guard is least at an end
    least = guards.at(guards.dip(q, left.t, right.t), max(guards.m.margin, guards.m.slack))
    below = (abs(least.slopes[q]) + least.slope_doubts[q]) * (right.t - left.t)
    return "positive" if least.values[q] > least.doubts[q] + below else "dips"


def guard_root(guards: Guards, q: int, lo: Number, hi: Number, t: Number) -> Number:
    """Return the root of a guard that falls from plus at ``lo`` to minus or 0 at ``hi``, by Newton's method from ``t``.

    Near a multiple root the steps decrease geometrically, and then the next step goes to their limit.
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
        new = hi if hi < new <= hi + close else new
        if not lo < new <= hi:
            new = lo + (hi - lo) / 2
            if not lo < new < hi:
                return t
        t, before = new, step
    raise Undecided


def _is_rounding(guards, q, t, value):
    return abs(value) <= guards.at(t, guards.m.slack).doubts[q]
