r"""The penetration of a contact, max(0, -g) of its gap g, whose powers are loads, as in Hertz's contact.

(-g)^(3/2) is not real while the contact is open, and not real at the end of a step from a closed mode that ends shortly
beyond the opening. The penetration is real everywhere. Its derivative is that of a closed contact, since the load
matters only there. Where the derivative of a load is infinite at the opening, as for Kuwabara and Kono's damping, it is
0 there. ``with_penetration`` puts the penetration into a formula of -g, ``computed`` makes it safe to evaluate.
"""

from functools import lru_cache, partialmethod
from typing import Any

import sympy as sp

from asympk.symbolic.long import atoms


class Penetration(sp.Function):
    """b where b is positive, else 0; the derivative by b is 1, as in a closed contact."""

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
        b = printer.doprint(self.args[0])
        return f"(({b}) < 0.0 ? 0.0 : ({b}))"

    _pythoncode = _mpmathcode = _numpycode = _code


class PenetrationPower(sp.Function):
    """b^e where b is positive, else 0, also for e <= 0: the form in which a power of the penetration is evaluated."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return the derivative by b."""
        b, e = self.args
        return e * PenetrationPower(b, e - 1)

    def _print_as(self, choice: str, printer: Any) -> str:
        b, e = self.args
        if e.is_positive:
            return f"({printer.doprint(Penetration(b) ** e)})"
        return choice.format(b=printer.doprint(b), e=printer.doprint(e), power=printer.doprint(b**e))

    def _numpycode(self, printer: Any) -> str:
        b, e = map(printer.doprint, self.args)
        return f"(({b} > 0)*numpy.where({b} <= 0, 1.0, {b})**({e}))"

    _pythoncode = _mpmathcode = partialmethod(_print_as, "({power} if {b} > 0 else 0*({b}))")
    _ccode = partialmethod(_print_as, "({b} > 0 ? {power} : isnan({b}) ? {b} : 0.0)")


class RootSlope(sp.Function):
    """c b^e, and 0 where c = 0 even if b^e is infinite: to a factor, the rate of a root of b that has the rate c."""

    nargs = 3

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return the derivative by c, or by b."""
        c, b, e = self.args
        return b**e if argindex == 1 else RootSlope(c * e, b, e - 1)

    def _eval_evalf(self, prec: int) -> sp.Expr:
        c, b, e = (part._evalf(prec) for part in self.args)
        return sp.S.Zero if c == 0 else c * b**e

    def _print_as(self, choice: str, printer: Any) -> str:
        c, b, e = self.args
        return choice.format(c=printer.doprint(c), product=printer.doprint(c * b**e))

    _pythoncode = _mpmathcode = partialmethod(_print_as, "(({product}) if {c} else 0*({c}))")
    _numpycode = partialmethod(_print_as, "numpy.where(({c}) == 0, 0, {product})")
    _ccode = partialmethod(_print_as, "(({c}) != 0.0 ? {product} : 0.0)")


def computed(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` with ``PenetrationPower`` for every power of the penetration that is not a whole number > 0."""

    def is_power(e):
        return e.is_Pow and isinstance(e.base, Penetration) and not (e.exp.is_Integer and e.exp.is_positive)

    if not atoms(expr, Penetration):
        return expr
    return expr.replace(is_power, lambda e: PenetrationPower(e.base.args[0], e.exp))


def with_penetration(expr: sp.Expr, gap: sp.Expr) -> sp.Expr:
    """Return ``expr`` with the penetration in fractional powers, Abs, Max and Min of constant multiples of the gap."""

    def times_gap(factor):
        """Return factor / gap if that is free of the symbols of the gap, else 0."""
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
        """Return a product with the penetration for its factors gap too: its slope is then never 0/0 at the opening."""
        known = min(product.atoms(Penetration), key=sp.default_sort_key)
        parts = [factor.as_base_exp() for factor in product.args]
        bases = (sp.cancel(b / known.args[0]) * known if times_gap(b) else b for b, _ in parts)
        return sp.Mul(*(base**power for base, (_, power) in zip(bases, parts, strict=True)))

    found = expr.replace(lambda e: isinstance(e, sp.Abs | sp.Max | sp.Min), of_size)
    found = found.replace(lambda e: e.is_Pow and not e.exp.is_integer and not e.base.has(Penetration), of_power)
    return found.replace(lambda e: e.is_Mul and e.has(Penetration), of_product)


@lru_cache(maxsize=1024)
def with_finite_powers(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` times those powers of the penetration that remove its negative powers."""
    powers = [power for power in expr.atoms(sp.Pow) if isinstance(power.base, Penetration) and power.exp.is_negative]
    named = {power: sp.Dummy() for power in powers}  # expand_mul multiplies a denominator out, and a power into its sum
    meant = {name: power for power, name in named.items()}
    for base in sorted({power.base for power in powers}, key=sp.default_sort_key):
        largest = min((power.exp for power in powers if power.base == base), key=float)
        terms = sp.Add.make_args(sp.expand_mul(expr.xreplace(named)))
        expr = sp.Add(*(term.xreplace(meant) / base**largest for term in terms))
    return expr


def without_penetration(expr: sp.Expr) -> sp.Expr:
    """Return ``expr`` without factors that are powers of the penetration, which are positive in a closed contact."""
    if not atoms(expr, Penetration):
        return expr
    factors = sp.Mul.make_args(sp.factor_terms(expr))
    return sp.Mul(*(f for f in factors if not isinstance(f.as_base_exp()[0], Penetration)))
