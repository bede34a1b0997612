"""Many draws: how each figure is spread against its line, and which parameters move it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLACK, BLUE, PAGE_IN, RED, new_figure, styled
from workbench.units import public_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from studies.robustness import Line, Robustness

COLUMNS = 3
ROW_IN, LEGEND_IN = 1.8, 0.2
MOST_PARAMETERS = 12  # in the map, the strongest
LONG = 20  # letters of a line that does not fit below its column
NOTHING_CLEAR = "no parameter clearly moves any figure"
DARK = 0.6  # from there on the map is too dark for black letters


def spread_figure(found: Robustness, limits: Mapping[str, float]) -> Figure:
    """Share of the draws up to each figure, one panel a line.

    ``limits`` are by line, in its unit; draws that miss the line, as its table counts them, are
    marked on the axis.  One legend tells of all panels.
    """
    with styled():
        rows = -(-len(found.lines) // COLUMNS)
        figure = new_figure(PAGE_IN, ROW_IN * rows + LEGEND_IN)
        panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for axes, line in zip(panels, found.lines, strict=False):
            _draw_spread(axes, line, limits.get(line.name))
        for axes in panels[len(found.lines) :]:
            axes.set_visible(False)
        for axes in panels[::COLUMNS]:
            axes.set_ylabel(f"{found.each}s (%)")
        pairs = [axes.get_legend_handles_labels() for axes in panels]
        known = {
            word: line for lines, words in pairs for line, word in zip(lines, words, strict=True)
        }
        figure.legend(known.values(), known.keys(), loc="outside lower center", ncols=len(known))
    return figure


def influence_figure(found: Robustness) -> Figure:
    """Rank correlations of parameters with figures as a map, blank where nothing is clear.

    With too few draws to tell, or none that is clear at all, words instead of the map.
    """
    clear = {line.name: dict(found.influences(line)) for line in found.lines}
    strongest: dict[str, float] = {}
    for of_line in clear.values():
        for name, r in of_line.items():
            strongest[name] = max(strongest.get(name, 0.0), abs(r))
    names = sorted(strongest, key=lambda name: -strongest[name])[:MOST_PARAMETERS]
    values = np.array([[clear[line.name].get(n, np.nan) for line in found.lines] for n in names])
    with styled():
        figure = new_figure(PAGE_IN, 0.9 + 0.24 * max(len(names), 3))
        axes = figure.subplots()
        if names:
            labels = [public_name(name) for name in names]
            _draw_map(axes, values, labels, [line.name for line in found.lines])
        else:
            said = f"influences: {found.unranked}" if found.unranked else NOTHING_CLEAR
            axes.text(0.5, 0.5, said, ha="center", va="center")
            axes.set_axis_off()
    return figure


def _draw_spread(axes: Axes, line: Line, limit: float | None) -> None:
    inside = np.sort(line.found[np.isfinite(line.found)])
    share = 100.0 * (1.0 + np.arange(len(inside))) / len(line.found)
    axes.step(inside, share, where="post", color=BLUE, label="share up to it")
    missed = line.found[np.isfinite(line.found) & line.missed]
    if len(missed):  # an empty line that is not clipped would upset the layout
        look = {"color": RED, "markersize": 6, "clip_on": False}
        axes.plot(missed, np.zeros(len(missed)), "|", label="missed", **look)
    if limit is not None:
        axes.axvline(limit, color=BLACK, linestyle="--", linewidth=0.8, label="asked for")
    axes.set_ylim(0.0, 100.0)
    words = f"{line.name} ({line.unit})" if line.unit else line.name
    axes.set_xlabel(words)
    axes.set_label(words)  # in the table; the other axis is the same in all panels


def _draw_map(axes: Axes, values: np.ndarray, rows: list[str], over: list[str]) -> None:
    image = axes.imshow(values, cmap="RdBu", vmin=-1.0, vmax=1.0, aspect="auto")
    axes.set_yticks(range(len(rows)), rows)
    slanted = {"rotation": 25, "ha": "right"} if max(map(len, over)) > LONG else {}
    axes.set_xticks(range(len(over)), over, **slanted)
    axes.grid(visible=False)
    for (row, column), r in np.ndenumerate(values):
        if np.isfinite(r):
            colour = "white" if abs(r) > DARK else BLACK
            axes.text(column, row, f"{r:+.2f}", ha="center", va="center", color=colour, fontsize=7)
    axes.figure.colorbar(image, ax=axes, label="rank correlation (-)")
