r"""The plane through a state that a mode keeps, as that of a symmetry: there states are 0, or alike up to their signs.

A symmetric mechanism that begins symmetrically stays so, and what is 0 in all of its symmetric states stays 0, with all
of its derivatives. Two states may stay alike if their rates are alike at a generic place of the plane. Where they are
not, the plane is widened until the rates agree: this is the smallest of such planes that the mode keeps. The rates must
agree with waves for exponentials, too: numbers at one place do not show a pulse 1 + exp(-10^4 (t - 1)^2) elsewhere.

A gap that is 0 wherever those of closed contacts are, as that of a third foot on the ground, stays 0 with them.
"""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache, partial
from itertools import chain
from typing import TYPE_CHECKING, Any

import sympy as sp

from asympk.automaton.contacts import Numbers, Place, clear_sign, linear_rows
from asympk.automaton.modes import GuardedMode, has_switches
from asympk.automaton.rest import with_exchanges
from asympk.multiprecision import in_context
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import atoms, replaced, symbols_in
from asympk.symbolic.system import System

if TYPE_CHECKING:
    from asympk.automaton.junction import Junction
    from asympk.automaton.loop import Segment
    from asympk.automaton.numericmode import NumericMode

Mark = tuple[int, int]
Marks = list[Mark]  # of each state the first state that is alike and the sign to it; ``ZERO`` for 0
Sign = Callable[[Sequence], int]  # of the first of some values, 0 where it may be 0
ZERO = (-1, 0)
NEWTON = 12  # steps that give all digits from a generic place on
FARTHEST = 1e-3  # part of the largest state by which errors of a flow leave a plane at most
APART = 64  # a generic place is about this part of the size of each state away from the state itself


def vanish_on_plane(here: "Junction", mode: GuardedMode, exprs: tuple[sp.Expr, ...]) -> bool:
    """Tell whether expressions are 0 in all states of the plane that a mode keeps through the state here.

    It is not known, and so False, where the state or the time switches a law, where a value is not finite, or where a
    contact is rigid, whose share of a load may be 0 by choice.
    """
    if any(f.rigid for f in mode.system.frictions):
        return False
    with suppress(ArithmeticError, TypeError, ValueError):
        marks = _alike([*zip(*(place.state for place in here.places), strict=True)], None, here.numbers.decided_sign)
        marks, places = _kept(here.at, mode, marks, here.numbers.decided_sign, 0)
        return bool(places) and _is_exact(places, mode, marks, here.numbers.decided_sign, exprs)
    return False


def is_kept_gap(here: "Junction", mode: GuardedMode, gap: sp.Expr) -> bool:
    """Tell whether a gap is 0 in all states near here in which the gaps of closed rigid contacts are.

    It is where its slopes, by states and time, depend linearly on theirs in all of these states (rank theorem). They
    are examined in one, which Newton's method finds from a generic place. False where that is not known.
    """
    gaps, system, numbers = _without_fading((*mode.kept_gaps.values(), gap)), mode.system, here.numbers
    moving = tuple(s for s in (*system.states, system.time) if s in symbols_in(sp.Tuple(*gaps)))
    rows = tuple(chain(*((g, *(slope_by(g, s) for s in moving)) for g in gaps)))
    kept, columns = range(len(gaps) - 1), range(1, 1 + len(moving))
    if has_switches(system):
        return False
    with suppress(ArithmeticError, TypeError, ValueError):
        place, *_ = _generic(here.at, mode, [(k, 1) for k in range(len(system.states))], 0)  # a ValueError for none
        for _ in range(NEWTON):
            near = place.with_nudged(here.slack, here.slack)
            tables = [linear_rows(place.values(system, rows), moving) for place in near]
            tables, found = with_exchanges(tables, kept, columns, numbers)
            place = _stepped(place, system, {moving[j - 1]: tables[0][i][0] for j, i in found.items()})
        left = [*((i, 0) for i in range(len(gaps))), *((-1, j) for j in columns if j not in found)]
        return not any(numbers.decided_sign([table[i][j] for table in tables]) for i, j in left)
    return False


def _stepped(place: Place, system: System, step: dict[sp.Symbol, Any]) -> Place:
    state = tuple(w + step.get(s, 0) for s, w in zip(system.states, place.state, strict=True))
    return place._replace(t=place.t + step.get(system.time, 0), state=state)


def without_asymmetry(mode: "NumericMode", t: Any, state: tuple, segment: "Segment") -> "Segment":
    """Return a segment of a mode from (t, state) with its end on the plane that the mode keeps through this state.

    Errors of the flow leave the plane, and contacts that a symmetry makes slip at one time would slip in turn.
    """
    apart = [(k, 1) for k in range(len(state))]
    if len(mode.branch) < 2 or (marks := _alike([*zip(state)], None, lambda values: values[0] != 0)) == apart:
        return segment
    farthest = FARTHEST * max(map(abs, segment.state))
    marks = _alike([*zip(segment.state)], marks, lambda values: abs(values[0]) > farthest)
    if marks == apart:
        return segment
    convert = partial(in_context, mode.functions) if mode.target == "mpmath" else float
    with suppress(ArithmeticError, TypeError, ValueError):
        at = Place(Numbers(mode.target, mode.functions, convert, 0.0), t, state, mode.p, mode.coefficients)
        marks, places = _kept(at, mode.mode, marks, clear_sign, mode.beside)
        if places and _is_exact(places, mode.mode, marks, clear_sign):
            return segment._replace(state=_on_plane(marks, segment.state))
    return segment


def _is_exact(places: tuple[Place, ...], mode: GuardedMode, marks: Marks, sign: Sign, exprs: tuple = ()) -> bool:
    """Tell whether rates agree with the marks of states, and ``exprs`` are 0, whatever functions that fade may be."""
    apart = (rate - sign * mode.rates[first] for rate, (first, sign) in zip(mode.rates, marks, strict=True))
    return not any(map(sign, _values(mode, _without_fading((*apart, *exprs)), places)))


@lru_cache(maxsize=256)
def _without_fading(exprs: tuple[sp.Expr, ...]) -> tuple[sp.Expr, ...]:
    """Return expressions with waves for functions that fade.

    For exp(p) stands cos(p) + 2: where expressions are 0 for such a function, they are so for any.
    """
    found = filter(_may_fade, atoms(sp.Tuple(*exprs), sp.Function, sp.Pow))
    kinds, waves = list[type](), dict[sp.Expr, sp.Expr]()
    for part in sorted(found, key=lambda part: (part.count_ops(), sp.default_sort_key(part))):  # inner ones first
        if part.func not in kinds:
            kinds.append(part.func)
        phase = sum(k * replaced(arg, waves) for k, arg in enumerate(part.args, 1))
        waves[part] = sp.cos(phase) + 2 + kinds.index(part.func)
    return tuple(replaced(expr, waves) for expr in exprs)


def _may_fade(part: sp.Expr) -> bool:
    """Tell whether a function or a power may be as good as 0, or as a constant, far from where it is not."""
    return not part.exp.is_number if part.is_Pow else not isinstance(part, sp.sin | sp.cos | sp.tan | sp.cot)


def _on_plane(marks: Marks, state: tuple) -> tuple:
    return tuple(sign * state[first] if sign else w - w for w, (first, sign) in zip(state, marks, strict=True))


def _kept(at: Place, mode: GuardedMode, marks: Marks, sign: Sign, slack: Any) -> tuple[Marks, tuple[Place, ...]]:
    """Return the marks of the least plane that is kept and has these ``marks``, and generic places; () if unknown.

    The generic places are displaced by the relative error ``slack``.
    """
    found = () if has_switches(mode.system) else _generic(at, mode, marks, slack)
    while found and (finer := _alike(_values(mode, mode.rates, found), marks, sign)) != marks:
        marks, found = finer, _generic(at, mode, finer, slack)
    return marks, found


def _values(mode: GuardedMode, exprs: tuple[sp.Expr, ...], places: Iterable[Place]) -> list[tuple]:
    return [*zip(*(place.values(mode.system, exprs) for place in places), strict=True)]


def _alike(values: list[tuple], before: Marks | None, sign: Sign) -> Marks:
    """Return the marks of the states that were 0, or alike up to signs, ``before`` and whose ``values`` are so, too."""
    found, before = Marks(), before or [ZERO] * len(values)
    for k, (own, (was, turned)) in enumerate(zip(values, before, strict=True)):
        if was < 0 and not sign(own):
            found.append(ZERO)
            continue
        firsts = (j for j in range(k) if found[j][0] == j and before[j][0] == was)
        pairs = ((j, s) for j in firsts for s in ((1, -1) if was < 0 else (turned * before[j][1],)))
        apart = (((j, s), [a - s * b for a, b in zip(own, values[j], strict=True)]) for j, s in pairs)
        found.append(next((mark for mark, values in apart if not sign(values)), (k, 1)))
    return found


def _generic(at: Place, mode: GuardedMode, marks: Marks, slack: Any) -> tuple[Place, ...]:
    """Return a place of the plane of ``marks``, in all numbers that decide; () if it is not on the side of contacts.

    Powers of a penetration are analytic while the contact is closed, and 0 beyond.
    """
    state, numbers = at.state, at.numbers
    for side in (1, -1):
        shifts = (numbers.convert(Fraction(side * (2 * k + 5), APART * (k + 7))) for k in range(len(state)))
        moved = tuple(w + (1 + abs(w)) * shift for w, shift in zip(state, shifts, strict=True))
        place = at.later(Fraction(5, 7 * APART))._replace(state=_on_plane(marks, moved))
        gaps = tuple(friction.gap for friction in mode.closed.values() if friction.gap is not None)
        if not mode.pressed or all(gap < 0 for gap in place.values(mode.system, gaps)):
            return place.with_nudged(slack)
    return ()
