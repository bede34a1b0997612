"""Figures of a plant that follows a reference: each signal, its error, and the commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.closed_loop_figures import WIDER, by_scenario, cut_near_zero
from studies.figures.style import GREY, PAGE_IN, look, new_figure
from studies.following_check import FollowingCheck
from studies.scenarios import LATE_S
from studies.text import labelled
from workbench.units import display_scale, display_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.closed_loop import LoopRecord

REFERENCE = "reference."
ROW_IN = 1.3
JUMP = 0.5  # of the largest error: a reference that moves so far in a sample makes it
NEAR = 0.04  # of the largest error of a step: what is shown of it at least


def following_figures(found: FollowingCheck) -> dict[str, Figure]:
    """One figure per scenario, by file name without ending; a line per design and estimator."""
    return {f"following_{name}": _figure(runs) for name, runs in by_scenario(found).items()}


def _figure(runs: dict[str, LoopRecord]) -> Figure:
    first = next(iter(runs.values())).recording
    followed = [n.removeprefix(REFERENCE) for n in first.channels if n.startswith(REFERENCE)]
    commands = [n for n in first.channels if n.startswith("valve")]
    number = 2 * len(followed) + len(commands)
    figure = new_figure(PAGE_IN, 0.6 + ROW_IN * number)
    panels = figure.subplots(number, sharex=True)
    for k, name in enumerate(followed):
        _draw_signal(panels[2 * k], runs, name)
        _draw_error(panels[2 * k + 1], runs, name)
    for axes, name in zip(panels[2 * len(followed) :], commands, strict=True):
        for k, (run, record) in enumerate(runs.items()):
            axes.step(first.time_s, record.recording[name], where="post", label=run, **look(k))
        axes.set_ylabel(_lines(labelled(name)))
    panels[-1].set_xlabel("time (s)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _draw_signal(axes: Axes, runs: dict[str, LoopRecord], name: str) -> None:
    for k, (run, record) in enumerate(runs.items()):
        recording, unit = record.recording, display_scale(name)
        if k == 0:
            wanted = unit.from_si(recording[REFERENCE + name])
            axes.plot(recording.time_s, wanted, color=GREY, linestyle="-", label="reference")
        axes.plot(recording.time_s, unit.from_si(recording[name]), label=run, **look(k))
    axes.set_ylabel(_lines(labelled(name)))


def _draw_error(axes: Axes, runs: dict[str, LoopRecord], name: str) -> None:
    most = late = 0.0
    for k, (run, record) in enumerate(runs.items()):
        recording = record.recording
        wanted, factor = recording[REFERENCE + name], display_scale(name).factor
        error = (recording[name] - wanted) / factor
        axes.plot(recording.time_s, error, label=run, **look(k))
        most = max(most, float(abs(error).max()))
        late = max(late, float(abs(error[recording.time_s >= recording.time_s[-1] - LATE_S]).max()))
    end = max(NEAR * most, WIDER * late)
    if most > end and float(abs(np.diff(wanted)).max()) > JUMP * most * factor:
        cut_near_zero(axes, end, most, display_unit(name))  # the step hides what is left in the end
    axes.set_ylabel(f"error\n({display_unit(name)})")
    axes.set_label(f"error of {labelled(name)}")  # in the table


def _lines(label: str) -> str:
    """The unit below the words."""
    words, bracket, unit = label.rpartition(" (")
    return f"{words}\n({unit}" if bracket else label
