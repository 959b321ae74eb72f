"""Flows written out in the source code of an integration step: a short flow costs less than its call.

Subexpressions that depend on no state are computed once per step and not once per stage. The operations are those of
the flow itself, so the numbers are the same to the last bit. ``inlined`` is the entry, ``_Text`` rewrites the source.
"""

import ast
import builtins
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

LONGEST = 2500  # the most characters of a flow that is written out: the call of a longer one costs relatively little


@dataclass(frozen=True)
class Inlined:
    """A flow as text: the lines ``once`` per step and ``lines`` per stage, and ``rates``, the text of the result.

    ``names`` is {name: function} of the functions that the text calls.
    """

    once: tuple[str, ...]
    lines: tuple[str, ...]
    rates: str
    names: dict[str, Any] = field(repr=False)


def inlined(
    function: Callable, prefix: str, before: Sequence[str], states: Sequence[str], parameters: Sequence[str],
    longest: int = LONGEST,
) -> Inlined:
    """Return the text of ``function(*before, *states, *parameters)`` in variables of these names.

    All other names in the text begin with ``prefix``. A function that carries its source as ``text``, of at most
    ``longest`` characters, is written out. Any other function is called.
    """
    text, arguments = getattr(function, "text", None), (*before, *states, *parameters)
    if text is None or len(text) > longest:
        return Inlined((), (), f"{prefix}({', '.join(arguments)})", {prefix: function})
    (definition,) = ast.parse(text).body
    *assigned, returned = definition.body
    given = dict(zip((a.arg for a in definition.args.args), arguments, strict=True))
    written = _Text(prefix, given, {*before, *parameters}, vars(builtins) | function.__globals__)
    for line in assigned:
        written.assign(line)
    rates = written.stage(returned.value)
    return Inlined(tuple(written.once), tuple(written.lines), rates, written.names)


class _Text(ast.NodeTransformer):
    """Renames the variables of a flow for a step, and moves expressions of ``fixed`` names out of the stages."""

    def __init__(self, prefix, given, fixed, functions):
        self.prefix, self.given, self.fixed, self.functions = prefix, given, fixed, functions
        self.once, self.lines, self.names = list[str](), list[str](), dict[str, Any]()
        self.known: dict[str, str] = {}

    def assign(self, line):
        """Write a line of the flow: before the stages if it contains no state, else into them."""
        (target,), value = line.targets, self.visit(line.value)
        name = self.given[target.id] = f"{self.prefix}{target.id}"
        if self._is_fixed(value):
            self.fixed.add(name)
            self.once.append(f"{name} = {ast.unparse(value)}")
        else:
            self.lines.append(f"{name} = {ast.unparse(self._hoisted(value))}")

    def stage(self, value):
        """Return the text of an expression in a stage."""
        return ast.unparse(self._hoisted(self.visit(value)))

    def visit_Name(self, node):
        if node.id in self.given:
            return ast.Name(self.given[node.id], node.ctx)
        return self._function(node.id, self.functions[node.id])

    def visit_Attribute(self, node):
        return self._function(node.attr, getattr(self.functions[node.value.id], node.attr))

    def _function(self, word, value):
        name = f"{self.prefix}{word}_"
        self.names[name] = value
        return ast.Name(name, ast.Load())

    def _is_fixed(self, node):
        variables = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)} - self.names.keys()
        return variables <= self.fixed

    def _hoisted(self, node):
        """Return an expression with names for its fixed parts, except in branches, which may not be evaluated."""
        if isinstance(node, ast.Name | ast.Constant | ast.IfExp | ast.BoolOp | ast.Compare):
            return node
        if self._is_fixed(node):
            if all(isinstance(part, ast.Constant | ast.operator | ast.unaryop) for part in ast.iter_child_nodes(node)):
                return node  # a constant, which the compiler computes
            text = ast.unparse(node)
            if text not in self.known:
                self.known[text] = f"{self.prefix}c{len(self.known)}_"
                self.once.append(f"{self.known[text]} = {text}")
                self.fixed.add(self.known[text])
            return ast.Name(self.known[text], ast.Load())
        for name, child in ast.iter_fields(node):
            if isinstance(child, ast.expr):
                setattr(node, name, self._hoisted(child))
            elif isinstance(child, list):
                setattr(node, name, [self._hoisted(c) for c in child])
        return node
