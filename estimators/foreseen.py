"""What an estimate says of the outputs before they are seen, for any estimator.

The estimate for a sample of which nothing was received, looked at through the outputs, gives the
innovation and its covariance, whatever an estimator does inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from workbench.contracts import Estimate


@dataclass(frozen=True)
class Foresight:
    """The outputs as an estimator expects them; it needs its plant and measurement noise."""

    estimator: Any

    def blind(self, last: Estimate, command: np.ndarray) -> Estimate:
        """The estimate one sample later where no output is received."""
        nothing = np.full(len(self.estimator.plant.measured), np.nan)
        return self.estimator.update(last, command, nothing)

    def outputs(self, estimate: Estimate, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Expected outputs (n_y,) and the covariance of a measurement of them, (n_y, n_y), in SI.

        States that the estimator leaves out stand at the plant's initial values.  Parameters that
        it estimates beside the states count as known.
        """
        plant = self.estimator.plant
        model, d, p = plant.model, plant.nominal[1], self._parameters(estimate)
        x = plant.initial
        places = [model.states.index(name) for name in estimate.names]
        x[places] = estimate.state
        y, C = (block.full() for block in self._seen(x, command, d, p))
        H = C[:, places]
        return y.ravel(), H @ estimate.covariance @ H.T + np.diag(self._variance)

    def _parameters(self, estimate: Estimate) -> np.ndarray:
        """Those of the plant, (n_p,), where the notes of an estimate know none better."""
        plant, told = self.estimator.plant, estimate.notes
        pairs = zip(plant.model.parameters, plant.nominal[2], strict=True)
        added = ((name, value + told.get(f"unknown {name}", 0.0)) for name, value in pairs)
        return np.array([told.get(f"estimated {name}", value) for name, value in added])

    @cached_property
    def _seen(self) -> ca.Function:
        """(x, u, d, p) -> (y, dy/dx)."""
        model = self.estimator.plant.model
        slope = ca.densify(ca.jacobian(model.outputs, model.symbols[0]))
        return ca.Function("seen", [*model.symbols], [model.outputs, slope])

    @cached_property
    def _variance(self) -> np.ndarray:
        noise = self.estimator.measurement_noise
        return np.array([noise[name] ** 2 for name in self.estimator.plant.measured])
