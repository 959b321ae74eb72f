r"""The modes of a system with dry friction as numbers: phases, the guards that bound them, what comes next.

A piece of a motion ends when one of its two guards, positive inside, falls through zero. The state is then
snapped onto the surface it met, and what follows is decided by signs that are known, never by testing the
snapped quantity:

    slip      guards  sign(load) load,  sign(z) z                      force_zero, velocity_zero
    stick     guards  static |load| - drive,  static |load| + drive    slip_onset into z > 0, into z < 0

On z = 0 outside the static cone |drive| <= static |load| both one-sided z' have the sign of the drive.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from asympk.scene import in_doubles


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

    ``rhs`` returns (x', y', z'), ``jac`` its rows; ``drive`` and ``load`` are those of ``system.Friction``.
    They use arithmetic and powers only, so that numbers, JAX tracers and heyoka expressions all pass
    through.
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
    return Phase(load or _load_soon(problem, velocity, state), velocity)


def next_phase(problem, phase, hit, state):
    """Return the phase that follows ``phase`` when guard ``hit`` is lost at the snapped ``state``."""
    if phase.velocity == 0:
        return Phase(phase.load, 1 - 2 * hit)
    if hit == 0:
        return Phase(-phase.load, phase.velocity)
    return Phase(phase.load, _from_rest(problem, phase.load, state))


def _from_rest(problem, load, state):
    """Return 0 when stick holds on z = 0 (for a moment at least), else the direction in which it leaves."""
    stick = piece_of(problem, Phase(load, 0))
    inside = stick.guard_values(state)
    if min(inside) > 0 or (min(inside) == 0 and min(stick.guard_values(_soon(stick, state))) >= 0):
        return 0
    return sign(problem.drive(*state, stick.p))


def _load_soon(problem, velocity, state):
    piece = piece_of(problem, Phase(1, velocity))
    return sign(problem.load(*_soon(piece, state), piece.p)) or 1


def _soon(piece, state):
    step = 2.0**-20 / (1 + max(abs(v) for row in piece.jac(0.0, state) for v in row))
    return tuple(v + step * dv for v, dv in zip(state, piece.rhs(0.0, state), strict=True))


def snapped(piece, hit, state):
    """Return ``state`` moved onto the zero of guard ``hit``: z = 0, or else along the fast state y."""
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
    sigma, sigma0, mu = in_doubles(scene)
    mode = {
        "slip_same": (1.0, sigma + 4, mu),
        "slip_opposite": (1.0, -sigma, mu),
        "stick": (0.0, 1.0, mu),
    }
    return Problem(_rod_rhs, _rod_jac, _rod_load, _rod_drive, lambda phase: mode[phase.mode], sigma0 + 2)


def _rod_rhs(x, y, z, p):
    a, b, mu = p
    s = x + y
    return y, (a - b * s) / mu, a - (b - 1) * s


def _rod_jac(x, y, z, p):
    _, b, mu = p
    return (0.0, 1.0, 0.0), (-b / mu, -b / mu, 0.0), (1 - b, 1 - b, 0.0)


def _rod_load(x, y, z, p):
    return x + y


def _rod_drive(x, y, z, p):
    return 1 - (x + y)


def sign(value):
    """Return -1, 0 or 1."""
    return (value > 0) - (value < 0)
