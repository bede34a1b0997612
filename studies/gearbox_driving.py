"""The gearbox in study ``mode-placement``: modes under mass flows through whole manoeuvres.

The commands are those with which the truth of the gearbox is recorded: shifts by way of Neutral,
straight shifts, pulses that end before the piston has arrived.  The plant's own simulation under
them, ten times as fine, is what the modes are placed on and judged by.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from linearize.hybrid_simulation import sampled_hybrid
from linearize.modes import HybridModel
from linearize.placement import placed_modes
from linearize.prediction import PredictionError, fitted_single, prediction_of
from linearize.shift_modes import driving_modes
from linearize.visits import Windows, joined, recorded_visits, windows
from studies.mode_choice import FINE, OFTEN
from studies.text import columns
from studies.truth.gearbox_manoeuvre import training_command, validation_command
from workbench.plants.gearbox import COMMANDS
from workbench.recording import Recording
from workbench.rig import default_rig

SAMPLE_TIME_S = 1e-3
MODES = 40
PLACED_ON = ((training_command, 1), (validation_command, 2))
JUDGED_ON = (validation_command, 3)
APART_S = 0.05  # between the starts of windows: one fit of the single model takes minutes


@dataclass(frozen=True)
class Driving:
    """Modes placed on two manoeuvres, their error on a third one, and the best single model's."""

    hybrid: HybridModel
    placed: PredictionError
    single: PredictionError

    @property
    def share(self) -> float:
        """The error of the modes over that of the single model."""
        return self.placed.total / self.single.total


def driven(
    say: Callable[[str], None] = lambda _: None, number: int = MODES, apart_s: float = APART_S
) -> Driving:
    """Place, and judge over 50 ms on a manoeuvre that was not placed on."""
    say("the gearbox through three manoeuvres")
    rig = default_rig("gearbox")
    base, fine = driving_modes(rig.plant), FINE["gearbox"]
    seen = [
        recorded_visits(rig, base.model, manoeuvre(*each), at_stops=True, per_sample=fine)
        for each in (*PLACED_ON, JUDGED_ON)
    ]
    say("modes of the gearbox, one more each time")
    hybrid = placed_modes(base, joined(seen[:-1]), number, OFTEN["gearbox"])
    judged = windows(seen[-1], apart_s=apart_s)
    found = prediction_of(sampled_hybrid(hybrid, judged.sample_time_s), judged)
    say("a single linear model of the gearbox")
    return Driving(hybrid, found, _single(base, judged))


def manoeuvre(command: Callable[[np.random.Generator], np.ndarray], seed: int) -> Recording:
    """Commands of a person who records, drawn by a seed."""
    rows = command(np.random.default_rng(seed)).T
    channels: Mapping[str, np.ndarray] = dict(zip(COMMANDS, rows, strict=True))
    return Recording(f"{command.__name__} {seed}", SAMPLE_TIME_S, channels)


def driving_table(found: Driving) -> str:
    """The errors by state in units of its scale."""
    names = found.hybrid.model.states
    rows = {"placed": found.placed, "one linear model, fitted": found.single}
    lines = [
        (label, f"{error.total:.4f}", *(f"{value:.3f}" for value in error.by_state))
        for label, error in rows.items()
    ]
    head = ("gearbox", "error", *(name.rpartition(".")[0] + " " + _short(name) for name in names))
    return columns(head, lines)


def _short(name: str) -> str:
    return name.rpartition(".")[2].partition("_")[0]


def _single(base: HybridModel, judged: Windows) -> PredictionError:
    return prediction_of(fitted_single(base, judged), judged)
