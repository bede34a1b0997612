"""Figures of a closed-loop check: small functions that draw on axes they are given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from linearize.standard import POSITION
from studies.closed_loop_check import Check
from studies.figures.style import PAGE_IN, kind_of_line, literal, new_figure
from studies.scenarios import LATE_S
from studies.text import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from studies.following_check import FollowingCheck
    from workbench.closed_loop import LoopRecord

A_STEP = 20.0  # an error beyond so many times the range of interest is the step itself
WIDER = 1.1  # than the error that is to be seen


def draw_position(axes: Axes, records: dict[str, LoopRecord]) -> None:
    """The reference and each run's position."""
    first = next(iter(records.values())).recording
    axes.plot(first.time_s, 1e3 * first[f"reference.{POSITION}"], color="0.6", label="reference")
    for style, (name, record) in zip(_styles(records), records.items(), strict=True):
        recording = record.recording
        axes.plot(recording.time_s, 1e3 * recording[POSITION], **style, label=name)
    axes.set_ylabel("position (mm)")


def draw_error(axes: Axes, records: dict[str, LoopRecord], largest_m: float = 1e-3) -> None:
    """Each run's error; where a step of the reference dwarfs it, near zero, with a note.

    Near zero is up to ``largest_m``, or the largest error at the end of a run where that is more.
    """
    most_m = late_m = 0.0
    for style, (name, record) in zip(_styles(records), records.items(), strict=True):
        recording = record.recording
        error = recording[POSITION] - recording[f"reference.{POSITION}"]
        axes.plot(recording.time_s, 1e3 * error, **style, label=name)
        most_m = max(most_m, float(abs(error).max()))
        late = recording.time_s >= recording.time_s[-1] - LATE_S
        late_m = max(late_m, float(abs(error[late]).max()))
    range_m = max(largest_m, WIDER * late_m)
    if most_m > max(A_STEP * largest_m, range_m):
        cut_near_zero(axes, 1e3 * range_m, 1e3 * most_m, "mm")
    axes.set_ylabel("error (mm)")


def cut_near_zero(axes: Axes, end: float, most: float, unit: str) -> None:
    """Only errors up to ``end`` are shown, with a note of how far they go."""
    axes.set_ylim(-end, end)
    told = f"axis cut at {number(end, 2)} {unit}; errors up to {number(most, 3)} {unit}"
    axes.set_title(told, loc="right")


def draw_command(axes: Axes, records: dict[str, LoopRecord]) -> None:
    """Each run's command."""
    for style, (name, record) in zip(_styles(records), records.items(), strict=True):
        recording = record.recording
        command = next(key for key in recording.channels if key.endswith("command_v"))
        axes.step(recording.time_s, recording[command], **style, where="post", label=name)
    axes.set_ylabel("command (V)")
    axes.set_xlabel("time (s)")


def by_scenario(check: Check | FollowingCheck) -> dict[str, dict[str, LoopRecord]]:
    """Records of each scenario, by design and estimator as a legend takes them."""
    found: dict[str, dict[str, LoopRecord]] = {}
    for row, record in zip(check.rows, check.records, strict=True):
        name = literal(f"{row.design}, {row.estimator}")
        found.setdefault(row.scenario, {})[name] = record
    return found


def check_figures(check: Check) -> dict[str, Figure]:
    """One figure per scenario, by file name without ending: position, error and command."""
    figures = {}
    for scenario, records in by_scenario(check).items():
        figure = new_figure(PAGE_IN, 5.5)
        position, error, command = figure.subplots(3, sharex=True)
        draw_position(position, records)
        draw_error(error, records)
        draw_command(command, records)
        handles, labels = position.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
        figures[f"closed_loop_{scenario}"] = figure
    return figures


def _styles(records: dict[str, LoopRecord]) -> list[dict[str, Any]]:
    """One colour per design, or per run of a single one, and a kind of line of its own for each."""
    designs = [name.rpartition(", ")[0] for name in records]
    alike = designs if len(set(designs)) > 1 else list(records)
    places = list(dict.fromkeys(alike))
    return [
        {"color": f"C{places.index(name)}", "linestyle": kind_of_line(k)}
        for k, name in enumerate(alike)
    ]
