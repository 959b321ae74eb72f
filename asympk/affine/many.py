r"""``solve_many`` of affine systems: one decomposition per set of parameters, rows of starts followed mode by mode.

Parameters in which the modes are affine are states at rest (``resting``), so that their numbers need only one.
``moderows`` follows all rows that are in the same mode together. The first mode and each next one are decided on arrays
by the rules of ``automaton``: by the guards of all modes that may follow, and by the derivatives of guards that vanish.
Rows for which this decision remains open, or which rounding may affect too much, are followed one by one by the scalar
flow. ``_together`` and ``_advanced`` are the loop; ``asympk.affine.choice`` decides the first and each next mode.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from asympk.affine.choice import Modes, rows_with_waves
from asympk.affine.form import form_of_laws
from asympk.affine.moderows import carried_on, follow_rows, may_fall
from asympk.affine.resting import with_resting
from asympk.affine.run import affine, run
from asympk.arithmetic import UNIT, Doubles
from asympk.automaton.automaton import Automaton
from asympk.automaton.numericmode import OF_STATES
from asympk.errors import InputError, OutOfRange
from asympk.many import PHASES, REFUSALS, Many, axes_of, by_trajectory, outcome_of, require_mappings
from asympk.numbers import common_shape, numbers, raw_entries, require_finite
from asympk.scene import Scene
from asympk.symbolic.system import require_system
from asympk.symbolic.values import by_symbol

CHUNK = 4096
FEW = 3  # the number of rows up to which following them one by one costs less
MOST_EVENTS = 1000
LATE = 2  # the multiple of the rounds of more rows up to which the last ``FEW`` rows are followed together
TRUSTED = 1e-12  # the largest estimated error of a row, relative to its states, that needs no scalar flow


class SystemEvents(NamedTuple):
    """Events of many trajectories, one after the other, in order of time per trajectory.

    ``trajectory`` counts the trajectories in the order of ``final.reshape(n, -1)``; ``kind``, ``friction`` and
    ``state`` (n, events) are as in ``Path``.
    """

    trajectory: np.ndarray
    kind: np.ndarray
    t: np.ndarray
    state: np.ndarray
    friction: np.ndarray


@dataclass(frozen=True, repr=False, eq=False)
class AffineEnsemble(Many):
    """The results of many trajectories of an affine system; ``final`` (n, ...) is in the order of ``names``.

    ``first`` (frictions, ...) is the phase of each friction at the start, as an index into ``asympk.many.PHASES``.
    ``alone`` is the number of trajectories that were followed by the scalar flow.
    """

    names: tuple[str, ...]
    final: np.ndarray
    n_events: np.ndarray
    first: np.ndarray
    alone: int
    _omitted: dict = field(repr=False)
    _events: SystemEvents = field(repr=False)
    _given: dict = field(repr=False)

    def _axes(self):
        return axes_of(self.n_events.shape, {name: _floats(name, value) for name, value in self._given.items()})

    def events(self) -> SystemEvents:
        """Return the ``SystemEvents``."""
        return self._events


def solve_many(
    *, system: Any, values: Any, start: Any, until: Any, progress: Callable[[int, int], None] | None = None,
    strict: bool = False,
) -> AffineEnsemble:
    """Follow trajectories of an affine system as ``asympk.solve_many`` does; raises ``InputError`` for any other.

    With ``strict=True`` the error of the scalar flow of a trajectory is raised, with the index of the trajectory.
    """
    require_system(system, "solve_many")
    parameters, states, horizon, shape = _broadcast(system, values, start, until)
    total, names, result = horizon.size, [s.name for s in system.states], _blank(system, horizon.size, strict)
    done = 0
    if not total:
        _require_affine(system)
    wider, resting = with_resting(system, parameters, FEW)
    somewhere = {key: raw_entries(f"start: {key}", v).flat[0] for key, v in start.items()} if total else {}
    if resting:
        system.placed(_numbers_at(parameters, 0), somewhere)  # names what is missing as for ``system``
        somewhere |= {symbol: column[0] for symbol, column in resting.items()}
    fixed = {symbol: column for symbol, column in parameters.items() if symbol not in resting}
    for chosen, rows in _groups(fixed, total):
        exact, _ = wider.placed(dict(zip(fixed, chosen, strict=True)), somewhere)
        automaton = Automaton.at(wider, exact)
        _require_affine(automaton.system)
        modes = Modes(automaton)
        for at in range(0, rows.size, CHUNK):
            mine = rows[at : at + CHUNK]
            w = np.column_stack([states[mine], *(column[mine] for column in resting.values())])
            for row in mine[_follow(modes, w, horizon[mine], mine, result)]:
                here, begin = _numbers_at(parameters, row), dict(zip(names, states[row].tolist(), strict=True))
                scene = Scene(system=system, values=here, start=begin, until=float(horizon[row]))
                _alone(partial(run, scene), row, result)
            done += mine.size
            if progress:
                progress(done, total)
    return _ensemble(system, result, shape, {**values, **start, "until": until})


def _require_affine(system):
    if not affine(system):
        raise InputError("solve_many follows the rod and systems whose modes are all affine and not switched by the "
                         "state or the time; solve scene by scene")


def one_by_one(follow: Any, system: Any, values: Any, start: Any, until: Any) -> AffineEnsemble:
    """Follow the trajectories of any system by ``follow(scene)`` from columns of numbers by name, all of one length."""
    result = _blank(system, until.size)

    def followed(row):
        here, begin = ({name: float(column[row]) for name, column in part.items()} for part in (values, start))
        return follow(Scene(system=system, values=here, start=begin, until=float(until[row])))

    for row in range(until.size):
        _alone(partial(followed, row), row, result)
    return _ensemble(system, result, until.shape, {})


class _Result(NamedTuple):
    """The results by the index of the trajectory; ``notes`` are blocks of events, ``alone`` the rows followed alone.

    ``omitted`` maps each trajectory that cannot be followed to its outcome.
    """

    final: np.ndarray
    n_events: np.ndarray
    first: np.ndarray
    notes: list
    alone: list
    omitted: dict
    strict: bool


def _blank(system, total, strict=False):
    first = np.zeros((len(system.frictions), total), dtype=np.uint8)
    return _Result(np.empty((len(system.states), total)), np.zeros(total, dtype=np.int32), first, [], [], {}, strict)


def _ensemble(system, result, shape, given):
    names, number = tuple(s.name for s in system.states), np.zeros(0, np.intp)
    none = number, np.zeros(0, "U16"), np.zeros(0), np.zeros((len(names), 0)), number
    final, first = (part.reshape(len(part), *shape) for part in (result.final, result.first))
    given = {str(key): value for key, value in given.items()}
    return AffineEnsemble(names, final, result.n_events.reshape(shape), first, len(result.alone), result.omitted,
                          SystemEvents(*by_trajectory(none, result.notes)), given)


def _broadcast(system, values, start, until):
    """Return parameters {symbol: (rows,)}, states (rows, n), horizon (rows,) and the common shape."""
    require_mappings(values=values, start=start)
    states = [_floats(f"start: {key}", v) for key, v in start.items()]
    arrays = [*(raw_entries(f"values: {key}", v) for key, v in values.items()), *states, _floats("until", until)]
    shape = common_shape((*values, *start, "until"), arrays)
    flat = [np.broadcast_to(a, shape).ravel() for a in arrays]
    parameters = by_symbol(dict(zip(values, flat, strict=False)), system.parameters, "this system")
    order = {str(key): k + len(values) for k, key in enumerate(start)}
    given = [flat[order[s.name]] for s in system.states if s.name in order]
    horizon = flat[-1]
    if horizon.size and horizon.min() < 0:
        raise InputError(f"until = {horizon.min():g}: it must be zero or positive")
    return parameters, np.array(given).T.reshape(horizon.size, len(given)), horizon, shape


def _floats(name, value):
    found = numbers(name, value).astype(float)
    require_finite(name, found)
    return found


def _numbers_at(parameters, row):
    """Return the numbers of the parameters in one row, as they were given."""
    return {symbol: column[row : row + 1].tolist()[0] for symbol, column in parameters.items()}


def _groups(parameters, total):
    """Yield (values, rows) for every set of parameters."""
    if not total:
        return
    columns = list(parameters.values())
    if all((column[1:] == column[:-1]).all() for column in columns):
        yield tuple(_numbers_at(parameters, 0).values()), np.arange(total)
        return
    keys: dict = {}
    for row, chosen in enumerate(zip(*(column.tolist() for column in columns), strict=True)):
        keys.setdefault(chosen, []).append(row)
    for chosen, rows in keys.items():
        yield chosen, np.array(rows)


class _ActiveRows(NamedTuple):
    """The rows being followed: times, states, covariance of their errors, largest values, branches, numbers of events.

    ``lost`` rows are left to the scalar flow, and ``alive`` rows have not reached their ends.
    """

    rows: np.ndarray
    until: np.ndarray
    t: np.ndarray
    w: np.ndarray
    covariance: np.ndarray
    size: np.ndarray
    branch: np.ndarray
    n_events: np.ndarray
    lost: np.ndarray
    alive: np.ndarray


def _follow(modes, w, until, rows, result):
    """Follow rows of one set of parameters, and return a mask of the rows that are left to the scalar flow."""
    if len(w) > FEW and not modes.are_unclear:
        with suppress(OutOfRange, OverflowError, ZeroDivisionError):  # no row has rates that doubles hold
            return _together(modes, w, until, rows, result)
    return np.ones(len(w), dtype=bool)


def _together(modes, w, until, rows, result):
    """Follow rows mode by mode, and return a mask of the rows that are left to the scalar flow."""
    t, states = np.zeros(len(w)), len(result.final)
    branch, lost = modes.beginning(t, w)
    for k in np.unique(branch[~lost]):
        mine = rows[(branch == k) & ~lost]
        result.first[:, mine] = np.reshape([PHASES.index(phase.mode) for phase in modes.branches[k]], (-1, 1))
    count, notes = np.zeros(len(w), dtype=np.int32), []
    none = np.zeros((*w.shape, w.shape[1]))
    active = _ActiveRows(rows, until, t, w, none, abs(w), branch, count, lost, ~lost)
    rounds = crowded = 0
    while many := active.alive.sum():
        rounds, crowded = rounds + 1, crowded + (many > FEW)
        for k in np.unique(branch[active.alive]):
            notes += _advanced(modes, active, k)
        lost |= (count > MOST_EVENTS) | (active.alive & (rounds > LATE * crowded))
        active.alive[lost] = False
    error = np.sqrt(np.einsum("mii->mi", active.covariance))
    lost |= ~(error <= TRUSTED * np.where(active.size > 0, active.size, 1.0)).all(axis=1)
    result.final[:, rows], result.n_events[rows] = w.T[:states], count
    kept = _kept(notes, rows[lost]) if lost.any() else notes
    result.notes.extend((*marks, w[:states], friction) for *marks, w, friction in kept)
    return lost


def _advanced(modes, active, k):
    """Follow the rows in branch number k to the ends of their segments; return notes of their events."""
    mine = np.flatnonzero(active.alive & (active.branch == k))
    begun = active.t[mine]
    flow, _, kept, kinds = modes.flow(modes.branches[k])
    states, whole = active.w.shape[1], modes.whole(modes.branches[k], active.t[mine], active.w[mine])
    covariance = np.zeros((len(mine), *[whole.shape[1] - 1] * 2))  # of the forcing, too, which has no error as yet
    covariance[:, :states, :states] = active.covariance[mine]
    ends = follow_rows(flow, flow.mode.mesh, whole, active.until[mine] - active.t[mine], covariance)
    active.lost[mine] |= ends.open | _pushed_on(modes, k, begun, active.w[mine], ends.span)
    active.w[mine], active.covariance[mine] = ends.state[:, :states], ends.covariance[:, :states, :states]
    active.t[mine] = np.where(ends.hit < 0, active.until[mine], active.t[mine] + ends.span)
    active.alive[mine] = (ends.hit >= 0) & ~active.lost[mine]
    notes = []
    for hit in np.unique(ends.hit[active.alive[mine]]):
        at = active.alive[mine] & (ends.hit == hit)
        rates = modes.rates(modes.branches[k], active.t[mine[at]], active.w[mine[at]])
        notes.append(_after(modes, k, kinds[kept[hit]], flow.rows[hit], rates, active, mine[at]))
        active.covariance[mine[at]] = _covariance(modes, flow.rows[hit], rates, active, mine[at], ends.covariance[at])
    active.size[mine] = np.maximum(active.size[mine], abs(active.w[mine]))
    # a row that begins its mode again at the same time would do so endlessly
    active.lost[mine] |= active.alive[mine] & (active.t[mine] == begun) & (active.branch[mine] == k)
    return notes


def _pushed_on(modes, k, begun, w, span):
    """Tell of each row whether kinetic friction may become negative in its segment; the scalar flow judges it."""
    mode = modes.automaton.mode(modes.branches[k]).mode
    low = (modes.values(mode.laws, begun, w) < 0).any(axis=0) if mode.laws else np.zeros(len(begun), dtype=bool)
    if low.all() or not mode.laws:
        return low
    flow, waves, _ = modes.flows.of(Doubles, mode, form_of_laws)
    return low | may_fall(flow, flow.mode.mesh, rows_with_waves(waves, begun, w), span)


def _kept(notes, lost):
    """Return notes without those of lost rows."""
    picked = ((note, ~np.isin(note[0], lost)) for note in notes)
    return [tuple(part[..., keep] for part in note) for note, keep in picked]


def _after(modes, k, event, row, rates, active, ended):
    """Move ``ended`` rows onto the guard that they lost and find the next branch; return a note of the events.

    ``rates`` are those of the states and the waves before the event.
    """
    (kind, friction), before, w, t = event, modes.branches[k], active.w, active.t[ended]
    movable = np.array(modes.automaton.mode(before).movable)
    w[ended] = _snapped(modes.whole(before, t, w[ended]), rates, row, movable, kind in OF_STATES)
    active.branch[ended], left = modes.following(k, event, t, w[ended])
    active.lost[ended] |= left
    changed = ended[active.branch[ended] != k]
    active.n_events[changed] += 1
    # at the tip of the friction cone the load vanishes and stick continues
    sticks = [modes.branches[k][friction].mode == "stick" for k in active.branch[changed].tolist()]
    kinds = np.where(np.array(sticks, dtype=bool) & (kind == "slip_onset"), "force_zero", kind)
    return active.rows[changed], kinds, active.t[changed], w[changed].T.copy(), np.full(len(changed), friction)


def _covariance(modes, row, before, active, ended, covariance):
    """Return the covariance after events, which the matrix of Lemma 8 carries on, with that of their times.

    ``before`` are the rates of the states and the waves before the event.
    """
    t, w, gradient = active.t[ended], active.w[ended], row[:-1]
    after = np.full(w.shape, np.nan)  # NaN where no branch is known
    for b in np.unique(active.branch[ended][~active.lost[ended]]):
        mine = active.branch[ended] == b
        after[mine] = modes.rates(modes.branches[b], t[mine], w[mine])[:, : w.shape[1]]
    with np.errstate(all="ignore"):
        turned = (after - before[:, : w.shape[1]])[:, :, None] * (gradient / (before @ gradient)[:, None])[:, None]
        found = carried_on(np.eye(*turned.shape[1:]) + turned, covariance)
        return found + ((UNIT * t) ** 2)[:, None, None] * after[:, :, None] * after[:, None]


def _snapped(whole, rates, row, movable, of_states):
    """Return states moved onto the zero of a guard, along the movable state whose motion, or size, changes it most.

    Unless the guard is one ``of_states``, none is moved where the time changes the guard by itself: the zero is found
    to rounding, and the states would take on the rounding of its time.
    """
    states = len(movable)
    if of_states or not row[states:-1].any():
        changes = rates[:, :states], 1 + abs(whole[:, :states])
        moved, size = (abs(row[:states] * change) * movable for change in changes)
        place = np.where(moved.any(axis=1), moved.argmax(axis=1), size.argmax(axis=1))
        (mine,) = np.nonzero((row[place] != 0) & movable[place])
        for _ in range(2):
            whole[mine, place[mine]] -= (whole[mine] @ row) / row[place[mine]]
    return whole[:, :states]


def _alone(follow, row, result):
    """Put the ``Path`` that ``follow()`` returns as one trajectory, or why there is none."""
    result.alone.append(row)
    result.n_events[row] = 0
    try:
        path = follow()
    except tuple(REFUSALS) as reason:
        if result.strict:
            reason.args = (f"trajectory {row}: {reason}", *reason.args[1:])
            raise
        result.final[:, row], result.omitted[int(row)] = np.nan, outcome_of(reason)
        return
    result.final[:, row], result.n_events[row] = path.final, len(path.events)
    result.first[:, row] = [PHASES.index(phase) for phase in path.modes[0].split("+")] if len(result.first) else []
    if path.events:
        kinds, times, states, frictions = zip(*path.events, strict=True)
        rows = np.full(len(kinds), row)
        result.notes.append((rows, np.array(kinds), np.array(times), np.array(states).T, np.array(frictions)))
