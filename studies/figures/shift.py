"""A shift from Low to Neutral in the plant and in linear models, and what explains the gap."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    PAGE_IN,
    RED,
    new_figure,
    styled,
    thinned,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from studies.low_to_neutral import Shift

LOOKS = ((RED, "--"), (BLUE, ":"), (GREEN, "-."))
PANELS = ((2, 1e3, "position (mm)"), (0, 1e-5, "pressure in chamber 1 (bar)"))
SHOWN_S = 16e-3


def shift_figure(
    seen: Shift, models: Mapping[str, np.ndarray], parts: Mapping[str, float]
) -> Figure:
    """Position, pressure in chamber 1, and the share of each repair in the error of the position.

    ``models`` holds states of shape (4, n + 1) by name, ``parts`` metres by repair.
    """
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        axes = figure.subplots(1, 3)
        upto = int(np.searchsorted(seen.time_s, SHOWN_S))
        for panel, (row, unit, label) in zip(axes, PANELS, strict=False):
            _curve(panel, seen.time_s[:upto], unit * seen.states[row, :upto], "plant", BLACK, "-")
            for (name, states), look in zip(models.items(), LOOKS, strict=True):
                _curve(panel, seen.time_s[:upto], unit * states[row, :upto], name, *look)
            panel.axvline(1e3 * seen.time_s[seen.arrival], color=GREY, label="plant at Neutral")
            panel.set_xlabel("time (ms)")
            panel.set_ylabel(label)
        names = sorted(parts, key=lambda name: parts[name])
        axes[-1].barh(names, [1e3 * parts[name] for name in names], color=GREY)
        axes[-1].set_xlabel("taken off the RMSE of the position (mm)")
        axes[-1].axvline(0.0, color=BLACK, linewidth=0.6)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _curve(
    panel: Axes, time_s: np.ndarray, values: np.ndarray, name: str, colour: str, line: str
) -> None:
    t, y = thinned(1e3 * time_s, values)
    panel.plot(t, y, color=colour, linestyle=line, label=name)
