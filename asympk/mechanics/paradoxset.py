r"""The configurations with a paradox: where friction load |G_NT| - G_NN is positive over one or two coordinates.

The zeros of this excess are zeros of G_NN^2 - (friction load G_NT)^2. If the latter is rational in the first coordinate
q or in its sine and cosine, a polynomial in T = q or T = tan(q/2) has the same zeros. They divide the range into
stretches of one sign, one place in each is evaluated, and no interval is missed. In other cases the range is sampled,
and extrema between samples are searched for. ``paradox_set`` is the entry, ``_witnesses`` finds the places. Beside
rough contacts that hold both ways, the excess is the greatest for all signs of their friction (``pairs``).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sympy as sp

from asympk.doors import through
from asympk.errors import InputError
from asympk.mechanics.checks import require_positive_mass
from asympk.mechanics.evaluation import ROUNDING, evaluate
from asympk.mechanics.kinetics import Kinetics
from asympk.mechanics.paradox import pairs, ratios
from asympk.numbers import short
from asympk.shown import Card, ShownAsTable
from asympk.symbolic.long import symbols_in
from asympk.symbolic.reading import as_floats, exact_constant

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SAMPLES = 2001  # number of values of the first coordinate
ROWS = 201  # number of values of the second coordinate
STRIDE = 20  # samples between places at which the mass matrix is tested
TURNS = 10_000  # most turns in a range of an angle, as each turn has intervals of its own
_HALVINGS = 60  # halvings of a bracket that reduce it to rounding


@dataclass(frozen=True)
class Interval:
    """A stretch of one coordinate with a paradox; ``other`` is the value of the second coordinate, or None."""

    start: float
    end: float
    other: float | None = None


@dataclass(frozen=True, repr=False)
class ParadoxSet(ShownAsTable):
    """The set with a paradox over one or two coordinates or parameters ``over``, between their ``ends``.

    The set is the table ``intervals`` of stretches of the first coordinate. ``edges`` are the ends of intervals inside
    the range, accurate to rounding. If ``complete``, no interval over the first coordinate is missing.
    Otherwise one may be missing where the condition has two extrema within one ``SAMPLES``-th of the range.
    """

    over: tuple[str, ...]
    ends: tuple[tuple[float, float], ...]
    intervals: tuple[Interval, ...]
    complete: bool

    def plot(self, file: str | Path | None = None) -> "Figure":
        """Return a matplotlib ``Figure`` of the set; write it to ``file`` (.pdf, .svg or .png) if one is given."""
        return through("ParadoxSet.plot", self, file)

    def _card(self) -> Card:
        spans = [(f"{self.over[0]} from {interval.start:.10g} to {interval.end:.10g}",
                  "" if interval.other is None else f"{self.over[1]} = {interval.other:.6g}")
                 for interval in self.intervals]
        shown = spans if len(spans) < 9 else [*spans[:7], (f"{len(spans) - 7} more", "")]
        counted = f"{len(spans)} interval{'s' * (len(spans) != 1)}"
        return Card(f"Paradox over {' and '.join(self.over)}: {counted}", tuple(shown))

    @property
    def edges(self) -> tuple[float, ...]:
        """The ends of the intervals that are not ends of the range, in order."""
        ends = (end for interval in self.intervals for end in (interval.start, interval.end))
        return tuple(end for end in ends if end not in self.ends[0])


def paradox_set(kinetics: Kinetics, over: dict[sp.Symbol, Any], values: dict[sp.Symbol, Any]) -> ParadoxSet:
    """Return the ``ParadoxSet`` over the one or two coordinates or parameters of ``over``, ``{name: (low, high)}``.

    ``values`` gives all others, as numbers or as functions of those of ``over`` in the same order. The edges over the
    first are accurate to rounding. Raises ``InputError`` for invalid ranges and missing values, and for a mass matrix
    that is not positive.
    """
    names = tuple(over)
    if not 1 <= len(names) <= 2:
        raise InputError(f"{len(names)} ranges; give one or two coordinates or parameters with their (low, high)")
    ends = tuple(ends_of(name, over[name]) for name in names)
    import numpy as np

    witnesses = _witnesses(kinetics, names, values)
    others = np.linspace(*ends[1], ROWS) if len(names) == 2 else np.zeros(1)
    excess = _excess(kinetics, names, values, others)
    at, row = np.tile(np.linspace(*ends[0], SAMPLES), len(others)), np.repeat(np.arange(len(others)), SAMPLES)
    require_positive_mass(kinetics, _placed(names, values, (at[::STRIDE], others[row[::STRIDE]])))
    if witnesses is None:
        inner, of = _extrema(excess, at, row)
    else:
        places = witnesses(*ends[0], others)
        inner, of = np.concatenate(places), np.repeat(np.arange(len(others)), [len(p) for p in places])
    at, row = np.append(at, inner), np.append(row, of)
    order = np.lexsort((at, row))
    found = _positive(excess, at[order], row[order])
    intervals = (Interval(*span, float(others[k]) if len(names) == 2 else None) for k, span in found)
    return ParadoxSet(tuple(map(str, names)), ends, tuple(intervals), witnesses is not None)


def ends_of(name: sp.Symbol, given: Any) -> tuple[float, float]:
    """Return the ends (low, high) of a range of ``name`` as doubles; raises ``InputError`` if they are none."""
    try:
        low, high = given
    except (TypeError, ValueError):
        raise InputError(f"range of {name} = {short(given)}: give (low, high)") from None
    low, high = (as_floats(f"range of {name}", end) for end in (low, high))
    if any(getattr(end, "shape", ()) for end in (low, high)):
        raise InputError(f"range of {name} = {short(given)}: give (low, high), two numbers")
    if not low < high:
        raise InputError(f"range of {name} = ({low:g}, {high:g}): give (low, high) with low < high")
    return low, high


def _excess(kinetics: Kinetics, names: tuple, values: dict, others: Any) -> Callable[..., Any]:
    """Return friction load |G_NT| - G_NN as a function of two arrays: the first coordinate, the index in ``others``.

    The third argument ``less`` of this function is a part of both terms, by which the result is reduced.
    """
    import numpy as np

    normals, couplings = zip(*pairs(kinetics), strict=True)
    terms = (*(kinetics.friction * kinetics.load * sp.Abs(mixed) for mixed in couplings), *normals)

    def excess(at: Any, row: Any, less: float = 0.0) -> Any:
        found = evaluate(terms, _placed(names, values, (at, others[row])))
        both = zip(found[: len(normals)], found[len(normals) :], strict=True)
        each = (coupling - normal - less * (coupling + abs(normal)) for coupling, normal in both)
        return np.broadcast_to(reduce(np.maximum, each), np.shape(at))

    return excess


def _placed(names: tuple, values: dict, grid: tuple) -> dict[sp.Symbol, Any]:
    """Return all values on arrays of the first coordinate and of the second, which is left out if there is but one."""
    turned = grid[: len(names)]
    placed = {key: value(*turned) if callable(value) else value for key, value in values.items()}
    return placed | dict(zip(names, turned, strict=True))


def _witnesses(kinetics: Kinetics, names: tuple, values: dict) -> Callable[..., Any] | None:
    """Return a function of (low, high, others) that gives one place between any two roots of each other value.

    Without a polynomial it is None.
    """
    import numpy as np

    bound = kinetics.friction * kinetics.load
    excesses = [_square(normal) - bound**2 * _square(mixed) for normal, mixed in ratios(kinetics)]
    needed = [s for s in symbols_in(sp.Tuple(*excesses)) - {*names} if s in values]
    if any(callable(values[s]) for s in needed):
        return None
    known = {s: exact_constant(str(s), values[s]) for s in needed}
    polynomials = [p for p in (_polynomial(expr.subs(known), names[0]) for expr in excesses) if p]
    if len(polynomials) < len(excesses):
        return None

    def places(low: float, high: float, others: Any) -> list[Any]:
        cuts = [[np.array([low, high])] for _ in others]
        for coefficients, angle in polynomials:
            numbers = evaluate(coefficients, dict(zip(names[1:], (others,), strict=False)))
            for own, row in zip(cuts, np.array(np.broadcast_arrays(*numbers, others)[:-1], dtype=float).T, strict=True):
                roots = np.roots(row).real
                own.append(_in_turns(names[0], low, high, roots) if angle else roots)
        return [_middles(low, high, np.concatenate(own)) for own in cuts]

    return places


def _in_turns(name: sp.Symbol, low: float, high: float, roots: Any) -> Any:
    """Return the angles of a range, and some beside it, whose halves have the tangents ``roots`` or oo."""
    import numpy as np

    if high - low > 2 * np.pi * TURNS:
        raise InputError(f"range of {name} = ({low:g}, {high:g}): it is an angle, and they are more than {TURNS} "
                         "turns; give one, which tells of all")
    turns = 2 * np.pi * np.arange(np.floor(low / (2 * np.pi)) - 1, np.ceil(high / (2 * np.pi)) + 2)
    return np.add.outer(np.append(2 * np.arctan(roots), np.pi), turns).ravel()


def _middles(low: float, high: float, cuts: Any) -> Any:
    """Return the middles between neighbours of those ``cuts`` that lie in a range with its ends."""
    import numpy as np

    inside = np.unique(cuts[(cuts >= low) & (cuts <= high)])
    return (inside[1:] + inside[:-1]) / 2


def _square(size: sp.Expr) -> sp.Expr:
    """Return the square of a product of absolute values without them: SymPy keeps those of what may be complex."""
    powers = (part.as_base_exp() for part in sp.Mul.make_args(size))
    return sp.Mul(*((base.args[0] if isinstance(base, sp.Abs) else base) ** (2 * n) for base, n in powers))


def _polynomial(expr: sp.Expr, name: sp.Symbol) -> tuple[tuple[sp.Expr, ...], bool] | None:
    """Return coefficients of a polynomial with the zeros of ``expr``, in ``name`` or (True) in tan(name/2), or None."""
    expanded, T = sp.expand_trig(expr), sp.Dummy("T", real=True)
    sine, cosine = 2 * T / (1 + T**2), (1 - T**2) / (1 + T**2)
    turned = expanded.subs({sp.tan(name): sine / cosine, sp.sin(name): sine, sp.cos(name): cosine})
    angle = turned != expanded
    if turned.has(name) and angle:
        return None
    numerator, _ = sp.fraction(sp.together(turned.subs(name, T)))
    if not numerator.is_polynomial(T) or numerator.has(sp.Abs, sp.Piecewise):
        return None
    coefficients = sp.Poly(numerator, T).all_coeffs()
    largest = max((abs(c) for c in coefficients if c.is_Rational), default=0) or sp.S.One  # squares may overflow
    return tuple(c / largest for c in coefficients), angle


def _extrema(function: Callable[..., Any], at: Any, row: Any) -> tuple[Any, Any]:
    """Return (places, rows) of the extrema of a function, searched for between the neighbours of extreme samples."""
    import numpy as np

    rise = np.sign(np.diff(function(at, row)))
    found = np.nonzero((rise[1:] * rise[:-1] <= 0) & (row[2:] == row[:-2]))[0]
    sign = np.where(rise[found] >= rise[found + 1], 1.0, -1.0)
    low, high, of = at[found], at[found + 2], row[found]
    for _ in range(_HALVINGS if len(found) else 0):
        left, right = low + (high - low) / 3, high - (high - low) / 3
        rises = sign * function(left, of) < sign * function(right, of)
        low, high = np.where(rises, left, low), np.where(rises, high, right)
    return (low + high) / 2, of


def _positive(function: Callable[..., Any], at: Any, row: Any) -> list[tuple[int, tuple[float, float]]]:
    """Return (row, (start, end)) of the stretches on which a function is positive; ends within a row are bisected.

    An end within a row is a place where the function is not positive. A stretch on which the function nowhere exceeds
    its rounding is left out: there it only touches zero.
    """
    import numpy as np

    inside, turns = function(at, row) > 0, row[1:] != row[:-1]
    stretch = np.cumsum(np.append(False, (inside[1:] != inside[:-1]) | turns))
    inside &= np.bincount(stretch, function(at, row, ROUNDING) > 0)[stretch] > 0
    cuts = np.nonzero((inside[1:] != inside[:-1]) & ~turns)[0]
    low, high, of = at[cuts], at[cuts + 1], row[cuts]
    for _ in range(_HALVINGS if len(cuts) else 0):
        middle = (low + high) / 2
        same = (function(middle, of) > 0) == inside[cuts]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    outer = [*np.nonzero(inside & np.append(True, turns))[0], *np.nonzero(inside & np.append(turns, True))[0]]
    without = np.where(inside[cuts], high, low)  # at 0 it is the zero itself, and not the least number beside it
    ends = sorted([*zip(of, without, strict=True), *((row[k], at[k]) for k in outer)])
    return [(int(k), (float(a), float(b))) for (k, a), (_, b) in zip(ends[::2], ends[1::2], strict=True)]
