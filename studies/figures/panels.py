"""Figures of plain curves: one panel or several, in the style of all figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import new_figure, styled, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Line:
    """A curve, or points where ``style`` has a marker; ``label`` empty keeps it off the legend."""

    x: np.ndarray
    y: np.ndarray
    label: str = ""
    style: str = "-"
    colour: str | None = None
    width: float = 0.9


@dataclass(frozen=True)
class Panel:
    """Axes with their curves.

    Attributes
    ----------
    levels
        Heights of dotted lines by label.
    x_range, y_range
        Limits of the axes; by the curves where none.
    logarithmic
        Which axes are: ``x``, ``y`` or both.
    """

    x: str
    y: str
    lines: Sequence[Line]
    title: str = ""
    levels: dict[str, float] = field(default_factory=dict)
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    logarithmic: str = ""


def panels_figure(
    rows: Sequence[Sequence[Panel]], width_in: float, height_in: float, legend_columns: int = 3
) -> Figure:
    """Panels on a grid; one legend below, of the labels that differ."""
    with styled():
        figure = new_figure(width_in, height_in)
        grid = figure.subplots(len(rows), max(map(len, rows)), squeeze=False)
        known = {}
        for panels, all_axes in zip(rows, grid, strict=True):
            for axes in all_axes[len(panels) :]:
                axes.remove()
            for panel, axes in zip(panels, all_axes, strict=False):
                _fill(axes, panel)
                handles, labels = axes.get_legend_handles_labels()
                known |= {
                    label: known.get(label, each)
                    for each, label in zip(handles, labels, strict=True)
                }
        if known:
            figure.legend(
                known.values(), known.keys(), loc="outside lower center", ncols=legend_columns
            )
    return figure


def _fill(axes: Axes, panel: Panel) -> None:
    for line in panel.lines:
        more = {} if line.colour is None else {"color": line.colour}
        marked = line.style in ("o", "s", "^", "v", "x", "+", "d")
        drawn = (line.x, line.y) if marked else thinned(np.asarray(line.x), np.asarray(line.y))
        look = (
            {"marker": line.style, "linestyle": "none", "markersize": 3}
            if marked
            else {"linestyle": line.style, "linewidth": line.width}
        )
        axes.plot(*drawn, label=line.label or "_", **look, **more)
    for label, height in panel.levels.items():
        axes.axhline(height, color="black", linestyle=":", linewidth=0.8, label=label)
    axes.set(xlabel=panel.x, ylabel=panel.y, title=panel.title)
    if panel.x_range:
        axes.set_xlim(panel.x_range)
    if panel.y_range:
        axes.set_ylim(panel.y_range)
    if "x" in panel.logarithmic:
        axes.set_xscale("log")
    if "y" in panel.logarithmic:
        axes.set_yscale("log")
