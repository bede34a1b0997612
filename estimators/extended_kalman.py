"""The extended Kalman filter, on the nonlinear plant itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimators.stochastic_plant import LIKELY, StochasticPlant
from workbench.contracts import Estimate
from workbench.filter_update import FilterUpdate
from workbench.filtering import consistent_start
from workbench.plant_filter import PlantFilter


@dataclass(frozen=True, kw_only=True)
class ExtendedKalman(StochasticPlant):
    """Predict with the plant, correct with its Jacobian; see :class:`PlantFilter`.

    The notes hold the normalised innovation squared of a sample, ``nis``, of as many degrees of
    freedom as outputs were ``received``, its log-likelihood, and each unknown input.
    """

    def start(self, measurement: np.ndarray) -> Estimate:
        found = self.filter
        known = dict(zip(self.plant.measured, measurement, strict=True))
        X = np.zeros(len(found.scale))
        X[: len(self.plant.scale)] = consistent_start(self.plant, known) / self.plant.scale
        return self.estimate(X, found.start_covariance)

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        received = np.isfinite(measurement)
        y = np.where(received, measurement, 0.0)
        now = self.sample(*last.memory, command, y, received)
        notes = self._unknown(now.X) | {"nis": now.nis, "received": float(received.sum())}
        notes[LIKELY] = now.log_likelihood
        memory = (now.X, now.P)
        return Estimate(self.plant.model.states, now.state, now.covariance, memory, notes)

    def estimate(self, X: np.ndarray, P: np.ndarray) -> Estimate:
        """What a scaled state and its covariance stand for."""
        n, scale = len(self.plant.scale), self.filter.scale
        covariance = P[:n, :n] * np.outer(scale[:n], scale[:n])
        state = X[:n] * scale[:n]
        return Estimate(self.plant.model.states, state, covariance, (X, P), self._unknown(X))

    def _unknown(self, X: np.ndarray) -> dict[str, float]:
        if not self.unknown_inputs:
            return {}
        n, scale = len(self.plant.scale), self.filter.scale
        values = zip(self.unknown_inputs, X[n:] * scale[n:], strict=True)
        return {f"unknown {name}": value for name, value in values}

    def retuned(self, process_noise: Mapping[str, float]) -> ExtendedKalman:
        """The same with other process noise, on functions that are there already."""
        other = replace(self, process_noise=process_noise)
        other.__dict__["sample"] = self.sample.retuned(process_noise)
        return other

    @cached_property
    def sample(self) -> FilterUpdate:
        """Predict and correct as one call."""
        return FilterUpdate(PlantFilter(**self.assumed))

    @property
    def filter(self) -> PlantFilter:
        """The filter whose functions are called."""
        return self.sample.filter
