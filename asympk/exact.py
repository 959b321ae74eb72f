"""``method="exact"``: the exact flow in doubles, and on mpmath numbers to any number of digits.

A run in doubles keeps account of its own rounding errors. Where they would show in the result, where a sign cannot be
told, or where the range of doubles ends, the same flow is followed on mpmath numbers instead and rounded at the end.
"""

from functools import lru_cache
from typing import Any, NamedTuple

from asympk.arithmetic import Doubles, Undecided, multiprecision
from asympk.dense import Dense
from asympk.errors import InputError, TooLarge
from asympk.flow import Flow, beginning, follow
from asympk.path import Event, Path
from asympk.rounding import estimate

MOST_DIGITS = 1000
TRUSTED = 2e-15


class Case(NamedTuple):
    """The numbers of a scene, each exact in itself."""

    sigma: Any
    sigma0: Any
    mu: Any
    x: Any
    y: Any
    z: Any
    until: Any
    near: tuple | None


def run(scene, method="exact", *, digits=None):
    """Follow ``scene`` in closed form: in doubles, or on mpmath numbers right to ``digits`` digits (1 to 1000)."""
    if digits is None:
        return _in_doubles(scene)
    if isinstance(digits, bool) or not isinstance(digits, int) or not 1 <= digits <= MOST_DIGITS:
        raise InputError(f"digits = {digits!r}: it must be an integer from 1 to {MOST_DIGITS}")
    case = Case(scene.sigma, scene.sigma0, scene.mu, *scene.start, scene.until, scene.near_to)
    return _path(scene, *_certified(case, digits), _mpf, digits)


def _in_doubles(scene):
    near = scene.near_to and (scene.near_to[0], float(scene.near_to[1]))
    case = Case(*map(float, (scene.sigma, scene.sigma0, scene.mu, *scene.start, scene.until)), near)
    try:
        solution = solution_of(Doubles, case)
        error = estimate(solution, TRUSTED)
        if error <= TRUSTED:
            return _path(scene, solution, error, _same, None)
    except (Undecided, OverflowError, ZeroDivisionError):
        pass
    return _path(scene, *_certified(case, 17), _double, None)


@lru_cache(maxsize=64)
def _flow_in_doubles(sigma, sigma0, mu):
    return Flow(Doubles, sigma, sigma0, mu)


def solution_of(m, case):
    """Return the solution of ``case`` in the numbers of ``m``."""
    parameters = m.number(case.sigma), m.number(case.sigma0), m.number(case.mu)
    flow = _flow_in_doubles(*parameters) if m is Doubles else Flow(m, *parameters)
    start, deviation = beginning(flow, case)
    return follow(flow, start, m.number(case.until), deviation)


def _certified(case, digits):
    """Return (solution, error): two runs at different precision agree to ``digits`` digits, the error is their distance."""
    working, most = digits + 12, 4 * digits + 1200
    while True:
        try:
            coarse = solution_of(multiprecision(working), case)
            fine = solution_of(multiprecision(working + 8 + digits // 4), case)
            error = _distance(coarse, fine)
            if error is not None and error * 10**digits < 1:
                return fine, error
        except Undecided:
            pass
        if working > most:
            raise Undecided
        working *= 2


def _distance(coarse, fine):
    if coarse.modes != fine.modes:
        return None
    x, _, _, z = fine.final
    largest = max(1, *(max(abs(segment.x0), abs(segment.z0)) for segment in fine.segments), abs(x), abs(z))
    return max(abs(coarse.final[0] - x), abs(coarse.final[3] - z)) / largest


def _path(scene, solution, error, convert, digits):
    events, (x, y, _, z) = solution.events, solution.final
    if convert is not _same:
        events = [Event(e[0], *map(convert, e[1:])) for e in events]
    return Path(scene, "exact", (convert(x), convert(y), convert(z)), tuple(events),
                tuple(solution.modes), Dense(solution), error)


def _same(value):
    return value


def _double(value):
    rounded = float(value)
    if abs(rounded) == float("inf"):
        raise TooLarge(f"the path reaches {value!s:.12}, beyond the range of doubles: ask for digits=")
    return rounded


def _mpf(value):
    import mpmath

    return mpmath.mp.make_mpf(value._mpf_)
