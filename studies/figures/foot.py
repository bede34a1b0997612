"""Figures of a leg's foot: its way beside the wanted one, and how far it is off."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.closed_loop_figures import by_scenario
from studies.figures.following import REFERENCE
from studies.figures.style import GREY, PAGE_IN, look, new_figure
from studies.following_check import FollowingCheck, foot_m

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.closed_loop import LoopRecord
    from workbench.plant import Plant

LEG = "crr_leg"
MM = 1e3


def foot_figures(found: FollowingCheck, plant: Plant) -> dict[str, Figure]:
    """One figure per scenario, by file name without ending; a line per design and estimator."""
    return {f"foot_{name}": _figure(runs, plant) for name, runs in by_scenario(found).items()}


def _figure(runs: dict[str, LoopRecord], plant: Plant) -> Figure:
    figure = new_figure(PAGE_IN, 2.8)
    way, apart = figure.subplots(1, 2)
    first = next(iter(runs.values())).recording
    followed = [n for n in first.channels if n.startswith(REFERENCE)]
    wanted = MM * foot_m(plant, first.rows(followed))
    way.plot(wanted[:, 1], wanted[:, 2], color=GREY, linestyle="-", label="reference")
    for k, (name, record) in enumerate(runs.items()):
        recording = record.recording
        seen = MM * foot_m(plant, recording.rows(n.removeprefix(REFERENCE) for n in followed))
        way.plot(seen[:, 1], seen[:, 2], label=name, **look(k))
        away = np.linalg.norm(seen - wanted, axis=1)
        apart.plot(recording.time_s, away, label=name, **look(k))
    _named(way, apart)
    figure.legend(*way.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _named(way: Axes, apart: Axes) -> None:
    way.set_aspect("equal", adjustable="datalim")
    way.set_xlabel("foot to the side, Y (mm)")
    way.set_ylabel("foot upwards, Z (mm)")
    apart.set_xlabel("time (s)")
    apart.set_ylabel("foot from its reference (mm)")
    apart.set_ylim(bottom=0.0)
