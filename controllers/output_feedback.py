"""LQG: a state feedback behind the steady Kalman filter of its mode, as one law from the outputs.

    xhat = xpred + L (y - C xpred),   u = law(xhat),   xpred' = F xhat + G u

Where commands come late the law is one of :mod:`controllers.foresight`, and the filter is told what
has arrived, as :mod:`estimators.ahead` tells it: u(-delay / T) in place of u.

The filters that run (:mod:`estimators`) follow the nonlinear plant; near a mode's point they tend
to this one, so its margins are those of the whole loop there.  LQG has no margins of its own by
right: they must be looked at.

Source: J. C. Doyle, "Guaranteed margins for LQG regulators", IEEE Trans. Autom. Control 23 (1978)
756.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from controllers.foresight import sent_at, under_way
from controllers.margins import Law
from linearize.discrete import sampled
from linearize.modes import Mode


def lqg_law(
    mode: Mode,
    law: Law,
    process_noise: Mapping[str, float],
    measurement_noise: Mapping[str, float],
    sample_time_s: float,
    delay_s: float = 0.0,
) -> Law:
    """The law from the mode's states, as its outputs show them, to the opening.

    Parameters
    ----------
    process_noise
        Standard deviation that a state gains per square root of a second.
    measurement_noise
        Standard deviation by output.
    delay_s
        Of the commands, which the law foresees: its memory ends with the sent openings.
    """
    small, n, m = sampled(mode, sample_time_s), len(mode.state_names), len(law.A)
    correct = kalman_gain(mode, process_noise, measurement_noise, sample_time_s) @ mode.C
    kept, D = np.eye(n) - correct, law.D
    by_state, by_memory = _arriving(law, delay_s / sample_time_s)
    F, from_memory = small.F + small.G @ by_state, small.G @ by_memory
    A = np.block([[F @ kept, from_memory], [law.B @ kept, law.A]])
    B = np.vstack([F @ correct, law.B @ correct])
    return Law(A, B.reshape(n + m, n), np.concatenate([D @ kept, law.C]), D @ correct)


def _arriving(law: Law, late: float) -> tuple[np.ndarray, np.ndarray]:
    """What arrives over the coming sample, from xhat, (1, n), and the law's memory, (1, m)."""
    *older, now = sent_at(-late, under_way(late) + 1)
    by_state, by_memory = now * law.D, now * law.C
    by_memory[len(by_memory) - len(older) :] += older
    return by_state[None, :], by_memory[None, :]


def kalman_gain(
    mode: Mode,
    process_noise: Mapping[str, float],
    measurement_noise: Mapping[str, float],
    sample_time_s: float,
) -> np.ndarray:
    """L of the steady filter of a sampled mode, shape (n_x, n_y), solved in scaled states."""
    import control

    size = mode.scale
    F = sampled(mode, sample_time_s).F * size / size[:, None]
    grown = np.array([process_noise.get(name, 0.0) for name in mode.state_names]) / size
    noise = np.array([measurement_noise[name] for name in mode.output_names])
    C = mode.C * size / noise[:, None]
    _, P, _ = control.dlqe(
        F, np.eye(len(size)), C, np.diag(grown**2 * sample_time_s), np.eye(len(noise))
    )
    L = P @ C.T @ np.linalg.inv(C @ P @ C.T + np.eye(len(noise)))
    return L * size[:, None] / noise
