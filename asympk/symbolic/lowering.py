r"""The only door from symbols to numbers: expressions as a function of numbers, or as C source.

A rational constant stays exact until a number meets it: the ``mpmath`` target divides at the precision of the call,
the others round p/q once. One emitter, ``_emission``, writes the text for every target and shares subexpressions, so
the same expressions give the same source in every run. ``lower`` checks its input; ``_compiled`` executes the text.
``without_tables`` finds each ``Piecewise`` of many pieces, such as a record, and ``as_tree`` makes it a binary tree.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property, lru_cache, partial
from importlib import import_module
from itertools import chain, pairwise
from threading import local
from typing import Any, Literal, overload
from unicodedata import name as unicode_name
from unicodedata import normalize

import sympy as sp
from mpmath.libmp import dps_to_prec
from sympy.printing.codeprinter import PrintMethodNotImplementedError

from asympk.errors import InputError, OutOfRange
from asympk.formulas import NOT_FINITE, UNEVALUATED
from asympk.multiprecision import as_mpf, in_context, private_context
from asympk.naming import named
from asympk.numbers import Number, common_shape, flag, number, numbers, short
from asympk.shown import Card, ShownAsFormulas, cut
from asympk.symbolic.derivatives import directional_derivatives
from asympk.symbolic.inverses import in_order, without_inverses
from asympk.symbolic.long import atoms, symbols_in
from asympk.symbolic.penetration import computed
from asympk.symbolic.printers import PRINTERS, printer_of
from asympk.symbolic.reading import entries_of, expression, unused_symbol
from asympk.symbolic.removable import limits_on_floats

BRANCHING = (sp.Piecewise, sp.sign, sp.Heaviside, sp.Max, sp.Min, sp.floor, sp.ceiling, sp.Mod)
_LARGEST = 2**1024  # no double is this large
SHORTEST = 8  # pieces of a table that is worth a tree


class NoFunction(InputError):
    """The numbers of a target have no function, of this ``name``, that an expression contains."""

    def __init__(self, message: str, name: str = "") -> None:
        super().__init__(message)
        self.name = name


@dataclass(frozen=True, repr=False)
class Lowered(ShownAsFormulas):
    """A function of numbers, ``outputs`` in terms of ``args``, compiled for ``target`` at the first call.

    A call returns one value, a tuple if lowered from a sequence, or a dict by ``keys`` if lowered from a ``Dict``. Each
    of ``directions`` holds the rates of all ``args``; a call then returns the derivatives of the outputs along every
    direction, output by output. ``definitions`` are pairs of a symbol in the outputs and its expression. The function
    pickles as its expressions. Raises ``OutOfRange`` where a value is not a finite real number.
    """

    args: tuple[sp.Symbol, ...]
    outputs: tuple[sp.Expr, ...]
    target: str
    keys: tuple[str, ...] | None = None
    single: bool = False
    name: str = "f"
    directions: tuple[tuple[sp.Expr, ...], ...] = ()
    definitions: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()

    def _card(self) -> Card:
        names = self.keys or [f"{self.name}[{k}]" if not self.single else self.name for k in range(len(self.outputs))]
        title = f"Function of {', '.join(map(str, self.args)):.60} on the numbers of {self.target}"
        return Card(title, tuple(zip(names, self.outputs, strict=True)))

    def __call__(self, *values: Any) -> Any:
        if len(values) != len(self.args):
            raise InputError(f"{len(values)} values given; the arguments are ({', '.join(map(str, self.args))})")
        found = _RUN[self.target](self, values)
        if self.keys is not None:
            return dict(zip(self.keys, found, strict=True))
        return found[0] if self.single else found

    def to_digits(self, digits: int, *values: Number) -> tuple[Number, ...]:
        """Return the outputs to ``digits`` digits, whatever mpmath's precision is; for target ``"mpmath"`` only."""
        return _mpmath(self, values, dps_to_prec(digits))

    def __reduce__(self) -> tuple:
        return Lowered, tuple(getattr(self, f.name) for f in fields(self))

    @property
    def source(self) -> str:
        """The text of the function, called ``name``: it returns one value, or a tuple."""
        arguments, shared, outputs = _emission(self)
        lines = [f"    {symbol} = {value}" for symbol, value in shared]
        result = outputs[0] if self.single else f"({' '.join(f'{value},' for value in outputs)})"
        return "\n".join([f"def {self.name}({', '.join(arguments)}):", *lines, f"    return {result}", ""])

    @cached_property
    def compiled(self) -> Callable[..., tuple]:
        """The bare function of numbers of the target's own kind, without checks; always returns a tuple."""
        return _compiled(self)


@overload
def lower(
    args: Any, expr: Any, target: Literal["c"], name: str = "f", branching: bool = False, definitions: Any = ()
) -> str: ...


@overload
def lower(
    args: Any, expr: Any, target: Literal["numpy", "mpmath", "math"] = "numpy", name: str = "f",
    branching: bool = False, definitions: Any = (),
) -> Lowered: ...


@overload
def lower(
    args: Any, expr: Any, target: str, name: str = "f", branching: bool = False, definitions: Any = ()
) -> Any: ...


def lower(
    args: Any, expr: Any, target: str = "numpy", name: str = "f", branching: bool = False, definitions: Any = ()
) -> Any:
    """Turn ``expr``, an expression or a sequence or ``Dict`` of them, into a function of ``args``.

    ``target`` is ``"numpy"`` (arrays that broadcast), ``"math"`` (floats), ``"mpmath"`` (the working precision of the
    call; strings and fractions are taken exactly), or ``"c"``, which returns the source of a C function: one value is
    returned, several go to ``out``. ``name`` is the function's name in its source. A set of arguments is sorted. An
    argument with a prime or a Greek letter has a name in plain letters there, the rate theta' the name theta_rate.
    ``definitions`` are pairs of a symbol in ``expr`` and its expression in ``args`` and the symbols defined before.
    Raises ``InputError`` for symbols that are not arguments, for floats, for constants that are not finite and real,
    and, unless ``branching``, for functions that branch, such as a Piecewise.
    """
    target, branching = named("target", target, PRINTERS), flag("branching", branching)
    (args, put), (outputs, keys, single) = _arguments(args), _outputs(expr)
    definitions, known = _definitions(definitions), {*args}
    for symbol, e in definitions:
        _check(e, args, known, branching)
        known.add(symbol)
    for output in (*outputs, *(e for _, e in definitions)):
        _check(output, args, known, branching)
        if target != "mpmath" and any(abs(n) >= _LARGEST for n in atoms(output, sp.Rational)):
            raise InputError(f"{short(output)} has a constant beyond all doubles; use target 'mpmath'")
    if not (isinstance(name, str) and name.isidentifier() and name.isascii()):
        raise InputError(f"name {short(name)} cannot name a function; give letters, digits and underscores")
    if name in printer_of(target).reserved_words:
        raise InputError(f"name {name!r} has a meaning in the source for target {target!r}; give another")
    args, outputs = (tuple(e.xreplace(put) for e in exprs) for exprs in (args, outputs))
    definitions = tuple((t, e.xreplace(put)) for t, e in definitions)
    lowered = Lowered(args, outputs, target, keys, single, name, definitions=definitions)
    _emission(lowered)
    return _c_source(lowered) if target == "c" else lowered


def plain_names_of(symbols: Iterable[sp.Symbol]) -> dict[sp.Symbol, sp.Symbol]:
    """Return {theta': theta_rate}: for every name with a prime or a letter beyond ASCII, a symbol in plain letters."""
    named, put = [*symbols], dict[sp.Symbol, sp.Symbol]()
    for given in named:
        plain = "".join(map(_plain_letter, normalize("NFKD", given.name.replace("'", "_rate"))))
        if plain != given.name:
            put[given] = unused_symbol(plain, (*named, *put.values()), **given.assumptions0)
    return put


def _plain_letter(letter):
    """Return a letter of ASCII as it is, one of another alphabet by its name, theta or Theta, and an accent as ""."""
    kind, _, name = unicode_name(letter, "").rpartition(" LETTER ")
    return letter if letter.isascii() else name.lower().capitalize() if kind.endswith("CAPITAL") else name.lower()


def _c_source(lowered):
    """Return C source: ``double name(..)`` for one expression, ``void name(.., double out[n])`` for several."""
    arguments, shared, outputs = _emission(lowered)
    used = sp.Tuple(*lowered.outputs, *(e for _, e in lowered.definitions)).free_symbols
    parameters = [f"double {a}" for a in arguments]
    lines = [f"    (void){text};" for a, text in zip(lowered.args, arguments, strict=True) if a not in used]
    lines += [f"    const double {symbol} = {value};" for symbol, value in shared]
    if lowered.single:
        head, results = f"double {lowered.name}", [f"    return {outputs[0]};"]
    else:
        head, results = f"void {lowered.name}", [f"    out[{i}] = {value};" for i, value in enumerate(outputs)]
        parameters.append(f"double out[{len(outputs)}]")
    return "\n".join([f"{head}({', '.join(parameters) or 'void'})", "{", *lines, *results, "}", ""])


@lru_cache(maxsize=512)
def _emission(lowered):
    """Return the texts of the arguments, of the shared subexpressions (pairs of name and value), and of the outputs."""
    shared, outputs, eliminated = _parts(replace(lowered, target="", name="", keys=None, single=False))
    if unworked := atoms(sp.Tuple(*outputs, *(e for _, e in shared)), sp.Derivative, sp.Subs):
        raise InputError(f"{min(unworked, key=str).expr.func} has no derivative that can be written; give a smooth "
                         "function, or write the jump as a friction")
    text = partial(_text, lowered.target, "none" if eliminated else None)  # the many sums of steps are not sorted
    shared = [(text(t), text(as_tree(e))) for t, e in shared]
    return [*map(text, lowered.args)], shared, [*map(text, outputs)]


@lru_cache(maxsize=16384)  # the modes of a system share most expressions
def _text(target: str, order: str | None, expr: sp.Expr) -> str:
    printer = printer_of(target, order=order)
    try:
        found = printer.doprint(expr)
    except PrintMethodNotImplementedError as reason:
        unknown = str(reason).splitlines()[0].rpartition(" ")[2]
        others = "; target 'mpmath' has more functions" * (target != "mpmath")
        raise NoFunction(f"target {target!r} has no {unknown}{others}", unknown) from None
    if foreign := set(getattr(printer, "module_imports", {})) - {target}:
        raise NoFunction(f"target {target!r} would need {', '.join(foreign)} here; use target 'mpmath'")
    return found


def _unused_symbols(lowered, **assumptions):
    taken = {a.name for a in lowered.args}
    return (t for t in sp.numbered_symbols("t", **assumptions) if t.name not in taken)


@lru_cache(maxsize=256)
def _parts(lowered):
    """Return the shared subexpressions and the outputs, the same for all targets, and whether they eliminate."""
    if lowered.definitions:  # the defined symbols are renamed so that no argument has their names
        names = dict(zip((t for t, _ in lowered.definitions), _unused_symbols(lowered), strict=False))
        shared = [(names[t], e.xreplace(names)) for t, e in lowered.definitions]
        return shared, [output.xreplace(names) for output in lowered.outputs], False
    unused_symbols = _unused_symbols(lowered, **({"real": True} if lowered.directions else {}))
    shared, found, steps, forms = _shared((*lowered.outputs, *chain(*lowered.directions)), unused_symbols)
    if lowered.directions:
        count, n = len(lowered.outputs), len(lowered.args)
        rows = (found[k : k + n] for k in range(count, len(found), n))
        directions = [{a: r for a, r in zip(lowered.args, row, strict=True) if r != 0} for row in rows]
        shared, found = directional_derivatives(shared, found[:count], directions, unused_symbols, steps, forms)
    return _contained(found, shared) if steps else shared, found, bool(steps)


def _contained(outputs, shared):
    """Return the shared subexpressions without those that no output contains, as solutions of eliminations may be."""
    needed, kept = sp.Tuple(*outputs).free_symbols, []
    for symbol, expr in reversed(shared):
        if symbol in needed:
            needed |= expr.free_symbols
            kept.insert(0, (symbol, expr))
    return kept


def _shared(outputs, unused_symbols):
    """Return the shared subexpressions, the outputs in terms of these, and the steps and forms of eliminations."""
    tables, outputs = without_tables(map(computed, outputs), unused_symbols)
    entries, steps, outputs, forms = without_inverses(outputs, unused_symbols)
    shared, found = sp.cse([*(e for _, e in entries), *outputs], symbols=unused_symbols, order="canonical")
    named = [(symbol, e) for (symbol, _), e in zip(entries, found, strict=False)]
    parts = [*tables, *shared, *named, *steps]
    return in_order(parts) if entries else parts, found[len(entries) :], {t for t, _ in steps}, forms


def without_tables(
    exprs: Iterable[sp.Expr], unused_symbols: Iterator[sp.Symbol]
) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    """Return the tables in ``exprs``, each with a symbol from ``unused_symbols``, and ``exprs`` with these symbols.

    A table is a ``Piecewise`` of many pieces along one variable, as a record of the ground's motion. Its conditions
    are tested in a binary tree, in a time proportional to the logarithm of the number of pieces.
    """
    exprs = list(exprs)
    symbols: dict[sp.Basic, sp.Symbol] = {}
    for expr in exprs:
        for table in _outer_tables(expr):
            symbols[table] = symbols.get(table) or next(unused_symbols)
    return [(symbol, table) for table, symbol in symbols.items()], [expr.xreplace(symbols) for expr in exprs]


def _outer_tables(expr: sp.Expr) -> Iterator[sp.Basic]:
    if not atoms(expr, sp.Piecewise):
        return
    walk = sp.preorder_traversal(expr)
    for part in walk:
        if isinstance(part, sp.Piecewise) and is_table(part):
            walk.skip()
            yield part


@lru_cache(maxsize=256)
def is_table(expr: sp.Piecewise) -> bool:
    """Tell whether the pieces of a ``Piecewise`` are many intervals, each beginning before the one before it ends."""
    if len(expr.args) < SHORTEST:
        return False
    bounds = [_ends_of(piece.cond) for piece in expr.args]
    known = {end.lhs for pair in bounds for end in pair if end is not None}
    return len(known) == 1 and all(
        end is not None and (begin is None or begin.rhs <= end.rhs) and (last is None or end.rhs < last.rhs)
        for (_, end), (begin, last) in pairwise(bounds)
    )


def _ends_of(condition: sp.Basic) -> tuple[Any, Any]:
    """Return the relations ``variable >= number`` and ``variable <= number`` of an interval, or None for each."""
    if isinstance(condition, sp.Or):
        return _union([_ends_of(part) for part in condition.args])
    begin = end = None
    for relation in sp.And.make_args(condition):
        if isinstance(relation, sp.core.relational.Relational) and relation.lhs.is_number:
            relation = relation.reversed
        if isinstance(relation, sp.Lt | sp.Le) and relation.rhs.is_number and relation.lhs.is_Symbol:
            end = relation
        elif isinstance(relation, sp.Gt | sp.Ge) and relation.rhs.is_number and relation.lhs.is_Symbol:
            begin = relation
        elif relation is not sp.true:
            return None, None
    return begin, end


def _union(sides: list[tuple[Any, Any]]) -> tuple[Any, Any]:
    """Return the bounds of the union of intervals that overlap or touch, or (None, None) for other intervals."""
    if any(end is None for _, end in sides):
        return None, None
    sides = sorted(sides, key=lambda side: (side[1].rhs, str(side)))
    if any(begin is not None and begin.rhs > last.rhs for (_, last), (begin, _) in pairwise(sides)):
        return None, None
    begins = [begin for begin, _ in sides]
    first = None if None in begins else min(begins, key=lambda begin: begin.rhs)
    return first, sides[-1][1]


def as_tree(table: sp.Expr) -> sp.Expr:
    """Return a table as a tree of ``Piecewise`` of two pieces each, with equal values; else return ``table``."""
    if not (isinstance(table, sp.Piecewise) and is_table(table)):
        return table
    begins, ends = zip(*(_ends_of(piece.cond) for piece in table.args), strict=True)
    first, last = begins[0], ends[-1]
    leaves = [piece.expr for piece in table.args]
    if last is not None:
        leaves[-1] = sp.Piecewise((leaves[-1], last), evaluate=False)
    tree = _halved(leaves, ends)
    return sp.Piecewise((tree, first), evaluate=False) if first is not None else tree


def _halved(leaves: Sequence[sp.Expr], ends: Sequence[Any]) -> sp.Expr:
    """Return the tree of ``leaves``, each of which holds up to its end."""
    if len(leaves) == 1:
        return leaves[0]
    half = len(leaves) // 2
    left, right = _halved(leaves[:half], ends[:half]), _halved(leaves[half:], ends[half:])
    return sp.Piecewise((left, ends[half - 1]), (right, True), evaluate=False)


@lru_cache(maxsize=512)
def _compiled(lowered):
    lowered = replace(lowered, single=False)
    if lowered.target == "math":
        wide = replace(lowered, target="mpmath")
        return without_overflow(lowered.source, lowered.outputs, partial(_executed, wide))
    return _executed(lowered, _OWN if lowered.target == "mpmath" else import_module(lowered.target))


def _executed(lowered, functions):
    space = {lowered.target: functions}
    exec(lowered.source, space)
    return space[lowered.name]


def without_overflow(
    source: str, exprs: Iterable[sp.Expr], wider: Callable[[Any], Callable[..., tuple]]
) -> Callable[..., tuple]:
    """Return the function of floats with this source, which computes ``exprs`` even where parts overflow or are 0/0.

    1/cosh(1000)^2 is 0, although cosh(1000) overflows, and sin(x)/x is 1 at 0. ``wider`` returns the same function for
    numbers of a context whose exponents are unbounded, as of ``WIDE``; it is called where the floats overflow or divide
    by 0. Raises ``OverflowError`` where the result does, and ``ZeroDivisionError`` where it has no limit.
    """
    head, *body = source.splitlines()
    name, arguments = head[4:-2].split("(")

    def once(made: Callable[[], Callable[..., tuple]]) -> Callable[[], Callable[..., tuple]]:
        return cache(lambda: _diverging if is_tower(exprs) else made())

    wide, limits = once(lambda: on_floats(wider(WIDE))), once(lambda: limits_on_floats(wider))
    space: dict[str, Any] = {"math": math, "_wide_": wide, "_limits_": limits}
    lines = [head, "    try:", *(f"    {line}" for line in body)]
    lines += ["    except OverflowError:", f"        return _wide_()({arguments})"]
    lines += ["    except ZeroDivisionError:", f"        return _limits_()({arguments})"]
    exec("\n".join(lines), space)
    return space[name]


def on_floats(function: Callable[..., tuple]) -> Callable[..., tuple]:
    """Return a function of ``WIDE`` numbers as one of floats; ``OverflowError`` where a result is no finite float."""

    def found(*given: float) -> tuple:
        try:
            values = tuple(map(float, function(*map(WIDE.mpf, given))))
        except TypeError:  # the number is complex
            values = (math.nan,)
        if not all(map(math.isfinite, values)):
            raise OverflowError
        return values

    return found


def _diverging(*_: float) -> tuple:
    raise OverflowError


def is_tower(exprs: Iterable[sp.Expr]) -> bool:
    """Tell whether a function has an exponential in its argument, on whose huge values it may not terminate."""
    parts = atoms(sp.Tuple(*exprs), sp.Pow, sp.Function)
    growing = {e for e in parts if isinstance(e, sp.exp | sp.cosh | sp.sinh) or (e.is_Pow and symbols_in(e.exp))}
    outer = growing | {e for e in parts if not e.is_Pow and not isinstance(e, sp.log)}
    return any(atoms(arg, sp.Pow, sp.Function) & growing for e in outer for arg in e.args)


class _OwnContext(local):
    """An mpmath context for each thread; the compiled sources use it under the name ``mpmath``."""

    def __init__(self):
        self.context = private_context(15)

    def __getattr__(self, name):
        return getattr(self.context, name)


_OWN, WIDE = _OwnContext(), _OwnContext()  # at the precision of the call, and at that of floats


def _numpy(lowered, values):
    import numpy as np

    arrays = [numbers(str(a), v).astype(float) for a, v in zip(lowered.args, values, strict=True)]
    shape = common_shape(lowered.args, arrays)
    with np.errstate(all="ignore"):
        found = np.array([np.broadcast_to(np.asarray(v, dtype=float), shape) for v in lowered.compiled(*arrays)])
    for k, *place in np.argwhere(~np.isfinite(found)):  # as where a part overflows
        at = [float(np.broadcast_to(a, shape)[*place]) for a in arrays]
        (found[k, *place],) = _math(replace(lowered, target="math", outputs=lowered.outputs[k : k + 1]), at)
    return tuple(found) if shape else tuple(map(float, found))


def _math(lowered, values):
    return _finite(lowered, values, _as_double, float, math.isfinite)


def _as_double(value):
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{short(value)} is beyond the range of doubles; use target 'mpmath'") from None


def _mpmath(lowered, values, bits=None):
    m = _OWN.context
    m.prec = bits or import_module("mpmath").mp.prec
    return tuple(map(as_mpf, _finite(lowered, values, lambda v: in_context(m, v), m.mpf, m.isfinite)))


_RUN = {"numpy": _numpy, "math": _math, "mpmath": _mpmath}


def _finite(lowered, values, take, give, isfinite):
    """Call the compiled function on numbers of its kind; raises ``OutOfRange`` where a result is not a finite real."""
    given = [take(_read(a, v)) for a, v in zip(lowered.args, values, strict=True)]
    try:
        found = tuple(map(give, lowered.compiled(*given)))
    except (ArithmeticError, TypeError, ValueError):
        raise _out_of_range(lowered.outputs, lowered.args, values) from None
    if not all(map(isfinite, found)):
        raise _out_of_range(lowered.outputs, lowered.args, values)
    return found


def _read(arg, value):
    """Return a float, integer or mpf as it is; ``number`` reads strings and all else, or refuses them."""
    return value if isinstance(value, (float, int)) or hasattr(value, "_mpf_") else number(str(arg), value)


def _out_of_range(outputs, args, values):
    what = cut(", ".join(map(str, outputs)), 80)
    given = ", ".join(f"{a} = {v}" for a, v in zip(args, values, strict=True))
    return OutOfRange(f"{what} is not a finite real number at {given}")


def _arguments(args):
    """Return the arguments, checked, and their plain names; a set is sorted: the signature is the same in every run."""
    given = entries_of("args", args, "a sequence of Symbols")
    args = tuple(sorted(given, key=str)) if isinstance(args, set | frozenset) else given
    put = plain_names_of(a for a in args if isinstance(a, sp.Symbol))
    for a in args:
        plain = put.get(a, a).name if isinstance(a, sp.Symbol) else ""
        if not (plain.isidentifier() and plain.isascii()):
            raise InputError(f"the argument {short(a)} cannot name a variable; give a Symbol with a plain name")
    if len({a.name for a in args}) < len(args):
        raise InputError(f"the arguments ({', '.join(map(str, args))}) contain one name twice")
    return args, put


def _outputs(expr):
    """Return the expressions, the keys of a ``Dict``, and whether there is a single expression."""
    if isinstance(expr, dict | sp.Dict):
        items = sorted((str(key), expression(f"expr[{key}]", value)) for key, value in expr.items())
        return tuple(value for _, value in items), tuple(key for key, _ in items), False
    if isinstance(expr, list | tuple | sp.Tuple):
        return tuple(expression(f"expr[{k}]", value) for k, value in enumerate(expr)), None, False
    return (expression("expr", expr),), None, True


def _definitions(given):
    """Read pairs of a symbol and an expression."""
    pairs = [entries_of("definitions", pair, "pairs of a Symbol and an expression") for pair in
             entries_of("definitions", given, "pairs of a Symbol and an expression")]
    if wrong := next((p for p in pairs if len(p) != 2 or not isinstance(p[0], sp.Symbol)), None):
        raise InputError(f"definitions: {short(wrong)} is no pair of a Symbol and an expression")
    return tuple((symbol, expression(f"definitions[{symbol}]", e)) for symbol, e in pairs)


def _check(expr, args, known, branching):
    if not isinstance(expr, sp.Expr):
        raise InputError(f"{short(expr)} is not an expression; lower expressions, not conditions or matrices")
    parts = atoms(expr, sp.Basic)
    if any(isinstance(part, UNEVALUATED) for part in parts):
        raise InputError(f"{short(expr)} is to be worked out first; give {short(expr)}.doit()")
    if missing := {part for part in parts if isinstance(part, sp.Symbol)} - known:
        given, names = (", ".join(map(str, of)) for of in (args, sorted(missing, key=str)))
        raise InputError(f"{names} in {short(expr)} missing from the arguments ({given})")
    if any(isinstance(part, sp.Float) for part in parts):
        raise InputError(f"{short(expr)} contains a float; symbols are exact, give sp.Rational(1, 5) for 0.2")
    if parts & {*NOT_FINITE}:
        beyond = ", as where no piece of a Piecewise holds; end it with one that does" if sp.nan in parts else ""
        what = "an expression" if expr is sp.nan else short(expr)
        raise InputError(f"{what} contains a constant that is not a finite number{beyond}")
    if sp.I in parts:
        raise InputError(f"{short(expr)} is complex; lower its real and imaginary parts")
    if not branching and any(isinstance(part, BRANCHING) for part in parts):
        raise InputError(f"{short(expr)} branches; lower each smooth mode, or each piece, on its own")
