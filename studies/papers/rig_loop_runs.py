"""Loops of a PID on the papers' rig: sines and steps, on the true rig and on models of it.

Source: paper 000 Figs. 12, 13, 15, 17; paper 001 Fig. 8; gains by physics.md 2.1 and 7.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from studies.papers.loops import DT, MODELS, Pid, looped
from studies.papers.rig_records import followed, true_rig
from workbench.closed_loop import Hardware
from workbench.plants.crr_rig import STROKE_M, crr_rig
from workbench.recording import Recording

POSITION, VELOCITY = "rod.position_m", "rod.velocity_m_s"
MIDDLE_M, AMPLITUDE_M, STEP_M = STROKE_M / 2, 0.030, 0.050
HARD = Pid((250.0, 200.0, 8.0), POSITION)  # physics.md 2.1
SOFT = Pid((150.0, 100.0, 4.0), POSITION)  # what a real valve of 100 Hz allows
FIRM = Pid((400.0, 400.0, 12.0), POSITION)
OVER = 8  # samples of the derivative, without a filter behind it
HARDWARE = Hardware(noise={POSITION: 5e-5}, converter_bits=12)
SECONDS_BY_HZ = {0.25: 6.0, 0.5: 4.0, 1.0: 3.0, 2.0: 2.0, 3.0: 2.0}
COMPARED = {"0.5 Hz": SOFT, "1 Hz": SOFT, "step": SOFT, "1 Hz, higher gains": HARD}
COMPARED_S, STEP_AT_S = 2.5, 0.3


@dataclass(frozen=True)
class Run:
    """Position, velocity, reference of one loop, shape (n,)."""

    position: np.ndarray
    velocity: np.ndarray
    reference: np.ndarray

    @property
    def error(self) -> np.ndarray:
        return self.position - self.reference

    @property
    def unrest(self) -> float:
        """Standard deviation of the velocity in the last half second."""
        return float(self.velocity[-500:].std())

    @property
    def step(self) -> dict[str, float]:
        """First motion, rise time in s; overshoot and final error over the step."""
        at = round(STEP_AT_S / DT)
        moved = (self.position[at:] - self.position[at]) / STEP_M
        first, low, high = (int(np.argmax(moved > share)) for share in (0.01, 0.1, 0.9))
        return {
            "first": DT * first,
            "rise": DT * (high - low),
            "overshoot": float(moved.max() - 1.0),
            "final": float(np.abs(self.error[-100:]).mean() / STEP_M),
        }


def references_m() -> np.ndarray:
    """Of the loops that are compared with the true rig, shape (n, n_loops)."""
    time_s = DT * np.arange(round(COMPARED_S / DT))
    slow, fast = (MIDDLE_M + AMPLITUDE_M * np.sin(2 * np.pi * hz * time_s) for hz in (0.5, 1.0))
    step = MIDDLE_M + STEP_M * (np.where(time_s >= STEP_AT_S, 0.5, -0.5))
    return np.column_stack([slow, fast, step, fast])


def sine(hz: float, pid: Pid) -> tuple[Recording, np.ndarray]:
    """The full model with noise and converter; the error after the first period, m."""
    time_s = DT * np.arange(round(SECONDS_BY_HZ[hz] / DT))
    reference = MIDDLE_M + AMPLITUDE_M * np.sin(2 * np.pi * hz * time_s)
    seen = looped(crr_rig().lean(), pid, reference, HARDWARE)
    late = round(min(1.0 / hz, 2.0) / DT)
    return seen, (seen[POSITION] - reference)[late:]


def compared(seed: int) -> dict[str, dict[str, Run]]:
    """Every loop on the true rig and on the three models, by loop and model."""
    wanted = references_m()
    position, velocity = followed(true_rig(seed), list(COMPARED.values()), wanted)
    found = {
        name: {"rig": Run(position[:, k], velocity[:, k], wanted[:, k])}
        for k, name in enumerate(COMPARED)
    }
    for k, (name, pid) in enumerate(COMPARED.items()):
        for model, values in MODELS.items():
            plant = crr_rig().with_values(values).lean()
            placed = replace(plant, parts=tuple(_moved(p, wanted[0, k]) for p in plant.parts))
            seen = looped(placed, pid, wanted[:, k])
            found[name][model] = Run(seen[POSITION], seen[VELOCITY], wanted[:, k])
    return found


def _moved(part: object, position_m: float) -> object:
    if not hasattr(part, "initial_position_m"):
        return part
    return replace(part, initial_position_m=float(position_m))
