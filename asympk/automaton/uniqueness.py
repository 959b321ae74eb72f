r"""Second motions that come up between events, where a system has several rigid contacts, not all without friction.

The equations of the contacts are piecewise linear in the forces. They have one solution, whatever the loads, if the
determinant of each choice of phases, times the same determinant without friction, is positive. Elsewhere another
branch may become consistent at any time: one of its margins is negative until then (Lemma 17). An interval is free of
other motions if each other branch has a margin that is negative at both of its ends; other intervals are halved. The
margins are those on which ``decide`` chooses at events, and it is ``decide`` that ends the motion.
"""

from bisect import bisect
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from itertools import islice, pairwise, product
from typing import TYPE_CHECKING, Any, NamedTuple

from asympk.automaton import contacts
from asympk.automaton.automaton import ROUNDED, Automaton
from asympk.automaton.consistency import is_stiff, margins_at_state
from asympk.automaton.junction import Junction
from asympk.automaton.modes import GuardedMode
from asympk.automaton.numericmode import NumericMode, on_hermite
from asympk.errors import AsympkError, NoMotion, UnboundedReaction, Undecided
from asympk.numbers import sign_of
from asympk.symbolic import branches
from asympk.symbolic.branches import OPEN, Branch, Phase, at_rest
from asympk.symbolic.system import System

if TYPE_CHECKING:
    from asympk.automaton.loop import Segment

PARTS = 16  # intervals into which a segment is divided before these are halved
EVERY = 4  # interval after which the signs of the determinants are looked at, which suffice where they agree
HALVINGS = 30  # of an interval, within which a second motion is taken to come up
BESIDE = 2.0**-10  # part of a segment beside its ends, on which the decisions at its ends tell
LEAST = 2.0**-36  # part of the largest margin up to which another margin counts as 0
MOST = 512  # choices of phases up to which they are compared: those of four contacts of which one moves
Margins = dict[Branch, list[int]]
_CLOSELY = contacts.DOUBLES._replace(least=0.0)
_OPEN = (contacts.Unclear, AsympkError, ArithmeticError, ValueError)  # where doubles do not tell


class ModeInterval(NamedTuple):
    """A stretch of a mode from ``begin`` to ``end``, with the state as a function of the time."""

    automaton: Automaton
    branch: Branch
    begin: Any
    end: Any
    state_at: Callable[[Any], tuple]

    def at(self, part: float) -> tuple[Any, tuple]:
        """Return the time and the state after a part of the stretch."""
        t = self.begin + (self.end - self.begin) * part
        return t, self.state_at(t)

    def others(self, part: float) -> Margins:
        """Return the signs of the margins of branches that are second motions where consistent."""
        with suppress(*_OPEN):
            here = _junction(self.automaton, self.branch, *self.at(part))
            found = ((b, margins_at_state(here, b)) for b in rivals(here.system, self.branch))
            return {b: _signs(margins) for b, margins in found if margins}
        return {}


def is_watched(mode: GuardedMode) -> bool:
    """Tell whether a second motion may come up in a mode: a rigid contact rubs, and others are rough or may open.

    A contact alone has guards of its own, as long as no other one, now open, has kept it closed.
    """
    branch, ambiguous = mode.branch, branches.ambiguous_contacts(mode.system)
    rubs = (branch[j].slips for k, frictions in ambiguous.items() if not branch[k].is_open for j in frictions)
    return len(ambiguous) > 1 and any(rubs)


def require_alone(automaton: Automaton, mode: NumericMode, begin: Any, segment: "Segment", slack: Any) -> None:
    """Raise ``TwoMotions`` where another motion comes up in a segment of a mode from ``begin`` on.

    ``slack`` is the relative error of the states. Where the segment does not tell them, no motion is sought.
    """
    if not segment.t > begin or not is_watched(mode.mode):
        return
    if (state_at := segment.within or along_steps(mode, segment.steps)) is None:
        return
    stretch = ModeInterval(automaton, mode.branch, begin, segment.t, state_at)
    parts = [BESIDE + (1 - 2 * BESIDE) * k / PARTS for k in range(PARTS + 1)]
    if has_always_one_motion(automaton, mode.branch) or all(
            _has_one_motion(automaton, mode.branch, *stretch.at(part)) for part in parts[::EVERY]):
        return
    dismissed = set[Branch]()
    for low, high in pairwise((part, stretch.others(part)) for part in parts):
        for part, found in _coming_up(stretch, low, high, HALVINGS):
            if not found <= dismissed:
                dismissed |= found
                with suppress(NoMotion, UnboundedReaction, Undecided):
                    automaton.next(mode.branch, (), *stretch.at(part), slack)


def along_steps(mode: NumericMode, steps: Sequence[tuple[Any, tuple]]) -> Callable[[Any], tuple] | None:
    """Return the state as a function of the time, by cubics with the rates of a mode at the ends of the steps."""
    if len(steps) < 2:
        return None
    times = [t for t, _ in steps]

    def state_at(t: Any) -> tuple:
        k = min(max(bisect(times, t), 1), len(times) - 1)
        (t0, before), (t1, after) = steps[k - 1 : k + 1]
        slopes = mode.rhs(t0, before), mode.rhs(t1, after)
        return on_hermite((t - t0) / (t1 - t0), t1 - t0, (before, after), slopes)

    return state_at


@lru_cache(maxsize=256)
def has_always_one_motion(automaton: Automaton, branch: Branch) -> bool:
    """Tell whether the determinants are those of any state, and have the signs that they have without friction."""
    fixed = contacts.keeps_coefficients(automaton.system)
    return fixed and _has_one_motion(automaton, branch, 1.0, (1.0,) * len(automaton.system.states))


def _has_one_motion(automaton: Automaton, branch: Branch, t: Any, state: tuple) -> bool:
    """Tell whether each choice of phases has a determinant of the sign that it has without friction."""
    with suppress(*_OPEN):
        here, found = _junction(automaton, branch, t, state), distinct_branches(automaton.system, branch)
        return bool(found) and all(is_stiff(here, other, (*range(len(other)),)) for other in found)
    return False


def _junction(automaton: Automaton, branch: Branch, t: Any, state: tuple) -> Junction:
    """Return the contacts in a branch, in doubles without their rounding: what they show is decided again."""
    system, place = automaton.system, contacts.place_of(automaton, _CLOSELY, float(t), tuple(map(float, state)))
    signs = contacts.signs_at_rest(system, [place, place], at_rest(branch))
    point = contacts.contact_point(system, place, signs)
    touching = {k: False for k, f in enumerate(system.frictions) if f.unilateral and not branch[k].is_open}
    return Junction(system, branch, set(), (place, place), [point, point], signs, touching, ROUNDED)


def distinct_branches(system: System, branch: Branch) -> list[Branch]:
    """Return the branches that differ from one in their equations by more than constants; none if there are too many.

    These contain the signs of load and velocity as a product, the mode, unless a formula asks for the direction.
    """
    found = _choices(system, branch)
    if contacts.feels_directions(system):
        return found
    return [*{tuple(phase.mode for phase in b): b for b in found}.values()]


def rivals(system: System, branch: Branch) -> list[Branch]:
    """Return the branches that are second motions where they are consistent; none if there are too many choices.

    In these a contact that moves presses otherwise, or a smooth one does and the same contacts rest.
    """
    smooth = [k for k in range(len(branch)) if branches.is_smooth(system, k)]
    return [b for b in _choices(system, branch) if branches.presses_otherwise(system, b, branch) or (
        at_rest(b) == at_rest(branch) and any(b[k].load != branch[k].load for k in smooth))]


def _choices(system: System, branch: Branch) -> list[Branch]:
    """Return the branches that differ from one in loads, and in the phases of contacts at rest; none above ``MOST``."""
    found = [*islice(product(*(_phases(system, k, phase) for k, phase in enumerate(branch))), MOST + 1)]
    return found if len(found) <= MOST else []


def _phases(system: System, k: int, phase: Phase) -> list[Phase]:
    pushed = system.frictions[k].rigid or branches.is_pushed(system, k)
    if phase.is_open or not (pushed or phase.mode == "stick"):
        return [phase]
    velocities = (phase.velocity,) if phase.velocity else (0, 1, -1)
    closed = [Phase(load, velocity) for load in branches.signs_of_load(system, k) for velocity in velocities]
    return ([phase] if phase.smooth else closed) + [OPEN] * system.frictions[k].unilateral


def _signs(margins: list[Any]) -> list[int]:
    least = LEAST * max(map(abs, margins))
    return [0 if abs(margin) <= least else sign_of(margin) for margin in margins]


def _coming_up(
    stretch: ModeInterval, low: tuple[float, Margins], high: tuple[float, Margins], halvings: int
) -> Iterator[tuple[float, set[Branch]]]:
    """Yield, in order, parts of a stretch at which other branches are consistent, and these branches."""
    (start, before), (end, after) = low, high
    already, there = ({b for b, signs in found.items() if min(signs) > 0} for found in (before, after))
    if already:
        yield start, already
    elif any(all(a > 0 or b > 0 for a, b in zip(before[own], after[own], strict=True))
             for own in before.keys() & after.keys()):
        if halvings:
            middle = (start + end) / 2
            between = middle, stretch.others(middle)
            yield from _coming_up(stretch, low, between, halvings - 1)
            yield from _coming_up(stretch, between, high, halvings - 1)
        elif there:
            yield end, there
