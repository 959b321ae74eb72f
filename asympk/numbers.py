"""The reader of numbers: an argument becomes an exact int, float or Fraction, or is refused with a message of one line.

Strings are read here and nowhere else, but for formulas of numbers in files and at the command line, which
``formulas.read_constant`` reads. A string is a decimal or a ratio of integers, of bounded length and exponent, and
never a formula.
"""

import re
from collections.abc import Callable, Collection, Iterable
from decimal import Decimal
from fractions import Fraction
from numbers import Integral, Rational
from sys import float_info
from typing import TYPE_CHECKING, Any, TypeAlias

from asympk.errors import InputError, OrderError

if TYPE_CHECKING:
    import numpy as np

Number: TypeAlias = Any  # a float, an mpf, a Fraction or a ball, or an array of such numbers
Arithmetic: TypeAlias = Any  # the functions of one kind of numbers: ``Doubles``, an mpmath context, NumPy

HIGHEST = 1000  # highest order of an expansion
MOST_DIGITS = 1000  # most digits that may be asked of a closed form
KEPT_DIGITS = MOST_DIGITS + 100  # of an irrational number that is kept as a fraction: a flow may lose a hundred of them
_SPELT = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?|[+-]?\d+/\d+", re.ASCII)
_WIDTH = 60  # most characters of a value in a message
_LONGEST = 4000  # most characters of a string, and most digits of a Decimal
_FARTHEST = 9999  # largest power of ten of a Decimal, up or down
_WIDEST = 40000  # largest power of two of an mpf, up or down
LARGEST = 2.0**1023  # size of a number
_RANGE = "it must be finite, and a double must be able to hold it"
_SIZE = f"it must be finite, and its size at most {LARGEST:.3g}"
_MOST_DIMENSIONS = 30  # NumPy iterates over 32, and a result has one or two more
_ARRAY = "it must be a number or an array of numbers"
_KINDS = "int, float, Fraction, Decimal, str, mpf or a SymPy constant"
FEW = 3  # digits of a size


def number(
    name: str, value: Any, allowed: Callable[[Any], bool] | None = None, words: str = ""
) -> int | float | Fraction:
    """Return ``value`` as an exact int, float or Fraction; raise ``InputError`` unless it is finite and allowed.

    ``value`` is an int, float, Fraction, Decimal, mpf, a NumPy scalar, a SymPy constant as ``as_fraction`` reads it, or
    a string that spells a decimal ("0.2" is 1/5) or a ratio ("1/3"). ``allowed`` is a condition, and ``words`` its
    wording in the message after "it must be".
    """
    exact = _exact(name, value)
    if not -LARGEST <= exact <= LARGEST:
        raise InputError(f"{name} = {short(value)}: {_SIZE}")
    if allowed and not allowed(exact):
        raise InputError(f"{name} = {short(value)}: it must be {words}")
    return exact


def numbers(name: str, value: Any) -> "np.ndarray":
    """Return ``value`` as an array of real numbers; arrays of integers or floats keep their type, others are doubles.

    Strings, Fractions and Decimals are read one by one by ``number``. Raises ``InputError`` for anything that is not
    a number, and for a masked array, whose mask would be lost.
    """
    values = _array(name, value, None)
    if values.dtype.kind in "OUS":
        values = _read_each(name, values.astype(object))
    if values.dtype.kind not in "iuf":
        raise InputError(f"{name} = {short(value)}: {_ARRAY}")
    return values


def raw_entries(name: str, value: Any) -> "np.ndarray":
    """Return ``value`` as an array of its unread entries, for ``number``; raises ``InputError`` as ``numbers`` does."""
    values = _array(name, value, None)
    return values if values.dtype.kind in "iuf" else _array(name, value, object)


def common_shape(names: Iterable[Any], arrays: Collection[Any]) -> tuple[int, ...]:
    """Return the shape that arrays broadcast to; raises ``InputError``, which gives the shape of each named array."""
    import numpy as np

    try:
        return np.broadcast_shapes(*map(np.shape, arrays))
    except ValueError:
        shapes = ", ".join(f"{name} {np.shape(value)}" for name, value in zip(names, arrays, strict=True))
        raise InputError(f"the arrays do not broadcast; their shapes are {shapes}") from None


def entry_name(name: str, at: tuple) -> str:
    """Return how a message names the entry ``at`` of an array."""
    return f"{name}[{', '.join(map(str, at))}]" if at else name


def first_place(bad: "np.ndarray") -> tuple[int, ...]:
    """Return the index of the first True of an array."""
    import numpy as np

    return tuple(map(int, np.unravel_index(bad.argmax(), bad.shape)))


def require_finite(
    name: str, values: "np.ndarray", allowed: Callable[[Any], Any] | None = None, words: str = ""
) -> None:
    """Raise ``InputError`` with place and value of the first number that is not finite or not ``allowed``."""
    finite = (lambda v: abs(v) <= LARGEST, "a finite number")
    for rule, wording in (finite, (allowed, words)) if values.size else ():
        if rule and not all(map(rule, (float(values.min()), float(values.max())))):
            at = first_place(~rule(values.astype(float)))
            raise InputError(f"{entry_name(name, at)} = {values[at]}: it must be {wording}")


def whole(name: str, value: Any, least: int, most: int) -> int:
    """Return ``value`` as an int from ``least`` to ``most``; raises ``InputError`` for anything else."""
    if not _is_whole(value) or not least <= int(value) <= most:
        raise InputError(f"{name} = {short(value)}: it must be a whole number from {least} to {most}")
    return int(value)


def flag(name: str, value: Any) -> bool:
    """Return ``value``, True or False of Python or NumPy, as a bool; raises ``InputError`` for anything else."""
    if not isinstance(value, bool) and type(value).__name__ not in ("bool_", "bool"):
        raise InputError(f"{name} = {short(value)}: it must be True or False")
    return bool(value)


def require_callback(name: str, value: Any, hint: str = "") -> None:
    """Raise ``InputError``, with a ``hint`` at its end, unless ``value`` is None or can be called."""
    if value is not None and not callable(value):
        raise InputError(f"{name} = {short(value)}: it must be a function{hint}")


def known_order(order: Any, highest: int | None = None, what: str = "") -> int:
    """Return the order of an expansion as an int from 0 to ``highest``; raises ``OrderError``, worded with ``what``."""
    if not (_is_whole(order) and 0 <= order <= (HIGHEST if highest is None else highest)):
        rule = f" is not a whole number >= 0, or beyond {HIGHEST}" if highest is None else f": {what} 0 .. {highest}"
        raise OrderError(f"order = {short(order)}{rule}")
    return int(order)


def mantissa_and_exponent(value: Number) -> tuple[int, int]:
    """Return (n, e) of an mpf, which is n 2^e, as Python integers, also where mpmath computes with those of gmpy2."""
    sign, size, exponent, _ = value._mpf_
    return -int(size) if sign else int(size), int(exponent)


def sign_of(value: Number) -> int:
    """Return 1, 0 or -1, the sign of a number."""
    return 1 if value > 0 else -1 if value < 0 else 0


def short(value: Any) -> str:
    """Return ``repr(value)``, of a Fraction or mpf the number, on one line of at most 60 characters, for a message.

    A ratio of more characters is written as a decimal of ten digits.
    """
    plain = isinstance(value, Fraction) or hasattr(value, "_mpf_")
    try:
        text = " ".join((str if plain else repr)(value).split())
        if len(text) > _WIDTH and isinstance(value, Rational) and not isinstance(value, Integral):
            return f"{Decimal(int(value.numerator)) / int(value.denominator):.10g}"
    except ValueError:  # Python spells no integer of more than some thousand digits
        return f"({type(value).__name__} of very many digits)"
    return text if len(text) <= _WIDTH else text[: _WIDTH - 3] + "..."


def reason_of(error: Exception) -> str:
    """Return why arithmetic failed: what an exception says, without a number of the system; silent ones overflow."""
    return str(error.args[-1]) if error.args else "a number is beyond floats"


def listed(names: Iterable[Any], values: Iterable[Number], digits: int = 6) -> str:
    """Return "name = number, ..." for a message."""
    return ", ".join(f"{name} = {float(v):.{digits}g}" for name, v in zip(names, values, strict=True))


def _is_whole(value):
    """Tell whether ``value`` is an integer, and no bool or timedelta, whose unit would be lost."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    return whole and getattr(getattr(value, "dtype", None), "kind", "i") in "iu"


def _exact(name, value):
    if type(value) in (float, int):
        return value
    if isinstance(value, str):
        return _spelt(name, value)
    if isinstance(value, float):
        return float(value)
    if _is_whole(value):
        return int(value)
    if isinstance(value, Rational) and not isinstance(value, Integral):
        return Fraction(int(value.numerator), int(value.denominator))
    if isinstance(value, Decimal):
        return _from_decimal(name, value)
    if hasattr(value, "_mpf_"):
        return _from_mpf(name, value)
    if type(value).__module__ == "numpy" and value.ndim == 0 and value.dtype.kind in "iuf":
        return _from_scalar(name, value.item())
    if getattr(value, "is_number", False):
        if any(part.is_Symbol for part in value.atoms()):
            raise InputError(f"{name} = {short(value)}: work it out first, as .evalf(20) does")
        return as_fraction(name, value)
    raise InputError(f"{name} = {short(value)}: it must be a number: {_KINDS}")


def as_fraction(name: str, value: Any, digits: int = KEPT_DIGITS) -> Fraction:
    """Return a SymPy constant such as pi/4 as a Fraction, of an irrational one right to ``digits``.

    Raises ``InputError`` for a number that is not real, to these digits, and at once for one that would take long to
    work out: a double must be able to hold it and each number in it.
    """
    if callable(value):  # as a function without symbols is
        raise InputError(f"{name} = {short(value)}: it must be a number: {_KINDS}")
    require_sizes(name, value)
    exact, imaginary = (value if value.is_Rational else value.evalf(digits)).as_real_imag()
    if not exact.is_finite or abs(imaginary) > abs(exact) / 10 ** (digits - 1):  # as of a root by Cardano's formula
        raise InputError(f"{name} = {short(value)}: it must be a finite real number")
    if exact and not within_doubles(exact):
        raise InputError(f"{name} = {short(value)}: {beyond('it', exact)}")
    return Fraction(exact.p, exact.q) if exact.is_Rational else Fraction(str(exact))


def require_sizes(name: str, whole: Any) -> None:
    """Raise ``InputError`` for a number among the arguments of a number, and of its parts, beyond doubles.

    SymPy takes as many digits of it as it has before its point: cos(exp(exp(20))). So it does of a number that has not
    been worked out, 2**(10**9), and the number itself must not be as large.
    """
    _require_sizes_within(name, whole, whole)
    try:
        size = abs(whole.evalf(FEW))
    except ValueError:  # at a pole, as gamma(-1)
        raise InputError(f"{name} = {short(whole)}: {_RANGE}") from None
    _require_digits(name, whole, not size.is_Float or size <= 2**_WIDEST)


def _require_sizes_within(name, whole, part):
    if part.is_Pow and all(inner.is_Rational for inner in part.args):
        bits = max(int(size).bit_length() for size in (part.base.p, part.base.q))
        _require_digits(name, whole, bits * abs(part.exp) <= _WIDEST)
    for inner in part.args:
        if getattr(inner, "is_number", False):
            _require_sizes_within(name, whole, inner)
            if (abs(inner.evalf(FEW)) > LARGEST) == True:  # noqa: E712 - SymPy's truth
                raise InputError(f"{name} = {short(whole)}: a number in it is beyond the range of doubles")


def _require_digits(name, whole, few):
    if not few:
        raise InputError(f"{name} = {short(whole)}: a number in it has very many digits")


def within_doubles(value: Any) -> bool:
    """Tell whether a double can hold a number other than 0."""
    return bool(float_info.min <= abs(value) <= LARGEST)


def beyond(what: str, value: Any) -> str:
    """Return the words that refuse a number other than 0 that no double can hold."""
    return f"{what} is beyond the range of doubles{'; write 0 if it is meant' if abs(value) < 1 else ''}"


def _from_scalar(name, value):
    """Return the value of a NumPy scalar; the value of a long double is an exact Fraction."""
    if type(value) in (float, int):
        return value
    if not abs(value) < float("inf"):
        raise InputError(f"{name} = {short(value)}: {_RANGE}")
    return Fraction(*value.as_integer_ratio())


def spells_number(text: str) -> bool:
    """Tell whether a string spells a decimal or a ratio, as ``number`` reads it."""
    return len(text.strip()) <= _LONGEST and bool(_SPELT.fullmatch(text.strip()))


def _spelt(name, text):
    bare = text.strip()
    if not spells_number(text):
        raise InputError(f"{name} = {short(text)}: it must be a decimal such as '0.2' or '1e-6', or a ratio, '1/3'")
    try:
        return Fraction(bare)
    except ZeroDivisionError:
        raise InputError(f"{name} = {short(text)}: it must not divide by zero") from None


def _from_decimal(name, value):
    if not value.is_finite() or abs(value.adjusted()) > _FARTHEST or len(value.as_tuple().digits) > _LONGEST:
        raise InputError(f"{name} = {short(value)}: {_RANGE}")
    return Fraction(value)


def _from_mpf(name, value):
    multiple, exponent = mantissa_and_exponent(value)
    if (not multiple and exponent) or abs(exponent) > _WIDEST:
        raise InputError(f"{name} = {short(value)}: {_RANGE}")
    return Fraction(multiple) * Fraction(2) ** exponent


def _array(name, value, kind):
    import numpy as np

    try:
        values = np.asarray(value, dtype=kind)
    except ValueError:  # also of a list that contains itself
        raise InputError(f"{name} = {short(value)}: {_ARRAY}") from None
    if _masked(value):
        raise InputError(f"{name} is masked, and a mask would be lost; give x.compressed(), or x.filled(number)")
    if values.ndim > _MOST_DIMENSIONS:
        raise InputError(f"{name} has {values.ndim} dimensions; give an array of at most {_MOST_DIMENSIONS}")
    return values


def _masked(value):
    """Tell whether anything in an array, or in lists of arrays, is masked."""
    import numpy as np

    if isinstance(value, (list, tuple)):
        return any(_masked(item) for item in value if not isinstance(item, (int, float)))
    return np.ma.is_masked(value)


def _read_each(name, values):
    import numpy as np

    read = np.empty(values.shape)
    for at, value in np.ndenumerate(values):
        read[at] = float(number(entry_name(name, at), value))
    return read
