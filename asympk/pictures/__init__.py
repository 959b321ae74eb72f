"""Pictures: rows or computed paths in, a matplotlib ``Figure`` out."""

from pathlib import Path
from types import ModuleType


def sheets(file: str | Path | None = None) -> ModuleType:
    """Return the module ``asympk.pictures.sheet``, once a picture can be written as ``file``, where there is one.

    Raises as ``style.matplotlib`` and ``sheet.suffix_of`` do.
    """
    from asympk.pictures import style

    style.matplotlib()
    from asympk.pictures import sheet

    if file is not None:
        sheet.suffix_of(file)
    return sheet
