"""What stands between a plant and its recording: a valve's spool, slow sensors, converters."""

import numpy as np


def spool_response(p, step_s: float, substeps: int) -> tuple[np.ndarray, np.ndarray]:
    """Spool at each substep and state after the last, as sums over (state, command).

    First-order lag, then second order; implicit Euler.  The valve is linear and the command
    constant over a sample, so unit responses suffice.  `p` has `valve_period_s`, `valve_damping`
    and `valve_lag_s` of shape (n,); the results have shapes (substeps, 4, n) and (3, 4, n), with
    the state (lagged command, spool, spool increment of one step).
    """
    period = p.valve_period_s / (2 * np.pi * step_s)
    lag = 1 - np.exp(-step_s / np.maximum(p.valve_lag_s, 1e-12))
    n = len(lag)
    state = np.zeros((3, 4, n))
    state[[0, 1, 2], [0, 1, 2]] = 1.0
    command = np.zeros((4, n))
    command[3] = 1.0
    spool = np.empty((substeps, 4, n))
    for j in range(substeps):
        lagged = state[0] + lag * (command - state[0])
        move = (period**2 * state[2] + lagged - state[1]) / (
            period**2 + 2 * p.valve_damping * period + 1
        )
        state = np.stack([lagged, state[1] + move, move])
        spool[j] = state[1]
    return spool, state


def sensor_weights(lag_s, step_s: float, substeps: int) -> tuple[np.ndarray, np.ndarray]:
    """First-order lag of a reading over one sample: share of the old one, weights of substeps."""
    keep = np.exp(-step_s / np.maximum(lag_s, 1e-12))
    powers = keep ** np.arange(substeps - 1, -1, -1)[:, None]
    return keep**substeps, ((1 - keep) * powers)[:, None, :]


def quantised(value: np.ndarray, step: float) -> np.ndarray:
    """What a converter of this step makes of a value."""
    return step * np.round(value / step)
