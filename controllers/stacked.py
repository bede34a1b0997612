"""How a sampled mode goes on over a horizon, all samples in one vector."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linearize.modes import Mode
from linearize.standard import PRESSURES, VELOCITY


def pushed_mode(mode: Mode, area_m2: float) -> Mode:
    """The mode with a force of 1 N on the slide: as much as 1 / area of pressure a."""
    v, pressure = (mode.state_names.index(name) for name in (VELOCITY, PRESSURES[0]))
    more = np.zeros(len(mode.drift))
    more[v] = mode.A[v, pressure] / area_m2
    return replace(mode, drift=mode.drift + more)


def stacked(
    F: np.ndarray, G: np.ndarray, offset: np.ndarray, horizon: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """free, forced, drift of X = (x_1, ..., x_N): shapes (n N, n), (n N, N), (n N,)."""
    n = len(F)
    free, forced, drift = np.zeros((horizon, n, n)), np.zeros((horizon, n, horizon)), []
    power, constant = np.eye(n), np.zeros(n)
    response = []
    for i in range(horizon):
        response.append((power @ G)[:, 0])
        power, constant = F @ power, F @ constant + offset
        free[i] = power
        drift.append(constant)
        for j in range(i + 1):
            forced[i, :, j] = response[i - j]
    return free.reshape(-1, n), forced.reshape(-1, horizon), np.concatenate(drift)
