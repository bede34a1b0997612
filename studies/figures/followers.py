"""How close each plant comes to what is asked of it, over all draws: one panel for each plant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLACK, BLUE, PAGE_IN, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def follower_figure(shares: Mapping[str, Mapping[str, np.ndarray]]) -> Figure:
    """Found over asked of every draw, by plant and what is asked; 1 is the bound.

    Draws that were lost are left out here; the text names them.
    """
    with styled():
        figure = new_figure(PAGE_IN, 3.0)
        widths = [max(len(each), 2) for each in shares.values()]
        panels = figure.subplots(1, len(shares), sharey=True, width_ratios=widths, squeeze=False)
        for axes, (plant, found) in zip(panels[0], shares.items(), strict=True):
            for k, values in enumerate(found.values()):
                finite = values[np.isfinite(values)]
                at = k + np.linspace(-0.25, 0.25, len(finite))
                axes.plot(at, finite, ".", color=BLUE, markersize=3)
            axes.axhline(1.0, color=BLACK, linestyle="--", linewidth=0.8)
            axes.set_xticks(range(len(found)), list(found), rotation=90)
            axes.set_xlim(-0.6, len(found) - 0.4)
            axes.set_title(plant)
        panels[0][0].set_ylim(bottom=0.0)
        panels[0][0].set_ylabel("found / asked at most (-)")
    return figure
