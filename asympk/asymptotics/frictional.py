r"""The asymptotic models of a system with friction, or through edges: layers, jumps and slow motion in turn.

Higher orders are those of ``matched``, and so is order 0 of several frictions or fast states, or of none, and of layers
and jumps that have no law in the limit. To order 0 of one friction and one fast state the start's layer lands on the
critical manifold of a mode (``impact``), the reduced flow goes on from there until a guard of the mode vanishes, a new
layer begins at that edge, and so on. Layers take no time in this limit: what their events have in common is the time of
the layer. Errors are O(mu log(1/mu)); the path tells none of its own.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from asympk.asymptotics import matched
from asympk.asymptotics.impact import LimitLayers, NoLaw
from asympk.asymptotics.matched import MatchedPath
from asympk.asymptotics.smooth import ROUNDING, predicted_error, tolerance
from asympk.automaton.automaton import Automaton
from asympk.errors import OutOfRange
from asympk.path import Path, times_within

RTOL = 1e-9
FINER, COARSEST = 1e-2, 1e-8  # how much finer than mu^(n + 1) layers are followed
FALLING, TAKEN = 0.1, 0.22  # ratio of terms of slow motion that spares a third run, and what it is taken for then
SLIGHT = 0.01  # of the states, terms that do not change how these grow
SEVERAL = 5  # steps of a layer as wrong as they may be


def follow_stretches(scene: Any, method: str = "jump", *, order: int = 0) -> Path:
    """Follow a ``scene`` with friction, or through edges of what switches, by its layers and slow motions to ``order``.

    ``"slow"`` refuses, with ``NoManifold``, a first layer that meets an event. Raises ``NotDerivable``, ``OutOfRange``
    where a layer does not settle, ``NotNormallyHyperbolic``, ``NoMotion``, ``TooManyEvents``.
    """
    if order == 0 and len(scene.system.frictions) == len(scene.system.fast) == 1:
        with suppress(NoLaw):
            return _in_limit(scene, method)
    return _to_order(scene, method, order)


def _in_limit(scene: Any, method: str) -> Path:
    """Follow a scene with one friction and one fast state through layers that take no time; raises ``NoLaw``."""
    automaton, until, mu = Automaton(scene.system, scene.values), float(scene.until), matched.small_number(scene)
    layer = partial(_through_limit, LimitLayers(automaton, mu))
    first = matched.begun(automaton, scene.start)
    landed = layer(first) if until > 0 else first
    matched.require_landed(method, landed)
    path = matched.onward(automaton, landed, until, mu, 0, RTOL, layer)
    return Path(scene, method, path.state, path.events, path.modes, StretchedDense(path, until))


def _through_limit(layers: LimitLayers, path: MatchedPath) -> MatchedPath:
    """Return the path after its layer in the limit, where that takes no time."""
    landed = layers.arrive(path.t, path.state, path.mode)
    return replace(path, state=landed.state, mode=landed.mode, events=path.events + landed.events,
                   modes=path.modes + landed.modes[1:])  # fmt: skip


def _to_order(scene: Any, method: str, order: int) -> Path:
    """Follow a scene through whole layers, and slowly to ``order``.

    ``path.info["omitted"]`` is what the next order changes at ``until``.
    """
    automaton, until, mu = Automaton(scene.system, scene.values), float(scene.until), matched.small_number(scene)
    rtol = min(tolerance(mu, order, FINER), COARSEST)
    layer = partial(matched.through_layer, automaton, until=until, mu=mu, rtol=rtol)
    landed = layer(matched.begun(automaton, scene.start), order=order + 1)
    matched.require_landed(method, landed)
    path = matched.onward(automaton, landed, until, mu, order, rtol, partial(layer, order=order))
    end_to = partial(matched.end_to, automaton, landed, path, until, mu, rtol=rtol)
    final, beyond = np.array(path.state), end_to(orders=(order, order + 1))
    omitted, scale = beyond - final, max(1.0, np.abs(final).max())
    falls = np.abs(omitted).max() < SLIGHT * scale and matched.decay(scene, path, order) <= FALLING
    last = beyond + TAKEN * omitted if falls else end_to(orders=(order, order + 2))
    error = predicted_error((final, beyond, last), rtol=rtol) + _of_layer(path, until, mu, rtol, scale)
    if not error < 1:
        raise OutOfRange(f"the terms that order {order} omits amount to {error:.3g} of the states: mu = {mu:.3g} is "
                         "not small here; use an exact method")  # fmt: skip
    return Path(scene, method, path.state, path.events, path.modes, StretchedDense(path, until), error,
                {"omitted": tuple(omitted.tolist())})  # fmt: skip


def _of_layer(path: MatchedPath, until: float, mu: float, rtol: float, scale: float) -> float:
    """Return the error to expect in a layer that is not over, relative to ``scale``: in the fast states, and in time.

    What the fast states grow by, their errors grow by as well.
    """
    if not path.stretches or path.stretches[-1].points:
        return 0.0
    late = ROUNDING * matched.late_by(rtol, until)
    return SEVERAL * matched.off_by(rtol, mu) + late * max(map(abs, path.mode.rhs(path.t, path.state))) / scale


@dataclass(frozen=True)
class StretchedDense:
    """The stretches of a path one after the other, at any times in [0, until]: an array of shape ``(n,) + t.shape``."""

    path: MatchedPath
    until: float

    def __call__(self, t: Any) -> Any:
        times = times_within(t, self.until)
        which = np.searchsorted([s.began for s in self.path.stretches], times.ravel(), side="right") - 1
        found = np.tile(np.array(self.path.state)[:, None], times.size)
        for k, stretch in enumerate(self.path.stretches):
            found[:, which == k] = stretch.states(times.ravel()[which == k] - stretch.began)
        return found.reshape(-1, *times.shape)
