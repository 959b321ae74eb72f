r"""The plane through a state that a mode keeps, as that of a symmetry: there states are 0, or alike up to their signs.

A symmetric mechanism that begins symmetrically stays so, and what is 0 in all of its symmetric states stays 0, with all
of its derivatives. Two states may stay alike if their rates are alike at a generic place of the plane. Where they are
not, the plane is widened until the rates agree: this is the smallest of such planes that the mode keeps.
"""

from collections.abc import Iterable
from contextlib import suppress
from fractions import Fraction

import sympy as sp

from asympk.automaton.contacts import Numbers, Place
from asympk.automaton.junction import Junction
from asympk.automaton.modes import GuardedMode, has_switches

Marks = list[tuple[int, int]]  # of each state the first state that is alike and the sign to it; ``ZERO`` for 0
ZERO = (-1, 0)
APART = 64  # a generic place is about this part of the size of each state away from the state itself


def vanish_on_plane(here: Junction, mode: GuardedMode, exprs: tuple[sp.Expr, ...]) -> bool:
    """Tell whether expressions are 0 in all states of the plane that a mode keeps through the state here.

    It is not known, and so False, where the state or the time switches a law, where a value is not finite, or where a
    contact is rigid, whose share of a load may be 0 by choice.
    """
    if has_switches(mode.system) or any(f.rigid for f in mode.system.frictions):
        return False
    marks = _alike([*zip(*(place.state for place in here.places), strict=True)], None, here.numbers)
    with suppress(ArithmeticError, TypeError, ValueError):
        while places := _generic(here, mode, marks):
            finer = _alike(_values(mode, mode.rates, places), marks, here.numbers)
            if finer == marks:
                return not any(map(here.numbers.decided_sign, _values(mode, exprs, places)))
            marks = finer
    return False


def _values(mode: GuardedMode, exprs: tuple[sp.Expr, ...], places: Iterable[Place]) -> list[tuple]:
    return [*zip(*(place.values(mode.system, exprs) for place in places), strict=True)]


def _alike(values: list[tuple], before: Marks | None, numbers: Numbers) -> Marks:
    """Return the marks of the states that were 0, or alike up to signs, ``before`` and whose ``values`` are so, too."""
    found, before = Marks(), before or [ZERO] * len(values)
    for k, (own, (was, turned)) in enumerate(zip(values, before, strict=True)):
        if was < 0 and not numbers.decided_sign(own):
            found.append(ZERO)
            continue
        firsts = (j for j in range(k) if found[j][0] == j and before[j][0] == was)
        pairs = ((j, sign) for j in firsts for sign in ((1, -1) if was < 0 else (turned * before[j][1],)))
        apart = (((j, s), [a - s * b for a, b in zip(own, values[j], strict=True)]) for j, s in pairs)
        found.append(next((mark for mark, values in apart if not numbers.decided_sign(values)), (k, 1)))
    return found


def _generic(here: Junction, mode: GuardedMode, marks: Marks) -> tuple[Place, ...]:
    """Return a place of the plane of ``marks``, in all numbers that decide; () if it is not on the side of contacts.

    Powers of a penetration are analytic while the contact is closed, and 0 beyond.
    """
    state, numbers = here.at.state, here.numbers
    for side in (1, -1):
        shifts = (numbers.convert(Fraction(side * (2 * k + 5), APART * (k + 7))) for k in range(len(state)))
        moved = [w + (1 + abs(w)) * shift for w, shift in zip(state, shifts, strict=True)]
        own = tuple(sign * moved[first] if sign else 0 * moved[0] for first, sign in marks)
        place = here.at.later(Fraction(5, 7 * APART))._replace(state=own)
        gaps = tuple(friction.gap for friction in mode.closed.values() if friction.gap is not None)
        if not mode.pressed or all(gap < 0 for gap in place.values(mode.system, gaps)):
            return place.with_nudged(0)
    return ()
