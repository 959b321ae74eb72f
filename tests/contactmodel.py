"""An elastic, damped contact followed from Newton's law alone: numbers in, numbers out, none of the package's formulas.

M(q) q'' = Q + W_N R + W_T F is solved for q'' at every step, R = k (d + h d') of the penetration d, friction by one
field for each of slip and stick; an explicit Runge-Kutta method of order 8 finds where one ends.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp


@dataclass(frozen=True)
class Model:
    """Numbers of a mechanism: ``terms(q, u)`` returns M, Q, W (2 x n), the rates W' q' (2), the gap and the load."""

    terms: Any
    friction: float
    stiffness: float
    damping: float
    unilateral: bool = False

    def reaction(self, q, u):
        _, _, W, _, gap, _ = self.terms(q, u)
        found = -self.stiffness * (gap + self.damping * W[0] @ u)
        return max(found, 0.0) if self.unilateral else found

    def accelerations(self, q, u, mode):
        """Return q'' and the friction force; ``mode`` is the direction of slip, or 0 for stick."""
        M, Q, W, turning, _, load = self.terms(q, u)
        R = self.reaction(q, u)
        free, push = np.linalg.solve(M, Q + W[0] * R), np.linalg.solve(M, W[1])
        held = -(W[1] @ free + turning[1]) / (W[1] @ push)
        F = -mode * self.friction * load * abs(R) if mode else held
        return free + push * F, F

    def excess(self, q, u):
        """Return by how much the friction force of stick stays below its bound."""
        load = self.terms(q, u)[5]
        return self.friction * load * abs(self.reaction(q, u)) - abs(self.accelerations(q, u, 0)[1])

    def slip(self, q, u):
        return self.terms(q, u)[2][1] @ u


def follow(model, q, u, until, ends=None):
    """Follow the model to ``until``, or to where ``ends(q, u)`` falls through 0; return t, q and u there."""
    n, t, state = len(q), 0.0, np.concatenate([q, u])
    mode = np.sign(model.slip(q, u))
    for _ in range(60):
        def field(_, s, mode=mode):
            return np.concatenate([s[n:], model.accelerations(s[:n], s[n:], mode)[0]])

        events = _events(model, mode, n, ends)
        found = solve_ivp(field, (t, until), state, method="DOP853", rtol=1e-9, atol=1e-11, events=events)
        t, state = found.t[-1], found.y[:, -1]
        if found.status == 0 or (ends and len(found.t_events[1])):
            return t, state[:n], state[n:]
        mode = _next(model, mode, state[:n], state[n:])
    raise AssertionError("too many changes between slip and stick")


def _events(model, mode, n, ends):
    def change(_, s):
        return mode * model.slip(s[:n], s[n:]) if mode else model.excess(s[:n], s[n:])

    def stop(_, s):
        return ends(s[:n], s[n:])

    found = [change, stop] if ends else [change]
    for event in found:
        event.terminal, event.direction = True, -1
    return found


def _next(model, mode, q, u):
    if mode and model.excess(q, u) > 0:
        return 0
    if mode:
        return -mode
    return -np.sign(model.accelerations(q, u, 0)[1])
