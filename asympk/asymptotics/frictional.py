r"""The asymptotic models of a system with friction or switching surfaces: layers, jumps and slow motion in turn.

``follow_stretches`` chooses between two models. ``_to_order`` follows whole layers and slow motion to order n, as
``matched`` describes, and predicts the error. ``_in_limit`` is the limit mu -> 0 of order 0, for one friction and one
fast state: the layer from the start lands on the critical manifold of a mode (``impact``), the reduced flow continues
until a guard of the mode vanishes, the next layer begins there, and so on. Layers take no time in this limit, so all
events of a layer have the same time. Outside the layers the errors are O(mu log(1/mu)); the path does not predict them.
Order 0 uses ``_to_order`` where a layer or a jump has no law in the limit (``NoLaw``) or is no faster than slow motion,
as near critical friction, and where the limit does not hold: mu may be too large for it alone.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import expm

from asympk.asymptotics import matched
from asympk.asymptotics.impact import LimitLayers, NoLaw
from asympk.asymptotics.landing import FINEST, abscissa
from asympk.asymptotics.matched import MatchedPath, Stretch, Task
from asympk.asymptotics.reduced import FORGOTTEN, LOST, ROUNDING
from asympk.asymptotics.smooth import finer, growth_message, predicted_error, tolerance
from asympk.errors import AsympkError, NotNormallyHyperbolic, OutOfRange
from asympk.path import Path, times_within

RTOL = 1e-9  # the tolerance of the reduced flow in the limit
FINER, COARSEST = 1e-2, 1e-8  # the tolerance in units of mu^(n + 1), and the largest tolerance
FALLING, TAKEN = 0.1, 0.22  # if omitted terms have at most the first ratio, the second stands for it and spares a run
SLIGHT = 0.01  # the largest omitted term, relative to the states, for which the run to order n + 2 may be spared
SEVERAL = 5  # the error at the end of a layer, in units of the error allowed in one step
FEW = 6  # the number of layers, one for each mode, up to which errors pass from one to the next as they are
COARSER, SAFE = 10, 4  # the ratio of tolerances that tells how errors grow, and the margin of the error

Remembered = tuple[Stretch, np.ndarray, np.ndarray]


def follow_stretches(scene: Any, method: str = "jump", *, order: int = 0, units: Any = 1.0) -> Path:
    """Follow a ``scene`` with friction, or through switching surfaces, by layers and slow motion to ``order``.

    The error is that of the states times ``units``. In the limit, as its layers take no time, an ``until`` within a
    layer gives the state after it, and no error. Raises ``NoManifold`` for ``"slow"`` if the first layer meets an
    event, ``OutOfRange`` where a layer does not settle or the omitted terms are not small, ``NotNormallyHyperbolic``
    where a slow manifold is lost, ``NotDerivable``, ``NoMotion`` and ``TooManyEvents``.
    """
    if order == 0 and len(scene.system.frictions) == len(scene.system.fast) == 1:
        with suppress(NoLaw, NotNormallyHyperbolic, OutOfRange):
            return _in_limit(scene, method)
    return _to_order(scene, method, order, units)


def _in_limit(scene: Any, method: str) -> Path:
    """Follow a scene with one friction and one fast state through layers that take no time; raises ``NoLaw``."""
    task = Task.of(scene, 0, RTOL)
    layers, first = LimitLayers(task.automaton, task.mu), matched.begun(task.automaton, scene.start)
    landed = layers.arrive(first) if task.until > 0 else first
    matched.require_landed(method, landed)
    path = matched.onward(task, landed, lambda _, path: layers.arrive(path), limit=True)
    return Path(scene, method, path.state, path.events, path.modes, StretchedDense(path, task.until))


def _to_order(scene: Any, method: str, order: int, units: Any) -> Path:
    """Follow a scene by whole layers, and by slow motion to ``order``.

    ``path.info["omitted"]`` is the change of the states at ``until`` by the next order.
    """
    task = Task.of(scene, order, COARSEST)
    begun, rtol = matched.begun(task.automaton, scene.start), min(tolerance(task.mu, order, FINER), COARSEST)
    while True:
        path, rest, rounding, late, omitted = _followed(replace(task, rtol=rtol), begun, method, units)
        error, least = rest + late, max(rest, ROUNDING * COARSEST * np.max(units))
        grown = ROUNDING * rtol * np.max(units) < rounding > error / 2
        if not (grown or late > COARSER * least) or rtol <= FINEST:
            break
        rtol = finer(rtol, error, rounding) if grown else max(FINEST, rtol * least / (2 * late))
    if not error < 1:
        raise OutOfRange(growth_message(rtol, path.t) if rounding > 1 / 2 else
                         f"the terms that order {order} omits amount to {error:.3g} of the states: "
                         f"mu = {task.mu:.3g} is not small here; use an exact method")
    return Path(scene, method, path.state, path.events, path.modes, StretchedDense(path, task.until), error,
                {"omitted": tuple(omitted.tolist())})


def _followed(
    task: Task, begun: MatchedPath, method: str, units: Any
) -> tuple[MatchedPath, float, float, float, np.ndarray]:
    """Return a path, its predicted error without that of its last layers, and the part that the tolerance makes up.

    After these come the error of its last layers, and the first omitted terms.
    """
    order, rtol, landed = task.order, task.rtol, _landed(task, begun)
    matched.require_landed(method, landed)
    path = matched.onward(task, landed)
    next_ = matched.followed_to(order + 1, task, landed, path)
    final, beyond = np.array(path.state), np.array(next_.state)
    omitted, scale = beyond - final, max(1.0, np.abs(final * units).max())
    apart = order > 0 or len(path.stretches) == len(landed.stretches) + 1  # orders 0 and 1 meet guards by the same y
    falls = apart and np.abs(omitted * units).max() < SLIGHT * scale and matched.decay(task, path) <= FALLING
    last = beyond + TAKEN * omitted if falls else matched.followed_to(order + 2, task, landed, path).state
    passed = _passed_on(task, begun, next_, units)
    rounding = max(np.max(units) * max(ROUNDING * rtol, _grown(path, rtol) / scale), passed / scale)
    recent = tuple(_until_forgotten(path, task.mu))
    error = predicted_error(np.array((final, beyond, last)) * units, rounding=rounding,
                            lately=_omitted_lately(recent, order, _of_fast(path, units)))
    return path, error, rounding, _of_layers(task, path, recent, scale, units), omitted


def _landed(task: Task, begun: MatchedPath) -> MatchedPath:
    """Return the path through the layers before its first slow motion, to one order more than that."""
    return matched.through_layer(replace(task, order=task.order + 1), begun)


def _grown(path: MatchedPath, rtol: float) -> float:
    """Return the errors at the end of a path whose slow motions are to ``rtol``, as if layers passed them on.

    They are 0 where errors never grow to more than ``ROUNDING`` times those of a step.
    """
    squares, found, lost, most = np.zeros((len(path.state) + 1,) * 2), 0.0, 0.0, 1.0  # of the states and the time
    for stretch in path.stretches:
        if (slowly := stretch.slowly) is None:
            continue
        sources, kept = matched.slow_of(stretch.mode).sources, slowly.grown.kept
        at = np.ix_(*[sources[: kept.shape[1]]] * 2)
        with np.errstate(all="ignore"):
            reached = kept @ squares[at] @ kept.T + np.diag(slowly.made(rtol) ** 2)
            squares[at] = reached[: kept.shape[1], : kept.shape[1]]
        off, sizes = np.sqrt(np.diag(reached)), rtol * slowly.grown.sizes
        most = max(most, slowly.grown.most, *(off[sizes > 0] / sizes[sizes > 0]))
        found = float(slowly.spread(off).max(initial=0.0))
        lost = max(lost, found * (found > LOST))
    return max(found, lost) if most > ROUNDING else 0.0


def _passed_on(task: Task, begun: MatchedPath, path: MatchedPath, units: Any) -> float:
    """Return the error at the end of a path of many layers, each of which may let the errors before it grow.

    So does a layer that is remembered at the end, if slow motion has led to it at a time with an error, or will soon.
    The ``path`` is that to the next order. The motion to a tolerance ``COARSER`` times as large has errors as many
    times as large; to the ``FINEST`` tolerance rounding counts, which does not fall with it. If that motion fails, the
    error is that of the states as a whole. The error is 0 for ``FEW`` layers that are forgotten, unless one begins too
    near a repelling manifold for its tolerance.
    """
    first = next((stretch.began for stretch in path.stretches if stretch.slowly), path.t)
    layers = [stretch for stretch in path.stretches if stretch.slowly is None]
    lately = layers and layers[-1].began > first and any(
        stretch is layers[-1] for stretch, *_ in _until_forgotten(path, task.mu))
    soon = ROUNDING * task.rtol * max(1.0, path.t)
    values = path.mode.guard_values(*path.mode.moved_on(path.t, path.state, soon))
    nears = path.t > first and min(values, default=0.0) < 0
    blown = any(matched.growing(task, stretch.mode, stretch.began, tuple(stretch.states(0.0).tolist())) * task.rtol
                < FINEST for stretch in layers)
    if not (nears or lately or blown) and len(layers) <= FEW:
        return 0.0
    later = replace(task, until=task.until + soon) if nears else task
    try:
        now = _whole(later, begun) if nears else path
        again = _whole(replace(later, rtol=COARSER * task.rtol, least=COARSER * FINEST), begun)
    except AsympkError:
        return float(np.abs(np.array(path.state) * units).max() + 1)
    falls = COARSER if task.rtol > FINEST and not blown else 2
    return float(SAFE * np.abs((np.array(again.state) - now.state) * units).max() / (falls - 1))


def _whole(task: Task, begun: MatchedPath) -> MatchedPath:
    """Return the motion to the next order."""
    return matched.onward(replace(task, order=task.order + 1, whole=True), _landed(task, begun))


def _until_forgotten(path: MatchedPath, mu: float) -> Iterator[Remembered]:
    """Yield the stretches of a path from the last one on, as far as the fast states at the end of the path remember.

    With each comes what is left at the end of the path of errors of the fast states at the end of the stretch, and of
    those at its start.
    """
    until, kept = path.t, np.eye(len(path.mode.mode.system.fast))
    for stretch in reversed(path.stretches):
        if np.abs(kept).max() <= FORGOTTEN:
            break
        after, kept, until = kept, kept @ _remembered(stretch, until, mu), stretch.began
        yield stretch, after, kept


def _omitted_lately(recent: tuple[Remembered, ...], order: int, scales: np.ndarray) -> float:
    """Return the terms that ``order`` omits in slow motions before the end of a path, as far as they are remembered.

    ``scales`` are the units of the fast states.
    """
    found = np.zeros_like(scales)
    for stretch, after, _ in recent:
        if stretch.slowly is not None:
            now, since = stretch.slowly.remembered(stretch.slowly.end, (order,))
            found += np.abs(after) @ (now + since)[0]
    return float((found * scales).max())


def _of_fast(path: MatchedPath, units: Any) -> np.ndarray:
    """Return the units of the fast states."""
    system = path.mode.mode.system
    return (units + np.zeros(len(path.state)))[[system.states.index(state) for state in system.fast]]


def _remembered(stretch: Stretch, until: float, mu: float) -> np.ndarray:
    """Return what is left at ``until`` of errors of the fast states at the start of a stretch, as they decay there."""
    slow, span = matched.slow_of(stretch.mode), until - stretch.began
    x, y = slow.point(until, tuple(stretch.states(span).tolist()))
    if not abscissa(slow.formulas, x, y, slow.values) < 0:
        return np.eye(len(y))
    entries = np.array(slow.formulas.jacobian(*x, *y, *slow.values))
    return expm(entries.reshape(len(y), len(y)) * (span / mu))


def _of_layers(task: Task, path: MatchedPath, recent: tuple[Remembered, ...], scale: float, units: Any) -> float:
    """Return the predicted error at the end of a path by its last layers, relative to ``scale``.

    Slow motion begins with the error allowed in the fast states, which counts as far as it is remembered. A layer that
    is not over has this error, too, and one in time: times the largest rate, it covers errors that grow with the fast
    states.
    """
    if not path.stretches:
        return 0.0
    scales, late = _of_fast(path, units), 0.0
    left = np.zeros_like(scales)
    for stretch, _, kept in recent:
        left += np.abs(kept).sum(axis=1) if stretch.slowly else 0.0
    if not path.stretches[-1].slowly:
        left += 1.0
        late = ROUNDING * task.time_error * np.abs(np.array(path.mode.rhs(path.t, path.state)) * units).max()
    return float(SEVERAL * task.fast_error * (left * scales).max() + late / scale)


@dataclass(frozen=True)
class StretchedDense:
    """The stretches of a path one after the other, at any times in [0, until]: an array of shape ``(n,) + t.shape``."""

    path: MatchedPath
    until: float

    def __call__(self, t: Any) -> Any:
        times = times_within(t, self.until)
        which = self._which(times.ravel())
        found = np.tile(np.array(self.path.state)[:, None], times.size)
        for k, stretch in enumerate(self.path.stretches):
            found[:, which == k] = stretch.states(times.ravel()[which == k] - stretch.began)
        return found.reshape(len(found), *times.shape)

    def _which(self, times: np.ndarray) -> np.ndarray:
        return np.searchsorted([s.began for s in self.path.stretches], times, side="right") - 1

    def sizes(self, t: np.ndarray, slow: bool) -> np.ndarray:
        """Return the largest modulus of every state in slow motions, or in layers, at ``t`` and where they begin."""
        times = np.array([*t, *(s.began for s in self.path.stretches)])
        alike = [k for k, stretch in enumerate(self.path.stretches) if bool(stretch.slowly) is slow]
        return np.abs(self(times[np.isin(self._which(times), alike)])).max(axis=1, initial=0)

    def places(self, times: np.ndarray, slow: bool) -> list:
        """Return (mode, time, state) in slow motions, or in layers, at ``times`` and where they begin."""
        stretches, which = self.path.stretches, self._which(times)
        known = [(s, s.began) for s in stretches]
        known += [(stretches[k], t) for k, t in zip(which, times, strict=True) if k >= 0]
        alike = ((s, t) for s, t in known if bool(s.slowly) is slow)
        return [(s.mode, float(t), tuple(s.states(float(t - s.began)).tolist())) for s, t in alike]
