"""The gearbox in study ``mode-placement``: modes under mass flows through whole manoeuvres.

The commands are those with which the truth of the gearbox is recorded: shifts by way of Neutral,
straight shifts, pulses that end before the piston has arrived.  The plant's own simulation under
them, ten times as fine, is what the modes are placed on and judged by.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linearize.hybrid_simulation import sampled_hybrid
from linearize.modes import HybridModel
from linearize.placement import placed_modes
from linearize.prediction import PredictionError, fitted_single, prediction_of
from linearize.shift_modes import driving_modes
from linearize.visits import Visited, joined, recorded_visits, windows
from studies.mode_choice import FINE, OFTEN
from studies.text import columns
from studies.truth.gearbox_manoeuvre import training_command, validation_command
from workbench.plants.gearbox import COMMANDS
from workbench.recording import Recording
from workbench.rig import default_rig

Manoeuvre = tuple[Callable[[np.random.Generator], np.ndarray], int]  # commands, and their seed

SAMPLE_TIME_S = 1e-3
MODES = 40
PLACED_ON: tuple[Manoeuvre, ...] = ((training_command, 1), (validation_command, 2))
JUDGED_ON = (validation_command, 3)  # also where the number of modes was chosen
FRESH = ((training_command, 11), (validation_command, 12))  # looked at for nothing else
APART_S = 0.05  # between the starts of windows: enough of them, and none counts twice


@dataclass(frozen=True)
class Judged:
    """Errors over 50 ms on one manoeuvre: of placed modes, those without jump, a single model."""

    placed: PredictionError
    smooth: PredictionError
    single: PredictionError

    @property
    def share(self) -> float:
        """The error of the modes over that of the single model."""
        return self.placed.total / self.single.total


@dataclass(frozen=True)
class Driving:
    """Modes placed on two manoeuvres, and how they predict others, by name."""

    hybrid: HybridModel
    judged: Mapping[str, Judged]

    @property
    def worst(self) -> Judged:
        """The manoeuvre on which the modes gain least."""
        return max(self.judged.values(), key=lambda each: each.share)


def driven(
    say: Callable[[str], None] = lambda _: None,
    judged_on: Sequence[Manoeuvre] = (JUDGED_ON, *FRESH),
    number: int = MODES,
    apart_s: float = APART_S,
) -> Driving:
    """Place, and judge over 50 ms on manoeuvres that were not placed on."""
    say("the gearbox through its manoeuvres")
    base = driving_modes(default_rig("gearbox").plant)
    hybrid = placed_modes(base, joined([*map(_gone, PLACED_ON)]), number, OFTEN["gearbox"])
    step_s, judged = SAMPLE_TIME_S / FINE["gearbox"], {}
    modes, smooth = (sampled_hybrid(each, step_s) for each in (hybrid, replace(hybrid, jumps=())))
    for each in judged_on:
        recording = manoeuvre(*each)
        say(f"a single linear model of the gearbox, fitted to {recording.name}")
        there = windows(_gone(each), apart_s=apart_s)
        models = (modes, smooth, fitted_single(base, there))
        judged[recording.name] = Judged(*(prediction_of(model, there) for model in models))
    return Driving(hybrid, judged)


def _gone(each: Manoeuvre) -> Visited:
    """What the plant visits in a manoeuvre."""
    rig = default_rig("gearbox")
    model = driving_modes(rig.plant).model
    fine = FINE["gearbox"]
    return recorded_visits(rig, model, manoeuvre(*each), at_stops=True, per_sample=fine)


def manoeuvre(command: Callable[[np.random.Generator], np.ndarray], seed: int) -> Recording:
    """Commands of a person who records, drawn by a seed."""
    rows = command(np.random.default_rng(seed)).T
    channels: Mapping[str, np.ndarray] = dict(zip(COMMANDS, rows, strict=True))
    kind = command.__name__.partition("_")[0]
    return Recording(f"{kind} {seed}", SAMPLE_TIME_S, channels)


def driving_table(found: Driving) -> str:
    """The errors by manoeuvre and state, in units of the state's scale."""
    names = found.hybrid.model.states
    lines = []
    for name, judged in found.judged.items():
        rows = {
            "placed modes": judged.placed,
            "without their jump": judged.smooth,
            "one linear model, fitted": judged.single,
        }
        for what, error in rows.items():
            numbers = (f"{error.total:.4f}", f"{error.total / judged.single.total:.2f}")
            lines.append((f"{name}: {what}", *numbers, *(f"{v:.3f}" for v in error.by_state)))
    head = ("gearbox", "error", "share", *(f"{n.rpartition('.')[0]} {_short(n)}" for n in names))
    return columns(head, lines)


def _short(name: str) -> str:
    return name.rpartition(".")[2].partition("_")[0]
