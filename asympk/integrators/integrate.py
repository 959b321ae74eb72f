"""General-purpose integrators behind one automaton, that of ``asympk.automaton``.

Every family of integrators is one small module of ``asympk.integrators`` with one function
``advance(method, mode, t, state, until, rtol, atol, limits, times)``, which follows one smooth mode with
directed events; here the modes are joined. The work is bounded in steps, seconds and events, and a run
that does not reach the end says why and where.
"""

from importlib import import_module
from importlib.util import find_spec
from time import monotonic
from typing import NamedTuple

from asympk.automaton.loop import Segment, follow
from asympk.errors import AsympkError, InputError, MissingPackage, OutOfRange, TooLarge, Unfinished
from asympk.numbers import number, numbers, whole
from asympk.path import Path
from asympk.systems.automata import automaton_of

# method -> module of asympk.integrators that has ``advance``
FAMILIES = {
    "rk45": "scipy_ivp",
    "dop853": "scipy_ivp",
    "radau": "scipy_ivp",
    "bdf": "scipy_ivp",
    "lsoda": "scipy_ivp",
    "heyoka": "taylor",
    "cvode": "sundials",
    "kvaerno5": "diffrax_dirk",
}
PEERS = {  # method -> (module, package) where it needs one of the extra ``peers``
    "heyoka": ("heyoka", "heyoka"),
    "cvode": ("sksundae", "scikit-sundae"),
    "kvaerno5": ("diffrax", "diffrax"),
}
FINISHED = "finished"
LEAST_MU = 1e-300
MOST_STEPS = 10**12


class Work(NamedTuple):
    """What a run cost: right-hand sides, accepted steps, Jacobians (0 where the integrator does not tell)."""

    calls: int = 0
    steps: int = 0
    jacobians: int = 0

    def plus(self, other):
        """Return the sum of two amounts of work."""
        return Work(*(a + b for a, b in zip(self, other, strict=True)))


class Limits(NamedTuple):
    """What is left to a run: steps, and the value of ``time.monotonic`` at which it ends."""

    steps: int
    deadline: float


def run(scene, method, *, rtol=1e-6, atol=None, steps=100_000, seconds=60.0, events=1000):
    """Follow ``scene`` with a general-purpose integrator and return a ``Path``.

    ``atol`` is ``rtol`` by default; ``steps``, ``seconds`` and ``events`` bound the work. A run that does not reach
    the end raises ``Unfinished`` with the path that was followed: its ``info["status"]`` says what stopped it and
    where, and ``final`` is the state there. Raises ``InputError`` for a tolerance out of range, ``MissingPackage`` for
    a peer not installed, ``NoMotion``, ``TwoMotions``, ``Accumulation``.
    """
    start, until = endpoints(scene)
    rtol, atol = tolerances(rtol, atol)
    steps, seconds = bounds(steps, seconds)
    events = whole("events", events, 0, MOST_STEPS)
    advance = import_module(f"asympk.integrators.{FAMILIES[method]}").advance
    automaton = automaton_of(scene)
    first = automaton.first(scene.start)

    def trace(times=()):
        deadline = float("inf") if times else monotonic() + seconds

        def on(mode, t, state, segments):
            left = Limits(steps - sum(s.work.steps for s in segments), deadline)
            try:
                return advance(method, mode, t, state, until, rtol, atol, left, [v for v in times if v > t])
            except AsympkError:
                raise
            except (ArithmeticError, ValueError):
                return Segment(t, state, None, Work(), "left the range of floats")

        return follow(automaton, first, start, until, on, events)

    course = trace()
    work = total(course)
    options = {"rtol": rtol, "atol": atol, "steps": steps, "seconds": seconds, "events": events}
    info = report(course.last, work, options)
    at = dense(start, course.last.t, lambda times: [w for s in trace(times).segments for w in s.samples])
    path = Path(scene, method, course.last.state, course.events, course.modes, at, info=info)
    return finished(path)


def finished(path):
    """Return ``path``; raise ``Unfinished`` with it where it stopped short."""
    if path.info["status"] == FINISHED:
        return path
    raise Unfinished(f"method {path.model!r}: {path.info['status']}; allow more steps=, seconds= or events=, or take "
                     "another method", path)  # fmt: skip


def total(course):
    """Return the work of all segments of a course."""
    work = Work()
    for segment in course.segments:
        work = work.plus(segment.work or Work())
    return work


def dense(start, reached, sample):
    """Return the dense output ``at(t)`` of a run: ``sample(times)`` runs again, looking in at ``times`` >
    0."""
    def at(t):
        import numpy as np

        t = numbers("t", t).astype(float)
        times, where = np.unique(t, return_inverse=True)
        if times.size and not (times[0] >= 0 and times[-1] <= reached):
            wrong = times[-1] if times[0] >= 0 else times[0]
            raise OutOfRange(f"t = {wrong:g} is outside the run; ask within [0, {reached:g}]")
        later = times[times > 0].tolist()
        states = [start] * (len(times) - len(later)) + (list(sample(later)) if later else [])
        n = len(start)
        return np.array(states, dtype=float).reshape(-1, n).T[:, where.ravel()].reshape(n, *t.shape)

    return at


def report(last, work, options):
    """Return what a run tells of itself: status sentence, time reached, work, and the options used."""
    status = f"{last.short} at t = {last.t:.6g}" if last.short else FINISHED
    return {"status": status, "reached": last.t, "work": work._asdict(), "options": options}


def endpoints(scene):
    """Return the start and the horizon of a scene as floats; raises ``InputError`` where 1/mu is beyond them."""
    if scene.system is None and float(scene.mu) < LEAST_MU:
        raise InputError(
            f"mu = {float(scene.mu)}: integrators divide by it; give at least {LEAST_MU}, or method='exact'"
        )
    try:
        return tuple(float(v) for v in scene.start), float(scene.until)
    except OverflowError:
        raise TooLarge("the start is beyond the range of doubles; take a smaller one") from None


def tolerances(rtol, atol):
    """Return (rtol, atol) as floats; raises ``InputError`` where double precision cannot follow."""
    rtol = float(number("rtol", rtol))
    atol = rtol if atol is None else float(number("atol", atol))
    if not 1e-13 <= rtol < 1 or atol <= 0:
        raise InputError(f"rtol = {rtol:g}, atol = {atol:g}: give 1e-13 <= rtol < 1 and atol > 0")
    return rtol, atol


def bounds(steps, seconds):
    """Return the bounds on the work, steps as an int and seconds as a float; raises ``InputError``."""
    return whole("steps", steps, 1, MOST_STEPS), float(number("seconds", seconds, lambda v: v >= 0, "zero or positive"))


def absent():
    """Return {method: package} of the peers that are not installed."""
    return {method: package for method, (module, package) in PEERS.items() if not find_spec(module)}


def missing(method):
    """Return the error for the package of a peer that is not installed."""
    package = PEERS[method][1]
    return MissingPackage(f"method {method!r} needs {package}, which is missing: pip install '{package}'")
