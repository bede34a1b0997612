"""What estimators on the nonlinear plant take for granted: the plant, its clock and its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from workbench.plant import Plant

LIKELY = "log-likelihood"  # of a sample's outputs, among the notes of an estimate


@dataclass(frozen=True, kw_only=True)
class StochasticPlant:
    """A plant that is sampled, with the noise of its sensors, of its states and of its start.

    Attributes
    ----------
    measurement_noise
        Standard deviation by output.
    process_noise
        Standard deviation that a state gains per square root of a second; others gain none.
    unknown_inputs
        The same for an unknown rate of a state, or for what is added to a parameter.
    initial_deviation
        Standard deviation at the start by state, the plant's scale by default.
    """

    plant: Plant
    sample_time_s: float
    measurement_noise: Mapping[str, float]
    process_noise: Mapping[str, float]
    unknown_inputs: Mapping[str, float] = field(default_factory=dict)
    initial_deviation: Mapping[str, float] = field(default_factory=dict)

    @property
    def assumed(self) -> dict[str, Any]:
        """The fields above by name, for another estimator that assumes the same."""
        return {each.name: getattr(self, each.name) for each in fields(StochasticPlant)}
