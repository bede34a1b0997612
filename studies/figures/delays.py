"""What a loop does as its commands come later, with the delay margins of its modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, PAGE_IN, RED, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = ((BLUE, "o-"), (RED, "s--"))
FAINT = 0.15


def delay_figure(
    delays_ms: Sequence[float],
    curves: Mapping[str, Mapping[str, Sequence[float]]],
    margins_ms: Mapping[str, tuple[float, float]],
) -> Figure:
    """One panel a figure, one line a design; bands are the delay margins of a design's modes."""
    marks = list(next(iter(curves.values())))
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        for axes, mark in zip(figure.subplots(1, len(marks)), marks, strict=True):
            for (name, of_one), (colour, look) in zip(curves.items(), LOOKS, strict=False):
                axes.plot(delays_ms, of_one[mark], look, color=colour, markersize=3, label=name)
                low, high = margins_ms[name]
                if np.isfinite(low):
                    label = f"delay margins of {name}"
                    axes.axvspan(low, high, color=colour, alpha=FAINT, linewidth=0, label=label)
            axes.set_yscale("log")
            axes.set_xlabel("delay of the commands (ms)")
            axes.set_ylabel(mark)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure
