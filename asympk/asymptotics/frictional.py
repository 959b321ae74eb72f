r"""The asymptotic models of a system with friction: layers, jumps, slow motion, edges.

Higher orders are those of ``matched``. To order 0, for one friction and one fast state, the start's layer lands on the
critical manifold of a mode (``impact``), the reduced flow goes on from there until a guard of the mode vanishes, a new
layer begins at that edge, and so on. Layers take no time in this limit: what their events have in common is the time of
the layer. Errors are O(mu log(1/mu)); the path tells none of its own.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from asympk.asymptotics import matched, reduced
from asympk.asymptotics.fibre import formulas
from asympk.asymptotics.impact import Arrival, Layers
from asympk.asymptotics.matched import Stretch
from asympk.asymptotics.smooth import checked_order, tolerance
from asympk.automaton.automaton import Automaton
from asympk.errors import InputError, NoManifold, NotDerivable, OutOfRange, TooManyEvents
from asympk.path import Event, Path
from asympk.symbolic import branches
from asympk.symbolic.system import Mode, System

RTOL = 1e-9
FINER, COARSEST = 1e-4, 1e-10  # how much finer than mu^(n + 1) layers are followed; coarser steps would pass events by
ROUNDING = 5000  # what they lose, in units of their tolerance
SAFETY = 2
EVENTS = 1000


def run(scene: Any, method: str = "jump", *, order: int = 0) -> Path:
    """Follow a ``scene`` with friction by its layers and slow motions to ``order``.

    ``"slow"`` refuses, with ``NoManifold``, what passes a jump or an edge. Raises ``OrderError``, ``NotDerivable``,
    ``OutOfRange`` where a layer does not settle, ``NotNormallyHyperbolic``, ``NoMotion``, ``TooManyEvents``.
    """
    system = scene.system
    if checked_order(method, order):
        return _to_order(scene, method, order)
    _require_derivable(system)
    automaton = Automaton(system, scene.values)
    mu = float(dict(zip(system.parameters, scene.values, strict=True))[system.small])
    layers = Layers(automaton, system.states.index(next(iter(system.fast))), mu)
    t, until, state = 0.0, float(scene.until), tuple(map(float, scene.start))
    branch, events, modes, stretches = automaton.first(scene.start), list[Event](), list[str](), list[Any]()
    while True:
        landed = layers.arrive(t, state, branch)
        if method == "slow" and (landed.events or stretches):
            raise NoManifold(f"the fast motion passes {' -> '.join(landed.modes)} at t = {t:.6g}; use method='jump'")
        events += landed.events
        modes += landed.modes
        branch = landed.branch
        stretch, span, state = _slowly(automaton, landed, t, until, mu)
        stretches.append(stretch)
        t += span
        if t >= until:
            break
        mode = automaton.mode(branch)
        guard = int(np.argmin(mode.guard_values(t, state)))
        state = mode.snapped(guard, t, state)
        branch = automaton.next(branch, (guard,), t, state)
        events.append(Event(*mode.kinds[guard][:1], t, state, mode.kinds[guard][1]))
        if len(events) > EVENTS:
            raise TooManyEvents(f"more than {EVENTS} events by t = {t:.6g}, at {system.states} = {state}")
    return Path(scene, method, state, tuple(events), tuple(modes), Dense(tuple(stretches), until))


def _to_order(scene: Any, method: str, order: int) -> Path:
    """Follow a scene to an order above 0; ``path.info["omitted"]`` is what the next order changes at ``until``."""
    if scene.system.small is None:
        raise NotDerivable(f"method {method!r} needs a slow-fast system; this one has no small parameter")
    mu = float(dict(zip(scene.system.parameters, scene.values, strict=True))[scene.system.small])
    rtol = min(tolerance(mu, order, FINER), COARSEST)
    course, next_ = matched.courses(scene, method, (order, order + 1), rtol)
    final = np.array(course.state)
    omitted = np.array(next_.state) - final
    size = SAFETY * np.abs(omitted).max()
    error = float(size / max(1.0, np.abs(final).max() - size) + ROUNDING * rtol)
    if not error < 1:
        raise OutOfRange(f"the terms that order {order} omits amount to {error:.3g} of the states: mu = {mu:.3g} is "
                         "not small here; use an exact method")  # fmt: skip
    return Path(scene, method, course.state, course.events, course.modes, Dense(course.stretches, float(scene.until)),
                error, {"omitted": tuple(omitted.tolist())})  # fmt: skip


def _slowly(automaton: Automaton, landed: Arrival, t: float, until: float, mu: float) -> tuple:
    """Return the slow motion from an arrival to ``until`` or the edge of its mode, its length, and its last state."""
    system = automaton.system
    slow, fast = branches.fields(system, landed.branch)
    mode = Mode(branches.name(landed.branch), slow, fast)
    if system.time is not None:
        mode = replace(mode, slow=sp.Dict({**slow, system.time: 1}))
    names = [*mode.slow, *mode.fast]
    given = dict(zip(system.parameters, map(float, automaton.values), strict=True))
    parameters = tuple(p for p in given if p != system.small)
    known, values = formulas(mode, system.small, parameters, 1), tuple(given[p] for p in parameters)
    at = {**dict(zip(system.states, landed.state, strict=True)), system.time: t}
    places = [names.index(s) for s in system.states]
    guards = automaton.mode(landed.branch).guard_values

    def inside(span, point):
        return guards(t + span, tuple(point[k] for k in places)) or (1.0,)

    start = np.array([at[s] for s in names])
    found = reduced.follow(known, (0,), [start], len(mode.slow), mu, values, until - t, RTOL, inside)
    span = found.end
    stretch = Stretch(t, mode.name, lambda u: found.states(u)[0][places])
    return stretch, span, tuple(stretch.states(span).tolist())


def _require_derivable(system: System) -> None:
    if system.small is None or len(system.frictions) != 1 or len(system.fast) != 1:
        raise NotDerivable("the jump of a system with friction is known for one friction and one fast state; this one "
                           f"has {len(system.frictions)} and {len(system.fast)}")  # fmt: skip
    (y,) = system.fast
    for mode in system.modes:
        for s, rate in {**mode.slow, **mode.fast}.items():
            if sp.expand(rate.diff(y)).has(y):
                raise NotDerivable(f"the rate of {s} in {mode.name} is not affine in {y}: its jump has no law here")


@dataclass(frozen=True)
class Dense:
    """The slow motions one after the other, at any times in [0, until]: an array of shape ``(n,) + t.shape``."""

    stretches: tuple[Stretch, ...]
    until: float

    def __call__(self, t: Any) -> Any:
        times = np.asarray(t, dtype=float)
        if not ((times >= 0) & (times <= self.until)).all():
            raise InputError(f"t = {t!r}: it must be within [0, {self.until}]")
        began = np.array([s.began for s in self.stretches])
        which = np.searchsorted(began, times.ravel(), side="right") - 1
        parts = [(which == k, s.states(times.ravel()[which == k] - s.began)) for k, s in enumerate(self.stretches)]
        found = np.empty((len(parts[0][1]), times.size))
        for here, states in parts:
            found[:, here] = states
        return found.reshape(-1, *times.shape)
