"""Held-out errors on real recordings: as the model came, in the end, and by plain least squares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, GREY, ORANGE, PAGE_IN, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS = ("as the model came", "with what is named", "best of plain least squares")
LOOKS = ((GREY, ""), (BLUE, ""), (ORANGE, "////"))
WIDTH = 0.27
TITLES = {
    "seal": "force on a friction bench, by seal",
    "kicks": "position of a vertical cylinder",
    "chamber": "pressure of a closed chamber",
}
ACROSS = {"seal": "seal", "kicks": "trained on kicks", "chamber": "chamber"}


def real_figure(
    bars: Mapping[str, Mapping[str, tuple[float, float, float]]], units: Mapping[str, str]
) -> Figure:
    """One panel a kind of actuator, as wide as what it holds; three bars for each."""
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        widths = [max(len(each), 1.5) for each in bars.values()]
        panels = figure.subplots(1, len(bars), squeeze=False, width_ratios=widths)[0]
        for axes, (kind, errors) in zip(panels, bars.items(), strict=True):
            places = np.arange(len(errors))
            axes.set_xticks(places, errors)
            for k, (word, (colour, hatch)) in enumerate(zip(WORDS, LOOKS, strict=True)):
                values = [each[k] for each in errors.values()]
                drawn = axes.bar(places + WIDTH * (k - 1), values, 0.95 * WIDTH, color=colour,
                                 hatch=hatch, label=word)  # fmt: skip
                axes.bar_label(drawn, fmt="%.3g", fontsize=6)
            axes.margins(y=0.15)
            axes.grid(False, axis="x")
            axes.set_xlabel(ACROSS[kind])
            axes.set_ylabel(f"RMSE held out ({units[kind]})")
            axes.set_title(TITLES[kind], fontsize=8)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure
