"""Figures of gear shifts: closed loops beside the open one, and the commands of both valves."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from linearize.shifting import POSITION
from studies.figures.style import COLUMN_IN, GREEN, GREY, literal, look, new_figure
from studies.shift_check import OPEN_LOOP, SETTLED_M, ShiftCheck
from workbench.plants.gearbox import COMMANDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.closed_loop import LoopRecord

SETTLED = {"color": GREEN, "alpha": 0.4, "linewidth": 0.0, "label": "settled"}


def shift_figures(found: ShiftCheck) -> dict[str, Figure]:
    """One figure per shift, by file name without ending; the band is where a shift is settled."""
    figures = {}
    for scenario in dict.fromkeys(row.scenario for row in found.rows):
        figure = new_figure(COLUMN_IN, 3.2)
        place, *valves = figure.subplots(3, sharex=True, height_ratios=(4, 1, 1))
        pairs = [
            p for p in zip(found.rows, found.records, strict=True) if p[0].scenario == scenario
        ]
        _draw_open_loops(place, valves, [record for _, record in pairs])
        for k, (row, record) in enumerate(pairs):
            recording = record.recording
            time_ms, line = 1e3 * recording.time_s, {"label": literal(row.design), **look(k)}
            place.plot(time_ms, 1e3 * recording[POSITION], **line)
            for axes, command in zip(valves, COMMANDS, strict=True):
                axes.step(time_ms, recording[command], where="post", **line)
        target_mm = 1e3 * recording[f"reference.{POSITION}"][-1]
        band_mm = 1e3 * SETTLED_M
        place.axhspan(target_mm - band_mm, target_mm + band_mm, **SETTLED)
        place.set_ylabel("main piston (mm)")
        for axes, label in zip(valves, ("valve 1", "valve 2"), strict=True):
            axes.set(ylabel=label, ylim=(-0.2, 1.2), yticks=(0, 1))
        valves[-1].set_xlabel("time (ms)")
        figure.legend(*place.get_legend_handles_labels(), loc="outside upper center", ncols=3)
        figures[f"shift_{scenario}"] = figure
    return figures


def _draw_open_loops(place: Axes, valves: Iterable[Axes], records: list[LoopRecord]) -> None:
    """What each plant does without a brake, once for all designs on it, thin and grey."""
    line = {"color": GREY, "linestyle": "-", "linewidth": 0.5}
    different = {each.recording[OPEN_LOOP + POSITION].tobytes(): each for each in records}
    for k, record in enumerate(different.values()):
        recording = record.recording
        time_ms, label = 1e3 * recording.time_s, "open loop" if k == 0 else "_nolegend_"
        place.plot(time_ms, 1e3 * recording[OPEN_LOOP + POSITION], label=label, **line)
        for axes, command in zip(valves, COMMANDS, strict=True):
            axes.step(time_ms, recording[OPEN_LOOP + command], where="post", label=label, **line)
