r"""One affine mode followed for many starts together: the bounds of ``events`` on arrays of rows.

``events.judge`` bounds every guard of every row on the intervals of the mesh by a few matrix products. An interval that
may contain a root is cut into eight parts, repeatedly, until one guard falls through zero on a part, and Newton's
method finds the root there (``_within``). Rows in which a sign remains open are left to the scalar flow.
"""

from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from asympk.affine.events import Verdicts, judge
from asympk.affine.functions import MOST_EXPONENT, Arrays, functions, initial, rounding_sizes
from asympk.affine.mesh import FunctionTable, Mesh, function_table
from asympk.affine.mode import AffineFlow, Parts
from asympk.arithmetic import UNIT, Doubles

_MARGIN = Doubles.margin
_ULPS = 64  # rounding errors up to which a guard vanishes at the start
_WINDOWS = 64  # windows of the mesh before a row is left to the scalar flow
_ROUNDS = 48  # of cutting an interval: a guard near 0 at the start takes some to come near, and as many to get away
_PARTS = 8
_PIECE = 24  # intervals of a window that are bounded together
_STEPS = 40  # of Newton's method
_CLOSE = 1e-9  # the last Newton step, relative to the interval


class Rows(NamedTuple):
    """The segments of one mode from many starts: the parts of ``mode.ClosedSegment``, and their sizes, row by row.

    ``zero`` (rows, guards) marks the guards that vanish at the start. ``reach`` (rows, guards) is a time up to which
    such a guard is positive, -1 where it falls from the start, NaN where this is not known, and 0 for all others.
    """

    flow: Any
    parts: Parts
    term_sizes: Parts
    zero: np.ndarray
    reach: np.ndarray

    def of(self, rows: np.ndarray) -> "Rows":
        """Return some of the rows."""
        parts, term_sizes = (Parts(*(part[rows] for part in both)) for both in (self.parts, self.term_sizes))
        return Rows(self.flow, parts, term_sizes, self.zero[rows], self.reach[rows])


class Ends(NamedTuple):
    """The ends of segments: duration, guard lost or -1, state and covariance; ``open`` marks rows without an end."""

    span: np.ndarray
    hit: np.ndarray
    state: np.ndarray
    covariance: np.ndarray
    open: np.ndarray


def rows_of(flow: AffineFlow, whole: np.ndarray) -> Rows:
    """Return the ``Rows`` of starts ``(w, 1)``, an array (rows, n + 1)."""
    parts = Parts(*map(np.copy, flow.parts(whole @ flow.tables.T)))
    term_sizes = Parts(*map(np.copy, flow.parts(abs(whole) @ flow.table_sizes.T)))
    n = len(flow.rate)
    zero = abs(parts.guards[:, n]) <= _ULPS * Doubles.eps * term_sizes.guards[:, n]
    parts.guards[:, n][zero] = term_sizes.guards[:, n][zero] = 0.0
    return Rows(flow, parts, term_sizes, zero, np.where(zero, _reach(flow, parts, term_sizes), 0.0))


def _reach(flow, parts, term_sizes):
    """Return v/(3 B), v the first of g'(0) and g''(0) that does not vanish and B a bound of the next derivative.

    -1 stands for v < 0, NaN for an unknown sign of v, and inf for a guard that is constant.
    """
    start, size = np.array(initial(flow.blocks), dtype=float), abs(flow.rate)
    most = min(1.0, 1.0 / max(size.sum(axis=0).max(), 1e-300))
    third = np.matmul(size, abs(parts.bends)).sum(axis=1)
    found = np.full(parts.slopes[:, 0].shape, np.nan)
    second = abs(parts.bends).sum(axis=1)
    for weights, sizes, bound in ((parts.bends, term_sizes.bends, third), (parts.slopes, term_sizes.slopes, second)):
        value, doubt = start @ weights, _MARGIN * (start @ sizes)
        reach = np.minimum(most, value / np.maximum(3 * bound, 1e-300))
        clear = abs(value) > doubt
        found = np.where(clear, np.where(value > 0, reach, -1.0), found)
    return np.where(parts.slopes.any(axis=1), found, np.inf)


def _judged(rows: Rows, known: FunctionTable, first: np.ndarray) -> Verdicts:
    """Return the ``Verdicts`` on the intervals of a table; ``first`` marks the intervals that begin at the start."""
    touching = first[..., None] & rows.zero[:, None, :]
    verdicts = judge(known, rows.parts, rows.term_sizes, _MARGIN, touching)
    return verdicts._replace(positive=verdicts.positive | (touching & (known.h <= rows.reach[:, None, :])))


def follow_rows(flow: AffineFlow, mesh: Mesh, whole: np.ndarray, remaining: np.ndarray, covariance: np.ndarray) -> Ends:
    """Return the ``Ends`` of rows from starts ``whole`` (rows, n + 1), after at most ``remaining``.

    ``covariance`` (rows, n, n) is that of the rounding errors of the starts, as if these were independent.
    """
    rows = rows_of(flow, whole)
    with np.errstate(all="ignore"):
        span, hit, undone = _first_roots(rows, mesh, remaining)
        state, covariance = _end(rows, span, hit, whole, covariance)
        undone |= flow.rate.diagonal().max(initial=0.0) * span > MOST_EXPONENT  # functions are cut there
    return Ends(span, hit, state, covariance, undone | ~np.isfinite(state).all(axis=1))


def may_fall(flow: AffineFlow, mesh: Mesh, whole: np.ndarray, remaining: np.ndarray) -> np.ndarray:
    """Return a mask of the rows from starts ``whole`` in which a guard may fall through 0 before ``remaining``."""
    with np.errstate(all="ignore"):
        _, hit, undone = _first_roots(rows_of(flow, whole), mesh, remaining)
    return undone | (hit >= 0)


def _first_roots(rows, mesh, remaining):
    """Return (duration, guard or -1, mask of undecided rows)."""
    span, hit = remaining.copy(), np.full(remaining.shape, -1)
    undone = ~(rows.reach >= 0).all(axis=1)
    pending = np.flatnonzero(~undone) if rows.zero.shape[1] else np.zeros(0, dtype=int)
    for window in _pieces(mesh):
        if not pending.size:
            return span, hit, undone
        at, found, doubtful = _in_window(rows.of(pending), window, remaining[pending])
        span[pending], hit[pending] = np.where(found >= 0, at, span[pending]), found
        undone[pending] |= doubtful
        pending = pending[(found < 0) & ~doubtful & (remaining[pending] > window.t[-1])]
    undone[pending] = True
    return span, hit, undone


def _pieces(mesh):
    """Yield the windows of a mesh in pieces, since most rows end in the first ones."""
    for window in islice(mesh.windows(), _WINDOWS):
        for k in range(0, len(window.h), _PIECE):
            points, intervals = slice(k, k + _PIECE + 1), slice(k, k + _PIECE)
            yield FunctionTable(*(part[points] for part in window[:5]), *(part[intervals] for part in window[5:]))


def _in_window(rows, window, remaining):
    """Return (time, guard or -1, doubtful) of the first root of each row within a window."""
    first = np.zeros((1, len(window.h)), dtype=bool)
    first[0, 0] = window.t[0] == 0
    verdicts = _judged(rows, window, first)
    suspect, single = ~verdicts.clear & (window.t[:-1] < remaining[:, None]), verdicts.single
    at, found, doubtful = np.zeros(remaining.shape), np.full(remaining.shape, -1), np.zeros(remaining.shape, dtype=bool)
    todo = np.flatnonzero(suspect.any(axis=1))
    while todo.size:
        k = suspect[todo].argmax(axis=1)
        lo, hi = window.t[k], np.minimum(window.t[k + 1], remaining[todo])
        one = single[todo, k] & (hi == window.t[k + 1])
        certain, others = todo[one], todo[~one]
        found[certain] = guard = verdicts.falls[certain, k[one]].argmax(axis=1)
        at[certain] = _newton(rows, certain, guard, lo[one], hi[one])
        if others.size:
            at[others], found[others], doubtful[others] = _within(rows.of(others), lo[~one], hi[~one])
        suspect[todo, k] = False
        todo = todo[(found[todo] < 0) & ~doubtful[todo] & suspect[todo].any(axis=1)]
    return at, found, doubtful


def _within(rows, lo, hi):
    """Return (time, guard or -1, doubtful) of the first root of each row in its interval, by cutting it into eight.

    After a part without a root comes one that is eight times as long.
    """
    at, found, doubtful = np.zeros(lo.shape), np.full(lo.shape, -1), np.zeros(lo.shape, dtype=bool)
    todo, end = np.arange(len(lo)), hi
    for _ in range(_ROUNDS):
        mine = rows.of(todo)
        grid = _grid(mine, lo, hi)
        verdicts = _judged(mine, function_table(rows.flow.blocks, grid), grid[:, :-1] == 0)
        clear, every = verdicts.clear, np.arange(len(todo))
        k, clean = clear.argmin(axis=1), clear.all(axis=1)
        one = ~clean & verdicts.single[every, k]
        if one.any():
            found[todo[one]] = guard = verdicts.falls[every, k][one].argmax(axis=1)
            at[todo[one]] = _newton(mine, every[one], guard, grid[every, k][one], grid[every, k + 1][one])
        further = np.minimum(end[todo], hi + _PARTS * (hi - lo))
        lo, hi = np.where(clean, hi, grid[every, k]), np.where(clean, further, grid[every, k + 1])
        again = ~one & (lo < hi)
        todo, lo, hi = todo[again], lo[again], hi[again]
        if not todo.size:
            break
    doubtful[todo] = True
    return at, found, doubtful


def _grid(rows, lo, hi):
    """Return nine times from lo to hi; if lo is 0, the second is the ``reach`` of the guards that vanish there."""
    parts = np.linspace(0, 1, _PARTS + 1)
    reach = np.where(rows.zero, rows.reach, np.inf).min(axis=1, initial=np.inf)
    inner = np.where((lo == 0) & (reach < hi), reach, lo + (hi - lo) / _PARTS)[:, None]
    return np.concatenate([lo[:, None], inner + (hi[:, None] - inner) * parts[:-1] * 8 / 7], axis=1)


def _newton(rows, which, guard, lo, hi):
    """Return the root of one guard in each of the rows ``which``; the guard falls from plus at lo to minus at hi."""
    every, n = np.arange(len(lo)), len(rows.flow.rate)
    weights, slopes = rows.parts.guards[which, :, guard], rows.parts.slopes[which, :, guard]
    close, t = (hi - lo) * _CLOSE, (lo + hi) / 2
    for _ in range(_STEPS):
        values, gained, begun = functions(Arrays, rows.flow.blocks, t)
        value = sum(g * w for g, w in zip(gained, weights.T, strict=False)) + weights[every, n + begun]
        slope = sum(f * w for f, w in zip(values, slopes.T, strict=True))
        lo, hi = np.where(value > 0, t, lo), np.where(value > 0, hi, t)
        new = t - value / slope
        inside = (new >= lo) & (new <= hi)
        new = np.where(inside, new, (lo + hi) / 2)
        done = (abs(new - t) <= close).all()
        t = new
        if done:
            break
    return t


def _end(rows, span, hit, whole, covariance):
    """Return the states at the ends of the segments, moved onto the lost guards, and the covariance there."""
    flow, every, n = rows.flow, np.arange(len(span)), len(rows.flow.rate)
    values, gained, begun = (np.array(part) for part in functions(Arrays, flow.blocks, span))
    off = np.array(np.broadcast_arrays(*rounding_sizes(Arrays, flow.blocks, span)[0])).T
    values, gained = (np.array(np.broadcast_arrays(*part), dtype=float).T for part in (values, gained))
    state = np.einsum("mr,mrn->mn", gained, rows.parts.sums[:, :n]) + rows.parts.sums[every, n + begun]
    lost = np.einsum("mr,mrn->mn", off, rows.term_sizes.sums[:, :n]) + rows.term_sizes.sums[every, n + begun]
    spread = (values @ flow.flat).reshape(len(span), state.shape[1], -1)
    covariance = carried_on(spread, with_rounding(covariance, whole[:, :-1]))
    covariance = with_rounding(covariance, lost + abs(state))
    ended = np.flatnonzero(hit >= 0)
    if ended.size:
        rates = np.einsum("mr,mrn->mn", values[ended] @ flow.rate, rows.parts.sums[ended, :n])
        slope = np.einsum("mn,mn->m", flow.rows[hit[ended], :-1], rates)
        values = np.einsum("mr,mr->m", gained[ended], rows.parts.guards[ended, :n, hit[ended]])
        value = values + rows.parts.guards[ended, n + begun[ended], hit[ended]]
        state[ended] -= (value / slope)[:, None] * rates
    return state, covariance


def carried_on(derivative: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the covariance of errors that a motion with the ``derivative`` (rows, m, n) by its start carries on."""
    return derivative @ covariance @ derivative.swapaxes(1, 2)


def with_rounding(covariance: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return a covariance with the rounding of numbers of the given ``sizes`` (rows, n)."""
    return covariance + np.eye(sizes.shape[1]) * (UNIT * sizes)[:, None] ** 2
