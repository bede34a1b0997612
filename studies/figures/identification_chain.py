"""What the free run of a drive gains with every identified result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLACK, BLUE, PAGE_IN, new_figure, styled
from studies.text import labelled
from workbench.units import display_scale

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def chain_figure(
    names: Sequence[str], errors: Sequence[Mapping[str, float]], printed: Mapping[str, float]
) -> Figure:
    """RMSE by step, one panel for each signal; lines are what a paper prints.

    ``errors`` holds RMSE in SI by channel, one mapping for each name.
    """
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        panels = figure.subplots(1, len(printed), sharey=True)
        rows = np.arange(len(names))
        for axes, (channel, line) in zip(panels, printed.items(), strict=True):
            scale = display_scale(channel)
            values = [scale.from_si(each[channel]) for each in errors]
            axes.barh(rows, values, color=BLUE, height=0.6)
            for row, value in zip(rows, values, strict=True):
                axes.annotate(
                    f"{value:.3g}",
                    (value, row),
                    xytext=(3, 0),
                    textcoords="offset points",
                    va="center",
                    fontsize=7,
                    bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none"},
                )
            axes.axvline(
                scale.from_si(line), color=BLACK, linestyle=":", label="paper 002, Table 7"
            )
            axes.set_yticks(rows, names)
            axes.set_xlabel(f"RMSE of {labelled(channel)}")
            axes.set_xlim(0.0, 1.2 * max(*values, scale.from_si(line)))
        panels[0].invert_yaxis()
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center")
    return figure
