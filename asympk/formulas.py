"""Formulas read safely from text: the syntax tree is walked with a white list of names, functions and sizes.

Nothing is ever evaluated as code. A formula is a Python expression made of the names that the caller allows, exact
numbers (``0.2`` is 1/5), ``+ - * / **`` and the ``FUNCTIONS`` below; ``^`` is a power, too. The value of
Piecewise((a, x < 1), (b, True)) is a where x < 1 holds, else b; relations are joined by ``and``, ``or`` and ``not``.
The size of a result is bounded before anything is computed.
"""

import ast
import re
from collections.abc import Mapping
from fractions import Fraction
from functools import partialmethod
from keyword import kwlist
from operator import add, mul, sub, truediv
from typing import Any
from unicodedata import normalize

import sympy as sp
from sympy.printing.str import StrPrinter

from asympk.errors import InputError
from asympk.naming import nearest
from asympk.numbers import FEW, KEPT_DIGITS, LARGEST, as_fraction, beyond, number, short, spells_number, within_doubles


def fractional_part(of: sp.Expr) -> sp.Expr:
    """Return the fractional part as a remainder: SymPy cannot compare its own ``frac`` with numbers above 1."""
    return sp.Mod(of, 1)


def cube_root(of: sp.Expr) -> sp.Expr:
    """Return the real cube root, that of -8 is -2, as the functions ``cbrt`` of Python and C do; SymPy's is complex."""
    return sp.cbrt(of) if of.is_nonnegative else sp.sign(of) * sp.cbrt(sp.Abs(of))


def as_printed(expr: sp.Basic) -> sp.Basic:
    """Return ``expr`` for print, with a function ``cbrt`` where it has the product that ``cube_root`` returns.

    An exact number of hundreds of digits is written with ten: Python refuses to write thousands. SymPy leaves
    Abs(Abs(x)) where the argument had a factor, which is written as Abs(x).
    """
    if long := [n for n in expr.atoms(sp.Rational) if max(abs(n.p), n.q) > _LONGEST_EXACT]:
        expr = expr.xreplace({n: n.evalf(10) for n in long})
    if expr.has(sp.Abs):
        expr = expr.xreplace({e: e.args[0] for e in expr.atoms(sp.Abs) if isinstance(e.args[0], sp.Abs)})
    return expr.replace(lambda e: e.is_Mul and bool(_rooted(e)), _as_roots) if expr.has(sp.sign) else expr


def _rooted(product: sp.Mul) -> list[sp.Expr]:
    """Return the quantities of whose real cube roots a product is made."""
    signed = [factor.args[0] for factor in product.args if isinstance(factor, sp.sign)]
    return [of for of in signed if sp.cbrt(sp.Abs(of)) in product.args]


def _as_roots(product: sp.Mul) -> sp.Expr:
    roots = {of: cube_root(of) for of in _rooted(product)}
    left = [factor for factor in product.args if not any(factor in root.args for root in roots.values())]
    return sp.Mul(*left, *map(sp.Function("cbrt"), roots))


class _Words(StrPrinter):
    """Writes relations with their signs, and a choice of words, such as stable and unstable, as a sentence."""

    def _print_Relational(self, expr: sp.core.relational.Relational) -> str:
        sign = {"==": "=", "!=": "!="}.get(expr.rel_op)
        return f"{self._print(expr.lhs)} {sign} {self._print(expr.rhs)}" if sign else super()._print_Relational(expr)

    def _print_Not(self, expr: sp.Not) -> str:
        return f"not ({self._print(expr.args[0])})"

    def _print_And(self, expr: sp.And | sp.Or, word: str = " and ") -> str:
        return word.join(f"({self._print(part)})" if isinstance(part, sp.And | sp.Or) else self._print(part)
                         for part in expr.args)

    _print_Or = partialmethod(_print_And, word=" or ")

    def choice(self, expr: sp.Piecewise) -> str:
        """Return "stable where ..., else unstable"."""
        return ", ".join(f"else {value}" if condition == sp.true else f"{value} where {self._print(condition)}"
                         for value, condition in expr.args)


def formula_in_words(expr: object) -> str:
    """Return a formula as a person reads it: relations with = and !=, real cube roots as ``cbrt``."""
    if isinstance(expr, sp.Piecewise) and all(value.is_Symbol for value, _ in expr.args):
        return _Words().choice(expr)  # within a formula a sentence would have no end
    return str(_Words().doprint(as_printed(expr) if isinstance(expr, sp.Basic) else expr))


FUNCTIONS = {"frac": fractional_part, "cbrt": cube_root} | {
    name: getattr(sp, name)
    for name in ("sqrt", "exp", "log", "ln", "sin", "cos", "tan", "cot", "sec", "csc", "asin", "acos", "atan", "atan2",
                 "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "sign", "Heaviside", "floor", "ceiling", "erf",
                 "Piecewise")
} | {name: getattr(sp, name.capitalize()) for name in ("abs", "Abs", "max", "Max", "min", "Min", "mod", "Mod")}
TWO = (sp.Max, sp.Min, sp.Mod, sp.atan2)  # functions that take two arguments
CONSTANTS = {"pi": sp.pi}
WITH_OWN_SYMBOLS = (sp.Sum, sp.Product, sp.Integral, sp.Limit)
UNEVALUATED = (sp.Derivative, sp.Subs, *WITH_OWN_SYMBOLS)  # .doit() works them out
NOT_FINITE = (sp.nan, sp.zoo, sp.oo, -sp.oo)  # what an expression has in it that has no finite value
LONGEST = 4000  # most characters of a formula
DEEPEST = 60  # most levels of the syntax tree
LARGEST_DEGREE = 64
_LONGEST_EXACT = 10**100  # the largest numerator or denominator that is written in full
_LARGEST_NUMBER = 1000  # most digits of a power of numbers
_OPERATORS = {ast.Add: add, ast.Sub: sub, ast.Mult: mul, ast.Div: truediv}
_RELATIONS = {ast.Lt: sp.Lt, ast.LtE: sp.Le, ast.Gt: sp.Gt, ast.GtE: sp.Ge}
# what to write for signs that documents have and formulas have not
_SIGNS = {"−": "-", "–": "-", "‐": "-", "·": "*", "⋅": "*", "×": "*", "÷": "/", "∕": "/", "²": "^2", "³": "^3",
          "½": "1/2", "√": "sqrt()", "≤": "<=", "≥": ">=", "π": "pi", "°": "deg", "′": "'"}
_PRIME, _WORD = "\N{MODIFIER LETTER PRIME}", "\N{MODIFIER LETTER DOUBLE PRIME}"
_OF_CONDITIONS = {"and", "or", "not", "if", "else", "True", "False"}
_RESERVED = re.compile(rf"\b({'|'.join({*kwlist} - _OF_CONDITIONS)})\b")  # Python's own words may name a quantity
_NUMBER = re.compile(r"(?<![\w.])(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?(?![\w.])", re.ASCII)


def read_formula(text: object, symbols: Mapping[str, sp.Expr], what: str = "formula") -> sp.Expr:
    """Return the SymPy expression that ``text`` spells in the names of ``symbols``; its decimals are exact.

    ``text`` may also be an int or a Fraction. Raises ``InputError`` for unknown names and functions, for text that is
    no formula, and for a formula that is too large.

    >>> x = sp.Symbol("x")
    >>> read_formula("0.2*x^2 - sin(x)/3", {"x": x})
    x**2/5 - sin(x)/3
    """
    found = _read(text, symbols, what)
    if not isinstance(found, sp.Expr):
        raise InputError(f"{what} = {short(text)}: it is a relation; give an expression")
    if not _is_real(found):
        raise InputError(f"{what} = {short(text)}: it is not a finite real expression")
    return found


def read_constant(what: str, value: Any, angles: bool = True, digits: int = KEPT_DIGITS) -> Any:
    """Return the number that a formula without names spells in a text, such as "sqrt(2)/2", "pi/4" or "75 deg".

    The text is that of a file or of the command line. The number is a Fraction, of an irrational number right to
    ``digits``. Degrees are a decimal or a ratio: "pi/4 deg" is refused. Without ``angles`` a text in degrees is
    returned as it is, and so is any other value, a string of digits included. Raises ``InputError``.

    >>> read_constant("theta", "60 deg") == read_constant("theta", "pi/3"), read_constant("m", "2^3/5")
    (True, Fraction(8, 5))
    """
    if not isinstance(value, str) or spells_number(value) or (in_degrees(value) and not angles):
        return value
    found = _in_radians(what, value) if in_degrees(value) else read_formula(value, {}, what)
    return as_fraction(what, found, digits)


def read_constants(what: str, value: Any, angles: bool = True) -> Any:
    """Return a list or a table with numbers for formulas, as ``read_constant`` does, any other value as it is."""
    if isinstance(value, list):
        return [read_constant(what, entry, angles) for entry in value]
    if isinstance(value, dict):
        return {name: read_constant(f"{what}: {name}", entry, angles) for name, entry in value.items()}
    return value


def read_number(what: str, value: Any, angles: bool = True, digits: int = KEPT_DIGITS) -> int | float | Fraction:
    """Return a number as ``numbers.number`` does; a text may also be a formula of numbers, as in ``read_constant``."""
    return number(what, read_constant(what, value, angles, digits))


def in_degrees(value: object) -> bool:
    """Tell whether ``value`` is a text in degrees, such as "75 deg"."""
    return isinstance(value, str) and value.strip().endswith("deg")


def _in_radians(what: str, text: str) -> sp.Expr:
    bare = text.strip().removesuffix("deg")
    if not spells_number(bare):
        raise InputError(f"{what} = {short(text)}: degrees are a decimal or a ratio, such as '75 deg' or '1/3 deg'; "
                         "leave deg out of a formula in radians, such as 'pi/4'")
    return read_formula(bare, {}, what) * sp.pi / 180


def _no_number(what: str, text: object) -> InputError:
    return InputError(f"{what} = {short(text)}: it must be a number, such as 0.2, or one in quotes, such as '1/3', "
                      "'sqrt(2)/2', 'pi/4' or '75 deg'")


def _no_formula(what: str, text: str, symbols: Mapping[str, sp.Expr]) -> InputError:
    if sign := _unread_sign(text):
        return InputError(f"{what} = {short(text)}: {sign}")
    if not symbols:
        return _no_number(what, text)
    return InputError(f"{what} = {short(text)}: it is not a formula; write one such as 'x + 2*y', with each * "
                      "written and each bracket closed")


def _unread_sign(text: str) -> str:
    return next((f"the sign {sign} is not read; write {_SIGNS[sign]}" for sign in _SIGNS if sign in text), "")


def read_relation(text: object, symbols: Mapping[str, sp.Expr]) -> sp.Basic:
    """Return the relation that ``text`` spells, such as ``kappa > 0`` or ``0 < r <= 1``; raises ``InputError``."""
    found = _read(text, symbols, "assumption")
    if isinstance(found, sp.Expr):
        raise InputError(f"assumption = {short(text)}: it must be a relation, such as 'kappa > 0'")
    if found == sp.false:
        raise InputError(f"assumption = {short(text)}: it never holds; give one that does, such as 'kappa > 0'")
    return found


def names_in(entry: object) -> set[str]:
    """Return the names in the formulas of a value of TOML, a table or a list included, without functions called.

    >>> sorted(names_in(["f*sin(alpha)", {"force": "-k*X'"}]))
    ["X'", 'alpha', 'f', 'k']
    """
    if isinstance(entry, str):
        return {*re.findall(r"\b\w+'*(?![\w']|\s*\()", normalize("NFKC", entry))}
    parts = entry.values() if isinstance(entry, dict) else entry if isinstance(entry, list) else ()
    return set().union(*map(names_in, parts))


def _read(text: object, symbols: Mapping[str, sp.Expr], what: str) -> sp.Basic:
    if isinstance(text, int | Fraction) and not isinstance(text, bool):
        return sp.Rational(text)
    if not isinstance(text, str):
        raise InputError(f"{what} = {short(text)}: it must be a formula in text, such as 'x + 2*y'")
    if len(text) > LONGEST:
        raise InputError(f"{what}: a formula of {len(text)} characters; the longest that is read has {LONGEST}")
    for name in sorted(symbols.keys() & _OF_CONDITIONS):
        raise InputError(f"names: {name} is reserved for conditions, as in 'x > 0 and y > 0'; rename it")
    plain = {_plain(normalize("NFKC", name)): name for name in symbols}  # as Python spells names
    for name in sorted(symbols.keys() - plain.values()):
        raise InputError(f"{what}: a formula cannot tell {name} from {plain[_plain(normalize('NFKC', name))]}, which "
                         "has the same letters in other signs; rename one")
    source = _plain(text.replace("^", "**").replace("#", "?")).strip()  # or what follows would be Python's comment
    try:
        tree = ast.parse(source, mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise _no_formula(what, text, symbols) from None
    known = {spelt: symbols[name] for spelt, name in plain.items()}
    try:
        return _Reader(known, what, text, source).read(tree.body, 0)
    except InputError:
        raise
    except (ArithmeticError, ValueError):  # of SymPy, which has no digits for an integer as large as exp(10^6)
        raise InputError(f"{what} = {short(text)}: a number in it is too large; write it without") from None


def _is_real(expr: sp.Expr) -> bool:
    """Tell whether no part of an expression is a number that is not finite or not real, as sqrt(-1) and asin(2)."""
    return not (expr.has(*NOT_FINITE, sp.I) or any(
        part.is_real is False for part in expr.atoms(sp.Function, sp.Pow) if part.is_number))


def _degree(expr: sp.Expr) -> int:
    """Return a bound on the degree of ``expr`` after expansion; a function counts as 1, and so does a number alone."""
    if expr.is_number:
        return 1
    if expr.is_Add:
        return max(map(_degree, expr.args))
    if expr.is_Mul:
        return sum(_degree(factor) for factor in expr.args if not factor.is_number)
    if expr.is_Pow and expr.exp.is_Integer:
        return int(abs(expr.exp)) * _degree(expr.base)
    return 1


def _plain(text: str) -> str:
    """Replace primes, and words such as lambda, by names of Python that no bare key of a TOML file can spell."""
    text = re.sub(r"(?<=\w)'+", lambda primes: _PRIME * len(primes[0]), text)
    return _RESERVED.sub(rf"\g<0>{_WORD}", text)


def _as_written(name: str) -> str:
    return name.replace(_WORD, "").replace(_PRIME, "'")


class _Reader:
    """The reader of one formula, with its symbols and the words ``what`` that a message calls it by."""

    def __init__(self, symbols: Mapping[str, sp.Expr], what: str, text: str, source: str):
        self.symbols, self.what, self.text, self.source = symbols, what, text, source

    def read(self, node: ast.AST, depth: int) -> sp.Basic:
        if depth > DEEPEST:
            raise self._refuse(f"it is nested deeper than {DEEPEST}")
        match node:
            case ast.Constant():
                return self._number(node)
            case ast.Name():
                return self._name(node.id)
            case ast.UnaryOp(op=ast.USub()):
                return -self.read(node.operand, depth + 1)
            case ast.UnaryOp(op=ast.UAdd()):
                return self.read(node.operand, depth + 1)
            case ast.Compare() | ast.BoolOp() | ast.BinOp(op=ast.BitAnd() | ast.BitOr()) | ast.UnaryOp():
                return self._condition(node, depth)
            case ast.BinOp():
                return self._operations(node, depth)
            case ast.Call():
                return self._call(node, depth)
        if not self.symbols:
            raise _no_number(self.what, self.text)
        raise self._refuse("it may hold numbers, names, + - * / ** and functions")

    def _number(self, node: ast.Constant) -> sp.Rational:
        spelled = ast.get_source_segment(self.source, node) or ""
        if isinstance(node.value, bool) or not _NUMBER.fullmatch(spelled):
            raise self._refuse(f"{short(spelled or node.value)} is not a number")
        value = Fraction(spelled)
        if value and not within_doubles(value):
            raise self._refuse(f"{short(spelled)} is beyond the range of doubles")
        return sp.Rational(value)

    def _name(self, name: str) -> sp.Expr:
        if name in self.symbols:
            return self.symbols[name]
        if name in CONSTANTS:
            return CONSTANTS[name]
        if name in FUNCTIONS:
            raise self._refuse(f"{name} is a function; write {name}(x), and a power of it {name}(x)^2")
        near = nearest(name, [*self.symbols, *CONSTANTS]) or nearest(name.lower(), CONSTANTS) or _SIGNS.get(name)
        if not near and (sign := _unread_sign(name)):
            raise self._refuse(sign)
        if not self.symbols and not near:
            raise _no_number(self.what, self.text)
        had = ", ".join(map(_as_written, self.symbols)) or "none"
        hint = f"; did you mean {_as_written(near)}?" if near else f"; it has {had}"
        hint += "; a parameter needs a number under [values]" if self.symbols else ""
        if name == "t":
            hint = '; a system that depends on the time says so by time = "t"'
        raise self._refuse(f"the name {_as_written(name)} is unknown{hint}")

    def _operations(self, node: ast.AST, depth: int) -> sp.Expr:
        """Read operations from left to right: a sum of many terms is no deeper than the deepest of them."""
        following = []
        while isinstance(node, ast.BinOp):
            following.append(node)
            node = node.left
        value = self._expression(node, depth + 1)
        for node in reversed(following):
            value = self._operation(node, value, self._expression(node.right, depth + 1))
        factor = value.as_coeff_Mul()[0]
        if factor.is_Rational and factor and not within_doubles(factor):
            raise self._refuse("a number in it is beyond the range of doubles")
        if _degree(value) > LARGEST_DEGREE:
            raise self._refuse(f"a degree beyond {LARGEST_DEGREE}")
        return value

    def _operation(self, node: ast.BinOp, left: sp.Expr, right: sp.Expr) -> sp.Expr:
        if isinstance(node.op, ast.Pow):
            return self._power(left, right)
        if type(node.op) not in _OPERATORS:
            raise self._refuse("the operators are + - * / **")
        if isinstance(node.op, ast.Div) and right == 0:
            raise self._refuse("it divides by zero")
        return _OPERATORS[type(node.op)](left, right)

    def _power(self, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        if not base.is_number and exponent.is_number and not _degree(base) * abs(exponent) <= LARGEST_DEGREE:
            raise self._refuse(f"a degree beyond {LARGEST_DEGREE}")
        if base.is_number and exponent.is_number and abs(exponent) * len(str(base)) > _LARGEST_NUMBER:
            raise self._refuse(f"a number of more than {_LARGEST_NUMBER} digits")
        if base == 0 and not exponent.is_positive:
            raise self._refuse("a power of zero that is no number")
        return base**exponent

    def _call(self, node: ast.Call, depth: int) -> sp.Expr:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if not name or name in self.symbols.keys() - FUNCTIONS.keys():
            called = _as_written(ast.get_source_segment(self.source, node.func) or "")
            raise self._refuse(f"{short(called)} is no function; write the * of a product, as in 2*(x + y)")
        if name not in FUNCTIONS:
            near = nearest(name, FUNCTIONS)
            hint = f"did you mean {near}? " if near else ""
            raise self._refuse(f"the function {name} is unknown; {hint}there are {', '.join(FUNCTIONS)}")
        if FUNCTIONS[name] is sp.Piecewise:
            return sp.Piecewise(*(self._piece(piece, depth + 1) for piece in [*node.args, *node.keywords] or [node]))
        two = FUNCTIONS[name] in TWO
        if len(node.args) != 1 + two or node.keywords:
            raise self._refuse(f"{name} takes {'two arguments' if two else 'one argument'}")
        arguments = [self._expression(argument, depth + 1) for argument in node.args]
        for argument in arguments:
            self._require_size(argument)
        if FUNCTIONS[name] is sp.Mod:
            if arguments[1] == 0:
                raise self._refuse("it divides by zero")
            self._require_size(arguments[0] / arguments[1])
        found = FUNCTIONS[name](*arguments)
        if found.is_number and (few := found.evalf(FEW)).is_real and few and not within_doubles(few):
            raise self._refuse(beyond("a number in it", few))  # a polynomial in it would have as high a degree
        return found

    def _require_size(self, argument: sp.Expr) -> None:
        """Refuse a constant whose function takes as many digits as it has before its point: cos(exp(exp(20)))."""
        few = argument.evalf(FEW) if argument.is_number else sp.S.Zero
        if few.is_real is False:
            raise self._refuse("a number in it is not real")
        if (abs(few) > LARGEST) == sp.true:
            raise self._refuse("a number in it is beyond the range of doubles")

    def _piece(self, node: ast.AST, depth: int) -> tuple[sp.Expr, sp.Basic]:
        if not isinstance(node, ast.Tuple) or len(node.elts) != 2:
            raise self._refuse("Piecewise takes pairs of a value and a relation, the last one True")
        return self._expression(node.elts[0], depth), self._condition(node.elts[1], depth)

    def _condition(self, node: ast.AST, depth: int) -> sp.Basic:
        match node:
            case ast.Constant(value=bool()):
                return sp.true if node.value else sp.false
            case ast.BoolOp() | ast.BinOp(op=ast.BitAnd() | ast.BitOr()):
                parts = node.values if isinstance(node, ast.BoolOp) else (node.left, node.right)
                join = sp.And if isinstance(node.op, ast.And | ast.BitAnd) else sp.Or
                return join(*(self._condition(part, depth + 1) for part in parts))
            case ast.UnaryOp(op=ast.Not() | ast.Invert()):
                return sp.Not(self._condition(node.operand, depth + 1))
            case ast.Compare():
                return self._relation(node, depth)
        raise self._refuse("a condition is a relation, such as x < 1, or several with and, or, not between")

    def _relation(self, node: ast.Compare, depth: int) -> sp.Basic:
        sides = [self._expression(side, depth + 1) for side in (node.left, *node.comparators)]
        if not all(map(_is_real, sides)):
            raise self._refuse("a side of a relation is not a finite real expression")
        if any(type(op) not in _RELATIONS for op in node.ops):
            raise self._refuse("the relations are < <= > >=")
        pairs = zip(node.ops, sides, sides[1:], strict=False)
        return sp.And(*(_RELATIONS[type(op)](a, b) for op, a, b in pairs))

    def _expression(self, node: ast.AST, depth: int) -> sp.Expr:
        found = self.read(node, depth)
        if not isinstance(found, sp.Expr):
            raise self._refuse("a relation stands inside an expression")
        return found

    def _refuse(self, reason: str) -> InputError:
        return InputError(f"{self.what} = {short(self.text)}: {reason}")
