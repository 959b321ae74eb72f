r"""The penetration of a contact, max(0, -g) of its gap g, whose powers are loads: that of Hertz is one of them.

(-g)^(3/2) is no real number while the contact is open, where there is no load; nor is it where the last step in a
closed mode ends, shortly beyond the opening. The penetration is real everywhere. Its derivative is that of the closed
contact, as a load counts in that alone.
"""

from typing import Any

import sympy as sp


class Penetration(sp.Function):
    """b where that is positive, else 0; its derivative by b is 1, as in a closed contact."""

    nargs = 1

    @classmethod
    def eval(cls, b: sp.Expr) -> sp.Expr | None:
        """Return b where it is known not to be negative, 0 where it is known not to be positive."""
        return b if b.is_nonnegative else sp.S.Zero if b.is_nonpositive else None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return 1."""
        return sp.S.One

    def _eval_is_nonnegative(self) -> bool:
        return True

    def _sympystr(self, printer: Any) -> str:
        return f"Max(0, {printer.doprint(self.args[0])})"

    def _latex(self, printer: Any, exp: str | None = None) -> str:
        text = rf"\max\left(0, {printer.doprint(self.args[0])}\right)"
        return text if exp is None else rf"{text}^{{{exp}}}"

    def _code(self, printer: Any) -> str:
        b = printer.doprint(self.args[0])
        return f"((({b}) + abs({b}))/2)"

    def _ccode(self, printer: Any) -> str:
        return f"fmax({printer.doprint(self.args[0])}, 0.0)"

    _pythoncode = _mpmathcode = _numpycode = _code


def with_penetration(expr: sp.Expr, gap: sp.Expr) -> sp.Expr:
    """Return ``expr`` with the penetration where -gap, times a constant, has a power that is not whole, or a size."""

    def times_gap(factor):
        """Return the constant that the gap has in ``factor``, a multiple of it; of all else 0."""
        ratio = sp.cancel(factor / gap)
        return sp.S.Zero if ratio.free_symbols & gap.free_symbols else ratio

    def of_size(size):
        rest = [a for a in size.args if a != 0]
        constant = times_gap(rest[0]) if len(rest) == 1 else sp.S.Zero
        if isinstance(size, sp.Min):
            return -Penetration(-rest[0]) if constant.is_positive else size
        if constant.is_negative:
            return Penetration(rest[0])
        return Penetration(-rest[0]) if constant.is_positive and isinstance(size, sp.Abs) else size

    def of_power(power):
        return Penetration(power.base) ** power.exp if times_gap(power.base).could_extract_minus_sign() else power

    def of_product(product):
        """Return a product with the penetration for its factors -gap, too: its slope is never 0/0 at the opening."""
        known = min(product.atoms(Penetration), key=sp.default_sort_key)
        parts = [factor.as_base_exp() for factor in product.args]
        bases = (sp.cancel(b / known.args[0]) * known if times_gap(b) else b for b, _ in parts)
        return sp.Mul(*(base**power for base, (_, power) in zip(bases, parts, strict=True)))

    found = expr.replace(lambda e: isinstance(e, sp.Abs | sp.Max | sp.Min), of_size)
    found = found.replace(lambda e: e.is_Pow and not e.exp.is_integer and not e.base.has(Penetration), of_power)
    return found.replace(lambda e: e.is_Mul and e.has(Penetration), of_product)


def without_penetration(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` without factors that are powers of the penetration, positive while the contact is closed."""
    if not expr.has(Penetration):
        return expr
    factors = sp.Mul.make_args(sp.factor_terms(expr))
    return sp.Mul(*(f for f in factors if not isinstance(f.as_base_exp()[0], Penetration)))
