"""Pictures: rows or computed paths in, a matplotlib ``Figure`` out."""

from types import ModuleType

from asympk.errors import MissingPackage


def sheets() -> ModuleType:
    """Return the module ``asympk.pictures.sheet``; raises ``MissingPackage`` where matplotlib is not installed."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingPackage("a plot needs matplotlib: pip install 'asympk[plot]'") from None
    from asympk.pictures import sheet

    return sheet
