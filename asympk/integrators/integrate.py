"""General-purpose integrators that follow the modes of an automaton: their common interface and their runs.

Every family of integrators is one small module of ``asympk.integrators`` with one function ``advance``, which follows
one mode as the protocol ``Advance`` requires. ``run`` joins the modes by the loop of ``asympk.automaton.loop``. The
work is bounded in steps, seconds and events, and a run that does not reach the end reports why and where.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from itertools import starmap
from math import inf, isfinite
from time import monotonic
from typing import Any, NamedTuple, Protocol

import numpy as np

from asympk.automaton.consistency import decided_by
from asympk.automaton.kept import without_asymmetry
from asympk.automaton.loop import Run, Segment, follow, without_value_after
from asympk.automaton.numericmode import NumericMode
from asympk.automaton.uniqueness import is_watched
from asympk.digits import carried
from asympk.errors import AsympkError, InputError, MissingPackage, OutOfRange, TooLarge, Unfinished
from asympk.integrators.singular import followed
from asympk.numbers import number, numbers, whole
from asympk.path import Path
from asympk.scene import Scene
from asympk.systems.automata import automaton_of

# method -> module of asympk.integrators that has ``advance``
FAMILIES = {
    **dict.fromkeys(("rk45", "dop853", "radau", "bdf", "lsoda"), "scipy_ivp"),
    "heyoka": "heyoka_taylor",
    "cvode": "sundials",
    "kvaerno5": "diffrax_dirk",
}
PEERS = {  # method -> (module, package) where it needs one of the extra ``peers``
    "heyoka": ("heyoka", "heyoka"),
    "cvode": ("sksundae", "scikit-sundae"),
    "kvaerno5": ("diffrax", "diffrax"),
}
COMPILED = ("heyoka", "kvaerno5")  # whose rates are compiled as they are written, and lose digits beside 0/0
BESIDE_LIMITS, PIECES = "lsoda", 64  # the method there, and the part of a run after which it is told whether to go on
FINISHED, LEFT = "finished", "left the range of floats"
AT_REST = ("end the run before; a speed |v|, as in dry friction in a plane, -f v/|v|, may be written as "
           "sqrt(v**2 + e**2) with a small e")
ADVICE = {  # beginning of the status of a run that stops early -> advice for the user
    "step limit": "allow more steps, or take another method",
    "time limit": "allow more seconds, or take another method",
    "limit of": "allow more events",
    "left the range": "{what} is no finite real number; end the run before, or start where formulas hold",
    "stalled: rates are divided": AT_REST,
    "": "the motion grows beyond bounds, or keeps to where a rate jumps; end the run before, or take another method",
}
LEAST_MU = 1e-300
LEAST_UNTIL = 1e-140
STEPS, MOST_STEPS = 100_000, 10**12


class Work(NamedTuple):
    """The cost of a run: right-hand sides, accepted steps, Jacobians (0 where the integrator does not count them)."""

    calls: int = 0
    steps: int = 0
    jacobians: int = 0


class Settings(NamedTuple):
    """The settings for one mode: a method of the family, bounds on the error of a step, and bounds on the work.

    ``steps`` is the number of steps that the run has left, ``deadline`` the value of ``time.monotonic`` at which it
    ends. ``times`` are the times at which the states are wanted. With ``keep`` the segment holds all ``steps``. No step
    is longer than ``longest``.
    """

    method: str
    rtol: float
    atol: float | tuple[float, ...]
    steps: int
    deadline: float
    times: Sequence[float] = ()
    keep: bool = False
    longest: float = inf


class Advance(Protocol):
    """The function by which a family of integrators follows one smooth mode.

    1. It starts from ``state`` at ``t`` and ends at ``until``, or before at the first guard of ``mode`` that is lost.
    2. It keeps to the bounds of ``settings`` on the error of a step, the number of steps and the time on the clock.
       A method in ``COMPILED`` ends, too, where the mode ``is_beside_limit``.
    3. The ``Segment`` holds in ``samples`` the states at ``settings.times``, in order, and in ``work`` a ``Work``.
    4. If it stops early, the segment's ``short`` says why. It raises ``MissingPackage`` if its package is missing.
    """

    def __call__(
        self, mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings
    ) -> Segment: ...


def run(
    scene: Scene, method: str, *, rtol: float = 1e-6, atol: float | None = None, steps: int = STEPS,
    seconds: float = 60.0, events: int = 1000,
) -> Path:
    """Follow ``scene`` with a general-purpose integrator and return a ``Path``.

    ``atol`` is ``rtol`` by default; ``steps``, ``seconds`` and ``events`` bound the work. A run that does not reach
    the end raises ``Unfinished`` with the path that was followed: its ``info["status"]`` says what stopped it and
    where, and ``final`` is the state there. Raises ``InputError`` for a tolerance out of range, ``MissingPackage`` for
    a peer not installed, ``NoMotion``, ``TwoMotions``, ``Accumulation``.
    """
    rtol, atol = tolerances(rtol, atol)
    steps, seconds = bounds(steps, seconds)
    events = whole("events", events, 0, MOST_STEPS)
    return traced(scene, method, rtol=rtol, atol=atol, steps=steps, seconds=seconds, events=events)[0]


def traced(scene: Scene, method: str, keep: bool = False, **options: Any) -> tuple[Path, Run]:
    """Return the path as ``run`` does, and its ``Run``, with all steps if ``keep``; ``options`` must be complete."""
    joined = _trace(scene, method, options, keep=keep)
    sample = partial(_samples, scene, method, options)
    works = (segment.work or Work() for segment in joined.segments)
    last = joined.last._replace(work=Work(*map(sum, zip(Work(), *works, strict=True))))
    return finished(scene, method, last, joined.events, joined.modes, sample, options), joined


def _trace(scene, method, options, times=(), keep=False):
    """Return the ``Run`` of a scene, with samples at ``times``; a run with ``times`` has no limit on its seconds."""
    start, until = endpoints(scene)
    automaton = automaton_of(scene)
    deadline = float("inf") if times else monotonic() + options["seconds"]

    def on(mode, t, state, segments):
        remaining = options["steps"] - sum(s.work.steps for s in segments)
        end = mode.steps_until(t, until)
        last = end if mode.after_switch(end) >= until else until
        later = [min(max(v, t), last) for v in times[sum(len(s.samples) for s in segments) :]]
        longest = mode.longest_step(until)
        kept = keep or is_watched(mode.mode)
        rounded = method in COMPILED and mode.is_beside_limit(t, state)
        own, end = (BESIDE_LIMITS, min(end, t + until / PIECES)) if rounded else (method, end)
        advance: Advance = import_module(f"asympk.integrators.{FAMILIES[own]}").advance
        settings = Settings(own, options["rtol"], options["atol"], remaining, deadline, later, kept, longest)
        return in_range(t, state, lambda: _settled(mode, later, without_asymmetry(mode, t, state, followed(
            mode, t, state, end, lambda end: advance(mode, t, state, end, settings)))))

    with decided_by(deadline):
        return follow(automaton, automaton.first(scene.start, scene.until), start, until, on, options["events"])


def in_range(t: float, state: tuple[float, ...], segment: Callable[[], Segment]) -> Segment:
    """Return a segment from (t, state), or an empty one whose ``short`` says that rates or states are not finite."""
    try:
        found = segment()
        if found.short or all(map(isfinite, found.state)):
            return found
    except AsympkError:
        raise
    except (ArithmeticError, ValueError):
        pass
    return Segment(t, state, None, Work(), LEFT)


def _settled(mode, times, segment):
    """Return a segment whose samples, and whose end if it is no event, are on the zeros that the mode keeps."""
    samples = tuple(starmap(mode.settled, zip(times, segment.samples, strict=False)))
    state = mode.settled(segment.t, segment.state) if segment.hit is None and not segment.short else segment.state
    return segment._replace(samples=samples, state=state)


def _samples(scene, method, options, times):
    return [w for segment in _trace(scene, method, options, times).segments for w in segment.samples]


def finished(
    scene: Scene, method: str, last: Segment, events: tuple, modes: tuple, sample: Callable, options: Mapping[str, Any],
    counts: Mapping[str, int] | None = None,
) -> Path:
    """Return the path of a run that ends with ``last``, or raise ``Unfinished`` with this path if it stopped early.

    ``sample`` is as in ``SteppedDense``. ``path.info`` has the status of the run in words, the time reached, the work,
    the options used, and further ``counts``.
    """
    status = f"{last.short} at t = {last.t:.6g}" if last.short else FINISHED
    info = {"status": status, "reached": last.t, "work": last.work._asdict(), "options": options, **(counts or {})}
    at = SteppedDense(endpoints(scene)[0], last.t, sample)
    path = Path(scene, method, last.state, events, modes, at, info=info)
    if not last.short:
        return path
    advice = next(words for begin, words in ADVICE.items() if last.short.startswith(begin))
    what = (last.short == LEFT and without_value_after(automaton_of(scene), last)) or "a rate or its slope"
    raise Unfinished(f"method {method!r}: {status}; {advice.format(what=what)}", path)


@dataclass(frozen=True)
class SteppedDense:
    """The dense output of a run: ``sample(times)`` repeats the run and returns its states at ``times`` > 0."""

    start: tuple
    reached: float
    sample: Callable

    def __call__(self, t: Any) -> np.ndarray:
        """Return an array of shape ``(n,) + t.shape``; raises ``OutOfRange`` outside [0, reached]."""
        t = numbers("t", t).astype(float)
        times, where = np.unique(t, return_inverse=True)
        if times.size and not (times[0] >= 0 and times[-1] <= self.reached):
            wrong = times[-1] if times[0] >= 0 else times[0]
            raise OutOfRange(f"t = {wrong} is outside the run; ask within [0, {self.reached}]")
        later = times[times > 0].tolist()
        states = [self.start] * (len(times) - len(later)) + (list(self.sample(later)) if later else [])
        if len(states) < len(times):  # on its way to more times the run met what it had stepped over
            raise TooLarge(f"a state leaves the range of floats before t = {times[len(states)]:.6g}; end the run there")
        n = len(self.start)
        return np.array(states, dtype=float).reshape(-1, n).T[:, where.ravel()].reshape(n, *t.shape)


def endpoints(scene: Scene) -> tuple[tuple[float, ...], float]:
    """Return the start and the horizon of a scene as floats; raises ``InputError`` if mu or horizon is too small."""
    if scene.system is None and float(scene.mu) < LEAST_MU:
        raise InputError(
            f"mu = {float(scene.mu)}: integrators divide by it; give at least {LEAST_MU}, or method 'exact'"
        )
    if 0 < scene.until < LEAST_UNTIL:
        raise InputError(f"until = {carried(scene.until, 6)}: integrators square their steps; give at least "
                         f"{LEAST_UNTIL}, another unit of time, or method 'exact' with more digits")
    try:
        return tuple(float(v) for v in scene.start), float(scene.until)
    except OverflowError:
        raise TooLarge("the start is beyond the range of doubles; take a smaller one") from None


def tolerances(rtol: float, atol: float | None) -> tuple[float, float]:
    """Return (rtol, atol) as floats; raises ``InputError`` for tolerances that double precision cannot meet."""
    rtol = float(number("rtol", rtol))
    atol = rtol if atol is None else float(number("atol", atol))
    if not 1e-13 <= rtol < 1 or atol <= 0:
        raise InputError(f"rtol = {rtol:g}, atol = {atol:g}: give 1e-13 <= rtol < 1 and atol > 0")
    return rtol, atol


def bounds(steps: int, seconds: float) -> tuple[int, float]:
    """Return (steps, seconds), the bounds on the work, as an int and a float; raises ``InputError``."""
    return whole("steps", steps, 1, MOST_STEPS), float(number("seconds", seconds, lambda v: v >= 0, "zero or positive"))


def absent() -> dict[str, str]:
    """Return {method: package} of the peers that are not installed."""
    return {method: package for method, (module, package) in PEERS.items() if not find_spec(module)}


def missing(method: str) -> MissingPackage:
    """Return the error for the package of a peer that is not installed."""
    package = PEERS[method][1]
    return MissingPackage(f"method {method!r} needs {package}, which is missing: pip install '{package}'")


def lacking(method: str, peer: str, reason: Exception) -> InputError:
    """Return the error for a function of the system that a peer has not, which ``reason`` may name."""
    name = f", {found}" if (found := getattr(reason, "name", "")) else ""
    return InputError(f"method {method!r}: the system has a function that {peer} lacks{name}; use method 'exact'")
