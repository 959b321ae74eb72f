"""``method="exact"``: the exact flow in doubles, and on mpmath numbers to any number of digits.

A run in doubles estimates its own rounding error (``rounding``). If this error may show in the result, the events are
refined on mpmath numbers, and the result is rounded to doubles. If it may change the sequence of events, if a sign
cannot be decided, or if doubles overflow, the flow is followed on mpmath numbers from the start.
``followed_in_doubles`` makes this choice.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

from asympk.arithmetic import LARGEST_DOUBLE, UNIT, Doubles, agreed, flow_context, set_digits
from asympk.errors import Undecided
from asympk.numbers import MOST_DIGITS, Arithmetic, Number, whole
from asympk.path import ClosedForm, Event, Path
from asympk.scene import Scene, in_doubles
from asympk.systems.painleve_klein.flow.rounding import calm, estimated_error, largest_state
from asympk.systems.painleve_klein.flow.segments import RodFlow, SolvedSegment, follow_rod
from asympk.systems.painleve_klein.flow.starts import RodNumbers, beginning

MOST_SPARE = 1200  # digits at work beyond four times those asked for
BEFORE_ROUNDING = 20  # digits of a run that is rounded to doubles: its own error does not add to that of rounding
TRUSTED = 2e-15  # estimated error up to which a run in doubles is the result
SAFETY = 4  # factor on an error that is estimated to first order
REFINABLE = 2e-14  # estimated error up to which events may be refined: doubles decide signs at a larger margin
REFINED_DIGITS = 34  # at work when events are refined


def run(
    scene: Scene, method: str = "exact", *, digits: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Follow ``scene`` in closed form: in doubles, or on mpmath numbers right to ``digits`` digits (1 to 1000).

    The ``error`` of the path is an estimate in doubles; with ``digits`` it is the distance to a run of less precision.
    With ``digits`` there are two runs or more, and ``progress(t, until, working)`` is called after every event with the
    time reached and the digits at work; an exception from ``progress`` ends the run.
    """
    if digits is None:
        return _path(scene, None, *followed_in_doubles(_rod_of(scene)))
    from asympk.digits import SHOWN_OF_ERRORS, carried

    digits = whole("digits", digits, 1, MOST_DIGITS)
    solved, error = _certified(_rod_of(scene), digits, progress=progress)
    convert = partial(carried, digits=digits)
    return _path(scene, digits, _rounded(solved, convert), solved, carried(error, SHOWN_OF_ERRORS), convert)


def _rod_of(scene):
    return RodNumbers(scene.sigma, scene.sigma0, scene.mu, *scene.start, scene.until, scene.near_to)


def followed_in_doubles(rod: RodNumbers) -> tuple[list[SolvedSegment], list[SolvedSegment], float, Callable]:
    """Return (segments rounded to doubles, segments as followed, error, conversion to doubles) of a ``RodNumbers``."""
    try:
        solved = segments_of(Doubles, rod)
        error = 0.0 if calm(solved, float(rod.until)) else estimated_error(solved)
        if error <= TRUSTED:
            return solved, solved, max(TRUSTED, SAFETY * error), float
        if error <= REFINABLE:
            return _to_doubles(segments_of(_refining(), rod, solved))
    except (Undecided, OverflowError, ZeroDivisionError):
        pass
    return _to_doubles(_certified(rod, BEFORE_ROUNDING, LARGEST_DOUBLE)[0])


def _to_doubles(solved):
    from asympk.digits import double

    return _rounded(solved, double), solved, UNIT, double


_flow_in_doubles = lru_cache(maxsize=64)(partial(RodFlow, Doubles))


@lru_cache(maxsize=1)
def _refining():
    m = flow_context(LARGEST_DOUBLE)
    set_digits(m, REFINED_DIGITS)
    return m


def segments_of(
    m: Arithmetic, rod: RodNumbers, known: Sequence[SolvedSegment] | None = None, on_event: Any = None
) -> list[SolvedSegment]:
    """Return the segments of the solution of ``rod`` in the numbers of ``m``; ``follow_rod`` has the other options."""
    numbers = rod.sigma, rod.sigma0, rod.mu
    flow = _flow_in_doubles(*in_doubles(*numbers)) if m is Doubles else RodFlow(m, *map(m.number, numbers))
    start, deviation = beginning(flow, rod)
    return follow_rod(flow, start, m.number(rod.until), deviation, known, on_event)


def _certified(rod, digits, largest=None, progress=None):
    """Return (segments, error), correct to ``digits`` digits."""
    most = 4 * digits + MOST_SPARE
    m, until = flow_context(largest or most), float(rod.until)

    def follow(working, tie):
        set_digits(m, working, tie)
        return segments_of(m, rod, on_event=progress and (lambda t: progress(float(t), until, working)))

    return agreed(follow, _distance, digits, most)


def _distance(coarse, fine):
    """Return the distance of the final (x, z), relative to the largest state on the path; None if the modes differ."""
    if [segment.mode for segment in coarse] != [segment.mode for segment in fine]:
        return None
    there, here = coarse[-1].end, fine[-1].end
    return max(abs(there[0] - here[0]), abs(there[3] - here[3])) / largest_state(fine)


def _rounded(solved, convert):
    return [segment._replace(start=convert(segment.start), end=tuple(map(convert, segment.end))) for segment in solved]


def _path(scene, digits, rounded, solved, error, convert):
    events = []
    for segment, after in pairwise(rounded):
        x, y, _, z, _ = segment.end
        events.append(Event(segment.kind, after.start, (x, y, z)))
    x, y, _, z, _ = rounded[-1].end
    modes = tuple([segment.mode for segment in rounded])
    dense = RodDense(run, scene, digits, solved, convert, solved[0].segment.mode.m)
    return Path(scene, "exact", (x, y, z), tuple(events), modes, dense, error)


class RodDense(ClosedForm):
    """The state (x, y, z) of a solved scene of the rod as a function of time."""

    __slots__ = ()

    def state_within(self, solved: SolvedSegment, t: Number) -> tuple[Number, ...]:
        x, y, _, z, _ = solved.segment.state(t)
        return x, y, z
