r"""General-purpose integrators behind one mode logic.

The motion is cut into pieces on which the field is smooth. A piece ends when one of its two guards, positive
inside, falls through zero (directed events); the state is then snapped onto the surface it met, and what follows is
decided by signs that are known, never by testing the snapped quantity again:

    slip      guards  sign(load) load,  sign(z) z                      force_zero, velocity_zero
    stick     guards  static |load| - drive,  static |load| + drive    slip_onset into z > 0, into z < 0

Every family of integrators is one small module of ``asympk.integrators`` with one function ``advance``, which follows
one piece. The work is bounded in steps, seconds and events; a run that does not reach the end says why and where.
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from time import monotonic
from typing import Any, NamedTuple

from asympk.errors import InputError, OutOfRange, UnknownName
from asympk.path import Event, Path

# method -> module of asympk.integrators that has ``advance(method, piece, t, state, until, rtol, atol, limits, times)``
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
FINISHED = "finished"


class Phase(NamedTuple):
    """The signs of the load and of the velocity; velocity 0 is stick."""

    load: int
    velocity: int

    @property
    def mode(self):
        """Return the name of the mode in which these signs hold."""
        return ("slip_opposite", "stick", "slip_same")[1 + self.load * self.velocity]


@dataclass(frozen=True)
class Problem:
    """A system with dry friction as plain functions of ``(x, y, z, p)``, where ``p = parameters(phase)``.

    ``rhs`` returns (x', y', z'), ``jac`` its rows, ``drive`` and ``load`` are those of ``asympk.system.Friction``.
    They use arithmetic and powers only, so that numbers, JAX tracers and heyoka expressions all pass through them.
    """

    rhs: Callable
    jac: Callable
    load: Callable
    drive: Callable
    parameters: Callable
    static: float


@dataclass(frozen=True)
class Piece:
    """One smooth piece of a motion: the numbers of its phase, and the guards that bound it.

    A row (i, j, k) of ``guards`` stands for i load + j drive + k z, positive inside the piece.
    """

    problem: Problem
    phase: Phase
    p: tuple
    guards: tuple
    kinds: tuple

    def rhs(self, t, state):
        """Return the time derivatives at a sequence of three numbers."""
        x, y, z = state
        return self.problem.rhs(x, y, z, self.p)

    def jac(self, t, state):
        """Return the rows of the Jacobian at a sequence of three numbers."""
        x, y, z = state
        return self.problem.jac(x, y, z, self.p)

    def guard_values(self, state):
        """Return the values of the two guards."""
        x, y, z = state
        load, drive = self.problem.load(x, y, z, self.p), self.problem.drive(x, y, z, self.p)
        return tuple(i * load + j * drive + k * z for i, j, k in self.guards)


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
    """How far a piece was followed: the guard lost (or None), and why it stopped short ("" when it did not)."""

    t: float
    state: tuple
    hit: int | None
    work: Work
    short: str = ""
    samples: tuple = ()


def run(scene, method, *, rtol=1e-6, atol=None, steps=100_000, seconds=60.0, events=1000):
    """Follow ``scene`` with a general-purpose integrator and return a ``Path``.

    ``path.info["status"]`` is "finished" or says what stopped the run and where; ``final`` is then the state there.
    Raises ``InputError`` for a tolerance or a scene that is not a number, ``MissingPackage`` for a peer that is not
    installed.
    """
    start, until = tuple(number(v, "start") for v in scene.start), number(scene.until, "until")
    path = follow(rod(scene), start, until, method, rtol=rtol, atol=atol, steps=steps, seconds=seconds, events=events)
    return Path(scene, method, *path)


def follow(problem, start, until, method, *, rtol=1e-6, atol=None, steps=100_000, seconds=60.0, events=1000):
    """Follow ``problem`` from ``start``; return (final, events, modes, at, error, info), the fields of a ``Path``."""
    if method not in FAMILIES:
        raise UnknownName(f"integrator {method!r} is unknown; choose one of {', '.join(FAMILIES)}")
    rtol, atol = tolerances(rtol, atol)
    advance = import_module(f"asympk.integrators.{FAMILIES[method]}").advance
    options = {"rtol": rtol, "atol": atol, "steps": steps, "seconds": seconds, "events": events}

    def trace(times=()):
        limits = Limits(steps, float("inf") if times else monotonic() + seconds)
        return _trace(problem, start, until, events, limits, times,
                      lambda piece, t, w, left, ts: advance(method, piece, t, w, until, rtol, atol, left, ts))

    end, marks, modes, status, work, _ = trace()
    info = {"status": status, "reached": end.t, "work": work._asdict(), "options": options}
    return end.state, marks, modes, dense(start, end.t, lambda times: trace(times)[-1]), None, info


def _trace(problem, start, until, most, limits, times, advance):
    t, state, phase = 0.0, start, first_phase(problem, start)
    marks, modes, samples, work = [], [phase.mode], [], Work()
    while True:
        piece = piece_of(problem, phase)
        left = Limits(limits.steps - work.steps, limits.deadline)
        leg = advance(piece, t, state, left, [v for v in times if v > t])
        work, t, state = work.plus(leg.work), leg.t, leg.state
        samples.extend(leg.samples)
        if leg.short or leg.hit is None or (times and len(samples) == len(times)):
            break
        state = snapped(piece, leg.hit, state)
        phase = next_phase(problem, phase, leg.hit, state)
        marks.append(Event(piece.kinds[leg.hit], t, *state))
        modes.append(phase.mode)
        if len(marks) > most:
            leg = leg._replace(short=f"event limit of {most} reached")
            break
    status = f"{leg.short} at t = {t:.6g}" if leg.short else FINISHED
    return leg._replace(state=state), tuple(marks), tuple(modes), status, work, samples


def dense(start, reached, sample):
    """Return the dense output ``at(t)`` of a run: ``sample(times)`` runs it again and looks in at ``times`` > 0."""
    def at(t):
        import numpy as np

        t = np.asarray(t, dtype=float)
        times, where = np.unique(t, return_inverse=True)
        if times.size and (times[0] < 0 or times[-1] > reached):
            raise OutOfRange(f"t = {times[0 if times[0] < 0 else -1]:g} is outside the run, [0, {reached:g}]")
        later = times[times > 0].tolist()
        states = [start] * (len(times) - len(later)) + (list(sample(later)) if later else [])
        return np.array(states, dtype=float).reshape(-1, 3).T[:, where.ravel()].reshape(3, *t.shape)

    return at


def piece_of(problem, phase):
    """Return the smooth piece on which ``phase`` holds."""
    load, velocity = phase
    if velocity:
        guards, kinds = ((load, 0, 0), (0, 0, velocity)), ("force_zero", "velocity_zero")
    else:
        cone = problem.static * load
        guards, kinds = ((cone, -1, 0), (cone, 1, 0)), ("slip_onset", "slip_onset")
    return Piece(problem, phase, problem.parameters(phase), guards, kinds)


def first_phase(problem, state):
    """Return the phase at ``state``; ties are broken by where a short step of the field leads."""
    x, y, z = state
    load = sign(problem.load(x, y, z, problem.parameters(Phase(1, 1))))
    velocity = sign(z) or _from_rest(problem, load, state)
    return Phase(load or _sign_soon(problem, velocity, state), velocity)


def next_phase(problem, phase, hit, state):
    """Return the phase that follows ``phase`` when guard ``hit`` is lost at the snapped ``state``."""
    if phase.velocity == 0:
        return Phase(phase.load, 1 - 2 * hit)
    if hit == 0:
        return Phase(-phase.load, phase.velocity)
    return Phase(phase.load, _from_rest(problem, phase.load, state))


def _from_rest(problem, load, state):
    """Return 0 when stick holds on z = 0 (for the moment at least), else the direction in which it leaves."""
    stick = piece_of(problem, Phase(load, 0))
    inside = stick.guard_values(state)
    if min(inside) > 0 or (min(inside) == 0 and min(stick.guard_values(_soon(stick, state))) >= 0):
        return 0
    return sign(problem.drive(*state, stick.p))


def _sign_soon(problem, velocity, state):
    piece = piece_of(problem, Phase(1, velocity))
    return sign(problem.load(*_soon(piece, state), piece.p)) or 1


def _soon(piece, state):
    step = 2.0**-20 / (1 + max(abs(v) for row in piece.jac(0.0, state) for v in row))
    return tuple(v + step * dv for v, dv in zip(state, piece.rhs(0.0, state), strict=True))


def snapped(piece, hit, state):
    """Return ``state`` moved onto the zero of guard ``hit``: z = 0 for the velocity, else along the fast state y."""
    x, y, z = state
    if piece.kinds[hit] == "velocity_zero":
        return (x, y, 0.0)
    at = piece.guard_values(state)[hit]
    for _ in range(2):
        near = y + (1 + abs(y)) * 2.0**-10
        slope = (piece.guard_values((x, near, z))[hit] - at) / (near - y)
        y -= at / slope
        at = piece.guard_values((x, y, z))[hit]
    return (x, y, z if piece.phase.velocity else 0.0)


def rod(scene):
    """Return the Painlevé-Klein rod (2.7)-(2.9) of a scene: mu y' = a - b s, z' = a - (b - 1) s."""
    sigma, sigma0, mu = (number(getattr(scene, k), k) for k in ("sigma", "sigma0", "mu"))
    coefficients = {"slip_same": (1.0, sigma + 4), "slip_opposite": (1.0, -sigma), "stick": (0.0, 1.0)}
    return Problem(_rod_rhs, _rod_jac, _rod_load, _rod_drive, lambda phase: (*coefficients[phase.mode], mu), sigma0 + 2)


def _rod_rhs(x, y, z, p):
    a, b, mu = p
    s = x + y
    return y, (a - b * s) / mu, a - (b - 1) * s


def _rod_jac(x, y, z, p):
    a, b, mu = p
    return (0.0, 1.0, 0.0), (-b / mu, -b / mu, 0.0), (1 - b, 1 - b, 0.0)


def _rod_load(x, y, z, p):
    return x + y


def _rod_drive(x, y, z, p):
    return 1 - (x + y)


def sign(value):
    """Return -1, 0 or 1."""
    return (value > 0) - (value < 0)


def number(value, name):
    """Return ``value`` as a finite float; a string or a Fraction is read exactly first."""
    try:
        found = float(Fraction(value) if isinstance(value, str) else value)
    except (TypeError, ValueError, ZeroDivisionError):
        found = None
    if found is None or found - found != 0:
        raise InputError(f"{name} = {value!r} is not a finite number; give an int, float, Fraction, str or mpf")
    return found


def tolerances(rtol, atol):
    """Return (rtol, atol) as floats, atol being rtol by default; raises ``InputError`` where floats cannot follow."""
    rtol = number(rtol, "rtol")
    atol = rtol if atol is None else number(atol, "atol")
    if not 1e-13 <= rtol < 1 or atol <= 0:
        raise InputError(f"rtol = {rtol:g}, atol = {atol:g}: give 1e-13 <= rtol < 1 and atol > 0")
    return rtol, atol


def missing(package, method) -> Any:
    """Return the error for an optional package that is not installed."""
    from asympk.errors import MissingPackage

    return MissingPackage(f"method {method!r} needs the package {package}; install it with: pip install '{package}'")
