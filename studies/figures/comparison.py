"""Figures of a comparison: overlay with errors and worst windows, and where the error is."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.error_maps import map_figure
from studies.figures.residuals import residual_figure
from studies.figures.style import (
    BLUE,
    GREY,
    ORANGE,
    PAGE_IN,
    RED,
    headline,
    new_figure,
    styled,
    thinned,
)
from studies.text import labelled
from studies.text_of_comparison import shown_regimes
from workbench.comparison.compare import FREE_RUN, ONE_STEP, PLAIN, WINDOW
from workbench.units import display_scale, display_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.comparison.compare import Comparison, RecordingComparison

LINES = {ONE_STEP: ("-.", ORANGE), WINDOW: ("-", BLUE), FREE_RUN: ("--", RED), PLAIN: ("-", BLUE)}
OVERLAID = (FREE_RUN, WINDOW, PLAIN)
IN_A_COLUMN = 4  # outputs
BARS_IN = 3.6  # across the bars of the regimes, beside their names


def comparison_figures(found: Comparison, prefix: str = "") -> dict[str, Figure]:
    """The figures of every recording by file name; what a plant lacks has none."""
    figures = {}
    for each in found.recordings:
        name = each.name.replace(" ", "_")
        figures[f"{prefix}comparison_{name}"] = overlay_figure(each)
        if each.by_regime:
            figures[f"{prefix}regimes_{name}"] = regime_figure(each)
        if each.over_motion:
            title = f"{each.name}, {each.judged}\nerror over position and speed"
            figures[f"{prefix}error_over_motion_{name}"] = map_figure(each.over_motion, title)
        if each.over_command:
            title = f"{each.name}, {each.judged}\nerror over command and pressure"
            figures[f"{prefix}error_over_command_{name}"] = map_figure(each.over_command, title)
        figures[f"{prefix}residuals_{name}"] = residual_figure(each)
    return figures


def overlay_figure(each: RecordingComparison) -> Figure:
    """Every output measured and simulated with the error beneath; worst windows shaded, if any."""
    names = list(each.measured)
    across = ceil(len(names) / IN_A_COLUMN)
    down = ceil(len(names) / across)
    with styled():
        figure = new_figure(PAGE_IN, 0.9 + 1.7 * down)
        panels = figure.subplots(
            2 * down, across, sharex=True, squeeze=False, height_ratios=(1.6, 1.0) * down
        )
        for axes in panels.flat[2 * len(names) :]:
            axes.set_visible(False)
        for k, name in enumerate(names):
            row, column = 2 * (k // across), k % across
            upper, lower = panels[row : row + 2, column]
            _draw_overlay(upper, each, name)
            _draw_error(lower, each, name)
            for axes in (upper, lower):
                axes.set_visible(True)
                _mark_worst(axes, each)
            if k + across >= len(names):
                lower.set_xlabel("time (s)")
                lower.tick_params(labelbottom=True)
        shaded = ", worst windows shaded" if each.worst else ""
        title = f"{each.name}: measured, simulated and error{shaded}"
        figure.suptitle(headline(title, PAGE_IN), fontsize=8)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        more, words = panels[1, 0].get_legend_handles_labels()
        columns = len(handles) + len(more)
        figure.legend(handles + more, labels + words, loc="outside lower center", ncols=columns)
    return figure


def _draw_overlay(axes: Axes, each: RecordingComparison, name: str) -> None:
    to_people = display_scale(name).from_si
    measured = to_people(each.measured[name])
    drawn = thinned(each.time_s, measured)
    axes.plot(*drawn, "-", color=GREY, linewidth=2.0, label="measured")
    for horizon in OVERLAID:
        if horizon in each.simulated:
            style, colour = LINES[horizon]
            drawn = thinned(each.time_s, to_people(each.simulated[horizon][name]))
            axes.plot(*drawn, linestyle=style, color=colour, label=horizon)
    axes.set_ylabel(labelled(name).replace(" (", "\n("))
    if FREE_RUN in each.simulated and np.isfinite(measured).any():
        _hold_range(axes, measured)


def _hold_range(axes: Axes, measured: np.ndarray) -> None:
    """The range of what was measured and as much again: a free run may drift far off."""
    low, high = np.nanmin(measured), np.nanmax(measured)
    room = 0.5 * (high - low) or 1.0
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, low - room), min(top, high + room))


def _draw_error(axes: Axes, each: RecordingComparison, name: str) -> None:
    factor = 1.0 / display_scale(name).factor
    style, colour = LINES[each.judged]
    error = each.measured[name] - each.simulated[each.judged][name]
    time_s, error = thinned(each.time_s, factor * error)
    noise = 2.0 * factor * each.noise[name].value
    axes.axhspan(-noise, noise, color=GREY, alpha=0.5, linewidth=0, label="twice the noise")
    label = f"error, {each.judged}"
    axes.plot(time_s, error, linestyle=style, color=colour, linewidth=0.6, label=label)
    axes.set_ylabel(f"error\n({display_unit(name)})")
    axes.set_label(f"error of {labelled(name)}")  # in the table


def _mark_worst(axes: Axes, each: RecordingComparison) -> None:
    for span in each.worst:
        axes.axvspan(span.start_s, span.end_s, color=ORANGE, alpha=0.35, linewidth=0)


def regime_figure(each: RecordingComparison) -> Figure:
    """Share of the error beside the share of the time, by regime; regimes overlap."""
    shown = shown_regimes(each.by_regime)
    with styled():
        figure = new_figure(PAGE_IN / 1.5, 1.0 + 0.26 * len(shown))
        axes = figure.subplots()
        rows = np.arange(len(shown))
        error = [100.0 * regime.share_of_error for regime in shown]
        time = [100.0 * regime.share_of_time for regime in shown]
        axes.set_yticks(rows, [regime.name for regime in shown])
        axes.barh(rows - 0.2, error, 0.38, color=RED, label="of the squared error")
        axes.barh(rows + 0.2, time, 0.38, color="0.75", hatch="////", label="of the time")
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        axes.set_xlabel("share (%)")
        title = f"{each.name}: where the error is, {each.judged}; regimes overlap"
        axes.set_title(headline(title, BARS_IN))
        axes.set_label(title)  # in the table
        figure.legend(loc="outside lower center", ncols=2)  # all bars may be long
    return figure
