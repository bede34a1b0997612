"""Figures of a comparison: overlay with errors and worst windows, and where the error is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, GREY, ORANGE, PAGE_IN, RED, new_figure, styled, thinned
from studies.text import labelled
from workbench.comparison.compare import FREE_RUN, ONE_STEP, PLAIN, WINDOW
from workbench.units import display_scale, display_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.comparison.compare import Comparison, RecordingComparison

LINES = {ONE_STEP: ("-.", ORANGE), WINDOW: ("-", BLUE), FREE_RUN: ("--", RED), PLAIN: ("-", BLUE)}
OVERLAID = (FREE_RUN, WINDOW, PLAIN)


def comparison_figures(found: Comparison, prefix: str = "") -> dict[str, Figure]:
    """Two figures per recording, by file name."""
    figures = {}
    for each in found.recordings:
        name = each.name.replace(" ", "_")
        figures[f"{prefix}comparison_{name}"] = overlay_figure(each)
        if each.by_regime:
            figures[f"{prefix}regimes_{name}"] = regime_figure(each)
    return figures


def overlay_figure(each: RecordingComparison) -> Figure:
    """Every output measured and simulated, and its error over windows; the worst are shaded."""
    with styled():
        figure = new_figure(PAGE_IN, 0.9 + 1.35 * len(each.measured))
        panels = figure.subplots(len(each.measured), 2, sharex=True, squeeze=False)
        for name, (left, right) in zip(each.measured, panels, strict=True):
            _draw_overlay(left, each, name)
            _draw_error(right, each, name)
        for axes in panels[-1]:
            axes.set_xlabel("time (s)")
        panels[0, 0].set_title(f"{each.name}: measured and simulated")
        panels[0, 1].set_title("measured minus simulated, worst windows shaded")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure


def _draw_overlay(axes: Axes, each: RecordingComparison, name: str) -> None:
    to_people = display_scale(name).from_si
    time_s, measured = thinned(each.time_s, each.measured[name])
    axes.plot(time_s, to_people(measured), "-", color=GREY, linewidth=2.0, label="measured")
    for horizon in OVERLAID:
        if horizon in each.simulated:
            style, colour = LINES[horizon]
            (simulated,) = thinned(each.simulated[horizon][name])
            axes.plot(time_s, to_people(simulated), linestyle=style, color=colour, label=horizon)
    axes.set_ylabel(labelled(name))
    _hold_range(axes, to_people(measured))


def _hold_range(axes: Axes, measured: np.ndarray) -> None:
    """The range of what was measured and as much again: a free run may drift far off."""
    low, high = np.nanmin(measured), np.nanmax(measured)
    room = 0.5 * (high - low) or 1.0
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, low - room), min(top, high + room))


def _draw_error(axes: Axes, each: RecordingComparison, name: str) -> None:
    factor = 1.0 / display_scale(name).factor
    horizon = next(h for h in (WINDOW, PLAIN, FREE_RUN, ONE_STEP) if h in each.simulated)
    style, colour = LINES[horizon]
    error = each.measured[name] - each.simulated[horizon][name]
    time_s, error = thinned(each.time_s, factor * error)
    axes.plot(time_s, error, linestyle=style, color=colour, linewidth=0.6, label=horizon)
    for span in each.worst:
        axes.axvspan(span.start_s, span.end_s, color=ORANGE, alpha=0.35, linewidth=0)
    axes.set_ylabel(f"error, {horizon} ({display_unit(name)})")


def regime_figure(each: RecordingComparison) -> Figure:
    """Share of the error beside the share of the time, by regime."""
    with styled():
        figure = new_figure(3.5, 0.8 + 0.28 * len(each.by_regime))
        axes = figure.subplots()
        rows = np.arange(len(each.by_regime))
        error = [100.0 * regime.share_of_error for regime in each.by_regime]
        time = [100.0 * regime.share_of_time for regime in each.by_regime]
        axes.set_yticks(rows, [regime.name for regime in each.by_regime])
        axes.barh(rows - 0.2, error, 0.38, color=RED, label="of the squared error")
        axes.barh(rows + 0.2, time, 0.38, color="0.75", hatch="////", label="of the time")
        axes.invert_yaxis()
        axes.set_xlabel("share (%)")
        axes.set_title(f"{each.name}: where the error is")
        axes.legend()
    return figure
