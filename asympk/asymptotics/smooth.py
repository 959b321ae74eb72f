"""The asymptotic models of a smooth slow-fast system: the slow motion from the base point, alone or with its layer.

``"slow"`` of order n is the motion on the slow manifold to order n from the base point to order n, after the layer.
``"jump"`` is the uniform composite expansion, layer + slow motion - common part,

    x = S(t) + sum mu^k (X_k - S_k)(t/mu),    y = h(S(t)) + sum mu^k (Y_k - H_k)(t/mu),    error O(mu^(n+1)),

where S is the slow motion, X_k and Y_k are the terms of the layer, and S_k and H_k those of S and h(S) at fixed t/mu.
``landing`` finds layer and base point, ``reduced`` follows S, ``layered_motion`` joins them. ``_expected`` and
``predicted_error``, the hard functions, predict the error from the terms of orders n + 1 and n + 2 and from the errors
of the integrations; near a fold, where terms do not decrease, ``_continued`` goes on by the full equations.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from asympk.asymptotics import matched, reduced
from asympk.asymptotics.fibre import Formulas
from asympk.asymptotics.landing import FINEST, OVER, Landing, abscissa, land, newton, root
from asympk.asymptotics.reduced import ROUNDING, Reduced
from asympk.automaton.modes import has_switches
from asympk.automaton.numericmode import NumericMode
from asympk.errors import OutOfRange
from asympk.numbers import listed
from asympk.path import Path, times_within

EXTRA = 2  # the number of orders beyond the one asked for, from which its error is predicted
STEADY, STALLED = 0.1, 0.5  # bounds of the ratio of successive omitted terms from which the rest of them is estimated
FALLING = 0.25  # the largest ratio of successive omitted terms at which they alone tell the error
FELL = tuple(0.5**k for k in range(10, 0, -1))  # times before ``until``, over it, at which terms may still have fallen
FADED = 2 * OVER  # the relaxation times, without what mu adds to their rate, after which a layer is rounding
UNSURE = 1.25  # what is left of a layer is estimated up to a factor 1 + O(mu), beside what its own way changes
EARLY = 1 / 8  # the share of the time of a layer after which it fades as near its end
FIRST, NEARLY = (0.0, *(2.0**k for k in range(-6, 0))), 0.1  # shares of that time at which it may be near the branch
COARSEST = 1e-7  # the largest tolerance of the integrations
FINER = 1e-5  # the tolerance of the integrations in units of mu^(n + 1)
ROUGH = 1e-6  # the tolerance of the motion that tells the branch at the given mu, and the distance between branches
WATCHED = 1e-9  # the tolerance of the motion that tells whether a switching surface is crossed


@dataclass(frozen=True)
class LayeredMotion:
    """The slow motion and its layer to the orders n, n + 1, n + 2; ``kept`` are the indices of the states returned.

    ``reduced`` is the slow motion to order n. ``beside`` has the slow motions to every order in common, longer steps:
    only their differences are used, in which the errors nearly cancel. ``sums`` sums the terms of a layer: the row of
    order m is 1, mu, ..., mu^m, 0, ..., 0. ``errors`` are those of the states at the end that the tolerance ``rtol`` of
    the integrations makes up.
    """

    landing: Landing
    reduced: Reduced
    beside: Reduced
    sums: np.ndarray
    rtol: float
    kept: tuple[int, ...]
    errors: np.ndarray

    def states(self, t: Any) -> np.ndarray:
        """Return the slow motion to order n at the array ``t`` of times: (states,) + t.shape."""
        return self.reduced.states(t)[0, self.kept]

    def states_to_each(self, t: float) -> np.ndarray:
        """Return the slow motion to every order at the time ``t``: (orders, states)."""
        beside = self.beside.states(t)[:, self.kept]
        return self.states(t) + (beside - beside[0])

    def layer(self, t: Any) -> np.ndarray:
        """Return the layer less the common part to every order at ``t``: (orders, states) + t.shape."""
        tau = np.asarray(t, dtype=float) / self.reduced.mu
        if (tau >= self.landing.end).all():
            return np.zeros((len(self.sums), len(self.kept), *tau.shape))
        terms = self.landing.corrections(tau)
        return (self.sums @ terms.reshape(len(terms), -1)).reshape(-1, *terms.shape[1:])[:, self.kept]

    def tells(self, layer: np.ndarray, units: Any) -> bool:
        """Tell whether the terms of the layer at the end, whose sums are ``layer``, tell its error.

        They do not where they do not fall after its first part, nor once it counts as over: the layer fades as the slow
        motion attracts, its terms as the start does, times powers of tau for the change.
        """
        tau, over = self.reduced.end / self.reduced.mu, self.landing.end
        if not over * EARLY <= tau < over:
            return tau < over
        return (_falls(layer * units, STALLED) and self._fell(tau, units)) or tau < self.arrives(units)

    def layer_size(self, units: Any) -> float:
        """Return the size, times ``units``, of what is left of the layer at the end, after its first part.

        The layer begins as its term 0, taken back from where it is near the branch, and the others, there or at the
        start.
        """
        landing, flow = self.landing, self.reduced
        if flow.least * flow.end > FADED * flow.mu or not landing.corrections(np.array(0.0)).any():
            return 0.0
        tau = self.arrives(units)
        first, *later = np.abs(self._terms(tau)) / self.departure_share(tau)
        sizes = (first + np.maximum(np.abs(self._terms(0.0)[1:]), later).sum(axis=0)) * units
        fast = sizes[-len(landing.branch) :]
        faded = (np.abs(self.beside.fading(flow.end)) @ fast).max() / fast.max()
        return float(UNSURE * self._eased() * sizes.max() * faded)

    def arrives(self, units: Any) -> float:
        """Return the fast time from which on term 0 of the layer is near the branch, or the end of the layer.

        Newton's step from there misses the branch by at most ``NEARLY`` of its length, in states times ``units``.
        """
        landing, known, fast = self.landing, self.reduced.formulas, len(self.landing.branch)
        x, scales = landing.base[0].tolist(), (units + np.zeros(len(self.kept)))[-fast:]
        for share in FIRST:
            off = landing.corrections(np.array(share * landing.end))[0, -fast:]
            step = newton(known, x, (landing.branch + off).tolist(), self.reduced.values)
            if step is not None and (np.abs(step - off) * scales).max() <= NEARLY * (np.abs(off) * scales).max():
                return share * landing.end
        return landing.end

    def departure_share(self, tau: float) -> float:
        """Return exp(r tau), the share of a small departure from the branch at the start that is left at ``tau``.

        r is the largest real part of an eigenvalue of g_y on the branch.
        """
        return math.exp(self.rate(self.landing.base[0]) * tau)

    def rate(self, base: np.ndarray) -> float:
        """Return the largest real part of an eigenvalue of g_y on the branch at ``base``, or infinity without one.

        Without one are base points that the layer moves to where g_y has no value, as sqrt(x) has none for x < 0.
        """
        with suppress(ArithmeticError, ValueError):
            found = abscissa(self.reduced.formulas, base.tolist(), self.landing.branch, self.reduced.values)
            return found if math.isfinite(found) else math.inf
        return math.inf

    def _eased(self) -> float:
        """Return exp(|r(x_0) - r(S)| / |r(x_0)|), by which a layer fades less than beside the slow motion from S.

        It goes from x_0 to the slow motion within a relaxation time, and the branch attracts at the rates r.
        """
        first, last = self.rate(self.landing.base[0]), self.rate(self.sums[-1] @ self.landing.base)
        return math.exp(min(1.0, abs((last - first) / first)))

    def _terms(self, tau: float) -> np.ndarray:
        """Return the terms of the layer at ``tau`` times powers of mu: (orders from 0 on, states)."""
        return self.sums[-1][:, None] * self.landing.corrections(np.array(tau))[:, self.kept]

    def _fell(self, tau: float, units: Any) -> bool:
        """Tell whether the terms of the layer at ``tau`` fall from the first: a single one may be small by chance.

        Where the attraction changes they are as z^k/k!, and the last is at most ``STALLED`` times the one before where
        z <= ``STALLED`` (n + 2).
        """
        sizes = np.abs(self._terms(tau) * units).max(axis=1)
        count = np.arange(1, len(sizes))
        return bool((count * sizes[1:] <= STALLED * len(count) * np.maximum.accumulate(sizes)[:-1]).all())

    def misses(self) -> np.ndarray:
        """Return composite - start of the fast states at t = 0, for every order: (orders, fast states)."""
        flows, known = self.beside, self.beside.formulas
        begun = [known.height(order)(*start, flows.mu, *flows.values)
                 for (order, _), start in zip(flows.kinds, flows.parts(flows.trajectory.start), strict=True)]
        return np.array(begun) - self.sums @ self.landing.rest


def follow_smooth(scene: Any, method: str = "jump", *, order: int = 1, units: Any = 1.0) -> Path:
    """Follow the ``scene`` of a smooth slow-fast system by ``"jump"`` or ``"slow"`` to ``order``.

    The motion must cross no switching surface (``crosses_switch``). ``path.info["omitted"]`` is the first term
    that the composite omits at ``until``, state by state. The error is that of the states times ``units``. Raises
    ``InputError`` for functions that have no series, ``OutOfRange`` where the layer settles on no attracting branch or
    on another one than in the limit, the expansion does not hold or a pole of the rates is passed, and
    ``NotNormallyHyperbolic`` where the slow manifold is lost before ``until``.
    """
    task = matched.Task.of(scene, order + EXTRA, ROUGH)
    mu, until, begun = task.mu, task.until, matched.begun(task.automaton, scene.start)
    slowly = matched.slow_of(begun.mode)
    begin = slowly.point(0.0, begun.state)
    follow = partial(layered_motion, slowly.formulas, order, begin, mu, slowly.values, until, slowly.places)
    layered = method == "jump"
    motion, slow, layer, error = _followed(follow, tolerance(mu, order), layered, until, units)
    matched.require_no_pole(begun, slowly.along(motion.reduced))
    followed = _required_layer(task, begun, slowly, motion, units)
    composites = slow + layer
    if not _falls(composites) and (known := _continued(task, begun, slowly, motion, error)):
        error = min(error, _expected(motion, layered, known[0], slow, layer, units, *known[1:])[0])
    now, next_, _ = composites
    final = now if layered else slow[0]
    if followed is not None and followed.t == until:
        error = _at_least(error, final, followed.state, units)
    if error >= 1 > _expected(motion, True, until, slow, layer, units)[0]:
        raise OutOfRange(f"at t = {until:.6g} the motion is still in its layer, which method 'slow' leaves out: take "
                         "method 'jump', or a later until")
    if not error < 1 and (motion.errors * units).max() > 1 / 2:
        raise OutOfRange(growth_message(motion.rtol, until))
    if not error < 1:
        raise OutOfRange(f"the terms that order {order} omits amount to {error:.3g} of the states at t = {until:.6g}: "
                         f"{scene.system.small} = {mu:.3g} is not small here; use an exact method")
    return Path(scene, method, tuple(final.tolist()), (), begun.modes, LayeredDense(motion, layered, until, begun.mode),
                error, {"omitted": tuple((next_ - now).tolist())})


def _followed(
    follow: Callable, rtol: float, layered: bool, until: float, units: Any
) -> tuple[LayeredMotion, np.ndarray, np.ndarray, float]:
    """Return a motion, its slow part and its layer at ``until``, and its predicted error.

    The tolerance makes up less than half of the error, or is ``FINEST``: as a multiple of a power of mu it depends on
    the unit of mu.
    """
    while True:
        motion = follow(rtol)
        slow, layer = motion.states_to_each(until), motion.layer(until)
        error, rounding = _expected(motion, layered, until, slow, layer, units)
        if not (error < 2 * rounding and rtol > FINEST):
            return motion, slow, layer, error
        rtol = finer(rtol, error, rounding)


def finer(rtol: float, error: float, rounding: float) -> float:
    """Return a tolerance at which the part ``rounding`` of an error, made up by ``rtol``, is small beside the rest."""
    return max(FINEST, rtol * FINER * ROUNDING * (error / rounding - 1))


def growth_message(rtol: float, t: float) -> str:
    """Return the words for a motion to the tolerance ``rtol`` whose errors have grown too large by ``t``."""
    return (f"errors of {rtol:.0e} grow as large as the states by t = {t:.6g}: the slow motion keeps to a repelling "
            "set for long, or is chaotic; take a smaller until, or an exact method with digits")


def _continued(
    task: matched.Task, begun: matched.MatchedPath, slowly: matched.Slow, motion: LayeredMotion, error: float
) -> tuple[float, np.ndarray, float] | None:
    """Return a time at which terms still fell, the composites of orders n + 1 and n + 2 from there, and a ratio.

    The composites are those at ``until``. The ratio is that of the second omitted term to the first at this time, in
    the state in which it is largest, if that falls less than ``FALLING``: in the others the second may just pass
    through 0, as before terms grow. Near a fold the fast motion is hardly faster than the slow one, so that these are
    soon integrated. At a single time terms may fall by chance, so they must also fall twice as long before ``until``.
    None is returned where they do at none of the times ``FELL``, or these are not near, or the integrations make up the
    error.
    """
    if error < 2 * ROUNDING * motion.rtol:
        return None
    finely = replace(task, rtol=min(ROUGH, error * FINER))
    times = [(1 - share) * task.until for share in (*FELL, 1.0)]
    looks = ((t, motion.states_to_each(t) + motion.layer(t)) for t in times)
    for (t, composites), (_, earlier) in pairwise(looks):
        if _falls(composites) and _falls(earlier):
            ends = [matched.to_the_end(finely, slowly, replace(begun, t=t, state=tuple(state)))
                    for state in composites[1:].tolist()]
            first, second = np.abs(np.diff(composites, axis=0))
            ratio = np.max(second[first > 0] / first[first > 0], initial=STEADY)
            return None if None in ends else (t, np.array(ends), ratio if ratio > FALLING else STEADY)
    return None


def _falls(motions: np.ndarray, most: float = FALLING) -> bool:
    """Tell whether the second omitted term is at most ``most`` times the first, so that both tell the rest."""
    first, second = _terms(motions)
    return second <= most * first


def _at_least(error: float, final: np.ndarray, state: tuple, units: Any) -> float:
    """Return the predicted error of a motion to ``final``, or how far it is from ``state`` if that tells more.

    The full equations lead to ``state``, with the tolerance ``ROUGH``.
    """
    off, size = (np.abs(values * units).max() for values in (final - state, np.array(state)))
    known, least = float(off / max(1.0, size)), ROUNDING * ROUGH * np.max(units)
    return known + least if known - least > error else error


def _required_layer(
    task: matched.Task, begun: matched.MatchedPath, slowly: matched.Slow, motion: LayeredMotion, units: Any
) -> matched.MatchedPath | None:
    """Return the path by the full equations to the end of the layer, or None where it need not or cannot be followed.

    Raises ``OutOfRange`` where the layer at the given mu grows beyond bounds or leads to another branch than in the
    limit mu -> 0. This happens to a start within O(mu) of the edge between two basins, and the terms of the expansion
    need not tell. Where there is one branch, it must attract at every base point once terms of the layer do not tell
    the error: the terms omitted are those of its slow motions.
    """
    known, values = slowly.formulas, slowly.values
    if known.affine:  # then there is one branch
        _require_attraction(motion, units)
        return None
    try:
        path = matched.through_layer(task, begun)
    except matched.Unsettled:  # the full equations need too many steps
        return None
    (x, true), (_, limit) = (slowly.point(path.t, at) for at in (path.state, motion.states(path.t).tolist()))
    reached, expected = (root(known, x, near, values) for near in (true, limit))
    least = ROUGH * max([1.0, *map(abs, expected or ())])
    if path.t < task.until and reached and expected and math.dist(reached, expected) > least:
        fast = known.mode.fast
        raise OutOfRange(f"the layer leads to {listed(fast, reached)} at t = {path.t:.6g}, and in the limit to "
                         f"{listed(fast, expected)}: {task.automaton.system.small} = {task.mu:.3g} is not small "
                         "so near the edge of a basin; use an exact method")
    return path


def _require_attraction(motion: LayeredMotion, units: Any) -> None:
    """Raise ``OutOfRange`` where a base point is where the only branch does not attract, after the layer."""
    known, landing = motion.reduced.formulas, motion.landing
    for base in motion.sums @ landing.base if known.turning else ():
        if motion.rate(base) >= 0 and not motion.tells(motion.layer(motion.reduced.end), units):
            raise OutOfRange(f"the layer moves {listed(known.slow_states, landing.base[0])} to about "
                             f"{listed(known.slow_states, base)}, where the branch does not attract: "
                             f"{known.small} = {motion.reduced.mu:.3g} is not small here; use an exact method")


def crosses_switch(scene: Any, order: int) -> bool:
    """Tell whether the motion of a smooth system crosses a switching surface; slow motion is to ``order`` + 2."""
    if not has_switches(scene.system):
        return False
    task = matched.Task.of(scene, order + EXTRA, WATCHED)
    path = matched.begun(task.automaton, scene.start)
    begun = path.mode
    if not begun.kinds:
        return False
    path = matched.through_layer(task, path)
    while path.mode is begun and path.t < task.until:
        path = matched.slowly(task, path)
    return any(mode is not begun for mode in (path.mode, *(stretch.mode for stretch in path.stretches)))


def layered_motion(
    known: Formulas, order: int, begin: tuple[tuple, tuple], mu: float, values: tuple, until: float,
    kept: tuple[int, ...], rtol: float,
) -> LayeredMotion:
    """Return the ``LayeredMotion`` from ``begin`` = (x, y) to ``order`` and the ``EXTRA`` orders beyond it."""
    landing = land(known, order + EXTRA, *begin, values, rtol, mu)
    orders, powers = tuple(range(order, order + EXTRA + 1)), [mu**k for k in range(order + EXTRA + 1)]
    sums = np.array([[power if k <= m else 0.0 for k, power in enumerate(powers)] for m in orders])
    bases = (sums @ landing.base).tolist()
    starts = [reduced.branch_at(known, base, landing.branch, values, begin[0]) for base in bases]
    motion = reduced.follow_reduced_flow(known, order, starts[0], mu, values, until, rtol)
    span = max((step.span for step in motion.trajectory.steps), default=None)
    beside = reduced.side_by_side(known, orders, starts, mu, values, until, rtol, span=span, alone=motion)
    errors = motion.errors(rtol) + _passed_on(landing, motion, sums[-1])
    return LayeredMotion(landing, motion, beside, sums, rtol, kept, errors[list(kept)])


def _passed_on(landing: Landing, motion: Reduced, powers: np.ndarray) -> np.ndarray:
    """Return the errors at the end of the slow motion that those of its layer make; ``powers`` are those of mu."""
    if landing.errors is None:
        return np.zeros(len(motion.formulas.states))
    made = powers @ landing.errors(tau := motion.end / motion.mu)
    off = np.abs(motion.grown.kept) @ made[: motion.grown.kept.shape[1]]
    return motion.spread(off) + (made if tau < landing.end else 0.0)


def _expected(motion, layered, t, slow, layer, units, ends=None, least=STEADY):
    """Return the predicted error and the part of it that the tolerance of the integrations makes up.

    ``t`` is ``until``, or the time from which ``ends``, the composites of orders n + 1 and n + 2, are continued; there
    successive terms had the ratio ``least``, or less.
    """
    # a layer as slow as the slow motion may cancel its terms in the composite but not their remainder, so that terms
    # of the slow motion that do not decrease are judged on their own, too
    misses, scales = motion.misses(), units + np.zeros(len(motion.kept))
    fast = slice(len(scales) - misses.shape[1], None)
    _, recalled = motion.reduced.remembered(t, [order for order, _ in motion.beside.kinds[ends is not None : -1]])
    decisive, taken = motion.tells(layer, units), np.abs(layer[0] * units).max()
    layer_size = (0.0 if decisive else motion.layer_size(units)) + (taken if layered is not decisive else 0.0)
    if not decisive:  # terms may be small by chance, or far larger than what is left
        layer = np.zeros_like(layer)
    slow, layer, misses = slow * units, layer * units, misses * scales[fast]
    judged = [slow + layer] if _falls(slow, STALLED) else [slow + layer, slow]
    if ends is not None:
        judged = [np.vstack([judged[0][:1], ends * units])]
    grown = (motion.errors * scales).max()
    rounding = max(ROUNDING * motion.rtol * scales.max(), float(grown / max(1.0, np.abs(slow[0] + layer[0]).max())))
    lately = _terms(judged[0])[0] + float((recalled * scales[fast]).max(axis=1).sum())
    kept = motion.departure_share(t / motion.reduced.mu)
    return max(predicted_error(terms, layer_size, rounding, misses, lately, least, kept) for terms in judged), rounding


def tolerance(mu: float, order: int, finer: float = FINER) -> float:
    """Return the tolerance of the integrations of a model whose error is O(mu^(order + 1))."""
    return min(max(finer * mu ** (order + 1), FINEST), COARSEST)


def predicted_error(
    composites: np.ndarray, layer_size: float = 0.0, rounding: float = 0.0, misses: np.ndarray | None = None,
    lately: float = 0.0, least: float = STEADY, kept: float = 0.0,
) -> float:
    """Return the predicted error of the first of three composites, relative to the largest of 1 and the true states.

    The composites are of successive orders. ``layer_size`` is the size of the layer where the first leaves it out,
    ``rounding`` the relative error of the integrations, ``misses`` the difference of each composite from the start, if
    known, and ``lately`` what the error remembers of terms omitted until then: those at the end may be small by chance,
    as where what drives the fast states comes to rest smoothly. The misses cover terms that do not decrease.
    ``least`` is a bound from below of the ratio of successive omitted terms from which the rest is estimated, and
    ``kept`` one of the share of the misses that is left.
    """
    first, second = _terms(composites)
    ratio = min(STALLED, max(least, second / first)) if first > 0 else STALLED
    error = max(lately, (first + 2 * second / (1 - ratio)) / (1 - ratio)) + layer_size
    if misses is not None:
        error += _beyond(max(first, second), misses, kept)
    scale = max(1.0, np.abs(composites[0]).max() - error)  # of the true states, which the error leaves uncertain
    return float(error / scale + rounding)


def _terms(motions: np.ndarray) -> list[float]:
    """Return the largest modulus of each difference between motions of successive orders."""
    return np.maximum.reduce(np.abs(motions[1:] - motions[:-1]), axis=1).tolist()


def _beyond(omitted: float, misses: np.ndarray, kept: float) -> float:
    """Return the estimated error of the last composite, whose error at the start is ``misses[-1]``.

    This error is assumed to decay half as fast as the omitted terms, whose size was that of the differences of
    ``misses`` at the start and is ``omitted`` now, but no faster than the share ``kept``, as attraction alone would.
    """
    begun = max(_terms(misses))
    faded = math.sqrt(min(1.0, omitted / begun) if begun > 0 else 1.0)
    return max(faded, kept) * np.abs(misses[-1]).max()


@dataclass(frozen=True)
class LayeredDense:
    """The motion to the order asked for at any times in [0, until]: an array of shape ``(states,) + t.shape``."""

    motion: LayeredMotion
    layered: bool
    until: float
    mode: NumericMode

    def __call__(self, t: Any) -> Any:
        times = times_within(t, self.until)
        slow = self.motion.states(times)
        return slow + self.motion.layer(times)[0] if self.layered else slow

    def sizes(self, t: np.ndarray, slow: bool) -> np.ndarray:
        """Return the largest modulus of every state in the slow motion, or in the layer, at the times ``t``."""
        return np.abs(self.motion.states(t) if slow else self.motion.layer(t)[0]).max(axis=1)

    def places(self, times: np.ndarray, slow: bool) -> list:
        """Return (mode, time, state) of the slow motion at ``times``; no layer, as mu scales no tolerance of it."""
        states = self.motion.states(times).T.tolist() if slow else []
        return [(self.mode, t, tuple(state)) for t, state in zip(times.tolist(), states, strict=False)]
