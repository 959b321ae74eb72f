r"""The composite expansion of the Painlevé-Klein system in numbers: its states and its predicted error.

``composite_motions`` makes the ``CompositeMotion`` of three successive orders: the segments of the layers one after the
other, in absolute time. ``state`` and ``states`` evaluate a motion, and ``chosen`` adds the predicted error. The same
code serves floats, mpmath numbers and arrays; the argument ``m`` supplies exp, expm1, log, where, pick and eps.

``predicted_error``, the hard function, adds the change by the next order at the given time and several times the change
by the order after it. A first omitted term that happens to vanish and a slowly convergent series are thereby covered.
"""

from itertools import pairwise
from typing import Any, NamedTuple

from asympk.asymptotics.compiledlayers import EventNumbers, compiled_layers
from asympk.asymptotics.layers import LayerSegment

STALLED = 0.9  # the largest ratio of omitted terms from which the later terms are estimated


class CompositeMotion(NamedTuple):
    """Segments and the events between them, to one order; ``residual`` is None where no second layer follows."""

    segments: tuple[LayerSegment, ...]
    turns: tuple[EventNumbers, ...]
    residual: "Residual | None" = None


class Residual(NamedTuple):
    """The fast motion left when z = 0 at ``t``: errors ``lasting`` in x, z, and ``passing`` in y for ``fades``."""

    t: Any
    fades: Any
    lasting: Any
    passing: Any


class LayerItineraries(NamedTuple):
    """The steps of the first layer, and of the second one where the slow motion meets z = 0, or () if none follows."""

    steps: tuple
    then: tuple = ()


def composite_motions(
    itineraries: LayerItineraries, order: int, start: tuple, m: Any
) -> list[tuple[CompositeMotion, CompositeMotion]]:
    """Return the motions to ``order`` and the next two orders from ``start`` = (sigma, sigma0, mu, x, s, z).

    For each order these are two motions: the composite expansion, and the slow motion alone.
    """
    sigma, sigma0, mu, x, s, z = start
    large = -m.log(mu)
    begin = compiled_layers(itineraries.steps, order, 2 + bool(itineraries.then))
    layers = begin(sigma, sigma0, mu, large, x, s, z, m.log)
    if not itineraries.then:
        return [(CompositeMotion(now.segments, now.turns), CompositeMotion((now.landing,), ())) for now in layers]
    second = compiled_layers(itineraries.then, order, 2, itineraries.steps[-1].mode)
    found = []
    for k, (layer, finer) in enumerate(pairwise(layers)):
        # an error mu^n of the arrival is mu^(n - 1) in the fast time of the second layer, hence the order n + 1 here
        (t, left), (slow_t, _) = _arrival(finer, m), _arrival(layer, m)
        places = [(u, *state_of(layer.landing, u, m)) for u in (t, slow_t)]
        there, slowly = (EventNumbers("velocity_zero", u, x_there, y_there, 0 * u, left)
                         for u, x_there, y_there, _ in places)
        later = second(sigma, sigma0, mu, large, there.x, 0, 0, m.log)[k]
        onward = second(sigma, sigma0, mu, large, slowly.x, 0, 0, m.log)[k].landing
        segments = [p._replace(began=p.began + t) for p in later.segments]
        turns = [turn._replace(t=turn.t + t) for turn in later.turns]
        trace = _residual(layer.segments[-1], t, left)
        found.append((
            CompositeMotion((*layer.segments, *segments), (*layer.turns, there, *turns), trace),
            CompositeMotion((layer.landing, onward._replace(began=slow_t)), (slowly,), trace),
        ))
    return found


def _residual(last, t, part):
    (*_, x, _), (*_, y, _), (_, rate, _, z, _) = last.x, last.y, last.z  # the fast parts, and the rate of z
    return Residual(t, 40 / abs(last.fast), part * (abs(x) + abs(z) * (1 + 1 / abs(rate))), part * abs(y))


def _arrival(layer, m):
    """Return the time at which the slow motion meets z = 0, by Newton's method, and e^(fast t) at that time."""
    _, rate, part, _, centre = layer.landing.z
    slow, last = layer.landing.slow, layer.segments[-1]
    t = -centre / rate
    for _ in range(8):
        fade = m.exp(slow * t)
        t = t - (centre + rate * t + part * fade) / (rate + part * slow * fade)
    return t, m.exp(m.where(t > last.began, last.fast * (t - last.began), 0))


def state_of(segment: LayerSegment, t: Any, m: Any) -> tuple:
    """Return (x, y, z) of a segment at the time ``t``."""
    local = t - segment.began
    p, q = segment.slow * local, segment.fast * local
    early = q > -1  # two forms of the same sum, each without cancellation in its range
    fade = m.where(early, m.expm1(p), m.exp(p))
    jump = m.where(early, m.expm1(q), m.exp(m.where(early, 0, q)))
    return tuple(
        m.where(early, s, c) + r * local + a * fade + b * jump for s, r, a, b, c in (segment.x, segment.y, segment.z)
    )


def state(motion: CompositeMotion, t: Any, m: Any) -> tuple:
    """Return (x, y, z) at the number ``t``."""
    for segment in reversed(motion.segments[1:]):
        if t >= segment.began:
            return state_of(segment, t, m)
    return state_of(motion.segments[0], t, m)


def states(motion: CompositeMotion, t: Any, m: Any) -> tuple:
    """Return (x, y, z) at the array ``t``: every segment is evaluated at times within it, then one is selected."""
    found: Any = None
    for segment, end in zip(motion.segments, ends(motion, t, m), strict=True):
        here = state_of(segment, end, m)
        found = here if found is None else [m.where(t < segment.began, f, h) for f, h in zip(found, here, strict=True)]
    return tuple(found)


def predicted_error(found: list[CompositeMotion], t: Any, m: Any) -> Any:
    """Return the predicted absolute error at ``t`` of the first of three motions of successive orders."""
    now, next_, last = (m.pick(motion, t, m) for motion in found)
    first, second = _distance(now, next_, m), _distance(next_, last, m)
    spread = largest(0, *(m.where(t <= turn.t, 0, turn.spread) for turn in found[0].turns),
                     *(m.where(t <= p.began, 0, p.slow / p.fast) for p in found[0].segments), m=m)
    error = first * (1 + 2 * spread) + _rest(second / m.where(first > 0, first, 1), m) * second
    error = error + _distance(now, m.pick(found[0], t * (1 + 4 * m.eps), m), m)
    late = [abs(a.t - b.t) + abs(b.t - c.t) for a, b, c in zip(*(motion.turns for motion in found), strict=True)]
    for i, turn in enumerate(found[0].turns):
        error = error + _at_event(found[0].segments[i : i + 2], turn.t, 2 * late[i], t, m)
    if found[0].residual:
        t_left, fades, lasting, passing = found[0].residual
        error = error + m.where(t < t_left, 0, 4 * lasting + m.where(t < t_left + fades, 4 * passing, 0))
    sizes = (c for p in found[0].segments for w in (p.x, p.z) for c in w)
    return error + 16 * m.eps * largest(1, t, now[1], *sizes, m=m)


def _rest(ratio, m):
    """Return the factor of the second omitted term that accounts for all later ones; ``ratio`` is second over first."""
    near = m.where(ratio < STALLED, ratio, STALLED)
    return 2 / (1 - m.where(near > 0.5, near, 0.5))


def _relative(error, state, m):
    """Return an absolute error relative to the largest of 1, |x|, |z|, of the true state: ``state`` less the error."""
    scale = largest(1, state[0], state[2], m=m) - error
    return error / m.where(scale > 1, scale, 1)


def _at_event(segments, when, window, t, m):
    """Return the difference at ``t`` of the two segments at an event if ``t`` is within ``window`` of it, else 0."""
    near = abs(t - when) <= window
    within = m.where(near, t, when)
    before, after = (state_of(segment, within, m) for segment in segments)
    return m.where(near, _distance(before, after, m), 0)


def chosen(
    found: list[tuple[CompositeMotion, CompositeMotion]], layers: bool, t: Any, m: Any
) -> tuple[CompositeMotion, Any]:
    """Return the motion of the lowest order, with or without its layers, and its predicted error at ``t``."""
    error = predicted_error([motion for motion, _ in found], t, m)
    now, slowly = (m.pick(motion, t, m) for motion in found[0])
    if layers:
        return found[0][0], _relative(error, now, m)
    return found[0][1], _relative(error + _distance(now, slowly, m), slowly, m)


def ends(motion: CompositeMotion, t: Any, m: Any) -> list:
    """Return the end of each segment, but at most ``t``, and at least the time at which the segment begins."""
    ends = [m.where(p.began < t, p.began, t) for p in motion.segments[1:]] + [t]
    return [m.where(end > p.began, end, p.began) for p, end in zip(motion.segments, ends, strict=True)]


def _distance(a, b, m):
    return largest(*(p - q for p, q in zip(a, b, strict=True)), m=m)


def largest(first: Any, *others: Any, m: Any) -> Any:
    """Return the largest modulus, entry by entry for arrays."""
    result = abs(first)
    for other in others:
        result = m.where(abs(other) > result, abs(other), result)
    return result
