"""Functions of the parameters as exact numbers: rational ones exactly, others with as many digits as they need."""

import math
from fractions import Fraction
from functools import lru_cache

import sympy as sp

from asympk.arithmetic import flow_context, set_digits
from asympk.automaton.compiled import namespace, source
from asympk.errors import OutOfRange
from asympk.numbers import MOST_DIGITS, mantissa_and_exponent
from asympk.symbolic.long import atoms
from asympk.symbolic.system import System

_INFINITE = "a coefficient of the system is not a finite number at these parameters"
MOST_WORKING = 20_000  # digits with which a coefficient is computed at most


def exact_values(system: System, entries: tuple[sp.Expr, ...], values: tuple, digits: int) -> dict[sp.Expr, Fraction]:
    """Return the values of functions of the parameters: exact for rational ones, others right to ``digits`` digits.

    A function that vanishes only analytically, as cos(a)^2 + sin(a)^2 - 1, gets the value 0.
    """
    arguments = [Fraction(0)] * (1 + len(system.states)) + [Fraction(value) for value in values]
    exact, others = _outputs(entries)
    found = dict(zip(exact, _evaluated(system, exact, namespace(mpf=Fraction), arguments), strict=True))
    if others:
        found |= zip(others, _agreed(system, others, arguments, digits), strict=True)
    return {expr: Fraction(value) for expr, value in found.items()}


def _agreed(system, outputs, arguments, digits):
    """Return the values on which computations at two precisions agree to ``digits`` digits, and 0 where none agree.

    A part that cancels to nothing, such as log(1 + p) of a tiny p, may still be multiplied by a large part. Therefore
    the second computation has as many more digits as all parts together are large or small.
    """
    parts = tuple(sorted(atoms(sp.Tuple(*outputs), sp.Symbol, sp.Pow, sp.Function), key=str))
    before, working = [math.nan] * len(outputs), digits + 10
    for _ in range(4):
        m = flow_context(working)
        set_digits(m, working)
        try:
            numbers = _evaluated(system, (*outputs, *parts), m, map(m.number, arguments))
        except OutOfRange:
            if digits > MOST_DIGITS:
                raise
            return _agreed(system, outputs, arguments, 4 * digits)  # more digits may tell a divisor from 0
        sizes = (m.mag(value) for value in numbers[len(outputs) :])
        needed = digits + 10 + sum(abs(size) for size in sizes if isinstance(size, int)) * 3 // 10
        if needed > MOST_WORKING:
            raise OutOfRange("a coefficient of the system has parts so large or small that it takes more than "
                             f"{MOST_WORKING} digits at these parameters: give others")
        agree = [working >= needed and b and abs(a - b) * 10**digits <= abs(b)
                 for a, b in zip(before, numbers, strict=False)]
        if all(agree):
            break
        before, working = numbers[: len(outputs)], max(2 * working, needed)
    if not all(map(m.isfinite, numbers[: len(outputs)])):
        raise OutOfRange(_INFINITE)
    set_digits(m, digits + 10)
    return [_fraction(+b) if of_use else Fraction(0) for b, of_use in zip(numbers, agree, strict=False)]


@lru_cache(maxsize=512)
def _outputs(entries):
    """Return (rational functions of the parameters, other functions of them)."""
    return tuple(filter(is_rational, entries)), tuple(e for e in entries if not is_rational(e))


def is_rational(expr: sp.Expr) -> bool:
    """Tell whether an expression is a rational function of the parameters with rational coefficients."""
    whole = all(power.exp.is_Integer for power in atoms(expr, sp.Pow))
    return whole and not atoms(expr, sp.Function, sp.NumberSymbol)


@lru_cache(maxsize=512)
def _code(system, outputs):
    return compile(source(system, outputs, "mpmath"), "<entries of a mode>", "exec")


def _evaluated(system, outputs, numbers, arguments):
    space = {"mpmath": numbers}
    try:
        exec(_code(system, outputs), space)
        return space["f"](*arguments)
    except (ZeroDivisionError, OverflowError):
        raise OutOfRange(_INFINITE) from None


def _fraction(value):
    if isinstance(value, int):
        return Fraction(value)
    if not hasattr(value, "_mpf_"):
        raise OutOfRange("a coefficient of the system is not a real number at these parameters")
    multiple, exponent = mantissa_and_exponent(value)
    return Fraction(multiple) * Fraction(2) ** exponent
