"""A derivation recorded once and replayed on numbers: straight-line code, for floats, mpmath numbers and arrays.

A ``Node`` adds, multiplies and divides like any coefficient, but each operation writes a line on its ``Tape``.
``Tape.function`` compiles those lines that the outputs need. Whole numbers and fractions stand in the text exactly.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any

import sympy as sp

Definitions = tuple[tuple[sp.Symbol, sp.Expr], ...]


def _operators(sign: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return the two methods of a ``Node`` for the operator ``sign``, with the node on the left and on the right."""
    return lambda node, c: node.tape.write(sign, node, c), lambda node, c: node.tape.write(sign, c, node)


class Node:
    """A number that is not known yet: ``sign`` times the value of the line ``name`` of a tape."""

    __slots__ = ("name", "sign", "tape")

    def __init__(self, tape: "Tape", name: str, sign: int = 1):
        self.tape, self.name, self.sign = tape, name, sign

    __add__, __radd__ = _operators("+")
    __sub__, __rsub__ = _operators("-")
    __mul__, __rmul__ = _operators("*")
    __truediv__, __rtruediv__ = _operators("/")

    def __neg__(self) -> "Node":
        return Node(self.tape, self.name, -self.sign)


class Tape:
    """Lines ``t1 = a * b``, each distinct one once, in the order in which they are needed."""

    def __init__(self, *inputs: str):
        self.inputs = inputs
        self.lines: dict = {}

    def node(self, name: str) -> Node:
        """Return the input called ``name``."""
        return Node(self, name)

    def write(self, operation: str, a: Any, b: Any) -> Any:
        """Return ``a operation b``: a node, or 0 or plus or minus an operand where the operation is trivial."""
        if not all(isinstance(c, Node | int | Fraction) for c in (a, b)):
            return NotImplemented
        a, b = _whole(a), _whole(b)
        trivial = _trivial(operation, a, b)
        if trivial is not None:
            return trivial
        if isinstance(a, Fraction) or isinstance(b, Fraction):
            return self._fraction(operation, a, b)
        return self._signed(operation, *_unsigned(a), *_unsigned(b))

    def _signed(self, operation, a, p, b, q):
        """Write an operation on p a and q b, p, q = 1 or -1: a sign goes to the result without a line or rounding."""
        if operation in "*/":
            return self._line(f"{a} {operation} {b}", p * q)
        q = q if operation == "+" else -q
        if p == q:
            return self._line(f"{a} + {b}", p)
        return self._line(f"{a} - {b}" if p > 0 else f"{b} - {a}")

    def _fraction(self, operation, a, b):
        # p/q in the text would be rounded to a float, whatever the numbers are
        (a, p), (b, q) = ((c.numerator, c.denominator) if isinstance(c, Fraction) else (c, 1) for c in (a, b))
        if operation == "*":
            return self.write("/", self.write("*", a, b), p * q)
        if operation == "/":
            return self.write("/", self.write("*", a, q), self.write("*", b, p))
        return self.write("/", self.write(operation, self.write("*", a, q), self.write("*", b, p)), p * q)

    def call(self, name: str, *args: Any) -> Any:
        """Return a node for ``name(*args)``, or its value if all ``args`` are numbers and the value rational."""
        if not any(isinstance(a, Node) for a in args):
            exact = getattr(sp, name)(*map(sp.Rational, args))
            if exact.is_Rational:
                return Fraction(int(exact.p), int(exact.q))
        return self._line(f"{name}({', '.join(map(_text, args))})")

    def _line(self, text, sign=1):
        return Node(self, self.lines.setdefault(text, f"t{len(self.lines)}"), sign)

    def function(self, result: tuple, known: Mapping[str, Any] | Iterable[tuple[str, Any]]=()) -> Callable[..., tuple]:
        """Compile ``f(*inputs)``, which returns ``result``, nested tuples of nodes and strings, with numbers for nodes.

        Every function that a line calls is an input or stands in ``known``, {name: function or constant}.
        """
        return self._compiled(result, dict(known), "{}")

    def definitions(
        self, result: tuple, known: Mapping[str, Any], inputs: Iterable[sp.Symbol]
    ) -> tuple[Definitions, tuple[sp.Expr, ...]]:
        """Return the lines that ``result`` needs as pairs (symbol, expression), and ``result`` in these symbols.

        Each expression contains the inputs and symbols of earlier lines.
        """
        found: list[tuple[sp.Symbol, sp.Expr]] = []

        def define(expr):
            found.append((sp.Dummy(f"t{len(found)}"), expr))
            return found[-1][0]

        values = self._compiled(result, {**known, "define": define}, "define({})")(*inputs)
        return tuple(found), tuple(sp.sympify(v, strict=True) for v in values)

    def _compiled(self, result, space, line_as):
        wanted, body = set[str](), list[str]()
        text = _nest(result, wanted, space)
        for line, name in reversed(self.lines.items()):
            if name in wanted:
                wanted.update(re.findall(r"\w+", line))
                body.append(f"    {name} = {line_as.format(line)}")
        head = f"def compiled({', '.join(self.inputs)}):"
        exec("\n".join([head, *reversed(body), f"    return {text}"]), space)
        return space["compiled"]


def _nest(value, names, space):
    """Return the text of nested tuples; add its names to ``names``, the classes of named tuples to ``space``."""
    if isinstance(value, str):
        return repr(value)
    if not isinstance(value, tuple):
        names.add(value.name if isinstance(value, Node) else "")
        return _text(value)
    kind = type(value).__name__ if hasattr(value, "_fields") else ""
    space |= {kind: type(value)} if kind else {}
    return f"{kind}({''.join(_nest(v, names, space) + ', ' for v in value)})"


def _text(a):
    if isinstance(a, Node):
        return a.name if a.sign > 0 else f"(-{a.name})"
    return str(a) if isinstance(a, int) and a >= 0 else f"({a})"


def _unsigned(a):
    """Return the text of a node or a whole number without its sign, and its sign."""
    return (a.name, a.sign) if isinstance(a, Node) else (str(abs(a)), -1 if a < 0 else 1)


def _whole(a):
    """Return a fraction whose denominator is 1 as an int, and anything else unchanged."""
    return a.numerator if isinstance(a, Fraction) and a.denominator == 1 else a


def _trivial(operation, a, b):
    """Return the value of an operation that needs no line, or None."""
    if operation == "*" and 0 in (a, b):
        return 0
    if operation == "/" and a == 0:
        return 0
    if operation in "+-" and b == 0:
        return a
    if operation in "+-" and a == 0:
        return b if operation == "+" else -b
    if operation in "*/" and b in (1, -1):
        return a if b == 1 else -a
    if operation == "*" and a in (1, -1):
        return b if a == 1 else -b
    return None
