"""The look of all figures: one column wide, legible in grey print and by colour-blind readers.

Colours are those of Okabe and Ito; no two things in one picture differ by colour alone.
"""

from math import log10
from textwrap import wrap
from types import ModuleType
from typing import TYPE_CHECKING, Any, NewType

from asympk.errors import InputError, MissingPackage
from asympk.numbers import short

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:
    Axes, Figure = NewType("Axes", Any), NewType("Figure", Any)  # matplotlib is loaded when something is drawn

COLUMN, CHARACTER = 3.4, 0.06  # inches
RC = {
    **dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), 7),
    **dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), 6.5),
    **dict.fromkeys(("axes.linewidth", "xtick.major.width", "ytick.major.width", "hatch.linewidth"), 0.5),
    **dict.fromkeys(("xtick.major.size", "ytick.major.size"), 2),
    "lines.linewidth": 0.8,
    "lines.markersize": 3.4,
    "lines.markeredgewidth": 0.7,
    "grid.linewidth": 0.3,
    "grid.color": "0.85",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-4, 6),  # 1e-4 is factored out of ticks, which as 0.00005 lie on one another
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "mathtext.fontset": "dejavusans",
    "svg.hashsalt": "asympk",
    "pdf.fonttype": 42,
}
BLACK, ORANGE, SKY, GREEN, BLUE, RED, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7")
MARKS = ((BLUE, "o"), (RED, "s"), (GREEN, "^"))  # (colour, mark) of up to three groups of rows

# method -> (name in print, colour, marker, line): lines of explicit methods dashed, implicit solid, crude dotted
METHODS = {
    "rk45": ("RK45", SKY, "^", "--"),
    "dop853": ("DOP853", BLUE, "v", "--"),
    "heyoka": ("heyoka", PURPLE, "d", "--"),
    "kvaerno5": ("Kvaerno5", PURPLE, ">", "-"),
    "radau": ("Radau", GREEN, "s", "-"),
    "bdf": ("BDF", BLUE, "p", "-"),
    "lsoda": ("LSODA", ORANGE, "o", "-"),
    "cvode": ("CVODE", RED, "D", "-"),
    "moreau": ("Moreau-Jean", "0.4", "X", ":"),
    "sign": ("one field, sign(z)", "0.4", "P", ":"),
    "tanh": ("one field, tanh(z/ε)", "0.4", "<", ":"),
}
SHORT = {"sign": "sign(z)", "tanh": "tanh(z/ε)", **{name: name for name in ("slow", "jump 0", "jump 1", "jump 2")}}
MODELS = {
    "exact": ("exact flow", BLACK, "*", "none"),
    "rigid": ("rigid", BLACK, "$r$", "none"),
    "slow": ("slow flow alone", BLACK, "$s$", "none"),
    **{f"jump {n}": (f"jump map, order {n}", BLACK, f"${n}$", "none") for n in range(3)},
}


def matplotlib() -> ModuleType:
    """Return the module; raises ``MissingPackage`` where it is not installed, ``InputError`` where it does not load."""
    try:
        import matplotlib as module
    except ImportError:
        raise MissingPackage("a plot needs matplotlib: pip install 'asympk[plot]'") from None
    except ValueError as reason:  # matplotlib refuses the value of an environment variable
        raise InputError(f"matplotlib does not load: {short(str(reason))}; unset MPLBACKEND") from None
    return module


def logarithmic(ax: Any, **looks: Any) -> None:
    """Make both axes of a panel logarithmic, without minor ticks; ``looks`` are set as by ``ax.set``."""
    ax.set(xscale="log", yscale="log", **looks)
    ax.minorticks_off()


def halo(width: float) -> list[Any]:
    """Return matplotlib's effect of a white rim, so many points wide, around a mark or a word that lies on curves."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=width, foreground="white")]


def curve(method: str) -> dict[str, Any]:
    """Return matplotlib's keywords for a curve of ``method``; hollow markers keep overlaps readable."""
    name, colour, marker, dash = {**METHODS, **MODELS}[method]
    shape: dict[str, Any] = {"markerfacecolor": "white"}
    if marker == "*" or marker.startswith("$"):
        shape = {"markersize": 4.4, "markeredgewidth": 0.2}
    return {"label": name, "color": colour, "marker": marker, "linestyle": dash, **shape}


def folded(label: str, height: float) -> str:
    """Return a label in lines that fit upright beside a panel of so many inches."""
    return "\n".join(wrap(label, int(height / CHARACTER)))


def power_of_ten(value: Any) -> str:
    """Return ``value`` in LaTeX, as a power of ten if it is one, else as a decimal."""
    exponent = log10(abs(value))
    power = f"10^{{{round(exponent)}}}" if abs(exponent - round(exponent)) < 1e-9 else f"{abs(value):g}"
    return f"-{power}" if value < 0 else power


def patch(colour: Any, label: str, **looks: Any) -> Any:
    """Return an area of one ``colour`` as an entry of a legend."""
    from matplotlib.patches import Patch

    return Patch(facecolor=colour, label=label, **looks)
