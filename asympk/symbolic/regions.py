"""Regions of the switching plane: unions of intervals of the load, cell by cell of the friction parameters."""

from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from asympk.errors import InputError
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic.conditions import between
from asympk.symbolic.lowering import lower


@dataclass(frozen=True)
class Span:
    """An interval of loads with symbolic ends."""

    start: sp.Expr
    end: sp.Expr
    closed_start: bool
    closed_end: bool

    def as_set(self):
        """Return the interval as a SymPy set."""
        return sp.Interval(self.start, self.end, not self.closed_start, not self.closed_end)

    @property
    def told(self) -> str:
        """The interval as text, such as ``[1/4, oo)``."""
        return f"{'[' if self.closed_start else '('}{self.start}, {self.end}{']' if self.closed_end else ')'}"

    def covers(self, load, start, end):
        """Compare a load, or an array of loads, with the ends at given parameters."""
        above = load >= start if self.closed_start else load > start
        below = load <= end if self.closed_end else load < end
        return above & below


@dataclass(frozen=True)
class Cell:
    """What a region is on one cell of the parameters; ``box`` gives each parameter's interval, or its single value."""

    box: sp.Dict
    spans: tuple[Span, ...]

    @property
    def condition(self):
        """The cell as relations on the parameters."""
        return sp.And(*(between(parameter, part) for parameter, part in self.box.items()))


@dataclass(frozen=True, repr=False)
class Region(ShownAsFormulas):
    """A part of the switching plane: one union of spans of the load for each cell of the parameters."""

    name: str
    load: sp.Symbol
    kinetic: sp.Symbol
    static: sp.Symbol
    cells: tuple[Cell, ...]

    def contains(self, s, *, sigma, sigma0=None):
        """Tell whether the load ``s`` is in the region; ``sigma0`` is ``sigma`` by default; arrays broadcast.

        Integers, fractions and strings ("1/4") are compared exactly, floats as doubles. Raises ``InputError`` for
        a value that is not a number, sigma <= -2 or sigma0 < sigma.

        >>> import asympk as ap
        >>> stick = ap.stick_regions(ap.systems.painleve_klein.system()).stick
        >>> [stick.contains(s, sigma=1) for s in ("1/5", "1/4", 0, "-1/2")]
        [False, True, False, True]
        """
        sigma0 = sigma if sigma0 is None else sigma0
        if all(isinstance(value, (int, str, Fraction, sp.Rational)) for value in (s, sigma, sigma0)):
            return self._contains_exactly(*map(_exact, (s, sigma, sigma0), ("s", "sigma", "sigma0")))
        return self._contains_floats(s, sigma, sigma0)

    def spans(self, *, sigma, sigma0=None):
        """Return the spans, with symbolic ends, of the cell that holds the parameters."""
        sigma = _exact(sigma, "sigma")
        return self._cell(sigma, sigma if sigma0 is None else _exact(sigma0, "sigma0")).spans

    def latex(self):
        """Return the region as LaTeX, one line for each cell of the parameters."""
        lines = [rf"{_latex_union(cell.spans)} & {_latex_condition(cell.condition)}" for cell in self.cells]
        return r"\begin{cases} " + r" \\ ".join(lines) + r" \end{cases}"

    def __str__(self) -> str:
        told = (f"{_text_union(cell.spans)} for {cell.condition}" for cell in self.cells if cell.spans)
        return "; ".join(told) or "nowhere"

    def _card(self) -> Card:
        rows = ((str(cell.condition), _text_union(cell.spans)) for cell in self.cells)
        return Card(f"Region {self.name}, by the load {self.load}", tuple(rows))

    def _latex(self, printer, **options) -> str:
        return self.latex()

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {self.latex()}$"

    def _cell(self, sigma, sigma0):
        values = {self.kinetic: sigma, self.static: sigma0}
        _check_parameters(sigma, sigma0, self.cells)
        return next(c for c in self.cells if all(values[p] in part for p, part in c.box.items()))

    def _contains_exactly(self, s, sigma, sigma0):
        values = {self.kinetic: sigma, self.static: sigma0}
        spans = self._cell(sigma, sigma0).spans
        return any(bool(span.covers(s, span.start.subs(values), span.end.subs(values))) for span in spans)

    def _contains_floats(self, s, sigma, sigma0):
        import numpy as np

        arrays = (_floats(s, "s"), _floats(sigma, "sigma"), _floats(sigma0, "sigma0"))
        try:
            load, kinetic, static = np.broadcast_arrays(*arrays)
        except ValueError as error:
            raise InputError(f"s, sigma and sigma0 do not broadcast: {error}") from None
        _check_parameters(kinetic, static, self.cells)
        inside = np.zeros(load.shape, dtype=bool)
        for cell in self.cells:
            given = {self.kinetic: kinetic, self.static: static}
            here = np.all([_within(given[p], part) for p, part in cell.box.items()], axis=0)
            for span in cell.spans:
                start, end = (_ends(end, self, kinetic[here], static[here]) for end in (span.start, span.end))
                inside[here] |= span.covers(load[here], start, end)
        return inside if inside.ndim else bool(inside)


def _exact(value, name):
    try:
        return sp.Rational(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {value!r} is not a number") from None


def _floats(value, name):
    import numpy as np

    try:
        return np.asarray(float(_exact(value, name)) if isinstance(value, str) else value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {value!r} is not a number or an array of numbers") from None


def _check_parameters(sigma, sigma0, cells):
    import numpy as np

    least = min(part.inf for cell in cells for part in cell.box.values())
    checks = (("sigma", sigma, sigma > float(least), f"> {least}"), ("sigma0", sigma0, sigma0 >= sigma, ">= sigma"))
    for name, values, allowed, said in checks:
        good = np.asarray(allowed, dtype=bool) & np.isfinite(np.asarray(values, dtype=float))
        if not good.all():
            raise InputError(f"{name} = {np.asarray(values)[~good].flat[0]} must be finite and {said}")


def _within(values, part):
    if part.is_FiniteSet:
        return values == float(*part)
    return (values > float(part.start)) & (values < float(part.end))


def _ends(end, region, kinetic, static):
    return float(end) if end.is_infinite else lower((region.kinetic, region.static), end)(kinetic, static)


def _text_union(spans):
    return " u ".join(span.told for span in spans) or "nowhere"


def _latex_union(spans):
    return r" \cup ".join(sp.latex(span.as_set()) for span in spans) or r"\varnothing"


def _latex_condition(condition):
    relations = sorted(sp.And.make_args(condition), key=sp.default_sort_key)
    return r",\ ".join(sp.latex(relation) for relation in relations)
