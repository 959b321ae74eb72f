r"""The asymptotic models of the Painlevé-Klein system as paths: rigid, slow motion alone, and slow motion with layers.

All three use the composite expansion of ``composite``, which gives the slow and the fast part of the motion in each
mode to order n in mu. ``"jump"`` is their sum, which holds uniformly in t. ``"slow"`` is the slow part alone, which
starts at the projection of the start along the fast fibre and holds outside the layers. ``"rigid"`` is the limit mu = 0
of ``"slow"``. The rigid system has no fast motion, and where the rod is steep it may have no motion or two.

A path carries the error that the first omitted terms predict. ``OutOfRange`` is raised where the expansion does not
hold (``validity``). ``run`` is the entry.
"""

import math
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from asympk.asymptotics import composite
from asympk.asymptotics.compiledlayers import coefficient, model
from asympk.asymptotics.itinerary import LoadLine, itinerary
from asympk.asymptotics.linear import SLIP
from asympk.asymptotics.validity import validity_conditions
from asympk.digits import SHOWN_OF_ERRORS, carried, carrier_context
from asympk.errors import NoManifold, NoMotion, OutOfRange, TwoMotions
from asympk.numbers import MOST_DIGITS, known_order, number, raw_entries, sign_of, whole
from asympk.path import Event, Path, require_within, times_within
from asympk.scene import in_doubles

HIGHEST_ORDER = 6
MOST_EXPONENT = 709.0  # beyond it exp exceeds the largest double
SPARE = 10  # digits carried beyond those asked for


def _bounded(function):
    return lambda v: function(v) if v < MOST_EXPONENT else math.inf


FLOATS = SimpleNamespace(
    number=float, out=float, exp=_bounded(math.exp), expm1=_bounded(math.expm1), log=math.log, eps=2.0**-52,
    pick=composite.state, where=lambda condition, a, b: a if condition else b,
)
ARRAYS = SimpleNamespace(
    number=np.asarray, exp=np.exp, expm1=np.expm1, log=np.log, eps=2.0**-52, pick=composite.states, where=np.where,
)


def run(scene: Any, method: str, *, order: int | None = None, digits: int | None = None) -> Path:
    """Follow ``scene`` by ``"jump"`` or ``"slow"`` to ``order`` (1 when not given), or by ``"rigid"``.

    With ``digits`` the numbers are those of mpmath with so many digits. Raises ``OrderError`` and ``OutOfRange``, for
    ``"slow"`` also ``NoManifold``, for ``"rigid"`` also ``NoMotion`` and ``TwoMotions``.
    """
    order = order_taken(method, order)
    m = FLOATS if digits is None else _multiprecision(whole("digits", digits, 1, MOST_DIGITS))
    numbers = scene.sigma, scene.sigma0, scene.mu
    parameters = in_doubles(*numbers) if digits is None else numbers
    sigma, sigma0, mu, x, y, z, until = map(m.number, (*parameters, *scene.start, scene.until))
    here = f"sigma = {sigma}, mu = {mu}, start = ({x}, {y}, {z})"
    line = line_of(sigma, sigma0)
    itineraries = itineraries_for(method, line, x + y, z, sign_of, here)
    try:
        found = composite.composite_motions(itineraries, order, (sigma, sigma0, mu, x, x + y, z), m)
        motion, error = composite.chosen(found, method == "jump", until, m)
        problems = validity_conditions(itineraries, found, error, line, mu, until, m)
        words = next((words for holds, words in problems if not holds), None)
        if words is None:
            return _path(scene, method, motion, error, until, m, digits)
    except (OverflowError, ZeroDivisionError, ValueError):
        words = "the terms of the expansion have no finite value"
    raise OutOfRange(f"{words}: {_largest_of(sigma, mu, x, y, z)} is not small ({here}); use method 'exact'")


def _largest_of(sigma, mu, x, y, z):
    """Return the name and value of the largest of the numbers that must be small for the expansion."""
    numbers = {"mu (|x| + |y|)": mu * (abs(x) + abs(y))}
    if z:
        numbers["mu/|z|"] = mu / abs(z)
    if sigma and 1 + sigma * (x + y):
        numbers["mu log(1/mu)/|sigma|"] = abs(mu * math.log(mu) / sigma)
        numbers["mu |x + 1/sigma|/|1 + sigma s|"] = mu * abs(x + 1 / sigma) / abs(1 + sigma * (x + y))
    name = max(numbers, key=numbers.get)
    return f"{name} = {float(numbers[name]):.3g}"


def itineraries_for(
    method: str, line: LoadLine, load: Any, velocity: Any, sign: Callable[[Any], int], here: str
) -> composite.LayerItineraries:
    """Return the itineraries of a start; raise ``NoManifold``, ``NoMotion``, ``TwoMotions`` where ``method`` fails."""
    steps = itinerary(line, load, velocity, sign)
    last, through = steps[-1].mode, " -> ".join(step.mode for step in steps)
    then = itinerary(line, line.rest(last), 0, sign) if line.returns(last, sign) else ()
    stops = any(step.event == "velocity_zero" for step in steps)
    if method == "slow" and stops:
        raise NoManifold(f"the fast motion meets z = 0 before it settles on a slow manifold: {through} ({here}); "
                         "use method 'jump'")
    if method == "rigid":
        modes = rigid_modes(line, velocity, sign)
        if not modes:
            raise NoMotion(f"the rigid rod has no motion; the elastic one stops at once, {through} ({here}); "
                           "use method 'jump'")
        if len(modes) > 1:
            raise TwoMotions(f"the rigid rod has two motions, {' and '.join(modes)}; the elastic one "
                             f"{'stops at once and then ' * stops}takes {last} ({here}); "
                             "use method 'jump'")
    return composite.LayerItineraries(steps, then)


def line_of(sigma: Any, sigma0: Any) -> LoadLine:
    """Return the equations of the load in the layers, in numbers or arrays."""
    return model().map(lambda c: coefficient(c)(sigma, sigma0)[0]).line


def order_taken(method: str, order: int | None) -> int:
    """Return ``order``, or the default, which is 1 and for ``"rigid"`` 0; raises ``OrderError``."""
    highest = 0 if method == "rigid" else HIGHEST_ORDER
    order = min(1, highest) if order is None else order
    return known_order(order, highest, f"method {method!r} takes whole orders")


def rigid_modes(line: LoadLine, velocity: Any, sign: Callable[[Any], int]) -> list[str]:
    """Return the modes in which the rigid system continues from ``velocity``: its constraint gives s = rest(mode)."""
    wanted = sign(velocity)
    sides = [(mode, line.side(mode, sign)) for mode in SLIP]
    return [m for m, side in sides if side and side == (wanted or sign(line.acceleration(m)))]


def _path(scene, method, motion, error, until, m, digits):
    final = composite.state(motion, until, m)
    turns = [turn for turn in motion.turns if turn.t < until]
    events = tuple(Event(t.kind, m.out(t[1]), tuple(map(m.out, t[2:5]))) for t in turns)
    modes = tuple(segment.mode for segment in motion.segments[: len(turns) + 1])
    error = float(error) if digits is None else carried(error, SHOWN_OF_ERRORS)
    dense = partial(_states, motion, until, digits)
    return Path(scene, method, tuple(map(m.out, final)), events, modes, dense, error)


def _states(motion, until, digits, t):
    """Return (x, y, z) at any times in [0, until], in doubles or on ``digits`` digits: an array ``(3,) + t.shape``."""
    if digits is None:
        with np.errstate(all="ignore"):
            return np.stack(composite.states(motion, times_within(t, until), ARRAYS))
    times = np.array([number("t", u) for u in raw_entries("t", t).flat], dtype=object).reshape(np.shape(t))
    require_within(times.min(initial=0), times.max(initial=0), until)
    m = _multiprecision(digits)
    flat = [[m.out(v) for v in composite.state(motion, m.number(u), m)] for u in times.flat]
    return np.array(flat, dtype=object).T.reshape((3, *times.shape))


def _multiprecision(digits):
    m = carrier_context(digits + SPARE)
    return SimpleNamespace(
        number=lambda value: carried(value, digits + SPARE),
        out=lambda value: carried(value, digits),
        exp=m.exp, expm1=m.expm1, log=m.log, eps=m.eps, pick=composite.state, where=FLOATS.where,
    )
