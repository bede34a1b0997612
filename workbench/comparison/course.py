"""A recording as a plant goes through it: states guessed from it, and any quantity along them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil

import casadi as ca
import numpy as np

from workbench.called import result
from workbench.fitting.noise_source import recorded_noise
from workbench.fitting.starts import SMOOTHING_SAMPLES, bridged, guessed_states, slope
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import AT_ONCE, inputs

RESTING = {"position_m": 5e-3, "angle_rad": 0.1}  # m/s; rad/s, the same at an arm of 50 mm
LONGEST_S = 25e-3  # of the parabola that gives a speed
CERTAIN = 3.0  # deviations of a speed's noise that rest must bear


@dataclass(frozen=True, eq=False)
class Course:
    """A recording under a plant.

    Attributes
    ----------
    whole, plant
        The plant with and without what is absent; absent effects know their geometry too.
    states, deviations
        Guessed from the recording, and their standard deviations, shape (n_x, n).
    """

    whole: Plant
    plant: Plant
    recording: Recording
    states: np.ndarray
    deviations: np.ndarray

    def along(self, *expressions: ca.SX) -> np.ndarray:
        """Expressions of the plant's model at every sample, shape (n_expressions, n)."""
        if not expressions:
            return np.zeros((0, len(self.recording)))
        model, (u, d) = self.plant.model, self._inputs
        give = ca.Function("along", [*model.symbols], [ca.vertcat(*expressions)])
        parts = (slice(k, k + AT_ONCE) for k in range(0, len(self.recording), AT_ONCE))
        columns = [(self.states[:, s], u[:, s], d[:, s]) for s in parts]
        p = self.plant.nominal[2][:, None]
        return np.hstack(
            [result(give.map(x.shape[1]), x, w, v, np.tile(p, x.shape[1])) for x, w, v in columns]
        )

    @cached_property
    def places(self) -> tuple[Place, ...]:
        """Motion of every body and joint whose position or angle was recorded."""
        plant, recording = self.plant, self.recording
        names = dict.fromkeys((*plant.measured, *(s.name for s in plant.measured_inputs)))
        return tuple(
            _place(recording, name)
            for name in names
            if name.rpartition(".")[2] in RESTING and name in recording.channels
        )

    @cached_property
    def _inputs(self) -> tuple[np.ndarray, np.ndarray]:
        return inputs(self.plant, self.recording)


@dataclass(frozen=True, eq=False)
class Place:
    """Motion of one body or joint.

    Attributes
    ----------
    name
        Of the recorded position or angle.
    value, speed
        Without holes, shape (n,).
    moving
        Sign of the speed, 0 at rest, shape (n,).
    """

    name: str
    value: np.ndarray
    speed: np.ndarray
    moving: np.ndarray

    @property
    def member(self) -> str:
        """The body or joint."""
        return self.name.rpartition(".")[0]

    @property
    def speed_name(self) -> str:
        """Full name of the speed."""
        quantity = "velocity_m_s" if self.name.endswith("position_m") else "velocity_rad_s"
        return f"{self.member}.{quantity}"


def course_of(plant: Plant, recording: Recording) -> Course:
    """The course of a recording under a plant, with or without what is absent in it."""
    lean = plant.lean()
    return Course(plant, lean, recording, *guessed_states(lean, recording))


def _place(recording: Recording, name: str) -> Place:
    """Speed by a moving parabola just so long that rest shows through the noise.

    A parabola through n samples gives a slope of deviation sigma sqrt(12 / n^3) / dt.  Where even
    the longest one is too noisy, rest is what cannot be told from it.
    """
    dt, resting = recording.sample_time_s, RESTING[name.rpartition(".")[2]]
    noise = recorded_noise(recording, [name])[name].value
    wanted = ceil((CERTAIN * noise * np.sqrt(12.0) / (resting * dt)) ** (2.0 / 3.0))
    longest = max(round(LONGEST_S / dt), SMOOTHING_SAMPLES)
    samples = min(max(wanted, SMOOTHING_SAMPLES), longest) // 2 * 2 + 1
    least = CERTAIN * noise * np.sqrt(12.0 / samples**3) / dt
    value = bridged(recording[name], recording.starts)
    speed = slope(value, dt, recording.starts, samples)
    moving = np.where(np.abs(speed) < max(resting, least), 0.0, np.sign(speed))
    return Place(name, value, speed, moving)
