"""Second motions of several rigid contacts, excluded all along a mode: each rival has a negative margin (Lemma 17).

Where the determinants of all choices of phases have the signs that they have without friction, no rival is looked at.
Elsewhere a margin of a rival is a row, as a guard is. A negative multiple of a guard of the mode is negative until this
guard falls. For all others, the time of the mode is halved until each rival has a negative margin on each piece. So it
is until a law of friction that may become negative is positive on each piece.
"""

from collections.abc import Iterator, Sequence
from itertools import product

from asympk.automaton.modes import SWITCH, GuardedMode, mode_of
from asympk.automaton.uniqueness import distinct_branches, is_watched, rivals
from asympk.certify.balls import Ball, Refused, certain_sign, flint
from asympk.certify.candidates import Candidates
from asympk.certify.enclosure import Budget
from asympk.certify.rows import Row, is_multiple, leading, row_rate
from asympk.certify.segments import AffineGuard, EnclosedSegment
from asympk.symbolic import branches, forces
from asympk.symbolic.branches import Branch
from asympk.symbolic.guards import NEVER_IDLE, stiffness


def require_one_motion(
    modes: Candidates, segment: EnclosedSegment, guards: Sequence[AffineGuard], end: Ball, budget: Budget
) -> None:
    """Raise ``Refused`` where another motion may begin in a segment, or kinetic friction may be negative in it.

    The ``guards`` of its mode are positive until ``end``.
    """
    _require_opposing(modes, segment, guards, end, budget)
    mode = segment.mode.mode
    if not is_watched(mode) or _has_always_one_motion(modes, mode):
        return
    if not (found := rivals(mode.sided, mode.branch)):
        raise _refused(mode, "a second motion")
    for rival in found:
        below = [*_below_zero(modes, segment, rival)]
        pairs = product((low.row for low in below), (guard.row for guard in guards))
        if not any(is_multiple(*pair, segment.mode.kept, modes.field) for pair in pairs):
            what = _refused(mode, f"{branches.mode_name(rival)}, as a second motion")
            _require_positive(segment, below, end, budget, what)


def _require_opposing(modes, segment, guards, end, budget):
    mode = segment.mode
    for law in mode.mode.laws:
        row = modes.row(mode.mode, law)
        if not any(row):
            continue
        zeros, sign = leading(row, mode.matrix, segment.start)
        low = AffineGuard("law", 0, row, zeros if sign == 1 else 0)
        if not any(is_multiple(row, guard.row, mode.kept, modes.field) for guard in guards):
            what = Refused(f"friction: within {mode.mode.name}, {law!s:.120} may be negative")
            _require_positive(segment, [low], end, budget, what)


def _has_always_one_motion(modes: Candidates, mode: GuardedMode) -> bool:
    """Tell whether each choice of phases has a determinant of the sign that it has without friction.

    Contacts at rest that share a velocity have the determinant 0.
    """
    system, others = mode.sided, distinct_branches(mode.sided, mode.branch)
    sizes = {b: modes.field.exact(branches.with_signs(system, b, stiffness(system, b))) for b in others}
    return bool(sizes) and all(
        certain_sign(modes.field.ball(size)) > 0 if size else branches.at_rest(b) for b, size in sizes.items())


def _refused(mode: GuardedMode, what: str) -> Refused:
    return Refused(f"uniqueness: within {mode.name}, {what} of the contacts may come up")


def _below_zero(modes: Candidates, segment: EnclosedSegment, rival: Branch) -> Iterator[AffineGuard]:
    """Yield the margins of a rival times -1; none of a rival that the parameters exclude, but a constant 1."""
    own = segment.mode.mode
    if not forces.determined(own.sided, rival):
        return
    mode = modes.of(mode_of(own.system, rival, own.sides))
    if mode is None:
        yield AffineGuard("several", 0, (*(0,) * (len(segment.start.exact) - 1), 1))
        return
    for guard in mode.guards:
        if guard.kind in (*NEVER_IDLE, SWITCH) or (row := _margin(guard, own.branch, mode.matrix)) is None:
            continue
        low = guard._replace(row=tuple(-c for c in row))
        zeros, sign = leading(low.row, segment.mode.matrix, segment.start)
        yield low._replace(touching=zeros if sign == 1 else 0)


def _margin(guard: AffineGuard, branch: Branch, matrix: tuple[Row, ...]) -> Row | None:
    """Return what must not be negative where a rival begins in place of a ``branch``, or None where this is no margin.

    Of a velocity that has been 0 it is the rate, of the gap of a contact that has been closed the second rate.
    """
    phase = branch[guard.friction]
    if guard.kind == "velocity_zero":
        return row_rate(guard.row, matrix) if phase.mode == "stick" else None
    if guard.kind == "touch_down":
        return None if phase.is_open else row_rate(row_rate(guard.row, matrix), matrix)
    return guard.row


def _require_positive(
    segment: EnclosedSegment, among: Sequence[AffineGuard], end: Ball, budget: Budget, what: Refused
) -> None:
    """Raise ``what`` unless at each time up to ``end`` one of some quantities is positive."""
    arb = flint().arb
    pieces, lo = [end.upper().mid()] if end.upper() > 0 else [], arb(0)
    while pieces:
        budget.spend(segment)
        hi = pieces[-1]
        if any(_is_positive(segment, low, lo, hi) for low in among):
            lo = pieces.pop()
        elif not hi - lo > end.upper() * budget.finest or all(segment.jet(low, hi)[0] < 0 for low in among):
            raise what
        else:
            pieces.append(((lo + hi) / 2).mid())


def _is_positive(segment: EnclosedSegment, guard: AffineGuard, lo: Ball, hi: Ball) -> bool:
    """Tell whether a quantity is positive on a piece, but for its zero at the start of the mode."""
    touching = guard.touching if lo == 0 else 0
    value, *slopes = segment.jet(guard, lo.union(hi), max(1, touching))
    if value > 0 or (touching and any(slope > 0 for slope in slopes)):
        return True
    if touching or not certain_sign(slopes[0]):
        return False
    return all(segment.jet(guard, at)[0] > 0 for at in (lo, hi))
