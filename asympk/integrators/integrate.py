"""General-purpose integrators behind one mode logic, that of ``asympk.integrators.piecewise``.

Every family of integrators is one small module of ``asympk.integrators`` with one function
``advance(method, piece, t, state, until, rtol, atol, limits, times)``, which follows one smooth piece with
directed events; here the pieces are joined. The work is bounded in steps, seconds and events, and a run
that does not reach the end says why and where.
"""

from importlib import import_module
from importlib.util import find_spec
from time import monotonic
from typing import NamedTuple

from asympk.errors import InputError, MissingPackage, OutOfRange, UnknownName
from asympk.integrators.piecewise import first_phase, next_phase, piece_of, rod, snapped
from asympk.numbers import number, numbers, whole
from asympk.path import Event, Path

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


class Leg(NamedTuple):
    """How far a piece was followed: the guard lost or None, and why it stopped short, "" if it did not."""

    t: float
    state: tuple
    hit: int | None
    work: Work
    short: str = ""
    samples: tuple = ()


def run(scene, method, *, rtol=1e-6, atol=None, steps=100_000, seconds=60.0, events=1000):
    """Follow ``scene`` with a general-purpose integrator and return a ``Path``; the options are those of ``follow``.

    ``path.info["status"]`` is "finished", or says what stopped the run and where; ``final`` is then the
    state there. Raises ``InputError`` for a tolerance out of range, ``MissingPackage`` for a peer not installed.
    """
    start, until = endpoints(scene)
    options = {"rtol": rtol, "atol": atol, "steps": steps, "seconds": seconds, "events": events}
    return Path(scene, method, **follow(rod(scene), start, until, method, **options))


def follow(problem, start, until, method, *, rtol=1e-6, atol=None, steps=100_000, seconds=60.0, events=1000):
    """Follow ``problem`` from ``start`` and return the fields of a ``Path``, all but scene and model.

    ``atol`` is ``rtol`` by default; ``steps``, ``seconds`` and ``events`` bound the work.
    """
    if method not in FAMILIES:
        raise UnknownName(f"integrator {method!r} is unknown; choose one of {', '.join(FAMILIES)}")
    rtol, atol = tolerances(rtol, atol)
    steps, seconds = bounds(steps, seconds)
    events = whole("events", events, 0, MOST_STEPS)
    advance = import_module(f"asympk.integrators.{FAMILIES[method]}").advance

    def trace(times=()):
        limits = Limits(steps, float("inf") if times else monotonic() + seconds)
        return _trace(problem, start, until, events, limits, times,
                      lambda piece, t, w, *rest: advance(method, piece, t, w, until, rtol, atol, *rest))

    leg, marks, modes, work, _ = trace()
    options = {"rtol": rtol, "atol": atol, "steps": steps, "seconds": seconds, "events": events}
    info = report(leg, work, options)
    at = dense(start, leg.t, lambda times: trace(times)[-1])
    return {"final": leg.state, "events": marks, "modes": modes, "at": at, "info": info}


def _trace(problem, start, until, most, limits, times, advance):
    t, state, phase = 0.0, start, first_phase(problem, start)
    marks, modes, samples, work = [], [phase.mode], [], Work()
    while True:
        piece = piece_of(problem, phase)
        left = limits._replace(steps=limits.steps - work.steps)
        ahead = [v for v in times if v > t]
        leg = advance(piece, t, state, left, ahead) if t < until else Leg(t, state, None, Work())
        work, t, state = work.plus(leg.work), leg.t, leg.state
        samples.extend(leg.samples)
        if leg.short or leg.hit is None or (times and len(samples) == len(times)):
            break
        state = snapped(piece, leg.hit, state)
        phase = next_phase(problem, phase, leg.hit, state)
        marks.append(Event(piece.kinds[leg.hit], t, *state))
        modes.append(phase.mode)
        if len(marks) > most:
            leg = leg._replace(short=f"limit of {most} events reached", state=state)
            break
    return leg, tuple(marks), tuple(modes), work, samples


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
        return np.array(states, dtype=float).reshape(-1, 3).T[:, where.ravel()].reshape(3, *t.shape)

    return at


def report(leg, work, options):
    """Return what a run tells of itself: status sentence, time reached, work, and the options used."""
    status = f"{leg.short} at t = {leg.t:.6g}" if leg.short else FINISHED
    return {"status": status, "reached": leg.t, "work": work._asdict(), "options": options}


def endpoints(scene):
    """Return the start and the horizon of a scene as floats; raises ``InputError`` where 1/mu is beyond them."""
    mu = float(scene.mu)
    if mu < LEAST_MU:
        raise InputError(f"mu = {mu}: integrators divide by it; give at least {LEAST_MU}, or method='exact'")
    return tuple(float(v) for v in scene.start), float(scene.until)


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
