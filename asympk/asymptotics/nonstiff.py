r"""The explicit method of Dormand and Prince of order 8, as straight-line code for a few states.

Layers in their fast time and flows on slow manifolds are short, smooth and as a rule not stiff. With two to ten states
the arithmetic of a step costs less than one call of an array library. ``_compiled``, the hard function, therefore
writes the stages out as Python code, once for each number of states and parameters, and ``steps`` controls the step
length. Steps, dense output and the error estimate of each state are those of DOP853 (Hairer, Nørsett and Wanner,
Solving Ordinary Differential Equations I, section II.10). Where implicit steps are far longer, ``steps`` continues
with those of ``stiff``.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from operator import attrgetter
from typing import Any, ClassVar

import numpy as np
from scipy.integrate import DOP853

from asympk.asymptotics.stiff import IMPLICIT, Slopes, StiffStep, stiff_steps, succeeds
from asympk.automaton.numericmode import on_hermite

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0
EXPONENT = -1 / 8
STAGES = 12
PATIENCE = 100  # the number of steps between tests of whether an implicit step is the cheaper way
LONG = 100  # for 0.01 in the estimate of the first step: order 8 has a far smaller error constant than low orders
Flow = Callable[..., tuple]
_END = attrgetter("after")


@dataclass(frozen=True)
class ExplicitStep:
    """One accepted step of ``flows`` from (t, state) over ``span`` to ``end`` at ``after``, with its stages.

    Its error is below ``atol``, one number per state, plus ``rtol`` times the state.
    """

    flows: tuple[Flow, ...]
    parameters: tuple
    t: float
    span: float
    after: float
    state: tuple
    end: tuple
    stages: tuple = field(repr=False)
    rtol: float
    atol: tuple
    cost: ClassVar[int] = 1

    def state_at(self, t: float) -> tuple:
        """Return the state at a time ``t`` within the step, to the accuracy of a step."""
        if t in (self.t, self.after):
            return self.state if t == self.t else self.end
        return _step_of(self.flows, self.parameters, len(self.state))(
            t - self.t, self.state, self.stages[0], self.rtol, self.atol, 0.0)[0]

    def __call__(self, t: Any) -> np.ndarray:
        """Return the states at the array ``t`` of times within the step, to the accuracy of a step."""
        return Trajectory(self.state, self._halves)(t) if self._halves else self._interpolated(t)

    @cached_property
    def _halves(self) -> tuple["ExplicitStep", ...]:
        """The halves of a step that is too long to be interpolated to its accuracy, as the last of a layer, or ()."""
        take, half = _step_of(self.flows, self.parameters, len(self.state)), self.span / 2
        middle, first, *_ = take(half, self.state, self.stages[0], self.rtol, self.atol, 0.0)
        found = self._interpolated(t := self.t + half).tolist()
        allowed = [a + self.rtol * abs(w) for a, w in zip(self.atol, middle, strict=True)]
        if not any(abs(v - w) > a for v, w, a in zip(found, middle, allowed, strict=True)):
            return ()
        _, last, *_ = take(half, middle, first[-1], self.rtol, self.atol, 0.0)
        return (replace(self, span=half, after=t, end=middle, stages=first),
                replace(self, t=t, span=self.after - t, state=middle, stages=last))

    def _interpolated(self, t: Any) -> np.ndarray:
        """Return the states at the array ``t`` of times within the step: (states,) + t.shape."""
        share = (np.asarray(t, dtype=float) - self.t) / self.span if self.span else np.zeros_like(t, dtype=float)
        shape = (-1, *[1] * share.ndim)
        found = np.zeros((len(self.state), *share.shape))
        for i, part in enumerate(reversed(self._parts)):
            found = (found + part.reshape(shape)) * (share if i % 2 == 0 else 1 - share)
        return found + np.array(self.state).reshape(shape)

    @cached_property
    def _parts(self) -> np.ndarray:
        stages = [*self.stages]
        for row in DOP853.A_EXTRA:
            moved = np.array(self.state) + self.span * (row[: len(stages)] @ np.array(stages))
            stages.append(rates(self.flows, self.parameters, tuple(moved.tolist())))
        slopes, moved = np.array(stages), np.array(self.end) - np.array(self.state)
        first, last = slopes[0], slopes[STAGES]
        known = [moved, self.span * first - moved, 2 * moved - self.span * (first + last)]
        return np.concatenate([known, self.span * (DOP853.D @ slopes)])


Step = ExplicitStep | StiffStep


@dataclass(frozen=True)
class Trajectory:
    """Consecutive steps as a function of the time, constant after the last step; ``start`` if there are no steps."""

    start: tuple
    steps: tuple[Step, ...]

    def __call__(self, t: Any) -> np.ndarray:
        """Return the states at the array ``t`` of times: (states,) + t.shape."""
        t = np.asarray(t, dtype=float)
        if not self.steps:
            return np.array(self.start).reshape(-1, *[1] * t.ndim) + 0 * t
        if t.size == 1:
            return np.array(self.state_at(t.item())).reshape(-1, *t.shape)
        ends = np.array([step.after for step in self.steps])
        which = np.minimum(np.searchsorted(ends, t.ravel()), len(ends) - 1)
        found = np.empty((len(self.start), t.size))
        for k in set(which.tolist()):
            found[:, which == k] = self.steps[k](np.minimum(t.ravel()[which == k], ends[k]))
        return found.reshape(len(self.start), *t.shape)

    def state_at(self, t: float) -> tuple:
        """Return the state at a time ``t``."""
        return self._step_at(t).state_at(self._within(t)) if self.steps else self.start

    def near(self, t: float) -> tuple:
        """Return the state at a time ``t`` within the steps by a cubic through both ends, soon but less accurate."""
        if not self.steps:
            return self.start
        step = self._step_at(t)
        return on_cubic(step, (t - step.t) / (step.after - step.t))

    def _step_at(self, t):
        steps = self.steps
        return steps[-1] if t > steps[-1].t else steps[bisect_left(steps, t, key=_END)]

    def _within(self, t):
        first, last = self.steps[0].t, self.steps[-1].after
        return first if t < first else last if t > last else t


def on_cubic(step: Step, share: float) -> tuple:
    """Return the state at a share of a step, by the cubic through both ends of the step."""
    return on_hermite(share, step.after - step.t, (step.state, step.end), (step.stages[0], step.stages[-1]))


def rates(flows: tuple[Flow, ...], parameters: tuple, state: tuple) -> tuple:
    """Return the rates of all flows; each flow takes an equal share of the states, in order."""
    size = len(state) // len(flows)
    return tuple(v for i, flow in enumerate(flows) for v in flow(*state[i * size : (i + 1) * size], *parameters))


def steps(
    flows: tuple[Flow, ...], parameters: tuple, state: tuple, until: float, rtol: float, atol: tuple, t: float = 0.0,
    late: float = 0.0, longest: float = math.inf, within: float = math.inf, slopes: Slopes | None = None,
    span: float | None = None,
) -> Iterator[Step]:
    """Yield the steps of state' = flow(*state, *parameters) from ``t`` to ``until``, which may be infinite.

    Each of ``flows`` takes an equal share of the states, in order. The error of a step is held below ``atol``, one
    number per state, plus ``rtol`` times the state, apart from an error along the flow of up to ``late`` in time. The
    first step tried is ``span``, or an estimate of at most ``longest``, and every step is at most ``within``. The
    iterator ends early where steps become too small or infinite, or the rates NaN. ``slopes`` returns the Jacobian
    matrix at a state; with it the steps become implicit where one of these is as long as ``IMPLICIT`` explicit ones.
    """
    take, first = _step_of(flows, parameters, len(state), late > 0), rates(flows, parameters, state)
    span = span or _first_span(flows, parameters, state, first, min(longest, until - t), rtol, atol)
    flow, grow, count, marked = partial(rates, flows, parameters), GROW, 0, t
    while t < until:
        if count == PATIENCE:
            longer = IMPLICIT * (t - marked) / PATIENCE
            if slopes and longer <= within and succeeds(flow, slopes, state, longer, rtol, atol):
                yield from stiff_steps(flow, slopes, state, t, until, rtol, atol, span, within)
                return
            count, marked = 0, t
        span = min(span, until - t, within)
        if not span < math.inf or (span <= 16 * math.ulp(t) and until - t > span):
            return
        error, new, stages = _tried(take, span, state, first, rtol, atol, late)
        factor = max(SHRINK, SAFETY * error**EXPONENT) if error > 0 else GROW
        if error < 1:
            after = until if span == until - t else t + span
            yield ExplicitStep(flows, parameters, t, span, after, state, new, stages, rtol, atol)
            t, state, first, span = after, new, stages[-1], span * min(grow, factor)
            grow, count = GROW, count + 1
        else:
            span, grow = span * min(factor, SAFETY), 1.0


def _tried(take, span, state, first, rtol, atol, late):
    """Return the error of a step in units of the allowed error, the end of the step, and its stages."""
    try:
        share, power = math.frexp(span)  # by the power of 2 no rates overflow, and none is rounded
        new, stages, square = take(span, state, first, rtol, atol, late, math.ldexp(1.0, power))
        error = share * math.sqrt(square / len(state))
    except (ArithmeticError, ValueError):
        return math.inf, state, ()
    return (error if math.isfinite(error) else math.inf), new, stages


def _first_span(flows, parameters, state, first, longest, rtol, atol):
    """Return a first step by Hairer, Nørsett and Wanner, section II.4, with ``LONG`` for the constant 0.01."""
    scale = [a + rtol * abs(w) for a, w in zip(atol, state, strict=True)]
    size, speed = (math.hypot(*(c / s for c, s in zip(v, scale, strict=True))) for v in (state, first))
    span = 0.01 * size / speed if min(size, speed) > 1e-5 else 1e-6
    span = min(span, longest)
    moved = tuple(w + span * r for w, r in zip(state, first, strict=True))
    try:
        next_ = rates(flows, parameters, moved)
    except (ArithmeticError, ValueError):
        return span
    bend = math.hypot(*((b - a) / s for a, b, s in zip(first, next_, scale, strict=True))) / (span or 1)
    largest = max(speed, bend) / math.sqrt(len(state))
    bent = (LONG / largest) ** -EXPONENT if 1e-15 < largest < math.inf else max(1e-6, span * 1e-3)
    return min(100 * span, longest, bent)


def _step_of(flows: tuple[Flow, ...], parameters: tuple, size: int, timeless: bool = False) -> Callable[..., tuple]:
    """Return ``take(h, w, k0, rtol, atol, late, q)``, one step of ``flows`` with ``size`` states in all.

    ``take`` returns the end, the stages, and the sum of squares of the error estimates of the states, times q/h, in
    units of the allowed errors. With ``timeless`` the estimates leave out the part of the error along the flow that an
    error in time of up to ``late`` explains.
    """
    return partial(_compiled(size, len(flows), len(parameters), timeless), flows, parameters)


@lru_cache(maxsize=128)
def _compiled(size: int, count: int, given: int, timeless: bool) -> Callable[..., tuple]:
    """Compile a step of ``count`` flows, each of an equal share of ``size`` states and all ``given`` parameters."""
    every, parameters, space = range(size), _names("p", range(given)), dict[str, Any]()
    lines = [f"    {_names('f', range(count))} = flows", f"    [{parameters}] = p", f"    {_names('w', every)} = w",
             f"    {_names('k0_', every)} = k0"]
    for stage, row in enumerate([*DOP853.A[1:STAGES], DOP853.B], 1):
        lines += [f"    v{i} = w{i} + h*({_sum(row, i)})" for i in every]
        for flow in range(count):
            share = range(flow * size // count, (flow + 1) * size // count)
            lines.append(f"    {_names(f'k{stage}_', share)} = f{flow}({_names('v', share)}{parameters})")
    lines += _error_lines(size, timeless)
    stages = ", ".join(f"({_names(f'k{stage}_', every)})" for stage in range(STAGES + 1))
    text = ["def take(flows, p, h, w, k0, rtol, atol, late, q=1.0):", *lines,
            f"    return ({_names('v', every)}), ({stages}), square"]
    exec("\n".join(text), space)
    return space["take"]


def _error_lines(size: int, timeless: bool) -> list[str]:
    """Return the lines that compute the error estimate of a step.

    The estimate of each state combines those of order 5 and 3 of that state: a state with a large estimate of order 3,
    as a polynomial in time has, must not hide the error of another.
    """
    every, lines, parts = range(size), list[str](), [*map(str, range(size)), *["u"] * timeless]
    for i in every:
        lines += [f"    a, b = abs(w{i}), abs(v{i})", f"    s{i} = atol[{i}] + rtol*(a if a > b else b)"]
    if timeless:
        lines += [f"    u{i} = late*k0_{i}/s{i}" for i in every]
        lines += [f"    speed = {_dot('u', 'u', every)}", "    part = 1/speed if speed > 1 else 0.0"]
    for name, row in (("e", DOP853.E5), ("d", DOP853.E3)):
        lines += [f"    {name}{i} = q*({_sum(row, i)})/s{i}" for i in every]
        if timeless:
            lines.append(f"    {name}u = part*({_dot(name, 'u', every)})")
            lines += [f"    {name}{i} -= {name}u*u{i}" for i in every]
    lines.append("    square = 0.0")
    for part in parts:
        lines += [f"    a = e{part}*e{part}", f"    if a: square += a*a/(a + 0.01*d{part}*d{part})"]
    return lines


def _dot(a: str, b: str, indices: Iterable[int]) -> str:
    return " + ".join(f"{a}{i}*{b}{i}" for i in indices)


def _names(letter: str, indices: Iterable[int]) -> str:
    return "".join(f"{letter}{i}, " for i in indices)


def _sum(row, i):
    return " + ".join(f"{float(c)!r}*k{stage}_{i}" for stage, c in enumerate(row) if c)
