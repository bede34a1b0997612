"""Figures of a closed-loop check: small functions that draw on axes they are given."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linearize.standard import POSITION
from studies.closed_loop_check import Check
from studies.figures.style import PAGE_IN, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.closed_loop import LoopRecord

LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1)), (0, (3, 1)), (0, (1, 1)))
A_STEP = 20.0  # an error beyond so many times the range of interest is the step itself


def draw_position(axes: Axes, records: dict[str, LoopRecord]) -> None:
    """The reference and each run's position."""
    first = next(iter(records.values())).recording
    axes.plot(first.time_s, 1e3 * first[f"reference.{POSITION}"], color="0.6", label="reference")
    for style, (name, record) in zip(_styles(records), records.items(), strict=True):
        recording = record.recording
        axes.plot(recording.time_s, 1e3 * recording[POSITION], **style, label=name)
    axes.set_ylabel("position (mm)")


def draw_error(axes: Axes, records: dict[str, LoopRecord], largest_m: float = 1e-3) -> None:
    """Each run's error; near zero, up to ``largest_m``, where a step of the reference dwarfs it."""
    most_m = 0.0
    for style, (name, record) in zip(_styles(records), records.items(), strict=True):
        recording = record.recording
        error = recording[POSITION] - recording[f"reference.{POSITION}"]
        axes.plot(recording.time_s, 1e3 * error, **style, label=name)
        most_m = max(most_m, float(abs(error).max()))
    if most_m > A_STEP * largest_m:
        axes.set_ylim(-1e3 * largest_m, 1e3 * largest_m)
    axes.set_ylabel("error (mm)")


def draw_command(axes: Axes, records: dict[str, LoopRecord]) -> None:
    """Each run's command."""
    for style, (name, record) in zip(_styles(records), records.items(), strict=True):
        recording = record.recording
        command = next(key for key in recording.channels if key.endswith("command_v"))
        axes.step(recording.time_s, recording[command], **style, where="post", label=name)
    axes.set_ylabel("command (V)")
    axes.set_xlabel("time (s)")


def check_figures(check: Check) -> dict[str, Figure]:
    """One figure per scenario, by file name without ending: position, error and command."""
    figures = {}
    for scenario in dict.fromkeys(row.scenario for row in check.rows):
        records = {
            f"{row.design}, {row.estimator}": record
            for row, record in zip(check.rows, check.records, strict=True)
            if row.scenario == scenario
        }
        figure = new_figure(PAGE_IN, 5.5)
        position, error, command = figure.subplots(3, sharex=True)
        draw_position(position, records)
        draw_error(error, records)
        draw_command(command, records)
        handles, labels = position.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
        figures[f"closed_loop_{scenario}"] = figure
    return figures


def _styles(records: dict[str, LoopRecord]) -> list[dict[str, str]]:
    """One colour per design, and a kind of line of its own for each run, as a grey print asks."""
    designs = list(dict.fromkeys(name.rpartition(", ")[0] for name in records))
    return [
        {
            "color": f"C{designs.index(name.rpartition(', ')[0])}",
            "linestyle": LINES[k % len(LINES)],
        }
        for k, name in enumerate(records)
    ]
