"""The extended Kalman filter, on the nonlinear plant itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from workbench.contracts import Estimate
from workbench.filtering import consistent_start
from workbench.plant import Plant
from workbench.plant_filter import PlantFilter


@dataclass(frozen=True, kw_only=True)
class ExtendedKalman:
    """Predict with the plant, correct with its Jacobian; see :class:`PlantFilter`.

    Attributes
    ----------
    measurement_noise
        Standard deviation by output.
    process_noise
        Standard deviation that a state gains per square root of a second.
    unknown_inputs
        The same for an unknown rate of a state; its estimate stands in the notes.
    """

    plant: Plant
    sample_time_s: float
    measurement_noise: Mapping[str, float]
    process_noise: Mapping[str, float]
    unknown_inputs: Mapping[str, float] = field(default_factory=dict)

    def start(self, measurement: np.ndarray) -> Estimate:
        found = self.filter
        known = dict(zip(self.plant.measured, measurement, strict=True))
        X = np.zeros(len(found.scale))
        X[: len(self.plant.scale)] = consistent_start(self.plant, known) / self.plant.scale
        return self.estimate(X, found.start_covariance)

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        found, (_, d, p) = self.filter, self.plant.nominal
        X, P, _ = found.predict(*last.memory, command, d, p)
        received = np.isfinite(measurement)
        y = np.where(received, measurement, 0.0)
        X, P, *_ = found.correct(X, P, command, d, p, y, received)
        return self.estimate(X.full().ravel(), P.full())

    def estimate(self, X: np.ndarray, P: np.ndarray) -> Estimate:
        n, scale = len(self.plant.scale), self.filter.scale
        notes = {
            f"unknown {name}": value
            for name, value in zip(self.unknown_inputs, X[n:] * scale[n:], strict=True)
        }
        covariance = P[:n, :n] * np.outer(scale[:n], scale[:n])
        return Estimate(self.plant.model.states, X[:n] * scale[:n], covariance, (X, P), notes)

    @cached_property
    def filter(self) -> PlantFilter:
        """The filter whose functions are called."""
        return PlantFilter(
            plant=self.plant,
            sample_time_s=self.sample_time_s,
            measurement_noise=self.measurement_noise,
            process_noise=self.process_noise,
            unknown_inputs=self.unknown_inputs,
        )
