"""Regions of a switching plane: conditions on load or states and parameters, and the intervals of loads they mean."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import sympy as sp

from asympk.errors import InputError, NotDerivable
from asympk.formulas import formula_in_words
from asympk.numbers import short
from asympk.shown import Card, ShownAsFormulas, latex_of
from asympk.symbolic.conditions import assumed_range
from asympk.symbolic.truth import as_arrays, holds, require_relations, with_default
from asympk.symbolic.values import as_exact, by_symbol, in_words, is_exact


@dataclass(frozen=True)
class Span:
    """An interval of loads with symbolic ends."""

    start: sp.Expr
    end: sp.Expr
    closed_start: bool
    closed_end: bool

    def as_set(self) -> sp.Set:
        """Return the interval as a SymPy set."""
        return sp.Interval(self.start, self.end, not self.closed_start, not self.closed_end)

    @property
    def in_words(self) -> str:
        """The interval as text, such as ``[1/4, oo)``."""
        return f"{'[' if self.closed_start else '('}{self.start}, {self.end}{']' if self.closed_end else ')'}"


@dataclass(frozen=True)
class RegionCell:
    """One cell of the parameters: where ``condition`` holds, the region is the union of ``spans``."""

    condition: sp.Basic
    spans: tuple[Span, ...]

    def put(self, meaning: Mapping) -> "RegionCell":
        """Return the cell with expressions in place of symbols."""
        spans = (replace(s, start=s.start.xreplace(meaning), end=s.end.xreplace(meaning)) for s in self.spans)
        return RegionCell(self.condition.xreplace(meaning), tuple(spans))

    @cached_property
    def box(self) -> sp.Dict:
        """The range of every parameter that a relation of the condition restricts on its own."""
        parts = sp.And.make_args(self.condition)
        alone = {next(iter(p.free_symbols)) for p in parts if len(p.free_symbols) == 1}
        return sp.Dict({parameter: assumed_range(parameter, self.condition) for parameter in sorted(alone, key=str)})


@dataclass(frozen=True)
class Plane:
    """The plane on which the velocity vanishes, and the variables in which its regions are given.

    ``load`` is the load in the states. ``symbol`` stands for the load where the load replaces one of the states, and is
    None otherwise; ``alone`` says that the regions depend on no other state. ``allowed`` is the condition on the
    parameters. ``default`` maps a parameter of static friction to the value at which static equals kinetic friction.
    """

    states: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    load: sp.Expr
    symbol: sp.Symbol | None
    alone: bool
    allowed: sp.Basic
    default: sp.Dict

    def values(self, at: Any, values: Mapping | None, named: dict) -> dict:
        """Return place and parameters as {symbol: value as given}; raises ``InputError`` for an unknown name."""
        given = by_symbol({**(values or {}), **named}, self.parameters, "this system")
        if isinstance(at, Mapping | sp.Dict):
            return given | by_symbol(at, self.states, "this system", "state")
        if not self.alone:
            states = ", ".join(f"{s.name!r}: .." for s in self.states)
            raise InputError(f"{short(at)} is no place: the region depends on more than the load; give {{{states}}}")
        return given | {self.symbol: at}


@dataclass(frozen=True, repr=False)
class Region(ShownAsFormulas):
    """A part of the switching plane: where ``condition`` holds, a relation in load (or states) and parameters.

    Where the drive is linear in the load, ``cells`` give the condition as spans of the load, for each cell of the
    parameters and of the other states; otherwise ``cells`` is empty.
    """

    name: str
    condition: sp.Basic
    plane: Plane = field(repr=False)
    cells: tuple[RegionCell, ...] = field(default=(), repr=False)

    @property
    def load(self) -> sp.Symbol | None:
        """The symbol that stands for the load, or None where the load replaces no state."""
        return self.plane.symbol

    def contains(self, at: Any, values: Mapping | None = None, /, **named: Any) -> Any:
        """Tell whether a place on the plane is in the region: a load, or a mapping of the states; arrays broadcast.

        Parameters are given by name, or in a mapping by name or symbol. Parameters that the region does not depend on
        may be left out; without the parameter of static friction, static equals kinetic friction. Integers, fractions,
        decimals and strings ("1/4") are compared exactly, floats as doubles. Raises ``InputError`` for a value that is
        missing, not a number, or outside the assumptions.

        >>> import asympk as ap
        >>> stick = ap.stick_regions(ap.systems.painleve_klein.system()).stick
        >>> [stick.contains(s, sigma=1) for s in ("1/5", "1/4", 0, "-1/2")]
        [False, True, False, True]
        >>> stick.contains({"x": "1/8", "y": "1/8"}, sigma=1)
        True
        """
        given = self.plane.values(at, values, named)
        needed, default = self.condition.free_symbols, dict(self.plane.default)
        if self.load in needed - given.keys():
            needed = needed - {self.load} | self.plane.load.free_symbols
            default |= {self.load: self.plane.load}
        wanted = self.condition.free_symbols | self.plane.allowed.free_symbols & given.keys()
        if all(is_exact(value) for value in given.values()):
            numbers = {s: as_exact(v, s) for s, v in given.items()}
        else:
            numbers = as_arrays(given)
        known = with_default(numbers, wanted, default)
        require_relations(self.plane.allowed, known)
        if missing := needed - known.keys():
            raise InputError(f"{in_words(missing)} is missing; the region {self.name!r} depends on {in_words(needed)}")
        return holds(self.condition, known)

    def spans(self, values: Mapping | None = None, /, **named: Any) -> tuple[Span, ...]:
        """Return the spans, with symbolic ends, of the cell that holds the parameters, given as in ``contains``.

        Where the cells depend on further states, the values of these are given with the parameters. Raises
        ``NotDerivable`` where the region is no union of spans, ``InputError`` for a missing or forbidden value.
        """
        if not self.cells:
            raise NotDerivable(f"{self.name}: {formula_in_words(self.condition)} is no union of intervals of the load; "
                               "ask contains")
        symbols = self.plane.parameters if self.plane.alone else (*self.plane.parameters, *self.plane.states)
        given = by_symbol({**(values or {}), **named}, symbols, "this system")
        wanted = set().union(*(cell.condition.free_symbols for cell in self.cells))
        known = with_default({s: as_exact(v, s) for s, v in given.items()}, wanted, self.plane.default)
        require_relations(self.plane.allowed, known)
        for cell in self.cells:
            if cell.condition.subs(known) == sp.true:
                return cell.spans
        raise InputError(f"{self.name}: {in_words(wanted - known.keys())} is missing; the spans depend on it")

    @property
    def _shown(self) -> tuple[RegionCell, ...]:
        """The cells if they depend on the parameters alone; otherwise none, as the condition is then easier to read."""
        return self.cells if self.plane.alone else ()

    def latex(self) -> str:
        """Return the region as LaTeX, one line for each cell of the parameters, or as its condition."""
        if not self._shown:
            return latex_of(self.condition)
        lines = [rf"{latex_union(cell.spans)} & {_latex_condition(cell.condition)}" for cell in self._shown]
        return r"\begin{cases} " + r" \\ ".join(lines) + r" \end{cases}"

    def __str__(self) -> str:
        parts = (spans_in_words(cell.spans) + f" for {formula_in_words(cell.condition)}" * (cell.condition != sp.true)
                 for cell in self._shown if cell.spans)
        return "; ".join(parts) or (formula_in_words(self.condition) if not self._shown else "nowhere")

    def _card(self) -> Card:
        rows = [(formula_in_words(cell.condition), spans_in_words(cell.spans)) for cell in self._shown]
        rows = rows or [("where", self.condition)]
        return Card(f"Region {self.name}, load {self.plane.load}", tuple(rows))

    def _latex(self, printer: Any, **options: Any) -> str:
        return self.latex()


def spans_in_words(spans: tuple[Span, ...]) -> str:
    """Return a union of spans as text."""
    return " u ".join(span.in_words for span in spans) or "nowhere"


def latex_union(spans: tuple[Span, ...]) -> str:
    """Return a union of spans as LaTeX."""
    return r" \cup ".join(latex_of(span.as_set()) for span in spans) or r"\emptyset"


def _latex_condition(condition):
    relations = sorted(sp.And.make_args(condition), key=sp.default_sort_key)
    return r",\ ".join(latex_of(relation) for relation in relations)
