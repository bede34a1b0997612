"""How well the outputs of a plant determine its states along a run.

    P_k+1 = F_k (P_k - K_k H_k P_k) F_k' + Q        with the outputs, and with K_k = 0 without any

The covariance of the extended filter along a known path, from a start as uncertain as each state's
scale: the best that an estimator can do where errors are small.  A state that the outputs leave as
uncertain as its scale, or as it is without them, is not seen by them; where all are seen, the plant
is observable along that path, and the deviations tell how well.

Source: Jazwinski 1970, "Stochastic processes and filtering theory", Sec. 7.5 (information matrix
and stochastic observability).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.filtering import correct, predict
from workbench.plant_filter import PlantFilter

SAME = 0.9  # of the deviation at first or without outputs: what leaves more tells next to nothing
ROUNDING = 1e-9  # of a scale: what is known better, as a coil's current is, counts as certain
CERTAIN = 0.05  # of its scale: what the model alone knows that well need not be seen


@dataclass(frozen=True)
class Observed:
    """Standard deviations of the states, median along the run, with the outputs and without."""

    within: Mapping[str, float]
    without: Mapping[str, float]
    scale: Mapping[str, float]

    @property
    def unseen(self) -> tuple[str, ...]:
        """States of which the outputs tell nothing, and the model not enough."""
        return tuple(
            name
            for name, deviation in self.within.items()
            if deviation > SAME * min(self.without[name], self.scale[name])
            and deviation > CERTAIN * self.scale[name]
        )


def observed(found: PlantFilter, states: np.ndarray, commands: np.ndarray) -> Observed:
    """What the outputs of a filter say along a path of states (n_x, n) under commands (n_u, n)."""
    names, size = found.plant.model.states, found.scale
    slopes = _slopes(found).map(states.shape[1])
    F, H = (block.full() for block in slopes(states / size[:, None], commands))
    n, n_y, zero = len(size), len(found.plant.measured), np.zeros(len(size))
    half, unit = found.step_covariance / 2.0, np.eye(n_y)
    P = blind = np.eye(n)
    deviations = []
    for k in range(states.shape[1]):
        P = correct(zero, P, np.zeros(n_y), H[:, k * n : (k + 1) * n], unit)[1]
        deviations.append((np.sqrt(P.diagonal()), np.sqrt(blind.diagonal())))
        step = F[:, k * n : (k + 1) * n]
        P, blind = (predict(zero, each + half, step, half)[1] for each in (P, blind))
    known = np.median(deviations, axis=0)
    within, without = np.where(known < ROUNDING, 0.0, known) * size
    return Observed(
        *(dict(zip(names, map(float, v), strict=True)) for v in (within, without, size))
    )


def _slopes(found: PlantFilter) -> ca.Function:
    """(X, u) -> (F, H), H for outputs in units of their noise."""
    model, (_, d, p) = found.plant.model, found.plant.nominal
    X, u = ca.MX.sym("X", len(found.scale)), ca.MX.sym("u", len(model.commands))
    noise = np.array([found.measurement_noise[name] for name in model.measured])
    C = model.jacobians(found.scale * X, u, d, p)[2] * np.outer(1.0 / noise, found.scale)
    F = found.transition(X, u, ca.DM(d), ca.DM(p))
    return ca.Function("slopes", [X, u], [ca.densify(F), ca.densify(C)])
