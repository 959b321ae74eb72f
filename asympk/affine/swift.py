r"""The next mode of an automaton, decided in doubles by a few products where every sign is clear.

The guards of all modes that may follow, and their first two derivatives, are rows on (w, 1). A mode may follow if each
of its guards is positive, or is 0 and its first nonvanishing derivative is positive. Where a value is neither clear nor
zero to rounding, or not exactly one mode remains, the automaton itself decides. The decisions are always those of the
automaton. A sign that is clear in doubles is so for a state in digits, too; a derivative that is 0 to the rounding of
doubles is not known to be 0 there. ``Swift`` is the entry, and ``_decided`` the hard function.
"""

from contextlib import suppress
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from asympk.affine.forcing import rounding_of_waves, with_waves
from asympk.arithmetic import Doubles
from asympk.automaton.contacts import coupled, feels_directions
from asympk.automaton.exact import exact_values
from asympk.automaton.modes import phases_of
from asympk.errors import InputError, Undecided
from asympk.symbolic.branches import Branch, Phase, is_pushed, is_smooth, most_at_rest, rate_along, stands
from asympk.symbolic.forces import determined
from asympk.symbolic.long import symbols_in
from asympk.symbolic.sides import Sides

_ZERO, _CLEAR = 1e-13, 1e-11  # relative sizes up to which a value is 0, and beyond which its sign is clear
_ORDERS = 3
_EXACT_ORDERS = 2  # of states that are known beyond doubles: the guard that the event makes 0, and its slope
_PAYS = 4  # decisions of one kind before a table is made, which needs exponentials of modes that are perhaps never met
_AT_EVENT = {
    "velocity_zero": ("velocity_zero",),
    "force_zero": ("force_zero",),
    "slip_onset": ("velocity_zero", "slip_onset"),
}
_MOST = 2  # the number of frictions up to which all combinations of phases are in one table


class GuardTable(NamedTuple):
    """Branches, their common waves, and all their guards in order: ``rows`` (derivatives, guards, n + 1).

    ``vanishing`` marks the guards that the event makes 0. A zero of any other guard leaves the decision open.
    """

    branches: tuple[Branch, ...]
    waves: tuple
    counts: tuple[int, ...]
    rows: np.ndarray
    sizes: np.ndarray
    kinds: tuple[tuple[str, int], ...]
    vanishing: tuple[bool, ...]


class Swift:
    """An automaton whose decisions are made in doubles where possible; ``flows`` are the ``Flows`` of its modes."""

    def __init__(self, flows: Any) -> None:
        self.automaton, self.flows, self.system = flows.automaton, flows, flows.automaton.system
        self.mode, self.edges_at = self.automaton.mode, self.automaton.edges_at
        self.values, self.coefficients = self.automaton.values, self.automaton.coefficients
        self._tables: dict = {}
        self._asked: dict = {}

    def first(self, start: tuple, digits: int | None = None) -> Branch:
        """Return the mode that begins at t = 0, as ``Automaton.first`` does."""
        table = self._known("first", lambda: _beginning(self.system), set())
        return (table and _begun(table, tuple(map(float, start)))) or self.automaton.first(start, digits=digits)

    def next(
        self, branch: Branch | None, hits: tuple[int, ...], t: Any, state: tuple, slack: Any, sides: Sides = ()
    ) -> Branch:
        """Return the mode that follows, as ``Automaton.next`` does."""
        found = None
        if branch is not None and len(hits) == 1:
            kind, friction = event = self.mode(branch).kinds[hits[0]]
            zeros = {(name, friction) for name in _AT_EVENT.get(kind, ())}
            table = self._known((branch, hits[0]), lambda: _following(self.system, branch, event), zeros)
            orders = _ORDERS if isinstance(t, float) and _may_hold(self.system, friction) else _EXACT_ORDERS
            with suppress(OverflowError):  # a state or a wave that doubles do not hold
                found = table and _decided(table, float(t), tuple(map(float, state)), orders)
        return found or self.automaton.next(branch, hits, t, state, slack, sides)

    def _known(self, key, candidates, zeros):
        """Return the table of a decision, or None before the decision has been asked for more than ``_PAYS`` times.

        None, too, where the state or the time switches the modes.
        """
        if phases_of(self.system):
            return None
        if key not in self._tables:
            self._asked[key] = self._asked.get(key, 0) + 1
            if self._asked[key] <= _PAYS:
                return None
            self._tables[key] = None
            with suppress(Undecided, OverflowError):  # the flow of a mode that may never be met
                self._tables[key] = self._table(candidates(), zeros)
        return self._tables[key]

    def entered(self, branch: Branch) -> tuple | None:
        """Return what ``Flows.of`` returns in doubles, or None for a branch that is never entered.

        The forces of such a branch are not determined, or a guard that depends on the parameters alone is negative.
        Raises ``Undecided`` and ``OverflowError`` for a branch whose flow doubles do not hold.
        """
        try:
            conditions = self.mode(branch).mode.conditions
            fixed = exact_values(self.system, conditions, self.automaton.values, 24).values()
            return self.flows.of(Doubles, self.mode(branch).mode) if all(v >= 0 for v in fixed) else None
        except InputError:
            return None

    def _table(self, candidates, zeros):
        """Return the ``GuardTable`` of branches, or None where rows do not decide, as with undetermined forces."""
        if not all(determined(self.system, branch) for branch in candidates if not any(p.velocity for p in branch)):
            return None
        kept, waves, rows, kinds = [], set(), [], []
        for branch in candidates:
            if not (found := self.entered(branch)):
                continue
            flow, wave, moving = found
            matrix = np.array(flow.mode.homogeneous, dtype=float)
            rows.append([flow.rows, flow.rows @ matrix, flow.rows @ matrix @ matrix])
            kept.append(branch)
            waves.add(wave)
            kinds += [self.mode(branch).kinds[k] for k in moving]
        if len(waves) != 1:
            return None
        stacked = np.concatenate(rows, axis=1)
        counts = tuple(len(row[0]) for row in rows)
        zero = tuple(kind in zeros or kind[0] in zeros for kind in kinds)
        return GuardTable(tuple(kept), waves.pop(), counts, stacked, abs(stacked), tuple(kinds), zero)


def _beginning(system):
    """Return the branches that may begin; none with contacts that may open or feel the direction of sliding.

    Nor are there any for smooth contacts, for loads that contain forces, or for 0 or over ``_MOST`` frictions.
    """
    opens = any(f.gap is not None for f in system.frictions)
    smooth = any(is_smooth(system, k) for k in range(len(system.frictions)))
    if opens or smooth or _is_for_automaton(system) or not 0 < len(system.frictions) <= _MOST:
        return []
    return list(product([Phase(load, v) for load in (1, -1) for v in (0, 1, -1)], repeat=len(system.frictions)))


def _begun(table, state):
    """Return the branch that begins at a state, or None unless every sign is clear or a velocity or load is exactly 0.

    A velocity or load that is 0 counts as exact where it is a multiple of one state, or all states in it are 0.
    """
    whole = np.array([*with_waves(Doubles, table.waves, 0.0, state), 1.0])
    values, sizes = table.rows[0] @ whole, table.sizes[0] @ abs(whole)
    alone = (table.rows[0] != 0).sum(axis=1) == 1
    surfaces = [kind[0] in ("velocity_zero", "force_zero") for kind in table.kinds]
    zero = (values == 0) & (alone | (sizes == 0)) & surfaces
    resting = {k for (kind, k), v in zip(table.kinds, values, strict=True) if kind == "velocity_zero" and v == 0}
    possible = [all((phase.velocity != 0) or k in resting for k, phase in enumerate(b)) for b in table.branches]
    return _decided(table._replace(vanishing=tuple(zero)), 0.0, state, _EXACT_ORDERS, possible)


def _following(system, branch, event):
    """Return the branches that may follow an event of one friction; none where other frictions may change, too.

    Other frictions may change where a contact opens or closes, where contacts at rest share forces that are not
    determined, where static friction exceeds kinetic friction in contacts that share forces, so that another one at
    rest may slip instead, where they feel the direction of sliding, and where loads contain forces.
    """
    kind, k = event
    if kind not in _AT_EVENT or stands(branch) or _is_for_automaton(system):
        return []
    group = next(group for group in coupled(system) if k in group)
    if len(group) > 1 and any(system.frictions[j].static != system.frictions[j].kinetic for j in group):
        return []
    load, velocity, *_ = branch[k]
    moving = [Phase(load, v) for v in (1, -1)]
    turned, moved = [Phase(sign, velocity) for sign in (1, -1)], [Phase(load, 0)] * _may_hold(system, k) + moving
    phases = turned if kind == "force_zero" else moved
    return list(product(*((phase,) if j != k else phases for j, phase in enumerate(branch))))


@lru_cache(maxsize=256)
def _may_hold(system, k):
    """Tell whether a force acts on the sliding velocity of friction k: else no rest goes on where its rate is not 0.

    A relay behind a lag is such a friction.
    """
    return bool(symbols_in(rate_along(system, system.frictions[k].velocity)) & {*system.pushes})


def _is_for_automaton(system):
    """Tell whether all decisions are left to the automaton: contacts feel the direction of sliding, or loads forces.

    Such a load may have either sign, or none, in several modes that may follow.
    """
    return feels_directions(system) or any(is_pushed(system, k) for k in range(len(system.frictions)))


def _decided(table, t, state, orders, possible=None):
    """Return the one possible branch that continues from a state, or None where this is not clear.

    It is not where more than two continue: a contact at rest may then be about to slip in either direction.
    """
    whole = np.array([*with_waves(Doubles, table.waves, t, state), 1.0])
    known = np.array([*rounding_of_waves(Doubles, table.waves, t, state), 1.0])
    signs = _signs((table.rows @ whole).tolist(), (table.sizes @ known).tolist(), table.vanishing, orders)
    at, holding = 0, []
    for k, (branch, count) in enumerate(zip(table.branches, table.counts, strict=True)):
        mine = signs[at : at + count]
        at += count
        if -1 in mine or (possible and not possible[k]):
            continue
        if 0 in mine:
            return None
        holding.append(branch)
    resting = most_at_rest(holding)
    return resting[0] if len(resting) == 1 and len(holding) <= 2 else None


def _signs(values, sizes, vanishing, orders):
    """Return the sign of the first nonvanishing derivative, from order 0 on, of every guard, or 0 if not clear."""
    found = []
    for k in range(len(values[0])):
        sign = 0
        for order in range(orders):
            value, size = values[order][k], sizes[order][k]
            if abs(value) > _CLEAR * size:
                sign = 1 if value > 0 else -1
                break
            if abs(value) > _ZERO * size or not vanishing[k]:
                break
        found.append(sign)
    return found
