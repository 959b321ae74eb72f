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

    def depth(base):
        """Return the multiple of -gap that ``base`` is, up to its sign; None where it is none."""
        ratio = sp.cancel(base / gap)
        return None if ratio.free_symbols & gap.free_symbols or ratio.is_zero else -base if ratio.is_positive else base

    def of_size(size):
        base = size.args[0] if isinstance(size, sp.Abs) else sp.Add(*(a for a in size.args if a != 0))
        known = depth(base) if isinstance(size, sp.Abs) or sp.S.Zero in size.args else None
        return size if known is None or (isinstance(size, sp.Max) and known != base) else Penetration(known)

    def of_power(power):
        return Penetration(power.base) ** power.exp if depth(power.base) == power.base else power

    found = expr.replace(lambda e: isinstance(e, sp.Abs | sp.Max), of_size)
    return found.replace(lambda e: e.is_Pow and not e.exp.is_integer and not e.base.has(Penetration), of_power)


def without_penetration(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` without factors that are powers of the penetration, positive while the contact is closed."""
    if not expr.has(Penetration):
        return expr
    factors = sp.Mul.make_args(sp.factor_terms(expr))
    return sp.Mul(*(f for f in factors if not isinstance(f.as_base_exp()[0], Penetration)))
