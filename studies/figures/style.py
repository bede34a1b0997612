"""One style for all figures, and how they are saved: PDF, SVG, what is drawn, and the command.

Widths of 3.5 in and 7.16 in are one and two columns of a journal.  Colours are those of Okabe and
Ito, which colour-blind people tell apart, with changing line styles for prints in grey.  Two runs
give the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.figures.decimation import peaks
from studies.figures.drawn_numbers import write_drawn
from workbench.whole_file import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMN_IN, PAGE_IN = 3.5, 7.16
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "0.6"
LETTERS_PER_IN = 16  # of a title, as the mean of a text; capitals take more
MOST_POINTS = 2000  # of a curve, and as many peaks; more are not seen and swell the files

_COLOURS = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, BLACK)
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1)), (0, (3, 1)), (0, (1, 1)))
TURN = 4  # of the kinds of lines, once all colours were there: neighbours differ in grey, too


@contextmanager
def styled() -> Iterator[None]:
    """The style while a figure is made and saved."""
    import matplotlib
    from cycler import cycler

    cycle = cycler(color=_COLOURS) + cycler(linestyle=LINES)
    style = {
        "font.family": "STIXGeneral",
        "mathtext.fontset": "stix",
        "font.size": 8,
        "axes.titlesize": 8,
        "legend.fontsize": 7,
        "legend.frameon": False,
        "axes.prop_cycle": cycle,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.linewidth": 0.6,
        "lines.linewidth": 0.9,
        "grid.linewidth": 0.4,
        "grid.alpha": 0.4,
        "axes.grid": True,
        "axes.axisbelow": True,
        "pdf.fonttype": 42,
        "svg.fonttype": "path",
        "svg.hashsalt": "workbench",
        "figure.constrained_layout.use": True,
    }
    with matplotlib.rc_context(style):
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure, to be filled inside :func:`styled`."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), layout="constrained")


def literal(name: str) -> str:
    """A name as it is: between two dollars Matplotlib reads a formula, or fails to."""
    return name.replace("$", r"\$")


def headline(text: str, width_in: float) -> str:
    """A title with the name of a file in it, as it is, on as many lines as the width asks for."""
    letters = int(LETTERS_PER_IN * width_in)
    return literal("\n".join(line for part in text.splitlines() for line in wrap(part, letters)))


def kind_of_line(k: int) -> Any:
    """Of the k-th of many lines in colours of the cycle: no two of the first 49 are alike."""
    return LINES[(k + TURN * (k // len(LINES))) % len(LINES)]


def look(k: int) -> dict[str, Any]:
    """Colour and kind of the k-th of many lines."""
    return {"color": f"C{k}", "linestyle": kind_of_line(k)}


def thinned(x: np.ndarray, *rows: np.ndarray) -> list[np.ndarray]:
    """A long row and others over it, (n,) each, with no more points than can be seen.

    The smallest and the largest of every stretch stay: an impact is shorter than a stretch.
    """
    every = max(len(x) // MOST_POINTS, 1)
    if every == 1:
        return [x, *rows]
    kept = np.union1d(np.arange(0, len(x), every), peaks(np.array(rows), 0, len(x), MOST_POINTS))
    return [each[kept] for each in (x, *rows)]


def save_all(figures: Mapping[str, Figure], folder: Path, command: str) -> list[Path]:
    """Save figures by file name without ending; the SVG files are given back."""
    return [save(figure, folder / name, command) for name, figure in figures.items()]


def save(figure: Figure, stem: Path, command: str) -> Path:
    """PDF, SVG, CSV of the curves and bars, and the command that made them; gives the SVG."""
    dateless = {
        "pdf": {"CreationDate": None},
        "svg": dict.fromkeys(("Date", "Creator", "Format", "Type")),
    }
    with styled():
        for ending, metadata in dateless.items():
            with whole_file(stem.with_name(f"{stem.name}.{ending}")) as unfinished:
                figure.savefig(unfinished, format=ending, metadata=metadata)
    with whole_file(stem.with_name(f"{stem.name}.csv")) as unfinished:
        write_drawn(figure, unfinished)
    with whole_file(stem.with_name(f"{stem.name}.txt")) as unfinished:
        unfinished.write_text(command + "\n", encoding="utf-8")
    return stem.with_name(f"{stem.name}.svg")
