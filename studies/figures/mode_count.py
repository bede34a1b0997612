"""What a closed loop gains with more modes along the stroke."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from studies.figures.style import BLUE, PAGE_IN, RED, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = ((BLUE, "o-"), (RED, "s--"))


def mode_count_figure(
    places: Sequence[int], curves: Mapping[str, Mapping[str, Sequence[float]]]
) -> Figure:
    """One panel a figure, one line a design, over the number of parts of the stroke."""
    marks = list(next(iter(curves.values())))
    with styled():
        figure = new_figure(PAGE_IN, 2.2)
        for axes, mark in zip(figure.subplots(1, len(marks)), marks, strict=True):
            for (name, of_one), (colour, look) in zip(curves.items(), LOOKS, strict=False):
                axes.plot(places, of_one[mark], look, color=colour, markersize=3, label=name)
            axes.set_xticks(places)
            axes.set_ylim(bottom=0.0)
            axes.set_xlabel("parts of the stroke (-)")
            axes.set_ylabel(mark.replace(": ", ":\n"))
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure
