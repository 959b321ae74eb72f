"""The look of all figures: one column wide, legible in grey print and by colour-blind readers.

Colours are those of Okabe and Ito; no two things in one picture are told apart by colour alone.
"""

COLUMN = 3.4  # inches
RC = {
    "font.size": 7,
    "axes.titlesize": 7,
    "axes.labelsize": 7,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "axes.linewidth": 0.5,
    "lines.linewidth": 0.8,
    "lines.markersize": 3.4,
    "lines.markeredgewidth": 0.7,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2,
    "ytick.major.size": 2,
    "grid.linewidth": 0.3,
    "grid.color": "0.85",
    "axes.grid": True,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "mathtext.fontset": "dejavusans",
    "svg.hashsalt": "asympk",
    "pdf.fonttype": 42,
}
BLACK, ORANGE, SKY, GREEN, BLUE, RED, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7")

# method -> (name in print, colour, marker, line); explicit methods dash, implicit ones are solid, crude ones dot
METHODS = {
    "exact": ("exact flow", BLACK, "*", "none"),
    "rk45": ("RK45", SKY, "^", "--"),
    "dop853": ("DOP853", BLUE, "v", "--"),
    "heyoka": ("heyoka", PURPLE, "d", "--"),
    "radau": ("Radau", GREEN, "s", "-"),
    "bdf": ("BDF", BLUE, "p", "-"),
    "lsoda": ("LSODA", ORANGE, "o", "-"),
    "cvode": ("CVODE", RED, "D", "-"),
    "kvaerno5": ("Kvaerno5", PURPLE, "h", "-"),
    "sign": ("one field, sign(z)", "0.45", "1", ":"),
    "tanh": ("one field, tanh(z/ε)", "0.45", "2", ":"),
    "moreau": ("Moreau-Jean", "0.45", "3", ":"),
}
MODELS = {
    "rigid": ("rigid", BLACK, "$r$", "none"),
    "slow": ("slow planes", BLACK, "$s$", "none"),
    "jump 0": ("jump map, order 0", BLACK, "$0$", "none"),
    "jump 1": ("jump map, order 1", BLACK, "$1$", "none"),
}


def line(method):
    """Return matplotlib's keywords for a curve of ``method``; hollow markers keep overlaps readable."""
    name, colour, marker, dash = {**METHODS, **MODELS}[method]
    hollow = {} if marker in "123*" or marker.startswith("$") else {"markerfacecolor": "white"}
    return {"label": name, "color": colour, "marker": marker, "linestyle": dash, **hollow}
