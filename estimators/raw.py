"""No estimator: what the sensors show is handed on as it is, for laws on the raw measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.contracts import Estimate

RAW = "raw"
"""Its name among those of estimators."""


@dataclass(frozen=True, kw_only=True)
class RawMeasurement:
    """The outputs as they arrive; what was not received keeps its last value.

    Its covariance is unknown, and stands as NaN.
    """

    names: tuple[str, ...]
    sample_time_s: float

    def start(self, measurement: np.ndarray) -> Estimate:
        n = len(self.names)
        return Estimate(self.names, np.array(measurement, dtype=float), np.full((n, n), np.nan))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        kept = np.where(np.isfinite(measurement), measurement, last.state)
        return Estimate(self.names, kept, last.covariance)
