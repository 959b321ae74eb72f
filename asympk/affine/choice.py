r"""The mode of an affine system that begins or follows, chosen on arrays of rows by the rules of ``automaton``.

A mode may begin or follow in a row if each of its guards is positive, or is 0 and rises. Where this is not clear, and
where a load contains forces and not exactly one mode remains, the choice is left to the automaton. ``Modes._chosen`` is
the hard function.
"""

from collections.abc import Iterable
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from asympk.affine.forcing import with_waves
from asympk.affine.functions import Arrays, initial
from asympk.affine.moderows import rows_of
from asympk.affine.run import flows
from asympk.automaton.automaton import Automaton
from asympk.automaton.compiled import function
from asympk.automaton.contacts import coupled
from asympk.automaton.exact import exact_values
from asympk.automaton.modes import mode_of
from asympk.automaton.numericmode import OF_STATES
from asympk.automaton.uniqueness import has_always_one_motion, is_watched
from asympk.symbolic.branches import Branch, Phase, all_phases, at_rest, is_pushed, rate_along
from asympk.symbolic.forces import determined
from asympk.symbolic.guards import NEVER_IDLE
from asympk.symbolic.long import symbols_in

_CLEAR = 1e-13  # the relative size below which a sign is not trusted
_MOST = 2  # the number of frictions, where loads contain forces, up to which all combinations of phases are tried


def rows_with_waves(waves: Iterable[tuple], t: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return the states ``(w, waves, 1)`` of rows at their times."""
    return np.column_stack(np.broadcast_arrays(*with_waves(Arrays, waves, t, w.T), np.ones(len(t))))


class Modes:
    """The modes of a system in doubles, at its parameters, by their index in ``branches``."""

    def __init__(self, automaton: Automaton) -> None:
        self.automaton, self.system = automaton, automaton.system
        self.flows, self.p = flows(automaton), tuple(map(float, automaton.values))
        self.branches: list[Branch] = []
        self._known: dict = {}
        self.pushed = np.array([is_pushed(self.system, k) for k in range(len(self.system.frictions))], dtype=bool)

    def index(self, branch: Branch) -> int:
        """Return the index of a branch in ``branches``, to which a new one is added."""
        if branch not in self.branches:
            self.branches.append(branch)
        return self.branches.index(branch)

    def flow(self, branch: Branch) -> Any:
        """Return (flow, waves, kept guards, kinds) of a branch, or None for a branch that is never entered."""
        if branch not in self._known:
            found = self.flows.swift.entered(branch)
            self._known[branch] = found and (*found, self.automaton.mode(branch).kinds)
        return self._known[branch]

    def whole(self, branch: Branch, t: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the states ``(w, waves, 1)`` of rows at their times."""
        return rows_with_waves(self.flow(branch)[1], t, w)

    def rates(self, branch: Branch, t: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the rates of the states and the waves in rows."""
        flow = self.flow(branch)[0]
        sums = flow.parts(self.whole(branch, t, w) @ flow.tables.T).sums
        return np.array(initial(flow.blocks), dtype=float) @ flow.rate @ sums[:, : len(flow.rate)]

    @cached_property
    def are_unclear(self) -> bool:
        """Whether the automaton must decide in every row, as the forces in the loads may not tell one motion.

        They do, in contacts that are closed and stay so, if every mode determines them and none is within the paradox.
        """
        if not self.pushed.any() and not _rigid(self.system):
            return False
        unkept = any(f.gap is None and f.gap_rate is None for f in _rigid(self.system))
        return unkept or len(self.pushed) > _MOST or not all(map(self._is_unambiguous, self._combinations()))

    def _is_unambiguous(self, branch: Branch) -> bool:
        if not determined(self.system, branch):
            return False
        mode = mode_of(self.system, branch)
        guards = [guard.value for guard in mode.fixed_guards if guard.kind in NEVER_IDLE]
        known = exact_values(self.system, tuple(guards), self.automaton.values, 24).values()
        alone = not is_watched(mode) or has_always_one_motion(self.automaton, branch)
        return alone and all(v > 0 for v in known) and not any(guard.kind in NEVER_IDLE for guard in mode.guards)

    def _combinations(self) -> Iterable[Branch]:
        return product(*(all_phases(self.system, k) for k in range(len(self.pushed))))

    def beginning(self, t: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (index of the first branch of each row, mask of the rows for which this is open)."""
        velocities, loads = self._contacts(t, w)
        scale = _CLEAR * (1 + abs(w).max(axis=1, initial=0.0))
        tiny = ((velocities != 0) & (abs(velocities) < scale)) | (abs(loads) < scale)
        branch, doubtful = self._chosen(self._combinations(), t, w, velocities, loads, exact=True)
        return branch, doubtful | tiny.any(axis=0) | self._are_apart(t, w) | self._push_on(t, w)

    def _push_on(self, t, w):
        """Tell in which rows a bound of friction that varies with the states is negative, or below the kinetic one."""
        bounds = [b for f in self.system.frictions for b in (f.kinetic, f.static - f.kinetic)]
        varying = [b for b in bounds if symbols_in(b) & {*self.system.states}]
        return (self.values(varying, t, w) < 0).any(axis=0)

    def _are_apart(self, t, w):
        """Tell in which rows a rigid contact is open, or its gap or gap rate is not exactly 0."""
        rigid = _rigid(self.system)
        kept = [f.gap_rate for f in rigid if f.gap is None]
        kept += [part for f in rigid if f.gap is not None for part in (f.gap, rate_along(self.system, f.gap))]
        return self.values(kept, t, w).any(axis=0)

    def following(self, k: int, event: tuple[str, int], t: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (index, mask of open rows) as ``beginning`` does, after branch number k has lost a guard in all rows.

        Other frictions change with the one of the event only where loads contain forces; such rows are left open, and
        so is a rigid contact that opens or closes.
        """
        (kind, friction), before = event, self.branches[k]
        velocities, loads = self._contacts(t, w)
        if kind == "velocity_zero":
            velocities[friction] = 0.0
        if kind in ("force_zero", "lift_off", "touch_down"):
            loads[friction] = 0.0
        velocities[[*at_rest(before)]] = 0.0
        phases: list[tuple[Phase, ...]] = [(phase,) for phase in before]
        if self.pushed.any():
            phases = [(phase,) if phase.is_open else all_phases(self.system, j) for j, phase in enumerate(before)]
        phases[friction] = all_phases(self.system, friction)
        found, doubtful = self._chosen(product(*phases), t, w, velocities, loads)
        others = [_without(branch, friction) != _without(before, friction) for branch in self.branches]
        rigid = self.system.frictions[friction].rigid and kind in ("lift_off", "touch_down")
        return found, doubtful | np.array(others, dtype=bool)[found] | rigid

    def _chosen(self, candidates, t, w, velocities, loads, exact=False):
        """Return (index of the consistent branch of each row, mask of open rows); rest is preferred to slip.

        It is not where loads contain forces, or a force acts on several sliding velocities: then rows with more than
        one consistent branch are open. So are ``exact`` rows on whose rounding a branch depends: their signs are those
        of the exact numbers.
        """
        found, rank, doubtful = np.full(len(t), -1), np.full(len(t), -1), np.zeros(len(t), dtype=bool)
        several = self.pushed.any() or any(len(group) > 1 for group in coupled(self.system))
        for candidate in candidates:
            rows = np.flatnonzero(self._are_possible(candidate, velocities, loads))
            if not rows.size:
                continue
            holds, known = self._consistent(candidate, t[rows], w[rows], exact)
            doubtful[rows] |= ~known
            rest = len(at_rest(candidate))
            better, other = holds & (rest > rank[rows]), holds & (rank[rows] >= 0)
            doubtful[rows] |= other if several else holds & (rest == rank[rows])
            found[rows[better]], rank[rows[better]] = self.index(candidate), rest
        return found, doubtful | (found < 0)

    def _are_possible(self, candidate, velocities, loads):
        """Tell in which rows velocities and loads have the signs of a branch; forces give a load either sign."""
        found = np.ones(loads.shape[1], dtype=bool)
        for k, phase in enumerate(candidate):
            if phase.is_open or phase.smooth:
                continue
            if not self.pushed[k]:
                found &= (loads[k] == 0) | (np.sign(loads[k]) == phase.load)
            found &= (velocities[k] == 0) if phase.velocity == 0 else (velocities[k] * phase.velocity >= 0)
        return found

    def _consistent(self, branch, t, w, exact):
        """Return (consistent, known) of a branch on rows: consistent where every guard is positive, or 0 and rising."""
        if self.flow(branch) is None:
            return np.zeros(len(t), dtype=bool), np.ones(len(t), dtype=bool)
        rows = rows_of(self.flow(branch)[0], self.whole(branch, t, w))
        n = len(rows.flow.rate)
        first, off = rows.parts.guards[:, n], rows.term_sizes.guards[:, n] * _CLEAR
        positive = np.where(rows.zero, rows.reach > 0, first > off)
        negative = np.where(rows.zero, rows.reach < 0, first < -off)
        known = positive.all(axis=1) | negative.any(axis=1)
        return positive.all(axis=1), known & ~self._is_rounding(branch, rows) if exact else known

    def _is_rounding(self, branch, rows):
        """Tell in which rows a velocity that is 0 has no clear slope, or a margin of the contacts is 0 by rounding."""
        flow, _, kept, kinds = self.flow(branch)
        start, names = np.array(initial(flow.blocks)), np.array([kinds[k][0] for k in kept], dtype=object)
        slope, size = start @ rows.parts.slopes, start @ rows.term_sizes.slopes
        level = (names == "velocity_zero") & (abs(slope) <= _CLEAR * size) & (size > 0)
        return (rows.zero & (level | ~np.isin(names, OF_STATES))).any(axis=1)

    def _contacts(self, t, w):
        """Return (velocities, loads), arrays (frictions, rows); loads that contain forces are NaN."""
        frictions = self.system.frictions
        loads = (sp.S.Zero if pushed else f.load for f, pushed in zip(frictions, self.pushed, strict=True))
        found = self.values([*(f.velocity for f in frictions), *loads], t, w)
        found[len(frictions) :][self.pushed] = np.nan
        return found[: len(frictions)], found[len(frictions) :]

    def values(self, exprs: Iterable[sp.Expr], t: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the values of expressions, an array (expressions, rows)."""
        found = function(self.system, tuple(exprs), "numpy", np)(t, *w.T, *self.p)
        return np.array([np.broadcast_to(v, t.shape) for v in found], dtype=float).reshape(-1, len(t))


def _without(branch, friction):
    return branch[:friction] + branch[friction + 1 :]


def _rigid(system):
    return [friction for friction in system.frictions if friction.rigid]
