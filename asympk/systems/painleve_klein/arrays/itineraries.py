r"""The common itineraries of a trajectory for small mu, each a chain of branch-free kernels.

The sign of sigma and, at the start, the signs of z and s = x + y and the side of the unstable plane name the itinerary:

                    sigma > 0 (steep)                                        sigma < 0 (shallow)
    z > 0 < s       direct: slip_same                                        direct
    z > 0 > s       raised: slip_opposite, slip_same                         raised
                    thrown: slip_opposite, stick, slip_opposite, slip_same
    z < 0 < s       lifted: slip_opposite, stick, slip_same                  drifted: likewise, by way of Pi2, or
                                                                             passed: slip_opposite, slip_same
    z < 0 > s       turned: slip_same, and then as for z < 0 < s

These are the claims C23-C26 and C30. They hold because the slow part of every s is small (``Setting.reach``).
``follow_itineraries`` sorts the trajectories so that those that meet the same kind of event are adjacent, and each
kernel runs once. Every stage (``_turn``, ``_land``, ...) also finds the rows that do not fit, which are returned.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from asympk.numbers import Number
from asympk.systems.painleve_klein.arrays import branchfree
from asympk.systems.painleve_klein.arrays.branchfree import ModeConstants, deviation, mode_constants, pick
from asympk.systems.painleve_klein.arrays.safeguarded import EXTENDED
from asympk.systems.painleve_klein.modes import coefficients, cone

SAFE = 1e-10  # relative margin by which a trajectory must fit its itinerary
NEAR = 1e-6  # a start with |s| or |z| up to this takes no common itinerary
SMALLEST = 1e-3  # the smallest positive sigma with common itineraries
SELDOM = 1e-3  # mu relative to min(sigma^2, 1) up to which misfits are rare
FINER = 1024.0  # how much smaller rounding is in extended precision, with a factor 2 to spare
BLOCK = 16384  # trajectories that are followed together
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
    def same(self) -> ModeConstants:
        return self._mode("slip_same")

    @cached_property
    def opposite(self) -> ModeConstants:
        return self._mode("slip_opposite")

    @cached_property
    def stick(self) -> ModeConstants:
        return self._mode("stick")

    def _mode(self, name):
        a, b = coefficients(name, self.sigma)
        return mode_constants(1.0 * a, 1.0 * b, self.mu)

    @cached_property
    def upper_edge(self) -> Number:
        return 1 / cone(self.sigma0)[1]

    @cached_property
    def steep(self) -> Number:
        return np.greater(self.sigma, 0)

    @cached_property
    def holds(self) -> Number:
        """Whether a motion along Pi2, where s = -1/sigma, meets z = 0 within the static cone."""
        return np.greater(cone(self.sigma0)[1], -self.sigma)

    @cached_property
    def has_rare_misfits(self) -> Number:
        """Whether among starts of size one misfits are so rare that each is followed by the scalar flow."""
        return self.mu <= SELDOM * np.minimum(self.sigma * self.sigma, 1.0)

    @cached_property
    def reach(self) -> Number:
        r"""The bound on |x|, |z| and mu |y| below which the itineraries hold; not positive where no itinerary holds.

        The bound keeps the slow amplitude |A| below ``1/(mu m)`` in every mode, with m the largest of b - 1, 2,
        2 (sigma+1) and 2/edge: then s, s' and z have at most one zero in a mode of an itinerary. A sigma between
        -1/4 and ``SMALLEST`` is excluded: the fast part may change too little there for its logarithm to give the time.
        """
        size = np.abs(self.sigma)
        apart = (self.mu <= 0.0625 * np.minimum(size * size, 1.0)) & (self.mu >= 1e-200)
        apart &= (self.sigma >= SMALLEST) | (self.sigma <= -0.25)
        most = 0.3 / (self.mu * (2.3 * self.sigma0 + 7)) - 0.3 / size - 0.3
        return np.minimum(most, 1e3 * apart)


# the itineraries, in the order in which the rows of ``_SortedRows`` lie
RAISED, THROWN, LIFTED, TURNED, DRIFTED, TURNED_DRIFTED, TURNED_PASSED, PASSED, DIRECT = ITINERARIES = range(9)
EVENTS = np.array([1, 3, 2, 3, 2, 3, 2, 1, 0], dtype=np.int32)  # the number of events of each itinerary


class _SortedRows:
    """Trajectories sorted by itinerary while they are followed: states at the times ``t``, and which of them fit.

    ``ends`` are the rows where each itinerary begins, and where the last ends; ``events`` are (kind, rows, t, x, y, z)
    if ``watched``. A state variable is a single number where it is equal for all rows. ``w`` are the deviations of the
    raised and thrown rows, which come first, from the unstable line.
    """

    def __init__(self, p: Setting, ends: list[int], watched: bool, x: Number, y: Number, z: Number, until: Number):
        self.p, self.ends, self.until, self.watched = p, ends, until, watched
        self.events: list[tuple] = []
        self.x, self.y, self.z, self.t = x, y, z, 0.0
        self.w, self.fits = NONE, np.ones(x.size, dtype=bool)

    def of(self, first: int, last: int | None = None) -> slice:
        """Return the rows of an itinerary, or of all itineraries from ``first`` to ``last``."""
        return slice(self.ends[first], self.ends[(first if last is None else last) + 1])

    def at(self, rows: slice) -> list[Number]:
        """Return [x, y, z] of some rows."""
        return pick(rows, self.x, self.y, self.z)

    def meet(self, kind: str, rows: slice, dt: Number, x: Number, y: Number, z: Number) -> None:
        """Move ``rows`` to their event after the time ``dt``, at the state (x, y, z)."""
        t, size = pick(rows, self.t)[0] + dt, self.fits.size
        for name, values in (("t", t), ("x", x), ("y", y), ("z", z)):
            whole = getattr(self, name)
            if rows.stop - rows.start == size:
                whole = values
            else:
                whole = whole if isinstance(whole, np.ndarray) else np.full(size, whole)
                whole[rows] = values
            setattr(self, name, whole)
        if self.watched:
            self.events.append((kind, rows, *(1.0 * v for v in (t, x, y, z))))

    def report(self, note: Callable, known: np.ndarray) -> None:
        """Call ``note`` with the events of the trajectories that fit; ``known`` are the numbers of the trajectories."""
        for kind, rows, *state in self.events:
            good = self.fits[rows].nonzero()[0]
            note(kind, known[rows][good], *pick(good, *state))


def _followed(b):
    """Return (x, y, z) at the end."""
    for stage, rows in (
        (_turn, b.of(TURNED)),
        (_turn, b.of(TURNED_DRIFTED, TURNED_PASSED)),
        (_part, b.of(RAISED, THROWN)),
        (_land, b.of(THROWN, TURNED)),
        (_land_slowly, b.of(DRIFTED, PASSED)),
        (_stick, b.of(THROWN, TURNED_DRIFTED)),
        (_rise, b.of(RAISED, THROWN)),
    ):
        if rows.start < rows.stop:
            stage(b, rows)
    return _slip(b)


def _turn(b, rows):
    """Slip until the load turns positive.

    Where z reaches 0 before the load does, the next stage runs backwards in time and the trajectory does not fit.
    """
    _lose_load(b, rows, b.p.same.rows(rows))


def _lose_load(b, rows, m, w=()):
    x, y, z = b.at(rows)
    dt, x = branchfree.force_zero(m, x, y, w)
    b.meet("force_zero", rows, dt, x, -x, z + m.rest * dt - m.bend * (x + y))


def _part(b, rows):
    """Compute the deviations from the unstable plane; a row fits only if their sign is clear of rounding.

    Where the sign is not clear in doubles, the deviation is computed in extended precision.
    """
    x, y, _ = b.at(rows)
    sigma, mu, steep = pick(rows, b.p.sigma, b.p.mu, b.p.steep)
    b.w = w = deviation(b.p.opposite.rows(rows), x, y)
    doubt = np.maximum(0.5 * mu / sigma, SAFE) * (np.abs(x) + np.abs(y) + 1 / sigma)
    clear = np.abs(w) > doubt
    near = (~clear & steep).nonzero()[0] if EXTENDED else NONE
    if near.size:
        sigma, mu, near_x, near_y = (np.broadcast_to(v, x.shape)[near].astype(EXTENDED) for v in (sigma, mu, x, y))
        w[near] = deviation(mode_constants(1.0, -sigma, mu), near_x, near_y).astype(float)
        clear[near] = np.abs(w[near]) > doubt[near] / FINER
    b.fits[rows] &= clear | ~steep


def _land(b, rows):
    """Slip until the fast part brings z to 0."""
    x, y, z = b.at(rows)
    dt, x, y = branchfree.velocity_zero(b.p.opposite.rows(rows), x, y, z, b.w[b.of(THROWN)])
    b.meet("velocity_zero", rows, dt, x, y, 0.0)


def _land_slowly(b, rows):
    """Slip along Pi2 until z = 0; rows that do not stick then must have a load clearly outside the static cone."""
    x, y, z = b.at(rows)
    dt, x, y = branchfree.velocity_zero_slowly(b.p.opposite.rows(rows), x, y, z)
    b.meet("velocity_zero", rows, dt, x, y, 0.0)
    passed = b.of(TURNED_PASSED, PASSED)
    x, y, edge = pick(passed, b.x, b.y, b.p.upper_edge)
    b.fits[passed] &= x + y < edge * (1 - SAFE)


def _stick(b, rows):
    """Stick until s reaches an edge; rows fit if this takes time, as the load then began clearly in the static cone."""
    m, (x, y, _) = b.p.stick.rows(rows), b.at(rows)
    (edge,), thrown = pick(rows, b.p.upper_edge), b.of(THROWN)
    if thrown.start < thrown.stop:
        edge = np.full(x.size, edge)
        (edge[: thrown.stop - thrown.start],) = pick(thrown, 1 / cone(b.p.sigma0)[0])
    dt, x = branchfree.release(m, x, y, edge)
    b.fits[rows] &= dt > SAFE / abs(m.fast)
    b.meet("slip_onset", rows, dt, x, edge - x, 0.0)


def _rise(b, rows):
    """Slip until the load, negative so far, vanishes; raised rows fit only if z cannot have fallen to 0 before."""
    raised = b.of(RAISED)
    sigma, mu, x, y, z = pick(raised, b.p.sigma, b.p.mu, b.x, b.y, b.z)
    s = x + y
    fall, slow, z = 1 + (sigma + 1) * s, mu * y > -1 - sigma * s, np.copy(z)
    _lose_load(b, rows, b.p.opposite.rows(rows), b.w[raised])
    t, risen = pick(raised, b.t, b.z)
    lowest = z - fall * (risen - t - z) / (1 - fall)
    b.fits[raised] &= (fall >= 0) | ((lowest > NEAR) & slow)


def _slip(b):
    """Slip with s > 0 until the end; direct rows fit only if z first falls by less than its value."""
    direct = b.of(DIRECT)
    m, (x, y, z) = b.p.same.rows(direct), b.at(direct)
    b.fits[direct] &= z > m.bend * m.fast * m.to_x * deviation(m, x, y)  # a bound on the fall of z before it rises
    remaining = b.until - b.t
    b.fits &= remaining > SAFE * b.until
    x, y, gone = branchfree.slide(b.p.same, b.x, b.y, remaining)
    gone += b.z
    return x, y, gone


def follow_itineraries(
    p: Setting, x: Number, y: Number, z: Number, until: Number, final: np.ndarray, count: np.ndarray,
    note: Callable | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Follow the trajectories on common itineraries; write final states and numbers of events to ``final``, ``count``.

    Return (rows of no common itinerary, rows that do not fit the itinerary that their start suggests). ``note(kind,
    rows, t, x, y, z)`` is called with the events, in order of time for each trajectory.
    """
    if not (p.reach > 0).any():
        return np.arange(x.size), NONE
    ends, order, others = _sorted_out(p, x, y, z, until)
    misfits = [NONE]
    for start in range(0, ends[-1], BLOCK):
        stop = min(start + BLOCK, ends[-1])
        rows = slice(start, stop) if order is None else order[start:stop]
        local = [min(max(end, start), stop) - start for end in ends]
        b = _SortedRows(p.rows(rows), local, bool(note), *pick(rows, x, y, z, until))
        for axis, values in zip(final, _followed(b), strict=True):
            axis[rows] = values
        count[rows] = EVENTS.repeat([last - first for first, last in pairwise(local)])
        if note or not b.fits.all():
            known = np.arange(start, stop) if order is None else order[start:stop]
            misfits.append(known[~b.fits])
            if note:
                b.report(note, known)
    return others, np.concatenate(misfits)


def _sorted_out(p, x, y, z, until):
    """Return (where each itinerary begins and the last ends, all rows in this order or None, rows of no itinerary)."""
    s = x + y
    (x_least, y_least, z_least, s_least), (x_most, y_most, z_most, s_most) = (
        map(np.minimum.reduce, (x, y, z, s)), map(np.maximum.reduce, (x, y, z, s)))
    within = (max(x_most, -x_least, z_most, -z_least) < p.reach) & (max(y_most, -y_least) * p.mu < p.reach)
    inside = (within & (until > 0)).all()
    if inside and p.steep.all():
        alike = {DIRECT: min(z_least, s_least), LIFTED: min(-z_most, s_least), TURNED: min(-z_most, -s_most)}
        for itinerary, least in alike.items():
            if least > NEAR:
                return [x.size * (k > itinerary) for k in (*ITINERARIES, len(ITINERARIES))], None, NONE
    common = (np.abs(z) > NEAR) & (np.abs(s) > NEAR)
    if not inside:
        common &= (np.maximum(np.abs(x), np.abs(z)) < p.reach) & (np.abs(y) * p.mu < p.reach) & (until > 0)
    up, pushed = common & (z > 0), s > 0
    down = common ^ up
    split = (up & ~pushed).nonzero()[0]
    at = p.rows(split)
    rising = (deviation(at.opposite, x.take(split), y.take(split)) > 0) | ~at.steep
    raised, thrown = split.take(rising.nonzero()[0]), split.take((~rising).nonzero()[0])
    lifted, drifted, passed = _by_sigma(p, down & pushed)
    turned, turned_drifted, turned_passed = _by_sigma(p, down & ~pushed)
    direct = (up & pushed).nonzero()[0]
    found = raised, thrown, lifted, turned, drifted, turned_drifted, turned_passed, passed, direct
    return [0, *accumulate(rows.size for rows in found)], np.concatenate(found), (~common).nonzero()[0]


def _by_sigma(p, mask):
    """Return the steep rows, the shallow rows that meet the static cone along Pi2, and the other shallow rows."""
    if p.steep.all():
        return [mask.nonzero()[0], NONE, NONE]
    kinds = p.steep, ~p.steep & p.holds, ~p.steep & ~p.holds
    return [(mask & kind).nonzero()[0] if kind.any() else NONE for kind in kinds]
