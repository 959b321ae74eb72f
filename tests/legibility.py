"""What a reader could not read in a figure: texts that leave the sheet, or that lie on one another."""

from itertools import combinations

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg

from asympk.pictures import style

SLACK = 1.0  # points by which the boxes of two texts may touch


def flaws(figure):
    """Return a sentence for each text of ``figure`` that is clipped or overlaps another one."""
    with rc_context(style.RC):
        canvas = FigureCanvasAgg(figure)
        figure.set_dpi(72)
        canvas.draw()
        renderer = canvas.get_renderer()
        boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in _texts(figure)]
    sheet = figure.bbox.padded(SLACK)
    clipped = [f"{words!r} leaves the sheet" for words, box in boxes if not _within(box, sheet)]
    inner = [(words, box.padded(-SLACK)) for words, box in boxes]
    return clipped + [f"{a!r} lies on {b!r}" for (a, p), (b, q) in combinations(inner, 2) if p.overlaps(q)]


def _texts(figure):
    found = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for ax in figure.axes:
        if not ax.get_visible():
            continue
        found += [*ax.texts, ax.title]
        if ax.axison:
            found += [*_of_axis(ax.xaxis), *_of_axis(ax.yaxis)]
        found += ax.get_legend().get_texts() if ax.get_legend() else []
    return [text for text in found if text.get_visible() and text.get_text().strip()]


def _of_axis(axis):
    low, high = sorted(axis.get_view_interval())
    seen = [tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    return [axis.label, *(tick.label1 for tick in seen if tick.label1.get_visible())]


def _within(box, sheet):
    return box.x0 >= sheet.x0 and box.y0 >= sheet.y0 and box.x1 <= sheet.x1 and box.y1 <= sheet.y1
