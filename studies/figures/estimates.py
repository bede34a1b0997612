"""Errors of estimates inside the bands of their covariances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, ORANGE, PAGE_IN, new_figure, styled, thinned
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from studies.estimated import EstimatedRecording
    from studies.estimator_runs import Followed

MOST_STATES = 4
BEYOND = 1.4  # times the widest late band: the start of a run is cut off


def estimate_figures(found: Sequence[EstimatedRecording]) -> dict[str, Figure]:
    """One figure per recording, by file name: each state's error and band, by estimator."""
    return {
        f"estimates_{each.name.replace(' ', '_')}": band_figure(
            {row.name: row.simulated for row in each.rows},
            {name: each.truth[name] for name in _shown(each)},
            each.sample_time_s,
        )
        for each in found
    }


def band_figure(
    runs: Mapping[str, Followed], truth: Mapping[str, np.ndarray], sample_time_s: float
) -> Figure:
    """Estimate less truth in a band of two standard deviations; a row per state, (n,) each."""
    with styled():
        figure = new_figure(PAGE_IN, 0.6 + 1.3 * len(truth))
        grid = figure.subplots(len(truth), len(runs), squeeze=False, sharex=True, sharey="row")
        for axes_row, (name, true) in zip(grid, truth.items(), strict=True):
            there = [run for run in runs.values() if name in run.names]
            for axes, run in zip(axes_row, runs.values(), strict=True):
                if name in run.names:
                    _band(axes, run, name, true, sample_time_s)
            widest = [
                np.percentile(2.0 * run.deviation(name)[len(true) // 10 :], 98) for run in there
            ]
            off = [np.percentile(np.abs(run.state(name) - true), 98) for run in there]
            limit = BEYOND * display_scale(name).factor ** -1 * max(*widest, *off)
            axes_row[0].set_ylim(-limit, limit)
            for axes in axes_row:
                _told_beyond(axes, limit)
            words = public_name(name).replace(".", "\n").replace("_", " ")
            axes_row[0].set_ylabel(f"{words}\nerror ({display_unit(name)})")
        for axes, label in zip(grid[0], runs, strict=True):
            axes.set_title(label)
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
        handles = grid[0, 0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=2)
    return figure


def _band(axes: Axes, run: Followed, name: str, true: np.ndarray, sample_time_s: float) -> None:
    factor = 1.0 / display_scale(name).factor
    time_s, error, deviation = thinned(
        sample_time_s * np.arange(len(true)),
        factor * (run.state(name) - true),
        factor * run.deviation(name),
    )
    axes.fill_between(
        time_s, -2 * deviation, 2 * deviation, color=ORANGE, alpha=0.35, linewidth=0.0,
        label="two standard deviations",
    )  # fmt: skip
    axes.plot(time_s, error, color=BLUE, linestyle="-", linewidth=0.7, label="estimate less truth")


def _told_beyond(axes: Axes, limit: float) -> None:
    """Says of the largest error that is cut off how large it is."""
    errors = [np.abs(np.asarray(line.get_ydata())) for line in axes.lines]
    largest = max((float(np.nanmax(each)) for each in errors), default=0.0)
    if largest > limit:
        where = {"transform": axes.transAxes, "ha": "right", "va": "bottom", "fontsize": 6}
        axes.text(1.0, 1.01, f"up to {largest:.3g}", **where)


def _shown(each: EstimatedRecording) -> list[str]:
    """States of bodies and gas that every plant has, no more than fit on a page."""
    names = dict.fromkeys(name for row in each.rows for name in row.state_rmse)
    kinds = ("position_m", "angle_rad", "velocity_m_s", "velocity_rad_s", "pressure_pa")
    wanted = [name for name in names if name.endswith(kinds)] or list(names)
    return wanted[:MOST_STATES]
