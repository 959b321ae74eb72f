r"""Moreau-Jean time stepping: implicit Euler steps with the friction impulse h F as an unknown of every step.

    x+ = x + h y+,    mu (y+ - y) = h (1 - 2 s+ + F),    z+ - z = h (1 - s+ + F),    |F| <= (sigma + 2) |s+|,

where F opposes z+ and has its largest size if z+ is not 0. A step has up to three solutions (slip_same, slip_opposite,
stick) or none. For h (1 + h) > mu / sigma the determinant of slip_opposite, mu - h (1 + h) sigma, is negative, and the
steps have the paradox of the rigid rod again (Lemma 9).
"""

from functools import partial
from time import monotonic

import numpy as np

from asympk.automaton.loop import Segment
from asympk.errors import InputError
from asympk.integrators.integrate import Work, bounds, endpoints, finished
from asympk.numbers import number, sign_of
from asympk.path import Event, Path
from asympk.scene import Scene, in_doubles
from asympk.symbolic.branches import Phase
from asympk.systems.automata import automaton_of
from asympk.systems.painleve_klein.modes import coefficients

COUNTED = {0: "steps without solution", 2: "steps with two solutions", 3: "steps with three solutions"}


def run(
    scene: Scene, method: str = "moreau", *, rtol: float = 1e-3, atol: float | None = None, step: float | None = None,
    prefer: str = "present", steps: int = 100_000, seconds: float = 60.0,
) -> Path:
    """Follow ``scene`` with steps h = ``step`` (by default ``rtol``: the scheme is of first order).

    If a step has several solutions, ``prefer="present"`` chooses the present mode and ``prefer="stick"`` chooses stick.
    ``path.info`` counts the steps with no, two and three solutions.
    """
    h = float(number("step", rtol if step is None else step))
    steps, seconds = bounds(steps, seconds)
    if h <= 0 or prefer not in ("present", "stick"):
        raise InputError(f"step = {h:g}, prefer = {prefer!r:.40}: give step > 0 and prefer 'present' or 'stick'")
    start, until = endpoints(scene)
    deadline = monotonic() + seconds
    times, states, phases, counts, short = _march(scene, start, until, h, prefer, steps, deadline)
    changes = [k for k in range(1, len(phases)) if phases[k] != phases[k - 1]]
    marks = tuple(Event(_kind(phases[k - 1], phases[k]), times[k], states[k]) for k in changes)
    modes = (phases[0].mode, *(phases[k].mode for k in changes))
    last = Segment(times[-1], states[-1], None, Work(0, len(times) - 1, 0), short)
    options = {"step": h, "prefer": prefer, "steps": steps, "seconds": seconds}
    return finished(scene, method, last, marks, modes, partial(_between, times, states), options, counts)


def _march(scene, start, until, h, prefer, steps, deadline):
    friction = in_doubles(scene.sigma, scene.sigma0, scene.mu)
    times, states, phases = [0.0], [start], [automaton_of(scene).first(scene.start)[0]]
    counts, short = dict.fromkeys(COUNTED.values(), 0), ""
    while times[-1] < until:
        if len(times) > steps or monotonic() > deadline:
            short = f"{'step' if len(times) > steps else 'time'} limit reached"
            break
        t = min(until, h * len(times))
        found = _solutions(*friction, *states[-1], t - times[-1])
        if len(found) != 1:
            counts[COUNTED[len(found)]] += 1
        if not found:
            short = "no discrete solution"
            break
        wanted = "stick" if prefer == "stick" else phases[-1].mode
        phase, state = next((f for f in found if f[0].mode == wanted), found[0])
        times.append(t)
        states.append(state)
        phases.append(phase)
    return times, states, phases, counts, short


def _solutions(sigma, sigma0, mu, x, y, z, h):
    """Return every (phase, state) that solves the step."""
    found = []
    for name, product in (("slip_same", 1), ("slip_opposite", -1)):
        _, b = coefficients(name, sigma)
        determinant = mu + h * (1 + h) * b
        if determinant == 0:
            continue
        new_y = (mu * y + h * (1 - b * x)) / determinant
        s = x + (1 + h) * new_y
        new_z = z + h * (1 - (b - 1) * s)
        if sign_of(s) * sign_of(new_z) == product:
            found.append((Phase(sign_of(s), sign_of(new_z)), (x + h * new_y, new_y, new_z)))
    new_y = (mu * y - z - h * x) / (mu + h * (1 + h))
    s = x + (1 + h) * new_y
    if abs(z + h * (1 - s)) <= (sigma0 + 2) * h * abs(s):
        found.append((Phase(sign_of(s), 0), (x + h * new_y, new_y, 0.0)))
    return found


def _kind(before, after):
    if before.velocity == 0:
        return "slip_onset"
    return "velocity_zero" if after.velocity != before.velocity else "force_zero"


def _between(times, states, ts):
    return np.column_stack([np.interp(ts, times, column) for column in zip(*states, strict=True)])
