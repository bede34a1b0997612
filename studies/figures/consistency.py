"""Normalised errors of estimators over time, beside the band they belong into."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.estimator_runs import band
from studies.figures.style import COLUMN_IN, GREY, new_figure, styled

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.figure import Figure


def consistency_figure(
    courses: Mapping[str, tuple[np.ndarray, np.ndarray]], step_s: float, degrees: int
) -> Figure:
    """Mean NEES over runs, (n,), with how many runs are in it, (n,), by estimator."""
    with styled():
        figure = new_figure(1.4 * COLUMN_IN, 2.6)
        axes = figure.subplots()
        mean, runs = next(iter(courses.values()))
        time_s = step_s * (1 + np.arange(len(mean)))
        judged = np.isfinite(mean)
        ends = np.array([band(degrees, n) if n else (np.nan, np.nan) for n in runs])
        ends[~judged] = np.nan
        axes.fill_between(
            time_s, *ends.T, color=GREY, alpha=0.4, linewidth=0.0, label="95 % band of the runs"
        )
        for name, (values, _) in courses.items():
            axes.plot(time_s, values, label=name)
        axes.axhline(degrees, color="0.3", linestyle=":", linewidth=0.8)
        axes.set_ylim(0.0, 3.0 * degrees)
        axes.set_xlabel("time (s)")
        axes.set_ylabel("NEES, mean over moving runs (-)")
        figure.legend(loc="outside lower center", ncols=len(courses) + 1)
    return figure
