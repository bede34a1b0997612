"""What makes a figure unfit for a journal of two columns."""

import itertools
import re

from matplotlib.colors import to_rgb

from studies.figures.style import COLUMN_IN, PAGE_IN

APART = 0.15  # of brightness, from black 0 to white 1: told apart on a grey print
SMALLEST_PT = 5.5
UNIT = re.compile(r"\([^()]+\)\s*$|\(-\)|, dB|%")
NUMBER = re.compile(r"[^A-Za-z]*\d[}$]*|\$\\mathdefault.*")  # as matplotlib writes it


def faults(figure):
    """In words; none of a figure that is fit."""
    figure.draw_without_rendering()
    width = figure.get_size_inches()[0]
    found = [] if width <= PAGE_IN + 0.01 else [f"{width:.2f} in wide"]
    if COLUMN_IN < width < COLUMN_IN * 1.2:
        found.append(f"{width:.2f} in wide: neither a column nor more")
    for axes in figure.axes:
        found += [*_alike(axes), *_without_unit(axes), *_small(axes)]
    return found


def _alike(axes):
    """Pairs of labelled lines that only their colour tells apart, and that not in grey."""
    lines = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
    for one, two in itertools.combinations(lines, 2):
        if one.get_label() == two.get_label():
            continue
        if _look(one) == _look(two) and abs(_grey(one) - _grey(two)) < APART:
            yield f"{one.get_label()!r} and {two.get_label()!r} look alike in grey"


def _look(line):
    return str(line._dash_pattern), line.get_linestyle(), line.get_marker(), line.get_linewidth()


def _grey(line):
    red, green, blue = to_rgb(line.get_color())
    return 0.299 * red + 0.587 * green + 0.114 * blue


def _without_unit(axes):
    for axis in (axes.xaxis, axes.yaxis):
        label = axis.get_label().get_text()
        words = [tick.get_text() for tick in axis.get_ticklabels() if tick.get_text()]
        numbers = all(NUMBER.fullmatch(word) for word in words)
        shown = axis.get_visible() and axes.axison and words and axis.get_label().get_visible()
        if shown and numbers and label and not UNIT.search(label):
            yield f"no unit on {label!r}"


def _small(axes):
    texts = [*axes.texts, axes.title, axes.xaxis.label, axes.yaxis.label]
    for text in texts:
        if text.get_text() and text.get_fontsize() < SMALLEST_PT:
            yield f"{text.get_text()!r} in {text.get_fontsize()} pt"
