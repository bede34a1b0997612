"""The papers' joint: steps in closed loop on drawn arms and on models, and the open loop of 001.

No simulator of the arm stands beside the model's.  What stands for the paper's joint is the full
model with every uncertain parameter drawn, a valve of 100 Hz, walls that take heat, sensor noise
and a converter of 12 bits; the models have nominal values and none of these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from studies.checking import drawn
from studies.papers.loops import DT, FINE, LINEAR_AREA, VISCOUS_ONLY, Pid, looped
from workbench.closed_loop import Hardware
from workbench.plant import Plant
from workbench.plants.crr_arm import MOTION, crr_arm
from workbench.plants.crr_cylinder import OFFSET_V
from workbench.recording import Recording
from workbench.rig import default_rig
from workbench.simulation import simulate

ANGLE, VELOCITY = MOTION
PRESSURES = ("cap.pressure_pa", "rod_side.pressure_pa")
COMMAND = "valve.command_v"
PID = Pid((4.0, 4.0, 0.4), ANGLE)  # physics.md 2.2
STEPS_DEG, PLATEAU = (30.0, 60.0, 85.0, 45.0), 1200
LATE = 400  # samples at the end of a plateau that ought to be calm
LACKED = {"valve_lag.time_constant_s": 1 / (2 * pi * 100.0), "wall_heat.coefficient_w_m2_k": 12.0}
HARDWARE = Hardware(
    noise={ANGLE: np.radians(0.05), **dict.fromkeys(PRESSURES, 500.0)}, converter_bits=12
)
PULSES_V, PULSE_S, AFTER_S = (5.4, 5.6, 5.8, 6.0), 0.15, 3.0
CALM_DEG_S = 5.0
RAMPS_V_S = (0.25, 0.5, 1.0)
PAPER_001 = {**VISCOUS_ONLY, **LINEAR_AREA}
"""Model of paper 001: no stiction, an area in proportion to the opening."""


@dataclass(frozen=True)
class Steps:
    """Angle in deg, speed in deg/s and pressures in Pa of one run through the steps."""

    angle: np.ndarray
    speed: np.ndarray
    pressures: np.ndarray

    @property
    def unrest(self) -> np.ndarray:
        """Standard deviation of the speed at the end of each plateau, deg/s."""
        return self.speed.reshape(len(STEPS_DEG), PLATEAU)[:, -LATE:].std(axis=1)

    def rmse(self, other: Steps) -> float:
        """Of the angle between two runs, deg."""
        return float(np.sqrt(np.mean((self.angle - other.angle) ** 2)))

    def pressure_rmse(self, other: Steps) -> float:
        """Of both pressures between two runs, Pa."""
        return float(np.sqrt(np.mean((self.pressures - other.pressures) ** 2)))


def stepped(plant: Plant, hardware: Hardware = FINE, seed: int = 0) -> Steps:
    """A plant under the PID through all steps."""
    reference = np.radians(np.repeat(STEPS_DEG, PLATEAU))
    seen = looped(plant, PID, reference, hardware, seed)
    return Steps(np.degrees(seen[ANGLE]), np.degrees(seen[VELOCITY]), seen.rows(PRESSURES))


def model(values: Mapping[str, float]) -> Plant:
    """The arm with other values."""
    return crr_arm().with_values(values).lean()


def joints(number: int) -> list[Plant]:
    """Drawn arms with what the models lack."""
    rig, rng = default_rig("crr_arm"), np.random.default_rng(7)
    return [drawn(rig, rng).with_values(LACKED).lean() for _ in range(number)]


def pulse(level_v: float, plant: Plant) -> Recording:
    """S001-4: a step of the voltage, and back to the offset after a while."""
    command = np.full(round((PULSE_S + AFTER_S) / DT), OFFSET_V)
    command[: round(PULSE_S / DT)] = level_v
    return simulate(plant, Recording("step", DT, {COMMAND: command}))


@dataclass(frozen=True)
class Pulse:
    """How the arm comes to rest behind a pulse.

    peak        fastest speed, deg/s
    swings      changes of direction of the speed around its drift
    settled_s   from when on the speed stays within 5 deg/s of its drift
    drift       speed over the last second, deg/s
    """

    peak: float
    swings: int
    settled_s: float
    drift: float


def read(seen: Recording) -> Pulse:
    """What is read off one pulse."""
    speed = np.degrees(seen[VELOCITY])
    after = speed[round(PULSE_S / DT) :]
    drift = float(after[-1000:].mean())
    off = after - drift
    restless = np.flatnonzero(np.abs(off) > CALM_DEG_S)
    settled = DT * (int(restless[-1]) + 1) if len(restless) else 0.0
    large = off[np.abs(off) > 0.5]
    swings = int(np.sum(np.diff(np.sign(large)) != 0))
    return Pulse(float(speed.max()), swings, settled, drift)


def ramp(rate_v_s: float, plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """S001-5: voltage beyond the offset and speed in deg/s, smoothed, up to the upper stop."""
    time_s = DT * np.arange(round(3.0 / rate_v_s**0.5 / DT))
    seen = simulate(plant, Recording("ramp", DT, {COMMAND: OFFSET_V + rate_v_s * time_s}))
    inside = np.degrees(seen[ANGLE]) < 94.0
    n = len(seen) if inside.all() else int(np.argmin(inside))
    width = round(2 * pi / 31.0 / DT)  # a period of the pneumatic spring, physics.md 2.2
    smooth = np.convolve(np.degrees(seen[VELOCITY])[:n], np.full(width, 1 / width), mode="valid")
    middle = (rate_v_s * time_s)[width // 2 :][: len(smooth)]
    return middle, smooth


def bend(volts: np.ndarray, speed: np.ndarray) -> float:
    """Curvature: what the square of a fitted parabola adds at the end, over the straight part."""
    linear, square = np.linalg.lstsq(np.column_stack([volts, volts**2]), speed, rcond=None)[0]
    return float(square * volts[-1] / linear)


def at_low_angle(plant: Plant, degrees: float = 18.0) -> Plant:
    """The arm at rest near its lower stop, with the gas that its chambers hold there."""
    angle = float(np.radians(degrees))
    rod = next(p for p in plant.parts if p.name == "rod")
    place_m = float(rod.position_m(angle))
    parts = []
    for part in plant.parts:
        if hasattr(part, "initial_angle_rad"):
            part = replace(part, initial_angle_rad=angle)
        if hasattr(part, "initial_position_m"):
            part = replace(part, initial_position_m=place_m)
        parts.append(part)
    return replace(plant, parts=tuple(parts))
