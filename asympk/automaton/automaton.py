"""The automaton: a system with numbers for its parameters, and which of its modes begins or follows at a state.

``Automaton.first`` and ``Automaton.next`` return the branch that begins or follows; ``decide`` finds it for smooth
formulas. On an edge, where a switching function such as ``Abs`` or ``Piecewise`` changes its side, branch and side
depend on one another: ``_follow_on``, the hard function, tries the law of each side and keeps a side into which its own
law leads. ``mode_on_sides`` puts the mode of a known branch on the sides that it enters.
"""

import math
import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from itertools import chain, product
from typing import Any

import sympy as sp

from asympk.arithmetic import DIGITS_OF_DOUBLES
from asympk.automaton import decide
from asympk.automaton.compiled import function
from asympk.automaton.contacts import contact_formulas
from asympk.automaton.exact import exact_values
from asympk.automaton.modes import has_law, is_nested, mode_of, phases_of, turning
from asympk.automaton.numericmode import BESIDE, NumericMode, State
from asympk.digits import carrier_context
from asympk.errors import InputError, NoMotion, NotDerivable, OutOfRange, TwoMotions, Undecided
from asympk.multiprecision import in_context
from asympk.numbers import sign_of
from asympk.symbolic.branches import OPEN, Branch, at_rest, rate_along
from asympk.symbolic.coefficients import coefficients_of, scattered
from asympk.symbolic.long import atoms, replaced
from asympk.symbolic.placing import with_numbers_inside
from asympk.symbolic.sides import Edge, Sides, inside, is_switched, is_whole, measured, phase_of, system_on_sides
from asympk.symbolic.system import System

ROUNDED = 2.0**-48  # the relative error of a state that was computed in doubles
CANCELLED = 2.0**-10  # a sum, relative to its terms, below which the terms are not to be rounded one by one
EDGES = 3  # the largest number of edges through one state of which all choices of sides are tried
_NEVER = 3  # the rank of a side that the motion leaves by the law of this side


@dataclass(frozen=True)
class Automaton:
    """A system with exact numbers for its parameters, in the order of ``system.parameters``."""

    system: System
    values: tuple[Any, ...]

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.system, self.values))

    def __getstate__(self) -> dict:
        return {"system": self.system, "values": self.values}  # without the hash, another one in another process

    @classmethod
    def at(cls, system: System, values: tuple[Any, ...]) -> "Automaton":
        """Return the automaton of a system at numbers, those inside of powers and large angles in its formulas."""
        return cls(*with_numbers_inside(system, values))

    def mode(self, branch: Branch, digits: int | None = None, sides: Sides = ()) -> NumericMode:
        """Return a mode on doubles, or on mpmath numbers of ``digits`` digits."""
        return _numeric(self, branch, digits, sides)

    @lru_cache(maxsize=256)
    def coefficients(self, digits: int | None = None) -> dict[sp.Expr, Fraction]:
        """Return the values, right to ``digits`` digits or as doubles, of the coefficients that have one in doubles.

        Others, and those without a real value, which belong to other sides of a switch, stay in the formulas.
        """
        right_to = digits or DIGITS_OF_DOUBLES
        found = _cancelling(self, _scattered_over_contacts(self.system), right_to)
        for part in coefficients_of(self.system):
            with suppress(OutOfRange, TypeError):
                found |= exact_values(self.system, (part,), self.values, right_to)
        least, largest = sys.float_info.min, sys.float_info.max
        return {part: value for part, value in found.items() if not value or least <= abs(value) <= largest}

    def first(self, start: State, until: Any = 1, digits: int | None = None) -> Branch:
        """Return the branch that begins at t = 0 from exact numbers; raises ``NoMotion`` and ``TwoMotions``.

        If the system switches at t = 0, within the rounding of ``until``, the branch is that just after the switch. A
        start within the rounding of an edge, in doubles or in mpmath numbers of ``digits`` digits, is taken as on it.
        """
        with decide.finite(lambda: 0, lambda: decide.without_value(self.system, self.values, 0, start)):
            return _first(self, tuple(start), until if self.system.time else 1, digits)

    def motions(self, t: Any, start: State) -> dict[Branch, dict[sp.Symbol, Any]]:
        """Return every branch that may begin at exact numbers, and its forces: of a paradox, none or several.

        An edge that is left at a rate without forces has the side on which it is left, another its own law. Raises as
        ``decide.all_motions`` does.
        """
        return decide.all_motions(*self._exactly(t, start))

    def has_paradox(self, t: Any, start: State) -> bool:
        """Tell whether some loads leave no motion or several at exact numbers, as ``decide.has_paradox`` does."""
        return decide.has_paradox(*self._exactly(t, start))

    def _exactly(self, t: Any, start: State) -> tuple["Automaton", Any, State, Any]:
        """Return the automaton on the sides that a motion enters, time and state in many digits, and their error."""
        context = carrier_context(decide.DIGITS)
        slack, (t, *state) = context.mpf(10) ** -decide.EXACT, _exact((t, *start), context)
        clear, edges = self.sides_at(t, tuple(state), slack)
        if (sided := _on_sides(self, _sides_known(self, clear, edges, t, tuple(state), slack))) != self:
            return sided._exactly(t, tuple(state))
        return _on_sides(self, _beyond(edges, _choices_of_sides(self, edges)[0])), t, tuple(state), slack

    def of(self, system: System) -> "Automaton":
        """Return the automaton of another system, with no further parameters, at the same numbers."""
        numbers = dict(zip(self.system.parameters, self.values, strict=True))
        return Automaton(system, tuple(numbers[p] for p in system.parameters))

    def next(
        self, branch: Branch | None, hits: tuple[int, ...], t: Any, state: State, slack: Any = ROUNDED,
        sides: Sides = (),
    ) -> Branch:
        """Return the branch that follows ``branch``, whose guards ``hits`` vanish at ``state``.

        With ``branch`` None the branch before is unknown. ``slack`` is the relative error of the state: a sign that
        this error may change is decided by derivatives. ``sides`` are the sides of crossed edges on which the motion is
        shortly afterwards, whatever the rounding of the state.
        """
        sided = _on_sides(self, sides) if sides else self
        return _follow_on(sided, branch, _same(self, sided, branch, hits) if sides else hits, t, state, slack)

    def edges_at(self, t: Any, state: State, slack: Any) -> tuple[sp.Expr, ...]:
        """Return the phases that vanish at the state within the relative error ``slack``, u - n where u is whole."""
        return tuple(phase_of(edge.quantity)[0] for edge in self.sides_at(t, state, slack)[1])

    def sides_at(self, t: Any, state: State, slack: Any, known: Sides = ()) -> tuple[Sides, tuple[Edge, ...]]:
        """Return the clear sides of a state and the edges that it is on within ``slack``; nested ones on ``known``."""
        phases = tuple(p for p in phases_of(self.system) if p not in dict(known))
        edges = decide.nearest_edges(self, phases, t, state, slack)
        clear = tuple((edge.phase, edge.side(sign)) for edge, sign in edges if sign)
        if clear and is_nested(self.system):
            return _on_sides(self, clear).sides_at(t, state, slack, known + clear)
        return known + clear, tuple(edge for edge, sign in edges if not sign)


@lru_cache(maxsize=256)  # a scene is often followed by several methods
def _first(automaton: Automaton, start: State, until: Any, digits: int | None) -> Branch:
    context = carrier_context(decide.DIGITS)
    slack = context.mpf(10) ** -decide.EXACT
    still = automaton.mode((OPEN,) * len(automaton.system.frictions), decide.DIGITS)
    begun = still.after_start(end := in_context(context, until))
    near = BESIDE * (carrier_context(digits).eps if digits else sys.float_info.epsilon)
    follow = partial(_follow_on, automaton, None, (), state=_exact(start, context), slack=slack, near=near)
    if begun and (at := still.after_start(end, roots=False)) < begun:
        # beside the zero of a root states that grow faster are still 0, where its slope is finite
        with suppress(ArithmeticError, ValueError):
            return follow(t=at)
    return follow(t=begun)


def _follow_on(
    automaton: Automaton, before: Branch | None, hits: tuple[int, ...], t: Any, state: State, slack: Any, near: Any = 0
) -> Branch:
    """Return the branch that follows; if the state is on edges, by the law of the side into which the motion leads.

    An edge that the motion leaves at a rate without forces has only the side on which it is left (``_led_to``). Every
    choice of sides of the other edges, 0 for rest on the edge, is ranked by its own law (``_ranks``). If several
    branches share the best rank, or all choices are excluded, the law on the edges themselves decides. But where a law
    of an excluded choice leads into a side on which no motion or several follow, the error of that side is raised.
    The state is on an edge within the relative error ``slack``, or the larger one ``near``.
    """
    clear, edges = automaton.sides_at(t, state, max(slack, near))
    led = _sides_known(automaton, clear, edges, t, state, slack)
    if led and (sided := _on_sides(automaton, led)) != automaton:  # a load that would be 0 keeps its edge
        return _follow_on(sided, before, _same(automaton, sided, before, hits), t, state, slack, near)
    if not edges:
        return decide.follow_on(automaton, before, hits, t, state, slack)
    found, leads = dict[tuple[int, int], set[Branch]](), set[tuple[int, ...]]()
    refused: dict[tuple[int, ...], NoMotion | TwoMotions] = {}
    for choice in (choices := _choices_of_sides(automaton, edges)):
        sides = _beyond(edges, choice)
        try:
            branch = _by_law_of(automaton, sides, before, hits, t, state, slack)
            mode = automaton.mode(branch, decide.digits_of(state), sides)
            ranks = _ranks(mode, edges, choice, t, state, slack)
            if not any(ranks):
                return branch
            found.setdefault((max(ranks), sum(ranks)), set()).add(branch)
            leads.add(lead := tuple(mode.departure(edge.quantity, t, state, slack) for edge in edges))
            choices += [lead] if len(edges) > EDGES and lead not in choices else []
        except (NoMotion, TwoMotions) as error:
            refused[choice] = error
        except (Undecided, InputError):
            continue
    best = min(found, default=(_NEVER, 0))
    if best[0] < _NEVER and len(found[best]) == 1:
        return found[best].pop()
    if best[0] == _NEVER and (errors := [refused[side] for side in leads if side in refused]):
        raise errors[0]
    return _by_law_on_edges(automaton, edges, _beyond(edges, choices[0]), before, hits, t, state, slack)


def _by_law_on_edges(
    automaton: Automaton, edges: tuple[Edge, ...], sides: Sides, before: Branch | None, hits: tuple[int, ...], t: Any,
    state: State, slack: Any,
) -> Branch:
    """Return the branch that follows by the law on edges; raises ``NotDerivable`` where it does not hold there."""
    branch = _by_law_of(automaton, sides, before, hits, t, state, slack)
    if sides and not automaton.mode(branch, decide.digits_of(state), sides).holds(t, state, slack):
        raise no_side_entered([edge.quantity for edge in edges], t)
    return branch


def _sides_known(
    automaton: Automaton, clear: Sides, edges: tuple[Edge, ...], t: Any, state: State, slack: Any
) -> Sides:
    """Return the sides that the law to decide by is on: of edges led to, and of what turns or contains an edge."""
    if not {edge.phase for edge in edges} <= {*phases_of(automaton.system)}:
        return clear
    return (*turning(automaton.system, clear), *_led_to(automaton, edges, t, state, slack))


def _choices_of_sides(automaton: Automaton, edges: tuple[Edge, ...]) -> list[tuple[int, ...]]:
    """Return the choices of a side for every edge, 0 (on the edge) first; 0 is left out where u/|u| has no value.

    Of many edges 0 is the only choice, from which the motion leads on.
    """
    few = len(edges) <= EDGES
    choices: list[tuple[int, ...]] = [*product((0, 1, -1) if few else (0,), repeat=len(edges))]
    lawful = [choice for choice in choices if has_law(automaton.system, _beyond(edges, choice))]
    return lawful or (choices if few else [()])


def _beyond(edges: tuple[Edge, ...], choice: tuple[int, ...]) -> Sides:
    """Return the sides on which edges have the signs of a choice; none for the empty choice, of edges without a law."""
    return tuple((edge.phase, edge.side(sign)) for edge, sign in zip(edges, choice, strict=False))


def _ranks(mode: NumericMode, edges: tuple[Edge, ...], choice: tuple, t: Any, state: State, slack: Any) -> list[int]:
    """Return the rank of every edge; each is excluded where the mode moves but does not hold, as if it slips back.

    A sliding velocity that is set free on its edge 0 is on the side into which the mode slips.
    """
    slips = dict(mode.mode.slipping)
    ranks = [_rank(mode, edge.quantity, sign or slips.get(edge.phase, 0), t, state, slack)
             for edge, sign in zip(edges, choice, strict=False)]
    return ranks if not any(ranks) or mode.holds(t, state, slack) else [_NEVER]


def _rank(mode: NumericMode, phase: sp.Expr, side: int, t: Any, state: State, slack: Any) -> int:
    """Return 0 for rest on an edge by its own law, 1 for motion into the side, 2 for rest by the law of the side."""
    if mode.leaves(phase, side, t, state, slack):
        return int(side != 0)
    return 2 if mode.leaves(phase, 0, t, state, slack) else _NEVER


def _by_law_of(
    automaton: Automaton, sides: Sides, before: Branch | None, hits: tuple[int, ...], t: Any, state: State, slack: Any
) -> Branch:
    sided = _on_sides(automaton, sides)
    if before is not None and _torn_off(automaton, sided, before, hits, t, state, slack):
        return decide.follow_on(sided, None, (), t, state, slack)
    return decide.follow_on(sided, before, _same(automaton, sided, before, hits), t, state, slack)


def _torn_off(
    automaton: Automaton, sided: Automaton, before: Branch, hits: tuple[int, ...], t: Any, state: State, slack: Any
) -> bool:
    """Tell whether a sliding velocity that is 0 before an edge, as on a belt that jumps there, is not 0 on a side."""
    guards = mode_of(automaton.system, before).guards
    stopped = {guards[k].friction for k in hits if guards[k].kind == "velocity_zero"} | at_rest(before)
    pairs = [(automaton.system.frictions[k].velocity, sided.system.frictions[k].velocity) for k in sorted(stopped)]
    return any(decide.signs_at(sided, tuple(new for old, new in pairs if new != old), t, state, slack))


def _led_to(automaton: Automaton, edges: tuple[Edge, ...], t: Any, state: State, slack: Any) -> Sides:
    """Return the sides to which edges are left at a nonzero rate that contains neither forces nor switches."""
    system = automaton.system
    rates = {edge: rate_along(system, edge.quantity) for edge in edges}
    own = {edge: rate for edge, rate in rates.items()
           if not rate.free_symbols & {*system.pushes} and not is_switched(rate, (*system.states, system.time))}
    signs = decide.signs_at(automaton, tuple(own.values()), t, state, slack)
    return tuple((edge.phase, edge.side(sign)) for edge, sign in zip(own, signs, strict=True) if sign)


@lru_cache(maxsize=64)
def _on_sides(automaton: Automaton, sides: Sides) -> Automaton:
    if (system := system_on_sides(automaton.system, sides)) is automaton.system:
        return automaton
    return automaton.of(system)


def _same(automaton: Automaton, sided: Automaton, branch: Branch | None, hits: tuple[int, ...]) -> tuple[int, ...]:
    """Return the numbers of the guards ``hits`` among the guards on a side; a guard constant there is left out."""
    if branch is None:
        return ()
    there, guards = ([g.key for g in mode_of(own.system, branch).guards] for own in (sided, automaton))
    return tuple(there.index(guards[k]) for k in hits if guards[k] in there)


def mode_on_sides(
    automaton: Automaton, branch: Branch, digits: int | None, t: Any, state: State, crossed: Collection[sp.Expr],
    fixed: bool = False,
) -> NumericMode:
    """Return the mode of a branch on the sides that the motion enters; ``crossed`` are phases that vanish at the state.

    With ``fixed`` the mode is also put on sides of the phases of parameters and time alone. Raises ``NotDerivable``
    where the motion stays on a phase at which the rates jump, or where a rate has no value beyond it.
    """
    mode = automaton.mode(branch, digits)
    while opened := mode.mode.fixed_phases * fixed or mode.mode.open_phases:  # others may switch with fixed ones
        mode = _entered(automaton, mode, digits, opened, t, state, crossed)
    return mode


def _entered(
    automaton: Automaton, mode: NumericMode, digits: int | None, opened: tuple[sp.Expr, ...], t: Any, state: State,
    crossed: Collection[sp.Expr],
) -> NumericMode:
    """Return a mode on the sides of its phases ``opened`` into which the motion leads by the rates on these sides."""
    values = mode.values(tuple(map(measured, opened)), t, state)
    choices = [_choices(phase, value, mode, crossed) for phase, value in zip(opened, values, strict=True)]

    def chosen(choice: tuple) -> NumericMode:
        sides = (*mode.mode.sides, *((phase, side) for phase, (side, _) in zip(opened, choice, strict=True)))
        return automaton.mode(mode.branch, digits, sides)

    def led_to(choice: tuple) -> list[int]:
        found = chosen(choice)
        return [found.departure(measured(phase), t, state) if len(sides) > 1 and found.mode.is_finite else 0
                for phase, sides in zip(opened, choices, strict=True)]

    fitting, resting = [], []  # modes on sides that the motion enters; modes on sides by whose law it rests on an edge
    for choice in _likely_first(choices, led_to) if max(map(len, choices)) > 1 else product(*choices):
        found = chosen(choice)
        left = [(measured(phase), sign) for phase, (_, sign) in zip(opened, choice, strict=True) if sign is not None]
        if left and not found.mode.is_finite:  # u/|u| has no value on its edge
            continue
        if all(found.leaves(phase, sign, t, state) for phase, sign in left):
            if not left or found.holds(t, state):
                return found
            fitting.append(found)
        elif all(sign and sign * found.departure(phase, t, state) >= 0 for phase, sign in left):
            resting.append(found)
    if fitting or resting:
        return next((found for found in resting if found.holds(t, state)), (fitting or resting)[0])
    edges = [inside(phase, sides[1][0])[0] for phase, sides in zip(opened, choices, strict=True) if len(sides) > 1]
    bounded = all(chosen(choice).mode.is_finite for choice in product(*choices) if all(side for side, _ in choice))
    raise no_side_entered(edges, t, bounded)


def no_side_entered(edges: Collection[sp.Expr], t: Any, bounded: bool = True) -> NotDerivable:
    """Return the error of a motion that enters no side of some edges; if not ``bounded``, a side has no rates."""
    where = ", ".join(f"{_in_few_digits(edge)!s:.120} = 0" for edge in edges)
    if not bounded:
        return NotDerivable(f"the motion reaches {where} at t = {float(t):.6g}, beyond which a rate has no value; end "
                            "its Piecewise with a piece that always holds")
    return NotDerivable(f"the motion stays on {where} from t = {float(t):.6g} on, where the rates jump; write what "
                        "jumps there as a friction, or smooth it by tanh")


def _in_few_digits(edge: sp.Expr) -> sp.Basic:
    """Return an expression for a message, in which whole numbers of more digits than a double has are rounded."""
    return replaced(edge, {n: sp.Float(n, 6) for n in atoms(edge, sp.Integer) if abs(n) > sys.maxsize})


def _likely_first(choices: list, led_to: Callable[[tuple], list[int]]) -> Iterator[tuple]:
    """Yield all choices of sides, beginning with the chain in which each choice is that to which the last one leads."""
    seen: list[tuple] = []
    choice = tuple(sides[0] for sides in choices)
    while choice not in seen:
        yield choice
        seen.append(choice)
        signs = zip(choices, led_to(choice), strict=True)
        choice = tuple(next((side for side in sides if side[1] == sign), sides[0]) for sides, sign in signs)
    yield from (choice for choice in product(*choices) if choice not in seen)


def _choices(
    phase: sp.Expr, value: Any, mode: NumericMode, crossed: Collection[sp.Expr]
) -> list[tuple[int, int | None]]:
    """Return (side, sign of the phase beyond its edge) for all sides that may follow; the sign is None off an edge."""
    number, floor = measured(phase), mode.functions.floor
    whole = is_whole(phase)
    edge = int(floor(value + 0.5)) if whole else 0
    if value == edge or phase_of(number - edge)[0] in crossed:
        return [(edge, 0), (edge, 1), (edge - 1, -1)] if whole else [(0, 0), (1, 1), (-1, -1)]
    return [(int(floor(value)) if whole else sign_of(value), None)]


@lru_cache(maxsize=512)
def _numeric(automaton: Automaton, branch: Branch, digits: int | None, sides: Sides) -> NumericMode:
    mode = mode_of(automaton.system, branch, sides)
    known = _cancelling(automaton, mode.scattered, digits or DIGITS_OF_DOUBLES) | automaton.coefficients(digits)
    values = (*automaton.values, *known.values())
    if digits is None:
        return NumericMode(mode, tuple(map(float, values)), "math", math, (*known,))
    context = carrier_context(digits)
    return NumericMode(mode, _exact(values, context), "mpmath", context, (*known,))


@lru_cache(maxsize=64)
def _scattered_over_contacts(system: System) -> tuple[sp.Expr, ...]:
    return scattered(system, contact_formulas(system)[0])


def _cancelling(automaton: Automaton, parts: tuple[sp.Expr, ...], digits: int) -> dict[sp.Expr, Fraction]:
    """Return the values, right to ``digits`` digits, of those scattered coefficients whose terms cancel."""
    system, found = automaton.system, list[sp.Expr]()
    with suppress(ArithmeticError, ValueError):
        terms = function(system, (*chain(*(part.args for part in parts)),), "math", math)
        numbers = iter(terms(*[0.0] * (1 + len(system.states)), *map(float, automaton.values)))
        for part in parts:
            own = [next(numbers) for _ in part.args]
            found += [part] if abs(sum(own)) < CANCELLED * max(map(abs, own)) else []
    return exact_values(system, (*found,), automaton.values, digits)


def _exact(values: State, context: Any) -> State:
    return tuple(in_context(context, v) for v in values)
