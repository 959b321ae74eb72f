"""The sheet a picture is drawn on: a matplotlib ``Figure`` in the common style, which a notebook shows as SVG.

The module needs matplotlib: ``asympk.pictures.sheets()`` imports it, or says that it is missing.
"""

import io
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from asympk.errors import InputError
from asympk.pictures import style
from asympk.storage.files import named_file, write_bytes

DPI = 200  # of a .png file
UNDATED = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {"Software": None}}


class Sheet(Figure):
    """A ``Figure`` that is drawn in the common style whatever the style of its surroundings."""

    def savefig(self, fname: Any, **options: Any) -> None:
        """Draw into a file or a stream; see ``Figure.savefig``."""
        with in_style():
            super().savefig(fname, **options)

    def _repr_svg_(self) -> str:
        return bytes_of(self, ".svg").decode()


def in_style() -> Any:
    """Return the context within which a sheet is drawn on: the common style."""
    return matplotlib.rc_context(style.RC)


def kept(figure: Figure, file: str | Path | None, dpi: int = DPI) -> Figure:
    """Return a figure, and write it to ``file`` if one is given; raises ``InputError`` as ``suffix_of`` does."""
    if file is not None:
        write_bytes(file, bytes_of(figure, suffix_of(file), dpi))
    return figure


def suffix_of(file: str | Path) -> str:
    """Return the suffix of a file in lower case; raises ``InputError`` unless it is one of ``UNDATED``."""
    suffix = named_file(file).suffix.lower()
    if suffix not in UNDATED:
        raise InputError(f"{file}: a plot is written as one of {', '.join(UNDATED)}")
    return suffix


def bytes_of(figure: Figure, suffix: str, dpi: int = DPI) -> bytes:
    """Return a figure as PDF, SVG or PNG; the same figure is the same bytes every time."""
    buffer = io.BytesIO()
    with in_style():
        figure.savefig(buffer, format=suffix[1:], metadata=UNDATED[suffix], dpi=dpi)
    return buffer.getvalue()
