r"""The curves around a motion in its phase picture: slow manifolds at mu = 0, and where v = 0 sticks.

The curves lie in a plane through the start: states that the picture does not show keep their values at the start. A
quantity that is a combination of states, as the load s = x + y, takes its values by a change of one state: the last in
the combination that is not itself the other quantity of the picture.
"""

from collections.abc import Sequence
from copy import copy
from functools import cache
from itertools import groupby
from typing import Any

import numpy as np
import sympy as sp

from asympk.automaton.compiled import function
from asympk.errors import NotDerivable, NotNormallyHyperbolic, UnknownName
from asympk.numbers import short
from asympk.scene import Scene
from asympk.symbolic.critical import critical_manifolds
from asympk.symbolic.expansion import is_implicit, over_fast
from asympk.symbolic.stick import friction_cone, plane_of_rest
from asympk.symbolic.system import System
from asympk.systems.automata import automaton_of
from asympk.systems.painleve_klein.units import scene_in_units

Curve = dict[str, Any]


def surroundings(scene: Scene, pair: Sequence[str], across: Sequence[float], up: Sequence[float]) -> list[Curve]:
    """Return curves of name, kind (``stable``, ``unstable``, ``stick``) and points over a pair of quantities.

    ``across`` and ``up`` are the values of the two quantities on the grid of the picture. Slow manifolds are drawn of
    systems with one fast state, stick of systems with one friction. ``begun`` says whether the curves change with the
    time or with states that the picture does not show. Raises ``UnknownName`` for an unknown quantity.
    """
    plane = _Plane(scene, pair)
    with np.errstate(all="ignore"):  # what is not finite is left out
        grids = [np.array(grid) / size for grid, size in zip((across, up), plane.sizes, strict=True)]
        found, others = _curves(plane, grids), (_curves(plane.beside(side), grids) for side in (1, -1))
        timed, unmoved = plane.system.time is not None, not plane.still.any()
        begun = timed or not (unmoved or all(_equal(found, other) for other in others))
        return [{**curve, "points": (curve["points"] * plane.sizes).tolist(), "begun": begun} for curve in found]


def _curves(plane: "_Plane", grids: list[np.ndarray]) -> list[Curve]:
    return [*_slow(plane, grids), *_stick(plane, grids)]


def _equal(found: list[Curve], other: list[Curve]) -> bool:
    """Return whether two lists have the same curves but for rounding."""
    return len(found) == len(other) and all(
        a["kind"] == b["kind"] and a["points"].shape == b["points"].shape
        and np.allclose(a["points"], b["points"], rtol=1e-9, atol=1e-9) for a, b in zip(found, other, strict=True))


class _Plane:
    """The plane of the picture: two states vary with the two quantities that it shows, all others are at the start."""

    def __init__(self, scene: Scene, pair: Sequence[str]):
        automaton = automaton_of(scene)
        self.system: System = automaton.system
        self.values = np.array([float(v) for v in automaton.values])  # whose quotients by 0 are infinite, not errors
        self.start = np.array([float(v) for v in scene.start])
        self.weights, sizes = _quantities(scene)
        for name in pair:
            if name not in self.weights:
                raise UnknownName(f"{short(name)} is no quantity; choose two of {', '.join(self.weights)}")
        self.pair = [self.weights[name] for name in pair]
        self.sizes = np.array([sizes[name] for name in pair])
        own = [np.flatnonzero(weights).tolist() for weights in self.pair]
        others = [states if len(states) == 1 else [] for states in reversed(own)]
        # for each quantity the state that it changes: the last of its states that is not the other quantity
        self.moved = [([k for k in mine if k not in one] or mine)[-1] for mine, one in zip(own, others, strict=True)]

    def over(self, state: int) -> int | None:
        """Return which quantity leaves a state alone while the other one changes it; None where there is none."""
        return 1 - self.moved.index(state) if self.moved.count(state) == 1 else None

    @property
    def still(self) -> np.ndarray:
        """Which states the picture does not move."""
        return ~np.isin(np.arange(self.start.size), self.moved)

    def beside(self, side: int) -> "_Plane":
        """Return a plane on one side, beyond 0 too, in which the states that stand ``still`` have others."""
        found = copy(self)
        found.start = self.start + side * self.still * (1 + 2 * abs(self.start))
        return found

    def placed(self, which: int, grid: np.ndarray) -> np.ndarray:
        """Return states of shape (n, m) in which one quantity of the pair takes the values of ``grid``."""
        states = np.repeat(self.start[:, None], grid.size, axis=1)
        weights, k = self.pair[which], self.moved[which]
        states[k] += (grid - weights @ self.start) / weights[k]
        return states

    def seen(self, states: np.ndarray) -> np.ndarray:
        """Return the points of the picture, of shape (m, 2)."""
        return np.stack([weights @ states for weights in self.pair], axis=-1)


def _quantities(scene: Scene) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """Return the weights of the states in every quantity by its name, and the size of its unit."""
    names, n = list(scene.names), len(scene.names)
    weights = {name: np.eye(n)[k] for k, name in enumerate(names)}
    weights |= {name: np.array(w, dtype=float) for name, w in scene.combinations}
    if scene.rod is None:
        return weights, dict.fromkeys(weights, 1.0)
    physical, units = scene_in_units(scene), scene.rod.units
    named = [*physical.names, *(name for name, _ in physical.combinations)]
    sizes = [*map(float, units.state(1, 1, 1)), float(units.reaction)]
    return dict(zip(named, weights.values(), strict=True)), dict(zip(named, sizes, strict=True))


def _slow(plane: _Plane, grids: list[np.ndarray]) -> list[Curve]:
    """Return the slow manifolds as graphs over the quantity that moves another state than the one that they give."""
    system = plane.system
    if len(system.fast) != 1 or system.small is None:
        return []
    curves = []
    for name, state, graph in _manifolds(system):
        given = system.states.index(state)
        if (over := plane.over(given)) is None:
            continue
        part = plane.pair[over][given] * (plane.placed(1 - over, grids[1 - over])[given] - plane.start[given])
        ends = grids[over].min(), grids[over].max()  # of the quantity, of which the state is a part
        states = plane.placed(over, np.interp(grids[over], ends, (ends[0] - part.max(), ends[1] - part.min())))
        values = np.broadcast_arrays(*graph(0.0, *states, *plane.values), states[0])[:3]
        on = states.copy()
        on[given] = values[0]
        kinds = np.where(values[1] > 0, np.where(values[2] < 0, "stable", "unstable"), "")
        curves += _pieces(name, kinds, plane.seen(on))
    return curves


@cache
def _manifolds(system: System) -> tuple[tuple[str, sp.Symbol, Any], ...]:
    """Return (name, s, function) of the critical manifolds s = h; the function returns h, 1 if it exists, and dg/dy.

    The state s is the fast one y, or the slow one x where g = 0 is x = phi(y) and not solved for y.
    """
    try:
        found = critical_manifolds(system)
    except (NotDerivable, NotNormallyHyperbolic):
        return ()
    seen = (m for m in found if not m.name.startswith("Lambda") and m.domain != sp.false)
    graphs = ((m, over_fast(m.dynamics, m.small, m.branch) if is_implicit(m.branch) else m.branch) for m in seen)
    outputs = ((m.name, state, (height, _holds(m.dynamics.where.subs(graph)), m.jacobian[0, 0]))
               for m, graph in graphs for state, height in graph.items())
    return tuple((name, state, function(system, exprs, "numpy", np)) for name, state, exprs in outputs)


def _stick(plane: _Plane, grids: list[np.ndarray]) -> list[Curve]:
    """Return the parts that stick of the switching surface v = 0, which is a line in the picture."""
    if (rest := _rest(plane.system)) is None or (over := plane.over(rest[0])) is None:
        return []
    state, line = rest
    states = plane.placed(over, grids[over])
    height, sticks = np.broadcast_arrays(*line(0.0, *states, *plane.values), states[0])[:2]
    states[state] = height
    return _pieces("stick", np.where(sticks > 0, "stick", ""), plane.seen(states))


@cache
def _rest(system: System) -> tuple[int, Any] | None:
    """Return the index of a state in v, and a function that returns its value where v = 0, and 1 where v = 0 sticks."""
    try:
        rule, ((state, rest),) = friction_cone(system).rule("stick"), plane_of_rest(system).items()
    except NotDerivable:
        return None
    return system.states.index(state), function(system, (rest, _holds(rule)), "numpy", np)


def _holds(condition: sp.Basic) -> sp.Expr:
    return sp.Piecewise((1, condition), (0, True))


def _pieces(name: str, kinds: np.ndarray, points: np.ndarray) -> list[Curve]:
    """Cut a curve where its kind changes, and leave out points that have no kind or are not finite."""
    kinds = np.where(np.isfinite(points).all(axis=1), kinds, "")
    runs = [(kind, [*run]) for kind, run in groupby(range(len(kinds)), key=lambda k: str(kinds[k]))]
    return [{"name": name, "kind": kind, "points": points[run]} for kind, run in runs if kind and len(run) > 1]
