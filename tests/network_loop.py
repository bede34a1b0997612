"""A PID on the raw measurement through the network of papers 000 and 001, for tests."""

from dataclasses import dataclass

import numpy as np

from workbench.closed_loop import Hardware, close_loop
from workbench.contracts import Command, Estimate

DT = 1e-3
FINE = Hardware(converter_bits=24)
FILTER_S = 3e-3


@dataclass(frozen=True)
class Through:
    """Hands on what arrives."""

    names: tuple[str, ...]
    sample_time_s: float = DT

    def start(self, measurement):
        return Estimate(self.names, measurement, np.eye(len(measurement)))

    def update(self, last, command, measurement):
        return Estimate(self.names, measurement, last.covariance)


@dataclass(frozen=True)
class Pid:
    """u = u_off + K_p e + K_i integral + K_d de/dt (filtered 3 ms), within 0 to 10 V.

    ``on_measurement``: the derivative does not see the reference.  The integral stands still while
    the command is at a limit.
    """

    gains: tuple[float, float, float]
    signal: str
    on_measurement: bool = False
    centre_v: float = 5.25
    sample_time_s: float = DT
    preview: int = 1

    def start(self):
        return Command(np.array([self.centre_v]), memory=(0.0, 0.0, None))

    def step(self, last, reference, estimate):
        kp, ki, kd = self.gains
        integral, slope, before = last.memory
        y = float(estimate.pick([self.signal])[0])
        error = float(reference[0, 0]) - y
        shown = -y if self.on_measurement else error
        raw = 0.0 if before is None else (shown - before) / DT
        slope += DT / (DT + FILTER_S) * (raw - slope)
        wanted = self.centre_v + kp * error + ki * (integral + DT * error) + kd * slope
        sent = min(max(wanted, 0.0), 10.0)
        integral += DT * error if sent == wanted else 0.0
        return Command(np.array([sent]), memory=(integral, slope, shown))


def tracked(plant, reference, gains, on_measurement=False):
    """The record of a plant that follows a reference for its first output."""
    name = plant.measured[0]
    pid = Pid(gains, name, on_measurement)
    loop = close_loop(plant, pid, Through(plant.measured), {name: reference}, hardware=FINE)
    return loop.recording
