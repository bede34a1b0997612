"""Positioning results beside the published ones: one panel for each yardstick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PAGE_IN,
    PURPLE,
    RED,
    SKY,
    new_figure,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = ((BLUE, "o"), (RED, "s"), (GREEN, "^"), (PURPLE, "D"), (ORANGE, "v"), (SKY, "P"))
"""Colour and marker of each design."""
APART = 0.15  # of the distance between payloads


def yardstick_figure(
    rows: Mapping[tuple[str, float], Sequence[Mapping[str, float | None]]],
    limits: Mapping[str, float],
) -> Figure:
    """Medians with all draws as a line, by payload; the published figure is dashed.

    ``rows`` holds the numbers of all draws by design and payload.
    """
    from matplotlib.ticker import LogFormatter

    designs = list(dict.fromkeys(name for name, _ in rows))
    payloads = list(dict.fromkeys(kg for _, kg in rows))
    with styled():
        figure = new_figure(PAGE_IN, 4.6)
        panels = figure.subplots(2, 3, sharex=True).ravel()
        for axes, (mark, limit) in zip(panels, limits.items(), strict=True):
            for k, (name, (colour, marker)) in enumerate(zip(designs, LOOKS, strict=False)):
                at = np.arange(len(payloads)) + APART * (k - (len(designs) - 1) / 2.0)
                found = [_finite(rows[name, kg], mark) for kg in payloads]
                medians = [np.median(values) for values in found]
                axes.plot(at, medians, marker, color=colour, markersize=4, label=name)
                ends = [values.min() for values in found], [values.max() for values in found]
                axes.vlines(at, *ends, color=colour, linewidth=1.0)
            axes.axhline(limit, color=BLACK, linestyle="--", linewidth=0.8, label="published")
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter(LogFormatter(minor_thresholds=(1.0, 0.5)))
            axes.set_ylabel(mark.replace(": ", ":\n"))
            axes.set_xticks(range(len(payloads)), [f"{kg:g}" for kg in payloads])
        for axes in panels[3:]:
            axes.set_xlabel("payload (kg)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _finite(found: Sequence[Mapping[str, float | None]], mark: str) -> np.ndarray:
    """The numbers of the draws that stayed finite; NaN where none did."""
    values = [row[mark] for row in found if row[mark] is not None]
    return np.array(values or [np.nan])
