"""Figures of an improvement: the error after each accepted effect, and errors before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, COLUMN_IN, ORANGE, PAGE_IN, new_figure, styled
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from workbench.fitting.errors import SignalError


def budget_figure(budget: Sequence[tuple[str, float, float]]) -> Figure:
    """The falling error: (label, chi2 per sample training, validation) after each effect."""
    with styled():
        figure = new_figure(COLUMN_IN, 2.4)
        axes = figure.subplots()
        places = np.arange(len(budget))
        labels = [label.replace("@", "\n@") for label, _, _ in budget]
        axes.set_xticks(places, labels, rotation=20 if len(budget) > 3 else 0)
        sets = (("training", 1, BLUE, ""), ("validation", 2, ORANGE, "////"))
        for offset, (label, column, colour, hatch) in zip((-0.2, 0.2), sets, strict=True):
            values = [row[column] for row in budget]
            bars = axes.bar(places + offset, values, 0.38, color=colour, hatch=hatch, label=label)
            axes.bar_label(bars, fmt="%.3g", fontsize=6)
        axes.grid(False, axis="x")
        axes.set_ylabel("weighted squared error per sample (-)")
        axes.set_title("error after each accepted effect")
        axes.legend()
    return figure


def before_after_figure(
    before: Mapping[str, Mapping[str, SignalError]],
    after: Mapping[str, Mapping[str, SignalError]],
    unit_of: Mapping[str, str],
) -> Figure:
    """RMSE over windows of each output before and after, on each set."""
    outputs = list(next(iter(before.values())))
    with styled():
        figure = new_figure(PAGE_IN, 2.2)
        panels = figure.subplots(1, len(outputs), squeeze=False)[0]
        for axes, output in zip(panels, outputs, strict=True):
            full = unit_of.get(output, output)
            factor = 1.0 / display_scale(full).factor
            sets = [label for label in before if output in after.get(label, {})]
            places = np.arange(len(sets))
            axes.set_xticks(places, sets)
            for offset, (label, errors, colour, hatch) in zip(
                (-0.2, 0.2),
                (("before", before, ORANGE, "////"), ("after", after, BLUE, "")),
                strict=True,
            ):
                values = [factor * errors[name][output].rmse for name in sets]
                bars = axes.bar(
                    places + offset, values, 0.38, color=colour, hatch=hatch, label=label
                )
                axes.bar_label(bars, fmt="%.2g", fontsize=6)
            axes.margins(y=0.15)
            axes.grid(False, axis="x")
            axes.set_ylabel(f"RMSE ({display_unit(full)})")
            axes.set_title(public_name(output).replace(".", " ").replace("_", " "))
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure
