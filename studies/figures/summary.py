"""The whole loop in one figure: what is missing, the error without and with it, the closed loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linearize.standard import POSITION
from studies.figures.style import BLUE, GREY, ORANGE, PAGE_IN, new_figure, styled, thinned
from workbench.comparison.compare import WINDOW
from workbench.diagnosis.result import told
from workbench.fitting.windows import WINDOW_S
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from studies.closed_loop_check import Check
    from workbench.comparison.compare import RecordingComparison
    from workbench.diagnosis.result import Diagnosis

BEST = 5


def summary_figure(
    found: Diagnosis, before: RecordingComparison, after: RecordingComparison, check: Check
) -> Figure:
    """Ranking, error of the signal that gained most, and the steps with one estimator."""
    with styled():
        figure = new_figure(PAGE_IN, 2.3)
        ranking, error, step = figure.subplots(1, 3, width_ratios=(1, 1.3, 1.1))
        _draw_ranking(ranking, found)
        _draw_error(error, before, after)
        _draw_step(step, check)
    return figure


def _draw_ranking(axes: Axes, found: Diagnosis) -> None:
    rows = found.ranking[:BEST]
    places = np.arange(len(rows))
    axes.set_yticks(places, [row.candidate.name.replace("@", "\n@") for row in rows])
    drops = [100.0 * max(told(row.drop_train), 0.0) for row in rows]
    axes.barh(places, drops, 0.6, color=[BLUE] + [GREY] * (len(rows) - 1))
    axes.invert_yaxis()
    axes.set_xlabel("drop of the misfit (%)")
    axes.set_title("which effect is missing")


def _draw_error(axes: Axes, before: RecordingComparison, after: RecordingComparison) -> None:
    def rmse(each: RecordingComparison, name: str) -> float:
        return each.errors[WINDOW][name].rmse

    output = min(before.measured, key=lambda name: rmse(after, name) / rmse(before, name))
    factor = 1.0 / display_scale(output).factor
    for each, label, colour, line in (
        (before, "as it came", ORANGE, "-"),
        (after, "improved", BLUE, "-"),
    ):
        error = factor * (each.measured[output] - each.simulated[WINDOW][output])
        time_s, error = thinned(each.time_s, error)
        axes.plot(time_s, error, line, color=colour, linewidth=0.7, label=label)
    words = public_name(output).replace(".", " ").replace("_", " ")
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"error of {words} ({display_unit(output)})")
    axes.set_title(f"validation, windows of {WINDOW_S:g} s")
    axes.legend()


def _draw_step(axes: Axes, check: Check) -> None:
    seen: dict[str, None] = {}
    for row, record in zip(check.rows, check.records, strict=True):
        if row.scenario != "step" or row.design in seen:
            continue
        recording = record.recording
        if not seen:
            reference = 1e3 * recording[f"reference.{POSITION}"]
            axes.plot(recording.time_s, reference, "-", color=GREY, label="reference")
        line = ("-", "--", "-.")[len(seen) % 3]
        seen[row.design] = None
        axes.plot(
            recording.time_s,
            1e3 * recording[POSITION],
            line,
            color=f"C{len(seen) - 1}",
            label=f"{row.design}, {row.estimator}",
        )
    axes.set_xlabel("time (s)")
    axes.set_ylabel("position (mm)")
    axes.set_title("closed loop, full plant")
    axes.legend(loc="lower right")
