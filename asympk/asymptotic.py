r"""The asymptotic models as paths: the rigid system, slow flow on a manifold, and layers composed with slow flow.

All rest on one expansion (``composite``). In each mode it has the slow and the fast part of the motion to order n in
mu; their sum holds uniformly in t (``"jump"``). ``"slow"`` is the slow part alone, from where the start is projected to
along the fast fibre: it holds outside the layers. ``"rigid"`` is its limit mu = 0, which knows nothing of fast motions
and so has no motion, or two, where the rod is steep.

A path carries the error that the first omitted terms predict. Where an expansion does not hold, it is refused.
"""

import math
from types import SimpleNamespace

from asympk import composite
from asympk.arithmetic import multiprecision
from asympk.errors import AsympkError, InputError, NoManifold, NoMotion, OrderError, OutOfRange, TwoMotions
from asympk.linear import SLIP
from asympk.path import Event, Path
from asympk.replay import coefficient, model

HIGHEST_ORDER = 6
TOO_LARGE = 0.5
FLOATS = SimpleNamespace(
    number=float, out=float, exp=math.exp, expm1=math.expm1, log=math.log, eps=2.0**-52, pick=composite.state,
    where=lambda condition, a, b: a if condition else b,
)


def run(scene, method, *, order=None, digits=None):
    """Follow ``scene`` by ``"jump"`` or ``"slow"`` to ``order`` (1 when not given), or by ``"rigid"``.

    ``digits`` computes on mpmath numbers. Raises ``OrderError``, ``OutOfRange``; ``"slow"`` also ``NoManifold``,
    ``"rigid"`` also ``NoMotion`` and ``TwoMotions``.
    """
    order = _order(method, order)
    m = FLOATS if digits is None else _multiprecision(digits)
    sigma, sigma0, mu, x, y, z, until = map(
        m.number, (scene.sigma, scene.sigma0, scene.mu, *scene.start, scene.until)
    )
    line, here = line_of(sigma, sigma0), f"sigma = {sigma}, mu = {mu}, start = ({x}, {y}, {z})"
    course = composite.course_of(line, x + y, z, sign)
    if method != "jump":
        _REFUSE[method](line, course, z, here)
    try:
        found = composite.motions(course, order, 2, (sigma, sigma0, mu, x, x + y, z), m)
        _require_range(course, found, until, m, here)
        motion, error = composite.chosen(found, method == "jump", until, m)
        return _path(scene, method, motion, error, until, m, here)
    except (OverflowError, ZeroDivisionError, ValueError) as error:
        if isinstance(error, AsympkError):
            raise
        raise OutOfRange(f"the expansion breaks down: its terms have no finite value ({here})") from None


def line_of(sigma, sigma0):
    """Return the motion of the load in the layers, in numbers."""
    return model().map(lambda c: coefficient(c)(sigma, sigma0)[0]).line


def sign(value):
    """Return the sign of a number."""
    return (value > 0) - (value < 0)


def _order(method, order):
    highest = 0 if method == "rigid" else HIGHEST_ORDER
    order = min(1, highest) if order is None else order
    if isinstance(order, bool) or not isinstance(order, int) or not 0 <= order <= highest:
        raise OrderError(f"order = {order!r}: method {method!r} is known to the orders 0 .. {highest}")
    return order


def _require_range(course, found, until, m, here):
    for holds, words in composite.checks(course, [layers for layers, _ in found], until, m):
        if not holds:
            raise OutOfRange(f"{words} ({here}); use method='exact'")


def _refuse_slow(line, course, z, here):
    hit = [step.mode for step in course.steps if step.event == "velocity_zero"]
    if hit:
        raise NoManifold(f"the fast motion from this start runs from {hit[0]} to z = 0 and settles on no slow manifold "
                         f"before ({here}); use method='jump'")


def _refuse_rigid(line, course, z, here):
    motions = rigid_motions(line, z, sign)
    if not motions:
        raise NoMotion(f"the rigid rod has no motion with v = {z} < 0; the elastic one jumps to v = 0 through "
                       f"{' -> '.join(s.mode for s in course.steps)} ({here}); use method='jump'")
    if len(motions) > 1:
        raise TwoMotions(f"the rigid rod has two motions, {_told(line, motions)}; the elastic one {_selected(line, course)} "
                         f"({here}); use method='jump'")


_REFUSE = {"slow": _refuse_slow, "rigid": _refuse_rigid}


def rigid_motions(line, velocity, sign):
    """Return the modes in which the rigid system moves on from ``velocity``: the constraint gives s = rest(mode)."""
    wanted = sign(velocity)
    sides = [(mode, line.side(mode, sign)) for mode in SLIP]
    return [m for m, side in sides if side and side == (wanted or sign(line.acceleration(m)))]


def _told(line, motions):
    return " and ".join(f"v' = {float(line.acceleration(mode)):.6g} in {mode}" for mode in motions)


def _selected(line, course):
    last = course.steps[-1].mode
    stops = any(step.event == "velocity_zero" for step in course.steps)
    return f"{'stops at once and then ' if stops else ''}takes v' = {float(line.acceleration(last)):.6g} in {last}"


def _path(scene, method, motion, error, until, m, here):
    final = composite.state(motion, until, m)
    scale = composite.largest(1, final[0], final[2], m=m)
    if error * scale > TOO_LARGE * composite.largest(scale, final[1], m=m):
        raise OutOfRange(f"the first omitted terms are as large as what is kept ({here}); use method='exact'")
    turns = [turn for turn in motion.turns if turn.t < until]
    events = tuple(Event(t.kind, *map(m.out, t[1:5])) for t in turns)
    modes = tuple(piece.mode for piece in motion.pieces[: len(turns) + 1])
    return Path(scene, method, tuple(map(m.out, final)), events, modes, Dense(motion, until, m), m.out(error))


class Dense:
    """The motion at any times in [0, until]: an array of shape ``(3,) + t.shape``."""

    def __init__(self, motion, until, m):
        self.motion, self.until, self.m = motion, until, m

    def __call__(self, t):
        import numpy as np

        times = np.asarray(t, dtype=float if self.m is FLOATS else object)
        if not ((times >= 0) & (times <= self.until)).all():
            raise InputError(f"t = {t!r}: it must be within [0, {self.until}]")
        if self.m is FLOATS:
            with np.errstate(all="ignore"):
                return np.stack(composite.states(self.motion, times, arrays()))
        flat = [[self.m.out(v) for v in composite.state(self.motion, self.m.number(u), self.m)] for u in times.flat]
        return np.array(flat, dtype=object).T.reshape((3, *times.shape))


def arrays():
    """Return the functions of a composite expansion for arrays."""
    import numpy as np

    return SimpleNamespace(
        number=np.asarray, exp=np.exp, expm1=np.expm1, log=np.log, eps=2.0**-52, pick=composite.states, where=np.where,
    )


def _multiprecision(digits):
    import mpmath

    m = multiprecision(digits + 10)
    return SimpleNamespace(
        number=m.number, exp=m.exp, expm1=m.expm1, log=m.log, eps=m.eps, pick=composite.state, where=FLOATS.where,
        out=lambda value: mpmath.mp.make_mpf(m.mpf(value)._mpf_),
    )
