"""Pictures: rows or computed paths in, a matplotlib ``Figure`` out."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from asympk.pictures import style


def sheets(file: str | Path | None = None) -> ModuleType:
    """Return the module ``asympk.pictures.sheet``; before that, check that matplotlib loads and can write ``file``.

    Raises the errors of ``style.matplotlib``, and of ``sheet.suffix_of`` where a file is given.
    """
    style.matplotlib()
    from asympk.pictures import sheet

    if file is not None:
        sheet.suffix_of(file)
    return sheet


@contextmanager
def plate(
    height: float, rows: int = 1, columns: int = 1, width: float = style.COLUMN, **options: Any
) -> Iterator[tuple[style.Figure, np.ndarray]]:
    """Yield (figure, axes) of ``height`` inches and by default a column's width, in the common style."""
    sheet = sheets()
    with sheet.in_style():
        figure = sheet.Sheet(figsize=(width, height), layout="constrained")
        yield figure, figure.subplots(rows, columns, squeeze=False, **options)
