"""The arrow of imports: the order of the parts in ``docs/arrow.toml``, the imports in the code, a drawing of both.

A part may import only from itself and from parts above it. Imports are read from the syntax tree of every module.
"""

import ast
import tomllib
from collections.abc import Collection
from functools import cache
from pathlib import Path
from typing import Any

from asympk.pictures import pen, style

PACKAGE = Path(__file__).parent.parent
STEP, REACH = 0.16, 0.055  # inches: distance of neighbouring parts; width of an arc for each part that it spans
MARGIN = 0.05  # inches of white space beside a name


def parts_in_order(root: Path) -> dict[str, str]:
    """Return {part: sentence on what it is} in the order of the arrow, from ``root``/docs/arrow.toml."""
    return tomllib.loads((root / "docs" / "arrow.toml").read_text(encoding="utf-8"))


@cache
def modules() -> dict[str, Path]:
    """Return the file of every module by its dotted name below ``asympk``."""
    files = [file for file in sorted(PACKAGE.rglob("*.py")) if file != PACKAGE / "__init__.py"]
    return {".".join(file.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): file for file in files}


@cache
def imported_modules(file: Path) -> frozenset[str]:
    """Return the modules that a file imports, as dotted names below ``asympk``.

    Imports inside functions count. Imports under ``if TYPE_CHECKING``, which serve annotations alone, do not.
    """
    names, tree = modules(), ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            node.body = []
    found = [f"{getattr(node, 'module', '')}.{alias.name}".removeprefix(".") for node in ast.walk(tree)
             if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names]
    below = [name.removeprefix("asympk.") for name in found if name.startswith("asympk.")]
    return frozenset(name if name in names else name.rpartition(".")[0] for name in below)


def part_of(name: str, parts: Collection[str]) -> str:
    """Return the part that a module belongs to: the module, if ``parts`` names it, else its top-level package."""
    return name if name in parts else name.partition(".")[0]


def between_parts(parts: Collection[str]) -> set[tuple[str, str]]:
    """Return the pairs of different parts of which the first imports from the second."""
    found = {(part_of(name, parts), part_of(other, parts))
             for name, file in modules().items() for other in imported_modules(file) if other}
    return {(part, other) for part, other in found if part != other}


def arrow_drawing(parts: list[str]) -> Any:
    """Draw the parts from top to bottom, and for each of ``between_parts`` an arc upwards to the imported part."""
    from matplotlib.patches import Arc
    from matplotlib.textpath import TextPath

    height = STEP * (len(parts) + 1)
    with pen.canvas(style.COLUMN, height) as (figure, ax):
        names = MARGIN + max(TextPath((0, 0), part).get_extents().x1 / 72 for part in parts)  # inches
        level = {part: height - STEP * (k + 1) for k, part in enumerate(parts)}
        for part, y in level.items():
            pen.text(ax, (names, y), part, ha="right")
        for part, other in sorted(between_parts(parts)):
            low, high = level[part], level[other]
            bulge = 2 * REACH * (high - low) / STEP
            ax.add_patch(Arc((names + MARGIN, (low + high) / 2), bulge, high - low, theta1=-90, theta2=90, lw=0.4,
                             color=style.BLUE))
    return figure
