"""The papers' loop on rig and arm: a PID on the raw measurement, through the network.

The papers print no gains; those used are *chosen* (physics.md 2.1 and 2.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.raw import RawMeasurement
from workbench.closed_loop import Hardware, close_loop
from workbench.contracts import Command, Estimate
from workbench.plant import Plant
from workbench.recording import Recording

DT = 1e-3
FINE = Hardware(converter_bits=24)
FILTER_S = 3e-3
VISCOUS_ONLY = {"friction.coulomb_force_n": 0.0, "friction.stiction_excess_n": 0.0}
LINEAR_AREA = {"valve.area_shape_share": 0.0, "valve.underlap_v": 0.0, "valve.clearance_m": 0.0}
MODELS = {"full model": {}, "linear area, fixed pressures": LINEAR_AREA, "viscous": VISCOUS_ONLY}
"""What paper 000 compares: values by which the plant becomes its simpler models."""


@dataclass(frozen=True)
class Pid:
    """u = u_off + K_p e + K_i integral + K_d de/dt (low pass), within 0 to 10 V.

    The integral stands still while the command is at a limit.

    Attributes
    ----------
    gains
        V per unit of the signal, per unit and second, and V s per unit.
    on_measurement
        The derivative does not see the reference.
    filter_s
        Time constant of the derivative's low pass.
    over
        Samples over which the difference is taken; paper 001 takes several on hardware.
    """

    gains: tuple[float, float, float]
    signal: str
    on_measurement: bool = False
    centre_v: float = 5.25
    sample_time_s: float = DT
    filter_s: float = FILTER_S
    over: int = 1
    preview: int = 1

    def start(self) -> Command:
        return Command(np.array([self.centre_v]), memory=(0.0, 0.0, ()))

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        kp, ki, kd = self.gains
        integral, slope, before = last.memory
        dt = self.sample_time_s
        y = float(estimate.pick([self.signal])[0])
        error = float(reference[0, 0]) - y
        shown = -y if self.on_measurement else error
        raw = (shown - before[0]) / (dt * len(before)) if before else 0.0
        slope += dt / (dt + self.filter_s) * (raw - slope)
        wanted = self.centre_v + kp * error + ki * (integral + dt * error) + kd * slope
        sent = min(max(wanted, 0.0), 10.0)
        integral += dt * error if sent == wanted else 0.0
        kept = (*before, shown)[-self.over :]
        return Command(np.array([sent]), memory=(integral, slope, kept))


def tracked(
    plant: Plant,
    reference: np.ndarray,
    gains: tuple[float, float, float],
    on_measurement: bool = False,
) -> Recording:
    """The record of a plant whose first output follows a reference of shape (n,)."""
    return looped(plant, Pid(gains, plant.measured[0], on_measurement), reference)


def looped(
    plant: Plant, pid: Pid, reference: np.ndarray, hardware: Hardware = FINE, seed: int = 0
) -> Recording:
    """The record of a plant under a PID that sees its outputs as they arrive."""
    raw = RawMeasurement(names=plant.measured, sample_time_s=pid.sample_time_s)
    loop = close_loop(plant, pid, raw, {pid.signal: reference}, hardware=hardware, seed=seed)
    return loop.recording
