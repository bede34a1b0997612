"""The poles of all modes in one plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, GREEN, ORANGE, PAGE_IN, RED, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linearize.modes import HybridModel

MARKERS = ("o", "s", "^", "D", "v", "x")
COLOURS = (BLUE, RED, GREEN, ORANGE)


def pole_figure(hybrid: HybridModel) -> Figure:
    """Poles of every mode: a panel per interval of the first cut, markers for the second."""
    first, *rest = hybrid.modes[0].box
    second = rest[0] if rest else first
    panels = list(dict.fromkeys(mode.box[first].label for mode in hybrid.modes))
    kinds = list(dict.fromkeys(mode.box[second].label for mode in hybrid.modes))
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        axes = figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False)[0]
        for panel, label in zip(axes, panels, strict=True):
            for kind, marker, colour in zip(kinds, MARKERS, COLOURS * 2, strict=False):
                chosen = [
                    mode
                    for mode in hybrid.modes
                    if mode.box[first].label == label and mode.box[second].label == kind
                ]
                poles = np.concatenate([np.linalg.eigvals(mode.A) for mode in chosen])
                panel.plot(
                    poles.real,
                    poles.imag,
                    marker,
                    color=colour,
                    markersize=4,
                    markerfacecolor="none",
                    linestyle="none",
                    label=kind,
                )
            panel.axvline(0.0, color="0.4", linewidth=0.6)
            panel.set_title(f"valve: {label}")
            panel.set_xlabel("real part (1/s)")
        axes[0].set_ylabel("imaginary part (rad/s)")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure
