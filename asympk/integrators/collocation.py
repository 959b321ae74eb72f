r"""Reference solutions by Radau IIA collocation of high order, in any number of digits, for any System.

A step h with s stages is a polynomial through the stage derivatives K_i = f(t_i, w_i), w_i = w_0 + h sum_j a_ij K_j
(Hairer and Wanner, Solving ODEs II, IV.5 and IV.8). A sweep computes the residual of these equations in many digits and
corrects the K_i by a Newton step in doubles. Every sweep so gains up to 15 digits, and no large linear system is solved
in many digits. The length of a step is chosen so that the last two Legendre coefficients of K are below the tolerance.
The zero of a guard is found on the polynomial of the step.

``run`` compares two runs of different order, in different numbers of digits, which must agree to the digits asked for.
``_segment`` follows one mode, and ``_step`` is one step; ``asympk.radau`` has the coefficients of the method.
"""

from bisect import bisect_left
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from math import ceil, inf, log10
from operator import attrgetter
from sys import float_info
from time import monotonic
from typing import Any

import numpy as np

from asympk.automaton.automaton import Automaton
from asympk.automaton.consistency import decided_by
from asympk.automaton.decide import is_of_numbers, without_value_soon
from asympk.automaton.kept import without_asymmetry
from asympk.automaton.loop import Run, Segment, follow, lost_with
from asympk.automaton.numericmode import NumericMode
from asympk.digits import SHOWN_OF_ERRORS, FixedPoint, carried, carrier_context, dot, fixed_point
from asympk.errors import AsympkError, OutOfRange, TooManyEvents, Unfinished
from asympk.integrators.growth import LOST, grown, growth, largest_part, linearised
from asympk.integrators.integrate import AT_REST
from asympk.integrators.singular import followed
from asympk.integrators.watch import BESIDE_BUMPS, GuardSample, dips, first_lost, passed_wholes
from asympk.multiprecision import in_context
from asympk.numbers import whole
from asympk.path import Path, within
from asympk.radau import Tableau, tableau_of
from asympk.scene import Scene
from asympk.systems.automata import automaton_of

STEPS = 5000
MOST_DIGITS = 200
RESOLVED = 1e-3  # largest part of a guard, or of 1, that the last Legendre coefficients of a step may contribute
GROW, SHRINK = 4, 0.4  # the largest ratio of a step to the one before, and that of a second try to a step that failed
SWEPT = 1e-4  # part of the tolerance to which sweeps reduce the correction of a step
PATIENCE, STANDSTILL = 150, 1e-9  # tries of a step, and the relative gain in time below which these were in vain
HOPELESS = 1e9  # ratio of the time left to the time gained from which on steps must grow for the run to end
FEWER, LESS = 50, 1e-3  # the same as PATIENCE and STANDSTILL where a divisor of the rates nearly vanishes
NEARLY = 1 - 2.0**-20  # part of the time left: a step of this length or more is extended to the end
PARTS = tuple(k / 16 for k in range(1, 16))  # the parts of a step at whose ends guards are evaluated in the search
SPARE = 10  # digits of a computation beyond those of its result
SLACK = 100  # multiple of the tolerance of a step by which the state at an event may be wrong
LARGEST = 1e300  # growth of errors above which larger growth is not distinguished
STAGES, PER_DIGIT = 20, 0.8  # the least number, and that per digit: for many digits, stages cost less than steps
ROUGH, ROUGH_SWEEPS = 1e-10, 12  # relative correction at which sweeps in doubles end, and their largest number
STALLED = 8  # sweeps in which the correction must at least halve; otherwise Newton's method is cycling
BLOCK = 32  # unknowns that are eliminated together
ORDERS = ((0, 1), (6, 3))  # (additional stages, additional digits) of each of the two runs


@dataclass(frozen=True)
class Scheme:
    """A mode in many digits and in doubles, the tableau, the tolerance and largest length of a step, the deadline."""

    mode: NumericMode
    doubles: NumericMode
    tableau: Tableau
    tolerance: Any
    longest: Any
    deadline: float


@dataclass(frozen=True)
class CollocationStep:
    """One step: its start, its length and, for each state, the Legendre coefficients of its derivative."""

    t: Any
    state: tuple
    h: Any
    rates: list[FixedPoint]


def run(scene: Any, method: str = "collocation", *, digits: int = 30, events: int = 1000, seconds: float = inf) -> Path:
    """Follow ``scene`` to an accuracy of ``digits`` digits (1 to 200), by two runs of different order.

    ``path.error`` is the difference of the two runs, relative to the largest of 1 and the states. If errors grow along
    the motion, the runs are repeated with as many more digits. Raises ``OutOfRange`` if the runs do not agree or need
    too many steps, ``Undecided`` if more than 200 digits were needed, ``TooManyEvents``, and ``Unfinished`` after
    ``seconds``.
    """
    digits = whole("digits", digits, 1, MOST_DIGITS)
    deadline, carried_digits = monotonic() + seconds, max(digits, float_info.dig)  # by fewer, modes might be wrong
    while True:
        fine, error = _references(scene, carried_digits, events, deadline)
        segments = [s._replace(steps=(*((step.t, step.state) for step in s.samples), (s.t, s.state)))
                    for s in fine.segments]
        n, largest = len(scene.start), max(1.0, *(abs(float(w)) for w in fine.last.state))
        grows = growth(linearised(automaton_of(scene), segments), [1.0] * n, 10.0**-carried_digits)
        lost = largest_part(grows, largest)
        needed = digits + ceil(log10(max(1, min(lost, LARGEST))))
        ctx = fine.last.t.context
        if error <= ctx.mpf(10) ** -digits and lost * 10.0**-carried_digits <= LOST:
            break
        if needed <= carried_digits:
            differ = "pass different modes" if ctx.isinf(error) else f"differ by {ctx.nstr(error, 3)}"
            raise OutOfRange(f"two references {differ}; ask for other digits than {digits}, or move the start")
        if needed > MOST_DIGITS:
            raise grown(lost, fine.last.t)
        carried_digits = needed
    final, dense = _rounded(fine.last.state, digits), CollocationDense(fine, digits)
    found = tuple(e._replace(t=carried(e.t, digits), state=_rounded(e.state, digits)) for e in fine.events)
    return Path(scene, method, final, found, fine.modes, dense, carried(error, SHOWN_OF_ERRORS))


def _references(scene: Scene, digits: int, events: int, deadline: float) -> tuple[Run, Any]:
    """Return the finer of two runs, and their relative difference, which is ``inf`` if their lasting modes differ."""
    automaton, stages = automaton_of(scene), max(STAGES, ceil(PER_DIGIT * digits))
    places = [carrier_context(SPARE).mag(carried(v, SPARE)) for v in automaton.values if v]
    lost = sum(map(abs, places)) * 3 // 10  # digits that a rate such as log(1 + p)/p of a tiny parameter may lose
    contexts = [carrier_context(digits + SPARE + times * lost + extra) for times, (_, extra) in enumerate(ORDERS, 1)]
    with decided_by(deadline):
        first = automaton.first(scene.start, scene.until, contexts[0].dps)
        rough, fine = (_follow(automaton, first, scene, ctx, stages + more, digits + extra, events, deadline)
                       for ctx, (more, extra) in zip(contexts, ORDERS, strict=True))
    if fine.last.short:
        raise TooManyEvents(f"{fine.last.short} at t = {float(fine.last.t):.6g}; take a smaller until, or more events",
                            fine.last.t, fine.last.state)
    if _lasting(rough, digits) != _lasting(fine, digits):
        return fine, fine.last.t.context.inf
    scale = max(1, *map(abs, fine.last.state))
    return fine, max(abs(b - a) for a, b in zip(rough.last.state, fine.last.state, strict=True)) / scale


def _lasting(run: Run, digits: int) -> list[str]:
    """Return the modes that last longer than the accuracy of a run: events that coincide may come in any order."""
    times, least = (0, *(event.t for event in run.events), run.last.t), max(1, run.last.t) / 10**digits
    spans = zip(run.modes, pairwise(times), strict=True)
    return [mode for mode, _ in groupby(mode for mode, (begun, ended) in spans if ended - begun > least)]


def _rounded(state: tuple, digits: int) -> tuple:
    return tuple(carried(v, digits) for v in state)


def _follow(
    automaton: Automaton, first: tuple, scene: Scene, ctx: Any, stages: int, digits: int, events: int, deadline: float
) -> Run:
    start, until = tuple(in_context(ctx, v) for v in scene.start), in_context(ctx, scene.until)
    tolerance = ctx.mpf(10) ** -digits
    tableau = tableau_of(stages, ctx.dps)

    def advance(mode: NumericMode, t: Any, state: tuple, segments: list) -> Segment:
        doubles = automaton.mode(mode.branch, sides=mode.mode.sides)
        longest = mode.longest_step(until) * (len(PARTS) + 1)
        scheme = Scheme(mode, doubles, tableau, tolerance, longest, deadline)
        try:
            end = mode.steps_until(t, until)
            segment = followed(doubles, t, state, end, lambda end: _segment(scheme, t, state, end))
            return without_asymmetry(mode, t, state, segment)
        except (ZeroDivisionError, TypeError) as error:  # of infinite numbers, or of complex ones, which have no order
            if not is_of_numbers(error):
                raise
            raise OutOfRange(f"a rate or its slope is not a finite real number in mode {mode.name} from "
                             f"t = {float(t):.6g} on; run it without digits, or start elsewhere") from error

    return follow(automaton, first, start, until, advance, events, ctx.dps, tolerance * SLACK)


def _segment(scheme: Scheme, t: Any, state: tuple, until: Any) -> Segment:
    """Follow one mode until a guard is lost or ``until``; the samples of the segment are its steps."""
    mode, steps = scheme.mode, list[CollocationStep]()
    h = min(until - t, 1 / (until.context.one + max(abs(v) for row in mode.jac(t, state) for v in row)))
    tries, poles, faded, grow = list[Any](), mode.pole_values(t, state), mode.faded(t, state), GROW
    before = tuple(max(v, 0 * v) for v in mode.watched_values(faded, t, state))
    while len(steps) < STEPS and not _is_hopeless(tries, until):
        h = min(h, scheme.longest)
        last = h >= (until - t) * NEARLY
        h = until - t if last else h
        if monotonic() > scheme.deadline:
            raise Unfinished(f"the reference is at t = {float(t):.6g} when its time is over; allow more seconds")
        tries.append(t)
        _require_gain(scheme, tries, state, mode.vanishing(poles, mode.pole_values(t, state)))
        slopes, left_out = _tried(scheme, t, state, h)
        if not slopes or left_out > 1:
            h, grow = h * SHRINK, 1
            continue
        step = CollocationStep(t, state, h, scheme.tableau.coefficients(slopes))
        at, hit = _lost(scheme, step, before, faded) or (0 * h, None)
        end = state if hit is None else _at(scheme.tableau, step, at)
        if _has_passed_over(scheme, step, at or h, before, faded, [(at, end)] * (hit is not None or not steps)):
            h, grow = h * SHRINK, 1
            continue
        if hit is not None:
            if not mode.ends_at(hit):
                mode.require_one_side(mode.pole_values(t, state), t + at, end, begun=t)
            end, steps = _without_rounding(end, state, scheme.tolerance * SLACK), [*steps, step]
            together = lost_with(mode, hit, t + at, end, scheme.tolerance * SLACK)
            within = partial(_state_at, scheme.tableau, steps)
            return Segment(t + at, end, hit, None, "", tuple(steps), together, within=within)
        steps.append(step)
        t, state = (until if last else t + h), _at(scheme.tableau, step, h)
        if last:
            return Segment(until, state, None, samples=tuple(steps), within=partial(_state_at, scheme.tableau, steps))
        before = mode.watched_values(faded, t, state)
        h *= min(grow, left_out ** (-1 / len(scheme.tableau.nodes))) if left_out > SWEPT else grow
        grow = GROW
    raise OutOfRange(f"the reference needs more than {STEPS} steps; take a larger mu or a smaller until")


def _tried(scheme: Scheme, t: Any, state: tuple, h: Any) -> tuple[list[FixedPoint] | None, float]:
    """Return the stage derivatives of a step, and the error that it leaves out, or (None, inf) if a shorter one is due.

    It is where the iterates do not converge, leave the range of doubles, or come to where a rate is not real.
    """
    try:
        slopes = _step(scheme, t, state, h)
        return slopes, _left_out(scheme, t, state, slopes, h) if slopes else inf
    except AsympkError:
        raise
    except (ArithmeticError, TypeError, ValueError) as error:
        if not is_of_numbers(error):
            raise
        return None, inf


def _state_at(tableau: Tableau, steps: Sequence[CollocationStep], t: Any) -> tuple:
    step = steps[max(bisect_left(steps, t, key=attrgetter("t")), 1) - 1]
    return _at(tableau, step, t - step.t)


def _left_out(scheme: Scheme, t: Any, state: tuple, slopes: list[FixedPoint], h: Any) -> float:
    """Return the error that a step leaves out, in units of the allowed one: the step is not resolved above 1.

    The error is that of the last Legendre coefficients (``_tail``). In a mode whose guards may vary faster than the
    states, the guards must be resolved, too.
    """
    mode, tableau = scheme.mode, scheme.tableau
    found = _tail(slopes, tableau, h) / (scheme.tolerance * max(1, *map(abs, state)))
    if found > 1 or not mode.timed:
        return float(found)
    stages = (_moved(state, row, slopes, h) for row in tableau.a)
    rates = [mode.guard_rates(t + h * c, stage) for c, stage in zip(tableau.nodes, stages, strict=True)]
    sizes = map(abs, mode.guard_values(t, state))
    return float(max(found, _tail(_by_state(h.context, rates), tableau, h) / (RESOLVED * max(1, *sizes))))


def _misses_rates(scheme: Scheme, step: CollocationStep, at: Any, end: tuple) -> bool:
    """Tell whether the slope of a step, at an event or the start of a mode, is not that of the rates there.

    Between its nodes the step has then passed over what changes the rates near this state, ``end``.
    """
    allowed, weights = scheme.tolerance * SLACK * max(1, *map(abs, end)), scheme.tableau.values(at / step.h)
    with suppress(ArithmeticError, TypeError, ValueError):
        pairs = zip(step.rates, scheme.mode.rhs(step.t + at, end), strict=True)
        return any(step.h * abs(dot(step.h.context, weights, own) - rate) > allowed for own, rate in pairs)
    return False


def _has_passed_over(
    scheme: Scheme, step: CollocationStep, end: Any, before: tuple, faded: tuple, places: list
) -> bool:
    """Tell whether a step misses the rates at ``places``, or these or a dip of a guard at the middle of a bump.

    The step is looked at until the time ``end`` in it; ``before`` and ``faded`` are as in ``_lost``.
    """
    mode, start = scheme.mode, 0 * end
    if not mode.middles:
        return any(_misses_rates(scheme, step, *place) for place in places)

    def values(at: Any) -> tuple:
        return mode.middle_values(step.t + at, _at(scheme.tableau, step, at))

    ends = zip(mode.middles, values(start), values(end), strict=True)
    passed = [(k, n) for k, (own, a, b) in enumerate(ends) for n in passed_wholes(own.every, a, b)]
    middles = [_root(lambda at, k=k, n=n: values(at)[k] - n, start, end, scheme.tolerance) for k, n in passed]
    times = [at for middle in middles for part in BESIDE_BUMPS if start < (at := middle + part * step.h) < end]
    looks = [(at, _at(scheme.tableau, step, at)) for at in times]
    return any(_misses_rates(scheme, step, *look) for look in (*places, *looks)) or any(
        dips(before, mode.watched_values(faded, step.t + at, state)) for at, state in looks)


def _without_rounding(end: tuple, before: tuple, slack: Any) -> tuple:
    """Return the state at an event, with 0 for each state that is rounding relative to its value before the step."""
    return tuple(w if abs(w) > slack * abs(was) else 0 * w for w, was in zip(end, before, strict=True))


def _require_gain(scheme: Scheme, tries: list, state: tuple, divisor: Any) -> None:
    """Raise ``OutOfRange`` if many tries of a step, made at the times ``tries``, have gained hardly any time.

    ``divisor`` is a divisor of the rates that has nearly vanished, or None. With a divisor, fewer tries are allowed.
    """
    begun, t = tries[0], tries[-1]
    patience, gain = (PATIENCE, STANDSTILL) if divisor is None else (FEWER, LESS)
    if len(tries) > patience and t - begun <= (1 + gain) * (tries[-patience] - begun):
        unreal = without_value_soon(scheme.doubles, float(t), tuple(map(float, state)))
        what = f"{unreal} is no finite real number" if unreal else "the motion is not smooth or grows beyond bounds"
        why = f"{what}; end the run before it"
        why = why if divisor is None else f"rates are divided by {divisor!s:.120}, and that is 0; {AT_REST}"
        raise OutOfRange(f"the reference comes to a standstill at t = {float(t):.10g}, where {why}")


def _is_hopeless(tries: list, until: Any) -> bool:
    """Tell whether steps have stopped growing far from the end, as in a motion that oscillates fast."""
    if len(tries) <= 2 * PATIENCE:
        return False
    gained, earlier = (t - tries[0] for t in (tries[-1], tries[-PATIENCE]))
    return bool(until - tries[-1] > HOPELESS * gained and gained < GROW * earlier)


def _lost(scheme: Scheme, step: CollocationStep, before: tuple, faded: tuple) -> tuple | None:
    """Return (time in the step, guard) of the first guard lost in a step.

    Laws of friction count as guards, above their ``faded`` values; ``before`` are the values at the start of the step.
    """
    mode, h = scheme.mode, step.h

    def state(at: Any) -> tuple:
        return _at(scheme.tableau, step, at)

    def values(at: Any) -> tuple:
        return mode.watched_values(faded, step.t + at, state(at))

    def rates(at: Any) -> tuple:
        return mode.watched_rates(step.t + at, state(at))

    def touches(at: Any, k: int) -> bool:
        return abs(values(at)[k]) < scheme.tolerance * SLACK

    root = partial(_root, tolerance=scheme.tolerance)
    last = GuardSample(0 * h, before, mode.watched_rates(step.t, step.state))
    for end in (h * part for part in ((*PARTS, 1) if mode.timed else (1,))):
        now = GuardSample(end, values(end), rates(end))
        if met := first_lost(last, now, values, rates, root, PARTS, touches):
            return met
        last = now
    return None


def _root(function: Any, low: Any, high: Any, tolerance: Any) -> Any:
    """Return where a function changes its sign between the ends, by the Illinois method."""
    first, second, last = function(low), function(high), 0
    side = 1 if first > second else -1
    above, below = side * first, side * second
    at = low
    for _ in range(400):
        if high - low <= tolerance * high or above <= 0 or below >= 0:
            break
        at = high - below * (high - low) / (below - above)
        value = side * function(at)
        if value > 0:
            low, above, below, last = at, value, below / (2 if last > 0 else 1), 1
        else:
            high, below, above, last = at, value, above / (2 if last < 0 else 1), -1
        if value == 0:
            return at
    return high if above > 0 else low


def _step(scheme: Scheme, t: Any, state: tuple, h: Any) -> list[FixedPoint] | None:
    """Return the stage derivatives of a step, state by state, or None if the sweeps do not converge."""
    a, mode = scheme.tableau.a, scheme.mode
    times = [t + h * c for c in scheme.tableau.nodes]
    slopes = _in_doubles(scheme, times, state, h) or [mode.rhs(t, state)] * len(a)
    enough, sizes = scheme.tolerance * SWEPT * max(1, *map(abs, state)), [h.context.mpf(5e29)]
    for _ in range(60):
        columns = _by_state(h.context, slopes)
        stages = [_moved(state, row, columns, h) for row in a]
        residual = [_minus(mode.rhs(c, w), k) for c, w, k in zip(times, stages, slopes, strict=True)]
        exponent = max(abs(v) for row in residual for v in row)
        if exponent == 0:
            return columns
        change = _correction(scheme, times, stages, [[float(v / exponent) for v in row] for row in residual], h)
        slopes = [_minus(k, [-exponent * v for v in d]) for k, d in zip(slopes, change.tolist(), strict=True)]
        size = h * exponent * float(abs(change).max())
        if size <= enough:
            return _by_state(h.context, slopes)
        stalled = len(sizes) > STALLED and size > sizes[-STALLED] / 2
        if stalled or not size < 2 * sizes[-1]:
            return None
        sizes.append(size)
    return None


def _in_doubles(scheme: Scheme, times: list, state: tuple, h: Any) -> list | None:
    """Return the stage derivatives in doubles, from which the sweeps in many digits begin, or None if these diverge."""
    floats, moments = np.array([float(v) for v in state]), [float(t) for t in times]
    slopes = np.zeros((len(times), len(state)))
    with np.errstate(all="ignore"), suppress(ArithmeticError, ValueError, TypeError):
        for _ in range(ROUGH_SWEEPS):
            stages = (floats + float(h) * scheme.tableau.floats @ slopes).tolist()
            residual = [scheme.doubles.rhs(t, tuple(w)) for t, w in zip(moments, stages, strict=True)] - slopes
            change = _correction(scheme, moments, stages, residual, h)
            slopes = slopes + change
            if abs(change).max() <= ROUGH * abs(slopes).max():
                return slopes.tolist()
    return None


def _correction(scheme: Scheme, times: list, stages: list, residual: Any, h: Any) -> Any:
    """Return the Newton step of the stage derivatives, an array of doubles of shape (stages, states).

    It is 0 for velocities that the mode holds at 0; elimination would leave rounding there.
    """
    jacobians = [scheme.doubles.jac(float(t), tuple(map(float, w))) for t, w in zip(times, stages, strict=True)]
    residual, steps = np.array(residual, dtype=float), scheme.tableau.floats * float(h)
    coupling = np.einsum("ikl,ij->ikjl", np.array(jacobians, dtype=float), steps).reshape(2 * (residual.size,))
    step = _solved(np.eye(residual.size) - coupling, residual.ravel()).reshape(residual.shape)
    return step * scheme.mode.movable


def _solved(matrix: Any, right: Any) -> Any:
    """Solve linear equations by elimination in blocks so small that the linear algebra uses one thread.

    Where other processes run, several threads wait for one another, up to a thousand times as long as they compute.
    """
    rows, size = np.column_stack([matrix, right]), len(right)
    blocks = [slice(start, min(start + BLOCK, size)) for start in range(0, size, BLOCK)]
    for k, here in enumerate(blocks, start=1):
        rows[here, here.stop :] = np.linalg.solve(rows[here, here], rows[here, here.stop :])
        for below in blocks[k:]:
            rows[below, here.stop :] -= rows[below, here] @ rows[here, here.stop :]
    for here in reversed(blocks):
        rows[: here.start, -1] -= rows[: here.start, here] @ rows[here, -1]
    return rows[:, -1]


def _minus(left: Any, right: Any) -> tuple:
    return tuple(a - b for a, b in zip(left, right, strict=True))


def _by_state(ctx: Any, slopes: list) -> list[FixedPoint]:
    return [fixed_point(ctx, column) for column in zip(*slopes, strict=True)]


def _moved(state: tuple, weights: FixedPoint, slopes: list[FixedPoint], h: Any) -> tuple:
    return tuple(w + h * dot(h.context, weights, column) for w, column in zip(state, slopes, strict=True))


def _at(tableau: Tableau, step: CollocationStep, at: Any) -> tuple:
    """Return the state at the time ``at`` after the start of a step, from its collocation polynomial."""
    return _moved(step.state, tableau.integrals(at / step.h), step.rates, step.h)


def _tail(slopes: list[FixedPoint], tableau: Tableau, h: Any) -> Any:
    """Return the largest of the last two Legendre coefficients of the derivatives, times the length of the step."""
    return h * max(abs(dot(h.context, row, column)) for row in tableau.legendre[-2:] for column in slopes)


@dataclass(frozen=True)
class CollocationDense:
    """The collocation polynomials of a run: at times in [0, until] an array of mpf of shape ``(n,) + t.shape``."""

    joined: Run
    digits: int

    def __call__(self, t: Any) -> Any:
        t = np.asarray(t)
        columns = [self._state(v) for v in t.ravel().tolist()]
        return np.array(columns, dtype=object).T.reshape(-1, *t.shape)

    def _state(self, t: Any) -> tuple:
        steps = [step for segment in self.joined.segments for step in segment.samples]
        until = self.joined.last.t
        t = in_context(until.context, t)
        if not within(t, t, until):
            raise OutOfRange(f"t = {float(t)} is outside the run; ask within [0, {float(until)}]")
        if not steps:
            return _rounded(self.joined.last.state, self.digits)
        tableau = tableau_of(len(steps[0].rates[0].multiples), self.digits + SPARE)
        return _rounded(_state_at(tableau, steps, t), self.digits)
