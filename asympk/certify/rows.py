r"""Linear forms of an affine mode as rows with exact entries, and their signs at an enclosed state.

A row ``r`` stands for the quantity ``r . (w, 1)``, where w are the states and the waves of the forcing. Its entries are
Fractions, or rational functions of the parameters that range over intervals. A part of an entry that is not rational in
these parameters, such as pi or a root, counts as one more parameter, which ranges over the ball of this part. A linear
combination of rows that vanish vanishes, too (Lemma 13).

``ExactEntries`` makes the entries, and ``ExactEntries.spectrum`` is the hard function. ``leading_sign`` finds the sign
of a row shortly after a state.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from math import lcm, prod
from typing import Any

import numpy as np
import sympy as sp
from sympy.polys.matrices import DomainMatrix
from sympy.polys.polyclasses import ANP

from asympk.affine.form import Form
from asympk.automaton.exact import is_rational
from asympk.certify.balls import Ball, Refused, ball, ball_of, certain_sign, flint, hull
from asympk.certify.families import Family, constant
from asympk.certify.spectrum import Spectrum, core_of, of_balls, of_exact, seen_in
from asympk.formulas import NOT_FINITE
from asympk.numbers import Number
from asympk.symbolic.long import replaced
from asympk.symbolic.sides import is_whole, measured, on_sides, phases
from asympk.symbolic.system import System

Row = tuple[Any, ...]
_LARGEST = sp.Max, sp.Min
_MOST_DEGREE = 8  # of a field of surds


class ExactEntries:
    """The exact entries of modes: Fractions, or rational functions of the parameters that range over intervals.

    ``entries`` are all that will be asked for: every part of them that is not rational in the parameters becomes a
    symbol, which ranges over the ball of this part.
    """

    def __init__(
        self, system: System, values: tuple[Number, ...], sides: Mapping[str, tuple[Number, Number]],
        entries: Iterable[sp.Expr],
    ):
        named, self.sides = dict(zip(system.parameters, values, strict=True)), sides
        middles = {name: (Fraction(low) + Fraction(high)) / 2 for name, (low, high) in sides.items()}
        self.spans = tuple(hull(*(end - middles[name] for end in ends)) for name, ends in sides.items())
        self.numbers = {s: sp.Symbol(s.name, real=True, positive=s.is_positive) if s.name in sides
                        else sp.Rational(Fraction(v)) for s, v in named.items()}
        self._symbols = {self.numbers[s]: self.side(s.name) for s in named if s.name in sides}
        placed = (self._placed(entry) for entry in entries if not is_rational(entry) or entry.has(*_LARGEST))
        self.ranging = {atom: sp.Dummy() for atom in sorted({a for e in placed for a in _irrational(e)}, key=str)}
        self._symbols |= {symbol: self._family_of(atom) for atom, symbol in self.ranging.items()}
        self._varying = {symbol for atom, symbol in self.ranging.items() if atom.free_symbols}
        self.field = sp.QQ.frac_field(*self._symbols) if self._symbols else None
        self._known: dict[Any, Family] = {}
        self._exact: dict[sp.Expr, Any] = {}

    def side(self, name: str) -> Family:
        """Return a coordinate of the box."""
        low, high = (Fraction(end) for end in self.sides[name])
        slopes = (ball(int(name == other)) for other in self.sides)
        return self._family(hull(low, high), ball((low + high) / 2), *slopes)

    def _whole(self):
        """Return {symbol: its ball over the whole box}."""
        return {s: family.whole[0, 0].real for s, family in self._symbols.items()}

    def _family(self, *parts):
        return Family((flint().acb_mat([[part]]) for part in parts), self.spans).tight()

    def _family_of(self, expr):
        """Return an expression in symbols that range; from the centre they move one by one, the last one first."""
        numbers = [{s: f.parts[k][0, 0].real for s, f in self._symbols.items()} for k in range(2 if self.spans else 1)]
        found = [ball_of(expr, at) for at in numbers]  # refuses what has no enclosure before a slope is asked for
        at, rates = {**numbers[0]}, list[tuple[Ball, Family]]()
        for s, f in self._symbols.items() if self.spans else ():
            rates += [(ball_of(sp.diff(expr, s), at), f)] if s in expr.free_symbols else []
            at[s] = numbers[1][s]
        slopes = (sum((r * f.parts[k][0, 0] for r, f in rates), ball(0)) for k in range(2, 2 + len(self.spans)))
        return self._family(*found, *slopes)

    def _placed(self, expr: sp.Expr) -> sp.Expr:
        expr = expr.subs(self.numbers)
        if expr.has(*NOT_FINITE):
            raise Refused("edge: a coefficient or a reaction is not finite at these parameters")
        expr = self._sided(expr)
        expr = expr.rewrite(sp.Abs) if expr.has(*_LARGEST) else expr
        # sine and cosine of a number are rational in one part, which makes the sum of their squares 1
        turned = (e for e in expr.atoms(sp.sin, sp.cos) if not e.free_symbols)
        return expr.xreplace({e: e.rewrite(sp.tan) for e in turned})

    def _sided(self, expr):
        """Return an expression on those sides of its switches on which the whole box certainly lies."""
        at = self._whole()
        found = ((phase, _side(phase, ball_of(measured(phase), at))) for phase in phases([expr], at))
        sided = on_sides(expr, tuple((phase, side) for phase, side in found if side is not None))
        return sided if sided == expr else self._sided(sided)

    def exact(self, expr: sp.Expr) -> Any:
        """Return an expression in the parameters as an exact entry; raises ``Refused`` if not made of known parts."""
        if expr not in self._exact:
            placed = replaced(self._placed(expr), self.ranging)
            if placed.free_symbols - self._symbols.keys() or not is_rational(placed):
                raise Refused(f"irrational: {expr!s:.80} is not made of the parts of the rates and guards")
            exact = self.field.from_sympy(placed) if self.field else Fraction(int(placed.p), int(placed.q))
            self._exact[expr] = exact
        return self._exact[expr]

    def expression(self, entry: Any) -> sp.Expr:
        """Return an exact entry as an expression."""
        if isinstance(entry, ANP):
            return self._surds[0].to_sympy(entry)
        return sp.Rational(entry) if isinstance(entry, int | Fraction) else entry.as_expr()

    @cached_property
    def _surds(self) -> tuple[Any, dict[sp.Symbol, ANP]]:
        """The field of the roots of rational numbers among the parts, None for none or a large one, and these in it."""
        found = {symbol: atom for atom, symbol in self.ranging.items()
                 if atom.is_Pow and atom.base.is_Rational and atom.exp.is_Rational}
        bases = {atom.base for atom in found.values()}
        degrees = (lcm(*(atom.exp.q for atom in found.values() if atom.base == base)) for base in bases)
        if not found or prod(degrees) > _MOST_DEGREE:
            return None, {}
        field = sp.QQ.algebraic_field(*found.values())
        return field, {symbol: field.from_sympy(atom) for symbol, atom in found.items()}

    def in_surds(self, entries: Sequence[Any]) -> list[Any]:
        """Return exact entries in the field of the surds if all are made of them: only what vanishes is 0 there."""
        field, surds = self._surds
        if not self.field or not field or not all(self.expression(e).free_symbols <= surds.keys() for e in entries):
            return [entry * Fraction(1) for entry in entries]

        def placed(part: Any) -> ANP:
            terms = ((field.convert(c), zip(part.ring.symbols, powers, strict=True)) for powers, c in part.terms())
            return sum((prod((surds[s] ** k for s, k in powers if k), start=c) for c, powers in terms), field.zero)

        moved = map(self.field.convert, entries)
        return [placed(entry.numer) / placed(entry.denom) for entry in moved]

    def ball(self, entry: Any) -> Ball:
        """Return an exact entry as a ball."""
        return self._entry(entry).whole[0, 0].real

    def family(self, rows: Iterable[Iterable[Any]]) -> Family:
        """Return the matrix of rows of exact entries."""
        found = [[self._entry(entry).parts for entry in row] for row in rows]
        parts = range(2 + len(self.spans) if self.spans else 1)
        return Family((flint().acb_mat([[e[k][0, 0] for e in row] for row in found]) for k in parts), self.spans)

    def _entry(self, entry):
        if entry not in self._known:
            number = isinstance(entry, int | Fraction)
            found = constant(flint().acb_mat([[ball(entry)]]), self.spans) if number else None
            self._known[entry] = found or self._family_of(self.expression(entry))
        return self._known[entry]

    def vanishes(self, entry: Any) -> bool:
        """Tell whether an exact entry is known to be 0, also by powers of its parts that are not rational."""
        if not entry or isinstance(entry, int | Fraction | ANP) or certain_sign(self.ball(entry)):
            return not entry
        parts = {symbol: atom for atom, symbol in self.ranging.items()}
        return sp.expand(replaced(entry.numer.as_expr(), parts)) == 0

    def is_constant(self, entry: Any) -> bool:
        """Tell whether an exact entry is the same all over the box."""
        return self.expression(entry).free_symbols <= {*self.ranging.values()} - self._varying

    def matrix(self, form: Form) -> tuple[tuple, ...]:
        """Return the rows of the matrix M of a form: ``(w, 1)' = M (w, 1)``."""
        return *(tuple(map(self.exact, row)) for row in form.matrix), (self.exact(sp.S.Zero),) * (len(form.matrix) + 1)

    def is_negative(self, entries: Iterable[Any]) -> bool:
        """Tell whether one of the entries is certainly negative."""
        return any(certain_sign(self.ball(entry)) < 0 for entry in entries)

    def require_least_at_corners(self, quantities: Iterable[sp.Expr]) -> None:
        """Raise ``Refused`` unless, on the box, quantities are monotone in every parameter, or positive."""
        at = self._whole()
        ends = {s: [sp.Rational(Fraction(end)) for end in self.sides[s.name]] for s in at if s.name in self.sides}
        moved = {s: low + sp.Dummy(nonnegative=True) if low >= 0 else high - sp.Dummy(nonnegative=True)
                 for s, (low, high) in ends.items() if low * high >= 0}

        def never_falls(slope: sp.Expr) -> bool:
            return slope.subs(moved).is_nonnegative or ball_of(slope, at) >= 0

        for given, placed in ((q, self._placed(q)) for q in quantities):
            slopes = (sp.diff(placed, s) for s in placed.free_symbols)
            if not (all(never_falls(slope) or never_falls(-slope) for slope in slopes) or ball_of(placed, at) > 0):
                raise Refused(f"box: {given!s:.80} may be negative inside, though it is not so at the corners")

    def spectrum(self, matrix: tuple[tuple[Any, ...], ...], until: Number) -> Spectrum:
        """Return the groups of eigenvalues of a matrix, for times up to ``until``; see the module ``spectrum``."""
        if not self.field:
            return of_exact(matrix, self.spans)
        basis, moved, inverse = self._with_invariants(matrix)
        scales = [reduce(lambda a, b: a.lcm(b), (entry.denom for entry in row)) for row in moved]
        scaled = [[entry * scale for entry in row] for row, scale in zip(moved, scales, strict=True)]
        families = map(self.family, (moved, scaled, [scales]))
        found = of_balls(_pattern(moved), ball(until), *families)
        return seen_in(self.family(basis), found, self.family(inverse))

    def _with_invariants(self, matrix: tuple[tuple[Any, ...], ...]) -> list[list[list[Any]]]:
        """Return T, ``T M T^-1`` and ``T^-1``, where T replaces states of the core of M by invariants.

        The eigenvalue 0 of an invariant, a row r with ``r M = 0``, then shows in the zero entries of ``T M T^-1``.
        """
        moved = DomainMatrix([[*row] for row in matrix], (len(matrix),) * 2, self.field)
        basis = DomainMatrix.eye(moved.shape, self.field).to_dense()
        while found := self._invariant(moved):
            place, row = found
            change = DomainMatrix.eye(moved.shape, self.field).to_list()
            change[place] = row
            step = DomainMatrix(change, moved.shape, self.field)
            basis, moved = step * basis, step * moved * step.inv()
        return [m.to_list() for m in (basis, moved, basis.inv())]

    def _invariant(self, matrix: DomainMatrix) -> tuple[int, list[Any]] | None:
        """Return (place of an entry that is certainly not 0, row r) with ``r M = 0`` in the core of M, or None."""
        core = core_of(_pattern(matrix.to_list()))[0]
        for found in matrix.extract(core, core).transpose().nullspace().to_list() if core else ():
            entries = dict(zip(core, found, strict=True))
            for place, entry in entries.items():
                if entry and certain_sign(self.ball(entry)):
                    return place, [entries.get(k, matrix.domain.zero) for k in range(matrix.shape[0])]
        return None


def _pattern(matrix: Iterable[Iterable[Any]]) -> np.ndarray:
    return np.array([[bool(entry) for entry in row] for row in matrix])


def _side(phase, value):
    """Return the side of a phase on which it has a value, or None where it is not certain."""
    if not is_whole(phase):
        return certain_sign(value) or None
    whole = value.floor().unique_fmpz()
    return None if whole is None else int(whole)


def _irrational(expr: sp.Expr) -> Iterator[sp.Expr]:
    """Yield the largest parts of an expression that are not rational functions."""
    if expr.is_Add or expr.is_Mul or (expr.is_Pow and expr.exp.is_Integer):
        for part in expr.args:
            yield from _irrational(part)
    elif not is_rational(expr):
        yield expr


@dataclass(frozen=True, eq=False)
class EnclosedState:
    """The family of (w, 1), its exact entries where known (else None), and rows ``null`` that vanish at this state.

    ``time`` is the exact time of the state where known, else None.
    """

    family: Family
    exact: tuple
    field: ExactEntries
    null: tuple = ()
    time: Fraction | None = None

    @property
    def balls(self) -> list[Ball]:
        """The states of all points of the box."""
        return self.family.whole.real.entries()

    @cached_property
    def vanishing(self) -> list[tuple[int, Row]]:
        """The rows ``null`` in echelon form."""
        return _echelon(self.null, self.field, range(len(self.exact)))

    @cached_property
    def unsharp(self) -> list[tuple[int, Row]]:
        """The rows ``null`` in echelon form, the states that are known least first."""
        known = self.balls
        return _echelon(self.null, self.field, sorted(range(len(known)), key=lambda k: -float(known[k].rad())))


def leading_sign(row: Row, matrix: tuple[Row, ...], state: EnclosedState) -> int | None:
    """Return the sign of a row just after a state, from its first nonvanishing derivative.

    0 means that all derivatives vanish exactly, None that the sign is not certain.
    """
    return leading(row, matrix, state)[1]


def leading(row: Row, matrix: tuple[Row, ...], state: EnclosedState) -> tuple[int, int | None]:
    """Return the number of derivatives of a row that vanish at a state, the row included, and its ``leading_sign``."""
    for zeros in range(len(matrix) + 1):
        if (sign := sign_at(row, state)) != 0:
            return zeros, sign
        row = row_rate(row, matrix)
    return len(matrix) + 1, 0


def sign_at(row: Row, state: EnclosedState) -> int | None:
    """Return the sign of ``row . (w, 1)``: 0 only if the product vanishes exactly, None if the sign is not certain."""
    if all(w is not None for c, w in zip(row, state.exact, strict=True) if c):
        value = sum(c * w for c, w in zip(row, state.exact, strict=True) if c)
        if isinstance(value, int | Fraction):
            return (value > 0) - (value < 0)
        return (certain_sign(state.field.ball(value)) or None) if value else 0
    if not any(_reduced(row, state.vanishing)):
        return 0
    return certain_sign(ball_at(row, state)) or certain_sign(ball_at(sharpened(row, state), state)) or None


def exact_value(row: Row, state: EnclosedState) -> Any:
    """Return the exact value of a row at a state, or None where it is not known; what vanishes there is taken off."""
    for found in (row, sharpened(row, state)):
        if all(w is not None for c, w in zip(found, state.exact, strict=True) if c):
            return sum(c * w for c, w in zip(found, state.exact, strict=True) if c)
    return None


def ball_at(row: Row, state: EnclosedState) -> Ball:
    """Return ``row . (w, 1)`` as a ball."""
    (found,) = (state.field.family([row]) * state.family).numbers()
    return found


def row_rate(row: Row, matrix: tuple[Row, ...]) -> Row:
    """Return the row of the time derivative of a row, ``r M``, where the state moves by ``(w, 1)' = M (w, 1)``."""
    found = [0] * len(row)
    for c, rates in zip(row, matrix, strict=True):
        found = [total + c * m if m else total for total, m in zip(found, rates, strict=True)] if c else found
    return tuple(found)


def spanned(row: Row, rows: Iterable[Row], field: ExactEntries) -> bool:
    """Tell whether a row is a linear combination of others all over the box, in exact arithmetic (Lemma 13)."""
    return not any(_reduced(row, _echelon(rows, field, range(len(row)))))


def is_multiple(row: Row, other: Row, rows: Iterable[Row], field: ExactEntries) -> bool:
    """Tell whether a row is a positive multiple of another all over the box, where ``rows`` vanish (Lemma 13)."""
    found = quotient(row, other, rows, field)
    return found is not None and certain_sign(field.ball(found)) > 0


def quotient(row: Row, other: Row, rows: Iterable[Row], field: ExactEntries) -> Any:
    """Return the factor by which a row is a multiple of another all over the box, where ``rows`` vanish, or None."""
    basis = _echelon(rows, field, range(len(row)))
    row, other = _reduced(row, basis), _reduced(other, basis)
    place = next((k for k, c in enumerate(other) if c and certain_sign(field.ball(c))), None)
    return None if place is None or any(_reduced(row, [(place, other)])) else row[place] / other[place]


def sharpened(row: Row, state: EnclosedState) -> Row:
    """Return a row of the same value at a state: the rows that vanish there take away what is known least."""
    found = _reduced(row, state.unsharp)
    return found if all(state.field.ball(c).is_finite() for c in found) else row


def _echelon(rows, field, rank):
    """Return pairs (place, row): rows with an entry that is nowhere 0, the first by ``rank``, reduced in turn."""
    basis: list[tuple[int, Row]] = []
    for other in rows:
        other = _reduced(other, basis)
        place = next((k for k in rank if other[k] and certain_sign(field.ball(other[k]))), None)
        basis += [] if place is None else [(place, other)]
    return basis


def _reduced(row, basis):
    for place, other in basis:
        if row[place]:
            factor = row[place] / other[place]
            row = tuple(a - factor * b if b else a for a, b in zip(row, other, strict=True))
    return row
