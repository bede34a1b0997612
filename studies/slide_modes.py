"""The modes of a slide in pictures: where each is active, and a step of the valve beside the plant.

A slide has a position, a velocity, and one valve that stands shut at its centre.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from linearize.hybrid_simulation import HybridRun, SampledHybrid, sampled_hybrid
from linearize.modes import HybridModel
from linearize.reduction import closed_command
from linearize.standard import COMMAND, POSITION, VELOCITY, stroke_m
from linearize.visits import Visited, visited
from studies.figures.mode_maps import mode_map_figure
from studies.figures.prediction import overlay_figure
from workbench.effects import DeadZone
from workbench.recording import Recording
from workbench.simulation import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEP_S = 1e-3
FAST_M_S = 1.0
OPENING_V = 0.35  # behind the dead zone
SHUT_S, OPEN_S, AFTER_S = 0.05, 0.2, 0.35


@dataclass(frozen=True)
class Step:
    """The plant through a step of the valve, and modes beside it, by label."""

    seen: Visited
    runs: Mapping[str, HybridRun]
    hybrids: Mapping[str, HybridModel]

    def end_share(self, label: str) -> float:
        """How far from the plant's end the modes end, over the plant's way."""
        plant, run = self.seen.states[0], self.runs[label].states[0]
        return float(abs(run[-1] - plant[-1]) / np.ptp(plant))


def step_of(hybrids: Mapping[str, HybridModel]) -> Step:
    """The valve opens from rest and shuts again; the models are of the same plant."""
    first = next(iter(hybrids.values()))
    plant = first.plant.lean()
    band_v = sum(float(e.half_width_v) for e in plant.effects if isinstance(e, DeadZone))
    spans = ((SHUT_S, 0.0), (OPEN_S, band_v + OPENING_V), (AFTER_S, 0.0))
    sent_v = closed_command(plant) + np.concatenate(
        [np.full(round(s / STEP_S), v) for s, v in spans]
    )
    simulated = simulate(plant, Recording("step", STEP_S, {COMMAND: sent_v}))
    seen = visited(first.model, plant, simulated)
    runs = {
        label: sampled_hybrid(hybrid, STEP_S).run(seen.states[:, 0], seen.commands)
        for label, hybrid in hybrids.items()
    }
    return Step(seen, runs, hybrids)


def step_figure(step: Step) -> Figure:
    """The step; the modes that are named are those of the first model."""
    first = next(iter(step.hybrids.values()))
    return overlay_figure(first, STEP_S, step.seen.states, step.seen.commands, step.runs)


def map_figure(modes: SampledHybrid) -> Figure:
    """The active mode over position and velocity with the valve to either side and shut."""
    plant = modes.hybrid.plant
    shut_v = closed_command(plant)
    openings = {"valve charges b": -OPENING_V, "valve shut": 0.0, "valve charges a": OPENING_V}
    panels = {
        f"{title}, {shut_v + opening:.2f} V": {COMMAND: shut_v + opening}
        for title, opening in openings.items()
    }
    ranges = {POSITION: (0.0, stroke_m(plant)), VELOCITY: (-FAST_M_S, FAST_M_S)}
    return mode_map_figure(modes, ranges, panels)
