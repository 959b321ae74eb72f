"""Pictures: rows or computed paths in, a matplotlib ``Figure`` out."""

from types import ModuleType


def sheets() -> ModuleType:
    """Return the module ``asympk.pictures.sheet``; raises as ``style.matplotlib`` does."""
    from asympk.pictures import style

    style.matplotlib()
    from asympk.pictures import sheet

    return sheet
