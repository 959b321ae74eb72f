r"""The exact flow for arrays: every event is bracketed (Lemmas 1 and 2), and every sign that decides is checked.

``follow_arrays`` finds the events in doubles. ``certain`` then follows the same sequence of events in extended
precision, which is 2048 times finer, from the event times found. Where the states hardly change by that, they are right
to all digits of a double. A trajectory whose states do change, or which depends on a sign within rounding, is marked as
doubtful. The logic is the same as in ``flow.segments``; ``slip_ends`` is the hard function.
"""

from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np

from asympk.many import by_trajectory
from asympk.numbers import Number
from asympk.path import KINDS
from asympk.systems.painleve_klein.arrays.motions import Segments, SeparateSegments, SmoothSegments, arithmetic_of
from asympk.systems.painleve_klein.flow.fastslow import FastSlow, well_apart
from asympk.systems.painleve_klein.flow.segments import MOST_EVENTS
from asympk.systems.painleve_klein.flow.superposition import SmoothMode
from asympk.systems.painleve_klein.modes import MODES, coefficients, inverse_edges, leaving, signs_after, stick_margin

FORCE_ZERO, VELOCITY_ZERO, SLIP_ONSET, NOTHING = range(4)
Ends: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # (kind, time, state, doubt) of each row
AGREED = 2e-14  # relative distance between both precisions up to which the finer result is accepted
MARGIN = 1e-12  # relative size below which a sign is doubtful
EXTENDED = np.longdouble if np.finfo(np.longdouble).eps < 1e-18 else None  # None where the machine has only doubles


class FollowedArrays(NamedTuple):
    """The result of trajectories: ``final`` (x, y, z) at the time ``reached``, number of events, and who is doubtful.

    A trajectory with more than ``MOST_EVENTS`` events is not followed further. ``events`` are arrays (trajectory, kind,
    t, x, y, z) in order of trajectory and time. ``rounds[k]`` are arrays (rows, kind, duration) of the k-th segments of
    all trajectories that have one.
    """

    final: tuple
    reached: np.ndarray
    n_events: np.ndarray
    doubtful: np.ndarray
    events: tuple
    rounds: list


def certain(*given: np.ndarray) -> FollowedArrays:
    """Follow trajectories from (sigma, sigma0, mu, x, y, z, until), arrays of doubles of one length, in two precisions.

    Return the ``FollowedArrays`` in the finer precision; where the machine has none, all trajectories are doubtful.
    """
    coarse = follow_arrays(*given)
    if EXTENDED is None:
        return coarse._replace(doubtful=np.ones_like(coarse.doubtful))
    fine = follow_arrays(*(v.astype(EXTENDED) for v in given), coarse=coarse)
    _, _, _, x, _, z, _ = given
    apart = _distance(coarse, fine, np.maximum(np.abs(x), np.abs(z)))
    return fine._replace(doubtful=coarse.doubtful | ~(apart <= AGREED))


def _distance(coarse, fine, largest):
    """Return the distance in x and z at events and the end, relative to the largest of 1, |x|, |z|.

    The distance is inf where the events differ in number or kind.
    """
    same = coarse.n_events == fine.n_events
    coarse_events, fine_events = ([v[same[events[0]]] for v in events] for events in (coarse.events, fine.events))
    rows = fine_events[0]
    largest = np.maximum(1, largest)
    apart = np.where(same, 0.0, np.inf)
    apart[rows[coarse_events[1] != fine_events[1]]] = np.inf
    for axis in (3, 5):
        np.maximum.at(largest, rows, np.abs(fine_events[axis]).astype(float))
        np.maximum.at(apart, rows, np.abs(fine_events[axis] - coarse_events[axis]).astype(float))
    for axis in (0, 2):
        largest = np.maximum(largest, np.abs(fine.final[axis]))
        apart = np.maximum(apart, np.abs(fine.final[axis] - coarse.final[axis]))
    return (apart / largest).astype(float)


def follow_arrays(
    sigma: Number, sigma0: Number, mu: Number, x: Number, y: Number, z: Number, until: Number, *,
    coarse: FollowedArrays | None = None,
) -> FollowedArrays:
    """Follow trajectories, given as arrays of one length; ``coarse`` are their results in coarser numbers."""
    s = x + y
    s_sign, z_sign, doubtful = starting_signs(sigma0, mu, y, s, z)
    moving = _FollowedRows(sigma, sigma0, mu, until, np.array([x, y, s, z]), s_sign, z_sign, doubtful)
    rounds: list[tuple] = []
    live = np.flatnonzero(~(doubtful if coarse is None else coarse.doubtful))
    while live.size:
        known = coarse and coarse.rounds[len(rounds)]
        kind, span = np.empty(live.size, np.intp), np.empty_like(until[live])
        for at, motion in moving.groups(live):
            kind[at], span[at] = moving.advance(live[at], motion, known)
        rounds.append((live, kind, span))
        live = live[(kind != NOTHING) & ~moving.doubtful[live] & (moving.n_events[live] <= MOST_EVENTS)]
    x, y, _, z = moving.state
    return FollowedArrays((x, y, z), moving.t, moving.n_events, moving.doubtful, moving.events(), rounds)


def starting_signs(
    sigma0: Number, mu: Number, y: Number, s: Number, z: Number
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the signs of s and z just after the start, as ``modes.first_signs`` does, and where they are doubtful."""
    rate = 1 + mu * y
    held = stick_margin(sigma0, s)
    s_sign = np.where(s == 0, np.sign(rate), np.sign(s))
    z_sign = np.where(z != 0, np.sign(z), np.where(held > 0, 0, leaving(s)))
    doubtful = (s == 0) & ~(np.abs(rate) > MARGIN) | (z == 0) & ~(np.abs(held) > MARGIN * (1 + np.abs(s)))
    return s_sign, z_sign, doubtful


class _FollowedRows:
    """Trajectories while they are followed: ``state`` (x, y, s, z) at the time ``t`` of each, and the events so far."""

    def __init__(self, sigma, sigma0, mu, until, state, s_sign, z_sign, doubtful):
        self.sigma, self.sigma0, self.mu, self.until = sigma, sigma0, mu, until
        self.state, self.s_sign, self.z_sign, self.doubtful = state, s_sign, z_sign, doubtful
        self.t = np.zeros_like(until)
        self.n_events = np.zeros(until.size, dtype=np.int64)
        self.blocks = []

    def groups(self, live):
        """Yield (indices among the live rows, motion) of those that stick, or slip, in each closed form."""
        side, sigma = self.z_sign[live] * self.s_sign[live], self.sigma[live]
        b = np.empty_like(sigma)
        for signs, name in MODES.items():
            np.copyto(b, coefficients(name, sigma)[1], where=side == signs)
        apart, m = well_apart(b, self.mu[live]), arithmetic_of(sigma.dtype)
        kinds = (FastSlow, SeparateSegments, apart), (SmoothMode, SmoothSegments, ~apart)
        for (inside, a), (mode, form, fits) in product(((side == 0, 0), (side != 0, 1)), kinds):
            at = np.flatnonzero(inside & fits)
            if at.size:
                rows = live[at]
                yield at, form(mode(m, a, b[at], self.mu[rows]), *self.state[:, rows])

    def advance(self, rows, motion, known):
        """Move the rows to their next event, or to their end; return its kind and the time until then."""
        remaining = self.until[rows] - self.t[rows]
        if known:
            before, kinds, spans = known
            at = np.searchsorted(before, rows)
            found = settled_ends(motion, self.sigma0[rows], remaining, kinds[at], spans[at])
        elif motion.mode.a:
            found = slip_ends(motion, self.s_sign[rows], self.z_sign[rows], remaining)
        else:
            found = stick_ends(motion, self.sigma0[rows], self.s_sign[rows], remaining)
        kind, span, state, doubtful = found
        self.t[rows] += span
        self.state[:, rows] = state
        self.doubtful[rows] |= doubtful
        self._watch_end(rows[kind == NOTHING], motion.rows(kind == NOTHING), remaining[kind == NOTHING])
        self._note(rows[kind != NOTHING], kind[kind != NOTHING])
        self._cross(rows, kind)
        return kind, span

    def _watch_end(self, rows, motion, remaining):
        """Mark as doubtful the rows in which an error of the final time, by rounding, may change the events."""
        late, slips = MARGIN * self.until[rows], self.z_sign[rows] != 0
        _, y, s, z = (v[rows] for v in self.state)
        mode = motion.mode
        moved = late * np.abs(y + (mode.a - mode.b * s) / mode.mu)
        near, far = edges(self.sigma0[rows], s)
        off = np.where(slips, np.abs(s), np.minimum(np.abs(s - near), np.abs(far - s)))
        clear = (moved <= off) & (~slips | (late * np.abs(mode.a + mode.fall * s) <= np.abs(z)))
        self.doubtful[rows] |= ~clear | ((self.n_events[rows] > 0) & (remaining < late))

    def _note(self, rows, kind):
        x, y, _, z = (v[rows] for v in self.state)
        self.blocks.append((rows, kind, self.t[rows], x, y, z))
        self.n_events[rows] += 1

    def _cross(self, rows, kind):
        """Set the signs of s and z to those after the events."""
        for code, name in enumerate(KINDS):
            at = rows[kind == code]
            s = self.state[2][at]
            sticks, doubtful = _sticks(self.sigma0[at], s)
            self.s_sign[at], self.z_sign[at] = signs_after(name, self.s_sign[at], self.z_sign[at], s, sticks)
            self.doubtful[at] |= doubtful & (code == VELOCITY_ZERO)

    def events(self):
        """Return the arrays (trajectory, kind, t, x, y, z) in order of trajectory and time."""
        return tuple(by_trajectory([np.zeros(0, np.intp), np.zeros(0, np.intp), *([self.until[:0]] * 4)], self.blocks))


def edges(sigma0: Number, s: Number) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges (near zero, far from zero) of the static cone on the side of s, infinite for no edge."""
    near, far = inverse_edges(sigma0, s)
    return 1 / near, np.where(far > 0, 1 / far, np.inf)


def _sticks(sigma0, s):
    """Tell whether s lies in the static cone, and where the answer is doubtful."""
    near, far = edges(sigma0, s)
    above, below = np.abs(s) - np.abs(near), far - s
    doubtful = ~(np.abs(above) > MARGIN * np.abs(s)) | ~(np.abs(below) > MARGIN * np.abs(s))
    return (above >= 0) & (below >= 0), doubtful


def slip_ends(motion: Segments, s_sign: np.ndarray, z_sign: np.ndarray, remaining: Number) -> Ends:
    """Return the ``Ends`` at the event that ends a slip within the time left, or at the end."""
    end = motion.horizon(remaining)
    search = _Search(motion, remaining)
    opening = search.opening(z_sign)
    for rows, lo, hi in search.stretches(end):
        part, own, side = motion.rows(rows), s_sign[rows], z_sign[rows]
        state = part.state(hi)
        opens = side * (part.mode.a + part.mode.fall * state[2]) > 0
        t, s, landed = _landing(search, rows, part, own, side, lo, hi, state, opening[rows], opens)
        search.watch(rows, own * s, part.size(2, t), ~landed)
        turned = np.flatnonzero(~landed & (own * s < 0))
        search.require_off(rows[turned], (lo[turned] > 0) | (part.s0[turned] != 0))
        if turned.size:
            some = part.rows(turned)
            at = some.root(2, np.zeros_like(t[turned]), lo[turned], t[turned], own[turned] < 0)
            search.found(rows[turned], FORCE_ZERO, at, some.on_level(np.zeros_like(at), at))
        search.passed(rows, state)
        opening[rows] = opens
    search.doubtful |= (search.kind == NOTHING) & (end < remaining)
    return search.kind, search.time, search.state, search.doubtful


def _landing(search, rows, part, own, side, lo, hi, state, opening, opens):
    """Return (time, s, whether z vanishes there as the next event): at the root of z in (lo, hi), or at hi without one.

    Where s has lost its sign at the root of z, the load vanishes first and the root is no event.
    """
    t, s, landed = hi.copy(), state[2].copy(), np.zeros(hi.size, bool)
    search.watch(rows, side * state[3], part.size(3, hi))
    crosses = side * state[3] < 0
    start = _leaving(search, rows, part, side, lo, hi, s, crosses & opening & (lo == 0) & (part.z0 == 0))
    dips = np.flatnonzero(~crosses & opens & ~opening)
    if dips.size:
        some = part.rows(dips)
        level, falls = some.mode.a / (some.mode.b - 1), side[dips] * some.mode.fall > 0
        least = some.root(2, level, lo[dips], hi[dips], falls)
        depth = side[dips] * some.state(least)[3]
        search.watch(rows[dips], depth, some.size(3, least))
        crosses[dips], t[dips] = depth < 0, np.where(depth < 0, least, hi[dips])
    down = np.flatnonzero(crosses)
    if down.size:
        some = part.rows(down)
        at = some.root(3, np.zeros(down.size), start[down], t[down], side[down] < 0)
        there = some.on_plane(at)
        t[down], s[down] = at, there[2]
        search.watch(rows[down], own[down] * there[2], some.size(2, at))
        real = own[down] * there[2] >= 0
        landed[down] = real
        search.found(rows[down[real]], VELOCITY_ZERO, at[real], [v[real] for v in there])
    return t, s, landed


def _leaving(search, rows, part, side, lo, hi, s, leaves):
    """Return lo, or for starts on z = 0 that leave it a time in (lo, hi) at which z is off it, before its root."""
    start = lo.copy()
    if leaves.any():
        some = part.rows(leaves)
        level = some.mode.a / (some.mode.b - 1)
        start[leaves] = some.root(2, level, lo[leaves], hi[leaves], s[leaves] > some.s0)
        off = side[leaves] * some.state(start[leaves])[3]
        search.require_off(rows[leaves], off > MARGIN * some.size(3, start[leaves]))
    return start


def stick_ends(motion: Segments, sigma0: Number, s_sign: np.ndarray, remaining: Number) -> Ends:
    """Return the ``Ends`` at the slip onset within the time left, or at the end."""
    search = _Search(motion, remaining)
    near, far = edges(sigma0, motion.s0)
    for rows, lo, hi in search.stretches(remaining):
        part = motion.rows(rows)
        state = part.state(hi)
        for edge, side in ((near[rows], -s_sign[rows]), (far[rows], np.ones_like(hi))):
            asked = np.isfinite(edge) & (search.kind[rows] == NOTHING)
            beyond = side * (state[2] - edge)
            search.watch(rows, beyond, np.abs(edge) + part.size(2, hi), asked)
            out = np.flatnonzero(asked & (beyond > 0))
            if out.size:
                search.require_off(rows[out], (lo[out] > 0) | (part.s0[out] != edge[out]))
                some = part.rows(out)
                at = some.root(2, edge[out], lo[out], hi[out], side[out] > 0)
                search.found(rows[out], SLIP_ONSET, at, some.on_level(edge[out], at))
        search.passed(rows, state)
    return search.kind, search.time, search.state, search.doubtful


def settled_ends(motion: Segments, sigma0: Number, remaining: Number, kind: np.ndarray, span: np.ndarray) -> Ends:
    """Return the ``Ends`` at events, or ends, whose kinds and approximate times are known."""
    near, far = edges(sigma0, motion.s0)
    time, state = np.where(kind == NOTHING, remaining, span), np.zeros((4, *remaining.shape), remaining.dtype)
    for which in (FORCE_ZERO, VELOCITY_ZERO, SLIP_ONSET, NOTHING):
        rows = np.flatnonzero(kind == which)
        if not rows.size:
            continue
        part, t = motion.rows(rows), time[rows]
        if which == NOTHING:
            found = part.state(t)
        elif which == VELOCITY_ZERO:
            t = part.refined(t, 3, np.zeros_like(t))
            found = part.on_plane(t)
        else:
            level = np.zeros_like(t) if which == FORCE_ZERO else _nearest_edge(part, t, near[rows], far[rows])
            t = part.refined(t, 2, level)
            found = part.on_level(level, t)
        time[rows], state[:, rows] = t, found[:4]
    return kind, time, state, np.zeros(remaining.size, bool)


def _nearest_edge(part, t, near, far):
    s = part.state(t)[2]
    return np.where(np.abs(s - near) <= np.abs(s - far), near, far)


class _Search:
    """The search for the event that ends each of some motions, stretch by stretch on which s is monotone."""

    def __init__(self, motion, remaining):
        self.motion = motion
        self.kind = np.full(remaining.size, NOTHING)
        self.time = remaining.copy()
        self.state = np.zeros((4, *remaining.shape), remaining.dtype)
        self.doubtful = np.zeros(remaining.size, bool)

    def stretches(self, end):
        """Yield (rows without an event so far, start, end) of the stretches between three extrema, and to the end."""
        turn, half = self.motion.turning(), self.motion.mode.half_period
        lo = np.zeros_like(end)
        for hi in (*(np.minimum(t, end) for t in (turn, turn + half, turn + 2 * half)), end):
            rows = np.flatnonzero((self.kind == NOTHING) & ((lo < hi) | (end == 0)))
            if rows.size:
                yield rows, lo[rows], hi[rows]
            lo = hi

    def watch(self, rows, value, size, asked=True):
        """Mark as doubtful the rows whose value has no clear sign."""
        self.doubtful[rows] |= asked & ~(np.abs(value) > MARGIN * size)

    def opening(self, z_sign):
        """Tell where z moves away from the plane at first; doubtful where z is close to it and z' has no clear sign."""
        motion = self.motion
        pull = motion.mode.fall * motion.s0
        rate = motion.mode.a + pull
        vague = (motion.z0 != 0) & (motion.z0 * motion.z0 < MARGIN)
        self.doubtful |= vague & ~(np.abs(rate) > MARGIN * (1 + np.abs(pull)))
        return (motion.z0 == 0) | (z_sign * rate > 0)

    def require_off(self, rows, off):
        """Mark as doubtful the rows that pass a surface on which they started, and so begin on its other side."""
        self.doubtful[rows] |= ~off

    def found(self, rows, kind, time, state):
        self.kind[rows], self.time[rows], self.state[:, rows] = kind, time, state[:4]

    def passed(self, rows, state):
        """Keep the states at the end of a stretch of rows without event; after the last, these are the end states."""
        on = self.kind[rows] == NOTHING
        self.state[:, rows[on]] = [v[on] for v in state[:4]]
