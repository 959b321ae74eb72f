r"""The common courses of a trajectory for small mu, each a chain of branch-free kernels.

The sign of sigma and, at the start, the signs of z and s = x + y and the side of the unstable plane name the course:

                    sigma > 0 (steep)                                        sigma < 0 (shallow)
    z > 0 < s       direct: slip_same                                        direct
    z > 0 > s       raised: slip_opposite, slip_same                         raised
                    thrown: slip_opposite, stick, slip_opposite, slip_same
    z < 0 < s       lifted: slip_opposite, stick, slip_same                  drifted: likewise, by way of Pi2, or
                                                                             passed: slip_opposite, slip_same
    z < 0 > s       turned: slip_same, and then as for z < 0 < s

These are the claims C23-C26 and C30. What makes them certain is that the slow part of every s is small (``reach``).
A course returns the final state and where it applies; nothing is promised elsewhere.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from asympk.numbers import Number
from asympk.systems.painleve_klein.arrays.kernels import (
    deviation,
    force_zero,
    mode_constants,
    pick,
    release,
    slide,
    slow_part,
    velocity_zero,
    velocity_zero_slowly,
)
from asympk.systems.painleve_klein.arrays.safeguarded import EXTENDED
from asympk.systems.painleve_klein.modes import coefficients, other_edge, positive_edge

if TYPE_CHECKING:
    from asympk.systems.painleve_klein.arrays.kernels import ModeConstants

SAFE = 1e-10
NEAR = 1e-6
SMALLEST = 1e-3
SELDOM = 1e-3
FINER = 1024.0
BLOCK = 16384
NONE = np.array([], dtype=np.intp)


@dataclass(frozen=True)
class Setting:
    """Parameters of the trajectories: floats, or arrays of one length."""

    sigma: Any
    sigma0: Any
    mu: Any

    def rows(self, rows: np.ndarray | slice) -> "Setting":
        """Return the parameters of some of the trajectories."""
        values = self.sigma, self.sigma0, self.mu
        return Setting(*pick(rows, *values)) if any(isinstance(v, np.ndarray) for v in values) else self

    @cached_property
    def same(self) -> "ModeConstants":
        return self._mode("slip_same")

    @cached_property
    def opposite(self) -> "ModeConstants":
        return self._mode("slip_opposite")

    @cached_property
    def stick(self) -> "ModeConstants":
        return self._mode("stick")

    def _mode(self, name):
        a, b = coefficients(name, self.sigma)
        return mode_constants(1.0 * a, 1.0 * b, self.mu)

    @cached_property
    def upper_edge(self) -> Number:
        return positive_edge(self.sigma0)

    @cached_property
    def lower_edge(self) -> Number:
        return other_edge(self.sigma0)

    @cached_property
    def steep(self) -> Number:
        return np.greater(self.sigma, 0)

    @cached_property
    def holds(self) -> Number:
        """Whether z = 0 is met within the static cone by what comes along Pi2, where s = -1/sigma."""
        return np.greater(self.sigma0 + 3, -self.sigma)

    @cached_property
    def seldom_misfits(self) -> Number:
        """Whether so few starts of size one do not fit their course that each may be followed alone."""
        return self.mu <= SELDOM * np.minimum(self.sigma * self.sigma, 1.0)

    @cached_property
    def reach(self) -> Number:
        r"""Bound on |x|, |z| and mu |y| below which the courses hold, or 0.

        It keeps |A| below ``1/(mu m)`` in every mode, with m the largest of b - 1, 2, 2 (sigma+1) and 2/edge: then s
        and s' have at most one zero in a mode of a course, and so has z or it has none. For a small sigma the fast part
        may change by so little that its logarithm tells no time.
        """
        size = np.abs(self.sigma)
        apart = (self.mu <= 0.0625 * np.minimum(size * size, 1.0)) & (self.mu >= 1e-200)
        apart &= size >= np.where(self.steep, SMALLEST, 0.25)
        most = 0.3 / (self.mu * (2.3 * self.sigma0 + 7)) - 0.3 / size - 0.3
        return np.where(apart, np.minimum(most, 1e3), 0.0)


def direct(
    p: Setting, x: Number, y: Number, z: Number, until: Number, log: Callable
) -> tuple[tuple[Number, ...], np.ndarray]:
    """Slip on with s > 0 unless the first fall of z is too deep."""
    m = p.same
    fast_x = m.to_x * deviation(m, x, y)
    end_x, end_y, gone = slide(m, x, y, x - m.rest - fast_x, until)
    return (end_x, end_y, z + gone), z > (m.bend * m.fast) * fast_x


def lifted(
    p: Setting, x: Number, y: Number, z: Number, until: Number, log: Callable, t: Number | None = None
) -> tuple[tuple[Number, ...], np.ndarray]:
    """The load grows until z = 0, sticks, and slips."""
    dt, x, y = velocity_zero(p.opposite, x, y, z)
    t = dt if t is None else t + dt
    log("velocity_zero", t, x, y, 0.0)
    return _stuck(p, t, x, y, until, log)


def drifted(
    p: Setting, x: Number, y: Number, z: Number, until: Number, log: Callable, t: Number = 0.0
) -> tuple[tuple[Number, ...], np.ndarray]:
    """The load falls upon Pi2 and stays there until z = 0, sticks, and slips."""
    dt, x, y = velocity_zero_slowly(p.opposite, x, y, z)
    t = t + dt
    log("velocity_zero", t, x, y, 0.0)
    return _stuck(p, t, x, y, until, log)


def passed(
    p: Setting, x: Number, y: Number, z: Number, until: Number, log: Callable, t: Number = 0.0
) -> tuple[tuple[Number, ...], np.ndarray]:
    """The load falls upon Pi2, and stays there until z = 0 is crossed."""
    dt, x, y = velocity_zero_slowly(p.opposite, x, y, z)
    t = t + dt
    log("velocity_zero", t, x, y, 0.0)
    left = until - t
    m = p.same
    slow_x = x - m.rest - m.to_x * deviation(m, x, y)
    return slide(m, x, y, slow_x, left), (x + y < p.upper_edge * (1 - SAFE)) & (left > SAFE * until)


def _turned(then):
    """Return the course in which the load changes its sign first.

    Where z comes to 0 before that, what follows is a run backwards in time that ``then`` does not fit.
    """

    def turned(p, x, y, z, until, log):
        m = p.same
        t, end_x = force_zero(m, x, y, x + y)
        end_z = z + m.rest * t - m.bend * (end_x + y)
        log("force_zero", t, end_x, -end_x, end_z)
        return then(p, end_x, -end_x, end_z, until, log, t)

    return turned


turned, turned_drifted, turned_passed = map(_turned, (lifted, drifted, passed))


def raised(
    p: Setting, x: Number, y: Number, z: Number, until: Number, log: Callable
) -> tuple[tuple[Number, ...], np.ndarray]:
    """The load grows through zero, in a time in which z cannot fall as far as to 0."""
    s = x + y
    w, clear = _deviation(p, x, y)
    end, fits, t, lifted = _freed(p, 0.0, x, y, s, z, until, log, w)
    fall = 1 + (p.sigma + 1) * s
    lowest = z - fall * (lifted - t - z) / (1 - fall)
    high = (fall >= 0) | ((lowest > NEAR) & (p.mu * y > -1 - p.sigma * s))
    return end, fits & high & (clear | ~p.steep)


def thrown(
    p: Setting, x: Number, y: Number, z: Number, until: Number, log: Callable
) -> tuple[tuple[Number, ...], np.ndarray]:
    """The load grows downwards until z = 0, sticks, and slips."""
    edge = p.lower_edge
    w, clear = _deviation(p, x, y)
    t, x, y = velocity_zero(p.opposite, x, y, z, w)
    log("velocity_zero", t, x, y, 0.0)
    dt, x = release(p.stick, x, y, edge)
    grips = _grips(p, dt)
    t, y = t + dt, edge - x
    log("slip_onset", t, x, y, 0.0)
    end, fits, *_ = _freed(p, t, x, y, edge, 0.0, until, log)
    return end, fits & grips & clear


def _stuck(p, t, x, y, until, log):
    edge = p.upper_edge
    dt, x = release(p.stick, x, y, edge)
    grips = _grips(p, dt)
    t, y = t + dt, edge - x
    log("slip_onset", t, x, y, 0.0)
    left = until - t
    return slide(p.same, x, y, slow_part(p.same, x, edge), left), grips & (left > SAFE * until)


def _grips(p, dt):
    """Tell where the load that arrives is clearly in the static cone: it then takes time to come to its edge."""
    return dt > SAFE / abs(p.stick.fast)


def _freed(p, t, x, y, s, z, until, log, w=None):
    m = p.opposite
    dt, end_x = force_zero(m, x, y, s, w)
    z = z + m.rest * dt - m.bend * (end_x + y)
    t = t + dt
    log("force_zero", t, end_x, -end_x, z)
    left = until - t
    x, y, gone = slide(p.same, end_x, -end_x, slow_part(p.same, end_x, 0.0), left)
    return (x, y, z + gone), left > SAFE * until, dt, z


def _deviation(p, x, y):
    """Return the deviation from the slow line of slip_opposite, and where its rounding does not show.

    Where it would in doubles, the deviation is taken in extended precision.
    """
    w = deviation(p.opposite, x, y)
    doubt = np.maximum(0.5 * p.mu / p.sigma, SAFE) * (np.abs(x) + np.abs(y) + 1 / p.sigma)
    clear = np.abs(w) > doubt
    near = np.flatnonzero(~clear & p.steep) if EXTENDED else NONE
    if near.size:
        sigma, mu, near_x, near_y = (np.broadcast_to(v, x.shape)[near].astype(EXTENDED) for v in (p.sigma, p.mu, x, y))
        w[near] = deviation(mode_constants(1.0, -sigma, mu), near_x, near_y).astype(float)
        clear[near] = np.abs(w[near]) > doubt[near] / FINER
    return w, clear


EVENTS = {direct: 0, raised: 1, thrown: 3, lifted: 2, turned: 3, drifted: 2, turned_drifted: 3, passed: 1,
          turned_passed: 2}


def follow_itineraries(
    p: Setting,
    x: Number,
    y: Number,
    z: Number,
    until: Number,
    final: np.ndarray,
    count: np.ndarray,
    note: Callable | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Put final states and numbers of events of the trajectories on common courses in place.

    Return the rows of no course, and those that do not fit the course that they seemed to take. ``note(kind, rows, t,
    x, y, z)`` is told the events, those of a trajectory in order of time.
    """
    if not np.any(p.reach > 0):
        return np.arange(x.size), NONE
    others, misfits = NONE, [NONE]
    for course, rows in _sorted_out(p, x, y, z, until):
        if course is None:
            others = rows
            continue
        misfits += [_along(course, block, p, x, y, z, until, final, count, note) for block in _blocks(rows)]
    return others, np.concatenate(misfits)


def _sorted_out(p, x, y, z, until):
    """Yield (course, its rows), at last (None, the rows of no course)."""
    s = x + y
    within = [np.all(np.maximum(v.max(), -v.min()) * size < p.reach) for v, size in ((x, 1.0), (y, p.mu), (z, 1.0))]
    if all(within) and np.all(until > 0) and np.all(p.steep):
        for course, z_side, s_side in ((direct, 1, 1), (lifted, -1, 1), (turned, -1, -1)):
            if _all_beyond(z, z_side) and _all_beyond(s, s_side):
                yield course, slice(0, x.size)
                return
    common = until > 0
    for v, size, inside in zip((x, y, z), (1.0, p.mu, 1.0), within, strict=True):
        common = common if inside else common & (np.abs(v) * size < p.reach)
    above, below = common & (z > NEAR), common & (z < -NEAR)
    pushed, pulled = s > NEAR, s < -NEAR
    yield direct, np.flatnonzero(above & pushed)
    yield from _sorted_below(p, below & pushed, lifted, drifted, passed)
    yield from _sorted_below(p, below & pulled, turned, turned_drifted, turned_passed)
    split = np.flatnonzero(above & pulled)
    at = p.rows(split)
    rising = (deviation(at.opposite, x.take(split), y.take(split)) > 0) | ~at.steep
    yield raised, split[rising]
    yield thrown, split[~rising]
    yield None, np.flatnonzero(~((above | below) & (pushed | pulled)))


def _sorted_below(p, mask, steep, holding, passing):
    for course, rows in ((steep, p.steep), (holding, ~p.steep & p.holds), (passing, ~p.steep & ~p.holds)):
        if np.any(rows):
            yield course, np.flatnonzero(mask & rows)


def _all_beyond(values, side):
    """Tell whether all values are clearly on one side of zero."""
    return values.min() > NEAR if side > 0 else values.max() < -NEAR


def _indices(rows):
    return np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows


def _blocks(rows):
    """Cut rows in blocks that stay in a processor's cache."""
    if isinstance(rows, slice):
        return [slice(i, min(i + BLOCK, rows.stop)) for i in range(rows.start, rows.stop, BLOCK)]
    return [rows[i : i + BLOCK] for i in range(0, rows.size, BLOCK)]


def _along(course, rows, p, x, y, z, until, final, count, note):
    """Follow one course, put its results in place, and return the rows it does not fit."""
    told = []
    log = (lambda *event: told.append(event)) if note else _ignore
    end, fits = course(p.rows(rows), *pick(rows, x, y, z, until), log)
    for axis, values in zip(final, end, strict=True):
        axis[rows] = values
    count[rows] = EVENTS[course]
    if fits.all() and not told:
        return NONE
    rows, good = _indices(rows), np.flatnonzero(fits)
    for kind, *state in told:
        note(kind, rows[good], *pick(good, *state))
    return rows[~fits]


def _ignore(*event):
    pass
