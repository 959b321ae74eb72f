r"""How expressions are written for each target: SymPy's printers, where their text is wrong, slow or long.

``printer_of`` is the entry. All targets agree: a largest or smallest of arguments and a sign are nan where an argument
is, a remainder has the sign of its divisor, and a power that is not real is no number.
"""

from functools import lru_cache, reduce
from typing import Any

import sympy as sp
from sympy.printing.c import C99CodePrinter
from sympy.printing.cxx import reserved
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.pycode import MpmathPrinter, PythonCodePrinter

LONGEST = 256  # the number of terms of a sum that is printed as it stands
_STRICT = {"allow_unknown_functions": False, "strict": True}


class _Quick:
    """Caches the order of terms for all functions, and skips SymPy's search for ``re``, which is never lowered."""

    _whole = ""  # of what an integer is made a number
    _rewriteable_functions = C99CodePrinter._rewriteable_functions | {  # SymPy's differences of exponentials cancel
        "coth": ("tanh", []), "csch": ("sinh", []), "acoth": ("atanh", []), "acsch": ("asinh", [])}

    def _as_ordered_terms(self, expr, order=None):
        return expr.args if self.order == "none" else _ordered_terms(expr)

    def _print_Add(self, expr, order=None):
        """Print a long sum as a sum of sums: Python compiles a sum to a limited depth, that of its terms."""
        terms = self._as_ordered_terms(expr)
        if len(terms) <= LONGEST:
            return super()._print_Add(expr, order)
        parts = (sp.Add(*terms[k : k + LONGEST], evaluate=False) for k in range(0, len(terms), LONGEST))
        return " + ".join(f"({self._print(part)})" for part in parts)

    def _print_Mul(self, expr):
        """Print a product of symbols, as of the steps of an elimination, without SymPy's search for divisors."""
        factors = expr.args[1:] if expr.args[0] == -1 else expr.args
        if all(factor.is_Symbol for factor in factors):
            ordered = sorted(factors, key=lambda factor: factor.name)
            return "-" * (len(factors) < len(expr.args)) + "*".join(map(self._print, ordered))
        return super()._print_Mul(expr)

    def _print_Rational(self, expr):
        """Print long integers in base 16: Python neither writes nor reads thousands of digits in base 10."""
        if expr.q < 10**999:
            return super()._print_Rational(expr)
        return "/".join(f"{self._whole}({int(part):#x})" for part in (expr.p, expr.q))

    def _handle_UnevaluatedExpr(self, expr):
        return expr


@lru_cache(maxsize=4096)
def _ordered_terms(expr):
    return tuple(expr.as_ordered_terms())


class _Pieces:
    """Prints nan where no piece of a Piecewise holds; SymPy prints None there in Python, and refuses in C."""

    def _print_Piecewise(self, expr):
        whole = expr.args[-1].cond == sp.true
        return super()._print_Piecewise(expr if whole else sp.Piecewise(*expr.args, (sp.nan, True), evaluate=False))


class _C(_Quick, _Pieces, C99CodePrinter):
    """C99 with all constants as doubles, each rounded once, so that no division is an integer division."""

    def _print_Integer(self, expr):
        return repr(float(int(expr)))

    def _print_Rational(self, expr):
        return repr(int(expr.p) / int(expr.q))

    def _print_NumberSymbol(self, expr):
        return repr(float(expr.evalf(30)))

    _print_Pi = _print_Exp1 = _print_EulerGamma = _print_GoldenRatio = _print_Catalan = _print_NumberSymbol

    def _print_sign(self, expr):
        """Print a sign as a double, nan of nan; SymPy prints an integer, by which C may divide as integers do."""
        e = self._print(expr.args[0])
        return f"(({e}) > 0.0 ? 1.0 : ({e}) < 0.0 ? -1.0 : ({e}))"

    def _print_Max(self, expr):
        """Print a largest or smallest of arguments, nan where one of them is; fmax and fmin leave it out."""
        found = (super()._print_Max if isinstance(expr, sp.Max) else super()._print_Min)(expr)
        return f"({' || '.join(f'isnan({self._print(e)})' for e in expr.args if not e.is_number)} ? NAN : {found})"

    _print_Min = _print_Max

    def _print_Mod(self, expr):
        """Print a remainder that has the sign of the divisor, as in every other target."""
        a, b = map(self._print, expr.args)
        rest = f"fmod({a}, {b})"
        return f"({rest} != 0.0 && ({rest} < 0.0) != (({b}) < 0.0) ? {rest} + ({b}) : {rest})"

    def _print_Pow(self, expr):
        if expr.base.is_Symbol and expr.exp in (2, 3, 4):
            return f"({'*'.join([self._print(expr.base)] * int(expr.exp))})"
        if expr.exp == sp.Rational(1, 3):  # cbrt would be real where every other target has no real value
            return f"pow({self._print(expr.base)}, {self._print(expr.exp)})"
        return super()._print_Pow(expr)


class _Python:
    """Prints what SymPy prints otherwise in Python: largest and smallest of arguments, and remainders."""

    def _print_Max(self, expr):
        """Print a choice of arguments, nan where one of them is: Python keeps the first where no other is beyond it."""
        choice = "max" if isinstance(expr, sp.Max) else "min"
        numbers = [self._print(e) for e in expr.args if e.is_number]
        rest = sorted((self._print(e) for e in expr.args if not e.is_number), key=len, reverse=True)
        first, *others = rest or numbers[:1]
        return reduce(lambda found, e: f"({e} if {e} != {e} else {choice}({found}, {e}))", others,
                      f"{choice}({', '.join([first, *numbers])})" if numbers else first)

    _print_Min = _print_Max

    def _print_Mod(self, expr):
        """Print a remainder in parentheses: without them 1 - 2*x % 1 has the remainder of 2 x."""
        a, b = map(self._print, expr.args)
        return f"(({a}) % ({b}))"


class _Mpmath(_Quick, _Pieces, _Python, MpmathPrinter):
    """Python source on mpmath's numbers."""

    @property
    def _whole(self):
        return self._module_format("mpmath.mpf")


class _Math(_Quick, _Pieces, _Python, PythonCodePrinter):
    """Python source on floats: a power that is not real raises ``ValueError``; ``**`` would return a complex number."""

    def _print_sign(self, expr):
        """Print a sign, nan of nan; SymPy copies the sign bit of nan, an accident."""
        e = self._print(expr.args[0])
        return f"(1.0 if {e} > 0 else -1.0 if {e} < 0 else {e})"

    def _print_Pow(self, expr, rational=False):
        if expr.exp.is_Integer or abs(expr.exp) == sp.S.Half:
            return super()._print_Pow(expr, rational)
        return f"{self._module_format('math.pow')}({self._print(expr.base)}, {self._print(expr.exp)})"


class _NumPy(_Quick, NumPyPrinter):
    """NumPy source that imports nothing else: SymPy's own Max and Min of several arguments need ``functools``."""

    def _print_Integer(self, expr):
        """Print an integer that 64 bits do not hold as a float: NumPy has no logarithm of others."""
        return super()._print_Integer(expr) if abs(expr) < 2**63 else str(expr.evalf(25))

    def _print_Max(self, expr):
        choice = self._module_format("numpy.maximum" if isinstance(expr, sp.Max) else "numpy.minimum")
        return reduce(lambda a, b: f"{choice}({a}, {b})", map(self._print, expr.args))

    _print_Min = _print_Max

    def _print_And(self, expr):
        """Print conditions joined one by one: SymPy's ``reduce`` of them takes no number beside an array."""
        join = self._module_format("numpy.logical_and" if isinstance(expr, sp.And) else "numpy.logical_or")
        return reduce(lambda a, b: f"{join}({a}, {b})", map(self._print, expr.args))

    _print_Or = _print_And

    def _print_ITE(self, expr):
        """Print a choice between conditions, as of a Piecewise in a condition; SymPy chooses between numbers."""
        return self._print(expr.to_nnf(simplify=False))

    def _print_erf(self, expr):
        """Print a function that NumPy has not, number by number by the one of ``math``."""
        every = self._module_format("numpy.vectorize")
        return f'{every}(__import__("math").{type(expr).__name__}, "d")({self._print(expr.args[0])})'

    _print_erfc = _print_erf


PRINTERS: dict[str, Any] = {"numpy": _NumPy, "math": _Math, "mpmath": _Mpmath, "c": _C}
_EXTRA: dict[str, Any] = {
    "mpmath": {"user_functions": {name: f"mpmath.{name.lower()}" for name in ("LambertW", "polygamma", "zeta")}},
    "c": {"math_macros": {}},
}
_MACROS = ("INFINITY", "NAN", "HUGE_VAL", "HUGE_VALF", "HUGE_VALL", "FP_NAN", "FP_INFINITE", "FP_ZERO", "FP_SUBNORMAL",
           "FP_NORMAL", "M_E", "M_LOG2E", "M_LOG10E", "M_LN2", "M_LN10", "M_PI", "M_PI_2", "M_PI_4", "M_1_PI", "M_2_PI",
           "M_2_SQRTPI", "M_SQRT2", "M_SQRT1_2", "linux", "unix")  # macros of math.h and of compilers
_TAKEN = {"c": (*_MACROS, *reserved["C++17"], "catch")}  # C++ may include the C source; other targets name a module
_USED = ("out", "abs", "max", "min", "sqrt", "pow", "exp", "log", "sin", "cos", "tan", "tanh")  # names in the sources


def printer_of(target: str, **settings: Any) -> Any:
    """Return the printer of a target's source, with the words that cannot name an argument there."""
    printer = PRINTERS[target](_STRICT | _EXTRA.get(target, {}) | settings)
    printer.reserved_words = {*printer.reserved_words, *_USED, *_TAKEN.get(target, (target,))}
    return printer
