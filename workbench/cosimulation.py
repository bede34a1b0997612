"""Two computers that simulate one machine: a controlled actuator and a rigid-body engine.

Once per sample each sends what it has to the other, through a network that delays, pauses and
drifts, and holds what it received until the next sample.  So the actuator computes its pressures
with a velocity that is old, and the engine moves under a torque that is old: that can put energy
into the motion which no part of the machine supplies (erratum E001-9).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.arrivals import Arrivals
from workbench.contracts import Controller, Estimate
from workbench.effects.timing import Timing
from workbench.plant import Plant
from workbench.recording import Recording


def cosimulate(
    actuator: Plant,
    engine: Plant,
    controller: Controller,
    reference: np.ndarray,
    network: Sequence[Timing] = (),
    sample_time_s: float = 1e-3,
) -> Recording:
    """Commands, torques, motion and pressures of both halves.

    The actuator's first outputs are the engine's measured inputs; the engine's outputs are the
    actuator's measured inputs and what the controller sees, as they arrive.

    Parameters
    ----------
    reference
        For the controller, shape (n_r, n).
    network
        Causes in time; their signals are the engine's inputs and outputs.

    Raises
    ------
    ArithmeticError
        If a state is no longer finite.
    """
    n, dt = reference.shape[1], sample_time_s
    halves = _Half(actuator, dt), _Half(engine, dt)
    down = Arrivals(network, engine.model.measured_inputs, n, dt)
    up = Arrivals(network, engine.measured, n, dt)
    command, rows = controller.start(), []
    for k in range(n):
        motion = halves[1].outputs(halves[1].u, halves[1].d)
        seen = up(motion, k)
        estimate = Estimate(engine.measured, seen, np.eye(len(seen)))
        command = controller.step(command, reference[:, k : k + controller.preview], estimate)
        sent = halves[0].outputs(command.value, seen)
        torque = down(sent[: len(engine.measured_inputs)], k)
        rows.append(np.concatenate([command.value, sent, motion]))
        halves[0].move(command.value, seen)
        halves[1].move(halves[1].u, torque)
    names = (*actuator.model.commands, *actuator.measured, *engine.measured)
    channels = dict(zip(names, np.array(rows).T, strict=True))
    return Recording(f"{actuator.name} and {engine.name}", dt, channels, source="co-simulation")


class _Half:
    """One plant and its state."""

    def __init__(self, plant: Plant, sample_time_s: float) -> None:
        self.name, self.x = plant.name, plant.initial
        self.u, self.d, self.p = plant.nominal
        self.step, self.h = plant.model.compiled_step(sample_time_s), plant.model.h

    def outputs(self, u: np.ndarray, d: np.ndarray) -> np.ndarray:
        return self.h(self.x, u, d, self.p).full().ravel()

    def move(self, u: np.ndarray, d: np.ndarray) -> None:
        self.x = self.step(self.x, u, d, self.p).full().ravel()
        if not np.isfinite(self.x).all():
            raise ArithmeticError(f"{self.name}: the co-simulation is not finite")
