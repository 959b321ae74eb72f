"""The source of modules, parsed once for all tests that look into it."""

import ast
from functools import cache


@cache
def parsed(source: str) -> ast.Module:
    """Return the tree of a source, which nobody changes."""
    return ast.parse(source)
