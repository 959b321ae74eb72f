"""Cards, as which objects are shown: a title and a few rows, as text at the prompt, as HTML or LaTeX in a notebook.

A public class derives from ``ShownAsTable`` or ``ShownAsFormulas``, is a dataclass with ``repr=False``, and defines
``_card()``. A value of a card is a word, a number, or a formula: anything that SymPy's LaTeX printer knows.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple, TypeVar

WIDTH = 100  # most characters of a line of text
ROWS = 10  # most rows of a card as text
LONGEST = 60  # most characters of a number
LATEX = 4000  # most characters of a formula in LaTeX; a longer one, of metres on one line, is shown as text
_RELATIONS = {"->": r"\to ", "<=": r"\le ", ">=": r"\ge ", "<": "<", ">": ">", "|": "|"}
_LINE = "text-align:left;white-space:nowrap"
_EVENT = r"[a-z_+]+(?: \d+)?"
_REPEATED = re.compile(rf"(?<!\S)({_EVENT}(?:, {_EVENT}){{0,3}}?)(?:, \1)+(?=,|$)")


class Card(NamedTuple):
    """The summary of an object: a title, and rows of a label and a value."""

    title: str
    rows: tuple[tuple[str, Any], ...] = ()


class Shown(ABC):
    """An object whose ``repr`` is its card, a few lines of text."""

    @abstractmethod
    def _card(self) -> Card: ...

    def __repr__(self) -> str:
        return as_text(self._card())


class ShownAsTable(Shown):
    """An object that a notebook shows as a table."""

    def _repr_html_(self) -> str:
        return as_html(self._card())


class ShownAsFormulas(Shown):
    """An object that a notebook, and ``sympy.latex``, show as formulas."""

    def _latex(self, printer: Any, **options: Any) -> str:
        return as_latex(self._card())

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {latex_of(self)}$"


NOUN = TypeVar("NOUN", bound=ShownAsFormulas)


class Several(tuple[NOUN, ...]):
    """A tuple of objects with formulas, shown one below the other."""

    __slots__ = ()

    def __repr__(self) -> str:
        return "\n".join(map(repr, self)) or "()"

    def _repr_latex_(self) -> str:
        rows = r" \\[2ex] ".join(as_latex(noun._card()) for noun in self)
        return rf"$\displaystyle \begin{{array}}{{l}} {rows} \end{{array}}$"


def number_as_text(value: Any) -> str:
    """Return a number in few characters: a double with ten digits, an mpf that carries its digits with all of them.

    An int or a Fraction is written as a decimal if one of ten digits is exact, otherwise as a ratio if this is short,
    and otherwise as a decimal that is rounded.
    """
    if isinstance(value, float):
        return f"{value:z.10g}"
    if isinstance(value, int | Fraction):
        exact = Fraction(value)
        decimal = f"{Decimal(exact.numerator) / exact.denominator:.10g}"  # of any size, unlike a float
        small = abs(exact.numerator) < 10**12 and exact.denominator < 10**12
        return f"{value}" if small and Fraction(decimal) != exact else decimal
    return cut(str(value), LONGEST)


def ball_as_text(ball: Any, digits: int) -> str:
    """Return "[middle +/- radius]", which encloses the ball, with the certain digits of its middle and three more.

    These are at most ``digits``. Without the three, rounding the middle can make the radius many times as large.
    """
    shown = 3 + int(ball.rel_accuracy_bits() * 0.30103)  # a bit is log10(2) of a digit
    return ball.str(min(digits, shown), more=True) if shown > 0 else ball.str(digits)


def cut(line: str, most: int = WIDTH) -> str:
    """Return a line, shortened with three dots to at most ``most`` characters."""
    return line if len(line) <= most else f"{line[: most - 3]}..."


def condensed(itinerary: str) -> str:
    """Return an itinerary with repeats of up to four events or modes written once: ``9 x (touch_down, lift_off)``."""
    def once(found: re.Match[str]) -> str:
        times = (len(found[0]) + 2) // (len(found[1]) + 2)
        return f"{times} x ({found[1]})" if ", " in found[1] else f"{times} x {found[1]}"

    return _REPEATED.sub(once, itinerary)


def as_text(card: Card) -> str:
    """Return a card as a title and at most ten rows, each on a line of at most a hundred characters."""
    labels = [label for label, _ in card.rows]
    width = max(map(len, labels), default=0)
    rows = [cut(f"  {label:<{width}}  {_words(value)}") for label, value in shortened_rows(card.rows)]
    return "\n".join([cut(card.title), *rows])


def as_html(card: Card) -> str:
    """Return a card as a small HTML table; formulas are set by the notebook."""
    from html import escape

    cells = "".join(
        f"<tr><th style='{_LINE}'>{escape(label)}</th><td style='text-align:left'>{_html(value)}</td></tr>"
        for label, value in card.rows
    )
    return f"<table><caption style='{_LINE}'>{escape(card.title)}</caption>{cells}</table>"


def as_latex(card: Card) -> str:
    """Return a card as a LaTeX array: the title, and the rows below it."""
    rows = [rf"{_text(label)} & {_formula(value)}" for label, value in card.rows]
    return _array("l", [_text(card.title), *([_array("ll", rows)] if rows else [])])


def _array(align: str, rows: Sequence[str]) -> str:
    return rf"\begin{{array}}{{{align}}} " + r" \\[1ex] ".join(rows) + r" \end{array}"


def latex_of(value: Any) -> str:
    """Return LaTeX of a formula; a rate in plain symbols, such as theta', is a Greek letter with a prime."""
    import sympy as sp

    from asympk.formulas import as_printed

    value = as_printed(value) if isinstance(value, sp.Basic) else value
    rates = [s for s in getattr(value, "free_symbols", ()) if str(s).endswith("'")]
    return sp.latex(value, symbol_names={s: f"{sp.latex(sp.Symbol(str(s)[:-1]))}'" for s in rates})


def is_formula(value: Any) -> bool:
    """Tell whether SymPy's LaTeX printer sets the value as mathematics."""
    return hasattr(value, "_latex") or hasattr(value, "_eval_simplify") or hasattr(value, "free_symbols")


def shortened_rows(rows: Sequence[tuple[str, Any]], most: int = ROWS) -> list[tuple[str, Any]]:
    """Return at most ``most`` rows: where there are more, the first ones, the number left out, and the last one."""
    if len(rows) <= most:
        return list(rows)
    return [*rows[: most - 2], ("...", f"{len(rows) - most + 1} more"), rows[-1]]


def _words(value: Any) -> str:
    """Return a value in one line; formulas of SymPy, which takes its time to load, in words."""
    if hasattr(value, "xreplace"):
        from asympk.formulas import formula_in_words

        value = formula_in_words(value)
    return " ".join(str(value).split()) if isinstance(value, str) or is_formula(value) else number_as_text(value)


def _html(value: Any) -> str:
    from html import escape

    return escape(rf"$\displaystyle {_formula(value)}$" if is_formula(value) else _words(value))


def _formula(value: Any) -> str:
    if not is_formula(value):
        return _text(_words(value))
    formula = latex_of(value)
    return formula if len(formula) <= LATEX else _text(cut(_words(value)))


def _text(words: str) -> str:
    r"""Return words as LaTeX \text; special characters are escaped outside of it, as MathJax requires.

    Relations are mathematics: the text font of LaTeX has other characters in place of <, > and |.
    """
    parts = re.split(r"(->|[<>]=?|[|{}$&#_%])", re.sub(r"[\\^~]", " ", words))
    return "".join(_RELATIONS.get(part, rf"\{part}") if k % 2 else rf"\text{{{part}}}"
                   for k, part in enumerate(parts) if part) or r"\text{}"
