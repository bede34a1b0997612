"""Maps of the error in cells: over position and speed, over command and pressure."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import PAGE_IN, headline, new_figure, styled
from studies.text import labelled
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from workbench.comparison.maps import ErrorMap

ACROSS = 3
COLOURS = "cividis_r"  # even steps of grey too; dark is much
EMPTY = "0.93"
LEVELS = 2  # of a switched command


def map_figure(maps: Sequence[ErrorMap], title: str) -> Figure:
    """RMS error of each output in cells; cells with too few samples stay empty."""
    across = min(len(maps), ACROSS)
    down = ceil(len(maps) / across)
    with styled():
        width_in = PAGE_IN if across > 1 else PAGE_IN / 2
        figure = new_figure(width_in, 0.5 + 2.1 * down)
        panels = figure.subplots(down, across, squeeze=False).flatten()
        for axes in panels[len(maps) :]:
            axes.set_visible(False)
        for axes, each in zip(panels, maps, strict=False):
            x, y = (
                display_scale(name).from_si(edges)
                for name, edges in ((each.x_name, each.x_edges), (each.y_name, each.y_edges))
            )
            rms = np.ma.masked_invalid(each.rms.T / display_scale(each.output).factor)
            drawn = axes.pcolormesh(x, y, rms, cmap=COLOURS, vmin=0.0, rasterized=True)
            axes.set_facecolor(EMPTY)
            axes.grid(False)
            axes.set_xlabel(_with_unit(each.x_name))
            axes.set_ylabel(_with_unit(each.y_name))
            if len(x) == LEVELS + 1:
                axes.set_xticks((x[1:] + x[:-1]) / 2.0)
            axes.set_title(public_name(each.output).replace(".", " ").replace("_", " "))
            bar = figure.colorbar(drawn, ax=axes)
            bar.set_label(f"RMS error ({display_unit(each.output)})")
            bar.outline.set_visible(False)
        figure.suptitle(headline(f"{title}; grey: too few samples", width_in), fontsize=8)
    return figure


def _with_unit(name: str) -> str:
    return labelled(name) if display_unit(name) else f"{labelled(name)} (-)"
