"""Modes in pictures: where each is active, and a step of the commands beside the plant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from linearize.hybrid_simulation import HybridRun, SampledHybrid, sampled_hybrid
from linearize.modes import HybridModel
from linearize.visits import Visited, visited
from studies.figures.mode_maps import mode_map_figure
from studies.figures.modes import pole_figure
from studies.figures.prediction import overlay_figure
from studies.mode_views import VIEWS, sent_commands, view_of
from workbench.recording import Recording
from workbench.simulation import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEP_S = 1e-3  # of a slide


@dataclass(frozen=True)
class Step:
    """The plant through a step of its commands, and modes beside it, by label."""

    seen: Visited
    runs: Mapping[str, HybridRun]
    hybrids: Mapping[str, HybridModel]

    def end_share(self, label: str) -> float:
        """How far from the plant's end the modes end in the first state, over the plant's way."""
        plant, run = self.seen.states[0], self.runs[label].states[0]
        return float(abs(run[-1] - plant[-1]) / np.ptp(plant))


def step_of(hybrids: Mapping[str, HybridModel]) -> Step:
    """The step of :func:`studies.mode_views.view_of`; the models are of the same plant."""
    first = next(iter(hybrids.values()))
    plant, view = first.plant.lean(), view_of(first)
    commands = Recording("step", view.sample_time_s, sent_commands(view, plant))
    seen = visited(first.model, plant, simulate(plant, commands, view.start), at_stops=True)
    runs = {
        label: sampled_hybrid(hybrid, view.sample_time_s).run(seen.states[:, 0], seen.commands)
        for label, hybrid in hybrids.items()
    }
    return Step(seen, runs, hybrids)


def step_figure(step: Step) -> Figure:
    """The step; the modes that are named are those of the first model."""
    first = next(iter(step.hybrids.values()))
    seen, shown = step.seen, view_of(first).shown
    return overlay_figure(first, seen.sample_time_s, seen.states[:shown], seen.commands, step.runs)


def figures_of_modes(hybrid: HybridModel) -> dict[str, Figure]:
    """The poles, and of a plant that has a view where modes are active and a step, by name."""
    figures = {"poles": pole_figure(hybrid)}
    if hybrid.plant.name in VIEWS:
        modes = sampled_hybrid(hybrid, view_of(hybrid).sample_time_s)
        figures |= {"map": map_figure(modes), "step": step_figure(step_of({"modes": hybrid}))}
    return figures


def map_figure(modes: SampledHybrid) -> Figure:
    """The active mode over the two signals of the plant's view, a panel for each of its cases."""
    view = view_of(modes.hybrid)
    return mode_map_figure(modes, view.ranges, view.panels)
